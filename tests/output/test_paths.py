"""No output replaces a file that is not its own: inputs, other outputs, devices, links, the user's own files."""

import os
import signal
from pathlib import Path

import h5py
import pytest

import swarm
from swarm.files import paths

SPHERE = swarm.Scene([swarm.Sphere(0.5)])
START = swarm.fill(SPHERE, 3, speed=1.0, seed=1)


def run(path, **keywords):
    return swarm.simulate(SPHERE, START, swarm.Impact(), until=1.0, every=0.5, trajectory=path, threads=1, **keywords)


@pytest.mark.parametrize("name", ["trajectory", "recording"])
@pytest.mark.parametrize("value", [3, True, b"run.h5", "", "a\0b", ["run.h5"]])
def test_what_is_no_path(name, value):
    with pytest.raises(swarm.SceneError, match=rf"{name} must be the path of a file, got"):
        swarm.simulate(SPHERE, START, swarm.Impact(), until=1.0, **{name: value})


@pytest.mark.parametrize("name", ["a.npz", "a.XYZ", "a.b.csv"])
def test_a_name_of_another_format_is_refused(tmp_path, name):
    with pytest.raises(
        swarm.SceneError, match=r"trajectory: .* ends in \.h5, .* is HDF5; .*swarm export RUN\.h5 -o RUN\.csv"
    ):
        run(tmp_path / name)
    with pytest.raises(
        swarm.SceneError, match=r"impacts: .* ends in \.h5, .* is HDF5, which swarm\.load_impacts reads"
    ):
        run(None, impacts=tmp_path / name)
    assert os.listdir(tmp_path) == []
    run(tmp_path / "run.2")


@pytest.mark.parametrize("recording", ["run.h5", "./run.h5", "link.h5", "run.h5.checkpoint"])
def test_two_outputs_are_two_files(tmp_path, monkeypatch, recording):
    monkeypatch.chdir(tmp_path)
    Path("link.h5").symlink_to("run.h5")
    with pytest.raises(swarm.SceneError, match=r"recording: .* is also the (trajectory|checkpoint)"):
        run("run.h5", recording=recording, overwrite=True)
    assert sorted(os.listdir()) == ["link.h5"]


def test_a_hard_link_is_the_same_file(tmp_path):
    (tmp_path / "a").touch()
    os.link(tmp_path / "a", tmp_path / "b")
    with pytest.raises(swarm.SceneError, match=r"picture: .*b is also the trajectory"):
        paths.check_distinct({"picture": tmp_path / "b"}, {"trajectory": tmp_path / "a"})
    paths.check_distinct({"picture": tmp_path / "c", "nothing": None}, {"trajectory": tmp_path / "a"})


def test_a_device_or_a_pipe_stays_what_it_is(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in ("/dev/null", tmp_path / "pipe"):
        with pytest.raises(swarm.SceneError, match=r"trajectory: expected a file name, got .*a device or a pipe"):
            run(path, overwrite=True)
        assert not os.path.isfile(path)


def test_a_symbolic_link_is_followed(tmp_path):
    (tmp_path / "disk").mkdir()
    link = tmp_path / "run.h5"
    link.symlink_to(tmp_path / "disk" / "stored.h5")  # of a file that is not there yet
    for overwrite in (False, True):
        run(link, overwrite=overwrite)
        assert link.is_symlink()
        assert h5py.is_hdf5(tmp_path / "disk" / "stored.h5")
    assert os.listdir(tmp_path / "disk") == ["stored.h5"]


@pytest.mark.parametrize("end", [".part", ".lock"])
def test_files_of_the_users_own_beside_it_are_left_alone(tmp_path, end):
    (tmp_path / f"run.h5{end}").write_text("mine")
    run(tmp_path / "run.h5")
    run(tmp_path / "run.h5", overwrite=True)
    assert (tmp_path / f"run.h5{end}").read_text() == "mine"
    assert sorted(os.listdir(tmp_path)) == ["run.h5", f"run.h5{end}"]


@pytest.mark.parametrize("keywords", [{}, {"resume": True}, {"checkpoint": 60.0}])
def test_a_file_of_the_users_own_in_the_checkpoints_place_is_refused(tmp_path, keywords):
    path = tmp_path / "run.h5.checkpoint"
    for content in ("mine", ""):
        path.write_text(content)
        with pytest.raises(swarm.SceneError, match=r"run\.h5\.checkpoint"):
            run(tmp_path / "run.h5", **keywords)
        assert path.read_text() == content
    assert os.listdir(tmp_path) == ["run.h5.checkpoint"]


def test_a_second_run_says_how_to_resume(tmp_path):
    """One that is complete is overwritten; one that was stopped is resumed."""
    path = tmp_path / "run.h5"

    def stop(frame):
        if frame.number == 1:
            signal.raise_signal(signal.SIGTERM)

    run(path, compile="never")
    with pytest.raises(swarm.SceneError, match=r"run\.h5 exists; .*overwrite it \(--overwrite, overwrite=True\)$"):
        run(path, compile="never")
    with pytest.raises(KeyboardInterrupt):
        run(path, compile="never", overwrite=True, checkpoint=60.0, progress=stop)
    assert paths.checkpoint_of(path).exists()
    with pytest.raises(swarm.SceneError, match=r"run\.h5 exists; .*, or go on with it, .*\(--resume, resume=True\)$"):
        run(path, compile="never")
