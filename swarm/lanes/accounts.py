"""The accounts of a particle's energy: the shares of walls that move or are hot, and the loss."""

from ..kernel.arrays import index
from ..kernel.jit import select
from ..surfaces.in_motion.moving import Carried
from ..surfaces.walls import Field, Listed


def lose(state, i, before, after):
    """Book the loss from `before` to `after` of twice the energy per mass."""
    if before != after:
        state.energy[i] = 0.5 * after
        state.dissipated[i] += 0.5 * (before - after) * state.mass[i]


def book(walls, state, i, wall, change, given, loses, booked=0.0):
    """Book a change (before, after) of twice the energy per mass at a wall; `given` is the work of its motion in it.

    The part `booked` of this work is booked already.
    """
    before, after = change
    if not isinstance(walls, Carried):
        lose(state, i, before, after)
        return
    # Without losses the whole change is work, to the last digit.
    given = given if loses else after - before
    state.energy[i] = 0.5 * after
    state.dissipated[i] += 0.5 * (before - after + given) * state.mass[i]
    state.impulse[walls.length() + walls.row(wall), i] += 0.5 * (given - booked) * state.mass[i]


# --- For a lane -----------------------------------------------------------------------------------------


def add_work(walls, impulse, i, wall, given):
    """Add the work of a moving wall to the rows of work, which follow the rows of impulses."""
    if isinstance(walls, Carried):
        add_to_rows(walls, impulse, walls.length(), i, wall, given)


def add_to_rows(walls, rows, row, i, wall, given):
    """Add to rows[row + the row of a wall, i] without a branch; without a wall `given` is 0."""
    if len(walls.each) == 1 and not walls.fields():
        # A loop over rows here would not vectorise.
        rows[row, i] += given
        return
    for one in walls.each:
        if isinstance(one, Field):
            count = one.count()
            here = (wall >= 0.0) & (wall < count)
            if isinstance(one, Listed):
                rows[index(row + int(select(here, wall, 0.0))), i] += select(here, given, 0.0)
                row += int(count)
            else:
                rows[row, i] += select(here, given, 0.0)
                row += 1
            wall = select(wall < count, -1.0, wall - count)
        else:
            rows[row, i] += select(wall == 0.0, given, 0.0)
            row, wall = row + 1, wall - 1.0
