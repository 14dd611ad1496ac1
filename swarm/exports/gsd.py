"""GSD files in the schema of HOOMD-blue, by its library: particles, masses, images, and bonds of bodies.

Its numbers are float32, and its box is around the origin. In a periodic scene that is the cell: positions are relative
to its center, which is log/center. In a direction without a period the box is as wide as the scene, or as
the particles need, and only a scene far from the origin is shifted, by its center, log/center too. The
schema has no box without periods. Frames have the step number, and log/time [s], log/particles/id,
log/particles/impacts, with openings log/particles/escape_time, with absorbing walls absorbed_time;
balls have diameters, log/particles/collisions, and log/particles/spin if they turn. Images are
int32.
"""

from pathlib import Path

import gsd.hoomd
import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..files.origin import origin_of
from .exported import Exported, ExportedFrame


def write(chosen: Exported, path: Path) -> None:
    """Write the particles."""
    scene = chosen.trajectory.scene
    low, high = np.array(scene.bounds())
    center = origin_of(scene, chosen.trajectory.frame(chosen.numbers[0]))
    repeats = chosen.periods > 0.0
    center[repeats] = 0.5 * (low[repeats] + high[repeats])
    needed = np.where(np.isfinite(high - low), 2.0 * np.maximum(abs(low - center), abs(high - center)), 0.0)
    # The library keeps the permissions of an existing file; a new one would not be readable for all.
    path.touch()
    with gsd.hoomd.open(str(path), "w") as file:
        for moment in chosen.moments():
            file.append(_frame(chosen, moment, center, needed))


def _frame(
    chosen: Exported, moment: ExportedFrame, center: NDArray[np.float64], needed: NDArray[np.float64]
) -> gsd.hoomd.Frame:
    n, bonds = len(moment.ids), chosen.bonds
    position = (moment.position - center).astype(np.float32)
    edges = np.maximum(needed, 2.0 * abs(position).max(axis=0, initial=0.0)).astype(np.float32)
    # A direction in which particles have no extent, as in a plane, gets some.
    edges[edges == 0.0] = edges.max() or 1.0
    edges = np.where(chosen.periods > 0.0, chosen.periods.astype(np.float32), edges)
    frame = gsd.hoomd.Frame()
    frame.configuration.step, frame.configuration.dimensions = moment.number, 3
    frame.configuration.box = [*edges, 0.0, 0.0, 0.0]
    of = frame.particles
    of.N, of.types, of.typeid = n, ["A"], np.zeros(n, np.uint32)
    # A position at the edge of the cell may be rounded to float32 beyond it.
    of.position, of.velocity = position.clip(-0.5 * edges, 0.5 * edges), moment.velocity.astype(np.float32)
    of.mass = moment.mass.astype(np.float32)
    if moment.radius is not None:
        of.diameter = (2.0 * moment.radius).astype(np.float32)
    if "image" in moment.more:
        of.image = _in_32_bits(moment.more["image"], moment.number)
    if len(bonds):
        frame.bonds.N, frame.bonds.types, frame.bonds.group = len(bonds), ["bond"], bonds.astype(np.int32)
        frame.bonds.typeid = np.zeros(len(bonds), np.uint32)
    frame.log = {"time": np.array([moment.time]), "center": center, "particles/id": moment.ids}
    frame.log |= {f"particles/{name}": column for name, column in moment.more.items() if name != "image"}
    return frame


def _in_32_bits(images: NDArray[np.int64], number: int) -> NDArray[np.int32]:
    """Convert images to int32, the only type of the schema."""
    most = int(np.abs(images).max(initial=0))
    if most > np.iinfo(np.int32).max:
        raise SceneError(
            f"an export as .gsd must have images within 2**31 - 1, got {most} in frame {number}; choose frames before "
            "that, or export as .xyz or .vtkhdf, which keep them whole"
        )
    return images.astype(np.int32)
