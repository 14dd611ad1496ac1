"""The pieces of a scene: its surfaces, those of which its unions are made, and images; what every wall of them has."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .contact.laws import NONE, Laws, Moves, Span, Thermal, owned_in
from .errors import SceneError
from .surfaces.doors import instants_of
from .surfaces.facets.mesh import Mesh
from .surfaces.fields.grouped import Order, order_of
from .surfaces.fields.many import members_of
from .surfaces.fields.members import Members
from .surfaces.images import Lengths, corners_of
from .surfaces.openings import Opened, openings_in, reaches, volumes_of
from .surfaces.surface import Surface, volume_of
from .surfaces.union import Joined, Place, nodes_of, surfaces_of
from .volume import Volume

# Of the extent of what kernels take as unions, how far rooms with a face in common overlap: more than what counts as
# touching a wall.
_REACH = 1e-9
# The law of a wall without temperature.
_NO_HEAT = Thermal(0.0, 0.0)


class PartsOfRows(NamedTuple):
    """The part that each row of a scene belongs to, `number` where its surface has none; how many parts there are."""

    rows: tuple[int, ...]
    number: int


class Pieces(Volume):
    """The pieces of a `Scene`."""

    # The volumes in which every piece is open.
    _volumes: tuple[tuple[Surface, ...], ...]
    # Those in which it is where another room of its union is behind it.
    _doorways: tuple[tuple[Surface, ...], ...]

    # The largest radius of the balls in the scene [m]; None: its particles are points.
    _largest: float | None = None
    # Whether listed solids of one kind may be a field.
    _together: bool = True

    def moves(self) -> bool:
        """Whether a surface moves, or may be moved."""
        raise NotImplementedError

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
            _of_walls([surface.restitution for surface in given], spans, 1.0),
            _of_walls([surface.friction for surface in given], spans, 0.0),
            _of_walls([_thermal(surface) for surface in given], spans, _NO_HEAT),
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
        """Of every piece the surface, and the place of its part in that."""
        every = ((i, image) for i, images in enumerate(self._images) for image in images)
        return [(i, place) for i, image in every for place in _places_of(image)]

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
        """Of each wall of the scene its surface, and its number in the field or of the part, or -1: (2, walls)."""
        number = {part: k for k, part in enumerate(self.parts)}
        of_pieces = [number.get(part, -1) for part in self._parts_of_pieces]
        rows = [(i, of_pieces[i] if member < 0 else member) for i, member in self.order.members(self.pieces)]
        return np.array([(self.owners_of_pieces[i], member) for i, member in rows], np.int64).reshape(-1, 2).T

    def names_laws(self) -> bool:
        """Whether a law of a wall is known by its name alone, as from a file that was read without its code."""
        return any(isinstance(law, str) for piece in self.pieces for law in piece.laws)

    def split_by_members(self, values: NDArray[Any]) -> list[NDArray[Any]]:
        """Of each surface what its members have, from (..., members) of those of all surfaces, one after the other."""
        surface, member = self.members()
        counts = np.zeros(int(surface.max()) + 1, np.int64)
        np.maximum.at(counts, surface, member + 1)
        return np.split(values, np.cumsum(np.maximum(counts, 1))[:-1], axis=-1)

    def unions(self) -> list[int]:
        """The surfaces that are unions of several rooms."""
        return [self.owners_of_pieces[rooms[0][0]] for rooms in self.order.unions]


def _places_of(image: Surface) -> tuple[Place, ...]:
    return image.places() if isinstance(image, Joined) else ((),)


def _of_walls(values: list[Any], spans: list[tuple[int, int]], neutral: Any) -> tuple[Any, ...] | None:
    """The value of every wall, of which so many in a row have one of these; None where all are neutral."""
    if all(value == neutral for value in values):
        return None
    return tuple(values[k] if walls == 1 else Span(values[k], float(walls)) for k, walls in spans)


def _thermal(surface: Surface) -> Thermal:
    if surface.temperature is None:
        return _NO_HEAT
    return Thermal(surface.temperature, surface.accommodation)


def with_reach(images: Sequence[tuple[Surface, ...]]) -> tuple[tuple[Surface, ...], ...]:
    """The surfaces of a scene with their images, whose rooms overlap where they have a face in common."""
    several = [one for some in images for one in some if isinstance(one, Joined) and len(one.rooms) > 1]
    reach = _REACH * max((piece.extent() for one in several for piece in one.surfaces()), default=0.0)
    return tuple(
        tuple(one.reaching(reach) if isinstance(one, Joined) else one for one in some) for some in images
    )  # fmt: skip


def volumes_of_pieces(
    surfaces: Sequence[Surface], images: Sequence[Sequence[Surface]], period: Lengths | None
) -> tuple[tuple[Surface, ...], ...]:
    """The volumes in which every piece is open, of surfaces and the images of each."""
    found: list[tuple[Surface, ...]] = []
    for i, (surface, some) in enumerate(zip(surfaces, images, strict=True)):
        name = f"surfaces[{i}]"
        if isinstance(surface, Joined):
            of_parts = _volumes_of_parts(surface, period, name)
            found += [of_parts[place] for image in some for place in _places_of(image)]
        else:
            found += [volumes_of(surface, period, name)] * len(some)
    return tuple(found)


def _volumes_of_parts(union: Joined, period: Lengths | None, name: str) -> dict[Place, tuple[Surface, ...]]:
    """Those of the parts of a union: what is open of the whole is open where it reaches each of them."""
    pieces, places = union.surfaces(), union.places()
    for place, part in nodes_of(union):
        # Of the whole by its number alone, as a surface without parts.
        where = f"{name}{''.join(f'.parts[{k}]' for k in place)}"
        mine = [piece for piece, at in zip(pieces, places, strict=True) if at[: len(place)] == place]
        for k, opening in enumerate(part.openings):
            # Of parts that leave no room there is no wall.
            if mine and not any(reaches(piece, volume_of(opening)) for piece in mine):
                raise SceneError(
                    f"{where}.openings[{k}] must reach the wall that it opens, got {opening}, in which no point of "
                    f"{where} ({type(part).__name__}) is; move it, or make it larger"
                )
    found: dict[Place, tuple[Surface, ...]] = {}
    for piece, at in zip(pieces, places, strict=True):
        open_there = [one for one in piece.openings if reaches(piece, volume_of(one))]
        found[at] = volumes_of(replace(piece, openings=open_there), period, f"{name}.parts")
    return found


def doorways_of_pieces(
    images: Sequence[Sequence[Surface]], volumes: Sequence[Sequence[Surface]]
) -> tuple[tuple[Surface, ...], ...]:
    """The volumes in which every piece is open where another room of its union is on its other side.

    Those are the volumes of the other rooms, and those that open walls between rooms only.
    """
    found: list[tuple[Surface, ...]] = []
    for image in (image for some in images for image in some):
        rooms = image.rooms if isinstance(image, Joined) else ((image,),)
        given, first = [], len(found)
        for room in rooms:
            given.append([one for some in volumes[first : first + len(room)] for one in some])
            first += len(room)
        for k, room in enumerate(rooms):
            others = [one for j, some in enumerate(given) if j != k for one in some]
            between = [one for piece in itertools.chain(*rooms) for one in piece.open_volumes(True)]
            for piece in room:
                mine = volumes[len(found)]
                found.append(tuple(one for one in dict.fromkeys([*others, *between])
                                   if one not in mine and reaches(piece, one)))  # fmt: skip
    return tuple(found)
