"""The walls of a scene that react: all of them at once, folded over their chain."""

import math
from typing import Any, NamedTuple

from ..kernel.jit import by_type, index, inlined, select
from ..kernel.vector import ZERO, Vec, dot, square
from ..surfaces import contract, flights, safe
from ..surfaces.flights import NEVER, sooner
from ..surfaces.fold import Chain
from ..surfaces.moving import Moving
from ..surfaces.relative import flight_of
from .freedoms import Hinged, Sprung, arm_of, drive_of, mobility, posed, push, renew, stays
from .pendulum import Pendulum, swaying
from .reach import reach


class Reacting(NamedTuple):
    """A wall that reacts."""

    body: Any
    freedom: Any  # how it may move
    owner: int  # its number among all walls of the scene
    restitution: float


class Flight(NamedTuple):
    """A particle at a time of the frame, and how far ahead of it matters [s]."""

    r: Vec
    v: Vec
    pull: Vec
    time: float
    longest: float


class Blow(NamedTuple):
    """What an impact on a wall that reacts makes of a particle, and its impulse [N s]."""

    r: Vec  # on the wall
    v: Vec
    impulse: float
    given: float  # energy that the wall gains [J]
    lost: float  # energy that is dissipated [J]
    owner: int


@by_type
def reach_of_all(chain, walls, flight):
    """A time during which a flight meets none of the walls, whatever others do to them within their leases."""
    return math.inf


@reach_of_all.register(Chain)
def _(chain, walls, flight):
    first = reach(chain.first.freedom, chain.first.body, walls, flight)
    rest = reach_of_all(chain.rest, walls, flight)
    return select(rest < first, rest, first)


@by_type
def first_hit(chain, gravity, walls, flight):
    """The first `Hit` of a flight, if nothing else strikes the walls before."""
    return NEVER


@first_hit.register(Chain)
def _(chain, gravity, walls, flight):
    time, found = _hit(chain.first.freedom, chain.first.body, gravity, walls, flight)
    return sooner(time, found, first_hit(chain.rest, gravity, walls, flight))


@by_type
def _hit(freedom, body, gravity, walls, flight):
    """When a flight meets one wall: (time, whether it does then)."""
    return flights.hit(gravity, posed(freedom, body, walls, flight.time), flight.r, flight.v)


@_hit.register(Sprung)
@_hit.register(Hinged)
def _(freedom, body, gravity, walls, flight):
    return _march(Moving(body, drive_of(freedom, walls, flight.time)), flight, flight.longest)


@_hit.register(Pendulum)
def _(freedom, body, gravity, walls, flight):
    # What comes after the lease is asked again then.
    longest = min(flight.longest, max(walls.until[index(freedom.row)] - flight.time, 0.0))
    return _march(swaying(freedom, body, walls, flight, longest), flight, longest)


@inlined
def _march(wall, flight, longest):
    found = safe.march(Chain(wall, None), flight_of(flight.r, flight.v, flight.pull, 0.0), longest)
    return found.time, found.wall >= 0.0


@by_type
def strike(chain, wall, walls, flight, mass):
    """The impact of a particle on the wall with this number: its `Blow`."""
    return Blow(flight.r, flight.v, 0.0, 0.0, 0.0, -1)


@strike.register(Chain)
def _(chain, wall, walls, flight, mass):
    if wall != 0.0:
        return strike(chain.rest, wall - 1.0, walls, flight, mass)
    first = chain.first
    surface = posed(first.freedom, first.body, walls, flight.time)
    # The time of the frame has fewer digits than the flight: without this a particle is found in the wall next time.
    r = contract.settle(surface, flight.r)
    n, arm = contract.unit_normal(surface, r), arm_of(first.freedom, r)
    # J = (1 + e) n.(v - u)/(n^2/m + 1/M_n)
    speed = dot(n, contract.velocity(surface, r))
    approach = dot(n, flight.v) - speed
    approach = select(approach > 0.0, approach, 0.0)
    give = mobility(first.freedom, n, arm)
    both = square(n) / mass + give
    impulse = (1.0 + first.restitution) * approach / both
    push(first.freedom, walls, flight.time, impulse * n, arm)
    lost = 0.5 * (1.0 - first.restitution) * (1.0 + first.restitution) * approach * approach / both
    given = impulse * (speed + 0.5 * impulse * give)
    return Blow(r, flight.v - (impulse / mass) * n, impulse, given, lost, first.owner)


# --- Leases ----------------------------------------------------------------------------------------------


@by_type
def renew_all(chain, walls, t):
    """New leases of all walls, from this time on."""


@renew_all.register(Chain)
def _(chain, walls, t):
    renew(chain.first.freedom, walls, t)
    renew_all(chain.rest, walls, t)


@by_type
def all_stay(chain, wall, walls):
    """Whether the wall with this number, which was just struck, is within its lease."""
    return True


@all_stay.register(Chain)
def _(chain, wall, walls):
    if wall != 0.0:
        return all_stay(chain.rest, wall - 1.0, walls)
    return stays(chain.first.freedom, walls)


@by_type
def settle_all(chain, walls, t):
    """Bring every wall to a time, which its motion is counted from."""


@settle_all.register(Chain)
def _(chain, walls, t):
    push(chain.first.freedom, walls, t, ZERO, ZERO)
    settle_all(chain.rest, walls, t)
