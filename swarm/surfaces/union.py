"""Vessels of several parts: a particle is admissible in any of them (`Union`), or in all (`Intersection`).

Nested ones are flattened: the admissible side is a union of *rooms*, each the intersection of the admissible sides of
surfaces. The *gap* of a part is its phi with the sign of its side, that of a room the largest gap of its surfaces, and
that of the whole the least gap of its rooms.
"""

import copy
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.checks import Vector
from ..errors import SceneError
from ..state import Floats
from .area_samples import NEAR, AreaSample, Random, Region
from .instant import distances, side_of
from .part import checked_parts, handed_down, other_side
from .room import Room, has_volume, lasting, may_have_volume, union_bounds
from .surface import UNBOUNDED, Box, Surface
from .surface import Place as Place

if TYPE_CHECKING:
    from .presence.seams import Seam

# The most rooms: each is compiled into the kernels.
_MOST_ROOMS = 64


@dataclass(frozen=True, repr=False)
class Joined(Surface):
    """The common part of `Union` and `Intersection`."""

    parts: Any = field(metadata={"key": "part"})
    side: str = "inside"

    # The operation on the gaps of parts, and the place of the wall of one: inside the others (1), or outside (-1).
    _of_gaps: ClassVar[Any] = None
    wall_in_others: ClassVar[float] = 1.0
    # In a scene, the overlap of its rooms where they have a face in common [m]; None: they touch.
    reach: ClassVar[float | None] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        name = type(self).__name__
        object.__setattr__(self, "parts", checked_parts(self.parts, name))
        for k, part in enumerate(self.parts):
            if part.reacts():
                raise SceneError(
                    f"parts[{k}] must have no mass and no inertia, got {part!r:.200}: impacts move surfaces of the "
                    "scene only; give it a motion"
                )
            if self.motion is not None and _moves(part):
                raise SceneError(
                    f"parts[{k}] must have no motion of its own where the {name} has one, got {part!r:.200}; give "
                    "each part its motion, or the whole one"
                )
        if self.rotation is not None:
            self._turn()
        if len(self.rooms) > _MOST_ROOMS:
            raise SceneError(
                f"parts must leave at most {_MOST_ROOMS} rooms, which are unions of parts taken together, got "
                f"{len(self.rooms)}; list what they have in common as a surface of the scene"
            )
        if len(self.rooms) > 1:
            _require_alone(self)
        _require_room(self)

    def _turn(self) -> None:
        """Turn each part about the origin, instead of the whole."""
        for k, part in enumerate(self.parts):
            if _moves(part):
                raise SceneError(
                    f"parts[{k}] must have no motion of its own where the {type(self).__name__} has a rotation, got "
                    f"{part!r:.200}; give the motion to the whole, or its rotation to each of its parts"
                )
        object.__setattr__(self, "parts", tuple(part.turned(self.rotation) for part in self.parts))
        object.__setattr__(self, "rotation", None)

    @cached_property
    def rooms(self) -> tuple[Room, ...]:
        return tuple(map(tuple, self._places_in_rooms))

    def places(self) -> tuple[Place, ...]:
        return tuple(place for room in self._places_in_rooms for place in room.values())

    def places_of_parts(self) -> tuple[Place, ...]:
        return tuple(
            (k, *place) for k, part in enumerate(self.parts)
            for place in (part.places_of_parts() or ((),))
        )  # fmt: skip

    @cached_property
    def _places_in_rooms(self) -> tuple[dict[Surface, Place], ...]:
        """Return the surfaces of every room, and the places of the parts that they come from."""
        rooms: list[dict[Surface, Place]] = []
        for room in self._rooms(self.side == "outside"):
            rooms.append({})
            for surface, place in room:
                rooms[-1].setdefault(surface, place)
        # The parts may have no volume in common.
        rooms = [room for room in rooms if may_have_volume(tuple(room))] if len(rooms) > 1 else rooms
        if self.reach is None:
            return tuple(rooms)
        from .presence.seams import joined

        return tuple(joined(rooms, self.seams, self.reach))

    @cached_property
    def seams(self) -> "list[Seam]":
        """Return the faces that its rooms have in common, and that are no walls."""
        return [seam for seam in self._touching if seam.together]

    @cached_property
    def _touching(self) -> "list[Seam]":
        from .presence.seams import seams_of  # loaded where there is a union

        return seams_of(self.rooms)

    def moving_apart(self) -> list[tuple[Surface, Surface]]:
        ends = [zip(seam.rooms, seam.surfaces, strict=True) for seam in self._touching if not seam.together]
        return [(self.rooms[i][a], self.rooms[k][b]) for (i, a), (k, b) in ends]

    def common_places(self) -> list[tuple[Place, Place]]:
        if self.reach is None:
            return []
        places = [tuple(room.values()) for room in self._places_in_rooms]
        pairs = (zip(seam.rooms, seam.surfaces, strict=True) for seam in self.seams)
        return [(places[i][a], places[k][b]) for (i, a), (k, b) in pairs]

    def reaching(self, reach: float) -> "Joined":
        if len(self.rooms) < 2 or not self.seams:
            return self
        made = copy.copy(self)
        for name in ("rooms", "_places_in_rooms"):
            made.__dict__.pop(name, None)
        object.__setattr__(made, "reach", reach)
        return made

    def _rooms(self, turned: bool) -> list[tuple[tuple[Surface, Place], ...]]:
        """Return the surfaces and places of the rooms of the admissible side, or of the other side."""
        parts = [handed_down(self, part) for part in self.parts]
        given = [one._rooms(turned ^ (one.side == "outside")) if isinstance(one, Joined)
                 else [((other_side(one) if turned else one, ()),)] for one in parts]  # fmt: skip
        given = [
            [tuple((surface, (k, *place)) for surface, place in room) for room in rooms]
            for k, rooms in enumerate(given)
        ]
        if (self._of_gaps is np.minimum) ^ turned:
            return [room for rooms in given for room in rooms]
        if math.prod(map(len, given)) > _MOST_ROOMS:
            raise SceneError(
                f"parts must leave at most {_MOST_ROOMS} rooms, which are unions of parts taken together, got "
                f"{math.prod(map(len, given))}; list what they have in common as a surface of the scene"
            )
        return [tuple(itertools.chain(*rooms)) for rooms in itertools.product(*given)]

    def surfaces(self) -> tuple[Surface, ...]:
        return tuple(itertools.chain(*self.rooms))

    def walls(self) -> tuple[Any, ...]:
        """Return the walls of these rooms."""
        return tuple(itertools.chain(*(surface.walls() for surface in self.surfaces())))

    def walls_of_balls(self, largest: float) -> tuple[Any, ...]:
        return tuple(itertools.chain(*(surface.walls_of_balls(largest) for surface in self.surfaces())))

    def as_one_wall(self) -> Surface:
        if len(self.rooms) == 1:
            return self
        from .fields.soft_rooms import soft_rooms  # loaded where rooms are joined

        return soft_rooms(self)

    def why_no_balls(self) -> str | None:
        if len(self.rooms) > 1:
            from .balls.joined_rooms import why_no_balls_in  # loaded where balls are

            return why_no_balls_in(self)
        whys = ((surface, surface.why_no_balls()) for surface in self.surfaces())
        return next((f"with a {type(surface).__name__}, {why}" for surface, why in whys if why is not None), None)

    def largest_ball(self) -> float:
        return math.inf if len(self.rooms) == 1 else min(surface.size() for surface in self.surfaces())

    def reaching_outside(self, points: Floats, radius: Floats, time: float = 0.0) -> Floats:
        there = [surface for surface in self.surfaces() if surface.is_there(time)]
        away = np.full(points.shape[1], -math.inf)
        return np.asarray(np.max([away, *(one.reaching_outside(points, radius, time) for one in there)], axis=0))

    def lost(self, points: Floats, time: float) -> NDArray[np.bool_]:
        there = [surface for surface in self.surfaces() if surface.is_there(time)] if len(self.rooms) == 1 else []
        return np.asarray(np.any([super().lost(points, time), *(one.lost(points, time) for one in there)], axis=0))

    # --- For users ---------------------------------------------------------------------------------------

    def size(self) -> float:
        return float(min(part.size() for part in self.parts))

    def extent(self) -> float:
        return float(max(part.extent() for part in self.parts))

    def bounds(self) -> Box:
        if self.is_solid():
            return UNBOUNDED
        # The bounds do not include the motion of the whole.
        still = [[one.at_rest() if self.motion is not None else one for one in room] for room in self.rooms]
        return union_bounds(map(lasting, still))

    def enclosing_box(self) -> Box:
        return self.bounds()

    def area_samples(self, bounds: Region, across: int | None) -> list[AreaSample]:
        # A wall of several rooms is drawn once.
        parts = dict.fromkeys(self.surfaces())
        return [_of_part(part, one) for part in parts for one in part.area_samples(bounds, across)]

    def shifted(self, shift: Vector) -> "Surface":
        return replace(self, parts=tuple(part.shifted(shift) for part in self.parts))

    def is_unturned_by(self, axis: Vector, center: Vector) -> bool:
        return all(part.is_unturned_by(axis, center) for part in self.parts)

    def phi(self, points: ArrayLike, time: float = 0.0) -> Floats:
        """Return the least gap of the parts of a union, the largest of an intersection, at points (3, N); shape (N,).

        A surface that moves is taken at `time` [s].
        """
        rows = self._own_points(points, time)
        return np.asarray(self._of_gaps.reduce(self._gaps(rows, time)))

    def _own_gradient(self, points: ArrayLike, time: float) -> Floats:
        rows = self._own_points(points, time)
        gaps = self._gaps(rows, time)
        least = (np.argmin if self._of_gaps is np.minimum else np.argmax)(gaps, axis=0)
        found = np.zeros(rows.shape)
        for k, part in enumerate(self.parts):
            found = np.where(least == k, side_of(part) * part.gradient(rows, time), found)
        return found

    def _gaps(self, rows: Floats, time: float) -> Floats:
        """Return the gaps of the parts: infinite where one has no value, -infinite where the walls of it are absent."""
        gaps = np.array([side_of(part) * part.phi(rows, time) for part in self.parts])
        there = np.array([part.is_there(time) for part in self.parts])
        return np.where(there.reshape(-1, *[1] * (gaps.ndim - 1)), np.where(np.isnan(gaps), math.inf, gaps), -math.inf)

    def _own_points(self, points: ArrayLike, time: float) -> Floats:
        rows = self._own_rows(points, time)
        return np.array(np.broadcast_arrays(*rows))


@dataclass(frozen=True, repr=False)
class Union(Joined):
    """A vessel of several parts, which may overlap: a particle in one of them is in the vessel.

    A part has no wall inside another part. Parts that have a flat or a round face in common, to 4 roundings of
    the size, are one room, and parts that do not touch separate ones. An `Opening` in a common face is a door: the rest
    of the face is a wall of no thickness then. Each part has its laws, temperature, motion and openings; arguments of
    the union hold for the parts that leave them out.

    In a scene file: kind = "union" and [[surface.part]] tables.

    Args:
        parts: surfaces of any kinds, also unions and intersections; each with its own `side`.
        side: "inside", or "outside": a solid of several parts.

    Raises:
        SceneError: no part, one without a volume, or a union without an inside.

    >>> import swarm
    >>> Union([swarm.Sphere(0.5), swarm.Sphere(0.5, (0.6, 0.0, 0.0))]).phi([[0.3, 1.2], [0.0, 0.0], [0.0, 0.0]])
    array([-0.2,  0.1])
    """

    _of_gaps: ClassVar[Any] = np.minimum
    wall_in_others: ClassVar[float] = -1.0
    nouns = ("vessel", "compound solid") * 2


@dataclass(frozen=True, repr=False)
class Intersection(Joined):
    """The volume that several parts have in common, as one of the parts of a `Union`, or of a scene.

    The surfaces of a scene are an intersection already. Each part has its laws, temperature, motion and openings;
    arguments of the intersection hold for the parts that leave them out.

    In a scene file: kind = "intersection" and [[surface.part]] tables.

    Args:
        parts: surfaces of any kinds, also unions and intersections; each with its own `side`.
        side: "inside", or "outside": the space around their common volume, a solid.

    Raises:
        SceneError: no part, or parts that have no volume in common.

    >>> import swarm
    >>> post = swarm.Cylinder(0.1, side="outside")
    >>> Intersection([swarm.Sphere(0.5), post]).phi([[0.3, 0.05], [0.0, 0.0], [0.0, 0.0]]).round(4)
    array([-0.2   ,  0.0375])
    """

    _of_gaps: ClassVar[Any] = np.maximum
    nouns = ("intersection", "intersection") * 2


# --- Their parts -----------------------------------------------------------------------------------------


def _of_part(part: Surface, sample: AreaSample) -> AreaSample:
    """Return a sample of a part without points off that part: a wall beyond it may be one of another part."""

    def draw(random: Random, n: int) -> Floats:
        points = sample.draw(random, n)
        known = np.isfinite(points).all(axis=0)
        off = np.abs(distances(part, points[:, known])) > NEAR * part.extent()
        points[:, np.flatnonzero(known)[off]] = np.nan
        return points

    return sample._replace(draw=draw)


def _moves(part: Surface) -> bool:
    return part.motion is not None or any(map(_moves, part.parts))


def nodes_of(surface: Surface) -> Iterator[tuple[Place, Surface]]:
    """Yield a surface, at no place, and all its parts, and their parts, as given, each with its place."""
    yield (), surface
    for k, part in enumerate(surface.parts):
        for place, one in nodes_of(part):
            yield (k, *place), one


def part_at(surface: Surface, place: Place) -> Surface:
    """Return the part at a place of a surface, with the arguments of the whole; at no place the surface itself."""
    for k in place:
        surface = handed_down(surface, surface.parts[k])
    return surface


# --- Their rooms -----------------------------------------------------------------------------------------


def _require_alone(whole: Joined) -> None:
    """Raise a `SceneError` for a surface of many bodies, or known only where its own walls keep particles."""
    for surface in whole.surfaces():
        if surface.is_field:
            raise SceneError(
                f"parts must not be {type(surface).__name__} in a {type(whole).__name__} of several rooms, got "
                f"{surface}; list them as a surface of the scene, or their bodies one by one"
            )
        if surface.face_noun:
            raise SceneError(
                f"parts must not be {type(surface).__name__} in a {type(whole).__name__} of several rooms, got "
                f"{surface}; make one mesh of what belongs together, or list it as a surface of the scene"
            )
        if surface.known_in() is not None:
            raise SceneError(
                f"parts must be known everywhere, got {surface!r:.200}, which reaches the border of its grid; sample "
                "it in a larger box"
            )


def _require_room(whole: Joined) -> None:
    """Raise a `SceneError` if a part, or the whole, has no volume."""
    for k, part in enumerate(whole.parts):
        if not part.parts and not has_volume((part,)):
            raise SceneError(f"parts[{k}] must have a volume, got {part!r:.200}, of which no point is admissible")
    if not any(map(has_volume, whole.rooms)):
        came = ", ".join(f"{part!r:.80}" for part in whole.parts)
        if whole._of_gaps is np.maximum and not whole.is_solid():
            raise SceneError(
                f"parts must have a volume in common, got {came}; their admissible sides have no point in common; "
                "check their `side`, or leave one out"
            )
        raise SceneError(
            f'parts must leave an inside of a {type(whole).__name__} with side="{whole.side}", got {came}, of which no '
            "point is admissible; check their `side`"
        )
