"""Walls that give heat: thermal ones, which a particle leaves with a velocity of their temperature, and one's own."""

import math

from ..kernel.jit import outlined, select
from ..kernel.random import flux_maxwellian, uniforms
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, dot, norm
from .reflection import from_relative, given, relative, wall_velocity

# Speed into the wall that is none, as a part of the speeds before and after.
_ROUND_OFF = 1e-15


class Left(Record):
    """The leave of a particle: whether a law sent it off, its velocity then, its normal speeds before and after.

    `work` is twice what the wall gives by its motion, per mass; the rest of the change of energy is heat.
    """

    happens: bool
    v: Vec
    towards: float
    away: float
    work: float

    @property
    def impulse(self):
        """The normal impulse per mass."""
        return self.towards + self.away


@outlined
def exchange(laws, walls, wall, arriving, mass, random):
    """`Left` of a particle that is `arriving` at a wall with (r, v, the speed to which one's own law does not act)."""
    r, v, slow = arriving
    n, moving = walls.unit_normal(wall, r), wall_velocity(laws.moving, walls, wall, r)
    before = relative(moving, v)
    b = dot(before, n)
    happens, after = False, before
    if laws.thermal is not None:
        law, u = laws.thermal_of(wall), uniforms(random.seed, random.particle, random.number)
        after = flux_maxwellian(n, law.energy / mass, u, laws.across)
        happens = u.choice < law.accommodation
        happens = (b > 0.0) & happens
    for one in laws.own or ():
        acts = one.has(wall) & (b > slow) & (not happens)
        if acts:
            own = relative(moving, one.leave(v, -1.0 * n, ZERO if moving is None else moving, random, mass))
            # What is no velocity, or one into the wall or out of the plane, ends the run when lanes are looked at
            # (lanes/block.py).
            into = _ROUND_OFF * (norm(v) + norm(own))
            is_right = dot(own, n) <= into
            if laws.across is not None:
                is_right = is_right & (laws.across.part(own) == 0.0)
            after = select(is_right, own, Vec(math.nan, math.nan, math.nan))
        happens = happens | acts
    work = given(moving, after - before)
    return Left(happens, from_relative(moving, after), b, -dot(after, n), work)
