"""One run of a sweep, as a job."""

import contextlib
import dataclasses
from pathlib import Path
from typing import NamedTuple

from .. import scene_file
from ..errors import SceneError
from ..files import paths
from ..files.lock import only_writer
from ..run import machine
from ..run.preflight.admission import task_of
from ..serialization.plugins import allowed
from . import sent_modules
from .jobs import PATIENCE, JobEnd, Reporter, session_of
from .results import final, of_trajectory


class RunOrder(NamedTuple):
    """A run: its scene file and the path of that, the files that it writes, its threads, and the code that it names."""

    text: str
    source: Path
    trajectory: Path
    impacts: Path | None
    threads: int
    plugins: tuple[str, ...]
    modules: bytes | None = None


def run_variant(reporter: Reporter, order: RunOrder) -> JobEnd:
    """Carry out a run, or resume it: from its checkpoint if it has one, else from the start."""
    target = order.trajectory
    # A worker that ends because its parent was killed may still hold the lock.
    with only_writer(target, patience=PATIENCE):
        pass
    if order.modules is not None:
        sent_modules.take(order.modules)
    with allowed(order.plugins):
        job = scene_file.job_of(scene_file.document_of(order.text, order.source), order.text, order.source)
    if target.exists():
        before = of_trajectory(target, job.run.until)
        if before is not None:
            paths.checkpoint_of(target).unlink(missing_ok=True)  # a kill came before the checkpoint was removed
            return {"observables": before}
        if paths.checkpoint_of(target).exists():
            # A SceneError: the file is damaged, or of another version. The run starts again, and raises further errors.
            with contextlib.suppress(SceneError):
                return _simulated(job, order, reporter, resumes=True)
    return _simulated(job, order, reporter, resumes=False)


def _simulated(job: scene_file.Job, order: RunOrder, reporter: Reporter, resumes: bool) -> JobEnd:
    options = dataclasses.replace(
        job.run,
        trajectory=order.trajectory,
        impacts=order.impacts,
        threads=job.run.threads or order.threads,
        scene_text=job.text,
        progress=reporter.display(),
        resume=resumes,
        overwrite=not resumes,
    )
    try:
        with session_of(options, reporter.token) as session:
            task = task_of(job.scene, job.start(), job.method, options)
            end = machine.carry_out_task(task, session)
    except SceneError as error:
        raise job.located(error) from None
    return {"observables": final(end.observables), "wall_time": end.wall_time}
