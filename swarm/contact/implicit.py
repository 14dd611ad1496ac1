"""The point that is pushed by the force at itself: s = r - c V'(g(s)) grad g(s), the equation of implicit rules.

With kappa = c V'(g(s)) g'(q(s)) it is s = r - kappa grad q(s), which the surface solves for s (`resolve`), so that one
equation in one unknown is left:
    F(kappa) = kappa - c V'(g) g'(q) = 0 at s(kappa).                                        (I)
c = h^2/(4m) for the midpoint and the trapezoidal rule.
"""

import math
from typing import NamedTuple

from ..kernel.gravity import Nothing
from ..kernel.jit import by_type, inlined, select
from ..surfaces import base as surfaces
from ..surfaces.chain import Chain
from . import regularisation as law_of
from .discrete_gradient import illinois, narrowed, reaction
from .force import NEEDS as FORCE_NEEDS
from .force import strength

# The derivative of F is a difference quotient over this part of kappa: right to about the same part, so that a step of
# _TOLERANCE is the last.
_NUDGE = 1e-7
_TOLERANCE = 1e-8
# Sweeps of the vectorised solve; what needs more goes the careful way.
SWEEPS = 10
_CAREFUL_ITERATIONS = 200
_EPSILON = 2.220446049250313e-16
# What the equation asks of every wall.
NEEDS = (*FORCE_NEEDS, surfaces.resolve, surfaces.farthest_push)


class AtEnd(NamedTuple):
    """A form of `reaction`: the force is that at the end of the displacement, and c = h^2/(4m)."""


@inlined
def _residual(law, surface, x, y, z, c, kappa):
    """F(kappa)"""
    sx, sy, sz = surfaces.resolve(surface, x, y, z, kappa)
    return kappa - c * strength(law, surface, surfaces.inner(surface, sx, sy, sz))


@by_type
def guess(chain, index, law, x, y, z, c):
    """kappa of surface `index` if the wall were flat and the spring linear."""
    raise NotImplementedError


@guess.register(Chain)
def _(chain, index, law, x, y, z, c):
    surface = chain.first
    q = surfaces.inner(surface, x, y, z)
    g = surfaces.gap_of(surface, q)
    slope, _curvature = surfaces.gap_slope(surface, q, q)
    dx, dy, dz = surfaces.inner_gradient(surface, x, y, z, x, y, z)
    # g(s) = g - kappa g'(q) |grad q|^2 and V' = k g(s): kappa (1 + c k g'^2 |grad q|^2) = c k g' g
    stiff = c * law_of.stiffness(law, g) * slope
    other = guess(chain.rest, index - 1.0, law, x, y, z, c)
    here = index == 0.0
    top = select(here & (g > 0.0), stiff * g, 0.0)
    bottom = select(here, 1.0 + stiff * slope * (dx * dx + dy * dy + dz * dz), 1.0)
    return top / bottom + select(here, 0.0, other)


@guess.register(Nothing)
def _(chain, index, law, x, y, z, c):
    return 0.0


@by_type
def improve(chain, index, law, x, y, z, c, kappa):
    """The Newton step of kappa for surface `index`, and whether it was so large that another is needed."""
    raise NotImplementedError


@improve.register(Chain)
def _(chain, index, law, x, y, z, c, kappa):
    surface = chain.first
    f = _residual(law, surface, x, y, z, c, kappa)
    nudge = _NUDGE * kappa
    rise = _residual(law, surface, x, y, z, c, kappa + nudge) - f
    # Without a push there is nothing to solve.
    pushes = kappa != 0.0
    step = f * nudge / select(pushes, rise, 1.0)
    other, more = improve(chain.rest, index - 1.0, law, x, y, z, c, kappa)
    here = index == 0.0
    # True for NaN.
    mine = pushes & (not (abs(step) <= _TOLERANCE * abs(kappa)))
    return select(here, step, other), (here & mine) | ((not here) & more)


@improve.register(Nothing)
def _(chain, index, law, x, y, z, c, kappa):
    return 0.0, False


@by_type
def reached(chain, index, x, y, z, kappa):
    """s"""
    raise NotImplementedError


@reached.register(Chain)
def _(chain, index, x, y, z, kappa):
    sx, sy, sz = surfaces.resolve(chain.first, x, y, z, kappa)
    ox, oy, oz = reached(chain.rest, index - 1.0, x, y, z, kappa)
    here = index == 0.0
    return select(here, sx, ox), select(here, sy, oy), select(here, sz, oz)


@reached.register(Nothing)
def _(chain, index, x, y, z, kappa):
    return x, y, z


@reaction.register(AtEnd)
def _(form, law, multiplier, surface, x, y, z, px, py, pz, c):
    # A cavity pushes with kappa > 0, a solid with kappa < 0. The force falls along the push: F changes sign by -F(0).
    x, y, z = x + px, y + py, z + pz
    f_low = _residual(law, surface, x, y, z, c, 0.0)
    if f_low == 0.0:
        return 0.0, 0.0, 0.0, 0.0, True
    # Before the pole of `resolve`.
    farthest = 0.5 * abs(surfaces.farthest_push(surface))
    low, high = 0.0, math.copysign(min(abs(f_low), (1.0 - 1e-12) * farthest), -f_low)
    f_high = _residual(law, surface, x, y, z, c, high)
    kappa, found = high, f_low * f_high <= 0.0
    for _i in range(_CAREFUL_ITERATIONS):
        if not found or f_high == 0.0 or abs(high - low) <= 2.0 * _EPSILON * abs(high):
            break
        kappa = illinois(low, f_low, high, f_high)
        low, f_low, high, f_high = narrowed(low, f_low, high, f_high, kappa, _residual(law, surface, x, y, z, c, kappa))
    sx, sy, sz = surfaces.resolve(surface, x, y, z, kappa)
    return x - sx, y - sy, z - sz, 0.0, found
