"""The frames of a trajectory as a sequence that is read on demand."""

import functools
from collections.abc import Sequence
from typing import Any, overload

from ..common.catalog import Observables
from ..common.checks import shown
from ..common.frames import Frame
from ..common.snapshot import Snapshot
from ..errors import SceneError
from ..files.trajectory import Trajectory


class Frames(Sequence[Frame]):
    """The frames of a trajectory, with `len`, a frame by its number, a slice, and a loop over them.

    The particles of a frame are read when they are used, as long as the file exists.

    >>> import swarm, tempfile
    >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    >>> start = swarm.Particles([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     result = swarm.simulate(cavity, start, swarm.Impact(), until=1.0, trajectory=folder + "/run.h5")
    ...     [(frame.time, frame.velocity[0, 0].item(), frame.observables["impacts"]) for frame in result.frames]
    [(0.0, 1.0, 0), (1.0, -1.0, 1)]
    """

    def __init__(self, trajectory: Trajectory) -> None:
        self._trajectory = trajectory
        scene, self._seen = trajectory.scene, trajectory.observables
        self._gravity, self._period = scene.gravity, scene.period
        self._feeds = trajectory.has_particles() and trajectory.has_births()

    def __len__(self) -> int:
        return len(self._seen["time"])

    def __repr__(self) -> str:
        return f"Frames({len(self)} of {self._trajectory.path})"

    @overload
    def __getitem__(self, k: int) -> Frame: ...
    @overload
    def __getitem__(self, k: slice) -> list[Frame]: ...
    def __getitem__(self, k: int | slice) -> Frame | list[Frame]:
        if isinstance(k, slice):
            return [self._frame(i) for i in range(len(self))[k]]
        try:
            return self._frame(range(len(self))[k])
        except TypeError:
            raise SceneError(f"a frame must have a whole number, got {shown(k)}") from None

    def _frame(self, k: int) -> Frame:
        seen = {name: values[k] if values.ndim > 1 else values[k].item() for name, values in self._seen.items()}
        until = float(self._seen["time"][-1])
        there = self._trajectory.born(k) if self._feeds else None
        read = functools.partial(values_of, self._trajectory, k)
        arrays = Snapshot(read, self._gravity, self._period, there)
        return Frame(k, seen["time"], until, Observables(seen), len(self), arrays)


def values_of(trajectory: Trajectory, k: int, name: str) -> Any:
    """Return an array of the particles of frame k by its name, or None if they do not have it."""
    if name == "collisions" and trajectory.radius is None:
        return None
    read = {"impacts": trajectory.impacts, "escape_time": trajectory.escape_times,
            "absorbed_time": trajectory.absorbed_times, "collisions": trajectory.collisions}  # fmt: skip
    return read[name](k) if name in read else getattr(trajectory.frame(k), name)
