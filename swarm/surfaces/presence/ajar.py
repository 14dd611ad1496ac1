"""Walls as one step of a particle meets them, some of which are open to it: a step is decided by where it begins."""

from typing import Any

from ...kernel.record import Record
from .doors import Present


class Ajar(Present):
    """A wall over a step, and whether it stands: 1, or 0 where it is open to the particle."""

    def displacement(self):
        return self.body.displacement()

    def swept(self, r0, r1):
        return self.body.swept(r0, r1)

    def place_scale(self, s):
        return self.body.place_scale(s)

    def framed(self, r, p):
        body, start, way = self.body.framed(r, p)
        return self._replace(body=body), start, way


class Faced(Record):
    """The walls of a scene as one step of a particle meets them."""

    walls: Any
    stand: tuple[Any, ...]  # of each wall 1, or 0 where it is open

    def length(self):
        """The number of rows, as that of the walls."""
        return self.walls.length()

    def at(self, remaining):
        """The walls when so much of the frame is left [s]."""
        return self._of(self.walls.at(remaining))

    def during(self, remaining, after):
        """The walls over a step; at its start and end so much of the frame is left [s]."""
        return self._of(self.walls.during(remaining, after))

    def _of(self, now):
        return now._replace(each=tuple(Ajar(wall, one) for wall, one in zip(now.each, self.stand, strict=True)))
