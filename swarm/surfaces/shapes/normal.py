"""A unit vector that is the same everywhere on a wall; one along an axis costs no multiplication."""

from collections.abc import Sequence
from typing import NamedTuple

from ...kernel.jit import by_type
from ...kernel.vector import Vec, dot, vec


class AlongX(NamedTuple):
    """The x axis."""

    x: float


class AlongY(NamedTuple):
    """The y axis."""

    y: float


class AlongZ(NamedTuple):
    """The z axis."""

    z: float


Normal = Vec | AlongX | AlongY | AlongZ


def normal_of(vector: Sequence[float]) -> Normal:
    """What kernels take for a unit vector, or for the opposite one where that is an axis."""
    x, y, z = vector
    if y == 0.0 and z == 0.0:
        return AlongX(1.0)
    if z == 0.0 and x == 0.0:
        return AlongY(1.0)
    if x == 0.0 and y == 0.0:
        return AlongZ(1.0)
    return vec(vector)


@by_type
def along(normal, r):
    """n.r"""
    raise NotImplementedError


@by_type
def scaled(normal, k):
    """k n"""
    raise NotImplementedError


@along.register(Vec)
def _(normal, r):
    return dot(normal, r)


@scaled.register(Vec)
def _(normal, k):
    return k * normal


@along.register(AlongX)
def _(normal, r):
    return r.x


@scaled.register(AlongX)
def _(normal, k):
    return Vec(k, 0.0, 0.0)


@along.register(AlongY)
def _(normal, r):
    return r.y


@scaled.register(AlongY)
def _(normal, k):
    return Vec(0.0, k, 0.0)


@along.register(AlongZ)
def _(normal, r):
    return r.z


@scaled.register(AlongZ)
def _(normal, k):
    return Vec(0.0, 0.0, k)
