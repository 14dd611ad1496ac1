"""Volumes in closed form against a fine grid, and scenes of which no closed form is known."""

import math

import numpy as np
import pytest

import swarm
from swarm.placing.closed_form import closed_form

TURN = {"axis": (1.0, 2.0, 3.0), "angle": 0.7}
OUTLINE = [(0.0, 0.0), (0.6, -0.1), (0.7, 0.5), (0.3, 0.2)]
CORNERS = np.array([(0.0, 0.0, 0.0), (0.9, 0.1, 0.0), (0.1, 0.8, 0.0), (0.2, 0.1, 0.7)])
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
MIDDLE = (0.1, -0.05, 0.08)
SPACE = {
    "sphere": swarm.Sphere(0.5, MIDDLE),
    "ellipsoid": swarm.Ellipsoid((0.3, 0.4, 0.6), MIDDLE, rotation=TURN),
    "box": swarm.Box((0.3, 0.4, 0.5), MIDDLE, rotation=TURN),
    "cylinder": swarm.Cylinder(0.3, axis=(1.0, 2.0, 0.5), length=0.7, center=MIDDLE),
    "capsule": swarm.Capsule(0.3, 0.4, axis=(1.0, 1.0, 0.5), center=MIDDLE),
    "torus": swarm.Torus(0.5, 0.2, MIDDLE, rotation=TURN),
    "prism": swarm.Prism(OUTLINE, 0.6, center=MIDDLE, rotation=TURN),
    "tetrahedron": swarm.Mesh(CORNERS, FACES),
}
FLAT = {
    "circle": swarm.Sphere(0.5, (0.1, -0.05, 0.0)),
    "ellipse": swarm.Ellipsoid((0.3, 0.4, 0.6), rotation={"axis": (0.0, 0.0, 1.0), "angle": 0.7}),
    "lying ellipse": swarm.Ellipsoid((0.3, 0.4, 0.6), rotation={"axis": (0.0, 1.0, 0.0), "angle": 0.5 * math.pi}),
    "rectangle": swarm.Box((0.3, 0.4, 0.5), MIDDLE, rotation={"axis": (0.0, 0.0, 1.0), "angle": 0.7}),
    "cylinder": swarm.Cylinder(0.3, length=0.7, center=MIDDLE),
    "endless cylinder": swarm.Cylinder(0.3, center=MIDDLE),
    "lying cylinder": swarm.Cylinder(0.3, axis=(1.0, 1.0, 0.0), length=0.7),
    "lying capsule": swarm.Capsule(0.3, 0.4, axis=(1.0, 1.0, 0.0)),
    "capsule": swarm.Capsule(0.3, 0.4),
    "ring": swarm.Torus(0.5, 0.2),
    "two discs": swarm.Torus(0.5, 0.2, rotation={"axis": (1.0, 0.0, 0.0), "angle": 0.5 * math.pi}),
    "stadium": swarm.Stadium(0.3, 0.5),
    "polygon": swarm.Polygon(OUTLINE),
    "prism": swarm.Prism(OUTLINE, 0.6, center=MIDDLE),
}  # fmt: skip
BALL = swarm.Sphere(0.1, (0.2, 0.0, 0.0), side="outside")
ROD = swarm.Cylinder(0.05, length=0.1, center=(-0.2, 0.0, 0.0), side="outside")
NEAR = swarm.Sphere(0.1, side="outside")


def counted(scene, n):
    """The share of the midpoints of a fine grid that are admissible, times the box."""
    low, high = (np.array(corner)[scene.axes()] for corner in scene.bounds())
    wide = (high - low) / n
    lines = [a + h * (np.arange(n) + 0.5) for a, h in zip(low, wide, strict=True)]
    points = np.zeros((3, n ** len(lines)))
    points[scene.axes()] = [row.ravel() for row in np.meshgrid(*lines, indexing="ij")]
    return scene.admits(points).sum() * wide.prod()


@pytest.mark.parametrize("surface", SPACE.values(), ids=SPACE)
def test_a_volume_is_that_of_a_fine_grid(surface):
    scene = swarm.Scene([surface])
    assert closed_form(scene) == pytest.approx(counted(scene, 70), rel=4e-3)
    start = swarm.fill(scene, 2, speed=1.0)
    assert (start.volume, start.volume_error) == (closed_form(scene), 0.0)


@pytest.mark.parametrize("surface", FLAT.values(), ids=FLAT)
def test_an_area_is_that_of_a_fine_grid(surface):
    scene = swarm.Scene([surface], plane="z")
    assert closed_form(scene) == pytest.approx(counted(scene, 500), rel=2e-3)


@pytest.mark.parametrize(
    ("surfaces", "given"),
    [
        ([swarm.Sphere(0.5), BALL, ROD], {}),
        ([swarm.Box((0.5, 0.3, 0.3)), BALL, ROD], {}),
        ([BALL, ROD], {"period": (1.0, 1.0, 1.0)}),
        ([swarm.Cylinder(0.5), swarm.Cylinder(0.1, side="outside")], {"plane": "z"}),
    ],
    ids=["sphere", "box", "cell", "circle"],
)
def test_solids_within_are_taken_off(surfaces, given):
    scene = swarm.Scene(surfaces, **given)
    assert closed_form(scene) == pytest.approx(counted(scene, 500 if given.get("plane") else 70), rel=4e-3)


@pytest.mark.parametrize(
    ("surfaces", "given"),
    [
        ([swarm.Sphere(0.5), swarm.Plane((0.0, 0.0, 1.0), 0.4)], {}),
        ([swarm.Sphere(0.5), swarm.Sphere(0.3, (0.3, 0.0, 0.0), side="outside")], {}),
        ([swarm.Sphere(0.5), BALL, swarm.Sphere(0.15, (0.3, 0.0, 0.0), side="outside")], {}),
        ([NEAR, swarm.Sphere(0.1, (0.95, 0.0, 0.0), side="outside")], {"period": (1.0, 1.0, 1.0)}),
        ([swarm.Torus(0.5, 0.2), swarm.Sphere(0.3, side="outside")], {}),
        ([swarm.Stadium(0.4, 0.3), swarm.Cylinder(0.1, side="outside")], {"plane": "z"}),
        ([swarm.Sphere(0.5), swarm.Sphere(0.1, side="outside", motion=swarm.Translation((1.0, 0.0, 0.0)))], {}),
        ([swarm.Union([swarm.Sphere(0.5), swarm.Sphere(0.5, (0.3, 0.0, 0.0))])], {}),
    ],
    ids=["cut", "reaches out", "overlap", "images overlap", "not convex", "an outline", "moves", "union"],
)  # fmt: skip
def test_where_it_is_not_certain_the_volume_is_estimated(surfaces, given):
    scene = swarm.Scene(surfaces, **given)
    assert closed_form(scene) is None
    start = swarm.fill(scene, 2, speed=1.0)
    assert 0.0 < start.volume_error < 0.01 * start.volume


def test_the_standard_error_is_that_of_many_estimates():
    scene = swarm.Scene([swarm.Sphere(0.5), swarm.Plane((0.0, 0.0, 1.0), 0.0)])
    found = [swarm.fill(scene, 1, speed=1.0, seed=seed) for seed in range(20)]
    volumes = np.array([one.volume for one in found])
    assert volumes.std() == pytest.approx(found[0].volume_error, rel=0.5)
    assert abs(volumes.mean() - math.pi / 12.0) < 4.0 * found[0].volume_error / math.sqrt(20)


def test_a_volume_that_is_set_has_no_error():
    particles = swarm.Particles((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert particles.volume_error is None
    particles.volume = 2.0
    assert (particles.volume, particles.volume_error) == (2.0, None)
