"""The volume that surfaces enclose: what is inside of it, how large it is, where it is open."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import checks
from . import motion as motions
from .particles import Particles
from .plane import across_of
from .surfaces.facets.mesh import Mesh
from .surfaces.fields.many import Many
from .surfaces.images import Lengths, cell_of, images_of, into_cell
from .surfaces.instant import box_of, gaps_of, gradient_of, has_room, planes_of
from .surfaces.polyhedron import polyhedron_bounds
from .surfaces.surface import UNBOUNDED, Box, Surface

# Points whose gaps are found at once.
_BATCH = 4096
# A slot thinner than this part of the scene's extent is none of its lengths: steps that are a part of it end in the
# round-off of a time.
_THIN = 1e-6
# Planes nearer to the origin than an atom's nucleus is wide [m] are at it: a scene of them has no extent.
_AT_ORIGIN = 1e-15


class Volume:
    """The volume of a `Scene`, which is the intersection of the admissible sides of its surfaces."""

    surfaces: tuple[Surface, ...]
    gravity: checks.Vector | None
    period: Lengths | None
    plane: str | None
    # Of every surface what of it reaches into the cell: itself alone where nothing repeats.
    _images: tuple[tuple[Surface, ...], ...]

    def size(self) -> float:
        """Characteristic length [m]: of the smallest surface, else of the volume; infinite if that is open."""
        smallest = min((surface.size() for surface in self.surfaces), default=math.inf)
        if math.isfinite(smallest):
            return smallest
        low, high = self.bounds()
        return min(high[k] - low[k] for k in self.axes()) / 2.0

    def across(self) -> int | None:
        """The axis across the plane of a scene of two dimensions, None where it has none."""
        return across_of(self.plane)

    def axes(self) -> list[int]:
        """The axes along which particles may move."""
        return [k for k in range(3) if k != self.across()]

    def finite_size(self) -> float:
        """`size`, or the extent of the surfaces where the volume is open, or too thin to be a length of the motion."""
        size, extent = self.size(), self.extent()
        return size if _THIN * extent < size < math.inf else extent

    def wrapped(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Points (3, N) in the cell, and how many cells away they were (3, N); 0 where it does not repeat."""
        return into_cell(self.period or (None, None, None), checks.array("points", points))

    def unwrapped(self, particles: Particles) -> NDArray[np.float64]:
        """Places of particles (3, N), with all cells that they have come through: position + image * period."""
        if self.period is None or particles.image is None:
            return np.array(particles.position)
        lengths = np.array([length or 0.0 for length in self.period])
        return np.asarray(particles.position + particles.image * lengths[:, None])

    def gaps(
        self, points: ArrayLike, time: float = 0.0, radius: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Signed gap of every surface at points (3, N) and a time [s], shape (surfaces, N); admissible is <= 0.

        That of a surface that is not there then is minus infinity. With a radius (N,) points are the centres of balls.
        """
        if radius is not None:
            return self.distances_outside(points, time, radius)
        rows = checks.array("points", points)
        if self.period is not None:
            rows, _image = into_cell(self.period, rows)
        away = np.full(np.shape(rows)[1:], -math.inf)
        each = zip(self.surfaces, self._images, strict=True)
        found = [gaps_of(images, rows, time).max(axis=0) if one.is_there(time) else away for one, images in each]
        return np.array(found).reshape(len(found), *away.shape)

    def admits(self, points: NDArray[np.float64], radius: NDArray[np.float64] | None = None) -> NDArray[np.bool_]:
        """Whether each of the points (3, N) is admissible at time 0; where phi is not a number it is not.

        With a radius (N,) points are the centres of balls.
        """
        if radius is not None:
            return np.asarray((self.distances_outside(points, 0.0, radius) <= 0.0).all(axis=0))
        rows = points if self.period is None else into_cell(self.period, points)[0]
        admitted = np.ones(rows.shape[1], np.bool_)
        for image in (image for images in self._images for image in images if image.is_there(0.0)):
            if isinstance(image, Many):
                admitted[admitted] = image.contain(rows[:, admitted]) == image.is_foam()
            elif isinstance(image, Mesh):
                admitted[admitted] = image.contain(rows[:, admitted])
            else:
                admitted &= gaps_of((image,), rows, 0.0)[0] <= 0.0
        return admitted

    def distances_outside(
        self, points: ArrayLike, time: float = 0.0, radius: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Gap over its gradient of every surface at points (3, N), shape (surfaces, N) [m]; negative inside.

        That of a surface that is not there at this time [s] is minus infinity. With a radius (N,) points are the
        centres of balls: how far they reach outside.
        """
        rows = checks.array("points", points)
        if self.period is not None:
            rows, _image = into_cell(self.period, rows)
        if radius is not None:
            return self._reaching_outside(rows, time, radius)
        found = []
        for surface, images in zip(self.surfaces, self._images, strict=True):
            if not surface.is_there(time):
                found.append(np.full(np.shape(rows)[1:], -math.inf))
                continue
            slopes = [np.sqrt((image.gradient(rows, time) ** 2).sum(axis=0)) for image in images]
            # At the centre of a ball the slope is 0, and a point is as far inside as can be.
            with np.errstate(over="ignore"):
                found.append((gaps_of(images, rows, time) / np.maximum(slopes, np.finfo(np.float64).tiny)).max(axis=0))
        return np.array(found)

    def _reaching_outside(
        self, points: NDArray[np.float64], time: float, radius: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """How far balls at points (3, N), with their radii (N,), reach outside of every surface: (surfaces, N) [m]."""
        away = np.full(points.shape[1], -math.inf)
        images = self._images_of_balls(float(radius.max(initial=0.0)))
        return np.array([
            np.max([one.reaching_outside(points, radius, time) for one in several], axis=0)
            if surface.is_there(time) else away
            for surface, several in zip(self.surfaces, images, strict=True)
        ]).reshape(len(self.surfaces), points.shape[1])  # fmt: skip

    def _images_of_balls(self, largest: float) -> tuple[tuple[Surface, ...], ...]:
        """What of every surface balls in the cell meet, with radii up to the largest one [m]."""
        if self.period is None:
            return self._images
        known: dict[float, tuple[tuple[Surface, ...], ...]] = self.__dict__.setdefault("_images_by_radius", {})
        # Those of larger balls are as right.
        largest = min((one for one in known if one >= largest), default=largest)
        if largest not in known:
            named = [(surface, f"surfaces[{i}]") for i, surface in enumerate(self.surfaces)]
            known[largest] = tuple(tuple(images_of(one, self.period, name, largest)) for one, name in named)
        return known[largest]

    def outside(
        self, points: NDArray[np.float64], distance: float, radius: NDArray[np.float64] | None = None
    ) -> NDArray[np.intp]:
        """Which of the points (3, N) are farther outside than this distance [m], or where phi is not a number.

        With a radius (N,) points are the centres of balls.
        """
        if radius is not None:
            return np.flatnonzero(~(self.distances_outside(points, 0.0, radius) <= distance).all(axis=0))
        found = []
        # In batches, so that NumPy's intermediate results stay in the processor's cache.
        for begin in range(0, points.shape[1], _BATCH):
            batch = points[:, begin : begin + _BATCH]
            suspects = np.flatnonzero(~self.admits(batch))
            if suspects.size:
                near = (self.distances_outside(batch[:, suspects]) <= distance).all(axis=0)
                found.append(begin + suspects[~near])
        return np.concatenate(found) if found else np.empty(0, np.intp)

    def is_open(self) -> bool:
        """Whether a particle may fly to infinity, at the start or as soon as a wall has gone."""
        at_start = np.isfinite(self.bounds()).all()
        return not (at_start and (not self.has_doors() or np.isfinite(self._bounds_of_lasting(self.surfaces)).all()))

    def has_doors(self) -> bool:
        """Whether some walls are present, or some openings open, for some times only."""
        raise NotImplementedError

    def poses(self, time: float) -> list[motions.Pose]:
        """The pose of every surface at a time [s]."""
        return [motions.pose(surface.motion, time) for surface in self.surfaces]

    def open_faces(self, time: float = 0.0) -> NDArray[np.float64]:
        """Open faces through which gravity pulls no particle back: rows (n, offset); n.r > offset is outside."""
        faces = [
            (*n, offset)
            for surface in self.surfaces
            for n, offset in planes_of(surface, surface.open_faces(), time)
            if surface.is_there(time)
        ]
        rows = np.array(faces, dtype=np.float64).reshape(-1, 4)
        # Through a face across the period nobody leaves.
        repeats = np.array([length is not None for length in self.period or (None,) * 3])
        rows = rows[(rows[:, :3][:, repeats] == 0.0).all(axis=1)]
        return np.asarray(rows if self.gravity is None else rows[rows[:, :3] @ self.gravity >= 0.0])

    def bounds(self, time: float = 0.0) -> Box:
        """A box (lower, upper) around the admissible volume at a time [s]; infinite where that is open.

        Across the plane of a scene of two dimensions it has no width.
        """
        low, high = self._bounds(time, [surface for surface in self.surfaces if surface.is_there(time)])
        return tuple(low.tolist()), tuple(high.tolist())

    def bounds_of(self, surfaces: Sequence[Surface]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """As `bounds`, around the volume that some of the surfaces leave, at 0 s."""
        return self._bounds(0.0, surfaces)

    def _bounds_of_lasting(self, surfaces: Sequence[Surface]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """A box around the volume that those of the surfaces leave at the start that are always there."""
        return self._bounds(0.0, [surface for surface in surfaces if surface.present is None])

    def _bounds(self, time: float, surfaces: Sequence[Surface]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """A box around the volume that some of the surfaces leave, and the cell that repeats."""
        boxes = np.array([box_of(surface, time) for surface in surfaces] or [UNBOUNDED])
        low, high = boxes[:, 0].max(axis=0), boxes[:, 1].min(axis=0)
        if self.period is not None:
            corners = np.array(cell_of(self.period))
            low, high = np.maximum(low, corners[0]), np.minimum(high, corners[1])
        planes = [plane for surface in surfaces for plane in planes_of(surface, surface.half_spaces(), time)]
        if planes:
            low, high = polyhedron_bounds(planes, low, high)
        if (across := self.across()) is not None:
            low[across] = high[across] = 0.0
        return low, high

    def _has_volume(self) -> bool:
        low, high = (np.array(corner) for corner in self.bounds())
        if not (low < high)[self.axes()].all():
            return False
        # Open directions are searched as far as the scene itself extends.
        reach = 2.0 * self.extent()
        low, high = np.maximum(low, -reach)[:, None], np.minimum(high, reach)[:, None]
        there = [i for i, surface in enumerate(self.surfaces) if surface.is_there(0.0)]
        return not there or has_room(
            low,
            high,
            lambda points: self.gaps(points)[there],
            lambda i, points: gradient_of(self._images[there[i]], points),
        )

    def extent(self) -> float:
        """Distance from the origin within which the scene's surfaces lie."""
        lengths = [length for length in self.period or () if length is not None]
        farthest = max((*(surface.extent() for surface in self.surfaces), *lengths), default=0.0)
        return farthest if farthest > _AT_ORIGIN else 1.0
