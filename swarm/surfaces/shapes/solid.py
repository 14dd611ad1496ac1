"""A solid body with edges: what its parts have in common; phi is the largest of the parts' phi, and inner function.

A part is a wall whose admissible side is outside of it. The body is hit when the flight is inside of all parts.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...kernel.gravity import Gravity, as_vector, displacement
from ...kernel.jit import outlined, select
from ...kernel.vector import ZERO, Symmetric, Vec, absolute, total
from .. import contract, flights
from ..approach import place, under_way
from ..course import rise_near
from ..rising import Step
from ..rotation import Rotated
from .plane import PlaneNumbers
from .slab import SlabNumbers

_EPSILON = 2.220446049250313e-16
# A step that is no hit has a length, even if it is of none.
_TINY = float(np.finfo(np.float64).tiny)
# Round-off of a part's level, in units of the last place of its largest terms.
_ULPS = 32.0
# Steps of a flight that is asked for alone, each to where a part is still to be entered, or entered again, before it
# goes on in the next pass.
_ENTRIES = 100
# Part of the coordinates over which the gradient is differenced: the cube root of the round-off.
_SPACING = 6e-6


class SolidNumbers(contract.Smooth):
    """A body as kernels take it: its parts, and a length that bounds the round-off of their coordinates."""

    parts: tuple[Any, ...]
    side: float
    extent: float

    def phi(self, r):
        return _largest(self.parts, r)[0]

    def gradient(self, r):
        return _largest(self.parts, r)[1]

    def hessian(self, r):
        h = _SPACING * (total(absolute(r)) + self.extent) + np.finfo(np.float64).tiny
        return _bend_of_largest(self.parts, r, h)[1]

    def first_hit(self, r, v):
        return _entry(self, None, r, v)

    def falling_hit(self, r, v, pull):
        return _entry(self, Gravity(pull.x, pull.y, pull.z), r, v)

    def safe_time(self, r, v, pull):
        # Outside of one part is outside of the body.
        longest = 0.0
        for part in reversed(self.parts):
            longest = max(part.safe_time(r, v, pull), longest)
        return longest

    def unit_normal(self, r):
        # That of the part which the point is least deep in
        least, normal = math.inf, ZERO
        for part in reversed(self.parts):
            depth = part.distance(r)
            if not depth > least:
                least, normal = depth, part.unit_normal(r)
        return normal

    def far(self, r):
        # How far the point is out of the part that it is farthest from.
        clear = 0.0
        for part in reversed(self.parts):
            clear = max(part.out_of(r), clear)
        return clear

    def farthest_push(self):
        # phi is about the distance, whose faces are flat or wide: no pole within a push.
        return -math.inf

    def moving_step(self, seen, longest):
        # Of the part that the particle is least deep in: outside of one part is outside of the body.
        found = Step(math.inf, 0.0, 0.0)
        for part in reversed(self.parts):
            here = part.moving_step(seen, longest)
            # Of a part that the particle is inside of nothing is known; on its face the sign of the approach decides.
            depth = part.gap_of(part.inner(seen.r))
            time = select(depth > noise(part, self.extent, seen.r), 0.0, here.time)
            least = here.level < found.level
            level, half = select(least, here.level, found.level), select(least, here.half, found.half)
            found = Step(level, half, select(time > found.time, time, found.time))
        return found

    # --- Flight in lanes ---

    in_steps = 1.0

    def begin_flight(self, gravity, course, row, lane, r, v):
        time, last = _entry_step(self, gravity, r, v, 0.0, math.inf)
        course[row + flights.TIME, lane], course[row + flights.LAST, lane] = time, last

    def step_flight(self, gravity, course, row, lane, r, v):
        time, last = course[row + flights.TIME, lane], course[row + flights.LAST, lane]
        time, last = _entry_step(self, gravity, r, v, time, last)
        course[row + flights.TIME, lane], course[row + flights.LAST, lane] = time, last


def body(parts: Sequence[Any], extent: float = 0.0) -> SolidNumbers:
    """The intersection of parts, each the numbers of a wall that is admissible outside of the part.

    Args:
        parts: numbers of walls with side -1, or of planes, whose part is where normal.r > offset.
        extent: distance from the origin within which the parts' centres lie [m], where that is far.
    """
    return SolidNumbers(tuple(parts), -1.0, float(extent))


def _sign(part):
    """The sign with which phi of a part rises out of it."""
    body = part.body if isinstance(part, Rotated) else part
    return -1.0 if isinstance(body, PlaneNumbers) else 1.0


# --- The level set ---------------------------------------------------------------------------------------


def _largest(parts, r):
    """The largest phi of the parts, and its gradient."""
    most, gradient = -math.inf, ZERO
    for part in reversed(parts):
        sign = _sign(part)
        here = sign * part.phi(r)
        # No select: these may be arrays.
        use = 1.0 * (here >= most)
        most = np.maximum(here, most)
        gradient = (use * sign) * part.gradient(r) + (1.0 - use) * gradient
    return most, gradient


def _bend_of_largest(parts, r, h):
    """The largest phi of the parts, and half its second derivatives, by differences."""
    most, bend = -math.inf, Symmetric(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for part in reversed(parts):
        sign = _sign(part)
        here = sign * part.phi(r)
        if not here < most:
            f = 0.25 * sign / h
            x, y = _turn(part, r, Vec(h, 0.0, 0.0), f), _turn(part, r, Vec(0.0, h, 0.0), f)
            z = _turn(part, r, Vec(0.0, 0.0, h), f)
            most, bend = here, Symmetric(x.x, y.y, z.z, x.y, y.z, x.z)
    return most, bend


def _turn(part, r, step, f):
    return f * (part.gradient(r + step) - part.gradient(r - step))


# --- Flight ----------------------------------------------------------------------------------------------


@outlined
def _entry(surface, gravity, r, v):
    """When the flight is inside of all parts for the first time: (time, whether it is then)."""
    t, last = 0.0, math.inf
    for _i in range(_ENTRIES):
        t, last = _entry_step(surface, gravity, r, v, t, last)
        if not under_way(t, last):
            break
    return t, not under_way(t, last)


def _entry_step(surface, gravity, r, v, t, last):
    """One step more: (t, its length, 0 if the flight is inside of all parts then).

    Until the last of the parts is entered the flight is outside of that one; by then it may have left another.
    """
    p, w = place(gravity, r, v, t, last)
    wait, found = _last_entry(surface.parts, gravity, surface.extent, p, w)
    moved = total(absolute(displacement(gravity, w, wait)))
    # The place is known to round-off of its own coordinates and of those the flight comes from.
    coordinates = total(absolute(p)) + abs(r.x) + abs(r.y) + abs(r.z)
    is_in = found & (moved <= 4.0 * _EPSILON * (coordinates + surface.extent))
    goes_on = under_way(t, last)
    length = select(is_in, 0.0, select(wait > 0.0, wait, _TINY))
    return select(goes_on, t + wait, t), select(goes_on, length, last)


def _last_entry(parts, gravity, extent, r, v):
    """When the last of the parts is entered that the particle is not inside of: (time, whether it is then)."""
    time, found = 0.0, True
    for part in reversed(parts):
        here, found_here = _entry_of(part, gravity, r, v)
        # On the face of a part, which is left or entered now, the sign of the approach decides.
        depth = part.gap_of(part.inner(r))
        later = (here > time) & (not (depth > noise(part, extent, r)))
        time, found = select(later, here, time), select(later, found_here, found)
    return time, found


def _entry_of(part, gravity, r, v):
    """A time until which a flight surely does not enter a part: (time, whether it does then)."""
    if gravity is None:
        return part.first_hit(r, v)
    pull = as_vector(gravity)
    if isinstance(part, SlabNumbers):
        return part.near_face_hit(r, v, pull), True
    if part.is_quartic:
        return rise_near(part.course(r, v, pull))
    return part.falling_hit(r, v, pull)


def noise(part, extent, r):
    """The round-off of the gap of a part."""
    gradient = total(absolute(part.gradient(r)))
    terms = part.gap_scale(r) + extent * gradient + abs(part.gap_of(0.0))
    return _ULPS * _EPSILON * terms
