"""What balls are in, and what is booked of them, as the kernels of collisions take it."""

from typing import Any, NamedTuple

from ...kernel.arrays import index
from ...kernel.jit import Array
from ...kernel.record import Record
from ...lanes.watching.watchers import Watchers


class Domain(Record):
    """What the balls are in: walls and their laws, gravity, cells, kinds of balls, what is lost of their energy."""

    walls: Any
    laws: Any
    pull: Any
    grid: Any
    kinds: Any
    loss: Any  # None, or `Loss`
    shortest: float  # the time that a flight from a wall back to it takes at least [s]
    watchers: Watchers = Watchers()
    growth: Any = None  # `Growth` of balls that are packed
    window: Any = None  # of walls that move, come or go: see window.py
    gates: Any = None  # None, or `Gates` where balls may leave the walls
    heavy: Any = None  # None, or `Heavy` where walls have a mass
    source: Any = None  # None, or `RandomSource` where walls send them off
    repose: Any = None  # None, or `Repose` where balls may come to rest
    turning: Any = None  # None, or `BallSpins` of balls that have a spin
    owners: Any = None  # the number in the scene of each wall without a mass; None if no wall has a mass
    rows: Any = None  # the row in the books of each wall without a mass; None if no wall has a mass

    def owner(self, wall):
        """The number of a wall in the scene."""
        return wall if self.owners is None else float(self.owners[index(int(wall))])

    def row(self, walls, wall):
        """The row of the books of one of these walls."""
        return index(int(walls.row(wall) if self.rows is None else self.rows[index(int(wall))]))


class CollisionTotals(NamedTuple):
    """What is booked: of each ball, and of all."""

    impulse: Array  # (2 walls, 1)
    dissipated: Array  # (N,), or none
    impacts: Array  # (N,)
    virial: Array  # (1,)
    image: Any = None  # (3, N) where the scene repeats
    heat: Any = None  # (walls, 1) that walls gave [J], or None
    mass: Any = None  # (N,) of balls
    crossed: Any = None  # `Crossed`, where there are counters
    before: Any = None  # (N,) `impacts` when the frame began, where walls move


class CollisionRule(NamedTuple):
    """The end of the frame [s], and when to stop."""

    end: float
    halt: Array  # (1,) events
