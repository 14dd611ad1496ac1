"""A scene and its balls as the kernels of collisions take them."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contact.laws import NONE
from ..pairs import Pairs
from ..particles import Particles
from ..scene import Scene
from .aim import Alike, Various
from .cells import Axis, Grid
from .events import Box
from .meet import Loss
from .rows import BEFORE, CELL, FLOATS, NEXT, NOBODY, WHOLES, Flock

Floats = NDArray[np.float64]

# Cells are longer than the largest diameter by this part: round-off of places.
_MARGIN = 1e-9
# And not shorter than this many mean distances of balls.
_SPACING = 0.8
# There are at most so many cells a ball, and a few.
_CELLS, _FEW = 2.0, 64
# Of fewer cells along a period a ball may have two images of another one in its own cell and its neighbours.
_IMAGES = 4
# Balls fly this part of the scene in an epoch, about.
_EPOCH = 0.125
# t_c where none is given is this part of the time in which balls fly their diameter.
_DURATION = 1e-4


def flock_of(particles: Particles, grid: Grid, loses: bool) -> Flock:
    """The balls at the start, in their cells."""
    n = len(particles)
    flight, event = aligned(FLOATS * n), aligned(FLOATS * n)
    tag, link = event.view(np.int32), flight.view(np.int32)
    rows = flight.reshape(n, FLOATS)
    rows[:, :3], rows[:, 3:6] = particles.position.T, particles.velocity.T
    event.reshape(n, FLOATS)[:, :3] = math.inf
    whole, chain = tag.reshape(n, WHOLES), link.reshape(n, WHOLES)
    cells = np.zeros(n, np.int64)
    for k, axis in enumerate(grid.axes()):
        where = np.clip(np.floor((particles.position[k] - axis.low) / axis.width), 0, axis.count - 1).astype(np.int32)
        whole[:, CELL + k] = where + 1
        cells += axis.offset[where + 1]
    head = np.full(grid.near.size, NOBODY, np.int32)
    order = np.argsort(cells, kind="stable")
    same = cells[order[1:]] == cells[order[:-1]]
    chain[:, NEXT], whole[:, BEFORE] = NOBODY, NOBODY
    chain[order[:-1][same], NEXT], whole[order[1:][same], BEFORE] = order[1:][same], order[:-1][same]
    starts = order[np.append(True, ~same)]
    head[cells[starts]] = starts
    last = np.full(n, -math.inf) if loses else None
    return Flock(flight, link, event, tag, np.zeros(n), np.arange(n, dtype=np.int32), head, last)


def aligned(size: int) -> Floats:
    """An array of zeros that begins with a line of the cache."""
    made = np.zeros(size + 8)
    first = -(made.ctypes.data // 8) % 8
    return made[first : first + size]


def box_of(scene: Scene, particles: Particles, moment: float) -> Box:
    """What the balls are in."""
    assert particles.radius is not None
    laws = scene.laws() or NONE
    pairs = scene.pairs or Pairs()
    loss = None
    if pairs.restitution < 1.0 or laws.restitution is not None:
        loss = Loss(pairs.restitution, duration_of(pairs, particles))
    walls = scene.walls(moment)
    return Box(walls, laws, scene.pull(), grid_of(scene, particles), kinds_of(particles), loss)


def kinds_of(particles: Particles) -> Any:
    """The radii and masses of balls."""
    radius, mass = particles.radius, particles.mass
    assert radius is not None
    if np.ptp(radius) == 0.0 and np.ptp(mass) == 0.0:
        return Alike(float(radius[0]), float(mass[0]), (2.0 * float(radius[0])) ** 2)
    return Various(radius, mass)


def duration_of(pairs: Pairs, particles: Particles) -> float:
    """t_c of a run [s]."""
    assert particles.radius is not None
    if pairs.contact_duration is not None:
        return pairs.contact_duration
    speed = math.sqrt(float((particles.velocity**2).sum(axis=0).mean()))
    return _DURATION * 2.0 * float(particles.radius.min()) / speed if speed > 0.0 else 0.0


def epoch_of(scene: Scene, particles: Particles) -> float:
    """The length of an epoch [s], a power of two."""
    speed = math.sqrt(float((particles.velocity**2).sum(axis=0).mean()))
    size = _EPOCH * scene.finite_size()
    if scene.gravity is not None:
        speed = max(speed, math.sqrt(size * math.hypot(*scene.gravity)))
    return float(2.0 ** math.floor(math.log2(size / speed))) if speed > 0.0 else 1.0


def grid_of(scene: Scene, particles: Particles) -> Grid:
    """The cells of a scene, which are not shorter than the largest diameter."""
    low, high = _region(scene, particles)
    radius = particles.radius
    assert radius is not None
    n, diameter = len(particles), 2.0 * float(radius.max()) * (1.0 + _MARGIN)
    long = [k for k in range(3) if high[k] > low[k]]
    sizes = (high - low)[long]
    spacing = (float(np.prod(sizes)) / n) ** (1.0 / len(long)) if long else 0.0
    width = max(diameter, _SPACING * spacing)
    counts = np.ones(3, np.int64)
    while True:
        counts[long] = np.maximum(1, np.floor(sizes / width)).astype(np.int64)
        if counts.prod() <= _CELLS * n + _FEW:
            break
        width *= 1.1
    periods = scene.period or (None, None, None)
    axes, stride = [], 1
    for k in (2, 1, 0):
        offset = np.arange(counts[k] + 2, dtype=np.int32) * stride
        if periods[k] is not None:
            offset[0], offset[-1] = offset[-2], offset[1]
        length = periods[k]
        last = None if length is None else float(np.nextafter(length, 0.0))
        cell = float((high[k] - low[k]) / counts[k]) if high[k] > low[k] else diameter
        axes.append(Axis(float(low[k]), cell, int(counts[k]), offset, length, last))
        stride *= int(counts[k]) + 2
    few = any(axis.period is not None and axis.count < _IMAGES for axis in axes)
    return Grid(*reversed(axes), np.ones(stride, np.bool_), 1.0 if few else None)


def _region(scene: Scene, particles: Particles) -> tuple[Floats, Floats]:
    """The box that the cells fill: of the walls, or of the start where these have no end."""
    low, high = (np.array(corner, float) for corner in scene.bounds())
    radius = particles.radius
    assert radius is not None
    first, last = particles.position.min(axis=1) - radius.max(), particles.position.max(axis=1) + radius.max()
    for k, length in enumerate(scene.period or (None, None, None)):
        if length is not None:
            low[k], high[k] = 0.0, length
    across = scene.across()
    if across is not None:
        low[across] = high[across] = 0.0
    return np.where(np.isfinite(low), low, first), np.where(np.isfinite(high), high, last)
