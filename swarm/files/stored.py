"""HDF5 files of runs, read on demand, also while they are written or after their writer was killed."""

import contextlib
import functools
import operator
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from ..common import links
from ..common.checks import path_of
from ..errors import SceneError
from ..kernel.collection import uncollected
from ..methods import Method
from ..scene import Scene
from ..serialization import plugins, run_tables, tables
from ..surfaces.counter import Counter
from . import driver, layout, superblock
from .checksums import Checked
from .sources import DAMAGE, DamagedError, commands_for, reason, require_file

_STILL_WRITTEN = "already open"


class Stored:
    """A file on disk, as a context that closes it; `what` (the expected kind) and `opener` are for error sentences."""

    def __init__(self, path: str | Path, what: str, opener: str) -> None:
        self.path, self._opener = path_of("path", path), opener
        require_file(self.path, what)
        self._file = open_stored(self.path)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        if "_checked" in self.__dict__:
            self._checked.close()
        self._file.close()

    @functools.cached_property
    def _checked(self) -> Checked:
        """The reader of values, which compares them with their checksums."""
        with self._reading("its checksums") as file:
            return Checked(file, self.path, open_stored)

    def has_checksums(self) -> bool:
        """Whether the values have checksums, which files of older versions lack."""
        with self._reading("its checksums"):
            return self._checked.has_any()

    @contextlib.contextmanager
    def _reading(self, what: str) -> Iterator[Any]:
        """Return the open file, for reading `what`; an error is raised as a SceneError that says that it is damaged."""
        if not self._file:
            raise SceneError(f"{self.path} is closed; open it again with {self._opener}")
        try:
            yield self._file
        except DamagedError:
            raise
        except DAMAGE as error:
            raise DamagedError(f"{self.path} is damaged: {what}: {reason(error)}") from error

    # --- The run -----------------------------------------------------------------------------------------

    @property
    def count(self) -> int:
        """Number of particles, or of points of bodies, in the run; a file may keep fewer."""
        with self._reading("its number of particles"):
            return int(self._checked.constant("parameters/particles"))

    @property
    def start(self) -> str:
        """A digest of the particles at the start; "" if the file has no digest."""
        return self._text("start") if self._has("parameters/start") else ""

    @property
    def seed(self) -> int:
        """The seed of thermal walls; 0 if the file has no seed, as in versions without thermal walls."""
        return int(self._constant("seed", int, 0))

    @property
    def counters_text(self) -> str:
        """The counters of the run as text; "" for a run without counters."""
        return self._text("counters") if self._has("parameters/counters") else ""

    @property
    def counters(self) -> tuple[Counter, ...]:
        """The counters of the run."""
        with self._reading("its counters"):
            return run_tables.counters_of(parsed(self.counters_text).get("counter", []))

    @property
    def scene(self) -> Scene:
        """The scene of the run."""
        with self._reading("its scene") as file:
            table, arrays = parsed(self._text("scene")), file["parameters"].get(layout.ARRAYS, {})
            for name in arrays:
                self._checked.constant(f"parameters/{layout.ARRAYS}/{name}")
            surfaces = [tables.with_arrays(surface, arrays) for surface in table["surface"]]
            every = [one for surface in surfaces for one in _nested(surface)]
            own = any(surface["kind"] == "own" or plugins.is_named(surface["kind"]) for surface in every)
        # An OwnSurface is no damage: the error says that no file holds it.
        with contextlib.nullcontext() if own else self._reading("its scene"):
            return tables.scene_of(surfaces, *map(table.get, ("gravity", "period", "plane", "pairs")))

    @property
    def method(self) -> Method:
        """The method of the run; a user-defined method is only its name."""
        with self._reading("its method"):
            return tables.method_by_name(parsed(self._text("method")))

    def _has(self, name: str) -> bool:
        with self._reading(f"its {name}") as file:
            return name in file

    def _constant(self, name: str, kind: Callable[[Any], Any], missing: Any) -> Any:
        """Return a constant of the run, converted by `kind`; `missing` if the file has none of this name."""
        with self._reading(f"its {name}") as file:
            return kind(self._checked.constant(f"parameters/{name}")) if f"parameters/{name}" in file else missing

    def _text(self, name: str) -> str:
        with self._reading(f"its {name.replace('_', ' ')}"):
            return str(self._checked.constant(f"parameters/{name}"))


def parsed(text: str) -> dict[str, Any]:
    """Parse a TOML text of a file.

    A deeply nested text takes the recursion to its limit. If objects of h5py were collected there, they could not give
    back its lock, and the next thread to take it would wait for ever; so garbage collection is off meanwhile.
    """
    with uncollected():
        return tomllib.loads(text)


def open_stored(path: Path) -> h5py.File:
    """Open a file for reading.

    Raises:
        SceneError: it cannot be read, or a part of it is in another file that is not one of its shards.
    """
    file, what = _opened(path), "its texts"
    try:
        layout.require_heaps(path)
        what = "its structure"
        links.require_none(file, path, layout.JOINED)
    except SceneError:
        file.close()
        raise
    except DAMAGE as error:
        file.close()
        raise DamagedError(f"{path} is damaged: {what}: {reason(error)}") from error
    return file


def _opened(path: Path) -> h5py.File:
    # Without a chunk cache only the requested rows of a chunk are read: for one particle's path a thousandth.
    # Without locking, a file that is still being written can be read.
    options: dict[str, Any] = {"rdcc_nbytes": 0, "locking": False}
    try:
        try:
            if not driver.has_open(path):
                return driver.open_by(path, "r", **options)
        except OSError as error:
            if _STILL_WRITTEN not in str(error):
                raise
        # This process has it open, or its writer has marked it and not yet cleared the mark, or was killed in between.
        file = h5py.File(superblock.Unmarked(path), "r", **options)
        if not _joins(file):
            return file
        # The sources of virtual datasets are opened by the driver of the file that names them.
        file.close()
        return driver.open_by(path, "r", **options)
    except DAMAGE as error:
        if "signature not found" in str(error):
            raise DamagedError(
                f"{path} is not an HDF5 file, or its beginning is damaged; expected a trajectory or a log of impacts, "
                f"which are .h5 files{commands_for(path, '.h5')}"
            ) from error
        if getattr(error, "errno", None):
            raise SceneError(f"cannot read {path}: {reason(error)}") from error
        raise DamagedError(f"{path} is damaged: {reason(error)}") from error


def is_log(path: Path) -> bool:
    """Whether an HDF5 file is a log of impacts, and no trajectory."""
    require_file(path, "a trajectory or a log of impacts (.h5)")
    with open_stored(path) as file, contextlib.suppress(*DAMAGE):
        return "impacts" in file and "h5md" not in file
    return False  # damage is reported when more of the file is read


def _joins(file: h5py.File) -> bool:
    """Whether a file has virtual datasets."""
    return bool(file.visititems(lambda _name, found: getattr(found, "is_virtual", False) or None))


def _nested(table: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """The table of a surface, and all tables nested in it: those of its openings and parts."""
    yield table
    for key in tables.NESTED:
        for one in table.get(key, ()):
            yield from _nested(one)


def in_order(times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the times of frames after a check that they ascend."""
    finite(times)
    if (np.diff(times) <= 0.0).any():
        raise ValueError(f"frame {int((np.diff(times) <= 0.0).argmax()) + 1} is not after the one before it")
    return times


def finite(values: Any, entry: str = "frame") -> NDArray[Any]:
    """Return the values, one or more an entry, after a check that they are finite, as those of all runs are."""
    wrong = ~np.isfinite(values)
    if wrong.any():
        first = int(np.argwhere(wrong)[0, 0])
        raise ValueError(f"expected finite numbers, got {values[wrong][0]:g} at {entry} {first}")
    return np.asarray(values)


def whole(name: str, value: Any) -> int:
    """Return `value` as an integer."""
    try:
        if isinstance(value, (bool, np.bool_)):
            raise TypeError
        return operator.index(value)
    except TypeError:
        raise SceneError(f"{name} must be a whole number, got {value!r}") from None
