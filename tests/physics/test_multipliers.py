"""AugmentedLagrangian in lanes: energy and walls over many contacts, its limit, the same bits; the mean-value form."""

import math

import numpy as np
import pytest
from conftest import rarely
from physics.billiards import run, scene_of, ulps_outside, worst_energy

import swarm

pytestmark = pytest.mark.physics

ALPHA = 1e4
# One compilation takes ten seconds; the unit tests have the other shapes.
SHAPES = ["ellipsoid", "nested spheres"]


def method_of(dt=0.01, penalty=ALPHA, **keywords):
    return swarm.AugmentedLagrangian(dt, penalty, **{"max_sweeps": 200, "adaptive": True, **keywords})


# --- Steps that are cut at the impact ---------------------------------------------------------------------


@pytest.mark.parametrize("name", [rarely(name) if name == "ellipsoid" else name for name in SHAPES])
def test_a_gas_keeps_energy_and_walls(name):
    """At a tolerance of round-off, by every way there: 200 particles, 100 s, worst particle."""
    scene, start = scene_of(name), swarm.fill(scene_of(name), 200, speed=0.5, seed=4)
    sweeps = []
    for acceleration in ("none", "secant", "reflection"):
        result = run(scene, start, method_of(tolerance=1e-28, acceleration=acceleration), 100.0, 10.0, "always")
        assert result.multipliers.contacts.mean() >= 60.0
        assert result.observables["unconverged"][-1] == 0
        assert result.observables["energy_error"].max() <= 1e-14
        assert worst_energy(start, result.particles) <= 1e-14
        assert ulps_outside(scene, result) <= 64.0
        sweeps.append(result.observables["sweeps"][-1] / result.multipliers.contacts.sum())
    assert sweeps[0] > 1.5 * sweeps[1] > 3.0 * sweeps[2]


@pytest.mark.parametrize("name", [rarely(name) if name == "ellipsoid" else name for name in SHAPES])
def test_a_tolerance_bounds_gap_and_energy(name, compiled_at_once):
    """Phi1 <= sqrt(2 tolerance/alpha) outside, and lambda Phi1 of energy a contact."""
    scene, start = scene_of(name), swarm.fill(scene_of(name), 200, speed=0.5, seed=4)
    for tolerance in (1e-8, 1e-12):
        result = run(scene, start, method_of(tolerance=tolerance), 20.0, 1.0)
        depth = math.sqrt(2.0 * tolerance / ALPHA)
        # A distance outside is less than phi where |grad phi| > 1.
        assert result.observables["max_penetration"].max() <= 1.01 * depth
        # m v_n/h of each of the contacts of the busiest particle, times the gap; relative to m v^2/2
        work = 2.0 * 0.5 / 0.01 * depth / 0.125
        assert result.observables["energy_error"].max() <= 2.0 * work * result.multipliers.contacts.max()
        assert (result.multipliers.stored_energy <= tolerance).all()


@pytest.mark.parametrize("name", [rarely(name) if name == "ellipsoid" else name for name in SHAPES])
def test_the_limit_is_impact(name):
    """Few impacts: 1e-9 from the chord steps of Impact, and nearer the smaller the tolerance."""
    scene, start = scene_of(name), swarm.fill(scene_of(name), 200, speed=0.5, seed=5)
    limit = run(scene, start, swarm.Impact(contact_step=0.01, shortest_flight=1e-12), 4.0).particles
    distances = []
    for tolerance in (1e-8, 1e-12, 1e-16, 1e-28):
        end = run(scene, start, method_of(tolerance=tolerance), 4.0).particles
        distances.append(np.linalg.norm(end.position - limit.position, axis=0))
    assert distances[-1].max() <= 1e-9
    medians = np.array([np.median(distance) for distance in distances[:3]])
    assert (medians[1:] <= 0.05 * medians[:-1]).all(), medians


@pytest.mark.parametrize("name", [rarely(name) if name == "ellipsoid" else name for name in SHAPES])
def test_replaced_contacts_keep_their_energy(name):
    """Every contact replaced: 2e4 exact impacts a particle."""
    scene = scene_of(name)
    start = swarm.fill(scene, 5, speed=50.0, seed=7)
    method = method_of(1e-4, tolerance=1e-300, max_sweeps=1, on_unconverged="impact")
    result = run(scene, start, method, 320.0, compile="always")
    assert result.observables["impacts"][-1] >= 1e5
    assert result.observables["unconverged"][-1] >= 0.999 * result.observables["impacts"][-1]
    assert result.observables["energy_error"].max() <= 1e-13


def test_two_walls_at_one_place_miss_what_the_tolerance_allows():
    """One reflection does not solve them: the loop over both ends with V just below the tolerance, missing lambda Phi1.

    Of a contact that is lambda = 2 m v_n/h of each wall, at the most, times Phi1 of each.
    """
    scene = swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.5)])
    start = swarm.fill(scene, 5, speed=0.5, seed=4)
    for tolerance, bar in ((1e-10, None), (1e-28, 1e-13)):
        result = run(scene, start, method_of(tolerance=tolerance, acceleration="reflection"), 5.0, compile="never")
        depth = math.sqrt(2.0 * tolerance / ALPHA)
        work = 2.0 * (2.0 * 0.5 / 0.01) * depth / 0.125
        contacts = result.multipliers.contacts.max()
        assert contacts >= 3
        assert result.observables["unconverged"][-1] == 0
        assert result.observables["energy_error"].max() <= (bar or contacts * work)
        assert result.observables["max_penetration"].max() <= depth + 4.0 * np.spacing(0.5)


# --- Cusps -----------------------------------------------------------------------------


@pytest.mark.parametrize("acceleration", ["none", "reflection"])
def test_a_cusp_and_a_thin_cap_end(acceleration):
    """Between the wall and a ball that all but touches it; in the sharp rim of a cap; from the edge of a sphere."""
    ball = [swarm.Sphere(0.5), swarm.Sphere(0.2, (0.3 - 1e-9, 0.0, 0.0), side="outside")]
    cap = [swarm.Sphere(0.5), swarm.Sphere(0.2, (0.0, 0.0, 0.65), side="outside")]
    for surfaces, aim in ((ball, [0.5, 0.0, 0.0]), (cap, [0.25, 0.0, 0.43])):
        scene = swarm.Scene(surfaces)
        start = swarm.fill(scene, 6, speed=1.0, seed=8)
        towards = np.array(aim)[:, None] - start.position
        aimed = swarm.Particles(start.position, towards / np.linalg.norm(towards, axis=0))
        result = run(scene, aimed, method_of(tolerance=1e-28, acceleration=acceleration), 5.0, 0.5, "never")
        assert result.observables["unconverged"][-1] == 0
        assert result.observables["energy_error"].max() <= 1e-14
        assert ulps_outside(scene, result) <= 128.0


# --- The mean-value form ----------------------------------------------------------------------------------


@pytest.mark.parametrize("exponent", [rarely(1.5), rarely(4.0)])
def test_the_mean_value_form_keeps_energy(exponent):
    """Penalty with the paper's general form: energy, and of order 2 in dt at least from the composite form."""
    scene = scene_of("sphere")
    start = swarm.fill(scene, 20, speed=0.5, seed=9)
    distances = []
    for n in (128, 256, 512):
        ends = []
        for gradient in ("mean-value", "composite"):
            result = run(scene, start, swarm.Penalty(1.0 / n, 1e3 * 10.0**exponent, exponent, gradient), 2.0, 0.25)
            assert result.observables["impacts"][-1] >= 20
            assert result.observables["energy_error"].max() <= 1e-12
            ends.append(result.particles.position)
        distances.append(np.sqrt(np.mean((ends[0] - ends[1]) ** 2)))
    slopes = -np.diff(np.log2(distances))
    assert (slopes >= 1.7).all(), (slopes, distances)
