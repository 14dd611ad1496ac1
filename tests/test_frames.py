"""The times of frames, whether they fit on the disk, and that a progress function cannot change them."""

import logging
import shutil
from collections import namedtuple

import numpy as np
import pytest
from same_bits import require_same_observables

import swarm
from swarm.common.frames import FrameTimes

SPHERE = swarm.Scene([swarm.Sphere(0.5)])
START = swarm.fill(SPHERE, 3, speed=1.0, seed=1)


@pytest.mark.parametrize(("until", "every"), [(1.0, None), (1.0, 0.1), (0.3, 0.1), (0.7, 0.1), (5.0, 2.0), (1e9, 1e-3)])
def test_the_count_is_that_of_the_times(until, every):
    times = FrameTimes(until, every)
    if times.count < 1000:
        found = list(times)
        assert [number for number, _before, _time in found] == list(range(times.count))
        assert [time for _number, _before, time in found[:-1]] == [before for _number, before, _time in found[1:]]
        assert found[-1][2] == until
    assert times.count == (2 if every is None else round(until / every + 0.499) + 1)


def test_endless_frames_are_refused_before_the_run_with_their_number_and_size(tmp_path):
    with pytest.raises(swarm.SceneError, match=r"every must leave frames .*1000000000001 frames, .* PB, and this mach"):
        swarm.simulate(SPHERE, START, swarm.Impact(), until=1.0, every=1e-12)
    # Times no iterator could walk through.
    with pytest.raises(
        swarm.SceneError, match=r"every must leave frames .* EB, and what is free in .* is .* make every"
    ):
        swarm.simulate(SPHERE, START, swarm.Impact(), until=1e300, every=1e-300, trajectory=tmp_path / "run.h5")
    # What is compressed may become small, but not its observables.
    with pytest.raises(
        swarm.SceneError, match=r"1000000000001 frames, at most .* TB, and what is free in .* make every"
    ):
        swarm.simulate(
            SPHERE, START, swarm.Impact(), until=1.0, every=1e-12, trajectory=tmp_path / "run.h5", compression="gzip"
        )
    assert list(tmp_path.iterdir()) == []


def test_frames_are_compared_with_the_disk_and_what_they_replace(tmp_path, monkeypatch, caplog):
    usage, path = namedtuple("Usage", "total used free"), tmp_path / "run.h5"
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: usage(0, 0, 50_000))
    run = {"until": 100.0, "every": 1.0, "trajectory": path, "overwrite": True}
    many = swarm.fill(SPHERE, 20, speed=1e-3, seed=1)
    with pytest.raises(swarm.SceneError, match=r"101 frames, 135 kB, and what is free in .* is 50 kB"):
        swarm.simulate(SPHERE, many, swarm.Impact(), **run)
    # Half of it, or no particles, fits; the size of compressed frames is unknown.
    for fits in ({"precision": "float32", "until": 50.0}, {"frames": "none"}, {"compression": "gzip"}):
        with caplog.at_level(logging.INFO, "swarm"):
            swarm.simulate(SPHERE, many, swarm.Impact(), **{**run, **fits})
    assert "the run has 101 frames, at most 135 kB" in caplog.text
    path.write_bytes(path.read_bytes().ljust(100_000))
    swarm.simulate(SPHERE, many, swarm.Impact(), **run)


def test_a_progress_function_changes_no_file(tmp_path):
    def spoil(frame):
        for name, value in frame.observables.items():
            if isinstance(value, np.ndarray):
                value[...] = 7.0
            frame.observables[name] = -1.0

    ends = []
    for name, progress in (("quiet", False), ("spoiled", spoil)):
        ends.append(
            swarm.simulate(
                SPHERE, START, swarm.Impact(), until=2.0, every=0.5, trajectory=tmp_path / name, progress=progress
            )
        )
    in_memory = swarm.simulate(SPHERE, START, swarm.Impact(), until=2.0, every=0.5, progress=spoil)
    for end in (ends[1], in_memory):
        require_same_observables(ends[0], end)
