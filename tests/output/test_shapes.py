"""Triangles and wires of walls lie on the walls, whatever phi is; their area is that of the closed form."""

import math

import numpy as np
import pytest

import swarm
from swarm.triangles.shapes import shapes_of

NOWHERE = np.zeros((3, 1))
SCENES = {
    "sphere": swarm.Scene([swarm.Sphere(0.5, (0.2, 0.0, -0.1))]),
    "torus": swarm.Scene([swarm.Torus(0.5, 0.2)]),
    "formula": swarm.Scene([swarm.Formula("x**2/0.09 + y**2/0.09 + z**4/0.13 - 1")]),
    "sphere with a floor": swarm.Scene([swarm.Sphere(0.5), swarm.Plane((0.0, 0.0, -1.0), 0.3)]),
    "small ball in a box": swarm.Scene([swarm.Box((0.5, 0.4, 0.3)), swarm.Sphere(0.004, (0.1, 0.0, 0.0), "outside")]),
}
# Of each surface: a spherical cap of height h has 2 pi R h.
AREAS = {
    "sphere": [math.pi],
    "torus": [4.0 * math.pi**2 * 0.5 * 0.2],
    "sphere with a floor": [2.0 * math.pi * 0.5 * 0.8, math.pi * (0.25 - 0.09)],
    "small ball in a box": [8.0 * (0.2 + 0.12 + 0.15), 4.0 * math.pi * 0.004**2],
}


@pytest.mark.parametrize("name", SCENES)
def test_they_lie_on_their_own_wall_and_no_other_is_before_it(name):
    scene = SCENES[name]
    for i, shape in enumerate(shapes_of(scene, NOWHERE)):
        surface = scene.surfaces[i]
        assert shape.name == f"{i}_{type(surface).__name__.lower()}"
        assert shape.solid == surface.is_solid()
        size = np.ptp(shape.vertices, axis=0).max()
        for points in (shape.vertices, np.vstack(shape.wires)):
            distance = np.abs(surface.phi(points.T)) / np.sqrt((surface.gradient(points.T) ** 2).sum(axis=0))
            # An edge is cut off by a cell at most.
            assert distance.max() < 0.05 * size
            assert np.median(distance) < 1e-3 * size
            others = np.delete(scene.gaps(points.T), i, axis=0)
            assert others.size == 0 or others.max() < 0.05 * size
        assert len(shape.wires) >= 5
        np.testing.assert_allclose((shape.normals**2).sum(axis=1), 1.0, rtol=1e-4)


@pytest.mark.parametrize("name", AREAS)
def test_areas(name):
    areas = [shape.area() for shape in shapes_of(SCENES[name], NOWHERE)]
    np.testing.assert_allclose(areas, AREAS[name], rtol=0.015)


@pytest.mark.parametrize("side", ["inside", "outside"])
@pytest.mark.parametrize(
    ("angle", "axis"), [(math.pi / 6.0, (0.0, 0.0, 1.0)), (0.05, (1.0, 0.3, 0.2)), (1.5, (0.0, -1.0, 0.0))]
)
def test_a_cone_is_drawn_with_its_tip(angle, axis, side):
    """A grid has no point at the apex, so that particles in it would be seen outside the wall."""
    apex = np.array([1.0, 2.0, 3.0])
    scene = swarm.Scene([swarm.Cone(angle, axis, apex, side=side), swarm.Sphere(2.0, apex)])
    cone = shapes_of(scene, NOWHERE)[0]
    far = np.sqrt(((cone.vertices - apex) ** 2).sum(axis=1))
    assert far.min() < 1e-12
    assert far.max() == pytest.approx(2.0)
    assert cone.area() == pytest.approx(math.pi * 4.0 * math.sin(angle), rel=2e-3)
    # All round the apex
    at_apex = cone.triangles[(far < 1e-12)[cone.triangles].any(axis=1)]
    assert len(at_apex) > 50
    np.testing.assert_allclose((cone.normals**2).sum(axis=1), 1.0)
    a, b, c = np.moveaxis(cone.vertices[cone.triangles], 1, 0)
    assert ((np.cross(b - a, c - a) * cone.normals[cone.triangles].sum(axis=1)).sum(axis=1) > -1e-12).all()


def test_where_pegs_go_through_a_wall_their_outlines_are_circles():
    """As many as Galton's board has, between the points of the coarse grid on a flat wall."""
    places = np.stack(np.meshgrid(np.linspace(-0.4, 0.4, 9), [0.0], np.linspace(-0.4, 0.4, 9)), axis=-1).reshape(-1, 3)
    pegs = swarm.Cylinders(places, 0.02, axes=(0.0, 1.0, 0.0))
    box = shapes_of(swarm.Scene([swarm.Box((0.5, 0.05, 0.5)), pegs]), NOWHERE)[0]
    rims = [edge for edge in box.edges if np.abs(edge[:, [0, 2]]).max() < 0.45]
    assert len(rims) == 2 * 81
    for rim in rims:
        middle = 0.5 * (rim.min(axis=0) + rim.max(axis=0))
        assert np.hypot(*(rim - middle)[:, [0, 2]].T) == pytest.approx(0.02, rel=0.05)
        assert len(rim) > 10


def test_where_a_wall_is_open_nothing_is_drawn():
    hole = swarm.Sphere(0.3, (0.0, 0.0, 0.5))
    (shape,) = shapes_of(swarm.Scene([swarm.Sphere(0.5, openings=[hole])]), NOWHERE)
    # Of the sphere a ball about one of its points, of radius a, cuts pi a^2.
    assert shape.area() == pytest.approx(math.pi * (1.0 - 0.09), rel=0.01)
    assert hole.phi(np.vstack(shape.wires).T).min() > -1e-6
    # Its rim, of radius a sin(angle), is an edge.
    assert np.abs(hole.phi(np.vstack(shape.edges).T)).max() < 1e-6


def test_an_open_volume_is_drawn_as_far_as_its_particles():
    floor = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0)], gravity=(0.0, 0.0, -1.0))
    (shape,) = shapes_of(floor, np.array([[3.0], [0.0], [1.0]]))
    low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
    assert low[0] <= -3.0
    assert high[0] >= 3.0
    assert np.abs(shape.vertices[:, 2]).max() < 1e-6


def test_each_of_many_bodies_is_drawn():
    """As a field, and listed one by one."""
    places = np.stack(np.meshgrid(*3 * [[-0.3, 0.0, 0.3]], indexing="ij"), -1).reshape(-1, 3)
    box = swarm.Box((0.5, 0.5, 0.5))
    cylinders = swarm.Cylinders(places, 0.1, lengths=0.2)
    _walls, shape = shapes_of(swarm.Scene([box, cylinders]), NOWHERE)
    assert shape.area() == pytest.approx(27 * 2.0 * np.pi * 0.1 * (0.1 + 0.2), rel=0.08)
    assert len(shape.levels) == 27 * 2
    listed = swarm.Scene([box, *(swarm.Sphere(0.1, tuple(place), "outside") for place in places.tolist())])
    _walls, *shapes = shapes_of(listed, NOWHERE)
    assert [shape.area() for shape in shapes] == pytest.approx(27 * [4.0 * np.pi * 0.01], rel=0.05)
    # Normals point into the volume, as those of every wall.
    ball = shapes[0]
    assert (((ball.vertices - places[0]) * ball.normals).sum(axis=1) > 0.0).all()


def test_more_bodies_than_are_wanted_are_not_drawn():
    balls = swarm.Spheres(centers=[[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]], radii=0.1)
    scene, somewhere = swarm.Scene([balls, swarm.Sphere(1.0)]), np.full((3, 1), 0.5)
    for most, drawn in ((2, [True, True]), (1, [False, True])):
        shapes = shapes_of(scene, somewhere, most=most)
        assert [len(shape.triangles) > 0 for shape in shapes] == drawn
        assert [shape.name for shape in shapes] == ["0_spheres", "1_sphere"]


def test_a_box_is_closed_at_its_corners():
    """A cut is straight within a triangle: corners, where two cuts meet, were left out."""
    turned = {"axis": (1.0, 2.0, 3.0), "angle": 0.5}
    scene = swarm.Scene(
        [swarm.Box((0.5, 0.4, 0.3), rotation=turned), swarm.Box((0.1, 0.05, 0.07), (0.1, 0.1, 0.0), "outside")]
    )
    for shape, volume in zip(shapes_of(scene, NOWHERE), (8.0 * 0.5 * 0.4 * 0.3, 8.0 * 0.1 * 0.05 * 0.07), strict=True):
        assert abs(swarm.Mesh(shape.vertices, shape.triangles).volume()) == pytest.approx(volume, rel=1e-12)
