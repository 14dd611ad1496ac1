"""Hard balls in a union of several rooms, whose edges they turn about."""

import dataclasses
import math

import numpy as np
import pytest

import swarm
from swarm.kernel.vector import Vec
from swarm.surfaces.balls import joined_faces, joined_rooms
from swarm.surfaces.rotation import matrix

BOXES = swarm.Union([swarm.Box((0.5, 0.5, 0.5)), swarm.Box((0.6, 0.2, 0.25), (0.9, 0.1, 0.05))])
SPHERES = swarm.Union([swarm.Sphere(0.5), swarm.Sphere(0.4, (0.6, 0.1, 0.0))])
PIPE = swarm.Union([swarm.Sphere(0.5), swarm.Cylinder(0.2, length=2.0, axis=(1.0, 0.0, 0.0), center=(0.9, 0.0, 0.0))])
FOAM = swarm.Spheres([(0.0, 0.0, 0.0), (0.6, 0.1, 0.0)], [0.5, 0.4], side="inside")
# A bin: the mouth of the cone is in the cylinder.
BIN = swarm.Union(
    [
        swarm.Cylinder(0.4, length=1.0, axis=(0.0, 0.0, 1.0), center=(0.0, 0.0, 0.25)),
        swarm.Intersection([swarm.Cone(0.6, center=(0.0, 0.0, -0.9)), swarm.Plane((0.0, 0.0, 1.0), 0.0)]),
    ]
)
# Walls of three rooms meet at tips, about which balls turn.
BUBBLES = swarm.Union([SPHERES.parts[0], swarm.Sphere(0.45, (0.5, 0.1, 0.0)), swarm.Sphere(0.45, (0.2, 0.5, 0.05))])
CROSS = swarm.Union([
    swarm.Box((0.5, 0.3, 0.3)), swarm.Box((0.3, 0.5, 0.3), (0.05, 0.02, 0.1)),
    swarm.Box((0.3, 0.3, 0.5), (0.0, 0.05, 0.02)),
])  # fmt: skip
PIPES = swarm.Union([
    swarm.Cylinder(0.3, (1.0, 0.0, 0.0), 1.0), swarm.Cylinder(0.3, (0.0, 1.0, 0.0), 1.0, (0.05, 0.0, 0.02)),
    swarm.Cylinder(0.3, (0.1, 0.0, 1.0), 1.0),
])  # fmt: skip
# A ball high in the tower is outside of the sphere, of which it faces a part that is seen from inside.
TOWER = swarm.Union(
    [swarm.Box((0.5, 0.5, 0.5)), swarm.Box((0.3, 0.3, 0.8), (0.2, 0.1, 0.3)), swarm.Sphere(0.5, (-0.4, 0.0, 0.12))]
)
TIPPED = {"bubbles": BUBBLES, "cross": CROSS, "pipes": PIPES}
UNIONS = {"boxes": BOXES, "spheres": SPHERES, "pipe": PIPE, "foam": FOAM, "bin": BIN, "tower": TOWER, **TIPPED}
FLIGHTS = 6


def walls_of(union, radius):
    return swarm.Scene([union]).compiled().of_balls(radius).walls(0.0).grown(radius).each


def met(union, radius, place, velocity, pull):
    """When a flight meets the walls: a fall is looked at in several parts."""
    walls = walls_of(union, radius)
    r, v, g = (Vec(*np.array(one, float)) for one in (place, velocity, pull or (0.0, 0.0, 0.0)))
    time, meets = 0.0, False
    with np.errstate(all="ignore"):
        while not meets and time < 9.0:
            at, w = r + time * (v + (0.5 * time) * g), v + time * g
            looked = (wall.first_hit(at, w) if pull is None else wall.falling_hit(at, w, g) for wall in walls)
            later, meets = min(looked)
            time += later
    return time, meets


def test_a_ball_flies_over_the_middle_of_a_room_to_the_other_wall():
    """Next to the middle of the second room: the nearer wall of that is the one that the first room hides."""
    union = swarm.Union([swarm.Box((1.0, 1.0, 1.0), (-0.8, 0.0, 0.0)), swarm.Box((0.7, 0.7, 0.7), (0.8, 0.0, 0.0))])
    time, meets = met(union, 0.02, (0.79, 0.07, 0.18), (0.94, -0.35, 0.04), None)
    assert meets
    assert time == pytest.approx((1.48 - 0.79) / 0.94, rel=1e-15)


@pytest.mark.parametrize("name", ["boxes", "spheres", "pipe"])
def test_a_flight_takes_few_looks_at_the_walls_and_none_beyond_them(name, monkeypatch):
    """Looks and bisections to each wall, without those that another one comes before."""
    looks, nearest = [], joined_faces.nearest
    look = joined_faces.JoinedFaces.look

    def counted(*arguments):
        looks.append(arguments)
        return look(*arguments)

    monkeypatch.setattr(joined_faces.JoinedFaces, "look", counted)
    monkeypatch.setattr(joined_faces, "nearest", lambda *arguments: looks.append(arguments) or nearest(*arguments))
    random, walls = np.random.default_rng(2), walls_of(UNIONS[name], 0.05)
    with np.errstate(all="ignore"):
        for _flight in range(20):
            place, velocity = Vec(*random.uniform(-0.2, 0.2, 3)), Vec(*random.normal(size=3))
            assert any(wall.first_hit(place, velocity)[0] < math.inf for wall in walls)
    assert len(looks) < 12 * 20 * len(walls)


@pytest.mark.parametrize("pull", [None, (0.5, 1.0, -3.0)], ids=["straight", "fall"])
def test_a_flight_within_one_room_is_found_at_one_look(pull, monkeypatch):
    """It is that in the room alone, and other walls of the union are not met."""
    looks, look = [], joined_faces.JoinedFaces.look
    monkeypatch.setattr(
        joined_faces.JoinedFaces, "look", lambda *arguments: looks.append(arguments) or look(*arguments)
    )
    random, radius, count = np.random.default_rng(2), 0.05, 0
    walls, alone = walls_of(BOXES, radius), walls_of(BOXES.parts[0], radius)

    def first_two(each, r, v):
        return sorted(one.first_hit(r, v) if pull is None else one.falling_hit(r, v, Vec(*pull)) for one in each)[:2]

    with np.errstate(all="ignore"):
        for _flight in range(40):
            r, v = Vec(*random.uniform(-0.4, 0.4, 3)), Vec(*random.normal(size=3))
            (time, meets), _second = first_two(alone, r, v)
            if meets and r.x + time * (v.x + 0.5 * time * (pull or (0.0,))[0]) < 0.44:
                looks.clear()
                assert first_two(walls, r, v) == [(time, True), (math.inf, True)]
                assert len(looks) == len(walls)
                count += 1
    assert count > 20


@pytest.mark.parametrize("name", list(TIPPED))
def test_a_ball_that_flies_at_a_tip_meets_it_at_a_distance_of_its_radius(name):
    union, radius = UNIONS[name], 0.04
    tips = [np.array(tip) for wall in walls_of(union, radius) for tip in wall.tips]
    assert len(tips) == {"bubbles": 2, "cross": 2, "pipes": 8}[name]
    for tip in tips:
        # The tip is on the walls of three rooms and in none; the way to it is from the middle of the vessel.
        assert np.sort(np.abs([part.phi(tip[:, None])[0] for part in union.parts])) == pytest.approx(
            [0.0] * 3, abs=1e-15
        )
        time, meets = met(union, radius, -0.1 * tip, 1.1 * tip, None)
        assert meets
        assert time == pytest.approx(1.0 - radius / np.linalg.norm(1.1 * tip), abs=1e-13)


@pytest.mark.parametrize("pull", [None, (0.5, 1.0, -3.0)], ids=["straight", "fall"])
@pytest.mark.parametrize("name", list(UNIONS))
def test_a_flight_ends_where_points_all_over_the_ball_leave_the_union(name, pull):
    # phi of points of a sphere says whether the ball is in the union, with no use of edges or feet.
    rng, union, radius = np.random.default_rng(5), UNIONS[name], 0.07
    around = rng.normal(size=(3, 3000))
    around *= radius / np.sqrt((around**2).sum(axis=0))
    starts = rng.uniform(-1.0, 1.0, (1000, 3)) * np.abs(union.bounds()).max(axis=0)
    starts = [place for place in starts if union.phi(place[:, None] + around).max() <= 0.0]
    for place, velocity in zip(starts[:FLIGHTS], rng.normal(size=(FLIGHTS, 3)), strict=True):
        time, meets = met(union, radius, place, velocity, pull)
        assert meets

        def outside(t, grown, place=place, velocity=velocity):
            center = place + t * velocity + (0.0 if pull is None else 0.5 * t * t * np.array(pull))
            return union.phi(center[:, None] + grown * around).max()

        assert max(outside(t, 1.0 - 1e-9) for t in np.linspace(0.0, time, 40)) <= 1e-9
        assert outside(time, 1.03) > 0.0


def test_the_clearance_is_at_most_the_distance_from_the_edge_of_a_doorway():
    """Also where the edge is many radii away: cells of balls are marked by it as near a wall, or not."""
    radius, between = 0.03, np.array([0.6, 0.1, 0.0])
    length = np.linalg.norm(between)
    along = between / length
    middle = 0.5 * (length + (0.5**2 - 0.4**2) / length)
    circle = math.sqrt(0.5**2 - middle**2)
    for place in np.random.default_rng(4).uniform(-0.45, 0.45, (200, 3)) + 0.5 * between:
        off = place - along * (place @ along)
        away = math.hypot(place @ along - middle, np.linalg.norm(off) - circle)
        clear = min(wall.clearance(Vec(*place)) for wall in walls_of(SPHERES, radius))
        assert clear <= away - radius + 1e-12


def test_an_edge_that_touches_the_wall_of_a_third_room_has_one_tip():
    # The line x = -0.1, z = 0.5 is 0.5 from the centre, at y = 0.
    touching = swarm.Union([*TOWER.parts[:2], swarm.Sphere(0.5, (-0.4, 0.0, 0.1))])
    (tip,) = [np.array(tip) for wall in walls_of(touching, 0.04) for tip in wall.tips]
    assert tip == pytest.approx([-0.1, 0.0, 0.5], abs=1e-5)


@pytest.mark.parametrize("pull", [None, (0.3, -0.2, 1.0)], ids=["straight", "fall"])
def test_a_ball_behind_a_face_that_is_seen_flies_on(pull):
    """High in the tower it meets the walls of the tower alone, as a point meets a box that is smaller by its radius."""
    rng, radius = np.random.default_rng(2), 0.02
    low, high = np.array([-0.1, -0.2, 0.5]) + radius, np.array([0.5, 0.4, 1.1]) - radius
    for place in rng.uniform((-0.05, -0.15, 0.95), (0.2, 0.35, 1.05), (30, 3)):
        velocity, g = np.abs(rng.normal(size=3)) * (-1.0, 1.0, 1.0), np.array(pull or (0.0, 0.0, 0.0))
        passed = [np.roots([0.5 * g[k], velocity[k], place[k] - end[k]]) for k in range(3) for end in (low, high)]
        first = min(t.real for times in passed for t in times if t.imag == 0.0 and t.real > 0.0)
        time, meets = met(TOWER, radius, place, velocity, pull)
        assert meets
        assert time == pytest.approx(first, abs=1e-12)


# Of a wall of the first box and one of the second, 0.3 is an edge: between the end of both boxes and the sphere.
SHORT = swarm.Union([
    swarm.Box((1.0, 1.0, 1.0), (-0.8, 0.0, 0.0)), swarm.Box((0.7, 0.9, 0.5), (0.6, 0.2, 0.1)),
    swarm.Sphere(0.9, (0.0, 0.5, 0.8)),
])  # fmt: skip


@pytest.mark.parametrize("pull", [None, (0.3, -0.2, -1.0)], ids=["straight", "fall"])
def test_a_turned_box_of_two_that_overlap_is_met_as_one(pull):
    """Each side is in the plane of a side of both boxes, up to round-off of the turn: it is seen where they overlap."""
    turn = {"axis": (0.3, -0.2, 1.0), "angle": 0.7}
    whole = swarm.Box((0.7, 0.5, 0.4), rotation=turn)
    x, y, z = matrix(whole.rotation).T
    halves = [swarm.Box((0.45, 0.5, 0.4), tuple(k * x), rotation=turn) for k in (-0.25, 0.25)]
    rng = np.random.default_rng(1)
    for _flight in range(20):
        a, b, c = rng.uniform(-1.0, 1.0, 3) * (0.5, 0.3, 0.2)
        place, velocity = a * x + b * y + c * z, rng.normal(size=3)
        times = [met(one, 0.1, place, velocity, pull)[0] for one in (swarm.Union(halves), whole)]
        assert times[0] == pytest.approx(times[1], rel=1e-9)


@pytest.mark.parametrize("radius", [0.02, 0.1])
def test_a_ball_meets_an_edge_that_is_a_tenth_of_the_way_through_its_rooms(radius):
    velocity = np.array([0.0, 0.3, -0.3])
    time, meets = met(SHORT, radius, (0.05, 0.7, -0.1), velocity, None)
    assert meets
    # It flies at the place (0.05, 1, -0.4) of the edge.
    assert time == pytest.approx(1.0 - radius / np.linalg.norm(velocity), abs=1e-14)


def test_an_edge_is_found_where_a_corner_of_a_box_reaches_a_little_through_a_wall():
    # The mouth is a triangle: three edges, each between two edges of the second box, in the wall z = 0.5 of the first.
    cosine = 1.0 / math.sqrt(3.0)
    sine = math.sqrt(0.25 - 0.25 * cosine)
    for reach in (0.1, 0.01, 1e-3):
        center = (0.03, 0.02, 0.5 + reach - 0.1 * math.sqrt(3.0))
        corner = swarm.Box((0.1, 0.1, 0.1), center, rotation=(math.sqrt(0.5 + 0.5 * cosine), sine, -sine, 0.0))
        walls = walls_of(swarm.Union([swarm.Box((0.5, 0.5, 0.5)), corner]), 0.01)
        assert sum(len(wall.edges) for wall in walls) == 3


def test_the_bend_of_an_edge_is_that_of_a_circle_or_at_the_end_of_the_long_axis_of_an_ellipse():
    radius, wall = 0.2, 0.5
    for axis in ((1.0, 0.0, 0.0), (1.0, 0.3, 0.0), (1.0, -1.0, 0.5)):
        tube = swarm.Cylinder(radius, axis, 4.0)
        (edge,) = walls_of(swarm.Union([swarm.Box((wall, 2.0, 2.0)), tube]), 0.05)[0].edges
        least = radius / np.linalg.norm(axis)
        assert 0.99 * least < edge.bend <= least
    (edge,) = walls_of(swarm.Union([swarm.Box((wall, 2.0, 2.0)), swarm.Sphere(0.6, (0.15, 0.0, 0.0))]), 0.05)[0].edges
    assert edge.bend == pytest.approx(math.sqrt(0.6**2 - 0.35**2), rel=2e-3)


def test_the_bend_of_an_edge_is_sharp_where_tubes_of_nearly_one_radius_cross():
    # With x^2 = b^2 - z^2 and y^2 = a^2 - z^2 it is sharpest at y = 0, z = a.
    a, b = 0.3, 0.301
    tubes = swarm.Union([swarm.Cylinder(a, (1.0, 0.0, 0.0), 2.0), swarm.Cylinder(b, (0.0, 1.0, 0.0), 2.0)])
    (edge,) = (edge for wall in walls_of(tubes, 0.02) for edge in wall.edges)
    least = 1.0 / math.sqrt(1.0 / (b * b - a * a) + 1.0 / (a * a))
    assert 0.99 * least < edge.bend <= least


def test_a_flight_meets_the_mouth_of_a_tube_twice_as_wide_as_the_ball_at_once():
    """Also slowly from the side."""
    rooms = swarm.Union([swarm.Box((0.5, 0.5, 0.5), (x, 0.0, 0.0)) for x in (-1.0, 1.0)] + [
        swarm.Cylinder(0.2, (1.0, 0.0, 0.0), 1.2)
    ])  # fmt: skip
    wall = next(wall for wall in walls_of(rooms, 0.1) if wall.edges)
    place = np.array([0.2609590973064271, 0.08196657261335483, 0.03709515815024822])
    velocity = np.array([0.8449662539444412, -0.31297022365714733, -0.433683835067775])
    time, meets = wall.first_hit(Vec(*place), Vec(*velocity))
    assert meets
    x, y, z = place + time * velocity
    assert math.hypot(x - 0.5, math.hypot(y, z) - 0.2) == pytest.approx(0.1, abs=1e-14)


@pytest.mark.parametrize("height", [0.0, 0.02, 0.05, 0.069])
def test_a_ball_meets_the_edge_of_a_doorway_at_a_distance_of_its_radius(height):
    # The lower edge of the doorway is the line x = 0.5, z = -0.2, which the ball comes to within the plane y = 0.1.
    radius, speed, edge = 0.07, 1.0, (0.5, -0.2)
    start = (0.1, 0.1, edge[1] + height)
    exact = (edge[0] - math.sqrt(radius**2 - height**2) - start[0]) / speed
    time, meets = met(BOXES, radius, start, (speed, 0.0, 0.0), None)
    assert meets
    assert time == pytest.approx(exact, abs=1e-14)


@pytest.mark.parametrize("gravity", [None, (0.0, 0.5, -2.0)], ids=["straight", "fall"])
@pytest.mark.parametrize("name", list(UNIONS))
def test_balls_in_rooms_keep_their_energy_and_stay_inside(name, gravity):
    rng = np.random.default_rng(1)
    position = np.array([(x, y, 0.0) for x in (-0.15, 0.15) for y in (-0.15, 0.15)]).T
    scene = swarm.Scene([UNIONS[name]], gravity=gravity)
    balls = swarm.Particles(position, 2.0 * rng.normal(size=position.shape), radius=0.06)
    done = swarm.simulate(scene, balls, swarm.Impact(), until=0.4, every=0.2, compile="never", progress=False)
    energy = np.array(done.observables["kinetic_energy"])
    if gravity is not None:
        energy = energy + done.observables["potential_energy"]
    assert np.abs(energy / energy[0] - 1.0).max() < 1e-14
    assert done.observables["impacts"][-1] > 2
    gaps = scene.distances_outside(done.particles.position, 0.0, done.particles.radius)
    assert gaps.max() <= 4.0 * np.finfo(float).eps * 1.5


def test_a_foam_is_the_union_of_its_bubbles():
    ends = []
    for vessel in (FOAM, SPHERES):
        balls = swarm.Particles((0.1, 0.05, -0.1), (2.0, 1.1, -0.7), radius=0.05)
        done = swarm.simulate(
            swarm.Scene([vessel]), balls, swarm.Impact(), until=2.0, every=2.0, compile="never", progress=False
        )
        assert done.observables["impacts"][-1] > 3
        ends.append(done.particles.position)
    np.testing.assert_array_equal(*ends)


def test_rooms_that_touch_at_a_face_are_as_one_box():
    halves = swarm.Union([swarm.Box((0.35, 0.4, 0.45), (x, 0.0, 0.0)) for x in (-0.35, 0.35)])
    ends = []
    for vessel in (halves, swarm.Box((0.7, 0.4, 0.45))):
        balls = swarm.Particles((0.1, 0.05, -0.1), (2.0, 1.1, -0.7), radius=0.05)
        done = swarm.simulate(
            swarm.Scene([vessel]), balls, swarm.Impact(), until=3.0, every=3.0, compile="never", progress=False
        )
        ends.append(done.particles.position)
    np.testing.assert_allclose(*ends, atol=1e-13)


def test_the_bend_of_an_edge_is_that_of_its_circle_and_none_where_walls_touch():
    def edge(radius, x):
        one, other = (
            wall for sphere in (swarm.Sphere(0.5), swarm.Sphere(radius, (x, 0.0, 0.0))) for wall in sphere.walls()
        )
        return joined_faces.RoomEdge(one, other, (0.0, 1.0))

    assert edge(0.4, 0.3).bend_at(Vec(0.3, 0.4, 0.0)) == pytest.approx(0.4, rel=1e-14)
    assert edge(0.25, 0.25).bend_at(Vec(0.5, 0.0, 0.0)) == math.inf


def test_the_gradient_of_rooms_that_turn_is_that_of_their_union():
    motion = swarm.Rotation((0.0, 0.0, 1.0), rate=2.0, center=(0.1, 0.0, 0.0))
    turning = dataclasses.replace(BOXES, motion=motion)
    points = np.random.default_rng(3).uniform(-1.0, 1.0, (3, 50))
    for time in (0.0, 0.4):
        there = joined_rooms.joined_rooms_of(turning).gradient(points, time)
        assert there == pytest.approx(turning.gradient(points, time), abs=1e-15)
