"""Flat faces of two surfaces in one plane: surfaces on the same side of it, and solids that stand flush on walls.

A solid that only touches a wall leaves a gap of no width, into which round-off leads points. So a face of a solid that
lies wholly on other walls is moved a small distance, the *reach*, into the region from which these keep particles.
`seams` does the same for the common faces of rooms. The region of the particles does not change.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...state import Floats
from ..facets.flat import DIGITS, keys_of
from ..fields.many import ManyBodies
from ..instant import are_there_together, distances, side_of
from ..surface import Surface
from .seams import ENOUGH, FAR, OUTSIDE, PLACES, Face, faces_of

# The reach, as a part of the size of the scene: more than `DIGITS` resolve, and more than the distance of contact.
_REACH = 2e-9
# A field of more bodies is left unchanged: each body that stands on a wall takes some milliseconds.
MOST_BODIES = 200


class OneBody(NamedTuple):
    """A surface, or a body of a field: its number among the surfaces, its row in the field or None, and itself."""

    surface: int
    row: int | None
    body: Surface


class Pair(NamedTuple):
    """Two flat faces in one plane: the numbers of their surfaces, and the numbers of the faces in these."""

    surfaces: tuple[int, int]
    faces: tuple[int, int]
    are_back_to_back: bool


def pairs_in_one_place(
    surfaces: Sequence[Surface], size: float, matters: Callable[[Surface, Surface, bool], bool]
) -> Iterator[Pair]:
    """Flat faces of two surfaces that move as one, with a place in common.

    Args:
        surfaces: the surfaces of a scene.
        size: the size of the scene [m].
        matters: whether a pair is wanted, given both surfaces and whether their faces are back to back.
    """
    each = [_planes(one) for one in surfaces]
    if not each:
        return
    owners = np.repeat(np.arange(len(each)), [len(planes) for planes in each])
    numbers = np.concatenate([np.arange(len(planes)) for planes in each])
    keys = keys_of(np.concatenate(each), size)
    # A mesh has many planes, few of which are those of another surface.
    _keys, which, counts = np.unique(np.abs(keys), return_inverse=True, return_counts=True)
    same, known = (counts > 1)[which], dict[float, list[tuple[int, int]]]()
    for i, a, key in zip(owners[same].tolist(), numbers[same].tolist(), keys[same].tolist(), strict=True):
        for place, are_back_to_back in ((key, False), (-key, True)):
            for j, b in known.get(place, []):
                one, other = surfaces[j], surfaces[i]
                if i == j or not matters(one, other, are_back_to_back):
                    continue
                if _share_a_place((one, b), (other, a), size):
                    yield Pair((j, i), (b, a), are_back_to_back)
        known.setdefault(key, []).append((i, a))


def _planes(surface: Surface) -> Floats:
    """Return the planes of its flat faces, as rows of unit normals out of its admissible side, and offsets (n, 4) [m].

    A face that is not flat has a row of NaN.
    """
    if len(flat := surface.flat_faces()):
        return side_of(surface) * flat
    rows = [np.full(4, np.nan) if face.plane is None else np.append(*face.plane) for face in faces_of(surface)]
    return np.array(rows).reshape(-1, 4)


def face_of(surface: Surface, number: int) -> Face:
    """Return a face by its number among the planes of a surface."""
    if not len(flat := surface.flat_faces()):
        return faces_of(surface)[number]
    side = side_of(surface)

    def longer(by: float) -> Surface:
        made = surface.with_flat_face_out(number, side * by)
        assert made is not None
        return made

    can_be_moved = surface.with_flat_face_out(number, 0.0) is not None
    plane = side * flat[number, :3], float(side * flat[number, 3])
    return Face(surface, plane, longer if can_be_moved else None)


def flush_faces(surfaces: Sequence[Surface]) -> dict[tuple[int, int], float]:
    """Return the faces of solids, (surface, face), that lie within other walls, and how far to move each out [m]."""
    size = max((surface.extent() for surface in surfaces), default=0.0) or 1.0
    mates = dict[tuple[int, int], list[tuple[int, int]]]()
    for pair in pairs_in_one_place(surfaces, size, _closes):
        ends = list(zip(pair.surfaces, pair.faces, strict=True))
        for end, mate in (ends, ends[::-1]):
            if _keeps(surfaces[mate[0]], surfaces[end[0]]):
                mates.setdefault(end, []).append(mate)
    found = {}
    for (i, a), others in mates.items():
        face = face_of(surfaces[i], a)
        if face.longer is not None and _is_within(surfaces[i], a, [surfaces[j] for j, _b in others], size):
            apart = [_apart(face, face_of(surfaces[j], b)) for j, b in others]
            found[i, a] = max(apart) + _REACH * size
    return found


def bodies_of(surfaces: Sequence[Surface]) -> Iterator[OneBody]:
    """Yield the surfaces, and for fields the first bodies."""
    for i, surface in enumerate(surfaces):
        if not isinstance(surface, ManyBodies) or not surface.body_count() or surface.is_foam():
            yield OneBody(i, None, surface)
            continue
        some = np.arange(min(len(surface), MOST_BODIES))
        for k, body in enumerate(surface.images(some, surface.centers[some]).solids()):
            yield OneBody(i, k, replace(body, **surface.common()))


def first_bodies(surfaces: Sequence[Surface]) -> list[OneBody]:
    """As `bodies_of`, with at most `MOST_BODIES` surfaces and bodies of fields each: a field hides no wall after it."""
    left = {True: MOST_BODIES, False: MOST_BODIES}
    found = []
    for one in bodies_of(surfaces):
        left[one.row is None] -= 1
        if left[one.row is None] >= 0:
            found.append(one)
    return found


def may_reach(one: OneBody, surfaces: Sequence[Surface]) -> bool:
    """Whether a body is extended into a wall on which it stands."""
    return one.row is None or surfaces[one.surface].body_count() <= MOST_BODIES


def extended(surfaces: Sequence[Surface]) -> tuple[Surface, ...]:
    """Return the surfaces of a scene, with solids that reach into the walls on which they stand."""
    made, longer = list(surfaces), dict[int, Surface]()
    looked_at = [one for one in bodies_of(surfaces) if may_reach(one, surfaces)]
    for (k, a), by in flush_faces([one.body for one in looked_at]).items():
        face = face_of(longer.get(k, looked_at[k].body), a)
        assert face.longer is not None
        longer[k] = face.longer(-by)
    rows = dict[int, dict[int, Surface]]()
    for k, body in longer.items():
        i, row, _body = looked_at[k]
        if row is None:
            made[i] = body
        else:
            rows.setdefault(i, {})[row] = body
    for i, bodies in rows.items():
        field = surfaces[i]
        assert isinstance(field, ManyBodies)
        made[i] = field.with_bodies(bodies)
    return tuple(made)


def _closes(one: Surface, other: Surface, are_back_to_back: bool) -> bool:
    """Whether there is a gap that a face of one of two surfaces may close."""
    return are_back_to_back and (_keeps(one, other) or _keeps(other, one))


def _keeps(wall: Surface, solid: Surface) -> bool:
    """Whether a wall is present whenever a solid is."""
    return solid.is_solid() and not (wall.reacts() or solid.reacts()) and wall.present in (None, solid.present)


def _apart(face: Face, mate: Face) -> float:
    """Return the width of the gap between two faces in one plane [m]."""
    assert face.plane is not None
    assert mate.plane is not None
    return -(face.plane[1] + mate.plane[1])


def _is_within(solid: Surface, number: int, others: Sequence[Surface], size: float) -> bool:
    """Whether a solid with one face moved out grows only into the region that other walls keep from particles.

    At the rim of the face no other wall may continue a side of the solid: round-off would lead points that slide on
    both against the side of the grown part.
    """
    random, most = np.random.default_rng(1), FAR * size
    solid, others = solid.at_rest(), [one.at_rest() for one in others]
    face, (flat, rim) = face_of(solid, number), _places_of(solid, number, size, random)
    flat = flat[:, np.abs(solid.phi(flat)) <= 10.0**-DIGITS * size]
    gained = flat - most * random.random(flat.shape[1]) * face.normals(flat)
    if gained.shape[1] < ENOUGH or not (_depths(others, gained) >= -OUTSIDE * size).all():
        return False
    return bool((_depths(others, rim - most * face.normals(rim)) >= 0.5 * most).all())


def _places_of(solid: Surface, number: int, size: float, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Return points (3, N) in the plane of a face of a solid, some of them on the face, and points on its rim."""
    if (known := solid.places_of_flat_face(number, PLACES)) is not None:
        return known
    low, high = (np.clip(corner, -size, size)[:, None] for corner in solid.at_rest().filled().bounds())
    face = face_of(solid, number)
    flat = face.onto(low + (high - low) * random.random((3, PLACES)))
    rim = np.concatenate([face.onto(side.onto(flat)) for side in faces_of(solid)], axis=1)
    return flat, rim[:, np.abs(solid.phi(rim)) <= 10.0**-DIGITS * size]


def _depths(walls: Sequence[Surface], points: Floats) -> Floats:
    """Return the largest distance of points (3, N) out of the admissible side of any of these walls [m]."""
    with np.errstate(all="ignore"):
        return np.asarray(np.max([side_of(one) * distances(one, points) for one in walls], axis=0))


def _share_a_place(first: tuple[Surface, int], second: tuple[Surface, int], size: float) -> bool:
    """Whether two surfaces that move as one have a place in common, on their flat faces in one plane."""
    one, other = first[0], second[0]
    if one.motion != other.motion or not are_there_together(one, other):
        return False
    boxes = np.array([surface.at_rest().filled().bounds() for surface in (one, other)])
    reach = size + float(np.abs(boxes[np.isfinite(boxes)]).max(initial=0.0))
    least, most = np.clip([boxes[:, 0].max(axis=0), boxes[:, 1].min(axis=0)], -reach, reach)
    if (least > most + 10.0 ** (1 - DIGITS) * size).any():
        return False
    random = np.random.default_rng(0).random((3, PLACES))
    tried = [face_of(*second).onto(least[:, None] + (most - least)[:, None] * random)]
    # Points in the box around all faces would miss small ones, such as the feet of a table.
    tried += [known[0] for end, a in (first, second) if (known := end.places_of_flat_face(a, PLACES)) is not None]
    points = np.concatenate(tried, axis=1)
    with np.errstate(all="ignore"):
        off = [np.abs(surface.at_rest().phi(points)) for surface in (one, other)]
    return bool((np.maximum(*off) <= 10.0**-DIGITS * size).any())
