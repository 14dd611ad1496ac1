"""What contacts of soft balls lose: restitution and Coulomb's friction against closed forms, and all of it booked."""

import math

import numpy as np
import pytest
from energy_books import booked
from grains_runs import ROOM, cloud, ran

import swarm
from swarm.grains.matter import damping_of

MASS, RADIUS, ALPHA, G = 0.3, 0.1, 2e4, 10.0
FLOOR = (0.0, 0.0, -1.0)


def two_at(x):
    """The places of two balls on the x axis."""
    return [[-x, x], [0.0, 0.0], [0.0, 0.0]]


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("restitution", [0.95, 0.5, 0.1])
def test_the_restitution_is_the_one_asked_for(exponent, restitution):
    errors = []
    for dt in (2e-4, 1e-4):
        start = swarm.Particles(
            [[-0.11, 0.11], [0.0, 0.0], [0.0, 0.0]],
            [[1.0, -0.5], [0.2, 0.2], [0.0, 0.0]],
            (MASS, 2 * MASS),
            radius=RADIUS,
        )
        scene = swarm.Scene(ROOM.surfaces, pairs=swarm.Pairs(restitution=restitution))
        result = ran(scene, start, swarm.Penalty(dt, ALPHA, exponent), 0.1)
        seen, v = result.observables, result.particles.velocity[0]
        errors.append(abs((v[1] - v[0]) / 1.5 - restitution))
        lost = 0.5 * (1 - restitution**2) * (2 * MASS / 3) * 1.5**2
        assert seen["dissipated_energy"][-1] == pytest.approx(lost, rel=0.02)
        assert seen["energy_error"].max() < 1e-14
        assert np.ptp(seen["momentum"], axis=0).max() < 1e-15
    assert errors[0] < 0.02
    assert errors[1] < 0.6 * errors[0] or errors[0] < 2e-3


def test_the_damping_is_that_of_an_oscillator():
    """Of a weak damper the contact is half a period: ln e = -pi z."""
    z = damping_of(1.0, 0.999) / 2.0
    assert -math.log(0.999) == pytest.approx(math.pi * z, rel=1e-3)
    # sin t = z: (pi - 2 t) tan t = 2 at critical damping
    assert damping_of(4.0, math.exp(-2.0)) == pytest.approx(4.0, rel=1e-6)
    assert damping_of(1.0, 1.0) is None


@pytest.mark.parametrize("restitution", [0.8, 0.4])
def test_a_wall_has_its_own_restitution(restitution):
    scene = swarm.Scene([swarm.Plane(FLOOR, 0.0, restitution=restitution)])
    start = swarm.Particles((0.0, 0.0, 0.12), (0.3, 0.0, -1.0), MASS, radius=RADIUS)
    result = ran(scene, start, swarm.Penalty(1e-4, ALPHA, 1.5), 0.1)
    assert result.particles.velocity[:, 0] == pytest.approx([0.3, 0.0, restitution], abs=5e-3)
    assert result.observables["energy_error"].max() < 1e-14


# --- Friction --------------------------------------------------------------------------------------------


def on_the_floor(velocity, gravity, **laws):
    """A ball at rest on a floor but for its velocity along it, and the scene."""
    scene = swarm.Scene([swarm.Plane(FLOOR, 0.0, **laws)], gravity=gravity)
    deep = (-MASS * gravity[2] / ALPHA) ** (1 / 1.5)
    return scene, swarm.Particles((0.0, 0.0, RADIUS - deep), velocity, MASS, radius=RADIUS)


METHOD = swarm.Penalty(1e-3, ALPHA, 1.5)


def test_a_ball_that_slides_rolls_in_the_end_with_five_sevenths_of_its_speed():
    mu, speed = 0.3, 1.0
    scene, start = on_the_floor((speed, 0.0, 0.0), (0.0, 0.0, -G), friction=mu)
    rolls = 2 * speed / (7 * mu * G)
    result = ran(scene, start, METHOD, 0.2, every=0.001)
    times, seen, end = result.observables["time"], result.observables, result.particles
    assert end.velocity[0, 0] == pytest.approx(5 / 7 * speed, rel=1e-6)
    assert end.spin[1, 0] * RADIUS == pytest.approx(5 / 7 * speed, rel=1e-6)
    # It slides with -mu g for that long.
    along = seen["momentum"][:, 0] / MASS
    slides = times < rolls - 0.001
    assert along[slides] == pytest.approx(speed - mu * G * times[slides], abs=1e-6)
    assert np.ptp(along[times > rolls + 0.001]) < 1e-9
    assert seen["dissipated_energy"][-1] == pytest.approx(MASS * speed**2 / 7, rel=1e-6)
    assert np.ptp(booked(seen)) < 1e-14
    assert seen["energy_error"].max() < 1e-14


@pytest.mark.parametrize("slope", [0.2, 0.6])
def test_on_an_incline_a_ball_rolls_up_to_seven_halves_of_mu_and_slides_on_steeper_ones(slope):
    mu, angle = 0.1, math.atan(slope)
    scene, start = on_the_floor((0.0, 0.0, 0.0), (G * math.sin(angle), 0.0, -G * math.cos(angle)), friction=mu)
    result = ran(scene, start, METHOD, 0.3)
    rolls = slope < 3.5 * mu
    pull = 5 / 7 * G * math.sin(angle) if rolls else G * (math.sin(angle) - mu * math.cos(angle))
    assert result.particles.velocity[0, 0] == pytest.approx(0.3 * pull, rel=1e-4)
    if rolls:
        assert result.particles.spin[1, 0] * RADIUS == pytest.approx(0.3 * pull, rel=1e-4)
        assert abs(result.observables["dissipated_energy"][-1]) < 1e-12


def test_a_belt_makes_a_ball_roll_with_two_sevenths_of_its_speed():
    scene, start = on_the_floor(
        (0.0, 0.0, 0.0), (0.0, 0.0, -G), friction=0.4, motion=swarm.Translation((0.7, 0.0, 0.0))
    )
    result = ran(scene, start, METHOD, 0.3, every=0.05)
    assert result.particles.velocity[0, 0] == pytest.approx(0.2, rel=1e-6)
    assert np.ptp(booked(result.observables)) < 1e-14
    assert result.observables["wall_work"][-1, 0] > 0.0


def test_an_oblique_impact_that_slides_takes_mu_times_the_normal_impulse():
    mu, e = 0.1, 0.7
    scene = swarm.Scene(ROOM.surfaces, pairs=swarm.Pairs(restitution=e, friction=mu))
    start = swarm.Particles(two_at(0.1001), [[0.5, -0.5], [1.0, -1.0], [0.0, 0.0]], MASS, radius=RADIUS)
    result = ran(scene, start, swarm.Penalty(4e-6, 1e5 * ALPHA, 1.5), 0.0008)
    v, w = result.particles.velocity, result.particles.spin
    # Each takes the impulse mu (1 + e) m/2 across, and turns by 5/2 of it over m R.
    assert v[1, 0] == pytest.approx(1.0 - mu * (1 + e) * 0.5, abs=5e-3)
    assert w[2, 0] == pytest.approx(-2.5 * mu * (1 + e) * 0.5 / RADIUS, rel=5e-2)
    assert w[2, 0] == pytest.approx(w[2, 1], rel=1e-12)


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_all_that_friction_and_dampers_take_is_booked_and_angular_momentum_stays(exponent):
    scene = swarm.Scene(ROOM.surfaces, pairs=swarm.Pairs(restitution=0.6, friction=0.4))
    start = cloud()
    start.spin = np.random.default_rng(1).normal(size=(3, len(start)))
    result = ran(scene, start, swarm.Penalty(0.002, 400.0, exponent), 0.4, every=0.1)
    seen = result.observables
    assert seen["collisions"][-1] > 10
    assert seen["dissipated_energy"][-1] > 0.02 * seen["total_energy"][0]
    assert (np.diff(seen["dissipated_energy"]) > 0.0).all()
    assert seen["energy_error"].max() < 1e-13
    scale = (result.particles.mass * np.sqrt((result.particles.velocity**2).sum(axis=0))).sum()
    assert abs(seen["momentum"] - seen["momentum"][0]).max() < 1e-14 * scale
    assert abs(seen["angular_momentum"] - seen["angular_momentum"][0]).max() < 1e-14 * 5.0 * scale


# --- Rest, and walls that move ---------------------------------------------------------------------------


def test_a_heap_of_four_balls_stays_on_a_rough_floor_and_falls_apart_on_a_smooth_one():
    side = 2.0 * RADIUS
    angle = np.array([0.0, 2.0, 4.0]) * np.pi / 3.0
    base = np.array([np.cos(angle), np.sin(angle), np.full(3, RADIUS)]) * [[side / 3**0.5], [side / 3**0.5], [1.0]]
    top = [[0.0], [0.0], [RADIUS + side * (2.0 / 3.0) ** 0.5]]
    start = swarm.Particles(np.hstack([base, top]), np.zeros((3, 4)), MASS, radius=RADIUS)
    speeds = {}
    for mu, until in ((0.0, 0.5), (0.5, 3.0)):
        laws = {"restitution": 0.3, "friction": mu}
        scene = swarm.Scene([swarm.Plane(FLOOR, 0.0, **laws)], gravity=(0.0, 0.0, -G), pairs=swarm.Pairs(**laws))
        seen = ran(scene, start, METHOD, until).observables
        speeds[mu] = seen["kinetic_energy"][-1]
        assert seen["energy_error"].max() < 1e-13
    assert speeds[0.0] > 1e-3
    assert speeds[0.5] < 1e-20


def test_a_shaker_gives_its_work(tmp_path):
    motion = swarm.Oscillation((0.0, 0.0, 0.02), 5.0)
    floor = swarm.Plane(FLOOR, 0.0, restitution=0.6, friction=0.3, motion=motion)
    scene = swarm.Scene(
        [floor, swarm.Cylinder(0.35, friction=0.3)], gravity=(0.0, 0.0, -G), pairs=swarm.Pairs(0.7, 0.2)
    )
    start = swarm.Particles([[-0.15, 0.15, 0.0], [0.0, 0.0, 0.2], [0.11] * 3], np.zeros((3, 3)), MASS, radius=RADIUS)
    seen = ran(scene, start, METHOD, 0.6, every=0.1, trajectory=tmp_path / "shaker.h5").observables
    assert seen["wall_work"][-1].sum() > 0.01
    assert seen["wall_position"][:, 0, 2] == pytest.approx(0.02 * np.sin(10.0 * np.pi * seen["time"]), abs=1e-12)
    assert np.ptp(booked(seen)) < 1e-13


def test_discs_stay_in_their_plane():
    scene = swarm.Scene(
        [swarm.Box((1.0, 1.0, 1.0), friction=0.3, restitution=0.8)],
        (0.0, -G, 0.0),
        plane="z",
        pairs=swarm.Pairs(0.8, 0.3),
    )
    grid = np.array([[x, y, 0.0] for x in (-0.5, 0.1, 0.6) for y in (-0.8, -0.2, 0.4)]).T
    velocity = np.array([[1.0], [0.3], [0.0]]) * np.linspace(-1.0, 1.0, 9)
    result = ran(scene, swarm.Particles(grid, velocity, MASS, radius=0.2), METHOD, 0.4)
    assert result.observables["collisions"][-1] > 0
    assert not result.particles.position[2].any()
    assert not result.particles.velocity[2].any()
    assert not result.particles.spin[:2].any()
    assert result.particles.spin[2].any()
    assert result.observables["energy_error"].max() < 1e-13
