"""Cone: phi = rho^2 cos^2 - z^2 sin^2 of one nappe: a quadric cut off by the plane through its apex."""

import functools
import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ...common.checks import Vector, number
from ...errors import SceneError
from ...kernel.vector import Vec, vec
from ...state import Floats
from .. import rotation as rotations
from ..balls.rounded import RoundCone
from ..balls.tip import Nappes, TipPlane
from ..parametrised import Triangles, halved
from ..surface import UNBOUNDED, Box, HalfSpace, farthest
from .plane import PlaneNumbers
from .quadratic import QuadricNumbers, quadric_numbers
from .revolved import Revolved, tangents
from .solid import body

# The points around it, and the parts of its height, of its triangles.
_ALONG, _RINGS = 96, 32
# A cone nearer to its tangent plane than this [rad] differs from it by round-off only.
_FLATTEST = 1e-12


@dataclass(frozen=True, repr=False)
class Cone(Revolved):
    """One nappe of a circular cone: the space in it, or around the solid.

    phi is in m^2: the distance from the wall times the distance from the opposite wall; below the apex the depth [m] if
    that is more. The apex is a singular point, where the wall has no normal: nearer to it than 1e-8 of a flight's
    length a hit is known to that distance only.

    Args:
        half_angle: the angle between the axis and the wall, in (0, pi/2) [rad].
        axis: three numbers, not all 0; from the apex into the cone.
        center: the apex, three numbers [m].
        side: "inside" or "outside", the admissible part.

    Raises:
        SceneError: an argument is out of its range.

    >>> Cone(half_angle=math.pi / 4).phi([[0.0, 0.0], [0.0, 0.0], [2.0, -1.0]]).round(12)
    array([-2.,  1.])
    """

    nouns = ("cone", "cone", "wedge", "wedge")
    half_angle: Annotated[float, functools.partial(number, expected="a finite number of radians")]
    axis: rotations.Direction = (0.0, 0.0, 1.0)
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    is_convex = True
    has_edges = True
    may_have_tip = True

    def __post_init__(self) -> None:
        super().__post_init__()
        angle = self.half_angle
        if not 0.0 < angle < 0.5 * math.pi:
            raise SceneError(f"half_angle must be between 0 and pi/2 rad, got {angle:g}")
        if angle > 0.5 * math.pi - _FLATTEST:
            raise SceneError(
                f"half_angle must be at most pi/2 - {_FLATTEST:g} rad, got pi/2 - {0.5 * math.pi - angle:.3g}: so "
                "flat a cone is a plane to round-off; use Plane"
            )

    def numbers(self) -> QuadricNumbers:
        """Return the numbers of both nappes in the frame where their axis is z."""
        a, b = math.cos(self.half_angle) ** 2, -(math.sin(self.half_angle) ** 2)
        return quadric_numbers(self.own_center(), (a, a, b), (0.0,) * 3, 0.0, self.side)

    def walls(self) -> tuple[Any, ...]:
        x, y, z = self.direction()
        offset = sum(n * c for n, c in zip((x, y, z), self.center, strict=True))
        nappes = super().walls()[0]
        if self.side == "inside":
            # The plane first: a flight along the axis meets both at the apex, and the plane has a normal there.
            return PlaneNumbers(Vec(-x, -y, -z), -offset), nappes
        # As a solid: the half-space above the apex, which has its admissible side below
        return (body((nappes, PlaneNumbers(Vec(x, y, z), offset)), math.hypot(*self.center)),)

    def walls_of_balls(self, largest: float) -> tuple[Any, ...]:
        sine, cosine = math.sin(self.half_angle), math.cos(self.half_angle)
        if self.is_solid():
            round_ = RoundCone(vec(self.own_center()), sine, cosine, 0.0)
            return (rotations.rotated(self.turn(), round_),)
        plane, _nappes = self.walls()
        nappes = Nappes(self.numbers(), Vec(0.0, 0.0, 1.0), sine, cosine)
        return TipPlane(plane, 1.0 / sine), rotations.rotated(self.turn(), nappes)

    def size(self) -> float:
        return math.inf

    def bounds(self) -> Box:
        if self.side == "outside":
            return UNBOUNDED
        # A direction u meets the cone's end at the apex where the angle between u and the axis is pi/2 + half_angle.
        steep = math.sin(self.half_angle)
        around = list(zip(self.center, self.direction(), strict=True))
        lx, ly, lz = (c if n >= steep else -math.inf for c, n in around)
        hx, hy, hz = (c if -n >= steep else math.inf for c, n in around)
        return (lx, ly, lz), (hx, hy, hz)

    def half_spaces(self) -> list[HalfSpace]:
        # rho cos <= z sin in every direction around the axis
        lean = -math.tan(self.half_angle)
        return [] if self.is_solid() else tangents(self.direction(), self.center, lean, 0.0)

    def extent(self) -> float:
        return farthest(self.center)

    def triangulated(self, low: Floats, high: Floats, frame: Floats) -> Triangles:
        # A grid of the level would lose the apex. The axis is z of the frame.
        apex = np.array(self.center) @ frame
        slope = math.tan(self.half_angle)
        widest = math.hypot(*np.maximum(np.abs(high - apex), np.abs(low - apex))[:2])
        top, bottom = min(float(high[2] - apex[2]), widest / slope), max(float(low[2] - apex[2]), 0.0)
        if not bottom < top:
            return np.empty((0, 3)), np.empty((0, 3), np.int64)
        around = np.linspace(0.0, 2.0 * math.pi, _ALONG, endpoint=False)
        along = np.linspace(bottom, top, _RINGS + 1)
        heights, angles = np.meshgrid(along, around, indexing="ij")
        own = np.stack([slope * heights * np.cos(angles), slope * heights * np.sin(angles), heights], axis=-1)
        a = np.arange(own.size // 3).reshape(heights.shape)
        b = np.roll(a, -1, axis=1)
        quadrilaterals = a[:-1], b[:-1], b[1:], a[1:]
        if bottom == 0.0:
            # All points of the first ring are the apex: one point stands for it, in one triangle of each pair.
            a[0] = b[0] = a[0, 0]
        triangles = halved(*quadrilaterals)
        kept = (triangles[:, 0] != triangles[:, 1]) & (triangles[:, 1] != triangles[:, 2])
        return (own.reshape(-1, 3) + apex) @ frame.T, triangles[kept]
