"""Particles to one time, a block of them at once, in lanes.

One pass does one flight and one contact for every live lane, in loops without branches, which LLVM vectorises. Lanes
that reached the frame time retire, and the next particle, or the last live lane, takes their slot. The result does not
depend on which lane or block a particle is in.
"""

from typing import NamedTuple

import numpy as np

from ..contact import laws as wall_laws
from ..contact.events import FLYING
from ..contact.heat import Draw, exchange
from ..kernel.gravity import Nothing, potential
from ..kernel.jit import by_type, by_type_outlined, index, inlined, kernel, outlined, select
from ..kernel.vector import column, put, square
from ..methods import contract as methods
from ..particles import Contacts
from ..status import Status
from ..surfaces import fold as walls
from ..surfaces.moving import Carried, at
from . import log as impact_log
from .arrays import (
    HITS,
    LANES,
    LEFT,
    LOOK,
    LOOKED,
    OWN,
    R,
    V,
    count_sweeps,
    following_particle,
    goes_on_by,
    keep_failure,
    lane_of,
    leave,
    load,
    move,
    retire,
    with_distances,
)
from .arrays import (
    heat as book_heat,
)
from .escape import let_out_lanes
from .fly import go, put_end
from .marks import marked_lanes
from .picked import of_lane, pick, picks
from .solve import solution, solve
from .wrap import return_lanes

# Impacts of one particle in one frame after which it is given up: seconds, not hours, in a cusp.
MOST_HITS = 1e8
# Passes of a call of `advance_block` that is never halted.
NEVER = 2**63 - 1


class Hard(NamedTuple):
    """With it a kernel can do hard contacts: half of what there is to compile, and seldom met in a smooth cavity."""

    most_hits: float


@kernel
def advance_block(method, chain, gravity, hard, share, lanes):
    """Advance what a thread draws of a frame: (status, particle, drawn), DONE or the first particle that failed.

    `drawn` is how many draws that were; `lanes` are any. After `share.halt[0]` passes, which another thread may change
    at any time, it ends before the next: (INTERRUPTED, live lanes, drawn), and `lanes.left_behind` has what these held,
    which the next call takes as `share.halted`. Particles that are done are left alone, and those that arrive become
    it: where `hard` is None, the first hard contact ends it with HARD_CONTACT, to go on from there with what can do it.
    LOG_FULL asks for a call with an empty log and the same lanes, which goes on.
    """
    lanes, state, picked = with_distances(lanes), share.state, picks(chain)
    following, stop, drawn, live, passes = impact_log.gone_on(share.log)
    while live < LANES:
        following, stop, drawn = following_particle(share, FLYING, following, stop, drawn)
        if following == stop:
            break
        load(method, chain, lanes, index(live), share, following)
        lanes.rows[LOOKED, live] = -1.0
        following += 1
        live += 1
    while live > 0:
        status = _halts(share, lanes, following, stop, drawn, live, passes)
        if status != Status.DONE.value:
            return status, live, drawn
        passes += 1
        some_arrived, some_hard = _pass(method, chain, gravity, share, lanes, picked, live)
        if some_hard or passes % LOOK == 0:
            status, lane = _rare(hard, method, chain, gravity, state, lanes, live, some_hard)
            if status != Status.DONE.value:
                keep_failure(state.multipliers, lanes, lane)
                return status, lanes.particle[lane], drawn
        count_sweeps(state.multipliers, lanes, live)
        if not (some_arrived or some_hard):
            continue
        # From the last, so that every lane behind one that has arrived is still under way, and may take its place.
        for k in range(marked_lanes(lanes, live) - 1, -1, -1):
            lane = index(lanes.order[k])
            retire(method, chain, lanes, lane, share)
            following, stop, drawn = following_particle(share, FLYING, following, stop, drawn)
            if following < stop:
                load(method, chain, lanes, lane, share, following)
                following += 1
            else:
                live -= 1
                move(chain, lanes, live, lane)
    return Status.DONE.value, 0, drawn


@inlined
def _halts(share, lanes, following, stop, drawn, live, passes):
    """Whether the call ends before the next pass."""
    if passes >= share.halt[0]:
        leave(lanes, live)
        return Status.INTERRUPTED.value
    if impact_log.is_full(share.log):
        impact_log.keep_going(share.log, following, stop, drawn, live, passes)
        return Status.LOG_FULL.value
    return Status.DONE.value


@outlined
def _rare(hard, method, chain, gravity, state, lanes, live, some_hard):
    """What a pass rarely needs: (worst status, its lane)."""
    if not some_hard:
        return _look(method, chain, state, lanes, live)
    return _hard_passes(hard, method, chain, gravity, lanes, live)


@outlined
def _look(method, chain, state, lanes, live):
    """Whether a particle meets its walls without end, or has not gone on since it was looked at: (status, its lane).

    The narrower a wedge is, the more impacts have no time between them: there is an end to them, and they are counted.
    """
    rows = lanes.rows
    for i in range(live):
        status, p, left = Status.DONE.value, float(lanes.particle[i]), rows[LEFT, i]
        still = goes_on_by(method, column(rows, V, i), left) >= rows[LOOKED + 1, i] - left
        if methods.holds(method) and rows[HITS, i] > _most_hits(chain):
            status = Status.STALLED.value
        elif rows[LOOKED, i] == p and still and rows[LOOKED + 2, i] == rows[HITS, i]:
            status = Status.TIMELESS.value
        if status != Status.DONE.value:
            put(state.position, 0, lanes.particle[i], column(rows, R, i))
            _keep_left(state.contacts, lanes, i)
            return status, i
        rows[LOOKED, i], rows[LOOKED + 1, i], rows[LOOKED + 2, i] = p, left, rows[HITS, i]
    return Status.DONE.value, 0


@by_type
def _most_hits(chain):
    return MOST_HITS


# Walls that close on a particle hit it without end; where hits are found by safe steps, these are seconds too.
_most_hits.register(Carried, lambda chain: 0.1 * MOST_HITS)


@by_type
def _keep_left(contacts, lanes, i):
    """Keep when a particle is given up."""


@_keep_left.register(Contacts)
def _(contacts, lanes, i):
    contacts.left[lanes.particle[i]] = lanes.rows[LEFT, i]


@inlined
def _pass(method, chain, gravity, share, lanes, picked, live):
    """A flight and a contact of every lane: (whether one reached the end of the frame, whether one is hard)."""
    go(methods.landed_on(method, chain), gravity, method, chain, lanes, live)
    return_lanes(lanes.period, share.state, lanes, live)
    let_out_lanes(share.state.openings, method, chain, share, lanes, live)
    unknown = methods.solves(method)
    solve(unknown, method, chain, gravity, share.state.multipliers, lanes, live)
    impact_log.keep_before(share.log, lanes, live)
    impact_log.keep_before(share.counts, lanes, live)
    _exchange_heat(methods.thermal(method), method, chain, gravity, share, lanes, live)
    pick(chain, 0.0, lanes, picked, live)
    some_arrived, some_hard = False, False
    for i in range(index(live)):
        lane, found = lane_of(method, lanes.rows, i), solution(unknown, method, lanes, i)
        here = methods.walls_of(method, of_lane(chain, picked, i), lane.left)
        contact = methods.contact(method, here, gravity, lane, lanes.wall[i], found)
        arrived, hard = _end(method, chain, lanes, i, contact)
        impact_log.note(share.log, lanes, i, contact.impulse)
        some_arrived, some_hard = some_arrived | arrived, some_hard | hard
    impact_log.add_rows(share.log, method, chain, share.state, lanes, live)
    impact_log.add_rows(share.counts, method, chain, share.state, lanes, live)
    return some_arrived, some_hard


@by_type
def _exchange_heat(thermal, method, chain, gravity, share, lanes, live):
    """The impacts on thermal walls that accommodate their particles."""


@_exchange_heat.register(wall_laws.Given)
def _(thermal, method, chain, gravity, share, lanes, live):
    rows, state = lanes.rows, share.state
    for i in range(index(live)):
        wall, p = lanes.wall[i], index(lanes.particle[i])
        if wall >= 0.0:
            r, v = column(rows, R, i), column(rows, V, i)
            draw = Draw(share.seed, share.first + lanes.particle[i], state.impacts[p] + np.int64(rows[HITS, i]))
            now, laws = at(chain, rows[LEFT, i]), methods.laws(method)
            left = exchange(laws, now, wall, (r, v), state.mass[p], draw)
            if left.happens:
                before, after = rows[OWN, i], square(left.v) + 2.0 * potential(gravity, r)
                book_heat(state, p, walls.row(chain, wall), before, after - left.work)
                add_work(chain, lanes.impulse, i, wall, 0.5 * left.work)
                put(rows, V, i, left.v)
                rows[OWN, i] = after
                rows[HITS, i] += 1.0
                lanes.impulse[walls.row(chain, wall), i] += left.impulse
                impact_log.note(share.log, lanes, i, left.impulse)
                # The contact is done, unless a wall at 0 K holds the particle.
                lanes.wall[i] = select(square(left.v) > 0.0, -1.0, wall)


@inlined
def _end(method, chain, lanes, i, contact):
    """What the contact made of a lane: (whether it reached the end of the frame, whether it is hard)."""
    put_end(lanes, i, contact)
    _count(method, lanes, i, contact)
    _add_impulse(chain, lanes.impulse, i, contact.wall, contact.impulse)
    add_work(chain, lanes.impulse, i, contact.wall, contact.work)
    lanes.wall[i] = contact.wall
    hard = (contact.wall <= methods.HARD) & (not methods.holds(method))
    return contact.lasts | (not (contact.left > 0.0)), hard


@inlined
def _count(method, lanes, i, contact):
    """What a contact counts, whether the lane has arrived, and the energy where contacts may lose some."""
    rows = lanes.rows
    rows[HITS, i] += contact.hits
    if methods.dissipates(method):
        rows[OWN, i] = contact.twice_energy
    lanes.marked[i] = contact.lasts | (not (contact.left > 0.0))


@by_type
def _add_impulse(chain, impulse, lane, wall, given):
    """impulse[wall, lane] += given, without a branch; a loop over rows here would not vectorise."""


@_add_impulse.register(walls.Chain)
def _(chain, impulse, lane, wall, given):
    _add_of(chain.rest, chain, impulse, lane, wall, given)


@_add_impulse.register(walls.Field)
def _(chain, impulse, lane, wall, given):
    _add_to(chain, impulse, 0, lane, wall, given)


@_add_impulse.register(Carried)
def _(chain, impulse, lane, wall, given):
    _add_of(chain.walls.rest, chain.walls, impulse, lane, wall, given)


@by_type
def add_work(chain, impulse, lane, wall, given):
    """The work of walls that move is in the rows after those of the impulses."""


@add_work.register(Carried)
def _(chain, impulse, lane, wall, given):
    _add_to(chain.walls, impulse, walls.length(chain), lane, wall, given)


@by_type
def _add_of(rest, chain, impulse, lane, wall, given):
    """The same, by how many walls there are."""


@_add_of.register(Nothing)
def _(rest, chain, impulse, lane, wall, given):
    # One wall: what is given is 0, or it is given by that.
    impulse[0, lane] += given


@_add_of.register(walls.Chain)
@_add_of.register(walls.Field)
def _(rest, chain, impulse, lane, wall, given):
    _add_to(chain, impulse, 0, lane, wall, given)


@by_type
def _add_to(chain, impulse, row, lane, wall, given):
    """The same for the walls from `row` on."""


@_add_to.register(walls.Chain)
def _(chain, impulse, row, lane, wall, given):
    impulse[row, lane] += select(wall == 0.0, given, 0.0)
    _add_to(chain.rest, impulse, row + 1, lane, wall - 1.0, given)


@_add_to.register(walls.Field)
def _(chain, impulse, row, lane, wall, given):
    count = walls.count(chain.first)
    impulse[row, lane] += select((wall >= 0.0) & (wall < count), given, 0.0)
    _add_to(chain.rest, impulse, row + 1, lane, select(wall < count, -1.0, wall - count), given)


@_add_to.register(walls.Listed)
def _(chain, impulse, row, lane, wall, given):
    count = walls.count(chain.first)
    here = (wall >= 0.0) & (wall < count)
    impulse[index(row + int(select(here, wall, 0.0))), lane] += select(here, given, 0.0)
    _add_to(chain.rest, impulse, row + int(count), lane, select(wall < count, -1.0, wall - count), given)


@_add_to.register(Nothing)
def _(chain, impulse, row, lane, wall, given):
    pass


@by_type_outlined
def _hard_passes(hard, method, chain, gravity, lanes, live):
    """The hard lanes, one by one: (worst status, its lane)."""
    raise NotImplementedError


@_hard_passes.register(Nothing)
def _(hard, method, chain, gravity, lanes, live):
    return Status.HARD_CONTACT.value, 0


@_hard_passes.register(Hard)
def _(hard, method, chain, gravity, lanes, live):
    worst, where = 0, 0
    for i in range(live):
        if lanes.wall[i] <= methods.HARD:
            lane = lane_of(method, lanes.rows, i)
            contact, status = methods.hard_pass(method, chain, gravity, lane, methods.HARD - lanes.wall[i], lanes, i)
            put_end(lanes, i, contact)
            _count(method, lanes, i, contact)
            if lanes.rows[HITS, i] > hard.most_hits:
                status = Status.STALLED.value
            if status > worst:
                worst, where = status, i
    return worst, where
