"""Faces that two rooms of a union have in common, seen from both sides: the rooms are one there.

Kernels let a flight continue where rooms overlap. So the face of a room that lies within that of the other one is moved
into the other room by a small distance, the *reach*: the volume of the union does not change. Where neither face lies
within the other one, a room is added, the common part of both with their faces moved: it is within the two.
"""

import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ...errors import SceneError
from ...kernel.limits import TINY
from ...state import Floats
from ..fields.many import Many, sign_of
from ..instant import distances, side_of
from ..room import Room, room_bounds
from ..rotation import matrix, normalized
from ..shapes.box import Box
from ..shapes.capsule import Capsule
from ..shapes.cylinder import Cylinder
from ..shapes.ellipsoid import Ellipsoid
from ..shapes.plane import Plane
from ..shapes.slab import Slab
from ..shapes.sphere import Sphere
from ..shapes.torus import Torus
from ..surface import Surface, volume_of
from .doors import Opening

# Faces up to this multiple of the round-off of the size apart are one.
_ROUNDINGS = 4.0 * np.finfo(np.float64).eps
# A room is at a face if it is at this distance beside it, a part of the size, deeper than by this part of the distance.
_BESIDE, _WITHIN = 1e-7, 0.5
# The reach for the test whether a face lies within another one, and how far outside that face it may then be.
FAR, OUTSIDE = 1e-6, 1e-9
# An unbounded room is searched up to this multiple of the size.
_REACH = 2.0
# Places that are tried, moves of each, and how far each move aims.
PLACES, _MOVES, _PAST = 512, 24, 1.05
# Places that a room gains: the number of trials, and the least number that shows where it gains them.
_MANY, ENOUGH = 4096, 8
# Two round faces are one where the cosine of their normals is -1 up to this.
_OPPOSITE = 1e-9


class Face(NamedTuple):
    """A smooth part of the wall of a surface.

    Attributes:
        level: the surface of which it is a part, without edges.
        plane: its unit normal out of the admissible side, and its offset along that [m]; None: it is not flat.
        longer: function that returns the surface with this face moved out by a distance [m]; None: none is known.
    """

    level: Surface
    plane: tuple[Floats, float] | None
    longer: Callable[[float], Surface] | None

    def distance(self, points: Floats) -> Floats:
        """Return how far points (3, N) are out of its admissible side [m], to first order."""
        if self.plane is not None:
            return np.asarray(self.plane[0] @ points - self.plane[1])
        return _distance(self.level, points)

    def normals(self, points: Floats) -> Floats:
        """Return unit normals out of the admissible side (3, N)."""
        if self.plane is not None:
            return np.repeat(self.plane[0][:, None], points.shape[1], axis=1)
        return normalized(side_of(self.level) * self.level.gradient(points))

    def onto(self, points: Floats) -> Floats:
        """Return points moved onto the face."""
        for _move in range(1 if self.plane is not None else 4):
            points = points - self.distance(points) * self.normals(points)
        return points


class Seam(NamedTuple):
    """A face that two rooms have in common: for each the room, the surface in it, and the face of this surface.

    `grown` is 0 or 1, the room with the moved face; None: a room is added. Faces that do not move as
    one are not `together`, and have a wall between them.
    """

    rooms: tuple[int, int]
    surfaces: tuple[int, int]
    faces: tuple[int, int]
    grown: int | None
    together: bool


# --- Faces of a surface ----------------------------------------------------------------------------------


def faces_of(surface: Surface) -> list[Face]:
    """Return the faces of a surface, in an order that does not depend on its size."""
    if isinstance(surface, Plane):
        ((normal, offset),) = surface.half_spaces()
        return [Face(surface, (np.array(normal), offset), lambda by: replace(surface, offset=surface.offset + by))]
    if isinstance(surface, Slab):
        normal = matrix(surface.rotation) @ np.array(surface.normal)
        return _pair(surface, surface.center, normal, surface.half_width, lambda half: {"half_width": half})
    if isinstance(surface, Box):
        return [face for k in range(3) for face in _faces_of_box(surface, k)]
    if isinstance(surface, Cylinder):
        found = [_round(surface, replace(surface, length=None), "radius")]
        if (length := surface.length) is not None:
            axis = np.array(surface.direction())
            found += _pair(surface, surface.center, axis, 0.5 * length, lambda half: {"length": 2.0 * half})
        return found
    if isinstance(surface, (Sphere, Capsule)):
        return [_round(surface, surface, "radius")]
    if isinstance(surface, Torus):
        return [_round(surface, surface, "minor_radius")]
    if isinstance(surface, Ellipsoid):
        return [Face(surface, None, _larger(surface))]
    return [] if isinstance(surface, Many) else [Face(surface, None, None)]


def _larger(surface: Ellipsoid) -> Callable[[float], Surface]:
    def made(by: float) -> Surface:
        x, y, z = (a * (1.0 + side_of(surface) * by / min(surface.semi_axes)) for a in surface.semi_axes)
        return replace(surface, semi_axes=(x, y, z))

    return made


def _round(surface: Surface, level: Surface, name: str) -> Face:
    radius, side = getattr(surface, name), side_of(surface)
    return Face(level, None, lambda by: replace(surface, **{name: radius + side * by}))


def _faces_of_box(surface: Box, k: int) -> list[Face]:
    axis, half = matrix(surface.rotation)[:, k], surface.half_widths

    def given(value: float) -> dict[str, Any]:
        return {"half_widths": tuple(value if j == k else half[j] for j in range(3))}

    found = _pair(surface, surface.center, axis, half[k], given)
    return [face for face, sign in zip(found, "+-", strict=True) if sign + "xyz"[k] not in surface.open]


def _pair(
    surface: Surface, center: Any, axis: Floats, half: float, given: Callable[[float], dict[str, Any]]
) -> list[Face]:
    """Return two faces across an axis, at the distance `half` on both sides of a centre."""
    side, middle = side_of(surface), float(axis @ np.array(center))

    def longer(sign: float) -> Callable[[float], Surface]:
        def made(by: float) -> Surface:
            moved = np.array(center) + sign * side * 0.5 * by * axis
            return replace(surface, center=tuple(moved.tolist()), **given(half + side * 0.5 * by))  # type: ignore[call-arg]

        return made

    return [
        Face(surface, (side * sign * axis, side * (half + sign * middle)), longer(sign)) for sign in (1.0, -1.0)
    ]  # fmt: skip


# --- Faces that rooms have in common ---------------------------------------------------------------------


def seams_of(rooms: Sequence[Room]) -> list[Seam]:
    """Return the faces that rooms have in common, except those of walls with `present`, and those that have a door.

    Raises:
        SceneError: two rooms have a face in common that is of a kind that cannot be moved.
    """
    found = []
    size = max((surface.extent() for room in rooms for surface in room), default=0.0) or 1.0
    boxes = [room_bounds(_still(room)) for room in rooms]
    for i, k in itertools.combinations(range(len(rooms)), 2):
        low, high = np.maximum(boxes[i][0], boxes[k][0]), np.minimum(boxes[i][1], boxes[k][1])
        if (low <= high + 64.0 * _ROUNDINGS * size).all():
            found += _between(rooms, (i, k), (low, high), size)
    return found


def _still(room: Iterable[Surface]) -> tuple[Surface, ...]:
    """Return a room as it is given, before it moves."""
    return tuple(one.at_rest() for one in room)


def _between(rooms: Sequence[Room], pair: tuple[int, int], box: tuple[Floats, Floats], size: float) -> list[Seam]:
    room, other = (rooms[k] for k in pair)
    still = _Rooms(
        _still(room), _still(other), np.maximum(box[0], -_REACH * size), np.minimum(box[1], _REACH * size), size
    )
    found = []
    for (i, mine), (k, yours) in itertools.product(enumerate(still.room), enumerate(still.other)):
        for (a, face), (b, mate) in itertools.product(enumerate(faces_of(mine)), enumerate(faces_of(yours))):
            if not _may_be_one(face, mate, size) or not still.touch(face, mate):
                continue
            if room[i].present is not None or other[k].present is not None or still.has_door(face, (room[i], other[k])):
                continue
            together = room[i].motion == other[k].motion
            both = ((i, face), (k, mate))
            can = [one.longer is not None for _k, one in both]
            grown = next((g for g in (1, 0) if can[g] and still.is_within(g, *both[g])), None)
            if together and grown is None and not all(can):
                raise SceneError(
                    "parts must overlap, or have a flat or a round face in common, got "
                    f"{room[i]!r:.100} and {other[k]!r:.100}; their common face is of a kind that cannot be opened; "
                    "let the parts overlap, or give a swarm.Opening between them, which keeps them apart"
                )
            found.append(Seam(pair, (i, k), (a, b), grown, together))
    return found


def _may_be_one(face: Face, mate: Face, size: float) -> bool:
    """Whether two faces may be one, seen from both sides, by their immediate data."""
    if face.plane is not None and mate.plane is not None:
        (n, offset), (m, its) = face.plane, mate.plane
        return bool(np.abs(n + m).max() <= _ROUNDINGS and _is_at(-(offset + its), size))
    known = [one for one in (face, mate) if one.longer is not None]
    if len(known) == 2:
        same = type(face.level) is type(mate.level) and face.plane is None and mate.plane is None
        return same and side_of(face.level) != side_of(mate.level)
    return True


def _is_at(apart: Any, size: float) -> Any:
    """Whether the distance between faces is round-off, or an overlap too small for a flight to go on."""
    return (apart <= _ROUNDINGS * size) & (apart >= -OUTSIDE * size)


class _Rooms(NamedTuple):
    """Two rooms at rest, the box in which they may touch, and the size of their union."""

    room: Room
    other: Room
    low: Floats
    high: Floats
    size: float

    def touch(self, face: Face, mate: Face) -> bool:
        """Whether both rooms are at a place on a face, on either side."""
        places = self._places(face, ())
        there = _is_at(mate.distance(places), self.size)
        there &= (face.normals(places) * mate.normals(places)).sum(axis=0) <= -1.0 + _OPPOSITE
        return bool(there.any())

    def has_door(self, face: Face, pieces: Sequence[Surface]) -> bool:
        """Whether an opening of one of the surfaces with the face is at a place on it where both rooms are."""
        doors: list[Surface | Opening] = []
        for one in (opening for piece in pieces for opening in piece.openings):
            if not any(one is known for known in doors):
                doors.append(one)
        return any(self._places(face, (volume_of(door).at_rest(),)).shape[1] for door in doors)

    def _places(self, face: Face, within: Sequence[Surface]) -> Floats:
        """Return places (3, N) on a face of the first room, inside it, at the other one, and in volumes `within`."""
        margin, shift = _WITHIN * _BESIDE * self.size, _BESIDE * self.size
        asked = [(one, -1.0, margin) for one in self.room] + [(one, 1.0, margin) for one in self.other]
        asked += [(one, 0.0, 0.0) for one in within]
        low, high = self.low[:, None], np.maximum(self.low, self.high)[:, None]
        if within and not isinstance(within[0], Many):
            # A door may be small.
            box = np.array(within[0].bounds())
            low, high = np.maximum(low, box[0][:, None]), np.minimum(high, box[1][:, None])
            low, high = np.minimum(low, high), np.maximum(low, high)
        points = low + (high - low) * np.random.default_rng(0).random((3, PLACES))
        for move in range(_MOVES + 1):
            points = face.onto(points)
            normals = face.normals(points)
            with np.errstate(all="ignore"):
                gaps = [_gap(one, points + sign * shift * normals) + more for one, sign, more in asked]
            worst, out = np.argmax(gaps, axis=0), np.max(gaps, axis=0)
            if move == _MOVES or (out <= 0.0).sum() > PLACES // 4:
                break
            for k in np.unique(worst[out > 0.0]).tolist():
                some = (worst == k) & (out > 0.0)
                one, sign, _more = asked[k]
                at = points[:, some] + sign * shift * normals[:, some]
                way = sign_of(one) * one.gradient(at)
                # Along the face
                way = way - (way * normals[:, some]).sum(axis=0) * normals[:, some]
                length = np.maximum(np.sqrt((way**2).sum(axis=0)), TINY)
                points[:, some] -= _PAST * out[some] / length * way
        return points[:, (out <= 0.0) & np.isfinite(points).all(axis=0)]

    def is_within(self, grown: int, k: int, face: Face) -> bool:
        """Whether the volume that one of the rooms gains if a face of surface k is moved is within the other one."""
        assert face.longer is not None
        room, other = (self.other, self.room) if grown else (self.room, self.other)
        larger = (*room[:k], face.longer(FAR * self.size), *room[k + 1 :])
        low, high = (np.clip(corner, -_REACH * self.size, _REACH * self.size) for corner in room_bounds(room))
        random = np.random.default_rng(1)
        points = face.onto(low[:, None] + (high - low)[:, None] * random.random((3, _MANY)))
        points = points + FAR * self.size * random.random(_MANY) * face.normals(points)
        points = points[:, _gaps(larger, points) <= 0.0]
        return points.shape[1] >= ENOUGH and bool((_gaps(other, points) <= OUTSIDE * self.size).all())


def _gaps(room: Room, points: Floats) -> Floats:
    """Return the largest `_gap` of a room."""
    return np.asarray(np.max([_gap(one, points) for one in room], axis=0))


def _gap(surface: Surface, points: Floats) -> Floats:
    """Return `_distance`, with infinity in place of NaN."""
    found = _distance(surface, points)
    return np.asarray(np.where(np.isnan(found), np.inf, found))


def _distance(surface: Surface, points: Floats) -> Floats:
    """How far points (3, N) are out of the admissible side of a surface, or out of a volume [m], to first order."""
    return sign_of(surface) * distances(surface, points)


# --- Rooms that are joined -------------------------------------------------------------------------------


def joined(rooms: Sequence[dict[Surface, Any]], seams: Sequence[Seam], reach: float) -> list[dict[Surface, Any]]:
    """Return rooms, each a dict of its surfaces, that overlap by a reach [m] at their common faces."""
    made = [list(room.items()) for room in rooms]
    added = []
    for seam in seams:
        if seam.grown is not None:
            room, k = made[seam.rooms[seam.grown]], seam.surfaces[seam.grown]
            room[k] = _longer(room[k][0], seam.faces[seam.grown], reach), room[k][1]
            continue
        both = []
        for room, k, face in zip((list(rooms[k].items()) for k in seam.rooms), seam.surfaces, seam.faces, strict=True):
            room[k] = _longer(room[k][0], face, reach), room[k][1]
            both += room
        added.append(both)
    return [dict(room) for room in (*made, *added)]


def _longer(surface: Surface, face: int, reach: float) -> Surface:
    longer = faces_of(surface)[face].longer
    assert longer is not None
    return longer(reach)
