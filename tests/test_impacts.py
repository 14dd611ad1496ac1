"""The log of impacts: a row for every one that is counted, the same for any threads, after a halt and a kill."""

import sys
import textwrap

import h5py
import numpy as np
import pytest
from children import python
from click.testing import CliRunner
from conftest import edited, files_limited_to
from scene_texts import in_a_sphere
from test_sessions import halted_after, stopped_at

import swarm
from swarm.commands.cli import app
from swarm.files import checkpoint, paths
from swarm.run import impacts

DOWN = (0.0, 0.0, -1.0)
BALL = swarm.Sphere(0.2, side="outside")
SPHERE = swarm.Scene([swarm.Sphere(0.5)])
ROUGH = swarm.Scene([swarm.Sphere(0.5, restitution=0.9, friction=0.1), swarm.Sphere(0.2, side="outside")], DOWN)
PLACES = np.random.default_rng(3).uniform(-0.4, 0.4, (12, 3))
BALLS = swarm.Spheres(PLACES, np.linspace(0.06, 0.12, 12))
SWUNG = [
    swarm.Box((0.5, 0.4, 0.3), motion=swarm.Oscillation((0.05, 0.0, 0.1), 0.7)),
    swarm.Sphere(0.2, side="outside", friction=0.2, motion=swarm.Rotation((0.0, 0.0, 1.0), 2.0, (0.0, 0.0, 0.0))),
]
LISTED = [swarm.Sphere(0.1, (x, y, 0.0), side="outside") for x in (0.25, 0.5, 0.75) for y in (0.3, 0.7)]
SCENES = {
    "sphere": SPHERE,
    "fall, friction": ROUGH,
    "thermal": swarm.Scene([swarm.Box((0.5, 0.5, 0.5), temperature=0.4, accommodation=0.5), BALL]),
    "thermal, at 0 K": swarm.Scene([swarm.Sphere(0.5, temperature=0.0, accommodation=0.3)], DOWN),
    "rests in a wedge": swarm.Scene(
        [swarm.Plane((1.0, 0.0, -1.0), 0.3, restitution=0.5), swarm.Plane((-1.0, 0.0, -1.0), 0.3, restitution=0.5),
         swarm.Box((0.8, 0.8, 0.8))], DOWN,
    ),
    "field": swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), BALLS]),
    "box that swings": swarm.Scene(SWUNG),
    "cell that repeats": swarm.Scene([BALLS], period=(1.0, 1.0, 1.0)),
    "list in a cell": swarm.Scene(LISTED, period=(1.0, 1.0, 0.4)),
}  # fmt: skip
FIELDS = {"field": 1, "cell that repeats": 0}


def run(path, scene, n=25, until=3.0, every=1.0, method=None, seed=1, **keywords):
    start = swarm.fill(scene, n, speed=1.0, mass=np.linspace(0.5, 2.0, n), seed=seed)
    keywords = {"compile": "never", "threads": 1, **keywords}
    return swarm.simulate(scene, start, method or swarm.Impact(), until=until, every=every, impacts=path, **keywords)


def table_of(path, **chosen):
    with swarm.load_impacts(path) as log:
        return log.table(**chosen)


@pytest.mark.parametrize("name", SCENES)
def test_every_impact_that_is_counted_is_a_row(tmp_path, name):
    scene, n = SCENES[name], 12
    result = run(tmp_path / "i.h5", scene, n, until=2.0)
    mass = np.linspace(0.5, 2.0, n)
    with swarm.load_impacts(tmp_path / "i.h5") as log:
        table = log.table()
        assert len(log) == len(table) > 4
        assert log.ends.tolist() == result.observables["impacts"].tolist()
        assert log.times.tolist() == result.observables["time"].tolist()
        assert log.scene == scene
    assert np.bincount(table["particle"], minlength=n).tolist() == result.impacts_per_particle.tolist()
    assert (np.diff(table["time"]) >= 0.0).all()
    assert ((np.diff(table["time"]) > 0.0) | (np.diff(table["particle"]) >= 0)).all()
    # Each is on its wall, and comes from within.
    normals = np.empty((len(table), 3))
    for k, row in enumerate(table):
        surface = scene.surfaces[row["surface"]]
        if row["member"] >= 0:
            m = row["member"]
            surface = swarm.Sphere(surface.radii[m], surface.centers[m], side="outside")
        points = np.array(row["position"])[:, None]
        if scene.period is not None:
            # The nearest image of the body
            center, lengths = np.array(surface.center), np.array(scene.period)
            points = points - lengths[:, None] * np.round((points - center[:, None]) / lengths[:, None])
        gradient = surface.gradient(points, row["time"])[:, 0]
        size = np.sqrt((gradient**2).sum())
        assert abs(surface.phi(points, row["time"])[0]) < 1e-12 * max(size, 1.0)
        normals[k] = gradient / size * (1.0 if getattr(surface, "side", "inside") == "inside" else -1.0)
    change = table["velocity_after"] - table["velocity_before"]
    pushed = -(change * normals).sum(axis=1) * mass[table["particle"]]
    assert ((table["member"] >= 0) == (table["surface"] == FIELDS.get(name, -1))).all()
    assert ("slip" in table.dtype.names) == any(surface.friction > 0.0 for surface in scene.surfaces)
    assert ("image" in table.dtype.names) == (scene.period is not None)
    if name != "rests in a wedge":
        assert np.abs(pushed - table["impulse"]).max() < 1e-12
        total = result.observables["impulse"][-1]
        for s in range(len(scene.surfaces)):
            assert abs(table["impulse"][table["surface"] == s].sum() - total[s]) < 1e-11 or name == "thermal, at 0 K"
    if name == "fall, friction":
        along = table["velocity_before"] - (table["velocity_before"] * normals).sum(axis=1)[:, None] * normals
        assert np.abs(table["slip"] - along).max() < 1e-13
    if name == "box that swings":
        spun = table[table["surface"] == 1]
        spin = 2.0 * np.column_stack([-spun["position"][:, 1], spun["position"][:, 0], 0.0 * spun["time"]])
        own, n = spun["velocity_before"] - spin, normals[table["surface"] == 1]
        assert np.abs(spun["slip"] - (own - (own * n).sum(axis=1)[:, None] * n)).max() < 1e-13
        assert np.abs(spin).max() > 0.1


def test_a_contact_step_begins_at_the_impact(tmp_path):
    result = run(tmp_path / "i.h5", SPHERE, method=swarm.Impact(contact_step=0.01))
    table = table_of(tmp_path / "i.h5")
    assert len(table) == result.observables["impacts"][-1] > 0
    assert np.abs(np.sqrt((table["position"] ** 2).sum(axis=1)) - 0.5).max() < 1e-14
    assert (np.diff(np.sort(table["time"])) > 0.0).all()


def test_the_images_say_where_it_has_gone(tmp_path):
    """From one impact to the next a particle flies straight."""
    run(tmp_path / "i.h5", SCENES["cell that repeats"], 2, until=40.0, every=20.0)
    table = table_of(tmp_path / "i.h5", particles=1)
    places = table["position"] + table["image"]
    flown = places[:-1] + np.diff(table["time"])[:, None] * table["velocity_after"][:-1]
    assert np.abs(flown - places[1:]).max() < 1e-12
    assert np.abs(table["image"]).max() > 0


@pytest.mark.parametrize("gravity", [None, DOWN])
def test_an_escaped_particle_has_a_last_row(tmp_path, gravity):
    hole = swarm.Sphere(0.3, center=(0.0, 0.0, -0.5))
    vessel = swarm.Scene([swarm.Sphere(0.5, friction=0.1, restitution=0.8, openings=[hole])], gravity)
    result = run(tmp_path / "i.h5", vessel, until=6.0)
    table = table_of(tmp_path / "i.h5")
    out = table[table["impulse"] == 0.0]
    gone = np.flatnonzero(~np.isnan(result.escape_time))
    assert 3 < len(gone) == len(out) == len(table) - result.impacts_per_particle.sum()
    order = np.argsort(out["particle"])
    assert out["particle"][order].tolist() == gone.tolist()
    assert np.abs(out["time"][order] - result.escape_time[gone]).max() < 1e-14
    assert (out["position"][order] == result.particles.position[:, gone].T).all()
    assert (out["velocity_after"] == out["velocity_before"]).all()
    assert (out["slip"] == 0.0).all()
    last = {int(row["particle"]): row["impulse"] for row in table}
    assert all(last[p] == 0.0 for p in gone)


@pytest.mark.level3
@pytest.mark.parametrize("name", ["fall, friction", "thermal"])
def test_the_rows_are_the_same_for_any_threads_and_blocks(tmp_path, monkeypatch, name):
    """And for logs of any size: here a frame fills several."""
    n = 260
    run(tmp_path / "one.h5", SCENES[name], n, until=1.5, every=0.5)
    expected = table_of(tmp_path / "one.h5")
    monkeypatch.setattr(impacts, "_ROWS", 300)
    monkeypatch.setattr(impacts, "_FEW", 40)
    for threads, block in ((1, 3), (2, 64), (3, 100)):
        result = run(
            tmp_path / "other.h5",
            SCENES[name],
            n,
            until=1.5,
            every=0.5,
            threads=threads,
            block_size=block,
            overwrite=True,
        )
        found = table_of(tmp_path / "other.h5")
        assert found.tobytes() == expected.tobytes()
        assert len(found) == result.observables["impacts"][-1]


@pytest.mark.level3
def test_compiled_rows_are_those_of_plain_python(tmp_path, monkeypatch):
    monkeypatch.setattr(impacts, "_ROWS", 512)
    for precision in ("float64", "float32"):
        for compile in ("never", "always") if precision == "float64" else ("never",):
            result = run(
                tmp_path / f"{compile}.h5", ROUGH, 100, compile=compile, precision=precision, overwrite=True, threads=2
            )
        if precision == "float64":
            exact = table_of(tmp_path / "always.h5")
            assert exact.tobytes() == table_of(tmp_path / "never.h5").tobytes()
    rounded = table_of(tmp_path / "never.h5")
    assert rounded["position"].dtype == rounded["impulse"].dtype == np.float32
    assert (rounded["time"] == exact["time"]).all()
    for name in ("position", "velocity_before", "velocity_after", "impulse", "slip"):
        assert (rounded[name] == exact[name].astype(np.float32)).all()
    assert len(rounded) == result.observables["impacts"][-1]


def test_some_particles(tmp_path):
    run(tmp_path / "all.h5", ROUGH)
    table = table_of(tmp_path / "all.h5")
    for given, kept in ((4, range(0, 25, 4)), ([3, 24, 3], [3, 24]), (np.array([7]), [7])):
        run(tmp_path / "some.h5", ROUGH, impact_particles=given, overwrite=True)
        assert table_of(tmp_path / "some.h5").tobytes() == table[np.isin(table["particle"], kept)].tobytes()


def test_a_part_is_read(tmp_path, monkeypatch):
    from swarm.files import impact_log

    run(tmp_path / "i.h5", ROUGH)
    table = table_of(tmp_path / "i.h5")
    monkeypatch.setattr(impact_log, "_AT_ONCE", 10)
    t, p, s = table["time"], table["particle"], table["surface"]
    cases = (
        ({}, t >= 0.0),
        ({"begin": 0.5, "end": 2.0}, (t >= 0.5) & (t < 2.0)),
        ({"begin": t[40], "end": t[50]}, (t >= t[40]) & (t < t[50])),
        ({"begin": 7.0}, t > 7.0),
        ({"particles": [3, 4], "surfaces": 1}, np.isin(p, [3, 4]) & (s == 1)),
        ({"particles": 2, "end": 1.5}, (p == 2) & (t < 1.5)),
    )
    for chosen, rows in cases:
        assert table_of(tmp_path / "i.h5", **chosen).tobytes() == table[rows].tobytes()
    with swarm.load_impacts(tmp_path / "i.h5") as log:
        frame = log.frame(particles=3)
    assert list(frame)[:5] == ["time", "particle", "surface", "member", "position_x"]
    assert (frame["velocity_after_z"] == table["velocity_after"][p == 3, 2]).all()


def test_without_pandas_a_sentence_says_so(tmp_path, monkeypatch):
    run(tmp_path / "i.h5", SPHERE)
    monkeypatch.setitem(sys.modules, "pandas", None)
    with swarm.load_impacts(tmp_path / "i.h5") as log, pytest.raises(swarm.SceneError, match="pip install pandas"):
        log.frame()


# --- In several sessions ---------------------------------------------------------------------------------


def test_a_run_that_was_stopped_goes_on_in_its_log(tmp_path):
    more = {"impacts": tmp_path / "i.h5", "scene": ROUGH, "compile": "never"}
    stopped_at(tmp_path / "run.h5", 2, **more)
    assert len(table_of(tmp_path / "i.h5")) > 0
    swarm.simulate(
        ROUGH, swarm.fill(ROUGH, 20, speed=1.0, seed=1), swarm.Impact(), until=2.0, every=0.5, threads=2,
        trajectory=tmp_path / "run.h5", resume=True, impacts=tmp_path / "i.h5", compile="never",
    )  # fmt: skip
    swarm.simulate(
        ROUGH, swarm.fill(ROUGH, 20, speed=1.0, seed=1), swarm.Impact(), until=2.0, every=0.5, threads=1,
        impacts=tmp_path / "whole.h5", compile="never",
    )  # fmt: skip
    assert table_of(tmp_path / "i.h5").tobytes() == table_of(tmp_path / "whole.h5").tobytes()


def test_a_run_goes_on_in_the_middle_of_a_frame(tmp_path, monkeypatch):
    day, options = 86_400.0, {"until": 6.0, "every": 2.0, "n": 50, "seed": 1}
    run(tmp_path / "whole.h5", ROUGH, **options)
    halted_after(monkeypatch, 12, day)
    within = 0
    for threads in (1, 2, 3) * 40:
        try:
            run(
                tmp_path / "i.h5", ROUGH, **options, trajectory=tmp_path / "run.h5", resume=True, checkpoint=7.0 * day,
                walltime=day, threads=threads,
            )  # fmt: skip
            break
        except swarm.WallTimeError:
            saved = checkpoint.read(paths.checkpoint_of(tmp_path / "run.h5"))[0]
            within += saved.following is not None and saved.rows > 0
    assert within > 5
    assert table_of(tmp_path / "i.h5").tobytes() == table_of(tmp_path / "whole.h5").tobytes()


def test_a_run_does_not_go_on_behind_a_damaged_row_of_the_frame_under_way(tmp_path, monkeypatch):
    """Its rows have no checksum in the file yet: the checkpoint has it."""
    day, options = 86_400.0, {"until": 6.0, "every": 2.0, "n": 50, "seed": 1}
    more = {"trajectory": tmp_path / "run.h5", "resume": True, "checkpoint": 7.0 * day, "walltime": day}
    halted_after(monkeypatch, 12, day)
    saved = checkpoint.SavedRun("", "", "", "", 0, "")
    while saved.following is None or saved.rows == 0:
        with pytest.raises(swarm.WallTimeError):
            run(tmp_path / "i.h5", ROUGH, **options, **more)
        saved = checkpoint.read(paths.checkpoint_of(tmp_path / "run.h5"))[0]
    with h5py.File(tmp_path / "i.h5") as file:
        number = file["impacts/impulse"][saved.rows - 1]
        complete = int(file["frames/complete"][0])
    data = (tmp_path / "i.h5").read_bytes()
    place = data.rindex(number.tobytes())
    (tmp_path / "i.h5").write_bytes(data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :])
    message = rf"impacts/impulse after frame {complete - 1}: expected the checksum that .*run.h5.*has"
    with pytest.raises(swarm.SceneError, match=message):
        run(tmp_path / "i.h5", ROUGH, **options, **more)
    (tmp_path / "i.h5").write_bytes(data)
    with pytest.raises(swarm.WallTimeError):
        run(tmp_path / "i.h5", ROUGH, **options, **more)


KILLED = """
    import os, random, signal, sys, time
    from pathlib import Path
    import numpy as np
    import swarm
    from swarm.run import impacts
    impacts._ROWS, impacts._FEW = 300, 20
    scene = swarm.Scene([swarm.Sphere(0.5)])
    start = swarm.fill(scene, 50, speed=1.0, seed=1)

    def child(into):
        calls = 0

        def tell(frame):
            nonlocal calls
            calls += 1
            os.write(into, frame.written.to_bytes(8, "little"))
            if calls == 60:
                signal.pause()

        time.monotonic = lambda: float(calls)
        try:
            swarm.simulate(scene, start, swarm.Impact(), until=120.0, every=1.0, trajectory={path!r}, threads=2,
                           impacts={log!r}, progress=tell, checkpoint=10.0, resume=True, compile="never", frames="none")
        except swarm.CompleteError:
            pass
        os._exit(0)

    random.seed(7)
    kills = 0
    while True:
        out, into = os.pipe()
        pid = os.fork()
        if pid == 0:
            child(into)
        os.close(into)
        data = b"".join(os.read(out, 8) for _ in range(random.randint(1, 60)))
        time.sleep(random.uniform(0.0, 0.005))
        os.kill(pid, signal.SIGKILL)
        _, status = os.waitpid(pid, 0)
        while more := os.read(out, 1 << 16):
            data += more
        os.close(out)
        if not os.WIFSIGNALED(status):
            break
        kills += 1
        reported = max([int.from_bytes(data[i : i + 8], "little") for i in range(0, len(data) - 7, 8)], default=0)
        if Path({log!r}).exists():
            with swarm.load_impacts({log!r}) as log:
                counts, table = log.ends, log.table()
                assert len(log.times) >= reported, (len(log.times), reported)
                assert len(table) == counts[-1]
                assert (np.bincount(np.searchsorted(log.times, table["time"]), minlength=len(counts))
                        == np.diff(counts, prepend=0)).all()
        else:
            assert not reported
    print("kills", kills)
"""


@pytest.mark.physics
def test_kill_9_loses_nothing_that_was_reported(tmp_path):
    """At random moments, until a run is through: every row once, and with every frame that is reported its impacts."""
    path, log = tmp_path / "run.h5", tmp_path / "i.h5"
    code = textwrap.dedent(KILLED).format(path=str(path), log=str(log))
    output = python("-c", code)
    assert (output.returncode, output.stderr) == (0, "")
    assert int(output.stdout.split()[1]) >= 5
    start = swarm.fill(SPHERE, 50, speed=1.0, seed=1)
    swarm.simulate(
        SPHERE, start, swarm.Impact(), until=120.0, every=1.0, impacts=tmp_path / "whole.h5", compile="never"
    )
    assert table_of(log).tobytes() == table_of(tmp_path / "whole.h5").tobytes()


# --- What is refused -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"impact_particles": "some"}, 'impact_particles must be "all", k for every k-th particle, or a list'),
        ({"impact_particles": 0}, "impact_particles must be 1 or more, got 0"),
        ({"impact_particles": [1, -2]}, "numbers of particles from 0 on"),
        ({"impact_particles": []}, "numbers of particles from 0 on"),
        ({"impact_particles": [25]}, "impact_particles must be numbers of particles, from 0 to 24, got 25"),
        ({"method": swarm.Verlet(dt=1e-2, penalty=1e2)}, r"impacts must be None with Verlet, .*; use Impact"),
        ({"trajectory": "i.h5"}, "is also the trajectory"),
    ],
)
def test_bad_input(tmp_path, monkeypatch, keywords, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(swarm.SceneError, match=message):
        run("i.h5", SPHERE, **keywords)
    assert list(tmp_path.iterdir()) == []


def test_bodies_at_soft_walls_have_no_log(tmp_path):
    body = swarm.place(SPHERE, swarm.dumbbell(0.1, 1.0), 2)
    with pytest.raises(swarm.SceneError, match=r"impacts must be None with Penalty, .*; use Impact"):
        swarm.simulate(SPHERE, body, swarm.Penalty(dt=1e-2, penalty=1e3), until=1.0, impacts=tmp_path / "i.h5")


def test_impact_particles_without_a_log():
    with pytest.raises(swarm.SceneError, match="impact_particles must go with a log of impacts, got 4; give impacts="):
        run(None, SPHERE, impact_particles=4)


def test_an_old_log_is_not_replaced(tmp_path):
    run(tmp_path / "i.h5", SPHERE)
    before = (tmp_path / "i.h5").read_bytes()
    with pytest.raises(swarm.SceneError, match=r"impacts: .*i\.h5 exists; choose another name, or overwrite it"):
        run(tmp_path / "i.h5", SPHERE)
    assert (tmp_path / "i.h5").read_bytes() == before


def test_a_log_of_another_run_is_not_gone_on_with(tmp_path):
    more = {"impacts": tmp_path / "i.h5", "compile": "never"}
    stopped_at(tmp_path / "run.h5", 2, **more)
    start = swarm.fill(SPHERE, 20, speed=1.0, seed=1)

    def resume(**keywords):
        keywords = {"impacts": tmp_path / "i.h5", "compile": "never", **keywords}
        swarm.simulate(
            SPHERE, start, swarm.Impact(), until=2.0, every=0.5, trajectory=tmp_path / "run.h5", resume=True, **keywords
        )

    with pytest.raises(swarm.SceneError, match="log of impacts keeps particles = "):
        resume(impact_particles=3)
    with pytest.raises(swarm.SceneError, match=r"log of impacts keeps particles = .*, got ;"):
        resume(impacts=None)
    with pytest.raises(swarm.SceneError, match="there is no file"):
        resume(impacts=tmp_path / "none.h5")
    run(tmp_path / "other.h5", SPHERE, 20, seed=2)
    with pytest.raises(swarm.SceneError, match=r"other\.h5 is of another run: its particles at the start"):
        resume(impacts=tmp_path / "other.h5")
    with edited(tmp_path / "i.h5") as file:
        file["frames/complete"][0] = 1
    with pytest.raises(swarm.SceneError, match=r"i\.h5 must hold 3 frames and .* impacts, as .*, got 1 and"):
        resume()


def changed(name, value):
    def change(file):
        file[name][...] = value

    return change


DAMAGES = {
    "no walls": (lambda file: file.pop("walls/surface"), "not a log of impacts of swarm: it has no walls/surface"),
    "no impulse": (lambda file: file.pop("impacts/impulse"), "is damaged: its structure: it has no impacts/impulse"),
    "too many": (changed("frames/complete", 50), "is damaged: its structure: frames/time must have the shape"),
    "fewer than before": (
        lambda file: changed("frames/rows", file["frames/rows"][()][::-1])(file),
        "fewer impacts than none",
    ),
    "a wall": (changed("impacts/wall", 7), "is damaged: its rows from 0 on: expected walls from 0 to 0, got 7"),
    "a particle": (changed("impacts/particle", 99), "expected particles below 25, got 99"),
    "a time": (changed("impacts/time", np.nan), "expected finite numbers, got nan at row 0"),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_log_is_refused(tmp_path, name):
    run(tmp_path / "i.h5", SPHERE)
    damage, message = DAMAGES[name]
    with edited(tmp_path / "i.h5") as file:
        damage(file)
    with pytest.raises(swarm.SceneError, match=message):
        table_of(tmp_path / "i.h5")


def test_other_files_are_no_logs(tmp_path):
    run(tmp_path / "i.h5", SPHERE, trajectory=tmp_path / "run.h5")
    with pytest.raises(swarm.SceneError, match=r"run\.h5 is an HDF5 file, but not a log of impacts of swarm"):
        swarm.load_impacts(tmp_path / "run.h5")
    with pytest.raises(swarm.SceneError, match=r"i\.h5 is an HDF5 file, but not a trajectory of swarm"):
        swarm.load(tmp_path / "i.h5")
    with swarm.load_impacts(tmp_path / "i.h5") as log:
        with pytest.raises(swarm.SceneError, match="particles must be numbers from 0 to 24, got 25"):
            log.table(particles=25)
        with pytest.raises(swarm.SceneError, match="end must be begin or later, got 1 before 2"):
            log.table(begin=2.0, end=1.0)
    with pytest.raises(swarm.SceneError, match=r"is closed; open it again with swarm\.load_impacts"):
        log.table()


def test_a_full_disk_ends_the_run_and_keeps_the_frames_before(tmp_path, monkeypatch):
    """Threads that wait for an empty log do not wait for ever."""
    monkeypatch.setattr(impacts, "_ROWS", 300)
    monkeypatch.setattr(impacts, "_FEW", 20)
    with (
        pytest.raises(swarm.FileError, match=r"cannot write .*impacts.* to .*i\.h5: File too large"),
        files_limited_to(500_000),
    ):
        run(tmp_path / "i.h5", SPHERE, 300, until=100.0, every=5.0, threads=2)
    with swarm.load_impacts(tmp_path / "i.h5") as log:
        assert 0 < len(log.table()) == log.ends[-1]
        assert (np.searchsorted(log.times, log.table()["time"]) < len(log.times)).all()


# --- From the command line -------------------------------------------------------------------------------

SCENE_FILE = in_a_sphere('until = 2.0\nevery = 1.0\ncompile = "never"')


def test_a_scene_file_and_the_command_name_a_log(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.toml").write_text(SCENE_FILE + 'impacts = "a.h5i"\nimpact_particles = [1, 2]\n')
    (tmp_path / "b.toml").write_text(SCENE_FILE)
    for words in (["a.toml"], ["b.toml", "--impacts", "b.h5i"]):
        assert CliRunner().invoke(app, ["run", *words, "--quiet"]).exit_code == 0
    both = table_of("a.h5i"), table_of("b.h5i")
    assert set(both[0]["particle"]) == {1, 2}
    assert both[0].tobytes() == both[1][np.isin(both[1]["particle"], [1, 2])].tobytes()
