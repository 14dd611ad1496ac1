"""A trajectory in one picture: time series that show whether the run went well, speeds, and the particles."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot

from . import colours, drawing, series
from .drawn import Drawn
from .shapes import Shape, shapes_of
from .trajectory import Trajectory

# Most particles drawn, or points of bodies.
_SHOWN = 5000
_BINS = 60
_WIDE, _HIGH = 17.0, 7.6


def draw(trajectory: Trajectory, target: Path) -> None:
    """Draw the time series of a trajectory, its speeds, and its particles at the end.

    Raises:
        SceneError: the trajectory is damaged, or holds no frame.
    """
    trajectory.require_frames()
    scene, method, times, seen = trajectory.scene, trajectory.method, trajectory.times, trajectory.observed()
    end = trajectory.frame(-1)
    still = scene.placed(seen["wall_position"][-1], seen["wall_orientation"][-1]) if scene.reacts() else scene
    shapes = shapes_of(still, end.position, float(times[-1]))
    picture = pyplot.figure(figsize=(_WIDE, _HIGH), layout="constrained")
    left, right = picture.subfigures(1, 2, width_ratios=[1.0, 1.9], squeeze=False).ravel()

    _places(left, trajectory, shapes)
    lines = series.lines_of(scene, method, shapes, trajectory.body)
    before: series.Seen = None
    rows = []
    for k, moment in enumerate(times):
        now = {name: column[k] for name, column in seen.items()}
        rows.append(series.row_of(lines, moment, now, before))
        before = moment, now
    columns = {line.path: column for line, column in zip(lines, np.array(rows).T, strict=True)}
    shown = [line for line in lines if series.group_of(line.path) not in series.RARE or columns[line.path].any()]
    views = series.views_of(shown)
    # One more is for the speeds.
    cells = right.subplots(2, max(3, 1 + len(views) // 2)).ravel()
    for cell, (group, together) in zip(cells, views.items(), strict=False):
        known = {line.name: ~np.isnan(columns[line.path]) for line in together}
        curves = {line.name: (times[known[line.name]], columns[line.path][known[line.name]]) for line in together}
        drawing.lines(cell, *series.VIEWS[group], curves)
    _speeds(cells[len(views)], trajectory)
    for cell in cells[len(views) + 1 :]:
        cell.set_axis_off()
    frames = "frame" if len(times) == 1 else "frames"
    picture.suptitle(f"{trajectory.path.name}: {len(times)} {frames}, {method!r}".replace("swarm.", ""), fontsize=11)
    drawing.save(picture, target)


def _places(picture: Any, trajectory: Trajectory, shapes: list[Shape]) -> None:
    """The particles, or the bodies, at the end."""
    end, drawn = trajectory.frame(-1), Drawn(trajectory.count, trajectory.body, _SHOWN)
    scale, values = colours.colouring("speed", trajectory.scene, trajectory.method, trajectory.frame(0))
    position, velocity = drawn.points(end.position), drawn.points(end.velocity)
    points, packed = position.T, scale.colours(values(position, velocity))
    axes, has_faces = picture.add_subplot(projection="3d"), len(drawn.triangles) > 0
    picture.set_facecolor(drawing.BACKGROUND)
    wires = [(shape.solid, shape.wires) for shape in shapes]
    drawing.particles(axes, points, drawing.red_green_blue(packed), wires, 0.0 if has_faces else 1.0)
    if has_faces:
        drawing.faces(axes, points[drawn.triangles], packed[drawn.triangles])
    else:
        middles = scale.colours(values(drawn.middles(position), drawn.middles(velocity)))
        drawing.bonds(axes, points[drawn.lines], middles)
    drawing.colour_bar(picture, axes, scale.quantity, scale.low, scale.high)
    title = f"{drawn.shown} of {drawn.count} {drawn.noun}, t = {trajectory.times[-1]:.6g} s"
    axes.set_title(title, fontsize=10, color=drawing.LIGHT)


def _speeds(axes: Any, trajectory: Trajectory) -> None:
    """How many particles have which speed, at the start and at the end."""
    ends = {"start": trajectory.frame(0), "end": trajectory.frame(-1)}
    if len(trajectory) == 1:
        del ends["end"]
    top = 1.05 * max(frame.fastest() for frame in ends.values()) or 1.0
    for colour, (name, frame) in zip(drawing.LINES, ends.items(), strict=False):
        speeds = np.sqrt((frame.velocity**2).sum(axis=0))
        counts, edges = np.histogram(speeds, bins=_BINS, range=(0.0, top))
        style: dict[str, Any] = {"fill": True, "alpha": 0.25} if name == "start" else {"linewidth": 1.4}
        axes.stairs(100.0 * counts / len(frame), edges, color=colour, label=name, **style)
    axes.set_yscale("log")  # at the start all may be in one bin
    whose = "speeds" if trajectory.body is None else "speeds of points"
    axes.set_title(f"{whose}, % in each of {_BINS} bins", fontsize=10)
    axes.set_xlabel("speed [m/s]", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
