"""Balls that meet at instants against closed forms, and the same bits whatever a run is cut into."""

import itertools
import math

import numpy as np
import pytest
from colliding.gases import BOX, depth, frames, gas, run_of

import swarm
from swarm.events.colliding.clock import LENGTH, REACH
from swarm.events.colliding.queue import FIRST


@pytest.mark.parametrize("restitution", [1.0, 0.5, 0.0])
@pytest.mark.parametrize("gravity", [None, (0.0, 0.0, -3.0)])
def test_two_balls(restitution, gravity):
    scene = swarm.Scene([swarm.Box((9.0,) * 3)], gravity=gravity, pairs=swarm.Pairs(restitution, contact_duration=0.0))
    start = swarm.Particles(
        [[-0.5, 0.5], [0.0, 0.1], [0.0, 0.0]], [[1.0, -1.0], [0.0, 0.0], [0.3, 0.3]], [1.0, 3.0], radius=[0.1, 0.3]
    )
    seen = swarm.simulate(scene, start, swarm.Impact(), until=0.8, compile="never")
    # They touch where x = sqrt(0.4^2 - 0.1^2) apart.
    apart = math.sqrt(0.16 - 0.01)
    time = 0.5 * (1.0 - apart)
    n = np.array([apart, 0.1, 0.0]) / 0.4
    closing = -2.0 * n[0]
    change = (1.0 + restitution) * closing * n
    after = start.velocity + np.array([change * 0.75, -change * 0.25]).T
    fall = np.array(gravity or (0.0, 0.0, 0.0))[:, None]
    position = start.position + start.velocity * time + after * (0.8 - time) + 0.5 * fall * 0.64
    np.testing.assert_allclose(seen.particles.velocity, after + fall * 0.8, atol=1e-14)
    np.testing.assert_allclose(seen.particles.position, position, atol=1e-14)
    lost = 0.5 * 0.75 * (1.0 - restitution**2) * closing**2
    np.testing.assert_allclose(seen.observables["dissipated_energy"][-1], lost, atol=1e-15)
    # What is left of the normal velocity by round-off may close again.
    assert seen.observables["collisions"][-1] == 1 or restitution == 0.0


def test_a_ball_meets_walls_with_its_surface():
    start = swarm.Particles((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), radius=0.25)
    seen = swarm.simulate(swarm.Scene([BOX]), start, swarm.Impact(), until=1.0, compile="never")
    assert seen.particles.position[0, 0] == 0.5
    assert seen.observables["impacts"][-1] == 1
    assert seen.observables["impulse"][-1].sum() == 2.0


@pytest.mark.parametrize("many", [3, 5])
def test_newtons_cradle(many):
    """Touching balls hand the blow on one by one, at one time."""
    position = np.zeros((3, many))
    position[0] = np.arange(many) * 0.2 - 0.4
    position[0, 0] -= 0.25
    velocity = np.zeros((3, many))
    velocity[0, 0] = 1.0
    start = swarm.Particles(position, velocity, radius=0.1)
    scene = swarm.Scene([swarm.Box((3.0,) * 3)])
    seen = swarm.simulate(scene, start, swarm.Impact(), until=0.5, compile="never")
    expected = np.zeros(many)
    expected[-1] = 1.0
    np.testing.assert_allclose(seen.particles.velocity[0], expected, atol=1e-12)


def test_of_equal_times_the_smaller_number_is_first():
    """Two balls are hit at once: in whichever order they are numbered, the first one takes its share first."""
    angle = math.radians(30.0)
    for sign in (1.0, -1.0):
        x, y = 0.2 * math.cos(angle), 0.2 * math.sin(angle) * sign
        start = swarm.Particles(
            [[-0.5, x, x], [0.0, y, -y], [0.0, 0.0, 0.0]], [[1.0, 0.0, 0.0], [0.0] * 3, [0.0] * 3], radius=0.1
        )
        seen = swarm.simulate(swarm.Scene([BOX]), start, swarm.Impact(), until=0.6, compile="never")
        speeds = np.sqrt((seen.particles.velocity**2).sum(axis=0))
        assert speeds[1] > speeds[2] + 0.1


@pytest.mark.parametrize("kind", ["box", "falling", "lossy", "cell"])
def test_balls_never_overlap_and_energy_is_kept(kind):
    options = {
        "box": {}, "falling": {"gravity": (0.0, 0.5, -2.0)}, "lossy": {"restitution": 0.8},
        "cell": {"period": (2.0, 2.0, 2.0)},
    }[kind]  # fmt: skip
    scene, start = gas(**options)
    times = np.linspace(0.1, 2.0, 20)
    with run_of(scene, start) as run:
        run.observe()
        first = run.seen()
        for before, moment in itertools.pairwise([0.0, *times]):
            assert run.advance(moment - before, moment)
            assert depth(scene, run.state.position, start.radius) < 4 * np.finfo(float).eps
            assert run.seen()["max_penetration"] < 4 * np.finfo(float).eps
        seen = run.seen()
    assert seen["collisions"] > 40
    assert seen["energy_error"] < 1e-14
    if kind == "cell":
        walls = np.zeros(3)
        assert seen["impacts"] > 0 or np.allclose(seen["momentum"], first["momentum"] + walls, atol=1e-14)


@pytest.mark.parametrize(
    "options", [{}, {"period": (2.0, 2.0, 2.0)}, {"gravity": (0.0, 0.0, -2.0), "restitution": 0.9}]
)
def test_frames_change_no_bit(options):
    scene, start = gas(**options)
    one, speed, _seen = frames(run_of(scene, start), [1.0])
    two, again, _seen = frames(run_of(scene, start, 2), [0.1, 0.3, 0.35, 0.9, 1.0])
    assert (one == two).all()
    assert (speed == again).all()


@pytest.mark.parametrize("options", [{}, {"period": (2.0, 2.0, 2.0), "restitution": 0.9}])
def test_a_halted_run_goes_on_with_the_same_bits(options):
    scene, start = gas(**options)
    expected, speed, seen = frames(run_of(scene, start), [0.5, 1.0])
    kept = None
    with run_of(scene, start) as run:
        run.observe()
        run.advance(0.5, 0.5)
        run.halt(20)
        while not run.advance(0.5, 1.0):
            run.halt(20)
            kept = kept or {name: array.copy() for name, array in run.arrays().items()}
        assert (run.state.position == expected).all()
    assert kept is not None
    with run_of(scene, start) as run:
        run.restore(kept, True)
        assert run.advance(0.5, 1.0)
        assert (run.state.position == expected).all()
        assert (run.state.velocity == speed).all()
        again = run.seen()
    assert all(np.array_equal(again[name], value, equal_nan=True) for name, value in seen.items())


def test_epochs_keep_the_digits_of_time():
    """A ball goes to and fro a million times as long as an epoch, and is where it is to be."""
    start = swarm.Particles((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), radius=0.5)
    run = run_of(swarm.Scene([BOX]), start)
    position, _velocity, _seen = frames(run, [2000.125])
    np.testing.assert_allclose(position[0, 0], 0.125, atol=1e-12)


@pytest.mark.parametrize("restitution", [1.0, 0.1])
def test_epochs_fit_the_speed(restitution):
    """In a gas that has cooled, or is as hot as ever, balls fly as far in an epoch."""
    scene, start = gas(restitution=restitution)
    run = run_of(scene, start)
    with run:
        run.observe()
        first = float(run._clock[LENGTH])
        run.advance(30.0, 30.0)
        length, reach = run._clock[[LENGTH, REACH]]
        speed = math.sqrt((run.state.velocity**2).sum(axis=0).mean())
        assert length == first if restitution == 1.0 else length > 3.0 * first
        assert 0.1 * reach < speed * length < 2.1 * reach
        now = float(run._since(30.0))
        assert now <= float(run._flock.key[FIRST])
        assert math.log2(length) % 1.0 == 0.0


def test_of_a_frame_at_its_end_all_is_done():
    scene, start = gas(8)
    with run_of(scene, start) as run:
        run.observe()
        for before, moment in itertools.pairwise((0.0, 0.2, 0.3)):
            assert run.advance(moment - before, moment)
            assert run.share_done(moment - before) == pytest.approx(1.0, abs=1e-12)


def test_two_dimensions_stay_exact():
    scene = swarm.Scene([swarm.Box((1.0, 1.0, 1.0), open=["-z", "+z"])], plane="z")
    random = np.random.default_rng(2)
    grid = np.array(list(itertools.product((-0.6, -0.2, 0.2, 0.6), repeat=2))).T
    position, velocity = np.vstack([grid, np.zeros(16)]), np.vstack([random.normal(size=(2, 16)), np.zeros(16)])
    start = swarm.Particles(position, velocity, radius=0.15)
    seen = swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile="never")
    assert seen.observables["collisions"][-1] > 20
    assert (seen.particles.position[2] == 0.0).all()
    assert (seen.particles.velocity[2] == 0.0).all()


def test_in_an_open_scene_balls_fly_away():
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0)])
    start = swarm.Particles([[-1.0, 1.0], [0.0, 0.0], [1.0, 1.0]], [[1.0, -1.0], [0.0, 0.0], [1.0, 1.0]], radius=0.1)
    seen = swarm.simulate(scene, start, swarm.Impact(), until=1000.0, compile="never")
    assert seen.observables["collisions"][-1] == 1
    np.testing.assert_allclose(seen.particles.position[0], [-999.2, 999.2], rtol=1e-14)


def test_losing_balls_on_a_floor_come_to_an_end():
    """Inelastic collapse: events stay bounded, by t_c."""
    scene = swarm.Scene(
        [swarm.Box((1.0,) * 3, restitution=0.5)],
        gravity=(0.0, 0.0, -1.0),
        pairs=swarm.Pairs(0.5, contact_duration=0.02),
    )
    x = np.linspace(-0.7, 0.7, 4)
    start = swarm.Particles([x, 0 * x, 0 * x], [0 * x, 0 * x, 0 * x - 0.1], radius=0.1)
    seen = swarm.simulate(scene, start, swarm.Impact(), until=20.0, compile="never")
    assert seen.observables["impacts"][-1] < 4 * 20.0 / 0.004
    assert seen.observables["energy_error"][-1] < 1e-13


@pytest.mark.parametrize(("given", "sentence"), [({"period": (0.3, None, None)}, r"period\[0\]")])
def test_what_does_not_go_with_balls_is_reported(given, sentence):
    start = swarm.Particles((0.1, 0.5, 0.0), (1.0, 0.0, 0.0), radius=0.1)
    scene = swarm.Scene([swarm.Plane((0.0, -1.0, 0.0), 0.0)], **given)
    with pytest.raises(swarm.SceneError, match=sentence):
        swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile="never")
