"""The walls of a union of several rooms that balls meet, by the nearest place of their faces, edges and tips.

A face is a wall of a room. A part of it that is in no other room is a wall of the union, and *seen*. An edge is where
walls of two rooms cross; balls turn about it. A tip is a place where walls of three rooms meet. The *foot* of a ball is
the nearest place of a face or an edge. On an edge Newton's method finds it: each step goes to the place
nearest to the ball on the line in both tangent planes. Faces that edges join are one wall; so are coincident faces.

A soft ball at such a wall is pushed from its nearest place, by a gap g = R - d at the distance d. Two faces of a room
may meet in a corner around the balls and be of one wall, as two sides of a tunnel are, joined by the rim of its mouth.
A ball in such a corner has a spring at each face: the gap of the wall is the root of the sum of the squares,

    g^2 = g(nearest)^2 + sum over corners of (g(one)^2 - g(corner)^2)                                             (1)

where `one` is the farther of the two faces, and `corner` its nearest place. The distance from a face is the distance
from all its places and edges. So g has no jump where a ball leaves the tunnel: both faces are as far as the corner.

While all of a hard ball is within one room, its flight meets nothing. Where it leaves the room, it meets the wall of
this room, if its foot there is seen. Any other flight takes safe steps. If the foot on a face is seen, it is free until
it meets the parallel surface. Near an edge it is free for a time that follows from the curvature of the edge. A hidden
face is not met before its foot may be seen. A hidden edge is not met before its foot may be seen or is as near as a
radius.
"""

import math
from typing import Any

from ...kernel.jit import kernel, outlined, select
from ...kernel.limits import EPSILON
from ...kernel.record import Record
from ...kernel.vector import ZERO, Vec, absolute, column, cross, dot, either, norm, square, total
from ..contract import Bent, Smooth
from ..shapes.plane import PlaneNumbers
from ..shapes.slab import SlabNumbers
from ..time_of_impact import march, rising
from ..time_of_impact.flights import Hit

# The most steps of Newton's method to an edge. A step no longer than this part of a place, its round-off, is the last.
_SWEEPS, _STILL = 60, 4.0 * EPSILON
# Edges are found up to this number of radii away.
_FAR = 4.0
# Walls are parallel if the square of the sine is below this.
_PARALLEL = 1e-18
# Flat walls are parallel if the square of the cosine is above this.
FLAT, _ALIGNED = (PlaneNumbers, SlabNumbers), 1.0 - 1e-14


class RoomFace(Record):
    """A wall of a room."""

    wall: Any
    rooms: Any  # the number of the room, twice
    number: float  # the number of the wall among all walls of all rooms
    round: Any = None  # the smallest radius of curvature [m]; None if it depends on the place
    slope: float = 0.0  # its steepest decrease along the wall, a length per length


class RoomEdge(Record):
    """An edge, where walls of two rooms cross."""

    one: Any
    other: Any
    rooms: Any  # the numbers of the two rooms
    bend: float = math.inf  # the smallest radius of curvature [m]

    def bend_at(self, x):
        """Return the radius of curvature of the edge at a place, by those of both walls along it; in Python."""
        n, m = outward(self.one, x), outward(self.other, x)
        along = cross(n, m)
        sine2 = square(along)
        if not sine2 > 0.0:
            # Walls that touch have no edge.
            return math.inf
        along = along * (1.0 / math.sqrt(sine2))
        a, b = (wall.outward_acceleration(x, along, ZERO) for wall in (self.one, self.other))
        bend2 = (a * a + b * b - 2.0 * dot(n, m) * a * b) / sine2
        return 1.0 / math.sqrt(bend2) if bend2 > 0.0 else math.inf


class RoomSide(Record):
    """A face that makes a corner with another one, and the edges at which it ends."""

    face: RoomFace
    edges: Any


class RoomCorner(Record):
    """The place where two faces of one room, and of one wall, join around the balls."""

    line: RoomEdge  # their line of intersection
    one: RoomSide
    other: RoomSide
    ends: Any  # places where the line ends at another room


class Rim(Record):
    """The surface at a radius around an edge, next to a ball: the foot of the ball, and its distance `away`."""

    bend: float
    foot: Any
    away: float
    radius: float

    side = 1.0

    def bent(self, r):
        away, room = self.away, self.bend - self.away
        reach = 0.5 * min(max(room, 0.0), away)
        left, short = room - reach, away - reach
        most = select(left > 0.0, 0.5 / select(left > 0.0, left, 1.0), 0.0)
        clear = away - self.radius
        n = (self.foot - r) * (1.0 / select(away > 0.0, away, 1.0))
        return Bent(n, -clear, most, max(most, 0.5 / select(short > 0.0, short, 1.0)), reach, max(clear, 0.0))


class JoinedFaces(Smooth):
    """The wall of the centres of balls: the places a radius away from faces of a union, their edges and their tips."""

    rooms: Any  # the walls of each room of the union
    faces: Any
    edges: Any
    tips: Any  # places
    corners: Any  # `RoomCorner`s
    radius: Any  # of a ball [m]
    slack: float  # round-off of a place [m]
    most: float  # a distance larger than any other [m]

    side = 1.0

    def grown(self, radius):
        return self._replace(radius=radius)

    def phi(self, r):
        return self.distance(r) if len(self.corners) == 0 else _pressed(self, r)[0]

    def gradient(self, r):
        return self.unit_normal(r) if len(self.corners) == 0 else _pressed(self, r)[1]

    def mean_gradient(self, r0, r1):
        return self.gradient(0.5 * (r0 + r1)) if len(self.corners) == 0 else _by_depth(self, r0, r1)

    def distance(self, r):
        return self.radius - nearest(self, r)[0]

    def unit_normal(self, r):
        away, place = nearest(self, r)
        return _towards(place, r, away)

    def clearance(self, r):
        return at_least(self, r) - self.radius

    def project(self, r):
        away, place = nearest(self, r)
        return r + ((away - self.radius) / select(away > 0.0, away, 1.0)) * (place - r)

    @outlined
    def look(self, r, v, pull, t, is_first):
        """The `SafeStep` of a flight from the time t on."""
        p, w = r + t * (v + (0.5 * t) * pull), v + t * pull
        # Another wall of the union is met on the way out.
        if not is_first and gap_of(self.rooms, p) > self.slack:
            return march.SafeStep(t, math.inf, -1.0, -1.0)
        room = EPSILON * total(absolute(p))
        way = _in_rooms(self.rooms, self.radius, self.slack, AtInstant(p, w, pull), _WITHIN * room)
        if way.wall >= 0.0:
            is_own = False
            for face in self.faces:
                is_own = is_own | (face.number == way.wall)
            return march.SafeStep(t, select(is_own, way.time, math.inf), select(is_own, 0.0, -1.0), -1.0)
        if way.time > 0.0:
            return march.SafeStep(t, way.time, -1.0, -1.0)
        step = _until_any(self, AtInstant(p, w, pull), math.inf)
        arrives = (not is_first or step == 0.0) and march.travelled(norm(w), norm(pull), step) <= 2.0 * room
        if arrives and not is_first:
            away, place = nearest(self, p)
            # By more than round-off: the curvature of an edge may exceed that of its samples.
            if away < self.radius - room and dot(place - p, w) > 0.0:
                return march.SafeStep(t, 0.0, -1.0, 0.0)
        return march.SafeStep(t, step, select(arrives, 0.0, -1.0), -1.0)

    @outlined
    def moving_step(self, seen, longest):
        """The `LevelStep` of the wall with all its faces, edges and tips."""
        away, place = nearest(self, seen.r)
        half = 0.5 * dot((place - seen.r) * (1.0 / select(away > 0.0, away, 1.0)), seen.v)
        step = _until_any(self, AtInstantInFrame(seen.r, seen, longest), longest)
        return rising.LevelStep(self.radius - away, half, step)


@kernel
def touched(walls, points, radius, found):
    """Write how far balls at points (3, N) with their radii (N,) reach beyond any of the walls into `found`."""
    for i in range(points.shape[1]):
        found[i] = deepest_in(walls, column(points, 0, i), radius[i])


def deepest_in(walls, r, radius):
    """Return how far a ball reaches beyond any of the walls."""
    deepest = -math.inf
    for wall in walls:
        deepest = max(deepest, wall.grown(radius).distance(r))
    return deepest


@outlined
def nearest(wall, r):
    """Return (distance, place) of the place of a wall nearest to r; edges beyond `_FAR` radii are not considered."""
    best, place = wall.most, r
    for face in wall.faces:
        best, place = _or_on_face(wall, face, r, (best, place))
    for edge in wall.edges:
        best, place = _or_on_edge(wall, edge, r, (best, place))
    for tip in wall.tips:
        best, place = _or_at(tip, r, (best, place))
    return best, place


def _or_on_face(wall, face, r, known):
    """Return (distance, place) of the nearest place of a face, or of a known place that is no farther."""
    best, place = known
    foot = r - face.wall.distance(r) * outward(face.wall, r)
    away = norm(foot - r)
    better = is_seen(wall.rooms, face.rooms, foot, wall.slack) & (away < best)
    return select(better, away, best), either(better, foot, place)


def _or_on_edge(wall, edge, r, known):
    """Return (distance, place) of the nearest place of an edge, or of a known place that is no farther."""
    foot = crossing(edge.one, edge.other, r, _FAR * wall.radius)
    on_both = max(abs(edge.one.distance(foot)), abs(edge.other.distance(foot))) <= wall.slack
    best, place = known
    away = norm(foot - r)
    better = on_both & is_seen(wall.rooms, edge.rooms, foot, wall.slack) & (away < best)
    return select(better, away, best), either(better, foot, place)


def _or_at(tip, r, known):
    """Return (distance, place) of a tip, or of a known place that is no farther."""
    best, place = known
    away = norm(tip - r)
    better = away < best
    return select(better, away, best), either(better, tip, place)


def _towards(place, r, away):
    """Return the unit vector from r to a place at this distance."""
    return (place - r) * (1.0 / select(away > 0.0, away, 1.0))


@outlined
def _pressed(wall, r):
    """Return (gap, its gradient) of a soft ball."""
    away, place = nearest(wall, r)
    gap, n = wall.radius - away, _towards(place, r, away)
    if gap > 0.0:
        # (1)
        squares, push = gap * gap, gap * n
        for corner in wall.corners:
            if max(abs(corner.line.one.distance(r)), abs(corner.line.other.distance(r))) < wall.radius:
                second, its_place, third, end = _in_corner(wall, corner, r)
                g, h = max(wall.radius - second, 0.0), max(wall.radius - third, 0.0)
                squares += g * g - h * h
                push = push + g * _towards(its_place, r, second) - h * _towards(end, r, third)
        gap = math.sqrt(squares)
        n = push * (1.0 / gap)
    return gap, n


def _by_depth(wall, r0, r1):
    """Return the mean of the gradients at both ends of a step, weighted by depth; equal weights if both are outside."""
    (g0, n0), (g1, n1) = _pressed(wall, r0), _pressed(wall, r1)
    a, b = max(g0, 0.0), max(g1, 0.0)
    is_in = a + b > 0.0
    a, b = select(is_in, a, 0.5), select(is_in, b, 0.5)
    return (1.0 / (a + b)) * (a * n0 + b * n1)


@outlined
def _in_corner(wall, corner, r):
    """Return (distance, place) of the farther of the two faces of a corner, and of the corner itself."""
    best, place = _or_on_edge(wall, corner.line, r, (wall.most, r))
    for end in corner.ends:
        best, place = _or_at(end, r, (best, place))
    one, its_place = _on_side(wall, corner.one, r, (best, place))
    other, others_place = _on_side(wall, corner.other, r, (best, place))
    return max(one, other), either(one > other, its_place, others_place), best, place


def _on_side(wall, side, r, known):
    """Return (distance, place) of the nearest place of a face with its edges, no farther than a known place."""
    best, place = _or_on_face(wall, side.face, r, known)
    for edge in side.edges:
        best, place = _or_on_edge(wall, edge, r, (best, place))
    return best, place


@outlined
def at_least(wall, r):
    """Return a lower bound of the distance to the nearest place, also from afar, where `nearest` ignores edges."""
    best = wall.most
    for face in wall.faces:
        best = min(best, _at_least_to(wall, face, r))
    for edge in wall.edges:
        best = min(best, max(abs(edge.one.distance(r)), abs(edge.other.distance(r))))
    for tip in wall.tips:
        best = min(best, norm(tip - r))
    return best


def _at_least_to(wall, face, r):
    """Return this bound for a face. If its foot is hidden, the seen part is beside it, maybe without an edge there."""
    away, n, flat = face.wall.distance(r), outward(face.wall, r), isinstance(face.wall, FLAT)
    depth = max(hidden(wall.rooms, face.rooms, r - away * n, n if flat else ZERO, wall.slack), 0.0)
    return math.sqrt(away * away + depth * depth) if flat else max(abs(away), depth - abs(away))


def outward(wall, r):
    """Return the unit vector along the gradient of the distance from a wall, also far from the wall."""
    return wall.side * wall.gradient(r)


def is_seen(rooms, own, place, slack):
    """Whether a place of a face or an edge is in its own rooms and in no other room."""
    return hidden(rooms, own, place, ZERO, slack) <= slack


def gap_of(rooms, place):
    """Return the least distance of a place outside all rooms; below 0 in one of them."""
    least = math.inf
    for room in rooms:
        gap = -math.inf
        for wall in room:
            gap = max(gap, wall.distance(place))
        least = min(least, gap)
    return least


@outlined
def hidden(rooms, own, place, n, slack):
    """Return a lower bound of the distance from a place of a face or an edge to the seen part; at most 0 if it is seen.

    A place that moves along a flat face with the normal n stays inside walls that are parallel to it, but not inside
    walls in the plane of the face, where round-off decides on which side it is.

    Args:
        rooms: the walls of each room of the union.
        own: the numbers of the rooms that the face or the edge belongs to.
        place: the place.
        n: the unit normal of a flat face, else 0.
        slack: round-off of a place [m].
    """
    depth = -math.inf
    for k, room in enumerate(rooms):
        inside, outside = -math.inf, -math.inf
        for wall in room:
            away = wall.distance(place)
            inside = max(inside, away)
            if isinstance(wall, FLAT):
                turn = dot(n, outward(wall, place))
                away = select((away < -slack) & (turn * turn > _ALIGNED), -math.inf, away)
            outside = max(outside, away)
        is_own = own[0] == k
        for number in own[1:]:
            is_own = is_own | (number == k)
        depth = max(depth, select(is_own, inside, -outside))
    return depth


@outlined
def crossing(one, other, y, far):
    """Return the place nearest to y where two walls cross; y itself if one of them is not nearer than `far`."""
    x = y
    if max(abs(one.distance(y)), abs(other.distance(y))) < far:
        for _sweep in range(_SWEEPS):
            n, m = outward(one, x), outward(other, x)
            a = dot(n, x - y) - one.distance(x)
            b = dot(m, x - y) - other.distance(x)
            c = dot(n, m)
            sine2 = 1.0 - c * c
            f = select(sine2 > _PARALLEL, 1.0 / select(sine2 > _PARALLEL, sine2, 1.0), 0.0)
            to = y + (f * (a - c * b)) * n + (f * (b - c * a)) * m
            way = norm(to - x)
            x = to
            if way <= _STILL * (norm(x) + norm(y)):
                break
    return x


# --- Flights of hard balls -------------------------------------------------------------------------------

# Where the edge next to a ball is not found, the ball moves by this part of its radius. Where an edge is hidden, the
# ball moves by at least this part of the way of its foot: the radius of curvature of an edge is a bound from samples.
_UNFOUND, _LEAST = 0.05, 0.125
# A ball that touches a wall of a room is within it, up to this number of round-offs of a place.
_WITHIN = 8.0


class AtInstant(Record):
    """A flight at an instant; the methods return times during which it surely stays clear of walls and edges [s]."""

    r: Vec
    v: Vec
    pull: Vec

    def place(self, t):
        """Return the place after a time."""
        return self.r + t * (self.v + (0.5 * t) * self.pull)

    def until_wall(self, grown):
        """Return the time to the parallel surface of a wall."""
        time, _meets = _wall_hit(grown, self)
        return time

    def until_rim(self, rim):
        """Return the time to a ball around an edge."""
        return march.safe_step(rim, self.r, self.v, self.pull, 0.0)[2]

    def until_gone(self, way):
        """Return the least time in which the flight covers `way`."""
        return march.time_to_travel(norm(self.v), norm(self.pull), way)


@outlined
def _wall_hit(grown, flight):
    """Return the time to the parallel surface of a wall, and whether an `AtInstant` meets it then."""
    if flight.pull.x == 0.0 and flight.pull.y == 0.0 and flight.pull.z == 0.0:
        return grown.first_hit(flight.r, flight.v)
    return grown.falling_hit(flight.r, flight.v, flight.pull)


class AtInstantInFrame(Record):
    """`AtInstant` in the frame of a union that moves, with times up to the longest one [s]."""

    r: Vec
    seen: rising.InWallFrame
    longest: float

    def until_wall(self, grown):
        return grown.moving_step(self.seen, self.longest).time

    def until_rim(self, rim):
        return rising.bent_step(rim, self.seen, self.longest).time

    def until_gone(self, way):
        return Hidden(self.seen, way).longest(self.longest)


class Hidden(rising.Ahead):
    """A wall that is not met before the flight has covered a way [m] in its frame."""

    seen: rising.InWallFrame
    way: float

    def rise(self, within):
        speed = self.seen.bounds(within).speed
        return select(speed > 0.0, self.way / select(speed > 0.0, speed, 1.0), math.inf)


@outlined
def _in_rooms(rooms, radius, slack, flight, near):
    """Return the `Hit` of a ball with a wall of the room in which it stays longest; the wall is -1 if it meets none.

    `near` is round-off of its place [m].
    """
    way, own, foot, before = Hit(0.0, -1.0), 0, flight.r, 0.0
    for k, room in enumerate(rooms):
        gap = -math.inf
        for wall in room:
            gap = max(gap, wall.distance(flight.r))
        if gap <= near - radius:
            # All of the ball is within the room: it is inside each wall of the room.
            first, place = Hit(math.inf, -1.0), foot
            for i, wall in enumerate(room):
                until, there = _way_to(wall, before + float(i), radius, flight)
                if until.time < first.time:
                    first, place = until, there
            if first.time > way.time:
                way, own, foot = first, k, place
        before += float(len(room))
    is_met = way.wall >= 0.0 and is_seen(rooms, (own, own), foot, slack)
    return way._replace(wall=select(is_met, way.wall, -1.0))


@outlined
def _way_to(wall, number, radius, flight):
    """Return (the `Hit` with the wall of this number, the foot of the ball on the wall then)."""
    time, meets = _wall_hit(wall.grown(radius), flight)
    there = flight.place(select(time < math.inf, time, 0.0))
    return Hit(time, select(meets, number, -1.0)), there - wall.distance(there) * outward(wall, there)


def _until_any(wall, flight, longest):
    """Return a time, at most `longest`, during which a flight surely stays clear of all faces, edges and tips."""
    step = longest
    for face in wall.faces:
        step = min(step, _until_face(wall, face, flight))
    for edge in wall.edges:
        step = min(step, _until_edge(wall, edge, flight))
    for tip in wall.tips:
        step = min(step, flight.until_rim(_rim_of(wall, tip, flight.r)))
    return step


@outlined
def _until_face(wall, face, flight):
    """Return a time during which a flight surely stays clear of a face."""
    p = flight.r
    away, n = face.wall.distance(p), outward(face.wall, p)
    foot = p - away * n
    along, step = n if isinstance(face.wall, FLAT) else ZERO, 0.0
    depth = hidden(wall.rooms, face.rooms, foot, along, wall.slack)
    # A face is seen only from inside its own room.
    faces = depth <= wall.slack and away <= 0.0
    if faces or away <= -wall.radius:
        step = flight.until_wall(face.wall.grown(wall.radius))
    if faces:
        return step
    if depth <= wall.slack:
        return flight.until_gone(away)
    way = _way_of_foot(_round_at(face, foot, n), face.slope, abs(away), depth)
    if isinstance(face.wall, SlabNumbers):
        # At the middle of the wall the foot moves over to the other side.
        way = min(way, face.wall.radius + away)
    return max(step, flight.until_gone(max(abs(away) - wall.radius, way)))


@outlined
def _until_edge(wall, edge, flight):
    """Return a time during which a flight surely stays clear of an edge."""
    p = flight.r
    least = max(abs(edge.one.distance(p)), abs(edge.other.distance(p)))
    foot = crossing(edge.one, edge.other, p, _FAR * wall.radius)
    if max(abs(edge.one.distance(foot)), abs(edge.other.distance(foot))) > wall.slack:
        return _until_seen(wall, least, _UNFOUND * wall.radius, flight)
    away, depth = norm(foot - p), hidden(wall.rooms, edge.rooms, foot, ZERO, wall.slack)
    if depth > wall.slack:
        return _until_seen(wall, away, max(_way_of_foot(edge.bend, 0.0, away, depth), _LEAST * depth), flight)
    return flight.until_rim(Rim(edge.bend, foot, away, wall.radius))


def _rim_of(wall, tip, p):
    """Return the `Rim` of a tip: that of a straight edge with its foot at the tip."""
    return Rim(math.inf, tip, norm(tip - p), wall.radius)


def _round_at(face, foot, n):
    """Return the smallest radius of curvature of a face at a place with the normal n [m]."""
    if face.round is not None:
        return face.round
    along = select(abs(n.x) < 0.5, 1.0, 0.0)
    one = cross(n, Vec(along, 1.0 - along, 0.0))
    one = one * (1.0 / norm(one))
    # One of the two curvatures of a cone is 0, so that the other one is their sum in any two orthogonal directions.
    bend = abs(face.wall.outward_acceleration(foot, one, ZERO))
    bend = bend + abs(face.wall.outward_acceleration(foot, cross(n, one), ZERO))
    return select(bend > 0.0, 1.0 / select(bend > 0.0, bend, 1.0), math.inf)


def _way_of_foot(roundness, slope, away, depth):
    """Return the least way of a ball on which its foot on a wall or an edge moves by `depth`.

    With the radius of curvature R of the wall, a ball at the distance d that moves by w moves its foot by at most
    w R/(R - d - w). Along a cone R decreases by the slope times the way of the foot.
    """
    if not roundness < math.inf:
        return depth
    return depth * max(roundness - away, 0.0) / (roundness + (1.0 + slope) * depth)


def _until_seen(wall, away, way, flight):
    """Return a time during which a face or an edge stays hidden, by the `way` until it is seen, or out of reach."""
    return flight.until_gone(max(away - wall.radius, min(way, wall.radius)))
