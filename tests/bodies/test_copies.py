"""Many copies of a body: what they hold and what they refuse."""

import math

import numpy as np
import pytest

import swarm

BODY = swarm.tetrahedron(edge=1.0, mass=4.0)
# Two copies, the second 3 m farther along x.
PLACES = BODY.points.T[:, :, None] + np.array([0.0, 3.0]) * np.array([1.0, 0.0, 0.0])[:, None, None]
# Each copy drifts and turns as a rigid body: all numbers differ.
DRIFT, SPIN = np.array([[1.0, 4.0], [-2.0, 7.0], [3.0, -5.0]]), np.array([[0.5, -1.0], [2.0, 3.0], [-1.5, 0.25]])
RATES = DRIFT[:, None] + np.cross(SPIN[:, None], BODY.points.T[:, :, None], axis=0)


def test_arrays_are_copied_in_c_order():
    given = np.asfortranarray(PLACES)
    bodies = swarm.Bodies(BODY, given, RATES)
    assert bodies.position.flags.c_contiguous
    bodies.position[0, 0, 0] = 99.0
    assert given[0, 0, 0] != 99.0
    assert len(bodies) == 2


def test_one_copy_needs_no_third_axis():
    bodies = swarm.Bodies(BODY, PLACES[:, :, 1], RATES[:, :, 1])
    assert (bodies.position == PLACES[:, :, 1:]).all()
    assert (bodies.velocity == RATES[:, :, 1:]).all()


def test_copies_are_checked_again():
    bodies = swarm.Bodies(BODY, PLACES, RATES)
    assert (bodies.copy().velocity == RATES).all()
    bodies.velocity[0, 0, 0] = math.nan
    with pytest.raises(swarm.SceneError, match="velocity"):
        bodies.copy()


def test_points_as_particles():
    """Point p of copy i is number p n + i."""
    particles = swarm.Bodies(BODY, PLACES, RATES).particles()
    for p in range(4):
        for i in range(2):
            assert (particles.position[:, 2 * p + i] == PLACES[:, p, i]).all()
            assert (particles.velocity[:, 2 * p + i] == RATES[:, p, i]).all()
    assert (particles.mass == 1.0).all()


def test_masses_of_particles_are_positive_and_add_up():
    """Of a body with a full matrix, also one with a negative row sum."""
    matrix = np.array([[10.0, -2.0], [-2.0, 1.0]])
    body = swarm.Body([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], mass_matrix=matrix)
    mass = swarm.Bodies(body, np.zeros((3, 2, 3)), np.zeros((3, 2, 3))).particles().mass.reshape(2, 3)
    assert mass.sum(axis=0) == pytest.approx(7.0, rel=1e-15)
    assert mass[0] == pytest.approx(10.0 * mass[1], rel=1e-15)
    unequal = swarm.Body(BODY.points, [1.0, 2.0, 3.0, 4.0])
    assert swarm.Bodies(unequal, PLACES, RATES).particles().mass.tolist() == [1, 1, 2, 2, 3, 3, 4, 4]


def test_contact_points_are_combinations():
    cube = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    body = swarm.rigid(cube, 1.0)
    places = body.points.T[:, :, None] + np.array([0.0, 3.0])
    points = swarm.Bodies(body, places, np.zeros_like(places)).contact_points()
    assert points[:, :, 0] == pytest.approx(cube.T, abs=1e-14)
    assert points[:, :, 1] == pytest.approx(cube.T + 3.0, abs=1e-14)


def moved(copy, point, distance):
    places = PLACES.copy()
    places[1, point, copy] += distance
    return places


BEAD = swarm.Body([(1.0, 0.0, 0.0)], 1.0, guides=[(0, swarm.Sphere(1.0))])


@pytest.mark.parametrize(
    ("build", "parts"),
    [
        (lambda: swarm.Bodies(BODY.points, PLACES, RATES), ["body", "swarm.Body"]),
        (lambda: swarm.Bodies(BODY, PLACES.transpose(2, 1, 0), RATES), ["position", "(3, 4, n)", "(2, 4, 3)"]),
        (lambda: swarm.Bodies(BODY, PLACES[:, :, :0], RATES), ["position", "at least one", "(3, 4, 0)"]),
        (lambda: swarm.Bodies(BODY, PLACES, RATES[:, :, :1]), ["velocity", "shape of position", "(3, 4, 1)"]),
        (lambda: swarm.Bodies(BODY, PLACES, RATES[0]), ["velocity", "(3, 4, n)", "(4, 2)"]),
        (lambda: swarm.Bodies(BODY, PLACES, RATES + math.inf), ["velocity", "finite"]),
        (lambda: swarm.Bodies(BODY, moved(1, 2, math.nan), RATES), ["position", "finite", "[1, 2, 1]"]),
        (lambda: swarm.Bodies(BODY, moved(1, 3, 1e-6), RATES), ["links[2]", "(0, 3)", "copy 1", "1 such", "1 m long"]),
        (lambda: swarm.Bodies(BODY, "places", RATES), ["position", "array of numbers"]),
        (
            lambda: swarm.Bodies(BEAD, [[[0.0, 0.6]], [[1.0, 0.0]], [[0.0, 0.7]]], np.zeros((3, 1, 2))),
            ["guides[0]: point 0 of copy 1", "on its surface"],
        ),
    ],
)
def test_errors_name_the_argument(build, parts):
    with pytest.raises(swarm.SceneError) as caught:
        build()
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_lengths_may_have_round_off():
    swarm.Bodies(BODY, moved(1, 3, 1e-11), RATES)
