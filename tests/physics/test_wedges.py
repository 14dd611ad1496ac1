"""Wedges by default settings: Galperin's blocks, whose impacts are the digits of pi, and others down to 1e-3 rad."""

import math

import numpy as np
import pytest
from physics.billiards import run, unfolded

import swarm

pytestmark = pytest.mark.physics

DIGITS = [3, 31, 314, 3141, 31415]
# The last impact of the wedge of 0.01 rad is 2 s after the edge is passed.
UNTIL = 30.0


def wedge(angle):
    """Between y = 0 and the ray at `angle`; its edge is the z axis."""
    side = swarm.Plane((-math.sin(angle), math.cos(angle), 0.0), 0.0)
    return swarm.Scene([swarm.Plane((0.0, -1.0, 0.0), 0.0), side])


@pytest.mark.parametrize("n", range(5))
def test_galperins_blocks(n):
    """A block of mass 100^n M runs at one of M at rest, between it and a wall: x sqrt(mass) are x and y of a wedge."""
    angle = math.atan(10.0**-n)
    r, v = np.array([1.0, 0.5 * math.tan(angle), 0.0]), np.array([-1.0, 0.0, 0.0])
    where, velocity, impacts = unfolded(r, v, angle, UNTIL)
    assert impacts == DIGITS[n], "the closed form"
    result = run(wedge(angle), swarm.Particles(r, v), swarm.Impact(), UNTIL, compile="always" if n == 4 else "never")
    assert result.observables["impacts"][-1] == DIGITS[n]
    assert result.impacts_per_particle.tolist() == [DIGITS[n]]
    assert result.particles.velocity[:, 0] == pytest.approx([*velocity, 0.0], abs=1e-10)
    assert result.particles.position[:, 0] == pytest.approx([*where, 0.0], abs=1e-10 * UNTIL)
    assert result.observables["sliding_time"][-1] == 0.0
    assert result.observables["energy_error"].max() <= 1e-14


@pytest.mark.parametrize("n", range(5))
def test_galperins_blocks_one_by_one(n):
    """The count and the last velocities again, from the collisions of the two blocks themselves."""
    heavy, light, impacts = -1.0, 0.0, 0
    ratio = 100.0**n
    while heavy < light or light < 0.0:
        if heavy < light:
            both = (ratio * heavy + light) / (ratio + 1.0)
            heavy, light = 2.0 * both - heavy, 2.0 * both - light
        else:
            light = -light
        impacts += 1
    assert impacts == DIGITS[n]
    angle = math.atan(10.0**-n)
    r, v = np.array([1.0, 0.5 * math.tan(angle)]), np.array([-1.0, 0.0])
    _, velocity, _ = unfolded(r, v, angle, UNTIL)
    # y = x_light, x = 10^n x_heavy: in units of the heavy block's speed.
    assert velocity == pytest.approx([heavy, light / 10.0**n], abs=1e-10)


@pytest.mark.parametrize("angle", [1.0, 0.1, 0.01, 1e-3])
def test_every_impact_in_a_wedge(angle):
    """Their number is that of the mirror images passed; the direction afterwards is that in the last of them."""
    random, until = np.random.default_rng(1), 2.5
    launches = []
    for _ in range(10):
        part, aim = random.uniform(0.2, 0.8), random.uniform(0.05, 0.3)
        launches.append(
            (
                [math.cos(part * angle), math.sin(part * angle), 0.0],
                [-math.cos(aim), random.choice([-1.0, 1.0]) * math.sin(aim), 0.1],
            )
        )
    r, v = np.array(launches).transpose(1, 2, 0)
    expected = [unfolded(r[:, i], v[:, i], angle, until) for i in range(10)]
    result = run(wedge(angle), swarm.Particles(r, v), swarm.Impact(), until)
    counts = [impacts for _, _, impacts in expected]
    assert min(counts) >= 0.7 * math.pi / angle - 1.0
    assert result.impacts_per_particle.tolist() == counts
    assert result.observables["impacts"][-1] == sum(counts)
    assert np.abs(result.particles.velocity[:2].T - [w for _, w, _ in expected]).max() <= 1e-10
    assert np.abs(result.particles.position[:2].T - [z for z, _, _ in expected]).max() <= 3e-10
    assert result.particles.position[2] == pytest.approx(0.1 * until, rel=1e-12)
    assert result.observables["energy_error"].max() <= 1e-14
