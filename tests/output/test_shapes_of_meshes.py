"""A mesh is drawn and exported by its own triangles; its wires are its edges, and what others leave of it is cut."""

import math
import time

import h5py
import numba
import numpy as np
import pytest
from scipy.spatial import ConvexHull

import swarm
from swarm.triangles.shapes import shapes_of

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set: minutes for phi")

NOWHERE = np.full((3, 1), 0.5)
CORNERS = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
CUBE = ConvexHull(CORNERS).simplices


def ball(n):
    """A ball of n corners, evenly spread, with 2 n - 4 triangles."""
    i = np.arange(n) + 0.5
    polar, around = np.arccos(1.0 - 2.0 * i / n), math.pi * (1.0 + 5.0**0.5) * i
    points = np.stack([np.cos(around) * np.sin(polar), np.sin(around) * np.sin(polar), np.cos(polar)], axis=1)
    return points, ConvexHull(points).simplices


def test_a_cube_has_twelve_triangles_and_twelve_edges():
    mesh = swarm.Mesh(CORNERS, CUBE)
    (shape,) = shapes_of(swarm.Scene([mesh]), NOWHERE)
    assert (shape.name, shape.solid, len(shape.triangles)) == ("0_mesh", False, 12)
    assert shape.area() == pytest.approx(6.0)
    # Three at each corner, one for each face there, which is flat and not shaded around the edge.
    assert len(shape.vertices) == 24
    assert np.sort(np.abs(shape.normals), axis=1) == pytest.approx(np.tile([0.0, 0.0, 1.0], (24, 1)))
    assert mesh.phi((shape.vertices + 0.1 * shape.normals).T).max() == pytest.approx(0.0)
    assert mesh.phi((shape.vertices + 0.1 * shape.normals + 0.01 * (0.5 - shape.vertices)).T).max() < 0.0
    edges = [curve for curve in shape.wires if np.isin(curve, (0.0, 1.0)).all()]
    assert sum(np.sqrt((np.diff(edge, axis=0) ** 2).sum(axis=1)).sum() for edge in edges) == pytest.approx(12.0)
    (solid, _box) = shapes_of(swarm.Scene([swarm.Mesh(CORNERS, CUBE, side="outside"), swarm.Box((3, 3, 3))]), NOWHERE)
    assert solid.solid
    assert mesh.phi((solid.vertices + 0.1 * solid.normals).T).min() >= 0.1 - 1e-12


def test_what_another_surface_takes_away_is_cut():
    scene = swarm.Scene([swarm.Mesh(CORNERS, CUBE), swarm.Sphere(0.3, (1.0, 1.0, 1.0), "outside")])
    mesh, post = shapes_of(scene, NOWHERE)
    assert mesh.area() == pytest.approx(6.0 - 0.75 * math.pi * 0.09, rel=1e-3)
    assert post.area() == pytest.approx(0.5 * math.pi * 0.09, rel=1e-2)
    for points in (mesh.vertices, post.vertices, *mesh.wires, *post.wires):
        assert np.abs(scene.gaps(points.T).max(axis=0)).max() < 2e-3


def test_smooth_ones_are_smoothly_shaded():
    points, triangles = ball(2000)
    (shape,) = shapes_of(swarm.Scene([swarm.Mesh(points, triangles)]), NOWHERE)
    assert len(shape.vertices) == 2000
    assert ((shape.normals + shape.vertices) ** 2).sum(axis=1).max() < 0.01
    # No edges: it is seen by its levels.
    assert not shape.edges
    assert len(shape.levels) == 6
    assert all(np.ptp(level[:, 2]) < 1e-12 for level in shape.levels)


def test_many_triangles_are_drawn_in_a_second():
    scene = swarm.Scene([swarm.Mesh(*ball(50_002))])
    begin = time.process_time()
    (shape,) = shapes_of(scene, NOWHERE)
    assert time.process_time() - begin < 1.0
    assert len(shape.triangles) == 100_000


def test_in_files(tmp_path):
    scene = swarm.Scene([swarm.Mesh(CORNERS, CUBE)])
    start = swarm.fill(scene, 20, speed=1.0, seed=1)
    run = swarm.simulate(
        scene, start, swarm.Impact(), until=0.2, every=0.1, trajectory=tmp_path / "run.h5",
        recording=tmp_path / "run.rrd",
    )  # fmt: skip
    assert "12 triangles, volume 1 m³" in run._repr_html_()
    with swarm.load(run.trajectory) as trajectory:
        _points, walls = trajectory.export(tmp_path / "run.vtkhdf")
    with h5py.File(walls) as file:
        points, corners = file["VTKHDF/Points"][()], file["VTKHDF/Polygons/Connectivity"][()].reshape(-1, 3)
    found = {tuple(sorted(map(tuple, points[triangle].tolist()))) for triangle in corners}
    assert found == {tuple(sorted(map(tuple, CORNERS[triangle].tolist()))) for triangle in CUBE}
