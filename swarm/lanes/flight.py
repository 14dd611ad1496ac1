"""Fly every lane of a block to its next contact, or to the end of the frame."""

import numpy as np

from ..kernel.arrays import index, unwritten
from ..kernel.jit import outlined, select
from ..methods.contract import HARD
from ..surfaces.in_motion.moving import Aimed, Carried, Leaping, Marched, Strided
from ..surfaces.periodic.period import cut
from ..surfaces.presence.rooms import at_the_end, inside_of
from ..surfaces.time_of_impact import aim, flights, safe, strides
from ..surfaces.time_of_impact.course import MORE_STEPS, SAFE_STEPS
from ..surfaces.time_of_impact.polynomial import AIMED, POLYNOMIAL_STEPS
from .field_hits import hit_of_lane, keep_hit, seek
from .in_moving_cells import go_through_moving
from .lane_arrays import Flying
from .periodic import cut_steps
from .table import STRIDE, LaneView, Rows, copy_lane, marked_lanes, whole_eights

# The number of further safe steps that all lanes take in a pass after the first one to walls in any motion.
_STRIDES = 3
# All lanes improve guesses together if at least one in _MANY needs it, and look together if one in _LOOK does.
_MANY, _LOOK = 8, 4


_named = Rows()


class Open(LaneView):
    """A lane without a proven hit: its start, and the time left of the frame."""

    r, v, remaining = _named.vector(), _named.vector(), _named.number()
    COUNT = _named.count


def go(method, walls, gravity, lanes, live):
    """Fly every lane to its next contact, or to the end of the frame.

    A shorter loop has more lanes under way in a processor, a longer loop writes less. Measured in a sphere, nanoseconds
    an impact: first hit, flight and contact in one loop 7.2, a loop for each 5.2; with fewer operations now, flight
    and contact in one loop 3.6, first hit and flight 3.3 (an ellipsoid 4.4, 3.9). The safe steps of a fall in one loop
    110, a loop for each 35. (To keep |v|^2 and 1/|v|^2 of a lane saves nothing, and their round-off is the same in each
    flight of a particle: the angular momentum in a sphere drifted five times as fast.)
    """
    met = method.landed_on(walls)
    if method.steps_into_walls and walls.accelerate:
        _step_off(method, walls, gravity, lanes, live)
        return
    _search(met, walls, gravity, lanes, live)
    for i in range(index(live)):
        _flight(method, walls, gravity, lanes, i, _first_hit(met, walls, gravity, lanes.lane(i), lanes, i))


def _step_off(method, walls, gravity, lanes, live):
    """Fly the lanes that step into walls in any motion and touch no wall now, by free steps.

    Most lanes are in a contact, and its next step needs no safe step. Safe steps of all lanes were more than half
    of the time, in a sphere that is carried along a circle as in a box that turns.
    """
    for i in range(index(live)):
        lane = lanes.given(method, i)
        lanes.wall[i] = select(lane.remaining > 0.0, method.touched(walls, gravity, lane), -1.0)
        lanes.marked[i] = (lanes.wall[i] < 0.0) & (lanes.wall[i] > HARD)
    _fly_beside(method, walls, gravity, lanes, marked_lanes(lanes, live))


@outlined
def _fly_beside(method, walls, gravity, lanes, some):
    """Fly the first `some` lanes of `lanes.order`, side by side in a table of their own.

    First hits of all lanes with their walls are found together: one safe step of each wall by itself ended far
    from most, and took half of the time of all steps into walls that turn.
    """
    beside = lanes._replace(
        rows=unwritten((Flying.ROWS, STRIDE), np.float64), wall=unwritten(STRIDE, np.float64),
        order=unwritten(STRIDE, np.int64),
    )  # fmt: skip
    for k in range(index(some)):
        copy_lane(lanes.rows, index(lanes.order[k]), beside.rows, k, Flying.ROWS)
    if isinstance(walls, Strided):
        for k in range(index(some)):
            # The search measures the time left of a frame in seconds.
            lane = beside.lane(k)
            lane.remaining = method.seconds(lane.remaining)
        _stride(walls, gravity, beside, some)
        for k in range(index(some)):
            beside.lane(k).remaining = lanes.lane(index(lanes.order[k])).remaining
    for k in range(index(some)):
        free = strides.met(beside.course, k) if isinstance(walls, Strided) else None
        _flight(method, walls, gravity, beside, k, free)
    for k in range(index(some)):
        i = index(lanes.order[k])
        copy_lane(beside.rows, k, lanes.rows, i, Flying.ROWS)
        lanes.wall[i] = beside.wall[k]


def _search(met, walls, gravity, lanes, live):
    """Find first hits with fields and by safe steps, in separate loops."""
    if met is None:
        return
    if _has_fields(met):
        free, before = walls.others(), walls.count_in_fields()
        _search(free, free, gravity, lanes, live)
        for i in range(index(live)):
            keep_hit(lanes, i, _first_hit(free, free, gravity, lanes.lane(i), lanes, i), before)
        seek(walls, gravity, lanes, live)
    elif _leaps(met):
        _leap(walls, gravity, lanes, live)
    elif isinstance(met, Strided):
        _stride(walls, gravity, lanes, live)
    elif met.each and not isinstance(met, Marched) and not _is_closed(gravity, walls):
        _go_by_steps(walls, gravity, lanes, live)


def _first_hit(met, walls, gravity, lane, lanes, i):
    """Return the first hit of a lane with the walls that the method lands on; None if it lands on none."""
    if met is None:
        return None
    if not met.each:
        return flights.NEVER
    if _has_fields(met) or _leaps(met):
        return hit_of_lane(lanes, i)
    if isinstance(met, Strided):
        return strides.met(lanes.course, i)
    if isinstance(met, Marched):
        return safe.first_hit_moving(walls, gravity, lane.r, lane.v, lane.remaining)
    if _is_closed(gravity, walls):
        return flights.first_hit(walls.at(lane.remaining), gravity, lane.r, lane.v)
    return flights.end(walls.at(lane.remaining), gravity, lanes.course, 0, i, (lane.r, lane.v))


def _has_fields(met):
    """Whether walls at rest are bodies of a field."""
    return len(met.fields()) > 0 and not isinstance(met, Carried)


def _leaps(met):
    """Whether lanes leap through the cells of all fields, which move."""
    return isinstance(met, Leaping) and len(met.fields()) > 0 and not met.unions


def _leap(walls, gravity, lanes, live):
    """Find the first hit of every lane with walls in no field, then with the fields."""
    free, before = walls.others(), walls.count_in_fields()
    for i in range(index(live)):
        lane = lanes.lane(i)
        found = flights.NEVER
        if free.each:
            found = safe.first_hit_moving(free, gravity, lane.r, lane.v, lane.remaining)
        keep_hit(lanes, i, found, before)
    for number, field in reversed(walls.fields()):
        go_through_moving(gravity, field.members, number, lanes, live)


def _is_closed(gravity, walls):
    """Whether the first hit has a closed form: flights are straight, and no wall is met by steps."""
    return gravity is None and not walls.in_steps()


def aims(walls, gravity):
    """Whether first hits with walls in any motion are guessed and proven."""
    # For falls past walls proofs fail too often: in a box that shakes they took half as long again.
    return gravity is None and isinstance(walls, Aimed)


def _stride(walls, gravity, lanes, live):
    """Make safe steps of all lanes to walls in any motion."""
    if aims(walls, gravity):
        _stride_open(walls, gravity, lanes, _aim_at_moving(walls, gravity, lanes, live))
        return
    _of_flights(strides.start, walls, gravity, lanes, live)
    _of_flights(strides.stride, walls, gravity, lanes, live, True)
    for _round in range(_STRIDES):
        _of_flights(strides.stride, walls, gravity, lanes, live, False)


def _aim_at_moving(walls, gravity, lanes, live):
    """Prove the hits of lanes with walls in any motion; return the number of the others, which are in `lanes.order`.

    The others take one safe step, and aim again in the next pass. Each loop is short: a processor holds some hundred
    operations that wait for a sine, a root or a quotient, and begins no other lane when these belong to two lanes.
    (Measured in a box that turns: levels, their root, bounds and the proof in one loop take 1.2 of the time.)
    """
    course = lanes.course
    if aim.lacks_passages(walls):
        for i in range(index(live)):
            aim.put_angles(walls, course, i, lanes.lane(i).remaining)
        _put_waves(walls, course, live, False)
    _of_flights(aim.start, walls, gravity, lanes, live)
    if aim.lacks_passages(walls):
        _of_flights(aim.guess_by_levels, walls, gravity, lanes, live)
    for left in range(aim.AIMS, -1, -1):
        for i in range(index(live)):
            aim.put_angles_at_guess(walls, course, i, lanes.lane(i).remaining)
        _put_waves(walls, course, live, left > 0)
        _of_flights(aim.put_levels, walls, gravity, lanes, live, left == 0)
        for i in range(index(live)):
            if left > 0:
                aim.improve(course, i, lanes.lane(i).remaining)
            else:
                aim.put_way(course, i)
    _of_flights(aim.put_ends, walls, gravity, lanes, live)
    _of_flights(aim.prove, walls, gravity, lanes, live, False)
    for i in range(index(live)):
        aim.carry_waves(walls, course, i)
    return _mark_open(lanes, live)


def _of_flights(ask, walls, gravity, lanes, live, *given):
    """Call `ask` with the flight of every lane."""
    for i in range(index(live)):
        lane = lanes.lane(i)
        ask(walls, gravity, lanes.course, i, lane.r, lane.v, lane.remaining, *given)


def _put_waves(walls, course, live, is_guess):
    """Compute the waves of the angles of all lanes."""
    for i in range(index(live)):
        aim.put_waves(walls, course, i, is_guess)


@outlined
def _mark_open(lanes, live):
    """Return the number of lanes without a proven hit, which are in `lanes.order`."""
    for i in range(index(live)):
        lanes.marked[i] = aim.is_open(lanes.course, i, lanes.lane(i).remaining)
    return marked_lanes(lanes, live)


@outlined
def _stride_open(walls, gravity, lanes, some):
    """Prove hits by series, or make the first safe step, of the first `some` lanes of `lanes.order`.

    Side by side in tables of their own: one lane alone takes as long as a vector of them, which the last lane fills.
    """
    course, starts = lanes.course, unwritten((Open.COUNT, STRIDE), np.float64)
    beside, count = unwritten((aim.rows(walls), STRIDE), np.float64), whole_eights(some)
    for k in range(count):
        i, one = index(lanes.order[index(min(k, some - 1))]), Open(starts, k)
        lane = lanes.lane(i)
        for row in aim.open_rows(walls):
            beside[row, k] = course[row, i]
        beside[strides.TIME, k], beside[strides.MET, k] = 0.0, -1.0
        one.r, one.v, one.remaining = lane.r, lane.v, lane.remaining
    if aim.has_series(walls):
        for k in range(count):
            one = Open(starts, k)
            aim.start_series(walls, gravity, beside, k, one.r, one.v, one.remaining)
        for k in range(count):
            one = Open(starts, k)
            aim.prove(walls, gravity, beside, k, one.r, one.v, one.remaining, True)
    for k in range(count):
        one = Open(starts, k)
        strides.stride(walls, gravity, beside, k, one.r, one.v, one.remaining, True)
    # A contact takes angles and waves from its course, where a proof has left the ones of its hit.
    for k in range(count):
        aim.put_angles(walls, beside, k, Open(starts, k).remaining - beside[strides.TIME, k])
    _put_waves(walls, beside, count, False)
    for k in range(index(some)):
        i = index(lanes.order[k])
        copy_lane(beside, k, course, i, strides.FOUND)
        aim.copy_waves(walls, beside, k, course, i)


def _go_by_steps(walls, gravity, lanes, live):
    """Find the first hit of every lane by safe steps."""
    course = lanes.course
    for i in range(index(live)):
        lane = lanes.lane(i)
        flights.begin(walls.at(lane.remaining), gravity, course, 0, i, lane.r, lane.v, aims=True)
    some = live
    if walls.aim(gravity):
        tries, some = _aim(walls, gravity, lanes, live)
        if gravity is not None:
            _go_on_beside(walls, gravity, lanes, some, tries, SAFE_STEPS + MORE_STEPS)
            return
        _try_on(walls, gravity, lanes, some, tries)
    # The few lanes that need more steps take them in the same pass: a flight in two parts would look like a short one.
    if walls.are_looked_at():
        some, left = _look_on(walls, gravity, lanes, live)
        _go_on_beside(walls, gravity, lanes, some, 0, left)
        return
    # Lanes that do not step together are marked if no guess has found their hit.
    together = _together(gravity, walls)
    for _step in range(together):
        for i in range(index(live)):
            _step_on(walls, gravity, lanes, i)
    if together > 0:
        some = _mark(walls, gravity, lanes, live)
    for k in range(some):
        _go_on(walls, gravity, lanes, lanes.order[k])


def _look_on(walls, gravity, lanes, live):
    """Make looks of all lanes while many need them; return (the number of lanes that need more, the looks left)."""
    left, some = SAFE_STEPS + MORE_STEPS, live
    if not all(wall.looked_at for wall in walls.each):
        # Many flights meet another wall before they come near to one that needs looks.
        some = _mark(walls, gravity, lanes, live)
    while left > 0 and _LOOK * some >= live:
        # If all lanes need looks, a single one does not suffice.
        looks = min(SAFE_STEPS if some == live else 1, left)
        for _look in range(looks):
            for i in range(index(live)):
                _step_on(walls, gravity, lanes, i)
        left, some = left - looks, _mark(walls, gravity, lanes, live)
    return some, left


def _together(gravity, walls):
    """Return the number of safe steps of all lanes together, before the lanes that need more take them one by one."""
    if gravity is None and walls.are_polynomial():
        return 0 if walls.aim(gravity) else POLYNOMIAL_STEPS
    return SAFE_STEPS


def _aim(walls, gravity, lanes, live):
    """Guess the hits of all lanes; return (the tries left, the number of lanes that need them).

    Each part has its own loop: the chain of operations of one lane is longer than the window of a processor.
    """
    course, tries, some = lanes.course, AIMED - 1, live
    for i in range(index(live)):
        flights.turn(walls, gravity, course, 0, i)
    for i in range(index(live)):
        flights.aim(walls, gravity, course, 0, i)
    while tries > 0 and _MANY * some >= live:
        for i in range(index(live)):
            flights.nearer(walls, gravity, course, 0, i)
        for i in range(index(live)):
            flights.aimed(walls, gravity, course, 0, i, False)
        tries, some = tries - 1, _mark(walls, gravity, lanes, live)
        # Most guesses lead to a hit, in this frame or after it: their lanes are done.
        if _MANY * some >= live:
            for i in range(index(live)):
                flights.leave_free(walls, gravity, course, 0, i, lanes.lane(i).remaining)
            some = _mark(walls, gravity, lanes, live)
    return tries, some


def _try_on(walls, gravity, lanes, some, tries):
    """Make the last tries of the first `some` lanes of `lanes.order`; other lanes do not change their number."""
    course = lanes.course
    for k in range(some):
        lane = index(lanes.order[k])
        flights.leave_free(walls, gravity, course, 0, lane, lanes.lane(lane).remaining)
        for left in range(tries, -1, -1):
            if not _needs_more(walls, gravity, lanes, lane):
                break
            flights.nearer(walls, gravity, course, 0, lane)
            flights.aimed(walls, gravity, course, 0, lane, left == 0)


@outlined
def _go_on_beside(walls, gravity, lanes, some, tries, most):
    """Make the last tries and at most `most` safe steps of the first `some` lanes of `lanes.order`, side by side.

    A safe step of one lane takes as long as of eight: one by one they were half of the time of all falls. Straight
    flights have had their tries before.
    """
    course, rows = lanes.course, len(walls.each) * flights.COURSE
    starts, beside = unwritten((Open.COUNT, STRIDE), np.float64), unwritten((rows, STRIDE), np.float64)
    count = whole_eights(some)
    for k in range(count):
        i, one = index(lanes.order[index(min(k, some - 1))]), Open(starts, k)
        lane = lanes.lane(i)
        copy_lane(course, i, beside, k, rows)
        one.r, one.v, one.remaining = lane.r, lane.v, lane.remaining
    if gravity is not None and walls.aim(gravity):
        _try_on_beside(walls, gravity, starts, beside, count, tries)
    _step_beside(walls, gravity, starts, beside, count, most)
    for k in range(index(some)):
        copy_lane(beside, k, course, index(lanes.order[k]), rows)


def _try_on_beside(walls, gravity, starts, beside, count, tries):
    """Make the last tries of lanes that fall, from their starts, and the first safe steps of the others."""
    for k in range(count):
        flights.leave_free(walls, gravity, beside, 0, k, Open(starts, k).remaining)
    for left in range(tries, -1, -1):
        for k in range(count):
            flights.nearer(walls, gravity, beside, 0, k)
        for k in range(count):
            flights.aimed(walls, gravity, beside, 0, k, left == 0)
    for k in range(count):
        one = Open(starts, k)
        flights.step_off(walls, gravity, beside, 0, k, one.r, one.v)


def _step_beside(walls, gravity, starts, beside, count, most):
    """Make at most `most` safe steps of `count` lanes, from their starts, until none needs more."""
    for _step in range(most):
        more = 0
        for k in range(count):
            one = Open(starts, k)
            hit = flights.end(walls.at(one.remaining), gravity, beside, 0, k, (one.r, one.v), stops=True)
            more += select((hit.wall < 0.0) & (hit.time < one.remaining), 1, 0)
        if more == 0:
            break
        for k in range(count):
            one = Open(starts, k)
            flights.step(walls.at(one.remaining), gravity, beside, 0, k, one.r, one.v)


def _go_on(walls, gravity, lanes, i):
    """Make more safe steps of a lane while they may find a hit in this frame."""
    for _step in range(MORE_STEPS):
        if not _needs_more(walls, gravity, lanes, i):
            break
        _step_on(walls, gravity, lanes, i)


@outlined
def _mark(walls, gravity, lanes, live):
    """Return the number of lanes that need more safe steps, which are in `lanes.order`."""
    for i in range(index(live)):
        lanes.marked[i] = _needs_more(walls, gravity, lanes, i)
    return marked_lanes(lanes, live)


def _step_on(walls, gravity, lanes, i):
    """Make one safe step of a lane."""
    lane = lanes.lane(i)
    flights.step(walls.at(lane.remaining), gravity, lanes.course, 0, i, lane.r, lane.v)


def _needs_more(walls, gravity, lanes, i):
    """Whether more safe steps may find a hit in this frame."""
    lane = lanes.lane(i)
    hit = flights.end(walls.at(lane.remaining), gravity, lanes.course, 0, i, (lane.r, lane.v), stops=True)
    return (hit.wall < 0.0) & (hit.time < lane.remaining)


def _flight(method, walls, gravity, lanes, i, hit):
    """Fly a lane to its next contact, `hit` if the method lands on walls, or to the end of the frame."""
    lane = lanes.given(method, i)
    if method.lands:
        if walls.inset is not None:
            hit = at_the_end(walls, gravity, lane.v, lane.remaining, hit)
        end = method.land(walls, gravity, lane, cut(lanes.period, gravity, (lane.r, lane.v), lane.remaining, hit))
        if walls.inset is not None:
            end = end._replace(r=inside_of(walls.at(end.remaining), end.wall, end.r))
    else:
        end = cut_steps(lanes.period, method, walls, gravity, lane, method.flight(walls, gravity, lane, hit))
    if method.asks_flown:
        lanes.flown[i] = lane.remaining - end.remaining
    lanes.lane(i).put_end(end)
    lanes.wall[i] = end.wall
