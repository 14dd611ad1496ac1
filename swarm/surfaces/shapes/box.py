"""Box: one slab an axis, and a plane where one of its two faces is open."""

import itertools
import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ...common.checks import Vector, list_of, one_of
from ...common.validated import Lengths
from ...errors import SceneError
from ...kernel.vector import vec
from .. import rotation as rotations
from ..balls.rounded import RoundBox
from ..surface import TILT, HalfSpace, Surface, box_around, farthest, rotated_box, side_sign
from ..surface import Box as Bounds
from .plane import PlaneNumbers
from .slab import slab_numbers
from .solid import body

FACES = tuple(sign + axis for axis, sign in itertools.product("xyz", "-+"))


def _faces(name: str, value: Any) -> tuple[str, ...]:
    """Return `value` as the faces of a box that have no wall."""
    given = list_of(name, value, "faces such as '+x'")
    faces = tuple(one_of(f"{name}[{i}]", face, FACES) for i, face in enumerate(given))
    for i, face in enumerate(faces):
        if face in faces[:i]:
            raise SceneError(f"{name} must name each face once, got {face!r} twice")
    if len(faces) == len(FACES):
        raise SceneError(f"{name} must leave a wall, got all six faces")
    return faces


@dataclass(frozen=True, repr=False)
class Box(Surface):
    """A rectangular box; its cavity, of which faces may be open, or the space around the solid.

    Args:
        half_widths: three numbers > 0 [m], from the centre to the faces.
        center: three numbers [m].
        side: "inside" or "outside", the admissible part.
        open: faces without a wall, of "-x", "+x", "-y", "+y", "-z", "+z"; for a cavity only, and not all six. The
            other walls continue without end beyond an open face.

    Raises:
        SceneError: an argument is out of its range.

    >>> Box(half_widths=(1.0, 1.0, 1.0), open=["+z"]).phi([[0.0, 0.0], [0.0, 0.0], [5.0, -1.5]])
    array([-1. ,  0.5])
    """

    nouns = ("box", "block", "rectangle", "block")
    half_widths: Lengths
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    is_convex = True
    has_edges = True
    open: Annotated[tuple[str, ...], _faces] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.open and self.side == "outside":
            raise SceneError(f'open must be empty for side="outside", got {list(self.open)}')

    def walls(self) -> tuple[Any, ...]:
        sign = side_sign(self.side)
        axes = rotations.matrix(self.rotation).T.tolist()
        parts: list[Any] = []
        for name, (x, y, z), half in zip("xyz", axes, self.half_widths, strict=True):
            low, high = ("-" + name in self.open), ("+" + name in self.open)
            if not (low or high):
                parts.append(slab_numbers((x, y, z), half, self.center, sign))
            elif not high:
                parts.append(_face((x, y, z), half, self.center))
            elif not low:
                parts.append(_face((-x, -y, -z), half, self.center))
        if self.side == "inside":
            return tuple(parts)
        return (body(parts, math.hypot(*self.center)),)

    def walls_of_balls(self, largest: float) -> tuple[Any, ...]:
        if not self.is_solid():
            return self.walls()
        box = RoundBox(vec(self.own_center()), vec(self.half_widths), 0.0)
        return (rotations.rotated(self.rotation, box),)

    def open_faces(self) -> list[HalfSpace]:
        axes = rotations.matrix(self.rotation).T
        planes = []
        for face in self.open:
            i = "xyz".index(face[1])
            x, y, z = (axes[i] if face[0] == "+" else -axes[i]).tolist()
            planes.append(((x, y, z), _face((x, y, z), self.half_widths[i], self.center).offset))
        return planes

    def size(self) -> float:
        return min(self.half_widths)

    def bounds(self) -> Bounds:
        low, high = box_around(self.center, self.half_widths, self.side)
        lx, ly, lz = (-math.inf if "-" + name in self.open else low[i] for i, name in enumerate("xyz"))
        hx, hy, hz = (math.inf if "+" + name in self.open else high[i] for i, name in enumerate("xyz"))
        return rotated_box(self.rotation, ((lx, ly, lz), (hx, hy, hz)), self.center)

    def enclosed(self, across: int | None) -> float | None:
        if self.open:
            return None
        widths = [2.0 * half for half in self.half_widths]
        if across is None:
            return math.prod(widths)
        tilts = np.abs(rotations.matrix(self.rotation)[across])
        upright = int(np.argmax(tilts))
        if np.delete(tilts, upright).max() > TILT or abs(self.center[across]) >= self.half_widths[upright]:
            return None
        return math.prod(width for k, width in enumerate(widths) if k != upright)

    def extent(self) -> float:
        return farthest(self.center) + math.hypot(*self.half_widths)


def _face(normal: Vector, half: float, center: Vector) -> PlaneNumbers:
    return PlaneNumbers(vec(normal), sum(n * c for n, c in zip(normal, center, strict=True)) + half)
