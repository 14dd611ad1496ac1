"""Contacts of grains by the members that they begin on: bodies, triangles, sides, and the walls of surfaces."""

import numpy as np
import pytest
from cut_short import in_sessions
from grains_runs import ran

import swarm
from swarm.grains.grains_run import GrainsRun

SOFT = swarm.Penalty(2e-3, 4e3)
# Two triangles in one plane, and one beyond an edge.
CORNERS = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0), (2.0, 0.5, 0.5)])
SHEET = swarm.Mesh(vertices=CORNERS, triangles=[(0, 1, 2), (0, 2, 3), (1, 4, 2)], open=True)


def falls(scene, places, until=0.12, speed=(0.0, 0.0, -2.0), **more):
    places = np.array(places, float).T
    start = swarm.Particles(places, np.tile(np.array([speed]).T, places.shape[1]), 0.1, radius=0.05)
    return ran(scene, start, SOFT, until, member_impacts=True, **more)


def test_a_ball_counts_for_the_triangle_below_it():
    places = [(0.7, 0.3, 0.2), (0.3, 0.7, 0.2), (0.2, 0.8, 0.12), (1.5, 0.5, 0.4)]
    result = falls(swarm.Scene([SHEET], gravity=None), places)
    assert [counts.tolist() for counts in result.member_impacts] == [[1, 2, 1]]
    assert result.impacts_per_particle.tolist() == [1, 1, 1, 1]


@pytest.mark.parametrize("period", [None, (1.0, 1.0, None)])
def test_bodies_of_a_field_and_other_walls_have_their_own(period):
    """In a cell that repeats, a body at its corner is met at an image of it."""
    bodies = swarm.Spheres([(0.5, 0.5, 0.0), (0.02, 0.02, 0.0), (0.5, 0.02, 0.0)], 0.1)
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.5), bodies], gravity=None, period=period)
    other = (0.02, 0.02, 0.3) if period is None else (0.97, 0.97, 0.3)
    result = falls(scene, [(0.5, 0.5, 0.3), other, (0.5, 0.02, 0.25), (0.25, 0.25, -0.4)])
    assert [counts.tolist() for counts in result.member_impacts] == [[1], [1, 1, 1]]


def test_sides_of_an_outline_that_moves_and_sessions(tmp_path, monkeypatch):
    """The sum is that of all impacts, also of a run in many sessions."""
    prism = swarm.Prism(
        [(-0.1, -0.1), (0.1, -0.1), (0.0, 0.1)], 0.2, motion=swarm.Rotation((0.0, 0.0, 1.0), 4.0), restitution=0.8
    )
    start = swarm.Particles((0.0, 0.0, 0.0), (1.0, 0.3, 1.2), 0.1, radius=0.03)
    options = {"member_impacts": True, "every": 0.1}
    whole = ran(swarm.Scene([prism], gravity=None), start, swarm.Penalty(4e-3, 1e3), 0.2, **options)
    options |= {"trajectory": tmp_path / "run.h5", "resume": True, "checkpoint": 1e3}
    result, sessions = in_sessions(
        monkeypatch,
        GrainsRun,
        15,
        lambda: ran(swarm.Scene([prism], gravity=None), start, swarm.Penalty(4e-3, 1e3), 0.2, **options),
    )
    assert sessions > 2
    (counts,) = result.member_impacts
    assert counts.tolist() == whole.member_impacts[0].tolist()
    assert counts.sum() == result.observables["impacts"][-1] > 2
    assert len(counts) == 5
    # The upper lid, which it meets first.
    assert counts[3] > 0


@pytest.mark.parametrize("velocity", [(0.0, 0.0, 1.2), (0.0, 0.0, -1.2), (0.0, -1.2, 0.0), (1.2, 0.0, 0.0)])
def test_members_are_those_of_impact(velocity):
    prism = swarm.Prism([(-0.1, -0.1), (0.1, -0.1), (0.0, 0.1)], 0.2)
    start = swarm.Particles((0.0, -0.02, 0.0), velocity, 0.1, radius=0.03)
    both = [
        ran(swarm.Scene([prism], gravity=None), start, method, 0.1, member_impacts=True).member_impacts[0].tolist()
        for method in (swarm.Penalty(2e-3, 4e3), swarm.Impact())
    ]
    assert both[0] == both[1]
    assert sum(both[0]) > 0
