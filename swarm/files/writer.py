"""Trajectories are written: frames are appended, their times last. The number of times is that of complete frames."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import tomli_w
from numpy.typing import DTypeLike, NDArray

from ..common.frames import ROWS
from ..methods import Method
from ..particles import Particles, TiedParticles
from ..scene import Scene
from ..serialization import tables
from ..state import State
from ..views import view
from . import checksums, layout, paths
from .appended import AppendedFile, put
from .provenance import Course, makers
from .storage import Storage

# Frames x particles of a chunk: a particle's path and a frame are both read with few chunks.
_CHUNK = (10, 1000)
# The chunk cache of positions holds the chunks of one frame, up to this number of bytes; the cache of an observable
# holds its last chunk.
_LARGEST_CACHE = 1 << 28
# The largest number of bytes of a chunk of an observable: a shard has one with an entry for each of its chunks.
_MOST_BYTES = 1 << 20
_PACKED: dict[str, dict[str, Any]] = {
    "none": {},
    "gzip": {"compression": "gzip", "compression_opts": 1, "shuffle": True},
    "lzf": {"compression": "lzf", "shuffle": True},
}

# The growing datasets that are neither of particles nor observables.
_STEP, _TIME, _WALL_TIME = "parameters/frame", "parameters/time", "parameters/wall_time"
_EDGES = "particles/all/box/edges/value"

# A dataset of particles: its name, its shape for one particle, its type.
Column = tuple[str, tuple[int, ...], Any]


def columns_of(scene: Scene, particles: Particles, storage: Storage) -> list[Column]:
    """The datasets of the particles of a run, which have a row for each frame."""
    laws, births = scene.compiled().laws, particles.births
    kept: list[Column] = [(name, (3,), storage.precision) for name in layout.PARTS]
    kept += [(layout.IMAGES, (3,), np.int64)] * (scene.period is not None)
    kept += [(layout.COUNTS, (), np.int64), *[(layout.ESCAPES, (), np.float64)] * bool(scene.pieces.open_volumes())]
    kept += [(layout.ABSORBED, (), np.float64)] * (laws is not None and laws.may_end)
    kept += [(layout.BORN, (), np.float64)] * (births is not None and bool(births.balls))
    kept += [(layout.COLLISIONS, (), np.int64)] * (particles.radius is not None)
    return kept + [(layout.SPINS, (3,), storage.precision)] * (particles.spin is not None)


def size_of(scene: Scene, particles: Particles, storage: Storage, frames: int) -> int:
    """Bytes of the particles of a run in its trajectory, without compression: whole chunks of frames."""
    row = sum(
        int(np.prod(width)) * np.dtype(kind).itemsize for _name, width, kind in columns_of(scene, particles, storage)
    )
    n = len(range(len(particles))[storage.kept()])
    return (-(-frames // _CHUNK[0]) * _CHUNK[0] * row + 2 * np.dtype(np.int64).itemsize) * n


# Number, time [s], positions, velocities and impacts, observables.
Written = tuple[int, float, State, dict[str, Any]]
WriteFrames = Callable[[list[Written]], None]


class TrajectoryWriter(AppendedFile):
    """A context that creates the file, or reopens it, and returns the function that writes frames.

    Frame k is row k, so a resumed run leaves no gap and no duplicate. Several frames at once take little longer than
    one: the time goes into the twenty datasets and the flush. The file gets its name when its first frame is complete;
    until then an existing file of that name, and its checkpoint, stay.
    """

    def __init__(
        self,
        path: Path,
        storage: Storage,
        scene: Scene,
        method: Method,
        particles: Particles | TiedParticles,
        scene_text: str | None,
        identity: dict[str, Any],
        following: bool = False,
    ) -> None:
        super().__init__(path, "trajectory", following)
        self._storage, self._scene, self._method = storage, scene, method
        self._bodies = None if isinstance(particles, Particles) else particles
        particles = particles if isinstance(particles, Particles) else particles.particles()
        self._kept = storage.kept(identity.get("first", 0))
        self._count, self._mass, self._text = len(particles), particles.mass[self._kept], scene_text
        self._identity, self._births = identity, particles.births
        # The end, the threads and the clock of the run, set before the context begins.
        self.course: Course | None = None
        self._wall_time: Any = None
        self._radius = particles.radius
        # The volume of points is not written, and its computation would be wasted.
        self._volume = None if particles.radius is None else particles.volume
        self._columns = columns_of(scene, particles, storage)
        self._edges: Any = None
        # None for a file of an older version.
        self._sums: checksums.RowSums | None = None

    def __enter__(self) -> WriteFrames:
        with self._beginning():
            if self._following:
                self._find()
            else:
                self._create()
        return self._write

    def _create(self) -> None:
        file = self._file
        h5md = file.create_group("h5md")
        h5md.attrs["version"] = np.array([1, 1], dtype=np.int32)
        h5md.create_group("author").attrs["name"] = "swarm"
        creator = h5md.create_group("creator")
        creator.attrs.update(makers())
        parameters = file.create_group("parameters")
        arrays: dict[str, Any] = {}
        texts = descriptions(self._scene, self._method, self._storage, arrays)
        long = {f"{layout.ARRAYS}/{name}": values for name, values in arrays.items()}
        for name, value in {**texts, **long, "particles": self._count, **self._identity}.items():
            parameters[name] = value
        self._describe(parameters)
        self._step, self._time = (
            parameters.create_dataset(name, (0,), kind, maxshape=(None,), chunks=(ROWS,))
            for name, kind in (("frame", np.int64), ("time", np.float64))
        )
        if self.course is not None:
            parameters["until"], parameters["threads"] = self.course.until, self.course.threads
            self._wall_time = parameters.create_dataset("wall_time", (0,), np.float64, maxshape=(None,), chunks=(ROWS,))
        self._values: dict[str, Any] = {}
        self._observables: dict[str, Any] = {}
        n = len(self._mass)
        if n == 0:
            return
        everything = file.create_group("particles/all")
        box = everything.create_group("box")
        repeats = self._scene.period
        box.attrs["dimension"] = 3
        box.attrs["boundary"] = ["periodic" if length else "none" for length in repeats or (None,) * 3]
        if repeats is not None:
            self._edges = self._element("particles/all/box/edges", (3,), np.float64, (ROWS, 3))
        everything["mass"] = self._mass
        everything["mass"].attrs[layout.UNIT] = layout.UNITS["mass"]
        self._time.attrs[layout.UNIT] = layout.UNITS["time"]
        everything["id"] = np.arange(self._count)[self._kept]
        if self._births is not None:
            if not self._births.balls:
                everything[layout.BIRTHS[0]] = self._births.time[self._kept]
            everything[layout.BIRTHS[1]] = self._births.source[self._kept]
        if self._radius is not None:
            everything[layout.RADII] = self._radius[self._kept]
        if self._bodies is not None:
            bonds = file.create_dataset("connectivity/bonds", data=self._bodies.bonds())
            bonds.attrs["particles_group"] = everything.ref
        for name, width, kind in self._columns:
            self._make_particles(name, (n, *width), kind)

    def _describe(self, parameters: Any) -> None:
        """Write the parameters that only some runs have."""
        if self._text is not None:
            parameters["scene_file"] = self._text
        if self._bodies is not None:
            parameters["body"] = tomli_w.dumps(view("bodies").table_of(self._bodies.body))
            parameters["copies"] = self._bodies.position.shape[2]
        if self._volume is not None:
            parameters["volume"] = self._volume

    def _make_particles(self, name: str, shape: tuple[int, ...], kind: Any) -> None:
        """Create the element of the particles of this name."""
        packed = _PACKED[self._storage.compression]
        # A compressed chunk is written once: one that grows is moved, and a kill during that would lose it.
        chunk = 1 if packed else _CHUNK[0], min(shape[0], _CHUNK[1]), *shape[1:]
        options = {**packed, "rdcc_nbytes": self._cache()}
        self._values[name] = self._element(f"particles/all/{name}", shape, kind, chunk, **options)
        if name in layout.UNITS:
            self._values[name].attrs[layout.UNIT] = layout.UNITS[name]

    def _find(self) -> None:
        parameters = self._file["parameters"]
        self._step, self._time = parameters["frame"], parameters["time"]
        self._wall_time = parameters.get("wall_time") if self.course is not None else None
        if self._wall_time is not None and self.course is not None:
            again = {"until": self.course.until, "threads": self.course.threads}
            checksums.replace(self._file, {f"parameters/{name}": value for name, value in again.items()})
        self._sums = checksums.RowSums.of(self._file)
        kept = [name for name in layout.KEPT if f"particles/all/{name}" in self._file]
        self._edges = self._file.get("particles/all/box/edges/value")
        groups = {"particles/all": kept, "observables": list(self._file["observables"])}
        self._values, self._observables = (
            {name: self._file[f"{group}/{name}/value"] for name in names} for group, names in groups.items()
        )
        access = h5py.h5p.create(h5py.h5p.DATASET_ACCESS)
        access.set_chunk_cache(*access.get_chunk_cache()[:1], self._cache(), 0.75)
        for name, dataset in self._values.items():
            self._values[name] = h5py.Dataset(h5py.h5d.open(self._file.id, dataset.name.encode(), access))
        self._begin()

    def _cache(self) -> int:
        """Bytes of the chunk cache of positions, of velocities, and of impacts, which need less."""
        chunks = -(-len(self._mass) // _CHUNK[1])
        return min(_LARGEST_CACHE, chunks * _CHUNK[0] * _CHUNK[1] * 24)

    def _element(self, name: str, shape: tuple[int, ...], kind: Any, chunks: tuple[int, ...], **options: Any) -> Any:
        """Create a time-dependent H5MD element."""
        group = self._file.create_group(name)
        group["step"], group["time"] = self._step, self._time
        # A scene without walls has empty data of walls, but a chunk must not be empty.
        most, chunks = tuple(length or None for length in shape), tuple(length or 1 for length in chunks)
        return group.create_dataset("value", (0, *shape), kind, maxshape=(None, *most), chunks=chunks, **options)

    def _make_observables(self, seen: dict[str, Any]) -> None:
        """Create the datasets of observables, which are known with the first frame, and of checksums, and begin."""
        for name in (name for name in seen if name != "time"):
            entry = np.asarray(seen[name])
            chunk = max(1, min(ROWS, _MOST_BYTES // max(1, entry.nbytes))), *entry.shape
            self._observables[name] = self._element(f"observables/{name}", entry.shape, entry.dtype, chunk)
        self._sums = checksums.RowSums.create(self._file, self._growing())
        self._begin()

    def _write(self, frames: list[Written]) -> None:
        with self._writing(f"frame {frames[0][0]}"):
            numbers, times, states, observed = zip(*frames, strict=True)
            first, seen = numbers[0], observed[0]
            if not self._observables:
                self._make_observables(seen)
            if self._sums is not None and self._sums.forget(first, len(frames)):
                # Cleared checksums are flushed first: a kill between an overwritten row and its checksum is harmless.
                self._file.flush()
            for name, dataset in self._values.items():
                parts = [getattr(state, name) for state in states]
                entries = parts if parts[0].ndim == 1 else rows(parts, dataset.dtype)
                self._put(f"particles/all/{name}/value", dataset, first, entries)
            if self._edges is not None:
                self._put(_EDGES, self._edges, first, [_edges_of(self._scene)] * len(frames))
            for name, dataset in self._observables.items():
                self._put(f"observables/{name}/value", dataset, first, [seen[name] for seen in observed])
            if self._wall_time is not None and self.course is not None:
                self._put(_WALL_TIME, self._wall_time, first, [self.course.clock()] * len(frames))
            if self._sums is not None:
                for name, dataset, column in ((_STEP, self._step, numbers), (_TIME, self._time, times)):
                    self._sums.add(name, np.array(column, dataset.dtype))
                self._sums.write(first)
            self._file.flush()
            put(self._step, first, numbers)
            put(self._time, first, times)
            self._flush()
            if self._is_new():
                self._take_name()

    def _growing(self) -> dict[str, tuple[int, int]]:
        """The growing datasets: the number of entries in their rows, and in the blocks with a checksum."""
        there = {_EDGES: self._edges, _WALL_TIME: self._wall_time}
        names = [_STEP, _TIME, *(name for name, dataset in there.items() if dataset is not None)]
        names += [f"observables/{name}/value" for name in self._observables]
        of_each = {f"particles/all/{name}/value": (len(self._mass), checksums.BLOCK) for name in self._values}
        return dict.fromkeys(names, (1, 0)) | of_each

    def _put(self, name: str, dataset: Any, first: int, values: Any) -> None:
        """Write rows of a dataset, and add their checksums."""
        entries = put(dataset, first, values)
        if self._sums is not None:
            self._sums.add(name, entries)

    def _take_name(self) -> None:
        """Take the name of the trajectory from an older file, and remove the older checkpoint."""
        self._rename()
        paths.checkpoint_of(self._path).unlink(missing_ok=True)


def rows(frames: list[NDArray[Any]], dtype: DTypeLike) -> NDArray[Any]:
    """Return frames in the order of the file, (frames, n, 3), from arrays (3, n).

    It copies one coordinate at a time: NumPy copies a transposed array along its rows of three, in 3.5 times the time.
    """
    out = np.empty((len(frames), frames[0].shape[1], 3), dtype)
    for row, frame in zip(out, frames, strict=True):
        for axis in range(3):
            row[:, axis] = frame[axis]
    return out


def _edges_of(scene: Scene) -> list[float]:
    """The lengths of the cell; in a direction without a period those of the volume or, if open, of the surfaces."""
    low, high = scene.bounds()
    return [
        length or (b - a if np.isfinite(b - a) else 2.0 * scene.extent())
        for length, a, b in zip(scene.period or (None,) * 3, low, high, strict=True)
    ]


def descriptions(
    scene: Scene, method: Method, storage: Storage, arrays: dict[str, Any] | None = None
) -> dict[str, str]:
    """The texts that identify a run; long arrays that the texts name are added to `arrays`."""
    return {
        "scene": tomli_w.dumps(tables.scene_table(scene, {} if arrays is None else arrays)),
        "method": tomli_w.dumps(tables.table_of(method)),
        "storage": tomli_w.dumps(vars(storage)),
    }
