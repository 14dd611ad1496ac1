"""What `swarm check` says: that of a run, nothing written, sizes as they are, counts as they are in closed form."""

import dataclasses
import math
import re

import h5py
import numpy as np
import pytest
from conftest import row
from test_cli import command
from test_scene_file import GOOD

import swarm
from swarm import scene_file
from swarm.authoring import outlook
from swarm.authoring.starters import KINDS, text_of
from swarm.files.writer import size_of
from swarm.kernel import cache
from swarm.run.options import RunOptions
from swarm.run.preflight.admission import task_of

GAS = text_of("gas").replace("count = 100", "count = 1000").replace("radius = 0.05", "radius = 0.01")


def looked(folder, text, **more):
    """The rows of a scene file."""
    path = folder / "scene.toml"
    path.write_text(text)
    job = scene_file.read(path)
    return outlook.outlook(dataclasses.replace(job, run=dataclasses.replace(job.run, **more)), folder / "scene.h5")


def task(folder, text):
    (folder / "scene.toml").write_text(text)
    job = scene_file.read(folder / "scene.toml")
    return task_of(job.scene, job.start(), job.method, job.run)


def test_a_body_has_all_its_parts(tmp_path):
    rows = looked(tmp_path, text_of("mechanism"))
    assert rows["body"] == "3 points, 1 link, 1 anchor, 2 guides, 1 cavity"


@pytest.mark.parametrize("kind", KINDS)
def test_scenes_to_begin_with(kind, tmp_path):
    rows = looked(tmp_path, text_of(kind))
    assert {"frames", "what runs", "method", "hints", "files", "memory", "time"} <= set(rows)
    assert rows["hints"] == "none"
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]


def test_a_sweep_takes_what_its_runs_take(tmp_path):
    """Three of 10 particles and three of 1000, as files of their own; of 30 runs every second one is looked at."""
    lists = '[sweep]\n"particles.count" = [{}]\n"particles.seed" = {{range = {}}}\n'
    rows = []
    for name, counts, seeds in (("few", "10, 1000", 3), ("many", "1000", 30)):
        (tmp_path / f"{name}.toml").write_text(GOOD + lists.format(counts, seeds))
        rows.append(outlook.outlook_of_file(tmp_path / f"{name}.toml")["all runs"])
    few, thousand = (looked(tmp_path, GOOD.replace("count = 10", f"count = {n}"))["files"] for n in (10, 1000))
    of = {"kB": 1e3, "MB": 1e6}
    sizes = [
        float(number) * of[unit] for number, unit in re.findall(r"([\d.]+) (kB|MB)", " ".join([*rows, few, thousand]))
    ]
    assert sizes[0] == pytest.approx(3.0 * (sizes[2] + sizes[3]), rel=0.01)
    assert sizes[1] == pytest.approx(30.0 * sizes[3], rel=0.01)


def test_what_begins_in_plain_python_is_what_the_run_begins_so(tmp_path, monkeypatch):
    """A run of more than 2000 particles compiles what is missing at once, however few impacts there are."""
    monkeypatch.setattr(cache, "is_compiled", lambda *call: False)
    few, more = (looked(tmp_path, GOOD.replace("count = 10", f"count = {n}"))["time"] for n in (2000, 2001))
    assert "in plain Python" in few
    assert "to compile 2 of 2 kernels" in more


def test_counters_are_among_what_the_run_has(tmp_path):
    rows = looked(tmp_path, GOOD + '[[counter]]\nsurface = { kind = "plane", normal = [1, 0, 0], offset = 0.1 }\n')
    assert rows["counter 0"] == "a plane of offset 0.1 m, normal along x"


def test_the_command(tmp_path):
    (tmp_path / "scene.toml").write_text(GOOD)
    done = command("check", "scene.toml", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    for words in ("10 particles of 1 kg", "a sphere of radius 0.5 m", "trajectory scene.h5", "hints", "none"):
        assert words in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]
    (tmp_path / "scene.toml").write_text(GOOD.replace("radius = 0.5", "radius = -0.5"))
    refused, as_run = (command(name, "scene.toml", cwd=tmp_path) for name in ("check", "run"))
    assert (refused.returncode, refused.stderr) == (as_run.returncode, as_run.stderr)
    assert "surface[0].radius must be above 0, got -0.5" in refused.stderr


def test_a_sweep_is_seen_by_its_first_run(tmp_path):
    """Nothing is written, and it is refused as a sweep is."""
    lists = '[sweep]\n"surface.0.radius" = [0.5, 0.7]\n"particles.seed" = {range = 3}\n'
    (tmp_path / "sweep.toml").write_text(GOOD + lists)
    rows = outlook.outlook_of_file(tmp_path / "sweep.toml", tmp_path / "folder")
    assert rows["runs"].startswith("6 over surface.0.radius and particles.seed, 1 kind of scene")
    assert '"surface.0.radius" = 0.5, "particles.seed" = 0' in rows["first run"]
    assert re.fullmatch(r"trajectory .*/folder/[0-9a-f]{12}\.h5, [\d.]+ kB", rows["files"])
    assert [path.name for path in tmp_path.iterdir()] == ["sweep.toml"]
    (tmp_path / "sweep.toml").write_text(GOOD + lists.replace("0.7", "-0.7"))
    refused = command("check", "sweep.toml", cwd=tmp_path)
    assert (refused.returncode, '"surface.0.radius" = -0.7' in refused.stderr) == (2, True)


def test_hints_are_those_of_the_run(tmp_path, caplog):
    text = GOOD.replace("speed = 0.5", "speed = 0.0")
    rows = looked(tmp_path, text)
    assert caplog.messages == []
    swarm.run(tmp_path / "scene.toml", compile="never")
    assert [f"· {message}" for message in caplog.messages] == rows["hints"].splitlines()
    assert "all 10 particles are at rest" in rows["hints"]


CELL = GOOD.replace("[particles]", "period = [2.0, 2.0, 2.0]\n[particles]").replace(
    "radius = 0.5", 'radius = 0.5\nside = "outside"\ncenter = [1, 1, 1]'
)


@pytest.mark.parametrize(
    "text",
    [
        GOOD,
        GOOD.replace("every = 0.5", 'every = 0.5\nprecision = "float32"'),
        GOOD.replace("every = 0.5", "every = 0.5\nframes = 4"),
        GOOD.replace("radius = 0.5", 'radius = 0.5\nlaws = [{kind = "absorb", probability = 0.0}]'),
        GOOD.replace("speed = 0.5", "speed = 0.5\nradius = 0.01"),
        CELL,
    ],
)
def test_the_particles_of_the_file_have_the_size(text, tmp_path):
    """To the byte; and the sentence about the file, before there is one and then."""
    (tmp_path / "scene.toml").write_text(text)
    job = scene_file.read(tmp_path / "scene.toml")
    size = size_of(job.scene, job.start(), job.run.storage, job.run.times.count)
    assert looked(tmp_path, text)["files"].endswith("kB")
    swarm.run(tmp_path / "scene.toml", tmp_path / "scene.h5", compile="never")
    with h5py.File(tmp_path / "scene.h5") as file:
        there = file["particles/all"]
        held = [there[f"{name}/value"] for name in there if name != "box" and f"{name}/value" in there]
        assert size == sum(one.id.get_storage_size() for one in [*held, there["mass"], there["id"]])
    expected = size + job.run.times.on_disk(len(job.scene.surfaces))
    assert abs((tmp_path / "scene.h5").stat().st_size / expected - 1.0) < 0.2
    assert "scene.h5 exists; choose another name, or overwrite it" in looked(tmp_path, text)["files"]


def test_counts_are_those_of_closed_forms(tmp_path):
    """The mean chord of a ball is 4 R/3; the collisions of a dilute gas by kinetic theory."""
    cavity = task(tmp_path, GOOD.replace("count = 10", "count = 400").replace("until = 1.0", "until = 50.0"))
    (load,) = outlook._loads(cavity)
    assert load.events == pytest.approx(400 * 50.0 / (4.0 / 3.0), rel=0.5)
    gas = task(tmp_path, GAS)
    (load,) = outlook._loads(gas)
    speed = float(np.sqrt((gas.particles.velocity**2).sum(axis=0)).mean())
    assert load.events == pytest.approx(0.5e6 * math.pi * 4e-4 * math.sqrt(2.0) * speed, rel=0.02)


def test_what_slides_moves_or_falls(tmp_path):
    """A load of each kind, and none that is not finite."""
    for old, new, nouns in (
        ("radius = 0.5", "radius = 0.5\nrestitution = 0.5", ["impacts"]),
        ("[particles]", "gravity = [0, 0, -9.81]\n[particles]", ["impacts"]),
        ("radius = 0.5", 'radius = 0.5\nmotion = {kind = "rotation", axis = [0, 0, 1], rate = 1.0}', ["impacts"]),
        ('kind = "impact"', 'kind = "penalty"\ndt = 0.01\npenalty = 1e4', ["steps of particles"]),
        ("speed = 0.5", "speed = 0.5\nradius = 0.01", ["impacts and collisions"]),
    ):
        with row(new):
            loads = outlook._loads(task(tmp_path, GOOD.replace(old, new)))
            assert [one.noun for one in loads] == nouns
            assert all(0.0 < one.events < math.inf for one in loads)
    falls = GOOD.replace("radius = 0.5", "radius = 0.5\nrestitution = 0.5")
    loads = outlook._loads(task(tmp_path, f"gravity = [0, 0, -9.81]\n{falls}"))
    assert [one.noun for one in loads] == ["impacts", "steps of sliding at most"]
    # What rests on a wall that swings goes with it for 1/20 of a radian at a time; hits are found by steps there.
    shaken = 'radius = 0.5\nmotion = {kind = "oscillation", amplitude = [0.01, 0, 0], frequency = 20.0}'
    swung = outlook._loads(task(tmp_path, f"gravity = [0, 0, -9.81]\n{falls.replace('radius = 0.5', shaken)}"))
    assert swung[1].events == pytest.approx(10 * 1.0 * 20.0 * 2.0 * math.pi * 20.0)
    assert swung[0].cost >= 10.0 * loads[0].cost


def test_steps_of_balls_take_longer_in_a_union():
    """Measured with 400 and 800 grains that have settled: 3 to 9 times as long with 2 to 4 rooms."""
    rooms = [swarm.Box((0.5, 0.5, 0.5), (0.0, 0.0, z)) for z in (0.0, 1.0)]
    costs = []
    for surfaces in ([rooms[0]], [swarm.Union(rooms)]):
        scene = swarm.Scene(surfaces)
        balls = swarm.fill(scene, 5, speed=1.0, radius=0.05)
        (load,) = outlook._loads(task_of(scene, balls, swarm.Penalty(dt=1e-4, penalty=1e3), RunOptions(until=1.0)))
        costs.append(load.cost)
    assert costs[1] == pytest.approx(3.0 * costs[0])


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.34, "0.3 s"), (9.7, "10 s"), (10.4, "10 s"), (119.0, "119 s"), (7100.0, "120 min"), (86400.0 * 123, "120 d")],
)
def test_times_are_in_plain_digits(seconds, words):
    assert outlook._about(seconds) == words
