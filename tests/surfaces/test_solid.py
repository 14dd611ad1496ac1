"""Solid bodies with edges, against the exact times at which a flight enters the last of their parts."""

import math

import numpy as np
import pytest
from conftest import EPSILON, TURN, call, wall_point
from exact import TOUCH, Flight
from walls import falling, hit_of, straight

import swarm
from swarm.kernel.vector import vec
from swarm.surfaces.shapes.solid import body

AXES = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
CORNERS = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]


def half_spaces(normals, distance, scale):
    """Planes as parts: the body is on the side of the origin, up to this distance."""
    return [swarm.Plane(tuple(-part for part in normal), -distance * scale).walls()[0] for normal in normals]


def ball(radius, center, scale, **turn):
    return swarm.Sphere(radius * scale, tuple(scale * part for part in center), "outside", **turn).walls()[0]


BODIES = {
    "cube": lambda s=1.0: half_spaces(AXES, 0.5, s),
    "tetrahedron": lambda s=1.0: half_spaces(CORNERS, 0.4, s),
    "wedge": lambda s=1.0: half_spaces([(1, 0, 0.2), (-1, 0.1, 0.3)], 0.3, s),
    "dome": lambda s=1.0: [ball(0.8, (0.1, 0, 0), s), *half_spaces([(0, 0, -1), (1, 1, 0)], 0.3, s)],
    "lens": lambda s=1.0: [ball(1.0, (0.7, 0, 0), s), ball(1.0, (-0.7, 0.1, 0), s)],
    "cut egg": lambda s=1.0: [
        swarm.Ellipsoid((0.4 * s, 0.6 * s, 0.9 * s), (0.1 * s, 0, 0), "outside", rotation=TURN).walls()[0],
        *half_spaces([(0, 1, 1)], 0.2, s),
    ],
}
SCALES = [1e-6, 1.0, 1e6]
every_body = pytest.mark.parametrize("name", BODIES)


def check(parts, position, velocity, pull, size):
    """The time of the hit, or infinity if it hits nothing up to a horizon."""
    horizon = 10.0 * (size + np.linalg.norm(position)) / np.linalg.norm(velocity)
    if any(pull):
        horizon = min(horizon, math.sqrt(20.0 * size / np.linalg.norm(pull)))
    return hit_of(falling if any(pull) else straight, body(parts), position, velocity, pull, horizon, 200)[0]


def near_an_edge(parts, rng, count):
    """A point on this many of the parts at once."""
    point = rng.uniform(-0.5, 0.5, 3)
    chosen = [parts[i] for i in rng.permutation(len(parts))[:count]]
    size = abs(call(chosen[0].gradient, point)[0]) and 1.0
    for _ in range(50):
        rows = np.array([call(part.gradient, point) for part in chosen])
        point = point - size * np.linalg.pinv(rows) @ [call(part.phi, point) for part in chosen]
    return point


def random_turn(rng):
    direction = rng.normal(size=3)
    return direction / np.linalg.norm(direction)


# --- The level set ---------------------------------------------------------------------------------------


@every_body
@pytest.mark.parametrize("scale", SCALES)
def test_phi_is_negative_inside_of_all_parts(name, scale):
    parts, rng = BODIES[name](scale), np.random.default_rng(1)
    solid, points = body(parts), scale * rng.uniform(-1.0, 1.0, (3, 300))
    phi, gradient = solid.phi(vec(points)), np.array(solid.gradient(vec(points)))
    gaps = np.array([[call(part.gap_of, call(part.inner, point)) for part in parts] for point in points.T])
    assert phi == pytest.approx(-gaps.min(axis=1), rel=1e-14, abs=1e-15 * scale)
    for k in range(0, 300, 20):
        assert call(solid.phi, points[:, k]) == phi[k]
        step = 1e-7 * scale
        rise = [
            call(solid.phi, points[:, k] + step * axis) - call(solid.phi, points[:, k] - step * axis)
            for axis in np.eye(3)
        ]
        assert gradient[:, k] == pytest.approx(np.array(rise) / (2.0 * step), abs=1e-5 * np.linalg.norm(gradient[:, k]))


@every_body
@pytest.mark.parametrize("scale", SCALES)
def test_the_normal_points_into_the_body(name, scale):
    parts, rng = BODIES[name](), np.random.default_rng(2)
    parts = BODIES[name](scale)
    solid = body(parts)
    for _ in range(50):
        point = wall_point(solid, scale * 0.5 * random_turn(rng))
        normal = np.array(call(solid.unit_normal, point))
        assert np.linalg.norm(normal) == pytest.approx(1.0, abs=8 * EPSILON)
        assert call(solid.phi, point - 1e-6 * scale * normal) > 0.0


# --- Flight ----------------------------------------------------------------------------------------------


@every_body
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("heavy", [0.0, 1e-3, 1.0])
def test_random_flights(name, scale, heavy):
    rng, parts = np.random.default_rng(3), BODIES[name](scale)
    hits = 0
    for _ in range(6):
        position = 2.5 * scale * random_turn(rng)
        aim = scale * rng.uniform(-0.7, 0.7, 3)
        velocity = (aim - position) * rng.uniform(0.1, 10.0)
        pull = heavy * (velocity @ velocity) / scale * random_turn(rng)
        velocity = velocity - 0.5 * pull * (np.linalg.norm(aim - position) / np.linalg.norm(velocity))
        hits += check(parts, position, velocity, pull, scale) < math.inf
    assert hits > 0


@every_body
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("off", [0.0, 1e-15, 1e-12, 1e-6])
def test_flights_aimed_at_edges_and_corners(name, scale, off):
    """Two or three parts entered in the same instant are a hit, whichever rounds later."""
    rng, unit_parts, parts = np.random.default_rng(4), BODIES[name](1.0), BODIES[name](scale)
    for _ in range(4):
        count = min(len(parts), int(rng.integers(2, 4)))
        aim = near_an_edge(unit_parts, rng, count)
        position = 2.0 * random_turn(rng) + aim
        aim = aim + off * random_turn(rng)
        velocity = (aim - position) * rng.uniform(0.1, 10.0)
        for pull in (np.zeros(3), 0.1 * (velocity @ velocity) * random_turn(rng)):
            # The parabola that passes through the aim at that time
            thrown = velocity - 0.5 * pull / (np.linalg.norm(velocity) / np.linalg.norm(aim - position))
            check(parts, scale * position, scale * thrown, scale * pull, scale)


@every_body
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("lean", [0.5, 1e-3, 1e-7])
def test_from_a_face_the_direction_decides(name, scale, lean):
    """Inward: now. Outward from a convex body: never, and under gravity not immediately."""
    rng, parts = np.random.default_rng(5), BODIES[name](scale)
    solid = body(parts)
    for _ in range(40):
        point = wall_point(solid, scale * random_turn(rng))
        normal = np.array(call(solid.unit_normal, point))
        along = np.cross(normal, random_turn(rng))
        velocity = lean * normal + along
        gaps = sorted(call(part.distance, point) for part in parts)
        if gaps[1] < 1e-3 * scale:
            continue  # next to an edge
        time, found = call(solid.first_hit, point, velocity)
        assert found
        assert time * np.linalg.norm(velocity) <= 1e-14 * scale / lean
        away = along - lean * normal
        assert call(solid.first_hit, point, away) == (math.inf, True)
        pull = 0.1 / scale * normal
        time, found = call(solid.falling_hit, point, away, pull)
        assert time > 0.1 * min(1.0, lean) * scale
        time, found = call(solid.falling_hit, point, np.zeros(3), pull)
        assert found
        assert time <= 1e-6 * scale


def test_a_flight_in_the_plane_of_a_face_never_tunnels():
    """Exactly in the face it may count as a hit or a miss; a little inside of it, it is a hit."""
    for offset in (0.0, 1e-15, -1e-15, 1e-9):
        for scale in SCALES:
            solid = body(BODIES["cube"](scale))
            position, velocity = scale * np.array([-2.0, 0.5 - offset, 0.1]), np.array([scale, 0.0, 0.0])
            time, found = call(solid.first_hit, position, velocity)
            assert found
            assert time == math.inf or time == pytest.approx(1.5, rel=1e-15)
            if offset == 1e-9:
                assert time < math.inf


@every_body
def test_reflections_stay_outside(name):
    """Between the body and a sphere around it, hundreds of impacts: never inside by more than round-off."""
    parts, rng = BODIES[name](), np.random.default_rng(6)
    solid, around = body(parts), swarm.Sphere(3.0).numbers()
    position, velocity = np.array([2.0, 1.0, 1.5]), random_turn(rng)
    deepest, hits = 0.0, 0
    for _ in range(600):
        time, found = call(solid.first_hit, position, velocity)
        wall, _found = call(around.first_hit, position, velocity)
        assert found
        struck = solid if time < wall else around
        position = position + min(time, wall) * velocity
        normal = np.array(call(struck.unit_normal, position))
        velocity = velocity - 2.0 * (velocity @ normal) * normal
        velocity /= np.linalg.norm(velocity)
        if struck is around:
            # A new direction, so that the flights do not repeat; a third of them aimed at an edge.
            aim = near_an_edge(parts, rng, 2) if rng.random() < 0.33 else rng.uniform(-0.6, 0.6, 3)
            velocity = (aim - position) / np.linalg.norm(aim - position)
        hits += struck is solid
        deepest = max(deepest, call(solid.distance, position))
    assert hits > 50
    assert deepest <= 1e-14


@every_body
@pytest.mark.parametrize("heavy", [0.0, 1.0])
def test_safe_time_is_never_past_the_entry(name, heavy):
    rng, parts = np.random.default_rng(7), BODIES[name]()
    solid = body(parts)
    for _ in range(40):
        position, velocity = rng.uniform(-1.0, 1.0, 3), random_turn(rng)
        pull = heavy * random_turn(rng)
        time = call(solid.safe_time, position, velocity, pull)
        if call(solid.phi, position) <= 0.0:
            assert time == 0.0
            continue
        assert time > 0.0
        assert Flight([solid], position, velocity, pull).highest(min(time, 100.0)) <= TOUCH


# --- Contact ---------------------------------------------------------------------------------------------


@every_body
def test_contact_functions_next_to_a_face(name):
    """The discrete gradient, the push and its rise, and the settled point of the smooth defaults."""
    rng, parts = np.random.default_rng(8), BODIES[name]()
    solid = body(parts)
    for _ in range(30):
        start = wall_point(solid, random_turn(rng))
        free = 0.01 * random_turn(rng)
        if free @ np.array(call(solid.unit_normal, start)) < 0.0:
            free = -free
        end = start + free
        discrete = np.array(call(solid.discrete_gradient, start, end))
        assert discrete @ free == pytest.approx(call(solid.phi, end) - call(solid.phi, start), abs=1e-15)
        if sorted(call(part.distance, start) for part in parts)[1] < 0.1:
            continue  # a step across an edge has a D that jumps
        kappa = -0.01
        pushed = np.array(call(solid.push, start, free, kappa))
        discrete = np.array(call(solid.discrete_gradient, start, pushed))
        assert pushed == pytest.approx(start + free - kappa * discrete, abs=1e-15)
        rise, slope = call(solid.rise, start, free, kappa)
        assert rise == pytest.approx(call(solid.phi, pushed) - call(solid.phi, start), abs=1e-15)
        assert slope < 0.0
        near = start + 1e-8 * random_turn(rng)
        assert abs(call(solid.phi, np.array(call(solid.project, near)))) <= 1e-14
