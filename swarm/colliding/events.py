"""The events of balls in order of time: collisions, impacts on walls, ways from cell to cell.

One thread takes them. An event is the first of all: of equal times that of the ball with the smaller number, and of one
ball its collision with the smaller partner before a wall, a wall before the end of a cell. So touching balls that are
hit, as in Newton's cradle, hand the blow on one by one at one time.

Frames look at the balls and change no flight, so that a run has the same bits with more of them or fewer.
"""

import math
from typing import Any, NamedTuple

from ..contact.reflection import Energy, exact
from ..kernel.arrays import fetch, index
from ..kernel.gravity import potential
from ..kernel.jit import Array, long_kernel, outlined, select
from ..kernel.record import Record
from ..kernel.vector import put, square
from ..status import Status
from .aim import find_partner, find_wall, forget_wall, look_ahead, tell_partner
from .cells import cross, mark_near, until_exit
from .meet import met, squared
from .queue import FIRST, build, requeue
from .rows import DUE, FLOATS, LEAVES, MEETS, MET, PARTNER, SEEN, STAMP, TIME, WALL, WHOLES

# Of a clock: how many epochs have ended, their length [s], events and collisions so far, those at one time.
EPOCHS, LENGTH, EVENTS, COLLISIONS, SAME, CLOCK = 0, 1, 2, 3, 4, 5
# So many events a ball between which no time passes: then time does not pass at all.
_AT_ONCE = 1000


class Box(Record):
    """What the balls are in: walls and their laws, gravity, cells, kinds of balls, what is lost of their energy."""

    walls: Any
    laws: Any
    pull: Any
    grid: Any
    kinds: Any
    loss: Any  # None, or `Loss`
    log: Any = None
    growth: Any = None  # `Growth` of balls that are packed


class Books(NamedTuple):
    """What is booked: of each ball, and of all."""

    impulse: Array  # (2 walls, 1)
    dissipated: Array  # (N,), or none
    impacts: Array  # (N,)
    virial: Array  # (1,)
    image: Any = None  # (3, N) where the scene repeats
    counts: Any = None  # (walls,) impacts on each, where they are counted


class Rule(NamedTuple):
    """The end of the frame [s], and when to stop."""

    end: float
    halt: Array  # (1,) events


# --- Of one ball -------------------------------------------------------------------------------------------


def _aim(box, flock, i, now):
    """Find all that is next for a ball whose velocity has changed."""
    until_exit(box.grid, box.pull, flock, i, now)
    forget_wall(box, flock, i)
    find_wall(box, flock, i, now)
    find_partner(box, flock, i, now)


def _queue_both(flock, i):
    """Bring a ball to its place in the queue, and its partner, if that is told."""
    requeue(flock, i)
    told = tell_partner(flock, i)
    if told >= 0:
        requeue(flock, told)


@outlined
def _collide(box, flock, books, clock, i, now):
    """The collision of a ball, if its partner still has the flight that it had; else it looks for another one."""
    j = flock.tag[index(WHOLES * i + PARTNER)]
    if flock.tag[index(WHOLES * j + STAMP)] != flock.tag[index(WHOLES * i + SEEN)]:
        find_partner(box, flock, i, now)
        _queue_both(flock, i)
    else:
        # The one with the smaller number first
        one, other = min(i, j), max(i, j)
        r, v = flock.at(box.pull, one, now)
        there, w = flock.at(box.pull, other, now)
        blow = met(box, flock, (one, r, v), (other, there, w), now)
        flock.put(one, now, r, blow.one)
        flock.put(other, now, there, blow.other)
        _book(flock, books, clock, (one, other), blow, now)
        flock.event[index(FLOATS * other + MEETS)] = math.inf
        _aim(box, flock, one, now)
        _queue_both(flock, one)
        _aim(box, flock, other, now)
        _queue_both(flock, other)


def _book(flock, books, clock, pair, blow, now):
    clock[COLLISIONS] += 1.0
    books.virial[0] += blow.virial
    for k in pair:
        flock.tag[index(WHOLES * k + MET)] += 1
        if books.dissipated.size > 0:
            books.dissipated[index(k)] += 0.5 * blow.lost
        if flock.last is not None:
            flock.last[index(k)] = now


@outlined
def _bounce(box, flock, books, i, now):
    """The impact of a ball on a wall."""
    r, v = flock.at(box.pull, i, now)
    wall, m = flock.event[index(FLOATS * i + WALL)], box.kinds.mass_of(i)
    twice = square(v) + 2.0 * potential(box.pull, r)
    energy = Energy(twice, select(twice > 0.0, 0.5 / select(twice > 0.0, twice, 1.0), 0.0))
    walls = box.walls.grown(box.kinds.radius_of(i))
    bounce = exact(box.laws, walls, box.pull, wall, r, v, energy)
    if flock.last is not None:
        if now - flock.last[index(i)] < box.loss.duration:
            bounce = exact(box.laws._replace(restitution=None), walls, box.pull, wall, r, v, energy)
        flock.last[index(i)] = now
    flock.put(i, now, r, squared(bounce.v, bounce.twice_energy - 2.0 * potential(box.pull, r)))
    books.impulse[index(int(walls.row(wall))), 0] += m * bounce.impulse
    if books.dissipated.size > 0:
        books.dissipated[index(i)] += 0.5 * m * (twice - bounce.twice_energy)
    books.impacts[index(i)] += bounce.impulse > 0.0
    if books.counts is not None:
        books.counts[index(int(wall))] += bounce.impulse > 0.0


def _at_wall(box, flock, books, i, now):
    """What comes when a ball may meet a wall: it is reflected, or looks farther."""
    if flock.event[index(FLOATS * i + WALL)] >= 0.0:
        _bounce(box, flock, books, i, now)
        _aim(box, flock, i, now)
        _queue_both(flock, i)
    else:
        forget_wall(box, flock, i)
        find_wall(box, flock, i, now)
        requeue(flock, i)


@outlined
def _enter(box, flock, books, i, now):
    """The way of a ball into the next cell: whether there is room for it."""
    which, turns, fits = cross(box.grid, flock, i)
    if fits:
        if books.image is not None:
            books.image[index(which), index(i)] += turns
        if turns != 0:
            # There it meets other images of the walls.
            forget_wall(box, flock, i)
        found = look_ahead(box, flock, i, now)
        until_exit(box.grid, box.pull, flock, i, now)
        find_wall(box, flock, i, now)
        requeue(flock, i)
        if found:
            told = tell_partner(flock, i)
            if told >= 0:
                requeue(flock, told)
    return fits


# --- Of all ----------------------------------------------------------------------------------------------


@long_kernel
def mark(box, radius, first, last):
    """Mark which cells are near walls, in the planes of cells from `first` to before `last`."""
    for plane in range(first, last):
        mark_near(box.grid, box.walls, radius, plane)


@long_kernel
def begin(box, flock, first, last):
    """Find what is next for the balls from `first` to before `last`, at time 0; before the first one nobody knows."""
    for i in range(first, last):
        _aim(box, flock, i, 0.0)
        tell_partner(flock, i)


@long_kernel
def order(flock):
    """Order the queue."""
    build(flock)


@outlined
def _begin_epoch(flock, clock, now):
    """Count all times from a later one on, so that they keep their digits: how much later [s].

    It is a multiple of a power of two, so that times lose less than the round-off of one epoch.
    """
    number = float(int(now / clock[LENGTH]))
    shift = number * clock[LENGTH]
    clock[EPOCHS] += number
    for i in range(flock.number()):
        row = FLOATS * i
        flock.flight[index(row + TIME)] -= shift
        for k in (MEETS, LEAVES, DUE):
            flock.event[index(row + k)] -= shift
        if flock.last is not None:
            flock.last[index(i)] -= shift
    build(flock)
    return shift


def _fetch_next(box, flock):
    """Ask for what the events of the nodes below the first need, and for the cells around the first of them."""
    soonest, then = math.inf, 0
    for child in range(4, 8):
        key, item = flock.key[index(child)], flock.item[index(child)]
        fetch(flock.event, FLOATS * item)
        fetch(flock.flight, FLOATS * item)
        sooner = key < soonest
        soonest, then = select(sooner, key, soonest), select(sooner, item, then)
    mate = max(flock.tag[index(WHOLES * then + PARTNER)], 0)
    fetch(flock.event, FLOATS * mate)
    fetch(flock.flight, FLOATS * mate)
    x, y, z = flock.cell(then)
    for kx in range(-1, 2):
        plane = box.grid.x.offset[index(x + kx)]
        for ky in range(-1, 2):
            row = box.grid.stride * (box.grid.y.offset[index(y + ky)] + plane + z)
            fetch(flock.room, row - box.grid.stride)
            fetch(flock.room, row + box.grid.stride)


@long_kernel
def take(box, flock, books, clock, rule):
    """Take event after event until the end of the frame: (status, ball).

    LEASE_ENDED where a cell has no room for one ball more: give all cells more, and call it again. INTERRUPTED after so
    many events as the rule says; it goes on with the same bits.
    """
    end, taken = rule.end - clock[EPOCHS] * clock[LENGTH], 0
    most = float(_AT_ONCE * flock.number())
    before = -math.inf
    while True:
        i, now = flock.item[FIRST], flock.key[FIRST]
        if not now < end:
            return Status.DONE.value, 0
        if taken >= rule.halt[0]:
            return Status.INTERRUPTED.value, 0
        taken += 1
        clock[EVENTS] += 1.0
        _fetch_next(box, flock)
        if now >= clock[LENGTH]:
            shift = _begin_epoch(flock, clock, now)
            end -= shift
            before -= shift
        else:
            clock[SAME] = select(now > before, 0.0, clock[SAME] + 1.0)
            before = now
            if clock[SAME] > most:
                return Status.TIMELESS.value, i
            row = FLOATS * i
            if flock.event[index(row + MEETS)] <= now:
                _collide(box, flock, books, clock, i, now)
            elif flock.event[index(row + DUE)] <= now:
                _at_wall(box, flock, books, i, now)
            elif not _enter(box, flock, books, i, now):
                clock[EVENTS] -= 1.0
                return Status.LEASE_ENDED.value, i


@long_kernel
def show(box, flock, state, end, first, last):
    """Write the balls from `first` to before `last` to the arrays of a frame, as they are at a time of the epoch."""
    for k in range(first, last):
        i = index(k)
        r, v = flock.at(box.pull, k, end)
        for axis, cells in enumerate(box.grid.axes()):
            x = r[axis]
            if cells.period is not None:
                # Round-off at a face
                x = select(x < 0.0, 0.0, select(x >= cells.period, cells.last, x))
            state.position[axis, i] = x
        put(state.velocity, 0, i, v)
        state.balls.collisions[i] = flock.tag[index(WHOLES * k + MET)]
