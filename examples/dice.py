"""A thousand cubes in a box: their energies of translation and of rotation become equal.

    python examples/dice.py

A rigid body is four points with the mass, centre and inertia of the solid; its eight corners touch the walls.
At the start all energy is that of translation. Walls without friction or losses share it out over the six freedoms.
"""

import itertools

import numpy as np

import swarm

EDGE, DENSITY, STEP = 0.1, 1000.0, 0.01


def dice(count: int = 1000, until: float = 60.0, every: float = 5.0) -> swarm.Result:
    """The run; one frame in `every` seconds is kept in memory as observables."""
    corners = 0.5 * EDGE * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    scene = swarm.Scene([swarm.Box((0.5, 0.4, 0.3))])
    start = swarm.place(scene, swarm.rigid(corners, DENSITY), count, speed=1.0, seed=1)
    return swarm.simulate(scene, start, swarm.Impact(dt=STEP), until=until, every=every)


def energies(bodies: swarm.Bodies) -> tuple[float, float]:
    """Of translation and of rotation [J]."""
    mass = np.diag(bodies.body.mass_matrix)
    whole = 0.5 * np.einsum("p,xpn->", mass, bodies.velocity**2)
    centre = np.einsum("p,xpn->xn", mass, bodies.velocity) / mass.sum()
    translation = 0.5 * mass.sum() * float((centre**2).sum())
    return translation, float(whole) - translation


def main() -> None:
    """Run and print."""
    result = dice()
    assert result.bodies is not None
    translation, rotation = energies(result.bodies)
    seen = result.observables
    print(f"{seen['impacts'][-1]} impacts of {len(result.bodies)} cubes")
    print(f"translation : rotation = {translation / rotation:.3f} : 1 at the end, all translation at the start")
    print(f"worst energy error of a cube {seen['energy_error'].max():.1e}, of a length {seen['link_error'].max():.1e}")
    print(f"deepest corner {seen['max_penetration'].max():.1e} m outside")


if __name__ == "__main__":
    main()
