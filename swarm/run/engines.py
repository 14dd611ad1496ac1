"""The choice of the engine of a run.

The engine of points that are independent of one another is `Run` of the core, or `DoorRun` where walls become absent.
Bodies, balls and walls with a mass are wings: packages that the core does not import. Only this module loads them.
"""

import importlib
from types import ModuleType
from typing import Any

from ..kernel.random import seeding_of
from .base import BaseRun
from .doors import DoorRun
from .engine import Run
from .options import Task
from .tally import UNWATCHED, Watched


def wing(name: str) -> ModuleType:
    """Return a module of a wing, by its name in the package.

    >>> wing("bodies.admission").__name__
    'swarm.bodies.admission'
    """
    return importlib.import_module(f"{__package__.partition('.')[0]}.{name}")


def run_of(task: Task, watched: Watched = UNWATCHED) -> BaseRun:
    """Return the engine of a run, at its start."""
    scene, particles, method, options = task.scene, task.particles, task.method, task.options
    what: Any = particles
    kind: Any = DoorRun if scene.has_doors() else Run
    if task.bodies is not None:
        what, kind = (task.bodies, particles), wing("bodies.body_run").BodyRun
    elif particles.radius is None and scene.reacts():
        kind = wing("events.walls_run").ReactingRun
    elif particles.radius is not None and not method.is_rigid():
        kind = wing("grains.grains_run").GrainsRun
    elif particles.radius is not None:
        kind = wing("events.heavy_run").HeavyRun if scene.reacts() else wing("events.balls_run").CollidingRun
    how = options.thread_count(), options.block_size, options.compile, seeding_of(options.seed, task.first), watched
    run: BaseRun = kind(task.compiled, what, method, *how)
    return run
