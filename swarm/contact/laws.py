"""The laws of walls: restitution, Coulomb's friction, thermal walls, `laws` of surfaces.

None stands for a law that no wall has.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from ..errors import SceneError
from ..kernel.jit import select
from ..kernel.record import Record
from ..kernel.vector import dot, square
from ..surfaces.shapes.slab import AXES
from ..surfaces.wall_law import leave_of, lets_wait, may_end, mirrored, tries_of

# A squared speed into the wall counts as 0 up to this fraction of the squared speeds before and after the law, relative
# to the wall and in the frame of the scene: a law adds the velocity of the wall to one that may be far smaller.
_ROUND_OFF = 1e-30
# A relative change of |v|^2 by a law that is round-off of |v|^2 or of the normal.
KEPT = 1e-12


class Laws(Record):
    """The effects of impacts on a particle besides the reflection."""

    restitution: Any  # None, or e of each wall
    friction: Any  # None, or mu of each wall
    thermal: Any  # None, or `Thermal` of each wall
    moving: Any  # None, or `Moves` if a wall moves
    own: Any = None  # None, or `Owned` of the surfaces that have `laws`
    across: Any = None  # None, or the axis across the plane in which all particles stay

    @property
    def loses(self):
        """Whether an impact may turn energy into heat: a constant for the compiler."""
        return self.restitution is not None or self.friction is not None

    @property
    def change_energy(self):
        """Whether an impact may change the energy of a particle: a constant for the compiler."""
        return self.loses or self.send_off or self.moving is not None

    @property
    def send_off(self):
        """Whether walls may send particles off by a temperature or a user-defined law: a constant for the compiler."""
        return self.thermal is not None or self.own is not None

    @property
    def may_dissipate(self):
        """Whether such a law may dissipate a part of the energy that it changes: a constant for the compiler."""
        return any(law.book == "dissipated" for one in self.own or () for some in one.each for law in some.laws)

    @property
    def dissipate_all(self):
        """Whether such laws dissipate all energy that they change: a constant for the compiler."""
        return self.own is not None and self.thermal is None and all(one.dissipates for one in self.own)

    @property
    def give_heat(self):
        """Whether a part of this energy may be heat: a constant for the compiler."""
        return self.send_off and not self.dissipate_all

    def keep_speed(self):
        """Whether every impact keeps the speed relative to its wall, in the trials of the laws."""
        own = [law for one in self.own or () for some in one.each for law in some.laws]
        return not self.loses and self.thermal is None and all(map(_keeps_speed, own))

    @property
    def may_end(self):
        """Whether one of the `laws` of surfaces may absorb a particle, or let it wait."""
        return any(may_end(law) for one in self.own or () for some in one.each for law in some.laws)

    @property
    def may_wait(self):
        """Whether a law of a wall lets particles wait in a trial."""
        return any(lets_wait(law) for one in self.own or () for some in one.each for law in some.laws)

    def in_plane(self, across):
        """Return these laws in a scene with a plane across the axis of this number, or without a plane for None."""
        return self if across is None or not self.send_off else self._replace(across=AXES[across](1.0))

    def restitution_of(self, wall):
        """Return e of a wall."""
        return of_wall(self.restitution, wall, 1.0)

    def friction_of(self, wall):
        """Return mu of a wall."""
        return of_wall(self.friction, wall)

    def thermal_of(self, wall):
        """Return the `Thermal` of a wall."""
        return of_wall(self.thermal, wall, Thermal(0.0, 0.0))


# The laws of rigid elastic walls at rest.
NONE = Laws(None, None, None, None)


class Span(Record):
    """One value of a law for `walls` walls in a row."""

    value: Any
    walls: float


class Some(Record):
    """The laws of the walls from number `first` to before number `after`."""

    laws: Any
    first: float
    after: float

    def has(self, wall):
        """Whether a wall is one of these."""
        return (wall >= self.first) & (wall < self.after)


class Owned(Record):
    """The laws of walls with lists of laws that differ only in their numbers."""

    each: Any

    def has(self, wall):
        """Whether a wall is one of these."""
        found = False
        for one in self.each:
            found = one.has(wall) | found
        return found

    @property
    def dissipates(self):
        """Whether these laws dissipate all energy that they change: a constant for the compiler."""
        return all(law.book == "dissipated" for law in self.each[0].laws)

    def laws_of(self, wall):
        """Return the laws of a wall, in their order."""
        found = self.each[-1].laws
        for one in reversed(self.each[:-1]):
            found = select(one.has(wall), one.laws, found)
        return found

    def leave(self, wall, v, n, u, random, mass):
        """Return `Ended` after all laws: each law acts on the mirrored velocity of the law before it."""
        stays, wait, lost, is_right = True, 0.0, 0.0, True
        first, heat = square(v - u), 0.0
        for k, law in enumerate(self.laws_of(wall)):
            v = v if k == 0 else mirrored(v, n, u)
            left = leave_of(law.leave(v, n, u, random.of_law(k), mass))
            before, after = v - u, left.v - u
            stays = left.stays if k == 0 else left.stays & stays
            wait = left.wait if k == 0 else left.wait + wait
            if law.book == "dissipated":
                lost = square(before) - square(after) + lost
            else:
                heat = abs(square(before) - square(after)) + heat
            # False for NaN.
            away, speed2 = dot(after, n), square(before) + square(after) + square(left.v) + square(u)
            is_right = (((away >= 0.0) | (away * away <= _ROUND_OFF * speed2)) & (speed2 < math.inf)) & is_right
            v = left.v
        if any(law.book == "dissipated" for law in self.each[0].laws):
            # The change by the other laws is round-off: then all of it is lost.
            lost = select(heat <= KEPT * first, math.inf, lost)
        return Ended(v, stays, wait, lost, is_right & (wait >= 0.0))


class Ended(Record):
    """The end of an impact by the laws of a wall: `Leave`, the dissipated energy, and whether all velocities are valid.

    `lost` is twice the energy per mass, relative to the wall; infinite if it is the whole change.
    """

    v: Any
    stays: Any
    wait: Any
    lost: Any
    is_right: Any


class Moves(Record):
    """Walls that move: they do work, and laws act on the velocity relative to them."""

    some: float


class Thermal(Record):
    """A thermal wall; accommodation 0 for a wall that is not thermal."""

    energy: float  # k_B T [J]
    accommodation: float

    def is_hot(self):
        """Whether it gives particles a speed of its own, so that none slides on it."""
        return (self.accommodation > 0.0) & (self.energy > 0.0)


def of_wall(given, wall, neutral=0.0):
    """Return the value of a law for this wall, `neutral` if no wall has the law."""
    each: Any = ()
    first = 0.0
    for one in given or ():
        is_span = isinstance(one, Span)
        after = first + (one.walls if is_span else 1.0)
        each = (*each, (wall < after, one.value) if is_span else (wall == first, one))
        first = after
    found = neutral
    for here, value in reversed(each):
        found = select(here, value, found)
    return found


def owned_in(
    spans: Iterable[tuple[int, int]], pieces: Sequence[Any], owners: Sequence[int]
) -> tuple[Owned, ...] | None:
    """Return `Owned` of all pieces of a scene that have `laws`, or None.

    `spans` are (number of a piece, number of its walls in a row), `owners` the surfaces of the pieces.
    """
    owned: list[Some] = []
    first = 0
    for i, walls in spans:
        laws = pieces[i].laws
        if any(isinstance(law, str) for law in laws):
            raise SceneError(
                f"surfaces[{owners[i]}].laws: {laws[0]!r} is a Python object, of which a file has only the name; build "
                "the scene in Python, as the script of the run does"
            )
        if laws and owned and owned[-1].after == first and owned[-1].laws == laws:
            owned[-1] = owned[-1]._replace(after=float(first + walls))
        elif laws:
            owned.append(Some(laws, float(first), float(first + walls)))
        first += walls
    alike: dict[Any, list[Some]] = {}
    for some in owned:
        alike.setdefault(tuple((type(law), *(part is None for part in law)) for law in some.laws), []).append(some)
    return tuple(Owned(tuple(each)) for each in alike.values()) or None


def _keeps_speed(law: Any) -> bool:
    """Whether every particle of its trials stays in the run with the speed of its arrival, and does not wait."""
    for v, _n, given in tries_of(law):
        after, stays, wait = leave_of(given)
        if not stays or wait > 0.0 or abs(square(after) - square(v)) > KEPT * square(v):
            return False
    return True
