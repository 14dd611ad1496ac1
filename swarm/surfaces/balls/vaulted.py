"""The walls of a union of several rooms that balls meet: by the place of them that is nearest.

A wall of a room is seen where it is in no other room; where walls of two rooms cross is an edge, about which balls
turn. The nearest place of a wall is its foot, that of an edge is found by Newton's method: it is the one on the line in
both planes that touch the walls, next to the ball. Where walls of three rooms meet is a tip, a place by itself.

A flight of a hard ball is looked at. Where the foot on a face is seen, the flight is free until it meets the parallel
surface; of an edge for as long as its bend says. A face or an edge that is hidden is not met before its foot may be
seen, or is as near as a radius.
"""

import math
from typing import Any

from ...kernel.jit import outlined, select
from ...kernel.limits import EPSILON
from ...kernel.record import Record
from ...kernel.vector import ZERO, Vec, absolute, cross, dot, either, norm, square, total
from ..contract import Bent, Smooth
from ..shapes.plane import PlaneNumbers
from ..shapes.slab import SlabNumbers
from ..time_of_impact import march, rising

# Newton's steps to an edge; one that is so many roundings of a place is the last.
_SWEEPS, _STILL = 60, 4.0 * EPSILON
# Edges are looked for up to so many radii.
_FAR = 4.0
# Walls are parallel where the square of the sine is below this.
_PARALLEL = 1e-18
# Flat walls are parallel where the square of the cosine is above this.
FLAT, _ALIGNED = (PlaneNumbers, SlabNumbers), 1.0 - 1e-14


class RoomFace(Record):
    """A wall of a room."""

    wall: Any
    rooms: Any  # the number of the room, twice
    round: Any = None  # the smallest radius of curvature [m], None where it is another one at each place
    slope: float = 0.0  # by how much at most that becomes less, of the way along the wall


class RoomEdge(Record):
    """Walls of two rooms that cross."""

    one: Any
    other: Any
    rooms: Any  # the numbers of the two rooms
    bend: float = math.inf  # the smallest radius of curvature [m]

    def bend_at(self, x):
        """The radius of curvature at a place, in Python: by what both walls bend along the edge."""
        n, m = outward(self.one, x), outward(self.other, x)
        along = cross(n, m)
        sine2 = square(along)
        along = along * (1.0 / math.sqrt(sine2))
        a, b = (wall.outward_acceleration(x, along, ZERO) for wall in (self.one, self.other))
        bend2 = (a * a + b * b - 2.0 * dot(n, m) * a * b) / sine2
        return 1.0 / math.sqrt(bend2) if bend2 > 0.0 else math.inf


class Rim(Record):
    """An edge as a ball at a place sees it: the foot, how far it is, and the radius of the ball."""

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


class Vaulted(Smooth):
    """What is farther than the radius of a ball from faces of a union, the edges between them and the tips of these."""

    rooms: Any  # the walls of each room of the union
    faces: Any
    edges: Any
    tips: Any  # places
    radius: Any
    slack: float  # round-off of a place [m]
    most: float  # farther than anything [m]

    side = 1.0

    def grown(self, radius):
        return self._replace(radius=radius)

    def phi(self, r):
        return self.radius - nearest(self, r)[0]

    def gradient(self, r):
        away, place = nearest(self, r)
        return (place - r) * (1.0 / select(away > 0.0, away, 1.0))

    def distance(self, r):
        return self.phi(r)

    def unit_normal(self, r):
        return self.gradient(r)

    def clearance(self, r):
        return at_least(self, r) - self.radius

    def project(self, r):
        away, place = nearest(self, r)
        return r + ((away - self.radius) / select(away > 0.0, away, 1.0)) * (place - r)

    def look(self, r, v, pull, t, is_first):
        return _look(self, r, v, pull, t, is_first)

    def moving_step(self, seen, longest):
        return _moving_step(self, seen, longest)


@outlined
def nearest(wall, r):
    """How far the nearest place is, and where it is."""
    best, place = wall.most, r
    for face in wall.faces:
        foot = r - face.wall.distance(r) * outward(face.wall, r)
        away = norm(foot - r)
        better = is_seen(wall.rooms, face.rooms, foot, wall.slack) & (away < best)
        best, place = select(better, away, best), either(better, foot, place)
    for edge in wall.edges:
        foot = crossing(edge.one, edge.other, r, _FAR * wall.radius)
        away = norm(foot - r)
        on_both = max(abs(edge.one.distance(foot)), abs(edge.other.distance(foot))) <= wall.slack
        better = on_both & is_seen(wall.rooms, edge.rooms, foot, wall.slack) & (away < best)
        best, place = select(better, away, best), either(better, foot, place)
    for tip in wall.tips:
        away = norm(tip - r)
        better = away < best
        best, place = select(better, away, best), either(better, tip, place)
    return best, place


@outlined
def at_least(wall, r):
    """A lower bound of how far the nearest place is, also from afar, where `nearest` finds no edges."""
    best = wall.most
    for face in wall.faces:
        away = face.wall.distance(r)
        seen = is_seen(wall.rooms, face.rooms, r - away * outward(face.wall, r), wall.slack)
        best = select(seen, min(abs(away), best), best)
    for edge in wall.edges:
        best = min(best, max(abs(edge.one.distance(r)), abs(edge.other.distance(r))))
    for tip in wall.tips:
        best = min(best, norm(tip - r))
    return best


def outward(wall, r):
    """The unit vector along the gradient of the distance from a wall, also far from that."""
    return wall.side * wall.gradient(r)


def is_seen(rooms, own, place, slack):
    """Whether a place of a face or an edge is in its own rooms, and not inside of others."""
    return hidden(rooms, own, place, ZERO) <= slack


@outlined
def hidden(rooms, own, place, n):
    """How far a place of a face or an edge is from where it would be seen, at least; 0 or less where it is seen.

    A flat face has the normal n: what is behind a wall along it stays so.

    Args:
        rooms: the walls of each room of the union.
        own: the numbers of the rooms that the face or the edge belongs to.
        place: the place.
        n: a unit normal, or 0.
    """
    depth = -math.inf
    for k, room in enumerate(rooms):
        inside, outside = -math.inf, -math.inf
        for wall in room:
            away = wall.distance(place)
            inside = max(inside, away)
            if isinstance(wall, FLAT):
                turn = dot(n, outward(wall, place))
                away = select((away < 0.0) & (turn * turn > _ALIGNED), -math.inf, away)
            outside = max(outside, away)
        is_own = own[0] == k
        for number in own[1:]:
            is_own = is_own | (number == k)
        depth = max(depth, select(is_own, inside, -outside))
    return depth


@outlined
def crossing(one, other, y, far):
    """The place where two walls cross that is nearest to y; any one where both are not nearer than `far`."""
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

# Of a radius, how far a ball goes where the edge next to it is not found. A ball that is hidden from an edge goes at
# least this part of what its foot has to go: the radius of curvature of an edge is a lower bound from samples.
_UNFOUND, _LEAST = 0.05, 0.125


class AtInstant(Record):
    """A flight at an instant, and how long it surely stays clear of something."""

    r: Vec
    v: Vec
    pull: Vec

    def until_wall(self, grown):
        """How long it stays clear of a parallel surface."""
        if self.pull.x == 0.0 and self.pull.y == 0.0 and self.pull.z == 0.0:
            time, _meets = grown.first_hit(self.r, self.v)
        else:
            time, _meets = grown.falling_hit(self.r, self.v, self.pull)
        return time

    def until_rim(self, rim):
        """How long it stays clear of an edge."""
        return march.safe_step(rim, self.r, self.v, self.pull, 0.0)[2]

    def until_gone(self, way):
        """How long it takes to go so far, at the least."""
        return march.time_to_travel(norm(self.v), norm(self.pull), way)


class AtInstantInFrame(Record):
    """The same in the frame of a union that moves, for at most the longest time [s]."""

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
    """What is not met on the first part of a way, as the frame sees it."""

    seen: rising.InWallFrame
    way: float

    def rise(self, within):
        speed = self.seen.bounds(within).speed
        return select(speed > 0.0, self.way / select(speed > 0.0, speed, 1.0), math.inf)


@outlined
def _look(wall, r, v, pull, t, is_first):
    """The `SafeStep` of a flight at a time."""
    p, w = r + t * (v + (0.5 * t) * pull), v + t * pull
    away, place = nearest(wall, p)
    room = 2.0 * EPSILON * total(absolute(p))
    if not is_first and away < wall.radius and dot(place - p, w) > 0.0:
        return march.SafeStep(t, 0.0, -1.0, 0.0)
    step = _until_any(wall, AtInstant(p, w, pull), math.inf)
    arrives = (not is_first or step == 0.0) and march.travelled(norm(w), norm(pull), step) <= room
    return march.SafeStep(t, step, select(arrives, 0.0, -1.0), -1.0)


@outlined
def _moving_step(wall, seen, longest):
    """The `LevelStep` of all faces, edges and tips."""
    away, place = nearest(wall, seen.r)
    half = 0.5 * dot((place - seen.r) * (1.0 / select(away > 0.0, away, 1.0)), seen.v)
    step = _until_any(wall, AtInstantInFrame(seen.r, seen, longest), longest)
    return rising.LevelStep(wall.radius - away, half, step)


def _until_any(wall, flight, longest):
    """How long, at most the longest time, a flight surely stays clear of all faces, edges and tips."""
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
    """How long a flight surely stays clear of a face."""
    p = flight.r
    away, n = face.wall.distance(p), outward(face.wall, p)
    foot = p - away * n
    depth, step = hidden(wall.rooms, face.rooms, foot, n if isinstance(face.wall, FLAT) else ZERO), 0.0
    # What is seen is seen from inside of its own room alone.
    faces = depth <= wall.slack and away <= 0.0
    if faces or away <= -wall.radius:
        step = flight.until_wall(face.wall.grown(wall.radius))
    if faces:
        return step
    if depth <= wall.slack:
        return flight.until_gone(away)
    way = _way_of_foot(_round_at(face, foot, n), face.slope, abs(away), depth)
    return max(step, _until_seen(wall, abs(away), way, flight))


@outlined
def _until_edge(wall, edge, flight):
    """The same of an edge."""
    p = flight.r
    least = max(abs(edge.one.distance(p)), abs(edge.other.distance(p)))
    foot = crossing(edge.one, edge.other, p, _FAR * wall.radius)
    if max(abs(edge.one.distance(foot)), abs(edge.other.distance(foot))) > wall.slack:
        return _until_seen(wall, least, _UNFOUND * wall.radius, flight)
    away, depth = norm(foot - p), hidden(wall.rooms, edge.rooms, foot, ZERO)
    if depth > wall.slack:
        return _until_seen(wall, away, max(_way_of_foot(edge.bend, 0.0, away, depth), _LEAST * depth), flight)
    return flight.until_rim(Rim(edge.bend, foot, away, wall.radius))


def _rim_of(wall, tip, p):
    """A tip as a ball at a place sees it: a straight edge with a foot that stays where it is."""
    return Rim(math.inf, tip, norm(tip - p), wall.radius)


def _round_at(face, foot, n):
    """The smallest radius of curvature of a face at a place with the normal n [m]."""
    if face.round is not None:
        return face.round
    along = select(abs(n.x) < 0.5, 1.0, 0.0)
    one = cross(n, Vec(along, 1.0 - along, 0.0))
    one = one * (1.0 / norm(one))
    # One of the two curvatures of a cone is 0, so that the other one is their sum in any two directions.
    bend = abs(face.wall.outward_acceleration(foot, one, ZERO))
    bend = bend + abs(face.wall.outward_acceleration(foot, cross(n, one), ZERO))
    return select(bend > 0.0, 1.0 / select(bend > 0.0, bend, 1.0), math.inf)


def _way_of_foot(roundness, slope, away, depth):
    """How far a ball goes at least before its foot on a wall, or edge, goes by a distance `depth`.

    With the radius of curvature R of the wall, a ball at the distance d that goes the way w moves its foot by at most
    w R/(R - d - w). On a cone R is then less by the slope times w.
    """
    if not roundness < math.inf:
        return depth
    return depth * max(roundness - away, 0.0) / (roundness + (1.0 + slope) * depth)


def _until_seen(wall, away, way, flight):
    """How long a face or an edge stays hidden, or is farther than a radius, with the way until its foot may be seen."""
    return flight.until_gone(max(away - wall.radius, min(way, wall.radius)))
