"""The part of a run that plots, titles and verdicts are made of."""

from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from ..bodies.body import Body
from ..methods import Method
from ..particles import Particles
from ..scene import Scene


@dataclass(frozen=True)
class Content:
    """The part of a run that a picture shows.

    Attributes:
        name: of the file, or "".
        count: number of particles, or of points of bodies, that were run.
        seen: the observables, one entry a frame.
        frames: the particles at the "start" and at the "end", as far as they are known.
    """

    name: str
    scene: Scene
    method: Method
    body: Body | None
    count: int
    seen: dict[str, NDArray[Any]]
    frames: dict[str, Particles]
