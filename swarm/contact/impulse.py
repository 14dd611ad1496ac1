"""The impulse of one surface in one step with the composite discrete gradient: a scalar root.

With h the step, m the mass, D(r0, r1) the discrete gradient of the inner function q, lambda the multiplier and
    kappa = h^2/(2m) (V[g0, g1] + lambda Phi[g0, g1]) g[q0, q1]                              (K)
the step is  r1 = r0 + p - kappa D,  v1 = v0 + h G - (2 kappa/h) D,  p = h v0 + h^2 G/2.
The surface knows r1(kappa) in closed form (`push`), so (K) is one equation in one unknown. Without a multiplier its
right side is a convex, decreasing function of kappa, so Newton's method from the left climbs to the smallest root.
A multiplier is a float, or None where the method has none.
"""

import math

from ..kernel.gravity import Nothing
from ..kernel.jit import by_type, inlined, outlined, select
from ..surfaces import base as surfaces
from ..surfaces.chain import Chain
from . import regularisation as law_of

# A Newton step that moves the gap by this part of itself is the last: its square is below round-off. Within the loop of
# a multiplier its square need only be small, as the loop repairs the rest.
_NEWTON_TOLERANCE = 1e-8
_LOOP_TOLERANCE = 1e-2
# Steps of the vectorised solve; what needs more goes the careful way.
NEWTON_STEPS = 8
_CAREFUL_ITERATIONS = 200
# A push this near to its farthest has no root before it.
_NEAR = 1.0 - 1e-12
# Doublings of a bracket: from the smallest number to the largest.
_DOUBLINGS = 2100
_EPSILON = 2.220446049250313e-16
# A point whose coordinates would be on the surface within this part of themselves is on it.
_ON_SURFACE = 8.0 * _EPSILON
# What the equation asks of every wall, and its energy; multipliers ask for `gap_scale` too.
NEEDS = (
    surfaces.inner, surfaces.gap_of, surfaces.gap_slope, surfaces.gradient, surfaces.inner_gradient, surfaces.push,
    surfaces.rise, surfaces.farthest_push,
)  # fmt: skip


@inlined
def _residual(law, multiplier, surface, x, y, z, px, py, pz, c, q0, g0, round_off, kappa):
    """F(kappa), the left side of (K) less its right side, and its derivative; g1 and its derivative; g[q0, q1].

    c = h^2/(2m).
    """
    rise, drise = surfaces.rise(surface, x, y, z, px, py, pz, kappa)
    slope, dslope = surfaces.gap_slope(surface, q0, q0 + rise)
    # g1 - g0 = g[q0, q1] (q1 - q0)
    g1 = g0 + slope * rise
    g1 = select(abs(g1) <= round_off, 0.0, g1)
    force, dforce = law_of.force(multiplier, law, g0, g1)
    dg1 = drise * (slope + dslope * rise)
    return kappa - c * force * slope, 1.0 - c * (dforce * dg1 * slope + force * dslope * drise), g1, dg1, slope


@by_type
def start_gap(multiplier, surface, x, y, z, q0):
    """g0, the gap that counts as 0 (only multipliers tell 0 from round-off), and the tolerance of Newton's steps."""
    raise NotImplementedError


@start_gap.register(Nothing)
def _(multiplier, surface, x, y, z, q0):
    return surfaces.gap_of(surface, q0), 0.0, _NEWTON_TOLERANCE


@start_gap.register(float)
def _(multiplier, surface, x, y, z, q0):
    # In State I (g0 = 0) the loop (8) ends; from a g0 = -1e-17 it would end only down to g1 ~ 1e-16, then creep.
    g0 = surfaces.gap_of(surface, q0)
    round_off = _ON_SURFACE * surfaces.gap_scale(surface, x, y, z)
    return select(abs(g0) <= round_off, 0.0, g0), round_off, _LOOP_TOLERANCE


@by_type
def guess(chain, index, law, x, y, z, px, py, pz, c):
    """kappa of surface `index` if the wall were flat and the spring linear."""
    raise NotImplementedError


@guess.register(Chain)
def _(chain, index, law, x, y, z, px, py, pz, c):
    surface = chain.first
    q0 = surfaces.inner(surface, x, y, z)
    g0 = surfaces.gap_of(surface, q0)
    rise, drise = surfaces.rise(surface, x, y, z, px, py, pz, 0.0)
    slope, _dslope = surfaces.gap_slope(surface, q0, q0 + rise)
    gf = g0 + slope * rise
    # There g1 = gf - e kappa, and with C = c alpha/2 g[q0, q1] e equation (K) is one of
    #   entering (g0 <= 0):  (1 + C) g1^2 - (gf + g0) g1 + gf g0 = 0
    #   staying:             g1 = (gf - C g0)/(1 + C)
    #   leaving (g1 < 0):    g1^2 - (gf + g0) g1 + gf g0 - C g0^2 = 0
    e = -slope * drise
    stiff = 0.5 * c * slope * e * law_of.stiffness(law, select(g0 > gf, g0, gf))
    entering = g0 <= 0.0
    one = 1.0 + stiff
    inverse = 1.0 / one
    staying = (gf - stiff * g0) * inverse
    total = gf + g0
    square = select(entering, total * total - 4.0 * one * gf * g0, (gf - g0) * (gf - g0) + 4.0 * stiff * g0 * g0)
    root = math.sqrt(select(square > 0.0, square, 0.0))
    entered = 0.5 * (total + root) * inverse
    g1 = select(entering, entered, select(staying > 0.0, staying, 0.5 * (total - root)))
    other = guess(chain.rest, index - 1.0, law, x, y, z, px, py, pz, c)
    # Of a select between a quotient and a constant LLVM makes a branch, and the loop over lanes is not vectorised.
    here = index == 0.0
    return select(here, gf - g1, other) / select(here, e, 1.0)


@guess.register(Nothing)
def _(chain, index, law, x, y, z, px, py, pz, c):
    return 0.0


@by_type
def improve(chain, index, law, multiplier, x, y, z, px, py, pz, c, kappa):
    """The Newton step of kappa for surface `index`, whether it was so large that another is needed, and `_told`.

    What must be small is the step of the gap g1, relative to the gap whose square is the energy: in a stiff wall g1 is
    a small difference, and a kappa right to 1e-12 can leave an energy wrong by 1e-8.
    """
    raise NotImplementedError


@improve.register(Chain)
def _(chain, index, law, multiplier, x, y, z, px, py, pz, c, kappa):
    surface = chain.first
    q0 = surfaces.inner(surface, x, y, z)
    g0, round_off, tolerance = start_gap(multiplier, surface, x, y, z, q0)
    f, df, g1, dg1, slope = _residual(law, multiplier, surface, x, y, z, px, py, pz, c, q0, g0, round_off, kappa)
    step = f / df
    depth = select(g0 > abs(g1), g0, abs(g1))
    # True for NaN.
    more = not (abs(step * dg1) <= tolerance * depth + 2.0 * round_off)
    mean, stored, gain = _told(multiplier, law, g0, g1, g1 - step * dg1, c * slope / df)
    other, other_more, other_mean, other_stored, other_gain = improve(
        chain.rest, index - 1.0, law, multiplier, x, y, z, px, py, pz, c, kappa
    )
    here = index == 0.0
    return (
        select(here, step, other),
        (here & more) | ((not here) & other_more),
        select(here, mean, other_mean),
        select(here, stored, other_stored),
        select(here, gain, other_gain),
    )


@improve.register(Nothing)
def _(chain, index, law, multiplier, x, y, z, px, py, pz, c, kappa):
    return 0.0, False, 0.0, 0.0, 0.0


@by_type
def _told(multiplier, law, g0, g1, g, factor):
    """What the loop of a multiplier asks of the step that ends at gap g: (Phi0 + Phi1)/2, V1, and dkappa/dlambda.

    It is dkappa/dlambda = c Phi[g0, g1] g[q0, q1]/F'(kappa); `factor` is that without Phi[g0, g1].
    """
    raise NotImplementedError


@_told.register(Nothing)
def _(multiplier, law, g0, g1, g, factor):
    return 0.0, 0.0, 0.0


@_told.register(float)
def _(multiplier, law, g0, g1, g, factor):
    slope, _curvature = law_of.constraint_slope(law, g0, g1)
    mean = 0.5 * (law_of.constraint(law, g0) + law_of.constraint(law, g))
    return mean, law_of.stored_energy(law, g), factor * slope


@inlined
def end_gap(surface, x, y, z, px, py, pz, q0, g0, round_off, kappa):
    """g1 of the step that is pushed with kappa, from g1 - g0: more digits of a small g1 than r1 has."""
    rise, _drise = surfaces.rise(surface, x, y, z, px, py, pz, kappa)
    slope, _dslope = surfaces.gap_slope(surface, q0, q0 + rise)
    g1 = g0 + slope * rise
    return select(abs(g1) <= round_off, 0.0, g1)


@outlined
def careful(law, multiplier, surface, x, y, z, px, py, pz, c):
    """kappa of one surface by Newton's method inside a bracket, and whether it was found."""
    q0 = surfaces.inner(surface, x, y, z)
    g0, round_off, _tolerance = start_gap(multiplier, surface, x, y, z, q0)
    f, df, _g, _dg, _slope = _residual(law, multiplier, surface, x, y, z, px, py, pz, c, q0, g0, round_off, 0.0)
    if f == 0.0:
        return 0.0, True
    # A cavity pushes with kappa > 0, a solid with kappa < 0: `sign` mirrors it.
    sign = -1.0 if f > 0.0 else 1.0
    first = _first_push(multiplier, abs(f), df)
    low, high, found = _bracket(law, multiplier, surface, x, y, z, px, py, pz, c, q0, g0, round_off, sign, first)
    if not found:
        return sign * low, False
    k, previous = low, math.inf
    for _i in range(_CAREFUL_ITERATIONS):
        f, df, _g, _dg, _slope = _residual(
            law, multiplier, surface, x, y, z, px, py, pz, c, q0, g0, round_off, sign * k
        )
        f = sign * f
        if f == 0.0 or not abs(f) < math.inf:
            return sign * k, f == 0.0
        if f < 0.0:
            low = k
        else:
            high = k
        trial = k - f / df
        # Newton's steps that do not shrink have reached the noise of g1: halving the bracket ends.
        if not (low < trial < high and abs(trial - k) <= 0.5 * previous):
            trial = 0.5 * (low + high)
        previous = abs(trial - k)
        if previous <= 2.0 * _EPSILON * trial or high - low <= 2.0 * _EPSILON * high:
            return sign * trial, True
        k = trial
    return sign * k, False


@by_type
def _first_push(multiplier, size, df):
    """Where to look for the root first, from |F(0)| and F'(0)."""
    raise NotImplementedError


@_first_push.register(Nothing)
def _(multiplier, size, df):
    # Newton's first step, which does not pass the root where the right side of (K) is convex. From its value at 0,
    # which is past the root of a falling g1, the bracket held the largest of three roots in a step across a long
    # ellipsoid, where g1 falls and rises again.
    return size / df if 1.0 < df < math.inf else size


@_first_push.register(float)
def _(multiplier, size, df):
    # The right side of (K) jumps where a multiplier lets go; Newton's step is no guide to that.
    return size


@outlined
def _bracket(law, multiplier, surface, x, y, z, px, py, pz, c, q0, g0, round_off, sign, first):
    """Two sizes of kappa with F < 0 and F >= 0, the latter `first` doubled some times, and whether they were found."""
    # Doubling from below meets the smallest root first, and it ends: (K) has F > 0 both far out and before the pole.
    farthest = abs(surfaces.farthest_push(surface))
    low, high = 0.0, min(first, 0.5 * farthest)
    for _i in range(_DOUBLINGS):
        f, _df, _g, _dg, _slope = _residual(
            law, multiplier, surface, x, y, z, px, py, pz, c, q0, g0, round_off, sign * high
        )
        if not abs(f) < math.inf:
            # A push that is not defined so far.
            farthest = high
            high = 0.5 * (low + high)
        elif sign * f >= 0.0:
            return low, high, True
        elif high >= _NEAR * farthest:
            break
        else:
            low, high = high, min(2.0 * high, 0.5 * (high + farthest))
    return low, high, False
