"""All walls of a scene at once: the functions of one surface, folded over the chain of its walls.

A fold ends at None, and its neutral element (no hit, no gap) is a constant that the compiler removes. Fields come
before all other walls: whether a scene has one is the type of its chain.
"""

import inspect
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ..kernel.gravity import Nothing
from ..kernel.jit import by_type, select
from ..kernel.vector import ZERO
from . import contract
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


def chain_of(surfaces: Sequence[Surface]) -> Chain | None:
    """The walls of `surfaces` as a chain, in their order."""
    chain = None
    for wall in reversed([wall for surface in surfaces for wall in surface.walls()]):
        chain = Chain(wall, chain)
    return chain


def each(chain):
    """The links of a chain, first to last: none of None. `link.first` is a wall, or in a `Field` many of them."""
    return () if chain is None else (chain, *each(chain.rest))


@by_type
def is_end(chain):
    """Whether there are no walls: a constant for the compiler."""
    return False


is_end.register(Nothing, lambda chain: True)


@by_type
def length(chain):
    """How many rows there are of what walls give, one for a field: a constant for the compiler if none is `Listed`."""
    raise NotImplementedError


length.register(Chain, lambda chain: 1 + length(chain.rest))
length.register(Field, lambda chain: 1 + length(chain.rest))
length.register(Listed, lambda chain: int(count(chain.first)) + length(chain.rest))
length.register(Nothing, lambda chain: 0)


@by_type
def count(members):
    """How many walls a field has."""
    raise NotImplementedError


@by_type
def member(members, wall):
    """One of them, as a surface."""
    raise NotImplementedError


@by_type
def outside_of_any(members, wall, r):
    """Whether a point is in any body of a field but the one with this number."""
    raise NotImplementedError


@by_type
def others(chain):
    """The walls of a chain that are in no field: they come after all fields."""
    return chain


others.register(Field, lambda chain: others(chain.rest))


@by_type
def count_in_fields(chain):
    """How many walls its fields have."""
    return 0.0


count_in_fields.register(Field, lambda chain: count(chain.first) + count_in_fields(chain.rest))


@by_type
def row(chain, wall):
    """The row in which it is booked what this wall gives: a field has one."""
    return int(wall)


@row.register(Field)
def _(chain, wall):
    return select(wall < count(chain.first), 0, 1 + row(chain.rest, wall - count(chain.first)))


row.register(Listed, lambda chain, wall: int(wall))


@by_type
def shortest_pace(chain):
    """The shortest pace of all walls."""
    return math.inf


@shortest_pace.register(Chain)
@shortest_pace.register(Field)
def _(chain):
    return min(contract.pace(chain.first), shortest_pace(chain.rest))


# --- A function of one wall ------------------------------------------------------------------------------


def of_wall(function: Callable[..., Any], neutral: Any) -> Any:
    """The fold (chain, wall, ...) that is function(surface, ...) of the wall with this number.

    For any other number it is the function of the last wall: a caller that has no wall ignores the result. `neutral` is
    any value of the type of the result.
    """
    count = len(inspect.signature(function).parameters) - 1
    return {0: _of_wall_0, 1: _of_wall_1, 2: _of_wall_2, 3: _of_wall_3, 4: _of_wall_4}[count](function, neutral)


# One factory for each number of arguments: with one for `*rest` an impact with chords takes 10 % longer to compile.
def _of_wall_0(function: Any, neutral: Any) -> Any:
    @by_type
    def fold(chain, wall):
        raise NotImplementedError

    @fold.register(Chain)
    def _(chain, wall):
        here = (wall == 0.0) | (length(chain) == 1)
        return select(here, function(chain.first), fold(chain.rest, wall - 1.0))

    @fold.register(Field)
    def _(chain, wall):
        here = (wall < count(chain.first)) | (is_end(chain.rest))
        other = fold(chain.rest, wall - count(chain.first))
        return select(here, function(member(chain.first, wall)), other)

    fold.register(Nothing, lambda chain, wall: neutral)

    return fold


def _of_wall_1(function: Any, neutral: Any) -> Any:
    @by_type
    def fold(chain, wall, a):
        raise NotImplementedError

    @fold.register(Chain)
    def _(chain, wall, a):
        here = (wall == 0.0) | (length(chain) == 1)
        return select(here, function(chain.first, a), fold(chain.rest, wall - 1.0, a))

    @fold.register(Field)
    def _(chain, wall, a):
        here = (wall < count(chain.first)) | (is_end(chain.rest))
        other = fold(chain.rest, wall - count(chain.first), a)
        return select(here, function(member(chain.first, wall), a), other)

    fold.register(Nothing, lambda chain, wall, a: neutral)

    return fold


def _of_wall_2(function: Any, neutral: Any) -> Any:
    @by_type
    def fold(chain, wall, a, b):
        raise NotImplementedError

    @fold.register(Chain)
    def _(chain, wall, a, b):
        here = (wall == 0.0) | (length(chain) == 1)
        return select(here, function(chain.first, a, b), fold(chain.rest, wall - 1.0, a, b))

    @fold.register(Field)
    def _(chain, wall, a, b):
        here = (wall < count(chain.first)) | (is_end(chain.rest))
        other = fold(chain.rest, wall - count(chain.first), a, b)
        return select(here, function(member(chain.first, wall), a, b), other)

    fold.register(Nothing, lambda chain, wall, a, b: neutral)

    return fold


def _of_wall_3(function: Any, neutral: Any) -> Any:
    @by_type
    def fold(chain, wall, a, b, c):
        raise NotImplementedError

    @fold.register(Chain)
    def _(chain, wall, a, b, c):
        here = (wall == 0.0) | (length(chain) == 1)
        return select(here, function(chain.first, a, b, c), fold(chain.rest, wall - 1.0, a, b, c))

    @fold.register(Field)
    def _(chain, wall, a, b, c):
        here = (wall < count(chain.first)) | (is_end(chain.rest))
        other = fold(chain.rest, wall - count(chain.first), a, b, c)
        return select(here, function(member(chain.first, wall), a, b, c), other)

    fold.register(Nothing, lambda chain, wall, a, b, c: neutral)

    return fold


def _of_wall_4(function: Any, neutral: Any) -> Any:
    @by_type
    def fold(chain, wall, a, b, c, d):
        raise NotImplementedError

    @fold.register(Chain)
    def _(chain, wall, a, b, c, d):
        here = (wall == 0.0) | (length(chain) == 1)
        return select(here, function(chain.first, a, b, c, d), fold(chain.rest, wall - 1.0, a, b, c, d))

    @fold.register(Field)
    def _(chain, wall, a, b, c, d):
        here = (wall < count(chain.first)) | (is_end(chain.rest))
        other = fold(chain.rest, wall - count(chain.first), a, b, c, d)
        return select(here, function(member(chain.first, wall), a, b, c, d), other)

    fold.register(Nothing, lambda chain, wall, a, b, c, d: neutral)

    return fold


velocity = of_wall(contract.velocity, ZERO)
acceleration = of_wall(contract.acceleration, ZERO)
carry = of_wall(contract.carry, ZERO)
mean_velocity = of_wall(contract.mean_velocity, ZERO)
way = of_wall(contract.way, ZERO)
unit_normal = of_wall(contract.unit_normal, ZERO)
settle = of_wall(contract.settle, ZERO)
flat = of_wall(contract.flat, False)
distance = of_wall(contract.distance, 0.0)
push = of_wall(contract.push, ZERO)
inner_gradient = of_wall(contract.inner_gradient, ZERO)
step_normal = of_wall(contract.step_normal, ZERO)
outward_acceleration = of_wall(contract.outward_acceleration, 0.0)
chord_guess = of_wall(contract.chord_guess, 0.0)
chord_improve = of_wall(contract.chord_improve, 0.0)
chord_normal = of_wall(contract.chord_normal, ZERO)


# --- Of all walls ----------------------------------------------------------------------------------------


@by_type
def chord_sweeps(chain):
    """The most steps of `chord_improve` that any wall takes: a constant for the compiler."""
    raise NotImplementedError


chord_sweeps.register(Chain, lambda chain: max(contract.chord_sweeps(chain.first), chord_sweeps(chain.rest)))
chord_sweeps.register(Nothing, lambda chain: 0)


@by_type
def outside(chain, wall, r):
    """Whether a point is outside any wall but this one (-1: any at all)."""
    raise NotImplementedError


@outside.register(Chain)
def _(chain, wall, r):
    here = contract.level_of(chain.first, contract.inner(chain.first, r)) > 0.0
    return (here & (wall != 0.0)) | outside(chain.rest, wall - 1.0, r)


@outside.register(Field)
def _(chain, wall, r):
    return outside_of_any(chain.first, wall, r) | outside(chain.rest, wall - count(chain.first), r)


outside.register(Nothing, lambda chain, wall, r: False)


@by_type
def pushes(chain, wall, kappa):
    """Whether this wall can push with kappa: in its direction and short of the pole."""
    raise NotImplementedError


@pushes.register(Chain)
def _(chain, wall, kappa):
    farthest = contract.farthest_push(chain.first)
    here = (kappa == 0.0) | ((kappa * farthest > 0.0) & (abs(kappa) < abs(farthest)))
    other = pushes(chain.rest, wall - 1.0, kappa)
    return ((wall == 0.0) & here) | ((wall != 0.0) & other)


pushes.register(Nothing, lambda chain, wall, kappa: False)


class Touched(NamedTuple):
    """The first wall that a step is in contact with, or -1, and how many there are."""

    wall: float
    number: float


@by_type
def touched(chain, r, p):
    """The walls that a step with free displacement p is in contact with."""
    raise NotImplementedError


@touched.register(Chain)
def _(chain, r, p):
    surface = chain.first
    before = contract.level_of(surface, contract.inner(surface, r))
    after = contract.level_of(surface, contract.end_inner(surface, r + p))
    contact = (before > 0.0) | (after > 0.0)
    rest = touched(chain.rest, r, p)
    later = select(rest.number > 0.0, rest.wall + 1.0, -1.0)
    return Touched(select(contact, 0.0, later), rest.number + select(contact, 1.0, 0.0))


touched.register(Nothing, lambda chain, r, p: Touched(-1.0, 0.0))
