"""The energy that the walls store, summed over all surfaces of a scene."""

from .._jit import by_type
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
