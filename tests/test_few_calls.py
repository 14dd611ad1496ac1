"""What a run calls before it computes: a bound of the work that a small run begins with."""

import sys
from collections import Counter
from types import FrameType
from typing import Any

import swarm

# Calls of Python functions from `simulate` to the first step of twenty particles in a sphere, at most.
_MOST = 900


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


def _run(scene: swarm.Scene, particles: swarm.Particles) -> None:
    swarm.simulate(scene, particles, swarm.Impact(), until=0.1, compile="never")
