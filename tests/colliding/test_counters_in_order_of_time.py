"""Counters, the log and the counts of walls in runs in order of time, against an independent count.

The log has each event with its velocities. Flights between two events are straight, or parabolas, so that crossings of
a plane and of a sphere are roots of polynomials, which NumPy finds.
"""

import itertools

import numpy as np
import pytest

import swarm
from swarm.lanes.table import LANES
from swarm.run import impacts

ROOM = swarm.Box((1.0, 0.5, 0.5))
PISTON = swarm.Slab((0, 0, 1), 0.1, side="outside", mass=2.0, motion=swarm.Guide((0, 0, 1), speed=0.3))
SOLID = swarm.Sphere(0.3, (1.0, 0.5, 0.5), "outside")
FALL, CELL = (0.2, 0.3, -1.0), (2.0, 1.0, 1.0)
CASES = {
    "balls": (swarm.Scene([ROOM]), 0.05, 0.3),
    "balls that fall": (swarm.Scene([ROOM], FALL), 0.05, 0.3),
    "balls in a cell": (swarm.Scene([SOLID], period=CELL), 0.05, 0.3),
    "balls in a cell with a counter at its face": (swarm.Scene([SOLID], period=CELL), 0.05, 0.0),
    "balls and a piston": (swarm.Scene([ROOM, PISTON]), 0.05, 0.3),
    "points and a piston": (swarm.Scene([ROOM, PISTON]), None, 0.3),
    "points and a piston that fall": (swarm.Scene([ROOM, PISTON], FALL), None, 0.3),
}
RADIUS = 0.25


def start(name):
    scene, radius, _plane = CASES[name]
    return swarm.fill(scene, 8, speed=1.0, seed=3, radius=radius)


def middle_of(scene):
    """A place around which a sphere is within the scene."""
    return np.array((0.6, 0.5, 0.5) if scene.period else (0.6, 0.1, 0.1))


def run(name, path, **more):
    scene, _radius, plane = CASES[name]
    counters = [swarm.Plane((1.0, 0.0, 0.0), plane), swarm.Sphere(RADIUS, middle_of(scene))]
    options = {"until": 2.0, "every": 0.5, "compile": "never", "member_impacts": True, **more}
    done = swarm.simulate(scene, start(name), swarm.Impact(), counters=counters, impacts=path, **options)
    return done, swarm.load_impacts(path).table()


def flights(name, table, until):
    """The place, the velocity and the length of each flight; places go on beyond the cell."""
    scene, _radius, _plane = CASES[name]
    first, pull = start(name), np.array(scene.gravity or (0.0, 0.0, 0.0))
    partner = table["partner"] if "partner" in table.dtype.names else np.full(len(table), -1)
    for i in range(len(first)):
        r, v, now = first.position[:, i], first.velocity[:, i], 0.0
        for k in np.flatnonzero(((table["particle"] == i) | (partner == i)) & (table["counter"] < 0)):
            way, row = table["time"][k] - now, table[k]
            yield r, v, way
            r, v, now = r + way * (v + 0.5 * way * pull), v + way * pull, row["time"]
            change = row["velocity_after"] - row["velocity_before"]
            # All have the same mass.
            v = v + (change if row["particle"] == i else -change)
        yield r, v, until - now


def counted(name, table, until):
    """The number of crossings of each counter, out and back, and the momentum along x that they carry."""
    scene, _radius, plane = CASES[name]
    pull, images = np.array(scene.gravity or (0.0, 0.0, 0.0)), range(-4, 5) if scene.period else range(1)
    places = [middle_of(scene) + np.array(CELL) * k for k in itertools.product(images, repeat=3)]
    number, carried = np.zeros((2, 2), int), np.zeros((2, 2))
    for r, v, way in flights(name, table, until):
        path = [np.polynomial.Polynomial((r[k], v[k], 0.5 * pull[k])) for k in range(3)]
        levels = [(0, path[0] - plane - CELL[0] * k) for k in images]
        for at in places:
            reach = RADIUS + 0.5 * way * np.linalg.norm(v) + way * way * np.linalg.norm(pull)
            if np.linalg.norm(r + 0.5 * way * v - at) <= reach:
                levels.append((1, sum((path[k] - at[k]) ** 2 for k in range(3)) - RADIUS**2))
        for c, level in levels:
            roots = level.trim(1e-14).roots()
            for t in roots[np.isreal(roots)].real:
                if 0.0 < t < way:
                    sense = int(level.deriv()(t) < 0.0)
                    number[c, sense] += 1
                    carried[c, sense] += path[0].deriv()(t)
    return number, carried


@pytest.mark.parametrize("name", CASES)
def test_crossings_are_those_of_an_independent_count(tmp_path, name):
    done, table = run(name, tmp_path / "log.h5")
    seen = done.observables
    number, carried = counted(name, table, 2.0)
    assert number.sum() > 5
    np.testing.assert_array_equal(seen["crossings"][-1], number)
    np.testing.assert_allclose(seen["crossed_momentum"][-1, :, :, 0], carried, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(swarm.load_impacts(tmp_path / "log.h5").crossings(), number)
    struck = table["surface"] >= 0
    assert struck.sum() == seen["impacts"][-1] == seen["member_impacts"][-1].sum() > 0
    surfaces = np.bincount(table["surface"][struck], table["impulse"][struck], seen["impulse"].shape[1])
    np.testing.assert_allclose(surfaces, seen["impulse"][-1], rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["balls in a cell with a counter at its face", "points and a piston that fall"])
def test_frames_and_full_logs_change_no_count(tmp_path, monkeypatch, name):
    done, table = run(name, tmp_path / "log.h5")
    monkeypatch.setattr(impacts, "_ROWS", LANES + 8)
    more, same = run(name, tmp_path / "more.h5", every=0.1)
    np.testing.assert_array_equal(more.observables["crossings"][-1], done.observables["crossings"][-1])
    np.testing.assert_array_equal(more.particles.position, done.particles.position) if "balls" in name else None
    assert len(same) == len(table)
    np.testing.assert_allclose(same["time"], table["time"], rtol=0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["balls and a piston", "points and a piston"])
def test_a_run_that_is_resumed_counts_on(tmp_path, name):
    def stop(frame):
        if frame.number == 2:
            raise KeyboardInterrupt

    whole, table = run(name, tmp_path / "whole.h5")
    options = {"trajectory": tmp_path / "run.h5", "checkpoint": 0.01}
    with pytest.raises(KeyboardInterrupt):
        run(name, tmp_path / "log.h5", progress=stop, **options)
    done, same = run(name, tmp_path / "log.h5", resume=True, **options)
    assert (same == table).all()
    for one in ("crossings", "member_impacts", "crossed_momentum"):
        np.testing.assert_array_equal(done.observables[one][-1], whole.observables[one][-1])
