"""Random numbers of thermal walls: the generator, logarithm and circle, and the velocities made of them."""

import functools
import math

import mpmath
import numba
import numpy as np
import pytest
from conftest import compiled, directions
from hypothesis import given
from hypothesis import strategies as st

from swarm.kernel import random
from swarm.kernel.vector import Vec, dot, norm, square, vec

SEED, SPEED2 = 20_070_630, 0.3
LEAST = 2.0**-53  # the smallest uniform number, and the distance of the largest from 1
# Of so many standard errors one sample in 16 000 is wrong by chance, and the seed is fixed.
ERRORS = 4.0
WORDS = st.integers(0, (1 << 32) - 1)
SEEDS = st.integers(0, (1 << 64) - 1)
uniform = st.integers(0, (1 << 52) - 1).map(lambda k: (k + 0.5) * 2.0**-52)
# Half of them are near 0 or 1, at any distance.
ends = st.floats(1.0, 53.0).map(lambda bits: 2.0**-bits)
arguments = uniform | ends | ends.map(lambda u: 1.0 - u)


@pytest.mark.parametrize(
    ("counter", "key", "words"),
    [
        ((0,) * 4, (0,) * 2, (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
        ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
        ),
    ],
)
def test_published_answers(counter, key, words):
    """Of the Random123 library."""
    assert random.philox(counter, key) == words


def test_what_the_generator_is_given():
    """Every word of a seed and of a number, and the particle; a seed of 64 bits may come as a signed one."""
    events = [(seed, particle, number) for seed in (0, 1, 1 << 32) for particle in (0, 1) for number in (0, 1, 1 << 32)]
    drawn = {u for event in events for u in random.uniforms(*event)}
    assert len(drawn) == 4 * len(events)
    assert random.uniforms(-5, 3, 2) == random.uniforms((1 << 64) - 5, 3, 2)
    assert random.uniforms(np.int64(7), np.int64(3), np.int64(1 << 40)) == random.uniforms(7, 3, 1 << 40)


def test_uniforms_are_inside_of_0_and_1():
    """The ends of the range: all bits 0, and all 1."""
    assert random._fraction(0, 0) == LEAST
    assert random._fraction(0xFFFFFFFF, 0xFFFFFFFF) == 1.0 - LEAST


def _ulps(value, exact):
    return abs((mpmath.mpf(value) - exact) / math.ulp(float(exact)))


def _logarithm_holds(u):
    with mpmath.workprec(200):
        assert _ulps(random.logarithm(u), mpmath.log(mpmath.mpf(u))) <= 1.0


def _circle_holds(u):
    with mpmath.workprec(200):
        exact = mpmath.cospi(2 * mpmath.mpf(u)), mpmath.sinpi(2 * mpmath.mpf(u))
        for got, wanted in zip(random.circle(u), exact, strict=True):
            assert got == 0.0 if wanted == 0 else _ulps(got, wanted) <= 2.0


@given(u=arguments)
def test_logarithm_and_circle(u):
    _logarithm_holds(u)
    _circle_holds(u)


def test_many_logarithms_and_circles():
    """Round-off at its worst is rare: more numbers than Hypothesis takes."""
    for u in np.random.default_rng(2).random(5000).tolist():
        _logarithm_holds(u)
        _circle_holds(u)


@pytest.mark.parametrize("u", [LEAST, 2.0**-63, 0.5, math.sqrt(0.5), math.nextafter(math.sqrt(0.5), 0.0), 1.0 - LEAST])
def test_logarithm_at_the_ends_of_its_ranges(u):
    _logarithm_holds(u)
    assert random.logarithm(u) < 0.0
    assert random.logarithm(1.0) == 0.0


@pytest.mark.parametrize("eighth", range(9))
def test_circle_at_eighths_of_a_turn(eighth):
    """Where the quarter changes, and where a component is 0."""
    at = eighth / 8.0
    for u in (at - LEAST, at, at + LEAST):
        if 0.0 <= u <= 1.0:
            _circle_holds(u)


def _many(seed, normals, speed2, out):
    for i in range(out.shape[1]):
        n = Vec(normals[0, i], normals[1, i], normals[2, i])
        v = random.flux_maxwellian(n, speed2, random.uniforms(seed, i, 3))
        out[0, i], out[1, i], out[2, i] = v.x, v.y, v.z


def _normals():
    """Unit vectors to all sides, the axes among them."""
    several = np.random.default_rng(1).normal(size=(3, 2000))
    several[:, :6] = np.hstack((np.eye(3), -np.eye(3)))
    several[2, 6:12] = -0.0
    return several / np.sqrt((several**2).sum(axis=0))


@functools.cache
def _sample():
    """Of one wall with the normal n: the speed along -n, and the two components across."""
    n = Vec(0.36, 0.48, -0.8)
    across = Vec(0.8, -0.6, 0.0), Vec(-0.48, -0.64, -0.6)
    drawn = [random.flux_maxwellian(n, SPEED2, random.uniforms(SEED, i, 0)) for i in range(20_000)]
    return np.array([[-dot(n, v), dot(across[0], v), dot(across[1], v)] for v in drawn]).T


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set: there is one tier")
@pytest.mark.parametrize("seed", [SEED, -1, np.uint64((1 << 64) - 5)])
def test_both_tiers_have_the_same_bits(seed):
    normals = _normals()
    plain, kernels = np.empty_like(normals), np.empty_like(normals)
    _many(seed, normals, SPEED2, plain)
    compiled(_many)(seed, normals, SPEED2, kernels)
    assert plain.tobytes() == kernels.tobytes()


@given(seed=SEEDS, particle=WORDS, number=SEEDS, direction=directions)
def test_it_leaves_on_the_admissible_side_with_the_speeds_that_were_drawn(seed, particle, number, direction):
    """The basis is orthonormal: |v|^2 is the sum of both squares, and v.n the normal speed alone."""
    n = vec(direction / np.linalg.norm(direction))
    u = random.uniforms(seed, particle, number)
    v = random.flux_maxwellian(n, SPEED2, u)
    normal, tangential = (-2.0 * SPEED2 * math.log(one) for one in (u.normal, u.tangential))
    assert -dot(n, v) == pytest.approx(math.sqrt(normal), abs=4e-15 * norm(v))
    assert square(v) == pytest.approx(normal + tangential, rel=1e-14)


@pytest.mark.parametrize("u", [LEAST, 1.0 - LEAST])
def test_ends_of_the_distribution(u):
    """Neither end of the random numbers gives a velocity that is not finite, or a normal speed of 0."""
    v = random.flux_maxwellian(Vec(0.0, 0.0, 1.0), SPEED2, random.Uniforms(u, u, u, u))
    assert math.isfinite(v.x + v.y)
    assert -10.0 * math.sqrt(SPEED2) < v.z < 0.0


def test_a_wall_at_0_kelvin():
    """It takes all of the energy."""
    for i in range(10):
        assert random.flux_maxwellian(Vec(0.6, 0.0, 0.8), 0.0, random.uniforms(SEED, i, 0)) == (0.0, 0.0, 0.0)


def _near(sample, mean):
    return abs(sample.mean() - mean) <= ERRORS * sample.std() / math.sqrt(sample.size)


def test_means_of_the_sampler():
    """Normal speed sqrt(pi s2/2), energy per mass 2 s2 (s2 of it along the normal), no drift along the wall."""
    normal, first, second = _sample()
    assert _near(normal, math.sqrt(math.pi * SPEED2 / 2.0))
    assert _near(0.5 * (normal**2 + first**2 + second**2), 2.0 * SPEED2)
    assert _near(0.5 * normal**2, SPEED2)
    assert _near(first, 0.0)
    assert _near(second, 0.0)
    assert all(_near(a * b, a.mean() * b.mean()) for a, b in [(normal, first), (normal, second), (first, second)])


# Of samples from the true distribution one in 16 000 is farther from it, as from a mean by four standard errors:
# 2 exp(-2 FAR^2).
FAR = 2.28


def _follows(sample, distribution):
    """Kolmogorov and Smirnov: the largest distance of the shares below from the distribution."""
    ordered, steps = distribution(np.sort(sample)), np.arange(sample.size + 1) / sample.size
    return max((ordered - steps[:-1]).max(), (steps[1:] - ordered).max()) * math.sqrt(sample.size) < FAR


def _gaussian(v):
    return np.array([0.5 * (1.0 + math.erf(one / math.sqrt(2.0 * SPEED2))) for one in v.tolist()])


def test_distributions_of_the_sampler():
    """The normal speed has 1 - exp(-w^2/(2 s2)), the speeds along the wall are Gaussian."""
    normal, first, second = _sample()
    assert _follows(normal, lambda w: 1.0 - np.exp(-(w**2) / (2.0 * SPEED2)))
    assert _follows(first, _gaussian)
    assert _follows(second, _gaussian)


@pytest.mark.parametrize("along", ["seed", "particle", "number"])
def test_events_are_independent(along):
    """From seed to seed, particle to particle and number to number: uniform, and no correlation with the next one."""
    where = ("seed", "particle", "number").index(along)
    drawn = np.array([random.uniforms(*np.roll((i, 11, 5), where)) for i in range(4000)]).T
    for one in drawn:
        assert _follows(one, lambda u: u)
        assert _near((one[1:] - 0.5) * (one[:-1] - 0.5), 0.0)
    for i, j in ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)):
        assert _near((drawn[i] - 0.5) * (drawn[j] - 0.5), 0.0)
