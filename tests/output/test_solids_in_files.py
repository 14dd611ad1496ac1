"""Fields of many solids in recordings and .vtkhdf: a few numbers for each, no triangles, read by others."""

import warnings

import numpy as np
import pytest
from rerun.chunk import RrdReader
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOHDF import vtkHDFReader

import swarm
from swarm.recording import playback, recorded
from swarm.recording import writer as recording
from swarm.surfaces.rotation import matrices
from swarm.triangles import solids

RANDOM = np.random.default_rng(3)
N = 12
PLACES = RANDOM.uniform(-0.4, 0.4, (N, 3))
TURNS = RANDOM.normal(size=(N, 4))
AXES = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 1.0, 0.2], [0.0, 1.0, 0.0]] * (N // 4)
AROUND = swarm.Rotation((0, 0, 1), 2.0, (0.2, 0.0, 0.0))
FIELDS = {
    "spheres": swarm.Spheres(PLACES, np.linspace(0.02, 0.04, N)),
    "boxes": swarm.Boxes(PLACES, (0.02, 0.03, 0.04), rotations=TURNS),
    "ellipsoids": swarm.Ellipsoids(PLACES, (0.02, 0.03, 0.04), rotations=TURNS),
    "cylinders": swarm.Cylinders(PLACES, 0.02, axes=AXES, lengths=0.1),
    "capsules": swarm.Capsules(PLACES, 0.02, 0.1, axes=AXES),
    "moving": swarm.Boxes(PLACES, (0.02, 0.03, 0.04), rotations=TURNS, motion=AROUND),
}


@pytest.fixture(autouse=True)
def _few_are_many(monkeypatch):
    monkeypatch.setattr(solids, "MANY", 6)
    monkeypatch.setattr(recording.solids, "MANY", 6)


def run(folder, kind):
    scene = swarm.Scene([FIELDS[kind]])
    start = swarm.Particles([0.0, 0.0, 1.5], [0.1, 0.0, 0.3])
    swarm.simulate(
        scene, start, swarm.Impact(), until=0.2, every=0.1, compile="never", trajectory=folder / "run.h5"
    )  # fmt: skip
    return folder / "run.h5"


@pytest.mark.parametrize("kind", FIELDS)
@pytest.mark.parametrize("time", [0.0, 0.3])
def test_corners_of_the_axes_are_on_the_wall(kind, time):
    """The ends of the axes of each solid, from its centre by half of its extent, are on it at any time."""
    alone = swarm.Scene([FIELDS[kind]])
    (found,) = solids.solids_of(alone, time)
    assert len(found.centers) == N
    axes = matrices(found.turns)
    (at,) = alone.poses(time)
    for i in (0, 1, 2, 5, N - 1):
        ends = [found.centers[i] + sign * found.halves[i, k] * axes[i, :, k] for sign in (-1.0, 1.0) for k in range(3)]
        solid = FIELDS[kind].solids()[i]
        np.testing.assert_allclose(solid.phi(at.given(np.transpose(ends))), 0.0, atol=1e-13)


@pytest.mark.parametrize("kind", FIELDS)
def test_vtk_reads_solids_as_points(tmp_path, kind):
    with swarm.load(run(tmp_path, kind)) as trajectory:
        files = trajectory.export(tmp_path / "out.vtkhdf")
        scene, times = trajectory.scene, trajectory.times
    assert [path.name for path in files] == ["out.vtkhdf", "out.surfaces.vtkhdf", "out.solids.vtkhdf"]
    reader = vtkHDFReader()
    reader.SetFileName(str(files[2]))
    reader.UpdateInformation()
    steps = 3 if kind == "moving" else 1
    assert reader.GetNumberOfSteps() == steps
    for step in range(steps):
        reader.SetStep(step)
        reader.Update()
        data = reader.GetOutput()
        (expected,) = solids.solids_of(scene, times[step])
        np.testing.assert_array_equal(vtk_to_numpy(data.GetPoints().GetData()), expected.centers)
        points = data.GetPointData()
        held = {points.GetArrayName(k): vtk_to_numpy(points.GetArray(k)) for k in range(points.GetNumberOfArrays())}
        np.testing.assert_array_equal(held["halves"], expected.halves)
        np.testing.assert_array_equal(held["orientation"], expected.turns)
        assert set(held["surface"]) == {0}
        assert data.GetVerts().GetNumberOfCells() == N
        assert np.isnan(held["radius"]).all() == (kind in ("boxes", "moving", "ellipsoids"))


@pytest.mark.parametrize("moving", [False, True])
def test_solids_that_are_not_there_are_in_no_step(tmp_path, moving):
    """One field leaves when another one comes, and at last no field is left."""
    places = np.random.default_rng(3).uniform(-0.3, 0.3, (2, N + 7, 3))
    first = swarm.Spheres(places[0, :N], 1e-3, present=[(0.0, 0.15)])
    second = swarm.Boxes(places[1], (1e-3, 1e-3, 1e-3), present=[(0.15, 0.35)])
    gate = [swarm.Sphere(0.01, (0.45, 0.45, 0.45), side="outside", motion=swarm.Translation((0.1, 0.0, 0.0)))] * moving
    scene = swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), first, second, *gate])
    start = swarm.Particles([-0.45, -0.45, -0.45], [0.0, 0.0, 0.0])
    path = tmp_path / "run.h5"
    swarm.simulate(scene, start, swarm.Impact(), until=0.4, every=0.1, compile="never", trajectory=path)
    with swarm.load(path) as trajectory:
        files = trajectory.export(tmp_path / "out.vtkhdf")
        times = trajectory.times
    reader = vtkHDFReader()
    reader.SetFileName(str(files[2]))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == len(times)
    for step in (0, 1, 2, 3, 4, 2, 0):
        reader.SetStep(step)
        reader.Update()
        data = reader.GetOutput()
        expected = solids.solids_of(scene, times[step])
        count = sum(len(one.centers) for one in expected)
        assert count == [N, N, N + 7, N + 7, 0][step]
        assert data.GetNumberOfPoints() == data.GetVerts().GetNumberOfCells() == count
        if count:
            np.testing.assert_array_equal(vtk_to_numpy(data.GetPoints().GetData()), expected[0].centers)
            assert set(vtk_to_numpy(data.GetPointData().GetArray("surface"))) == {expected[0].surface}
            np.testing.assert_array_equal(vtk_to_numpy(data.GetPointData().GetArray("halves")), expected[0].halves)
            assert max(map(abs, data.GetBounds())) < 0.5


@pytest.mark.parametrize("kind", FIELDS)
def test_a_recording_has_no_triangle_of_them_and_its_sheet_shows_them(tmp_path, kind):
    with swarm.load(run(tmp_path, kind)) as trajectory:
        recorded.record(trajectory, tmp_path / "run.rrd", recording.Settings())
    name = "boxes" if kind == "moving" else kind
    columns = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for chunk in RrdReader(tmp_path / "run.rrd").stream().to_chunks():
            columns.setdefault(chunk.entity_path, set()).update(chunk.to_record_batch().schema.names)
    path = f"/scene/solids/0_{name}"
    assert f"{path}/mesh" not in columns
    made = {"spheres": "Points3D:radii", "boxes": "Boxes3D:half_sizes", "ellipsoids": "Ellipsoids3D:half_sizes",
            "cylinders": "Cylinders3D:lengths", "capsules": "Capsules3D:lengths"}  # fmt: skip
    assert made[name] in columns[f"{path}/bodies"]
    assert ("Transform3D:mat3x3" in columns.get(path, ())) == (kind == "moving")
    assert f"{path}/wires" in columns
    playback.Playback(tmp_path / "run.rrd")


def test_of_a_million_some_curves_are_drawn():
    many = swarm.Spheres(np.random.default_rng(3).uniform(-1.0, 1.0, (50_000, 3)), 0.001)
    (found,) = solids.solids_of(swarm.Scene([many]), 0.0)
    curves = solids.curves(found, 2000)
    assert len(curves) == 3 * 2000
    np.testing.assert_allclose(np.linalg.norm(curves[3] - many.centers[25], axis=1), 0.001)
