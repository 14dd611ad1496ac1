"""`swarm run`: simulate a scene file."""

import dataclasses
import json
import sys
import time
from pathlib import Path
from typing import Annotated, Any

import click

from ..common import interrupt
from ..errors import CompleteError, SceneError, SwarmError, WallTimeError
from .options import Option, Positional
from .shown import EXIT_CODES, REASONS, Cluster, Plugins, Quiet, Walltime, command_again, table

# The end of the reason for which a run has stopped.
_COMPILED = ", after a compilation that was under way"


def run(  # noqa: PLR0913  one argument an option
    scene_file: Annotated[Path, Positional(metavar="SCENE.toml", help="The scene, the method and the run.")],
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="OUT.h5", help="Trajectory [default: SCENE.h5, here].")
    ] = None,
    threads: Annotated[int | None, Option(help="Threads [default: all cores]; results do not depend on it.")] = None,
    recording: Annotated[
        Path | None, Option("--record", metavar="OUT.rrd", help="Recording for Rerun and swarm view.")
    ] = None,
    impacts: Annotated[
        Path | None, Option("--impacts", metavar="OUT.h5", help="Log of every impact, for swarm.load_impacts.")
    ] = None,
    live: Annotated[bool, Option("--live", help="Show the run in a Rerun viewer.")] = False,
    overwrite: Annotated[bool, Option("--overwrite", help="Replace existing files.")] = False,
    quiet: Quiet = False,
    resume: Annotated[
        bool, Option("--resume", help="Continue from the last checkpoint of a run that was stopped.")
    ] = False,
    walltime: Walltime = None,
    compile: Annotated[
        str | None, Option(metavar="WHEN", help="Compile the kernels: auto, always or never [default: auto].")
    ] = None,
    cluster: Cluster = None,
    shards: Annotated[
        int | None, Option(help="Shards of a run on a cluster [default: one for each thread of its workers].")
    ] = None,
    plugins: Plugins = None,
    as_json: Annotated[bool, Option("--json", help="Print the outcome of the run as JSON, also if it fails.")] = False,
) -> None:
    """Simulate a scene file and write its trajectory."""
    began = time.monotonic()
    # An exception during an import may be lost. No file is open yet.
    with interrupt.importing():
        from .. import scene_file as files
        from ..authoring.file_run import check_outputs, named_alone
        from ..common.checks import duration
        from ..files import paths
        from ..run.simulation import carry_out

    def report(status: str, written: Path | None = None, **more: Any) -> None:
        if as_json:
            from .summary import numbers

            print(json.dumps({"status": status, **(numbers(written) if written else {}), **more}, indent=2))

    try:
        with interrupt.at_once():
            job = files.read(scene_file, plugins or ())
            alone = named_alone(job, trajectory=output, recording=recording, impacts=impacts)
            stored = scene_file.with_suffix(".h5").name if job.run.trajectory is None else job.run.trajectory
            target = paths.target_of("trajectory", output or stored)
            options = dataclasses.replace(
                job.run,
                trajectory=target,
                recording=recording or (None if resume else job.run.recording),
                impacts=impacts or job.run.impacts,
                live=live,
                threads=job.run.threads if threads is None else threads,
                progress=not quiet,
                overwrite=overwrite,
                scene_text=job.text,
                resume=resume,
                walltime=None if walltime is None else duration("--walltime", walltime),
                compile=compile or job.run.compile,
                cluster=cluster,
                shards=shards,
            )
            # Outputs are checked before particles are generated and kernels compiled.
            allow = "overwrite it by naming it on the command line: {} --overwrite"
            check_outputs(
                job, options, alone, allow, {name: f"{option} {{}}" for name, option in files.OUTPUTS.items()}
            )
            before, start = paths.identity(target), job.start()
            resumes = resume and paths.checkpoint_of(target).exists()
        try:
            result = carry_out(job.scene, start, job.method, options, began)
        except SceneError as error:
            raise job.located(error) from None
    except (KeyboardInterrupt, WallTimeError) as stop:
        status = "walltime" if isinstance(stop, WallTimeError) else "interrupted"
        # All files are closed, so a second signal may end the process.
        with interrupt.at_once():
            has_frames = target.exists() and (resumes or paths.identity(target) != before)
            reason = REASONS[status] + (_COMPILED * bool(getattr(stop, "compiled", 0.0)))
            again = _stopped(reason, target, has_frames, cluster is not None)
            report(status, target if has_frames else None, **({} if has_frames else {"frames": 0}), resume=again)
        raise click.exceptions.Exit(EXIT_CODES[status]) from None
    except CompleteError as error:
        print(error, file=sys.stderr)
        report("complete", target)
        return
    except SwarmError as error:
        report("failed", error=str(error))
        raise
    with interrupt.at_once():
        report("complete", target, wall_time=result.wall_time, compile_time=result.compile_time)
        if not (quiet or as_json):
            from .summary import of_result

            table(of_result(result, getattr(start, "volume", None), getattr(start, "volume_error", None)))


def _stopped(reason: str, target: Path, has_frames: bool, on_cluster: bool) -> str | None:
    """Print how to resume a run that was stopped; return that command, or None if it cannot be resumed."""
    from ..files import paths

    if not (has_frames or (on_cluster and paths.checkpoint_of(target).exists())):
        print(f"{reason}: no frame was finished, and nothing was written", file=sys.stderr)
        return None
    held = f"{reason}: {target} holds the frames that were finished" if has_frames else f"{reason}: no frame is whole"
    if not paths.checkpoint_of(target).exists():
        print(f"{held}; there was no time for a checkpoint to resume from", file=sys.stderr)
        return None
    command = command_again()
    print(f"{held}; resume with\n  {command}", file=sys.stderr)
    return command
