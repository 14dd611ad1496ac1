"""Solids that are small or thin compared with the way to them: a flight at one meets it, a flight past it does not."""

import numpy as np
import pytest

import swarm
from swarm.kernel.gravity import Gravity, accelerated, displacement
from swarm.kernel.vector import vec
from swarm.surfaces import rotation as rotations
from swarm.surfaces.time_of_impact.flights import first_hit

EPSILON = float(np.finfo(float).eps)
_LEGS = 200
TURN = {"axis": (1.0, -2.0, 3.0), "angle": 1.2}
CENTER = np.array([0.3, -0.2, 0.1])
AXIS = (0.0, 0.6, 0.8)
SOLIDS = {
    "ball": lambda s: swarm.Sphere(s, CENTER, side="outside"),
    "disc": lambda s: swarm.Ellipsoid((1.0, s, 1.0), CENTER, side="outside"),
    "rotated disc": lambda s: swarm.Ellipsoid((1.0, s, 1.0), CENTER, side="outside", rotation=TURN),
    "needle": lambda s: swarm.Ellipsoid((s, 1.0, s), CENTER, side="outside"),
    "wire": lambda s: swarm.Cylinder(s, AXIS, center=CENTER, side="outside"),
    "rod": lambda s: swarm.Cylinder(s, AXIS, 1.0, center=CENTER, side="outside"),
    "capsule": lambda s: swarm.Capsule(s, 1.0, AXIS, CENTER, side="outside"),
    "quadric": lambda s: swarm.Quadric(
        np.diag([1.0, 4.0, 2.0]) / s**2, (0.1 / s, 0.0, 0.2 / s), -1.0, CENTER, side="outside"
    ),
    "paraboloid": lambda s: swarm.Paraboloid(s, (0.0, 0.0, 1.0), CENTER, side="outside"),
    "torus": lambda s: swarm.Torus(1.0, s, CENTER, side="outside"),
}
FALLS = {"straight": None, "falling": Gravity(0.3, -0.5, -1.0)}


def follow(walls, gravity, position, velocity, until):
    """Where the flight hits, or None if it does not until then; and when."""
    time, position, velocity = 0.0, vec(position), vec(velocity)
    for _leg in range(_LEGS):
        with np.errstate(divide="ignore", invalid="ignore"):
            wait, wall = first_hit(walls, gravity, position, velocity)
        if time + wait > until:
            return None, until
        position = position + displacement(gravity, velocity, wait)
        velocity = accelerated(gravity, velocity, wait)
        time += wait
        if wall >= 0.0:
            return np.array(position), time
    raise AssertionError(f"no hit, and no end, in {_LEGS} legs")


def core(name, size, random):
    """A point in the middle of the solid."""
    u, v = random.uniform(-0.4, 0.4, 2)
    way = {
        "disc": (u, 0.0, v),
        "rotated disc": rotations.matrix(rotations.quaternion("rotation", TURN)) @ (u, 0.0, v),
        "needle": (0.0, u, 0.0),
        "paraboloid": (0.0, 0.0, size),
        "torus": (np.cos(9.0 * u), np.sin(9.0 * u), 0.0),
    }
    along = u * np.array(AXIS) if name in ("wire", "rod", "capsule") else np.zeros(3)
    return CENTER + way.get(name, along)


def aimed(target, gravity, random):
    """A flight through the target from 3 to 10 m away, and when it is there."""
    way = random.standard_normal(3)
    # From below: above the vertex of a paraboloid is its own inside.
    way[2] = -abs(way[2])
    start = target + random.uniform(3.0, 10.0) * way / np.linalg.norm(way)
    time = random.uniform(0.5, 2.0)
    pull = np.zeros(3) if gravity is None else np.array(gravity)
    return start, (target - start) / time - 0.5 * pull * time, time


@pytest.mark.parametrize("size", [1e-2, 1e-5, 1e-8, 1e-12])
@pytest.mark.parametrize("fall", FALLS)
@pytest.mark.parametrize("name", SOLIDS)
def test_a_flight_at_a_solid_meets_it(name, fall, size):
    scene, gravity, random = swarm.Scene([SOLIDS[name](size)]), FALLS[fall], np.random.default_rng(7)
    for _flight in range(10):
        target = core(name, size, random) + 0.2 * size * random.uniform(-1.0, 1.0, 3)
        start, velocity, there = aimed(target, gravity, random)
        hit, time = follow(scene.compiled().walls(), gravity, start, velocity, 2.0 * there)
        assert hit is not None
        assert time <= there * (1.0 + 4.0 * EPSILON)
        assert abs(scene.distances_outside(hit)).max() <= 4.0 * EPSILON * np.linalg.norm(start)


@pytest.mark.parametrize("size", [1e-2, 1e-5, 1e-8, 1e-12])
@pytest.mark.parametrize("fall", FALLS)
def test_a_flight_past_a_ball_does_not_meet_it(fall, size):
    scene, gravity, random = swarm.Scene([SOLIDS["ball"](size)]), FALLS[fall], np.random.default_rng(8)
    for _flight in range(20):
        start, velocity, there = aimed(CENTER, gravity, random)
        across = np.cross(accelerated(gravity, vec(velocity), there), random.standard_normal(3))
        past = (1.0 + 1e-3) * size * across / np.linalg.norm(across)
        hit, _time = follow(scene.compiled().walls(), gravity, start + past, velocity, 2.0 * there)
        assert hit is None
