"""Constant gravity, or none: the exact free flight."""

from .vector import Vec, absolute, dot


class Gravity(Vec):
    """Acceleration G [m/s^2]. A scene without gravity has None, which compiles to nothing."""


def as_vector(gravity):
    """G as a vector like any other."""
    return Vec(gravity.x, gravity.y, gravity.z)


def displacement(gravity, v, t):
    """v t + G t^2/2"""
    if gravity is None:
        return v * t
    half = 0.5 * t
    return (v + half * gravity) * t


def accelerated(gravity, v, t):
    """v + G t"""
    return v if gravity is None else v + gravity * t


def potential(gravity, r):
    """Potential energy per mass, -G.r"""
    return 0.0 if gravity is None else -dot(gravity, r)


def weight(gravity, s):
    """The largest change of the potential energy per mass when the coordinates change by s."""
    return 0.0 if gravity is None else dot(absolute(gravity), s)
