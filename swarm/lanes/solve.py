"""The unknown of every lane's contact: Newton's sweeps, and around them Uzawa's loop (8) where there are multipliers.

Each sweep is one loop over all lanes without branches; lanes that are solved stand still until the last one is.
"""

import numpy as np

from ..contact.uzawa import ACCELERATION, BEFORE, GAIN, MEAN, MISS, MULTIPLIER, STORED, SWEEPS, UNCONVERGED
from ..kernel.gravity import Nothing
from ..kernel.jit import by_type, inlined, kept, select
from ..methods import base as methods
from ..particles import Multipliers
from .arrays import K0, K1, LEFT, VX, VY, VZ, X, Y, Z


@by_type
def solve(unknown, method, chain, gravity, multipliers, lanes, live):
    """The contact's unknown of every lane, its multiplier where the method has one, and the velocity where it turns."""


@solve.register(object)
def _(unknown, method, chain, gravity, multipliers, lanes, live):
    rows, surface, kappa, unsolved = lanes.rows, lanes.surface, lanes.kappa, lanes.unsolved
    if methods.most_sweeps(method, chain) > 0:
        for i in range(live):
            kappa[i], unsolved[i] = methods.guess(
                method, chain, gravity,
                rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
                rows[LEFT, i], rows[K0, i], surface[i],
            )  # fmt: skip
    _begin_multipliers(multipliers, method, chain, gravity, lanes, live)
    _newton(method, chain, gravity, multipliers, lanes, live)
    _sweep_multipliers(multipliers, method, chain, gravity, lanes, live)
    # The velocity after the contact, where one loop with the rest of the contact would be too long.
    if methods.turns(method):
        turned = lanes.turned
        for i in range(live):
            turned[0, i], turned[1, i], turned[2, i], turned[3, i] = methods.turn(
                method, chain, gravity,
                rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
                rows[LEFT, i], rows[K0, i], rows[K1, i], surface[i], kappa[i],
            )  # fmt: skip


@solve.register(Nothing)
def _(unknown, method, chain, gravity, multipliers, lanes, live):
    pass


@by_type
def solution(unknown, method, lanes, i):
    """What `solve` left of a lane: the unknown, whether it is unsolved, velocity and impulse where the method turns."""
    raise NotImplementedError


@solution.register(object)
def _(unknown, method, lanes, i):
    tx, ty, tz, given = 0.0, 0.0, 0.0, 0.0
    if methods.turns(method):
        turned = lanes.turned
        tx, ty, tz, given = turned[0, i], turned[1, i], turned[2, i], turned[3, i]
    return lanes.kappa[i], lanes.unsolved[i], tx, ty, tz, given


@solution.register(Nothing)
def _(unknown, method, lanes, i):
    return 0.0, False, 0.0, 0.0, 0.0, 0.0


@by_type
def _begin_multipliers(multipliers, method, chain, gravity, lanes, live):
    """The start of the loop (8) of every lane that has a contact."""


@_begin_multipliers.register(Multipliers)
def _(multipliers, method, chain, gravity, lanes, live):
    rows, surface, kappa, record = lanes.rows, lanes.surface, lanes.kappa, lanes.record
    for i in range(live):
        record[MULTIPLIER, i], kappa[i], record[ACCELERATION, i] = methods.first_multiplier(
            method, chain, gravity,
            rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
            rows[LEFT, i], rows[K0, i], surface[i], kappa[i],
        )  # fmt: skip
        lanes.sweeping[i] = lanes.unsolved[i]
        record[BEFORE, i], record[MISS, i] = np.nan, np.nan
        record[SWEEPS, i], record[STORED, i], record[UNCONVERGED, i] = 0.0, 0.0, 0.0


@by_type
def _sweep_multipliers(multipliers, method, chain, gravity, lanes, live):
    """Sweeps of the loop (8), until the last lane has converged."""


@_sweep_multipliers.register(Multipliers)
def _(multipliers, method, chain, gravity, lanes, live):
    for _sweep in range(methods.multiplier_sweeps(method)):
        if _update_multipliers(method, lanes, live) == 0:
            break
        _newton(method, chain, gravity, multipliers, lanes, live)
    for i in range(live):
        lanes.unsolved[i] = lanes.unsolved[i] | lanes.sweeping[i]


@inlined
def _update_multipliers(method, lanes, live):
    """The end of a sweep of the loop (8): how many lanes need another."""
    rows, record, kappa, unsolved, sweeping = lanes.rows, lanes.record, lanes.kappa, lanes.unsolved, lanes.sweeping
    remaining = 0
    for i in range(live):
        old = kept(record[MULTIPLIER, i])
        new, miss, more = methods.next_multiplier(
            method,
            rows[LEFT, i],
            record[ACCELERATION, i],
            old,
            record[MEAN, i],
            record[STORED, i],
            record[BEFORE, i],
            record[MISS, i],
        )
        going = sweeping[i]
        record[BEFORE, i] = select(going, old, kept(record[BEFORE, i]))
        record[MISS, i] = select(going, miss, kept(record[MISS, i]))
        record[SWEEPS, i] += select(going, 1.0, 0.0)
        # What the inner solve left unsolved is for the careful way, at once.
        going = going & more & (not unsolved[i])
        # The first Newton step for the new multiplier needs no evaluation.
        kappa[i] += select(going, record[GAIN, i] * (new - old), 0.0)
        record[MULTIPLIER, i] = select(going, new, old)
        unsolved[i] = unsolved[i] | going
        sweeping[i] = going
        remaining += going
    return remaining


@inlined
def _newton(method, chain, gravity, multipliers, lanes, live):
    """Sweeps of the inner solve, until the last lane is solved."""
    rows, surface, kappa, unsolved = lanes.rows, lanes.surface, lanes.kappa, lanes.unsolved
    for _sweep in range(methods.most_sweeps(method, chain)):
        remaining = 0
        for i in range(live):
            going = unsolved[i]
            kappa[i], unsolved[i], mean, stored, gain = methods.improve(
                method, chain, gravity,
                rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
                rows[LEFT, i], rows[K0, i], surface[i], kept(kappa[i]), going, lanes.record[MULTIPLIER, i],
            )  # fmt: skip
            _record(multipliers, lanes.record, i, going, mean, stored, gain)
            remaining += unsolved[i]
        if remaining == 0:
            break


@by_type
def _record(multipliers, record, lane, going, mean, stored, gain):
    """What the loop (8) wants to know of a sweep of the inner solve."""


@_record.register(Multipliers)
def _(multipliers, record, lane, going, mean, stored, gain):
    record[MEAN, lane] = select(going, mean, kept(record[MEAN, lane]))
    record[STORED, lane] = select(going, stored, kept(record[STORED, lane]))
    record[GAIN, lane] = select(going, gain, kept(record[GAIN, lane]))
