"""README: its first screen is examples/quickstart.py, which runs; its commands and files exist."""

import re
import runpy
from pathlib import Path

import pytest

import swarm

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def test_first_screen_is_the_example():
    block = re.search(r"```python\n(.*?)```", README, re.DOTALL)
    assert block is not None
    example = (ROOT / "examples" / "quickstart.py").read_text().split('"""\n\n', 1)[1]
    assert block.group(1) == example


@pytest.mark.physics
def test_the_example_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = runpy.run_path(str(ROOT / "examples" / "quickstart.py"))
    assert names["result"].particles.position.shape == (3, 10_000)
    assert names["result"].observables["energy_error"].max() <= 1e-14
    assert "impacts" in capsys.readouterr().out


def test_files_named_in_the_readme_exist():
    paths = set(re.findall(r"(?:examples|bench|tests|swarm)/[\w./-]+\.\w+", README))
    assert paths
    assert [path for path in sorted(paths) if not (ROOT / path).exists()] == []


def test_ci_runs_the_readme_test_command():
    """.ci/run calls what README tells a newcomer."""
    ci = (ROOT / ".ci" / "run").read_text()
    assert 'pip install -e ".[test]"' in README
    assert "python -m pytest -n auto --dist worksteal\n" in README
    assert 'pip install --quiet --disable-pip-version-check -e ".[test]"' in ci
    assert "python -m pytest -q -n auto --dist worksteal\n" in ci


@pytest.mark.physics
def test_the_other_blocks_run_after_the_first(capsys):
    scene = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    names = {"swarm": swarm, "scene": scene}
    for block in re.findall(r"```python\n(.*?)```", README, re.DOTALL)[1:]:
        exec(block, names)
    seen = names["settling"].observables
    assert seen["energy_error"].max() <= 1e-14
    assert seen["max_penetration"].max() <= 1e-14
    assert seen["dissipated_energy"][-1] > 0.0
    assert names["history"].converged
    assert len(names["history"]) == 13
    assert "True" in capsys.readouterr().out
