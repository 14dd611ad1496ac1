"""A frame of a run with sources never depends on when the run ends: by kind of source, end, frames, and session."""

import dataclasses

import numpy as np
import pytest

import swarm
from swarm.run.session import Session
from swarm.sources.births import with_births

FLOOR = swarm.Box((0.4, 0.4, 0.1), (0.0, 0.0, -0.5))
HATCH = swarm.Sphere(0.2, (0.5, 0.0, 0.0))
ROOM = swarm.Scene([swarm.Box((0.5, 0.5, 0.5), openings=[HATCH])], (0.0, 0.0, -1.0))
HALL = swarm.Scene([swarm.Union([swarm.Sphere(0.5), swarm.Cylinder(0.2, length=2.0)])])
FLAT = swarm.Scene([swarm.Stadium(0.4, 0.4)], plane="z")
CASES = {
    "rate": (ROOM, swarm.Source(0, rate=24.0, speed=1.0)),
    "rate and count": (ROOM, swarm.Source(0, rate=24.0, count=20, speed=1.0)),
    "rate until a stop": (ROOM, swarm.Source(0, rate=24.0, start=0.1, stop=1.0, speed=1.0)),
    "even": (ROOM, swarm.Source(0, rate=24.0, even=True, start=0.25, speed=1.0)),
    "even until a stop": (ROOM, swarm.Source(0, rate=24.0, even=True, stop=1.0, speed=1.0)),
    "times": (ROOM, swarm.Source(0, times=[0.0, 0.25, 0.5, 1.0, 1.0, 1.25], speed=1.0)),
    "count": (ROOM, swarm.Source(0, count=24, stop=1.25, speed=1.0)),
    "count at once": (ROOM, swarm.Source(0, count=10, start=0.5, stop=0.5, speed=1.0)),
    "flux": (ROOM, swarm.Source(0, rate=24.0, temperature=1.0)),
    "flux of an opening": (ROOM, swarm.Source(HATCH, rate=24.0, temperature=1.0)),
    "flux in a plane": (FLAT, swarm.Source(0, rate=24.0, temperature=1.0)),
    "speed in a plane": (FLAT, swarm.Source(0, rate=24.0, speed=1.0)),
    "beam": (ROOM, swarm.Source(0, within=FLOOR, rate=24.0, beam=(0.0, 0.0, 1.0))),
    "wide beam": (ROOM, swarm.Source(0, within=FLOOR, rate=24.0, beam=(0.0, 0.0, 1.0), divergence=2.5)),
    "gas in a volume": (ROOM, swarm.Source(swarm.Sphere(0.3), volume=True, rate=24.0, temperature=1.0)),
    "speed in a volume": (ROOM, swarm.Source(swarm.Sphere(0.3), volume=True, rate=24.0, speed=1.0)),
    "beam in a volume": (ROOM, swarm.Source(swarm.Sphere(0.3), volume=True, rate=24.0, beam=(1, 0, 0), divergence=0.5)),
    "union": (HALL, swarm.Source(0, rate=24.0, temperature=1.0)),
    "two": (ROOM, [swarm.Source(0, rate=12.0, temperature=1.0), swarm.Source(0, rate=12.0, even=True, speed=1.0)]),
}  # fmt: skip


def run(name, folder, until, every, **more):
    scene, sources = CASES[name]
    path = folder / f"{until:g}-{every:g}.h5"
    more = {"compile": "never", "threads": 1, "seed": 3, "trajectory": path, **more}
    swarm.simulate(scene, None, swarm.Impact(), sources=sources, until=until, every=every, **more)
    return path


def those_there(frame):
    """Positions, velocities and masses (7, n) of the particles that have come."""
    rows = np.concatenate([frame.position, frame.velocity, frame.mass[None]])
    return rows[:, ~np.isnan(rows[0])]


def assert_same_frames(path, other):
    """What both hold of the same times: at least two frames, and somebody in the last."""
    with swarm.load(path) as one, swarm.load(other) as two:
        common = np.intersect1d(one.times, two.times, return_indices=True)
        assert len(common[0]) >= 2
        for _moment, i, j in zip(*common, strict=True):
            here, there = (those_there(frame) for frame in (one.frame(i), two.frame(j)))
            np.testing.assert_array_equal(here, there)
            for what, values in one.observables.items():
                np.testing.assert_array_equal(values[i], two.observables[what][j], err_msg=what)
        assert here.shape[1] >= 5


def assert_same_births(scene, sources):
    whole = with_births(scene, None, sources, 3, 1.5)
    for until in (0.75, 1.0, 1.25):
        n = whole.births.there(until)
        part = with_births(scene, None, sources, 3, until)
        assert len(part) == n >= 3
        for what in ("position", "velocity", "mass"):
            np.testing.assert_array_equal(getattr(part, what), getattr(whole, what)[..., :n])
        for mine, all_of_them in zip(part.births[:2], whole.births[:2], strict=True):
            np.testing.assert_array_equal(mine, all_of_them[:n])


@pytest.mark.parametrize("name", CASES)
def test_births_do_not_depend_on_the_end_of_the_run(name):
    """It is before a stop, at a birth, at the stop, and after it."""
    scene, sources = CASES[name]
    assert_same_births(scene, tuple(sources) if isinstance(sources, list) else (sources,))


def test_nor_do_more_births_than_a_batch_of_times():
    scene, source = CASES["rate"]
    assert_same_births(scene, (dataclasses.replace(source, rate=5000.0),))


@pytest.mark.parametrize("name", ["even", "flux"])
def test_a_frame_does_not_depend_on_the_end_of_the_run(name, tmp_path):
    """The end is at a birth, and before one."""
    paths = [run(name, tmp_path, until, 0.25) for until in (0.75, 1.0, 1.25)]
    for path in paths[:2]:
        assert_same_frames(path, paths[2])


@pytest.mark.parametrize("name", ["even", "wide beam"])
def test_nor_does_it_in_a_run_that_was_resumed(name, tmp_path, monkeypatch):
    """Every session ends at its first frame."""
    whole = run(name, tmp_path, 1.25, 0.25)
    look = Session.look

    def stops(session, *about):
        session.stop()
        return look(session, *about)

    monkeypatch.setattr(Session, "look", stops)
    sessions = 0
    while sessions < 10:
        try:
            parts = run(name, tmp_path, 1.0, 0.25, resume=True, checkpoint=1e3)
            break
        except KeyboardInterrupt:
            sessions += 1
    assert sessions == 4
    assert_same_frames(parts, whole)


def test_births_at_the_end_of_a_run_are_in_its_last_frame():
    """A birth at a frame is in it, whether the run ends there or goes on."""
    for source, born in (
        (swarm.Source(0, rate=300.0, even=True, start=0.25, speed=1.0), 226),
        (swarm.Source(0, rate=300.0, even=True, start=0.25, stop=1.0, speed=1.0), 225),
        (swarm.Source(0, times=[1.0], speed=1.0), 1),
    ):
        for until in (1.0, 2.0):
            given = {"sources": source, "until": until, "every": 1.0, "compile": "never"}
            seen = swarm.simulate(ROOM, swarm.fill(ROOM, 1, speed=1.0), swarm.Impact(), **given).observables
            assert seen["born"][1].tolist() == [born]
