"""Runs in several sessions: the same bits as in one, whatever ended each of them; and what is refused."""

import itertools
import json
import signal
import textwrap
import time

import h5py
import numpy as np
import pytest
from children import python
from conftest import METHODS, rarely
from same_bits import require_same, require_same_observables

import swarm
from examples import long_run
from swarm.files import checkpoint, paths, writer
from swarm.lanes import block as blocks
from swarm.run import progress
from swarm.run.engine import Run
from swarm.run.progress import display_by, in_lines
from swarm.surfaces.fields import grouped

DOWN = (0.0, 0.0, -1.0)
SPHERE = swarm.Scene([swarm.Sphere(0.5)])
NESTED = swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.2, side="outside")])
LOSSY = swarm.Scene([swarm.Sphere(0.5, restitution=0.999)])
SWUNG = swarm.Scene(
    [
        swarm.Box(
            (0.5, 0.4, 0.3), motion=swarm.Oscillation((0.05, 0.0, 0.1), 0.7) + swarm.Rotation(DOWN, 1.3, (0, 0, 0))
        )
    ],
    DOWN,
)
CASES = {
    "impact, a box that swings and turns": (SWUNG, METHODS["impact"]),
    "impact, sphere": (SPHERE, METHODS["impact"]),
    "impact, nested": (NESTED, METHODS["impact"]),
    "impact, lossy": (LOSSY, METHODS["impact"]),
    "penalty, sphere": (SPHERE, METHODS["penalty"]),
}
FRAMES = 3


def frames_of(run, method, every, halted=False, between=lambda run, cut_short: run):
    """State and observables of every frame; `between` may put another run in place of this.

    A frame that is `halted` is so after 1, 2, 4, ... passes, until it is done.
    """
    seen = []
    for k in range(FRAMES):
        passes = 1 if halted else blocks.NEVER
        while True:
            run.halt(passes)
            if run.advance(method.span("every", every), every * (k + 1)):
                break
            run, passes = between(run, True), 2 * passes
        seen.append(run.seen())
        run = between(run, False)
    return {name: array.copy() for name, array in run.arrays().items()}, seen


def require_resumed_is_whole(tmp_path, scene, method, n=700, every=4.0, threads=(2, 1, 3), kind=Run):
    """A run that is halted repeatedly, saved and resumed each time, ends like one that is never halted."""
    start = swarm.fill(scene, n, speed=1.0, mass=np.linspace(0.5, 2.0, n), seed=5)
    with kind(scene.compiled(), start.copy(), method, 1, None) as whole:
        expected, expected_seen = frames_of(whole, method, every)
    halts, next_threads = [], itertools.cycle(threads)
    job = checkpoint.SavedRun("", "", "", "", n, "")

    def begin_again(run, cut_short):
        halts.append(cut_short)
        checkpoint.save(tmp_path / "a.checkpoint", job, run.arrays())
        run.__exit__()
        other = kind(scene.compiled(), start.copy(), method, next(next_threads), None)
        other.restore(checkpoint.read(tmp_path / "a.checkpoint")[1], cut_short)
        return other

    run = kind(scene.compiled(), start.copy(), method, next(next_threads), None)
    found, found_seen = frames_of(run, method, every, True, begin_again)
    assert found.keys() == expected.keys()
    for name, array in expected.items():
        assert np.array_equal(found[name], array, equal_nan=array.dtype.kind == "f"), name
    for one, other in zip(expected_seen, found_seen, strict=True):
        for name, value in one.items():
            assert np.array_equal(value, other[name]), name
    # A pass is one flight to a wall at most, and whatever the wall, a few are needed.
    assert sum(halts) >= 2 * FRAMES
    return sum(halts)


@pytest.mark.physics
@pytest.mark.parametrize("name", [rarely(name) if name == "impact, lossy" else name for name in CASES])
def test_resumed_is_whole(tmp_path, name):
    """In the midst of most particles' flights."""
    # What loses energy comes to graze the wall, and slides.
    every = {"impact, lossy": 30.0, "penalty, sphere": 4.0}.get(name, 20.0)
    assert require_resumed_is_whole(tmp_path, *CASES[name], every=every) >= 5 * FRAMES


@pytest.mark.physics
def test_a_thread_is_halted_as_often_on_every_machine(tmp_path):
    assert require_resumed_is_whole(tmp_path, *CASES["impact, sphere"], every=20.0, threads=(1,)) == 24


def run(path, scene=SPHERE, method=None, until=2.0, every=0.5, n=20, start_seed=1, **keywords):
    start = swarm.fill(scene, n, speed=1.0, seed=start_seed)
    return swarm.simulate(
        scene, start, method or swarm.Impact(), until=until, every=every, trajectory=path, threads=1, **keywords
    )


def stopped_at(path, number, how=lambda: signal.raise_signal(signal.SIGTERM), **keywords):
    """A run that is asked to stop at a frame."""

    def progress(frame):
        if frame.number == number:
            how()

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    with pytest.raises(KeyboardInterrupt):
        run(path, checkpoint=60.0, progress=progress, **keywords)
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize(
    "storage", [{}, {"frames": 3, "precision": "float32", "compression": "gzip"}, {"frames": "none"}]
)
def test_a_signal_leaves_a_checkpoint_to_resume_from(tmp_path, number, storage):
    path, whole = tmp_path / "run.h5", tmp_path / "whole.h5"
    stopped_at(path, 2, lambda: signal.raise_signal(number), **storage)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    saved, _arrays = checkpoint.read(paths.checkpoint_of(path))
    assert (saved.frame, saved.time, saved.following) == (2, 1.0, None)
    with swarm.load(path) as half:
        assert len(half) == 3
    numbers = []
    resumed = run(path, resume=True, progress=lambda frame: numbers.append(frame.number), **storage)
    expected = run(whole, **storage)
    assert numbers == [3, 4]
    assert not paths.checkpoint_of(path).exists()
    require_same(resumed, expected)
    with swarm.load(path) as one, swarm.load(whole) as other:
        assert len(one) == len(other) == 5
        require_same_observables(one, expected)
        if storage.get("frames") != "none":
            for k in range(5):
                assert np.array_equal(one.frame(k).velocity, other.frame(k).velocity)
                assert np.array_equal(one.impacts(k), other.impacts(k))


def halted_after(monkeypatch, passes, seconds):
    """Each frame is halted after so many passes, again and again, and a halt is the one thing that takes `seconds`.

    What else asks for a halt asks for it in `seconds`: it never comes to that. Gives the moments of the halts.
    """
    clock, advance = [0.0], Run.advance
    monkeypatch.setattr(time, "monotonic", lambda: clock[-1])

    def halting(run, span, moment, writing, latest):
        assert clock[-1] < latest <= clock[-1] + seconds
        run.halt(passes)
        done = advance(run, span, moment, writing, latest)
        if not done:
            clock.append(clock[-1] + seconds)
        return done

    monkeypatch.setattr(Run, "advance", halting)
    return clock


@pytest.mark.physics
def test_the_wall_time_ends_a_run_in_the_middle_of_a_frame(tmp_path, monkeypatch):
    path, day = tmp_path / "run.h5", 86_400.0
    expected = run(tmp_path / "whole.h5", until=60.0, every=20.0)
    halted_after(monkeypatch, 12, day)
    frames = []
    while True:
        try:
            result = run(path, until=60.0, every=20.0, resume=True, checkpoint=7.0 * day, walltime=day)
            break
        except swarm.WallTimeError:
            saved = checkpoint.read(paths.checkpoint_of(path))[0]
            assert saved.following == 20.0 * (saved.frame + 1)
            frames.append(saved.frame)
    assert frames == [0] * 5 + [1] * 5 + [2] * 5
    require_same(result, expected)
    assert result.wall_time == len(frames) * day


def test_a_longer_run_goes_on_from_a_shorter_one(tmp_path):
    stopped_at(tmp_path / "run.h5", 3, until=2.0)
    longer = run(tmp_path / "run.h5", until=4.0, resume=True)
    expected = run(tmp_path / "whole.h5", until=4.0)
    assert np.array_equal(longer.particles.position, expected.particles.position)
    assert longer.observables["time"].tolist() == expected.observables["time"].tolist()


def test_contact_steps_before_the_impact_go_on_with_the_same_bits(tmp_path):
    method = swarm.Impact(contact_step=0.05, contact_start="centred")
    stopped_at(tmp_path / "run.h5", 3, until=4.0, method=method)
    resumed = run(tmp_path / "run.h5", until=4.0, method=method, resume=True)
    expected = run(tmp_path / "whole.h5", until=4.0, method=method)
    assert np.array_equal(resumed.particles.position, expected.particles.position)
    assert np.array_equal(resumed.particles.velocity, expected.particles.velocity)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"n": 21}, ["number of particles is 20, got 21"]),
        ({"method": swarm.Impact(contact_step=1e-3)}, ["contact_step = 0.0", "contact_step = 0.001"]),
        ({"method": swarm.Penalty(dt=0.125, penalty=1e3)}, ['kind = "impact"', 'kind = "penalty"']),
        ({"scene": swarm.Scene([swarm.Sphere(0.6)])}, ["radius = 0.5", "radius = 0.6"]),
        ({"scene": swarm.Scene([swarm.Sphere(0.5)], (0.0, 0.0, -1.0))}, ["gravity", "scene is"]),
        ({"precision": "float32"}, ['precision = "float64"', 'precision = "float32"']),
        ({"start_seed": 2}, ["particles at the start (seed,", "digest"]),
        ({"seed": 2}, ["seed of thermal walls is 0, got 2"]),
        ({"every": 0.25}, ["its frame 2 is at 1 s, got 0.5 s"]),
        ({"until": 1.0}, ["until must be after", "1 s, got 1 s"]),
    ],
    ids=["count", "contact step", "method", "scene", "gravity", "storage", "start", "seed", "every", "until"],
)
def test_another_run_is_refused_with_both_values(tmp_path, change, words):
    path = tmp_path / "run.h5"
    stopped_at(path, 2)
    before = [file.read_bytes() for file in (path, paths.checkpoint_of(path))]
    with pytest.raises(swarm.SceneError) as caught:
        run(path, **{"resume": True, **change})
    for word in words:
        assert word in str(caught.value)
    if "every" not in change:
        assert [file.read_bytes() for file in (path, paths.checkpoint_of(path))] == before
    assert len(run(path, resume=True).observables["time"]) == 5


def test_rows_of_walls_in_another_order_are_refused(tmp_path, monkeypatch):
    """What the row of a wall holds would go to another one, as the energy that another one has taken in."""
    path = tmp_path / "run.h5"

    def scene():
        floor = swarm.Plane((0.0, 0.0, 1.0), -0.2, temperature=300.0)
        return swarm.Scene([floor, swarm.Sphere(0.5)])

    with monkeypatch.context() as before:
        # An older version, whose kernels had the walls as they were listed.
        before.setattr(grouped, "by_kind", lambda things, numbers: list(things))
        stopped_at(path, 2, scene=scene())
    saved = paths.checkpoint_of(path)
    files = path.read_bytes(), saved.read_bytes()
    assert scene().compiled().numbering.surfaces_of_rows == [1, 0]
    with pytest.raises(swarm.SceneError, match=r"another order of walls: its rows are of surfaces 0, 1, got 1, 0; st"):
        run(path, scene=scene(), resume=True)
    job, arrays = checkpoint.read(saved)
    checkpoint.save(saved, job, {name: array for name, array in arrays.items() if name != "owners"})
    with pytest.raises(swarm.SceneError, match=r"does not say which surface each of its rows is of: an older version"):
        run(path, scene=scene(), resume=True)
    saved.write_bytes(files[1])
    assert path.read_bytes() == files[0]
    monkeypatch.setattr(grouped, "by_kind", lambda things, numbers: list(things))
    assert len(run(path, scene=scene(), resume=True).observables["time"]) == 5


def test_without_a_checkpoint_nothing_begins_again_unasked(tmp_path):
    """The frames that are there are kept, whichever start they are of, until somebody says --overwrite."""
    path = tmp_path / "run.h5"
    stopped_at(path, 2)
    paths.checkpoint_of(path).unlink()
    frames = path.read_bytes()
    for change, words in (
        ({"n": 30}, "number of particles is 20, got 30"),
        ({"start_seed": 2}, r"run\.h5 is of another run: its particles at the start .* have the digest"),
        ({"seed": 2}, r"run\.h5 is of another run: its seed of thermal walls is 0, got 2"),
        (
            {"scene": swarm.Scene([swarm.Sphere(0.6)])},
            r"its scene is .*radius = 0\.5, center = \[0\.0, 0\.0, 0\.0\], side",
        ),
        ({}, r"run\.h5\.checkpoint must be there .*begin again at 0 s and replace the 3 frames of .*--overwrite"),
    ):
        with pytest.raises(swarm.SceneError, match=words) as caught:
            run(path, resume=True, **change)
        assert not isinstance(caught.value, swarm.CompleteError)
        assert path.read_bytes() == frames
    numbers = []
    run(path, resume=True, overwrite=True, progress=lambda frame: numbers.append(frame.number))
    assert numbers == [0, 1, 2, 3, 4]
    whole = path.read_bytes()
    for overwrite in (False, True):  # a job of a chain that comes again does not do again what is done
        with pytest.raises(swarm.CompleteError, match="is complete: its last frame is at 2 s"):
            run(path, resume=True, overwrite=overwrite)
    assert path.read_bytes() == whole
    with pytest.raises(swarm.SceneError, match="is of another run") as caught:
        run(path, resume=True, seed=2)
    assert not isinstance(caught.value, swarm.CompleteError)
    run(path, resume=True, overwrite=True, seed=2)
    path.write_bytes(whole[:1000])
    run(path, resume=True, overwrite=True)


def test_a_trajectory_of_a_version_that_stored_no_start_is_not_taken_for_complete(tmp_path):
    run(tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        del file["parameters/start"]
    with pytest.raises(swarm.SceneError, match=r"run\.h5 must have the digest of its start") as caught:
        run(tmp_path / "run.h5", resume=True)
    assert not isinstance(caught.value, swarm.CompleteError)


def test_to_resume_what_never_began_is_to_begin(tmp_path):
    numbers = []
    run(tmp_path / "run.h5", resume=True, progress=lambda frame: numbers.append(frame.number))
    assert numbers == [0, 1, 2, 3, 4]


def test_a_run_that_fails_at_its_first_frame_leaves_the_old_one_and_its_checkpoint(tmp_path, monkeypatch):
    path = tmp_path / "run.h5"
    stopped_at(path, 2)
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}

    def fail(run, seen, moment):
        raise swarm.RunError("at once")

    monkeypatch.setattr(Run, "require_admissible", fail)
    with pytest.raises(swarm.RunError, match="at once"):
        run(path, overwrite=True, start_seed=2)
    monkeypatch.undo()
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before
    assert len(run(path, resume=True).observables["time"]) == 5


def test_what_is_missing_or_damaged_is_reported(tmp_path):
    path = tmp_path / "run.h5"
    stopped_at(path, 2)
    saved = paths.checkpoint_of(path)
    whole, frames = saved.read_bytes(), path.read_bytes()
    position = checkpoint.read(saved)[1]["position"].tobytes()
    for spoiled in (whole[: len(whole) // 2], whole.replace(position, position[1:] + b"?"), b"", b"text"):
        saved.write_bytes(spoiled)
        with pytest.raises(swarm.SceneError, match=r"run\.h5\.checkpoint is damaged: .*start again"):
            run(path, resume=True)
    saved.write_bytes(whole)
    path.unlink()
    with pytest.raises(swarm.SceneError, match=r"needs its trajectory .* which does not exist"):
        run(path, resume=True)
    run(path, until=1.0, every=1.0)
    saved.write_bytes(whole)
    with pytest.raises(swarm.SceneError, match=r"must hold 3 frames, .* got 2"):
        run(path, resume=True)
    path.write_bytes(frames)
    assert len(run(path, resume=True).observables["time"]) == 5
    with pytest.raises(swarm.SceneError, match="need the trajectory of the run, got none"):
        run(None, checkpoint=1.0)
    with pytest.raises(swarm.SceneError, match=r"checkpoint must be 0.01 or more, got 0.001"):
        run(path, checkpoint=0.001)


def test_a_new_run_forgets_the_old_checkpoint(tmp_path):
    path = tmp_path / "run.h5"
    stopped_at(path, 2)
    run(path, overwrite=True, n=5)
    assert not paths.checkpoint_of(path).exists()


@pytest.mark.parametrize("keywords", [{"resume": True}, {"overwrite": True}])
def test_no_second_run_writes_the_same_trajectory(tmp_path, keywords):
    """While it runs it is refused and nothing is touched; the file is unchanged. A lock that a kill left behind
    blocks no run."""
    path = tmp_path / "run.h5"
    paths.lock_of(path).touch()

    def meddle(frame):
        with pytest.raises(swarm.FileError, match=r"run\.h5 is being written by another run; wait until"):
            run(path, **keywords)

    run(path, checkpoint=60.0, progress=meddle)
    assert [file.name for file in tmp_path.iterdir()] == ["run.h5"]
    with swarm.load(path) as trajectory:
        assert trajectory.times.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
    run(path, overwrite=True)


def test_a_checkpoint_that_cannot_be_written_leaves_the_last_one(tmp_path, monkeypatch):
    """The disk is full when it is half written: the run ends, and goes on later from the one before."""
    path = tmp_path / "run.h5"
    sentence = (
        r"cannot write the checkpoint .*No space left.*; make room there; the previous checkpoint is unchanged; "
        r"with resume the run goes on from .*run.h5.checkpoint"
    )
    saved, real = [], np.savez

    def full(file, **entries):
        if len(saved) == 2:
            file.write(b"half of it")
            raise OSError(28, "No space left on device")
        real(file, **entries)
        saved.append(entries["job"])

    monkeypatch.setattr(checkpoint.np, "savez", full)
    clock = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: clock[-1])
    with pytest.raises(swarm.FileError, match=sentence):
        run(path, checkpoint=600.0, progress=lambda frame: clock.append(clock[-1] + 600.0))
    assert [file.name for file in sorted(tmp_path.iterdir())] == ["run.h5", "run.h5.checkpoint"]
    assert json.loads(saved[-1])["frame"] == 1
    monkeypatch.undo()
    numbers = []
    run(path, resume=True, progress=lambda frame: numbers.append(frame.number))
    assert numbers == [2, 3, 4]


@pytest.mark.parametrize(("failing", "every"), [("checkpoint", 600.0), ("frame", 600.0), ("frame", None)])
def test_a_disk_that_is_full_before_the_first_checkpoint_leaves_nothing_to_resume(
    tmp_path, monkeypatch, failing, every
):
    def full(*_given, **_more):
        raise OSError(28, "No space left on device")

    clock = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: clock[-1])

    def fills(frame):
        if frame.number == 2:
            monkeypatch.setattr(*(checkpoint.np, "savez") if failing == "checkpoint" else (writer, "rows"), full)
            clock.append(600.0 if failing == "checkpoint" else 0.0)

    with pytest.raises(swarm.FileError, match=r"cannot write .*: No space left") as error:
        run(tmp_path / "run.h5", checkpoint=every, progress=fills)
    _cause, _remedy, *left = str(error.value).split("; ")
    if every is None:
        assert not left
    else:
        assert left[0].startswith("no checkpoint was saved before, so the run cannot be resumed: start a new run from ")


def test_without_being_asked_for_there_is_no_checkpoint(tmp_path, monkeypatch):
    monkeypatch.setattr(checkpoint, "save", lambda *arguments: pytest.fail("saved"))
    run(tmp_path / "run.h5")


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda state: state.position.__setitem__((0, 7), np.nan), "particle 7: position or velocity are no longer"),
        (lambda state: state.velocity.__setitem__((2, 7), np.inf), "particle 7: position or velocity are no longer"),
        (
            lambda state: state.position.__setitem__((0, 7), 0.6),
            r"particle 7: it is .* m outside surfaces\[0\] \(Sphere",
        ),
    ],
    ids=["nan", "infinity", "outside"],
)
def test_a_spoiled_frame_is_never_written(tmp_path, monkeypatch, spoil, message):
    """As after an error in a kernel: the frame is named, and those before it are in the file."""
    advance = Run.advance

    def gone_wrong(self, span, moment, *more):
        if moment == 1.5:
            spoil(self.state)
            self.observe()
            return True
        return advance(self, span, moment, *more)

    monkeypatch.setattr(Run, "advance", gone_wrong)
    with pytest.raises(swarm.RunError, match=rf"the frame at 1.5 s failed at {message}"):
        run(tmp_path / "run.h5")
    with swarm.load(tmp_path / "run.h5") as trajectory:
        assert trajectory.times.tolist() == [0.0, 0.5, 1.0]


def test_plain_lines_tell_how_it_goes(capsys, monkeypatch):
    clock = [100.0]
    monkeypatch.setattr(time, "perf_counter", lambda: clock[0])
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    from swarm.run.simulation import Frame

    show = display_by(in_lines(60.0), 60.0)
    for number in range(8):
        # The first frame compiles for a minute and a half, which the estimate must not include; then 20 s each.
        clock[0] += 90.0 if number == 1 else 20.0
        show.frame(Frame(number, 0.5 * number, 50.0, {"impacts": 1000 * number, "energy_error": 2e-16}))
    printed = capsys.readouterr().err.splitlines()
    assert printed[0].startswith("1.0%  0.5/50 s")
    assert printed[1] == "4.0%  2/50 s  ETA 0:32:00  50 impacts/s  energy error 2.0e-16"
    assert len(printed) == 3
    clock[0] += 100.0
    show.within(3.75, 50.0)  # half of the way to the next frame; the last 10 s and more were the last 0.25 s
    assert capsys.readouterr().err.splitlines() == ["7.5%  3.75/50 s  ETA 5:08:20  50 impacts/s  energy error 2.0e-16"]


@pytest.mark.physics
def test_lines_on_the_way_to_a_far_frame(capsys, monkeypatch):
    """A run without frames in between tells how far it is all the same."""
    monkeypatch.setattr(progress.sys.stderr, "isatty", lambda: False)
    start = swarm.fill(SPHERE, 300, speed=1.0, seed=1)
    whole = swarm.simulate(SPHERE, start, swarm.Impact(), until=60.0, threads=1)
    clock = halted_after(monkeypatch, 12, 60.0)
    result = swarm.simulate(SPHERE, start, swarm.Impact(), until=60.0, threads=1, progress=True)
    assert np.array_equal(result.particles.position, whole.particles.position)
    shares = [float(line.split("%")[0]) for line in capsys.readouterr().err.splitlines()]
    assert len(shares) == len(clock) - 1 >= 10
    assert shares == sorted(shares)
    assert 0.0 < shares[0] < shares[len(shares) // 2] < 100.0


@pytest.mark.physics
def test_the_example_is_stopped_twice_and_conserves(tmp_path):
    result = long_run.main(particles=50, impacts=200.0, folder=tmp_path)
    assert result["sessions"] == ["stopped", "stopped", "complete"]
    assert result["frames at the stops"] == [51, 301, 501]
    assert result["frames"] == long_run.FRAMES + 1
    assert result["impacts"] == pytest.approx(50 * 200.0, rel=0.1)
    assert result["energy error, worst particle"] <= 1e-14
    assert result["Joachimsthal's integral, worst relative change"] <= 1e-9
    assert result["largest penetration [m]"] <= 4.0 * np.spacing(0.6)


# --- Processes -------------------------------------------------------------------------------------------

# A child that is not killed waits for it after so many frames; a checkpoint is made every twenty.
FARTHEST = 200
KILLED = """
    import os, random, signal, sys, time
    from pathlib import Path
    import swarm
    scene = swarm.Scene([swarm.Sphere(0.5)])
    start = swarm.fill(scene, 50, speed=1.0, seed=1)

    def run(path, progress=False, **more):
        return swarm.simulate(scene, start, swarm.Impact(), until=20.0, every=0.01, trajectory=path, threads=1,
                              progress=progress, **more)

    def child(into):
        calls = 0

        def tell(frame):
            nonlocal calls
            calls += 1
            os.write(into, frame.written.to_bytes(8, "little"))
            if calls == {farthest}:
                signal.pause()

        time.monotonic = lambda: float(calls)
        try:
            run({path!r}, tell, checkpoint=20.0, resume=True)
        except swarm.CompleteError:
            pass  # killed when all was done
        os._exit(0)

    swarm.simulate(scene, start, swarm.Impact(), until=1.0, threads=1)  # compiled, and no thread is left
    random.seed(7)
    kills = 0
    while True:
        out, into = os.pipe()
        pid = os.fork()
        if pid == 0:
            child(into)
        os.close(into)
        data = b"".join(os.read(out, 8) for _ in range(random.randint(1, {farthest})))
        time.sleep(random.uniform(0.0, 0.005))  # anywhere in what follows that frame
        os.kill(pid, signal.SIGKILL)
        _, status = os.waitpid(pid, 0)
        while more := os.read(out, 1 << 16):
            data += more
        os.close(out)
        if not os.WIFSIGNALED(status):
            break
        kills += 1
        reports = [int.from_bytes(data[i : i + 8], "little") for i in range(0, len(data) - 7, 8)]
        print(len(swarm.load({path!r})) if Path({path!r}).exists() else 0, max(reports, default=0))
    print("kills", kills)
"""


@pytest.mark.physics
def test_kill_9_at_random_moments(tmp_path):
    """Each child is killed for good and the next goes on from its checkpoint, until one is through."""
    path = tmp_path / "run.h5"
    code = textwrap.dedent(KILLED).format(path=str(path), farthest=FARTHEST)
    output = python("-c", code)
    assert (output.returncode, output.stderr) == (0, "")
    *pairs, last = output.stdout.splitlines()
    print(last, *pairs, sep="; ")
    for pair in pairs:
        held, reported = map(int, pair.split())
        assert held >= reported
    assert int(last.split()[1]) >= 2000 // FARTHEST
    start = swarm.fill(SPHERE, 50, speed=1.0, seed=1)
    expected = swarm.simulate(SPHERE, start, swarm.Impact(), until=20.0, every=0.01, trajectory=tmp_path / "whole.h5")
    with swarm.load(path) as one, swarm.load(tmp_path / "whole.h5") as other:
        assert len(one) == len(other) == 2001
        for i in range(0, 50, 7):
            for mine, its in zip(one.particle(i), other.particle(i), strict=True):
                assert np.array_equal(mine, its)
        require_same_observables(one, expected)
