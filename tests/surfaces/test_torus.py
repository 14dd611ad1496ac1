"""The torus, whose flight is a quartic and whose push has no closed form."""

import itertools
import math

import mpmath as mp
import numpy as np
import pytest
from conftest import EPSILON, call, directions, numbers_of
from hypothesis import given, settings
from hypothesis import strategies as st

import swarm
from swarm.surfaces import contract

mp.mp.dps = 40
both_sides = pytest.mark.parametrize("name", ["torus", "ring"])


def on_the_wall(surface, around, across, depth):
    """A point this deep on the admissible side, by its two angles."""
    a = surface.radius - surface.side * depth
    rho = surface.major + a * math.cos(across)
    return np.array(surface.center) + np.array([rho * math.cos(around), rho * math.sin(around), a * math.sin(across)])


def quartic(surface, position, velocity):
    """(|r|^2 + R^2 - a^2)^2 - 4 R^2 rho^2 along the flight: the same sign as phi; coefficients, lowest first."""
    r = [mp.mpf(float(p)) - mp.mpf(c) for p, c in zip(position, surface.center, strict=True)]
    v = [mp.mpf(float(part)) for part in velocity]
    dot = lambda a, b, n=3: sum(x * y for x, y in zip(a[:n], b[:n], strict=True))  # noqa: E731
    big, small = mp.mpf(surface.major), mp.mpf(surface.radius)
    a, b, c = dot(v, v), 2 * dot(r, v), dot(r, r) + big**2 - small**2
    flat = [4 * big**2 * part for part in (dot(v, v, 2), 2 * dot(r, v, 2), dot(r, r, 2))]
    return [c * c - flat[2], 2 * b * c - flat[1], b * b + 2 * a * c - flat[0], 2 * a * b, a * a]


angles = st.floats(0.0, 2.0 * math.pi)


@both_sides
@settings(max_examples=200)
@given(
    around=angles,
    across=angles,
    depth=st.floats(1e-6, 0.2) | st.sampled_from([1e-3, 0.1]),
    direction=directions,
    speed=st.sampled_from([1e-3, 1.0, 1e3]),
)
def test_first_hit_is_the_first_root_of_the_quartic(name, around, across, depth, direction, speed):
    surface = numbers_of(name)
    position, velocity = on_the_wall(surface, around, across, depth), speed * direction
    time, found = call(contract.first_hit, surface, position, velocity)
    assert found
    roots = mp.polyroots(quartic(surface, position, velocity)[::-1], maxsteps=500, extraprec=200)
    real = sorted(mp.re(root) for root in roots if abs(mp.im(root)) < mp.mpf(10) ** -18 * abs(root) and mp.re(root) > 0)
    if not real:
        assert time == math.inf
        return
    # A double root that only touches may count or not; a simple one is met to round-off.
    spread = min((abs(b - a) for a, b in itertools.pairwise(real)), default=mp.mpf(1)) * speed
    if spread > 1e-3:
        assert time == pytest.approx(float(real[0]), rel=1e-9, abs=1e-12 / speed)
    place = position + time * velocity if time < math.inf else position
    assert abs(call(contract.phi, surface, place)) <= 1e-12 or time == math.inf


@both_sides
@given(around=angles, across=angles, direction=directions)
def test_from_the_wall_the_direction_decides(name, around, across, direction):
    surface = numbers_of(name)
    wall = on_the_wall(surface, around, across, 0.0)
    wall = np.array(call(contract.settle, surface, wall))
    out = direction @ np.array(call(contract.unit_normal, surface, wall))
    if abs(out) > 0.05:
        time, found = call(contract.first_hit, surface, wall, direction)
        assert found
        assert time <= 1e-14 if out > 0.0 else time > 1e-3


@both_sides
@given(around=angles, across=angles, depth=st.floats(1e-6, 0.2), direction=directions, pull=directions)
def test_safe_time_is_never_past_the_exit(name, around, across, depth, direction, pull):
    surface = numbers_of(name)
    position = on_the_wall(surface, around, across, depth)
    time = call(contract.safe_time, surface, position, direction, pull)
    assert time > 0.0
    for t in np.linspace(0.0, time, 50):
        place = position + t * direction + 0.5 * t * t * pull
        assert surface.side * call(contract.phi, surface, place) <= 8 * EPSILON


def test_a_point_on_the_axis_is_admissible_outside_the_ring():
    ring = swarm.Torus(1.0, 0.25, side="outside")
    assert ring.phi([0.0, 0.0, 0.0]) == pytest.approx(0.75)
    scene = swarm.Scene([swarm.Sphere(2.0), ring])
    assert (scene.gaps(swarm.fill(scene, 1000, speed=1.0).position) <= 0.0).all()
    # Straight through the hole, and against the inner side of the tube.
    numbers = ring.numbers()
    through = call(contract.first_hit, numbers, np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0]))
    assert through == (math.inf, True)
    across, found = call(contract.first_hit, numbers, np.array([-0.5, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    assert found
    assert across == pytest.approx(1.25, rel=1e-14)
