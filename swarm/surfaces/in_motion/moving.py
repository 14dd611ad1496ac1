"""The walls of a scene, some of which move.

`at` and `during` return the walls at one instant, or over one step, which are surfaces like any other.
"""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...kernel.record import Record
from ...kernel.vector import norm
from ...motion import Guide
from ..fields.members import Members
from ..fields.one_wall import OneWall
from ..presence.doors import walls_then
from ..surface import Surface
from ..walls import Field, Following, Walls
from .drive import Drive, drive_of
from .posed import Drifting, Posed
from .turned import Turned


class Moving(Record):
    """A wall, or a field of them, and its motion."""

    body: Any
    drive: Drive

    posed, accelerates = Posed, True

    def grown(self, radius):
        """Return the wall that the centre of a ball meets."""
        return self._replace(body=self.body.grown(radius))

    def count(self):
        """Return the number of walls of a field."""
        return self.body.count()

    def during(self, remaining, after):
        """Return the wall over a step; at its start `remaining` is left of the frame [s], at its end `after`."""
        start = self.drive.pose(remaining)
        end = start if after is remaining else self.drive.pose(after)
        # The waves hold at one instant only.
        return self.posed(self.body, start, end, self.drive._replace(waves=None), remaining, after)

    def seen(self, flight, t):
        """Return the `Seen` of a particle after a time of its flight, for safe steps; None if none are needed."""
        remaining = flight.remaining - t
        return flight.seen(t, self.during(remaining, remaining), flight.pull)

    def on_piece(self, piece):
        """Return the wall at one instant, at which its path is on this piece."""
        return self._replace(drive=self.drive.on_piece(piece))


class TurningWall(Moving):
    """A wall that turns, with or without another motion."""

    posed = Turned


class Translated(Moving):
    """A wall in uniform translation, with or without a spin that leaves the surface unchanged."""

    posed, accelerates = Drifting, False

    def seen(self, flight, t):
        return None


class Carried(Walls):
    """The walls of a scene, some of which move, all of them uniformly."""

    def at(self, remaining):
        return self.during(remaining, remaining)

    def during(self, remaining, after):
        made: tuple[Any, ...] = ()
        last: Any = None
        for wall in self.each:
            last = _during(wall.members if isinstance(wall, Field) else wall, last, remaining, after)
            made = (*made, Field(last) if isinstance(wall, Field) else last)
        return Walls(made, self.unions, self.slack, self.inset)

    def in_steps(self):
        return False

    def aim(self, gravity):
        return False

    def are_looked_at(self):
        return False


class Marched(Carried):
    """The walls of a scene, some of which move other than uniformly, or are a moving field: flights take safe steps."""

    accelerate = True


class Strided(Marched):
    """`Marched` walls with all safe steps taken in lanes: see strides.py."""


class Aimed(Strided):
    """`Strided` walls to which most flights need no safe step: see aim.py."""

    def drives(self):
        """Return the motion of each surface that moves other than uniformly."""
        return tuple(wall.drive for wall in self.each if isinstance(wall, Moving) and wall.accelerates)

    def with_waves(self, waves):
        """Return the walls at one instant with the waves of all of these motions; () if the waves are not known."""
        if not waves:
            return self
        made: tuple[Any, ...] = ()
        for wall in self.each:
            if isinstance(wall, Moving) and wall.accelerates:
                count = len(wall.drive.rates())
                wall, waves = wall._replace(drive=wall.drive._replace(waves=waves[:count])), waves[count:]
            made = (*made, wall)
        return self._replace(each=made)


class Leaping(Marched):
    """`Marched` walls with fields of facets only: lanes leap through their cells."""


def _during(wall, last, remaining, after):
    """Return a wall over a step; `last` is the wall before it over this step."""
    if isinstance(wall, Following):
        return last._replace(body=wall.body)
    return wall.during(remaining, after) if isinstance(wall, Moving) else wall


# --- From a description ----------------------------------------------------------------------------------


def carried(
    fields: Sequence[Surface], surfaces: Sequence[Surface], moment: float, largest: float | None = None,
    in_rooms: bool = False,
) -> Walls:  # fmt: skip
    """Return the walls of a scene in the frame that ends at a moment [s]; those of fields are before all others.

    They are for points, or for balls up to this radius [m]. `in_rooms` is whether some are of unions; their rooms
    are tested one by one.
    """
    of_surfaces = [walls_of(surface, moment, largest) for surface in surfaces]
    each = of_surfaces if in_rooms else _led_together(surfaces, of_surfaces)
    all_walls = (*(Field(walls_of(field, moment, largest)[0]) for field in fields), *itertools.chain(*each))
    if all(surface.motion is None for surface in (*fields, *surfaces)):
        return Walls(all_walls)
    if fields:
        return (Leaping if all(map(_may_leap, all_walls[: len(fields)])) else Marched)(all_walls)
    marched = [walls for walls in of_surfaces if type(walls[0]) in (Moving, TurningWall)]
    if not marched:
        return Carried(all_walls)
    if not all(map(_may_stride, marched)):
        return Marched(all_walls)
    return (Aimed if all(map(_may_aim, marched)) else Strided)(all_walls)


def _led_together(surfaces: Sequence[Surface], of_surfaces: Sequence[list[Any]]) -> list[list[Any]]:
    """Return the walls of surfaces; walls that move like the surface before them follow it, and share its pose.

    Five boxes that make a cup are one motion for a kernel, and less to compile.
    """
    found = list(of_surfaces)
    for k in range(1, len(found)):
        before, (first, *others) = of_surfaces[k - 1][0], of_surfaces[k]
        free = surfaces[k - 1].mass is None and surfaces[k].mass is None
        if free and isinstance(first, Moving) and type(first) is type(before) and _are_equal(first.drive, before.drive):
            found[k] = [Following(first.body), *others]
    return found


def _are_equal(one: Any, other: Any) -> bool:
    """Whether two records have the same numbers in the same parts."""
    if isinstance(one, tuple):
        return type(one) is type(other) and len(one) == len(other) and all(map(_are_equal, one, other))
    return type(one) is type(other) and bool(np.array_equal(one, other))


def _may_leap(field: Field) -> bool:
    """Whether lanes can leap through the cells of a field."""
    wall = field.members
    return isinstance(wall, Moving) and wall.accelerates and wall.body.in_blocks


def _may_stride(walls: list[Any]) -> bool:
    """Whether lanes can take the safe steps of the walls of a surface; for a spline each would search its piece."""
    return walls[0].drive.track is None and all(wall.body.has_levels for wall in walls)


def _may_aim(walls: list[Any]) -> bool:
    """Whether the bounds by two Taylor polynomials prove most first hits of the walls of a surface."""
    swings = walls[0].drive.turn is None
    return all(wall.body.proves or (swings and wall.body.has_core) for wall in walls)


def walls_of(surface: Surface, moment: float, largest: float | None = None) -> list[Any]:
    """Return the walls of a surface in the frame that ends at a moment [s], as for `carried`."""
    first, *others = walls_then(surface, moment, largest)
    if surface.motion is None:
        return [first, *others]
    drive = drive_of(surface, moment)
    if isinstance(first, (Members, OneWall)):
        first = first.loosened(drive.late + norm(drive.pose(0.0).shift) + norm(drive.center))
    kind = Translated if _is_uniform(drive) else Moving if drive.turn is None else TurningWall
    return [kind(first, drive), *map(Following, others)]


def _is_uniform(drive: Drive) -> bool:
    return not drive.swings and drive.track is None and drive.turn is None


def lacks_bend(surface: Surface) -> bool:
    """Whether hits of a moving surface need safe steps for which it lacks bounds of its curvature."""
    if surface.mass is not None and surface.inertia is None:
        steps = isinstance(surface.motion, Guide) and surface.motion.stiffness > 0.0
    else:
        steps = surface.motion is not None and not _is_uniform(drive_of(surface, 0.0))
    return steps and any(wall.lacks_bend for wall in surface.walls())
