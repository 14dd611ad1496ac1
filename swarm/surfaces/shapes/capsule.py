"""Capsule: phi = sqrt(q) - R, the distance; q, the inner function, is the squared distance to a segment along z."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common.checks import Vector
from ...common.validated import Length, NotNegative
from ...kernel.gravity import as_vector
from ...kernel.jit import select
from ...kernel.vector import Symmetric, Vec, dot, square, vec
from ..area_samples import AreaSample, Region, directions
from ..rotation import Direction
from ..surface import TILT, Box, box_around, farthest, side_sign
from ..time_of_impact.approach import Border, LevelBound
from ..time_of_impact.course import ball_rise_time
from .common import Distance
from .revolved import Revolved

# The last step of a fall leaves this part of R^2.
_CLOSE = 1e-16


@dataclass(frozen=True, repr=False)
class Capsule(Revolved):
    """All points within `radius` of a segment: a cylinder with half spheres as its ends.

    Args:
        radius: R [m].
        length: of the segment [m], from the middle of one half sphere to that of the other, 0 or more.
        axis: along the segment before it is rotated; three numbers, not all 0.
        center: the middle of the segment, three numbers [m].
        side: "inside" or "outside", the admissible part.

    Raises:
        SceneError: an argument is out of its range.

    >>> Capsule(radius=0.5, length=1.0).phi([[0.0], [0.0], [1.0]])
    array([0.])
    """

    nouns = ("capsule", "rod", "stadium", "rod")
    radius: Length
    length: NotNegative
    axis: Direction = (0.0, 0.0, 1.0)
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    is_convex = True

    def numbers(self) -> "CapsuleNumbers":
        radius, side = self.radius, side_sign(self.side)
        return CapsuleNumbers(vec(self.own_center()), radius, radius * radius, 0.5 * self.length, side)

    def largest_ball(self) -> float:
        return math.inf if self.is_solid() else self.radius

    def size(self) -> float:
        return self.radius

    def bounds(self) -> Box:
        rx, ry, rz = (self.radius + 0.5 * self.length * abs(part) for part in self.direction())
        return box_around(self.center, (rx, ry, rz), self.side)

    def extent(self) -> float:
        return farthest(self.center) + self.radius + 0.5 * self.length

    def enclosed(self, across: int | None) -> float | None:
        section = math.pi * self.radius**2
        if across is None:
            return section * (4.0 / 3.0 * self.radius + self.length)
        if self.is_upright(across):
            return section if abs(self.center[across]) < 0.5 * self.length or self.center[across] == 0.0 else None
        lies = abs(self.direction()[across]) <= TILT and self.center[across] == 0.0
        return section + 2.0 * self.radius * self.length if lies else None

    def area_samples(self, bounds: Region, across: int | None) -> list[AreaSample]:
        if across is not None:
            return super().area_samples(bounds, across)
        axis = np.array(self.direction())[:, None]
        center, radius, length = np.array(self.center)[:, None], self.radius, self.length
        first = np.cross(axis[:, 0], np.eye(3)[np.abs(axis[:, 0]).argmin()])
        first /= np.sqrt((first**2).sum())
        frame = np.array([first, np.cross(axis[:, 0], first), axis[:, 0]]).T

        def ends(random: Any, n: int) -> NDArray[np.float64]:
            out = directions(random, n)
            return np.asarray(center + radius * out + 0.5 * length * axis * np.sign((out * axis).sum(axis=0)))

        def around(random: Any, n: int) -> NDArray[np.float64]:
            angle, along_it = 2.0 * math.pi * random.random(n), length * (random.random(n) - 0.5)
            return np.asarray(center + frame @ np.array([radius * np.cos(angle), radius * np.sin(angle), along_it]))

        return [
            AreaSample(4.0 * math.pi * radius**2, ends), AreaSample(2.0 * math.pi * radius * length, around)
        ]  # fmt: skip


class CapsuleNumbers(Distance):
    """The numbers of a capsule about the z axis."""

    center: Vec
    radius: float
    radius2: float
    half: float  # of the length
    side: float

    def from_segment(self, r):
        """Return the vector to r from the nearest point of the segment."""
        d = r - self.center
        return Vec(d.x, d.y, d.z - np.minimum(np.maximum(d.z, -self.half), self.half))

    def inner(self, r):
        return square(self.from_segment(r))

    def inner_gradient(self, r):
        return 2.0 * self.from_segment(r)

    def hessian(self, r):
        return Symmetric(1.0, 1.0, select(abs(r.z - self.center.z) > self.half, 1.0, 0.0), 0.0, 0.0, 0.0)

    def difference(self, r0, r1):
        w0, w1 = self.from_segment(r0).z, self.from_segment(r1).z
        d, both = r1 - r0, r0 + r1 - 2.0 * self.center
        # Beyond the same end w1 - w0 = z1 - z0, without the rounding of either.
        rise = select(w0 * w1 > 0.0, d.z, w1 - w0)
        return d.x * both.x + d.y * both.y + rise * (w0 + w1)

    def first_hit(self, r, v):
        d, side, half = r - self.center, self.side, self.half
        tube = ball_rise_time(side, self.radius2, Vec(d.x, d.y, 0.0), Vec(v.x, v.y, 0.0))
        # The place where the flight meets the endless tube decides: it meets the solid there, or at the sphere of that
        # end. A flight towards a solid that begins inside this tube begins beyond an end.
        within = d.x * d.x + d.y * d.y < self.radius2
        height = d.z + select((side < 0.0) & within, 0.0, v.z * tube)
        from_end = Vec(d.x, d.y, d.z - select(height > 0.0, half, -half))
        cap = ball_rise_time(side, self.radius2, from_end, v)
        return select(abs(height) > half, cap, tube), True

    # Without gravity the hit has a closed form.
    in_steps = False

    def near(self, gravity, r, v):
        # Along a fall q is that of the sphere of an end or of the tube. Beyond the end q differs from either by the
        # square of the way beyond: it is higher than the tube's and lower than the sphere's.
        g, side, e = as_vector(gravity), self.side, self.from_segment(r)
        past = abs(r.z - self.center.z) - self.half
        in_tube, q = past <= 0.0, square(e)
        speed, pull = select(in_tube, 0.0, v.z), select(in_tube, 0.0, g.z)
        s2 = v.x * v.x + v.y * v.y + speed * speed + e.x * g.x + e.y * g.y + e.z * pull
        s3, s4 = v.x * g.x + v.y * g.y + speed * pull, 0.25 * (g.x * g.x + g.y * g.y + pull * pull)
        radius2 = self.near_radius2(q)
        size2 = select(q > radius2, q, radius2)
        return LevelBound(
            side * (q - radius2), side * dot(e, v), side * s2, (side * s3, side * s4),
            2.0 * math.sqrt(size2 / (square(v) + math.sqrt(size2 * square(g)))), _CLOSE * self.radius2,
            radius2 == self.radius2, Border(abs(v.z), 0.5 * abs(g.z), abs(past), (side > 0.0) == in_tube),
        )  # fmt: skip

    def hessian_bounds(self, r):
        # 0 <= H <= I everywhere; the distance only bounds the speed of a fall.
        return (select(self.side > 0.0, 1.0, 0.0), 1.0, self.radius)
