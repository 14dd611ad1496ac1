"""The contract of a surface: every function that kernels ask of one, required or derived, with its definition.

A surface is an implicit function phi(r): below 0 inside, 0 on it, above 0 outside. Its numbers are a NamedTuple, whose
field `side` is +1 for a cavity (phi <= 0 is admissible) and -1 for a solid (phi >= 0). The *gap* is g = side phi,
admissible where g <= 0.

phi is a function of a smooth inner function q(r), phi = phi(q(r)). A divided difference times a discrete gradient of
q is then a discrete gradient of anything built on phi (the composite gradient), even where the penalty has a corner.

Required are `phi`, `gradient` and one of
    first_hit (and falling_hit under gravity)   the first hit of a flight in closed form,
    course                                      the level along a fall as a quartic,
    bend                                        how strongly q bends at most: the hit is found by safe steps;
methods that take steps in contact need `hessian` too, and `farthest_push`, unless they are given what is derived of it.
Everything else has a definition here, and a surface registers its own only where that is faster or more exact. Who has
an inner function other than phi registers `inner`, `slope`, `gap_of`, `level_of` and `gap_slope` for it.
`required.py` says in one sentence, before anything is compiled, what a surface lacks for a method.
"""

import math

from ..kernel.jit import by_type, inlined, outlined, select
from ..kernel.vector import Vec, absolute, dot, largest, norm, square, times, total
from .course import Quartic, first_rise, rise_time, safe_rise_time

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


# --- Required: the level set -----------------------------------------------------------------------------


@by_type
def phi(surface, r):
    """The implicit function at one point (or, in Python, at arrays of points)."""
    raise NotImplementedError


@by_type
def gradient(surface, r):
    """Gradient of phi."""
    raise NotImplementedError


@by_type
def hessian(surface, r):
    """H = grad grad q/2, a `Symmetric`: of steps in contact that have no closed form."""
    raise NotImplementedError


@by_type
def bend(surface, r):
    """Bounds of the eigenvalues of side H: (the largest one at most, their magnitude, the distance within which).

    The distance may only be infinite where there is no gravity.
    """
    raise NotImplementedError


@by_type
def farthest_push(surface):
    """The kappa up to which `push` is continuous from 0 on, with the sign in which the surface pushes."""
    raise NotImplementedError


# --- The inner function and the gap ----------------------------------------------------------------------


@by_type
def inner(surface, r):
    """The inner function q(r)."""
    return phi(surface, r)


@by_type
def slope(surface, r):
    """grad q"""
    return gradient(surface, r)


@by_type
def difference(surface, r0, r1):
    """q1 - q0, without cancellation where the formula allows it."""
    return inner(surface, r1) - inner(surface, r0)


@by_type
def gap_of(surface, q):
    """The signed gap g as a function of q."""
    return surface.side * q


@by_type
def level_of(surface, q):
    """A number of the same sign as the gap, for decisions; cheaper where the gap takes a square root."""
    return gap_of(surface, q)


@by_type
def gap_slope(surface, q0, q1):
    """Divided difference g[q0, q1] = (g1 - g0)/(q1 - q0), without cancellation, and its derivative by q1.

    The derivative must be exact: the solve stops where the square of its last Newton step is below round-off.
    """
    return surface.side, 0.0


@by_type
def distance(surface, r):
    """Signed distance outside, to first order: g/|grad g|."""
    return gap_of(surface, inner(surface, r)) / norm(gradient(surface, r))


@by_type
def gap_scale(surface, r):
    """How far the gap moves at most when each coordinate moves by its own size: where its last bits are."""
    return total(absolute(times(gradient(surface, r), r)))


@by_type
def unit_normal(surface, r):
    """Unit vector along the gradient of the gap, out of the admissible side."""
    n = gradient(surface, r)
    return n * (surface.side / norm(n))


@by_type
def settle(surface, r):
    """A point within round-off of the surface, moved onto it: one Newton step along the gradient."""
    n = gradient(surface, r)
    return r - (phi(surface, r) / square(n)) * n


@by_type
def flat(surface):
    """Whether the normal is the same everywhere on a wall: a constant for the compiler."""
    return False


# --- Flight ----------------------------------------------------------------------------------------------


@by_type
def first_hit(surface, r, v):
    """When the straight flight r + v t leaves the admissible side: (time, whether it does then).

    Where the second is False the flight surely stays admissible until then, and more cannot be said without more work;
    an infinite time means never. A particle on the surface that moves inward does not hit it at time 0: the sign of the
    approach decides, not an epsilon. At a point outside by round-off the time is 0 if the particle moves outward.
    """
    raise NotImplementedError


@by_type
def falling_hit(surface, r, v, pull):
    """`first_hit` for the parabola r + v t + G t^2/2."""
    raise NotImplementedError


@by_type
def safe_time(surface, r, v, pull):
    """A time during which that parabola surely stays admissible: a lower bound, cheap.

    0 says nothing: a method then takes every one of its steps.
    """
    return 0.0


@by_type
def course(surface, r, v, pull):
    """The level along that parabola as a `Quartic`; only what `is_quartic` has one."""
    # The compiler wants a type.
    return Quartic(0.0, 0.0, 0.0, 0.0, 0.0, math.inf)


@by_type
def is_quartic(surface):
    """Whether the surface has a `course`: a constant for the compiler."""
    return False


@by_type
def may_be_far(surface):
    """Whether its `course` may be one from afar: a constant for the compiler."""
    return True


@course.implies(falling_hit)
def _(surface, r, v, pull):
    return first_rise(may_be_far(surface), course(surface, r, v, pull))


@course.implies(safe_time)
def _(surface, r, v, pull):
    return safe_rise_time(course(surface, r, v, pull))


@by_type
def clearance(surface, r):
    """Lower bound of the distance to the wall; 0 if unknown."""
    return 0.0


@by_type
def passed(surface, r, v):
    """Whether a straight flight surely never meets the surface again."""
    return False


@bend.implies(first_hit)
def _(surface, r, v):
    return march(surface, r, v, Vec(0.0, 0.0, 0.0))


@bend.implies(falling_hit)
def _(surface, r, v, pull):
    return march(surface, r, v, pull)


@bend.implies(safe_time)
def _(surface, r, v, pull):
    level, _half, step, _way = _safe_step(surface, r, v, pull)
    return select(level > 0.0, 0.0, step)


@outlined
def march(surface, r, v, pull):
    """Safe steps to the first root of the level along the flight."""
    straight = pull.x == 0.0 and pull.y == 0.0 and pull.z == 0.0
    t, before = 0.0, 0.0
    for i in range(_MARCH if straight else _FALLING_MARCH):
        p, w = r + t * (v + (0.5 * t) * pull), v + t * pull
        level, half, step, way = _safe_step(surface, p, w, pull)
        if level > 0.0 and half > 0.0 and i > 0:
            # Past the wall by round-off, or because the surface bends more than its file says.
            return bisected(surface, r, v, pull, before, t), True
        if not step < math.inf or (straight and passed(surface, p, w)):
            return math.inf, True
        before, t = t, t + step
        # At t = 0 the sign of the approach decides, which rise_time has seen to.
        if (i > 0 or step == 0.0) and way <= 2.0 * _EPSILON * total(absolute(p)):
            return t, True
    return t, False


@outlined
def bisected(surface, r, v, pull, low, high):
    """The last time between two at which the level is not above 0."""
    for _i in range(_BISECTIONS):
        t = 0.5 * (low + high)
        if not low < t < high:
            break
        if level_of(surface, inner(surface, r + t * (v + (0.5 * t) * pull))) > 0.0:
            high = t
        else:
            low = t
    return low


@outlined
def _safe_step(surface, r, v, pull):
    """(level, half its derivative, a time during which the flight stays admissible, how far it goes at most)."""
    n = slope(surface, r)
    side, level = surface.side, level_of(surface, inner(surface, r))
    half = 0.5 * side * dot(n, v)
    most, magnitude, reach = bend(surface, r)
    speed2 = square(v)
    speed, g = math.sqrt(speed2), norm(pull)
    # level'' = 2 side (w.H w) + side grad q.G <= 2 M, where |w|^2 <= |v|^2 + 2 |G| s and grad q turns by 2 H s at most
    # on the way s: M = m0 + m1 s
    if g == 0.0:
        m0, m1 = most * speed2, 0.0
    else:
        most = max(most, 0.0)
        m0 = most * speed2 + 0.5 * side * dot(n, pull)
        m1 = (2.0 * most + magnitude) * g
    step = _step_within(level, half, m0 + select(m1 > 0.0, m1 * reach, 0.0), _time_to_travel(speed, g, reach))
    if m1 > 0.0 and (step > 0.0 or m0 < 0.0):
        # Again with the M of a shorter way: of twice that step, or as far as a fall off the wall surely bends away.
        shorter = min(reach, max(2.0 * _travelled(speed, g, step), -0.5 * m0 / m1))
        within = _step_within(level, half, m0 + select(m1 > 0.0, m1 * shorter, 0.0), _time_to_travel(speed, g, shorter))
        step = max(step, within)
    clear = clearance(surface, r)
    if clear > 0.0:
        step = max(step, _time_to_travel(speed, g, clear))
    return level, half, step, _travelled(speed, g, step)


@inlined
def _step_within(level, half, bound, longest):
    """The root of the parabola above the level, within the time in which its bound holds."""
    return min(rise_time(level, half, bound), longest)


@inlined
def _time_to_travel(speed, g, way):
    """The time t with speed t + g t^2/2 = way."""
    twice = speed + (speed if g == 0.0 else math.sqrt(speed * speed + 2.0 * g * way))
    return 2.0 * way / twice if twice > 0.0 else math.inf


@inlined
def _travelled(speed, g, t):
    return (speed + 0.5 * g * t) * t


# --- Contact: a step r1 = r0 + p - kappa D(r0, r1) with the free displacement p = h v0 + h^2 G/2 ---------


@by_type
def inner_gradient(surface, r0, r1):
    """Discrete gradient of q: D.(r1 - r0) = q1 - q0. Gonzalez's; grad q(m) of the midpoint m for a quadric."""
    # grad q(m) + (q1 - q0 - grad q(m).d)/|d|^2 d
    g = slope(surface, Vec(0.5 * (r0.x + r1.x), 0.5 * (r0.y + r1.y), 0.5 * (r0.z + r1.z)))
    d = r1 - r0
    d2 = square(d)
    rest = difference(surface, r0, r1) - g.x * d.x - g.y * d.y - g.z * d.z
    return g + (rest / select(d2 > 0.0, d2, 1.0)) * d


@by_type
def push(surface, r0, p, kappa):
    """The end r1 of the step."""
    return r0 + _moved(surface, r0, p, kappa)


@by_type
def rise(surface, r0, p, kappa):
    """q1 - q0 = D.(r1 - r0) of the step, without cancellation, and its derivative by kappa."""
    d = _moved(surface, r0, p, kappa)
    r1 = r0 + d
    g = inner_gradient(surface, r0, r1)
    # dr1/dkappa = -(I + kappa H)^-1 D, H of the midpoint: the derivative is as good as the step is short.
    f = _unpushed(surface, r0 + 0.5 * d, kappa, g)
    return dot(g, d), -dot(f, slope(surface, r1))


@by_type
def resolve(surface, r, strength):
    """The point s with s + strength grad q(s) = r, for the mean-value form."""
    return _resolved(surface, r, strength)


@by_type
def chord_guess(surface, r, p):
    """First guess of the kappa for which a step from r0 on the surface ends on it; exact if `chord_sweeps` is 0."""
    return -chord_improve(surface, r, p, 0.0)


@by_type
def chord_improve(surface, r, p, kappa):
    """Newton step of that kappa, to be subtracted."""
    risen, steepness = rise(surface, r, p, kappa)
    return risen / steepness


@by_type
def chord_sweeps(surface):
    """The most steps of `chord_improve` it takes: a constant for the compiler, 0 where the guess is exact."""
    return _ITERATIONS


@by_type
def chord_normal(surface, r, p, kappa):
    """Unit normal of that step, parallel to D(r0, r1) and out of the admissible side; for p = 0 it is `unit_normal`."""
    n = inner_gradient(surface, r, push(surface, r, p, kappa))
    return n * (surface.side / norm(n))


@inlined
def _unpushed(surface, r, strength, f):
    """(I + strength H)^-1 f, H at a point, by the adjugate."""
    h = hessian(surface, r)
    a, b, c = 1.0 + strength * h.xx, 1.0 + strength * h.yy, 1.0 + strength * h.zz
    d, e, g = strength * h.xy, strength * h.yz, strength * h.zx
    aa, ab, ac = b * c - e * e, g * e - d * c, d * e - g * b
    bb, bc, cc = a * c - g * g, d * g - a * e, a * b - d * d
    inverse = 1.0 / (a * aa + d * ab + g * ac)
    return inverse * Vec(dot(Vec(aa, ab, ac), f), dot(Vec(ab, bb, bc), f), dot(Vec(ac, bc, cc), f))


@outlined
def _moved(surface, r0, p, kappa):
    """r1 - r0 = p - kappa D(r0, r1) by Newton's method with the H of the midpoint; NaN where it does not converge."""
    d = _unpushed(surface, r0, kappa, p)
    size, previous = largest(p), math.inf
    for _i in range(_ITERATIONS):
        g = inner_gradient(surface, r0, r0 + d)
        f = _unpushed(surface, r0 + 0.5 * d, kappa, d - p + kappa * g)
        d, change = d - f, largest(f)
        if _converged(change, previous, max(size, abs(kappa) * largest(g))):
            return d
        previous = change
    return Vec(math.nan, math.nan, math.nan)


@outlined
def _resolved(surface, r, strength):
    """`resolve` by Newton's method; NaN where it does not converge."""
    s, size, previous = r, largest(r), math.inf
    for _i in range(_ITERATIONS):
        g = slope(surface, s)
        f = _unpushed(surface, s, 2.0 * strength, s - r + strength * g)
        s, change = s - f, largest(f)
        if _converged(change, previous, max(size, abs(strength) * largest(g))):
            return s
        previous = change
    return Vec(math.nan, math.nan, math.nan)


@inlined
def _converged(change, previous, size):
    """Whether an iteration has reached round-off: its change is below it, or is near it and shrinks no more."""
    return change <= _EPSILON * size or (change >= previous and change <= _NOISE * size)
