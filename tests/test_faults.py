"""Faults are planted as `bench/faults.py` says: each kind, in code alone, and the same for the same seed."""

import ast
import csv
import os
import shutil
from pathlib import Path

import pytest

from bench import faults, planting

PACKAGE = Path(__file__).parents[1] / "swarm"
CODE = '''\
"""Text: -1 < 2 * x[0]."""


def f(rows: "tuple[int, 1]", k: int = 0) -> list[int]:
    """Text: -1 < 2 * x[0]."""
    if k >= 3:  # φ(r) < 0
        raise ValueError(f"{rows[0] * 2} of {-k}, " + "text" * 2)
    return (rows[0]  # a - b
        - (3.0 * k)) / rows[1:, -1]


def _sentence(x):
    return x[0] * 2 - 1 < 3
'''
LAST = "- (3.0 * k)) / rows[1:, -1]"
CHANGES = {
    ("sign", LAST, "+ (3.0 * k)) / rows[1:, -1]"),
    ("sign", LAST, "- (3.0 * k)) / rows[1:, 1]"),
    ("factor", LAST, "- (6.0 * k)) / rows[1:, -1]"),
    ("factor", LAST, "- (3.0 * k)) * rows[1:, -1]"),
    ("index", "return (rows[0]  # a - b", "return (rows[1]  # a - b"),
    ("index", LAST, "- (3.0 * k)) / rows[0:, -1]"),
    ("index", LAST, "- (3.0 * k)) / rows[1:, -2]"),
    ("comparison", "if k >= 3:  # φ(r) < 0", "if k > 3:  # φ(r) < 0"),
}


def test_sites_are_code_alone():
    """Docstrings, comments, messages, annotations and text for people have none."""
    found = planting.sites(CODE.encode())
    assert {(one.kind, one.before, one.after) for one in found} == CHANGES
    for one in found:
        planted = one.planted(CODE.encode())
        assert ast.dump(ast.parse(planted)) != ast.dump(ast.parse(CODE))
        lines = zip(CODE.splitlines(), planted.decode().splitlines(), strict=True)
        assert [k + 1 for k, (old, new) in enumerate(lines) if old != new] == [one.line]


def test_a_fault_is_of_the_file_that_it_was_found_in():
    fault = planting.sites(CODE.encode())[0]
    with pytest.raises(ValueError, match="is not the file"):
        fault.planted(b"\n" + CODE.encode())


def test_the_seed_chooses(tmp_path):
    shutil.copytree(PACKAGE / "motion", tmp_path / "swarm" / "motion")
    first, other = (planting.chosen(tmp_path / "swarm", seed) for seed in (7, 8))
    assert first == planting.chosen(tmp_path / "swarm", 7) != other
    assert len(first) == 2 * planting.FAULTS
    assert {one.kind for one in first} == set(planting.KINDS)
    for one in first:
        source = (tmp_path / one.file).read_bytes()
        assert ast.dump(ast.parse(one.planted(source))) != ast.dump(ast.parse(source))


def test_every_group_has_modules():
    """Each name of a module that may be chosen is one of the package."""
    for group, allowed in planting.GROUPS.items():
        for name in filter(None, allowed.split("|")):
            assert any((PACKAGE / group).rglob(f"{name}.py")), f"{group}/{name}"


def test_a_fault_is_there_in_its_context_alone(tmp_path, monkeypatch):
    """Also for Python, which keeps the bytecode of a file of the same size and second."""
    monkeypatch.setattr(faults.Tree, "__init__", lambda tree, folder: vars(tree).update(folder=folder, _changes=0))
    tree, path = faults.Tree(tmp_path), tmp_path / "module.py"
    path.write_text(CODE)
    fault = next(one for one in planting.sites(CODE.encode(), "module.py") if len(one.new) == len(one.old))
    moments = [int(path.stat().st_mtime)]
    with tree.planted(fault):
        assert path.read_bytes() == fault.planted(CODE.encode())
        moments.append(int(path.stat().st_mtime))
    assert path.read_text() == CODE
    assert len({*moments, int(path.stat().st_mtime)}) == 3
    assert ast.parse(path.read_text())


def test_the_test_that_failed_is_read():
    """From the summary of pytest, or, where Python ended, from the last line that it wrote."""
    ended = "tests/test_a.py::test_b PASSED [ 50%]\ntests/test_a.py::test_c[1.0-x y] "
    assert faults._failed(ended + f"{os.linesep}Timeout (0:02:30)!\n") == "tests/test_a.py::test_c[1.0-x y]"
    failed = "tests/test_a.py::test_b FAILED [ 50%]\n=== short test summary info ===\n"
    assert (
        faults._failed(failed + "FAILED tests/test_a.py::test_b[0] - assert 1 == 2\n") == "tests/test_a.py::test_b[0]"
    )
    assert faults._failed("tests/test_a.py::test_b PASSED [ 50%]\n") is None


def test_faults_of_a_table_are_found_where_their_lines_are_now(tmp_path, capsys):
    (tmp_path / "swarm").mkdir()
    (tmp_path / "swarm" / "moved.py").write_text("\n\n" + CODE)
    fault = planting.sites(CODE.encode(), "module.py")[0]
    table = tmp_path / "table.csv"
    with table.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["number", "file", "line", "kind", "before", "after", "seen by"])
        rows.writerow([3, fault.file, fault.line, fault.kind, fault.before, fault.after, "tests/test_a.py::test_b"])
        rows.writerow([4, fault.file, fault.line, fault.kind, "x = 1", "x = 2", ""])
    ((number, found, test),) = faults.again(tmp_path, table)
    assert (number, found.file, found.line, test) == (3, "swarm/moved.py", fault.line + 2, "tests/test_a.py::test_b")
    assert (found.before, found.after) == (fault.before, fault.after)
    assert "4 is gone: no module has the line x = 1" in capsys.readouterr().out


def test_nearest_tests_of_a_module():
    near = faults.nearest(PACKAGE.parent, "swarm/placing/cells.py")
    assert near[0] == "swarm/placing/cells.py"
    assert "tests/placing/test_cells.py" in near[1:3]
    assert all((PACKAGE.parent / path).is_file() for path in near)
