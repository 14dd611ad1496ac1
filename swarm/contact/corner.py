"""One step against all walls of a scene at once: Gauss-Seidel over the walls that hold the particle.

Each wall is solved with the reactions of the others held, until the end of the step no longer moves.
"""

import math

from ..kernel.gravity import Nothing
from ..kernel.jit import by_type, by_type_outlined, outlined
from ..surfaces import base as surfaces
from ..surfaces import chain as walls
from . import impulse
from . import regularisation as law_of
from .discrete_gradient import reaction

_EPSILON = 2.220446049250313e-16
# Sweeps over the walls; a corner of 90 degrees takes three.
_SWEEPS = 500


@outlined
def hold(form, law, multipliers, chain, x, y, z, px, py, pz, c, reactions):
    """The step from r0 with free displacement p: (x1, y1, z1, solved).

    `multipliers` has one entry a wall, or is None; `reactions` (walls, 4) becomes c D (alpha Phi_mean + lambda), Phi1.
    """
    reactions[:] = 0.0
    x1, y1, z1 = x, y, z
    for i in range(_SWEEPS):
        ox, oy, oz = x1, y1, z1
        solved = _sweep(chain, form, law, multipliers, 0, x, y, z, px, py, pz, c, reactions)
        rx, ry, rz = total(reactions)
        x1, y1, z1 = x + (px - rx), y + (py - ry), z + (pz - rz)
        change = max(abs(x1 - ox), abs(y1 - oy), abs(z1 - oz))
        size = max(abs(x1), abs(y1), abs(z1), abs(px), abs(py), abs(pz))
        if solved and (reactions.shape[0] == 1 or (i > 0 and change <= 4.0 * _EPSILON * size)):
            return x1, y1, z1, True
    return x1, y1, z1, False


@outlined
def total(reactions):
    """Their sum."""
    rx, ry, rz = 0.0, 0.0, 0.0
    for k in range(reactions.shape[0]):
        rx, ry, rz = rx + reactions[k, 0], ry + reactions[k, 1], rz + reactions[k, 2]
    return rx, ry, rz


@by_type_outlined
def _sweep(chain, form, law, multipliers, k, x, y, z, px, py, pz, c, reactions):
    """Every wall once; whether each was solved."""
    raise NotImplementedError


@_sweep.register(walls.Chain)
def _(chain, form, law, multipliers, k, x, y, z, px, py, pz, c, reactions):
    reactions[k] = 0.0
    rx, ry, rz = total(reactions)
    multiplier = multiplier_of(multipliers, k)
    ax, ay, az, end, solved = reaction(form, law, multiplier, chain.first, x, y, z, px - rx, py - ry, pz - rz, c)
    reactions[k, 0], reactions[k, 1], reactions[k, 2], reactions[k, 3] = ax, ay, az, end
    return _sweep(chain.rest, form, law, multipliers, k + 1, x, y, z, px, py, pz, c, reactions) and solved


@_sweep.register(Nothing)
def _(chain, form, law, multipliers, k, x, y, z, px, py, pz, c, reactions):
    return True


@by_type
def multiplier_of(multipliers, k):
    """Entry k, or None where the method has no multipliers."""
    return multipliers[k]


@multiplier_of.register(Nothing)
def _(multipliers, k):
    return None


@outlined
def add_impulses(reactions, h, impulse, lane):
    """Add the impulse per mass of each wall in a step of length h, |2/h reaction|, to impulse[wall, lane]."""
    for k in range(reactions.shape[0]):
        rx, ry, rz = reactions[k, 0], reactions[k, 1], reactions[k, 2]
        impulse[k, lane] += 2.0 / h * math.sqrt(rx * rx + ry * ry + rz * rz)


@by_type_outlined
def constraints(chain, law, k, x, y, z, into):
    """Phi of every wall at a point into `into`; 0 for gaps that are round-off."""
    raise NotImplementedError


@constraints.register(walls.Chain)
def _(chain, law, k, x, y, z, into):
    surface = chain.first
    g, _round_off, _tolerance = impulse.start_gap(0.0, surface, x, y, z, surfaces.inner(surface, x, y, z))
    into[k] = law_of.constraint(law, g)
    constraints(chain.rest, law, k + 1, x, y, z, into)


@constraints.register(Nothing)
def _(chain, law, k, x, y, z, into):
    pass
