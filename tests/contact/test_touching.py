"""The projection of a velocity on what touched walls allow, and the sliding step that it makes."""

import itertools

import numpy as np
import pytest
from conftest import EPSILON, SURFACES, call, wall_point

import swarm
from swarm.contact import projection, touching
from swarm.kernel.vector import vec
from swarm.surfaces.walls import all_walls

# Normals: in any direction, in nearly the same one, or nearly in one of two opposite ones, as in a cusp.
SPREADS = ["any", *itertools.product(("same", "opposite"), (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8))]
every_spread = pytest.mark.parametrize("spread", SPREADS, ids=str)


def cases(spread, number=60):
    """(normals (n, 3), w) of 1 to 6 walls."""
    random = np.random.default_rng(1)
    for case in range(number):
        n = 1 + case % 6
        normals = random.standard_normal((n, 3))
        if spread != "any":
            way, width = spread
            sign = random.choice([-1.0, 1.0], n) if way == "opposite" else np.ones(n)
            normals = sign[:, None] * (random.standard_normal(3) + width * normals)
        yield normals / np.linalg.norm(normals, axis=1)[:, None], random.standard_normal(3)


def projected(normals, w):
    """u, and what each wall takes."""
    held = np.zeros(len(normals))
    touched = np.ones(len(normals), bool)
    return np.array(projection.project(touched, normals.T, held, vec(w))), held


def nearest(normals, w):
    """The nearest allowed vector among the projections on all faces, edges and the corner of the cone."""
    found = [np.zeros(3)]
    for number in range(3):
        for face in itertools.combinations(range(len(normals)), number):
            a = normals[list(face)]
            u = w - np.linalg.pinv(a) @ (a @ w) if number else w
            if (normals @ u <= 1e-10).all():
                found.append(u)
    return min(found, key=lambda u: np.linalg.norm(w - u))


@every_spread
def test_no_touched_wall_forbids_the_projection(spread):
    for normals, w in cases(spread):
        u, held = projected(normals, w)
        size = np.linalg.norm(w)
        assert (normals @ u).max() <= 64 * EPSILON * size
        assert (held >= 0.0).all()
        # Orthogonal (Moreau): 2u - w is as long as w.
        assert abs(u @ (w - u)) <= 8 * EPSILON * size**2


@pytest.mark.parametrize("spread", [s for s in SPREADS if s == "any" or s[1] >= 1e-4], ids=str)
def test_it_is_the_nearest(spread):
    """Against all faces; walls nearer to parallel than this defeat the comparison, not the projection."""
    for normals, w in cases(spread):
        u, held = projected(normals, w)
        assert u == pytest.approx(nearest(normals, w), abs=1e-8)
        # The walls take w - u, all of it; opposite walls wedge, and take much more each.
        assert np.linalg.norm(w - u - normals.T @ held) <= 64 * EPSILON * (np.linalg.norm(w) + held.sum())


@pytest.mark.parametrize("angle", [1.0, 1e-1, 1e-2, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11])
def test_an_edge_lets_pass_what_runs_along_it(angle):
    """A wedge of any angle takes what goes into it, and nothing of the rest."""
    random = np.random.default_rng(2)
    for _ in range(20):
        frame, _ = np.linalg.qr(random.standard_normal((3, 3)))
        along, out, up = frame.T
        normals = np.array([-up, np.cos(angle) * up - np.sin(angle) * out])
        u, held = projected(normals, 0.6 * along - 0.8 * out)
        assert u == pytest.approx(0.6 * along, abs=1e-14 + 4 * EPSILON / angle)
        assert (held > 0.0).all()


@pytest.mark.parametrize("name", SURFACES)
def test_a_sliding_step_keeps_the_energy(name):
    """|2P - w| = |w| to round-off for a step of any length, on one wall and in its edge with a plane."""
    random = np.random.default_rng(3)
    for h in (1e-8, 1e-4, 1e-2, 0.3, 3.0):
        for count in (1, 2):
            surface = SURFACES[name]()
            point = wall_point(surface.walls()[0], random.uniform(-0.5, 0.5, 3))
            normal = random.standard_normal(3)
            plane = swarm.Plane(normal, float(normal @ point) / float(np.linalg.norm(normal)))
            walls = all_walls([surface, plane][:count])
            w = random.standard_normal(3)
            number, none = np.arange(count, dtype=float), np.zeros(count)
            touch = projection.Touch(number, np.ones(count, bool), np.zeros((3, count)), none.copy(), none, None)
            u = np.array(call(projection.velocity_along, walls, touch, point, w, h))
            assert np.linalg.norm(2.0 * u - w) == pytest.approx(np.linalg.norm(w), rel=16 * EPSILON)
            assert (touch.active >= 0.0).all()


@pytest.mark.parametrize("moves", [False, True])
def test_a_step_among_walls_that_move_ends_on_one_that_has_come_nearer(moves):
    """The straight way of a step meets none that gains on the particle by its acceleration alone."""
    near, r = 5e-12, vec([2e-11, 0.1, 0.0])
    walls = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0)), swarm.Plane((1.0, 0.0, 0.0))]).compiled().walls().at(0.0)
    number, touched, depth = walls.numbers_near(r), np.array([True, False]), np.zeros(2)
    frame = vec([0.0, 0.0, 0.0]) if moves else None
    touch = projection.Touch(number, touched, np.zeros((3, 2)), np.ones(2), depth, frame)
    end = touching._settled(walls, 0.0, touch, r, near)
    assert tuple(end) == (0.0 if moves else 2e-11, 0.1, 0.0)
