"""Every part of a union is drawn where it is a wall, with sharp edges, under its own name, and booked by itself."""

import math

import h5py
import numba
import numpy as np
import pytest

import swarm
from swarm.triangles.shapes import shapes_of

NOWHERE = np.zeros((3, 1))
BOX, BALL = swarm.Box((0.5, 0.5, 0.5)), swarm.Sphere(0.5)
LENS = swarm.Intersection([BALL, swarm.Sphere(0.5, (0.6, 0.0, 0.0))])
# A cap of the two balls is 0.2 high.
CAP = 2.0 * math.pi * 0.5 * 0.2
TUBE = 2.0 * math.pi * 0.01

# Surfaces, and the name and the area of every part.
SCENES = {
    "balls": (
        [swarm.Union([BALL, swarm.Sphere(0.5, (0.6, 0.0, 0.0))])],
        {"0_union_0_sphere": math.pi - CAP, "0_union_1_sphere": math.pi - CAP},
    ),
    "a lens": ([LENS], {"0_intersection_0_sphere": CAP, "0_intersection_1_sphere": CAP}),
    "a lens out of a ball": (
        [swarm.Intersection([swarm.Sphere(2.0), swarm.Intersection(LENS.parts, side="outside")])],
        {
            "0_intersection_0_sphere": 16.0 * math.pi,
            "0_intersection_1_0_sphere": CAP,
            "0_intersection_1_1_sphere": CAP,
        },
    ),
    "boxes with faces in one plane": (
        [swarm.Union([BOX, swarm.Box((0.5, 0.5, 0.5), (0.7, 0.0, 0.0))])],
        {"0_union_0_box": 5.0, "0_union_1_box": 3.8},
    ),
    "boxes with a common face, which are one room": (
        [swarm.Union([BOX, swarm.Box((0.5, 0.5, 0.5), (1.0, 0.0, 0.0))])],
        {"0_union_0_box": 5.0, "0_union_1_box": 5.0},
    ),
    "boxes with a part of a face in common": (
        [swarm.Union([BOX, swarm.Intersection([swarm.Box((0.5, 0.5, 0.5), (1.0, 0.5, 0.0))])])],
        {"0_union_0_box": 5.5, "0_union_1_0_box": 5.5},
    ),
    "a ball in a box around it, which it fills": (
        [swarm.Union([BALL, swarm.Intersection([swarm.Box((1.0, 1.0, 1.0)), swarm.Sphere(0.5, side="outside")])])],
        {"0_union_0_sphere": 0.0, "0_union_1_0_box": 24.0, "0_union_1_1_sphere": 0.0},
    ),
    "a slanted tube of 2 %": (
        [swarm.Union([BOX, swarm.Cylinder(0.01, (1.0, 1.0, 1.0), 4.0), swarm.Box((0.2, 0.2, 0.2), (1.0, 1.0, 1.0))])],
        # Of a tube through corners more is within than of one through faces.
        {"0_union_0_box": 6.0, "0_union_1_cylinder": None, "0_union_2_box": 0.96},
    ),
    "a straight tube of 2 %": (
        [swarm.Union([BOX, swarm.Cylinder(0.01, (1.0, 0.0, 0.0), 1.0, (0.9, 0.0, 0.0))])],
        {"0_union_0_box": 6.0 - math.pi * 1e-4, "0_union_1_cylinder": 0.9 * TUBE + math.pi * 1e-4},
    ),
    "a bent tube of 2 %": (
        [swarm.Union([swarm.Torus(0.5, 0.01), swarm.Sphere(0.05, (0.5, 0.0, 0.0))])],
        {"0_union_0_torus": TUBE * math.pi - TUBE * 0.1, "0_union_1_sphere": math.pi * (0.01 - 2e-4)},
    ),
    "a solid of two, at a wall": (
        [
            swarm.Box((1.0, 1.0, 1.0)),
            swarm.Union([swarm.Box((0.5, 0.5, 0.5), (0.5, 0.0, 0.0)), swarm.Sphere(0.2, (0.0, 0.0, 0.0))], "outside"),
        ],
        {"0_box": 23.0, "1_union_0_box": 5.0 - math.pi * 0.04, "1_union_1_sphere": 0.08 * math.pi},
    ),
    "a room with an opening": (
        [swarm.Union([swarm.Box((0.5, 0.5, 0.5), openings=[swarm.Sphere(0.1, (0.0, 0.0, 0.5))]), LENS])],
        {"0_union_0_box": None, "0_union_1_0_sphere": None, "0_union_1_1_sphere": None},
    ),
}


def test_a_doorway_is_open_in_both_walls():
    """A door in the wall between two rooms that touch; one that is shut, and one of a wall with nothing behind."""
    hole = swarm.Cylinder(0.1, (1.0, 0.0, 0.0), 0.2, (0.5, 0.0, 0.0))
    for times, area in ((None, math.pi * 0.01), ([(0.0, 1.0)], math.pi * 0.01), ([(1.0, 2.0)], 0.0)):
        first = swarm.Box((0.5, 0.5, 0.5), openings=[swarm.Opening(hole, times)])
        scene = swarm.Scene([swarm.Union([first, swarm.Box((0.5, 0.5, 0.5), (1.0, 0.0, 0.0))])])
        assert [shape.area() for shape in shapes_of(scene, NOWHERE)] == pytest.approx(2 * [6.0 - area], rel=1e-3)
    low = swarm.Opening(swarm.Box((0.1, 0.1, 0.1), (0.5, 0.0, -0.5)), between=True)
    rooms = swarm.Union([swarm.Box((0.5, 0.5, 0.5), openings=[low]), swarm.Box((0.5, 0.5, 0.5), (1.0, 0.0, 0.0))])
    shapes = shapes_of(swarm.Scene([rooms]), NOWHERE)
    # The door reaches through the floor, which stays.
    assert [shape.area() for shape in shapes] == pytest.approx(2 * [5.98], rel=1e-3)


def normals_of(shape):
    a, b, c = (shape.vertices[shape.triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    size = np.sqrt((normal**2).sum(axis=1))
    large = size > 1e-9
    return (a + b + c)[large].T / 3.0, (normal[large] / size[large, None]).T


@pytest.mark.parametrize("name", SCENES)
def test_each_part_is_drawn_where_it_is_a_wall(name):
    surfaces, areas = SCENES[name]
    scene = swarm.Scene(surfaces)
    shapes = shapes_of(scene, NOWHERE)
    assert [shape.name for shape in shapes] == list(areas)
    for shape in shapes:
        if areas[shape.name] is not None:
            assert shape.area() == pytest.approx(areas[shape.name], rel=0.01), shape.name
        if not len(shape.vertices):
            continue
        # On the boundary of the whole: also the wires, which are within other parts nowhere.
        for points in (shape.vertices, *shape.wires):
            assert np.abs(scene.gaps(points.T).max(axis=0)).max() < 1e-3 * np.ptp(shape.vertices), shape.name
        # Triangles and normals point into the volume.
        middle, normal = normals_of(shape)
        assert np.median(scene.gaps(middle + 1e-3 * normal).max(axis=0)) < 0.0
        given = shape.normals[shape.triangles].mean(axis=1)
        assert shape.triangles.shape[0] == len(given)
        assert np.median(scene.gaps(shape.vertices.T + 1e-3 * shape.normals.T).max(axis=0)) < 0.0


def test_edges_are_sharp():
    """Two cylinders meet in ellipses, whose points are on both."""
    across = swarm.Cylinder(0.2, (1.0, 0.0, 0.0), 2.0)
    along = swarm.Cylinder(0.2, (0.0, 0.0, 1.0), 2.0)
    shapes = shapes_of(swarm.Scene([swarm.Union([along, across])]), NOWHERE)
    for shape, other in zip(shapes, (across, along), strict=True):
        on_both = [np.abs(other.phi(curve.T)).max() < 1e-4 for curve in shape.wires]
        length = sum(
            np.sqrt((np.diff(curve, axis=0) ** 2).sum(axis=1)).sum()
            for curve, is_edge in zip(shape.wires, on_both, strict=True) if is_edge
        )  # fmt: skip
        # Two ellipses with semi-axes 0.2 and 0.2 sqrt(2)
        assert length == pytest.approx(2.0 * 1.52823, rel=0.03)


def test_a_part_that_moves_is_cut_where_it_is():
    piston = swarm.Box((0.5, 0.5, 0.5), (1.0, 0.0, 0.0), motion=swarm.Translation((1.0, 0.0, 0.0)))
    scene = swarm.Scene([swarm.Union([BOX, swarm.Cylinder(0.1, (1.0, 0.0, 0.0), 4.0), piston])])
    for time, length in ((0.0, 0.0), (0.25, 0.25), (0.5, 0.5)):
        box, tube, _moving = shapes_of(scene, NOWHERE, time)
        within = (tube.vertices[tube.triangles].mean(axis=1)[:, 0] > 0.5) & (
            tube.vertices[tube.triangles].mean(axis=1)[:, 0] < 0.5 + time
        )
        a, b, c = (tube.vertices[tube.triangles[within]][:, k] for k in range(3))
        area = 0.5 * np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1)).sum()
        assert area == pytest.approx(2.0 * math.pi * 0.1 * length, rel=0.02, abs=1e-6)
        # Where the rooms touch there is a wall between them, but for the tube.
        assert box.area() == pytest.approx(6.0 - 2.0 * math.pi * 0.01, rel=0.01)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Two chambers of two temperatures and a tube between them: [0, 1] of the union are a room, 2 is in none."""
    walls = swarm.Union(
        [
            swarm.Box((0.5, 0.5, 0.5), temperature=1.0),
            swarm.Cylinder(0.1, (1.0, 0.0, 0.0), 1.0, (0.8, 0.0, 0.0)),
            swarm.Union([swarm.Box((0.3, 0.3, 0.3), (1.5, 0.0, 0.0))], temperature=2.0),
        ]
    )
    scene = swarm.Scene([walls, swarm.Sphere(0.1, side="outside")])
    start = swarm.fill(scene, 300, speed=1.0, seed=1)
    path = tmp_path_factory.mktemp("run") / "run.h5"
    return swarm.simulate(
        scene, start, swarm.Impact(), until=0.5, every=0.1, trajectory=path, impacts=path.with_suffix(".i.h5"),
        recording=path.with_suffix(".rrd"),
    )  # fmt: skip


def test_parts_are_booked_by_themselves(run):
    seen = run.observables
    assert seen["part_impulse"].shape == seen["part_heat"].shape == (6, 3)
    np.testing.assert_allclose(seen["part_impulse"].sum(axis=1), seen["impulse"][:, 0], rtol=1e-12)
    np.testing.assert_allclose(seen["part_heat"].sum(axis=1), seen["wall_heat"][:, 0], rtol=1e-12)
    assert (seen["part_impulse"][-1] > 0.0).all()
    assert seen["part_heat"][-1, 1] == 0.0
    log = swarm.load_impacts(run.trajectory.with_suffix(".i.h5")).table()
    assert set(log["member"][log["surface"] == 1]) == {-1}
    by_part = np.bincount(log["member"][log["surface"] == 0], log["impulse"][log["surface"] == 0], 3)
    np.testing.assert_allclose(by_part, seen["part_impulse"][-1], rtol=1e-9)


def test_parts_in_files_and_pictures(run, tmp_path):
    names = ["0_union_0_box", "0_union_1_cylinder", "0_union_2_0_box"]
    with swarm.load(run.trajectory) as trajectory:
        assert trajectory.to_xarray().part_impulse.sizes == {"time": 6, "part": 3}
        assert trajectory.to_xarray().part.values.tolist() == names
        assert "part_impulse_2" in trajectory.table()
        written = trajectory.export(tmp_path / "run.vtkhdf")
        trajectory.animate(tmp_path / "run.gif", frames=2, size=(200, 200))
        figure = trajectory.plot()
    with h5py.File(written[1]) as file:
        cells = file["VTKHDF/CellData"]
        assert set(cells["surface"][()]) == {0, 1}
        assert set(cells["part"][()]) == {-1, 0, 1, 2}
        assert ((cells["part"][()] == -1) == (cells["surface"][()] == 1)).all()
    pressure = next(axes for axes in figure.axes if axes.get_title() == "Pressure on the walls")
    assert [line.get_label() for line in pressure.get_lines()] == ["box 1", "cylinder", "box 2", "ball"]
    heat = next(axes for axes in figure.axes if axes.get_title() == "Heat from walls")
    assert [line.get_label() for line in heat.get_lines()] == ["box 1", "box 2"]


L = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]
OUTLINES = {
    "a prism": ([swarm.Prism(L, height=1.0)], {"0_prism": 14.0}),
    "a prism with an arc, on its side": (
        [swarm.Prism([(0.0, 0.0), (1.0, 0.0, 1.0), (1.0, 1.0), (0.0, 1.0)], height=0.5, axis=(1.0, 1.0, 0.0))],
        {"0_prism": (3.0 + 0.5 * math.pi) * 0.5 + 2.0 + 0.25 * math.pi},
    ),
    "a stadium between planes": (
        [swarm.Stadium(1.0, 2.0), swarm.Box((3.0, 3.0, 0.5))],
        {"0_stadium": 4.0 + 2.0 * math.pi, "1_box": 2.0 * (4.0 + math.pi)},
    ),
    "a post through a box": (
        [swarm.Polygon([(0.0, 0.0), (0.3, 0.0), (0.0, 0.4)], side="outside"), BOX],
        {"0_polygon": 1.2, "1_box": 6.0 - 0.12},
    ),
}


@pytest.mark.parametrize("name", OUTLINES)
def test_walls_on_an_outline_are_drawn_with_their_edges(name):
    surfaces, areas = OUTLINES[name]
    scene = swarm.Scene(surfaces)
    shapes = shapes_of(scene, NOWHERE)
    assert {shape.name: pytest.approx(shape.area(), rel=2e-3) for shape in shapes} == areas
    for shape in shapes:
        middle, normal = normals_of(shape)
        assert np.median(scene.gaps(middle + 1e-3 * normal).max(axis=0)) < 0.0
        for points in (shape.vertices, *shape.wires):
            assert np.abs(scene.gaps(points.T).max(axis=0)).max() < 2e-3
    # The lines on the corners, from end to end.
    sides, corners = surfaces[0], surfaces[0].boundary.turns
    lines = [curve for curve in shapes[0].wires if len(curve) > 100 and np.ptp(sides.in_plane(curve.T)[:2]) < 2.1]
    upright = [curve for curve in lines if np.ptp(sides.in_plane(curve.T)[:2], axis=1).max() < 1e-9]
    assert len(upright) == np.count_nonzero(corners)


def test_parts_in_a_plane():
    """A mushroom: a cap of half a disc and a stem, of which the foot is in none."""
    cap = swarm.Intersection([swarm.Cylinder(1.0), swarm.Plane((0.0, -1.0, 0.0), 0.0)])
    stem = swarm.Intersection([swarm.Box((0.25, 0.5, 1.0), (0.0, -0.4, 0.0))])
    scene = swarm.Scene([swarm.Union([cap, stem]), swarm.Sphere(0.1, (0.5, 0.5, 0.0), "outside")], plane="z")
    shapes = shapes_of(scene, NOWHERE)
    lengths = {
        "0_union_0_0_cylinder": math.pi,
        "0_union_0_1_plane": 1.5,
        "0_union_1_0_box": 0.5 + 2.0 * 0.9,
        "1_sphere": 0.2 * math.pi,
    }
    assert {shape.name: pytest.approx(shape.area(), rel=1e-3) for shape in shapes} == lengths
    for shape in shapes:
        for curve in shape.wires:
            assert np.abs(scene.gaps(curve.T).max(axis=0)).max() < 1e-3


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set: minutes for phi")
def test_a_foam_is_drawn_where_its_balls_are_in_no_other():
    foam = swarm.Spheres([[0.0, 0.0, 0.0], [0.6, 0.0, 0.0]], 0.5, side="inside")
    (shape,) = shapes_of(swarm.Scene([foam]), NOWHERE)
    assert (shape.name, shape.solid) == ("0_spheres", False)
    assert shape.area() == pytest.approx(2.0 * (math.pi - CAP), rel=0.005)
    assert foam.phi((shape.vertices + 0.1 * shape.normals).T).max() < -0.05
    for points in (shape.vertices, *shape.wires):
        assert np.abs(foam.phi(points.T)).max() < 5e-3
    (flat,) = shapes_of(swarm.Scene([foam], plane="z"), NOWHERE)
    # Of each circle an arc is in the other, cos(angle) = 0.3/0.5.
    assert flat.area() == pytest.approx(2.0 * (math.pi - math.acos(0.6)), rel=0.05)
