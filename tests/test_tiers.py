"""Two tiers with the same bits: which of them a run is in, and where it may change from one to the other."""

import os
import subprocess
import sys
from typing import NamedTuple

import numba
import numpy as np
import pytest
from children import python
from conftest import METHODS, SPENT, SURFACES, every_surface

import swarm
from swarm.bodies.body_run import BodyRun
from swarm.kernel import cache
from swarm.run import tiers
from swarm.run.engine import Run
from swarm.run.machine import run_of
from swarm.run.options import RunOptions
from swarm.run.preflight.admission import task_of

compiled_only = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set: there is one tier")
SPHERE = swarm.Scene([swarm.Sphere(0.5)])


def start_in(scene):
    """Three particles: anywhere in a cavity, or on their way to a solid."""
    if not scene.is_open():
        return swarm.fill(scene, 3, speed=1.0, seed=1)
    position = np.random.default_rng(1).normal(size=(3, 20))
    position = (2.0 * position / np.linalg.norm(position, axis=0))[:, :3]
    inside = scene.gaps(position).max(axis=0) < 0.0
    return swarm.Particles(position[:, inside], -position[:, inside])


def end_of(run, span):
    with run:
        while not run.advance(span, 1.0):
            pass
        return [array.tobytes() for array in run.arrays().values()], repr(run.seen())


def assert_same_bits(monkeypatch, scene, method):
    """In plain Python, compiled, and wherever a run changes from one to the other: after one pass, or after seven."""
    start, span = start_in(scene), method.span("until", 2.0)
    plain = end_of(Run(scene.compiled(), start.copy(), method, 1, None, "never"), span)
    assert end_of(Run(scene.compiled(), start.copy(), method, 1, None, "always"), span) == plain
    monkeypatch.setattr(cache, "is_compiled", lambda *call: False)
    for passes in (1, 7):
        run = Run(scene.compiled(), start.copy(), method, 1, None, "auto")
        run.halt(passes)
        if not run.advance(span, 1.0):
            run._tier.remaining = 0.0
        assert end_of(run, span if run._tier.remaining == 0.0 else 0.0)[0] == plain[0]


@pytest.mark.physics
@compiled_only
@every_surface
def test_both_tiers_have_the_same_bits_in_every_surface(monkeypatch, name):
    """With every method: physics/test_methods.py. Function by function, every surface: test_jit.py."""
    assert_same_bits(monkeypatch, swarm.Scene([SURFACES[name]()]), METHODS["impact"])


@pytest.mark.level3
@compiled_only
def test_what_is_not_done_in_time_goes_on_compiled(monkeypatch):
    """Here there is next to no time, and no kernel is found."""
    start = swarm.fill(SPHERE, 20, speed=1.0, seed=1)
    whole = swarm.simulate(SPHERE, start, swarm.Impact(), until=10.0, every=5.0, compile="always")
    monkeypatch.setattr(cache, "is_compiled", lambda *call: False)
    monkeypatch.setattr(tiers, "_PATIENCE", 1e-9)
    tiers_of_frames, advance = [], Run.advance

    def noted(run, *about):
        done = advance(run, *about)
        tiers_of_frames.append(run._tier.is_plain)
        return done

    monkeypatch.setattr(Run, "advance", noted)
    other = swarm.simulate(SPHERE, start, swarm.Impact(), until=10.0, every=5.0)
    assert not tiers_of_frames[-1]
    assert np.array_equal(other.particles.velocity, whole.particles.velocity)
    assert np.array_equal(other.observables["angular_momentum"], whole.observables["angular_momentum"])


@compiled_only
@pytest.mark.parametrize(
    ("compile", "found", "plain"),
    [("auto", False, True), ("auto", True, False), ("always", False, False), ("never", True, True)],
)
def test_the_tier_at_the_start(monkeypatch, compile, found, plain):
    monkeypatch.setattr(cache, "is_compiled", lambda *call: found)
    run = Run(SPHERE.compiled(), swarm.fill(SPHERE, 20, speed=1.0), swarm.Impact(), 2, None, compile)
    assert run._tier.is_plain == plain


@compiled_only
def test_bodies_are_compiled_at_once_and_have_lanes_there_alone():
    """With one lane they took four times as long."""
    bodies = swarm.place(SPHERE, swarm.dumbbell(0.2, 1.0), 40, speed=1.0, seed=1)
    task = task_of(SPHERE, bodies, swarm.Impact(dt=0.01), RunOptions(until=1.0))
    given = task.compiled, (bodies, task.particles), task.method
    runs = [BodyRun(*given, 1, None, choice) for choice in ("auto", "never")]
    assert [run._tier.is_plain for run in runs] == [False, True]
    assert runs[0]._rule.lanes > runs[1]._rule.lanes == 1


@compiled_only
def test_many_particles_are_compiled_at_once(monkeypatch):
    monkeypatch.setattr(cache, "is_compiled", lambda *call: False)
    for n, remaining in ((tiers._FEW, tiers._PATIENCE), (tiers._FEW + 1, 0.0)):
        assert tiers.Tier("auto", (), n).remaining == remaining


class Radius(NamedTuple):
    r: float


def phi(p, x, y, z):
    return x * x + y * y + z * z - p.r * p.r


def slope(p, x, y, z):
    return 2.0 * x, 2.0 * y, 2.0 * z


@pytest.mark.parametrize(
    ("surface", "method", "same"),
    [
        (SURFACES["rotated egg"], METHODS["augmented Lagrangian"], True),
        (SURFACES["formula"], METHODS["impact"], True),
        (lambda: swarm.Formula("x**2 + y**2 + sqrt(z**2 + 1) - 1.5"), METHODS["impact"], True),
        (lambda: swarm.Formula("x**2 + y**2 + cosh(z) - 2"), METHODS["impact"], True),
        (lambda: swarm.Formula("x**2 + y**2 + (z**2 + 1)**(1/3) - 1.5"), METHODS["impact"], True),
        (lambda: swarm.OwnSurface(Radius(0.5), phi, slope, size=0.5, curvature=2.0), METHODS["impact"], False),
        (SURFACES["sphere"], swarm.Penalty(dt=1e-3, penalty=1e4, exponent=1.5), True),
        (SURFACES["sphere"], swarm.Penalty(dt=1e-3, penalty=1e4, exponent=2.0), False),
        (SURFACES["sphere"], swarm.AugmentedLagrangian(dt=1e-3, penalty=1e4, exponent=2.0), False),
    ],
    ids=["egg", "quartic", "sqrt", "cosh", "power", "own", "power of the law", "square", "square, multipliers"],
)
def test_functions_of_a_library_are_called_in_one_tier_only(surface, method, same):
    """Their last bit may differ, and the result must not depend on the time at which a run changes its tier."""
    scene = swarm.Scene([surface()])
    assert tiers._same_bits((method.numbers(scene), method.law(), scene.compiled().walls())) == same


FOUND = """
import logging, swarm
from swarm.kernel import cache, machine_code
from swarm.run.engine import Run
from swarm.run.machine import run_of
found, real = [], cache.is_compiled
cache.is_compiled = lambda *call: found.append(real(*call)) or found[-1]
logging.basicConfig(level="INFO", format="%(message)s")
scene = swarm.Scene([swarm.Sphere(0.5)])
swarm.simulate(scene, swarm.fill(scene, 20, speed=1.0), swarm.Impact(), until=10.0, compile={compile!r})
print(found)
"""


@pytest.mark.physics
@compiled_only
def test_kernels_of_another_process_are_found(tmp_path):
    """By what Numba does not document: this fails when it changes."""
    results = {}
    for k, compile in enumerate(("auto", "always", "auto")):
        done = python("-c", FOUND.format(compile=compile), env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)})
        assert done.returncode == 0, done.stderr
        results[k] = done.stdout.strip(), "compiling the kernel of flights and impacts (1 of 2)" in done.stderr
    assert results == {
        0: ("[False, False]", False),
        1: ("[False, False, True, False]", True),
        2: ("[True, True]", False),
    }


WITHOUT_A_COMPILER = """
import hashlib, sys, swarm
from swarm.run import tiers
tiers._BEFORE_COMPILER, tiers._PATIENCE = {seconds}, 1e4
scene = swarm.Scene([swarm.Sphere(0.5)], gravity=(0.0, 0.0, -1.0))
result = swarm.simulate(scene, swarm.fill(scene, 3, speed=1.0), swarm.Impact(), until=1.0, every=0.1)
print(hashlib.sha256(result.particles.position.tobytes()).hexdigest())
print(any(name in sys.modules for name in ("numba", "llvmlite")))
"""


@compiled_only
def test_a_run_of_few_particles_imports_no_compiler(tmp_path):
    """The compiler is imported after a time of plain Python, here 0 s, some of the run or more than all of it."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    found = [
        subprocess.run(
            [sys.executable, "-c", WITHOUT_A_COMPILER.format(seconds=seconds)],
            env=environment, capture_output=True, text=True, timeout=600,
        )
        for seconds in (0.0, 1e-9, 1e3)
    ]  # fmt: skip
    assert [done.stderr for done in found] == ["", "", ""]
    digests, imports = zip(*(done.stdout.split() for done in found), strict=True)
    assert len(set(digests)) == 1
    assert imports == ("True", "True", "False")


def test_another_word_is_refused():
    with pytest.raises(swarm.SceneError, match="compile must be one of 'auto', 'always' and 'never', got 'alwyas'"):
        swarm.simulate(SPHERE, swarm.fill(SPHERE, 2, speed=1.0), swarm.Impact(), until=1.0, compile="alwyas")


def test_the_first_look_at_balls_ends_plain_python_where_its_time_is_used_up(monkeypatch):
    """In a union each ball takes 0.1 s of it. Other runs of the process know of it."""
    monkeypatch.setattr(tiers, "_spent", {})
    particles = swarm.Particles(np.linspace([-0.4] * 3, [0.4] * 3, 20).T, np.ones((3, 20)), 1.0, None, 0.01)
    task = task_of(swarm.Scene([swarm.Box((0.5, 0.5, 0.5))]), particles, swarm.Impact(), RunOptions(until=1.0))
    calls = []
    with run_of(task) as run:
        run._tier.is_plain, run._tier.remaining, run._tier._missing = True, 0.0, ["begin"]
        monkeypatch.setattr(run, "_call", lambda kernel, *given: calls.append((run._tier.is_plain, *given[-2:])))
        run._in_chunks("begin", "box")
        assert not run._tier.is_plain
    assert calls == [(True, 0, 8), (False, 8, 20)]
    assert tiers._spent["begin"] > 0.0


# --- Plain Python is counted over all runs of a process ------------------------------------------------------------


def tier_of(*kernels, choice="auto"):
    """The tier of a run that calls these kernels; a call stands for its kind."""
    tier = tiers.Tier(choice, (), 3)
    tier.choose([(kernel, ()) for kernel in kernels])
    return tier


@pytest.fixture
def _counted(monkeypatch):
    """No kernel is compiled, and none was missing so far."""
    monkeypatch.setattr(tiers, "_spent", {})
    monkeypatch.setattr(tiers, "spent", SPENT)
    monkeypatch.setattr(tiers, "_PATIENCE", 8.0)
    monkeypatch.setattr(cache, "is_compiled", lambda kernel, arguments: False)


@pytest.fixture
def _named(_counted, monkeypatch):
    monkeypatch.setattr(cache, "kind", lambda kernel, arguments: kernel)


@pytest.mark.usefixtures("_named")
def test_the_time_of_all_runs_of_a_kind_counts():
    for remaining in (8.0, 5.0, 2.0):
        tier = tier_of("fly", "observe")
        assert tier.is_plain
        assert tier.remaining == remaining
        tier.spend(3.0)
    assert not tier_of("fly", "observe").is_plain


@pytest.mark.usefixtures("_named")
def test_other_kinds_have_time_of_their_own():
    tier_of("fly", "observe").spend(7.0)
    # What both need is missing for longer: it is compiled with what is used as long.
    assert tier_of("other", "observe").remaining == 8.0
    assert tier_of("fly").remaining == 1.0
    # A run that meets another kind has no more time than it had.
    tier = tier_of("fly")
    tier.choose([("fly", ()), ("slide", ())])
    assert tier.remaining == 1.0


@pytest.mark.usefixtures("_named")
@pytest.mark.parametrize(("choice", "plain"), [("always", False), ("never", True)])
def test_what_is_chosen_by_hand_counts_nothing(choice, plain):
    tier_of("fly").spend(20.0)
    tier = tier_of("fly", choice=choice)
    assert tier.is_plain is plain
    tier.spend(20.0)
    assert SPENT(["fly"]) == 20.0


@pytest.mark.usefixtures("_named")
def test_what_runs_compiled_counts_nothing(monkeypatch):
    monkeypatch.setattr(cache, "is_compiled", lambda kernel, arguments: True)
    tier_of("fly").spend(20.0)
    assert SPENT(["fly"]) == 0.0


@compiled_only
@pytest.mark.usefixtures("_counted")
def test_the_second_run_is_compiled_from_the_start(monkeypatch):
    """By the time that `Run` books: here any time is enough."""
    monkeypatch.setattr(tiers, "_PATIENCE", 1e-9)
    start = swarm.fill(SPHERE, 3, speed=1.0, seed=1)
    with Run(SPHERE.compiled(), start.copy(), swarm.Impact(), 1, None, "auto") as run:
        assert run._tier.is_plain
        run.observe()
    assert not Run(SPHERE.compiled(), start.copy(), swarm.Impact(), 1, None, "auto")._tier.is_plain


@compiled_only
@pytest.mark.usefixtures("_counted")
def test_runs_of_other_sizes_are_of_the_same_kind():
    def missing(radius, method):
        scene = swarm.Scene([swarm.Sphere(radius)])
        return set(Run(scene.compiled(), swarm.Particles((0, 0, 0), (1, 0, 0)), method, 1, None, "auto")._tier._missing)

    first = missing(0.5, swarm.Impact())
    assert len(first) == 2
    assert first == missing(0.7, swarm.Impact())
    assert not first & missing(0.5, swarm.Penalty(dt=1e-3, penalty=1e4))
