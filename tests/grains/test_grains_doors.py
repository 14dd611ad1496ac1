"""Soft balls at walls that come and go: frames are cut at these instants, and what contacts stored is lost."""

import math

import numpy as np
import pytest
from energy_books import unbooked
from grains_runs import ran

import swarm
from swarm.errors import RunError
from swarm.files import checkpoint
from swarm.grains.grains_run import GrainsRun
from swarm.kernel.random import Seeding
from swarm.run.tally import Watched

RADIUS, ALPHA, SPEED = 0.1, 400.0, 1.0


def balanced(seen):
    return unbooked(seen) / seen["kinetic_energy"].max()


def gate(*times, others=()):
    return swarm.Scene([swarm.Plane((0.0, 0.0, 1.0), 0.0, present=times), *others])


def thrown(depth=0.2):
    """A ball that touches the plane z = 0 after as many seconds as metres."""
    return swarm.Particles((0.0, 0.0, -RADIUS - depth), (0.3, 0.0, SPEED), radius=RADIUS)


@pytest.mark.parametrize("pressed", [0.013, 0.05, 0.11])
def test_a_gate_that_goes_during_a_contact_takes_what_that_stores(pressed):
    # No instant is at the end of a step: the contact is the half wave of an oscillator, cut after so many seconds.
    rate = math.sqrt(ALPHA)
    result = ran(gate((0.0, 0.2 + pressed)), thrown(), swarm.Penalty(1e-3, ALPHA), 1.0, every=0.25)
    seen = result.observables
    speed = SPEED * math.cos(rate * pressed)
    assert result.particles.velocity[2, 0] == pytest.approx(speed, abs=2e-3)
    assert seen["dissipated_energy"][-1] == pytest.approx(0.5 * (SPEED**2 - speed**2), abs=2e-3)
    assert balanced(seen) < 1e-14
    assert seen["impacts"][-1] == 1


def test_a_gate_that_is_never_met_changes_the_steps_alone():
    # Flights are exact, and a contact after the instant has the same steps, shifted by less than one.
    scene = gate((0.0, 0.05371), (0.1, 5.0))
    seen = ran(scene, thrown(), swarm.Penalty(1e-3, ALPHA), 1.0, every=0.25).observables
    assert seen["dissipated_energy"][-1] == 0.0
    assert seen["impulse"][-1, 0] == pytest.approx(2.0 * SPEED, rel=1e-3)
    assert balanced(seen) < 1e-14


@pytest.mark.parametrize("kind", [swarm.Spheres, swarm.Sphere])
def test_solids_that_come_and_go_are_met_while_they_are_there(kind):
    found = []
    for times in ([(0.0, 0.1)], [(0.1, 0.45), (0.65, 2.0)]):
        given = ([(0.0, 0.0, 0.0)], 0.2) if kind is swarm.Spheres else (0.2, (0.0, 0.0, 0.0), "outside")
        scene = swarm.Scene([kind(*given, present=times), swarm.Box((1.0, 1.0, 1.0))])
        found.append(ran(scene, thrown(0.4), swarm.Penalty(1e-3, ALPHA), 0.7, every=0.1).observables["impulse"][-1, 0])
    # The ball touches the solid at 0.2 s.
    assert found[0] == 0.0
    assert found[1] > 1.5


def test_a_shaken_gate_gives_its_work_and_takes_what_is_stored():
    moving = swarm.Oscillation((0.0, 0.0, 0.02), 1.3)
    wall = swarm.Plane((0.0, 0.0, 1.0), 0.05, motion=moving, present=[(0.0, 0.2911)])
    scene = swarm.Scene([wall, swarm.Box((0.5, 0.5, 0.6))])
    seen = ran(scene, thrown(), swarm.Penalty(1e-3, ALPHA), 1.5, every=0.25).observables
    assert abs(seen["wall_work"][-1, 0]) > 1e-3
    assert seen["dissipated_energy"][-1] > 1e-3
    assert balanced(seen) < 1e-12


def test_a_gate_that_comes_where_a_ball_is_ends_the_run():
    with pytest.raises(RunError, match=r"surfaces\[0\] \(Plane\) must come where no particle is: at 0.4 s particle 0"):
        ran(gate((0.4, 1.0)), thrown(), swarm.Penalty(1e-3, ALPHA), 1.0)


def started():
    lid = swarm.Plane((0.0, 0.0, 1.0), 0.6, present=[(0.2, 0.39), (0.41, 0.6)])
    others = (swarm.Box((0.3, 0.3, 1.0), friction=0.4), lid)
    scene = gate((0.0, 0.2133), others=others)
    z = np.array([-0.3, -0.55, -0.8])
    balls = swarm.Particles(np.array([0.0 * z, 0.1 * z, z]), np.array([z, z, 0.3 - z]), radius=RADIUS)
    method = swarm.Penalty(1e-3, ALPHA)
    run = GrainsRun(scene.compiled(RADIUS), balls, method, 1, None, "never", Seeding(), Watched())
    run.observe()
    return run


def advanced(run, halts=(), frames=(1, 2, 3)):
    for k in frames:
        for passes in halts:
            run.halt(passes)
            if run.advance(200.0, 0.2 * k):
                break
            assert 0.0 < run.share_done(200.0) < 1.0
        else:
            assert run.advance(200.0, 0.2 * k)
    return {name: array.tobytes() for name, array in run.arrays().items() if name != "clock"}, run.seen()


def test_halts_do_not_change_a_bit_and_a_run_that_is_restored_goes_on(tmp_path):
    bits, seen = advanced(started())
    assert seen["dissipated_energy"] > 0.0
    assert advanced(started(), halts=(7, 120, 3))[0] == bits
    run, other = started(), started()
    advanced(run, frames=(1,))
    run.halt(5)
    assert not run.advance(200.0, 0.4)
    checkpoint.save(tmp_path / "a", checkpoint.SavedRun("", "", "", "", 30, ""), run.arrays())
    other.restore(checkpoint.read(tmp_path / "a")[1], True)
    assert advanced(other, frames=(2, 3))[0] == bits
