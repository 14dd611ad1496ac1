"""A page of panels in the look of swarm's pictures, and what several of them show alike."""

import io
import math
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import swarm

# Where three-dimensional panels are seen from [degrees], and that direction.
ELEVATION, AZIMUTH = 14.0, -60.0
SIGHT = (
    math.cos(math.radians(ELEVATION)) * math.cos(math.radians(AZIMUTH)),
    math.cos(math.radians(ELEVATION)) * math.sin(math.radians(AZIMUTH)),
    math.sin(math.radians(ELEVATION)),
)
# A file above this [bytes] is written with 256 colours.
_LARGE = 120_000


@contextmanager
def page(
    file: Path, title: str, rows: int = 1, columns: int = 1, size: tuple[float, float] = (6.0, 4.0), **panels: Any
) -> Iterator[list[Any]]:
    """Axes, row by row, of a picture of this size [inches] that is written to `file` at the end of the block.

    `panels` are further arguments of `Figure.subplots`.
    """
    # Imported here: only drawing needs matplotlib.
    from swarm.pictures import style

    with style.applied():
        picture = style.picture(*size)
        lines = math.ceil(len(title) / (9.2 * size[0]))
        picture.suptitle(title if lines == 1 else textwrap.fill(title, len(title) // lines + 8))
        yield list(picture.subplots(rows, columns, squeeze=False, **panels).flat)
        save(picture, file)


def save(picture: Any, file: Path) -> None:
    """A PNG at 150 dots an inch: without a version in it, so that the same numbers give the same bytes."""
    from PIL import Image

    buffer = io.BytesIO()
    picture.savefig(buffer, format="png", dpi=150, metadata={"Software": None})
    if buffer.tell() > _LARGE:
        Image.open(buffer).convert("RGB").quantize(256).save(file, format="png", optimize=True)
    else:
        file.write_bytes(buffer.getvalue())


def law(axes: Any, x: Any, y: Any, label: str | None = None, line: str = "-") -> None:
    """A thin grey line: what a theory says, beside what is measured; level where `y` is a number and `x` is None."""
    from swarm.pictures.style import GREY

    thin: Any = {"color": GREY, "linewidth": 1.2, "zorder": 1, "label": label, "linestyle": line}
    if x is None:
        axes.axhline(y, **thin)
    else:
        axes.plot(x, y, **thin)


def outline(axes: Any, scene: swarm.Scene) -> None:
    """The walls of a table of two dimensions, x and y in metres."""
    from swarm.pictures.style import CAVITY_LINE

    for curve in scene.surfaces[0].curves():
        axes.plot(*curve[:, :2].T, color=CAVITY_LINE, zorder=1)
    axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axes.grid(False)


def solid(axes: Any, center: tuple[float, float], radius: float) -> None:
    """The section of a ball, a cylinder or a peg."""
    from matplotlib.patches import Circle

    from swarm.pictures.style import SOLID, SOLID_LINE

    axes.add_patch(Circle(center, radius, facecolor=SOLID, edgecolor=SOLID_LINE, linewidth=0.6, zorder=2.5))


def vessel(axes: Any, parts: list[tuple[Any, str]], places: Any) -> None:
    """Triangles (n, 3, 3), each with its colour, as a glass with particles (3, n) in it, as large as the panel allows.

    `axes` are three-dimensional ones.
    """
    import numpy as np
    from matplotlib.colors import to_rgba
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    from swarm.pictures.style import BLUE

    axes.set_axis_off()
    axes.computed_zorder = False
    for triangles, colour in parts:
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-300
        # Seen from the side a wall of glass is darker than from the front.
        facing = np.abs(normal @ SIGHT)
        shades = np.tile(to_rgba(colour), (len(triangles), 1))
        shades[:, 3] = 0.08 + 0.45 * (1.0 - facing) ** 2
        axes.add_collection3d(Poly3DCollection(triangles, facecolor=shades, edgecolor="none", zorder=1))
    axes.scatter(*places, s=3.0, color=BLUE, linewidths=0.0, depthshade=False, zorder=2)
    corners = np.concatenate([triangles.reshape(-1, 3) for triangles, _colour in parts])
    low, high = corners.min(axis=0), corners.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.view_init(elev=ELEVATION, azim=AZIMUTH)
    axes.set_box_aspect(high - low, zoom=1.35)
