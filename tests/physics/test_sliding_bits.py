"""Slides, rests and edges have the same bits for every thread and block, and for a run that is stopped in them."""

import numpy as np
import pytest
from conftest import rarely
from test_sessions import require_resumed_is_whole

import swarm

pytestmark = pytest.mark.physics

DOWN = (0.0, 0.0, -9.81)
SCENES = {
    "bowl": swarm.Scene([swarm.Sphere(0.5, restitution=0.5)], DOWN),
    "bowl with friction": swarm.Scene([swarm.Sphere(0.5, restitution=0.5, friction=0.3)], DOWN),
    # Floor, wall and the edge between them.
    "vessel": swarm.Scene([swarm.Cylinder(0.5, length=1.0, restitution=0.5)], DOWN),
    # What comes to slide on the ball leaves it.
    "ball in a sphere": swarm.Scene(
        [swarm.Sphere(0.5, restitution=0.5), swarm.Sphere(0.2, (0.05, 0.0, -0.1), "outside", restitution=0.5)], DOWN
    ),
}


def start_of(scene, n):
    """Some fly, some start at rest, in the same places."""
    start = swarm.fill(scene, n, speed=1.0, seed=5)
    start.velocity = start.velocity * (np.arange(n) % 3 > 0)
    return start


def bits(scene, **keywords):
    result = swarm.simulate(
        scene, start_of(scene, 600), swarm.Impact(), until=1.0, every=0.25, compile="always", **keywords
    )
    assert result.observables["sliding"][-1] > 0
    assert result.observables["sliding_time"][-1] > 100.0
    assert result.observables["max_penetration"].max() <= 4.0 * np.spacing(0.5)
    seen = [result.observables[name] for name in ("sliding", "impacts", "dissipated_energy")]
    arrays = [result.particles.position, result.particles.velocity, result.impacts_per_particle, *seen]
    return [np.asarray(array).tobytes() for array in arrays]


@pytest.mark.parametrize("name", ["bowl", *map(rarely, list(SCENES)[1:])])
def test_threads_and_blocks(name):
    expected = bits(SCENES[name], threads=1)
    for keywords in ({"threads": 2}, {"threads": 2, "block_size": 1}, {"threads": 1, "block_size": 10**6}):
        assert bits(SCENES[name], **keywords) == expected


@pytest.mark.parametrize("name", ["bowl", *map(rarely, list(SCENES)[1:])])
def test_a_particle_slides_as_it_does_alone(name):
    """In which lane, and beside which others, does not matter; plain Python has the bits of the compiled kernels."""
    scene = SCENES[name]
    start = start_of(scene, 40)
    together = swarm.simulate(scene, start, swarm.Impact(), until=0.6, threads=1, compile="always").particles
    for i in (0, 1, 17):
        one = swarm.Particles(start.position[:, i], start.velocity[:, i])
        alone = swarm.simulate(scene, one, swarm.Impact(), until=0.6, threads=1, compile="never").particles
        assert np.array_equal(alone.position[:, 0], together.position[:, i])
        assert np.array_equal(alone.velocity[:, 0], together.velocity[:, i])


@pytest.mark.parametrize("name", ["bowl", *map(rarely, list(SCENES)[1:])])
def test_resumed_is_whole(tmp_path, name):
    """Halted after 1, 2, 4, ... passes: in flights, in slides, and where one becomes the other."""
    require_resumed_is_whole(tmp_path, SCENES[name], swarm.Impact(), n=300, every=0.5)


def test_frames_are_where_they_are_in_any_run():
    """A frame in the midst of a slide cuts a step: the path stays within the tolerance, the energy with it."""
    scene = swarm.Scene([swarm.Sphere(0.5)], DOWN)
    start = swarm.Particles([0.3, 0.0, -0.4], [0.0, 1.2, 0.0])
    whole, cut = (
        swarm.simulate(scene, start, swarm.Impact(), until=1.0, every=every, threads=1) for every in (1.0, 0.01)
    )
    assert np.abs(whole.particles.position - cut.particles.position).max() <= 1e-8 * 0.5
    assert cut.observables["energy_error"].max() <= 1e-14
    assert (cut.observables["sliding"][1:] == 1).all()
    assert np.diff(cut.observables["sliding_time"])[1:] == pytest.approx(0.01, rel=1e-9)
