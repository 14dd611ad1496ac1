"""The walls that hold a particle, one or the edge of two: what they take of its velocity, and how they press on it."""

import math
from typing import NamedTuple

from ..kernel.jit import by_type, inlined, select
from ..kernel.vector import ZERO, Vec, cross, dot, square
from ..surfaces import fold as walls

_TINY = 2.2250738585072014e-308


class One(NamedTuple):
    """A particle that slides along one wall."""

    first: float


class Two(NamedTuple):
    """A particle that slides along the edge of two walls."""

    first: float
    second: float


class Held(NamedTuple):
    """A vector as a part that the walls allow and multiples of their normals: P + b n + c m."""

    along: Vec
    n: Vec
    b: float
    m: Vec
    c: float


# --- Which walls -----------------------------------------------------------------------------------------


@by_type
def of_lane(kind, first, second):
    """The walls that hold a lane, of this kind."""
    return One(first)


@of_lane.register(Two)
def _(kind, first, second):
    return Two(first, second)


@by_type
def is_held_by(held, wall):
    """Whether a wall is among those."""
    return wall == held.first


@is_held_by.register(Two)
def _(held, wall):
    return (wall == held.first) | (wall == held.second)


@by_type
def second(held):
    """The second wall, -1 where there is none."""
    return -1.0


@second.register(Two)
def _(held):
    return held.second


# --- What they take of a vector --------------------------------------------------------------------------


@by_type
def split(held, chain, r0, r1, w):
    """`Held` of a vector, with the normals of a step from r0 to r1."""
    n = walls.step_normal(chain, held.first, r0, r1)
    b = dot(w, n)
    return Held(w - b * n, n, b, ZERO, 0.0)


@split.register(Two)
def _(held, chain, r0, r1, w):
    n, m = walls.step_normal(chain, held.first, r0, r1), walls.step_normal(chain, held.second, r0, r1)
    return _on_edge(n, m, w)


@by_type
def along(held, chain, r0, r1, w):
    """The part P of it alone, which needs no lengths of normals."""
    return split(held, chain, r0, r1, w).along


@along.register(One)
def _(held, chain, r0, r1, w):
    g = walls.inner_gradient(chain, held.first, r0, r1)
    return w - (dot(w, g) / square(g)) * g


@by_type
def split_at(held, chain, r, w):
    """`Held` of a vector at a point."""
    n = walls.unit_normal(chain, held.first, r)
    b = dot(w, n)
    return Held(w - b * n, n, b, ZERO, 0.0)


@split_at.register(Two)
def _(held, chain, r, w):
    return _on_edge(walls.unit_normal(chain, held.first, r), walls.unit_normal(chain, held.second, r), w)


@inlined
def edge(n, m):
    """n x m, to round-off of its length also where the walls are nearly parallel: n x (m -+ n)."""
    return cross(n, m - select(dot(n, m) < 0.0, -1.0, 1.0) * n)


@inlined
def _on_edge(n, m, w):
    # b + cos c = w.n and cos b + c = w.m, where sin^2 = |n x m|^2
    e, cosine, wn, wm = edge(n, m), dot(n, m), dot(w, n), dot(w, m)
    sine2 = square(e)
    inverse = 1.0 / select(sine2 > _TINY, sine2, _TINY)
    return Held((dot(w, e) * inverse) * e, n, (wn - cosine * wm) * inverse, m, (wm - cosine * wn) * inverse)


@by_type
def inward(held, n, m):
    """The unit vector away from the walls."""
    return -1.0 * n


@inward.register(Two)
def _(held, n, m):
    k = n + m
    return k * (-1.0 / math.sqrt(square(k)))


@by_type
def settle(held, chain, r):
    """A point within round-off of the walls, moved onto them."""
    return walls.settle(chain, held.first, r)


@settle.register(Two)
def _(held, chain, r):
    return walls.settle(chain, held.first, walls.settle(chain, held.second, r))


# --- How they press --------------------------------------------------------------------------------------


@by_type
def presses(held, chain, r, v, pull):
    """How the walls press on a particle that slides with this velocity, per mass: (first, second)."""
    return walls.outward_acceleration(chain, held.first, r, v, pull), 0.0


@presses.register(Two)
def _(held, chain, r, v, pull):
    one = walls.outward_acceleration(chain, held.first, r, v, pull)
    other = walls.outward_acceleration(chain, held.second, r, v, pull)
    n, m = walls.unit_normal(chain, held.first, r), walls.unit_normal(chain, held.second, r)
    cosine, sine2 = dot(n, m), square(edge(n, m))
    inverse = 1.0 / select(sine2 > _TINY, sine2, _TINY)
    return (one - cosine * other) * inverse, (other - cosine * one) * inverse


@by_type
def lets_go(held, n, m):
    """Whether a wall no longer presses."""
    return n < 0.0


@lets_go.register(Two)
def _(held, n, m):
    return (n < 0.0) | (m < 0.0)
