"""The velocities of births.

Every function draws one row of numbers after the other, and two laws from two streams: the first births of a longer
run are those of a shorter one.
"""

import math

import numpy as np
from numpy.typing import NDArray

from ..surfaces.plane import along
from .pieces import Floats, Random
from .source import Source


def from_volume(source: Source, random: Random, n: int, across: int | None) -> Floats:
    """Velocities (3, n) of particles that are born in a volume."""
    if source.beam is not None:
        return _beam(source, random, n, across)
    normal = np.ascontiguousarray(random.standard_normal((n, 3)).T)
    if across is not None:
        normal[across] = 0.0
    if source.temperature is not None:
        return np.asarray(math.sqrt(source.temperature / source.mass) * normal)
    return np.asarray((source.speed or 0.0) * normal / np.sqrt((normal**2).sum(axis=0)))


def from_surface(source: Source, random: Random, normals: Floats, across: int | None) -> Floats:
    """Velocities (3, n) of particles that come from a surface, against these unit normals."""
    n = normals.shape[1]
    if source.beam is not None:
        return _into(source, random, normals, across)
    first, second = _tangents(normals, across)
    if source.temperature is not None:
        scale = math.sqrt(source.temperature / source.mass)
        # The normal speed of what passes a plane in a gas at rest: w exp(-w^2/2).
        away = np.sqrt(2.0 * random.standard_exponential(n))
        u, w = random.spawn(1)[0].standard_normal((n, 2)).T
        return np.asarray(scale * (u * first + w * second - away * normals))
    if across is not None:
        sine = 2.0 * random.random(n) - 1.0
        direction = sine * first
    else:
        part, turn = random.random((n, 2)).T
        sine, angle = np.sqrt(part), 2.0 * math.pi * turn
        direction = sine * (np.cos(angle) * first + np.sin(angle) * second)
    return np.asarray((source.speed or 0.0) * (direction - np.sqrt(1.0 - sine * sine) * normals))


def _tangents(normals: Floats, across: int | None) -> tuple[Floats, Floats]:
    """Unit vectors along surfaces with these normals; in a plane one, and 0."""
    if across is not None:
        i, j = along(across)
        first = np.zeros_like(normals)
        first[i], first[j] = -normals[j], normals[i]
        return first / np.sqrt((first**2).sum(axis=0)), np.zeros_like(normals)
    least = np.abs(normals).argmin(axis=0)
    first = np.cross(normals, np.eye(3)[least].T, axis=0)
    first /= np.sqrt((first**2).sum(axis=0))
    return first, np.cross(normals, first, axis=0)


def _beam(source: Source, random: Random, n: int, across: int | None) -> Floats:
    """Directions uniform in a cone about the beam."""
    beam = np.array(source.beam)[:, None]
    if source.divergence == 0.0:
        return np.broadcast_to(beam, (3, n)).copy()
    speed = float(np.sqrt((beam**2).sum()))
    axes = np.broadcast_to(-beam / speed, (3, n))
    first, second = _tangents(axes, across)
    if across is not None:
        angle = source.divergence * (2.0 * random.random(n) - 1.0)
        return np.asarray(speed * (np.sin(angle) * first - np.cos(angle) * axes))
    part, turn = random.random((n, 2)).T
    cosine = 1.0 - (1.0 - math.cos(source.divergence)) * part
    sine, angle = np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0)), 2.0 * math.pi * turn
    return np.asarray(speed * (sine * (np.cos(angle) * first + np.sin(angle) * second) - cosine * axes))


def _into(source: Source, random: Random, normals: Floats, across: int | None) -> Floats:
    """Velocities of a beam that are not into the wall, which the axis of the beam is not."""
    n = normals.shape[1]
    velocity = _beam(source, random, n, across)
    while source.divergence > 0.0:
        wrong = np.flatnonzero((velocity * normals).sum(axis=0) >= 0.0)
        if not wrong.size:
            break
        # Each try has a stream with a row for every birth, so that no birth takes what is another's.
        velocity[:, wrong] = _beam(source, random.spawn(1)[0], n, across)[:, wrong]
    return velocity


def leads_in(source: Source, normals: Floats) -> NDArray[np.bool_]:
    """Whether the axis of a beam leads away from surfaces with these normals out of the vessel."""
    return np.asarray((np.array(source.beam)[:, None] * normals).sum(axis=0) < 0.0)
