"""The scene for kernels: its walls by their kinds, their laws and openings, and all numberings of walls."""

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .contact.laws import NONE, Laws, Moves, Span, Thermal, owned_in
from .errors import SceneError
from .kernel.vector import Vec
from .surfaces.fields.grouped import Order, order_of
from .surfaces.fields.many import in_straight_flights, members_of
from .surfaces.fields.members import Members
from .surfaces.in_motion.moving import carried
from .surfaces.periodic.images import corners_of
from .surfaces.periodic.period import Period, cell_in
from .surfaces.pieces import Pieces
from .surfaces.presence.doors import walls_then, was_there
from .surfaces.presence.joined import with_rooms
from .surfaces.presence.openings import Opened, openings_in
from .surfaces.surface import Surface
from .surfaces.union import Place
from .surfaces.upright import upright
from .surfaces.walls import Field, Listed, Walls, all_walls

if TYPE_CHECKING:
    from .scene import Scene

# The most walls for which kernels are compiled: with `contact_step` this number takes three minutes.
MOST_WALLS = 24
# The `apart` of a scene in which impacts move a wall: each listed solid is a wall.
REACTING = "walls that react"
# The `apart` of a method that cuts its steps at impacts: each listed solid is a wall, and a field keeps its members.
CUT = "steps that are cut at impacts"
# The law of a wall without temperature.
_NO_HEAT = Thermal(0.0, 0.0)


class PartsOfRows(NamedTuple):
    """The part of each row (`number` if its surface has no parts), and the number of parts."""

    rows: tuple[int, ...]
    number: int


class Numbering:
    """The numberings of walls, and all translations among them.

    | number | counted things | in the order of |
    | --- | --- | --- |
    | surface | the entries of `Scene.surfaces` | the user |
    | part | the simple parts of unions and intersections, `Scene.parts` | surfaces |
    | piece | simple surfaces, `Pieces.each`: a surface or a part, or an image of one | surfaces, images, parts |
    | row | the entries of sums of impulses and heat: a wall, or a field with all its members | walls |
    | wall | the walls that a flight meets, each member of a field | kinds: fields, groups, others, unions |

    A wall belongs to one row, a row to one piece, and a piece to one surface and at most one part.

    Attributes:
        pieces_of_rows: the piece of each row, (rows,).
        surfaces_of_rows: the surface of each row.
        parts_of_rows: the part of each row; None if no surface has parts.
        pieces_of_walls, rows_of_walls: the piece and the row of each wall, (walls,).
        members: (2, walls), the surface of each wall; and its number in a field, or else its part, or else -1.
    """

    def __init__(self, pieces: Pieces, order: Order, parts: Sequence[tuple[int, Place]]) -> None:
        rows = np.array(order.rows(pieces.each), np.int64).reshape(-1, 2)
        number = {part: k for k, part in enumerate(parts)}
        part_of = np.array([number.get(part, -1) for part in zip(pieces.owners, pieces.places, strict=True)], np.int64)
        self.pieces_of_rows = rows[:, 0]
        self.surfaces_of_rows = [pieces.owners[i] for i in rows[:, 0]]
        self.parts_of_rows: PartsOfRows | None = None
        if parts:
            known = part_of[self.pieces_of_rows]
            self.parts_of_rows = PartsOfRows(tuple(np.where(known < 0, len(parts), known).tolist()), len(parts))
        self.pieces_of_walls = rows[:, 0].repeat(rows[:, 1])
        self.rows_of_walls = np.arange(len(rows)).repeat(rows[:, 1])
        self.members = np.array(
            [np.array(pieces.owners, np.int64)[self.pieces_of_walls], part_of[self.pieces_of_walls]]
        )
        # The walls of fields come first.
        first = 0
        for i in order.fields:
            count, numbers = pieces.each[i].wall_count(order.of_balls), pieces.each[i].numbers()
            self.members[1, first : first + count] = np.repeat(numbers, count // len(numbers))
            first += count

    def split(self, values: NDArray[Any]) -> list[NDArray[Any]]:
        """Return the values of the members of each surface, from (..., members) of all surfaces in order."""
        surface, member = self.members
        counts = np.zeros(int(surface.max()) + 1, np.int64)
        np.maximum.at(counts, surface, member + 1)
        return np.split(values, np.cumsum(np.maximum(counts, 1))[:-1], axis=-1)


def is_in_steps(apart: str | None) -> bool:
    """Whether a method with this `apart` has steps, which may end outside of walls and of a cell."""
    return apart is not None and apart != REACTING


class CompiledScene:
    """A scene as kernels and engines take it, made from its description.

    Args:
        scene: the description.
        largest: the largest radius of the balls in the scene [m]; None: the particles are points.
        apart: the words of errors for a method that takes listed solids of one kind as single walls, `REACTING` and
            `CUT` among them; None: more than a few such solids are a field.

    Attributes:
        scene, largest: as the arguments.
        pieces: the pieces that the particles meet.
        order: the numbers of the pieces in the order of the walls.

    Raises:
        SceneError: there are more walls than kernels can be compiled for.
    """

    def __init__(self, scene: "Scene", largest: float | None = None, apart: str | None = None) -> None:
        self.scene, self.largest, self._apart = scene, largest, apart
        # The walls of a scene without motion; the key says of each piece whether it is present.
        self._known: dict[tuple[bool, ...], Walls] = {}
        in_steps = largest is None and is_in_steps(apart)
        reach = scene.reach_of_steps() if in_steps else largest
        self.pieces = scene.pieces if reach is None else scene.pieces_of_balls(reach)
        if in_steps and apart != CUT:
            self.pieces = self.pieces.as_walls()
        self.order = order_of(self.pieces.each, apart is None, self.pieces.rooms(), largest is not None)
        walls = len(self._spans)
        if walls > MOST_WALLS:
            why = "" if largest is None else f" with balls of a radius of {largest:g} m"
            why = why if apart is None else f" with {apart}"
            raise SceneError(
                f"surfaces must have at most {MOST_WALLS} walls in all{why}, got {walls} of "
                f"{len(self.scene.surfaces)} surfaces: each wall is compiled into the kernels, which would "
                "take minutes; remove some (a box has 3 walls, a capped cylinder 2, most others 1), or use solids of "
                "one kind: any number of them is one field for Impact if nothing moves, and one surface of many "
                "bodies, such as swarm.Spheres, always is"
            )

    def __reduce__(self) -> tuple[Any, ...]:
        # Copies make the walls anew.
        return CompiledScene, (self.scene, self.largest, self._apart)

    def of_balls(self, largest: float) -> "CompiledScene":
        """Return the compiled scene for balls with radii up to `largest` [m]."""
        return CompiledScene(self.scene, largest, self._apart)

    @cached_property
    def numbering(self) -> Numbering:
        """The numberings of walls."""
        return Numbering(self.pieces, self.order, self.scene.parts)

    @cached_property
    def _spans(self) -> list[tuple[int, int]]:
        return self.order.rows(self.pieces.each, together=True)

    @cached_property
    def laws(self) -> Laws | None:
        """The laws of every wall; None if no surface has a law."""
        runs: list[tuple[int, Surface, int]] = []
        for i, walls in self._spans:
            piece = self.pieces.each[i]
            runs += [(i, *run) for run in piece.runs(walls)]
        given, owners = [surface for _i, surface, _walls in runs], [self.pieces.owners[i] for i, *_rest in runs]
        spans = [(k, walls) for k, (_i, _surface, walls) in enumerate(runs)]
        laws = Laws(
            _of_walls([surface.restitution for surface in given], spans, 1.0),
            _of_walls([surface.friction for surface in given], spans, 0.0),
            _of_walls([_thermal(surface) for surface in given], spans, _NO_HEAT),
            Moves(0.0) if self.scene.moves() else None,
            owned_in(spans, given, owners),
        )
        return None if laws == NONE else laws.in_plane(self.scene.across())

    def lawful(self) -> list[Surface]:
        """Return the surface with the laws of each wall."""
        runs = [run for i, walls in self._spans for run in self.pieces.each[i].runs(walls)]
        return [surface for surface, walls in runs for _wall in range(walls)]

    def openings(self, moment: float = 0.0, some: list[tuple[int, int]] | None = None) -> tuple[Opened, ...] | None:
        """Return the openings of the walls in the frame that ends at a moment [s], or None.

        They are the openings of all walls, or of `some` consecutive walls: (piece, number of walls) each.
        """
        spans, volumes, doorways = self._spans if some is None else some, self.pieces.volumes, self.pieces.doorways
        if self.largest is None:
            return openings_in(spans, (volumes, doorways), moment) or None
        # Balls meet a union as one surface, so doors between its rooms open nothing; files still have escape times.
        made = openings_in(spans, (volumes, ((),) * len(volumes)), moment)
        return made if made or any(doorways) else None

    def walls(self, moment: float = 0.0) -> Walls:
        """Return the walls by their kinds, in the frame, or the piece of a frame, that ends at a moment [s]."""
        if self.scene.moves():
            return self._made(moment)
        there = tuple(was_there(piece.present, moment) for piece in self.pieces.each)
        if there not in self._known:
            self._known[there] = self._made(moment)
        return self._known[there]

    def walls_of_bodies(self, own: Sequence[Surface], moment: float = 0.0) -> Walls:
        """Return the walls for bodies at a moment [s]: the walls of the scene, then the surfaces of a body, at rest."""
        return self._made(moment, own)

    @cached_property
    def of_no_mass(self) -> "CompiledScene | None":
        """The scene of the surfaces that impacts do not move; None if impacts move all surfaces."""
        scene = self.scene
        rest = [surface for surface in scene.surfaces if not surface.reacts()]
        made = type(scene)(rest, scene.gravity, plane=scene.plane) if rest else None
        return None if made is None else made.compiled(self.largest, REACTING)

    def cell(self) -> Period | None:
        """Return the periodic cell, or None."""
        period, gravity = self.scene.period, self.scene.gravity
        if period is None:
            return None
        pulls = gravity or (0.0, 0.0, 0.0)
        falls = [0.0 if length is None else -pull * length for pull, length in zip(pulls, period, strict=True)]
        fall, has_fields = Vec(*falls) if any(falls) else None, bool(self.order.fields or self.order.groups)
        return cell_in(period, self.scene.surfaces, has_fields, fall, self.largest or 0.0)

    def fields(self) -> list[int]:
        """Return the numbers of the surfaces that are fields."""
        return [self.pieces.owners[i] for i in self.order.fields]

    def unions(self) -> list[int]:
        """Return the numbers of the surfaces that are unions of several rooms."""
        return [self.pieces.owners[rooms[0][0]] for rooms in self.order.unions]

    # --- Walls ---------------------------------------------------------------------------------------

    @cached_property
    def _groups(self) -> list[Members]:
        """The groups of listed solids that are fields."""
        repeated = None if self.scene.period is None else corners_of(self.scene.period)
        return [members_of(self._pieces_at(group), repeated, self.largest) for group in self.order.groups]

    def _pieces_at(self, numbers: Sequence[int]) -> list[Surface]:
        return [self.pieces.each[i] for i in numbers]

    def _made(self, moment: float, own: Sequence[Surface] | None = None) -> Walls:
        """Return the walls for particles or, with the surfaces of a body, for bodies."""
        scene, order, fields = self.scene, self.order, self._pieces_at(self.order.fields)
        straight = scene.gravity is None and own is None

        def taken(members: Members) -> Members:
            return in_straight_flights(members, scene.period is not None) if straight else members

        def listed(numbers: Sequence[int]) -> list[Any]:
            return [wall for one in self._pieces_at(numbers) for wall in walls_then(one, moment, self.largest)]

        if scene.moves():
            surfaces = [*self._pieces_at(order.alone()), *(own or ())]
            walls = carried(fields, surfaces, moment, self.largest, in_rooms=bool(order.unions))
        else:
            many = [(one.present is None, *walls_then(one, moment, self.largest)) for one in fields]
            walls = Walls((
                *(Field(taken(members) if lasts else members) for lasts, members in many),
                *(Listed(taken(group)) for group in self._groups),
                *listed(order.others), *all_walls(own or ()).each, *listed(order.joined()),
            ))  # fmt: skip
        rooms = [[self._pieces_at(room) for room in union] for union in order.unions]
        made: Walls = upright(with_rooms(walls, rooms), scene.across())
        return made


def _of_walls(values: list[Any], spans: list[tuple[int, int]], neutral: Any) -> tuple[Any, ...] | None:
    """Return the value of every wall, from values and spans (value, number of walls); None if all are neutral."""
    if all(value == neutral for value in values):
        return None
    return tuple(values[k] if walls == 1 else Span(values[k], float(walls)) for k, walls in spans)


def _thermal(surface: Surface) -> Thermal:
    """Return the temperature and the accommodation of a surface, for kernels."""
    if surface.temperature is None:
        return _NO_HEAT
    return Thermal(surface.temperature, surface.accommodation)
