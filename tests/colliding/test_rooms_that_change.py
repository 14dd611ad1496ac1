"""Balls and grains in a union of several rooms that moves, comes and goes, or opens as a whole."""

import numpy as np
import pytest

import swarm

OPTIONS = {"compile": "never", "progress": False}
RADIUS = 0.06
MOTIONS = {
    "translation": swarm.Translation((0.4, 0.1, -0.3)),
    "oscillation": swarm.Oscillation((0.03, 0.02, -0.04), 1.3),
    "rotation": swarm.Rotation((1.0, -2.0, 3.0), 0.6, (0.1, 0.0, 0.05)),
    "path": swarm.Path([0.0, 0.5, 2.0], [(0.0, 0.0, 0.0), (0.05, 0.0, 0.02), (0.0, 0.06, 0.0)]),
}
HOLE = swarm.Plane((-1.0, 0.0, 0.0), -0.55)
CHANGES = {
    **{name: {"motion": motion} for name, motion in MOTIONS.items()},
    "opening": {"openings": [HOLE]},
    "timed opening": {"openings": [swarm.Opening(HOLE, times=[(0.2, 0.6)])]},
}
METHODS = {"Impact": swarm.Impact(), "Penalty": swarm.Penalty(5e-3, 4e3)}


def ran(vessel, balls, method, until=0.7, **options):
    return swarm.simulate(swarm.Scene([vessel]), balls.copy(), method, until=until, **{**OPTIONS, **options})


@pytest.mark.parametrize(
    ("change", "method"),
    [*((name, "Impact") for name in CHANGES), ("rotation", "Penalty"), ("timed opening", "Penalty")],
)
def test_rooms_that_touch_at_a_face_change_as_one_box(change, method):
    laws = {"restitution": 0.9, **CHANGES[change]}
    halves = swarm.Union([swarm.Box((0.35, 0.4, 0.45), (x, 0.0, 0.0)) for x in (-0.35, 0.35)], **laws)
    balls = swarm.Particles(
        [(0.1, -0.3), (0.05, 0.2), (-0.1, 0.0)], [(1.53, -0.81), (0.72, 1.04), (-0.57, 0.93)], radius=0.05
    )
    one, other = (ran(vessel, balls, METHODS[method]) for vessel in (halves, swarm.Box((0.7, 0.4, 0.45), **laws)))
    assert one.observables["impacts"][-1] > 2
    for name in ("position", "velocity"):
        assert getattr(one.particles, name) == pytest.approx(getattr(other.particles, name), abs=1e-9)
    assert one.observables["energy_error"].max() < 1e-12
    if "opening" in change:
        assert one.observables["escaped"][-1] == other.observables["escaped"][-1]


@pytest.mark.parametrize("x", [0.2, 0.0])
def test_a_grain_in_a_corner_of_rooms_that_touch_meets_both_walls(x):
    """They were one wall, of which a grain met one face at a time, or its impulses did not converge."""
    halves = swarm.Union([swarm.Box((0.35, 0.4, 0.45), (side, 0.0, 0.0)) for side in (-0.35, 0.35)])
    grain = swarm.Particles([[x], [0.3], [0.35]], [[0.1], [1.0], [1.01]], radius=0.05)
    one, other = (
        ran(vessel, grain, swarm.Penalty(1e-3, 1e4), 0.3).particles for vessel in (halves, swarm.Box((0.7, 0.4, 0.45)))
    )
    for name in ("position", "velocity"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), abs=1e-9)


BOXES = swarm.Box((0.5, 0.5, 0.5)), swarm.Box((0.6, 0.2, 0.25), (0.9, 0.1, 0.05))
SPHERES = swarm.Sphere(0.5), swarm.Sphere(0.4, (0.6, 0.1, 0.0))
PIPE = swarm.Sphere(0.5), swarm.Cylinder(0.2, length=2.0, axis=(1.0, 0.0, 0.0), center=(0.9, 0.0, 0.0))
BIN = (
    swarm.Cylinder(0.4, length=1.0, axis=(0.0, 0.0, 1.0), center=(0.0, 0.0, 0.25)),
    swarm.Intersection([swarm.Cone(0.6, center=(0.0, 0.0, -0.9)), swarm.Plane((0.0, 0.0, 1.0), 0.0)]),
)
ROOMS = {"boxes": BOXES, "spheres": SPHERES, "pipe": PIPE, "bin": BIN}


def some(n=4, speed=2.0):
    places = np.array([(x, y, 0.0) for x in (-0.15, 0.15) for y in (-0.15, 0.15)]).T[:, :n]
    return swarm.Particles(places, speed * np.random.default_rng(1).normal(size=places.shape), radius=RADIUS)


@pytest.mark.parametrize("name", ROOMS)
def test_a_union_in_translation_is_one_at_rest_as_seen_from_it(name):
    velocity = np.array([[0.4], [0.1], [-0.3]])
    moved = ran(swarm.Union(ROOMS[name], motion=MOTIONS["translation"]), some(), swarm.Impact(), 0.3)
    there = some()
    there.velocity -= velocity
    still = ran(swarm.Union(ROOMS[name]), there, swarm.Impact(), 0.3)
    assert moved.observables["impacts"][-1] == still.observables["impacts"][-1] > 2
    assert moved.particles.position - 0.3 * velocity == pytest.approx(still.particles.position, abs=1e-11)


@pytest.mark.parametrize("motion", ["oscillation", "rotation"])
@pytest.mark.parametrize("name", ROOMS)
def test_no_point_of_a_ball_is_outside_of_rooms_that_move(name, motion):
    """phi of points all over the balls says so, with no use of edges or feet."""
    union = swarm.Union(ROOMS[name], motion=MOTIONS[motion])
    around = np.random.default_rng(5).normal(size=(3, 400))
    around *= RADIUS * (1.0 - 1e-9) / np.sqrt((around**2).sum(axis=0))
    farthest = []

    def look(frame):
        points = (frame.position[:, :, None] + around[:, None]).reshape(3, -1)
        farthest.append(union.phi(points, frame.time).max())

    result = ran(union, some(), swarm.Impact(), 0.4, every=0.02, progress=look)
    assert result.observables["impacts"][-1] > 2
    assert result.observables["energy_error"].max() < 1e-12
    assert result.observables["max_penetration"].max() < 1e-14
    assert result.observables["wall_work"][-1].sum() != 0.0
    assert max(farthest) <= 1e-9


@pytest.mark.parametrize("change", [{"mass": 3.0}, {"inertia": 2.0, "motion": swarm.Rotation((1.0, -2.0, 3.0), 0.4)}])
def test_rooms_with_a_mass_are_one_box_with_that(change):
    halves = swarm.Union([swarm.Box((0.35, 0.4, 0.45), (x, 0.0, 0.0)) for x in (-0.35, 0.35)], **change)
    box = swarm.Box((0.7, 0.4, 0.45), **change)
    one, other = (ran(vessel, some(), swarm.Impact(), 0.5) for vessel in (halves, box))
    assert one.observables["impacts"][-1] == other.observables["impacts"][-1] > 3
    assert one.particles.position == pytest.approx(other.particles.position, abs=1e-9)
    assert one.observables["energy_error"].max() < 1e-12


@pytest.mark.parametrize("name", ["spheres", "pipe"])
def test_rooms_with_a_mass_take_what_balls_lose(name):
    result = ran(swarm.Union(ROOMS[name], mass=3.0), some(), swarm.Impact(), 0.4, every=0.1)
    seen = result.observables
    assert seen["impacts"][-1] > 2
    assert seen["energy_error"].max() < 1e-12
    assert seen["max_penetration"].max() < 1e-14
    whole = seen["momentum"] + 3.0 * seen["wall_velocity"][:, 0]
    assert whole == pytest.approx(np.tile(some().velocity.sum(axis=1), (len(whole), 1)), abs=1e-12)


def test_points_meet_no_rooms_with_a_mass():
    points, turns = swarm.Particles((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), swarm.Rotation((0.0, 0.0, 1.0), 0.4)
    for given in ({"mass": 3.0}, {"inertia": 3.0, "motion": turns}):
        with pytest.raises(swarm.SceneError, match=r"surfaces\[0\].\w+ must be None for a Union of several rooms and"):
            ran(swarm.Union(SPHERES, **given), points, swarm.Impact())


def test_rooms_that_go_let_a_ball_fly_on():
    still, gone = (
        ran(swarm.Union(SPHERES, **given), some(1), swarm.Impact(), until)
        for given, until in (({}, 0.5), ({"present": [(0.0, 0.5)]}, 0.8))
    )
    assert gone.observables["impacts"][-1] == still.observables["impacts"][-1] > 0
    flown = still.particles.position + 0.3 * still.particles.velocity
    assert gone.particles.position == pytest.approx(flown, abs=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_a_wall_of_no_thickness_between_rooms_is_refused(method):
    door = swarm.Opening(swarm.Sphere(0.2), between=True)
    for given in ({"present": [(0.0, 0.5)]}, {"openings": [door]}):
        halves = swarm.Union([swarm.Box((0.35, 0.4, 0.45), (x, 0.0, 0.0)) for x in (-0.35, 0.35)], **given)
        with pytest.raises(swarm.SceneError, match=r"surfaces\[0\] must not have rooms that touch at a wall between"):
            ran(halves, some(1), METHODS[method])


def test_parts_that_change_each_by_itself_are_refused():
    parts = [swarm.Box((0.5,) * 3, motion=MOTIONS["oscillation"]), BOXES[1]]
    with pytest.raises(swarm.SceneError, match="the parts differ in motion, while an edge belongs to both"):
        ran(swarm.Union(parts), some(), swarm.Impact())
    parts = [swarm.Box((0.5,) * 3, openings=[swarm.Plane((-1.0, 0.0, 0.0), -0.4)]), BOXES[1]]
    with pytest.raises(swarm.SceneError, match="the parts differ in openings, while an edge belongs to both"):
        ran(swarm.Union(parts), some(), swarm.Impact())
