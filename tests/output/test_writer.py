"""After a kill, on a full disk or beside another process a trajectory keeps every frame that was reported written."""

import os
import shutil

import h5py
import numpy as np
import pytest
from conftest import files_limited_to

import swarm
from swarm.files import appended, superblock, writer
from swarm.files.storage import Storage
from swarm.state import State

SPHERE = swarm.Scene([swarm.Sphere(0.5)])
N = 3


def frame(number, n=N):
    """Frame k holds the number k throughout."""
    rows = np.full((3, n), float(number))
    nothing, counts = np.zeros(n), np.full(n, number)
    state = State(rows, -rows, nothing, nothing, nothing, counts, nothing, nothing, None)
    return (
        number,
        float(number),
        state,
        {"time": float(number), "impacts": number, "momentum": np.full(3, float(number))},
    )


def writer_of(path, following=False, storage=None):
    particles = swarm.Particles(np.zeros((3, N)), np.ones((3, N)))
    return writer.TrajectoryWriter(path, storage or Storage(), SPHERE, swarm.Impact(), particles, None, {}, following)


def require_frames(path, least, n=None):
    """The file opens, and each of its frames is what was written; how many there are."""
    with swarm.load(path) as trajectory:
        count = len(trajectory)
        assert count >= least
        assert trajectory.times.tolist() == list(range(count))
        if count:
            expected = np.arange(count) * np.ones((3, 1))
            position, velocity = trajectory.particle(count % N)
            assert np.array_equal(position, expected)
            assert np.array_equal(velocity, -expected)
            seen = trajectory.observables
            assert seen["impacts"].tolist() == list(range(count))
            assert np.array_equal(seen["momentum"].T, expected)
            for k in {0, count // 2, count - 1}:
                assert trajectory.impacts(k).tolist() == [k] * N
    return count


class Log:
    """A file that notes every write of HDF5."""

    def __init__(self, path):
        self._file = open(path, "r+b")  # noqa: SIM115
        self.notes = []

    def write(self, data):
        data = bytearray(data)
        if self._file.tell() == 0 and data[11] == 4:
            # HDF5 marks what is a Python object with one bit of the two that it gives a file.
            data[11] = 5
            data[44:48] = superblock.checksum(bytes(data[:44])).to_bytes(4, "little")
        self.notes.append((self._file.tell(), bytes(data)))
        self._file.write(data)
        self._file.flush()
        return len(data)

    def truncate(self, size=None):
        self.notes.append((size, None))
        return self._file.truncate(size)

    def __getattr__(self, name):
        return getattr(self._file, name)


@pytest.mark.physics
@pytest.mark.parametrize("compression", ["none", "gzip"])
def test_every_prefix_of_the_writes_is_a_whole_file(tmp_path, monkeypatch, compression):
    """A kill stops HDF5 between two of its writes: here between any two, and the run goes on from what is left.

    So many chunks that the index of chunks grows several times: in HDF5's ordinary mode a kill in the middle of that
    loses half of them. What is written behind the end is in no index yet: every fourth of these writes is a case.
    """
    path, image, batch, frames = tmp_path / "run.h5", tmp_path / "image.h5", 7, 420 if compression == "none" else 84
    logs, real = [], h5py.File

    def logged(name, mode, **options):
        logs.append(Log(name))
        del options["locking"], options["driver"]
        return real(logs[-1], mode, **options)

    unmark = superblock.unmark
    monkeypatch.setattr(writer.h5py, "File", logged)
    monkeypatch.setattr(appended, "_descriptor_of", lambda file: -1)
    monkeypatch.setattr(
        superblock, "unmark", lambda handle: logs[-1].notes.append((0, unmark(handle))) or unmark(handle)
    )
    reported = []
    with writer_of(path, storage=Storage(compression=compression)) as write:
        for first in range(0, frames, batch):
            write([frame(number) for number in range(first, first + batch)])
            reported.append((len(logs[0].notes), first + batch))
    logs[0].close()
    monkeypatch.undo()
    assert require_frames(path, frames) == frames
    image.touch()
    done, cases, size, behind = 0, 0, 0, 0
    with open(image, "r+b") as file:
        for k, (place, data) in enumerate(logs[0].notes):
            behind = behind + 1 if data is None or place >= size else 0
            size = place if data is None else max(size, place + len(data))
            if data is None:
                file.truncate(place)
            else:
                file.seek(place)
                file.write(data)
            file.flush()
            done = max([number for written, number in reported if written <= k + 1], default=0)
            # One that follows a change of the index is worth more than a hundred that append.
            if done == 0 or (done % (10 * batch) and done < frames - 11 * batch):
                continue
            if behind > 1 and behind % 4:
                continue
            cases += 1
            assert done <= require_frames(image, done) <= done + batch
            if cases % 11 == 0:
                # And a run that goes on from there spoils nothing.
                shutil.copy(image, tmp_path / "again.h5")
                with writer_of(tmp_path / "again.h5", True, Storage(compression=compression)) as write:
                    write([frame(number) for number in range(done, done + 3 * batch)])
                require_frames(tmp_path / "again.h5", done + 3 * batch)
    assert cases > 100


def test_sessions_write_the_same_rows(tmp_path):
    """A session that goes on from an older frame writes the same rows again: no gap, no duplicate."""
    path = tmp_path / "run.h5"
    for first, last in ((0, 12), (7, 20), (19, 25)):
        with writer_of(path, first > 0) as write:
            write([frame(number) for number in range(first, last)])
    assert require_frames(path, 25) == 25


def test_a_session_goes_on_in_a_file_of_a_version_without_impacts(tmp_path):
    path = tmp_path / "run.h5"
    with writer_of(path) as write:
        write([frame(0)])
    with h5py.File(path, "r+") as file:
        del file["particles/all/impacts"]
    with writer_of(path, True) as write:
        write([frame(1)])
    with swarm.load(path) as trajectory:
        assert (trajectory.frame(1).position == 1.0).all()
        with pytest.raises(swarm.SceneError, match=r"run\.h5 keeps no impacts of particles: an older version"):
            trajectory.impacts(1)


def test_the_checksum_is_that_of_hdf5(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w", libver="v110"):
        pass
    block = (tmp_path / "a.h5").read_bytes()[: superblock.SIZE]
    assert superblock.checksum(block[:44]) == int.from_bytes(block[44:], "little")
    assert superblock.checksum(block[:43]) != int.from_bytes(block[44:], "little")


@pytest.mark.parametrize(
    ("harm", "message"),
    [
        (os.remove, "was deleted or replaced while the run was writing it"),
        (lambda path: os.truncate(path, 3000), "was truncated while the run was writing it, from .* to 3000 bytes"),
        (lambda path: shutil.copy(path, f"{path}.x") and os.replace(f"{path}.x", path), "was deleted or replaced"),
    ],
    ids=["deleted", "truncated", "replaced"],
)
def test_a_file_that_is_harmed_ends_the_run(tmp_path, harm, message):
    path = tmp_path / "run.h5"
    with pytest.raises(swarm.FileError, match=message), writer_of(path) as write:  # noqa: PT012
        write([frame(0)])
        harm(path)
        write([frame(1)])


@pytest.mark.parametrize("size", [20_000, appended._BEGINNING - 1])
def test_a_disk_without_room_for_the_beginning_has_no_file(tmp_path, size):
    path = tmp_path / "run.h5"
    with pytest.raises(swarm.FileError) as caught, files_limited_to(size), writer_of(path):
        pass
    assert str(caught.value) == f"cannot write the trajectory {path}: File too large"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("size", [*range(appended._BEGINNING, appended._BEGINNING + 8_000, 800), 165_537])
def test_a_full_disk_loses_no_frame(tmp_path, size):
    path, count = tmp_path / "run.h5", 0
    with pytest.raises(swarm.FileError) as caught, files_limited_to(size), writer_of(path) as write:  # noqa: PT012
        while count < 5000:
            write([frame(count)])
            count += 1
    assert str(caught.value) == f"cannot write frame {count} to {path}: File too large"
    assert require_frames(path, count) == count > 0
    with h5py.File(path) as file:
        assert file["particles/all/position/value"].shape[1:] == (N, 3)
    with writer_of(path, True) as write:
        write([frame(number) for number in range(count, count + 100)])
    require_frames(path, count + 100)
