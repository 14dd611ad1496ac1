"""Impact with a contact step h > 0: the conserving chord of the paper, along the wall."""

import numpy as np
import pytest
from conftest import rarely
from physics.billiards import places_outside, run, scene_of, worst_energy

import swarm

pytestmark = pytest.mark.physics

SHAPES = ["sphere", "ellipsoid", "cut sphere", "ball in ellipsoid"]


@pytest.mark.parametrize("name", ["ellipsoid", *(rarely(name) for name in SHAPES if name != "ellipsoid")])
@pytest.mark.parametrize("part", [1e-9, 1e-7, 1e-5, 1e-3, 1e-2, 1e-1])
def test_chords_keep_energy_and_walls(name, part):
    """A chord is a reflection about the discrete gradient: |v| stays, both its ends are on the wall; 1e3 impacts."""
    scene = scene_of(name)
    start = swarm.fill(scene, 200, speed=0.5, seed=12)
    result = run(scene, start, swarm.Impact(contact_step=part * scene.size() / 0.5), 1600.0, 8.0, "always")
    assert result.observables["impacts"][-1] >= 200 * 1000
    assert result.observables["energy_error"].max() <= 1e-12
    assert worst_energy(start, result.particles) <= 1e-12
    assert places_outside(scene, result) <= 1.5


@pytest.mark.parametrize("name", SHAPES)
def test_chords_tend_to_the_reflection(name):
    """The chord leaves the exact billiard by O(h) at each impact: order 1 in h."""
    scene = scene_of(name)
    start = swarm.fill(scene, 200, speed=0.5, seed=13)
    exact = run(scene, start, swarm.Impact(), 2.0).particles.position
    steps = [1e-4, 1e-5, 1e-6, 1e-7]
    errors = []
    for h in steps:
        end = run(scene, start, swarm.Impact(contact_step=h), 2.0).particles.position
        errors.append(np.median(np.linalg.norm(end - exact, axis=0)))
    slopes = -np.diff(np.log10(errors))
    assert (np.abs(slopes - 1.0) <= 0.1).all(), slopes
