"""Balls that wait at a wall: a law of it holds them for a while where a contact has ended.

A ball that is held neither moves nor turns, as if its mass had no bound: what presses on it meets a fixed sphere, and
no work is done on it. Its velocity and spin are those with which it leaves, also in files and sums meanwhile, so that
its energy is there all the time. It leaves at the start of the first step that begins when its wait is over, or later.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..kernel.arrays import index
from ..kernel.jit import Array, outlined
from ..kernel.vector import ZERO, column, put
from . import grain_arrays as col
from .grain_arrays import set_vector, vector_at

# A step that begins so little of a step earlier begins then.
_WHOLE = 1e-6


class Held(NamedTuple):
    """Which balls are held, by the numbers of particles."""

    until: Array  # (N,) when each leaves [s], NaN where it is not held
    velocity: Array  # (3, N) with which it leaves [m/s]
    spin: Any  # (3, N) [rad/s], None where there is no friction
    mass: Array  # (N,) [kg]


def held_of(mass: Any, rubs: bool) -> Held:
    """No ball is held."""
    n = len(mass)
    return Held(np.full(n, math.nan), np.zeros((3, n)), np.zeros((3, n)) if rubs else None, mass)


def velocity_of(held, grains, i):
    """The velocity of a ball, or that with which it leaves."""
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
    """Let the balls go that leave before a step of a length [s] that begins now [s]."""
    for k in range(grains.number.size):
        i = index(k)
        one = index(grains.number[i])
        if held.until[one] <= now + _WHOLE * h:
            set_vector(grains.speed, i, col.BEFORE, velocity_of(held, grains, i))
            if held.spin is not None:
                set_vector(grains.spin, i, col.BEFORE, column(held.spin, 0, one))
            held.until[one], grains.place[i, col.LIGHTNESS] = math.nan, 1.0 / held.mass[one]
