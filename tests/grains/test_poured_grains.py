"""Soft grains that come from sources during a run."""

import functools
import math
import re

import h5py
import numpy as np
import pytest
from cut_short import halted, in_sessions
from same_bits import require_same

import swarm
from swarm.grains.grains_run import GrainsRun
from swarm.run.feeding import _TRIES
from swarm.sources.ball_places import BallPlaces
from swarm.sources.births import with_births

DT = 1e-3
SOFT = swarm.Penalty(dt=DT, penalty=1e3)
LID = swarm.Box((0.05, 0.05, 0.01), center=(0.0, 0.0, 0.04))
ROOM = swarm.Box((0.05, 0.05, 0.05), restitution=0.5, friction=0.3)
PISTON = swarm.Plane((0, 0, 1), 0.03, motion=swarm.Oscillation((0, 0, 0.02), 5.0))
DOWN = {"gravity": (0.0, 0.0, -9.81)}
FALL = {**DOWN, "pairs": swarm.Pairs(restitution=0.5, friction=0.3)}
BALL = {"radius": 0.012, "mass": 0.007}
SIZES = {"radius": (0.008, 0.015), "density": 900.0, "spin": 5.0}
SCENES = {
    "a box": ([ROOM], FALL, swarm.Source(LID, volume=True, rate=200.0, beam=(0.0, 0.0, -0.3), **BALL)),
    "sizes": (
        [swarm.Sphere(0.06, friction=0.2)], DOWN,
        swarm.Source(LID, volume=True, rate=200.0, even=True, speed=0.2, **SIZES),
    ),
    "a piston": (
        [swarm.Box((0.05, 0.05, 0.05)), PISTON], FALL,
        swarm.Source(LID, volume=True, times=np.linspace(0.0, 0.07, 11), beam=(0.0, 0.0, -1.0), **BALL),
    ),
    "a cell": (
        [swarm.Slab((0.0, 0.0, 1.0), 0.05)], {"period": (0.1, 0.1, None), **FALL},
        swarm.Source(0, rate=200.0, temperature=1e-4, **BALL),
    ),
    "a plane": ([swarm.Sphere(0.06)], {"plane": "z"}, swarm.Source(0, rate=200.0, speed=0.3, **BALL)),
}  # fmt: skip


def scene_of(name):
    surfaces, more, source = SCENES[name]
    return swarm.Scene(surfaces, **more), source


@functools.cache
def start_of(name):
    if name != "sizes":
        return None
    return swarm.Particles([[-0.02, 0.02], [0.0, 0.0], [-0.03, -0.03]], np.zeros((3, 2)), 0.01, radius=[0.01, 0.012])


def poured(name, blocked="wait", **more):
    scene, source = scene_of(name)
    source = swarm.Source(**{**vars(source), "blocked": blocked})
    options = {"until": 0.08, "every": 0.02, "compile": "never", "seed": 7, "threads": 1, **more}
    return swarm.simulate(scene, start_of(name), SOFT, sources=source, **options)


@pytest.mark.parametrize("name", SCENES)
def test_no_birth_overlaps_and_the_books_balance(name, tmp_path):
    """By all pairs and all walls, in the frame of each step."""
    result = poured(name, trajectory=tmp_path / "run.h5", every=DT)
    scene, seen, came = scene_of(name)[0], result.observables, 0
    assert seen["energy_error"].max() < 1e-12
    with swarm.load(tmp_path / "run.h5") as frames:
        for k, now in enumerate(frames.times):
            there = frames.born(k)
            assert int(seen["born"][k].sum()) == (there & (frames.birth_source >= 0)).sum()
            frame, new = frames.frame(k), np.flatnonzero(there & (abs(result.birth_time - now) < 0.5 * DT))
            assert np.isnan(frame.position[:, ~there]).all()
            for i in new[frames.birth_source[new] >= 0]:
                came += 1
                here = frame.position[:, [i]]
                assert (scene.distances_outside(here, now, frame.radius[[i]]) <= 1e-12).all()
                for j in np.flatnonzero(there):
                    away = frame.position[:, j] - here[:, 0]
                    for axis, length in enumerate(scene.period or ()):
                        away[axis] -= 0.0 if length is None else length * round(away[axis] / length)
                    assert i == j or math.hypot(*away) >= frame.radius[i] + frame.radius[j]
            total = frame.mass[there].sum()
            weighed = frame.born().mass.sum()
            assert total == weighed
    assert came == seen["born"][-1].sum() >= 5


def test_what_comes_has_the_mass_the_size_and_the_spin_of_its_source():
    scene, source = scene_of("sizes")
    made = with_births(scene, None, (swarm.Source(**{**vars(source), "rate": 1e4}),), 1, 1.0)
    assert 0.008 <= made.radius.min() < 0.0081
    assert 0.0149 < made.radius.max() <= 0.015
    # Four standard deviations of the mean.
    assert abs(made.radius.mean() - 0.0115) < 4 * 0.007 / math.sqrt(12 * len(made))
    np.testing.assert_allclose(made.mass, 900.0 * 4 / 3 * np.pi * made.radius**3)
    np.testing.assert_allclose((made.spin**2).sum(axis=0), 25.0)
    assert abs(made.spin.mean(axis=1)).max() < 4 * 5.0 / math.sqrt(3 * len(made))


@pytest.mark.parametrize("blocked", ["wait", "report"])
def test_a_full_vessel_against_a_loop(blocked, tmp_path):
    """Which births come, when, at which place, and how many were blocked, by a loop over steps, tries and balls."""
    scene = swarm.Scene([swarm.Box((0.03, 0.03, 0.03))], gravity=(0.0, 0.0, -9.81))
    source = swarm.Source(0, rate=400.0, even=True, speed=0.1, radius=0.012, mass=0.007, blocked=blocked)
    options = {"until": 0.1, "every": DT, "compile": "never", "seed": 2, "trajectory": tmp_path / "run.h5"}
    result = swarm.simulate(scene, None, SOFT, sources=source, **options)
    places, due = BallPlaces(scene, source, 0, 2), np.arange(41) / 400.0
    over, tried, waits, since = 0, 0, 0.0, -1
    born, counted, blocks = np.full(41, np.nan), [], 0
    with swarm.load(tmp_path / "run.h5") as frames:
        for k, now in enumerate(frames.times):
            frame, before = frames.frame(k), born.copy()
            held = [tuple(frame.position[:, i]) for i in np.flatnonzero(~np.isnan(before))]
            rms = math.sqrt(np.mean(np.nansum(frame.velocity[:, ~np.isnan(before)] ** 2, axis=0))) if held else 0.0
            while over < 41 and max(due[over], waits) <= now + 1e-9:
                for _try in range(_TRIES):
                    place = tuple(places.at(tried)[0])
                    tried += 1
                    if free := all(math.dist(place, other) > 0.024 for other in held):
                        break
                if free:
                    held.append(place)
                    born[over] = now
                    np.testing.assert_array_equal(frame.position[:, over], place)
                else:
                    blocks, since = blocks + (since < over), over
                    if blocked == "wait":
                        waits = now + 0.012 / max(0.1, math.sqrt(2 * 0.012 * 9.81), rms)
                        break
                over += 1
            counted.append(blocks)
    np.testing.assert_allclose(result.birth_time, born, atol=1e-12)
    np.testing.assert_array_equal(result.observables["blocked"][:, 0], counted)
    assert counted[-1] > 0
    assert 0 < np.isnan(born).sum() < 41
    never = np.isnan(result.particles.position[0])
    np.testing.assert_array_equal(never, np.isnan(born))
    assert len(result.particles.born()) == result.observables["born"][-1, 0]


@pytest.mark.parametrize("name", ["a box", "sizes"])
def test_threads_halts_and_frames_change_no_bit(name, monkeypatch):
    one = poured(name)
    require_same(one, poured(name, threads=2))
    many = poured(name, every=DT)
    np.testing.assert_array_equal(one.particles.position, many.particles.position)
    np.testing.assert_array_equal(one.birth_time, many.birth_time)
    with halted(monkeypatch, GrainsRun, 3) as calls:
        require_same(one, poured(name))
    assert len(calls) > 20


@pytest.mark.parametrize("name", ["sizes", "a cell"])
def test_resumed_at_any_place(name, tmp_path, monkeypatch):
    """The lists, which grow with the births, are of another size than at the start."""
    whole = poured(name, trajectory=tmp_path / "whole.h5")
    parts, sessions = in_sessions(
        monkeypatch, GrainsRun, 13, lambda: poured(name, trajectory=tmp_path / "parts.h5", resume=True, checkpoint=1e3)
    )
    assert sessions > 6
    require_same(whole, parts)
    with swarm.load(tmp_path / "whole.h5") as one, swarm.load(tmp_path / "parts.h5") as other:
        for k in range(len(one)):
            np.testing.assert_array_equal(one.frame(k).position, other.frame(k).position)
            np.testing.assert_array_equal(one.born(k), other.born(k))


def test_exports_hold_those_that_were_born(tmp_path):
    """Of two sources of which one is blocked, so that those that are there are not the first ones."""
    scene = swarm.Scene([swarm.Box((0.05, 0.05, 0.05))])
    nook = swarm.Sphere(1e-6, center=(0.0, 0.0, -0.03))
    often = swarm.Source(nook, volume=True, times=[0.0, 0.001, 0.002], speed=0.0, blocked="report", **BALL)
    sources = [often, swarm.Source(LID, volume=True, times=[0.003, 0.005], speed=0.0, radius=0.01, mass=0.01)]
    file = tmp_path / "run.h5"
    swarm.simulate(scene, None, SOFT, until=0.006, every=DT, sources=sources, trajectory=file, compile="never", seed=1)
    with swarm.load(file) as frames:
        assert [frames.born(k).sum() for k in range(7)] == [1, 1, 1, 2, 2, 3, 3]
        frames.export(tmp_path / "run.csv")
        frames.export(tmp_path / "run.vtkhdf")
        rows = np.genfromtxt(tmp_path / "run.csv", delimiter=",", names=True)
        with h5py.File(tmp_path / "run.vtkhdf") as written:
            ids, radius = (written[f"VTKHDF/PointData/{name}"][:] for name in ("id", "radius"))
        held = np.concatenate([np.flatnonzero(frames.born(k)) for k in range(7)])
        np.testing.assert_array_equal(rows["id"], held)
        np.testing.assert_array_equal(ids, held)
        np.testing.assert_array_equal(radius, frames.radius[held])
        np.testing.assert_allclose(rows["radius"], frames.radius[held])
    assert set(held) == {0, 3, 4}


def test_a_source_without_a_radius_has_that_of_the_grains_at_the_start():
    scene, lid = swarm.Scene([ROOM], **FALL), {"volume": True, "rate": 200.0, "even": True, "speed": 0.1}
    start = swarm.Particles([[-0.02, 0.02], [0, 0], [-0.03, -0.03]], np.zeros((3, 2)), 0.007, radius=0.012)
    options = {"until": 0.05, "compile": "never", "seed": 1}
    given = {"like those at the start": {}, "said": BALL, "by the density": {"density": 2.0}}
    runs = {
        name: swarm.simulate(scene, start, SOFT, sources=swarm.Source(LID, **lid, **more), **options)
        for name, more in given.items()
    }
    assert runs["said"].observables["born"][-1] > 1
    require_same(runs["like those at the start"], runs["said"])
    np.testing.assert_allclose(runs["by the density"].particles.mass[2:], 2.0 * 4 / 3 * np.pi * 0.012**3)

    def refusal(mass, radius, **more):
        unlike = swarm.Particles(start.position, start.velocity, mass, radius=radius)
        with pytest.raises(swarm.SceneError) as error:
            swarm.simulate(scene, unlike, SOFT, sources=swarm.Source(LID, **lid, **more), **options)
        return str(error.value)

    must = "must be given where the particles of the start have"
    assert refusal(0.007, [0.01, 0.012]) == f"sources[0].radius {must} radii from 0.01 to 0.012 m, got None"
    assert refusal([0.007, 0.008], 0.012) == f"sources[0].mass {must} masses from 0.007 to 0.008 kg, got None"


@pytest.mark.parametrize(("radius", "comes"), [(0.02, False), (0.027, True)])
def test_births_that_take_the_same_places_again_are_reported_once(caplog, radius, comes):
    scene = swarm.Scene([swarm.Box((0.03, 0.03, 0.03))])
    source = swarm.Source(0, volume=True, rate=4e5, even=True, speed=0.1, radius=radius, mass=0.007)
    swarm.simulate(scene, None, SOFT, sources=source, until=2e-3, compile="never", seed=2)
    warnings = [message for message in caplog.messages if "random places" in message]
    assert len(warnings) == comes
    # A place is within the box of the centres with the probability 0.1^3.
    assert not warnings or 262 - 65 < int(re.search(r"only (\d+) of 262144", warnings[0])[1]) < 262 + 65


def test_arguments():
    bad = {
        "low <= high": {"radius": (0.02, 0.01)},
        "one of mass and density": {"radius": 0.01, "density": 1.0, "mass": 2.0},
        "blocked": {"radius": 0.01, "blocked": "never"},
    }
    for sentence, given in bad.items():
        with pytest.raises(swarm.SceneError, match=sentence):
            swarm.Source(0, rate=1.0, speed=1.0, **given)
    scene, source = swarm.Scene([ROOM]), scene_of("a box")[1]
    points = swarm.Particles([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    with pytest.raises(swarm.SceneError, match=r"sources\[0\].radius must be left out where the other particles"):
        swarm.simulate(scene, points, swarm.Impact(), until=1.0, sources=source)
    wide = swarm.Source(LID, volume=True, rate=10.0, speed=0.0, radius=0.049)
    with pytest.raises(swarm.SceneError, match=r"sources\[0\].radius must leave a place within the walls"):
        swarm.simulate(scene, None, SOFT, until=1.0, sources=wide)
