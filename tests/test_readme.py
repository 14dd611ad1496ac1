"""The READMEs: the first Python is examples/quickstart.py; all Python, scene files and commands run; files exist."""

import csv
import itertools
import os
import re
import runpy
import shutil
import sys
import tomllib
from pathlib import Path

import pytest
from test_cli import command
from test_howto import SECTION

from swarm import scene_file
from swarm.run.options import RunOptions

ROOT = Path(__file__).parents[1]
PATHS = [ROOT / "README.md", ROOT / "examples" / "README.md", ROOT / "bench" / "README.md"]
README = PATHS[0].read_text()
# In the order in which they are read, and run.
WHOLE = "\n".join(path.read_text() for path in PATHS)
# What test_howto.py does not run.
ALL = WHOLE.replace(SECTION, "")


def test_it_is_a_page():
    assert len(README.splitlines()) <= 150


def test_first_screen_is_the_example():
    block = re.search(r"```python\n(.*?)```", README, re.DOTALL)
    assert block is not None
    example = (ROOT / "examples" / "quickstart.py").read_text().split('"""\n\n', 1)[1]
    assert block.group(1) == example


def test_files_that_are_named_exist():
    paths = set(re.findall(r"(?:examples|bench|tests|swarm)/[\w./-]+\.\w+", WHOLE))
    assert paths
    assert [path for path in sorted(paths) if not (ROOT / path).exists()] == []


@pytest.mark.parametrize("path", PATHS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_to_files(path):
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", path.read_text()) if "://" not in link]
    assert links
    assert [link for link in links if not (path.parent / link).exists()] == []


BENCH = PATHS[2].read_text()
# The sections of bench/README.md with a report, and those rows of it that have a name and two numbers.
REPORTS = {
    part.splitlines()[0]: re.findall(r"^ *(\S.*?) {2,}([\d.e+-]+) +[\d.e+-]+(?: |$)", "\n".join(blocks), re.MULTILINE)
    for part in re.split(r"^## ", BENCH, flags=re.MULTILINE)[1:]
    if (blocks := re.findall(r"```\n(.*?)```", part, re.DOTALL))
}
# What waits for a quiet machine: python -m bench fields -o bench/results
WAITING = [pytest.mark.xfail(strict=True, reason="its table is not committed yet")]


@pytest.mark.parametrize("name", [pytest.param(name, marks=WAITING * (name == "Fields")) for name in REPORTS])
def test_a_report_that_is_quoted_is_committed_and_names_its_commit(name):
    part = BENCH.split(f"## {name}\n")[1].split("\n## ")[0]
    assert re.search(r"\b[0-9a-f]{7}, 20\d\d-\d\d-\d\d", part)
    files = [path.read_text().splitlines() for path in (ROOT / "bench" / "results").glob("*.csv")]
    tables = [
        [(row["what"].strip(), float(row["min"])) for row in csv.DictReader(lines)]
        for lines in files
        if "what" in lines[0]
    ]
    first = [(what, pytest.approx(float(least), rel=1e-2)) for what, least in REPORTS[name][:5]]
    assert first
    assert any(all(row in table for row in first) for table in tables), first


def test_every_shipped_scene_is_named():
    assert [path.name for path in (ROOT / "examples" / "scenes").glob("*.toml") if path.name not in ALL] == []


def test_ci_runs_the_readme_test_command():
    """.ci/run calls what README tells a newcomer: all tests, those of its first command among them."""
    ci = (ROOT / ".ci" / "run").read_text()
    assert 'pip install -e ".[test]"' in README
    assert "python -m pytest -n auto --dist worksteal\n" in README
    assert 'pip install --quiet --disable-pip-version-check -e ".[test]"' in ci
    assert 'python -m pytest -n auto --dist worksteal -m "not long"` runs the slow ones too, and `-m long`' in README
    assert 'python -m pytest -q -n auto --dist worksteal -m "not long"\n' in ci


def copy_examples(folder, count):
    """The scenes and sweeps of the examples with few particles, two seeds and long steps: how they run is tested."""
    for name in ("scenes", "sweeps"):
        shutil.copytree(ROOT / "examples" / name, folder / "examples" / name)
        for path in (folder / "examples" / name).glob("*.toml"):
            text = re.sub(r"^count = [\d_]+", f"count = {count}", path.read_text(), flags=re.MULTILINE)
            text = re.sub(r"^dt = (\S+)", lambda found: f"dt = {10.0 * float(found[1])}", text, flags=re.MULTILINE)
            text = text.replace('kind = "impact"', 'kind = "impact"\nsliding_tolerance = 1e-4')
            path.write_text(re.sub(r"range = \d+", "range = 2", text))


@pytest.mark.physics
def test_the_python_runs_from_top_to_bottom(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    copy_examples(tmp_path, 2)
    Path("cavity.h5").touch()  # what the command above the first block has written
    names = {}
    for block in re.findall(r"```python\n(.*?)```", ALL, re.DOTALL):
        exec(block, names)
    result, settling = names["result"], names["settling"]
    assert result.particles.position.shape == (3, 10_000)
    assert result.observables["energy_error"].max() <= 1e-14
    seen = settling.observables
    assert seen["energy_error"].max() <= 1e-14
    assert seen["max_penetration"].max() <= 1e-14
    assert seen["dissipated_energy"][-1] > 0.0
    assert names["history"].converged
    assert len(names["history"]) == 13
    universe = names["universe"]
    assert universe.trajectory.n_frames == 101
    assert universe.trajectory[-1].positions[7] == pytest.approx(result.particles.position[:, 7], rel=1e-6)
    output = capsys.readouterr().out
    assert "impacts" in output
    assert "True" in output


# What the words of a command stand for.
NAMES = {
    "SCENE.toml": "scene.toml", "SWEEP.toml": "sweep.toml", "RUN.h5": "scene.h5", "OUT.h5": "out.h5",
    "OUT.rrd": "out.rrd", "N": "2", "local:2": "local:1",
}  # fmt: skip
SCENE = re.search(r"```toml\n(.*?)```", README, re.DOTALL)[1]


def commands():
    """Every command of swarm in the READMEs, without its options in brackets and, where it has some, with them all.

    What only reads files is run once.
    """
    spans = re.findall(r"`(swarm [a-z]+ [^`\n]*\.[^`\n]*)`", ALL) + re.findall(
        r"^(?:pip install \. && )?(swarm [a-z]+ \S+\.\S+.*)$", ALL, re.MULTILINE
    )
    seen = set()
    for span in spans:
        for words in dict.fromkeys((re.sub(r" *\[.*?\]", "", span), re.sub(r"[\[\]]", "", span))):
            if words in seen and words.split()[1] not in ("run", "sweep"):
                continue
            seen.add(words)
            yield [NAMES.get(word, word) for word in words.split()[1:]]


def settings():
    """Every `key = value` of [run] in the READMEs."""
    return [line for line in re.findall(r"`([a-z_]+ = [^`]*)`", ALL) if line.split()[0] in RunOptions.__annotations__]


@pytest.mark.physics
def test_the_commands_run_in_their_order(tmp_path, monkeypatch):
    # Each process of a sweep takes two seconds to begin.
    monkeypatch.setattr(os, "sched_getaffinity", lambda _process: {0})
    copy_examples(tmp_path, 1)
    (tmp_path / "scene.toml").write_text(SCENE)
    (tmp_path / "sweep.toml").write_text(f'{SCENE}\n[sweep]\n"particles.seed" = [1, 2]\n')
    found = list(commands())
    assert {words[0] for words in found} == {
        "run",
        "record",
        "view",
        "plot",
        "animate",
        "export",
        "info",
        "report",
        "sweep",
    }
    assert len(found) >= 12
    for words in found:
        outputs = [after for word, after in itertools.pairwise(words) if word in ("-o", "--record")]
        if words[0] == "run" and "--resume" not in words and "-o" not in words:
            outputs.append(Path(words[1]).stem + ".h5")
        for output in outputs:
            if (tmp_path / output).is_dir():
                shutil.rmtree(tmp_path / output)
            (tmp_path / output).unlink(missing_ok=True)
        done = command(*words, cwd=tmp_path)
        assert done.returncode == 0, (words, done.stderr)
        for output in outputs:
            # Of a sequence the files have numbers.
            files = list(tmp_path.glob(output)) or list(tmp_path.glob(f"{Path(output).stem}_*{Path(output).suffix}"))
            assert files, (words, output)
            assert all(file.stat().st_size for file in files)


@pytest.mark.physics
@pytest.mark.parametrize("number", range(len(re.findall(r"```toml\n", ALL))))
def test_the_scene_files_run(tmp_path, number):
    text = re.findall(r"```toml\n(.*?)```", ALL, re.DOTALL)[number]
    (tmp_path / "scene.toml").write_text(text)
    # One body takes a second in plain Python, and the compiler five.
    done = command("run", "scene.toml", *(["--compile", "never"] if "[body]" in text else []), cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "✓ " in done.stdout


@pytest.mark.parametrize("line", settings())
def test_the_settings_of_a_run_are_taken(tmp_path, line):
    (tmp_path / "scene.toml").write_text(SCENE.replace("[run]\n", f"[run]\n{line}\n"))
    key, value = tomllib.loads(line).popitem()
    taken = getattr(scene_file.read(tmp_path / "scene.toml").run, key)
    assert taken == (tmp_path / value if key in ("trajectory", "recording") else value)


def test_the_settings_are_found():
    assert {line.split()[0] for line in settings()} >= {"frames", "precision", "compression", "checkpoint", "recording"}


@pytest.mark.parametrize("module", sorted({*re.findall(r"python -m ((?:bench|examples)[\w. ]*\w)", ALL)}))
def test_the_modules_that_take_minutes_can_be_called(module, monkeypatch, capsys):
    name, *words = module.split()
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(sys, "argv", [name, *words, "--help"])
    monkeypatch.delitem(sys.modules, name, raising=False)
    with pytest.raises(SystemExit) as end:
        runpy.run_module(name, run_name="__main__")
    assert end.value.code in (0, None)
    assert "usage" in capsys.readouterr().out
