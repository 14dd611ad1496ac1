"""Balls at random places where they overlap neither one another nor walls: random sequential addition."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..ball_numbers import balls_volume
from ..errors import SceneError
from ..particles import VolumeEstimate
from ..scene import Scene
from ..state import Floats
from .cells import CellLists, empty_cells, enter_free, find_free, order_of
from .vacant import Vacant

# The densest packings, in space and in a plane. Random sequential addition ends at 0.384 and 0.547, where the last
# balls take longer and longer.
_DENSEST = {3: 0.35, 2: 0.5}
_ABOUT = 1.01
# A periodic cell holds a ball and its nearest image apart: at least this number of radii.
_APART = 4.0
# A ball as wide as its vessel fits, within this round-off.
_CLOSE = 1e-12
# The most and the fewest places that are tried together, and the balls for them.
_MOST, _LEAST, _WINDOW = 1 << 18, 256, 1 << 16
# The search ends after this number of places for each ball: a packing of 0.35 takes 160, of 0.5 in a plane 90.
_TRIES, _ALWAYS = 4000, 2_000_000
# If fewer tries than this find a place, vacant places are searched. Balls down to this fraction count as one size.
_RARE, _ALIKE = 0.05, 0.9
# Places in a search for each ball, or for each vacant box.
_SEARCHED = 8


class VolumeBox(NamedTuple):
    """A volume: a box around it (3, 1), and the function that measures it."""

    low: Floats
    high: Floats
    measured: Callable[[], VolumeEstimate]

    @property
    def volume(self) -> float:
        """Return the measured volume."""
        return self.measured().volume


def require_size(scene: Scene, radius: Floats) -> None:
    """Raise a `SceneError` for a ball larger than its vessel or its cell."""
    largest = int(radius.argmax())
    ball = f"{radius[largest]:g} m of particle {largest}"
    for k, length in enumerate(scene.period or ()):
        if length is not None and length < _APART * radius[largest]:
            raise SceneError(
                f"radius must be at most a quarter of period[{k}] = {length:g} m, so that a ball is far from its "
                f"image, got {ball}; use smaller balls, or a larger cell"
            )
    low, high = (np.array(corner) for corner in scene.bounds())
    for k in scene.axes():
        repeats = scene.period is not None and scene.period[k] is not None
        if not repeats and 2.0 * radius[largest] > (1.0 + _CLOSE) * (high - low)[k]:
            raise SceneError(
                f"radius must leave a place within the walls, which are {(high - low)[k]:g} m apart along {'xyz'[k]}, "
                f"got {ball}; use smaller balls, or a larger vessel"
            )


def require_packing(scene: Scene, radius: Floats, room: VolumeBox, most: float | None = None) -> float:
    """Return the packing of balls in a volume; raise a `SceneError` above `most`, or above the densest random one."""
    axes = len(scene.axes())
    packing = balls_volume(scene, radius) / room.volume
    densest = _DENSEST[axes] if most is None else most
    # The volume is an estimate.
    if packing > _ABOUT * densest:
        raise SceneError(
            f"radius must leave a packing of at most {densest:g} to random places, got "
            f"{packing_of(scene, radius, room)}; use fewer or smaller balls, or swarm.pack, which packs them "
            f"more closely"
        )
    return packing


def is_sparse(scene: Scene, radius: Floats, room: VolumeBox) -> bool:
    """Whether the balls fill less of a volume than `require_packing` allows."""
    return balls_volume(scene, radius) <= _DENSEST[len(scene.axes())] * room.volume


def packing_of(scene: Scene, radius: Floats, room: VolumeBox) -> str:
    """Describe the balls in a volume, for a message."""
    unit, kind = ("m^3", "balls") if scene.plane is None else ("m^2", "discs")
    size = f"{radius[0]:g} m" if radius.min() == radius.max() else f"{radius.min():g} to {radius.max():g} m"
    return (
        f"{radius.size} {kind} of {size} in {room.volume:.4g} {unit}, a packing of "
        f"{balls_volume(scene, radius) / room.volume:.4g}"
    )


def place_balls(
    scene: Scene, radius: Floats, room: VolumeBox, random: np.random.Generator, wide: Floats | None = None
) -> Floats:
    """Return places (3, N) of balls of these radii, uniform where they overlap nothing, one after the other.

    The largest come first: a place for them is rare among the small ones. `wide` are their radii for walls, if they
    differ.

    Raises:
        SceneError: no place was found for some of them.
    """
    cells = empty_cells(room.low.ravel(), room.high.ravel(), scene.period, radius)
    waiting, done = order_of(radius), np.zeros(radius.size, np.bool_)
    wide = radius if wide is None else wide
    tried, fitting, share = 0, 0, 1.0
    vacant: Vacant | None = None
    while waiting.size:
        # Balls of about one size come before smaller ones.
        some = waiting[:_WINDOW][radius[waiting[:_WINDOW]] >= _ALIKE * radius[waiting[0]]]
        least = some[-1]
        if vacant is not None and radius[least] < vacant.radius:
            vacant = None
        # If at least as many places would be tried as there are to search
        if share < _RARE and some.size / share > _SEARCHED * (radius.size if vacant is None else len(vacant)):
            vacant = _searched(scene, cells, room, (float(radius[least]), float(wide[some].min())), vacant)
        if (vacant is not None and not len(vacant)) or tried > _ALWAYS + _TRIES * radius.size:
            raise _full(scene, radius, room, done, tried, fitting)
        numbers = np.resize(some, max(_LEAST, min(_MOST, int(2.0 * some.size / share))))
        n = numbers.size
        points = _points(scene, room, n, random) if vacant is None else vacant.points(n, random)
        within = _enter(scene, cells, points, numbers, done, wide)
        tried, fitting, waiting = tried + n, fitting + within, waiting[~done[waiting]]
        share = max(within / n, 1e-6)
    return np.ascontiguousarray(cells.position)


def _searched(
    scene: Scene, cells: CellLists, room: VolumeBox, sizes: tuple[float, float], vacant: Vacant | None
) -> Vacant:
    """Return the boxes where balls of this radius, for others and for walls, may still be."""
    if vacant is None:
        return Vacant(scene, cells, room.low, room.high, *sizes)
    vacant.refine()
    return vacant


def _points(scene: Scene, room: VolumeBox, n: int, random: np.random.Generator) -> Floats:
    points, axes = np.zeros((3, n)), scene.axes()
    points[axes] = room.low[axes] + (room.high - room.low)[axes] * random.random((len(axes), n))
    return points


def _enter(
    scene: Scene, cells: CellLists, points: Floats, numbers: NDArray[np.int64], done: NDArray[np.bool_], wide: Floats
) -> int:
    """Enter balls with these numbers where they overlap nothing; return the number of places within the walls."""
    # With many balls most places overlap one, which is faster to test than the walls.
    radius: Floats = cells.radius[numbers]  # type: ignore[assignment]
    free = np.flatnonzero(find_free(cells, points, radius)) if done.any() else np.arange(numbers.size)
    free = free[admits(scene, points[:, free], wide[numbers[free]])]
    enter_free(cells, points[:, free], numbers[free], done)
    return int(free.size)


def admits(scene: Scene, points: Floats, radius: Floats) -> NDArray[np.bool_]:
    """Return whether balls at points (3, N) are within the walls."""
    found = scene.admits(points)
    if scene.surfaces:
        found[found] = scene.admits(points[:, found], radius[found])
    return found


def _full(
    scene: Scene, radius: Floats, room: VolumeBox, done: NDArray[np.bool_], tried: int, fitting: int
) -> SceneError:  # fmt: skip
    first = int(order_of(radius)[0])
    if not done.any() and not fitting:
        return SceneError(
            f"radius must leave a place within the walls, got {radius[first]:g} m of particle {first}, for which none "
            f"of {tried} random places is large enough; use smaller balls, or a larger vessel"
        )
    reached = balls_volume(scene, radius[done]) / room.volume
    return SceneError(
        f"fill found places for {int(done.sum())} of {radius.size} balls, a packing of {reached:.4g}, in {tried} "
        f"tries, got {packing_of(scene, radius, room)}; use fewer or smaller balls, or swarm.pack, in a file "
        "the key fraction, which grows them up to 0.6"
    )
