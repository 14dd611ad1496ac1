"""The static parts of a recording: layout, eye, walls, legend, time series, and its description in words."""

import math
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ..pictures import colours, series
from ..pictures.colours import BACKGROUND, Scale, curve_colour, rgb
from ..pictures.drawn import Drawn
from ..pictures.eye import Eye, eye_for
from ..state import Floats
from ..surfaces.plane import PLANES, along
from ..triangles.shape import Shape
from ..words import titles as words
from ..words import verdicts
from ..words.amounts import many
from ..words.content import Content
from .playback import LINES, MESH, PARTICLES

# The colours of matplotlib's pictures.
_CAVITY, _SOLID = (*rgb(colours.CAVITY), 60), (*rgb(colours.SOLID), 255)
_CAVITY_WIRE, _SOLID_WIRE = (*rgb(colours.CAVITY_LINE), 255), (*rgb(colours.SOLID_LINE), 255)
# The number of plots that are visible at once, and their groups: those of other groups come after them.
_SEEN = 4
_FIRST = (
    "energy",
    "number",
    "impacts",
    "pressure",
    "force",
    "crossings",
    "heat",
    "energy_error",
    "penetration",
    "overlap",
)
# The colour of the edges between faces of bodies, which have no shading.
_EDGE = (10, 10, 12, 255)
SOLID_LOOKS = _SOLID, _SOLID_WIRE
_PATH = "/about"
# The viewer's angle of view from bottom to top, and the width of the narrowest panel as a part of its height.
ANGLE, NARROWEST = math.radians(55.0), 0.8
# The part of the panel that the scene fills.
_FILLED = 0.97


def path_of(shape: Shape) -> str:
    """The path of the entity of a wall."""
    return f"/scene/{'solids' if shape.solid else 'surfaces'}/{shape.name}"


def log_static(stream: Any, drawn: Drawn, shapes: list[Shape], center: Floats) -> None:
    """Log the walls, and the looks of particles and bodies."""
    stream.log("/scene", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    sizes = rr.Radius.ui_points(2.0) if drawn.radius is None else drawn.radius
    stream.log(PARTICLES, rr.Points3D.from_fields(radii=sizes), static=True)
    width = rr.Radius.ui_points(1.0)
    if len(drawn.triangles):
        stream.log(MESH, rr.Mesh3D.from_fields(triangle_indices=drawn.triangles), static=True)
        stream.log(LINES, rr.LineStrips3D.from_fields(radii=width, colors=[_EDGE]), static=True)
    elif len(drawn.lines):
        stream.log(LINES, rr.LineStrips3D.from_fields(radii=width), static=True)
    log_walls(stream, shapes, center)


def log_walls(stream: Any, shapes: list[Shape], center: Floats, static: bool = True) -> None:
    """Log the walls, statically or from the current time of the stream on."""
    for shape in shapes:
        face, wire = (_SOLID, _SOLID_WIRE) if shape.solid else (_CAVITY, _CAVITY_WIRE)
        if len(shape.vertices):
            mesh = rr.Mesh3D(
                vertex_positions=shape.vertices - center, triangle_indices=shape.triangles,
                vertex_normals=shape.normals, albedo_factor=face,
            )  # fmt: skip
            stream.log(f"{path_of(shape)}/mesh", mesh, static=static)
        elif not static:
            stream.log(f"{path_of(shape)}/mesh", rr.Clear(recursive=False))
        for part, curves, width in (("wires", shape.edges, 0.8), ("levels", shape.levels, 0.4)):
            if curves or not static:
                lines = rr.LineStrips3D(
                    [curve - center for curve in curves], colors=[wire], radii=rr.Radius.ui_points(width)
                )
                stream.log(f"{path_of(shape)}/{part}", lines, static=static)


def log_series(stream: Any, lines: list[series.Line]) -> None:
    """Log the names and the colours of time series."""
    for together in series.views_of(lines).values():
        for k, line in enumerate(together):
            colour = rgb(curve_colour(line.name, k))
            stream.log(line.path, rr.SeriesLines(colors=[colour], names=[line.name], widths=[1.5]), static=True)


def blueprint(lines: list[series.Line], noun: str, eye: Any = None, plane: str | None = None) -> rrb.Blueprint:
    """The 3-D view, from an eye or from a place that shows all, beside the plots, paused at the start."""
    scene = rrb.Spatial3DView(
        origin="/scene", name=noun, background=BACKGROUND, line_grid=rrb.LineGrid3D(visible=False), eye_controls=eye
    )
    views, plots = series.views_of(lines), []
    for group in sorted(views, key=lambda group: _FIRST.index(group) if group in _FIRST else len(_FIRST)):
        graph = series.GRAPHS[group].across(plane)
        legend = rrb.PlotLegend(rrb.Corner2D.RightTop, visible=len(views[group]) > 1)
        name = f"{graph.name}, log10" if graph.is_error else graph.name
        paths = [line.path for line in views[group]]
        plots.append(rrb.TimeSeriesView(origin="/", contents=paths, name=name, plot_legend=legend))
    seen, rest = rrb.Vertical(*plots[:_SEEN], name="graphs"), rrb.Vertical(*plots[_SEEN:], name="more graphs")
    graphs = rrb.Tabs(seen, rest, active_tab=0) if plots[_SEEN:] else seen
    about = rrb.TextDocumentView(origin=_PATH, name="what is shown")
    return rrb.Blueprint(
        rrb.Horizontal(rrb.Vertical(scene, about, row_shares=[5, 1]), graphs, column_shares=[1, 1]),
        rrb.TimePanel(timeline="frame", play_state="paused", state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
    )


def log_about(stream: Any, drawn: Drawn, scale: Scale, stride: int, center: Floats, plane: str | None = None) -> None:
    """Log the meaning of the colours, the numbers of shown and of all particles, the origin, and a plane."""
    of = f" of {many(drawn.count)}" if drawn.shown < drawn.count else ""
    every = f", every {stride}th frame" if stride > 1 else ""
    name, unit = colours.named(scale.quantity)
    text = (
        f"**{many(drawn.shown)}{of} {drawn.noun}{every}**, coloured by {name}: {scale.low:g} (dark blue) to "
        f"{scale.high:g} {unit}".rstrip()
        + f" (orange). log10 of 0 is drawn at {series.NOTHING:g}."
    )
    if center.any():
        text += f" Positions are less {tuple(center.tolist())} m."
        stream.log(_PATH, rr.AnyValues(center=center), static=True)
    if plane is not None:
        stream.log(_PATH, rr.AnyValues(plane=plane), static=True)
    stream.log(_PATH, rr.TextDocument(text, media_type="text/markdown"), static=True)
    values = rr.AnyValues(**vars(scale), particles=drawn.count, shown=drawn.shown, stride=stride, noun=drawn.noun)
    stream.log(_PATH, values, static=True)


def log_outcome(stream: Any, content: Content) -> None:
    """Log the run in words, and its verdicts, when it has ended."""
    stream.log(_PATH, rr.AnyValues(title=words.title(content), verdicts=verdicts.marked(content)), static=True)


def eye_controls(plane: str | None, shapes: list[Shape], points: Floats, center: Floats) -> Any:
    """The eye that sees all walls and the points (n, 3); None if these coincide.

    It is relative to the origin of the recording, `center`. In a scene of two dimensions it is above the plane.
    """
    curves = [curve for shape in shapes for curve in (*shape.wires, shape.vertices) if len(curve)]
    every = np.concatenate([points[~np.isnan(points[:, 0])], *curves])
    if not len(every) or not np.ptp(every, axis=0).any():
        return None
    low, high = every.min(axis=0) - center, every.max(axis=0) - center
    eye, middle = _eye(plane, low, high), 0.5 * (low + high)
    place = middle + distance(eye, high - low) * eye.near
    # The axis of rotations by hand.
    up = eye.up if plane else np.array([0.0, 0.0, 1.0])
    return rrb.EyeControls3D(position=place, look_target=middle, eye_up=up)


def _eye(plane: str | None, low: Floats, high: Floats) -> Eye:
    across = PLANES.get(plane)
    if across is None:
        return eye_for(low, high)
    right, up = (np.eye(3)[axis] for axis in along(across))
    return Eye(right, up, np.cross(right, up))


def distance(eye: Eye, size: Floats) -> float:
    """The distance of the eye from the middle of a box at which all its corners are visible.

    A corner lies x to the right of the middle, y above it, and z nearer. It is seen from the distance D if |x| and |y|
    are at most (D - z) times the tangents of half the angles of view.
    """
    signs = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T
    x, y, z = eye.seen(signs * size).T
    upright = _FILLED * math.tan(0.5 * ANGLE)
    return float((z + np.maximum(np.abs(x) / NARROWEST, np.abs(y)) / upright).max())
