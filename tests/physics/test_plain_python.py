"""Compiled kernels against the same functions in plain Python."""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.physics

_SCRIPT = """
import numpy as np, swarm
np.seterr(all="ignore")
ball = swarm.Sphere(0.2, (0.05, 0.0, 0.1), side="outside")
for surfaces, method, gravity in (
    ([swarm.Sphere(0.5)], swarm.Impact(), None),
    ([swarm.Ellipsoid((0.3, 0.4, 0.6)), ball], swarm.Impact(contact_step=1e-3), None),
    ([swarm.Sphere(0.5), swarm.Plane((0, 0, -1), 0.2)], swarm.Penalty(0.0625, 1e3), (0.0, 0.0, -1.0)),
):
    scene = swarm.Scene(surfaces, gravity=gravity)
    result = swarm.simulate(scene, swarm.fill(scene, 5, speed=1.0, seed=1), method, until=4.0, every=1.0, threads=1)
    print(result.particles.position.tobytes().hex(), result.particles.velocity.tobytes().hex())
    for name, column in sorted(result.observables.items()):
        print(name, column.tobytes().hex())
"""


def _output(**environment):
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT], env={**os.environ, **environment}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def test_the_compiler_changes_no_bit():
    """Strict IEEE arithmetic without contraction: NUMBA_DISABLE_JIT=1 gives the same numbers."""
    assert _output(NUMBA_DISABLE_JIT="1") == _output()
