"""Walls that send particles off by a law: thermal walls, with a velocity of their temperature, and `laws`."""

import math

from ..kernel.jit import select
from ..kernel.random import flux_maxwellian, uniforms
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, dot, either, square
from .laws import KEPT
from .reflection import from_relative, given, relative, wall_velocity

# How far |v|^2 may be, in parts of it, from the energy that is kept for it.
_NEAR = 0.1
_NORMAL = Vec(0.0, 0.0, 1.0)


class Arriving(Record):
    """A particle at a wall: where, its velocity, and |v|^2 as its energy has it.

    Laws do not act on what comes slower along the normal than `slow`.
    """

    r: Vec
    v: Vec
    speed2: float
    slow: float
    mass: float


class Sent(Record):
    """The sending of a particle by a law: whether it happens, the velocity then, normal speeds before and after.

    `work` is twice what the wall gives by its motion, per mass; of the rest of the change of energy `lost` is
    dissipated, without end where all of it is. `keeps` is whether there is no rest. It waits so long [s], without end
    where it is absorbed.
    """

    happens: bool
    v: Vec
    towards: float
    away: float
    work: float
    lost: float
    keeps: bool
    wait: float

    @property
    def impulse(self):
        """The normal impulse per mass."""
        return self.towards + self.away


def send(laws, walls, wall, arriving, random):
    """`Sent` of a particle that is `Arriving` at a wall. What is no velocity, or into the wall, is NaN."""
    r, v, mass = arriving.r, arriving.v, arriving.mass
    n, moving = walls.unit_normal(wall, r), wall_velocity(laws.moving, walls, wall, r)
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
        own = _by_law(laws, one, wall, (n, moving), arriving, random, acts)
        happens = happens | acts
        after, lost = either(acts, own.v, after), select(acts, own.lost, lost)
        keeps, wait = (acts & own.keeps) | keeps, select(acts, own.wait, wait)
    work = given(moving, after - before)
    sent, away = from_relative(moving, after), -dot(after, n)
    if laws.own is not None:
        # A particle that is absorbed gives its normal momentum to the wall and keeps its velocity.
        stays = wait < math.inf
        sent = either(keeps & stays, _restored(sent, arriving.speed2 + work), sent)
        away = select(stays, away, 0.0)
    return Sent(happens, sent, b, away, work, lost, keeps, wait)


class _Own(Record):
    """What the laws of a wall make of a particle, relative to the wall."""

    v: Vec
    lost: float
    keeps: bool
    wait: float


def _by_law(laws, one, wall, at, arriving, random, acts):
    """`_Own` by the laws `one` of a wall, with the normal and the velocity `at` it; any where they do not act."""
    n, moving = at
    # Where the laws do not act they get valid numbers: with NaN, a law of the user might not end.
    n = either(acts, -1.0 * n, _NORMAL)
    u = ZERO if moving is None else moving
    v = either(acts, arriving.v, u - n)
    before = v - u
    ended = one.leave(wall, v, n, u, random, arriving.mass)
    after = ended.v - u
    is_right = ended.is_right if laws.across is None else ended.is_right & (laws.across.part(after) == 0.0)
    if moving is not None:
        # A particle that waits would have to be carried along by the wall.
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


def _restored(v, speed2):
    """A velocity scaled so that its square is speed2, from within round-off, by one Newton step of the square root."""
    moving = speed2 > 0.0
    f = (speed2 - square(v)) * select(moving, 0.5 / select(moving, speed2, 1.0), 0.0)
    return v * (1.0 + select(abs(f) <= _NEAR, f, 0.0))
