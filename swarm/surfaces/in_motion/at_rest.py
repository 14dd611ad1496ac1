"""The contract of a surface, as far as it is about walls that move: the definitions of one at rest.

A wall in motion is a `Posed` around the surface, posed.py; a flight to it goes by safe steps in its frame, safe.py.
"""

import math

from ...kernel.record import Record
from ...kernel.vector import ZERO
from ..time_of_impact import rising


class AtRest(Record):
    """The methods that walls in motion override, and those that shapes do which may be in such a wall."""

    # --- Overridden by a wall in motion ---

    # Whether it moves other than uniformly, so that flights to it go by safe steps in its frame.
    accelerates = False

    def seen(self, flight, t):
        """A particle as safe steps to the wall see it after a time of its flight, `Seen`, None if none are needed."""
        return

    def later(self, t):
        """The wall after a time [s]."""
        return self

    def velocity(self, r):
        """The velocity of the wall at a point of it."""
        return ZERO

    def acceleration(self, r):
        """The acceleration of the wall at a point of it."""
        return ZERO

    def carry(self, r):
        """The place at the end of a step of a point of the wall at its start."""
        return r

    def displacement(self):
        """The displacement of the wall in a step."""
        return ZERO

    def swept(self, r0, r1):
        """The displacement in a step of the point of the wall that is in the middle of the step from r0 to r1."""
        return self.displacement()

    def end_inner(self, r):
        """The inner function at the end of a step, where the wall may be elsewhere."""
        return self.inner(r)

    def place_scale(self, s):
        """The scale of the round-off of a place in the frame of a wall, from that of its coordinates."""
        return s

    def framed(self, r, p):
        """The surface at rest in its frame, and the start and the free displacement of a step there."""
        return self, r, p

    def time_scale(self):
        """A time in which the motion of the wall changes little [s]; infinite where it does not change."""
        return math.inf

    def mean_velocity(self, r0, r1, h):
        """The mean velocity of the wall's material in a step of length h from r0 to r1, both on it.

        As far as the surface changes with it: a rotation that leaves the surface as it is does not count.
        """
        return ZERO

    # --- Overridden by a shape: safe steps in the frame of a wall that moves other than uniformly; see rising.py ---

    def passage(self, r, v, swings):
        """The `Passage` of a straight flight through what lies so deep that a wall with these swings never reaches it.

        It is known where the surface `has_core`.
        """
        raise NotImplementedError

    has_core = False

    def level_along(self, seen):
        """The level along a flight with a bound of its third derivative: a `Level`, or `Between` of rising.py."""
        raise NotImplementedError

    # Whether that bound is near to what a flight does, however a wall moves: see aim.py.
    proves = False

    @property
    def has_levels(self):
        """Whether the surface has a `level_along`."""
        return self.gives("level_along")

    def moving_step(self, seen, longest):
        """A safe `Step` of at most the longest time, of a particle that the wall sees like this."""
        if self.has_levels:
            return rising.level_step(self, seen, self.level_along(seen), longest)
        return rising.bent_step(self, seen, longest)

    @property
    def lacks_bend(self):
        """Whether that step follows from `hessian_bounds`, which the surface does not have."""
        return not any(map(self.gives, ("level_along", "moving_step", "hessian_bounds")))

    def bounds_along(self, seen, within):
        """`Bounds` of that flight for some time, in any frame in which the level is the same function of place."""
        n = self.flat_normal()
        return seen.bounds(within) if n is None else rising.bounds_along(n, seen, within)

    # Whether the normal is the same everywhere on a wall.
    flat = False

    def flat_normal(self):
        """The normal, with either sign, or None."""
        return
