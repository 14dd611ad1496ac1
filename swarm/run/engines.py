"""The engines of runs, and how one is chosen. The engines of wings are loaded here, by their names, and nowhere else.

A run of points that are independent of one another is an engine of the core, `Run`, or where walls come and go
`DoorRun`. Bodies, balls and walls with a mass are wings: the core imports none of their modules.
"""

import importlib
from types import ModuleType

from .base import BaseRun
from .doors import DoorRun
from .engine import Run
from .options import Task
from .state import Seeding
from .tally import Watched

_UNWATCHED = Watched()


def wing(name: str) -> ModuleType:
    """A module of a wing, by its name in the package.

    >>> wing("bodies.admission").__name__
    'swarm.bodies.admission'
    """
    return importlib.import_module(f"{__package__.partition('.')[0]}.{name}")


def run_of(task: Task, watched: Watched = _UNWATCHED) -> BaseRun:
    """The state of a run at its start, and the threads that advance it."""
    scene, particles, method, options = task.scene, task.particles, task.method, task.options
    how = options.thread_count(), options.block_size, options.compile
    run: BaseRun
    if task.bodies is not None:
        bodies = wing("bodies.body_run").BodyRun(scene, task.bodies, particles, method, *how, task.first)
        bodies.tally = watched.tally
        run = bodies
    elif particles.radius is None and scene.reacts():
        run = wing("events.walls_run").ReactingRun(scene, particles, method, *how, watched.tally)
    else:
        if particles.radius is None:
            kind = DoorRun if scene.has_doors() else Run
        elif not method.is_rigid():
            kind = wing("grains.grains_run").GrainsRun
        elif scene.reacts():
            kind = wing("events.heavy_run").HeavyRun
        else:
            kind = wing("events.balls_run").CollidingRun
        run = kind(scene, particles, method, *how, Seeding(options.seed, task.first), watched)
    return run
