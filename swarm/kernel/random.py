"""Random numbers from a seed, a particle and a count alone: the same for any threads and any resume.

Only + - * / and sqrt of floats, and products of 32-bit words: plain Python, kernels and all machines give the same
bits. No branches, and loops of fixed length: a lane loop vectorises.
"""

import math
from typing import Any, NamedTuple

from .elementary import logarithm_of
from .jit import select
from .record import Record
from .vector import Vec, cross

# Philox4x32-10 of Salmon et al., "Parallel random numbers: as easy as 1, 2, 3" (SC 2011).
_ROUNDS = 10
_MULTIPLIERS = 0xD2511F53, 0xCD9E8D57
_WEYL = 0x9E3779B9, 0xBB67AE85  # added to the key in each round
_WORD = 0xFFFFFFFF

# The blocks of an event's counter that `uniforms` takes, and those of each law.
_BLOCKS, _LAW = 2, 1 << 20

_HALF_PI = 1.5707963267948966
# (2^k, k): a number below 2^-k is scaled by 2^k, and remains below 1.
_SCALES = tuple((float(1 << k), float(k)) for k in (32, 16, 8, 4, 2, 1))
# Coefficients of the series of sine and cosine after their first terms, in reverse order.
_SINE = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(8, 0, -1))
_COSINE = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(8, 1, -1))
# Adding and subtracting it rounds a small float to an integer, ties to even.
_ROUNDING = 1.5 * 2.0**52


class Uniforms(NamedTuple):
    """Four independent numbers in (0, 1), each of 52 bits: (k + 1/2)/2^52 for an integer k."""

    normal: Any
    tangential: Any
    angle: Any
    choice: Any


def philox(counter, key):
    """Return the four 32-bit words of Philox4x32-10 at a counter of four words and a key of two.

    In kernels a product of two words may come out negative, as a signed number of the same 64 bits: with the masks that
    makes no difference.
    """
    a, b, c, d = counter
    k, l = key  # noqa: E741
    for _ in range(_ROUNDS):
        first, second = a * _MULTIPLIERS[0], c * _MULTIPLIERS[1]
        a, b = ((second >> 32) & _WORD) ^ b ^ k, second & _WORD
        c, d = ((first >> 32) & _WORD) ^ d ^ l, first & _WORD
        k, l = (k + _WEYL[0]) & _WORD, (l + _WEYL[1]) & _WORD  # noqa: E741
    return a, b, c, d


def _fraction(high, low):
    """Return (k + 1/2)/2^52 for the upper 20 bits of one word and another word: exact, and never 0 or 1."""
    return ((high >> 12) * 2.0**32 + low + 0.5) * 2.0**-52


def uniforms(seed, particle, number):
    """Return the random numbers of one event of a particle.

    The lower 64 bits of the integers count, signed or not, and the lower 32 bits of `particle`.
    """
    seed, particle, number = int(seed), int(particle), int(number)
    key = seed & _WORD, (seed >> 32) & _WORD
    low, high, item = number & _WORD, (number >> 32) & _WORD, particle & _WORD
    a, b, c, d = philox((low, high, item, 0), key)
    e, f, g, h = philox((low, high, item, 1), key)
    return Uniforms(_fraction(a, b), _fraction(c, d), _fraction(e, f), _fraction(g, h))


class Seeding(Record):
    """The seed of the random numbers of a run, and the number of its first particle.

    Random numbers depend on these and on the impact. The number is 0 except in a shard, where particles are numbered as
    in the whole run.
    """

    seed: Any = 0  # a signed integer of 64 bits
    first: Any = 0

    def of_impact(self, i, number, laws):
        """Return the random numbers of an impact of particle i with the `number` of impacts before it."""
        return Stream(self.seed, self.first + i, number, 0, laws.across)

    def unsigned(self) -> int:
        """Return the seed as the user gave it."""
        return int(self.seed) % 2**64


UNSEEDED = Seeding()


def seeding_of(seed: int, first: int = 0) -> Seeding:
    """Return the `Seeding` with a seed of the user, from 0 to 2^64 - 1."""
    return Seeding(seed - 2**64 if seed >= 2**63 else seed, first)


class Stream(Record):
    """The random numbers of one event of a particle, from a seed, the particle, and the number of the event.

    Each has a number k, so that a branch that needs none changes no others. The two of a block, 2 j and
    2 j + 1, cost as much as one.
    """

    seed: Any
    particle: Any
    number: Any
    law: int = 0  # the first block of a law; several laws of one event have numbers of their own
    across: Any = None  # the axis across the plane of a scene of two dimensions, or None

    def of_law(self, k):
        """Return the stream of the k-th law."""
        return self._replace(law=k * _LAW)

    def uniform(self, k):
        """Return the k-th uniform number in (0, 1); k from 0 on."""
        seed, particle, number = int(self.seed), int(self.particle), int(self.number)
        counter = number & _WORD, (number >> 32) & _WORD, particle & _WORD, (k >> 1) + _BLOCKS + self.law
        a, b, c, d = philox(counter, (seed & _WORD, (seed >> 32) & _WORD))
        return select((k & 1) == 0, _fraction(a, b), _fraction(c, d))

    def exponential(self, k):
        """Return -ln of the k-th uniform number: of mean 1."""
        return -logarithm(self.uniform(k))

    def normal(self, k):
        """Return a normal number of variance 1 (Box and Muller), from the uniform numbers k and k + 1."""
        cosine, _sine = circle(self.uniform(k + 1))
        return math.sqrt(-2.0 * logarithm(self.uniform(k))) * cosine

    def diffuse(self, n, u, k):
        """Return a unit vector by the cosine law about a unit vector n, from u in (0, 1) and the uniform number k.

        Its part along n is sqrt(u); in a plane its part across n is uniform in (-1, 1), which needs no number k.
        """
        if self.across is not None:
            across = 2.0 * u - 1.0
            return (2.0 * math.sqrt(u * (1.0 - u))) * n + across * cross(self.across.scaled(1.0), n)
        first, second = tangents(n)
        cosine, sine = circle(self.uniform(k))
        along = math.sqrt(1.0 - u)
        return math.sqrt(u) * n + (along * cosine) * first + (along * sine) * second


def logarithm(u):
    """Return ln u for u in [2^-63, 1], to one unit in the last place."""
    e = 0.0
    for scale, k in _SCALES:
        small = u * scale < 1.0
        u, e = select(small, u * scale, u), select(small, e - k, e)
    return logarithm_of(u, e)


def circle(u):
    """Return cos(2 pi u) and sin(2 pi u) for u in [0, 1], to two units in the last place.

    4 u = n + y with an integer n and |y| <= 1/2, both exact; Taylor's series at the angle pi y/2, at most pi/4, where
    the neglected terms are below 2e-18; then a turn by n quarters.
    """
    turns = 4.0 * u
    n = (turns + _ROUNDING) - _ROUNDING
    a = (turns - n) * _HALF_PI
    z = a * a
    sine, cosine = 0.0, 0.0
    for coefficient in _SINE:
        sine = z * (coefficient + sine)
    for coefficient in _COSINE:
        cosine = z * (coefficient + cosine)
    sine, cosine = a + a * sine, 1.0 - z * (0.5 - cosine)
    odd = (n == 1.0) | (n == 3.0)
    x, y = select(odd, sine, cosine), select(odd, cosine, sine)
    return select((n == 1.0) | (n == 2.0), -x, x), select((n == 2.0) | (n == 3.0), -y, y)


def flux_maxwellian(n, speed2, u, across=None):
    """Return the velocity with which a particle leaves a diffuse wall with the unit normal n, against n.

    `speed2` is k_B T/m, `across` the axis across the plane of the particle, or None. The normal speed has the
    distribution 1 - exp(-w^2/(2 speed2)) of particles that pass a plane in a gas at rest, the two tangential components
    are Gaussian (Box and Muller); in a plane there is one.
    """
    if across is not None:
        cosine, _sine = circle(u.angle)
        tangent = cross(across.scaled(1.0), n)
        along = math.sqrt(-2.0 * speed2 * logarithm(u.tangential)) * cosine
        return along * tangent - math.sqrt(-2.0 * speed2 * logarithm(u.normal)) * n
    first, second = tangents(n)
    cosine, sine = circle(u.angle)
    along = math.sqrt(-2.0 * speed2 * logarithm(u.tangential))
    return along * cosine * first + along * sine * second - math.sqrt(-2.0 * speed2 * logarithm(u.normal)) * n


def tangents(n):
    """Return two unit vectors across a unit vector and each other: Duff et al., JCGT 6 (2017)."""
    sign = math.copysign(1.0, n.z)
    a = -1.0 / (sign + n.z)
    b = n.x * n.y * a
    return Vec(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec(b, sign + n.y * n.y * a, -n.y)
