"""Bodies at walls that move: carried by belts, discs and lifts, struck by vessels; walls' work is what bodies gain."""

import itertools
import math

import numpy as np
import pytest
from energy_books import unbooked

import swarm
from swarm.bodies.lanes import advance, impact_time
from swarm.observables import drift

CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
SIZE, DENSITY, GRAVITY, DT = 0.016, 1200.0, 9.81, 1e-3
MASS = DENSITY * SIZE**3
VESSEL = swarm.Box((0.5, 0.4, 0.3))


def die(at=(0.0, 0.0), velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0)):
    """A die on the plane z = 0, whose motion is given at its centre."""
    body = swarm.rigid(0.5 * SIZE * CUBE, DENSITY)
    moving = np.array(velocity)[:, None] + np.cross(spin, body.points).T
    return swarm.Bodies(body, body.points.T + np.array([[*at, 0.5 * SIZE]]).T, moving)


def on_plane(start, motion, until, gravity=(0.0, 0.0, -GRAVITY), **laws):
    """The result of a run on a plane z = 0 that moves."""
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, motion=motion, **laws)], gravity=gravity)
    result = swarm.simulate(scene, start, swarm.Impact(dt=DT), until=until, compile="never", threads=1, progress=False)
    require_balance(result)
    return result


def require_balance(result):
    """What walls have done is what the bodies have gained, and lost."""
    seen = result.observables
    assert seen["energy_error"].max() < 1e-12
    # A slow die has 3e-5 of its energy of gravity as kinetic energy: the last digit of the one is 4e-12 of the other.
    round_off = 2.0 * np.spacing(np.abs(seen["total_energy"]).max())
    assert drift(seen) < 1e-12 or unbooked(seen) <= round_off
    assert seen["link_error"].max() < 1e-12
    assert seen["max_penetration"].max() < 1e-12


def centre(bodies):
    """The place and the velocity of the middle of one body's points."""
    return bodies.position[..., 0].mean(axis=1), bodies.velocity[..., 0].mean(axis=1)


def test_a_belt_speeds_a_die_up_and_loses_as_much_as_it_gives():
    """With mu g until it has the speed u of the belt: the belt does m u^2, of which friction takes a half."""
    speed, friction = 0.01, 0.8
    result = on_plane(die(), swarm.Translation((speed, 0.0, 0.0)), 3e-3, friction=friction, restitution=0.0)
    place, velocity = centre(result.bodies)
    assert velocity == pytest.approx([speed, 0.0, 0.0], abs=1e-12)
    sliding = speed / (friction * GRAVITY)
    assert place[0] == pytest.approx(speed * (3e-3 - 0.5 * sliding), rel=0.02)
    assert result.observables["wall_work"][-1].sum() == pytest.approx(MASS * speed**2, rel=1e-9)
    assert result.observables["dissipated_energy"][-1] == pytest.approx(0.5 * MASS * speed**2, rel=1e-9)
    assert result.observables["work"][-1] == 0.0


def test_a_die_on_a_turning_disc_is_carried():
    """It goes round with the disc, and turns with it."""
    rate, far, until = 0.5, 0.03, 3e-3
    start = die((far, 0.0), (0.0, rate * far, 0.0), (0.0, 0.0, rate))
    motion = swarm.Rotation((0.0, 0.0, 1.0), rate)
    result = on_plane(start, motion, until, friction=2.0, restitution=0.0)
    c, s = math.cos(rate * until), math.sin(rate * until)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    assert result.bodies.position[..., 0] == pytest.approx(turn @ start.position[..., 0], abs=1e-12)
    assert result.bodies.velocity[..., 0] == pytest.approx(turn @ start.velocity[..., 0], abs=1e-12)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_lift_carries_a_die_along_its_path(friction):
    """It stays on the lift, which does the work m g z + m v^2/2, and what the blow of the first touch took."""
    amplitude, frequency, until = 1e-3, 10.0, 3e-3
    motion = swarm.Oscillation((0.0, 0.0, amplitude), frequency)
    result = on_plane(die(), motion, until, friction=friction, restitution=0.0)
    place, _velocity = centre(result.bodies)
    height = amplitude * math.sin(2.0 * math.pi * frequency * until)
    assert place == pytest.approx([0.0, 0.0, 0.5 * SIZE + height], abs=1e-12)


def test_a_path_leads_a_die():
    """Friction that never slips leads it as the path leads the plane."""
    path = swarm.Path((0.0, 2e-3, 4e-3), ((0.0, 0.0, 0.0), (2e-6, 1e-6, 0.0), (5e-6, 4e-6, 0.0)))
    result = on_plane(die(velocity=path.cubics[1, :, 0]), path, 3e-3, friction=1.0, restitution=0.0)
    place, _velocity = centre(result.bodies)
    assert place - [0.0, 0.0, 0.5 * SIZE] == pytest.approx(path.displacement(3e-3), abs=1e-12)


# --- Vessels ---------------------------------------------------------------------------------------------

VELOCITY = np.array([0.5, -0.25, 0.125])


def tumbling(boost=(0.0, 0.0, 0.0), speed=(1.0, 0.7, 0.3)):
    """A tetrahedron that tumbles in the vessel."""
    body = swarm.tetrahedron(0.1, 1.0)
    moving = np.array(speed)[:, None] + np.array(boost)[:, None] + np.cross([3.0, 2.0, 1.0], body.points).T
    return swarm.Bodies(body, body.points.T, moving)


def in_vessel(start, until, gravity=None, order=2, **laws):
    """The result of a run in the vessel."""
    scene = swarm.Scene([swarm.Box((0.5, 0.4, 0.3), **laws)], gravity=gravity)
    method = swarm.Impact(dt=0.01, order=order)
    return swarm.simulate(scene, start, method, until=until, compile="never", threads=1, progress=False)


@pytest.mark.parametrize("laws", [{}, {"restitution": 0.7, "friction": 0.3}], ids=["elastic", "lossy"])
def test_a_vessel_that_moves_uniformly_is_one_at_rest(laws):
    """Galilei: places and velocities differ by those of the vessel, and it takes the same impulse and loss."""
    rest = in_vessel(tumbling(), 1.0, **laws)
    moved = in_vessel(tumbling(VELOCITY), 1.0, motion=swarm.Translation(tuple(VELOCITY)), **laws)
    require_balance(moved)
    assert rest.observables["impacts"][-1] == moved.observables["impacts"][-1] > 1
    shift = VELOCITY[:, None, None]
    assert np.abs(moved.bodies.position - rest.bodies.position - shift).max() < 1e-11
    assert np.abs(moved.bodies.velocity - rest.bodies.velocity - shift).max() < 1e-10
    for name in ("impulse", "dissipated_energy"):
        assert moved.observables[name][-1] == pytest.approx(rest.observables[name][-1], rel=1e-9)


MOTIONS = {
    "turning": swarm.Rotation((1.0, 2.0, 0.5), 3.0),
    "shaken": swarm.Oscillation((0.05, 0.0, 0.1), 2.0, 0.3),
    "both": swarm.Rotation((0.0, 0.0, 1.0), 3.0, (0.1, 0.0, 0.0)) + swarm.Oscillation((0.1, 0.0, 0.05), 1.0),
    "path": swarm.Path((0.0, 0.2, 0.6), ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.2))),
}


@pytest.mark.parametrize("laws", [{}, {"restitution": 0.7, "friction": 0.3}], ids=["elastic", "lossy"])
@pytest.mark.parametrize("motion", MOTIONS)
def test_work_of_a_vessel_is_what_a_body_gains(motion, laws):
    """In free flight under gravity, and at all impacts."""
    result = in_vessel(tumbling(), 0.5, (0.0, 0.0, -GRAVITY), motion=MOTIONS[motion], **laws)
    require_balance(result)
    assert result.observables["impacts"][-1] > 0
    assert abs(result.observables["wall_work"][-1].sum()) > 1e-3
    assert (result.observables["dissipated_energy"][-1] > 1e-3) == bool(laws)


def test_a_wall_gives_a_body_twice_its_speed():
    """A body that is symmetric about the blow leaves with -w relative to the wall, and the wall books the impulse."""
    rod = swarm.dumbbell(length=0.1, mass=1.0)
    # Its rod lies along the wall that comes.
    start = swarm.Bodies(rod, np.array([[0.3, -0.05, 0.0], [0.3, 0.05, 0.0]]).T, np.zeros((3, 2)))
    result = in_vessel(start, 0.15, motion=swarm.Translation((-2.0, 0.0, 0.0)))
    assert np.abs(result.bodies.velocity[:, :, 0].T - [-4.0, 0.0, 0.0]).max() < 1e-12
    mass = rod.mass_matrix.sum()
    assert result.observables["impulse"][-1].sum() == pytest.approx(4.0 * mass)
    assert result.observables["wall_work"][-1].sum() == pytest.approx(8.0 * mass)


def test_a_contact_lasts_in_a_composed_step():
    """Its stages begin at times of their own, of which one goes back."""
    motion = swarm.Oscillation((0.0, 0.0, 1e-3), 10.0)
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, motion=motion, restitution=0.0)], gravity=(0, 0, -GRAVITY))
    method = swarm.Impact(dt=DT, order=4)
    result = swarm.simulate(scene, die(), method, until=3e-3, compile="never", threads=1, progress=False)
    require_balance(result)
    height = 1e-3 * math.sin(2.0 * math.pi * 10.0 * 3e-3)
    assert centre(result.bodies)[0] == pytest.approx([0.0, 0.0, 0.5 * SIZE + height], abs=1e-12)


def test_the_path_of_a_wall_covers_the_run():
    cup = swarm.Box((0.5, 0.5, 0.5), motion=swarm.Path((0.0, 0.5), ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0))))
    start = swarm.place(
        swarm.Scene([cup]), swarm.rigid(0.05 * np.vstack([np.zeros(3), np.eye(3)]), 1e3), 1, speed=0.0, seed=1
    )
    with pytest.raises(swarm.SceneError, match=r"surfaces\[0\].motion.times must cover the run from 0 to 1 s"):
        swarm.simulate(swarm.Scene([cup]), start, swarm.Impact(dt=1e-3), until=1.0)


def test_a_trial_that_is_made_again_ends_at_the_same_place(monkeypatch):
    # Else a die that slides on a face and meets another wall has no time of impact: one trial at it ends inside, the
    # next outside. One of 8 dice in a shaken cup ended its run so.
    judge, seen = advance._judge, []

    def twice(contacts, i):
        lanes, pace = contacts.lanes, contacts.pace
        if pace.body[i] >= 0 and pace.active[i] > 0 and pace.solved[i] and pace.wall[i] < 0:
            if len(seen) % 2 == 0:
                seen.append(lanes.r1[:, i].copy())
                pace.fresh[i], pace.trial[i] = False, pace.step[i]
                return impact_time.AGAIN
            seen.append(lanes.r1[:, i].copy())
        return judge(contacts, i)

    monkeypatch.setattr(advance, "_judge", twice)
    start = die(velocity=(0.3, 0.1, 0.0), spin=(0.0, 0.0, 20.0))
    on_plane(start, swarm.Translation((0.2, 0.0, 0.0)), 0.02, restitution=0.5, friction=0.3)
    assert len(seen) > 20
    for first, again in zip(seen[::2], seen[1::2], strict=True):
        np.testing.assert_array_equal(again, first)
