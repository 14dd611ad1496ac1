"""Constant gravity, or none: the exact free flight."""

from typing import NamedTuple

from .jit import by_type

Nothing = type(None)


class Gravity(NamedTuple):
    """Acceleration G [m/s^2]. A scene without gravity has None, which compiles to nothing."""

    x: float
    y: float
    z: float


@by_type
def displacement(gravity, vx, vy, vz, t):
    """v t + G t^2/2"""
    raise NotImplementedError


@displacement.register(Gravity)
def _(gravity, vx, vy, vz, t):
    half = 0.5 * t
    return (vx + half * gravity.x) * t, (vy + half * gravity.y) * t, (vz + half * gravity.z) * t


@displacement.register(Nothing)
def _(gravity, vx, vy, vz, t):
    return vx * t, vy * t, vz * t


@by_type
def accelerated(gravity, vx, vy, vz, t):
    """v + G t"""
    raise NotImplementedError


@accelerated.register(Gravity)
def _(gravity, vx, vy, vz, t):
    return vx + gravity.x * t, vy + gravity.y * t, vz + gravity.z * t


@accelerated.register(Nothing)
def _(gravity, vx, vy, vz, t):
    return vx, vy, vz


@by_type
def potential(gravity, x, y, z):
    """Potential energy per mass, -G.r"""
    raise NotImplementedError


@potential.register(Gravity)
def _(gravity, x, y, z):
    return -(gravity.x * x + gravity.y * y + gravity.z * z)


@potential.register(Nothing)
def _(gravity, x, y, z):
    return 0.0


@by_type
def weight(gravity, sx, sy, sz):
    """How far the potential energy per mass moves at most when the coordinates move by (sx, sy, sz)."""
    raise NotImplementedError


@weight.register(Gravity)
def _(gravity, sx, sy, sz):
    return abs(gravity.x) * sx + abs(gravity.y) * sy + abs(gravity.z) * sz


@weight.register(Nothing)
def _(gravity, sx, sy, sz):
    return 0.0
