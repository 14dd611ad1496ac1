"""The scattering kernel of Cercignani and Lampis."""

import math
from typing import Any

from ...kernel.random import circle, logarithm, tangents
from ...kernel.vector import cross, dot
from ..wall_law import WallLaw
from .law_numbers import require_magnitude, require_part, require_probability

# The accommodation at which the tangential momentum is reversed; the variance sigma_t (2 - sigma_t) is 0 there.
_REVERSED = 2.0


class CercignaniLampis(WallLaw):
    """A wall at a temperature that accommodates energy of the normal motion and tangential momentum, each in part.

    Args:
        temperature: k_B T of the wall [J], 0 or more, as of a thermal wall.
        normal: alpha_n in [0, 1], the accommodation of the energy of the motion along the normal.
        tangential: sigma_t in [0, 2], the accommodation of the tangential momentum; above 1 particles are scattered
            back. Both 1: a thermal wall; both 0: a mirror; 0 and 2: each velocity is reversed.

    With w = v - u in units of sqrt(2 k_B T/m), normal part w_n and tangential part w_t, a particle leaves with

        w_n'^2 = |sqrt(1 - alpha_n) |w_n| + sqrt(-alpha_n ln U1) exp(2 pi i U2)|^2
        w_t' = (1 - sigma_t) w_t + sqrt(-sigma_t (2 - sigma_t) ln U3) (cos(2 pi U4), sin(2 pi U4))

    so that <w_n'^2> = (1 - alpha_n) w_n^2 + alpha_n and <w_t'> = (1 - sigma_t) w_t. A gas at the wall's temperature
    does not change: the kernel is reciprocal. In a scene with a plane w_t' has only the component along it.

    Raises:
        SceneError: by the surface: a number out of its range.

    Source: Cercignani & Lampis, Transp. Theory Stat. Phys. 1 (1971) 101; drawn as by Lord, Phys. Fluids A 3 (1991) 706.

    Example:
        >>> import swarm
        >>> swarm.Sphere(0.5, laws=[swarm.CercignaniLampis(temperature=1.0, normal=0.8, tangential=0.5)])
        Sphere(radius=0.5, laws=(CercignaniLampis(temperature=1.0, normal=0.8, tangential=0.5),))
    """

    temperature: Any
    normal: Any
    tangential: Any

    def check(self, name):
        """Raise unless each number is in its range."""
        require_magnitude(f"{name}.temperature", self.temperature, "J")
        require_probability(f"{name}.normal", self.normal)
        require_part(f"{name}.tangential", self.tangential, _REVERSED)

    def leave(self, v, n, u, random, mass):
        """Return u + w_n' n + w_t', by four numbers of two blocks of the stream."""
        w, speed2 = v - u, 2.0 * self.temperature / mass
        b = -dot(w, n)
        along = w + b * n
        # The random vector in a disc is added to the part of w_n that is kept.
        kept, drawn = math.sqrt(1.0 - self.normal) * b, math.sqrt(-self.normal * speed2 * logarithm(random.uniform(0)))
        cosine, sine = circle(random.uniform(1))
        there, beside = kept + drawn * cosine, drawn * sine
        away = math.sqrt(there * there + beside * beside)
        spread = self.tangential * (2.0 - self.tangential)
        drawn = math.sqrt(-spread * speed2 * logarithm(random.uniform(2)))
        cosine, sine = circle(random.uniform(3))
        along = (1.0 - self.tangential) * along
        if random.across is not None:
            return u + away * n + along + (drawn * cosine) * cross(random.across.scaled(1.0), n)
        first, second = tangents(n)
        return u + away * n + along + (drawn * cosine) * first + (drawn * sine) * second
