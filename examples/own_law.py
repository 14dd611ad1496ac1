"""Wall laws of your own: balls that rebound the less the faster they hit, and a floor that keeps some of the slow ones.

A record derived from `WallLaw` is what kernels take: numbers, and `leave`, the velocity after an impact, or a `Leave`
that also says whether the particle stays in the run, and how long it waits on the wall. The same method runs in plain
Python and in compiled kernels: numbers in, numbers out, no lists or arrays. `book` names the observable of the energy.
"""

import swarm
from swarm.kernel.vector import dot


class Viscoelastic(swarm.WallLaw):
    """e = 1/(1 + (b/slow)^(1/5)) for the normal speed b: Brilliantov and Poschel (2004), to first order."""

    slow: float  # the normal speed [m/s] at which e is 1/2
    book = "dissipated"

    def leave(self, v, n, u, random, mass):
        """v1 = v0 + (1 + e) b n, b = -n.(v0 - u)."""
        b = -dot(v - u, n)
        return v + (1.0 + 1.0 / (1.0 + (b / self.slow) ** 0.2)) * b * n


class Glue(swarm.WallLaw):
    """A particle that hits slower than `slow` [m/s] stays stuck, with a probability."""

    slow: float
    probability: float

    def leave(self, v, n, u, random, mass):
        """As from a mirror, unless it is stuck."""
        b = -dot(v - u, n)
        return swarm.Leave(v + 2.0 * b * n, stays=(b > self.slow) | (random.uniform(0) >= self.probability))


if __name__ == "__main__":
    # `restitution` and `friction` act on the last, smallest hops, after which a ball stays on the floor.
    laws = [Glue(0.5, 0.05), Viscoelastic(2.0)]
    vessel = swarm.Cylinder(0.2, (0, 0, 1), 0.4, laws=laws, restitution=0.8, friction=0.3)
    scene = swarm.Scene([vessel], gravity=(0, 0, -9.81))
    result = swarm.simulate(scene, swarm.fill(scene, 1000, speed=1.0, mass=1e-3, seed=1), swarm.Impact(), until=5.0)
    print(result)
    print(result.observables["absorbed"][-1, 0], "are stuck")
