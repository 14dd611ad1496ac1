"""A unit vector that is the same everywhere on a wall; one along an axis costs no multiplication."""

from collections.abc import Sequence
from typing import NamedTuple

from ...kernel.jit import by_type


class Oblique(NamedTuple):
    """Any unit vector."""

    x: float
    y: float
    z: float


class AlongX(NamedTuple):
    """The x axis."""

    x: float


class AlongY(NamedTuple):
    """The y axis."""

    y: float


class AlongZ(NamedTuple):
    """The z axis."""

    z: float


Normal = Oblique | AlongX | AlongY | AlongZ


def normal_of(vector: Sequence[float]) -> Normal:
    """What kernels take for a unit vector, or for the opposite one where that is an axis."""
    x, y, z = vector
    if y == 0.0 and z == 0.0:
        return AlongX(1.0)
    if z == 0.0 and x == 0.0:
        return AlongY(1.0)
    if x == 0.0 and y == 0.0:
        return AlongZ(1.0)
    return Oblique(x, y, z)


@by_type
def along(normal, x, y, z):
    """n.(x, y, z)"""
    raise NotImplementedError


@by_type
def times(normal, k):
    """k n"""
    raise NotImplementedError


@along.register(Oblique)
def _(normal, x, y, z):
    return normal.x * x + normal.y * y + normal.z * z


@times.register(Oblique)
def _(normal, k):
    return k * normal.x, k * normal.y, k * normal.z


@along.register(AlongX)
def _(normal, x, y, z):
    return x


@times.register(AlongX)
def _(normal, k):
    return k, 0.0, 0.0


@along.register(AlongY)
def _(normal, x, y, z):
    return y


@times.register(AlongY)
def _(normal, k):
    return 0.0, k, 0.0


@along.register(AlongZ)
def _(normal, x, y, z):
    return z


@times.register(AlongZ)
def _(normal, k):
    return 0.0, 0.0, k
