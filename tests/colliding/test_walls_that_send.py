"""Balls that meet at instants among walls that let them out, absorb them, or send them off by a law."""

import itertools
import math

import numpy as np
import pytest
from colliding.test_colliding import depth, frames, gas, run_of

import swarm

HOLE = swarm.Sphere(0.35, center=(1.0, 0.0, 0.0))


def test_a_ball_escapes_where_its_foot_is_in_the_opening():
    """Three balls come to the right wall, one beside the hole with its centre, one with its foot within."""
    y = np.array([0.0, 0.34, 0.36])
    start = swarm.Particles([[0.0] * 3, y, [-0.3, 0.0, 0.3]], [[1.0] * 3, [0.0] * 3, [0.0] * 3], radius=0.1)
    start.position[2] = [0.0, 0.0, 0.0]
    start.position[0] = [0.2, 0.0, -0.3]
    wide = swarm.Sphere(0.35, center=(1.0, 0.0, 0.0))
    scene = swarm.Scene([swarm.Box((1.0,) * 3, openings=[wide])])
    seen = swarm.simulate(scene, start, swarm.Impact(), until=1.5, compile="never")
    np.testing.assert_allclose(seen.escape_time[:2], [0.7, 0.9], atol=1e-15)
    assert math.isnan(seen.escape_time[2])
    assert seen.observables["escaped"][-1] == 2
    np.testing.assert_allclose(seen.particles.position[0], [0.9, 0.9, 0.6], atol=1e-15)
    assert seen.observables["impacts"][-1] == 1


def test_an_escaped_ball_meets_no_other():
    start = swarm.Particles([[0.0, -0.5], [0.0] * 2, [0.0] * 2], [[1.0, 0.5], [0.0] * 2, [0.0] * 2], radius=0.1)
    scene = swarm.Scene([swarm.Box((1.0,) * 3, openings=[swarm.Sphere(0.05, center=(1.0, 0.0, 0.0))])])
    seen = swarm.simulate(scene, start, swarm.Impact(), until=5.0, compile="never")
    np.testing.assert_allclose(seen.escape_time, [0.9, 2.8], atol=1e-14)
    assert seen.observables["collisions"][-1] == 0
    np.testing.assert_allclose(seen.particles.position[0], [0.9, 0.9], atol=1e-15)


def test_the_impulse_and_the_energy_of_a_gas_that_escapes():
    scene, start = gas(n=30)
    scene = swarm.Scene([swarm.Box((1.0,) * 3, openings=[HOLE])], gravity=(0.0, 0.0, -1.0))
    with run_of(scene, start) as run:
        run.observe()
        for k in range(1, 9):
            assert run.advance(0.25, 0.25 * k)
            seen = run.seen()
            there = np.isnan(run.state.escape_time)
            assert depth(scene, run.state.position[:, there], start.radius[there]) < 1e-15
            assert seen["energy_error"] < 1e-13
        assert 2 <= seen["escaped"] == (~there).sum()


def test_an_opening_that_opens_and_shuts():
    """The first ball finds it shut, the second one open, the third one shut again."""
    valve = swarm.Opening(swarm.Sphere(0.3, center=(1.0, 0.0, 0.0)), times=[(0.5, 1.0)])
    start = swarm.Particles([[0.6, 0.1, -0.4], [0.21, 0.0, -0.21], [0.0] * 3], [[1.0] * 3, [0.0] * 3, [0.0] * 3],
                            radius=0.1)  # fmt: skip
    scene = swarm.Scene([swarm.Box((1.0,) * 3, openings=[valve])])
    seen = swarm.simulate(scene, start, swarm.Impact(), until=1.5, compile="never")
    np.testing.assert_allclose(seen.escape_time, [math.nan, 0.8, math.nan], atol=1e-15)
    assert seen.observables["impacts"][-1] == 2


class Trap(swarm.WallLaw):
    """Absorbs those that are fast."""

    speed: float

    def leave(self, v, n, u, random, mass):
        from swarm.kernel.vector import square
        from swarm.surfaces.wall_law import mirrored

        return swarm.Leave(mirrored(v, n, u), stays=square(v) < self.speed * self.speed)


def test_a_wall_absorbs():
    start = swarm.Particles([[0.0, 0.0], [-0.4, 0.4], [0.0] * 2], [[1.0, 2.5], [0.0] * 2, [0.0] * 2], radius=0.1)
    scene = swarm.Scene([swarm.Box((1.0,) * 3, laws=[Trap(2.0)])])
    seen = swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile="never")
    np.testing.assert_allclose(seen.absorbed_time, [math.nan, 0.36], atol=1e-15)
    assert seen.observables["absorbed"][-1].tolist() == [1]
    assert seen.particles.position[0, 1] == pytest.approx(0.9, abs=1e-15)
    np.testing.assert_allclose(seen.observables["impulse"][-1], 2.0 + 2.5)
    assert seen.observables["energy_error"].max() < 1e-14


LAWS = {
    "thermal": {"temperature": 2.0, "accommodation": 0.7},
    "Lambert": {"laws": [swarm.Lambert()]},
    "Cercignani-Lampis": {"laws": [swarm.CercignaniLampis(2.0, 0.5, 0.5)]},
}


@pytest.mark.parametrize("kind", LAWS)
def test_walls_that_send_balls_off(kind):
    """Energy with heat is kept; the bits are the same for threads, frames, halts and resumes."""
    _scene, start = gas(n=30)
    scene = swarm.Scene([swarm.Box((1.0,) * 3, **LAWS[kind])])
    expected, speed, seen = frames(run_of(scene, start), [0.5, 1.0])
    assert seen["energy_error"] < 1e-14
    assert seen["impacts"] > 15
    if kind != "Lambert":
        assert abs(seen["wall_heat"].sum()) > 0.1
    two, again, _seen = frames(run_of(scene, start, 2), [0.1, 0.7, 1.0])
    assert (two == expected).all()
    assert (again == speed).all()
    kept = None
    with run_of(scene, start) as run:
        run.observe()
        run.advance(0.5, 0.5)
        run.halt(7)
        while not run.advance(0.5, 1.0):
            run.halt(7)
            kept = kept or {name: array.copy() for name, array in run.arrays().items()}
    with run_of(scene, start) as run:
        run.restore(kept, True)
        assert run.advance(0.5, 1.0)
        assert (run.state.position == expected).all()
        assert (run.state.velocity == speed).all()


def test_another_seed_sends_balls_elsewhere():
    _scene, start = gas(n=10)
    scene = swarm.Scene([swarm.Box((1.0,) * 3, temperature=1.0)])
    one, two = (
        swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile="never", seed=seed).particles for seed in (1, 2)
    )
    assert (one.position != two.position).any()


def test_thermal_walls_that_move_and_a_gas_under_gravity():
    _scene, start = gas(n=20)
    hot = swarm.Box((1.0,) * 3, temperature=1.0, motion=swarm.Oscillation((0.02, 0.0, 0.0), 1.5))
    _position, _velocity, seen = frames(run_of(swarm.Scene([hot], gravity=(0.0, 0.0, -1.0)), start), [0.5, 1.0])
    assert seen["energy_error"] < 1e-13
    assert seen["max_penetration"] < 1e-14
    assert seen["wall_work"][0] != 0.0


def test_a_box_of_many_holes_lets_all_out():
    """Each face open in its middle: balls leave in the order of time, and each once."""
    holes = [
        swarm.Sphere(0.6, center=tuple(sign * (k == axis) for k in range(3)))
        for axis, sign in itertools.product(range(3), (1.0, -1.0))
    ]
    _scene, start = gas(n=20)
    scene = swarm.Scene([swarm.Box((1.0,) * 3, openings=holes)])
    seen = swarm.simulate(scene, start, swarm.Impact(), until=20.0, every=1.0, compile="never")
    assert seen.observables["escaped"][-1] == (~np.isnan(seen.escape_time)).sum() > 15
    assert (np.diff(seen.observables["escaped"]) >= 0).all()
