"""The converged multiplier: in State I with g1 = 0 a step is a reflection about its discrete gradient.

With w0 = v0 + h G/2 and w1 = v1 - h G/2, a contact step of length h is w1 = w0 - 2 (w0.n) n with n parallel to
D(r0, r1), and r1 = r0 + h (w0 + w1)/2. It keeps the energy whatever the error of n.
Source: García Orden & Ortega 2007, eqs. (7), (8) in the limit V -> 0.
"""

import math

from ..kernel.gravity import Gravity, Nothing, accelerated, potential
from ..kernel.jit import by_type, by_type_outlined, inlined, outlined, select
from ..surfaces import base as surfaces
from ..surfaces import chain as walls
from ..surfaces import flights

# A Newton step of the chord this small, relative to kappa, is the last: its square is below round-off.
_TOLERANCE = 1e-7
# |v|^2 is restored where it is off by no more than this part: a particle that all but stands still has no digits of it.
_NEAR = 0.1
# What a chord asks of every wall.
CHORD_NEEDS = (surfaces.chord_guess, surfaces.chord_improve, surfaces.chord_normal, surfaces.first_hit, surfaces.settle)


# --- The energy that a contact leaves --------------------------------------------------------------------


@by_type
def speed2_at(gravity, x, y, z, twice_energy, half_inverse):
    """|v|^2 that twice the energy per mass leaves at a point, and 1/(2 |v|^2); without gravity both are given."""
    raise NotImplementedError


@speed2_at.register(Nothing)
def _(gravity, x, y, z, twice_energy, half_inverse):
    return twice_energy, half_inverse


@speed2_at.register(Gravity)
def _(gravity, x, y, z, twice_energy, half_inverse):
    speed2 = twice_energy - 2.0 * potential(gravity, x, y, z)
    moving = speed2 > 0.0
    speed2 = select(moving, speed2, 0.0)
    return speed2, 0.5 / select(moving, speed2, 1.0)


@by_type
def restore(gravity, wx, wy, wz, speed2, half_inverse):
    """A velocity scaled so that its square is speed2, from within round-off, by one Newton step of the square root."""
    raise NotImplementedError


@restore.register(Nothing)
def _(gravity, wx, wy, wz, speed2, half_inverse):
    f = 1.0 + (speed2 - (wx * wx + wy * wy + wz * wz)) * half_inverse
    return wx * f, wy * f, wz * f


@restore.register(Gravity)
def _(gravity, wx, wy, wz, speed2, half_inverse):
    f = (speed2 - (wx * wx + wy * wy + wz * wz)) * half_inverse
    f = 1.0 + select(abs(f) <= _NEAR, f, 0.0)
    return wx * f, wy * f, wz * f


# --- Restitution: None where no surface loses energy, else a chain of numbers ----------------------------


@by_type
def bounciness(restitution, surface):
    """1 + e of a surface."""
    raise NotImplementedError


@bounciness.register(Nothing)
def _(restitution, surface):
    return 2.0


@bounciness.register(walls.Chain)
def _(restitution, surface):
    return 1.0 + _of(restitution, surface)


@by_type
def _of(restitution, surface):
    return 1.0


@_of.register(walls.Chain)
def _(restitution, surface):
    return select(surface == 0.0, restitution.first, _of(restitution.rest, surface - 1.0))


@by_type
def lost(restitution, surface, b):
    """Twice the energy per mass that an impact with normal velocity b loses, (1 - e^2) b^2."""
    raise NotImplementedError


@lost.register(Nothing)
def _(restitution, surface, b):
    return 0.0


@lost.register(walls.Chain)
def _(restitution, surface, b):
    e = _of(restitution, surface)
    return (1.0 - e) * (1.0 + e) * b * b


@by_type
def half_inverse_after(restitution, speed2, wx, wy, wz, before):
    """1/(2 |v|^2) after a loss; 0 where so little is left that it is round-off of what was lost: not to be restored."""
    return before


@half_inverse_after.register(walls.Chain)
def _(restitution, speed2, wx, wy, wz, before):
    near = abs(speed2 - (wx * wx + wy * wy + wz * wz)) <= 2.0 * _NEAR * speed2
    return select(near & (speed2 > 0.0), 0.5 / select(speed2 > 0.0, speed2, 1.0), 0.0)


# --- The reflection --------------------------------------------------------------------------------------


@inlined
def exact(restitution, chain, gravity, surface, x, y, z, vx, vy, vz, twice_energy, half_inverse):
    """v - (1 + e) (v.n) n where v.n > 0: velocity, impulse per mass, twice the energy per mass.

    Reflections alone lose energy linearly in their number, because the rounding of n has a bias (3.4e-13 after
    1e5 impacts). Restoring |v|^2 from the energy keeps it at its first value.
    """
    nx, ny, nz = walls.unit_normal(chain, surface, x, y, z)
    b = vx * nx + vy * ny + vz * nz
    b = select(b > 0.0, b, 0.0)
    impulse = bounciness(restitution, surface) * b
    wx, wy, wz = vx - impulse * nx, vy - impulse * ny, vz - impulse * nz
    twice_energy = twice_energy - lost(restitution, surface, b)
    speed2, half_inverse = speed2_at(gravity, x, y, z, twice_energy, half_inverse)
    half_inverse = half_inverse_after(restitution, speed2, wx, wy, wz, half_inverse)
    wx, wy, wz = restore(gravity, wx, wy, wz, speed2, half_inverse)
    return wx, wy, wz, impulse, twice_energy


@inlined
def mirrored(wx, wy, wz, nx, ny, nz):
    """w - 2 (w.n) n where w.n > 0, and the impulse per mass 2 w.n."""
    b = wx * nx + wy * ny + wz * nz
    impulse = 2.0 * select(b > 0.0, b, 0.0)
    return wx - impulse * nx, wy - impulse * ny, wz - impulse * nz, impulse


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
def chord_turn(chain, gravity, surface, x, y, z, vx, vy, vz, h, kappa):
    """v1 of the chord step of length h, before its energy is restored, and the impulse per mass."""
    wx, wy, wz = accelerated(gravity, vx, vy, vz, 0.5 * h)
    nx, ny, nz = walls.chord_normal(chain, surface, x, y, z, h * wx, h * wy, h * wz, kappa)
    wx, wy, wz, impulse = mirrored(wx, wy, wz, nx, ny, nz)
    wx, wy, wz = accelerated(gravity, wx, wy, wz, 0.5 * h)
    return wx, wy, wz, impulse


@inlined
def chord_end(chain, gravity, surface, x, y, z, vx, vy, vz, wx, wy, wz, h, twice_energy, half_inverse):
    """The end of that step, r1 and v1, and whether no other wall cuts it: (v0 + v1)/2 = (r1 - r0)/h."""
    ux, uy, uz = 0.5 * (vx + wx), 0.5 * (vy + wy), 0.5 * (vz + wz)
    cut, _other = flights.other_hit(chain, surface, x, y, z, ux, uy, uz)
    ox, oy, oz = walls.settle(chain, surface, x + h * ux, y + h * uy, z + h * uz)
    speed2, half_inverse = speed2_at(gravity, ox, oy, oz, twice_energy, half_inverse)
    wx, wy, wz = restore(gravity, wx, wy, wz, speed2, half_inverse)
    return ox, oy, oz, wx, wy, wz, cut > h


@by_type_outlined
def contact(contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, left, twice_energy, half_inverse):
    """The contact step of one particle, None or h: (x, y, z, vx, vy, vz, time used, impulse per mass)."""
    raise NotImplementedError


@contact.register(Nothing)
def _(contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, left, twice_energy, half_inverse):
    wx, wy, wz, given, _energy = exact(None, chain, gravity, surface, x, y, z, vx, vy, vz, twice_energy, half_inverse)
    return x, y, z, wx, wy, wz, 0.0, given


@contact.register(float)
def _(contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, left, twice_energy, half_inverse):
    h = min(contact_step, left)
    px, py, pz = accelerated(gravity, vx, vy, vz, 0.5 * h)
    kappa = chord(chain, surface, x, y, z, h * px, h * py, h * pz)
    wx, wy, wz, given = chord_turn(chain, gravity, surface, x, y, z, vx, vy, vz, h, kappa)
    ox, oy, oz, wx, wy, wz, stays = chord_end(
        chain, gravity, surface, x, y, z, vx, vy, vz, wx, wy, wz, h, twice_energy, half_inverse
    )
    if stays and given > 0.0:
        return ox, oy, oz, wx, wy, wz, h, given
    # A chord that another wall would cut, or that a solid does not oppose (the free flight of length h ends outside it
    # again), gives way to the exact reflection.
    return contact(None, chain, gravity, surface, x, y, z, vx, vy, vz, left, twice_energy, half_inverse)
