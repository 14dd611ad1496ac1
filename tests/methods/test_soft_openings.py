"""Points at openings and doors with `Penalty` and `AugmentedLagrangian`: the foot at the start of a step decides."""

import math

import numpy as np
import pytest
from energy_books import unbooked

import swarm

STEP, ALPHA, DOWN = 5e-3, 4e3, (0.0, 0.0, -9.81)
HOLE = swarm.Cylinder(0.25, (0.0, 0.0, 1.0))
LOOP = {"dt": STEP, "penalty": ALPHA, "tolerance": 1e-20}
PENALTY = swarm.Penalty(STEP, ALPHA)
HERTZ = swarm.Penalty(STEP, ALPHA, exponent=1.5)
CUT = swarm.AugmentedLagrangian(**LOOP, adaptive=True, acceleration="reflection", on_unconverged="impact")
CENTRED = swarm.AugmentedLagrangian(**LOOP, adaptive=True, contact_start="centred", on_unconverged="impact")
FIXED = swarm.AugmentedLagrangian(**LOOP, on_unconverged="impact")
CONSERVING = {"Penalty": PENALTY, "Hertz": HERTZ, "cut": CUT, "centred": CENTRED, "fixed": FIXED}


def ran(scene, particles, method, until=1.0, every=0.25, **options):
    return swarm.simulate(scene, particles, method, until=until, every=every, compile="never", **options)


def balanced(seen):
    return unbooked(seen) / (seen["kinetic_energy"].max() + seen["contact_energy"].max())


def floor(*openings, gravity=DOWN, **laws):
    return swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, openings=openings, **laws)], gravity=gravity)


@pytest.mark.parametrize(("x", "escapes"), [(0.0, True), (0.249, True), (0.251, False), (0.34, False)])
@pytest.mark.parametrize("name", CONSERVING)
def test_the_foot_of_a_point_decides(name, x, escapes):
    start = swarm.Particles((x, 0.0, 0.3), (0.0, 0.0, -1.0))
    result = ran(floor(HOLE, gravity=None), start, CONSERVING[name], 0.5)
    seen = result.observables
    assert np.isnan(result.escape_time[0]) != escapes
    assert balanced(seen) < 1e-13
    assert seen["dissipated_energy"][-1] == 0.0
    assert seen["contact_energy"][-1] == 0.0
    if escapes:
        # At the end of the step that leads through the wall, or where it meets the wall.
        assert 0.3 - 1e-9 <= result.escape_time[0] <= 0.3 + STEP + 1e-9
        assert -STEP - 1e-9 <= result.particles.position[2, 0] <= 1e-9
    else:
        assert result.particles.velocity[2, 0] == pytest.approx(1.0, abs=1e-9)


def test_a_point_that_comes_over_the_edge_loses_what_its_contact_stores():
    # It swings about m g/alpha, within 2 pi/sqrt(alpha/m) = 0.1 s, and is deepest at 0.25 s.
    start = swarm.Particles((0.499, 0.0, 0.0), (-1.0, 0.0, 0.0))
    result = ran(floor(HOLE), start, PENALTY, 0.5)
    seen = result.observables
    assert seen["dissipated_energy"][-1] == pytest.approx(0.5 * ALPHA * (2.0 * 9.81 / ALPHA) ** 2, rel=0.05)
    assert result.escape_time[0] == pytest.approx(0.25, abs=2.1 * STEP)
    assert seen["contact_energy"][-1] == 0.0
    assert balanced(seen) < 1e-13


@pytest.mark.parametrize("method", [PENALTY, HERTZ])
def test_a_hatch_opens_under_a_point(method):
    hatch = swarm.Opening(HOLE, times=[(0.25, 9.0)])
    result = ran(floor(hatch), swarm.Particles((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), method, 0.5)
    seen = result.observables
    assert seen["contact_energy"][1] > 1e-4
    assert seen["dissipated_energy"][-1] == pytest.approx(seen["contact_energy"][1], rel=1e-12)
    assert result.escape_time[0] == pytest.approx(0.25 + STEP, abs=1e-9)
    assert balanced(seen) < 1e-13


def test_a_point_passes_a_hatch_while_it_is_open():
    hatch = swarm.Opening(HOLE, times=[(0.0, 0.26)])
    pair = swarm.Particles(np.array([[0.0, 0.1], [0.0, 0.0], [0.2, 0.4]]), np.array([[0.0] * 2, [0.0] * 2, [-1.0] * 2]))
    result = ran(floor(hatch, gravity=None), pair, PENALTY, 0.5, 0.125)
    assert np.isnan(result.escape_time).tolist() == [False, True]


def test_what_is_stored_is_lost_with_a_wall_that_goes():
    # A contact lasts for pi/sqrt(alpha): the wall goes when the point is as deep as it gets.
    alpha = (math.pi / 0.2) ** 2
    start = swarm.Particles((0.0, 0.0, 0.1), (0.0, 0.0, -1.0))
    scene = floor(gravity=None, present=[(0.0, 0.2), (1.2, 2.0)])
    seen = ran(scene, start, swarm.Penalty(STEP, alpha), 0.4, 0.1).observables
    assert seen["dissipated_energy"].tolist() == pytest.approx([0.0, 0.0, 0.0, 0.5, 0.5], abs=1e-2)
    assert seen["contact_energy"][3] == 0.0
    assert balanced(seen) < 1e-13


def test_a_wall_does_not_come_to_where_a_point_is():
    start = swarm.Particles((0.0, 0.0, 0.1), (0.0, 0.0, -1.0))
    with pytest.raises(swarm.RunError, match="particle 0"):
        ran(floor(gravity=None, present=[(0.5, 2.0)]), start, PENALTY)


@pytest.mark.parametrize("method", [PENALTY, FIXED])
def test_doors_within_a_step_are_refused(method):
    start = swarm.Particles((0.0, 0.0, 0.1), (0.0, 0.0, -1.0))
    with pytest.raises(swarm.SceneError, match=r"whole steps, got 0.201 s with dt = 0.005 s, which is 40.2 steps"):
        ran(floor(gravity=None, present=[(0.0, 0.201)]), start, method)
    assert ran(floor(gravity=None, present=[(0.0, 0.201)]), start, CUT).observables["impacts"][-1] == 1


@pytest.mark.parametrize("name", CONSERVING)
def test_a_wall_beside_an_open_one_does_not_send_back(name):
    # At 45 degrees onto the floor of a box whose side is open there: every step meets both, or one of them.
    vessel = swarm.Box((0.5, 0.5, 0.5), openings=[swarm.Box((0.2, 1.0, 1.0), (0.6, 0.0, 0.0))])
    z = np.linspace(-0.49, -0.4, 37)
    start = swarm.Particles(np.array([np.full(37, 0.39), np.zeros(37), z]), np.tile([[1.0], [0.1], [-1.0]], (1, 37)))
    result = ran(swarm.Scene([vessel], gravity=None), start, CONSERVING[name], 0.25)
    assert balanced(result.observables) < 1e-13
    assert result.observables["escaped"][-1] == 37
    # None has come back from the side.
    assert (result.particles.velocity[0] > 0.0).all()


def test_a_closed_wall_at_the_place_of_an_open_one_holds():
    walls = [swarm.Plane((0.0, 0.0, -1.0), 0.0, openings=[HOLE]), swarm.Plane((0.0, 0.0, -1.0), 0.0)]
    start = swarm.Particles((0.0, 0.0, 0.1), (0.0, 0.0, -1.0))
    result = ran(swarm.Scene(walls, gravity=None), start, PENALTY, 0.5)
    assert np.isnan(result.escape_time[0])
    assert result.particles.velocity[2, 0] == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("method", [PENALTY, CUT])
def test_escapes_tend_to_those_of_rigid_walls(method):
    vessel = swarm.Ellipsoid((0.5, 0.4, 0.6), openings=[swarm.Sphere(0.3, (0.5, 0.1, 0.0))])
    scene = swarm.Scene([vessel], gravity=None)
    start = swarm.fill(scene, 40, speed=1.0, mass=1.0, seed=5)
    rigid = ran(scene, start, swarm.Impact(), 0.6)
    soft = ran(scene, start, method, 0.6)
    one, other = rigid.escape_time, soft.escape_time
    both = ~np.isnan(one) & ~np.isnan(other)
    assert both.sum() >= 3
    assert (np.isnan(one) != np.isnan(other)).sum() <= 2
    assert np.abs(one - other)[both].max() < 0.1
