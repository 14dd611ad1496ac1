"""The walls of a scene that react: each of them, and all of them at once."""

import math
from typing import Any, NamedTuple

from ...kernel.jit import select
from ...kernel.record import Record
from ...kernel.vector import ZERO, Vec, dot, square, with_square
from ...surfaces.time_of_impact.flights import NEVER, sooner

# The energy is that which is left where the square of the speed is off by no more than this part.
_NEAR = 1e-9


class WallImpact(NamedTuple):
    """A particle after its impact on a wall that reacts, and the impulse [N s]."""

    r: Vec  # on the wall
    v: Vec
    impulse: float
    given: float  # energy that the wall gains [J]
    lost: float  # energy that is dissipated [J]
    owner: int
    slip: Vec  # velocity relative to the wall along it, before [m/s]


class Reacting(Record):
    """A wall that reacts."""

    body: Any
    freedom: Any  # how it may move
    owner: int  # its number among all walls of the scene
    restitution: float

    def strike(self, walls, flight, mass):
        """The impact of a particle on it: its `WallImpact`."""
        freedom = self.freedom
        surface = freedom.posed(self.body, walls, flight.time)
        # The time of the frame has fewer digits than the flight: without this a particle is found in the wall next
        # time.
        r = surface.project(flight.r)
        n, arm = surface.unit_normal(r), freedom.arm(r)
        # J = (1 + e) n.(v - u)/(n^2/m + 1/M_n)
        u = surface.velocity(r)
        speed = dot(n, u)
        approach = dot(n, flight.v) - speed
        approach = select(approach > 0.0, approach, 0.0)
        give = freedom.mobility(n, arm)
        both = square(n) / mass + give
        impulse = (1.0 + self.restitution) * approach / both
        freedom.push(walls, flight.time, impulse * n, arm)
        lost = 0.5 * (1.0 - self.restitution) * (1.0 + self.restitution) * approach * approach / both
        given = impulse * (speed + 0.5 * impulse * give)
        slip = flight.v - u - ((dot(n, flight.v) - speed) / square(n)) * n
        return WallImpact(r, flight.v - (impulse / mass) * n, impulse, given, lost, self.owner, slip)


def reach_of_all(reacting, walls, flight):
    """A time during which a flight meets none of the walls, whatever others do to them within their leases."""
    time = math.inf
    for wall in reversed(reacting):
        first = wall.freedom.reach(wall.body, walls, flight)
        time = select(time < first, time, first)
    return time


def first_hit(reacting, gravity, walls, flight):
    """The first `Hit` of a flight, if nothing else strikes the walls before."""
    hit = NEVER
    for k, wall in reversed(tuple(enumerate(reacting))):
        time, found = wall.freedom.hit(wall.body, gravity, walls, flight)
        hit = sooner(time, found, float(k), hit)
    return hit


def strike(reacting, wall, walls, flight, mass):
    """The impact of a particle on the wall with this number: its `WallImpact`."""
    for k, one in enumerate(reacting):
        if wall == k:
            return one.strike(walls, flight, mass)
    return WallImpact(flight.r, flight.v, 0.0, 0.0, 0.0, -1, ZERO)


def with_energy(v, left, fall):
    """A velocity after a strike with the energy that is left, and that energy: both twice and per mass, with weight.

    The energy decides the speed: round-off of the impulse has a bias, 1e-16 of the energy an impact. Of a particle that
    all but stops nothing is restored, and the energy is that of its velocity.
    """
    v1 = with_square(v, left - fall)
    now = square(v1) + fall
    return v1, select(abs(now - left) <= _NEAR * square(v1), left, now)


def all_stay(reacting, wall, walls):
    """Whether the wall with this number, which was just struck, is within its lease."""
    for k, one in enumerate(reacting):
        if wall == k:
            return one.freedom.stays(walls)
    return True
