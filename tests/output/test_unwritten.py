"""What cannot be written is a sentence, and what is killed while it writes leaves the older file."""

import os
import signal

import pytest
from children import python
from scene_texts import in_a_sphere

import swarm
from swarm.pictures import plots
from swarm.recording import recorded
from swarm.recording import writer as recording


@pytest.fixture
def run(tmp_path):
    scene = swarm.Scene([swarm.Sphere(0.5)])
    start = swarm.fill(scene, 5, speed=1.0, seed=1)
    swarm.simulate(scene, start, swarm.Impact(), until=1.0, every=0.25, trajectory=tmp_path / "run.h5", compile="never")
    with swarm.load(tmp_path / "run.h5") as trajectory:
        yield trajectory


def test_a_picture_or_an_export_that_cannot_be_written_is_a_sentence(run, tmp_path):
    """For any user, also for root: until it is whole the file has a longer name, which the system does not take."""
    name = "a" * 245
    for write in (lambda path: plots.draw_plot(run, path.with_suffix(".png")), lambda path: run.export(f"{path}.xyz")):
        with pytest.raises(swarm.FileError, match=f"cannot write .*{name}.*: .*too long"):
            write(tmp_path / name)
    assert [one.name for one in tmp_path.iterdir()] == ["run.h5"]


def test_a_recording_where_nothing_may_be_written_is_a_sentence(run, tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(swarm.FileError, match=r"cannot write the recording .*run\.rrd: no permission"):
        recorded.record(run, tmp_path / "run.rrd", recording.Settings())
    assert capfd.readouterr() == ("", "")


def test_a_folder_that_cannot_be_made_is_a_sentence(tmp_path):
    (tmp_path / "sweep.toml").write_text(in_a_sphere("until = 1.0", 5, sweep='"particles.seed" = [1, 2]'))
    with pytest.raises(swarm.FileError, match=r"cannot make the folder .*sweep\.toml/runs: Not a directory"):
        swarm.sweep(tmp_path / "sweep.toml", tmp_path / "sweep.toml" / "runs")


KILLED = """
import os, signal, sys, swarm

def report(done, of):
    if done == 3:
        os.kill(os.getpid(), signal.SIGKILL)

with swarm.load(sys.argv[1]) as trajectory:
    trajectory.export(sys.argv[2], surfaces=False, overwrite=True, progress=report)
"""


@pytest.mark.parametrize("kind", ["xyz", "gsd", "vtkhdf"])
def test_a_kill_in_the_middle_of_an_export_leaves_the_old_file_and_the_next_one_tidies(run, tmp_path, kind):
    path = tmp_path / f"run.{kind}"
    run.export(path, frames=0, surfaces=False)
    older = path.read_bytes()
    done = python("-c", KILLED, run.path, path)
    assert done.returncode == -signal.SIGKILL
    assert path.read_bytes() == older
    run.export(path, surfaces=False, overwrite=True)
    assert path.stat().st_size > len(older)
    assert sorted(one.name for one in tmp_path.iterdir()) == sorted(["run.h5", path.name])
