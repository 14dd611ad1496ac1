"""The scene as users describe it: checked surfaces and gravity, and the enclosed volume."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import motion as motions
from .common import checks, notebook
from .common.once import once
from .compiled_scene import CompiledScene, is_in_steps
from .errors import SceneError
from .kernel.gravity import Gravity
from .pairs import Pairs, checked_pairs
from .particles import Particles
from .surfaces import plane as planes
from .surfaces import required
from .surfaces import rotation as rotations
from .surfaces.instant import box_of, distances_of, gaps_of, gradient_of, has_room, planes_of
from .surfaces.periodic.images import Lengths, cell_of, into_cell, is_same_along, lengths_of
from .surfaces.pieces import Images, Pieces, pieces_of
from .surfaces.presence.doors import instants_of
from .surfaces.presence.openings import require_few
from .surfaces.room import lasting, room_bounds
from .surfaces.surface import UNBOUNDED, Box, Surface, held_opening
from .surfaces.union import Place

# The number of points in one evaluation of gaps.
_BATCH = 4096
# A slot thinner than this part of the extent of a scene does not set the length of steps, which would be lost in
# round-off of times.
_THIN = 1e-6
# Planes nearer to the origin than the width of an atomic nucleus [m] are at it: a scene of such planes has no extent.
_AT_ORIGIN = 1e-15
# The largest distance outside of the cell of the end of a step of points that meet images of solids, as a part of the
# shortest period.
_REACH_OF_STEPS = 0.05


def _surfaces(value: Any) -> tuple[Surface, ...]:
    """Return the argument `surfaces`, checked."""
    expected = "surfaces such as swarm.Sphere(radius=0.5)"
    given = (value,) if isinstance(value, Surface) else checks.list_of("surfaces", value, expected)
    for i, surface in enumerate(given):
        if not isinstance(surface, Surface):
            raise SceneError(
                f"surfaces[{i}] must be a surface such as swarm.Sphere, got {checks.shown(surface)}"
                f"{checks.brackets(surface)}"
            )
    return given


def _end_of(surface: Surface, n: ArrayLike, time: float) -> float:
    """The extent of a solid, or a cavity, along a direction at a time [s]; -inf if it is unbounded there."""
    box = box_of(surface, time, filled=True) if surface.is_solid() else room_bounds((surface,), time)
    along, (low, high) = np.asarray(n), np.array(box)
    end = float(along @ np.where(along > 0.0, high, np.where(along < 0.0, low, 0.0)))
    return end if math.isfinite(end) else -math.inf


@dataclass(frozen=True, init=False, repr=False)
class Scene:
    """Rigid surfaces, with admissible sides that intersect in the volume of the particles, and gravity.

    Args:
        surfaces: at least one surface for points; balls need none, as in a cell that repeats in every direction.
        gravity: None, or three numbers (gx, gy, gz) [m/s^2], each at most 1e100.
        period: None, or three lengths (Lx, Ly, Lz) [m] of a cell that repeats without end, None for a direction in
            which it does not repeat. A particle that leaves [0, L) through a face comes back through the other face,
            and is counted. A solid that reaches over a face is present on the other side too; a cavity is within the
            cell; any other surface is constant along the period, such as a plane or an endless cylinder along it, and
            may move along it. Flights go on over any number of cells if no wall that repeats is in the way.
        plane: None, or "x", "y" or "z": a billiard of two dimensions, with particles in the plane x, y or z = 0.
            Walls are perpendicular to it. `fill` and all pictures are of the plane. Volumes are areas there, and areas
            are lengths: `Particles.volume` is in m^2, a pressure in N/m.
        pairs: the `Pairs` of particles with a radius; None: their impacts on one another conserve the energy.

    Raises:
        SceneError: an argument is out of its range, there are more than 24 walls with their images, the surfaces leave
            no volume, or a surface does not fit the period or is not perpendicular to the plane.

    >>> import swarm
    >>> Scene(surfaces=[swarm.Sphere(radius=0.5)], gravity=(0.0, 0.0, -9.81)).size()
    0.5
    """

    surfaces: tuple[Surface, ...]
    gravity: checks.Vector | None
    period: Lengths | None
    plane: str | None
    pairs: Pairs | None
    # The pieces that points meet.
    pieces: Pieces = field(init=False, repr=False, compare=False)

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
        checks.assign(self, surfaces=surfaces, period=lengths, plane=plane, pairs=checked_pairs(pairs))
        checks.assign(self, gravity=pull if pull is not None and any(pull) else None)
        checks.assign(self, pieces=pieces_of(surfaces, lengths))
        compiled = self.compiled()
        require_few(compiled.openings() or ())
        if plane is not None:
            planes.require_all(plane, surfaces, pull, lengths)
        self._require_alone()
        required.require_known(surfaces, self._bounds_of_lasting)
        if not self._has_volume():
            why = required.apart_of(surfaces) or "check their `side`, and that solids are smaller than their cavity"
            raise SceneError(
                f"surfaces must leave a volume for particles, got {len(surfaces)} surfaces; their admissible sides "
                f"have no point in common; {why}"
            )

    def __repr__(self) -> str:
        """The call that makes the scene, without defaults, with the first of many surfaces."""
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
        # Copies make the arguments of kernels anew.
        return {name: value for name, value in self.__dict__.items() if name not in ("_of_points", "_pieces_by_radius")}

    def _require_alone(self) -> None:
        """Raise a `SceneError` if a foam is not the only surface, or the scene has a period."""
        foams = [i for i, one in enumerate(self.surfaces) if one.is_foam()]
        if foams and (len(self.surfaces) > 1 or self.period is not None):
            raise SceneError(
                f'surfaces[{foams[0]}] must be the only surface of a scene without a period, for its side is "inside", '
                f"got {len(self.surfaces)} surfaces and period {self.period}; leave the others out, or list the "
                "cavities as parts of a swarm.Union"
            )

    # --- The volume ----------------------------------------------------------------------------------

    def size(self) -> float:
        """Return the characteristic length [m]: of the smallest surface, else of the volume; infinite if it is open."""
        smallest = min((surface.size() for surface in self.surfaces), default=math.inf)
        if math.isfinite(smallest):
            return smallest
        low, high = self.bounds()
        return min(high[k] - low[k] for k in self.axes()) / 2.0

    def across(self) -> int | None:
        """Return the axis perpendicular to the plane of a scene of two dimensions, or None."""
        return planes.PLANES.get(self.plane)

    def axes(self) -> list[int]:
        """Return the axes along which particles may move."""
        return [k for k in range(3) if k != self.across()]

    @once
    def finite_size(self) -> float:
        """Return `size`, or the extent of the surfaces if the volume is open, or too thin to set a length of steps."""
        size, extent = self.size(), self.extent()
        return size if _THIN * extent < size < math.inf else extent

    def wrapped(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Return points (3, N) shifted into the cell, and by how many cells (3, N); 0 along axes without a period."""
        return into_cell(self.period or (None, None, None), checks.array("points", points))

    def unwrapped(self, particles: Particles) -> NDArray[np.float64]:
        """Return the positions of particles (3, N) without the shift into the cell: position + image * period [m]."""
        if self.period is None or particles.image is None:
            return np.array(particles.position)
        lengths = np.array([length or 0.0 for length in self.period])
        return np.asarray(particles.position + particles.image * lengths[:, None])

    def gaps(
        self, points: ArrayLike, time: float = 0.0, radius: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Return the gap of every surface at points (3, N) and a time [s], shape (surfaces, N); admissible is <= 0.

        The gap of a surface that is absent at that time is minus infinity. With a radius (N,) points are the centres of
        balls, and the values are those of `distances_outside`.
        """
        if radius is not None:
            return self.distances_outside(points, time, radius)
        return self._of_each(points, time, self.pieces.images, lambda images, rows: gaps_of(images, rows, time))

    def admits(self, points: NDArray[np.float64], radius: NDArray[np.float64] | None = None) -> NDArray[np.bool_]:
        """Whether each of the points (3, N) is admissible at time 0; a point where phi is NaN is not.

        With a radius (N,) points are the centres of balls.
        """
        if radius is not None:
            return np.asarray((self.distances_outside(points, 0.0, radius) <= 0.0).all(axis=0))
        rows = points if self.period is None else into_cell(self.period, points)[0]
        refused = np.zeros(rows.shape[1], dtype=bool)
        for image in (image for images in self.pieces.images for image in images if image.is_there(0.0)):
            refused[~refused] = ~image.admits(rows[:, ~refused])
        return ~refused

    def distances_outside(
        self, points: ArrayLike, time: float = 0.0, radius: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Return how far points (3, N) are outside of every surface, shape (surfaces, N) [m]; negative inside.

        The distance is the gap over the magnitude of its gradient, of first order. It is minus infinity for a surface
        that is absent at that time [s]. With a radius (N,) points are the centres of balls, and the distance is how far
        the balls reach outside.
        """
        if radius is None:
            return self._of_each(
                points, time, self.pieces.images, lambda images, rows: distances_of(images, rows, time)
            )
        reach = lambda images, rows: [one.reaching_outside(rows, radius, time) for one in images]  # noqa: E731
        return self._of_each(points, time, self.pieces_of_balls(float(radius.max(initial=0.0))).images, reach)

    def lost(self, points: NDArray[np.float64], time: float) -> NDArray[np.bool_]:
        """Whether balls with their centres at points (3, N) are beyond walls that they meet from both sides.

        Reacting walls are left out, as impacts have moved them.
        """
        rows = points if self.period is None else into_cell(self.period, points)[0]
        lost = np.zeros(points.shape[1], np.bool_)
        for image in (image for images in self.pieces.images for image in images):
            if image.is_there(time) and not image.reacts():
                lost |= image.lost(rows, time)
        return lost

    def _of_each(
        self, points: ArrayLike, time: float, images: Images, values: Callable[[Any, Any], Any]
    ) -> NDArray[np.float64]:
        """Return the largest value of the images of every surface at points, (surfaces, N)."""
        rows = checks.array("points", points)
        if self.period is not None:
            rows, _image = into_cell(self.period, rows)
        away, each = np.full(np.shape(rows)[1:], -math.inf), zip(self.surfaces, images, strict=True)
        found = [np.max(values(several, rows), axis=0) if one.is_there(time) else away for one, several in each]
        return np.array(found).reshape(len(found), *away.shape)

    @once
    def reach_of_steps(self) -> float | None:
        """Return how far outside of the cell a step of points may end [m]; None if no images are there."""
        period = self.period or (None, None, None)
        repeats = [k for k, length in enumerate(period) if length is not None]
        for one in self.surfaces if repeats else ():
            if one.is_solid() and not all(is_same_along(one, k, period) for k in repeats):
                return _REACH_OF_STEPS * min(length for length in period if length is not None)
        return None

    @cached_property
    def _pieces_by_radius(self) -> dict[float, Pieces]:
        return {}

    @cached_property
    def _pieces_of_joined_rooms(self) -> Pieces:
        """The pieces that balls meet: a union of several rooms, or a foam, is one piece."""
        images = [image for images in self.pieces.images for image in images]
        if not any(len(one.rooms) > 1 or one.is_foam() for one in images):
            return self.pieces
        from .surfaces.balls.joined_rooms import joined_rooms_of  # loaded only for balls

        return pieces_of([joined_rooms_of(one) if len(one.rooms) > 1 or one.is_foam() else one for one in images], None)

    def pieces_of_balls(self, largest: float) -> Pieces:
        """Return the pieces that balls in the cell meet, with radii up to `largest` [m]."""
        if self.period is None:
            return self._pieces_of_joined_rooms
        known = self._pieces_by_radius
        # The pieces for larger balls are valid too.
        largest = min((one for one in known if one >= largest), default=largest)
        if largest not in known:
            known[largest] = pieces_of(self.surfaces, self.period, largest)
        return known[largest]

    def outside(
        self, points: NDArray[np.float64], distance: float, radius: NDArray[np.float64] | None = None
    ) -> NDArray[np.intp]:
        """Return the numbers of the points (3, N) that are farther outside than a distance [m], or where phi is NaN.

        With a radius (N,) points are the centres of balls.
        """
        if radius is not None:
            beyond = ~np.asarray((self.distances_outside(points, 0.0, radius) <= distance).all(axis=0))
            return beyond.nonzero()[0]
        found = []
        # In batches, so that NumPy's intermediate results stay in the processor's cache.
        for begin in range(0, points.shape[1], _BATCH):
            batch = points[:, begin : begin + _BATCH]
            suspects = (~self.admits(batch)).nonzero()[0]
            if suspects.size:
                near = (self.distances_outside(batch[:, suspects]) <= distance).all(axis=0)
                found.append(begin + suspects[~near])
        return np.concatenate(found) if found else np.empty(0, np.intp)

    @once
    def is_open(self) -> bool:
        """Whether a particle may fly to infinity, at the start or after a wall becomes absent."""
        at_start = np.isfinite(self.bounds()).all()
        return not (at_start and (not self.has_doors() or np.isfinite(self._bounds_of_lasting(self.surfaces)).all()))

    def is_open_upwards_only(self) -> bool:
        """Whether gravity pulls particles back from each side on which the scene is open, as into a glass."""
        if self.gravity is None or self.has_doors() or self.pieces.open_volumes() or len(self.open_faces()):
            return False
        (low, high), pull = self.bounds(), np.array(self.gravity)
        return not (np.isinf(low) & (pull <= 0.0) | np.isinf(high) & (pull >= 0.0)).any()

    def poses(self, time: float) -> list[motions.Pose]:
        """Return the pose of every surface at a time [s].

        A point p of the surface as given is then at `center` + `turn` @ (p - `center`) + `shift`; `quaternion` is the
        rotation `turn` as (w, x, y, z).
        """
        return [motions.pose(surface.motion, time) for surface in self.surfaces]

    def open_faces(self, time: float = 0.0) -> NDArray[np.float64]:
        """Return open faces through which gravity pulls no particle back: rows (*n, offset); outside is n.r > offset.

        A face is moved outwards until no other surface beyond it, such as a floor, may send a particle back.
        """
        there = [surface for surface in self.surfaces if surface.is_there(time)]
        faces = [
            (*n, max(offset, *(_end_of(one, n, time) for one in there)))
            for surface in there
            for n, offset in planes_of(surface, surface.open_faces(), time)
        ]
        rows = np.array(faces, dtype=np.float64).reshape(-1, 4)
        # Particles do not leave through a face across a periodic direction.
        repeats = np.array([length is not None for length in self.period or (None,) * 3])
        rows = rows[(rows[:, :3][:, repeats] == 0.0).all(axis=1)]
        return np.asarray(rows if self.gravity is None else rows[rows[:, :3] @ self.gravity >= 0.0])

    def bounds(self, time: float = 0.0) -> Box:
        """Return a box (lower, upper) around the admissible volume at a time [s]; infinite where the volume is open.

        The box has no width perpendicular to the plane of a scene of two dimensions.
        """
        low, high = self.bounds_of([surface for surface in self.surfaces if surface.is_there(time)], time)
        return tuple(low.tolist()), tuple(high.tolist())

    def _bounds_of_lasting(self, surfaces: Sequence[Surface]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return a box around the volume at the start, by those of `surfaces` that are present at all times."""
        return self.bounds_of([surface for surface in surfaces if surface.present is None])

    def bounds_of(
        self, surfaces: Sequence[Surface], time: float = 0.0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return a box (lower, upper) around the volume that these surfaces leave of the cell, or of space."""
        cell = UNBOUNDED if self.period is None else cell_of(self.period)
        low, high = room_bounds(surfaces, time, cell)
        for k, union in enumerate(surfaces):
            if len(union.rooms) > 1 and not np.isfinite(high - low)[self.axes()].all():
                # Another surface, such as a lid over a cone, may close each of its rooms.
                others = [*surfaces[:k], *surfaces[k + 1 :]]
                boxes = [room_bounds([*others, *lasting(room)], time, cell) for room in union.rooms]
                low = np.maximum(low, np.min([least for least, _most in boxes], axis=0))
                high = np.minimum(high, np.max([most for _least, most in boxes], axis=0))
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
            lambda i, points: gradient_of(self.pieces.images[there[i]], points),
        )

    def extent(self) -> float:
        """Return the distance from the origin within which the surfaces of the scene lie [m]."""
        lengths = [length for length in self.period or () if length is not None]
        farthest = max((*(surface.extent() for surface in self.surfaces), *lengths), default=0.0)
        return farthest if farthest > _AT_ORIGIN else 1.0

    # --- Surfaces, parts and pieces ------------------------------------------------------------------

    def has_doors(self) -> bool:
        """Whether a wall is present, or an opening open, only at some times."""
        return any(one.present is not None for one in (*self.pieces.each, *self.pieces.open_volumes()))

    @cached_property
    def instants(self) -> tuple[float, ...]:
        """The instants after 0 s at which walls become present or absent, or openings open or shut [s], in order."""
        return instants_of(one.present for one in (*self.pieces.each, *self.pieces.open_volumes()))

    @cached_property
    def parts(self) -> tuple[tuple[int, Place], ...]:
        """The parts of the unions and intersections of the scene: the number of the surface, and the place in it.

        >>> import swarm
        >>> ball = swarm.Sphere(0.5)
        >>> tube = swarm.Intersection([swarm.Cylinder(0.2), swarm.Plane((1.0, 0.0, 0.0), 0.1)])
        >>> swarm.Scene([swarm.Union([ball, tube])]).parts
        ((0, (0,)), (0, (1, 0)), (0, (1, 1)))
        """
        return tuple((i, place) for i, surface in enumerate(self.surfaces) for place in surface.places_of_parts())

    def common_faces(self) -> list[tuple[int, Place, Place]]:
        """Return the parts of unions with a common face, which is no wall: the surface, and the place of each part."""
        return [(i, *pair) for i, images in enumerate(self.pieces.images) for pair in images[0].common_places()]

    def doorways_of_parts(self) -> dict[tuple[int, Place], list[Surface]]:
        """Return the volumes in which walls of each part are open because another room is on their other side."""
        found: dict[tuple[int, Place], list[Surface]] = {}
        for i, place, volumes in zip(self.pieces.owners, self.pieces.places, self.pieces.doorways, strict=True):
            found.setdefault((i, place), []).extend(volumes)
        return found

    def names_laws(self) -> bool:
        """Whether only the name of a law is known, as from a file that was read without the code of the law."""
        return any(isinstance(law, str) for piece in self.pieces.each for law in piece.laws)

    def pull(self) -> Gravity | None:
        """Return gravity as the record of kernels."""
        return None if self.gravity is None else Gravity(*self.gravity)

    @once
    def moves(self) -> bool:
        """Whether a surface moves, or impacts may move it."""
        return self.reacts() or any(piece.motion is not None for piece in self.pieces.each)

    @once
    def reacts(self) -> bool:
        """Whether impacts move a surface."""
        return any(surface.reacts() for surface in self.surfaces)

    # --- The arguments of kernels --------------------------------------------------------------------

    def compiled(self, largest: float | None = None, apart: str | None = None) -> CompiledScene:
        """Return the scene with the records of kernels, for points, or for balls with radii up to `largest` [m].

        With `apart`, the name of a method, each listed solid is a wall; without it, solids of one kind are a field. In
        fixed steps of points each field, and each union of several rooms, is one wall too.

        Raises:
            SceneError: the scene has too many walls.
        """
        order = self._of_points.order
        in_steps = is_in_steps(apart) and (self.reach_of_steps() is not None or order.fields or order.unions)
        if largest is None and not in_steps and not (apart is not None and order.groups):
            return self._of_points
        return CompiledScene(self, largest, apart)

    @cached_property
    def _of_points(self) -> CompiledScene:
        return CompiledScene(self)

    def at_frame(self, seen: Mapping[str, Any], k: int) -> "Scene":
        """Return the scene with its reacting walls held at their poses in frame k of the observables of a run."""
        return self.placed(seen["wall_position"][k], seen["wall_orientation"][k]) if self.reacts() else self

    def placed(self, positions: ArrayLike, orientations: ArrayLike) -> "Scene":
        """Return the scene with its reacting walls held at the `wall_position` and `wall_orientation` of a frame."""
        surfaces = list(self.surfaces)
        for i, surface in enumerate(surfaces):
            if surface.reacts():
                turn = tuple(np.array(orientations)[i].tolist())
                rows = tuple(map(tuple, rotations.matrix(turn).tolist()))
                held = motions.Placed(tuple(np.array(positions)[i].tolist()), turn, rows)
                openings = tuple(held_opening(one, held) for one in surface.openings)
                surfaces[i] = replace(surface, mass=None, inertia=None, motion=held, openings=openings)
        return Scene(surfaces, self.gravity, self.period, self.plane, self.pairs)
