"""The scene: surfaces, gravity, and the volume that the surfaces enclose."""

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import checks, notebook
from . import motion as motions
from .contact.laws import Laws, Moves, Span, Thermal
from .errors import SceneError
from .kernel.gravity import Gravity
from .kernel.vector import Vec
from .particles import Particles
from .surfaces import required
from .surfaces import rotation as rotations
from .surfaces.data.known import require_known
from .surfaces.fields.grouped import Order, chain_in, order_of
from .surfaces.fields.many import Many, in_straight_flights, members_of
from .surfaces.fields.members import Members
from .surfaces.fold import Chain, Field
from .surfaces.free import cell_in
from .surfaces.images import Lengths, cell_of, corners_of, images_of, into_cell, lengths_of
from .surfaces.instant import box_of, gaps_of, gradient_of, planes_of
from .surfaces.moving import Carried, carried
from .surfaces.openings import Openings, openings_in, require_few, volumes_of
from .surfaces.period import Period
from .surfaces.polyhedron import polyhedron_bounds
from .surfaces.room import has_room
from .surfaces.surface import UNBOUNDED, Box, Surface

# Most walls that kernels are compiled for: 24 with `contact_step` take three minutes.
MOST_WALLS = 24
# Points whose gaps are found at once.
_BATCH = 4096
# A slot thinner than this part of the scene's extent is none of its lengths: steps that are a part of it end in the
# round-off of a time.
_THIN = 1e-6
# Planes nearer to the origin than an atom's nucleus is wide [m] are at it: a scene of them has no extent.
_AT_ORIGIN = 1e-15
# The law of a wall without temperature.
_NO_HEAT = Thermal(0.0, 0.0)


@dataclass(frozen=True, init=False, repr=False)
class Scene:
    """Rigid surfaces, whose admissible sides intersect in the volume that holds the particles, and gravity.

    Args:
        surfaces: at least one surface.
        gravity: None, or three numbers (gx, gy, gz) [m/s^2], each at most 1e100.
        period: None, or three lengths (Lx, Ly, Lz) [m] of a cell that repeats without end, None for a direction in
            which it does not: what leaves [0, L) through a face comes back through the other one, and is counted. A
            solid that reaches over a face is there on the other side too; a cavity is within the cell; and any other
            surface is the same all along the period, as a plane or an endless cylinder along it, and may move along
            it. Flights go on over any number of cells where no wall that repeats is in the way.

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
    # The volumes in which every surface is open.
    volumes: tuple[tuple[Surface, ...], ...] = field(init=False, repr=False, compare=False)

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
        named = ((surface, self.period, f"surfaces[{i}]") for i, surface in enumerate(surfaces))
        object.__setattr__(self, "volumes", tuple(volumes_of(*one) for one in named))
        self._require_few_walls("")
        require_few(self.volumes)
        for i in self._fields() if self.reacts() else ():
            raise SceneError(
                f"surfaces[{i}] must not be {type(surfaces[i]).__name__} where impacts move a surface, got "
                f"{surfaces[i]}; give that surface a motion instead of a mass and an inertia, or list the bodies one "
                f"by one, at most {MOST_WALLS} walls in all"
            )
        object.__setattr__(self, "gravity", pull if pull is not None and any(pull) else None)
        require_known(surfaces, lambda held: self._bounds(0.0, held))
        if not self._has_volume():
            raise SceneError(
                f"surfaces must leave a volume for particles, got {len(surfaces)} surfaces whose admissible sides "
                "have no point in common; check their `side`, and that solids are smaller than their cavity"
            )

    def __repr__(self) -> str:
        """The call that makes it, omitting defaults, with the first of many surfaces."""
        given = {"gravity": self.gravity, "period": self.period}
        rest = "".join(f", {name}={value}" for name, value in given.items() if value is not None)
        return f"Scene([{', '.join(notebook.shortened(self.surfaces))}]{rest})"

    def _repr_html_(self) -> str:
        texts = notebook.shortened(self.surfaces)
        rows = [("" if text.startswith("<") else f"surfaces[{i}]", text) for i, text in enumerate(texts)]
        rows += [("gravity", "none" if self.gravity is None else f"{self.gravity} m/s^2")]
        rows += [] if self.period is None else [("period", f"{self.period} m")]
        return notebook.table("Scene", rows)

    def _require_few_walls(self, why: str) -> None:
        """Raise a `SceneError` where there are more walls than kernels can be compiled for."""
        walls = self.order.compiled(self._pieces)
        if walls > MOST_WALLS:
            raise SceneError(
                f"surfaces must have at most {MOST_WALLS} walls in all{why}, got {walls} of {len(self.surfaces)} "
                "surfaces: each wall is compiled into the kernels, which takes minutes with so many; "
                "remove some (a box has 3 walls, a capped cylinder 2, most others 1), or use solids of one "
                "kind, of which any number is one field for Impact where nothing moves, and as Spheres and the like "
                "always"
            )

    def apart(self, what: str) -> "Scene":
        """The scene with every wall compiled by itself, for `what` knows no fields.

        Raises:
            SceneError: it has a field, or too many walls.
        """
        for i in self._fields():
            raise SceneError(
                f"surfaces[{i}] must not be {type(self.surfaces[i]).__name__} with {what}, got {self.surfaces[i]}; use "
                f"Impact with contact_step = 0, or list its bodies one by one, at most {MOST_WALLS} walls"
            )
        if not self.order.groups:
            return self
        made = copy.copy(self)
        made.__dict__.update(order=order_of(self._pieces, together=False), _groups=[])
        made._require_few_walls(f" with {what}")
        return made

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

    def chain(self, moment: float = 0.0, own: Sequence[Surface] | None = None) -> Chain | Field | Carried | None:
        """The surfaces as kernels take them, by their kinds; those that move in the frame that ends at a moment [s].

        For bodies, with what is a body's `own` after them, nothing moves; None: for particles.
        """
        if self.moves():
            fields, others = ([self._pieces[i] for i in some] for some in (self.order.fields, self.order.others))
            return carried(fields, others, moment)

        def taken(members: Members) -> Members:
            straight = self.gravity is None and own is None
            return in_straight_flights(members, self.period is not None) if straight else members

        return chain_in(self.order, self._pieces, self._groups, own or (), taken)

    def walls_of_rows(self) -> NDArray[np.int64]:
        """How many walls of the chain each row of `owners` stands for: the members of a field, else one."""
        fields = [len(self._pieces[i]) for i in self.order.fields]  # type: ignore[arg-type]
        return np.array([*fields, *[1] * (len(self.owners()) - len(fields))], np.int64)

    def cell(self) -> Period | None:
        """The cell that repeats as kernels take it."""
        if self.period is None:
            return None
        pulls = self.gravity or (0.0, 0.0, 0.0)
        falls = [0.0 if length is None else -pull * length for pull, length in zip(pulls, self.period, strict=True)]
        return cell_in(self.period, self.surfaces, self._has_fields(), Vec(*falls) if any(falls) else None)

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

    def openings(self) -> Openings | None:
        """The openings of every wall of the chain as kernels take them, None where there are none."""
        return openings_in(self.order.spans(self._pieces), [self.volumes[i] for i in self.owners_of_pieces])

    def _of_walls(self, values: list[Any], neutral: Any) -> Chain | Span | None:
        """The value of the owner of every wall as a chain, None where all are neutral."""
        if all(value == neutral for value in values):
            return None
        chain: Chain | Span | None = None
        for i, walls in reversed(self.order.spans(self._pieces)):
            value = values[self.owners_of_pieces[i]]
            chain = Chain(value, chain) if walls == 1 else Span(value, float(walls), chain)
        return chain

    def owners(self) -> list[int]:
        """The surface that each row of the chain belongs to, one for a field."""
        return [self.owners_of_pieces[i] for i in self.order.owners(self._pieces)]

    def members(self) -> NDArray[np.int64]:
        """Of each wall of the chain its surface, and its number in the field that this is or -1: (2, walls)."""
        return np.array([(self.owners_of_pieces[i], member) for i, member in self.order.members(self._pieces)]).T

    @cached_property
    def _pieces(self) -> tuple[Surface, ...]:
        """The surfaces, and the images of those that reach over a face of the cell."""
        return tuple(image for images in self._images for image in images)

    @cached_property
    def owners_of_pieces(self) -> list[int]:
        """The surface that each of these is an image of."""
        return [i for i, images in enumerate(self._images) for _image in images]

    @cached_property
    def order(self) -> Order:
        """Surfaces and images in the order of the chain."""
        return order_of(self._pieces)

    @cached_property
    def _groups(self) -> list[Members]:
        """Those that kernels take as fields."""
        repeated = None if self.period is None else corners_of(self.period)
        return [members_of([self._pieces[i] for i in group], repeated) for group in self.order.groups]

    def _has_fields(self) -> bool:
        return bool(self.order.fields or self.order.groups)

    def _fields(self) -> list[int]:
        """The surfaces that are many bodies."""
        return [self.owners_of_pieces[i] for i in self.order.fields]

    def size(self) -> float:
        """Characteristic length [m]: of the smallest surface, else of the volume; infinite if that is open."""
        smallest = min(surface.size() for surface in self.surfaces)
        if math.isfinite(smallest):
            return smallest
        low, high = self.bounds()
        return min(b - a for a, b in zip(low, high, strict=True)) / 2.0

    def finite_size(self) -> float:
        """`size`, or the extent of the surfaces where the volume is open, or too thin to be a length of the motion."""
        size, extent = self.size(), self.extent()
        return size if _THIN * extent < size < math.inf else extent

    def gaps(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        """Signed gap of every surface at points (3, N) and a time [s], shape (surfaces, N); admissible is <= 0."""
        rows = checks.array("points", points)
        if self.period is not None:
            rows, _image = into_cell(self.period, rows)
        return np.array([gaps_of(images, rows, time).max(axis=0) for images in self._images])

    def admits(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether each of the points (3, N) is admissible at time 0; where phi is not a number it is not."""
        rows = points if self.period is None else into_cell(self.period, points)[0]
        admitted = np.ones(rows.shape[1], np.bool_)
        for image in (image for images in self._images for image in images):
            if isinstance(image, Many):
                admitted[admitted] = ~image.contain(rows[:, admitted])
            else:
                admitted &= gaps_of((image,), rows, 0.0)[0] <= 0.0
        return admitted

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
                found.append((gaps_of(images, rows, time) / np.maximum(slopes, np.finfo(np.float64).tiny)).max(axis=0))
        return np.array(found)

    def outside(self, points: NDArray[np.float64], distance: float) -> NDArray[np.intp]:
        """Which of the points (3, N) are farther outside than this distance [m], or where phi is not a number."""
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
        """Whether a particle may fly to infinity."""
        return not np.isfinite(self.bounds()).all()

    def poses(self, time: float) -> list[motions.Pose]:
        """Where every surface is at a time [s]."""
        return [motions.pose(surface.motion, time) for surface in self.surfaces]

    def open_faces(self, time: float = 0.0) -> NDArray[np.float64]:
        """Open faces through which gravity pulls no particle back: rows (n, offset); n.r > offset is outside."""
        faces = [
            (*n, offset) for surface in self.surfaces for n, offset in planes_of(surface, surface.open_faces(), time)
        ]
        rows = np.array(faces, dtype=np.float64).reshape(-1, 4)
        # Through a face across the period nobody leaves.
        repeats = np.array([length is not None for length in self.period or (None,) * 3])
        rows = rows[(rows[:, :3][:, repeats] == 0.0).all(axis=1)]
        return np.asarray(rows if self.gravity is None else rows[rows[:, :3] @ self.gravity >= 0.0])

    def bounds(self, time: float = 0.0) -> Box:
        """A box (lower, upper) around the admissible volume at a time [s]; infinite where that is open."""
        low, high = self._bounds(time, self.surfaces)
        return tuple(low.tolist()), tuple(high.tolist())

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
        return low, high

    def _has_volume(self) -> bool:
        low, high = (np.array(corner) for corner in self.bounds())
        if not (low < high).all():
            return False
        # Open directions are searched as far as the scene itself extends.
        reach = 2.0 * self.extent()
        low, high = np.maximum(low, -reach)[:, None], np.minimum(high, reach)[:, None]
        return has_room(low, high, self.gaps, lambda i, points: gradient_of(self._images[i], points))

    def extent(self) -> float:
        """Distance from the origin within which the scene's surfaces lie."""
        lengths = [length for length in self.period or () if length is not None]
        farthest = max([*(surface.extent() for surface in self.surfaces), *lengths])
        return farthest if farthest > _AT_ORIGIN else 1.0

    def _images_of(self, i: int) -> tuple[Surface, ...]:
        if self.period is None:
            return (self.surfaces[i],)
        return tuple(images_of(self.surfaces[i], self.period, f"surfaces[{i}]"))


def _thermal(surface: Surface) -> Thermal:
    if surface.temperature is None:
        return _NO_HEAT
    return Thermal(surface.temperature, surface.accommodation)
