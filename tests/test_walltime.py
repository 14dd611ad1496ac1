"""The limit of the wall time, by clocks of the tests: nothing here is timed."""

import math
import time

import click
import pytest
from numba.core import event
from same_bits import require_same
from scene_texts import in_a_sphere

import swarm
from swarm.commands.run import run as command
from swarm.files import checkpoint
from swarm.files.background import Background
from swarm.kernel.cache import kernels_compiled
from swarm.run.engine import Run
from swarm.run.options import RunOptions
from swarm.run.session import Session

LOSSY = swarm.Scene([swarm.Box((0.5, 0.5, 0.5), restitution=0.5, friction=0.3)], (0.0, 0.0, -9.81))
SCENE = in_a_sphere("until = 1000.0\nevery = 1.0")


class Clock:
    """A clock that goes on only when it is set."""

    def __init__(self, monkeypatch):
        self.now = 100.0
        monkeypatch.setattr(time, "monotonic", lambda: self.now)


@pytest.fixture
def clock(monkeypatch):
    return Clock(monkeypatch)


class Queue:
    """A writer with so many seconds of frames in its queue."""

    def __init__(self, clock, seconds):
        self._clock, self._seconds = clock, seconds

    def backlog(self):
        return self._seconds

    def drain(self):
        self._clock.now += self._seconds
        self._seconds = 0.0


class Still:
    def arrays(self):
        return {}


def session(clock, monkeypatch, saving=0.0, **options):
    """One with a limit of 10 s and a trajectory, whose checkpoints take so long."""
    given = {"until": 1.0, "trajectory": "run.h5", "checkpoint": 4.0, "walltime": 10.0, **options}
    made, saved = Session(RunOptions(**given)), []
    made._job = checkpoint.SavedRun("", "", "", "", 1, "")
    made._owners = None

    def save(*_about):
        clock.now += saving
        saved.append(clock.now)

    monkeypatch.setattr(checkpoint, "save", save)
    return made, saved


def test_the_run_stops_in_time_to_write_what_is_in_the_queue(clock, monkeypatch):
    made, saved = session(clock, monkeypatch, checkpoint=3600.0)
    writer = Queue(clock, 4.0)
    # A checkpoint half way would say how long one takes.
    assert made.latest(writer) == made._due == 105.0
    made._due = math.inf
    assert made.latest(None) == 110.0
    assert made.latest(writer) == 106.0
    clock.now = 105.9
    made.look(Still(), writer, 1, 0.5, None)
    assert saved == []
    clock.now = 106.0
    with pytest.raises(swarm.WallTimeError, match=r"the wall time of this run is over at 0\.5 s$"):
        made.look(Still(), writer, 1, 0.5, None)
    assert saved == [110.0]


def test_the_run_stops_in_time_for_a_checkpoint_as_long_as_the_last(clock, monkeypatch):
    made, saved = session(clock, monkeypatch, saving=1.5)
    clock.now = 104.0
    made.look(Still(), Queue(clock, 0.5), 1, 0.5, None)
    assert saved == [106.0]
    # The next one is 4 s after that, later than the limit less 2 s.
    assert made.latest(None) == 108.0
    clock.now = 108.0
    with pytest.raises(swarm.WallTimeError):
        made.look(Still(), Queue(clock, 0.0), 2, 0.75, None)
    assert saved == [106.0, 109.5]


def test_a_queue_is_as_long_as_its_frames_take():
    queue = Background(None, 10)
    queue._queued, queue.written, queue.seconds = 120, 100, 0.25
    assert queue.backlog() == 5.0
    # Of a session that begins at a later frame none is written so far.
    queue.written, queue.seconds = 0, 0.0
    assert queue.backlog() == 0.0


@pytest.mark.parametrize(("begins", "ends", "late"), [(108.0, 117.0, "7 s"), (101.0, 103.0, ""), (111.0, 112.0, "")])
def test_a_compilation_under_way_ends_first_and_the_message_says_so(clock, monkeypatch, begins, ends, late):
    """One within another is a part of it; one that is over before the limit delays nothing."""
    made, saved = session(clock, monkeypatch)
    with kernels_compiled(lambda _sentence: None) as made.compiled:
        assert made.compiled.latest == (-math.inf, -math.inf)
        clock.now = begins
        for _ in range(2):
            event.start_event("numba:compile", data={"dispatcher": None})
        clock.now = 0.5 * (begins + ends)
        event.end_event("numba:compile")
        clock.now = ends
        event.end_event("numba:compile")
    assert made.compiled.latest == (begins, ends)
    assert made.compiled.seconds == ends - begins
    clock.now = max(ends, 110.0)
    with pytest.raises(swarm.WallTimeError) as stop:
        made.look(Still(), Queue(clock, 0.0), 1, 0.5, None)
    message = ": a compilation was under way, which ended first, "
    assert str(stop.value) == "the wall time of this run is over at 0.5 s" + (message + late + " after it") * bool(late)
    assert stop.value.compiled == (ends - 110.0 if late else 0.0)
    assert saved


@pytest.mark.parametrize("call", [2, 3, 5, 9])
def test_no_other_kernel_begins_behind_the_limit_and_resumed_runs_have_the_same_bits(tmp_path, monkeypatch, call):
    """The limit is reached at this call of a kernel: of flights, and when contacts begin to last."""
    start, ahead, called = swarm.fill(LOSSY, 20, speed=1.0, seed=1), [0.0], []
    real, kernel = time.monotonic, Run._kernel
    options = {"until": 1.0, "every": 0.5, "threads": 1, "compile": "never"}
    whole = swarm.simulate(LOSSY, start, swarm.Impact(), **options)

    def counted(run, one, page):
        called.append((one.__name__, ahead[0] > 0.0))
        ahead[0] += 1e6 * (len(called) == call)
        return kernel(run, one, page)

    with monkeypatch.context() as here:
        here.setattr(time, "monotonic", lambda: real() + ahead[0])
        here.setattr(Run, "_kernel", counted)
        with pytest.raises(swarm.WallTimeError):
            swarm.simulate(
                LOSSY, start, swarm.Impact(), trajectory=tmp_path / "a.h5", checkpoint=1e9, walltime=1e5, **options
            )
    before = {name for name, late in called if not late}
    assert {name for name, late in called if late} <= before
    rest = swarm.simulate(
        LOSSY, start, swarm.Impact(), trajectory=tmp_path / "a.h5", checkpoint=1e9, resume=True, **options
    )
    require_same(rest, whole)


@pytest.mark.parametrize("compiled", [0.0, 7.0])
def test_the_limit_of_a_command_counts_from_its_begin(tmp_path, clock, monkeypatch, capsys, compiled):
    """To read the scene takes 60 s here, and the limit is 50 s; then the first frame is the last."""
    (tmp_path / "scene.toml").write_text(SCENE)
    monkeypatch.chdir(tmp_path)
    fill = swarm.fill

    def slowly(*about, **more):
        clock.now += 60.0
        return fill(*about, **more)

    monkeypatch.setattr("swarm.scene_file.fill", slowly)
    frames = Session.frames

    def compiling(made, times):
        made.compiled.latest = 149.0, 150.0 + compiled
        return frames(made, times)

    monkeypatch.setattr(Session, "frames", compiling)
    with pytest.raises(click.exceptions.Exit) as stop:
        command(tmp_path / "scene.toml", walltime="50s", quiet=True, threads=1)
    assert stop.value.exit_code == 75
    message = "the wall time limit is reached" + ", after a compilation that was under way" * bool(compiled)
    assert capsys.readouterr().err.startswith(f"{message}: scene.h5 holds the frames")
    with swarm.load(tmp_path / "scene.h5") as begun:
        assert begun.times.tolist() == [0.0]
    assert (tmp_path / "scene.h5.checkpoint").exists()
