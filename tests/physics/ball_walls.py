"""Distances of balls from walls, written anew for numbers of any kind: floats, or those of mpmath."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from swarm.motion.given import parts_of


class Wall(NamedTuple):
    """A wall at rest by what is written of it here, and how it moves."""

    distance: Callable[[Any], Any]  # of a point (3,) on the admissible side, above 0
    normal: Callable[[Any], Any]  # the unit normal there, into the wall
    parts: tuple[Any, ...]
    e: float


class Walls:
    """The walls of surfaces.

    Args:
        number: makes a number of what is given.
        module: of their functions.
        epsilon: their round-off.
        period: of the scene.
    """

    def __init__(self, number, module, epsilon, period):
        self.number, self.module, self.epsilon, self.period = number, module, epsilon, period

    def of(self, one):
        """The walls of a surface: distances from its outside, of points on the admissible side."""
        parts, e = parts_of(one.motion), one.restitution
        kind, side = type(one).__name__, getattr(one, "side", "inside")
        makers = {
            "Plane": self._plane, "Slab": self._slab, "Box": self._box, "Sphere": self._sphere,
            "Cylinder": self._cylinder, "Capsule": self._capsule, "Torus": self._torus, "Cone": self._cone,
            "Ellipsoid": self._ellipsoid,
        }  # fmt: skip
        return [Wall(distance, normal, parts, e) for distance, normal in makers[kind](one, side)]

    def _vector(self, given):
        return np.array([self.number(x) for x in given])

    def _unit(self, given):
        v = self._vector(given)
        return v / self._length(v)

    def _near(self, center):
        """A function from points to the arm from the nearest image of a center."""
        c = self._vector(center)
        if self.period is None:
            return lambda r: r - c

        def arm(r):
            d = r - c
            shift = [0 if one is None else round(float(d[k] / one)) * self.number(one)
                     for k, one in enumerate(self.period)]  # fmt: skip
            return d - np.array(shift)

        return arm

    def _plane(self, one, _side):
        n = self._unit(one.normal)
        far = self.number(one.offset)
        return [(lambda r: far - n @ r, lambda r: n)]

    def _slab(self, one, side):
        return self._faces(self._unit(one.normal), self.number(one.half_width), self._vector(one.center), side)

    def _faces(self, n, half, c, side):
        if side == "inside":
            return [(lambda r: half - n @ (r - c), lambda r: n), (lambda r: half + n @ (r - c), lambda r: -n)]
        return [(lambda r: abs(n @ (r - c)) - half, lambda r: -n if n @ (r - c) > 0 else n)]

    def _box(self, one, side):
        turn = self._turn(one.rotation)
        h, c = self._vector(one.half_widths), self._vector(one.center)
        if side == "inside":
            return [face for k in range(3) for face in self._faces(turn[:, k], h[k], c, "inside")]

        def beyond(r):
            x = turn.T @ (r - c)
            return np.array([max(abs(x[k]) - h[k], 0 * x[k]) * (1 if x[k] > 0 else -1) for k in range(3)])

        def distance(r):
            d = beyond(r)
            far = self._length(d)
            x = turn.T @ (r - c)
            return far if far > 0 else max(abs(x[k]) - h[k] for k in range(3))

        def normal(r):
            d = beyond(r)
            far = self._length(d)
            return -(turn @ (d / far)) if far > 0 else self._vector((1.0, 0.0, 0.0))

        return [(distance, normal)]

    def _turn(self, quaternion):
        if quaternion is None:
            return np.array([[self.number(float(i == j)) for j in range(3)] for i in range(3)])
        w, x, y, z = (self.number(one) for one in quaternion)
        far = self.module.sqrt(w * w + x * x + y * y + z * z)
        w, x, y, z = w / far, x / far, y / far, z / far
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )

    def _round(self, offset, radius, side):
        """The wall at a distance from a core: `offset` goes from its nearest point to a point."""
        sign = 1 if side == "inside" else -1

        def normal(r):
            d = offset(r)
            far = self._length(d)
            return sign * d / far if far > 0 else self._vector((1.0, 0.0, 0.0))

        return [(lambda r: sign * (radius - self._length(offset(r))), normal)]

    def _sphere(self, one, side):
        return self._round(self._near(one.center), self.number(one.radius), side)

    def _cylinder(self, one, side):
        k, c, radius = self._unit(one.axis), self._vector(one.center), self.number(one.radius)
        near = self._near(one.center)
        across = self._round(lambda r: near(r) - (k @ near(r)) * k, radius, side)
        if one.length is None:
            return across
        half = self.number(one.length) / 2
        if side == "inside":
            return [*across, *self._faces(k, half, c, "inside")]

        def beyond(r):
            up = k @ (r - c)
            out = r - c - up * k
            far = self._length(out)
            d = max(abs(up) - half, 0 * up) * (1 if up > 0 else -1) * k
            return d + (max(far - radius, 0 * far) / far * out if far > 0 else 0 * out)

        def distance(r):
            far = self._length(beyond(r))
            up = k @ (r - c)
            return far if far > 0 else max(abs(up) - half, self._length(r - c - up * k) - radius)

        def normal(r):
            d = beyond(r)
            far = self._length(d)
            return -d / far if far > 0 else k

        return [(distance, normal)]

    def _capsule(self, one, side):
        k, c, half = self._unit(one.axis), self._vector(one.center), self.number(one.length) / 2

        def offset(r):
            up = k @ (r - c)
            return r - c - max(min(up, half), -half) * k

        return self._round(offset, self.number(one.radius), side)

    def _torus(self, one, side):
        k, c = self._unit(getattr(one, "axis", (0.0, 0.0, 1.0))), self._vector(one.center)
        ring = self.number(one.major_radius)

        def offset(r):
            up = k @ (r - c)
            out = r - c - up * k
            far = self._length(out)
            return r - c - ring * out / far if far > 0 else r - c

        return self._round(offset, self.number(one.minor_radius), side)

    def _cone(self, one, _side):
        k, c = self._unit(one.axis), self._vector(one.center)
        s, q = self.module.sin(self.number(one.half_angle)), self.module.cos(self.number(one.half_angle))

        def out(r):
            d = r - c - (k @ (r - c)) * k
            far = self._length(d)
            return d / far if far > 0 else d

        return [
            (
                lambda r: (k @ (r - c)) * s - self._length(r - c - (k @ (r - c)) * k) * q,
                lambda r: out(r) * q - k * s,
            )
        ]

    def _ellipsoid(self, one, side):
        """By the foot of the normal, of points that are nearer to the wall than its smallest radius of curvature."""
        turn, c, a = self._turn(one.rotation), self._vector(one.center), self._vector(one.semi_axes)

        last = [None, None]

        def foot(x):
            """The root t of sum (a x/(a^2 + t))^2 = 1, above -min(a)^2: its foot is a^2 x/(a^2 + t).

            The distance and the normal of a point are asked for one after the other.
            """
            if last[0] is None or (last[0] != x).any():
                last[:] = x, found(x)
            return last[1]

        def found(x):
            low = -min(one * one for one in a)
            high = self._length(x) * max(a) + 1
            t = 0 * x[0]
            for _step in range(400):
                d = a * x / (a * a + t)
                f, slope = d @ d - 1, -2 * (d * d) @ (1 / (a * a + t))
                if f > 0:
                    low = t
                else:
                    high = t
                new = t - f / slope if slope != 0 else (low + high) / 2
                if not low < new < high:
                    new = (low + high) / 2
                if abs(new - t) <= 4 * self.epsilon * abs(a * a + new).max():
                    return new
                t = new
            return t

        def distance(r):
            x = turn.T @ (r - c)
            t = foot(x)
            far = self._length(t * x / (a * a + t))
            return (far if t < 0 else -far) * (1 if side == "inside" else -1)

        def normal(r):
            x = turn.T @ (r - c)
            y = a * a * x / (a * a + foot(x))
            n = turn @ (y / (a * a))
            return n / self._length(n) * (1 if side == "inside" else -1)

        return [(distance, normal)]

    def _length(self, v):
        return self.module.sqrt(v @ v)
