"""The reference billiards against closed forms, and Impact against them."""

import numpy as np
import pytest

import swarm
from bench import reference

mpmath = pytest.importorskip("mpmath")


def in_a_sphere(position, velocity, radius, time):
    """Chords of one length, each turned by one angle from the one before: in the arithmetic of mpmath."""
    mp = mpmath.mp
    r, v = ([mp.mpf(float(a)) for a in one] for one in (position, velocity))
    speed2 = sum(a * a for a in v)
    b = sum(a * c for a, c in zip(r, v, strict=True))
    root = mp.sqrt(b * b - speed2 * (sum(a * a for a in r) - mp.mpf(radius) ** 2))
    first, chord = (root - b) / speed2, 2 * root / speed2
    count = mp.floor((time - first) / chord)
    hit = [a + first * c for a, c in zip(r, v, strict=True)]
    n = [a / radius for a in hit]
    normal = sum(a * c for a, c in zip(v, n, strict=True))
    tangent = [a - normal * c for a, c in zip(v, n, strict=True)]
    size = mp.sqrt(sum(a * a for a in tangent))
    along = [a / size for a in tangent]
    # A chord spans twice the angle between velocity and wall.
    span = 2 * mp.atan2(normal, size)
    angle, rest = count * span, time - first - count * chord

    def at(turn):
        return [radius * (mp.cos(turn) * a + mp.sin(turn) * c) for a, c in zip(n, along, strict=True)]

    here, there = at(angle), at(angle + span)
    part = rest / chord
    return np.array([float(a + part * (c - a)) for a, c in zip(here, there, strict=True)])


def test_chords_in_a_sphere():
    scene = reference.SCENES["sphere"]
    particles = swarm.fill(scene, 5, speed=0.5, seed=3)
    for position, velocity in zip(particles.position.T, particles.velocity.T, strict=True):
        (end,), impacts = reference.fly(scene, position, velocity, [100.0])
        assert impacts > 40
        assert end == pytest.approx(in_a_sphere(position, velocity, 0.5, 100), abs=1e-15)


def test_a_box_unfolds():
    scene = reference.SCENES["box"]
    particles = swarm.fill(scene, 5, speed=0.5, seed=3)
    halves = np.array([0.5, 0.4, 0.3])
    for position, velocity in zip(particles.position.T, particles.velocity.T, strict=True):
        (end,), _impacts = reference.fly(scene, position, velocity, [60.0])
        # Free flight, folded: a triangle wave of period 4 b.
        phase = np.mod(position + velocity * 60.0 + halves, 4.0 * halves)
        assert end == pytest.approx(np.minimum(phase, 4.0 * halves - phase) - halves, abs=1e-13)


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
