"""Balls that turn: friction of their collisions and of walls, with spins."""

import signal

import numpy as np
import pytest
from colliding.gases import gas
from energy_books import unbooked

import swarm

OPTIONS = {"until": 1.0, "every": 0.25, "compile": "never", "progress": False}


def inertia(balls):
    return 0.4 * balls.mass * balls.radius**2


def rough(n=24, gravity=None, friction=0.3, walls=0.0, **pairs):
    """A gas of balls that turn."""
    scene, balls = gas(n, gravity=gravity, friction=friction, **pairs)
    balls.spin = np.random.default_rng(5).normal(size=(3, n)) * 6.0
    return swarm.Scene([swarm.Box((1.0, 1.0, 1.0), friction=walls)], gravity=gravity, pairs=scene.pairs), balls


def collision(friction, restitution=1.0, spin=True):
    """Two unlike balls before and after they meet, in free space."""
    turns = np.array([[3.0, -1.0], [-5.0, 2.0], [4.0, 6.0]]) if spin else np.zeros((3, 2))
    balls = swarm.Particles(
        [[-0.2, 0.2], [0.0, 0.05], [0.0, -0.03]], [[1.0, -0.5], [0.3, 0.1], [-0.2, 0.4]], [0.7, 1.9],
        radius=[0.1, 0.13], spin=turns,
    )  # fmt: skip
    scene = swarm.Scene([], pairs=swarm.Pairs(restitution=restitution, friction=friction))
    done = swarm.simulate(scene, balls.copy(), swarm.Impact(), **OPTIONS)
    assert done.observables["collisions"][-1] == 1
    return balls, done.particles


def contact(before, after):
    """The normal of the collision from the first to the second ball, and the impulse on the second one."""
    impulse = after.mass[1] * (after.velocity[:, 1] - before.velocity[:, 1])
    # Where they met: the velocities before give the time.
    b, u = before.position[:, 1] - before.position[:, 0], before.velocity[:, 1] - before.velocity[:, 0]
    p, q, reach = b @ u, u @ u, before.radius.sum()
    n = b + (-p - np.sqrt(p * p - q * (b @ b - reach * reach))) / q * u
    return n / reach, impulse


def slip(balls, n):
    """The velocity of the second ball's surface relative to that of the first one, across the normal."""
    first = balls.velocity[:, 0] + np.cross(balls.spin[:, 0], balls.radius[0] * n)
    second = balls.velocity[:, 1] - np.cross(balls.spin[:, 1], balls.radius[1] * n)
    return (second - first) - (second - first) @ n * n


@pytest.mark.parametrize("friction", [0.05, 5.0], ids=["slides", "sticks"])
@pytest.mark.parametrize("spin", [True, False], ids=["spinning", "without spin"])
def test_a_collision_obeys_coulombs_law_and_the_laws_of_momentum(friction, spin):
    before, after = collision(friction, 0.8, spin)
    n, impulse = contact(before, after)
    along, across = impulse @ n, impulse - impulse @ n * n
    arms = np.stack([before.radius[0] * n, -before.radius[1] * n], axis=1)
    pushes = np.stack([-impulse, impulse], axis=1)
    turned = before.spin + np.cross(arms, pushes, axis=0) / inertia(before)
    assert np.abs(after.spin - turned).max() < 1e-13
    assert np.abs((after.velocity - before.velocity) @ before.mass).max() < 1e-15
    closing = (before.velocity[:, 1] - before.velocity[:, 0]) @ n
    assert (after.velocity[:, 1] - after.velocity[:, 0]) @ n == pytest.approx(-0.8 * closing, rel=1e-13)
    if friction == 5.0:
        assert np.abs(slip(after, n)).max() < 1e-14
        assert np.linalg.norm(across) < friction * along
    else:
        assert np.linalg.norm(across) == pytest.approx(friction * along, rel=1e-12)
        assert across @ slip(before, n) < 0.0
        assert np.abs(np.cross(across, slip(before, n))).max() < 1e-14


def test_a_ball_that_does_not_turn_leaves_a_rough_floor_with_five_sevenths_of_its_slip():
    floor = swarm.Plane((0.0, 0.0, -1.0), friction=5.0)
    ball = swarm.Particles([0.0, 0.0, 0.5], [0.7, -0.2, -1.0], 2.0, radius=0.1, spin=[0.0, 0.0, 3.0])
    after = swarm.simulate(swarm.Scene([floor]), ball, swarm.Impact(), **OPTIONS).particles
    assert after.velocity[:, 0] == pytest.approx([5.0 / 7.0 * 0.7, -5.0 / 7.0 * 0.2, 1.0], rel=1e-14)
    # It rolls, and what turns about the normal goes on.
    vx, vy, _vz = after.velocity[:, 0]
    assert after.spin[:, 0] == pytest.approx([-vy / 0.1, vx / 0.1, 3.0], rel=1e-13)


@pytest.mark.parametrize("belt", [0.0, 0.5], ids=["at rest", "that moves"])
@pytest.mark.parametrize("spin", [True, False], ids=["turning", "without spin"])
def test_a_ball_that_lies_on_a_slope_has_the_friction_of_its_weight(spin, belt):
    """a = g (sin A - mu cos A) where it slips, with any restitution: a lasting contact is many impacts of the floor."""
    g, angle, mu, radius = 9.81, 0.7, 0.1, 0.02
    floor = swarm.Plane((0.0, 0.0, -1.0), friction=mu, restitution=0.1, motion=swarm.Translation((belt, 0.0, 0.0)))
    tilted = swarm.Scene([floor], gravity=(g * np.sin(angle), 0.0, -g * np.cos(angle)))
    ball = swarm.Particles([0.0, 0.0, radius], [belt, 0.0, 0.0], 0.1, radius=radius, spin=[0.0] * 3 if spin else None)
    done = swarm.simulate(tilted, ball, swarm.Impact(), until=0.05, compile="never", progress=False)
    grip = mu * g * np.cos(angle) * 0.05
    assert belt + g * np.sin(angle) * 0.05 - done.particles.velocity[0, 0] == pytest.approx(grip, rel=1e-3)
    if spin:
        assert done.particles.spin[1, 0] == pytest.approx(2.5 * grip / radius, rel=1e-3)
    seen = done.observables
    assert unbooked(seen) <= 1e-14


def test_a_ball_that_goes_with_a_drum_without_gravity_needs_few_impacts():
    """It has no velocity relative to the drum, which presses on it: a lasting contact, an impact in t_c."""
    drum = swarm.Cylinder(0.2, friction=0.5, restitution=0.5, motion=swarm.Rotation((0.0, 0.0, 1.0), rate=1.5))
    ball = swarm.Particles([0.15, 0.0, 0.0], [0.0, 0.3, 0.0], 0.1, radius=0.05)
    done = swarm.simulate(
        swarm.Scene([drum]), ball, swarm.Impact(), until=0.01, compile="never", progress=False, walltime=20.0
    )
    assert 10 < done.observables["impacts"][-1] < 1000
    assert np.linalg.norm(done.particles.velocity[:, 0]) == pytest.approx(0.3, rel=1e-3)


def test_momentum_and_angular_momentum_of_a_cloud_are_conserved():
    _scene, balls = gas(24)
    balls.velocity -= 2.0 * balls.position
    balls.spin = np.random.default_rng(5).normal(size=(3, 24)) * 6.0
    free = swarm.Scene([], pairs=swarm.Pairs(restitution=0.9, friction=0.4))
    done = swarm.simulate(free, balls, swarm.Impact(), **OPTIONS).observables
    assert done["collisions"][-1] > 20
    for name in ("momentum", "angular_momentum"):
        assert np.abs(done[name] - done[name][0]).max() < 1e-12 * np.abs(done[name][0]).max()
    assert done["energy_error"].max() < 1e-13
    assert np.ptp(done["rotational_energy"]) > 0.01 * done["rotational_energy"][0]


@pytest.mark.parametrize(
    ("gravity", "given"),
    [
        (None, {"walls": 0.3}), ((0.0, 0.3, -1.0), {"walls": 0.3, "restitution": 0.9}), (None, {}),
        (None, {"walls": 0.3, "friction": 0.0}),
    ],
    ids=["rough", "falling and lossy", "smooth walls", "smooth pairs"],
)  # fmt: skip
def test_what_friction_takes_is_dissipated(gravity, given):
    scene, balls = rough(gravity=gravity, **given)
    done = swarm.simulate(scene, balls, swarm.Impact(), **OPTIONS).observables
    assert done["energy_error"].max() < 1e-13
    assert done["dissipated_energy"][-1] > 0.0
    energy = done["kinetic_energy"] + done["rotational_energy"] + done["potential_energy"] + done["dissipated_energy"]
    assert np.ptp(energy) < 1e-13 * np.abs(energy).max()


def test_a_wall_that_slides_makes_balls_turn_and_its_work_is_booked():
    scene, balls = rough()
    belt = swarm.Box((1.0, 1.0, 1.0), friction=0.3, motion=swarm.Oscillation((0.05, 0.02, 0.0), 2.0))
    done = swarm.simulate(swarm.Scene([belt], pairs=scene.pairs), balls, swarm.Impact(), **OPTIONS).observables
    assert done["energy_error"].max() < 1e-13
    assert done["wall_work"][-1].sum() != 0.0


def test_pairs_without_friction_leave_spins_as_they_are():
    scene, balls = rough(friction=0.0)
    smooth = swarm.simulate(scene, balls.copy(), swarm.Impact(), **OPTIONS)
    assert np.array_equal(smooth.particles.spin, balls.spin)
    bare = balls.copy()
    bare.spin = None
    without = swarm.simulate(scene, bare, swarm.Impact(), **OPTIONS)
    assert np.array_equal(smooth.particles.velocity, without.particles.velocity)


def test_spins_go_on_from_a_file(tmp_path):
    scene, balls = rough(walls=0.3, gravity=(0.0, 0.0, -1.0))
    path = tmp_path / "run.h5"

    def run(**more):
        return swarm.simulate(scene, balls.copy(), swarm.Impact(), **{**OPTIONS, **more})

    def stop(frame):
        if frame.number == 2:
            signal.raise_signal(signal.SIGTERM)

    whole = run()
    with pytest.raises(KeyboardInterrupt):
        run(trajectory=path, progress=stop, checkpoint=600.0)
    rest = run(trajectory=path, resume=True)
    for name in ("velocity", "spin"):
        assert np.array_equal(getattr(rest.particles, name), getattr(whole.particles, name))
    with swarm.Trajectory(path) as read:
        assert np.array_equal(read.frame(-1).spin, whole.particles.spin)


def test_laws_that_send_balls_off_leave_their_spins():
    scene, balls = rough(n=8, friction=0.0)
    hot = swarm.Box((1.0, 1.0, 1.0), friction=0.3, temperature=0.5)
    done = swarm.simulate(swarm.Scene([hot], pairs=scene.pairs), balls.copy(), swarm.Impact(), **OPTIONS)
    assert done.observables["impacts"][-1] > 0
    assert np.array_equal(done.particles.spin, balls.spin)
