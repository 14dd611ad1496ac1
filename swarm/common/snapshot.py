"""The read-only arrays of the particles at a frame: views, or copies that are made when they are read."""

import gc
import weakref
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from .checks import Vector

# Name -> array; None if a run does not have it.
Read = Callable[[str], Any]


class Snapshot:
    """The arrays of particles at a frame by their names, each read once and never written.

    Args:
        read: returns "position", "velocity", "mass", "impacts", and "image", "escape_time", "absorbed_time",
            "radius", "spin" and "collisions" or None for each.
        gravity: [m/s^2], or None.
        period: of the scene [m], or None.
        there: the number of particles that are present, the first ones, or their mask (N,); None for all.
        copies: whether arrays are copied when they are read, so that they stay the same.
    """

    def __init__(
        self,
        read: Read | None,
        gravity: Vector | None = None,
        period: tuple[float | None, ...] | None = None,
        there: int | NDArray[np.bool_] | None = None,
        copies: bool = False,
    ) -> None:
        self._read, self._gravity, self._period, self._copies = read, gravity, period, copies
        self._there: Any = there if isinstance(there, np.ndarray) else slice(there)
        self._known: dict[str, Any] = {}
        self._views: dict[str, NDArray[Any]] = {}

    def read(self, name: str, frame: str) -> Any:
        """Return an array of the particles of a frame; `frame` is its name in a message.

        Raises:
            SceneError: the frame is over.
        """
        if name in self._known or name in self._views:
            return self._known.get(name, self._views.get(name))
        if self._read is None:
            raise SceneError(
                f"{frame} is over, and frame.{name} was not read before: read it during the call, or later from the "
                "frames of the trajectory (result.frames)"
            )
        if name == "energy":
            self._known[name] = self._energy(frame)
        elif (given := self._read(name)) is None:
            n = len(self._read("mass")[self._there])
            self._known[name] = np.broadcast_to(np.nan, n) if name in ("escape_time", "absorbed_time") else None
        elif self._copies:
            self._known[name] = _locked(np.array(given[..., self._there]))
        else:
            self._views[name] = _view_of(given[..., self._there])
        return self._known.get(name, self._views.get(name))

    def _energy(self, frame: str) -> NDArray[np.float64]:
        r, v, mass = (self.read(name, frame) for name in ("position", "velocity", "mass"))
        energy = 0.5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        image = self.read("image", frame)
        for k, pull in enumerate(self._gravity or ()):
            length = self._period[k] if image is not None and self._period is not None else None
            if pull != 0.0:
                energy -= pull * (r[k] if length is None else r[k] + length * image[k])
        return _locked(np.asarray(mass * energy))

    def let_go(self) -> list[str]:
        """Release all views; return the names of views still in use: the next frame would change their values."""
        views = {name: weakref.ref(view) for name, view in self._views.items()}
        self._views.clear()
        if all(view() is None for view in views.values()):
            return []
        gc.collect()  # a cycle of references holds nothing
        return [name for name, view in views.items() if view() is not None]

    def end(self) -> None:
        """End reading: the next frame begins."""
        self._read = None


# The snapshot of a frame without arrays.
NOTHING = Snapshot(None)


def _locked(array: NDArray[Any]) -> NDArray[Any]:
    array.flags.writeable = False
    return array


def _view_of(array: NDArray[Any]) -> NDArray[Any]:
    """Return a read-only view, which lives as long as any view of it."""
    # NumPy makes views of a view into views of the array itself, except for memory that no array owns.
    locked: Any = _locked(array.view())
    return np.asarray(memoryview(locked))
