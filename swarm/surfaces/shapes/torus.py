"""Torus: phi = sqrt(q) - a, the distance; inner function q = (rho - R)^2 + z^2, not a quadric."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...common.checks import Vector
from ...common.validated import Length
from ...errors import SceneError
from ...kernel.gravity import as_vector
from ...kernel.jit import select
from ...kernel.limits import TINY
from ...kernel.vector import Symmetric, Vec, dot, square, vec
from ...state import Floats
from ..area_samples import AreaSample, Region
from ..parametrised import Triangles, halved
from ..rotation import matrix, turned
from ..surface import TILT, Box, Surface, box_around, farthest, is_along, is_on_axis, rotated_box, side_sign
from ..time_of_impact.approach import LevelBound
from .common import Distance

# The points around the tube and along it, of its triangles
_AROUND, _ALONG = 32, 96
# The last step leaves this part of 4 R^2 a^2, the value of F in the middle of the tube.
_CLOSE = 4e-16
# A flight from farther than the root of this many times the size of the ball around it first goes to a wider ball.
_AFAR = 1024.0
# Squared radii, in those of the ball around the torus: beyond the first a flight goes to the second before the torus.
_OUTER, _NEARER = 1.3, 1.1


@dataclass(frozen=True, repr=False)
class Torus(Surface):
    """A ring torus about its own z axis; the cavity in the tube or the space around the solid.

    Args:
        major_radius: R [m], from the axis to the middle of the tube.
        minor_radius: a [m], of the tube, 0 < a < R.
        center: three numbers [m].
        side: "inside" or "outside", the admissible part.

    Raises:
        SceneError: an argument is out of its range.

    >>> Torus(major_radius=1.0, minor_radius=0.25).phi([[1.25], [0.0], [0.0]])
    array([0.])
    """

    nouns = ("torus", "ring", "torus", "ring")
    major_radius: Length
    minor_radius: Length
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.minor_radius >= self.major_radius:
            raise SceneError(
                f"minor_radius must be below major_radius = {self.major_radius:g}, got {self.minor_radius:g}"
            )

    def numbers(self) -> "TorusNumbers":
        minor, side = self.minor_radius, side_sign(self.side)
        return TorusNumbers(vec(self.own_center()), self.major_radius, minor, minor * minor, side)

    def largest_ball(self) -> float:
        return math.inf if self.is_solid() else self.minor_radius

    def size(self) -> float:
        return self.minor_radius

    def bounds(self) -> Box:
        wide = self.major_radius + self.minor_radius
        box = box_around(self.center, (wide, wide, self.minor_radius), self.side)
        return rotated_box(self.rotation, box, self.center)

    def is_unturned_by(self, axis: Vector, center: Vector) -> bool:
        return is_along(turned(self.rotation, (0.0, 0.0, 1.0)), axis) and is_on_axis(self.center, axis, center)

    def extent(self) -> float:
        return farthest(self.center) + self.major_radius + self.minor_radius

    def enclosed(self, across: int | None) -> float | None:
        section = math.pi * self.minor_radius**2
        if across is None:
            return 2.0 * math.pi * self.major_radius * section
        upright = abs(turned(self.rotation, (0.0, 0.0, 1.0))[across])
        if self.center[across] != 0.0 or TILT < upright < 1.0 - TILT:
            return None
        # Across its axis a ring, otherwise two discs
        return 4.0 * math.pi * self.major_radius * self.minor_radius if upright > TILT else 2.0 * section

    def area_samples(self, bounds: Region, across: int | None) -> list[AreaSample]:
        if across is not None:
            return super().area_samples(bounds, across)
        return [AreaSample(4.0 * math.pi**2 * self.major_radius * self.minor_radius, self._points)]

    def _points(self, random: Any, n: int) -> Floats:
        """Return points that are uniform in the section's area: it has less area near the axis."""
        large, small = self.major_radius, self.minor_radius
        tube = np.empty(0)
        while len(tube) < n:
            trial = 2.0 * math.pi * random.random(2 * n + 16)
            tube = np.append(tube, trial[random.random(len(trial)) * (large + small) < large + small * np.cos(trial)])
        tube, around = tube[:n], 2.0 * math.pi * random.random(n)
        rho = large + small * np.cos(tube)
        points = np.array([rho * np.cos(around), rho * np.sin(around), small * np.sin(tube)])
        turn = matrix(self.rotation)
        return np.asarray(np.array(self.center)[:, None] + turn @ points)

    def triangulated(self, low: Floats, high: Floats, frame: Floats) -> Triangles:
        # A grid of points would lose a thin tube between them.
        u, v = (np.linspace(0.0, 2.0 * math.pi, count, endpoint=False) for count in (_ALONG, _AROUND))
        along, around = np.meshgrid(u, v, indexing="ij")
        rho = self.major_radius + self.minor_radius * np.cos(around)
        own = np.stack([rho * np.cos(along), rho * np.sin(along), self.minor_radius * np.sin(around)], axis=-1)
        points = own.reshape(-1, 3) @ matrix(self.rotation).T + np.array(self.center)
        place = np.arange(_ALONG * _AROUND).reshape(_ALONG, _AROUND)
        a, b = place, np.roll(place, -1, axis=0)
        return points, halved(a, b, np.roll(b, -1, axis=1), np.roll(place, -1, axis=1))


class TorusNumbers(Distance):
    """The numbers of a torus about the z axis."""

    center: Vec
    major: float
    radius: float  # of the tube
    radius2: float
    side: float

    def inner(self, r):
        across, dz = self._from_axis(r) - self.major, r.z - self.center.z
        return across * across + dz * dz

    def inner_gradient(self, r):
        d, f = r - self.center, 2.0 - 2.0 * self.major / self._from_axis(r)
        return Vec(f * d.x, f * d.y, 2.0 * d.z)

    def hessian(self, r):
        # 1 across the tube, 1 - R/rho along it: I - (R/rho) e e^T
        d, rho = r - self.center, self._from_axis(r)
        ex, ey, f = -d.y / rho, d.x / rho, self.major / rho
        return Symmetric(1.0 - f * ex * ex, 1.0 - f * ey * ey, 1.0, -f * ex * ey, 0.0, 0.0)

    def difference(self, r0, r1):
        rho0, rho1 = self._from_axis(r0), self._from_axis(r1)
        d, both = r1 - r0, r0 + r1 - 2.0 * self.center
        across = d.x * both.x + d.y * both.y
        return across * (1.0 - 2.0 * self.major / (rho0 + rho1)) + d.z * both.z

    # F = (|d|^2 + R^2 - a^2)^2 - 4 R^2 rho^2 = (q - a^2) (q - a^2 + 4 R rho) has the sign of the gap. Along a flight it
    # has degree 4, or 8 in a fall. F, F'/2 and F''/2 are written without terms that cancel on the wall.

    def near(self, gravity, r, v):
        return self._near(r, v) if gravity is None else self._near_of_fall(as_vector(gravity), r, v)

    def hessian_bounds(self, r):
        # At most half the way to the axis, where 1 - R/rho is largest
        rho = self._from_axis(r)
        along = 2.0 * self.major / rho
        return select(self.side > 0.0, 1.0, along - 1.0), 1.0 + along, 0.5 * rho

    def passed(self, r, v):
        d, wide = r - self.center, self.major + self.radius
        return (self.side < 0.0) & (dot(d, v) >= 0.0) & (square(d) > wide * wide)

    def farthest_push(self):
        # The first pole of I + kappa H: along the inner equator of a cavity, across the tube of a solid.
        return select(self.side > 0.0, self.major / self.radius - 1.0, -1.0)

    def _from_axis(self, r):
        """Return rho, never 0: on the axis the direction to the tube is not defined."""
        d = r - self.center
        return np.maximum(np.sqrt(d.x * d.x + d.y * d.y), TINY)

    def _nearly(self):
        return _CLOSE * self.major * self.major * self.radius2

    def _near(self, r, v):
        d, major, side = r - self.center, self.major, self.side
        rho = self._from_axis(r)
        across = rho - major
        q, d2 = across * across + d.z * d.z, square(d)
        tube2 = self.near_radius2(q)
        level, bp, wp, wz = q - tube2, d.x * v.x + d.y * v.y, v.x * v.x + v.y * v.y, v.z * v.z
        b, w = bp + d.z * v.z, wp + wz
        # |d|^2 + R^2 - a^2 and its powers: level + 2 R rho, 2 b, w
        f0 = level * (level + 4.0 * major * rho)
        f1 = 2.0 * (level * b + 2.0 * major * (across * bp + rho * d.z * v.z))
        f2 = 4.0 * b * b + 2.0 * level * w + 4.0 * major * (across * wp + rho * wz)
        far, ball2 = self._ball(d2)
        size2 = major * self.radius + q
        window = 2.0 * math.sqrt(size2 / w)
        return LevelBound(
            select(far, ball2 - d2, side * f0), select(far, -b, side * f1), select(far, -w, side * f2),
            (select(far, 0.0, side * 4.0 * b * w), select(far, 0.0, side * w * w)),
            select(far, math.inf, window), self._nearly(), (not far) & (tube2 == self.radius2),
        )  # fmt: skip

    def _near_of_fall(self, g, r, v):
        d, major, side = r - self.center, self.major, self.side
        rho = self._from_axis(r)
        across = rho - major
        q, d2 = across * across + d.z * d.z, square(d)
        tube2 = self.near_radius2(q)
        # |d + v t + G t^2/2|^2 by powers of t, and the same for the components across the axis
        bp, p2 = d.x * v.x + d.y * v.y, v.x * v.x + v.y * v.y + d.x * g.x + d.y * g.y
        bz, z2 = d.z * v.z, v.z * v.z + d.z * g.z
        b, s2 = bp + bz, p2 + z2
        p3, p4 = v.x * g.x + v.y * g.y, 0.25 * (g.x * g.x + g.y * g.y)
        s3, s4 = p3 + v.z * g.z, p4 + 0.25 * g.z * g.z
        level, four = q - tube2, 4.0 * major * major
        s0 = level + 2.0 * major * rho
        f0 = level * (level + 4.0 * major * rho)
        f1 = 2.0 * (level * b + 2.0 * major * (across * bp + rho * bz))
        f2 = 4.0 * b * b + 2.0 * level * s2 + 4.0 * major * (across * p2 + rho * z2)
        f3 = 2.0 * (s0 * s3 + 2.0 * b * s2) - four * p3
        f4 = 2.0 * (s0 * s4 + 2.0 * b * s3) + s2 * s2 - four * p4
        far, ball2 = self._ball(d2)
        size2 = major * self.radius + q
        window = 2.0 * math.sqrt(size2 / (square(v) + math.sqrt(size2 * 4.0 * s4)))
        return LevelBound(
            select(far, ball2 - d2, side * f0), select(far, -b, side * f1), select(far, -s2, side * f2),
            (
                select(far, -s3, side * f3), select(far, -s4, side * f4),
                select(far, 0.0, side * 2.0 * (2.0 * b * s4 + s2 * s3)),
                select(far, 0.0, side * (2.0 * s2 * s4 + s3 * s3)),
                select(far, 0.0, side * 2.0 * s3 * s4), select(far, 0.0, side * s4 * s4),
            ),
            window, self._nearly(), (not far) & (tube2 == self.radius2),
        )  # fmt: skip

    def _ball(self, d2):
        """Return whether a point is far from a solid, and the square radius of a ball around it to go to first.

        To this ball the level is a quartic, or a parabola. A cavity has none: its outside is not admissible, though
        soft walls let a particle be there.
        """
        wide2 = self.major + self.radius
        wide2 = wide2 * wide2
        ball2 = select(d2 > _AFAR * wide2, d2 * (1.0 / _AFAR), _NEARER * wide2)
        return (self.side < 0.0) & (d2 > _OUTER * wide2), ball2
