"""The impact of a ball on a wall: the ball is reflected, sent off by a law, held for a time, or removed."""

import math
from typing import Any

from ...common.status import Status
from ...contact.reflection import from_relative, given, relative, rub, wall_velocity
from ...contact.wall_impact import Arriving, book, impact_on_wall
from ...kernel.arrays import index
from ...kernel.gravity import accelerated, potential
from ...kernel.jit import outlined, select
from ...kernel.record import Record
from ...kernel.vector import ZERO, dot, either, norm, square, with_square
from ...lanes.watching.log import Struck
from ...state import absorb
from ...surfaces.presence.openings import is_open
from .clock import moment_of
from .followed import follow, settle
from .rubbing import rub_wall
from .window import HELD, walls_at

# The results of an impact besides a status that ends the run: the ball flies on, has left the walls, or is held.
FLIES, GONE, STAYS = Status.DONE.value, -1, -2
# The distance, as a part of the radius, up to which a closed wall touches a ball at an open wall.
_TOUCH = 1e-9
# The least speed with which a ball leaves a wall, as a part of its speed: four roundings.
_PARTS = 2.0**-50
# The bound of this least speed where the wall curves away under the ball, as a part of the speed.
_ENOUGH = 0.25
# A bound exceeded by this factor is exceeded whatever round-off does.
_SURELY = 1.01


class Gates(Record):
    """The openings through which balls leave the walls, and the times at which they left."""

    openings: Any  # None, or each `Opened`
    escape_time: Any  # (N,) [s], or None
    absorbed_time: Any = None  # (N,) [s], or None
    absorbed_wall: Any = None  # (N,) int32, or None


@outlined
def bounce(box, flock, books, clock, i, now):
    """Carry out the impact of a ball on a wall; return FLIES, GONE, STAYS, or a status that ends the run."""
    follow(box, flock, books, clock, i, now)
    r, v = flock.at(box.pull, i, now)
    wall, walls = flock.wall(i), walls_at(box, i, now)
    if box.gates is not None and box.gates.openings is not None:
        closed = _closed_wall(box, walls, wall, i, r, v)
        if closed < 0.0:
            let_out(box, flock, books, clock, box.owner(wall), (i, now, r, v))
            return GONE
        wall = closed
    after = _turned(box, flock, books, walls, wall, (i, now, r, v))
    owner = box.owner(wall)
    row = box.row(walls, wall)
    heat = book(box.laws, books, (row, 0, index(i)), box.kinds.mass_of(i), after)
    if box.watchers.counts is not None:
        box.watchers.counts.give(owner, heat, after.wait)
    if box.repose is not None:
        box.repose.count(clock, after.impulse * after.impulse, now)
    ended = FLIES if box.laws.own is None else _end(box, flock, clock, wall, i, now, after)
    v1 = either((ended == FLIES) | (ended == STAYS), after.v, v)
    flock.put(i, now if flock.holds is None else now + select(ended == STAYS, after.wait, 0.0), r, v1)
    flock.keep(i, after.twice_energy)
    struck = Struck(i, wall, moment_of(clock, now), r, v, v1, box.kinds.mass_of(i) * after.impulse)
    touch = r + box.kinds.radius_of(i) * walls.unit_normal(wall, r)
    struck = box.watchers.with_slip(box.laws, walls, struck, touch)
    box.watchers.hit(books.image, struck._replace(wall=box.owner(wall)))
    if flock.holds is not None and ended == STAYS:
        flock.aim_at(i, HELD - wall)
    return ended


def press(box, flock, books, i, now, impulse):
    """Book the normal part of an impulse [N s] on a held ball as an impulse on the wall that holds it."""
    wall, walls = HELD - flock.wall(i), walls_at(box, i, now)
    row = box.row(walls, wall)
    books.impulse[row, 0] += dot(walls.unit_normal(wall, flock.place(i)), impulse)


def let_out(box, flock, books, clock, owner, ball):
    """Let a ball escape through the wall `owner` of the scene; `ball` is as in `_turned`."""
    i, now, r, v = ball
    box.gates.escape_time[index(i)] = moment_of(clock, now)
    settle(box, books, clock, i, now, r, v)
    flock.put(i, now, r, v)
    box.watchers.hit(books.image, Struck(i, owner, moment_of(clock, now), r, v, v, 0.0))


def _end(box, flock, clock, wall, i, now, after):
    """Return what happens to a ball after the laws of a wall have acted: FLIES, GONE, STAYS, or a failing status."""
    ended = FLIES
    if math.isnan(after.v.x):
        ended = Status.SENT_WRONG.value
    elif after.wait > 0.0:
        ended = Status.WAITS.value if flock.holds is None else STAYS
        if box.gates is not None and box.gates.absorbed_time is not None and after.wait == math.inf:
            absorb(box.gates, index(i), box.owner(wall), moment_of(clock, now))
            ended = GONE
    return ended


def _turned(box, flock, books, walls, wall, ball):
    """Return the `Bounce` of a ball on a wall; `ball` is its number, the time, its position and its velocity."""
    i, now, r, v = ball
    fall, laws, random = 2.0 * potential(box.pull, r), box.laws, None
    if box.turning is not None:
        # The friction of a ball that turns is added below.
        laws = laws._replace(friction=None)
    if laws.send_off:
        random = box.seeding.of_impact(i, books.impacts[index(i)], laws)
    touch = None
    # A turning wall has the same normal velocity at the centre of the ball: only friction and laws need the contact.
    if laws.moving is not None and (laws.friction is not None or laws.send_off):
        touch = r + box.kinds.radius_of(i) * walls.unit_normal(wall, r)
    arriving = Arriving(r, v, flock.kept(i, square(v) + fall), box.kinds.mass_of(i), touch=touch)
    turned = impact_on_wall(laws, walls, box.pull, wall, arriving, random)
    if box.loss is not None and laws.restitution is not None and box.loss.spares(flock, i, now):
        turned = impact_on_wall(laws._replace(restitution=None), walls, box.pull, wall, arriving, random)
    # The stored energy determines the speed, as the square of a velocity has a bias.
    v1 = either(turned.keeps, with_square(turned.v, turned.twice_energy - fall), turned.v)
    turned = turned._replace(v=v1)
    lifted = _lifted(box, walls, wall, r, turned)
    # Friction acts by the whole normal impulse, with the one that lifts a ball in a lasting contact.
    if box.laws.friction is not None and not turned.is_sent:
        if box.turning is not None:
            return rub_wall(box.laws, walls, wall, box.turning, (i, box.kinds.radius_of(i), r), lifted)
        if lifted.impulse > turned.impulse:
            return _rubbed(box.laws, walls, wall, arriving, lifted, lifted.impulse - turned.impulse)
    return lifted


@outlined
def _lifted(box, walls, wall, r, turned):
    """Return a `Bounce` at least so fast away from the wall that the flight back to it takes `box.shortest`.

    The energy that the ball gains by this is booked as a negative loss, which the next impact takes back. The velocity
    along the wall is kept. Where walls do not change the energy, the velocity is turned instead, and the speed is kept.
    """
    u = wall_velocity(box.laws.moving, walls, wall, r)
    w, pull = relative(u, turned.v), accelerated(box.pull, ZERO, 1.0)
    # Where the wall curves away within that flight, a part of the speed is enough; a turning wall may carry the ball.
    most = max(_ENOUGH * max(norm(w), norm(turned.v)), 0.5 * norm(pull) * box.shortest)
    # Few balls leave so slowly that the acceleration at the wall is needed.
    if 0.5 * turned.twice_away > _SURELY * max(most, _PARTS * norm(turned.v)):
        return turned
    n = walls.unit_normal(wall, r)
    away = -dot(n, w)
    held = walls.outward_acceleration(wall, r, turned.v + away * n, pull)
    # Fast enough to be above the round-off of the ball's own velocity.
    least = max(min(0.5 * held * box.shortest, most), _PARTS * norm(turned.v))
    # An absorbed ball keeps its velocity.
    if away < least and turned.wait < math.inf:
        lift = least - away
        v, gained, work, speed2 = turned.v - lift * n, lift * (least + away), given(u, -lift * n), square(turned.v)
        if not box.laws.change_energy and speed2 > 4.0 * least * least:
            v, gained = with_square(v * math.sqrt(speed2 / square(v)), speed2), 0.0
        return turned._replace(
            v=v, impulse=turned.impulse + lift, lost=turned.lost - gained, work=turned.work + work,
            twice_energy=turned.twice_energy + gained + work,
        )  # fmt: skip
    return turned


def _rubbed(laws, walls, wall, arriving, bounce, impulse):
    """Return the `Bounce` of a ball that does not turn, with the friction of a further normal impulse."""
    n, u = walls.unit_normal(wall, arriving.r), wall_velocity(laws.moving, walls, wall, arriving.contact())
    w = relative(u, bounce.v)
    rubbed, taken = rub(laws, wall, n, w, impulse)
    work = given(u, rubbed - w)
    return bounce._replace(
        v=from_relative(u, rubbed), twice_energy=bounce.twice_energy - taken + work, work=bounce.work + work,
        lost=bounce.lost + taken,
    )  # fmt: skip


@outlined
def _closed_wall(box, walls, wall, i, r, v):
    """Return the wall that reflects a ball that meets `wall`: another one if its foot is in an opening, or -1."""
    if not _is_open(box, walls, wall, i, r):
        return wall
    number, touch = walls.numbers_near(r), _TOUCH * box.kinds.radius_of(i)
    for k in range(number.size):
        w = relative(wall_velocity(box.laws.moving, walls, number[k], r), v)
        here = dot(walls.unit_normal(number[k], r), w) > 0.0 and walls.distance(number[k], r) >= -touch
        if here and number[k] != wall and not _is_open(box, walls, number[k], i, r):
            return number[k]
    return -1.0


def _is_open(box, walls, wall, i, r):
    foot = r + box.kinds.radius_of(i) * walls.unit_normal(wall, r)
    return is_open(box.gates.openings, wall, foot, 0.0)
