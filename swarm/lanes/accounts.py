"""The accounts of a particle's energy: the shares of walls that move or are hot, and the loss."""

from ..surfaces.moving import Carried


def lose(state, i, before, after):
    """Book what is left of twice the energy per mass."""
    if before != after:
        state.energy[i] = 0.5 * after
        state.dissipated[i] += 0.5 * (before - after) * state.mass[i]


def book(walls, state, i, wall, change, given, loses):
    """Book a change (before, after) of twice the energy per mass at a wall, which gives so much of it by its motion."""
    before, after = change
    if not isinstance(walls, Carried):
        lose(state, i, before, after)
        return
    # Where nothing is lost all of it is work, to the last digit.
    given = given if loses else after - before
    state.energy[i] = 0.5 * after
    state.dissipated[i] += 0.5 * (before - after + given) * state.mass[i]
    book_work(walls, state, i, wall, given)


def book_work(walls, state, i, wall, given):
    """Book twice the work per mass of a wall, if it moves."""
    if isinstance(walls, Carried):
        state.impulse[walls.length() + walls.row(wall), i] += 0.5 * given * state.mass[i]


def book_step(walls, state, i, wall, change, given, loses):
    """Book a change (before, after) of twice the energy per mass in a short step, of which `given` is booked."""
    before, after = change
    if not isinstance(walls, Carried):
        lose(state, i, before, after)
        return
    state.energy[i] = 0.5 * after
    if loses:
        state.dissipated[i] += 0.5 * (before - after + given) * state.mass[i]
    else:
        # What is left is round-off.
        book_work(walls, state, i, wall, after - before - given)


def book_heat(state, i, wall, before, after):
    """Book what a thermal wall gives to particle i, from twice its energies per mass."""
    # What impacts have taken since the energy was written is booked when the particle leaves its lane.
    pending = state.energy[i] - 0.5 * before
    state.energy[i] = 0.5 * after + pending
    state.heat[wall, i] += 0.5 * (after - before) * state.mass[i]
