"""What does not go with particles that have a radius, and what they may not be at the start: one sentence each."""

import numpy as np
import pytest

import swarm
from swarm.run.options import RunOptions
from swarm.run.preflight.admission import task_of

BOX = swarm.Box((0.5, 0.5, 0.5))
VESSEL = swarm.Scene([BOX])
SOFT = swarm.Penalty(dt=1e-3, penalty=1e4)
CELL = swarm.Scene([swarm.Sphere(0.01, (0.5, 0.5, 0.5), side="outside")], period=(1.0, 1.0, 1.0))


def balls(position=((-0.2, 0.2), (0.0, 0.0), (0.0, 0.0)), radius=0.1, **more):
    return swarm.Particles(position, np.zeros_like(position, dtype=float), radius=radius, **more)


def admitted(scene, particles, method=None, **options):
    return task_of(scene, particles, method or swarm.Impact(), RunOptions(until=1.0, **options))


@pytest.mark.parametrize("method", [swarm.Impact(), SOFT], ids=["impact", "penalty"])
def test_balls_that_are_apart_are_admitted(method):
    task = admitted(VESSEL, balls(), method)
    assert task.particles.radius.tolist() == [0.1, 0.1]


@pytest.mark.parametrize(
    ("scene", "particles", "method", "options", "sentence"),
    [
        (VESSEL, balls(radius=0.25), None, {},
         "particles must not overlap at the start, got 1 pair that overlaps, particles 0 and 1 the most, by 0.1 m: "
         "their centres are 0.4 m apart, their radii 0.25 and 0.25 m; move them apart"),
        (VESSEL, balls(((-0.1, 0.3, 0.32), (0.0,) * 3, (0.0,) * 3), (0.1, 0.1, 0.05)), None, {},
         "1 pair that overlaps, particles 1 and 2 the most, by 0.13 m"),
        (VESSEL, balls(radius=0.25), SOFT, {}, r"\(soft balls may by 0.2 of the smaller radius\), got 1 pair"),
        (CELL, balls(((0.05, 0.95), (0.1, 0.1), (0.1, 0.1)), 0.06), None, {}, "1 pair that overlaps, .*, by 0.02 m"),
        (VESSEL, balls(((0.0, 0.45), (0.0, 0.0), (0.0, 0.0))), None, {},
         "particles must start inside their walls, got 1 of 2 outside; the first is particle 1 at .0.45, 0.0, 0.0., "
         r"and its radius of 0.1 m reaches 0.05 m beyond surfaces\[0\] \(Box\)"),
        (VESSEL, balls(((0.0, 0.45), (0.0, 0.0), (0.0, 0.0))), SOFT, {}, "reaches 0.05 m beyond"),
        (VESSEL, balls(radius=(0.6, 0.1)), None, {},
         "radius must leave a place within the walls, which are 1 m apart along x, got 0.6 m of particle 0"),
        (CELL, balls(((0.2, 0.7), (0.2, 0.2), (0.2, 0.2)), (0.1, 0.26)), None, {},
         r"radius must be at most a quarter of period\[0\] = 1 m, .*, got 0.26 m of particle 1"),
        (swarm.Scene([BOX], pairs=swarm.Pairs(contact_duration=0.0)), balls(), SOFT, {},
         "pairs.contact_duration must be None with Penalty"),
        (swarm.Scene([BOX], pairs=swarm.Pairs()), swarm.Particles(np.zeros(3), np.zeros(3)), None, {},
         "pairs must be None where particles have no radius"),
        (VESSEL, swarm.Particles(np.zeros(3), np.zeros(3)), swarm.Penalty(1e-3, 1e4, friction_tolerance=1e-3), {},
         r"friction_tolerance must be left out without particles that have a radius, got 0.001; leave it out"),
        (swarm.Scene([BOX], plane="z"), balls(spin=[[0.0, 0.0], [0.0, 2.0], [1.0, 1.0]]), None, {},
         r"particles.spin\[1\] must be 0 in a scene with plane = .z., got 2 rad/s of particle 1: friction would"),
        (VESSEL, balls(), swarm.Impact(contact_step=1e-3), {}, "contact_step must be 0 where particles have a radius"),
        (VESSEL, balls(), swarm.Penalty(1e-3, 1e4, 1.5, gradient="mean-value"), {},
         'gradient must be "composite" where particles have a radius'),
        (VESSEL, balls(), swarm.Verlet(1e-3, 1e4), {}, "with Verlet, got radii; use Impact or Penalty"),
        (VESSEL, balls(), swarm.AugmentedLagrangian(1e-3, 1e4), {}, "with AugmentedLagrangian, got radii; use Impact"),
        (VESSEL, balls(), None, {"cluster": "local:2", "shards": 2, "trajectory": "run.h5"},
         "shards must be 1 or left out where particles have a radius, got 2"),
    ],
    ids=lambda value: None if not isinstance(value, str) else value[:30].replace(" ", "_"),
)  # fmt: skip
def test_a_bad_start_is_one_sentence(scene, particles, method, options, sentence):
    with pytest.raises(swarm.SceneError, match=sentence) as error:
        admitted(scene, particles, method, **options)
    assert "\n" not in str(error.value)


def test_sources_of_points_do_not_go_with_balls():
    source = swarm.Source(0, rate=1.0, speed=1.0)
    with pytest.raises(
        swarm.SceneError, match=r"sources\[1\].radius must be given where the other particles of the run have a radius"
    ):
        admitted(VESSEL, None, sources=[swarm.Source(0, rate=1.0, speed=1.0, radius=0.01), source])


def test_balls_that_touch_by_round_off_are_admitted():
    """Newton's cradle: the distances of centres differ from the sum of the radii by round-off."""
    x = 0.1 * np.arange(5) * 2.0 - 0.4
    assert (np.diff(x) < 0.2).any()
    admitted(VESSEL, balls((x, 0.0 * x, 0.0 * x)))


def test_soft_balls_may_press_on_one_another_and_on_walls():
    admitted(VESSEL, balls(((-0.41, -0.22), (0.0, 0.0), (0.0, 0.0))), SOFT)
    with pytest.raises(swarm.SceneError, match=r"reaches 0\.01 m beyond"):
        admitted(VESSEL, balls(((-0.41, -0.22), (0.0, 0.0), (0.0, 0.0))))


def test_bodies_do_not_meet():
    scene = swarm.Scene([BOX], pairs=swarm.Pairs())
    bodies = swarm.place(VESSEL, swarm.dumbbell(0.1, 1.0), 2, speed=0.1)
    with pytest.raises(swarm.SceneError, match="pairs must be None with bodies"):
        admitted(scene, bodies, swarm.Impact(dt=1e-2))


AS_WIDE = {
    "box": [swarm.Box((0.25, 1.0, 1.0))],
    "tube": [swarm.Cylinder(0.25, axis=(0.0, 0.0, 1.0))],
    "lids": [swarm.Cylinder(1.0, length=0.5, axis=(1.0, 0.0, 0.0))],
    "slab": [swarm.Slab((1.0, 0.0, 0.0), 0.25)],
    "planes": [swarm.Plane((1.0, 0.0, 0.0), 0.25), swarm.Plane((-1.0, 0.0, 0.0), 0.25)],
    "polygon": [swarm.Polygon([(-0.25, -1.0), (0.25, -1.0), (0.25, 1.0), (-0.25, 1.0)])],
    "prism": [swarm.Prism([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)], height=0.5, axis=(1.0, 0.0, 0.0))],
    "two balls": [swarm.Sphere(0.3, center=(0.55 * way, 0.0, 0.0), side="outside") for way in (1.0, -1.0)],
}


def one_ball(velocity, radius=0.25):
    return swarm.Particles(np.zeros((3, 1)), np.array(velocity, float).reshape(3, 1), radius=radius)


@pytest.mark.parametrize("name", AS_WIDE)
@pytest.mark.parametrize(("velocity", "gravity"), [((0.3, 0.0, 0.4), None), ((0.0, 0.0, 0.0), (-2.0, 0.0, 0.0))])
def test_a_ball_as_wide_as_its_gap_may_not_cross_it(name, velocity, gravity):
    scene = swarm.Scene(AS_WIDE[name], gravity=gravity)
    how = r"moves across it with 0.3 m/s" if gravity is None else r"falls across it with 2 m/s\^2"
    with pytest.raises(swarm.SceneError, match=f"between facing walls, got 1 .* as wide as the gap .* {how}: no time"):
        admitted(scene, one_ball(velocity))


@pytest.mark.parametrize("name", AS_WIDE)
def test_it_may_move_along_the_walls(name):
    admitted(swarm.Scene(AS_WIDE[name]), one_ball((0.0, 0.0, 1e-200)))
    admitted(swarm.Scene(AS_WIDE[name]), one_ball((0.3, 0.0, 0.4), radius=0.25 - 1e-9))


@pytest.mark.parametrize("velocity", [(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (-0.3, 0.0, 1.0)])
def test_a_ball_that_touches_two_walls_of_a_groove_may_move(velocity):
    groove = [swarm.Plane((way, 0.0, -1.0), 0.25 * 2.0**0.5) for way in (1.0, -1.0)]
    admitted(swarm.Scene(groove), one_ball(velocity))
