"""The events of balls in order of time: collisions, impacts on walls, passages from cell to cell.

One thread takes the events, the earliest one first. At equal times the ball with the smaller number comes first. The
collision of a ball, with the smaller partner first, comes before a wall, and a wall before the end of the cell. So
touching balls in a row pass on a collision one by one at one time, as in Newton's cradle.

Frames read the balls and change no flight, so that a run has the same bits for any number of frames.
"""

import math

from ...common.status import Status
from ...kernel.arrays import fetch, index
from ...kernel.gravity import potential
from ...kernel.jit import long_kernel, outlined, select
from ...kernel.vector import either, norm, put, square
from ...lanes.watching.log import Struck, is_full
from ..reacting.queue import MOST_HITS
from .again import aim_again, queue_both, stay, vanish
from .bounce import FLIES, GONE, STAYS, bounce, press
from .cells import cross, mark_near, until_exit
from .clock import COLLISIONS, EPOCHS, EVENTS, LENGTH, REACH, SAME, fit, moment_of
from .followed import come_over, follow
from .heavy import first_number
from .meet import met
from .next_collision import between, find_partner, find_wall, forget_wall, look_ahead, tell_partner
from .queue import FIRST, build, requeue
from .rows import DUE, FLOATS, LEAVES, MEETS, MET, NO_PARTNER, PARTNER, SEEN, STAMP, TIME, WHOLES
from .striking import renew_ended, shift_leases, strike_heavy
from .window import END, HELD, OUT

# Time does not pass at all if a ball has this number of events at one time.
_AT_ONCE = 1000
# Counts of 32 bits begin anew after this number of events, each of which adds a few at most. Two balls pass 2^31 in
# less than an hour, and a row has no room for longer numbers.
_COUNTED = 2**28


# --- Events of one ball ------------------------------------------------------------------------------------


@outlined
def _collide(box, flock, books, clock, i, now):
    """Carry out the collision of a ball if its partner still has the same flight; else find its next collision."""
    j = flock.tag[index(WHOLES * i + PARTNER)]
    if flock.tag[index(WHOLES * j + STAMP)] != flock.tag[index(WHOLES * i + SEEN)]:
        find_partner(box, flock, i, now)
        queue_both(flock, i)
    else:
        # The ball with the smaller number is first.
        one, other = min(i, j), max(i, j)
        follow(box, flock, books, clock, one, now)
        follow(box, flock, books, clock, other, now)
        r, v = flock.at(box.pull, one, now)
        there, w = flock.at(box.pull, other, now)
        blow = met(box, flock, (one, r, v), (other, there, w), now)
        _send(box, flock, books, (one, r, blow.one), v, now)
        _send(box, flock, books, (other, there, blow.other), w, now)
        _book(flock, books, clock, (one, other), blow, now)
        if box.repose is not None:
            box.repose.count(clock, square((blow.other - blow.one) - (w - v)), now)
        if box.watchers.log is not None:
            impulse, after = blow.virial / norm(between(box.grid, r, there)), blow.one
            if flock.holds is not None:
                held, leaves = flock.is_held(one, now), flock.velocity(one)
                v, after = either(held, leaves, v), either(held, leaves, after)
            struck = Struck(one, -1.0, moment_of(clock, now), r, v, after, impulse, partner=other)
            box.watchers.log.hit(books.image, struck)
        flock.event[index(FLOATS * other + MEETS)] = math.inf
        for k in (one, other):
            if flock.is_held(k, now):
                stay(box, flock, k, now)
            else:
                aim_again(box, flock, k, now)
            queue_both(flock, k)


def _send(box, flock, books, ball, before, now):
    """Store the flight of a `ball` (number, place, velocity) after a collision; a held ball stays where it is."""
    i, r, v = ball
    if flock.is_held(i, now):
        press(box, flock, books, i, now, box.kinds.mass_of(i) * (v - before))
    else:
        flock.put(i, now, r, v)


def _book(flock, books, clock, pair, blow, now):
    clock[COLLISIONS] += 1.0
    books.virial[0] += blow.virial
    for k in pair:
        flock.tag[index(WHOLES * k + MET)] += 1
        if books.dissipated.size > 0:
            books.dissipated[index(k)] += 0.5 * blow.lost
        if flock.last is not None:
            flock.last[index(k)] = now


def _at_wall(box, flock, books, clock, i, now):
    """Carry out the event of a ball at a wall: an impact, a release, or a new search; return FLIES, or a failure."""
    if box.heavy is not None:
        if flock.wall(i) >= first_number(box):
            return strike_heavy(box, flock, books, clock, i, now)
        if len(box.walls.each) == 0:
            _look_for_wall(box, flock, i, now)
            return FLIES
    # Without walls `_at_given_wall` is not compiled.
    if len(box.walls.each) == 0:
        return FLIES
    return _at_given_wall(box, flock, books, clock, i, now)


def _look_for_wall(box, flock, i, now):
    forget_wall(flock, i)
    find_wall(box, flock, i, now)
    requeue(flock, i)


def _at_given_wall(box, flock, books, clock, i, now):
    ended, wall = FLIES, flock.wall(i)
    if flock.holds is not None and wall <= HELD:
        _let_go(box, flock, books, i, now)
    elif wall >= 0.0:
        ended = bounce(box, flock, books, clock, i, now)
        if ended == GONE:
            vanish(box, flock, i)
            ended = FLIES
        elif flock.holds is not None and ended == STAYS:
            box.kinds.hold(i)
            stay(box, flock, i, now)
            queue_both(flock, i)
            ended = FLIES
        elif ended == FLIES:
            aim_again(box, flock, i, now)
            queue_both(flock, i)
            # Walls that close on a ball hit it without end, in ever shorter times.
            if books.before is not None and books.impacts[index(i)] - books.before[index(i)] > MOST_HITS:
                ended = Status.STALLED.value
    else:
        _look_for_wall(box, flock, i, now)
    return ended


@outlined
def _let_go(box, flock, books, i, now):
    """Release a ball from the wall that has held it."""
    box.kinds.let_go(i, books.mass[index(i)])
    # `put` changes the stamp, so that a ball that was to meet it there looks anew.
    twice = flock.kept(i, square(flock.velocity(i)) + 2.0 * potential(box.pull, flock.place(i)))
    flock.put(i, now, flock.place(i), flock.velocity(i))
    flock.keep(i, twice)
    aim_again(box, flock, i, now)
    queue_both(flock, i)


@outlined
def _enter(box, flock, books, clock, i, now):
    """Move a ball into its next cell."""
    if books.image is not None:
        follow(box, flock, books, clock, i, now)
    r, v = flock.at(box.pull, i, now)
    which, turns = cross(box.grid, flock, i)
    if turns != 0 and box.watchers.counters is not None:
        come_over(box, flock, books, clock, (i, now, r, v))
    if books.image is not None:
        books.image[index(which), index(i)] += turns
    if turns != 0:
        # There the ball meets other images of the walls.
        forget_wall(flock, i)
        flock.keep(i, math.nan)
    found = look_ahead(box, flock, i, now)
    until_exit(box.grid, box.pull, flock, i, now)
    find_wall(box, flock, i, now)
    requeue(flock, i)
    if found:
        partner = tell_partner(flock, i)
        if partner >= 0:
            requeue(flock, partner)


# --- Events of all balls ---------------------------------------------------------------------------------


@long_kernel
def mark(box, radius, first, last):
    """Mark the cells near walls, in the planes of cells from `first` to before `last`."""
    for plane in range(first, last):
        mark_near(box, radius, plane)


@long_kernel
def next_epoch(flock, clock):
    """Begin the next epoch at the end of this one."""
    _begin_epoch(flock, clock, clock[LENGTH])


@long_kernel
def begin(box, flock, now, first, last):
    """Find the next events of the balls from `first` to before `last`.

    At the start, where `now` is negative, these are all events. At the start of a window, only walls are looked for.
    """
    for i in range(first, last):
        if flock.wall(i) <= OUT:
            continue
        if box.window is not None and now >= 0.0:
            forget_wall(flock, i)
            find_wall(box, flock, i, now)
        else:
            aim_again(box, flock, i, 0.0)
            tell_partner(flock, i)


@long_kernel
def welcome(box, flock, i, now):
    """Find the next events of a ball that is born at a time of the epoch [s]."""
    aim_again(box, flock, i, now)
    queue_both(flock, i)


@long_kernel
def order(flock):
    """Order the queue."""
    build(flock)


@outlined
def _begin_epoch(flock, clock, now):
    """Shift the zero of all times to a later time, so that they keep their digits; return the shift [s].

    The shift is a multiple of a power of two, so that times lose less than the round-off of one epoch.
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
        if flock.followed is not None:
            flock.followed[index(i)] -= shift
    if flock.freedoms is not None:
        shift_leases(flock.freedoms, shift)
    build(flock)
    return shift


@outlined
def _begin_counts_anew(flock):
    for i in range(flock.number()):
        flock.begin_counts_anew(i)
    for i in range(flock.number()):
        flock.tag[index(WHOLES * i + STAMP)] = 0


def _pass_epoch(box, flock, clock, now):
    """Begin an epoch, and fit its length if no window ends with it; return the shift [s]."""
    shift = _begin_epoch(flock, clock, now)
    if box.window is None:
        fit(clock, _speed2(box, flock, clock))
    return shift


@outlined
def _speed2(box, flock, clock):
    """The mean square of the speed, at least that of a fall by the typical way of an epoch."""
    whole = 0.0
    for i in range(flock.number()):
        whole += square(flock.velocity(i))
    fall = 0.0 if box.pull is None else norm(box.pull) * clock[REACH]
    return max(whole / flock.number(), fall)


def _first(box, flock, clock, end):
    """Return the ball and the time of the first event; renew leases of walls that end before it."""
    if box.heavy is not None:
        renew_ended(box, flock, clock, end)
    return flock.item[FIRST], flock.key[FIRST]


def _is_over(box, end, now):
    """The status that ends the call before an event at a time; -1 if the event is to be taken."""
    ended = select(now < end, -1, Status.DONE.value)
    if box.watchers.log is not None:
        ended = select((ended < 0) & is_full(box.watchers.log), Status.LOG_FULL.value, ended)
    if box.window is not None:
        ended = select((box.window[END] < end) & (not now < box.window[END]), Status.LEASE_ENDED.value, ended)
    return ended


@long_kernel
def take(box, flock, books, clock, rule):
    """Take event after event until the end of the frame; return the status and the ball.

    The status is LEASE_ENDED at the end of a window, and LOG_FULL where the log needs an empty part. It is INTERRUPTED
    after `rule.halt` events; a later call goes on with the same bits.
    """
    end, taken = rule.end - clock[EPOCHS] * clock[LENGTH], 0
    most = float(_AT_ONCE * flock.number())
    before = -math.inf
    while True:
        i, now = _first(box, flock, clock, end)
        ended = _is_over(box, end, now)
        if ended >= 0:
            return ended, NO_PARTNER
        if taken >= rule.halt[0]:
            return Status.INTERRUPTED.value, 0
        taken += 1
        clock[EVENTS] += 1.0
        if int(clock[EVENTS]) % _COUNTED == 0:
            _begin_counts_anew(flock)
        fetch_next(box, flock)
        if now >= clock[LENGTH]:
            shift = _pass_epoch(box, flock, clock, now)
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
                status = _at_wall(box, flock, books, clock, i, now)
                if status != FLIES:
                    return status, i
            else:
                _enter(box, flock, books, clock, i, now)


@long_kernel
def follow_all(box, flock, books, clock, now, first):
    """Count the crossings of the balls from `first` on until now; return where the log is full, or their number."""
    for i in range(first, flock.number()):
        if is_full(box.watchers.log):
            return i
        if flock.wall(i) != OUT:
            follow(box, flock, books, clock, i, now)
    return flock.number()


@long_kernel
def show(box, flock, state, end, first, last):
    """Write the balls from `first` to before `last`, at a time of the epoch, to the arrays of a frame."""
    for k in range(first, last):
        i = index(k)
        r, v = flock.at(box.pull, k, end)
        if box.gates is not None and flock.wall(k) == OUT:
            r, v = flock.place(k), flock.velocity(k)
        # The velocity with which a held ball leaves.
        v = either(flock.is_held(k, end), flock.velocity(k), v)
        for axis, cells in enumerate(box.grid.axes()):
            x = r[axis]
            if cells.period is not None:
                # Round-off at a face may leave the cell.
                x = select(x < 0.0, 0.0, select(x >= cells.period, cells.last, x))
            state.position[axis, i] = x
        put(state.velocity, 0, i, v)


def fetch_next(box, flock):
    """Fetch the rows of the events below the first node, and the cells around the ball of the earliest of them.

    They arrive while the first event is taken: with a million balls, this saves a third of the time.
    """
    soonest, then = math.inf, 0
    for child in range(4, 8):
        key, item = flock.key[index(child)], flock.item[index(child)]
        fetch(flock.event, FLOATS * item)
        fetch(flock.flight, FLOATS * item)
        box.kinds.ask(item)
        sooner = key < soonest
        soonest, then = select(sooner, key, soonest), select(sooner, item, then)
    mate = max(flock.tag[index(WHOLES * then + PARTNER)], 0)
    fetch(flock.event, FLOATS * mate)
    fetch(flock.flight, FLOATS * mate)
    box.kinds.ask(mate)
    x, y, z = flock.cell(then)
    for kx in range(-1, 2):
        plane = box.grid.x.offset[index(x + kx)]
        for ky in range(-1, 2):
            fetch(flock.head, box.grid.y.offset[index(y + ky)] + plane + z)
