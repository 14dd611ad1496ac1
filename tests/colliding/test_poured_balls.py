"""Balls that come from sources during a run in order of events."""

import itertools
import math

import numpy as np
import pytest
from cut_short import in_sessions
from same_bits import require_same

import swarm
from swarm.events.balls_run import CollidingRun

LID = swarm.Box((0.05, 0.05, 0.01), center=(0.0, 0.0, 0.04))
DOWN = {"gravity": (0.0, 0.0, -9.81), "pairs": swarm.Pairs(restitution=0.9)}
EVEN = {"rate": 100.0, "even": True}
SIZES = {"radius": (0.008, 0.015), "density": 900.0}
FLOOR = swarm.Plane((0, 0, -1), 0.04, motion=swarm.Oscillation((0, 0, 0.005), 20.0))
VALVE = swarm.Box((0.05, 0.05, 0.05), openings=[swarm.Sphere(0.03, center=(0.0, 0.0, -0.05))])
SCENES = {
    "a box": (
        [swarm.Box((0.05, 0.05, 0.05), restitution=0.9)], DOWN,
        swarm.Source(LID, volume=True, beam=(0.0, 0.0, -0.3), **EVEN, **SIZES),
    ),
    "a cell": ([], {"period": (0.2, 0.2, 0.2)}, swarm.Source(LID, volume=True, speed=1.0, radius=0.012, **EVEN)),
    "a floor that shakes": (
        [swarm.Box((0.05, 0.05, 0.05)), FLOOR], {},
        swarm.Source(LID, volume=True, speed=1.0, radius=0.012, **EVEN),
    ),
    "a valve": ([VALVE], {}, swarm.Source(LID, volume=True, beam=(0.0, 0.0, -1.0), radius=0.012, **EVEN)),
    "a plane": ([swarm.Sphere(0.08)], {"plane": "z"}, swarm.Source(0, speed=0.3, radius=0.012, **EVEN)),
}  # fmt: skip


def poured(name, blocked="wait", **more):
    surfaces, scene, source = SCENES[name]
    source = swarm.Source(**{**vars(source), "blocked": blocked})
    options = {"until": 0.2, "every": 0.05, "compile": "never", "seed": 7, "threads": 1, "sources": source, **more}
    return swarm.simulate(swarm.Scene(surfaces, **scene), None, swarm.Impact(), **options)


@pytest.mark.parametrize("blocked", ["wait", "report"])
@pytest.mark.parametrize("name", SCENES)
def test_no_birth_overlaps_and_the_books_balance(name, blocked, tmp_path):
    """By all pairs and all walls: births that need not wait are at the times of frames."""
    result = poured(name, blocked, trajectory=tmp_path / "run.h5", every=0.01)
    seen, surfaces, scene, came = result.observables, *SCENES[name][:2], 0
    scene = swarm.Scene(surfaces, **scene)
    assert seen["energy_error"].max() < 1e-12
    assert seen["max_penetration"].max() < 1e-12
    with swarm.load(tmp_path / "run.h5") as frames:
        for k, now in enumerate(frames.times):
            frame, there = frames.frame(k), frames.born(k)
            inside = there & np.isnan(frames.escape_times(k))
            assert seen["born"][k].sum() == there.sum()
            assert seen["born"][k].sum() - seen["escaped"][k] == inside.sum()
            if name == "a valve":
                np.testing.assert_allclose(seen["total_energy"][k], seen["source_energy"][k], rtol=1e-12)
            for i in np.flatnonzero(inside):
                came += abs(result.birth_time[i] - now) < 1e-12
                here = frame.position[:, [i]]
                if surfaces:
                    assert (scene.distances_outside(here, now, frame.radius[[i]]) <= 1e-12).all()
                for j in np.flatnonzero(inside)[:i]:
                    away = frame.position[:, j] - here[:, 0]
                    for axis, length in enumerate(scene.period or ()):
                        away[axis] -= 0.0 if length is None else length * round(away[axis] / length)
                    reach = frame.radius[i] + frame.radius[j]
                    assert i == j or math.hypot(*away) >= (1.0 - 1e-12) * reach
    assert came >= 10


def test_a_full_vessel_is_full(tmp_path):
    """Balls at rest without gravity: nothing makes room; other places are tried when the next birth is due."""
    found = []
    scene = swarm.Scene([swarm.Box((0.03, 0.03, 0.03))])
    for blocked in ("wait", "report"):
        source = swarm.Source(scene.surfaces[0], volume=True, speed=0.0, radius=0.012, blocked=blocked, **EVEN)
        result = swarm.simulate(scene, None, swarm.Impact(), until=0.5, sources=source, compile="never", seed=3)
        born, most = int(result.observables["born"][-1, 0]), 51
        counted = int(result.observables["blocked"][-1, 0])
        assert 4 <= born <= 8
        # What waits is counted once, and as many places are tried as where it does not wait.
        assert counted <= born + 1 if blocked == "wait" else counted == most - born
        found.append(born)
        rest = result.particles.born().position
        near = min(math.dist(a, b) for a, b in itertools.combinations(rest.T, 2)) if born > 1 else 1.0
        assert near >= 0.024
    assert found[0] == found[1]


@pytest.mark.parametrize("name", ["a box", "a valve"])
def test_threads_frames_halts_and_resumes_change_no_bit(name, tmp_path, monkeypatch):
    one = poured(name, trajectory=tmp_path / "whole.h5")
    require_same(one, poured(name, threads=2))
    many = poured(name, every=0.01)
    np.testing.assert_array_equal(one.particles.position, many.particles.position)
    parts, sessions = in_sessions(
        monkeypatch,
        CollidingRun,
        12,
        lambda: poured(name, trajectory=tmp_path / "parts.h5", resume=True, checkpoint=1e3),
    )
    assert sessions > 5
    require_same(one, parts)


def test_births_cross_counters_from_where_they_are():
    """A ball that is born beyond a counter has not crossed it; one that comes back has, once."""
    up = swarm.Plane((0.0, 0.0, 1.0), 0.0)
    scene = swarm.Scene([swarm.Box((0.05, 0.05, 0.05))])
    source = swarm.Source(LID, volume=True, times=[0.1], beam=(0.0, 0.0, -1.0), radius=0.005)
    seen = swarm.simulate(
        scene, None, swarm.Impact(), until=0.2, every=0.1, sources=source, counters=[up], compile="never"
    ).observables
    # It comes down through it to the floor, and is not back after 0.1 m.
    assert seen["crossings"][1].sum() == 0
    np.testing.assert_array_equal(seen["crossings"][2], [[0, 1]])
