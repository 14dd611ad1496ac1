"""Meshes and outlines that move are the closed shapes that they are of, and no particle leaves them."""

import itertools

import numpy as np
import pytest

import swarm
from swarm.contact import crossing, touching
from swarm.contact.projection import Touch
from swarm.kernel.gravity import Gravity
from swarm.kernel.vector import Vec, norm, vec
from swarm.lanes import flight
from swarm.observables import drift
from swarm.surfaces.balls.facet import RoundTriangle
from swarm.surfaces.in_motion import moving
from swarm.surfaces.in_motion.drive import drive_of
from swarm.surfaces.rotation import Rotated
from swarm.surfaces.shapes.plane import PlaneNumbers
from swarm.surfaces.time_of_impact.rising import InWallFrame, flight_of

DOWN = (0.0, 0.0, -9.81)
SHIFTED = swarm.Translation((0.05, 0.02, -0.03))
SHAKEN = swarm.Oscillation((0.05, 0.02, 0.0), 1.0)
TURNED = swarm.Rotation((0.2, 0.1, 1.0), 2.0, (0.02, 0.0, 0.0))
LED = swarm.Path([0.0, 0.5, 1.0, 2.5], [(0, 0, 0), (0.05, 0, 0), (0, 0.05, 0), (0, 0, 0.05)])
MOTIONS = {"shifted": SHIFTED, "shaken": SHAKEN, "led": LED, "turned": TURNED, "all": TURNED + SHAKEN + LED}
HALF = 0.3
# Of a cube, its corners in the order of binary numbers, and of each face two triangles that turn to the left outside.
CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
SQUARES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
TRIANGLES = [part for a, b, c, d in SQUARES for part in ((a, b, c), (a, c, d))]


def cube(side="inside", **how):
    return swarm.Mesh(HALF * CUBE, TRIANGLES, side, **how)


def regular(corners=5, radius=0.4, height=0.8, axis=(0.0, 0.0, 1.0), **how):
    """A prism on a regular polygon, and the planes that it is between."""
    angles = 2.0 * np.pi * np.arange(corners) / corners
    rows = [(radius * np.cos(a), radius * np.sin(a)) for a in angles]
    prism = swarm.Prism(rows, height, axis=axis, **how)
    between = angles + np.pi / corners
    normals = prism.frame @ np.array([np.cos(between), np.sin(between), np.zeros(corners)])
    sides = [swarm.Plane(tuple(n), radius * np.cos(np.pi / corners), **how) for n in normals.T.tolist()]
    return prism, [*sides, swarm.Slab(tuple(prism.frame[:, 2].tolist()), 0.5 * height, **how)]


def start(beside=(0.0, 0.0, 0.0), radius=None, seed=2):
    v = np.random.default_rng(seed).standard_normal((3, 4))
    places = 0.1 * CUBE[[0, 3, 5, 6]].T + np.array(beside)[:, None]
    return swarm.Particles(places, v / np.linalg.norm(v, axis=0), radius=radius)


def run(surfaces, particles, until, gravity=None, **options):
    scene = swarm.Scene(surfaces, gravity)
    return swarm.simulate(scene, particles, swarm.Impact(), until=until, compile="never", **options)


def same(one, other, impacts):
    """Whether two runs are one, to round-off that grows from impact to impact."""
    assert one.particles.position == pytest.approx(other.particles.position, abs=1e-11)
    assert one.particles.velocity == pytest.approx(other.particles.velocity, abs=1e-10)
    seen, wanted = one.observables, other.observables
    assert seen["impacts"][-1] == wanted["impacts"][-1] >= impacts
    for name in ("wall_work", "impulse"):
        assert seen[name][-1].sum(axis=0) == pytest.approx(wanted[name][-1].sum(axis=0), abs=1e-10)
    assert drift(seen) <= 1e-13
    assert seen["max_penetration"].max() <= 1e-14


@pytest.mark.parametrize("gravity", [None, DOWN], ids=["straight", "falling"])
@pytest.mark.parametrize("motion", list(MOTIONS))
def test_in_a_mesh_of_a_box_as_in_the_box(motion, gravity):
    moved = MOTIONS[motion]
    box = swarm.Box(3 * (HALF,), motion=moved)
    same(*(run([one], start(), 0.8, gravity) for one in (cube(motion=moved), box)), 5)


@pytest.mark.parametrize("gravity", [None, DOWN], ids=["straight", "falling"])
@pytest.mark.parametrize("motion", ["led", "turned"])
def test_beside_a_mesh_of_a_box_as_beside_the_box(motion, gravity):
    moved, beside = MOTIONS[motion], (0.55, 0.0, 0.0)
    solids = cube("outside", motion=moved), swarm.Box(3 * (HALF,), side="outside", motion=moved)
    same(*(run([swarm.Sphere(0.9), one], start(beside), 0.8, gravity) for one in solids), 2)


@pytest.mark.parametrize("side", ["inside", "outside"])
@pytest.mark.parametrize("motion", ["shaken", "turned"])
def test_balls_at_a_mesh_of_a_box_as_at_the_box(motion, side):
    moved, vessel = MOTIONS[motion], [] if side == "inside" else [swarm.Sphere(0.9)]
    particles = start((0.0 if side == "inside" else 0.55, 0.0, 0.0), 0.04)
    solids = cube(side, motion=moved), swarm.Box(3 * (HALF,), side=side, motion=moved)
    same(*(run([*vessel, one], particles, 0.4, DOWN) for one in solids), 2)


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.2, -0.3, 1.0)], ids=["upright", "tilted"])
@pytest.mark.parametrize("motion", list(MOTIONS))
def test_in_a_prism_as_between_its_planes(motion, axis):
    prism, planes = regular(axis=axis, motion=MOTIONS[motion])
    for radius in (None, 0.04):
        same(*(run(walls, start(radius=radius), 0.8, DOWN) for walls in ([prism], planes)), 5)


@pytest.mark.parametrize("radius", [None, 0.05])
def test_in_a_stadium_that_moves(radius):
    """In uniform translation it is the stadium at rest, seen from a frame that moves."""
    shift = np.array([[0.3], [-0.2], [0.1]])
    lids, particles = swarm.Slab((0.0, 0.0, 1.0), 0.5), start(radius=radius)
    still = run([swarm.Stadium(0.3, 0.4), lids], particles, 1.0)
    moved = swarm.Translation(tuple(shift[:, 0].tolist()))
    carried = swarm.Particles(particles.position, particles.velocity + shift, radius=radius)
    walls = swarm.Stadium(0.3, 0.4, motion=moved), swarm.Slab((0.0, 0.0, 1.0), 0.5, motion=moved)
    one = run(walls, carried, 1.0)
    assert one.particles.position - 1.0 * shift == pytest.approx(still.particles.position, abs=1e-11)
    spun = swarm.Stadium(0.3, 0.4, motion=swarm.Rotation((0.0, 0.0, 1.0), 7.0))
    seen = run([spun, lids], particles, 1.0, every=0.1).observables
    assert seen["impacts"][-1] >= 5
    assert drift(seen) <= 1e-13
    assert seen["max_penetration"].max() <= 1e-14


@pytest.mark.parametrize("made", ["mesh", "prism"])
def test_none_leaves_through_the_edges_of_what_turns_fast(made):
    """Particles start in its corners, and fly along its faces."""
    spin = swarm.Rotation((0.3, 0.2, 1.0), 40.0, (0.02, 0.0, 0.0))
    corners = (HALF - 1e-9) * CUBE
    along = np.roll(CUBE, 1, axis=1) - CUBE
    particles = swarm.Particles(corners.T, along.T)
    square = [(-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF)]
    wall = cube(motion=spin) if made == "mesh" else swarm.Prism(square, 2.0 * HALF, motion=spin)
    ran = run([wall], particles, 0.08, every=0.02)
    seen, box = ran.observables, swarm.Box(3 * (HALF,), motion=spin)
    assert seen["impacts"][-1] >= 40
    assert box.phi(ran.particles.position, 0.08).max() <= 1e-14
    assert drift(seen) <= 1e-13


@pytest.mark.parametrize("laws", [{"restitution": 0.9, "friction": 0.2}, {"temperature": 1.0}], ids=["rough", "hot"])
def test_its_laws_act_in_its_frame(laws):
    pair = cube(motion=TURNED, **laws), swarm.Box(3 * (HALF,), motion=TURNED, **laws)
    one, other = (run([wall], start(), 0.4) for wall in pair)
    assert drift(one.observables) <= 1e-13
    assert one.observables["wall_work"][-1].sum() != 0.0
    if "temperature" not in laws:
        assert one.particles.position == pytest.approx(other.particles.position, abs=1e-11)


@pytest.mark.parametrize("motion", [LED, swarm.Oscillation((0.02, 0.0, 0.0), 1.5)], ids=["led", "shaken"])
def test_what_rests_on_a_thin_mesh_looks_for_no_wall_behind_it(monkeypatch, motion):
    """The planes of the other faces are never met, however far the mesh goes in a step; looks are counted."""
    looks, arrival = [], crossing.arrival
    monkeypatch.setattr(crossing, "arrival", lambda *given: looks.append(1) or arrival(*given))
    how = {"motion": motion, "friction": 0.8, "restitution": 0.2}
    thin, still = HALF * CUBE * (1.0, 1.0, 0.05), [0.0, 0.0]
    dropped = swarm.Particles([[0.02, -0.1], [0.01, 0.15], [0.016, 0.02]], [still, still, still])
    solids = (
        swarm.Mesh(thin, TRIANGLES, "outside", **how),
        swarm.Box((HALF, HALF, 0.05 * HALF), side="outside", **how),
    )
    one, other = (run([swarm.Sphere(0.9), solid], dropped, 0.12, DOWN, every=0.06) for solid in solids)
    assert len(looks) <= 10
    assert one.observables["sliding"][-1] == 2
    same(one, other, 2)


def drum(corners=24, radius=0.04, half=0.05):
    """The vertices and triangles of a prism on a regular polygon, with a vertex of each floor in its middle."""
    angles = 2.0 * np.pi * np.arange(corners) / corners
    rings = [np.array([radius * np.cos(angles), radius * np.sin(angles), np.full(corners, z)]).T for z in (-half, half)]
    triangles = []
    for k in range(corners):
        a, b = k, (k + 1) % corners
        c, d = corners + a, corners + b
        triangles += [(a, b, d), (a, d, c), (2 * corners, b, a), (2 * corners + 1, c, d)]
    return np.concatenate([*rings, [(0.0, 0.0, -half), (0.0, 0.0, half)]]), triangles


def test_a_slide_from_a_vertex_of_a_drum_that_turns_ends_on_its_facets():
    """They meet at 165 degrees, so the velocity of the vertex is no sum that converges soon.

    The place that a step ends at is below the floor, where the side facet is not; on the floor it is outside that one.
    """
    turned = swarm.Rotation((0.0, 1.0, 0.0), 4.0, (-0.4, 0.0, 0.0))
    mesh, vertex = swarm.Mesh(*drum(), motion=turned), vec([0.04, 0.0, -0.05])
    walls = swarm.Scene([mesh]).compiled().walls().at(0.0)
    number = walls.numbers_near(vertex)
    depth = np.array([walls.distance(wall, vertex) for wall in number])
    touched = depth >= -1e-12
    assert touched.sum() >= 5
    u = np.array(touching._frame_of(walls, number, touched, vertex))
    assert u == pytest.approx(np.cross((0.0, 4.0, 0.0), (0.44, 0.0, -0.05)), rel=1e-13)
    sine, cosine = np.sin(np.pi / 24), np.cos(np.pi / 24)
    beside = vertex + vec([7e-12 * cosine - 4e-7 * sine, -7e-12 * sine - 4e-7 * cosine, -1e-11])
    floor = float(number[[abs(walls.unit_normal(wall, vertex).z) > 0.9 for wall in number] & touched][0])
    active = np.ones(number.size)
    touch = Touch(number, touched, np.zeros((3, number.size)), active, depth, vec(u))
    end = touching._settled(walls, floor, touch, beside, 5e-12)
    assert max(walls.distance(wall, end) for wall in number[touched]) <= 5e-12


def test_a_step_in_a_corner_that_turns_ends_in_the_corner():
    """Straight in the scene it ended half its acceleration times h^2 outside, beyond the edges of all facets there."""
    rate, h = 0.3, 1e-3
    mesh = cube(motion=swarm.Rotation((0.2, 0.1, 1.0), rate, (0.02, 0.0, 0.0)))
    walls = swarm.Scene([mesh]).compiled().walls()
    corner = vec(-HALF * np.ones(3))
    u = walls.at(h).velocity(0.0, corner)
    end = touching._end_of_step(walls, True, 0.0, corner, u, (h, 0.0))
    turned = drive_of(mesh, h).pose(0.0).place_out(vec((0.02, 0.0, 0.0)), corner)
    assert list(end) == pytest.approx(list(turned), abs=1e-16)
    assert 1e-8 < float(norm(end - (corner + h * u))) < rate * rate * h * h


def test_its_distance_is_that_of_a_time():
    points = np.random.default_rng(6).uniform(-0.5, 0.5, (3, 40))
    box, square = swarm.Box(3 * (HALF,), motion=TURNED), [(-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF)]
    inside = box.phi(points, 0.7) < 0.0
    for one in (cube(motion=TURNED), swarm.Prism(square, 2.0 * HALF, motion=TURNED)):
        assert one.phi(points, 0.7)[inside] == pytest.approx(box.phi(points, 0.7)[inside])
        assert one.gradient(points, 0.7)[:, inside] == pytest.approx(box.gradient(points, 0.7)[:, inside])
    assert inside.sum() > 3


def test_the_bound_of_a_jerk_along_a_normal_does_not_depend_on_the_frame_of_a_body():
    """Of the cap of a tilted cylinder, whose normal is along the axis of its own frame."""
    motion = swarm.Oscillation((0.1, 0.0, 0.0), 3.0) + swarm.Rotation((1.0, 0.0, 0.0), 2.0, (0.0, 0.5, 0.0))
    drive = drive_of(cube(motion=motion), 0.0)
    r, v, a = vec([0.1, 0.2, 0.3]), vec([1.0, 0.5, 0.2]), vec([0.0, 0.1, -1.0])
    seen = InWallFrame(drive, r, v, a, 1.2, 0.4, 9.81, 1.0)
    # The own z axis is along x, x along y, y along z.
    turned = Rotated(PlaneNumbers(Vec(0.0, 0.0, 1.0), 0.5), Vec(0.0, 0.0, 1.0), Vec(1.0, 0.0, 0.0), Vec(0.0, 1.0, 0.0))
    wanted = PlaneNumbers(Vec(1.0, 0.0, 0.0), 0.5).moving_step(seen, 1.0)
    assert turned.moving_step(seen, 1.0) == pytest.approx(wanted, rel=1e-14)


@pytest.mark.parametrize("swings", [False, True])
def test_a_flight_in_the_frame_of_a_mesh_that_turns_is_a_cubic_but_for_the_rest_of_its_jerk(swings):
    turn = swarm.Rotation((1.0, -2.0, 0.5), 1.3, (0.1, 0.2, -0.3))
    motion = turn + swarm.Oscillation((0.1, 0.0, 0.05), 0.4) if swings else turn
    drive = drive_of(cube(motion=motion), 2.0)
    free = flight_of(vec([0.1, 0.2, 0.3]), vec([1.0, 0.5, -0.2]), Gravity(*DOWN), 1.7)
    wall = moving.TurningWall(None, drive)
    now = wall.seen(free, 0.0)
    assert now.jerk(0.0).rest == drive.jerk
    for t in (0.01, 0.1, 0.3):
        jerk = now.jerk(t)
        off = np.linalg.norm(np.array(wall.seen(free, t).r) - np.array(now.place(t, jerk)))
        assert off <= jerk.off * t**3 / 6.0 + 1e-14
        assert jerk.off <= jerk.rest < now.bounds(t).jerk


@pytest.mark.parametrize("motion", ["shaken", "turned", "all"])
def test_a_ball_comes_to_a_triangle_that_moves_in_few_safe_steps(motion):
    """None leads into it, and near its faces, edges and corners each doubles the digits at least."""
    random, counts = np.random.default_rng(7), []
    drive = drive_of(cube(motion=MOTIONS[motion]), 2.0)
    for _flight in range(60):
        corners, aim = random.uniform(-0.3, 0.3, (3, 3)), random.dirichlet(np.ones(3))
        a, b, c = map(vec, corners)
        body = RoundTriangle(a, b - a, c - a, 0.05)
        wall = (moving.Moving if drive.turn is None else moving.TurningWall)(body, drive)
        r = random.uniform(-0.7, 0.7, 3)
        free = flight_of(vec(r), vec(2.0 * (aim @ corners - r)), Gravity(0.0, 0.0, -1.0), 2.0)
        t, known = 0.0, []
        while t < 1.0 and len(known) < 40:
            step = body.moving_step(wall.seen(free, t), 1.0 - t).time
            gaps = [body.phi(wall.seen(free, t + part * step).r) for part in (0.3, 0.7, 0.9, 1.0)]
            assert min(gaps) >= -1e-14
            known.append(step)
            t += step
            if gaps[-1] <= 1e-14:
                counts.append(len(known))
                break
    assert len(counts) > 20
    assert max(counts) <= 12


@pytest.mark.long
@pytest.mark.parametrize("side", ["inside", "outside"])
@pytest.mark.parametrize("gravity", [None, DOWN], ids=["straight", "falling"])
@pytest.mark.parametrize("rate", [8.0, 40.0, 200.0])
def test_none_leaves_through_hundreds_of_impacts(rate, gravity, side):
    spin = swarm.Rotation((0.3, 0.2, 1.0), rate, (0.05, 0.0, 0.0))
    random = np.random.default_rng(3)
    places = 0.25 * random.uniform(-1.0, 1.0, (3, 64))
    places[:, :8] = (HALF - 1e-9) * CUBE.T
    if side == "outside":
        places = 0.4 * places + np.array([[0.9], [0.2], [0.0]])
    vessel = [] if side == "inside" else [swarm.Sphere(1.2)]
    scene = swarm.Scene([*vessel, cube(side, motion=spin)], gravity)
    ran = swarm.simulate(scene, swarm.Particles(places, random.standard_normal((3, 64))), until=4.0, every=0.1)
    sign = 1.0 if side == "inside" else -1.0
    assert (sign * swarm.Box(3 * (HALF,), motion=spin).phi(ran.particles.position, 4.0)).max() <= 1e-13
    assert drift(ran.observables) <= 1e-13
    assert ran.observables["impacts"][-1] >= 300


# --- Soft grains -----------------------------------------------------------------------------------------


def grains(surfaces, until, particles, dt=1e-3, **options):
    scene, method = swarm.Scene(surfaces, DOWN), swarm.Penalty(dt=dt, penalty=1e5)
    return swarm.simulate(scene, particles, method, until=until, every=0.5 * until, compile="never", **options)


def soft(side="inside"):
    return start((0.0, 0.0, -0.12) if side == "inside" else (0.46, 0.0, 0.0), 0.04)


@pytest.mark.parametrize("laws", [{}, {"restitution": 0.7}], ids=["elastic", "damped"])
@pytest.mark.parametrize("motion", list(MOTIONS))
def test_grains_in_a_mesh_as_in_the_box(motion, laws):
    how = {"motion": MOTIONS[motion], **laws}
    one, other = (grains([wall], 0.15, soft()) for wall in (cube(**how), swarm.Box(3 * (HALF,), **how)))
    assert one.particles.position == pytest.approx(other.particles.position, abs=1e-11)
    seen, wanted = one.observables, other.observables
    assert seen["impacts"][-1] == wanted["impacts"][-1] >= 2
    assert seen["wall_work"][-1].sum() == pytest.approx(wanted["wall_work"][-1].sum(), abs=1e-10)
    assert drift(seen) <= 1e-13


@pytest.mark.parametrize("made", ["mesh", "boxes"])
def test_grains_beside_a_field_that_turns_as_beside_the_box(made):
    field = cube("outside", motion=TURNED) if made == "mesh" else swarm.Boxes([3 * [0.0]], 3 * (HALF,), motion=TURNED)
    box = swarm.Box(3 * (HALF,), side="outside", motion=TURNED)
    thrown = swarm.Particles(
        [[0.4, 0.05], [0.1, 0.45], [0.0, 0.05]], [[-2.0, 0.2], [0.1, -2.5], [1.0, 0.5]], radius=0.04
    )
    one, other = (grains([swarm.Sphere(0.9), wall], 0.1, thrown) for wall in (field, box))
    assert one.particles.position == pytest.approx(other.particles.position, abs=1e-11)
    assert one.observables["wall_work"][-1].sum() != 0.0
    assert drift(one.observables) <= 1e-13


def test_grains_in_a_prism_as_between_its_planes():
    prism, planes = regular(motion=TURNED + SHAKEN)
    one, other = (grains(walls, 0.2, soft()) for walls in ([prism], planes))
    assert one.particles.position == pytest.approx(other.particles.position, abs=1e-11)
    assert drift(one.observables) <= 1e-13


def test_grains_beside_a_field_at_rest_in_a_vessel_that_moves():
    """The field is the same as in a run where nothing moves, in uniform translation of all."""
    pegs = np.array([[0.0, 0.0, -0.25], [0.2, 0.0, -0.2]])
    particles, shift = soft(), np.array([[0.3], [-0.2], [0.0]])
    drift_on = swarm.Translation(tuple(shift[:, 0].tolist()))
    still = grains([swarm.Box(3 * (HALF,)), swarm.Spheres(pegs, 0.05)], 0.2, particles)
    carried = swarm.Particles(particles.position, particles.velocity + shift, radius=0.04)
    field = swarm.Spheres(pegs, 0.05, motion=drift_on)
    one = grains([swarm.Box(3 * (HALF,), motion=drift_on), field], 0.2, carried)
    assert one.particles.position - 0.2 * shift == pytest.approx(still.particles.position, abs=1e-10)
    shaken = grains([swarm.Box(3 * (HALF,), motion=SHAKEN), swarm.Spheres(pegs, 0.05)], 0.2, particles)
    assert shaken.observables["wall_work"][-1, 1] == 0.0
    assert drift(shaken.observables) <= 1e-13


def test_lists_hold_for_a_wall_that_comes_from_far():
    """A paddle strikes a ball at rest which was nowhere near it when it was listed, as the box does."""
    spin = swarm.Rotation((0.0, 0.0, 1.0), 8.0)
    paddle = HALF * CUBE * (1.0, 0.1, 0.3)
    mesh = swarm.Mesh(paddle, TRIANGLES, "outside", motion=spin)
    box = swarm.Box((HALF, 0.1 * HALF, 0.3 * HALF), side="outside", motion=spin)
    still = swarm.Particles([0.0, 0.25, 0.0], [0.0, 0.0, 0.0], radius=0.03)
    scenes = [swarm.Scene([swarm.Sphere(0.9), wall]) for wall in (mesh, box)]
    method = swarm.Penalty(dt=5e-4, penalty=1e5)
    one, other = (swarm.simulate(one, still, method, until=0.25, every=0.05, compile="never") for one in scenes)
    assert one.observables["impacts"][-1] == 1
    assert one.particles.position == pytest.approx(other.particles.position, abs=1e-11)


def test_a_paddle_that_jumps_over_a_ball_in_one_step_is_refused():
    spin = swarm.Rotation((0.0, 0.0, 1.0), 100.0)
    mesh = swarm.Mesh(HALF * CUBE * (1.0, 0.02, 0.3), TRIANGLES, "outside", motion=spin)
    still = swarm.Particles([0.0, 0.25, 0.0], [0.0, 0.0, 0.0], radius=0.01)
    with pytest.raises(swarm.RunError, match=r"the step at .* failed at particle 0"):
        swarm.simulate(
            swarm.Scene([swarm.Sphere(0.9), mesh]), still, swarm.Penalty(dt=1e-3, penalty=1e3), until=0.1,
            compile="never",
        )  # fmt: skip


def test_a_mesh_that_turns_and_comes_for_a_time():
    """Steps are of another length in each piece of a frame, and lists are of each."""
    how = {"motion": TURNED, "present": [(0.0313, 0.1)]}
    one, other = (
        grains([swarm.Sphere(0.9), wall], 0.2, soft("outside"))
        for wall in (cube("outside", **how), swarm.Boxes([3 * [0.0]], 3 * (HALF,), **how))
    )
    assert one.particles.position == pytest.approx(other.particles.position, abs=1e-11)


@pytest.mark.parametrize("others", [False, True])
@pytest.mark.parametrize("gravity", [None, (0.0, 1.0, -2.0)])
@pytest.mark.parametrize(
    "motion",
    [
        *(pytest.param(one, id=str(one)) for one in (TURNED, swarm.Rotation((0.3, 0.0, 1.0), 12.0), TURNED + SHAKEN)),
        pytest.param(LED, id="led"),
        pytest.param(TURNED + LED, id="turned and led"),
    ],
)
def test_lanes_that_leap_through_cells_meet_what_safe_steps_one_by_one_meet(motion, gravity, others, monkeypatch):
    block = swarm.Mesh(0.05 * CUBE, TRIANGLES, "outside", motion=motion)
    walls = [cube(motion=motion), block, *([swarm.Sphere(0.4)] if others else [])]
    particles = start()
    in_lanes = run(walls, particles, 1.0, gravity)
    monkeypatch.setattr(moving, "Leaping", moving.Marched)
    same(in_lanes, run(walls, particles, 1.0, gravity), impacts=6)


@pytest.mark.parametrize("away", [3e-15, 1e-14, 1e-12])
def test_a_particle_that_lets_go_of_a_facet_that_turns_flies_on(away, monkeypatch):
    """Its velocity and its acceleration along the normal are 0: for long it is nearer to the facet than a bound tells.

    It moves along the facet at -rate HALF/2, where the Coriolis and the centrifugal acceleration cancel; the third
    derivative, 2 rate^3 y, takes it away.
    """
    rate, y, flights, found = 3.0, -0.1, [], flight.go_through_moving

    def counted(*given):
        flights.append(1)
        assert len(flights) <= 4
        found(*given)

    monkeypatch.setattr(flight, "go_through_moving", counted)
    particle = swarm.Particles([[HALF], [y], [0.01]], [[-rate * y - away], [0.5 * rate * HALF], [0.05]])
    run([cube(motion=swarm.Rotation((0.0, 0.0, 1.0), rate))], particle, 0.3)


def test_a_contact_that_lasts_on_a_mesh_that_turns_compiles():
    """A kernel may know the number of its wall, but not how many triangles are before others."""
    block = swarm.Mesh(
        (0.05, 0.05, 0.01) * CUBE, TRIANGLES, "outside", motion=swarm.Rotation((0, 1, 0), 1.0), restitution=0.4
    )
    scene = swarm.Scene([swarm.Box((0.2, 0.12, 0.2), restitution=0.4), block], DOWN)
    start = swarm.Particles([[0.0, 0.03], [0.0, 0.03], [0.03, 0.04]], np.zeros((3, 2)))
    ends = [swarm.simulate(scene, start, swarm.Impact(), until=0.5, compile=tier) for tier in ("always", "never")]
    assert ends[0].observables["sliding_time"][-1] > 0.0
    assert ends[0].particles.position.tolist() == ends[1].particles.position.tolist()


def test_what_rests_in_a_corner_of_a_mesh_that_turns_is_carried():
    """With friction too: its walls are of one body, along none of which it slips, and they end in the corner."""
    center, vertex, diagonal = (0.02, 0.0, 0.0), (-HALF, -HALF, -HALF), np.ones(3)
    mesh = cube(motion=swarm.Rotation((0.2, 0.1, 1.0), 0.3, center), restitution=0.5, friction=0.3)
    particle = swarm.Particles(vertex + 0.01 * diagonal, (0.0, 0.0, 0.0))
    result = run([mesh], particle, 1.0, tuple((-9.81 * diagonal).tolist()), every=0.25)
    seen = result.observables
    assert seen["impacts"][-1] == seen["impacts"][2] < 100
    assert np.diff(seen["sliding_time"])[2:] == pytest.approx(0.25, rel=1e-12)
    turned = drive_of(mesh, 1.0).pose(0.0).place_out(vec(center), vec(vertex))
    assert result.particles.position[:, 0] == pytest.approx(list(turned), abs=1e-14)
    assert drift(seen) <= 1e-14
