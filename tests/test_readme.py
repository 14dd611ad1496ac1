"""README, the gallery, the guide: the first Python is examples/quickstart.py; all Python, files and commands run."""

import csv
import itertools
import os
import re
import runpy
import shutil
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from test_cli import command

import swarm
from swarm import scene_file
from swarm.commands.cli import app
from swarm.methods import ALL_METHODS
from swarm.run.options import RunOptions
from swarm.surfaces import ALL_SURFACES

ROOT = Path(__file__).parents[1]
GUIDE = ROOT / "examples" / "guide"
# In the order in which commands run. test_howto.py runs the answers of GUIDE/how.
FIRST = [ROOT / "README.md", GUIDE / "scene_files.md", ROOT / "examples" / "README.md"]
PAGES = FIRST + sorted({*GUIDE.glob("*.md")} - {*FIRST})
ANSWERS = sorted(GUIDE.glob("*/*.md"))
BENCH = ROOT / "bench" / "README.md"
PATHS = [*PAGES, *ANSWERS, BENCH]
README = PAGES[0].read_text()
ALL = "\n".join(path.read_text() for path in (*PAGES, BENCH))
WHOLE = "\n".join(path.read_text() for path in PATHS)
# Pages without Python: a gallery, a list of pages, and what is for those that change the code.
WITHOUT_PYTHON = {ROOT / "examples" / "README.md", GUIDE / "README.md", GUIDE / "architecture.md"}


def named(path):
    return str(path.relative_to(ROOT))


def test_readme_is_read_in_two_minutes():
    assert len(README.split()) <= 700
    assert max(map(len, README.splitlines())) <= 100


@pytest.mark.parametrize("path", [*PAGES, *ANSWERS], ids=named)
def test_a_page_is_short(path):
    assert len(path.read_text().splitlines()) <= 250


def test_every_page_is_in_the_list_of_pages():
    links = {(GUIDE / link).resolve() for link in re.findall(r"\]\(([^)#]+)", (GUIDE / "README.md").read_text())}
    assert {*GUIDE.rglob("*.md")} - links == {GUIDE / "README.md"}


def test_terms_of_the_paper_wait_for_its_page():
    assert [named(path) for path in (*PAGES, *ANSWERS) if "State I" in path.read_text()] == [named(GUIDE / "paper.md")]


def test_first_screen_is_the_example():
    block = re.search(r"```python\n(.*?)```", README, re.DOTALL)
    assert block is not None
    example = (ROOT / "examples" / "quickstart.py").read_text().split('"""\n\n', 1)[1]
    assert block.group(1) == example


def test_files_that_are_named_exist():
    paths = set(re.findall(r"(?:examples|bench|tests|swarm)/[\w./-]+\.\w+", WHOLE))
    assert paths
    assert [path for path in sorted(paths) if not (ROOT / path).exists()] == []


def slug(title):
    """The name that GitHub gives a heading's anchor."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


@pytest.mark.parametrize("path", PATHS, ids=named)
def test_links_lead_to_files_and_to_sections(path):
    text = path.read_text()
    links = [link for link in re.findall(r"\]\(([^)]+)\)", text) if "://" not in link]
    for link in links:
        file, _, anchor = link.partition("#")
        target = path.parent / file if file else path
        assert target.exists(), link
        if anchor:
            assert anchor in {slug(title) for title in re.findall(r"^#+ (.*)$", target.read_text(), re.MULTILINE)}, link


REPORTED = BENCH.read_text()
# The sections of bench/README.md with a report, and those rows of it that have a name and two numbers.
REPORTS = {
    part.splitlines()[0]: re.findall(r"^ *(\S.*?) {2,}([\d.e+-]+) +[\d.e+-]+(?: |$)", "\n".join(blocks), re.MULTILINE)
    for part in re.split(r"^## ", REPORTED, flags=re.MULTILINE)[1:]
    if (blocks := re.findall(r"```\n(.*?)```", part, re.DOTALL))
}


@pytest.mark.parametrize("name", REPORTS)
def test_a_report_that_is_quoted_is_committed_and_names_its_commit(name):
    part = REPORTED.split(f"## {name}\n")[1].split("\n## ")[0]
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


@pytest.mark.parametrize("path", PATHS, ids=named)
def test_rows_of_a_table_have_as_many_cells_as_its_head(path):
    text = re.sub(r"```.*?```", "", path.read_text(), flags=re.DOTALL)
    for table in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        cells = [len(re.findall(r"(?<!\\)\|", line)) for line in table.splitlines()]
        assert len({*cells}) == 1, table.splitlines()[0]


@pytest.mark.parametrize("path", PATHS, ids=named)
def test_names_and_options_in_a_page_exist(path):
    """`swarm.NAME` is a public name, and the options in a line with a command are options of it."""
    text = path.read_text().replace("swarm.schema.json", "")
    assert [name for name in re.findall(r"\bswarm\.([A-Za-z_]\w*)", text) if not hasattr(swarm, name)] == []
    known = app.commands
    for name, rest in re.findall(r"\bswarm ([a-z]+) ([^`\n]*\.[^`\n]*)", text):
        parameters = known[name].params if name in known else []
        options = {option for one in parameters for option in (*one.opts, *one.secondary_opts)}
        assert set(re.findall(r"(?<!\S)\[?(--?[a-z][a-z-]*)", rest)) <= options | {"--help"}, rest


def test_every_kind_of_surface_and_of_method_is_named():
    assert f"{len(ALL_SURFACES)} kinds of surfaces" in README
    scenes, methods = ((GUIDE / name).read_text() for name in ("scenes.md", "methods.md"))
    assert [kind.__name__ for kind in ALL_SURFACES.values() if f"`{kind.__name__}" not in scenes] == []
    assert [kind.__name__ for kind in ALL_METHODS.values() if f"`{kind.__name__}" not in methods] == []


def test_every_shipped_scene_is_named():
    assert [path.name for path in (ROOT / "examples" / "scenes").glob("*.toml") if path.name not in ALL] == []


def test_ci_runs_the_readme_test_command():
    """.ci/run calls README's first command, and with `all` the second one."""
    ci = (ROOT / ".ci" / "run").read_text()
    assert 'pip install -e ".[test]"' in README
    assert "python -m pytest -n auto --dist worksteal\n" in README
    assert 'pip install --quiet --disable-pip-version-check -e ".[test]"' in ci
    sentence = 'python -m pytest -n auto --dist worksteal -m "not long"` runs the slow ones too, and `-m long`'
    assert sentence in " ".join(README.split())
    assert 'python -m pytest -q -n auto --dist worksteal "${slow[@]}"\n' in ci
    assert '[ "${1:-}" != all ] || slow=(-m "not long")\n' in ci


def copy_examples(folder, count):
    """The scenes and sweeps of the examples with few particles and births, two seeds and long steps.

    How they run is tested.
    """
    for name in ("scenes", "sweeps"):
        shutil.copytree(ROOT / "examples" / name, folder / "examples" / name)
        for path in (folder / "examples" / name).glob("*.toml"):
            text = re.sub(r"^count = [\d_]+", f"count = {count}", path.read_text(), flags=re.MULTILINE)
            text = re.sub(r"^rate = \S+", "rate = 20.0", text, flags=re.MULTILINE)
            text = re.sub(r"^dt = (\S+)", lambda found: f"dt = {10.0 * float(found[1])}", text, flags=re.MULTILINE)
            text = text.replace('kind = "impact"', 'kind = "impact"\nsliding_tolerance = 1e-4')
            path.write_text(re.sub(r"range = \d+", "range = 2", text))


def worst(result, name):
    return result.observables[name].max()


def has_frames_of(universe, result):
    frames = universe.trajectory
    return frames.n_frames == 101 and frames[-1].positions[7] == pytest.approx(
        result.particles.position[:, 7], rel=1e-6
    )


# What the code of a page has found.
FACTS = {
    "README.md": lambda a: (
        a["result"].particles.position.shape == (3, 10_000) and worst(a["result"], "energy_error") <= 1e-14
    ),
    "examples/guide/balls.md": lambda a: a["gas"].observables["collisions"][-1] > 0,
    "examples/guide/billiards.md": lambda a: a["start"].volume == pytest.approx(np.pi + 4.0, rel=0.05),
    "examples/guide/bodies.md": lambda a: worst(a["tumbled"], "energy_error") < 1e-9,
    "examples/guide/compiling.md": lambda a: a["result"].compile_time == 0.0,
    "examples/guide/laws.md": lambda a: a["stored"].observables["absorbed"][-1, 0] == len(a["gone"]) > 0,
    "examples/guide/limits.md": lambda a: (
        "surfaces[0].temperature must be None with Verlet, got 1; use Impact" in a["printed"]
    ),
    "examples/guide/many_runs.md": lambda a: len(a["table"]) == 8 and (a["table"]["state"] == "done").all(),
    "examples/guide/meshes.md": lambda a: a["smooth"].mesh_error < 0.05,
    "examples/guide/methods.md": lambda a: worst(a["exact"], "energy_error") < 1e-14,
    "examples/guide/moving_walls.md": lambda a: worst(a["carried"], "energy_error") <= 1e-12,
    "examples/guide/openings.md": lambda a: (
        0 < a["drained"].observables["escaped"][-1] <= 100 and a["passed"].observables["escaped"][-1] == 0
    ),
    "examples/guide/other_programs.md": lambda a: has_frames_of(a["universe"], a["result"]),
    "examples/guide/paper.md": lambda a: a["history"].converged and len(a["history"]) == 13,
    "examples/guide/pictures.md": lambda _: Path("gas.gif").stat().st_size > 10_000 and Path("gas.html").exists(),
    "examples/guide/readers.md": lambda a: "True" in a["printed"],
    "examples/guide/results.md": lambda a: a["run"].observables["layers"].shape == (21, 6) and a["force"] > 0.0,
    # Of 1000 particles and 11 frames, in chunks of ten
    "examples/guide/running.md": lambda a: (
        (a["first"].particles.position == a["again"].particles.position).all()
        and 0 <= Path("run.h5").stat().st_size - (56 * 20 + 16) * 1000 < 300_000
    ),
    "examples/guide/scene_files.md": lambda a: a["result"].particles.position.shape[0] == 3,
    "examples/guide/scenes.md": lambda a: (
        worst(a["settling"], "energy_error") <= 1e-14
        and worst(a["settling"], "max_penetration") <= 1e-14
        and a["settling"].observables["dissipated_energy"][-1] > 0.0
    ),
    "examples/guide/sources.md": lambda a: (
        a["fed"].observables["born"][-1, 2] == 1000 and a["poured"].observables["born"][-1, 0] > 0
    ),
}


def test_every_page_has_code():
    assert {*FACTS} == {named(path) for path in {*PAGES} - WITHOUT_PYTHON}
    assert [path for path in PAGES if path not in WITHOUT_PYTHON and "```python\n" not in path.read_text()] == []


@pytest.mark.physics
@pytest.mark.parametrize("page", FACTS)
def test_the_python_of_a_page_runs_from_top_to_bottom(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    copy_examples(tmp_path, 2)
    names = {}
    for block in re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.DOTALL):
        exec(compile(block, page, "exec"), names)
    assert FACTS[page]({**names, "printed": capsys.readouterr().out})


# What the words of a command stand for.
NAMES = {
    "SCENE.toml": "scene.toml", "SWEEP.toml": "sweep.toml", "RUN.h5": "scene.h5", "OUT.h5": "out.h5",
    "OUT.rrd": "out.rrd", "N": "2", "local:2": "local:1",
}  # fmt: skip
SCENE = re.search(r"```toml\n(.*?)```", (GUIDE / "scene_files.md").read_text(), re.DOTALL)[1]


def commands():
    """Every command of swarm in the pages, without its options in brackets and, where it has some, with them all.

    What only reads files is run once.
    """
    spans = re.findall(r"`(swarm [a-z]+ [^`\n]*\.[^`\n]*)`", ALL) + re.findall(
        r"^(?:pip install \S+ && )?(swarm [a-z]+ \S+\.\S+.*)$", ALL, re.MULTILINE
    )
    seen = set()
    for span in spans:
        for words in dict.fromkeys((re.sub(r" *\[.*?\]", "", span), re.sub(r"[\[\]]", "", span))):
            if words in seen and words.split()[1] not in ("run", "sweep"):
                continue
            seen.add(words)
            yield [NAMES.get(word, word) for word in words.split()[1:]]


def settings():
    """Every `key = value` of [run] in the pages."""
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
        "new",
        "schema",
        "check",
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


def test_lines_of_the_guide_fit_beside_a_terminal_of_120_columns():
    """Those of text: a row of a table, a picture and a line of code are one line each."""
    long, code = [], re.compile(r"^```.*?^```", flags=re.M | re.S)
    for page in sorted(GUIDE.rglob("*.md")):
        text = code.sub(lambda block: "\n" * block[0].count("\n"), page.read_text("utf-8"))
        lines = enumerate(text.splitlines(), 1)
        long += [f"{page.name}:{k}" for k, line in lines if len(line) > 120 and not line.startswith(("|", "!["))]
    assert not long
