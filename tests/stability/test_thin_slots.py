"""Two walls nearer to each other than a place has digits: a particle between them goes on along both.

How far apart they are, or how far from the origin, is no length of the motion: what is a part of it would be too short
to change a time, and the pull of gravity nothing beside |v|^2 over it.
"""

import math

import numpy as np
import pytest
from bounded import bounded

import swarm

pytestmark = pytest.mark.physics

GAPS = [1e-300, 1e-30, 1e-16, 1e-13, 1e-11, 1e-9]
PULL, UNTIL, MOST = 9.81, 0.5, 500
ALONG = np.array([1.0, 0.5, 0.0])
# A rotation by no round angle: the Householder reflections of two vectors that are not parallel.
TILTED = (np.eye(3) - 2.0 * np.outer([0.6, 0.0, 0.8], [0.6, 0.0, 0.8])) @ (np.eye(3) - 2.0 * np.full((3, 3), 1.0 / 3.0))


def planes(gap, turn, **laws):
    n = turn @ (0.0, 0.0, 1.0)
    return [swarm.Plane(tuple(n), gap, **laws), swarm.Plane(tuple(-n), 0.0, **laws)]


def slid(friction):
    """How far a particle of unit speed comes with friction, and how fast it is then, for gravity across the slot."""
    left = 1.0 - friction * PULL * UNTIL / math.hypot(*ALONG)
    return UNTIL * 0.5 * (1.0 + left), left


@pytest.mark.parametrize("gap", GAPS)
@pytest.mark.parametrize("closed", [True, False], ids=["in a box", "open"])
@pytest.mark.parametrize("turn", [np.eye(3), TILTED], ids=["straight", "tilted"])
@pytest.mark.parametrize(("pull", "restitution", "friction"), [(0.0, 1.0, 0.0), (1.0, 1.0, 0.0), (1.0, 0.5, 0.1)])
def test_between_parallel_planes(gap, closed, turn, pull, restitution, friction, monkeypatch):
    bounded(monkeypatch, MOST)
    surfaces = planes(gap, turn, restitution=restitution, friction=friction)
    surfaces += [swarm.Box((2.0, 2.0, 2.0))] if closed else []
    gravity = tuple(turn @ (0.0, 0.0, -PULL)) if pull else None
    end = run(swarm.Scene(surfaces, gravity=gravity), turn @ ALONG)
    way, left = slid(friction * pull)
    assert np.abs(turn.T @ end.position[:, 0] - way * ALONG).max() < 1e-9
    assert np.abs(turn.T @ end.velocity[:, 0] - left * ALONG).max() < 1e-9


@pytest.mark.parametrize("gap", GAPS)
@pytest.mark.parametrize("pull", [0.0, PULL])
def test_a_bounce_between_them_that_loses_ends(gap, pull, monkeypatch):
    """The speed across halves at each impact, down to the round-off of the speed along: nothing is left of it."""
    bounded(monkeypatch, MOST)
    gravity = (0.0, 0.0, -pull) if pull else None
    scene = swarm.Scene(planes(gap, np.eye(3), restitution=0.5), gravity=gravity)
    end = run(scene, np.add(ALONG, (0.0, 0.0, 1e-9)))
    assert np.abs(end.position[:, 0] - UNTIL * ALONG).max() < 1e-8
    assert np.abs(end.velocity[:, 0] - ALONG).max() < 2e-9


@pytest.mark.parametrize("width", [1e-99, 1e-30, 1e-15, 1e-12, 1e-9])
@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_in_a_box_of_no_width(width, friction, monkeypatch):
    """It falls to the floor, and slides: that it falls for a moment first is round-off, or up to 1e-5 of a second."""
    bounded(monkeypatch, MOST)
    box = swarm.Box((2.0, 2.0, width), restitution=0.5, friction=friction)
    end = run(swarm.Scene([box], gravity=(0.0, 0.0, -PULL)), ALONG)
    way, left = slid(friction)
    assert np.abs(end.position[:, 0] - way * ALONG).max() < 1e-8
    assert np.abs(end.velocity[:, 0] - left * ALONG).max() < 1e-8


@pytest.mark.parametrize("gap", [0.0, 1e-300, 1e-30, 1e-16, 1e-13, 1e-9])
@pytest.mark.parametrize("restitution", [1.0, 0.5])
def test_between_concentric_spheres(gap, restitution, monkeypatch):
    bounded(monkeypatch, MOST)
    outer = swarm.Sphere(0.5, restitution=restitution)
    inner = swarm.Sphere(0.5 - gap, side="outside", restitution=restitution)
    end = run(swarm.Scene([outer, inner]), (0.0, 1.0, 0.0), (0.5, 0.0, 0.0))
    circle = np.array([math.cos(2.0 * UNTIL), math.sin(2.0 * UNTIL), 0.0])
    assert np.abs(end.position[:, 0] - 0.5 * circle).max() < 1e-8
    assert abs(np.linalg.norm(end.velocity[:, 0]) - 1.0) < 1e-14


@pytest.mark.parametrize("offset", [0.0, 1e-300, 1e-16, 1e-13, 1e-9])
@pytest.mark.parametrize("speed", [1.0, 300.0])
def test_a_floor_near_the_origin_carries(offset, speed, monkeypatch):
    """The distance of the only wall from the origin says nothing of what happens on it."""
    bounded(monkeypatch, MOST)
    floor = swarm.Plane((0.0, 0.0, -1.0), offset, restitution=0.5, friction=0.1)
    start = swarm.Particles((0.0, 0.0, -offset), speed * ALONG)
    scene = swarm.Scene([floor], gravity=(0.0, 0.0, -PULL))
    result = swarm.simulate(scene, start, swarm.Impact(), until=UNTIL, compile="never", threads=1)
    left = speed - 0.1 * PULL * UNTIL / math.hypot(*ALONG)
    assert np.abs(result.particles.velocity[:, 0] - left * ALONG).max() < 1e-9 * speed
    assert result.observables["sliding_time"][-1] == pytest.approx(UNTIL, rel=1e-9)


def run(scene, velocity, start=(0.0, 0.0, 0.0)):
    """The particle at the end; it is never outside by more than round-off."""
    particles = swarm.Particles(start, velocity)
    result = swarm.simulate(scene, particles, swarm.Impact(), until=UNTIL, compile="never", threads=1)
    assert result.observables["max_penetration"].max() < 1e-12
    assert result.observables["energy_error"][-1] < 1e-14
    return result.particles
