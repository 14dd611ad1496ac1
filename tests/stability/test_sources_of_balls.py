"""Random vessels that random sources of balls and of soft grains fill: no birth overlaps, and every joule is booked.

A failure is repeated by `fed(seed, kind, steps, compile)`.
"""

import itertools
import math

import numpy as np
import pytest
from test_grains_together import UNBOOKED, a_scene

import swarm

SEEDS = range(40)


def fed(seed, kind, steps, compile):
    """A vessel of `test_grains_together`, empty at the start, with two sources."""
    scene, start, method = a_scene(seed)
    random, middle = np.random.default_rng([58, seed]), 0.75 if scene.period else 0.0
    largest, until = float(start.radius.max()), steps * method.dt
    sources = [
        swarm.Source(
            swarm.Sphere(0.3, center=(middle, middle, 0.0)), volume=True,
            rate=float(random.choice([50.0, 400.0])) / until, even=bool(random.integers(2)),
            speed=float(random.choice([0.0, 0.5, 2.0])), density=300.0,
            radius=[largest, (0.4 * largest, largest)][random.integers(2)],
            blocked=["wait", "report"][random.integers(2)],
        )
        for _both in range(2)
    ]  # fmt: skip
    method = method if kind == "grains" else swarm.Impact()
    result = swarm.simulate(
        scene, None, method, until=until, every=until / 4, sources=sources, seed=seed, compile=compile
    )
    seen, there = result.observables, result.particles.born()
    assert seen["energy_error"].max() < UNBOOKED
    assert seen["born"][-1].sum() == np.isfinite(result.birth_time).sum() == len(there) >= 2
    assert (np.diff(seen["blocked"], axis=0) >= 0).all()
    if kind == "balls":
        assert seen["max_penetration"].max() < 1e-12
        for i, j in itertools.combinations(range(len(there)), 2):
            away = there.position[:, i] - there.position[:, j]
            for axis, length in enumerate(scene.period or ()):
                away[axis] -= 0.0 if length is None else length * round(away[axis] / length)
            assert math.hypot(*away) > (1.0 - 1e-12) * (there.radius[i] + there.radius[j])
    return result


@pytest.mark.parametrize("kind", ["balls", "grains"])
@pytest.mark.parametrize("seed", SEEDS[:3])
def test_a_vessel_is_filled(seed, kind):
    fed(seed, kind, 32, "never")


@pytest.mark.long
@pytest.mark.parametrize("kind", ["balls", "grains"])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_vessel_is_filled_for_long(seed, kind):
    fed(seed, kind, 500, "always")
