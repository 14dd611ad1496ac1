"""Grains that wait at a wall: held, they are fixed spheres for others, and their energy is there all the time."""

import itertools
import math

import numpy as np
import pytest
from cut_short import in_sessions
from energy_books import booked
from grains_runs import ran
from same_bits import require_same

import swarm
from swarm.grains.grains_run import GrainsRun

STEP = 4e-3
SOFT = swarm.Penalty(STEP, 1e4)
FOR_EVER = [swarm.Sticky(1e9)]
LOSSY = {"restitution": 0.9, "friction": 0.3, "rolling": 0.02}


def crowd(until=0.8, **options):
    walls = [swarm.Box((0.4, 0.4, 0.4), laws=[swarm.Sticky(0.1)], **LOSSY)]
    scene = swarm.Scene(walls, gravity=(0.0, 0.0, -3.0), pairs=swarm.Pairs(**LOSSY))
    start = swarm.fill(scene, 6, speed=1.5, mass=1.0, radius=0.08, seed=3)
    return ran(scene, start, SOFT, until, seed=2, **{"every": 0.4, **options})


@pytest.mark.parametrize("seed", range(3))
def test_a_grain_waits_as_long_as_a_point_does(seed):
    """In whole steps: from there on it flies as from a mirror."""
    places, options = [], {"seed": seed, "every": STEP}
    wall = swarm.Plane((1.0, 0.0, 0.0), 0.5, laws=[swarm.Sticky(0.1)])
    start = swarm.Particles((0.0, 0.0, 0.0), (2.0, 0.5, 0.0), radius=0.1)
    scene = swarm.Scene([wall], gravity=None)
    result = ran(scene, start, SOFT, 1.0, progress=lambda frame: places.append(frame.position[:, 0].copy()), **options)
    held = np.flatnonzero((np.diff(places, axis=0) == 0.0).all(axis=1))
    assert np.array_equal(held, np.arange(held[0], held[0] + len(held)))
    bare = ran(swarm.Scene([swarm.Plane((1.0, 0.0, 0.0), 0.5)], gravity=None), start, SOFT, 1.0, every=1.0)
    point = ran(scene, swarm.Particles((0.1, 0.0, 0.0), (2.0, 0.5, 0.0)), swarm.Impact(), 1.0, seed=seed)
    wait = 1.0 - float(point.particles.position[1, 0]) / 0.5
    assert len(held) == math.ceil(wait / STEP - 1e-6)
    late = bare.particles.position[:, 0] - len(held) * STEP * bare.particles.velocity[:, 0]
    assert result.particles.position[:, 0] == pytest.approx(late, abs=1e-12)
    assert result.particles.velocity == pytest.approx(bare.particles.velocity, abs=1e-12)


@pytest.mark.parametrize("laws", [{}, {"restitution": 0.7}, {"restitution": 0.7, "friction": 0.4}])
def test_others_bounce_off_it_as_off_a_fixed_sphere(laws):
    """The arm of friction between two grains is shorter than at a wall: there it is a grain of a huge mass."""
    wall = swarm.Plane((1.0, 0.0, 0.0), 0.5, laws=FOR_EVER)
    places, speeds = np.array([(0.3, -0.6), (0.0, 0.03), (0.0, 0.02)]), np.array([(1.0, 1.5), (0.0, 0.0), (0.0, 0.0)])
    start = swarm.Particles(places, speeds, np.array([1.0, 2.0]), radius=np.array([0.1, 0.15]))
    room = swarm.Sphere(5.0)
    result = ran(swarm.Scene([wall, room], pairs=swarm.Pairs(**laws)), start, SOFT, 1.2, every=0.4)
    seen = result.observables
    assert seen["collisions"][-1] == 1
    place = result.particles.position[:, 0]
    assert place[0] == pytest.approx(0.4, abs=0.01)
    # Of the velocity with which it will leave.
    assert result.particles.velocity[:, 0] == pytest.approx((-1.0, 0.0, 0.0), abs=1e-12)
    other = swarm.Particles(places[:, 1:], speeds[:, 1:], 2.0, radius=0.15)
    scene = swarm.Scene([swarm.Sphere(0.1, tuple(place), "outside", **laws), room])
    if "friction" in laws:
        places[:, 0], speeds[:, 0], scene = place, 0.0, swarm.Scene([room], pairs=swarm.Pairs(**laws))
        other = swarm.Particles(places, speeds, np.array([1e15, 2.0]), radius=start.radius)
    alone = ran(scene, other, SOFT, 1.2).particles
    assert result.particles.position[:, 1] == pytest.approx(alone.position[:, -1], abs=1e-11)
    assert result.particles.velocity[:, 1] == pytest.approx(alone.velocity[:, -1], abs=1e-11)
    if "friction" in laws:
        assert result.particles.spin[:, 1] == pytest.approx(alone.spin[:, -1], abs=1e-11)
        assert (result.particles.spin[:, 0] == 0.0).all()
    assert seen["energy_error"].max() < 1e-13


def test_what_is_held_does_not_move_and_the_books_balance():
    frames = []
    result = crowd(every=STEP, progress=lambda frame: frames.append((frame.position.copy(), frame.velocity.copy())))
    seen = result.observables
    assert seen["impacts"][-1] > 8
    assert seen["collisions"][-1] > 2
    assert seen["energy_error"].max() < 1e-13
    assert np.ptp(booked(seen)) < 1e-13 * np.abs(booked(seen)).max()
    rests = np.all([before == after for (before, _v), (after, _w) in itertools.pairwise(frames)], axis=1)
    # With gravity only what is held stays where it is, with a velocity.
    assert rests.sum() > 20
    speed = np.array([np.abs(v).max(axis=0) for _place, v in frames[1:]])
    assert (speed[rests] > 0.0).all()


def test_two_that_are_held_and_press_on_each_other_keep_what_they_store():
    wall = swarm.Plane((1.0, 0.0, 0.0), 0.5, laws=[swarm.Sticky(0.05)])
    places, speeds = np.array([(0.3, 0.3), (-0.099, 0.099), (0.0, 0.0)]), np.array([(1.0, 1.0), (0.0, 0.0), (0.0, 0.0)])
    start = swarm.Particles(places, speeds, radius=0.1)
    result = ran(swarm.Scene([wall, swarm.Sphere(3.0)]), start, SOFT, 0.8, every=STEP)
    seen = result.observables
    assert seen["contact_energy"][0] > 0.0
    assert seen["energy_error"].max() < 1e-13
    assert seen["contact_energy"][-1] == 0.0


def test_sessions_and_the_log(tmp_path, monkeypatch):
    whole = crowd(0.4, impacts=tmp_path / "whole.h5")
    table = swarm.load_impacts(tmp_path / "whole.h5").table()
    at_walls = table[table["partner"] < 0]
    # The velocity with which each leaves, the wait is after the row.
    sent = at_walls["velocity_after"]
    assert (np.abs(sent).sum(axis=1) > 0.0).all()
    options = {"trajectory": tmp_path / "run.h5", "resume": True, "checkpoint": 1e3}
    again, sessions = in_sessions(monkeypatch, GrainsRun, 30, lambda: crowd(0.4, **options))
    assert sessions > 2
    require_same(again, whole)
