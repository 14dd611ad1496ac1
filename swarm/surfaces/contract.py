"""The contract of a surface: the functions that kernels call, required or derived, with their definitions.

A surface is an implicit function phi(r): below 0 inside, 0 on it, above 0 outside. Kernels take it as a record derived
from `Smooth`. Its field `side` is +1 for a cavity (phi <= 0 is admissible) and -1 for a solid (phi >= 0). The
*gap* is g = side phi, admissible where g <= 0.

phi is a function of a smooth inner function q(r), phi = phi(q(r)). A divided difference times a discrete gradient of
q is then a discrete gradient of anything built on phi (the composite gradient), even where the penalty has a corner.

`required.py` names the methods that a surface lacks for a method of simulation, before anything is compiled.
"""

from typing import Any, NamedTuple

from ..kernel.gravity import Gravity, as_vector
from ..kernel.jit import outlined, select
from ..kernel.limits import IDENTITY
from ..kernel.vector import ZERO, Vec, absolute, dot, norm, square, times, total
from . import curvature, newton
from .in_motion.at_rest import AtRest
from .time_of_impact import march
from .time_of_impact.approach import Approach
from .time_of_impact.course import Fall, close, first_rise, rise_near, rise_time, safe_rise_time

# The most Newton steps of the chord.
_CHORD_SWEEPS = 50


class Bent(NamedTuple):
    """The quantities at a place for safe steps: grad q, the level, the three `hessian_bounds` and the `clearance`."""

    n: Vec
    level: Any
    most: Any
    magnitude: Any
    reach: Any
    clear: Any


class Smooth(AtRest):
    """The record of a surface for kernels.

    Required are the field `side`, the methods `phi` and `gradient`, and one that finds the first hit of a flight:
        first_hit (and falling_hit under gravity)  in closed form,
        course   the level along a fall as a quartic; falling_hit and safe_time follow by its first root, course.py,
        near     a polynomial above the level from a place on; the hits follow by steps, approach.py,
        hessian_bounds  bounds of the curvature of q; the hits follow by steps under a parabola, march.py;
    for methods with steps in contact also `farthest_push`, and one of these for the step:
        push, rise and resolve  in closed form,
        hessian                 by Newton's method, newton.py;
    for motion that is not uniform one of these, from which safe steps in the frame of the wall follow, rising.py:
        level_along  the level with a bound of its third derivative, which gives the longest steps,
        hessian_bounds.
    Everything else is defined here, and a surface overrides it only where that is faster or more exact. A surface
    with an inner function other than phi overrides all of `inner`, `inner_gradient`, `gap_of`, `level_of` and
    `gap_slope`. Attributes that are no methods are constants for the compiler.
    """

    @classmethod
    def gives(cls, name):
        """Whether the class of a surface overrides a method of `Smooth`."""
        return getattr(cls, name) is not getattr(Smooth, name)

    # --- Required: the level set ---

    def phi(self, r):
        """Return the implicit function at one point (or, in Python, at arrays of points)."""
        raise NotImplementedError

    def gradient(self, r):
        """Return the gradient of phi."""
        raise NotImplementedError

    def hessian(self, r):
        """Return H = grad grad q/2, a `Symmetric`; steps in contact without a closed form need it."""
        raise NotImplementedError

    def step_bend(self, r0, d):
        """Return H at the midpoint of a step from r0 by d."""
        return self.hessian(r0 + 0.5 * d)

    def hessian_bounds(self, r):
        """Return bounds of the eigenvalues of side H near r: (most, magnitude, reach).

        Within the distance `reach` of r no eigenvalue exceeds `most`, and none is larger in magnitude than `magnitude`.
        The distance must be finite where the hits of falls follow from these bounds.
        """
        raise NotImplementedError

    def farthest_push(self):
        """Return kappa at the first pole of `push`: above 0 for a cavity, below 0 for a solid; infinite without one."""
        raise NotImplementedError

    # --- The inner function and the gap ---

    def inner(self, r):
        """The inner function q(r)."""
        return self.phi(r)

    def inner_gradient(self, r):
        """grad q"""
        return self.gradient(r)

    def difference(self, r0, r1):
        """q1 - q0, without cancellation where the formula allows it."""
        return self.inner(r1) - self.inner(r0)

    def gap_of(self, q):
        """The signed gap g as a function of q."""
        return self.side * q

    def level_of(self, q):
        """A number of the same sign as the gap, for decisions; cheaper than a gap with a square root."""
        return self.gap_of(q)

    def gap_slope(self, q0, q1):
        """Divided difference g[q0, q1] = (g1 - g0)/(q1 - q0), without cancellation, and its derivative by q1.

        The derivative must be exact: the solve stops where the square of its last Newton step is below round-off.
        """
        return self.side, 0.0

    def distance(self, r):
        """Signed distance outside, to first order: g/|grad g|."""
        return self.gap_of(self.inner(r)) / norm(self.gradient(r))

    def gap_scale(self, r):
        """The sum of |r_i dg/dr_i| over the coordinates: times the machine epsilon it is the round-off of the gap."""
        return total(absolute(times(self.gradient(r), r)))

    def unit_normal(self, r):
        """Unit vector along the gradient of the gap, out of the admissible side."""
        n = self.gradient(r)
        return n * (self.side / norm(n))

    def project(self, r):
        """Project a point within round-off of the surface onto it: one Newton step along the gradient."""
        n = self.gradient(r)
        return r - (self.phi(r) / square(n)) * n

    # --- For sources and counters, in Python ---

    # The degree of a polynomial that vanishes on the wall and nowhere else; 0 without such a polynomial.
    degree = 0

    def polynomial(self, r):
        """Return the values of this polynomial at points."""
        return self.phi(r)

    def smooth_parts(self):
        """The walls between the edges of a solid."""
        return (self,)

    def reversible(self):
        """A record of the wall that differs between its two sides by the sign of `side` alone, or None."""

    # --- For balls ---

    def grown(self, radius):
        """The wall that the centre of a ball meets: the parallel surface at `radius` on the admissible side.

        Return a record with an exact `distance`. The radius is 0 or more, and no constant for the compiler.
        """
        raise NotImplementedError

    @property
    def holds_balls(self):
        """Whether the surface has a `grown`: a constant for the compiler."""
        return self.gives("grown")

    # --- Flight ---

    def first_hit(self, r, v):
        """When the straight flight r + v t leaves the admissible side: (time, whether it leaves then).

        If the second is False, the flight surely stays admissible until that time, and the search continues from there.
        An infinite time means never. A particle on the surface that moves inward does not hit it at time 0: the sign of
        the approach decides, not a tolerance. At a point outside by round-off the time is 0 if the particle moves
        outward.
        """
        return self.hit_by_steps(None, r, v)

    def falling_hit(self, r, v, pull):
        """`first_hit` for the parabola r + v t + G t^2/2."""
        return self.hit_by_steps(Gravity(pull.x, pull.y, pull.z), r, v)

    def hit_by_steps(self, gravity, r, v):
        """`first_hit` (gravity None) or `falling_hit` of a surface that gives `course`, `near` or `hessian_bounds`."""
        steps = self.steps(gravity, r, v)
        if isinstance(steps, Fall):
            return first_rise(steps)
        if steps is not None:
            return _first_rise(self, gravity, r, v)
        return march.march(self, r, v, ZERO if gravity is None else as_vector(gravity))

    def steps(self, gravity, r, v):
        """Return the safe steps of a flight to the wall, for lanes: a `Fall`, an `Approach` or the like.

        None where one call finds the hit.
        """
        if gravity is not None and self.is_quartic:
            level = self.course(r, v, as_vector(gravity))
            return Fall(level, close(level.window), self.may_be_far)
        near = self.gives("near") and (gravity is not None or self.in_steps)
        return Approach(self, gravity, r, v) if near else None

    def look(self, r, v, pull, t, is_first):
        """Return the `SafeStep` of march.py from the place of a flight at the time t."""
        return march.look(self, r, v, pull, t, is_first)

    def bent(self, r):
        """Return the `Bent` of a place, from which safe steps follow."""
        n, level = self.inner_gradient(r), self.level_of(self.inner(r))
        most, magnitude, reach = self.hessian_bounds(r)
        return Bent(n, level, most, magnitude, reach, self.clearance(r))

    # The most safe steps of the search along a fall.
    falling_looks = march.FALLING_LOOKS

    def safe_time(self, r, v, pull):
        """A time during which this parabola surely stays admissible: a cheap lower bound of the time of the hit.

        It is 0 where no bound is known: then a method takes each of its steps.
        """
        if self.is_quartic:
            return safe_rise_time(self.course(r, v, pull))
        if self.gives("near"):
            level = self.near(Gravity(pull.x, pull.y, pull.z), r, v)
            return select(level.c > 0.0, 0.0, level.first_step()[0])
        return march.safe_time_by_steps(self, r, v, pull) if self.gives("hessian_bounds") else 0.0

    def entry(self, gravity, r, v):
        """A time until which a flight surely stays admissible: (time, whether it leaves the admissible side then).

        Solids call it for their parts, and call it for all of them again at that time: so it may be before the hit.
        """
        if gravity is None:
            return self.first_hit(r, v)
        pull = as_vector(gravity)
        return rise_near(self.course(r, v, pull)) if self.is_quartic else self.falling_hit(r, v, pull)

    def straight_hit(self, end, r0, r1):
        """`first_hit` of a straight way from r0 to r1, at the end of which the surface is `end`."""
        return self.first_hit(r0, r1 - r0)

    def course(self, r, v, pull):
        """The level along this parabola as a `Quartic`."""
        raise NotImplementedError

    @property
    def is_quartic(self):
        """Whether the surface has a `course`."""
        return self.gives("course")

    # Whether `course` may return a quartic for a start from afar.
    may_be_far = True

    # How many numbers of a `PolynomialFlight`, made by `flight`, lanes keep for a straight flight; 0: no such flight.
    kept = 0
    # Whether the steps begin with a guess of the root.
    aims = False
    # How many powers of a `fall` lanes keep for a guess of its root; 0: falls begin without a guess.
    fall_powers = 0
    # Whether the steps are those of `FlightByLooks`.
    looked_at = False

    def fall(self, gravity, r, v):
        """The level along a fall as a `PolynomialFall`."""
        raise NotImplementedError

    def refined(self, gravity, r, v, time):
        """Return the time from these steps, corrected by the level there: the level at r has the round-off of r."""
        raise NotImplementedError

    def near(self, gravity, r, v):
        """Return a polynomial of time, nowhere below the level of a flight from r on, and equal to it at r.

        The result is a `LevelBound` of approach.py. The gravity of a straight flight is None.
        """
        raise NotImplementedError

    @property
    def in_steps(self):
        """Whether a straight flight takes steps in lanes."""
        return self.gives("near")

    def clearance(self, r):
        """Lower bound of the distance to the wall; 0 if unknown."""
        return 0.0

    def out_of(self, r):
        """Lower bound of the distance of a point from a part of a solid; below 0 inside."""
        return self.clearance(r)

    def far(self, r):
        """Lower bound of the distance to the wall: `clearance`, but also in a frame, and for parts of a solid."""
        return self.clearance(r)

    def reach(self, lease):
        """A time during which a particle with this `Lease` surely does not meet the wall, which does not turn."""
        # From the distance alone.
        clear = max(self.far(lease.r), 0.0)
        return rise_time(-clear, 0.5 * (norm(lease.v) + lease.width), 0.5 * norm(lease.a))

    def may_reach(self, low, high):
        """Whether a solid may have a point in common with the box between these corners, which its bounds overlap."""
        return True

    # Whether `first_hit` of a straight flight that starts outside and enters is the time at which it leaves again.
    leaves_once = False

    def passed(self, r, v):
        """Whether a straight flight surely never meets the surface again."""
        return False

    def outward_acceleration(self, r, v, pull):
        """The outward acceleration of a free flight along the wall [m/s^2]; above 0 the particle stays on the wall.

        The velocity must have no part across the wall.
        """
        if not self.gives("hessian"):
            return curvature.outward_acceleration(self, r, v, pull)
        # The second derivative of the distance, (2 v.H v + grad q.G)/|grad q|
        n, h = self.inner_gradient(r), self.hessian(r)
        bent = h.xx * v.x * v.x + h.yy * v.y * v.y + h.zz * v.z * v.z
        bent += 2.0 * (h.xy * v.x * v.y + h.yz * v.y * v.z + h.zx * v.z * v.x)
        return (2.0 * bent + dot(n, pull)) * (self.side / norm(n))

    # --- Contact: a step r1 = r0 + p - kappa D(r0, r1) with the free displacement p = h v0 + h^2 G/2 ---

    def mean_gradient(self, r0, r1):
        """The mean that a discrete gradient corrects: grad q(m) of the midpoint m, or another mean to second order."""
        return self.inner_gradient(0.5 * (r0 + r1))

    def discrete_gradient(self, r0, r1):
        """Discrete gradient of q: D.(r1 - r0) = q1 - q0. Gonzalez's; grad q(m) of the midpoint m for a quadric."""
        # grad q(m) + (q1 - q0 - grad q(m).d)/|d|^2 d
        g = self.mean_gradient(r0, r1)
        d = r1 - r0
        d2 = square(d)
        rest = self.difference(r0, r1) - g.x * d.x - g.y * d.y - g.z * d.z
        return g + (rest / select(d2 > 0.0, d2, 1.0)) * d

    def gap_gradient(self, r0, r1):
        """Discrete gradient of the gap g: D.(r1 - r0) = g1 - g0."""
        slope, _bend = self.gap_slope(self.inner(r0), self.inner(r1))
        return slope * self.discrete_gradient(r0, r1)

    def resting_gradient(self, r0, r1):
        """The discrete gradient, or grad q(m) where this satisfies D.(r1 - r0) = q1 - q0 up to round-off.

        Divided by |d|, round-off is noise in short steps, and it would keep balls from coming to rest.
        """
        if self.gives("discrete_gradient"):
            return self.discrete_gradient(r0, r1)
        g, d = self.mean_gradient(r0, r1), r1 - r0
        d2, rest = square(d), self.difference(r0, r1) - dot(g, d)
        noise = IDENTITY * total(times(absolute(g), absolute(r0) + absolute(r1)))
        # The full correction from twice the noise on, without a jump.
        over = select(rest > 0.0, 1.0, -1.0) * 2.0 * (abs(rest) - noise)
        rest = select(abs(rest) < 2.0 * noise, select(abs(rest) > noise, over, 0.0), rest)
        return g + (rest / select(d2 > 0.0, d2, 1.0)) * d

    def step_normal(self, r0, r1):
        """The unit vector along the discrete gradient, out of the admissible side."""
        n = self.discrete_gradient(r0, r1)
        return n * (self.side / norm(n))

    def push(self, r0, p, kappa):
        """Return the end r1 of the step."""
        return newton.push(self, r0, p, kappa)

    def rise(self, r0, p, kappa):
        """Return q1 - q0 = D.(r1 - r0) of the step, without cancellation, and its derivative by kappa."""
        return newton.rise(self, r0, p, kappa)

    def free_rise(self, r0, p):
        """`rise` of the step with kappa = 0, for a first guess: its derivative may be approximate."""
        return self.rise(r0, p, 0.0)

    def turned_push(self, r0, p, kappa, tilt):
        """Return the end of r1 = r0 + p - kappa (D - tilt x D), the step of a wall that turns: in_motion/turned.py."""
        return newton.push(self, r0, p, kappa, tilt)

    def turned_rise(self, r0, p, kappa, tilt):
        """`rise` of the step of a wall that turns."""
        return newton.rise(self, r0, p, kappa, tilt)

    def resolve(self, r, strength):
        """Return the point s with s + strength grad q(s) = r, for the mean-value form."""
        return newton.resolve(self, r, strength)

    def chord_guess(self, r, p):
        """First guess of kappa, for which a step from the surface ends on it; exact if `chord_sweeps` is 0."""
        return -self.chord_improve(r, p, 0.0)

    def chord_improve(self, r, p, kappa):
        """Return the Newton step of this kappa, to be subtracted."""
        risen, steepness = self.rise(r, p, kappa)
        return risen / steepness

    # The most steps of `chord_improve`; 0 where the guess is exact.
    chord_sweeps = _CHORD_SWEEPS

    def chord_normal(self, r, p, kappa):
        """Unit normal of this step, parallel to D(r0, r1), out of the admissible side; `unit_normal` for p = 0."""
        # The derivative of `rise` is exact for short steps only: there the sweeps gain a constant factor each, and stop
        # with up to 1e-10 of kappa to go. Without one more step the chord of a sampled wall ends 240 eps off it.
        kappa = kappa - self.chord_improve(r, p, kappa)
        n = self.discrete_gradient(r, self.push(r, p, kappa))
        return n * (self.side / norm(n))


@outlined
def _first_rise(surface, gravity, r, v):
    return first_rise(surface.steps(gravity, r, v))
