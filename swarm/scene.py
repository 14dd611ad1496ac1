"""The scene: surfaces, gravity, and the volume that the surfaces enclose."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import checks
from . import motion as motions
from .contact.laws import Laws, Moves, Thermal
from .errors import SceneError
from .kernel.gravity import Gravity
from .kernel.vector import Vec
from .particles import Particles
from .surfaces import required
from .surfaces import rotation as rotations
from .surfaces.fold import Chain
from .surfaces.images import Lengths, cell_of, images_of, into_cell, lengths_of
from .surfaces.moving import Carried, carried
from .surfaces.period import Period
from .surfaces.surface import SIDES, Box, HalfSpace, Surface

# Most walls that kernels can be compiled for: 24 with `contact_step` take three minutes, 28 fail.
MOST_WALLS = 24
# The search for an admissible point: number of starts, and moves of each onto the surface that it violates most.
_STARTS = 512
_MOVES = 30
# Then this many of the nearest are moved onto all surfaces that they violate together.
_NEAREST = 32
_STEPS = 100
# Each move aims this far, relative to the gap: a little past the surface, so that thin volumes are hit.
_PAST = 1.05
# Points whose gaps are found at once.
_BATCH = 4096
# Where planes leave the volume open, their polyhedron is cut off at this many times the scene's extent.
_FAR = 1e6
# If that cuts the volume, it is bounded again at this distance, with the round-off of a vertex there.
_FARTHEST, _ROUND_OFF = 1e15, 1e-14
# Determinants of three normals: below the first they meet in a flat corner, below the second in none.
_FLAT, _PARALLEL = 1e-12, 1e-15
# The law of a wall without temperature.
_NO_HEAT = Thermal(0.0, 0.0)
# Triples of planes that are intersected at once.
_TRIPLES = 4096


@dataclass(frozen=True, init=False)
class Scene:
    """Rigid surfaces, whose admissible sides intersect in the volume that holds the particles, and gravity.

    Args:
        surfaces: at least one surface.
        gravity: None, or three numbers (gx, gy, gz) [m/s^2], each at most 1e100.
        period: None, or three lengths (Lx, Ly, Lz) [m] of a cell that repeats without end, None for a direction in
            which it does not: what leaves [0, L) through a face comes back through the other one, and is counted. A
            solid that reaches over a face is there on the other side too; a cavity is within the cell; and any other
            surface is the same all along the period, as a plane or an endless cylinder along it.

    Raises:
        SceneError: no surface, more than 24 walls with their images, surfaces that leave no volume, or one that does
            not go with the period.

    >>> import swarm
    >>> Scene(surfaces=[swarm.Sphere(radius=0.5)], gravity=(0.0, 0.0, -9.81)).size()
    0.5
    """

    surfaces: tuple[Surface, ...]
    gravity: checks.Vector | None
    period: Lengths | None
    # Of every surface what of it reaches into the cell: itself alone where nothing repeats.
    _images: tuple[tuple[Surface, ...], ...] = field(init=False, repr=False, compare=False)

    def __init__(
        self,
        surfaces: Sequence[Surface],
        gravity: Sequence[float] | None = None,
        period: Sequence[float | None] | None = None,
    ) -> None:
        surfaces = (surfaces,) if isinstance(surfaces, Surface) else tuple(surfaces)
        if not surfaces:
            raise SceneError("surfaces must hold at least one surface, got none")
        for i, surface in enumerate(surfaces):
            if not isinstance(surface, Surface):
                raise SceneError(f"surfaces[{i}] must be a surface such as swarm.Sphere, got {surface!r}")
        required.require_description(surfaces)
        pull = None if gravity is None else checks.vector("gravity", gravity)
        for i, part in enumerate(pull or ()):
            checks.magnitude(f"|gravity[{i}]|", abs(part))
        object.__setattr__(self, "surfaces", surfaces)
        object.__setattr__(self, "period", lengths_of(period))
        object.__setattr__(self, "_images", tuple(self._images_of(i) for i in range(len(surfaces))))
        walls = len(self.owners())
        if walls > MOST_WALLS:
            raise SceneError(
                f"surfaces must have at most {MOST_WALLS} walls in all, got {walls} of {len(surfaces)} surfaces: each "
                "wall is compiled into the kernels, and with more the compiler runs out of stack; remove some (a box "
                "has 3 walls, a capped cylinder 2, most others 1)"
            )
        object.__setattr__(self, "gravity", pull if pull is not None and any(pull) else None)
        if not self._has_volume():
            raise SceneError(
                f"surfaces must leave a volume for particles, got {len(surfaces)} surfaces whose admissible sides "
                "have no point in common; check their `side`, and that solids are smaller than their cavity"
            )

    def moves(self) -> bool:
        """Whether a surface moves, or may be moved."""
        return any(surface.motion is not None or surface.reacts() for surface in self.surfaces)

    def reacts(self) -> bool:
        """Whether impacts move a surface."""
        return any(surface.reacts() for surface in self.surfaces)

    def placed(self, positions: ArrayLike, orientations: ArrayLike) -> "Scene":
        """The scene whose walls that react stay where `wall_position` and `wall_orientation` of a frame say."""
        surfaces = list(self.surfaces)
        for i, surface in enumerate(surfaces):
            if surface.reacts():
                turn = tuple(np.array(orientations)[i].tolist())
                rows = tuple(map(tuple, rotations.matrix(turn).tolist()))
                held = motions.Placed(tuple(np.array(positions)[i].tolist()), turn, rows)
                surfaces[i] = replace(surface, mass=None, inertia=None, motion=held)
        return Scene(surfaces, self.gravity, self.period)

    def chain(self, moment: float = 0.0) -> Chain | Carried | None:
        """The surfaces as kernels take them; those that move in the frame that ends at a moment [s]."""
        return carried(tuple(image for images in self._images for image in images), moment)

    def cell(self) -> Period | None:
        """The cell that repeats as kernels take it."""
        if self.period is None:
            return None
        pulls = self.gravity or (0.0, 0.0, 0.0)
        falls = [0.0 if length is None else -pull * length for pull, length in zip(pulls, self.period, strict=True)]
        return Period(*self.period, Vec(*falls) if any(falls) else None)

    def wrapped(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Points (3, N) in the cell, and how many cells away they were (3, N); 0 where it does not repeat."""
        return into_cell(self.period or (None, None, None), checks.array("points", points))

    def unwrapped(self, particles: Particles) -> NDArray[np.float64]:
        """Where particles are (3, N), with all cells that they have come through: position + image * period."""
        if self.period is None or particles.image is None:
            return np.array(particles.position)
        lengths = np.array([length or 0.0 for length in self.period])
        return np.asarray(particles.position + particles.image * lengths[:, None])

    def pull(self) -> Gravity | None:
        """Gravity as kernels take it."""
        return None if self.gravity is None else Gravity(*self.gravity)

    def laws(self) -> Laws | None:
        """The laws of every wall of the chain as kernels take them, None where no surface has one."""
        laws = Laws(
            self._of_walls([surface.restitution for surface in self.surfaces], 1.0),
            self._of_walls([surface.friction for surface in self.surfaces], 0.0),
            self._of_walls([_thermal(surface) for surface in self.surfaces], _NO_HEAT),
            Moves(0.0) if self.moves() else None,
        )
        return None if laws == (None, None, None, None) else laws

    def _of_walls(self, values: list[Any], neutral: Any) -> Chain | None:
        """The value of the owner of every wall as a chain, None where all are neutral."""
        if all(value == neutral for value in values):
            return None
        chain = None
        for i in reversed(self.owners()):
            chain = Chain(values[i], chain)
        return chain

    def owners(self) -> list[int]:
        """The surface that each wall of the chain belongs to."""
        return [i for i, images in enumerate(self._images) for image in images for _wall in image.walls()]

    def size(self) -> float:
        """Characteristic length [m]: of the smallest surface, else of the volume; infinite if that is open."""
        smallest = min(surface.size() for surface in self.surfaces)
        if math.isfinite(smallest):
            return smallest
        low, high = self.bounds()
        return min(b - a for a, b in zip(low, high, strict=True)) / 2.0

    def finite_size(self) -> float:
        """`size`, or the extent of the surfaces where the volume is open."""
        size = self.size()
        return size if math.isfinite(size) else self.extent()

    def gaps(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        """Signed gap of every surface at points (3, N) and a time [s], shape (surfaces, N); admissible is <= 0."""
        rows = checks.array("points", points)
        if self.period is not None:
            rows, _image = into_cell(self.period, rows)
        return np.array([_gaps(images, rows, time).max(axis=0) for images in self._images])

    def distances_outside(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        """Gap over its gradient of every surface at points (3, N), shape (surfaces, N) [m]; negative inside."""
        rows = checks.array("points", points)
        if self.period is not None:
            rows, _image = into_cell(self.period, rows)
        found = []
        for images in self._images:
            slopes = [np.sqrt((image.gradient(rows, time) ** 2).sum(axis=0)) for image in images]
            # At the centre of a ball the slope is 0, and a point is as far inside as can be.
            with np.errstate(over="ignore"):
                found.append((_gaps(images, rows, time) / np.maximum(slopes, np.finfo(np.float64).tiny)).max(axis=0))
        return np.array(found)

    def outside(self, points: NDArray[np.float64], distance: float) -> NDArray[np.intp]:
        """Which of the points (3, N) are farther outside than this distance [m], or where phi is not a number."""
        found = []
        # In batches, so that NumPy's intermediate results stay in the processor's cache.
        for begin in range(0, points.shape[1], _BATCH):
            batch = points[:, begin : begin + _BATCH]
            suspects = np.flatnonzero(~(self.gaps(batch) <= 0.0).all(axis=0))
            if suspects.size:
                near = (self.distances_outside(batch[:, suspects]) <= distance).all(axis=0)
                found.append(begin + suspects[~near])
        return np.concatenate(found) if found else np.empty(0, np.intp)

    def is_open(self) -> bool:
        """Whether a particle may fly to infinity."""
        return not np.isfinite(self.bounds()).all()

    def poses(self, time: float) -> list[motions.Pose]:
        """Where every surface is at a time [s]."""
        return [motions.pose(surface.motion, time) for surface in self.surfaces]

    def open_faces(self, time: float = 0.0) -> NDArray[np.float64]:
        """Open faces through which gravity pulls no particle back: rows (n, offset); n.r > offset is outside."""
        faces = [
            (*n, offset) for surface in self.surfaces for n, offset in _placed(surface, surface.open_faces(), time)
        ]
        rows = np.array(faces, dtype=np.float64).reshape(-1, 4)
        # Through a face across the period nobody leaves.
        repeats = np.array([length is not None for length in self.period or (None,) * 3])
        rows = rows[(rows[:, :3][:, repeats] == 0.0).all(axis=1)]
        return np.asarray(rows if self.gravity is None else rows[rows[:, :3] @ self.gravity >= 0.0])

    def bounds(self, time: float = 0.0) -> Box:
        """A box (lower, upper) around the admissible volume at a time [s]; infinite where that is open."""
        boxes = np.array([_box(surface, time) for surface in self.surfaces])
        low, high = boxes[:, 0].max(axis=0), boxes[:, 1].min(axis=0)
        if self.period is not None:
            corners = np.array(cell_of(self.period))
            low, high = np.maximum(low, corners[0]), np.minimum(high, corners[1])
        planes = [plane for surface in self.surfaces for plane in _placed(surface, surface.half_spaces(), time)]
        if planes:
            low, high = _polyhedron_bounds(planes, low, high)
        return tuple(low.tolist()), tuple(high.tolist())

    def _has_volume(self) -> bool:
        low, high = (np.array(corner) for corner in self.bounds())
        if not (low < high).all():
            return False
        # Open directions are searched as far as the scene itself extends.
        reach = 2.0 * self.extent()
        low, high = np.maximum(low, -reach)[:, None], np.minimum(high, reach)[:, None]
        points = low + (high - low) * np.random.default_rng(0).random((3, _STARTS))
        for _ in range(_MOVES):
            gaps = self.gaps(points)
            if (gaps.max(axis=0) <= 0.0).any():
                return True
            worst = gaps.argmax(axis=0)
            for i, images in enumerate(self._images):
                outside = worst == i
                gradient = _gradient(images, points[:, outside])
                slope = np.maximum((gradient**2).sum(axis=0), np.finfo(np.float64).tiny)
                points[:, outside] -= _PAST * gaps[i, outside] / slope * gradient
        points = points[:, np.argsort(self.gaps(points).max(axis=0))[:_NEAREST]]
        for _ in range(_STEPS):
            # One surface after the other converges slowly along a sharp edge; a Newton step for all near ones does not.
            gradients = np.array([_gradient(images, points) for images in self._images])
            lengths = np.maximum(np.sqrt((gradients**2).sum(axis=1)), np.finfo(np.float64).tiny)
            gaps = self.gaps(points) / lengths
            worst = gaps.max(axis=0)
            if (worst <= 0.0).any():
                return True
            near = gaps > -worst
            normals = (gradients / lengths[:, None] * near[:, None]).transpose(2, 0, 1)
            wanted = ((gaps + (_PAST - 1.0) * worst) * near).T[:, :, None]
            points = points - (np.linalg.pinv(normals) @ wanted)[:, :, 0].T
        return False

    def extent(self) -> float:
        """Distance from the origin within which the scene's surfaces lie."""
        lengths = [length for length in self.period or () if length is not None]
        return max([*(surface.extent() for surface in self.surfaces), *lengths]) or 1.0

    def _images_of(self, i: int) -> tuple[Surface, ...]:
        if self.period is None:
            return (self.surfaces[i],)
        return tuple(images_of(self.surfaces[i], self.period, f"surfaces[{i}]"))


def _gaps(images: Sequence[Surface], points: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """Signed gap of every image of a surface, (images, N)."""
    return np.array([_side(image) * image.phi(points, time) for image in images])


def _gradient(images: Sequence[Surface], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gradient of the gap of the image that has the largest one, (3, N)."""
    gradients = np.array([_side(image) * image.gradient(points) for image in images])
    worst = _gaps(images, points, 0.0).argmax(axis=0) if len(images) > 1 else np.zeros(points.shape[1], np.int64)
    return np.asarray(gradients[worst, :, np.arange(points.shape[1])].T)


def _box(surface: Surface, time: float) -> Box:
    """The bounds of a surface at a time [s]."""
    low, high = (np.array(corner) for corner in surface.bounds())
    if surface.motion is not None:
        found = motions.pose(surface.motion, time)
        if np.array_equal(found.turn, np.eye(3)):
            low, high = low + found.shift, high + found.shift
        elif np.isfinite([low, high]).all():
            middle, half = 0.5 * (low + high), 0.5 * (high - low)
            middle, half = found.placed(middle[:, None])[:, 0], np.abs(found.turn) @ half
            low, high = middle - half, middle + half
        else:
            low, high = np.full(3, -math.inf), np.full(3, math.inf)
    return tuple(low.tolist()), tuple(high.tolist())


def _placed(surface: Surface, planes: list[HalfSpace], time: float) -> list[HalfSpace]:
    """Half-spaces of a surface at a time [s]."""
    if surface.motion is None or not planes:
        return planes
    found = motions.pose(surface.motion, time)
    normals = found.turned(np.array([normal for normal, _offset in planes]).T)
    offsets = np.array([offset for _normal, offset in planes]) + (normals * found.position()[:, None]).sum(axis=0)
    return [(tuple(normal), offset) for normal, offset in zip(normals.T.tolist(), offsets.tolist(), strict=True)]


def _thermal(surface: Surface) -> Thermal:
    if surface.temperature is None:
        return _NO_HEAT
    return Thermal(surface.temperature, surface.accommodation)


def _side(surface: Surface) -> float:
    return SIDES[getattr(surface, "side", "inside")]


def _polyhedron_bounds(planes: list[HalfSpace], low: Any, high: Any) -> tuple[Any, Any]:
    """Bounds of the half-spaces' intersection with a box, from its vertices."""
    finite = [abs(v) for v in (*low, *high) if math.isfinite(v)] + [abs(offset) for _normal, offset in planes]
    scale = max(finite, default=0.0) or 1.0
    new_low, new_high, is_open, is_flat = _closed_bounds(planes, low, high, _FAR * scale, _FLAT, 1e-9)
    if not (is_open or is_flat):
        return new_low, new_high
    far_low, far_high, is_open, _is_flat = _closed_bounds(planes, low, high, _FARTHEST * scale, 0.0, _ROUND_OFF)
    if is_open:
        return new_low, new_high
    # Closed, but flat and far away, as a cone of half angle near pi/2: the bounds are as accurate as vertices there.
    rough = _ROUND_OFF * max(np.abs(far_low).max(), np.abs(far_high).max()) / scale * (far_high - far_low)
    return np.maximum(low, far_low - rough), np.minimum(high, far_high + rough)


def _solutions(matrices: Any, sides: Any) -> tuple[Any, Any]:
    """Of (n, 3, 3) linear systems with these right sides (n, 3), and |det|, by elimination with pivots.

    `fill` scales its points by what follows from them, and the last bit of LAPACK depends on the processor. Cramer's
    rule has too few digits for a cone of half angle near pi/2.
    """
    rows, every = np.concatenate([matrices, sides[:, :, None]], axis=2), np.arange(len(sides))
    with np.errstate(all="ignore"):  # where the matrix is singular there is no solution
        for k in range(2):
            pivot = k + np.abs(rows[:, k:, k]).argmax(axis=1)
            rows[every, k], rows[every, pivot] = rows[every, pivot], rows[every, k]
            for i in range(k + 1, 3):
                rows[:, i] -= (rows[:, i, k] / rows[:, k, k])[:, None] * rows[:, k]
        z = rows[:, 2, 3] / rows[:, 2, 2]
        y = (rows[:, 1, 3] - rows[:, 1, 2] * z) / rows[:, 1, 1]
        x = (rows[:, 0, 3] - rows[:, 0, 1] * y - rows[:, 0, 2] * z) / rows[:, 0, 0]
        return np.stack([x, y, z], axis=1), np.abs(rows[:, 0, 0] * rows[:, 1, 1] * rows[:, 2, 2])


def _closed_bounds(
    planes: list[HalfSpace], low: Any, high: Any, far: float, flattest: float, tolerance: float
) -> tuple[Any, Any, bool, bool]:
    """Bounds from the vertices within a far box; whether the box cuts the volume, and whether a vertex was too flat."""
    box_low, box_high = np.maximum(low, -far), np.minimum(high, far)
    normals = np.vstack([[normal for normal, _offset in planes], np.eye(3), -np.eye(3)])
    offsets = np.concatenate([[offset for _normal, offset in planes], box_high, -box_low])
    is_flat = False
    found_low, found_high = np.full(3, math.inf), np.full(3, -math.inf)
    triples = itertools.combinations(range(len(offsets)), 3)
    while some := list(itertools.islice(triples, _TRIPLES)):
        index = np.array(some)
        vertices, flat = _solutions(normals[index], offsets[index])
        is_flat = is_flat or bool(((flat <= flattest) & (flat > _PARALLEL)).any())
        vertices = vertices[flat > flattest]
        # Also those that are not finite: planes that are parallel but for a component of 1e-300.
        vertices = vertices[np.abs(vertices).max(axis=1, initial=0.0) <= 2.0 * far]
        room = tolerance * (np.abs(offsets) + np.abs(vertices).max(axis=1, initial=0.0)[:, None])
        vertices = vertices[(vertices @ normals.T <= offsets + room).all(axis=1)]
        found_low = np.minimum(found_low, vertices.min(axis=0, initial=math.inf))
        found_high = np.maximum(found_high, vertices.max(axis=0, initial=-math.inf))
    if not (found_low <= found_high).all():
        return np.zeros(3), np.zeros(3), False, is_flat
    new_low, new_high = np.maximum(low, found_low), np.minimum(high, found_high)
    open_low, open_high = found_low <= -0.5 * far, found_high >= 0.5 * far
    new_low, new_high = np.where(open_low, low, new_low), np.where(open_high, high, new_high)
    return new_low, new_high, bool(open_low.any() or open_high.any()), is_flat
