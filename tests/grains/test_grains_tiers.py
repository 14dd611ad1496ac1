"""Compiled kernels and plain Python have the same bits."""

import numba
import pytest
from conftest import rarely
from grains_runs import cloud, ran

import swarm

LAWS = {"restitution": 0.6, "friction": 0.4}
BOX = ((3.2, 3.2, 3.2), (2.5, 2.5, 2.5))
SHAKEN = swarm.Box(*BOX, motion=swarm.Oscillation((0.0, 0.1, 0.2), 3.0), **LAWS)
TURN = swarm.Rotation((0.0, 1.0, 0.0), 2.0, (1.5, 1.5, 1.5))
TURNED = swarm.Cylinder(5.5, (0.0, 1.0, 0.0), 7.0, (1.5, 1.5, 1.5), motion=TURN, **LAWS)
SCENES = {
    "smooth box": (swarm.Scene([swarm.Box(*BOX)]), 1.5),
    "rough box that shakes": (swarm.Scene([SHAKEN], (0.0, 0.0, -3.0), pairs=swarm.Pairs(**LAWS)), 1.0),
    "drum": (swarm.Scene([TURNED], (0.0, 0.0, -3.0), pairs=swarm.Pairs(**LAWS)), 1.5),
    "cell": (swarm.Scene([], period=(4.0, 4.0, 4.0), pairs=swarm.Pairs(restitution=0.8)), 1.0),
}


@pytest.mark.level3
@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled")
@pytest.mark.parametrize("name", ["smooth box", "drum", *map(rarely, ("rough box that shakes", "cell"))])
def test_compiled_kernels_have_the_same_bits(name):
    scene, exponent = SCENES[name]
    method = swarm.Penalty(0.004, 400.0, exponent)
    one, other = (ran(scene, cloud(), method, 0.2, compile=compile) for compile in ("always", "never"))
    assert one.observables["collisions"][-1] > 10
    for key in ("position", "velocity", "spin"):
        a, b = getattr(one.particles, key), getattr(other.particles, key)
        assert a is b is None or (a == b).all()
    for key, values in one.observables.items():
        assert (values == other.observables[key]).all() or key in ("pressure", "collision_rate"), key
