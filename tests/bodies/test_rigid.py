"""Rigid bodies: mass, centre and inertia against closed forms, and what they refuse."""

import itertools
import math
import sys

import numpy as np
import pytest

import swarm

CUBE = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
# An L: two boxes, not convex.
OUTLINE = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]
TURN = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
TURN *= np.linalg.det(TURN)


def moments(body):
    """Mass, centre, and second moment of mass about it, of the base points."""
    masses = np.diagonal(body.mass_matrix)
    center = masses @ body.points / masses.sum()
    arms = body.points - center
    return masses.sum(), center, np.einsum("p,px,py->xy", masses, arms, arms)


def inertia(body):
    """The tensor of inertia, from the second moment."""
    second = moments(body)[2]
    return np.trace(second) * np.eye(3) - second


def extruded(outline, height):
    """An oriented mesh of a prism whose outline is seen whole from its first corner."""
    n = len(outline)
    corners = [(x, y, z) for z in (0.0, height) for x, y in outline]
    top = [(n, n + k, n + k + 1) for k in range(1, n - 1)]
    bottom = [(0, k + 1, k) for k in range(1, n - 1)]
    walls = [face for a, b in ((k, (k + 1) % n) for k in range(n)) for face in ((a, b, b + n), (a, b + n, a + n))]
    return np.array(corners), [*top, *bottom, *walls]


@pytest.mark.parametrize("lengths", [(1.0, 1.0, 1.0), (0.3, 1.0, 2.5), (1e-3, 1.0, 1.0), (1e-30, 2e-30, 3e-30)])
def test_inertia_of_a_box(lengths):
    """m (a^2 + b^2)/12 about its axes, wherever it is and however it is turned."""
    lengths, place = np.array(lengths), np.array([3.0, -1.0, 2.0]) * max(lengths)
    body = swarm.rigid((CUBE - 0.5) * lengths @ TURN.T + place, density=7.0)
    mass, center, _second = moments(body)
    assert mass == pytest.approx(7.0 * lengths.prod(), rel=1e-12)
    assert center == pytest.approx(place, rel=1e-13)
    squares = lengths**2
    expected = TURN @ np.diag(mass * (squares.sum() - squares) / 12.0) @ TURN.T
    assert inertia(body) == pytest.approx(expected, rel=1e-11, abs=1e-12 * expected.max())


def test_inertia_of_a_regular_tetrahedron():
    """m a^2/20 about every axis; about its base points, as mass points, it is m a^2/4."""
    points = swarm.tetrahedron(edge=2.0, mass=8.0)
    assert inertia(points) == pytest.approx(8.0 * 4.0 / 4.0 * np.eye(3), abs=1e-14)
    solid = swarm.rigid(points.points, density=3.0)
    mass = moments(solid)[0]
    assert mass == pytest.approx(3.0 * 2.0**3 / (6.0 * math.sqrt(2.0)), rel=1e-14)
    assert inertia(solid) == pytest.approx(mass * 4.0 / 20.0 * np.eye(3), abs=1e-14)


def test_a_mesh_may_have_dents():
    """An extruded L is two boxes: mass, centre and second moments are those of the boxes together."""
    corners, faces = extruded(OUTLINE, 0.5)
    body = swarm.rigid(corners, 2.0, faces)
    boxes = [(np.array(middle), np.array(lengths)) for middle, lengths in
             [((1.0, 0.5, 0.25), (2.0, 1.0, 0.5)), ((0.5, 1.5, 0.25), (1.0, 1.0, 0.5))]]  # fmt: skip
    masses = [2.0 * lengths.prod() for _middle, lengths in boxes]
    mass, center, second = moments(body)
    assert mass == pytest.approx(sum(masses), rel=1e-14)
    middle = sum(m * at for m, (at, _lengths) in zip(masses, boxes, strict=True)) / mass
    assert center == pytest.approx(middle, rel=1e-14)
    expected = sum(
        m * (np.diag(lengths**2) / 12.0 + np.outer(at - middle, at - middle))
        for m, (at, lengths) in zip(masses, boxes, strict=True)
    )
    assert second == pytest.approx(expected, abs=1e-14)
    assert body.faces.tolist() == [list(face) for face in faces]
    # Its hull is heavier.
    assert moments(swarm.rigid(corners, 2.0))[0] == pytest.approx(2.0 * 0.5 * 3.5, rel=1e-14)


def test_vertices_are_the_contact_points_in_their_order():
    vertices = np.random.default_rng(3).standard_normal((40, 3)) + 5.0
    body = swarm.rigid(vertices, density=1.0)
    assert len(body) == 4
    assert len(body.links) == 6
    assert body.contacts.sum(axis=1) == pytest.approx(1.0, abs=1e-14)
    assert body.contacts @ body.points == pytest.approx(vertices, rel=1e-13)


@pytest.mark.parametrize("body", [swarm.tetrahedron(1.0, 1.0), swarm.rigid(CUBE, 1.0)], ids=["tetrahedron", "cube"])
def test_faces_look_outwards(body):
    corners = body.contacts @ body.points
    a, b, c = corners[body.faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    assert (((a + b + c) / 3.0 - corners.mean(axis=0)) * normals).sum(axis=1).min() > 0.0
    assert normals.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-14)


def test_chain_and_dumbbell():
    body = swarm.chain(5, length=2.0, mass=10.0)
    mass, center, second = moments(body)
    assert mass == 10.0
    assert center == pytest.approx(np.zeros(3), abs=1e-15)
    assert np.diff(body.points[:, 0]) == pytest.approx(0.5, rel=1e-15)
    # Five points of 2 kg at 0, +-1/2, +-1.
    assert second[0, 0] == pytest.approx(5.0, rel=1e-15)
    pair = swarm.dumbbell(length=2.0, mass=3.0)
    assert inertia(pair).diagonal().tolist() == [0.0, 3.0, 3.0]
    assert pair.links.tolist() == [[0, 1]]
    assert (swarm.tetrahedron(0.7, 1.0).links == list(itertools.combinations(range(4), 2))).all()
    lengths = np.linalg.norm(np.diff(swarm.tetrahedron(0.7, 1.0).points[[(0, 1), (1, 2), (2, 3)]], axis=1), axis=2)
    assert lengths == pytest.approx(0.7, rel=1e-15)


HULL = swarm.rigid(CUBE, 1.0).faces.tolist()


@pytest.mark.parametrize(
    ("build", "parts"),
    [
        (lambda: swarm.rigid(CUBE[:3], 1.0), ["vertices", "3", "plane"]),
        (lambda: swarm.rigid(CUBE[:4], 1.0), ["vertices", "4", "plane"]),
        (lambda: swarm.rigid(CUBE * [1.0, 1.0, 1e-6], 1.0), ["vertices", "plane"]),
        (lambda: swarm.rigid(CUBE * 0.0, 1.0), ["vertices", "plane"]),
        (lambda: swarm.rigid(CUBE * [1.0, 1.0, 0.0], 1.0, HULL), ["vertices", "plane"]),
        (lambda: swarm.rigid(CUBE.T, 1.0), ["vertices", "(3, 8)", "transpose"]),
        (lambda: swarm.rigid([*CUBE, CUBE[3]], 1.0), ["contacts[8]", "contacts[3]"]),
        (lambda: swarm.rigid(CUBE, -1.0), ["density", "above 0", "-1"]),
        (lambda: swarm.rigid(CUBE, 1.0, HULL[1:]), ["faces", "closed", "without a neighbour"]),
        (lambda: swarm.rigid(CUBE, 1.0, [HULL[0][::-1], *HULL[1:]]), ["faces", "oriented alike", "faces[0]"]),
        (lambda: swarm.rigid(CUBE, 1.0, [face[::-1] for face in HULL]), ["faces", "anticlockwise", "-1 m^3"]),
        (lambda: swarm.rigid([*CUBE, (9.0, 9.0, 9.0)], 1.0, HULL), ["vertices[8]", "no face uses"]),
        (lambda: swarm.rigid(CUBE, 1.0, [(0, 1, 8)]), ["faces[0][2]", "from 0 to 7"]),
        (lambda: swarm.rigid(CUBE, 1.0, []), ["faces", "got none"]),
        (lambda: swarm.chain(1, 1.0, 1.0), ["n must", "2 or more"]),
        (lambda: swarm.chain(3, 0.0, 1.0), ["length", "above 0"]),
        (lambda: swarm.dumbbell(1.0, 0.0), ["mass", "above 0"]),
        (lambda: swarm.tetrahedron(-1.0, 1.0), ["edge", "above 0"]),
    ],
)
def test_errors_name_the_argument(build, parts):
    with pytest.raises(swarm.SceneError) as caught:
        build()
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_without_scipy_an_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy.spatial", None)
    with pytest.raises(swarm.SceneError, match=r"without faces needs the package 'scipy.*pip install scipy"):
        swarm.rigid(CUBE, 1.0)
    assert len(swarm.rigid(CUBE, 1.0, HULL).faces) == 12
