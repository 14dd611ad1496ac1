"""Steps of soft balls, from frame to frame.

A step gathers the contacts that may exist, solves for the impulses, and checks whether these have led to new contacts.
The velocities at its end follow from the impulses, each of which acts on two bodies with opposite signs: momentum
is conserved however well the impulses are solved.
"""

import math
from typing import Any, NamedTuple

from ..common.status import Status
from ..kernel.arrays import index
from ..kernel.gravity import accelerated
from ..kernel.jit import Array, outlined, select, wide_long_kernel
from ..kernel.vector import ZERO, set_vector, square, vector_at
from ..lanes.watching.log import is_full
from . import grain_arrays as col
from .at_walls import gather_at_wall, push_walls, sweep_wall
from .booking import book_pairs, book_wall, count_members
from .contacts import ContactSweep, find_more_pairs, find_pairs, foresee, travel_of, weight_of, worse
from .exits import let_out, open_wall
from .friction import book_rubbing, rub_wall, twist_wall
from .heavy_walls import begin_walls, fly_wall, is_heavy, push_back
from .held import let_go
from .lanes_of_pairs import group_pairs, push_pairs, rub_pairs, sweep_pairs, twist_pairs
from .logged import log_pairs, log_wall, note_pairs, note_wall
from .overlaps import look_at_pairs, look_at_wall
from .passing import count_moves
from .rolling import book_rolling, book_rolling_pairs, roll_pairs, roll_wall, turn_pairs, turn_wall
from .sent_off import send_off
from .vessel import SweptWall, moves, sweep_of

# A sweep is the last one if the next one would change no impulse by more than the part `_SOLVED`. It is also the last
# one if its change is below `_NEARLY` and more than `_GAIN` of the change before: that is round-off of large impulses
# that nearly cancel.
_SOLVED, _NEARLY, _GAIN = 2e-14, 1e-10, 0.5
# `_SOLVED` if friction and a damper act at every contact: 1e-4 of the speeds there. Positions, velocities and
# spins of piles that fall, roll and lie agree to three digits with those of normal impulses solved to round-off, and
# overlaps to 1e-9 of a radius; friction leaves errors of 1e-8 to 6e-6. (Rejected: 1e-9, which takes a sweep less as
# grains fall, and leaves an error of 2e-6 of a radius in a heap of eight.)
_BESIDE_FRICTION = 1e-10
# The ratio of the changes of two successive sweeps is taken to be no less than this.
_LEAST_RATIO = 0.1
# Where rolling is resisted, friction is solved to this part of its tolerance, as a sweep for both leaves larger errors.
# The distance that a ball rolls on a plane then agrees with its energy to 5e-7; with 1, to 2.4e-6.
_ROLLED = 0.5
# A contact that a sweep for friction changed by less than this part of the tolerance does not make the other contacts
# of its balls due. As grains fall, errors depend on this number, and the number of sweeps on the tolerance: relative
# to 0.5 and 0.15, the rms error of velocities in 20 steps is 0.8 to 0.95, in 0.85 of the sweeps; 1.1 in an avalanche
# and 1.4 at rest, in 0.7 and 0.8 of the sweeps.
_STIRRING = 0.1
# Successive over-relaxation of friction, omega = 2/(1 + 1/sqrt(k + 1)) after k slow sweeps, up to `_MOST_RELAXED`; the
# change of a slow sweep is more than `_SLOW` of the change before. Nearly all contacts of a pile stick, and with
# omega = 1 the ratio of successive changes is 0.985 where 1000 grains lie: four times the sweeps to 1e-7.
# (Rejected: omega from 1.3 on in all sweeps, half the error where 1000 fall, and 40 times where contacts are few;
# always 1.7, twice the sweeps as they fall; Anderson's acceleration, 80 sweeps to 4e-7 and 300 to 1e-6 where they lie,
# and 20 to 1e-8 where they fall; Nesterov's; friction that is extrapolated from step to step: no fewer sweeps;
# conjugate gradients on the contacts that stick, if these are known: 12 iterations a digit where 1000 lie, 38 where
# 10 000 do, each of two sweeps.)
_SLOW, _MOST_RELAXED = 0.25, 1.7
# Sweeps for friction go on to round-off while they have improved no more contacts than this in a step: a few grains are
# exact whatever the tolerance is, and a pile gets no more sweeps.
_CHEAP = 128
_MOST_SWEEPS = 1000
# The most sweeps for friction are `_RUBS_A_DIGIT`, and as many for each digit of the tolerance. After them friction is
# taken as it is, and so are dampers with changes no larger than `_LAGGING`.
_RUBS_A_DIGIT, _LAGGING = 200, 2e-6
# Where `_STALLED` sweeps, or `_STALLED_RUBS` for friction, have not brought the changes down to the part `_BETTER`, the
# share of a change that is made is halved, down to `_LEAST_SHARE`. Sweeps for friction may be slow without a cycle:
# with 20 in place of 100, 1000 grains that lie take 5 times as many sweeps.
_STALLED, _STALLED_RUBS, _BETTER, _LEAST_SHARE = 20, 100, 0.7, 1.0 / 64.0


class MarchRule(NamedTuple):
    """How far `march` goes: the length of the frame, the step before which to stop, the most steps of the call."""

    span: float  # the length of the frame [steps]
    stop: float  # the step of the frame before which to stop
    halt: Array  # (1,) the most steps of the call
    moment: float  # the end of the frame [s]


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
    places: Any = None  # for each wall an array (members,) int64: the number of each member in the scene; or None


# --- One step --------------------------------------------------------------------------------------------


@outlined
def _begin(matter, grains, touches, skin):
    """Set the velocities at the end of the step by the change of the last step; return whether the lists still hold.

    The sums of the impulses of pairs become 0, and the spins those of a step without contacts.
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
    """Set the spins at the end of the step to those of a step without contacts."""
    if grains.spin is not None:
        for k in range(grains.spin.shape[0]):
            set_vector(grains.spin, index(k), col.AFTER, vector_at(grains.spin, index(k), col.BEFORE))


@outlined
def _forget_given(grains):
    """Set the sums of the impulses of pairs to 0."""
    for k in range(grains.change.shape[0]):
        set_vector(grains.change, index(k), col.GIVEN, ZERO)


@outlined
def _fly(matter, grains):
    """Set the velocities at the end of the step from the summed impulses of pairs, and these sums to 0."""
    speed = grains.speed
    for k in range(speed.shape[0]):
        i = index(k)
        v = vector_at(speed, i, col.BEFORE)
        if matter.holds is None or grains.place[i, col.LIGHTNESS] > 0.0:
            v = accelerated(matter.pull, v, matter.h)
        set_vector(speed, i, col.AFTER, v + vector_at(grains.change, i, col.GIVEN))
        set_vector(grains.change, i, col.GIVEN, ZERO)


def _gather(matter, walls, world, travel):
    """Add the contacts at the foreseen places, or the missing ones by a `Travel`; return how many are new."""
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
    """Set the velocities at the end of the step from all impulses; impulses of pairs have been summed."""
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
    """Set velocities and spins at the end of the step from the current impulses of all contacts."""
    push_pairs(matter, world.grains, world.touches)
    _push(matter, walls, world)
    _turn(matter, walls, world)


def _twist_at_walls(matter, walls, world):
    """Add the twists of walls, and the resistance to rolling, to the spins at the end of the step."""
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
    """Set the spins at the end of the step from all impulses; the velocities there are known."""
    _forget_spins(world.grains)
    if matter.pairs.friction is not None:
        twist_pairs(matter, world.grains, world.touches)
    _twist_at_walls(matter, walls, world)


def _sweep(matter, walls, world, share):
    """Improve all normal impulses by a share of their changes; return the largest relative change."""
    grains, touches = world.grains, world.touches
    worst = sweep_pairs(matter, grains, touches, share)
    for k, wall in enumerate(walls.each):
        worst = worse(sweep_wall(matter, matter.walls[k], wall, grains, touches, k, share), worst)
    return worst


def _rub(matter, walls, world, sweep):
    """Improve all impulses and friction; return the largest relative change, and the largest of normal impulses."""
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
    """Return the share of changes to make, the least change so far, and how many sweeps ago it was."""
    share, best, since = pace
    if worst <= _BETTER * best:
        return share, worst, 0
    if since + 1 < patience:
        return share, best, since + 1
    return max(0.5 * share, _LEAST_SHARE), best, 0


def _contacts(walls, touches):
    """The number of contacts."""
    return touches.used[0] + sum(touches.wall_spans[1, k] for k in range(len(walls.each)))


def _is_round_off(worst, before):
    """Whether the change of a sweep is round-off of large impulses that nearly cancel."""
    return worst <= _NEARLY and worst >= _GAIN * before


def _relaxation(slow):
    """Omega of the sweep after a number of slow sweeps."""
    return min(2.0 / (1.0 + 1.0 / math.sqrt(slow + 1.0)), _MOST_RELAXED)


@outlined
def _solve_friction(matter, walls, world):
    """Sweep until friction is solved; return whether it is, and the change of normal impulses in the next sweep."""
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
            # The first sweep has seen all contacts. Where dampers act everywhere, its changes bound the next ones of
            # normal impulses.
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
    """Sweep until the impulses solve the step; return whether they do, and 1 if friction or a damper lags, else 0."""
    books, lags, follows = world.books, 0, math.inf
    # Friction is solved first, to fewer digits. Then it is fixed, and normal impulses alone are solved to round-off.
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
        # The change of the next sweep, by the ratio of the last two, is only foreseen where every contact has a damper:
        # the energy that dampers take is booked from the impulses as they are, so that an error in them loses none.
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
    """Empty the lists of contacts."""
    near, touches = world.near, world.touches
    touches.used[0] = touches.used[1] = 0
    near.is_on[:] = False
    near.wall_is_on[:] = False
    for k in range(len(walls.each)):
        touches.wall_spans[0, k], touches.wall_spans[1, k] = near.wall_first[k], 0


@outlined
def _arrive(matter, grains):
    """Move all balls to the end of the step."""
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
    """Add the step, which ends at a time [s], to the notes of the log of contacts."""
    grains, near, touches = world.grains, world.near, world.touches
    note_pairs(matter, grains, near, touches, time)
    for k, wall in enumerate(walls.each):
        note_wall(matter, matter.walls[k], wall, grains, near, touches, world.noting, (k, time))


def _log(matter, walls, world, time):
    """Log the contacts that have ended in the step that is done, which ended at a time [s]."""
    log_pairs(matter, world, time)
    for k, wall in enumerate(walls.each):
        log_wall(matter, wall, world, (k, time))


def _book(matter, walls, world):
    """Add the contacts of the step to the totals; return the largest overlap [m]."""
    grains, near, touches, books = world.grains, world.near, world.touches, world.books
    # `RUBBED` is a row of each group that nothing else needs.
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
    """Return the `Status` of a step by its overlaps; `books.failed` has the one that fails."""
    grains, near, books = world.grains, world.near, world.books
    status = look_at_pairs(matter, grains, near, books.failed)
    for k, wall in enumerate(walls.each):
        if status == Status.DONE.value:
            status = look_at_wall(matter, wall, grains, near, books.failed, k)
    return status


def _let_go(matter, world, now):
    """Release the balls that have waited until the start of a step, `now` [s]."""
    if world.held is not None:
        let_go(world.held, world.grains, now, matter.h)


def _open(matter, walls, world):
    """Decide which walls are open to which balls in a step."""
    for k, (first, wall) in enumerate(walls.numbered()):
        open_wall(matter, wall, (k, first), world.grains, world.near)


def _let_out(matter, walls, world, time):
    """Let balls escape in a step that ends at a time; return how many do."""
    found = 0
    for k, wall in enumerate(walls.each):
        found += let_out(matter, wall, world, (k, time))
    return found


def _send_off(matter, walls, world, time):
    """Let the laws of walls act on balls with contacts that have ended in a step; return the `Status`."""
    status = Status.DONE.value
    for k, wall in enumerate(walls.each):
        if status != Status.SENT_WRONG:
            one = send_off(matter, wall, world, (k, time))
            status = status if one == Status.DONE else one
    return status


def _followed_until(world, time):
    """Return the `Followed` of the counters in a step that ends at a time [s]."""
    if world.noting is None:
        return world.followed
    return world.followed._replace(log=world.noting.log._replace(end=time))


def _swept(matter, walls, listed, grains, skin):
    """Return the `SweptWall` of all moving fields; `listed` are the walls when the lists were made."""
    found = SweptWall(0.0, 0.0)
    for (_number, field), (_first, then) in zip(walls.fields(), listed.fields(), strict=True):
        if moves(field) and not is_heavy(field):
            one = sweep_of(field.members, then.members, matter, grains, skin)
            found = SweptWall(worse(one.farthest, found.farthest), worse(one.longest, found.longest))
    return found


def _begins(matter, walls, listed, world, skin):
    """Begin the step as `_begin`, with walls with a mass; return whether all lists hold, those of moving fields too."""
    if not _begin(matter, world.grains, world.touches, skin):
        return False
    if world.heavy is not None and not begin_walls(world.heavy, matter.h) <= 0.25 * skin * skin:
        return False
    return _swept(matter, walls, listed, world.grains, skin).farthest <= 0.25 * skin * skin


def _swept_in_all(matter, walls, listed, world, skin, travel):
    """Return the `SweptWall` of balls and walls together; `travel` is the `Travel` of the balls."""
    sweep = _swept(matter, walls, listed, world.grains, skin)
    farthest, longest = worse(sweep.farthest, travel.from_list), worse(sweep.longest, travel.longest)
    if world.heavy is None:
        return SweptWall(farthest, longest)
    of_walls = travel_of(matter, world.heavy)
    both = math.sqrt(longest) + math.sqrt(of_walls.longest)
    return SweptWall(worse(of_walls.from_list, farthest), both * both)


def _arrive_walls(matter, world):
    """Move the walls with a mass to the end of the step."""
    if world.heavy is not None:
        _arrive(matter, world.heavy)


def _step(matter, walls, listed, world, skin):
    """Solve and book one step; return its `Status`. If the lists do not hold over it: LEASE_ENDED, nothing changed."""
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
        # The sums have the impulses of the new contacts alone, which are to be added after the others.
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
    # Only the last solution of a step counts, and a step that is taken again with new lists counts once.
    world.books.lagging[0] += lags
    return Status.DONE.value


# --- A frame ---------------------------------------------------------------------------------------------


@wide_long_kernel
def march(matter, walls, world, clock, rule):
    """Take step after step until the end of the frame, or the stop before it; return the `Status`.

    It is LEASE_ENDED where lists are to be made anew, as also after an escape, and LOG_FULL where the log of contacts
    needs an empty part; the caller calls this again after both. It is INTERRUPTED after `rule.halt` steps; a later
    call goes on with the same bits.
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
