"""Compiled kernels on disk: what is found again of classes that a script, a cell or a module of the user's defines."""

import os
import textwrap
from pathlib import Path

import numba
import pytest
from children import python

import swarm
from swarm.kernel import cache, jit, machine_code
from swarm.kernel.entries import key_of
from swarm.kernel.gravity import Gravity
from swarm.kernel.vector import Vec

compiled_only = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set: nothing compiles")
ROOT = Path(swarm.__file__).parents[1]
CELL = """
from swarm.kernel.jit import inlined
from swarm.kernel.record import Record
from swarm.kernel.vector import dot

FACTOR = 2.0

class Pair(Record):
    one: float
    other: float = 3.0

@inlined
def scaled(x):
    return FACTOR * x

class Parent(Record):
    radius: float

    def phi(self, r):
        return scaled(dot(r, r)) - Pair(self.radius, 3.0).one

    def inner(self, r):
        return 1.0

class Mine(Parent):
    def level_of(self, q):
        return 1.0
"""


def cell(old="", new="", module="__main__"):
    """What a cell of a notebook leaves behind."""
    assert old in CELL
    scope = {"__name__": module}
    exec(textwrap.dedent(CELL.replace(old, new, 1)), scope)
    return scope


def key(made, *others):
    return key_of([numba.typeof((made(0.5), 1.0))], *others).text


# --- What is the same, and what is not -------------------------------------------------------------------


def test_the_same_cell_has_the_same_key():
    one, other = cell(), cell()
    assert one["Mine"] is not other["Mine"]
    assert key(one["Mine"]) == key(other["Mine"])
    assert key(one["Mine"], "fly") != key(one["Mine"], "observe")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("FACTOR = 2.0", "FACTOR = 2.5"),
        ("FACTOR * x", "FACTOR + x"),
        ("- Pair(", "+ Pair("),
        ("other: float = 3.0", "another: float = 3.0"),
        ("other: float = 3.0", "other: float = 4.0"),
        ("    radius: float", "    size: float"),
        ("def inner(self, r)", "def project(self, r)"),
        (
            "    def inner(self, r):\n        return 1.0\n\nclass Mine(Parent):",
            "class Mine(Parent):\n    def inner(self, r):\n        return 1.0\n",
        ),
        ("    def level_of(self, q):\n        return 1.0", "    pass"),
        ("class Mine(Parent)", "class Other(Parent): pass\nclass Mine(Other)"),
        (
            "    def level_of(self, q):\n        return 1.0",
            "    def level_of(self, q):\n        return 1.0 + 0.0 * FACTOR",
        ),
    ],
)
def test_what_makes_another_key(old, new):
    """A constant, a helper, a class that a definition uses, fields, parents, and what is defined for which class."""
    assert key(cell(old, new)["Mine"]) != key(cell()["Mine"])


def test_classes_of_other_modules_and_other_types_have_other_keys():
    assert key(cell(module="shapes")["Mine"]) != key(cell()["Mine"])
    kinds = [1.0, 1, True, None, (1.0, 1.0), (1.0, (1.0,)), ((1.0, 1.0),), Vec(1.0, 1.0, 1.0), Gravity(1.0, 1.0, 1.0)]
    assert len({key_of([numba.typeof(one)]).text for one in kinds}) == len(kinds)
    assert key_of([numba.float64, numba.int64]).text != key_of([numba.int64, numba.float64]).text


def test_a_definition_of_an_object_that_is_not_known_is_never_found():
    made = cell("FACTOR = 2.0", "FACTOR = object()")["Mine"]
    assert key(made) != key(made)


def shifted(x):
    return x + 1.0


def doubled(x):
    return 2.0 * x


helper = shifted


def with_a_helper(x):
    return helper(x)


@compiled_only
def test_a_kernel_of_the_users_with_another_helper_is_compiled(tmp_path, monkeypatch):
    """Numba looks at the file of the kernel alone."""
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    found = []
    for one, value in ((shifted, 4.0), (shifted, 4.0), (doubled, 6.0)):
        monkeypatch.setitem(globals(), "helper", jit.inlined(one))
        kernel = jit.kernel(with_a_helper)
        assert kernel(3.0) == value
        found.append(sum(kernel.stats.cache_hits.values()))
    assert found == [0, 1, 0]


# --- With Numba ------------------------------------------------------------------------------------------


def phi_of(surface, r):
    return surface.phi(r) + 0.0


@compiled_only
def test_a_cell_that_is_run_again_compiles_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    found = []
    for old, new, value in (("", "", 1.5), ("", "", 1.5), ("FACTOR = 2.0", "FACTOR = 3.0", 2.5), ("", "", 1.5)):
        kernel, surface = jit.kernel(phi_of), cell(old, new)["Mine"](0.5)
        assert kernel(surface, Vec(1.0, 0.0, 0.0)) == value
        # What is loaded is of the class of this cell: the next call finds it.
        assert kernel.signatures == [tuple(map(numba.typeof, (surface, Vec(1.0, 0.0, 0.0))))]
        found.append(sum(kernel.stats.cache_hits.values()))
    assert found == [0, 1, 0, 1]


class Twice:
    def __call__(self, x):
        return 2.0 * x


twice = Twice()


def twice_the_radius(surface):
    return twice(surface.radius)


@compiled_only
def test_what_is_never_found_is_not_written(tmp_path, monkeypatch):
    """Each start would add a file."""
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    kernel, surface = jit.kernel(twice_the_radius), cell()["Mine"](0.5)
    assert kernel(surface) == 1.0
    assert cache.is_compiled(kernel, (surface,))
    assert not list(tmp_path.rglob("*.nb?"))


SCRIPT = """
from swarm.kernel.vector import Vec
from swarm.surfaces.formulas.own import _compiled_phi
values = [_compiled_phi(surface, Vec(1.0, 0.0, 0.0)) for surface in surfaces]
print(values, sum(_compiled_phi.stats.cache_hits.values()))
"""


@compiled_only
def test_a_script_that_is_started_again_compiles_nothing(tmp_path):
    """And a process reads an index that names classes of a module that is gone."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(ROOT)}
    file, module = tmp_path / "script.py", tmp_path / "shapes.py"

    def run(start, surfaces):
        file.write_text(f"{start}\nsurfaces = {surfaces}\n{SCRIPT}")
        done = python(file, env=environment)
        assert done.returncode == 0, done.stderr[-3000:]
        return done.stdout.strip()

    module.write_text(CELL)
    assert run("import shapes" + CELL, "[Mine(0.5), shapes.Mine(0.5)]") == "[1.5, 1.5] 0"
    module.unlink()
    assert run(CELL, "[Mine(0.5)]") == "[1.5] 1"
    assert run(CELL.replace("FACTOR = 2.0", "FACTOR = 3.0"), "[Mine(0.5)]") == "[2.5] 0"
