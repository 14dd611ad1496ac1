"""Checkpoints: all that a run needs to go on with the same bits, in one NumPy archive, replaced as a whole.

A line of JSON under "job" says what was run and how far; the other entries are the arrays of `Run.arrays`. Each has a
checksum.
"""

import hashlib
import json
import os
import zipfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError, SceneError
from ..particles import Particles
from . import paths

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
        SceneError: it cannot be read, or is damaged.
    """
    try:
        with open(path, "rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        return Job(**json.loads(str(arrays.pop("job")))), arrays
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise SceneError(
            f"cannot read the checkpoint {path}: {error}; remove it and its trajectory to start afresh"
        ) from error
