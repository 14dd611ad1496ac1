"""Checks of arguments with a row for each of many bodies: each returns an array that cannot be changed."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import SceneError
from ..state import Floats
from .checks import FEW, LARGEST, SMALLEST, array, require_memory

# The most memory of a ball and of another body while their table and the grid of cells are made [bytes]: for balls
# arrays (260 measured), for others first an object for each (2000 capsules, 2750 cylinders).
_BALL, _BODY = 300, 3000


def balls(name: str, value: ArrayLike) -> Floats:
    """Return `value` as points (n, 3), one for each ball."""
    return bodies(name, value, _BALL)


def bodies(name: str, value: ArrayLike, each: int = _BODY) -> Floats:
    """Return `value` as points (n, 3), one for each body, which takes `each` bytes."""
    # With the grid the bodies take more than the numbers themselves, which are checked below.
    many = len(value) if isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim) else 0
    if many > FEW:
        require_memory(name, f" with the grid of their cells, got {many:.6g} bodies, which take", each * many)
    rows = array(name, value)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise SceneError(f"{name} must have shape (n, 3), one row a body, got {rows.shape}")
    if not len(rows):
        raise SceneError(f"{name} must have at least one row, got none")
    bad = np.flatnonzero(~(np.abs(rows) <= LARGEST).all(axis=1))
    if bad.size:
        raise SceneError(f"{name}[{bad[0]}] must be three finite numbers, got {tuple(rows[bad[0]].tolist())}")
    return kept(rows)


def lengths(name: str, value: ArrayLike, count: int) -> Floats:
    """Return `value` as lengths (n,) above 0, given for each body or for all."""
    given = array(name, value)
    if given.ndim > 1 or (given.ndim == 1 and len(given) != count):
        raise SceneError(f"{name} must be one number or {count}, one for each of the centers, got shape {given.shape}")
    bad = np.flatnonzero(~((given >= SMALLEST) & (given <= LARGEST)))
    if bad.size:
        where = f"{name}[{bad[0]}]" if given.ndim else name
        raise SceneError(f"{where} must be a length above 0 m, got {np.atleast_1d(given)[bad[0]]:g}")
    return kept(np.broadcast_to(given, (count,)))


def widths(name: str, value: ArrayLike, count: int) -> Floats:
    """Return `value` as three lengths above 0 for each body (n, 3), given for each or for all."""
    return _rows(name, value, count, 3, lambda rows: (rows >= SMALLEST) & (rows <= LARGEST), "three lengths above 0 m")


def directions(name: str, value: ArrayLike, count: int) -> Floats:
    """Return `value` as a nonzero vector for each body (n, 3), given for each or for all."""
    return _rows(name, value, count, 3, _is_some, "three finite numbers, not all 0")


def quaternions(name: str, value: ArrayLike, count: int) -> Floats:
    """Return `value` as a nonzero quaternion for each body (n, 4), given for each or for all."""
    return _rows(name, value, count, 4, _is_some, "four finite numbers (w, x, y, z), not all 0")


def _is_some(rows: Floats) -> NDArray[np.bool_]:
    """Return which rows are finite and not 0."""
    return np.asarray((np.abs(rows) <= LARGEST) & (rows != 0.0).any(axis=1)[:, None])


def _rows(
    name: str, value: ArrayLike, count: int, columns: int, good: Callable[[Floats], NDArray[np.bool_]], expected: str
) -> Floats:
    given = array(name, value)
    if given.shape not in ((columns,), (count, columns)):
        raise SceneError(
            f"{name} must have {columns} numbers, or {count} rows of them, one for each of the centers, got shape "
            f"{given.shape}"
        )
    bad = np.flatnonzero(~good(np.atleast_2d(given)).all(axis=1))
    if bad.size:
        where, row = (f"{name}[{bad[0]}]" if given.ndim == 2 else name), np.atleast_2d(given)[bad[0]]
        raise SceneError(f"{where} must be {expected}, got {tuple(row.tolist())}")
    return kept(np.broadcast_to(given, (count, columns)))


def kept(values: Floats) -> Floats:
    """Return a copy that cannot be changed."""
    copy = np.array(values, np.float64)
    copy.setflags(write=False)
    return copy
