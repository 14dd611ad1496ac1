"""The point that is pushed by the force at itself: s = r - c V'(g(s)) grad g(s), the equation of implicit rules.

With kappa = c V'(g(s)) g'(q(s)) it is s = r - kappa grad q(s), which the surface solves for s (`resolve`), so that one
equation in one unknown is left:
    F(kappa) = kappa - c V'(g) g'(q) = 0 at s(kappa).                                        (I)
c = h^2/(4m) for the midpoint and the trapezoidal rule.
"""

import math
from typing import NamedTuple

from ..kernel.jit import select
from ..kernel.vector import ZERO, square
from .discrete_gradient import Reaction, illinois, narrowed
from .force import NEEDS as FORCE_NEEDS
from .force import strength

# The derivative of F is a difference quotient over this part of kappa: right to about the same part, so that a step of
# _TOLERANCE is the last.
_NUDGE = 1e-7
_TOLERANCE = 1e-8
# Sweeps of the vectorised solve; what needs more is solved by `reaction`.
SWEEPS = 10
_CAREFUL_ITERATIONS = 200
_EPSILON = 2.220446049250313e-16
# The equation needs these of every wall.
NEEDS = (*FORCE_NEEDS, "resolve", "farthest_push")


def _residual(law, surface, r, c, kappa):
    """F(kappa)"""
    return kappa - c * strength(law, surface, surface.inner(surface.resolve(r, kappa)))


def _guess(surface, law, r, c):
    """kappa if the wall were flat and the spring linear."""
    q = surface.inner(r)
    g = surface.gap_of(q)
    slope, _curvature = surface.gap_slope(q, q)
    # g(s) = g - kappa g'(q) |grad q|^2 and V' = k g(s): kappa (1 + c k g'^2 |grad q|^2) = c k g' g
    stiff = c * law.stiffness(g) * slope
    return select(g > 0.0, stiff * g, 0.0) / (1.0 + stiff * slope * square(surface.discrete_gradient(r, r)))


def _improve(surface, law, r, c, kappa):
    """The Newton step of kappa, and whether it was so large that another is needed."""
    f = _residual(law, surface, r, c, kappa)
    nudge = _NUDGE * kappa
    rise = _residual(law, surface, r, c, kappa + nudge) - f
    # Without a push there is nothing to solve.
    pushes = kappa != 0.0
    step = f * nudge / select(pushes, rise, 1.0)
    # True for NaN.
    return step, pushes & (not (abs(step) <= _TOLERANCE * abs(kappa)))


def guess(walls, wall, *given):
    """`_guess` of a wall."""
    return walls.of(wall, 0.0, _guess, *given)


def improve(walls, wall, *given):
    """`_improve` of a wall."""
    return walls.of(wall, (0.0, False), _improve, *given)


def reached(walls, wall, r, kappa):
    """s; r where there is no such wall."""
    end = r
    for k, one in reversed(tuple(enumerate(walls.each))):
        end = select(wall == k, one.resolve(r, kappa), end)
    return end


class AtEnd(NamedTuple):
    """A form of `reaction`: the force is that at the end of the displacement, and c = h^2/(4m)."""

    def reaction(self, law, multiplier, surface, step):
        """`Reaction` of a surface."""
        # A cavity pushes with kappa > 0, a solid with kappa < 0. The force falls along the push: F changes sign by
        # -F(0).
        r, c = step.r + step.p, step.c
        f_low = _residual(law, surface, r, c, 0.0)
        if f_low == 0.0:
            return Reaction(ZERO, 0.0, True)
        # Before the pole of `resolve`.
        farthest = 0.5 * abs(surface.farthest_push())
        low, high = 0.0, math.copysign(min(abs(f_low), (1.0 - 1e-12) * farthest), -f_low)
        f_high = _residual(law, surface, r, c, high)
        kappa, found = high, f_low * f_high <= 0.0
        for _i in range(_CAREFUL_ITERATIONS):
            if not found or f_high == 0.0 or abs(high - low) <= 2.0 * _EPSILON * abs(high):
                break
            kappa = illinois(low, f_low, high, f_high)
            low, f_low, high, f_high = narrowed(low, f_low, high, f_high, kappa, _residual(law, surface, r, c, kappa))
        return Reaction(r - surface.resolve(r, kappa), 0.0, found)
