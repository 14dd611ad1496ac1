"""The flight at every surface, each answer judged in exact arithmetic: each fact runs over the table of conftest.py."""

import itertools
import math

import numpy as np
import pytest
from conftest import (
    ITERATED,
    call,
    directions,
    every_polynomial_wall,
    every_quadric_wall,
    every_wall,
    numbers_of,
    row,
    scales,
    vectors,
    wall_point,
)
from exact import TOUCH, Flight
from hypothesis import given, settings
from hypothesis import strategies as st
from walls import depths, falling, flights, hit_of, start, straight

# Of the accelerations that cross the surface in its crossing time.
heavies = st.sampled_from([1e-6, 1.0, 1e3])


# --- Hits ------------------------------------------------------------------------------------------------


@every_polynomial_wall
@settings(max_examples=100)
@given(**flights)
def test_first_hit_is_the_exact_first_root(name, point, direction, depth, lean, scale, speed):
    surface, position, velocity = start(name, point, direction, depth, lean, scale, speed)
    horizon = 1e3 * scale / np.linalg.norm(velocity)
    hit_of(straight, surface, position, velocity, np.zeros(3), horizon, 100 if name in ITERATED else 1)


@every_polynomial_wall
@given(**flights, pull=vectors, heavy=heavies)
def test_falling_hits_lead_to_the_exact_first_root(name, point, direction, depth, lean, scale, speed, pull, heavy):
    """Asked again from where the last answer ended: never past the exit, and there in the end."""
    surface, position, velocity = start(name, point, direction, depth, lean, scale, speed)
    pull = heavy * speed * speed * scale * (pull + 1e-3)
    # Until it has fallen several sizes: the further it falls the shorter are the steps of a quartic.
    hit_of(falling, surface, position, velocity, pull, 5.0 / (speed * max(1.0, math.sqrt(heavy))))


@every_quadric_wall
@settings(max_examples=15)
@given(point=directions, direction=directions, pull=directions, lean=st.floats(0.3, 1.0), scale=scales)
def test_a_fall_that_is_no_graze_ends_after_a_few_passes(name, point, direction, pull, lean, scale):
    surface, position, velocity = start(name, point, direction, 0.1, lean, scale, 1.0)
    time, passes = hit_of(falling, surface, position, velocity, pull * scale, 1e3)
    assert time == math.inf or passes <= 12


@every_polynomial_wall
def test_a_parabola_that_just_touches(name):
    """Double roots, missed or crossed by a little: no hit is skipped, and none is invented."""
    for off, scale in itertools.product([-1e-6, -1e-12, 0.0, 1e-12, 1e-6], [1e-6, 1.0, 1e6]):
        with row(off, scale):
            require_a_touch(name, off, scale)


def require_a_touch(name, off, scale):
    surface = numbers_of(name, scale)
    wall = wall_point(surface, scale * np.array([0.3, 0.5, -0.4]))
    normal = np.array(call(surface.unit_normal, wall))
    along = np.cross(normal, [0.3, -0.2, 0.5])
    along /= np.linalg.norm(along)
    # Thrown up along the wall: at its summit the parabola is `off` outside, and more curved than any wall.
    pull = -40.0 * scale * normal
    summit, flying = wall + off * scale * normal, 0.05
    position, velocity = summit + 0.5 * flying**2 * pull - flying * scale * along, scale * along - flying * pull
    time, _asked = hit_of(falling, surface, position, velocity, pull, 2.0 * flying)
    if off != 0.0:
        assert (time < math.inf) == (off > 0.0)


@every_wall
def test_head_on_the_hit_is_at_depth_over_speed(name):
    """No absolute threshold anywhere: the same flight at every scale and speed."""
    point, direction = np.array([0.3, 0.5, -0.4]), np.array([1.0, 0.0, 0.0])
    for scale, speed, depth in itertools.product([1e-6, 1.0, 1e6], [1e-6, 1.0, 1e6], [1e-9, 1e-3, 0.1]):
        with row(scale, speed, depth):
            surface, position, velocity = start(name, point, direction, depth, 1.0, scale, speed)
            time, found = call(surface.first_hit, position, velocity)
            assert found
            assert time * speed == pytest.approx(depth, rel=1e-12, abs=1e-15)
            sideways = start(name, point, direction, depth, 0.0, scale, speed)[2]
            grazing, _found = call(surface.first_hit, position, 1e-4 * velocity + sideways)
            assert grazing * speed >= 0.9 * depth


# --- On the wall and at rest -----------------------------------------------------------------------------


@every_wall
def test_from_the_wall_the_direction_decides(name):
    """Outward: now. Inward: not now, and not an instant after; gravity changes neither."""
    point, direction = np.array([0.3, 0.5, -0.4]), np.array([1.0, 0, 0])
    for depth in (0.0, 2e-16, -2e-16):
        surface, position, velocity = start(name, point, direction, depth, 0.6, 1.0, 1.0)
        normal = np.array(call(surface.unit_normal, position))
        for ask, pull in ((straight, np.zeros(3)), (falling, 0.1 * normal), (falling, -0.1 * normal)):
            with row(depth, ask.__name__, pull):
                time, found = ask(surface, position, velocity, pull)
                assert found
                assert time <= 1e-15
                assert ask(surface, position, -velocity, pull)[0] > 0.1


@every_wall
def test_at_rest_on_the_wall_gravity_decides(name):
    """It presses: a hit now, up to the fall through round-off. It pulls off the wall: no hit."""
    surface, position, _ = start(name, np.array([0.3, 0.5, -0.4]), np.array([1.0, 0, 0]), 0.0, 0.6, 1.0, 1.0)
    normal, at_rest = np.array(call(surface.unit_normal, position)), np.zeros(3)
    position = np.array(call(surface.project, position))
    time, found = call(surface.falling_hit, position, at_rest, normal)
    assert found
    assert time <= 1e-7
    assert call(surface.falling_hit, position, at_rest, -normal)[0] > 0.1


@every_wall
@given(point=directions, depth=depths)
def test_at_rest_there_is_no_hit(name, point, depth):
    surface, position, _ = start(name, point, point, depth, 0.0, 1.0, 1.0)
    assert call(surface.first_hit, position, np.zeros(3)) == (math.inf, True)
    assert call(surface.falling_hit, position, np.zeros(3), np.zeros(3))[0] == math.inf


# --- Safe times ------------------------------------------------------------------------------------------


@every_polynomial_wall
@given(**flights, pull=vectors, heavy=heavies)
def test_safe_time_is_never_past_the_exit(name, point, direction, depth, lean, scale, speed, pull, heavy):
    surface, position, velocity = start(name, point, direction, depth, lean, scale, speed)
    pull = heavy * speed * speed * scale * (pull + 1e-3)
    time = call(surface.safe_time, position, velocity, pull)
    assert time >= 0.0
    if time > 0.0:
        until = min(time, 1e3 / (speed * math.sqrt(heavy)))
        assert Flight([surface], position, velocity, pull).highest(until) <= TOUCH
    if depth >= 1e-3:
        assert time > 0.0


@every_polynomial_wall
@settings(max_examples=10)
@given(point=directions, direction=directions, pull=directions, lean=st.floats(0.3, 1.0))
def test_safe_times_lead_to_the_exit(name, point, direction, pull, lean):
    """The same as the exact root, after a few dozen safe steps."""
    surface, position, velocity = start(name, point, direction, 0.2, lean, 1.0, 1.0)
    exits = Flight([surface], position, velocity, pull).exits(100.0)
    time = 0.0
    for _ in range(60):
        if time == math.inf:
            break
        now = position + velocity * time + 0.5 * pull * time * time
        time += call(surface.safe_time, now, velocity + pull * time, pull)
    assert time == pytest.approx(exits[0], rel=1e-12) if exits else time > 0.0
