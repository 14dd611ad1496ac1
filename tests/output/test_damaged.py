"""What is damaged, foreign, empty or not there is one sentence: no traceback, no absurd array and no endless wait."""

import gc
import json
import random
import shutil
import signal
import threading
import zipfile

import h5py
import numpy as np
import pytest
from conftest import edited

import swarm
from swarm import scene_file
from swarm.commands import pictures, summary
from swarm.files import checkpoint, paths, superblock
from swarm.pictures import plots
from swarm.recording import playback, recorded
from swarm.recording import writer as recording

SCENE = swarm.Scene([swarm.Sphere(0.5)])
METHOD = swarm.Impact()
N, FRAMES = 20, 5
KINDS = {"none": {}, "gzip": {"compression": "gzip"}, "lzf": {"compression": "lzf"}, "no frames": {"frames": "none"}}


def simulate(path, **keywords):
    start = swarm.fill(SCENE, N, speed=0.5, seed=1)
    return swarm.simulate(SCENE, start, METHOD, until=0.4, every=0.1, trajectory=path, **keywords)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    for name, keywords in KINDS.items():
        simulate(folder / f"{name}.h5", **keywords)
    return {name: (folder / f"{name}.h5").read_bytes() for name in KINDS}


@pytest.fixture
def whole(files, tmp_path):
    path = tmp_path / "run.h5"
    path.write_bytes(files["none"])
    return path


def everything(path):
    """All that is read of a trajectory, as shapes; every number is finite."""
    summary.of_file(path)
    with swarm.load(path) as trajectory:
        seen = trajectory.observables
        parts = [trajectory.times, trajectory.wall_times, *seen.values()]
        described = [*trajectory.descriptions, type(trajectory.scene), type(trajectory.method), trajectory.count]
        if "none" not in trajectory.descriptions["storage"].split("\n")[0]:
            for k in range(len(trajectory)):
                frame = trajectory.frame(k)
                parts += [frame.position, frame.velocity, frame.mass, trajectory.impacts(k)]
            for i in (0, N - 1):
                parts += trajectory.particle(i)
    assert all(np.isfinite(part).all() for part in parts)
    return [*described, *seen, *(part.shape for part in parts)]


def require_right_or_reported(path, expected):
    """Whether the file is reported as damaged, in one line that begins with its path."""
    try:
        assert everything(path) == expected
    except swarm.SceneError as error:
        message = str(error)
        assert message.startswith(str(path))
        assert "damaged" in message
        assert len(message.splitlines()) == 1
        return True
    return False


@pytest.mark.parametrize("kind", KINDS)
def test_a_flipped_byte_is_harmless_or_reported(files, tmp_path, kind):
    path, data, chosen = tmp_path / "run.h5", files[kind], random.Random(kind)
    path.write_bytes(data)
    expected, reported = everything(path), 0
    first, later = chosen.sample(range(3000), 30), chosen.sample(range(3000, len(data)), 10)
    for place in (0, 9, *first, *later, data.index(b'kind = "sphere"'), data.index(b"EAIB") + 9):
        path.write_bytes(data[:place] + bytes([data[place] ^ chosen.choice((255, 1, 32))]) + data[place + 1 :])
        reported += require_right_or_reported(path, expected)
    assert reported > 10


def test_a_heap_in_which_hdf5_would_loop_forever(files, tmp_path):
    """The size of a text there, such that the next one seems to begin where there are zeros."""
    path, data = tmp_path / "run.h5", files["no frames"]
    place = data.index(b'kind = "impact"') - 8
    for size in (220, 0, 1, 255):
        path.write_bytes(data[:place] + bytes([size]) + data[place + 1 :])
        with pytest.raises(swarm.SceneError, match=r"run\.h5 is damaged: its \w+: its heap is damaged"):
            everything(path)


def marked(data):
    """A file as a kill within a flush leaves it."""
    block = bytearray(data[: superblock.SIZE])
    block[11] = 5
    block[44:48] = superblock.checksum(bytes(block[:44])).to_bytes(4, "little")
    return bytes(block) + data[superblock.SIZE :]


def test_a_marked_file_is_read_and_a_damaged_one_waits_for_no_writer(files, whole):
    expected, data = everything(whole), marked(files["none"])
    whole.write_bytes(data)
    assert everything(whole) == expected
    place = data.index(b"EAIB") + 9
    whole.write_bytes(data[:place] + b"?" + data[place + 1 :])
    assert require_right_or_reported(whole, expected)


def test_what_was_cut_off_or_zeroed(files, whole):
    expected, data = everything(whole), files["none"]
    for size in (1, 7, 8, 47, 48, 500, 2000, 10_000, len(data) // 2, len(data) - 1):
        whole.write_bytes(data[:size])
        assert require_right_or_reported(whole, expected)
    for place in (0, 512, 1024, 2048, 2048 + 512):
        whole.write_bytes(data[:place] + bytes(512) + data[place + 512 :])
        require_right_or_reported(whole, expected)


def replaced(name, value, **keywords):
    """A change of a file: another dataset of this name."""

    def change(file):
        del file[name]
        file.create_dataset(name, data=value, **keywords)

    return change


def written(name, place, value):
    """A change of a file: another number."""

    def change(file):
        file[name][place] = value

    return change


def huge(file):
    del file["parameters/time"]
    file.create_dataset("parameters/time", (1 << 45,), np.float64, chunks=(1024,))


STRANGE = {
    "time is huge": (huge, "takes 281474976710656 bytes, and the file has"),
    "time is text": (replaced("parameters/time", b"soon"), "parameters/time must hold numbers"),
    "time is a table": (replaced("parameters/time", np.zeros((5, 2))), "parameters/time must have the shape"),
    "scene is a number": (replaced("parameters/scene", 1), "parameters/scene must be a text"),
    "scene is no TOML": (replaced("parameters/scene", "surface = ["), "its scene"),
    "scene is no table": (replaced("parameters/scene", "surface = 1"), "its scene"),
    "scene is too deep": (replaced("parameters/scene", f"surface = {'[' * 5000}"), "its scene"),
    # A file, a pipe or a device of the reader's machine would be opened.
    "scene names a file": (
        replaced(
            "parameters/scene", '[[surface]]\nkind = "sampled"\nvalues = "a.h5"\nspacing = 1.0\norigin = [0, 0, 0]'
        ),
        "its scene: surface.values: expected the samples, got 'a.h5'",
    ),
    "method is unknown": (replaced("parameters/method", 'kind = "magic"'), "its method: method.kind must be one of"),
    "a seed is text": (replaced("parameters/seed", b"one"), "parameters/seed must hold numbers"),
    "particles are many": (replaced("parameters/particles", np.zeros(3, int)), "parameters/particles must have"),
    "fewer were run": (replaced("parameters/particles", 19), "particles/all/mass must have 1 to 19 entries, got 20"),
    "positions are flat": (replaced("particles/all/position/value", np.zeros((5, 20))), "position/value must have"),
    "positions are few": (replaced("particles/all/velocity/value", np.zeros((4, 20, 3))), "velocity/value must have"),
    "masses are few": (replaced("particles/all/mass", np.ones(3)), "particles/all/id must have 3 entries"),
    "masses are negative": (written("particles/all/mass", 3, -1.0), "frame 0: mass must be a finite number above 0"),
    "numbers twice": (written("particles/all/id", 3, 2), "the numbers of its particles"),
    "an observable is text": (replaced("observables/impacts/value", [b"x"] * 5), "must hold numbers"),
    "an observable is short": (replaced("observables/impacts/value", np.zeros(4)), "observables/impacts must have 5"),
    "an observable is gone": (lambda file: file["observables"].pop("impacts"), "expected impacts of the shape"),
    "an impulse is gone": (replaced("observables/impulse/value", np.zeros((5, 2))), "expected impulse of the shape"),
    "a heat is gone": (replaced("observables/wall_heat/value", np.zeros((5, 2))), "expected wall_heat of the shape"),
    "sliding is a table": (replaced("observables/sliding/value", np.zeros((5, 2))), "expected sliding of the shape"),
    "impacts are flat": (
        replaced("particles/all/impacts/value", np.zeros(5, int)),
        "impacts/value must have the shape",
    ),
    "impacts are few": (replaced("particles/all/impacts/value", np.zeros((4, 20), int)), "impacts/value must have the"),
    "impacts are halves": (replaced("particles/all/impacts/value", np.zeros((5, 20))), "impacts/value must hold"),
    "impacts are negative": (written("particles/all/impacts/value", (2, 3), -1), "frame 2: expected 0 or more, got -1"),
    "a position is infinite": (written("particles/all/position/value", (2, 3, 1), np.inf), "frame 2: position must be"),
    "an energy is no number": (written("observables/total_energy/value", 4, np.nan), "got nan at frame 4"),
    "time stands still": (written("parameters/time", 3, 0.2), "its times: frame 3 is not after the one before it"),
}


@pytest.mark.parametrize("name", STRANGE)
def test_values_that_no_run_writes_are_reported(whole, name):
    change, message = STRANGE[name]
    with edited(whole) as file:
        change(file)
    with pytest.raises(swarm.SceneError) as caught:
        everything(whole)
    assert str(caught.value).startswith(f"{whole} is damaged: ")
    assert message in str(caught.value)


class Cycle:
    """An object of h5py that only the collector of cycles frees."""

    def __init__(self, held):
        self.me, self.held = self, held


def test_a_text_that_is_too_deep_leaves_no_lock_behind(whole):
    """Objects of h5py that are collected at the limit of the recursion cannot give back its lock to other threads."""
    with h5py.File(whole, "r+") as file:
        STRANGE["scene is too deep"][0](file)
    before = gc.get_threshold()
    gc.freeze()  # what there is now is not looked at
    try:
        with swarm.load(whole) as trajectory, h5py.File(whole, "r", locking=False) as other:
            # After how many objects the collector runs: somewhere among these it is at the limit.
            for allocated in range(20, 2000):
                gc.collect()
                gc.set_threshold(10**6)
                for _ in range(4):
                    Cycle((other["parameters"], other["parameters"].id))
                gc.set_threshold(allocated)
                with pytest.raises(swarm.SceneError, match="its scene"):
                    _ = trajectory.scene
    finally:
        gc.set_threshold(*before)
        gc.unfreeze()
    found = []
    thread = threading.Thread(target=lambda: found.append(h5py.File(whole, "r", locking=False).close()), daemon=True)
    thread.start()
    thread.join(60.0)
    assert len(found) == 1


@pytest.mark.parametrize(
    "names", [("h5md",), ("h5md", "parameters/time"), ("h5md", "parameters/time", "observables/x")]
)
def test_a_foreign_file_is_no_trajectory_of_swarm(tmp_path, names):
    with h5py.File(tmp_path / "other.h5", "w") as file:
        for name in names:
            file[name] = [1.0]
    with pytest.raises(swarm.SceneError, match=r"other\.h5 is an HDF5 file, but not a trajectory of swarm"):
        summary.of_file(tmp_path / "other.h5")


def test_a_path_without_a_file_is_one_sentence(tmp_path):
    (tmp_path / "empty").touch()
    (tmp_path / "text").write_text("text")
    scene = 'surface = [{kind = "sphere", radius = 0.5}]\nmethod.kind = "impact"\nrun.until = 1.0\nparticles.from = '

    def started(path):
        shutil.copytree(path, f"{path}.h5") if path.is_dir() else path.exists() and shutil.copy(path, f"{path}.h5")
        (tmp_path / "scene.toml").write_text(f'{scene}"{path.name}.h5"')
        scene_file.read(tmp_path / "scene.toml").start()

    (tmp_path / "folder").mkdir()
    readers = [swarm.load, summary.of_file, started, playback.Playback, playback.described, playback.repair]
    for read in readers:
        for name, message in (
            ("absent", r"there is no file .*absent"),
            ("folder", r"folder(\.h5)? is a folder; expected a "),
            ("empty", r"empty(\.h5)? is empty; expected a "),
            ("text", r"text(\.h5)? is not an? (HDF5 file|recording of swarm)"),
        ):
            with pytest.raises(swarm.SceneError, match=message) as caught:
                read(tmp_path / name)
            assert "errno" not in str(caught.value)
    for path in (None, "", 3, b"run.h5", True, "a\0"):
        with pytest.raises(swarm.SceneError, match=r"path must be the path of a file, got "):
            swarm.load(path)


def test_what_is_no_frame_or_particle(whole):
    with swarm.load(whole) as trajectory:
        for k in (1.0, True, "last", None, np.float64(1.0), np.True_):
            with pytest.raises(swarm.SceneError, match=r"run\.h5: frame must be a whole number, got "):
                trajectory.frame(k)
            with pytest.raises(swarm.SceneError, match=r"run\.h5: particle must be a whole number, got "):
                trajectory.particle(k)
        assert (trajectory.frame(np.int32(-1)).position == trajectory.frame(4).position).all()
        assert (trajectory.particle(np.uint8(3))[0] == trajectory.particle(3)[0]).all()
    for read in (
        len, lambda t: t.times, lambda t: t.observables, lambda t: t.frame(0), lambda t: t.particle(0),
        lambda t: t.impacts(0), lambda t: t.seed,
        lambda t: t.scene, lambda t: t.method, lambda t: t.scene_text, lambda t: t.count, lambda t: t.descriptions,
    ):  # fmt: skip
        with pytest.raises(swarm.SceneError, match=r"run\.h5 is closed; open it again with swarm\.load"):
            read(trajectory)
    trajectory.close()


def cut_to(path, frames):
    """Leave so many frames, as a run that ended early."""
    with h5py.File(path, "r+") as file:
        names = []
        file.visititems(
            lambda name, found: names.append(name) if getattr(found, "maxshape", (0,))[:1] == (None,) else None
        )
        for name in names:
            file[name].resize(frames, axis=0)


@pytest.mark.physics
def test_one_frame_is_drawn_recorded_and_reported(whole):
    cut_to(whole, 1)
    assert summary.of_file(whole)["frames"] == "1, 0 s to 0 s"
    with swarm.load(whole) as trajectory:
        plots.draw_plot(trajectory, whole.with_suffix(".png"))
        recorded.record(trajectory, whole.with_suffix(".rrd"), recording.Settings())
    assert whole.with_suffix(".png").stat().st_size > 20_000
    pictures.view(whole.with_suffix(".rrd"), whole.with_suffix(".pdf"), None, False)


def test_no_frame_is_a_sentence(whole):
    cut_to(whole, 0)
    assert summary.of_file(whole)["frames"] == "0: the run ended before the first was written"
    with swarm.load(whole) as trajectory:
        assert trajectory.times.tolist() == []
        for read in (
            lambda: trajectory.frame(0),
            lambda: trajectory.frame(-1),
            lambda: plots.draw_plot(trajectory, whole.with_suffix(".png")),
            lambda: recorded.record(trajectory, whole.with_suffix(".rrd"), recording.Settings()),
        ):
            with pytest.raises(swarm.SceneError, match=r"run\.h5 holds no frame: its run ended before the first one"):
                read()
    assert [path.name for path in whole.parent.iterdir()] == ["run.h5"]


def test_of_a_damaged_trajectory_there_is_no_half_recording(whole):
    with edited(whole) as file:
        file["particles/all/position/value"][3, 0, 0] = np.nan
    with swarm.load(whole) as trajectory, pytest.raises(swarm.SceneError, match=r"run\.h5 is damaged: frame 3"):
        recorded.record(trajectory, whole.with_suffix(".rrd"), recording.Settings())
    assert [path.name for path in whole.parent.iterdir()] == ["run.h5"]


@pytest.mark.parametrize("options", [{}, {"locking": False}, {"locking": True}, {"locking": "best-effort"}])
def test_another_reader_in_the_same_process(whole, options):
    """HDF5 needs the same locking flags from everything that opens a file by the same driver."""
    with h5py.File(whole, "r", **options) as other, swarm.load(whole) as trajectory:
        assert len(trajectory) == len(other["parameters/time"]) == FRAMES
    with swarm.load(whole) as trajectory, h5py.File(whole, "r", **options) as other, swarm.load(whole) as again:
        assert len(trajectory) == len(other["parameters/time"]) == len(again) == FRAMES


# --- Checkpoints and resuming ----------------------------------------------------------------------------


@pytest.fixture
def stopped(tmp_path):
    """A run that was stopped at its third frame: its trajectory and its checkpoint."""
    path = tmp_path / "run.h5"

    def stop(frame):
        if frame.number == 2:
            signal.raise_signal(signal.SIGTERM)

    with pytest.raises(KeyboardInterrupt):
        simulate(path, checkpoint=60.0, progress=stop)
    return path


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A job and arrays as they are saved, and the file."""
    path = tmp_path_factory.mktemp("saved") / "run.h5.checkpoint"
    arrays = {"position": np.ones((3, 4)), "impacts": np.arange(4), "done": np.zeros(4, bool)}
    job = checkpoint.SavedRun("1", "scene", "method", "storage", 4, "start", 2, 0.2, None, 1.5)
    checkpoint.save(path, job, arrays)
    return job, arrays, path.read_bytes()


def test_a_checkpoint_with_a_flipped_byte_is_as_it_was_or_damaged(saved, tmp_path):
    job, arrays, data = saved
    path, reported = tmp_path / "run.h5.checkpoint", 0
    for place in range(len(data)):
        path.write_bytes(data[:place] + bytes([data[place] ^ (255, 1, 64)[place % 3]]) + data[place + 1 :])
        try:
            its_job, its_arrays = checkpoint.read(path)
        except swarm.SceneError as error:
            require_damaged_checkpoint(error, path)
            reported += 1
        else:
            assert its_job == job
            assert all((its_arrays[name] == arrays[name]).all() for name in its_arrays)
            if its_arrays.keys() != arrays.keys():
                # The list of entries of a zip file has no checksum: a run does not go on without one of them.
                with pytest.raises(swarm.SceneError, match=r"or damaged: .*expected the arrays"):
                    checkpoint.require_fit(path, its_arrays, arrays)
    assert reported > len(data) // 2


def savez(path, **arrays):
    with path.open("wb") as file:
        np.savez(file, **arrays)


def require_damaged_checkpoint(error, path, what="is damaged: "):
    message = str(error)
    assert message.startswith(f"{path} {what}")
    assert "start again" in message
    assert "pickle" not in message
    assert len(message.splitlines()) == 1


@pytest.mark.parametrize("size", [0, 1, 30, 500, 1000, -1])
def test_a_checkpoint_that_was_cut_off_is_damaged(saved, tmp_path, size):
    path = tmp_path / "run.h5.checkpoint"
    for data in (saved[2][:size], b"text\n" * size):
        path.write_bytes(data)
        with pytest.raises(swarm.SceneError) as caught:
            checkpoint.read(path)
        require_damaged_checkpoint(caught.value, path)


@pytest.mark.parametrize(
    "change",
    [
        {"frame": "two"}, {"frame": -1}, {"frame": 1.5}, {"time": None}, {"time": float("nan")}, {"scene": 1},
        {"following": []}, {"more": 1}, {"particles": None}, {"wall_time": float("inf")}, None, [], "job", 3,
    ],
)  # fmt: skip
def test_a_checkpoint_without_a_job_is_damaged(saved, tmp_path, change):
    job, arrays, _data = saved
    path, table = tmp_path / "run.h5.checkpoint", vars(job)
    savez(path, job=json.dumps({**table, **change} if isinstance(change, dict) else change), **arrays)
    with pytest.raises(swarm.SceneError) as caught:
        checkpoint.read(path)
    require_damaged_checkpoint(caught.value, path)


def test_a_checkpoint_of_other_things_is_damaged(saved, tmp_path):
    path = tmp_path / "run.h5.checkpoint"
    objects = np.array([{}], dtype=object)
    for arrays in ({}, {"job": objects}, {"job": np.array(1.0), "x": objects}):
        savez(path, **arrays)
        with pytest.raises(swarm.SceneError) as caught:
            checkpoint.read(path)
        assert str(caught.value).startswith(f"{path} is damaged: ")
    with path.open("wb") as file:
        np.save(file, np.zeros(3))
    with pytest.raises(swarm.SceneError, match="is damaged"):
        checkpoint.read(path)
    header = b"\x93NUMPY\x01\x00v\x00{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999,), }".ljust(128)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("position.npy", header)
    with pytest.raises(swarm.SceneError, match="is damaged"):
        checkpoint.read(path)


ARRAYS = {
    "one is missing": lambda a: a.pop("impacts"),
    "one too many": lambda a: a.update(more=a["mass"]),
    "float32": lambda a: a.update(position=a["position"].astype(np.float32)),
    "one particle": lambda a: a.update(mass=a["mass"][:1]),
    "transposed": lambda a: a.update(velocity=a["velocity"].T),
    "a halt of no particle": lambda a: a.update({"halted.rows": np.zeros((3, 1))}),
    "a halt of particle 99": lambda a: a.update(
        {"halted.particle": np.array([99]), "halted.rows": np.zeros((len(a["halted.rows"]), 1))}
    ),
    "a halt of one particle twice": lambda a: a.update(
        {"halted.particle": np.array([3, 3]), "halted.rows": np.zeros((len(a["halted.rows"]), 2))}
    ),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_arrays_of_another_shape_are_damage(stopped, name):
    path = paths.checkpoint_of(stopped)
    job, arrays = checkpoint.read(path)
    ARRAYS[name](arrays)
    checkpoint.save(path, job, arrays)
    before = stopped.read_bytes()
    with pytest.raises(swarm.SceneError) as caught:
        simulate(stopped, checkpoint=60.0, resume=True)
    is_of_a_halt = name.startswith("a halt of particle") or name.endswith("twice")
    expected = "is damaged: " if is_of_a_halt else "is of another version of swarm, or damaged: "
    require_damaged_checkpoint(caught.value, path, expected)
    assert stopped.read_bytes() == before


def test_a_run_does_not_go_on_in_a_damaged_file(stopped):
    """HDF5 hangs when it writes a file whose index of chunks is damaged."""
    data, place = stopped.read_bytes(), 0
    while (place := data.find(b"EAIB", place + 1)) > 0:
        stopped.write_bytes(data[: place + 9] + bytes([data[place + 9] ^ 255]) + data[place + 10 :])
        with pytest.raises(swarm.SceneError, match=r"run\.h5 is damaged: "):
            simulate(stopped, checkpoint=60.0, resume=True)
    stopped.write_bytes(data)
    assert len(simulate(stopped, checkpoint=60.0, resume=True).observables["time"]) == FRAMES
