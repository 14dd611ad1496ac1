"""A film that a notebook shows and contains."""

import base64
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import SceneError
from ..files import marks, paths
from . import film

# Notebooks with more base64 than this hang when they are opened, saved or scrolled.
_MOST = 30_000_000
# Letters of base64 are four for three bytes.
_LETTERS = 4 / 3


@dataclass(frozen=True, repr=False)
class Film:
    """A film of a trajectory, which a notebook shows where it is the last line of a cell.

    Attributes:
        content: the bytes of the file.
        suffix: ".mp4", or ".gif" where ffmpeg is not installed.
        frames, fps, size: their number, their number per second, and width and height in pixels.
        name: the file name of the trajectory.

    It is kept in the notebook with the other output, and plays in a saved one without a kernel. See `Trajectory.film`.
    """

    content: bytes
    suffix: str
    frames: int
    fps: float
    size: tuple[int, int]
    name: str

    def __repr__(self) -> str:
        wide, high = self.size
        seconds = self.frames / self.fps
        return f"Film({self.name}: {self.frames} frames, {seconds:.3g} s, {wide} x {high} pixels, {self._megabytes()})"

    def _repr_html_(self) -> str:
        if len(self.content) * _LETTERS > _MOST:
            return (
                f"<p>This film has {self._megabytes()}, and more than {_MOST / _LETTERS / 1e6:.3g} MB in a notebook "
                "make it hang: take fewer frames= or a smaller size=, or write it to a file by its method save.</p>"
            )
        text = base64.b64encode(self.content).decode("ascii")
        look = f'width="{self.size[0]}" height="{self.size[1]}" style="max-width: 100%; height: auto"'
        if self.suffix == ".gif":
            return f'<img alt="film" {look} src="data:image/gif;base64,{text}">'
        return f'<video controls loop muted autoplay playsinline {look} src="data:video/mp4;base64,{text}"></video>'

    def save(self, path: str | Path, overwrite: bool = False) -> Path:
        """Write the film to a file, `.mp4`, or `.gif` if it is one; return the path.

        Raises:
            SceneError: another suffix, or the file exists.
            FileError: the file cannot be written.
        """
        target = paths.target_of("save", path)
        if target.suffix.lower() != self.suffix:
            raise SceneError(
                f"save: this film is {'a' if self.suffix == '.gif' else 'an'} {self.suffix}, expected a file name "
                f"that ends so, got {path}; trajectory.animate writes the other kind"
            )
        return marks.write(target, self.content, "film", overwrite)

    def _megabytes(self) -> str:
        return f"{len(self.content) / 1e6:.2g} MB"


def film_of(trajectory: Any, frames: int, fps: float, size: Any, particles: int) -> Film:
    """The film of a trajectory; see `Trajectory.film`."""
    suffix = ".mp4" if film.has_ffmpeg() else ".gif"
    with tempfile.TemporaryDirectory() as folder:
        path = film.animate(trajectory, Path(folder, "film" + suffix), frames, fps, size, particles, overwrite=False)
        content = path.read_bytes()
    drawn = min(frames, len(trajectory))
    return Film(content, suffix, drawn, float(fps), film.pixels_of(size), trajectory.path.name)
