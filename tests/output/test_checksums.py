"""One flipped bit in a file is reported, with its dataset and frame, or changes no value that is read."""

import random
import re
import shutil
import signal

import numpy as np
import pytest
from conftest import edited

import swarm
from swarm.commands import summary
from swarm.files import checksums

VALVE = swarm.Sphere(0.3, center=(0.0, 0.0, 0.5))
SCENE = swarm.Scene([swarm.Sphere(0.5, openings=[VALVE])], gravity=(0.0, 0.0, -1.0))
N = 30
POSITION = "particles/all/position"


def simulate(folder, start=None, scene=SCENE, **keywords):
    start = swarm.fill(scene, N, speed=0.5, mass=2.0, radius=0.01, seed=1) if start is None else start
    keywords = {"until": 0.4, "every": 0.1, "compile": "never", "scene_text": "# one\n", **keywords}
    return swarm.simulate(scene, start, swarm.Impact(), trajectory=folder / "run.h5", **keywords)


def values_of(path):
    """All that is read of a trajectory, as bytes and texts."""
    with swarm.load(path) as trajectory:
        trajectory.require_index()
        trajectory.require_intact()
        arrays = [trajectory.times, trajectory.ids, trajectory.frame(0).mass, trajectory.radius, trajectory.wall_times]
        arrays += trajectory.observables.values()
        for k in range(len(trajectory)):
            arrays += trajectory.columns(k).values()
        for i in (0, N - 1):
            arrays += trajectory.particle(i)
        texts = [trajectory.descriptions, trajectory.makers, trajectory.scene_text, trajectory.start]
        texts += [trajectory.seed, trajectory.until, trajectory.threads, trajectory.count, str(trajectory.scene)]
    return [one.tobytes() for one in arrays], texts


def rows_of(path):
    """All that is read of a log of impacts."""
    with swarm.load_impacts(path) as log:
        log.require_intact()
        table = log.table()
        return [one.tobytes() for one in (table, log.times, log.ends)], [str(log.scene), log.kept, log.start, log.seed]


def flipped(data, place, bit):
    return data[:place] + bytes([data[place] ^ 1 << bit]) + data[place + 1 :]


def require_reported_or_harmless(path, data, read, seed, count):
    """How many of so many bits, flipped one at a time, are reported; the others change nothing that is read."""
    path.write_bytes(data)
    expected, chosen, reported = read(path), random.Random(seed), 0
    # Half of them in the first part of a file, where texts, headers and indexes are.
    places = [chosen.randrange(len(data) if k % 2 else min(len(data), 20_000)) for k in range(count)]
    for place in places:
        bit = chosen.randrange(8)
        path.write_bytes(flipped(data, place, bit))
        message, found = error_or_values(path, read)
        reported += bool(message)
        assert found == expected or (message.startswith(str(path)) and "\n" not in message), (place, bit, message)
    return reported


def error_or_values(path, read):
    """The error, or what is read."""
    try:
        return "", read(path)
    except swarm.SceneError as error:
        return str(error), None


KINDS = {
    "none": {}, "gzip": {"compression": "gzip"}, "lzf": {"compression": "lzf"}, "float32": {"precision": "float32"},
}  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "count"),
    [("none", 60), ("gzip", 10), *(pytest.param(kind, 2000, marks=pytest.mark.long) for kind in KINDS)],
)
def test_a_flipped_bit_is_reported_or_harmless(tmp_path, kind, count):
    simulate(tmp_path, until=0.2, **KINDS[kind])
    path = tmp_path / "run.h5"
    assert require_reported_or_harmless(path, path.read_bytes(), values_of, f"{kind} {count}", count) > count // 8


@pytest.mark.parametrize("count", [20, pytest.param(2000, marks=pytest.mark.long)])
def test_a_flipped_bit_of_a_log_is_reported_or_harmless(tmp_path, count):
    simulate(tmp_path, impacts=tmp_path / "impacts.h5")
    path = tmp_path / "impacts.h5"
    assert require_reported_or_harmless(path, path.read_bytes(), rows_of, count, count) > count // 8


@pytest.fixture
def harmed(tmp_path):
    """A run whose frame 3 has one bit of a position flipped."""
    simulate(tmp_path)
    path = tmp_path / "run.h5"
    with swarm.load(path) as trajectory:
        number = trajectory.frame(3).position[1, 4]
    data = path.read_bytes()
    path.write_bytes(flipped(data, data.index(number.tobytes()) + 6, 4))
    return path


def test_the_frame_and_the_dataset_are_named_and_other_frames_are_read(harmed, tmp_path):
    message = re.escape(f"{POSITION} of frame 3 does not match its checksum")
    with swarm.load(harmed) as trajectory:
        for k in (0, 1, 2, 4):
            assert np.isfinite(trajectory.frame(k).position).all()
        trajectory.export(tmp_path / "others.xyz", frames=slice(0, 3))
        for read in (
            lambda: trajectory.frame(3),
            lambda: trajectory.columns(3),
            lambda: trajectory.particle(4),
            lambda: trajectory.export(tmp_path / "all.xyz"),
            lambda: trajectory.export(tmp_path / "all.vtkhdf", surfaces=False),
        ):
            with pytest.raises(swarm.SceneError, match=message):
                read()
    assert {one.name for one in tmp_path.iterdir()} == {"run.h5", "others.xyz"}
    rows = summary.of_file(harmed)
    assert rows["checksums"] == (
        f"{harmed} is damaged: its values: {POSITION} of frame 3 does not match its checksum; "
        "what else there is can be read"
    )
    assert rows["frames"] == "5, 0 s to 0.4 s"


def stopped(folder, last=4, **keywords):
    """A run that was interrupted after a frame, with a checkpoint."""

    def stop(frame):
        if frame.number == last:
            signal.raise_signal(signal.SIGTERM)

    with pytest.raises(KeyboardInterrupt):
        simulate(folder, until=0.8, checkpoint=60.0, progress=stop, **keywords)


def test_a_run_does_not_go_on_behind_a_damaged_frame(tmp_path):
    stopped(tmp_path, impacts=tmp_path / "impacts.h5")
    path, data = tmp_path / "run.h5", (tmp_path / "run.h5").read_bytes()
    with swarm.load(path) as trajectory:
        number = trajectory.frame(2).velocity[2, 7]
    path.write_bytes(flipped(data, data.index(number.tobytes()), 0))
    resumed = {"until": 0.8, "resume": True, "impacts": tmp_path / "impacts.h5"}
    with pytest.raises(swarm.SceneError, match=r"particles/all/velocity of frame 2 does not match its checksum"):
        simulate(tmp_path, **resumed)
    path.write_bytes(data)
    log = (tmp_path / "impacts.h5").read_bytes()
    with swarm.load_impacts(tmp_path / "impacts.h5") as impacts:
        moment = impacts.table()["time"][0]
    (tmp_path / "impacts.h5").write_bytes(flipped(log, log.index(moment.tobytes()), 0))
    with pytest.raises(swarm.SceneError, match=r"impacts/time of frame \d does not match its checksum"):
        simulate(tmp_path, **resumed)
    (tmp_path / "impacts.h5").write_bytes(log)
    simulate(tmp_path, **resumed)
    values_of(path)
    rows_of(tmp_path / "impacts.h5")


def test_a_file_without_checksums_is_read_and_goes_on_without(tmp_path):
    stopped(tmp_path, impacts=tmp_path / "impacts.h5")
    for name in ("run.h5", "impacts.h5"):
        with edited(tmp_path / name):
            pass
    assert summary.of_file(tmp_path / "run.h5")["checksums"] == "none: an older version wrote it"
    old = simulate(tmp_path, until=0.8, resume=True, impacts=tmp_path / "impacts.h5")
    rows = summary.of_file(tmp_path / "run.h5")
    assert (rows["checksums"], rows["frames"]) == ("none: an older version wrote it", "9, 0 s to 0.8 s")
    before = values_of(tmp_path / "run.h5")[0][0], rows_of(tmp_path / "impacts.h5")[0][0]
    (tmp_path / "new").mkdir()
    new = simulate(tmp_path / "new", until=0.8, impacts=tmp_path / "new" / "impacts.h5")
    assert new.particles.position.tobytes() == old.particles.position.tobytes()
    after = values_of(tmp_path / "new" / "run.h5")[0][0], rows_of(tmp_path / "new" / "impacts.h5")[0][0]
    assert before == after


def test_a_kill_while_rows_are_written_again_is_no_damage(tmp_path, monkeypatch):
    """The wall times of another session differ: their checksums are not known until these are on file."""
    stopped(tmp_path, 2)
    shutil.copy(tmp_path / "run.h5.checkpoint", tmp_path / "saved")
    stopped(tmp_path, 5, resume=True)
    shutil.copy(tmp_path / "saved", tmp_path / "run.h5.checkpoint")
    write, seen = checksums.RowSums.write, []

    def killed(self, first):
        self._data.file.flush()
        shutil.copy(tmp_path / "run.h5", tmp_path / "killed.h5")
        seen.append((first, len(values_of(tmp_path / "killed.h5")[0])))
        write(self, first)

    monkeypatch.setattr(checksums.RowSums, "write", killed)
    simulate(tmp_path, until=0.8, resume=True)
    assert seen[0][0] == 3
