"""Constant gravity, or none: the exact free flight."""

from .jit import by_type
from .vector import Vec, absolute, dot

Nothing = type(None)


class Gravity(Vec):
    """Acceleration G [m/s^2]. A scene without gravity has None, which compiles to nothing."""


@by_type
def as_vector(gravity):
    """G as a vector like any other."""
    return Vec(gravity.x, gravity.y, gravity.z)


@by_type
def displacement(gravity, v, t):
    """v t + G t^2/2"""
    raise NotImplementedError


@displacement.register(Gravity)
def _(gravity, v, t):
    half = 0.5 * t
    return (v + half * gravity) * t


@displacement.register(Nothing)
def _(gravity, v, t):
    return v * t


@by_type
def accelerated(gravity, v, t):
    """v + G t"""
    raise NotImplementedError


@accelerated.register(Gravity)
def _(gravity, v, t):
    return v + gravity * t


@accelerated.register(Nothing)
def _(gravity, v, t):
    return v


@by_type
def potential(gravity, r):
    """Potential energy per mass, -G.r"""
    raise NotImplementedError


@potential.register(Gravity)
def _(gravity, r):
    return -dot(gravity, r)


@potential.register(Nothing)
def _(gravity, r):
    return 0.0


@by_type
def weight(gravity, s):
    """The largest change of the potential energy per mass when the coordinates change by s."""
    raise NotImplementedError


@weight.register(Gravity)
def _(gravity, s):
    return dot(absolute(gravity), s)


@weight.register(Nothing)
def _(gravity, s):
    return 0.0
