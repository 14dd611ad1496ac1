"""What holds for every method of the table."""

import numba
import pytest
from conftest import METHODS
from same_bits import require_same
from test_tiers import assert_same_bits

import swarm

pytestmark = pytest.mark.physics
FIXED = swarm.AugmentedLagrangian(dt=1.0 / 64.0, penalty=1e4, on_unconverged="count", max_sweeps=10)
CASES = {**METHODS, "augmented Lagrangian, fixed steps": FIXED}

# A cavity and a solid that meet in an edge; spheres are compiled soonest.
SCENE = swarm.Scene([swarm.Sphere(0.55), swarm.Sphere(0.3, (0.0, 0.0, -0.5), side="outside")])


@pytest.mark.parametrize("name", CASES)
def test_threads_blocks_and_tiers_change_no_bit(name, monkeypatch):
    """With an edge, a solid, blocks that end in the middle of a chunk of particles, and one thread too many.

    All in one test: its kernels are compiled once.
    """
    particles = swarm.fill(SCENE, 1001, speed=0.5, seed=8)
    runs = [
        swarm.simulate(
            SCENE, particles, CASES[name], until=3.0, every=1.0, threads=threads, block_size=size, compile="always"
        )
        for threads, size in ((1, None), (2, None), (3, 700), (2, 10_000))
    ]
    first = runs[0]
    assert first.observables["impacts"][-1] > 1001
    for other in runs[1:]:
        require_same(first, other)
    if not numba.config.DISABLE_JIT:
        assert_same_bits(monkeypatch, SCENE, CASES[name])
