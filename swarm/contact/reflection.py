"""The converged multiplier: in State I with g1 = 0 a step is a reflection about its discrete gradient.

v1 = v0 - 2 (v0.n) n with n parallel to D(r0, r1), r1 = r0 + h (v0 + v1)/2: it keeps |v| whatever the error of n.
Source: García Orden & Ortega 2007, eqs. (7), (8) in the limit V -> 0.
"""

import math

from .._jit import by_type_outlined, inlined, outlined, select
from ..surfaces import chain as walls

# A Newton step of the chord this small, relative to kappa, is the last: its square is below round-off.
_TOLERANCE = 1e-7
# A second wall nearer than this part of the shortest flight is met in the same instant.
_SAME_INSTANT = 1e-6


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


@inlined
def exact(chain, surface, x, y, z, vx, vy, vz, speed2, half_inverse):
    """The exact reflection: velocity and impulse per mass."""
    nx, ny, nz = walls.unit_normal(chain, surface, x, y, z)
    return reflect(vx, vy, vz, nx, ny, nz, speed2, half_inverse)


@inlined
def along(chain, surface, x, y, z, vx, vy, vz, wx, wy, wz, h):
    """The end of the chord step, (v0 + v1)/2 = (r1 - r0)/h, and whether no other wall cuts it."""
    ux, uy, uz = 0.5 * (vx + wx), 0.5 * (vy + wy), 0.5 * (vz + wz)
    cut, _other = walls.other_hit(chain, surface, x, y, z, ux, uy, uz)
    ox, oy, oz = walls.settle(chain, surface, x + h * ux, y + h * uy, z + h * uz)
    return ox, oy, oz, cut > h


# --- One impact of one particle --------------------------------------------------------------------------


@by_type_outlined
def contact(contact_step, chain, surface, x, y, z, vx, vy, vz, left, speed2, half_inverse):
    """The contact step, None or h: (x, y, z, vx, vy, vz, time used, impulse per mass)."""
    raise NotImplementedError


@contact.register(type(None))
def _(contact_step, chain, surface, x, y, z, vx, vy, vz, left, speed2, half_inverse):
    wx, wy, wz, given = exact(chain, surface, x, y, z, vx, vy, vz, speed2, half_inverse)
    return x, y, z, wx, wy, wz, 0.0, given


@contact.register(float)
def _(contact_step, chain, surface, x, y, z, vx, vy, vz, left, speed2, half_inverse):
    h = min(contact_step, left)
    kappa = chord(chain, surface, x, y, z, h * vx, h * vy, h * vz)
    nx, ny, nz = walls.chord_normal(chain, surface, x, y, z, h * vx, h * vy, h * vz, kappa)
    wx, wy, wz, given = reflect(vx, vy, vz, nx, ny, nz, speed2, half_inverse)
    ox, oy, oz, stays = along(chain, surface, x, y, z, vx, vy, vz, wx, wy, wz, h)
    if stays and given > 0.0:
        return ox, oy, oz, wx, wy, wz, h, given
    # A chord that another wall would cut, or that a solid does not oppose (the free flight of length h ends outside it
    # again), gives way to the exact reflection.
    wx, wy, wz, given = exact(chain, surface, x, y, z, vx, vy, vz, speed2, half_inverse)
    return x, y, z, wx, wy, wz, 0.0, given


@outlined
def impact(contact_step, chain, surface, x, y, z, vx, vy, vz, left, speed2, half_inverse, shortest, impulse, lane):
    """An impact that may graze: (x, y, z, vx, vy, vz, time used); adds to `impulse[surface, lane]`.

    If the next flight, back to the same wall, would be shorter than `shortest`, the particle grazes: it takes a chord
    step of that length instead.
    """
    wx, wy, wz, given = exact(chain, surface, x, y, z, vx, vy, vz, speed2, half_inverse)
    used = 0.0
    if walls.hit_of(chain, surface, x, y, z, wx, wy, wz) < shortest:
        # How far along the wall until another wall is in the way?
        tx, ty, tz = 0.5 * (vx + wx), 0.5 * (vy + wy), 0.5 * (vz + wz)
        cut, other = walls.other_hit(chain, surface, x, y, z, tx, ty, tz)
        ax, ay, az, blow = exact(chain, other, x, y, z, vx, vy, vz, speed2, half_inverse)
        if cut < _SAME_INSTANT * shortest and blow > 0.0:
            # Both walls at once: the blow of the other one comes first, this one is met again in the next pass.
            impulse[int(other), lane] += blow
            return x, y, z, ax, ay, az, 0.0
        # Half way to the other wall at most: the chord bends towards the inside, and what is left halves.
        h = min(shortest, left, 0.5 * cut)
        x, y, z, wx, wy, wz, used, given = contact(h, chain, surface, x, y, z, vx, vy, vz, left, speed2, half_inverse)
        ex, ey, ez = x + h * wx, y + h * wy, z + h * wz
        cut, other = walls.other_hit(chain, surface, x, y, z, wx, wy, wz)
        if used == 0.0 and cut > h and not walls.outside(chain, -1.0, ex, ey, ez):
            # The wall curves away from the flight (a solid that is only touched): the sign of v.n is round-off.
            x, y, z, used = ex, ey, ez, h
    else:
        x, y, z, wx, wy, wz, used, given = contact(
            contact_step, chain, surface, x, y, z, vx, vy, vz, left, speed2, half_inverse
        )
    impulse[int(surface), lane] += given
    return x, y, z, wx, wy, wz, used
