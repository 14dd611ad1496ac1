"""The sides of an outline as balls meet them: each is parallel to its line or arc, with a circle around each end."""

import math
from typing import Any

from ...kernel.jit import outlined, select
from ...kernel.vector import Vec, either, norm, square, times
from ..balls.at_radius import AtRadius
from ..balls.tube import Tube
from ..rotation import Rotated
from ..time_of_impact.course import ball_rise_time
from ..time_of_impact.rising import LevelStep
from .sides import Side

# An arc that shrinks to less than this part of its radius is a point.
_LEAST = 1e-12


class RoundSide(AtRadius):
    """All places within the radius of a ball from one side; phi is the distance outside of the admissible part."""

    wall: Side
    radius: float

    side = 1.0

    # --- The distance ---

    def phi(self, r):
        return self.wall.distance(r) + self.radius

    def gradient(self, r):
        # Towards the nearest point of the side or, behind it, away from that point
        wall = self.wall
        signed, out = wall.signed(r)
        d = wall.along_plane(r - wall.body.center)
        last = d - wall.end
        at_start = square(d) < square(last)
        to_end = -1.0 * either(at_start, d, last)
        within = wall.is_within(d - signed * out, wall.slack)
        n = either(within, out, to_end)
        length = norm(n)
        return n * (1.0 / select(length > 0.0, length, 1.0))

    def may_reach(self, low, high):
        wall = self.wall
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        t, n = wall.ahead, wall.body.b
        # 1 along the plane, 0 across it, where boxes have no end
        half = times(times(t, t) + times(n, n), half)
        return wall.beside(middle)[1] <= self.radius + 1.000001 * norm(half)

    def passed_by(self, r, move):
        """Return how far a move that leads out through the side ends behind it [m], -1 if it does not."""
        time, _found = self.wall.first_hit(r, move)
        behind = self.wall.signed(r + move)[0]
        return select(time <= 1.0, select(behind > 0.0, behind, 0.0), -1.0)

    # --- Flight ---

    def parallel(self):
        """(whether the ball is narrow enough for the arc, the line or arc at the radius in the admissible side)."""
        wall, radius = self.wall, self.radius
        body = wall.body
        # The curvature is 2 a, which is 0 across the plane.
        k = 2.0 * (max(body.a.x, max(body.a.y, body.a.z)) + min(body.a.x, min(body.a.y, body.a.z)))
        narrow = 1.0 - k * radius
        fits = narrow > _LEAST
        scale = 1.0 / select(fits, narrow, 1.0)
        start = body.center - radius * body.b
        # The normal at the end is n + k end.
        end = narrow * wall.end
        moved = body._replace(center=start, a=scale * body.a)
        return fits, wall._replace(body=moved, end=end)

    def has_ends(self):
        """Whether the side has ends: a lid has none."""
        return square(self.wall.end) > 0.0

    def around(self, point):
        """Return the circle around one end."""
        t, n = self.wall.ahead, self.wall.body.b
        along = times(t, t) + times(n, n)
        across = Vec(_whole(along.x), _whole(along.y), _whole(along.z))
        return Tube(point, across, self.radius, self.radius * self.radius, -1.0)

    def ends(self):
        """Return both circles."""
        start = self.wall.body.center
        return self.around(start), self.around(start + self.wall.end)

    def first_hit(self, r, v):
        fits, parallel = self.parallel()
        time, _found = parallel.first_hit(r, v)
        first = select(fits, time, math.inf)
        for circle in self.ends():
            d, u = circle.off(r), times(circle.across, v)
            time = select(self.has_ends(), ball_rise_time(-1.0, circle.radius2, d, u), math.inf)
            first = select(time < first, time, first)
        return first, True

    @outlined
    def falling_hit(self, r, v, pull):
        """Return when a fall hits the side: the parallel curve or a circle."""
        fits, parallel = self.parallel()
        first, found = math.inf, True
        if fits:
            first, found = parallel.falling_hit(r, v, pull)
        if self.has_ends():
            for circle in self.ends():
                time, here = circle.falling_hit(r, v, pull)
                if time < first:
                    first, found = time, here
        return first, found

    def safe_time(self, r, v, pull):
        return self.falling_hit(r, v, pull)[0]

    @outlined
    def moving_step(self, seen, longest):
        """Return the `LevelStep` of the parallel curve and both circles."""
        fits, parallel = self.parallel()
        found = LevelStep(0.0, 0.0, longest)
        if fits:
            found = parallel.moving_step(seen, longest)
        if self.has_ends():
            for circle in self.ends():
                step = circle.moving_step(seen, found.time)
                is_past = (step.level > 0.0) & (step.half > 0.0)
                level, half = select(is_past, step.level, found.level), select(is_past, step.half, found.half)
                found = LevelStep(level, half, select(step.time < found.time, step.time, found.time))
        return found


def _whole(part):
    return select(part > 0.25, 1.0, 0.0)


def round_side(wall: Any) -> Any:
    """Return a side of an outline, which may be rotated, as balls meet it."""
    return wall._replace(body=round_side(wall.body)) if isinstance(wall, Rotated) else RoundSide(wall, 0.0)
