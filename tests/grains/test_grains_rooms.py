"""Grains in a union of several rooms: a bin and its outlet, boxes joined by a neck, spheres that overlap."""

import math

import numpy as np
import pytest

import swarm
from swarm.kernel.vector import Vec
from swarm.surfaces.rotation import matrix

BIN = swarm.Union([swarm.Cylinder(0.02, length=0.2, center=(0.0, 0.0, 0.1)), swarm.Cylinder(0.01, length=0.2)])
SPHERES = swarm.Union([swarm.Sphere(0.1, (-0.06, 0.0, 0.0)), swarm.Sphere(0.08, (0.06, 0.0, 0.0))])
BOXES = swarm.Union([
    swarm.Box((0.1, 0.1, 0.1), center=(-0.12, 0.0, 0.0)),
    swarm.Box((0.1, 0.1, 0.1), center=(0.12, 0.0, 0.0)),
    swarm.Box((0.1, 0.03, 0.03)),
])  # fmt: skip
# The walls of all three meet at two tips, on the z axis.
THREE = swarm.Union([
    swarm.Sphere(0.1, (0.06 * math.cos(a), 0.06 * math.sin(a), 0.0)) for a in (0.0, math.tau / 3.0, -math.tau / 3.0)
])  # fmt: skip
ROOMS = {"bin": BIN, "spheres": SPHERES, "boxes": BOXES, "three": THREE}


def surface_of_spheres(count):
    """Places all over the walls of both spheres (3, N), with no use of what is tested."""
    found = []
    for surface in SPHERES.parts:
        points = np.random.default_rng(5).normal(size=(3, count))
        found.append(surface.radius * points / np.sqrt((points**2).sum(axis=0)) + np.array(surface.center)[:, None])
    points = np.concatenate(found, axis=1)
    return points[:, SPHERES.phi(points) > -1e-12]


def gap(union, place, radius):
    """How far a ball reaches beyond the walls."""
    scene = swarm.Scene([union])
    return scene.distances_outside(np.array(place, float)[:, None], 0.0, np.array([radius]))[0, 0]


def test_a_ball_at_an_outlet_is_as_far_as_the_floor_its_side_or_its_rim():
    rng = np.random.default_rng(1)
    for angle in rng.uniform(0.0, 2.0 * math.pi, 40):
        across, z = 0.01 + rng.uniform(-0.0019, 0.0019), rng.uniform(-0.0019, 0.0019)
        if across > 0.01:
            z, exact = abs(z), abs(z)
        else:
            exact = 0.01 - across if z < 0.0 else math.hypot(0.01 - across, z)
        place = across * math.cos(angle), across * math.sin(angle), z
        assert gap(BIN, place, 2e-3) == pytest.approx(2e-3 - exact, abs=1e-15)


def test_a_ball_in_two_spheres_is_as_far_as_the_nearest_place_of_a_dense_sample():
    rng, sample = np.random.default_rng(2), surface_of_spheres(40_000)
    places = rng.uniform(-0.1, 0.1, (3, 400))
    places = places[:, SPHERES.phi(places) < 0.0]
    nearest = np.array([np.sqrt(((sample.T - place) ** 2).sum(axis=1)).min() for place in places.T])
    near = np.flatnonzero((nearest > 0.005) & (nearest < 0.03))
    assert near.size > 20
    for k in near:
        # No place of the sample is nearer, and one is almost as near.
        away = 0.03 - gap(SPHERES, places[:, k], 0.03)
        assert away - 1e-12 < nearest[k] < away + 1e-3


def test_a_ball_below_a_tip_of_three_spheres_is_as_far_as_that():
    tip = math.sqrt(0.1**2 - 0.06**2)
    for away in (0.001, 0.01):
        assert gap(THREE, (0.0, 0.0, tip - away), 0.02) == pytest.approx(0.02 - away, abs=1e-16)
        # Off the axis, still nearest to the tip: no sphere has a foot there that is seen, and no edge.
        assert gap(THREE, (1e-4, 2e-5, tip - away), 0.02) == pytest.approx(
            0.02 - math.hypot(1e-4, 2e-5, away), abs=1e-16
        )


def test_the_normal_is_the_slope_of_the_gap_at_an_edge_too():
    (wall,) = swarm.Scene([SPHERES]).compiled(0.03).walls().each
    grown, h = wall.grown(0.03), 1e-6
    # Both spheres meet in a ring across x.
    x = (0.08**2 - 0.1**2) / -0.24
    for place in (Vec(x, math.sqrt(0.1**2 - (x + 0.06) ** 2) - 0.01, 0.0), Vec(-0.06, 0.08, 0.01)):
        slope = [
            (grown.phi(place + h * step) - grown.phi(place - h * step)) / (2.0 * h)
            for step in (Vec(1.0, 0.0, 0.0), Vec(0.0, 1.0, 0.0), Vec(0.0, 0.0, 1.0))
        ]
        assert np.array(grown.gradient(place)) == pytest.approx(slope, abs=1e-8)
    ring = math.sqrt(0.1**2 - (x + 0.06) ** 2)
    assert grown.phi(Vec(x, ring - 0.01, 0.0)) == pytest.approx(0.02, abs=1e-15)


@pytest.mark.parametrize("name", ROOMS)
def test_grains_keep_their_energy_at_walls_and_edges(name):
    scene = swarm.Scene([ROOMS[name]], gravity=(0.0, 0.0, -9.81))
    place, v = {
        "bin": ((0.0095, 0.0, 0.004), (0.0, 0.1, 0.0)),
        "spheres": ((0.0, 0.05, 0.0), (0.1, 0.6, 0.0)),
        "boxes": ((-0.09, 0.009, -0.002), (0.9, 0.1, 0.0)),
        "three": ((0.002, 0.001, 0.066), (0.0, 0.0, 1.5)),
    }[name]
    grain = swarm.Particles(place, v, mass=1e-4, radius=2e-3 if name == "bin" else 0.008)
    method = swarm.Penalty(dt=2e-4, penalty=2e3)
    result = swarm.simulate(scene, grain, method, until=0.15, every=0.05, progress=False)
    energy = result.observables["total_energy"]
    assert result.observables["impacts"][-1] > 0
    assert energy == pytest.approx(energy[0], rel=1e-12)
    assert ROOMS[name].phi(result.particles.position)[0] < 0.0


def test_losses_at_the_rim_take_energy():
    union = swarm.Union(BIN.parts, restitution=0.5, friction=0.3)
    grain = swarm.Particles((0.0085, 0.0, 0.004), (0.0, 0.0, 0.0), mass=1e-4, radius=2e-3)
    method = swarm.Penalty(dt=2e-4, penalty=2e3)
    scene = swarm.Scene([union], gravity=(0.0, 0.0, -9.81))
    result = swarm.simulate(scene, grain, method, until=0.1, every=0.1, progress=False)
    assert result.observables["dissipated_energy"][-1] > 0.0
    assert result.observables["energy_error"].max() < 1e-12


def test_grains_in_a_foam_are_those_in_the_union_of_its_bubbles():
    """Also beyond the edge between two of them, with losses, and by the bits."""
    laws = {"friction": 0.2, "restitution": 0.9}
    foam = swarm.Spheres([one.center for one in SPHERES.parts], [0.1, 0.08], side="inside", **laws)
    places, speeds = np.array([(0.02, 0.04), (0.05, 0.0), (0.0, 0.0)]), np.array([(0.1, -1.0), (0.6, 0.1), (0.0, 0.2)])
    grains = swarm.Particles(places, speeds, mass=1e-4, radius=0.008)
    ends = []
    for surface in (foam, swarm.Union(SPHERES.parts, **laws)):
        scene = swarm.Scene([surface], gravity=(0.0, 0.0, -9.81))
        method = swarm.Penalty(dt=5e-4, penalty=500.0)
        ends.append(swarm.simulate(scene, grains, method, until=0.2, every=0.1, progress=False, compile="never"))
    assert ends[0].observables["impacts"][-1] > 3
    assert np.array_equal(ends[0].particles.position, ends[1].particles.position)
    assert ends[0].observables["energy_error"].max() < 1e-12
    assert foam.phi(ends[0].particles.position).max() < 0.0


def test_foams_that_no_grain_may_meet_are_refused_in_a_sentence():
    foam = swarm.Spheres([(0.04 * k, 0.0, 0.0) for k in range(70)], 0.05, side="inside")
    grain = swarm.Particles((0.0, 0.0, 0.03), (0.0, 0.0, 0.0), mass=1e-4, radius=2e-3)
    with pytest.raises(swarm.SceneError, match="of 70 rooms, and balls meet at most 64"):
        swarm.simulate(swarm.Scene([foam]), grain, swarm.Penalty(1e-4, 2e3), until=0.1, every=0.1, progress=False)


@pytest.mark.parametrize(
    ("union", "words"),
    [
        (swarm.Union([BIN.parts[0], swarm.Torus(0.02, 0.005)]), "made of a Torus, and balls meet edges of rooms made"),
        (
            swarm.Union([BIN.parts[0], swarm.Cylinder(0.01, length=0.2, restitution=0.5)]),
            "the parts differ in restitution, while an edge belongs to both",
        ),
    ],
    ids=["torus", "laws"],
)
def test_what_no_grain_may_meet_is_refused_in_a_sentence(union, words):
    grain = swarm.Particles((0.0, 0.0, 0.03), (0.0, 0.0, 0.0), mass=1e-4, radius=2e-3)
    with pytest.raises(swarm.SceneError, match=words):
        swarm.simulate(swarm.Scene([union]), grain, swarm.Penalty(1e-4, 2e3), until=0.1, every=0.1, progress=False)


def test_a_grain_that_is_larger_than_a_room_is_refused():
    grain = swarm.Particles((0.0, 0.0, 0.1), (0.0, 0.0, 0.0), mass=1e-4, radius=0.012)
    with pytest.raises(swarm.SceneError, match=r"radius must be below 0\.01 m"):
        swarm.simulate(swarm.Scene([BIN]), grain, swarm.Penalty(1e-4, 2e3), until=0.1, every=0.1, progress=False)


@pytest.mark.parametrize("kind", [swarm.Union, swarm.Intersection])
def test_losses_given_to_parts_are_those_given_to_the_whole(kind):
    """A ball that slides on the floor: friction and restitution of the parts act as those of the whole do."""
    losses = {"friction": 0.4, "restitution": 0.5, "rolling": 0.01}
    ends = []
    for mine, common in (({}, losses), (losses, {})):
        boxes = [swarm.Box((0.5, 0.5, 0.5), (x, 0.0, 0.0), **mine) for x in (-0.3, 0.3)]
        scene = swarm.Scene([kind(boxes, **common)], (0.0, 0.0, -9.81))
        ball = swarm.Particles((0.0, 0.0, -0.449), (0.5, 0.0, 0.0), mass=1.0, radius=0.05)
        ends.append(swarm.simulate(scene, ball, swarm.Penalty(dt=5e-5, penalty=1e5), until=0.05))
    assert ends[0].observables["dissipated_energy"][-1] > 0.02
    assert ends[1].particles.velocity.tolist() == ends[0].particles.velocity.tolist()
    assert ends[1].particles.spin.tolist() == ends[0].particles.spin.tolist()
    assert ends[0].particles.spin[1, 0] > 0.1


@pytest.mark.parametrize("rise", [0.0, 0.05, -0.05, 1e-4])
@pytest.mark.parametrize("below", [0.0, 1e-5, 1e-7, -1e-5])
def test_where_two_rooms_meet_a_wall_goes_on(below, rise):
    """A ball that flies into the side of two boxes, one on the other, beside their seam: as into that of one box."""
    side, seam, ends = 0.016, 0.015, []
    for vessel in (
        swarm.Box((side, side, 0.04), (0.0, 0.0, 0.04)),
        swarm.Union(
            [
                swarm.Box((side, side, 0.5 * seam), (0.0, 0.0, 0.5 * seam)),
                swarm.Box((side, side, 0.5 * (0.08 - seam)), (0.0, 0.0, 0.5 * (0.08 + seam))),
            ]
        ),
    ):
        ball = swarm.Particles((0.0109, 0.001, seam - below), (0.3, 0.0, rise), mass=1.3e-3, radius=0.005)
        method = swarm.Penalty(1e-4, 4e3)
        ends.append(swarm.simulate(swarm.Scene([vessel]), ball, method, until=0.003, every=0.003, compile="never"))
    one, two = (end.particles for end in ends)
    assert one.velocity[0, 0] == pytest.approx(-0.3, rel=1e-9)
    np.testing.assert_allclose(two.position, one.position, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(two.velocity, one.velocity, rtol=0.0, atol=1e-11)


def test_a_lid_closes_each_room_of_a_union():
    cone, outlet = swarm.Cone(0.5, center=(0.0, 0.0, -0.02)), swarm.Cylinder(0.012, length=0.04)
    scene = swarm.Scene([swarm.Union([cone, outlet]), swarm.Plane((0.0, 0.0, 1.0), 0.06)])
    low, high = scene.bounds()
    assert (low[2], high[2]) == (-0.02, 0.06)
    assert high[0] == pytest.approx(0.08 * math.tan(0.5), rel=1e-12)
    assert len(swarm.fill(scene, 10, speed=1.0)) == 10


# --- What a ball stores at walls that rooms have in common, or that join in a corner -------------------------


def stored(union, places, radius):
    """The sum of the squares of the gaps of balls at places (3, N) over all walls."""
    walls = [wall.grown(radius) for wall in swarm.Scene([union]).compiled(radius).walls().each]
    return np.array([sum(max(wall.phi(Vec(*place)), 0.0) ** 2 for wall in walls) for place in places.T.tolist()])


def in_a_box(half, places, radius):
    """The same in a box about the origin: each side is a spring."""
    return (np.maximum(radius - (np.array(half)[:, None] - np.abs(places)), 0.0) ** 2).sum(axis=0)


TUNNEL = swarm.Union([
    swarm.Box((0.5, 0.5, 0.5), (-1.2, 0.0, 0.0)), swarm.Box((0.5, 0.5, 0.5), (1.2, 0.0, 0.0)),
    swarm.Box((2.0, 0.3, 0.3)),
])  # fmt: skip
TURN = {"axis": (0.3, -0.2, 1.0), "angle": 0.7}


@pytest.mark.parametrize(("shift", "order"), [(0.35, 1), (0.1 + 0.2, 1), (0.2, -1), (0.0, 1)])
def test_a_wall_that_two_rooms_share_is_one_spring(shift, order):
    """Boxes that touch, that overlap, or that are the same one, against one long box."""
    parts = [swarm.Box((0.35, 0.4, 0.45), (x, 0.0, 0.0)) for x in (-shift, shift)][::order]
    half = 0.35 + shift, 0.4, 0.45
    places = np.random.default_rng(3).uniform(-1.0, 1.0, (3, 60)) * (np.array(half)[:, None] - 0.03)
    places[0, :10] = 0.0
    places[0, 10:20] = 0.35 - shift
    found, exact = stored(swarm.Union(parts), places, 0.1), in_a_box(half, places, 0.1)
    assert (exact > 0.0).sum() >= 10
    assert found == pytest.approx(exact, abs=1e-15)


def test_a_round_wall_that_two_rooms_share_is_one_spring():
    tubes = [swarm.Cylinder(0.4, (1.0, 0.0, 0.0), 0.8, (x, 0.0, 0.0)) for x in (-0.2, 0.2)]
    capsule = swarm.Sphere(0.4), swarm.Cylinder(0.4, (1.0, 0.0, 0.0), 0.6, (-0.3, 0.0, 0.0))
    turned = [swarm.Box((0.35, 0.4, 0.45), (x, 0.0, 0.0)) for x in (-0.3, 0.3)]
    random = np.random.default_rng(4)
    places = random.uniform(-1.0, 1.0, (3, 60)) * np.array([0.25, 0.25, 0.25])[:, None]
    places = places[:, np.linalg.norm(places, axis=0) < 0.38]
    deep = np.maximum(np.hypot(places[1], places[2]) - 0.3, 0.0) ** 2
    assert stored(swarm.Union(tubes), places, 0.1) == pytest.approx(deep, abs=1e-15)
    round_end = np.where(places[0] > 0.0, np.maximum(np.linalg.norm(places, axis=0) - 0.3, 0.0) ** 2, deep)
    assert stored(swarm.Union(capsule), places, 0.1) == pytest.approx(round_end, abs=1e-15)
    twice = np.maximum(np.linalg.norm(places, axis=0) - 0.3, 0.0) ** 2
    assert stored(swarm.Union([swarm.Sphere(0.4), swarm.Sphere(0.4)]), places, 0.1) == pytest.approx(twice, abs=1e-15)
    union = swarm.Union(turned, rotation=TURN)
    places = random.uniform(-1.0, 1.0, (3, 60)) * np.array([0.6, 0.37, 0.42])[:, None]
    there = matrix(swarm.Box((1, 1, 1), rotation=TURN).rotation) @ places
    assert stored(union, there, 0.1) == pytest.approx(in_a_box((0.65, 0.4, 0.45), places, 0.1), abs=1e-14)


def near_the_mouth(places, radius):
    """The same near the end of the corner of a tunnel, at (-0.7, 0.3, 0.3), in closed form."""
    x, y, z = places - np.array([-0.7, 0.3, 0.3])[:, None]
    inside, before = np.maximum(-x, 0.0), x < 0.0
    one, other, end = np.hypot(inside, y), np.hypot(inside, z), np.hypot(inside, np.hypot(y, z))
    found = sum(np.maximum(radius - away, 0.0) ** 2 for away in (one, other)) - np.maximum(radius - end, 0.0) ** 2
    return np.where(before & ((y > 0.0) | (z > 0.0)), np.maximum(radius + x, 0.0) ** 2, found)


def test_a_ball_in_the_corner_of_a_tunnel_is_held_by_both_sides():
    places = np.random.default_rng(5).uniform(-1.0, 1.0, (3, 4000)) * np.array([1.9, 0.29, 0.29])[:, None]
    deep = places[:, np.abs(places[0]) < 0.6][:, :100]
    # A ball that reaches the corner itself is deeper than any that steps follow.
    deep = deep[:, np.hypot(*(0.3 - np.abs(deep[1:]))) > 0.05]
    assert stored(TUNNEL, deep, 0.05) == pytest.approx(in_a_box((2.0, 0.3, 0.3), deep, 0.05), abs=1e-15)
    # At its mouth too, and the spring of the second side ends there without a jump.
    mouth = np.array([-0.7, 0.3, 0.3])[:, None] + np.random.default_rng(6).uniform(-0.06, 0.06, (3, 100))
    mouth = mouth[:, TUNNEL.phi(mouth) < 0.0]
    assert stored(TUNNEL, mouth, 0.05) == pytest.approx(near_the_mouth(mouth, 0.05), abs=1e-14)


def test_the_force_in_a_corner_is_the_slope_of_what_is_stored():
    scene = swarm.Scene([TUNNEL]).compiled(0.05).walls()
    (wall,) = (one.grown(0.05) for one in scene.each if one.corners)
    h, steps = 1e-6, [Vec(*row) for row in np.eye(3).tolist()]
    places = np.array([-0.7, 0.3, 0.3]) + np.random.default_rng(7).uniform(-0.05, 0.05, (60, 3))
    asked = [Vec(*place) for place in places[TUNNEL.phi(places.T) < 0.0].tolist()]
    deep = [place for place in asked if wall.phi(place) > 1e-3]
    assert len(deep) > 20
    for place in deep:
        slope = [(wall.phi(place + h * one) - wall.phi(place - h * one)) / (2.0 * h) for one in steps]
        assert np.array(wall.gradient(place)) == pytest.approx(slope, abs=1e-6)


@pytest.mark.parametrize("shift", [0.35, 0.3])
def test_a_grain_slides_over_the_end_of_a_room_as_in_one_long_box(shift):
    rooms = swarm.Union([swarm.Box((0.35, 0.4, 0.45), (x, 0.0, 0.0)) for x in (-shift, shift)])
    grain = swarm.Particles((-0.1, 0.0, -0.4001), (1.0, 0.0, 0.0), radius=0.05)
    ends = []
    for wall in (rooms, swarm.Box((0.35 + shift, 0.4, 0.45))):
        scene, method = swarm.Scene([wall], (0.0, 0.0, -9.81)), swarm.Penalty(dt=4e-3, penalty=1e4)
        ends.append(swarm.simulate(scene, grain, method, until=0.2, every=0.04, compile="never"))
    assert ends[0].particles.position == pytest.approx(ends[1].particles.position, abs=1e-12)
    assert ends[0].particles.velocity == pytest.approx(ends[1].particles.velocity, abs=1e-12)
    assert ends[0].observables["energy_error"].max() < 1e-14


@pytest.mark.slow
@pytest.mark.parametrize("v", [(-1.0, 0.0, 0.0), (-1.0, 0.3, 0.1)])
def test_a_grain_that_leaves_a_tunnel_in_its_corner_keeps_its_energy(v):
    grain = swarm.Particles((-0.66, 0.2501, 0.2501), v, radius=0.05)
    scene, method = swarm.Scene([TUNNEL], (0.0, 9.0, 9.0)), swarm.Penalty(dt=1e-3, penalty=1e4)
    result = swarm.simulate(scene, grain, method, until=0.06, every=0.02, compile="never")
    assert result.observables["contact_energy"].max() > 0.0
    assert result.particles.position[0, 0] < -0.7
    assert result.observables["energy_error"].max() < 1e-14
