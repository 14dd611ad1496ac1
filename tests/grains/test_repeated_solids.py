"""Soft balls and listed solids in a cell that repeats: each solid is a wall of its own, with its images."""

import numpy as np
import pytest

import swarm

PLACES = [(1.2, 1.1, 1.0), (0.75, 0.9, 1.1), (1.0, 1.3, 0.8), (1.3, 0.65, 1.3), (0.7, 1.35, 1.3), (1.25, 0.7, 0.6)]


@pytest.mark.parametrize("count", [3, 6])
def test_listed_solids_are_the_field_of_them(count):
    ends = []
    places = [*PLACES[:count], (0.05, 1.0, 1.0)]  # one reaches over a face
    for solids in ([swarm.Sphere(0.2, place, "outside") for place in places], [swarm.Spheres(places, 0.2)]):
        scene = swarm.Scene(solids, period=(2.0, 2.0, 2.0))
        start = swarm.Particles([[1.8, 0.4], [1.0, 1.1], [1.0, 1.05]], [[-0.9, -0.8], [0.1, 0.0], [0.05, 0.02]])
        start.radius = np.array([0.05, 0.05])
        result = swarm.simulate(scene, start, swarm.Penalty(5e-3, 4e3), until=0.8, compile="never")
        assert result.observables["impacts"][-1] > 0
        ends.append(result.particles.position)
    assert np.abs(ends[0] - ends[1]).max() < 1e-12
