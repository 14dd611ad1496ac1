"""Resting under gravity: springs never come to rest, and events alone never get past the last bounce; Impact does."""

import math

import numpy as np
import pytest
from methods.passes import run, simulate

import swarm

pytestmark = pytest.mark.physics

G, ALPHA, DT = 9.81, 1e4, 2.0**-9
FLOOR = ([0.3, 0.2, 0.0], [0.0, 0.0, 0.0])


def floor(restitution=1.0):
    return swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, restitution=restitution)], gravity=(0.0, 0.0, -G))


@pytest.mark.parametrize("cls", [swarm.Penalty, swarm.Verlet, swarm.Midpoint, swarm.Trapezoidal])
def test_springs_never_rest(cls):
    """Laid on the floor it sinks in, twice as deep as its weight needs, and oscillates about that depth without end."""
    passes = run(cls(DT, ALPHA), floor(), *FLOOR, 512.0)
    depths = np.array([-one.position[2] for one in passes])
    assert depths.max() == pytest.approx(2.0 * G / ALPHA, rel=0.02)
    speeds = np.array([abs(one.velocity[2]) for one in passes])
    assert speeds[-64:].max() == pytest.approx(G * math.sqrt(1.0 / ALPHA), rel=0.05)


def test_impact_rests_at_once():
    """Not a bit moves, at no cost."""
    for time in (2.0, 2e6):
        result = simulate(floor(), swarm.Particles(*FLOOR), swarm.Impact(), time)
        assert result.particles.position[:, 0].tolist() == FLOOR[0]
        assert (result.particles.velocity == 0.0).all()
        assert result.observables["impacts"][-1] == 0
        assert result.observables["impulse"][-1][0] == pytest.approx(G * time, rel=1e-15)


def test_events_alone_do_not_get_past_the_last_bounce():
    """Zeno: with e = 0.9 the bounces after 1 m end at t = sqrt(2h/g) (1 + e)/(1 - e), and there are no fewer than all.

    Flight by flight time stands still before that instant: t + 2v/g == t. Impact goes on from there, at rest.
    """
    e = 0.9
    end = math.sqrt(2.0 / G) * (1.0 + e) / (1.0 - e)
    time, speed, still = math.sqrt(2.0 / G), e * math.sqrt(2.0 * G), 0
    for _bounce in range(2000):
        following = time + 2.0 * speed / G
        still += following == time
        time, speed = following, e * speed
    assert still > 1000
    assert time == pytest.approx(end, rel=1e-13)
    result = simulate(floor(e), swarm.Particles([0.0, 0.0, 1.0], [0.0, 0.0, 0.0]), swarm.Impact(), 2.0 * end)
    assert result.particles.position[:, 0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-15)
    assert (result.particles.velocity == 0.0).all()
    assert result.observables["sliding_time"][-1] == pytest.approx(end, rel=1e-9)
    assert result.observables["impacts"][-1] < 200
