"""Grazing down to 1e-12 rad: reflections alone never end, steps leave the wall or fail; Impact slides along it."""

import math

import numpy as np
import pytest
from physics.billiards import launched, ulps_outside, wall_frames, worst_energy

import swarm

pytestmark = pytest.mark.physics

RADIUS = 0.5
SPHERE = swarm.Scene([swarm.Sphere(RADIUS)])
# Unit speed: the crossing time is the radius, the default shortest flight 1e-4 of it.
SHORTEST = 1e-4 * RADIUS
BARE = swarm.Impact(shortest_flight=1e-300)
ANGLES = [0.0, 1e-12, 1e-9, 1e-6, 1e-5, 1e-4, 1e-3]


def launch(angle, number=20):
    """From random places of the wall, unit speed, at this angle [rad] from it."""
    return launched(*wall_frames((RADIUS,) * 3, number, 1), angle)


# --- What fails ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [1e-2, 1e-3, 1e-4, 1e-5])
def test_reflections_alone_cost_one_over_the_angle(angle):
    """|v| t/(2R sin angle) of them: 1e12 a second at 1e-12."""
    result = swarm.simulate(SPHERE, launch(angle, 5), BARE, until=1.0)
    number = 1.0 / (2.0 * RADIUS * math.sin(angle))
    assert result.observables["impacts"][-1] / 5 == pytest.approx(number, rel=1e-3, abs=1.0)


def test_with_soft_walls_it_circles_outside():
    """The spring must carry m v^2/R: Penalty keeps its energy, and stays outside by about m v^2/(alpha R)."""
    alpha = 1e4
    start = launch(1e-12)
    seen = swarm.simulate(SPHERE, start, swarm.Penalty(2.0**-9, alpha), until=2.0, every=2.0**-9).observables
    assert seen["energy_error"].max() <= 1e-12
    # It starts on the wall, so it swings about that depth: twice it at most.
    assert seen["max_penetration"].max() == pytest.approx(2.0 / (alpha * RADIUS), rel=0.05)


def test_fixed_steps_fail_where_the_flight_is_free():
    """AugmentedLagrangian: a chord of the step h if launched below its own angle, late by (h/R)^2/12.

    Above that angle the first step ends inside, the next one meets the wall in State II, and its loop has no limit.
    """
    h = 1.0 / 64.0
    method = swarm.AugmentedLagrangian(h, 1e6, tolerance=1e-20)
    own = math.asin(0.5 * h / RADIUS)
    chord = step(method, 1e-12)
    assert chord.converged
    assert math.atan2(*chord.position[-1][1::-1]) == pytest.approx(2.0 * math.atan(0.5 * h / RADIUS), rel=1e-9)
    assert step(method, 0.9 * own).converged
    free = step(method, 1.1 * own)
    assert (len(free), free.converged) == (1, True)
    assert not swarm.contact_history(SPHERE, free.position[0], free.velocity[0], 1.0, method).converged


def step(method, angle):
    """The first step after a launch from the wall."""
    return swarm.contact_history(SPHERE, (RADIUS, 0.0, 0.0), (-math.sin(angle), math.cos(angle), 0.0), 1.0, method)


# --- What does not ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", ANGLES)
def test_impact_slides_at_a_bounded_cost(angle):
    """On the wall to the last place, with its energy and its way along the wall; 2e4 steps a crossing at most."""
    start = launch(angle)
    result = swarm.simulate(SPHERE, start, swarm.Impact(), until=1.5, every=0.25)
    assert result.observables["impacts"][-1] / 20 <= 2.0 * 1.5 / SHORTEST
    assert max(result.observables["energy_error"].max(), worst_energy(start, result.particles)) <= 1e-15
    assert ulps_outside(SPHERE, result) <= 2.0
    r0, r1 = start.position / RADIUS, result.particles.position / np.linalg.norm(result.particles.position, axis=0)
    turned = np.arctan2(np.linalg.norm(np.cross(r0.T, r1.T), axis=1), (r0 * r1).sum(axis=0))
    # 3 rad for what follows the wall; chords of the angle are shorter than their arcs by angle^2/6.
    assert turned == pytest.approx(np.full(20, 3.0), rel=2e-9 + angle**2, abs=2.0 * angle)
