"""Thermal walls: a particle that they accommodate leaves with a velocity of the wall's temperature."""

from typing import Any, NamedTuple

from ..kernel.jit import outlined
from ..kernel.random import flux_maxwellian, uniforms
from ..kernel.vector import Vec, dot
from ..surfaces import fold as walls
from . import laws as wall_laws


class Draw(NamedTuple):
    """What the random numbers of an impact depend on: the seed of the run, the particle, its number of impacts."""

    seed: Any
    particle: Any
    number: Any


class Left(NamedTuple):
    """Whether a wall has accommodated a particle, its velocity then, and the normal impulse per mass."""

    happens: bool
    v: Vec
    impulse: float


@outlined
def exchange(thermal, chain, wall, arriving, mass, draw):
    """What a thermal wall makes of a particle that is `arriving` with (r, v)."""
    law = wall_laws.thermal_of(thermal, wall)
    r, v = arriving
    n = walls.unit_normal(chain, wall, r)
    u = uniforms(draw.seed, draw.particle, draw.number)
    w = flux_maxwellian(n, law.energy / mass, u)
    b = dot(v, n)
    return Left((b > 0.0) & (u.choice < law.accommodation), w, b - dot(w, n))
