"""Fields of many solids in a recording: a few float32 numbers for each, from which the viewer draws all solids itself.

Balls are points with a radius, 16 bytes each; ellipsoids, boxes, cylinders and capsules have their quaternions, 36
to 40 bytes: a million balls take 18 MB and 2.5 s of one core. Beside them are curves of a few solids, which
`swarm view` draws if there is no viewer.
"""

from typing import Any

import numpy as np
import rerun as rr

from ..state import Floats
from ..surfaces.rotation import matrices
from ..triangles.solids import Solids, curves

# Bytes of a ball, and of another solid.
_BALL_BYTES, _SOLID_BYTES = 16, 40


def bytes_of(solids: Solids) -> int:
    """Return the number of bytes in a recording."""
    each = _BALL_BYTES if solids.kind == "spheres" else _SOLID_BYTES
    return each * len(solids.centers) + sum(12 * len(curve) for curve in curves(solids))


def log(stream: Any, path: str, solids: Solids, center: Floats, looks: tuple[Any, Any], static: bool) -> None:
    """Log the solids of the wall of a path, in the colours `looks` of faces and of lines."""
    (*face, _clear), wire = looks
    stream.log(f"{path}/bodies", _archetype(solids, (solids.centers - center).astype(np.float32), face), static=static)
    lines = [curve - center for curve in curves(solids)]
    strips = rr.LineStrips3D(lines, colors=[wire], radii=rr.Radius.ui_points(0.5))
    stream.log(f"{path}/wires", strips, static=static)


def _archetype(solids: Solids, centers: Any, colour: Any) -> Any:
    halves = solids.halves.astype(np.float32)
    if solids.kind == "spheres":
        return rr.Points3D(centers, radii=halves[:, 0], colors=[colour])
    turned: dict[str, Any] = {"quaternions": solids.turns[:, [1, 2, 3, 0]].astype(np.float32), "colors": [colour]}
    turned["fill_mode"] = "solid"
    if solids.kind == "boxes":
        return rr.Boxes3D(half_sizes=halves, centers=centers, **turned)
    if solids.kind == "ellipsoids":
        return rr.Ellipsoids3D(half_sizes=halves, centers=centers, **turned)
    radius, half = halves[:, 0], halves[:, 2]
    if solids.kind == "cylinders":
        return rr.Cylinders3D(lengths=2.0 * half, radii=radius, centers=centers, **turned)
    # The viewer's capsules begin at the centre of their first cap.
    straight = half - radius
    axes = matrices(solids.turns)[:, :, 2]
    begin = centers - (straight[:, None] * axes).astype(np.float32)
    return rr.Capsules3D(lengths=2.0 * straight, radii=radius, translations=begin, **turned)
