"""Add a surface of your own: a superellipsoid, |x/a|^n + |y/b|^n + |z/c|^n = 1 with an even n.

1. A named tuple of numbers is what kernels take in place of the surface. Its field `side` is +1 for a cavity.
2. Functions of these numbers are registered with `swarm.surfaces.contract`, which describes all that there are. Five
   serve every method: `phi`, `gradient`, `hessian`, `bend` and `farthest_push`. The first hit is then found by safe
   steps. What a method lacks is an error in one sentence.
3. A dataclass derived from `Surface` is what scenes take: it makes the numbers and says how large the surface is.

The same functions run in plain Python and in compiled kernels: numbers in, numbers out, no lists and no arrays. Where
only phi and its gradient are known, `swarm.OwnSurface(parameters, phi, gradient, size=..., bounds=...)` finds the rest.
"""

import math
from collections import namedtuple
from dataclasses import dataclass

import swarm
from swarm.kernel.jit import inlined
from swarm.kernel.vector import Symmetric, Vec, absolute, total
from swarm.surfaces import Surface, contract

SuperellipsoidNumbers = namedtuple("SuperellipsoidNumbers", "a n side")


@dataclass(frozen=True)
class Superellipsoid(Surface):
    """The cavity |x/a|^n + |y/b|^n + |z/c|^n <= 1 about the origin."""

    semi_axes: tuple[float, float, float]
    n: float = 4.0

    def numbers(self):
        """What kernels take."""
        return SuperellipsoidNumbers(Vec(*map(float, self.semi_axes)), float(self.n), 1.0)

    def size(self):
        """A characteristic length [m]."""
        return min(self.semi_axes)

    def extent(self):
        """How far from the origin the surface goes [m]: for a large n nearly to the corners of a box."""
        return math.hypot(*self.semi_axes)

    def bounds(self):
        """A box around the cavity, however it is rotated: its lower and its upper corner."""
        return (-self.extent(),) * 3, (self.extent(),) * 3


@inlined
def _powers(surface, r, k):
    """(x/a)^(n - k)/a^k, the k-th derivative of (x/a)^n but for a constant; likewise of y and z."""
    a, p = surface.a, surface.n - k
    return Vec((r.x / a.x) ** p / a.x**k, (r.y / a.y) ** p / a.y**k, (r.z / a.z) ** p / a.z**k)


contract.phi.register(SuperellipsoidNumbers, lambda surface, r: total(_powers(surface, r, 0.0)) - 1.0)
contract.gradient.register(SuperellipsoidNumbers, lambda surface, r: surface.n * _powers(surface, r, 1.0))
contract.farthest_push.register(SuperellipsoidNumbers, lambda surface: math.inf)


@contract.hessian.register(SuperellipsoidNumbers)
def _(surface, r):
    """Half the second derivatives."""
    h = 0.5 * surface.n * (surface.n - 1.0) * _powers(surface, r, 2.0)
    return Symmetric(h.x, h.y, h.z, 0.0, 0.0, 0.0)


@contract.bend.register(SuperellipsoidNumbers)
def _(surface, r):
    """The second derivatives are largest at the farthest corner of a box around r, with the semi-axes of the cavity."""
    h = surface.hessian(absolute(r) + surface.a)
    return max(h.xx, h.yy, h.zz), max(h.xx, h.yy, h.zz), min(surface.a.x, surface.a.y, surface.a.z)


if __name__ == "__main__":
    scene = swarm.Scene([Superellipsoid((0.3, 0.4, 0.5), n=4.0)])
    seen = swarm.simulate(scene, swarm.fill(scene, 2_000, speed=0.5, seed=1), swarm.Impact(), until=20.0).observables
    print(f"{seen['impacts'][-1]:.0f} impacts, energy drift {seen['energy_error'].max():.1e} of a particle's energy")
