"""Sums in a fixed order against those of LAPACK, and where they are exact."""

import numpy as np
import pytest

from swarm.bodies import algebra

RANDOM = np.random.default_rng(1)


def positive_definite(n, spread):
    """Symmetric, with eigenvalues from 1 to `spread`."""
    axes = np.linalg.qr(RANDOM.normal(size=(n, n)))[0]
    found = (axes * np.geomspace(1.0, spread, n)) @ axes.T
    return 0.5 * (found + found.T)


def test_a_product_is_that_of_dense_matrices():
    rows, matrix = RANDOM.normal(size=(7, 5)), RANDOM.normal(size=(5, 4))
    rows[RANDOM.random(rows.shape) < 0.6] = 0.0
    assert algebra.product(rows, matrix) == pytest.approx(rows @ matrix, rel=1e-14)


def test_determinants():
    matrices = RANDOM.normal(size=(6, 3, 3))
    assert algebra.determinants(matrices) == pytest.approx(np.linalg.det(matrices), rel=1e-13)


@pytest.mark.parametrize("n", [1, 4, 30])
def test_an_inverse(n):
    matrix = positive_definite(n, 1e4)
    assert algebra.inverse(matrix) @ matrix == pytest.approx(np.eye(n), abs=1e-11)


def test_the_inverse_of_masses_far_apart_is_exact():
    masses = np.array([3.0, 7e-30, 1.1e20, 0.1])
    assert (algebra.inverse(np.diag(masses)) == np.diag(1.0 / masses)).all()


@pytest.mark.parametrize(
    "matrix",
    [
        *(positive_definite(3, spread) for spread in (2.0, 1e8, 1.0 + 1e-12)),
        np.diag([2.0, 1.0, 3.0]),
        np.eye(3) + np.array([[0.0, 1e-300, 0.0], [1e-300, 0.0, 1e-17], [0.0, 1e-17, 0.0]]),
        np.ones((3, 3)) + 1e-9 * np.eye(3),
    ],
)
def test_modes_of_three(matrix):
    values, axes = algebra.modes_of_three(matrix)
    assert np.sort(values) == pytest.approx(np.linalg.eigvalsh(matrix), abs=1e-15 * 4.0 * np.abs(matrix).max())
    assert axes.T @ axes == pytest.approx(np.eye(3), abs=4e-15)
    assert (axes * values) @ axes.T == pytest.approx(matrix, abs=4e-15 * np.abs(matrix).max())
