"""Frames written by a background thread: all of them, in order, unchanged; its errors are raised."""

import threading

import numpy as np
import pytest

from swarm.files import background
from swarm.files.background import Background
from swarm.state import State


class Writer:
    """Keeps the frames, each when `waits` returns; fails at frame `fails`."""

    def __init__(self, fails=None, waits=lambda: None):
        self.fails, self.waits = fails, waits
        self.frames, self.threads, self.left_with = [], set(), "never left"

    def __enter__(self):
        return self.write

    def __exit__(self, kind, error, trace):
        self.left_with = error

    def write(self, frames):
        for number, moment, state, seen in frames:
            self.waits()
            if number == self.fails:
                raise OSError(f"frame {number} does not fit")
            self.threads.add(threading.get_ident())
            arrays = (state.position.copy(), state.velocity.copy(), state.impacts.copy())
            self.frames.append((number, moment, *arrays, seen))


def state_of(n=5):
    nothing, none = np.zeros(n), np.zeros(n, np.int64)
    return State(np.zeros((3, n)), np.zeros((3, n)), nothing, nothing, nothing, none, nothing, nothing, None)


@pytest.mark.parametrize("memory", [background._BYTES, 1], ids=["many copies", "one copy"])
def test_every_frame_is_written_as_it_was(monkeypatch, memory):
    """The state goes on changing while a slow writer is behind: it writes no frame before the next has begun."""
    monkeypatch.setattr(background, "_BYTES", memory)
    changed, state = threading.Semaphore(0), state_of()
    writer = Writer(waits=changed.acquire)
    with Background(writer, 5) as write:
        for number in range(6):
            state.position[:], state.velocity[:], state.impacts[:] = number, -number, 2 * number
            if number > 0:
                changed.release()
            write(number, 0.1 * number, state, {"time": 0.1 * number})
        changed.release()
    assert [frame[0] for frame in writer.frames] == list(range(6))
    for number, moment, position, velocity, impacts, seen in writer.frames:
        assert moment == seen["time"] == 0.1 * number
        assert (position == number).all()
        assert (velocity == -number).all()
        assert (impacts == 2 * number).all()
    assert writer.threads.isdisjoint({threading.get_ident()})
    assert writer.left_with is None


def test_the_run_does_not_wait_for_a_frame():
    """It goes on before the frame is written: here it must, for the frame to be."""
    writer, went_on = Writer(), threading.Event()
    write_now = writer.write
    writer.write = lambda frames: went_on.wait(600.0) and write_now(frames)
    with Background(writer, 5) as write:
        write(0, 0.0, state_of(), {})
        went_on.set()
    assert len(writer.frames) == 1


def run(writer, frames, then=None):
    """A run of so many frames; `then` is raised at its end."""
    with Background(writer, 5) as write:
        for number in range(frames):
            writer.given = number
            write(number, 0.0, state_of(), {})
        if then is not None:
            raise then


def test_a_frame_that_fails_ends_the_run_and_none_follows():
    writer = Writer(fails=2)
    with pytest.raises(OSError, match="frame 2 does not fit"):
        run(writer, 1000)
    assert [frame[0] for frame in writer.frames] == [0, 1]
    # No more than are on their way when it fails.
    assert writer.given <= 2 + background._COPIES
    assert isinstance(writer.left_with, OSError)


def test_the_last_frame_fails_too():
    writer = Writer(fails=0)
    with pytest.raises(OSError, match="frame 0 does not fit"):
        run(writer, 1)
    assert isinstance(writer.left_with, OSError)


def test_an_error_of_the_run_is_the_one_that_is_raised():
    writer = Writer()
    with pytest.raises(ValueError, match="the run"):
        run(writer, 1, then=ValueError("the run"))
    assert len(writer.frames) == 1
    assert isinstance(writer.left_with, ValueError)
