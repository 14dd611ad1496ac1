"""A wall that turns, at one instant or over one step of a method with a discrete gradient.

With A0 and A1 at both ends of a step, M = (A0 + A1)/2 and the displacement w of points with the wall (`swept`), a step
in its frame is rho1 - rho0 = M^-1 (r1 - r0 - w). So the normal n = M^-T D of the scene has n.(r1 - r0 - w) = D.(rho1 -
rho0), the change of q: a force along it does the work that conserves energy, to round-off, and it is as symmetric in
time as D. With the end of the free step in the frame, f = A1^T (r0 + p - c - d1) + c, the end is
    rho1 = f - kappa Q D(rho0, rho1),   Q = A1^T M^-T.
A1 is A0 turned about the axis k by the angle w h of the step; in Cayley's form,
    A1 - A0 = t x (A0 + A1),   Q D = D - t x D,   t = tan(w h/2) k   (`tilt`).
If the wall is flat, D is along its normal n and n.Q n = 1: across the wall the end is that of the body at rest.
"""

from ...kernel.elementary import sine_and_versine
from ...kernel.vector import Vec, absolute, cross, total
from .posed import Posed


class Turned(Posed):
    """A wall that turns."""

    def tilt(self):
        """Return t."""
        turn = self.drive.turn
        sine, versine = sine_and_versine(turn.rate * (self.remaining - self.after))
        return (sine / (2.0 - versine)) * turn.axis

    def swept(self, r0, r1):
        mean = 0.5 * (self.own_place(r0) + self.own_end(r1)) - self.drive.center
        return self.displacement() + cross(self.tilt(), self.pose.out(mean) + self.end.out(mean))

    def push(self, r, p, kappa):
        start = self.own_place(r)
        free = self.own_end(r + p) - start
        if self.body.flat_normal() is None:
            return self.end_out(self.body.turned_push(start, free, kappa, self.tilt()))
        end = self.body.push(start, free, kappa)
        return self.end_out(end + kappa * cross(self.tilt(), self.body.discrete_gradient(start, end)))

    def rise(self, r, p, kappa):
        start = self.own_place(r)
        free = self.own_end(r + p) - start
        if self.body.flat_normal() is None:
            return self.body.turned_rise(start, free, kappa, self.tilt())
        return self.body.rise(start, free, kappa)

    def free_rise(self, r, p):
        # As for a body at rest: the tilt changes only the derivative.
        start = self.own_place(r)
        return self.body.free_rise(start, self.own_end(r + p) - start)

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
