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

import numpy as np

from ..kernel.gravity import Nothing
from ..kernel.jit import by_type, inlined, outlined, scratch, select
from ..surfaces import base as surfaces
from ..surfaces import chain as walls
from . import corner, impulse
from . import regularisation as law_of

# How the multiplier is updated and started: (8) itself, the secant, or the secant from the reflection's multiplier.
PLAIN, SECANT, REFLECTION = 0.0, 1.0, 2.0
# Rows of the record that a lane keeps of its loop: lambda now; (Phi0 + Phi1)/2, V and dkappa/dlambda of its step;
# lambda and the miss of the sweep before; the sweeps; whether the step was accepted above the tolerance; the
# acceleration.
MULTIPLIER, MEAN, STORED, GAIN, BEFORE, MISS, SWEEPS, UNCONVERGED, ACCELERATION, RECORDS = range(10)
# The secant stops this part short: beyond the last multiplier the step equation has no root.
_SHORT = 1e-3
# Newton steps of the chord that starts the loop: it need not be exact.
_CHORD_STEPS = 3


@inlined
def next_multiplier(acceleration, multiplier, miss, multiplier_before, miss_before):
    """lambda after a sweep that missed by alpha Phi_mean: (8), or the secant through the last two sweeps."""
    # NaN before the second sweep, and where the miss does not fall: then (8).
    stretch = (multiplier - multiplier_before) / (miss_before - miss)
    use = (acceleration > PLAIN) & (stretch >= 1.0) & (stretch < math.inf)
    return multiplier + miss * select(use, stretch * (1.0 - _SHORT), 1.0)


@inlined
def reflection(chain, index, law, x, y, z, px, py, pz, c):
    """kappa and lambda of the step that ends on surface `index`: the fixed point of (8) in State I with a = 1."""
    kappa = walls.chord_guess(chain, index, x, y, z, px, py, pz)
    for _i in range(_CHORD_STEPS):
        kappa = kappa - walls.chord_improve(chain, index, x, y, z, px, py, pz, kappa)
    multiplier = multiplier_of(chain, index, law, x, y, z, c, kappa)
    good = (multiplier > 0.0) & (multiplier < math.inf)
    return select(good, kappa, 0.0), select(good, multiplier, 0.0)


@by_type
def has_limit(chain, index, law, x, y, z):
    """Whether the loop has a limit for surface `index`: State I with Phi'(0) > 0.

    Elsewhere a secant could take lambda so far that V <= tolerance, while the energy still misses lambda Phi1.
    """
    raise NotImplementedError


@has_limit.register(walls.Chain)
def _(chain, index, law, x, y, z):
    surface = chain.first
    g0, _round_off, _tolerance = impulse.start_gap(0.0, surface, x, y, z, surfaces.inner(surface, x, y, z))
    here = (g0 == 0.0) & (law_of.constraint_gradient(law, 0.0) > 0.0)
    other = has_limit(chain.rest, index - 1.0, law, x, y, z)
    return ((index == 0.0) & here) | ((index != 0.0) & other)


@has_limit.register(Nothing)
def _(chain, index, law, x, y, z):
    return False


@by_type
def meets_later(chain, index, law, x, y, z, px, py, pz):
    """Whether the free flight r0 + p leaves any wall but `index` on which the particle is not yet: a State II."""
    raise NotImplementedError


@meets_later.register(walls.Chain)
def _(chain, index, law, x, y, z, px, py, pz):
    surface = chain.first
    leaves = surfaces.level_of(surface, surfaces.inner(surface, x + px, y + py, z + pz)) > 0.0
    here = leaves & (index != 0.0) & (not has_limit(chain, 0.0, law, x, y, z))
    return here | meets_later(chain.rest, index - 1.0, law, x, y, z, px, py, pz)


@meets_later.register(Nothing)
def _(chain, index, law, x, y, z, px, py, pz):
    return False


@by_type
def multiplier_of(chain, index, law, x, y, z, c, kappa):
    """lambda from (K) with g0 = g1 = 0, kappa = c lambda Phi'(0) g'(q0); 0 away from the surface."""
    raise NotImplementedError


@multiplier_of.register(walls.Chain)
def _(chain, index, law, x, y, z, c, kappa):
    surface = chain.first
    q0 = surfaces.inner(surface, x, y, z)
    g0, _round_off, _tolerance = impulse.start_gap(kappa, surface, x, y, z, q0)
    slope, _curvature = surfaces.gap_slope(surface, q0, q0)
    multiplier = kappa / (c * slope * law_of.constraint_gradient(law, 0.0))
    other = multiplier_of(chain.rest, index - 1.0, law, x, y, z, c, kappa)
    return select(index == 0.0, select(g0 == 0.0, multiplier, 0.0), other)


@multiplier_of.register(Nothing)
def _(chain, index, law, x, y, z, c, kappa):
    return 0.0


@outlined
def sweep_all(method, law, chain, x, y, z, px, py, pz, c, multipliers, before, misses, sweep, reactions):
    """One sweep of (8) for all walls: the step, then the multipliers in place: (x1, y1, z1, V, solved).

    `before` and `misses` (walls,) keep the last sweep for the secant. `multipliers` end as the ones of the next sweep.
    """
    count = multipliers.shape[0]
    x1, y1, z1, solved = corner.hold(method.form, law, multipliers, chain, x, y, z, px, py, pz, c, reactions)
    first, last = scratch(count, np.float64), reactions[:, 3]
    corner.constraints(chain, law, 0, x, y, z, first)
    stored = 0.0
    for k in range(count):
        stored += 0.5 * law.alpha * last[k] * last[k]
        miss = 0.5 * law.alpha * (first[k] + last[k])
        old = multipliers[k]
        acceleration = method.acceleration if has_limit(chain, float(k), law, x, y, z) else PLAIN
        if sweep == 0:
            multipliers[k] = old + miss
        else:
            multipliers[k] = next_multiplier(acceleration, old, miss, before[k], misses[k])
        before[k], misses[k] = old, miss
    return x1, y1, z1, stored, solved


@outlined
def start(method, law, chain, x, y, z, px, py, pz, c, multipliers):
    """The multipliers that the loop starts from."""
    multipliers[:] = 0.0
    index, count = walls.touched(chain, x, y, z, px, py, pz)
    if method.acceleration == REFLECTION and count == 1.0:
        _kappa, multiplier = reflection(chain, index, law, x, y, z, px, py, pz, c)
        multipliers[int(index)] = multiplier


@outlined
def loop(method, law, chain, x, y, z, px, py, pz, c, reactions):
    """Sweeps until V <= tolerance: (x1, y1, z1, sweeps, V, solved, converged)."""
    count = walls.length(chain)
    multipliers, before = scratch(count, np.float64), scratch(count, np.float64)
    misses = scratch(count, np.float64)
    start(method, law, chain, x, y, z, px, py, pz, c, multipliers)
    x1, y1, z1, stored = x, y, z, math.inf
    for sweep in range(method.max_sweeps):
        x1, y1, z1, stored, solved = sweep_all(
            method, law, chain, x, y, z, px, py, pz, c, multipliers, before, misses, sweep, reactions
        )
        if not solved:
            return x1, y1, z1, sweep + 1, stored, False, False
        if stored <= method.tolerance:
            return x1, y1, z1, sweep + 1, stored, True, True
    return x1, y1, z1, method.max_sweeps, stored, True, False
