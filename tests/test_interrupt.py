"""SIGINT ends a run between frames, wherever Python is when it comes."""

import signal
import threading
import weakref

import pytest

import swarm
from swarm.run.engine import Run

CAVITY = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])


@pytest.fixture(autouse=True)
def _sigint_is_pythons():
    """A shell starts its background jobs with SIGINT ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


class Thing:
    """Something a weak reference can be made of."""


def in_a_weakref_callback():
    """SIGINT where Python prints a KeyboardInterrupt and forgets it: Numba's compiler has many such places."""
    thing = Thing()
    reference = weakref.ref(thing, lambda dead: signal.raise_signal(signal.SIGINT))
    del thing
    assert reference() is None


def run(tmp_path, at_frame):
    """Call `at_frame` in frame 3 of a run that would go on for long."""

    def progress(frame):
        if frame.number == 3:
            at_frame()

    swarm.simulate(
        CAVITY, swarm.fill(CAVITY, 10, speed=1.0), swarm.Impact(), until=1e4, every=0.1,
        trajectory=tmp_path / "run.h5", progress=progress,
    )  # fmt: skip


@pytest.mark.parametrize("at_frame", [lambda: signal.raise_signal(signal.SIGINT), in_a_weakref_callback])
def test_frames_are_kept(tmp_path, at_frame):
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, at_frame)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with swarm.load(tmp_path / "run.h5") as trajectory:
        assert len(trajectory) == 4


def test_a_second_one_is_at_once(tmp_path):
    def twice():
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, twice)


def test_a_handler_of_the_callers_stays(tmp_path):
    came = []
    before = signal.signal(signal.SIGINT, lambda number, frame: came.append(number))
    try:

        def at_frame():
            signal.raise_signal(signal.SIGINT)
            raise LookupError

        with pytest.raises(LookupError):
            run(tmp_path, at_frame)
    finally:
        signal.signal(signal.SIGINT, before)
    assert came == [signal.SIGINT]


def test_other_threads_have_no_handler():
    done = []

    def work():
        swarm.simulate(CAVITY, swarm.fill(CAVITY, 10, speed=1.0), swarm.Impact(), until=1.0)
        done.append(True)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done


@pytest.mark.parametrize("wakes", [True, False])
def test_a_long_frame_stops_within(monkeypatch, wakes):
    """The first frame is one of 1e10 impacts; the signal comes when its thread is at them.

    It does not wake a main thread that is about to wait for a lock, nor one whose signal another thread received.
    """
    advance = Run.advance

    def interrupted(run, *arguments):
        over = threading.Event()

        def interrupt():
            while not over.wait(0.001):
                if run._ticket[0] > 0:
                    signal.pthread_kill((threading.main_thread() if wakes else thread).ident, signal.SIGINT)
                    return

        thread = threading.Thread(target=interrupt)
        thread.start()
        try:
            return advance(run, *arguments)
        finally:
            over.set()
            thread.join()

    monkeypatch.setattr(Run, "advance", interrupted)
    with pytest.raises(KeyboardInterrupt):
        swarm.simulate(CAVITY, swarm.fill(CAVITY, 10, speed=1.0), swarm.Impact(), until=1e9, threads=1)
