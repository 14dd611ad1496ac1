"""A triangle that balls meet, from both sides: with round edges and corners."""

import math

import numpy as np

from ...kernel.arrays import aligned_copy
from ...kernel.jit import select
from ...kernel.vector import Vec, cross, dot, either, norm, square
from ...state import Floats
from ..fields.many import field_of
from ..fields.members import Members
from .rounded import Rounded, part_within

# A flight through the edge between two triangles passes one of them: each is larger by this part for this test.
_SEAM = 1e-9


class RoundTriangle(Rounded):
    """A triangle of a mesh, grown by the radius of the balls."""

    corner: Vec
    first: Vec  # from there to the other corners
    second: Vec
    radius: float

    def foot(self, r):
        d, a, b = r - self.corner, self.first, self.second
        n, third = cross(a, b), b - a
        n2 = square(n)
        # Between its edges, as seen along the normal
        u, v = dot(cross(d, b), n), dot(cross(a, d), n)
        within = (n2 > 0.0) & (u >= 0.0) & (v >= 0.0) & (u + v <= n2)
        across = (dot(d, n) / select(n2 > 0.0, n2, 1.0)) * n
        far = d - a
        one, two = d - part_within(d, a) * a, d - part_within(d, b) * b
        other = far - part_within(far, third) * third
        edge = either(square(one) <= square(two), one, two)
        edge = either(square(edge) <= square(other), edge, other)
        e = either(within, across, edge)
        away = norm(e)
        # On the triangle itself both sides are equally near.
        there = away > 0.0
        return away, either(there, e, n) * (1.0 / select(there, away, select(n2 > 0.0, math.sqrt(n2), 1.0)))

    def passed_by(self, r, move):
        """Return how far a move that leads through the triangle ends behind its plane [m], or -1 for any other move."""
        d, a, b = r - self.corner, self.first, self.second
        n = cross(a, b)
        n2 = square(n)
        before, after = dot(d, n), dot(d + move, n)
        changes = ((before > 0.0) & (after <= 0.0)) | ((before <= 0.0) & (after > 0.0))
        p = d + (before / select(changes, before - after, 1.0)) * move
        u, v = dot(cross(p, b), n), dot(cross(a, p), n)
        within = (u >= -_SEAM * n2) & (v >= -_SEAM * n2) & (n2 - u - v >= -_SEAM * n2)
        return select(changes & within, abs(after) / select(n2 > 0.0, math.sqrt(n2), 1.0), -1.0)


def triangles_of_balls(corners: Floats, largest: float) -> Members:
    """Return the triangles with corners (T, 3, 3) as balls meet them, with radii of at most the largest one [m]."""
    a, b, c = np.moveaxis(corners, 1, 0)
    table = aligned_copy(np.concatenate([a, b - a, c - a, np.zeros((len(a), 1))], axis=1))
    zero = Vec(0.0, 0.0, 0.0)
    low, high = (np.ascontiguousarray(end(corners, axis=1).T) for end in (np.min, np.max))
    return field_of(RoundTriangle(zero, zero, zero, 0.0), table, lambda: (low, high), None, largest)
