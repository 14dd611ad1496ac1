"""Files that commit 3057132 wrote: they are read, and runs of today go on from them, or name the version."""

import gzip
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

import swarm

OLD = Path(__file__).parent.parent / "reference" / "3057132"
FALL, ROOM = (0.0, 0.0, -9.81), swarm.Box((0.5, 0.5, 0.5))
CASES = {
    "points": (swarm.Scene([swarm.Sphere(0.5)], (0.0, 0.0, -1.0)), {"n": 3}, swarm.Impact()),
    "sliding": (swarm.Scene([swarm.Box((0.5, 0.5, 0.5), restitution=0.5)], FALL), {"n": 3}, swarm.Impact()),
    "balls": (swarm.Scene([ROOM]), {"n": 4, "radius": 0.05}, swarm.Impact()),
    "grains": (
        swarm.Scene([swarm.Box((0.5, 0.5, 0.5), friction=0.3)], FALL), {"n": 4, "radius": 0.05},
        swarm.Penalty(1e-3, 1e4),
    ),
}  # fmt: skip


def run(name, path, **more):
    scene, filled, method = CASES[name]
    start = swarm.fill(scene, **filled, speed=1.0, seed=1)
    options = {"until": 0.4, "every": 0.1, "compile": "never", "seed": 1, **more}
    if name != "grains":
        options["impacts"] = path.with_name(f"{path.stem}-log.h5")
    return swarm.simulate(scene, start, method, trajectory=path, **options)


def stopped(name, path):
    """A run that was stopped behind frame 2, with the checkpoint of an old one."""

    def stop(frame):
        if frame.number == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(name, path, checkpoint=0.01, progress=stop)
    shutil.copy(OLD / f"{name}.h5.checkpoint", f"{path}.checkpoint")


@pytest.mark.parametrize("name", ["points", "sliding"])
def test_a_run_goes_on_from_an_old_checkpoint_with_the_same_bits(name, tmp_path):
    stopped(name, tmp_path / "run.h5")
    end = run(name, tmp_path / "run.h5", resume=True).particles
    whole = run(name, tmp_path / "whole.h5").particles
    np.testing.assert_array_equal(end.position, whole.position)
    np.testing.assert_array_equal(end.velocity, whole.velocity)


@pytest.mark.parametrize("name", ["balls", "grains"])
def test_an_old_checkpoint_with_other_arrays_names_the_version_and_stays(name, tmp_path):
    path = tmp_path / "run.h5"
    stopped(name, path)
    kept = {file: file.read_bytes() for file in tmp_path.iterdir()}
    with pytest.raises(
        swarm.SceneError, match=r"is of another version of swarm, or damaged: version 0\.1\.0, .*this is 0\.1\.0; exp"
    ):
        run(name, path, resume=True)
    assert {file: file.read_bytes() for file in tmp_path.iterdir()} == kept
    with swarm.load(path) as trajectory, h5py.File(path) as file:
        assert len(trajectory.times) == len(file["parameters/time"]) == 3


# --- Whole files -----------------------------------------------------------------------------------------

PISTON = swarm.Scene([ROOM, swarm.Plane((0, 0, 1), 0.2, motion=swarm.Guide((0, 0, 1)), mass=2.0)])
ROD = swarm.dumbbell(length=0.2, mass=1.0)
HOLE = swarm.Sphere(0.1, (0.0, 0.0, 0.5))
VESSEL = swarm.Scene([swarm.Sphere(0.5, openings=[HOLE], laws=[swarm.Lambert()])])
SOURCE = swarm.Source(VESSEL.surfaces[0], count=4, stop=0.4, speed=1.0)
BOX = swarm.Scene([ROOM], FALL)
FILES = {
    "piston": (PISTON, lambda: swarm.fill(PISTON, 3, speed=1.0, seed=1), swarm.Impact(), {}),
    "bodies": (BOX, lambda: swarm.place(BOX, ROD, 2, speed=1.0, spin=2.0, seed=1), swarm.Impact(dt=0.01), {}),
    "sources": (
        VESSEL, lambda: swarm.fill(VESSEL, 2, speed=1.0, seed=1), swarm.Impact(),
        {"sources": [SOURCE], "counters": [swarm.Sphere(0.2)]},
    ),
}  # fmt: skip


def unpacked(name, folder):
    """The trajectory of an old run that was stopped behind frame 2, with its checkpoint and its log."""
    for file in OLD.glob(f"{name}*"):
        if file.suffix == ".gz":
            (folder / file.stem).write_bytes(gzip.decompress(file.read_bytes()))
        else:
            shutil.copy(file, folder)
    return folder / f"{name}.h5"


def of_today(name, path, **more):
    scene, start, method, options = FILES[name]
    options = {"until": 0.4, "every": 0.1, "compile": "never", "seed": 1, **options, **more}
    if name == "sources":
        options["impacts"] = path.with_name(f"{name}-log.h5")
    return swarm.simulate(scene, start(), method, trajectory=path, **options)


@pytest.mark.parametrize("name", FILES)
def test_an_old_trajectory_is_read(name, tmp_path):
    """Particles of sources are born at other places today: those of the start alone are compared."""
    (tmp_path / "today").mkdir()
    path, scene = unpacked(name, tmp_path), FILES[name][0]
    of_today(name, tmp_path / "today" / path.name)
    some = slice(2) if name == "sources" else slice(None)
    with swarm.load(path) as old, swarm.load(tmp_path / "today" / path.name) as new:
        assert old.scene == scene
        assert old.times.tolist() == new.times[:3].tolist()
        for k in range(3):
            np.testing.assert_array_equal(old.frame(k).position[:, some], new.frame(k).position[:, some])
        assert (old.body is None) == (new.body is None)
    if name == "sources":
        with swarm.load_impacts(tmp_path / "sources-log.h5") as log:
            assert log.scene == scene
            assert len(log) > 0


@pytest.mark.parametrize("name", ["piston", "bodies"])
def test_an_old_run_goes_on(name, tmp_path):
    path = unpacked(name, tmp_path)
    end = of_today(name, path, resume=True).particles
    (tmp_path / "today").mkdir()
    whole = of_today(name, tmp_path / "today" / path.name).particles
    np.testing.assert_array_equal(end.position, whole.position)
    np.testing.assert_array_equal(end.velocity, whole.velocity)


def test_an_old_run_whose_particles_come_elsewhere_names_the_versions(tmp_path):
    path = unpacked("sources", tmp_path)
    with pytest.raises(swarm.SceneError, match=r"particles at the start .* swarm 0\.1\.0 wrote it, this is 0\.1\.0"):
        of_today("sources", path, resume=True)
