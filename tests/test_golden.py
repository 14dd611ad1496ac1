"""Golden runs: the last bits of short runs of every method in every kind of surface, as they were before."""

import ast
import importlib.util
import json
import os
import random
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import rarely

_SPEC = importlib.util.spec_from_file_location("golden", Path(__file__).parent / "reference" / "golden.py")
golden = importlib.util.module_from_spec(_SPEC)
sys.path.insert(0, str(Path(__file__).parent / "reference"))
_SPEC.loader.exec_module(golden)

EVERY = json.loads(golden.FILE.read_text())
KNOWN = {name: known for name, known in EVERY.items() if not name.startswith("cell: ")}
CELLS = {name: known for name, known in EVERY.items() if name not in KNOWN}
# Seconds each in plain Python, of which the long ring has the rest.
SOON = [
    name for name in KNOWN if "falling" not in name and (name.startswith("impact e=1") or name.endswith(", sphere"))
]


# Each takes half a second or more in plain Python.
DEAR = ("grains", "bodies", "formula", "sampled", "mesh", "Penalty", "period", "log", "plane")

ROTATED = ("impact e=1, rotated ellipsoid", "impact e=1, box", "impact e=1, bowl")
DIGESTS = "import golden; print([golden.digest(name) for name in {names}])"


@pytest.mark.physics
@pytest.mark.parametrize("processor", ["Haswell", "Sandybridge"])
def test_another_processors_blas_changes_no_bit(processor):
    """NumPy's matrix product rounds as the processor likes; OpenBLAS can be set to one."""
    folder = Path(golden.__file__).parent
    done = subprocess.run(
        [sys.executable, "-c", DIGESTS.format(names=ROTATED)],
        env={**os.environ, "OPENBLAS_CORETYPE": processor}, cwd=folder, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert ast.literal_eval(done.stdout) == [KNOWN[name] for name in ROTATED]


def test_every_run_is_known():
    assert set(KNOWN) == set(golden.runs())


@pytest.mark.parametrize("name", [name if name in SOON else rarely(name) for name in KNOWN])
def test_the_bits_are_as_they_were(name):
    assert golden.digest(name) == KNOWN[name]


def test_every_cell_is_known():
    assert set(CELLS) == set(golden.cell_names())
    assert len(EVERY) >= 656


def test_a_cell_is_exact_or_has_its_end():
    """On another machine the former have the same digests, the latter the same ends to 1e-9."""
    for name, known in CELLS.items():
        assert set(known) in ({"exact"}, {"libm", "end", "machine"}), name


@pytest.mark.parametrize("name", [rarely(name) if any(word in name for word in DEAR) else name for name in CELLS])
def test_a_cell_is_as_it_was(name):
    assert golden.disagreement(name, CELLS[name]) == ""


def test_a_cell_has_the_same_digest_in_another_process():
    """Nothing of a digest is the order of a set or the time."""
    names = [name for name in CELLS if "balls, Impact" in name and not any(word in name for word in DEAR)][:3]
    code = "import golden; print([golden.run_cell(name)[0] for name in {names}])"
    done = subprocess.run(
        [sys.executable, "-c", code.format(names=names)], env={**os.environ, "PYTHONHASHSEED": "12345"},
        cwd=Path(golden.__file__).parent, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert ast.literal_eval(done.stdout) == [golden.run_cell(name)[0] for name in names]


# One of each engine, with whatever wall and capability the seed gives. Shards are held against one process elsewhere.
COMPILED = [name for name in CELLS if golden.is_compiled(name)]
SAMPLE = [
    random.Random(f"56, {engine}").choice([name for name in COMPILED if golden.cell_of(name).engine == engine])
    for engine in golden.cells.ENGINES
]


def test_all_cells_are_compiled_but_those_on_a_cluster():
    assert {golden.cell_of(name).capability for name in set(CELLS) - set(COMPILED)} == {"cluster"}


@pytest.mark.slow
@pytest.mark.parametrize("name", [name if name in SAMPLE else rarely(name) for name in COMPILED])
def test_a_cell_is_compiled_with_the_same_bits_for_one_thread_and_two(name):
    assert golden.disagreement_of_threads(name, CELLS[name]) == ""


def test_bits_that_depend_on_the_number_of_threads_are_reported(monkeypatch):
    run_cell = golden.run_cell

    def with_a_fault(name, **options):
        found, end = run_cell(name, **options | {"compile": "never"})
        return ("other" if options["threads"] == 2 else found), end

    monkeypatch.setattr(golden, "run_cell", with_a_fault)
    name = "cell: points, Impact / sphere / plain"
    assert "with one thread, other with two" in golden.disagreement_of_threads(name, CELLS[name])


def test_an_end_that_is_near_counts_on_another_machine():
    name, known = next((name, known) for name, known in CELLS.items() if "end" in known and "points, Impact" in name)
    near = [x * (1.0 + 1e-11) for x in known["end"]]
    other = known | {"libm": "another", "end": near}
    assert golden.disagreement(name, other | {"machine": "another"}) == ""
    assert "instead of" in golden.disagreement(name, other)
    far = other | {"machine": "another", "end": [x + 1e-8 for x in near]}
    assert "the end is off by" in golden.disagreement(name, far)
