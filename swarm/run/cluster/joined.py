"""The trajectory of all shards: their particles by HDF5's virtual datasets, their observables added up.

It is read as that of one run. The shards are named relative to it: it can be moved together with their folder.
"""

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import observables
from ...lanes.arrays import booked
from ...output.trajectory import load
from ...output.writer import TrajectoryWriter
from .. import energies
from ..machine import CHUNK_SUMS, Columns
from ..options import Task
from . import shards

# The largest value of any shard is that of all; the other observables, whole numbers, add up exactly.
_LARGEST = ("energy_error", "max_penetration", "link_error")
# The same of every shard.
_COMMON = ("wall_position", "wall_orientation")
# Frames that are read at a time.
_AT_ONCE = 256


def seen_of(folder: Path, task: Task, bounds: list[int], first: int = 0) -> Iterator[tuple[int, dict[str, Any]]]:
    """The frames that every shard holds, from number `first` on: how many there are, and the observables of each."""
    files = [shards.file_of(folder, k) for k in range(len(bounds) - 1)]
    if not all(file.exists() for file in files):
        return
    of_shards = [load(file) for file in files]
    try:
        times = min((one.times for one in of_shards), key=len)
        for begin in range(first, len(times), _AT_ONCE):
            some = slice(begin, min(begin + _AT_ONCE, len(times)))
            parts = [one.observables_of(some) for one in of_shards]
            for k in range(some.stop - begin):
                joined = _joined(task, [{name: values[k] for name, values in part.items()} for part in parts])
                yield len(times), {"time": float(times[begin + k]), **joined}
    finally:
        for one in of_shards:
            one.close()


def _joined(task: Task, parts: list[dict[str, Any]]) -> dict[str, Any]:
    """The observables of a frame, from those of all shards."""
    sums, owners = np.hstack([part[CHUNK_SUMS] for part in parts]), task.scene.owners()
    if task.bodies is None:
        laws = task.scene.laws()
        has_heat = laws is not None and laws.give_heat
        rows, of_parts = booked(task.scene.walls()), task.scene.parts_of_rows()
        added = observables.summed(sums, owners, rows, has_heat, of_parts, len(task.options.counters))
    else:
        added = energies.summed(sums, owners, len(task.scene.surfaces), len(task.bodies.body.cavities))
    seen: dict[str, Any] = {}
    # In the order of a run on one machine.
    for name in (name for name in parts[0] if name != CHUNK_SUMS):
        if name in added:
            seen[name] = added[name]
        elif name in _COMMON:
            seen[name] = parts[0][name]
        else:
            values = [part[name] for part in parts]
            seen[name] = max(values).item() if name in _LARGEST else int(sum(values))
    return seen


class JoinedWriter(TrajectoryWriter):
    """A writer whose particles are those of the shards; it writes only what is not of particles.

    Its file takes its name when it is whole: to a session after a kill in between, a part of the frames would be a run
    that cannot go on. The checkpoint, which holds the shards, is left to the session.
    """

    def __init__(self, folder: Path, task: Task, bounds: list[int], frames: int, identity: dict[str, Any]) -> None:
        self._folder, self._bounds, self._frames = folder, bounds, frames
        super().__init__(
            task.options.trajectory, task.options.storage, task.scene, task.method, task.bodies or task.particles,
            task.options.scene_text, identity,
        )  # fmt: skip

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if error is None:
            self.sync()
            self._rename()
        super().__exit__(kind, error, trace)

    def _take_name(self) -> None:
        """Not yet."""

    def _make_particles(self, name: str, shape: tuple[int, ...], kind: Any) -> None:
        import h5py

        width = shape[1:]
        copies = self._bounds[-1]
        source = f"particles/all/{name}/value"
        layout = h5py.VirtualLayout((self._frames, *shape), np.dtype(kind), maxshape=(None, *shape))
        kept = np.arange(self._count)[self._kept]
        for k, (first, last) in enumerate(itertools.pairwise(self._bounds)):
            points = self._count // copies
            # Of bodies point p of copy i is particle p n + i.
            for p in range(points):
                begin, end = np.searchsorted(kept, [p * copies + first, p * copies + last])
                if begin == end:
                    continue
                some = int(end - begin)
                part = h5py.VirtualSource(
                    f"{self._folder.name}/{shards.file_of(self._folder, k).name}", source,
                    (self._frames, points * some, *width), np.dtype(kind), (None, points * some, *width),
                )  # fmt: skip
                layout[:, begin:end] = part[: self._frames, p * some : (p + 1) * some]
        group = self._file.create_group(f"particles/all/{name}")
        group["step"], group["time"] = self._step, self._time
        group.create_virtual_dataset("value", layout)


def join(folder: Path, task: Task, bounds: list[int], identity: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Write the frames that every shard holds in place of an earlier file: their observables.

    If there is none nothing is written.
    """
    seen, kept = seen_of(folder, task, bounds), Columns()
    head = list(itertools.islice(seen, 1))
    if head:
        with JoinedWriter(folder, task, bounds, head[0][0], identity) as put:
            nothing: Any = None
            numbered = enumerate(one for _frames, one in itertools.chain(head, seen))
            while some := list(itertools.islice(numbered, _AT_ONCE)):
                put([(k, one["time"], nothing, one) for k, one in some])
                for _k, one in some:
                    kept.add(one)
    return kept.arrays()
