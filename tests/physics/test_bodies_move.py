"""Bodies: what a run conserves, its order, blows against closed forms, and its bits."""

import importlib.util
import itertools
import re
from pathlib import Path

import numpy as np
import pytest

import swarm
from swarm.bodies.body_run import BodyRun

ROOT = Path(__file__).parents[2]
STEP = 5e-3
SPHERE = [swarm.Sphere(0.5)]
BOX = [swarm.Box((0.5, 0.4, 0.3))]
MAKERS = {"dumbbell": lambda: swarm.dumbbell(0.1, 2.0), "tetrahedron": lambda: swarm.tetrahedron(0.1, 4.0)}


def run(bodies, surfaces, until, dt=STEP, gravity=None, **options):
    scene = swarm.Scene(surfaces, gravity=gravity)
    order = options.pop("order", 2)
    return swarm.simulate(scene, bodies, swarm.Impact(dt=dt, order=order), until=until, **options)


def some(kind, surfaces, n, seed=1):
    return swarm.place(swarm.Scene(surfaces), MAKERS[kind](), n, speed=1.0, spin=4.0, seed=seed)


@pytest.mark.parametrize("gravity", [None, (0.0, 0.0, -1.0)], ids=["free", "falling"])
@pytest.mark.parametrize("surfaces", [SPHERE, BOX], ids=["sphere", "box"])
@pytest.mark.parametrize("kind", MAKERS)
def test_energy_links_and_walls_are_kept(kind, surfaces, gravity):
    # Eight cases of two kinds: seconds each in plain Python.
    result = run(some(kind, surfaces, 15), surfaces, 20.0, gravity=gravity, every=5.0, compile="always")
    seen = result.observables
    assert seen["impacts"][-1] > 15 * 10
    assert seen["energy_error"].max() < 1e-12
    assert seen["link_error"].max() < 1e-13
    assert seen["max_penetration"].max() < 1e-13


def test_angular_momentum_about_the_centre_of_a_sphere_is_kept():
    seen = run(some("tetrahedron", SPHERE, 15), SPHERE, 20.0, every=5.0).observables
    change = np.abs(seen["angular_momentum"] - seen["angular_momentum"][0]).max()
    # A first guess of D that is not the same for all ties leaves 1e-12.
    assert change < 1e-13 * np.abs(seen["angular_momentum"][0]).max()


def test_momentum_of_free_flight_is_kept():
    far = [swarm.Sphere(1000.0)]
    seen = run(some("tetrahedron", far, 40), far, 1.0).observables
    assert seen["impacts"][-1] == 0
    assert np.abs(np.diff(seen["momentum"], axis=0)).max() < 1e-12 * 40 * 4.0


def test_bits_do_not_depend_on_threads_or_blocks():
    start = some("tetrahedron", BOX, 70)
    ends = [
        run(start, BOX, 2.0, threads=threads, block_size=size).bodies for threads, size in [(1, 7), (2, 16), (2, 70)]
    ]
    for end in ends[1:]:
        np.testing.assert_array_equal(end.position, ends[0].position)
        np.testing.assert_array_equal(end.velocity, ends[0].velocity)


def test_a_body_does_not_depend_on_its_neighbours():
    start = some("tetrahedron", BOX, 20)
    one = swarm.Bodies(start.body, start.position[:, :, 3:4], start.velocity[:, :, 3:4])
    np.testing.assert_array_equal(
        run(one, BOX, 5.0).bodies.position[:, :, 0], run(start, BOX, 5.0).bodies.position[:, :, 3]
    )


@pytest.mark.parametrize("restitution", [1.0, 0.5])
def test_the_blow_of_a_rod_that_meets_a_plane(restitution):
    # n K n of one end of a dumbbell of masses m, tilted by a: (1 + sin^2 a)/(2 m), without inertia along the rod
    tilt, m, speed = 0.6, 1.0, 1.0
    ends = 0.05 * np.array([[-np.cos(tilt), 0.0, -np.sin(tilt)], [np.cos(tilt), 0.0, np.sin(tilt)]])
    body = swarm.Body(ends, mass=m, links=[(0, 1)])
    position = (ends + np.array([0.0, 0.0, 0.05])).T[:, :, None]
    velocity = np.zeros((3, 2, 1))
    velocity[2] = -speed
    plane = [swarm.Plane((0.0, 0.0, -1.0), 0.0, restitution=restitution)]
    end = run(swarm.Bodies(body, position, velocity), plane, 0.04, compile="never").bodies.velocity[:, :, 0]
    inverse = 1.0 / (2.0 * m) + np.cos(tilt) ** 2 * 0.05**2 / (2.0 * m * 0.05**2)
    impulse = (1.0 + restitution) * speed / inverse
    np.testing.assert_allclose(end.sum(axis=1), [0.0, 0.0, impulse / m - 2.0 * speed], rtol=1e-12, atol=1e-12)


def test_what_restitution_takes_is_booked():
    walls = [swarm.Box((0.5, 0.4, 0.3), restitution=0.8)]
    seen = run(some("tetrahedron", walls, 20), walls, 5.0).observables
    assert seen["total_energy"][-1] < 0.9 * seen["total_energy"][0]
    assert seen["energy_error"].max() < 1e-12


def test_bodies_come_to_rest_on_a_rough_floor():
    walls = [swarm.Box((0.5, 0.4, 0.3), restitution=0.3, friction=0.3)]
    seen = run(some("tetrahedron", walls, 8), walls, 8.0, gravity=(0.0, 0.0, -5.0), every=4.0).observables
    assert seen["sliding"][-1] >= 7
    assert seen["kinetic_energy"][-1] < 1e-4 * seen["kinetic_energy"][0]
    assert seen["max_penetration"].max() < 1e-9


def top(t, dt, order):
    """A tetrahedron of four masses that turns freely: its points after t."""
    points = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]]) * 0.1
    mass = np.array([1.0, 2.0, 3.0, 4.0])
    points = points - mass @ points / mass.sum()
    body = swarm.Body(points, mass=mass, links=[(i, j) for i in range(4) for j in range(i)])
    velocity = np.cross([3.0, -2.0, 5.0], points)
    start = swarm.Bodies(body, points.T[:, :, None], velocity.T[:, :, None])
    return run(start, [swarm.Sphere(100.0)], t, dt=dt, order=order).bodies.position[:, :, 0]


@pytest.mark.parametrize("order", [2, 4])
def test_a_free_top_converges_with_its_order_to_eulers_equations(order):
    points = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]]) * 0.1
    mass = np.array([1.0, 2.0, 3.0, 4.0])
    points = points - mass @ points / mass.sum()
    exact = euler(points, mass, np.array([3.0, -2.0, 5.0]), 1.0)
    coarse, fine = (np.abs(top(1.0, dt, order).T - exact).max() for dt in (0.02, 0.01))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.2)


def euler(points, mass, spin, t):
    """The points of a rigid body after t, by the equations of its rotation with DOP853."""
    from scipy.integrate import solve_ivp

    inertia = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(mass, points, strict=True))

    def rate(_t, state):
        turn = state.reshape(3, 3)
        omega = turn @ np.linalg.solve(inertia, turn.T @ momentum)
        return np.cross(omega, turn.T).T.ravel()

    momentum = inertia @ spin
    end = solve_ivp(rate, (0.0, t), np.eye(3).ravel(), method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    return points @ end.reshape(3, 3).T


def test_a_spring_keeps_its_energy():
    body = swarm.Body([[0.0, 0.0, 0.0], [0.12, 0.0, 0.0]], mass=1.0, springs=[(0, 1, 500.0, 0.1)])
    start = swarm.place(swarm.Scene(SPHERE), body, 20, speed=1.0, spin=3.0, seed=2)
    seen = run(start, SPHERE, 10.0, every=2.0).observables
    assert seen["impacts"][-1] > 100
    assert np.ptp(seen["contact_energy"]) > 1e-3
    assert seen["energy_error"].max() < 1e-12


def test_a_pendulum_hangs_from_its_anchor():
    body = swarm.Body([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0]], mass=1.0, links=[(0, 1)], anchors={0: None})
    start = swarm.Bodies(body, body.points.T[:, :, None], np.zeros((3, 2, 1)))
    result = run(start, SPHERE, 3.0, gravity=(0.0, 0.0, -9.81), every=0.5)
    np.testing.assert_array_equal(result.bodies.position[:, 0, 0], 0.0)
    assert result.observables["energy_error"].max() < 1e-12


def test_a_run_that_is_resumed_has_the_same_bits(tmp_path):
    start, scene = some("tetrahedron", BOX, 10), swarm.Scene(BOX)
    whole = run(start, BOX, 4.0, every=1.0, trajectory=tmp_path / "whole.h5", checkpoint=0.01).bodies.position
    path = tmp_path / "parts.h5"
    method, how = swarm.Impact(dt=STEP), {"until": 4.0, "every": 1.0, "trajectory": path, "checkpoint": 0.01}

    def stop(frame):
        if frame.number == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        swarm.simulate(scene, start, method, progress=stop, **how)
    end = swarm.simulate(
        scene, start, method, resume=(tmp_path / "parts.h5.checkpoint").exists(), overwrite=True, **how
    )
    np.testing.assert_array_equal(end.bodies.position, whole)


@pytest.mark.parametrize(
    ("method", "sentence"),
    [
        (swarm.Impact(), "Impact with a step"),
        (swarm.Impact(dt=0.01, contact_step=0.001), "contact_step must be 0"),
        (swarm.Verlet(dt=0.01, penalty=1.0), "Impact with a step"),
    ],
)
def test_a_method_that_cannot_serve_bodies_says_so(method, sentence):
    with pytest.raises(swarm.SceneError, match=sentence):
        swarm.simulate(swarm.Scene(SPHERE), some("dumbbell", SPHERE, 2), method, until=1.0)


def test_a_point_outside_at_the_start_is_named():
    body = swarm.dumbbell(0.1, 1.0)
    start = swarm.Bodies(body, (body.points + np.array([0.49, 0.0, 0.0])).T[:, :, None], np.zeros((3, 2, 1)))
    with pytest.raises(swarm.SceneError, match="must start inside"):
        run(start, SPHERE, 1.0)


def test_an_elastic_block_bounces_and_vibrates_with_its_energy():
    from swarm.bodies.elastic import block

    body = swarm.elastic(block((0.2, 0.1, 0.1), (1, 1, 1)), 1e5, 0.3, 1000.0)
    position = (body.points - body.points.min(axis=0) + np.array([-0.1, -0.05, 0.05])).T[:, :, None]
    start = swarm.Bodies(body, position, np.zeros_like(position))
    walls = [swarm.Plane((0.0, 0.0, -1.0), 0.0), swarm.Sphere(2.0)]
    seen = run(start, walls, 0.5, dt=1e-3, gravity=(0.0, 0.0, -9.81), every=0.05).observables
    assert seen["impacts"][-1] > 10
    assert seen["contact_energy"].max() > 0.05 * seen["total_energy"][0]
    assert seen["energy_error"].max() < 1e-12


def test_impacts_share_the_energy_of_cubes_over_their_six_freedoms(optimized):
    spec = importlib.util.spec_from_file_location("dice", ROOT / "examples" / "dice.py")
    dice = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(dice)
    result = dice.dice(count=300, until=15.0, every=7.5)
    translation, rotation = dice.energies(result.bodies)
    # Of 900 freedoms each with normal velocities the ratio has a standard deviation of 2/sqrt(900); some 3 of them.
    assert translation / rotation == pytest.approx(1.0, abs=0.2)
    assert result.observables["energy_error"].max() < 1e-12
    assert result.observables["max_penetration"].max() < 1e-13


# --- Halts in the middle of a frame ------------------------------------------------------------------------


def rough():
    walls = [swarm.Box((0.5, 0.4, 0.3), restitution=0.3, friction=0.3)]
    return swarm.Scene(walls, gravity=(0.0, 0.0, -5.0)), some("tetrahedron", walls, 18), 2


def whipping():
    scene = swarm.Scene(SPHERE, gravity=(0.0, 0.0, -9.81))
    return scene, swarm.place(scene, swarm.chain(6, 0.4, 1.0), 40, speed=1.0, spin=4.0, seed=1), 2


def tumbling():
    return swarm.Scene(BOX), some("tetrahedron", BOX, 80), 2


def composed():
    return swarm.Scene(BOX), some("dumbbell", BOX, 80), 4


@pytest.mark.parametrize("make", [rough, whipping, tumbling, composed])
def test_a_frame_that_is_halted_again_and_again_has_the_same_bits(make):
    scene, start, order = make()
    method, ends = swarm.Impact(dt=STEP, order=order), []
    for first, threads, size in ((None, 2, 16), (3, 1, 40), (50, 2, 7)):
        with BodyRun(scene.compiled(), (start, start.particles()), method, threads, size) as one:
            for k in range(3):
                passes = first
                while True:
                    if first is not None:
                        one.halt(passes)
                    if one.advance(0.7, 0.7 * (k + 1)):
                        break
                    passes = 2 * passes
            ends.append({name: array.copy() for name, array in one.arrays().items()})
    for end in ends[1:]:
        for name, array in end.items():
            np.testing.assert_array_equal(array, ends[0][name], err_msg=name)


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("spin", [300.0, 1e4])
def test_a_body_that_turns_by_radians_in_a_step_keeps_its_energy(kind, spin):
    # A step without a solution is cut; some have one with lengths that are right for a direction that is not.
    walls = [swarm.Sphere(1.0)]
    start = swarm.place(swarm.Scene(walls), MAKERS[kind](), 4, speed=0.5, spin=spin, seed=1)
    seen = run(start, walls, 0.05, dt=0.01).observables
    assert seen["energy_error"].max() < 1e-10
    assert seen["link_error"].max() < 1e-13


def test_a_body_that_turns_far_in_a_step_is_reported_before_the_run(caplog):
    scene = swarm.Scene([swarm.Sphere(1000.0)])
    for spin, warning in ((20.0, ""), (400.0, r"body 0 turns by 2 rad in a step of 0.005 s \(links\[0\]\)")):
        start = swarm.place(scene, MAKERS["dumbbell"](), 1, spin=1.0, seed=1)
        relative = start.velocity[:, 0] - start.velocity[:, 1]
        rate = np.sqrt((relative**2).sum()) / 0.1
        turning = swarm.Bodies(start.body, start.position, start.velocity * (spin / rate))
        caplog.clear()
        swarm.simulate(scene, turning, swarm.Impact(dt=STEP), until=STEP)
        assert bool(warning) == bool(caplog.text)
        if warning:
            assert re.search(warning, caplog.text)


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("body", ["cube", "tetrahedron"])
def test_a_body_that_lands_flat_and_does_not_rebound_is_at_rest(body, friction):
    """All corners of a face strike at once and all velocities vanish but for round-off, which no energy scales up."""
    corners = {
        "cube": 0.1 * np.array(list(itertools.product((-1.0, 1.0), repeat=3))),
        "tetrahedron": np.array([(0.0, 0.0, 0.1), (0.2, 0.0, -0.1), (-0.1, 0.15, -0.1), (-0.1, -0.15, -0.1)]),
    }[body]
    made = swarm.rigid(corners, 1000.0)
    start = swarm.Bodies(made, (made.points + np.array([0.003, 0.002, 0.4])).T, np.zeros((3, 4)))
    floor = swarm.Plane((0.0, 0.0, -1.0), 0.0, restitution=0.0, friction=friction)
    result = run(start, [floor, swarm.Sphere(10.0)], 0.3, gravity=(0.0, 0.0, -9.81), compile="never")
    seen, contacts = result.observables, result.bodies.contact_points()
    assert seen["energy_error"].max() < 1e-14
    assert seen["kinetic_energy"][-1] < 1e-20 * seen["dissipated_energy"][-1]
    assert contacts[2].min() == pytest.approx(0.0, abs=1e-14)
