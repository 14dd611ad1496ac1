"""The exact course of a flight with 50 digits: what the hits of every surface are held against."""

import functools
import itertools
from typing import Any, NamedTuple

import mpmath as mp
import numpy as np
from conftest import EPSILON, body_of, call
from numpy.polynomial import Polynomial

from swarm.kernel.vector import vec
from swarm.surfaces import contract
from swarm.surfaces.rotation import Rotated
from swarm.surfaces.shapes.capsule import CapsuleNumbers
from swarm.surfaces.shapes.quadratic import QuadricNumbers
from swarm.surfaces.shapes.rotated import own
from swarm.surfaces.shapes.torus import TorusNumbers

mp.mp.dps = 50
_REST = (0.0, 0.0, 0.0)


def exact(*vectors):
    """The same doubles with 50 digits, as an array."""
    return np.array([mp.mpf(float(part)) for vector in vectors for part in vector], dtype=object)


def flight(surface, position, velocity, acceleration=_REST):
    """The coordinates of a flight in the surface's own frame, as exact polynomials of time."""
    halves = exact(acceleration) / 2
    path = [Polynomial(np.array(axis)) for axis in zip(exact(position), exact(velocity), halves, strict=True)]
    return own(surface, vec(path)) if isinstance(surface, Rotated) else vec(path)


class Level(NamedTuple):
    """The level along a flight, piece by piece: polynomials, and the times at which they end."""

    pieces: list[Polynomial]
    ends: list[Any]
    unit: Any = mp.mpf(1)  # of time, in which the roots are about 1

    def __call__(self, time):
        return next(piece for piece, end in zip(self.pieces, self.ends, strict=True) if time <= end)(time)

    def parts(self, end):
        """The pieces until `end`, each with its start and its end."""
        starts = [mp.mpf(0), *self.ends[:-1]]
        for piece, low, high in zip(self.pieces, starts, self.ends, strict=True):
            if low <= end:
                yield piece, low, min(high, mp.mpf(end))

    def highest(self, end):
        """The largest value on [0, end]."""
        stops = [
            (piece, stop)
            for piece, low, high in self.parts(end)
            for stop in (low, high, *(root for root in real_roots(piece.deriv(), self.unit) if low < root < high))
        ]
        return max(piece(stop) for piece, stop in stops)

    def slope(self, time, order=1):
        """A derivative."""
        return next(piece for piece, end in zip(self.pieces, self.ends, strict=True) if time <= end).deriv(order)(time)

    def exits(self, end=mp.inf):
        """Times at which the level rises through 0, sorted."""
        roots = []
        for piece, low, high in self.parts(end):
            roots += [root for root in real_roots(piece, self.unit) if low <= root <= high and piece.deriv()(root) > 0]
        return roots


def level_along(surface, position, velocity, acceleration=_REST):
    """A number of the sign of the gap along a flight, by the surface's own formula where that is a polynomial."""
    path, body = flight(surface, position, velocity, acceleration), body_of(surface)
    unit = mp.mpf(surface_size(surface) / max(np.linalg.norm(velocity), 1e-300))
    if isinstance(body, TorusNumbers):
        # (|r|^2 + R^2 - a^2)^2 - 4 R^2 rho^2
        x, y, z = path - vec(map(mp.mpf, body.center))
        major, minor = mp.mpf(body.major), mp.mpf(body.radius)
        both = x * x + y * y + z * z + (major**2 - minor**2)
        return Level([body.side * (both * both - 4 * major**2 * (x * x + y * y))], [mp.inf], unit)
    if isinstance(body, CapsuleNumbers):
        x, y, z = path - vec(map(mp.mpf, body.center))
        half = mp.mpf(body.half)
        ends = sorted(root for end in (-half, half) for root in real_roots(z - end, unit) if root > 0)
        inner = []
        for low, high in itertools.pairwise([mp.mpf(0), *ends, mp.inf]):
            middle = z((low + high) / 2 if high < mp.inf else 2 * low + 1)
            w = z - half if middle > half else z + half if middle < -half else Polynomial([mp.mpf(0)])
            inner.append(x * x + y * y + w * w)
        return Level([body.side * (q - mp.mpf(body.radius) ** 2) for q in inner], [*ends, mp.inf], unit)
    return Level([contract.level_of(surface, contract.inner(body, path))], [mp.inf], unit)


def surface_size(surface):
    """A length of the surface, for times."""
    body = body_of(surface)
    curvature = _curvature(surface) if isinstance(body, QuadricNumbers) else 1.0
    return getattr(body, "radius", None) or (curvature or 1.0) ** -0.5


def _ways(velocity, time, acceleration):
    """How far a flight comes at most."""
    return np.linalg.norm(velocity) * time + 0.5 * np.linalg.norm(acceleration) * time * time


def _factor(surface, far):
    """How much larger than the level its stand-in here is at most, at this distance from the origin."""
    body = body_of(surface)
    # (rho + R)^2 + z^2 - a^2
    if not isinstance(body, TorusNumbers):
        return 1.0
    return (2.0 * (far + body.major + abs(body.center.x) + abs(body.center.y))) ** 2


def steepness(surface, position, velocity, time=0.0, acceleration=_REST):
    """The largest derivative of the level that a flight of this speed can have."""
    ways = _ways(velocity, time, acceleration)
    bend = abs(_curvature(surface))
    slope = np.linalg.norm(call(contract.inner_gradient, surface, position, position)) + 2.0 * bend * ways
    fastest = np.linalg.norm(velocity) + np.linalg.norm(acceleration) * time
    return slope * fastest * _factor(surface, np.linalg.norm(position) + ways)


def _curvature(surface):
    """The largest eigenvalue of H, about."""
    body = body_of(surface)
    if isinstance(body, QuadricNumbers):
        return max(map(abs, body.a))
    return 0.0 if hasattr(body, "offset") else 1.0


def noise(surface, level, position, velocity, time=0.0, acceleration=_REST):
    """The round-off of the level at a time of a flight: a few units in the last place of its largest terms."""
    ways = _ways(velocity, time, acceleration)
    far = np.linalg.norm(position) + ways
    slope = np.linalg.norm(call(contract.inner_gradient, surface, position, position))
    terms = abs(call(contract.inner, surface, position)) + abs(contract.level_of(surface, 0.0))
    terms += slope * far + _curvature(surface) * ways * ways
    # A torus may be seen from its axis, where slopes are steep.
    terms += far * far if isinstance(body_of(surface), TorusNumbers) else 0.0
    return 16 * EPSILON * mp.mpf(terms) * _factor(surface, far)


def real_roots(polynomial, unit=1):
    """Real roots of a polynomial to 40 digits, sorted: between its turning points, by bisection."""
    return [unit * root for root in _roots([part * unit**k for k, part in enumerate(polynomial.coef)])]


def _roots(coefficients):
    largest = max(map(abs, coefficients))
    while coefficients and abs(coefficients[-1]) <= mp.mpf(10) ** -45 * largest:
        coefficients.pop()
    if len(coefficients) < 3:
        return [-coefficients[0] / coefficients[1]] if len(coefficients) == 2 else []
    if len(coefficients) == 3:
        return _quadratic_roots(*coefficients)
    slopes = [k * part for k, part in enumerate(coefficients) if k]
    far = 1 + max(abs(part / coefficients[-1]) for part in coefficients)
    roots = []
    for low, high in itertools.pairwise([-far, *_roots(list(slopes)), far]):
        up = _value(coefficients, high) > 0
        if (_value(coefficients, low) > 0) == up:
            continue
        while high - low > mp.mpf(10) ** -40 * max(abs(low), abs(high)) and high - low > mp.mpf(10) ** -60:
            middle = (low + high) / 2
            slope = _value(slopes, middle)
            if high - low < mp.mpf(10) ** -6 * abs(middle) and slope:
                # Newton's step and a little more either way, if the root is between
                newton = middle - _value(coefficients, middle) / slope
                width = max(abs(newton - middle) * mp.mpf(10) ** -3, mp.mpf(10) ** -42 * abs(middle))
                if low < newton - width and newton + width < high:
                    ends = [_value(coefficients, end) > 0 for end in (newton - width, newton + width)]
                    if ends == [not up, up]:
                        low, high = newton - width, newton + width
                        continue
            low, high = (middle, high) if (_value(coefficients, middle) > 0) != up else (low, middle)
        roots.append((low + high) / 2)
    return roots


def _value(coefficients, t):
    return functools.reduce(lambda sum_, part: sum_ * t + part, coefficients[::-1])


def _quadratic_roots(c, b, a):
    inside = b * b - 4 * a * c
    if inside < 0:
        return []
    larger = -(b + (mp.sqrt(inside) if b >= 0 else -mp.sqrt(inside))) / 2
    return sorted([larger / a, c / larger] if larger else [mp.mpf(0)])
