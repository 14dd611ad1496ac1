"""A diffuse wall that keeps the speed."""

from typing import Any

from ...kernel.jit import select
from ...kernel.vector import either, norm
from ..wall_law import WallLaw, mirrored
from .law_numbers import require_probability


class Lambert(WallLaw):
    """Diffuse reflection that keeps the speed, by Lambert's cosine law.

    Args:
        probability: the part of the particles that leave diffusely, in [0, 1]; all others leave as from a mirror.

    A particle leaves with the speed, relative to the wall, with which it arrives, in a random direction: the cosine c
    to the normal has the distribution c^2, and the azimuth is uniform: per solid angle that is c/pi. In a scene with a
    plane the sine of the angle to the normal is uniform in (-1, 1). The speed is kept to the last digit.

    Raises:
        SceneError: by the surface: the probability is not in [0, 1].

    Source: Maxwell, Phil. Trans. R. Soc. 170 (1879) 231; Greenwood, Vacuum 67 (2002) 217.

    Example:
        >>> import numpy as np
        >>> import swarm
        >>> scene = swarm.Scene([swarm.Sphere(0.5, laws=[swarm.Lambert()])])
        >>> result = swarm.simulate(scene, swarm.fill(scene, 10, speed=1.0, seed=1), swarm.Impact(), until=5.0)
        >>> bool(np.allclose(np.linalg.norm(result.particles.velocity, axis=0), 1.0, rtol=1e-15))
        True
    """

    probability: Any = 1.0

    def check(self, name):
        """Raise unless the probability is in [0, 1]."""
        require_probability(f"{name}.probability", self.probability)

    def leave(self, v, n, u, random, mass):
        """Return u + |v - u| times a direction of the cosine law: below the probability the first number is uniform.

        So two numbers, one block of the stream, suffice.
        """
        drawn = random.uniform(0)
        is_diffuse = drawn < self.probability
        way = random.diffuse(n, drawn / select(is_diffuse, self.probability, 1.0), 1)
        return either(is_diffuse, u + norm(v - u) * way, mirrored(v, n, u))
