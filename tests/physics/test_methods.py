"""What holds for every method of the table."""

import numpy as np
import pytest
from conftest import METHODS

import swarm

pytestmark = pytest.mark.physics

SCENE = swarm.Scene([swarm.Sphere(0.5), swarm.Plane((0.0, 0.0, -1.0), 0.3), swarm.Sphere(0.1, side="outside")])


@pytest.mark.parametrize("name", METHODS)
def test_threads_and_block_sizes_change_no_bit(name):
    """With edges, a solid, blocks that end in the middle of a chunk of particles, and one thread too many."""
    particles = swarm.fill(SCENE, 3001, speed=0.5, seed=8)
    runs = [
        swarm.simulate(SCENE, particles, METHODS[name], until=3.0, every=1.0, threads=threads, block_size=size)
        for threads, size in ((1, None), (2, None), (3, 700), (2, 10_000))
    ]
    first = runs[0]
    assert first.observables["impacts"][-1] > 3001
    for other in runs[1:]:
        assert np.array_equal(first.particles.position, other.particles.position)
        assert np.array_equal(first.particles.velocity, other.particles.velocity)
        for key, seen in first.observables.items():
            assert np.array_equal(seen, other.observables[key]), key
