"""Quadrics and slabs: against formulas by hand, exact roots with 50 digits, and each other."""

import math

import mpmath as mp
import numpy as np
import pytest
from conftest import EPSILON, call, chord_of, directions, scales, vectors, wall_point
from hypothesis import assume, currently_in_test_context, given, reject, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

import swarm
from swarm.kernel.vector import vec
from swarm.surfaces import contract, rotation
from swarm.surfaces.shapes.quadratic import QuadricNumbers

mp.mp.dps = 50

TURN = {"axis": (1.0, -2.0, 0.5), "angle": 0.9}
CENTER = np.array([0.2, -0.3, 0.1])


def quadric(diagonal, linear=(0.0, 0.0, 0.0), constant=0.0, side="inside", rotation=TURN):
    """At scale s lengths are s times as long and phi has the same values."""

    def make(s=1.0):
        matrix, vector = np.diag(diagonal) / s**2, np.array(linear) / s
        return swarm.Quadric(matrix, vector, constant, CENTER * s, side, rotation=rotation)

    return make


def both_sides(name, make):
    return {name: lambda s=1.0: make(s, "inside"), name + " solid": lambda s=1.0: make(s, "outside")}


# Smooth surfaces of one wall, some of them rotated.
SURFACES = {
    **both_sides("slab", lambda s, side: swarm.Slab((1.0, 2.0, -2.0), 0.4 * s, CENTER * s, side, rotation=TURN)),
    **both_sides("cylinder", lambda s, side: swarm.Cylinder(0.6 * s, (1.0, 0.5, 2.0), None, CENTER * s, side)),
    **both_sides("pipe", lambda s, side: swarm.Cylinder(0.6 * s, center=CENTER * s, side=side)),
    **both_sides("bowl", lambda s, side: swarm.Paraboloid(0.3 * s, (0.0, 1.0, -1.0), CENTER * s, side, rotation=TURN)),
    "one sheet": quadric((1.0, 2.0, -1.5), constant=-0.5),
    "one sheet solid": quadric((1.0, 2.0, -1.5), constant=-0.5, side="outside"),
    "two sheets": quadric((1.0, 2.0, -1.5), constant=0.5),
    "two sheets solid": quadric((1.0, 2.0, -1.5), constant=0.5, side="outside"),
    "nappes": quadric((1.0, 2.0, -1.5)),
    "saddle": quadric((1.0, -2.0, 0.0), (0.0, 0.0, -1.0)),
    "gutter": quadric((1.0, 0.0, 0.0), (0.0, 1.0, -1.0), 0.25, rotation=None),
    "shifted egg": quadric((1.0, 2.0, 3.0), (0.5, -0.3, 0.7), -0.5),
    "everted egg": quadric((-1.0, -2.0, -3.0), (0.5, -0.3, 0.7), 0.5, side="outside"),
    "long egg": quadric((1.0, 2.0, 1e-8), (0.5, -0.3, 0.7), -0.5),
    "wall": quadric((0.0, 0.0, 0.0), (1.0, -0.5, 0.25), 0.3),
}
every_one = pytest.mark.parametrize("name", SURFACES)


def wall_of(name, scale=1.0):
    """(numbers as the kernels take them, side)."""
    (wall,) = SURFACES[name](scale).walls()
    return wall, getattr(wall, "body", wall).side


def exact(*vectors):
    return np.array([mp.mpf(float(part)) for vector in vectors for part in vector], dtype=object)


def level_along(wall, position, velocity, pull=(0.0, 0.0, 0.0)):
    """The level along a flight as an exact polynomial of time."""
    axes = zip(exact(position), exact(velocity), exact(pull) / 2, strict=True)
    return contract.level_of(wall, contract.inner(wall, vec(Polynomial(np.array(axis)) for axis in axes)))


def noise(wall, position, path=0.0):
    """The round-off of the level near a path of this length: a few units in the last place of its largest terms."""
    body = getattr(wall, "body", wall)
    if isinstance(body, QuadricNumbers):
        most, linear, rest = max(map(abs, body.a)), math.hypot(*body.b), abs(body.level)
        far = math.hypot(*body.center)
    else:
        most, linear, rest, far = 1.0, 0.0, body.radius2, abs(body.offset)
    # Infinite without a warning, where a path as long as 1e242 is squared.
    far = float(far + np.linalg.norm(position) + path)
    return 32 * EPSILON * (most * far * far + linear * far + rest)


def highest(level, end):
    """The largest value on [0, end] of a polynomial of degree 2 or less, and of higher ones at 150 points."""
    c = [*level.coef, 0, 0][:3]
    stops = [mp.mpf(0), mp.mpf(end)]
    if len(level.coef) > 3:
        stops += [mp.mpf(end) * k / 150 for k in range(150)]
    elif c[2] != 0 and 0 < -c[1] / (2 * c[2]) < end:
        stops.append(-c[1] / (2 * c[2]))
    return max(level(stop) for stop in stops)


# --- The level set ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("surface", "point", "phi"),
    [
        (swarm.Slab((0, 0, 2), 0.5, (0, 0, 1)), (7.0, 8.0, 2.0), 0.5),
        (swarm.Slab((0, 0, 2), 0.5, (0, 0, 1), "outside"), (7.0, 8.0, 0.75), -0.25),
        (swarm.Cylinder(2.0, center=(1, 0, 0)), (1.0, 4.0, 99.0), 3.0),
        (swarm.Cylinder(2.0, axis=(3, 0, 0)), (9.0, 0.0, 1.0), -0.75),
        (swarm.Cylinder(2.0, length=4.0), (0.0, 0.0, 3.0), 1.0),
        (swarm.Paraboloid(0.25, center=(0, 0, 1)), (1.0, 1.0, 2.0), 1.0),
        (swarm.Paraboloid(0.25, axis=(0, -1, 0)), (0.0, -3.0, 0.0), -3.0),
        (swarm.Cone(math.pi / 4), (1.0, 0.0, 2.0), -1.5),
        (swarm.Cone(math.pi / 4, axis=(1, 0, 0)), (-2.0, 1.0, 0.0), 2.0),
        (swarm.Quadric(((1, 2, 0), (2, 0, 0), (0, 0, 0)), (0, 0, 3), 4.0, (1, 0, 0)), (2.0, 1.0, -1.0), 6.0),
        (swarm.Box((1.0, 2.0, 3.0)), (0.5, 0.0, 0.0), -0.5),
        (swarm.Box((1.0, 2.0, 3.0), rotation={"axis": (0, 0, 1), "angle": math.pi / 2}), (0.0, 1.5, 0.0), 0.5),
    ],
    ids=repr,
)
def test_phi_by_hand(surface, point, phi):
    assert surface.phi(np.array(point)[:, None]) == pytest.approx([phi], abs=4e-15)


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


@every_one
@given(point=vectors, scale=scales)
def test_gradient_is_the_slope_of_phi(name, point, scale):
    (wall, side), point = wall_of(name, scale), scale * point
    gradient = np.array(call(contract.gradient, wall, point))
    size = np.linalg.norm(gradient) * scale
    for axis, slope in enumerate(gradient):
        step = np.eye(3)[axis] * 1e-6 * scale
        rise = call(contract.phi, wall, point + step) - call(contract.phi, wall, point - step)
        assert rise / (2e-6 * scale) == pytest.approx(slope, abs=1e-6 * (size + 1.0) / scale)
    assert call(contract.unit_normal, wall, point) == pytest.approx(side * gradient * scale / size, abs=1e-14)


def same_as(name):
    """A quadric, and the surface it is."""
    matrix = lambda *diagonal: tuple(map(tuple, np.diag(diagonal).tolist()))  # noqa: E731
    return {
        "sphere": (swarm.Quadric(matrix(1, 1, 1), constant=-0.49), swarm.Sphere(0.7), 1.0),
        "shifted sphere": (
            swarm.Quadric(matrix(1, 1, 1), (-0.2, 0.4, 0), 0.05 - 0.49),
            swarm.Sphere(0.7, (0.1, -0.2, 0.0)),
            1.0,
        ),
        "ellipsoid": (
            swarm.Quadric(matrix(4, 1, 0.25), constant=-1, center=CENTER, rotation=TURN),
            swarm.Ellipsoid((0.5, 1.0, 2.0), CENTER, rotation=TURN),
            1.0,
        ),
        "cylinder": (
            swarm.Quadric(matrix(0, 1, 1), constant=-0.25, center=CENTER),
            swarm.Cylinder(0.5, axis=(1, 0, 0), center=CENTER),
            1.0,
        ),
        "slab": (swarm.Quadric(matrix(0, 1, 0), constant=-0.25), swarm.Slab((0, -1, 0), 0.5), 1.0),
        "plane": (swarm.Quadric(matrix(0, 0, 0), (0, 0, 1), -0.5), swarm.Plane((0, 0, 1), 0.5), 1.0),
    }[name]


@pytest.mark.parametrize("name", ["sphere", "shifted sphere", "ellipsoid", "cylinder", "slab", "plane"])
def test_the_same_surface_has_the_same_hits(name):
    general, own, _ = same_as(name)
    (one,), (other,) = general.walls(), own.walls()
    random = np.random.default_rng(3)
    seen = 0
    for _ in range(200):
        position, velocity, pull = random.normal(size=(3, 3)) * [[0.3], [1.0], [1.0]]
        if call(contract.gap_of, other, call(contract.inner, other, position)) > -1e-6:
            continue
        seen += 1
        time, found = call(contract.first_hit, one, position, velocity)
        assert found
        assert time == pytest.approx(call(contract.first_hit, other, position, velocity)[0], rel=1e-11)
        landed, there = call(contract.falling_hit, one, position, velocity, pull)
        expected, there_too = call(contract.falling_hit, other, position, velocity, pull)
        if there and there_too:
            assert landed == pytest.approx(expected, rel=1e-9)
    assert seen > 20
    assert general.size() == pytest.approx(own.size())
    for mine, its in zip(general.bounds(), own.bounds(), strict=True):
        assert all(a >= b - 1e-12 for a, b in zip(map(abs, its), map(abs, mine), strict=True))


# --- Flight ----------------------------------------------------------------------------------------------

depths = st.one_of(st.floats(1e-3, 0.3), st.sampled_from([0.0, 0.0, 1e-15, -1e-15, 1e-9, 1e-12]))
leans = st.one_of(st.floats(-1.0, 1.0), st.sampled_from([0.0, 1e-15, -1e-15, 1e-9, -1e-9, 1e-5, -1e-5, 1.0, -1.0]))
flights = {
    "point": directions,
    "direction": directions,
    "depth": depths,
    "lean": leans,
    "scale": scales,
    "speed": st.sampled_from([1e-6, 1.0, 1e6]),
}


def _assume(condition):
    assert condition or currently_in_test_context()
    if not condition:
        reject()


def start(name, point, direction, depth, lean, scale, speed):
    """A start this deep from the wall: position, and velocity with this part along the normal."""
    wall, _side = wall_of(name, scale)
    place = wall_point(wall, scale * point)
    _assume(np.isfinite(place).all() and abs(call(contract.distance, wall, place)) <= 1e-12 * scale)
    normal = np.array(call(contract.unit_normal, wall, place))
    along = direction - (direction @ normal) * normal
    along /= max(np.linalg.norm(along), 1e-3)
    position = place - depth * scale * normal
    # A thin place, or one behind the apex
    _assume(call(contract.level_of, wall, call(contract.inner, wall, position)) <= noise(wall, position))
    return wall, position, speed * scale * (lean * normal + math.sqrt(1.0 - lean * lean) * along)


@every_one
@settings(max_examples=100)
@given(**flights)
def test_first_hit_is_the_exact_first_root(name, point, direction, depth, lean, scale, speed):
    """Nothing outside before the hit, on the wall and on the way out at it; without a hit nothing ever."""
    wall, position, velocity = start(name, point, direction, depth, lean, scale, speed)
    time, found = call(contract.first_hit, wall, position, velocity)
    assert found
    assert time >= 0.0
    level, swift = level_along(wall, position, velocity), np.linalg.norm(velocity)
    start_level = max(level(mp.mpf(0)), 0)
    if time == math.inf:
        end = 1e3 * scale / swift
        assert highest(level, end) <= start_level + noise(wall, position, 1e3 * scale)
        return
    slack = noise(wall, position, time * swift) + start_level
    assert highest(level, time) <= slack
    if time > 0.0 or depth > 1e-9:
        assert abs(level(mp.mpf(float(time)))) <= slack
    # An ulp of a grazing double root may be past its turning point.
    slope, bend = level.deriv()(mp.mpf(float(time))), abs(level.deriv(2)(mp.mpf(0)))
    steep = slack / scale * swift + 16 * EPSILON * bend * mp.mpf(float(time))
    assert slope >= -4 * mp.sqrt(bend * slack) - steep


@every_one
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("depth", [1e-9, 1e-3, 0.05])
def test_head_on_the_hit_is_at_depth_over_speed(name, scale, depth):
    point, direction = np.array([0.3, 0.5, -0.4]), np.array([1.0, 0.0, 0.0])
    wall, position, velocity = start(name, point, direction, depth, 1.0, scale, 2.0)
    assert 2.0 * call(contract.first_hit, wall, position, velocity)[0] == pytest.approx(depth, rel=1e-11, abs=2e-15)


@every_one
@pytest.mark.parametrize("depth", [0.0, 2e-16, -2e-16])
def test_from_the_wall_the_direction_decides(name, depth):
    point, direction = np.array([0.3, 0.5, -0.4]), np.array([1.0, 0.0, 0.0])
    wall, position, velocity = start(name, point, direction, depth, 0.6, 1.0, 1.0)
    assert call(contract.first_hit, wall, position, velocity)[0] <= 2e-15
    assert call(contract.first_hit, wall, position, -velocity)[0] > 0.05


@every_one
@given(point=directions, depth=depths)
def test_at_rest_there_is_no_hit(name, point, depth):
    wall, position, _ = start(name, point, point, depth, 0.0, 1.0, 1.0)
    assert call(contract.first_hit, wall, position, np.zeros(3)) == (math.inf, True)
    time, _found = call(contract.falling_hit, wall, position, np.zeros(3), np.zeros(3))
    assert time == math.inf


@pytest.mark.parametrize("side", ["inside", "outside"])
@pytest.mark.parametrize("speed", [0.0, 1e-6, 1.0])
@pytest.mark.parametrize("pull", [0.0, -9.81])
def test_along_the_axis_of_a_cylinder_there_is_no_hit(side, speed, pull):
    (wall,) = swarm.Cylinder(0.5, side=side).walls()
    for x in (0.5, 0.3 if side == "inside" else 0.7):
        flight = np.array([x, 0.0, 0.0]), np.array([0.0, 0.0, speed])
        assert call(contract.first_hit, wall, *flight) == (math.inf, True)
        assert call(contract.falling_hit, wall, *flight, np.array([0.0, 0.0, pull])) == (math.inf, True)
        assert call(contract.safe_time, wall, *flight, np.array([0.0, 0.0, pull])) == math.inf


def test_flights_of_lower_degree():
    """Along the axis of a bowl, along a generator of a cone: no square is left."""
    (bowl,) = swarm.Paraboloid(0.25).walls()
    down = np.array([0.0, 0.0, -2.0])
    assert call(contract.first_hit, bowl, np.array([0.5, 0.0, 1.0]), down) == (0.375, True)
    assert call(contract.first_hit, bowl, np.array([0.5, 0.0, 1.0]), -down) == (math.inf, True)
    time, found = call(contract.falling_hit, bowl, np.array([0.5, 0.0, 1.0]), 0.0 * down, down)
    assert (time, found) == (pytest.approx(0.75**0.5, rel=1e-15), True)
    nappes = swarm.Quadric(((1, 0, 0), (0, 1, 0), (0, 0, -1))).walls()[0]
    assert call(contract.first_hit, nappes, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 1.0])) == (math.inf, True)
    assert call(contract.first_hit, nappes, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, -1.0])) == (0.5, True)
    # A ray within the cone's own angle never leaves.
    assert call(contract.first_hit, nappes, np.array([0.0, 0.0, 1.0]), np.array([0.1, 0.2, 1.0])) == (math.inf, True)


def test_a_slab_is_met_on_the_side_ahead():
    between, plate = (swarm.Slab((0, 0, 1), 0.5, side=side).numbers() for side in ("inside", "outside"))
    up, on = np.array([0.3, 0.0, 2.0]), np.array([0.0, 0.0, 0.5])
    assert call(contract.first_hit, between, 0.5 * on, up) == (0.125, True)
    assert call(contract.first_hit, between, 0.5 * on, -up) == (0.375, True)
    assert call(contract.first_hit, between, on, up)[0] == 0.0
    assert call(contract.first_hit, between, on, -up)[0] == 0.5
    assert call(contract.first_hit, between, (1 + 1e-15) * on, up)[0] == 0.0
    assert call(contract.first_hit, between, on, np.array([1.0, 1.0, 0.0]))[0] == math.inf
    assert call(contract.first_hit, plate, 2.0 * on, -up)[0] == 0.25
    assert call(contract.first_hit, plate, 2.0 * on, up)[0] == math.inf
    assert call(contract.first_hit, plate, on, up)[0] == math.inf
    assert call(contract.first_hit, plate, on, -up)[0] == 0.0
    assert call(contract.first_hit, plate, (1 - 1e-15) * on, -up)[0] == 0.0
    assert call(contract.first_hit, plate, -2.0 * on, up)[0] == 0.25


@every_one
@given(**flights, pull=vectors, heavy=st.sampled_from([1e-6, 1.0, 1e3]))
def test_a_fall_is_safe_until_its_hit(name, point, direction, depth, lean, scale, speed, pull, heavy):
    """Neither the safe time nor the fall's hit is ever past the exit."""
    wall, position, velocity = start(name, point, direction, depth, lean, scale, speed)
    pull = heavy * speed * speed * scale * pull
    level = level_along(wall, position, velocity, pull)
    outside = max(level(mp.mpf(0)), 0)
    crossing = scale / (np.linalg.norm(velocity) + math.sqrt(np.linalg.norm(pull) * scale))
    for time, found in (
        call(contract.falling_hit, wall, position, velocity, pull),
        (call(contract.safe_time, wall, position, velocity, pull), False),
    ):
        assert time >= 0.0
        end = min(time, 1e3 * crossing)
        path = (np.linalg.norm(velocity) + 0.5 * np.linalg.norm(pull) * end) * end
        slack = noise(wall, position, path)
        assert highest(level, end) <= outside + slack
        if found and time < math.inf and (time > 0.0 or depth > 1e-9):
            # Found by the size of the last step: near a double root that is half the digits.
            near = level.deriv()(mp.mpf(float(time))) * 1e-7 * mp.mpf(float(time)) + slack
            assert level(mp.mpf(float(time))) >= -abs(near) - 1e-6 * abs(level(mp.mpf(0))) - 1e-12 * abs(
                slack / EPSILON
            )
    if depth >= 1e-3:
        assert time > 0.0


@every_one
@settings(max_examples=15)
@given(point=directions, direction=directions, pull=directions, lean=st.floats(0.3, 1.0), scale=scales)
def test_falls_end_at_the_exit(name, point, direction, pull, lean, scale):
    """The same as the exact root of the quartic, after a few passes."""
    wall, position, velocity = start(name, point, direction, 0.1, lean, scale, 1.0)
    pull = pull * scale
    level = level_along(wall, position, velocity, pull)
    coefficients = list(level.coef[::-1])
    while coefficients and abs(coefficients[0]) <= mp.mpf(10) ** -30 * max(map(abs, coefficients)):
        coefficients.pop(0)
    roots = mp.polyroots(coefficients, maxsteps=500, extraprec=300) if len(coefficients) > 1 else []
    exits = sorted(mp.re(root) for root in roots if abs(mp.im(root)) < mp.mpf(10) ** -20 and mp.re(root) > 0)
    time, passes, found = 0.0, 0, False
    while not found and passes < 40 and time < 1e3:
        now = position + velocity * time + 0.5 * pull * time * time
        later, found = call(contract.falling_hit, wall, now, velocity + pull * time, pull)
        time, passes = time + later, passes + 1
    if exits and exits[0] < 1e3 and abs(level.deriv()(exits[0])) > 0.01:
        assert time == pytest.approx(float(exits[0]), rel=1e-7)
        assert passes <= 12
    elif not exits:
        assert time >= 1e3 or passes == 40


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
        assert call(contract.phi, wall, there) == pytest.approx(call(contract.phi, plain, position), abs=2e-15)
        expected = call(contract.first_hit, plain, position, velocity)
        assert call(contract.first_hit, wall, there, matrix @ velocity) == pytest.approx(expected, rel=1e-11, abs=1e-14)


# --- Contact ---------------------------------------------------------------------------------------------


@every_one
@given(first=directions, second=directions, scale=scales)
def test_inner_gradient_is_a_discrete_gradient(name, first, second, scale):
    (wall, _side), first, second = wall_of(name, scale), scale * first, scale * second
    discrete = exact(call(contract.inner_gradient, wall, first, second))
    rise = contract.inner(wall, vec(exact(second))) - contract.inner(wall, vec(exact(first)))
    assert abs(discrete @ (exact(second) - exact(first)) - rise) <= 2 * noise(wall, first, 2 * scale)


@every_one
@given(point=directions, scale=scales)
def test_chain_rule_of_gap_and_inner(name, point, scale):
    """g[q, q] grad q = grad g"""
    (wall, side), point = wall_of(name, scale), scale * point
    q = call(contract.inner, wall, point)
    assume(q != 0.0)
    slope, _ = call(contract.gap_slope, wall, q, q)
    gradient = side * np.array(call(contract.gradient, wall, point))
    chained = slope * np.array(call(contract.inner_gradient, wall, point, point))
    assert chained == pytest.approx(gradient, abs=64 * EPSILON * (np.linalg.norm(gradient) + 1 / scale))


@every_one
@given(point=directions, free=vectors, strength=st.floats(-1.0, 1.0), scale=scales)
def test_push_solves_its_equation_and_rise_is_its_rise(name, point, free, strength, scale):
    wall, _side = wall_of(name, scale)
    point, free = scale * point, 0.5 * scale * free
    # Up to a fifth of the size in units in which the curvatures are about 1
    unit = 1.0 if name.startswith("slab") else scale * scale
    unit = scale if name.startswith(("cylinder", "pipe", "bowl")) else unit
    kappa = 0.1 * strength * unit
    end = np.array(call(contract.push, wall, point, free, kappa))
    discrete = np.array(call(contract.inner_gradient, wall, point, end))
    assert end == pytest.approx(point + free - kappa * discrete, abs=64 * EPSILON * scale)
    rise, slope = call(contract.rise, wall, point, free, kappa)
    terms = abs(discrete) @ abs(free) + abs(kappa) * discrete @ discrete
    tilted = 64 * EPSILON * scale * np.abs(discrete).max()
    assert abs(rise - discrete @ (free - kappa * discrete)) <= 32 * EPSILON * terms + tilted
    risen = call(contract.inner, wall, end) - call(contract.inner, wall, point)
    assert rise == pytest.approx(risen, abs=2 * noise(wall, point, 2 * scale))
    step = 1e-5 * unit
    change = (
        call(contract.rise, wall, point, free, kappa + step)[0]
        - call(contract.rise, wall, point, free, kappa - step)[0]
    )
    assert change / (2.0 * step) == pytest.approx(
        slope, rel=1e-6, abs=1e-6 * (discrete @ discrete + scale**2 / unit**2)
    )


@every_one
@given(point=directions, scale=scales, strength=st.floats(0.0, 0.1))
def test_resolve_solves_its_equation(name, point, scale, strength):
    wall, side = wall_of(name, scale)
    unit = 1.0 if name.startswith("slab") else scale * scale
    unit = scale if name.startswith(("cylinder", "pipe", "bowl")) else unit
    strength, point = side * strength * unit, scale * point
    solved = np.array(call(contract.resolve, wall, point, strength))
    slope = np.array(call(contract.inner_gradient, wall, solved, solved))
    assert solved + strength * slope == pytest.approx(point, abs=64 * EPSILON * scale)


@every_one
def test_the_farthest_push_is_before_the_first_pole(name):
    """1 + kappa A > 0 up to it."""
    wall, side = wall_of(name)
    farthest = call(contract.farthest_push, wall)
    assert farthest * side > 0.0
    body = getattr(wall, "body", wall)
    curvatures = list(body.a) if isinstance(body, QuadricNumbers) else [1.0]
    poles = [-1.0 / a for a in curvatures if a * side < 0.0]
    assert farthest == (pytest.approx(side * min(map(abs, poles))) if poles else side * math.inf)


@every_one
@given(point=directions, scale=scales, off=st.floats(-1e-7, 1e-7))
def test_settle_moves_a_near_point_onto_the_surface(name, point, scale, off):
    wall, on, _ = start(name, point, point, 0.0, 0.0, scale, 1.0)
    slope = np.linalg.norm(call(contract.inner_gradient, wall, on, on))
    assume(slope * scale > 1e-3 * noise(wall, on) / EPSILON)  # not next to an apex
    near = on + off * scale * np.array(call(contract.unit_normal, wall, on))
    settled = np.array(call(contract.settle, wall, near))
    assert abs(call(contract.distance, wall, settled)) <= noise(wall, near) / slope + 1e3 * off**2 * scale


@every_one
@given(point=directions, direction=directions, length=st.floats(1e-9, 0.3), scale=scales)
def test_chord_normal_reflects_along_a_chord(name, point, direction, length, scale):
    """From the wall a step with the mean of the old and the reflected velocity ends on the wall; |v| is kept."""
    wall, on, _ = start(name, point, point, 0.0, 0.0, scale, 1.0)
    slope = np.linalg.norm(call(contract.inner_gradient, wall, on, on))
    assume(slope * scale > 0.1 * noise(wall, on) / (32 * EPSILON))
    size = min(SURFACES[name](scale).size(), scale)
    free = length * size * direction / np.linalg.norm(direction)
    normal = np.array(call(contract.chord_normal, wall, on, free, chord_of(wall, on, free)))
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=8 * EPSILON)
    reflected = free - 2.0 * (free @ normal) * normal
    assert np.linalg.norm(reflected) == pytest.approx(np.linalg.norm(free), rel=8 * EPSILON)
    first, last = (
        call(contract.level_of, wall, call(contract.inner, wall, p)) for p in (on, on + 0.5 * (free + reflected))
    )
    assert abs(last) <= abs(first) + 16 * noise(wall, on, scale)
    still = call(contract.chord_normal, wall, on, np.zeros(3), 0.0)
    assert still == pytest.approx(call(contract.unit_normal, wall, on), abs=16 * EPSILON)


def test_the_apex_of_a_cone_has_no_normal_and_no_nan():
    nappes = swarm.Quadric(((1, 0, 0), (0, 1, 0), (0, 0, -1)), center=(1, 2, 3)).walls()[0]
    apex = np.array([1.0, 2.0, 3.0])
    for answer in (
        call(contract.unit_normal, nappes, apex),
        call(contract.distance, nappes, apex),
        np.array(call(contract.settle, nappes, apex)) - apex,
    ):
        assert np.all(np.array(answer) == 0.0)
    for velocity in (np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])):
        for pull in (np.zeros(3), np.array([0.0, 0.0, -1.0])):
            time, _found = call(contract.falling_hit, nappes, apex, velocity, pull)
            assert time >= 0.0


# --- Descriptions ----------------------------------------------------------------------------------------


@every_one
def test_bounds_hold_the_admissible_side(name):
    points = np.random.default_rng(2).uniform(-2.0, 2.0, (3, 4000))
    surface, (_wall, side) = SURFACES[name](), wall_of(name)
    low, high = (np.array(corner)[:, None] for corner in surface.bounds())
    admissible = points[:, side * surface.phi(points) <= 0.0]
    assert admissible.shape[1] > 10
    assert ((admissible >= low) & (admissible <= high)).all()
    assert np.isfinite(high - low).all() == (name in {"shifted egg", "everted egg", "long egg"})
    assert np.isfinite(surface.size()) == (name not in {"nappes", "wall"})
    assert np.isfinite(surface.extent())


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


ONE = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


@pytest.mark.parametrize(
    ("build", "parts"),
    [
        (
            lambda: swarm.Quadric(((1, 2, 0), (3, 1, 0), (0, 0, 1))),
            ["matrix must be symmetric", "matrix[0][1] = 2", "matrix[1][0] = 3"],
        ),
        (lambda: swarm.Quadric(((1, 0, 0), (0, 1, 0))), ["matrix", "three rows"]),
        (lambda: swarm.Quadric(1.0), ["matrix", "three rows", "1.0"]),
        (lambda: swarm.Quadric(((1, 0, 0), (0, math.nan, 0), (0, 0, 1))), ["matrix[1][1]", "finite", "nan"]),
        (lambda: swarm.Quadric(np.zeros((3, 3))), ["matrix", "all 0", "vector"]),
        (lambda: swarm.Quadric(ONE, vector=(0, math.inf, 0)), ["vector[1]", "finite"]),
        (lambda: swarm.Quadric(ONE, constant="x"), ["constant", "finite number"]),
        (lambda: swarm.Quadric(ONE, constant=1.0), ["constant", "same sign", "got 1"]),
        (lambda: swarm.Quadric(np.diag([1, 0, 0])), ["constant", "same sign", "got 0"]),
        (lambda: swarm.Quadric(ONE, constant=-1, side="in"), ["side", "did you mean 'inside'?"]),
        (lambda: swarm.Slab((0, 0, 0), 1.0), ["normal", "length 0"]),
        (lambda: swarm.Slab((0, 0, 1), -1.0), ["half_width", "above 0", "got -1"]),
        (lambda: swarm.Cylinder(0.0), ["radius", "above 0", "got 0"]),
        (lambda: swarm.Cylinder(1.0, length=0.0), ["length", "above 0", "got 0"]),
        (lambda: swarm.Cylinder(1.0, axis=(0, 0, 0)), ["axis", "length 0"]),
        (lambda: swarm.Cone(0.0), ["half_angle", "between 0 and pi/2", "got 0"]),
        (lambda: swarm.Cone(math.pi / 2), ["half_angle", "between 0 and pi/2", "got 1.5708"]),
        (lambda: swarm.Paraboloid(-0.5), ["focal_length", "above 0", "got -0.5"]),
    ],
)
def test_errors_name_the_argument(build, parts):
    with pytest.raises(swarm.SceneError) as caught:
        build()
    assert all(part in str(caught.value) for part in parts), str(caught.value)
