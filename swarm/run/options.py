"""Options of a run: the keywords of `simulate`, the [run] table of a scene file, the options of `swarm run`."""

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..common import checks
from ..common.catalog import COLOURINGS
from ..common.frames import FrameTimes
from ..errors import SceneError
from ..files import paths
from ..files.storage import Storage
from ..methods.base import Method
from ..particles import Particles, TiedParticles
from ..scene import Scene
from ..sources.source import checked_sources
from ..surfaces.counter import checked_counters
from . import measures
from .progress import Display
from .tiers import CHOICES

# At shorter intervals [s] a run would do little but save checkpoints.
_OFTEN = 0.01
# Not a key of [run]: it belongs to one session, not to the run.
_OF_A_SESSION = {"in_file": False}


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(frozen=True)
class RunOptions:
    """The length of a run, its files, and the way it is carried out; `simulate` describes each.

    Raises:
        SceneError: a value is out of its range, or two files are the same.
    """

    until: float
    every: float | None = None
    trajectory: Any = None  # then a Path or None, as `recording`
    recording: Any = None
    impacts: Any = None
    impact_particles: Any = "all"
    member_impacts: bool = False
    observables: Any = field(default=None, metadata=_OF_A_SESSION)  # then functions by their names
    counters: Any = field(default=(), metadata=_OF_A_SESSION)
    record_particles: int = 5000
    record_color: str = "speed"
    record_megabytes: float = 100.0
    live: Any = field(default=False, metadata=_OF_A_SESSION)
    threads: int | None = None
    progress: Any = field(default=False, metadata=_OF_A_SESSION)
    overwrite: bool = field(default=False, metadata=_OF_A_SESSION)
    scene_text: str | None = field(default=None, metadata=_OF_A_SESSION)
    block_size: int | None = field(default=None, metadata=_OF_A_SESSION)
    frames: str | int = "all"
    precision: str = "float64"
    compression: str = "none"
    checkpoint: float | None = None
    resume: bool = field(default=False, metadata=_OF_A_SESSION)
    walltime: float | None = field(default=None, metadata=_OF_A_SESSION)
    compile: str = "auto"
    seed: int = 0
    cluster: Any = field(default=None, metadata=_OF_A_SESSION)
    shards: int | None = field(default=None, metadata=_OF_A_SESSION)
    sources: Any = field(default=None, metadata=_OF_A_SESSION)

    def __post_init__(self) -> None:
        for name in ("trajectory", "recording", "impacts"):
            value = getattr(self, name)
            object.__setattr__(self, name, None if value is None else paths.target_of_run(name, value))
        paths.check_distinct({**self.files(), "recording": self.recording}, {})
        if self.checkpoint is not None:
            object.__setattr__(self, "checkpoint", checks.at_least("checkpoint", self.checkpoint, _OFTEN))
        if self.walltime is not None:
            object.__setattr__(self, "walltime", checks.positive("walltime", self.walltime))
        times = self.times
        object.__setattr__(self, "until", times.until)
        for name in ("threads", "block_size", "shards"):
            if getattr(self, name) is not None:
                checks.count(name, getattr(self, name))
        if self.shards is not None and self.cluster is None:
            raise SceneError(f"shards must be None without a cluster, got {self.shards}; give cluster=")
        checks.one_of("compile", self.compile, CHOICES)
        for name in ("member_impacts", "overwrite", "resume"):
            object.__setattr__(self, name, checks.flag(name, getattr(self, name)))
        self._check_recording()
        object.__setattr__(self, "observables", measures.checked(self.observables))
        object.__setattr__(self, "counters", checked_counters(self.counters))
        self._check_impacts()
        object.__setattr__(self, "seed", checks.seed("seed", self.seed))
        object.__setattr__(self, "sources", checked_sources(self.sources))
        _ = self.storage

    def _check_recording(self) -> None:
        """Raise a SceneError if an option of a recording or a display is wrong, even if the run has neither of them."""
        checks.count("record_particles", self.record_particles)
        checks.one_of("record_color", self.record_color, COLOURINGS)
        object.__setattr__(self, "record_megabytes", checks.positive("record_megabytes", self.record_megabytes))
        if not isinstance(self.live, str):
            checks.flag("live", self.live)
        if not callable(self.progress) and not isinstance(self.progress, Display):
            checks.flag("progress", self.progress)
        if self.scene_text is not None and not isinstance(self.scene_text, str):
            raise SceneError(f"scene_text must be a text, or None, got {checks.shown(self.scene_text)}")

    def _check_impacts(self) -> None:
        """Raise a SceneError unless impact_particles is "all", k, or numbers of particles; make these a tuple."""
        given = self.impact_particles
        if isinstance(given, str):
            known = given == "all"
        elif isinstance(given, (list, tuple)) or (isinstance(given, np.ndarray) and given.ndim):
            # A number is known when it is checked against that of the particles.
            known = len(given) > 0 and all(isinstance(i, (int, np.integer)) and i >= 0 for i in given)
            object.__setattr__(self, "impact_particles", tuple(sorted({int(i) for i in given})) if known else given)
        else:
            object.__setattr__(self, "impact_particles", checks.count("impact_particles", given))
            known = True
        if not known:
            raise SceneError(
                'impact_particles must be "all", k for every k-th particle, or a list of numbers of particles from 0 '
                f"on, got {given!r:.100}"
            )
        if self.impacts is None and self.impact_particles != "all":
            raise SceneError(f"impact_particles must go with a log of impacts, got {given!r:.100}; give impacts=")

    @property
    def times(self) -> FrameTimes:
        """The times of the frames."""
        return FrameTimes(self.until, self.every)

    @property
    def storage(self) -> Storage:
        """The parts that the trajectory keeps."""
        return Storage(self.frames, self.precision, self.compression)

    def files(self) -> dict[str, Path | None]:
        """The trajectory, its checkpoint, which may never be made, and the log of impacts."""
        saved = None if self.trajectory is None else paths.checkpoint_of(self.trajectory)
        return {"trajectory": self.trajectory, "checkpoint": saved, "log of impacts": self.impacts}

    def thread_count(self) -> int:
        """Number of threads that compute."""
        return cores() if self.threads is None else self.threads

    def keeps_float32(self) -> bool:
        """Whether files of the run keep places in float32."""
        return self.precision == "float32" and (self.trajectory is not None or self.impacts is not None)

    def checkpoint_file(self) -> Path | None:
        """The checkpoint; None without a trajectory."""
        if self.trajectory is None and (self.checkpoint is not None or self.resume):
            raise SceneError("checkpoint and resume need the trajectory of the run, got none; add trajectory=")
        return self.files()["checkpoint"]


@dataclass(frozen=True)
class Task:
    """A run, checked; the particles are its own copy. Of bodies they are all points.

    Of a shard of a run `start` is a digest of all particles of that run, `first` the number of the first particle, or
    body, of the shard, and `scales` those of the whole run (`tally.scales_of`).
    """

    scene: Scene
    particles: Particles
    method: Method
    options: RunOptions
    bodies: TiedParticles | None = None
    first: int = 0
    start: str = ""
    scales: tuple[float, float] | None = None

    @property
    def is_shard(self) -> bool:
        """Whether it is a shard of a run."""
        return bool(self.start)
