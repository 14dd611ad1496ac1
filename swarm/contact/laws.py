"""The laws of walls: restitution, Coulomb's friction, thermal walls. What no wall of a scene has is None."""

from typing import Any

from ..kernel.jit import select
from ..kernel.record import Record
from ..surfaces.fold import Chain


class Laws(Record):
    """The effects of impacts on a particle besides turning it round."""

    restitution: Any  # None, or a Chain of one e a wall
    friction: Any  # None, or a Chain of one mu a wall
    thermal: Any  # None, or a Chain of one `Thermal` a wall
    moving: Any  # None, or `Moves` where a wall moves

    @property
    def loses(self):
        """Whether an impact may turn energy into heat: a constant for the compiler."""
        return self.restitution is not None or self.friction is not None

    @property
    def change_energy(self):
        """Whether an impact may change the energy of a particle: a constant for the compiler."""
        return self.loses or self.thermal is not None or self.moving is not None

    def restitution_of(self, wall):
        """e of a wall."""
        return of_wall(self.restitution, wall, 1.0)

    def friction_of(self, wall):
        """mu of a wall."""
        return of_wall(self.friction, wall)

    def thermal_of(self, wall):
        """`Thermal` of a wall."""
        return of_wall(self.thermal, wall, Thermal(0.0, 0.0))


# The laws of rigid elastic walls at rest.
NONE = Laws(None, None, None, None)


class Span(Record):
    """In a chain of numbers, one that holds for so many walls."""

    first: Any
    walls: float
    rest: Any


# The chain of a law that some wall has.
Given = Chain | Span


class Moves(Record):
    """Walls that move: they do work, and laws act on the velocity relative to them."""

    some: float


class Thermal(Record):
    """A thermal wall, or one that is not, whose accommodation is 0."""

    energy: float  # k_B T [J]
    accommodation: float

    def is_hot(self):
        """Whether it gives particles a speed of its own, so that none slides on it."""
        return (self.accommodation > 0.0) & (self.energy > 0.0)


def of_wall(chain, wall, neutral=0.0):
    """The entry of this wall, `neutral` where no wall has the law."""
    if chain is None:
        return neutral
    if isinstance(chain, Span):
        return select(wall < chain.walls, chain.first, of_wall(chain.rest, wall - chain.walls, neutral))
    return select(wall == 0.0, chain.first, of_wall(chain.rest, wall - 1.0, neutral))
