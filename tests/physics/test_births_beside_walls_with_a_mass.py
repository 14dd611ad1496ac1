"""Points that are born, or wait, beside walls with a mass: against elastic collisions on a line."""

import numpy as np
import pytest

import swarm
from swarm.run.machine import run_of
from swarm.run.options import RunOptions
from swarm.run.preflight.admission import task_of
from swarm.surfaces.wall_law import Leave, mirrored

RIGHT, LEFT = (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)


def piston(mass=7.0):
    return swarm.Plane(RIGHT, 1.0, mass=mass, motion=swarm.Guide(RIGHT))


def run(surfaces, particles, until, frames=1, **options):
    scene = swarm.Scene(surfaces)
    return swarm.simulate(
        scene, particles, swarm.Impact(), until=until, every=until / frames, compile="never", seed=3, **options
    )


def test_births_at_given_times_push_a_piston():
    times, inlet = [0.25, 0.5, 1.125, 2.0], swarm.Sphere(1e-9, (0.0, 0.0, 0.0))
    source = swarm.Source(inlet, volume=True, times=times, beam=RIGHT, mass=1.0)
    result = run([piston()], None, until=6.0, frames=4, sources=[source])
    seen, wall, u, now, out = result.observables, 1.0, 0.0, 0.0, []
    # On a line each is at x = t - born until it meets the wall, and never comes back.
    for born in times:
        meet = now + (wall - (now - born)) / (1.0 - u)
        wall, now = wall + u * (meet - now), meet
        v, u = ((1.0 - 7.0) + 14.0 * u) / 8.0, u + 2.0 / 8.0 * (1.0 - u)
        out.append((wall, v, now))
    assert now < 6.0
    places = [x + v * (6.0 - t) for x, v, t in out]
    np.testing.assert_allclose(result.particles.position[0], places, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(seen["wall_velocity"][-1, 0], (u, 0.0, 0.0), rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(seen["wall_position"][-1, 0, 0], wall + u * (6.0 - now) - 1.0, rtol=0.0, atol=1e-8)
    assert seen["born"][:, 0].tolist() == [0, 3, 4, 4, 4]
    assert seen["energy_error"].max() <= 1e-14
    np.testing.assert_allclose(seen["source_energy"], 0.5 * seen["born"][:, 0], rtol=1e-14)


def test_frames_change_no_flight_of_what_is_born():
    vessel = swarm.Cylinder(0.5, axis=RIGHT)
    source = swarm.Source(swarm.Sphere(0.1), volume=True, rate=6.0, stop=2.5, speed=1.0)
    walls = [vessel, swarm.Plane(LEFT, 1.0), piston(20.0), swarm.Plane(RIGHT, 1.5)]
    start = swarm.Particles([[0.3, -0.4], [0.0, 0.1], [0.0, 0.2]], [[1.0, -0.5], [0.3, 0.2], [-0.2, 0.8]], 1.0)
    one, other = (run(walls[:3], start, 4.0, frames, sources=[source]) for frames in (1, 5))
    assert len(one.particles) > 6
    np.testing.assert_allclose(one.particles.position, other.particles.position, rtol=0.0, atol=1e-10)
    for result in (one, other):
        assert result.observables["energy_error"].max() <= 1e-13
        assert result.observables["max_penetration"].max() <= 1e-13


class Rest(swarm.WallLaw):
    """Lets particles wait for a quarter of a second."""

    def leave(self, v, n, u, random, mass):
        """Its kernel."""
        return Leave(mirrored(v, n, u), wait=0.25)


@pytest.mark.parametrize("frames", [1, 7])
def test_a_point_waits_at_a_wall_beside_a_piston(frames):
    floor = swarm.Plane(LEFT, 0.0, laws=[Rest()])
    start = swarm.Particles([[0.5], [0.0], [0.0]], [[2.0], [0.0], [0.0]], 1.0)
    result = run([floor, piston()], start, 5.0, frames)
    x, v, wall, u, now, impacts = 0.5, 2.0, 1.0, 0.0, 0.0, 0
    while True:
        step = (wall - x) / (v - u) if v > u else -x / v if v < 0.0 else np.inf
        if now + step >= 5.0:
            break
        x, wall, now, impacts = x + v * step, wall + u * step, now + step, impacts + 1
        if v > u:
            v, u = ((1.0 - 7.0) * v + 14.0 * u) / 8.0, u + 2.0 / 8.0 * (v - u)
        else:
            v, wait = -v, min(0.25, 5.0 - now)
            wall, now = wall + u * wait, now + wait
    assert impacts == result.observables["impacts"][-1] == 3
    np.testing.assert_allclose(result.particles.position[0, 0], x + v * (5.0 - now), rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(result.observables["wall_velocity"][-1, 1, 0], u, rtol=1e-14)
    assert result.observables["energy_error"].max() <= 1e-14


def test_no_point_waits_at_a_wall_with_a_mass():
    start = swarm.Particles([[0.5], [0.0], [0.0]], [[2.0], [0.0], [0.0]], 1.0)
    heavy = swarm.Plane(RIGHT, 1.0, mass=1.0, laws=[swarm.Sticky(0.1)])
    shaken = swarm.Plane(LEFT, 1.0, motion=swarm.Oscillation((0.1, 0.0, 0.0), 1.0))
    for walls in ([heavy], [swarm.Plane(LEFT, 1.0, laws=[swarm.Sticky(0.1)]), piston(), shaken]):
        with pytest.raises(swarm.SceneError, match=r"surfaces\[0\].laws\[0\] must not let particles wait where a wall"):
            run(walls, start, 1.0)


@pytest.mark.parametrize("radius", [None, 0.03])
def test_halts_change_no_bit_where_much_changes(radius):
    """With a mesh that is moved and open for a time, a wall that goes, births, and points that wait."""
    hole = swarm.Opening(swarm.Plane((0.0, 0.0, -1.0), 0.3), times=[(0.4, 0.8)])
    moved = swarm.Prism(
        [(-0.4, -0.45), (0.4, -0.45), (0.4, 0.45), (-0.4, 0.45)], 1.0, mass=5.0, openings=[hole], present=[(0.0, 1.1)]
    )
    law = {} if radius else {"laws": [swarm.Sticky(0.2)]}
    scene = swarm.Scene([moved, swarm.Plane((0.0, 0.0, 1.0), 0.15, **law)])
    size = {} if radius is None else {"radius": radius}
    source = swarm.Source(swarm.Sphere(0.1), volume=True, times=[0.2, 0.4], speed=1.0, mass=1.0, **size)
    start = swarm.Particles(0.25 * np.array([(x, y, -0.4) for x in (-1, 1) for y in (-1, 1)]).T, np.ones((3, 4)), 1.0)
    start.velocity[0, :2] = -0.7
    start.radius = None if radius is None else np.full(4, radius)
    options = RunOptions(until=1.5, compile="never", sources=(source,), seed=3)

    def new():
        return run_of(task_of(scene, start, swarm.Impact(), options))

    def carried(run, steps):
        """The run after its frames, halted after every event of the first piece of each, and how often it was."""
        run.observe()
        halts, before = 0, 0.0
        for moment in (0.3, 0.5, 0.6, 0.65, 0.8, 0.9, 1.2, 1.5):
            run.halt(1 if steps else 2**40)
            while not run.advance(moment - before, moment):
                kept = {name: array.copy() for name, array in run.arrays().items()}
                run.__exit__()
                run, halts = new(), halts + 1
                run.restore(kept, cut_short=True)
                run.halt(1)
            before = moment
        run.__exit__()
        return run, halts

    (whole, _none), (one, halts) = carried(new(), False), carried(new(), True)
    assert halts > 8
    seen, known = one.seen(), whole.seen()
    assert known["born"].tolist() == [2]
    assert known["escaped"] > 0
    assert known["energy_error"] <= 1e-14
    for name in ("total_energy", "impacts", "escaped", "wall_position", "wall_velocity", "born"):
        assert np.array_equal(seen[name], known[name]), name
    assert np.array_equal(one.state.position, whole.state.position)
