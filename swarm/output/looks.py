"""The parts of a recording that do not change: layout, walls, legend, names and colours of time series."""

from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ..plane import across_of, along
from ..state import Floats
from . import series, style
from .colours import BACKGROUND, Scale, curve_colour, rgb
from .drawn import Drawn
from .playback import LINES, MESH, PARTICLES
from .shape import Shape

# The colours of matplotlib's pictures.
_CAVITY, _SOLID = (*rgb(style.CAVITY), 60), (*rgb(style.SOLID), 255)
_CAVITY_WIRE, _SOLID_WIRE = (*rgb(style.CAVITY_LINE), 255), (*rgb(style.SOLID_LINE), 255)
# The distance of the eye above a plane, in widths of the scene.
_EYE = 1.3
# Between the faces of bodies, which have no shading.
_EDGE = (10, 10, 12, 255)
SOLID_LOOKS = _SOLID, _SOLID_WIRE


def path_of(shape: Shape) -> str:
    """The entity of a wall."""
    return f"/scene/{'solids' if shape.solid else 'surfaces'}/{shape.name}"


def log_static(stream: Any, drawn: Drawn, shapes: list[Shape], center: Floats) -> None:
    """Log the walls, and how particles and bodies look."""
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
    """Log the walls, or those from the time of the stream on."""
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


def log_about(stream: Any, drawn: Drawn, scale: Scale, stride: int, center: Floats, plane: str | None = None) -> None:
    """Log the meaning of the colours, what is shown of how many, the origin, and the plane of two dimensions."""
    of = f" of {drawn.count}" if drawn.shown < drawn.count else ""
    every = f", every {stride}th frame" if stride > 1 else ""
    text = (
        f"**{drawn.shown}{of} {drawn.noun}{every}**. Colour: {scale.quantity}, from {scale.low:g} (dark blue) over "
        f"{0.5 * (scale.low + scale.high):g} (magenta) to {scale.high:g} (orange). On the "
        f"plots {series.NOTHING:g} is the logarithm of 0."
    )
    if center.any():
        text += f" Positions are less {tuple(center.tolist())} m."
        stream.log("/about", rr.AnyValues(center=center), static=True)
    if plane is not None:
        stream.log("/about", rr.AnyValues(plane=plane), static=True)
    stream.log("/about", rr.TextDocument(text, media_type="text/markdown"), static=True)
    values = rr.AnyValues(**vars(scale), particles=drawn.count, shown=drawn.shown, stride=stride, noun=drawn.noun)
    stream.log("/about", values, static=True)


def eye_above(plane: str | None, shapes: list[Shape], center: Floats) -> Any:
    """The eye that sees the plane of a scene of two dimensions from above, all of its walls; None where it has none."""
    across = across_of(plane)
    curves = [curve - center for shape in shapes for curve in shape.wires]
    if across is None or not curves:
        return None
    points = np.concatenate(curves)
    low, high = points.min(axis=0), points.max(axis=0)
    middle, up = 0.5 * (low + high), np.zeros(3)
    place = middle.copy()
    place[across] += _EYE * float((high - low).max())
    up[along(across)[1]] = 1.0
    return rrb.EyeControls3D(position=place, look_target=middle, eye_up=up)


def blueprint(lines: list[series.Line], noun: str, eye: Any = None, plane: str | None = None) -> rrb.Blueprint:
    """The 3-D view, from an eye or from where it shows all, beside the plots, paused at the start."""
    scene = rrb.Spatial3DView(
        origin="/scene", name=noun, background=BACKGROUND, line_grid=rrb.LineGrid3D(visible=False), eye_controls=eye
    )
    plots = []
    for group, together in series.views_of(lines).items():
        view, logarithm = series.title_of(group, plane)
        legend = rrb.PlotLegend(visible=len(together) > 1)
        name = f"{view}, log10" if logarithm else view
        paths = [line.path for line in together]
        plots.append(rrb.TimeSeriesView(origin="/", contents=paths, name=name, plot_legend=legend))
    about = rrb.TextDocumentView(origin="/about", name="legend")
    return rrb.Blueprint(
        rrb.Horizontal(rrb.Vertical(scene, about, row_shares=[8, 1]), rrb.Vertical(*plots), column_shares=[3, 2]),
        rrb.TimePanel(timeline="frame", play_state="paused", state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
    )
