"""The content of plots, titles and verdicts: a part of a run."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from ..bodies.body import Body
from ..errors import SceneError
from ..methods import Method
from ..particles import Particles
from ..scene import Scene
from .gone import Gone, gone_at, gone_of, without


@dataclass(frozen=True)
class Content:
    """The data of a run that a picture shows.

    Attributes:
        name: the name of the file, or "".
        count: number of particles, or of points of bodies, in the run.
        seen: the observables, one entry a frame.
        frames: the particles at the "start" and at the "end", if they are known.
        gone: for each frame, a mask of the particles that had escaped or been absorbed by then.
        counters: the counters of the run, if the file keeps them.
        births: the time at which each particle came [s], or NaN, and the number of its source; None: not known.
    """

    name: str
    scene: Scene
    method: Method
    body: Body | None
    count: int
    seen: dict[str, NDArray[Any]]
    frames: dict[str, Particles]
    gone: dict[str, Gone] = field(default_factory=dict)
    counters: Sequence[Any] = ()
    births: tuple[NDArray[Any], NDArray[Any]] | None = None

    def inside(self, name: str) -> Particles:
        """The particles of a frame; those that left the scene have positions of NaN."""
        return without(self.frames[name], self.gone.get(name))


def content_of(trajectory: Any) -> Content:
    """The data of a `Trajectory` that a picture shows."""
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
        trajectory.counters,
        births_of(trajectory),
    )


def births_of(trajectory: Any) -> tuple[NDArray[Any], NDArray[Any]] | None:
    """The time at which each particle of a `Trajectory` came, and the number of its source; None if not kept."""
    known = trajectory.has_particles() and trajectory.has_births()
    return (trajectory.birth_time, trajectory.birth_source) if known else None


def content_of_result(result: Any, what: str) -> Content:
    """The data of a `Result` that a picture shows; `what` names their use in an error."""
    if result.scene is None or result.method is None:
        raise SceneError(f"{what} needs a Result that knows its scene and its method, got one without them")
    body = None if result.bodies is None else result.bodies.body
    name, frames = "", {}
    counters: Sequence[Any] = ()
    births = None
    if result.trajectory is not None and result.trajectory.is_file():
        from ..files.trajectory import load

        name = result.trajectory.name
        with load(result.trajectory) as written:
            counters, births = written.counters, births_of(written)
            frames = {"start": written.frame(0)} if written.has_particles() else {}
    frames["end"] = result.particles
    left = {"end": gone_of((result.escape_time, result.absorbed_time))} if body is None else {}
    count, seen = len(result.particles), result.observables
    return Content(name, result.scene, result.method, body, count, seen, frames, left, counters, births)
