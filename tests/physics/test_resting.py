"""Resting and sliding under gravity: floors, bowls, slopes, grooves, corners, and leaving a ball."""

import math
from pathlib import Path

import mpmath
import numpy as np
import pytest
from physics.billiards import EPSILON, run

import swarm
from swarm.scene_file import read

pytestmark = pytest.mark.physics

SCENES = Path(__file__).parents[2] / "examples" / "scenes"
G = 9.81
DOWN = (0.0, 0.0, -G)
# Out of reach, but not far: it sets the scene's size, and so the default shortest flight.
FAR = swarm.Plane((0.0, 0.0, 1.0), 5.0)
BOWL = swarm.Scene([swarm.Sphere(0.7), swarm.Plane((0.0, 0.0, -1.0), 5.0)], DOWN)


def planes(*normals):
    """Planes through the origin, three with those far away: the same kernel for all."""
    walls = [swarm.Plane(normal, 0.0) for normal in normals]
    return swarm.Scene([*walls, FAR, FAR][:3], DOWN)


def test_a_particle_on_the_floor_stays():
    floor = planes((0.0, 0.0, -1.0))
    for time in (1.0, 1e3, 1e6):
        result = run(floor, swarm.Particles([0.3, 0.2, 0.0], [0.0] * 3, 2.0), swarm.Impact(), time)
        assert (result.particles.position[:, 0] == [0.3, 0.2, 0.0]).all()
        assert (result.particles.velocity == 0.0).all()
        assert result.observables["impacts"][-1] <= 2
        # The floor carries the weight.
        assert result.observables["impulse"][-1][0] == pytest.approx(2.0 * G * time, rel=4.0 * EPSILON)


def test_a_particle_slides_along_the_floor():
    result = run(planes((0.0, 0.0, -1.0)), swarm.Particles([0.0] * 3, [0.5, -0.25, 0.0]), swarm.Impact(), 1e3)
    assert result.particles.position[:, 0] == pytest.approx([500.0, -250.0, 0.0], rel=1e-13)
    assert result.observables["impacts"][-1] <= 2


def test_an_inclined_plane():
    """s = g sin(a) t^2/2, exactly: a flat wall's sliding step is a parabola, whatever its length."""
    for angle in (0.1, 0.5, 1.0):
        slope = swarm.Scene([swarm.Sphere(50.0), swarm.Plane((-math.sin(angle), 0.0, -math.cos(angle)), 0.0)], DOWN)
        result = run(slope, swarm.Particles([0.0] * 3, [0.0] * 3), swarm.Impact(), 2.0, compile="always")
        x, _y, z = result.particles.position[:, 0]
        way = 0.5 * G * math.sin(angle) * 4.0
        assert (x, z) == pytest.approx((way * math.cos(angle), -way * math.sin(angle)), rel=1e-9)
        # What the plane gave is what gravity did not keep, and round-off slowly turns a little of the speed into a
        # normal velocity: 3e-6 m/s after 5e4 steps, at exact energy.
        normal = result.particles.velocity[:, 0] @ slope.surfaces[1].normal
        assert result.observables["impulse"][-1][1] == pytest.approx(G * math.cos(angle) * 2.0 - normal, abs=1e-10)
        assert abs(normal) <= 1e-6 * G * math.sin(angle) * 2.0


def test_a_groove_carries_by_shares():
    """Two walls at unequal angles: R_i from the balance R_1 n_1 + R_2 n_2 = weight."""
    one, two = np.array([0.6, 0.0, -0.8]), np.array([-0.8, 0.0, -0.6])
    shares = np.linalg.solve(np.array([one, two])[:, [0, 2]].T, [0.0, -G])
    result = run(planes(one, two), swarm.Particles([0.0] * 3, [0.0] * 3), swarm.Impact(), 10.0)
    assert (result.particles.position == 0.0).all()
    assert result.observables["impulse"][-1][:2] == pytest.approx(10.0 * shares, rel=1e-14)


def test_an_inclined_groove():
    """Along the edge with g sin(slope), to its length, and on both walls."""
    one, two = np.array([1.0, 0.1, -1.0]), np.array([-1.0, 0.1, -1.0])
    scene = planes(one, two)
    edge = np.cross(one, two) / np.linalg.norm(np.cross(one, two))
    pull = edge @ DOWN
    result = run(scene, swarm.Particles([0.0] * 3, [0.0] * 3), swarm.Impact(), 5.0, 0.1)
    assert result.particles.position[:, 0] == pytest.approx(0.5 * pull * 25.0 * edge, rel=1e-9, abs=1e-9)
    assert result.observables["energy_error"].max() <= 1e-14
    assert result.observables["max_penetration"].max() <= 8.0 * EPSILON * 12.0


def test_a_corner_holds():
    scene = planes((1.0, 0.2, -1.0), (-1.0, 0.3, -1.0), (0.1, -1.0, -1.0))
    result = run(scene, swarm.Particles([0.0] * 3, [0.0] * 3), swarm.Impact(), 1e4)
    assert (result.particles.position == 0.0).all()
    weights = result.observables["impulse"][-1] @ [plane.normal for plane in scene.surfaces]
    assert weights == pytest.approx([0.0, 0.0, -G * 1e4], abs=1e-9)


@pytest.mark.parametrize("angle", [1e-3, 0.5, 1.5])
def test_the_pendulum_in_a_bowl(angle):
    """After a period 4 sqrt(R/g) K(sin(angle/2)) it is back: late by no more than the tolerance a crossing."""
    radius = 0.7
    period = 4.0 * math.sqrt(radius / G) * float(mpmath.ellipk(math.sin(0.5 * angle) ** 2))
    start = swarm.Particles([radius * math.sin(angle), 0.0, -radius * math.cos(angle)], [0.0] * 3)
    for tolerance in (1e-7, 1e-9):
        # A quarter of a period: at the bottom the way is the speed times the lateness.
        end = run(BOWL, start, swarm.Impact(sliding_tolerance=tolerance), 1.25 * period, 0.01)
        x, _y, z = end.particles.position[:, 0]
        assert abs(x / end.particles.velocity[0, 0]) <= 10.0 * tolerance * period
        assert math.hypot(x, z) == pytest.approx(radius, abs=4.0 * EPSILON)
        assert end.observables["energy_error"].max() <= 4.0 * EPSILON
        assert end.observables["max_penetration"].max() <= 2.0 * np.spacing(radius)


def test_leaving_a_ball():
    """Pushed off the top with v0 it leaves at c = cos(theta) = (2 + v0^2/gR)/3, and keeps its v_x = c sqrt(gRc)."""
    radius, push = 0.7, 1e-3
    scene = swarm.Scene([swarm.Sphere(radius, side="outside"), swarm.Plane((0.0, 0.0, -1.0), 5.0)], DOWN)
    start = swarm.Particles([0.0, 0.0, radius], [push, 0.0, 0.0])
    c = (2.0 + push**2 / (G * radius)) / 3.0
    errors = []
    for h in (4e-3, 1e-3, 2.5e-4):
        end = run(scene, start, swarm.Impact(shortest_flight=h), 2.8, compile="never")
        x, _y, z = end.particles.position[:, 0]
        assert -5.0 < z < 0.0, "it flies: neither on the ball nor on the floor"
        assert math.hypot(x, z) > 1.1 * radius
        errors.append(abs(end.particles.velocity[0, 0] / (c * math.sqrt(G * radius * c)) - 1.0))
        assert end.observables["energy_error"].max() <= 1e-14
    assert errors[0] <= 1e-3, errors
    assert errors[2] <= 1e-5, errors


@pytest.mark.parametrize("threads", [1, 2])
def test_a_hopper_settles(threads):
    """With friction every grain comes to rest, those that reach the tip of the cone too, and costs nothing after."""
    scene = read(SCENES / "hopper.toml").scene
    start = swarm.fill(scene, 300, speed=1.0, seed=0)
    result = swarm.simulate(
        scene, start, swarm.Impact(), until=4.0, every=1.0, threads=threads, block_size=100, compile="always"
    )
    seen = result.observables
    assert seen["sliding"].tolist()[-2:] == [300, 300]
    assert (result.particles.velocity == 0.0).all()
    assert seen["impacts"][-1] == seen["impacts"][-2]
    assert seen["energy_error"].max() <= 1e-12
    assert seen["max_penetration"].max() <= 1e-13


@pytest.mark.parametrize(
    "normals", [((0.0, 0.0, -1.0),), ((1.0, 0.0, -1.0), (-1.0, 0.0, -1.0))], ids=["floor", "groove"]
)
def test_what_rests_is_carried_frame_by_frame(normals):
    scene = planes(*normals)
    seen = run(scene, swarm.Particles([0.0] * 3, [0.0] * 3, 2.0), swarm.Impact(), 4.0, 0.5).observables
    share = 2.0 * G * 0.5 / (len(normals) * abs(np.array(normals[0])[2]) / np.linalg.norm(normals[0]))
    for s in range(len(normals)):
        assert np.diff(seen["impulse"][:, s]) == pytest.approx(share, rel=1e-13)
    assert seen["sliding_time"] == pytest.approx(seen["time"], abs=1e-7)
