"""Particles that start at a time of their own: `State.starts`, and which particles are there at a frame."""

import numpy as np
import pytest

import swarm
from swarm.observables import CHUNK
from swarm.particles import Births
from swarm.run.machine import run_of
from swarm.run.options import RunOptions, Task

SPHERE = swarm.Scene([swarm.Sphere(0.5)])
FALL = swarm.Scene([swarm.Box((0.5, 0.5, 0.5), restitution=0.8)], gravity=(0.0, 0.0, -9.81))


def started(scene, times, n=0, speed=1.0):
    """Particles of which the last ones come at these times."""
    particles = swarm.fill(scene, n + len(times), speed=speed, seed=3)
    at = np.append(np.zeros(n), times)
    particles.births = Births(at, np.where(np.arange(len(at)) < n, -1, 0).astype(np.int32), 1)
    return particles


def run(scene, particles, times, compile="never", threads=1, halts=False):
    """The state and the observables at each of these times; with `halts` each frame is halted after each pass."""
    method = swarm.Impact()
    options = RunOptions(until=times[-1], threads=threads, compile=compile, seed=1)
    task = Task(scene.compiled(), particles.copy(), method, options)
    task.particles.births = particles.births
    seen = []
    with run_of(task) as one:
        one.observe()
        seen.append(one.seen())
        before = 0.0
        for moment in times:
            if halts:
                one.halt(1)
            while not one.advance(moment - before, moment):
                one.halt(1)
            seen.append(one.seen())
            before = moment
        return one.state, seen


@pytest.mark.parametrize("scene", [SPHERE, FALL])
def test_a_particle_that_starts_later_flies_as_one_that_starts_at_once(scene):
    """Whatever it starts at: within a frame, with it, in the last one."""
    times = np.array([0.0, 0.1, 0.25, 0.5, 0.55, 0.75, 0.99])
    particles = started(scene, times)
    state, _seen = run(scene, particles, [0.25, 0.5, 0.75, 1.0])
    for i, start in enumerate(times):
        alone = swarm.Particles(particles.position[:, i], particles.velocity[:, i])
        end = swarm.simulate(scene, alone, swarm.Impact(), until=1.0 - start, compile="never").particles
        np.testing.assert_allclose(state.position[:, i], end.position[:, 0], atol=1e-12)
        np.testing.assert_allclose(state.velocity[:, i], end.velocity[:, 0], atol=1e-12)


def test_halts_and_resumes_change_no_bit_of_those_that_start_later():
    particles = started(FALL, np.linspace(0.0, 0.99, 40))
    times = [0.25, 0.5, 0.75, 1.0]
    (whole, seen), (halted, seen_too) = run(FALL, particles, times), run(FALL, particles, times, halts=True)
    for name in ("position", "velocity", "impacts", "impulse", "dissipated"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(halted, name))
    assert [one["total_energy"] for one in seen] == [one["total_energy"] for one in seen_too]


def test_only_those_that_are_there_are_observed():
    """At a frame those that have started by then, also at that instant."""
    particles = started(SPHERE, np.repeat([0.25, 0.3, 0.6], [5, CHUNK, 10]), n=7)
    _state, seen = run(SPHERE, particles, [0.25, 0.5, 1.0])
    there = np.array([7, 12, 12 + CHUNK, 22 + CHUNK])
    np.testing.assert_allclose([one["kinetic_energy"] for one in seen], 0.5 * there, rtol=1e-12)
    assert all(one["energy_error"] < 1e-14 for one in seen)
    np.testing.assert_array_equal(seen[0]["impacts"], 0)


def test_a_birth_at_the_end_of_a_frame_has_not_moved():
    particles = started(SPHERE, [0.5, 0.5, 0.75])
    state, _seen = run(SPHERE, particles, [0.25, 0.5])
    np.testing.assert_array_equal(state.position, particles.position)


def test_pieces_of_frames_that_doors_cut_hold_starts():
    wall = swarm.Plane((0.0, 0.0, 1.0), 0.5, present=[(0.2, 0.6)])
    scene = swarm.Scene([swarm.Sphere(0.5), wall])
    times = np.linspace(0.0, 0.95, 20)
    particles = started(SPHERE, times)
    # This wall touches the sphere in one point: no particle meets it.
    (cut, _), (whole, _) = (run(one, particles, [0.5, 1.0]) for one in (scene, SPHERE))
    np.testing.assert_allclose(cut.position, whole.position, atol=1e-12)
    np.testing.assert_array_equal(cut.impacts, whole.impacts)
