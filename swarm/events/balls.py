"""Checks of balls before a run starts."""

import numpy as np

from ..errors import SceneError
from ..grains.matter import require_soft_balls
from ..methods.base import Method
from ..pairs import MOST_PRESSED
from ..particles import Particles
from ..placing.cells import overlaps_of
from ..placing.fitting_shapes import require_shapes
from ..placing.sequential import require_size
from ..run.preflight.starts import error_of
from ..scene import Scene
from ..state import Floats
from ..surfaces.rotation import normalized
from ..surfaces.surface import shown

# Balls may overlap at the start by round-off of their places: by this factor times the largest coordinate.
_ROUND_OFF = 64.0 * np.finfo(np.float64).eps
# Balls that touch walls are moved by the part `_MOVED` of that coordinate, to find the walls that stop them; `_STEP` is
# the relative step of the differences of their distances.
_MOVED, _STEP = 1e-6, 1e-7
# Walls face each other if the cosine of the angle between their normals is less than this above -1.
_FACING = 1e-6


def require_balls(scene: Scene, particles: Particles, method: Method) -> None:
    """Raise a `SceneError` if balls do not fit the scene, the cell or the steps.

    Balls without a spin get a spin of 0 where contacts turn them. Only friction of pairs turns rigid balls without a
    spin: walls act on them as on points.
    """
    assert particles.radius is not None
    require_shapes(scene, particles.radius)
    require_size(scene, particles.radius)
    _require_cell(scene, particles, method)
    require_soft_balls(scene, particles, method)
    if particles.spin is None and _may_turn(scene, method):
        particles.spin = np.zeros_like(particles.position)


def _may_turn(scene: Scene, method: Method) -> bool:
    parts = (one for whole in scene.surfaces for one in (whole, *whole.surfaces()))
    rough_walls = not method.is_rigid() and any(one.friction for one in parts)
    return rough_walls or (scene.pairs is not None and scene.pairs.friction > 0.0)


def _require_cell(scene: Scene, particles: Particles, method: Method) -> None:
    """Raise a `SceneError` where a rigid ball could meet two images of another ball."""
    largest = 2.0 * float(particles.radius.max())  # type: ignore[union-attr]
    for k, length in enumerate(scene.period or () if method.is_rigid() else ()):
        if length is not None and length < 2.0 * largest:
            raise SceneError(
                f"period[{k}] must be two diameters of the largest particle or more, {2.0 * largest:g} m, got "
                f"{length:g}; give a longer period, or smaller particles"
            )


def require_apart(scene: Scene, particles: Particles, method: Method) -> None:
    """Raise a `SceneError` if balls overlap one another, or are outside their walls, at the start."""
    radius = particles.radius
    assert radius is not None
    magnitude = max(float(np.abs(particles.position).max()), scene.finite_size())
    if scene.surfaces:
        _require_within(scene, particles, radius, _ROUND_OFF * magnitude, method.is_rigid())
        if method.is_rigid() and not scene.moves():
            _require_room(scene, particles, magnitude)
    found = overlaps_of(particles.position, radius, scene.period)
    if found is None:
        return
    i, k = found.pair
    smaller = min(radius[i], radius[k])
    if found.depth <= (_ROUND_OFF * magnitude if method.is_rigid() else MOST_PRESSED * smaller):
        return
    pressed = "" if method.is_rigid() else f" (soft balls may by {MOST_PRESSED:g} of the smaller radius)"
    overlap = "1 pair that overlaps" if found.number == 1 else f"{found.number} pairs that overlap"
    raise SceneError(
        f"particles must not overlap at the start{pressed}, got {overlap}, particles {i} and {k} the most, by "
        f"{found.depth:.6g} m: their centres are {radius[i] + radius[k] - found.depth:.6g} m apart, their "
        f"radii {radius[i]:g} and {radius[k]:g} m; move them apart, or let swarm.fill or swarm.pack place them"
    )


def _require_within(scene: Scene, particles: Particles, radius: np.ndarray, close: float, is_rigid: bool) -> None:
    distances = scene.distances_outside(particles.position, 0.0, radius)
    # A ball at which phi is NaN is outside.
    wrong = ~(distances <= (close if is_rigid else close + MOST_PRESSED * radius))
    outside = np.flatnonzero(wrong.any(axis=0))
    if not outside.size:
        return
    raise error_of(scene, particles, outside, distances[:, outside])


def _require_room(scene: Scene, particles: Particles, magnitude: float) -> None:
    """Raise a `SceneError` where a ball that fills the gap between facing walls moves across it: that takes no time."""
    assert particles.radius is not None
    place, radius = particles.position, particles.radius
    touches = (scene.distances_outside(place, 0.0, radius) >= -_ROUND_OFF * magnitude).any(axis=0)
    pulls = None if scene.gravity is None else np.repeat(np.array(scene.gravity)[:, None], len(particles), axis=1)
    for across, verb, unit in ((particles.velocity, "moves", "m/s"), (pulls, "falls", "m/s^2")):
        moving = touches if across is None else touches & (np.abs(across).max(axis=0) > 0.0)
        if across is None or not moving.any():
            continue
        some = np.flatnonzero(moving)
        way = normalized(across[:, some] / np.abs(across[:, some]).max(axis=0))
        ends = [_kept(scene, place[:, some] + sign * _MOVED * magnitude * way, radius[some]) for sign in (1.0, -1.0)]
        (outside, normal), (behind, other) = ends
        stuck = (np.minimum(outside, behind) > _ROUND_OFF * magnitude) & ((normal * other).sum(axis=0) < _FACING - 1.0)
        if not stuck.any():
            continue
        k = int(np.argmax(stuck))
        i = int(some[k])
        error = SceneError(
            f"particles must have room between facing walls, got {int(stuck.sum())} without; the first is particle {i} "
            f"at {shown(place[:, i])}, which is as wide as the gap that it is in, radius {radius[i]:g} m, and {verb} "
            f"across it with {abs(float(across[:, i] @ normal[:, k])):.3g} {unit}: no time would pass between its "
            "impacts; use a smaller radius, or let it move along the walls only"
        )
        error.particle = i
        raise error


def _kept(scene: Scene, place: Floats, radius: Floats) -> tuple[Floats, Floats]:
    """Return how far balls at places (3, N) are outside of the walls [m], and the unit normals of these walls."""
    distance = scene.distances_outside(place, 0.0, radius)
    wall, each = distance.argmax(axis=0), np.arange(place.shape[1])
    step = _STEP * max(float(np.abs(place).max()), float(radius.max()))
    slopes = np.zeros(place.shape)
    for k in scene.axes():
        move = np.zeros((3, 1))
        move[k] = step
        ends = [scene.distances_outside(place + way * move, 0.0, radius)[wall, each] for way in (1.0, -1.0)]
        slopes[k] = ends[0] - ends[1]
    return distance[wall, each], normalized(slopes)
