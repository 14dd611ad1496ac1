"""Thermal walls: a particle that they accommodate leaves with a velocity of the wall's temperature."""

from typing import Any

from ..kernel.jit import outlined
from ..kernel.random import flux_maxwellian, uniforms
from ..kernel.record import Record
from ..kernel.vector import Vec, dot
from .reflection import from_relative, given, relative, wall_velocity


class Draw(Record):
    """The source of the random numbers of an impact: the seed of the run, the particle, its number of impacts."""

    seed: Any
    particle: Any
    number: Any


class Left(Record):
    """The leave of a particle: whether the wall accommodated it, its velocity then, its normal impulse per mass.

    `work` is twice what the wall gives by its motion, per mass; the rest of the change of energy is heat.
    """

    happens: bool
    v: Vec
    impulse: float
    work: float


@outlined
def exchange(laws, walls, wall, arriving, mass, draw):
    """`Left` of a particle that is `arriving` at a thermal wall with (r, v)."""
    law = laws.thermal_of(wall)
    r, v = arriving
    n = walls.unit_normal(wall, r)
    u = uniforms(draw.seed, draw.particle, draw.number)
    moving = wall_velocity(laws.moving, walls, wall, r)
    before, after = relative(moving, v), flux_maxwellian(n, law.energy / mass, u)
    b, happens = dot(before, n), u.choice < law.accommodation
    work = given(moving, after - before)
    return Left((b > 0.0) & happens, from_relative(moving, after), b - dot(after, n), work)
