"""What holds for any smooth surface: a definition of every function that a file of a surface does not give itself.

Such a file gives phi and its gradient, or a better inner function q with `slope`, and how strongly q bends. Then the
first hit is found by safe steps, the discrete gradient is Gonzalez's, and what a quadric has in closed form is found by
Newton's method. These loops are not vectorised.
"""

import math

from ..kernel.jit import by_type, inlined, outlined, select
from . import base
from .course import rise_time

_EPSILON = 2.220446049250313e-16
# Steps of one march to the first hit; near the wall each one doubles the digits. What is not found by then goes on in
# the next pass. A fall may end before it meets the wall, which the march does not know: it looks less far ahead.
_MARCH = 200
_FALLING_MARCH = 16
# Bisections of an interval down to neighbouring numbers.
_BISECTIONS = 1100
# Newton steps of `push` and `resolve`, and of the chord; changes below this part of a step may be noise.
_ITERATIONS = 50
_NOISE = 1e-12


# --- What a file gives besides phi and its gradient ------------------------------------------------------


@by_type
def slope(surface, x, y, z):
    """grad q"""
    return base.gradient(surface, x, y, z)


@by_type
def hessian(surface, x, y, z):
    """H = grad grad q/2 as (xx, yy, zz, xy, yz, zx)."""
    raise NotImplementedError


@by_type
def difference(surface, x0, y0, z0, x1, y1, z1):
    """q1 - q0, without cancellation where the formula allows it."""
    return base.inner(surface, x1, y1, z1) - base.inner(surface, x0, y0, z0)


@by_type
def bend(surface, x, y, z):
    """Bounds of the eigenvalues of side H: (the largest one at most, their magnitude, the distance within which).

    Who gives it has the march of this file as `first_hit`, `falling_hit` and `safe_time`, unless it registers its own.
    The distance may only be infinite where there is no gravity.
    """
    raise NotImplementedError


@by_type
def clearance(surface, x, y, z):
    """A distance within which there is surely no wall; 0 says nothing."""
    return 0.0


@by_type
def passed(surface, x, y, z, vx, vy, vz):
    """Whether a straight flight will surely never meet the surface again."""
    return False


# --- The level set ---------------------------------------------------------------------------------------


@base.inner.register(object)
def _(surface, x, y, z):
    return base.phi(surface, x, y, z)


@base.gap_of.register(object)
def _(surface, q):
    return surface.side * q


@base.level_of.register(object)
def _(surface, q):
    return surface.side * q


@base.gap_slope.register(object)
def _(surface, q0, q1):
    return surface.side, 0.0


# --- Flight ----------------------------------------------------------------------------------------------


@bend.implies(base.first_hit)
def _first_hit(surface, x, y, z, vx, vy, vz):
    return _march(surface, x, y, z, vx, vy, vz, 0.0, 0.0, 0.0)


@bend.implies(base.safe_time)
def _safe_time(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    level, _half, step, _way = _safe_step(surface, x, y, z, vx, vy, vz, gx, gy, gz)
    return select(level > 0.0, 0.0, step)


@base.course.register(object)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    # No polynomial: nobody asks for it who has not given `is_quartic`. The compiler wants a type all the same.
    return 0.0, 0.0, 0.0, 0.0, 0.0, math.inf


@outlined
def _safe_step(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    """(level, half its derivative, a time during which the flight stays admissible, how far it goes at most)."""
    sx, sy, sz = slope(surface, x, y, z)
    side, level = surface.side, base.level_of(surface, base.inner(surface, x, y, z))
    half = 0.5 * side * (sx * vx + sy * vy + sz * vz)
    most, magnitude, reach = bend(surface, x, y, z)
    speed2 = vx * vx + vy * vy + vz * vz
    speed, pull = math.sqrt(speed2), math.sqrt(gx * gx + gy * gy + gz * gz)
    # level'' = 2 side (w.H w) + side grad q.G <= 2 M, where |w|^2 <= |v|^2 + 2 |G| s and grad q turns by 2 H s at most
    # on the way s: M = m0 + m1 s
    if pull == 0.0:
        m0, m1 = most * speed2, 0.0
    else:
        most = max(most, 0.0)
        m0 = most * speed2 + 0.5 * side * (sx * gx + sy * gy + sz * gz)
        m1 = (2.0 * most + magnitude) * pull
    step = _step_within(level, half, m0, m1, speed, pull, reach)
    if m1 > 0.0 and (step > 0.0 or m0 < 0.0):
        # Again with the M of a shorter way: of twice that step, or as far as a fall off the wall surely bends away.
        shorter = min(reach, max(2.0 * _travelled(speed, pull, step), -0.5 * m0 / m1))
        step = max(step, _step_within(level, half, m0, m1, speed, pull, shorter))
    clear = clearance(surface, x, y, z)
    if clear > 0.0:
        step = max(step, _time_to_travel(speed, pull, clear))
    return level, half, step, _travelled(speed, pull, step)


@inlined
def _step_within(level, half, m0, m1, speed, pull, reach):
    """The root of the parabola above the level, within the reach that bounds its bend."""
    bound = m0 + select(m1 > 0.0, m1 * reach, 0.0)
    return min(rise_time(level, half, bound), _time_to_travel(speed, pull, reach))


@inlined
def _time_to_travel(speed, pull, way):
    """The time t with speed t + pull t^2/2 = way."""
    twice = speed + (speed if pull == 0.0 else math.sqrt(speed * speed + 2.0 * pull * way))
    return 2.0 * way / twice if twice > 0.0 else math.inf


@inlined
def _travelled(speed, pull, t):
    return (speed + 0.5 * pull * t) * t


@bend.implies(base.falling_hit)
@outlined
def _march(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    """Safe steps to the first root of the level along the flight."""
    straight = gx == 0.0 and gy == 0.0 and gz == 0.0
    t, before = 0.0, 0.0
    for i in range(_MARCH if straight else _FALLING_MARCH):
        h = 0.5 * t
        px, py, pz = x + t * (vx + h * gx), y + t * (vy + h * gy), z + t * (vz + h * gz)
        wx, wy, wz = vx + t * gx, vy + t * gy, vz + t * gz
        level, half, step, way = _safe_step(surface, px, py, pz, wx, wy, wz, gx, gy, gz)
        if level > 0.0 and half > 0.0 and i > 0:
            # Past the wall by round-off, or because the surface bends more than its file says.
            return _bisected(surface, x, y, z, vx, vy, vz, gx, gy, gz, before, t), True
        if not step < math.inf or (straight and passed(surface, px, py, pz, wx, wy, wz)):
            return math.inf, True
        before, t = t, t + step
        # At t = 0 the sign of the approach decides, which rise_time has seen to.
        if (i > 0 or step == 0.0) and way <= 2.0 * _EPSILON * (abs(px) + abs(py) + abs(pz)):
            return t, True
    return t, False


# What `bend` implies.
MARCHES = (_first_hit, _march, _safe_time)


@outlined
def _bisected(surface, x, y, z, vx, vy, vz, gx, gy, gz, low, high):
    """The last time between two at which the level is not above 0."""
    for _i in range(_BISECTIONS):
        t = 0.5 * (low + high)
        if not low < t < high:
            break
        h = 0.5 * t
        px, py, pz = x + t * (vx + h * gx), y + t * (vy + h * gy), z + t * (vz + h * gz)
        if base.level_of(surface, base.inner(surface, px, py, pz)) > 0.0:
            high = t
        else:
            low = t
    return low


# --- Contact ---------------------------------------------------------------------------------------------


@base.unit_normal.register(object)
def _(surface, x, y, z):
    gx, gy, gz = base.gradient(surface, x, y, z)
    k = surface.side / math.sqrt(gx * gx + gy * gy + gz * gz)
    return k * gx, k * gy, k * gz


@base.inner_gradient.register(object)
def _(surface, x0, y0, z0, x1, y1, z1):
    # Gonzalez: grad q(m) + (q1 - q0 - grad q(m).d)/|d|^2 d
    gx, gy, gz = slope(surface, 0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (z0 + z1))
    dx, dy, dz = x1 - x0, y1 - y0, z1 - z0
    d2 = dx * dx + dy * dy + dz * dz
    f = (difference(surface, x0, y0, z0, x1, y1, z1) - gx * dx - gy * dy - gz * dz) / select(d2 > 0.0, d2, 1.0)
    return gx + f * dx, gy + f * dy, gz + f * dz


@base.push.register(object)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    dx, dy, dz = _moved(surface, x0, y0, z0, px, py, pz, kappa)
    return x0 + dx, y0 + dy, z0 + dz


@inlined
def _settled(change, previous, size):
    """Whether an iteration has reached round-off: its change is below it, or is near it and shrinks no more."""
    return change <= _EPSILON * size or (change >= previous and change <= _NOISE * size)


@inlined
def _unpushed(surface, x, y, z, strength, fx, fy, fz):
    """(I + strength H)^-1 f, H at a point, by the adjugate."""
    xx, yy, zz, xy, yz, zx = hessian(surface, x, y, z)
    a, b, c = 1.0 + strength * xx, 1.0 + strength * yy, 1.0 + strength * zz
    d, e, f = strength * xy, strength * yz, strength * zx
    aa, ab, ac = b * c - e * e, f * e - d * c, d * e - f * b
    bb, bc, cc = a * c - f * f, d * f - a * e, a * b - d * d
    inverse = 1.0 / (a * aa + d * ab + f * ac)
    return (
        inverse * (aa * fx + ab * fy + ac * fz),
        inverse * (ab * fx + bb * fy + bc * fz),
        inverse * (ac * fx + bc * fy + cc * fz),
    )


@outlined
def _moved(surface, x0, y0, z0, px, py, pz, kappa):
    """r1 - r0 = p - kappa D(r0, r1) by Newton's method with the H of the midpoint; NaN where it does not converge."""
    dx, dy, dz = _unpushed(surface, x0, y0, z0, kappa, px, py, pz)
    size, previous = max(abs(px), abs(py), abs(pz)), math.inf
    for _i in range(_ITERATIONS):
        gx, gy, gz = base.inner_gradient(surface, x0, y0, z0, x0 + dx, y0 + dy, z0 + dz)
        fx, fy, fz = dx - px + kappa * gx, dy - py + kappa * gy, dz - pz + kappa * gz
        fx, fy, fz = _unpushed(surface, x0 + 0.5 * dx, y0 + 0.5 * dy, z0 + 0.5 * dz, kappa, fx, fy, fz)
        dx, dy, dz = dx - fx, dy - fy, dz - fz
        change = max(abs(fx), abs(fy), abs(fz))
        pushed = abs(kappa) * max(abs(gx), abs(gy), abs(gz))
        if _settled(change, previous, max(size, pushed)):
            return dx, dy, dz
        previous = change
    return math.nan, math.nan, math.nan


@base.resolve.register(object)
def _(surface, x, y, z, strength):
    return _resolved(surface, x, y, z, strength)


@outlined
def _resolved(surface, x, y, z, strength):
    sx, sy, sz = x, y, z
    size, previous = max(abs(x), abs(y), abs(z)), math.inf
    for _i in range(_ITERATIONS):
        gx, gy, gz = slope(surface, sx, sy, sz)
        fx, fy, fz = sx - x + strength * gx, sy - y + strength * gy, sz - z + strength * gz
        fx, fy, fz = _unpushed(surface, sx, sy, sz, 2.0 * strength, fx, fy, fz)
        sx, sy, sz = sx - fx, sy - fy, sz - fz
        change = max(abs(fx), abs(fy), abs(fz))
        pushed = abs(strength) * max(abs(gx), abs(gy), abs(gz))
        if _settled(change, previous, max(size, pushed)):
            return sx, sy, sz
        previous = change
    return math.nan, math.nan, math.nan


@base.rise.register(object)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    dx, dy, dz = _moved(surface, x0, y0, z0, px, py, pz, kappa)
    x1, y1, z1 = x0 + dx, y0 + dy, z0 + dz
    gx, gy, gz = base.inner_gradient(surface, x0, y0, z0, x1, y1, z1)
    # dr1/dkappa = -(I + kappa H)^-1 D, H of the midpoint: the derivative is as good as the step is short.
    fx, fy, fz = _unpushed(surface, x0 + 0.5 * dx, y0 + 0.5 * dy, z0 + 0.5 * dz, kappa, gx, gy, gz)
    ex, ey, ez = slope(surface, x1, y1, z1)
    return gx * dx + gy * dy + gz * dz, -(fx * ex + fy * ey + fz * ez)


@base.chord_guess.register(object)
def _(surface, x, y, z, px, py, pz):
    return -base.chord_improve(surface, x, y, z, px, py, pz, 0.0)


@base.chord_improve.register(object)
def _(surface, x, y, z, px, py, pz, kappa):
    risen, steepness = base.rise(surface, x, y, z, px, py, pz, kappa)
    return risen / steepness


@base.chord_sweeps.register(object)
def _(surface):
    return _ITERATIONS


@base.chord_normal.register(object)
def _(surface, x, y, z, px, py, pz, kappa):
    x1, y1, z1 = base.push(surface, x, y, z, px, py, pz, kappa)
    gx, gy, gz = base.inner_gradient(surface, x, y, z, x1, y1, z1)
    k = surface.side / math.sqrt(gx * gx + gy * gy + gz * gz)
    return k * gx, k * gy, k * gz


@base.settle.register(object)
def _(surface, x, y, z):
    gx, gy, gz = base.gradient(surface, x, y, z)
    f = base.phi(surface, x, y, z) / (gx * gx + gy * gy + gz * gz)
    return x - f * gx, y - f * gy, z - f * gz
