"""One pass of Impact: flight to the wall, and the reflection or the chord step there."""

import math

import numpy as np
import pytest
from conftest import EPSILON, call, chord_of, directions, every_surface, gap, scene_of, side_of, wall_point
from hypothesis import given
from hypothesis import strategies as st
from passes import one_pass, run, simulate

import swarm

lengths = st.floats(1e-4, 0.3)


def approach(scene, point, direction, depth=0.1, lean=0.5):
    """A start `depth` away from the first wall, moving towards it with unit speed."""
    (numbers,) = scene.surfaces[0].walls()
    wall = wall_point(numbers, point)
    normal = np.array(call(numbers.unit_normal, wall))
    along = direction - (direction @ normal) * normal
    along /= max(np.linalg.norm(along), 1e-3)
    return numbers, wall - depth * normal, lean * normal + math.sqrt(1.0 - lean * lean) * along / np.linalg.norm(along)


@every_surface
@given(point=directions, direction=directions, speed=st.sampled_from([1e-6, 1.0, 1e6]))
def test_a_pass_reflects_at_the_wall(name, point, direction, speed):
    """At the wall, |v| kept, the tangential velocity kept, the normal one reversed, its momentum given to the wall."""
    scene = scene_of(name)
    numbers, position, velocity = approach(scene, point, direction, depth=0.05, lean=0.95)
    velocity *= speed
    after = one_pass(swarm.Impact(), scene, position, velocity, 1.0 / speed)
    assert after.surface == 0.0
    assert after.hits == 1.0
    assert abs(gap(numbers, after.position)) <= 64 * EPSILON
    normal = np.array(call(numbers.unit_normal, after.position))
    assert after.velocity == pytest.approx(velocity - 2 * (velocity @ normal) * normal, abs=8 * EPSILON * speed)
    assert np.linalg.norm(after.velocity) == pytest.approx(np.linalg.norm(velocity), rel=2 * EPSILON)
    assert after.impulse == pytest.approx([2.0 * velocity @ normal], rel=8 * EPSILON)
    time = 1.0 / speed - after.remaining
    assert after.position == pytest.approx(position + time * velocity, abs=8 * EPSILON)


@every_surface
def test_a_frame_that_ends_before_the_wall_is_a_flight(name):
    scene = scene_of(name)
    _, position, velocity = approach(scene, np.array([0.3, 0.5, -0.4]), np.array([1.0, 0.0, 0.0]))
    after = one_pass(swarm.Impact(), scene, position, velocity, 0.01)
    assert after.position == pytest.approx(position + 0.01 * velocity, abs=EPSILON)
    assert (after.velocity == velocity).all()
    assert (after.remaining, after.surface, after.hits) == (0.0, -1.0, 0.0)


@every_surface
@given(point=directions, direction=directions, h=lengths, lean=st.floats(0.2, 1.0))
def test_a_contact_step_is_a_chord(name, point, direction, h, lean):
    """(v0 + v1)/2 = (r1 - r0)/h from wall to wall with |v| kept; else the reflection at the point takes its place."""
    h *= 0.3
    scene = scene_of(name)
    numbers, wall, velocity = approach(scene, point, direction, 0.0, lean)
    after = one_pass(swarm.Impact(contact_step=h), scene, wall, velocity, 1.0)
    used = 1.0 - after.remaining
    assert np.linalg.norm(after.velocity) == pytest.approx(1.0, rel=4 * EPSILON)
    assert abs(gap(numbers, after.position)) <= 200 * EPSILON
    assert after.position - wall == pytest.approx(0.5 * used * (velocity + after.velocity), abs=100 * EPSILON)
    if used > 1e-12:
        # The start is off the wall by the round-off of its making, and the flight from there takes that over the lean.
        off = abs(call(numbers.distance, wall))
        assert used == pytest.approx(h, abs=(3.0 + 1.0 / lean) * EPSILON + off / lean)
        normal = np.array(call(numbers.chord_normal, wall, h * velocity, chord_of(numbers, wall, h * velocity)))
    else:
        assert side_of(numbers) < 0.0 or name == "plane"
        normal = np.array(call(numbers.unit_normal, wall))
    assert after.velocity == pytest.approx(velocity - 2.0 * (velocity @ normal) * normal, abs=100 * EPSILON)


@every_surface
def test_a_short_contact_step_tends_to_the_reflection(name):
    """First order in h, to the exact reflection."""
    scene = scene_of(name)
    start = approach(scene, np.array([0.3, 0.5, -0.4]), np.array([1.0, 0.2, 0.0]), 0.05, 0.6)[1:]
    exact = one_pass(swarm.Impact(), scene, *start, 1.0).velocity
    errors = [
        np.linalg.norm(one_pass(swarm.Impact(contact_step=h), scene, *start, 1.0).velocity - exact)
        for h in (1e-2, 1e-3, 1e-4)
    ]
    assert errors[2] <= 1e-3
    if name != "plane":
        assert errors[0] > 5.0 * errors[1] > 25.0 * errors[2] > 0.0


@pytest.mark.parametrize("name", ["sphere", "ellipsoid"])
def test_grazing_becomes_sliding(name):
    """A launch along the wall stays on it and keeps its speed, and is no impact."""
    scene = scene_of(name)
    numbers, wall, velocity = approach(scene, np.array([0.3, 0.5, -0.4]), np.array([1.0, 0.2, 0.0]), 0.0, 0.0)
    result = simulate(scene, swarm.Particles(wall, velocity), swarm.Impact(), 0.5)
    assert result.observables["impacts"][-1] <= 1
    assert result.observables["sliding_time"][-1] == pytest.approx(0.5, abs=1e-7)
    assert abs(gap(numbers, result.particles.position[:, 0])) <= 1e-14
    assert np.linalg.norm(result.particles.velocity) == pytest.approx(1.0, rel=4 * EPSILON)


def test_a_corner_returns_the_particle_the_way_it_came():
    """Two walls in the same instant: both reflect it."""
    scene = swarm.Scene([swarm.Plane((1, 0, 0)), swarm.Plane((0, 1, 0)), swarm.Sphere(5.0)])
    passes = run(swarm.Impact(), scene, [-1.0, -1.0, 0.5], [1.0, 1.0, 0.0], 2.0)
    assert passes[-1].position == pytest.approx([-1.0, -1.0, 0.5], abs=1e-14)
    assert passes[-1].velocity == pytest.approx([-1.0, -1.0, 0.0], abs=1e-14)
    assert sum(step.hits for step in passes) == 2.0


def test_a_particle_at_rest_stays():
    scene = swarm.Scene([swarm.Sphere(1.0)])
    (_, after) = run(swarm.Impact(), scene, [0.0, 0.6, 0.8], [0.0, 0.0, 0.0], 1e6)
    assert (after.position == [0.0, 0.6, 0.8]).all()
    assert after.hits == 0.0


def test_a_sphere_by_hand():
    """Along the x axis of a unit sphere: at the wall after 1 s, back at the centre after 2 s."""
    scene = swarm.Scene([swarm.Sphere(1.0)])
    first, second = run(swarm.Impact(), scene, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 2.0)[1:]
    assert first.position == pytest.approx([1.0, 0.0, 0.0])
    assert first.impulse == pytest.approx([2.0])
    assert second.position == pytest.approx([0.0, 0.0, 0.0], abs=1e-15)
    assert (second.velocity == [-1.0, 0.0, 0.0]).all()


# --- Descriptions ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        ({"contact_step": -1.0}, ["contact_step", "0 or more", "got -1"]),
        ({"contact_step": math.nan}, ["contact_step", "finite", "nan"]),
        ({"contact_step": "short"}, ["contact_step", "'short'"]),
        ({"shortest_flight": 0.0}, ["shortest_flight", "above 0", "got 0"]),
        ({"shortest_flight": math.inf}, ["shortest_flight", "finite", "inf"]),
    ],
)
def test_errors_name_the_argument(arguments, parts):
    with pytest.raises(swarm.SceneError) as caught:
        swarm.Impact(**arguments)
    assert all(part in str(caught.value) for part in parts), str(caught.value)


@pytest.mark.parametrize("argument", ["contact_step", "shortest_flight"])
def test_a_step_longer_than_a_crossing_is_refused(argument):
    """size/|v| of the fastest particle: here 0.5/2 s."""
    scene = swarm.Scene([swarm.Sphere(0.5)])
    particles = swarm.Particles(np.zeros((3, 2)), [[0.1, 2.0], [0.0, 0.0], [0.0, 0.0]])
    swarm.Impact(**{argument: 0.25}).check(scene, particles)
    with pytest.raises(swarm.SceneError, match=rf"{argument} must be at most the crossing time.* 0\.25 s.*got 0\.26"):
        swarm.Impact(**{argument: 0.26}).check(scene, particles)


@pytest.mark.parametrize(("scale", "speed"), [(1.0, 1.0), (1.0, 2.0), (1000.0, 0.001)])
def test_shortest_flight_is_a_part_of_the_crossing_time(scale, speed):
    """By default 1e-4 of size/|v|, so from a lean of 5e-5 on a particle flies: in a scene and its scaled copy."""
    scene = swarm.Scene([swarm.Sphere(scale)])
    for lean, slides in ((4e-5, 1), (6e-5, 0)):
        start = swarm.Particles([scale, 0.0, 0.0], [lean * speed, speed, 0.0])
        assert simulate(scene, start, swarm.Impact(), 1e-2 * scale / speed).observables["sliding"][-1] == slides
    longer = swarm.Impact(shortest_flight=2e-4 * scale / speed)
    assert simulate(scene, start, longer, 1e-2 * scale / speed).observables["sliding"][-1] == 1
