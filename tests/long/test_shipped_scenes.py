"""1e6 impacts of each of four particles in every shipped scene: energy, walls, and what its symmetry keeps.

tests/long/test_escapes.py runs them as they are; here they lose nothing. `pytest -m long -s` prints what was seen.
"""

import numpy as np
import pytest
from stability.witnesses import SCENES, fly, joachimsthals_integral, shipped, sideways, spin

pytestmark = pytest.mark.long

PARTICLES, IMPACTS = 4, 1_000_000
# Box and obstacles have no symmetry: their energy is the witness.
WITNESSES = {
    "ball_in_ellipsoid": [spin],
    "bowl": [spin],
    "box": [],
    "cavity": [joachimsthals_integral, spin],
    "floor": [spin],
    "formula": [spin],
    "groove": [sideways],
    "multipliers": [spin],
    "obstacles": [],
    "splash": [spin],
}


def test_every_shipped_scene_is_here():
    assert sorted(WITNESSES) == sorted(path.stem for path in SCENES.glob("*.toml"))


@pytest.mark.parametrize("name", WITNESSES)
def test_a_million_impacts(name, capsys):
    scene, start, method = shipped(name, PARTICLES)
    result, impacts = fly(scene, start, method, IMPACTS)
    seen = result.observables
    changes = {}
    for witness in WITNESSES[name]:
        before, after = witness(scene, start), witness(scene, result.particles)
        changes[witness.__name__] = float(np.abs(after / before - 1.0).max())
    outside = float(seen["max_penetration"].max() / np.spacing(scene.finite_size()))
    with capsys.disabled():
        energy = float(seen["energy_error"].max())
        print(f"\n{name:18} {impacts:>11,} impacts, energy {energy:.1e}, {outside:.1f} ulp outside, {changes}", end="")
    assert impacts >= PARTICLES * IMPACTS
    assert seen["energy_error"].max() <= 1e-12
    assert outside <= 64.0
    assert all(change <= 1e-8 for change in changes.values()), changes
