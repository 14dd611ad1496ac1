"""The energy that soft walls store, its uncertainty, and their force, which has no discrete gradient.

The force at a point is -V'(g) grad g, which the implicit rules and Verlet use.
"""

import math

from ..kernel.gravity import potential, weight
from ..kernel.jit import outlined, select
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, absolute, dot, norm, square, total
from ..surfaces.presence.rooms import least_of
from ..surfaces.walls import Field

# The force needs these functions of every wall.
NEEDS = ("inner", "gap_of", "gap_slope", "discrete_gradient")

# The fraction of |v|^2 up to which one Newton step of the square root restores it.
_NEAR = 0.1
# Units of round-off that a solved contact may miss of its energy.
_ROUND_OFF = 64.0 * 2.220446049250313e-16


class Budget(Record):
    """The numbers by which the energy of a step is measured."""

    over_mass: float  # 1/mass
    energy: float  # of the particle, per mass: the energy at the start of the run, plus the work of walls since then
    force: float  # the force that multipliers add to the springs, per mass


class Ends(Record):
    """The two ends of a step of length h, and the velocity at its end."""

    r0: Vec
    r1: Vec
    v: Vec
    h: float


def contact_energy(law, walls, over_mass, r):
    """Return the energy per mass that one particle stores in the walls, from 1/mass; rigid walls (None) store none."""
    if law is None:
        return 0.0
    stored = _stored_in(law, tuple(wall for _number, wall in walls.shared()), r)
    for rooms in walls.joined():
        each = tuple(_stored_in(law, tuple(wall for _number, wall, _gentle in room), r) for room in rooms)
        stored = stored + least_of(each)
    return stored * over_mass


def _stored_in(law, walls, r):
    """Return the energy that a particle stores in the given walls."""
    stored = 0.0
    for wall in reversed(walls):
        gap = wall.members.deepest_in_cell(r) if isinstance(wall, Field) else wall.gap_of(wall.inner(r))
        stored = law.stored_energy(gap) + stored
    return stored


def energy_uncertainty(walls, law, over_mass, r, s):
    """Return the change of the stored energy per mass when each coordinate of r changes by that in s, to first order.

    With s a few units of round-off this is the accuracy with which the energy of a stiff wall can be known.
    """
    found = 0.0
    for surface in reversed(walls.each):
        g = surface.gap_of(surface.inner(r))
        # 2 V/g, which is the force up to the factor (a + 1)/2
        force = law.stiffness(g) * select(g > 0.0, g, 0.0) * over_mass
        found = force * dot(absolute(surface.gradient(r)), surface.place_scale(s)) + found
    return found


def restoring_factor(law, walls, after, gravity, budget, ends):
    """Return the factor of v after a contact step that restores the energy, and whether only round-off is missing.

    Each step conserves energy to round-off: V(g) feels the last bit of r, which in a stiff contact is 1e-13 of the
    energy, and over many contacts the errors add up (measured: 2e-10 after 10 000 steps at dt sqrt(alpha/m) = 100).
    If more than round-off is missing the factor is 1: then the equation was not solved, or ended at a tolerance.
    `walls` are the walls over the step, `after` those at its end.
    """
    r0, r1, v, h = ends
    speed2 = square(v)
    stored = contact_energy(law, after, budget.over_mass, r1)
    missing = 2.0 * (budget.energy - potential(gravity, r1) - stored) - speed2
    # The magnitudes that set the round-off of the coordinates.
    s = absolute(r0) + absolute(r1) + h * absolute(v)
    uncertainty = energy_uncertainty(walls, law, budget.over_mass, r0, s)
    uncertainty += energy_uncertainty(after, law, budget.over_mass, r1, s)
    uncertainty += speed2 + abs(budget.energy) + weight(gravity, s) + budget.force * total(s)
    balanced = abs(missing) <= _ROUND_OFF * uncertainty
    moving = balanced & (speed2 > 0.0)
    part = select(moving, missing / select(moving, speed2, 1.0), 0.0)
    # The speed of a particle nearly at rest is round-off of the energy: a Newton step would overshoot.
    rest = math.sqrt(select(part > -1.0, 1.0 + part, 0.0))
    return select(abs(part) <= _NEAR, 1.0 + 0.5 * part, rest), balanced


# --- The force -------------------------------------------------------------------------------------------


def strength(law, surface, q):
    """Return V'(g) g'(q): the force is this times -grad q."""
    g = surface.gap_of(q)
    # The divided difference of V for equal gaps
    push, _stiffness = law.energy_slope(g, g)
    slope, _curvature = surface.gap_slope(q, q)
    return select(g > 0.0, push * slope, 0.0)


def walls_force(walls, law, r):
    """Return the force of all walls [N]."""
    found = ZERO
    for wall in reversed(walls.each):
        found = _added(found, wall, law, r)
    return found


def _added(others, surface, law, r):
    """Add the force of one more wall to a force; return the sum."""
    f = strength(law, surface, surface.inner(r))
    d = surface.discrete_gradient(r, r)
    # A select instead of a product: off the wall grad q may be infinite.
    return select(f != 0.0, others - f * d, others)


@outlined
def add_impulses(walls, law, factor, r, impulse, lane):
    """Add `factor` times the magnitude of the force of each wall to impulse[wall, lane]."""
    for k, wall in enumerate(walls.each):
        f = strength(law, wall, wall.inner(r))
        if f != 0.0:
            impulse[k, lane] += factor * abs(f) * norm(wall.discrete_gradient(r, r))


def work(moving, walls, now, law, r):
    """Return the sum of force.displacement of all walls: `walls` over the step, `now` when the particle is at r."""
    found = 0.0
    if moving is None:
        return found
    for over, wall in reversed(tuple(zip(walls.each, now.each, strict=True))):
        found = dot(_added(ZERO, wall, law, r), over.displacement()) + found
    return found


@outlined
def add_works(moving, walls, now, law, factor, r, impulse, lane):
    """Add `factor` times force.displacement of each wall to its row of work in `impulse`; return the sum, as `work`."""
    found = 0.0
    if moving is None:
        return found
    count = walls.length()
    for k, (over, wall) in reversed(tuple(enumerate(zip(walls.each, now.each, strict=True)))):
        here = factor * dot(_added(ZERO, wall, law, r), over.displacement())
        impulse[count + k, lane] += here
        found = here + found
    return found
