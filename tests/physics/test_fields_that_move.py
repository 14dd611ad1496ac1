"""A field that moves, or is among walls that do, is the same bodies one by one, and keeps what is to be kept."""

from dataclasses import replace

import numpy as np
import pytest

import swarm
from swarm.errors import SceneError
from swarm.observables import drift
from swarm.surfaces.fields import many

DOWN = (0.0, 0.0, -9.81)
BOX = (0.5, 0.5, 0.5)
SHAKEN = swarm.Oscillation((0.05, 0.02, 0.0), 1.0)
SHIFTED = swarm.Translation((0.05, 0.02, -0.03))
TURNED = swarm.Rotation((0.2, 0.1, 1.0), 2.0, (0.02, 0.0, 0.0))
LED = swarm.Path([0.0, 0.5, 1.0, 2.5], [(0, 0, 0), (0.05, 0, 0), (0, 0.05, 0), (0, 0, 0.05)])


def run(scene, start, until, **method):
    return swarm.simulate(scene, start, swarm.Impact(**method), until=until, compile="never")


def places(n, seed=1):
    return np.random.default_rng(seed).uniform(-0.25, 0.25, (n, 3))


@pytest.fixture(autouse=True)
def cells(monkeypatch):
    """Fields of a few bodies have cells too."""
    for limit in ("_FEW", "_FEW_BALLS", "_IN_ONE_CELL"):
        monkeypatch.setattr(many, limit, 0)


@pytest.mark.parametrize(
    ("box", "field", "gravity", "laws", "until"),
    [
        (SHAKEN, None, None, {}, 3.0),
        (SHAKEN, None, DOWN, {}, 2.0),
        (None, SHIFTED, None, {}, 3.0),
        (None, SHIFTED, DOWN, {}, 2.0),
        (None, SHAKEN, None, {}, 3.0),
        (None, TURNED, None, {}, 3.0),
        (None, LED, DOWN, {}, 2.0),
        (SHAKEN, TURNED, DOWN, {}, 1.5),
        (SHAKEN, TURNED, None, {"restitution": 0.9, "friction": 0.2}, 0.5),
        (SHAKEN, SHIFTED, None, {"temperature": 1.0}, 1.0),
    ],
)
def test_a_field_is_its_balls(box, field, gravity, laws, until):
    c, radius = places(6), 0.09
    vessel = swarm.Box(BOX, motion=box, **laws)
    balls = [swarm.Sphere(radius, tuple(one), "outside", motion=field, **laws) for one in c.tolist()]
    scene = swarm.Scene([vessel, swarm.Spheres(c, radius, motion=field, **laws)], gravity)
    start = swarm.fill(scene, 6, speed=1.0, seed=2)
    one, other = run(scene, start, until), run(swarm.Scene([vessel, *balls], gravity), start, until)
    # What a flight through cells rounds differently grows from impact to impact.
    assert one.particles.position == pytest.approx(other.particles.position, abs=1e-8)
    seen, wanted = one.observables, other.observables
    assert seen["impacts"][-1] == wanted["impacts"][-1] >= 7
    assert np.abs(seen["impulse"][-1]).min() > 0.0
    for name in ("impulse", "wall_work", "wall_heat"):
        each = wanted[name][-1]
        assert seen[name][-1] == pytest.approx([each[0], each[1:].sum()], abs=1e-7)
    assert drift(seen) <= 1e-13
    assert seen["max_penetration"].max() <= 1e-14


def solids(kind, c):
    axes = np.random.default_rng(3).standard_normal((len(c), 3))
    return {
        "cylinders": lambda: swarm.Cylinders(c, 0.09, axes, 0.2, motion=TURNED),
        "posts": lambda: swarm.Cylinders(c, 0.09, motion=SHAKEN),
        "capsules": lambda: swarm.Capsules(c, 0.09, 0.1, axes, motion=SHAKEN),
        "boxes": lambda: swarm.Boxes(c, (0.12, 0.1, 0.09), motion=TURNED),
        "ellipsoids": lambda: swarm.Ellipsoids(c, (0.14, 0.12, 0.1), motion=SHAKEN),
    }[kind]()


@pytest.mark.parametrize("kind", ["cylinders", "posts", "capsules", "boxes", "ellipsoids"])
def test_bodies_of_every_kind_move(kind):
    field = solids(kind, places(5))
    vessel = swarm.Box((0.35, 0.35, 0.35))
    scene = swarm.Scene([vessel, field])
    start = swarm.fill(scene, 8, speed=1.0, seed=2)
    apart = [vessel, *(replace(one, motion=field.motion) for one in field.solids())]
    one, other = run(scene, start, 1.0), run(swarm.Scene(apart), start, 1.0)
    assert one.observables["wall_work"][-1, 1] != 0.0
    assert one.particles.position == pytest.approx(other.particles.position, abs=1e-9)


@pytest.mark.parametrize("gravity", [None, DOWN], ids=["straight", "falling"])
def test_in_uniform_translation_it_is_the_field_at_rest(gravity):
    """Seen from a frame that moves with all walls."""
    c, u = places(40, seed=4), np.array([[0.3], [-0.2], [0.1]])
    moved = swarm.Translation(tuple(u[:, 0].tolist()))
    rest = swarm.Scene([swarm.Box(BOX), swarm.Spheres(c, 0.05)], gravity)
    start = swarm.fill(rest, 8, speed=1.0, seed=5)
    scene = swarm.Scene([swarm.Box(BOX, motion=moved), swarm.Spheres(c, 0.05, motion=moved)], gravity)
    one = run(scene, swarm.Particles(start.position, start.velocity + u), 1.0)
    other = run(rest, start, 1.0)
    assert one.particles.position - u == pytest.approx(other.particles.position, abs=1e-9)
    assert one.observables["impacts"][-1] == other.observables["impacts"][-1] >= 15


def test_a_grain_slides_off_a_ball_that_moves_where_it_slides_off_a_ball():
    far, motion = np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 0.0]]), swarm.Oscillation((0.0, 0.01, 0.0), 0.1)
    start = swarm.Particles([0.2, 0.0, np.sqrt(1.0 - 0.04)], [0.0, 2e-3 * np.pi, 0.0])
    surfaces = swarm.Spheres(far, 1.0, motion=motion), swarm.Sphere(1.0, side="outside", motion=motion)
    ends = [run(swarm.Scene([surface], (0.0, 0.0, -1.0)), start, 3.5, sliding_tolerance=1e-6) for surface in surfaces]
    assert ends[0].observables["sliding_time"][-1] > 1.0
    assert ends[0].particles.position == pytest.approx(ends[1].particles.position, abs=1e-8)


def test_phi_is_that_of_a_time():
    c, points = places(30), np.random.default_rng(6).uniform(-0.4, 0.4, (3, 50))
    field, time = swarm.Spheres(c, 0.05, motion=TURNED), 0.7
    each = [swarm.Sphere(0.05, tuple(one), "outside", motion=TURNED) for one in c.tolist()]
    nearest = np.argmin([one.phi(points, time) for one in each], axis=0)
    assert field.phi(points, time) == pytest.approx(np.min([one.phi(points, time) for one in each], axis=0))
    wanted = np.array([each[k].gradient(points[:, [i]], time)[:, 0] for i, k in enumerate(nearest)]).T
    assert field.gradient(points, time) == pytest.approx(wanted)


def test_across_a_period():
    """Balls at the faces of a cell that repeats along x, which move across it."""
    c, motion = np.array([[0.0, 0.0, 0.0], [0.5, 0.2, 0.1]]), swarm.Oscillation((0.0, 0.05, 0.0), 1.0)
    walls = swarm.Slab((0.0, 1.0, 0.0), 0.5), swarm.Slab((0.0, 0.0, 1.0), 0.5)
    balls = [swarm.Sphere(0.2, tuple(one), "outside", motion=motion) for one in c.tolist()]
    scene = swarm.Scene([*walls, swarm.Spheres(c, 0.2, motion=motion)], period=(1.0, None, None))
    start = swarm.fill(scene, 5, speed=1.0, seed=2)
    one, other = run(scene, start, 3.0), run(swarm.Scene([*walls, *balls], period=scene.period), start, 3.0)
    assert one.observables["wall_work"][-1, 2] != 0.0
    assert one.particles.position == pytest.approx(other.particles.position, abs=1e-9)


def test_impacts_move_no_foam():
    with pytest.raises(SceneError, match='mass must be left out for Spheres with side="inside"'):
        swarm.Spheres(places(3), 0.1, side="inside", mass=1.0)
