"""Walls as a centred contact step takes them: the gap of the wall that is met is 0 where the step begins.

The step then begins in State I, on the level surface of phi through its start, and ends on it.
"""

from typing import Any

from ..kernel.jit import select
from .contract import Smooth
from .frames import Unturned


class Lowered(Unturned):
    """A wall with a gap that is less by `level`; flights meet the wall itself."""

    body: Any
    level: float

    # A chord from the wall may have a closed form that one from a level does not have.
    chord_guess, chord_improve, chord_sweeps = Smooth.chord_guess, Smooth.chord_improve, Smooth.chord_sweeps

    def gap_of(self, q):
        return self.body.gap_of(q) - self.level

    def level_of(self, q):
        return self.gap_of(q)


def lowered(walls, number, r):
    """All walls, that with this number lowered to the point r."""
    each: Any = ()
    for k, wall in enumerate(walls.each):
        each = (*each, Lowered(wall, select(number == k, wall.gap_of(wall.inner(r)), 0.0)))
    return walls._replace(each=each)
