"""A union of several rooms, or a foam, for balls: a surface of walls, each of faces that edges join."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...kernel.limits import EPSILON
from ...kernel.vector import ZERO, Vec, cross, dot, norm
from ..room import room_bounds, union_bounds
from ..shapes.box import Box
from ..shapes.cone import Cone
from ..shapes.cylinder import Cylinder
from ..shapes.plane import Plane
from ..shapes.slab import Slab
from ..shapes.sphere import Sphere
from ..surface import Box as Bounds
from ..surface import Surface
from .joined_faces import (
    FLAT,
    JoinedFaces,
    RoomCorner,
    RoomEdge,
    RoomFace,
    RoomSide,
    crossing,
    deepest_in,
    is_seen,
    outward,
    touched,
)
from .tip import TipPlane

# As parts of the extent: the round-off of a place, and a distance that is larger than any other.
_SLACK, _FAR = 1e-11, 1e6
# Where an edge only touches the wall of a third room, the place is known to the square root of the round-off.
_TOUCHES = math.sqrt(_SLACK)
# Edges are searched from a place in each of this number of parts, along each axis, of the common bounds of two rooms;
# the most rooms.
_PARTS, _MOST = 3, 64
# This part of the smallest radius of curvature found on an edge is a lower bound. It is searched from this number of
# places on the edge, unless it is the same at all of them, down to this part of the way to the next place.
_ROUND, _SHARPEST, _ALIKE, _SHORTEST = 0.999, 4, 1e-6, 1e-3
# An edge is also seen if it is seen beside a place, at this number of round-offs of a place from it.
_BESIDE = 1e5
# The most steps of Newton's method to a tip; a step no longer than this round-off of a place is the last. Walls
# with normals that span no more than this volume do not meet at a point.
_SWEEPS, _STILL, _PARALLEL = 30, 4.0 * EPSILON, 1e-9
# Normals of walls with a smooth transition have a cosine below 1 by at most this; steps onto a wall.
_SMOOTH, _PROJECTIONS = 1e-9, 4
# Up to this number of balls, the reach outside is computed in Python: compiling a kernel takes longer.
_FEW = 100
_KINDS = Sphere, Plane, Slab, Box, Cylinder, Cone


@dataclass(frozen=True, repr=False)
class JoinedRooms(Surface):
    """A union of several rooms as one surface."""

    rooms_of: Any = ()

    nouns = ("vessel", "compound solid") * 2

    def walls_of_balls(self, largest: float) -> tuple[Any, ...]:
        return _walls_of(self)

    def walls(self) -> tuple[Any, ...]:
        return _walls_of(self)

    def size(self) -> float:
        return float(min(one.size() for room in self.rooms_of for one in room))

    def extent(self) -> float:
        return float(max(one.extent() for room in self.rooms_of for one in room))

    def bounds(self) -> Bounds:
        return union_bounds(self.rooms_of)

    def phi(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        return np.asarray(np.min([np.max(gaps, axis=0) for gaps in self._gaps(points, time)], axis=0))

    def _own_gradient(self, points: ArrayLike, time: float) -> NDArray[np.float64]:
        rows, gaps = np.array(self._own_rows(points, time)), self._gaps(points, time)
        least, found = np.argmin([np.max(some, axis=0) for some in gaps], axis=0), np.zeros(np.shape(points))
        for k, (room, some) in enumerate(zip(self.rooms_of, gaps, strict=True)):
            for m, one in enumerate(room):
                found = np.where((least == k) & (np.argmax(some, axis=0) == m), one.gradient(rows), found)
        return found

    def _gaps(self, points: ArrayLike, time: float) -> list[list[NDArray[np.float64]]]:
        """Return phi of each surface of each room."""
        rows = np.array(self._own_rows(points, time))
        return [[one.phi(rows) for one in room] for room in self.rooms_of]

    def reaching_outside(
        self, points: NDArray[np.float64], radius: NDArray[np.float64], time: float = 0.0
    ) -> NDArray[np.float64]:
        points = np.array(self._own_rows(points, time))
        gaps = [[one.reaching_outside(points, 0.0 * radius) for one in room] for room in self.rooms_of]
        outside = np.min([np.max(some, axis=0) for some in gaps], axis=0)
        found, inside = outside + radius, outside <= 0.0
        count, walls = int(inside.sum()), self.walls()
        if count > _FEW:
            beyond = np.empty(count)
            touched(walls, np.ascontiguousarray(points[:, inside]), radius[inside].astype(np.float64), beyond)
            found[inside] = beyond
        else:
            for i in np.flatnonzero(inside).tolist():
                found[i] = deepest_in(walls, Vec(*points[:, i].tolist()), float(radius[i]))
        return np.asarray(found)


def joined_rooms_of(union: Any) -> JoinedRooms:
    """Return the `JoinedRooms` of a union of several rooms, or of a foam."""
    rooms = union.rooms_of_balls()
    one, still = rooms[0][0], [[replace(one.at_rest(), openings=(), present=None) for one in room] for room in rooms]
    return JoinedRooms(rooms_of=tuple(map(tuple, still)), **one.common())


def why_no_balls_in(union: Any) -> str | None:
    """Return why balls cannot meet a union of several rooms, or a foam, for the sentence of an error, or None."""
    rooms = union.rooms_of_balls()
    surfaces = [surface for room in rooms for surface in room]
    begin = f"of {len(rooms)} rooms, of which "
    if len(rooms) > _MOST:
        return f"of {len(rooms)} rooms, and balls meet at most {_MOST}, for each is compiled into the kernels"
    for surface in surfaces:
        name = type(surface).__name__
        if surface.is_solid() or not isinstance(surface, _KINDS):
            known = ", ".join(kind.__name__ for kind in _KINDS)
            return f"{begin}one is made of a {name}, and balls meet edges of rooms made of the insides of {known} alone"
    for what in surfaces[0].common():
        if len({repr(getattr(surface, what)) for surface in surfaces}) > 1:
            return f"{begin}the parts differ in {what}, while an edge belongs to both: give the {what} to the whole"
    return None


# --- Its walls -------------------------------------------------------------------------------------------

_KNOWN: dict[Any, tuple[Any, ...]] = {}


def _walls_of(joined: JoinedRooms) -> tuple[Any, ...]:
    key = repr(joined.rooms_of)
    if key not in _KNOWN:
        _KNOWN.clear()
        _KNOWN[key] = tuple(_made(joined))
    return _KNOWN[key]


def _made(joined: JoinedRooms) -> list[JoinedFaces]:
    each = [list(_each(room)) for room in joined.rooms_of]
    rooms = tuple(tuple(wall for _surface, wall in room) for room in each)
    extent = joined.extent()
    slack, bounds = _SLACK * extent, [room_bounds(room) for room in joined.rooms_of]
    first = np.cumsum([0, *map(len, rooms)]).tolist()
    faces = [
        RoomFace(wall, (k, k), float(first[k] + i), *_bend_of(one, wall))
        for k, room in enumerate(each) for i, (one, wall) in enumerate(room)
    ]  # fmt: skip
    group, edges = list(range(len(faces))), []
    tips: list[tuple[int, Vec]] = []
    for edge, (k, a), (m, b) in _edges_of(rooms):
        places = _places_in((bounds[k], bounds[m]), extent, slack)
        on_it = _places_on(edge, places, slack)
        starts = _starts_along(edge, on_it, extent)
        ends = list(_tips_of(edge, starts, rooms, bounds, slack))
        if ends or any(_is_seen_at(edge, rooms, place, slack) for place in on_it) or _turns(edge, starts, rooms, slack):
            edge = edge._replace(bend=_bend_on(edge, on_it))
            one, other = group[first[k] + a], group[first[m] + b]
            group = [one if g == other else g for g in group]
            edges.append((first[k] + a, edge))
            new = (x for x, known in ends if all(norm(x - tip) > known for _i, tip in tips))
            tips.extend((first[k] + a, tip) for tip in new)
    for edge, (k, a), (m, b) in _edges_of(rooms):
        one, other = group[first[k] + a], group[first[m] + b]
        if one != other and _are_one(edge, rooms, _places_in((bounds[k], bounds[m]), extent, slack), slack):
            group = [one if g == other else g for g in group]
    corners = list(_corners_of(faces, group, [edge for _i, edge in edges], rooms, bounds, extent))
    return [
        JoinedFaces(
            rooms, tuple(face for face, g in zip(faces, group, strict=True) if g == mine),
            tuple(edge for i, edge in edges if group[i] == mine),
            tuple(tip for i, tip in tips if group[i] == mine),
            tuple(corner for i, corner in corners if group[i] == mine), 0.0, slack, _FAR * extent,
        )
        for mine in dict.fromkeys(group)
    ]  # fmt: skip


def _each(room: Any) -> Iterator[tuple[Surface, Any]]:
    """Yield every wall of a room: (its surface, the wall)."""
    for one in room:
        for wall in one.walls_of_balls(0.0):
            yield one, wall.grown(0.0)


def _bend_of(surface: Surface, wall: Any) -> tuple[float | None, float]:
    """Return the radius of curvature of a wall [m], None for a cone; and how fast it changes along the wall."""
    if isinstance(surface, (Sphere, Cylinder)) and not isinstance(wall, FLAT):
        return surface.radius, 0.0
    if isinstance(surface, Cone) and not isinstance(wall, TipPlane):
        return None, math.tan(surface.half_angle)
    return math.inf, 0.0


def _places_in(bounds: tuple[Any, ...], extent: float, slack: float) -> list[Vec]:
    """Return places in all parts of the intersection of boxes; an empty list if it is empty."""
    low = np.clip(np.max([box[0] for box in bounds], axis=0), -extent, extent)
    high = np.clip(np.min([box[1] for box in bounds], axis=0), -extent, extent)
    if (low > high + slack).any():
        return []
    parts = np.array(list(itertools.product(range(_PARTS), repeat=3)))
    random = np.random.default_rng(0).uniform(size=parts.shape)
    return [Vec(*place) for place in (low + (parts + random) / _PARTS * (high - low)).tolist()]


def _edges_of(rooms: tuple[Any, ...]) -> Iterator[tuple[RoomEdge, tuple[int, int], tuple[int, int]]]:
    """Yield every pair of walls of two rooms: (their possible edge, (room, wall) of one, (room, wall) of the other)."""
    for k, m in itertools.combinations(range(len(rooms)), 2):
        for a, b in itertools.product(range(len(rooms[k])), range(len(rooms[m]))):
            yield RoomEdge(rooms[k][a], rooms[m][b], (k, m)), (k, a), (m, b)


def _places_on(edge: RoomEdge, places: list[Vec], slack: float) -> list[Vec]:
    """Return the places of an edge next to given places."""
    walls = edge.one, edge.other
    with np.errstate(all="ignore"):
        found = [crossing(*walls, place, math.inf) for place in places]
        return [x for x in found if _is_on(walls, x, slack)]


def _starts_along(edge: RoomEdge, on_it: list[Vec], extent: float) -> list[Vec]:
    """Return places on an edge, and far from these both ways along it."""
    return [x + way * along for x in on_it for along in [_along(edge, x)] for way in (0.0, extent, -extent)]


def _are_one(edge: RoomEdge, rooms: tuple[Any, ...], places: list[Vec], slack: float) -> bool:
    """Whether walls of two rooms coincide, or one continues the other smoothly.

    Then a ball that touches both is at one place of them, with one contact. Walls that coincide do so everywhere; walls
    with a smooth transition, as a tube and its round end, have it where a third wall of either room ends one of them.
    """
    one, other = edge.one, edge.other
    with np.errstate(all="ignore"):
        if any(_go_on(one, other, _foot_on(one, place), slack) for place in places):
            return True
        ends = (
            crossing(wall, third, place, math.inf)
            for k, wall in zip(edge.rooms, (one, other), strict=True)
            for third in rooms[k] if third is not wall
            for place in places
        )  # fmt: skip
        return any(_go_on(one, other, x, slack) and is_seen(rooms, edge.rooms, x, slack) for x in ends)


def _foot_on(wall: Any, x: Vec) -> Vec:
    for _sweep in range(_PROJECTIONS):
        x = x - wall.distance(x) * outward(wall, x)
    return x


def _go_on(one: Any, other: Any, x: Vec, slack: float) -> bool:
    """Whether a place is on two walls with the same normal there."""
    return _is_on((one, other), x, slack) and bool(dot(outward(one, x), outward(other, x)) > 1.0 - _SMOOTH)


def _corners_of(
    faces: list[RoomFace],
    group: list[int],
    edges: list[RoomEdge],
    rooms: tuple[Any, ...],
    bounds: list[Any],
    extent: float,
) -> Iterator[tuple[int, RoomCorner]]:
    """Yield the corners where faces of one room and of one wall join: each (the number of a face, the corner)."""
    slack = _SLACK * extent
    for i, j in itertools.combinations(range(len(faces)), 2):
        (k, _k), wall, mate = faces[i].rooms, faces[i].wall, faces[j].wall
        if group[i] != group[j] or faces[j].rooms[0] != k:
            continue
        line = RoomEdge(wall, mate, (k, k))
        places = _places_on(line, _places_in((bounds[k],), extent, slack), slack)
        starts = _starts_along(line, places, extent)
        ends: list[Vec] = []
        for m, room in enumerate(rooms):
            found = () if m == k else _ends_at(line, room, starts, slack)
            for _walls, x in found:
                if is_seen(rooms, (k, m), x, slack) and all(norm(x - y) > slack for y in ends):
                    ends.append(Vec(*map(float, x)))
        if ends or any(is_seen(rooms, line.rooms, x, slack) for x in places):
            sides = (
                RoomSide(face, tuple(e for e in edges if face.wall is e.one or face.wall is e.other))
                for face in (faces[i], faces[j])
            )
            yield i, RoomCorner(line, *sides, tuple(ends))


def _is_on(walls: tuple[Any, ...], x: Vec, slack: float) -> bool:
    """Whether a place is on all of the walls."""
    return bool(max(abs(wall.distance(x)) for wall in walls) <= slack)


def _tips_of(
    edge: RoomEdge, starts: list[Vec], rooms: tuple[Any, ...], bounds: list[Any], slack: float
) -> list[tuple[Vec, float]]:
    """Return the tips of an edge, where it is seen and enters a third room: (place, uncertainty of the place [m]) each.

    Args:
        edge: an edge.
        starts: the places from which tips are searched.
        rooms: the walls of each room.
        bounds: a box around each room.
        slack: round-off of a place [m].
    """
    found: list[tuple[Vec, float]] = []
    for k, room in enumerate(rooms):
        boxes = [bounds[i] for i in (*edge.rooms, k)]
        low, high = np.max([box[0] for box in boxes], axis=0), np.min([box[1] for box in boxes], axis=0)
        if k in edge.rooms or (low > high + slack).any():
            continue
        for walls, x in _ends_at(edge, room, starts, slack):
            if is_seen(rooms, (*edge.rooms, k), x, slack):
                known = slack / max(_volume(walls, x), _TOUCHES)
                if all(norm(x - y) > known for y, _known in found):
                    found.append((Vec(*map(float, x)), known))
    return found


def _turns(edge: RoomEdge, starts: list[Vec], rooms: tuple[Any, ...], slack: float) -> bool:
    """Whether an edge is seen where it ends at another wall of its own rooms.

    The seen part of an edge is a closed curve, or it ends at a tip or at such a wall: it may be shorter than the way
    between any two places from which it is searched.
    """
    ends = (x for k in edge.rooms for _walls, x in _ends_at(edge, rooms[k], starts, slack))
    return any(_is_seen_at(edge, rooms, x, slack) for x in ends)


def _is_seen_at(edge: RoomEdge, rooms: tuple[Any, ...], x: Vec, slack: float) -> bool:
    """Whether an edge is seen at a place, or at its end, and beside it within all other walls of its own rooms.

    Corners that two rooms have in common are no edge: balls turn about edges at which only two walls end.
    """
    if not is_seen(rooms, edge.rooms, x, slack):
        return False
    others = [wall for k in edge.rooms for wall in rooms[k] if wall is not edge.one and wall is not edge.other]
    along, step = _along(edge, x), _BESIDE * slack
    beside = (crossing(edge.one, edge.other, x + way * along, math.inf) for way in (step, -step))
    return any(
        is_seen(rooms, edge.rooms, y, slack) and all(wall.distance(y) < -slack for wall in others) for y in beside
    )


def _ends_at(edge: RoomEdge, room: Any, starts: list[Vec], slack: float) -> Iterator[tuple[tuple[Any, ...], Vec]]:
    """Yield where an edge meets other walls of a room: (the three walls, the place), each once."""
    for wall in room:
        walls, known = (edge.one, edge.other, wall), list[Vec]()
        if wall is not edge.one and wall is not edge.other:
            for start in starts:
                x = _meeting(walls, start)
                if _is_on(walls, x, slack) and all(norm(x - y) > slack for y in known):
                    known.append(x)
                    yield walls, x


def _bend_on(edge: RoomEdge, on_it: list[Vec]) -> float:
    """Return a lower bound of the radius of curvature of an edge [m], by descent along the edge."""
    bends = [edge.bend_at(x) for x in on_it]
    order = np.argsort(bends)
    least = bends[order[0]]
    if not least < (1.0 - _ALIKE) * bends[order[-1]]:
        return float(_ROUND * least)
    for i in order[:_SHARPEST]:
        x, bend, way = on_it[i], bends[i], 0.5 * bends[i]
        shortest = _SHORTEST * way
        while abs(way) > shortest:
            to = crossing(edge.one, edge.other, x + way * _along(edge, x), math.inf)
            after = edge.bend_at(to)
            if after < bend:
                x, bend = to, after
            else:
                way = -0.5 * way if way > 0.0 else -way
        least = min(least, bend)
    return float(_ROUND * least)


def _volume(walls: tuple[Any, ...], x: Vec) -> float:
    """Return the volume that unit normals of three walls span at a place: 0 if an edge only touches the third wall."""
    one, other, third = (outward(wall, x) for wall in walls)
    return abs(float(dot(one, cross(other, third))))


def _along(edge: RoomEdge, x: Vec) -> Vec:
    """Return the unit vector along an edge."""
    along = cross(outward(edge.one, x), outward(edge.other, x))
    return Vec(*(float(part) / norm(along) for part in along))


def _meeting(walls: tuple[Any, ...], x: Vec) -> Vec:
    """Return the place where three walls meet, by Newton's method; if it does not converge, a place off the walls."""
    for _sweep in range(_SWEEPS):
        normals = [outward(wall, x) for wall in walls]
        step = ZERO
        for i, wall in enumerate(walls):
            step = step - wall.distance(x) * cross(normals[i - 2], normals[i - 1])
        volume = dot(normals[0], cross(normals[1], normals[2]))
        if abs(volume) < _PARALLEL:
            break
        step = step * (1.0 / volume)
        x = x + step
        if norm(step) <= _STILL * norm(x):
            break
    return x
