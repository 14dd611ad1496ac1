"""Cavities that overlap only in part: the run says that what they have in common is meant."""

import logging
from pathlib import Path

import pytest
from test_openings import run

import swarm
from swarm import scene_file
from swarm.run.preflight.hints import warn_of_overlap, warn_of_walls_in_one_place

SENTENCE = (
    "surfaces[0] (Sphere) and surfaces[2] (Box) overlap only in part: particles are kept in what they have in common; "
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
BRICK = swarm.Box((0.5, 0.5, 0.5), side="outside")
TURN = {"axis": (0.0, 1.0, 0.0), "angle": 0.5}
IN_ONE_PLACE = {
    "a face that absorbs": ([HALL, swarm.Plane(**LID, laws=[swarm.Absorb(1.0)])], "the laws of either"),
    "a face with losses": ([swarm.Plane(**LID, restitution=0.5), HALL], "the laws of either"),
    "a warm face": ([HALL, swarm.Plane(**LID, temperature=1.0)], "the laws of either"),
    "a post on a plane": ([FLOOR, POST], "touch at a face"),
    "a post in a box": ([swarm.Box((1.0, 1.0, 0.5), center=(0.0, 0.0, 0.5)), POST], "touch at a face"),
    "two bricks": ([BRICK, swarm.Box((0.5, 0.5, 0.5), center=(1.0, 0.9, 0.0), side="outside")], "touch at a face"),
    "a column": ([FLOOR, swarm.Cylinder(0.1, length=0.4, center=(0, 0, 0.2), side="outside")], "touch at a face"),
}
NOT_IN_ONE_PLACE = {
    "one law": [HALL, swarm.Plane(**LID)],
    "an open face": [swarm.Box((0.5, 0.5, 0.5), open=("+x",)), swarm.Plane(**LID, restitution=0.5)],
    "a lid before it": [HALL, swarm.Plane((1.0, 0.0, 0.0), 0.4999, restitution=0.5)],
    "one after the other": [
        swarm.Plane(**LID, restitution=0.9, present=[(0, 1)]), swarm.Plane(**LID, restitution=0.5, present=[(1, 2)])
    ],
    "a post that overlaps its floor": [FLOOR, swarm.Box((0.1, 0.1, 0.2), center=(0.5, 0.0, 0.1), side="outside")],
    "a post above its floor": [FLOOR, swarm.Box((0.1, 0.1, 0.1), center=(0.5, 0.0, 0.2), side="outside")],
    "bricks in one layer, apart": [BRICK, swarm.Box((0.5, 0.5, 0.5), center=(1.0, 1.5, 0.0), side="outside")],
    "bricks beside one another": [BRICK, swarm.Box((0.5, 0.5, 0.5), center=(2.0, 0.0, 0.0), side="outside")],
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
    assert "surfaces[0]" in sentence
    assert "surfaces[1]" in sentence
    assert words in sentence


@pytest.mark.parametrize("name", NOT_IN_ONE_PLACE)
def test_other_walls_are_not(name, caplog):
    assert hints_of_walls(NOT_IN_ONE_PLACE[name], caplog) == []


def test_balls_do_not_fit_into_a_gap_of_no_width(caplog):
    assert hints_of_walls([FLOOR, POST], caplog, of_points=False) == []
