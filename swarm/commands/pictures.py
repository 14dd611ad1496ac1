"""`swarm record`, `view`, `plot`, `report` and `animate`: recordings, pictures, pages and films."""

from pathlib import Path
from typing import Annotated

from ..errors import SceneError
from .options import Option, Positional
from .shown import Picture, TrajectoryFile, written

ReplacesPicture = Annotated[bool, Option("--overwrite", help="Replace an existing picture.")]


def record(
    file: TrajectoryFile,
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="OUT.rrd", help="Recording [default: FILE.rrd].")
    ] = None,
    particles: Annotated[int, Option(help="Most particles, or points of bodies, recorded.")] = 5000,
    color: Annotated[str, Option(help="Colour by speed or energy-error.")] = "speed",
    megabytes: Annotated[float, Option(help="Largest size; if needed, every k-th frame is recorded.")] = 100.0,
    overwrite: Annotated[bool, Option("--overwrite", help="Replace an existing recording.")] = False,
) -> None:
    """Make a Rerun recording of a trajectory."""
    from ..common.extras import needed_by

    with needed_by("a recording", "record"):
        from ..recording import recorded
        from ..recording import writer as recording
    from ..files import paths
    from ..files.trajectory import load

    target = paths.target_of("recording", output or file.with_suffix(".rrd"))
    paths.check_distinct({"recording": target}, {"trajectory": file})
    with load(file) as trajectory:
        recorded.record(trajectory, target, recording.Settings(particles, color, megabytes), overwrite)
    written(target)


def view(
    file: Annotated[Path, Positional(metavar="FILE.rrd", help="A recording.")],
    output: Picture = None,
    times: Annotated[
        str | None, Option(help="Frames near these times [s], as 0,5,10 [default: first, middle, last].")
    ] = None,
    viewer: Annotated[
        bool | None,
        Option("--viewer/--no-viewer", help="By the Rerun viewer or by matplotlib [default: the viewer if it can]."),
    ] = None,
    overwrite: ReplacesPicture = False,
) -> None:
    """Draw a contact sheet of a recording; no screen and no GPU are needed."""
    from ..common.extras import needed_by

    with needed_by("a contact sheet", "record"):
        from ..recording.playback import Playback
    with needed_by("a contact sheet", "plot"):
        from ..recording import sheet

    target = _picture(output or file.with_suffix(".png"), file, overwrite)
    by = sheet.draw_sheet(Playback(file), target, None if times is None else _numbers("--times", times), viewer)
    print(f"written to {target}; drawn by {by}")


def plot(file: TrajectoryFile, output: Picture = None, overwrite: ReplacesPicture = False) -> None:
    """Draw energy error, penetration, impacts, pressure, speeds and the particles or bodies of a trajectory."""
    from ..common.extras import needed_by

    with needed_by("a plot", "plot"):
        from ..pictures import plots
    from ..files.trajectory import load

    target = _picture(output or file.with_suffix(".png"), file, overwrite)
    with load(file) as trajectory:
        plots.draw_plot(trajectory, target)
    print(f"written to {target}")


def report(
    source: Annotated[Path, Positional(metavar="RUN", help="A trajectory RUN.h5, or the folder of a sweep.")],
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="OUT.html", help="Page [default: RUN.html].")
    ] = None,
    overwrite: Annotated[bool, Option("--overwrite", help="Replace an existing page.")] = False,
) -> None:
    """Make a page of a run or a sweep, one file for any browser: verdicts, pictures, numbers, how to reproduce it."""
    from ..fleet import report as reports

    target = output or reports.page_file(source)
    reports.report(source, target, overwrite=overwrite)
    written(target)


def animate(
    file: TrajectoryFile,
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="OUT.mp4", help="Film, .mp4 or .gif [default: FILE.mp4].")
    ] = None,
    frames: Annotated[int, Option(help="Most frames drawn, evenly chosen.")] = 200,
    fps: Annotated[float, Option(help="Frames a second.")] = 25.0,
    particles: Annotated[int, Option(help="Most particles, or points of bodies, drawn.")] = 10_000,
    overwrite: Annotated[bool, Option("--overwrite", help="Replace an existing film.")] = False,
) -> None:
    """Make a film of the particles or bodies of a trajectory among their walls."""
    from ..files.trajectory import load

    target = output or file.with_suffix(".mp4")
    with load(file) as trajectory:
        film = trajectory.animate(target, frames=frames, fps=fps, particles=particles, overwrite=overwrite)
    written(film)


def _picture(output: Path, source: Path, overwrite: bool) -> Path:
    """Return the file of a picture; raise a SceneError if it cannot be written there."""
    from ..files.marks import check_target
    from ..files.paths import check_distinct, target_of

    target = target_of("picture", output)
    if target.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise SceneError(f"picture: expected a file name that ends in .png, .pdf or .svg, got {target}")
    check_distinct({"picture": target}, {"file that it is drawn from": source})
    check_target(target, overwrite, what="picture")
    return target


def _numbers(name: str, text: str) -> list[float]:
    """Return the numbers of a comma-separated text."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise SceneError(f"{name} must be comma-separated numbers, got {text!r}") from None
