"""The contacts of balls with walls: the centre of a ball is a point at the wall grown by the radius."""

import math

from ..kernel.arrays import index
from ..kernel.jit import outlined
from ..kernel.vector import ZERO, dot, set_vector, square, vector_at
from ..surfaces.in_motion.posed import Posed
from ..surfaces.walls import Field
from . import grain_arrays as col
from .contacts import (
    Closing,
    begin_solve,
    change_of,
    damper,
    improved,
    lasting,
    pressed,
    scale_of,
    size_of,
    weight_of,
    worse,
)
from .grain_arrays import OfWall
from .heavy_walls import ease_along, note_eases, react, rest_of
from .vessel import met


def rising(wall, r0, q0, move):
    """Return the `Closing` of a ball at r0 and a wall over a step with the move of the centre."""
    r1, turns = r0 + move, isinstance(wall, Posed) and wall.pose.turn is not None
    if wall.flat and not turns:
        # The gap is linear in the place, and needs no square roots of q.
        gradient = wall.gap_gradient(r0, r1)
        return Closing(-1.0 * gradient, dot(gradient, move - wall.displacement()))
    gradient = wall.resting_gradient(r0, r1)
    risen = wall.end_inner(r1) - q0 if turns else dot(gradient, move - wall.displacement())
    slope, _bend = wall.gap_slope(q0, q0 + risen)
    return Closing(-slope * gradient, slope * risen)


def step_at_wall(matter, wall, grains, touches, c, i):
    """Return the surface that the ball of contact c meets, its current move in the step, and their `Closing`."""
    rows = touches.wall_rows
    own = met(wall, touches.listed, touches.spans, c, grains.place[i, col.RADIUS])
    move = vector_at(rows, c, col.COAST) + 0.5 * matter.h * vector_at(grains.speed, i, col.AFTER)
    return own, move, rising(own, vector_at(rows, c, col.START), rows[c, col.SIZE], move)


def velocity_at_end(wall, r1):
    """The velocity of a wall at a point at the end of a step."""
    return wall._replace(pose=wall.end).velocity(r1) if isinstance(wall, Posed) else ZERO


@outlined
def gather_at_wall(matter, law, wall, grains, near, touches, given):
    """Add the balls that are in a wall at an end of the step to its contacts; return how many are new."""
    place, speed, half, rows = grains.place, grains.speed, 0.5 * matter.h, touches.wall_rows
    number, begin = given
    count = touches.wall_spans[1, number]
    known, start = count, touches.wall_spans[0, number]
    for k in range(begin, near.wall_first[number + 1]):
        if near.wall_is_on[index(k)]:
            continue
        a = near.slot[index(k)]
        i = index(a)
        r0, own = vector_at(place, i, col.X), met(wall, near.listed, near.spans, index(k), place[i, col.RADIUS])
        coast = half * vector_at(speed, i, col.BEFORE)
        move = coast + half * vector_at(speed, i, col.AFTER)
        q0 = own.inner(r0)
        is_in = (own.level_of(q0) > 0.0) | (own.level_of(own.end_inner(r0 + move)) > 0.0)
        if near.wall_is_open is not None:
            is_in = is_in & (not near.wall_is_open[index(k)])
        if matter.holds is not None:
            is_in = is_in & (place[i, col.LIGHTNESS] > 0.0)
        if is_in:
            near.wall_is_on[index(k)] = True
            c = index(start + count)
            touches.wall_ends[c] = a
            if isinstance(wall, Field):
                for end in (col.BEGIN, col.END):
                    touches.spans[c, end] = near.spans[index(k), end]
            set_vector(rows, c, col.START, r0)
            # The round-off lost from the place, along the normal.
            steep, _bend = own.gap_slope(q0, q0)
            n = own.discrete_gradient(r0, r0)
            lost = dot(n, rest_of(own, place, i))
            rows[c, col.SIZE], rows[c, col.GAP] = q0, own.gap_of(q0) + steep * lost
            set_vector(rows, c, col.COAST, coast)
            rows[c, col.EASE] = place[i, col.LIGHTNESS]
            note_eases(own, rows, c, n)
            ease = ease_along(own, rows, c)
            if law.damping is not None:
                rows[c, col.DAMPING] = law.damping / math.sqrt(ease) / matter.h
            way = rising(own, r0, q0, move)
            v, carried = vector_at(speed, i, col.AFTER), velocity_at_end(own, r0 + move)
            speeds = size_of(v - carried), size_of(v) + size_of(carried)
            first = pressed(matter, damper(law.damping, rows, c), rows[c, col.GAP], way.change)
            rows[c, col.PUSH], rows[c, col.GAIN] = begin_solve(first, half * ease * square(way.along))
            rows[c, col.SCALE] = scale_of(matter, rows[c, col.PUSH], speeds, ease)
            set_vector(rows, c, col.IMPULSE, rows[c, col.PUSH] * way.along)
            if near.wall_drag is not None:
                rows[c, col.LISTED] = k
            _recall(law, near, rows, c, index(k))
            count += 1
    touches.wall_spans[1, number] = count
    return count - known


def _recall(law, near, rows, c, k):
    """Begin friction and rolling with the impulses of the step before, if the contact existed in it."""
    if law.friction is not None:
        set_vector(rows, c, col.DRAG, vector_at(near.wall_drag, k, 0) * lasting(rows[c, col.GAP]))
    if law.rolling is not None:
        set_vector(rows, c, col.ROLL, vector_at(near.wall_drag, k, col.KEPT_ROLL) * lasting(rows[c, col.GAP]))


def press_at_wall(matter, law, own, grains, rows, at, share):
    """Improve the impulse of a ball at a wall; return its `Closing`, its new velocity and the relative change."""
    c, i = at
    half, v = 0.5 * matter.h, vector_at(grains.speed, i, col.AFTER)
    way = rising(own, vector_at(rows, c, col.START), rows[c, col.SIZE], vector_at(rows, c, col.COAST) + half * v)
    wanted, _slope = pressed(matter, damper(law.damping, rows, c), rows[c, col.GAP], way.change)
    rows[c, col.PUSH] = improved(rows[c, col.PUSH], wanted, rows[c, col.GAIN])
    more, part = change_of(OfWall(rows, c), col.IMPULSE, rows[c, col.PUSH] * way.along, share)
    react(own, part)
    off = weight_of(law) * (size_of(more) * rows[c, col.SCALE])
    return way, v + part * rows[c, col.EASE], off


@outlined
def sweep_wall(matter, law, wall, grains, touches, number, share):
    """Improve the impulse of each ball at a wall; return the largest relative change."""
    rows, worst, begin = touches.wall_rows, 0.0, touches.wall_spans[0, number]
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        i = index(touches.wall_ends[c])
        own = met(wall, touches.listed, touches.spans, c, grains.place[i, col.RADIUS])
        _way, v, off = press_at_wall(matter, law, own, grains, rows, (c, i), share)
        set_vector(grains.speed, i, col.AFTER, v)
        worst = worse(off, worst)
    return worst


@outlined
def push_walls(law, grains, touches, number):
    """Add the impulses of a wall to the velocities at the end of the step."""
    rows, speed, begin = touches.wall_rows, grains.speed, touches.wall_spans[0, number]
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        i, impulse = index(touches.wall_ends[c]), vector_at(rows, c, col.IMPULSE)
        if law.friction is not None:
            impulse = impulse + vector_at(rows, c, col.DRAG)
        set_vector(speed, i, col.AFTER, vector_at(speed, i, col.AFTER) + impulse * rows[c, col.EASE])
