"""A wall that turns, at one instant or over one step of a method with a discrete gradient.

With A0 and A1 at both ends of a step, M = (A0 + A1)/2 and what the wall carries its points by, w (`swept`), a step in
its frame is rho1 - rho0 = M^-1 (r1 - r0 - w). So the normal n = M^-T D of the scene has n.(r1 - r0 - w) = D.(rho1 -
rho0), the change of q: a force along it does the work that the energy lacks, to round-off, and it is as symmetric in
time as D. The end is, with where the free step ends in the frame, f = A1^T (r0 + p - c - d1) + c,
    rho1 = f - kappa Q D(rho0, rho1),   Q = A1^T M^-T,
that of the body at rest but for Q, which is nearly the identity: the body's push with f + kappa (D - Q D) again and
again, each time nearer by about the angle of the step and what the surface bends in it. Where the wall is flat, D is
along its normal n and n.Q n = 1: across the wall the end is that of the body, of one push.
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
        if self.body.flat_normal() is None:
            return self.end_out(self._step(r, p, kappa).end)
        start = self.own_place(r)
        end = self.body.push(start, self.own_end(r + p) - start, kappa)
        gradient = self.body.discrete_gradient(start, end)
        return self.end_out(end + kappa * (gradient - self.end.back(self.normal_out(gradient))))

    def rise(self, r, p, kappa):
        start = self.own_place(r)
        if self.body.flat_normal() is not None:
            return self.body.rise(start, self.own_end(r + p) - start, kappa)
        step = self._step(r, p, kappa)
        rise, slope = self.body.rise(start, step.way, kappa)
        return rise, slope + dot(self.body.discrete_gradient(step.end, step.end), step.rest)

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
