"""The three discrete gradients of Phi: vectors D with D.(r1 - r0) = Phi(r1) - Phi(r0).

The step m (v1 - v0) = h m G - h D (alpha Phi_mean + lambda) balances the energy exactly by that identity alone.
    mean value (6)  grad Phi at a point r_beta between r0 and r1; Phi must be C1 there, so the exponent is above 1.
    scalar (9)      (Phi1 - Phi0)/(|r1|^2 - |r0|^2) (r0 + r1): a sphere about the origin of r.
    composite       Phi[g0, g1] g[q0, q1] times a discrete gradient of the smooth inner function q. It is (9) for a
                    sphere, holds for every surface, and lets Phi have a corner on it, so any exponent will do.
The discrete gradient of q is the surface's: grad q at the midpoint m for a quadric, else Gonzalez's
grad q(m) + (q1 - q0 - grad q(m).d)/|d|^2 d, with d = r1 - r0.
Source: García Orden & Ortega 2007, eqs. (6), (9); Gonzalez 1996.
"""

import math
from typing import Any, NamedTuple

from ..kernel.jit import by_type, by_type_outlined, inlined, outlined
from ..surfaces import base as surfaces
from . import impulse
from . import regularisation as law_of

_EPSILON = 2.220446049250313e-16
# Iterations of the mean-value form's two solves; halving alone would end sooner.
_BETA_ITERATIONS = 200
_FORCE_ITERATIONS = 200
# Parts of a step in which a beta is looked for.
_PARTS = 16
# How nearly a beta to its last digit must meet (6), relative to the push; and the first step of the solve after it.
_NEARLY = 0.1
_NUDGE = 1e-6


class Composite(NamedTuple):
    """Chooses the composite form."""


class MeanValue(NamedTuple):
    """Chooses the mean-value form."""


def form_of(gradient: str) -> Composite | MeanValue:
    """The form of a method's argument `gradient`."""
    return MeanValue() if gradient == "mean-value" else Composite()


def reaction_needs(gradient: str) -> tuple[Any, ...]:
    """What a step with that argument asks of every wall."""
    return (*impulse.NEEDS, surfaces.resolve) if gradient == "mean-value" else impulse.NEEDS


@by_type
def nested(form):
    """Whether a step takes nested solves, which are too long for lanes."""
    raise NotImplementedError


@nested.register(Composite)
def _(form):
    return False


@nested.register(MeanValue)
def _(form):
    return True


# --- The vectors -----------------------------------------------------------------------------------------


@outlined
def composite(law, surface, x0, y0, z0, x1, y1, z1):
    """D = Phi[g0, g1] g[q0, q1] D_q; where q1 = q0 the quotients are their one-sided limits."""
    q0, q1 = surfaces.inner(surface, x0, y0, z0), surfaces.inner(surface, x1, y1, z1)
    g0, g1 = surfaces.gap_of(surface, q0), surfaces.gap_of(surface, q1)
    slope, _curvature = law_of.constraint_slope(law, g0, g1)
    rise, _curvature = surfaces.gap_slope(surface, q0, q1)
    dx, dy, dz = surfaces.inner_gradient(surface, x0, y0, z0, x1, y1, z1)
    f = slope * rise
    return f * dx, f * dy, f * dz


@outlined
def scalar(law, radius, x0, y0, z0, x1, y1, z1):
    """The paper's (9) for the cavity |r| <= radius, as it stands there: 0/0 where |r1| = |r0|."""
    q0, q1 = x0 * x0 + y0 * y0 + z0 * z0, x1 * x1 + y1 * y1 + z1 * z1
    rise = law_of.constraint(law, math.sqrt(q1) - radius) - law_of.constraint(law, math.sqrt(q0) - radius)
    f = rise / (q1 - q0)
    return f * (x0 + x1), f * (y0 + y1), f * (z0 + z1)


@outlined
def constraint_gradient(law, surface, x, y, z):
    """grad Phi(r) = Phi'(g) g'(q) grad q."""
    q = surfaces.inner(surface, x, y, z)
    slope, _curvature = surfaces.gap_slope(surface, q, q)
    f = law_of.constraint_gradient(law, surfaces.gap_of(surface, q)) * slope
    dx, dy, dz = surfaces.inner_gradient(surface, x, y, z, x, y, z)
    return f * dx, f * dy, f * dz


@outlined
def mean_value(law, surface, x0, y0, z0, x1, y1, z1):
    """D = grad Phi(r_beta), r_beta = (1 - beta) r0 + beta r1, and beta (NaN if none was found)."""
    # Phi need not be convex along the step: the first part of it whose ends miss to different sides.
    low, f_low = 0.0, _identity(law, surface, x0, y0, z0, x1, y1, z1, 0.0)
    high, f_high = low, f_low
    for i in range(_PARTS):
        if f_low * f_high <= 0.0 and (i > 0 or f_low == 0.0):
            break
        low, f_low, high = high, f_high, (i + 1.0) / _PARTS
        f_high = _identity(law, surface, x0, y0, z0, x1, y1, z1, high)
    beta = low if f_low == 0.0 else high if f_high == 0.0 else math.nan
    if f_low * f_high < 0.0:
        for _i in range(_BETA_ITERATIONS):
            beta = illinois(low, f_low, high, f_high)
            f = _identity(law, surface, x0, y0, z0, x1, y1, z1, beta)
            if f == 0.0 or high - low <= 2.0 * _EPSILON:
                break
            low, f_low, high, f_high = narrowed(low, f_low, high, f_high, beta, f)
    dx, dy, dz = constraint_gradient(law, surface, *_between(x0, y0, z0, x1, y1, z1, beta))
    return dx, dy, dz, beta


@inlined
def _between(x0, y0, z0, x1, y1, z1, beta):
    """r_beta"""
    return x0 + beta * (x1 - x0), y0 + beta * (y1 - y0), z0 + beta * (z1 - z0)


@inlined
def _gap(surface, x, y, z):
    return surfaces.gap_of(surface, surfaces.inner(surface, x, y, z))


@outlined
def _identity(law, surface, x0, y0, z0, x1, y1, z1, beta):
    """grad Phi(r_beta).(r1 - r0) - (Phi1 - Phi0); 0 where that is round-off."""
    dx, dy, dz = x1 - x0, y1 - y0, z1 - z0
    gx, gy, gz = constraint_gradient(law, surface, *_between(x0, y0, z0, x1, y1, z1, beta))
    # The composite form has the difference without cancellation.
    cx, cy, cz = composite(law, surface, x0, y0, z0, x1, y1, z1)
    miss = (gx - cx) * dx + (gy - cy) * dy + (gz - cz) * dz
    terms = (abs(gx) + abs(cx)) * abs(dx) + (abs(gy) + abs(cy)) * abs(dy) + (abs(gz) + abs(cz)) * abs(dz)
    return 0.0 if abs(miss) <= 16.0 * _EPSILON * terms else miss


# --- A step that one wall holds back ---------------------------------------------------------------------


@by_type_outlined
def reaction(form, law, multiplier, surface, x, y, z, px, py, pz, c):
    """The displacement c D (alpha Phi_mean + lambda) by which one wall holds a step back, Phi1, whether found.

    r1 = r0 + p less the displacement. `form` is Composite or MeanValue, `multiplier` a float or None, c = h^2/(2m).
    """
    raise NotImplementedError


@reaction.register(Composite)
def _(form, law, multiplier, surface, x, y, z, px, py, pz, c):
    kappa, solved = impulse.careful(law, multiplier, surface, x, y, z, px, py, pz, c)
    x1, y1, z1 = surfaces.push(surface, x, y, z, px, py, pz, kappa)
    dx, dy, dz = surfaces.inner_gradient(surface, x, y, z, x1, y1, z1)
    q0 = surfaces.inner(surface, x, y, z)
    g0, round_off, _tolerance = impulse.start_gap(multiplier, surface, x, y, z, q0)
    g1 = impulse.end_gap(surface, x, y, z, px, py, pz, q0, g0, round_off, kappa)
    return kappa * dx, kappa * dy, kappa * dz, law_of.constraint(law, g1), solved


@reaction.register(MeanValue)
def _(form, law, multiplier, surface, x, y, z, px, py, pz, c):
    # Two nested solves: for each beta the strength of the push, and that beta for which (6) is a discrete gradient.
    low, high, kappa = 0.0, 0.0, 0.0
    kappa, f_low = _pushed_at(law, multiplier, surface, x, y, z, px, py, pz, c, low)
    f_high = f_low
    for i in range(_PARTS):
        if f_low * f_high <= 0.0 and (i > 0 or f_low == 0.0):
            break
        low, f_low, high = high, f_high, (i + 1.0) / _PARTS
        kappa, f_high = _pushed_at(law, multiplier, surface, x, y, z, px, py, pz, c, high)
    beta, found = high, f_high == 0.0
    if f_low == 0.0:
        beta, found = low, True
        kappa, _f = _pushed_at(law, multiplier, surface, x, y, z, px, py, pz, c, low)
    elif f_low * f_high < 0.0:
        for _i in range(_BETA_ITERATIONS):
            beta = illinois(low, f_low, high, f_high)
            kappa, f = _pushed_at(law, multiplier, surface, x, y, z, px, py, pz, c, beta)
            if f == 0.0 or high - low <= 2.0 * _EPSILON * high:
                found = True
                break
            low, f_low, high, f_high = narrowed(low, f_low, high, f_high, beta, f)
    # Near the surface Phi' rises faster than beta has digits, and (6) is met only nearly. The strength that the
    # identity asks for along grad q(r_beta) meets it whatever beta is.
    rx, ry, rz, end, change = _balanced(law, multiplier, surface, x, y, z, px, py, pz, c, beta, kappa)
    return rx, ry, rz, end, found and change <= _NEARLY


@outlined
def _balanced(law, multiplier, surface, x, y, z, px, py, pz, c, beta, kappa):
    """The reaction for this beta with exact energy, Phi1, and by what part of itself kappa had to change."""
    k, before, g_before = kappa, kappa * (1.0 + _NUDGE), 0.0
    mean = 0.5 * law_of.constraint(law, _gap(surface, x, y, z))
    rx, ry, rz, change, previous = 0.0, 0.0, 0.0, math.inf, math.inf
    for i in range(_FORCE_ITERATIONS):
        at = before if i == 0 else k
        bx, by, bz = surfaces.resolve(surface, x + beta * px, y + beta * py, z + beta * pz, beta * at)
        dx, dy, dz = surfaces.inner_gradient(surface, bx, by, bz, bx, by, bz)
        rx, ry, rz = at * dx, at * dy, at * dz
        ex, ey, ez = px - rx, py - ry, pz - rz
        cx, cy, cz = composite(law, surface, x, y, z, x + ex, y + ey, z + ez)
        end = 0.5 * law_of.constraint(law, _gap(surface, x + ex, y + ey, z + ez))
        force = law.alpha * (mean + end) + (0.0 if multiplier is None else multiplier)
        g = at - c * force * (cx * ex + cy * ey + cz * ez) / (dx * ex + dy * ey + dz * ez)
        if i == 0:
            g_before = g
            continue
        step = g * (k - before) / (g - g_before)
        # NaN at the turning point, where both parts of the quotient vanish and (6) holds by itself. Steps that do not
        # shrink are round-off.
        if not abs(step) > 4.0 * _EPSILON * abs(k) or previous <= abs(step) <= _NUDGE * abs(k):
            change = abs(k - kappa) / abs(kappa) if kappa != 0.0 else 0.0
            break
        before, g_before, k, previous = k, g, k - step, abs(step)
    return rx, ry, rz, law_of.constraint(law, _gap(surface, x + px - rx, y + py - ry, z + pz - rz)), change


@outlined
def _pushed_at(law, multiplier, surface, x, y, z, px, py, pz, c, beta):
    """The kappa that solves the step with D along grad q(r_beta), and by how much (6) then misses its identity."""
    # F(kappa) = kappa - c (alpha Phi_mean + lambda) Phi'(g_beta) g'(q_beta); a solid pushes with kappa < 0.
    rx, ry, rz, f = _push_at(law, multiplier, surface, x, y, z, px, py, pz, c, beta, 0.0)
    sign = -1.0 if f > 0.0 else 1.0
    kappa, low, f_low, high = 0.0, 0.0, sign * f, abs(f)
    if f != 0.0:
        kappa, f_high = high, -1.0
        for _i in range(_FORCE_ITERATIONS):
            rx, ry, rz, f = _push_at(law, multiplier, surface, x, y, z, px, py, pz, c, beta, sign * high)
            f_high = sign * f
            if f_high > 0.0:
                break
            # Not past the push yet: the force grows along this line.
            low, f_low, high = high, f_high, 2.0 * high
        for _i in range(_FORCE_ITERATIONS):
            kappa = illinois(low, f_low, high, f_high)
            rx, ry, rz, f = _push_at(law, multiplier, surface, x, y, z, px, py, pz, c, beta, sign * kappa)
            low, f_low, high, f_high = narrowed(low, f_low, high, f_high, kappa, sign * f)
            if f == 0.0 or high - low <= 2.0 * _EPSILON * high:
                break
    return sign * kappa, _identity(law, surface, x, y, z, x + px - rx, y + py - ry, z + pz - rz, beta)


@outlined
def _push_at(law, multiplier, surface, x, y, z, px, py, pz, c, beta, kappa):
    """The reaction kappa grad q(r_beta) and F(kappa)."""
    # r_beta = r0 + beta (p - kappa grad q(r_beta))
    bx, by, bz = surfaces.resolve(surface, x + beta * px, y + beta * py, z + beta * pz, beta * kappa)
    dx, dy, dz = surfaces.inner_gradient(surface, bx, by, bz, bx, by, bz)
    rx, ry, rz = kappa * dx, kappa * dy, kappa * dz
    q = surfaces.inner(surface, bx, by, bz)
    slope, _curvature = surfaces.gap_slope(surface, q, q)
    f = law_of.constraint_gradient(law, surfaces.gap_of(surface, q)) * slope
    mean = 0.5 * law_of.constraint(law, _gap(surface, x, y, z))
    mean += 0.5 * law_of.constraint(law, _gap(surface, x + px - rx, y + py - ry, z + pz - rz))
    force = law.alpha * mean + (0.0 if multiplier is None else multiplier)
    return rx, ry, rz, kappa - c * force * f


# --- A root in a bracket without derivatives -------------------------------------------------------------


@inlined
def illinois(low, f_low, high, f_high):
    """The next trial of regula falsi, the middle where that does not lie inside."""
    trial = low - f_low * (high - low) / (f_high - f_low)
    return trial if low < trial < high else 0.5 * (low + high)


@inlined
def narrowed(low, f_low, high, f_high, trial, f):
    """The half of the bracket that holds the root; the weight of an end that stays is halved (Illinois)."""
    if f * f_high > 0.0:
        return low, 0.5 * f_low, trial, f
    return trial, f, high, 0.5 * f_high
