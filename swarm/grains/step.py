"""Steps of soft balls, from frame to frame.

A step gathers the contacts that may exist, solves for the impulses, and checks whether these have led to new contacts.
Its end follows from its impulses, each of which is there twice with opposite signs: momentum does not depend on
how well they are solved.
"""

import math
from typing import Any, NamedTuple

from ..common.status import Status
from ..kernel.arrays import index
from ..kernel.gravity import accelerated
from ..kernel.jit import Array, outlined, select, wide_long_kernel
from ..kernel.vector import ZERO, square
from ..lanes.watching.log import is_full
from . import grain_arrays as col
from .at_walls import gather_at_wall, push_walls, sweep_wall
from .booking import book_pairs, book_wall, count_members
from .contacts import ContactSweep, find_more_pairs, find_pairs, foresee, travel_of, weight_of, worse
from .exits import let_out, open_wall
from .friction import book_rubbing, rub_wall, twist_wall
from .grain_arrays import set_vector, vector_at
from .heavy_walls import begin_walls, fly_wall, is_heavy, push_back
from .held import let_go
from .lanes_of_pairs import group_pairs, push_pairs, rub_pairs, sweep_pairs, twist_pairs
from .logged import log_pairs, log_wall, note_pairs, note_wall
from .overlaps import look_at_pairs, look_at_wall
from .passing import count_moves
from .rolling import book_rolling, book_rolling_pairs, roll_pairs, roll_wall, turn_pairs, turn_wall
from .sent_off import send_off
from .vessel import SweptWall, moves, sweep_of

# A sweep after which the next one would change no impulse by more than this part is the last one; also one that gains
# no more than half of the one before, if that is round-off of what many large impulses leave of one another.
_SOLVED, _NEARLY, _GAIN = 2e-14, 1e-10, 0.5
# Where friction acts at every contact, and a damper: 1e-4 of what moves there. Positions, velocities and spins of piles
# that fall, roll and lie are the same to three digits as with normal impulses to round-off, overlaps to 1e-9 of a
# radius, of which friction leaves 1e-8 to 6e-6. (Rejected: 1e-9, a sweep less as grains fall, and 2e-6 of a radius in
# a heap of eight.)
_BESIDE_FRICTION = 1e-10
# A sweep is not counted on to change less than this part of what the one before did.
_LEAST_RATIO = 0.1
# Where rolling is resisted friction is solved to this part of its tolerance: a sweep leaves both more of one another. A
# ball rolls on a plane as far as its energy lasts to 5e-7, and with 1 to 2.4e-6.
_ROLLED = 0.5
# A contact that a sweep for friction changed by less than this part of the tolerance leaves the others of its balls as
# they are. As grains fall errors follow from this, and how many sweeps there are from the tolerance: beside 0.5 and
# 0.15, the rms error of velocities in 20 steps is 0.8 to 0.95, in 0.85 of the sweeps; 1.1 in an avalanche and 1.4 at
# rest, in 0.7 and 0.8 of them.
_STIRRING = 0.1
# Successive over-relaxation of friction, omega = 2/(1 + 1/sqrt(k + 1)) after k slow sweeps, up to the last number; a
# slow one changes more than the first number of what the one before did. Nearly all contacts of a pile stick, and with
# omega = 1 a sweep changes 0.985 of what the one before did where 1000 grains lie: four times the sweeps to 1e-7.
# (Rejected: omega from 1.3 on in all sweeps, half the error where 1000 fall, and 40 times where contacts are few;
# always 1.7, twice the sweeps as they fall; Anderson's acceleration, 80 sweeps to 4e-7 and 300 to 1e-6 where they lie,
# and 20 to 1e-8 where they fall; Nesterov's; friction that is extrapolated from step to step: no fewer sweeps;
# conjugate gradients on the contacts that stick, if these are known: 12 iterations a digit where 1000 lie, 38 where
# 10 000 do, each of two sweeps.)
_SLOW, _MOST_RELAXED = 0.25, 1.7
# Sweeps for friction go on to round-off where they have improved no more contacts than this in a step: a few grains are
# exact whatever the tolerance is, and no sweep is added for a pile.
_CHEAP = 128
_MOST_SWEEPS = 1000
# So many sweeps for friction, and as many for each digit; then it is given as it is, and so are dampers with changes
# that are no larger than the second number.
_RUBS_A_DIGIT, _LAGGING = 200, 2e-6
# Where so many sweeps have not brought the changes down to that part, only half as large a share of them is made. Those
# for friction may be slow without going round in circles: with 20 of them 1000 grains that lie take 5 times as many.
_STALLED, _STALLED_RUBS, _BETTER, _LEAST_SHARE = 20, 100, 0.7, 1.0 / 64.0


class MarchRule(NamedTuple):
    """How many steps a frame has, the one to stop before, after how many to halt, and the end of the frame [s]."""

    span: float
    stop: float
    halt: Array  # (1,)
    moment: float


class World(NamedTuple):
    """The arrays of the run that a step changes."""

    grains: Any
    near: Any
    touches: Any
    books: Any
    followed: Any = None  # `Followed` of `Passing`, where there are counters
    counts: Any = None  # `Counts` of the contacts with members of walls, or None
    sender: Any = None  # `Sender`, or None where no wall sends balls off
    held: Any = None  # `Held`, or None where no wall holds balls
    noting: Any = None  # `Noting`, or None in a run without a log of contacts
    heavy: Any = None  # `Grains` of the walls with a mass, or None
    places: Any = None  # of each wall, of each member its number in the scene, (members,) int64; None if not needed


# --- Of one step -----------------------------------------------------------------------------------------


@outlined
def _begin(matter, grains, touches, skin):
    """The velocities at the end of a step with the last one's change; whether all may move on within the lists.

    No impulses of pairs are summed yet, and the spins are those of a step without contacts.
    """
    place, speed, listed, farthest = grains.place, grains.speed, grains.listed, 0.0
    for k in range(place.shape[0]):
        i = index(k)
        v = vector_at(speed, i, col.BEFORE)
        set_vector(speed, i, col.AFTER, v + vector_at(grains.change, i, col.LAST))
        set_vector(grains.change, i, col.GIVEN, ZERO)
        if grains.spin is not None:
            set_vector(grains.spin, i, col.AFTER, vector_at(grains.spin, i, col.BEFORE))
        foresee(matter, grains, touches.course, i)
        farthest = worse(square(vector_at(place, i, col.X) + v * matter.h - vector_at(listed, i, col.X)), farthest)
    return farthest <= 0.25 * skin * skin


@outlined
def _forget_spins(grains):
    """The spins at the end of a step without contacts."""
    if grains.spin is not None:
        for k in range(grains.spin.shape[0]):
            set_vector(grains.spin, index(k), col.AFTER, vector_at(grains.spin, index(k), col.BEFORE))


@outlined
def _forget_given(grains):
    """No impulses of pairs are summed yet."""
    for k in range(grains.change.shape[0]):
        set_vector(grains.change, index(k), col.GIVEN, ZERO)


@outlined
def _fly(matter, grains):
    """The velocities at the end of a step by the impulses of pairs that have been summed; none are after that."""
    speed = grains.speed
    for k in range(speed.shape[0]):
        i = index(k)
        v = vector_at(speed, i, col.BEFORE)
        if matter.holds is None or grains.place[i, col.LIGHTNESS] > 0.0:
            v = accelerated(matter.pull, v, matter.h)
        set_vector(speed, i, col.AFTER, v + vector_at(grains.change, i, col.GIVEN))
        set_vector(grains.change, i, col.GIVEN, ZERO)


def _gather(matter, walls, world, travel):
    """Add the contacts, first by where balls are to be, then by their `Travel`; how many are new."""
    grains, near, touches = world.grains, world.near, world.touches
    known = touches.used[0]
    if travel is None:
        new = find_pairs(matter, near, touches)
    else:
        new = find_more_pairs(matter, grains, near, touches, travel.off_course)
    if new > 0:
        group_pairs(matter, grains, near, touches, known)
    for k, wall in enumerate(walls.each):
        found = gather_at_wall(matter, matter.walls[k], wall, grains, near, touches, (k, near.wall_first[k]))
        new += found
    return new


def _push(matter, walls, world):
    """The velocities at the end of a step by all impulses; those of pairs have been summed."""
    grains, touches = world.grains, world.touches
    _fly(matter, grains)
    for k in range(len(walls.each)):
        push_walls(matter.walls[k], grains, touches, k)
    if world.heavy is not None:
        # Walls of one surface move together.
        for wall in walls.each:
            if is_heavy(wall):
                fly_wall(wall)
        for k, wall in enumerate(walls.each):
            if is_heavy(wall):
                push_back(matter.walls[k], wall, touches, k)


def _push_again(matter, walls, world):
    """The same, and the spins, by what the impulses of all contacts have become."""
    push_pairs(matter, world.grains, world.touches)
    _push(matter, walls, world)
    _turn(matter, walls, world)


def _twist_at_walls(matter, walls, world):
    """Add the twists of walls, and what resists rolling, to the spins at the end of a step."""
    grains, touches = world.grains, world.touches
    for k, wall in enumerate(walls.each):
        if matter.walls[k].friction is not None:
            twist_wall(matter, wall, grains, touches, k)
    if matter.pairs.rolling is not None:
        turn_pairs(grains, touches)
    for k in range(len(walls.each)):
        if matter.walls[k].rolling is not None:
            turn_wall(grains, touches, k)


def _turn(matter, walls, world):
    """The spins at the end of a step by all impulses, where the velocities are known."""
    _forget_spins(world.grains)
    if matter.pairs.friction is not None:
        twist_pairs(matter, world.grains, world.touches)
    _twist_at_walls(matter, walls, world)


def _sweep(matter, walls, world, share):
    """Improve all normal impulses by a share of what they are to change; the largest change."""
    grains, touches = world.grains, world.touches
    worst = sweep_pairs(matter, grains, touches, share)
    for k, wall in enumerate(walls.each):
        worst = worse(sweep_wall(matter, matter.walls[k], wall, grains, touches, k, share), worst)
    return worst


def _rub(matter, walls, world, sweep):
    """Improve all impulses with those of friction; the largest change, and the largest of normal impulses."""
    grains, touches, share = world.grains, world.touches, sweep.share
    if matter.pairs.friction is None:
        worst = sweep_pairs(matter, grains, touches, share)
        pressed = worst
    else:
        worst, pressed = rub_pairs(matter, grains, touches, sweep)
    if matter.pairs.rolling is not None:
        worst = worse(roll_pairs(matter, grains, touches, sweep), worst)
    for k, wall in enumerate(walls.each):
        if matter.walls[k].friction is None:
            off = sweep_wall(matter, matter.walls[k], wall, grains, touches, k, share)
            pressed_off = off
        else:
            off, pressed_off = rub_wall(matter, matter.walls[k], wall, grains, touches, k, sweep)
        worst, pressed = worse(off, worst), worse(pressed_off, pressed)
        if matter.walls[k].rolling is not None:
            worst = worse(roll_wall(matter.walls[k], wall, grains, touches, k, sweep), worst)
    return worst, pressed


def _stalled(pace, worst, patience):
    """The share of changes to make, the least change so far, and how many sweeps ago that was."""
    share, best, since = pace
    if worst <= _BETTER * best:
        return share, worst, 0
    if since + 1 < patience:
        return share, best, since + 1
    return max(0.5 * share, _LEAST_SHARE), best, 0


def _contacts(walls, touches):
    """How many contacts there are."""
    return touches.used[0] + sum(touches.wall_spans[1, k] for k in range(len(walls.each)))


def _is_round_off(worst, before):
    """Whether a sweep gains no more than what many large impulses leave of one another."""
    return worst <= _NEARLY and worst >= _GAIN * before


def _relaxation(slow):
    """Omega of the sweep after so many that were slow."""
    return min(2.0 / (1.0 + 1.0 / math.sqrt(slow + 1.0)), _MOST_RELAXED)


@outlined
def _solve_friction(matter, walls, world):
    """Sweep until friction changes little: whether it does, and what the next sweep would change of normal impulses."""
    before, worst, sweeps, slow, share, best, since, follows = math.inf, 1.0, 0, 0, 1.0, math.inf, 0, math.inf
    solved = matter.slips * (_ROLLED if matter.rolls else 1.0)
    cheap = _CHEAP // max(_contacts(walls, world.touches), 1)
    stirring = _SOLVED if cheap > 1 else _STIRRING * matter.slips
    world.touches.stirred[:] = -1
    while sweeps < _RUBS_A_DIGIT * (1.0 - math.log10(solved)):
        number = sweeps if matter.rubs_everywhere else 0
        inverse = 1.0 if sweeps < cheap else 1.0 / _relaxation(slow)
        worst, pressed = _rub(matter, walls, world, ContactSweep(number, share, stirring, inverse))
        sweeps += 1
        if worst <= (_SOLVED if sweeps < cheap else solved) or _is_round_off(worst, before):
            # Where this one has seen all contacts, and dampers act: friction has moved the others by that much at most.
            if sweeps == 1 and matter.damped:
                follows = _LEAST_RATIO * worse(weight_of(matter.pairs) * worst, pressed)
            break
        slow += select(worst > _SLOW * before, 1, 0)
        before = worst
        share, best, since = _stalled((share, best, since), worst, _STALLED_RUBS)
    world.books.sweeps[0] += sweeps
    return worst <= max(solved, _NEARLY), follows


@outlined
def _solve(matter, walls, world):
    """Sweep until the impulses solve the step: whether they do, and 1 where friction or a damper lags, else 0."""
    books, lags, follows = world.books, 0, math.inf
    # Friction first, to fewer digits: then it is given, and what is to be exact depends on the others alone.
    if matter.rubs:
        is_rubbed, follows = _solve_friction(matter, walls, world)
        lags = select(is_rubbed, 0, 1)
    solved = _BESIDE_FRICTION if matter.damped and matter.rubs_everywhere else _SOLVED
    if follows <= solved:
        return True, lags
    before, worst, sweeps, share, best, since = 1.0, 1.0, 0, 1.0, math.inf, 0
    while sweeps < _MOST_SWEEPS:
        worst = _sweep(matter, walls, world, share)
        sweeps += 1
        # What the next one would change, by the ratio of the last two; where only dampers act, as what they take is
        # booked by what they did.
        follows = worst * max(worst / before, _LEAST_RATIO) if matter.damped and sweeps > 1 else worst
        if follows <= solved or _is_round_off(worst, before):
            break
        if worst <= _LAGGING and share <= _LEAST_SHARE:
            break
        before = worst
        share, best, since = _stalled((share, best, since), worst, _STALLED)
    books.sweeps[0] += sweeps
    if worst > _NEARLY and follows > solved:
        lags = 1
    return worst <= _LAGGING, lags


def _forget(walls, world):
    """No contacts yet."""
    near, touches = world.near, world.touches
    touches.used[0] = touches.used[1] = 0
    near.is_on[:] = False
    near.wall_is_on[:] = False
    for k in range(len(walls.each)):
        touches.wall_spans[0, k], touches.wall_spans[1, k] = near.wall_first[k], 0


@outlined
def _arrive(matter, grains):
    """All at the end of the step."""
    place, speed, half = grains.place, grains.speed, 0.5 * matter.h
    for k in range(place.shape[0]):
        i = index(k)
        v, r = vector_at(speed, i, col.AFTER), vector_at(place, i, col.X)
        move = (vector_at(speed, i, col.BEFORE) + v) * half + vector_at(place, i, col.LOST)
        end = r + move
        set_vector(place, i, col.X, end)
        set_vector(place, i, col.LOST, move - (end - r))
        set_vector(grains.change, i, col.LAST, v - vector_at(speed, i, col.BEFORE))
        set_vector(speed, i, col.BEFORE, v)
        if grains.spin is not None:
            set_vector(grains.spin, i, col.BEFORE, vector_at(grains.spin, i, col.AFTER))


def _note(matter, walls, world, time):
    """Add the step, which ends at a time [s], to what is noted of contacts."""
    grains, near, touches = world.grains, world.near, world.touches
    note_pairs(matter, grains, near, touches, time)
    for k, wall in enumerate(walls.each):
        note_wall(matter, matter.walls[k], wall, grains, near, touches, world.noting, (k, time))


def _log(matter, walls, world, time):
    """The rows of the contacts that have ended in the step, which is done, at a time [s]."""
    log_pairs(matter, world, time)
    for k, wall in enumerate(walls.each):
        log_wall(matter, wall, world, (k, time))


def _book(matter, walls, world):
    """Book what the contacts of the step did; the largest overlap [m]."""
    grains, near, touches, books = world.grains, world.near, world.touches, world.books
    # A line of each group that nothing else is in.
    notes = world.noting is not None or matter.pairs.rolling is not None
    deepest = book_pairs(matter, grains, near, touches, books, notes)
    if matter.pairs.rolling is not None:
        book_rolling_pairs(grains, near, touches, books)
    for k, wall in enumerate(walls.each):
        deepest = max(book_wall(matter, matter.walls[k], wall, grains, touches, books, k), deepest)
        if world.counts is not None:
            count_members(matter, wall, world, k)
        if matter.walls[k].friction is not None:
            book_rubbing(matter, wall, grains, near, touches, books, k)
        if matter.walls[k].rolling is not None:
            book_rolling(wall, grains, near, touches, books, k)
    books.overlap[0] = max(deepest, books.overlap[0])
    return deepest


def _look(matter, walls, world):
    """The `Status` of a step by its overlaps; `failed` says of which one."""
    grains, near, books = world.grains, world.near, world.books
    status = look_at_pairs(matter, grains, near, books.failed)
    for k, wall in enumerate(walls.each):
        if status == Status.DONE.value:
            status = look_at_wall(matter, wall, grains, near, books.failed, k)
    return status


def _let_go(matter, world, now):
    """Let the balls go that have waited until a step that begins now [s]."""
    if world.held is not None:
        let_go(world.held, world.grains, now, matter.h)


def _open(matter, walls, world):
    """Decide which walls are open to which balls in a step."""
    for k, (first, wall) in enumerate(walls.numbered()):
        open_wall(matter, wall, (k, first), world.grains, world.near)


def _let_out(matter, walls, world, time):
    """Let balls escape in a step that ends at a time; how many do."""
    found = 0
    for k, wall in enumerate(walls.each):
        found += let_out(matter, wall, world, (k, time))
    return found


def _send_off(matter, walls, world, time):
    """Let the laws of walls act on balls with a contact that has ended in a step, at a time: the `Status`."""
    status = Status.DONE.value
    for k, wall in enumerate(walls.each):
        if status != Status.SENT_WRONG:
            one = send_off(matter, wall, world, (k, time))
            status = status if one == Status.DONE else one
    return status


def _followed_until(world, time):
    """What counters write to in a step that ends at a time [s]."""
    if world.noting is None:
        return world.followed
    return world.followed._replace(log=world.noting.log._replace(end=time))


def _swept(matter, walls, listed, grains, skin):
    """The `SweptWall` of all fields that move, which were `listed` so."""
    found = SweptWall(0.0, 0.0)
    for (_number, field), (_first, then) in zip(walls.fields(), listed.fields(), strict=True):
        if moves(field) and not is_heavy(field):
            one = sweep_of(field.members, then.members, matter, grains, skin)
            found = SweptWall(worse(one.farthest, found.farthest), worse(one.longest, found.longest))
    return found


def _begins(matter, walls, listed, world, skin):
    """`_begin` of balls and of walls with a mass, within the lists of fields that move too."""
    if not _begin(matter, world.grains, world.touches, skin):
        return False
    if world.heavy is not None and not begin_walls(world.heavy, matter.h) <= 0.25 * skin * skin:
        return False
    return _swept(matter, walls, listed, world.grains, skin).farthest <= 0.25 * skin * skin


def _swept_in_all(matter, walls, listed, world, skin, travel):
    """The `SweptWall` of balls and walls together; `travel` is that of balls."""
    sweep = _swept(matter, walls, listed, world.grains, skin)
    farthest, longest = worse(sweep.farthest, travel.from_list), worse(sweep.longest, travel.longest)
    if world.heavy is None:
        return SweptWall(farthest, longest)
    of_walls = travel_of(matter, world.heavy)
    both = math.sqrt(longest) + math.sqrt(of_walls.longest)
    return SweptWall(worse(of_walls.from_list, farthest), both * both)


def _arrive_walls(matter, world):
    """The walls with a mass at the end of the step."""
    if world.heavy is not None:
        _arrive(matter, world.heavy)


def _step(matter, walls, listed, world, skin):
    """One step but for its end: its `Status`; LEASE_ENDED where the lists do not hold over it, nothing has changed."""
    grains = world.grains
    if not _begins(matter, walls, listed, world, skin):
        return Status.LEASE_ENDED.value
    if matter.openings is not None:
        _open(matter, walls, world)
    _forget(walls, world)
    _gather(matter, walls, world, None)
    _push(matter, walls, world)
    _twist_at_walls(matter, walls, world)
    while True:
        is_solved, lags = _solve(matter, walls, world)
        if not is_solved:
            return Status.UNSOLVED.value
        _push_again(matter, walls, world)
        travel = travel_of(matter, grains)
        if _gather(matter, walls, world, travel) == 0:
            break
        # Those of the new contacts, which are to be summed after the others.
        _forget_given(grains)
        _push_again(matter, walls, world)
    sweep = _swept_in_all(matter, walls, listed, world, skin, travel)
    if not sweep.farthest <= 0.25 * skin * skin:
        return Status.LEASE_ENDED.value
    deepest, limits = _book(matter, walls, world), matter.limits
    if deepest > limits.overlap or sweep.longest > limits.move * limits.move:
        status = _look(matter, walls, world)
        if status != Status.DONE.value:
            return status
    # Of what solved the step at last, and once of a step that is taken again with new lists.
    world.books.lagging[0] += lags
    return Status.DONE.value


# --- Of a frame ------------------------------------------------------------------------------------------


@wide_long_kernel
def march(matter, walls, world, clock, rule):
    """Take step after step until the end of the frame, or the stop before it: the `Status`.

    LEASE_ENDED where lists are to be made anew, also where balls have escaped, and LOG_FULL where the log of contacts
    needs an empty part: then call this again. INTERRUPTED after so many steps as the rule says; it goes on with the
    same bits.
    """
    while clock[col.DONE] < rule.stop:
        if clock[col.TAKEN] >= rule.halt[0]:
            return Status.INTERRUPTED.value
        if world.noting is not None and is_full(world.noting.log):
            return Status.LOG_FULL.value
        left = (rule.span - clock[col.DONE]) * matter.h
        _let_go(matter, world, rule.moment - left)
        now = walls.during(left, left - matter.h)
        listed = walls.at(left + clock[col.SINCE] * matter.h)
        status = _step(matter, now, listed, world, clock[col.SKIN])
        if status != Status.DONE.value:
            return status
        time = rule.moment - (left - matter.h)
        if world.noting is not None:
            _note(matter, now, world, time)
        escaped = 0 if matter.openings is None else _let_out(matter, now, world, time)
        if matter.counters is not None:
            count_moves(matter, world.grains, _followed_until(world, time))
        _arrive(matter, world.grains)
        sent = Status.DONE.value if world.sender is None else _send_off(matter, now, world, time)
        if world.noting is not None:
            _log(matter, now, world, time)
        _arrive_walls(matter, world)
        clock[col.DONE] += 1.0
        clock[col.TAKEN] += 1.0
        clock[col.SINCE] += 1.0
        if world.sender is not None and sent == Status.SENT_WRONG:
            return sent
        if (matter.openings is not None and escaped > 0) or (world.sender is not None and sent != Status.DONE):
            return Status.LEASE_ENDED.value
    return Status.DONE.value
