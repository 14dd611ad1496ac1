"""The converged multiplier: in State I with g1 = 0 a step is a reflection about its discrete gradient.

v1 = v0 - 2 (v0.n) n with n parallel to D(r0, r1), r1 = r0 + h (v0 + v1)/2: it keeps |v| whatever the error of n.
Source: García Orden & Ortega 2007, eqs. (7), (8) in the limit V -> 0.
"""

import math

from .._jit import inlined, outlined, select
from ..surfaces import chain as walls

# A Newton step of the chord this small, relative to kappa, is the last: its square is below round-off.
_TOLERANCE = 1e-7


@inlined
def reflect(vx, vy, vz, nx, ny, nz, speed2, half_inverse):
    """v - 2 (v.n) n where v.n > 0, and the impulse per mass 2 v.n.

    Reflections alone lose energy linearly in their number, because the rounding of n has a bias (3.4e-13 after
    1e5 impacts). The factor, one Newton step of the square root of speed2/|v1|^2, keeps |v1|^2 at its first value.
    """
    b = vx * nx + vy * ny + vz * nz
    impulse = 2.0 * select(b > 0.0, b, 0.0)
    wx, wy, wz = vx - impulse * nx, vy - impulse * ny, vz - impulse * nz
    f = 1.0 + (speed2 - (wx * wx + wy * wy + wz * wz)) * half_inverse
    return wx * f, wy * f, wz * f, impulse


@inlined
def chord_step(chain, surface, x, y, z, px, py, pz, kappa):
    """One Newton step of the chord's kappa: (kappa, whether another is needed)."""
    step = walls.chord_improve(chain, surface, x, y, z, px, py, pz, kappa)
    # True for NaN.
    return kappa - step, not (abs(step) <= _TOLERANCE * abs(kappa))


@outlined
def chord(chain, surface, x, y, z, px, py, pz):
    """kappa of the chord, for one particle."""
    kappa = walls.chord_guess(chain, surface, x, y, z, px, py, pz)
    for _sweep in range(walls.chord_sweeps(chain)):
        kappa, more = chord_step(chain, surface, x, y, z, px, py, pz, kappa)
        if not more or math.isnan(kappa):
            break
    return kappa
