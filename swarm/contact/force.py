"""The force of the soft walls at a point, -V'(g) grad g: what methods without a discrete gradient take."""

import math

from ..kernel.gravity import Nothing
from ..kernel.jit import by_type, by_type_outlined, inlined, select
from ..surfaces import base as surfaces
from ..surfaces import chain as walls
from . import regularisation as law_of

# What the force asks of every wall.
NEEDS = (surfaces.inner, surfaces.gap_of, surfaces.gap_slope, surfaces.inner_gradient)


@inlined
def strength(law, surface, q):
    """V'(g) g'(q): the force is this times -grad q."""
    g = surfaces.gap_of(surface, q)
    # The divided difference of V for equal gaps.
    push, _stiffness = law_of.energy_slope(law, g, g)
    slope, _curvature = surfaces.gap_slope(surface, q, q)
    return select(g > 0.0, push * slope, 0.0)


@by_type
def force(chain, law, x, y, z):
    """The force of all walls [N]."""
    raise NotImplementedError


@force.register(walls.Chain)
def _(chain, law, x, y, z):
    surface = chain.first
    f = strength(law, surface, surfaces.inner(surface, x, y, z))
    dx, dy, dz = surfaces.inner_gradient(surface, x, y, z, x, y, z)
    ox, oy, oz = force(chain.rest, law, x, y, z)
    # A select and no product: off the wall grad q may be infinite.
    pushes = f != 0.0
    return select(pushes, ox - f * dx, ox), select(pushes, oy - f * dy, oy), select(pushes, oz - f * dz, oz)


@force.register(Nothing)
def _(chain, law, x, y, z):
    return 0.0, 0.0, 0.0


@by_type_outlined
def add_impulses(chain, law, factor, k, x, y, z, impulse, lane):
    """Add `factor` times the size of the force of each wall to impulse[wall, lane]."""
    raise NotImplementedError


@add_impulses.register(walls.Chain)
def _(chain, law, factor, k, x, y, z, impulse, lane):
    surface = chain.first
    f = strength(law, surface, surfaces.inner(surface, x, y, z))
    if f != 0.0:
        dx, dy, dz = surfaces.inner_gradient(surface, x, y, z, x, y, z)
        impulse[k, lane] += factor * abs(f) * math.sqrt(dx * dx + dy * dy + dz * dz)
    add_impulses(chain.rest, law, factor, k + 1, x, y, z, impulse, lane)


@add_impulses.register(Nothing)
def _(chain, law, factor, k, x, y, z, impulse, lane):
    pass
