"""Counters and the log of impacts of bodies: against loops over frames, closed forms, and the momentum."""

import numpy as np
import pytest
from cut_short import in_sessions

import swarm
from swarm.bodies.body_run import BodyRun
from swarm.run import impacts as logs

BOX = (0.25, 0.3, 0.35)
PLAIN = {"compile": "never"}


def vessel(gravity=None, **laws):
    return swarm.Scene([swarm.Box(BOX, **laws)], gravity=gravity)


def tumbling(scene, n=2, edge=0.1):
    return swarm.place(scene, swarm.tetrahedron(edge=edge, mass=2.0), n, speed=1.0, spin=3.0, seed=3)


def normals_of(surface, places):
    slopes = np.array([surface.gradient(place[:, None])[:, 0] for place in places])
    return slopes / np.linalg.norm(slopes, axis=1)[:, None]


@pytest.mark.parametrize("gravity", [None, (0.2, -0.1, -2.0)])
def test_counts_are_those_of_the_frames_and_the_log_has_them(tmp_path, gravity):
    scene, files = vessel(gravity), {"trajectory": tmp_path / "t.h5", "impacts": tmp_path / "i.h5"}
    shapes = [swarm.Plane((1.0, 0.3, 0.0), 0.0), swarm.Sphere(0.2, (0.1, 0.0, 0.0))]
    start = tumbling(scene, n=3)
    run = swarm.simulate(
        scene, start, swarm.Impact(dt=0.02), until=0.8, every=0.02, counters=shapes, **files, **PLAIN
    )  # fmt: skip
    with swarm.load(tmp_path / "t.h5") as frames:
        places = [frames.bodies(k).centers() for k in range(len(frames))]
    expected = []
    for shape in shapes:
        changes = np.diff(np.array([shape.phi(place) > 0.0 for place in places]).astype(int), axis=0)
        expected.append([(changes > 0).sum(), (changes < 0).sum()])
    assert np.sum(expected) > 2
    assert run.observables["crossings"][-1].tolist() == expected
    with swarm.load_impacts(tmp_path / "i.h5") as log:
        table = log.table()
        assert log.crossings().tolist() == expected
    passed = table[table["counter"] >= 0]
    assert set(passed["particle"]) <= {0, 1, 2}
    for shape, counter in zip(shapes, (0, 1), strict=True):
        there = passed[passed["counter"] == counter]["position"]
        assert np.abs(shape.phi(there.T)).max() < 1e-14
    crossed = run.observables["crossed_momentum"][-1]
    assert crossed.sum(axis=(0, 1)) == pytest.approx(2.0 * passed["velocity_before"].sum(axis=0), abs=1e-13)


@pytest.mark.parametrize("laws", [{}, {"restitution": 0.6}])
def test_the_momentum_is_that_of_the_logged_impulses(tmp_path, laws):
    scene = vessel((0.2, -0.1, -2.0), **laws)
    start = tumbling(scene)
    run = swarm.simulate(
        scene, start, swarm.Impact(dt=0.02), until=1.0, impacts=tmp_path / "i.h5", **PLAIN
    )  # fmt: skip
    seen = run.observables
    with swarm.load_impacts(tmp_path / "i.h5") as log:
        table = log.table()
    assert len(table) == seen["impacts"][-1] > 3
    assert table["impulse"].sum() == pytest.approx(seen["impulse"][-1].sum(), rel=1e-13)
    box = scene.surfaces[0]
    assert np.abs(box.phi(table["position"].T)).max() < 1e-12
    normals = normals_of(box, table["position"])
    pushed = -(table["impulse"][:, None] * normals).sum(axis=0) + 2 * 2.0 * 1.0 * np.array(scene.gravity)
    assert seen["momentum"][-1] - seen["momentum"][0] == pytest.approx(pushed, abs=1e-12)
    # Newton's law at the contact point, along the normal.
    before, after = (
        (normals * table[name]).sum(axis=1) for name in ("velocity_before", "velocity_after")
    )  # fmt: skip
    assert after == pytest.approx(-laws.get("restitution", 1.0) * before, abs=1e-10)
    assert seen["energy_error"].max() < 1e-12


def test_what_a_law_sends_off_has_a_row_too(tmp_path):
    scene = vessel(temperature=0.5)
    run = swarm.simulate(
        scene, tumbling(scene, n=1), swarm.Impact(dt=0.02), until=0.8, impacts=tmp_path / "i.h5", **PLAIN
    )  # fmt: skip
    with swarm.load_impacts(tmp_path / "i.h5") as log:
        table = log.table()
    assert len(table) == run.observables["impacts"][-1] > 0
    assert table["impulse"].sum() == pytest.approx(run.observables["impulse"][-1].sum(), rel=1e-13)
    normals = normals_of(scene.surfaces[0], table["position"])
    assert ((normals * table["velocity_after"]).sum(axis=1) < 0.0).all()
    # The wall gives heat: no mirror.
    speeds = [np.linalg.norm(table[name], axis=1) for name in ("velocity_before", "velocity_after")]
    assert np.abs(speeds[1] - speeds[0]).min() > 1e-6


def test_a_flight_up_and_down_through_a_counter_in_one_step_counts_twice(tmp_path):
    scene = vessel((0.0, 0.0, -2.0))
    rod = swarm.dumbbell(length=0.1, mass=2.0)
    velocity = np.zeros((3, 2, 1))
    velocity[2] = 0.1
    start = swarm.Bodies(rod, rod.points.T[:, :, None], velocity)
    # The apex is at 0.0025 m, at 0.05 s; the step is the whole frame.
    counter = swarm.Plane((0.0, 0.0, 1.0), 0.0016)
    run = swarm.simulate(
        scene, start, swarm.Impact(dt=0.2), until=0.1, counters=[counter], impacts=tmp_path / "i.h5", **PLAIN
    )  # fmt: skip
    assert run.observables["crossings"][-1].tolist() == [[1, 1]]
    with swarm.load_impacts(tmp_path / "i.h5") as log:
        times = log.table()["time"]
    assert times == pytest.approx([0.05 - 0.03, 0.05 + 0.03], abs=1e-14)


def test_a_pendulum_is_counted_by_its_steps():
    rod = swarm.Body([(0.0, 0.0, 0.0), (0.2, 0.0, 0.0)], 1.0, links=[(0, 1)], anchors={0: None})
    scene = vessel((0.0, 0.0, -9.81))
    start = swarm.Bodies(rod, rod.points.T[:, :, None], np.zeros((3, 2, 1)))
    run = swarm.simulate(
        scene, start, swarm.Impact(dt=5e-3), until=1.8, every=0.6, counters=[swarm.Plane((1.0, 0.0, 0.0), 0.0)], **PLAIN
    )  # fmt: skip
    # A quarter of a period is 1.854 sqrt(l/g) = 0.265 s, and then it passes the lowest place every 0.53 s.
    assert run.observables["crossings"][:, 0].sum(axis=1).tolist() == [0, 1, 2, 3]


def test_a_log_that_is_full_goes_on_with_the_same_rows(tmp_path, monkeypatch):
    scene, tables = vessel(), []
    start = tumbling(scene)
    for rows in (1 << 10, 9):
        monkeypatch.setattr(logs, "_ROWS", rows)
        monkeypatch.setattr(logs, "LANES", 8)
        file = tmp_path / f"{rows}.h5"
        run = swarm.simulate(
            scene, start, swarm.Impact(dt=0.02), until=1.0, every=1.0, impacts=file, impact_particles=[1],
            threads=2, block_size=1, **PLAIN,
        )  # fmt: skip
        assert run.observables["impacts"][-1] > 3
        with swarm.load_impacts(file) as log:
            tables.append(log.table())
    assert set(tables[0]["particle"]) == {1}
    assert (tables[0] == tables[1]).all()


def test_there_is_no_log_of_bodies_that_are_not_there(tmp_path):
    scene = vessel()
    with pytest.raises(swarm.SceneError, match="impact_particles must be numbers of particles, from 0 to 1, got 2"):
        swarm.simulate(
            scene, tumbling(scene), swarm.Impact(dt=0.02), until=1.0, impacts=tmp_path / "i.h5", impact_particles=[2]
        )  # fmt: skip


def test_a_run_in_many_sessions_goes_on_with_its_counters_and_its_log(tmp_path, monkeypatch):
    scene, planes = vessel(), [swarm.Plane(row, 0.0) for row in np.eye(3).tolist()]
    start = tumbling(scene)

    def run(name):
        return swarm.simulate(
            scene, start, swarm.Impact(dt=0.02), until=0.5, every=0.25, counters=planes,
            trajectory=tmp_path / f"{name}.h5", impacts=tmp_path / f"{name}i.h5", resume=True, checkpoint=3600.0,
            **PLAIN,
        )  # fmt: skip

    at_once = run("a")
    in_parts, ended = in_sessions(monkeypatch, BodyRun, 20, lambda: run("b"))
    assert ended > 1
    assert at_once.observables["crossings"][-1].sum() > 0
    assert (at_once.observables["crossings"] == in_parts.observables["crossings"]).all()
    with swarm.load_impacts(tmp_path / "ai.h5") as one, swarm.load_impacts(tmp_path / "bi.h5") as other:
        assert len(one.table()) > 1
        assert (one.table() == other.table()).all()
