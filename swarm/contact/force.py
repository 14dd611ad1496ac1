"""The force of the soft walls at a point, -V'(g) grad g: what methods without a discrete gradient take."""

from ..kernel.jit import outlined, select
from ..kernel.vector import ZERO, dot, norm

# The force needs these of every wall.
NEEDS = ("inner", "gap_of", "gap_slope", "discrete_gradient")


def strength(law, surface, q):
    """V'(g) g'(q): the force is this times -grad q."""
    g = surface.gap_of(q)
    # The divided difference of V for equal gaps.
    push, _stiffness = law.energy_slope(g, g)
    slope, _curvature = surface.gap_slope(q, q)
    return select(g > 0.0, push * slope, 0.0)


def force(walls, law, r):
    """The force of all walls [N]."""
    found = ZERO
    for wall in reversed(walls.each):
        found = _added(found, wall, law, r)
    return found


def _added(others, surface, law, r):
    """A force with that of one more wall."""
    f = strength(law, surface, surface.inner(r))
    d = surface.discrete_gradient(r, r)
    # A select and no product: off the wall grad q may be infinite.
    return select(f != 0.0, others - f * d, others)


@outlined
def add_impulses(walls, law, factor, r, impulse, lane):
    """Add `factor` times the magnitude of the force of each wall to impulse[wall, lane]."""
    for k, wall in enumerate(walls.each):
        f = strength(law, wall, wall.inner(r))
        if f != 0.0:
            impulse[k, lane] += factor * abs(f) * norm(wall.discrete_gradient(r, r))


def work(moving, walls, now, law, r):
    """The sum of force.displacement of all walls: `walls` has them over the step, `now` when the particle is at r."""
    found = 0.0
    if moving is None:
        return found
    for over, wall in reversed(tuple(zip(walls.each, now.each, strict=True))):
        found = dot(_added(ZERO, wall, law, r), over.displacement()) + found
    return found


@outlined
def add_works(moving, walls, now, law, factor, r, impulse, lane):
    """Add `factor` times force.displacement of each wall to its row of work in `impulse`: their sum, as `work`."""
    found = 0.0
    if moving is None:
        return found
    count = walls.length()
    for k, (over, wall) in reversed(tuple(enumerate(zip(walls.each, now.each, strict=True)))):
        here = factor * dot(_added(ZERO, wall, law, r), over.displacement())
        impulse[count + k, lane] += here
        found = here + found
    return found
