"""Trajectories: HDF5 in the H5MD 1.1 layout (https://www.nongnu.org/h5md/h5md.html), written and read.

particles/all/{position,velocity}/{step,time,value}, value (frames, N, 3); particles/all/mass (N,);
observables/NAME/{step,time,value}; parameters/{scene,method,scene_file} as TOML text. All elements share one step
and one time dataset by hard links. Every frame is flushed, so a killed run leaves a file that opens and holds every
frame that was reported as written.
"""

from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any

import h5py
import numpy as np
import tomli_w
from numpy.typing import NDArray

from .. import tables
from ..errors import FileError, SceneError
from ..methods import Method
from ..particles import Particles, State
from ..scene import Scene
from ..version import VERSION

# Frames x particles of a chunk: a particle's path and a frame are both read with few chunks.
_CHUNK = (10, 1000)
# The chunk cache holds the chunks that one frame touches, up to this many bytes.
_LARGEST_CACHE = 1 << 28

# Number, time [s], positions and velocities, observables.
Written = tuple[int, float, State, dict[str, Any]]
WriteFrames = Callable[[list[Written]], None]


class TrajectoryWriter:
    """A context that creates the file and gives the function that appends frames.

    Several at once cost little more than one: what takes time is the fifteen datasets and the flush.
    """

    def __init__(
        self,
        path: Path,
        overwrite: bool,
        scene: Scene,
        method: Method,
        particles: Particles,
        scene_text: str | None,
    ) -> None:
        check_target(path, overwrite)
        self._path, self._scene, self._method = path, scene, method
        self._mass, self._text = particles.mass, scene_text

    def __enter__(self) -> WriteFrames:
        chunks = -(-len(self._mass) // _CHUNK[1])
        cache = min(_LARGEST_CACHE, 2 * chunks * _CHUNK[0] * _CHUNK[1] * 24)
        try:
            self._file = h5py.File(self._path, "w", rdcc_nbytes=max(cache, 1 << 20))
        except OSError as error:
            raise FileError(f"cannot write the trajectory {self._path}: {error}") from error
        self._create()
        return self._write

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._file.close()
        except (OSError, RuntimeError) as problem:
            if error is None:
                raise FileError(f"cannot close the trajectory {self._path}: {problem}") from problem

    def _create(self) -> None:
        file = self._file
        h5md = file.create_group("h5md")
        h5md.attrs["version"] = np.array([1, 1], dtype=np.int32)
        h5md.create_group("author").attrs["name"] = "swarm"
        creator = h5md.create_group("creator")
        creator.attrs["name"], creator.attrs["version"] = "swarm", VERSION
        everything = file.create_group("particles/all")
        box = everything.create_group("box")
        box.attrs["dimension"], box.attrs["boundary"] = 3, ["none"] * 3
        everything["mass"] = self._mass
        parameters = file.create_group("parameters")
        parameters["scene"] = tomli_w.dumps(tables.scene_table(self._scene))
        parameters["method"] = tomli_w.dumps(tables.table_of(self._method))
        if self._text is not None:
            parameters["scene_file"] = self._text
        self._step = parameters.create_dataset("frame", (0,), np.int64, maxshape=(None,), chunks=(1024,))
        self._time = parameters.create_dataset("time", (0,), np.float64, maxshape=(None,), chunks=(1024,))
        n = len(self._mass)
        chunks = (_CHUNK[0], min(n, _CHUNK[1]), 3)
        self._values = {name: self._element(f"particles/all/{name}", (n, 3), np.float64, chunks) for name in _PARTS}
        self._observables: dict[str, Any] = {}

    def _element(self, name: str, shape: tuple[int, ...], kind: Any, chunks: tuple[int, ...]) -> Any:
        """A time-dependent H5MD element."""
        group = self._file.create_group(name)
        group["step"], group["time"] = self._step, self._time
        return group.create_dataset("value", (0, *shape), kind, maxshape=(None, *shape), chunks=chunks)

    def _write(self, frames: list[Written]) -> None:
        try:
            _append(self._step, [number for number, _moment, _state, _seen in frames])
            _append(self._time, [moment for _number, moment, _state, _seen in frames])
            for name, dataset in self._values.items():
                rows = np.empty((len(frames), *dataset.shape[1:]))
                np.stack([getattr(state, name).T for _number, _moment, state, _seen in frames], out=rows)
                _append(dataset, rows)
            for name in (name for name in frames[0][3] if name != "time"):
                entries = np.array([seen[name] for _number, _moment, _state, seen in frames])
                if name not in self._observables:
                    shape = entries.shape[1:]
                    self._observables[name] = self._element(f"observables/{name}", shape, entries.dtype, (1024, *shape))
                _append(self._observables[name], entries)
            self._file.flush()
        except (OSError, RuntimeError) as error:
            raise FileError(f"cannot write frame {frames[0][0]} to {self._path}: {error}") from error


_PARTS = ("position", "velocity")


def _append(dataset: Any, values: Any) -> None:
    """More entries. h5py's indexing takes four times as long, and a frame appends to some fifteen datasets."""
    handle = dataset.id
    count, *shape = handle.shape
    entries = np.ascontiguousarray(values, dtype=dataset.dtype)
    handle.set_extent((count + len(entries), *shape))
    space = handle.get_space()
    space.select_hyperslab((count, *(0 for _ in shape)), entries.shape)
    handle.write(h5py.h5s.create_simple(entries.shape), space, entries)


def check_target(path: Path, overwrite: bool, what: str = "trajectory") -> None:
    """Raise a SceneError if `path` cannot become a new file."""
    if not path.parent.is_dir():
        raise SceneError(f"{what}: the folder {path.parent} does not exist; create it first")
    if path.is_dir():
        raise SceneError(f"{what}: expected a file name, got the folder {path}")
    if path.exists() and not overwrite:
        raise SceneError(f"{what}: {path} exists; choose another name, or overwrite it with --overwrite")


class Trajectory:
    """A trajectory on disk, read as it is asked for.

    Attributes:
        times: (frames,) [s].
        observables: name -> array, one entry a frame.
        scene, method: as they were run.
        scene_text: the scene file's text, or None.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        try:
            # Without locking, a file that is still being written can be read.
            self._file = h5py.File(self.path, "r", locking=False)
        except OSError as error:
            raise SceneError(f"cannot read the trajectory {self.path}: {error}") from error
        if "h5md" not in self._file or "particles/all/position/value" not in self._file:
            self._file.close()
            raise SceneError(f"{self.path} is an HDF5 file, but not a trajectory of swarm")

    def __enter__(self) -> "Trajectory":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __len__(self) -> int:
        """Number of frames. A killed run may have begun one more in some of the datasets."""
        lengths = (self._file[f"particles/all/{name}/value"].shape[0] for name in _PARTS)
        return int(min(*lengths, self._file["parameters/time"].shape[0]))

    @property
    def times(self) -> NDArray[np.float64]:
        """Times of the frames [s]."""
        return np.asarray(self._file["parameters/time"][: len(self)])

    @property
    def observables(self) -> dict[str, NDArray[Any]]:
        """Everything that was observed, one entry a frame."""
        group, n = self._file.get("observables", {}), len(self)
        return {"time": self.times, **{name: np.asarray(group[name]["value"][:n]) for name in group}}

    def frame(self, k: int) -> Particles:
        """The particles at frame k; negative k count from the end."""
        n = len(self)
        if not -n <= k < n:
            raise SceneError(f"{self.path}: frame must lie between {-n} and {n - 1}, got {k}")
        everything = self._file["particles/all"]
        position, velocity = (everything[f"{name}/value"][k % n].T for name in _PARTS)
        return Particles(position, velocity, everything["mass"][()])

    @property
    def scene(self) -> Scene:
        """The scene that was run."""
        table = _toml(self._file["parameters/scene"])
        return tables.scene_of(table["surface"], table.get("gravity"))

    @property
    def method(self) -> Method:
        """The method that was run."""
        return tables.method_of(_toml(self._file["parameters/method"]))

    @property
    def scene_text(self) -> str | None:
        """The scene file that was run."""
        stored = self._file.get("parameters/scene_file")
        return None if stored is None else str(stored.asstr()[()])


def _toml(dataset: Any) -> dict[str, Any]:
    import tomllib

    return tomllib.loads(dataset.asstr()[()])


def load(path: str | Path) -> Trajectory:
    """Open a trajectory for reading; see `Trajectory`."""
    return Trajectory(path)
