"""The pieces of a scene: simple surfaces, in the order of its surfaces, with the openings of each."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..errors import SceneError
from .periodic.images import Lengths, images_of
from .presence.openings import reaches, volumes_of
from .surface import Surface, volume_of
from .union import Place, nodes_of

# Rooms with a face in common overlap by this part of the extent of the unions: more than counts as touching a wall.
_REACH = 1e-9

Images = tuple[tuple[Surface, ...], ...]


@dataclass(frozen=True)
class Pieces:
    """The simple surfaces of a scene: surfaces without parts, the parts of all others, and the images of both.

    Attributes:
        images: the images of every surface that reach into the cell; without a period the surface itself.
        each: the pieces, image by image.
        owners: for each piece the number of its surface: the piece is this surface, a part, or an image of it.
        places: the place of each piece in its surface, () for a surface without parts.
        volumes: the volumes in which each piece is open.
        doorways: the volumes in which each piece is open where another room of its union is on its other side.
    """

    images: Images
    each: tuple[Surface, ...]
    owners: tuple[int, ...]
    places: tuple[Place, ...]
    volumes: Images
    doorways: Images

    def owned(self) -> Iterator[tuple[int, Surface]]:
        """Iterate over pairs of the number of a surface and a piece of it."""
        return zip(self.owners, self.each, strict=True)

    def as_walls(self) -> "Pieces":
        """Return these pieces with each field, and each union of several rooms, as one wall."""
        rows: list[tuple[Any, ...]] = []
        first, each = 0, (self.each, self.owners, self.places, self.volumes, self.doorways)
        for i, image in ((i, image) for i, some in enumerate(self.images) for image in some):
            mine = slice(first, first + len(image.surfaces()))
            first, volumes = mine.stop, itertools.chain(*self.volumes[mine])
            if len(image.rooms) > 1:
                rows.append((image.as_one_wall(), i, (), tuple(dict.fromkeys(volumes)), ()))
            else:
                rows += [(one.as_one_wall(), *rest) for one, *rest in zip(*(some[mine] for some in each), strict=True)]
        images = tuple(tuple(one.as_one_wall() for one in some) for some in self.images)
        return Pieces(images, *zip(*rows, strict=True))

    def rooms(self) -> list[tuple[tuple[int, ...], ...]]:
        """Return for each union of several rooms the numbers of the pieces of every room."""
        found, first = [], 0
        for image in itertools.chain(*self.images):
            if len(image.rooms) > 1:
                ends = list(itertools.accumulate(map(len, image.rooms), initial=first))
                found.append(tuple(tuple(range(*ends)) for ends in itertools.pairwise(ends)))
            first += len(image.surfaces())
        return found

    def open_volumes(self) -> tuple[Surface, ...]:
        """Return the volumes in which any piece is open."""
        return tuple(itertools.chain(*self.volumes, *self.doorways))


def pieces_of(surfaces: Sequence[Surface], period: Lengths | None, largest: float = 0.0) -> Pieces:
    """Return the pieces that particles in the cell meet: points, or balls with radii up to the largest one [m].

    Raises:
        SceneError: a surface does not fit the period, or an opening does not reach the wall that it opens.
    """
    if any(one.is_solid() for one in surfaces):
        from .presence.flush import extended  # loaded where there are solids

        surfaces = extended(surfaces)
    named = [(one, f"surfaces[{i}]") for i, one in enumerate(surfaces)]
    images = _with_reach(tuple(
        (one,) if period is None else tuple(images_of(one, period, name, largest)) for one, name in named
    ))  # fmt: skip
    owned = [(i, image) for i, several in enumerate(images) for image in several]
    volumes = _volumes_of_pieces(surfaces, images, period)
    return Pieces(
        images,
        tuple(piece for _i, image in owned for piece in image.surfaces()),
        tuple(i for i, image in owned for _piece in image.surfaces()),
        tuple(place for _i, image in owned for place in image.places()),
        volumes,
        _doorways_of_pieces(images, volumes),
    )


def differing_in(union: Surface) -> str | None:
    """Return the name of an argument in which the parts of a union differ, or None if they agree in all."""
    surfaces = union.surfaces()
    from .fields.soft_rooms import IN_COMMON  # loaded where rooms are joined

    for name in IN_COMMON:
        if len({repr(getattr(surface, name)) for surface in surfaces}) > 1:
            return name
    volumes = {repr(volume): volume for surface in surfaces for volume in surface.open_volumes()}
    for surface in surfaces:
        own = {repr(volume) for volume in surface.open_volumes()}
        if any(name not in own and reaches(surface, volume) for name, volume in volumes.items()):
            return "openings"
    return None


def _with_reach(images: Images) -> Images:
    """Return the images of surfaces, with an overlap of rooms that have a face in common."""
    several = [one for some in images for one in some if len(one.rooms) > 1]
    reach = _REACH * max((piece.extent() for one in several for piece in one.surfaces()), default=0.0)
    return tuple(tuple(one.reaching(reach) for one in some) for some in images)


def _volumes_of_pieces(
    surfaces: Sequence[Surface], images: Sequence[Sequence[Surface]], period: Lengths | None
) -> tuple[tuple[Surface, ...], ...]:
    """Return the volumes in which every piece is open, for surfaces and the images of each."""
    found: list[tuple[Surface, ...]] = []
    for i, (surface, some) in enumerate(zip(surfaces, images, strict=True)):
        name = f"surfaces[{i}]"
        if surface.parts:
            of_parts = _volumes_of_parts(surface, period, name)
            found += [of_parts[place] for image in some for place in image.places()]
        else:
            found += [volumes_of(surface, period, name)] * len(some)
    return tuple(found)


def _volumes_of_parts(union: Surface, period: Lengths | None, name: str) -> dict[Place, tuple[Surface, ...]]:
    """Return the open volumes of the parts of a union: openings of the whole open each part that they reach."""
    pieces, places = union.surfaces(), union.places()
    for place, part in nodes_of(union):
        # Errors name the whole by its number alone, as a surface without parts.
        where = f"{name}{''.join(f'.parts[{k}]' for k in place)}"
        mine = [piece for piece, at in zip(pieces, places, strict=True) if at[: len(place)] == place]
        for k, opening in enumerate(part.openings):
            # Parts that leave no room have no wall.
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


def _doorways_of_pieces(
    images: Sequence[Sequence[Surface]], volumes: Sequence[Sequence[Surface]]
) -> tuple[tuple[Surface, ...], ...]:
    """Return the volumes in which every piece is open where another room of its union is on its other side.

    These are the volumes of the other rooms, and those that open only walls between rooms.
    """
    found: list[tuple[Surface, ...]] = []
    for image in (image for some in images for image in some):
        given, first = [], len(found)
        for room in image.rooms:
            given.append([one for some in volumes[first : first + len(room)] for one in some])
            first += len(room)
        for k, room in enumerate(image.rooms):
            others = [one for j, some in enumerate(given) if j != k for one in some]
            between = [one for piece in image.surfaces() for one in piece.open_volumes(True)]
            for piece in room:
                mine = volumes[len(found)]
                found.append(tuple(one for one in dict.fromkeys([*others, *between])
                                   if one not in mine and reaches(piece, one)))  # fmt: skip
    return tuple(found)
