"""Add a surface of your own: a superellipsoid, |x/a|^n + |y/b|^n + |z/c|^n = 1 with an even n.

1. A record derived from `Smooth` is what kernels take in place of the surface: numbers, and methods of them. Its field
   `side` is +1 for a cavity. swarm/surfaces/contract.py describes all methods that there are. Five serve every method
   of simulation: `phi`, `gradient`, `hessian`, `hessian_bounds` and `farthest_push`. The first hit is then found by
   safe steps. A method that is missing is an error in one sentence.
2. A dataclass derived from `Surface` is what scenes take: it makes the numbers and says how large the surface is.

The same methods run in plain Python and in compiled kernels: numbers in, numbers out, no lists and no arrays. Where
only phi and its gradient are known, `swarm.OwnSurface(parameters, phi, gradient, size=..., bounds=...)` finds the rest.
"""

import math
from dataclasses import dataclass

import swarm
from swarm.kernel.vector import Symmetric, Vec, absolute, total
from swarm.surfaces import Smooth, Surface


class SuperellipsoidNumbers(Smooth):
    """The record that kernels take."""

    a: Vec  # the semi-axes
    n: float
    side: float

    def powers(self, r, k):
        """(x/a)^(n - k)/a^k, the k-th derivative of (x/a)^n up to a constant factor, and the same for y and z."""
        a, p = self.a, self.n - k
        return Vec((r.x / a.x) ** p / a.x**k, (r.y / a.y) ** p / a.y**k, (r.z / a.z) ** p / a.z**k)

    def phi(self, r):
        """The implicit function: below 0 inside."""
        return total(self.powers(r, 0.0)) - 1.0

    def gradient(self, r):
        """The gradient of phi."""
        return self.n * self.powers(r, 1.0)

    def hessian(self, r):
        """Half the second derivatives."""
        h = 0.5 * self.n * (self.n - 1.0) * self.powers(r, 2.0)
        return Symmetric(h.x, h.y, h.z, 0.0, 0.0, 0.0)

    def hessian_bounds(self, r):
        """The second derivatives are largest at the farthest corner of a box around r of the semi-axes."""
        h = self.hessian(absolute(r) + self.a)
        return max(h.xx, h.yy, h.zz), max(h.xx, h.yy, h.zz), min(self.a.x, self.a.y, self.a.z)

    def farthest_push(self):
        """Steps in contact have no pole."""
        return math.inf


@dataclass(frozen=True)
class Superellipsoid(Surface):
    """The cavity |x/a|^n + |y/b|^n + |z/c|^n <= 1 about the origin."""

    semi_axes: tuple[float, float, float]
    n: float = 4.0

    def numbers(self):
        """The record of this surface."""
        return SuperellipsoidNumbers(Vec(*map(float, self.semi_axes)), float(self.n), 1.0)

    def size(self):
        """A characteristic length [m]."""
        return min(self.semi_axes)

    def extent(self):
        """The largest distance of the surface from the origin [m]; for a large n nearly half a diagonal of the box."""
        return math.hypot(*self.semi_axes)

    def bounds(self):
        """A box around the cavity, however it is rotated: its lower and its upper corner."""
        return (-self.extent(),) * 3, (self.extent(),) * 3


if __name__ == "__main__":
    scene = swarm.Scene([Superellipsoid((0.3, 0.4, 0.5), n=4.0)])
    seen = swarm.simulate(scene, swarm.fill(scene, 2_000, speed=0.5, seed=1), swarm.Impact(), until=20.0).observables
    print(f"{seen['impacts'][-1]:.0f} impacts, energy drift {seen['energy_error'].max():.1e} of a particle's energy")
