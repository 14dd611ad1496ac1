"""A wall that absorbs particles."""

from typing import Any

from ...errors import SceneError
from ...kernel.vector import dot
from ..wall_law import Leave, WallLaw, mirrored
from .law_numbers import require_magnitude, require_probability


class Absorb(WallLaw):
    """Absorption: with a probability at each impact, or by the energy of the motion along the normal.

    Args:
        probability: the part of the particles that reach the wall that is absorbed, in [0, 1].
        barrier: energy E [J], 0 or more, in place of a probability. A particle is absorbed if the energy of its motion
            along the normal is larger, m (n.(v - u))^2/2 > E, as a neutron is above the optical potential of a wall.
        loss: with a barrier, the part of all other particles that is absorbed too, in [0, 1].

    A particle that is not absorbed leaves as from a mirror, or by the next law: `laws=[Absorb(0.01), Lambert()]`. A
    particle that is absorbed stays where it is: `Result.absorbed_time`, the observable "absorbed" (frames, surfaces)
    and a row in the log of impacts. The wall gets its normal momentum; its energy stays in the sums of all particles.

    Raises:
        SceneError: by the surface: a number out of its range, or neither or both of a probability and a barrier.

    Source: of a barrier, Golub, Richardson & Lamoreaux, Ultra-Cold Neutrons (1991), section 2.4.

    Example:
        >>> import swarm
        >>> scene = swarm.Scene([swarm.Sphere(0.5, laws=[swarm.Absorb(1.0)])])
        >>> result = swarm.simulate(scene, swarm.fill(scene, 10, speed=1.0, seed=1), swarm.Impact(), until=1.0)
        >>> result.observables["absorbed"][-1]
        array([10])
    """

    probability: Any = None
    barrier: Any = None
    loss: Any = None

    def check(self, name):
        """Raise unless one of a probability and a barrier is given, each in its range."""
        if (self.probability is None) == (self.barrier is None):
            both = "neither" if self.barrier is None else "both"
            raise SceneError(f"{name} must have a probability, or a barrier [J], got {both}")
        if self.barrier is None:
            require_probability(f"{name}.probability", self.probability)
            if self.loss is not None:
                raise SceneError(f"{name}.loss must go with a barrier, got {self.loss:g} and a probability")
            return
        require_magnitude(f"{name}.barrier", self.barrier, "J")
        if self.loss is not None:
            require_probability(f"{name}.loss", self.loss)

    def leave(self, v, n, u, random, mass):
        """Reflect the particle as a mirror, unless it is absorbed."""
        if self.barrier is None:
            return Leave(mirrored(v, n, u), random.uniform(0) >= self.probability)
        b = dot(v - u, n)
        stays = 0.5 * mass * b * b <= self.barrier
        if self.loss is not None:
            stays = stays & (random.uniform(0) >= self.loss)
        return Leave(mirrored(v, n, u), stays)
