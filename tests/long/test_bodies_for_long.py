"""10^5 impacts of each body: energy, links, angular momentum and walls. `pytest -m long -s` prints what is left.

A step changes the energy by 1.5e-16 of it at random, a blow by 3e-16: after the 4e6 steps of 10^5 impacts the worst of
32 bodies was off by 3e-12. Each blow restores what is round-off.
"""

import itertools
import math

import numpy as np
import pytest

import swarm

pytestmark = pytest.mark.long

IMPACTS, COPIES, STEP = 100_000, 32, 5e-3
MAKERS = {"dumbbell": lambda: swarm.dumbbell(0.1, 2.0), "tetrahedron": lambda: swarm.tetrahedron(0.1, 4.0)}


@pytest.mark.parametrize("kind", MAKERS)
def test_a_hundred_thousand_impacts_of_each_body_in_a_sphere(kind):
    scene = swarm.Scene([swarm.Sphere(0.2)])
    start = swarm.place(scene, MAKERS[kind](), COPIES, speed=1.0, spin=4.0, seed=1)
    rate = swarm.simulate(scene, start, swarm.Impact(dt=STEP), until=50.0).observables["impacts"][-1] / 50.0 / COPIES
    until = 1.05 * IMPACTS / rate
    seen = swarm.simulate(scene, start, swarm.Impact(dt=STEP), until=until, every=until / 20.0).observables
    turned = np.abs(seen["angular_momentum"] - seen["angular_momentum"][0]).max()
    turned /= np.abs(seen["angular_momentum"][0]).max()
    worst = {name: seen[name].max() for name in ("energy_error", "link_error", "max_penetration")}
    print(f"\n{kind}: {seen['impacts'][-1] / COPIES:.0f} impacts of each, angular momentum {turned:.1e}, {worst}")
    assert seen["impacts"][-1] >= IMPACTS * COPIES
    assert seen["energy_error"].max() < 1e-12
    assert seen["link_error"].max() < 1e-13
    assert turned < 1e-11
    assert seen["max_penetration"].max() < 1e-15


def test_a_wall_with_a_temperature_gives_bricks_three_halves_of_it_in_translation_and_in_rotation():
    """k_B T/2 for each of six degrees of freedom, within five standard errors of 600 bricks at 20 instants."""
    edges, energy, count = np.array([0.1, 0.06, 0.03]), 0.01, 600
    brick = swarm.rigid(0.5 * edges * np.array(list(itertools.product((-1.0, 1.0), repeat=3))), 1e3)
    scene = swarm.Scene([swarm.Box((0.3, 0.3, 0.3), temperature=energy)])
    start = swarm.place(scene, brick, count, speed=0.2, spin=2.0, seed=1)
    result = swarm.simulate(scene, start, swarm.Impact(dt=5e-3), until=24.0, every=1.0, seed=3, progress=False)
    mean = result.observables["total_energy"][5:].mean() / count / energy
    assert abs(mean - 3.0) < 5.0 * math.sqrt(3.0 / count / 10.0)
    shares = brick.mass_matrix.sum(axis=0)
    drift = np.tensordot(shares, result.bodies.velocity, axes=(0, 1)) / shares.sum()
    moving = 0.5 * shares.sum() * (drift**2).sum(axis=0).mean() / energy
    assert abs(moving - 1.5) < 5.0 * math.sqrt(1.5 / count)
