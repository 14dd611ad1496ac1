"""Examples and benchmarks write where `-o` says, by default in a folder that Git ignores, and nothing elsewhere."""

import argparse
import importlib
import os
import sys
from pathlib import Path

import pytest
from children import python

from bench import report
from examples import asked

ROOT = Path(__file__).parents[1]
DRAWN = sorted(
    f"examples.{path.stem}" for path in (ROOT / "examples").glob("*.py") if "import Asked" in path.read_text()
)
# Small enough for plain Python.
SHORT = {
    "examples.heavy_piston": ["--particles", "10", "--until", "2"],
    "examples.fermi": ["--periods", "20"],
}


def files(folder):
    """All files of a folder with their times, without what Python and tools keep."""
    kept = (one for one in folder.rglob("*") if one.is_file() and "cache" not in str(one.relative_to(folder)))
    return {str(one.relative_to(folder)): one.stat().st_mtime_ns for one in kept}


def test_what_git_ignores_is_the_folder_of_all():
    ignored = (ROOT / ".gitignore").read_text().splitlines()
    assert f"/{asked.OUT}/" in ignored
    assert report.OUT.parts[0] == str(asked.OUT)


def test_examples_that_draw_ask_alike():
    """One that takes a file by another way would be missed here."""
    drawing = [
        path
        for path in (ROOT / "examples").glob("*.py")
        if path.stem != "page" and ("savefig" in path.read_text() or "page(" in path.read_text())
    ]
    assert sorted(f"examples.{path.stem}" for path in drawing) == DRAWN


PARSERS = """
import argparse, contextlib, runpy, sys

def parse_with_progress(self, *given, real=argparse.ArgumentParser.parse_args, **more):
    (output,) = (one for one in self._actions if "-o" in one.option_strings)
    print(output.default)
    sys.exit()

argparse.ArgumentParser.parse_args = parse_with_progress
names, sys.argv = sys.argv[1:], ["x"]
for name in names:
    with contextlib.suppress(SystemExit):
        runpy.run_module(name, run_name="__main__")
"""


def test_by_default_they_write_there():
    """In a process of its own: `main` is not run, its parser is asked."""
    names = [*DRAWN, "examples.paper.__main__", "bench.reference"]
    done = python("-c", PARSERS, *names, cwd=ROOT)
    assert done.returncode == 0, done.stderr[-2000:]
    assert [Path(line).parts[0] for line in done.stdout.split()] == [str(asked.OUT)] * len(names)


def test_benchmarks_write_there(tmp_path, monkeypatch):
    monkeypatch.setattr(report, "_folder", report.OUT)
    assert report.file_of("a.csv").parts[0] == str(asked.OUT)
    report.write_to(tmp_path / "tables" / "new")
    report.write([report.Row("speed", 1.0, 2.0, "s")], "speeds")
    (table,) = (tmp_path / "tables" / "new").iterdir()
    assert "speed,1,2,s,," in table.read_text()


@pytest.mark.physics
@pytest.mark.parametrize("name", SHORT)
def test_they_leave_nothing_beside_it(name, tmp_path):
    before = files(ROOT / "examples"), files(ROOT / "bench")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
    done = python("-m", name, *SHORT[name], cwd=tmp_path, env=environment)
    assert done.returncode == 0, done.stderr[-3000:]
    assert sorted(files(tmp_path)) == [f"{asked.OUT}/{name.split('.')[1]}.png"]
    assert (files(ROOT / "examples"), files(ROOT / "bench")) == before


@pytest.mark.parametrize(
    ("name", "extras"), [("vessel_from_stl", "plot,mesh"), ("cooling", "plot,table"), ("piston", "plot")]
)
def test_without_its_extras_an_example_is_one_sentence(name, extras, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [name])
    module = importlib.import_module(f"examples.{name}")
    monkeypatch.setattr(asked.importlib.util, "find_spec", lambda _module: None)
    with pytest.raises(SystemExit) as end:
        module.main()
    assert end.value.code == 1
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.endswith(f'pip install ".[{extras}]"\n')
    assert output.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
    assert issubclass(asked.Asked, argparse.ArgumentParser)
