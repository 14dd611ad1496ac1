"""The answers of examples/guide/how: the code of each runs in an empty folder, and its figures are as the text says."""

import os
import re
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scene_texts import in_a_sphere
from test_cli import command

ROOT = Path(__file__).parents[1]
GUIDE = ROOT / "examples" / "guide"
CONTENTS = re.search(r"^## How do I \.\.\.\n.*", (GUIDE / "README.md").read_text(), re.DOTALL | re.MULTILINE)[0]
PAGES = {path: re.split(r"^## ", path.read_text(), flags=re.MULTILINE) for path in sorted(GUIDE.glob("how/*.md"))}
ANSWERS = [(path, *answer.split("\n", 1)) for path, (_, *answers) in PAGES.items() for answer in answers]
TEXTS = {title: text for _path, title, text in ANSWERS}
CHAIN = "A chain of jobs on a cluster"
SCENE = in_a_sphere('until = 20.0\nevery = 0.2\ncompile = "never"\nframes = "none"', 100)


def close(value, expected, part):
    return abs(value - expected) <= part * abs(expected)


# What the text says of an answer's numbers.
FACTS = {
    "An L-shaped room": lambda a: close(a["gas"].volume, 7.5, 0.01) and a["plan"].surfaces[0].area() == 3.0,
    "A stadium, or another outline with arcs": lambda a: (
        close(a["same"].area(), a["stadium"].area(), 1e-12) and close(a["notched"].area(), 4.0, 1e-12)
    ),
    # It empties at a steady rate, as sand does, not with the height that is left.
    "A hopper that empties": lambda a: (
        a["left"][-1] == 400 and close(a["left"][8] - a["left"][5], a["left"][10] - a["left"][7], 0.2)
    ),
    "A tube between two chambers": lambda a: (
        a["result"].observables["escaped"][-1] == 0 and (abs(a["x"]) < 0.5).sum() < (a["x"] > 0.5).sum()
    ),
    "A surface of my own": lambda a: a["result"].observables["max_penetration"].max() == 0.0,
    "A vessel from an STL or CAD file, in mm": lambda a: close(a["gas"].volume, np.pi * 0.04**2 * 0.12, 0.02),
    "Warm, rough and sticky walls": lambda a: (
        close(-a["heat"][0], a["heat"][1], 0.1) and a["heat"][0] < 0.0 and a["heat"][2] == 0.0
    ),
    "A door that opens and shuts": lambda a: (
        (a["seen"]["passed"][[0, 1]] == 0).all() and a["seen"]["passed"][2] > 0 and len({*a["seen"]["passed"][3:]}) == 1
    ),
    "A drum that turns, a floor that shakes": lambda a: a["seen"]["wall_work"][-1, 0] > 0.0,
    "A lid that lies on grains": lambda a: (
        close(a["force"][1], 0.2 * 9.81, 1e-4) and a["seen"]["wall_position"][-1, 1, 2] < -0.03
    ),
    "A second run from the pose that a wall has": lambda a: (
        a["settled"].observables["sliding"][-1] == 100 and a["settled"].observables["max_penetration"].max() < 1e-15
    ),
    "A wall law of my own": lambda a: a["result"].observables["energy_error"].max() < 1e-12,
    "A gas that comes in, and leaves": lambda a: (
        close((a["seen"]["born"][:, 0] - a["seen"]["escaped"])[5:].mean(), 230, 0.15)
    ),
    "A gas at 300 K, and its pressure": lambda a: close(a["pressure"], 4.14e-4, 0.02),
    "Balls at a given packing, and their pressure": lambda a: close(a["ratio"], 4.0, 0.1),
    "Grains that rest on one another, or hard balls": lambda a: (
        a["energy"][-1] < 0.03 * a["energy"].max() and a["result"].particles.position[2].min() > -0.05
    ),
    "Start from given places, a file, or the end of another run": lambda a: (
        a["again"].position == a["first"].particles.position
    ).all(),
    "The force on a wall over time, as CSV": lambda a: (
        close(a["force"].mean(), 1000, 0.08) and np.loadtxt("force.csv", delimiter=",", skiprows=1).shape == (20, 2)
    ),
    "The pressure at each place of a wall": lambda a: (np.diff(a["pressure"].mean(axis=0)) < 0.0).all(),
    "What passes a plane or a hole": lambda a: close(a["out"] / (np.pi * 0.09), 1000 * np.sqrt(8 / np.pi) / 4, 0.2),
    "Losses at walls as weights": lambda a: 0.9 < a["weight"].mean() < 0.97 and (a["weight"] <= 1.0).all(),
    "The Lyapunov exponent of a planar billiard": lambda a: close(a["exponent"], 0.427, 0.1),
    "The Birkhoff coordinates of a planar billiard": lambda a: (
        close(a["steps"].sum(), 9.688448, 1e-6) and 0.9 < np.abs(a["along"]).max() <= 1.0 + 1e-12
    ),
    "An observable of my own": lambda a: a["result"].observables["layers"].sum(axis=1).tolist() == [300.0] * 5,
    "Which method": lambda a: a["errors"]["Impact"] < 1e-15 < 1e-4 < a["errors"]["Verlet"],
    "Is my result converged": lambda a: close(a["by_wall"][0] / a["by_wall"][2], 10.0, 0.2),
    "Where the time goes": lambda a: 0.0 < a["seen"]["sliding_time"][-1] < 50.0,
    "Why it compiles, and how not to wait": lambda a: (
        a["never"].particles.position == a["always"].particles.position
    ).all(),
    "A thousand runs": lambda a: len(a["table"]) == 6 and (a["table"]["state"] == "done").all(),
    "Only some particles in the file": lambda a: a["result"].observables["chosen"].shape == (11, 3, 2),
    "Only some frames": lambda a: sorted(path.name for path in Path().glob("*.npz")) == [
        "0000.npz", "0050.npz", "0100.npz"
    ],
    "Trajectories in float32": lambda a: os.path.getsize("float32.h5") < 0.7 * os.path.getsize("float64.h5"),
    "A film, a picture, ParaView and Blender": lambda a: Path("run.mp4").stat().st_size > 10_000,
}  # fmt: skip


# Those whose runs plain Python would not end before it is out of patience.
LONG = (
    "A lid that lies on grains",
    "Grains that rest on one another, or hard balls",
    "The force on a wall over time, as CSV",
    "The pressure at each place of a wall",
    "Warm, rough and sticky walls",
)


def slug(title):
    """The name that GitHub gives a heading's anchor."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def test_the_contents_lead_to_every_answer():
    links = re.findall(r"\]\(how/([^)]+)\)", CONTENTS)
    assert sorted(links) == sorted(f"{path.name}#{slug(title)}" for path, title, _text in ANSWERS)
    assert len(TEXTS) >= 25
    assert {*FACTS, CHAIN} == {*TEXTS}


@pytest.mark.parametrize("title", TEXTS)
def test_an_answer_begins_with_the_answer(title):
    """Two or three sentences before the first code."""
    first = TEXTS[title].split("```")[0].strip()
    assert first
    assert len(re.sub(r"`[^`]*`|\([^)]*\)", "", first)) < 500


@pytest.mark.physics
@pytest.mark.parametrize("title", FACTS, ids=slug)
def test_an_answer_runs(title, tmp_path, monkeypatch, request):
    monkeypatch.chdir(tmp_path)
    if title in LONG:
        request.getfixturevalue("compiled_at_once")
    names = {}
    for language, block in re.findall(r"```(\w+)\n(.*?)```", TEXTS[title], re.DOTALL):
        if language == "toml":
            Path(re.match(r"# (\S+\.toml)", block)[1]).write_text(block)
        elif language == "sh":
            for line in block.splitlines():
                done = command(*line.split("  #")[0].split()[1:], cwd=tmp_path)
                assert (line.split()[0], done.returncode) == ("swarm", 0), done.stderr
        else:
            exec(compile(block, title, "exec"), names)
    assert FACTS[title](names)


@pytest.mark.physics
def test_jobs_submit_themselves_until_the_run_is_complete(tmp_path):
    script = re.search(r"```sh\n(.*?)```", TEXTS[CHAIN], re.DOTALL)[1]
    bash = shutil.which("bash")
    (tmp_path / "scene.toml").write_text(SCENE)
    for name, does in (("swarm", f'exec "{sys.executable}" -m swarm "$@"'), ("sbatch", 'echo "$@" >> submitted')):
        (tmp_path / name).write_text(f"#!{bash}\n{does}\n")
        (tmp_path / name).chmod(stat.S_IRWXU)
    environment = {**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}

    def job(text):
        (tmp_path / "job.sh").write_text(text)
        subprocess.run([bash, "-n", "job.sh"], cwd=tmp_path, check=True)
        subprocess.run([bash, "job.sh"], cwd=tmp_path, env=environment, check=False)
        return (tmp_path / "submitted").read_text() if (tmp_path / "submitted").exists() else ""

    assert "3h50m" in script
    assert job(script.replace("3h50m", "0.1s")) == "job.sh\n"
    assert (tmp_path / "run.h5.checkpoint").exists()
    assert job(script) == "job.sh\n"
    assert not (tmp_path / "run.h5.checkpoint").exists()
