"""The parts of the surfaces of a scene, each a wall where no other one takes that away: of unions and the like."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..particles import Floats
from ..surfaces.fields.many import Many
from ..surfaces.instant import box_of, side_of
from ..surfaces.openings import sign_of
from ..surfaces.surface import Surface
from ..surfaces.union import Joined, Union, handed_down

# Of the size of what is drawn, what is no distance, and how far beside a wall it is asked which of two is there.
_NOTHING, _BESIDE = 1e-8, 2e-8
# No distance is more than this many times that size.
_FAR = 1e3


@dataclass(frozen=True)
class Cover:
    """A surface that says where a wall is: in its admissible side (`sign` +1), or outside of that (-1).

    Attributes:
        time: [s].
        first: whether it has what lies in both, so that two walls in one place are drawn once.
        turn: +1 or -1, whether a way out of the wall is one of what the surface is to cover.
        side: +1 or -1, the sign of phi that is its gap.
    """

    surface: Surface
    sign: float
    side: float
    time: float
    first: bool = False
    turn: float = 1.0

    def level(self, points: Floats, outwards: Floats, size: float) -> Floats:
        """At points (N, 3) of a wall with unit normals (N, 3): above 0 where it is none; a distance to first order."""
        if not self.surface.is_there(self.time):
            # Its admissible side is all over.
            return np.full(len(points), -self.sign * size)
        way = self.turn * _BESIDE * size * outwards
        # Of walls in one place one is drawn; none that two rooms without a volume in common would be between.
        if self.sign < 0.0:
            return self._level(points - way if self.first else points, size)
        before = self._level(points - way, size)
        return np.maximum(before, self._level(points + way, size)) if self.first else before

    def _level(self, points: Floats, size: float) -> Floats:
        rows = np.ascontiguousarray(points.T)
        with np.errstate(all="ignore"):
            steep = np.sqrt((self.surface.gradient(rows, self.time) ** 2).sum(axis=0))
            gap = self.side * self.surface.phi(rows, self.time) / np.maximum(steep, np.finfo(np.float64).tiny)
        gap = np.clip(np.where(np.isnan(gap), np.inf, gap), -_FAR * size, _FAR * size)
        return np.asarray(self.sign * gap - _NOTHING * size)

    def may_cover(self, low: Floats, high: Floats) -> bool:
        """Whether it may take away something of a wall in a box."""
        if self.sign > 0.0 or self.side < 0.0 or not self.surface.is_there(self.time):
            return True
        first, last = (np.array(corner) for corner in box_of(self.surface, self.time))
        return bool(((first <= high) & (low <= last)).all())


@dataclass(frozen=True)
class Part:
    """A surface that is a part of one of the scene, or one of these itself.

    Attributes:
        owner: the number of the surface in the scene.
        place: its place in that: the number of the part, and of the part of this; none where it is the whole.
        surface: with what is given to the whole.
        solid: whether particles are kept out of it.
        covers: what leaves of it a wall.
    """

    owner: int
    place: tuple[int, ...]
    surface: Surface
    solid: bool
    covers: tuple[Cover, ...]


def parts_of(surfaces: Sequence[Surface], time: float) -> list[Part]:
    """The parts of all surfaces at a time [s], in their order."""
    found = _Found(time, [])
    for i, surface in enumerate(surfaces):
        found.add(Part(i, (), surface, False, found.beside(surfaces, i, 1.0)))
    return found.parts


class _Found(NamedTuple):
    """The parts that are found."""

    time: float
    parts: list[Part]

    def beside(self, surfaces: Sequence[Surface], k: int, sign: float) -> tuple[Cover, ...]:
        """The covers of one of several surfaces, by the others."""
        return tuple(
            Cover(one, sign, side_of(one), self.time, first=j < k and not isinstance(one, Many))
            for j, one in enumerate(surfaces) if j != k and (sign < 0.0 or one.is_there(self.time))
        )  # fmt: skip

    def add(self, part: Part) -> None:
        """Add a part, or what it consists of."""
        whole = part.surface
        if not isinstance(whole, Joined):
            volumes = (one for one in whole.open_volumes() if one.is_there(self.time))
            opened = tuple(Cover(one, -1.0, sign_of(one), self.time) for one in volumes)
            self.parts.append(replace(part, solid=part.solid ^ whole.is_solid(), covers=(*part.covers, *opened)))
            return
        parts = [handed_down(whole, one) for one in whole.parts]
        turned = tuple(replace(one, turn=one.turn * side_of(whole)) for one in part.covers)
        solid, sign = part.solid ^ whole.is_solid(), -1.0 if isinstance(whole, Union) else 1.0
        for k, one in enumerate(parts):
            covers = (*turned, *self.beside(parts, k, sign))
            self.add(Part(part.owner, (*part.place, k), one, solid, covers))
