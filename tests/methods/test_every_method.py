"""What holds for every method of the table, pass by pass."""

import numpy as np
import pytest
from conftest import METHODS
from passes import run

import swarm


@pytest.mark.parametrize("gravity", [None, (0.0, 0.5, -1.0)], ids=["no gravity", "gravity"])
# A pass here runs no loop of multipliers.
@pytest.mark.parametrize("name", [name for name in METHODS if not METHODS[name].has_multipliers()])
def test_impulses_and_momentum_agree(name, gravity):
    """Over a bounce the momentum changes by what the wall gave, along its normal, and by what gravity gave."""
    floor = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0)], gravity)
    method, start = METHODS[name], np.array([0.3, 0.2, -1.0])
    span = method.span("until", 0.5)
    passes = run(method, floor, [0.1, 0.2, 0.3], start, span)
    given = sum(one.impulse for one in passes)
    fallen = 0.5 * np.array(gravity or (0.0, 0.0, 0.0))
    assert given[0] > 1.9
    assert passes[-1].velocity - start == pytest.approx(fallen + np.array([0.0, 0.0, given[0]]), abs=1e-12)
    assert sum(one.hits for one in passes) == 1


@pytest.mark.parametrize("name", [name for name in METHODS if not METHODS[name].has_multipliers()])
def test_a_particle_at_rest_in_the_middle_stays_there(name):
    """There the distance has no gradient: plain Python raised for the 1/0 that a kernel carries on with."""
    cavity = swarm.Scene([swarm.Sphere(0.5)])
    result = swarm.simulate(cavity, swarm.Particles([0.0] * 3, [0.0] * 3), METHODS[name], until=1.0, compile="never")
    assert not result.particles.position.any()
    assert not result.particles.velocity.any()
