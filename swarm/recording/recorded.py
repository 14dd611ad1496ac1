"""A trajectory as a recording, made after its run."""

from pathlib import Path
from typing import Any

import numpy as np

from ..files import marks
from ..files.replaced import named_when_whole
from .writer import RecordingWriter, Settings

_AT_ONCE = 10  # frames of the trajectory


def show(trajectory: Any, particles: int, color: str, megabytes: float) -> None:
    """Show a `Trajectory` in a window on this machine; see `Trajectory.show`."""
    record(trajectory, None, Settings(particles, color, megabytes, live=True))


def record(trajectory: Any, path: Path | None, settings: Settings, overwrite: bool = False) -> Any:
    """Make the recording of a `Trajectory`; return its stream.

    Raises:
        SceneError: the target exists, or the trajectory is damaged, or has no frame.
        FileError: the recording cannot be written.
    """
    if path is None:
        return _record(trajectory, None, None, settings, overwrite)
    marks.check_target(path, overwrite, "recording")
    # A part of a recording would look like a complete one, and the older file stays until the new one is complete.
    with named_when_whole(path) as part:
        return _record(trajectory, path, part, settings, overwrite)


def _record(trajectory: Any, path: Path | None, part: Path | None, settings: Settings, overwrite: bool) -> Any:
    frames, start, times = len(trajectory), trajectory.frame(0), trajectory.times
    seen = trajectory.observed()
    scene, method, body = trajectory.scene, trajectory.method, trajectory.body
    writer = RecordingWriter(path, overwrite, scene, method, start, frames, settings, body)
    writer.count, writer.numbers, writer.file = trajectory.count, trajectory.ids, part
    if np.isnan(start.position[0]).all():
        # All particles come during the run.
        writer.colour_by(trajectory.frame(frames - 1))
    with writer as write:
        for first in range(0, frames, _AT_ONCE):
            numbers = range(first, min(first + _AT_ONCE, frames))
            here = ({name: values[k] for name, values in seen.items()} for k in numbers)
            write([(k, times[k], trajectory.frame(k), some) for k, some in zip(numbers, here, strict=True)])  # type: ignore[misc]
    return writer.stream
