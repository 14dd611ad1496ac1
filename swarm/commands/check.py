"""`swarm check`: what a scene file will do."""

import dataclasses
from pathlib import Path
from typing import Annotated

import typer

from .shown import Plugins, table


def check(
    scene_file: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="The scene, the method and the run.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="OUT.h5", help="Trajectory [default: SCENE.h5, here].")
    ] = None,
    threads: Annotated[int | None, typer.Option(help="Threads [default: all cores].")] = None,
    plugins: Plugins = None,
) -> None:
    """Say what a scene file will do, with hints, sizes and about its time, without running it."""
    from ..authoring.outlook import outlook
    from ..scene_file import read

    job = read(scene_file, plugins or ())
    stored = scene_file.with_suffix(".h5").name if job.run.trajectory is None else job.run.trajectory
    target = Path(output or stored)
    options = dataclasses.replace(job.run, trajectory=target, threads=job.run.threads if threads is None else threads)
    table(outlook(dataclasses.replace(job, run=options), target))
