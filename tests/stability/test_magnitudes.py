"""Metres, seconds and kilograms are names: other units, over 24 decades, leave the dimensionless result as it is.

Powers of two, which floating-point numbers carry in the exponent alone, change no bit; other factors change round-off.
"""

import functools

import numpy as np
import pytest

import swarm

NUMBER = 12
# Powers of 2 of length, time and mass: 2^40 is 1e12.
UNITS = [(40, 0, 0), (-40, 0, 0), (0, 40, 0), (0, -40, 0), (0, 0, 40), (0, 0, -40), (13, -27, 39)]


def sphere(length, time):
    return swarm.Scene([swarm.Sphere(0.4 * length)])


METHODS = {
    "impact": lambda length, time, mass: swarm.Impact(),
    "impact, chord": lambda length, time, mass: swarm.Impact(contact_step=2.0**-8 * time),
    "penalty": lambda length, time, mass: swarm.Penalty(2.0**-8 * time, 3e4 * mass / time**2),
    "verlet": lambda length, time, mass: swarm.Verlet(2.0**-8 * time, 3e4 * mass / time**2),
    "midpoint": lambda length, time, mass: swarm.Midpoint(2.0**-8 * time, 3e4 * mass / time**2),
    "trapezoidal": lambda length, time, mass: swarm.Trapezoidal(2.0**-8 * time, 3e4 * mass / time**2),
    "augmented Lagrangian": lambda length, time, mass: swarm.AugmentedLagrangian(
        2.0**-8 * time,
        3e4 * mass / time**2,
        tolerance=1e-12 * mass * (length / time) ** 2,
        adaptive=True,
        acceleration="reflection",
        on_unconverged="impact",
    ),
}


@functools.cache
def ends(name, scene_of, length=1.0, time=1.0, mass=1.0, until=8.0):
    """Positions over lengths, velocities over speeds, and what is seen of the run, all without unit.

    `scene_of(length, time)` is the scene in these units.
    """
    start = swarm.fill(scene_of(1.0, 1.0), NUMBER, speed=0.5, seed=1)
    particles = swarm.Particles(start.position * length, start.velocity * length / time, start.mass * mass)
    method = METHODS[name](length, time, mass)
    result = swarm.simulate(scene_of(length, time), particles, method, until=until * time, every=0.25 * until * time)
    seen = result.observables
    return (
        result.particles.position / length,
        result.particles.velocity / length * time,
        seen["impulse"] / mass / length * time,
        seen["energy_error"],
        seen["max_penetration"] / length,
        seen["impacts"],
    )


@pytest.mark.physics
@pytest.mark.parametrize("name", ["impact", "penalty", "verlet", "midpoint", "trapezoidal"])
def test_units_change_no_bit(name):
    require_the_same_bits(name, sphere, NUMBER * 6)


FALLING = (0.2, 0.0, -1.0)


def three_walls(rigid, pull):
    """Soft walls only where the gap is a length: an ellipsoid's has no unit."""

    def scene(length, time):
        surfaces = [
            swarm.Ellipsoid((0.3 * length, 0.4 * length, 0.6 * length)) if rigid else swarm.Sphere(0.4 * length),
            swarm.Plane((0.0, 0.0, -1.0), 0.25 * length),
            swarm.Sphere(0.1 * length, side="outside"),
        ]
        return swarm.Scene(surfaces, pull and tuple(a * length / time**2 for a in pull))

    return scene


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "pull"),
    # Steps that are cut at the impact refuse gravity.
    [(name, pull) for name in METHODS for pull in (None, FALLING) if pull is None or "Lagrangian" not in name],
)
def test_units_change_no_bit_of_three_walls(name, pull):
    require_the_same_bits(name, three_walls(name.startswith("impact"), pull), NUMBER * 7)


def require_the_same_bits(name, scene_of, impacts):
    one = ends(name, scene_of)
    assert one[-1][-1] > impacts
    for powers in UNITS:
        for first, other in zip(one, ends(name, scene_of, *(2.0**k for k in powers)), strict=True):
            assert np.array_equal(first, other), powers


def change(name):
    """The largest change of a position by decimal units, whose products are rounded, after some ten impacts."""
    one = ends(name, sphere)[0]
    units = [(12, 0, 0), (-12, 0, 0), (0, 12, 0), (0, -12, 0), (0, 0, 12), (0, 0, -12)]
    return max(np.abs(ends(name, sphere, *(10.0**k for k in powers))[0] - one).max() for powers in units)


@pytest.mark.physics
@pytest.mark.parametrize(("name", "bound"), [("impact", 1e-12), ("penalty", 1e-9)])
def test_decimal_units_change_round_off(name, bound):
    assert change(name) <= bound


@pytest.mark.physics
@pytest.mark.parametrize("name", ["verlet", "midpoint"])
def test_baselines_amplify_round_off(name):
    """Where in a step a contact begins decides what it does to the energy, and so to the next contact."""
    assert change(name) > 1e-6
