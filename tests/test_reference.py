"""The reference billiards against closed forms, and Impact against them."""

import numpy as np
import pytest

import swarm
from bench import reference

pytest.importorskip("mpmath")


def test_chords_in_a_sphere():
    scene = reference.SCENES["sphere"]
    particles = swarm.fill(scene, 5, speed=0.5, seed=3)
    for position, velocity in zip(particles.position.T, particles.velocity.T, strict=True):
        (end,), impacts = reference.fly(scene, position, velocity, [100.0])
        assert impacts > 40
        assert end == pytest.approx(reference.in_a_sphere(position, velocity, 0.5, 100.0, None), abs=1e-15)


def test_a_box_unfolds():
    scene = reference.SCENES["box"]
    particles = swarm.fill(scene, 5, speed=0.5, seed=3)
    halves = np.array([0.5, 0.4, 0.3])
    for position, velocity in zip(particles.position.T, particles.velocity.T, strict=True):
        (end,), _impacts = reference.fly(scene, position, velocity, [60.0])
        # Free flight, folded: a triangle wave of period 4 b.
        phase = np.mod(position + velocity * 60.0 + halves, 4.0 * halves)
        assert end == pytest.approx(np.minimum(phase, 4.0 * halves - phase) - halves, abs=1e-13)


@pytest.mark.physics
def test_penalty_tends_to_the_soft_sphere():
    """A sixteenth of the error at a quarter of the step: the closed form of springs is what is converged to."""
    with np.load(reference.PATH) as file:
        known = {key.split("/")[1]: values for key, values in file.items() if key.startswith(reference.SOFT)}
    particles, errors = swarm.Particles(known["position"], known["velocity"]), []
    for dt in (2.0**-10, 2.0**-12, 2.0**-14):
        method = swarm.Penalty(dt=dt, penalty=reference.PENALTY)
        until = float(known["times"][1])
        end = swarm.simulate(reference.SCENES["sphere"], particles, method, until=until, compile="always")
        errors.append(np.nanmedian(np.linalg.norm(end.particles.position.T - known["end"][:, 1], axis=1)))
    assert np.isnan(known["end"]).mean() < 0.05
    assert np.divide(errors[:-1], errors[1:]) == pytest.approx(16.0, rel=0.1)


@pytest.mark.parametrize("name", reference.SCENES)
def test_impact_is_where_the_reference_is(name):
    """After five impacts, of every particle of the file; near a ball errors grow tenfold an impact."""
    with np.load(reference.PATH) as file:
        known = dict(file)
    particles = swarm.Particles(known[f"{name}/position"], known[f"{name}/velocity"])
    result = swarm.simulate(reference.SCENES[name], particles, swarm.Impact(), until=float(known[f"{name}/times"][0]))
    off = np.linalg.norm(result.particles.position.T - known[f"{name}/end"][:, 0], axis=1)
    assert np.median(off) <= 1e-14
    assert off.max() <= 1e-9


@pytest.mark.parametrize("name", reference.SCENES)
def test_the_file_is_what_its_command_writes(name):
    with np.load(reference.PATH) as file:
        known = dict(file)
    scene = reference.SCENES[name]
    start = swarm.fill(scene, reference.PARTICLES, speed=reference.SPEED, seed=5)
    assert np.array_equal(start.position, known[f"{name}/position"])
    first, _impacts = reference.fly(scene, start.position[:, 0], start.velocity[:, 0], list(known[f"{name}/times"][:1]))
    assert np.array_equal(first[0], known[f"{name}/end"][0, 0])


def test_the_soft_sphere_is_what_its_command_writes():
    with np.load(reference.PATH) as file:
        known = dict(file)
    start, times = (
        swarm.Particles(known["sphere/position"][:, :2], known["sphere/velocity"][:, :2]),
        known["sphere/times"],
    )
    again = reference.soft(start, list(times))
    assert np.array_equal(again[f"{reference.SOFT}/end"], known[f"{reference.SOFT}/end"][:2], equal_nan=True)
    assert np.array_equal(known[f"{reference.SOFT}/position"], known["sphere/position"])
