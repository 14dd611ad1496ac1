"""A solid body with edges: an intersection of parts; phi, its own inner function, is the largest phi of the parts.

A part is a wall with its admissible side outside. A flight hits the body when it is inside of all parts.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...kernel.gravity import displacement
from ...kernel.jit import select
from ...kernel.limits import EPSILON, TINY
from ...kernel.vector import ZERO, Symmetric, absolute, total
from .. import contract
from ..curvature import SPACING, half_hessian
from ..time_of_impact.approach import Approach
from ..time_of_impact.rising import LevelStep

# Round-off of a part's level, in units of the last place of its largest terms.
_ULPS = 32.0


class SolidNumbers(contract.Smooth):
    """The numbers of a body: its parts, and a length that bounds the round-off of their coordinates."""

    parts: tuple[Any, ...]
    side: float
    extent: float

    def smooth_parts(self):
        return self.parts

    def phi(self, r):
        return _largest(self.parts, r)[0]

    def gradient(self, r):
        return _largest(self.parts, r)[1]

    def hessian(self, r):
        h = SPACING * (total(absolute(r)) + self.extent) + TINY
        return _bend_of_largest(self.parts, r, h)[1]

    def steps(self, gravity, r, v):
        return Entering(self, gravity, r, v)

    in_steps = True

    def safe_time(self, r, v, pull):
        # Outside of one part is outside of the body.
        longest = 0.0
        for part in reversed(self.parts):
            longest = max(part.safe_time(r, v, pull), longest)
        return longest

    def unit_normal(self, r):
        # The gap and the normal of the part in which the point is least deep
        least, normal = math.inf, ZERO
        for part in reversed(self.parts):
            depth = part.distance(r)
            if not depth > least:
                least, normal = depth, part.unit_normal(r)
        return normal

    def far(self, r):
        # The distance of the point from the part that it is farthest out of
        clear = 0.0
        for part in reversed(self.parts):
            clear = max(part.out_of(r), clear)
        return clear

    def farthest_push(self):
        # phi is about the distance, and the faces are flat or wide: no pole within a push.
        return -math.inf

    def moving_step(self, seen, longest):
        # The step to the part in which the particle is least deep: outside of one part is outside of the body.
        found = LevelStep(math.inf, 0.0, 0.0)
        for part in reversed(self.parts):
            here = part.moving_step(seen, longest)
            # A part that the particle is inside of gives no bound; on its face the sign of the approach decides.
            depth = part.gap_of(part.inner(seen.r))
            time = select(depth > noise(part, self.extent, seen.r), 0.0, here.time)
            least = here.level < found.level
            level, half = select(least, here.level, found.level), select(least, here.half, found.half)
            found = LevelStep(level, half, select(time > found.time, time, found.time))
        return found


def body(parts: Sequence[Any], extent: float = 0.0) -> SolidNumbers:
    """Return the intersection of parts, each the numbers of a wall that is admissible outside of the part.

    Args:
        parts: numbers of walls with side -1, or of planes: the part is then the half-space normal.r > offset.
        extent: the distance from the origin within which the centres of the parts lie [m], if that is far.
    """
    return SolidNumbers(tuple(parts), -1.0, float(extent))


# --- The level set ---------------------------------------------------------------------------------------


def _largest(parts, r):
    """Return the largest phi of the parts, and its gradient."""
    most, gradient = -math.inf, ZERO
    for part in reversed(parts):
        # phi of a part rises outwards, phi of a plane into the part.
        sign = -part.side
        here = sign * part.phi(r)
        # No select: these may be arrays
        use = 1.0 * (here >= most)
        most = np.maximum(here, most)
        gradient = (use * sign) * part.gradient(r) + (1.0 - use) * gradient
    return most, gradient


def _bend_of_largest(parts, r, h):
    """Return the largest phi of the parts, and half its second derivatives, by differences."""
    most, bend = -math.inf, Symmetric(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for part in reversed(parts):
        sign = -part.side
        here = sign * part.phi(r)
        if not here < most:
            most, bend = here, half_hessian(part, r, h, sign)
    return most, bend


# --- Flight ----------------------------------------------------------------------------------------------


class Entering(Approach):
    """The steps of a flight until it is inside of all parts; each step leads to where one part is entered (again)."""

    # A flight that needs more steps continues in the next pass.
    most = 99

    def first_step(self):
        return self.next_step(0.0, math.inf)

    def step_from(self, p, w, last):
        # Until the flight enters the last of the parts it is outside of that one; by then it may have left another.
        body, gravity = self.surface, self.gravity
        wait, found = _last_entry(body.parts, gravity, body.extent, p, w)
        moved = total(absolute(displacement(gravity, w, wait)))
        # The place is known to round-off of its own coordinates and of the coordinates of the start.
        coordinates = total(absolute(p)) + abs(self.r.x) + abs(self.r.y) + abs(self.r.z)
        is_in = found & (moved <= 4.0 * EPSILON * (coordinates + body.extent))
        return wait, select(is_in, 0.0, select(wait > 0.0, wait, TINY))


def _last_entry(parts, gravity, extent, r, v):
    """Return (when the last part is entered that the particle is not inside of, whether it is entered)."""
    time, found = 0.0, True
    for part in reversed(parts):
        here, found_here = part.entry(gravity, r, v)
        # On the face of a part, which the particle now leaves or enters, the sign of the approach decides.
        depth = part.gap_of(part.inner(r))
        later = (here > time) & (not (depth > noise(part, extent, r)))
        time, found = select(later, here, time), select(later, found_here, found)
    return time, found


def noise(part, extent, r):
    """Return the round-off of the gap of a part."""
    gradient = total(absolute(part.gradient(r)))
    terms = part.gap_scale(r) + extent * gradient + abs(part.gap_of(0.0))
    return _ULPS * EPSILON * terms
