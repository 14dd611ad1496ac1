"""Where a ball may still be placed: no place is lost, and what is left shrinks to the places."""

import numpy as np

import swarm
from swarm.placing import vacant as boxes
from swarm.placing.cells import empty_cells, enter_free, find_free, order_of
from swarm.placing.vacant import Vacant

SCENE = swarm.Scene([swarm.Sphere(1.0)])
LOW, HIGH = np.full((3, 1), -1.0), np.full((3, 1), 1.0)


def filled(n, radius):
    """Balls at random places."""
    random, sizes = np.random.default_rng(2), np.full(n, radius)
    cells = empty_cells(LOW[:, 0], HIGH[:, 0], None, sizes)
    done = np.zeros(n, np.bool_)
    enter_free(cells, random.uniform(-1.0, 1.0, (3, n)), order_of(sizes), done)
    return cells


def holds(vacant, points):
    """Whether each point is in one of the boxes."""
    places = np.floor((points - LOW) / vacant._width[:, None]).astype(int)
    known = set(map(tuple, vacant._boxes.T))
    return np.array([tuple(place) in known for place in places.T])


def test_every_place_that_is_left_is_in_a_box():
    cells = filled(60, 0.25)
    vacant = Vacant(SCENE, cells, LOW, HIGH, 0.25, 0.25)
    points = np.random.default_rng(3).uniform(-1.0, 1.0, (3, 3000))
    free = find_free(cells, points, np.full(3000, 0.25)) & (np.sqrt((points**2).sum(axis=0)) <= 0.75)
    shares = []
    for _ in range(3):
        inside = holds(vacant, points)
        assert not (free & ~inside).any()
        shares.append(free.sum() / inside.sum())
        vacant.refine()
    assert shares[0] < shares[1] < shares[2]
    assert shares[2] > 3.0 * free.mean()


def test_points_are_uniform_in_the_boxes():
    cells = filled(60, 0.25)
    vacant = Vacant(SCENE, cells, LOW, HIGH, 0.25, 0.25)
    points = vacant.points(20_000, np.random.default_rng(4))
    assert holds(vacant, points).all()
    counts = np.unique(np.floor((points - LOW) / vacant._width[:, None]), axis=1, return_counts=True)[1]
    assert abs(counts.mean() - 20_000 / len(vacant)) < 1.0 + 0.05 * counts.mean()


def test_nothing_is_left_where_a_ball_fills_its_vessel():
    cells = filled(1, 0.9)
    vacant = Vacant(SCENE, cells, LOW, HIGH, 0.9, 0.9)
    for _ in range(4):
        vacant.refine()
    assert len(vacant) == 0


def test_boxes_are_not_halved_beyond_their_number(monkeypatch):
    """Their memory is bounded: one halving makes eight of each box, and the next is not begun."""
    monkeypatch.setattr(boxes, "_SOME", 40)
    cells = filled(1, 0.25)
    vacant, most = Vacant(SCENE, cells, LOW, HIGH, 0.25, 0.25), 4 * (boxes._MOST + 40)
    for _ in range(6):
        vacant.refine()
        assert len(vacant) <= most
