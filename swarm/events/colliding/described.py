"""A scene and its balls as the kernels of collisions take them."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...compiled_scene import CompiledScene
from ...kernel.arrays import aligned
from ...pairs import Pairs
from ...particles import Particles
from ...scene import Scene
from ...state import Floats
from ...surfaces.in_motion.drive import drive_of
from ..reacting.described import scenery_of
from .box import Domain
from .cells import Axis, BallGrid, put_in
from .meet import Loss
from .next_collision import Alike, Holdable, Various
from .queue import FIRST, SPARE
from .resting import repose_of
from .rows import AFTER, CELL, FLOATS, NO_PARTNER, PARTNER, STAMP, TIME, WALL, WHOLES, Flock
from .rubbing import BallSpins
from .window import OUT, UNKNOWN

# Cells are longer than the largest diameter by this part, for round-off of places.
_MARGIN = 1e-9
# Cells are no shorter than this factor times the mean distance of balls.
_SPACING = 0.8
# The number of cells is at most `_CELLS` times the number of balls, plus `_FEW`.
_CELLS, _FEW = 2.0, 64
# With fewer cells along a period, two images of a ball may be in the cells around another ball.
_IMAGES = 4
# The typical way of a ball in an epoch, as a part of the scene.
_EPOCH = 0.125
# The default t_c is the part `_DURATION` of the time in which a ball flies its diameter. Under gravity, where contacts
# last, it is the part `_FALL` of the time in which a ball flies or falls its diameter.
_DURATION, _FALL = 1e-4, 1e-3
# The least time of a flight from a wall back to it, as a part of an epoch: a shorter flight is nothing but round-off.
_SHORTEST = 2.0**-20
# Temporary arrays have this number of balls, so that they are small beside the arrays of the run.
_AT_ONCE = 32_768


def _cell_along(axis: Axis, x: Any) -> Any:
    """The numbers of the cells of places along an axis."""
    return 1 + np.clip(np.floor((x - axis.low) / axis.width), 0, axis.count - 1)


def flock_of(particles: Particles, grid: BallGrid, loses: bool) -> Flock:
    """Return the balls at the start, in their cells."""
    n = len(particles)
    flight, event = aligned(FLOATS * n), aligned(FLOATS * n)
    link, tag = flight.view(np.int32), event.view(np.int32)
    rows, whole = flight.reshape(n, FLOATS), tag.reshape(n, WHOLES)
    rows[:, :3], rows[:, 3:6] = particles.position.T, particles.velocity.T
    event.reshape(n, FLOATS)[:, :3], event.reshape(n, FLOATS)[:, 3] = math.inf, math.nan
    for first in range(0, n, _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        for k, axis in enumerate(grid.axes()):
            whole[some, CELL + k] = _cell_along(axis, particles.position[k, some])
    key, node, item = aligned(n + SPARE), np.arange(FIRST, FIRST + n, dtype=np.int32), np.zeros(n + SPARE, np.int32)
    key.fill(math.inf)
    np.subtract(node, FIRST, out=item[FIRST : FIRST + n])
    if particles.births is not None:
        # Balls that are born later are in no cell, and have no next event.
        late = particles.births.source >= 0
        whole[late, WALL], whole[late, PARTNER] = OUT, NO_PARTNER
    last = np.full(n, -math.inf) if loses else None
    return Flock(flight, event, link, tag, node, key, item, _linked(link, tag, grid), last)


def _linked(link: NDArray[np.int32], tag: NDArray[np.int32], grid: BallGrid) -> NDArray[np.int32]:
    """Link the balls of each cell at the start; return the first ball of each cell."""
    whole, after = tag.reshape(-1, WHOLES), link.reshape(-1, WHOLES)[:, AFTER]
    head = np.full(grid.near.size, NO_PARTNER, np.int32)
    for first in range(0, len(whole), _AT_ONCE):
        left = first + np.flatnonzero(whole[first : first + _AT_ONCE, WALL] != OUT)
        while left.size:
            cell = np.zeros(left.size, np.int32)
            for k, axis in enumerate(grid.axes()):
                cell += axis.offset[whole[left, CELL + k]]
            # Of several balls in one cell the last one is linked; the others follow in the next rounds.
            before, head[cell] = head[cell], left
            is_in = head[cell] == left
            after[left[is_in]] = before[is_in]
            left = left[~is_in]
    return head


def come(flock: Flock, grid: BallGrid, i: int, now: float, position: Floats, velocity: Floats) -> None:
    """Put a ball that is born at a time of the epoch [s] into its cell."""
    n = flock.number()
    row, whole = flock.flight.reshape(n, FLOATS)[i], flock.tag.reshape(n, WHOLES)[i]
    row[:3], row[3:6], row[TIME] = position, velocity, now
    whole[STAMP] += 1
    whole[WALL] = UNKNOWN
    if flock.followed is not None:
        flock.followed[i] = now
    for k, axis in enumerate(grid.axes()):
        whole[CELL + k] = _cell_along(axis, position[k])
    put_in(flock, i, grid.number(i, flock))


def there_at(flock: Flock, radius: Floats, pull: Any, now: float) -> tuple[Floats, Floats, Floats]:
    """Return the places and velocities (3, n) and radii (n,) of the balls present at a time of the epoch [s]."""
    n = flock.number()
    there = flock.tag.reshape(n, WHOLES)[:, WALL] != OUT
    rows = flock.flight.reshape(n, FLOATS)[there]
    # The flight of a held ball begins later.
    way = np.maximum(now - rows[:, TIME], 0.0)
    fall = np.zeros((3, 1)) if pull is None else np.array([tuple(pull)]).T
    position = rows[:, :3].T + rows[:, 3:6].T * way + 0.5 * fall * way * way
    return position, rows[:, 3:6].T + fall * way, radius[there]


def described(compiled: CompiledScene, particles: Particles) -> tuple[Domain, Flock, float]:
    """Return the `Domain` of the balls, the balls at the start, and the length of an epoch [s]."""
    assert particles.radius is not None
    scene = compiled.scene
    scenery = scenery_of(compiled, 0.0)
    laws = scenery.laws
    pairs = scene.pairs or Pairs()
    loss, turning = None, None
    if particles.spin is not None:
        turning = BallSpins(particles.spin, pairs.friction or None)
    heavy_loses = any(surface.reacts() and surface.restitution < 1.0 for surface in scene.surfaces)
    if pairs.restitution < 1.0 or laws.restitution is not None or heavy_loses:
        loss = Loss(pairs.restitution, duration_of(scene, pairs, particles))
    grid = grid_of(scene, particles)
    epoch = _epoch_of(scene, particles, grid)
    flock = flock_of(particles, grid, loss is not None)
    shortest = max(_SHORTEST * epoch, 0.0 if loss is None else loss.duration)
    kinds = kinds_of(particles, laws.may_wait)
    if laws.may_wait:
        flock = flock._replace(holds=1.0)
    # Rest is also possible without a loss of energy, as balls may start at rest on a floor.
    repose = None if scene.gravity is None else repose_of(math.hypot(*scene.gravity), particles.radius)
    made = Domain(scenery.given, laws, scene.pull(), grid, kinds, loss, shortest, repose=repose, turning=turning)
    return made, flock, epoch


def kinds_of(particles: Particles, may_be_held: bool) -> Any:
    """Return the kind of the balls: their radii and masses."""
    radius, mass = particles.radius, particles.mass
    assert radius is not None
    if not may_be_held and np.ptp(radius) == 0.0 and np.ptp(mass) == 0.0:
        return Alike(float(radius[0]), float(mass[0]), (2.0 * float(radius[0])) ** 2)
    size = aligned(2 * len(radius))
    size[0::2], size[1::2] = radius, mass
    return Holdable(size) if may_be_held else Various(size)


def speed_of(scene: Scene, particles: Particles) -> float:
    """The root mean square speed of balls at the start, or the speed of the fastest wall if larger [m/s]."""
    # Rows are squared one by one; the squares of all components would for a moment be the largest array of the run.
    squares = np.zeros(len(particles))
    for row in particles.velocity:
        squares += row * row
    fastest = [math.sqrt(float(squares.mean()))]
    for surface in scene.surfaces:
        if surface.motion is not None and not surface.reacts():
            drive = drive_of(surface, 0.0)
            reach = surface.extent() if math.isfinite(surface.extent()) else scene.finite_size()
            fastest.append(drive.fastest + drive.angular_speed() * reach)
    return max(fastest)


def duration_of(scene: Scene, pairs: Pairs, particles: Particles) -> float:
    """The contact duration t_c of a run [s]."""
    assert particles.radius is not None
    if pairs.contact_duration is not None:
        return pairs.contact_duration
    diameter, speed = 2.0 * float(particles.radius.min()), speed_of(scene, particles)
    if scene.gravity is not None:
        return _FALL * diameter / max(speed, math.sqrt(math.hypot(*scene.gravity) * diameter))
    return _DURATION * diameter / speed if speed > 0.0 else 0.0


def reach_of(grid: BallGrid) -> float:
    """The typical way of a ball in an epoch [m]."""
    return float(_EPOCH * max(axis.width * axis.count for axis in grid.axes()))


def _epoch_of(scene: Scene, particles: Particles, grid: BallGrid) -> float:
    """The length of an epoch [s], a power of two."""
    speed = speed_of(scene, particles)
    size = reach_of(grid)
    if scene.gravity is not None:
        speed = max(speed, math.sqrt(size * math.hypot(*scene.gravity)))
    return float(2.0 ** math.floor(math.log2(size / speed))) if speed > 0.0 else 1.0


def grid_of(scene: Scene, particles: Particles) -> BallGrid:
    """Return the cells of a scene, no shorter than the largest diameter."""
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
    return BallGrid(*reversed(axes), np.ones(stride, np.bool_), 1.0 if few else None)


def _region(scene: Scene, particles: Particles) -> tuple[Floats, Floats]:
    """Return the corners of the box of the cells: the bounds of the walls, or of the start along unbounded axes."""
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
