"""Balls that wait at a wall: a law of the wall holds them for a time when a contact has ended.

A ball that is held neither moves nor turns, as if its mass were infinite: others meet a fixed sphere, and do no work
on it. Files and sums have the velocity and spin with which it leaves, so that its energy is counted all the time. It
leaves at the start of the first step that begins when its wait is over, or later.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..kernel.arrays import index
from ..kernel.jit import Array, outlined
from ..kernel.vector import ZERO, column, put, set_vector, vector_at
from . import grain_arrays as col

# The part of a step by which a step may begin before the end of a wait, and still counts as beginning at it.
_WHOLE = 1e-6


class Held(NamedTuple):
    """The held balls, by the numbers of particles."""

    until: Array  # (N,) the time at which each ball leaves [s], NaN if it is not held
    velocity: Array  # (3, N) the velocity with which it leaves [m/s]
    spin: Any  # (3, N) [rad/s], None where there is no friction
    mass: Array  # (N,) [kg]


def held_of(mass: Any, rubs: bool) -> Held:
    """Return a `Held` in which no ball is held."""
    n = len(mass)
    return Held(np.full(n, math.nan), np.zeros((3, n)), np.zeros((3, n)) if rubs else None, mass)


def velocity_of(held, grains, i):
    """The velocity of a ball, or the velocity with which it leaves if it is held."""
    one = index(grains.number[i])
    if held is not None and held.until[one] == held.until[one]:
        return column(held.velocity, 0, one)
    return vector_at(grains.speed, i, col.BEFORE)


def hold(held, grains, i, until):
    """Hold a ball from now on until a time [s]."""
    one, v = index(grains.number[i]), vector_at(grains.speed, i, col.BEFORE)
    held.until[one], grains.place[i, col.LIGHTNESS] = until, 0.0
    put(held.velocity, 0, one, v)
    set_vector(grains.speed, i, col.BEFORE, ZERO)
    if held.spin is not None:
        put(held.spin, 0, one, vector_at(grains.spin, i, col.BEFORE))
        set_vector(grains.spin, i, col.BEFORE, ZERO)


@outlined
def let_go(held, grains, now, h):
    """Release the balls that have waited until the start, `now` [s], of a step of the length h [s]."""
    for k in range(grains.number.size):
        i = index(k)
        one = index(grains.number[i])
        if held.until[one] <= now + _WHOLE * h:
            set_vector(grains.speed, i, col.BEFORE, velocity_of(held, grains, i))
            if held.spin is not None:
                set_vector(grains.spin, i, col.BEFORE, column(held.spin, 0, one))
            held.until[one], grains.place[i, col.LIGHTNESS] = math.nan, 1.0 / held.mass[one]
