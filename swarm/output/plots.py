"""A run in one picture: time series that show whether it went well, speeds, and the particles."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import checks
from ..bodies.body import Body
from ..errors import SceneError
from ..methods import Method
from ..particles import Particles
from ..scene import Scene
from . import colours, drawing, graphs, series, style
from .drawn import Drawn
from .replaced import named_when_whole
from .shapes import Shape, shapes_of

# Most particles drawn, or points of bodies.
SHOWN = 5000
_BINS = 60
# [inches]: of a file, and the width of one time series; which part of the picture these have beside the particles.
_FILE, _CELL, _SERIES = (17.0, 7.6), 2.5, 0.64


@dataclass(frozen=True)
class Content:
    """The part of a run that a picture shows.

    Attributes:
        name: of the file, or "".
        count: number of particles, or of points of bodies, that were run.
        seen: the observables, one entry a frame.
        frames: the particles at the "start" and at the "end", as far as they are known.
    """

    name: str
    scene: Scene
    method: Method
    body: Body | None
    count: int
    seen: dict[str, NDArray[Any]]
    frames: dict[str, Particles]


def draw_plot(trajectory: Any, target: Path) -> None:
    """Draw the time series of a trajectory, its speeds, and its particles at the end.

    Raises:
        SceneError: the trajectory is damaged, or holds no frame.
        FileError: the picture cannot be written.
    """
    figure = figure_of(content_of(trajectory), _FILE, SHOWN)
    with named_when_whole(target) as part, style.applied():
        figure.savefig(part)


def content_of(trajectory: Any) -> Content:
    """The part of a `Trajectory` that a picture shows."""
    trajectory.require_frames()
    last = len(trajectory) - 1
    numbers = {"start": 0, "end": last} if last else {"start": 0}
    return Content(
        trajectory.path.name,
        trajectory.scene,
        trajectory.method,
        trajectory.body,
        trajectory.count,
        trajectory.observed(),
        {name: trajectory.frame(k) for name, k in numbers.items()} if trajectory.has_particles() else {},
    )


def figure_of(content: Content, figsize: Any, particles: int) -> style.Picture:
    """The picture, in which at most so many particles are drawn."""
    most = checks.count("particles", particles)
    try:
        wide, high = (checks.positive("figsize", side) for side in figsize)
    except (TypeError, ValueError):
        raise SceneError(f"figsize must be width and height in inches, got {figsize!r}") from None
    with style.applied():
        return _figure_of(content, (wide, high), most)


def _figure_of(content: Content, size: tuple[float, float], most: int) -> style.Picture:
    (wide, high), scene, times = size, content.scene, content.seen["time"]
    end = content.frames.get("end", content.frames.get("start"))
    still = scene
    if scene.reacts():
        still = scene.placed(content.seen["wall_position"][-1], content.seen["wall_orientation"][-1])
    shapes = shapes_of(still, np.zeros((3, 1)) if end is None else end.position, float(times[-1]))
    picture = style.picture(wide, high)
    right: Any = picture
    if end is not None:
        left, right = picture.subfigures(1, 2, width_ratios=[1.0 - _SERIES, _SERIES], squeeze=False).ravel()
        wide *= _SERIES
        _places(left, content, end, shapes, most)
    _series(right, content, shapes, wide)
    frames = "1 frame" if len(times) == 1 else f"{len(times)} frames"
    title = f"{content.name}{': ' * bool(content.name)}{frames}, {content.method!r}".replace("swarm.", "")
    picture.suptitle(title, fontsize=11)
    return picture


def _series(figure: Any, content: Content, shapes: list[Shape], width: float) -> None:
    """The time series, and the speeds, in a figure of this width [inches]."""
    times, seen = content.seen["time"], content.seen
    drawn = {}
    for line in series.lines_of(content.scene, content.method, shapes, content.body, seen):
        values = line.values(times, seen)
        known = ~np.isnan(values)
        drawn[line.path] = line.name, times[known], values[known]
    plots = series.plots_of(drawn)
    count = len(plots) + bool(content.frames)  # one more is for the speeds
    columns = max(1, min(round(width / _CELL), -(-count // 2)))
    cells = figure.subplots(-(-count // columns), columns, squeeze=False).ravel()
    for cell, (group, curves) in zip(cells, plots.items(), strict=False):
        graphs.lines(cell, *series.title_of(group, content.scene.plane), curves)
    if content.frames:
        _speeds(cells[len(plots)], content)
    for cell in cells[count:]:
        cell.set_axis_off()


def _places(figure: Any, content: Content, end: Particles, shapes: list[Shape], most: int) -> None:
    """The particles, or the bodies, at the end."""
    drawn = Drawn(len(end), content.body, most, end.radius)
    start = content.frames.get("start", end)
    # Of those that come during the run nobody may be there at the start.
    start = end if np.isnan(start.position[0]).any() else start
    scale, values = colours.colouring("speed", content.scene, content.method, start)
    position, packed, tints = drawn.coloured(end, scale, values)
    across = content.scene.across()
    axes = drawing.view(figure, across)
    wires = [(shape.solid, shape.wires) for shape in shapes]
    drawing.frame(axes, position.T, packed, wires, *drawn.ties(position.T, packed, tints), across, drawn.radius)
    drawing.colour_bar(figure, axes, scale.quantity, scale.low, scale.high)
    count = content.count // (1 if content.body is None else len(content.body))
    title = f"{drawn.shown} of {count} {drawn.noun}, t = {content.seen['time'][-1]:.6g} s"
    figure.suptitle(title, fontsize=10, color=drawing.LIGHT)


def _speeds(axes: Any, content: Content) -> None:
    """Histograms of the speeds, at the start and at the end."""
    top = 1.05 * max(frame.fastest() for frame in content.frames.values()) or 1.0
    for name, frame in content.frames.items():
        speeds = np.sqrt((frame.velocity**2).sum(axis=0))
        speeds = speeds[~np.isnan(speeds)]
        counts, edges = np.histogram(speeds, bins=_BINS, range=(0.0, top))
        form: dict[str, Any] = {"fill": True, "alpha": 0.25} if name == "start" else {"linewidth": 1.4}
        colour = style.CURVES[name == "end"]
        axes.stairs(100.0 * counts / max(1, len(speeds)), edges, color=colour, label=name, **form)
    axes.set_yscale("log")  # at the start all may be in one bin
    whose = "speeds" if content.body is None else "speeds of points"
    axes.set_title(f"{whose}, % in each of {_BINS} bins", fontsize=10)
    axes.set_xlabel("speed [m/s]", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
