"""Random scenes: a run ends with all the invariants of its method, or with a sentence that says why not.

Each new kind of scene costs a compilation, so the physics ring draws numbers in scenes of a few kinds, the long ring
kinds, lists and gravity.
"""

import dataclasses
import functools
import math

import numpy as np
import pytest
from conftest import METHODS, SURFACES
from hypothesis import event, given, settings
from hypothesis import strategies as st

import swarm

# Particles and time: some tens of impacts each.
NUMBER, UNTIL = 8, 4.0


def outcome(make, compile="auto"):
    """`make()` is (scene, particles, method): the error's sentence, or "" and the invariants of the method."""
    try:
        scene, particles, method = make()
        result = swarm.simulate(scene, particles, method, until=UNTIL, every=UNTIL / 4.0, compile=compile)
    except swarm.SwarmError as error:
        sentence = str(error)
        assert len(sentence.split()) > 5, sentence
        return sentence
    assert np.isfinite(result.particles.position).all()
    assert np.isfinite(result.particles.velocity).all()
    assert result.observables["time"][-1] == UNTIL
    holds(scene, particles, method, result.observables)
    return ""


def holds(scene, particles, method, seen):
    """The bars of each method."""
    depth, reach = seen["max_penetration"].max(), scene.extent()
    if isinstance(method, swarm.Impact):
        assert seen["energy_error"].max() <= 1e-12
        assert depth <= 64.0 * np.spacing(reach)
    elif isinstance(method, swarm.AugmentedLagrangian):
        # Each contact misses lambda Phi1, with lambda = 2 m v/dt and Phi1 <= sqrt(2 tolerance/alpha).
        assert seen["energy_error"].max() <= 1e-9
        assert depth <= 1e-9 * reach
    elif isinstance(method, swarm.Penalty):
        assert seen["energy_error"].max() <= 1e-10
    else:
        # Baselines promise nothing, but a number.
        assert math.isfinite(seen["energy_error"].max())


# --- Random numbers --------------------------------------------------------------------------------------

parts = st.floats(-1.0, 1.0).map(lambda part: round(part, 3))
# No smaller cavities: 8 particles of 30 m/s fly 4 s.
lengths = st.sampled_from([0.01, 0.1, 0.5, 1.0, 2.0])
thicknesses = st.sampled_from([1e-9, 1e-4, 0.01, 0.1, 0.5])
points = st.tuples(parts, parts, parts)
speeds = st.sampled_from([0.0, 1e-6, 0.3, 1.0, 30.0])
seeds = st.integers(0, 1000)


@pytest.mark.physics
@given(axes=st.tuples(lengths, lengths, lengths), center=points, tilt=parts, half=thicknesses, speed=speeds, seed=seeds)
def test_a_plate_in_an_ellipsoid(axes, center, tilt, half, speed, seed):
    """The plate fills the cavity, cuts it in two, or misses it."""

    def make():
        scene = swarm.Scene([swarm.Slab((1.0, tilt, 0.5), half, center, "outside"), swarm.Ellipsoid(axes)])
        return scene, swarm.fill(scene, NUMBER, speed=speed, seed=seed), swarm.Impact()

    outcome(make, "always")


steps = st.sampled_from([2.0**-10, 2.0**-8, 2.0**-6, 2.0**-3, 0.3])
stiffness = st.sampled_from([1e-2, 1.0, 1e4, 1e8])
softs = st.sampled_from([swarm.Penalty, swarm.Verlet, swarm.Midpoint, swarm.Trapezoidal])
soft_or_rigid = st.builds(swarm.Impact) | st.builds(lambda cls, *numbers: cls(*numbers), softs, steps, stiffness)


@pytest.mark.physics
@given(radius=lengths, center=points, speed=speeds, seed=seeds, method=soft_or_rigid)
def test_a_sphere_by_every_method(radius, center, speed, seed, method):
    """Stiff and soft, long and short steps, fast and slow; every method but multipliers."""

    def make():
        scene = swarm.Scene([swarm.Sphere(radius, center)])
        return scene, swarm.fill(scene, NUMBER, speed=speed, mass=np.linspace(0.5, 2.0, NUMBER), seed=seed), method

    outcome(make)


def filled(axes, center, seed):
    scene = swarm.Scene([swarm.Slab((1.0, 0.2, -0.4), 0.1, center, "outside"), swarm.Ellipsoid(axes)])
    return scene, swarm.fill(scene, NUMBER, speed=1.0, seed=seed), swarm.Impact()


@pytest.mark.physics
def test_most_of_them_fly():
    """One hundred of the same kinds: most end, and the errors of the others say that there is no volume."""
    random = np.random.default_rng(5)
    sentences = []
    for seed in range(100):
        axes, center = tuple(10.0 ** random.uniform(-2.0, 0.3, 3)), tuple(random.uniform(-1.0, 1.0, 3))
        sentences.append(outcome(functools.partial(filled, axes, center, seed), "always"))
    assert sentences.count("") >= 50
    assert all("volume" in sentence for sentence in sentences if sentence), set(sentences)


# --- Random kinds ----------------------------------------------------------------------------------------

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
# With a tolerance at round-off, as one reflection does not solve two walls at one place (two equal capsules, say): at
# 1e-10 such an impact misses 7e-5 of its energy.
RANDOM_METHODS = {
    **METHODS,
    "augmented Lagrangian": dataclasses.replace(METHODS["augmented Lagrangian"], tolerance=1e-24),
}
# Every list has a closed cavity, so that most have an admissible volume.
cavities = st.sampled_from(["sphere", "ellipsoid", "box", "can", "torus", "capsule", "formula", "rotated ellipsoid"])
# The size of each relative to the first.
sizes = st.sampled_from([0.2, 0.5, 1.0, 2.0])
gravities = st.none() | st.tuples(*[st.sampled_from([-9.81, -0.3, 0.0, 1.0])] * 3)


@pytest.mark.long
@settings(max_examples=60)
@given(
    cavity=cavities,
    others=st.lists(st.tuples(st.sampled_from(sorted(KINDS)), sizes), max_size=2),
    gravity=gravities,
    method=st.sampled_from(sorted(RANDOM_METHODS)),
    restitution=st.sampled_from([1.0, 1.0, 0.8]),
    speed=st.sampled_from([0.0, 0.3, 3.0]),
    seed=st.integers(0, 1000),
)
def test_random_kinds(cavity, others, gravity, method, restitution, speed, seed):
    def make():
        walls = [KINDS[cavity](2.0), *(KINDS[kind](size) for kind, size in others)]
        scene = swarm.Scene(walls, gravity=gravity)
        masses = np.linspace(0.5, 2.0, NUMBER)
        return scene, swarm.fill(scene, NUMBER, speed=speed, mass=masses, seed=seed), RANDOM_METHODS[method]

    sentence = outcome(make)
    event(sentence[:60] or "ends")
