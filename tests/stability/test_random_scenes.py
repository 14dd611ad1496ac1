"""Random numbers in scenes of a few kinds: a run ends with all its invariants, or with a sentence.

Each new kind of scene costs a compilation: tests/long/test_random_kinds.py draws kinds, lists and gravity.
"""

import functools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from stability.random_scenes import NUMBER, outcome

import swarm

pytestmark = pytest.mark.physics

parts = st.floats(-1.0, 1.0).map(lambda part: round(part, 3))
# No smaller cavities: 8 particles of 30 m/s fly 4 s.
lengths = st.sampled_from([0.01, 0.1, 0.5, 1.0, 2.0])
thicknesses = st.sampled_from([1e-9, 1e-4, 0.01, 0.1, 0.5])
points = st.tuples(parts, parts, parts)
speeds = st.sampled_from([0.0, 1e-6, 0.3, 1.0, 30.0])
seeds = st.integers(0, 1000)


@given(axes=st.tuples(lengths, lengths, lengths), center=points, tilt=parts, half=thicknesses, speed=speeds, seed=seeds)
def test_a_plate_in_an_ellipsoid(axes, center, tilt, half, speed, seed):
    """Some are full, some are cut in two, some are not met at all."""

    def make():
        scene = swarm.Scene([swarm.Slab((1.0, tilt, 0.5), half, center, "outside"), swarm.Ellipsoid(axes)])
        return scene, swarm.fill(scene, NUMBER, speed=speed, seed=seed), swarm.Impact()

    outcome(make)


steps = st.sampled_from([2.0**-10, 2.0**-8, 2.0**-6, 2.0**-3, 0.3])
stiffness = st.sampled_from([1e-2, 1.0, 1e4, 1e8])
softs = st.sampled_from([swarm.Penalty, swarm.Verlet, swarm.Midpoint, swarm.Trapezoidal])
methods = st.builds(swarm.Impact) | st.builds(lambda cls, *numbers: cls(*numbers), softs, steps, stiffness)


@given(radius=lengths, center=points, speed=speeds, seed=seeds, method=methods)
def test_a_sphere_by_every_method(radius, center, speed, seed, method):
    """Stiff and soft, long and short steps, fast and slow; every method but multipliers."""

    def make():
        scene = swarm.Scene([swarm.Sphere(radius, center)])
        return scene, swarm.fill(scene, NUMBER, speed=speed, mass=np.linspace(0.5, 2.0, NUMBER), seed=seed), method

    outcome(make)


def filled(axes, center, seed):
    scene = swarm.Scene([swarm.Slab((1.0, 0.2, -0.4), 0.1, center, "outside"), swarm.Ellipsoid(axes)])
    return scene, swarm.fill(scene, NUMBER, speed=1.0, seed=seed), swarm.Impact()


def test_most_of_them_fly():
    """One hundred of the same kinds: most end, and the sentences of the others say that there is no room."""
    random = np.random.default_rng(5)
    sentences = []
    for seed in range(100):
        axes, center = tuple(10.0 ** random.uniform(-2.0, 0.3, 3)), tuple(random.uniform(-1.0, 1.0, 3))
        sentences.append(outcome(functools.partial(filled, axes, center, seed)))
    assert sentences.count("") >= 50
    assert all("volume" in sentence for sentence in sentences if sentence), set(sentences)
