"""Bodies: what they hold and what they refuse, with the rank of their links."""

import itertools
import math

import numpy as np
import pytest

import swarm

SQUARE = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
RING = [(0, 1), (1, 2), (2, 3), (3, 0)]
ALL_OF_5 = list(itertools.combinations(range(5), 2))
ANYWHERE = np.random.default_rng(5).standard_normal((5, 3))
FLOOR = swarm.Plane((0.0, 0.0, 1.0), 0.0)
SPHERES = swarm.Spheres([(0.0, 0.0, 0.0), (9.0, 0.0, 0.0)], 1.0)
SPRING = swarm.Strain([(0, 1)], [1.0], [[1.0]])


def square(**options):
    return swarm.Body(SQUARE, **({"mass": 1.0} | options))


def test_what_is_given_is_held():
    body = square(mass=[1, 2, 3, 4], links=RING[:3], springs=[(0, 3, 5, 1)], contacts=[2, 0], faces=[])
    assert body.mass_matrix.tolist() == np.diag([1.0, 2.0, 3.0, 4.0]).tolist()
    assert body.contacts.tolist() == [[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0]]
    assert body.springs == ((0, 3, 5.0, 1.0),)
    assert body.bonds().tolist() == [[0, 1], [1, 2], [2, 3], [0, 3]]
    assert len(body) == 4
    assert body.faces.shape == (0, 3)
    assert square(strain=SPRING).bonds().tolist() == [[0, 1]]


def test_contacts_are_all_points_that_can_move():
    assert square().contacts.tolist() == np.eye(4).tolist()
    assert square(anchors={1: None}).contacts.tolist() == np.eye(4)[[0, 2, 3]].tolist()
    assert square(contacts=[]).contacts.shape == (0, 4)


def test_a_light_point_beside_a_heavy_one_is_no_singularity():
    assert square(mass=None, mass_matrix=np.diag([1e-40, 1.0, 1e40, 1.0])).mass_matrix[0, 0] == 1e-40


# --- The rank of links -----------------------------------------------------------------------------------


@pytest.mark.parametrize("left_out", ALL_OF_5)
def test_five_points_need_nine_of_ten_links(left_out):
    links = [link for link in ALL_OF_5 if link != left_out]
    assert len(swarm.Body(ANYWHERE, 1.0, links=links).links) == 9


def test_redundant_links_are_named_and_others_are_not():
    """A complete graph of five points with a tail, and with two points that hang on it."""
    tail = ANYWHERE[0] + [(3.0, 0.0, 0.0), (4.0, 1.0, 0.0)]
    with pytest.raises(swarm.SceneError) as caught:
        swarm.Body([*ANYWHERE, *tail], 1.0, links=[(0, 5), *ALL_OF_5, (5, 6)])
    message = str(caught.value)
    assert "links[0]" not in message
    assert "links[11]" not in message
    assert all(f"links[{k}] " in message for k in range(1, 11))
    assert "1 follows from the others" in message


def test_a_scale_does_not_change_the_rank():
    for scale in (1e-30, 1e30):
        swarm.Body(scale * ANYWHERE, 1.0, links=ALL_OF_5[:-1])
        with pytest.raises(swarm.SceneError, match="independent"):
            swarm.Body(scale * ANYWHERE, 1.0, links=ALL_OF_5)


def test_links_to_anchors_hold_a_point():
    """Three links to fixed points take all freedom of a point; a fourth is redundant."""
    corners = [*ANYWHERE[:4], (5.0, 4.0, 3.0)]
    fixed = dict.fromkeys(range(4))
    swarm.Body(corners, 1.0, links=[(4, 0), (4, 1), (4, 2)], anchors=fixed)
    with pytest.raises(swarm.SceneError, match="1 follows"):
        swarm.Body(corners, 1.0, links=[(4, 0), (4, 1), (4, 2), (4, 3)], anchors=fixed)


def test_a_long_chain_is_no_dependence():
    assert len(swarm.chain(200, 1.0, 1.0).links) == 199


def test_a_planar_pendulum_is_held_by_a_link_and_a_guide():
    body = swarm.Body(SQUARE[:2], 1.0, links=[(0, 1)], anchors={0: None}, guides=[(1, FLOOR)])
    assert body.guides == ((1, FLOOR),)


def test_a_point_between_two_walls_is_a_slider():
    swarm.Body(SQUARE[:2], 1.0, guides=[(0, FLOOR), (0, swarm.Plane((0.0, 1.0, 0.0), 0.0))])


# --- Led points ------------------------------------------------------------------------------------------


def test_a_chain_between_a_fixed_and_a_led_point():
    """Two links of length 1 from (0, 0) to (1, 1): the end may move as far as 2 from the other, and no farther."""

    def body(reach):
        amplitude = (reach - math.sqrt(2.0)) / math.sqrt(2.0)
        led = swarm.Oscillation((amplitude, amplitude, 0.0), 3.0)
        return square(links=[(0, 1), (1, 2)], anchors={0: None, 2: led})

    assert body(1.99).anchors[0] is None
    with pytest.raises(swarm.SceneError, match=r"anchors\[0\] and anchors\[2\].*reach.* 2 m.*2\.01"):
        body(2.01)


def test_what_is_not_linked_may_go_anywhere():
    square(links=[(0, 1)], anchors={0: None, 2: swarm.Oscillation((9.0, 0.0, 0.0), 1.0), 3: None})


# --- Errors ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        ({"mass": None}, ["one of mass and mass_matrix", "neither"]),
        ({"mass_matrix": np.eye(4)}, ["one of mass and mass_matrix", "both"]),
        ({"mass": [1.0, 2.0]}, ["mass", "shape (4,)", "(2,)"]),
        ({"mass": [1.0, 1.0, 0.0, 1.0]}, ["mass", "above 0", "got 0 for point 2"]),
        ({"mass": -1.0}, ["mass", "above 0", "-1"]),
        ({"mass": math.nan}, ["mass", "finite", "nan"]),
        ({"mass": None, "mass_matrix": np.eye(3)}, ["mass_matrix", "(4, 4)", "(3, 3)"]),
        ({"mass": None, "mass_matrix": np.full((4, 4), math.inf)}, ["mass_matrix", "finite", "[0, 0]"]),
        ({"mass": None, "mass_matrix": np.diag([1.0, 0.0, 1.0, 1.0])}, ["diagonal of mass_matrix", "point 1"]),
        ({"mass": None, "mass_matrix": np.eye(4) + np.eye(4, k=1)}, ["symmetric", "1 at [0, 1]", "0 at [1, 0]"]),
        ({"mass": None, "mass_matrix": np.ones((4, 4))}, ["positive definite", "singular", "no kinetic energy"]),
        (
            {"mass": None, "mass_matrix": np.eye(4) + 2.0 * (np.eye(4, k=3) + np.eye(4, k=-3))},
            ["positive definite", "negative eigenvalue"],
        ),
        ({"links": [(0, 1), (1, 0)]}, ["links[1]", "(1, 0)", "links[0]"]),
        ({"links": [(2, 2)]}, ["links[0]", "2 different points", "(2, 2)"]),
        ({"links": [(0, 4)]}, ["links[0][1]", "from 0 to 3", "got 4"]),
        ({"links": [(0, -1)]}, ["links[0][1]", "0 or more", "-1"]),
        ({"links": [(0, 0.5)]}, ["links[0][1]", "whole number", "0.5"]),
        ({"links": [(0, 1, 2)]}, ["links[0]", "2 numbers", "got 3"]),
        ({"links": [3]}, ["links[0]", "2 numbers", "got 3"]),
        ({"links": list(itertools.combinations(range(4), 2))}, ["links[5] (2, 3)", "where the points are", "plane"]),
        ({"springs": [(0, 1, 1.0)]}, ["springs[0]", "4 values", "got 3"]),
        ({"springs": [(1, 1, 1.0, 1.0)]}, ["springs[0]", "different"]),
        ({"springs": [(0, 9, 1.0, 1.0)]}, ["springs[0][1]", "9"]),
        ({"springs": [(0, 1, 0.0, 1.0)]}, ["springs[0][2]", "stiffness", "above 0"]),
        ({"springs": [(0, 1, 1.0, -1.0)]}, ["springs[0][3]", "rest length", "-1"]),
        ({"contacts": [0, 4]}, ["contacts[1]", "from 0 to 3"]),
        ({"contacts": [0, 1, 0]}, ["contacts[2]", "contacts[0]"]),
        ({"contacts": [0.25, 0.25, 0.25, 0.25]}, ["contacts[0]", "whole number"]),
        ({"contacts": [[1.0, 1.0]]}, ["contacts", "(K, 4)", "(1, 2)"]),
        ({"contacts": [[0.5, 0.5, 0.5, 0.0]]}, ["contacts[0]", "add up to 1", "1.5"]),
        ({"contacts": [[math.nan, 0.5, 0.5, 0.0]]}, ["contacts", "finite", "[0, 0]"]),
        ({"contacts": [1, 0], "anchors": {0: None}}, ["contacts[1]", "able to move"]),
        ({"strain": "stiff"}, ["strain", "swarm.Strain", "stiff"]),
        ({"strain": swarm.Strain([(0, 7)], [1.0], [[1.0]])}, ["strain.edges[0][1]", "from 0 to 3", "7"]),
        ({"anchors": [0]}, ["anchors", "mapping", "list"]),
        ({"anchors": {4: None}}, ["anchors", "from 0 to 3", "4"]),
        ({"anchors": {0: (1.0, 0.0, 0.0)}}, ["anchors[0]", "Translation, Oscillation or Rotation", "(1.0, 0.0, 0.0)"]),
        ({"anchors": dict.fromkeys(range(4))}, ["anchors", "can move", "all 4"]),
        ({"anchors": {0: None, 1: None}, "links": [(0, 1)]}, ["links[0]", "two that are anchored"]),
        (
            {"anchors": {0: None, 1: swarm.Translation((0.1, 0.0, 0.0))}, "links": [(0, 1)]},
            ["links[0]", "keep its length, 1 m", "both its points are led"],
        ),
        (
            {"anchors": {0: None, 1: swarm.Rotation((0.0, 0.0, 1.0), 1.0, (0.0, 0.0, 0.0))}, "links": [(0, 1)]},
            ["links[0]", "two that are anchored"],
        ),
        ({"guides": [(0, "floor")]}, ["guides[0][1]", "surface", "floor"]),
        ({"guides": [(0,)]}, ["guides[0]", "2 values"]),
        ({"guides": [(0, SPHERES)]}, ["guides[0][1]", "one surface", "field of 2", "one of them"]),
        ({"cavities": [(SPHERES, 0, 1)]}, ["cavities[0][0]", "one surface", "field of 2"]),
        ({"guides": [(1, swarm.Sphere(1.0, friction=0.1))]}, ["guides[0].friction", "must be 0", "0.1"]),
        ({"guides": [(1, swarm.Sphere(1.0, temperature=300.0))]}, ["guides[0][1].temperature", "None", "300"]),
        ({"cavities": [(swarm.Sphere(2.0, temperature=300.0), 0, 1)]}, ["cavities[0][0].temperature", "None", "300"]),
        ({"links": None}, ["links", "rows of 2 numbers of points", "None"]),
        ({"links": 5}, ["links", "rows of 2 numbers of points", "got 5"]),
        ({"faces": [(0, 1, 2), (1, 2)]}, ["faces[1]", "3 numbers of points", "got 2"]),
        ({"guides": [(0, swarm.Box((1.0, 1.0, 1.0)))]}, ["guides[0][1]", "without edges", "3 walls"]),
        ({"guides": [(0, swarm.Sphere(1.0))]}, ["guides[0]: point 0", "on its surface", "phi", "is -1"]),
        ({"guides": [(1, swarm.Sphere(1.0 + 1e-8))]}, ["guides[0]: point 1", "on its surface"]),
        ({"guides": [(1, FLOOR)], "anchors": {1: None}}, ["guides[0]", "can move", "anchored"]),
        ({"guides": [(1, FLOOR), (1, FLOOR)]}, ["guides[0] (point 1)", "guides[1] (point 1)", "1 follows"]),
        ({"cavities": [(swarm.Sphere(2.0), 0, 0)]}, ["cavities[0]", "another point"]),
        ({"cavities": [(swarm.Sphere(0.5), 0, 1)]}, ["cavities[0]: point 1", "admissible side", "0.5", "point 0"]),
        ({"cavities": [(swarm.Sphere(2.0, side="outside"), 0, 1)]}, ["cavities[0]: point 1", "admissible side"]),
        ({"cavities": [(None, 0, 1)]}, ["cavities[0][0]", "surface", "None"]),
        ({"faces": [(0, 1, 1)]}, ["faces[0]", "3 different points"]),
        ({"faces": [(0, 1, 4)]}, ["faces[0][2]", "from 0 to 3"]),
    ],
)
def test_errors_name_the_argument(options, parts):
    with pytest.raises(swarm.SceneError) as caught:
        square(**options)
    assert all(part in str(caught.value) for part in parts), str(caught.value)


@pytest.mark.parametrize(
    ("points", "parts"),
    [
        (np.zeros((0, 3)), ["points", "(P, 3)", "(0, 3)"]),
        (np.ones((3, 4)), ["points", "(P, 3)", "(3, 4)", "transpose"]),
        ([(0.0, 0.0, math.nan)], ["points", "finite", "nan", "[0, 2]"]),
        ([(0.0, 0.0, 1e200)], ["points", "1e+100", "1e+200"]),
        ("abc", ["points", "array of numbers"]),
    ],
)
def test_errors_name_the_points(points, parts):
    with pytest.raises(swarm.SceneError) as caught:
        swarm.Body(points, 1.0)
    assert all(part in str(caught.value) for part in parts), str(caught.value)


@pytest.mark.parametrize("apart", [0.0, 1e-14])
def test_a_link_and_a_spring_need_a_direction(apart):
    places = [(1.0, 2.0, 3.0), (1.0 + apart, 2.0, 3.0)]
    with pytest.raises(swarm.SceneError, match=r"links\[0\].*different places.*2\.0"):
        swarm.Body(places, 1.0, links=[(0, 1)])
    with pytest.raises(swarm.SceneError, match=r"springs\[0\].*different places"):
        swarm.Body(places, 1.0, springs=[(0, 1, 1.0, 0.5)])
    # A spring without length has the force 0 there.
    swarm.Body(places, 1.0, springs=[(0, 1, 1.0, 0.0)])


@pytest.mark.parametrize(
    ("build", "parts"),
    [
        (lambda: swarm.Strain([], [], np.zeros((0, 0))), ["strain.edges", "at least one"]),
        (lambda: swarm.Strain([(0, 1)], [1.0, 2.0], [[1.0]]), ["strain.rest", "(1,)", "(2,)"]),
        (lambda: swarm.Strain([(0, 1)], [0.0], [[1.0]]), ["strain.rest[0]", "above 0"]),
        (lambda: swarm.Strain([(0, 1)], [1.0], [1.0]), ["strain.stiffness", "(1, 1)", "(1,)"]),
        (lambda: swarm.Strain([(0, 1)], [1.0], [[-1.0]]), ["strain.stiffness", "negative eigenvalue", "edge 0"]),
        (lambda: swarm.Strain([(0, 1), (1, 2)], [1, 1], [[1, 0], [0, 0]]), ["strain.stiffness", "singular", "edge 1"]),
        (lambda: swarm.Strain([(0, 1), (1, 2)], [1, 1], np.ones((2, 2))), ["strain.stiffness", "singular", "a strain"]),
        (lambda: swarm.Strain([(0, 1), (1, 2)], [1, 1], np.zeros((2, 2))), ["strain.stiffness", "no elastic energy"]),
        (lambda: swarm.Strain([(0, 1), (1, 2)], [1, 1], [[1, 2], [0, 1]]), ["strain.stiffness", "symmetric"]),
        (lambda: swarm.Strain([(0, 1), (1, 0)], [1, 1], np.eye(2)), ["strain.edges[1]", "strain.edges[0]"]),
    ],
)
def test_errors_of_a_strain(build, parts):
    with pytest.raises(swarm.SceneError) as caught:
        build()
    assert all(part in str(caught.value) for part in parts), str(caught.value)
