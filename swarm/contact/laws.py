"""The laws of walls: restitution, Coulomb's friction, thermal walls. What no wall of a scene has is None."""

from typing import Any, NamedTuple

from ..kernel.jit import by_type, inlined, select
from ..surfaces.fold import Chain


class Laws(NamedTuple):
    """What impacts do to a particle besides turning it round."""

    restitution: Any  # None, or a Chain of one e a wall
    friction: Any  # None, or a Chain of one mu a wall
    thermal: Any  # None, or a Chain of one `Thermal` a wall
    moving: Any  # None, or `Moves` where a wall moves


class Span(NamedTuple):
    """In a chain of numbers, one that holds for so many walls."""

    first: Any
    walls: float
    rest: Any


# What the chain of a law is that some wall has.
Given = Chain | Span


class Moves(NamedTuple):
    """Walls that move: they do work, and laws act on the velocity relative to them."""

    some: float


class Thermal(NamedTuple):
    """A thermal wall, or one that is not, whose accommodation is 0."""

    energy: float  # k_B T [J]
    accommodation: float


@by_type
def number_of(chain, wall):
    """The number of this wall."""
    return 0.0


@number_of.register(Chain)
def _(chain, wall):
    return select(wall == 0.0, chain.first, number_of(chain.rest, wall - 1.0))


@number_of.register(Span)
def _(chain, wall):
    return select(wall < chain.walls, chain.first, number_of(chain.rest, wall - chain.walls))


@by_type
def is_given(chain):
    """Whether any wall has this law: a constant for the compiler."""
    return False


is_given.register(Given, lambda chain: True)


@by_type
def thermal_of(chain, wall):
    """`Thermal` of this wall."""
    return Thermal(0.0, 0.0)


@thermal_of.register(Chain)
def _(chain, wall):
    return _either(wall == 0.0, chain.first, thermal_of(chain.rest, wall - 1.0))


@thermal_of.register(Span)
def _(chain, wall):
    return _either(wall < chain.walls, chain.first, thermal_of(chain.rest, wall - chain.walls))


@inlined
def _either(here, first, other):
    return Thermal(select(here, first.energy, other.energy), select(here, first.accommodation, other.accommodation))


# --- Of the laws of a scene, or None ---------------------------------------------------------------------


@by_type
def restitution(laws):
    """The restitution of all walls."""
    return


@by_type
def friction(laws):
    """The friction of all walls."""
    return


@by_type
def thermal(laws):
    """The temperatures of all walls."""
    return


@by_type
def moving(laws):
    """`Moves`, or None."""
    return


@by_type
def loses(laws):
    """Whether an impact may turn energy into heat: a constant for the compiler."""
    return False


@by_type
def moves(laws):
    """Whether a wall moves: a constant for the compiler."""
    return False


moves.register(Laws, lambda laws: is_moving(laws.moving))


@by_type
def is_moving(moving):
    """Whether there is `Moves`: a constant for the compiler."""
    return False


is_moving.register(Moves, lambda moving: True)
moving.register(Laws, lambda laws: laws.moving)
loses.register(Laws, lambda laws: is_given(laws.restitution) or is_given(laws.friction))
restitution.register(Laws, lambda laws: laws.restitution)
friction.register(Laws, lambda laws: laws.friction)
thermal.register(Laws, lambda laws: laws.thermal)


# --- Of one wall -----------------------------------------------------------------------------------------


@by_type
def restitution_of(laws, wall):
    """e of this wall."""
    return 1.0


@restitution_of.register(Laws)
def _(laws, wall):
    return _e(laws.restitution, wall)


@by_type
def _e(chain, wall):
    return 1.0


_e.register(Given, lambda chain, wall: number_of(chain, wall))


@by_type
def is_hot(laws, wall):
    """Whether this wall gives particles a speed of its own, so that none slides on it."""
    return False


@is_hot.register(Laws)
def _(laws, wall):
    found = thermal_of(laws.thermal, wall)
    return (found.accommodation > 0.0) & (found.energy > 0.0)
