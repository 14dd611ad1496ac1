"""Kernels on disk are found by what they trace: an edit of that compiles again, and no other edit does."""

import copy
import dis
import os
import shutil
from pathlib import Path
from types import CodeType, FunctionType

import numba
import pytest
from children import python

import swarm
from swarm.grains import step
from swarm.kernel import digest, entries, frozen, machine_code
from swarm.kernel.entries import key_of
from swarm.kernel.frozen import Frozen
from swarm.kernel.trace import calls
from swarm.kernel.trace.helpers import Helper
from swarm.lanes import block
from swarm.lanes.lane_arrays import Lanes
from swarm.run.machine import run_of
from swarm.run.options import RunOptions
from swarm.run.preflight.admission import task_of
from swarm.surfaces.contract import Smooth
from swarm.surfaces.shapes.sphere import SphereNumbers
from swarm.surfaces.shapes.torus import TorusNumbers
from swarm.surfaces.time_of_impact import flights

PACKAGE = Path(swarm.__file__).parent
compiled_only = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set: nothing compiles")


def kernels_of(scene, method=None, **particles):
    """The kernels of a run with the types of their arguments."""
    start = swarm.fill(scene, 4, speed=1.0, seed=1, **particles)
    task = task_of(scene, start, method or swarm.Impact(), RunOptions(until=0.1, threads=1))
    return [(kernel, tuple(map(numba.typeof, arguments))) for kernel, arguments in run_of(task).calls()]


@pytest.fixture(scope="module")
def cavity():
    """The kernel of flights and impacts in a sphere."""
    return kernels_of(swarm.Scene([swarm.Sphere(0.5)]))[0]


@pytest.fixture(scope="module")
def as_it_is(cavity):
    return code_of(*cavity)


def code_of(kernel, kinds):
    return key_of(kinds, kernel, package="the text of the package").text


def with_defaults(function, *values):
    return FunctionType(function.__code__, function.__globals__, function.__name__, values)


def another(*given):
    return given


# --- What compiles again, and what does not ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("owner", "name", "value"),
    [
        pytest.param(block, "MOST_HITS", 2e8, id="a constant of a module"),
        pytest.param(block, "_halts", another, id="a function"),
        pytest.param(flights, "end", with_defaults(flights.end, True), id="a default"),
        pytest.param(Smooth, "distance", another, id="a method of a base class"),
        pytest.param(SphereNumbers, "count", another, id="a method that takes the place of one of a tuple"),
        pytest.param(Lanes, "load", another, id="a method of an argument"),
    ],
)
def test_an_edit_of_what_a_kernel_traces_changes_its_digest(cavity, as_it_is, monkeypatch, owner, name, value):
    monkeypatch.setattr(owner, name, value, raising=False)
    assert code_of(*cavity) != as_it_is


def test_what_tools_write_into_a_class_is_not_in_a_digest():
    """A copied or pickled object leaves a list in its class: kernels on disk would not be found again."""
    (sphere,), digests = swarm.Sphere(0.5).walls(), []
    if "__slotnames__" in vars(type(sphere)):
        del type(sphere).__slotnames__
    for _ in range(2):
        found = Frozen(package="")
        found.value(type(sphere))
        assert found.is_known
        digests.append(found.digest())
        copy.copy(sphere)
    assert isinstance(vars(type(sphere))["__slotnames__"], list)
    assert digests[0] == digests[1]


def test_no_other_edit_changes_it(cavity, as_it_is, monkeypatch):
    """Of grains, of another shape, of a name that no kernel takes, of a docstring."""
    monkeypatch.setattr(step, "march", another)
    monkeypatch.setattr(TorusNumbers, "phi", another)
    monkeypatch.setattr(block, "UNUSED", 1.0, raising=False)
    monkeypatch.setattr(SphereNumbers, "__doc__", "edited")
    assert code_of(*cavity) == as_it_is


def test_what_a_function_takes_is_what_its_instructions_say():
    for function in (code_of, block._look, Lanes.load, flights.end, key_of):
        for part in frozen._parts(function.__code__):
            names = set()
            constants = frozen._taken(part, names)
            instructions = list(dis.get_instructions(part))
            assert names == {one.argval for one in instructions if one.opname == "LOAD_GLOBAL"}
            values = {part.co_consts[one.arg] for one in instructions if one.opcode in dis.hasconst}
            assert set(constants) == {one for one in values if not isinstance(one, CodeType)}


@pytest.fixture
def traced(monkeypatch):
    """The code of all functions that a trace goes through."""
    found, twin_of = set(), calls.twin_of
    monkeypatch.setattr(calls, "twin_of", lambda function, frame: found.add(function) or twin_of(function, frame))
    return found


BOX = swarm.Box((0.5, 0.5, 0.5), friction=0.3, restitution=0.9, openings=[swarm.Sphere(0.1, center=(0, 0, 0.5))])
PEGS = swarm.Spheres([(0.1 * k - 0.45, 0.0, 0.0) for k in range(10)], 0.01, side="outside")
SCENES = {
    "friction, opening, gravity": (swarm.Scene([BOX], gravity=(0, 0, -9.81)), swarm.Impact(), {}),
    "union with a field": (
        swarm.Scene([swarm.Union([swarm.Sphere(1.0), swarm.Box((0.2, 0.2, 2.0))]), PEGS]), swarm.Impact(), {},
    ),
    "heat and motion": (
        swarm.Scene([
            swarm.Torus(1.0, 0.3, temperature=1.0),
            swarm.Sphere(0.1, center=(1, 0, 0), side="outside", motion=swarm.Oscillation((0.01, 0, 0), 1.0)),
        ]), swarm.Impact(), {},
    ),
    "a wall with a mass": (
        swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.1, mass=2.0, side="outside")]), swarm.Impact(), {},
    ),
    "balls": (swarm.Scene([swarm.Cylinder(0.5, length=1.0)], gravity=(0, 0, -9.81)), swarm.Impact(), {"radius": 0.02}),
    "grains": (swarm.Scene([swarm.Box((0.5, 0.5, 0.5))]), swarm.Penalty(dt=1e-3, penalty=1e3), {"radius": 0.02}),
    "formula": (swarm.Scene([swarm.Formula("x**2/0.09 + y**2/0.09 + z**4/0.13 - 1")]), swarm.Impact(), {}),
}  # fmt: skip


@compiled_only
@pytest.mark.physics
@pytest.mark.parametrize("name", SCENES)
def test_all_that_is_traced_is_in_the_digest(name, traced):
    """Else an edit of it would leave a kernel of the old code on disk."""
    scene, method, particles = SCENES[name]
    for kernel, kinds in kernels_of(scene, method, **particles):
        traced.clear()
        function = kernel.py_func
        kernel.typingctx.refresh()
        assert Helper(function, function, outlined=False).whole(kernel.typingctx, kinds) is not None
        found = Frozen(package="")
        found.value(function)
        for kind in kinds:
            entries._add(kind, found, {})
        assert found.is_known
        covered = {one.__code__ for one in found._copies}
        # The folder of kernels is named by the code of `swarm/kernel`.
        own = [one for one in traced if one.__module__.startswith("swarm.")]
        rest = [one for one in own if not one.__module__.startswith("swarm.kernel.")]
        missing = sorted(f"{one.__module__}.{one.__qualname__}" for one in rest if one.__code__ not in covered)
        assert function.__code__ in {one.__code__ for one in rest}
        assert not missing, f"{function.__name__} of {name}"


EDITED = """
import logging, sys
sys.path.insert(0, {root!r})
import numpy as np
import swarm
from swarm import observables
from swarm.kernel import cache, machine_code
logging.basicConfig(level="INFO", format="%(message)s")
with cache.kernels_compiled(lambda sentence: None):
    from swarm.run.engine import Run
    start = swarm.Particles((0.1, 0.0, 0.0), (1.0, 0.0, 0.0))
    run = Run(swarm.Scene([swarm.Sphere(0.5)]).compiled(), start, swarm.Impact(), 1, None)
    # The block of this number, and no other kernel.
    observables.observe(*run._observing(np.zeros(1, np.int64)))
    print(float(run.seen()["kinetic_energy"]))
"""


@compiled_only
def test_an_edit_on_disk_compiles_what_it_is_in(tmp_path, monkeypatch):
    """Of a comment, of a module that the kernel does not use, and of one that it does: the last compiles again."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    shutil.copytree(PACKAGE, tmp_path / "swarm", ignore=shutil.ignore_patterns("__pycache__"))
    seen = []
    for file, old, new in (
        ("observables.py", "", ""),
        ("observables.py", "\n\n\n", "\n\n\n# edited\n\n"),
        ("grains/step.py", "\n\n\n", "\n\n\nEDITED = 1.0\n\n"),
        ("observables.py", "0.5 * square(v)", "1.5 * square(v)"),
    ):
        path = tmp_path / "swarm" / file
        path.write_text(path.read_text().replace(old, new, 1))
        long_ago = path.stat().st_mtime - 10.0 * len(seen)
        os.utime(path, (long_ago, long_ago))  # bytecode knows an edit by the second
        done = python("-c", EDITED.format(root=str(tmp_path)), bare=True)
        assert done.returncode == 0, done.stderr
        seen.append((float(done.stdout), done.stderr.count("once: observe")))
    assert seen == [(0.5, 1), (0.5, 0), (0.5, 0), (1.5, 1)]


# --- What is kept ------------------------------------------------------------------------------------------


def looked_up(cavity, folder, monkeypatch):
    """The key of the kernel, and how many digests of code were computed for it."""
    computed = []

    def counted(*given, package=None):
        computed.append(package)
        return key_of(*given, package=package)

    monkeypatch.setattr(digest, "key_of", counted)
    kernel, kinds = cavity
    return digest.key_of_kernel(getattr(kernel, "py_func", kernel), kinds, ("a processor",), folder), len(computed) - 1


def test_a_warm_call_computes_no_digest(cavity, tmp_path, monkeypatch):
    monkeypatch.setattr(digest, "is_package_as_imported", lambda: True)
    first, computed = looked_up(cavity, tmp_path, monkeypatch)
    assert computed == 1
    assert looked_up(cavity, tmp_path, monkeypatch) == (first, 0)
    monkeypatch.setattr(digest, "text_of_package", lambda: "another text")
    assert looked_up(cavity, tmp_path, monkeypatch) == (first, 1)


def test_a_digest_is_not_kept_of_code_that_was_edited_since_it_was_imported(cavity, tmp_path, monkeypatch):
    """The text on disk is not what the process runs."""
    monkeypatch.setattr(digest, "is_package_as_imported", lambda: False)
    first, computed = looked_up(cavity, tmp_path, monkeypatch)
    assert computed == 1
    assert not list(tmp_path.iterdir())
    assert looked_up(cavity, tmp_path, monkeypatch) == (first, 1)


def test_an_edit_since_the_import_is_noticed(monkeypatch):
    newest = max(max(one.stat().st_mtime, one.stat().st_ctime) for one in PACKAGE.rglob("*.py"))
    monkeypatch.setattr(digest, "_STARTED", newest + 1.0)
    assert digest.is_package_as_imported()
    monkeypatch.setattr(digest, "_STARTED", newest)
    assert not digest.is_package_as_imported()


def test_where_nothing_can_be_written_the_key_is_the_same(cavity, tmp_path, monkeypatch):
    monkeypatch.setattr(digest, "is_package_as_imported", lambda: True)
    first, _computed = looked_up(cavity, tmp_path / "kept", monkeypatch)
    (tmp_path / "file").touch()
    assert looked_up(cavity, tmp_path / "file", monkeypatch) == (first, 1)


def test_the_user_sets_the_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    assert machine_code.cache_folder().parent == tmp_path / "numba"
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert machine_code.cache_folder().parent == tmp_path / "xdg" / "swarm"


def one_more(x):
    return x + 1.0


@compiled_only
def test_each_level_of_optimisation_has_its_own_kernels(monkeypatch, tmp_path):
    from swarm.kernel.jit import kernel

    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    found = []
    for level in ("3", "0", "3"):
        monkeypatch.setattr(numba.config, "OPT", numba.config._OptLevel(level))
        made = kernel(one_more)
        assert made(1.0) == 2.0
        found.append(sum(made.stats.cache_hits.values()))
    assert found == [0, 0, 1]


def test_what_was_never_compiled_needs_no_digest(cavity, tmp_path, monkeypatch):
    """A run of few particles begins in plain Python, and only asks whether its kernels are there."""
    monkeypatch.setattr(digest, "is_package_as_imported", lambda: True)
    kernel, kinds = cavity
    asked = getattr(kernel, "py_func", kernel), kinds, ("a processor",), tmp_path
    assert not digest.was_compiled(*asked)
    looked_up(cavity, tmp_path, monkeypatch)
    assert digest.was_compiled(*asked)
