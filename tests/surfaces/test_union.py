"""Unions and intersections as they are described: the level set, what is flattened, tables, and bad input."""

import tomllib

import numpy as np
import pytest
import tomli_w

import swarm
from swarm.events import packing
from swarm.serialization import run_tables, tables
from swarm.surfaces.instant import side_of

TUBE = swarm.Cylinder(0.2, (1.0, 0.0, 0.0), 1.0, (0.8, 0.0, 0.0))
BALL = swarm.Sphere(0.5)
POST = swarm.Cylinder(0.1, side="outside")
BOX = swarm.Box((0.3, 0.2, 0.4), (1.5, 0.1, 0.0), rotation={"axis": (1, 2, 3), "angle": 0.4})


def _points(n=2000):
    return np.random.default_rng(0).uniform(-1.5, 2.5, (3, n))


def _inside(surface, points):
    return side_of(surface) * surface.phi(points) <= 0.0


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_a_union_holds_what_one_part_holds_and_an_intersection_what_all_hold(side):
    points, parts = _points(), (BALL, TUBE, swarm.Intersection([BOX, swarm.Sphere(0.4, (1.5, 0.0, 0.0), "outside")]))
    held = np.array([_inside(part, points) for part in parts])
    sign = side == "inside"
    assert np.array_equal(_inside(swarm.Union(parts, side), points), held.any(axis=0) == sign)
    both = [swarm.Union([BALL, TUBE, BOX]), POST]
    held = np.array([_inside(part, points) for part in both])
    assert np.array_equal(_inside(swarm.Intersection(both, side), points), held.all(axis=0) == sign)


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_rooms_are_the_same_set_as_nested_parts(side):
    nested = swarm.Union(
        [swarm.Intersection([swarm.Union([BALL, BOX]), POST]), swarm.Union([TUBE, BOX], side="outside")], side
    )
    points = _points()
    held = np.zeros(points.shape[1], bool)
    for room in nested.rooms:
        held |= np.all([_inside(one, points) for one in room], axis=0)
    assert np.array_equal(held, _inside(nested, points))


def test_the_gradient_is_that_of_phi():
    union = swarm.Union([BALL, TUBE, swarm.Intersection([BOX, POST])])
    points, h = _points(500), 1e-6
    steps = [h * np.eye(3)[:, k : k + 1] for k in range(3)]
    slopes = np.array([(union.phi(points + step) - union.phi(points - step)) / (2.0 * h) for step in steps])
    assert np.quantile(np.abs(slopes - union.gradient(points)).max(axis=0), 0.99) < 1e-8


def test_a_union_that_moves_is_where_its_motion_brings_it():
    union = swarm.Union([BALL, TUBE], motion=swarm.Translation((1.0, 0.0, 0.0)))
    points = _points()
    moved = union.phi(points + np.array([[2.0], [0.0], [0.0]]), time=2.0)
    assert np.allclose(moved, union.phi(points), atol=1e-12)
    assert all(one.motion == union.motion for one in union.surfaces())


def test_what_is_given_to_the_whole_holds_for_parts_that_leave_it_out():
    union = swarm.Union([swarm.Sphere(0.5, friction=0.1), swarm.Union([TUBE])], friction=0.3, temperature=2.0)
    assert [one.friction for one in union.surfaces()] == [0.1, 0.3]
    assert [one.temperature for one in union.surfaces()] == [2.0, 2.0]


def test_a_union_is_the_same_from_its_table():
    union = swarm.Union(
        [
            swarm.Sphere(0.5, temperature=1.0, openings=[swarm.Sphere(0.1, (-0.5, 0.0, 0.0))]),
            swarm.Intersection([BOX, POST, swarm.Union([BALL, TUBE], "outside")]),
        ],
        restitution=0.9,
    )
    text = tomli_w.dumps({"surface": [tables.table_of(union)]})
    assert "[[surface.part.part.part]]" in text
    assert tables.scene_of(tomllib.loads(text)["surface"], None).surfaces[0] == union


def test_bounds_hold_what_is_admissible():
    union = swarm.Union([BALL, swarm.Intersection([swarm.Cone(0.4, (1, 0, 0)), swarm.Plane((1, 0, 0), 1.2)]), BOX])
    low, high = (np.array(corner)[:, None] for corner in union.bounds())
    assert np.isfinite(low).all()
    assert np.isfinite(high).all()
    points = _points(20000)
    inside = points[:, union.phi(points) <= 0.0]
    assert inside.shape[1] > 100
    assert ((inside >= low) & (inside <= high)).all()
    assert swarm.Union([BALL], "outside").bounds()[1] == (np.inf,) * 3


class Nowhere(swarm.Sphere):
    """A surface without an inside."""

    def phi(self, points, time=0.0):
        return super().phi(points, time) + 1.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: swarm.Union([]), "parts must hold at least one surface of the Union, got none"),
        (lambda: swarm.Union(BALL), "parts must be a list of surfaces such as swarm.Sphere, got Sphere"),
        (lambda: swarm.Union([BALL, 1.0]), r"parts\[1\] must be a surface such as swarm.Sphere, got 1.0"),
        (
            lambda: swarm.Union([BALL, swarm.Intersection([BALL, swarm.Sphere(0.5, (2.0, 0.0, 0.0))])]),
            "parts must have a volume in common, got Sphere.*no point in common; check their `side`",
        ),
        (
            lambda: swarm.Union([swarm.Plane((1.0, 0.0, 0.0), 1.0), swarm.Plane((-1.0, 0.0, 0.0), 1.0)], "outside"),
            'parts must leave an inside of a Union with side="outside", got Plane.*no point is admissible',
        ),
        (lambda: swarm.Union([BALL, Nowhere(0.5)]), r"parts\[1\] must have a volume, got .*no point is admissible"),
        (lambda: swarm.Union([BALL, swarm.Formula("x**2 + y**2 + z**2")]), "phi must be 0 somewhere, got above 0"),
        (
            lambda: swarm.Union(
                [swarm.Sphere(1.0, motion=swarm.Translation((1.0, 0.0, 0.0)))], rotation=(1.0, 0.0, 0.0, 0.1)
            ),
            "no motion of its own where the Union has a rotation.*to the whole",
        ),
        (
            lambda: swarm.Union([swarm.Sphere(1.0, mass=1.0)]),
            r"parts\[0\] must have no mass and no inertia.*impacts move surfaces of the scene only",
        ),
        (
            lambda: swarm.Union(
                [swarm.Sphere(1.0, motion=swarm.Translation((1.0, 0.0, 0.0)))], motion=swarm.Translation((1, 0, 0))
            ),
            r"parts\[0\] must have no motion of its own where the Union has one",
        ),
        (
            lambda: swarm.Union([swarm.Box((1.0, 1.0, 1.0), open=["+x"])], "outside"),
            "parts must have an other side where the whole is turned.*open must be empty",
        ),
        (
            lambda: swarm.Intersection([swarm.Union([BALL, TUBE, BOX, POST]) for _k in range(4)] + [POST]),
            "parts must leave at most 64 rooms.*got 256; list what they have in common",
        ),
        (
            lambda: swarm.Union([BALL, swarm.Mesh(np.eye(4, 3), [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])]),
            "parts must not be Mesh in a Union of several rooms, got Mesh.*make one mesh",
        ),
        (
            lambda: swarm.Union([BALL, swarm.Intersection([BOX, swarm.Spheres([[1.5, 0.1, 0.0]], 0.1)])]),
            "parts must not be Spheres in a Union of several rooms",
        ),
        (
            lambda: swarm.Union(
                [BALL, swarm.Sampled(-1.0 - np.arange(5.0)[:, None, None] * np.ones((5, 5, 5)) + 2.0, 0.5, (0, 0, 0))]
            ),
            "parts must be known everywhere.*border of its grid",
        ),
    ],
)
def test_bad_input_is_a_sentence(make, message):
    with pytest.raises(swarm.SceneError, match=message):
        make()


def test_a_table_names_the_part_that_is_wrong():
    table = {"kind": "union", "part": [{"kind": "sphere", "radius": 1.0}, {"kind": "sphere", "radius": -1.0}]}
    with pytest.raises(swarm.SceneError, match=r"surface\[0\].part\[1\].radius must be"):
        tables.scene_of([table], None)
    with pytest.raises(swarm.SceneError, match=r"surface\[0\].part: expected \[\[surface.part\]\] tables"):
        tables.scene_of([{"kind": "union", "part": 3}], None)


# --- What is given to a part is found in it ----------------------------------------------------------------

HOLE = swarm.Sphere(0.2, (0.0, 0.0, 0.5))
OPEN_ROOM = swarm.Intersection([swarm.Box((0.5, 0.5, 0.5), openings=[HOLE])])


def _one_contact_step():
    ball = swarm.Intersection([swarm.Sphere(0.5, motion=swarm.Translation((1.0, 0.0, 0.0)))])
    method = swarm.AugmentedLagrangian(dt=0.025, penalty=1e4)
    swarm.contact_history(swarm.Scene([ball]), (0.4, 0.3, 0.0), (0.3, 0.4, 0.0), 1.0, method)


def _cut_steps():
    ball = swarm.Intersection([swarm.Sphere(0.5, motion=swarm.Translation((1.0, 0.0, 0.0)))])
    method = swarm.AugmentedLagrangian(dt=0.025, penalty=1e4, adaptive=True)
    swarm.simulate(swarm.Scene([ball]), swarm.Particles([[0.0]] * 3, [[1.0]] * 3), method, until=0.1, compile="never")


def _out_of_the_plane():
    tube = swarm.Cylinder(0.5, motion=swarm.Translation((0.0, 0.0, 1.0)))
    swarm.Scene([swarm.Union([tube, swarm.Cylinder(0.5, center=(0.6, 0.0, 0.0))])], plane="z")


@pytest.mark.parametrize(
    ("run", "message"),
    [
        (_one_contact_step, r"surfaces\[0\] must be at rest, without motion"),
        (_cut_steps, r"surfaces\[0\].motion must be None with adaptive = True"),
        (_out_of_the_plane, r"surfaces\[0\].motion must stay in the plane"),
    ],
)
def test_what_does_not_go_with_a_run_is_found_in_a_part(run, message):
    with pytest.raises(swarm.SceneError, match=message):
        run()


def test_with_an_opening_of_a_part_a_flight_ends_in_its_cell():
    """Where every cell has its image of the opening."""
    for whole in (lambda one: one, lambda one: swarm.Intersection([one])):
        tube = whole(
            swarm.Cylinder(0.4, (1, 0, 0), center=(0, 0.5, 0.5), openings=[swarm.Sphere(0.1, (0.5, 0.9, 0.5))])
        )
        start = swarm.Particles([[0.1], [0.5], [0.5]], [[1.4], [0.4], [0.0]])
        scene = swarm.Scene([tube], period=(1.0, None, None))
        seen = swarm.simulate(scene, start, swarm.Impact(), until=2.0, compile="never")
        assert seen.escape_time[0] == pytest.approx(1.0, abs=1e-12)


def test_balls_are_packed_within_the_openings_of_parts():
    scene = packing._at_rest(swarm.Scene([OPEN_ROOM]))
    assert scene.compiled().openings() is None


def test_an_opening_of_a_nested_part_opens_that_part_alone():
    """Other parts of the same union need not reach it; one that reaches none of them is an error that names it."""
    room = swarm.Union(
        [swarm.Union([OPEN_ROOM, swarm.Sphere(0.2, (0.0, 0.0, -0.5))]), swarm.Sphere(0.3, (0.6, 0.0, 0.0))]
    )
    scene = swarm.Scene([room])
    assert [bool(volumes) for volumes in scene.pieces.volumes] == [True, False, False]
    inner = swarm.Union(
        [swarm.Sphere(0.5), swarm.Sphere(0.3, (0.5, 0.0, 0.0))], openings=[swarm.Sphere(0.1, (3.0, 0.0, 0.0))]
    )
    with pytest.raises(
        swarm.SceneError, match=r"surfaces\[0\].parts\[1\].openings\[0\] must reach the wall that it opens"
    ):
        swarm.Scene([swarm.Union([swarm.Sphere(0.5), inner])])


def test_a_scene_file_names_the_opening_of_a_part():
    room = swarm.Scene([swarm.Union([swarm.Sphere(0.5), swarm.Union([OPEN_ROOM])])])
    source = {"count": 1, "stop": 1.0, "speed": 1.0}
    place = {"surface": 0, "part": [1, 0, 0], "opening": 0}
    (made,) = run_tables.sources_of([{**source, "where": place}], room)
    assert made.where is HOLE
    for wrong, message in (
        ({**place, "part": 2}, r"source\[0\].where.part: expected a number from 0 to 1, got 2"),
        (
            {**place, "part": [1, 0, 0, 0]},
            r"source\[0\].where.part: expected no value, for there is nothing to choose from, got 0",
        ),
        (
            {**place, "part": 1},
            r"source\[0\].where.opening: expected no value, for there is nothing to choose from, got 0",
        ),
        ({**place, "prat": 1}, r"source\[0\].where.prat: unknown key"),
        ({"opening": 0}, r"source\[0\].where.surface: expected the number of a surface"),
    ):
        with pytest.raises(swarm.SceneError, match=message):
            run_tables.sources_of([{**source, "where": wrong}], room)
