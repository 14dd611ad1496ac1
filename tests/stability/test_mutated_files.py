"""Scene files and trajectories with random changes: no traceback, nothing lost, nothing overwritten unasked."""

import contextlib
import os
import random
import re
import shutil

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

import swarm
from swarm.commands import summary
from swarm.commands.cli import app

SCENE = """
gravity = [0.0, 0.0, -9.81]
[particles]
count = 3
speed = 1.0
mass = 1.0
seed = 1
[[surface]]
kind = "sphere"
radius = 0.5
[[surface]]
kind = "sphere"
radius = 0.1
side = "outside"
[method]
kind = "impact"
[run]
until = 0.2
every = 0.1
compile = "never"
threads = 1
"""
VALUES = [
    "nan", "-1", "0", "1e300", '""', '"x"', "[]", "{}", "true", "[1, 2]", '"thesis.txt"', '"../thesis.txt"',
    '"/dev/null"',
    '"scene.toml"', '"outside"', "9" * 400, "1979-05-27", '{from = "thesis.txt"}', f'"{"a" * 3000}"',
]  # fmt: skip
KEYS = ["impacts", "trajectory", "recording", "from", "file", "overwrite", "frames", "plane", "restitution", "radius"]
HDF5_VALUES = ["x", "", 5, -1, np.nan, [1.0, 2.0], np.zeros((2, 2)), "a\nb", "9" * 3000]
# So many are changed by default, and in the long tests.
FEW, MANY = 12, 200


def mutated(text, chosen):
    """A scene file with one to three lines changed."""
    lines = text.splitlines()
    for _ in range(chosen.randint(1, 3)):
        k = chosen.randrange(1, len(lines))
        kind = chosen.randrange(6)
        if kind == 0:
            lines[k] = re.sub(r"=.*", f"= {chosen.choice(VALUES)}", lines[k])
        elif kind == 1:
            lines.insert(k, f"{chosen.choice(KEYS)} = {chosen.choice(VALUES)}")
        elif kind == 2:
            del lines[k]
        elif kind == 3:
            lines.insert(k, chosen.choice(lines))
        elif kind == 4:
            lines[k] = lines[k][: chosen.randrange(len(lines[k]) + 1)]
        else:
            lines.append(f"{chosen.choice(('impacts', 'trajectory', 'recording'))} = {chosen.choice(VALUES)}")
    # Whatever else it says, the run is short.
    return "\n".join(line for line in lines if not line.startswith(("count = 9", "until = 9", "until = 1e")))


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def require_harmless(tmp_path, seed):
    text = mutated(SCENE, random.Random(seed))
    folder = tmp_path / "scenes"
    folder.mkdir()
    (folder / "scene.toml").write_text(text)
    (tmp_path / "thesis.txt").write_text("my thesis")
    (folder / "thesis.txt").write_text("another thesis")
    before = contents(tmp_path)
    words = ["run", folder / "scene.toml", "-o", tmp_path / "out.h5", "--overwrite", "--quiet"]
    done = CliRunner().invoke(app, list(map(str, words)))
    repeats = f"seed {seed}:\n{text}"
    assert done.exception is None or isinstance(done.exception, (swarm.SwarmError, SystemExit)), (
        repeats,
        done.exception,
    )
    after = contents(tmp_path)
    assert {path: after.get(path) for path in before} == before, repeats
    new = {path.parent for path in after.keys() - before.keys()}
    assert new <= {tmp_path, folder}, repeats
    shutil.rmtree(folder)
    (tmp_path / "out.h5").unlink(missing_ok=True)


@pytest.mark.parametrize("seed", range(FEW))
def test_a_changed_scene_file_is_harmless(tmp_path, seed):
    require_harmless(tmp_path, seed)


@pytest.mark.long
def test_many_changed_scene_files_are_harmless(tmp_path):
    for seed in range(FEW, MANY):
        require_harmless(tmp_path, seed)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "run.h5"
    scene = swarm.Scene([swarm.Sphere(0.5)])
    start = swarm.fill(scene, 3, speed=1.0, seed=1)
    swarm.simulate(
        scene, start, swarm.Impact(), until=1.0, every=0.5, trajectory=path, impacts=path.with_name("log.h5"),
        compile="never", threads=1,
    )  # fmt: skip
    return path


def change(path, chosen):
    """Damage bytes, or change an attribute, a dataset or a link."""
    kind = chosen.randrange(5)
    if kind < 2:
        data = bytearray(path.read_bytes())
        for _ in range(chosen.randint(1, 4)):
            data[chosen.randrange(min(len(data), 12_000))] ^= chosen.choice((1, 32, 255))
        path.write_bytes(data[: len(data) if kind else chosen.randrange(1, len(data))])
        return
    with h5py.File(path, "r+") as file:
        names = []
        file.visit(names.append)
        name = chosen.choice(sorted(names))
        if kind == 2:
            group = file["h5md/creator"] if chosen.random() < 0.7 else file[name]
            attribute = chosen.choice([*group.attrs, "more"])
            group.attrs[attribute] = chosen.choice(HDF5_VALUES)
        else:
            del file[name]
            if kind == 3:
                file[name] = chosen.choice(HDF5_VALUES)
            else:
                file[name] = h5py.ExternalLink("other.h5", name)


def require_reported(whole, folder, seed):
    path = shutil.copy(whole, folder / "run.h5")
    shutil.copy(whole, folder / "other.h5")
    change(path, random.Random(seed))
    before = contents(folder)
    for words in (["info", path], ["export", path, "-o", folder / "out.csv"]):
        done = CliRunner().invoke(app, list(map(str, words)))
        known = isinstance(done.exception, (swarm.SwarmError, SystemExit)) or done.exception is None
        assert known, (f"seed {seed}", words[0], repr(done.exception))
    (folder / "out.csv").unlink(missing_ok=True)
    assert contents(folder) == before, f"seed {seed}"


@pytest.mark.parametrize("seed", range(FEW))
def test_a_changed_trajectory_is_reported(whole, tmp_path, seed):
    require_reported(whole, tmp_path, seed)


@pytest.mark.long
def test_many_changed_trajectories_are_reported(whole, tmp_path):
    for seed in range(FEW, MANY):
        require_reported(whole, tmp_path, seed)
    assert sorted(os.listdir(tmp_path)) == ["other.h5", "run.h5"]


def names_in(path):
    """What a file holds."""
    names = []
    with h5py.File(path) as file:
        file.visit(names.append)
    return names


def require_known(path, name, value):
    """A file with something else under a name is read, or is damaged; None is a group."""
    with h5py.File(path, "r+") as file:
        del file[name]
        if value is None:
            file.create_group(name)
        else:
            file[name] = value
    with contextlib.suppress(swarm.SwarmError):
        summary.of_file(path)


@pytest.mark.parametrize("value", [None, 5, [1.0, 2.0]], ids=["group", "number", "list"])
@pytest.mark.parametrize("kind", ["run.h5", "log.h5"])
def test_another_thing_under_a_name_of_a_file_is_reported(whole, tmp_path, kind, value):
    """Of the parameters, among them the checksums; what follows needs no other error than a sentence."""
    names = [name for name in names_in(whole.with_name(kind)) if name.startswith("parameters/")]
    for name in names:
        require_known(shutil.copy(whole.with_name(kind), tmp_path / kind), name, value)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["run.h5", "log.h5"])
def test_anything_under_any_name_of_a_file_is_reported(whole, tmp_path, kind):
    for name in names_in(whole.with_name(kind)):
        for value in (None, *HDF5_VALUES):
            require_known(shutil.copy(whole.with_name(kind), tmp_path / kind), name, value)
