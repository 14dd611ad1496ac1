"""A step of a sliding particle: the places on its path."""

import math
from typing import Any

from ..kernel.record import Record
from ..kernel.vector import Vec, norm
from ..surfaces.in_motion.moving import Moving
from ..surfaces.in_motion.posed import Posed

# Places of a step that are tested, and halvings down to an instant.
PLACES, _HALVINGS = 16, 60
# A part before all parts of a step.
BEFORE = -1.0


class StepPath(Record):
    """A step of length h."""

    r0: Vec
    v0: Vec
    r1: Vec
    v1: Vec
    h: Any


def reach_of(path):
    """Return a distance from the end of a step that no place of it exceeds.

    It is twice the length of the step: a place farther from its end, by a distance of first order, is not on its path.
    """
    return norm(path.r1 - path.r0) + path.h * (norm(path.v0) + norm(path.v1))


def first_true(question, given, start, surely, about, closer=None):
    """Return the part of a step, later than `start`, from which question(*given, margin, part) is true; or infinity.

    With `start` = BEFORE the part 0 is included. Equidistant parts are tested with the margin `surely`; from
    the first one with the answer yes, it is bisected down to where the answer with the margin `about` changes.
    `closer`, if any, is a function closer(*given, margin, low, part, high) that returns the part to test instead of
    `part`, between two others.
    """
    low = max(start, 0.0)
    for k in range(PLACES + 1):
        part = k / PLACES
        if part > start:
            asked = part if closer is None else closer(*given, surely, low, part, min(k + 1, PLACES) / PLACES)
            if question(*given, surely, asked):
                return _bisected(question, (*given, about), low, asked)
            low = part
    return math.inf


def _bisected(question, given, low, high):
    """Return the part from which question(*given, part) is true, as it is at `high` and not at `low`."""
    for _i in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if question(*given, middle):
            high = middle
        else:
            low = middle
    return high


def at_part(path, s):
    """Return the place on the cubic through both ends of a step."""
    r0, a, b, c = cubic(path)
    return r0 + s * (a + s * (b + s * c))


def cubic(path):
    """Return the cubic through both ends of a step, as the coefficients of the powers of the part."""
    d, h = path.r1 - path.r0, path.h
    # Hermite's form
    a, b = 3.0 * d - h * (2.0 * path.v0 + path.v1), h * (path.v0 + path.v1) - 2.0 * d
    return path.r0, h * path.v0, a, b


def members_of(field):
    """Return the bodies of a field."""
    return field.body if isinstance(field, (Posed, Moving)) else field
