"""The impulse of one surface in one step with the composite discrete gradient: a scalar root.

With the step h, the mass m, the discrete gradient D(r0, r1) of the inner function q, the multiplier lambda and
    kappa = h^2/(2m) (V[g0, g1] + lambda Phi[g0, g1]) g[q0, q1]                              (K)
the step is  r1 = r0 + p - kappa D,  v1 = v0 + h G - (2 kappa/h) D,  p = h v0 + h^2 G/2.
The surface knows r1(kappa) in closed form (`push`), so (K) is one equation in one unknown. Without a multiplier its
right side is a convex, decreasing function of kappa, so Newton's method from the left climbs to the smallest root.
A multiplier is a float, or None if the method has none.
"""

import math
from typing import Any

from ..kernel.jit import outlined, select
from ..kernel.limits import EPSILON
from ..kernel.record import Record
from ..kernel.vector import Vec

# A Newton step that moves the gap by this fraction of itself is the last: its square is below round-off. Within the
# loop of a multiplier its square need only be small, as the loop repairs the rest.
_NEWTON_TOLERANCE = 1e-8
_LOOP_TOLERANCE = 1e-2
# Steps of the vectorised solve; lanes that need more are solved by `Equation.careful`.
NEWTON_STEPS = 8
_CAREFUL_ITERATIONS = 200
# A push this near to the farthest one has no root before it.
_NEAR = 1.0 - 1e-12
# Doublings of a bracket: from the smallest number to the largest.
_DOUBLINGS = 2100
# A point is on the surface if a change of its coordinates by this fraction of themselves brings it there.
_ON_SURFACE = 8.0 * EPSILON
# The equation and its energy need these functions of every wall; multipliers also need `gap_scale`.
NEEDS = (
    "inner", "gap_of", "gap_slope", "gradient", "discrete_gradient", "push",
    "rise", "farthest_push",
)  # fmt: skip


class Step(Record):
    """A step from r with the free displacement p = h v0 + h^2 G/2; c = h^2/(2m), in implicit rules h^2/(4m)."""

    r: Vec
    p: Vec
    c: float


class StepStart(Record):
    """The start of a step at one surface."""

    q: float
    gap: float
    round_off: float  # the gap that counts as 0
    tolerance: float  # of Newton's steps


def start_of(multiplier, surface, r):
    """Return the `StepStart` of a step from r; only multipliers need a gap of round-off to count as 0."""
    q0 = surface.inner(r)
    g0 = surface.gap_of(q0)
    if multiplier is None:
        return StepStart(q0, g0, 0.0, _NEWTON_TOLERANCE)
    # In State I (g0 = 0) the loop (8) ends; from a g0 = -1e-17 it would end only down to g1 ~ 1e-16, then creep.
    round_off = _ON_SURFACE * surface.gap_scale(r)
    return StepStart(q0, select(abs(g0) <= round_off, 0.0, g0), round_off, _LOOP_TOLERANCE)


class StepEnd(Record):
    """The end of a step at one surface."""

    gap: float  # g1, computed from g1 - g0: more digits of a small g1 than r1 has
    rise: float  # q1 - q0
    drise: float  # derivative by kappa
    slope: float  # g[q0, q1]
    dslope: float  # derivative by q1


class Residual(Record):
    """F(kappa), the left side of (K) minus its right side, and its parts."""

    value: float
    slope: float  # F'(kappa)
    gap: float  # g1
    gap_slope: float  # dg1/dkappa
    rise_slope: float  # g[q0, q1]


class LoopRecord(Record):
    """The numbers of a step that the loop of a multiplier uses."""

    mean: float  # (Phi0 + Phi1)/2
    stored: float  # V1
    gain: float  # dkappa/dlambda


class Newton(Record):
    """A Newton step of kappa, to be subtracted."""

    step: float
    more: bool  # whether it is so large that another is needed
    record: LoopRecord


class Equation(Record):
    """Equation (K) of one surface in one step."""

    law: Any
    multiplier: Any
    surface: Any
    step: Step
    start: StepStart

    def end(self, kappa):
        """Return the `StepEnd` of the step that is pushed with kappa."""
        start, surface, step = self.start, self.surface, self.step
        rise, drise = surface.rise(step.r, step.p, kappa)
        slope, dslope = surface.gap_slope(start.q, start.q + rise)
        # g1 - g0 = g[q0, q1] (q1 - q0)
        g1 = start.gap + slope * rise
        return StepEnd(select(abs(g1) <= start.round_off, 0.0, g1), rise, drise, slope, dslope)

    def residual(self, kappa):
        """Return the `Residual` of kappa."""
        c, end = self.step.c, self.end(kappa)
        force, dforce = self.law.force(self.multiplier, self.start.gap, end.gap)
        dg1 = end.drise * (end.slope + end.dslope * end.rise)
        f = kappa - c * force * end.slope
        df = 1.0 - c * (dforce * dg1 * end.slope + force * end.dslope * end.drise)
        return Residual(f, df, end.gap, dg1, end.slope)

    def newton(self, kappa):
        """Return the `Newton` step of kappa.

        The step of the gap g1 must be small, relative to the gap, as the energy is the square of the gap: in a stiff
        wall g1 is a small difference, and a kappa correct to 1e-12 can leave an energy wrong by 1e-8.
        """
        start, f = self.start, self.residual(kappa)
        change = f.value / f.slope
        g0, g1 = start.gap, f.gap
        depth = select(g0 > abs(g1), g0, abs(g1))
        # True for NaN.
        more = not (abs(change * f.gap_slope) <= start.tolerance * depth + 2.0 * start.round_off)
        record = self.record(g1, g1 - change * f.gap_slope, self.step.c * f.rise_slope / f.slope)
        return Newton(change, more, record)

    def record(self, g1, g, factor):
        """Return the `LoopRecord` of the step that ends at gap g, from one that ended at g1; zeros without multiplier.

        dkappa/dlambda = c Phi[g0, g1] g[q0, q1]/F'(kappa); `factor` is this without Phi[g0, g1].
        """
        if self.multiplier is None:
            return LoopRecord(0.0, 0.0, 0.0)
        law, g0 = self.law, self.start.gap
        slope, _curvature = law.constraint_slope(g0, g1)
        mean = 0.5 * (law.constraint(g0) + law.constraint(g))
        return LoopRecord(mean, law.stored_energy(g), factor * slope)

    @outlined
    def careful(self):
        """Return kappa by Newton's method inside a bracket, and whether it was found."""
        first = self.residual(0.0)
        if first.value == 0.0:
            return 0.0, True
        # A cavity pushes with kappa > 0, a solid with kappa < 0: `sign` mirrors it.
        sign = -1.0 if first.value > 0.0 else 1.0
        low, high, found = self.bracket(sign, self.first_push(abs(first.value), first.slope))
        if not found:
            return sign * low, False
        k, previous = low, math.inf
        for _i in range(_CAREFUL_ITERATIONS):
            residual = self.residual(sign * k)
            f = sign * residual.value
            if f == 0.0 or not abs(f) < math.inf:
                return sign * k, f == 0.0
            if f < 0.0:
                low = k
            else:
                high = k
            trial = k - f / residual.slope
            # Newton steps that do not shrink have reached the noise of g1: halving the bracket ends.
            if not (low < trial < high and abs(trial - k) <= 0.5 * previous):
                trial = 0.5 * (low + high)
            previous = abs(trial - k)
            if previous <= 2.0 * EPSILON * trial or high - low <= 2.0 * EPSILON * high:
                return sign * trial, True
            k = trial
        return sign * k, False

    def first_push(self, size, df):
        """Return the first trial of the root, from |F(0)| and F'(0)."""
        # The right side of (K) jumps where a multiplier no longer holds the particle, and there Newton's step does not
        # help. Without a multiplier it does not pass the root where the right side of (K) is convex. The value at 0 can
        # be past the root of a falling g1: in a step across a long ellipsoid, where g1 falls and rises again, a bracket
        # from there held the largest of three roots.
        return size / df if self.multiplier is None and 1.0 < df < math.inf else size

    @outlined
    def bracket(self, sign, first):
        """Return two kappa with F < 0 and F >= 0, the latter `first` times a power of 2, and whether they exist."""
        # Doubling from below meets the smallest root first, and ends: (K) has F > 0 both far out and before the
        # pole.
        farthest = abs(self.surface.farthest_push())
        low, high = 0.0, min(first, 0.5 * farthest)
        for _i in range(_DOUBLINGS):
            f = sign * self.residual(sign * high).value
            if not abs(f) < math.inf:
                # A push beyond the domain
                farthest = high
                high = 0.5 * (low + high)
            elif f >= 0.0:
                return low, high, True
            elif high >= _NEAR * farthest:
                break
            else:
                low, high = high, min(2.0 * high, 0.5 * (high + farthest))
        return low, high, False


def equation(law, multiplier, surface, step):
    """Return the `Equation` of one surface in one step."""
    return Equation(law, multiplier, surface, step, start_of(multiplier, surface, step.r))


# --- In lanes --------------------------------------------------------------------------------------------


def _guess(surface, law, step):
    """Return kappa for a flat wall and a linear spring."""
    q0 = surface.inner(step.r)
    g0 = surface.gap_of(q0)
    rise, drise = surface.free_rise(step.r, step.p)
    slope, _dslope = surface.gap_slope(q0, q0 + rise)
    gf = g0 + slope * rise
    # There g1 = gf - e kappa, and with C = c alpha/2 g[q0, q1] e equation (K) is one of
    #   entering (g0 <= 0):  (1 + C) g1^2 - (gf + g0) g1 + gf g0 = 0
    #   staying:             g1 = (gf - C g0)/(1 + C)
    #   leaving (g1 < 0):    g1^2 - (gf + g0) g1 + gf g0 - C g0^2 = 0
    e = -slope * drise
    stiff = 0.5 * step.c * slope * e * law.stiffness(select(g0 > gf, g0, gf))
    entering = g0 <= 0.0
    one = 1.0 + stiff
    inverse = 1.0 / one
    staying = (gf - stiff * g0) * inverse
    total = gf + g0
    square = select(entering, total * total - 4.0 * one * gf * g0, (gf - g0) * (gf - g0) + 4.0 * stiff * g0 * g0)
    root = math.sqrt(select(square > 0.0, square, 0.0))
    entered = 0.5 * (total + root) * inverse
    g1 = select(entering, entered, select(staying > 0.0, staying, 0.5 * (total - root)))
    return (gf - g1) / e


def _improve(surface, law, multiplier, step, kappa):
    return equation(law, multiplier, surface, step).newton(kappa)


def guess(walls, wall, *given):
    """`_guess` for a wall."""
    return walls.of(wall, 0.0, _guess, *given)


def improve(walls, wall, *given):
    """`_improve` for a wall."""
    return walls.of(wall, Newton(0.0, False, LoopRecord(0.0, 0.0, 0.0)), _improve, *given)
