"""One session of a run on a cluster: its shards are those of its first session."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import SceneError
from ..files import checkpoint, paths
from ..run.options import Task
from ..run.session import Session
from . import shards


class Sharded(Session):
    """As `Session`; its checkpoint holds the bounds of the shards, which have checkpoints of their own."""

    # Those of the session before, or of this one once it has begun.
    _bounds: Any = None

    def prepare_shards(self, task: Task) -> None:
        """Find where this session starts, as `Session.prepare`.

        Raises:
            SceneError, CompleteError, FileError: as there.
        """
        self._hold(task, None)
        self._times = np.array([task.options.times.until, task.options.times.every])
        if self._resumes and self._path.exists():
            self._find_shards()
        elif task.options.overwrite:
            return
        elif self._resumes and self._trajectory.exists():
            self._refuse_to_restart(task.options.until)
        elif (folder := shards.folder_of(self._trajectory)).exists():
            raise SceneError(
                f"{folder} holds the shards of another run; resume that with --resume, choose another name for the "
                "trajectory, or overwrite it (--overwrite, overwrite=True)"
            )

    def _find_shards(self) -> None:
        path, (saved, arrays) = self._path, checkpoint.read(self._path)
        if checkpoint.SHARDS not in arrays:
            raise SceneError(f"{path} is of a run without a cluster; resume it without one")
        saved.require_same(self._job, path)
        # Sums that the shards have written have rows of walls too.
        checkpoint.require_owners(path, arrays, self._owners)
        if (was := arrays["times"]).tolist() != self._times.tolist():
            raise SceneError(
                f"{path} is of a run with until = {was[0]:g} s and every = {was[1]:g} s, got {self._times[0]:g} and "
                f"{self._times[1]:g} s; leave them as they were"
            )
        self._bounds, self._job = arrays[checkpoint.SHARDS].tolist(), saved

    @property
    def end(self) -> float:
        """When the wall time limit is reached [s of time.monotonic]."""
        return self._end

    def begin(self, task: Task, count: int) -> tuple[Path, list[int]]:
        """The folder of the shards and their bounds, those of the session before or so many new ones."""
        folder = shards.folder_of(self._trajectory)
        if self._bounds is None:
            self._bounds = shards.bounds_of(task.count, count)
            shards.clear(folder)
            self._trajectory.unlink(missing_ok=True)
            self.keep(0, 0.0)
        shards.prepare(folder, task, self._bounds, self.identity["start"])
        return folder, self._bounds

    def keep(self, frame: int, moment: float) -> None:
        """Save what a later session needs besides the checkpoints of the shards."""
        job = dataclasses.replace(self._job, frame=frame, time=moment, wall_time=self.wall_time())
        checkpoint.save(
            self._path, job, {checkpoint.SHARDS: np.array(self._bounds), "times": self._times}, self._owners
        )

    def finish(self) -> None:
        """Remove what only an unfinished run needs."""
        paths.checkpoint_of(self._trajectory).unlink(missing_ok=True)
        shards.tidy(shards.folder_of(self._trajectory), len(self._bounds) - 1)
