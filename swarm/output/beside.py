"""Frames written beside the computation: a thread of their own behind a short queue."""

import queue
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Any

import numpy as np

from ..particles import State
from .trajectory import WriteFrames, Written

# Frames on their way: some are written, as many as wait at once, while others are computed. More would only hide a slow
# disk in memory; of very many particles there is one, which is enough to write while the next is computed.
_COPIES = 16
_BYTES = 1 << 26

WriteFrame = Callable[[int, float, State, dict[str, Any]], None]


class Beside:
    """A context whose function returns when the frame is copied; the one it takes writes all that wait, at once.

    When the context ends, every frame is written. What writing raised is raised by the next frame, or at the end.
    """

    def __init__(self, writer: AbstractContextManager[WriteFrames], n: int) -> None:
        self._writer = writer
        self._frames: queue.SimpleQueue[Written | None] = queue.SimpleQueue()
        # What bounds the other queue: a frame needs one of these.
        self._copies: queue.SimpleQueue[State | None] = queue.SimpleQueue()
        for _ in range(max(1, min(_COPIES, _BYTES // (48 * n)))):
            self._copies.put(None)
        self._problem: BaseException | None = None
        self._thread = threading.Thread(target=self._work, name="swarm-writer", daemon=True)

    def __enter__(self) -> WriteFrame:
        self._write = self._writer.__enter__()
        self._thread.start()
        return self._put

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._frames.put(None)
        self._thread.join()
        problem = self._problem if error is None else None
        self._writer.__exit__(kind if problem is None else type(problem), error or problem, trace)
        if problem is not None:
            raise problem

    def _put(self, number: int, moment: float, state: State, seen: dict[str, Any]) -> None:
        copy = self._copies.get()
        if self._problem is not None:
            raise self._problem
        if copy is None:
            copy = state._replace(position=np.empty_like(state.position), velocity=np.empty_like(state.velocity))
        np.copyto(copy.position, state.position)
        np.copyto(copy.velocity, state.velocity)
        self._frames.put((number, moment, copy, seen))

    def _work(self) -> None:
        going = True
        while going:
            waiting = [self._frames.get()]
            while not self._frames.empty():
                waiting.append(self._frames.get())
            frames = [frame for frame in waiting if frame is not None]
            going = len(frames) == len(waiting)
            # After a frame that is not there, none follows.
            if frames and self._problem is None:
                try:
                    self._write(frames)
                except BaseException as problem:  # whatever it is, the thread that computes raises it
                    self._problem = problem
            for frame in frames:
                self._copies.put(frame[2])
