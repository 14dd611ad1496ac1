"""Gases and grains of balls that walls work on or heat, against closed forms: compiled."""

import itertools
import math

import numpy as np
import pytest

import swarm

pytestmark = pytest.mark.long


def lattice(counts, lengths, radius, seed=1):
    """Balls of a gas on a lattice in a box from 0 on, at random velocities of one temperature, 1/m."""
    random = np.random.default_rng(seed)
    axes = [(np.arange(n) + 0.5) * length / n for n, length in zip(counts, lengths, strict=True)]
    position = np.array(list(itertools.product(*axes))).T
    velocity = random.normal(size=position.shape)
    velocity -= velocity.mean(axis=1, keepdims=True)
    return swarm.Particles(position, velocity, radius=radius)


def compressibility(x):
    """Carnahan and Starling's."""
    return (1 + x + x * x - x**3) / (1 - x) ** 3


def test_a_slow_piston_heats_hard_spheres_by_their_adiabat():
    """d ln T = (2/3) Z d ln(packing), from 0.15 to 0.225."""
    across, long, speed = 6.0, 90.0, 0.05
    start = lattice((90, 6, 6), (long, across, across), 0.5)
    packing = len(start) * math.pi / 6.0 / (long * across * across)
    # The packing of the lattice, by smaller balls
    radius = 0.5 * (0.15 / packing) ** (1 / 3)
    start = lattice((90, 6, 6), (long, across, across), radius)
    diameter = 2.0 * radius
    piston = swarm.Plane((1.0, 0.0, 0.0), long, motion=swarm.Translation((-speed, 0.0, 0.0)))
    scene = swarm.Scene([swarm.Plane((-1.0, 0.0, 0.0), 0.0), piston], period=(None, across, across))
    until = long / 3.0 / speed
    seen = swarm.simulate(scene, start, swarm.Impact(), until=until, every=until / 10, compile="always").observables
    # Centres keep half a diameter away from both walls.
    free = long - diameter - speed * seen["time"]
    x = len(start) * math.pi / 6.0 * diameter**3 / (free * across * across)
    grid = [np.linspace(x[0], end, 2001) for end in x]
    area = [np.trapezoid(compressibility(one) / one, one) if one[-1] > one[0] else 0.0 for one in grid]
    hot = seen["kinetic_energy"] / seen["kinetic_energy"][0]
    np.testing.assert_allclose(hot, np.exp(2.0 / 3.0 * np.array(area)), rtol=0.03)
    assert seen["energy_error"].max() < 1e-12
    np.testing.assert_allclose(seen["wall_work"][-1].sum(), np.diff(seen["kinetic_energy"][[0, -1]])[0], rtol=1e-10)


def test_heat_goes_through_a_dense_gas_from_the_hot_plate_to_the_cold_one():
    across, long = 6.0, 12.0
    start = lattice((12, 6, 6), (long, across, across), 0.35)
    plates = [
        swarm.Plane((-1.0, 0.0, 0.0), 0.0, temperature=2.0), swarm.Plane((1.0, 0.0, 0.0), long, temperature=1.0)
    ]  # fmt: skip
    scene = swarm.Scene(plates, period=(None, across, across))
    run = swarm.simulate(scene, start, swarm.Impact(), until=600.0, every=100.0, compile="always")
    heat = np.diff(run.observables["wall_heat"], axis=0)[1:]
    flow = heat.mean(axis=0) / 100.0 / across**2
    assert flow[0] > 0.0 > flow[1]
    np.testing.assert_allclose(flow[0], -flow[1], rtol=0.1)
    assert run.observables["energy_error"].max() < 1e-11
    # Chapman and Enskog's conductivity in units of the diameter at the mean temperature, for a dilute gas, is
    # 75/(64 sqrt(pi)) sqrt(k T/m)/d^2; of a dense one there is more, by Enskog's factor; plates take some off.
    dilute = 75.0 / 64.0 * math.sqrt(1.5 / math.pi) / 0.7**2 / long
    assert 0.5 * dilute < flow[0] < 2.0 * dilute
    mean = run.observables["kinetic_energy"][2:] / (1.5 * len(start))
    assert (mean > 1.1).all()
    assert (mean < 1.9).all()


@pytest.mark.parametrize("motion", [
    swarm.Oscillation((0.0, 0.0, 0.01), 20.0), swarm.Rotation((0.0, 1.0, 0.0), 3.0, (0.0, 0.0, 0.0)),
], ids=["shaker", "drum"])  # fmt: skip
def test_grains_in_a_vessel_that_moves(motion):
    """They stay within it, and the work of the walls is what they lose."""
    x = np.linspace(-0.15, 0.15, 4)
    position = np.array(list(itertools.product(x, x, x))).T
    walls = [swarm.Box((0.25, 0.25, 0.25), restitution=0.8, friction=0.3, motion=motion)]
    scene = swarm.Scene(walls, gravity=(0.0, 0.0, -9.81), pairs=swarm.Pairs(0.8))
    start = swarm.Particles(position, 0.0 * position, radius=0.04)
    seen = swarm.simulate(scene, start, swarm.Impact(), until=4.0, every=0.5, compile="always").observables
    assert seen["energy_error"].max() < 1e-11
    assert seen["max_penetration"].max() < 1e-13
    assert seen["wall_work"][-1].sum() > 0.0
    assert seen["dissipated_energy"][-1] > seen["dissipated_energy"][4] > 0.0
