"""The sine, the cosine and the versine of an angle against 40 digits."""

import math

import mpmath
import numpy as np
import pytest
from conftest import compiled

from swarm.kernel.elementary import nearly_sine_and_versine_of, reduced, sine_and_cosine, sine_and_versine
from swarm.surfaces.in_motion.drive import LITTLE_ANGLE, wave_of

EPSILON = np.finfo(np.float64).eps
RNG = np.random.default_rng(7)
# About the multiples of pi/2 the reduction cancels; 1e8 rad is how far its products are exact.
ANGLES = {
    "small": np.concatenate([10.0 ** RNG.uniform(-150.0, 0.0, 400), [0.0]]),
    "a few turns": RNG.uniform(-50.0, 50.0, 2000),
    "many turns": RNG.uniform(-1e8, 1e8, 2000),
    "near multiples of a quarter": np.array(
        [k * 0.5 * math.pi * (1.0 + d) for k in (1, 2, 3, 4, 5, 8, 1001, 2**22) for d in (-1e-9, -EPSILON, 0.0, 1e-12)]
    ),
}


@pytest.mark.parametrize("angles", ANGLES.values(), ids=ANGLES)
def test_sines_and_versines_have_all_digits(angles):
    with mpmath.workdps(40):
        for angle in angles.tolist():
            sine, versine = sine_and_versine(angle)
            right = mpmath.sin(mpmath.mpf(angle)), 2 * mpmath.sin(mpmath.mpf(angle) / 2) ** 2
            for found, wanted in zip((sine, versine), right, strict=True):
                # Of two numbers, sin and cos of half the angle, each within 1 ulp, and what the reduction leaves
                assert abs(found - wanted) <= 3.0 * EPSILON * abs(wanted) + 1e-17 * EPSILON * abs(angle)


def test_beyond_the_error_is_that_of_the_rounded_angle():
    with mpmath.workdps(40):
        for angle in (10.0 ** np.random.default_rng(7).uniform(8.0, 15.0, 200)).tolist():
            sine, versine = sine_and_versine(angle)
            assert abs(sine - mpmath.sin(mpmath.mpf(angle))) <= EPSILON * angle
            assert abs(versine - 1 + mpmath.cos(mpmath.mpf(angle))) <= EPSILON * angle


@pytest.mark.parametrize("angles", ANGLES.values(), ids=ANGLES)
def test_for_a_guess_six_digits_do(angles):
    for angle in angles.tolist():
        assert nearly_sine_and_versine_of(*reduced(angle)) == pytest.approx(sine_and_versine(angle), abs=1e-6)


@pytest.mark.parametrize("angles", ANGLES.values(), ids=ANGLES)
def test_sines_and_cosines_of_arrays(angles):
    sines, cosines = sine_and_cosine(angles)
    assert sines.tolist() == [sine_and_cosine(angle)[0] for angle in angles.tolist()]
    assert abs(sines - np.sin(angles)).max() <= 2.0 * EPSILON
    assert abs(cosines - np.cos(angles)).max() <= 2.0 * EPSILON


def test_waves_of_a_little_later_have_the_digits_of_one():
    with mpmath.workdps(40):
        for angle in ANGLES["a few turns"][:300].tolist():
            more = RNG.uniform(-LITTLE_ANGLE, LITTLE_ANGLE)
            sine, versine = wave_of(angle).later(more)
            both = mpmath.mpf(angle) + mpmath.mpf(more)
            assert abs(sine - mpmath.sin(both)) <= 2.0 * EPSILON
            assert abs(versine - 1 + mpmath.cos(both)) <= 4.0 * EPSILON


def test_an_odd_and_an_even_function():
    for angle in ANGLES["a few turns"].tolist():
        sine, versine = sine_and_versine(angle)
        assert sine_and_versine(-angle) == (-sine, versine)


@pytest.mark.level3
def test_the_same_compiled():
    in_kernel = compiled(sine_and_versine)
    for angles in ANGLES.values():
        assert all(in_kernel(angle) == sine_and_versine(angle) for angle in angles.tolist())
