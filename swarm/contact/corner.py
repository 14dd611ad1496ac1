"""One step against all walls of a scene at once: Gauss-Seidel over the walls that hold the particle.

Each wall is solved with the reactions of the others fixed, until the end of the step no longer moves. Every equation
is that of a soft wall: its reaction follows from the gap. Rigid walls, projection.py, do not use these sweeps: nearly
opposite walls, as in a cusp, would gain next to nothing one after the other, so all sets of up to three walls are
tested for one that carries. Uzawa's loop, uzawa.py, is around these sweeps, with one multiplier for each wall.
"""

from ..kernel.jit import outlined
from ..kernel.limits import EPSILON
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, dot, largest, norm, vector_at
from . import impulse as contact_impulse
from .discrete_gradient import reaction
from .impulse import Step

# Sweeps over the walls; a corner of 90 degrees takes three.
_SWEEPS = 500


class CornerEnd(Record):
    """The end r1 of a step against walls, and whether every wall was solved."""

    r: Vec
    solved: bool


@outlined
def hold(form, law, multipliers, walls, step, reactions):
    """Make one step against all walls; return its `CornerEnd`.

    `multipliers` has one entry for each wall, or is None. `reactions` (walls, 4) is set to
    c D (alpha Phi_mean + lambda), Phi1.
    """
    reactions[:] = 0.0
    r = step.r
    for i in range(_SWEEPS):
        before = r
        solved = _sweep(walls, form, law, multipliers, step, reactions)
        r = step.r + (step.p - total(reactions))
        # In an acute edge the reactions are larger than their sum, and so is their round-off.
        size, moved = max(largest(r), largest(step.p), _size_of(reactions)), largest(r - before)
        if solved and (reactions.shape[0] == 1 or (i > 0 and moved <= 4.0 * EPSILON * size)):
            return CornerEnd(r, True)
        if i > 0 and moved == 0.0:
            # A wall that is not solved: sweeps that return to their start repeat the result.
            return CornerEnd(r, False)
    return CornerEnd(r, False)


@outlined
def total(reactions):
    """The sum of the reactions of all walls."""
    found = ZERO
    for k in range(reactions.shape[0]):
        found = found + vector_at(reactions, k, 0)
    return found


def _size_of(reactions):
    """The sum of the sizes of the reactions of all walls."""
    found = 0.0
    for k in range(reactions.shape[0]):
        found += largest(vector_at(reactions, k, 0))
    return found


@outlined
def _sweep(walls, form, law, multipliers, step, reactions):
    """Solve every wall once; return whether all were solved."""
    solved = True
    for k, wall in enumerate(walls.each):
        reactions[k] = 0.0
        remaining = Step(step.r, step.p - total(reactions), step.c)
        multiplier = None if multipliers is None else multipliers[k]
        found = reaction(form, law, multiplier, wall, remaining)
        x, y, z = found.vector
        reactions[k, 0], reactions[k, 1], reactions[k, 2], reactions[k, 3] = x, y, z, found.constraint
        solved = solved & found.solved
    return solved


@outlined
def add_reaction_impulses(reactions, h, impulse, lane):
    """Add the impulse per mass of each wall in a step of length h, |2/h reaction|, to impulse[wall, lane]."""
    for k in range(reactions.shape[0]):
        impulse[k, lane] += 2.0 / h * norm(vector_at(reactions, k, 0))


@outlined
def add_reaction_works(moving, walls, factor, reactions, ends, impulse, lane):
    """Add the work per mass of each wall in a step, `factor` reaction.swept(*ends), to its row of `impulse`; return it.

    The rows of work follow the rows of impulses; without moving walls `impulse` has no rows of work.
    """
    found = 0.0
    if moving is None:
        return found
    for k, wall in reversed(tuple(enumerate(walls.each))):
        work = factor * dot(vector_at(reactions, k, 0), wall.swept(*ends))
        impulse[reactions.shape[0] + k, lane] += work
        found = work + found
    return found


@outlined
def constraints(walls, law, r, into):
    """Write Phi of every wall at a point to `into`; 0 for gaps that are round-off."""
    for k, wall in enumerate(walls.each):
        start = contact_impulse.start_of(0.0, wall, r)
        into[k] = law.constraint(start.gap)
