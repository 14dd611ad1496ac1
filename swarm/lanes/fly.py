"""A flight of every lane of a block: to its next contact, or to the end of the frame."""

from ..kernel.gravity import Gravity, Nothing
from ..kernel.jit import by_type, index, inlined
from ..kernel.vector import column, put
from ..methods import contract as methods
from ..surfaces import flights, safe, strides
from ..surfaces.course import MORE_STEPS, SAFE_STEPS
from ..surfaces.fold import Chain, Field, count_in_fields, others
from ..surfaces.moving import Marched, Strided, at
from ..surfaces.period import cut
from .arrays import LEFT, R, V, lane_of
from .marks import marked_lanes
from .seek import hit_of_lane, keep_hit, seek

# Safe steps to walls in any motion that all lanes take in a pass after the first.
_STRIDES = 3


@by_type
def go(met, gravity, method, chain, lanes, live):
    """Every lane to its next contact, or to the end of the frame. `met` are the walls whose first hits are found."""
    _fly(gravity, method, chain, lanes, live)


@go.register(Nothing)
def _(met, gravity, method, chain, lanes, live):
    for i in range(index(live)):
        _flight(method, chain, gravity, lanes, i, flights.NEVER)


@go.register(Field)
def _(met, gravity, method, chain, lanes, live):
    _meet_others(others(chain), gravity, count_in_fields(chain), lanes, live)
    seek(chain, 0.0, gravity, lanes, live)
    for i in range(index(live)):
        _flight(method, chain, gravity, lanes, i, hit_of_lane(lanes, i))


@by_type
def _meet_others(chain, gravity, before, lanes, live):
    """The first hits with the walls that are in no field; these have so many walls before them."""
    for i in range(index(live)):
        keep_hit(lanes, i, flights.NEVER, 0.0)


@_meet_others.register(Chain)
def _(chain, gravity, before, lanes, live):
    _meet_any(gravity, chain, before, lanes, live)


@by_type
def _meet_any(gravity, chain, before, lanes, live):
    """The same where there are some."""


@_meet_any.register(Nothing)
def _(gravity, chain, before, lanes, live):
    _meet_straight(flights.in_steps(chain), chain, before, lanes, live)


@_meet_any.register(Gravity)
def _(gravity, chain, before, lanes, live):
    _meet_by_steps(gravity, chain, before, lanes, live)


@by_type
def _meet_straight(steps, chain, before, lanes, live):
    """The same without gravity, where a wall is met by steps or where none is."""
    _meet_by_steps(None, chain, before, lanes, live)


@_meet_straight.register(Nothing)
def _(steps, chain, before, lanes, live):
    for i in range(index(live)):
        hit = flights.first_hit(chain, None, column(lanes.rows, R, i), column(lanes.rows, V, i))
        keep_hit(lanes, i, hit, before)


@inlined
def _meet_by_steps(gravity, chain, before, lanes, live):
    _go_by_steps(chain, gravity, lanes, live)
    for i in range(index(live)):
        keep_hit(lanes, i, flights.end(chain, lanes.course, 0, i), before)


@go.register(Marched)
def _(met, gravity, method, chain, lanes, live):
    rows = lanes.rows
    for i in range(index(live)):
        hit = safe.first_hit(chain, gravity, column(rows, R, i), column(rows, V, i), rows[LEFT, i])
        _flight(method, chain, gravity, lanes, i, hit)


@go.register(Strided)
def _(met, gravity, method, chain, lanes, live):
    rows, course = lanes.rows, lanes.course
    for i in range(index(live)):
        strides.begin(chain, gravity, course, i, column(rows, R, i), column(rows, V, i), rows[LEFT, i])
    for i in range(index(live)):
        strides.stride(chain, gravity, course, i, column(rows, R, i), column(rows, V, i), rows[LEFT, i], True)
    for _stride in range(_STRIDES):
        for i in range(index(live)):
            strides.stride(chain, gravity, course, i, column(rows, R, i), column(rows, V, i), rows[LEFT, i], False)
    for i in range(index(live)):
        _flight(method, chain, gravity, lanes, i, strides.end(course, i))


@by_type
def _fly(gravity, method, chain, lanes, live):
    """Every lane to its next contact, or to the end of the frame.

    A shorter loop has more lanes under way in a processor, a longer one writes less. Measured in a sphere, nanoseconds
    an impact: first hit, flight and contact in one loop 7.2, a loop for each 5.2; now that there is less to do, flight
    and contact in one loop 3.6, first hit and flight 3.3 (an ellipsoid 4.4, 3.9). The safe steps of a fall in one loop
    110, a loop for each 35. (With |v|^2 and 1/|v|^2 kept a lane no less, and their round-off is that of every flight of
    a particle: the angular momentum in a sphere drifted five times as fast.)
    """


@_fly.register(Nothing)
def _(gravity, method, chain, lanes, live):
    _fly_straight(flights.in_steps(chain), method, chain, lanes, live)


@by_type
def _fly_straight(steps, method, chain, lanes, live):
    """The same without gravity, where a wall is met by steps or where none is."""
    _fly_by_steps(None, method, chain, lanes, live)


@_fly_straight.register(Nothing)
def _(steps, method, chain, lanes, live):
    rows, gravity = lanes.rows, None
    for i in range(index(live)):
        hit = flights.first_hit(at(chain, rows[LEFT, i]), gravity, column(rows, R, i), column(rows, V, i))
        _flight(method, chain, gravity, lanes, i, hit)


@_fly.register(Gravity)
def _(gravity, method, chain, lanes, live):
    _fly_by_steps(gravity, method, chain, lanes, live)


@inlined
def _fly_by_steps(gravity, method, chain, lanes, live):
    _go_by_steps(chain, gravity, lanes, live)
    for i in range(index(live)):
        hit = flights.end(at(chain, lanes.rows[LEFT, i]), lanes.course, 0, i)
        _flight(method, chain, gravity, lanes, i, hit)


@inlined
def _go_by_steps(chain, gravity, lanes, live):
    """The course of every lane to its first hit, by safe steps."""
    rows, course, marked = lanes.rows, lanes.course, lanes.marked
    for i in range(index(live)):
        now = at(chain, rows[LEFT, i])
        flights.begin(now, gravity, course, 0, i, column(rows, R, i), column(rows, V, i))
    for _step in range(SAFE_STEPS):
        for i in range(index(live)):
            now = at(chain, rows[LEFT, i])
            flights.step(now, gravity, course, 0, i, column(rows, R, i), column(rows, V, i))
    # The few that need more, one by one: a flight in two parts would look like a short one.
    for i in range(index(live)):
        marked[i] = _needs_more(chain, lanes, i)
    for k in range(marked_lanes(lanes, live)):
        lane = lanes.order[k]
        for _step in range(MORE_STEPS):
            now = at(chain, rows[LEFT, lane])
            flights.step(now, gravity, course, 0, lane, column(rows, R, lane), column(rows, V, lane))
            if not _needs_more(chain, lanes, lane):
                break


@inlined
def _needs_more(chain, lanes, i):
    """Whether more safe steps may find a hit in this frame."""
    hit = flights.end(at(chain, lanes.rows[LEFT, i]), lanes.course, 0, i)
    return (hit.wall < 0.0) & (hit.time < lanes.rows[LEFT, i])


@inlined
def _flight(method, chain, gravity, lanes, i, hit):
    """A lane to its next contact, `hit` if the method lands on walls, or to the end of the frame."""
    lane = lane_of(method, lanes.rows, i)
    if methods.lands(method):
        end = methods.land(method, chain, gravity, lane, cut(lanes.period, gravity, (lane.r, lane.v), lane.left, hit))
    else:
        end = methods.flight(method, chain, gravity, lane)
    put_end(lanes, i, end)
    lanes.wall[i] = end.wall


@inlined
def put_end(lanes, i, end):
    """Where a lane is at the end of a flight or a contact, and how much of its frame is left."""
    put(lanes.rows, R, i, end.r)
    put(lanes.rows, V, i, end.v)
    lanes.rows[LEFT, i] = end.left
