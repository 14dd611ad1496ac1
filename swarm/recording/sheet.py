"""Contact sheets: a few frames of a recording and its time series in one picture."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.image import imread

from ..errors import RunError, SceneError
from ..files import marks
from ..files.replaced import named_when_whole
from ..pictures import drawing, graphs, sentences, series, style
from ..pictures.triad import INK
from ..surfaces.plane import PLANES
from ..words.amounts import many
from . import viewer
from .playback import Playback

_COLUMNS = 3
# [inches]: the width of a frame, and the height of a row of them.
_CELL, _HIGH = 5.4, 5.0
# The part of the width in which plots are arranged in rows: they are wider than those beside particles.
_PLOT = 0.5
# Sentences in place of plots that would be empty in all frames.
_NONE = {
    "energy_error": "no error of the energy in any frame",
    "link_error": "no error of a link's length in any frame",
    "penetration": "no particle was outside a wall in any frame",
    "overlap": "no ball pressed on another one or on a wall",
}


def draw_sheet(playback: Playback, target: Path, times: list[float] | None, with_viewer: bool | None) -> str:
    """Draw the frames nearest to these times (None: the first, the middle and the last); return the program's name.

    Args:
        playback: the recording.
        target: the PNG to write.
        times: [s], within the recording.
        with_viewer: True: by the Rerun viewer; False: by matplotlib; None: by the viewer if it works here.

    Raises:
        SceneError: a time is outside the recording.
        RunError: the viewer is wanted and does not work here.
        FileError: the picture cannot be written.
    """
    numbers = _chosen(playback, times)
    with tempfile.TemporaryDirectory() as folder, style.applied():
        found, by = _pictures(playback, numbers, Path(folder), with_viewer)
        picture = _sheet(playback, numbers, found, by)
    with named_when_whole(target) as part, style.applied():
        picture.savefig(part, metadata=marks.of_picture(part))
    return by


def _chosen(playback: Playback, times: list[float] | None) -> list[int]:
    """Indices of the frames."""
    last = len(playback.times) - 1
    if times is None:
        return sorted({0, last // 2, last})
    for moment in times:
        if not playback.times[0] <= moment <= playback.times[last]:
            raise SceneError(
                f"times must lie between {playback.times[0]:g} and {playback.times[last]:g} s, got {moment:g}"
            )
    return [int(np.abs(playback.times - moment).argmin()) for moment in times]


def _pictures(
    playback: Playback, frames: list[int], folder: Path, with_viewer: bool | None
) -> tuple[list[Any] | None, str]:
    """Return the viewer's pictures, or None, and the name of the drawing program."""
    reason = "--no-viewer" if with_viewer is False else viewer.no_driver()
    if reason is None:
        try:
            files = viewer.pictures(playback.path, [playback.numbers[k] for k in frames], folder)
            return [imread(file) for file in files], "the Rerun viewer"
        except RunError as error:
            reason = str(error)
    if with_viewer:
        raise RunError(f"the Rerun viewer cannot draw here: {reason}")
    return None, f"matplotlib, from the data in the recording, not by the Rerun viewer: {reason}"


def _sheet(playback: Playback, frames: list[int], found: list[Any] | None, by: str) -> Any:
    plane = playback.about.get("plane") or None
    every = series.plots_of({path: (playback.names[path], *values) for path, values in playback.series.items()})
    plots = {group: curves for group, curves in every.items() if not series.says_nothing(group, curves)}
    wide = _CELL * _COLUMNS
    sentence_lines = sentences.in_lines(_sentences(playback, every), wide)
    rows, text = (
        graphs.rows_of(len(plots), _PLOT * wide),
        sentences.height_of_lines(sentence_lines) if sentence_lines else 0.0,
    )
    heights = [_HIGH * -(-len(frames) // _COLUMNS), max(2.7 * len(rows), 0.1), max(text, 0.1)]
    picture = style.picture(wide, sum(heights))
    top, middle, bottom = picture.subfigures(3, 1, height_ratios=heights, squeeze=False).ravel()
    _frames(top, playback, frames, found)
    picture.suptitle(title_of_sheet(playback), fontsize=12)
    picture.text(0.995, 0.005, f"drawn by {by.split(',')[0]}", ha="right", va="bottom", fontsize=7, color=INK)
    for axes, (group, curves) in zip(graphs.cells_of(middle, rows), plots.items(), strict=True):
        graphs.lines(axes, series.GRAPHS[group].across(plane), curves)
    sentences.write_below(bottom, sentence_lines, heights[-1])
    return picture


def _frames(top: Any, playback: Playback, frames: list[int], found: list[Any] | None) -> None:
    """Draw the frames: the viewer's pictures, or our own."""
    about = playback.about
    across, cells, packed = PLANES.get(about.get("plane")), [], []
    for place, k in enumerate(frames):
        at = -(-len(frames) // _COLUMNS), min(_COLUMNS, len(frames)), place + 1
        cells.append(top.add_subplot(*at))
        cells[-1].set_title(f"t = {playback.times[k]:.6g} s  (frame {playback.numbers[k]})", fontsize=10, color=INK)
        if found:
            cells[-1].imshow(found[place])
            cells[-1].set_axis_off()
        else:
            number = playback.numbers[k]
            ties, points = (playback.lines(number), playback.faces(number)), playback.frame(number)
            drawing.frame(cells[-1], *points, playback.shapes_at(number), *ties, across, playback.radius)
            packed.append(points[1])
    drawing.colour_bar(top, cells, about["quantity"], about["low"], about["high"], packed or None)


def title_of_sheet(playback: Playback) -> str:
    """The title of the run, if the recording has it, and the number of drawn particles if some are left out."""
    about, frames = playback.about, len(playback.times)
    shown, every, noun = about["shown"], about["particles"], about["noun"]
    noun = {"particles": "particle", "bodies": "body"}.get(noun, noun) if every == 1 else noun
    if title := about.get("title"):
        return title if shown == every else f"{title}\n{many(shown)} of {many(every)} {noun} are drawn"
    of = "" if shown == every else f" of {many(every)}"
    return f"{playback.path.name}: {many(shown)}{of} {noun}, {frames} frame{'s' * (frames > 1)}"


def _sentences(playback: Playback, every: dict[str, graphs.Curves]) -> list[str]:
    """The verdicts on the run or, if the recording has none, sentences in place of empty plots."""
    if playback.verdicts is not None:
        return playback.verdicts
    return [text for group, text in _NONE.items() if group in every and series.says_nothing(group, every[group])]
