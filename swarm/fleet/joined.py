"""The trajectory of all shards: their particles by HDF5's virtual datasets, their observables added up.

It is read like the trajectory of one run. It names the shards relative to itself: they can be moved together.
"""

import functools
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import observables
from ..bodies import energies
from ..bodies.numbers import own_surfaces
from ..common.catalog import CHUNK_SUMS, OBSERVABLES
from ..common.snapshot import Snapshot
from ..files.layout import UNIT, UNITS
from ..files.trajectory import Trajectory, load
from ..files.writer import TrajectoryWriter
from ..lanes.lane_arrays import booked
from ..run.machine import Columns
from ..run.measures import NONE, Measures
from ..run.options import Task
from ..run.present import total_of
from ..run.sequence import values_of
from ..run.tally import OBSERVED, units_of, value_of
from . import shards

# Frames that are read at a time.
_AT_ONCE = 256


def seen_of(
    folder: Path, task: Task, bounds: list[int], first: int = 0
) -> Iterator[tuple[int, dict[str, Any], Snapshot]]:
    """The frames that every shard holds, from number `first` on: their count so far, observables and particles."""
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
                read = functools.partial(_gathered, of_shards, task, begin + k)
                moment, births = float(times[begin + k]), task.particles.births
                there: Any = None if births is None else births.there(moment)
                if births is not None and births.balls:
                    there = np.concatenate([one.born(begin + k) for one in of_shards])
                particles = Snapshot(read, task.scene.gravity, task.scene.period, there)
                yield len(times), {"time": moment, **joined}, particles
                particles.end()
    finally:
        for one in of_shards:
            one.close()


def _gathered(of_shards: list[Trajectory], task: Task, k: int, name: str) -> Any:
    """An array of the particles of frame k, gathered from all shards."""
    if name == "mass":
        return task.particles.mass
    parts = [values_of(one, k, name) for one in of_shards]
    if any(part is None for part in parts):
        return None
    # For bodies, point p of copy i is particle p n + i.
    points = 1 if task.bodies is None else len(task.bodies.body)
    apart = [part.reshape(*part.shape[:-1], points, -1) for part in parts]
    joined = np.concatenate(apart, axis=-1)
    return joined.reshape(*joined.shape[:-2], -1)


def _joined(task: Task, parts: list[dict[str, Any]]) -> dict[str, Any]:
    """The observables of a frame, from those of all shards."""
    seen = parts[0] if task.is_coupled else _added(task, parts)
    if task.options.member_impacts:
        units = units_of(task)._asdict().items()
        seen |= {OBSERVED[name]: value_of(seen[OBSERVED[name]], unit) for name, unit in units if unit is not None}
    return seen


def _added(task: Task, parts: list[dict[str, Any]]) -> dict[str, Any]:
    """The sums of the observables of shards with independent particles."""
    sums, owners = np.hstack([part[CHUNK_SUMS] for part in parts]), task.compiled.numbering.surfaces_of_rows
    brought = {}
    if task.particles.births is not None:
        sums, brought = sums[:-1], total_of(sums)
    laws = task.compiled.laws
    has_heat = laws is not None and laws.give_heat
    if task.bodies is None:
        rows, of_parts = booked(task.compiled.walls()), task.compiled.numbering.parts_of_rows
        added = observables.summed(sums, owners, rows, has_heat, of_parts, len(task.options.counters))
    else:
        body = task.bodies.body
        own = len(own_surfaces(body)), len(body.cavities), has_heat
        added = energies.summed(sums, owners, len(task.scene.surfaces), own, len(task.options.counters))
    added |= brought
    seen: dict[str, Any] = {}
    # In the order of a run on one machine.
    for name in (name for name in parts[0] if name != CHUNK_SUMS):
        if name in added:
            seen[name] = added[name]
            continue
        values, joined = [part[name] for part in parts], OBSERVABLES[name].joined
        if joined == "same":
            seen[name] = values[0]
        elif joined == "largest":
            seen[name] = max(values).item()
        else:  # whole numbers, which add up exactly
            total = np.sum(values, axis=0)
            seen[name] = total if total.ndim else int(total)
    return seen


class JoinedWriter(TrajectoryWriter):
    """A writer for particles that are in the shards; it writes all other data.

    Its file gets its name when it is complete: after a kill, a later session would take a part of the frames for a run
    that cannot be resumed. The checkpoint, which holds the shards, is left to the session.
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
        """Do nothing: the file gets its name when it is complete."""

    def _make_particles(self, name: str, shape: tuple[int, ...], kind: Any) -> None:
        import h5py

        width = shape[1:]
        copies = self._bounds[-1]
        source = f"particles/all/{name}/value"
        layout = h5py.VirtualLayout((self._frames, *shape), np.dtype(kind), maxshape=(None, *shape))
        kept = np.arange(self._count)[self._kept]
        for k, (first, last) in enumerate(itertools.pairwise(self._bounds)):
            points = self._count // copies
            # For bodies, point p of copy i is particle p n + i.
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
        values = group.create_virtual_dataset("value", layout)
        if name in UNITS:
            values.attrs[UNIT] = UNITS[name]


def _measured(
    seen: Iterator[tuple[int, dict[str, Any], Snapshot]], measures: Measures
) -> Iterator[tuple[int, dict[str, Any]]]:
    """The frames, with the values of the user-defined observables added."""
    for k, (frames, one, particles) in enumerate(seen):
        yield frames, one | measures.of(k, one["time"], particles)


def join(
    folder: Path, task: Task, bounds: list[int], identity: dict[str, Any], measures: Measures = NONE
) -> dict[str, NDArray[Any]]:
    """Replace an earlier file by the frames that every shard holds, and return their observables.

    The user-defined observables are among them. Without such frames no file is written.

    Raises:
        RunError: a user-defined observable fails.
    """
    seen, kept = _measured(seen_of(folder, task, bounds), measures), Columns()
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
