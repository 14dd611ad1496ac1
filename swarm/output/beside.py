"""Frames written beside the computation: a thread of their own behind a short queue."""

import queue
import threading
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Any

import numpy as np

from ..particles import State
from .trajectory import WriteFrame

# Frames on their way: one is written while another waits; more would only hide a slow disk in memory. Of many
# particles there is one, which is enough to write while the next is computed.
_COPIES = 2
_MANY = 1_000_000


class Beside:
    """A context like the one it takes, whose function returns when the frame is copied, not when it is written.

    When the context ends, every frame is written. What writing raised is raised by the next frame, or at the end.
    """

    def __init__(self, writer: AbstractContextManager[WriteFrame], n: int) -> None:
        self._writer = writer
        self._frames: queue.SimpleQueue[tuple[int, float, State, dict[str, Any]] | None] = queue.SimpleQueue()
        # What bounds the other queue: a frame needs one of these.
        self._copies: queue.SimpleQueue[State | None] = queue.SimpleQueue()
        for _ in range(_COPIES if n <= _MANY else 1):
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
        while (frame := self._frames.get()) is not None:
            # After a frame that is not there, none follows.
            if self._problem is None:
                try:
                    self._write(*frame)
                except BaseException as problem:  # whatever it is, the thread that computes raises it
                    self._problem = problem
            self._copies.put(frame[2])
