"""The part of a run that plots, titles and verdicts are made of."""

from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from ..bodies.body import Body
from ..methods import Method
from ..particles import Particles
from ..scene import Scene
from .gone import Gone, without


@dataclass(frozen=True)
class Content:
    """The part of a run that a picture shows.

    Attributes:
        name: of the file, or "".
        count: number of particles, or of points of bodies, that were run.
        seen: the observables, one entry a frame.
        frames: the particles at the "start" and at the "end", as far as they are known.
        gone: who of them has escaped or was absorbed by then.
    """

    name: str
    scene: Scene
    method: Method
    body: Body | None
    count: int
    seen: dict[str, NDArray[Any]]
    frames: dict[str, Particles]
    gone: dict[str, Gone] = field(default_factory=dict)

    def inside(self, name: str) -> Particles:
        """The particles of a frame, with those that have gone at NaN."""
        return without(self.frames[name], self.gone.get(name))
