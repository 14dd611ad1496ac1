"""The log of contacts of grains: its rows against frames of every step, closed forms and the books of a run."""

import math

import numpy as np
import pytest
from cut_short import in_sessions
from grains_runs import ran

import swarm
from swarm.grains.grains_run import GrainsRun
from swarm.run import impacts

STEP = 5e-3
SOFT = swarm.Penalty(STEP, 4e3)
ROUGH = {"restitution": 0.8, "friction": 0.3, "rolling": 0.05}
WALL = swarm.Plane((1.0, 0.0, 0.0), 0.5), swarm.Plane((-1.0, 0.0, 0.0), 0.5)


def logged(folder, scene, start, method=SOFT, until=1.0, **options):
    path = folder / "log.h5"
    if not options.get("resume"):
        path.unlink(missing_ok=True)
    result = ran(scene, start, method, until, **{"impacts": path, "every": 0.25, **options})
    with swarm.load_impacts(path) as log:
        log.require_intact()
        return result, log.table()


def crowd(n=8, laws=(), **losses):
    scene = swarm.Scene([swarm.Box((0.5, 0.5, 0.5), laws=laws, **losses)], pairs=swarm.Pairs(**losses))
    return scene, swarm.fill(scene, n, speed=1.0, mass=2.0, radius=0.08, seed=3)


def test_a_free_contact_is_half_a_swing(tmp_path):
    """m g'' = -alpha g: half a period, the largest force u sqrt(alpha m), and the impulse 2 m u."""
    start = swarm.Particles((0.0, 0.1, 0.0), (1.5, 0.2, 0.0), 2.0, radius=0.1)
    result, table = logged(tmp_path, swarm.Scene(WALL), start, swarm.Penalty(1e-3, 8e3))
    assert table["surface"].tolist() == [0, 1]
    assert table["impulse"] == pytest.approx(2.0 * 2.0 * 1.5, rel=1e-12)
    assert table["duration"] == pytest.approx(math.pi * math.sqrt(2.0 / 8e3), abs=2e-3)
    assert table["largest_force"] == pytest.approx(1.5 * math.sqrt(2.0 * 8e3), rel=2e-3)
    gained = (start.mass[0] * (table["velocity_after"] - table["velocity_before"])).sum(axis=0)
    moved = start.mass[0] * (result.particles.velocity - start.velocity)[:, 0]
    assert gained == pytest.approx(moved, abs=1e-12)
    assert (table["friction_loss"] == 0.0).all()


@pytest.mark.parametrize("laws", [{}, ROUGH])
def test_rows_are_the_changes_of_frames_of_every_step(tmp_path, laws):
    scene, start = crowd(**laws)
    seen = []
    steps = ran(scene, start, SOFT, 1.0, every=STEP, progress=lambda frame: seen.append(frame.velocity.copy()))
    result, table = logged(tmp_path, scene, start)
    assert np.array_equal(result.particles.position, steps.particles.position)
    velocity = np.array(seen)
    changes = 2.0 * np.diff(velocity, axis=0)
    assert len(table) > 10
    # At the end some last.
    place, radius = result.particles.position, result.particles.radius
    apart = np.linalg.norm(place[:, :, None] - place[:, None], axis=0) - radius[:, None] - radius
    last = np.count_nonzero(np.triu(apart < 0.0, 1)), np.count_nonzero(np.abs(place) + radius > 0.5)
    assert result.observables["collisions"][-1] == (table["partner"] >= 0).sum() + last[0]
    assert result.observables["impacts"][-1] == (table["partner"] < 0).sum() + last[1]
    for row in table:
        last, some = round(row["time"] / STEP), round(row["duration"] / STEP)
        pushes = changes[last - some : last, :, row["particle"]]
        assert np.array_equal(row["velocity_before"], velocity[last - some, :, row["particle"]])
        assert np.array_equal(row["velocity_after"], velocity[last, :, row["particle"]])
        if row["partner"] < 0:
            axis = int(np.argmax(np.abs(pushes.sum(axis=0))))
            pushes = pushes[:, axis : axis + 1]
        elif laws:
            continue
        sizes = np.sqrt((pushes**2).sum(axis=1))
        assert (sizes[:1] > 0.0).all() if laws else (sizes > 0.0).all()
        assert row["impulse"] == pytest.approx(sizes.sum(), rel=1e-12)
        assert row["largest_force"] == pytest.approx(sizes.max() / STEP, rel=1e-12)
    if laws:
        assert 0.0 < table["friction_loss"].sum() < result.observables["dissipated_energy"][-1]
        n = np.abs(table["velocity_before"][table["partner"] < 0] - table["slip"][table["partner"] < 0])
        assert (np.sort(n, axis=1)[:, :2] < 1e-12).all()


def test_what_friction_takes_is_all_that_is_lost_where_nothing_else_takes_any(tmp_path):
    scene, start = crowd(friction=0.4, rolling=0.1)
    result, table = logged(tmp_path, scene, start, until=0.4, every=0.025)
    seen = result.observables
    free = np.flatnonzero(seen["contact_energy"] == 0.0)[-1]
    lost = table["friction_loss"][table["time"] < seen["time"][free] + 1e-9].sum()
    assert lost == pytest.approx(seen["dissipated_energy"][free], rel=1e-12) != 0.0


def test_sessions_full_logs_and_lists_made_anew_change_no_row(tmp_path, monkeypatch):
    scene, start = crowd(**ROUGH)
    whole, table = logged(tmp_path, scene, start)
    assert not set(np.diff(table["time"]) < 0.0) - {False}
    some = logged(tmp_path, scene, start, impact_particles=[3, 7])[1]
    assert (some == table[np.isin(table["particle"], [3, 7]) | np.isin(table["partner"], [3, 7])]).all()
    with monkeypatch.context() as patched:
        patched.setattr(impacts, "_ROWS", 8)
        again, same = logged(tmp_path, scene, start, threads=2)
    assert (same == table).all()
    assert np.array_equal(again.particles.position, whole.particles.position)
    (tmp_path / "log.h5").unlink()
    options = {"trajectory": tmp_path / "run.h5", "resume": True, "checkpoint": 1e3}
    (resumed, same), sessions = in_sessions(
        monkeypatch, GrainsRun, 25, lambda: logged(tmp_path, scene, start, **options)
    )
    assert sessions > 5
    assert (same == table).all()
    assert np.array_equal(resumed.particles.velocity, whole.particles.velocity)


def test_members_images_escapes_and_counters_have_rows(tmp_path):
    bodies = swarm.Spheres([(0.5, 0.5, 0.5), (0.02, 0.02, 0.5)], 0.1)
    floor = swarm.Plane((0.0, 0.0, -1.0), 0.0, openings=[swarm.Sphere(0.2, (0.5, 0.02, 0.0))])
    lid = swarm.Plane((0.0, 0.0, 1.0), 1.0)
    scene = swarm.Scene([floor, bodies, lid], gravity=None, period=(1.0, 1.0, None))
    places = np.array([(0.5, 0.5, 0.8), (0.97, 0.97, 0.8), (0.5, 0.97, 0.2), (0.9, 0.3, 0.5)]).T
    speeds = np.array([(0.0, 0.0, -2.0), (0.0, 0.0, -2.0), (0.0, 0.0, -2.0), (3.0, 0.0, 0.0)]).T
    start = swarm.Particles(places, speeds, 0.1, radius=0.05)
    gate = swarm.Plane((1.0, 0.0, 0.0), 0.7)
    result, table = logged(tmp_path, scene, start, swarm.Penalty(4e-3, 1e3), 0.8, every=0.4, counters=[gate])
    by = {i: table[table["particle"] == i] for i in range(4)}
    assert by[0]["member"][0] == 0
    assert by[1]["member"][0] == 1
    assert by[1]["image"][0].tolist() == [0, 0, 0]
    out = by[2][-1]
    assert (out["surface"], out["impulse"], out["duration"]) == (0, 0.0, 0.0)
    assert out["time"] == result.escape_time[2]
    passed = by[3][by[3]["counter"] >= 0]
    # From one cell to the next it comes back to the other side of the counter.
    assert passed["image"][:, 0].tolist() == [1, 2]
    assert passed["time"] == pytest.approx([0.8 / 3.0, 1.8 / 3.0], abs=1e-12)
    assert passed["position"][:, 0] == pytest.approx(0.7, abs=1e-12)
    assert passed["sense"].tolist() == [0, 0]


def test_a_law_of_a_wall_acts_before_the_row(tmp_path):
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, laws=[swarm.Absorb(0.5)]), swarm.Sphere(1.0)], gravity=None)
    start = swarm.fill(scene, 6, speed=2.0, mass=1.0, radius=0.05, seed=5)
    result, table = logged(tmp_path, scene, start, swarm.Penalty(4e-3, 1e4), 0.6, every=0.6)
    gone = np.flatnonzero(np.isfinite(result.absorbed_time))
    assert len(gone)
    for i in gone:
        last = table[(table["particle"] == i) & (table["surface"] == 0)][-1]
        assert last["time"] == result.absorbed_time[i]
        assert np.array_equal(last["velocity_after"], result.particles.velocity[:, i])


@pytest.mark.parametrize("law", [swarm.Absorb(1.0), swarm.CercignaniLampis(0.5, 0.4, 0.6)])
def test_the_impulse_of_a_row_has_what_a_law_of_the_wall_adds(tmp_path, law):
    """All contacts with the floor have ended: their rows are all that it has felt."""
    floor = swarm.Plane((0.0, 0.0, -1.0), 0.0, laws=[law])
    place, velocity = np.array([[0.0, 0.3, 0.6], [0.0] * 3, [0.1] * 3]), np.array([[0.2] * 3, [0.1] * 3, [-1.0] * 3])
    start = swarm.Particles(place, velocity, 2.0, radius=0.05)
    result, table = logged(tmp_path, swarm.Scene([floor]), start, swarm.Penalty(4e-3, 1e4), 0.2, every=0.2)
    assert result.observables["contact_energy"][-1] == 0.0
    assert table["impulse"].sum() == pytest.approx(result.observables["impulse"][-1, 0], rel=1e-12)


def test_compiled_rows_are_those_of_plain_python(tmp_path):
    """Of pairs and of walls, with what a law adds."""
    scene, start = crowd(laws=[swarm.Lambert(0.5)])
    _result, plain = logged(tmp_path, scene, start)
    _result, table = logged(tmp_path, scene, start, compile="always")
    assert (table["partner"] >= 0).any()
    assert (table["surface"] >= 0).any()
    for name in table.dtype.names:
        assert np.allclose(table[name], plain[name], rtol=1e-9, atol=1e-12), name
