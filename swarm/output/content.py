"""The part of a run that plots, titles and verdicts are made of."""

from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from ..bodies.body import Body
from ..methods import Method
from ..particles import Particles
from ..scene import Scene
from .gone import Gone, gone_at, without


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


def content_of(trajectory: Any) -> Content:
    """The part of a `Trajectory` that a picture shows."""
    trajectory.require_frames()
    last = len(trajectory) - 1
    numbers = {"start": 0, "end": last} if last else {"start": 0}
    numbers = numbers if trajectory.has_particles() else {}
    left = {name: gone_at(trajectory, k) for name, k in numbers.items()}
    return Content(
        trajectory.path.name,
        trajectory.scene,
        trajectory.method,
        trajectory.body,
        trajectory.count,
        trajectory.observed(),
        {name: trajectory.frame(k) for name, k in numbers.items()},
        {name: one for name, one in left.items() if one is not None},
    )
