"""One impact of one particle on a wall: the velocity of the particle after it, and the accounts.

Every engine takes its impacts from here. Queues of points and of balls take an impact as a whole. Lanes take it in two
loops: one of reflections, and one of the laws by which a wall sends particles off (its temperature, or `laws`).
"""

import math
from typing import Any

from ..kernel.arrays import index
from ..kernel.gravity import potential
from ..kernel.jit import select
from ..kernel.random import flux_maxwellian, uniforms
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, dot, either, square
from .laws import KEPT
from .reflection import Bounce, energy_of, exact, from_relative, given, relative, restore, wall_velocity

_NORMAL = Vec(0.0, 0.0, 1.0)


class Arriving(Record):
    """A particle at a wall: its place, its velocity, twice its energy per mass, and its mass [kg].

    Laws do not act on a particle slower along the normal than `slow`. A ball with its centre at `r` is in contact with
    the wall at `touch`; None means at `r`.
    """

    r: Vec
    v: Vec
    twice: float
    mass: float
    slow: float = 0.0
    touch: Any = None

    def contact(self):
        """Return the point of contact with the wall."""
        return self.r if self.touch is None else self.touch


class Facing(Record):
    """A wall at the place of an impact, as its laws take it: its normal, and its velocity or None if no wall moves."""

    n: Vec
    u: Any = None

    def unit_normal(self, _wall, _r):
        """Return the normal."""
        return self.n

    def velocity(self, _wall, _r):
        """Return the velocity."""
        return self.u


def impact_on_wall(laws, walls, gravity, wall, arriving, random):
    """Return the `Bounce` of a particle that is `Arriving` at a wall: by a law of the wall if one acts, else reflected.

    `random` are the random numbers of the impact, which only such laws use.
    """
    bounce = exact(laws, walls, gravity, wall, arriving.r, arriving.v, energy_of(arriving.twice), arriving.contact())
    if laws.send_off:
        happens, sent = by_law(laws, walls, gravity, wall, arriving, random)
        bounce = select(happens, sent, bounce)
    return bounce


def by_law(laws, walls, gravity, wall, arriving, random):
    """Return whether a law of a wall acts, and its `Bounce`; NaN for a velocity that is not finite or into the wall."""
    r, v, mass, twice = arriving.r, arriving.v, arriving.mass, arriving.twice
    n, fall = walls.unit_normal(wall, r), 2.0 * potential(gravity, r)
    moving = wall_velocity(laws.moving, walls, wall, arriving.contact())
    before = relative(moving, v)
    b = dot(before, n)
    happens, after, lost, keeps, wait = False, before, 0.0, False, 0.0
    if laws.thermal is not None:
        law, u = laws.thermal_of(wall), uniforms(random.seed, random.particle, random.number)
        after = flux_maxwellian(n, law.energy / mass, u, laws.across)
        happens = u.choice < law.accommodation
        happens = (b > 0.0) & happens
    for one in laws.own or ():
        acts = one.has(wall) & (b > arriving.slow) & (not happens)
        own = _own_law(laws, one, wall, (n, moving), arriving, random, acts)
        happens = happens | acts
        after, lost = either(acts, own.v, after), select(acts, own.lost, lost)
        keeps, wait = (acts & own.keeps) | keeps, select(acts, own.wait, wait)
    work = given(moving, after - before)
    sent, away = from_relative(moving, after), -dot(after, n)
    if laws.own is not None:
        # An absorbed particle gives its normal momentum to the wall and keeps its velocity.
        stays = wait < math.inf
        speed2 = twice - fall + work
        sent = either(keeps & stays, restore(sent, speed2, energy_of(speed2).half_inverse, True), sent)
        away = select(stays, away, 0.0)
    left = select(keeps, twice + work, square(sent) + fall)
    lost, heat = shares(laws, left - work - twice, lost)
    return happens, Bounce(sent, b + away, left, 2.0 * away, work, lost, heat, wait, keeps, True)


class _Own(Record):
    """The state of a particle after the laws of a wall, relative to the wall."""

    v: Vec
    lost: float
    keeps: bool
    wait: float


def _own_law(laws, one, wall, at, arriving, random, acts):
    """Return `_Own` by the laws `one` of a wall, arbitrary if they do not act; `at` is its normal and its velocity."""
    n, moving = at
    # Laws that do not act get valid numbers: with NaN, a law of the user might not end.
    n = either(acts, -1.0 * n, _NORMAL)
    u = ZERO if moving is None else moving
    v = either(acts, arriving.v, u - n)
    before = v - u
    ended = one.leave(wall, v, n, u, random, arriving.mass)
    after = ended.v - u
    is_right = ended.is_right if laws.across is None else ended.is_right & (laws.across.part(after) == 0.0)
    if moving is not None:
        # A moving wall would have to carry a particle that waits.
        is_right = is_right & ((ended.wait == 0.0) | (not ended.stays))
    stays, wait = ended.stays, select(is_right & (not ended.wait < 0.0), ended.wait, 0.0)
    speed2 = square(before)
    keeps = abs(square(after) - speed2) <= KEPT * speed2
    lost = math.inf if one.dissipates else select(keeps, 0.0, ended.lost)
    after = either(is_right, after, Vec(math.nan, math.nan, math.nan))
    if stays is not True:
        after, keeps = either(stays, after, before), keeps | (not stays)
        lost, wait = select(stays, lost, 0.0), select(stays, wait, math.inf)
    return _Own(after, lost, keeps, wait)


def shares(laws, given, lost):
    """Return the dissipated energy, below 0 if a law gives energy, and the heat; `given` is heat minus dissipation."""
    if laws.dissipate_all:
        return -given, 0.0
    if not laws.may_dissipate:
        return 0.0, given
    all_of_it = lost == math.inf
    taken = select(all_of_it, -given, lost)
    return taken, select(all_of_it, 0.0, given + taken)


# --- Accounts ---


def book(laws, books, place, mass, bounce):
    """Book an impact; return the heat [J]; `place` is (the row of the wall, its column, the particle)."""
    row, column, i = place
    books.impulse[row, column] += mass * bounce.impulse
    if laws.moving is not None:
        give_work(books, row, column, 0.5 * mass * bounce.work)
    books.impacts[i] += bounce.impulse > 0.0
    return book_energy(books, place, mass, bounce)


def give_work(books, row, column, work):
    """Book the work of a moving wall [J]; the rows of the works of all walls follow the rows of their impulses."""
    books.impulse[index(books.impulse.shape[0] // 2) + row, column] += work


def book_energy(books, place, mass, bounce):
    """Book the energy that an impact dissipates, and the heat; return the heat [J]."""
    row, column, i = place
    if books.dissipated.size > 0:
        books.dissipated[i] += 0.5 * mass * bounce.lost
    heat = 0.5 * mass * bounce.heat
    if books.heat is not None:
        books.heat[row, column] += heat
    return heat
