"""On a full disk, for which a limit of the size of files stands in, every writer says so in one sentence: nothing is
left of what it began, the older file stays, and frames that were written can be read.
"""

import random

import pytest
from children import python

import swarm

SCENE = """
[particles]
count = 60
speed = 1.0
[[surface]]
kind = "sphere"
radius = 0.5
[method]
kind = "impact"
[run]
until = 1.0
every = 0.05
compile = "never"
"""
# The size of each file, and the command that writes it.
EXPORTS = {
    "csv": (350_000, "export run.h5"), "xyz": (320_000, "export run.h5"), "gsd": (130_000, "export run.h5"),
    "ply": (2_500, "export run.h5"), "obj": (560_000, "export run.h5"), "vtkhdf": (180_000, "export run.h5"),
    "png": (60_000, "plot run.h5"), "html": (300_000, "report run.h5"), "gif": (100_000, "animate run.h5 --frames 3"),
    "mp4": (30_000, "animate run.h5 --frames 3"), "rrd": (120_000, "record run.h5"),
}  # fmt: skip
RUNS = {"h5": (250_000, ""), "h5i": (150_000, "--impacts out.h5i")}
SLOW = ("gif", "mp4", "html", "rrd", "png")


def positions(name, count):
    """Random parts of the size, the first ones near the beginning."""
    chosen = random.Random(name)
    return [(name, chosen.uniform(0.0, 0.1 if k == 0 else 0.95)) for k in range(count)]


def some(names, few, many):
    """A few positions of each, and many in the long ring."""
    for name in names:
        for k, (_name, part) in enumerate(positions(name, many)):
            is_short = k < few and name not in SLOW
            yield pytest.param(name, part, marks=() if is_short else pytest.mark.long, id=f"{name} {part:.3f}")


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    (folder / "scene.toml").write_text(SCENE)
    done = python("-m", "swarm", "run", "scene.toml", "-o", "run.h5", "--quiet", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    return folder


@pytest.fixture
def folder(stored):
    before = {one.name for one in stored.iterdir()}
    yield stored
    for one in stored.iterdir():
        if one.name not in before:
            one.unlink()


def require_one_sentence(done):
    assert done.returncode == 1, (done.returncode, done.stderr)
    assert done.stdout == ""
    assert done.stderr.startswith("error: cannot ")
    assert len(done.stderr.splitlines()) == 1
    assert "File too large" in done.stderr or "limit exceeded" in done.stderr
    assert "swarm-part" not in done.stderr


@pytest.mark.parametrize(("form", "part"), list(some(EXPORTS, 1, 8)))
def test_an_older_file_stays_and_nothing_else(folder, form, part):
    size, words = EXPORTS[form]
    target, command = folder / f"out.{form}", [*words.split(), "-o", f"out.{form}", "--overwrite"]
    # An empty file is replaced by any kind.
    target.touch()
    before = {one.name: one.stat().st_size for one in folder.iterdir()}
    require_one_sentence(python("-m", "swarm", *command, cwd=folder, file_size=int(part * size)))
    assert {one.name: one.stat().st_size for one in folder.iterdir()} == before


@pytest.mark.parametrize(("form", "part"), list(some(RUNS, 2, 12)))
def test_frames_that_were_written_are_read(folder, form, part):
    size, words = RUNS[form]
    command = ["run", "scene.toml", "-o", "out.h5", "--quiet", *words.split()]
    require_one_sentence(python("-m", "swarm", *command, cwd=folder, file_size=int(part * size)))
    left = {one.name for one in folder.iterdir()} - {"scene.toml", "run.h5"}
    assert left <= {"out.h5", "out.h5i"}
    if "out.h5" in left:
        with swarm.load(folder / "out.h5") as trajectory, swarm.load(folder / "run.h5") as whole:
            trajectory.require_intact()
            assert trajectory.times.tolist() == whole.times.tolist()[: len(trajectory)]
    if "out.h5i" in left:
        with swarm.load_impacts(folder / "out.h5i") as log:
            log.require_intact()
