"""Uzawa's loop (8): multipliers that take the stored energy of a step to zero.

    repeat
        solve the step (7) with the multipliers held             [corner.hold, or one lane's equation (K)]
        stop when V = sum of alpha Phi1^2/2 <= tolerance
        lambda <- lambda + alpha (Phi0 + Phi1)/2                                             (8)
Where the loop converges it does so linearly, as (8) is a relaxation with fixed weight. Two accelerations with the
same fixed point: a secant in the place of (8) (Aitken), and a start from the multiplier of the converged reflection.
Source: García Orden & Ortega 2007, eqs. (7), (8).
"""

import math
from typing import Any

import numpy as np

from ..kernel.arrays import scratch
from ..kernel.jit import outlined, select
from ..kernel.record import Record
from ..kernel.vector import Vec
from . import corner, impulse

# The `acceleration`: (8) itself, the secant, or the secant started from the multiplier of the reflection.
PLAIN, SECANT, REFLECTION = 0.0, 1.0, 2.0
# Rows of the record that a lane keeps of its loop: lambda now; (Phi0 + Phi1)/2, V and dkappa/dlambda of its step;
# lambda and the miss of the sweep before; the sweeps; whether the step was accepted above the tolerance; the
# acceleration.
MULTIPLIER, MEAN, STORED, GAIN, BEFORE, MISS, SWEEPS, UNCONVERGED, ACCELERATION, RECORDS = range(10)
# The secant stops this fraction short: beyond the last multiplier the step equation has no root.
_SHORT = 1e-3
# Newton steps of the chord that starts the loop: it need not be exact.
_CHORD_STEPS = 3


def next_multiplier(acceleration, multiplier, miss, multiplier_before, miss_before):
    """Return lambda after a sweep with the miss alpha (Phi0 + Phi1)/2: by (8), or by the secant of the last two."""
    # NaN in the first sweep, below 1 or infinite if the miss does not fall: then (8).
    stretch = (multiplier - multiplier_before) / (miss_before - miss)
    use = (acceleration > PLAIN) & (stretch >= 1.0) & (stretch < math.inf)
    return multiplier + miss * select(use, stretch * (1.0 - _SHORT), 1.0)


def has_limit(surface, law, r):
    """Whether the loop has a limit: State I with Phi'(0) > 0.

    Otherwise a secant could take lambda so far that V <= tolerance, while the energy still misses lambda Phi1.
    """
    return (impulse.start_of(0.0, surface, r).gap == 0.0) & (law.constraint_gradient(0.0) > 0.0)


def is_outside(surface, r):
    """Whether a point is outside of a surface, by more than round-off."""
    return impulse.start_of(0.0, surface, r).gap > 0.0


def multiplier_of(surface, law, r, c, kappa):
    """Return lambda from (K) with g0 = g1 = 0, kappa = c lambda Phi'(0) g'(q0); 0 away from the wall."""
    start = impulse.start_of(0.0, surface, r)
    slope, _curvature = surface.gap_slope(start.q, start.q)
    return select(start.gap == 0.0, kappa / (c * slope * law.constraint_gradient(0.0)), 0.0)


def reflection(walls, wall, law, step):
    """Return kappa and lambda of the step that ends on a wall: the fixed point of (8) in State I with a = 1."""
    kappa = walls.chord_guess(wall, step.r, step.p)
    for _i in range(_CHORD_STEPS):
        kappa = kappa - walls.chord_improve(wall, step.r, step.p, kappa)
    multiplier = walls.of(wall, 0.0, multiplier_of, law, step.r, step.c, kappa)
    good = (multiplier > 0.0) & (multiplier < math.inf)
    return select(good, kappa, 0.0), select(good, multiplier, 0.0)


def meets_later(walls, wall, law, r, p):
    """Whether the free flight from r to r + p ends outside of another wall that the particle is not on (State II)."""
    found = False
    for k, other in enumerate(walls.each):
        leaves = other.level_of(other.inner(r + p)) > 0.0
        found = found | (leaves & (wall != float(k)) & (not has_limit(other, law, r)))
    return found


class LastSweep(Record):
    """The multipliers and misses of the last sweep, for the secant: one entry for each wall."""

    multipliers: Any
    misses: Any


class UzawaSweep(Record):
    """The step of one sweep: its end, V at the end, and whether it was solved."""

    r: Vec
    stored: float
    solved: bool


class Loop(Record):
    """The step of the last sweep, the number of sweeps, and whether they converged."""

    r: Vec
    sweeps: int
    stored: float  # V
    solved: bool
    converged: bool  # whether V <= tolerance


@outlined
def sweep_all(method, law, walls, step, multipliers, before, sweep, reactions):
    """Make one sweep of (8) for all walls; return its `UzawaSweep`; update `multipliers` and `before` in place."""
    count = multipliers.shape[0]
    end = corner.hold(method.form, law, multipliers, walls, step, reactions)
    first, last = scratch(count, np.float64), reactions[:, 3]
    corner.constraints(walls, law, step.r, first)
    stored = 0.0
    for k in range(count):
        stored += 0.5 * law.alpha * last[k] * last[k]
        miss = 0.5 * law.alpha * (first[k] + last[k])
        old = multipliers[k]
        acceleration = method.acceleration if walls.of(float(k), False, has_limit, law, step.r) else PLAIN
        if sweep == 0:
            multipliers[k] = old + miss
        else:
            multipliers[k] = next_multiplier(acceleration, old, miss, before.multipliers[k], before.misses[k])
        before.multipliers[k], before.misses[k] = old, miss
    return UzawaSweep(end.r, stored, end.solved)


@outlined
def start(method, law, walls, step, multipliers):
    """Set the multipliers from which the loop starts."""
    multipliers[:] = 0.0
    touched = walls.touched(step.r, step.p)
    if method.acceleration == REFLECTION and touched.number == 1.0:
        _kappa, multiplier = reflection(walls, touched.wall, law, step)
        multipliers[int(touched.wall)] = multiplier


@outlined
def loop(method, law, walls, step, reactions):
    """Repeat sweeps until V <= tolerance; return the `Loop` with the step of the last sweep."""
    count = walls.length()
    multipliers = scratch(count, np.float64)
    before = LastSweep(scratch(count, np.float64), scratch(count, np.float64))
    start(method, law, walls, step, multipliers)
    end = UzawaSweep(step.r, math.inf, True)
    for sweep in range(method.max_sweeps):
        end = sweep_all(method, law, walls, step, multipliers, before, sweep, reactions)
        converged = end.solved and end.stored <= method.tolerance
        if converged or not end.solved:
            return Loop(end.r, sweep + 1, end.stored, end.solved, converged)
    return Loop(end.r, method.max_sweeps, end.stored, True, False)
