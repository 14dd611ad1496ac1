"""Impacts in order of time: the next event of each particle is in a heap, and one thread takes the earliest one.

A particle far from every reacting wall is predicted again after its reach, or at its next impact on another wall. A
near particle has the time of its impact, which is valid until a reacting wall is struck. After a strike the near
particles are predicted again, and all particles only when a wall leaves its lease. So an impact costs some operations
of the heap, not a prediction for every particle.
"""

import math
from typing import Any, NamedTuple

from ...common.status import Status
from ...contact.absence import closeness, hit_wall, lets_through, through
from ...contact.laws import Laws
from ...contact.wall_impact import Arriving, book, impact_on_wall
from ...kernel.arrays import index
from ...kernel.gravity import accelerated, displacement, potential
from ...kernel.heap import Heap, build, change
from ...kernel.jit import Array, long_kernel, outlined, select
from ...kernel.vector import ZERO, column, put
from ...lanes.watching.crossings import Flown, ParticleMoment
from ...lanes.watching.log import Struck, is_full
from ...lanes.watching.watchers import Followed, Watchers
from ...state import absorb, is_gone
from ...surfaces.in_motion.moving import Marched
from ...surfaces.presence.rooms import inside_of, leads_on
from ...surfaces.time_of_impact import flights, safe
from .freedoms import ParticleFlight
from .strikes import all_stay, exit_at, first_hit, reach_of_all, strike, with_energy

# This stands for no reacting wall: no impact was found, so that the particle is predicted again.
NONE = -1.0
# This stands for no other wall: the particle waits at a wall, or is not born yet.
WAITS = -2.0
# Entries of a clock: the time in the frame, the time before the frame, the strikes of reacting walls in the run, and
# the events since the leases began.
NOW, BEFORE, STRIKES, TAKEN, CLOCK = 0, 1, 2, 3, 4
# The most impacts of one particle in one frame.
MOST_HITS = 10_000_000
# An impact in which no time has passed counts as this number of impacts: an inelastic collapse ends sooner, and the tip
# of a wedge never.
AT_ONCE = 1000


class SceneWalls(NamedTuple):
    """The walls of a scene: the other walls with their laws and their numbers in the scene, and the reacting walls."""

    given: Any  # the walls that do not react, or None
    laws: Laws
    owners: Array  # (given walls,)
    rows: Array  # (given walls,) their rows in the books of the scene
    reacting: Any
    pull: Any  # gravity, or None
    size: float = 1.0  # of the scene [m]
    seeding: Any = None  # `Seeding` where walls send particles off by a law
    openings: Any = None  # None, or each `Opened` of the given walls

    def each_laws(self) -> list[Laws]:
        """The laws of the given walls, and of each reacting wall with laws."""
        return [self.laws, *(wall.laws for wall in self.reacting if wall.laws is not None)]


class Queue(NamedTuple):
    """The particles between two impacts, and the next event of each: arrays with one column a particle."""

    position: Array  # (3, N) at `time`
    velocity: Array  # (3, N)
    mass: Array  # (N,)
    energy: Array  # (N,) per mass
    impulse: Array  # (2 walls, N), then the work of moving walls
    dissipated: Array  # (N,)
    impacts: Array  # (N,)
    time: Array  # (N,) of the frame [s]
    wait: Array  # (N,) from `time` until the next impact on a given wall [s]
    due: Array  # (N,) the time of this impact [s]
    wall: Array  # (N,) this wall, or -1 if a flight is free only until `due`
    struck: Array  # (N,) the reacting wall met at the key, or NONE
    near: Array  # (N,) bool, whether the key is valid only until a reacting wall is struck
    hits: Array  # (N,) the impacts in this frame
    listed: Array  # (N,) bool, whether the particle is in `close`
    close: Array  # (N,) the particles that are near, and some that were
    heap: Heap
    heat: Any = None  # (walls, N) energy that walls gave, or None
    crossed: Any = None  # `Crossed`, where there are counters
    watchers: Watchers = Watchers()
    image: Any = None
    absorbed_time: Any = None  # (N,) [s], where a wall may absorb particles
    absorbed_wall: Any = None  # (N,) the number of this wall, or -1
    escape_time: Any = None  # (N,) [s], where walls have openings
    starts: Any = None  # (N,) the time from which each particle flies [s], where some are born later or wait at a wall


class ReactionRule(NamedTuple):
    """How far events are taken: to the end of the frame [s since its start], within the most events of the call."""

    end: float
    halt: Array  # (1,) the most events of the call
    moment: float  # the end of the frame since the start of the run [s]


# --- Events of one particle ------------------------------------------------------------------------------


def _aim(scenery, queue, i, end):
    """Find when particle i meets a given wall."""
    walls, t, r, v = scenery.given, queue.time[i], column(queue.position, 0, i), column(queue.velocity, 0, i)
    if isinstance(walls, Marched):
        hit = safe.first_hit_moving(walls, scenery.pull, r, v, end - t)
    else:
        hit = flights.first_hit(walls.at(end - t), scenery.pull, r, v)
    queue.wait[i], queue.due[i], queue.wall[i] = hit.time, t + hit.time, hit.wall


def _waits(queue, i):
    """Whether particle i is not born yet, or waits at a wall: it stays where it is until `due`."""
    return False if queue.starts is None else queue.wall[i] == WAITS


def _set_out(scenery, queue, i, rule):
    """Set the times of particle i at the start of a frame; it flies from then, or from a later birth or release, on."""
    queue.time[i], queue.hits[i] = 0.0, 0
    if is_gone(queue, i):
        return
    if queue.starts is not None:
        later = queue.starts[i] - (rule.moment - rule.end)
        if later > 0.0:
            queue.wait[i], queue.due[i], queue.wall[i] = later, later, WAITS
            return
    _aim(scenery, queue, i, rule.end)


def _escape(queue, i, owner, rule, now):
    """Let particle i escape through an opening: it stays where it is, and has no next event."""
    r, v, time = column(queue.position, 0, i), column(queue.velocity, 0, i), rule.moment - (rule.end - now)
    queue.escape_time[i] = time
    if queue.watchers.counters is not None:
        queue.watchers.counters.settle(Followed(queue, queue.watchers.log), i, ParticleMoment(r, v, rule.end - now))
    queue.watchers.hit(None, Struck(i, owner, time, r, v, v, 0.0))


def _seen(scenery, queue, i, now, end):
    """Return the `ParticleFlight` of particle i at a time."""
    t, r, v = now - queue.time[i], column(queue.position, 0, i), column(queue.velocity, 0, i)
    pull, target = scenery.pull, select(queue.due[i] < end, queue.due[i], end)
    here = r + displacement(pull, v, t)
    return ParticleFlight(here, accelerated(pull, v, t), ZERO if pull is None else pull, now, target - now)


def _next(scenery, walls, queue, i, now, end, soon):
    """Return the time of the next event of particle i, or of its reach if it is far from all reacting walls."""
    if is_gone(queue, i):
        queue.near[i], queue.struck[i] = False, NONE
        return math.inf
    if _waits(queue, i):
        queue.near[i], queue.struck[i] = False, NONE
        return queue.due[i]
    flight = _seen(scenery, queue, i, now, end)
    target = now + flight.longest
    free = reach_of_all(scenery.reacting, walls, flight)
    queue.near[i], queue.struck[i] = False, NONE
    if not free < flight.longest:
        return target
    if free > soon:
        return now + free
    queue.near[i] = True
    hit = first_hit(scenery.reacting, scenery.pull, walls, flight)
    if not hit.time < flight.longest:
        return target
    queue.struck[i] = hit.wall
    return now + hit.time


def _fly(scenery, queue, i, t, way, end):
    """Move particle i to the time t, by a flight of the duration `way`."""
    r, v, pull = column(queue.position, 0, i), column(queue.velocity, 0, i), scenery.pull
    there = r + displacement(pull, v, way)
    queue.watchers.flown(pull, queue, i, Flown(r, v, way, end - queue.time[i], there, ZERO))
    put(queue.position, 0, i, there)
    put(queue.velocity, 0, i, accelerated(pull, v, way))
    queue.time[i] = t


@outlined
def _bounce(scenery, queue, i, wall, rule, now):
    """Carry out the impact of particle i on a given wall."""
    r, v, m, twice = column(queue.position, 0, i), column(queue.velocity, 0, i), queue.mass[i], 2.0 * queue.energy[i]
    walls = scenery.given.at(rule.end - now)
    if walls.inset is not None:
        r = inside_of(walls, wall, r)
        put(queue.position, 0, i, r)
    arriving, laws, random = Arriving(r, v, twice, m), scenery.laws, None
    if laws.send_off:
        random = scenery.seeding.of_impact(i, queue.impacts[i], laws)
    if scenery.openings is not None:
        near = closeness(walls)
        wall = hit_wall(scenery.openings, scenery, walls, (r, v), wall, near)
        if lets_through(scenery.openings, walls, wall, r, near):
            if leads_on(walls, wall, r):
                r, v = through(walls, scenery.pull, wall, (r, v))
                put(queue.position, 0, i, r)
                put(queue.velocity, 0, i, v)
            else:
                _escape(queue, i, float(scenery.owners[index(int(wall))]), rule, now)
            return
    bounce = impact_on_wall(laws, walls, scenery.pull, wall, arriving, random)
    owner, v1, time = index(scenery.owners[int(wall)]), bounce.v, rule.moment - (rule.end - now)
    if queue.absorbed_time is not None and bounce.wait == math.inf:
        absorb(queue, i, owner, time)
        v1 = v
    elif queue.starts is not None and bounce.wait > 0.0:
        queue.starts[i] = time + bounce.wait
        queue.wait[i], queue.due[i], queue.wall[i] = bounce.wait, now + bounce.wait, WAITS
    put(queue.velocity, 0, i, v1)
    book(laws, queue, (index(scenery.rows[int(wall)]), i, i), m, bounce)
    queue.energy[i] = 0.5 * bounce.twice_energy
    struck = Struck(i, wall, time, r, v, v1, m * bounce.impulse)
    struck = queue.watchers.with_slip(laws, walls, struck)
    queue.watchers.hit(None, struck._replace(wall=float(owner)))


@outlined
def _strike(scenery, walls, queue, i, rule, now):
    """Carry out the impact of particle i on a reacting wall."""
    r, v, m = column(queue.position, 0, i), column(queue.velocity, 0, i), queue.mass[i]
    random, flight = None, ParticleFlight(r, v, ZERO, now, 0.0)
    if queue.escape_time is not None:
        out = exit_at(scenery.reacting, queue.struck[i], walls, flight)
        if out >= 0.0:
            _escape(queue, i, out, rule, now)
            return
    if scenery.seeding is not None:
        random = scenery.seeding.of_impact(i, queue.impacts[i], scenery.laws)
    blow = strike(scenery.reacting, queue.struck[i], walls, flight, m, random)
    left = 2.0 * queue.energy[i] - 2.0 * (blow.given + blow.lost) / m
    if queue.heat is not None:
        left += 2.0 * blow.heat / m
        queue.heat[index(blow.row), i] += blow.heat
    v1, kept = with_energy(blow.v, left, 2.0 * potential(scenery.pull, blow.r))
    time = rule.moment - (rule.end - now)
    if queue.absorbed_time is not None and not blow.stays:
        absorb(queue, i, blow.owner, time)
        v1, kept = v, left
    put(queue.position, 0, i, blow.r)
    put(queue.velocity, 0, i, v1)
    queue.energy[i] = 0.5 * kept
    queue.impulse[index(blow.row), i] += blow.impulse
    queue.dissipated[i] += blow.lost
    queue.impacts[i] += blow.impulse > 0.0
    queue.watchers.hit(None, Struck(i, float(blow.owner), time, blow.r, v, v1, blow.impulse, blow.slip))


# --- Events of all particles -----------------------------------------------------------------------------


def _soon(clock):
    """The mean time from one strike of a reacting wall to the next.

    A particle that may meet such a wall sooner is looked at again after the next strike.
    """
    return (clock[BEFORE] + clock[NOW]) / (1.0 + clock[STRIKES])


@long_kernel
def predict(scenery, freedoms, queue, clock, rule, first, last):
    """Find the next events of the particles from `first` to before `last`, and change no other particle.

    At the start of a frame, find also when they meet given walls.
    """
    now = clock[NOW]
    for k in range(first, last):
        i = index(k)
        if now == 0.0:
            _set_out(scenery, queue, i, rule)
        queue.heap.key[i] = _next(scenery, freedoms, queue, i, now, rule.end, _soon(clock))


@long_kernel
def arrive(scenery, queue, rule, first, last):
    """Bring particles from `first` to before `last` to the frame's end; return where the log is full, or `last`."""
    for k in range(first, last):
        if is_full(queue.watchers.log):
            return k
        if not is_gone(queue, index(k)) and not _waits(queue, index(k)):
            _fly(scenery, queue, index(k), rule.end, rule.end - queue.time[index(k)], rule.end)
    return last


@long_kernel
def lease(scenery, freedoms, clock):
    """Begin new leases of the walls at the time of the clock."""
    for wall in scenery.reacting:
        wall.freedom.renew(freedoms, clock[NOW])
    clock[TAKEN] = 0.0


def _list(queue, close, i):
    """List particle i if it is near; return the number of listed particles."""
    if queue.near[i] and not queue.listed[i]:
        queue.listed[i] = True
        queue.close[close] = i
        close += 1
    return close


@outlined
def _look_again(scenery, freedoms, queue, clock, rule, close):
    """Find the next events of near particles after a strike; return how many are listed."""
    heap, kept = queue.heap, 0
    for k in range(close):
        item = queue.close[k]
        i = index(item)
        if queue.near[i]:
            change(heap, item, _next(scenery, freedoms, queue, i, clock[NOW], rule.end, _soon(clock)))
        queue.listed[i] = queue.near[i]
        queue.close[kept] = item
        kept += queue.near[i]
    return kept


def _carry_out(scenery, freedoms, queue, i, now, rule):
    """Carry out the event of particle i that is due, and find its next given wall; return a status."""
    if _waits(queue, i):
        queue.time[i] = now
        _aim(scenery, queue, i, rule.end)
        return Status.DONE.value
    queue.hits[i] += select(now > queue.time[i], 1, AT_ONCE)
    # The time of the frame has fewer digits than the flight.
    way = select(queue.struck[i] >= 0.0, now - queue.time[i], queue.wait[i])
    _fly(scenery, queue, i, now, way, rule.end)
    if queue.struck[i] >= 0.0:
        _strike(scenery, freedoms, queue, i, rule, now)
    elif queue.wall[i] >= 0.0:
        _bounce(scenery, queue, i, queue.wall[i], rule, now)
    if scenery.seeding is not None and math.isnan(queue.velocity[0, i]):
        return Status.SENT_WRONG.value
    if not is_gone(queue, i) and not _waits(queue, i):
        _aim(scenery, queue, i, rule.end)
    return select(queue.hits[i] <= MOST_HITS, Status.DONE.value, Status.STALLED.value)


def _listed(queue):
    """List the near particles; return their number."""
    close = 0
    for k in range(queue.near.size):
        queue.listed[index(k)] = False
        close = _list(queue, close, index(k))
    return close


@long_kernel
def take(scenery, freedoms, queue, clock, rule):
    """Take event after event until the end of the frame; return the status and the particle.

    After LEASE_ENDED, at the time of the clock: call `lease`, `predict`, and then this again. After LOG_FULL: call it
    again with an empty log. The status is INTERRUPTED after `rule.halt` events: the next call goes on with the same
    bits.
    """
    heap, end, taken = queue.heap, rule.end, 0
    build(heap)
    close = _listed(queue)
    # The time at which the first lease may end without a strike.
    until = min(freedoms.until)
    while True:
        item = heap.item[0]
        i = index(item)
        now = heap.key[i]
        if not now < min(until, end):
            clock[NOW] = min(until, end)
            return (Status.LEASE_ENDED.value if until < end else Status.DONE.value), 0
        if taken >= rule.halt[0]:
            return Status.INTERRUPTED.value, 0
        if is_full(queue.watchers.log):
            return Status.LOG_FULL.value, 0
        taken += 1
        clock[NOW], clock[TAKEN] = now, clock[TAKEN] + 1.0
        wall = queue.struck[i]
        if wall >= 0.0 or queue.due[i] <= now:
            status = _carry_out(scenery, freedoms, queue, i, now, rule)
            if status != Status.DONE.value:
                return status, item
        if wall >= 0.0:
            clock[STRIKES] += 1.0
            if not all_stay(scenery.reacting, wall, freedoms):
                return Status.LEASE_ENDED.value, 0
            until = min(freedoms.until)
            close = _look_again(scenery, freedoms, queue, clock, rule, close)
        change(heap, item, _next(scenery, freedoms, queue, i, now, end, _soon(clock)))
        close = _list(queue, close, i)
