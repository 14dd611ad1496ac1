"""Contact points on edges and faces: where they are, and how far the surface of a body is from them."""

import itertools
import math

import numpy as np
import pytest

import swarm
from swarm.bodies import covering
from swarm.bodies.elastic import block

CUBE = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
TETRAHEDRON = swarm.tetrahedron(edge=2.0, mass=1.0).points


def on_cube(points):
    return np.abs(points).max(axis=1) == pytest.approx(np.full(len(points), 0.5), abs=1e-15)


@pytest.mark.parametrize("spacing", [0.9, 0.5, 0.3, 0.13])
def test_points_at_a_spacing_are_on_the_surface_and_leave_no_larger_gap(spacing):
    body = swarm.rigid(CUBE, 1.0, contacts=spacing)
    points = body.contacts @ body.points
    # The vertices come first, and all others are new.
    assert points[:8] == pytest.approx(CUBE, abs=1e-15)
    assert on_cube(points)
    apart = np.sqrt(((points[:, None] - points) ** 2).sum(axis=2)) + 9.0 * np.eye(len(points))
    assert apart.min() > 0.3 * spacing
    assert apart.min(axis=1).max() <= spacing * (1.0 + 1e-12)
    # Any place of the surface, tried at random, has one within the largest circle of a lattice of triangles.
    random = np.random.default_rng(0)
    places = random.uniform(-0.5, 0.5, (20_000, 3))
    places[np.arange(20_000), random.integers(0, 3, 20_000)] = np.where(random.random(20_000) < 0.5, -0.5, 0.5)
    far = max(np.sqrt(((some[:, None] - points) ** 2).sum(axis=2)).min(axis=1).max() for some in np.split(places, 100))
    assert far <= spacing / math.sqrt(3.0)
    # What the check before a run says is above what is found, and not far above.
    assert far <= covering.distance(body) <= 1.5 * far


def test_mass_and_motion_are_those_of_the_body_without_them():
    plain, dense = swarm.rigid(CUBE, 7.0), swarm.rigid(CUBE, 7.0, contacts=0.2)
    assert (plain.points == dense.points).all()
    assert (plain.mass_matrix == dense.mass_matrix).all()
    assert (plain.faces == dense.faces).all()
    assert (dense.contacts[:8] == plain.contacts).all()


def test_points_that_are_given():
    body = swarm.rigid(CUBE + 3.0, 1.0, contacts=[(3.0, 3.0, 2.5), (3.0, 3.0, 3.5)])
    assert (body.contacts @ body.points)[8:] == pytest.approx(np.array([(3.0, 3.0, 2.5), (3.0, 3.0, 3.5)]), abs=1e-14)
    with pytest.raises(swarm.SceneError, match=r"contacts\[9\] is listed already as contacts\[8\]"):
        swarm.rigid(CUBE, 1.0, contacts=[(0.0, 0.0, 0.5)] * 2)


@pytest.mark.parametrize(
    ("contacts", "parts"),
    [
        (0.0, ["contacts", "above 0"]),
        (-0.1, ["contacts", "above 0"]),
        (math.nan, ["contacts", "finite"]),
        ("edges", ["contacts", "array of numbers"]),
        ([0.1, 0.2], ["contacts", "(P, 3)", "(2,)"]),
        (1e-3, ["a body must fit in", "contact points"]),
        (1e-90, ["a body must fit in", "contact points"]),
    ],
)
def test_errors_name_the_argument(contacts, parts):
    with pytest.raises(swarm.SceneError) as caught:
        swarm.rigid(CUBE, 1.0, contacts=contacts)
    assert all(part in str(caught.value) for part in parts), str(caught.value)


@pytest.mark.parametrize(
    ("body", "gap"),
    [
        # The middle of a square face, and of an equilateral triangle.
        (swarm.rigid(CUBE, 1.0), math.sqrt(0.5)),
        (swarm.rigid(TETRAHEDRON, 1.0), 2.0 / math.sqrt(3.0)),
        # Obtuse triangles: where the bisector of a short side meets the long one, 10/(2 cos A) for tan A = 1/10.
        (swarm.rigid([(-10, 0, 0), (10, 0, 0), (0, 1, 0), (0, 0, 1)], 1.0), 0.5 * 101.0 / 10.0),
        # The middle of an edge belongs to two cells, that of a cell is free.
        (swarm.elastic(block((1.0, 1.0, 1.0), (2, 2, 2)), 1.0, 0.3, 1.0), 0.5 * math.sqrt(0.5)),
        (swarm.dumbbell(1.0, 1.0), 0.0),
    ],
)
def test_the_largest_gap_between_contact_points(body, gap):
    assert gap * (1.0 - 1e-12) <= covering.distance(body) <= 1.2 * gap


def test_how_thick_a_body_is():
    turn = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
    assert covering.thickness(swarm.rigid(CUBE * (3.0, 0.2, 1.0) @ turn.T, 1.0)) == pytest.approx(0.1, rel=1e-9)
    assert covering.thickness(swarm.rigid(CUBE * (3.0, 0.2, 1.0) @ turn.T, 1.0, contacts=0.1)) == pytest.approx(0.1)
