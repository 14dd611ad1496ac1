"""The particles that a trajectory keeps, and their form."""

from dataclasses import dataclass

import numpy as np

from ..common import checks
from ..errors import SceneError

_PRECISIONS = ("float32", "float64")
_COMPRESSIONS = ("none", "gzip", "lzf")


@dataclass(frozen=True)
class Storage:
    """The part of every frame that a trajectory keeps; observables are always kept in full.

    Args:
        frames: "all" particles, "none", or k: every k-th one, beginning with the first.
        precision: "float64", or "float32", which takes half the space.
        compression: "none", "gzip" (level 1, bytes shuffled), or "lzf", which is twice as fast.

    Raises:
        SceneError: an argument has another value.

    >>> len(range(10)[Storage(frames=4).kept()])
    3
    """

    frames: str | int = "all"
    precision: str = "float64"
    compression: str = "none"

    def __post_init__(self) -> None:
        if isinstance(self.frames, str):
            if self.frames not in ("all", "none"):
                raise SceneError(f'frames must be "all", "none", or k for every k-th particle, got {self.frames!r}')
        else:
            checks.count("frames", self.frames)
        checks.one_of("precision", self.precision, _PRECISIONS)
        checks.one_of("compression", self.compression, _COMPRESSIONS)

    def kept(self, first: int = 0) -> slice:
        """The particles that it keeps, of those from number `first` on."""
        if isinstance(self.frames, str):
            return slice(None) if self.frames == "all" else slice(0)
        return slice(-first % self.frames, None, self.frames)

    def bytes_of(self, n: int) -> int:
        """Bytes that n particles take in a frame, if they are not compressed."""
        return len(range(n)[self.kept()]) * (6 * np.dtype(self.precision).itemsize + np.dtype(np.int64).itemsize)
