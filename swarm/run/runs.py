"""The run of a task: one class for particles alone, one for bodies, one for walls that react."""

from .base import BaseRun
from .bodies import BodyRun
from .engine import Run
from .options import Task
from .reacting import ReactingRun
from .state import Seeding
from .tally import Watched

_UNWATCHED = Watched()


def run_of(task: Task, watched: Watched = _UNWATCHED) -> BaseRun:
    """The state of a run at its start, and the threads that advance it."""
    options = task.options
    how = options.thread_count(), options.block_size, options.compile
    if task.bodies is not None:
        return BodyRun(task.scene, task.bodies, task.particles, task.method, *how, task.first)
    if task.scene.reacts():
        return ReactingRun(task.scene, task.particles, task.method, *how)
    return Run(task.scene, task.particles, task.method, *how, Seeding(options.seed, task.first), watched)
