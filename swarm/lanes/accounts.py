"""What impacts and short steps change of a particle's energy: what walls that move give of it, and what is lost."""

from ..kernel.jit import by_type, inlined
from ..surfaces import fold as walls
from ..surfaces.moving import Carried


@inlined
def lose(state, i, before, after):
    """Book what is left of twice the energy per mass."""
    if before != after:
        state.energy[i] = 0.5 * after
        state.dissipated[i] += 0.5 * (before - after) * state.mass[i]


@by_type
def book(chain, state, i, wall, before, after, given, loses):
    """Book the change of twice the energy per mass at a wall; `given` is what it gives by its motion, if it moves."""
    lose(state, i, before, after)


@book.register(Carried)
def _(chain, state, i, wall, before, after, given, loses):
    # Where nothing is lost all of it is work, to the last digit.
    given = given if loses else after - before
    state.energy[i] = 0.5 * after
    state.dissipated[i] += 0.5 * (before - after + given) * state.mass[i]
    book_work(chain, state, i, wall, given)


@by_type
def book_work(chain, state, i, wall, given):
    """Book twice the work per mass of a wall that moves."""


@book_work.register(Carried)
def _(chain, state, i, wall, given):
    state.impulse[walls.length(chain) + walls.row(chain, wall), i] += 0.5 * given * state.mass[i]


@by_type
def book_step(chain, state, i, wall, before, after, given, loses):
    """Book the change of twice the energy per mass in a short step; what the walls give of it is booked."""
    lose(state, i, before, after)


@book_step.register(Carried)
def _(chain, state, i, wall, before, after, given, loses):
    state.energy[i] = 0.5 * after
    if loses:
        state.dissipated[i] += 0.5 * (before - after + given) * state.mass[i]
    else:
        # What is left is round-off.
        book_work(chain, state, i, wall, after - before - given)
