"""Cavities that overlap only in part: the run says that their common part is meant."""

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_openings import run

import swarm
from swarm import scene_file
from swarm.run.preflight.hints import warn_of_overlap, warn_of_walls_in_one_place

SENTENCE = (
    "surfaces[0] (Sphere) and surfaces[2] (Box) overlap only in part: particles stay in their common part; "
    'a vessel of both is one surface, swarm.Union([...]), in a scene file kind = "union"'
)
BALL = swarm.Sphere(0.5)
APART = {
    "two balls": ([BALL, swarm.Sphere(0.5, center=(0.6, 0.0, 0.0))], {}),
    "two boxes": ([swarm.Box((0.5, 0.5, 0.5)), swarm.Box((0.5, 0.5, 0.5), center=(0.7, 0.0, 0.0))], {}),
    "a rounded box": ([BALL, swarm.Box((0.4, 0.4, 0.4))], {}),
    "two unions": ([swarm.Union([BALL, swarm.Sphere(0.5, (0.6, 0, 0))]), swarm.Sphere(0.5, (0.0, 0.3, 0.0))], {}),
    "in the plane": ([swarm.Stadium(0.5, 1.0), swarm.Stadium(0.5, 1.0, center=(0.5, 0.5, 0.0))], {"plane": "z"}),
}
MEANT = {
    "one": ([BALL], {}),
    "a shell": ([BALL, swarm.Sphere(0.3, side="outside")], {}),
    "one in the other": ([BALL, swarm.Sphere(0.3, center=(0.1, 0.0, 0.0))], {}),
    "one that touches the other": ([swarm.Box((0.5, 0.5, 0.5)), BALL], {}),
    "a tube with lids": ([swarm.Cylinder(0.5), swarm.Plane((0, 0, 1), 1.0), swarm.Plane((0, 0, -1), 1.0)], {}),
    "a tube between planes": ([swarm.Cylinder(0.5), swarm.Slab((0, 0, 1), 1.0)], {}),
    "a cone with a lid": ([swarm.Cone(0.7, center=(0.0, 0.0, -0.5)), swarm.Plane((0, 0, 1), 0.3)], {}),
    "half a ball": ([BALL, swarm.Plane((0, 0, 1), 0.0)], {}),
    "a ball in a tube": ([BALL, swarm.Cylinder(0.3)], {}),
    "one after the other": (
        [swarm.Box((0.5,) * 3, present=[(0, 1)]), swarm.Box((0.5,) * 3, center=(0.5, 0, 0), present=[(1, 2)])], {}
    ),
}  # fmt: skip


def hints_of(scene, caplog):
    with caplog.at_level(logging.WARNING, "swarm"):
        warn_of_overlap(scene)
    return [record.getMessage() for record in caplog.records]


@pytest.mark.parametrize("name", APART)
def test_what_is_cut_is_reported(name, caplog):
    surfaces, given = APART[name]
    (sentence,) = hints_of(swarm.Scene(surfaces, **given), caplog)
    assert "surfaces[0]" in sentence
    assert "surfaces[1]" in sentence


@pytest.mark.parametrize("name", MEANT)
def test_what_is_meant_is_not(name, caplog):
    surfaces, given = MEANT[name]
    assert hints_of(swarm.Scene(surfaces, **given), caplog) == []


@pytest.mark.parametrize("path", sorted(Path("examples/scenes").glob("*.toml")), ids=lambda path: path.stem)
def test_no_scene_of_the_examples_is_cut(path, caplog):
    assert hints_of(scene_file.read(path).scene, caplog) == []


def test_a_run_says_it_once_before_it_starts(caplog):
    scene = swarm.Scene([BALL, swarm.Sphere(0.1, side="outside"), swarm.Box((0.4, 0.4, 0.4))])
    with caplog.at_level(logging.WARNING, "swarm"):
        run(scene, swarm.fill(scene, 3, speed=1.0, seed=1), until=1.0, frames=4)
    assert [record.getMessage() for record in caplog.records] == [SENTENCE]


LID = {"normal": (1.0, 0.0, 0.0), "offset": 0.5}
HALL = swarm.Box((0.5, 0.5, 0.5))
FLOOR = swarm.Plane((0.0, 0.0, -1.0))
POST = swarm.Box((0.1, 0.1, 0.2), center=(0.5, 0.0, 0.2), side="outside")
COLUMN = swarm.Cylinder(0.1, length=0.4, center=(0.5, 0.0, 0.2), side="outside")
LOW_ROOM = swarm.Box((1.0, 1.0, 0.5), center=(0.0, 0.0, 0.5))
BRICK = swarm.Box((0.5, 0.5, 0.5), side="outside")
TURN = {"axis": (0.0, 1.0, 0.0), "angle": 0.5}
SQUARE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
PIT = swarm.Prism(SQUARE, 1.0, center=(0.0, 0.0, 0.5))


def mesh_of(box, **given):
    """A box as twelve triangles."""
    corners = np.array(list(np.ndindex(2, 2, 2))) * 2.0 - 1.0
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [(a, *two) for a, b, c, d in sides for two in ((b, c), (c, d))]
    return swarm.Mesh(corners * box.half_widths, triangles, center=box.center, side=box.side, **given)


IN_ONE_PLACE = {
    "a column at a wall": (
        [swarm.Polygon(SQUARE, side="outside"), swarm.Plane((1.0, 0.0, 0.0), 1.0)],
        "touch at a face",
    ),
    "a mesh over an edge": (
        [BRICK, mesh_of(swarm.Box((0.1, 0.1, 0.1), center=(0.5, 0, 0.6), side="outside"))],
        "touch at a face",
    ),
    "a prism with a lid that absorbs": (
        [PIT, swarm.Plane((0.0, 0.0, 1.0), 1.0, laws=[swarm.Absorb(1.0)])],
        "the laws of either",
    ),
    "a face that absorbs": ([HALL, swarm.Plane(**LID, laws=[swarm.Absorb(1.0)])], "the laws of either"),
    "a face with losses": ([swarm.Plane(**LID, restitution=0.5), HALL], "the laws of either"),
    "a warm face": ([HALL, swarm.Plane(**LID, temperature=1.0)], "the laws of either"),
    "a post over an edge": (
        [BRICK, swarm.Box((0.1, 0.1, 0.1), center=(0.5, 0, 0.6), side="outside")],
        "touch at a face",
    ),
    "tiles": ([BRICK, swarm.Box((0.5, 0.5, 0.5), center=(1.0, 0.0, 0.0), side="outside")], "touch at a face"),
    "drums": ([COLUMN, swarm.Cylinder(0.1, length=0.4, center=(0.5, 0, 0.6), side="outside")], "touch at a face"),
    "tiles of a field": ([HALL, swarm.Boxes([[0.2 * k, 0.0, -0.3] for k in range(3)], (0.1,) * 3)], "touch at a face"),
    "pegs of a large field": (
        [FLOOR, swarm.Cylinders([[0.3 * k, 0.0, 0.2] for k in range(201)], 0.1, lengths=0.4)],
        "touch at a face",
    ),
    "a floor after its pegs": (
        [swarm.Cylinders([[0.3 * k, 0.0, 0.2] for k in range(201)], 0.1, lengths=0.4), FLOOR],
        "touch at a face",
    ),
    "turned tiles": ([HALL, swarm.Boxes([[0, 0, 0], [0, 0.2, 0]], (0.1,) * 3, [[0, 1.0, 0, 0]] * 2)], "touch at a"),
    "a post that stays": ([swarm.Plane((0.0, 0.0, -1.0), present=[(0, 1)]), POST], "touch at a face"),
    "two bricks": ([BRICK, swarm.Box((0.5, 0.5, 0.5), center=(1.0, 0.9, 0.0), side="outside")], "touch at a face"),
}
NOT_IN_ONE_PLACE = {
    "one law": [HALL, swarm.Plane(**LID)],
    "an open face": [swarm.Box((0.5, 0.5, 0.5), open=("+x",)), swarm.Plane(**LID, restitution=0.5)],
    "a lid before it": [HALL, swarm.Plane((1.0, 0.0, 0.0), 0.4999, restitution=0.5)],
    "one after the other": [
        swarm.Plane(**LID, restitution=0.9, present=[(0, 1)]), swarm.Plane(**LID, restitution=0.5, present=[(1, 2)])
    ],
    "a post on a plane": [FLOOR, POST],
    "a post in a box": [LOW_ROOM, POST],
    "a post in a corner": [LOW_ROOM, swarm.Box((0.1, 0.1, 0.2), center=(0.9, 0.9, 0.2), side="outside")],
    "a beam from wall to wall": [LOW_ROOM, swarm.Box((0.1, 1.0, 0.2), center=(0.0, 0.0, 0.5), side="outside")],
    "a column": [FLOOR, COLUMN],
    "pegs of a field": [FLOOR, swarm.Cylinders([[0.3 * k, 0.0, 0.2] for k in range(3)], 0.1, lengths=0.4)],
    "posts of a field": [PIT, swarm.Boxes([[0.5, 0.5 * k, 0.2] for k in range(2)], POST.half_widths)],
    "a mesh on a plane": [FLOOR, mesh_of(POST)],
    "a turned mesh": [FLOOR, mesh_of(POST, rotation={"axis": (0.0, 0.0, 1.0), "angle": 0.5})],
    "a post in a prism": [PIT, POST],
    "a post in a mesh": [mesh_of(LOW_ROOM), POST],
    "a mesh in a corner of a prism": [PIT, mesh_of(swarm.Box((0.1, 0.1, 0.2), (0.9, 0.9, 0.2), side="outside"))],
    "a mesh above its floor": [FLOOR, mesh_of(swarm.Box((0.1, 0.1, 0.1), center=(0.5, 0, 0.2), side="outside"))],
    "a post that overlaps its floor": [FLOOR, swarm.Box((0.1, 0.1, 0.2), center=(0.5, 0.0, 0.1), side="outside")],
    "a post above its floor": [FLOOR, swarm.Box((0.1, 0.1, 0.1), center=(0.5, 0.0, 0.2), side="outside")],
    "bricks in one layer, apart": [BRICK, swarm.Box((0.5, 0.5, 0.5), center=(1.0, 1.5, 0.0), side="outside")],
    "bricks beside one another": [BRICK, swarm.Box((0.5, 0.5, 0.5), center=(2.0, 0.0, 0.0), side="outside")],
    "tiles apart": [HALL, swarm.Boxes([[0.3 * k, 0.0, -0.3] for k in range(3)], (0.1,) * 3)],
    "tiles that overlap": [HALL, swarm.Boxes([[0.19 * k, 0.0, -0.3] for k in range(3)], (0.1,) * 3)],
    "a turned post": [FLOOR, swarm.Box((0.1, 0.1, 0.1), center=(0.5, 0, 0.1), side="outside", rotation=TURN)],
}  # fmt: skip


def hints_of_walls(surfaces, caplog, of_points=True):
    with caplog.at_level(logging.WARNING, "swarm"):
        warn_of_walls_in_one_place(swarm.Scene(surfaces), of_points)
    return [record.getMessage() for record in caplog.records]


@pytest.mark.parametrize("name", IN_ONE_PLACE)
def test_walls_in_one_place_are_reported(name, caplog):
    surfaces, words = IN_ONE_PLACE[name]
    (sentence,) = hints_of_walls(surfaces, caplog)
    assert "surfaces[0]" in sentence or "body 0 of surfaces[1]" in sentence
    assert "surfaces[1]" in sentence
    assert words in sentence


@pytest.mark.parametrize("name", NOT_IN_ONE_PLACE)
def test_other_walls_are_not(name, caplog):
    assert hints_of_walls(NOT_IN_ONE_PLACE[name], caplog) == []


def test_lids_in_a_scene_of_two_dimensions_are_not_met(caplog):
    """Boxes of one height have lids in one place, which no particle of the plane meets; sides may be in one place."""
    low = swarm.Box((0.5, 0.1, 1.0), side="outside")
    high = swarm.Box((0.5, 0.1, 1.0), center=(0.0, 0.15, 0.0), side="outside", restitution=0.5)
    with caplog.at_level(logging.WARNING, "swarm"):
        warn_of_walls_in_one_place(swarm.Scene([low, replace(high, half_widths=(0.4, 0.1, 1.0))], plane="z"), True)
        assert not caplog.records
        warn_of_walls_in_one_place(swarm.Scene([low, high], plane="z"), True)
    assert "the laws of either" in caplog.text


def test_balls_do_not_fit_into_a_gap_of_no_width(caplog):
    assert hints_of_walls([BRICK, swarm.Box((0.5, 0.5, 0.5), center=(1, 0, 0), side="outside")], caplog, False) == []


def sunk(post, by):
    """A post of which so much more is below the floor."""
    x, y, z = post.center
    if isinstance(post, swarm.Box):
        a, b, half = post.half_widths
        return swarm.Box((a, b, half + 0.5 * by), center=(x, y, z - 0.5 * by), side="outside")
    return swarm.Cylinder(post.radius, length=post.length + by, center=(x, y, z - 0.5 * by), side="outside")


def slid_against(room, post, gravity, radius):
    # The first meets the post, the second one passes beside it.
    low = 0.0 if radius is None else radius
    position = np.array([[0.25, 0.25], [0.01, 0.4], [low, low]])
    velocity = np.array([[1.0, 1.0], [0.0, 0.0], [0.0, 0.0]])
    particles = swarm.Particles(position, velocity, radius=radius)
    return run(swarm.Scene([room, post], gravity=gravity), particles, until=0.8, frames=2)


@pytest.mark.parametrize("post", [POST, COLUMN, swarm.Box((0.1,) * 3, center=(0.9, 0.0, 0.1), side="outside")])
@pytest.mark.parametrize(("gravity", "radius"), [(None, None), ((0.0, 0.0, -9.81), None), (None, 0.05)])
def test_what_slides_on_a_floor_meets_a_post_that_stands_on_it(post, gravity, radius):
    ends = [slid_against(LOW_ROOM, foot, gravity, radius) for foot in (post, sunk(post, 0.01))]
    for one in ends:
        assert one.particles.position[0, 0] < 0.8
        assert one.impacts_per_particle[0] >= 1
        assert one.particles.velocity[0, 0] < 0.0
        energy = one.observables["total_energy"]
        assert np.abs(energy / energy[0] - 1.0).max() < 1e-12
    np.testing.assert_allclose(ends[0].particles.position, ends[1].particles.position, atol=1e-12)


@pytest.mark.parametrize("gravity", [None, (0.0, 0.0, -9.81)])
@pytest.mark.parametrize(
    ("room", "post"),
    [
        (PIT, POST), (LOW_ROOM, mesh_of(POST)), (mesh_of(LOW_ROOM), POST),
        (LOW_ROOM, swarm.Boxes([POST.center, (0.5, 0.8, 0.2)], POST.half_widths)),
    ],
    ids=["prism", "post of a mesh", "mesh", "field"],
)  # fmt: skip
def test_posts_stand_flush_on_prisms_and_meshes_and_in_fields_too(room, post, gravity):
    one, other = slid_against(room, post, gravity, None), slid_against(LOW_ROOM, sunk(POST, 0.01), gravity, None)
    assert one.particles.velocity[0, 0] < 0.0
    np.testing.assert_allclose(one.particles.position, other.particles.position, atol=1e-12)
