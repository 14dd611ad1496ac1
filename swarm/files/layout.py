"""The layout that a trajectory must have before it is read: datasets, their types, and consistent shapes."""

import math
from collections.abc import Callable, Collection
from pathlib import Path
from typing import IO, Any

import h5py
import numpy as np
from numpy.typing import NDArray

from ..common.catalog import OBSERVABLES
from .sources import DamagedError

# Data of each particle: its impacts, which files of older versions lack; the cells that it has crossed in periodic
# scenes; its time of escape [s], where walls have openings;
# its time of absorption [s], where walls may absorb it.
PARTS, COUNTS, IMAGES, ESCAPES = ("position", "velocity"), "impacts", "image", "escape_time"
ABSORBED = "absorbed_time"
# The time of birth of each ball [s], where balls come during the run; NaN before its birth.
BORN = "born_time"
# Data of balls: the number of collisions, the spin where balls turn, and the constant radius.
COLLISIONS, SPINS, RADII = "collisions", "spin", "radius"
_INTEGER, _REAL, _NUMBER = "iu", "f", "iuf"
_ELEMENTS: dict[str, tuple[str, tuple[int, ...]]] = {
    **dict.fromkeys(PARTS, (_REAL, (3,))), COUNTS: (_INTEGER, ()), IMAGES: (_INTEGER, (3,)), ESCAPES: (_REAL, ()),
    ABSORBED: (_REAL, ()), BORN: (_REAL, ()), COLLISIONS: (_INTEGER, ()), SPINS: (_REAL, (3,)),
}  # fmt: skip
KEPT = tuple(_ELEMENTS)
# The attribute with the unit of a dataset. H5MD calls it `unit`, of which MDAnalysis takes no SI units.
UNIT = "swarm_unit"
UNITS = {
    name: np.bytes_(unit) for name, unit in (("position", "m"), ("velocity", "m/s"), ("mass", "kg"), ("time", "s"))
}
# The datasets with values that may be in shards.
JOINED = tuple(f"particles/all/{name}/value" for name in KEPT)
# For a run with sources: the time at which each particle came [s], and the number of its source, -1 from the start.
BIRTHS = "birth_time", "birth_source"
# The group of long arrays of the scene, by their digests.
ARRAYS = "arrays"
_TEXTS = ("scene", "method", "storage")
_REQUIRED = ("h5md", *(f"parameters/{name}" for name in (*_TEXTS, "particles", "frame", "time")))
# The highest compression of any HDF5 filter: deflate, 1032 to 1.
_DENSEST = 1032
# Bytes of the header of a heap of texts, and of the header of each object in it; the signature of a heap.
_HEADER, _HEAP = 16, b"GCOL"
# The version of a heap, which follows its signature; and the bytes of a file that hold the texts of attributes.
_VERSION, _BEGINNING = b"\1\0\0\0", 1 << 20


def missing(file: Any) -> str | None:
    """The first part of a trajectory that this file lacks, or None."""
    return next((name for name in _REQUIRED if name not in file), None)


def frames(file: Any, path: Path) -> int:
    """Return the number of complete frames of a file; raise a ValueError about an inconsistent part.

    While a file is being written, a dataset may have more entries than there are complete frames, never fewer.
    """
    texts = (*_TEXTS, "scene_file", "start", "body", "observables", "counters")
    for name in (f"parameters/{text}" for text in texts):
        if name in file and (h5py.check_string_dtype(dataset(file, name).dtype) is None or file[name].shape != ()):
            raise ValueError(f"{name} must be a text")
    whole = ("seed", "copies", "threads")
    for name, kinds in (*((name, _INTEGER) for name in whole), ("volume", _REAL), ("until", _REAL)):
        if f"parameters/{name}" in file:
            dataset(file, f"parameters/{name}", kinds, ())
    count = int(dataset(file, "parameters/particles", _INTEGER, ())[()])
    time = dataset(file, "parameters/time", _REAL, (None,))
    n = int(time.shape[0])
    require_fits(time, n, path)
    dataset(file, "parameters/frame", _INTEGER, (n,))
    if "parameters/wall_time" in file:
        dataset(file, "parameters/wall_time", _REAL, (n,))
    if "observables" in file:
        for name in file["observables"]:
            value = dataset(file, f"observables/{name}/value", _NUMBER)
            if value.ndim not in (1, 2, 3, 4) or value.shape[0] < n:
                raise ValueError(f"observables/{name} must have {n} frames, got the shape {value.shape}")
            require_fits(value, n, path)
    if "particles/all" in file:
        _require_particles(file, n, count, path)
    return n


def require_shards(file: Any, n: int, path: Path, open_file: Callable[[Path], Any]) -> None:
    """Raise an error that names a missing or damaged file of a shard with particles of the first n frames.

    HDF5 would return zeros for data that it does not find.
    """
    held: dict[str, dict[str, int]] = {}
    for name in KEPT:
        value = file.get(f"particles/all/{name}/value")
        for one in value.virtual_sources() if value is not None and value.is_virtual else ():
            _begin, end = one.src_space.get_select_bounds()
            held_there = held.setdefault(one.file_name, {})
            held_there[one.dset_name] = max(held_there.get(one.dset_name, 0), end[1] + 1)
    for shard_name, needed in held.items():
        shard = path.parent / shard_name
        if not shard.is_file():
            raise DamagedError(
                f"{path} needs {shard}, which holds a part of its particles, got none; move both together"
            )
        with open_file(shard) as part:
            for source, entries in needed.items():
                if part[source].shape[0] < n or part[source].shape[1] < entries:
                    raise DamagedError(
                        f"{shard} must hold {n} frames of {entries} particles of {path}, got {source} of the shape "
                        f"{part[source].shape}: it is of another run, or was changed"
                    )


def _require_particles(file: Any, n: int, count: int, path: Path) -> None:
    """Raise a ValueError if the data of the `count` particles in n frames are inconsistent."""
    kept = dataset(file, "particles/all/mass", _REAL, (None,))
    if not 1 <= len(kept) <= count:
        raise ValueError(f"particles/all/mass must have 1 to {count} entries, got {len(kept)}")
    require_fits(kept, len(kept), path)
    if (ids := dataset(file, "particles/all/id", _INTEGER, (None,))).shape != kept.shape:
        raise ValueError(f"particles/all/id must have {len(kept)} entries, got {ids.shape}")
    for name, kind in zip((*BIRTHS, RADII), (_REAL, _INTEGER, _REAL), strict=True):
        if f"particles/all/{name}" in file:
            dataset(file, f"particles/all/{name}", kind, kept.shape)
    for name, (kinds, width) in _ELEMENTS.items():
        if name in PARTS or f"particles/all/{name}" in file:
            require_fits(dataset(file, f"particles/all/{name}/value", kinds, (n, len(kept), *width)), n, path)


def require_index(file: Any) -> None:
    """Read the indexes of all chunks; h5py raises an error if one is damaged."""

    def count(_name: str, found: Any) -> None:
        if isinstance(found, h5py.Dataset) and found.chunks is not None:
            found.id.get_num_chunks()

    file.visititems(count)


def text(dataset: Any, path: Path) -> str:
    """Read a text of the file; raise a ValueError if it is damaged.

    HDF5 keeps texts in a heap without a checksum, and never returns from reading a damaged one, so the heap is checked
    first. HDF5 File Format Specification, III.E and VIII: a text is its length, the address of its heap and an object
    number; a heap is a sequence of objects, and object 0 is its free space.
    """
    place = dataset.id.get_offset()
    with open(path, "rb") as file:
        begin = -1 if place is None else _integer(file, place + 4, 8)
        if not 0 <= begin < path.stat().st_size or _integer(file, begin, 4) != int.from_bytes(_HEAP, "little"):
            raise ValueError("its heap is not where it should be")
        _require_heap(file, begin)
    return str(dataset.asstr()[()])


def require_heaps(path: Path) -> None:
    """Raise a ValueError if a heap of texts at the beginning of a file, which holds those of attributes, is damaged."""
    with open(path, "rb") as file:
        head, begin = file.read(_BEGINNING), -1
        while (begin := head.find(_HEAP + _VERSION, begin + 1)) >= 0:
            _require_heap(file, begin)


def _integer(file: IO[bytes], at: int, size: int) -> int:
    file.seek(at)
    return int.from_bytes(file.read(size), "little")


def _require_heap(file: IO[bytes], begin: int) -> None:
    """Raise a ValueError if the objects of a heap do not follow one another to its end."""
    end, at = begin + _integer(file, begin + 8, 8), begin + _HEADER
    while at + _HEADER <= end:
        number, size = _integer(file, at, 2), _integer(file, at + 8, 8)
        step = _HEADER + -(-size // 8) * 8 if number else size
        if step < _HEADER or at + step > end:
            raise ValueError("its heap is damaged")
        at += step


def require_observables(seen: dict[str, NDArray[Any]], own: Collection[str], lengths: dict[str, int]) -> None:
    """Raise a ValueError if an observable of every run is missing, or an observable has a wrong shape.

    Args:
        seen: the observables by their names, one entry a frame.
        own: the names of the user's observables.
        lengths: the known lengths of axes of `catalog.OBSERVABLES`.
    """
    n = len(seen["time"])
    for name, one in OBSERVABLES.items():
        if name in own or (name not in seen and not one.every):
            continue
        shape = (n, *one.shape(lengths))
        came = None if name not in seen else seen[name].shape
        if came is None or not _is_of(came, shape):
            raise ValueError(f"expected {name} of the shape {_shown(shape)}, got {'nothing' if came is None else came}")


def dataset(file: Any, name: str, kinds: str | None = None, shape: tuple[int | None, ...] | None = None) -> Any:
    """Return a dataset of these kinds and this shape; None is any length, and the first axis may be longer."""
    found = file[name]
    if not isinstance(found, h5py.Dataset) or found.shape is None:
        raise ValueError(f"{name} must be a dataset")
    if kinds is not None and found.dtype.kind not in kinds:
        raise ValueError(f"{name} must hold numbers, got {found.dtype}")
    if shape is not None:
        is_longer = bool(shape and found.shape) and shape[0] is not None and found.shape[0] > shape[0]
        if not _is_of(found.shape, (None, *shape[1:]) if is_longer else shape):
            raise ValueError(f"{name} must have the shape {_shown(shape)}, got {found.shape}")
    return found


def _is_of(shape: tuple[int, ...], wanted: tuple[int | None, ...]) -> bool:
    """Whether a shape is the wanted one; None in it is any length."""
    return len(shape) == len(wanted) and all(k in (length, None) for length, k in zip(shape, wanted, strict=True))


def _shown(shape: tuple[int | None, ...]) -> str:
    return f"({', '.join('any' if k is None else str(k) for k in shape)})"


def require_fits(dataset: Any, rows: int, path: Path) -> None:
    """Raise a ValueError if the file is too small for this number of rows, before memory is allocated for them."""
    if dataset.is_virtual:
        return  # `require_shards` looks at the files that hold them
    size, packed = path.stat().st_size, dataset.id.get_create_plist().get_nfilters() > 0
    wanted = rows * math.prod(dataset.shape[1:]) * dataset.dtype.itemsize
    if wanted > size * (_DENSEST if packed else 1):
        raise ValueError(f"{dataset.name} takes {wanted} bytes, and the file has {size}")
