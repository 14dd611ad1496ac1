"""Samples from files: the header is compared with the file before any of the stated size is allocated."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from ...common import checks
from ...errors import SceneError
from ...state import Floats

# The highest compression of any HDF5 filter: deflate, 1032 to 1.
_DENSEST = 1032
_MAGIC = b"\x93NUMPY"
# Errors that NumPy and h5py raise for a file that is damaged or of another format.
_DAMAGE = (OSError, RuntimeError, ValueError, LookupError, TypeError, ArithmeticError, MemoryError, EOFError)


def read_samples(path: str | Path) -> Floats:
    """The samples in a .npy file, or in the one dataset with three axes of an HDF5 file.

    Raises:
        SceneError: the file cannot be read, holds no such array, or less than its header states, or more than memory.
    """
    path = checks.path_of("path", path)
    try:
        return _of_npy(path) if path.suffix.lower() == ".npy" else _of_hdf5(path)
    except SceneError:
        raise
    except _DAMAGE as error:
        raise SceneError(f"cannot read the samples in {path}: {checks.shown(str(error))[1:-1]}") from error


def _of_npy(path: Path) -> Floats:
    size = path.stat().st_size
    with path.open("rb") as file:
        begin = file.read(12)
    if not begin.startswith(_MAGIC):
        raise SceneError(f"the file {path} must hold one array, as np.save writes it, got another kind of file")
    # NumPy allocates a header of the length that the file states.
    if int.from_bytes(begin[8 : 10 if begin[6:7] == b"\x01" else 12], "little") > size:
        raise SceneError(f"the file {path} must be whole, got a header that is longer than the file")
    try:
        # The map is refused where the file is shorter than its header states.
        found = np.load(path, mmap_mode="r", allow_pickle=False)
    except OSError:
        raise
    except Exception as error:
        # NumPy reads the header as Python, so a damaged one may raise any error of its parser.
        raise ValueError(f"it is no .npy file, or is damaged: {error}") from error
    _require(path, found.shape, found.dtype)
    return np.array(found)


def _of_hdf5(path: Path) -> Floats:
    import h5py

    from ...common import links

    with h5py.File(path, "r") as file:
        links.require_none(file, path)
        found: list[Any] = []
        file.visititems(lambda _name, one: found.append(one) if getattr(one, "ndim", 0) == 3 else None)
        if len(found) != 1:
            named = checks.listed(one.name for one in found) or "none"
            raise SceneError(f"the file {path} must hold one dataset with three axes, got {named}")
        (dataset,) = found
        size = _require(path, dataset.shape, dataset.dtype)
        active = path.stat().st_size * (_DENSEST if dataset.id.get_create_plist().get_nfilters() > 0 else 1)
        if size > active:
            raise SceneError(
                f"the file {path} must hold all samples, got {dataset.name} of shape {dataset.shape}, which takes "
                f"{checks.in_bytes(size)}, in a file of {checks.in_bytes(path.stat().st_size)}; write all of them"
            )
        return np.asarray(dataset[()])


def _require(path: Path, shape: tuple[int, ...], kind: np.dtype[Any]) -> float:
    """Return the size of an array [bytes], if it is one of numbers that fits in memory."""
    if kind.kind not in "iuf":
        raise SceneError(f"the file {path} must hold an array of numbers, got {kind}")
    size = float(math.prod(shape)) * kind.itemsize
    if size > checks.memory():
        raise SceneError(
            f"the file {path} must fit in memory, got an array of shape {shape}, which takes "
            f"{checks.in_bytes(size)}; this machine has {checks.in_bytes(checks.memory())}"
        )
    return size
