"""The laws of walls with soft balls: a law acts when a contact ends.

By then the contact, with its damper and its friction, has reversed the normal velocity of the ball. Temperatures and
`laws` treat the end of the contact as a rigid impact at which the ball arrives with the mirrored velocity: without
losses the result is that of `Impact`, whatever the penalty. They act on the centre, and the ball keeps its spin.
"""

import math
from typing import Any, NamedTuple

from ..common.status import Status
from ..contact.reflection import given
from ..contact.wall_impact import Arriving, Facing, book_energy, by_law, give_work
from ..kernel.arrays import index
from ..kernel.jit import outlined
from ..kernel.random import Seeding
from ..kernel.vector import ZERO, dot, set_vector, square, vector_at
from ..state import absorb
from ..surfaces.in_motion.posed import Posed
from . import grain_arrays as col
from .at_walls import step_at_wall
from .held import hold
from .overlaps import BALL, WALL
from .vessel import gives_work, met_member


class Sender(NamedTuple):
    """The laws of walls, and the arrays that they need besides the walls."""

    laws: Any  # `Laws` without restitution and friction, which act during a contact
    seeding: Seeding


@outlined
def send_off(matter, wall, world, given_time):
    """Let the laws of a wall act on the balls with contacts that have ended in the step; return the `Status`.

    The step is done. The `Status` is LEASE_ENDED if the wall has absorbed a ball. `given_time` is the number of the
    wall, and the time [s].
    """
    grains, touches, (number, time) = world.grains, world.touches, given_time
    begin, status = touches.wall_spans[0, number], Status.DONE.value
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        i, gap = index(touches.wall_ends[c]), touches.wall_rows[c, col.GAP]
        if gap > 0.0:
            own, _move, way = step_at_wall(matter, wall, grains, touches, c, i)
            if gap + way.change <= 0.0:
                after = own._replace(pose=own.end) if isinstance(own, Posed) else own
                one = _act(wall, after, world, (number, c, i), time)
                status = one if status == Status.DONE or one == Status.SENT_WRONG else status
    return status


def _act(wall, own, world, at, time):
    """Let the laws of a wall act on a ball; return the `Status`."""
    (number, c, i), grains, books, sender = at, world.grains, world.books, world.sender
    place, v = grains.place, vector_at(grains.speed, i, col.BEFORE)
    r, radius = vector_at(place, i, col.X), place[i, col.RADIUS]
    # Some normals have the length 1 only on the wall, and the contact has ended a little off it.
    n, u = own.unit_normal(r), None
    n = n * (1.0 / math.sqrt(square(n)))
    if sender.laws.moving is not None:
        u = own.velocity(r + radius * n) if isinstance(own, Posed) else ZERO
    away = -dot(v if u is None else v - u, n)
    if not away > 0.0:
        # Another contact, or a law, has pushed the ball back.
        return Status.DONE.value
    one, touches = index(grains.number[i]), world.touches
    member = world.places[number][index(met_member(wall, touches.listed, touches.spans, c, radius, r))]
    random = sender.seeding.of_impact(one, books.ended[one], sender.laws)
    books.ended[one] += 1
    before, mass = v + 2.0 * away * n, 1.0 / grains.place[i, col.LIGHTNESS]
    arriving = Arriving(r, before, square(before), mass)
    happens, bounce = by_law(sender.laws, Facing(n, u), None, float(member), arriving, random)
    if not happens:
        return Status.DONE.value
    if math.isnan(bounce.v.x):
        books.failed[BALL], books.failed[WALL] = i, number
        return Status.SENT_WRONG.value
    set_vector(grains.speed, i, col.BEFORE, bounce.v)
    row = index(number)
    besides = mass * (bounce.impulse - 2.0 * away)
    books.impulse[row, one] += besides
    if world.noting is not None:
        world.near.wall_drag[index(int(touches.wall_rows[c, col.LISTED])), col.PRESSED] += besides
    if gives_work(wall):
        turned = given(u, v - before)
        give_work(books, row, one, 0.5 * mass * (bounce.work - turned))
    heat = book_energy(books, (row, one, one), mass, bounce)
    if world.counts is not None:
        world.counts.give(member, heat, bounce.wait)
    if books.absorbed_time is not None and bounce.wait == math.inf:
        absorb(books, one, member, time)
        return Status.LEASE_ENDED.value
    if world.held is not None and bounce.wait > 0.0:
        hold(world.held, grains, i, time + bounce.wait)
    return Status.DONE.value
