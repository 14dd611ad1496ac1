"""The impact of a ball on a wall with a mass, after which the balls near walls with a mass look for their next wall."""

import math

from ...common.status import Status
from ...kernel.arrays import index
from ...kernel.gravity import potential
from ...kernel.jit import outlined, select
from ...kernel.vector import ZERO, square
from ...lanes.watching.log import Struck
from ...state import absorb
from ..reacting.freedoms import TOO_LONG, TOO_SHORT, ParticleFlight
from ..reacting.strikes import Ball, all_stay, exit_at, strike, with_energy
from .again import aim_again, queue_both, vanish
from .bounce import FLIES, let_out
from .clock import EVENTS, moment_of
from .followed import follow
from .heavy import LISTED, SINCE, STRIKES, first_number
from .next_collision import find_wall
from .queue import FIRST, requeue
from .window import END


@outlined
def strike_heavy(box, flock, books, clock, i, now):
    """Carry out the impact of a ball on the wall with a mass that it meets now; return a status."""
    heavy, m = box.heavy, box.kinds.mass_of(i)
    wall = flock.wall(i) - first_number(box)
    follow(box, flock, books, clock, i, now)
    r, v = flock.at(box.pull, i, now)
    if box.gates is not None and box.gates.escape_time is not None:
        radius = box.kinds.radius_of(i)
        flight = ParticleFlight(r, v, ZERO, now, 0.0)
        out = exit_at(heavy.grown(radius), wall, heavy.freedoms, flight, radius)
        if out >= 0.0:
            let_out(box, flock, books, clock, out, (i, now, r, v))
            vanish(box, flock, i)
            return FLIES
    twice = flock.kept(i, square(v) + 2.0 * potential(box.pull, r))
    blow = _blow(box, flock, wall, ParticleFlight(r, v, ZERO, now, 0.0), (i, books.impacts[index(i)]))
    left, fall = twice - 2.0 * (blow.given + blow.lost) / m, 2.0 * potential(box.pull, blow.r)
    if books.heat is not None:
        left += 2.0 * blow.heat / m
    v1, kept = with_energy(blow.v, left, fall)
    if box.gates is not None and box.gates.absorbed_time is not None and not blow.stays:
        v1, kept = v, left
        absorb(box.gates, index(i), blow.owner, moment_of(clock, now))
    if box.seeding is not None and math.isnan(v1.x):
        return Status.SENT_WRONG.value
    flock.put(i, now, blow.r, v1)
    flock.keep(i, kept)
    _book(box, books, i, blow)
    struck = Struck(i, float(blow.owner), moment_of(clock, now), blow.r, v, v1, blow.impulse, blow.slip)
    box.watchers.hit(books.image, struck)
    if box.repose is not None:
        box.repose.count(clock, (blow.impulse / m) * (blow.impulse / m), now)
    heavy.counts[STRIKES] += 1.0
    stays = all_stay(heavy.walls, wall, heavy.freedoms)
    if blow.stays:
        aim_again(box, flock, i, now)
        queue_both(flock, i)
    else:
        vanish(box, flock, i)
    if stays:
        _look_again(box, flock, now)
    else:
        renew_leases(box, flock, clock, now)
    return FLIES


def _blow(box, flock, wall, flight, ball):
    """Return the `WallImpact` of a ball; `ball` is its number, and the number of its impacts so far."""
    (i, impacts), heavy = ball, box.heavy
    radius, random = box.kinds.radius_of(i), None
    walls = heavy.grown(radius)
    if box.loss is not None:
        spares = box.loss.spares(flock, i, flight.time)
        walls = tuple(one._replace(restitution=select(spares, 1.0, one.restitution)) for one in walls)
    if box.seeding is not None:
        random = box.seeding.of_impact(i, impacts, box.laws)
    return strike(walls, wall, heavy.freedoms, flight, box.kinds.mass_of(i), random, Ball(i, radius, box.turning))


def _book(box, books, i, blow):
    row = index(blow.row)
    books.impulse[row, 0] += blow.impulse
    if books.dissipated.size > 0:
        books.dissipated[index(i)] += blow.lost
    if books.heat is not None:
        books.heat[row, 0] += blow.heat
        if box.watchers.counts is not None:
            box.watchers.counts.give(float(blow.owner), blow.heat, 0.0)
    books.impacts[index(i)] += blow.impulse > 0.0


@outlined
def _look_again(box, flock, now):
    """Find the next wall of each near ball after a strike."""
    heavy = box.heavy
    count = int(heavy.counts[LISTED])
    heavy.counts[LISTED] = 0.0
    for k in range(count):
        item = heavy.close[index(k)]
        heavy.listed[index(item)] = False
        # A ball that is near again is listed at a place that has been read.
        if heavy.near[index(item)]:
            find_wall(box, flock, item, now)
            requeue(flock, item)


@outlined
def renew_leases(box, flock, clock, now):
    """Renew the leases of the walls; all balls look for their next wall."""
    heavy, freedoms = box.heavy, box.heavy.freedoms
    each = (clock[EVENTS] - heavy.counts[SINCE]) / flock.number()
    for freedom in heavy.ways:
        k = index(freedom.row)
        width = freedoms.width[k]
        # A wider lease lasts longer, unless it ends where the Taylor polynomial of the motion does.
        ends = freedoms.until[k] <= now
        short = freedom.away(freedoms) >= width or (
            ends and freedom.keeps(freedoms, 2.0 * width) > freedom.keeps(freedoms, width)
        )
        if short and each < TOO_SHORT:
            freedoms.width[k] = 2.0 * width
        elif each > TOO_LONG:
            freedoms.width[k] = 0.5 * width
        freedom.renew(freedoms, now)
    heavy.counts[SINCE] = clock[EVENTS]
    for i in range(flock.number()):
        find_wall(box, flock, i, now)
        requeue(flock, i)


def renew_ended(box, flock, clock, end):
    """Renew the leases that end before the next event and before the end of the frame, each at its end."""
    until = min(box.heavy.freedoms.until)
    last = end if box.window is None else min(end, box.window[END])
    while until <= flock.key[FIRST] and until < last:
        renew_leases(box, flock, clock, until)
        until = min(box.heavy.freedoms.until)


def shift_leases(freedoms, shift):
    """Shift the zero of the times of the walls by `shift` [s]."""
    for k in range(freedoms.time.size):
        freedoms.time[index(k)] -= shift
        freedoms.until[index(k)] -= shift
