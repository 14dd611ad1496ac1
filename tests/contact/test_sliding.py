"""Friction that slows a slide in a step: the midpoint rule, with the force of the walls at the mean speed."""

import numpy as np
import pytest

import swarm
from swarm.contact import hold, sliding
from swarm.kernel.vector import Vec, dot, norm, vec

MU, STEP, GRAVITY = 0.3, 0.01, Vec(0.0, 0.0, -2.0)
PLACE = np.array([0.3, -0.2, -0.4])


def held(motion):
    """The walls of a ball around the origin through PLACE, its velocity there, and a tangent."""
    ball = swarm.Sphere(float(np.linalg.norm(PLACE)), motion=motion, friction=MU)
    walls = swarm.Scene([ball]).compiled().walls().at(0.0)
    tangent = np.cross(PLACE, [0.5, 1.0, -0.3])
    return walls, vec(tangent / np.linalg.norm(tangent))


@pytest.mark.parametrize("speed", [0.4, 2.0])
@pytest.mark.parametrize(
    "motion", [None, swarm.Rotation((1.0, 2.0, -1.0), 1.5, (0.0, 0.0, 0.0))], ids=["still", "turns"]
)
def test_the_change_of_speed_is_the_force_at_the_mean_speed(motion, speed):
    walls, way = held(motion)
    r, active = vec(PLACE), hold.One(0.0)
    u = None if motion is None else walls.velocity(0.0, r)
    base = Vec(0.0, 0.0, 0.0) if u is None else u
    slowed = sliding.slow((MU,), active, walls, GRAVITY, r, (base + speed * way, way, u), STEP)
    after = dot(slowed.v - base, way)
    assert norm(slowed.v - base - after * way) <= 1e-15
    mean = base + 0.5 * (speed + after) * way
    press = walls.outward_acceleration(0.0, r, mean, GRAVITY)
    assert press > 0.1
    assert after - speed == pytest.approx(-STEP * MU * press, rel=1e-10)
    assert slowed.lost == pytest.approx(speed**2 - after**2, rel=1e-10)
