"""Openings, doors and times of walls with a mass: against elastic collisions on a line, for points and balls."""

import itertools

import numpy as np
import pytest

import swarm

RIGHT, LEFT = (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)
RADII = [None, 0.05]


def run(surfaces, places, velocities, radius, until, every=None, mass=1.0, **options):
    """A run in plain Python of particles that start at rows (n, 3) of places."""
    particles = swarm.Particles(np.array(places, float).T, np.array(velocities, float).T, mass)
    if radius is not None:
        particles.radius = np.full(len(particles), radius)
    options = {"compile": "never", "until": until, "every": every or until, **options}
    return swarm.simulate(swarm.Scene(surfaces), particles, swarm.Impact(), **options)


def on_a_line(mass, wall_mass, times, radius, until):
    """An independent loop: a particle from x = 0.3 between a wall at x = 0 and one of a mass from x = 1.

    A ball is a point between walls nearer by its radius. The wall with a mass is open at some times, and gone then for
    a particle that comes to it: (whether it escaped and when, x, v, the wall's x and v).
    """
    low, x, v, wall, u, now = radius, 0.3, 1.0, 1.0 - radius, 0.0, 0.0
    while True:
        to_wall = (wall - x) / (v - u) if v > u else np.inf
        to_low = (low - x) / v if v < 0.0 else np.inf
        step = min(to_wall, to_low, until - now)
        x, wall, now = x + v * step, wall + u * step, now + step
        if now >= until:
            return None, x, v, wall + radius, u
        if to_low < to_wall:
            x, v = low, -v
        elif any(first <= now < last for first, last in times):
            return now, x, v, wall + u * (until - now) + radius, u
        else:
            v, u = (
                ((mass - wall_mass) * v + 2.0 * wall_mass * u) / (mass + wall_mass),
                ((wall_mass - mass) * u + 2.0 * mass * v) / (mass + wall_mass),
            )


@pytest.mark.parametrize("radius", RADII)
@pytest.mark.parametrize("times", [[(0.0, 9.0)], [(0.0, 0.5), (3.0, 9.0)], [(4.0, 4.1)], [(1.5, 2.5), (6.0, 6.5)]])
def test_a_piston_with_a_door_is_that_of_collisions_on_a_line(times, radius):
    door = swarm.Opening(swarm.Box((9.0, 9.0, 9.0)), times=times)
    walls = [
        swarm.Plane(LEFT, 0.0),
        swarm.Plane(RIGHT, 1.0, mass=40.0, motion=swarm.Guide(RIGHT), openings=[door]),
    ]
    result = run(walls, [(0.3, 0.0, 0.0)], [RIGHT], radius, until=8.0, every=2.0)
    escaped, x, v, wall, u = on_a_line(1.0, 40.0, times, radius or 0.0, 8.0)
    seen = result.observables
    np.testing.assert_allclose(result.escape_time, [np.nan if escaped is None else escaped], rtol=1e-12)
    np.testing.assert_allclose(result.particles.position[:, 0], (x, 0.0, 0.0), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(result.particles.velocity[:, 0], (v, 0.0, 0.0), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(seen["wall_position"][-1, 1, 0], wall - 1.0, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(seen["wall_velocity"][-1, 1, 0], u, rtol=0.0, atol=1e-13)
    assert seen["energy_error"].max() <= 1e-13
    assert seen["escaped"][-1] == (escaped is not None)


@pytest.mark.parametrize("radius", RADII)
def test_an_opening_goes_with_its_wall(radius):
    """The wall glides along y: where the hole was given a particle is turned round, and where it is now one escapes."""
    hole = swarm.Box((0.5, 0.1, 0.5), center=(1.0, 0.5, 0.0))
    wall = swarm.Plane(RIGHT, 1.0, mass=5.0, motion=swarm.Translation((0.0, 0.5, 0.0)), openings=[hole])
    places = [(0.0, 0.5, 0.0), (0.0, 1.0, 0.0)]
    result = run([wall], places, [RIGHT, RIGHT], radius, until=2.0)
    assert np.isnan(result.escape_time).tolist() == [True, False]
    assert result.particles.velocity[0, 0] < 0.0
    np.testing.assert_allclose(result.particles.position[:, 1], (1.0 - (radius or 0.0), 1.0, 0.0), atol=1e-12)


@pytest.mark.parametrize("radius", RADII)
def test_an_opening_turns_with_its_wall(radius):
    """A drum with a hole on its +x side turns by a quarter in a second; then the hole is on its +y side."""
    hole = swarm.Box((0.3, 0.1, 0.3), center=(0.5, 0.0, 0.0))
    drum = swarm.Sphere(
        0.5, inertia=3.0, motion=swarm.Rotation((0.0, 0.0, 1.0), 0.5 * np.pi, (0.0, 0.0, 0.0)), openings=[hole]
    )
    speed, places = 0.5 - (radius or 0.0), [(0.0, 0.0, 0.0), (0.0, 0.0, 0.2)]
    result = run([drum], places, [(0.0, speed, 0.0), (0.3, 0.0, 0.0)], radius, until=1.5)
    assert np.isfinite(result.escape_time).tolist() == [True, False]
    np.testing.assert_allclose(result.escape_time[0], 1.0, rtol=1e-12)


@pytest.mark.parametrize("radius", RADII)
def test_an_opening_of_a_wall_at_rest_beside_one_with_a_mass(radius):
    """Of three particles between plates one meets the hole of the one at rest, and two the plate with a mass first."""
    hole = swarm.Box((0.5, 0.2, 0.2), center=(0.0, 0.0, 0.0))
    walls = [swarm.Plane(LEFT, 0.0, openings=[hole]), swarm.Plane(RIGHT, 1.0, mass=30.0)]
    places, velocities = [(0.5, y, 0.0) for y in (0.0, 0.6, -0.6)], [LEFT, RIGHT, RIGHT]
    result = run(walls, places, velocities, radius, until=1.2, every=0.3)
    assert np.isfinite(result.escape_time).tolist() == [True, False, False]
    np.testing.assert_allclose(result.escape_time[0], 0.5 - (radius or 0.0), rtol=1e-12)
    momentum = result.observables["wall_velocity"][:, 1, 0] * 30.0 + result.observables["momentum"][:, 0]
    # What the plate at rest takes is twice that of each particle that it turns round; here none yet.
    np.testing.assert_allclose(momentum, momentum[0], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("radius", RADII)
def test_a_wall_with_a_mass_that_goes_and_comes(radius):
    """It is pushed, then absent while the particle passes where it was, and holds those that come later."""
    plate = swarm.Plane(RIGHT, 1.0, mass=3.0, present=[(0.0, 1.0), (2.0, 9.0)])
    far = swarm.Plane(RIGHT, 9.0)
    places, velocities = [(0.5, 0.0, 0.0), (-0.5, 1.0, 0.0), (-2.5, -1.0, 0.0)], [RIGHT, (1.3, 0.0, 0.0), RIGHT]
    result = run([plate, far], places, velocities, radius, until=1.9, every=0.5)
    # The first pushes it to a speed of 1/2, and the second passes where it is after 1 s.
    seen = result.observables
    np.testing.assert_allclose(seen["wall_velocity"][-1, 0, 0], 0.5, rtol=1e-14)
    np.testing.assert_allclose(result.particles.position[0, 1], 1.3 * 1.9 - 0.5, rtol=1e-14)
    np.testing.assert_allclose(result.particles.velocity[:, 0], (-0.5, 0.0, 0.0), atol=1e-14)
    assert seen["energy_error"].max() <= 1e-13
    # At 2 s it comes 0.6 m farther on, where the second one, at 2.1 m, is outside of it: x = 1 + 0.5 (2 - 0.5).
    with pytest.raises(swarm.RunError, match=r"surfaces\[0\].* must come where no particle is: at 2 s particle 1 is"):
        run([plate, far], places, velocities, radius, until=3.0)
    later = run([plate, far], places[::2], velocities[::2], radius, until=8.0)
    assert later.observables["impacts"][-1] == 2
    assert later.observables["wall_velocity"][-1, 0, 0] == pytest.approx(0.5 + 2.0 * 0.5 / 4.0, rel=1e-14)


@pytest.mark.parametrize("radius", RADII)
def test_what_changes_is_the_same_with_any_frames(radius):
    """Frames cut pieces of points otherwise; what is open when is the same, and energy is that of all."""
    plate = swarm.Plane(
        RIGHT, 1.0, mass=7.0, motion=swarm.Guide(RIGHT, stiffness=90.0), present=[(0.0, 5.0)],
        openings=[swarm.Opening(swarm.Box((3.0, 0.5, 0.9), center=(1.0, 0.4, 0.0)), times=[(0.4, 2.75)])],
    )  # fmt: skip
    walls = [plate, swarm.Plane(LEFT, 1.0), swarm.Cylinder(0.7, axis=RIGHT), swarm.Plane(RIGHT, 1.6)]
    y, z = (np.ravel(one) for one in np.meshgrid((-0.3, 0.0, 0.3), (-0.2, 0.2)))
    places = np.stack([np.linspace(-0.6, 0.6, 6), y, z], axis=1)
    velocities = np.random.default_rng(4).normal(size=(6, 3))
    first, second = (run(walls, places, velocities, radius, until=6.0, every=every) for every in (6.0, 0.75))
    assert np.isfinite(first.escape_time).sum() in range(1, 6)
    np.testing.assert_allclose(first.escape_time, second.escape_time, rtol=1e-9)
    np.testing.assert_allclose(first.particles.position, second.particles.position, rtol=0.0, atol=1e-9)
    for result in (first, second):
        assert result.observables["energy_error"].max() <= 1e-13
        assert result.observables["max_penetration"].max() <= 1e-13


def test_a_picture_has_the_hole_where_the_wall_is():
    hole = swarm.Sphere(0.2, center=(0.5, 0.0, 0.0))
    scene = swarm.Scene([swarm.Sphere(0.5, mass=1.0, openings=[swarm.Opening(hole, times=[(0.0, 9.0)])])])
    moved = scene.placed([(0.0, 0.0, 3.0)], [(1.0, 0.0, 0.0, 0.0)])
    volume = moved.pieces.volumes[0][0]
    at = np.array(list(itertools.product((0.5,), (0.0,), (0.0, 3.0)))).T
    assert (volume.phi(at) < 0.0).tolist() == [False, True]
