"""The walls that hold a particle, one or the edge of two: what they take of its velocity, and how they press on it."""

import math
from typing import NamedTuple

from ..kernel.jit import by_type, inlined, select
from ..kernel.vector import ZERO, Vec, cross, dot, square
from ..surfaces import fold as walls
from .laws import Moves

_TINY = 2.2250738585072014e-308


class One(NamedTuple):
    """A particle that slides along one wall."""

    first: float


class Two(NamedTuple):
    """A particle that slides along the edge of two walls."""

    first: float
    second: float


class Three(NamedTuple):
    """A particle in the corner of three walls."""

    first: float
    second: float
    third: float


class Held(NamedTuple):
    """A vector as a part that the walls allow and multiples of their normals: P + b n + c m."""

    along: Vec
    n: Vec
    b: float
    m: Vec
    c: float


class Drift(NamedTuple):
    """How fast the walls that hold a particle move."""

    first: Vec
    second: Vec


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


@is_held_by.register(Three)
def _(held, wall):
    return (wall == held.first) | (wall == held.second) | (wall == held.third)


@by_type
def second(held):
    """The second wall, -1 where there is none."""
    return -1.0


@second.register(Two)
def _(held):
    return held.second


# --- How they move: None where no wall of the scene does -------------------------------------------------


@by_type
def drift(moving, held, chain, r):
    """How fast they are at a point."""
    return


@drift.register(Moves)
def _(moving, held, chain, r):
    return Drift(walls.velocity(chain, held.first, r), walls.velocity(chain, max(second(held), 0.0), r))


@by_type
def mean_drift(moving, held, chain, r0, r1, h):
    """How fast they are in the mean of a step from r0 to r1 of length h."""
    return


@mean_drift.register(Moves)
def _(moving, held, chain, r0, r1, h):
    other = max(second(held), 0.0)
    return Drift(walls.mean_velocity(chain, held.first, r0, r1, h), walls.mean_velocity(chain, other, r0, r1, h))


@by_type
def towards(drift, w, n):
    """The speed of a particle into the first wall, whose normal is n."""
    return dot(w, n)


@by_type
def towards_second(drift, w, n):
    """The same of the second wall."""
    return dot(w, n)


towards.register(Drift, lambda drift, w, n: dot(w - drift.first, n))
towards_second.register(Drift, lambda drift, w, n: dot(w - drift.second, n))


@by_type
def given_by_second(drift, taken):
    """Twice the work per mass of the second wall in a step that takes so much of w0."""
    return 0.0


# w1 - w0 = -2 (b n + c m), whose work is that times the velocity of the wall.
given_by_second.register(Drift, lambda drift, taken: -4.0 * taken.c * dot(drift.second, taken.m))


# --- What they take of a velocity ------------------------------------------------------------------------


@by_type
def split(held, chain, drift, r0, r1, w):
    """`Held` of a velocity, with the normals of a step from r0 to r1."""
    n = walls.step_normal(chain, held.first, r0, r1)
    b = towards(drift, w, n)
    return Held(w - b * n, n, b, ZERO, 0.0)


@split.register(Two)
def _(held, chain, drift, r0, r1, w):
    n, m = walls.step_normal(chain, held.first, r0, r1), walls.step_normal(chain, held.second, r0, r1)
    return _on_edge(drift, n, m, w)


@by_type
def along(held, chain, drift, r0, r1, w):
    """The part P of it alone, which needs no lengths of normals."""
    return split(held, chain, drift, r0, r1, w).along


@along.register(One)
def _(held, chain, drift, r0, r1, w):
    g = walls.inner_gradient(chain, held.first, r0, r1)
    return w - (towards(drift, w, g) / square(g)) * g


@by_type
def split_at(held, chain, drift, r, w):
    """`Held` of a velocity at a point."""
    n = walls.unit_normal(chain, held.first, r)
    b = towards(drift, w, n)
    return Held(w - b * n, n, b, ZERO, 0.0)


@split_at.register(Two)
def _(held, chain, drift, r, w):
    return _on_edge(drift, walls.unit_normal(chain, held.first, r), walls.unit_normal(chain, held.second, r), w)


@inlined
def edge(n, m):
    """n x m, to round-off of its length also where the walls are nearly parallel: n x (m -+ n)."""
    return cross(n, m - select(dot(n, m) < 0.0, -1.0, 1.0) * n)


@inlined
def _on_edge(drift, n, m, w):
    # b + cos c = w.n and cos b + c = w.m, where sin^2 = |n x m|^2
    e, cosine, wn, wm = edge(n, m), dot(n, m), towards(drift, w, n), towards_second(drift, w, m)
    sine2 = square(e)
    inverse = 1.0 / select(sine2 > _TINY, sine2, _TINY)
    b, c = (wn - cosine * wm) * inverse, (wm - cosine * wn) * inverse
    return Held(_allowed(drift, (dot(w, e) * inverse) * e, w - b * n - c * m), n, b, m, c)


@by_type
def _allowed(drift, on_edge, rest):
    """What is left of a velocity: along the edge, where the walls are at rest."""
    return on_edge


_allowed.register(Drift, lambda drift, on_edge, rest: rest)


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
