"""The particles that a trajectory keeps, and the form of their numbers."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ..common import checks
from ..common.validated import Validated, choice
from ..errors import SceneError


def _kept(name: str, value: Any) -> Any:
    if not isinstance(value, str):
        return checks.count(name, value)
    if value not in ("all", "none"):
        raise SceneError(f'{name} must be "all", "none", or k for every k-th particle, got {value!r}')
    return value


KeptParticles = Annotated[str | int, _kept]
Precision = Annotated[str, choice("float32", "float64")]
Compression = Annotated[str, choice("none", "gzip", "lzf")]


@dataclass(frozen=True)
class Storage(Validated):
    """The part of every frame that a trajectory keeps; observables are always kept in full.

    Args:
        frames: "all" particles, "none", or k: every k-th one, beginning with the first.
        precision: "float64", or "float32", which takes half the space.
        compression: "none", "gzip" (level 1, bytes shuffled), or "lzf", which is twice as fast.

    Raises:
        SceneError: an argument has an invalid value.

    >>> len(range(10)[Storage(frames=4).kept()])
    3
    """

    frames: KeptParticles = "all"
    precision: Precision = "float64"
    compression: Compression = "none"

    def kept(self, first: int = 0) -> slice:
        """The slice of the kept particles among those from number `first` on."""
        if isinstance(self.frames, str):
            return slice(None) if self.frames == "all" else slice(0)
        return slice(-first % self.frames, None, self.frames)

    def bytes_of(self, n: int) -> int:
        """Bytes of n particles in a frame without compression."""
        return len(range(n)[self.kept()]) * (6 * np.dtype(self.precision).itemsize + np.dtype(np.int64).itemsize)
