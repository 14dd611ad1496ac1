"""The uniform grid: where points are, the order of what is in a cell, and flights from cell to cell."""

import itertools

import numpy as np
import pytest

from swarm.kernel.gravity import Gravity
from swarm.kernel.grid import (
    MARGIN,
    MostPull,
    block_of,
    cell_of,
    entries_of,
    filled_grid,
    layer_of,
    number_of,
    one_cell,
    over_entries,
    until_next,
    until_out,
    wrapped,
)
from swarm.kernel.vector import Vec, vec

LOW, SHAPE, WIDTH = np.array([-1.0, 0.5, 2.0]), np.array([4.0, 3.0, 5.0]), np.array([0.5, 0.25, 0.125])
RANDOM = np.random.default_rng(11)
POINTS = LOW + SHAPE * WIDTH * RANDOM.random((40, 3))
FALL = Gravity(*np.array([0.3, -0.2, -1.0]))


def by_layers(points):
    return np.floor((points - LOW) / WIDTH).astype(int)


def enter_points(grid, place, entries):
    for m, (x, y, z) in enumerate(by_layers(POINTS).tolist()):
        cell = int(number_of(grid.shape, x, y, z))
        if entries.size > 0:
            entries[place[cell]] = m
        place[cell] += 1


GRID = filled_grid(LOW, SHAPE, WIDTH, enter_points)


def test_entries_are_where_they_were_entered_and_in_that_order():
    numbers = [cell_of(GRID, vec(r)).number for r in POINTS]
    assert numbers == [np.ravel_multi_index(place, SHAPE.astype(int)) for place in by_layers(POINTS)]
    for number in range(60):
        first, stop = entries_of(GRID, number)
        assert GRID.entries[first:stop].tolist() == [m for m, one in enumerate(numbers) if one == number]
    assert len(set(numbers)) < len(numbers) == len(GRID.entries)


def test_what_is_outside_is_in_the_last_cell_which_holds_nothing():
    for r in (LOW - 0.1, LOW + SHAPE * WIDTH + 0.1, (LOW + WIDTH * [-1.0, 1.5, 1.5])):
        cell = cell_of(GRID, vec(r))
        assert not cell.inside
        assert cell.number == 60
        assert len(set(entries_of(GRID, cell.number))) == 1
    # Where a flight ends that leaves the grid is outside, where it comes in is inside.
    assert cell_of(GRID, vec(LOW - 0.4 * MARGIN * WIDTH)).inside
    assert not cell_of(GRID, vec(LOW - MARGIN * WIDTH)).inside


def test_a_block_is_the_cells_of_a_box():
    for _case in range(30):
        low, high = np.sort(LOW + SHAPE * WIDTH * RANDOM.uniform(-0.3, 1.3, (2, 3)), axis=0)
        found = over_entries(GRID, block_of(GRID, vec(low), vec(high)), [], lambda found, m: [*found, m])
        place, first, last = by_layers(POINTS), by_layers(low), by_layers(high)
        assert sorted(found) == np.flatnonzero(((place >= first) & (place <= last)).all(axis=1)).tolist()


def test_layers_end_at_the_ends_or_go_round():
    assert [layer_of(place, 4.0) for place in (-np.inf, -0.1, 0.0, 1.9, 3.0, 4.0, np.inf)] == [0, 0, 0, 1, 3, 3, 3]
    assert [wrapped(layer, 4) for layer in range(-1, 5)] == [3, 0, 1, 2, 3, 0]


@pytest.mark.filterwarnings("ignore:divide by zero:RuntimeWarning")
@pytest.mark.parametrize("gravity", [None, FALL], ids=["straight", "falling"])
def test_a_flight_passes_every_cell_of_its_way(gravity):
    """It steps to a neighbour, of which it is a margin inside, and comes out at the end."""
    pull = np.zeros(3) if gravity is None else np.array(gravity)
    for r, v in itertools.islice(zip(POINTS, RANDOM.standard_normal((40, 3)), strict=True), 20):
        cell = cell_of(GRID, vec(r))
        for _step in range(60):
            time = until_next(gravity, GRID, cell, vec(r), vec(v))
            assert until_out(gravity, GRID, cell.place, cell.place, vec(r), vec(v)) == pytest.approx(time, rel=1e-9)
            # Of an acceleration of any direction it is known to be there for a shorter time.
            bounds = 3 * (MostPull(*np.array(2 * [np.linalg.norm(pull)])),)
            assert until_next(bounds, GRID, cell, vec(r), vec(v)) <= time * (1.0 + 1e-9)
            # Of one that is known, for just that time.
            known = tuple(MostPull(a, -a) for a in pull)
            assert until_next(known, GRID, cell, vec(r), vec(v)) == pytest.approx(time, rel=1e-9)
            assert until_out(known, GRID, cell.place, cell.place, vec(r), vec(v)) == pytest.approx(time, rel=1e-9)
            r, v = r + time * (v + 0.5 * time * pull), v + time * pull
            before, cell = cell, cell_of(GRID, vec(r))
            assert sum(map(abs, before.place - cell.place)) == 1.0
            if not cell.inside:
                break
        assert not cell.inside


@pytest.mark.filterwarnings("ignore:divide by zero:RuntimeWarning")
@pytest.mark.parametrize("gravity", [None, FALL], ids=["straight", "falling"])
def test_a_flight_from_outside_comes_in_no_sooner_than_is_known(gravity):
    """Every other one is aimed at a point of the grid, and comes in at last."""
    pull = np.zeros(3) if gravity is None else np.array(gravity)
    for k, point in enumerate(POINTS):
        aimed = k % 2 == 0
        r = point + 4.0 * RANDOM.standard_normal(3)
        v = point - r - 0.5 * pull if aimed else RANDOM.standard_normal(3)
        cell = cell_of(GRID, vec(r))
        for _step in range(20):
            if cell.inside:
                break
            time = until_next(gravity, GRID, cell, vec(r), vec(v))
            for part in np.linspace(0.0, min(time, 2.0), 50)[:-1]:
                assert not cell_of(GRID, vec(r + part * (v + 0.5 * part * pull))).inside
            if time == np.inf:
                break
            r, v = r + time * (v + 0.5 * time * pull), v + time * pull
            cell = cell_of(GRID, vec(r))
        assert cell.inside or not aimed


def test_a_grid_of_one_cell_has_all_everywhere():
    grid = one_cell(3)
    cell = cell_of(grid, Vec(1e9, -1e9, 0.0))
    assert cell.inside
    assert grid.entries[slice(*entries_of(grid, cell.number))].tolist() == [0, 1, 2]
