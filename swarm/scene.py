"""The scene: surfaces and gravity, checked, the volume that they enclose, and as kernels take them."""

import copy
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import motion as motions
from .common import checks, notebook
from .contact.laws import NONE, Laws, Moves, owned_in
from .errors import SceneError
from .kernel.gravity import Gravity
from .kernel.vector import Vec
from .pairs import Pairs, checked_pairs
from .particles import Particles
from .pieces import (
    NO_HEAT,
    PartsOfRows,
    doorways_of_pieces,
    of_walls,
    places_of,
    thermal,
    volumes_of_pieces,
    with_reach,
)
from .surfaces import plane as planes
from .surfaces import required
from .surfaces import rotation as rotations
from .surfaces.facets.mesh import Mesh
from .surfaces.fields.grouped import Order, order_of, walls_in
from .surfaces.fields.many import Many, in_straight_flights, members_of
from .surfaces.fields.members import Members
from .surfaces.in_motion.moving import carried
from .surfaces.instant import box_of, gaps_of, gradient_of, has_room, planes_of
from .surfaces.periodic.images import Lengths, cell_of, corners_of, images_of, into_cell, lengths_of
from .surfaces.periodic.period import Period, cell_in
from .surfaces.polyhedron import polyhedron_bounds
from .surfaces.presence.doors import instants_of, was_there
from .surfaces.presence.joined import with_rooms
from .surfaces.presence.openings import Opened, openings_in, require_few
from .surfaces.surface import UNBOUNDED, Box, Surface
from .surfaces.union import Joined, Place, surfaces_of
from .surfaces.upright import upright
from .surfaces.walls import Walls

# Most walls that kernels are compiled for: 24 with `contact_step` take three minutes.
MOST_WALLS = 24
# Points whose gaps are found at once.
_BATCH = 4096
# A slot thinner than this part of the scene's extent does not set the length of steps, which would be lost in the
# round-off of times.
_THIN = 1e-6
# Planes nearer to the origin than an atom's nucleus is wide [m] are at it: a scene of them has no extent.
_AT_ORIGIN = 1e-15
# Of a field, and of a union of rooms, in a scene in which impacts move a surface.
BESIDE_MASS = "surfaces[{i}] must not be {kind} where a wall has a mass or an inertia, got {got}"
INSTEAD_OF_MASS = (
    f"give that wall a motion instead, or list the solids of a field one by one, at most {MOST_WALLS} walls in all"
)


def _surfaces(value: Any) -> tuple[Surface, ...]:
    """The argument `surfaces`, checked."""
    given = (value,) if isinstance(value, Surface) else checks.parts_of(value)
    if given is None:
        raise SceneError(
            f"surfaces must be a list of surfaces such as swarm.Sphere(radius=0.5), got {checks.shown(value)}"
            f"{checks.brackets(value)}"
        )
    for i, surface in enumerate(given):
        if not isinstance(surface, Surface):
            raise SceneError(
                f"surfaces[{i}] must be a surface such as swarm.Sphere, got {checks.shown(surface)}"
                f"{checks.brackets(surface)}"
            )
    return given


@dataclass(frozen=True, init=False, repr=False)
class Scene:
    """Rigid surfaces, whose admissible sides intersect in the volume that holds the particles, and gravity.

    Args:
        surfaces: at least one surface; none where the cell repeats in every direction, for balls.
        gravity: None, or three numbers (gx, gy, gz) [m/s^2], each at most 1e100.
        period: None, or three lengths (Lx, Ly, Lz) [m] of a cell that repeats without end, None for a direction in
            which it does not: what leaves [0, L) through a face comes back through the other one, and is counted. A
            solid that reaches over a face is there on the other side too; a cavity is within the cell; and any other
            surface is the same all along the period, as a plane or an endless cylinder along it, and may move along
            it. Flights go on over any number of cells where no wall that repeats is in the way.
        plane: None, or "x", "y" or "z": a billiard of two dimensions, whose particles stay in the plane x, y or z = 0.
            Walls stand upright on it. `fill` and all pictures are of the plane, and what is said of volumes and areas
            holds for areas and lengths: `Particles.volume` is an area [m^2], pressures are per length [N/m].
        pairs: None, or `Pairs`, what particles that have a radius do to one another; None: they keep the energy.

    Raises:
        SceneError: no surface, more than 24 walls with their images, surfaces that leave no volume, or one that does
            not go with the period or leans out of the plane.

    >>> import swarm
    >>> Scene(surfaces=[swarm.Sphere(radius=0.5)], gravity=(0.0, 0.0, -9.81)).size()
    0.5
    """

    surfaces: tuple[Surface, ...]
    gravity: checks.Vector | None
    period: Lengths | None
    plane: str | None
    pairs: Pairs | None
    # Of every surface what of it reaches into the cell: itself alone where nothing repeats.
    _images: tuple[tuple[Surface, ...], ...] = field(init=False, repr=False, compare=False)
    # The volumes in which every piece is open.
    _volumes: tuple[tuple[Surface, ...], ...] = field(init=False, repr=False, compare=False)
    _doorways: tuple[tuple[Surface, ...], ...] = field(init=False, repr=False, compare=False)
    # The largest radius of the balls in the scene [m]; None: its particles are points.
    _largest: ClassVar[float | None] = None
    # Whether listed solids of one kind may be a field.
    _together: ClassVar[bool] = True

    def __init__(
        self,
        surfaces: Sequence[Surface],
        gravity: Sequence[float] | None = None,
        period: Sequence[float | None] | None = None,
        plane: str | None = None,
        pairs: Pairs | None = None,
    ) -> None:
        surfaces = _surfaces(surfaces)
        required.require_description(surfaces)
        pull = None if gravity is None else checks.vector("gravity", gravity)
        for i, part in enumerate(pull or ()):
            checks.magnitude(f"|gravity[{i}]|", abs(part))
        lengths, plane = lengths_of(period), planes.checked(plane)
        named = [(surface, f"surfaces[{i}]") for i, surface in enumerate(surfaces)]
        images = tuple((one,) if lengths is None else tuple(images_of(one, lengths, name)) for one, name in named)
        images = with_reach(images)
        checks.assign(self, surfaces=surfaces, period=lengths, plane=plane, pairs=checked_pairs(pairs), _images=images)
        volumes = volumes_of_pieces(surfaces, images, lengths)
        checks.assign(self, _volumes=volumes, _doorways=doorways_of_pieces(images, volumes))
        self._require_few_walls("")
        require_few(self.openings() or ())
        for i in (*self.fields(), *self.unions()) if self.reacts() else ():
            said = BESIDE_MASS.format(i=i, kind=type(surfaces[i]).__name__, got=surfaces[i])
            raise SceneError(f"{said}; {INSTEAD_OF_MASS}")
        checks.assign(self, gravity=pull if pull is not None and any(pull) else None)
        if plane is not None:
            planes.require_all(plane, surfaces, pull, lengths)
        self._require_alone()
        required.require_known(surfaces, self._bounds_of_lasting)
        if not self._has_volume():
            why = required.apart_of(surfaces) or "check their `side`, and that solids are smaller than their cavity"
            raise SceneError(
                f"surfaces must leave a volume for particles, got {len(surfaces)} surfaces whose admissible sides "
                f"have no point in common; {why}"
            )

    def __repr__(self) -> str:
        """The call that makes it, omitting defaults, with the first of many surfaces."""
        given = {"gravity": self.gravity, "period": self.period, "plane": self.plane, "pairs": self.pairs}
        rest = "".join(f", {name}={value!r}" for name, value in given.items() if value is not None)
        return f"Scene([{', '.join(notebook.shortened(self.surfaces))}]{rest})"

    def _repr_html_(self) -> str:
        texts = notebook.shortened(self.surfaces)
        rows = [("" if text.startswith("<") else f"surfaces[{i}]", text) for i, text in enumerate(texts)]
        rows += [("gravity", "none" if self.gravity is None else f"{self.gravity} m/s^2")]
        rows += [] if self.period is None else [("period", f"{self.period} m")]
        rows += [] if self.pairs is None else [("pairs", repr(self.pairs))]
        rows += [] if self.plane is None else [("plane", f"{self.plane} = 0")]
        return notebook.table("Scene", rows)

    def __getstate__(self) -> dict[str, Any]:
        # Copies do not keep the walls: `ungrouped` and `of_balls` have other ones, and a worker process makes its own.
        return {name: value for name, value in self.__dict__.items() if name != "_walls"}

    def _require_few_walls(self, why: str) -> None:
        """Raise a `SceneError` where there are more walls than kernels can be compiled for."""
        walls = self.order.compiled(self.pieces)
        if walls > MOST_WALLS:
            raise SceneError(
                f"surfaces must have at most {MOST_WALLS} walls in all{why}, got {walls} of {len(self.surfaces)} "
                "surfaces: each wall is compiled into the kernels, which takes minutes with so many; "
                "remove some (a box has 3 walls, a capped cylinder 2, most others 1), or use solids of one "
                "kind, of which any number is one field for Impact where nothing moves, and as Spheres and the like "
                "always"
            )

    def _require_alone(self) -> None:
        """Raise a `SceneError` where a foam is not the only surface, or has a period."""
        foams = [i for i, one in enumerate(self.surfaces) if isinstance(one, Many) and one.is_foam()]
        if foams and (len(self.surfaces) > 1 or self.period is not None):
            raise SceneError(
                f'surfaces[{foams[0]}] must be the only surface of a scene without a period, for its side is "inside", '
                f"got {len(self.surfaces)} surfaces and period {self.period}; leave the others out, or list the "
                "cavities as parts of a swarm.Union"
            )

    # --- The volume ----------------------------------------------------------------------------------

    def size(self) -> float:
        """Characteristic length [m]: of the smallest surface, else of the volume; infinite if that is open."""
        smallest = min((surface.size() for surface in self.surfaces), default=math.inf)
        if math.isfinite(smallest):
            return smallest
        low, high = self.bounds()
        return min(high[k] - low[k] for k in self.axes()) / 2.0

    def across(self) -> int | None:
        """The axis across the plane of a scene of two dimensions, None where it has none."""
        return planes.across_of(self.plane)

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
        """Whether a particle may fly to infinity, at the start or after a wall disappears."""
        at_start = np.isfinite(self.bounds()).all()
        return not (at_start and (not self.has_doors() or np.isfinite(self._bounds_of_lasting(self.surfaces)).all()))

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
        # Particles do not leave through a face across a direction in which the cell repeats.
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

    # --- Pieces --------------------------------------------------------------------------------------

    @cached_property
    def pieces(self) -> tuple[Surface, ...]:
        """The surfaces, those of which unions are made, and the images of those that reach over a face of the cell."""
        return tuple(piece for images in self._images for image in images for piece in surfaces_of(image))

    @cached_property
    def owners_of_pieces(self) -> list[int]:
        """The surface that each of these is an image or a part of."""
        return [i for i, images in enumerate(self._images) for image in images for _piece in surfaces_of(image)]

    @cached_property
    def order(self) -> Order:
        """Surfaces and images in the order of the scene."""
        unions, first = [], 0
        for image in (image for images in self._images for image in images):
            if isinstance(image, Joined) and len(image.rooms) > 1:
                ends = np.cumsum([first, *map(len, image.rooms)]).tolist()
                unions.append(tuple(tuple(range(*ends)) for ends in itertools.pairwise(ends)))
            first += len(surfaces_of(image))
        return order_of(self.pieces, self._together, unions)

    @cached_property
    def _groups(self) -> list[Members]:
        """The surfaces that kernels take as fields."""
        repeated = None if self.period is None else corners_of(self.period)
        groups = ([self.pieces[i] for i in group] for group in self.order.groups)
        return [members_of(group, repeated, self._largest) for group in groups]

    @cached_property
    def volumes(self) -> tuple[tuple[Surface, ...], ...]:
        """The volumes in which every surface is open."""
        found: list[dict[Surface, None]] = [{} for _surface in self.surfaces]
        for i, *given in zip(self.owners_of_pieces, self._volumes, self._doorways, strict=True):
            found[i].update(dict.fromkeys(itertools.chain(*given)))
        return tuple(map(tuple, found))

    def laws(self) -> Laws | None:
        """The laws of every wall of the scene as kernels take them, None where no surface has one."""
        runs = self._runs()
        given, owners = [surface for _i, surface, _walls in runs], [self.owners_of_pieces[i] for i, *_rest in runs]
        spans = [(k, walls) for k, (_i, _surface, walls) in enumerate(runs)]
        laws = Laws(
            of_walls([surface.restitution for surface in given], spans, 1.0),
            of_walls([surface.friction for surface in given], spans, 0.0),
            of_walls([thermal(surface) for surface in given], spans, NO_HEAT),
            Moves(0.0) if self.moves() else None,
            owned_in(spans, given, owners),
        )
        return None if laws == NONE else laws.in_plane(self.across())

    def may_absorb(self) -> bool:
        """Whether a law of a wall may absorb particles."""
        laws = self.laws()
        return laws is not None and laws.may_end

    def openings(self, moment: float = 0.0) -> tuple[Opened, ...] | None:
        """The openings of every wall as kernels take them in the frame that ends at a moment [s]; None: none."""
        spans = self.order.spans(self.pieces)
        return openings_in(spans, (self._volumes, self._doorways), moment) or None

    def has_doors(self) -> bool:
        """Whether some walls are present, or some openings open, for some times only."""
        return any(one.present is not None for one in (*self.pieces, *self.open_volumes()))

    @cached_property
    def instants(self) -> tuple[float, ...]:
        """The instants after 0 s at which walls come or go, or openings open or shut [s], in order."""
        return instants_of(one.present for one in (*self.pieces, *self.open_volumes()))

    def open_volumes(self) -> tuple[Surface, ...]:
        """The volumes in which any piece is open."""
        return tuple(itertools.chain(*self._volumes, *self._doorways))

    def pieces_of_walls(self) -> NDArray[np.int64]:
        """The piece that each wall of the scene belongs to, by its number."""
        return np.array([i for i, _member in self.order.members(self.pieces)])

    def pieces_of_rows(self) -> NDArray[np.int64]:
        """The piece that each row of `owners` belongs to."""
        return np.array(self.order.owners(self.pieces))

    def _runs(self) -> list[tuple[int, Surface, int]]:
        """The walls in a row that have the same laws: their piece, the surface that says these, how many they are."""
        found: list[tuple[int, Surface, int]] = []
        for i, walls in self.order.spans(self.pieces):
            piece = self.pieces[i]
            found += [(i, *run) for run in (piece.runs() if isinstance(piece, Mesh) else [(piece, walls)])]
        return found

    @cached_property
    def parts(self) -> tuple[tuple[int, Place], ...]:
        """The parts of the unions and intersections of the scene: the number of the surface, and the place in that.

        >>> import swarm
        >>> ball = swarm.Sphere(0.5)
        >>> tube = swarm.Intersection([swarm.Cylinder(0.2), swarm.Plane((1.0, 0.0, 0.0), 0.1)])
        >>> swarm.Scene([swarm.Union([ball, tube])]).parts
        ((0, (0,)), (0, (1, 0)), (0, (1, 1)))
        """
        joined = ((i, surface) for i, surface in enumerate(self.surfaces) if isinstance(surface, Joined))
        return tuple((i, place) for i, surface in joined for place in surface.places_of_parts())

    @cached_property
    def _parts_of_pieces(self) -> list[tuple[int, Place]]:
        """The surface of each piece, and the place of its part in that surface."""
        every = ((i, image) for i, images in enumerate(self._images) for image in images)
        return [(i, place) for i, image in every for place in places_of(image)]

    def parts_of_rows(self) -> PartsOfRows | None:
        """The part that each row of the scene belongs to, None where no surface has parts."""
        if not self.parts:
            return None
        number = {part: k for k, part in enumerate(self.parts)}
        of_pieces = [number.get(part, len(number)) for part in self._parts_of_pieces]
        return PartsOfRows(tuple(of_pieces[i] for i in self.order.owners(self.pieces)), len(number))

    def common_faces(self) -> list[tuple[int, Place, Place]]:
        """The parts of unions that have a face in common, which is no wall: the surface, and the place of each."""
        unions = ((i, images[0]) for i, images in enumerate(self._images) if isinstance(images[0], Joined))
        return [(i, *pair) for i, union in unions for pair in union.common_places()]

    def doorways_of_parts(self) -> dict[tuple[int, Place], list[Surface]]:
        """The volumes in which walls of a part are open where another room is on their other side."""
        found: dict[tuple[int, Place], list[Surface]] = {}
        for part, volumes in zip(self._parts_of_pieces, self._doorways, strict=True):
            found.setdefault(part, []).extend(volumes)
        return found

    def owners(self) -> list[int]:
        """The surface that each row of the scene belongs to, one for a field."""
        return [self.owners_of_pieces[i] for i in self.order.owners(self.pieces)]

    def members(self) -> NDArray[np.int64]:
        """The surface of each wall, and its number in the field, or that of its part, or -1: (2, walls)."""
        number = {part: k for k, part in enumerate(self.parts)}
        of_pieces = [number.get(part, -1) for part in self._parts_of_pieces]
        rows = [(i, of_pieces[i] if member < 0 else member) for i, member in self.order.members(self.pieces)]
        return np.array([(self.owners_of_pieces[i], member) for i, member in rows], np.int64).reshape(-1, 2).T

    def names_laws(self) -> bool:
        """Whether a law of a wall is known by its name alone, as from a file that was read without its code."""
        return any(isinstance(law, str) for piece in self.pieces for law in piece.laws)

    def split_by_members(self, values: NDArray[Any]) -> list[NDArray[Any]]:
        """The values of the members of each surface, from (..., members) of all surfaces one after the other."""
        surface, member = self.members()
        counts = np.zeros(int(surface.max()) + 1, np.int64)
        np.maximum.at(counts, surface, member + 1)
        return np.split(values, np.cumsum(np.maximum(counts, 1))[:-1], axis=-1)

    def unions(self) -> list[int]:
        """The surfaces that are unions of several rooms."""
        return [self.owners_of_pieces[rooms[0][0]] for rooms in self.order.unions]

    # --- As kernels take it --------------------------------------------------------------------------

    def walls(self, moment: float = 0.0, own: Sequence[Surface] | None = None) -> Walls:
        """The surfaces as kernels take them, by their kinds, in the frame, or its piece, that ends at a moment [s].

        For bodies, with what is a body's `own` after them, nothing moves; None: for particles.
        """
        if self.moves():
            fields, others = ([self.pieces[i] for i in some] for some in (self.order.fields, self.order.alone()))
            rooms = [[[self.pieces[i] for i in room] for room in union] for union in self.order.unions]
            return self._upright(with_rooms(carried(fields, others, moment, self._largest), rooms))
        if own is not None:
            return walls_in(self.order, self.pieces, self._groups, own, lambda members: members)
        there = tuple(was_there(piece.present, moment) for piece in self.pieces)
        if there not in self._walls:
            made = walls_in(self.order, self.pieces, self._groups, (), self._taken, moment, self._largest)
            self._walls[there] = self._upright(made)
        return self._walls[there]

    def walls_of(self, surface: Surface) -> tuple[Any, ...]:
        """The walls of one of its surfaces that its particles meet."""
        return surface.walls() if self._largest is None else surface.walls_of_balls(self._largest)

    @cached_property
    def _walls(self) -> dict[tuple[bool, ...], Walls]:
        """The walls for particles where nothing moves, by which of the surfaces are there."""
        return {}

    def _taken(self, members: Members) -> Members:
        """A field as kernels take it where nothing moves."""
        return in_straight_flights(members, self.period is not None) if self.gravity is None else members

    def _upright(self, walls: Walls) -> Walls:
        """Walls as a scene of two dimensions takes them."""
        across = self.across()
        return walls if across is None else upright(walls, across)

    def cell(self) -> Period | None:
        """The cell that repeats as kernels take it."""
        if self.period is None:
            return None
        pulls = self.gravity or (0.0, 0.0, 0.0)
        falls = [0.0 if length is None else -pull * length for pull, length in zip(pulls, self.period, strict=True)]
        fall = Vec(*falls) if any(falls) else None
        return cell_in(self.period, self.surfaces, self._has_fields(), fall, self._largest or 0.0)

    def pull(self) -> Gravity | None:
        """Gravity as kernels take it."""
        return None if self.gravity is None else Gravity(*self.gravity)

    def walls_of_rows(self) -> NDArray[np.int64]:
        """The number of walls of each row of `owners`: the members of a field, else one."""
        fields = [len(self.pieces[i]) for i in self.order.fields]  # type: ignore[arg-type]
        return np.array([*fields, *[1] * (len(self.owners()) - len(fields))], np.int64)

    def fields(self) -> list[int]:
        """The surfaces that are many bodies."""
        return [self.owners_of_pieces[i] for i in self.order.fields]

    def _has_fields(self) -> bool:
        return bool(self.order.fields or self.order.groups)

    def moves(self) -> bool:
        """Whether a surface moves, or may be moved."""
        return self._moves

    def reacts(self) -> bool:
        """Whether impacts move a surface."""
        return self._reacts

    @cached_property
    def _moves(self) -> bool:
        return self._reacts or any(piece.motion is not None for piece in self.pieces)

    @cached_property
    def _reacts(self) -> bool:
        return any(surface.reacts() for surface in self.surfaces)

    # --- Other scenes of it --------------------------------------------------------------------------

    def ungrouped(self, what: str) -> "Scene":
        """The scene whose solids of one kind are no field, for `what`, which does not support them.

        Raises:
            SceneError: it has too many walls.
        """
        if not self.order.groups:
            return self
        made = copy.copy(self)
        made.__dict__.update(_together=False, _groups=[])
        made.__dict__.pop("order")
        made._require_few_walls(f" with {what}")
        return made

    def of_balls(self, radii: NDArray[np.float64] | None) -> "Scene":
        """The scene whose walls are those that balls with these radii meet; itself without them.

        What their centres meet are `walls().grown(radius)`.
        """
        if radii is None:
            return self
        largest, made = float(radii.max()), copy.copy(self)
        made.__dict__.update(_largest=largest)
        made.__dict__.pop("_groups", None)
        if self.period is not None:
            images = self._images_of_balls(largest)
            volumes = volumes_of_pieces(self.surfaces, images, self.period)
            checks.assign(made, _images=images, _volumes=volumes, _doorways=doorways_of_pieces(images, volumes))
            for name in ("pieces", "owners_of_pieces", "order", "volumes", "instants"):
                made.__dict__.pop(name, None)
            made._require_few_walls(f" with balls of a radius of {largest:g} m")
        return made

    def of_some(self, surfaces: Sequence[Surface]) -> "Scene":
        """The scene of some of its surfaces, for the same particles."""
        if self._largest is None:
            return Scene(surfaces, self.gravity)
        return Scene(surfaces, self.gravity, plane=self.plane).of_balls(np.array([self._largest]))

    def placed(self, positions: ArrayLike, orientations: ArrayLike) -> "Scene":
        """The scene whose walls that react stay where `wall_position` and `wall_orientation` of a frame say."""
        surfaces = list(self.surfaces)
        for i, surface in enumerate(surfaces):
            if surface.reacts():
                turn = tuple(np.array(orientations)[i].tolist())
                rows = tuple(map(tuple, rotations.matrix(turn).tolist()))
                held = motions.Placed(tuple(np.array(positions)[i].tolist()), turn, rows)
                surfaces[i] = replace(surface, mass=None, inertia=None, motion=held)
        return Scene(surfaces, self.gravity, self.period, self.plane, self.pairs)
