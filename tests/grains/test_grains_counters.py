"""Counters of soft balls: against the centres at the ends of all steps."""

import math

import numpy as np
import pytest
from cut_short import in_sessions
from grains_runs import ran
from same_bits import require_same

import swarm
from swarm.grains.grains_run import GrainsRun

DT, DOWN = 2e-3, (0.0, 0.0, -9.81)
SOFT = swarm.Penalty(DT, 2e3)
# Of one wall, and of several.
COUNTERS = [swarm.Plane((1.0, 0.2, 0.0), 0.05), swarm.Box((0.2, 0.15, 0.3))]
LAWS = {"restitution": 0.7, "friction": 0.3}


def crowd(period=None, n=8):
    """Balls that meet one another and their walls, also across the faces of a cell."""
    random = np.random.default_rng(4)
    place = np.array([(x, y, z) for x in (-0.3, 0.3) for y in (-0.3, 0.3) for z in (-0.3, 0.3)]).T[:, :n]
    velocity = random.normal(size=(3, n)) - 2.0 * place
    walls = [swarm.Box((0.5, 0.5, 0.5), **LAWS)] if period is None else [swarm.Slab((0.0, 0.0, 1.0), 0.5, **LAWS)]
    scene = swarm.Scene(walls, gravity=DOWN, pairs=swarm.Pairs(**LAWS), period=period)
    if period is not None:
        place = place + 0.5 * np.array([[1.0], [1.0], [0.0]])
        velocity = velocity + np.array([[1.5], [-1.0], [0.0]])
    return scene, swarm.Particles(place, velocity, 0.5, radius=np.linspace(0.06, 0.12, n))


def test_steps_cross_counters_as_often_as_their_ends_do():
    scene, start = crowd()
    places = []
    seen = ran(
        scene, start, SOFT, 0.4, every=DT, progress=lambda frame: places.append(frame.position.copy()),
        counters=COUNTERS,
    ).observables  # fmt: skip
    assert seen["energy_error"].max() < 1e-12
    for k, counter in enumerate(COUNTERS[:2]):
        out = np.array([counter.phi(place) > 0.0 for place in places])
        leaves, returns = out[1:] & ~out[:-1], ~out[1:] & out[:-1]
        assert seen["crossings"][-1, k].tolist() == [leaves.sum(), returns.sum()]
    assert seen["crossings"][-1, :2].min() > 1
    assert seen["crossed_energy"][-1, 0].min() > 0.0
    assert (seen["crossed_momentum"][-1, 0, :, 0] * (1, -1) > 0.0).all()


def test_what_crosses_a_face_of_a_cell_is_counted_once():
    period = (1.0, 1.0, None)
    scene, start = crowd(period)
    counters = [swarm.Plane((1.0, 0.0, 0.0), 0.0), swarm.Plane((1.0, 0.0, 0.0), 0.5)]
    result = ran(scene, start, SOFT, 0.3, every=0.1, counters=counters)
    seen = result.observables
    went = result.particles.image[0]
    assert went.any()
    assert int(seen["crossings"][-1, 0] @ (1, -1)) == went.sum()
    # By the whole cells that lie before a centre, from half a cell on.
    now = np.floor(result.particles.position[0] + went - 0.5) - np.floor(start.position[0] - 0.5)
    assert int(seen["crossings"][-1, 1] @ (1, -1)) == now.sum()
    assert seen["energy_error"].max() < 1e-12


def test_counters_change_no_bit_and_frames_do_not_change_what_they_count():
    scene, start = crowd()
    one, other = ran(scene, start, SOFT, 0.2), ran(scene, start, SOFT, 0.2, counters=COUNTERS)
    assert np.array_equal(one.particles.position, other.particles.position)
    assert np.array_equal(one.particles.spin, other.particles.spin)
    many = ran(scene, start, SOFT, 0.2, every=0.05, counters=COUNTERS, threads=2)
    for name in ("crossings", "crossed_momentum", "crossed_energy", "crossed_slowness"):
        np.testing.assert_array_equal(other.observables[name][-1], many.observables[name][-1], err_msg=name)


def test_a_free_fall_crosses_at_the_speed_of_its_height():
    plane = swarm.Plane((0.0, 0.0, -1.0), -0.2)
    start = swarm.Particles((0.0, 0.0, 0.7), (0.0, 0.0, 0.0), 2.0, radius=0.1)
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0)], gravity=DOWN)
    inside = swarm.Counter(plane, inside=swarm.Sphere(0.05, center=(1.0, 0.0, 0.2)))
    seen = ran(scene, start, SOFT, 0.33, counters=[plane, inside]).observables
    fallen = math.sqrt(2.0 * 9.81 * 0.5)
    assert seen["crossings"][-1].tolist() == [[1, 0], [0, 0]]
    # Between two steps the place is to first order.
    np.testing.assert_allclose(seen["crossed_momentum"][-1, 0, 0], (0.0, 0.0, -2.0 * fallen), rtol=1e-5)
    assert seen["crossed_slowness"][-1, 0, 0] == pytest.approx(1.0 / fallen, rel=5e-3)


HOLE = swarm.Cylinder(0.06)
SILO = swarm.Box((0.12, 0.12, 0.2), (0.0, 0.0, 0.2), **LAWS, openings=[swarm.Opening(HOLE, times=[(0.2, 9.0)])])
LID = swarm.Box((0.08, 0.08, 0.01), center=(0.0, 0.0, 0.3))
# A grain goes out when its centre is a radius above the floor.
GATE = swarm.Plane((0.0, 0.0, -1.0), -0.031)


def drained(until=0.6, **more):
    source = swarm.Source(LID, volume=True, rate=40.0, beam=(0.0, 0.0, -0.5), radius=0.03, density=900.0)
    scene = swarm.Scene([SILO], gravity=DOWN, pairs=swarm.Pairs(**LAWS))
    options = {"until": until, "every": 0.05, "compile": "never", "seed": 3, "progress": False, **more}
    return swarm.simulate(scene, None, swarm.Penalty(DT, 1e3), sources=source, counters=[GATE], **options)


def test_what_a_silo_loses_has_crossed_its_counter():
    """Born - escaped = inside, and the counter has those that have escaped and no others."""
    result = drained()
    seen = result.observables
    born, escaped = seen["born"][:, 0], seen["escaped"]
    centres = result.particles.position[2]
    inside = (centres > 0.0) & np.isnan(result.escape_time) & ~np.isnan(result.birth_time)
    assert born[-1] - escaped[-1] == inside.sum()
    assert 3 < escaped[-1] < born[-1]
    net = seen["crossings"][:, 0] @ (1, -1)
    below = ~np.isnan(result.birth_time) & np.isnan(result.escape_time) & (centres < 0.031)
    assert net[-1] - below.sum() == escaped[-1]
    assert seen["energy_error"].max() < 1e-12


def test_a_run_that_is_resumed_counts_the_same(tmp_path, monkeypatch):
    whole = drained(0.3, trajectory=tmp_path / "whole.h5")
    parts, sessions = in_sessions(
        monkeypatch, GrainsRun, 31, lambda: drained(0.3, trajectory=tmp_path / "parts.h5", resume=True, checkpoint=1e3)
    )
    assert sessions > 4
    require_same(parts, whole)
