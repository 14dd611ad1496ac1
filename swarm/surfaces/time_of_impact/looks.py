"""First hits with a wall that has bounds of half its level's second derivatives, the same everywhere.

Lanes look together; a single flight ends its looks when it can.
"""

import math
from typing import Any

from ...kernel.jit import select
from ...kernel.limits import EPSILON
from ...kernel.record import Record
from ...kernel.vector import Vec, absolute, dot, norm, square, total
from .course import positive, rise_time
from .march import LOOKS


class Looked(Record):
    """The state of the search for the first hit of a flight after its last look."""

    free: Any  # a time until which it surely meets nothing; the time of the hit once there are no more looks
    goes_on: Any  # whether there is a next look
    at: Any  # the time of the next look
    # The time of the last look (before the first look that of the next one), the level there and half its derivative
    before: Any
    level: Any
    half: Any


class LevelSeen(Record):
    """The result of a look: the level, half its derivative, and bounds of half its second derivative up to `until`."""

    place: Vec
    speed: Any
    level: Any
    half: Any
    least: Any
    most: Any
    until: Any
    # Whether the lowest parabola that the bounds allow rises through 0, if at all, before `until`
    rises: Any
    # Whether round-off decides if the flight, which leaves the wall, has left it
    lets_go: Any
    ends: Any  # whether a flight that is free until `until` is free for ever
    meets: Any = True  # whether the level that rises is that of the wall


class FlightByLooks(Record):
    """A flight that is searched by looks.

    A safe step ends where the highest parabola that the bounds allow rises through 0. Where even the lowest one does,
    the level rises all the way from the first root to there: it has no other root, and the root is proven to be the
    first. Looks then approach the root from both sides, by the cubic through the last two of them.
    """

    def first(self):
        """Return the `Looked` before the first look."""
        raise NotImplementedError

    def see(self, known):
        """Return the `LevelSeen` of the next look."""
        raise NotImplementedError

    def look(self, known):
        """Return the `Looked` after the next look."""
        here, t, is_first = self.see(known), known.at, known.at == known.before
        level, half, least, most = here.level, here.half, here.least, here.most
        # Past the root; or past the wall, by round-off or because the surface bends more than its bounds allow
        past = (level > 0.0) & (half > 0.0) & (not is_first)
        # Whether the lowest parabola rises through 0
        one_root = ((half > 0.0) | (least > 0.0)) & (half * half >= least * level) & here.rises
        bend = select(one_root | past, self._bend(known, here, is_first), most)
        bottom = half + math.sqrt(positive(half * half - bend * level))
        step = select(past, level / select(past, bottom, 1.0), rise_time(level, half, bend))
        beyond = not (t + step <= here.until)
        # Where there is one root, a look at the end tells whether the root is before the end.
        is_free = here.ends & (not past) & ((beyond & (not one_root)) | (t >= here.until) | (not step < math.inf))
        # After the step the level is at most (most - least) step^2 below 0, and its slope there at least this.
        way = select(is_free, 0.0, step)
        rising = half + way * select(past, -most, least)
        shortest = 2.0 * EPSILON * (total(absolute(here.place)) / select(here.speed > 0.0, here.speed, 1.0) + way)
        arrives = (not is_first) | (rising > 0.0) | (way == 0.0)
        arrives &= (way <= shortest) | ((most - least) * way * way <= 2.0 * shortest * rising)
        arrives &= (past | (not beyond)) & (not here.lets_go) & here.meets
        free, after = select(past, known.free, t), select(past, t - way, select(beyond, here.until, t + way))
        # A level that bends more than its bounds has its root anywhere between.
        after = select(past & (not after > free), 0.5 * (free + t), after)
        arrives |= past & (not after > free)
        goes_on = (not is_free) & (not arrives)
        found = select(is_free, math.inf, select(arrives, after, free))
        return Looked(found, goes_on, after, t, level, half)

    def _bend(self, known, here, is_first):
        """Return half the second derivative by the cubic through two looks; at the first the middle of its bounds."""
        since = select(is_first, 1.0, known.at - known.before)
        bend = (3.0 * (known.level - here.level) / since + 2.0 * known.half + 4.0 * here.half) / since
        bend = select(is_first, 0.5 * (here.least + here.most), bend)
        return select(bend > here.least, select(bend < here.most, bend, here.most), here.least)


class Straight(FlightByLooks):
    """A straight flight from its `start` to its end: its level's second derivative has the same bounds all the way."""

    surface: Any
    r: Vec
    v: Vec
    start: Any
    end: Any
    least: Any
    most: Any

    def constants(self):
        """Return the numbers of the flight that lanes keep."""
        return self.least, self.most, self.end

    def with_constants(self, least, most, end):
        """Return the same flight with the numbers that lanes keep."""
        return self._replace(least=least, most=most, end=end)

    def first(self):
        goes_on = (self.start <= self.end) & (square(self.v) > 0.0)
        return Looked(select(goes_on, self.start, math.inf), goes_on, self.start, self.start, 0.0, 0.0)

    def see(self, known):
        surface = self.surface
        p = self.r + known.at * self.v
        level = surface.side * surface.phi(p)
        half = 0.5 * surface.side * dot(surface.gradient(p), self.v)
        return LevelSeen(p, norm(self.v), level, half, self.least, self.most, self.end, True, False, True)


class FallByLooks(FlightByLooks):
    """A fall inside a wall where side H, H = grad grad phi/2, has eigenvalues from `least` to `most`.

    With w = v + G t, and g the level's part in grad phi.G, half the second derivative of the level after a time s is
        w.H w + g/2 + integral of G.H w,   H between m and M:   |G.(H - c) w| <= (M - m)/2 |G| |w|,   c = (m + M)/2,
    which is at most M |w|^2 + g/2 + c G.(w s + G s^2/2) + (M - m)/2 |G| |w| s, and at least this with m for M and a
    last term below 0. Where a flight just passes the wall, these bounds are so wide that each look only comes nearer by
    a part of the way. With K >= |third derivative of phi| half the second derivative is also, from its value now,
        within s (K |w|^3/2 + 3 max(|m|, |M|) |G| |w|),
    which is less in the end. A sight goes twice as far as the last step.
    """

    surface: Any
    r: Vec
    v: Vec
    pull: Vec
    least: Any
    most: Any
    window: Any  # the time of the first sight

    def constants(self):
        """Return the numbers of the fall that lanes keep."""
        return (self.window,)

    def with_constants(self, window):
        """Return the same fall with the numbers that lanes keep."""
        return self._replace(window=window)

    def first(self):
        return Looked(0.0, True, 0.0, 0.0, 0.0, 0.0)

    def see(self, known):
        surface, pull, t, is_first = self.surface, self.pull, known.at, known.at == known.before
        p, w = self.r + t * (self.v + (0.5 * t) * pull), self.v + t * pull
        n, side = surface.gradient(p), surface.side
        level, half = side * surface.phi(p), 0.5 * side * dot(n, w)
        past = (level > 0.0) & (half > 0.0) & (not is_first)
        speed, weight = norm(w), norm(pull)
        reach = self._within(p, speed, select(is_first, self.window, 2.0 * abs(t - known.before)))
        bent, along = 0.5 * side * dot(n, pull), select(past, -1.0, 1.0) * dot(pull, w)
        least, most = self._bounds(square(w), bent, along, speed, reach)
        here, room = surface.bent_along(p, w) + bent, self._room(speed + weight * reach, reach)
        least = select(here - room > least, here - room, least)
        most = select(here + room < most, here + room, most)
        # A fall that slides along leaves the wall where that bends neither towards it nor away, see `march.lets_go`.
        slack = 2.0 * EPSILON * total(absolute(p)) * norm(n)
        lets_go = (half < 0.0) & (level >= -slack) & (3.0 * half * half <= slack * most)
        level = select(lets_go & (level > -slack), -slack, level)
        rises = level + reach * (2.0 * half + reach * least) >= 0.0
        return LevelSeen(p, speed + weight * reach, level, half, least, most, t + reach, rises, lets_go, False)

    def _within(self, place, speed, reach):
        """Return the reach from a place, up to where the bounds hold."""
        return reach

    def _bounds(self, speed2, bent, along, speed, reach):
        """Return the bounds up to a reach for the derivative: for the level itself the later terms are smaller."""
        weight = norm(self.pull)
        middle, apart = 0.5 * (self.most + self.least), 0.5 * (self.most - self.least)
        sideways = apart * weight * (speed + weight * reach)
        rise, fall = (2.0 * self.most + middle) * along + sideways, (2.0 * self.least + middle) * along - sideways
        later, less = (self.most + 0.5 * middle) * weight * weight, (self.least + 0.5 * middle) * weight * weight
        half, third = 0.5 * reach, reach * reach * (1.0 / 3.0)
        most = self.most * speed2 + bent + half * positive(rise) + third * positive(later)
        least = self.least * speed2 + bent - half * positive(-fall) - third * positive(-less)
        return least, most

    def _room(self, speed, reach):
        """Return how far half the second derivative may move from its value now, as the derivative needs it."""
        largest = select(-self.least > self.most, -self.least, self.most)
        pulled = 3.0 * largest * norm(self.pull)
        return 0.5 * reach * speed * (0.5 * self.surface.bends.third * speed * speed + pulled)


class FallToBox(FallByLooks):
    """A fall at a solid in a box, with bounds that hold within a margin around the box.

    Beyond a face of the box there is no wall: a fall reaches the last of these faces by a parabola.
    """

    def see(self, known):
        here, t, surface = FallByLooks.see(self, known), known.at, self.surface
        face, beyond = surface.last_face(here.place, self.v + t * self.pull, self.pull)
        return here._replace(
            level=select(beyond, face.c, here.level),
            half=select(beyond, face.b, here.half),
            least=select(beyond, face.a2, here.least),
            most=select(beyond, face.a2, here.most),
            until=select(beyond, math.inf, here.until),
            rises=beyond | here.rises,
            lets_go=here.lets_go & (not beyond),
            ends=beyond,
            meets=not beyond,
        )

    def _within(self, place, speed, reach):
        longest = rise_time(-self.surface.known_around(place), 0.5 * speed, 0.5 * norm(self.pull))
        return select(reach < longest, reach, longest)


def falling(surface, pull, r, v):
    """Return the fall as its looks take it."""
    size = surface.size
    window = 2.0 * math.sqrt(size * size / (square(v) + size * norm(pull)))
    return surface.falls(surface, r, v, pull, surface.bends.least, surface.bends.most, window)


def first_found(flight, looks=LOOKS):
    """Return (when a flight meets the wall, whether it is a hit), by its looks."""
    known = flight.first()
    for _look in range(looks):
        if not known.goes_on:
            break
        known = flight.look(known)
    return known.free, not known.goes_on
