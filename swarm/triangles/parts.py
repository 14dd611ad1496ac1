"""The parts of the surfaces of a scene, each a wall where no other part takes it away: of unions and the like."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..scene import Scene
from ..state import Floats
from ..surfaces.fields.many import sign_of
from ..surfaces.instant import box_of, distances, side_of
from ..surfaces.part import handed_down
from ..surfaces.surface import Surface
from ..surfaces.union import Place

# Parts of the size of the drawing: a distance that counts as 0, and the distance from a wall at which a level is
# evaluated to choose between two walls at one place.
_NOTHING, _BESIDE = 1e-8, 2e-8
# No distance is more than this many times the size of the drawing.
_FAR = 1e3


@dataclass(frozen=True)
class Cover:
    """A surface that tells where a wall is: in its admissible side (`sign` +1), or outside of its admissible side (-1).

    Attributes:
        time: the time [s].
        is_room: whether it is a part beside the part of the wall in a union.
        first: whether it keeps a wall that lies in both, so that two walls in one place are drawn once.
        opens: whether it shares a face with the part of the wall, which is no wall.
        turn: +1 or -1, whether a way out of the wall is a way out of the volume that the surface is to cover.
        side: +1 or -1, the sign of phi that is its gap.
    """

    surface: Surface
    sign: float
    side: float
    time: float
    first: bool = False
    is_room: bool = False
    opens: bool = False
    turn: float = 1.0

    def level(self, points: Floats, outwards: Floats, size: float) -> Floats:
        """Return the level at points (N, 3) of a wall with unit normals (N, 3).

        It is above 0 where this surface takes the wall away, and a distance to first order.
        """
        if not self.surface.is_there(self.time):
            # All points are on its admissible side
            return np.full(len(points), -self.sign * size)
        way = self.turn * _BESIDE * size * outwards
        # One of several walls at one place is drawn. A wall between two rooms without a common volume is not drawn.
        if self.sign < 0.0:
            here = self._level(points - way if self.first else points, size)
            return np.maximum(here, self._level(points + way, size)) if self.opens else here
        before = self._level(points - way, size)
        return np.maximum(before, self._level(points + way, size)) if self.first else before

    def level_behind(self, points: Floats, outwards: Floats, size: float) -> Floats:
        """Return the level slightly behind a wall."""
        return self._level(points + self.turn * _BESIDE * size * outwards, size)

    def _level(self, points: Floats, size: float) -> Floats:
        rows = np.ascontiguousarray(points.T)
        with np.errstate(all="ignore"):
            gap = self.side * distances(self.surface, rows, self.time)
        gap = np.clip(np.where(np.isnan(gap), np.inf, gap), -_FAR * size, _FAR * size)
        return np.asarray(self.sign * gap - _NOTHING * size)

    def may_cover(self, low: Floats, high: Floats) -> bool:
        """Whether it may take away a part of a wall in a box."""
        if self.sign > 0.0 or self.side < 0.0 or not self.surface.is_there(self.time):
            return True
        first, last = (np.array(corner) for corner in box_of(self.surface, self.time))
        return bool(((first <= high) & (low <= last)).all())


@dataclass(frozen=True)
class Part:
    """A surface of the scene, or a part of one.

    Attributes:
        owner: the number of the surface in the scene.
        place: the number of the part in that surface, then of the part of the part; empty for the whole surface.
        surface: the part, with the arguments that the whole surface was given.
        solid: whether particles are kept out of it.
        covers: the surfaces that restrict the part of it that is a wall.
        doorways: volumes that take the wall away where another part is behind it.
    """

    owner: int
    place: Place
    surface: Surface
    solid: bool
    covers: tuple[Cover, ...]
    doorways: tuple[Cover, ...] = ()

    def level(self, points: Floats, outwards: Floats, size: float, near: list[Cover]) -> Floats:
        """Return the level with respect to all covers. Covers that are not `near` take nothing away."""
        found = np.full(len(points), -size)
        for cover in near:
            found = np.maximum(found, cover.level(points, outwards, size))
        if self.doorways:
            opened = np.max([one.level(points, outwards, size) for one in self.doorways], axis=0)
            behind = [one.level_behind(points, outwards, size) for one in self.covers if one.is_room]
            found = np.maximum(found, np.where(np.max(behind, axis=0, initial=-size) > 0.0, opened, -size))
        return found


def parts_of(scene: Scene, time: float) -> list[Part]:
    """Return the parts of all surfaces at a time [s], in their order."""
    found = _Found(time, scene.doorways_of_parts(), scene.common_faces(), [])
    for i, surface in enumerate(scene.surfaces):
        found.add(Part(i, (), surface, False, found.beside(scene.surfaces, i, 1.0)))
    return found.parts


class _Found(NamedTuple):
    """The parts that are found, the volumes of doorways of each part, and the pairs of parts that share a face."""

    time: float
    doorways: dict[tuple[int, Place], list[Surface]]
    common: list[tuple[int, Place, Place]]
    parts: list[Part]

    def _have_a_face(self, owner: int, one: Place, other: Place) -> bool:
        """Whether two parts of a surface share a face that is no wall."""
        return any(
            i == owner and {pair[0][: len(one)], pair[1][: len(other)]} == {one, other} for i, *pair in self.common
        )

    def beside(self, surfaces: Sequence[Surface], k: int, sign: float, opened: Sequence[int] = ()) -> tuple[Cover, ...]:
        """Return the covers of one of several surfaces by all others, some of which share a face with it."""
        return tuple(
            Cover(one, sign, side_of(one), self.time, first=j < k and not one.is_field, is_room=sign < 0.0,
                  opens=sign < 0.0 and j in opened)
            for j, one in enumerate(surfaces) if j != k and (sign < 0.0 or one.is_there(self.time))
        )  # fmt: skip

    def open(self, volumes: Iterable[Surface]) -> tuple[Cover, ...]:
        """Return the covers by volumes in which a wall is open."""
        return tuple(Cover(one, -1.0, sign_of(one), self.time) for one in volumes if one.is_there(self.time))

    def add(self, part: Part) -> None:
        """Add a part, or the parts that it consists of."""
        whole: Any = part.surface
        solid = part.solid ^ whole.is_solid()
        if not whole.parts:
            doorways = self.open(self.doorways.get((part.owner, part.place), ()))
            covers = (*part.covers, *self.open(whole.open_volumes()))
            self.parts.append(replace(part, solid=solid, covers=covers, doorways=doorways))
            return
        parts = [handed_down(whole, one) for one in whole.parts]
        turned = tuple(replace(one, turn=one.turn * side_of(whole)) for one in part.covers)
        for k, one in enumerate(parts):
            place = (*part.place, k)
            opened = [j for j in range(len(parts)) if self._have_a_face(part.owner, place, (*part.place, j))]
            covers = (*turned, *self.beside(parts, k, whole.wall_in_others, opened))
            self.add(Part(part.owner, place, one, solid, covers))
