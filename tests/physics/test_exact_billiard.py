"""Impact against closed forms: the sphere, the ellipsoid's integral, reversal."""

import numpy as np
import pytest
from physics.billiards import (
    chord_numbers,
    equally_busy,
    joachimsthal,
    reversed_motion,
    run,
    scene_of,
    speed2,
    sphere_billiard,
    ulps_outside,
    worst_energy,
)

import swarm

pytestmark = pytest.mark.physics

RADIUS, IMPACTS = 0.5, 64


@pytest.fixture(scope="module")
def sphere_run():
    """200 particles, each as fast as ends it half way after its 64th impact at t = 16."""
    start = swarm.fill(scene_of("sphere"), 200, speed=1.0, seed=1)
    first, between = chord_numbers(start, RADIUS)
    start.velocity = start.velocity * ((first + (IMPACTS - 0.5) * between) / 16.0)
    return start, run(scene_of("sphere"), start, swarm.Impact(), 16.0, 1.0)


def test_sphere_follows_the_exact_billiard(sphere_run):
    """Every chord is equal and turns by the same angle, so 50 digits know where each particle is."""
    start, result = sphere_run
    end = result.particles
    exact = [sphere_billiard(r, v, RADIUS, 16.0) for r, v in zip(start.position.T, start.velocity.T, strict=True)]
    distance = np.linalg.norm(end.position - np.array([r for r, _, _ in exact]).T, axis=0)
    turn = np.linalg.norm(end.velocity - np.array([v for _, v, _ in exact]).T, axis=0) / np.sqrt(speed2(start))
    assert [n for _, _, n in exact] == [IMPACTS] * 200
    assert np.median(distance) <= 1e-13 * RADIUS
    assert np.median(turn) <= 4e-13


def test_sphere_counts_every_impact(sphere_run):
    """A particle that ends between its 64th and its 65th impact has made 64."""
    assert sphere_run[1].observables["impacts"][-1] == 200 * IMPACTS


def test_sphere_keeps_angular_momentum_and_chords(sphere_run):
    """The wall pushes towards the centre: no torque; and the chord's length follows from r x v."""
    start, result = sphere_run
    before, after = (np.cross(p.position, p.velocity, axis=0) for p in (start, result.particles))
    scale = RADIUS * np.sqrt(speed2(start))
    assert np.abs((after - before) / scale).max() <= 1e-14
    assert np.abs(chord_numbers(result.particles, RADIUS)[1] / chord_numbers(start, RADIUS)[1] - 1.0).max() <= 1e-12


def test_ellipsoid_keeps_joachimsthals_integral():
    """(r.Av)^2 - (v.Av)(r.Ar - 1) is constant along the billiard in an ellipsoid: 1e3 impacts each, 1e-12."""
    scene = scene_of("ellipsoid")
    start = equally_busy(scene, swarm.fill(scene, 100, speed=0.5, seed=2), 1000, 100.0)
    result = run(scene, start, swarm.Impact(), 100.0, compile="always")
    assert result.observables["impacts"][-1] == pytest.approx(100 * 1000, rel=0.05)
    assert np.abs(joachimsthal(result.particles) / joachimsthal(start) - 1.0).max() <= 1e-12


@pytest.mark.parametrize(
    ("name", "crossing"), [("sphere", 1.34), ("ellipsoid", 1.11), ("hemisphere", 0.89), ("box", 1.34)]
)
def test_run_back_finds_the_start(name, crossing):
    """Elastic impacts are reversible; in these integrable shapes round-off grows slowly: 100 impacts, 1e-10."""
    scene = scene_of(name)
    start = swarm.fill(scene, 60, speed=0.5, seed=3)
    there = run(scene, start, swarm.Impact(), 100.0 * crossing, compile="always")
    back = run(scene, reversed_motion(there.particles), swarm.Impact(), 100.0 * crossing, compile="always")
    assert there.observables["impacts"][-1] >= 60 * 95
    assert np.abs(back.particles.position - start.position).max() <= 1e-10
    assert np.abs(back.particles.velocity + start.velocity).max() <= 1e-10


# 1e5 impacts a particle in each of these scenes are in the long ring.
@pytest.mark.parametrize(
    ("name", "particles"),
    [
        ("sphere", 400),
        ("ellipsoid", 400),
        ("cut sphere", 8),
        ("box", 8),
        ("nested spheres", 400),
        ("ball in ellipsoid", 8),
    ],
)
def test_impact_keeps_energy_and_walls(name, particles):
    """A reflection keeps |v|, and the step ends on the wall: thousands of impacts each, 1e-12 and 4 ulp."""
    scene = scene_of(name)
    start = swarm.fill(scene, particles, speed=0.5, seed=4)
    result = run(scene, start, swarm.Impact(), 3000.0, 10.0, "always")
    assert result.observables["impacts"][-1] >= particles * 2000
    assert result.observables["energy_error"].max() <= 1e-12
    assert worst_energy(start, result.particles) <= 1e-12
    assert ulps_outside(scene, result) <= 4.0
    assert (scene.gaps(result.particles.position) <= 4.0 * np.spacing(1.0)).all()


def test_between_nested_spheres():
    """A particle outside a solid ball never enters it, wherever the frame catches it."""
    scene = scene_of("nested spheres")
    particles = swarm.fill(scene, 300, speed=1.0, seed=5)
    nearest, farthest = np.inf, 0.0
    for _ in range(40):
        particles = run(scene, particles, swarm.Impact(), 0.37).particles
        nearest = min(nearest, np.linalg.norm(particles.position - [[0.1], [0.0], [0.0]], axis=0).min())
        farthest = max(farthest, np.linalg.norm(particles.position, axis=0).max())
    assert nearest >= 0.2 - 4.0 * np.spacing(0.2)
    assert farthest <= 0.5 + 4.0 * np.spacing(0.5)


def test_mass_does_not_steer():
    """The exact reflection does not depend on the mass: the same bits, and impulses in proportion to it."""
    scene = scene_of("ball in ellipsoid")
    light = swarm.fill(scene, 50, speed=0.5, seed=6)
    mixed = swarm.Particles(light.position, light.velocity, np.random.default_rng(6).uniform(0.1, 10.0, 50))
    heavy = swarm.Particles(light.position, light.velocity, 3.0)
    a, b, c = (run(scene, p, swarm.Impact(), 50.0) for p in (light, mixed, heavy))
    for other in (b, c):
        assert np.array_equal(a.particles.position, other.particles.position)
        assert np.array_equal(a.particles.velocity, other.particles.velocity)
    assert c.observables["impulse"][-1] == pytest.approx(3.0 * a.observables["impulse"][-1], rel=1e-13)


def test_impulse_is_the_momentum_given():
    """In a box the normal impulses of opposite walls differ by the gas's change of momentum."""
    scene = scene_of("box")
    start = swarm.fill(scene, 300, speed=0.5, mass=np.linspace(0.5, 2.0, 300), seed=7)
    observed = run(scene, start, swarm.Impact(), 20.0, 5.0).observables
    given = observed["impulse"][:, 1::2] - observed["impulse"][:, ::2]
    assert observed["momentum"] - observed["momentum"][0] == pytest.approx(given, abs=1e-10)
