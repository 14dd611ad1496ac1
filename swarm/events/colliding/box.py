"""The surroundings of balls, and the totals of their collisions, as the kernels of collisions take them."""

from typing import Any, NamedTuple

from ...kernel.arrays import index
from ...kernel.jit import Array
from ...kernel.record import Record
from ...lanes.watching.watchers import Watchers


class Domain(Record):
    """The surroundings of the balls: walls and their laws, gravity, cells, kinds of balls, the loss of energy."""

    walls: Any
    laws: Any
    pull: Any
    grid: Any
    kinds: Any
    loss: Any  # None, or `Loss`
    shortest: float  # the least time of a flight from a wall back to it [s]
    watchers: Watchers = Watchers()
    growth: Any = None  # `Growth` of balls that are packed
    window: Any = None  # the numbers of the window where walls move or become absent: see window.py
    gates: Any = None  # None, or `Gates` where balls may leave the walls
    heavy: Any = None  # None, or `Heavy` where walls have a mass
    seeding: Any = None  # None, or `Seeding` where walls send balls off
    repose: Any = None  # None, or `Repose` where balls may come to rest
    turning: Any = None  # None, or the `BallSpins`
    owners: Any = None  # the number in the scene of each wall without a mass; None if no wall has a mass
    rows: Any = None  # the row in the books of each wall without a mass; None if no wall has a mass

    def owner(self, wall):
        """The number of a wall in the scene."""
        return wall if self.owners is None else float(self.owners[index(int(wall))])

    def row(self, walls, wall):
        """The row of a wall in the books."""
        return index(int(walls.row(wall) if self.rows is None else self.rows[index(int(wall))]))


class CollisionTotals(NamedTuple):
    """The totals of a run, of each ball and of all."""

    impulse: Array  # (2 walls, 1)
    dissipated: Array  # (N,), or none
    impacts: Array  # (N,)
    virial: Array  # (1,)
    image: Any = None  # (3, N) in a periodic scene
    heat: Any = None  # (walls, 1) the energy given by walls [J], or None
    mass: Any = None  # (N,) the masses of balls [kg]
    crossed: Any = None  # `Crossed`, where there are counters
    before: Any = None  # (N,) `impacts` at the start of the frame, where walls move


class CollisionRule(NamedTuple):
    """How far events are taken: the end of the frame [s], and the most events of the call."""

    end: float
    halt: Array  # (1,) the most events of the call
