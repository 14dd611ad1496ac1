"""The impulse of one surface in one step of the penalty method: a scalar root.

With h the step, m the mass, D(r0, r1) the discrete gradient of the inner function q and
    kappa = h^2/(2m) V[g0, g1] g[q0, q1]                                                     (K)
the step is  r1 = r0 + p - kappa D,  v1 = v0 + h G - (2 kappa/h) D,  p = h v0 + h^2 G/2.
The surface knows r1(kappa) in closed form (`push`), so (K) is one equation in one unknown. Its right side is a
convex, decreasing function of kappa, so Newton's method from the left climbs to the smallest root.
"""

import math

from .._jit import by_type, inlined, outlined, select
from ..gravity import Nothing
from ..surfaces import base as surfaces
from ..surfaces.chain import Chain
from . import regularisation as law_of

# A Newton step this small, relative to kappa, is the last: its square is below round-off.
_NEWTON_TOLERANCE = 1e-7
# Steps of the vectorised solve; what needs more goes the careful way.
NEWTON_STEPS = 8
_CAREFUL_ITERATIONS = 200
_EPSILON = 2.220446049250313e-16


@inlined
def _residual(law, surface, x, y, z, px, py, pz, c, q0, g0, kappa):
    """F(kappa) = kappa - c V[g0, g1] g[q0, q1] and its derivative, c = h^2/(2m)."""
    q1, dq1 = surfaces.pushed(surface, x, y, z, px, py, pz, kappa)
    slope, dslope = surfaces.gap_slope(surface, q0, q1)
    g1 = surfaces.gap_of(surface, q1)
    force, dforce = law_of.energy_slope(law, g0, g1)
    # dg1/dq1 from g1 - g0 = g[q0, q1] (q1 - q0)
    dg1 = slope + dslope * (q1 - q0)
    return kappa - c * force * slope, 1.0 - c * dq1 * (dforce * dg1 * slope + force * dslope)


@by_type
def guess(chain, index, law, x, y, z, px, py, pz, c):
    """kappa of surface `index` if the wall were flat and the spring linear."""
    raise NotImplementedError


@guess.register(Chain)
def _(chain, index, law, x, y, z, px, py, pz, c):
    surface = chain.first
    q0 = surfaces.inner(surface, x, y, z)
    g0 = surfaces.gap_of(surface, q0)
    qf, dqf = surfaces.pushed(surface, x, y, z, px, py, pz, 0.0)
    gf = surfaces.gap_of(surface, qf)
    # There g1 = gf - e kappa, and with C = c alpha/2 g[q0, q1] e equation (K) is one of
    #   entering (g0 <= 0):  (1 + C) g1^2 - (gf + g0) g1 + gf g0 = 0
    #   staying:             g1 = (gf - C g0)/(1 + C)
    #   leaving (g1 < 0):    g1^2 - (gf + g0) g1 + gf g0 - C g0^2 = 0
    slope, _dslope = surfaces.gap_slope(surface, q0, qf)
    e = -slope * dqf
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
    return select(index == 0.0, (gf - g1) / e, other)


@guess.register(Nothing)
def _(chain, index, law, x, y, z, px, py, pz, c):
    return 0.0


@by_type
def improve(chain, index, law, x, y, z, px, py, pz, c, kappa):
    """The Newton step of kappa for surface `index`."""
    raise NotImplementedError


@improve.register(Chain)
def _(chain, index, law, x, y, z, px, py, pz, c, kappa):
    surface = chain.first
    q0 = surfaces.inner(surface, x, y, z)
    g0 = surfaces.gap_of(surface, q0)
    f, df = _residual(law, surface, x, y, z, px, py, pz, c, q0, g0, kappa)
    other = improve(chain.rest, index - 1.0, law, x, y, z, px, py, pz, c, kappa)
    return select(index == 0.0, f / df, other)


@improve.register(Nothing)
def _(chain, index, law, x, y, z, px, py, pz, c, kappa):
    return 0.0


@inlined
def unsolved(kappa, change):
    """Whether the last Newton step was so large that another is needed. True for NaN."""
    return not (abs(change) <= _NEWTON_TOLERANCE * abs(kappa))


@outlined
def careful(law, surface, x, y, z, px, py, pz, c):
    """kappa of one surface by Newton's method inside a bracket, and whether it was found."""
    q0 = surfaces.inner(surface, x, y, z)
    g0 = surfaces.gap_of(surface, q0)
    f, _df = _residual(law, surface, x, y, z, px, py, pz, c, q0, g0, 0.0)
    if f == 0.0:
        return 0.0, True
    # At kappa = 0 the right side of (K) is largest, so its value there is past the root. A solid pushes with
    # kappa < 0: `sign` mirrors it.
    sign = -1.0 if f > 0.0 else 1.0
    low, high = 0.0, abs(f)
    k = low
    for _i in range(_CAREFUL_ITERATIONS):
        f, df = _residual(law, surface, x, y, z, px, py, pz, c, q0, g0, sign * k)
        f = sign * f
        if f == 0.0:
            return sign * k, True
        if f < 0.0:
            low = k
        else:
            high = k
        trial = k - f / df
        if not low < trial < high:
            trial = 0.5 * (low + high)
        if abs(trial - k) <= 2.0 * _EPSILON * trial or high - low <= 2.0 * _EPSILON * high:
            return sign * trial, True
        k = trial
    return sign * k, False
