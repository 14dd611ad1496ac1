"""Flat faces in one place: of two surfaces with the same side, and of solids that stand flush on other walls.

Between a solid and a wall that it only touches is a gap of no width, into which round-off leads points. So the face of
a solid that lies within what other walls keep from particles is moved into that by a small distance, the *reach*, as
the common faces of rooms are in `seams`: what particles may be in does not change.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...state import Floats
from ..instant import are_there_together, distances, side_of
from ..surface import Surface
from .seams import ENOUGH, FAR, OUTSIDE, PLACES, Face, faces_of

# Digits to which two flat faces are in one place, of a normal and of an offset in sizes of the scene.
_DIGITS = 9
# Of the size: the reach, which is more than those digits, and than what counts as touching a wall.
_REACH = 2e-9


class Pair(NamedTuple):
    """Two flat faces in one plane: the numbers of their surfaces, and those of the faces of each."""

    surfaces: tuple[int, int]
    faces: tuple[int, int]
    are_back_to_back: bool


def pairs_in_one_place(
    surfaces: Sequence[Surface], size: float, matters: Callable[[Surface, Surface, bool], bool]
) -> Iterator[Pair]:
    """Flat faces of two surfaces that move as one, with a place in common.

    Args:
        surfaces: of a scene.
        size: their size [m].
        matters: whether two surfaces are asked for; and whether back to back.
    """
    ends, planes = list[tuple[int, int, Face]](), list[Floats]()
    for i, one in enumerate(surfaces):
        for a, face in enumerate(faces_of(one)):
            if face.plane is not None:
                ends.append((i, a, face))
                planes.append(np.array([*face.plane[0], face.plane[1] / size]))
    rows = np.array(planes).reshape(-1, 4)
    places = zip(*((np.round(sign * rows, _DIGITS) + 0.0).tolist() for sign in (1.0, -1.0)), strict=True)
    known = dict[tuple[float, ...], list[tuple[int, int]]]()
    for (i, a, face), (along, against) in zip(ends, places, strict=True):
        for place, are_back_to_back in ((along, False), (against, True)):
            for j, b in known.get(tuple(place), []):
                one, other = surfaces[j], surfaces[i]
                if matters(one, other, are_back_to_back) and _share_a_place(one, other, face, size):
                    yield Pair((j, i), (b, a), are_back_to_back)
        known.setdefault(tuple(along), []).append((i, a))


def flush_faces(surfaces: Sequence[Surface]) -> dict[tuple[int, int], float]:
    """The faces of solids, (surface, face), that lie within other walls, and how far each is to be moved out [m]."""
    size = max((surface.extent() for surface in surfaces), default=0.0) or 1.0
    mates = dict[tuple[int, int], list[tuple[int, int]]]()
    for pair in pairs_in_one_place(surfaces, size, _closes):
        ends = list(zip(pair.surfaces, pair.faces, strict=True))
        for end, mate in (ends, ends[::-1]):
            if _keeps(surfaces[mate[0]], surfaces[end[0]]):
                mates.setdefault(end, []).append(mate)
    found = {}
    for (i, a), others in mates.items():
        face = faces_of(surfaces[i])[a]
        if face.longer is not None and _is_within(surfaces[i], face, [surfaces[j] for j, _b in others], size):
            apart = [_apart(face, faces_of(surfaces[j])[b]) for j, b in others]
            found[i, a] = max(apart) + _REACH * size
    return found


def extended(surfaces: Sequence[Surface]) -> tuple[Surface, ...]:
    """Surfaces of a scene, of which solids reach into the walls that they stand on."""
    made = list(surfaces)
    for (i, a), by in flush_faces(surfaces).items():
        longer = faces_of(made[i])[a].longer
        assert longer is not None
        made[i] = longer(-by)
    return tuple(made)


def _closes(one: Surface, other: Surface, are_back_to_back: bool) -> bool:
    """Whether there is a gap that a face of one of two surfaces may close."""
    return are_back_to_back and (_keeps(one, other) or _keeps(other, one))


def _keeps(wall: Surface, solid: Surface) -> bool:
    """Whether a wall is there whenever a solid is."""
    return solid.is_solid() and not (wall.reacts() or solid.reacts()) and wall.present in (None, solid.present)


def _apart(face: Face, mate: Face) -> float:
    """The width of the gap between two faces in one plane [m]."""
    assert face.plane is not None
    assert mate.plane is not None
    return -(face.plane[1] + mate.plane[1])


def _is_within(solid: Surface, face: Face, others: Sequence[Surface], size: float) -> bool:
    """Whether what a solid gains where a face of it is moved out is deep in what others keep from particles.

    At the rim of the face a wall of another one must not go on from one of the solid: round-off would lead points that
    slide on both against the side of what is gained.
    """
    assert face.longer is not None
    solid, others = solid.at_rest(), [one.at_rest() for one in others]
    larger, most = face.longer(-FAR * size).at_rest(), FAR * size
    low, high = (np.clip(corner, -size, size)[:, None] for corner in _filled(solid).bounds())
    random = np.random.default_rng(1)
    flat = face.onto(low + (high - low) * random.random((3, PLACES)))
    gained = flat - most * random.random(PLACES) * face.normals(flat)
    gained = gained[:, side_of(larger) * larger.phi(gained) >= 0.0]
    if gained.shape[1] < ENOUGH or not (_depths(others, gained) >= -OUTSIDE * size).all():
        return False
    for side in faces_of(solid):
        rim = face.onto(side.onto(flat))
        rim = rim[:, np.abs(solid.phi(rim)) <= 10.0**-_DIGITS * size]
        if not (_depths(others, rim - most * face.normals(rim)) >= 0.5 * most).all():
            return False
    return True


def _depths(walls: Sequence[Surface], points: Floats) -> Floats:
    """How far points (3, N) are out of the admissible side of the wall that keeps them out most [m]."""
    with np.errstate(all="ignore"):
        return np.asarray(np.max([side_of(one) * distances(one, points) for one in walls], axis=0))


def _share_a_place(one: Surface, other: Surface, face: Face, size: float) -> bool:
    """Whether two surfaces that move as one have a place in common, on their flat faces in one plane."""
    if one.motion != other.motion or not are_there_together(one, other):
        return False
    boxes = np.array([_filled(surface).bounds() for surface in (one, other)])
    reach = size + float(np.abs(boxes[np.isfinite(boxes)]).max(initial=0.0))
    least, most = np.clip([boxes[:, 0].max(axis=0), boxes[:, 1].min(axis=0)], -reach, reach)
    if (least > most + 10.0 ** (1 - _DIGITS) * size).any():
        return False
    points = face.onto(least[:, None] + (most - least)[:, None] * np.random.default_rng(0).random((3, PLACES)))
    with np.errstate(all="ignore"):
        off = [np.abs(surface.at_rest().phi(points)) for surface in (one, other)]
    return bool((np.maximum(*off) <= 10.0**-_DIGITS * size).any())


def _filled(surface: Surface) -> Surface:
    """The surface at rest, with the inside as its admissible side."""
    return replace(surface.at_rest(), side="inside") if surface.is_solid() else surface.at_rest()  # type: ignore[call-arg]
