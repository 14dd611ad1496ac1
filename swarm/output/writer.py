"""Writing trajectories: frames are appended so that a kill at any moment leaves a readable file.

The order of the writes ensures that: HDF5's mode for one writer and many readers (SWMR), and the times last. There are
as many complete frames as times.
"""

import os
import re
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
import tomli_w
from numpy.typing import DTypeLike, NDArray

from .. import tables
from ..errors import FileError
from ..methods import Method
from ..particles import Particles, State
from ..scene import Scene
from ..version import VERSION
from . import paths, superblock
from .layout import ARRAYS, COUNTS, IMAGES, PARTS
from .storage import Storage

if TYPE_CHECKING:
    from ..bodies.body import Body
    from ..bodies.state import Bodies

# Frames x particles of a chunk: a particle's path and a frame are both read with few chunks.
_CHUNK = (10, 1000)
# The chunk cache of positions holds the chunks of one frame, up to this many bytes; that of an observable its last
# chunks. HDF5's default, 1 MB, would fill during 100 000 frames, which looks like a memory leak.
_LARGEST_CACHE, _SMALL_CACHE = 1 << 28, 1 << 16
# The oldest format with SWMR.
_FORMAT = ("v110", "v110")
_PACKED: dict[str, dict[str, Any]] = {
    "none": {},
    "gzip": {"compression": "gzip", "compression_opts": 1, "shuffle": True},
    "lzf": {"compression": "lzf", "shuffle": True},
}

# Number, time [s], positions, velocities and impacts, observables.
Written = tuple[int, float, State, dict[str, Any]]
WriteFrames = Callable[[list[Written]], None]


class TrajectoryWriter:
    """A context that creates the file, or reopens it, and gives the function that writes frames.

    Frame k is row k, so a resumed run leaves no gap and no duplicate. Several frames at once cost little more than one:
    the time goes into the twenty datasets and the flush. The file gets its name when its first frame is whole; until
    then an existing file of that name, and its checkpoint, stay.
    """

    def __init__(
        self,
        path: Path,
        storage: Storage,
        scene: Scene,
        method: Method,
        particles: "Particles | Bodies",
        scene_text: str | None,
        identity: dict[str, Any],
        following: bool = False,
    ) -> None:
        self._path, self._storage, self._scene, self._method = path, storage, scene, method
        self._bodies = None if isinstance(particles, Particles) else particles
        particles = particles if isinstance(particles, Particles) else particles.particles()
        self._count, self._mass, self._text = len(particles), particles.mass[storage.kept()], scene_text
        self._identity, self._following = identity, following
        self._part = path if following else paths.part_of(path)
        self._edges: Any = None

    def __enter__(self) -> WriteFrames:
        self._size, self._block = 0, b""
        try:
            if not self._following:
                self._part.touch()
            self._open_file("r+" if self._following else "w")
        except OSError as error:
            raise FileError(f"cannot write the trajectory {self._path}: {error}") from error
        if self._following:
            self._open()
        else:
            self._create()
        return self._write

    def _open_file(self, mode: str) -> None:
        self._handle = open(self._part, "r+b", buffering=0)  # noqa: SIM115  closed by __exit__
        if mode == "r+":
            superblock.make_appendable(self._handle)
        # HDF5's locks would block readers.
        self._file = h5py.File(self._part, mode, libver=_FORMAT, rdcc_nbytes=_SMALL_CACHE, locking=False)
        self._descriptor = _descriptor_of(self._file)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._file.close()
        except (OSError, RuntimeError) as problem:
            self._abandon()
            if error is None:
                raise FileError(f"cannot close the trajectory {self._path}: {_reason(problem)}") from problem
        finally:
            self._handle.close()
        if self._part != self._path:
            # Without a frame it is not a trajectory.
            self._part.unlink(missing_ok=True)

    def sync(self) -> None:
        """Flush to the disk what was written."""
        try:
            os.fsync(self._handle.fileno())
        except OSError as error:
            raise FileError(f"cannot write the trajectory {self._path}: {error}") from error

    def _create(self) -> None:
        file = self._file
        h5md = file.create_group("h5md")
        h5md.attrs["version"] = np.array([1, 1], dtype=np.int32)
        h5md.create_group("author").attrs["name"] = "swarm"
        creator = h5md.create_group("creator")
        creator.attrs["name"], creator.attrs["version"] = "swarm", VERSION
        parameters = file.create_group("parameters")
        arrays: dict[str, Any] = {}
        texts = descriptions(self._scene, self._method, self._storage, arrays)
        long = {f"{ARRAYS}/{name}": values for name, values in arrays.items()}
        for name, value in {**texts, **long, "particles": self._count, **self._identity}.items():
            parameters[name] = value
        if self._text is not None:
            parameters["scene_file"] = self._text
        if self._bodies is not None:
            parameters["body"], parameters["copies"] = body_text(self._bodies.body), len(self._bodies)
        self._step = parameters.create_dataset("frame", (0,), np.int64, maxshape=(None,), chunks=(1024,))
        self._time = parameters.create_dataset("time", (0,), np.float64, maxshape=(None,), chunks=(1024,))
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
            self._edges = self._element("particles/all/box/edges", (3,), np.float64, (1024, 3))
        everything["mass"] = self._mass
        everything["id"] = np.arange(self._count)[self._storage.kept()]
        if self._bodies is not None:
            bonds = file.create_dataset("connectivity/bonds", data=self._bodies.bonds())
            bonds.attrs["particles_group"] = everything.ref
        options = _PACKED[self._storage.compression]
        # A compressed chunk is written once: one that grows is moved, and a kill during that would lose it.
        deep = 1 if options else _CHUNK[0]
        options = {**options, "rdcc_nbytes": self._cache()}
        for name in PARTS:
            self._values[name] = self._element(
                f"particles/all/{name}", (n, 3), self._storage.precision, (deep, min(n, _CHUNK[1]), 3), **options,
            )  # fmt: skip
        if repeats is not None:
            self._values[IMAGES] = self._element(
                f"particles/all/{IMAGES}", (n, 3), np.int64, (deep, min(n, _CHUNK[1]), 3), **options
            )
        self._values[COUNTS] = self._element(
            f"particles/all/{COUNTS}", (n,), np.int64, (deep, min(n, _CHUNK[1])), **options
        )

    def _open(self) -> None:
        parameters = self._file["parameters"]
        self._step, self._time = parameters["frame"], parameters["time"]
        kept = [name for name in (*PARTS, IMAGES, COUNTS) if f"particles/all/{name}" in self._file]
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

    def _begin(self) -> None:
        """Switch to SWMR, after which nothing can be created."""
        self._file.swmr_mode = True
        self._flush()

    def _element(self, name: str, shape: tuple[int, ...], kind: Any, chunks: tuple[int, ...], **options: Any) -> Any:
        """A time-dependent H5MD element."""
        group = self._file.create_group(name)
        group["step"], group["time"] = self._step, self._time
        return group.create_dataset("value", (0, *shape), kind, maxshape=(None, *shape), chunks=chunks, **options)

    def _write(self, frames: list[Written]) -> None:
        try:
            self._require_file()
            first, seen = frames[0][0], frames[0][3]
            if not self._observables:
                for name in (name for name in seen if name != "time"):
                    entry = np.asarray(seen[name])
                    self._observables[name] = self._element(
                        f"observables/{name}", entry.shape, entry.dtype, (1024, *entry.shape)
                    )
                self._begin()
            for name, dataset in self._values.items():
                parts = [getattr(state, name) for _number, _moment, state, _seen in frames]
                _put(dataset, first, parts if name == COUNTS else rows(parts, dataset.dtype))
            if self._edges is not None:
                _put(self._edges, first, [_edges_of(self._scene)] * len(frames))
            for name, dataset in self._observables.items():
                _put(dataset, first, [seen[name] for _number, _moment, _state, seen in frames])
            self._file.flush()
            _put(self._step, first, [number for number, _moment, _state, _seen in frames])
            _put(self._time, first, [moment for _number, moment, _state, _seen in frames])
            self._flush()
            if self._part != self._path:
                self._take_name()
        except FileError:
            self._abandon()
            raise
        except (OSError, RuntimeError) as error:
            self._abandon()
            if not self._handle.closed:
                superblock.put_back(self._handle, self._block)
            raise FileError(f"cannot write frame {frames[0][0]} to {self._path}: {_reason(error)}") from error

    def _flush(self) -> None:
        self._file.flush()
        self._block = superblock.unmark(self._handle)
        self._size = os.fstat(self._handle.fileno()).st_size

    def _take_name(self) -> None:
        """Take the name of the trajectory from an older file, and remove the checkpoint of that one."""
        try:
            os.replace(self._part, self._path)
            self._part = self._path
        except PermissionError:  # Windows renames no file that is open
            self._file.close()
            self._handle.close()
            os.replace(self._part, self._path)
            self._part = self._path
            self._open_file("r+")
            self._open()
        paths.checkpoint_of(self._path).unlink(missing_ok=True)

    def _require_file(self) -> None:
        """Raise a FileError if the file was removed or truncated, which HDF5 would not notice."""
        mine = os.fstat(self._handle.fileno())
        try:
            there = os.stat(self._part)
        except FileNotFoundError:
            there = None
        if there is None or not os.path.samestat(there, mine):
            raise FileError(f"the trajectory {self._path} was deleted or replaced while the run was writing it")
        if mine.st_size < self._size:
            raise FileError(
                f"the trajectory {self._path} was truncated while the run was writing it, from {self._size} to "
                f"{mine.st_size} bytes"
            )

    def _abandon(self) -> None:
        """Send further writes to the null device: HDF5's buffers of a failed frame would damage earlier ones."""
        try:
            # HDF5 is not asked: it crashes the process if it could not close the file.
            if not os.path.samestat(os.fstat(self._descriptor), os.fstat(self._handle.fileno())):
                return  # abandoned already
        except (OSError, ValueError):
            return  # closed
        null = os.open(os.devnull, os.O_RDWR)
        os.dup2(null, self._descriptor)
        os.close(null)


def rows(frames: list[NDArray[Any]], dtype: DTypeLike) -> NDArray[Any]:
    """Frames in the order of the file, (frames, n, 3), from arrays (3, n).

    One coordinate at a time: NumPy copies a transposed array along its rows of three, which takes 3.5 times as long.
    """
    out = np.empty((len(frames), frames[0].shape[1], 3), dtype)
    for row, frame in zip(out, frames, strict=True):
        for axis in range(3):
            row[:, axis] = frame[axis]
    return out


def _edges_of(scene: Scene) -> list[float]:
    """The lengths of the cell; where it does not repeat that of the volume, or where this is open of the surfaces."""
    low, high = scene.bounds()
    return [
        length or (b - a if np.isfinite(b - a) else 2.0 * scene.extent())
        for length, a, b in zip(scene.period or (None,) * 3, low, high, strict=True)
    ]


def _descriptor_of(file: h5py.File) -> int:
    """The file descriptor of an open file."""
    return int(file.id.get_vfd_handle())


def _reason(error: Exception) -> str:
    """The message of the system, without HDF5's addresses."""
    found = re.search(r"error message = '([^']*)'", str(error))
    return found.group(1) if found else str(error)


def _put(dataset: Any, first: int, values: Any) -> None:
    """Write entries from row `first` on. h5py's indexing takes four times as long, for twenty datasets a frame."""
    handle = dataset.id
    count, *shape = handle.shape
    entries = np.ascontiguousarray(values, dtype=dataset.dtype)
    if count < first + len(entries):
        handle.set_extent((first + len(entries), *shape))
    space = handle.get_space()
    space.select_hyperslab((first, *(0 for _ in shape)), entries.shape)
    handle.write(h5py.h5s.create_simple(entries.shape), space, entries)


def descriptions(
    scene: Scene, method: Method, storage: Storage, arrays: dict[str, Any] | None = None
) -> dict[str, str]:
    """The texts that identify a run; `arrays` get what they name and do not hold."""
    return {
        "scene": tomli_w.dumps(tables.scene_table(scene, {} if arrays is None else arrays)),
        "method": tomli_w.dumps(tables.table_of(method)),
        "storage": tomli_w.dumps(vars(storage)),
    }


def body_text(body: "Body") -> str:
    """The text that a trajectory keeps of a body."""
    from ..bodies.table import table_of

    return tomli_w.dumps(table_of(body))
