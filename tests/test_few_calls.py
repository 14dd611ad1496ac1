"""What a run calls before it computes: a bound of the work that a small run begins with."""

import subprocess
import sys
from collections import Counter
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

import swarm

pytestmark = pytest.mark.quick

# Calls of Python functions from `simulate` to the first step of twenty particles in a sphere, at most, and of how many
# functions by name.
_MOST, _MOST_NAMES = 900, 250


def test_a_small_run_calls_few_functions_before_its_first_kernel() -> None:
    scene = swarm.Scene([swarm.Sphere(0.5)])
    particles = swarm.fill(scene, 20, speed=1.0)
    _run(scene, particles)
    calls: Counter[str] = Counter()
    stepped = False

    def count(frame: FrameType, event: str, _argument: Any) -> None:
        nonlocal stepped
        stepped = stepped or frame.f_code.co_name == "advance_block"
        if event == "call" and not stepped:
            calls[frame.f_code.co_name] += 1

    fresh = swarm.Scene([swarm.Sphere(0.5)])
    sys.setprofile(count)
    try:
        _run(fresh, particles)
    finally:
        sys.setprofile(None)
    assert stepped
    assert 100 < calls.total() <= _MOST, calls.most_common(20)
    assert len(calls) <= _MOST_NAMES, sorted(calls)


_SCENE = """
surface = [{kind = "sphere", radius = 0.5}]
particles = {count = 20, speed = 1.0}
run = {until = 1.0}
"""
# What takes time to import, and a run of few points in a sphere does not need.
_NEEDLESS = {
    "numba", "psutil", "numpy.ma", "importlib.metadata", "rich", "swarm.words", "swarm.surfaces.balls.joined_rooms",
    "swarm.surfaces.data.sampled", "swarm.surfaces.formulas", "swarm.surfaces.presence.seams", "swarm.methods.penalty",
    "swarm.surfaces.shapes.torus",
}  # fmt: skip
_COMMAND = """
import sys, swarm.__main__
try: swarm.__main__.main()
except SystemExit: pass
print(*sys.modules)
"""


def test_a_small_run_imports_only_what_its_scene_has(tmp_path: Path) -> None:
    """It takes as long to import as to run."""
    (tmp_path / "scene.toml").write_text(_SCENE)
    words = ["run", "scene.toml", "--quiet", "--compile", "never"]
    done = subprocess.run([sys.executable, "-c", _COMMAND, *words], cwd=tmp_path, stdout=subprocess.PIPE, check=True)
    imported = done.stdout.decode().split()
    assert (tmp_path / "scene.h5").exists()
    assert _NEEDLESS & set(imported) == set()
    assert len([name for name in imported if name.startswith("swarm.")]) <= 300


def _run(scene: swarm.Scene, particles: swarm.Particles) -> None:
    swarm.simulate(scene, particles, swarm.Impact(), until=0.1, compile="never")
