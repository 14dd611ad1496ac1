"""Stiff walls: dt sqrt(alpha/m) beyond 2 is too much for Verlet, and nothing for what conserves by construction."""

import numpy as np
import pytest

import swarm

pytestmark = pytest.mark.physics

SPHERE = swarm.Scene([swarm.Sphere(0.5)])
DT = 2.0**-7


def worst_energy(cls, stiffness, impacts=30.0):
    """Largest relative energy error at 200 frames, of 8 particles with so many impacts each."""
    method = cls(dt=DT, penalty=(stiffness / DT) ** 2)
    particles = swarm.fill(SPHERE, 8, speed=0.5, seed=2)
    every = 2.0 * round(impacts * 4.0 / 3.0 / 400.0 / DT) * DT
    return swarm.simulate(SPHERE, particles, method, until=200 * every, every=every).observables["energy_error"].max()


@pytest.mark.parametrize("stiffness", [0.01, 0.3, 2.5, 100.0])
def test_penalty_keeps_its_energy_at_any_stiffness(stiffness):
    assert worst_energy(swarm.Penalty, stiffness) <= 1e-12


def test_verlet_is_gone_beyond_two():
    assert worst_energy(swarm.Verlet, 0.3) < 1.0
    with pytest.raises(swarm.RunError, match="position or velocity are no longer finite numbers"):
        worst_energy(swarm.Verlet, 2.5)


@pytest.mark.parametrize("cls", [swarm.Midpoint, swarm.Trapezoidal])
def test_implicit_rules_are_stable_and_do_not_conserve(cls, compiled_at_once):
    """A-stable for a spring that never lets go; each contact that begins and ends changes the energy."""
    assert worst_energy(cls, 0.3) > 1e-6
    assert worst_energy(cls, 3.0) > 1e-2


def test_the_error_of_verlet_falls_with_the_step():
    """It is no mistake of the baseline: at a fixed wall, a quarter of the step is a smaller error."""
    particles, errors = swarm.fill(SPHERE, 60, speed=0.5, seed=2), []
    for dt in (2.0**-8, 2.0**-10, 2.0**-12):
        end = swarm.simulate(SPHERE, particles, swarm.Verlet(dt, 1e4), until=16.0, every=1.0, compile="always")
        errors.append(float(end.observables["energy_error"].max()))
    assert errors[1] < 0.5 * errors[0]
    assert errors[2] < 0.5 * errors[1]
    assert np.isfinite(errors).all()
