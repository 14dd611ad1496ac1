"""A run in one picture: time series that show its quality, speeds, and the particles."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import checks
from ..errors import SceneError
from ..files import marks
from ..files.replaced import named_when_whole
from ..triangles.shape import Shape
from ..triangles.shapes import cell_of, shapes_of
from ..words import titles as words
from ..words import verdicts
from ..words.amounts import amount, many
from ..words.content import Content, content_of
from ..words.gone import how_many_left
from . import colours, drawing, graphs, sentences, series, speeds, style
from .drawn import Drawn
from .framed import most_of

# The largest number of drawn particles, or points of bodies.
SHOWN = 5000
# [inches]: the width of a picture, and the height of one time series.
_WIDE, _HIGH = 12.5, 2.35
# The part of a picture's width for time series beside the particles; and its smallest height [inches].
_SERIES, _LEAST = 0.66, 6.4
# The smallest part of the width for particles, and the part of its panel's height that a vessel fills.
_FEWEST, _TALL = 0.24, 0.8
# The height above and below a vessel [inches]: for a title, a triad and a colour bar, or axes and a colour bar.
_AROUND, _AROUND_PLANE = 1.8, 1.8


def draw_plot(trajectory: Any, target: Path) -> None:
    """Draw the time series of a trajectory, its speeds, and its particles at the end.

    Raises:
        SceneError: the trajectory is damaged, or holds no frame.
        FileError: the picture cannot be written.
    """
    figure = figure_of(content_of(trajectory), None, SHOWN)
    with named_when_whole(target) as part, style.applied():
        figure.savefig(part, metadata=marks.of_picture(part))


def figure_of(content: Content, figsize: Any, particles: int) -> style.Picture:
    """The picture with at most `particles` particles; without a size, its plots determine the height."""
    most = checks.count("particles", particles)
    try:
        wide, high = (_WIDE, 0.0) if figsize is None else (checks.positive("figsize", side) for side in figsize)
    except (TypeError, ValueError):
        raise SceneError(f"figsize must be width and height in inches, got {figsize!r}") from None
    with style.applied():
        return _figure_of(content, (wide, high), most)


def _figure_of(content: Content, size: tuple[float, float], most: int) -> style.Picture:
    (wide, high), scene = size, content.scene
    last = "end" if "end" in content.frames else "start"
    end = content.inside(last) if last in content.frames else None
    shapes = walls_of(content, -1)
    plots, spread = _shown(content, shapes), speeds.of_frames(content)
    count, width = len(plots) + bool(spread), wide * (1.0 if end is None else _SERIES)
    lines = sentences.in_lines(verdicts.marked(content), width)
    text = sentences.height_of_lines(lines)
    rows = graphs.rows_of(count, width)
    high = high or max(_LEAST, _HIGH * len(rows) + text + 0.4)
    picture = style.picture(wide, high)
    right: Any = picture
    if end is not None:
        # The width is chosen so that the vessel fills the height, as far as the series leave room.
        aspect = drawing.aspect(shapes, end.position.T, scene.across())
        part = 1.0 - min(max(aspect * _TALL * high / wide, _FEWEST), 1.0 - _SERIES)
        left, right = picture.subfigures(1, 2, width_ratios=[1.0 - part, part], squeeze=False).ravel()
        _places(_middle(left, aspect, scene.across()), content, last, shapes, most)
    above, below = right.subfigures(2, 1, height_ratios=[max(high - text, 0.1), text], squeeze=False).ravel()
    cells = graphs.cells_of(above, rows)
    _series(cells[: len(plots)], content, plots, rows[-1] - bool(spread))
    if spread:
        speeds.draw(cells[-1], content, spread)
    sentences.write_below(below, lines, text)
    picture.suptitle(words.title(content), fontsize=12)
    return picture


def walls_of(content: Content, k: int) -> list[Shape]:
    """The walls at frame k, around most of the particles of the last known frame."""
    seen, frame = content.seen, content.frames.get("end", content.frames.get("start"))
    around = np.zeros((3, 1)) if frame is None else most_of(frame.position)
    return shapes_of(content.scene.at_frame(seen, k), around, float(seen["time"][k]))


def _shown(content: Content, shapes: list[Shape]) -> dict[str, graphs.Curves]:
    """The curves of each plot that is informative."""
    times, seen = content.seen["time"], _with_inside(content)
    drawn = {}
    for line in series.lines_of(content.scene, content.method, shapes, content.body, seen):
        values = line.values(times, seen)
        known = ~np.isnan(values)
        drawn[line.path] = line.name, times[known], values[known]
    return {group: curves for group, curves in series.plots_of(drawn).items() if not series.says_nothing(group, curves)}


def _series(cells: list[Any], content: Content, plots: dict[str, graphs.Curves], last: int) -> None:
    """Draw the time series; the `last` of them label the axes of times."""
    soft = content.method.law() is not None and not content.method.has_multipliers()
    limits = {"penetration": None if soft else verdicts.penetration_limit(content), "overlap": None}
    errors = verdicts.energy_limit(content)
    for k, (group, curves) in enumerate(plots.items()):
        graph = series.GRAPHS[group].across(content.scene.plane)
        graphs.lines(cells[k], graph, curves, limit=limits.get(group, errors))
        if k < len(plots) - last:
            cells[k].set_xlabel("")


def _with_inside(content: Content) -> dict[str, NDArray[Any]]:
    """The observables, and the number of particles inside if particles come or go."""
    seen = dict(content.seen)
    gone = np.asarray(seen["escaped"]) + np.sum(seen.get("absorbed", np.zeros((len(seen["time"]), 1))), axis=1)
    comes_or_goes = bool(np.any(gone)) or "born" in seen
    if content.body is None and comes_or_goes and verdicts.knows_start(content):
        born = np.sum(seen["born"], axis=1) if "born" in seen else 0
        seen["inside"] = verdicts.at_start(content) + born - gone
    return seen


def _middle(figure: Any, aspect: float, across: int | None) -> Any:
    """The middle of a panel, as high as a vessel of this aspect with its title and its colour bar."""
    box = figure.bbox
    wide, high = box.width / figure.dpi, box.height / figure.dpi
    needed = wide / aspect + (_AROUND_PLANE if across is not None else _AROUND)
    if needed >= high:
        return figure
    beside = 0.5 * (high - needed)
    return figure.subfigures(3, 1, height_ratios=[beside, needed, beside])[1]


def _places(figure: Any, content: Content, name: str, shapes: list[Shape], most: int) -> None:
    """Draw the present particles, or bodies, of a frame."""
    end = content.inside(name)
    drawn = Drawn(len(end), content.body, most, end.radius)
    start = content.frames.get("start", content.frames[name])
    scale, values = colours.by_speed(content.scene, content.method, start, end)
    position, packed, tints = drawn.coloured(end, scale, values)
    across = content.scene.across()
    axes = figure.add_subplot()
    drawing.frame(
        axes,
        position.T,
        packed,
        shapes + cell_of(content.scene),
        *drawn.ties(position.T, packed, tints),
        across,
        drawn.radius,
    )
    shown = values(drawn.points(end.position), drawn.points(end.velocity))
    drawing.colour_bar(figure, axes, scale.quantity, scale.low, scale.high, [packed], shown)
    count = words.count_of(content) // (1 if content.body is None else len(content.body))
    left = how_many_left(content.seen, content.gone.get(name))
    here = drawn.shown if content.body else int((~np.isnan(position[0])).sum())
    count -= sum(left.values())
    count_text = many(count) if here == count else f"{many(here)} of {many(count)}"
    noun, time = drawn.noun_of(count, content.scene.plane), amount(float(content.seen["time"][-1]), "s")
    title = f"{count_text} {noun}{' inside' * bool(left)}, t = {time}"
    if (alike := speeds.of_all(content)) is not None:
        title += f",\neach with {amount(alike, 'm/s')}" if alike else ", all at rest"
    if left:
        title += f"\n{' and '.join(f'{many(n)} {how}' for how, n in left.items())}, not drawn"
    figure.suptitle(title, fontsize=10)


# --- Single graphs, for pages -----------------------------------------------------------------------------


def graphs_of(content: Content) -> list[tuple[str, Callable[[Any], None]]]:
    """The informative graphs: the title of each, and the function that draws it in axes."""
    shown: list[tuple[str, Callable[[Any], None]]] = []
    for group, curves in _shown(content, walls_of(content, -1)).items():
        title = series.GRAPHS[group].across(content.scene.plane).name
        shown.append((title, lambda axes, plot={group: curves}: _series([axes], content, plot, 1)))  # type: ignore[misc]
    if spread := speeds.of_frames(content):
        shown.append(("speeds", lambda axes: speeds.draw(axes, content, spread)))
    return shown


def picture_of_places(
    content: Content, name: str, shapes: list[Shape], size: tuple[float, float], most: int
) -> style.Picture:
    """The particles, or the bodies, of a frame among their walls, without a title."""
    picture = style.picture(*size)
    _places(picture, content, name, shapes, most)
    picture.suptitle("")
    return picture
