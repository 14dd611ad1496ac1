"""The order of contact steps: distances from the rigid billiard over their length, begun at the impact or centred.

`Impact()` is the billiard, exact to round-off. The ends are those of some particles after a few impacts each; the error
is their median, since a step that the end of the run cuts is nearer than the others.
"""

from typing import Any, NamedTuple

import numpy as np

import swarm
from swarm.methods.base import Method

STEPS = tuple(2.0**-k for k in (6, 7, 8, 9))
STARTS = ("impact", "centred")
_PARTICLES, _UNTIL = 5, 1.8
_FALL = (0.3, 0.0, -2.0)
# A sphere keeps particles near the solid.
_AROUND = swarm.Sphere(1.0)
SCENES: dict[str, swarm.Scene] = {
    "box": swarm.Scene([swarm.Box((0.3, 0.4, 0.5))]),
    "box, falling": swarm.Scene([swarm.Box((0.3, 0.4, 0.5))], _FALL),
    "sphere": swarm.Scene([swarm.Sphere(0.5)]),
    "sphere, falling": swarm.Scene([swarm.Sphere(0.5)], _FALL),
    "cylinder": swarm.Scene([swarm.Cylinder(0.4, (1.0, 0.0, 1.0), 1.0)]),
    "ball in a sphere": swarm.Scene([swarm.Sphere(0.5, side="outside"), _AROUND]),
    "torus": swarm.Scene([swarm.Torus(0.5, 0.3)]),
    "ellipsoid": swarm.Scene([swarm.Ellipsoid((0.3, 0.3, 0.6))]),
    "solid ellipsoid": swarm.Scene([swarm.Ellipsoid((0.4, 0.4, 0.6), side="outside"), _AROUND]),
    "quartic": swarm.Scene([swarm.Formula("x**2/0.09 + y**2/0.09 + z**4/0.13 - 1")]),
}


# Those of a quick run.
QUICK = ("box, falling", "sphere", "torus")


class Order(NamedTuple):
    """The errors [m] at the lengths of `steps`, and the slope between each two of them; the worst energy and depth."""

    errors: tuple[float, ...]
    slopes: tuple[float, ...]
    energy: float
    penetration: float


def impact(h: float, start: str) -> Method:
    """`Impact` with a contact step."""
    return swarm.Impact(contact_step=h, contact_start=start)


def uzawa(h: float, start: str) -> Method:
    """`AugmentedLagrangian` with loops that end at round-off; the penalty grows as 1/h^2."""
    stiff = {"penalty": 9.0 / (h * h), "tolerance": 1e-28, "max_sweeps": 500}
    return swarm.AugmentedLagrangian(dt=h, adaptive=True, acceleration="reflection", contact_start=start, **stiff)


METHODS = {"Impact": impact, "AugmentedLagrangian": uzawa}


def start_of(scene: swarm.Scene) -> swarm.Particles:
    """Particles at 1 m/s, which fly at a solid where there is one."""
    made = swarm.fill(scene, _PARTICLES, speed=1.0, seed=2)
    if not scene.surfaces[0].is_solid():
        return made
    towards = 0.2 * made.velocity - made.position
    return swarm.Particles(made.position, towards / np.linalg.norm(towards, axis=0))


def order(name: str, method: Any, start: str, steps: tuple[float, ...] = STEPS) -> Order:
    """The `Order` of a method in a scene."""
    scene, particles = SCENES[name], start_of(SCENES[name])
    exact = swarm.simulate(scene, particles, swarm.Impact(), until=_UNTIL, compile="never").particles.position
    errors, energy, depth = [], 0.0, 0.0
    for h in steps:
        run = swarm.simulate(scene, particles, method(h, start), until=_UNTIL, compile="never")
        errors.append(float(np.median(np.linalg.norm(run.particles.position - exact, axis=0))))
        energy = max(energy, float(run.observables["energy_error"].max()))
        depth = max(depth, float(run.observables["max_penetration"].max()))
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = np.diff(np.log(errors)) / np.diff(np.log(steps))
    return Order(tuple(errors), tuple(map(float, slopes)), energy, depth)


def main(quick: bool) -> None:
    """Print the errors and the orders of every scene."""
    steps = STEPS[:2] if quick else STEPS
    print(f"{'error [m] at h =':<42}" + "".join(f"{h:10.2g}" for h in steps) + "   order     energy   outside")
    for name in QUICK if quick else SCENES:
        scene = SCENES[name]
        for method, make in METHODS.items():
            for start in STARTS if scene.gravity is None or method == "Impact" else ():
                found = order(name, make, start, steps)
                told = "  exact" if found.errors[0] < 1e-12 else f"{found.slopes[-1]:7.3f}"
                numbers = "".join(f"{one:10.2e}" for one in found.errors)
                kept = f"{found.energy:10.1e}{found.penetration:10.1e}"
                print(f"{name:<17}{method + ', ' + start:<28}{numbers} {told} {kept}", flush=True)
