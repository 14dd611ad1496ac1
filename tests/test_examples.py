"""The examples that add a surface and a method: every method and every surface runs with them, and they are short."""

import ast
import importlib.util
import os
import sys
from pathlib import Path

import numba
import pytest
from children import python
from conftest import METHODS, SURFACES, every_surface, row

import swarm
from swarm.kernel.vector import Vec
from swarm.surfaces import contract

ROOT = Path(__file__).parents[1]
FILE = ROOT / "examples" / "own_surface.py"
METHOD = ROOT / "examples" / "own_method.py"
GRAVITY = {"no gravity": None, "gravity": (0.0, 0.5, -1.0)}
CONSERVING = ("impact", "impact, chord", "penalty", "augmented Lagrangian")
# For n = 2 the surface is the ellipsoid, which has other definitions.
SCRIPT = """
import dataclasses, sys
sys.path[:0] = {paths!r}
import numpy as np, swarm
from conftest import METHODS, SURFACES, every_surface

import swarm
from swarm.kernel.vector import Vec
from swarm.surfaces import contract
from own_surface import Superellipsoid

np.seterr(all="ignore")
axes = (0.3, 0.4, 0.5)
start = swarm.fill(swarm.Scene([swarm.Ellipsoid(axes)]), 2, speed=1.0, seed=3)
pull = {gravity!r}
for name, method in METHODS.items():
    if pull is not None and name == "augmented Lagrangian":
        # Steps that are cut at the impact are not supported with gravity. Not every step of a fixed length converges.
        method = dataclasses.replace(method, adaptive=False, on_unconverged="count", max_sweeps=10)
    four, two, ellipsoid = (
        swarm.simulate(swarm.Scene([surface], gravity=pull), start, method, until=2.2, every=0.55, threads=1)
        for surface in (Superellipsoid(axes), Superellipsoid(axes, n=2.0), swarm.Ellipsoid(axes))
    )
    off = np.abs(two.particles.position - ellipsoid.particles.position).max()
    seen = four.observables
    print(name, seen["impacts"][-1], seen["energy_error"].max(), seen["max_penetration"].max(), off, sep=";")
"""


def in_plain_python(*arguments):
    """What Python prints without the compiler: each method would compile kernels of its own."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)}
    done = python(*arguments, env=environment)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def runs(pull):
    """Method -> impacts, energy drift, penetration, and how far the positions for n = 2 are from the ellipsoid's."""
    script = SCRIPT.format(paths=[str(FILE.parent), str(ROOT / "tests")], gravity=pull)
    rows = (line.split(";") for line in in_plain_python("-c", script).splitlines())
    return {name: tuple(map(float, values)) for name, *values in rows}


@pytest.mark.parametrize("case", GRAVITY)
def test_the_superellipsoid_runs_with_every_method(case):
    found = runs(GRAVITY[case])
    assert list(found) == list(METHODS)
    for name, (impacts, drift, outside, off) in found.items():
        with row(name):
            assert impacts >= 8
            assert outside < 2e-3
            if (case, name) == ("gravity", "augmented Lagrangian"):
                # Not every step of a fixed length converges, which is counted.
                continue
            assert off < 1e-8
            if name in CONSERVING:
                assert drift < 1e-14
                assert outside < 1e-14


def test_it_prints_energy_drift_and_impacts():
    code = FILE.read_text()
    assert code.count("2_000") == 1
    printed = in_plain_python("-c", code.replace("2_000", "3"))
    impacts, drift = (float(part.split()[0]) for part in printed.replace("energy drift", "").split(","))
    assert impacts > 10
    assert drift < 1e-14


KERNEL = """
from own_surface import Superellipsoid
from swarm.kernel.jit import kernel
from swarm.kernel.vector import Vec

@kernel
def time_of_hit(surface, r, v):
    return surface.first_hit(r, v)[0]

numbers = Superellipsoid((0.3, 0.4, 0.5)).numbers()
print(time_of_hit(numbers, Vec(0.0, 0.0, 0.0), Vec(1.0, 0.0, 0.0)), sum(time_of_hit.stats.cache_hits.values()))
"""


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set")
def test_a_kernel_of_an_edited_surface_is_never_an_old_one(tmp_path):
    """The cache of the package's kernels knows the definitions outside of it, their helpers too."""
    text = FILE.read_text()
    (tmp_path / "main.py").write_text(KERNEL)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(ROOT)}
    environment["PYTHONDONTWRITEBYTECODE"] = "1"

    def run(old="", new=""):
        (tmp_path / "own_surface.py").write_text(text.replace(old, new))
        done = python(tmp_path / "main.py", env=environment)
        assert done.returncode == 0, done.stderr[-3000:]
        time, hits = done.stdout.split()
        return pytest.approx(float(time), rel=1e-12), int(hits)

    assert run() == (0.3, 0)
    assert run() == (0.3, 1)
    assert run("0.0)) - 1.0", "0.0)) - 16.0") == (0.6, 0)
    assert run("(r.x / a.x)", "(0.5 * r.x / a.x)") == (0.6, 0)
    assert run() == (0.3, 1)


@pytest.mark.physics
@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set")
@pytest.mark.parametrize("file", [FILE, METHOD], ids=lambda file: file.name)
def test_the_second_start_compiles_nothing(file, tmp_path):
    """Nor does it write a kernel anew."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    written = []
    for _ in range(2):
        done = python(file, env=environment)
        assert done.returncode == 0, done.stderr[-3000:]
        written.append({path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nb?")})
    assert written[0] == written[1]
    assert any("advance_block" in path.name for path in written[0])


def lines_of(file):
    """Lines of a file without docstrings and blank ones."""
    text = file.read_text()
    docstrings = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node) is not None:
            docstrings |= set(range(node.body[0].lineno, node.body[0].end_lineno + 1))
    return [line for i, line in enumerate(text.splitlines(), 1) if line.strip() and i not in docstrings]


def test_they_are_short():
    assert len(lines_of(FILE)) <= 40
    assert len(lines_of(METHOD)) <= 60


@pytest.fixture(scope="module")
def mirror():
    """The method of examples/own_method.py."""
    spec = importlib.util.spec_from_file_location("own_method", METHOD)
    module = importlib.util.module_from_spec(spec)
    sys.modules["own_method"] = module
    spec.loader.exec_module(module)
    return module.Mirror()


@pytest.mark.parametrize("case", GRAVITY)
@every_surface
def test_the_method_runs_in_every_scene(mirror, name, case):
    """It is `Impact` to round-off, as long as a run does not multiply it."""
    surface = SURFACES[name]()
    walls = [surface] if getattr(surface, "side", "outside") == "inside" else [surface, swarm.Sphere(2.0)]
    scene = swarm.Scene(walls, GRAVITY[case])
    start = swarm.fill(scene, 5, speed=1.0, seed=1)
    ends = [swarm.simulate(scene, start, method, until=2.0, compile="never") for method in (mirror, swarm.Impact())]
    assert ends[0].observables["impacts"][-1] == ends[1].observables["impacts"][-1] > 0
    assert ends[0].particles.position == pytest.approx(ends[1].particles.position, abs=1e-9)
    assert ends[0].observables["energy_error"].max() < 1e-13
    assert ends[0].observables["impulse"][-1] == pytest.approx(ends[1].observables["impulse"][-1], abs=1e-9)


def test_losses_of_walls_are_not_left_out_silently(mirror):
    scene = swarm.Scene([swarm.Sphere(0.5, restitution=0.5)])
    with pytest.raises(swarm.SceneError, match=r"must apply the restitution, .* got Mirror; its numbers have no"):
        swarm.simulate(scene, swarm.fill(scene, 5, speed=1.0), mirror, until=1.0)


def test_what_a_surface_lacks_for_the_method_is_one_sentence(mirror):
    class Numbers(contract.Smooth):
        side: float

        def phi(self, r):
            return r.x

        def gradient(self, r):
            return Vec(1.0, 0.0, 0.0)

    class Half(swarm.Sphere):
        def walls(self):
            return (Numbers(1.0),)

    scene = swarm.Scene([Half(1.0)])
    with pytest.raises(swarm.SceneError, match=r"what Mirror without gravity needs, .*Numbers without first_hit\(\)"):
        swarm.simulate(scene, swarm.Particles((-0.5, 0, 0), (0, 0, 0)), mirror, until=1.0)
