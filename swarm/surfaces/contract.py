"""The contract of a surface: every function that kernels ask of one, required or derived, with its definition.

A surface is an implicit function phi(r): below 0 inside, 0 on it, above 0 outside. Its numbers are a NamedTuple, whose
field `side` is +1 for a cavity (phi <= 0 is admissible) and -1 for a solid (phi >= 0). The *gap* is g = side phi,
admissible where g <= 0.

phi is a function of a smooth inner function q(r), phi = phi(q(r)). A divided difference times a discrete gradient of
q is then a discrete gradient of anything built on phi (the composite gradient), even where the penalty has a corner.

Required are `phi`, `gradient` and one of
    first_hit (and falling_hit under gravity)   the first hit of a flight in closed form,
    course                                      the level along a fall as a quartic: falling_hit and safe_time follow,
    near                                        a polynomial above the level from a place on: the hits follow by steps,
    bend                                        how strongly q bends at most: march.py finds the hits by safe steps;
for methods with steps in contact also `farthest_push` and one of
    push, rise and resolve                      the step in closed form,
    hessian                                     newton.py finds the step.
Everything else has a definition here, and a surface registers its own only where that is faster or more exact. A
surface whose inner function is not phi registers `inner`, `slope`, `gap_of`, `level_of` and `gap_slope` together.
`required.py` says in one sentence, before anything is compiled, what a surface lacks for a method.
"""

import math

from ..kernel.jit import by_type, select
from ..kernel.vector import ZERO, absolute, dot, norm, square, times, total
from .course import Quartic, first_rise, safe_rise_time

# Newton steps of the chord.
_CHORD_SWEEPS = 50


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
    """By how much the gap changes at most when each coordinate changes by itself: magnitude that sets its round-off."""
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


# --- Motion: of walls that move; see moving.py -----------------------------------------------------------


@by_type
def velocity(surface, r):
    """The velocity of the wall at a point of it."""
    return ZERO


@by_type
def acceleration(surface, r):
    """The acceleration of the wall at a point of it."""
    return ZERO


@by_type
def carry(surface, r):
    """Where what is at a point of the wall at the start of a step is at its end."""
    return r


@by_type
def way(surface):
    """The displacement of the wall in a step."""
    return ZERO


@by_type
def end_inner(surface, r):
    """The inner function at the end of a step, where the wall may be elsewhere."""
    return inner(surface, r)


@by_type
def pace(surface):
    """A time in which the motion of the wall changes little [s]; infinite where it does not change."""
    return math.inf


@by_type
def mean_velocity(surface, r0, r1, h):
    """How fast what the wall is made of moves in the mean of a step of length h from r0 to r1, both on it.

    As far as the surface changes with it: a rotation that leaves the surface as it is does not count.
    """
    return ZERO


# --- Flight ----------------------------------------------------------------------------------------------


@by_type
def first_hit(surface, r, v):
    """When the straight flight r + v t leaves the admissible side: (time, whether it does then).

    Where the second is False the flight surely stays admissible until then, and what comes after is not known yet; an
    infinite time means never. A particle on the surface that moves inward does not hit it at time 0: the sign of the
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

    With 0, where nothing is known, a method takes every one of its steps.
    """
    return 0.0


@by_type
def course(surface, r, v, pull):
    """The level along that parabola as a `Quartic`."""
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


@by_type
def near(surface, gravity, r, v):
    """A polynomial of time that is nowhere below the level of a flight from here on, and touches it here.

    A `Near` of approach.py; `gravity` is None where the flight is straight.
    """
    raise NotImplementedError


@course.implies(is_quartic)
def _(surface):
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
def has_levels(surface):
    """Whether the third derivative of the level along a flight has a bound that rising.py knows."""
    return False


@by_type
def passed(surface, r, v):
    """Whether a straight flight surely never meets the surface again."""
    return False


@by_type
def outward_acceleration(surface, r, v, pull):
    """How fast a free flight along the wall gathers speed out of it [m/s^2]: above 0 the wall holds the particle."""
    # The second derivative of the distance, (2 v.H v + grad q.G)/|grad q|
    n, h = slope(surface, r), hessian(surface, r)
    bent = h.xx * v.x * v.x + h.yy * v.y * v.y + h.zz * v.z * v.z
    bent += 2.0 * (h.xy * v.x * v.y + h.yz * v.y * v.z + h.zx * v.z * v.x)
    return (2.0 * bent + dot(n, pull)) * (surface.side / norm(n))


# --- Contact: a step r1 = r0 + p - kappa D(r0, r1) with the free displacement p = h v0 + h^2 G/2 ---------


@by_type
def inner_gradient(surface, r0, r1):
    """Discrete gradient of q: D.(r1 - r0) = q1 - q0. Gonzalez's; grad q(m) of the midpoint m for a quadric."""
    # grad q(m) + (q1 - q0 - grad q(m).d)/|d|^2 d
    g = slope(surface, 0.5 * (r0 + r1))
    d = r1 - r0
    d2 = square(d)
    rest = difference(surface, r0, r1) - g.x * d.x - g.y * d.y - g.z * d.z
    return g + (rest / select(d2 > 0.0, d2, 1.0)) * d


@by_type
def step_normal(surface, r0, r1):
    """The unit vector along that discrete gradient, out of the admissible side."""
    n = inner_gradient(surface, r0, r1)
    return n * (surface.side / norm(n))


@by_type
def push(surface, r0, p, kappa):
    """The end r1 of the step."""
    raise NotImplementedError


@by_type
def rise(surface, r0, p, kappa):
    """q1 - q0 = D.(r1 - r0) of the step, without cancellation, and its derivative by kappa."""
    raise NotImplementedError


@by_type
def resolve(surface, r, strength):
    """The point s with s + strength grad q(s) = r, for the mean-value form."""
    raise NotImplementedError


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
    return _CHORD_SWEEPS


@by_type
def chord_normal(surface, r, p, kappa):
    """Unit normal of that step, parallel to D(r0, r1) and out of the admissible side; for p = 0 it is `unit_normal`."""
    n = inner_gradient(surface, r, push(surface, r, p, kappa))
    return n * (surface.side / norm(n))
