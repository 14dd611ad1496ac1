"""Shards: contiguous ranges of the particles, or bodies, of a run, each an ordinary run with files of its own.

If particles depend on one another, the run is one shard.

They are in the folder RUN.shards beside RUN.h5: the inputs of the run and its start, which the client writes once, and
of shard k its trajectory k.h5, its checkpoint and its end. Workers read the start there: a worker that replaces another
one needs no data of the client, and the scheduler carries short messages only.
"""

import dataclasses
import itertools
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..bodies.body import Body
from ..bodies.copies import Bodies
from ..compiled_scene import CompiledScene
from ..errors import SceneError
from ..files import marks, paths
from ..files.replaced import replaced
from ..methods.base import Method
from ..observables import CHUNK
from ..particles import ARRAYS, Births, Particles
from ..run.options import RunOptions, Task
from ..run.result import Result
from ..run.tally import scales_of
from ..state import Multipliers
from . import sent_modules

_BIRTHS = ("birth_time", "birth_source")
# Arrays of a result: times that are left out if no particle has one, and others.
_TIMES, _ENDS = ("escape_time", "absorbed_time"), ("impacts_per_particle", "birth_time", "collisions_per_particle")


class Whole(NamedTuple):
    """The common part of all shards of a run; the start is in files."""

    compiled: CompiledScene
    method: Method
    options: RunOptions
    body: Body | None
    bounds: list[int]  # shard k has the particles, or bodies, from bounds[k] to bounds[k + 1]
    start: str
    scales: tuple[float, float]
    volume: float | None  # the volume that the particles were filled into [m^3]
    balls: tuple[Any, ...]  # the sources of balls


def file_of(folder: Path, k: int) -> Path:
    """The trajectory of shard k."""
    return folder / f"{k:04}.h5"


def end_of(folder: Path, k: int) -> Path:
    """The file with the end of shard k, which exists when it is complete."""
    return folder / f"{k:04}.end"


def bounds_of(n: int, shards: int) -> list[int]:
    """Bounds of this number of shards of n particles, or of fewer; each shard begins with a chunk of particles.

    >>> bounds_of(1000, 2)
    [0, 512, 1000]
    """
    chunks = -(-n // CHUNK)
    shards = min(shards, chunks)
    return [min(n, CHUNK * (k * chunks // shards)) for k in range(shards + 1)]


# --- What the client writes -----------------------------------------------------------------------------


def prepare(folder: Path, task: Task, bounds: list[int], start: str) -> None:
    """Write the inputs of the run, and its start."""
    import cloudpickle

    sent_modules.send_code()
    body = None if task.bodies is None else task.bodies.body
    options = dataclasses.replace(task.options, progress=False, cluster=None, shards=None, observables=None)
    births, volume = task.particles.births, task.particles.volume
    balls = () if births is None else births.balls
    whole = Whole(task.compiled, task.method, options, body, bounds, start, scales_of(task), volume, balls)
    with replaced(folder / "whole.pickle", "description of the shards") as file:
        cloudpickle.dump(whole, file)
    arrays = {name: getattr(task.particles, name) for name in ARRAYS if not (name == "mass" and body)}
    arrays |= {} if births is None else dict(zip(_BIRTHS, births, strict=False))
    for name, array in arrays.items():
        if array is not None:
            with replaced(folder / f"{name}.npy", "start of the shards") as file:
                np.save(file, array)


def clear(folder: Path) -> None:
    """Remove the files of an earlier run from the folder, or create it.

    Raises:
        SceneError: it holds other files.
    """
    folder.mkdir(exist_ok=True)
    ours = [path for path in folder.iterdir() if path.is_file() and _is_ours(path)]
    if len(ours) < len(list(folder.iterdir())):
        raise SceneError(
            f"{folder} must hold the shards of a run or not be there, got a folder with other files, which a run would "
            "remove; move it away, or choose another name for the trajectory"
        )
    for path in ours:
        path.unlink()


def _is_ours(path: Path) -> bool:
    """Whether a file of the folder belongs to a run; a file with the name of a trajectory must be one."""
    word, suffix = path.stem.partition(".")[0], path.suffix
    if paths.is_temporary(path.name):
        return True
    if word.isdecimal():
        return suffix in (".end", ".checkpoint") or (suffix == ".h5" and marks.why_not(path, "trajectory") is None)
    return path.name in ("whole.pickle", *(f"{name}.npy" for name in (*ARRAYS, *_BIRTHS)))


def tidy(folder: Path, count: int) -> None:
    """Remove the files that only the run needed: all except the trajectories."""
    kept = {file_of(folder, k) for k in range(count)}
    for path in folder.iterdir():
        if path not in kept:
            path.unlink(missing_ok=True)


# --- What a worker reads and writes ---------------------------------------------------------------------


def task_of(folder: Path, k: int) -> Task:
    """The run of shard k."""
    import cloudpickle

    with open(folder / "whole.pickle", "rb") as file:
        whole: Whole = cloudpickle.load(file)
    first, last = whole.bounds[k : k + 2]
    files = {name: folder / f"{name}.npy" for name in (*ARRAYS, *_BIRTHS)}
    arrays = {name: np.load(file, mmap_mode="r") for name, file in files.items() if file.exists()}
    bodies = None
    if whole.body is None:
        some = {name: array[..., first:last] for name, array in arrays.items()}
        born = [np.array(some.pop(name)) for name in _BIRTHS if name in some]
        particles = Particles(**some)
        particles.volume = whole.volume
        if born:
            particles.births = Births(born[0], born[1], len(whole.options.sources), whole.balls)
    else:
        shape = 3, len(whole.body), -1
        position, velocity = (np.array(arrays[name].reshape(shape)[..., first:last], order="C") for name in ARRAYS[:2])
        bodies = Bodies.unchecked(whole.body, position, velocity)
        if "image" in arrays:
            bodies.image = np.array(arrays["image"].reshape(shape)[:, 0, first:last], order="C")
        particles = bodies.particles()
    options = dataclasses.replace(whole.options, trajectory=file_of(folder, k))
    of_all = whole.start, whole.scales
    return Task(whole.compiled, particles, whole.method, options, bodies, first, *of_all)


def write_end(path: Path, end: Result) -> None:
    """Write the end of a shard."""
    particles, multipliers = end.particles, end.multipliers
    arrays = {name: getattr(particles, name) for name in ("position", "velocity", "image", "spin")}
    arrays |= {name: getattr(end, name) for name in _ENDS}
    arrays |= {name: times for name in _TIMES if not np.isnan(times := getattr(end, name)).all()}
    arrays |= {} if multipliers is None else {f"multipliers.{k}": rows for k, rows in multipliers._asdict().items()}
    arrays = {name: array for name, array in arrays.items() if array is not None}
    # Arrays in sequence: an archive of NumPy has checksums, which take three times as long.
    with replaced(path, "end of a shard") as file:
        for array in (np.array(list(arrays)), *arrays.values()):
            np.save(file, array)


# --- What the client reads ------------------------------------------------------------------------------


def joined_end(folder: Path, task: Task, bounds: list[int]) -> Result:
    """The end of all shards, without observables and wall time."""
    n = bounds[-1]
    whole: dict[str, NDArray[Any]] = {name: np.full((len(task.particles) // n, n), np.nan) for name in _TIMES}
    for k, (first, last) in enumerate(itertools.pairwise(bounds)):
        with open(end_of(folder, k), "rb") as file:
            for name in np.load(file).tolist():
                part = np.load(file)
                # For bodies, point p of copy i is particle p n + i.
                points = part.shape[-1] // (last - first)
                if name not in whole:
                    whole[name] = np.empty((*part.shape[:-1], points, n), part.dtype)
                whole[name][..., first:last] = part.reshape(*part.shape[:-1], points, last - first)
    flat = {name: array.reshape(*array.shape[:-2], -1) for name, array in whole.items()}
    particles = task.particles
    particles.position, particles.velocity, particles.image = flat["position"], flat["velocity"], flat.get("image")
    particles.spin = flat.get("spin")
    loops = {name.partition(".")[2]: array for name, array in flat.items() if name.startswith("multipliers.")}
    return Result(
        particles,
        {},
        0.0,
        task.options.trajectory,
        Multipliers(**loops) if loops else None,
        bodies=None if task.bodies is None else task.bodies.moved(particles),  # type: ignore[arg-type]
        scene=task.scene,
        method=task.method,
        **{name: flat.get(name) for name in (*_TIMES, *_ENDS)},  # type: ignore[arg-type]
    )
