"""The log of impacts: each one that a kernel counts is a row, in arrays that another thread writes to a file.

And their number on each wall. Where a run has none of these there is None in its place, and nothing of it is compiled.
"""

from typing import Any, NamedTuple

import numpy as np

from ..contact import laws as wall_laws
from ..contact.reflection import relative, wall_velocity
from ..kernel.gravity import Nothing
from ..kernel.jit import Array, by_type, by_type_outlined, index, inlined
from ..kernel.vector import ZERO, Vec, column, dot, put
from ..methods import contract as methods
from ..surfaces import fold as walls
from ..surfaces.moving import at
from .arrays import HITS, LANES, LEFT, R, V

# Rows of what a lane was before a contact: position, velocity, time left, impacts, then the wall and its impulse.
_R, _V, _LEFT, _HITS, _WALL, _IMPULSE, ROWS = 0, 3, 6, 7, 8, 9, 10
# What a kernel leaves that ends with a full log: particle, stop, draws, live lanes, passes.
GOING = 5


class Log(NamedTuple):
    """Arrays of one entry a row, `filled` so far, and what says which rows there are."""

    time: Array  # (rows,) [s]
    particle: Array  # (rows,) int32
    wall: Array  # (rows,) int32, its number in the chain
    position: Array  # (rows, 3) [m], in the cell where the scene repeats
    velocity_before: Array  # (rows, 3) [m/s]
    velocity_after: Array  # (rows, 3)
    impulse: Array  # (rows,) [N s], along the wall's normal
    slip: Any  # (rows, 3) [m/s] tangential velocity relative to the wall, before; None without friction
    image: Any  # (rows, 3) int32, how many cells away that is; None where the scene does not repeat
    filled: Array  # (1,) int64
    going: Array  # (GOING,) int64
    order: Array  # int64, the lanes of a pass that have a row
    chosen: Any  # (N,) bool, the particles that have rows; None: all
    begin: float  # of the frame [s]
    end: float


class Counts(NamedTuple):
    """Impacts on each wall of the chain that one thread has computed."""

    impacts: Array  # (walls,) int64


class Struck(NamedTuple):
    """An impact: where, with the velocities before and after, on which wall, and the impulse per mass."""

    r: Vec
    before: Vec
    after: Vec
    wall: float
    left: float  # of the frame [s]
    impulse: float


# --- A log that is full ----------------------------------------------------------------------------------


@by_type
def is_full(log):
    """Whether a pass may have more rows than there is room for."""
    return False


is_full.register(Log, lambda log: log.filled[0] + LANES > log.time.size)


@by_type
def keep_going(log, following, stop, drawn, live, passes):
    """Keep where a kernel is that ends since its log is full."""


@keep_going.register(Log)
def _(log, following, stop, drawn, live, passes):
    going = log.going
    going[0], going[1], going[2], going[3], going[4] = following, stop, drawn, live, passes


@by_type
def gone_on(log):
    """Where a kernel goes on: (particle, stop, draws, live lanes, passes)."""
    return 0, 0, 0, 0, 0


@gone_on.register(Log)
def _(log):
    going = log.going
    following, stop, drawn, live, passes = going[0], going[1], going[2], going[3], going[4]
    for k in range(GOING):
        going[k] = 0
    return following, stop, drawn, live, passes


# --- Of the lanes of a pass ------------------------------------------------------------------------------


@by_type
def keep_before(log, lanes, live):
    """Keep what every lane is before its contact."""


@keep_before.register(Log)
def _(log, lanes, live):
    rows, before = lanes.rows, lanes.before
    for i in range(index(live)):
        put(before, _R, i, column(rows, R, i))
        put(before, _V, i, column(rows, V, i))
        before[_LEFT, i], before[_HITS, i] = rows[LEFT, i], rows[HITS, i]
        before[_WALL, i], before[_IMPULSE, i] = lanes.wall[i], 0.0


@keep_before.register(Counts)
def _(log, lanes, live):
    for i in range(index(live)):
        lanes.before[_HITS, i], lanes.before[_WALL, i] = lanes.rows[HITS, i], lanes.wall[i]


@by_type
def note(log, lanes, i, impulse):
    """Note the impulse per mass that the wall of a lane gives."""


@note.register(Log)
def _(log, lanes, i, impulse):
    lanes.before[_IMPULSE, i] += impulse


@by_type_outlined
def add_rows(log, method, chain, state, lanes, live):
    """A row for each lane with one more impact than before its contact, or a count."""


@add_rows.register(Log)
def _(log, method, chain, state, lanes, live):
    rows, before, order, n = lanes.rows, lanes.before, log.order, index(0)
    for i in range(index(live)):
        order[n] = i
        n += index((rows[HITS, i] > before[_HITS, i]) & _is_chosen(log.chosen, lanes.particle[i]))
    for k in range(n):
        i = index(order[k])
        struck = Struck(
            column(before, _R, i), column(before, _V, i), column(rows, V, i), before[_WALL, i], before[_LEFT, i],
            before[_IMPULSE, i],
        )  # fmt: skip
        _add(log, method, chain, state, lanes.particle[i], struck)


@add_rows.register(Counts)
def _(log, method, chain, state, lanes, live):
    before = lanes.before
    for i in range(index(live)):
        # A lane without an impact may be at no wall.
        log.impacts[index(int(max(before[_WALL, i], 0.0)))] += np.int64(lanes.rows[HITS, i] - before[_HITS, i])


@by_type
def _is_chosen(chosen, particle):
    return chosen[index(particle)]


_is_chosen.register(Nothing, lambda chosen, particle: True)


# --- Of one particle -------------------------------------------------------------------------------------


@by_type_outlined
def add_row(log, method, chain, state, particle, struck):
    """A row for an impact of a particle, or a count."""


@add_row.register(Log)
def _(log, method, chain, state, particle, struck):
    if _is_chosen(log.chosen, particle):
        _add(log, method, chain, state, particle, struck)


@add_row.register(Counts)
def _(log, method, chain, state, particle, struck):
    log.impacts[index(int(struck.wall))] += 1


@by_type_outlined
def add_escape(log, state, particle, struck):
    """A row, without an impulse, for a particle that passes an opening."""


@add_escape.register(Log)
def _(log, state, particle, struck):
    if _is_chosen(log.chosen, particle):
        _no_slip(log.slip, _add_struck(log, state, particle, struck))


@inlined
def _add(log, method, chain, state, particle, struck):
    _add_slip(log.slip, _add_struck(log, state, particle, struck), method, chain, struck)


@inlined
def _add_struck(log, state, particle, struck):
    """What every row has; its number."""
    k, p = index(log.filled[0]), index(particle)
    log.filled[0] += 1
    log.time[k] = max(log.begin, log.end - struck.left)
    log.particle[k], log.wall[k] = np.int32(particle), np.int32(struck.wall)
    _put(log.position, k, struck.r)
    _put(log.velocity_before, k, struck.before)
    _put(log.velocity_after, k, struck.after)
    log.impulse[k] = struck.impulse * state.mass[p]
    _add_image(log.image, k, state.image, p)
    return k


@inlined
def _put(rows, k, vector):
    rows[k, 0], rows[k, 1], rows[k, 2] = vector.x, vector.y, vector.z


@by_type
def _add_slip(slip, k, method, chain, struck):
    now = at(chain, struck.left)
    u = wall_velocity(wall_laws.moving(methods.laws(method)), now, struck.wall, struck.r)
    n, before = walls.unit_normal(now, struck.wall, struck.r), relative(u, struck.before)
    _put(slip, k, before - dot(before, n) * n)


_add_slip.register(Nothing, lambda slip, k, method, chain, struck: None)


@by_type
def _no_slip(slip, k):
    _put(slip, k, ZERO)


_no_slip.register(Nothing, lambda slip, k: None)


@by_type
def _add_image(rows, k, image, p):
    rows[k, 0], rows[k, 1], rows[k, 2] = np.int32(image[0, p]), np.int32(image[1, p]), np.int32(image[2, p])


_add_image.register(Nothing, lambda rows, k, image, p: None)
