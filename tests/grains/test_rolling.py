"""Resistance to rolling of soft balls: closed forms of one ball, and what is conserved."""

import dataclasses
import math

import numpy as np
import pytest
from cut_short import in_sessions
from energy_books import unbooked

import swarm
from swarm.grains.grains_run import GrainsRun

G, RADIUS, MASS, STIFFNESS = 9.81, 0.01, 1e-3, 1e4


def floor(rolling, tilt=0.0, **keywords):
    """A rough plane, and gravity that is tilted against it [rad]."""
    plane = swarm.Plane((0.0, 0.0, -1.0), restitution=0.5, friction=0.8, rolling=rolling, **keywords)
    return swarm.Scene([plane], gravity=(G * math.sin(tilt), 0.0, -G * math.cos(tilt)))


def ball(speed, spin=None):
    """A ball on the floor that rolls along x."""
    turning = [[0.0], [speed / RADIUS], [0.0]] if spin is None else spin
    height = RADIUS - MASS * G / STIFFNESS
    return swarm.Particles(
        [[0.0], [0.0], [height]], [[speed], [0.0], [0.0]], MASS, radius=RADIUS, spin=turning
    )  # fmt: skip


def simulate(scene, particles, until, **keywords):
    options = {"every": 0.1, "compile": "never"} | keywords
    method = swarm.Penalty(dt=2e-4, penalty=STIFFNESS)
    return swarm.simulate(scene, particles, method, until=until, **options)


def missing(result, start=0.0):
    """Energy that no book has, of that at the start."""
    seen = result.observables
    return unbooked(seen) / max(start, abs(seen["total_energy"][0]))


@pytest.mark.parametrize("rolling", [0.02, 0.1])
def test_a_ball_rolls_as_far_as_its_energy_lasts(rolling):
    """It slows down by 5/7 rolling G."""
    slows = 5.0 / 7.0 * rolling * G
    run = simulate(floor(rolling), ball(0.2), round(0.2 / slows + 0.1, 1))
    assert run.particles.position[0, 0] == pytest.approx(0.2**2 / (2.0 * slows), rel=1e-6)
    assert np.abs(run.particles.velocity).max() < 1e-12
    assert np.abs(run.particles.spin).max() < 1e-9
    assert missing(run) < 1e-12


def test_on_a_slope_it_holds_or_rolls():
    """It holds while tan(tilt) is at most the coefficient; else it rolls at 5/7 G (sin - rolling cos)."""
    holds = simulate(floor(0.1, math.atan(0.09)), ball(0.0), 0.5)
    assert abs(holds.particles.position[0, 0]) < 1e-6
    assert abs(holds.particles.velocity[0, 0]) < 1e-9
    tilt = math.atan(0.2)
    rolls = simulate(floor(0.1, tilt), ball(0.0), 0.5)
    speed = 5.0 / 7.0 * G * (math.sin(tilt) - 0.1 * math.cos(tilt)) * 0.5
    assert rolls.particles.velocity[0, 0] == pytest.approx(speed, rel=1e-3)
    assert missing(rolls, MASS * speed**2) < 1e-12


def test_a_floor_without_friction_stops_a_spin_and_moves_no_ball():
    """The torque rolling R m G stops w in I w/(rolling R m G)."""
    plane = swarm.Plane((0.0, 0.0, -1.0), rolling=0.05)
    scene = swarm.Scene([plane], gravity=(0.0, 0.0, -G))
    run = simulate(scene, ball(0.0, [[0.0], [30.0], [0.0]]), 1.0, every=0.05)
    lasts = 0.4 * MASS * RADIUS**2 * 30.0 / (0.05 * RADIUS * MASS * G)
    spin = run.observables["rotational_energy"]
    assert spin[int(lasts / 0.05)] > 0.0
    assert spin[math.ceil(lasts / 0.05)] < 1e-20
    assert np.abs(run.particles.velocity[:2]).max() == 0.0


def test_two_balls_keep_their_momenta():
    """Linear and angular momentum, about the origin, and energy with what is lost."""
    start = swarm.Particles(
        [[-0.0101, 0.0101], [0.002, -0.002], [0.0, 0.001]], [[0.3, -0.3], [0.0, 0.0], [0.0, 0.1]], MASS,
        radius=[0.01, 0.009], spin=[[3.0, -5.0], [40.0, -20.0], [1.0, 30.0]],
    )  # fmt: skip
    scene = swarm.Scene([swarm.Sphere(1.0)], pairs=swarm.Pairs(restitution=0.7, friction=0.3, rolling=0.2))
    run = simulate(scene, start, 0.02, every=0.002)
    plain = simulate(
        swarm.Scene(scene.surfaces, pairs=swarm.Pairs(restitution=0.7, friction=0.3)), start, 0.02, every=0.02
    )
    seen = run.observables
    assert seen["collisions"][-1] >= 1
    assert np.abs(run.particles.spin - plain.particles.spin).max() > 1e-3
    for name in ("momentum", "angular_momentum"):
        assert np.abs(seen[name] - seen[name][0]).max() < 1e-12 * np.abs(seen[name][0]).max()
    assert missing(run) < 1e-12


def test_a_wheel_carries_a_ball_and_books_its_work():
    """The ball turns with the wheel; what the wheel gives is its work."""
    turning = swarm.Rotation((0.0, 1.0, 0.0), 2.0)
    wheel = swarm.Cylinder(0.1, axis=(0.0, 1.0, 0.0), friction=0.5, rolling=0.3, motion=turning)
    start = swarm.Particles([[0.0], [0.0], [-0.09]], np.zeros((3, 1)), MASS, radius=RADIUS, spin=np.zeros((3, 1)))
    run = simulate(swarm.Scene([wheel], gravity=(0.0, 0.0, -G)), start, 0.2, every=0.05)
    assert run.observables["wall_work"][-1].sum() > 0.0
    assert missing(run, MASS * G * RADIUS) < 1e-12


def test_a_run_that_is_resumed_has_the_same_bits(tmp_path, monkeypatch):
    """The impulses of before are in its checkpoint."""
    scene = floor(0.05, math.atan(0.03))
    whole = simulate(scene, ball(0.1), 0.2)
    parts, sessions = in_sessions(
        monkeypatch,
        GrainsRun,
        31,
        lambda: simulate(scene, ball(0.1), 0.2, trajectory=tmp_path / "parts.h5", resume=True, checkpoint=1e3),
    )
    assert sessions > 4
    assert (parts.particles.position == whole.particles.position).all()
    assert (parts.particles.spin == whole.particles.spin).all()


@pytest.mark.parametrize(
    ("method", "radius", "sentence"),
    [
        (swarm.Impact(), RADIUS, r"surfaces\[0\]\.rolling must be 0 with Impact: .* got 0\.1; leave it out, or use"),
        (swarm.Impact(), None, r"surfaces\[0\]\.rolling must be 0 with particles without a radius: a point does not"),
    ],
)
def test_where_nothing_rolls_it_is_refused(method, radius, sentence):
    spin = None if radius is None else (0.0, 0.0, 0.0)
    one = swarm.Particles([[0.0], [0.0], [0.1]], np.zeros((3, 1)), MASS, radius=radius, spin=spin)
    with pytest.raises(swarm.SceneError, match=sentence):
        swarm.simulate(floor(0.1), one, method, until=0.1)


@pytest.mark.slow
def test_a_ball_on_a_turntable_rolls_on_a_circle():
    """A solid ball that does not slip on a disc that turns at W moves on a circle at 2/7 W, wherever it starts."""
    rate, radius, mass, penalty, speed = 4.0, 0.01, 0.01, 1e4, 0.2
    disc = swarm.Plane((0.0, 0.0, -1.0), friction=1.0, motion=swarm.Rotation((0.0, 0.0, 1.0), rate=rate))
    scene = swarm.Scene([disc], gravity=(0.0, 0.0, -9.81))
    # The contact moves with the disc: v + w x (-R e_z) = (0, 0.3 W, 0).
    spin = [[(0.3 * rate - speed) / radius], [0.0], [0.0]]
    height = radius - mass * 9.81 / penalty
    ball = swarm.Particles([[0.3], [0.0], [height]], [[0.0], [speed], [0.0]], mass=mass, radius=radius, spin=spin)
    turned = 2.0 / 7.0 * rate * 1.0
    end = swarm.simulate(scene, ball, swarm.Penalty(dt=1e-4, penalty=penalty), until=1.0).particles
    assert end.velocity[:2, 0] == pytest.approx([-speed * math.sin(turned), speed * math.cos(turned)], abs=1e-6 * speed)
    circle = speed / (2.0 / 7.0 * rate)
    place = [0.3 - circle + circle * math.cos(turned), circle * math.sin(turned)]
    assert end.position[:2, 0] == pytest.approx(place, abs=2e-5 * circle)


@pytest.mark.parametrize("whole", [True, False])
def test_the_floor_of_rooms_that_join_resists_as_that_of_one_room(whole):
    laws = {"restitution": 0.5, "friction": 0.8, "rolling": 0.1}
    mine, common = ({}, laws) if whole else (laws, {})
    halves = [swarm.Box((0.2, 0.1, 0.1), (x, 0.0, 0.1), **mine) for x in (-0.1, 0.1)]
    ends = []
    for room in (swarm.Union(halves, **common), swarm.Box((0.3, 0.1, 0.1), (0.0, 0.0, 0.1), **laws)):
        run = simulate(swarm.Scene([room], gravity=(0.0, 0.0, -G)), ball(0.02), 0.04, every=0.04)
        ends.append((run.particles.position, run.particles.spin))
    np.testing.assert_allclose(*ends, atol=1e-12)
    assert np.abs(ends[0][1]).max() < 1e-9
    odd = [halves[0], dataclasses.replace(halves[1], rolling=0.2)]
    with pytest.raises(swarm.SceneError, match="the parts differ in rolling"):
        simulate(swarm.Scene([swarm.Union(odd, rolling=0.0)], gravity=(0.0, 0.0, -G)), ball(0.02), 0.1)
