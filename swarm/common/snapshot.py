"""The read-only arrays of the particles at a frame: copies that are made when they are first read."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from .checks import Vector

# Name -> array; None if a run does not have it.
Read = Callable[[str], Any]


class Snapshot:
    """The arrays of particles at a frame by their names, each copied when it is first read, and never written.

    Args:
        read: returns "position", "velocity", "mass", "impacts", and "image", "escape_time", "absorbed_time",
            "radius", "spin" and "collisions" or None for each.
        gravity: [m/s^2], or None.
        period: of the scene [m], or None.
        there: the number of particles that are present, the first ones, or their mask (N,); None for all.
    """

    def __init__(
        self,
        read: Read | None,
        gravity: Vector | None = None,
        period: tuple[float | None, ...] | None = None,
        there: int | NDArray[np.bool_] | None = None,
    ) -> None:
        self._read, self._gravity, self._period = read, gravity, period
        self._there: Any = there if isinstance(there, np.ndarray) else slice(there)
        self._known: dict[str, Any] = {}

    def read(self, name: str, frame: str) -> Any:
        """Return an array of the particles of a frame; `frame` is its name in a message.

        Raises:
            SceneError: the frame is over.
        """
        if name not in self._known:
            if self._read is None:
                raise SceneError(
                    f"{frame} is over, and frame.{name} was not read before: read it during the call, or later from "
                    "the frames of the trajectory (result.frames)"
                )
            found = self._energy(frame) if name == "energy" else self._copied(name, self._read)
            if found is not None:
                found.flags.writeable = False
            self._known[name] = found
        return self._known[name]

    def _copied(self, name: str, read: Read) -> NDArray[Any] | None:
        if (given := read(name)) is not None:
            return np.array(given[..., self._there])
        never = name in ("escape_time", "absorbed_time")
        return np.full(len(read("mass")[self._there]), np.nan) if never else None

    def _energy(self, frame: str) -> NDArray[np.float64]:
        r, v, mass = (self.read(name, frame) for name in ("position", "velocity", "mass"))
        energy = 0.5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        image = self.read("image", frame)
        for k, pull in enumerate(self._gravity or ()):
            length = self._period[k] if image is not None and self._period is not None else None
            if pull != 0.0:
                energy -= pull * (r[k] if length is None else r[k] + length * image[k])
        return np.asarray(mass * energy)

    def end(self) -> None:
        """End reading: the next frame begins."""
        self._read = None


# The snapshot of a frame without arrays.
NOTHING = Snapshot(None)
