"""Random cavities x solids x gravity x contact steps begun before the impact: energy, walls, and one limit of both.

A failure prints the seed: `python -m pytest "tests/stability/test_contact_starts.py::test_both_methods[SEED]"`.
"""

import numpy as np
import pytest
from conftest import rarely
from methods.passes import simulate

import swarm

pytestmark = pytest.mark.physics

SEEDS = [0, 1, 2, *map(rarely, range(3, 60))]
VESSELS = [
    lambda random: [swarm.Sphere(0.5)],
    lambda random: [swarm.Ellipsoid(tuple(random.uniform(0.35, 0.7, 3)), rotation=tuple(random.standard_normal(4)))],
    lambda random: [swarm.Box((0.5, 0.4, 0.35), rotation=tuple(random.standard_normal(4)))],
    lambda random: [swarm.Torus(0.6, 0.3)],
    lambda random: [swarm.Capsule(0.35, 0.5, tuple(random.standard_normal(3)))],
    lambda random: [swarm.Cylinder(0.4, tuple(random.standard_normal(3)), 0.8)],
    lambda random: [swarm.Cone(0.7, center=(0.0, 0.0, -0.5)), swarm.Plane((0.0, 0.0, 1.0), 0.3)],
    lambda random: [swarm.Paraboloid(0.2, center=(0.0, 0.0, -0.5)), swarm.Plane((0.0, 0.0, 1.0), 0.2)],
]
SOLIDS = [
    lambda random: [],
    lambda random: [swarm.Sphere(0.1, tuple(random.uniform(-0.1, 0.1, 3)), side="outside")],
    lambda random: [swarm.Ellipsoid((0.08, 0.1, 0.15), tuple(random.uniform(-0.1, 0.1, 3)), side="outside")],
    lambda random: [swarm.Box((0.1, 0.12, 0.09), side="outside", rotation=tuple(random.standard_normal(4)))],
    lambda random: [swarm.Torus(0.15, 0.05, side="outside")],
    lambda random: [swarm.Plane(tuple(random.standard_normal(3)), 0.2), swarm.Plane((0.0, 1.0, 0.05), 0.1)],
]


@pytest.mark.parametrize("seed", SEEDS)
def test_both_methods(seed):
    """Frames cut their steps; without gravity each of a few impacts is the same."""
    random = np.random.default_rng(seed)
    walls = [pick(random) for kind in (VESSELS, SOLIDS) for pick in [kind[random.integers(len(kind))]]]
    gravity = None if random.random() < 0.5 else tuple(random.standard_normal(3))
    scene = swarm.Scene([wall for some in walls for wall in some], gravity)
    start = swarm.fill(scene, 4, speed=1.0, seed=seed)
    h = min(scene.size(), 0.3) * 10.0 ** random.uniform(-4.0, 0.0)
    methods = [swarm.Impact(contact_step=h, contact_start="centred", shortest_flight=1e-9)]
    if gravity is None:
        loop = {"penalty": 9.0 / (h * h), "tolerance": 1e-28, "max_sweeps": 999, "acceleration": "reflection"}
        given = {"adaptive": True, "contact_start": "centred", "on_unconverged": "impact"}
        methods.append(swarm.AugmentedLagrangian(h, **loop, **given))
    ends = []
    for method in methods:
        result = simulate(scene, start, method, 1.5, random.uniform(0.05, 0.2) if len(ends) == 0 else None)
        case = f"seed {seed}: {scene.surfaces}, gravity={gravity}, {method}"
        assert result.observables["energy_error"].max() <= 1e-13, case
        assert result.observables["max_penetration"].max() <= 64.0 * np.spacing(scene.extent()), case
        ends.append(result)
    if gravity is None:
        # Both cut by the same frames: by none.
        first = simulate(scene, start, methods[0], 1.5)
        off = np.linalg.norm(first.particles.position - ends[1].particles.position, axis=0)
        assert np.median(off) <= 1e-8, (f"seed {seed}", off)
