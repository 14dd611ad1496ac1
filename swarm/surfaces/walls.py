"""All walls of a scene in one record, and the methods of one wall by its number."""

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..kernel.arrays import scratch
from ..kernel.jit import is_alike, is_known, outlined, select
from ..kernel.record import Record
from ..kernel.vector import ZERO
from .presence.rooms import owner_of


class Field(Record):
    """Many walls of one kind, each of which has a number."""

    members: Any

    def grown(self, radius):
        """The walls that the centre of a ball meets."""
        return self._replace(members=self.members.grown(radius))

    def count(self):
        """Return the number of its walls."""
        return self.members.count()


class Listed(Field):
    """A field made of listed surfaces: each of its walls has a row of impulse and heat."""


class Following(Record):
    """A wall that moves with the wall before it, because both are of one surface."""

    body: Any

    def grown(self, radius):
        """Return the wall that the centre of a ball meets."""
        return self._replace(body=self.body.grown(radius))


def _with_number(every, number):
    """Return the `numbered` wall that has this number, or the last one, as a tuple of one."""
    for k, (first, wall) in enumerate(every):
        if number < first + wall.count() if isinstance(wall, Field) else number == first:
            return every[k : k + 1]
    return every[-1:]


def _alike(every):
    """Return the `numbered` walls in groups: consecutive walls of one kind."""
    found: tuple[Any, ...] = ()
    for one in every:
        joins = len(found) > 0 and not isinstance(one[1], Field) and is_alike(found[-1][-1][1], one[1])
        found = (*found[:-1], (*found[-1], one)) if joins else (*found, (one,))
    return found


class Touched(Record):
    """The first wall that a step is in contact with, or -1, and the number of walls in contact with it."""

    wall: float
    number: float


class Walls(Record):
    """The walls of a scene: its fields, of which `Listed` ones are last, then all other walls, those of unions last.

    Methods of one wall (`_ASKED`) are methods here too, with the number of the wall before the other arguments.
    """

    each: tuple[Any, ...]
    # For each union, for each of its rooms, for each wall of the room: 1/the steepness of its level. See rooms.py.
    unions: tuple[Any, ...] = ()
    slack: Any = None  # a distance that is round-off where rooms meet [m]
    inset: Any = None  # where rooms touch, the distance inside a wall at which a particle that meets it is placed [m]

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

    # Whether a wall has a motion that is not uniform, or a field moves.
    accelerate = False

    def grown(self, radius):
        """Return the walls that the centre of a ball of this radius meets."""
        return self._replace(each=tuple(wall.grown(radius) for wall in self.each))

    def foot(self, number, r, radius):
        """Return the point at which a ball centred at r touches a wall; `self` is the walls grown by its radius."""
        return r + radius * self.unit_normal(number, r)

    def at(self, remaining):
        """Return the walls when the time `remaining` of the frame is left [s]; if none moves, the same walls."""
        return self

    def during(self, remaining, after):
        """Return the walls over a step; at its start `remaining` is left of the frame [s], at its end `after`."""
        return self

    def in_steps(self):
        """Whether a straight flight to any wall takes steps in lanes: a constant for the compiler."""
        return any(wall.in_steps for wall in self.each)

    def are_polynomial(self):
        """Whether lanes keep the level along a straight flight to each of these walls."""
        return all(wall.kept > 0 for wall in self.each if wall.in_steps)

    def aim(self, gravity):
        """Whether safe steps to some of these walls along a flight begin with a guess of the root."""
        return any(wall.aims if gravity is None else wall.fall_powers > 0 for wall in self.each)

    def are_looked_at(self):
        """Whether lanes look at flights to some of these walls."""
        return any(wall.looked_at for wall in self.each)

    # --- Numbers and rows ---

    def numbered(self):
        """Return (number, wall) of each wall, and (number of its first wall, field) of each field."""
        found: tuple[Any, ...] = ()
        number = 0.0
        for wall in self.each:
            found = (*found, (number, wall))
            number = number + (wall.count() if isinstance(wall, Field) else 1.0)
        return found

    def total(self):
        """Return the number of walls, with all members of the fields."""
        return self.count_in_fields() + float(sum(not isinstance(wall, Field) for wall in self.each))

    def fields(self):
        """Return `numbered` of the fields."""
        return tuple((number, wall) for number, wall in self.numbered() if isinstance(wall, Field))

    def others(self):
        """Return the walls that are in no field."""
        return self._replace(each=tuple(wall for wall in self.each if not isinstance(wall, Field)))

    def alone(self, each):
        """Return a record with only the walls `each`, without unions."""
        return self._replace(each=each, unions=(), slack=None, inset=None)

    def shared(self):
        """Return `numbered` of the walls that are in no union: these hold for all particles."""
        every = self.numbered()
        return every[: len(every) - sum(len(room) for union in self.unions for room in union)]

    def joined(self):
        """Return the rooms of each union, and their walls: (number, wall, 1/the steepness of its level) each."""
        every = self.numbered()
        k = len(self.shared())
        found: tuple[Any, ...] = ()
        for union in self.unions:
            rooms: tuple[Any, ...] = ()
            for room in union:
                walls = zip(every[k : k + len(room)], room, strict=True)
                rooms = (*rooms, tuple((*one, gentle) for one, gentle in walls))
                k += len(room)
            found = (*found, rooms)
        return found

    def count_in_fields(self):
        """Return the number of walls of its fields."""
        return sum((wall.count() for wall in self.each if isinstance(wall, Field)), 0.0)

    def length(self):
        """Return the number of rows, one for a field: a constant for the compiler if none is `Listed`."""
        rows = 0
        for wall in self.each:
            rows += int(wall.count()) if isinstance(wall, Listed) else 1
        return rows

    def row(self, number):
        """Return the row of the impulse and heat of this wall; the members of a field share one."""
        stops = tuple(first + wall.count() for first, wall in self.fields() if not isinstance(wall, Listed))
        row = int(number - stops[-1]) + len(stops) if stops else int(number)
        for k, stop in reversed(tuple(enumerate(stops))):
            row = select(number < stop, k, row)
        return row

    # --- Near a point: walls of no field, members in the cell of the point, and walls of one room of each union ---

    def numbers_near(self, r):
        """Return the numbers of the walls near a point, in an array of the calling function."""
        near = len(self.shared()) - len(self.fields())
        for rooms in self.joined():
            near = self.count_in_owner(rooms, r) + near
        for _number, field in reversed(self.fields()):
            near = field.members.count_in_cell(r) + near
        number = scratch(near, np.float64)
        self._list_near(r, number)
        return number

    @outlined
    def _list_near(self, r, into):
        k = 0
        for number, field in self.fields():
            k += field.members.list_in_cell(k, number, r, into)
        before, alone = self.count_in_fields(), len(self.shared()) - len(self.fields())
        for i in range(alone):
            into[k + i] = before + i
        k += alone
        for rooms in self.joined():
            owner = owner_of(self, rooms, r)
            for i, room in enumerate(rooms):
                if i == owner:
                    for number, _wall, _gentle in room:
                        into[k] = number
                        k += 1

    @outlined
    def count_in_owner(self, rooms, r):
        """Return the number of walls of the room of a union to which a point belongs."""
        owner, count = owner_of(self, rooms, r), 0
        for i, room in enumerate(rooms):
            count = select(i == owner, len(room), count)
        return count

    @outlined
    def first_in_owner(self, rooms, r):
        """Return the number of the first wall of the room of a union to which a point belongs."""
        owner, first = owner_of(self, rooms, r), 0.0
        for i, room in enumerate(rooms):
            first = select(i == owner, room[0][0], first)
        return first

    def until_others(self, r, v):
        """Return the time from which on a straight flight may meet walls that are not near its start."""
        soonest = math.inf
        for _number, field in reversed(self.fields()):
            soonest = min(field.members.until_next_cell(r, v), soonest)
        return soonest

    # --- Of one wall ---

    def of(self, number, neutral, ask, *given):
        """Return ask(wall, *given) for the wall with this number.

        For any other number the result is that of the last wall; a caller without a wall ignores it. `neutral` is any
        value of the type of the result, for a scene without walls.
        """
        answer, every = None, self.numbered()
        # A number may be a constant of a kernel while the number of walls in a field before it is not.
        knows = is_known(number) and len(every) > 1 and is_known(every[-1][0])
        # Consecutive walls of one kind share one call, so that a kernel for many of them is little longer than for one.
        for alike in reversed(_alike(_with_number(every, number) if knows else every)):
            first, one = alike[-1]
            if isinstance(one, Field):
                one, here = one.members.wall(number - first), number < first + one.count()
            else:
                here = (number >= alike[0][0]) & (number <= first)
                for other, wall in reversed(alike[:-1]):
                    one = select(number == other, wall, one)
            value = ask(one, *given)
            answer = value if answer is None else select(here, value, answer)
        return neutral if answer is None else answer

    # --- Of all ---

    def shortest_time_scale(self):
        """Return the shortest `time_scale` of all walls [s]."""
        shortest = math.inf
        for wall in reversed(self.each):
            one = wall.members if isinstance(wall, Field) else wall
            shortest = min(one.time_scale(), shortest)
        return shortest

    def chord_sweeps(self):
        """Return the most steps of `chord_improve` that any wall takes: a constant for the compiler."""
        each = tuple(wall.members.like if isinstance(wall, Field) else wall for wall in self.each)
        return max((0, *(wall.chord_sweeps for wall in each)))

    def keeps(self, number, r):
        """Whether the wall with this number is present at a place at which a step along it ends."""
        found = True
        for first, field in self.fields():
            found = field.members.keeps(number - first, r) & found
        return found

    def outside(self, number, r):
        """Whether a point is outside any wall except this one (-1: outside any wall)."""
        found = False
        for first, wall in self.shared():
            if isinstance(wall, Field):
                found = wall.members.is_in_another(number - first, r) | found
            else:
                here = wall.level_of(wall.inner(r)) > 0.0
                found = (here & (number != first)) | found
        for rooms in self.joined():
            out_of_all = True
            for room in rooms:
                out = False
                for first, wall, _gentle in room:
                    out = ((wall.level_of(wall.inner(r)) > 0.0) & (number != first)) | out
                out_of_all = out & out_of_all
            found = out_of_all | found
        return found

    def pushes(self, number, kappa):
        """Whether this wall can push with kappa: in its direction and short of the pole."""
        found = False
        for k, wall in enumerate(self.each):
            farthest = wall.farthest_push()
            here = (kappa == 0.0) | ((kappa * farthest > 0.0) & (abs(kappa) < abs(farthest)))
            found = ((number == k) & here) | found
        return found

    def touched(self, r, p):
        """Return the walls that a step with free displacement p is in contact with."""
        found = Touched(-1.0, 0.0)
        for k, wall in reversed(tuple(enumerate(self.each))):
            before = wall.level_of(wall.inner(r))
            after = wall.level_of(wall.end_inner(r + p))
            contact = (before > 0.0) | (after > 0.0)
            found = Touched(select(contact, float(k), found.wall), found.number + select(contact, 1.0, 0.0))
        return found


# The methods of one wall by its number, and any value of the type of the result.
_ASKED = {
    **dict.fromkeys(("velocity", "acceleration", "carry", "mean_velocity", "displacement", "swept"), ZERO),
    **dict.fromkeys(("unit_normal", "project", "push", "discrete_gradient", "step_normal", "chord_normal"), ZERO),
    **dict.fromkeys(("distance", "outward_acceleration", "chord_guess", "chord_improve"), 0.0),
    "flat": False,
}


def _asked(name: str, neutral: Any) -> Any:
    def ask(wall, *given):
        answer = getattr(wall, name)
        return answer(*given) if callable(answer) else answer

    def asked(self, number, *given):
        return self.of(number, neutral, ask, *given)

    return asked


for _name, _neutral in _ASKED.items():
    setattr(Walls, _name, _asked(_name, _neutral))


def all_walls(surfaces: Iterable[Any]) -> Walls:
    """Return the walls of surfaces, in their order."""
    return Walls(tuple(wall for surface in surfaces for wall in surface.walls()))


def penetration(walls, r):
    """Return the largest distance outside, max(g, 0)/|grad g|, over all walls."""
    deepest = 0.0
    for _number, wall in reversed(walls.shared()):
        distance = wall.members.deepest_in_cell(r) if isinstance(wall, Field) else wall.distance(r)
        deepest = select(distance > deepest, distance, deepest)
    for rooms in walls.joined():
        distance = _out_of_all(rooms, r)
        deepest = select(distance > deepest, distance, deepest)
    return deepest


def _out_of_all(rooms, r):
    """Return the distance outside of the nearest room of a union."""
    least = math.inf
    for room in rooms:
        farthest = 0.0
        for _number, wall, _gentle in room:
            distance = wall.distance(r)
            farthest = select(distance > farthest, distance, farthest)
        least = select(farthest < least, farthest, least)
    return least
