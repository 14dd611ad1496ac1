"""The regularised constraint Phi(g), the stored energy V = alpha Phi^2/2, and their divided differences.

Phi(g) = sqrt(2/(a+1)) max(g, 0)^((a+1)/2)                      [García Orden & Ortega 2007, eq. (2)]
so V(g) = alpha g^(a+1)/(a+1) for g > 0: a linear spring for a = 1, Hertz's law for a = 1.5.

The penalty force of a step is the divided difference V[g0, g1] = (V1 - V0)/(g1 - g0) for any two
gaps; the energy balance needs nothing else. A multiplier lambda adds lambda Phi[g0, g1]. Where both gaps are positive
and close, the quotients would cancel, so each law has forms that do not.
"""

import math
from typing import Any

from ..kernel.jit import select
from ..kernel.record import Record


class Law(Record):
    """A law with one stiffness alpha, the penalty."""

    def stiffened(self: Any, factor: Any) -> Any:
        """Return the same law with `factor` times the penalty."""
        return self._replace(alpha=factor * self.alpha)

    def force(self: Any, multiplier: Any, g0: Any, g1: Any) -> Any:
        """Return the contact force of a step, V[g0, g1] + lambda Phi[g0, g1], and its derivative by g1."""
        spring, dspring = self.energy_slope(g0, g1)
        if multiplier is None:
            return spring, dspring
        slope, dslope = self.constraint_slope(g0, g1)
        return spring + multiplier * slope, dspring + multiplier * dslope


def regularisation(penalty: float, exponent: float) -> Any:
    """Return the law with the cheapest arithmetic for this exponent."""
    if exponent == 1.0:
        return Linear(penalty)
    if exponent == 1.5:
        return Hertz(penalty)
    return Power(penalty, exponent)


def _positive(g):
    return select(g > 0.0, g, 0.0)


def _quotient(v0, v1, force1, d):
    """Return the plain quotient and its derivative, if one of the gaps is not positive; 0 if both are not."""
    inverse = 1.0 / select(d == 0.0, 1.0, d)
    slope = (v1 - v0) * inverse
    return slope, (force1 - slope) * inverse


# --- a = 1 -----------------------------------------------------------------------------------------------


class Linear(Law):
    """a = 1, a linear spring; alpha is the penalty [N/m for a gap in m]."""

    alpha: float

    def stored_energy(self, g):
        """V(g)"""
        p = _positive(g)
        return 0.5 * self.alpha * p * p

    def stiffness(self, g):
        """2 V(g)/g^2: the linear spring that stores the same energy at the gap g > 0."""
        return self.alpha

    def energy_slope(self, g0, g1):
        """V[g0, g1] and its derivative by g1."""
        p0, p1 = _positive(g0), _positive(g1)
        half = 0.5 * self.alpha
        slope, curvature = _quotient(half * p0 * p0, half * p1 * p1, self.alpha * p1, g1 - g0)
        both = (g0 >= 0.0) & (g1 >= 0.0)
        # (g1^2 - g0^2)/(g1 - g0) = g0 + g1
        return select(both, half * (g0 + g1), slope), select(both, half, curvature)

    def constraint(self, g):
        """Phi(g)"""
        return _positive(g)

    def constraint_gradient(self, g):
        """Phi'(g), the outer limit at a jump: sqrt((a+1)/2) g^((a-1)/2) for g >= 0, eq. (3), and 0 for g < 0."""
        return select(g >= 0.0, 1.0, 0.0)

    def constraint_slope(self, g0, g1):
        """Phi[g0, g1] and its derivative by g1; Phi' for equal gaps."""
        slope, curvature = _quotient(_positive(g0), _positive(g1), select(g1 >= 0.0, 1.0, 0.0), g1 - g0)
        both = (g0 >= 0.0) & (g1 >= 0.0)
        return select(both, 1.0, slope), select(both, 0.0, curvature)


# --- a = 1.5 ---------------------------------------------------------------------------------------------

_HERTZ = math.sqrt(0.8)


class Hertz(Law):
    """a = 1.5, Hertz's law of elastic spheres."""

    alpha: float

    def stored_energy(self, g):
        """V(g)"""
        p = _positive(g)
        return self.alpha / 2.5 * p * p * math.sqrt(p)

    def stiffness(self, g):
        """2 V(g)/g^2: the linear spring that stores the same energy at the gap g > 0."""
        return self.alpha * 0.8 * math.sqrt(_positive(g))

    def energy_slope(self, g0, g1):
        """V[g0, g1] and its derivative by g1."""
        p0, p1 = _positive(g0), _positive(g1)
        u0, u1 = math.sqrt(p0), math.sqrt(p1)
        k = self.alpha / 2.5
        slope, curvature = _quotient(k * p0 * p0 * u0, k * p1 * p1 * u1, self.alpha * p1 * u1, g1 - g0)
        both = (g0 > 0.0) & (g1 > 0.0)
        # with u = sqrt(g): (u1^5 - u0^5)/(u1^2 - u0^2) = (u1^4 + u1^3 u0 + u1^2 u0^2 + u1 u0^3 + u0^4)/(u1 + u0)
        total = select(both, u0 + u1, 1.0)
        n = p1 * p1 + u1 * u0 * (p1 + u1 * u0 + p0) + p0 * p0
        dn = 4.0 * p1 * u1 + 3.0 * p1 * u0 + 2.0 * u1 * p0 + p0 * u0
        du = 0.5 / select(both, u1, 1.0)
        s = k * n / total
        ds = (k * dn - s) / total * du
        return select(both, s, slope), select(both, ds, curvature)

    def constraint(self, g):
        """Phi(g)"""
        p = _positive(g)
        return _HERTZ * p * math.sqrt(math.sqrt(p))

    def constraint_gradient(self, g):
        """Phi'(g), the outer limit at a jump: sqrt((a+1)/2) g^((a-1)/2) for g >= 0, eq. (3), and 0 for g < 0."""
        return 1.25 * _HERTZ * math.sqrt(math.sqrt(_positive(g)))

    def constraint_slope(self, g0, g1):
        """Phi[g0, g1] and its derivative by g1; Phi' for equal gaps."""
        p0, p1 = _positive(g0), _positive(g1)
        u0, u1 = math.sqrt(p0), math.sqrt(p1)
        w0, w1 = math.sqrt(u0), math.sqrt(u1)
        slope, curvature = _quotient(p0 * w0, p1 * w1, 1.25 * w1, g1 - g0)
        both = (g0 > 0.0) & (g1 > 0.0)
        # with w = g^(1/4): (w1^5 - w0^5)/(w1^4 - w0^4) = (w1^4 + w1^3 w0 + ... + w0^4)/((w1 + w0)(w1^2 + w0^2))
        total = select(both, (w0 + w1) * (u0 + u1), 1.0)
        n = p1 + w1 * w0 * (u1 + w1 * w0 + u0) + p0
        # the derivatives of numerator and denominator by w1, and dw/dg = 1/(4 w^3)
        dn = 4.0 * w1 * u1 + 3.0 * u1 * w0 + 2.0 * w1 * u0 + u0 * w0
        dtotal = u0 + u1 + 2.0 * w1 * (w0 + w1)
        s = n / total
        ds = (dn - s * dtotal) / total * (0.25 / select(both, w1 * u1, 1.0))
        return _HERTZ * select(both, s, slope), _HERTZ * select(both, ds, curvature)


# --- Any a -----------------------------------------------------------------------------------------------

# Nodes and weights of the three-point Gauss rule on [0, 1].
_NODE = 0.5 * math.sqrt(0.6)
_THETA = (0.5 - _NODE, 0.5, 0.5 + _NODE)
_WEIGHT = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
# Its error is of the sixth order in (b + 2)|g1 - g0|/g; below this ratio it is under round-off.
_CLOSE = 1.0 / 16.0


def _power_slope(b, g0, g1):
    """Return the divided difference of max(g, 0)^b, b >= 1, and its derivative by g1."""
    d = g1 - g0
    p0, p1 = _positive(g0), _positive(g1)
    if g0 > 0.0 and g1 > 0.0 and abs(d) * (b + 2.0) < _CLOSE * g0:
        # The divided difference is the mean of the derivative b g^(b-1) between the two gaps.
        slope, curvature = 0.0, 0.0
        for i in range(3):
            g = g0 + _THETA[i] * d
            part = _WEIGHT[i] * b * g ** (b - 1.0)
            slope += part
            curvature += _THETA[i] * (b - 1.0) * part / g
        return slope, curvature
    slope, curvature = _quotient(p0**b, p1**b, select(g1 >= 0.0, b * p1 ** (b - 1.0), 0.0), d)
    # b = 1 has a corner at 0, where Phi' from the outside is 1.
    corner = (d == 0.0) & (g0 == 0.0) & (b == 1.0)
    return select(corner, 1.0, slope), select(corner, 0.0, curvature)


class Power(Law):
    """Any a >= 1. `pow` is a call, so the lane loop is not vectorised: about ten times the cost of `Linear`."""

    # The last bit of `pow` may differ between plain Python and compiled kernels.
    calls_library = True

    alpha: float
    a: float

    def stored_energy(self, g):
        """V(g)"""
        return self.alpha / (self.a + 1.0) * _positive(g) ** (self.a + 1.0)

    def stiffness(self, g):
        """2 V(g)/g^2: the linear spring that stores the same energy at the gap g > 0."""
        return 2.0 * self.alpha / (self.a + 1.0) * _positive(g) ** (self.a - 1.0)

    def energy_slope(self, g0, g1):
        """V[g0, g1] and its derivative by g1."""
        slope, curvature = _power_slope(self.a + 1.0, g0, g1)
        k = self.alpha / (self.a + 1.0)
        return k * slope, k * curvature

    def constraint(self, g):
        """Phi(g)"""
        return math.sqrt(2.0 / (self.a + 1.0)) * _positive(g) ** (0.5 * (self.a + 1.0))

    def constraint_gradient(self, g):
        """Phi'(g), the outer limit at a jump: sqrt((a+1)/2) g^((a-1)/2) for g >= 0, eq. (3), and 0 for g < 0."""
        return select(g >= 0.0, math.sqrt(0.5 * (self.a + 1.0)) * _positive(g) ** (0.5 * (self.a - 1.0)), 0.0)

    def constraint_slope(self, g0, g1):
        """Phi[g0, g1] and its derivative by g1; Phi' for equal gaps."""
        slope, curvature = _power_slope(0.5 * (self.a + 1.0), g0, g1)
        k = math.sqrt(2.0 / (self.a + 1.0))
        return k * slope, k * curvature
