"""The part of the contract of a surface for walls that move: the definitions for a wall at rest.

A wall in motion is a `Posed` around the surface, posed.py; a flight to it takes safe steps in its frame, safe.py.
"""

import math

from ...kernel.record import Record
from ...kernel.vector import ZERO
from ..time_of_impact import rising


class AtRest(Record):
    """The methods that walls in motion override, and those that shapes override for use in such a wall."""

    # --- Overridden by a wall in motion ---

    # Whether its motion is not uniform, so that flights to it take safe steps in its frame.
    accelerates = False

    def seen(self, flight, t):
        """Return the `Seen` of a particle after a time of its flight, for safe steps; None if none are needed."""
        return

    def later(self, t):
        """Return the wall after a time [s]."""
        return self

    def velocity(self, r):
        """Return the velocity of the wall at a point of it."""
        return ZERO

    def acceleration(self, r):
        """Return the acceleration of the wall at a point of it."""
        return ZERO

    def carry(self, r):
        """Return the place at the end of a step of a point of the wall at its start."""
        return r

    def displacement(self):
        """Return the displacement of the wall in a step."""
        return ZERO

    def swept(self, r0, r1):
        """Return the displacement in a step of the point of the wall in the middle of the step from r0 to r1."""
        return self.displacement()

    def end_inner(self, r):
        """Return the inner function at the end of a step, where the wall may be elsewhere."""
        return self.inner(r)

    def place_scale(self, s):
        """Return the scale of the round-off of a place in the frame of a wall, from that of its coordinates."""
        return s

    def framed(self, r, p):
        """Return the surface at rest in its frame, and the start and the free displacement of a step there."""
        return self, r, p

    def time_scale(self):
        """A time in which the motion of the wall changes little [s]; infinite if it does not change."""
        return math.inf

    def mean_velocity(self, r0, r1, h):
        """Return the mean velocity of the wall's material in a step of length h from r0 to r1, both on it.

        Only as far as the surface changes: a rotation that leaves the surface unchanged does not count.
        """
        return ZERO

    # --- Overridden by a shape: safe steps in the frame of a wall that moves other than uniformly; see rising.py ---

    def passage(self, r, v, swings):
        """Return the `Passage` of a straight flight through the core, which a wall with these swings never reaches.

        It is known if the surface `has_core`.
        """
        raise NotImplementedError

    has_core = False

    def level_along(self, seen):
        """The level along a flight with a bound of its third derivative: a `Level`, or `Between` of rising.py."""
        raise NotImplementedError

    # Whether this bound is close to the actual derivative of a flight, for any motion of the wall: see aim.py.
    proves = False

    @property
    def has_levels(self):
        """Whether the surface has a `level_along`."""
        return self.gives("level_along")

    def moving_step(self, seen, longest):
        """Return a safe `Step` up to the time `longest`, of a particle relative to the wall."""
        if self.has_levels:
            return rising.level_step(self, seen, self.level_along(seen), longest)
        return rising.bent_step(self, seen, longest)

    @property
    def lacks_bend(self):
        """Whether this step follows from `hessian_bounds`, which the surface lacks."""
        return not any(map(self.gives, ("level_along", "moving_step", "hessian_bounds")))

    def bounds_along(self, seen, within):
        """`Bounds` of this flight for some time, in any frame in which the level is the same function of place."""
        n = self.flat_normal()
        return seen.bounds(within) if n is None else rising.bounds_along(n, seen, within)

    # Whether the normal is the same everywhere on a wall.
    flat = False

    def flat_normal(self):
        """Return the normal, with either sign, or None."""
        return
