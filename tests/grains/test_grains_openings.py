"""Soft balls at openings: the foot of a ball decides, and a ball has escaped when it reaches into the wall there."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from grains_runs import cloud, ran
from test_grains_doors import balanced

import swarm
from swarm.files import checkpoint
from swarm.grains import exits, grain_arrays
from swarm.grains.grains_run import GrainsRun
from swarm.kernel.random import Seeding
from swarm.kernel.vector import Vec
from swarm.run.tally import Watched

RADIUS, ALPHA, DOWN = 0.1, 4e4, (0.0, 0.0, -9.81)
HOLE = swarm.Cylinder(0.25, (0.0, 0.0, 1.0))


def floor(*openings, **laws):
    return swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, openings=openings, **laws)], gravity=DOWN)


def ball(x, y=0.0, z=0.4, velocity=(0.0, 0.0, 0.0)):
    return swarm.Particles((x, y, z), velocity, radius=RADIUS)


@pytest.mark.parametrize(("x", "escapes"), [(0.0, True), (0.249, True), (0.251, False), (0.34, False)])
def test_the_foot_of_a_ball_decides(x, escapes):
    method = swarm.Penalty(1e-3, ALPHA)
    result = ran(floor(HOLE), ball(x), method, 0.5, every=0.1)
    seen = result.observables
    assert seen["escaped"][-1] == escapes
    assert balanced(seen) < 1e-13
    if escapes:
        # It falls freely until it reaches the wall, at the end of a step.
        fall = math.sqrt(2.0 * 0.3 / 9.81)
        assert fall <= result.escape_time[0] <= fall + 1e-3
        assert -3e-3 < result.particles.position[2, 0] - RADIUS < 0.0
        assert seen["dissipated_energy"][-1] == 0.0
    else:
        assert np.isnan(result.escape_time[0])
        assert seen["impacts"][-1] == 1


def test_a_ball_that_comes_over_the_edge_loses_what_its_contact_stores_and_escapes():
    # At rest on the floor its overlap is m g/alpha.
    sunk = 9.81 / ALPHA
    start = ball(0.5, z=RADIUS - sunk, velocity=(-1.0, 0.0, 0.0))
    result = ran(floor(HOLE), start, swarm.Penalty(1e-3, ALPHA), 0.5, every=0.1)
    seen = result.observables
    assert seen["dissipated_energy"][-1] == pytest.approx(0.5 * ALPHA * sunk**2, rel=1e-6)
    assert result.escape_time[0] == pytest.approx(0.25, abs=2.1e-3)
    assert balanced(seen) < 1e-13


def test_a_ball_escapes_while_the_hatch_is_open():
    # The first falls through it, and the second comes when it is shut.
    hole = swarm.Opening(HOLE, times=[(0.0, 0.26)])
    pair = swarm.Particles(np.array([[0.0, 0.1], [0.0, 0.0], [0.4, 0.7]]), np.zeros((3, 2)), radius=RADIUS)
    result = ran(floor(hole), pair, swarm.Penalty(1e-3, ALPHA), 0.5, every=0.125)
    assert np.isnan(result.escape_time).tolist() == [False, True]
    assert result.observables["escaped"].tolist() == [0, 0, 1, 1, 1]
    assert balanced(result.observables) < 1e-13


def test_a_ball_on_a_hatch_escapes_when_that_opens():
    hole = swarm.Opening(HOLE, times=[(0.2003, 9.0)])
    start = ball(0.0, z=RADIUS - 9.81 / ALPHA)
    result = ran(floor(hole), start, swarm.Penalty(1e-3, ALPHA), 0.5, every=0.125)
    assert result.observables["dissipated_energy"][-1] == pytest.approx(0.5 * 9.81**2 / ALPHA, rel=1e-9)
    assert 0.2003 < result.escape_time[0] <= 0.2013
    assert balanced(result.observables) < 1e-13


def crowd(until=0.6, **laws):
    """Balls that fall through a hole in the floor of a box, and press on one another."""
    start = cloud(18)
    start.position *= 0.2
    start.position += 0.2
    start.velocity[:] = 0.0
    start.radius *= 0.2
    box = swarm.Box(
        (0.5, 0.5, 0.5), (0.45, 0.45, 0.5), openings=[swarm.Cylinder(0.2, center=(0.45, 0.45, 0.0))], **laws
    )
    pairs = swarm.Pairs(friction=laws.get("friction", 0.0), restitution=laws.get("restitution", 1.0))
    return swarm.Scene([box], gravity=DOWN, pairs=pairs), start


@pytest.mark.parametrize("laws", [{}, {"friction": 0.4, "restitution": 0.6}])
def test_the_energy_of_a_crowd_that_leaves_is_booked(laws):
    scene, start = crowd(**laws)
    mass = start.mass.sum()
    result = ran(scene, start, swarm.Penalty(4e-3, 400.0), 0.6, every=0.1)
    seen = result.observables
    assert 3 < seen["escaped"][-1] < 18
    assert balanced(seen) < 1e-12
    out = ~np.isnan(result.escape_time)
    assert out.sum() == seen["escaped"][-1]
    assert (result.particles.position[2, out] < start.radius[out]).all()
    assert result.particles.mass.sum() == mass
    times = result.escape_time[out]
    assert seen["escaped"].tolist() == [(times <= time + 1e-9).sum() for time in seen["time"]]


@pytest.mark.parametrize("surface", [
    swarm.Spheres([(0.0, 0.0, -0.5)], 0.5, openings=[HOLE]),
    swarm.Prism([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)], 2.0, center=(0.0, 0.0, 1.0), openings=[HOLE]),
])  # fmt: skip
def test_solids_of_a_field_and_outlines_have_openings(surface):
    scene = swarm.Scene([surface, swarm.Box((1.5, 1.5, 2.5))], gravity=DOWN)
    pair = swarm.Particles(np.array([[0.05, 0.3], [0.0, 0.1], [0.4, 0.3]]), np.zeros((3, 2)), radius=RADIUS)
    result = ran(scene, pair, swarm.Penalty(1e-3, ALPHA), 0.35, every=0.35)
    assert np.isnan(result.escape_time).tolist() == [False, True]
    assert balanced(result.observables) < 1e-12


def test_nothing_is_left_to_step_when_all_have_escaped():
    result = ran(floor(HOLE), ball(0.0), swarm.Penalty(1e-3, ALPHA), 1.0, every=0.25)
    assert result.observables["escaped"].tolist() == [0, 1, 1, 1, 1]
    assert (result.observables["kinetic_energy"][1:] == result.observables["kinetic_energy"][1]).all()


def test_a_run_that_is_restored_goes_on_with_the_same_bits(tmp_path):
    def started():
        scene, start = crowd(friction=0.4)
        start.spin = np.zeros((3, len(start)))
        run = GrainsRun(
            scene.compiled(float(start.radius.max())), start, swarm.Penalty(2e-3, 400.0), 1, None, "never", Seeding(),
            Watched(),
        )  # fmt: skip
        run.observe()
        return run

    def bits(run):
        return {name: array.tobytes() for name, array in run.arrays().items() if name != "clock"}

    with started() as whole, started() as first, started() as second:
        for k in range(4):
            assert whole.advance(75.0, 0.15 * (k + 1))
        for k in range(3):
            assert first.advance(75.0, 0.15 * (k + 1))
        assert first.seen()["escaped"] > 0
        first.halt(20)
        assert not first.advance(75.0, 0.6)
        checkpoint.save(tmp_path / "a", checkpoint.SavedRun("", "", "", "", 30, ""), first.arrays())
        second.restore(checkpoint.read(tmp_path / "a")[1], True)
        for run in (first, second):
            assert run.advance(75.0, 0.6)
        assert bits(whole) == bits(first) == bits(second)
        assert whole.seen()["escaped"] > 2


@pytest.mark.parametrize("place", [(0.3, 0.0, 0.0), (0.2, 0.3, 0.1), (0.0, -0.42, 0.0), (0.0, 0.0, 0.44)])
@pytest.mark.parametrize("surface", [swarm.Sphere(0.5), swarm.Box((0.5, 0.5, 0.5)), swarm.Ellipsoid((0.5, 0.5, 0.55))])
def test_the_foot_that_an_opening_is_asked_about_is_on_the_wall(monkeypatch, surface, place):
    # The ball is before the wall, or in it, where the normal of a sphere has another length than 1.
    radius, feet = 0.08, []
    monkeypatch.setattr(exits, "is_open", lambda _openings, _wall, foot, _near: feet.append(foot) or False)
    rows = np.zeros((1, 8))
    rows[0, :3], rows[0, grain_arrays.RADIUS] = place, radius
    near = SimpleNamespace(
        wall_first=np.array([0, 1]), slot=np.zeros(1, int), wall_is_open=np.zeros(1, bool), listed=None, spans=None
    )
    for wall in swarm.Scene([surface]).compiled().of_balls(radius).walls(0.0).each:
        exits.open_wall(SimpleNamespace(openings=()), wall, (0, 0.0), SimpleNamespace(place=rows), near)
        foot = np.array(feet.pop())
        bare = wall.grown(0.0)
        assert abs(float(bare.distance(Vec(*foot)))) < 1e-12
        assert np.linalg.norm(np.cross(foot - place, np.array(bare.unit_normal(Vec(*foot))))) < 1e-9
