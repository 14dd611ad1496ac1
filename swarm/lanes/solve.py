"""Solve for the unknown of every lane's contact: Newton's sweeps, within Uzawa's loop (8) where there are multipliers.

Each sweep is one loop over all lanes without branches; solved lanes stand still until the last one is solved.
"""

import numpy as np

from ..contact.impulse import LoopRecord
from ..contact.reflection import ReflectedVelocity
from ..contact.uzawa import ACCELERATION, BEFORE, GAIN, MEAN, MISS, MULTIPLIER, STORED, SWEEPS, UNCONVERGED
from ..kernel.arrays import kept
from ..kernel.jit import outlined, select
from ..kernel.vector import column, put
from ..methods import contract as methods


def solve(method, walls, gravity, multipliers, lanes, live):
    """Solve for the unknown of every contact, its multiplier if the method has one, and the velocity if it turns it."""
    if method.most_sweeps(walls) > 0:
        for i in range(live):
            here = lanes.faced(walls, i)
            lanes.kappa[i], lanes.unsolved[i] = method.guess(here, gravity, lanes.given(method, i), lanes.wall[i])
    if multipliers is not None:
        _begin_multipliers(method, walls, gravity, lanes, live)
    _newton(method, walls, gravity, multipliers, lanes, live)
    if multipliers is not None:
        _sweep_multipliers(multipliers, method, walls, gravity, lanes, live)
    # The velocity after the contact has its own loop: one loop with the rest of the contact would be too long.
    if method.turns:
        for i in range(live):
            turned = method.turn(lanes.faced(walls, i), gravity, lanes.given(method, i), lanes.wall[i], lanes.kappa[i])
            put(lanes.turned, 0, i, turned.v)
            lanes.turned[3, i] = turned.impulse


def solution(method, lanes, i):
    """Return the `Solution` of a lane, empty for contacts in closed form."""
    if method.solves is None:
        return methods.Solution(0.0, False, methods.NOT_TURNED)
    turned = methods.NOT_TURNED
    if method.turns:
        turned = ReflectedVelocity(column(lanes.turned, 0, i), lanes.turned[3, i])
    return methods.Solution(lanes.kappa[i], lanes.unsolved[i], turned)


def _newton(method, walls, gravity, multipliers, lanes, live):
    """Make sweeps of the inner solve, until the last lane is solved."""
    kappa, unsolved, record = lanes.kappa, lanes.unsolved, lanes.record
    for _sweep in range(method.most_sweeps(walls)):
        remaining = 0
        for i in range(live):
            going = unsolved[i]
            kappa[i], unsolved[i], found = method.improve(
                lanes.faced(walls, i), gravity, lanes.given(method, i), lanes.wall[i],
                methods.Solution(kept(kappa[i]), going, methods.NOT_TURNED), record[MULTIPLIER, i],
            )  # fmt: skip
            if multipliers is not None:
                record[MEAN, i] = select(going, found.mean, kept(record[MEAN, i]))
                record[STORED, i] = select(going, found.stored, kept(record[STORED, i]))
                record[GAIN, i] = select(going, found.gain, kept(record[GAIN, i]))
            remaining += unsolved[i]
        if remaining == 0:
            break


# --- Multipliers -----------------------------------------------------------------------------------------


def _begin_multipliers(method, walls, gravity, lanes, live):
    """Start the loop (8) of every lane that has a contact."""
    kappa, record = lanes.kappa, lanes.record
    for i in range(live):
        record[MULTIPLIER, i], kappa[i], record[ACCELERATION, i] = method.first_multiplier(
            lanes.faced(walls, i), gravity, lanes.given(method, i), lanes.wall[i], kappa[i]
        )
        lanes.sweeping[i] = lanes.unsolved[i]
        record[BEFORE, i], record[MISS, i] = np.nan, np.nan
        record[SWEEPS, i], record[STORED, i], record[UNCONVERGED, i] = 0.0, 0.0, 0.0


def _sweep_multipliers(multipliers, method, walls, gravity, lanes, live):
    """Make sweeps of the loop (8), until the last lane has converged."""
    for _sweep in range(method.multiplier_sweeps):
        if _update_multipliers(method, lanes, live) == 0:
            break
        _newton(method, walls, gravity, multipliers, lanes, live)
    for i in range(live):
        lanes.unsolved[i] = lanes.unsolved[i] | lanes.sweeping[i]


def _update_multipliers(method, lanes, live):
    """End a sweep of the loop (8); return the number of lanes that need another."""
    record, kappa, unsolved, sweeping = lanes.record, lanes.kappa, lanes.unsolved, lanes.sweeping
    remaining = 0
    for i in range(live):
        old = kept(record[MULTIPLIER, i])
        new, miss, more = method.next_multiplier(lanes.given(method, i), record[ACCELERATION, i], old,
            LoopRecord(record[MEAN, i], record[STORED, i], record[GAIN, i]),
            methods.Sweep(record[BEFORE, i], record[MISS, i]),
        )  # fmt: skip
        going = sweeping[i]
        record[BEFORE, i] = select(going, old, kept(record[BEFORE, i]))
        record[MISS, i] = select(going, miss, kept(record[MISS, i]))
        record[SWEEPS, i] += select(going, 1.0, 0.0)
        # A lane that the inner solve left unsolved goes to the careful way at once.
        going = going & more & (not unsolved[i])
        # The first Newton step for the new multiplier needs no evaluation.
        kappa[i] += select(going, record[GAIN, i] * (new - old), 0.0)
        record[MULTIPLIER, i] = select(going, new, old)
        unsolved[i] = unsolved[i] | going
        sweeping[i] = going
        remaining += going
    return remaining


@outlined
def count_sweeps(multipliers, lanes, live):
    """Add the records of the lanes that had a contact to their particles; do nothing without multipliers."""
    if multipliers is None:
        return
    record = lanes.record
    for i in range(live):
        if record[SWEEPS, i] > 0.0:
            particle = lanes.particle[i]
            multipliers.sweeps[particle] += np.int64(record[SWEEPS, i])
            multipliers.contacts[particle] += 1
            multipliers.unconverged[particle] += np.int64(record[UNCONVERGED, i])
            multipliers.stored_energy[particle] = max(multipliers.stored_energy[particle], record[STORED, i])
            record[SWEEPS, i] = 0.0


@outlined
def keep_failure(multipliers, lanes, i):
    """Keep the record of the lane that failed, for the message of the error."""
    if multipliers is None:
        return
    particle = lanes.particle[i]
    multipliers.sweeps[particle] = np.int64(lanes.record[SWEEPS, i])
    multipliers.stored_energy[particle] = lanes.record[STORED, i]
    multipliers.remaining[particle] = lanes.lane(i).remaining
