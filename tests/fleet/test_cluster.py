"""Runs on a real cluster of two worker processes on this machine."""

import os
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from typing import NamedTuple

import h5py
import numpy as np
import psutil
import pytest
from same_bits import require_same, require_same_observables
from test_cli import command

import swarm
from swarm import scene_file
from swarm.fleet import connection, jobs, local, sharded_run, shards
from swarm.run import machine
from swarm.run.options import RunOptions
from swarm.run.preflight.admission import task_of
from swarm.run.progress import display_by, in_lines
from swarm.run.simulation import carry_out

N = 600
SCENE = """
surface = [{ kind = "sphere", radius = 0.5 }]
particles = { count = 600, speed = 1.0, seed = 1 }
method = { kind = "impact" }
run = { until = UNTIL, every = 0.5, compile = "never" }
"""


@pytest.fixture(scope="module")
def client():
    from distributed import Client

    with local.started(2) as address, Client(address, set_as_default=False) as made:
        made.wait_for_workers(2)
        yield made


@pytest.fixture(autouse=True)
def quick_looks(monkeypatch):
    monkeypatch.setattr(sharded_run, "_FOLLOWS", 0.05)


def test_a_local_cluster_is_reached_from_this_machine_only(client):
    """Scheduler, workers, their nannies and Dask's dashboard; at ports that the system chose, as two clusters need."""
    found = [
        (process.pid, one.laddr)
        for process in psutil.Process().children(recursive=True)
        for one in process.net_connections()
        if one.status == psutil.CONN_LISTEN
    ]
    assert len({pid for pid, _address in found}) >= 3
    assert {address.ip for _pid, address in found} == {"127.0.0.1"}
    assert 8787 not in {address.port for _pid, address in found}


def cavity():
    scene = swarm.Scene([swarm.Sphere(0.5)])
    return scene, swarm.fill(scene, N, speed=1.0, seed=1), swarm.Impact()


def require_same_runs(one, other, paths):
    require_same(one, other)
    with swarm.load(paths[0]) as a, swarm.load(paths[1]) as b:
        assert a.start == b.start
        assert a.times.tolist() == b.times.tolist()
        for k in range(len(a)):
            assert a.frame(k).position.tobytes() == b.frame(k).position.tobytes()


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    path = tmp_path_factory.mktemp("alone") / "run.h5"
    return swarm.simulate(*cavity(), until=2.0, every=0.5, trajectory=path, compile="never"), path


@pytest.fixture
def kept(client):
    """The shards of the workers tell of their first checkpoint, and stay there until they are killed."""

    def keep():
        import threading

        from distributed import get_worker

        from swarm.run.session import Session

        Session.let_go = threading.Event()

        def look(session, *about, real=Session.look):
            real(session, *about)
            if session._path.exists() and not Session.let_go.is_set():
                get_worker().log_event("kept", session._trajectory.name)
                Session.let_go.wait()

        Session.look = look

    def let_go():
        from swarm.run.session import Session

        # Of the workers that take their places nothing is kept.
        if hasattr(Session, "let_go"):
            Session.let_go.set()

    client.run(keep)
    yield
    client.run(let_go)


def test_a_worker_that_is_killed_changes_no_bit(client, alone, kept, tmp_path):
    workers, killed = list(client.run(os.getpid).values()), []

    async def kill(event):
        _when, name = event
        if not killed and name == "0001.h5":
            killed.extend(workers)
            for pid in killed:
                os.kill(pid, signal.SIGKILL)

    client.subscribe_topic("kept", kill)
    options = {"until": 2.0, "every": 0.5, "compile": "never", "checkpoint": 0.01, "trajectory": tmp_path / "run.h5"}
    result = swarm.simulate(*cavity(), **options, cluster=client)
    client.unsubscribe_topic("kept")
    assert len(killed) == 2
    require_same_runs(alone[0], result, (alone[1], tmp_path / "run.h5"))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.h5", "run.shards"]
    assert sorted(path.name for path in (tmp_path / "run.shards").iterdir()) == ["0000.h5", "0001.h5"]


def test_mdanalysis_reads_the_joined_file_and_so_does_swarm_where_it_is_moved(client, tmp_path):
    import MDAnalysis

    path = tmp_path / "run.h5"
    result = swarm.simulate(*cavity(), until=0.2, every=0.1, compile="never", trajectory=path, cluster=client, shards=3)
    with h5py.File(path) as file:
        group = file["particles/all"]
        units = {name: group[name].attrs["swarm_unit"] for name in ("position/value", "velocity/value", "mass")}
        assert units == {"position/value": b"m", "velocity/value": b"m/s", "mass": b"kg"}
    there = tmp_path / "elsewhere"
    there.mkdir()
    path.rename(there / "moved.h5")
    (tmp_path / "run.shards").rename(there / "run.shards")
    universe = MDAnalysis.Universe.empty(N, trajectory=True)
    universe.load_new(str(there / "moved.h5"), format="H5MD", convert_units=False)
    assert len(universe.trajectory) == 3
    last = universe.trajectory[-1]
    assert np.allclose(last.positions, result.particles.position.T, rtol=1e-6, atol=1e-7)
    with swarm.load(there / "moved.h5") as moved:
        assert moved.frame(-1).position.tobytes() == result.particles.position.tobytes()
        position, _velocity = moved.particle(N - 1)
        assert position[:, -1].tolist() == result.particles.position[:, -1].tolist()
    universe.trajectory.close()
    (there / "run.shards" / "0001.h5").unlink()
    with pytest.raises(swarm.SceneError, match=r"^\S*moved\.h5 needs .*run\.shards/0001\.h5"):
        swarm.load(there / "moved.h5")


@pytest.fixture
def held(client):
    """The shards of the workers report their first frame, and stay there until they get a signal to stop."""

    def hold():
        import threading

        from distributed import get_worker

        from swarm.run.session import Session

        def look(session, *about, real=Session.look):
            if not Session.let_go.is_set():
                get_worker().log_event("held", session._trajectory.name)
                Session.let_go.wait()
            real(session, *about)

        def stop(session, real=Session.stop):
            real(session)
            Session.let_go.set()

        Session.let_go, Session.free = threading.Event(), (Session.look, Session.stop)
        Session.look, Session.stop = look, stop

    def let_go():
        from swarm.run.session import Session

        # Also those of a test that fails: they would hold the workers of all that follow.
        Session.let_go.set()
        Session.look, Session.stop = Session.free

    client.run(hold)
    yield lambda: client.run(let_go)
    client.run(let_go)


def test_a_run_that_is_stopped_goes_on_where_it_was(client, alone, held, tmp_path):
    address = client.scheduler.address
    scene, output = tmp_path / "scene.toml", tmp_path / "run.h5"
    scene.write_text(SCENE.replace("UNTIL", "2.0"))
    words = ["run", str(scene), "-o", str(output), "--cluster", address]
    reached = threading.Event()

    async def reach(event):
        reached.set()

    client.subscribe_topic("held", reach)
    # A shell that starts the tests in the background makes them, and the processes that they start, ignore this signal.
    process = subprocess.Popen(
        [sys.executable, "-m", "swarm", *words, "--shards", "3"], stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    while not reached.wait(1.0):
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    _out, errors = process.communicate(timeout=100)
    assert process.returncode == 130, errors
    assert "--resume" in errors
    held()
    again = command(*words, "--resume", cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    with swarm.load(output) as joined, swarm.load(alone[1]) as single:
        require_same_observables(joined, single)
        assert joined.frame(-1).position.tobytes() == single.frame(-1).position.tobytes()
    assert len(list((tmp_path / "run.shards").iterdir())) == 3
    complete = command(*words, "--resume", cwd=tmp_path)
    assert (complete.returncode, "is complete" in complete.stderr) == (0, True), complete.stderr


class Semi(NamedTuple):
    a: float
    b: float


def own_phi(p, x, y, z):
    return (x / p.a) ** 2 + (y / p.b) ** 2 + z * z - 1.0


def own_gradient(p, x, y, z):
    return 2.0 * x / p.a**2, 2.0 * y / p.b**2, 2.0 * z


@pytest.mark.parametrize("kind", ["formula", "own"])
def test_functions_of_surfaces_reach_the_workers(kind, client, tmp_path):
    box = ((-1.1,) * 3, (1.1,) * 3)
    surface = {
        "formula": lambda: swarm.Formula("x**2/0.16 + y**2/0.25 + z**4 - 1"),
        "own": lambda: swarm.OwnSurface(Semi(0.5, 0.6), own_phi, own_gradient, size=1.0, bounds=box),
    }[kind]()
    scene = swarm.Scene([surface])
    start = swarm.fill(scene, 300, speed=1.0, seed=1)
    both = [
        swarm.simulate(scene, start, swarm.Impact(), until=0.3, compile="never", **where)
        for where in ({}, {"cluster": client, "trajectory": tmp_path / "run.h5"})
    ]
    assert both[0].observables["impacts"][-1] > 50
    assert both[0].particles.position.tobytes() == both[1].particles.position.tobytes()


def test_a_failure_names_the_particle_of_the_whole_run(client, tmp_path):
    scene, start, method = cavity()
    start.velocity[:, :590], start.velocity[:, 591:] = 0.0, 0.0
    method = swarm.AugmentedLagrangian(dt=0.05, penalty=1.0, exponent=2.0, max_sweeps=1, tolerance=1e-30)
    keywords = {"until": 2.0, "compile": "never"}
    with pytest.raises(swarm.RunError) as alone:
        swarm.simulate(scene, start, method, **keywords)
    with pytest.raises(swarm.RunError) as far:
        swarm.simulate(scene, start, method, **keywords, trajectory=tmp_path / "run.h5", cluster=client)
    assert "failed at particle 590: " in str(far.value)
    assert str(far.value) == str(alone.value)


REFUSED = {
    "no trajectory": ({"trajectory": None}, "trajectory must be given with a cluster"),
    "a recording": ({"recording": "run.rrd"}, "recording and live must be left out with a cluster"),
    "a log": ({"impacts": "log.h5"}, "impacts must be None with a cluster"),
    "float32": ({"observables": {"one": lambda frame: 1.0}, "precision": "float32"}, "observables need frames"),
    "some frames": ({"observables": {"one": lambda frame: 1.0}, "frames": 2}, "observables need frames"),
    "a function": ({"observables": {"one": lambda frame: "1"}}, r"observables\['one'\] must return a number"),
    "no cluster": ({"cluster": "local:0"}, "cluster must be"),
    "another type": ({"cluster": 4}, "cluster must be"),
    "no answer": ({"cluster": "tcp://127.0.0.1:9"}, "must answer within 0.3 s"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_is_refused_before_anything_is_written(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(connection, "SCHEDULER", 0.3)
    changes, sentence = REFUSED[name]
    keywords = {"until": 1.0, "trajectory": "run.h5", "cluster": "local:1"} | changes
    with pytest.raises(swarm.SceneError, match=sentence):
        swarm.simulate(*cavity(), **keywords)
    assert not list(tmp_path.iterdir())


def test_particles_that_depend_on_one_another_are_one_shard(tmp_path):
    scene = swarm.Scene([swarm.Sphere(0.5, mass=10.0)])
    with pytest.raises(swarm.SceneError, match="shards must be 1 or left out where a wall has a mass, got 2"):
        swarm.simulate(
            scene, swarm.fill(scene, 10, speed=1.0), swarm.Impact(), until=1.0, trajectory=tmp_path / "run.h5",
            cluster="local:1", shards=2,
        )  # fmt: skip


def coupled(name):
    scene = swarm.Scene([swarm.Sphere(0.5, friction=0.2)], pairs=swarm.Pairs(0.9, friction=0.3))
    if name == "wall with a mass":
        scene = swarm.Scene([swarm.Sphere(0.5, mass=10.0)])
        return scene, swarm.fill(scene, 10, speed=1.0, seed=1), swarm.Impact()
    method = swarm.Impact() if name == "balls" else swarm.Penalty(dt=5e-3, penalty=1e3)
    return scene, swarm.fill(scene, 10, speed=1.0, radius=0.08, seed=1), method


@pytest.mark.parametrize("name", ["balls", "grains", "wall with a mass"])
def test_a_coupled_run_is_one_shard_with_the_same_bits(name, client, tmp_path):
    options = {"until": 1.0, "every": 0.5, "compile": "never"}
    scene, particles, method = coupled(name)
    one = swarm.simulate(scene, particles.copy(), method, trajectory=tmp_path / "one.h5", **options)
    other = swarm.simulate(
        scene, particles.copy(), method, trajectory=tmp_path / "other.h5", cluster=client, **options
    )  # fmt: skip
    require_same_runs(one, other, (tmp_path / "one.h5", tmp_path / "other.h5"))
    if name == "wall with a mass":
        assert other.observables["wall_velocity"][-1].any()
        return
    assert np.isfinite(other.observables["pressure"][-1])
    for made in (one.particles, other.particles, swarm.load(tmp_path / "other.h5").frame(-1)):
        assert np.array_equal(made.spin, one.particles.spin)
        assert np.array_equal(made.radius, particles.radius)
    assert np.array_equal(one.collisions_per_particle, other.collisions_per_particle)


def test_another_version_on_a_worker_is_named():
    class Two:
        def get_versions(self, packages):
            def of(numpy):
                return {"host": {"python": "3.11.7.final.0"}, "packages": dict.fromkeys(packages, "1") | numpy}

            return {"client": of({}), "workers": {"tcp://a:1": of({}), "tcp://b:2": of({"numba": "2"})}}

    with pytest.raises(swarm.SceneError, match=r"must have numba 1, .* got the worker tcp://b:2, which has 2"):
        connection.require_same_versions(Two())


def test_storage_that_is_not_shared_is_named(client, tmp_path, monkeypatch):
    monkeypatch.setattr(connection, "APPEARS", 0.1)

    class Elsewhere:
        def run(self, function, folder, token):
            return {"tcp://a:1": function(folder, token), "tcp://b:2": function(str(tmp_path / "other"), token)}

    with pytest.raises(swarm.SceneError, match=r"share the folder .* got the worker tcp://b:2, which does not find it"):
        connection.require_shared(Elsewhere(), tmp_path)
    connection.require_shared(client, tmp_path)
    assert not list(tmp_path.glob(".swarm-storage.*"))


def test_functions_of_frames_are_given_the_particles_of_all_shards(client, tmp_path):
    def spread(frame):
        return (frame.position * frame.velocity).sum(axis=1)

    ends, shown = [], []
    for where, path in ((None, tmp_path / "one.h5"), (client, tmp_path / "many.h5")):
        ends.append(
            swarm.simulate(
                *cavity(), until=1.0, every=0.25, compile="never", trajectory=path, cluster=where,
                observables={"spread": spread}, progress=lambda frame: shown.append(spread(frame)),
            )
        )  # fmt: skip
    one, many = (end.observables["spread"] for end in ends)
    assert one.shape == (5, 3)
    assert one.tobytes() == many.tobytes() == np.array(shown[:5]).tobytes() == np.array(shown[5:]).tobytes()


def test_code_that_a_file_names_reaches_the_workers(client, tmp_path, monkeypatch):
    """It is in a folder that they do not know."""
    (tmp_path / "laws_of_a_user.py").write_text(
        "import swarm\nfrom swarm.kernel.vector import dot\n\n\nclass Damped(swarm.WallLaw):\n    e: float\n\n"
        "    def leave(self, v, n, u, random, mass):\n        return v - (1.0 + self.e) * dot(v - u, n) * n\n"
    )
    path = tmp_path / "scene.toml"
    law = '{ kind = "sphere", radius = 0.5, laws = [{ law = "laws_of_a_user:Damped", e = 0.9 }] }'
    path.write_text(SCENE.replace('{ kind = "sphere", radius = 0.5 }', law).replace("UNTIL", "1.0"))
    monkeypatch.chdir(tmp_path)
    job = scene_file.read(path, ["laws_of_a_user"])
    monkeypatch.chdir("/")
    ends = [
        carry_out(
            job.scene, job.start(), job.method, replace(job.run, trajectory=tmp_path / f"{k}.h5", cluster=where)
        ).particles.velocity
        for k, where in enumerate((None, client))
    ]
    assert ends[0].tobytes() == ends[1].tobytes()


def test_lines_of_progress_come_from_a_cluster_too(client, tmp_path, capsys):
    swarm.simulate(
        *cavity(), until=1.0, every=0.25, compile="never", trajectory=tmp_path / "run.h5", cluster=client,
        progress=display_by(in_lines(0.0), 0.0),
    )  # fmt: skip
    printed = capsys.readouterr().err.splitlines()
    assert printed
    assert all("%  " in line and "/1 s" in line for line in printed)


def test_what_a_worker_compiles_is_reported(tmp_path, monkeypatch):
    sentences, path = [], tmp_path / "run.h5"
    monkeypatch.setattr(shards, "task_of", lambda folder, k: task_of(*cavity(), RunOptions(1.0, trajectory=path)))
    monkeypatch.setattr(
        machine, "carry_out_task", lambda task, session: task.options.progress.compiling("compiling it")
    )
    monkeypatch.setattr(shards, "write_end", lambda path, end: None)
    assert jobs.carried_out(sharded_run.run_shard, (tmp_path, 0), tell=sentences.append) == {"state": "done"}
    assert sentences == [{"compiling": "compiling it"}]
