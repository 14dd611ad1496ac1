"""Flights that start next to a wall, and the answers of kernels to them, judged in exact arithmetic."""

import math

import numpy as np
from conftest import call, directions, numbers_of, scales, wall_point
from exact import EXACT, NEAR, TOUCHED, Flight
from hypothesis import strategies as st

# Where a flight starts relative to the wall, in units of its size: inside, next to it, on it, an ulp or two off.
depths = st.one_of(st.floats(1e-3, 0.3), st.sampled_from([0.0, 0.0, 1e-15, -1e-15, 1e-9, 1e-12]))
# How it leaves: part of the velocity along the normal, out of the wall or into it; 0 grazes.
leans = st.one_of(st.floats(-1.0, 1.0), st.sampled_from([0.0, 1e-15, -1e-15, 1e-9, -1e-9, 1e-5, -1e-5, 1.0, -1.0]))


def start(name, point, direction, depth, lean, scale, speed):
    """A start near the wall: position, and velocity with this part along the normal."""
    surface = numbers_of(name, scale)
    wall = wall_point(surface, scale * point)
    normal = np.array(call(surface.unit_normal, wall))
    along = direction - (direction @ normal) * normal
    along /= max(np.linalg.norm(along), 1e-3)
    velocity = speed * scale * (lean * normal + math.sqrt(1.0 - lean * lean) * along)
    return surface, wall - depth * scale * normal, velocity


flights = {
    "point": directions,
    "direction": directions,
    "depth": depths,
    "lean": leans,
    "scale": scales,
    "speed": st.sampled_from([1e-6, 1.0, 1e6]),
}


def require_right(surface, position, velocity, pull, time, found):
    """Nothing is outside before that time; at a hit the flight is on the wall and on its way out.

    A straight flight ends on the wall to round-off, a parabola to 1e-12 of its time.
    """
    verdict = Flight([surface], position, velocity, pull).judge(time, found, NEAR * bool(any(pull)))
    assert verdict in (EXACT, TOUCHED), verdict


def hit_of(ask, surface, position, velocity, pull, until, most=500):
    """When the flight hits, or infinity if not `until` then, and how often it was asked.

    `ask` is asked again from where its last answer ended until the hit is found; each answer is judged.
    """
    total = 0.0
    for asked in range(1, most + 1):
        time, found = ask(surface, position, velocity, pull)
        found = found and total + time <= until
        require_right(surface, position, velocity, pull, min(time, until - total), found)
        total += time
        if found or total > until:
            return total if found else math.inf, asked
        position, velocity = position + time * velocity + 0.5 * time * time * pull, velocity + time * pull
    raise AssertionError("not found")


def straight(surface, position, velocity, _pull):
    """Ask for the hit of a straight flight."""
    return call(surface.first_hit, position, velocity)


def falling(surface, position, velocity, pull):
    """Ask for the hit of a falling flight."""
    return call(surface.falling_hit, position, velocity, pull)
