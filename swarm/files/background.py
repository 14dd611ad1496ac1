"""Frames written in the background, by a thread that reads a short queue."""

import contextlib
import math
import queue
import threading
import time
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..state import State
from .layout import KEPT
from .writer import WriteFrames, Written

# Frames are written in batches that end with a chunk of the file (`_CHUNK` in writer.py): with 10 000 particles a
# single frame takes 2.5 ms, a frame of a batch of ten 0.9 ms. No frame waits longer than this for others [s].
CHUNK_FRAMES = 10
_PATIENCE = 0.05
# The most frames in the queue: half of them are written while the others are computed. A longer queue would only hide a
# slow disk. With very many particles it has one frame, which is written while the next is computed.
_COPIES = 20 * CHUNK_FRAMES
_BYTES = 1 << 26
# Bytes for each particle in the copy of a state.
_PARTICLE = 88

Job = Callable[[], None]
WriteFrame = Callable[[int, float, State, dict[str, Any]], None]


def _copies_of(n: int) -> int:
    """The largest number of frames of n particles in the queue."""
    return max(1, min(_COPIES, _BYTES // (_PARTICLE * max(1, n))))


def waiting_bytes(n: int) -> int:
    """The largest number of bytes of the frames of n particles in the queue.

    >>> waiting_bytes(1_000_000)
    88000000
    """
    return _copies_of(n) * _PARTICLE * n


class Writer(Protocol):
    """A context that returns the function that writes frames."""

    def __enter__(self) -> WriteFrames: ...

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any, /) -> None: ...

    def sync(self) -> None:
        """Flush the written data to the disk."""


class Several:
    """Several writers as one: each writes a slice of the particles, one writer after the other."""

    def __init__(self, writers: list[tuple[Writer, slice]]) -> None:
        self._writers = writers

    def __enter__(self) -> WriteFrames:
        with contextlib.ExitStack() as stack:
            writes = [(stack.enter_context(writer), kept) for writer, kept in self._writers]
            self._stack = stack.pop_all()

        def write(frames: list[Written]) -> None:
            for one, kept in writes:
                one([(number, moment, _some(state, kept), seen) for number, moment, state, seen in frames])

        return write

    def __exit__(self, *error: Any) -> None:
        self._stack.__exit__(*error)

    def sync(self) -> None:
        """Flush the written data to the disk."""
        for writer, _kept in self._writers:
            writer.sync()


def _some(state: State, kept: slice) -> State:
    return state.having(**{name: getattr(state, name)[..., kept] for name in _copied(state)})


def _copied(state: State) -> list[str]:
    """The names of the arrays of a state that writers take and that the state has."""
    return [name for name in KEPT if getattr(state, name) is not None]


class Background:
    """A context that returns a function which queues a copy of a frame; a thread writes all queued frames at once.

    When the context ends, every frame is written. An error of the writer is raised at the next frame, or at the end.

    Args:
        writer: writes the frames, in the thread.
        n: the number of particles.
        kept: the particles that are copied and written.
        born: (n,) the times at which the particles come [s], in ascending order; None: all exist from the start.
            A frame has NaN for particles that come after it.
    """

    def __init__(
        self, writer: Writer, n: int, kept: slice = slice(None), born: NDArray[np.float64] | None = None
    ) -> None:
        self._writer, self._kept = writer, kept
        self._born = None if born is None else born[kept]
        n = max(1, len(range(n)[kept]))
        # The queue has also events, set when the frames before them are written, functions to call, and a last None.
        self._frames: queue.SimpleQueue[Written | threading.Event | Job | None] = queue.SimpleQueue()
        # Every frame needs one of these copies, so their number limits the length of the queue.
        self._copies: queue.SimpleQueue[State | None] = queue.SimpleQueue()
        copies = _copies_of(n)
        for _ in range(copies):
            self._copies.put(None)
        half = max(1, copies // 2)
        self._at_once = half if half < CHUNK_FRAMES else half - half % CHUNK_FRAMES
        self._problem: BaseException | None = None
        self.seconds = 0.0  # the time to write one frame of the latest batch
        self.written = self._queued = 0  # frames
        self._thread = threading.Thread(target=self._work, name="swarm-writer", daemon=True)

    def __enter__(self) -> WriteFrame:
        self._write = self._writer.__enter__()
        self._thread.start()
        return self._put

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        self._frames.put(None)
        self._thread.join()
        problem = self._problem if error is None else None
        self._writer.__exit__(kind if problem is None else type(problem), error or problem, trace)
        if problem is not None:
            raise problem

    def backlog(self) -> float:
        """The time to write the frames in the queue [s], estimated from the latest batch."""
        return self.seconds * max(0, self._queued - self.written)

    def _put(self, number: int, moment: float, state: State, seen: dict[str, Any]) -> None:
        self._queued = number + 1
        copy = self._copies.get()
        if self._problem is not None:
            raise self._problem
        some = _some(state, self._kept)
        if copy is None:
            copy = some.having(**{name: np.empty_like(getattr(some, name)) for name in _copied(some)})
        for name in _copied(some):
            np.copyto(getattr(copy, name), getattr(some, name))
        if self._born is not None:
            there = int(np.searchsorted(self._born, moment, side="right"))
            copy.position[:, there:] = copy.velocity[:, there:] = np.nan
        if copy.born_time is not None:
            unborn = np.isnan(copy.born_time)
            copy.position[:, unborn] = copy.velocity[:, unborn] = np.nan
        self._frames.put((number, moment, copy, seen))

    def do(self, job: Job) -> None:
        """Call a function in the thread, after the frames in the queue are written."""
        self._frames.put(job)

    def drain(self) -> None:
        """Wait until all frames in the queue are on the disk."""
        written = threading.Event()
        self._frames.put(written)
        written.wait()
        if self._problem is not None:
            raise self._problem
        self._writer.sync()

    def _work(self) -> None:
        end: object = True
        while end is not None:
            frames, end = self._gather()
            # A frame after one that failed is not written.
            if frames and self._problem is None:
                began = time.perf_counter()
                try:
                    self._write(frames)
                    self.written = frames[-1][0] + 1
                except BaseException as problem:  # the computing thread raises it
                    self._problem = problem
                self.seconds = (time.perf_counter() - began) / len(frames)
            for frame in frames:
                self._copies.put(frame[2])
            if isinstance(end, threading.Event):
                end.set()

    def _gather(self) -> tuple[list[Written], object]:
        """Return the next batch of frames, and the entry that ends it: None at the end of a run, an event, or True."""
        frames: list[Written] = []
        frame, latest = self._frames.get(), math.inf
        while frame is not None and not isinstance(frame, threading.Event):
            if callable(frame):
                try:
                    frame()
                except BaseException as problem:  # the computing thread raises it
                    self._problem = self._problem or problem
            else:
                frames.append(frame)
                latest = min(latest, time.monotonic() + _PATIENCE)
                # Up to the end of a chunk, not across it: numbers count from 0.
                if (frame[0] + 1) % self._at_once == 0:
                    return frames, True
            left = latest - time.monotonic()
            try:
                frame = self._frames.get(timeout=max(0.0, left) if frames else None)
            except queue.Empty:
                return frames, True
        return frames, frame
