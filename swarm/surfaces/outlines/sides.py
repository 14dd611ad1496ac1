"""The numbers of walls that stand on an outline: planes and round walls, each as long as its side."""

import math

from ...kernel.arrays import index
from ...kernel.jit import outlined, select
from ...kernel.vector import Vec, dot, norm, square, times
from ..fields.members import Members, SignedDistance, member
from ..frames import Unturned
from ..presence.patched import Patched
from ..rotation import Rotated
from ..shapes.plane import PlaneNumbers
from ..shapes.quadratic import QuadricNumbers, form
from ..time_of_impact.course import Fall, Quartic, close, rise_time, under_way
from ..time_of_impact.rising import patch_step

# The most crossings of the whole round wall by a fall, and the most times that it may need more steps between them.
_CROSSINGS = 12


class Side(Unturned):
    """One side: the part of a quadric of curvature k through its start that is within the side.

    The level of the quadric, n.d + k/2 |d|^2 with d = r - start, is the distance to first order.
    """

    body: QuadricNumbers  # center: the start, b: n there, out of the admissible part, a: k/2 along the plane
    ahead: Vec  # the tangent at the start, towards the end; 0 where the wall has no ends
    behind: Vec  # the tangent at the end
    end: Vec  # the end, relative to the start
    slack: float  # round-off of a place [m]: a hit this far beyond an end is still a hit
    extent: float  # of the outline [m]
    before: float  # 1 for a convex corner at the start, 0 if smooth, -sin of half the wedge at a re-entrant one
    after: float  # the same number at the end
    thickness: float  # a lower bound of the thickness behind it [m]
    joined_before: float  # the number of the side that joins it smoothly at its start, or -1
    joined_after: float  # the number of the side that joins it smoothly at its end, or -1

    holds_balls = False

    # The side is a part of the quadric; the quadric's level alone does not tell when a fall hits the side.
    is_quartic = may_be_far = in_steps = False

    def steps(self, gravity, r, v):
        return None

    def safe_time(self, r, v, pull):
        return self.falling_hit(r, v, pull)[0]

    def is_within(self, d, room):
        """Whether a point of the quadric, relative to the start of the side, is on the side, or within `room` of it."""
        return (dot(d, self.ahead) >= -room) & (dot(d - self.end, self.behind) <= room)

    def first_hit(self, r, v):
        body = self.body
        d = r - body.center
        c = form(body.a, d, d) + dot(body.b, d)
        b, a = form(body.a, d, v) + 0.5 * dot(body.b, v), form(body.a, v, v)
        # A place that is outside by round-off is on the wall.
        c = select((c > 0.0) & (c <= self.slack), 0.0, c)
        discriminant = b * b - a * c
        root = math.sqrt(select(discriminant > 0.0, discriminant, 0.0))
        approaching = b > 0.0
        bottom = select(approaching, b + root, a)
        rises = (bottom > 0.0) & (discriminant >= 0.0)
        time = select(approaching, -c, root - b) / select(rises, bottom, 1.0)
        hits = rises & (time >= 0.0) & self.is_within(d + time * v, self.slack)
        return select(hits, time, math.inf), True

    @outlined
    def falling_hit(self, r, v, pull):
        """Return when a fall hits the side: the first time at which its level rises through 0 within the side."""
        begin, end = _near(self, r, v, pull)
        if not begin <= end:
            return math.inf, True
        level = self.level_of_fall(r, v, pull)
        if level.window == math.inf:
            # A plane: the level is a parabola, which rises once at most.
            comes = (level.c <= 0.0) | ((level.b < 0.0) & (level.b * level.b >= level.a2 * level.c) & (level.a2 > 0.0))
            t = select(comes, rise_time(level.c, level.b, level.a2), math.inf)
            return select(
                self.is_within(r + t * (v + 0.5 * t * pull) - self.body.center, self.slack), t, math.inf
            ), True
        if begin > 0.0:
            level = level.moved(begin)
        t, sign = begin, select(level.c > 0.0, -1.0, 1.0)
        for _crossing in range(_CROSSINGS):
            turned = Quartic(
                sign * level.c, sign * level.b, sign * level.a2, sign * level.a3, sign * level.a4, level.window
            )
            fall = Fall(turned, close(turned.window), False)
            step, last = fall.first_step()
            for _step in range(fall.most):
                if not under_way(step, last) or t + step > end:
                    break
                step, last = fall.next_step(step, last)
            t += step
            if not t <= end:
                return math.inf, True
            level = level.moved(step)
            if not under_way(step, last):
                if sign > 0.0 and self.is_within(r + t * (v + 0.5 * t * pull) - self.body.center, self.slack):
                    return t, True
                level = Quartic(0.0, level.b, level.a2, level.a3, level.a4, level.window)
                sign = -sign
        return t, False

    def level_of_fall(self, r, v, pull):
        """Return the level of the quadric along a fall."""
        body = self.body
        d = r - body.center
        c, b = form(body.a, d, d) + dot(body.b, d), form(body.a, d, v) + 0.5 * dot(body.b, v)
        a2 = form(body.a, v, v) + form(body.a, d, pull) + 0.5 * dot(body.b, pull)
        a3, a4 = form(body.a, v, pull), 0.25 * form(body.a, pull, pull)
        window = 2.0 / (norm(v) / self.extent + math.sqrt(norm(pull) / self.extent))
        c = select((c > 0.0) & (c <= self.slack), 0.0, c)
        return Quartic(c, b, a2, a3, a4, select((a3 == 0.0) & (a4 == 0.0), math.inf, window))

    def edges(self):
        """Return the planes across its ends, admissible beyond the side; no place is beyond a wall without ends."""
        body, t, u = self.body, self.ahead, self.behind
        start, end = dot(t, body.center), dot(u, body.center + self.end)
        return PlaneNumbers(t, start - self.slack), PlaneNumbers(-1.0 * u, -end - self.slack)

    @outlined
    def moving_step(self, seen, longest):
        body = self.body
        is_behind = body.phi(seen.r) > self.slack
        whole = body._replace(side=select(is_behind, -1.0, 1.0))
        return patch_step(whole, is_behind, self.edges(), seen, longest)

    # --- The distance from the side ---

    def signed(self, r):
        """Return the distance outside of the whole quadric, without cancellation, and the unit vector along it."""
        body = self.body
        d = r - body.center
        gradient = body.gradient(r)
        steep = norm(gradient)
        level = form(body.a, d, d) + dot(body.b, d)
        return 2.0 * level / (1.0 + steep), gradient * (1.0 / select(steep > 0.0, steep, 1.0))

    def beside(self, r):
        """Return (signed distance outside, distance, whether the nearest point is not an end) of a point from the side.

        At its ends the corners decide on which side of the outline the point is.
        """
        signed, out = self.signed(r)
        d = self.along_plane(r - self.body.center)
        at_start, at_end = norm(d), norm(d - self.end)
        first = at_start < at_end
        beyond, turn = select(first, at_start, at_end), select(first, self.before, self.after)
        outside = select(turn == 0.0, select(signed < 0.0, -beyond, beyond), select(turn < 0.0, -beyond, beyond))
        within = self.is_within(d - signed * out, self.slack)
        return select(within, signed, outside), select(within, abs(signed), beyond), within

    def out(self, r):
        """Return the unit vector along which the first number of `beside` rises."""
        signed, out = self.signed(r)
        d = self.along_plane(r - self.body.center)
        if self.is_within(d - signed * out, self.slack):
            return out
        away, other = d, d - self.end
        away = away if norm(away) < norm(other) else other
        size = norm(away)
        sign = 1.0 if self.beside(r)[0] > 0.0 else -1.0
        return away * (sign / size) if size > 0.0 else out

    def along_plane(self, d):
        """Return a vector without its part across the plane of the outline."""
        return dot(self.ahead, d) * self.ahead + dot(self.body.b, d) * self.body.b

    def may_reach(self, low, high):
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        t, n = self.ahead, self.body.b
        # 1 along the plane, 0 across it, where boxes have no end
        half = times(times(t, t) + times(n, n), half)
        return self.beside(middle)[1] <= 1.000001 * norm(half)

    def distance(self, r):
        # Beside the side a point is not outside, however far it is beyond the whole quadric; nor is it beyond the end
        # of the wedge or of the thickness behind the side: there it is in front of another side.
        signed, away, within = self.beside(r)
        d = self.along_plane(r - self.body.center)
        first = select(self.before < 0.0, -self.before * norm(d), math.inf)
        last = select(self.after < 0.0, -self.after * norm(d - self.end), math.inf)
        behind = signed <= min(self.thickness, min(first, last))
        return select(within & behind, signed, -away)


class Sides(Members, Patched):
    """The sides of an outline: a field of walls for bodies, each as long as its side."""

    @outlined
    def is_in_another(self, number, r):
        """Whether a point is outside of the outline, and nearest to another side."""
        outside, which = _nearest(self, r)
        return outside > 0.0 and which != number

    def deepest_in_cell(self, r):
        return _nearest(self, r)[0]

    @outlined
    def foot(self, tree, r):
        """The distance and the normal; of a point beyond outline and lid the root of the sum of both squares."""
        gap, which, lid, above = _nearest_each(self, r)
        if lid > 0.0 and gap > 0.0:
            both = math.sqrt(lid * lid + gap * gap)
            return SignedDistance(both, (lid / both) * _out_of(self, above, r) + (gap / both) * _out_of(self, which, r))
        return SignedDistance(max(gap, lid), _out_of(self, above if lid > gap else which, r))

    def is_there(self, number, r, near):
        """Whether a side reaches to a place on its wall, or within `near` of it."""
        side = self.wall(number)
        r, side = _in_frame(side, r)
        return side.is_within(r - side.body.center, side.slack + near)

    def wall_after(self, number, r, near):
        """Return the side on which a slide continues beyond the end of this one at r, -1 if it has a corner there."""
        side = self.wall(number)
        r, side = _in_frame(side, r)
        d = side.along_plane(r - side.body.center)
        return select(norm(d) < norm(d - side.end), side.joined_before, side.joined_after)

    def keeps(self, number, r):
        is_other = (number < 0.0) | (number >= self.count())
        return is_other or self.is_there(number, r, 0.0)

    def goes_on(self, number, other):
        """Whether a side joins this one smoothly: a particle that slides here does not hit it, but moves on to it."""
        side = self.wall(number)
        side = side.body if isinstance(side, Rotated) else side
        return (side.joined_before == other) | (side.joined_after == other)


class FewSides(Sides):
    """Sides that are few enough for each lane to look at all of them on a straight flight."""

    few = True

    def in_cells(self):
        return Sides(*self)


def _near(side, r, v, pull):
    """Return the first and the last time at which a fall may be near a side: in a square around it."""
    if square(side.end) == 0.0:
        return 0.0, math.inf  # a wall without ends
    # Arcs are at most half circles: all of the side is within the circle that has the chord as its diameter.
    d, room = r - side.body.center - 0.5 * side.end, 0.500001 * norm(side.end) + side.slack
    t, n = side.ahead, side.body.b
    first, last = _within(dot(t, d), dot(t, v), dot(t, pull), room)
    begin, end = _within(dot(n, d), dot(n, v), dot(n, pull), room)
    return max(first, begin), min(last, end)


def _within(x, u, g, room):
    """Return the first and the last time at which x + u t + g t^2/2 is within `room` of 0."""
    sign = math.copysign(1.0, x)
    first = select(abs(x) <= room, 0.0, rise_time(room - abs(x), -0.5 * sign * u, -0.5 * sign * g))
    ahead = select(g == 0.0, math.copysign(1.0, u), math.copysign(1.0, g))
    last = rise_time(ahead * x - room, 0.5 * ahead * u, 0.5 * ahead * g)
    return first, select((g == 0.0) & (u == 0.0), math.inf, last)


@outlined
def _nearest(sides, r):
    """Return how far a point is outside of the outline or beyond a lid, and the number of that side or lid."""
    if sides.is_gone():
        return -math.inf, -1.0
    gap, which, lid, above = _nearest_each(sides, r)
    return (lid, above) if lid > gap else (gap, which)


def _nearest_each(sides, r):
    """Return the distance of a point outside of the outline, the number of that side, and the same beyond a lid."""
    least, gap, which, lid, above = math.inf, -math.inf, 0.0, -math.inf, 0.0
    # All sides: the nearest one in the cell may be the back of a thin wall.
    for m in range(sides.table.shape[0]):
        side = member(sides, index(m))
        own, body = _in_frame(side, r)
        signed, away, _within = body.beside(own)
        if square(body.end) == 0.0:
            if signed > lid:
                lid, above = signed, float(m)
        # At a corner both sides are at the same distance, and the corner gives the same sign for both.
        elif away < least:
            least, gap, which = away, signed, float(m)
    return gap, which, lid, above


def _in_frame(side, r):
    """Return a point in the frame of a side, and the side there, which may be rotated in the scene."""
    return (side.place_in(r), side.body) if isinstance(side, Rotated) else (r, side)


def _out_of(sides, number, r):
    """Return `out` of the side with this number."""
    side = member(sides, index(int(number)))
    own, body = _in_frame(side, r)
    return side.vector_out(body.out(own)) if isinstance(side, Rotated) else body.out(own)
