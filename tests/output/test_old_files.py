"""Checkpoints that commit 3057132 wrote: runs of today go on from them with the same bits, or name the version."""

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
