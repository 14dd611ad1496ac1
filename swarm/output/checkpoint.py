"""Checkpoints: all that a run needs to go on with the same bits, in one NumPy archive, replaced as a whole.

A line of JSON under "job" says what was run and how far; the other entries are the arrays of `Run.arrays`. Each has a
checksum.
"""

import contextlib
import hashlib
import io
import json
import math
import os
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import tables
from ..errors import FileError, SceneError
from ..particles import Particles
from . import paths
from .sources import DAMAGE, DamagedError, reason

Arrays = dict[str, NDArray[Any]]
# The name of an archive's first entry ends here.
_FIRST = b"job.npy"
_HEAD = 30 + len(_FIRST)
_HINT = "run it with the inputs it was started with, or start afresh with --overwrite"


@dataclass(frozen=True)
class Job:
    """What is being run, and how far it is.

    Attributes:
        version, scene, method, storage: as texts; particles: how many; start: a digest of the particles at the start.
        frame, time: the last frame that was written [s].
        following: the frame that is under way [s], or None.
        wall_time: seconds that were spent so far.
    """

    version: str
    scene: str
    method: str
    storage: str
    particles: int
    start: str
    frame: int = 0
    time: float = 0.0
    following: float | None = None
    wall_time: float = 0.0

    def require_same(self, other: "Job", path: Path) -> None:
        """Raise a SceneError that names both values if `other` is not the run that this checkpoint is of."""
        for name in ("particles", "method", "scene", "storage", "start", "version"):
            mine, its = getattr(self, name), getattr(other, name)
            if mine != its:
                raise SceneError(
                    f"{path} is of another run: its {_NAMES[name]} {_told(mine)}, got {_told(its)}; {_HINT}"
                )


_NAMES = {
    "particles": "number of particles is",
    "method": "method is",
    "scene": "scene is",
    "storage": "trajectory keeps",
    "start": "particles at the start (seed, speed, mass, file) have the digest",
    "version": "version of swarm is",
}


def _told(value: Any) -> str:
    """A value in one line."""
    return ", ".join(line for line in str(value).splitlines() if line)


def digest_of(particles: Particles) -> str:
    """Tells one start from another."""
    digest = hashlib.sha256()
    for array in (particles.position, particles.velocity, particles.mass):
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()[:16]


def save(path: Path, job: Job, arrays: Arrays) -> None:
    """Replace the checkpoint: until the new one is whole on the disk, the old one stays.

    Raises:
        FileError: it cannot be written.
    """
    part = paths.part_of(path)
    try:
        with open(part, "wb") as file:
            np.savez(file, allow_pickle=False, job=json.dumps(asdict(job)), **arrays)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
        if os.name == "posix":
            _sync_folder(path.parent)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise FileError(f"cannot write the checkpoint {path}: {error}; the one before it is as it was") from error


def _sync_folder(path: Path) -> None:
    """Let the names in a folder reach the disk; other systems open no folders."""
    folder = os.open(path, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def is_one(path: Path) -> bool:
    """Whether a file begins as checkpoints do, even if it is not whole."""
    if not path.is_file():
        return False
    with open(path, "rb") as file:
        return file.read(_HEAD).endswith(_FIRST)


def read(path: Path) -> tuple[Job, Arrays]:
    """A checkpoint.

    Raises:
        SceneError: it is damaged.
    """
    with _reading(path):
        with zipfile.ZipFile(path) as archive:
            # All that it holds has a checksum, which is known when it is read to its end.
            entries = {entry.filename.removesuffix(".npy"): archive.read(entry) for entry in archive.infolist()}
        # Up to here it may not be looked at: its arrays may be of any size.
        arrays = {
            name: np.lib.format.read_array(io.BytesIO(data), allow_pickle=False) for name, data in entries.items()
        }
        job = tables.convert(json.loads(str(arrays.pop("job"))), Job, "job")
        if job.frame < 0 or not all(map(math.isfinite, (job.time, job.wall_time, job.following or 0.0))):
            raise ValueError(f"it cannot be at frame {job.frame}, {job.time} s")
    return job, arrays


def require_fit(path: Path, arrays: Arrays, run: Arrays) -> None:
    """Raise a SceneError if these are not the arrays of that run, whose own are given.

    What a halt left in the lanes may be of any number of particles, each once.
    """
    with _reading(path):
        if arrays.keys() != run.keys():
            raise ValueError(f"expected the arrays {sorted(run)}, got {sorted(arrays)}")
        left = arrays["halted.particle"].shape[-1:]
        for name, mine in run.items():
            shape = mine.shape[:-1] + left if name.startswith("halted.") else mine.shape
            if (arrays[name].dtype, arrays[name].shape) != (mine.dtype, shape):
                raise ValueError(
                    f"{name} must be {mine.dtype} of the shape {shape}, got {arrays[name].dtype} {arrays[name].shape}"
                )
        particles = arrays["halted.particle"]
        if len(particles) and not (particles[0] >= 0 and particles[-1] < len(run["mass"]) and _ascends(particles)):
            raise ValueError("it names particles that there are not")


def _ascends(values: NDArray[Any]) -> bool:
    return bool((np.diff(values) > 0).all())


@contextlib.contextmanager
def _reading(path: Path) -> Iterator[None]:
    try:
        yield
    except (*DAMAGE, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise DamagedError(
            f"{path} is damaged: {reason(error)}; the frames in its trajectory are whole: go on from the last of them "
            "as a new run (from = in [particles]), or start afresh, with overwrite and without resume"
        ) from error
