"""Trajectories: HDF5 in the H5MD 1.1 layout (https://www.nongnu.org/h5md/h5md.html), read as they are asked for.

particles/all/{position,velocity}/{step,time,value}, value (frames, N, 3); particles/all/{mass,id} (N,);
observables/NAME/{step,time,value}; parameters/{scene,method,storage,scene_file} as TOML text, parameters/particles, the
number that were run, and parameters/start, a digest of them at the start. All elements share one step and one time
dataset by hard links. writer.py writes them.
"""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from .. import tables
from ..errors import SceneError
from ..methods import Method
from ..particles import Particles
from ..scene import Scene

_PARTS = ("position", "velocity")
_STILL_WRITTEN = "already open"


class Trajectory:
    """A trajectory on disk, read as it is asked for.

    Attributes:
        times: (frames,) [s].
        observables: name -> array, one entry a frame.
        scene, method: as they were run.
        scene_text: the scene file's text, or None.

    A file that is being written can be read, and so can what a kill left of one.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        # Without a chunk cache only those rows of a chunk are read that are asked for, a thousandth for one particle's
        # path. Without locking, a file that is still being written can be read.
        options: dict[str, Any] = {"locking": False, "rdcc_nbytes": 0}
        try:
            try:
                self._file = h5py.File(self.path, "r", **options)
            except OSError as error:
                if _STILL_WRITTEN not in str(error):
                    raise
                # Marked by its writer in this very moment, or in the one in which it was killed.
                self._file = h5py.File(self.path, "r", swmr=True, **options)
        except OSError as error:
            raise SceneError(f"cannot read the trajectory {self.path}: {error}") from error
        if "h5md" not in self._file or "parameters/time" not in self._file:
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
        """Number of frames that are whole: their times are written last."""
        return int(self._file["parameters/time"].shape[0])

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
        everything = self._particles()
        position, velocity = (everything[f"{name}/value"][k % n].T for name in _PARTS)
        return Particles(position, velocity, everything["mass"][()])

    def particle(self, i: int) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        """The path of particle i: its positions and velocities, (3, frames) each."""
        everything, n = self._particles(), len(self)
        ids = everything["id"][()]
        column = int(np.searchsorted(ids, i))
        if column == len(ids) or ids[column] != i:
            raise SceneError(
                f"{self.path}: particle must be one of the {len(ids)} that the file keeps, from {ids[0]} to {ids[-1]}, "
                f"got {i}"
            )
        position, velocity = (everything[f"{name}/value"][:n, column].T for name in _PARTS)
        return position, velocity

    def _particles(self) -> Any:
        if "particles/all" not in self._file:
            raise SceneError(f'{self.path} keeps no particles: it was run with frames = "none"')
        return self._file["particles/all"]

    @property
    def count(self) -> int:
        """Number of particles that were run; a frame may keep fewer."""
        return int(self._file["parameters/particles"][()])

    @property
    def descriptions(self) -> dict[str, str]:
        """What makes a run another one, as texts: scene, method and storage."""
        return {name: str(self._file[f"parameters/{name}"].asstr()[()]) for name in ("scene", "method", "storage")}

    @property
    def start(self) -> str:
        """A digest of the particles at the start: "" in a file of a version that stored none."""
        stored = self._file.get("parameters/start")
        return "" if stored is None else str(stored.asstr()[()])

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
