"""The parts of a field that a ball meets: single bodies, or the faces of a vessel, each at its nearest place.

A face consists of sides of an outline that join smoothly or at an edge towards the balls, or of triangles of a mesh
that are in one plane or bound a convex body. The depth in a face is the depth below its nearest part: a ball that goes
from one triangle to the next in their plane keeps one contact, with the same depth and normal, and a ball that goes
over an edge turns about it. Where faces meet in a corner around the balls, each has its own contact, and a ball is
held by both. So the stored energy depends only on the place of the ball, and discrete gradients conserve the energy.
"""

import math
from typing import Any

from ..contact.path import members_of
from ..kernel.arrays import index
from ..kernel.grid import block_of, over_entries
from ..kernel.jit import outlined
from ..kernel.record import Record
from ..kernel.vector import Vec, square, vector_at
from ..surfaces.balls.facet import RoundTriangle
from ..surfaces.contract import Smooth
from ..surfaces.fields.members import GrownLike, member
from ..surfaces.in_motion.posed import Posed
from ..surfaces.outlines.round_side import RoundSide
from ..surfaces.rotation import Rotated
from ..surfaces.walls import Field
from . import grain_arrays as col
from .contacts import move_of
from .heavy_walls import is_heavy


class NearestMembers(Smooth):
    """Some members of a field as one wall; phi, the gap, is the distance outside of the nearest member."""

    members: Any  # the members, grown by the radius of the ball
    listed: Any  # their numbers, from the first to the one before the stop
    first: Any
    stop: Any

    side = 1.0

    def phi(self, r):
        """The distance outside of the nearest member."""
        return _deepest(self, r)

    def gradient(self, r):
        """The unit normal of the nearest member."""
        return _outward(self, r)


@outlined
def _deepest(some, r):
    most = -math.inf
    for k in range(some.first, some.stop):
        most = max(most, member(some.members, index(some.listed[index(k)])).distance(r))
    return most


@outlined
def _outward(some, r):
    return member(some.members, index(_nearest(some, r))).unit_normal(r)


def _nearest(some, r):
    """The number of the nearest member."""
    most, which = -math.inf, some.first
    for k in range(some.first, some.stop):
        depth = member(some.members, index(some.listed[index(k)])).distance(r)
        if depth > most:
            most, which = depth, k
    return some.listed[index(which)]


def is_of_faces(like):
    """Whether the members of a field are parts of faces: a constant for the compiler."""
    if isinstance(like, (GrownLike, Rotated)):
        return is_of_faces(like.body)
    return isinstance(like, (RoundSide, RoundTriangle))


def met(wall, listed, spans, k, radius):
    """The surface that the centre of a ball meets of a wall; in a field, that of the members of the span in row k."""
    grown = wall.grown(radius)
    if not isinstance(wall, Field):
        return grown
    members = members_of(grown.members)
    if is_of_faces(members.like):
        own = NearestMembers(members, listed, spans[k, col.BEGIN], spans[k, col.END])
    else:
        own = member(members, index(listed[index(spans[k, col.BEGIN])]))
    return grown.members._replace(body=own) if moves(wall) else own


def met_member(wall, listed, spans, k, radius, r):
    """The number of the member of a wall that a ball meets at r, at the end of a step; 0 if the wall is no field."""
    if not isinstance(wall, Field):
        return 0
    grown = wall.grown(radius)
    members = members_of(grown.members)
    if not is_of_faces(members.like):
        return listed[index(spans[k, col.BEGIN])]
    own = NearestMembers(members, listed, spans[k, col.BEGIN], spans[k, col.END])
    return _nearest(own, grown.members.own_end(r) if moves(wall) else r)


def moves(wall):
    """Whether a wall or a field moves: a constant for the compiler."""
    return isinstance(wall.members if isinstance(wall, Field) else wall, Posed)


def gives_work(wall):
    """Whether a wall has a prescribed motion, so that its work is booked; a wall with a mass loses what it gives."""
    return moves(wall) and not is_heavy(wall)


# --- Lists -----------------------------------------------------------------------------------------------


def _enter(end, m, given):
    """Insert a member near a ball into the list, in the order of faces, unless it is listed; return the list's end."""
    members, face, near, (r, skin, begin) = given
    # The distance is exact to first order, and may be off by half.
    if not member(members, index(m)).distance(r) > -2.0 * skin:
        return end
    k, listed = end, near.listed
    if end >= listed.size:
        return end + 1
    own = face[index(m)]
    while k > begin and (face[index(listed[index(k - 1)])] > own or
                         (face[index(listed[index(k - 1)])] == own and listed[index(k - 1)] > m)):  # fmt: skip
        k -= 1
    if k > begin and listed[index(k - 1)] == m:
        return end
    last = end
    while last > k:
        listed[index(last)] = listed[index(last - 1)]
        last -= 1
    listed[index(k)] = m
    return end + 1


@outlined
def list_in_field(wall, face, grains, near, skin, found):
    """List the balls near each face, or each body, of a field; return how many are listed then."""
    place, grid = grains.place, members_of(wall.members).grid
    for a in range(place.shape[0]):
        i = index(a)
        r, radius, begin = vector_at(place, i, col.X), place[i, col.RADIUS], near.used[0]
        r = wall.members.own_place(r) if moves(wall) else r
        reach = radius + 2.0 * skin
        corner = Vec(reach, reach, reach)
        block, members = block_of(grid, r - corner, r + corner), members_of(wall.grown(radius).members)
        given = members, face, near, (r, skin, begin)
        end = over_entries(grid, block, begin, _enter, given)
        near.used[0] = end
        if end <= near.listed.size:
            k = begin
            while k < end:
                own, first = face[index(near.listed[index(k)])], k
                while k < end and face[index(near.listed[index(k)])] == own:
                    k += 1
                if found < near.slot.size:
                    c = index(found)
                    near.slot[c], near.spans[c, col.BEGIN] = a, first
                    near.spans[c, col.END], near.spans[c, col.FACE] = k, own
                found += 1
    return found


class SweptWall(Record):
    """The largest distance of a ball near a moving field from its listed place, and in a step, in the field's frame."""

    farthest: Any  # squared [m^2]
    longest: Any  # squared [m^2]


@outlined
def sweep_of(field, listed, matter, grains, skin):
    """Return the `SweptWall` of all balls near a moving field in a step; `listed` is the field when lists were made."""
    place, grid, found = grains.place, members_of(field).grid, SweptWall(0.0, 0.0)
    for k in range(place.shape[0]):
        i = index(k)
        r, reach = vector_at(place, i, col.X), place[i, col.RADIUS] + 2.0 * skin
        end = field.own_end(r + move_of(matter, grains, i))
        corner = Vec(reach, reach, reach)
        along = block_of(grid, end - corner, end + corner).along
        if (along.x > 0) & (along.y > 0) & (along.z > 0):
            way, step = end - listed.own_place(vector_at(grains.listed, i, 0)), end - field.own_place(r)
            found = SweptWall(max(square(way), found.farthest), max(square(step), found.longest))
    return found
