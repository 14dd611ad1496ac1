"""Walls with a mass that soft balls push: closed forms, conservation, and a loop of its own over whole steps."""

import functools
import math
from contextlib import nullcontext

import numpy as np
import pytest
from grains_runs import ran

import swarm
from swarm.errors import SceneError
from swarm.files import checkpoint
from swarm.grains.grains_run import GrainsRun
from swarm.kernel.random import Seeding
from swarm.run.tally import Watched

UP = swarm.Guide((0.0, 0.0, 1.0))
FLOOR = swarm.Plane((0.0, 0.0, -1.0), 0.0)
BALL = {"radius": 0.1}


def one(place, velocity, mass=0.3, spin=None):
    made = swarm.Particles(np.array([place]).T, np.array([velocity]).T, mass, radius=np.array([0.1]))
    if spin is not None:
        made.spin = np.array([spin], float).T
    return made


def momentum(result, heavy, i=0):
    """That of balls and of a wall in each frame."""
    seen = result.observables
    return seen["momentum"] + heavy * seen["wall_velocity"][:, i]


# --- Of one contact --------------------------------------------------------------------------------------


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("heavy", [1e-2, 0.3, 1e4])
@pytest.mark.parametrize(
    "motion", [None, swarm.Translation((0.0, 0.0, -0.4)), swarm.Guide((0.0, 0.0, -2.0), speed=0.4)]
)
def test_a_ball_and_a_free_wall_meet_as_two_masses(heavy, motion, exponent):
    scene, m = swarm.Scene([swarm.Plane((0.0, 0.0, 1.0), 0.5, mass=heavy, motion=motion)]), 0.3
    start, wall = one((0.0, 0.0, 0.35), (0.2, -0.1, 1.0)), 0.0 if motion is None else -0.4
    result = ran(scene, start, swarm.Penalty(1e-4, 5e3, exponent), 0.12, every=0.04)
    seen, common = result.observables, (m * 1.0 + heavy * wall) / (m + heavy)
    assert result.particles.velocity[:, 0] == pytest.approx([0.2, -0.1, 2.0 * common - 1.0], abs=1e-12)
    assert seen["wall_velocity"][-1, 0] == pytest.approx([0.0, 0.0, 2.0 * common - wall], rel=1e-12, abs=1e-12)
    assert seen["energy_error"].max() < 1e-13
    assert abs(momentum(result, heavy) - momentum(result, heavy)[0]).max() < 1e-13 * (m + heavy * abs(wall))
    assert seen["wall_energy"][-1, 0] == pytest.approx(0.5 * heavy * (2.0 * common - wall) ** 2, rel=1e-11)


def test_a_wall_on_a_guide_yields_along_it_only():
    """A plane that is oblique to its guide: the mass that a ball meets is M/(n.a)^2."""
    n, axis = np.array([0.0, 0.6, 0.8]), np.array([0.0, 0.0, 1.0])
    scene, m, heavy = swarm.Scene([swarm.Plane(tuple(n), 0.5, mass=0.7, motion=UP)]), 0.3, 0.7
    before = np.array([0.4, 0.1, 0.9])
    result = ran(scene, one((0.0, 0.2, 0.28), before), swarm.Penalty(1e-4, 5e3), 0.1)
    impulse = 2.0 * (before @ n) / (1.0 / m + (n @ axis) ** 2 / heavy)
    assert result.particles.velocity[:, 0] == pytest.approx(before - impulse / m * n, abs=1e-12)
    assert result.observables["wall_velocity"][-1, 0] == pytest.approx(impulse * (n @ axis) / heavy * axis, abs=1e-12)
    assert result.observables["energy_error"].max() < 1e-14


@pytest.mark.parametrize("heavy", [0.1, 50.0])
def test_the_restitution_at_a_wall_with_a_mass_is_that_of_an_impact(heavy):
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, 1.0), 0.5, mass=heavy, restitution=0.6)])
    start = one((0.0, 0.0, 0.35), (0.2, 0.0, 1.0))
    soft = ran(scene, start, swarm.Penalty(2e-4, 5e3, 1.5), 0.2).observables["wall_velocity"][-1, 0, 2]
    rigid = ran(scene, start, swarm.Impact(), 0.2).observables["wall_velocity"][-1, 0, 2]
    assert rigid == pytest.approx(1.6 * 0.3 / (0.3 + heavy), rel=1e-12)
    assert soft == pytest.approx(rigid, rel=2e-3)


def test_friction_brings_a_ball_to_roll_on_a_slide_that_it_carries_along():
    """Under gravity on a slide without friction below it: momentum along it, and that about the contact, are kept."""
    heavy, m, v0 = 0.9, 0.3, 0.5
    slide = swarm.Plane((0.0, 0.0, -1.0), 0.0, mass=heavy, motion=swarm.Guide((1.0, 0.0, 0.0)), friction=0.3)
    scene, depth = swarm.Scene([slide], gravity=(0.0, 0.0, -9.81)), m * 9.81 / 1e4
    result = ran(scene, one((0.0, 0.0, 0.1 - depth), (v0, 0.0, 0.0)), swarm.Penalty(1e-3, 1e4), 0.3, every=0.1)
    rolling = v0 * (m / heavy + 2.5) / (m / heavy + 3.5)
    v, seen = result.particles.velocity[0, 0], result.observables
    assert v == pytest.approx(rolling, rel=1e-6)
    assert seen["wall_velocity"][-1, 0, 0] == pytest.approx(m / heavy * (v0 - v), rel=1e-12)
    assert seen["wall_velocity"][-1, 0, 0] == pytest.approx(v - 0.1 * result.particles.spin[1, 0], rel=1e-6)
    assert seen["energy_error"].max() < 1e-13
    assert seen["dissipated_energy"][-1] > 0.0


# --- Many balls ------------------------------------------------------------------------------------------


def handful(n=12, seed=3, speed=0.5):
    random = np.random.default_rng(seed)
    sides = np.meshgrid((-0.11, 0.11), (-0.22, 0.0, 0.22), (-0.11, 0.11), indexing="ij")
    grid = np.stack(sides).reshape(3, -1)[:, :n]
    return swarm.Particles(
        grid + random.uniform(-0.01, 0.01, (3, n)), speed * random.normal(size=(3, n)), 0.1, radius=np.full(n, 0.1)
    )  # fmt: skip


LAWS = [{}, {"restitution": 0.7}, {"friction": 0.4}, {"restitution": 0.6, "friction": 0.3, "rolling": 0.1}]


SPHERE = functools.partial(swarm.Sphere, 0.4)
# Three walls of one mass.
BOX = functools.partial(swarm.Box, (0.25, 0.36, 0.25))


@pytest.mark.parametrize(
    ("law", "heavy", "made"), [*((law, 0.05, SPHERE) for law in LAWS), (LAWS[3], 1.0, BOX), (LAWS[0], 0.05, BOX)]
)
def test_balls_in_a_free_shell_keep_all_momentum_and_energy(law, heavy, made):
    shell = made(mass=heavy, motion=swarm.Translation((0.3, -0.2, 0.1)), **law)
    scene = swarm.Scene([shell], pairs=swarm.Pairs(**law))
    result = ran(scene, handful(), swarm.Penalty(5e-4, 5e3), 0.25, every=0.05)
    seen, all_of_it = result.observables, momentum(result, heavy)
    assert seen["impacts"][-1] >= 10
    assert abs(all_of_it - all_of_it[0]).max() < 1e-14
    assert seen["energy_error"].max() < 1e-13
    assert (seen["dissipated_energy"][-1] > 0.0) == bool(law)


def lidded(stiffness=20.0, law=None):
    law = law or {}
    lid = swarm.Plane((0.0, 0.0, 1.0), 0.32, mass=0.5, motion=swarm.Guide((0, 0, 1), stiffness=stiffness), **law)
    shaft = swarm.Box((0.34, 0.34, 1.0), (0.0, 0.0, 0.68), open=("+z",), **law)
    return swarm.Scene([shaft, lid], gravity=(0.0, 0.0, -9.81), pairs=swarm.Pairs(**law))


@pytest.mark.parametrize("law", LAWS)
def test_a_lid_on_a_spring_under_gravity_keeps_the_energy_of_all(law):
    seen = ran(lidded(law=law), handful(), swarm.Penalty(5e-4, 5e3), 0.3, every=0.05).observables
    assert seen["energy_error"].max() < 2e-14
    assert seen["wall_position"][-1, 1, 2] < -0.01
    assert np.ptp(seen["wall_energy"][:, 1]) > 0.05
    assert (seen["wall_velocity"][:, 1, :2] == 0.0).all()


def test_walls_of_a_mass_cost_nothing_of_what_others_do():
    """A wall of nearly no weight that nothing touches: the balls have the same bits as without it."""
    far = swarm.Sphere(0.01, (0.0, 0.0, 5.0), "outside", mass=1.0)
    vessel = swarm.Sphere(0.65)
    ends = [
        ran(swarm.Scene(walls), handful(), swarm.Penalty(5e-4, 5e3), 0.1).particles.position
        for walls in ([vessel], [vessel, far])
    ]
    assert (ends[0] == ends[1]).all()


# --- A column, and its small oscillations ----------------------------------------------------------------


def column(heavy, method, lift=0.0, balls=3):
    """Balls on a floor under a lid at rest, by their weights, and the lid higher by so much [m]."""
    m, g, k, r = 0.3, 9.81, method.penalty, 0.1
    forces = g * (heavy + m * np.arange(balls, -1, -1))
    depths = forces / k
    z = np.cumsum(np.r_[r - depths[0], 2.0 * r - depths[1:-1]])
    lid = swarm.Plane((0.0, 0.0, 1.0), float(z[-1] + r - depths[-1]) + lift, mass=heavy, motion=UP)
    start = swarm.Particles(np.array([0 * z, 0 * z, z]), np.zeros((3, balls)), m, radius=np.full(balls, r))
    return swarm.Scene([FLOOR, lid], gravity=(0.0, 0.0, -g)), start


def test_a_lid_lies_on_a_column_with_its_weight():
    heavy, method = 2.0, swarm.Penalty(1e-3, 2e4)
    result = ran(*column(heavy, method), method, 0.2, every=0.1)
    seen = result.observables
    assert abs(seen["wall_velocity"]).max() < 1e-13
    pressed = np.diff(seen["impulse"], axis=0)[-1] / 0.1
    assert pressed == pytest.approx([9.81 * (heavy + 0.9), 9.81 * heavy], rel=1e-12)


def modes(heavy, k, balls=3):
    """The frequencies and the forms of the linear oscillations of a column, (n,) and (n, n), and the masses."""
    mass = np.r_[np.full(balls, 0.3), heavy]
    stiff = k * (2.0 * np.eye(balls + 1) - np.eye(balls + 1, k=1) - np.eye(balls + 1, k=-1))
    stiff[-1, -1] = k
    root = 1.0 / np.sqrt(mass)
    squares, forms = np.linalg.eigh(root[:, None] * stiff * root)
    return np.sqrt(squares), forms, mass


@pytest.mark.parametrize("heavy", [0.1, 2.0])
def test_a_lid_on_a_column_oscillates_as_springs_do_to_the_second_order(heavy):
    until, lift, k, errors = 0.05, 1e-6, 2e4, []
    rates, forms, mass = modes(heavy, k)
    away = np.zeros(4)
    away[-1] = lift
    swung = forms @ (np.cos(rates * until) * (forms.T @ (np.sqrt(mass) * away))) / np.sqrt(mass)
    for dt in (4e-4, 2e-4):
        method = swarm.Penalty(dt, k)
        scene, start = column(heavy, method, lift)
        result = ran(scene, start, method, until)
        errors.append(lift + result.observables["wall_position"][-1, 1, 2] - swung[-1])
    assert abs(errors[1]) < 0.02 * lift
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_a_spring_has_the_period_of_its_mass():
    """Alone: the trapezoidal rule, tan(w h/2) = h/2 sqrt(k/M), exactly."""
    lid = swarm.Plane((0.0, 0.0, 1.0), 1.0, mass=2.0, motion=swarm.Guide((0.0, 0.0, 1.0), speed=0.1, stiffness=50.0))
    scene, h = swarm.Scene([lid, FLOOR]), 1e-2
    seen = ran(scene, one((0.0, 0.0, 0.3), (0.0, 0.0, 0.0)), swarm.Penalty(h, 1e3), 5.0, every=0.5).observables
    t = np.arange(11) * 0.5
    rate = 2.0 / h * math.atan(0.5 * h * 5.0)
    assert seen["wall_position"][:, 0, 2] == pytest.approx(0.1 / 5.0 * np.sin(rate * t), abs=1e-13)
    assert seen["energy_error"].max() < 1e-13


# --- A loop of its own -----------------------------------------------------------------------------------


def stored(gap, k, a):
    return k / (a + 1.0) * max(gap, 0.0) ** (a + 1.0)


def force(before, after, k, a):
    """The discrete gradient of what a contact stores."""
    if abs(after - before) > 1e-9:
        return (stored(after, k, a) - stored(before, k, a)) / (after - before)
    return k * max(0.5 * (before + after), 0.0) ** a


def steps_of_newton(start, walls, method, count):
    """Balls, planes (normal, offset, mass, axis, stiffness): Newton's iteration on all velocities of a step at once."""
    h, k, a = method.dt, method.penalty, method.exponent
    x, v = start.position.T.copy(), start.velocity.T.copy()
    n, m, r = len(x), start.mass, start.radius
    s, u = np.zeros(len(walls)), np.zeros(len(walls))

    def left_over(ends):
        w, y = ends[: 3 * n].reshape(n, 3), ends[3 * n :]
        to, at = x + 0.5 * h * (v + w), s + 0.5 * h * (u + y)
        gained, pushed = np.zeros((n, 3)), np.zeros(len(walls))
        for i in range(n):
            for j in range(i):
                one, other = x[i] - x[j], to[i] - to[j]
                sizes = np.linalg.norm(one), np.linalg.norm(other)
                size = force(r[i] + r[j] - sizes[0], r[i] + r[j] - sizes[1], k, a)
                push = size * (one + other) / sum(sizes)
                gained[i] += push
                gained[j] -= push
            for q, (normal, offset, _mass, axis, _spring) in enumerate(walls):
                before = normal @ (x[i] - s[q] * axis) - offset + r[i]
                after = normal @ (to[i] - at[q] * axis) - offset + r[i]
                push = -force(before, after, k, a) * normal
                gained[i] += push
                pushed[q] -= push @ axis
        heavy = np.array([wall[2] for wall in walls])
        pushed -= np.array([wall[4] for wall in walls]) * 0.5 * (s + at)
        return np.r_[(w - v - h * gained / m[:, None]).ravel(), y - u - h * pushed / heavy]

    for _step in range(count):
        ends = np.r_[v.ravel(), u]
        for _turn in range(30):
            off = left_over(ends)
            slopes = np.array([(left_over(ends + d) - off) / 1e-7 for d in 1e-7 * np.eye(len(ends))]).T
            ends = ends - np.linalg.solve(slopes, off)
            if abs(off).max() < 1e-15:
                break
        w, y = ends[: 3 * n].reshape(n, 3), ends[3 * n :]
        x, s, v, u = x + 0.5 * h * (v + w), s + 0.5 * h * (u + y), w, y
    return x, v, s, u


def test_steps_are_those_of_a_loop_of_its_own():
    method, oblique = swarm.Penalty(2e-3, 2e3, 1.5), np.array([0.6, 0.0, 0.8])
    start = handful(4, speed=1.0)
    start.mass = np.array([0.1, 0.2, 0.15, 0.1])
    planes = [
        ((0.0, 0.0, 1.0), 0.24, 0.3, oblique, 30.0), ((0.0, 0.0, -1.0), 0.24, 0.2, np.array([0.0, 0.0, -1.0]), 0.0),
        ((0.0, 1.0, 0.0), 0.31, 0.05, np.array([0.0, 1.0, 0.0]), 5.0), ((0.0, -1.0, 0.0), 0.34, 1e9, oblique, 0.0),
    ]  # fmt: skip
    surfaces = [
        swarm.Plane(n, offset, mass=heavy, motion=swarm.Guide(tuple(along), stiffness=spring))
        for n, offset, heavy, along, spring in planes
    ]
    result = ran(swarm.Scene(surfaces), start, method, 0.16)
    walls = [(np.array(n), *rest) for n, *rest in planes]
    x, v, s, u = steps_of_newton(start, walls, method, 80)
    seen = result.observables
    assert seen["impacts"][-1] >= 2
    assert seen["collisions"][-1] >= 2
    assert abs(result.particles.position.T - x).max() < 1e-12
    assert abs(result.particles.velocity.T - v).max() < 1e-10
    for q, (_n, _offset, _mass, along, _spring) in enumerate(walls):
        assert seen["wall_position"][-1, q] == pytest.approx(s[q] * along, abs=1e-12)
        assert seen["wall_velocity"][-1, q] == pytest.approx(u[q] * along, abs=1e-10)


# --- What goes with it -----------------------------------------------------------------------------------


def lid_run(scene):
    """A run of the handful under the lid, observed at its start."""
    start = handful()
    start.spin = np.zeros((3, len(start)))
    run = GrainsRun(scene.compiled(0.1), start, swarm.Penalty(5e-4, 5e3), 1, None, "never", Seeding(), Watched())
    run.observe()
    return run


def test_a_run_with_a_lid_that_is_halted_and_restored_has_the_same_bits(tmp_path):
    scene = lidded(law=LAWS[3])
    with lid_run(scene) as whole, lid_run(scene) as first, lid_run(scene) as second:
        for k in (1, 2):
            assert whole.advance(100.0, 0.05 * k)
        first.advance(100.0, 0.05)
        first.halt(17)
        assert not first.advance(100.0, 0.1)
        checkpoint.save(tmp_path / "a", checkpoint.SavedRun("", "", "", "", 12, ""), first.arrays())
        second.restore(checkpoint.read(tmp_path / "a")[1], True)
        for run in (first, second):
            assert run.advance(100.0, 0.1)
        for run in (whole, first, second):
            assert run.advance(20.0, 0.11)
        expected = whole.arrays()
        for run in (first, second):
            assert all(array.tobytes() == expected[name].tobytes() for name, array in run.arrays().items())
            for name in ("wall_position", "wall_velocity", "total_energy"):
                assert np.array_equal(run.seen()[name], whole.seen()[name])
        assert whole.seen()["wall_velocity"][1, 2] != 0.0


def test_what_happens_at_a_lid_is_counted_and_logged(tmp_path):
    log = tmp_path / "impacts.h5"
    scene, method = lidded(0.0), swarm.Penalty(5e-4, 5e3)
    result = ran(scene, handful(speed=2.0), method, 0.2, member_impacts=True, impacts=log)
    with swarm.load_impacts(log) as rows:
        at_lid = rows.table()
    at_lid = at_lid[at_lid["surface"] == 1]
    assert len(at_lid) > 3
    assert result.observables["impulse"][-1, 1] >= at_lid["impulse"].sum() > 0.0


def test_a_lid_passes_no_ball_where_it_is_fast():
    lid = swarm.Plane((0.0, 0.0, 1.0), 0.5, mass=5.0, motion=swarm.Guide((0.0, 0.0, 1.0), speed=-40.0))
    start = one((0.0, 0.0, 0.3), (0.0, 0.0, 0.0))
    result = ran(swarm.Scene([lid]), start, swarm.Penalty(1e-4, 1e6), 0.1)
    assert result.particles.velocity[2, 0] == pytest.approx(-80.0 * 5.0 / 5.3, rel=1e-11)
    with pytest.raises(swarm.RunError, match=r"surface 0: it moves by more than 8 radii .* smaller dt"):
        ran(swarm.Scene([lid]), start, swarm.Penalty(0.1, 1e4), 0.2)


def test_a_move_against_a_solid_with_a_mass_is_as_long_as_it_is_thick():
    """The solid is 0.2 m thick, and moves by 0.12 m in a step; by 0.4 m; by that with the ball; by 0.4 m later."""
    ball, method = one((0.05, 0.0, 0.0), (0.0, 0.0, 0.0)), swarm.Penalty(2e-4, 5e8)
    solid = lambda v: swarm.Sphere(0.1, (0.0, 0.0, 0.5), "outside", mass=1e12, motion=v)  # noqa: E731
    slow, fast = swarm.Translation((0.0, 0.0, -600.0)), swarm.Translation((0.0, 0.0, -2000.0))
    result = ran(swarm.Scene([solid(slow)]), ball, method, 2e-3)
    assert result.observables["impacts"][-1] == 1
    assert result.observables["energy_error"].max() < 1e-13
    with pytest.raises(SceneError, match=r"flies 0\.4 m, as it moves.* 0\.2 m thick; use dt < 0\.0001 s"):
        ran(swarm.Scene([solid(fast)]), ball, method, 2e-3)
    ball.velocity[2] = -2000.0
    result = ran(swarm.Scene([solid(fast)]), ball, method, 2e-3)
    assert result.observables["wall_velocity"][-1, 0].tolist() == [0.0, 0.0, -2000.0]
    ball.velocity[2] = 0.0
    falls = swarm.Scene([solid(swarm.Guide((0.0, 0.0, 1.0), speed=-800.0))], gravity=(2e6, 0.0, 0.0))
    with pytest.raises(swarm.RunError, match=r"moves by 0\.246 m .* solid is 0\.2 m thick.* use dt < 0\.00016 s"):
        ran(falls, one((-0.15, 0.0, 0.0), (0.0, 0.0, 0.0)), method, 2e-3)


@pytest.mark.parametrize(
    "motion", [{}, {"mass": 1e9}, {"mass": 1e9, "motion": swarm.Translation((200.0, -200.0, 0.0))},
               {"motion": swarm.Translation((200.0, -200.0, 0.0))}]
)  # fmt: skip
def test_a_step_through_the_corner_of_a_solid_is_refused_however_it_moves(motion):
    """By 0.26 m along x and y against the box, the ends of which are in no contact."""
    box = swarm.Box((0.3, 0.3, 0.3), side="outside", **motion)
    own = np.array([-260.0, 260.0, 0.0]) + (0.0 if "motion" not in motion else np.array([200.0, -200.0, 0.0]))
    with pytest.raises(swarm.RunError, match=r"overlaps surfaces\[0\] \(Box\) by 0\.12 m, more than its radius"):
        ran(swarm.Scene([box]), one((0.41, 0.15, 0.0), own), swarm.Penalty(1e-3, 1e6), 3e-3)


def test_a_solid_that_moves_by_itself_is_as_thick_as_it_is_in_the_error_of_a_jump():
    solid = swarm.Sphere(0.1, (0.0, 0.0, 0.5), "outside", motion=swarm.Translation((0.0, 0.0, -1000.0)))
    with pytest.raises(swarm.RunError, match=r"moves by 0\.266 m .* solid is 0\.2 m thick.* use dt < 0\.00015 s"):
        ran(swarm.Scene([solid]), one((0.05, 0.01, 0.0), (0.0, 0.0, 0.0)), swarm.Penalty(2e-4, 5e8), 2e-3)


def test_a_ball_that_a_piston_squeezes_is_reported():
    piston = swarm.Plane((0.0, 0.0, 1.0), 0.5, mass=1e3, motion=swarm.Guide((0.0, 0.0, 1.0), speed=-3.0))
    start = one((0.0, 0.0, 0.1), (0.0, 0.0, 0.0))
    with pytest.raises(swarm.RunError, match="or more, and more where a wall with a mass squeezes it, got 10000"):
        ran(swarm.Scene([piston, FLOOR]), start, swarm.Penalty(1e-3, 1e4), 0.5)


def test_an_opening_moves_with_its_wall():
    """A hole in a lid that balls have lifted: they leave through it where it is now."""
    hole = swarm.Sphere(0.3, (0.0, 0.0, 0.5))
    lid = swarm.Plane((0.0, 0.0, 1.0), 0.5, mass=1.0, motion=swarm.Guide((1.0, 0.0, 0.0), speed=1.0), openings=[hole])
    start = swarm.Particles([[0.5, 0.0], [0.0, 0.0], [0.1, 0.1]], [[0.0, 0.0], [0.0, 0.0], [0.6, 0.6]], radius=0.1)
    result = ran(swarm.Scene([lid, FLOOR]), start, swarm.Penalty(1e-3, 1e4), 0.7, every=0.1)
    assert result.observables["escaped"][-1] == 1
    assert np.isnan(result.escape_time).tolist() == [False, True]
    assert result.observables["energy_error"].max() < 1e-13


def test_balls_are_not_born_in_a_lid_that_has_come_down():
    lid = swarm.Plane((0.0, 0.0, 1.0), 2.0, mass=1e6, motion=swarm.Guide((0.0, 0.0, 1.0), speed=-1.0))
    vessel = swarm.Box((0.5, 0.5, 1.5), (0.0, 0.0, 0.5))
    above = swarm.Box((0.4, 0.4, 0.2), (0.0, 0.0, 1.5))
    source = swarm.Source(above, volume=True, times=[0.1, 1.5], speed=0.1, radius=0.1, blocked="report")
    result = ran(
        swarm.Scene([vessel, lid]), None, swarm.Penalty(1e-3, 1e4), 1.6, every=0.4, sources=[source], seed=2
    )  # fmt: skip
    assert result.observables["born"][-1].tolist() == [1]
    assert result.observables["blocked"][-1].tolist() == [1]


@pytest.mark.parametrize(("present", "blocked"), [([(0.0, 1.0)], 0), ([(1.0, math.inf)], 1)])
def test_a_birth_asks_for_the_lid_of_its_time(present, blocked):
    """Where the lid has come down to, which has left the scene before, or has come since the start."""
    lid = swarm.Plane((0.0, 0.0, 1.0), 2.0, mass=1.0, motion=swarm.Translation((0.0, 0.0, -1.0)), present=present)
    above = swarm.Box((0.4, 0.4, 0.2), (0.0, 0.0, 1.5))
    source = swarm.Source(above, volume=True, times=[1.5], speed=0.1, radius=0.1, blocked="report")
    scene = swarm.Scene([swarm.Box((0.5, 0.5, 1.5), (0.0, 0.0, 0.5)), lid])
    result = ran(scene, None, swarm.Penalty(1e-2, 1e4), 1.6, every=0.4, sources=[source], seed=2)
    assert result.observables["born"][-1].tolist() == [1 - blocked]
    assert result.observables["blocked"][-1].tolist() == [blocked]


@pytest.mark.parametrize("method", [swarm.Penalty(1e-3, 1e4), swarm.Impact()])
@pytest.mark.parametrize(
    "lid", [{"mass": 5.0, "motion": swarm.Guide((0, 0, 1), speed=2.0)}, {"motion": swarm.Translation((0.0, 0.0, 2.0))},
            {"present": [(0.0, 0.3)]}]
)  # fmt: skip
def test_a_birth_waits_until_the_wall_in_its_place_has_left(lid, method):
    """Also where no ball moves, from whose speed follows when a place is tried again."""
    place = swarm.Box((0.15, 0.15, 0.1), (0.0, 0.0, 0.5))
    source = swarm.Source(place, volume=True, times=[0.05], speed=0.0, radius=0.08, blocked="wait")
    scene = swarm.Scene([swarm.Box((0.5, 0.5, 2.0), (0.0, 0.0, 1.0)), swarm.Plane((0.0, 0.0, 1.0), 0.3, **lid)])
    seen = ran(scene, None, method, 0.5, every=0.05, sources=[source], seed=3).observables
    assert seen["blocked"][-1].tolist() == [1]
    assert seen["born"][:3].ravel().tolist() == [0, 0, 0]
    assert seen["born"][-1].tolist() == [1]


def test_a_wall_that_goes_loses_what_it_stores_and_a_lid_moves_on():
    scene = swarm.Scene(
        [swarm.Plane((0, 0, -1), 0.0, present=[(0.0, 0.1)]), swarm.Plane((0, 0, 1), 0.2, mass=1.0, motion=UP)],
        gravity=(0.0, 0.0, -9.81),
    )
    result = ran(scene, one((0.0, 0.0, 0.1), (0.0, 0.0, 0.0)), swarm.Penalty(1e-3, 1e4), 0.2, every=0.05)
    assert result.observables["energy_error"].max() < 1e-13
    assert result.observables["wall_position"][-1, 1, 2] < -0.03


def test_a_lid_that_comes_is_where_it_has_moved():
    lid = swarm.Plane(
        (0.0, 0.0, 1.0), 0.5, mass=1.0, motion=swarm.Guide((0.0, 0.0, 1.0), speed=-1.0), present=[(0.2, math.inf)]
    )
    scene = swarm.Scene([FLOOR, lid])
    for z, is_free in ((0.35, False), (0.15, True)):
        with nullcontext() if is_free else pytest.raises(swarm.RunError, match=r"surfaces\[1\].* at 0.2 s"):
            result = ran(scene, one((0.0, 0.0, z), (0.0, 0.0, 0.0)), swarm.Penalty(1e-3, 1e4), 0.3, every=0.1)
    assert result.observables["wall_velocity"][-1, 1, 2] == pytest.approx(-0.7 / 1.3, rel=1e-12)


def test_a_lid_in_a_plane_stays_in_it():
    lid = swarm.Plane((0.0, 1.0, 0.0), 0.4, mass=0.5, motion=swarm.Guide((0.0, 1.0, 0.0), stiffness=10.0), friction=0.3)
    box = swarm.Box((0.5, 0.5, 0.5))
    start = swarm.Particles(
        [[-0.2, 0.1, 0.3], [0.1, 0.2, 0.1], [0.0] * 3], [[1.0, 0.3, -1.0], [1.0, 0.8, 0.5], [0.0] * 3], 0.2, radius=0.08
    )
    result = ran(swarm.Scene([box, lid], plane="z"), start, swarm.Penalty(5e-4, 5e3), 0.5, every=0.1)
    assert (result.particles.position[2] == 0.0).all()
    assert (result.observables["wall_position"][:, 1, 2] == 0.0).all()
    assert result.observables["energy_error"].max() < 1e-13
    assert abs(result.observables["wall_position"][:, 1, 1]).max() > 1e-3


def test_a_lid_lies_on_a_layer_that_repeats():
    """In the cell that repeats across the axis of its guide the lid is the same everywhere."""
    lid = swarm.Plane((0.0, 0.0, 1.0), 0.45, mass=0.8, motion=UP, friction=0.3)
    start = handful(speed=0.3)
    start.position += np.array([[0.3], [0.3], [0.22]])
    scene = swarm.Scene([FLOOR, lid], gravity=(0.0, 0.0, -9.81), period=(0.6, 0.7, None))
    result = ran(scene, start, swarm.Penalty(5e-4, 5e3), 0.2, every=0.1)
    assert result.observables["energy_error"].max() < 1e-13
    assert result.observables["wall_position"][-1, 1, 2] < -0.005
    with pytest.raises(SceneError, match="mass and inertia must be None where the scene has a period"):
        ran(scene, start, swarm.Impact(), 0.1)


def test_a_light_wall_asks_for_short_steps(caplog):
    scene = swarm.Scene([swarm.Sphere(0.65, mass=1e-4)])
    ran(scene, one((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), swarm.Penalty(1e-3, 1e4), 1e-3)
    assert "the lightest and surfaces[0], 0.0001 kg, touch for 0.000314 s; use dt <= 1.6e-05 s" in caplog.text


def test_a_stiff_spring_of_a_wall_asks_for_short_steps(caplog):
    """Else it swings at another frequency, with the energy kept: by 2 % at six steps in half a period."""
    lid = lambda stiff: swarm.Plane((0.0, 0.0, 1.0), 0.5, mass=0.1, motion=swarm.Guide((0, 0, 1), stiffness=stiff))  # noqa: E731
    ball, method = one((0.0, 0.0, 0.2), (0.0, 0.0, 0.0)), swarm.Penalty(1e-3, 1e3)
    ran(swarm.Scene([FLOOR, lid(2.7e4)]), ball, method, 1e-3)
    assert "the spring" not in caplog.text
    ran(swarm.Scene([FLOOR, lid(2.8e4)]), ball, method, 1e-3)
    assert "the spring of surfaces[1]: half a period of 0.1 kg on it is 0.00594 s; use dt <= 0.0003 s" in caplog.text


@pytest.mark.slow
def test_compiled_steps_with_a_lid_have_the_bits_of_plain_python():
    scene, method = lidded(law=LAWS[3]), swarm.Penalty(5e-4, 5e3)
    plain, compiled = (ran(scene, handful(), method, 0.1, compile=choice) for choice in ("never", "always"))
    for name in ("position", "velocity", "spin"):
        assert (getattr(plain.particles, name) == getattr(compiled.particles, name)).all()
    for name in ("wall_position", "wall_velocity", "total_energy"):
        assert (plain.observables[name] == compiled.observables[name]).all()


def test_a_mesh_with_a_mass_is_pushed_as_a_whole():
    corners = np.array([(x, y, z) for x in (-0.2, 0.2) for y in (-0.2, 0.2) for z in (-0.2, 0.2)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [three for a, b, c, d in quads for three in ((a, b, c), (a, c, d))]
    scene, v = swarm.Scene([swarm.Mesh(corners, triangles, "outside", mass=0.9)]), (0.1, 0.0, -1.0)
    start = one((0.05, 0.1, 0.35), v)
    result = ran(scene, start, swarm.Penalty(5e-4, 1e4), 0.15)
    assert result.observables["wall_velocity"][-1, 0] == pytest.approx([0.0, 0.0, -0.5], abs=1e-12)
    assert result.particles.velocity[:, 0] == pytest.approx([0.1, 0.0, 0.5], abs=1e-12)


@pytest.mark.parametrize(
    ("surfaces", "words"),
    [
        ([swarm.Sphere(9.0, mass=1.0, temperature=1.0)], "no temperature and no laws where it has a mass"),
        ([swarm.Sphere(9.0, mass=1.0, laws=[swarm.Lambert()])], "no temperature and no laws where it has a mass"),
        (
            [swarm.Box((9.0, 9.0, 9.0), inertia=1.0, motion=swarm.Rotation((0.0, 0.0, 1.0), 0.0))],
            "inertia must be None .* give it a mass and a Guide",
        ),
        (
            [swarm.Sphere(9.0, laws=[swarm.Sticky(0.1)]), swarm.Plane((0.0, 0.0, 1.0), 5.0, mass=1.0)],
            "must not let particles with a radius wait where a wall has a mass",
        ),
    ],
)
def test_what_walls_with_a_mass_do_not_know_is_refused(surfaces, words):
    with pytest.raises(SceneError, match=words):
        ran(swarm.Scene(surfaces), handful(), swarm.Penalty(1e-3, 1e4), 0.1)
