"""The walls of a scene, some of which move.

`at` and `during` make of them those at one instant, or over one step, which are surfaces like any other; a scene
without motion has none of this around its walls and pays nothing.
"""

from collections.abc import Sequence
from typing import Any

from ..kernel.record import Record
from .drive import Drive, drive_of
from .fold import Chain, Field
from .posed import Drifting, Posed
from .surface import Surface


class Driven(Record):
    """A wall that moves."""

    def seen(self, flight, t):
        """A particle as safe steps to the wall see it after a time of its flight: None where none are needed."""
        return


class Moving(Driven):
    """A wall, or a field of them, and its motion."""

    body: Any
    drive: Drive

    posed = Posed

    def count(self):
        """How many walls a field has."""
        return self.body.count()

    def during(self, left, after):
        """The wall over a step, at whose start and end so much of the frame is left [s]."""
        start = self.drive.pose(left)
        end = start if after is left else self.drive.pose(after)
        return self.posed(self.body, start, end, self.drive, left, after)

    def seen(self, flight, t):
        left = flight.left - t
        return flight.seen(t, self.during(left, left), flight.pull)


class Translated(Moving):
    """A wall in uniform translation, with or without a spin that leaves the surface as it is."""

    posed = Drifting

    def seen(self, flight, t):
        return None


class Following(Record):
    """A wall that moves with the one before it: both are of one surface."""

    body: Any


class Carried(Record):
    """The walls of a scene, some of which move, all of them uniformly."""

    walls: Chain | Field


class Marched(Carried):
    """The same where others move in any other way, by safe steps to these, or where some are bodies of a field."""


class Strided(Marched):
    """The same where all of these steps are taken in lanes: see strides.py."""


# --- From a description ----------------------------------------------------------------------------------


def carried(fields: Sequence[Surface], surfaces: Sequence[Surface], moment: float) -> Chain | Field | Carried | None:
    """The walls of a scene in the frame that ends at a moment [s]; those of fields are before all others."""
    of_surfaces = [walls_of(surface, moment) for surface in surfaces]
    chain: Chain | Field | None = None
    for wall in reversed([wall for walls in of_surfaces for wall in walls]):
        chain = Chain(wall, chain)
    for field in reversed(fields):
        chain = Field(walls_of(field, moment)[0], chain)
    if chain is None or all(surface.motion is None for surface in (*fields, *surfaces)):
        return chain
    if fields:
        return Marched(chain)
    marched = [walls for walls in of_surfaces if type(walls[0]) is Moving]
    if not marched:
        return Carried(chain)
    return (Strided if all(map(_may_stride, marched)) else Marched)(chain)


def _may_stride(walls: list[Any]) -> bool:
    """Whether lanes can take the safe steps of the walls of a surface; of a spline each would look for its piece."""
    return walls[0].drive.track is None and all(wall.body.has_levels for wall in walls)


def walls_of(surface: Surface, moment: float) -> list[Any]:
    """The walls of a surface in the frame that ends at a moment [s]."""
    first, *others = surface.walls()
    if surface.motion is None:
        return [first, *others]
    drive = drive_of(surface, moment)
    uniform = drive.swings is None and drive.track is None and drive.turn is None
    return [(Translated if uniform else Moving)(first, drive), *map(Following, others)]


# --- At one instant --------------------------------------------------------------------------------------


def at(chain, left):
    """The walls when so much of the frame is left [s]: themselves, where none moves."""
    return during(chain, left, left)


def during(chain, left, after):
    """The walls over a step, at whose start and end so much of the frame is left [s]."""
    return _during(chain.walls, None, left, after) if isinstance(chain, Carried) else chain


def _during(chain, last, left, after):
    """The walls of a chain; `last` is the one before them."""
    if chain is None:
        return None
    wall, kind = chain.first, Field if isinstance(chain, Field) else Chain
    if isinstance(wall, Following):
        wall = last._replace(body=wall.body)
    elif isinstance(wall, Moving):
        wall = wall.during(left, after)
    return kind(wall, _during(chain.rest, wall, left, after))
