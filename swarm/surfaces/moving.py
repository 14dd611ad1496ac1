"""The walls of a scene, some of which move.

`at` and `during` make of them those at one instant, or over one step, which are surfaces like any other; a scene
without motion has none of this around its walls and pays nothing.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

from ..kernel.jit import by_type
from ..kernel.record import Record
from . import contract, stroke  # noqa: F401
from .drive import Drive, drive_of, pose
from .fold import Chain, Field
from .posed import Drifting, Posed
from .surface import Surface


class Moving(Record):
    """A wall, or a field of them, and its motion."""

    body: Any
    drive: Drive

    def count(self):
        """How many walls a field has."""
        return self.body.count()


class Translated(Moving):
    """A wall in uniform translation, with or without a spin that leaves the surface as it is."""


class Following(NamedTuple):
    """A wall that moves with the one before it: both are of one surface."""

    body: Any


class Carried(NamedTuple):
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
    return walls[0].drive.track is None and all(contract.has_levels(wall.body) for wall in walls)


def walls_of(surface: Surface, moment: float) -> list[Any]:
    """The walls of a surface in the frame that ends at a moment [s]."""
    first, *others = surface.walls()
    if surface.motion is None:
        return [first, *others]
    drive = drive_of(surface, moment)
    uniform = drive.swings is None and drive.track is None and drive.turn is None
    return [(Translated if uniform else Moving)(first, drive), *map(Following, others)]


# --- At one instant --------------------------------------------------------------------------------------


@by_type
def at(chain, left):
    """The walls when so much of the frame is left [s]: themselves, where none moves."""
    return chain


@by_type
def during(chain, left, after):
    """The walls over a step, at whose start and end so much of the frame is left [s]."""
    return chain


at.register(Carried, lambda chain, left: _during(chain.walls, None, left, left))
during.register(Carried, lambda chain, left, after: _during(chain.walls, None, left, after))


@by_type
def _during(chain, last, left, after):
    """The walls of a chain; `last` is the one before them."""
    return


@_during.register(Chain)
def _(chain, last, left, after):
    made = _wall(chain.first, last, left, after)
    return Chain(made, _during(chain.rest, made, left, after))


@_during.register(Field)
def _(chain, last, left, after):
    made = _wall(chain.first, None, left, after)
    return Field(made, _during(chain.rest, None, left, after))


@by_type
def _wall(wall, last, left, after):
    return wall


@_wall.register(Moving)
def _(wall, last, left, after):
    return Posed(wall.body, pose(wall.drive, left), pose(wall.drive, after), wall.drive, left, after)


@_wall.register(Translated)
def _(wall, last, left, after):
    return Drifting(wall.body, pose(wall.drive, left), pose(wall.drive, after), wall.drive, left, after)


_wall.register(Following, lambda wall, last, left, after: _with(last, wall.body))


@by_type
def _with(last, body):
    """Another wall in the place of one at an instant."""
    return


_with.register(Posed, lambda last, body: Posed(body, last.pose, last.end, last.drive, last.left, last.after))
_with.register(Drifting, lambda last, body: Drifting(body, last.pose, last.end, last.drive, last.left, last.after))
