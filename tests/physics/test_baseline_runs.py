"""Verlet, Midpoint and Trapezoidal in lanes, with their jumps over free steps, against loops over every step."""

import numpy as np
import pytest

import swarm

pytestmark = pytest.mark.physics

RADIUS = 0.5


def verlet(r, v, pull, dt, stiffness):
    a = acceleration(r, pull, stiffness)
    end = r + dt * v + 0.5 * dt * dt * a
    return end, v + 0.5 * dt * (a + acceleration(end, pull, stiffness))


def midpoint(r, v, pull, dt, stiffness):
    middle = pushed(r + 0.5 * dt * v + 0.25 * dt * dt * pull, dt, stiffness)
    return 2.0 * middle - r, v + dt * acceleration(middle, pull, stiffness)


def trapezoidal(r, v, pull, dt, stiffness):
    a = acceleration(r, pull, stiffness)
    end = pushed(r + dt * v + 0.25 * dt * dt * (a + pull), dt, stiffness)
    return end, v + 0.5 * dt * (a + acceleration(end, pull, stiffness))


def acceleration(r, pull, stiffness):
    """`stiffness` is alpha/m."""
    distance = np.linalg.norm(r, axis=0)
    return pull - stiffness * np.maximum(distance - RADIUS, 0.0) / distance * r


def pushed(r, dt, stiffness):
    """s = r - dt^2/4 alpha/m (|s| - R) s/|s|, along the ray through r."""
    distance, c = np.linalg.norm(r, axis=0), 0.25 * dt * dt * stiffness
    return np.where(distance > RADIUS, (distance + c * RADIUS) / (1.0 + c), distance) / distance * r


RULES = {swarm.Verlet: verlet, swarm.Midpoint: midpoint, swarm.Trapezoidal: trapezoidal}


@pytest.mark.parametrize("gravity", [None, (0.3, -0.2, -1.0)], ids=["no gravity", "gravity"])
@pytest.mark.parametrize("cls", RULES, ids=lambda cls: cls.__name__)
def test_every_step_is_the_rule(cls, gravity):
    scene = swarm.Scene([swarm.Sphere(RADIUS)], gravity)
    dt, alpha, mass, steps = 0.01, 5e3, 2.0, 600
    particles = swarm.fill(scene, 100, speed=0.5, mass=mass, seed=4)
    result = swarm.simulate(scene, particles, cls(dt, alpha), until=steps * dt, every=100 * dt, compile="never")
    pull = np.zeros((3, 1)) if gravity is None else np.array(gravity)[:, None]
    ends = []
    for nudge in (0.0, 1e-15, -1e-15):
        r, v = particles.position * (1.0 + nudge), particles.velocity
        for _ in range(steps):
            r, v = RULES[cls](r, v, pull, dt, alpha / mass)
        ends.append(r)
    # How far round-off of the start takes the loop itself: grazing contacts of these rules let errors grow, to 1e-7.
    doubt = np.abs(np.array(ends[1:]) - ends[0]).max(axis=(0, 1))
    off = np.abs(result.particles.position - ends[0]).max(axis=0)
    median, most = np.percentile(off / (1e-14 + doubt), (50.0, 99.0))
    assert median <= 10.0
    assert most <= 100.0
    assert np.median(off) <= 1e-10
    # What does not conserve shows it: the measured error is no round-off.
    assert result.observables["energy_error"][-1] > 1e-6
