"""Bodies at walls that come and go, and at openings: against the flight of a free body, and against a wall at rest."""

import numpy as np
import pytest

import swarm

DT, DOWN = 0.02, (0.0, 0.0, -1.0)
FLOOR = swarm.Plane((0.0, 0.0, -1.0), 0.0)


def body_at(height, velocity=(0.0, 0.0, 0.0)):
    die = swarm.tetrahedron(edge=0.2, mass=2.0)
    points = die.points - die.points.mean(axis=0) + (0.0, 0.0, height)
    return swarm.Bodies(die, points.T, np.tile(np.array(velocity)[:, None], (1, len(die))))


def run(surfaces, bodies, until=1.0, gravity=DOWN, **options):
    scene = swarm.Scene(surfaces, gravity=gravity)
    return swarm.simulate(scene, bodies, swarm.Impact(dt=DT), until=until, compile="never", **options)


def centre(result):
    return result.bodies.position.mean(axis=1)[:, 0]


def test_a_wall_that_is_gone_stops_no_body():
    floor = swarm.Plane((0.0, 0.0, -1.0), 0.0, present=[(1.5, 5.0)])
    fallen = run([floor], body_at(1.0, (0.3, 0.0, 0.0)), until=1.4)
    assert fallen.observables["impacts"][-1] == 0
    np.testing.assert_allclose(centre(fallen), (0.42, 0.0, 1.0 - 0.5 * 1.4**2), atol=1e-13)


def test_a_body_that_rests_falls_when_its_floor_goes_and_stays_until_then():
    floor = swarm.Plane((0.0, 0.0, -1.0), 0.0, restitution=0.0, friction=0.5, present=[(0.0, 1.0)])
    rest = run([floor], body_at(0.1), until=0.99)
    gone = run([floor], body_at(0.1), until=1.5, every=0.5)
    assert centre(gone)[2] == pytest.approx(centre(rest)[2] - 0.5 * 0.5**2, abs=1e-9)
    assert gone.observables["energy_error"].max() < 1e-12


def test_a_wall_that_comes_into_a_body_ends_the_run():
    floor = swarm.Plane((0.0, 0.0, -1.0), 0.0, present=[(1.5, 5.0)])
    with pytest.raises(swarm.RunError, match=r"^surfaces\[0\] must come where no body is: at 1.5 s .* body 0 is"):
        run([floor], body_at(1.0), until=2.0)


def test_a_body_falls_through_an_opening_as_a_free_body_does_and_escapes_with_its_last_point():
    hole = swarm.Plane((0.0, 0.0, -1.0), 0.0, openings=[swarm.Cylinder(0.4)])
    start = body_at(1.0)
    highest = start.position[2].max()
    result = run([hole], start, until=3.0)
    assert result.escape_time == pytest.approx(np.full(4, np.sqrt(2.0 * highest)), abs=1e-12)
    assert centre(result)[2] == pytest.approx(1.0 - highest, abs=1e-12)
    assert result.observables["escaped"][-1] == 1
    assert result.observables["impacts"][-1] == 0
    assert result.observables["max_penetration"].max() == 0.0


def test_points_beside_an_opening_meet_the_wall_and_those_in_it_do_not():
    half = swarm.Plane((0.0, 0.0, -1.0), 0.0, openings=[swarm.Plane((-1.0, 0.0, 0.0), 0.0)])
    result = run([half], body_at(0.3), until=0.9)
    closed = run([FLOOR], body_at(0.3), until=0.9)
    assert result.observables["impacts"][-1] > 0
    assert np.abs(centre(result) - centre(closed)).max() > 1e-3
    assert result.observables["energy_error"].max() < 1e-12
    assert result.observables["max_penetration"].max() < 1e-13
    assert result.bodies.contact_points()[2].min() < -1e-3


def test_a_shutter_that_opens_later_lets_a_body_out_then():
    timed = [swarm.Opening(swarm.Cylinder(0.4), times=[(1.0, 9.0)])]
    floor = swarm.Plane((0.0, 0.0, -1.0), 0.0, restitution=0.0, friction=0.5, openings=timed)
    result = run([floor], body_at(0.1), until=2.0)
    assert result.escape_time.min() > 1.0
    assert result.observables["energy_error"].max() < 1e-12


def test_a_body_that_comes_back_through_an_opening_meets_the_walls_again():
    # Thrown up through the lid of a box, it falls back and bounces on the floor.
    lid = swarm.Plane((0.0, 0.0, 1.0), 0.5, openings=[swarm.Cylinder(0.5)])
    result = run([FLOOR, lid], body_at(0.3, (0.0, 0.0, 0.65)), until=2.5)
    assert result.observables["impacts"][-1] > 0
    assert result.observables["escaped"][-1] == 0
    assert result.bodies.contact_points()[2].min() > -1e-12
