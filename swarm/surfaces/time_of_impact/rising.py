"""Until when the level of a wall that moves surely stays below 0: safe steps of one wall.

In the frame of a wall the flight is a curve: its velocity w, acceleration a and jerk j have bounds W, A and J for any
time ahead. Along it the level f of a wall with the inner function q, where H = grad grad q/2 has eigenvalues of at most
the magnitude m, has
    f' = grad q.w,   f''/2 = w.H w + grad q.a/2,   |f'''| <= 6 m W A + |grad q| J,
the last where H is constant. A step ends where the parabola above f rises through 0; near the hit each one triples the
digits, or doubles them where only f'' has a bound.
"""

import math
from typing import Any

from ...kernel.gravity import Bounds as Bounds
from ...kernel.gravity import accelerated, as_vector, displacement
from ...kernel.grid import MostPull
from ...kernel.jit import select
from ...kernel.record import Record
from ...kernel.vector import ZERO, Vec, absolute, cross, dot, norm, times, total
from .course import Majorant, positive, rise_time

# The bounds of a step hold for at most so many times its length, after so many trials.
_CLOSE, _TRIALS = 2.0, 8


# --- The flight in the frame of a wall -------------------------------------------------------------------


class Flight(Record):
    """A free flight, and how much of the frame is left at its start [s]."""

    r: Vec
    v: Vec
    pull: Any  # G, or None: lanes would add zeros
    remaining: float
    speed: float  # |v|

    def place(self, t):
        """The place of the particle after a time."""
        return self.r + displacement(self.pull, self.v, t)

    def velocity(self, t):
        """Its velocity then."""
        return accelerated(self.pull, self.v, t)

    def weight(self):
        """|G|, or None"""
        return None if self.pull is None else norm(self.pull)

    def fastest(self, t):
        """A bound of its speed until then."""
        return self.speed if self.pull is None else self.speed + t * norm(self.pull)

    def seen(self, t, wall, pull):
        """The particle after a time as `InWallFrame` in the frame of a wall `Posed` then; this pulls it, or None."""
        p, v = self.place(t), self.velocity(t)
        return InWallFrame(
            wall.drive, wall.own_place(p), wall.own_velocity(p, v),
            wall.own_pull(p, v, ZERO if pull is None else pull),
            self.fastest(t), wall.arm_length(p), self.weight(),
            total(absolute(p)) + total(absolute(wall.pose.shift)),
        )  # fmt: skip


class Jerk(Record):
    """The third derivative of a place in the frame of a wall for some time."""

    known: Any  # what is known of it, or None
    rest: float  # a bound of what it may be beside that
    off: float  # after a time t the place is beside the cubic by off t^3/6 at most

    def along(self, normal):
        """What is known of it along a normal."""
        return 0.0 if self.known is None else dot(normal, self.known)


class InWallFrame(Record):
    """A particle in the frame of a wall at one time of its flight, and what bounds its way from there."""

    drive: Any  # a `Drive`
    r: Vec
    v: Vec
    a: Vec
    speed: float  # a bound of |v| in the scene
    arm: float  # its distance from the centre of the rotation; 0 without a rotation
    weight: Any  # |G|, or None
    coordinates: float  # what the round-off of its place is relative to [m]

    def fastest(self, within):
        """A bound of its speed for so long [s], relative to where the motion carries the centre of the rotation."""
        own = self.speed if self.weight is None else self.speed + self.weight * within
        return own + self.drive.fastest

    def hardest(self):
        """That of its acceleration."""
        hardest = self.drive.hardest
        return hardest if self.weight is None else self.weight + hardest

    def bounds(self, within):
        """`Bounds` that hold for so long [s]."""
        drive, spin = self.drive, self.drive.angular_speed()
        # Derivatives of A^T (r - c - d), where each of A^T turns by the rate once more
        speed, hard = self.fastest(within), self.hardest()
        arm = self.arm + speed * within
        return Bounds(
            speed + spin * arm,
            hard + spin * (2.0 * speed + spin * arm),
            drive.jerk + spin * (3.0 * hard + spin * (3.0 * speed + spin * arm)),
        )

    def jerk(self, within):
        """Its `Jerk` for so long [s]."""
        drive, turn = self.drive, self.drive.turn
        if turn is None:
            return Jerk(None, drive.jerk, drive.jerk)
        # Of x = r - c - d with the derivatives x1, x2, x3 it is A^T (x3 - 3 w x x2 + 3 w x (w x x1) + w^2 w x x).
        # All but the first is known now, and changes as A^T turns by the rate once more.
        spin, spins = abs(turn.rate), turn.rate * turn.axis
        known = cross(spins, spin * spin * (self.r - drive.center) - 3.0 * (self.a + cross(spins, self.v)))
        speed = self.fastest(within)
        fourth = 6.0 * self.hardest() + spin * (4.0 * speed + spin * (self.arm + speed * within))
        grows = within * spin * (3.0 * drive.jerk + spin * fourth)
        # What grows as k t moves a place by k t^4/24.
        return Jerk(known, drive.jerk + grows, drive.jerk + 0.25 * grows)

    def place(self, t, jerk):
        """Its place after a time, but for the rest of its `Jerk`."""
        a = self.a if jerk.known is None else self.a + (t * (1.0 / 3.0)) * jerk.known
        return self.r + t * (self.v + (0.5 * t) * a)

    def pulls(self, within):
        """The `MostPull` along each axis that bounds its places for so long [s]."""
        most, jerk = self.bounds(within).acceleration, self.jerk(within)
        x, y, z = (0.0, 0.0, 0.0) if jerk.known is None else jerk.known
        ahead = Vec(*(jerk.off + positive(along) for along in (x, y, z)))
        back = Vec(*(jerk.off + positive(-along) for along in (x, y, z)))
        # x <= v t + a t^2/2 + J t^3/6
        return tuple(
            MostPull(min(a + up * within * (1.0 / 3.0), most), min(down * within * (1.0 / 3.0) - a, most))
            for a, up, down in zip(self.a, ahead, back, strict=True)
        )


def flight_of(r, v, gravity, remaining, speed=None):
    """The flight of a particle, and its speed where that is known."""
    pull = None if gravity is None else as_vector(gravity)
    return Flight(r, v, pull, remaining, norm(v) if speed is None else speed)


# --- What walls that move never reach --------------------------------------------------------------------

# Of the size of a cavity: what is computed to be so deep is as deep as it is to be.
CORE = 1.0 - 1e-12


class Passage(Record):
    """When a straight flight enters what a wall never reaches, and leaves it, and when it meets the wall on average.

    It misses it if it does not enter it before it leaves it. The level may rise through 0 at most `once`: after that
    it is above 0 at all times, if the flight goes on.
    """

    enters: float
    leaves: float
    hits: float
    once: Any

    def free(self):
        """Until when no hit is possible; infinite where the level rises through 0 at most once, whenever that is."""
        return select(self.once, math.inf, select(self.enters <= 0.0, self.leaves, 0.0))


def passage_of(c, b, a, level, depth, swings):
    """The `Passage` of a flight along which q is c + 2 b t + a t^2, of a wall where it is `level`.

    The wall swings by s(t), and q = |rho|^2 in lengths of which swings have `depth` to one of the scene. With the
    velocity u in the frame of the middle and sums of all swings over |s|^2 + |s'|^2/w^2 = Q^2, the level f has
        f'/2 = (rho - s).(u - s') = rho.u - s.u - (rho - s).s',   |s.u + (rho - s).s'| <= sum Q sqrt(u^2 + L w^2),
        f''/2 = |u - s'|^2 - (rho - s).s'' >= u^2 - sum w Q sqrt(4 u^2 + L w^2),
    as |rho - s|^2 <= L until the wall is met. Where f'' > 0 it rises through 0 once. So it does where |rho.u| is above
    the first bound at both ends of the core: f falls on the way there, and rises from there on.
    """
    moves, wide = a > 0.0, select(level > 0.0, level, 0.0)
    radius, amplitude = math.sqrt(wide), depth * swings.amplitude()
    width, farthest = CORE * radius - amplitude, radius + amplitude
    width = select(width > 0.0, width, 0.0)
    q0, q1, q2, q3 = swings.moments()
    q0, q1, q2, q3 = depth * q0, depth * q1, depth * q2, depth * q3
    inverse = select(moves, 1.0 / select(moves, a, 1.0), 0.0)
    middle, in_core = -b * inverse, b * b - a * (c - width * width)
    half = _root(in_core) * inverse
    # A flight from beyond the mean wall that misses the core is short: from beyond its end the guess gets there.
    out = _root(b * b - a * (c - select((c > level) & (in_core < 0.0), farthest * farthest, level)))
    # (sum Q x)^2 <= sum Q sum Q x^2
    is_convex = CORE * (a * a) > q1 * (4.0 * a * q1 + wide * q3)
    once = moves & (is_convex | ((width > 0.0) & (in_core > q0 * (a * q0 + wide * q2))))
    # Outwards from beyond the mean wall it is met some time later: as for the way back, for a guess.
    hits = select(out > b, out - b, b) * inverse
    return Passage(middle - half, middle + half, select(moves, hits, math.inf), once)


# --- Levels with a known second derivative: below c + 2 b t + a t^2 + k t^3, with a bound k of f'''/6 -------


class Level(Majorant):
    """A level with a bound of its third derivative: f, f'/2, f''/2, |grad q| and m.

    A convex cavity has a steepest place, on its wall: `steepness` is nowhere less than there, and does not grow.
    """

    c: float
    b: float
    a2: float
    steepness: float
    magnitude: float
    grows: Any = True

    def of_rows(self, given):
        """The level with the first of its numbers given: three, or four."""
        return Level(*given, *self[len(given) :])

    def third(self, bounds, within):
        """The bound of f''' within that time."""
        moved = self.steepness
        if self.grows:
            moved = moved + 2.0 * self.magnitude * bounds.speed * within
        return 6.0 * self.magnitude * bounds.speed * bounds.acceleration + moved * bounds.jerk

    def own_rise(self):
        """When its own parabola rises."""
        return rise_time(self.c, self.b, self.a2)

    def ahead(self):
        """The level that may rise."""
        return self

    def moved(self, way, meets):
        """Its own parabola from a little later on, where it is 0 if it meets the wall."""
        here = self.a2 * way
        return self._replace(c=select(meets, 0.0, self.c + way * (2.0 * self.b + here)), b=self.b + here)

    def is_admissible(self):
        """Whether it is not above 0 here."""
        return self.c <= 0.0

    def is_below(self, sixth, within, is_start):
        """Whether it is surely not above 0 for so long, from a start on or back from an end."""
        slope = 2.0 * self.b if is_start else -2.0 * self.b
        return _highest(self.c, slope, self.a2, sixth, within, is_start) <= 0.0

    def soonest(self, sixth, within, is_first):
        """When it rises at the soonest, if a sixth of f''' is bounded within that time.

        How deep a particle is that leaves no wall, the parabola alone knows.
        """
        return self.rises_after_leaving(sixth, within) if is_first else self.rises(sixth, within)


class Between(Record):
    """The levels of the two planes of a slab: the place between them in the direction of motion, f'/2 > 0 and f''/2."""

    place: float
    half: float
    bend: float
    radius: float

    def of_rows(self, given):
        """As of a `Level`."""
        return self._replace(place=given[0], half=given[1], bend=given[2])

    steepness = 1.0

    def third(self, bounds, within):
        """The bound of f''' within that time."""
        return bounds.jerk

    def ahead(self):
        """That of the plane ahead."""
        return Level(self.place - self.radius, self.half, self.bend, 1.0, 0.0)

    def moved(self, way, meets):
        """As of a `Level`."""
        here = self.bend * way
        place = select(meets, self.radius, self.place + way * (2.0 * self.half + here))
        return self._replace(place=place, half=self.half + here)

    def is_admissible(self):
        """As of a `Level`."""
        return abs(self.place) <= self.radius

    def is_below(self, sixth, within, is_start):
        """As of a `Level`."""
        slope = 2.0 * self.half if is_start else -2.0 * self.half
        ahead = _highest(self.place - self.radius, slope, self.bend, sixth, within, is_start)
        behind = _highest(-self.place - self.radius, -slope, -self.bend, sixth, within, is_start)
        return select(behind > ahead, behind, ahead) <= 0.0

    def own_rise(self):
        """When the parabola of one of them rises."""
        # The plane ahead, unless the particle turns short of it: then the one behind
        c, b, a = self.place - self.radius, self.half, self.bend
        discriminant = b * b - a * c
        reaches = (discriminant >= 0.0) | (a > 0.0)
        discriminant = select(reaches, discriminant, b * b - a * (self.place + self.radius))
        root = _root(discriminant)
        over, under = select(reaches, -c, b + root), select(reaches, b + root, -a)
        return select(under > 0.0, select(over > 0.0, over, 0.0) / under, math.inf)

    def soonest(self, sixth, within, is_first):
        """When one of them rises at the soonest, as of a `Level`."""
        b, k = self.half, sixth * within
        c, a = self.place - self.radius, self.bend + k
        discriminant = b * b - a * c
        root = _root(discriminant)
        reaches = ((discriminant >= 0.0) | (a > 0.0)) & (b + root > 0.0)
        ahead = select(reaches, select(c < 0.0, -c, 0.0) / (b + root), math.inf)
        # The one behind: the particle moves away from it.
        c, a = -self.place - self.radius, k - self.bend
        behind = select(a > 0.0, (b + _root(b * b - a * c)) / a, math.inf)
        if is_first:
            leaving = rise_time(-2.0 * b, -0.5 * self.bend, sixth)
            behind = select(leaving > behind, leaving, behind)
        return select(behind < ahead, behind, ahead)


def nearest_root(c, b, a):
    """How far ahead, or back, c + 2 b t + a t^2 rises through 0 next to here; infinite if it does not rise here."""
    bottom = b + _root(b * b - a * c)
    return select(b > 0.0, -c / select(b > 0.0, bottom, 1.0), math.inf)


def _highest(c, slope, a, sixth, within, is_start):
    """A bound of c + slope t + a t^2 + sixth t^3 for so long; at a start c > 0 is round-off."""
    # The bracket of what t is a factor of is convex, or grows: it is at most what it is at one of its ends.
    last = slope + within * (a + within * sixth)
    steepest = select(last > slope, last, slope)
    c = select(c > 0.0, 0.0, c) if is_start else c
    return c + within * select(steepest > 0.0, steepest, 0.0)


def _root(discriminant):
    return math.sqrt(select(discriminant > 0.0, discriminant, 0.0))


# --- Steps -----------------------------------------------------------------------------------------------


class LevelStep(Record):
    """The level, half its derivative, and a time during which the flight stays admissible."""

    level: float
    half: float
    time: float


class Ahead(Record):
    """A level along a flight, and what bounds it for some time ahead."""

    def rise(self, within):
        """When it rises through 0, with bounds that hold for so long."""
        raise NotImplementedError

    def longest(self, longest):
        """The longest time, of at most this one, in which the level surely does not rise."""
        time, within, too_long = 0.0, longest, longest
        for _k in range(_TRIALS):
            time = max(time, min(self.rise(within), within))
            # The bounds grow with the time that they hold for: those of a long time say little of a short step.
            too_long = select(time < within, within, too_long)
            if not _CLOSE * time < too_long:
                break
            within = math.sqrt(time * too_long)
        return time


class SecondDerivativeBound(Ahead):
    """Of a level with a bound of its second derivative."""

    seen: InWallFrame
    level: float
    half: float
    steepness: float
    most: float
    magnitude: float
    reach: float
    clear: float

    def rise(self, within):
        bounds = self.seen.bounds(within)
        speed = bounds.speed
        # f''/2 <= w.H w + |grad q| A/2, where grad q turns by 2 m W t at most
        bend = max(self.most, 0.0) * speed * speed
        bend += 0.5 * bounds.acceleration * (self.steepness + 2.0 * self.magnitude * speed * within)
        some = select(speed > 0.0, speed, 1.0)
        step = min(rise_time(self.level, self.half, bend), select(speed > 0.0, self.reach / some, math.inf))
        return max(step, self.clear / some)


class ThirdDerivativeBound(Ahead):
    """Of a level with one of its third derivative."""

    body: Any
    seen: InWallFrame
    level: Any  # `Level` or `Between`

    def third(self, within):
        """The bound of f''' within that time."""
        return self.level.third(self.body.bounds_along(self.seen, within), within)

    def rise(self, within):
        here = self.level
        return rise_time(here.c, here.b, here.a2 + self.third(within) * within * (1.0 / 6.0))


def level_step(body, seen, level, longest):
    """The `LevelStep` of a level with a bound of its third derivative; its time is at most the longest."""
    return LevelStep(level.c, level.b, ThirdDerivativeBound(body, seen, level).longest(min(level.own_rise(), longest)))


def patch_step(wall, is_behind, edges, seen, longest):
    """The `LevelStep` of a part of a wall, until the wall is met and until the place is between all edges of the part.

    From behind the wall, where a particle has come to beyond an edge, it meets the part only after it has come back.
    The wall is then given as seen from there; the edges are planes; their admissible side is beyond them.
    """
    step, is_there = level_step(wall, seen, wall.level_along(seen), longest), not is_behind
    time = step.time
    for edge in edges:
        level = edge.level_along(seen)
        if level.c < 0.0:
            is_there = False
            if time < longest:
                time = max(level_step(edge, seen, level, longest).time, time)
    return LevelStep(select(is_there, step.level, 0.0), select(is_there, step.half, 0.0), time)


def plane_step(level, n, seen, longest):
    """The `LevelStep` of a plane across the unit normal n, out of its admissible side, at which there is such a level.

    Its bound holds for twice the time in which the parabola of the flight rises: near the plane it leaves the cube of
    the step.
    """
    half, bend = 0.5 * dot(n, seen.v), 0.5 * dot(n, seen.a)
    ahead = 2.0 * rise_time(level, half, bend)
    ahead = select(ahead < longest, ahead, longest)
    jerk = seen.jerk(ahead)
    sixth = (1.0 / 6.0) * (positive(jerk.along(n)) + jerk.off)
    time = rise_time(level, half, bend + sixth * ahead)
    return LevelStep(level, half, select(time < ahead, time, ahead))


def bent_step(body, seen, longest):
    """The `LevelStep` of a wall that bounds its bend."""
    n, level, most, magnitude, reach, clear = body.bent(seen.r)
    half = 0.5 * body.side * dot(n, seen.v)
    bent = SecondDerivativeBound(seen, level, half, norm(n), most, magnitude, reach, clear)
    return LevelStep(level, half, bent.longest(longest))


def bounds_along(n, seen, within):
    """`Bounds` of a flight that a flat wall with this normal sees: only the jerk along that counts.

    Where a motion has none of it, a particle that leaves the wall at no speed stays at it without end.
    """
    bounds, drive = seen.bounds(within), seen.drive
    if drive.turn is None:
        jerk = total(absolute(times(n, drive.jerks)))
    else:
        # Along its axis a rotation leaves a place as it is.
        axis = drive.turn.axis
        along = dot(n, axis)
        jerk = abs(along) * total(absolute(times(axis, drive.jerks))) + norm(n - along * axis) * bounds.jerk
    return bounds._replace(jerk=select(jerk < bounds.jerk, jerk, bounds.jerk))
