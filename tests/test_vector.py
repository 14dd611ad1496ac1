"""Vectors against NumPy: whole numbers, so that nothing is rounded."""

import numpy as np
import pytest

from swarm.kernel import vector
from swarm.kernel.vector import vec

_RANDOM = np.random.default_rng(7)
A, B = (_RANDOM.integers(1, 9, (3, 500)) * _RANDOM.choice([-1.0, 1.0], (3, 500)) for _ in range(2))
a, b = vec(A), vec(B)


@pytest.mark.parametrize(
    ("made", "expected"),
    [
        (a + b, A + B),
        (a - b, A - B),
        (a * 3.0, 3.0 * A),
        (3.0 * a, 3.0 * A),
        (a / 4.0, A / 4.0),
        (vector.dot(a, b), (A * B).sum(axis=0)),
        (vector.square(a), (A * A).sum(axis=0)),
        (vector.norm(a), np.sqrt((A * A).sum(axis=0))),
        (vector.times(a, b), A * B),
        (vector.cross(a, b), np.cross(A, B, axis=0)),
        (vector.absolute(a), np.abs(A)),
        (vector.total(a), A.sum(axis=0)),
    ],
    ids=["+", "-", "times 3", "3 times", "/", "dot", "square", "norm", "times", "cross", "absolute", "total"],
)
def test_of_arrays(made, expected):
    assert np.array_equal(np.array(made), expected)


def test_of_numbers():
    for one, other in zip(A.T, B.T, strict=True):
        assert vector.largest(vec(one)) == np.abs(one).max()
        assert vector.lowest(vec(one), vec(other)) == tuple(np.minimum(one, other))
        assert vector.highest(vec(one), vec(other)) == tuple(np.maximum(one, other))
        assert vector.either(True, vec(one), vec(other)) == tuple(one)
        assert vector.either(False, vec(one), vec(other)) == tuple(other)


@pytest.mark.parametrize("axis", range(3))
def test_what_moves_along_one_axis_moves(axis):
    assert vector.moves(vec(np.eye(3)[axis]))
    assert not vector.moves(vec(np.zeros(3)))


def test_rows_of_a_column_are_a_vector():
    rows = np.zeros((7, 4))
    vector.put(rows, 2, 1, vec(A[:, 0]))
    assert np.array_equal(rows[2:5, 1], A[:, 0])
    assert np.abs(rows).sum() == np.abs(A[:, 0]).sum()
    assert vector.column(rows, 2, 1) == tuple(A[:, 0])
