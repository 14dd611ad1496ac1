"""All surfaces of a scene at once: the functions of one surface, folded over the chain.

The fold ends at None, and its neutral element (no hit, no gap) is a constant that the compiler removes.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

from ..kernel.gravity import Nothing
from ..kernel.jit import by_type, select
from . import base


class Chain(NamedTuple):
    """The surfaces of a scene as nested pairs, ended by None: what is not there compiles to nothing."""

    first: Any
    rest: Any


def chain_of(surfaces: Sequence[base.Surface]) -> Chain | None:
    """The walls of `surfaces` as a chain, in their order."""
    chain = None
    for wall in reversed([wall for surface in surfaces for wall in surface.walls()]):
        chain = Chain(wall, chain)
    return chain


@by_type
def length(chain):
    """How many surfaces there are: a constant for the compiler."""
    raise NotImplementedError


@length.register(Chain)
def _(chain):
    return 1 + length(chain.rest)


@length.register(Nothing)
def _(chain):
    return 0


@by_type
def unit_normal(chain, index, x, y, z):
    """Unit normal of surface `index`, out of the admissible side; of any where there is no such surface."""
    raise NotImplementedError


@unit_normal.register(Chain)
def _(chain, index, x, y, z):
    nx, ny, nz = base.unit_normal(chain.first, x, y, z)
    ox, oy, oz = unit_normal(chain.rest, index - 1.0, x, y, z)
    # Whoever has no wall does not ask: the last one need not be told from none.
    here = (index == 0.0) | (length(chain) == 1)
    return select(here, nx, ox), select(here, ny, oy), select(here, nz, oz)


@unit_normal.register(Nothing)
def _(chain, index, x, y, z):
    return 0.0, 0.0, 0.0


@by_type
def chord_sweeps(chain):
    """The most steps of `chord_improve` that any surface takes: a constant for the compiler."""
    raise NotImplementedError


@chord_sweeps.register(Chain)
def _(chain):
    return max(base.chord_sweeps(chain.first), chord_sweeps(chain.rest))


@chord_sweeps.register(Nothing)
def _(chain):
    return 0


@by_type
def chord_guess(chain, index, x, y, z, px, py, pz):
    """First guess of the kappa of a step on surface `index` with free displacement p."""
    raise NotImplementedError


@chord_guess.register(Chain)
def _(chain, index, x, y, z, px, py, pz):
    kappa = base.chord_guess(chain.first, x, y, z, px, py, pz)
    other = chord_guess(chain.rest, index - 1.0, x, y, z, px, py, pz)
    return select(index == 0.0, kappa, other)


@chord_guess.register(Nothing)
def _(chain, index, x, y, z, px, py, pz):
    return 0.0


@by_type
def chord_improve(chain, index, x, y, z, px, py, pz, kappa):
    """Newton step of that kappa."""
    raise NotImplementedError


@chord_improve.register(Chain)
def _(chain, index, x, y, z, px, py, pz, kappa):
    step = base.chord_improve(chain.first, x, y, z, px, py, pz, kappa)
    other = chord_improve(chain.rest, index - 1.0, x, y, z, px, py, pz, kappa)
    return select(index == 0.0, step, other)


@chord_improve.register(Nothing)
def _(chain, index, x, y, z, px, py, pz, kappa):
    return 0.0


@by_type
def chord_normal(chain, index, x, y, z, px, py, pz, kappa):
    """Unit normal of the contact step on surface `index` with free displacement p."""
    raise NotImplementedError


@chord_normal.register(Chain)
def _(chain, index, x, y, z, px, py, pz, kappa):
    nx, ny, nz = base.chord_normal(chain.first, x, y, z, px, py, pz, kappa)
    ox, oy, oz = chord_normal(chain.rest, index - 1.0, x, y, z, px, py, pz, kappa)
    here = index == 0.0
    return select(here, nx, ox), select(here, ny, oy), select(here, nz, oz)


@chord_normal.register(Nothing)
def _(chain, index, x, y, z, px, py, pz, kappa):
    return 0.0, 0.0, 0.0


@by_type
def settle(chain, index, x, y, z):
    """The point moved onto surface `index`, from within round-off of it."""
    raise NotImplementedError


@settle.register(Chain)
def _(chain, index, x, y, z):
    sx, sy, sz = base.settle(chain.first, x, y, z)
    ox, oy, oz = settle(chain.rest, index - 1.0, x, y, z)
    here = index == 0.0
    return select(here, sx, ox), select(here, sy, oy), select(here, sz, oz)


@settle.register(Nothing)
def _(chain, index, x, y, z):
    return x, y, z


@by_type
def outside(chain, index, x, y, z):
    """Whether a point is outside any surface but `index` (-1: any at all)."""
    raise NotImplementedError


@outside.register(Chain)
def _(chain, index, x, y, z):
    here = base.level_of(chain.first, base.inner(chain.first, x, y, z)) > 0.0
    return (here & (index != 0.0)) | outside(chain.rest, index - 1.0, x, y, z)


@outside.register(Nothing)
def _(chain, index, x, y, z):
    return False


@by_type
def push(chain, index, x0, y0, z0, px, py, pz, kappa):
    """The end r1 of a step that surface `index` pushes with kappa."""
    raise NotImplementedError


@push.register(Chain)
def _(chain, index, x0, y0, z0, px, py, pz, kappa):
    x1, y1, z1 = base.push(chain.first, x0, y0, z0, px, py, pz, kappa)
    ox, oy, oz = push(chain.rest, index - 1.0, x0, y0, z0, px, py, pz, kappa)
    here = index == 0.0
    return select(here, x1, ox), select(here, y1, oy), select(here, z1, oz)


@push.register(Nothing)
def _(chain, index, x0, y0, z0, px, py, pz, kappa):
    return x0, y0, z0


@by_type
def pushes(chain, index, kappa):
    """Whether surface `index` can push with kappa: in its direction and short of the pole."""
    raise NotImplementedError


@pushes.register(Chain)
def _(chain, index, kappa):
    farthest = base.farthest_push(chain.first)
    here = (kappa == 0.0) | ((kappa * farthest > 0.0) & (abs(kappa) < abs(farthest)))
    other = pushes(chain.rest, index - 1.0, kappa)
    return ((index == 0.0) & here) | ((index != 0.0) & other)


@pushes.register(Nothing)
def _(chain, index, kappa):
    return False


@by_type
def inner_gradient(chain, index, x0, y0, z0, x1, y1, z1):
    """Discrete gradient of the inner function of surface `index`."""
    raise NotImplementedError


@inner_gradient.register(Chain)
def _(chain, index, x0, y0, z0, x1, y1, z1):
    dx, dy, dz = base.inner_gradient(chain.first, x0, y0, z0, x1, y1, z1)
    ox, oy, oz = inner_gradient(chain.rest, index - 1.0, x0, y0, z0, x1, y1, z1)
    here = index == 0.0
    return select(here, dx, ox), select(here, dy, oy), select(here, dz, oz)


@inner_gradient.register(Nothing)
def _(chain, index, x0, y0, z0, x1, y1, z1):
    return 0.0, 0.0, 0.0


@by_type
def touched(chain, x, y, z, px, py, pz):
    """Walls that a step with free displacement p is in contact with: (the first one or -1, how many)."""
    raise NotImplementedError


@touched.register(Chain)
def _(chain, x, y, z, px, py, pz):
    surface = chain.first
    before = base.level_of(surface, base.inner(surface, x, y, z))
    after = base.level_of(surface, base.inner(surface, x + px, y + py, z + pz))
    contact = (before > 0.0) | (after > 0.0)
    index, count = touched(chain.rest, x, y, z, px, py, pz)
    later = select(count > 0.0, index + 1.0, -1.0)
    return select(contact, 0.0, later), count + select(contact, 1.0, 0.0)


@touched.register(Nothing)
def _(chain, x, y, z, px, py, pz):
    return -1.0, 0.0
