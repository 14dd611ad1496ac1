"""Counters in kernels: when a flight crosses one, and on which side of it a place is."""

import math
from typing import TYPE_CHECKING, Any

from ..kernel.gravity import as_vector
from ..kernel.jit import select
from ..kernel.record import Record
from ..kernel.vector import absolute, dot, square, total
from .frames import Framed
from .presence.openings import is_in_any
from .shapes.plane import PlaneNumbers
from .time_of_impact import flights
from .time_of_impact.polynomial import bernstein
from .walls import penetration


class Counted(Record):
    """A counter. A particle on its admissible side has the `sign` 1, and on its other side -1."""

    if TYPE_CHECKING:
        near: Any
        volumes: Any

    def may_cross(self, sign, gravity, r, v, span):
        """Whether a flight may cross the counter within the time `span`, without a branch."""
        raise NotImplementedError

    def crossing(self, sign, gravity, r, v):
        """Return the first `Hit` of a flight with a wall of the counter."""
        raise NotImplementedError

    def may_cross_again(self, sign, gravity, r, v, span):
        """Whether a flight from the counter, into the side of the sign, may cross it within the time `span`."""
        return True

    def distance(self, r):
        """The distance out of the admissible side, to first order; below 0 in it."""
        raise NotImplementedError

    def is_near(self, r):
        """Whether a place is on the counter, within round-off."""
        return abs(self.distance(r)) <= self.near

    def speed(self, sign, wall, r, v):
        """Speed across a wall of the counter at a place on it."""
        raise NotImplementedError

    def has(self, r):
        """Whether a crossing at this place counts."""
        return True if self.volumes is None else is_in_any(self.volumes, r)


class ReversedCounter(Counted):
    """A counter of one wall that a change of its sign turns to its other side."""

    wall: Any
    near: float  # a distance that is round-off [m]
    volumes: Any  # None, or the volumes in which crossings count

    def may_cross(self, sign, gravity, r, v, span):
        wall = with_sign(self.wall, sign)
        if gravity is None or not wall.is_quartic:
            time, _found = flights.hit(gravity, wall, r, v)
            return time < span
        return _may_rise(wall.course(r, v, as_vector(gravity)), span)

    def may_cross_again(self, sign, gravity, r, v, span):
        wall = with_sign(self.wall, sign)
        if gravity is None or not wall.is_quartic:
            return True
        return _may_rise_again(wall.course(r, v, as_vector(gravity)), span)

    def crossing(self, sign, gravity, r, v):
        time, found = flights.hit(gravity, with_sign(self.wall, sign), r, v)
        return flights.Hit(time, select(found, 0.0, -1.0))

    def distance(self, r):
        return self.wall.distance(r)

    def is_near(self, r):
        # Without the root and the division of a distance
        level = self.wall.level_of(self.wall.inner(r))
        return level * level <= (self.near * self.near) * square(self.wall.inner_gradient(r))

    def speed(self, sign, wall, r, v):
        return abs(dot(self.wall.unit_normal(r), v))

    def most(self, gravity):
        """The most crossings of a flight: a constant for the compiler, None where it has no closed form."""
        if isinstance(_body_of(self.wall), PlaneNumbers):
            return 1 if gravity is None else 2
        return 2 if gravity is None else None


class Walled(Counted):
    """Any counter: the walls around its admissible side, and the walls around its other side."""

    inner: Any
    outer: Any
    near: float  # a distance that is round-off [m]
    volumes: Any  # None, or the volumes in which crossings count
    ball: Any  # None, or a solid ball that contains the surface

    def may_cross(self, sign, gravity, r, v, span):
        found = span > 0.0
        if self.ball is not None:
            found = found & _may_meet(self.ball, gravity, r, v, span)
        if gravity is not None:
            return found
        inner, outer = _soonest(self.inner, r, v), _soonest(self.outer, r, v)
        return found & (select(sign > 0.0, inner, outer) < span)

    def crossing(self, sign, gravity, r, v):
        if sign > 0.0:
            return flights.first_hit(self.inner, gravity, r, v)
        return flights.first_hit(self.outer, gravity, r, v)

    def distance(self, r):
        return penetration(self.inner, r) - penetration(self.outer, r)

    def speed(self, sign, wall, r, v):
        n = self.inner.unit_normal(wall, r) if sign > 0.0 else self.outer.unit_normal(wall, r)
        return abs(dot(n, v))


def _may_meet(ball, gravity, r, v, span):
    """Whether a flight may be in a ball within the time `span`."""
    if gravity is not None:
        return _may_rise(ball.course(r, v, as_vector(gravity)), span)
    time, _found = ball.first_hit(r, v)
    return (time < span) | (ball.level_of(ball.inner(r)) > 0.0)


def _may_rise(level, span):
    """Whether the level of a fall may be above 0 within the time `span`."""
    return _are_some_above(bernstein((level.c, 2.0 * level.b, level.a2, level.a3, level.a4), span))


def _may_rise_again(level, span):
    """Whether the level of a fall inwards from the level 0 may be above 0 again, by the level over the time."""
    return _are_some_above(bernstein((2.0 * level.b, level.a2, level.a3, level.a4), span))


def _are_some_above(whole):
    """Whether any Bernstein coefficient of a quarter of the `whole` interval is not below 0."""
    found = False
    for half in _halves(whole):
        for quarter in _halves(half):
            for one in quarter:
                found = (not (one < 0.0)) | found
    return found


def _halves(coefficients):
    """Bernstein coefficients of both halves of an interval, by de Casteljau's scheme."""
    if len(coefficients) == 1:
        return coefficients, coefficients
    means = tuple(0.5 * (a + b) for a, b in zip(coefficients[:-1], coefficients[1:], strict=True))  # noqa: RUF007  traced
    first, last = _halves(means)
    return (coefficients[0], *first), (*last, coefficients[-1])


def _soonest(walls, r, v):
    """Lower bound of the time at which a straight flight leaves walls; 0 where it has no closed form."""
    return flights.first_hit(walls, None, r, v).time if _are_simple(walls) else 0.0


def _body_of(wall):
    return _body_of(wall.body) if isinstance(wall, Framed) else wall


def _are_simple(walls):
    """Whether straight flights to walls have hits in closed form: a constant for the compiler."""
    return not walls.fields() and not walls.unions and not walls.in_steps()


def with_sign(wall, sign):
    """Return a wall, seen from its other side where the sign is -1."""
    if isinstance(wall, Framed):
        return wall._replace(body=with_sign(wall.body, sign))
    if isinstance(wall, PlaneNumbers):
        return wall._replace(normal=sign * wall.normal, offset=sign * wall.offset)
    return wall._replace(side=sign * wall.side)


# A crossing speed below this part of the speed is round-off.
_GRAZING = 1e-9


def slowness(across, v):
    """1/(the speed across a counter) [s/m] of a particle with the velocity v."""
    speed = total(absolute(v))
    least = select(speed > 0.0, _GRAZING * speed, math.inf)
    return 1.0 / select(across > least, across, least)
