"""A step of a particle that slides: the places on its way."""

from typing import Any

from ..kernel.record import Record
from ..kernel.vector import Vec
from ..surfaces.in_motion.moving import Moving
from ..surfaces.in_motion.posed import Posed

# Halvings down to an instant.
_HALVINGS = 60


class StepPath(Record):
    """A step of length h."""

    r0: Vec
    v0: Vec
    r1: Vec
    v1: Vec
    h: Any


def bisected(has_happened, given, low, high):
    """The part of a step from which on has_happened(*given, part), which it is at `high` and not at `low`."""
    for _i in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if has_happened(*given, middle):
            high = middle
        else:
            low = middle
    return high


def at_part(path, s):
    """The place on the cubic through both ends of a step."""
    r0, a, b, c = cubic(path)
    return r0 + s * (a + s * (b + s * c))


def cubic(path):
    """The cubic through both ends of a step, as the coefficients of the powers of the part of it."""
    d, h = path.r1 - path.r0, path.h
    # Hermite's form
    a, b = 3.0 * d - h * (2.0 * path.v0 + path.v1), h * (path.v0 + path.v1) - 2.0 * d
    return path.r0, h * path.v0, a, b


def members_of(field):
    """The bodies of a field."""
    return field.body if isinstance(field, (Posed, Moving)) else field
