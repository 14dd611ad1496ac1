"""A trajectory as a film: particles among their walls, frame by frame, with the writers of matplotlib."""

import bisect
import contextlib
import shutil
import signal
from pathlib import Path
from subprocess import CalledProcessError
from typing import Any

import matplotlib
import numpy as np
from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from ..common import checks
from ..errors import FileError, SceneError
from ..files import marks, paths
from ..files.replaced import named_when_whole
from ..files.sources import cause
from ..state import Floats
from ..surfaces.plane import shown_as
from ..triangles.shape import Shape
from ..triangles.shapes import cell_of, shapes_of, since_start
from ..words.amounts import many
from ..words.gone import gone_at, without
from . import colours, drawing, flat, framed, style
from .drawn import Drawn
from .scenery import Scenery, red_green_blue
from .triad import INK

_SUFFIXES = (".mp4", ".gif")
# The smallest and the largest side of a film [pixels].
_LEAST, _MOST = 64, 8192
# Pixels an inch, which give letters the size of those of a plot; fewer if a side has fewer than the second number of
# pixels: the letters would leave no room for the axes.
_DPI, _ROOM = 120, 240
# A GIF counts in hundredths of a second, and viewers replace 0 and 1 by 10.
_FASTEST = 50.0


# Matplotlib's writers draw every frame anew, twice; these use the canvas that `_Film` has drawn.


class _Video(FFMpegWriter):
    def grab_frame(self, **_options: Any) -> None:
        self._proc.stdin.write(self.fig.canvas.buffer_rgba())  # type: ignore[attr-defined]


class _Gif(PillowWriter):
    """Keeps frames in the palette of the first one, a byte a pixel: four bytes would fill the memory."""

    _frames: list[Any]

    def grab_frame(self, **_options: Any) -> None:
        image = Image.fromarray(np.asarray(self.fig.canvas.buffer_rgba())[:, :, :3])  # type: ignore[attr-defined]
        first = self._frames[0] if self._frames else None
        self._frames.append(
            image.quantize() if first is None else image.quantize(palette=first, dither=Image.Dither.NONE)
        )


def animate(trajectory: Any, path: Any, frames: int, fps: float, size: Any, particles: int, overwrite: bool) -> Path:
    """Write the film of a trajectory; see `Trajectory.animate`."""
    target = paths.target_of("animate", path)
    if target.suffix.lower() not in _SUFFIXES:
        raise SceneError(f"animate: expected a file name that ends in {' or '.join(_SUFFIXES)}, got {path}")
    marks.check_target(target, overwrite, "film")
    paths.check_distinct({"film": target}, {"trajectory": trajectory.path})
    most, rate = checks.count("frames", frames), checks.positive("fps", fps)
    pixels = pixels_of(size)
    shown = checks.count("particles", particles)
    is_gif = target.suffix.lower() == ".gif"
    if is_gif and rate > _FASTEST:
        raise SceneError(f"fps must be at most {_FASTEST:g} for a GIF, got {rate:g}")
    made: Any = _Gif if is_gif else _Video  # which take any number, and are annotated with an int
    writer = made(rate)
    ffmpeg: Any = {} if is_gif else {"animation.ffmpeg_path": _ffmpeg()}
    trajectory.require_frames()
    last = len(trajectory) - 1
    numbers = np.unique(np.linspace(0, last, min(most, last + 1)).round().astype(int)).tolist()
    with style.applied():
        film = _Film(trajectory, numbers, pixels, shown)
    with named_when_whole(target) as part, style.applied(), matplotlib.rc_context(ffmpeg):
        try:
            with writer.saving(film.picture, str(part), film.picture.dpi):
                for k in numbers:
                    film.show(k)
                    writer.grab_frame()
        except (OSError, CalledProcessError) as error:
            raise FileError(f"cannot write the film {target}: {_reason(error)}") from error
    return target


def pixels_of(size: Any) -> tuple[int, int]:
    """Return the width and the height of a film, both even, as videos need them."""
    with contextlib.suppress(TypeError, ValueError):
        wide, high = size
        sides = checks.count("size", wide, _LEAST), checks.count("size", high, _LEAST)
        if max(sides) <= _MOST:
            return sides[0] // 2 * 2, sides[1] // 2 * 2
    raise SceneError(f"size must be width and height in pixels, {_LEAST} to {_MOST} each, got {size!r}")


def _ffmpeg() -> str:
    """Return the path of the program that writes videos."""
    found = shutil.which("ffmpeg")
    if found is None:
        with contextlib.suppress(ImportError, RuntimeError):
            import imageio_ffmpeg

            found = imageio_ffmpeg.get_ffmpeg_exe()
    if found is None:
        raise SceneError(
            "an .mp4 needs the program ffmpeg, which is not installed: pip install imageio-ffmpeg, or write a .gif"
        )
    return str(found)


def has_ffmpeg() -> bool:
    """Whether videos can be written."""
    with contextlib.suppress(SceneError):
        return bool(_ffmpeg())
    return False


def _reason(error: Exception) -> str:
    """The message of an error; for ffmpeg the last line of its output."""
    if isinstance(error, CalledProcessError):
        message = error.stderr.decode(errors="replace") if isinstance(error.stderr, bytes) else error.stderr
        ended = signal.strsignal(-error.returncode) if error.returncode < 0 else f"exit code {error.returncode}"
        return (message or "").strip().rpartition("\n")[2] or f"ffmpeg ended: {ended}"
    return cause(error)


class _Film:
    """The picture; its artists change from frame to frame."""

    def __init__(self, trajectory: Any, numbers: list[int], pixels: tuple[int, int], most: int) -> None:
        self._trajectory, self._scene = trajectory, trajectory.scene
        self._seen, (start, last) = trajectory.observed(), (trajectory.frame(numbers[k]) for k in (0, -1))
        self._drawn = drawn = Drawn(len(start), trajectory.body, most, start.radius)
        # Unbounded walls are drawn around the particles of the first frame and of the last.
        self._around = np.concatenate([framed.most_of(one.position) for one in (start, last)], axis=1)
        self._between = dict[tuple[int, float], list[Shape]]()
        self._noun = drawn.noun_of(drawn.count, self._scene.plane)
        self._changes = self._scene.moves() or self._scene.has_doors()
        self._shapes = shapes_of(self._scene, self._around)
        self._scale, self._values = colours.by_speed(self._scene, trajectory.method, start, last)
        # Half a pixel is added so that round-off does not remove a pixel.
        dpi = _DPI * min(1.0, min(pixels) / _ROOM)
        self.picture = style.picture((pixels[0] + 0.5) / dpi, (pixels[1] + 0.5) / dpi)
        self.picture.set_dpi(dpi)
        self._canvas: Any = FigureCanvasAgg(self.picture)
        self._across = across = self._scene.across()
        self._axes = self.picture.add_subplot()
        self._title = self.picture.suptitle("t", fontsize=10, color=INK)
        found = self._found(numbers)
        self._scenery: Scenery | None = None
        self._walls: list[Any] = []
        self._dots: Any = None
        if across is not None:
            at = drawn.points(start.position).T
            self._dots, self._walls = flat.flat(self._axes, across, at, INK, self._shapes, found, drawn.radius)
            # Walls are in front of particles; all artists that do not change are drawn once, except these.
            self._walls = [one for one in self._walls if self._changes or one.get_zorder() > self._dots.get_zorder()]
            changing = [*self._walls, self._dots]
        else:
            self._scenery = Scenery(self._axes, self._shapes + cell_of(self._scene), found)
            self._scenery.walls()
            self._scenery.near_lines()
            changing = [*self._scenery.front, *(self._scenery.still if self._changes else [])]
        for artist in (*changing, self._title):
            artist.set_animated(True)
        scale = self._scale
        drawing.colour_bar(self.picture, self._axes, scale.quantity, scale.low, scale.high)
        self._canvas.draw()
        self.picture.set_layout_engine("none")
        self._still = self._canvas.copy_from_bbox(self.picture.bbox)

    def _found(self, numbers: list[int]) -> list[Floats]:
        """The points that the picture must contain: walls in all frames, and particles if no wall encloses them."""
        found = []
        for k in numbers if self._changes or framed.is_open(self._shapes) else numbers[:1]:
            points = self._drawn.points(self._trajectory.frame(k).position).T
            found += framed.ends(framed.around(points, self._walls_at(k), self._drawn.radius))
        return found

    def _walls_at(self, k: int) -> list[Shape]:
        """The walls at frame k: those of the start, moved."""
        if self._scene.has_doors() or any(shape.motion is not None for shape in self._shapes):
            # Where doors shut, or parts of a union move, the shapes of the walls change.
            return self._walls_then(float(self._seen["time"][k]))
        if not self._scene.moves():
            return self._shapes
        places = self._seen["wall_position"][k], self._seen["wall_orientation"][k]
        moments = self._seen["time"][k]
        return [shape.moved(*since_start(self._scene, shape, moments, places)) for shape in self._shapes]

    def _walls_then(self, time: float) -> list[Shape]:
        """The present walls at a time [s], made once for each interval between instants."""
        which = bisect.bisect_right(self._scene.instants, time), time if self._scene.moves() else 0.0
        if which not in self._between:
            self._between[which] = shapes_of(self._scene, self._around, time)
        return self._between[which]

    def show(self, k: int) -> None:
        """Draw frame k on the canvas."""
        drawn = self._drawn
        frame = without(self._trajectory.frame(k), gone_at(self._trajectory, k))
        position, packed, tints = drawn.coloured(frame, self._scale, self._values)
        here = int((~np.isnan(position[0])).sum()) if drawn.noun == "particles" else drawn.shown
        of = f" of {many(drawn.count)}" if here < drawn.count else ""
        self._title.set_text(f"t = {self._seen['time'][k]:.4g} s,  {many(here)}{of} {self._noun}")
        self._canvas.restore_region(self._still)
        if self._scenery is None:
            artists, gone = self._in_plane(k, position, packed)
        else:
            artists, gone = self._in_space(k, position, packed, tints)
        for artist in sorted(artists, key=lambda artist: artist.get_zorder()):
            self._axes.draw_artist(artist)
        self.picture.draw_artist(self._title)
        for artist in gone:
            artist.remove()

    def _in_plane(self, k: int, position: Floats, packed: Any) -> tuple[list[Any], list[Any]]:
        """The artists of a frame, and those among them that only this frame has."""
        dots, across = self._dots, self._across
        assert across is not None
        dots.set_offsets(shown_as(across, position.T))
        colour = red_green_blue(packed)
        if self._drawn.radius is not None:
            dots.paint(colour)
        else:
            dots.set_facecolor(colour)
        walls = self._walls
        if self._changes:
            walls = flat.draw_walls(self._axes, across, self._walls_at(k), float(np.ptp(self._axes.get_xlim())))
        return [*walls, dots], walls if self._changes else []

    def _in_space(self, k: int, position: Floats, packed: Any, tints: Any) -> tuple[list[Any], list[Any]]:
        """The artists of a frame, and those among them that only this frame has."""
        scenery = self._scenery
        assert scenery is not None
        walls = list[Any]()
        if self._changes:
            scenery.clear()
            scenery.shapes = self._walls_at(k)
            scenery.walls()
            scenery.near_lines()
            walls = scenery.still
        lines, faces = self._drawn.ties(position.T, packed, tints)
        mine = scenery.matter(position.T, packed, lines, faces, self._drawn.radius)
        return [*walls, *mine, *scenery.front], mine
