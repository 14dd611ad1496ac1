"""Impacts that follow each other too quickly to be resolved: grazing, rolling along a wall, resting, corners, cusps.

A sliding step of length h holds the particle on every wall it touches: with w0 = v0 + h G/2 and P the projection of
w0 on the directions that no touched wall forbids, r1 = r0 + h P and w1 = 2 P - w0. P and w0 - P are orthogonal
(Moreau), so |w1| = |w0|, and with one wall the step is the reflection about its discrete gradient.
"""

from typing import Any

import numpy as np

from ..kernel.arrays import scratch
from ..kernel.gravity import accelerated, potential
from ..kernel.jit import outlined
from ..kernel.limits import EPSILON
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, absolute, column, dot, largest, moves, norm, put, square, total
from ..surfaces.time_of_impact import flights
from . import reflection
from .laws import Laws
from .projection import ALLOWED, Touch, along, project, put_normals, velocity_along
from .reflection import from_relative, relative

# A second wall nearer than this fraction of the shortest flight is met at the same instant.
_SAME_INSTANT = 1e-6
# The most exact reflections within one instant: this number turns a particle around in the edge of a wedge of 0.05 rad.
_BLOWS = 64
# Sweeps until r1 and the discrete gradients agree: each gains the digits of h |v|/R.
_SWEEPS = 60
# The velocity of a particle along the normal of a moving wall may be wrong by this fraction of the wall's speed.
_OFF = 1e-13
# The most cuts of a step because another wall is in the way.
_CUTS = 60
# The functions of every wall that this module needs; exact reflections need no others.
NEEDS = ("first_hit", "unit_normal", "discrete_gradient", "distance", "project")


class ImpactSettings(Record):
    """The settings of an impact."""

    contact_step: Any  # None or h
    laws: Laws
    shortest: float  # the shortest flight: the particle slides instead of shorter ones [s]
    touch: float  # distance within which walls also hold a sliding particle [m]


class ParticleMoment(Record):
    """A particle at a moment, when `remaining` is left of the frame [s]."""

    r: Vec
    v: Vec
    remaining: Any


class Landing(Record):
    """A particle after its impact, the time it took, and twice its energy per mass."""

    r: Vec
    v: Vec
    used: float
    twice_energy: float


@outlined
def impact(method, walls, gravity, wall, flight, energy, impulse, lane):
    """Make one impact of one particle on `wall` after a short flight; return its `Landing`.

    Add to impulse[:, lane] the impulse of each wall and, if the array has rows for it, the work per mass of each
    behind them. If the flight after the impact would also be shorter than the shortest, the particle slides: for
    the shortest flight or, if it moves straight on, to the end of the frame.
    """
    r, v, half_inverse = flight.r, flight.v, energy.half_inverse
    carried, walls = walls, walls.at(flight.remaining)
    given, work = scratch(walls.length(), np.float64), scratch(walls.length(), np.float64)
    w, now, met = v, energy, wall
    for _blow in range(_BLOWS):
        bounce = reflection.exact(method.laws, walls, gravity, met, r, w, now)
        w, now = bounce.v, reflection.Energy(bounce.twice_energy, half_inverse)
        given[walls.row(met)] += bounce.impulse
        work[walls.row(met)] += 0.5 * bounce.work
        following = flights.first_hit(walls, gravity, r, w)
        if following.time >= method.shortest or following.wall < 0.0:
            row = walls.row(wall)
            end = reflection.Stepped(r, w, 0.0, given[row])
            if method.contact_step is not None and met == wall:
                end = reflection.contact(method.contact_step, walls, gravity, wall, r, v, flight.remaining, now)
                given[row] = end.impulse
            for i in range(given.size):
                impulse[i, lane] += given[i]
                if impulse.shape[0] > given.size:
                    impulse[given.size + i, lane] += work[i]
            return Landing(end.r, end.v, end.used, now.twice)
        if following.wall == met or following.time > _SAME_INSTANT * method.shortest:
            break
        met = following.wall
    return _slide(method, carried, gravity, wall, flight, energy, impulse, lane)


@outlined
def _slide(method, walls, gravity, wall, flight, energy, impulse, lane):
    """Make one sliding step; return the result of `impact`."""
    laws, r, moving = method.laws, flight.r, method.laws.moving
    carried, walls = walls, walls.at(flight.remaining)
    number = walls.numbers_near(r)
    count = number.size
    touched, depth = scratch(count, np.bool_), scratch(count, np.float64)
    _depths(walls, number, r, depth)
    for i in range(count):
        touched[i] = depth[i] >= -method.touch or number[i] == wall
    normal, active, given = scratch((3, count), np.float64), scratch(count, np.float64), scratch(count, np.float64)
    frame = None if moving is None else _frame_of(walls, number, touched, r)
    touch = Touch(number, touched, normal, active, depth, frame)
    v, twice_energy = _landed(laws, walls, touch, given, r, relative(frame, flight.v), energy.twice)
    straight = moving is None and _goes_straight(walls, gravity, touch, r, v)
    h = flight.remaining if straight else min(method.shortest, flight.remaining)
    u, h = _unhindered(walls, gravity, touch, r, v, h, method.touch)
    w = accelerated(gravity, 2.0 * u - accelerated(gravity, v, 0.5 * h), 0.5 * h)
    u = from_relative(frame, u)
    if moves(u):
        end = _end_of_step(carried, moving, wall, r, u, (flight.remaining, flight.remaining - h))
        r = _settled(carried.at(flight.remaining - h), wall, touch, end, method.touch)
    w = from_relative(frame, w)
    if moving is not None:
        # Walls do work.
        twice_energy = square(w) + 2.0 * potential(gravity, r)
    speed2, half_inverse = reflection.speed2_at(gravity, r, reflection.Energy(twice_energy, energy.half_inverse))
    half_inverse = reflection.half_inverse_after(laws, speed2, half_inverse)
    w = reflection.restore(w, speed2, half_inverse, reflection.may_lack_digits(laws, gravity))
    for i in range(count):
        taken = given[i] + 2.0 * touch.active[i]
        row, behind = walls.row(number[i]), walls.length()
        impulse[row, lane] += taken
        if moving is not None and impulse.shape[0] > behind:
            gained = -taken * column(normal, 0, i)
            impulse[behind + row, lane] += dot(gained, walls.velocity(number[i], flight.r))
    return Landing(r, w, h, twice_energy)


@outlined
def _frame_of(walls, number, touched, r):
    """Return a velocity with which all touched walls move along their normals."""
    u = _swept(walls, number, touched, r, ZERO)
    for i in range(touched.size):
        if touched[i]:
            v = walls.velocity(number[i], r)
            if abs(dot(v - u, walls.unit_normal(number[i], r))) > _OFF * norm(v):
                # In an obtuse edge each sweep gains little, but walls of one body have one velocity.
                return _swept(walls, number, touched, r, v)
    return u


@outlined
def _swept(walls, number, touched, r, u):
    """Return such a velocity near u: of one wall after the other, as in Kaczmarz' method."""
    for _sweep in range(_SWEEPS):
        for i in range(touched.size):
            if touched[i]:
                n = walls.unit_normal(number[i], r)
                u = u + dot(walls.velocity(number[i], r) - u, n) * n
    return u


@outlined
def _unhindered(walls, gravity, touch, r, v, h, near):
    """Return P of the longest step up to h without a further wall in its way, and the length of the step.

    A wall that is met within the distance `near` becomes one of the touched.
    """
    u = ZERO
    for cut in range(_CUTS):
        u = velocity_along(walls, touch, r, accelerated(gravity, v, 0.5 * h), h)
        # Until then only the near walls are met.
        alone = walls.until_others(r, from_relative(touch.frame, u))
        if alone < h:
            h = alone
            continue
        following, other = h, -1
        for i in range(touch.touched.size):
            if not touch.touched[i]:
                time, _found = flights.hit_of(walls, None, touch.number[i], r, from_relative(touch.frame, u))
                if time < following:
                    following, other = time, i
        if other < 0:
            # At the tip of a cone the discrete gradient turns round between two sweeps, so that u may lead through it.
            if touch.frame is not None or not _is_behind(walls, touch, r + h * u, near):
                break
            h = 0.5 * h
        elif following * norm(u) <= near:
            touch.touched[other] = True
        else:
            # The step to that wall is different, since its walls curve and gravity has less time.
            h = following if cut < _CUTS // 2 else 0.5 * following
    return u, h


def _is_behind(walls, touch, r, near):
    """Whether a step that ends at r leads through a touched wall, by more than the distance `near`."""
    for i in range(touch.touched.size):
        if touch.touched[i] and walls.distance(touch.number[i], r) > near + max(touch.depth[i], 0.0):
            return True
    return False


@outlined
def _end_of_step(walls, moving, wall, r, u, during):
    """Return the end of a step from r with the velocity u, straight in the frame of the wall.

    Straight in the scene, the step would leave a corner that turns by half its acceleration times h^2, which is beyond
    the edges of all facets there.
    """
    remaining, after = during
    h = remaining - after
    if moving is None:
        return r + h * u
    over = walls.during(remaining, after)
    return over.carry(wall, r + h * (u - walls.at(remaining).velocity(wall, r)))


@outlined
def _settled(walls, wall, touch, r, near):
    """Return the end of a step on the wall that holds the particle, and on every touched wall left by round-off.

    Round-off adds up step by step: 3e-13 of the size after 5e4 steps along an edge. Each wall once: a second time only
    for walls that the particle is outside of would lean inwards, and lower it by the last place again and again.
    """
    _depths(walls, touch.number, r, touch.depth)
    for i in range(touch.touched.size):
        holds = touch.number[i] == wall and touch.active[i] > 0.0
        if holds or (touch.touched[i] and touch.depth[i] > 0.0):
            r = walls.project(touch.number[i], r)
    if touch.frame is not None:
        # The particle leaves a moving wall by more than round-off; where another wall ends it meets only this one. A
        # wall that is not touched may have come nearer by its acceleration, which no straight path shows.
        _depths(walls, touch.number, r, touch.depth)
        for i in range(touch.touched.size):
            if touch.depth[i] > near:
                r = walls.project(touch.number[i], r)
    return r


@outlined
def inside(walls, r):
    """Return a point, no more than round-off outside of the walls, moved until it is not outside."""
    number = walls.numbers_near(r)
    outside = scratch(number.size, np.float64)
    for _sweep in range(_SWEEPS):
        _depths(walls, number, r, outside)
        i = np.argmax(outside)
        if outside[i] <= EPSILON * total(absolute(r)):
            break
        r = walls.project(number[i], r)
    return r


@outlined
def _depths(walls, number, r, into):
    """Write the signed distances outside of walls to `into`."""
    for i in range(number.size):
        into[i] = walls.distance(number[i], r)


@outlined
def _landed(laws, walls, touch, given, r, v, twice_energy):
    """End chattering: walls that lose energy take the rest of the velocity towards them.

    All together, by the projection: in an acute edge one wall after the other would take next to nothing, and the step
    would reflect the rest.
    """
    if not laws.change_energy:
        return v, twice_energy
    lossy = scratch(given.size, np.bool_)
    for i in range(given.size):
        lossy[i] = touch.touched[i] and 1.0 + laws.restitution_of(touch.number[i]) < 2.0
    put_normals(walls, touch, lossy, r, r)
    u = project(lossy, touch.normal, given, v)
    # |v|^2 - |u|^2, because v - u is orthogonal to u
    return u, twice_energy - square(v - u)


@outlined
def _goes_straight(walls, gravity, touch, r, v):
    """Whether the step may have any length: at rest, or in uniform motion along flat walls that carry the weight."""
    g = accelerated(gravity, ZERO, 1.0)
    put_normals(walls, touch, touch.touched, r, r)
    falling = project(touch.touched, touch.normal, touch.active, g)
    if largest(falling) > ALLOWED * largest(g):
        return False
    speed = largest(v)
    for i in range(touch.touched.size):
        if touch.touched[i] and abs(along(touch.normal, i, v)) > ALLOWED * speed:
            return False
    bent = 0
    for i in range(touch.touched.size):
        bent += touch.touched[i] and not walls.flat(touch.number[i])
    return speed == 0.0 or bent == 0


@outlined
def are_carried(walls, gravity, r, v, near, active):
    """Whether several walls within the distance `near` carry the weight of a particle at rest.

    `active` (2, walls) is set to the part of each wall, and to its part of the impulse per mass that stops v.
    """
    number = walls.numbers_near(r)
    count = number.size
    touched, depth = scratch(count, np.bool_), scratch(count, np.float64)
    normal, taken = scratch((3, count), np.float64), scratch(count, np.float64)
    _depths(walls, number, r, depth)
    several = 0
    for i in range(count):
        touched[i] = depth[i] >= -near
        several += touched[i]
        if touched[i]:
            put(normal, 0, i, walls.unit_normal(number[i], r))
    g = accelerated(gravity, ZERO, 1.0)
    # v as a sum over the normals: the part into the walls, then the part away from them, alternately.
    sign, rest = 1.0, v
    for _sweep in range(_SWEEPS):
        rest = sign * project(touched, normal, taken, sign * rest)
        for i in range(count):
            active[1, walls.row(number[i])] += sign * taken[i]
        sign = -sign
    falling = project(touched, normal, taken, g)
    for i in range(count):
        active[0, walls.row(number[i])] += taken[i]
    return several > 1 and moves(g) and largest(falling) <= ALLOWED * largest(g)
