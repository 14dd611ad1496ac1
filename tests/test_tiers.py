"""Two tiers with the same bits: which of them a run is in, and where it may change from one to the other."""

import os
from typing import NamedTuple

import numba
import numpy as np
import pytest
from children import python
from conftest import METHODS, SURFACES, every_surface

import swarm
from swarm.kernel import cache
from swarm.run import tiers
from swarm.run.admission import task_of
from swarm.run.bodies import BodyRun
from swarm.run.engine import Run
from swarm.run.options import RunOptions

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
    plain = end_of(Run(scene, start.copy(), method, 1, None, "never"), span)
    assert end_of(Run(scene, start.copy(), method, 1, None, "always"), span) == plain
    monkeypatch.setattr(cache, "is_compiled", lambda *call: False)
    for passes in (1, 7):
        run = Run(scene, start.copy(), method, 1, None, "auto")
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


@compiled_only
def test_what_is_not_done_in_time_goes_on_compiled(monkeypatch):
    """Here there is next to no time, and the kernels are told to be nowhere."""
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
    run = Run(SPHERE, swarm.fill(SPHERE, 20, speed=1.0), swarm.Impact(), 2, None, compile)
    assert run._tier.is_plain == plain


@compiled_only
def test_bodies_that_are_compiled_later_have_as_many_lanes(monkeypatch):
    """One was left of the start in plain Python: four times the time of a whole run."""
    bodies = swarm.place(SPHERE, swarm.dumbbell(0.2, 1.0), 40, speed=1.0, seed=1)
    made, task = [], task_of(SPHERE, bodies, swarm.Impact(dt=0.01), RunOptions(until=1.0))
    for found in (True, False):
        monkeypatch.setattr(cache, "is_compiled", lambda *call, found=found: found)
        made.append(BodyRun(SPHERE, bodies, task.particles, task.method, 1, None, "auto"))
    compiled, later = made
    assert (compiled._tier.is_plain, later._tier.is_plain) == (False, True)
    assert compiled._rule.lanes > later._rule.lanes == 1
    later._tier.remaining = 0.0
    later._choose_tier()
    assert later._rule.lanes == compiled._rule.lanes


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
        (SURFACES["rotated egg"](), METHODS["augmented Lagrangian"], True),
        (SURFACES["formula"](), METHODS["impact"], True),
        (swarm.Formula("x**2 + y**2 + sqrt(z**2 + 1) - 1.5"), METHODS["impact"], True),
        (swarm.Formula("x**2 + y**2 + cosh(z) - 2"), METHODS["impact"], False),
        (swarm.Formula("x**2 + y**2 + (z**2 + 1)**(1/3) - 1.5"), METHODS["impact"], False),
        (swarm.OwnSurface(Radius(0.5), phi, slope, size=0.5, curvature=2.0), METHODS["impact"], False),
        (SURFACES["sphere"](), swarm.Penalty(dt=1e-3, penalty=1e4, exponent=1.5), True),
        (SURFACES["sphere"](), swarm.Penalty(dt=1e-3, penalty=1e4, exponent=2.0), False),
        (SURFACES["sphere"](), swarm.AugmentedLagrangian(dt=1e-3, penalty=1e4, exponent=2.0), False),
    ],
)
def test_functions_of_a_library_are_called_in_one_tier_only(surface, method, same):
    """Their last bit may differ, and the result must not depend on the time at which a run changes its tier."""
    scene = swarm.Scene([surface])
    assert tiers._same_bits((method.numbers(scene), method.law(), scene.walls())) == same


FOUND = """
import logging, swarm
from swarm.kernel import cache
from swarm.run.engine import Run
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
    told = {}
    for k, compile in enumerate(("auto", "always", "auto")):
        done = python("-c", FOUND.format(compile=compile), env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)})
        assert done.returncode == 0, done.stderr
        told[k] = done.stdout.strip(), "compiling the kernel of flights and impacts (1 of 2)" in done.stderr
    assert told == {0: ("[False, False]", False), 1: ("[False, False, True, False]", True), 2: ("[True, True]", False)}


def test_another_word_is_refused():
    with pytest.raises(swarm.SceneError, match="compile must be one of 'auto', 'always' and 'never', got 'alwyas'"):
        swarm.simulate(SPHERE, swarm.fill(SPHERE, 2, speed=1.0), swarm.Impact(), until=1.0, compile="alwyas")


@compiled_only
def test_while_another_process_compiles_a_run_goes_on_in_plain_python(monkeypatch):
    monkeypatch.setattr(cache, "kind", lambda *call: call)
    monkeypatch.setattr(cache, "is_compiled", lambda *call: False)
    for waits in (True, False):
        monkeypatch.setattr(cache, "is_being_compiled", lambda *call, waits=waits: waits)
        tier = tiers.Tier("auto", (), 3)
        tier.remaining = -1.0
        assert tier.choose([(None, ())]) is not waits
        assert tier.is_plain is waits
        assert (tier.remaining > 0.0) is waits
    # Not for ever, and never where plain Python has other bits or does too little.
    monkeypatch.setattr(cache, "is_being_compiled", lambda *call: True)
    tier = tiers.Tier("auto", (), 3)
    tier.remaining, tier._latest = -1.0, 0.0
    assert tier.choose([(None, ())])
    many = tiers.Tier("auto", (), 1_000_000)
    many.choose([(None, ())])
    assert not many.is_plain
