"""Ties and guides: the equations of their multipliers in one stage of a step, in all lanes together.

    r1 = p - (h^2/2) W sum lambda D,  v1 = v0 + h G - h W sum lambda D,  p = r0 + h v0 + h^2 G/2
with D = y0 + y1, the discrete gradient of |y|^2 of each tie (exact, as |y|^2 is quadratic), and for every tie
    link     |y1|^2 = l^2
    spring   lambda = k (1 - 2 l/(|y0| + |y1|))/2, the composite discrete gradient of k (|y| - l)^2/2
    edges    lambda = K ((|y0|^2 + |y1|^2)/2 - s0)
    relaxed  alpha (c0 + c1)/2 + lambda' of the link c = (|y|^2 - l^2)/(2 l) along its discrete gradient D/(2 l): an
             edge with K = alpha/(4 l^2), and a further term 4 l lambda'/alpha on the left
    guide    D.(q1 - q0) + gap of q0 = 0 of its point q, D the discrete gradient of the gap
    so that links do no work, and the work of springs and edges is exactly the change of their energy. v1 has this form
    because 2 (r1 - r0)/h - v0 cancels: its error is 3e-10 instead of 1e-15.
"""

import math
from typing import Any

from ...kernel.jit import outlined, select
from ...kernel.record import Record
from ...kernel.vector import column, dot, put, square
from ...surfaces.in_motion.moving import Carried
from .body_arrays import BodyLanes, HeldContacts, LaneNumbers, StepRule, Ties, Touching

# A correction is the last one if the relative error of |y|^2 after it is expected below this.
_TOLERANCE = 1e-15
# A correction shrinks the error by this times h^2 W lambda, which includes the neighbours of ties.
_NEGLECTED = 4.0
# The last change of D, in units of round-off of a place.
_SETTLED = 64.0
# A tie under pressure makes the first guess of D longer, at most by the inverse of this factor.
_LEAST = 0.5
# The least factor by which a first correction is expected to shrink the error: D lags behind it, and an error of D is
# missing in the energy.
_AT_FIRST = 1e-3
# The least rest length that scales the equation of a spring, as a part of its length.
_SHORTEST = 1e-8


class Constrained(Record):
    """The bodies of a pass, in lanes; i is a lane."""

    ties: Ties
    touching: Touching
    walls: Any
    rule: StepRule
    lanes: BodyLanes
    pace: LaneNumbers
    active: HeldContacts
    passages: Any = None  # `Passages` where walls have openings

    def walls_now(self, i):
        """The walls at the start of the step of a lane."""
        return self.walls.at(self.pace.remaining[i])

    def walls_then(self, i):
        """The walls at the end of a trial of a lane."""
        return self.walls.at(self.pace.remaining[i] - self.pace.step[i])

    def walls_between(self, i):
        """The walls over the stage of a lane, and at its start."""
        if not self.walls_move():
            return self.walls
        remaining = self.pace.remaining[i] - self.pace.begun[i]
        return self.walls.during(remaining, remaining - self.pace.h[i])

    def walls_after(self, i):
        """The walls at the end of the stage of a lane."""
        return self.walls.at(self.pace.remaining[i] - self.pace.begun[i] - self.pace.h[i])

    def walls_move(self):
        """Whether a wall moves: a constant for the compiler."""
        return isinstance(self.walls, Carried)

    def launch(self):
        """Compute the end p of the stage without ties, and D for it."""
        ties, lanes, pace = self.ties, self.lanes, self.pace
        count = pace.h.size
        for row in range(lanes.p.shape[0]):
            g = self.rule.gravity[row % 3]
            if ties.is_free[row // 3]:
                for i in range(count):
                    pull = 0.5 * pace.h[i] * g
                    lanes.p[row, i] = lanes.ra[row, i] + pace.h[i] * (lanes.va[row, i] + pull)
            else:
                for i in range(count):
                    lanes.p[row, i] = lanes.r1[row, i]
        alone = ties.ends.shape[0] == 1
        for a in range(ties.ends.shape[0]):
            first, second = 3 * ties.ends[a, 0], 3 * ties.ends[a, 1]
            w = ties.couplings[a, a]
            for i in range(count):
                longer = 1.0 + 0.5 * pace.h[i] * pace.h[i] * w * lanes.multiplier[a, i]
                pace.rate[i] = 1.0 / select(longer > _LEAST, longer, _LEAST) if alone else 1.0
            for x in range(3):
                for i in range(count):
                    y = lanes.ra[first + x, i] - lanes.ra[second + x, i]
                    lanes.y0[3 * a + x, i] = y
                    # For a single tie this factor is exact. With several ties, a factor for each would turn the forces
                    # between them, and change 1e-13 of the angular momentum a step; without factors it changes by
                    # round-off.
                    d = (y + (lanes.p[first + x, i] - lanes.p[second + x, i])) * pace.rate[i]
                    lanes.d[3 * a + x, i] = select(pace.waits[i] > 0, lanes.d[3 * a + x, i], d)

    def arrive(self):
        """Compute v1 = v0 + h G - h W sum lambda D."""
        lanes, pace = self.lanes, self.pace
        for row in range(lanes.v1.shape[0]):
            if self.ties.is_free[row // 3]:
                g = self.rule.gravity[row % 3]
                for i in range(pace.h.size):
                    lanes.v1[row, i] = lanes.va[row, i] + pace.h[i] * (g - lanes.force[row, i])

    def move(self):
        """Compute r1 = p - (h^2/2) times the deceleration."""
        lanes, pace = self.lanes, self.pace
        for row in range(lanes.r1.shape[0]):
            for i in range(pace.h.size):
                k2 = 0.5 * pace.h[i] * pace.h[i]
                lanes.r1[row, i] = lanes.p[row, i] - k2 * lanes.force[row, i]

    def follow(self):
        """Compute D = y0 + y1.

        A lane that is done keeps D: with its multipliers, which are kept too, D gives the same r1 again.
        """
        ties, lanes, pace = self.ties, self.lanes, self.pace
        for i in range(pace.h.size):
            pace.lag[i] = 0.0
        for a in range(ties.ends.shape[0]):
            first, second = 3 * ties.ends[a, 0], 3 * ties.ends[a, 1]
            for x in range(3):
                for i in range(pace.h.size):
                    d = lanes.y0[3 * a + x, i] + (lanes.r1[first + x, i] - lanes.r1[second + x, i])
                    change = d - lanes.d[3 * a + x, i]
                    pace.lag[i] += change * change
                    lanes.d[3 * a + x, i] = select(pace.done[i], lanes.d[3 * a + x, i], d)

    def accelerate(self):
        """Compute W sum lambda D, the deceleration by the ties."""
        ties, lanes, count = self.ties, self.lanes, self.pace.h.size
        force, rows = lanes.force, lanes.force.shape[0]
        for row in range(rows):
            for i in range(count):
                force[row, i] = 0.0
        for a in range(ties.ends.shape[0]):
            first, second = 3 * ties.ends[a, 0], 3 * ties.ends[a, 1]
            for x in range(3):
                for i in range(count):
                    g = lanes.multiplier[a, i] * lanes.d[3 * a + x, i]
                    force[first + x, i] += g
                    force[second + x, i] -= g
        if ties.is_diagonal:
            for row in range(rows):
                w = ties.inverse_mass[row // 3, row // 3]
                for i in range(count):
                    force[row, i] *= w
            return
        # v1 has room for the product, except at points that are not free: there it is the velocity of their path.
        for row in range(rows):
            q = row // 3
            if ties.is_free[q]:
                for i in range(count):
                    lanes.v1[row, i] = 0.0
                for s in range(rows // 3):
                    w = ties.inverse_mass[q, s]
                    if w != 0.0:
                        for i in range(count):
                            lanes.v1[row, i] += w * force[3 * s + row % 3, i]
        for row in range(rows):
            for i in range(count):
                force[row, i] = lanes.v1[row, i] if ties.is_free[row // 3] else 0.0

    # --- Newton's method

    def residual(self, turn):
        """Compute the residual of each tie, an error of |y1|^2; decide which lanes need at most one correction."""
        ties, lanes, pace = self.ties, self.lanes, self.pace
        f, count, rows = lanes.f, pace.h.size, ties.ends.shape[0]
        links, soft = ties.links, ties.links + ties.springs
        for i in range(count):
            pace.error[i] = 0.0
            pace.rate[i] = 0.0
        for a in range(rows):
            first, second = 3 * ties.ends[a, 0], 3 * ties.ends[a, 1]
            for i in range(count):
                f[a, i] = 0.0
            for x in range(3):
                for i in range(count):
                    y = lanes.r1[first + x, i] - lanes.r1[second + x, i]
                    lanes.y1[3 * a + x, i] = y
                    f[a, i] += y * y
            if a < links:
                rest, inverse = ties.rest[a], 1.0 / ties.rest[a]
                for i in range(count):
                    f[a, i] -= rest
                    _worse(pace.error, i, abs(f[a, i]) * inverse)
            elif a < soft - ties.relaxed:
                rest, softness = ties.rest[a], 2.0 / ties.stiffness[a]
                for i in range(count):
                    after = math.sqrt(f[a, i])
                    both = math.sqrt(square(column(lanes.y0, 3 * a, i))) + after
                    short = select(rest > _SHORTEST * both, rest, _SHORTEST * both)
                    # The factor with which the equation has the derivative 1 by |y1|^2.
                    scale = both * both * after / short
                    unmet = 1.0 - 2.0 * rest / both - softness * lanes.multiplier[a, i]
                    f[a, i] = scale * unmet
                    lanes.soft[a, i] = scale * softness
                    _worse(pace.error, i, abs(unmet))
            else:
                rest, inverse = 2.0 * ties.rest[a], 1.0 / ties.rest[a]
                for i in range(count):
                    f[a, i] += square(column(lanes.y0, 3 * a, i)) - rest
                if a < soft:
                    for i in range(count):
                        lanes.soft[a, i] = ties.give[a] * pace.ease[i]
                        f[a, i] += lanes.offset[a, i] - lanes.soft[a, i] * lanes.multiplier[a, i]
                else:
                    for b in range(soft, rows):
                        give = ties.compliance[a - soft, b - soft]
                        if give != 0.0:
                            for i in range(count):
                                f[a, i] -= give * lanes.multiplier[b, i]
                for i in range(count):
                    _worse(pace.error, i, abs(f[a, i]) * inverse)
            for i in range(count):
                # The correction neglects that D changes with r1.
                k2 = _NEGLECTED * pace.h[i] * pace.h[i]
                _worse(pace.rate, i, abs(k2 * ties.couplings[a, a] * lanes.multiplier[a, i]))
        self._decide(links == rows, turn)

    def _decide(self, is_rigid, turn):
        """Decide which lanes need at most one correction; `is_rigid` says that all ties of the body are links."""
        pace, room = self.pace, _SETTLED * self.rule.room
        for i in range(pace.error.size):
            error, before = pace.error[i], pace.previous[i]
            # In a continued pass D has followed twice since the last error, so that the ratio of errors is too small.
            rate = select(pace.waits[i] == 0, 0.0, error / before)
            rate = select(turn > 0, error / before, select(rate > _AT_FIRST, rate, _AT_FIRST))
            # In slow turns the lag of D is along D, where it does no work unless ties change their lengths.
            turned = select((pace.rate[i] < 1.0) & is_rigid, pace.rate[i], 1.0)
            counts = turned * turned * turned * turned
            rate = select(rate > pace.rate[i], rate, pace.rate[i])
            # A lane that is put off goes on from here in the next pass, however many corrections its neighbours take in
            # this pass.
            pace.previous[i] = select(pace.done[i], before, error)
            # A turn by 1 rad in a step can satisfy the lengths with a wrong D, and loses 2e-8 of the energy.
            settled = counts * counts * pace.lag[i] <= room * room
            pace.last[i] = settled & ((error * rate <= _TOLERANCE) | (error <= self.rule.noise))

    def assemble(self):
        """Compute the derivative of each equation by each multiplier, h^2 (beta W beta) y1.D, within the skyline."""
        ties, lanes, h, count = self.ties, self.lanes, self.pace.h, self.pace.h.size
        a, y, d, links, soft = lanes.a, lanes.y1, lanes.d, ties.links, ties.links + ties.springs
        for row in range(ties.ends.shape[0]):
            for other in range(ties.start[row], row + 1):
                w, give = ties.couplings[row, other], 0.0
                if other >= soft:
                    give = ties.compliance[row - soft, other - soft]
                for i in range(count):
                    a[row, other, i] = w * h[i] * h[i] * dot(column(y, 3 * row, i), column(d, 3 * other, i)) + give
                if other < row:
                    for i in range(count):
                        a[other, row, i] = w * h[i] * h[i] * dot(column(y, 3 * other, i), column(d, 3 * row, i)) + give
            if links <= row < soft:
                for i in range(count):
                    a[row, row, i] += lanes.soft[row, i]

    def correct_ties(self):
        """Add A^-1 f to the multipliers of lanes that are not done."""
        lanes, pace = self.lanes, self.pace
        for row in range(lanes.f.shape[0]):
            for i in range(pace.h.size):
                g = lanes.multiplier[row, i]
                lanes.multiplier[row, i] = select(pace.done[i], g, g + lanes.f[row, i])
        for i in range(pace.h.size):
            pace.done[i] = pace.done[i] | pace.last[i]

    # --- Guides: their rows come after the rows of ties

    @outlined
    def turn_guides(self, i, r1):
        """Set the directions of guides: the discrete gradient of each gap from the start of the stage to r1."""
        touching = self.touching
        for g in range(touching.guides):
            k, row = touching.points + g, self.ties.ends.shape[0] + g
            y0, y1 = touching.place(self.lanes.ra, k, i), touching.place(r1, k, i)
            put(self.lanes.d, 3 * row, i, self.walls_now(i).step_normal(float(touching.walls + g), y0, y1))

    @outlined
    def guide(self, i):
        """Set up the equations of the guides of a lane."""
        ties, touching, lanes, h = self.ties, self.touching, self.lanes, self.pace.h
        half = 0.5 * h[i] * h[i]
        for g in range(touching.guides):
            k, row, wall = touching.points + g, ties.ends.shape[0] + g, float(touching.walls + g)
            y0, y1 = touching.place(lanes.ra, k, i), touching.place(lanes.r1, k, i)
            n, d = self.walls_now(i).unit_normal(wall, y1), column(lanes.d, 3 * row, i)
            put(lanes.y1, 3 * row, i, n)
            lanes.f[row, i] = dot(d, y1 - y0) + self.walls_now(i).distance(wall, y0)
            for other in range(ties.start[row], row + 1):
                c = half * ties.couplings[row + touching.points, self.coupling(other)]
                lanes.a[row, other, i] = c * dot(n, column(lanes.d, 3 * other, i))
                if other < row:
                    lanes.a[other, row, i] = c * dot(self.slope(other, i), d)

    def coupling(self, row):
        """The row of a tie or guide among all couplings."""
        return row if row < self.ties.ends.shape[0] else row + self.touching.points

    def slope(self, row, i):
        """The derivative of the equation of a tie, |y1|^2, or of a guide, by its end."""
        return (2.0 if row < self.ties.ends.shape[0] else 1.0) * column(self.lanes.y1, 3 * row, i)

    def worst(self, i):
        """The worst residual of ties and guides, in units of round-off."""
        error, f = self.pace.error[i] / self.rule.noise, self.lanes.f
        for row in range(f.shape[0] - self.touching.guides, f.shape[0]):
            error = max(error, abs(f[row, i]) / self.rule.room)
        return error


def _worse(worst, i, value):
    """Keep the larger error; NaN counts as infinite."""
    value = select(value < math.inf, value, math.inf)
    worst[i] = select(value > worst[i], value, worst[i])
