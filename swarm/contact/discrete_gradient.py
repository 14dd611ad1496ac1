"""The three discrete gradients of Phi: vectors D with D.(r1 - r0) = Phi(r1) - Phi(r0).

The step m (v1 - v0) = h m G - h D (alpha Phi_mean + lambda) balances the energy exactly by that identity alone.
    mean value (6)  grad Phi at a point r_beta between r0 and r1; Phi must be C1 there, so the exponent is above 1.
    scalar (9)      (Phi1 - Phi0)/(|r1|^2 - |r0|^2) (r0 + r1): a sphere about the origin of r.
    composite       Phi[g0, g1] g[q0, q1] times a discrete gradient of the smooth inner function q. It is (9) for a
                    sphere, holds for every surface, and lets Phi have a corner on it, so any exponent is possible.
The discrete gradient of q is the surface's: grad q at the midpoint m for a quadric, else Gonzalez's
grad q(m) + (q1 - q0 - grad q(m).d)/|d|^2 d, with d = r1 - r0.
Source: García Orden & Ortega 2007, eqs. (6), (9); Gonzalez 1996.
"""

import math
from typing import Any, NamedTuple

from ..kernel.jit import outlined
from ..kernel.limits import EPSILON
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, absolute, dot
from . import impulse
from .impulse import Step

# Iterations of the two solves of the mean-value form; halving alone would end sooner.
_BETA_ITERATIONS = 200
_FORCE_ITERATIONS = 200
# Parts of a step in which beta is searched.
_PARTS = 16
# The accuracy with which a beta to its last digit must meet (6), relative to the push; the first step of `balanced`.
_NEARLY = 0.1
_NUDGE = 1e-6


def reaction_needs(gradient: str) -> tuple[Any, ...]:
    """The functions of every wall that a step needs, for the argument `gradient` of its method."""
    return (*impulse.NEEDS, "resolve") if gradient == "mean-value" else impulse.NEEDS


# --- The vectors -----------------------------------------------------------------------------------------


@outlined
def composite(law, surface, r0, r1):
    """D = Phi[g0, g1] g[q0, q1] D_q; where q1 = q0 the quotients are their one-sided limits."""
    q0, q1 = surface.inner(r0), surface.inner(r1)
    slope, _curvature = law.constraint_slope(surface.gap_of(q0), surface.gap_of(q1))
    rise, _curvature = surface.gap_slope(q0, q1)
    return slope * rise * surface.discrete_gradient(r0, r1)


@outlined
def constraint_gradient(law, surface, r):
    """grad Phi(r) = Phi'(g) g'(q) grad q."""
    return _constraint_slope(law, surface, surface.inner(r)) * surface.discrete_gradient(r, r)


def _constraint_slope(law, surface, q):
    """dPhi/dq"""
    slope, _curvature = surface.gap_slope(q, q)
    return law.constraint_gradient(surface.gap_of(q)) * slope


def _constraint(law, surface, r):
    return law.constraint(surface.gap_of(surface.inner(r)))


@outlined
def identity_miss(law, surface, r0, r1, beta):
    """grad Phi(r_beta).(r1 - r0) - (Phi1 - Phi0), r_beta = (1 - beta) r0 + beta r1; 0 if it is round-off."""
    d = r1 - r0
    gradient = constraint_gradient(law, surface, r0 + beta * d)
    # The composite form gives the difference without cancellation.
    exact = composite(law, surface, r0, r1)
    miss = dot(gradient - exact, d)
    terms = dot(absolute(gradient) + absolute(exact), absolute(d))
    return 0.0 if abs(miss) <= 16.0 * EPSILON * terms else miss


# --- A step against one wall -----------------------------------------------------------------------------


class Reaction(Record):
    """The displacement c D (alpha Phi_mean + lambda) by one wall: r1 = r0 + p minus the displacement."""

    vector: Vec
    constraint: float  # Phi1
    solved: bool


@outlined
def reaction(form, law, multiplier, surface, step):
    """Return the `Reaction` of one wall in a step.

    `form` is Composite, MeanValue or the form of methods/implicit.py; `multiplier` is a float or None.
    """
    return form.reaction(law, multiplier, surface, step)


class Composite(NamedTuple):
    """The composite form."""

    def reaction(self, law, multiplier, surface, step):
        """Return the `Reaction` of a surface."""
        equation = impulse.equation(law, multiplier, surface, step)
        kappa, solved = equation.careful()
        r1 = surface.push(step.r, step.p, kappa)
        return Reaction(kappa * surface.discrete_gradient(step.r, r1), law.constraint(equation.end(kappa).gap), solved)


class MeanValue(NamedTuple):
    """The mean-value form: its nested solves are too long for lanes."""

    def reaction(self, law, multiplier, surface, step):
        """Return the `Reaction` of a surface."""
        body, r0, p = surface.framed(step.r, step.p)
        return _MeanValueStep(law, multiplier, body, Step(r0, p, step.c)).reaction()


def form_of(gradient: str) -> Composite | MeanValue:
    """Return the form for the argument `gradient` of a method."""
    return MeanValue() if gradient == "mean-value" else Composite()


class _MeanValueStep(Record):
    """A step with the mean-value form.

    Two nested solves: the strength of the push for each beta, and the beta for which (6) is a discrete gradient.
    """

    law: Any
    multiplier: Any
    surface: Any
    step: Step

    def reaction(self):
        """Return the `Reaction` of the surface."""
        low, high = 0.0, 0.0
        kappa, f_low = self.pushed(low)
        f_high = f_low
        for i in range(_PARTS):
            if f_low * f_high <= 0.0 and (i > 0 or f_low == 0.0):
                break
            low, f_low, high = high, f_high, (i + 1.0) / _PARTS
            kappa, f_high = self.pushed(high)
        beta, found = high, f_high == 0.0
        if f_low == 0.0:
            beta, found = low, True
            kappa, _f = self.pushed(low)
        elif f_low * f_high < 0.0:
            for _i in range(_BETA_ITERATIONS):
                beta = illinois(low, f_low, high, f_high)
                kappa, f = self.pushed(beta)
                if f == 0.0 or high - low <= 2.0 * EPSILON * high:
                    found = True
                    break
                low, f_low, high, f_high = narrowed(low, f_low, high, f_high, beta, f)
        # Near the surface Phi' rises faster than beta has digits, and (6) is met only nearly. The strength that the
        # identity requires along grad q(r_beta) meets it for any beta.
        r, change = self.balanced(beta, kappa)
        end = self.step.r + self.step.p - r
        return Reaction(r, _constraint(self.law, self.surface, end), found and change <= _NEARLY)

    @outlined
    def gradient_at(self, beta, kappa):
        """Return r_beta = r0 + beta (p - kappa grad q(r_beta)), and grad q there."""
        r = self.surface.resolve(self.step.r + beta * self.step.p, beta * kappa)
        return r, self.surface.discrete_gradient(r, r)

    def force(self, first, last):
        """Return alpha Phi_mean + lambda, from half of Phi at each end."""
        return self.law.alpha * (first + last) + (0.0 if self.multiplier is None else self.multiplier)

    @outlined
    def balanced(self, beta, kappa):
        """Return the reaction for this beta with exact energy, and the relative change of kappa that this needs."""
        law, surface, step = self.law, self.surface, self.step
        k, before, f_before = kappa, kappa * (1.0 + _NUDGE), 0.0
        first = 0.5 * _constraint(law, surface, step.r)
        r, change, previous = ZERO, math.inf, math.inf
        for i in range(_FORCE_ITERATIONS):
            at = before if i == 0 else k
            _r_beta, d = self.gradient_at(beta, at)
            r = at * d
            moved = step.p - r
            exact = composite(law, surface, step.r, step.r + moved)
            force = self.force(first, 0.5 * _constraint(law, surface, step.r + moved))
            f = at - step.c * force * dot(exact, moved) / dot(d, moved)
            if i == 0:
                f_before = f
                continue
            change_of_k = f * (k - before) / (f - f_before)
            # NaN at the turning point, where both parts of the quotient vanish and (6) holds by itself. Steps that do
            # not shrink are round-off.
            if not abs(change_of_k) > 4.0 * EPSILON * abs(k) or previous <= abs(change_of_k) <= _NUDGE * abs(k):
                change = abs(k - kappa) / abs(kappa) if kappa != 0.0 else 0.0
                break
            before, f_before, k, previous = k, f, k - change_of_k, abs(change_of_k)
        return r, change

    @outlined
    def pushed(self, beta):
        """Return the kappa that solves the step with D along grad q(r_beta), and the miss of the identity (6)."""
        # F(kappa) = kappa - c (alpha Phi_mean + lambda) Phi'(g_beta) g'(q_beta); a solid pushes with kappa < 0.
        r, f = self.pushed_with(beta, 0.0)
        sign = -1.0 if f > 0.0 else 1.0
        kappa, low, f_low, high = 0.0, 0.0, sign * f, abs(f)
        if f != 0.0:
            kappa, f_high = high, -1.0
            for _i in range(_FORCE_ITERATIONS):
                r, f = self.pushed_with(beta, sign * high)
                f_high = sign * f
                if f_high > 0.0:
                    break
                # `high` is not past the push yet: the force grows along this line.
                low, f_low, high = high, f_high, 2.0 * high
            for _i in range(_FORCE_ITERATIONS):
                kappa = illinois(low, f_low, high, f_high)
                r, f = self.pushed_with(beta, sign * kappa)
                low, f_low, high, f_high = narrowed(low, f_low, high, f_high, kappa, sign * f)
                if f == 0.0 or high - low <= 2.0 * EPSILON * high:
                    break
        return sign * kappa, identity_miss(self.law, self.surface, self.step.r, self.step.r + self.step.p - r, beta)

    @outlined
    def pushed_with(self, beta, kappa):
        """Return the reaction kappa grad q(r_beta) and F(kappa)."""
        law, surface, step = self.law, self.surface, self.step
        r_beta, d = self.gradient_at(beta, kappa)
        r = kappa * d
        force = self.force(
            0.5 * _constraint(law, surface, step.r), 0.5 * _constraint(law, surface, step.r + step.p - r)
        )
        return r, kappa - step.c * force * _constraint_slope(law, surface, surface.inner(r_beta))


# --- A root in a bracket without derivatives -------------------------------------------------------------


def illinois(low, f_low, high, f_high):
    """Return the next trial of regula falsi, or the middle if the trial is not inside."""
    trial = low - f_low * (high - low) / (f_high - f_low)
    return trial if low < trial < high else 0.5 * (low + high)


def narrowed(low, f_low, high, f_high, trial, f):
    """Return the half of the bracket with the root; the weight of the end that stays is halved (Illinois)."""
    if f * f_high > 0.0:
        return low, 0.5 * f_low, trial, f
    return trial, f, high, 0.5 * f_high
