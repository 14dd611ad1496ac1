"""A run on a cluster, from the side of the client: it hands out shards, waits for them and joins their files.

What a thousand workers do, from what 200 shards on two workers take (`python -m bench cluster`). Particles do not pass
through the scheduler: a task is a name, a number and a folder, its answer two words, a report some 100 bytes, of which
all shards together send 100 a second at most. A shard takes 4 ms of the scheduler's processor, reports included: a
thousand take 4 s of a run of any length. In a frame a particle takes 56 bytes (position, velocity, impacts; 32 in
float32) and 0.5 byte of sums, which each worker writes to a file of its own: 10^9 particles are 56 GB a frame, and the
storage is the slowest part; `frames = k` keeps fewer. Next is the client, which makes, checks and writes the start (56
bytes a particle), reads the end (64 bytes), and opens the file of each shard to join it. A shard begins and ends with
about 0.05 s of its own, a worker with some seconds of imports.
"""

import dataclasses
import functools
import math
import secrets
import threading
import time
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from ..common import interrupt
from ..common.frames import Frame
from ..errors import RunError, WallTimeError
from ..run.machine import RunEnd, start_of, warn_open
from ..run.measures import Measures
from ..run.options import Task
from ..run.preflight import hints
from ..run.progress import Display, display
from . import connection, joined, shards, worker
from .sharded import Sharded

_COMPLETE, _FAILED = "complete", "failed"
# Seconds between checkpoints of a shard if the options give no time; between looks at the shards; between requests to
# the shards to stop; and between looks at their frames.
_SAVED, _GLANCE, _TOLD, _FOLLOWS = 60.0, 0.2, 1.0, 1.0
# To read frames of many shards takes at most about this part of the time.
_READING = 0.1


def carry_out(task: Task, session: Sharded) -> RunEnd:
    """Carry out a run that is checked, on the cluster of its options.

    Raises:
        SceneError: the run cannot be one on a cluster, or the cluster cannot carry it out; nothing has run.
        RunError: a shard failed.
        KeyboardInterrupt, WallTimeError: it was stopped; its shards have saved their checkpoints.
    """
    if task.scene.is_open():
        warn_open()
    hints.give(task)
    target = Path(task.options.trajectory).absolute()
    saved = task.options.checkpoint or _SAVED
    task = dataclasses.replace(task, options=dataclasses.replace(task.options, trajectory=target, checkpoint=saved))
    stopped = threading.Event()
    with session, interrupt.taken_by(stopped.set):
        session.prepare_shards(task)
        measures = Measures(task.options.observables, task.options.until)
        measures.begin(0, 0.0, start_of(task))
        with connection.connected(task.options.cluster, stopped) as client, display(task.options.progress) as show:
            connection.require_same_versions(client)
            connection.require_shared(client, target.parent)
            one = _Run(task, session, client, stopped, show)
            observables = one.wait(measures)
        end = shards.joined_end(one.folder, task, one.bounds)
        session.finish()
        return end._replace(observables=observables, wall_time=session.wall_time())


class _Run:
    """The shards of a run, handed out."""

    def __init__(self, task: Task, session: Sharded, client: Any, stopped: threading.Event, show: Display) -> None:
        if stopped.is_set():
            raise KeyboardInterrupt
        self._task, self._session, self._client, self._stopped, self._show = task, session, client, stopped, show
        self._token = secrets.token_hex(8)
        self._shares: dict[int, float] = {}
        self._said: list[str] = []  # of what shards compile
        self._seen, self._read, self._reading = 0, time.monotonic(), 0.0
        threads = sum(one["nthreads"] for one in client.scheduler_info(n_workers=-1)["workers"].values())
        self.folder, self.bounds = session.begin(task, task.options.shards or threads)
        self._count = len(self.bounds) - 1
        client.subscribe_topic(self._token, self._hear)
        self._changed = threading.Event()
        submit = functools.partial(client.submit, worker.run, str(self.folder), pure=False)
        self._left = {submit(k, self._token, key=f"swarm-{self._token}-{k}"): k for k in range(self._count)}
        for future in self._left:
            future.add_done_callback(lambda _future: self._changed.set())

    async def _hear(self, event: tuple[float, dict[str, Any]]) -> None:
        """Take a report of a shard, in the thread of the client."""
        _when, said = event
        if "compiling" in said:
            self._said.append(said["compiling"])
        else:
            self._shares[said["shard"]] = said["share"]

    def wait(self, measures: Measures) -> dict[str, NDArray[Any]]:
        """The observables of all frames, when all shards have ended: they are joined also where some were stopped."""
        failed, stops, told = "", False, -math.inf
        try:
            while self._left:
                for future in [future for future in self._left if future.done()]:
                    k = self._left.pop(future)
                    self._shares[k] = 1.0
                    state, sentence = self._outcome(future, k)
                    failed, stops = failed or sentence, stops or state != _COMPLETE
                now = time.monotonic()
                if self._left and now >= told + _TOLD and (stops or self._stopped.is_set() or now >= self._session.end):
                    stops, told = True, now
                    # The request is repeated for shards that begin later, or on a worker that replaces another.
                    self._client.run(worker.stop, self._token, on_error="ignore")
                self._look()
                self._changed.wait(_GLANCE)
                self._changed.clear()
        finally:
            self._client.unsubscribe_topic(self._token)
            self._client.cancel(list(self._left))
        seen = joined.join(self.folder, self._task, self.bounds, self._session.identity, measures)
        self._follow()
        frames = len(seen["time"]) if seen else 0
        moment = float(seen["time"][-1]) if seen else 0.0
        if stops:
            self._session.keep(max(0, frames - 1), moment)
        if failed:
            raise RunError(failed)
        if stops and self._stopped.is_set():
            raise KeyboardInterrupt
        if stops:
            raise WallTimeError(f"the wall time of this run is over at {moment:g} s")
        return seen

    def _outcome(self, future: Any, k: int) -> tuple[str, str]:
        """The end of a shard: its state, and the sentence of a failure."""
        if future.status == "finished":
            state, sentence = future.result()
            return state, sentence
        what = "particles" if self._task.bodies is None else "bodies"
        sentence = f"the shard of {what} {self.bounds[k]} to {self.bounds[k + 1] - 1} failed: "
        error = future.exception() if future.status == "error" else None
        if error is None:
            return _FAILED, sentence + "the scheduler has lost it; the run can be resumed"
        if type(error).__name__ == "KilledWorker":
            return _FAILED, sentence + (
                f"each of the {error.allowed_failures + 1} workers that took it has died, last "
                f"{error.last_worker.address}, perhaps for lack of memory; see their logs; the run can be resumed"
            )
        return _FAILED, f"{sentence}{type(error).__name__}: {error}"

    def _look(self) -> None:
        """Show how far the shards are on average, and now and then the frames that all of them have."""
        until, now = self._task.options.times.until, time.monotonic()
        while self._said:
            self._show.compiling(f"{self._said.pop(0)}, on a worker")
        if len(self._shares) == self._count and now - self._read >= max(_FOLLOWS, self._reading / _READING):
            self._follow()
            self._read = time.monotonic()
            self._reading = self._read - now
        self._show.within(until * sum(self._shares.values()) / self._count, until)

    def _follow(self) -> None:
        """Show the frames that all shards have by now."""
        if not self._task.options.progress:
            return  # to read them takes time from workers of this machine
        until = self._task.options.times.until
        for count, seen, particles in joined.seen_of(self.folder, self._task, self.bounds, self._seen):
            self._show.frame(Frame(self._seen, seen["time"], until, seen, count, particles))
            self._seen += 1
