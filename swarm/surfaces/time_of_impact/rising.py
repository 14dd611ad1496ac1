"""Safe steps of one wall that moves: until when its level surely stays below 0.

In the frame of a wall the flight is a curve: its velocity w, acceleration a and jerk j have bounds W, A and J for any
time ahead. Let q be the inner function of the wall, with eigenvalues of H = grad grad q/2 of at most the magnitude m.
The level f along the flight has
    f' = grad q.w,   f''/2 = w.H w + grad q.a/2,   |f'''| <= 6 m W A + |grad q| J,
where the last holds if H is constant. A step ends where the parabola above f rises through 0. Near the hit each step
triples the digits, or doubles them where only f'' has a bound.
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

# The bounds of a step hold for at most this many times its length, after this many trials.
_CLOSE, _TRIALS = 2.0, 8


# --- The flight in the frame of a wall -------------------------------------------------------------------


class Flight(Record):
    """A free flight, and how much of the frame remains at its start [s]."""

    r: Vec
    v: Vec
    pull: Any  # G, or None: lanes would add zeros
    remaining: float
    speed: float  # |v|

    def place(self, t):
        """The place of the particle after a time."""
        return self.r + displacement(self.pull, self.v, t)

    def velocity(self, t):
        """The velocity of the particle after a time."""
        return accelerated(self.pull, self.v, t)

    def weight(self):
        """|G|, or None"""
        return None if self.pull is None else norm(self.pull)

    def fastest(self, t):
        """A bound of the speed up to a time."""
        return self.speed if self.pull is None else self.speed + t * norm(self.pull)

    def seen(self, t, wall, pull):
        """Return the particle at t as `InWallFrame` of a wall that is `Posed` then; `pull` acts on it, or None."""
        p, v = self.place(t), self.velocity(t)
        return InWallFrame(
            wall.drive, wall.own_place(p), wall.own_velocity(p, v),
            wall.own_pull(p, v, ZERO if pull is None else pull),
            self.fastest(t), wall.arm_length(p), self.weight(),
            total(absolute(p)) + total(absolute(wall.pose.shift)),
        )  # fmt: skip


class Jerk(Record):
    """The third derivative of a place in the frame of a wall for some time."""

    known: Any  # the part that is known, or None
    rest: float  # a bound of the part that is not known
    off: float  # after a time t the place differs from the cubic by off t^3/6 at most

    def along(self, normal):
        """The known part along a normal."""
        return 0.0 if self.known is None else dot(normal, self.known)


class InWallFrame(Record):
    """A particle in the frame of a wall at one time of its flight, and the bounds of its way from there."""

    drive: Any  # a `Drive`
    r: Vec
    v: Vec
    a: Vec
    speed: float  # a bound of |v| in the scene
    arm: float  # its distance from the centre of the rotation; 0 without a rotation
    weight: Any  # |G|, or None
    coordinates: float  # the scale of the round-off of its place [m]

    def fastest(self, within):
        """A bound of the speed up to `within` [s], relative to the centre of the rotation as the motion carries it."""
        own = self.speed if self.weight is None else self.speed + self.weight * within
        return own + self.drive.fastest

    def hardest(self):
        """A bound of the acceleration, relative to the same centre."""
        hardest = self.drive.hardest
        return hardest if self.weight is None else self.weight + hardest

    def bounds(self, within):
        """Return the `Bounds` that hold up to `within` [s]."""
        drive, spin = self.drive, self.drive.angular_speed()
        # Derivatives of A^T (r - c - d): each derivative of A^T adds a factor of the rate
        speed, hard = self.fastest(within), self.hardest()
        arm = self.arm + speed * within
        return Bounds(
            speed + spin * arm,
            hard + spin * (2.0 * speed + spin * arm),
            drive.jerk + spin * (3.0 * hard + spin * (3.0 * speed + spin * arm)),
        )

    def jerk(self, within):
        """Return the `Jerk` up to `within` [s]."""
        drive, turn = self.drive, self.drive.turn
        if turn is None:
            return Jerk(None, drive.jerk, drive.jerk)
        # Of x = r - c - d with the derivatives x1, x2, x3 it is A^T (x3 - 3 w x x2 + 3 w x (w x x1) + w^2 w x x).
        # All terms but the first are known now, and change as A^T turns by the rate once more.
        spin, spins = abs(turn.rate), turn.rate * turn.axis
        known = cross(spins, spin * spin * (self.r - drive.center) - 3.0 * (self.a + cross(spins, self.v)))
        speed = self.fastest(within)
        fourth = 6.0 * self.hardest() + spin * (4.0 * speed + spin * (self.arm + speed * within))
        grows = within * spin * (3.0 * drive.jerk + spin * fourth)
        # A jerk that grows as k t moves a place by k t^4/24.
        return Jerk(known, drive.jerk + grows, drive.jerk + 0.25 * grows)

    def place(self, t, jerk):
        """The place after a time, without the part of the jerk that is not known."""
        a = self.a if jerk.known is None else self.a + (t * (1.0 / 3.0)) * jerk.known
        return self.r + t * (self.v + (0.5 * t) * a)

    def pulls(self, within):
        """The `MostPull` along each axis that bounds the places up to `within` [s]."""
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
    """Return the flight of a particle; `speed` is that of v, if known."""
    pull = None if gravity is None else as_vector(gravity)
    return Flight(r, v, pull, remaining, norm(v) if speed is None else speed)


# --- The core, which a wall that moves never reaches -----------------------------------------------------

# Part of the size of a cavity: a computed depth below this part is a true depth in spite of round-off.
CORE = 1.0 - 1e-12


class Passage(Record):
    """When a straight flight enters and leaves the core, which the wall never reaches, and when it hits the mean wall.

    A flight that would leave the core before it enters it misses the core. The level may rise through 0 at most `once`:
    after that it is above 0 at all times, if the flight continues.
    """

    enters: float
    leaves: float
    hits: float
    once: Any

    def free(self):
        """The time until which no hit is possible; infinite where the level rises through 0 at most once, if ever."""
        return select(self.once, math.inf, select(self.enters <= 0.0, self.leaves, 0.0))


def passage_of(c, b, a, level, depth, swings):
    """Return the `Passage` of a flight along which q is c + 2 b t + a t^2, with a wall where q is `level`.

    The wall swings by s(t). q = |rho|^2, where `depth` times a length of the scene is a length of rho. With the
    velocity u in the frame of the middle and sums of all swings over |s|^2 + |s'|^2/w^2 = Q^2, the level f has
        f'/2 = (rho - s).(u - s') = rho.u - s.u - (rho - s).s',   |s.u + (rho - s).s'| <= sum Q sqrt(u^2 + L w^2),
        f''/2 = |u - s'|^2 - (rho - s).s'' >= u^2 - sum w Q sqrt(4 u^2 + L w^2),
    as |rho - s|^2 <= L until the wall is met. Where f'' > 0 the level rises through 0 once. So it does where |rho.u| is
    above the first bound at both ends of the core: f falls on the way there, and rises from there on.
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
    # A flight from beyond the mean wall that misses the core is short: a guess from beyond its end leads to it.
    out = _root(b * b - a * (c - select((c > level) & (in_core < 0.0), farthest * farthest, level)))
    # (sum Q x)^2 <= sum Q sum Q x^2
    is_convex = CORE * (a * a) > q1 * (4.0 * a * q1 + wide * q3)
    once = moves & (is_convex | ((width > 0.0) & (in_core > q0 * (a * q0 + wide * q2))))
    # Outwards from beyond the mean wall the hit is some time later; for a guess as much as the way back takes.
    hits = select(out > b, out - b, b) * inverse
    return Passage(middle - half, middle + half, select(moves, hits, math.inf), once)


# --- Levels with a known second derivative: below c + 2 b t + a t^2 + k t^3, with a bound k of f'''/6 -------


class Level(Majorant):
    """A level with a bound of its third derivative: f, f'/2, f''/2, |grad q| and m.

    A convex cavity is steepest on its wall: `steepness` is at least the value there, and does not grow.
    """

    c: float
    b: float
    a2: float
    steepness: float
    magnitude: float
    grows: Any = True

    def of_rows(self, given):
        """Return the level with its first three or four numbers replaced by the given ones."""
        return Level(*given, *self[len(given) :])

    def third(self, bounds, within):
        """The bound of f''' within that time."""
        moved = self.steepness
        if self.grows:
            moved = moved + 2.0 * self.magnitude * bounds.speed * within
        return 6.0 * self.magnitude * bounds.speed * bounds.acceleration + moved * bounds.jerk

    def own_rise(self):
        """The time when the level's own parabola rises."""
        return rise_time(self.c, self.b, self.a2)

    def ahead(self):
        """The level that may rise: this one."""
        return self

    def moved(self, way, meets):
        """The level's own parabola from a little later on, where it is 0 if the flight meets the wall."""
        here = self.a2 * way
        return self._replace(c=select(meets, 0.0, self.c + way * (2.0 * self.b + here)), b=self.b + here)

    def is_admissible(self):
        """Whether the level is not above 0 here."""
        return self.c <= 0.0

    def is_below(self, sixth, within, is_start):
        """Whether the level is surely not above 0 up to `within`, from a start on or back from an end."""
        slope = 2.0 * self.b if is_start else -2.0 * self.b
        return _highest(self.c, slope, self.a2, sixth, within, is_start) <= 0.0

    def soonest(self, sixth, within, is_first):
        """The soonest time when the level rises, if f'''/6 is at most `sixth` up to `within`.

        Only the parabola itself tells how deep a particle is that does not start at a wall.
        """
        return self.rises_after_leaving(sixth, within) if is_first else self.rises(sixth, within)


class Between(Record):
    """The levels of the two planes of a slab: the place between them in the direction of motion, f'/2 > 0 and f''/2."""

    place: float
    half: float
    bend: float
    radius: float

    def of_rows(self, given):
        """Return the levels with the given numbers instead, as `Level.of_rows`."""
        return self._replace(place=given[0], half=given[1], bend=given[2])

    steepness = 1.0

    def third(self, bounds, within):
        """The bound of f''' within that time."""
        return bounds.jerk

    def ahead(self):
        """The level of the plane ahead."""
        return Level(self.place - self.radius, self.half, self.bend, 1.0, 0.0)

    def moved(self, way, meets):
        """The levels a little later, as `Level.moved`."""
        here = self.bend * way
        place = select(meets, self.radius, self.place + way * (2.0 * self.half + here))
        return self._replace(place=place, half=self.half + here)

    def is_admissible(self):
        """Whether neither level is above 0 here."""
        return abs(self.place) <= self.radius

    def is_below(self, sixth, within, is_start):
        """Whether neither level is above 0 up to `within`, as `Level.is_below`."""
        slope = 2.0 * self.half if is_start else -2.0 * self.half
        ahead = _highest(self.place - self.radius, slope, self.bend, sixth, within, is_start)
        behind = _highest(-self.place - self.radius, -slope, -self.bend, sixth, within, is_start)
        return select(behind > ahead, behind, ahead) <= 0.0

    def own_rise(self):
        """The time when the parabola of one of the planes rises."""
        # The plane ahead; or the one behind, if the particle turns back before the plane ahead
        c, b, a = self.place - self.radius, self.half, self.bend
        discriminant = b * b - a * c
        reaches = (discriminant >= 0.0) | (a > 0.0)
        discriminant = select(reaches, discriminant, b * b - a * (self.place + self.radius))
        root = _root(discriminant)
        over, under = select(reaches, -c, b + root), select(reaches, b + root, -a)
        return select(under > 0.0, select(over > 0.0, over, 0.0) / under, math.inf)

    def soonest(self, sixth, within, is_first):
        """The soonest time when one of the levels rises, as `Level.soonest`."""
        b, k = self.half, sixth * within
        c, a = self.place - self.radius, self.bend + k
        discriminant = b * b - a * c
        root = _root(discriminant)
        reaches = ((discriminant >= 0.0) | (a > 0.0)) & (b + root > 0.0)
        ahead = select(reaches, select(c < 0.0, -c, 0.0) / (b + root), math.inf)
        # The plane behind: the particle moves away from it.
        c, a = -self.place - self.radius, k - self.bend
        behind = select(a > 0.0, (b + _root(b * b - a * c)) / a, math.inf)
        if is_first:
            leaving = rise_time(-2.0 * b, -0.5 * self.bend, sixth)
            behind = select(leaving > behind, leaving, behind)
        return select(behind < ahead, behind, ahead)


def nearest_root(c, b, a):
    """The time, ahead or back, to the nearest rise of c + 2 b t + a t^2 through 0; infinite unless it rises here."""
    bottom = b + _root(b * b - a * c)
    return select(b > 0.0, -c / select(b > 0.0, bottom, 1.0), math.inf)


def _highest(c, slope, a, sixth, within, is_start):
    """A bound of c + slope t + a t^2 + sixth t^3 up to `within`; at a start c > 0 is round-off."""
    # The factor of t in the brackets is convex, or grows: it is at most its value at one of its ends.
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
    """A level along a flight, and its bounds for some time ahead."""

    def rise(self, within):
        """The time when the level rises through 0, by bounds that hold up to `within`."""
        raise NotImplementedError

    def longest(self, longest):
        """Return the longest time, up to `longest`, in which the level surely does not rise."""
        time, within, too_long = 0.0, longest, longest
        for _k in range(_TRIALS):
            time = max(time, min(self.rise(within), within))
            # The bounds grow with the time that they hold for: those for a long time are useless for a short step.
            too_long = select(time < within, within, too_long)
            if not _CLOSE * time < too_long:
                break
            within = math.sqrt(time * too_long)
        return time


class SecondDerivativeBound(Ahead):
    """A level with a bound of its second derivative."""

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
    """A level with a bound of its third derivative."""

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
    """Return the `LevelStep` of a level with a bound of its third derivative; its time is at most `longest`."""
    return LevelStep(level.c, level.b, ThirdDerivativeBound(body, seen, level).longest(min(level.own_rise(), longest)))


def patch_step(wall, is_behind, edges, seen, longest):
    """Return the `LevelStep` of a part of a wall: until the wall is met and the place is between all edges of the part.

    A particle that came behind the wall beyond an edge meets the part only after it has come back: `is_behind`, and the
    wall is then given as seen from there. The edges are planes; their admissible side is beyond them.
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
    """Return the `LevelStep` of a plane with the unit normal n out of its admissible side and this level.

    Its bound holds for twice the time in which the parabola of the flight rises: near the plane the cube of the step
    remains.
    """
    half, bend = 0.5 * dot(n, seen.v), 0.5 * dot(n, seen.a)
    ahead = 2.0 * rise_time(level, half, bend)
    ahead = select(ahead < longest, ahead, longest)
    jerk = seen.jerk(ahead)
    sixth = (1.0 / 6.0) * (positive(jerk.along(n)) + jerk.off)
    time = rise_time(level, half, bend + sixth * ahead)
    return LevelStep(level, half, select(time < ahead, time, ahead))


def bent_step(body, seen, longest):
    """Return the `LevelStep` of a wall that bounds its bend."""
    n, level, most, magnitude, reach, clear = body.bent(seen.r)
    half = 0.5 * body.side * dot(n, seen.v)
    bent = SecondDerivativeBound(seen, level, half, norm(n), most, magnitude, reach, clear)
    return LevelStep(level, half, bent.longest(longest))


def bounds_along(n, seen, within):
    """Return the `Bounds` of a flight that meet a flat wall with this normal: only the jerk along the normal counts.

    Without any jerk along it, a particle that leaves the wall at no speed stays at it without end.
    """
    bounds, drive = seen.bounds(within), seen.drive
    if drive.turn is None:
        jerk = total(absolute(times(n, drive.jerks)))
    else:
        # A rotation leaves a place along its axis unchanged.
        axis = drive.turn.axis
        along = dot(n, axis)
        jerk = abs(along) * total(absolute(times(axis, drive.jerks))) + norm(n - along * axis) * bounds.jerk
    return bounds._replace(jerk=select(jerk < bounds.jerk, jerk, bounds.jerk))
