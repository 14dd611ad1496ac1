"""Openings: volumes inside which a wall is absent. A particle that reaches the wall there has passed.

A volume is where a particle would be admissible among the walls of the surface that describes it; for many bodies
(`Spheres` and the like) it is the inside of each.
"""

import itertools
import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...kernel.jit import select
from ...kernel.limits import TINY
from .. import required
from ..fields.grouped import by_kind
from ..fields.many import Many, members_of, sign_of
from ..fields.members import Members, can_be_member, kind_of
from ..instant import distances_of, has_room, side_of
from ..outlines.outlined import Outlined
from ..periodic.images import Lengths, images_of
from ..surface import Surface
from ..union import Joined
from ..walls import Field, Walls, all_walls
from .absence import OPEN, Absence
from .doors import is_there, was_there
from .rooms import leads_on

# The most walls that all openings of a scene may be compiled for.
_MOST = 24
# Places of a wall that are searched for one near to a counter in an opening, and Newton's steps of each onto the wall.
_PLACES, _NEWTON = 4096, 8
# An unbounded volume is searched up to this multiple of the larger extent, of the wall or of the volume.
_REACH = 2.0


class Opened(Absence):
    """The volumes in which walls are open."""

    volumes: tuple[Any, ...]  # each `Walls` or a `Field`
    first: float  # the number of the first of these walls
    last: float  # of the first wall after them; `first` while the volumes are shut: they open no wall then

    def is_of(self, wall):
        """Whether a wall is opened by these volumes."""
        return (wall >= self.first) & (wall < self.last)

    # Whether the walls are open only where another room of their union is on the other side.
    between = False

    def takes(self, walls, wall, r, near, depth):
        taken = self.is_of(wall) & _is_deep_in(self.volumes, r, near, depth)
        return taken & leads_on(walls, wall, r) if self.between else taken


class Doorway(Opened):
    """The volumes in which walls between rooms are open."""

    between = True


# --- From a description ----------------------------------------------------------------------------------


def openings_in(
    spans: Sequence[tuple[int, int]], given: Sequence[Sequence[Sequence[Surface]]], moment: float
) -> tuple[Opened, ...]:
    """Return the openings of the walls of a scene as records for kernels.

    `spans` are (piece, number of consecutive walls of it); `given` are the volumes in which each piece is open, and the
    volumes in which it is open where another room is behind it, in the frame, or the piece of one, that ends at a
    moment [s].
    """
    made = _rows(spans, given, moment, False)
    return made if compiled(made) <= _MOST else _rows(spans, given, moment, True)


def compiled(openings: Sequence[Opened]) -> int:
    """Return the number of walls of volumes in kernels: one for a field, and once for consecutive walls."""
    volumes = (one for opened in openings for one in opened.volumes)
    return sum(1 if isinstance(one, Field) else len(one.each) for one in volumes)


def _rows(
    spans: Sequence[tuple[int, int]], given: Sequence[Sequence[Sequence[Surface]]], moment: float, together: bool
) -> tuple[Opened, ...]:
    """Return the openings; openings of one kind that are open at the same times are one.

    Volumes of one kind are one field if they are taken `together`.
    """
    made: list[Opened] = []
    for kind, volumes in zip((Opened, Doorway), given, strict=True):
        rows, number = [], 0
        for alike, some in itertools.groupby(spans, lambda span: volumes[span[0]]):  # noqa: B023
            first, number = number, number + sum(walls for _piece, walls in some)
            for times in dict.fromkeys(volume.present for volume in alike):
                last = number if was_there(times, moment) else first
                at_once = [volume for volume in alike if volume.present == times]
                rows.append(kind(volumes_in(at_once, together), float(first), float(last)))
        made += reversed(by_kind(rows, lambda row: row.volumes))
    return tuple(made)


def volumes_in(volumes: Sequence[Surface], together: bool = False) -> tuple[Any, ...]:
    """Return volumes as records for kernels; with `together`, several of one kind are a field."""
    fields, rest = _fields_of(volumes) if together else ([], volumes)
    alone = reversed(by_kind(rest, lambda volume: volume.walls()))
    return (
        *map(Field, fields),
        *(Field(one.members) if isinstance(one, Many) else all_walls([one]) for one in alone),
    )


def _fields_of(volumes: Sequence[Surface]) -> tuple[list[Members], list[Surface]]:
    """Return several volumes of one kind as the insides of the solids of a field each, and the other volumes."""
    found: dict[Any, list[Surface]] = defaultdict(list)
    rest = []
    for one in volumes:
        solid = replace(one, side="outside") if getattr(one, "side", None) == "inside" else None  # type: ignore[call-arg]
        walls = () if solid is None or isinstance(one, (Many, Joined)) else solid.walls()
        if solid is not None and len(walls) == 1 and can_be_member(walls[0]):
            found[kind_of(walls[0])].append(solid)
        else:
            rest.append(one)
    return [members_of(solids, None) for solids in found.values()], rest


def volumes_of(surface: Surface, period: Lengths | None, name: str) -> tuple[Surface, ...]:
    """Return the open volumes of a surface: those of its openings and, in a periodic scene, their images.

    Raises:
        SceneError: an opening has no phi, or no point of the wall in it, or it does not fit the period.
    """
    found: list[Surface] = []
    for k, opening in enumerate(surface.open_volumes()):
        where = f"{name}.openings[{k}]"
        _require_volume(opening, where)
        if not reaches(surface, opening):
            raise SceneError(
                f"{where} must reach the wall that it opens, got {opening}, in which no point of {name} "
                f"({type(surface).__name__}) is; move it, or make it larger"
            )
        found += [opening] if period is None else _images(opening, period, where)
    return tuple(found)


def volumes_of_counter(volume: Surface, period: Lengths | None, name: str) -> tuple[Surface, ...]:
    """Return the volume in which a counter counts and, in a periodic scene, its images.

    Raises:
        SceneError: it has no phi that is known everywhere, or it does not fit the period.
    """
    _require_volume(volume, name)
    return (volume,) if period is None else tuple(_images(volume, period, name))


def _require_volume(volume: Surface, name: str) -> None:
    """Raise a `SceneError` if a surface has no phi that is known everywhere."""
    if isinstance(volume, Outlined):
        raise SceneError(
            f"{name} must be a volume of surfaces such as swarm.Box, got {type(volume).__name__}; give a box or a "
            "cylinder"
        )
    required.require_description([volume], name)


def _images(opening: Surface, period: Lengths, name: str) -> list[Surface]:
    """Return the images of a volume that reach into the cell."""
    side = getattr(opening, "side", None)
    if isinstance(opening, Many) or side is None:
        return images_of(opening, period, name)
    if side == "outside":
        raise SceneError(
            f'{name}.side must be "inside" where the scene has a period, got "outside": the images of what is open '
            "would cover one another's walls"
        )
    # The images of a solid are those of its volume.
    solid = replace(opening, side="outside")  # type: ignore[call-arg]
    return [replace(image, side="inside") for image in images_of(solid, period, name)]  # type: ignore[call-arg]


def require_few(openings: Sequence[Opened]) -> None:
    """Raise a `SceneError` if there are more openings than kernels can be compiled for."""
    walls = compiled(openings)
    if walls > _MOST:
        volumes = sum(len(opened.volumes) for opened in openings)
        raise SceneError(
            f"openings must have at most {_MOST} walls in all, got {walls}, of {volumes} volumes of {len(openings)} "
            "rows of walls: each is compiled into the kernels, once for every row of walls that has it; use volumes of "
            "fewer kinds, such as spheres alone, or give the same openings to all parts"
        )


def reaches(surface: Surface, opening: Surface) -> bool:
    """Whether a volume has points on both sides of a wall."""
    low, high = _box_around(surface, opening)

    def has_points(side: float) -> bool:
        both = (sign_of(opening), opening), (side, surface)
        return has_room(
            low,
            high,
            lambda points: np.array([sign * one.phi(points) for sign, one in both]),
            lambda i, points: both[i][0] * both[i][1].gradient(points),
        )

    return has_points(side_of(surface)) and has_points(-side_of(surface))


def least_distance(surface: Surface, volumes: Sequence[Surface], other: Surface) -> float:
    """Return how near a surface comes to the part of a wall that an opening cuts out.

    Args:
        surface: the wall.
        volumes: an opening of it, and other volumes: only places in all of them count.
        other: the surface, such as a counter.

    Returns:
        The least distance from some places of the wall [m], infinite if none of them is in all the volumes.
    """
    low, high = _box_around(surface, volumes[0])
    points = low + (high - low) * np.random.default_rng(0).random((3, _PLACES))
    # From a place where phi has no gradient a step leads nowhere, and no volume has such a place.
    with np.errstate(all="ignore"):
        for _ in range(_NEWTON):
            slopes = surface.gradient(points)
            points = points - surface.phi(points) / np.maximum((slopes**2).sum(axis=0), TINY) * slopes
        within = np.all([sign_of(volume) * volume.phi(points) <= 0.0 for volume in volumes], axis=0)
        return float(np.abs(distances_of((other,), points[:, within], 0.0)).min(initial=math.inf))


def _box_around(surface: Surface, opening: Surface) -> Any:
    """Return the corners of the box of an opening (3, 1) [m], limited to the surroundings of its wall."""
    reach = _REACH * max(surface.extent(), opening.extent())
    low, high = (np.array(corner)[:, None] for corner in _box_of(opening))
    # A margin, also for a flat volume with a box of no width
    room = 1e-9 * reach
    return np.maximum(low - room, -reach), np.minimum(high + room, reach)


def _box_of(opening: Surface) -> Any:
    if isinstance(opening, Many):
        low, high = opening.corners()
        return low.min(axis=1), high.max(axis=1)
    return opening.bounds()


def are_open(volumes: Sequence[Surface], points: NDArray[np.float64], time: float) -> NDArray[np.bool_]:
    """Whether each of the points (3, N) is in any of the volumes that are open at a time [s]."""
    found = np.zeros(points.shape[1], np.bool_)
    for volume in volumes:
        if is_there(volume.present, time):
            found |= sign_of(volume) * volume.phi(points) <= 0.0
    return found


# --- In kernels ------------------------------------------------------------------------------------------


def outside(volume, r):
    """Return the signed distance outside a volume, to first order: above 0 outside, and NaN where it has no value.

    A volume that is neither `Walls` nor a `Field` is the inside of one body of a field; the outside is admissible.
    """
    if isinstance(volume, Field):
        return -volume.members.deepest_in_cell(r)
    if not isinstance(volume, Walls):
        return -volume.distance(r)
    farthest = -math.inf
    for wall in reversed(volume.each):
        here = wall.distance(r)
        farthest = select(here <= farthest, farthest, here)
    return farthest


def _is_deep_in(volumes, r, near, depth):
    """Whether a place is deeper in any of the volumes than `depth` times `near`."""
    found = False
    for volume in reversed(volumes):
        found = (outside(volume, r) <= -depth * near) | found
    return found


def is_in_any(volumes, r):
    """Whether a place is in any of the volumes."""
    return _is_deep_in(volumes, r, 0.0, OPEN)


def is_open(openings, wall, r, near):
    """Whether a place on this wall is in an opening of it, or within `near` of one; False for no wall, which is -1.

    An opening between rooms counts without the test that another room is on the other side.
    """
    found = False
    for opening in reversed(openings or ()):
        found = (opening.is_of(wall) & _is_deep_in(opening.volumes, r, near, OPEN)) | found
    return found
