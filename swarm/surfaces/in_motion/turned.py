"""A wall that turns, at one instant or over one step of a method with a discrete gradient.

With A0 and A1 at both ends of a step, M = (A0 + A1)/2 and what the wall carries its points by, w (`swept`), a step in
its frame is rho1 - rho0 = M^-1 (r1 - r0 - w). So the normal n = M^-T D of the scene has n.(r1 - r0 - w) = D.(rho1 -
rho0), the change of q: a force along it does the work that the energy lacks, to round-off, and it is as symmetric in
time as D. The end is, with where the free step ends in the frame, f = A1^T (r0 + p - c - d1) + c,
    rho1 = f - kappa Q D(rho0, rho1),   Q = A1^T M^-T,
that of the body at rest but for Q, which is nearly the identity: the body's push with f + kappa (D - Q D) again and
again, each time nearer by about the angle of the step and what the surface bends in it. Where the wall is flat, D is
along its normal n, and across the wall the end is that of one push of the body with kappa n.Q n.
"""

from ...kernel.limits import EPSILON
from ...kernel.record import Record
from ...kernel.vector import Vec, absolute, dot, largest, total
from .posed import Posed

# Most pushes of the body until its end no longer moves; few steps take more than three.
_PUSHES = 12


class TurnedStep(Record):
    """The end of a step in the frame of the wall, the body's free displacement to it, and D - Q D there."""

    end: Vec
    way: Vec
    rest: Vec


class FlatStep(Record):
    """A step in the frame of a flat wall: start, free displacement, Q n, n.Q n, and the end but for along the wall."""

    start: Vec
    way: Vec
    turned: Vec
    share: float
    end: Vec


class Turned(Posed):
    """The wall."""

    def swept(self, r0, r1):
        mean = 0.5 * (self.own_place(r0) + self.own_end(r1)) - self.drive.center
        h = self.remaining - self.after
        return self.displacement() + h * self.drive.turn.mean_velocity(self.middle(), h, mean)

    def _step(self, r, p, kappa):
        """The `TurnedStep` of a step that is pushed with kappa."""
        start = self.own_place(r)
        free = self.own_end(r + p) - start
        end = self.body.push(start, free, kappa)
        rest, way = end - end, free
        for _i in range(_PUSHES):
            gradient = self.body.discrete_gradient(start, end)
            rest = gradient - self.end.back(self.normal_out(gradient))
            way, before = free + kappa * rest, end
            end = self.body.push(start, way, kappa)
            if largest(end - before) <= 4.0 * EPSILON * largest(end):
                break
        return TurnedStep(end, way, rest)

    def push(self, r, p, kappa):
        n = self.body.flat_normal()
        if n is None:
            return self.end_out(self._step(r, p, kappa).end)
        flat = self._flat_step(n, r, p, kappa)
        size = dot(n, self.body.discrete_gradient(flat.start, flat.end))
        return self.end_out(flat.end + (kappa * size) * (flat.share * n - flat.turned))

    def rise(self, r, p, kappa):
        n = self.body.flat_normal()
        if n is not None:
            flat = self._flat_step(n, r, p, kappa)
            rise, slope = self.body.rise(flat.start, flat.way, flat.share * kappa)
            return rise, flat.share * slope
        step = self._step(r, p, kappa)
        rise, slope = self.body.rise(self.own_place(r), step.way, kappa)
        return rise, slope + dot(self.body.discrete_gradient(step.end, step.end), step.rest)

    def _flat_step(self, n, r, p, kappa):
        """The `FlatStep` of a wall with this normal: D is along it, and so is what counts of Q D."""
        start, turned = self.own_place(r), self.end.back(self.normal_out(n))
        way, share = self.own_end(r + p) - start, dot(n, turned)
        return FlatStep(start, way, turned, share, self.body.push(start, way, share * kappa))

    def chord_guess(self, r, p):
        start = self.own_place(r)
        return self.body.chord_guess(start, self.own_end(r + p) - start)

    def chord_improve(self, r, p, kappa):
        start = self.own_place(r)
        return self.body.chord_improve(start, self.own_end(r + p) - start, kappa)

    def place_scale(self, s):
        # Each coordinate in the frame has the round-off of all.
        size = total(Posed.place_scale(self, s) + absolute(self.drive.center))
        return Vec(size, size, size)
