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
        swarm.SceneError, match=r"sources\[0\].radius must be given where the other particles of the run have a radius"
    ):
        admitted(VESSEL, balls(), sources=[source])


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
