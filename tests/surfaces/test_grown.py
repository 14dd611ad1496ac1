"""Walls that the centres of balls meet: as far as the radius from the wall, whatever it is."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from conftest import call

import swarm
from swarm.kernel.vector import Vec
from swarm.surfaces.balls.facet import triangles_of_balls

TURN = (0.8, 0.1, -0.5, 0.3)
# One line a shape: what it is, and how far from the origin balls are looked at.
SHAPES = {
    "sphere": (swarm.Sphere(1.0, (0.1, 0.2, 0.3)), 1.0),
    "ball": (swarm.Sphere(0.4, (0.1, 0.0, 0.0), "outside"), 1.0),
    "plane": (swarm.Plane((1.0, 2.0, 3.0), 0.4), 1.0),
    "slab": (swarm.Slab((1.0, 1.0, 0.0), 0.5), 1.0),
    "plate": (swarm.Slab((0.0, 0.0, 1.0), 0.2, side="outside"), 1.0),
    "box": (swarm.Box((0.5, 0.6, 0.7), rotation=TURN), 0.8),
    "brick": (swarm.Box((0.5, 0.3, 0.4), (0.1, 0.0, 0.0), "outside", rotation=TURN), 1.0),
    "upright brick": (swarm.Box((0.5, 0.3, 0.4), (0.1, 0.0, 0.2), "outside"), 1.0),
    "tube": (swarm.Cylinder(0.6, (1.0, 1.0, 1.0)), 0.8),
    "tube along x": (swarm.Cylinder(0.6, (1.0, 0.0, 0.0), center=(0.0, 0.1, 0.2)), 0.8),
    "wire": (swarm.Cylinder(0.3, (1.0, 1.0, 1.0), center=(0.1, 0.0, 0.0), side="outside"), 1.0),
    "can": (swarm.Cylinder(0.6, (1.0, 2.0, 0.0), length=1.4), 0.7),
    "drum": (swarm.Cylinder(0.4, (1.0, 2.0, 0.5), length=0.6, side="outside"), 1.0),
    "capsule": (swarm.Capsule(0.5, 0.8, (1.0, 2.0, 0.0)), 0.8),
    "rod": (swarm.Capsule(0.3, 0.8, (1.0, 2.0, 0.0), side="outside"), 1.0),
    "torus": (swarm.Torus(1.0, 0.4, rotation=TURN), 1.3),
    "ring": (swarm.Torus(0.8, 0.2, side="outside", rotation=TURN), 1.3),
    "cone": (swarm.Cone(0.7, (1.0, 0.0, 2.0), (0.0, 0.0, -0.5)), 1.0),
    "cone along x": (swarm.Cone(0.7, (-1.0, 0.0, 0.0), (0.5, 0.0, 0.0)), 1.0),
    "spike": (swarm.Cone(0.5, (1.0, 0.0, 2.0), side="outside"), 1.0),
    "flat spike": (swarm.Cone(1.2, (0.0, 0.0, -1.0), side="outside"), 1.0),
}
L_SHAPE = [(-0.8, -0.8), (0.8, -0.8), (0.8, 0.0), (0.0, 0.0), (0.0, 0.8), (-0.8, 0.8)]
BENT = [(-0.8, -0.8, 0.4), (0.8, -0.8, -0.5), (0.8, 0.8, 1.0), (-0.8, 0.8)]
CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) @ np.diag([1.0, 0.8, 0.6])
FACES = [
    (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
    (1, 5, 7), (1, 7, 3),
]  # fmt: skip


class Numbers(NamedTuple):
    """Of a user-defined surface."""

    size: float


def wavy(p, x, y, z):
    """A ball with waves."""
    return x * x + y * y + z * z + 0.05 * math.sin(3.0 * x) - p.size * p.size


def wavy_slope(p, x, y, z):
    return 2.0 * x + 0.15 * math.cos(3.0 * x), 2.0 * y, 2.0 * z


SHAPES |= {
    "egg": (swarm.Ellipsoid((0.9, 0.7, 0.8), (0.1, 0.0, 0.0), rotation=TURN), 0.9),
    "orbit": (swarm.Ellipsoid((0.7, 0.7, 0.8)), 0.8),
    "stone": (swarm.Ellipsoid((0.6, 0.2, 0.4), side="outside", rotation=TURN), 1.0),
    "pebble": (swarm.Ellipsoid((0.5, 0.5, 0.3), (0.1, 0.0, 0.0), "outside"), 1.0),
    "table": (swarm.Polygon(L_SHAPE), 0.8),
    "pillar": (swarm.Polygon(L_SHAPE, axis=(1.0, 2.0, 0.5), side="outside"), 1.5),
    "bent table": (swarm.Polygon(BENT), 1.0),
    "bent pillar": (swarm.Polygon(BENT, side="outside"), 1.5),
    "stadium": (swarm.Stadium(0.5, 0.8), 0.8),
    "prism": (swarm.Prism(L_SHAPE, 1.0, axis=(0.0, 1.0, 0.3)), 0.8),
    "mesh": (swarm.Mesh(2.0 * CUBE, FACES, rotation=TURN), 1.0),
    "lump": (swarm.Mesh(CUBE, FACES, side="outside", rotation=TURN), 1.0),
}
SHAPES |= {
    "quadric": (swarm.Quadric(((1.5, 0.2, 0.0), (0.2, 2.0, 0.3), (0.0, 0.3, 3.0)), constant=-1.0, rotation=TURN), 0.9),
    "waist": (swarm.Quadric(((1.0, 0.0, 0.0), (0.0, 1.5, 0.0), (0.0, 0.0, -0.5)), constant=-0.3), 1.0),
    "around a waist": (
        swarm.Quadric(((1.0, 0.0, 0.0), (0.0, 1.5, 0.0), (0.0, 0.0, -0.5)), (0.0, 0.1, 0.0), -0.2, side="outside"),
        1.2,
    ),
    "bowl": (swarm.Paraboloid(0.4, (1.0, 0.0, 2.0), (0.0, 0.0, -0.5)), 0.8),
    "dome": (swarm.Paraboloid(0.2, (1.0, 0.0, 2.0), side="outside"), 1.0),
    "formula": (swarm.Formula("x**4 + y**4/0.5 + z**2/0.6 + 0.3*x*y - 0.6", rotation=TURN), 0.9),
    "pear": (
        swarm.Formula("(x**2 + y**2)*(1 + 0.4*z) + z**2 - 0.16", bounds=((-0.6,) * 3, (0.6,) * 3), side="outside"),
        1.0,
    ),
    "own": (swarm.OwnSurface(Numbers(0.7), wavy, wavy_slope, size=0.7, bounds=((-1.0,) * 3, (1.0,) * 3)), 0.8),
}
every_shape = pytest.mark.parametrize("name", SHAPES)


def walls_of(surface, radius):
    """The walls that the centre of a ball meets, in the arithmetic of kernels."""
    found = []
    for wall in surface.walls_of_balls(2.0):
        several = [wall] if not hasattr(wall, "grid") else [wall.wall(float(m)) for m in range(int(wall.count()))]
        found += [call(one.grown, radius) for one in map(_as_floats, several)]
    return found


def _as_floats(one):
    if isinstance(one, tuple):
        parts = map(_as_floats, one)
        return tuple(parts) if type(one) is tuple else type(one)(*parts)
    return np.float64(one) if isinstance(one, float) else one


def gap_of(surface, points):
    """The gap of a surface at points (3, N): above 0 where they are outside of it."""
    return (-1.0 if surface.is_solid() else 1.0) * surface.phi(points)


def outermost(walls, r):
    """The wall that a ball is farthest outside of, and how far."""
    depths = [call(wall.distance, r) for wall in walls]
    k = int(np.argmax(depths))
    return walls[k], depths[k]


def places(name, number, least=0.02):
    """Centres of balls that a shape admits, and radii that fit: from touching down to a tenth of that."""
    surface, reach = SHAPES[name]
    rng = np.random.default_rng(sum(map(ord, name)))
    found = []
    while len(found) < number:
        r = rng.uniform(-reach, reach, 3)
        room = -float(surface.reaching_outside(r[:, None], np.zeros(1))[0])
        # Where it is larger than that it touches at several points at once.
        if gap_of(surface, r[:, None])[0] < 0.0 and least < room < surface.largest_ball():
            found.append((r, room, room * rng.choice([0.999, 0.9, 0.5, 0.1])))
    return found


@every_shape
def test_a_ball_touches_where_the_nearest_point_of_the_wall_is(name):
    """So far ahead along the normal is the wall, nowhere nearer, and none of that depends on the radius."""
    surface, rng = SHAPES[name][0], np.random.default_rng(3)
    # The distance from a mesh takes long in plain Python.
    many, few = (3000, 300) if not isinstance(surface, swarm.Mesh) else (100, 30)
    around = rng.normal(size=(3, many))
    around /= np.sqrt((around**2).sum(axis=0))
    for r, room, radius in places(name, 40):
        assert outermost(walls_of(surface, radius), r)[1] == pytest.approx(radius - room, abs=1e-14)
        wall, depth = outermost(walls_of(surface, room), r)
        assert abs(depth) <= 1e-14
        normal = np.array(call(wall.unit_normal, r))
        assert math.hypot(*normal) == pytest.approx(1.0, abs=1e-14)
        foot = r + room * normal
        steep = max(math.hypot(*surface.gradient(foot)), 1e-3)
        assert abs(surface.phi(foot)) <= 1e-13 * (1.0 + steep)
        close = normal[:, None] + rng.normal(size=(3, few)) * rng.choice([1e-3, 0.03, 0.3], few)
        close /= np.sqrt((close**2).sum(axis=0))
        for directions in (around, close):
            assert gap_of(surface, r[:, None] + (1.0 - 1e-9) * room * directions).max() <= 1e-12


@every_shape
@pytest.mark.parametrize("heavy", [0.0, 2.0], ids=["straight", "falling"])
def test_a_flight_ends_where_the_ball_touches_first(name, heavy):
    """It ends on a wall, and never comes outside before; steps as long as the distance come to the same instant."""
    surface, rng = SHAPES[name][0], np.random.default_rng(5)
    hits = 0
    for r, _room, radius in places(name, 15):
        walls, v, pull = walls_of(surface, radius), rng.normal(size=3), heavy * rng.normal(size=3)
        time, wall = first_hit(walls, r, v, pull, 20.0)
        assert by_distances(walls, r, v, pull, min(time, 20.0)) >= min(time, 20.0) - 1e-4
        if wall is None:
            continue
        hits += 1
        at, w = r + time * v + 0.5 * time * time * pull, v + time * pull
        assert abs(outermost(walls, at)[1]) <= 1e-13 * (1.0 + abs(at).max())
        assert np.array(call(wall.unit_normal, at)) @ w >= -1e-12
    assert hits > 0


def first_hit(walls, r, v, pull, until):
    """When a flight meets a wall, and which, or None."""
    total = 0.0
    for _ask in range(200):
        asked = [
            (*(call(w.falling_hit, r, v, pull) if pull.any() else call(w.first_hit, r, v)), k)
            for k, w in enumerate(walls)
        ]
        time, found, k = min(asked, key=lambda one: one[0])
        if not total + time < until:
            return math.inf, None
        r, v, total = r + time * v + 0.5 * time * time * pull, v + time * pull, total + time
        if found:
            return total, walls[k]
    raise AssertionError("not found")


def by_distances(walls, r, v, pull, until):
    """The same by steps that are as long as the ball is away from all walls, to a small distance."""
    t, weight = 0.0, math.hypot(*pull)
    while t < until:
        at, w = r + t * v + 0.5 * t * t * pull, v + t * pull
        away = -outermost(walls, at)[1]
        if away < 1e-6:
            return t
        speed = math.hypot(*w)
        t += 2.0 * away / (speed + math.sqrt(speed * speed + 2.0 * weight * away))
    return until


@every_shape
def test_a_step_has_a_discrete_gradient(name):
    """D.(r1 - r0) = q1 - q0 of any two places near the wall, and its divided difference is that of the gap."""
    surface, rng = SHAPES[name][0], np.random.default_rng(7)
    for r, room, _radius in places(name, 20):
        for wall in walls_of(surface, 0.9 * room):
            near = r + room * 0.2 * rng.normal(size=3)
            d = np.array(call(wall.discrete_gradient, r, near))
            q0, q1 = call(wall.inner, r), call(wall.inner, near)
            assert d @ (near - r) == pytest.approx(q1 - q0, abs=1e-14)
            slope = call(wall.gap_slope, q0, q1)[0]
            assert slope * (q1 - q0) == pytest.approx(call(wall.gap_of, q1) - call(wall.gap_of, q0), abs=1e-14)


@every_shape
def test_what_safe_times_and_distances_promise(name):
    """Until the safe time no ball touches; `far` is no more than the distance."""
    surface, rng = SHAPES[name][0], np.random.default_rng(9)
    for r, _room, radius in places(name, 20):
        walls, v, pull = walls_of(surface, radius), rng.normal(size=3), rng.normal(size=3)
        for wall in walls:
            assert call(wall.far, r) <= max(-call(wall.distance, r), 0.0) + 1e-12
        safe = min(5.0, *(call(wall.safe_time, r, v, pull) for wall in walls))
        for t in safe * rng.uniform(0.0, 1.0, 20):
            assert outermost(walls, r + t * v + 0.5 * t * t * pull)[1] <= 1e-12


def test_the_distance_from_a_triangle():
    """The foot is on it, and all its corners are behind the plane there."""
    rng = np.random.default_rng(15)
    for _triangle in range(20):
        corners = rng.normal(size=(3, 3))
        wall = triangles_of_balls(corners[None], 0.1).wall(0.0)
        for _place in range(20):
            r = rng.normal(size=3)
            away, normal = -call(wall.distance, r), np.array(call(wall.unit_normal, r))
            foot = r + away * normal
            weights = np.linalg.lstsq(np.vstack([corners.T, np.ones(3)]), np.append(foot, 1.0), rcond=None)[0]
            assert corners.T @ weights == pytest.approx(foot, abs=1e-12)
            assert (weights >= -1e-12).all()
            assert ((corners - foot) @ normal >= -1e-12).all()


def test_balls_of_any_radius_are_known_to_the_scene():
    scene = swarm.Scene([swarm.Sphere(1.0), swarm.Box((0.2, 0.2, 0.2), side="outside")])
    points, radius = np.array([[0.6, 0.6, 0.45], [0.0, 0.0, 0.45], [0.0, 0.0, 0.45]]), np.array([0.1, 0.5, 0.4])
    reach = scene.distances_outside(points, 0.0, radius)
    corner = math.sqrt(3.0 * 0.25**2)
    assert reach == pytest.approx(np.array([[-0.3, 0.1, 0.45 * 3**0.5 - 0.6], [-0.3, 0.1, 0.4 - corner]]))
    assert scene.admits(points, radius).tolist() == [True, False, False]
    assert scene.outside(points, 0.2, radius).tolist() == []
    assert scene.outside(points, 0.15, radius).tolist() == [2]
    assert (scene.gaps(points, 0.0, radius) == reach).all()


def test_a_ball_meets_a_solid_across_a_face_of_the_cell():
    scene = swarm.Scene([swarm.Sphere(0.2, (0.25, 0.5, 0.5), "outside")], period=(1.0, 1.0, 1.0))
    assert len(scene.pieces.each) == 1
    assert len(scene.compiled(0.04).pieces.each) == 1
    assert len(scene.compiled(0.1).pieces.each) == 2
    assert scene.distances_outside([[0.98], [0.5], [0.5]], 0.0, np.array([0.1])) == pytest.approx(0.03)


@pytest.mark.parametrize("kind", ["spheres", "rods", "bricks", "drums"])
def test_the_cells_of_a_field_hold_what_balls_touch(kind):
    """As all members one by one say."""
    rng = np.random.default_rng(11)
    places, axes = rng.uniform(-1.0, 1.0, (60, 3)), rng.normal(size=(60, 3))
    field = {
        "spheres": swarm.Spheres(places, rng.uniform(0.02, 0.1, 60)),
        "rods": swarm.Capsules(places, 0.05, 0.2, axes),
        "bricks": swarm.Boxes(places, (0.05, 0.1, 0.02), rng.normal(size=(60, 4))),
        "drums": swarm.Cylinders(places, 0.05, axes, 0.2),
    }[kind]
    radius = rng.uniform(0.01, 0.3, 400)
    points = rng.uniform(-1.2, 1.2, (3, 400))
    with np.errstate(all="ignore"):
        found = field.reaching_outside(points, radius)
        one_by_one = np.max([solid.reaching_outside(points, radius) for solid in field.solids()], axis=0)
    touches = one_by_one > 0.0
    assert 50 < touches.sum() < 350
    assert found[touches] == pytest.approx(one_by_one[touches], abs=1e-14)
    assert (found[~touches] <= 0.0).all()
    members = field.walls_of_balls(0.3)[0]
    for k in range(20):
        v = rng.normal(size=3)
        if touches[k]:
            continue
        grown = members.grown(np.float64(radius[k]))
        start, total = Vec(*points[:, k]), 0.0
        with np.errstate(all="ignore"):
            for _cell in range(100):
                hit = grown.field_hit(None, start, Vec(*v))
                total += hit.time
                if hit.wall >= 0.0 or not total < math.inf:
                    break
                start = start + Vec(*v) * hit.time
            each = [
                call(members.grown(np.float64(radius[k])).wall(float(m)).first_hit, points[:, k], v) for m in range(60)
            ]
        assert total == pytest.approx(min(time for time, _found in each), rel=1e-12)


def test_the_foot_of_a_contact_is_on_the_wall():
    scene = swarm.Scene([swarm.Sphere(1.0), swarm.Box((0.2, 0.2, 0.2), side="outside")])
    radius = np.float64(0.1)
    walls = scene.compiled(radius).walls().grown(radius)
    for number, wall in walls.numbered():
        r = Vec(*(np.float64(x) for x in ((0.9, 0.0, 0.0) if wall.side > 0.0 else (0.0, -0.3, 0.1))))
        foot = np.array(walls.foot(number, r, radius))
        assert np.abs(scene.gaps(foot[:, None])).min() <= 1e-15


@pytest.mark.parametrize("name", ["ball", "slab", "brick", "box", "ring", "table", "bent table", "stone", "egg"])
def test_discs_stay_in_their_plane(name):
    """Of walls that stand upright, whose normals are in the plane to the last bit."""
    surface = SHAPES[name][0]
    if surface.rotation is not None:
        surface = replace(surface, rotation={"axis": (0.0, 0.0, 1.0), "angle": 0.7})
    scene = swarm.Scene([surface], plane="z")
    rng = np.random.default_rng(13)
    for wall in scene.compiled(0.1).walls().each:
        members = getattr(wall, "members", None)
        each = [wall] if members is None else [members.wall(float(m)) for m in range(int(members.count()))]
        for one in each:
            for _place in range(10):
                n = call(call(one.grown, 0.05).unit_normal, np.array([*rng.uniform(-1.0, 1.0, 2), 0.0]))
                assert abs(n.z) in (0.0, 1.0)


@pytest.mark.parametrize("name", ["sphere", "brick", "can", "drum", "rod", "torus", "cone", "spike", "egg", "stone"])
def test_soft_balls_keep_their_energy(name):
    surface = SHAPES[name][0]
    vessel = [surface] if name in ("sphere", "can", "torus", "egg") else [surface, swarm.Sphere(1.4)]
    scene = swarm.Scene(vessel, gravity=(0.3, 0.1, -1.0))
    start = swarm.fill(scene, 4, speed=1.5, radius=np.array([0.1, 0.05, 0.12, 0.08]), seed=3)
    # Contacts that are a third of the smallest radius deep at most.
    method = swarm.Penalty(dt=4e-3, penalty=1e5, exponent=1.5)
    result = swarm.simulate(scene, start, method, until=2.0, every=1.0, progress=False)
    energy = result.observables["total_energy"]
    assert result.observables["impacts"][-1] > 0
    assert energy == pytest.approx(energy[0], rel=1e-12)


@pytest.mark.parametrize(
    ("surfaces", "plane", "words"),
    [
        ([swarm.Ellipsoid((1.0, 1.0, 0.3))], None, "radius must be below 0.09 m, the smallest radius of curvature"),
        ([swarm.Sphere(0.1)], None, "radius must be below 0.1 m, .* touches it at several points at once"),
        ([swarm.Torus(1.0, 0.1, (-1.0, 0.0, 0.0))], None, "radius must be below 0.1 m"),
        ([swarm.Box((1.0, 1.0, 0.05))], "z", "as far from the plane as the largest radius, 0.1 m of particle 0"),
        ([swarm.Prism(L_SHAPE, 0.1, center=(0.4, 0.4, 0.0))], "z", "got 0.05 m; make it endless"),
    ],
    ids=["tip", "sphere", "torus", "lid", "lid of a prism"],
)
def test_balls_that_are_too_large_for_a_shape(surfaces, plane, words):
    scene = swarm.Scene(surfaces, plane=plane)
    ball = swarm.Particles((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), radius=0.1)
    with pytest.raises(swarm.SceneError, match=words):
        swarm.simulate(scene, ball, swarm.Impact(), until=1.0, every=1.0, progress=False)


def test_a_surface_with_a_tip_is_refused_in_a_sentence():
    scene = swarm.Scene([swarm.Quadric(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)))])
    ball = swarm.Particles((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), radius=0.1)
    with pytest.raises(swarm.SceneError, match="Quadric, which has a tip at"):
        swarm.simulate(scene, ball, swarm.Impact(), until=1.0, every=1.0, progress=False)
