"""A surface as users describe it, checked. Kernels take it as a record: see contract.py."""

import math
from collections.abc import Callable, Iterable
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import motion as motions
from ..common import checks
from ..common.checks import Vector, array, one_of
from ..common.validated import Magnitude, Part, PositiveMagnitude, Validated
from ..errors import SceneError
from ..kernel.vector import Vec, vec
from . import rotation as rotations
from .area_samples import AreaSample, Region, by_lines
from .presence.doors import Opening, Spans, checked_spans, is_there
from .wall_law import checked_laws

# The least component along an axis of a unit vector that counts as along it.
_PARALLEL = 0.5
# A tilt of an axis up to this size is the round-off of a rotation.
TILT = 1e-15
SIDES = {"inside": 1.0, "outside": -1.0}

Box = tuple[Vector, Vector]
HalfSpace = tuple[Vector, float]
UNBOUNDED: Box = ((-math.inf,) * 3, (math.inf,) * 3)
# The arguments of a surface on which an impact, or a contact, depends besides its shape and its motion.
LAWS = "restitution", "friction", "rolling", "temperature", "accommodation", "laws"
# The number of a part, followed by the number of its part, and so on.
Place = tuple[int, ...]
# phi and its gradient (N, 3), functions of points (N, 3).
LevelSet = tuple[Callable[[Any], Any], Callable[[Any], Any]]


def _openings(name: str, value: Any) -> "tuple[Surface | Opening, ...]":
    """Return `value` as a tuple of openings, checked."""
    given = checks.list_of(name, value, "surfaces such as swarm.Sphere", Surface, Opening)
    for k, one in enumerate(given):
        opening = one.surface if isinstance(one, Opening) else one
        if not isinstance(opening, Surface):
            raise SceneError(f"{name}[{k}] must be a surface such as swarm.Sphere, got {opening!r:.200}")
        for law in fields(Surface):
            came = getattr(opening, law.name)
            if law.name == "present" and came is not None:
                raise SceneError(
                    f"{name}[{k}].present must be left out, an opening is no wall, got {came!r:.200}; say when it is "
                    "open as swarm.Opening(surface, times=...)"
                )
            is_held = law.name == "motion" and isinstance(came, motions.Placed)
            if law.name != "rotation" and came != law.default and not is_held:
                raise SceneError(f"{name}[{k}].{law.name} must be left out, an opening is no wall, got {came!r:.200}")
    return given


@dataclass(frozen=True, repr=False)
class Surface(Validated):
    """A rigid surface. See the subclasses for their arguments; these are common to all.

    Args:
        rotation: about the centre, or the origin where there is no `center`: None, a quaternion (w, x, y, z) of any
            length, {"axis": (x, y, z), "angle": rad}, or the rows of a rotation matrix. A union, an intersection or a
            field of many bodies applies it to each part or body.
        restitution: e in [0, 1]: an impact turns the normal velocity v_n into -e v_n. 1 keeps the energy.
        friction: Coulomb's coefficient, 0 or more: the tangential impulse, or force, opposes the slip; it is at most
            this times the normal one, and at most what stops the slip.
        rolling: the resistance to rolling of particles with a radius, of `Penalty`, 0 or more: an angular impulse
            against the angular velocity across the normal, of at most this times the radius times the normal impulse.
        temperature: k_B T of a thermal wall [J], as in `fill`, 0 or more; None: the wall exchanges no heat.
        accommodation: in [0, 1], the probability that a particle leaves a thermal wall diffusely, with a velocity of
            the wall's temperature, and not specularly.
        laws: `WallLaw`s in their order, such as `Lambert`, `Absorb`, `CercignaniLampis`, `Sticky` or user-defined laws.
            They give the velocity with which a particle leaves.
        motion: None, `Translation`, `Oscillation`, `Rotation`, `Path` or their sum, from where the surface is given.
            The laws of the wall act on the velocity relative to it.
        mass: the mass of a wall that impacts move [kg], above 0; None: impacts do not move it. It moves without
            turning: along its `motion` if that is a `Guide`, else freely, with the velocity of a `Translation` at the
            start.
        inertia: the moment of inertia of a wall that impacts turn about the axis of its `Rotation` [kg m^2], above 0;
            the rate is that at the start. With a mass too it is a pendulum with its weight at its `center`, without one
            the weight is on the axis.
        openings: surfaces without openings, laws and motion; the wall is absent inside each of them (with side
            "outside": outside of it; of many bodies, such as `Spheres`: in each body). A particle that reaches the wall
            there has escaped, and keeps its place and velocity. Only a wall at rest, or one with a mass, has openings;
            they move with it. An `Opening` is open for some times only.
        present: pairs (t0, t1) [s] that ascend, from 0 s on: the wall is present from t0 to t1. In the last pair t1 is
            infinite if the wall stays. None: it is always present.
    """

    rotation: Annotated[Any, rotations.quaternion] = field(default=None, kw_only=True)
    restitution: Part = field(default=1.0, kw_only=True)
    friction: Magnitude = field(default=0.0, kw_only=True)
    rolling: Magnitude = field(default=0.0, kw_only=True, metadata={"younger": True})
    temperature: Magnitude | None = field(default=None, kw_only=True)
    accommodation: Part = field(default=1.0, kw_only=True)
    laws: Annotated[Any, checked_laws] = field(default=(), kw_only=True)
    motion: Annotated[Any, motions.parts_of_wall] = field(default=None, kw_only=True)
    mass: PositiveMagnitude | None = field(default=None, kw_only=True)
    inertia: PositiveMagnitude | None = field(default=None, kw_only=True)
    openings: Annotated[Any, _openings] = field(default=(), kw_only=True)
    present: Annotated[Spans, checked_spans] = field(default=None, kw_only=True)
    # Arguments that a class does not take, and the sentence that says what to give instead.
    refused: ClassVar[tuple[str, ...]] = ()
    instead: ClassVar[str] = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if hasattr(self, "center"):
            checks.assign(self, center=checks.vector("center", self.center))
        side_sign(getattr(self, "side", "inside"))
        for name in self.refused:
            if (value := getattr(self, name)) is not None:
                raise SceneError(f"{name} must be None for {type(self).__name__}, got {value!r:.200}; {self.instead}")
        if self.temperature is None and self.accommodation != 1.0:
            raise SceneError(
                f"accommodation must go with a temperature, got {self.accommodation:g} and none; give temperature= "
                "(k_B T in joule), or leave accommodation out"
            )
        if self.laws and self.temperature is not None and self.accommodation == 1.0:
            raise SceneError(
                f"laws must be left out where all particles leave with the temperature, got {self.laws} and "
                "accommodation 1; give an accommodation below 1, or swarm.CercignaniLampis(temperature, 1.0, 1.0) as "
                "the first of the laws in place of the temperature"
            )
        motions.require_freedom(self.motion, self.mass, self.inertia)
        if self.mass is not None and self.inertia is not None and not hasattr(self, "center"):
            raise SceneError(
                f"mass must be None where an inertia is given to a {type(self).__name__}, which has no center that its "
                f"weight could be at, got {self.mass:g}"
            )
        if self.openings and not (self.motion is None or self.reacts() or isinstance(self.motion, motions.Placed)):
            raise SceneError(
                f"openings must be of a wall at rest, or of one with a mass, got {len(self.openings)} of a "
                f"{type(self).__name__} with a motion; leave that out, or the openings"
            )

    def __repr__(self) -> str:
        """Return the call that makes the surface, without defaults."""
        return self._call((), sorted(fields(self), key=lambda field: bool(field.kw_only)))

    def _call(self, given: Iterable[str], named: Iterable[Field[Any]]) -> str:
        """Return the call with the arguments `given`, and the `named` fields that differ from their defaults."""
        changed = [one for one in named if one.default is MISSING or getattr(self, one.name) != one.default]
        arguments = *given, *(f"{one.name}={getattr(self, one.name)!r}" for one in changed)
        return f"{type(self).__name__}({', '.join(arguments)})"

    def numbers(self) -> Any:
        """Return the record for kernels, before it is rotated."""
        raise NotImplementedError

    def walls(self) -> tuple[Any, ...]:
        """Return the records for kernels: one for a smooth surface, one for each smooth part of a cavity with edges."""
        return (rotations.rotated(self.rotation, self.numbers()),)

    def walls_of_balls(self, largest: float) -> tuple[Any, ...]:
        """Return the records for kernels of balls, one for each of `walls` and in their order; each has a `grown`.

        No radius of a ball is above `largest` [m].
        """
        return self.walls()

    def why_no_balls(self) -> str | None:
        """Why balls cannot meet the surface, for the sentence of an error; None where they can."""
        if all(getattr(wall, "holds_balls", False) for wall in self.walls_of_balls(0.0)):
            return None
        return "of which the parallel surface is not known"

    def largest_ball(self) -> float:
        """The radius below which balls touch the surface at one point only [m]: its smallest radius of curvature."""
        return math.inf

    def most_bent_at(self) -> Vector | None:
        """The point of the surface with this radius; None where it is not computed."""
        return None

    def open_volumes(self, between: bool = False) -> tuple["Surface", ...]:
        """Return the volumes of its openings, `present` while these are open: those `between` rooms, or all others."""
        return tuple(volume_of(one) for one in self.openings if (isinstance(one, Opening) and one.between) == between)

    def is_there(self, time: float) -> bool:
        """Whether the wall is present at a time [s]."""
        return is_there(self.present, time)

    def reacts(self) -> bool:
        """Whether impacts move the surface."""
        return self.mass is not None or self.inertia is not None

    def at_rest(self) -> "Surface":
        """Return the surface without motion and mass, at the place where it is given."""
        return self if self.motion is None else replace(self, motion=None, mass=None, inertia=None)

    def own_center(self) -> Vector:
        """Return the centre in the frame in which the surface is not rotated; both frames have the same origin."""
        return rotations.turned_back(self.rotation, self.center)  # type: ignore[attr-defined]

    def size(self) -> float:
        """Return the characteristic length of the surface [m], or infinity."""
        raise NotImplementedError

    def bounds(self) -> Box:
        """Return a box (lower, upper) around the admissible side; infinite where that side is open."""
        raise NotImplementedError

    def half_spaces(self) -> list[HalfSpace]:
        """Return half-spaces n.r <= offset around the admissible side that are tighter than `bounds`."""
        return []

    def flat_faces(self) -> NDArray[np.float64]:
        """Return flat faces of an outline or a mesh: rows of unit normals, along which phi grows, and offsets."""
        return np.empty((0, 4))

    def with_flat_face_out(self, number: int, by: float) -> "Surface | None":
        """Return the surface with one of `flat_faces` moved along its normal by `by` [m]; None: it cannot be moved."""
        return None

    def places_of_flat_face(self, number: int, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Return points on one of `flat_faces`, and on its edges, (3, count) each; None: they are not known."""
        return None

    def open_faces(self) -> list[HalfSpace]:
        """Return the faces (n, offset) at which the surface ends without a wall; n.r > offset is beyond one."""
        return []

    def known_in(self) -> Box | None:
        """Return the box in which the surface is defined, and particles must stay; None: it is defined everywhere."""
        return None

    def shifted(self, shift: Vector) -> "Surface":
        """Return the surface moved by a shift [m]."""
        x, y, z = (a + b for a, b in zip(self.center, shift, strict=True))  # type: ignore[attr-defined]
        return replace(self, center=(x, y, z))  # type: ignore[call-arg]

    def turned(self, turn: rotations.Quaternion) -> "Surface":
        """Return the surface, with its openings, rotated about the origin."""
        given: dict[str, Any] = {"rotation": rotations.after(turn, self.rotation)}
        if hasattr(self, "center"):
            given["center"] = rotations.turned(turn, self.center)
        return replace(self, **given, openings=tuple(_turned_opening(one, turn) for one in self.openings))

    def is_solid(self) -> bool:
        """Whether the outside is admissible: particles are kept out of it."""
        return getattr(self, "side", "inside") == "outside"

    def require_compiled(self) -> None:
        """Raise a `SceneError` if Numba cannot compile a user-defined function, before a kernel needs it."""

    # Whether the inner side is convex: then no part of it is beyond its own wall.
    is_convex = False
    # Whether the surface has many bodies, or sides, of one kind, which kernels take as one field.
    is_field = False
    # Whether kernels take a field as one soft wall.
    is_one_wall = False
    # The noun for one of its faces, if its walls are faces between edges.
    face_noun: ClassVar[str] = ""
    # Whether a solid of this kind has edges, and whether its wall may have a point without a normal.
    has_edges = False
    may_have_tip = False
    # The nouns for a cavity, a solid, and both in a plane; None: the name of the class.
    nouns: ClassVar[tuple[str, str, str, str] | None] = None
    # The parts of a union or an intersection; the laws of the groups of a mesh.
    parts = tuple["Surface", ...]()
    groups = None

    # --- Parts and bodies: the surface itself where it has none ---

    @property
    def rooms(self) -> tuple[tuple["Surface", ...], ...]:
        """Return the admissible side as a union of rooms: intersections of surfaces without parts."""
        return ((self,),)

    def unproved(self) -> str:
        """Return a defect that a user-defined phi may have, for errors; empty if the engine knows that it has none."""
        return ""

    def surfaces(self) -> tuple["Surface", ...]:
        """Return the surfaces of all rooms, one after the other, with the arguments of the whole."""
        return (self,)

    def places(self) -> tuple[Place, ...]:
        """Return the place of the part of each of the `surfaces`: its number, followed by those of parts of parts."""
        return ((),)

    def places_of_parts(self) -> tuple[Place, ...]:
        """Return the places of all parts, in order."""
        return ()

    def moving_apart(self) -> list[tuple["Surface", "Surface"]]:
        """Return pairs of surfaces of its rooms that have a face in common at the start and different motions."""
        return []

    def common_places(self) -> list[tuple[Place, Place]]:
        """Return pairs of places of parts that have a face in common."""
        return []

    def reaching(self, reach: float) -> "Surface":
        """Return the surface with rooms that overlap by `reach` [m] where they have a face in common."""
        return self

    def runs(self, walls: int) -> list[tuple["Surface", int]]:
        """Return its walls in runs with the same laws: (the surface that has the laws, the number of walls)."""
        return [(self, walls)]

    def solids(self) -> list["Surface"]:
        """Return every body as a separate surface."""
        return [self]

    def as_one_wall(self) -> "Surface":
        """Return the surface for soft walls: a field, or a union of several rooms, is one wall."""
        return self

    def body_count(self) -> int:
        """Return the number of bodies of a field, else 0."""
        return 0

    def wall_count(self, of_balls: bool) -> int:
        """Return the number of walls that points, or balls, meet, with all members of a field."""
        return len(self.walls())

    def faces_of_balls(self, largest: float) -> tuple[Any, NDArray[Any]]:
        """Return (the members that soft balls with radii up to the largest one [m] meet, the face of each member).

        For a field or a mesh. A ball touches a face at one place only: a face is a body, or members that join without a
        corner around the balls.
        """
        raise NotImplementedError

    def common(self) -> dict[str, Any]:
        """Return all arguments common to surfaces except the rotation: laws, motion, openings and `present`."""
        return {one.name: getattr(self, one.name) for one in fields(Surface) if one.name != "rotation"}

    def rooms_of_balls(self) -> "tuple[Any, ...]":
        """Return the rooms that balls meet: for each the surfaces around it."""
        return self.rooms

    def is_foam(self) -> bool:
        """Whether particles are inside many bodies, not outside them."""
        return False

    # --- Pictures, and random points ---

    def enclosing_box(self) -> Box:
        """Return a box (lower, upper) around a solid or a cavity; infinite where it is unbounded."""
        return (replace(self, side="inside") if self.is_solid() else self).bounds()  # type: ignore[call-arg]

    def enclosed(self, across: int | None) -> float | None:
        """Return the volume within its wall [m^3], or with the axis `across` a plane the area in this plane [m^2].

        The plane goes through the origin. None where no closed form is known, or where the volume is unbounded.
        """
        return None

    def radius_of_ball(self) -> float | None:
        """The radius of the ball with this surface [m]; None for another shape."""
        return None

    def area_samples(self, bounds: Region, across: int | None) -> list[AreaSample]:
        """Return the sampler of points that are uniform in its area within the bounds (lower, upper).

        With the axis `across` a plane they are uniform in its length in that plane.

        Raises:
            SceneError: points of this kind of surface cannot be drawn, or the surface is not bounded.
        """
        return list(by_lines(self, bounds, across))

    def filled(self) -> "Surface":
        """Return a solid as the cavity of the same shape, and a cavity itself."""
        try:
            return replace(self, side="inside") if self.is_solid() else self  # type: ignore[call-arg]
        except SceneError:
            return self

    def level_sets(self) -> list[LevelSet]:
        """Return level sets of all smooth walls, in order; for a solid with edges those of the cavity of its shape."""
        whole = self.filled()
        if type(whole).phi is not Surface.phi:
            still = whole.at_rest()
            return [(lambda points: still.phi(points.T), lambda points: still.gradient(points.T).T)]
        return [_level_set(wall) for wall in whole.walls()]

    def own_frame(self) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Return the axes of its own frame, columns of a matrix; and the arguments that differ in that frame."""
        return rotations.matrix(self.rotation), {}

    def triangulated(
        self, low: NDArray[np.float64], high: NDArray[np.float64], frame: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]] | None:
        """Return its last wall as points (V, 3) and triangles (T, 3), in a box along the columns of a frame.

        None where a grid of phi does as well.
        """
        return None

    def upright(self, low: float, high: float) -> tuple[NDArray[np.float64], NDArray[np.int64]] | None:
        """Return the walls on an outline as triangles, between two heights along its axis; None without an outline."""
        return None

    def corner_lines(self, low: float, high: float) -> list[NDArray[np.float64]]:
        """Return the lines (k, 3) on the corners of an outline between two heights."""
        return []

    def plane_curves(self, across: int) -> list[NDArray[np.float64]] | None:
        """Return its curves (k, 3) in the plane across an axis; None where they are found on a grid."""
        return None

    def halves(self) -> NDArray[np.float64] | None:
        """Return half of the extent (n, 3) [m] of each of many bodies along its own axes; None for other axes."""
        return None

    # --- In words ---

    def beyond(self) -> str:
        """Return the word for the side that is not admissible."""
        return "inside" if self.is_solid() else "outside"

    def admissible(self, phi: float) -> str:
        """Return the text that says which side is admissible, for a point with this phi on the other side."""
        if self.is_solid():
            return f"admissible is its outside, where phi is 0 or more, and phi = {phi:.6g} there"
        return f"admissible is its inside, where phi is 0 or less, and phi = {phi:.6g} there"

    def lids(self, across: int) -> list[float]:
        """Return the distances [m] of walls across an axis from the origin: balls in a plane must fit between them."""
        walls = ((wall, wall.flat_normal()) for wall in self.walls_of_balls(0.0))
        return [
            -wall.distance(Vec(0.0, 0.0, 0.0))
            for wall, normal in walls
            if normal is not None and abs(normal[across]) > _PARALLEL
        ]

    def may_be_passed(self) -> bool:
        """Whether particles may be on both sides of its wall, as beside a solid or in a cavity that is not convex."""
        return self.is_solid() or not self.is_convex

    def extent(self) -> float:
        """Distance from the origin within which the surface lies [m]; for an unbounded one its particular points."""
        raise NotImplementedError

    def is_unturned_by(self, axis: Vector, center: Vector) -> bool:
        """Whether a rotation about the unit vector `axis` through a point leaves the surface where it is."""
        return False

    def turning_center(self, axis: Vector) -> Vector | None:
        """Return a centre about which a rotation about this axis leaves the surface where it is; None without one."""
        center: Vector | None = getattr(self, "center", None)
        return center if center is not None and self.is_unturned_by(axis, center) else None

    def admits(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether each of the points (3, N) is admissible at time 0; where phi is not a number it is not."""
        return np.asarray(side_sign(getattr(self, "side", "inside")) * self.phi(points, 0.0) <= 0.0)

    def phi(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        """Return the implicit function at points (3, N): below 0 inside, 0 on the surface, above 0 outside; shape (N,).

        A surface that moves is taken at `time` [s].
        """
        rows = self._own_rows(points, time)
        # Where a formula has no value, phi is NaN, which counts as outside.
        with np.errstate(all="ignore"):
            return np.asarray(np.maximum.reduce([wall.phi(rows) for wall in self.walls()]))

    def gradient(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        """Return the gradient of phi at points (3, N); shape (3, N). On an edge it is that of one of the parts."""
        found = self._own_gradient(points, time)
        return found if self.motion is None else motions.pose(self.motion, time).turned(found)

    def _own_gradient(self, points: ArrayLike, time: float) -> NDArray[np.float64]:
        """Return the gradient of phi in the frame in which the surface is given."""
        rows = self._own_rows(points, time)
        with np.errstate(all="ignore"):
            parts = [slopes_of(wall, rows) for wall in self.walls()]
            largest = np.argmax([wall.phi(rows) for wall in self.walls()], axis=0)
        return np.asarray(np.choose(largest, parts))

    def reaching_outside(
        self, points: NDArray[np.float64], radius: NDArray[np.float64], time: float = 0.0
    ) -> NDArray[np.float64]:
        """Return how far balls at points (3, N), with their radii (N,), reach out of the admissible side (N,) [m].

        The value is below 0 within, and NaN where the place of a ball is NaN.
        """
        rows = self._own_rows(points, time)
        with np.errstate(all="ignore"):
            walls = [wall.grown(0.0) for wall in self.walls_of_balls(0.0)]
            return np.asarray(np.maximum.reduce([wall.side * wall.phi(rows) for wall in walls]) + radius)

    def lost(self, points: NDArray[np.float64], time: float) -> NDArray[np.bool_]:
        """Whether balls with their centres at points (3, N) are beyond walls that they meet from both sides.

        The distance from other walls determines on which side a ball is.
        """
        return np.zeros(points.shape[1], np.bool_)

    def _own_rows(self, points: ArrayLike, time: float) -> Vec:
        """Return points of the scene in the frame in which the surface is given."""
        rows = _rows(points)
        if self.motion is None:
            return rows
        flat = np.array(rows).reshape(3, -1)
        return vec(motions.pose(self.motion, time).given(flat).reshape(np.shape(rows)))


def _level_set(wall: Any) -> LevelSet:
    """Return the level set of a wall from its record for kernels."""
    return (
        lambda points: np.broadcast_to(wall.phi(vec(points.T)), len(points)),
        lambda points: np.ascontiguousarray(slopes_of(wall, vec(points.T)).T),
    )


def slopes_of(wall: Any, rows: Vec) -> NDArray[np.float64]:
    """Return the gradient of phi, from the record of a wall for kernels, at points, (3, N)."""
    return np.array(np.broadcast_arrays(*wall.gradient(rows), rows.x)[:3])


def is_on_axis(point: Vector, axis: Vector, center: Vector) -> bool:
    """Whether a point is on the axis, a unit vector through the centre."""
    arm = np.array(point) - center
    return bool(np.abs(np.cross(arm, axis)).max() <= TILT * max(1e-300, np.abs(arm).max()))


def is_along(direction: Vector, axis: Vector) -> bool:
    """Whether a unit vector is parallel to the unit vector `axis`, in either sense."""
    return bool(np.abs(np.cross(direction, axis)).max() <= TILT)


def volume_of(opening: Surface | Opening) -> Surface:
    """Return the volume of an opening, present while the opening is open."""
    return replace(opening.surface, present=opening.times) if isinstance(opening, Opening) else opening


def held_opening(opening: Surface | Opening, held: motions.Placed) -> Surface | Opening:
    """Return an opening where a run has moved its wall."""
    if isinstance(opening, Opening):
        return replace(opening, surface=replace(opening.surface, motion=held))
    return replace(opening, motion=held)


def _turned_opening(opening: Surface | Opening, turn: rotations.Quaternion) -> Surface | Opening:
    if isinstance(opening, Opening):
        return replace(opening, surface=opening.surface.turned(turn))
    return opening.turned(turn)


def _rows(points: ArrayLike) -> Vec:
    rows = array("points", points)
    if rows.ndim not in (1, 2) or rows.shape[0] != 3:
        raise SceneError(f"points must have shape (3, N), got {rows.shape}")
    return vec(rows)


def side_sign(side: str) -> float:
    """+1 for "inside", -1 for "outside"."""
    return SIDES[one_of("side", side, SIDES)]


def rotated_box(rotation: Any, box: Box, center: Vector) -> Box:
    """Return bounds of a box rotated about `center`; an axis along which the box lacks one of its ends is open."""
    if rotation is None:
        return box
    matrix, (low, high) = rotations.matrix(rotation), np.array(box)
    is_open = ~(np.isfinite(low) & np.isfinite(high))
    low, high = np.where(is_open, center, low), np.where(is_open, center, high)
    middle, half = (low + high) / 2.0, (high - low) / 2.0
    middle, half = center + rotations.product(matrix, middle - center), rotations.product(np.abs(matrix), half)
    half[(np.abs(matrix[:, is_open]) > TILT).any(axis=1)] = math.inf
    return tuple((middle - half).tolist()), tuple((middle + half).tolist())


def extents(axes: NDArray[np.float64], semi_axes: Any) -> Vector:
    """Return half extents along x, y, z of an ellipsoid; with an infinite semi-axis it is a cylinder."""
    tilts = np.where(abs(axes) > TILT, axes, 0.0)
    x, y, z = (math.hypot(*(n * a for n, a in zip(row, semi_axes, strict=True) if n)) for row in tilts.tolist())
    return x, y, z


def shown(point: Any, digits: int = 4) -> str:
    """Return a point as errors write it, with `digits` digits."""
    return f"({', '.join(f'{part:.{digits}g}' for part in point)})"


def named(i: int, surface: Surface) -> str:
    """The surface with a number in a scene, as errors name it: surfaces[2] (Sphere)."""
    return f"surfaces[{i}] ({type(surface).__name__})"


def farthest(point: Vector) -> float:
    """Return the largest magnitude of a coordinate of a point."""
    return max(map(abs, point))


def box_around(center: Vector, half: Vector, side: str) -> Box:
    """Return bounds of the cavity of a body with these half extents; the bounds of a solid are infinite."""
    if side == "outside":
        return UNBOUNDED
    (cx, cy, cz), (hx, hy, hz) = center, half
    return (cx - hx, cy - hy, cz - hz), (cx + hx, cy + hy, cz + hz)
