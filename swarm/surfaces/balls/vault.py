"""A union of several rooms, or a foam, as balls meet it: a surface of walls, each of faces that join at edges."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...kernel.vector import Vec
from ..room import room_bounds
from ..shapes.box import Box
from ..shapes.cone import Cone
from ..shapes.cylinder import Cylinder
from ..shapes.plane import Plane
from ..shapes.slab import Slab
from ..shapes.sphere import Sphere
from ..surface import Box as Bounds
from ..surface import Surface
from .tip import TipPlane
from .vaulted import FLAT, RoomEdge, RoomFace, Vaulted, crossing, is_seen

# Of the extent: what is round-off of a place, and what is farther than anything.
_SLACK, _FAR = 1e-11, 1e6
# Places from which edges are looked for, and most rooms; of the smallest radius of curvature at these places, what is
# taken for certain.
_PLACES, _MOST, _ROUND = 24, 64, 0.5
# What all parts of a union that balls meet have in common: laws, and how the whole moves, comes and goes, and opens.
_LAWS = "restitution", "friction", "temperature", "accommodation", "laws"
_CHANGES = "motion", "openings", "present", "mass", "inertia"
_KINDS = Sphere, Plane, Slab, Box, Cylinder, Cone


@dataclass(frozen=True, repr=False)
class Vault(Surface):
    """A union of several rooms, taken as one surface."""

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
        boxes = [room_bounds(room) for room in self.rooms_of]
        low, high = np.min([low for low, _high in boxes], axis=0), np.max([high for _low, high in boxes], axis=0)
        return tuple(low.tolist()), tuple(high.tolist())

    def phi(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        return np.asarray(np.min([np.max(gaps, axis=0) for gaps in self._gaps(points, time)], axis=0))

    def gradient(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        rows, gaps = np.array(self._own_rows(points, time)), self._gaps(points, time)
        least, found = np.argmin([np.max(some, axis=0) for some in gaps], axis=0), np.zeros(np.shape(points))
        for k, (room, some) in enumerate(zip(self.rooms_of, gaps, strict=True)):
            for m, one in enumerate(room):
                found = np.where((least == k) & (np.argmax(some, axis=0) == m), one.gradient(rows), found)
        return found

    def _gaps(self, points: ArrayLike, time: float) -> list[list[NDArray[np.float64]]]:
        """phi of each surface of each room."""
        rows = np.array(self._own_rows(points, time))
        return [[one.phi(rows) for one in room] for room in self.rooms_of]

    def reaching_outside(
        self, points: NDArray[np.float64], radius: NDArray[np.float64], time: float = 0.0
    ) -> NDArray[np.float64]:
        points = np.array(self._own_rows(points, time))
        gaps = [[one.reaching_outside(points, 0.0 * radius) for one in room] for room in self.rooms_of]
        outside = np.min([np.max(some, axis=0) for some in gaps], axis=0)
        found = np.array(outside)
        for i in np.flatnonzero(outside <= 0.0):
            at, size = Vec(*points[:, i].tolist()), float(radius[i])
            found[i] = max(wall.grown(size).phi(at) for wall in self.walls())
        return np.where(outside > 0.0, outside + radius, found)


def vault_of(union: Any) -> Vault:
    """A union of several rooms, or a foam, as balls meet it."""
    rooms = union.rooms_of_balls()
    one, still = rooms[0][0], [[replace(one.at_rest(), openings=(), present=None) for one in room] for room in rooms]
    return Vault(rooms_of=tuple(map(tuple, still)), **{name: getattr(one, name) for name in (*_LAWS, *_CHANGES)})


def no_balls_in(union: Any) -> str | None:
    """None where balls may meet a union of several rooms, or a foam, else half a sentence that says why not."""
    rooms = union.rooms_of_balls()
    surfaces = [surface for room in rooms for surface in room]
    begin = f"of {len(rooms)} rooms, of which "
    if len(rooms) > _MOST:
        return f"of {len(rooms)} rooms, and balls meet at most {_MOST}, for each is compiled into the kernels"
    for surface in surfaces:
        name = type(surface).__name__
        if surface.is_solid() or not isinstance(surface, _KINDS):
            known = ", ".join(kind.__name__ for kind in _KINDS)
            return f"{begin}one is made of a {name}, and edges of rooms are known to balls of the insides of {known}"
    for what in (*_LAWS, *_CHANGES):
        if len({repr(getattr(surface, what)) for surface in surfaces}) > 1:
            return f"{begin}the parts differ in {what}, while an edge belongs to both: give the {what} to the whole"
    if len(rooms) > 2 and _any_corner(vault_of(union)):
        return f"{begin}three meet at a point, where balls would turn about a tip; they turn about edges of two"
    return None


# --- Its walls -------------------------------------------------------------------------------------------

_KNOWN: dict[Any, tuple[Any, ...]] = {}


def _walls_of(vault: Vault) -> tuple[Any, ...]:
    key = repr(vault.rooms_of)
    if key not in _KNOWN:
        _KNOWN.clear()
        _KNOWN[key] = tuple(_made(vault))
    return _KNOWN[key]


def _made(vault: Vault) -> list[Vaulted]:
    rooms, extent = _rooms_of(vault), vault.extent()
    slack, places = _SLACK * extent, _places_in(vault)
    faces = [
        RoomFace(wall, rooms[k], _without(rooms, k), *_bend_of(one, wall))
        for k, room in enumerate(vault.rooms_of) for one, wall in _each(room)
    ]  # fmt: skip
    first = np.cumsum([0, *map(len, rooms)]).tolist()
    group, edges = list(range(len(faces))), []
    for edge, (k, a), (m, b) in _edges_of(rooms):
        on_it = [place for place in _crossings(edge, places) if _is_on(edge, place, slack)]
        if any(is_seen(edge, place, slack) for place in on_it):
            edge = edge._replace(bend=_ROUND * min(map(edge.bend_at, on_it)))
            one, other = group[first[k] + a], group[first[m] + b]
            group = [one if g == other else g for g in group]
            edges.append((first[k] + a, edge))
    return [
        Vaulted(
            tuple(face for face, g in zip(faces, group, strict=True) if g == mine),
            tuple(edge for i, edge in edges if group[i] == mine), 0.0, slack, _FAR * extent,
        )
        for mine in dict.fromkeys(group)
    ]  # fmt: skip


def _rooms_of(vault: Vault) -> list[tuple[Any, ...]]:
    """The walls of every room."""
    return [tuple(wall for _surface, wall in _each(room)) for room in vault.rooms_of]


def _each(room: Any) -> Iterator[tuple[Surface, Any]]:
    """The surfaces of a room, each with one of its walls."""
    for one in room:
        for wall in one.walls_of_balls(0.0):
            yield one, wall.grown(0.0)


def _bend_of(surface: Surface, wall: Any) -> tuple[float | None, float]:
    """The radius of curvature of a wall [m], None of a cone, and by how much it changes along the wall."""
    if isinstance(surface, (Sphere, Cylinder)) and not isinstance(wall, FLAT):
        return surface.radius, 0.0
    if isinstance(surface, Cone) and not isinstance(wall, TipPlane):
        return None, math.tan(surface.half_angle)
    return math.inf, 0.0


def _places_in(vault: Vault) -> list[Vec]:
    low, high = (np.clip(end, -vault.extent(), vault.extent()) for end in vault.bounds())
    return [Vec(*place) for place in np.random.default_rng(0).uniform(low, high, (_PLACES, 3)).tolist()]


def _edges_of(rooms: list[Any]) -> Iterator[tuple[RoomEdge, tuple[int, int], tuple[int, int]]]:
    """What may be an edge between two rooms, and the numbers of both walls."""
    for k, m in itertools.combinations(range(len(rooms)), 2):
        for a, b in itertools.product(range(len(rooms[k])), range(len(rooms[m]))):
            yield RoomEdge(rooms[k][a], rooms[m][b], rooms[k] + rooms[m], _without(rooms, k, m)), (k, a), (m, b)


def _without(rooms: list[Any], *some: int) -> tuple[Any, ...]:
    return tuple(room for k, room in enumerate(rooms) if k not in some)


def _crossings(edge: RoomEdge, places: list[Vec]) -> Iterator[Vec]:
    with np.errstate(all="ignore"):
        for place in places:
            yield crossing(edge.one, edge.other, place, math.inf)


def _is_on(edge: RoomEdge, x: Vec, slack: float) -> bool:
    """Whether a place is on both walls."""
    return bool(max(abs(edge.one.distance(x)), abs(edge.other.distance(x))) <= slack)


def _any_corner(vault: Vault) -> bool:
    """Whether an edge of two rooms goes into a third one."""
    slack, places = _SLACK * vault.extent(), _places_in(vault)
    for edge, _one, _other in _edges_of(_rooms_of(vault)):
        alone = edge._replace(others=())
        on_it = [x for x in _crossings(edge, places) if _is_on(edge, x, slack) and is_seen(alone, x, slack)]
        if len({bool(is_seen(edge, x, slack)) for x in on_it}) > 1:
            return True
    return False
