"""The pieces of a scene: its surfaces, those of which its unions are made, and images; what every wall of them has."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .contact.laws import NONE, Laws, Moves, Span, Thermal, owned_in
from .errors import SceneError
from .surfaces.facets.mesh import Mesh
from .surfaces.fields.grouped import Order, order_of
from .surfaces.fields.many import members_of
from .surfaces.fields.members import Members
from .surfaces.images import Lengths, corners_of
from .surfaces.openings import Opening, openings_in, reaches, volumes_of
from .surfaces.surface import Surface
from .surfaces.union import Joined
from .volume import Volume

# The law of a wall without temperature.
_NO_HEAT = Thermal(0.0, 0.0)


class Pieces(Volume):
    """The pieces of a `Scene`."""

    # The volumes in which every piece is open.
    _volumes: tuple[tuple[Surface, ...], ...]

    def moves(self) -> bool:
        """Whether a surface moves, or may be moved."""
        raise NotImplementedError

    @cached_property
    def _pieces(self) -> tuple[Surface, ...]:
        """The surfaces, those of which unions are made, and the images of those that reach over a face of the cell."""
        return tuple(piece for images in self._images for image in images for piece in _pieces_of(image))

    @cached_property
    def owners_of_pieces(self) -> list[int]:
        """The surface that each of these is an image or a part of."""
        return [i for i, images in enumerate(self._images) for image in images for _piece in _pieces_of(image)]

    @cached_property
    def order(self) -> Order:
        """Surfaces and images in the order of the scene."""
        unions, first = [], 0
        for image in (image for images in self._images for image in images):
            if isinstance(image, Joined) and len(image.rooms) > 1:
                ends = np.cumsum([first, *map(len, image.rooms)]).tolist()
                unions.append(tuple(tuple(range(*ends)) for ends in itertools.pairwise(ends)))
            first += len(_pieces_of(image))
        return order_of(self._pieces, unions=unions)

    @cached_property
    def _groups(self) -> list[Members]:
        """The surfaces that kernels take as fields."""
        repeated = None if self.period is None else corners_of(self.period)
        return [members_of([self._pieces[i] for i in group], repeated) for group in self.order.groups]

    @cached_property
    def volumes(self) -> tuple[tuple[Surface, ...], ...]:
        """The volumes in which every surface is open."""
        found: list[dict[Surface, None]] = [{} for _surface in self.surfaces]
        for i, given in zip(self.owners_of_pieces, self._volumes, strict=True):
            found[i].update(dict.fromkeys(given))
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

    def openings(self) -> tuple[Opening, ...] | None:
        """The openings of every wall of the scene as kernels take them, None where there are none."""
        return openings_in(self.order.spans(self._pieces), self._volumes)

    def _runs(self) -> list[tuple[int, Surface, int]]:
        """The walls in a row that have the same laws: their piece, the surface that says these, and how many they are."""
        found: list[tuple[int, Surface, int]] = []
        for i, walls in self.order.spans(self._pieces):
            piece = self._pieces[i]
            found += [(i, *run) for run in (piece.runs() if isinstance(piece, Mesh) else [(piece, walls)])]
        return found

    def owners(self) -> list[int]:
        """The surface that each row of the scene belongs to, one for a field."""
        return [self.owners_of_pieces[i] for i in self.order.owners(self._pieces)]

    def members(self) -> NDArray[np.int64]:
        """Of each wall of the scene its surface, and its number in the field that this is or -1: (2, walls)."""
        return np.array([(self.owners_of_pieces[i], member) for i, member in self.order.members(self._pieces)]).T


def _pieces_of(image: Surface) -> tuple[Surface, ...]:
    return image.surfaces() if isinstance(image, Joined) else (image,)


def _of_walls(values: list[Any], spans: list[tuple[int, int]], neutral: Any) -> tuple[Any, ...] | None:
    """The value of every wall, of which so many in a row have one of these; None where all are neutral."""
    if all(value == neutral for value in values):
        return None
    return tuple(values[k] if walls == 1 else Span(values[k], float(walls)) for k, walls in spans)


def _thermal(surface: Surface) -> Thermal:
    if surface.temperature is None:
        return _NO_HEAT
    return Thermal(surface.temperature, surface.accommodation)


def volumes_of_pieces(
    surfaces: Sequence[Surface], images: Sequence[Sequence[Surface]], period: Lengths | None
) -> tuple[tuple[Surface, ...], ...]:
    """The volumes in which every piece is open, of surfaces and the images of each."""
    found: list[tuple[Surface, ...]] = []
    for i, (surface, some) in enumerate(zip(surfaces, images, strict=True)):
        name = f"surfaces[{i}]"
        if isinstance(surface, Joined):
            found += _volumes_of_parts(surface, period, name) * len(some)
        else:
            found += [volumes_of(surface, period, name)] * len(some)
    return tuple(found)


def _volumes_of_parts(union: Joined, period: Lengths | None, name: str) -> list[tuple[Surface, ...]]:
    """Those of the surfaces of a union: what is open of the whole is open where it reaches each of them."""
    pieces = union.surfaces()
    for k, opening in enumerate(union.openings):
        if not any(reaches(piece, opening) for piece in pieces):
            raise SceneError(
                f"{name}.openings[{k}] must reach the wall that it opens, got {opening}, in which no point of {name} "
                f"({type(union).__name__}) is; move it, or make it larger"
            )
    found = []
    for piece in pieces:
        open_there = [one for one in piece.openings if one not in union.openings or reaches(piece, one)]
        found.append(volumes_of(replace(piece, openings=open_there), period, f"{name}.parts"))
    return found
