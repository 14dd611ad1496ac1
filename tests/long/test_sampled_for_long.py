"""Ten million impacts in surfaces from data, straight and falling, from starts that graze: nothing is lost."""

import numpy as np
import pytest

import swarm

pytestmark = pytest.mark.long

IMPACTS, EVERY, N = 10_000_000, 2.0, 500
# Round-off of an impact, times the root of their number.
ENERGY = 1e-11


def sampled(formula, reach, n=33):
    axis = np.linspace(-reach, reach, n)
    x, y, z = axis[:, None, None], axis[:, None], axis
    values = formula(x, y, z) + 0.0 * (x + y + z)
    return swarm.Sampled(values, axis[1] - axis[0], (-reach, -reach, -reach))


SURFACES = {
    "sphere": lambda: sampled(lambda x, y, z: np.sqrt(x * x + y * y + z * z) - 0.5, 0.55),
}


def grazing(scene, n):
    """Half of them anywhere; half on the wall or next to it, along it, or nearly so."""
    start, random = swarm.fill(scene, n, speed=1.0, seed=3), np.random.default_rng(4)
    (surface,), half = scene.surfaces, n // 2
    points = start.position[:, :half].copy()
    for _ in range(60):
        slope = surface.gradient(points)
        step = surface.phi(points) / (slope**2).sum(axis=0)
        points -= np.clip(step, -0.05, 0.05) * slope
    slope = surface.gradient(points)
    normal = slope / np.sqrt((slope**2).sum(axis=0))
    points -= random.choice([0.0, 1e-15, 1e-12, 1e-8, 1e-4], half) * normal
    along = np.cross(normal, random.normal(size=(3, half)), axis=0)
    along /= np.sqrt((along**2).sum(axis=0))
    good = np.isfinite(points).all(axis=0) & (np.abs(surface.phi(points)) < 1e-3)
    start.position[:, :half][:, good] = points[:, good]
    lean = random.choice([0.0, 1e-15, -1e-15, 1e-9, -1e-6, -1e-3], half)
    start.velocity[:, :half][:, good] = (along + lean * normal)[:, good]
    assert good.mean() > 0.9
    return start


@pytest.mark.parametrize("gravity", [None, (0.3, -0.2, -1.0)], ids=["straight", "falling"])
@pytest.mark.parametrize("name", SURFACES)
def test_ten_million_impacts(name, gravity):
    scene = swarm.Scene([SURFACES[name]()], gravity)
    start, impacts, session = grazing(scene, N), 0, 0
    while impacts < IMPACTS // (2 * len(SURFACES)):
        # A particle outside by more than round-off ends the run; a hang would be stalled, or take for ever.
        result = swarm.simulate(scene, start, swarm.Impact(), until=10.0, every=EVERY, compile="always", threads=1)
        seen, session = result.observables, session + 1
        impacts += int(seen["impacts"][-1])
        assert seen["max_penetration"].max() < 1e-13
        assert seen["energy_error"].max() < ENERGY
        assert np.isfinite(result.particles.position).all()
        assert (scene.gaps(result.particles.position) < 1e-13).all()
        start = result.particles
    print(f"{name}: {impacts} impacts, energy error {seen['energy_error'].max():.2g}")
