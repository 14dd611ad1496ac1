"""1e5 impacts per particle: energy, Joachimsthal's integral, penetration."""

import numpy as np
import pytest
from physics.billiards import equally_busy, joachimsthal, places_outside, run, scene_of, ulps_outside, worst_energy

import swarm

pytestmark = pytest.mark.long

IMPACTS = 100_000


def test_joachimsthals_integral_over_1e5_impacts():
    """(r.Av)^2 - (v.Av)(r.Ar - 1) of each of 100 particles, 1e-11 of itself."""
    scene = scene_of("ellipsoid")
    start = equally_busy(scene, swarm.fill(scene, 100, speed=0.5, seed=2), IMPACTS, 100.0)
    result = run(scene, start, swarm.Impact(), 100.0)
    assert result.observables["impacts"][-1] == pytest.approx(100 * IMPACTS, rel=0.05)
    assert np.abs(joachimsthal(result.particles) / joachimsthal(start) - 1.0).max() <= 1e-11


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "cut sphere", "box", "nested spheres", "ball in ellipsoid"])
def test_energy_over_1e5_impacts(name):
    """|v|^2 is restored at every impact, so its error does not grow: worst particle 1e-12."""
    scene = scene_of(name)
    start = swarm.fill(scene, 500, speed=0.5, mass=np.linspace(0.1, 10.0, 500), seed=20)
    result = run(scene, start, swarm.Impact(), 150_000.0, 1000.0)
    assert result.observables["impacts"][-1] >= 500 * IMPACTS
    assert result.observables["energy_error"].max() <= 1e-12
    assert worst_energy(start, result.particles) <= 1e-12
    assert ulps_outside(scene, result) <= 4.0


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "cut sphere", "ball in ellipsoid"])
@pytest.mark.parametrize("part", [1e-9, 1e-6, 1e-3, 1e-1])
def test_chords_over_1e5_impacts(name, part):
    """The chord step reflects too: the same bounds for every contact step, from 1e-9 to 0.1 of the crossing time."""
    scene = scene_of(name)
    start = swarm.fill(scene, 100, speed=0.5, seed=21)
    result = run(scene, start, swarm.Impact(contact_step=part * scene.size() / 0.5), 160_000.0, 1000.0)
    assert result.observables["impacts"][-1] >= 100 * IMPACTS
    assert result.observables["energy_error"].max() <= 1e-12
    assert places_outside(scene, result) <= 1.5


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "hemisphere"])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_penalty_over_1e5_steps(name, exponent):
    """Round-off in a solved step is the only source of error; ten times the steps of the physics ring."""
    scene = scene_of(name, gravity=(0.0, 0.0, -1.0))
    start = swarm.fill(scene, 50, speed=0.5, seed=22)
    result = run(scene, start, swarm.Penalty(0.0078125, 1e4, exponent), 781.25, 78.125)
    assert result.observables["energy_error"].max() <= 5e-11


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "cut sphere"])
@pytest.mark.parametrize("contact_step", [0.0, 1e-4])
def test_a_tangential_launch_slides_for_1e6_steps(name, contact_step):
    """Along the wall, chord by chord: the same bounds of energy and penetration as after impacts."""
    scene = scene_of(name)
    wall = {"sphere": (0.5, 0.0, 0.0), "cut sphere": (0.5, 0.0, 0.0), "ellipsoid": (0.3, 0.0, 0.0)}[name]
    start = swarm.Particles([[part, part] for part in wall], [[0.0, 0.0], [0.5, 0.3], [0.0, 0.4]])
    shortest = 1e-4
    method = swarm.Impact(contact_step=contact_step, shortest_flight=shortest)
    result = run(scene, start, method, 1.5e6 * shortest, 1e4 * shortest)
    assert result.observables["impacts"][-1] >= 1e6
    assert result.observables["energy_error"].max() <= 1e-12
    assert ulps_outside(scene, result) <= 4.0
