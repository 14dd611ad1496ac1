"""The force of the soft walls at a point, -V'(g) grad g: what methods without a discrete gradient take."""

from ..kernel.gravity import Nothing
from ..kernel.jit import by_type, by_type_outlined, inlined, select
from ..kernel.vector import ZERO, dot, norm
from ..surfaces import contract
from ..surfaces.fold import Chain, length
from . import regularisation as law_of
from .laws import Moves

# What the force needs of every wall.
NEEDS = (contract.inner, contract.gap_of, contract.gap_slope, contract.inner_gradient)


@inlined
def strength(law, surface, q):
    """V'(g) g'(q): the force is this times -grad q."""
    g = contract.gap_of(surface, q)
    # The divided difference of V for equal gaps.
    push, _stiffness = law_of.energy_slope(law, g, g)
    slope, _curvature = contract.gap_slope(surface, q, q)
    return select(g > 0.0, push * slope, 0.0)


@by_type
def force(chain, law, r):
    """The force of all walls [N]."""
    surface = chain.first
    f = strength(law, surface, contract.inner(surface, r))
    d = contract.inner_gradient(surface, r, r)
    others = force(chain.rest, law, r)
    # A select and no product: off the wall grad q may be infinite.
    return select(f != 0.0, others - f * d, others)


@force.register(Nothing)
def _(chain, law, r):
    return ZERO


@by_type_outlined
def add_impulses(chain, law, factor, k, r, impulse, lane):
    """Add `factor` times the magnitude of the force of each wall to impulse[wall, lane]."""
    surface = chain.first
    f = strength(law, surface, contract.inner(surface, r))
    if f != 0.0:
        impulse[k, lane] += factor * abs(f) * norm(contract.inner_gradient(surface, r, r))
    add_impulses(chain.rest, law, factor, k + 1, r, impulse, lane)


@add_impulses.register(Nothing)
def _(chain, law, factor, k, r, impulse, lane):
    pass


@by_type
def work(moving, chain, now, law, r):
    """The sum of force.way of all walls: `chain` has them over the step, `now` when the particle is at r."""
    return 0.0


@work.register(Moves)
def _(moving, chain, now, law, r):
    return _work(chain, now, law, r)


@by_type
def _work(chain, now, law, r):
    here = dot(force(Chain(now.first, None), law, r), contract.way(chain.first))
    return here + _work(chain.rest, now.rest, law, r)


@_work.register(Nothing)
def _(chain, now, law, r):
    return 0.0


@by_type_outlined
def add_works(moving, chain, now, law, factor, r, impulse, lane):
    """Add `factor` times force.way of each wall to its row of work in `impulse`: their sum, as `work`."""
    return 0.0


@add_works.register(Moves)
def _(moving, chain, now, law, factor, r, impulse, lane):
    return _add_works(chain, now, law, factor, length(chain), r, impulse, lane)


@by_type_outlined
def _add_works(chain, now, law, factor, row, r, impulse, lane):
    here = factor * dot(force(Chain(now.first, None), law, r), contract.way(chain.first))
    impulse[row, lane] += here
    return here + _add_works(chain.rest, now.rest, law, factor, row + 1, r, impulse, lane)


@_add_works.register(Nothing)
def _(chain, now, law, factor, row, r, impulse, lane):
    return 0.0
