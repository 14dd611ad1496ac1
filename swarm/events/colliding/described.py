"""A scene and its balls as the kernels of collisions take them."""

import math
from typing import Any

import numpy as np

from ...compiled_scene import CompiledScene
from ...contact.laws import NONE
from ...kernel.arrays import aligned, aligned_copy
from ...pairs import Pairs
from ...particles import Particles
from ...scene import Scene
from ...state import Floats
from ...surfaces.in_motion.drive import drive_of
from ..reacting.described import scenery_of
from .box import Domain
from .cells import Axis, BallGrid
from .meet import Loss
from .next_collision import Alike, Holdable, Various
from .queue import FIRST, SPARE
from .resting import repose_of
from .rows import CELL, FLOATS, NO_PARTNER, PARTNER, RADIUS, STAMP, TIME, WALL, WHOLES, Flock, Kept
from .rubbing import BallSpins
from .window import OUT, UNKNOWN

# Cells are longer than the largest diameter by this part: round-off of places.
_MARGIN = 1e-9
# And not shorter than this many mean distances of balls.
_SPACING = 0.8
# There are at most so many cells a ball, and a few.
_CELLS, _FEW = 2.0, 64
# Of fewer cells along a period a ball may have two images of another one in its own cell and its neighbours.
_IMAGES = 4
# The least numbers in the row of a cell: how many balls, and these.
_LEAST = 5
# Balls fly this part of the scene in an epoch, about.
_EPOCH = 0.125
# t_c, if it is not given, is this part of the time in which balls fly their diameter; under gravity, by which contacts
# last, the second part of that in which they fly or fall so far.
_DURATION, _FALL = 1e-4, 1e-3
# A flight from a wall back to it takes at least this part of an epoch: on a shorter one round-off is all there is.
_SHORTEST = 2.0**-20


def flock_of(particles: Particles, grid: BallGrid, loses: bool, walled: bool) -> Flock:
    """The balls at the start, in their cells."""
    n = len(particles)
    flight, event = aligned(FLOATS * n), aligned(FLOATS * n)
    tag = event.view(np.int32)
    rows, whole = flight.reshape(n, FLOATS), tag.reshape(n, WHOLES)
    rows[:, :3], rows[:, 3:6], rows[:, RADIUS] = particles.position.T, particles.velocity.T, particles.radius
    event.reshape(n, FLOATS)[:, :3] = math.inf
    for k, axis in enumerate(grid.axes()):
        where = np.clip(np.floor((particles.position[k] - axis.low) / axis.width), 0, axis.count - 1)
        whole[:, CELL + k] = where + 1
    key, item = np.full(n + SPARE, math.inf), np.zeros(n + SPARE, np.int32)
    item[FIRST : FIRST + n] = np.arange(n)
    if particles.births is not None:
        # In no cell, and nothing is next for them.
        late = particles.births.source >= 0
        event.reshape(n, FLOATS)[late, WALL], whole[late, PARTNER] = OUT, NO_PARTNER
    last = np.full(n, -math.inf) if loses else None
    kept = Kept(np.zeros(n), np.full(n, NO_PARTNER, np.int32)) if walled else None
    node = np.arange(FIRST, FIRST + n, dtype=np.int32)
    return Flock(flight, event, tag, node, aligned_copy(key), item, np.empty(0, np.int32), last, kept)


def with_room(flock: Flock, grid: BallGrid) -> tuple[Flock, BallGrid]:
    """The balls in cells that have room for all, and for some more. Balls that left the scene are in no cell."""
    n, cells = flock.number(), 0
    there = np.flatnonzero(flock.event.reshape(n, FLOATS)[:, WALL] != OUT)
    whole = flock.tag.reshape(n, WHOLES)
    for k, axis in enumerate(grid.axes()):
        cells = cells + axis.offset[whole[there, CELL + k]]
    sorts = np.argsort(cells, kind="stable")
    order = there[sorts].astype(np.int32)
    numbers, first, counts = np.unique(np.asarray(cells)[sorts], return_index=True, return_counts=True)
    # A cell is full by one ball, so that a little more will do; memory is dear.
    stride = max(_LEAST, grid.stride + max(1, grid.stride // 4), int(counts.max(initial=0)) + 1)
    room = np.zeros((grid.near.size, stride), np.int32)
    room[numbers, 0] = counts
    place = np.arange(len(order)) - np.repeat(first, counts)
    room[np.repeat(numbers, counts), 1 + place] = order
    return flock._replace(room=aligned_copy(room.ravel())), grid._replace(stride=stride)


def put_in(flock: Flock, grid: BallGrid, i: int, now: float, position: Floats, velocity: Floats) -> bool:
    """Put a ball that is born at a time of the epoch [s] into its cell: whether that has room for it."""
    n = flock.number()
    row, whole = flock.flight.reshape(n, FLOATS)[i], flock.tag.reshape(n, WHOLES)[i]
    row[:3], row[3:6], row[TIME] = position, velocity, now
    whole[STAMP] += 1
    flock.event.reshape(n, FLOATS)[i, WALL] = UNKNOWN
    if flock.followed is not None:
        flock.followed[i] = now
    cell = 0
    for k, axis in enumerate(grid.axes()):
        whole[CELL + k] = 1 + int(np.clip(math.floor((position[k] - axis.low) / axis.width), 0, axis.count - 1))
        cell += int(axis.offset[whole[CELL + k]])
    room = flock.room.reshape(-1, grid.stride)[cell]
    if room[0] + 1 >= grid.stride:
        return False
    room[0] += 1
    room[room[0]] = i
    return True


def there_at(flock: Flock, pull: Any, now: float) -> tuple[Floats, Floats, Floats]:
    """The balls that are in the vessel at a time of the epoch [s]: places and velocities (3, n), radii (n,)."""
    n = flock.number()
    rows = flock.flight.reshape(n, FLOATS)[flock.event.reshape(n, FLOATS)[:, WALL] != OUT]
    # The flight of a ball that is held begins later.
    way = np.maximum(now - rows[:, TIME], 0.0)
    fall = np.zeros((3, 1)) if pull is None else np.array([tuple(pull)]).T
    position = rows[:, :3].T + rows[:, 3:6].T * way + 0.5 * fall * way * way
    return position, rows[:, 3:6].T + fall * way, rows[:, RADIUS]


def described(compiled: CompiledScene, particles: Particles) -> tuple[Domain, Flock]:
    """What the balls are in, and these at the start."""
    assert particles.radius is not None
    scene = compiled.scene
    scenery = scenery_of(compiled, 0.0) if scene.reacts() else None
    laws = compiled.laws or NONE if scenery is None else scenery.laws
    pairs = scene.pairs or Pairs()
    loss, turning = None, None
    if particles.spin is not None:
        turning = BallSpins(particles.spin, pairs.friction or None)
    heavy_loses = any(surface.reacts() and surface.restitution < 1.0 for surface in scene.surfaces)
    if pairs.restitution < 1.0 or laws.restitution is not None or heavy_loses:
        loss = Loss(pairs.restitution, duration_of(scene, pairs, particles))
    grid = grid_of(scene, particles)
    flock, grid = with_room(flock_of(particles, grid, loss is not None, bool(scene.surfaces)), grid)
    shortest = max(_SHORTEST * epoch_of(scene, particles, grid), 0.0 if loss is None else loss.duration)
    walls = compiled.walls(0.0) if scenery is None else scenery.given
    kinds = kinds_of(particles, flock.flight)
    if laws.may_wait:
        flock, kinds = flock._replace(holds=1.0), Holdable(flock.flight, particles.mass.copy())
    made = Domain(walls, laws, scene.pull(), grid, kinds, loss, shortest)
    made = made._replace(turning=turning)
    if scene.gravity is not None:
        # Also where nothing is lost: balls may start at rest on a floor.
        made = made._replace(repose=repose_of(math.hypot(*scene.gravity), particles.radius))
    return made, flock


def kinds_of(particles: Particles, flight: Any) -> Any:
    """The radii and masses of balls."""
    radius, mass = particles.radius, particles.mass
    assert radius is not None
    if np.ptp(radius) == 0.0 and np.ptp(mass) == 0.0:
        return Alike(float(radius[0]), float(mass[0]), (2.0 * float(radius[0])) ** 2)
    return Various(flight, mass)


def speed_of(scene: Scene, particles: Particles) -> float:
    """The root mean square speed of balls at the start, or that of the fastest wall [m/s]."""
    fastest = [math.sqrt(float((particles.velocity**2).sum(axis=0).mean()))]
    for surface in scene.surfaces:
        if surface.motion is not None and not surface.reacts():
            drive = drive_of(surface, 0.0)
            reach = surface.extent() if math.isfinite(surface.extent()) else scene.finite_size()
            fastest.append(drive.fastest + drive.angular_speed() * reach)
    return max(fastest)


def duration_of(scene: Scene, pairs: Pairs, particles: Particles) -> float:
    """t_c of a run [s]."""
    assert particles.radius is not None
    if pairs.contact_duration is not None:
        return pairs.contact_duration
    diameter, speed = 2.0 * float(particles.radius.min()), speed_of(scene, particles)
    if scene.gravity is not None:
        return _FALL * diameter / max(speed, math.sqrt(math.hypot(*scene.gravity) * diameter))
    return _DURATION * diameter / speed if speed > 0.0 else 0.0


def reach_of(grid: BallGrid) -> float:
    """How far balls are to fly in an epoch [m], about."""
    return float(_EPOCH * max(axis.width * axis.count for axis in grid.axes()))


def epoch_of(scene: Scene, particles: Particles, grid: BallGrid) -> float:
    """The length of an epoch [s], a power of two."""
    speed = speed_of(scene, particles)
    size = reach_of(grid)
    if scene.gravity is not None:
        speed = max(speed, math.sqrt(size * math.hypot(*scene.gravity)))
    return float(2.0 ** math.floor(math.log2(size / speed))) if speed > 0.0 else 1.0


def grid_of(scene: Scene, particles: Particles) -> BallGrid:
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
    return BallGrid(*reversed(axes), np.ones(stride, np.bool_), 0, 1.0 if few else None)


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
