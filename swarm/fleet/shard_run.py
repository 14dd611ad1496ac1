"""One shard of a run, as a job: from its start or from its checkpoint."""

import dataclasses
from pathlib import Path

from ..files import paths
from ..files.lock import only_writer
from ..run import machine
from . import shards
from .jobs import PATIENCE, JobEnd, Reporter, session_of


def run_shard(reporter: Reporter, folder: Path, k: int) -> JobEnd:
    """Run shard k of a folder."""
    if shards.end_of(folder, k).exists():
        return {}
    task = shards.task_of(folder, k)
    target = task.options.trajectory
    resumes = paths.checkpoint_of(target).exists()
    options = dataclasses.replace(
        task.options, progress=reporter.display(), resume=resumes, overwrite=not resumes, threads=1
    )
    with session_of(options, reporter.token) as session:
        # The system of a worker that died may still hold it.
        with only_writer(target, patience=PATIENCE):
            pass
        end = machine.carry_out_task(dataclasses.replace(task, options=options), session)
        shards.write_end(shards.end_of(folder, k), end)
    return {}
