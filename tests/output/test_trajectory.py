"""The HDF5 file: its layout, what comes back from it, and what happens when it cannot be written."""

import subprocess
import sys

import h5py
import numpy as np
import pytest

import swarm

SCENE = swarm.Scene(
    surfaces=[swarm.Ellipsoid((0.3, 0.3, 0.6)), swarm.Sphere(0.1, (0.0, 0.0, 0.1), "outside")],
    gravity=(0.0, 0.0, -1.0),
)
METHOD = swarm.Penalty(dt=0.01, penalty=1e4, exponent=1.5)


@pytest.fixture
def run(tmp_path):
    particles = swarm.fill(SCENE, 30, speed=0.3, mass=np.linspace(1.0, 2.0, 30), seed=4)
    path = tmp_path / "run.h5"
    return path, particles, swarm.simulate(SCENE, particles, METHOD, until=0.5, every=0.2, trajectory=path)


def test_everything_comes_back(run):
    path, particles, result = run
    with swarm.load(path) as trajectory:
        assert len(trajectory) == 4
        np.testing.assert_array_equal(trajectory.times, [0.0, 0.2, 0.4, 0.5])
        assert trajectory.scene == SCENE
        assert trajectory.method == METHOD
        assert trajectory.scene_text is None
        np.testing.assert_array_equal(trajectory.frame(0).position, particles.position)
        np.testing.assert_array_equal(trajectory.frame(-1).position, result.particles.position)
        np.testing.assert_array_equal(trajectory.frame(3).velocity, result.particles.velocity)
        np.testing.assert_array_equal(trajectory.frame(1).mass, particles.mass)
        assert trajectory.observables.keys() == result.observables.keys()
        for name, values in result.observables.items():
            np.testing.assert_array_equal(trajectory.observables[name], values)
        with pytest.raises(swarm.SceneError, match=r"frame must lie between -4 and 3, got 4"):
            trajectory.frame(4)


def test_layout_is_h5md(run):
    """H5MD 1.1: version, creator, box without edges, and step, time, value of one length in every element."""
    path, _, _ = run
    with h5py.File(path) as file:
        assert file["h5md"].attrs["version"].tolist() == [1, 1]
        assert file["h5md/creator"].attrs["name"] == "swarm"
        box = file["particles/all/box"]
        assert box.attrs["dimension"] == 3
        assert list(box.attrs["boundary"]) == ["none"] * 3
        assert "edges" not in box
        elements = [file["particles/all/position"], file["particles/all/velocity"], *file["observables"].values()]
        for element in elements:
            assert {"step", "time", "value"} == set(element)
            assert element["value"].shape[0] == element["step"].shape[0] == element["time"].shape[0] == 4
        assert file["particles/all/position/value"].shape == (4, 30, 3)
        assert not file["particles/all/position/value"].attrs


def test_a_file_being_written_can_be_read(tmp_path):
    """Every frame is flushed, so another process sees all frames so far."""
    path = tmp_path / "run.h5"
    seen = []

    def look(frame):
        if frame.number in (0, 3):
            code = f"import swarm; print(len(swarm.load({str(path)!r})))"
            seen.append(int(subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout))

    particles = swarm.fill(SCENE, 5, speed=0.3)
    swarm.simulate(SCENE, particles, METHOD, until=0.04, every=0.01, trajectory=path, progress=look)
    assert seen == [1, 4]


def test_refused_before_anything_is_touched(tmp_path):
    particles = swarm.fill(SCENE, 5, speed=0.3)
    present = tmp_path / "present.h5"
    present.write_bytes(b"mine")
    for path, message in (
        (present, r"present\.h5 exists.*--overwrite"),
        (tmp_path / "nowhere" / "run.h5", r"folder .*nowhere does not exist"),
        (tmp_path, r"expected a file name, got the folder"),
    ):
        with pytest.raises(swarm.SceneError, match=message):
            swarm.simulate(SCENE, particles, METHOD, until=0.1, trajectory=path)
    with pytest.raises(swarm.SceneError, match=r"^dt|until must be a whole number of steps"):
        swarm.simulate(SCENE, particles, METHOD, until=0.105, trajectory=present, overwrite=True)
    assert present.read_bytes() == b"mine"
    swarm.simulate(SCENE, particles, METHOD, until=0.1, trajectory=present, overwrite=True)
    with swarm.load(present) as trajectory:
        assert len(trajectory) == 2


def test_other_files_are_refused(tmp_path):
    text, other = tmp_path / "text.h5", tmp_path / "other.h5"
    text.write_text("no HDF5")
    with h5py.File(other, "w") as file:
        file["x"] = 1
    with pytest.raises(swarm.SceneError, match=r"cannot read the trajectory .*text\.h5"):
        swarm.load(text)
    with pytest.raises(swarm.SceneError, match=r"not a trajectory of swarm"):
        swarm.load(other)
    with pytest.raises(swarm.SceneError, match=r"cannot read the trajectory .*absent\.h5"):
        swarm.load(tmp_path / "absent.h5")
