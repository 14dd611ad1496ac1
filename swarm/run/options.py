"""Options of a run: the keywords of `simulate`, the [run] table of a scene file, the options of `swarm run`."""

import os
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..common import checks
from ..common.catalog import COLOURINGS
from ..common.frames import FrameTimes
from ..common.validated import Count, Flag, Positive, Validated, choice
from ..compiled_scene import CompiledScene
from ..errors import SceneError
from ..files import paths
from ..files.storage import Compression, KeptParticles, Precision, Storage
from ..methods.base import Method
from ..particles import Particles, TiedParticles
from ..scene import Scene
from ..sources.source import checked_sources
from ..surfaces.counter import checked_counters
from . import measures
from .progress import Display
from .tiers import CHOICES

# The shortest interval of checkpoints [s]: with shorter ones a run would do little else.
_OFTEN = 0.01
# The metadata of an option that is no key of [run], as it belongs to one session, not to the run.
_OF_A_SESSION = {"in_file": False}


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _logged(name: str, value: Any) -> Any:
    """Return `value` as "all", k for every k-th particle, or a tuple of numbers of particles."""
    if isinstance(value, str):
        known = value == "all"
    elif isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim):
        # `require_logged` checks that there is a particle with each of these numbers.
        known = len(value) > 0 and all(isinstance(i, (int, np.integer)) and i >= 0 for i in value)
    else:
        return checks.count(name, value)
    if not known:
        raise SceneError(
            f'{name} must be "all", k for every k-th particle, or a list of numbers of particles from 0 on, got '
            f"{value!r:.100}"
        )
    return value if isinstance(value, str) else tuple(sorted({int(i) for i in value}))


def _shown_live(name: str, value: Any) -> Any:
    return value if isinstance(value, str) else checks.flag(name, value)


def _displayed(name: str, value: Any) -> Any:
    return value if callable(value) or isinstance(value, Display) else checks.flag(name, value)


def _text(name: str, value: Any) -> str:
    if not isinstance(value, str):
        raise SceneError(f"{name} must be a text, or None, got {checks.shown(value)}")
    return value


def _target(name: str, value: Any) -> Path | None:
    return None if value is None else paths.target_of_run(name, value)


Target = Annotated[Any, _target]  # a Path or None after the check


@dataclass(frozen=True)
class RunOptions(Validated):
    """The length of a run, its files, and the way it is carried out: the keywords of `simulate`, which describes them.

    The keys of [run] in a scene file are fields of this class.

    Raises:
        SceneError: a value is out of its range, or two files are the same.
    """

    until: Positive
    every: Positive | None = None
    trajectory: Target = None
    recording: Target = None
    impacts: Target = None
    impact_particles: Annotated[Any, _logged] = "all"
    member_impacts: Flag = False
    observables: Annotated[Any, measures.checked] = field(default=None, metadata=_OF_A_SESSION)
    counters: Annotated[Any, checked_counters] = field(default=(), metadata=_OF_A_SESSION)
    record_particles: Count = 5000
    record_color: Annotated[str, choice(*COLOURINGS)] = "speed"
    record_megabytes: Positive = 100.0
    live: Annotated[Any, _shown_live] = field(default=False, metadata=_OF_A_SESSION)
    threads: Count | None = None
    progress: Annotated[Any, _displayed] = field(default=False, metadata=_OF_A_SESSION)
    overwrite: Flag = field(default=False, metadata=_OF_A_SESSION)
    scene_text: Annotated[str, _text] | None = field(default=None, metadata=_OF_A_SESSION)
    block_size: Count | None = field(default=None, metadata=_OF_A_SESSION)
    frames: KeptParticles = "all"
    precision: Precision = "float64"
    compression: Compression = "none"
    checkpoint: Annotated[float, partial(checks.at_least, bound=_OFTEN)] | None = None
    resume: Flag = field(default=False, metadata=_OF_A_SESSION)
    walltime: Positive | None = field(default=None, metadata=_OF_A_SESSION)
    compile: Annotated[str, choice(*CHOICES)] = "auto"
    seed: Annotated[int, checks.seed] = 0
    cluster: Any = field(default=None, metadata=_OF_A_SESSION)
    shards: Count | None = field(default=None, metadata=_OF_A_SESSION)
    sources: Annotated[Any, checked_sources] = field(default=None, metadata=_OF_A_SESSION)

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self.times  # raises an error if every is above until
        paths.check_distinct({**self.files(), "recording": self.recording}, {})
        if self.shards is not None and self.cluster is None:
            raise SceneError(f"shards must be None without a cluster, got {self.shards}; give cluster=")
        if self.impacts is None and self.impact_particles != "all":
            raise SceneError(
                f"impact_particles must go with a log of impacts, got {self.impact_particles!r:.100}; give impacts="
            )

    @cached_property
    def times(self) -> FrameTimes:
        """The times of the frames."""
        return FrameTimes(self.until, self.every)

    @cached_property
    def storage(self) -> Storage:
        """The parts that the trajectory keeps."""
        return Storage(self.frames, self.precision, self.compression)

    def files(self) -> dict[str, Path | None]:
        """Return the paths of the trajectory, of its checkpoint, and of the log of impacts, by their roles."""
        saved = None if self.trajectory is None else paths.checkpoint_of(self.trajectory)
        return {"trajectory": self.trajectory, "checkpoint": saved, "log of impacts": self.impacts}

    def thread_count(self) -> int:
        """Return the number of threads that compute."""
        return cores() if self.threads is None else self.threads

    def keeps_float32(self) -> bool:
        """Whether files of the run keep places in float32."""
        return self.precision == "float32" and (self.trajectory is not None or self.impacts is not None)

    def checkpoint_file(self) -> Path | None:
        """Return the checkpoint; None without a trajectory."""
        if self.trajectory is None and (self.checkpoint is not None or self.resume):
            raise SceneError("checkpoint and resume need the trajectory of the run, got none; add trajectory=")
        return self.files()["checkpoint"]


@dataclass(frozen=True)
class Task:
    """A checked run.

    Attributes:
        particles: a copy of the particles; for bodies, all their points.
        first: in a shard, the number of its first particle or body.
        start: in a shard, a digest of all particles of the run.
        scales: in a shard, the scales of the whole run (`tally.scales_of`).
    """

    compiled: CompiledScene
    particles: Particles
    method: Method
    options: RunOptions
    bodies: TiedParticles | None = None
    first: int = 0
    start: str = ""
    scales: tuple[float, float] | None = None

    @property
    def scene(self) -> Scene:
        """The scene as users describe it."""
        return self.compiled.scene

    @property
    def count(self) -> int:
        """The number of particles, or of bodies."""
        return len(self.particles if self.bodies is None else self.bodies)

    @property
    def is_coupled(self) -> bool:
        """Whether particles depend on one another, as they meet or move a wall. Such a run is one shard."""
        return self.particles.radius is not None or self.scene.reacts()

    @property
    def is_shard(self) -> bool:
        """Whether the task is a shard of a run."""
        return bool(self.start)
