"""Surfaces that are no quadrics, the torus and the capsule among them: steps and marches to their first hits."""

import math

import numpy as np
import pytest
from conftest import EPSILON, ITERATED, SAMPLED_WALLS, TURN, body_of, call, numbers_of
from exact import TOUCH, Flight
from walls import falling, hit_of, start, straight

import swarm
from swarm.kernel.gravity import Gravity
from swarm.surfaces import rotation as rotations
from swarm.surfaces.shapes.capsule import CapsuleNumbers
from swarm.surfaces.time_of_impact import march as marches

every_march = pytest.mark.parametrize("name", [name for name in ITERATED if name not in SAMPLED_WALLS])
DEPTHS = [0.1, 1e-3, 1e-9, 1e-12, 1e-15, 0.0, -1e-15]
LEANS = [0.7, 1e-5, 1e-9, 1e-15, 0.0, -1e-15, -1e-9, -1e-5, -0.7]


def own_hit(surface, position, velocity, pull):
    """Ask the surface, which may not march."""
    return (falling if pull.any() else straight)(surface, position, velocity, pull)


@every_march
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("heavy", [0.0, 1e-6, 1.0, 100.0])
def test_grazing_starts_next_to_the_wall(name, scale, heavy):
    """Some of every depth with every lean, against the exact polynomials."""
    rng = np.random.default_rng([int(math.log10(scale)) + 6, int(heavy * 1e6)])
    starts = [(depth, lean) for depth in DEPTHS for lean in LEANS]
    for k in rng.permutation(len(starts))[:4]:
        depth, lean = starts[k]
        surface, position, velocity = start(name, rng.uniform(-1, 1, 3), rng.normal(size=3), depth, lean, scale, 1.0)
        pull = heavy * scale * rng.uniform(-1.0, 1.0, 3)
        until = 10.0 if heavy == 0.0 else 5.0 / max(1.0, math.sqrt(heavy))
        for ask in (march, own_hit):
            hit_of(ask, surface, position, velocity, pull, until, 100)


def march(surface, *flight):
    """Ask the march itself, in the surface's own frame."""
    turn = np.array(surface[1:]) if surface is not body_of(surface) else np.eye(3)
    return call(marches.march, body_of(surface), *(turn.T @ vector for vector in flight))


@pytest.mark.parametrize(
    ("name", "gravity"),
    [
        ("torus", None),
        ("ring", None),
        *((name, Gravity(0.4, -0.3, -1.0)) for name in ("torus", "ring", "capsule", "rod")),
    ],
)
def test_the_level_is_nowhere_above_its_polynomial(name, gravity):
    """Up to any time within its window; and both touch where it is asked."""
    surface, rng = body_of(numbers_of(name)), np.random.default_rng(5)
    pull, seen = np.zeros(3) if gravity is None else np.array(gravity), 0
    while seen < 40:
        position, velocity = rng.uniform(-1.2, 1.2, 3), rng.normal(size=3)
        near = call(surface.near, gravity, position, velocity)

        def level(t, r=position, v=velocity):
            return _level(surface, r + t * v + 0.5 * t * t * pull)

        if level(0.0) > 0.0 or not near.meets:
            continue
        seen += 1
        assert near.c == pytest.approx(level(0.0), abs=1e-14)
        assert near.b == pytest.approx((level(1e-6) - level(-1e-6)) / 4e-6, abs=1e-8)
        for within in near.window * np.array([1e-3, 0.1, 1.0]):
            above, rise, _size = near.bounds(within)
            for t in within * rng.uniform(0.0, 1.0, 10):
                assert level(t) <= near.c + 2.0 * near.b * t + above.a2 * t**2 + rise * t**3 + 1e-13


def _level(surface, r):
    d = r - np.array(surface.center)
    if isinstance(surface, CapsuleNumbers):
        return surface.side * (call(surface.inner, r) - surface.radius2)
    both = d @ d + surface.major**2 - surface.radius2
    return surface.side * (both**2 - 4.0 * surface.major**2 * (d[0] ** 2 + d[1] ** 2))


@pytest.mark.parametrize("name", ["ring", "rod"])
@pytest.mark.parametrize("speed", [0.0, 1e-3, 10.0])
def test_a_long_fall_does_not_outrun_its_clearance(name, speed):
    """From far away gravity makes it faster on the way: the clearance is a way, not a time at the first speed."""
    surface = numbers_of(name)
    position, pull = np.array([0.5, 0.2, 40.0]), np.array([0.0, 0.0, -9.81])
    velocity, total = np.array([0.0, 0.0, -speed]), 0.0
    for _ask in range(50):
        time, found = call(surface.falling_hit, position, velocity, pull)
        assert Flight([surface], position, velocity, pull).highest(time) <= TOUCH
        total += time
        position, velocity = position + time * velocity + 0.5 * time * time * pull, velocity + time * pull
        if found:
            break
    assert found
    assert abs(call(surface.phi, position)) <= 1e-14


# --- The torus -------------------------------------------------------------------------------------------


def test_a_point_on_the_axis_is_admissible_outside_the_ring():
    ring = swarm.Torus(1.0, 0.25, side="outside")
    assert ring.phi([0.0, 0.0, 0.0]) == pytest.approx(0.75)
    scene = swarm.Scene([swarm.Sphere(2.0), ring])
    assert (scene.gaps(swarm.fill(scene, 1000, speed=1.0).position) <= 0.0).all()
    # Straight through the hole, and against the inner side of the tube.
    numbers = ring.numbers()
    through = call(numbers.first_hit, np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0]))
    assert through == (math.inf, True)
    across, found = call(numbers.first_hit, np.array([-0.5, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    assert found
    assert across == pytest.approx(1.25, rel=1e-14)


# --- The capsule -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_the_closed_form_of_the_capsule_is_the_march(side):
    capsule, rng = swarm.Capsule(0.4, 1.0, side=side).numbers(), np.random.default_rng(9)
    hits = 0
    for _ in range(500):
        position, velocity = rng.uniform(-1.0, 1.0, 3), rng.normal(size=3)
        if capsule.side * call(capsule.phi, position) > 0.0:
            continue
        time, found = call(capsule.first_hit, position, velocity)
        marched, _found = call(marches.march, capsule, position, velocity, np.zeros(3))
        assert found
        if time == math.inf:
            assert marched > 1e9
        else:
            assert time == pytest.approx(marched, rel=1e-12, abs=1e-14)
            hits += 1
    assert hits > 50


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_along_the_axis_of_a_capsule(scale):
    """Parallel to the cylinder, where it has no root: the caps at both ends."""
    cavity = swarm.Capsule(0.5 * scale, 2.0 * scale).numbers()
    for off in (0.0, 0.25, 0.5 - 1e-9):
        for sign in (1.0, -1.0):
            way = np.array([0.0, 0.0, sign])
            exact = 1.0 + math.sqrt((0.5 - off) * (0.5 + off))
            time, _found = call(cavity.first_hit, scale * np.array([off, 0.0, 0.0]), way)
            assert time == pytest.approx(exact * scale, rel=1e-14, abs=1e-7 * scale * (off > 0.4))
    rod = cavity._replace(side=-1.0)
    time, _found = call(rod.first_hit, scale * np.array([0.3, 0.0, -5.0]), np.array([0.0, 0.0, scale]))
    assert time == pytest.approx(4.0 - 0.4, rel=1e-14)
    for position in ([0.3, 0.0, 5.0], [0.6, 0.0, -5.0], [0.5 + 1e-12, 0.0, 0.0]):
        assert call(rod.first_hit, scale * np.array(position), np.array([0.0, 0.0, scale])) == (
            math.inf,
            True,
        )


def test_a_capsule_of_no_length_is_a_sphere():
    rng = np.random.default_rng(10)
    capsule, sphere = swarm.Capsule(0.5, 0.0, center=(0.1, 0, 0)), swarm.Sphere(0.5, (0.1, 0, 0))
    points = rng.normal(size=(3, 50))
    assert capsule.phi(points) == pytest.approx(sphere.phi(points), abs=1e-15)
    for _ in range(50):
        position, velocity = rng.uniform(-0.2, 0.2, 3), rng.normal(size=3)
        times = [call(surface.numbers().first_hit, position, velocity)[0] for surface in (capsule, sphere)]
        assert times[0] == pytest.approx(times[1], rel=1e-14)


def test_the_axis_and_the_rotation_of_a_capsule():
    """First the axis, then the rotation; its bounds touch it."""
    capsule = swarm.Capsule(0.25, 1.0, axis=(0, 3, 0), center=(1, 2, 3), rotation=TURN)
    along = np.array(rotations.turned(rotations.quaternion("rotation", TURN), (0.0, 1.0, 0.0)))
    tips = np.array(capsule.center) + 0.75 * np.array([along, -along])
    assert capsule.phi(tips.T) == pytest.approx([0.0, 0.0], abs=1e-15)
    low, high = np.array(capsule.bounds())
    points = np.random.default_rng(11).uniform(low, high, (200_000, 3))
    inside = points[capsule.phi(points.T) <= 0.0]
    assert inside.min(axis=0) == pytest.approx(low, abs=0.03)
    assert inside.max(axis=0) == pytest.approx(high, abs=0.03)


def test_the_discrete_gradient_is_exact_across_the_end_of_the_cylinder():
    """q has a jump in its second derivative there; the identity D.(r1 - r0) = q1 - q0 does not mind."""
    capsule = swarm.Capsule(0.5, 1.0).numbers()
    for step in (1e-12, 1e-6, 1e-2):
        first = np.array([0.3, 0.4, 0.5 - 0.5 * step])
        second = first + step * np.array([0.1, -0.2, 1.0])
        discrete = np.array(call(capsule.discrete_gradient, first, second))
        rise = call(capsule.difference, first, second)
        assert discrete @ (second - first) == pytest.approx(rise, abs=4 * EPSILON * step)
        assert discrete == pytest.approx([0.6, 0.8, 0.0], abs=2.0 * step + 1e-15)
