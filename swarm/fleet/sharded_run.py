"""A run on a cluster, from the side of the client: it hands out shards, waits for them and joins their files.

The costs for a thousand workers, from those of 200 shards on two workers (`python -m bench cluster`). Particles do not
pass through the scheduler: a task is a name, a number and a folder, its answer two words, a report about 100 bytes,
and all shards send at most 100 reports a second. A shard takes 4 ms of the scheduler's processor, reports included: a
thousand take 4 s of a run of any length. In a frame a particle takes 56 bytes (position, velocity, impacts; 32 in
float32) and 0.5 byte of sums, which each worker writes to a file of its own: 10^9 particles are 56 GB a frame, and the
storage is the slowest part; `frames = k` keeps fewer. Next is the client, which makes, checks and writes the start (56
bytes a particle), reads the end (64 bytes), and opens the file of each shard to join it. A shard begins and ends with
about 0.05 s of overhead, a worker with a few seconds of imports.
"""

import dataclasses
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import interrupt
from ..common.catalog import Observables
from ..common.frames import Frame
from ..errors import RunError, SceneError, WallTimeError
from ..files import checkpoint, paths
from ..files.lock import only_writer
from ..run import machine
from ..run.machine import start_of, warn_open
from ..run.measures import Measures
from ..run.options import Task
from ..run.preflight import hints
from ..run.progress import Display, display
from ..run.result import Result
from ..run.session import Session
from . import connection, jobs, joined, shards
from .jobs import PATIENCE, JobEnd, Reporter, session_of

# Seconds between checkpoints of a shard if the options give none; and between looks at the frames of the shards.
_SAVED, _FOLLOWS = 60.0, 1.0
# The largest part of the time that is spent on reading frames of many shards.
_READING = 0.1


class Sharded(Session):
    """A session with the bounds of the shards in its checkpoint; the shards have checkpoints of their own."""

    # The bounds of the previous session, or of this one once it has begun.
    _bounds: Any = None

    def prepare_shards(self, task: Task) -> None:
        """Find the start of this session, as `Session.prepare` does.

        Raises:
            SceneError, CompleteError, FileError: as by `Session.prepare`.
        """
        self._hold(task, None)
        self._times = np.array([task.options.times.until, task.options.times.every])
        if self._resumes and self._path.exists():
            self._find_shards()
        elif self._resumes and self._trajectory.exists():
            self._refuse_to_restart(task.options.until, task.options.overwrite)
        elif task.options.overwrite:
            return
        elif (folder := paths.shards_of(self._trajectory)).exists():
            raise SceneError(
                f"{folder} holds the shards of another run; resume that with --resume, choose another name for the "
                "trajectory, or overwrite it (--overwrite, overwrite=True)"
            )

    def _find_shards(self) -> None:
        path, (saved, arrays) = self._path, checkpoint.read(self._path)
        if checkpoint.SHARDS not in arrays:
            raise SceneError(f"{path} is of a run without a cluster; resume it without one")
        saved.require_same(self._job, path)
        # Sums in the files of shards have rows of walls too.
        checkpoint.require_owners(path, arrays, self._owners)
        if (was := arrays["times"]).tolist() != self._times.tolist():
            raise SceneError(
                f"{path} is of a run with until = {was[0]:g} s and every = {was[1]:g} s, got {self._times[0]:g} and "
                f"{self._times[1]:g} s; leave them as they were"
            )
        self._bounds, self._job = arrays[checkpoint.SHARDS].tolist(), saved

    @property
    def end(self) -> float:
        """The time when the wall time limit is reached [s of time.monotonic]."""
        return self._end

    def begin(self, task: Task, count: int) -> tuple[Path, list[int]]:
        """Prepare the folder of the shards; return it, and the bounds of the last session or of `count` new shards."""
        folder = paths.shards_of(self._trajectory)
        if self._bounds is None:
            self._bounds = shards.bounds_of(task.count, count)
            shards.clear(folder)
            self._trajectory.unlink(missing_ok=True)
            self.keep(0, 0.0)
        shards.prepare(folder, task, self._bounds, self.identity["start"])
        return folder, self._bounds

    def keep(self, frame: int, moment: float) -> None:
        """Save the data that a later session needs besides the checkpoints of the shards."""
        job = dataclasses.replace(self._job, frame=frame, time=moment, wall_time=self.wall_time())
        checkpoint.save(
            self._path, job, {checkpoint.SHARDS: np.array(self._bounds), "times": self._times}, self._owners
        )

    def finish(self) -> None:
        """Remove the files that only an unfinished run needs."""
        paths.checkpoint_of(self._trajectory).unlink(missing_ok=True)
        shards.tidy(paths.shards_of(self._trajectory), len(self._bounds) - 1)


def carry_out(task: Task, session: Sharded) -> Result:
    """Carry out a checked run on the cluster of its options.

    Raises:
        SceneError: the run cannot be on a cluster, or the cluster cannot carry it out; no shard has run.
        RunError: a shard failed.
        KeyboardInterrupt, WallTimeError: it was stopped; its shards have saved their checkpoints.
    """
    if task.scene.is_open():
        warn_open()
    hints.give(task)
    target = Path(task.options.trajectory).absolute()
    saved = task.options.checkpoint or _SAVED
    task = dataclasses.replace(task, options=dataclasses.replace(task.options, trajectory=target, checkpoint=saved))
    stop = jobs.Stop()
    with session, interrupt.taken_by(stop.interrupt):
        session.prepare_shards(task)
        measures = Measures(task.options.observables, task.options.until)
        measures.begin(0, 0.0, start_of(task))
        with connection.connected(task.options.cluster, stop) as client, display(task.options.progress) as show:
            connection.require_same_versions(client)
            connection.require_shared(client, target.parent)
            if stop.reason:
                raise KeyboardInterrupt
            folder, bounds = session.begin(task, shards_of(task, connection.threads_of(client)))
            with connection.Workers(client, stop, len(bounds) - 1) as fleet:
                observables = _Shards(task, session, folder, bounds, fleet, show).run(measures, stop)
        end = shards.joined_end(folder, task, bounds)
        session.finish()
        return dataclasses.replace(end, observables=Observables(observables), wall_time=session.wall_time())


def shards_of(task: Task, threads: int) -> int:
    """The number of shards on a cluster with this number of threads."""
    return 1 if task.is_coupled else task.options.shards or threads


class _Shards:
    """The shards of a run, handed out."""

    def __init__(
        self, task: Task, session: Sharded, folder: Path, bounds: list[int], fleet: jobs.Fleet, show: Display
    ) -> None:
        self._task, self._session, self._fleet, self._show = task, session, fleet, show
        self._folder, self._bounds, self._count = folder, bounds, len(bounds) - 1
        self._done, self._failed = 0, ""
        self._seen, self._read, self._reading = 0, time.monotonic(), 0.0

    def run(self, measures: Measures, stop: jobs.Stop) -> dict[str, NDArray[Any]]:
        """Run all shards; return the observables of all frames, which are joined also if some shards were stopped."""

        def ended(k: int, outcome: jobs.JobEnd) -> None:
            self._done += outcome["state"] == "done"
            if outcome["state"] == "failed":
                stop.because("failed")
                self._failed = self._failed or self._lost(k) * ("lost" in outcome) + outcome["error"]

        def glance() -> None:
            if time.monotonic() >= self._session.end:
                stop.because("walltime")
            self._look()

        made = (jobs.FleetJob(k, run_shard, (self._folder, k)) for k in range(self._count))
        self._fleet.run(made, ended, glance)
        seen = joined.join(self._folder, self._task, self._bounds, self._session.identity, measures)
        self._follow()
        if self._done == self._count:
            return seen
        moment = float(seen["time"][-1]) if seen else 0.0
        self._session.keep(max(0, len(seen["time"]) - 1) if seen else 0, moment)
        if self._failed:
            raise RunError(self._failed)
        if stop.reason == "interrupted":
            raise KeyboardInterrupt
        raise WallTimeError(f"the wall time of this run is over at {moment:g} s")

    def _lost(self, k: int) -> str:
        what = "particles" if self._task.bodies is None else "bodies"
        return f"the shard of {what} {self._bounds[k]} to {self._bounds[k + 1] - 1} failed: "

    def _look(self) -> None:
        """Show the mean progress of the shards, and now and then the frames that all of them have."""
        until, now = self._task.options.times.until, time.monotonic()
        for sentence in self._fleet.new_sentences():
            self._show.compiling(f"{sentence}, on a worker")
        if now - self._read >= max(_FOLLOWS, self._reading / _READING):
            self._follow()
            self._read = time.monotonic()
            self._reading = self._read - now
        self._show.within(until * (self._done + sum(self._fleet.shares.values())) / self._count, until)

    def _follow(self) -> None:
        """Show the frames that all shards have so far."""
        if not self._task.options.progress:
            return  # reading them would take time from workers of this machine
        until = self._task.options.times.until
        for count, seen, particles in joined.seen_of(self._folder, self._task, self._bounds, self._seen):
            self._show.frame(Frame(self._seen, seen["time"], until, seen, count, particles))
            self._seen += 1


# --- On a worker -----------------------------------------------------------------------------------------


def run_shard(reporter: Reporter, folder: Path, k: int) -> JobEnd:
    """Run shard k of a folder."""
    if shards.end_of(folder, k).exists():
        return {}
    task = shards.task_of(folder, k)
    target = task.options.trajectory
    resumes = paths.checkpoint_of(target).exists()
    options = dataclasses.replace(
        task.options, progress=reporter.display(), resume=resumes, overwrite=not resumes, threads=1
    )
    with session_of(options, reporter.token) as session:
        # The system of a worker that died may still hold the lock.
        with only_writer(target, patience=PATIENCE):
            pass
        end = machine.carry_out_task(dataclasses.replace(task, options=options), session)
        shards.write_end(shards.end_of(folder, k), end)
    return {}
