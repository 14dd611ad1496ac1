"""Exponentials, hyperbolic functions, logarithms and powers against 50 digits."""

import math

import mpmath
import numpy as np
import pytest
from conftest import compiled

from swarm.kernel.elementary import exponential, hyperbolic, hyperbolic_tangent, logarithm, power

RNG = np.random.default_rng(7)
_SMALL = 10.0 ** RNG.uniform(-300.0, 0.0, 300)
_HALF = 0.5 * math.log(2.0)
# About odd multiples of ln(2)/2 the reduction goes over to another power of 2.
ARGUMENTS = np.concatenate([
    RNG.uniform(-708.0, 708.0, 500), RNG.uniform(-3.0, 3.0, 1000), _SMALL, -_SMALL, [0.0],
    [k * _HALF * (1.0 + d) for k in (-9, -3, -1, 1, 2, 3, 4, 1001) for d in (-1e-9, -1e-16, 0.0, 1e-12)],
])  # fmt: skip
ABOVE_ZERO = np.concatenate(
    [10.0 ** RNG.uniform(-307.0, 308.0, 500), RNG.uniform(0.3, 3.0, 1000), 1.0 + _SMALL, 1.0 - 0.5 * _SMALL]
)
_BETWEEN = ABOVE_ZERO[(ABOVE_ZERO > 2e-5) & (ABOVE_ZERO < 6e4)]
FUNCTIONS = {
    "exponential": (exponential, mpmath.exp, ARGUMENTS),
    "sine": (lambda a: hyperbolic(a)[0], mpmath.sinh, ARGUMENTS),
    "cosine": (lambda a: hyperbolic(a)[1], mpmath.cosh, ARGUMENTS),
    "tangent": (hyperbolic_tangent, mpmath.tanh, ARGUMENTS),
    "logarithm": (logarithm, mpmath.log, ABOVE_ZERO),
    "root": (lambda u: power(u, 1.0 / 3.0), lambda u: u ** (1.0 / 3.0), ABOVE_ZERO),
    "power": (lambda u: power(u, 7.7), lambda u: u**7.7, _BETWEEN),
    "high power": (lambda u: power(u, 63.7), lambda u: u**63.7, _BETWEEN),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_two_units_in_the_last_place(name):
    function, exact, arguments = FUNCTIONS[name]
    most = 12.0 if name == "high power" else 2.0
    with mpmath.workdps(50):
        for one in arguments.tolist():
            right = exact(mpmath.mpf(one))
            assert abs(function(one) - right) <= most * math.ulp(float(right)), one


def test_beyond_all_numbers():
    assert [exponential(a) for a in (-math.inf, -1e9, -745.0, 710.0, 1e300, math.inf)] == [0.0] * 3 + [math.inf] * 3
    assert hyperbolic(-1e9) == (-math.inf, math.inf)
    assert [hyperbolic_tangent(a) for a in (-math.inf, -1e9, 1e9, math.inf)] == [-1.0, -1.0, 1.0, 1.0]
    assert [logarithm(u) for u in (0.0, math.inf)] == [-math.inf, math.inf]
    assert [power(u, 0.7) for u in (0.0, math.inf)] == [0.0, math.inf]
    undefined = exponential(math.nan), *hyperbolic(math.nan), hyperbolic_tangent(math.nan), logarithm(math.nan)
    assert all(map(math.isnan, (*undefined, logarithm(-1.0), power(-1.0, 0.7), power(math.nan, 0.7))))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_arrays_in_python(name):
    function, _exact, arguments = FUNCTIONS[name]
    one_by_one = np.array([function(one) for one in arguments.tolist()])
    assert (abs(function(arguments) - one_by_one) <= 13.0 * np.spacing(abs(one_by_one))).all()


def _all(a, u):
    return exponential(a), *hyperbolic(a), hyperbolic_tangent(a), logarithm(u), power(u, 0.7)


@pytest.mark.level3
def test_the_same_compiled():
    in_kernel = compiled(_all)
    for a, u in zip((*ARGUMENTS.tolist(), 1e9, -1e9), np.resize(ABOVE_ZERO, ARGUMENTS.size + 2).tolist(), strict=True):
        assert in_kernel(a, u) == _all(a, u)
