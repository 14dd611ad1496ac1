"""A session of a run: its start, its checkpoints, its end. A run may have several sessions."""

import contextlib
import dataclasses
import math
import os
import time
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from ..common.frames import FrameTimes
from ..errors import CompleteError, FileError, SceneError, WallTimeError
from ..files import checkpoint, marks, paths
from ..files.lock import only_writer
from ..kernel.cache import Spent
from ..serialization import run_tables
from ..version import VERSION
from ..views import view
from .base import BaseRun
from .impacts import Impacts
from .options import RunOptions, Task

if TYPE_CHECKING:
    from ..files.background import Background


class Session:
    """A session of a run, from the start or a checkpoint to the end, a signal or the wall time limit.

    A session locks the trajectory. Without a trajectory it saves nothing.

    Args:
        options: the options of the run.
        counted_from: the start of the wall time [s of time.monotonic]; None: now.
    """

    def __init__(self, options: RunOptions, counted_from: float | None = None) -> None:
        self._began = time.monotonic()
        counted_from = self._began if counted_from is None else counted_from
        self._saves, self._resumes = options.checkpoint is not None, options.resume
        self._every = math.inf if options.checkpoint is None else options.checkpoint
        self._end = math.inf if options.walltime is None else counted_from + options.walltime
        self._took = 0.0  # the time that the last checkpoint took [s]
        # A checkpoint half way to the limit measures this time.
        self._due = self._began + min(self._every, 0.5 * (self._end - self._began) if self._saves else math.inf)
        self._stops = False
        # The following are None in a run without a trajectory.
        self._trajectory: Any = options.trajectory
        self._path: Any = options.checkpoint_file()
        self._job: Any = None
        # The entries that identify the run in its files, besides its texts.
        self.identity: dict[str, Any] = {}
        self._arrays: checkpoint.Arrays | None = None
        self._is_under_way = self._has_checkpoint = False
        self._held = contextlib.ExitStack()
        self._log: Impacts | None = None
        # The time that the session has spent in compilations.
        self.compiled = Spent()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._held.close()
        if isinstance(error, FileError) and self._is_under_way:
            raise FileError(f"{error}{self._way_on()}") from error

    def _way_on(self) -> str:
        """Return the end of a sentence on how to go on after a run could not write its files."""
        if self._has_checkpoint:
            return f"; with resume the run goes on from {self._path}"
        if not self._saves:
            return ""
        return (
            "; no checkpoint was saved before, so the run cannot be resumed: start a new run from the last frame of "
            "its trajectory (from = in [particles]), or start again, with overwrite and without resume"
        )

    @property
    def first(self) -> int:
        """The first frame that this session writes."""
        return 0 if self._arrays is None else int(self._job.frame) + 1

    def prepare(self, task: Task, log: Impacts | None) -> None:
        """Find the start of this session: 0 s with a new file or, to resume, the checkpoint if it exists.

        Raises:
            SceneError: the trajectory cannot become a new file; or the trajectory or the checkpoint is of another run,
                damaged or missing.
            CompleteError: nothing is left to do.
            FileError: another run writes the trajectory.
        """
        if self._trajectory is None and log is None:
            return
        self._hold(task, log)
        if self._trajectory is None or not self._resumes:
            return
        overwrite, until = task.options.overwrite, task.options.until
        if self._path.exists():
            self._resume(until)
        elif self._trajectory.exists():
            self._refuse_to_restart(until, overwrite)
        if log is not None:
            self._find_log(task, overwrite)

    def _hold(self, task: Task, log: Impacts | None) -> None:
        """Lock the files of the run, and describe it."""
        import tomli_w

        from ..files.writer import descriptions

        overwrite, impacts = task.options.overwrite, task.options.impacts
        self._owners = task.compiled.numbering.members
        body = "" if task.bodies is None else tomli_w.dumps(view("bodies").table_of(task.bodies.body))
        self.identity = {"start": task.start or checkpoint.digest_of(task.particles, body), "seed": task.options.seed}
        self.identity |= {"first": task.first} if task.is_shard else {}
        self.identity |= {"observables": ", ".join(task.options.observables)} if task.options.observables else {}
        if task.options.counters:
            self.identity["counters"] = run_tables.counters_text(task.options.counters)
        self._log = log
        if log is not None:
            self._check(impacts, overwrite, "impacts")
            self._held.enter_context(only_writer(impacts, "log of impacts"))
        if self._trajectory is None:
            return
        self._check(self._trajectory, overwrite, "trajectory")
        self._held.enter_context(only_writer(self._trajectory))
        if not self._resumes and os.path.lexists(self._path) and not checkpoint.is_one(self._path):
            raise SceneError(
                f"{self._path} must be a checkpoint of swarm, or not be there, got another file, which a run would "
                "replace; move it away, or choose another name for the trajectory"
            )
        texts: dict[str, Any] = {**descriptions(task.scene, task.method, task.options.storage)}
        texts["kept"], texts["member_impacts"] = "" if log is None else log.kept, task.options.member_impacts
        self._job = checkpoint.SavedRun(VERSION, **texts, particles=len(task.particles), **self.identity)

    def _check(self, path: Path, overwrite: bool, what: str) -> None:
        """Raise a `SceneError` if the session cannot write a file, or may not replace it."""
        if self._resumes and (not overwrite or self._path.exists()):
            paths.check_place(path, what)  # a resumed session appends to the file
        else:
            marks.check_target(path, overwrite, what)

    def _find_log(self, task: Task, overwrite: bool) -> None:
        """Raise a `SceneError` if the run can neither go on with its log of impacts nor begin it anew."""
        path: Path = task.options.impacts
        if self.first == 0 and (overwrite or not path.exists()):
            return
        from ..files.impact_log import load_impacts

        with load_impacts(path) as before:
            there = dataclasses.replace(self._job, **before.identity)
            there.require_same(dataclasses.replace(self._job, particles=task.count), path)
            if self.first == 0:
                return  # the run was killed before the first frame of the trajectory
            before.require_holds(self._job.frame + 1, self._job.rows, self._job.sums, self._path)
            before.require_intact()

    def _refuse_to_restart(self, until: float, overwrite: bool) -> None:
        """Raise the error for a trajectory without a checkpoint: complete, of another run, or in the way.

        With `overwrite` only a complete trajectory is an error, as a repeated job has nothing to do.
        """
        try:
            self._refuse(until)
        except SceneError as error:
            if not overwrite or isinstance(error, CompleteError):
                raise

    def _refuse(self, until: float) -> None:
        from ..files.trajectory import load

        trajectory = self._trajectory
        with load(trajectory) as before:
            texts: dict[str, Any] = before.descriptions
            identity: dict[str, Any] = {"particles": before.count, "start": before.start, "seed": before.seed}
            identity["observables"] = ", ".join(before.own_observables)
            identity["counters"] = before.counters_text
            there = dataclasses.replace(self._job, **texts, **identity)
            frames, last = len(before), before.times[-1:]
        if not there.start:
            raise SceneError(
                f"{trajectory} must have the digest of its start, to be resumed or found complete, got one of a "
                "version that did not store it; choose another name, or overwrite it with --overwrite"
            )
        there.require_same(self._job, trajectory)
        if frames and last[0] >= until:
            raise CompleteError(f"{trajectory} is complete: its last frame is at {last[0]:g} s")
        raise SceneError(
            f"{self._path} must be there to resume from, got none: the run would begin again at 0 s and replace the "
            f"{frames} frames of {trajectory}; to do so, overwrite it with --overwrite"
        )

    def _resume(self, until: float) -> None:
        from ..files.trajectory import load

        trajectory = self._trajectory
        saved, arrays = checkpoint.read(self._path)
        if checkpoint.SHARDS in arrays:
            raise SceneError(f"{self._path} is of a run on a cluster; resume it on one, by cluster= or --cluster")
        saved.require_same(self._job, self._path)
        checkpoint.require_owners(self._path, arrays, self._owners)
        if not trajectory.exists():
            raise SceneError(
                f"{self._path} needs its trajectory {trajectory}, which does not exist; start again without resume"
            )
        with load(trajectory) as before:
            before.require_index()
            if len(before) <= saved.frame:
                raise SceneError(
                    f"{trajectory} must hold {saved.frame + 1} frames, as {self._path} says, got {len(before)}: it was "
                    "changed since; remove both to start again"
                )
            before.require_intact(saved.frame + 1)
        if saved.time >= until:
            raise SceneError(f"until must be after the time of {self._path}, {saved.time:g} s, got {until:g} s")
        self._job, self._arrays = saved, arrays

    def restore(self, run: BaseRun) -> None:
        """Set the run to the state of the checkpoint."""
        if self._arrays is not None:
            checkpoint.require_fit(self._path, self._arrays, run.arrays(), self._job.version, run.may_grow)
            if self._log is not None:
                self._log.total = self._job.rows
            run.restore(self._arrays, self._job.following is not None)
            # The arrays are freed; `_arrays` is still not None, as this session is a resumed one.
            self._arrays = {}
        self._is_under_way, self._has_checkpoint = True, self._arrays is not None

    def frames(self, times: FrameTimes) -> Iterator[tuple[int, float, float]]:
        """Yield the frames of this session: number, the time of the frame before, and the time [s].

        Raises:
            SceneError: a frame of the checkpoint was, or would be, at another time.
        """
        job = self._job
        for number, before, moment in times:
            if self._arrays is not None:
                for frame, saved in ((job.frame, job.time), (job.frame + 1, job.following)):
                    if number == frame and saved is not None and saved != moment:
                        raise SceneError(
                            f"{self._path} is of another run: its frame {number} is at {saved:g} s, got {moment:g} s; "
                            "leave until and every as they were, or make until later"
                        )
            if number >= self.first:
                yield number, before, moment

    def latest(self, writer: "Background | None") -> float:
        """Return the time at which `look` is due [s of time.monotonic]."""
        return min(self._due, self._last_call(writer))

    def _last_call(self, writer: "Background | None") -> float:
        """Return the latest time to stop, to write the queue and a checkpoint by the limit [s of time.monotonic]."""
        return self._end - self._took - (0.0 if writer is None else writer.backlog())

    def stop(self) -> None:
        """End the session at the next `look`."""
        self._stops = True

    def wall_time(self) -> float:
        """Return the wall time of all sessions of the run [s]."""
        before: float = 0.0 if self._job is None else self._job.wall_time
        return time.monotonic() - self._began + before

    def look(
        self, run: BaseRun, writer: "Background | None", frame: int, moment: float, following: float | None
    ) -> None:
        """Save a checkpoint if it is due, and end if it is time: after `frame`, or within the frame at `following`.

        Raises:
            KeyboardInterrupt: `stop` was called.
            WallTimeError: the wall time limit is reached.
            FileError: the checkpoint cannot be written.
        """
        now = time.monotonic()
        stops = self._stops or now >= self._last_call(writer)
        if self._saves and (stops or now >= self._due):
            self._save(run, writer, frame, moment, following)
            saved = time.monotonic()
            self._due, self._took = saved + self._every, saved - now
        if self._stops:
            raise KeyboardInterrupt
        if stops:
            began, ended = self.compiled.latest
            late = ended - self._end if began < self._end < ended else 0.0
            raise WallTimeError(f"the wall time of this run is over at {moment:g} s", late)

    def _save(self, run: BaseRun, writer: Any, frame: int, moment: float, following: float | None) -> None:
        # Frames are written first, so that a checkpoint is never ahead of them.
        writer.drain()
        job = dataclasses.replace(
            self._job, frame=frame, time=moment, following=following, wall_time=self.wall_time(),
            rows=0 if self._log is None else self._log.total, sums="" if self._log is None else self._log.sums(),
        )  # fmt: skip
        checkpoint.save(self._path, job, run.arrays(), self._owners)
        self._has_checkpoint = True

    def finish(self) -> None:
        """Remove the checkpoint, as all frames are written."""
        if self._path is not None and (self._saves or self._arrays is not None):
            self._path.unlink(missing_ok=True)
