"""The scene: surfaces and gravity, checked, and as kernels take them."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import checks, notebook
from . import motion as motions
from . import plane as planes
from .errors import SceneError
from .kernel.gravity import Gravity
from .kernel.vector import Vec
from .pairs import Pairs, checked_pairs
from .pieces import Pieces, doorways_of_pieces, volumes_of_pieces, with_reach
from .surfaces import required
from .surfaces import rotation as rotations
from .surfaces.doors import was_there
from .surfaces.fields.grouped import walls_in
from .surfaces.fields.many import Many, in_straight_flights
from .surfaces.fields.members import Members
from .surfaces.images import Lengths, images_of, lengths_of
from .surfaces.joined import with_rooms
from .surfaces.moving import carried
from .surfaces.openings import require_few
from .surfaces.period import Period, cell_in
from .surfaces.surface import Surface
from .surfaces.upright import upright
from .surfaces.walls import Walls

# Most walls that kernels are compiled for: 24 with `contact_step` take three minutes.
MOST_WALLS = 24
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
class Scene(Pieces):
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

    def walls_of(self, surface: Surface) -> tuple[Any, ...]:
        """The walls of one of its surfaces that its particles meet."""
        return surface.walls() if self._largest is None else surface.walls_of_balls(self._largest)

    def moves(self) -> bool:
        """Whether a surface moves, or may be moved."""
        return self._moves

    def reacts(self) -> bool:
        """Whether impacts move a surface."""
        return self._reacts

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

    def _taken(self, members: Members) -> Members:
        """A field as kernels take it where nothing moves."""
        return in_straight_flights(members, self.period is not None) if self.gravity is None else members

    def walls_of_rows(self) -> NDArray[np.int64]:
        """The number of walls of each row of `owners`: the members of a field, else one."""
        fields = [len(self.pieces[i]) for i in self.order.fields]  # type: ignore[arg-type]
        return np.array([*fields, *[1] * (len(self.owners()) - len(fields))], np.int64)

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

    @cached_property
    def _moves(self) -> bool:
        return self._reacts or any(piece.motion is not None for piece in self.pieces)

    @cached_property
    def _reacts(self) -> bool:
        return any(surface.reacts() for surface in self.surfaces)

    @cached_property
    def _walls(self) -> dict[tuple[bool, ...], Walls]:
        """The walls for particles where nothing moves, by which of the surfaces are there."""
        return {}

    def _upright(self, walls: Walls) -> Walls:
        """Walls as a scene of two dimensions takes them."""
        across = self.across()
        return walls if across is None else upright(walls, across)

    def __getstate__(self) -> dict[str, Any]:
        # Whoever has a copy makes walls of its own: `apart` of other walls, a worker of what is compiled there.
        return {name: value for name, value in self.__dict__.items() if name != "_walls"}

    def _has_fields(self) -> bool:
        return bool(self.order.fields or self.order.groups)

    def fields(self) -> list[int]:
        """The surfaces that are many bodies."""
        return [self.owners_of_pieces[i] for i in self.order.fields]
