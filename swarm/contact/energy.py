"""The energy that the walls store, summed over all surfaces of a scene, and how well it is known."""

from .._jit import by_type, select
from ..gravity import Nothing
from ..surfaces import base as surfaces
from ..surfaces import chain as walls
from . import regularisation as law_of


@by_type
def contact_energy(law, chain, mass, x, y, z):
    """Energy per mass that one particle stores in the walls; rigid walls (None) store none."""
    raise NotImplementedError


@contact_energy.register(Nothing)
def _(law, chain, mass, x, y, z):
    return 0.0


@by_type
def _stored(chain, law, x, y, z):
    raise NotImplementedError


@_stored.register(walls.Chain)
def _(chain, law, x, y, z):
    g = surfaces.gap_of(chain.first, surfaces.inner(chain.first, x, y, z))
    return law_of.stored_energy(law, g) + _stored(chain.rest, law, x, y, z)


@_stored.register(Nothing)
def _(chain, law, x, y, z):
    return 0.0


@contact_energy.register(law_of.Linear)
@contact_energy.register(law_of.Hertz)
@contact_energy.register(law_of.Power)
def _(law, chain, mass, x, y, z):
    return _stored(chain, law, x, y, z) / mass


@by_type
def energy_doubt(chain, law, mass, x, y, z, sx, sy, sz):
    """How far the stored energy per mass moves when the coordinates move by (sx, sy, sz), to first order.

    With s a few units of round-off this is how well the energy of a stiff wall can be known at all.
    """
    raise NotImplementedError


@energy_doubt.register(walls.Chain)
def _(chain, law, mass, x, y, z, sx, sy, sz):
    surface = chain.first
    g = surfaces.gap_of(surface, surfaces.inner(surface, x, y, z))
    dx, dy, dz = surfaces.gradient(surface, x, y, z)
    # 2 V/g, which is the force up to the factor (a + 1)/2
    force = law_of.stiffness(law, g) * select(g > 0.0, g, 0.0) / mass
    here = force * (abs(dx) * sx + abs(dy) * sy + abs(dz) * sz)
    return here + energy_doubt(chain.rest, law, mass, x, y, z, sx, sy, sz)


@energy_doubt.register(Nothing)
def _(chain, law, mass, x, y, z, sx, sy, sz):
    return 0.0
