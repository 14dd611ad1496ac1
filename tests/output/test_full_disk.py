"""On a full disk, for which a limit of the size of files stands in, every writer says so in one sentence: nothing is
left of what it began, the older file stays, and frames that were written can be read.
"""

import random

import pytest
from children import python
from scene_texts import in_a_sphere

import swarm

SCENE = in_a_sphere('until = 1.0\nevery = 0.05\ncompile = "never"', 60)
# The commands that write each kind of file, and those of a run whose files these are.
EXPORTS = {
    **dict.fromkeys(("csv", "xyz", "gsd", "ply", "obj", "vtkhdf"), "export run.h5"),
    "png": "plot run.h5", "html": "report run.h5", "gif": "animate run.h5 --frames 3",
    "mp4": "animate run.h5 --frames 3", "rrd": "record run.h5",
}  # fmt: skip
RUNS = {"h5": "", "h5i": "--impacts out.h5i"}
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
    yield stored
    tidied(stored)


def tidied(folder):
    """The size of the largest file besides those of the start, which are removed."""
    others = [one for one in folder.iterdir() if one.name not in ("scene.toml", "run.h5")]
    size = max((one.stat().st_size for one in others), default=0)
    for one in others:
        one.unlink()
    return size


@pytest.fixture(scope="module")
def size_of(stored):
    """A function that gives the size of the largest file of a command on a disk with room."""
    known = {}

    def measured(command):
        if command not in known:
            done = python("-m", "swarm", *command, cwd=stored)
            assert (done.returncode, done.stderr) == (0, "")
            known[command] = tidied(stored)
        return known[command]

    return measured


def require_one_sentence(done):
    assert done.returncode == 1, (done.returncode, done.stderr)
    assert done.stdout == ""
    assert done.stderr.startswith("error: cannot ")
    assert len(done.stderr.splitlines()) == 1
    assert "File too large" in done.stderr or "limit exceeded" in done.stderr
    assert "swarm-part" not in done.stderr


@pytest.mark.parametrize(("form", "part"), list(some(EXPORTS, 1, 8)))
def test_an_older_file_stays_and_nothing_else(folder, size_of, form, part):
    command = (*EXPORTS[form].split(), "-o", f"out.{form}")
    room = int(part * size_of(command))
    # An empty file is replaced by any kind.
    (folder / f"out.{form}").touch()
    before = {one.name: one.stat().st_size for one in folder.iterdir()}
    require_one_sentence(python("-m", "swarm", *command, "--overwrite", cwd=folder, file_size=room))
    assert {one.name: one.stat().st_size for one in folder.iterdir()} == before


@pytest.mark.parametrize(("form", "part"), list(some(RUNS, 2, 12)))
def test_frames_that_were_written_are_read(folder, size_of, form, part):
    command = ("run", "scene.toml", "-o", "out.h5", "--quiet", *RUNS[form].split())
    require_one_sentence(python("-m", "swarm", *command, cwd=folder, file_size=int(part * size_of(command))))
    left = {one.name for one in folder.iterdir()} - {"scene.toml", "run.h5"}
    assert left <= {"out.h5", "out.h5i"}
    if "out.h5" in left:
        with swarm.load(folder / "out.h5") as trajectory, swarm.load(folder / "run.h5") as whole:
            trajectory.require_intact()
            assert trajectory.times.tolist() == whole.times.tolist()[: len(trajectory)]
    if "out.h5i" in left:
        with swarm.load_impacts(folder / "out.h5i") as log:
            log.require_intact()
