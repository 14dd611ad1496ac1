"""Coulomb's friction in the impacts of balls that turn.

n is the unit normal, and g the slip: the relative velocity across n of the surfaces at the point of contact. The
impulse of friction is against g. Its size is mu times the normal impulse, but at most the impulse that stops the slip,
m g/(1 + 1/q) with q = I/(m R^2) = 2/5, so 2/7 of m g. Here m is the reduced mass of two balls, or the mass of a ball at
a wall. The impulse turns both balls the same way, so that linear and angular momentum are conserved.

Source: O. R. Walton, in M. C. Roco (ed.), Particulate Two-Phase Flow (1993), chapter 25, without restitution of the
slip.
"""

import math
from typing import Any

from ...ball_numbers import INERTIA
from ...contact.reflection import given, relative, wall_velocity
from ...kernel.arrays import index
from ...kernel.jit import Array, outlined, select
from ...kernel.record import Record
from ...kernel.vector import ZERO, column, cross, dot, either, put, square

# The parts of a stopped slip that the velocity takes, and R times the spin: they add up to 1.
_STOP, _TURN = INERTIA / (1.0 + INERTIA), 1.0 / (1.0 + INERTIA)


class BallSpins(Record):
    """The spins of balls, and the friction of their collisions."""

    spin: Array  # (3, N) [rad/s]
    friction: Any  # the coefficient of friction of two balls; None for smooth collisions

    def at(self, i):
        """The spin of a ball."""
        return column(self.spin, 0, index(i))

    def add(self, i, change):
        """Change the spin of a ball; return twice the energy per mass and R^2 that it loses."""
        before = self.at(i)
        after = before + change
        put(self.spin, 0, index(i), after)
        return INERTIA * (square(before) - square(after))


def _across(a, n):
    return a - dot(a, n) * n


def _share(friction, impulse, slip):
    """The part of the slip that friction stops, from the normal impulse per mass."""
    speed, most = math.sqrt(square(slip)), friction * impulse
    return select(most >= _STOP * speed, 1.0, most / (_STOP * select(speed > 0.0, speed, 1.0)))


@outlined
def rub_pair(kinds, turning, pair, n, u, impulse):
    """Turn two balls by friction; return the change of their relative velocity u, and the energy lost [J].

    n is the unit normal from the first to the second of the `pair`; `impulse` is the normal impulse per reduced mass.
    """
    i, j = pair
    one, other = kinds.radius_of(i), kinds.radius_of(j)
    # A held ball does not turn: its stored spin is that with which it leaves.
    held, holds = kinds.is_held(i), kinds.is_held(j)
    spin, spins = either(held, ZERO, turning.at(i)), either(holds, ZERO, turning.at(j))
    slip = _across(u, n) - cross(one * spin + other * spins, n)
    share = _share(turning.friction, impulse, slip)
    change, twist = (-share * _STOP) * slip, (share * _TURN) * cross(n, slip)
    mass = kinds.mass_of(i) * kinds.share(i, j)
    taken = mass * (square(u) - square(u + change))
    turn, turns = (kinds.share(i, j) / one) * twist, (kinds.share(j, i) / other) * twist
    taken += kinds.mass_of(i) * one * one * turning.add(i, either(held, ZERO, turn))
    taken += kinds.mass_of(j) * other * other * turning.add(j, either(holds, ZERO, turns))
    return change, 0.5 * taken


@outlined
def rub_wall(laws, walls, wall, turning, ball, bounce):
    """Turn a ball by the friction of a wall; return the `Bounce`. `ball` is its number, its radius and its place."""
    i, radius, r = ball
    n = walls.unit_normal(wall, r)
    u = wall_velocity(laws.moving, walls, wall, r + radius * n)
    slip = _across(relative(u, bounce.v), n) + radius * cross(turning.at(i), n)
    share = _share(laws.friction_of(wall), bounce.impulse, slip)
    change = (-share * _STOP) * slip
    work, v = given(u, change), bounce.v + change
    more = square(v) - square(bounce.v)
    taken = radius * radius * turning.add(i, (-share * _TURN / radius) * cross(n, slip))
    return bounce._replace(
        v=v, twice_energy=bounce.twice_energy + more, work=bounce.work + work, lost=bounce.lost + taken - more + work
    )
