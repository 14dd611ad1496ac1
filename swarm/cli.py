"""The commands. No physics, and no heavy import before it is needed: --help must be fast."""

import dataclasses
import itertools
import json
import shlex
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from . import interrupt
from .errors import CompleteError, SceneError, SwarmError, WallTimeError
from .version import VERSION

_FAILED, _BAD_INPUT, _INTERRUPTED = 1, 2, 130

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Simulate particles and bodies bouncing in rigid cavities and off solids, with energy conserved to round-off.",
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
def run(  # noqa: PLR0913  one argument an option
    scene_file: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="The scene, the method and the run.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="OUT.h5", help="Trajectory [default: SCENE.h5, here].")
    ] = None,
    threads: Annotated[
        int | None, typer.Option(help="Threads [default: all cores]; results do not depend on it.")
    ] = None,
    recording: Annotated[
        Path | None, typer.Option("--record", metavar="OUT.rrd", help="Recording for Rerun and swarm view.")
    ] = None,
    impacts: Annotated[
        Path | None, typer.Option("--impacts", metavar="OUT.h5", help="Log of every impact, for swarm.load_impacts.")
    ] = None,
    live: Annotated[bool, typer.Option("--live", help="Show the run in a Rerun viewer.")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress bar and no summary.")] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue from the last checkpoint of a run that was stopped.")
    ] = False,
    walltime: Annotated[
        str | None, typer.Option(metavar="TIME", help="Stop after this time, such as 2h, with a checkpoint.")
    ] = None,
    compile: Annotated[
        str | None, typer.Option(metavar="WHEN", help="Compile the kernels: auto, always or never [default: auto].")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the outcome of the run as JSON, also if it fails.")
    ] = False,
) -> None:
    """Simulate a scene file and write its trajectory."""
    # An exception in the middle of an import may be lost; nothing is open yet.
    with interrupt.at_once():
        from . import scene_file as files
        from .checks import duration
        from .output import paths
        from .run.simulation import carry_out
        from .summary import numbers, of_result

    def report(status: str, written: Path | None = None, **more: Any) -> None:
        if as_json:
            print(json.dumps({"status": status, **(numbers(written) if written else {}), **more}, indent=2))

    try:
        with interrupt.at_once():
            job = files.read(scene_file)
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
            )
            # Before particles are made and kernels compiled.
            inputs = {"scene file": scene_file, "file of the start": job.start_file()}
            paths.check_distinct({**options.files(), "recording": options.recording}, inputs)
            paths.check_target(target, overwrite or resume)
            if options.impacts is not None:
                paths.check_target(options.impacts, overwrite or resume, "impacts")
            if options.recording is not None:
                paths.check_target(options.recording, overwrite, "recording")
            before, start = paths.identity(target), job.start()
            resumes = resume and paths.checkpoint_of(target).exists()
        result = carry_out(job.scene, start, job.method, options)
    except (KeyboardInterrupt, WallTimeError) as stop:
        status = "walltime" if isinstance(stop, WallTimeError) else "interrupted"
        # The files are closed: a second signal may end the process here.
        with interrupt.at_once():
            has_frames = target.exists() and (resumes or paths.identity(target) != before)
            again = _stopped(status, target, has_frames)
            if has_frames:
                report(status, target, resume=again)
            else:
                report(status, frames=0, resume=again)
        raise typer.Exit(0 if status == "walltime" else _INTERRUPTED) from None
    except CompleteError as error:
        print(error, file=sys.stderr)
        report("complete", target)
        return
    except SwarmError as error:
        report("failed", error=str(error))
        raise
    report("complete", target, wall_time=result.wall_time)
    if not (quiet or as_json):
        _table(of_result(result, getattr(start, "volume", None)))


def _stopped(status: str, target: Path, has_frames: bool) -> str | None:
    """Print how to resume a run that was stopped; the command, or None if there is nothing to resume from."""
    from .output import paths

    reason = "interrupted" if status == "interrupted" else "the wall time limit is reached"
    if not has_frames:
        print(f"{reason}: no frame was finished, and nothing was written", file=sys.stderr)
        return None
    held = f"{reason}: {target} holds the frames that were finished"
    if not paths.checkpoint_of(target).exists():
        print(f"{held}; there was no time for a checkpoint to resume from", file=sys.stderr)
        return None
    command = shlex.join(["swarm", *_arguments_again(sys.argv[1:]), "--resume"])
    print(f"{held}; resume with\n  {command}", file=sys.stderr)
    return command


def _arguments_again(words: list[str]) -> list[str]:
    """The arguments of this command, without those that do not apply to a resumed run."""
    again: list[str] = []
    for before, word in itertools.pairwise(["", *words]):
        name = word.partition("=")[0]
        if name not in ("--overwrite", "--resume", "--live", "--record") and before != "--record":
            again.append(word)
    return again


@app.command(epilog="Example:  swarm info cavity.h5, or swarm info --repair cavity.rrd")
def info(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A trajectory (.h5) or a recording (.rrd).")],
    repair: Annotated[
        bool, typer.Option("--repair", help="Repair a recording that a crash truncated, in place.")
    ] = False,
) -> None:
    """Show what a trajectory or a recording holds."""
    from . import summary

    if file.suffix == ".rrd":
        _table(summary.of_recording(file, repair))
    elif repair:
        raise SceneError(f"--repair is for recordings (.rrd), got {file}; a trajectory needs none")
    else:
        _table(summary.of_trajectory(file))


@app.command(epilog="Example:  swarm record cavity.h5 -o cavity.rrd")
def record(
    file: Annotated[Path, typer.Argument(metavar="FILE.h5", help="A trajectory.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="OUT.rrd", help="Recording [default: FILE.rrd].")
    ] = None,
    particles: Annotated[int, typer.Option(help="Most particles, or points of bodies, recorded.")] = 5000,
    color: Annotated[str, typer.Option(help="Colour by speed or energy-error.")] = "speed",
    megabytes: Annotated[float, typer.Option(help="Largest size; if needed, every k-th frame is recorded.")] = 100.0,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing recording.")] = False,
) -> None:
    """Make a Rerun recording of a trajectory."""
    from .extras import needed_by

    with needed_by("a recording", "record"):
        from .output import recording
    from .output import paths
    from .output.trajectory import load

    target = paths.target_of("recording", output or file.with_suffix(".rrd"))
    paths.check_distinct({"recording": target}, {"trajectory": file})
    with load(file) as trajectory:
        recording.record(trajectory, target, recording.Settings(particles, color, megabytes), overwrite)
    print(f"written to {target} ({target.stat().st_size / 1e6:.1f} MB)")


@app.command(epilog="Example:  swarm view cavity.rrd -o cavity.png --times 0,5,10")
def view(
    file: Annotated[Path, typer.Argument(metavar="FILE.rrd", help="A recording.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="OUT.png", help="Picture [default: FILE.png].")
    ] = None,
    times: Annotated[
        str | None, typer.Option(help="Frames near these times [s], as 0,5,10 [default: first, middle, last].")
    ] = None,
    viewer: Annotated[
        bool | None,
        typer.Option(
            "--viewer/--no-viewer", help="By the Rerun viewer or by matplotlib [default: the viewer if it can]."
        ),
    ] = None,
) -> None:
    """Draw a contact sheet of a recording; no screen and no GPU are needed."""
    from .extras import needed_by

    with needed_by("a contact sheet", "record"):
        from .output.playback import Playback
    with needed_by("a contact sheet", "plot"):
        from .output import sheet

    target = output or file.with_suffix(".png")
    _check_picture(target, file)
    by = sheet.draw(Playback(file), target, None if times is None else _numbers("--times", times), viewer)
    print(f"written to {target}; drawn by {by}")


@app.command(epilog="Example:  swarm plot cavity.h5 -o cavity.png")
def plot(
    file: Annotated[Path, typer.Argument(metavar="FILE.h5", help="A trajectory.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="OUT.png", help="Picture [default: FILE.png].")
    ] = None,
) -> None:
    """Draw energy error, penetration, impacts, pressure, speeds and the particles or bodies of a trajectory."""
    from .extras import needed_by

    with needed_by("a plot", "plot"):
        from .output import plots
    from .output.trajectory import load

    target = output or file.with_suffix(".png")
    _check_picture(target, file)
    with load(file) as trajectory:
        plots.draw(trajectory, target)
    print(f"written to {target}")


def _check_picture(target: Path, source: Path) -> None:
    """Raise a SceneError if the picture cannot be written; an old one is cheap to redraw, so overwritten."""
    from .output.paths import check_distinct, check_target

    check_distinct({"picture": target}, {"file that it is drawn from": source})
    check_target(target, overwrite=True, what="picture")
    if target.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise SceneError(f"picture: expected a file name that ends in .png, .pdf or .svg, got {target}")


def _numbers(name: str, text: str) -> list[float]:
    """Comma-separated numbers."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise SceneError(f"{name} must be comma-separated numbers, got {text!r}") from None


def _table(rows: dict[str, str]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    for name, value in rows.items():
        table.add_row(name, value)
    Console(highlight=False, markup=False).print(table)


def main() -> None:
    """Run the command line; the exit code is 0 done, 1 the run failed, 2 bad input, 130 interrupted."""
    try:
        app()
    except SwarmError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(_BAD_INPUT if isinstance(error, SceneError) else _FAILED)
    finally:
        interrupt.leave_at_once()
