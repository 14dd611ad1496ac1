"""Soft balls among solids, in outlines and in meshes: contacts by faces."""

import numpy as np
import pytest
from grains_runs import ran

import swarm
from swarm.surfaces.facets.faces import faces_of

DOWN = (0.0, 0.0, -9.81)
CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
# Of the cube, each side as two triangles that turn to the left from outside.
SIDES = np.array([
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
    [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
])  # fmt: skip
SOFT = swarm.Penalty(0.002, 1e4)
GROUPED = swarm.Mesh(CUBE, SIDES, group=[0] * 12, names=("a",), groups={"a": {"friction": 0.2}})


def one(place, velocity, radius=0.12):
    return swarm.Particles(np.array([place]).T, np.array([velocity]).T, radius=radius)


def test_a_rough_floor_of_balls_keeps_the_energy():
    x = np.linspace(-1.0, 1.0, 5)
    floor = swarm.Spheres([(a, b, -1.0) for a in x for b in x], 0.3)
    scene = swarm.Scene([swarm.Box((1.0, 1.0, 1.0)), floor], gravity=DOWN)
    place = np.array([(-0.6, -0.2, 0.2, 0.6), (-0.3, 0.3, 0.1, -0.1), 4 * [-0.4]])
    result = ran(scene, swarm.Particles(place, np.zeros_like(place), radius=0.12), SOFT, 0.4, every=0.1)
    seen = result.observables
    assert seen["impulse"][-1][1] > 0.0
    assert seen["energy_error"].max() < 1e-13


@pytest.mark.parametrize(
    ("field", "alone"),
    [
        (swarm.Spheres([(0.0, 0.0, 0.0)], 0.3), swarm.Sphere(0.3, side="outside")),
        (swarm.Boxes([(0.0, 0.0, 0.0)], (0.2, 0.3, 0.3)), swarm.Box((0.2, 0.3, 0.3), side="outside")),
        (
            swarm.Cylinders([(0.0, 0.0, 0.0)], 0.3, lengths=0.5),
            swarm.Cylinder(0.3, length=0.5, side="outside"),
        ),
    ],
)
def test_a_body_of_a_field_is_that_body(field, alone):
    ball, room = one((0.1, 0.05, 0.6), (0.1, 0.0, -2.0)), swarm.Box((1.0, 1.0, 1.0))
    ends = [ran(swarm.Scene([room, body]), ball, SOFT, 0.25).particles for body in (field, alone)]
    assert ends[0].velocity[2, 0] > 0.0
    np.testing.assert_allclose(ends[0].position, ends[1].position, rtol=0.0, atol=1e-12)


def test_a_mesh_of_a_box_is_that_box():
    mesh = swarm.Mesh(CUBE, SIDES)
    ball = one((0.1, 0.07, -0.2), (1.0, 2.0, -0.5))
    results = [ran(swarm.Scene([wall], gravity=DOWN), ball, SOFT, 0.6) for wall in (mesh, swarm.Box((0.5, 0.5, 0.5)))]
    impacts = [result.observables["impacts"][-1] for result in results]
    assert impacts[0] == impacts[1] > 3
    np.testing.assert_allclose(results[0].particles.position, results[1].particles.position, rtol=0.0, atol=1e-9)
    assert results[0].observables["energy_error"].max() < 1e-13


def test_a_ball_that_rolls_over_the_diagonal_of_a_side_feels_nothing():
    mesh = swarm.Mesh(CUBE, SIDES)
    depth = 9.81 / 1e4
    ball = one((-0.3, -0.2, -0.5 + 0.12 - depth), (0.7, 0.5, 0.0))
    end = ran(swarm.Scene([mesh], gravity=DOWN), ball, SOFT, 0.8).particles
    np.testing.assert_allclose(end.velocity[:, 0], (0.7, 0.5, 0.0), rtol=0.0, atol=1e-11)


def test_energy_over_an_edge_and_a_corner():
    mesh = swarm.Mesh(CUBE, SIDES, side="outside")
    scene = swarm.Scene([swarm.Box((1.5, 1.5, 1.5)), mesh], gravity=DOWN)
    place = np.array([(0.45, 0.0), (0.0, 0.42), (0.62, 0.75)])
    velocity = np.array([(0.5, 0.3), (0.1, 0.4), (0.0, -1.0)])
    result = ran(scene, swarm.Particles(place, velocity, radius=0.12), SOFT, 0.5, every=0.1)
    assert result.observables["energy_error"].max() < 1e-13
    assert result.particles.position[2].min() < 0.4


def test_a_ball_rests_in_a_corner_of_two_faces():
    mesh = swarm.Mesh(CUBE, SIDES, restitution=0.2)
    scene = swarm.Scene([mesh], gravity=(0.0, -9.81, -9.81))
    result = ran(scene, one((0.0, -0.3, -0.35), (0.0, 0.0, 0.0)), SOFT, 2.0)
    seen = result.observables
    assert seen["kinetic_energy"][-1] < 1e-9
    np.testing.assert_allclose(result.particles.position[1:, 0], 2 * [-0.38 - 9.81e-4], rtol=0.0, atol=1e-6)
    assert seen["energy_error"].max() < 1e-12


@pytest.mark.parametrize(
    "corners",
    [
        [(-1, 1), (-1, 0), (-0.3, -1), (0.3, -1), (1, 0), (1, 1)],
        # With an orifice, whose edges are towards the balls
        [(-1, 1), (-1, 0), (-0.2, -1), (-0.2, -1.2), (-1, -2), (1, -2), (0.2, -1.2), (0.2, -1), (1, 0), (1, 1)],
    ],
)
def test_a_hopper_in_a_plane(corners):
    scene = swarm.Scene([swarm.Polygon(corners)], gravity=(0.0, -9.81, 0.0), plane="z")
    place = np.array([(-0.5, 0.02, 0.5), (0.2, 0.1, 0.3), (0.0, 0.0, 0.0)])
    result = ran(scene, swarm.Particles(place, 0.0 * place, radius=0.1), SOFT, 0.6, every=0.2)
    assert result.observables["impacts"][-1] > 2
    assert result.observables["energy_error"].max() < 1e-13
    assert (result.particles.position[2] == 0.0).all()


def test_faces_of_meshes():
    # A box around balls: six sides; around it: one. Round-off of a file bends none.
    assert np.unique(faces_of(CUBE, SIDES, -1.0)[1]).size == 6
    noisy = CUBE + 1e-7 * np.random.default_rng(1).normal(size=CUBE.shape)
    corners, face = faces_of(noisy, SIDES, 1.0)
    assert np.unique(face).size == 1
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(normals[0::2] / 1.0, normals[1::2], rtol=0.0, atol=1e-6)


def test_friction_at_faces_survives_new_lists():
    mesh = swarm.Mesh(CUBE, SIDES, friction=0.4)
    scene = swarm.Scene([mesh], gravity=(3.0, 0.0, -9.81))
    ball = one((-0.3, 0.1, -0.5 + 0.12 - 9.81e-4), (0.0, 0.0, 0.0))
    result = ran(scene, ball, SOFT, 0.5, every=0.1)
    # A ball that rolls without a slip
    assert result.particles.velocity[0, 0] == pytest.approx(3.0 * 0.5 / 1.4, rel=1e-3)
    assert result.observables["energy_error"].max() < 1e-12


@pytest.mark.parametrize(
    ("surfaces", "wrong"),
    [
        ([GROUPED], "groups must have no restitution and no friction with .*, got those of a: "),
    ],
)  # fmt: skip
def test_what_fields_do_not_know(surfaces, wrong):
    scene = swarm.Scene([swarm.Box((2.0, 2.0, 2.0)), *surfaces])
    with pytest.raises(swarm.SceneError, match=wrong):
        ran(scene, one((0.0, 0.0, 0.3), (0.0, 0.0, 0.0), 0.01), SOFT, 0.1)
