"""A field that moves other than uniformly: how long a particle stays near one cell of its grid.

Its place in a cell has bounds by its speed there and a bound of its acceleration, as `relative.py` has them.
"""

import math

from ...kernel.jit import outlined
from .grid import cell_of, until_next

# The bounds of a flight in its cell hold for at most so many times its length, after so many trials.
_CLOSE, _TRIALS = 2.0, 8


@outlined
def until_next_in_frame(grid, seen, longest):
    """A time up to the longest during which a particle, seen in the frame of a field, is surely near its cell."""
    cell, time, within = cell_of(grid, seen.r), 0.0, longest
    # The bound of the acceleration grows with the time that it holds for.
    for _k in range(_TRIALS):
        until = until_next(seen.bounds(within), grid, cell, seen.r, seen.v)
        time = max(time, min(until, within))
        if not _CLOSE * time < within:
            break
        within = math.sqrt(time * within)
    return time
