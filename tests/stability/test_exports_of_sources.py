"""Random runs with sources x openings x absorbing walls x what is chosen: every export has the same particles in each
frame, those that are there, with those that have left or were absorbed where they were last.
"""

import io

import ase.io
import gsd.hoomd
import numpy as np
import pytest
import trimesh
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOHDF import vtkHDFReader

import swarm
from swarm.serialization.tables import scene_table

SEEDS = [0, 1, 2, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(3, 200))]
FRAMES = 6


def drawn(seed):
    """A scene, a start or none, its sources, and what is exported."""
    rng = np.random.default_rng(seed)
    valve = swarm.Sphere(0.2, center=(0.0, 0.0, 0.5))
    laws = [swarm.Absorb(0.3)] if rng.random() < 0.5 else []
    box = swarm.Box((0.5, 0.5, 0.5), openings=[valve] if rng.random() < 0.7 else [], laws=laws)
    scene = swarm.Scene([box], gravity=(0.0, 0.0, -1.0) if rng.random() < 0.5 else None)
    where = valve if box.openings and rng.random() < 0.6 else 0
    times = [
        {"times": np.sort(rng.uniform(0.0, 1.0, 7)).tolist()},
        {"rate": float(rng.uniform(5.0, 40.0)), "start": float(rng.uniform(0.0, 0.6))},
        {"count": 9, "start": 0.3, "stop": 0.9},
    ]
    sources = [swarm.Source(where, temperature=1.0, **times[k]) for k in rng.integers(3, size=rng.integers(1, 3))]
    start = swarm.fill(scene, int(rng.integers(1, 8)), speed=1.0, seed=seed) if rng.random() < 0.5 else None
    chosen = {
        "particles": int(rng.integers(1, 4)),
        "frames": [None, slice(1, None, 2), slice(None, None, -1)][seed % 3],
    }
    return scene, start, sources, chosen


def by_csv(paths):
    rows = np.genfromtxt(paths[0], delimiter=",", names=True, ndmin=1)
    for frame in dict.fromkeys(rows["frame"].tolist()):
        some = rows[rows["frame"] == frame]
        yield some["id"], np.stack([some[axis] for axis in "xyz"], axis=1)


def by_xyz(paths):
    # ASE reads no frame of no particle.
    lines = paths[0].read_text().splitlines(keepends=True)
    while lines:
        count = int(lines[0])
        part, lines = lines[: count + 2], lines[count + 2 :]
        if not count:
            yield np.zeros(0), np.zeros((0, 3))
            continue
        atoms = ase.io.read(io.StringIO("".join(part)), format="extxyz")
        yield atoms.arrays["id"], atoms.positions


def by_gsd(paths):
    with gsd.hoomd.open(str(paths[0])) as file:
        for frame in file:
            yield frame.log["particles/id"], frame.particles.position.reshape(-1, 3)


def by_ply(paths):
    for path in paths:
        held = trimesh.load(path, process=False).metadata["_ply_raw"]["vertex"]["data"]
        yield held["particle"], np.stack([held[axis] for axis in "xyz"], axis=-1).reshape(-1, 3)


def by_vtkhdf(paths):
    reader = vtkHDFReader()
    reader.SetFileName(str(paths[0]))
    reader.UpdateInformation()
    for step in range(reader.GetNumberOfSteps()):
        reader.SetStep(step)
        reader.Update()
        data = reader.GetOutput()
        count = data.GetNumberOfPoints()
        assert data.GetVerts().GetNumberOfCells() == count
        if not count:
            yield np.zeros(0), np.zeros((0, 3))
            continue
        np.testing.assert_array_equal(vtk_to_numpy(data.GetVerts().GetConnectivityArray()), np.arange(count))
        position = vtk_to_numpy(data.GetPoints().GetData())
        low, high = np.reshape(data.GetBounds(), (3, 2)).T
        np.testing.assert_allclose([low, high], [position.min(axis=0), position.max(axis=0)])
        yield vtk_to_numpy(data.GetPointData().GetArray("id")), position.copy()


READERS = {
    "csv": (by_csv, 0.0), "xyz": (by_xyz, 0.0), "vtkhdf": (by_vtkhdf, 0.0), "gsd": (by_gsd, 1e-6), "ply": (by_ply, 1e-6)
}  # fmt: skip


@pytest.mark.parametrize("seed", SEEDS)
def test_every_export_has_those_that_are_there(tmp_path, seed):
    scene, start, sources, chosen = drawn(seed)
    swarm.simulate(
        scene, start, swarm.Impact(), until=1.0, every=1.0 / (FRAMES - 1), sources=sources, seed=seed, compile="never",
        trajectory=tmp_path / "run.h5",
    )  # fmt: skip
    case = f"seed {seed}: {scene_table(scene, {})}, {sources}, {chosen}"
    with swarm.load(tmp_path / "run.h5") as trajectory:
        numbers = list(range(len(trajectory))[chosen["frames"] or slice(None)])
        numbers = numbers if (chosen["frames"] or slice(None)).step != -1 else numbers[::-1]
        expected = {}
        for k in numbers:
            frame, kept = trajectory.frame(k), np.arange(len(trajectory.ids)) % chosen["particles"] == 0
            there = kept & (trajectory.birth_time <= trajectory.times[k])
            assert len(frame.born()) == (trajectory.birth_time <= trajectory.times[k]).sum(), case
            expected[k] = trajectory.ids[there], frame.position.T[there]
        for form, (read, off) in READERS.items():
            paths = trajectory.export(tmp_path / f"out.{form}", surfaces=False, **chosen)
            some = [k for k in numbers if len(expected[k][0])] if form == "csv" else numbers
            found = list(read(paths))
            assert len(found) == len(some), (form, case)
            for k, (ids, position) in zip(some, found, strict=True):
                np.testing.assert_array_equal(ids, expected[k][0], f"{form}, frame {k}, {case}")
                np.testing.assert_allclose(position, expected[k][1], 0.0, off, f"{form}, frame {k}, {case}")
