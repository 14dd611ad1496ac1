"""The places at which particles of a source are born, uniform in the area, or the volume, of the source."""

import itertools
import logging
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..common.checks import located
from ..errors import SceneError
from ..kernel.limits import PUT_ON_SURFACE
from ..scene import Scene
from ..state import Floats
from ..surfaces.area_samples import NEAR, AreaSample, Random, Region, points_of
from ..surfaces.facets.mesh import Mesh
from ..surfaces.instant import distances, gaps_of, side_of
from ..surfaces.presence.doors import Opening
from ..surfaces.shapes.plane import Plane
from ..surfaces.surface import Box, Surface, volume_of
from .source import Source

_LOG = logging.getLogger("swarm")
# Points that are tried at a time, so that a longer run has the same first births; fewer among meshes, where the
# nearest triangle of each point is searched. Then the most batches, as long as fewer than one in a million points is
# the place of a birth.
_BATCH, _FEW, _MOST_BATCHES = 1 << 14, 1 << 11, 250
# The progress of the search is logged after this number of batches, and after every doubling of it.
_FIRST_REPORT = 32
# A source with a larger share of the points tried needs no advice: a million births take seconds.
_RARE = 0.01
# Steps that move a point onto its surface.
_STEPS = 3
# The distance from a wall, as a fraction of the extent, at which no other part of a union may be.
_BESIDE = 1e-8


class SourcePlace(NamedTuple):
    """The points of a source in a scene.

    Attributes:
        surface: births are on it, or in its volume.
        number: its number in the scene; None if it is not a surface of the scene.
        volume: whether births are in its volume.
        only: the surfaces with births on their admissible sides.
        walls: the surfaces of its parts with births on them, each with the volumes without births; empty:
            on all of it.
    """

    surface: Surface
    number: int | None
    volume: bool
    only: tuple[Surface, ...]
    walls: tuple[tuple[Surface, tuple[Surface, ...]], ...]


def place_of(scene: Scene, source: Source, name: str) -> SourcePlace:
    """Return the points of a source, as far as they are known without drawing any.

    Raises:
        SceneError: there is no such surface, or it moves, or it comes and goes.
    """
    only = () if source.within is None else (_volume(source.within),)
    where = source.where
    if isinstance(where, int):
        if where >= len(scene.surfaces):
            raise SceneError(
                f"{name}.where must be the number of a surface of the scene, from 0 to {len(scene.surfaces) - 1}, got "
                f"{where}"
            )
        return _of_wall(scene, where, source.volume, only, name)
    for i, surface in enumerate(scene.surfaces):
        if _is_same(surface, where):
            return _of_wall(scene, i, source.volume, only, name)
        if source.volume:
            continue
        # The surfaces of a whole inherit the openings of the whole and of its parts.
        opened = [one for one in surface.surfaces() if any(_is_opening(opening, where) for opening in one.openings)]
        if opened:
            found = _of_wall(scene, i, False, (*only, _volume(where)), name)
            return found._replace(walls=tuple((one, ()) for one in opened))
    if isinstance(where, Opening):
        raise SceneError(f"{name}.where must be one of the openings of the scene's surfaces, got {where!r:.200}")
    _require_at_rest(where, name)
    return SourcePlace(where, None, source.volume, only, ())


def _volume(given: Surface | Opening) -> Surface:
    return given.surface if isinstance(given, Opening) else given


def _is_same(one: Any, other: Any) -> bool:
    if one is other or type(one) is not type(other):
        return one is other
    try:
        return bool(one == other)
    except ValueError:  # of arrays
        return False


def _is_opening(opening: Surface | Opening, where: Any) -> bool:
    """Whether this opening, or its volume through which particles escape, is the place of a source."""
    volume = opening.surface if isinstance(opening, Opening) and not opening.between else None
    return _is_same(opening, where) or (volume is not None and _is_same(volume, where))


def _of_wall(scene: Scene, i: int, volume: bool, only: tuple[Surface, ...], name: str) -> SourcePlace:
    surface = scene.surfaces[i]
    _require_at_rest(surface, f"{name}.where = surfaces[{i}]")
    walls = tuple((one, _holes(one)) for one in surface.surfaces())
    return SourcePlace(surface, i, volume, only, () if volume or not any(holes for _one, holes in walls) else walls)


def _holes(surface: Surface) -> tuple[Surface, ...]:
    """Return the volumes in which a surface is open, except those that only open walls between rooms."""
    return tuple(volume_of(one) for one in surface.openings if not getattr(one, "between", False))


def changes(surface: Surface) -> bool:
    """Whether a surface, or a part of it, moves, or comes and goes."""
    parts = surface.surfaces() if surface.parts else ()
    return surface.motion is not None or surface.reacts() or surface.present is not None or any(map(changes, parts))


def _require_at_rest(surface: Surface, name: str) -> None:
    if changes(surface):
        raise SceneError(
            f"{name} must be at rest and always there, got {surface!r:.200}; leave its motion, mass, inertia and "
            "present out, or let particles come from another surface beside it"
        )


def _bounds_of(surface: Surface) -> Region:
    """Return the corners of a box around the admissible side of a surface."""
    return _arrays(surface.bounds())


def _arrays(box: Box) -> Region:
    low, high = (np.array(corner, np.float64) for corner in box)
    return low, high


def _common(one: Region, other: Region) -> Region:
    return np.maximum(one[0], other[0]), np.minimum(one[1], other[1])


class PointBatches:
    """The points of a source, drawn in batches.

    Args:
        scene: the vessel.
        place: the points of the source.
        name: the name of the source, for errors.
    """

    def __init__(self, scene: Scene, place: SourcePlace, name: str) -> None:
        self._scene, self._place, self._name = scene, place, name
        self._low, self._high = self._box()
        self._extent = max(scene.extent(), place.surface.extent())
        self._require_common_bounds()
        if place.volume:
            self._low, self._high = _common((self._low, self._high), _bounds_of(place.surface))
        self._samples: list[AreaSample] = []
        meshes = any(isinstance(one, Mesh) for one in (place.surface, *scene.surfaces))
        self._batch = _FEW if meshes else _BATCH
        # Walls that move, or come and go, are checked when a particle is born.
        self._lasting = [i for i, one in enumerate(scene.surfaces) if not changes(one)]
        if not place.volume:
            self._samples = self._of_surface()

    def draw(self, random: Random, n: int) -> tuple[Floats, Floats]:
        """Return n points (3, n) and the unit normals (3, n) there, out of the admissible side; in a volume they are 0.

        Raises:
            SceneError: fewer than one in a million of the points tried are admissible.
        """
        found: list[Floats] = []
        count, tried, next_report = 0, 0, _FIRST_REPORT * self._batch
        while count < n:
            some = self._volume(random) if self._place.volume else self._surface(random)
            found.append(some[:, : n - count])
            count, tried = count + found[-1].shape[1], tried + self._batch
            if tried >= _MOST_BATCHES * self._batch and count < 1e-6 * tried:
                raise SceneError(self._sentence(count, tried))
            if tried >= next_report and count < min(n, _RARE * tried):
                next_report = 2 * tried
                _LOG.warning(
                    "%s: still looking for places of births, %d of %d found after %d points tried on its wall or in "
                    "its volume, of which few are in the source; give a smaller where=, or a within= that bounds the "
                    "part of it in the vessel",
                    self._name, count, n, tried,
                )  # fmt: skip
        points, normals = np.concatenate(found, axis=1).reshape(2, 3, n)
        return points, normals

    def _sentence(self, count: int, tried: int) -> str:
        advice = "move it, or make it larger"
        if any(holes for _wall, holes in self._place.walls):
            advice = "births on a wall are outside its openings: for births in an opening give that one as where="
        return f"{self._beginning()}, of which {count} of {tried} points are; {advice}"

    def _beginning(self) -> str:
        within = " and in within=" * bool(self._place.only)
        return f"{self._name}.where must be in the vessel{within}, got {self._place.surface!r:.200}"

    def _require_common_bounds(self) -> None:
        """Raise a SceneError if bounds alone show that no point of the source is in the vessel."""
        surface, low, high = self._place.surface, self._low, self._high
        slack, axes = NEAR * self._extent, self._axes_of_bounds()
        if (apart := low - high > slack)[axes].any():
            raise SceneError(
                f"{self._beginning()}: along {'xyz'[int(np.argmax(apart))]} these two have nothing in common; move one"
            )
        least, most = _bounds_of(surface) if self._place.volume else _arrays(surface.enclosing_box())
        for axis in axes:
            if max(low[axis], least[axis]) - min(high[axis], most[axis]) > slack:
                raise SceneError(
                    f"{self._beginning()}, which is from {least[axis]:.6g} to {most[axis]:.6g} m along {'xyz'[axis]}: "
                    f"births can be from {low[axis]:.6g} to {high[axis]:.6g} m there; move it"
                )
        if isinstance(surface, Plane) and not self._place.volume and np.isfinite(high - low).all():
            phi = surface.phi(np.array(list(itertools.product(*zip(low, high, strict=True)))).T)
            if not (phi.min() <= slack and phi.max() >= -slack) and len(axes) == len(self._scene.axes()):
                raise SceneError(
                    f"{self._beginning()}, which is {np.abs(phi).min():.6g} m or more away from the places where "
                    "births can be; move it"
                )

    def _axes_of_bounds(self) -> list[int]:
        """Return the axes along which bounds count: not where a solid may reach over the faces of a periodic cell."""
        period = self._scene.period or (None, None, None)
        return [axis for axis in self._scene.axes() if period[axis] is None]

    def _box(self) -> tuple[Floats, Floats]:
        """Return the corners of a box around the part of the vessel in which births are wanted."""
        scene = self._scene
        at_rest = [one for one in scene.surfaces if not changes(one)]
        low, high = scene.bounds_of(at_rest)
        for one in self._place.only:
            low, high = _common((low, high), _bounds_of(one))
        if (across := scene.across()) is not None:
            low[across] = high[across] = 0.0
        return low, high

    def _of_surface(self) -> list[AreaSample]:
        scene, surface = self._scene, self._place.surface
        bounds = self._low, self._high
        if scene.period is not None and surface.is_solid():
            # The surface may reach over the faces.
            bounds = np.full(3, -2.0 * self._extent), np.full(3, 2.0 * self._extent)
        try:
            samples = surface.area_samples(bounds, scene.across())
        except SceneError as error:
            raise SceneError(located(self._name, error)) from None
        if not sum(one.area for one in samples) > 0.0:
            raise SceneError(self._sentence(0, 0))
        return samples

    # --- Batches ---

    def _volume(self, random: Random) -> Floats:
        axes, low, high = self._scene.axes(), self._low[:, None], self._high[:, None]
        if not np.isfinite(high - low)[axes].all():
            raise SceneError(
                f"{self._name}.where must be bounded, got {self._place.surface!r:.200} in a scene that is open to "
                "infinity; give within=, a surface that bounds the part of it in which particles come"
            )
        points = np.zeros((3, self._batch))
        points[axes] = low[axes] + (high - low)[axes] * random.random((len(axes), self._batch))
        kept = (self._gap(self._place.surface, points) <= 0.0) & self._is_wanted(points)
        points = points[:, kept]
        points = points[:, self._admits(points, 0.0)]
        return np.concatenate([points, np.zeros_like(points)])

    def _surface(self, random: Random) -> Floats:
        surface, points = self._place.surface, points_of(self._samples, random, self._batch)
        # Triangles are exact already, and the search for the nearest of many is expensive.
        if not isinstance(surface, Mesh):
            # Without points that another part cuts off
            points = points[:, np.abs(distances(surface, points)) <= NEAR * self._extent]
            points = self._on(surface, points)
            points = points[:, np.abs(distances(surface, points)) <= PUT_ON_SURFACE * self._extent]
        points = points[:, self._is_wanted(points)]
        points = points[:, self._is_on_walls(points)]
        normals = self._normals(surface, points)
        if surface.parts:
            once = self._is_wall_once(surface, points, normals, random)
            points, normals = points[:, once], normals[:, once]
        if self._scene.period is not None:
            points, _image = self._scene.wrapped(points)
        return np.concatenate([points, normals])[:, self._admits(points, PUT_ON_SURFACE * self._extent)]

    def _is_on_walls(self, points: Floats) -> NDArray[np.bool_]:
        """Return which points of the surface are on one of its walls that is not open there."""
        walls = self._place.walls
        found = np.full(points.shape[1], not walls)
        for surface, holes in walls:
            here = np.ones(points.shape[1], np.bool_)
            if self._place.surface.parts:
                here = np.abs(distances(surface, points)) <= PUT_ON_SURFACE * self._extent
            for hole in holes:
                here &= self._gap(hole, points) > 0.0
            found |= here
        return found

    def _is_wall_once(self, surface: Surface, points: Floats, normals: Floats, random: Random) -> NDArray[np.bool_]:
        """Return which points of a union to keep: on its walls, not where parts touch, and as often as of one part."""
        beyond = self._gap(surface, points + _BESIDE * self._extent * normals) > 0.0
        parts = dict.fromkeys(surface.surfaces())
        near = [np.abs(distances(part, points)) <= PUT_ON_SURFACE * self._extent for part in parts]
        return np.asarray(beyond & (random.random(points.shape[1]) * np.sum(near, axis=0) < 1.0))

    def _on(self, surface: Surface, points: Floats) -> Floats:
        """Move points near a surface onto it; return them."""
        for _ in range(_STEPS):
            slopes = surface.gradient(points)
            with np.errstate(all="ignore"):
                points = points - surface.phi(points) / np.maximum((slopes**2).sum(axis=0), 1e-300) * slopes
        return points

    def _is_wanted(self, points: Floats) -> NDArray[np.bool_]:
        wanted = np.ones(points.shape[1], np.bool_)
        for one in self._place.only:
            wanted &= self._gap(one, points) <= 0.0
        return wanted

    def _admits(self, points: Floats, distance: float) -> NDArray[np.bool_]:
        """Return which points are inside all walls at rest, to within `distance` [m]."""
        admitted = np.ones(points.shape[1], np.bool_)
        if points.shape[1] and self._lasting:
            outside = self._scene.outside(points, distance)
            if len(self._lasting) < len(self._scene.surfaces) and outside.size:
                far = self._scene.distances_outside(points[:, outside])[self._lasting] > distance
                outside = outside[far.any(axis=0)]
            admitted[outside] = False
        return admitted

    @staticmethod
    def _gap(surface: Surface, points: Floats) -> Floats:
        """Return the gaps, infinite where phi is NaN: such points are no places."""
        found = gaps_of((surface,), points, 0.0)[0]
        return np.asarray(np.where(np.isnan(found), np.inf, found))

    @staticmethod
    def _normals(surface: Surface, points: Floats) -> Floats:
        slopes = side_of(surface) * surface.gradient(points)
        return np.asarray(slopes / np.sqrt((slopes**2).sum(axis=0)))
