"""Many bodies of one kind as one surface: what their descriptions have in common."""

from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...checks import LARGEST, SMALLEST, array, in_bytes, memory
from ...errors import SceneError
from ..surface import UNBOUNDED, Box, Surface
from .grid import grid_of
from .members import Members, nearest

Floats = NDArray[np.float64]
# What a body takes in its table and in the grid of cells [bytes], and a number of them that fits on every machine.
_BODY, _FEW = 300, 1_000_000


class Many(Surface):
    """Solid bodies of one kind; particles live outside of all of them. They may overlap."""

    def __post_init__(self) -> None:
        super().__post_init__()
        side, name = getattr(self, "side", "outside"), type(self).__name__
        if side != "outside":
            raise SceneError(f'side must be "outside" for {name}, which are solids, got {side!r}')
        for what in ("rotation", "motion", "mass", "inertia"):
            if getattr(self, what) is not None:
                raise SceneError(f"{what} must be None for {name}, got {getattr(self, what)!r}")

    def __len__(self) -> int:
        return len(self.centers)  # type: ignore[attr-defined]

    def __repr__(self) -> str:
        """Their kind and number, and the laws of their wall."""
        laws = [f for f in fields(self) if f.kw_only and getattr(self, f.name) != f.default]
        return (
            ", ".join([f"{type(self).__name__}(<{len(self)}>", *(f"{f.name}={getattr(self, f.name)!r}" for f in laws)])
            + ")"
        )

    # --- For kernels -------------------------------------------------------------------------------------

    def corners(self) -> tuple[Floats, Floats]:
        """The bounds of every body, its low and high corners (3, n), infinite where it has no end."""
        raise NotImplementedError

    def reaches(self, bodies: NDArray[np.int64], low: Floats, high: Floats) -> NDArray[np.bool_]:
        """Which of these bodies may have a point in common with the boxes that have these corners (3, pairs)."""
        return np.ones(len(bodies), np.bool_)

    def table(self) -> tuple[Any, Floats]:
        """The numbers of one body, and the table of all."""
        raise NotImplementedError

    @cached_property
    def members(self) -> Members:
        """What kernels take."""
        like, table = self.table()
        return Members(like, table, grid_of(*self.corners(), self.reaches))

    def walls(self) -> tuple[Members]:
        return (self.members,)

    # --- For users ---------------------------------------------------------------------------------------

    def bounds(self) -> Box:
        return UNBOUNDED

    def extent(self) -> float:
        low, high = self.corners()
        return float(np.abs(np.where(np.isfinite([low, high]), [low, high], 0.0)).max())

    def phi(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        """phi of the nearest body at points (3, N): below 0 in it, above 0 outside of all; shape (N,)."""
        return np.asarray(self._of_nearest(points)[3])

    def gradient(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        """Gradient of that phi at points (3, N); shape (3, N)."""
        return self._of_nearest(points)[:3]

    def _of_nearest(self, points: ArrayLike) -> NDArray[np.float64]:
        rows = self._own_rows(points, 0.0)
        flat = np.ascontiguousarray(np.array(rows).reshape(3, -1))
        found = np.empty((4, flat.shape[1]))
        with np.errstate(all="ignore"):
            nearest(self.members, flat, found)
        return found.reshape(4, *np.shape(rows.x))


def bodies(name: str, value: ArrayLike) -> Floats:
    """`value` as points (n, 3), one a body."""
    rows = array(name, value)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise SceneError(f"{name} must have shape (n, 3), one row a body, got {rows.shape}")
    if not len(rows):
        raise SceneError(f"{name} must have at least one row, got none")
    if len(rows) > _FEW and _BODY * len(rows) > memory():
        raise SceneError(
            f"{name} must fit in memory with the grid of their cells, got {len(rows):.6g} bodies, which take "
            f"{in_bytes(_BODY * len(rows))}; this machine has {in_bytes(memory())}"
        )
    bad = np.flatnonzero(~(np.abs(rows) <= LARGEST).all(axis=1))
    if bad.size:
        raise SceneError(f"{name}[{bad[0]}] must be three finite numbers, got {tuple(rows[bad[0]].tolist())}")
    return _kept(rows)


def lengths(name: str, value: ArrayLike, count: int) -> Floats:
    """`value` as lengths (n,) above 0, or one for all bodies."""
    given = array(name, value)
    if given.ndim > 1 or (given.ndim == 1 and len(given) != count):
        raise SceneError(f"{name} must be one number or {count}, one for each of the centers, got shape {given.shape}")
    bad = np.flatnonzero(~((given >= SMALLEST) & (given <= LARGEST)))
    if bad.size:
        where = f"{name}[{bad[0]}]" if given.ndim else name
        raise SceneError(f"{where} must be a length above 0 m, got {np.atleast_1d(given)[bad[0]]:g}")
    return _kept(np.broadcast_to(given, (count,)))


def _kept(values: Floats) -> Floats:
    """A copy that stays as it is."""
    copy = np.array(values, np.float64)
    copy.setflags(write=False)
    return copy
