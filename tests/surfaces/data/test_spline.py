"""The tricubic spline: through its samples, of order 4, and equal to SciPy's."""

import mpmath
import numpy as np
import pytest
from conftest import EPSILON, call
from samples import ball, bumpy
from scipy.interpolate import make_interp_spline

from swarm.kernel.vector import Vec, vec
from swarm.surfaces.data import spline


def points_in(surface, n, random):
    """Random points of the grid, (3, n)."""
    low = np.array(surface.origin)[:, None]
    wide = (np.array(surface.values.shape) - 1.0) * surface.spacing
    return low + wide[:, None] * random.random((3, n))


def test_it_is_the_spline_of_scipy():
    # Whose default ends are the same, "not a knot".
    surface, points = bumpy(), points_in(bumpy(), 20, np.random.default_rng(5))
    for point in points.T:
        made = surface.values
        for k, coordinate in enumerate(point):
            axis = surface.origin[k] + surface.spacing[k] * np.arange(surface.values.shape[k])
            made = make_interp_spline(axis, made, k=3, axis=0)(coordinate)
        assert surface.phi(point) == pytest.approx(float(made), abs=1e-13)


def test_it_goes_through_the_samples():
    surface = bumpy()
    places = np.argwhere(np.ones(surface.values.shape, bool)).T
    points = np.array(surface.origin)[:, None] + places * np.array(surface.spacing)[:, None]
    assert np.abs(surface.phi(points) - surface.values.ravel()).max() < 1e-13


@pytest.mark.parametrize("least", [4, 5, 6])
def test_few_samples_of_a_cubic_are_that_cubic(least):
    x = np.arange(least) + 0.0
    values = x[:, None, None] ** 3 - 2.0 * x[:, None] * x[:, None, None] + x**2 - 3.0
    found = spline.coefficients(values)
    made = spline.Spline(Vec(0.0, 0.0, 0.0), *(2 * [Vec(1.0, 1.0, 1.0)]), vec(3 * [least - 1.0]), 1.0, found)
    for point in np.random.default_rng(1).uniform(0.0, least - 1.0, (10, 3)):
        a, b, c = point
        assert call(made.value, point) == pytest.approx(a**3 - 2.0 * a * b + c**2 - 3.0, abs=1e-12)
        value, slope = call(made.value_and_slope, point)
        assert np.allclose([value, *slope], [a**3 - 2 * a * b + c**2 - 3, 3 * a * a - 2 * b, -2 * a, 2 * c], atol=1e-12)
        assert np.allclose(call(made.half_bend, point), [3 * a, 0.0, 1.0, -1.0, 0.0, 0.0], atol=1e-12)


def test_the_error_is_of_order_four():
    # Where the distance is smooth: not at the middle. So many points that the largest error of any of them is that of
    # space: of another 2000, orders are 3.7 to 4.2. Most are near 0.3, where the error is largest.
    random, n = np.random.default_rng(5), 20_000
    points = random.normal(size=(3, n))
    points *= (0.3 + 0.25 * random.random(n) ** 3) / np.sqrt((points**2).sum(axis=0))
    exact = np.sqrt((points**2).sum(axis=0))
    errors, slopes = [], []
    for samples in (17, 33, 65):
        surface = ball(samples)
        errors.append(np.abs(surface.phi(points) - (exact - 0.5)).max())
        slopes.append(np.abs(surface.gradient(points) - points / exact).max())
    assert np.log2(errors[1] / errors[2]) > 3.8
    assert np.log2(slopes[1] / slopes[2]) > 2.8


def test_derivatives_are_those_of_phi():
    surface, step = bumpy(), 1e-5
    (numbers,) = surface.walls()
    for point in points_in(surface, 20, np.random.default_rng(5)).T * 0.98:
        shifts = step * np.eye(3)
        differences = [(surface.phi(point + one) - surface.phi(point - one)) / (2.0 * step) for one in shifts]
        assert np.allclose(call(numbers.gradient, point), differences, atol=1e-8)
        rows = [(surface.gradient(point + one) - surface.gradient(point - one)) / (4.0 * step) for one in shifts]
        h = call(numbers.hessian, point)
        assert np.allclose([[h.xx, h.xy, h.zx], [h.xy, h.yy, h.yz], [h.zx, h.yz, h.zz]], rows, atol=1e-6)


@pytest.mark.parametrize("length", [1e-1, 1e-3, 1e-6, 1e-10])
def test_differences_do_not_cancel(length):
    surface = bumpy()
    (numbers,) = surface.walls()
    exactly = spline_of(numbers)
    low, inverse = np.array(numbers.spline.low), np.array(numbers.spline.inverse)
    random = np.random.default_rng(5)
    for point in points_in(surface, 20, random).T * 0.5:
        other = point + length * random.normal(size=3)
        error = abs(float(call(numbers.difference, point, other) - (exactly(other) - exactly(point))))
        crosses = (np.floor((point - low) * inverse) != np.floor((other - low) * inverse)).any()
        assert error <= 4.0 * EPSILON * (1.0 if crosses else 20.0 * np.abs(other - point).max())


def spline_of(numbers):
    """The value of the spline by its definition, in 40 digits."""
    made = numbers.spline

    def value(point):
        with mpmath.workdps(40):
            weights, first = [], []
            for x, low, inverse, n in zip(point, made.low, made.inverse, made.shape, strict=True):
                u = (mpmath.mpf(float(x)) - mpmath.mpf(float(low))) * mpmath.mpf(float(inverse))
                i = int(min(max(mpmath.floor(u), 0), n - 1))
                t = u - i
                s = 1 - t
                weights.append([s**3 / 6, (4 - 6 * t**2 + 3 * t**3) / 6, (4 - 6 * s**2 + 3 * s**3) / 6, t**3 / 6])
                first.append(i)
            total = mpmath.mpf(0)
            for a, b, c in np.ndindex(4, 4, 4):
                coefficient = made.coefficients[first[0] + a, first[1] + b, first[2] + c]
                total += weights[0][a] * weights[1][b] * weights[2][c] * mpmath.mpf(float(coefficient))
            return total

    return value
