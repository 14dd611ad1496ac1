"""Trajectories in the formats of other programs, chosen by the suffix of the file.

.vtkhdf (vtkhdf.py) for ParaView and VTK, .xyz (xyz.py) for OVITO and ASE, .gsd (gsd.py) for HOOMD-blue and freud.
A frame is in memory at a time. 10 000 particles and 500 frames take, read and written, 0.9 s of one core and 280 MB as
.vtkhdf, 5.5 s and 660 MB as .xyz, 1.1 s and 200 MB as .gsd.
"""

import contextlib
import importlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import checks
from ..errors import SceneError
from ..extras import needed_by
from . import paths
from .replaced import named_when_whole
from .stored import whole

SUFFIXES = (".vtkhdf", ".xyz", ".gsd")
# Is called with how many frames are written, and how many there are to write.
Progress = Callable[[int, int], None]


def export(
    trajectory: Any,
    path: str | Path,
    frames: slice | int | None,
    particles: int,
    surfaces: bool,
    overwrite: bool,
    progress: Progress | None,
) -> list[Path]:
    """Write a trajectory to a file of another format; see `Trajectory.export`."""
    target = paths.target_of("path", path)
    kind = target.suffix.lower()
    if kind not in SUFFIXES:
        raise SceneError(f"export: expected a file name that ends in {', '.join(SUFFIXES)}, got {target}")
    checks.flag("surfaces", surfaces)
    chosen = Exported(trajectory, frames, particles, progress)
    targets = [target]
    if kind == ".vtkhdf" and surfaces and trajectory.scene.surfaces:
        targets.append(target.with_suffix(".surfaces.vtkhdf"))
    for one in targets:
        paths.check_distinct({"export": one}, {"trajectory": trajectory.path})
        paths.check_target(one, overwrite, "export")
    # What is missing is found before anything is written.
    with needed_by(f"an export as {kind}", "gsd"):
        form = importlib.import_module(f".{kind[1:]}", __package__)
    with contextlib.ExitStack() as stack:
        if len(targets) > 1:
            with needed_by("an export with surfaces, which --no-surfaces or surfaces=False leaves out,", "plot"):
                from . import walls
            drawn = walls.shapes(chosen)
            walls.write_walls(chosen, drawn, stack.enter_context(named_when_whole(targets[1])))
        form.write(chosen, stack.enter_context(named_when_whole(target)))
    return targets


class Moment(NamedTuple):
    """A frame; rows are particles, as in files."""

    number: int
    time: float  # [s]
    position: NDArray[Any]  # (n, 3) [m]
    velocity: NDArray[Any]  # (n, 3) [m/s]
    # Further columns by their names, (n,) or (n, 3): "impacts"; where there are some, "image" and "escape_time".
    more: dict[str, NDArray[Any]]


class Exported:
    """The chosen frames and particles of a trajectory.

    Attributes:
        trajectory: what is exported.
        numbers, times: of the frames, times in [s].
        ids: (n,) numbers of the particles; mass: (n,) [kg].
        bonds: (B, 2) rows that are tied, of bodies.
        periods: the lengths of the cell that repeats, 0 where none does.
    """

    def __init__(self, trajectory: Any, frames: slice | int | None, particles: int, progress: Progress | None) -> None:
        """Choose: `frames` is a slice or one number, `particles` k is every k-th particle or body.

        Raises:
            SceneError: there is no such frame, or the file keeps no particles.
        """
        self.trajectory, self._progress = trajectory, progress
        trajectory.require_frames()
        self.numbers = _numbers(frames, len(trajectory))
        self.times = trajectory.times[list(self.numbers)]
        checks.count("particles", particles)
        ids, size = trajectory.ids, trajectory.copies
        # Point p of body i is particle p n + i: a body is exported whole, or not.
        some = np.arange(len(ids)) % particles == 0 if not size else ids % size % particles == 0
        self._rows: Any = slice(None) if some.all() else np.flatnonzero(some)
        self.ids = ids[self._rows]
        self.mass = trajectory.frame(self.numbers[0]).mass[self._rows]
        self.bonds = _among(self.ids, trajectory.bonds)
        self.periods = np.array([length or 0.0 for length in trajectory.scene.period or (None,) * 3])

    def __len__(self) -> int:
        """Number of particles of a frame."""
        return len(self.ids)

    def moments(self) -> Iterator[Moment]:
        """The frames one after the other, each of which is written when the next is asked for."""
        for done, (number, time) in enumerate(zip(self.numbers, self.times.tolist(), strict=True)):
            held = {name: column[self._rows] for name, column in self.trajectory.columns(number).items()}
            yield Moment(number, time, held.pop("position"), held.pop("velocity"), held)
            if self._progress is not None:
                self._progress(done + 1, len(self.numbers))


def _numbers(frames: slice | int | None, n: int) -> range:
    """The numbers of the chosen ones of n frames."""
    if frames is None:
        return range(n)
    if isinstance(frames, slice):
        try:
            found = range(n)[frames]
        except (TypeError, ValueError) as error:
            raise SceneError(
                f"frames must be a slice of whole numbers with a step other than 0, got {frames}"
            ) from error
        if not found:
            raise SceneError(f"frames must hold one of the frames 0 to {n - 1}, got {frames}")
        return found if found.step > 0 else found[::-1]
    k = whole("frames", frames)
    if not -n <= k < n:
        raise SceneError(f"frames must lie between {-n} and {n - 1}, got {k}")
    return range(k % n, k % n + 1)


def _among(ids: NDArray[np.int64], bonds: NDArray[np.int64]) -> NDArray[np.int64]:
    """The pairs of particles, of which both are exported, as rows."""
    rows = np.searchsorted(ids, bonds).clip(max=len(ids) - 1)
    return np.asarray(rows[(ids[rows] == bonds).all(axis=1)])
