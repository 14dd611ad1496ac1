"""Impact under gravity: exact parabolas between exact impacts."""

import math

import mpmath
import numpy as np
import pytest
from physics.billiards import EPSILON, reversed_motion, run

import swarm

pytestmark = pytest.mark.physics

G = 9.81
DOWN = (0.0, 0.0, -G)
# Scenes of two walls share a kernel; the second wall of "sphere" is out of reach.
SPHERE = swarm.Scene([swarm.Sphere(0.7), swarm.Plane((0.0, 0.0, -1.0), 5.0)], DOWN)
BOWL = swarm.Scene([swarm.Sphere(0.7), swarm.Plane((0.1, 0.3, -1.0), 0.3)], DOWN)
ELLIPSOID = swarm.Scene([swarm.Ellipsoid((0.4, 0.4, 0.7))], DOWN)
# The sphere is out of reach, but not far: the scene's size sets the default shortest flight.
FLOOR = swarm.Scene([swarm.Sphere(5.0), swarm.Plane((0.0, 0.0, -1.0), 0.0)], DOWN)
SCENES = {"sphere": SPHERE, "cut sphere": BOWL, "ellipsoid": ELLIPSOID}
every_scene = pytest.mark.parametrize("name", SCENES)


def exactly_outside(scene, particles):
    """Largest distance outside the first surface, a sphere about the origin, in exact arithmetic."""
    radius = scene.surfaces[0].radius
    with mpmath.workdps(40):
        return max(float(mpmath.norm(mpmath.matrix(r.tolist())) - mpmath.mpf(radius)) for r in particles.position.T)


def test_ten_thousand_bounces_on_a_floor():
    """Period 2 sqrt(2h/g), each time to the same height: no drift but the round-off of the times, which adds up."""
    height, bounces = 1.0, 10_000
    period = 2.0 * math.sqrt(2.0 * height / G)
    start = swarm.Particles([0.0, 0.0, height], [3e-4, 0.0, 0.0])
    for part in (0.0, 0.2, 0.5, 0.9):
        time = (bounces + part) * period
        end = run(FLOOR, start, swarm.Impact(), time, compile="always")
        assert abs(end.observables["impacts"][-1] - bounces) <= 1
        # From the top of the flight of this bounce
        t = part * period if part < 0.5 else (part - 1.0) * period
        x, _y, z = end.particles.position[:, 0]
        fall = max(height - 0.5 * G * t * t, 0.0)
        slack = bounces * 8.0 * EPSILON * period * G * period
        assert x == pytest.approx(3e-4 * time, rel=bounces * EPSILON)
        assert z == pytest.approx(fall, abs=slack)
        assert end.observables["energy_error"].max() <= 4.0 * EPSILON


def event_run(r, v, radius, impacts):
    """50-digit bounces in a sphere: the state halfway between impact `impacts` and the next, and its time."""
    with mpmath.workdps(50):
        r, v = mpmath.matrix(r.tolist()), mpmath.matrix(v.tolist())
        g, radius, time = mpmath.matrix([0, 0, -mpmath.mpf(G)]), mpmath.mpf(radius), mpmath.mpf(0)

        def dot(a, b):
            return (a.T * b)[0]

        for k in range(impacts + 1):
            level = [dot(g, g) / 4, dot(v, g), dot(v, v) + dot(r, g), 2 * dot(r, v), dot(r, r) - radius**2]
            # On the wall one root is 0, exactly.
            roots = mpmath.polyroots(level if k == 0 else level[:-1], maxsteps=500, extraprec=400)
            t = min(mpmath.re(s) for s in roots if abs(mpmath.im(s)) < mpmath.mpf(10) ** -30 and mpmath.re(s) > 1e-25)
            t = t if k < impacts else t / 2
            r, v, time = r + v * t + g * (t * t / 2), v + g * t, time + t
            if k < impacts:
                n = r / mpmath.norm(r)
                v = v - n * (2 * dot(v, n))
        return np.array([float(c) for c in r]), float(time)


def test_eight_impacts_in_a_sphere_are_those_of_fifty_digits():
    """Round-off grows with every impact, as the flights diverge; eight leave it below 1e-11."""
    start = swarm.fill(SPHERE, 20, speed=1.5, seed=3)
    for r, v in zip(start.position.T, start.velocity.T, strict=True):
        where, time = event_run(r, v, 0.7, 8)
        end = run(SPHERE, swarm.Particles(r, v), swarm.Impact(), time)
        assert end.observables["impacts"][-1] == 8
        assert end.particles.position[:, 0] == pytest.approx(where, abs=1e-10)


@every_scene
def test_a_million_impacts_keep_energy_and_walls(name):
    """Of kinetic energy + m |G| size, for the worst of the particles."""
    scene = SCENES[name]
    start = swarm.fill(scene, 4, speed=2.0, seed=4)
    result = run(scene, start, swarm.Impact(), 3.5e5, 3.5e4, "always")
    assert result.observables["impacts"][-1] >= 4 * 1_000_000
    assert result.observables["energy_error"].max() <= 1e-11
    assert result.observables["max_penetration"].max() <= 4.0 * np.spacing(0.7)


def test_nothing_is_outside_in_exact_arithmetic():
    """`max_penetration` cannot see less than its own rounding: 40 digits can."""
    particles = swarm.fill(SPHERE, 50, speed=2.0, seed=5)
    wall = np.array([[0.7, 0.0], [0.0, 0.7], [0.0, 0.0]])
    particles = swarm.Particles(np.hstack([particles.position, wall]), np.hstack([particles.velocity, 0.0 * wall]))
    for _frame in range(20):
        particles = run(SPHERE, particles, swarm.Impact(), 0.1).particles
        assert exactly_outside(SPHERE, particles) <= 2.0 * np.spacing(0.7)


@every_scene
def test_time_runs_back(name):
    """Some impacts and back again: the start, to round-off that grows with every impact."""
    scene = SCENES[name]
    start = swarm.fill(scene, 50, speed=1.0, seed=6)
    there = run(scene, start, swarm.Impact(), 1.0)
    assert there.observables["impacts"][-1] >= 50
    back = reversed_motion(run(scene, reversed_motion(there.particles), swarm.Impact(), 1.0).particles)
    error = np.linalg.norm(back.position - start.position, axis=0)
    assert np.median(error) <= 1e-12
    assert error.max() <= 1e-7


@pytest.mark.parametrize("name", ["sphere", "ellipsoid"])
def test_the_vertical_angular_momentum_stays(name, compiled_at_once):
    """Of each particle, in what is round about the vertical: the round-off of an impact, adding up at random."""
    scene = SCENES[name]
    start = swarm.fill(scene, 100, speed=1.0, seed=7)
    result = run(scene, start, swarm.Impact(), 100.0)
    impacts = result.observables["impacts"][-1] / 100

    def spin(p):
        return p.position[0] * p.velocity[1] - p.position[1] * p.velocity[0]

    assert impacts >= 100
    assert np.abs(spin(result.particles) - spin(start)).max() <= 8.0 * EPSILON * impacts


@pytest.mark.parametrize("name", ["cut sphere", "ellipsoid"])
def test_threads_and_blocks_change_no_bit(name):
    scene = SCENES[name]
    start = swarm.fill(scene, 5000, speed=1.0, seed=8)
    ends = [
        swarm.simulate(scene, start, swarm.Impact(), until=1.0, every=0.5, threads=threads, block_size=size)
        for threads, size in ((1, None), (2, None), (1, 2048), (2, 4096))
    ]
    for end in ends[1:]:
        assert (end.particles.position == ends[0].particles.position).all()
        assert (end.particles.velocity == ends[0].particles.velocity).all()


def test_contact_steps_tend_to_the_exact_impact():
    """With a contact step h > 0 the energy stays, and the flight differs by O(h)."""
    start = swarm.fill(BOWL, 200, speed=1.0, seed=9)
    exact = run(BOWL, start, swarm.Impact(), 1.0).particles.position
    errors = []
    for h in (1e-4, 1e-5, 1e-6, 1e-7):
        end = run(BOWL, start, swarm.Impact(contact_step=h), 1.0)
        assert end.observables["energy_error"].max() <= 1e-12
        assert end.observables["max_penetration"].max() <= 4.0 * np.spacing(0.7)
        errors.append(np.median(np.linalg.norm(end.particles.position - exact, axis=0)))
    slopes = -np.diff(np.log10(errors))
    assert (np.abs(slopes - 1.0) <= 0.1).all(), slopes
