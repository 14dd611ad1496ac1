"""What is said while kernels compile, in words, for their names are of the code."""

import gc
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

import swarm
from swarm.kernel import cache, deferred
from swarm.kernel.compiling import Compilations
from swarm.run import machine


def test_the_compiler_is_frozen_where_the_imports_are(monkeypatch):
    """A command freezes its imports, and then nothing looks through the compiler; a user's process stays as it is."""
    for frozen in (True, False):
        monkeypatch.setattr(deferred, "_loaded", [])
        (gc.freeze if frozen else gc.unfreeze)()
        before, fresh = gc.get_freeze_count(), [[]]
        deferred.compiler()
        assert fresh == [[]]
        assert (gc.get_freeze_count() > before) is frozen
        assert gc.isenabled()
    gc.freeze()


def named(name):
    return SimpleNamespace(__name__=name)


def test_it_says_what_and_how_far(monkeypatch):
    """What slides on the way needs more kernels than the run knew of."""
    done = set()
    monkeypatch.setattr(cache, "is_compiled", lambda kernel, arguments: kernel.__name__ in done)
    compilations, needed = Compilations(), ["advance_block", "observe"]
    compilations.calls = lambda: [(named(name), ()) for name in needed]
    sentences = []
    for name in ("advance_block", "observe", "slide_block", "careful_block", "mine"):
        if name == "slide_block":
            needed += ["slide_block", "careful_block"]
        sentences.append(compilations.sentence(named(name)))
        done.add(name)
    assert [sentence.removesuffix(" for this kind of scene, once") for sentence in sentences] == [
        "compiling the kernel of flights and impacts (1 of 2)",
        "compiling the kernel of energies and momenta (2 of 2)",
        "compiling the kernel of sliding (3 of 4)",
        "compiling the kernel of corners (4 of 4)",
        "compiling the kernel mine (5 of 5)",
    ]


@pytest.mark.parametrize("run", ["particles", "bodies", "reacting", "balls"])
def test_every_kernel_of_a_run_has_words(run):
    import swarm
    from swarm.kernel import compiling
    from swarm.run.machine import run_of
    from swarm.run.options import RunOptions
    from swarm.run.preflight.admission import task_of

    walls = [swarm.Plane((0.0, 0.0, -1.0), 0.0), swarm.Sphere(0.5)]
    walls[0] = walls[0] if run != "reacting" else swarm.Plane((0.0, 0.0, -1.0), 0.0, mass=1.0)
    scene = swarm.Scene(walls, None if run == "reacting" else (0.0, 0.0, -9.81))
    start, method = swarm.Particles((0.0, 0.0, 0.1), (1.0, 0.0, 0.0)), swarm.Impact()
    if run == "balls":
        start.radius = np.array([0.01])
    if run == "bodies":
        start, method = swarm.place(scene, swarm.dumbbell(0.1, 1.0), 1), swarm.Impact(dt=1e-2)
    with run_of(task_of(scene, start, method, RunOptions(until=1.0, compile="never"))) as made:
        if run == "particles":
            made._kinds = {1, 2, 4, 5}
        names = {kernel.__name__ for kernel, _arguments in made.calls()}
    assert names <= compiling._WORDS.keys()


def test_a_compilation_takes_long_for_walls_only_where_there_are_some():
    rough = swarm.Box((0.1, 0.1, 0.1), friction=0.5, motion=swarm.Rotation((0.0, 0.0, 1.0), 1.0), side="outside")
    cavity = swarm.Sphere(1.0, friction=0.5)
    assert machine._why_slow(swarm.Scene([cavity, rough])) == ""
    assert machine._why_slow(swarm.Scene([cavity, rough, rough])).startswith("each of the 2 walls that move ")


def test_a_compilation_that_takes_long_is_a_warning(monkeypatch, caplog):
    """Once, while it goes on; one that has ended warns of nothing."""
    monkeypatch.setattr(cache, "LONG", 0.01)
    with cache.kernels_compiled(lambda sentence: None, why="walls are many"):
        listener = cache.listeners[-1]
        listener.begins(named("sin"), True)
        while not caplog.messages:
            time.sleep(0.01)
        listener.ends()
        assert caplog.messages == ["compiling a kernel, once: sin: it takes more than 10 s so far; walls are many"]
        monkeypatch.setattr(cache, "LONG", 60.0)
        before = set(threading.enumerate())
        listener.begins(named("cos"), True)
        (waiting,) = set(threading.enumerate()) - before
        listener.ends()
        waiting.join(10.0)
        assert not waiting.is_alive()
    assert len(caplog.messages) == 1
