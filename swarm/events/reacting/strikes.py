"""The reacting walls of a scene: one wall, and all of them together."""

import math
from typing import Any, NamedTuple

from ...ball_numbers import INERTIA
from ...contact.absence import lets_through
from ...contact.wall_impact import Arriving, Facing, by_law
from ...kernel.jit import select
from ...kernel.record import Record
from ...kernel.vector import ZERO, Vec, cross, dot, either, norm, square, with_square
from ...surfaces.fields.members import Members
from ...surfaces.time_of_impact.flights import NEVER, soonest
from ...surfaces.walls import Walls

# The relative error of the squared speed up to which the energy after a strike is the one computed from impulses.
_NEAR = 1e-9


class WallImpact(NamedTuple):
    """A particle after its impact on a reacting wall, and the impulse [N s]."""

    r: Vec  # on the wall
    v: Vec
    impulse: float
    given: float  # energy that the wall gains, with that of the spin of a ball [J]
    lost: float  # energy that is dissipated [J]
    owner: Any
    row: int  # in the books
    slip: Vec  # velocity before the impact, relative to the wall and along it [m/s]
    heat: float = 0.0  # energy that the law of the wall adds [J]
    stays: Any = True  # False if the law absorbs the particle, which keeps its velocity


class Ball(Record):
    """A ball: its number, its radius, and the `BallSpins` of all; None where balls do not turn."""

    i: Any
    radius: float
    turning: Any


class Rubbed(Record):
    """The effect of friction in a strike."""

    impulse: Vec  # on the wall, besides the normal impulse
    lost: float  # energy [J]
    turned: float  # energy that the spin of the ball gains [J]


class LawImpulse(Record):
    """The impulse on a wall of a strike by a law of the wall, and the energy that the law takes and gives [J]."""

    impulse: Vec
    lost: float
    heat: float
    stays: Any


class Reacting(Record):
    """A reacting wall."""

    body: Any
    freedom: Any  # the `Freedom` of its motion
    owner: Any  # its number among all walls of the scene
    row: int  # its row in the books of the scene
    restitution: float
    laws: Any = None  # None, or the `Laws` of the surface, if they are more than a restitution
    number: float = 0.0  # its number among the walls of the surface
    absorbs: Any = None  # 1 if a law may absorb particles, or None
    openings: Any = None  # None, or each `Opened`, which move with the wall

    def count(self):
        """The number of walls: 1, or those of a field."""
        return self.body.count() if isinstance(self.body, Members) else 1.0

    def grown(self, radius):
        """The wall that the centre of a ball meets."""
        return self._replace(body=self.body.grown(radius))

    def one(self, number):
        """The wall with a number in a field; else the wall itself."""
        if not isinstance(self.body, Members):
            return self
        return self._replace(
            body=self.body.wall(number), owner=self.owner + int(number), number=self.number + number
        )  # fmt: skip

    def lets_out(self, walls, flight, radius):
        """Whether the wall is open where a particle, or a ball of this radius, meets it."""
        surface = self.freedom.posed(self.body, walls, flight.time)
        foot = surface.own_place(flight.r + radius * surface.unit_normal(flight.r))
        return lets_through(self.openings, Walls((self.body,)), self.number, foot, 0.0)

    def strike(self, walls, flight, mass, random=None, ball=None):
        """Carry out the impact of a particle, a `Ball` or a point, on the wall; return its `WallImpact`."""
        freedom = self.freedom
        surface = freedom.posed(self.body, walls, flight.time)
        # The time of the frame has fewer digits than the flight: without a projection the particle may begin its next
        # flight inside the wall.
        r = surface.project(flight.r)
        n = surface.unit_normal(r)
        touch = r if ball is None else r + ball.radius * n
        arm, u = freedom.arm(touch), surface.velocity(touch)
        # J = (1 + e) n.(v - u)/(n^2/m + 1/M_n)
        speed = dot(n, u)
        approach = dot(n, flight.v) - speed
        approach = select(approach > 0.0, approach, 0.0)
        give = freedom.mobility(n, arm)
        both = square(n) / mass + give
        impulse = (1.0 + self.restitution) * approach / both
        lost = 0.5 * (1.0 - self.restitution) * (1.0 + self.restitution) * approach * approach / both
        slip = flight.v - u - ((dot(n, flight.v) - speed) / square(n)) * n
        if self.laws is None:
            freedom.push(walls, flight.time, impulse * n, arm)
            given = impulse * (speed + 0.5 * impulse * give)
            return WallImpact(r, flight.v - (impulse / mass) * n, impulse, given, lost, self.owner, self.row, slip)
        whole, heat, turned, happens = impulse * n, 0.0, 0.0, False
        law: Any = None
        if self.laws.send_off:
            happens, law = self._by_law(r, n, flight.v - u, (mass, arm), random)
        if self.laws.friction is not None:
            passing = flight.v - (impulse / mass) * n - u - freedom.response(whole, arm)
            more = self._rubbed(n, passing, (mass, arm), select(happens, 0.0, impulse), ball)
            whole, lost, turned = whole + more.impulse, lost + more.lost, more.turned
        if law is not None:
            whole, heat = either(happens, law.impulse, whole), select(happens, law.heat, 0.0)
            lost, impulse = select(happens, law.lost, lost), select(happens, dot(n, law.impulse), impulse)
        freedom.push(walls, flight.time, whole, arm)
        given = dot(u, whole) + 0.5 * freedom.mobility(whole, arm) + turned
        v1, stays = flight.v - (1.0 / mass) * whole, True
        if self.absorbs is not None:
            # An absorbed particle gives its normal momentum to the wall, and keeps its velocity and its energy.
            stays = law.stays | (not happens)
            more, less = (given, 0.0) if self.laws.give_heat else (0.0, -given)
            v1, heat, lost = either(stays, v1, flight.v), select(stays, heat, more), select(stays, lost, less)
        return WallImpact(r, v1, impulse, given, lost, self.owner, self.row, slip, heat, stays)

    def _by_law(self, r, n, w, at, random):
        """Return whether a law acts on a particle with the relative velocity w, and its `LawImpulse`."""
        mass, arm = at
        spread = self.freedom.spread(mass, arm)
        facing, before = spread.out(n), spread.back(w)
        arriving = Arriving(r, before, square(before), mass)
        wall = Facing(facing * (1.0 / norm(facing)))
        random = random._replace(across=self.laws.across)
        happens, bounce = by_law(self.laws, wall, None, self.number, arriving, random)
        after = either(bounce.keeps, with_square(bounce.v, arriving.twice), bounce.v)
        change, stays = before - after, bounce.wait < math.inf
        if self.absorbs is not None:
            change = either(stays, change, (bounce.impulse / norm(facing)) * facing)
        half = 0.5 * mass
        return happens, LawImpulse(mass * spread.back(change), half * bounce.lost, half * bounce.heat, stays)

    def _rubbed(self, n, passing, at, impulse, ball):
        """Return the `Rubbed` of a strike; `passing` is the velocity relative to the wall after the normal impulse."""
        mass, arm = at
        slip, give = passing - dot(passing, n) * n, 1.0 / mass
        turns = ball is not None and ball.turning is not None
        if turns:
            slip, give = slip + ball.radius * cross(ball.turning.at(ball.i), n), give + 1.0 / (INERTIA * mass)
        speed = norm(slip)
        way = slip * (1.0 / select(speed > 0.0, speed, 1.0))
        give += self.freedom.mobility(way, arm)
        most, stops = self.laws.friction_of(self.number) * impulse, speed / give
        along = select(most < stops, most, stops)
        turned = 0.0
        if turns:
            twist = (-along / (INERTIA * mass * ball.radius)) * cross(n, way)
            turned = -0.5 * mass * ball.radius * ball.radius * ball.turning.add(ball.i, twist)
        return Rubbed(along * way, along * (speed - 0.5 * along * give), turned)


def reach_of_all(reacting, walls, flight):
    """A time in which a flight meets none of the walls, whatever impacts do to them within their leases."""
    time = math.inf
    for wall in reversed(reacting):
        first = wall.freedom.reach(wall.body, walls, flight)
        time = select(time < first, time, first)
    return time


def numbered(reacting):
    """The pairs (number, `Reacting`) of the walls; the number of a field is that of its first wall."""
    found: Any = ()
    number = 0.0
    for wall in reacting:
        found = (*found, (number, wall))
        number = number + wall.count()
    return found


def is_of(wall, number, one):
    """Whether the number `wall` is that of `one`, which has `number`, or of a wall in the field `one`."""
    return (wall >= number) & (wall < number + one.count()) if isinstance(one.body, Members) else wall == number


def first_hit(reacting, gravity, walls, flight):
    """Return the first `Hit` of a flight, if nothing else strikes the walls before."""
    hit = NEVER
    for number, wall in reversed(numbered(reacting)):
        hit = soonest(wall.freedom.hit(wall.body, gravity, walls, flight), number, hit)
    return hit


def exit_at(reacting, wall, walls, flight, radius=0.0):
    """Return the number of a wall in the scene if it is open to a particle that meets it, else -1."""
    owner = -1.0
    for number, several in numbered(reacting):
        if several.openings is not None:
            one = several.one(wall - number)
            here = is_of(wall, number, several) & one.lets_out(walls, flight, radius)
            owner = select(here, float(one.owner), owner)
    return owner


def strike(reacting, wall, walls, flight, mass, random=None, ball=None):
    """Carry out the impact of a particle on the wall with a number; return its `WallImpact`."""
    for number, one in numbered(reacting):
        if is_of(wall, number, one):
            return one.one(wall - number).strike(walls, flight, mass, random, ball)
    return WallImpact(flight.r, flight.v, 0.0, 0.0, 0.0, -1, -1, ZERO)


def with_energy(v, left, fall):
    """Return a velocity after a strike scaled to the energy `left`, and its energy: twice, per mass, and with weight.

    The energy determines the speed, as round-off of the impulse has a bias, 1e-16 of the energy an impact. A particle
    that nearly stops is not scaled, and its energy is that of its velocity.
    """
    v1 = with_square(v, left - fall)
    now = square(v1) + fall
    return v1, select(abs(now - left) <= _NEAR * square(v1), left, now)


def all_stay(reacting, wall, walls):
    """Whether the wall with a number, which was just struck, is within its lease."""
    for number, one in numbered(reacting):
        if is_of(wall, number, one):
            return one.freedom.stays(walls)
    return True
