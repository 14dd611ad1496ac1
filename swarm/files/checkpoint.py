"""Checkpoints: the data a run needs to continue with the same bits, in one NumPy archive that is replaced atomically.

A line of JSON under "job" describes the run and its progress; the other entries are the arrays of `Run.arrays`. Every
entry has a checksum.
"""

import contextlib
import hashlib
import io
import json
import math
import re
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..particles import Particles
from ..serialization import tables
from ..version import VERSION
from .replaced import replaced
from .sources import DAMAGE, DamagedError, reason

Arrays = dict[str, NDArray[Any]]
# The name of an archive's first entry ends here.
_FIRST = b"job.npy"
_HEAD = 30 + len(_FIRST)
# The array of a checkpoint of a run on a cluster that holds the bounds of its shards.
SHARDS = "shards"
# The array with the surface, and the member of it, of each row that the kernels have for a wall.
_OWNERS = "owners"
# The largest number of surfaces that a sentence lists.
_SHOWN = 12
_ANEW = "start a new run from the last frame of its trajectory (from = in [particles]), or start again with --overwrite"
_HINT = "use the inputs that it was started with, or start again with --overwrite"


@dataclass(frozen=True)
class SavedRun:
    """A run and its progress.

    Attributes:
        version, scene, method, storage: their texts; particles: their number; start: a digest of them at the start.
        frame, time: the last frame that was written, and its time [s].
        following: time of the frame that is being computed [s], or None.
        wall_time: wall time used so far [s].
        seed: the seed of thermal walls.
        kept: the selection of the log of impacts, as text, or ""; rows: the number of its rows.
        sums: checksums of the log's rows in the frame that is being computed, by column, as text; "" in older versions.
        member_impacts: whether the impacts on each member are counted.
        observables: the names of the user-defined observables, in order.
        counters: the counters, as text, or "".
        first: for a shard, the number of its first particle, or body, in the whole run.
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
    seed: int = 0
    kept: str = ""
    rows: int = 0
    sums: str = ""
    member_impacts: bool = False
    observables: str = ""
    counters: str = ""
    first: int = 0

    def require_same(self, other: "SavedRun", path: Path) -> None:
        """Raise a SceneError that names both values if `other` is another run than that of this checkpoint."""
        for name, what in _NAMES.items():
            mine, its = (_on_one_line(str(getattr(job, name))) for job in (self, other))
            if getattr(self, name) != getattr(other, name):
                raise SceneError(
                    f"{path} is of another run: its {what} {mine}, got {its}; {_HINT}; swarm {self.version} wrote it, "
                    f"this is {other.version}"
                )


def _on_one_line(text: str) -> str:
    """Return a text of TOML on one line, with its lists as a reader writes them."""
    lists = re.sub(r",?\n\s*\]", "]", re.sub(r"\[\n\s*", "[", text))
    return re.sub(r",?\s*\n\s*", ", ", lists.strip())


_NAMES = {
    "particles": "number of particles is",
    "method": "method is",
    "scene": "scene is",
    "storage": "trajectory keeps",
    "start": "particles at the start (seed, speed, mass, file, body) have the digest",
    "seed": "seed of thermal walls is",
    "kept": "log of impacts keeps",
    "member_impacts": "member_impacts is",
    "observables": "user-defined observables are",
    "counters": "counters are",
    "version": "version of swarm is",
}


def digest_of(particles: Particles, body: str = "") -> str:
    """A digest that identifies particles, or the points of bodies together with the text of the body."""
    digest = hashlib.sha256(body.encode())
    born = None if particles.births is None else particles.births.time
    balls = particles.radius, particles.spin
    for array in (particles.position, particles.velocity, particles.mass, particles.image, born, *balls):
        if array is not None:
            digest.update(np.ascontiguousarray(array).data)
    for one in () if particles.births is None else particles.births.balls:
        digest.update(one.blocked.encode())
    return digest.hexdigest()[:16]


def save(path: Path, job: SavedRun, arrays: Arrays, owners: NDArray[np.int64] | None = None) -> None:
    """Replace the checkpoint; the old one stays until the new one is completely on the disk.

    `owners` are the surfaces and members of the rows for walls, as in `Scene.members`.

    Raises:
        FileError: it cannot be written.
    """
    arrays = arrays if owners is None else {_OWNERS: owners, **arrays}
    with replaced(path, "checkpoint") as file:
        np.savez(file, allow_pickle=False, job=json.dumps(asdict(job)), **arrays)


def is_one(path: Path) -> bool:
    """Whether a file starts like a checkpoint, complete or not."""
    if not path.is_file():
        return False
    with open(path, "rb") as file:
        return file.read(_HEAD).endswith(_FIRST)


def read(path: Path) -> tuple[SavedRun, Arrays]:
    """Read a checkpoint.

    Raises:
        SceneError: it is damaged.
    """
    with _reading(path):
        with zipfile.ZipFile(path) as archive:
            # Every entry has a checksum, which is checked when it is read to its end.
            entries = {entry.filename.removesuffix(".npy"): archive.read(entry) for entry in archive.infolist()}
        # Parsed after the checksums: the header of a damaged array may state any size.
        arrays = {
            name: np.lib.format.read_array(io.BytesIO(data), allow_pickle=False) for name, data in entries.items()
        }
        job = tables.convert(json.loads(str(arrays.pop("job"))), SavedRun, "job")
        if job.frame < 0 or not all(map(math.isfinite, (job.time, job.wall_time, job.following or 0.0))):
            raise ValueError(f"it cannot be at frame {job.frame}, {job.time} s")
    return job, arrays


def require_owners(path: Path, arrays: Arrays, owners: NDArray[np.int64]) -> None:
    """Raise a SceneError unless the rows for walls belong to the same walls as in the run; remove `owners`."""
    saved = arrays.pop(_OWNERS, None)
    if saved is None:
        raise SceneError(
            f"{path} does not say which surface each of its rows is of: an older version of swarm wrote it, and "
            f"its walls may be in another order; {_ANEW}"
        )
    if not np.array_equal(saved, owners):
        raise SceneError(
            f"{path} is of a version of swarm with another order of walls: its rows are of surfaces "
            f"{_shortened(saved[0])}, got {_shortened(owners[0])}; {_ANEW}"
        )


def _shortened(surfaces: NDArray[np.int64]) -> str:
    return ", ".join(map(str, surfaces[:_SHOWN])) + ", ..." * (len(surfaces) > _SHOWN)


def require_fit(
    path: Path,
    arrays: Arrays,
    run: Arrays,
    written: str = VERSION,
    may_grow: Callable[[str], bool] = lambda _name: False,
) -> None:
    """Raise a SceneError unless the arrays of a checkpoint have the names, types and shapes of the run's own.

    The lanes of a run halted within a frame may hold any number of particles, each once.
    `may_grow` tells whether the first axis of another array may have any length; `written` is the version of the file.
    The values have the right checksums, so a difference probably comes from the version; the list of entries has none.
    """
    same = ", perhaps of another commit," if written == VERSION else ""
    begin = (
        f"{path} is of another version of swarm, or damaged: version {written}{same} wrote it, and this is {VERSION}; "
        "expected"
    )
    if arrays.keys() != run.keys():
        lacking, more = (
            ", ".join(sorted(names)[:_SHOWN]) or "none"
            for names in (run.keys() - arrays.keys(), arrays.keys() - run.keys())
        )
        raise SceneError(f"{begin} the arrays {lacking} too, got {more} in their place; {_ANEW}")
    # Bodies are never halted in lanes.
    left = arrays["halted.particle"].shape[-1:] if "halted.particle" in run else ()
    for name, mine in run.items():
        shape = mine.shape[:-1] + left if name.startswith("halted.") else mine.shape
        if may_grow(name) and arrays[name].ndim == mine.ndim:
            shape = arrays[name].shape[:1] + mine.shape[1:]
        if (arrays[name].dtype, arrays[name].shape) != (mine.dtype, shape):
            came = f"{arrays[name].dtype} {arrays[name].shape}"
            raise SceneError(f"{begin} {name} as {mine.dtype} of the shape {shape}, got {came}; {_ANEW}")
    with _reading(path):
        if "halted.particle" in run:
            bounded = np.concatenate([[-1], arrays["halted.particle"], [len(run["mass"])]])
            if (np.diff(bounded) <= 0).any():
                raise ValueError("it names particles that do not exist")


@contextlib.contextmanager
def _reading(path: Path) -> Iterator[None]:
    try:
        yield
    except (*DAMAGE, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise DamagedError(
            f"{path} is damaged: {reason(error)}; the frames in its trajectory are intact: start a new run from the "
            "last of them (from = in [particles]), or start again, with overwrite and without resume"
        ) from error
