"""Steps in contact by Newton's method, from `hessian`; of a wall that turns with its tilt, see in_motion/turned.py."""

import math

from ..kernel.jit import outlined
from ..kernel.limits import EPSILON
from ..kernel.vector import Vec, cross, dot, largest

# The most Newton steps; changes below this part of a step may be noise.
_ITERATIONS = 50
_NOISE = 1e-12


def push(surface, r0, p, kappa, tilt=None):
    """Return the end of the step."""
    return r0 + _moved(surface, r0, p, kappa, tilt)


def rise(surface, r0, p, kappa, tilt=None):
    """Return q1 - q0 of the step, and its derivative by kappa."""
    d = _moved(surface, r0, p, kappa, tilt)
    r1 = r0 + d
    g = surface.discrete_gradient(r0, r1)
    # dr1/dkappa = -(I + kappa H)^-1 D, with H of the midpoint: the error of the derivative falls with the step.
    f = _unpushed(surface.step_bend(r0, d), kappa, _tilted(g, tilt))
    return dot(g, d), -dot(f, surface.inner_gradient(r1))


def _tilted(g, tilt):
    """Q g = g - tilt x g"""
    return g if tilt is None else g - cross(tilt, g)


@outlined
def _moved(surface, r0, p, kappa, tilt):
    """Return r1 - r0 = p - kappa Q D(r0, r1), with H of the midpoint; NaN where it does not converge."""
    d = _unpushed(surface.hessian(r0), kappa, p)
    size, previous = largest(p), math.inf
    for _i in range(_ITERATIONS):
        g = surface.discrete_gradient(r0, r0 + d)
        f = _unpushed(surface.step_bend(r0, d), kappa, d - p + kappa * _tilted(g, tilt))
        d, change = d - f, largest(f)
        if _converged(change, previous, max(size, abs(kappa) * largest(g))):
            return d
        previous = change
    return Vec(math.nan, math.nan, math.nan)


@outlined
def resolve(surface, r, strength):
    """Return the point s with s + strength grad q(s) = r; NaN where it does not converge."""
    s, size, previous = r, largest(r), math.inf
    for _i in range(_ITERATIONS):
        g = surface.inner_gradient(s)
        f = _unpushed(surface.hessian(s), 2.0 * strength, s - r + strength * g)
        s, change = s - f, largest(f)
        if _converged(change, previous, max(size, abs(strength) * largest(g))):
            return s
        previous = change
    return Vec(math.nan, math.nan, math.nan)


def _unpushed(h, strength, f):
    """Return (I + strength H)^-1 f by the adjugate."""
    a, b, c = 1.0 + strength * h.xx, 1.0 + strength * h.yy, 1.0 + strength * h.zz
    d, e, g = strength * h.xy, strength * h.yz, strength * h.zx
    aa, ab, ac = b * c - e * e, g * e - d * c, d * e - g * b
    bb, bc, cc = a * c - g * g, d * g - a * e, a * b - d * d
    inverse = 1.0 / (a * aa + d * ab + g * ac)
    return inverse * Vec(dot(Vec(aa, ab, ac), f), dot(Vec(ab, bb, bc), f), dot(Vec(ac, bc, cc), f))


def _converged(change, previous, size):
    """Whether an iteration has reached round-off: its change is below it, or is near it and no longer shrinks."""
    return change <= EPSILON * size or (change >= previous and change <= _NOISE * size)
