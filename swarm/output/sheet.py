"""Contact sheets: some frames of a recording and its time series in one picture."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.image import imread

from ..errors import RunError, SceneError
from ..plane import across_of
from . import drawing, graphs, series, style, viewer
from .playback import Playback
from .replaced import named_when_whole

_COLUMNS = 3


def draw_sheet(playback: Playback, target: Path, times: list[float] | None, with_viewer: bool | None) -> str:
    """Draw the frames nearest to these times (None: the first, the middle and the last); returns what drew them.

    Args:
        playback: the recording.
        target: the PNG to write.
        times: [s], within the recording.
        with_viewer: True: by the Rerun viewer; False: by matplotlib; None: by the viewer if it can draw here.

    Raises:
        SceneError: a time is outside the recording.
        RunError: the viewer is wanted and cannot draw.
        FileError: the picture cannot be written.
    """
    numbers = _chosen(playback, times)
    with tempfile.TemporaryDirectory() as folder, style.applied():
        found, by = _pictures(playback, numbers, Path(folder), with_viewer)
        picture = _sheet(playback, numbers, found, by)
    with named_when_whole(target) as part, style.applied():
        picture.savefig(part)
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
    """Pictures by the viewer, or None, and what draws them."""
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
    plots = series.plots_of({path: (playback.names[path], *values) for path, values in playback.series.items()})
    above, below = -(-len(frames) // _COLUMNS), -(-len(plots) // _COLUMNS)
    picture = style.picture(5.4 * _COLUMNS, 5.0 * above + 2.7 * below)
    top, bottom = picture.subfigures(2, 1, height_ratios=[5.0 * above, 2.7 * below], squeeze=False).ravel()
    about = playback.about
    across, cells, packed = across_of(about.get("plane") or None), [], []
    for place, k in enumerate(frames):
        at = above, min(_COLUMNS, len(frames)), place + 1
        cells.append(top.add_subplot(*at) if found else drawing.view(top, across, *at))
        cells[-1].set_title(
            f"t = {playback.times[k]:.6g} s  (frame {playback.numbers[k]})", fontsize=10, color=drawing.LIGHT
        )
        if found:
            cells[-1].imshow(found[place])
            cells[-1].set_axis_off()
        else:
            number = playback.numbers[k]
            ties, points = (playback.lines(number), playback.faces(number)), playback.frame(number)
            drawing.frame(cells[-1], *points, playback.shapes_at(number), *ties, across, playback.radius)
            packed.append(points[1])
    drawing.colour_bar(top, cells, about["quantity"], about["low"], about["high"], packed or None)
    count = "1 frame" if len(playback.times) == 1 else f"{len(playback.times)} frames"
    title = f"{playback.path.name}: {about['shown']} of {about['particles']} {about['noun']}, {count}"
    top.suptitle(title, fontsize=11)
    top.text(0.995, 0.005, f"drawn by {by.split(',')[0]}", ha="right", va="bottom", fontsize=7, color=drawing.LIGHT)
    for place, (group, curves) in enumerate(plots.items()):
        graphs.lines(
            bottom.add_subplot(below, _COLUMNS, place + 1), *series.title_of(group, about.get("plane") or None), curves
        )
    return picture
