"""Random lists of all kinds of surfaces, gravity or none, any method: invariants, or a sentence.

Each scene compiles kernels of its own, ten seconds and more. See tests/stability/test_random_scenes.py.
"""

import numpy as np
import pytest
from conftest import METHODS, SURFACES
from hypothesis import event, given, settings
from hypothesis import strategies as st
from stability.random_scenes import NUMBER, outcome

import swarm

pytestmark = pytest.mark.long

KINDS = {
    **SURFACES,
    "box": lambda s=1.0: swarm.Box((0.5 * s, 0.6 * s, 0.4 * s)),
    "askew": lambda s=1.0: swarm.Box((0.5 * s, 0.6 * s, 0.4 * s), rotation=(0.9, 0.1, 0.3, 0.2), side="outside"),
    "can": lambda s=1.0: swarm.Cylinder(0.5 * s, (1.0, 0.5, -1.0), 0.9 * s),
    "pipe": lambda s=1.0: swarm.Cylinder(0.3 * s, (0.0, 0.0, 1.0)),
    "slab": lambda s=1.0: swarm.Slab((0.0, 1.0, 0.3), 0.4 * s),
    "cone": lambda s=1.0: swarm.Cone(0.6),
    "paraboloid": lambda s=1.0: swarm.Paraboloid(0.2 * s),
}
# Every list has a cavity of all sides, so that most hold something.
cavities = st.sampled_from(["sphere", "ellipsoid", "box", "can", "torus", "capsule", "formula", "rotated ellipsoid"])
# How large each is beside the first.
sizes = st.sampled_from([0.2, 0.5, 1.0, 2.0])
gravities = st.none() | st.tuples(*[st.sampled_from([-9.81, -0.3, 0.0, 1.0])] * 3)


@settings(max_examples=60)
@given(
    cavity=cavities,
    others=st.lists(st.tuples(st.sampled_from(sorted(KINDS)), sizes), max_size=2),
    gravity=gravities,
    method=st.sampled_from(sorted(METHODS)),
    restitution=st.sampled_from([1.0, 1.0, 0.8]),
    speed=st.sampled_from([0.0, 0.3, 3.0]),
    seed=st.integers(0, 1000),
)
def test_random_scenes(cavity, others, gravity, method, restitution, speed, seed):
    def make():
        walls = [KINDS[cavity](2.0), *(KINDS[kind](size) for kind, size in others)]
        scene = swarm.Scene(walls, gravity=gravity)
        masses = np.linspace(0.5, 2.0, NUMBER)
        return scene, swarm.fill(scene, NUMBER, speed=speed, mass=masses, seed=seed), METHODS[method]

    sentence = outcome(make)
    event(sentence[:60] or "ends")
