"""Starts on planes of symmetry of walls that move, along the axes: speeds towards a wall are exactly 0 there.

A plain event loop says when the flight first leaves the admissible side: until then the particle is on its parabola
and meets nothing, and just after it has met something.
"""

import functools
from typing import Any

import numpy as np
import pytest
from bounded import bounded
from conftest import every_pair, gaps_along

import swarm
from swarm.motion import pose

pytestmark = pytest.mark.physics

MOST, LONGEST = 300, 0.2
MOTIONS: dict[str, Any] = {
    "turned by 1 rad/s": swarm.Rotation((0, 1, 0), 1.0, (0, 0, 0)),
    "turned back": swarm.Rotation((0, 1, 0), -3.0, (0, 0, 0)),
    "turned by nothing": swarm.Rotation((0, 1, 0), 0.0, (0, 0, 0)),
    "turned about gravity": swarm.Rotation((0, 0, 1), 2.0, (0, 0, 0)),
    "turned off its middle": swarm.Rotation((1, 0, 0), 1.0, (0, 0.05, 0)),
    "shaken": swarm.Oscillation((0, 0, 0.01), 2.0),
    "shaken and turned": swarm.Oscillation((0.01, 0, 0), 2.0) + swarm.Rotation((0, 1, 0), 1.0, (0, 0, 0)),
    "carried and turned": swarm.Translation((0, 0, 0.1)) + swarm.Rotation((0, -1, 0), 1.0, (0, 0, 0)),
}
SURFACES = {
    "box": lambda motion: swarm.Box((0.1, 0.1, 0.1), motion=motion),
    "cylinder": lambda motion: swarm.Cylinder(0.1, axis=(1, 0, 0), length=0.2, motion=motion),
    "ellipsoid": lambda motion: swarm.Ellipsoid((0.1, 0.12, 0.15), motion=motion),
    "ball": lambda motion: swarm.Sphere(0.1, center=(0.02, 0, 0), motion=motion),
}
STARTS = [
    ((0.0, 0.02, -0.05), (0.3, 0.0, 0.0)),
    ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ((0.0, 0.0, 0.05), (0.0, 0.3, 0.0)),
    ((0.02, 0.0, 0.0), (0.0, 0.0, 1.0)),
    ((0.0, -0.05, 0.0), (-0.3, 0.0, 0.0)),
]


TIMES = np.linspace(0.0, LONGEST, 201)[1:]


@functools.cache
def poses_of(motion):
    return [pose(MOTIONS[motion], time) for time in TIMES.tolist()]


def first_exit(scene, still, poses, fall):
    """When the flight first leaves the admissible side, by looking; infinite if not soon."""

    def outside(time):
        return scene.gaps(fall(time)[:, None], time).max() > 0.0

    is_outside = gaps_along(still, poses, np.transpose([fall(time) for time in TIMES])).max(axis=0) > 0.0
    if not is_outside.any():
        return np.inf
    late = is_outside.argmax()
    low, high = TIMES[late] - TIMES[0], TIMES[late]
    for _k in range(25):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if outside(middle) else (middle, high)
    return high


@every_pair(
    motion=list(MOTIONS),
    surface=list(SURFACES),
    gravity={"down": (0.0, 0.0, -9.81), "sideways": (9.81, 0.0, 0.0), "none": None},
)
def test_a_flight_is_as_long_as_it_is(motion, surface, gravity, monkeypatch):
    scene, still = (swarm.Scene([SURFACES[surface](one)], gravity=gravity) for one in (MOTIONS[motion], None))
    poses, pull = poses_of(motion), np.array(gravity or (0.0, 0.0, 0.0))
    for start, speed in STARTS:
        r, v = np.array(start), np.array(speed)

        def fall(time, r=r, v=v):
            return r + time * v + 0.5 * time * time * pull

        meets = first_exit(scene, still, poses, fall)
        end = min(0.999 * meets, LONGEST)
        free = run(scene, r, v, end, monkeypatch)
        assert free.observables["impacts"][-1] == 0
        assert np.abs(free.particles.position[:, 0] - fall(end)).max() < 1e-15
        if np.isfinite(meets):
            assert run(scene, r, v, 1.001 * meets, monkeypatch).observables["impacts"][-1] == 1


def run(scene, r, v, until, monkeypatch):
    with monkeypatch.context() as patch:
        bounded(patch, MOST)
        particles = swarm.Particles(r, v)
        return swarm.simulate(scene, particles, swarm.Impact(), until=until, compile="never", threads=1)
