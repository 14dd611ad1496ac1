"""Quadrics and slabs: against formulas by hand and each other."""

import math

import numpy as np
import pytest
from conftest import EPSILON, TURN, body_of, call, directions, every_quadric_wall, numbers_of, scales, side_of
from hypothesis import given
from hypothesis import strategies as st

import swarm
from swarm.surfaces import rotation
from swarm.surfaces.shapes.quadratic import QuadricNumbers

# --- The level set ---------------------------------------------------------------------------------------


@given(seed=st.integers(0, 10_000), scale=scales)
def test_phi_of_a_quadric_is_its_formula(seed, scale):
    """Whatever the eigenvalues: the principal frame changes nothing."""
    random = np.random.default_rng(seed)
    a, b, center = random.normal(size=(3, 3)), random.normal(size=3), random.normal(size=3)
    a, c = a + a.T, random.normal()
    turn = random.normal(size=4)
    points = random.normal(size=(3, 20)) + center[:, None]
    surface = swarm.Quadric(a / scale**2, b / scale, c, center * scale, rotation=turn)
    d = rotation.matrix(surface.rotation).T @ (points - center[:, None])
    by_hand = np.einsum("ik,ij,jk->k", d, a, d) + b @ d + c
    # Where a square is completed its centre may be a thousand times as far.
    assert surface.phi(points * scale) == pytest.approx(by_hand, abs=1e-10)
    gradient = rotation.matrix(surface.rotation) @ (2.0 * a @ d + b[:, None])
    assert surface.gradient(points * scale) * scale == pytest.approx(gradient, abs=1e-10)


CENTER = (0.2, -0.3, 0.1)
# Quadrics, and the surfaces that they are.
SAME = {
    "sphere": (swarm.Quadric(np.diag([1, 1, 1]), constant=-0.49), swarm.Sphere(0.7)),
    "shifted sphere": (
        swarm.Quadric(np.diag([1, 1, 1]), (-0.2, 0.4, 0), 0.05 - 0.49),
        swarm.Sphere(0.7, (0.1, -0.2, 0.0)),
    ),
    "ellipsoid": (
        swarm.Quadric(np.diag([4, 1, 0.25]), constant=-1, center=CENTER, rotation=TURN),
        swarm.Ellipsoid((0.5, 1.0, 2.0), CENTER, rotation=TURN),
    ),
    "cylinder": (
        swarm.Quadric(np.diag([0, 1, 1]), constant=-0.25, center=CENTER),
        swarm.Cylinder(0.5, axis=(1, 0, 0), center=CENTER),
    ),
    "slab": (swarm.Quadric(np.diag([0, 1, 0]), constant=-0.25), swarm.Slab((0, -1, 0), 0.5)),
    "plane": (swarm.Quadric(np.diag([0, 0, 0]), (0, 0, 1), -0.5), swarm.Plane((0, 0, 1), 0.5)),
}


@pytest.mark.parametrize("name", SAME)
def test_the_same_surface_has_the_same_hits(name):
    general, own = SAME[name]
    (one,), (other,) = general.walls(), own.walls()
    random = np.random.default_rng(3)
    seen = 0
    for _ in range(200):
        position, velocity, pull = random.normal(size=(3, 3)) * [[0.3], [1.0], [1.0]]
        if call(other.gap_of, call(other.inner, position)) > -1e-6:
            continue
        seen += 1
        time, found = call(one.first_hit, position, velocity)
        assert found
        assert time == pytest.approx(call(other.first_hit, position, velocity)[0], rel=1e-11)
        landed, there = call(one.falling_hit, position, velocity, pull)
        expected, there_too = call(other.falling_hit, position, velocity, pull)
        if there and there_too:
            assert landed == pytest.approx(expected, rel=1e-9)
    assert seen > 20
    assert general.size() == pytest.approx(own.size())
    for mine, its in zip(general.bounds(), own.bounds(), strict=True):
        assert all(a >= b - 1e-12 for a, b in zip(map(abs, its), map(abs, mine), strict=True))


# --- Flight ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", ["inside", "outside"])
@pytest.mark.parametrize("speed", [0.0, 1e-6, 1.0])
@pytest.mark.parametrize("pull", [0.0, -9.81])
def test_along_the_axis_of_a_cylinder_there_is_no_hit(side, speed, pull):
    (wall,) = swarm.Cylinder(0.5, side=side).walls()
    for x in (0.5, 0.3 if side == "inside" else 0.7):
        flight = np.array([x, 0.0, 0.0]), np.array([0.0, 0.0, speed])
        assert call(wall.first_hit, *flight) == (math.inf, True)
        assert call(wall.falling_hit, *flight, np.array([0.0, 0.0, pull])) == (math.inf, True)
        assert call(wall.safe_time, *flight, np.array([0.0, 0.0, pull])) == math.inf


def test_flights_of_lower_degree():
    """Along the axis of a bowl, along a generator of a cone: no square is left."""
    (bowl,) = swarm.Paraboloid(0.25).walls()
    down = np.array([0.0, 0.0, -2.0])
    assert call(bowl.first_hit, np.array([0.5, 0.0, 1.0]), down) == (0.375, True)
    assert call(bowl.first_hit, np.array([0.5, 0.0, 1.0]), -down) == (math.inf, True)
    time, found = call(bowl.falling_hit, np.array([0.5, 0.0, 1.0]), 0.0 * down, down)
    assert (time, found) == (pytest.approx(0.75**0.5, rel=1e-15), True)
    nappes = swarm.Quadric(((1, 0, 0), (0, 1, 0), (0, 0, -1))).walls()[0]
    assert call(nappes.first_hit, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 1.0])) == (math.inf, True)
    assert call(nappes.first_hit, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, -1.0])) == (0.5, True)
    # A ray within the cone's own angle never leaves.
    assert call(nappes.first_hit, np.array([0.0, 0.0, 1.0]), np.array([0.1, 0.2, 1.0])) == (math.inf, True)


def test_a_slab_is_met_on_the_side_ahead():
    between, plate = (swarm.Slab((0, 0, 1), 0.5, side=side).numbers() for side in ("inside", "outside"))
    up, on = np.array([0.3, 0.0, 2.0]), np.array([0.0, 0.0, 0.5])
    assert call(between.first_hit, 0.5 * on, up) == (0.125, True)
    assert call(between.first_hit, 0.5 * on, -up) == (0.375, True)
    assert call(between.first_hit, on, up)[0] == 0.0
    assert call(between.first_hit, on, -up)[0] == 0.5
    assert call(between.first_hit, (1 + 1e-15) * on, up)[0] == 0.0
    assert call(between.first_hit, on, np.array([1.0, 1.0, 0.0]))[0] == math.inf
    assert call(plate.first_hit, 2.0 * on, -up)[0] == 0.25
    assert call(plate.first_hit, 2.0 * on, up)[0] == math.inf
    assert call(plate.first_hit, on, up)[0] == math.inf
    assert call(plate.first_hit, on, -up)[0] == 0.0
    assert call(plate.first_hit, (1 - 1e-15) * on, -up)[0] == 0.0
    assert call(plate.first_hit, -2.0 * on, up)[0] == 0.25


@pytest.mark.parametrize("name", ["cylinder", "bowl", "one sheet", "shifted egg", "slab"])
def test_a_rotated_surface_is_a_rotated_flight(name):
    make = {
        "cylinder": lambda turn: swarm.Cylinder(0.6, (0, 1, 0), rotation=turn),
        "bowl": lambda turn: swarm.Paraboloid(0.3, (0, 1, 1), (0.0, -0.2, -0.2), rotation=turn),
        "one sheet": lambda turn: swarm.Quadric(np.diag([1, 2, -1]), constant=-0.5, rotation=turn),
        "shifted egg": lambda turn: swarm.Quadric(np.diag([1, 2, 3]), (0.2, 0, 0.1), -0.5, rotation=turn),
        "slab": lambda turn: swarm.Slab((1, 2, 3), 0.5, rotation=turn),
    }[name]
    turned = make(TURN)
    matrix = rotation.matrix(turned.rotation)
    (plain,), (wall,) = make(None).walls(), turned.walls()
    center = np.array(turned.center)
    random = np.random.default_rng(5)
    for _ in range(50):
        position, velocity = 0.2 * random.normal(size=3), random.normal(size=3)
        there = center + matrix @ (position - center)
        assert call(wall.phi, there) == pytest.approx(call(plain.phi, position), abs=2e-15)
        expected = call(plain.first_hit, position, velocity)
        assert call(wall.first_hit, there, matrix @ velocity) == pytest.approx(expected, rel=1e-11, abs=1e-14)


# --- Contact ---------------------------------------------------------------------------------------------


@every_quadric_wall
@given(point=directions, scale=scales, strength=st.floats(0.0, 0.1))
def test_resolve_solves_its_equation(name, point, scale, strength):
    wall, side = numbers_of(name, scale), side_of(numbers_of(name, scale))
    unit = 1.0 if name.startswith("slab") else scale * scale
    unit = scale if name.startswith(("cylinder", "pipe", "bowl")) else unit
    strength, point = side * strength * unit, scale * point
    solved = np.array(call(wall.resolve, point, strength))
    slope = np.array(call(wall.discrete_gradient, solved, solved))
    assert solved + strength * slope == pytest.approx(point, abs=64 * EPSILON * scale)


@every_quadric_wall
def test_the_farthest_push_is_before_the_first_pole(name):
    """1 + kappa A > 0 up to it."""
    wall, side = numbers_of(name), side_of(numbers_of(name))
    farthest = call(wall.farthest_push)
    assert farthest * side > 0.0
    body = body_of(wall)
    curvatures = list(body.a) if isinstance(body, QuadricNumbers) else [1.0]
    poles = [-1.0 / a for a in curvatures if a * side < 0.0]
    assert farthest == (pytest.approx(side * min(map(abs, poles))) if poles else side * math.inf)


def test_the_apex_of_a_cone_has_no_normal_and_no_nan():
    nappes = swarm.Quadric(((1, 0, 0), (0, 1, 0), (0, 0, -1)), center=(1, 2, 3)).walls()[0]
    apex = np.array([1.0, 2.0, 3.0])
    for answer in (
        call(nappes.unit_normal, apex),
        call(nappes.distance, apex),
        np.array(call(nappes.project, apex)) - apex,
    ):
        assert np.all(np.array(answer) == 0.0)
    for velocity in (np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])):
        for pull in (np.zeros(3), np.array([0.0, 0.0, -1.0])):
            time, _found = call(nappes.falling_hit, apex, velocity, pull)
            assert time >= 0.0


# --- Descriptions ----------------------------------------------------------------------------------------


def test_bounds_are_tight_where_an_axis_is_one_of_the_scene():
    low, high = swarm.Cylinder(0.5, axis=(1, 0, 0), center=(0, 1, 2)).bounds()
    assert (low, high) == ((-math.inf, 0.5, 1.5), (math.inf, 1.5, 2.5))
    low, high = swarm.Cylinder(0.5, axis=(1, 0, 1), length=2.0).bounds()
    assert high == pytest.approx((0.5**0.5 + 0.5 * 0.5**0.5, 0.5, 1.5 * 0.5**0.5))
    assert swarm.Slab((0, 0, -1), 0.25, (1, 1, 1)).bounds()[1] == (math.inf, math.inf, 1.25)
    assert swarm.Quadric(np.diag([0, 1, 4]), constant=-1).bounds()[1] == (math.inf, 1.0, 0.5)
    assert swarm.Cone(0.3, axis=(0, 1, 0)).bounds() == ((-math.inf, 0.0, -math.inf), (math.inf,) * 3)
    assert swarm.Quadric(np.diag([1, 1, 1]), (-2, 0, 0), 0.75).bounds() == ((0.5, -0.5, -0.5), (1.5, 0.5, 0.5))


def test_sizes():
    assert swarm.Paraboloid(0.25).size() == 0.5
    assert swarm.Quadric(np.diag([1, 1, 0]), (0, 0, -1)).size() == 0.5
    assert swarm.Quadric(np.diag([1, 4, 0.25]), constant=-1).size() == 0.5
    assert swarm.Quadric(np.diag([1, 1, -1])).size() == math.inf
    assert swarm.Cylinder(0.5, length=0.5).size() == 0.25


def test_a_matrix_is_symmetric_up_to_round_off():
    turn = rotation.matrix(rotation.quaternion("rotation", (1, 2, 3, 4)))
    oblique = swarm.Quadric(turn @ np.diag([1.0, 2.0, 0.0]) @ turn.T, constant=-1.0)
    assert oblique.numbers().b == (0.0, 0.0, 0.0)
    assert sorted(abs(part) > 1e-9 for part in oblique.numbers().a) == [False, True, True]
    assert 0.0 in oblique.numbers().a
