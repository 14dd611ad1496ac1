"""A facet: a triangle as a wall, the part of a plane between its three edges."""

import math
from typing import Any

from ...kernel.arrays import index
from ...kernel.gravity import displacement
from ...kernel.jit import Array, outlined, select
from ...kernel.record import Record
from ...kernel.vector import Vec, absolute, cross, dot, norm, square, vector_at
from ..shapes.plane import Flat, PlaneNumbers
from ..time_of_impact.course import positive, rise_time
from ..time_of_impact.rising import patch_step

# The round-off of places, as a part of the farthest coordinate: far above that of numbers, and of a hit.
ROOM = 2.0**-40
# Half of the thickness of a sheet, and how far its sides extend beyond its edges, in units of the round-off of places:
# far above the distance at which a flight ends beside its wall, and so far that the sides of a fold of 2 degrees meet.
# The last one: a sliding step ends behind a side by less than this, and so never on the other side.
THIN, OVERLAP, _BEHIND_SIDE = 32.0, 2048.0, 8.0
# A step that has come through a facet ends behind it by at most this multiple of the round-off of places.
_BEHIND = 1e4


class Shared(Record):
    """A number common to all walls of a field."""

    value: float


class Corners(Record):
    """The corners of a facet."""

    a: Vec
    b: Vec
    c: Vec
    turn: float  # 1, or -1 if they go round the normal the other way
    beyond: float  # by how much the facet extends beyond its edges [m]

    def edges(self):
        """Return the start of each edge, and the vector along it."""
        return (self.a, self.b - self.a), (self.b, self.c - self.b), (self.c, self.a - self.c)


class CornersOf(Record):
    """The corners of all facets, which share vertices: 12 bytes of a facet where its edges would take 96."""

    vertices: Array  # (V, 3)
    triangles: Array  # (T, 3) int32
    turn: float
    beyond: float

    def of(self, m):
        """Return the corners of one facet."""
        a, b, c = (self.vertex(m, k) for k in range(3))
        return Corners(a, b, c, self.turn, self.beyond)

    def row(self, m):
        """Return the row of its triangle."""
        return m

    def vertex(self, m, k):
        """Return one corner."""
        return vector_at(self.vertices, index(self.triangles[self.row(m), k]), 0)


class CornersOfSides(CornersOf):
    """The corners of sheets: two consecutive facets are the sides of one triangle."""

    def of(self, m):
        a, b, c = (self.vertex(m, k) for k in range(3))
        return Corners(a, b, c, select(m % 2 == 0, self.turn, -self.turn), self.beyond)

    def row(self, m):
        return index(m // 2)


class WayPast(Record):
    """Whether a flight surely misses a facet, and the time until which it surely is before the plane of the facet."""

    misses: bool
    begin: float


class FacetNumbers(Flat):
    """The record of a facet for kernels.

    A place is between the edges up to the round-off of places, `room`, so that neighbours overlap and no flight passes
    between them. A place beyond the edges is never hit before the wall there: at a convex edge the neighbour is met
    sooner, and at a re-entrant one the facet is larger by this overlap.
    """

    normal: Vec
    offset: float
    corners: Any  # `Corners`, or None if the facet is known to be met
    room: Shared

    # --- Its part of the plane ---

    def within(self, r):
        """Return the distance of a place from the nearest edge inwards, plus the overlap; below 0 beyond an edge."""
        least = math.inf
        for start, inwards in reversed(self.edges()):
            here = dot(inwards, r - start)
            least = select(here < least, here, least)
        return least + self.room.value + self.corners.beyond

    def edges(self):
        """Return a point of each edge, and the unit vector in the plane from there into the triangle."""
        normal = self.corners.turn * self.normal
        return tuple((start, (1.0 / norm(way)) * cross(normal, way)) for start, way in self.corners.edges())

    def is_beyond(self, r, far):
        """Whether `within` is less than -far, without a root or a quotient."""
        normal, reach, found = self.corners.turn * self.normal, far + self.room.value + self.corners.beyond, False
        for start, way in reversed(self.corners.edges()):
            here = dot(cross(normal, way), r - start)
            found = found | ((here < 0.0) & (here * here > reach * reach * square(way)))
        return found

    def is_there(self, r, near):
        """Whether the facet is within `near` of a point on its plane; it is not for a point deep behind it."""
        return (self.within(r) >= -near) & (self.phi(r) <= self.behind())

    def distance(self, r):
        # Beyond its edges, or deep behind it, where other walls are, the distance is to the facet itself
        depth, within = self.inner(r) - self.offset, self.within(r)
        beyond = select(within < 0.0, within, 0.0)
        there = (beyond == 0.0) & (depth <= self.behind())
        # Within round-off beyond an edge, where it meets a neighbour, a place is no deeper than `within`
        depth_there = select((within < self.room.value) & (within < depth), within, depth)
        return select(there, depth_there, self.elsewhere(beyond, depth))

    def is_ahead(self, start, end, near):
        """Whether a move between two places may come through the facet: its end is at most `near` before it."""
        return self.distance(end) >= -near

    def elsewhere(self, beyond, depth):
        """Return its distance from a place beyond its edges, or deep behind it."""
        return -math.sqrt(beyond * beyond + depth * depth)

    def behind(self):
        """Return the largest depth behind the facet after a step through it; deeper places belong to another room."""
        return _BEHIND * self.room.value

    def may_reach(self, low, high):
        # The box is off the facet if all of it is beyond an edge, or on one side of the plane.
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        reach = dot(absolute(self.normal), half) + self.room.value
        found = abs(dot(self.normal, middle) - self.offset) <= reach
        overlap = self.room.value + self.corners.beyond
        for start, inwards in reversed(self.edges()):
            found = (dot(inwards, middle - start) + dot(absolute(inwards), half) >= -overlap) & found
        return found

    # --- Flight ---

    def first_hit(self, r, v):
        depth, approach = self.inner(r) - self.offset, dot(self.normal, v)
        time = -depth / approach
        time = select(approach > 0.0, select(time > 0.0, time, 0.0), math.inf)
        return self._taken(depth <= self.room.value, time, None, r, v), True

    def falling_hit(self, r, v, pull):
        depth = self.inner(r) - self.offset
        b, a = 0.5 * dot(self.normal, v), 0.5 * dot(self.normal, pull)
        time = rise_time(depth, b, a)
        # From behind the plane, beyond an edge, it falls through the plane and back.
        comes_back = (b < 0.0) & (a > 0.0) & (b * b >= a * depth)
        return self._taken((depth <= self.room.value) | comes_back, time, pull, r, v), True

    def _taken(self, may_hit, time, pull, r, v):
        """Return the time at which its plane is met from inside, if the hit is at the facet, else infinity."""
        # If the plane is never met, the start is the place: every place is then finite.
        t = select(time < math.inf, time, 0.0)
        place = r + displacement(pull, v, t)
        here = may_hit & (not self.is_beyond(place, 0.0))
        return select(here, time, math.inf)

    def safe_time(self, r, v, pull):
        time, _found = self.falling_hit(r, v, pull)
        return time

    @outlined
    def moving_step(self, seen, longest):
        is_behind = self.phi(seen.r) > self.room.value
        sign = select(is_behind, -1.0, 1.0)
        plane = PlaneNumbers(sign * self.normal, sign * self.offset)
        overlap = self.room.value + self.corners.beyond
        edges = tuple(PlaneNumbers(inwards, dot(inwards, start) - overlap) for start, inwards in self.edges())
        return patch_step(plane, is_behind, edges, seen, longest)

    def way_past(self, seen, longest):
        """Return the `WayPast` of a flight up to `longest`: one that misses stays before the plane or beyond an edge.

        The level of its plane is between c + 2 b t + (a - less) t^2 and c + 2 b t + (a + more) t^2: it rises between
        the roots of both, unless the lower one comes back.
        """
        c, b, a = self.phi(seen.r), 0.5 * dot(self.normal, seen.v), 0.5 * dot(self.normal, seen.a)
        jerk, room, sixth = seen.jerk(longest), self.room.value, longest * (1.0 / 6.0)
        along, off = jerk.along(self.normal), sixth * jerk.off
        more, less = sixth * positive(along) + off, sixth * positive(-along) + off
        begin, end = rise_time(c, b, a + more), rise_time(c - room, b, a - less)
        stays = (a >= less) | (c - room + longest * (2.0 * b + longest * (a - less)) > 0.0)
        is_near = begin < longest
        begin, end = select(is_near, begin, 0.0), select(stays & (end < longest), end, longest)
        beside = 0.5 * seen.bounds(longest).speed * (end - begin) + off * end * end + room
        misses = (c <= room) & ((not is_near) | self.is_beyond(seen.place(0.5 * (begin + end), jerk), beside))
        return WayPast(misses, select(c <= room, begin, 0.0))


class SheetSide(FacetNumbers):
    """One side of a triangle that is a wall from both sides: a facet of a sheet; its other side is another facet.

    The distance between the sides is so large that the place of a particle determines its side, also in contact.
    """

    def behind(self):
        return _BEHIND_SIDE * self.room.value

    def is_ahead(self, start, end, near):
        depth, within = self.phi(end), self.within(end)
        beyond = select(within < 0.0, within, 0.0)
        return (self.phi(start) <= self.behind()) & (beyond * beyond + depth * depth <= near * near)

    def elsewhere(self, beyond, depth):
        # A place behind this side is on the other side of the sheet, and does not meet this one.
        away = -math.sqrt(beyond * beyond + depth * depth)
        return select(depth > self.behind(), -math.inf, away)
