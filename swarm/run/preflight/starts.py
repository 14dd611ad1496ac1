"""The check that particles start inside their walls, and its error: where, how far outside, how to mend it."""

import math

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...kernel.limits import START_ON_WALL
from ...particles import Particles
from ...scene import Scene
from ...surfaces.instant import box_of, gaps_of, gradient_of
from ...surfaces.shapes.plane import Plane
from ...surfaces.surface import Surface, named

# The steps along the gradient in which the way to a wall is found; the step from a point without a gradient, as a part
# of the size of the scene.
_WAYS, _NUDGE = 60, 1e-3
# The last step of a way that has come to the wall, as a part of its length.
_ARRIVED = 1e-6
# The particles on which a remedy is tried.
_LOOKED_AT = 1000

Places = NDArray[np.float64]


def require_inside(scene: Scene, particles: Particles, depths: Places | None = None) -> None:
    """Raise a `SceneError` if a particle is outside of a wall by more than round-off, or of a soft wall by `depths`.

    `depths` are the largest gaps, (N,).
    """
    # The magnitude of positions sets the round-off of a position on a wall.
    magnitude = max(float(particles.position.max()), -float(particles.position.min()), scene.finite_size())
    outside = scene.outside(particles.position, START_ON_WALL * magnitude)
    if outside.size and depths is not None:
        outside = outside[~(scene.gaps(particles.position[:, outside]) <= depths[outside]).all(axis=0)]
    if outside.size:
        raise error_of(scene, particles, outside, scene.distances_outside(particles.position[:, outside]))


def error_of(scene: Scene, particles: Particles, outside: NDArray[np.intp], distances: Places) -> SceneError:
    """Return the error about particles outside of their walls.

    Args:
        scene: the walls.
        particles: all particles at the start.
        outside: the numbers of the particles outside, (K,).
        distances: how far these are outside of every surface, (surfaces, K) [m].
    """
    position = particles.position
    # A particle at which phi is NaN is outside.
    walls = np.argmax(np.where(np.isnan(distances), np.inf, distances), axis=0)
    first, wall = int(outside[0]), int(walls[0])
    met, counts = np.unique(walls, return_counts=True)
    wall_counts = zip(met.tolist(), counts.tolist(), strict=True)
    several = "" if len(met) == 1 else f" ({', '.join(f'surfaces[{i}]: {count}' for i, count in wall_counts)})"
    place = position[:, first : first + 1]
    where = f"{tuple(place[:, 0].tolist())}, "
    if particles.radius is None:
        where += f"{_how_far(scene, wall, place)} {_named(scene, wall)}"
    else:
        radius, depth = particles.radius[first], distances[wall, 0]
        where += f"and its radius of {radius:g} m reaches {depth:.6g} m beyond {_named(scene, wall)}"
    most = int(met[np.argmax(counts)])
    mend = _mend(scene, most, position, int(counts.max()))
    error = SceneError(
        f"particles must start inside their walls, got {outside.size} of {len(particles)} outside{several}; the first "
        f"is particle {first} at {where}: {_admissible(scene.surfaces[wall], place)}; {mend}"
    )
    error.particle = first
    return error


def _named(scene: Scene, wall: int) -> str:
    surface = scene.surfaces[wall]
    return named(wall, surface) + ("" if surface.motion is None else ", as it is at 0 s")


def _how_far(scene: Scene, wall: int, place: Places) -> str:
    """Return how far a point is on the wrong side, in words."""
    surface = scene.surfaces[wall]
    side = surface.beyond()
    distance = _distance(scene, wall, place)
    return f"{side}" if math.isnan(distance) else f"{distance:.3g} m {side}"


def _distance(scene: Scene, wall: int, place: Places) -> float:
    """Estimate the distance of a point from a wall along the gradient [m]; NaN if no way leads there."""
    first = abs(float(scene.distances_outside(place)[wall, 0]))
    first = first if first < scene.extent() else math.nan
    if scene.period is not None:
        return first
    images, step = (scene.surfaces[wall],), _NUDGE * scene.finite_size()
    r = place.copy()
    with np.errstate(all="ignore"):
        for _way in range(_WAYS):
            gap, slope = float(gaps_of(images, r, 0.0)[0, 0]), gradient_of(images, r)
            steep = float((slope**2).sum())
            # The middle of a surface has no gradient, and so no way out.
            move = -gap / steep * slope if steep > 0.0 else np.array([[0.48], [0.6], [0.64]]) * step
            r = r + move
            gone = float(np.sqrt(((r - place) ** 2).sum()))
            if steep > 0.0 and np.sqrt((move**2).sum()) <= _ARRIVED * gone:
                return gone
    return first


def _admissible(surface: Surface, place: Places) -> str:
    """Return the text on the admissible side of a surface, and its phi at a point."""
    phi = float(surface.phi(place)[0])
    if math.isnan(phi):
        return "its phi is not a number there"
    return surface.admissible(phi)


def _mend(scene: Scene, wall: int, position: Places, outside: int) -> str:
    """Return the likely remedy, tried on particles: another place or side of the wall, else other particles."""
    surface, total = scene.surfaces[wall], position.shape[1]
    some = position[:, :: max(1, total // _LOOKED_AT)]
    if total > 1 and (center := _center_around(surface, some)) is not None:
        return f"give that surface center = {center}, which holds all of them, or move the particles"
    if 2 * outside > total and (flip := _other_side(scene, wall)):
        return f"give that surface {flip}, if its other side is meant, or move the particles"
    these = "it" if outside == 1 else "them"
    return f"move {these}, or let swarm.fill place all"


def _center_around(surface: Surface, position: Places) -> tuple[float, ...] | None:
    """Return the centre with which a cavity holds all particles; None if no shift does, or no shift is possible."""
    if surface.is_solid() or not hasattr(surface, "center") or surface.motion is not None:
        return None
    box = np.array(box_of(surface, 0.0))
    if not np.isfinite(box).all():
        return None
    shift = 0.5 * (position.min(axis=1) + position.max(axis=1)) - box.mean(axis=0)
    shift = np.array([float(f"{x:.3g}") for x in shift])
    moved = surface.shifted(tuple(shift.tolist()))
    if (gaps_of((moved,), position, 0.0) <= 0.0).all():
        return tuple(round(float(x), 12) for x in moved.center)  # type: ignore[attr-defined]
    return None


def _other_side(scene: Scene, wall: int) -> str | None:
    """Return the text that makes the other side of a surface admissible; None if that would leave the scene open."""
    surface = scene.surfaces[wall]
    if isinstance(surface, Plane):
        normal = tuple(0.0 - x for x in surface.normal)
        return f"the reversed normal, normal = {normal} and offset = {0.0 - surface.offset:g}"
    if surface.is_field or not hasattr(surface, "side"):
        return None
    if surface.is_solid():
        return 'side = "inside"'
    others = [one for i, one in enumerate(scene.surfaces) if i != wall]
    return 'side = "outside"' if others and np.isfinite(scene.bounds_of(others)).all() else None
