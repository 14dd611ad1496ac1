"""The commands. No physics, and no heavy import before it is needed: --help must be fast."""

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .errors import CompleteError, SceneError, SwarmError, WallTimeError
from .version import VERSION

if TYPE_CHECKING:
    from .simulation import Result

_FAILED, _BAD_INPUT, _INTERRUPTED = 1, 2, 130

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Simulate particles bouncing in rigid cavities and off rigid solids, with energy conserved to round-off.",
    epilog="Examples:  swarm run examples/scenes/cavity.toml  |  swarm info cavity.h5",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)


def _version(wanted: bool) -> None:
    if wanted:
        print(f"swarm {VERSION}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    pass


@app.command(epilog="Example:  swarm run examples/scenes/cavity.toml -o cavity.h5 --threads 2")
def run(
    scene_file: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="The scene, the method and the run.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="OUT.h5", help="Trajectory [default: SCENE.h5, here].")
    ] = None,
    threads: Annotated[
        int | None, typer.Option(help="Threads [default: all cores]; results do not depend on it.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing trajectory.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress bar and no summary.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the last checkpoint, if there is one.")] = False,
    walltime: Annotated[
        str | None, typer.Option(metavar="TIME", help="Stop after this time, such as 2h, with a checkpoint.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="The summary as JSON.")] = False,
) -> None:
    """Simulate a scene file and write its trajectory."""
    from . import scene_file as files
    from .checks import duration
    from .output.storage import Storage
    from .output.writer import check_target

    job = files.read(scene_file)
    target = output or Path(job.run.trajectory or scene_file.with_suffix(".h5").name)
    limit = None if walltime is None else duration("--walltime", walltime)
    # Before particles are made and kernels compiled.
    Storage(job.run.frames, job.run.precision, job.run.compression)
    check_target(target, overwrite or resume)

    from .simulation import simulate

    particles = job.particles()
    try:
        result = simulate(
            job.scene,
            particles,
            job.method,
            until=job.run.until,
            every=job.run.every,
            trajectory=target,
            threads=threads if threads is not None else job.run.threads,
            progress=not quiet,
            overwrite=overwrite,
            scene_text=job.text,
            frames=job.run.frames,
            precision=job.run.precision,
            compression=job.run.compression,
            checkpoint=job.run.checkpoint,
            resume=resume,
            walltime=limit,
        )
    except KeyboardInterrupt:
        _stopped("interrupted", target, as_json)
        raise typer.Exit(_INTERRUPTED) from None
    except WallTimeError:
        _stopped("walltime", target, as_json)
        return
    except CompleteError as told:
        print(told, file=sys.stderr)
        return
    if as_json:
        _json("complete", target, wall_time=result.wall_time)
    elif not quiet:
        _summary(result, particles.volume)


def _stopped(why: str, target: Path, as_json: bool) -> None:
    """Say how to go on with a run that was stopped."""
    again = [word for word in sys.argv[1:] if word not in ("--overwrite", "--resume")]
    command = shlex.join(["swarm", *again, "--resume"])
    reason = "interrupted" if why == "interrupted" else "the wall time is over"
    print(f"{reason}: {target} holds the frames that were finished; go on with\n  {command}", file=sys.stderr)
    if as_json:
        _json(why, target, resume=command)


def _json(status: str, target: Path, **more: Any) -> None:
    import json

    from .summary import numbers

    print(json.dumps({**numbers(status, target), **more}, indent=2))


@app.command(epilog="Example:  swarm info cavity.h5")
def info(file: Annotated[Path, typer.Argument(metavar="FILE.h5", help="A trajectory.")]) -> None:
    """Say what a trajectory holds."""
    from .output.trajectory import load

    with load(file) as trajectory:
        times, seen = trajectory.times, trajectory.observables
        rows = {
            "frames": f"{len(times)}" + (f", {times[0]:g} s to {times[-1]:g} s" if len(times) else ""),
            "particles": f"{len(trajectory.frame(0)) if len(times) else 0}",
            "surfaces": ", ".join(map(_call, trajectory.scene.surfaces)),
            "gravity": "none" if trajectory.scene.gravity is None else f"{trajectory.scene.gravity} m/s^2",
            "method": _call(trajectory.method),
            "observables": ", ".join(seen),
            "size": f"{file.stat().st_size / 1e6:.1f} MB",
        }
        if len(times):
            rows |= _figures(seen)
    _table(rows)


def _call(described: Any) -> str:
    """A surface or method as one would write it."""
    return str(described).replace("swarm.", "")


def _figures(seen: dict[str, Any]) -> dict[str, str]:
    """The figures that say whether a run went well."""
    from .observables import drift

    escaped = {"escaped": f"{int(seen['escaped'][-1])} particles"} if seen.get("escaped", [0])[-1] else {}
    lost = seen.get("dissipated_energy", [0.0])[-1]
    dissipated = {"dissipated": f"{lost:.4g} J of {seen['total_energy'][0]:.4g} J"} if lost else {}
    return {
        "impacts": f"{int(seen['impacts'][-1]):,}".replace(",", " "),
        "energy drift": f"{drift(seen):.1e} of the total, {seen['energy_error'].max():.1e} of the worst particle",
        "largest penetration": f"{seen['max_penetration'].max():.1e} m",
        **dissipated,
        **escaped,
    }


def _summary(result: "Result", volume: float | None) -> None:
    seen = result.observables
    rate = seen["impacts"][-1] / result.wall_time
    rows = {
        **({} if volume is None else {"volume": f"{volume:.4g} m^3"}),
        **_figures(seen),
        "wall time": f"{result.wall_time:.2f} s, {rate:.3g} impacts/s",
        "trajectory": f"{result.trajectory} ({len(seen['time'])} frames)",
    }
    _table(rows)


def _table(rows: dict[str, str]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    for name, value in rows.items():
        table.add_row(name, value)
    Console(highlight=False).print(table)


def main() -> None:
    """Run the command line; the exit code is 0 done, 1 the run failed, 2 bad input, 130 interrupted."""
    try:
        app()
    except SwarmError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(_BAD_INPUT if isinstance(error, SceneError) else _FAILED)
