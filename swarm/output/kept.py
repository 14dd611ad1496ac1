"""What a trajectory keeps once, not of each frame: of its particles, and of the run."""

import functools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from . import layout
from .presented import Presented
from .stored import finite, parsed

if TYPE_CHECKING:
    from ..bodies.body import Body


class Kept(Presented):
    """The part of a `Trajectory` that is the same in all frames."""

    # What made the file, checked when it is opened.
    _makers: dict[str, str]

    @staticmethod
    def _comes(file: Any) -> bool:
        return f"particles/all/{layout.BIRTHS[0]}" in file

    def _births(self) -> NDArray[np.float64]:
        return np.asarray(self._checked.constant(f"particles/all/{layout.BIRTHS[0]}"))

    def has_births(self) -> bool:
        """Whether particles come during the run."""
        with self._reading("the births of its particles") as file:
            return self._comes(file)

    @property
    def radius(self) -> NDArray[np.float64] | None:
        """The radii of the particles that the file keeps [m], (N,); None of points."""
        if not self._has(f"particles/all/{layout.RADII}"):
            return None
        with self._reading("the radii of its particles"):
            return finite(self._checked.constant(f"particles/all/{layout.RADII}"), "particle")

    @property
    def birth_time(self) -> NDArray[np.float64]:
        """When each of the particles that the file keeps comes [s], (N,); 0 of those of the start."""
        with self._reading("the births of its particles") as file:
            if not self._comes(file):
                return np.zeros(len(file["particles/all/mass"]))
            return finite(self._births(), "particle")

    @property
    def birth_source(self) -> NDArray[np.int64]:
        """The number of the source of each of them, (N,); -1 of those of the start."""
        with self._reading("the sources of its particles") as file:
            if not self._comes(file):
                return np.full(len(file["particles/all/mass"]), -1)
            return np.asarray(self._checked.constant(f"particles/all/{layout.BIRTHS[1]}").astype(np.int64))

    @property
    def ids(self) -> NDArray[np.int64]:
        """The numbers of the particles that the file keeps, (N,)."""
        self._require_particles()
        with self._reading("the numbers of its particles"):
            ids = self._checked.constant("particles/all/id").astype(np.int64)
            if (np.diff(ids) <= 0).any() or ids[0] < 0 or ids[-1] >= self.count:
                raise ValueError(f"expected some of 0 to {self.count - 1}, each once and in order")
        return np.asarray(ids)

    @property
    def bonds(self) -> NDArray[np.int64]:
        """The pairs of points of bodies that are tied, (B, 2), as numbers of particles."""
        with self._reading("its bonds") as file:
            if "connectivity/bonds" not in file:
                return np.zeros((0, 2), np.int64)
            layout.dataset(file, "connectivity/bonds", "iu", (None, 2))
            bonds = self._checked.constant("connectivity/bonds").astype(np.int64)
            if len(bonds) and not (bonds.min() >= 0 and bonds.max() < self.count):
                raise ValueError(f"expected numbers from 0 to {self.count - 1}, got {bonds.min()} to {bonds.max()}")
        return np.asarray(bonds)

    def has_particles(self) -> bool:
        """Whether the file keeps particles."""
        return self._has("particles/all")

    def _require_particles(self) -> None:
        if not self.has_particles():
            raise SceneError(f'{self.path} keeps no particles: it was run with frames = "none"')

    @functools.cached_property
    def body(self) -> "Body | None":
        """The body whose copies were run; None for particles."""
        if not self._has("parameters/body"):
            return None
        from ..bodies.table import body_of

        with self._reading("its body"):
            body = body_of(parsed(self._text("body")))
            if len(body) * self.copies != self.count:
                raise ValueError(f"{self.copies} of {len(body)} points are not {self.count}")
        return body

    @property
    def copies(self) -> int:
        """Number of bodies that were run; 0 for particles."""
        with self._reading("its number of bodies") as file:
            return int(self._checked.constant("parameters/copies")) if "parameters/body" in file else 0

    @property
    def descriptions(self) -> dict[str, str]:
        """The texts that identify a run: scene, method and storage."""
        return {name: self._text(name) for name in ("scene", "method", "storage")}

    @property
    def scene_text(self) -> str | None:
        """The scene file that was run."""
        return self._text("scene_file") if self._has("parameters/scene_file") else None

    @property
    def until(self) -> float | None:
        """The end that the run was to reach [s]; None in files of older versions, and of runs on clusters."""
        with self._reading("its end") as file:
            return float(finite(self._checked.constant("parameters/until"))) if "parameters/until" in file else None

    @property
    def threads(self) -> int | None:
        """The threads of the last session of the run; None as for `until`."""
        with self._reading("its threads") as file:
            return int(self._checked.constant("parameters/threads")) if "parameters/threads" in file else None

    @property
    def wall_times(self) -> NDArray[np.float64] | None:
        """The seconds that the run had taken in all its sessions when each frame was written; None as for `until`."""
        with self._reading("its wall times") as file:
            if "parameters/wall_time" not in file:
                return None
            return finite(self._checked.rows("parameters/wall_time", 0, len(file["parameters/time"])))

    @property
    def makers(self) -> dict[str, str]:
        """What made the file, and when: "name", "version", "python", "numpy", "numba", "hdf5", "machine", "date"."""
        with self._reading("what made it"):
            self._checked.require_attributes("h5md/creator")
            return dict(self._makers)
