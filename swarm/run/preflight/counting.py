"""The counters of a run: their checks against the scene, and the record that kernels take."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...kernel.vector import vec
from ...lanes.watching.counters import Counters
from ...particles import Particles
from ...scene import Scene
from ...state import CROSSED, Crossed
from ...surfaces.counted import Counted, ReversedCounter, Walled
from ...surfaces.counter import Counter
from ...surfaces.facets.mesh import Mesh
from ...surfaces.instant import distances_of
from ...surfaces.part import other_side
from ...surfaces.periodic.images import images_of
from ...surfaces.presence.openings import volumes_in, volumes_of_counter
from ...surfaces.shapes.sphere import ball
from ...surfaces.surface import Surface
from ...surfaces.union import Union
from ..options import RunOptions

# The round-off relative to the size of a scene and of a counter: rooms that touch are three times 1e-13 apart.
_NEAR = 1e-12
# The part by which a ball is larger than the box in it.
_ROOM = 1e-9
# The most walls of all counters: each is compiled into the kernels.
_MOST = 24
# The most cells that a particle may come through in a frame: this takes seconds.
_MOST_CELLS = 1e7
# The number of particles with sides that are found together.
_AT_ONCE = 65_536


def require_counters(scene: Scene, particles: Particles, options: RunOptions) -> None:
    """Raise a `SceneError` if a surface cannot be a counter in this scene, or may be crossed too often."""
    if options.counters:
        counters_of(scene, options.counters)
        _require_few_cells(scene, particles, options)


def require_compiled(scene: Scene, options: RunOptions) -> None:
    """Raise a `SceneError` if a surface of a run, or of a counter, cannot be compiled."""
    if options.compile != "never":
        counters = [one for counter in options.counters for one in (counter.surface, counter.inside) if one is not None]
        for surface in [*scene.surfaces, *scene.pieces.open_volumes(), *counters]:
            surface.require_compiled()


def _require_few_cells(scene: Scene, particles: Particles, options: RunOptions) -> None:
    """Raise a `SceneError` if a flight may cross counters in too many cells in a frame."""
    every = options.times.every
    assert every is not None
    for k, length in enumerate(scene.period or ()):
        pull = 0.0 if scene.gravity is None else abs(scene.gravity[k])
        fastest = particles.fastest() + pull * options.times.until
        if length is not None and not fastest * every / length <= _MOST_CELLS:
            raise SceneError(
                f"period[{k}] must be so long that particles come through at most {_MOST_CELLS:g} cells a frame in a "
                f"run with counters, which are in each cell, got {length:g} m for {fastest * every / length:.3g} "
                "cells; give a longer period, or more frames (every)"
            )


def counters_of(scene: Scene, given: tuple[Counter, ...], logs: bool = False) -> Counters | None:
    """Return the records of the counters for kernels, or None without counters; `logs`: their crossings are logged.

    `logs` is also true for crossings by steps, which are counted one by one.

    Raises:
        SceneError: a surface cannot be a counter in this scene.
    """
    if not given:
        return None
    walls = sum(len(one.surface.walls()) for one in given if not one.surface.is_field)
    if walls > _MOST:
        raise SceneError(
            f"counters must have at most {_MOST} walls in all, got {walls}: each is compiled into the kernels; use one "
            "surface of many bodies, such as swarm.Spheres, in place of many of one kind"
        )
    quiet = 0.0 if scene.period is None and not logs else None
    each = tuple(_counted(scene, f"counters[{k}]", one) for k, one in enumerate(given))
    return Counters(each, scene.pull(), quiet)


def _counted(scene: Scene, name: str, counter: Counter) -> Counted:
    _require_no_mesh(name, counter.surface, "count on")
    if counter.inside is not None:
        _require_no_mesh(f"{name}.inside", counter.inside, "use")
    surface = _whole(scene, name, counter.surface)
    extent = surface.extent()
    near = _NEAR * max(scene.finite_size(), scene.extent(), extent if math.isfinite(extent) else 0.0)
    volumes = None
    if counter.inside is not None:
        volumes = volumes_in(volumes_of_counter(counter.inside, scene.period, f"{name}.inside"))
    if (wall := _one_wall(surface)) is not None:
        return ReversedCounter(wall, near, volumes)
    try:
        other = other_side(surface)
    except SceneError:
        raise SceneError(f"{name} must be a surface with two sides, got {surface!r:.200}; count on another") from None
    inner, outer = (_alone(scene, name, one).compiled().walls() for one in (surface, other))
    return Walled(inner, outer, near, volumes, _ball_around(surface, other, near))


def _ball_around(*given: Any) -> Any:
    """Return a solid ball around the bounded side of a surface, or None."""
    *sides, near = given
    for one in sides:
        low, high = (np.array(corner) for corner in one.enclosing_box())
        if np.isfinite([low, high]).all():
            radius = (1.0 + _ROOM) * float(np.linalg.norm(high - low)) / 2.0 + near
            return ball(vec(((low + high) / 2.0).tolist()), radius)
    return None


def _require_no_mesh(name: str, surface: Surface, verb: str) -> None:
    """Raise a `SceneError` for exact triangles, from which kernels cannot compute the distance of a place."""
    if any(isinstance(one, Mesh) for one in surface.surfaces()):
        raise SceneError(
            f"{name} must not be of a Mesh, which is known at its triangles only, got {surface!r:.200}; {verb} "
            "swarm.from_mesh(path, spacing) instead"
        )


def _alone(scene: Scene, name: str, surface: Surface) -> Scene:
    """Return the scene with only a counter."""
    try:
        return Scene([surface], scene.gravity, plane=scene.plane)
    except SceneError as error:
        raise SceneError(str(error).replace("surfaces[0]", name)) from None


def _whole(scene: Scene, name: str, surface: Surface) -> Surface:
    """Return the surface, in a periodic scene with its images that reach into the cell."""
    period, side = scene.period, getattr(surface, "side", None)
    if period is None or side is None or surface.face_noun:
        return surface
    solid = surface if side == "outside" else other_side(surface)
    try:
        images = images_of(solid, period, name)
    except SceneError:
        if all(map(math.isfinite, np.ravel(other_side(solid).bounds()))):
            raise
        # The part of an unbounded surface in the cell counts.
        return surface
    if len(images) == 1:
        return images[0] if side == "outside" else other_side(images[0])
    return Union([other_side(image) for image in images], side=side)


def _one_wall(surface: Surface) -> Any:
    """Return the wall of a surface if its two sides differ only by the sign, else None."""
    walls = () if surface.is_field else surface.walls()
    return walls[0].reversible() if len(walls) == 1 else None


# --- Arrays ----------------------------------------------------------------------------------------------


class Counting:
    """The counters of a run, and their arrays.

    Args:
        scene, given: the scene, and its counters.
        logs: as in `counters_of`.

    Attributes:
        counters: the records of the counters for kernels, or None without counters.
    """

    def __init__(self, scene: Scene, given: tuple[Counter, ...], logs: bool = True) -> None:
        self._scene, self._given, self.counters = scene, given, counters_of(scene, given, logs)

    def crossed(self, position: NDArray[Any]) -> Crossed | None:
        """Return the arrays of counters for particles that begin at these places, or None without counters."""
        rows, n = 2 * len(self._given), position.shape[1]
        if self.counters is None:
            return None
        return Crossed(self._sides(position), np.zeros((rows, n), np.int64), np.zeros((CROSSED * rows, n)))

    def begin(self, crossed: Crossed | None, some: Any, position: NDArray[Any]) -> None:
        """Set the side of each counter on which the particles with the numbers `some` begin, at these places."""
        if crossed is not None:
            crossed.side[:, some] = self._sides(position)

    def _sides(self, position: NDArray[Any]) -> NDArray[np.int8]:
        """Return whether each particle is outside of each counter; on a counter it is on the admissible side."""
        assert self.counters is not None
        n = position.shape[1]
        side = np.zeros((len(self._given), n), np.int8)
        for k, (one, counter) in enumerate(zip(self.counters.each, self._given, strict=True)):
            surface = _whole(self._scene, f"counters[{k}]", counter.surface)
            for first in range(0, n, _AT_ONCE):
                some = slice(first, first + _AT_ONCE)
                side[k, some] = distances_of((surface,), position[:, some], 0.0)[0] > one.near
        return side
