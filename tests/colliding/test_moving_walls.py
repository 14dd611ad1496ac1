"""Balls that meet at instants among walls that move: against a plain event loop, closed forms, and their books."""

import itertools
import math

import numpy as np
import pytest
from colliding.test_colliding import depth, frames, run_of
from physics import ball_loop

import swarm

FIXED = {"open": ["-x"]}


def gas(walls, n=12, radius=0.11, gravity=None, seed=3, box=(1.0, 1.0, 1.0), **pairs):
    random = np.random.default_rng(seed)
    places = np.array(list(itertools.product((-0.45, 0.0, 0.45), repeat=3)))
    position = random.permutation(places)[:n].T + random.uniform(-0.05, 0.05, (3, n))
    scene = swarm.Scene(walls, gravity=gravity, pairs=swarm.Pairs(**pairs) if pairs else None)
    start = swarm.Particles(
        position, random.normal(size=(3, n)), random.uniform(0.5, 2.0, n), radius=radius * random.uniform(0.6, 1.0, n)
    )
    return scene, start


def piston(motion):
    """A box whose right wall is moved."""
    return [swarm.Box((1.0, 1.0, 1.0), open=["+x"]), swarm.Plane((1.0, 0.0, 0.0), 0.95, motion=motion)]


MOTIONS = {
    "translation": swarm.Translation((-0.25, 0.0, 0.0)),
    "oscillation": swarm.Oscillation((0.1, 0.0, 0.0), 0.9, phase=0.4),
}


@pytest.mark.parametrize("gravity", [None, (0.0, 0.0, -2.0)])
@pytest.mark.parametrize("kind", MOTIONS)
def test_a_piston_as_a_plain_loop_of_events(kind, gravity):
    scene, start = gas(piston(MOTIONS[kind]), gravity=gravity)
    times = [0.3, 0.6]
    expected = ball_loop.follow(scene, start, times)
    with run_of(scene, start) as run:
        run.observe()
        for k, (before, moment) in enumerate(itertools.pairwise([0.0, *times])):
            assert run.advance(moment - before, moment)
            seen = run.seen()
            assert seen["collisions"] == expected.collisions[k]
            assert seen["impacts"] == expected.impacts[k]
            np.testing.assert_allclose(run.state.position, expected.position[k], atol=1e-8)
            np.testing.assert_allclose(run.state.velocity, expected.velocity[k], atol=1e-7)
            assert seen["energy_error"] < 1e-13
            assert seen["max_penetration"] < 1e-14
            assert depth(scene, run.state.position, start.radius) < 1e-15
        assert abs(seen["wall_work"][1]) > 1e-3
        assert seen["wall_work"][0] == 0.0


def test_a_drum_that_turns_as_a_plain_loop_of_events():
    drum = swarm.Box((0.8, 0.8, 0.8), motion=swarm.Rotation((0.0, 1.0, 0.0), 1.5, (0.0, 0.0, 0.0)))
    scene, start = gas([drum], radius=0.1, gravity=(0.0, 0.0, -1.0))
    start.position[:] *= 0.9
    expected = ball_loop.follow(scene, start, [0.5])
    _position, _velocity, seen = frames(run_of(scene, start), [0.5])
    assert seen["collisions"] == expected.collisions[0]
    assert seen["impacts"] == expected.impacts[0]
    np.testing.assert_allclose(_position, expected.position[0], atol=1e-8)
    assert seen["energy_error"] < 1e-13


@pytest.mark.parametrize("kind", MOTIONS)
def test_halts_threads_and_frames_change_no_bit(kind):
    scene, start = gas(piston(MOTIONS[kind]), gravity=(0.0, 0.0, -2.0), restitution=0.9)
    expected, speed, seen = frames(run_of(scene, start), [0.4, 0.8])
    two, again, _seen = frames(run_of(scene, start, 2), [0.1, 0.3, 0.35, 0.8])
    assert (two == expected).all()
    assert (again == speed).all()
    kept = None
    with run_of(scene, start) as run:
        run.observe()
        run.advance(0.4, 0.4)
        run.halt(3)
        while not run.advance(0.4, 0.8):
            run.halt(3)
            kept = kept or {name: array.copy() for name, array in run.arrays().items()}
        assert (run.state.position == expected).all()
    with run_of(scene, start) as run:
        run.restore(kept, True)
        assert run.advance(0.4, 0.8)
        assert (run.state.position == expected).all()
        assert (run.state.velocity == speed).all()
        again = run.seen()
    assert all(np.array_equal(again[name], value, equal_nan=True) for name, value in seen.items())


def test_a_box_that_is_shaken_fluidises_what_lies_in_it():
    """Grains on the floor of a shaken box; with losses their energy stays bounded, and the books agree."""
    frequency, far = 5.0, 0.02
    walls = [
        swarm.Box((0.3, 0.3, 0.5), restitution=0.8, motion=swarm.Oscillation((0.0, 0.0, far), frequency)),
    ]
    x = np.array([-0.2, 0.0, 0.2])
    position = np.array(list(itertools.product(x, x, [-0.4]))).T
    scene = swarm.Scene(walls, gravity=(0.0, 0.0, -9.81), pairs=swarm.Pairs(0.8))
    start = swarm.Particles(position, 0.0 * position, radius=0.08)
    with run_of(scene, start) as run:
        run.observe()
        for k in range(1, 6):
            assert run.advance(0.1, 0.1 * k)
            seen = run.seen()
            assert seen["energy_error"] < 1e-13
            assert seen["max_penetration"] < 1e-14
        assert seen["wall_work"][0] > 0.0
        assert seen["kinetic_energy"] > 0.0


def test_a_door_that_comes_and_goes():
    """A ball passes while the wall is not there, and one that comes in is met with the surface."""
    wall = swarm.Slab((1.0, 0.0, 0.0), 0.1, side="outside", present=[(1.0, math.inf)])
    start = swarm.Particles([[-0.5, -0.5], [-0.5, 0.5], [0.0, 0.0]], [[1.0, -0.2], [0.0] * 2, [0.0] * 2], radius=0.1)
    scene = swarm.Scene([swarm.Box((1.0,) * 3), wall])
    seen = swarm.simulate(scene, start, swarm.Impact(), until=7.0, compile="never")
    # One is through at 1 s, and bounces between 0.9 and 0.2 from then on; the other between -0.9 and -0.2.
    first = seen.particles.position[0]
    assert 0.2 - 1e-15 <= first[0] <= 0.9 + 1e-15
    assert -0.9 - 1e-15 <= first[1] <= -0.2 + 1e-15
    # At -0.9 after 2 s, at -0.2 after 5.5 s, and then 0.3 m back
    np.testing.assert_allclose(first[1], -0.5, atol=1e-14)


def test_a_wall_that_comes_where_a_ball_is_is_reported():
    wall = swarm.Slab((1.0, 0.0, 0.0), 0.1, side="outside", present=[(1.0, math.inf)])
    start = swarm.Particles((-0.25, 0.0, 0.0), (0.1, 0.0, 0.0), radius=0.1)
    with pytest.raises(
        swarm.RunError, match=r"surfaces\[1\] \(Slab\) must come where no particle is: at 1 s particle 0"
    ):
        swarm.simulate(swarm.Scene([swarm.Box((1.0,) * 3), wall]), start, swarm.Impact(), until=2.0, compile="never")


@pytest.mark.parametrize("spin", [None, (0.0, 0.0, 0.0)])
def test_friction_takes_a_ball_along_with_the_wall_where_they_touch(spin, tmp_path):
    """Without a spin it leaves as fast as the drum is at its surface; with one that is 2/7 of it."""
    drum = swarm.Cylinder(1.0, friction=100.0, restitution=0.5, motion=swarm.Rotation((0.0, 0.0, 1.0), 2.0))
    turns = None if spin is None else np.array(spin)[:, None]
    ball = swarm.Particles([[0.0], [0.0], [0.0]], [[1.0], [0.0], [0.0]], radius=0.2, spin=turns)
    end = swarm.simulate(
        swarm.Scene([drum]), ball, swarm.Impact(), until=0.9, compile="never", impacts=tmp_path / "log.h5"
    )
    along = 2.0 if spin is None else 2.0 * 2.0 / 7.0
    assert end.particles.velocity[:, 0] == pytest.approx([-0.5, along, 0.0], abs=1e-14)
    assert end.observables["energy_error"].max() < 1e-14
    assert swarm.load_impacts(tmp_path / "log.h5").table()["slip"] == pytest.approx(
        np.array([[0.0, -2.0, 0.0]]), abs=1e-14
    )
