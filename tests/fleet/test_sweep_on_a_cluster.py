"""A sweep on a real cluster of two workers of this machine, with real kills."""

import os
import signal
import subprocess
import sys

import h5py
import numpy as np
import pandas as pd
import pytest
from sweep_sessions import RUNNING, until_there_is, write

import swarm
from swarm.files.lock import only_writer
from swarm.fleet import connection, local
from swarm.fleet.sweeping import SweepOptions, carry_out_sweep

SWEEP = '"particles.seed" = {range = 3}\n"surface.0.restitution" = [1.0, 0.8]'
LAW = """import swarm
from swarm.kernel.vector import dot


class Damped(swarm.WallLaw):
    e: float

    def leave(self, v, n, u, random, mass):
        return v - (1.0 + self.e) * dot(v - u, n) * n
"""


@pytest.fixture(scope="module")
def client():
    from distributed import Client

    with local.started(2) as address, Client(address, set_as_default=False) as made:
        made.wait_for_workers(2)
        yield made


@pytest.fixture
def no_second_worker(client):
    """A run whose worker died is given to no other one."""

    def allow(n):
        def on_scheduler(dask_scheduler):
            before, dask_scheduler.allowed_failures = dask_scheduler.allowed_failures, n
            return before

        return client.run_on_scheduler(on_scheduler)

    before = allow(0)
    yield
    allow(before)


@pytest.fixture
def killed(client):
    """The process ids of the workers that were killed, once a run had a checkpoint; its frames wait for that."""
    gone = []

    def hold():
        import threading

        from distributed import get_worker

        from swarm.run.session import Session

        Session.let_go = threading.Event()

        def look(session, *about, real=Session.look):
            real(session, *about)
            if session._path.exists() and not Session.let_go.is_set():
                get_worker().log_event("reached", os.getpid())
                Session.let_go.wait()

        Session.look = look

    def let_go():
        from swarm.run.session import Session

        # Workers that take the places of others hold no run.
        if hasattr(Session, "let_go"):
            Session.let_go.set()

    async def kill(event):
        _when, pid = event
        if pid not in gone:
            gone.append(pid)
            os.kill(pid, signal.SIGKILL)

    client.run(hold)
    client.subscribe_topic("reached", kill)
    yield gone
    client.unsubscribe_topic("reached")
    client.run(let_go)


def datasets(path):
    """Name -> values of every dataset of a file, but for how long the run took, and its checksums.

    Rows of a log are in the order of particle and time: within a frame the file has them as they came.
    """
    found = {}

    def note(name, at):
        if isinstance(at, h5py.Dataset) and "wall_time" not in name and "checksums" not in name:
            found[name] = np.asarray(at[()])

    with h5py.File(path) as file:
        file.visititems(note)
    if "impacts/time" in found:
        order = np.lexsort((found["impacts/time"], found["impacts/particle"]))
        found |= {name: found[name][order] for name in found if len(found[name].shape) and name[:8] == "impacts/"}
    return {name: values.tobytes() for name, values in found.items()}


def assert_the_same(one, other):
    """Two folders of a sweep: the same files, of the same bits."""
    names = sorted(path.name for path in one.iterdir())
    assert sorted(path.name for path in other.iterdir()) == names
    trajectories = [name for name in names if name.endswith(".h5")]
    assert trajectories
    for name in trajectories:
        assert datasets(one / name) == datasets(other / name)
    tables = [pd.read_csv(folder / "results.csv").drop(columns="wall_time") for folder in (one, other)]
    pd.testing.assert_frame_equal(*tables)


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """The sweep on this machine: its file and its folder."""
    folder = tmp_path_factory.mktemp("here")
    path = write(folder / "sweep.toml", SWEEP, count=30, run='checkpoint = 0.01\nthreads = 1\nimpacts = "log.h5"')
    frame = swarm.sweep(path, folder / "out", processes=2)
    assert frame["state"].tolist() == ["done"] * 6
    return path, folder / "out"


def test_a_sweep_on_a_cluster_writes_the_same_files(here, client, tmp_path, monkeypatch):
    path, folder = here
    monkeypatch.chdir(tmp_path)  # where the workers are not
    frame = swarm.sweep(path, "out", cluster=client)
    assert frame["state"].tolist() == ["done"] * 6
    assert_the_same(folder, tmp_path / "out")


def test_runs_whose_workers_are_killed_are_run_again(here, client, killed, tmp_path):
    path, folder = here
    frame = swarm.sweep(path, tmp_path / "out", cluster=client)
    assert len(killed) == 2
    assert frame["state"].tolist() == ["done"] * 6
    assert_the_same(folder, tmp_path / "out")


def test_a_run_that_kills_each_worker_fails_alone(client, no_second_worker, tmp_path, monkeypatch):
    """By a function of the user, in a folder that the workers do not have."""
    (tmp_path / "deadly.py").write_text(
        "import os, signal\n\n\ndef worth(frame):\n    if frame.mass[0] == 2.0:\n"
        "        os.kill(os.getpid(), signal.SIGKILL)\n    return 1.0\n"
    )
    path = write(tmp_path / "sweep.toml", '"particles.mass" = [1.0, 2.0]', run='observables = {worth = "deadly:worth"}')
    monkeypatch.chdir(tmp_path)
    frame = swarm.sweep(path, tmp_path / "out", plugins=["deadly"], cluster=client)
    assert frame["state"].tolist() == ["done", "failed"]
    assert "each of the 1 workers that took it has died" in frame["error"][1]
    client.wait_for_workers(2)


def test_code_that_the_file_names_reaches_the_workers(client, tmp_path, monkeypatch):
    (tmp_path / "laws_of_a_sweep.py").write_text(LAW)
    path = write(tmp_path / "sweep.toml", '"surface.0.laws.0.e" = [0.9, 0.8]', run="threads = 1")
    law = 'radius = 0.5\nlaws = [{ law = "laws_of_a_sweep:Damped", e = 0.9 }]'
    path.write_text(path.read_text().replace("radius = 0.5", law))
    monkeypatch.chdir(tmp_path)
    for name, where in (("here", {"processes": 1}), ("there", {"cluster": client})):
        frame = swarm.sweep(path, tmp_path / name, plugins=["laws_of_a_sweep"], **where)
        assert frame["state"].tolist() == ["done"] * 2
        assert frame["kinetic_energy"].nunique() == 2
    assert_the_same(tmp_path / "here", tmp_path / "there")


def test_a_stopped_sweep_goes_on_anywhere(here, client, tmp_path):
    """First on the cluster until a limit that is over at once, then there, and then here."""
    path, folder = here
    outcome = carry_out_sweep(path, SweepOptions(tmp_path / "out", cluster=client, walltime=1e-9))
    assert outcome.stopped == "walltime"
    assert {row["state"] for row in outcome.results.rows()} <= {"done", "waiting"}
    swarm.sweep(path, tmp_path / "out", cluster=client, resume=True)
    swarm.sweep(path, tmp_path / "out", processes=1, resume=True)
    assert_the_same(folder, tmp_path / "out")


def test_a_sweep_whose_parent_is_killed_ends_on_the_workers(client, tmp_path):
    """Its runs, which would never end, save checkpoints, and let go of their files for the sweep that goes on."""
    path = write(tmp_path / "sweep.toml", '"run.until" = [1e8, 2e8]', run="frames = 1\ncheckpoint = 1e6\nthreads = 1")
    path.write_text(path.read_text().replace("every = 0.5\n", ""))
    out = tmp_path / "out"
    words = ["sweep", str(path), "-o", str(out), "--cluster", client.scheduler.address]
    parent = subprocess.Popen([sys.executable, "-m", "swarm", *words], stderr=subprocess.PIPE)
    until_there_is(lambda: len(list(out.glob("[!.]*.h5"))) == 2 or parent.poll() is not None)
    parent.kill()
    parent.communicate()
    until_there_is(lambda: len(list(out.glob("*.checkpoint"))) == 2)
    for file in out.glob("[!.]*.h5"):
        with only_writer(file, patience=RUNNING):
            pass


def test_what_cannot_be_is_refused_before_anything_is_written(here, tmp_path, monkeypatch):
    path, _folder = here
    monkeypatch.setattr(connection, "SCHEDULER", 0.3)
    for keywords, sentence in (
        ({"cluster": "tcp://127.0.0.1:9"}, "must answer within 0.3 s"),
        ({"cluster": 4}, "cluster must be"),
        ({"cluster": "local:1", "processes": 2}, "processes must be None with a cluster"),
    ):
        with pytest.raises(swarm.SceneError, match=sentence):
            swarm.sweep(path, tmp_path / "out", **keywords)
        assert not list(tmp_path.iterdir())


def test_a_file_that_a_worker_does_not_find_is_named(client, tmp_path, monkeypatch):
    monkeypatch.setattr(connection, "APPEARS", 0.1)
    connection.require_read(client, [tmp_path])

    class Elsewhere:
        def run(self, function, files):
            return {"tcp://a:1": "", "tcp://b:2": function(files)}

    with pytest.raises(swarm.SceneError, match=r"tcp://b:2, which does not find \S*walls\.stl"):
        connection.require_read(Elsewhere(), [tmp_path, tmp_path / "walls.stl"])
