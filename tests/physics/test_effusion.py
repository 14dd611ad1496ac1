"""Effusion from a vessel through a small hole, and the survival in an open billiard: n v A/4."""

import numpy as np
import pytest
from conftest import rarely

import swarm
from examples import effusion

pytestmark = pytest.mark.physics


@pytest.mark.parametrize("hot", [False, rarely(True)])
def test_a_gas_leaves_by_the_law(hot):
    count = 6_000
    gas = effusion.run(count, hot, frames=4)
    assert gas.left[0] == 1.0
    assert 0.1 < gas.left[-1] < 0.25
    assert (np.abs(gas.left - gas.law)[1:] < 3.0 * gas.error[1:]).all()
    # Of one that flies out fast ones are more: 2 kT in place of 3/2 kT, as long as the gas is as at the start.
    mean, error = gas.escape_energy
    early = 2.0 * (1.0 if hot else gas.energy_law[0] + 0.5 * (gas.energy_law[1] - gas.energy_law[0]))
    assert abs(mean - early) < 3.0 * error
    # What is left has spread: of n energies the mean has a standard error of (2/3n)^(1/2).
    assert np.abs(gas.energy / gas.energy_law - 1.0).max() < 3.0 * np.sqrt(2.0 / (3.0 * count * gas.left[-1]))
    assert gas.balance < 1e-13


def test_an_open_billiard_is_survived_by_an_exponential():
    """The flow in a box around a ball mixes: exp(-v A t/4V) of the particles of one speed are left."""
    scene, count, speed = effusion.vessel(hot=False), 8_000, 2.0
    start = swarm.fill(scene, count, speed=speed, seed=3)
    rate = effusion.REACHES * speed
    found = swarm.simulate(scene, start, swarm.Impact(), until=1.0 / rate, every=0.125 / rate)
    time, left = found.observables["time"], 1.0 - found.observables["escaped"] / count
    law = np.exp(-rate * time)
    assert (np.abs(left - law)[1:] < 3.0 * np.sqrt(law * (1.0 - law) / count)[1:]).all()
    # Between the frames too: the times themselves are those of the law.
    gone = np.sort(found.escape_time[np.isfinite(found.escape_time)])
    expected = 1.0 - np.exp(-rate * gone)
    assert len(gone) == found.observables["escaped"][-1]
    # Kolmogorov and Smirnov: exceeded by chance once in 10^4
    assert np.abs(np.arange(1, len(gone) + 1) / count - expected).max() < 2.2 / np.sqrt(count)
    # No other particle left, and those that left are in the hole.
    out = np.isfinite(found.escape_time)
    hole = scene.surfaces[0].openings[0]
    assert (hole.phi(found.particles.position[:, out]) <= 0.0).all()
    assert np.abs(found.particles.position[0, out] - effusion.HALF).max() < 1e-15
    assert found.observables["max_penetration"].max() < 1e-15
    assert found.observables["energy_error"].max() < 1e-14
