"""Balls that overlap, found by cells, against all pairs."""

import numpy as np
import pytest

from swarm.placing.cells import empty_cells, enter_free, find_free, order_of, overlaps_of

CELLS = {"none": (None,) * 3, "all": (1.0, 1.0, 1.0), "some": (1.0, None, 0.4)}


def of_all_pairs(position, radius, period):
    """How many overlap, which pair most, and by how much."""
    apart = position[:, :, None] - position[:, None, :]
    for k, length in enumerate(period):
        if length is not None:
            apart[k] -= length * np.floor(apart[k] / length + 0.5)
    depth = radius[:, None] + radius - np.sqrt((apart**2).sum(axis=0))
    first, second = np.triu_indices(len(radius), 1)
    depths = depth[first, second]
    most = int(depths.argmax())
    return int((depths > 0.0).sum()), (first[most], second[most]), depths[most]


@pytest.mark.parametrize("period", CELLS.values(), ids=CELLS)
@pytest.mark.parametrize("sizes", ["alike", "mixed"])
@pytest.mark.parametrize("n", [2, 30, 250])
def test_overlaps_are_those_of_all_pairs(period, sizes, n):
    random = np.random.default_rng(n)
    position = random.random((3, n)) * np.array([[1.0], [1.0], [0.4]])
    radius = np.full(n, 0.08) if sizes == "alike" else 0.1 * 10.0 ** (-2.0 * random.random(n))
    found, expected = overlaps_of(position, radius, period), of_all_pairs(position, radius, period)
    if not expected[0]:
        assert found is None
        return
    assert (found.number, found.pair) == expected[:2]
    assert found.depth == pytest.approx(expected[2], rel=1e-12)


def test_balls_in_a_row_and_at_one_place():
    row = np.arange(50) * np.array([[0.2], [0.0], [0.0]])
    assert overlaps_of(row, np.full(50, 0.1)) is None or overlaps_of(row, np.full(50, 0.1)).depth < 1e-14
    found = overlaps_of(np.zeros((3, 4)), np.ones(4))
    assert (found.number, found.depth) == (6, 2.0)


def test_a_ball_that_enters_overlaps_no_other():
    random = np.random.default_rng(1)
    radius = 0.1 + 0.15 * random.random(40)
    cells = empty_cells(np.zeros(3), np.ones(3), None, radius)
    done, points = np.zeros(40, np.bool_), random.random((3, 280))
    numbers = np.repeat(order_of(radius), 7)
    enter_free(cells, points, numbers, done)
    assert 5 < done.sum() < 40
    assert overlaps_of(cells.position[:, done], radius[done]) is None
    # No ball enters twice, and balls in place are in the way of those that come.
    enter_free(cells, random.random((3, 280)), numbers, done)
    assert overlaps_of(cells.position[:, done], radius[done]) is None
    assert not find_free(cells, cells.position[:, done], radius[done]).any()
    assert find_free(cells, np.array([[3.0], [3.0], [3.0]]), np.array([0.05])).all()
