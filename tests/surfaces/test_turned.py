"""Surfaces turned about the origin: each kind, unions with their parts and openings, fields body by body."""

from dataclasses import replace

import numpy as np
import pytest

import swarm
from bench import cells
from swarm.serialization import tables
from swarm.surfaces import rotation

AXIS, ANGLE = np.array((1.0, -2.0, 3.0)) / np.sqrt(14.0), 0.7
TURN = {"axis": tuple(AXIS), "angle": ANGLE}
QUATERNION = swarm.Sphere(1.0, rotation=TURN).rotation
CROSS = np.array([[0.0, -AXIS[2], AXIS[1]], [AXIS[2], 0.0, -AXIS[0]], [-AXIS[1], AXIS[0], 0.0]])
# Rodrigues' formula.
MATRIX = np.eye(3) + np.sin(ANGLE) * CROSS + (1.0 - np.cos(ANGLE)) * CROSS @ CROSS

PLACES = [[0.1, 0.2, 0.0], [1.0, 0.0, 0.3]]
FIELDS = {
    "cylinders": swarm.Cylinders(PLACES, 0.2, axes=[[0, 0, 1], [1, 1, 0]], lengths=0.5),
    "boxes": swarm.Boxes(PLACES, (0.1, 0.2, 0.3)),
    "ellipsoids": swarm.Ellipsoids(PLACES, (0.1, 0.2, 0.3), [[2, 0, 0, 1], [1, 2, 3, 4]]),
}
WALLS = [name for name in cells.SHAPES if name not in ("planes", "listed solids")]
POINTS = np.random.default_rng(3).uniform(-1.0, 2.0, (3, 400))


def _made(name):
    return cells.WALLS[name].make(cells.CENTER, cells.WALLS[name].sides[0], {})[0] if name in WALLS else FIELDS[name]


@pytest.mark.parametrize("name", [*WALLS, *FIELDS])
def test_phi_of_a_turned_surface_is_that_of_points_turned_back(name):
    surface = _made(name)
    expected, found = surface.phi(POINTS), surface.turned(QUATERNION).phi(MATRIX @ POINTS)
    known = np.isfinite(expected)
    assert np.array_equal(known, np.isfinite(found))
    assert known.sum() >= 20
    assert np.abs(found - expected)[known].max() < 2e-14 * max(1.0, np.abs(expected[known]).max())


@pytest.mark.parametrize("name", ["union", "intersection", "field", "foam", *FIELDS])
def test_a_rotation_of_the_whole_is_kept_by_what_it_has(name):
    surface = _made(name)
    made = replace(surface, rotation=TURN)
    assert made.rotation is None
    assert np.array_equal(made.phi(POINTS), surface.turned(QUATERNION).phi(POINTS))
    again = tables.surface_of(tables.table_of(made), "surface")
    assert np.array_equal(made.phi(POINTS), again.phi(POINTS))
    # Two turns are one by the sum of the angles.
    twice = replace(made, rotation=TURN)
    expected = replace(surface, rotation={**TURN, "angle": 2.0 * ANGLE}).phi(POINTS)
    assert np.abs(twice.phi(POINTS) - expected).max() < 1e-14 * max(1.0, np.abs(expected).max())


def test_openings_of_parts_turn_with_them():
    hole = swarm.Opening(swarm.Sphere(0.2, (0.5, 0.0, 0.0)), times=[(0.0, 1.0)])
    part = swarm.Sphere(0.5, openings=[swarm.Box((0.1, 0.1, 0.1), (0.0, 0.5, 0.0)), hole])
    union = swarm.Union([part, swarm.Box((0.2, 0.2, 0.9))], rotation=TURN)
    box, opening = union.parts[0].openings
    assert np.abs(np.array(box.center) - MATRIX @ (0.0, 0.5, 0.0)).max() < 1e-15
    assert np.abs(np.array(opening.surface.center) - MATRIX @ (0.5, 0.0, 0.0)).max() < 1e-15
    assert opening.times == ((0.0, 1.0),)


def test_a_rotation_matrix_is_a_rotation():
    """Also half turns about each axis, whose quaternion begins with 0, and their neighbours."""
    rng = np.random.default_rng(5)
    turns = [*rng.normal(size=(200, 4)), *np.eye(4), *(np.eye(4) + 1e-9 * rng.normal(size=(4, 4)))]
    for turn in turns:
        turn = turn / np.sqrt((turn**2).sum())
        rows = rotation.matrix(tuple(turn))
        for given in (rows, rows.tolist()):
            found = rotation.matrix(swarm.Sphere(1.0, rotation=given).rotation)
            assert np.abs(found - rows).max() < 4e-15
    assert swarm.Sphere(1.0, rotation=np.eye(3)).rotation is None
    assert np.abs(np.abs(swarm.Sphere(1.0, rotation=MATRIX).rotation @ np.array(QUATERNION)) - 1.0) < 1e-15


@pytest.mark.parametrize(
    "rows",
    [2.0 * np.eye(3), np.diag((1.0, 1.0, -1.0)), [[1, 0, 0], [0, 1, 0], [0, 1, 0]]],
    ids=["long", "mirror", "flat"],
)
def test_what_is_no_rotation_matrix(rows):
    with pytest.raises(swarm.SceneError, match=r"rotation must be a matrix of three rows that are of length 1"):
        swarm.Sphere(1.0, rotation=rows)


@pytest.mark.parametrize("rows", [[[1, 0, 0], [0, 1], [0, 0, 1]], [[1, 0, 0], [0, "a", 0], [0, 0, 1]]])
def test_a_row_of_another_length(rows):
    with pytest.raises(swarm.SceneError, match=r"rotation\[1\]"):
        swarm.Sphere(1.0, rotation=rows)
