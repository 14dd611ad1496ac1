"""All walls of a scene at once: the functions of one surface, folded over the chain of its walls.

Fields come before all other walls: whether a scene has one is the type of its chain.
"""

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

from ..kernel.jit import select
from ..kernel.vector import ZERO
from .surface import Surface


class Chain(NamedTuple):
    """The walls of a scene as nested pairs, ended by None: what is not there compiles to nothing."""

    first: Any
    rest: Any


class Field(NamedTuple):
    """The same with many walls of one kind in the place of the first: each of them has a number."""

    first: Any
    rest: Any


class Listed(Field):
    """A field of walls that are surfaces of their own: each has a row of what it gives."""


def linked(firsts: Iterable[Any], rest: Any = None, link: Any = Chain) -> Any:
    """A chain of these, in their order, and then the rest."""
    for first in reversed(list(firsts)):
        rest = link(first, rest)
    return rest


def chain_of(surfaces: Iterable[Surface]) -> Any:
    """The walls of `surfaces` as a chain, in their order."""
    return linked(wall for surface in surfaces for wall in surface.walls())


def each(chain):
    """The links of a chain, first to last: none of None. `link.first` is a wall, or in a `Field` many of them."""
    return () if chain is None else (chain, *each(chain.rest))


def count(members):
    """How many walls a field has."""
    return members.count()


def member(members, wall):
    """One of them, as a surface."""
    return members.wall(wall)


def length(chain):
    """How many rows there are of what walls give, one for a field: a constant for the compiler if none is `Listed`."""
    rows = (int(count(link.first)) if isinstance(link, Listed) else 1 for link in each(_walls(chain)))
    return sum(rows)


def row(chain, wall):
    """The row in which it is booked what this wall gives: a field has one."""
    chain = _walls(chain)
    if not isinstance(chain, Field) or isinstance(chain, Listed):
        return int(wall)
    many = count(chain.first)
    return select(wall < many, 0, 1 + row(chain.rest, wall - many))


def _walls(chain):
    """The chain of walls some of which move, or itself."""
    return getattr(chain, "walls", chain)


def others(chain):
    """The walls of a chain that are in no field: they come after all fields."""
    return others(chain.rest) if isinstance(chain, Field) else chain


def count_in_fields(chain):
    """How many walls its fields have."""
    return sum((count(link.first) for link in each(chain) if isinstance(link, Field)), 0.0)


# --- A function of one wall ------------------------------------------------------------------------------


def of_wall(name: Any, neutral: Any) -> Any:
    """The fold (chain, wall, ...) that is a method of the wall with this number.

    For any other number it is the method of the last wall: a caller that has no wall ignores the result. `neutral` is
    any value of the type of the result.
    """

    def fold(chain, wall, *given):
        if chain is None:
            return neutral
        if isinstance(chain, Field):
            many = count(chain.first)
            surface, here, other = member(chain.first, wall), wall < many, wall - many
        else:
            surface, here, other = chain.first, wall == 0.0, wall - 1.0
        value = asked(surface, *given)
        return value if chain.rest is None else select(here, value, fold(chain.rest, other, *given))

    def asked(surface, *given):
        if not isinstance(name, str):
            return name(surface, *given)
        found = getattr(surface, name)
        return found(*given) if callable(found) else found

    return fold


velocity = of_wall("velocity", ZERO)
acceleration = of_wall("acceleration", ZERO)
carry = of_wall("carry", ZERO)
mean_velocity = of_wall("mean_velocity", ZERO)
way = of_wall("way", ZERO)
unit_normal = of_wall("unit_normal", ZERO)
settle = of_wall("settle", ZERO)
flat = of_wall("flat", False)
distance = of_wall("distance", 0.0)
push = of_wall("push", ZERO)
inner_gradient = of_wall("inner_gradient", ZERO)
step_normal = of_wall("step_normal", ZERO)
outward_acceleration = of_wall("outward_acceleration", 0.0)
chord_guess = of_wall("chord_guess", 0.0)
chord_improve = of_wall("chord_improve", 0.0)
chord_normal = of_wall("chord_normal", ZERO)


# --- Of all walls ----------------------------------------------------------------------------------------


def shortest_pace(chain):
    """The shortest pace of all walls."""
    shortest = math.inf
    for link in reversed(each(chain)):
        shortest = min(link.first.pace(), shortest)
    return shortest


def chord_sweeps(chain):
    """The most steps of `chord_improve` that any wall takes: a constant for the compiler."""
    return max((0, *(link.first.chord_sweeps for link in each(chain))))


def outside(chain, wall, r):
    """Whether a point is outside any wall but this one (-1: any at all)."""
    found = False
    for link in each(chain):
        if isinstance(link, Field):
            found = link.first.is_in_another(wall, r) | found
            wall = wall - count(link.first)
        else:
            here = link.first.level_of(link.first.inner(r)) > 0.0
            found = (here & (wall != 0.0)) | found
            wall = wall - 1.0
    return found


def pushes(chain, wall, kappa):
    """Whether this wall can push with kappa: in its direction and short of the pole."""
    found = False
    for k, link in enumerate(each(chain)):
        farthest = link.first.farthest_push()
        here = (kappa == 0.0) | ((kappa * farthest > 0.0) & (abs(kappa) < abs(farthest)))
        found = ((wall == k) & here) | found
    return found


class Touched(NamedTuple):
    """The first wall that a step is in contact with, or -1, and how many there are."""

    wall: float
    number: float


def touched(chain, r, p):
    """The walls that a step with free displacement p is in contact with."""
    found = Touched(-1.0, 0.0)
    for link in reversed(each(chain)):
        before = link.first.level_of(link.first.inner(r))
        after = link.first.level_of(link.first.end_inner(r + p))
        contact = (before > 0.0) | (after > 0.0)
        later = select(found.number > 0.0, found.wall + 1.0, -1.0)
        found = Touched(select(contact, 0.0, later), found.number + select(contact, 1.0, 0.0))
    return found
