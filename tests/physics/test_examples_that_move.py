"""The examples of walls that move, with few particles: the facts that they are there to show."""

import math
from pathlib import Path

import numpy as np
import pytest
from energy_books import unbooked

import swarm
from examples import fermi, piston
from swarm import scene_file

pytestmark = pytest.mark.physics
SCENES = Path(__file__).parents[2] / "examples" / "scenes"


def test_a_slow_piston_heats_its_gas_by_the_adiabatic_law(compiled_at_once):
    """T V^(2/3) where balls mix the directions, T_z L^2 where nothing does and the others keep their energy."""
    mixed, straight = (piston.run(400, 0.01, frames=4, balls=balls) for balls in (True, False))
    law = mixed.volume ** (-2.0 / 3.0)
    assert np.abs(mixed.temperature / law - 1.0)[-1] <= 3.0 * (mixed.error / law)[-1] <= 0.03
    # The spheres take some of the volume, so that it shrinks by more than the length.
    assert mixed.volume[-1] < piston.LEFT
    assert straight.along[0] * piston.LEFT**2 == pytest.approx(1.0, abs=5e-3)
    assert straight.temperature[-1] == pytest.approx((2.0 + straight.along[0]) / 3.0, rel=0.05)
    for found in (mixed, straight):
        assert found.impacts > 10_000
        assert found.balance <= 1e-13


def test_the_bound_of_fermis_accelerator():
    """Slow particles stay below the first curve that they cannot cross, fast ones near their speed."""
    speeds = np.array([0.05, 0.1, 0.15, 0.2, 0.25, 1.6, 1.8, 2.0])
    places, velocities = fermi.run(speeds, 500)
    assert places.shape == velocities.shape == (501, 8)
    slow = speeds < 1.0
    # The wall's largest speed is 0.02 m/s, and 500 periods are 30 to 500 impacts on it.
    assert 0.2 <= np.abs(velocities[:, slow]).max() <= 0.5
    assert np.ptp(np.abs(velocities[:, ~slow]), axis=0).max() <= 0.06


def grains(name, count, until):
    """Observables, and the grains at the end, of a shipped scene with so many of them."""
    job = scene_file.read(SCENES / f"{name}.toml")
    start = swarm.fill(job.scene, count, speed=0.3, seed=0)
    result = swarm.simulate(job.scene, start, job.method, until=until, every=0.1)
    seen = result.observables
    assert unbooked(seen) <= 1e-13 * np.abs(seen["total_energy"]).max()
    assert seen["max_penetration"].max() <= 1e-15
    return seen, result.particles


def test_a_shaker_keeps_its_grains_in_motion():
    """What its floor gives is what impacts take, once the grains have fallen on it."""
    seen, end = grains("shaker", 60, 1.5)
    later = seen["time"] >= 0.5
    kinetic, work, lost = (seen[name][later] for name in ("kinetic_energy", "wall_work", "dissipated_energy"))
    # 3 g throw a grain with the floor's 0.23 m/s at least: 60 of 1 kg have 1.6 J.
    assert 1.0 <= kinetic.min() <= kinetic.max() <= 6.0
    assert (np.diff(work[:, 1]) > 0.0).all()
    assert work[-1, [0, 2]].tolist() == [0.0, 0.0]
    assert work[-1, 1] - work[0, 1] == pytest.approx(lost[-1] - lost[0], rel=0.05)
    assert (end.position[2] < 0.1).all()


def test_a_drum_lifts_its_grains_to_the_side_that_rises():
    """By about the angle of friction, to the side to which the bottom goes."""
    seen, end = grains("drum", 60, 2.0)
    x, _y, z = end.position.mean(axis=1)
    assert math.atan2(x, -z) == pytest.approx(math.atan(0.6), abs=0.2)
    assert (np.diff(seen["wall_work"][5:, 0]) > 0.0).all()
    assert seen["sliding"][-1] == 60
