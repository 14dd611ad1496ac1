"""The energy that the walls store, summed over all surfaces of a scene, and how well it is known."""

from ..kernel.gravity import Nothing, potential, weight
from ..kernel.jit import by_type, inlined, select
from ..surfaces import base as surfaces
from ..surfaces import chain as walls
from . import regularisation as law_of

# Units of round-off by which a contact that is solved may miss its energy.
_ROUND_OFF = 64.0 * 2.220446049250313e-16


@by_type
def contact_energy(law, chain, over_mass, x, y, z):
    """Energy per mass that one particle stores in the walls, by 1/mass; rigid walls (None) store none."""
    raise NotImplementedError


@contact_energy.register(Nothing)
def _(law, chain, over_mass, x, y, z):
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
def _(law, chain, over_mass, x, y, z):
    return _stored(chain, law, x, y, z) * over_mass


@by_type
def energy_doubt(chain, law, over_mass, x, y, z, sx, sy, sz):
    """How far the stored energy per mass moves when the coordinates move by (sx, sy, sz), to first order.

    With s a few units of round-off this is how well the energy of a stiff wall can be known at all.
    """
    raise NotImplementedError


@energy_doubt.register(walls.Chain)
def _(chain, law, over_mass, x, y, z, sx, sy, sz):
    surface = chain.first
    g = surfaces.gap_of(surface, surfaces.inner(surface, x, y, z))
    dx, dy, dz = surfaces.gradient(surface, x, y, z)
    # 2 V/g, which is the force up to the factor (a + 1)/2
    force = law_of.stiffness(law, g) * select(g > 0.0, g, 0.0) * over_mass
    here = force * (abs(dx) * sx + abs(dy) * sy + abs(dz) * sz)
    return here + energy_doubt(chain.rest, law, over_mass, x, y, z, sx, sy, sz)


@energy_doubt.register(Nothing)
def _(chain, law, over_mass, x, y, z, sx, sy, sz):
    return 0.0


@inlined
def restored(law, chain, gravity, over_mass, energy, h, x0, y0, z0, x, y, z, vx, vy, vz, force):
    """Factor of v after a contact step that gives the particle its first energy back, and whether it is that near to 1.

    Each step conserves energy to round-off: V(g) feels the last bit of r, which in a stiff contact is 1e-13 of the
    energy, and over many contacts the errors add up (measured: 2e-10 after 10 000 steps at dt sqrt(alpha/m) = 100). A
    larger difference than round-off is not touched: it is an equation that was not solved, or a tolerance.
    `force` is what multipliers add to the springs, per mass.
    """
    speed2 = vx * vx + vy * vy + vz * vz
    stored = contact_energy(law, chain, over_mass, x, y, z)
    missing = 2.0 * (energy - potential(gravity, x, y, z) - stored) - speed2
    # Where the coordinates of the step have their last bits.
    sx, sy, sz = abs(x0) + abs(x) + h * abs(vx), abs(y0) + abs(y) + h * abs(vy), abs(z0) + abs(z) + h * abs(vz)
    doubt = energy_doubt(chain, law, over_mass, x0, y0, z0, sx, sy, sz)
    doubt += energy_doubt(chain, law, over_mass, x, y, z, sx, sy, sz)
    doubt += speed2 + abs(energy) + weight(gravity, sx, sy, sz) + force * (sx + sy + sz)
    balanced = abs(missing) <= _ROUND_OFF * doubt
    return 1.0 + select(balanced & (speed2 > 0.0), 0.5 * missing / speed2, 0.0), balanced
