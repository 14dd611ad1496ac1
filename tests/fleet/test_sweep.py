"""Sweeps as a whole, with real worker processes and real kills. In plain Python: nothing here depends on the tier."""

import itertools
import json
import signal
import sys
import threading
from types import SimpleNamespace

import numpy as np
import pandas as pd
import psutil
import pytest
from sweep_sessions import RUNNING, assert_the_same_table, until_there_is, write

import swarm
from swarm.files import paths
from swarm.fleet import results, sweeping
from swarm.fleet.sweeping import SweepOptions, carry_out_sweep


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A sweep of two keys, of which one value fails when its run begins."""
    folder = tmp_path_factory.mktemp("whole")
    sweep = '"particles.count" = [5, 1_000_000_000_000_000]\n"surface.0.center" = [[0, 0, 0], [0.1, 0, 0]]'
    path = write(folder / "sweep.toml", sweep, run='impacts = "log.h5"')
    return folder / "out", swarm.sweep(path, folder / "out", processes=2, threads=1), path


def test_the_frame_has_a_row_for_each_run(whole):
    folder, frame, _path = whole
    assert frame["particles.count"].tolist() == [5, 5, 10**15, 10**15]
    assert frame["surface.0.center"].tolist() == ["[0, 0, 0]", "[0.1, 0, 0]"] * 2
    assert frame["state"].tolist() == ["done", "done", "failed", "failed"]
    assert frame["error"].isna().tolist() == [True, True, False, False]
    assert frame["error"].str.contains("count").tolist()[2:] == [True, True]
    assert (frame["wall_time"] > 0.0).all()
    assert frame["impacts"].isna().tolist() == [False, False, True, True]
    pd.testing.assert_frame_equal(pd.read_csv(folder / "results.csv"), frame, check_dtype=False)


def test_a_run_is_an_ordinary_one(whole):
    folder, frame, _path = whole
    assert not list(folder.glob("*.checkpoint"))
    row = frame.iloc[1]
    with swarm.load(folder / row["file"]) as trajectory:
        seen = trajectory.observables
        assert "A run of sweep.toml" in trajectory.scene_text
        assert trajectory.scene.surfaces[0].center == (0.1, 0.0, 0.0)
        start = trajectory.frame(0)
        alone = swarm.simulate(trajectory.scene, start, swarm.Impact(), until=2.0, every=0.5, compile="never")
    for name in ("total_energy", "impacts", "sliding_time"):
        assert row[name] == seen[name][-1] == alone.observables[name][-1]
    for i, axis in enumerate("xyz"):
        assert row[f"momentum_{axis}"] == alone.observables["momentum"][-1, i]
    assert row["impulse_0"] == alone.observables["impulse"][-1, 0]
    stem = row["file"].removesuffix(".h5")
    with swarm.load_impacts(folder / f"{stem}.impacts.h5") as log:
        assert len(log.table()) == row["impacts"]
    status = json.loads((folder / f"{stem}.json").read_text())
    assert status["state"] == "done"
    assert status["parameters"] == {"particles.count": 5, "surface.0.center": [0.1, 0, 0]}


def test_a_folder_that_holds_runs_is_not_replaced(whole):
    folder, _frame, path = whole
    with pytest.raises(swarm.SceneError, match=r"--resume.*--overwrite"):
        swarm.sweep(path, folder)
    with pytest.raises(swarm.SceneError, match="contradict"):
        swarm.sweep(path, folder, resume=True, overwrite=True)
    with pytest.raises(swarm.SceneError, match="expected the name of a folder"):
        swarm.sweep(path, path)


def test_another_sweep_waits_for_no_folder(whole):
    folder, _frame, path = whole
    from swarm.files.lock import only_writer

    with only_writer(folder / "results.csv", "table"), pytest.raises(swarm.FileError, match="another run"):
        swarm.sweep(path, folder, resume=True)


def test_longer_lists_run_only_what_is_new(whole, tmp_path):
    """And what has failed; a complete trajectory without a status is a row; runs of the older file stay."""
    folder, frame, _path = whole
    sweep = '"particles.count" = [5, 6]\n"surface.0.center" = [[0, 0, 0], [0.1, 0, 0]]'
    path = write(tmp_path / "longer.toml", sweep, run='impacts = "log.h5"')
    kept = folder / frame["file"][0]
    (folder / frame["file"][1]).with_suffix(".json").unlink()
    before = [(folder / name).stat().st_mtime_ns for name in frame["file"][:2]]
    outcome = carry_out_sweep(path, SweepOptions(folder, 1, resume=True, table="parquet"))
    longer = outcome.results.frame()
    assert longer["state"].tolist() == ["done"] * 4
    assert longer["file"][:2].tolist() == frame["file"][:2].tolist()
    assert [(folder / name).stat().st_mtime_ns for name in frame["file"][:2]] == before
    same = frame.columns.difference(["wall_time", "error", "state"])
    pd.testing.assert_frame_equal(longer[same][:2], frame[same][:2], check_dtype=False)
    assert longer["wall_time"].isna().tolist() == [False, True, False, False]
    pd.testing.assert_frame_equal(pd.read_parquet(folder / "results.parquet"), longer, check_dtype=False)
    # Another file has none of these four.
    other = results.Results(results_plan(tmp_path), folder, "csv")
    assert kept.stem in other.others()
    assert len(other.others()) == 4


def results_plan(folder):
    from swarm.fleet.plan import read

    return read(write(folder / "other.toml", '"particles.seed" = [99]'))


def test_a_worker_that_dies_fails_its_run_alone(tmp_path):
    """From a thread, and from a script without `if __name__ == "__main__"`; the middle run would never end."""
    path = write(tmp_path / "sweep.toml", '"run.until" = [1.0, 1e8, 1.5]', run="frames = 1")
    path.write_text(path.read_text().replace("every = 0.5\n", ""))
    frames = []
    running = threading.Thread(target=lambda: frames.append(swarm.sweep(path, tmp_path / "out", processes=1)))
    running.start()
    # The first has ended, and the second has begun.
    until_there_is(lambda: list((tmp_path / "out").glob("[!.]*.json")))
    until_there_is(lambda: len(list((tmp_path / "out").glob("[!.]*.h5"))) == 2)
    for worker in psutil.Process().children():
        if "popen_loky" in " ".join(worker.cmdline()):
            worker.kill()
    running.join(RUNNING)
    (frame,) = frames
    assert frame["state"].tolist() == ["done", "failed", "done"]
    assert "SIGKILL" in frame["error"][1]


def test_killed_and_resumed_the_table_is_the_same(tmp_path):
    """Kills of the parent, which no worker survives, and Ctrl-C for all; tests/long has many."""
    kinds = (signal.SIGKILL, signal.SIGINT)
    assert_the_same_table(tmp_path, kinds, np.random.default_rng(1), longest=0.3, seeds=2)


def test_the_wall_time_ends_a_sweep(tmp_path, monkeypatch):
    """Also while its workers start: an hour is over when it is asked for the time again."""
    clock = itertools.chain([0.0], itertools.repeat(3600.0))
    monkeypatch.setattr(sweeping, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    path = write(tmp_path / "sweep.toml", '"run.until" = [1e7, 1e8]', run="frames = 1")
    path.write_text(path.read_text().replace("every = 0.5\n", ""))
    outcome = carry_out_sweep(path, SweepOptions(tmp_path / "out", 1, walltime=3600.0))
    assert outcome.stopped == "walltime"
    assert [row["state"] for row in outcome.results.rows()] == ["waiting", "waiting"]
    assert (tmp_path / "out" / "results.csv").exists()


def test_a_checkpoint_is_gone_on_with(tmp_path):
    """Also one that is damaged: that run begins anew."""
    path = write(tmp_path / "sweep.toml", '"particles.seed" = {range = 2}')
    whole = swarm.sweep(path, tmp_path / "out", processes=1)
    for file in whole["file"]:
        with swarm.load(tmp_path / "out" / file) as trajectory:
            scene, start, text = trajectory.scene, trajectory.frame(0), trajectory.scene_text

        def stop_at(frame):
            if frame.number == 2:
                signal.raise_signal(signal.SIGTERM)

        with pytest.raises(KeyboardInterrupt):
            swarm.simulate(
                scene, start, swarm.Impact(), until=2.0, every=0.5, trajectory=tmp_path / "out" / file,
                scene_text=text, checkpoint=60.0, overwrite=True, compile="never", progress=stop_at,
            )  # fmt: skip
        (tmp_path / "out" / file).with_suffix(".json").unlink()
    saved = paths.checkpoint_of(tmp_path / "out" / whole["file"][1])
    saved.write_bytes(saved.read_bytes()[:-100])
    again = swarm.sweep(path, tmp_path / "out", processes=1, resume=True)
    pd.testing.assert_frame_equal(again.drop(columns="wall_time"), whole.drop(columns="wall_time"))


def test_a_table_in_parquet_needs_its_packages(tmp_path, monkeypatch):
    path = write(tmp_path / "sweep.toml", '"particles.seed" = [1]')
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(swarm.SceneError, match="pyarrow"):
        swarm.sweep(path, tmp_path / "out", table="parquet")
    assert not (tmp_path / "out").exists()


def test_vectors_have_a_column_for_each_component():
    seen = {
        "time": np.array([0.0, 1.0]),
        "impacts": np.array([0, 7]),
        "momentum": np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]),
        "impulse": np.array([[0.0, 0.0, 0.0], [4.0, 5.0, 6.0]]),
        "wall_position": np.arange(6.0).reshape(2, 1, 3),
        "wall_orientation": np.arange(8.0).reshape(2, 1, 4),
    }
    assert results.final(seen) == {
        "time": 1.0, "impacts": 7, "momentum_x": 1.0, "momentum_y": 2.0, "momentum_z": 3.0, "impulse_0": 4.0,
        "impulse_1": 5.0, "impulse_2": 6.0, "wall_position_0_x": 3.0, "wall_position_0_y": 4.0,
        "wall_position_0_z": 5.0, "wall_orientation_0_w": 4.0, "wall_orientation_0_x": 5.0,
        "wall_orientation_0_y": 6.0, "wall_orientation_0_z": 7.0,
    }  # fmt: skip
    assert all(type(value) in (int, float) for value in results.final(seen).values())


@pytest.mark.parametrize(
    ("values", "written"),
    [
        ([1, 2**64 - 1], [1, 2**64 - 1]),
        ([1, 2**65], ["1", str(2**65)]),
        ([-1, 2**63], ["-1", str(2**63)]),
        ([1, 0.5, 10**23], [1.0, 0.5, 1e23]),
        ([True, 1], ["true", "1"]),
        (["a", 1], ['"a"', "1"]),
        ([[1.0], [2.0]], ["[1.0]", "[2.0]"]),
    ],
)
def test_a_column_of_any_values_is_of_one_type(values, written, tmp_path):
    """Else Parquet refuses the table when all runs are done."""
    variants = [SimpleNamespace(parameters={"key": value}, stem=f"{k}") for k, value in enumerate(values)]
    known = results.Results(SimpleNamespace(variants=variants), tmp_path, "parquet")
    assert [row["key"] for row in known.rows()] == written
    known.write()
    assert pd.read_parquet(known.path)["key"].tolist() == written
