"""The walls of a union of several rooms that balls meet: by the place of them that is nearest.

A wall of a room is seen where it is in no other room; where walls of two rooms cross is an edge, about which balls
turn. The nearest place of a wall is its foot, that of an edge is found by Newton's method: it is the one on the line in
both planes that touch the walls, next to the ball.
"""

from typing import Any

from ...kernel.jit import outlined, select
from ...kernel.limits import EPSILON
from ...kernel.record import Record
from ...kernel.vector import dot, either, norm
from ..contract import Smooth

# Newton's steps to an edge; one that is so many roundings of a place is the last.
_SWEEPS, _STILL = 60, 4.0 * EPSILON
# Edges are looked for up to so many radii.
_FAR = 4.0
# Walls are parallel where the square of the sine is below this.
_PARALLEL = 1e-18


class RoomFace(Record):
    """A wall of a room, the walls of that room, and the other rooms."""

    wall: Any
    own: Any
    others: Any


class RoomEdge(Record):
    """Walls of two rooms that cross, the walls of both of these, and the other rooms."""

    one: Any
    other: Any
    own: Any
    others: Any


class Vaulted(Smooth):
    """What is farther than the radius of a ball from faces of a union and the edges between them."""

    faces: Any
    edges: Any
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
        return -self.phi(r)


@outlined
def nearest(wall, r):
    """How far the nearest place is, and where it is."""
    best, place = wall.most, r
    for face in wall.faces:
        foot = r - face.wall.distance(r) * outward(face.wall, r)
        away = norm(foot - r)
        better = is_seen(face, foot, wall.slack) & (away < best)
        best, place = select(better, away, best), either(better, foot, place)
    for edge in wall.edges:
        foot = crossing(edge.one, edge.other, r, _FAR * wall.radius)
        away = norm(foot - r)
        on_both = max(abs(edge.one.distance(foot)), abs(edge.other.distance(foot))) <= wall.slack
        better = on_both & is_seen(edge, foot, wall.slack) & (away < best)
        best, place = select(better, away, best), either(better, foot, place)
    return best, place


def outward(wall, r):
    """The unit vector along the gradient of the distance from a wall, also far from that."""
    return wall.side * wall.gradient(r)


@outlined
def is_seen(part, place, slack):
    """Whether a place of a face or an edge is in its own rooms, and not inside of others."""
    seen = True
    for wall in part.own:
        seen = seen & (wall.distance(place) <= slack)
    for room in part.others:
        gap = room[0].distance(place)
        for wall in room:
            gap = max(gap, wall.distance(place))
        seen = seen & (gap >= -slack)
    return seen


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
