"""What every piece of a scene has, of its surfaces, those of which its unions are made, and images."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from .contact.laws import Span, Thermal
from .errors import SceneError
from .surfaces.periodic.images import Lengths
from .surfaces.presence.openings import reaches, volumes_of
from .surfaces.surface import Surface, volume_of
from .surfaces.union import Joined, Place, nodes_of

# Of the extent of what kernels take as unions, how far rooms with a face in common overlap: more than what counts as
# touching a wall.
_REACH = 1e-9
# The law of a wall without temperature.
NO_HEAT = Thermal(0.0, 0.0)


class PartsOfRows(NamedTuple):
    """The part that each row of a scene belongs to, `number` where its surface has none; how many parts there are."""

    rows: tuple[int, ...]
    number: int


def places_of(image: Surface) -> tuple[Place, ...]:
    """The places of the pieces of a surface in it."""
    return image.places() if isinstance(image, Joined) else ((),)


def of_walls(values: list[Any], spans: list[tuple[int, int]], neutral: Any) -> tuple[Any, ...] | None:
    """The value of every wall, of which so many in a row have one of these; None where all are neutral."""
    if all(value == neutral for value in values):
        return None
    return tuple(values[k] if walls == 1 else Span(values[k], float(walls)) for k, walls in spans)


def thermal(surface: Surface) -> Thermal:
    """The temperature and the accommodation of a surface as kernels take them."""
    if surface.temperature is None:
        return NO_HEAT
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
            found += [of_parts[place] for image in some for place in places_of(image)]
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
