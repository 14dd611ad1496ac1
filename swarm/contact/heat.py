"""Walls that give heat: thermal ones, which a particle leaves with a velocity of their temperature, and one's own."""

import math

from ..kernel.jit import outlined, select
from ..kernel.random import flux_maxwellian, uniforms
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, dot
from .reflection import from_relative, given, relative, wall_velocity


class Left(Record):
    """The leave of a particle: whether a law sent it off, its velocity then, its normal impulse per mass.

    `work` is twice what the wall gives by its motion, per mass; the rest of the change of energy is heat.
    """

    happens: bool
    v: Vec
    impulse: float
    work: float


@outlined
def exchange(laws, walls, wall, arriving, mass, random):
    """`Left` of a particle that is `arriving` at a wall with (r, v, the least speed at which one's own law acts)."""
    r, v, least = arriving
    n, moving = walls.unit_normal(wall, r), wall_velocity(laws.moving, walls, wall, r)
    before = relative(moving, v)
    b = dot(before, n)
    happens, after = False, before
    if laws.thermal is not None:
        law, u = laws.thermal_of(wall), uniforms(random.seed, random.particle, random.number)
        after, happens = flux_maxwellian(n, law.energy / mass, u), u.choice < law.accommodation
        happens = (b > 0.0) & happens
    for one in laws.own or ():
        acts = one.has(wall) & (b > least) & (not happens)
        if acts:
            own = relative(moving, one.leave(v, -1.0 * n, ZERO if moving is None else moving, random, mass))
            # What is no velocity away from the wall ends the run when lanes are looked at (lanes/block.py).
            after = select(dot(own, n) < 0.0, own, Vec(math.nan, math.nan, math.nan))
        happens = happens | acts
    work = given(moving, after - before)
    return Left(happens, from_relative(moving, after), b - dot(after, n), work)
