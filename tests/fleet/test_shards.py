"""Shards against the single run, bit for bit. They run here, one after the other, as they would on workers."""

import shutil
import signal

import numpy as np
import pytest
from children import python
from same_bits import require_same_observables

import swarm
from bench.shards import carry_out
from bench.shards import same as the_same
from swarm import scene_file
from swarm.files import paths
from swarm.fleet.sharded_run import Sharded
from swarm.run import machine
from swarm.run.options import RunOptions
from swarm.run.preflight.admission import task_of
from swarm.run.session import Session
from swarm.serialization import plugins

N = 520  # three chunks, the last one not whole
TIMES = {"until": 0.2, "every": 0.1, "compile": "never"}


def sphere():
    scene = swarm.Scene([swarm.Sphere(0.5)])
    return scene, swarm.fill(scene, N, speed=1.0, seed=1), swarm.Impact()


def thermal():
    scene = swarm.Scene([swarm.Sphere(0.5, temperature=1.5, accommodation=0.7)])
    return scene, swarm.fill(scene, N, temperature=1.0, seed=2), swarm.Impact()


def sliding():
    scene = swarm.Scene([swarm.Sphere(0.5, restitution=0.5)], gravity=(0.0, 0.0, -1.0))
    start = swarm.fill(scene, N, speed=0.1, seed=3)
    start.velocity[:] = 0.0
    start.position[:, ::2] = np.array([[0.0], [0.0], [-0.49]])
    return scene, start, swarm.Impact()


def penalty():
    scene = swarm.Scene([swarm.Sphere(0.5)])
    return scene, swarm.fill(scene, N, speed=1.0, seed=4), swarm.Penalty(dt=0.05, penalty=1e4)


def loops():
    scene = swarm.Scene([swarm.Sphere(0.5)])
    method = swarm.AugmentedLagrangian(dt=0.05, penalty=1e3, adaptive=True)
    return scene, swarm.fill(scene, N, speed=1.0, seed=4), method


def openings():
    hole = swarm.Sphere(0.2, center=(0.0, 0.0, 0.5))
    scene = swarm.Scene([swarm.Sphere(0.5, openings=[hole])])
    return scene, swarm.fill(scene, N, speed=1.0, seed=5), swarm.Impact()


def fed():
    hole = swarm.Sphere(0.2, center=(0.0, 0.0, 0.5))
    scene = swarm.Scene([swarm.Sphere(0.5, openings=[hole], laws=[swarm.Lambert()])])
    return scene, swarm.fill(scene, 100, speed=1.0, seed=5), swarm.Impact()


SOURCES = [swarm.Source(0, rate=2000.0, temperature=1.0), swarm.Source(0, volume=True, count=100, stop=0.2, speed=1.0)]


def periodic():
    scene = swarm.Scene([swarm.Sphere(0.3, side="outside")], period=(1.0, 1.0, 1.0))
    return scene, swarm.fill(scene, N, speed=1.0, seed=6), swarm.Impact()


def moving():
    wall = swarm.Plane((0.0, 0.0, -1.0), 0.5, motion=swarm.Oscillation((0.0, 0.0, 0.01), 2.0))
    scene = swarm.Scene([wall, swarm.Plane((0.0, 0.0, 1.0), 0.5)])
    rng = np.random.default_rng(7)
    start = swarm.Particles(rng.uniform(-0.4, 0.4, (3, N)), rng.standard_normal((3, N)))
    return scene, start, swarm.Impact()


def bodies():
    scene = swarm.Scene([swarm.Box((2.7, 2.7, 2.7))], gravity=(0.0, 0.0, -1.0))
    rod = swarm.dumbbell(length=0.2, mass=1.0)
    n, rng = N, np.random.default_rng(8)
    center, velocity = rng.uniform(-2.5, 2.5, (3, 1, n)), 4.0 * rng.standard_normal((3, 1, n))
    start = swarm.Bodies(rod, center + rod.points.T[:, :, None], np.repeat(velocity, 2, axis=1))
    return scene, start, swarm.Impact(dt=0.05)


# Sums whose last bits depend on the order of the particles.
OWN = {
    "energy": lambda frame: (frame.energy * frame.position).sum(axis=1),
    "late": lambda frame: np.nansum(frame.escape_time) + (frame.impacts[1:] * frame.mass[:-1]).sum(),
    "cells": lambda frame: 0.0 if frame.image is None else frame.image @ frame.mass,
}
CASES = {
    "sphere": (sphere, {}),
    "every seventh in float32": (sphere, {"frames": 7, "precision": "float32", "compression": "gzip"}),
    "few of them": (sphere, {"frames": 300}),
    "no particles": (sphere, {"frames": "none"}),
    "members": (periodic, {"until": 0.4, "member_impacts": True}),
    "thermal": (thermal, {"seed": 2**64 - 3, "member_impacts": True}),
    "sliding": (sliding, {}),
    "members on which they slide": (sliding, {"member_impacts": True}),
    "penalty": (penalty, {"until": 0.2, "every": 0.1}),
    "loops": (loops, {"until": 0.1, "every": 0.05}),
    "openings": (openings, {"observables": OWN | {"gone": lambda frame: np.isfinite(frame.absorbed_time).sum()}}),
    "counters": (openings, {"counters": [swarm.Plane((0.0, 0.0, 1.0)), swarm.Sphere(0.2)]}),
    "sources": (fed, {"sources": SOURCES, "observables": OWN, "member_impacts": True}),
    "sources, every third": (fed, {"sources": SOURCES, "frames": 3}),
    "a cell": (periodic, {"until": 0.4, "observables": OWN}),
    "moving": (moving, {}),
    "bodies": (bodies, {"until": 0.1, "every": 0.05, "observables": OWN, "member_impacts": True}),
}

PLUGINS = """
[particles]
count = 520
speed = 1.0
seed = 1

[[surface]]
kind = "examples.own_surface:Superellipsoid"
semi_axes = [0.3, 0.4, 0.5]

[method]
kind = "impact"

[run]
until = 0.4
observables = { rank = "numpy:ndim" }
"""


@pytest.fixture
def on_a_cluster():
    """A function that runs so many shards of a run here."""

    def carried(scene, start, method, count, **keywords):
        options = RunOptions(cluster="local:1", shards=count, **keywords)
        end = carry_out(task_of(scene, start, method, options), Sharded(options))
        written = machine.read_back(options.trajectory)
        assert list(end.observables) == list(written)
        assert all(the_same(values, written[name]) for name, values in end.observables.items())
        return end

    return carried


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """A function that gives how a case ends on this machine, and its trajectory; each is run once."""
    known = {}

    def carried(name):
        if name not in known:
            make, keywords = CASES[name]
            path = tmp_path_factory.mktemp("alone") / "run.h5"
            scene, start, method = make()
            options = RunOptions(**TIMES | keywords, trajectory=path)
            task = task_of(scene, start, method, options)
            known[name] = machine.carry_out_task(task, Session(options)), path
        return known[name]

    return carried


@pytest.mark.parametrize(
    ("name", "count"), [*((name, 3) for name in CASES), ("thermal", 1), ("thermal", 2), ("bodies", 2)]
)
def test_any_number_of_shards_gives_the_same_bits(name, count, alone, on_a_cluster, tmp_path):
    make, keywords = CASES[name]
    end, path = alone(name)
    path_of_shards = tmp_path / "run.h5"
    keywords = TIMES | keywords
    other = on_a_cluster(*make(), count, **keywords, trajectory=path_of_shards)
    require_same_observables(end, other)
    for key in ("position", "velocity", "mass"):
        assert the_same(getattr(end.particles, key), getattr(other.particles, key)), key
    assert the_same(end.impacts_per_particle, other.impacts_per_particle)
    assert the_same(end.escape_time, other.escape_time)
    assert the_same(end.birth_time, other.birth_time)
    assert int(end.impacts_per_particle.sum()) > 20
    assert (end.multipliers is None) == (other.multipliers is None)
    for mine, its in zip(end.multipliers or (), other.multipliers or (), strict=True):
        assert the_same(mine, its)
    if end.particles.image is not None:
        assert the_same(end.particles.image, other.particles.image)
    require_same_file(path, path_of_shards)


def test_workers_are_sent_the_modules_that_are_not_installed(on_a_cluster, tmp_path, monkeypatch):
    """A surface of a module in the current folder, and a function of an installed package, as a scene file has them."""
    monkeypatch.setattr(plugins, "imported", set())
    path = tmp_path / "scene.toml"
    path.write_text(PLUGINS)
    job = scene_file.read(path, ["examples.own_surface", "numpy"])
    assert plugins.not_installed() == ["examples.own_surface"]
    keywords = {"until": 0.4, "every": 0.2, "compile": "never", "observables": job.run.observables}
    shown = on_a_cluster(job.scene, job.start(), job.method, 2, **keywords, trajectory=tmp_path / "run.h5")
    alone = swarm.simulate(job.scene, job.start(), job.method, **keywords)
    assert the_same(shown.particles.position, alone.particles.position)
    assert the_same(shown.observables["rank"], alone.observables["rank"])
    assert int(shown.impacts_per_particle.sum()) > 20
    # NumPy is not sent: scenes of this kind hold its numbers, which would be pickled with their classes.
    assert on_a_cluster(*periodic(), 2, until=0.4, every=0.2, compile="never", trajectory=tmp_path / "cell.h5")


def test_workers_are_sent_the_modules_of_a_package(on_a_cluster, tmp_path, monkeypatch):
    """A package beside the scene file that takes its surface from a module of its own."""
    package = tmp_path / "vessels"
    package.mkdir()
    (package / "__init__.py").write_text("from .bowls import Superellipsoid\n")
    shutil.copy("examples/own_surface.py", package / "bowls.py")
    monkeypatch.setattr(plugins, "imported", set())
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / "scene.toml"
    path.write_text(PLUGINS.replace("examples.own_surface", "vessels"))
    job = scene_file.read(path, ["vessels", "numpy"])
    keywords = {"until": 0.4, "every": 0.2, "compile": "never"}
    shown = on_a_cluster(job.scene, job.start(), job.method, 2, **keywords, trajectory=tmp_path / "run.h5")
    alone = swarm.simulate(job.scene, job.start(), job.method, **keywords)
    assert the_same(shown.particles.position, alone.particles.position)
    assert int(shown.impacts_per_particle.sum()) > 20


def require_same_file(one, other):
    """Every dataset of two trajectories has the same type, shape and bits, but for how long the runs took, and how."""
    import h5py

    of_one_machine = {f"parameters/{name}" for name in ("until", "threads", "wall_time")}

    def datasets(file):
        found = {}
        file.visititems(lambda name, at: found.update({name: at[()]} if isinstance(at, h5py.Dataset) else {}))
        return found

    with h5py.File(one, "r", locking=False) as a, h5py.File(other, "r", locking=False) as b:
        mine, its = datasets(a), datasets(b)
    mine, its = (
        {name: values for name, values in held.items() if name not in of_one_machine and "checksums" not in name}
        for held in (mine, its)
    )
    assert mine.keys() == its.keys()
    for name, values in mine.items():
        assert the_same(values, its[name]), name


@pytest.mark.parametrize("case", ["sphere", "bodies"])
def test_a_flipped_bit_of_a_shard_is_reported(case, on_a_cluster, tmp_path):
    make, keywords = CASES[case]
    on_a_cluster(*make(), 3, **TIMES | keywords, trajectory=tmp_path / "run.h5")
    with swarm.load(tmp_path / "run.h5") as trajectory:
        trajectory.require_intact()
        frame = trajectory.frame(1)
        path, _velocities = trajectory.particle(N - 1)
        assert path[:, 1].tolist() == frame.position[:, N - 1].tolist()
    shard = tmp_path / "run.shards" / "0002.h5"
    data = shard.read_bytes()
    place = data.index(frame.position[0, N - 1].tobytes())
    shard.write_bytes(data[: place + 6] + bytes([data[place + 6] ^ 16]) + data[place + 7 :])
    with swarm.load(tmp_path / "run.h5") as trajectory:
        assert (trajectory.frame(0).position != 0.0).any()
        for read in (lambda: trajectory.frame(1), lambda: trajectory.particle(N - 1), trajectory.require_intact):
            with pytest.raises(swarm.SceneError, match=r"all/position of frame 1 does not match its checksum"):
                read()


KILLED = """
import os, signal, sys
import numpy as np, swarm
from swarm.fleet import jobs, joined, sharded_run
from swarm.fleet.sharded_run import Sharded
from swarm.run.options import RunOptions
from swarm.run.preflight.admission import task_of

path, resume, dies = sys.argv[1], sys.argv[2] == "resume", int(sys.argv[3])
joined._AT_ONCE = 2
real = joined._joined
calls = []

def one(*about):
    calls.append(1)
    if len(calls) == dies:
        os.kill(os.getpid(), signal.SIGKILL)
    return real(*about)

joined._joined = one
scene = swarm.Scene([swarm.Sphere(0.5)])
start = swarm.fill(scene, 300, speed=1.0, seed=1)  # two chunks
options = RunOptions(
    until=1.0, every=0.1, compile="never", cluster="local:1", shards=2, checkpoint=60.0, trajectory=path, resume=resume
)
session, task = Sharded(options), task_of(scene, start, swarm.Impact(), options)
with session:
    session.prepare_shards(task)
    folder, bounds = session.begin(task, 2)
    for k in range(2):
        assert jobs.carried_out(sharded_run.run_shard, (folder, k)) == {"state": "done"}
    joined.join(folder, task, bounds, session.identity)
    session.finish()
"""


def test_a_kill_in_the_middle_of_a_join_leaves_no_half_of_a_trajectory(tmp_path):
    """The checkpoint that holds the shards stays, the run is resumed, and of what was begun nothing is left."""
    path = tmp_path / "run.h5"

    def session(*how):
        done = python("-c", KILLED, path, *how)
        return done.returncode, done.stderr

    assert session("begin", "7") == (-signal.SIGKILL, "")
    assert not path.exists()
    assert paths.checkpoint_of(path).exists()
    assert session("resume", "0") == (0, "")
    with swarm.load(path) as trajectory:
        assert len(trajectory) == 11
        alone = swarm.simulate(
            trajectory.scene, trajectory.frame(0), swarm.Impact(), until=1.0, every=0.1, compile="never"
        )
        assert the_same(trajectory.frame(-1).position, alone.particles.position)
        assert the_same(trajectory.observables["impacts"], alone.observables["impacts"])
    assert sorted(one.name for one in tmp_path.iterdir()) == ["run.h5", "run.shards"]
