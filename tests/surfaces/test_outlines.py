"""Outlines of lines and arcs: what they are, flights between their sides, slides along them, and bad input."""

import math
import tomllib

import numpy as np
import pytest
import tomli_w

import swarm
from swarm.kernel.gravity import Gravity
from swarm.kernel.vector import Vec, vec
from swarm.run.base import BaseRun
from swarm.serialization import tables
from swarm.surfaces import ALL_SURFACES
from swarm.surfaces.outlines.outline import Outline
from swarm.surfaces.time_of_impact import flights
from swarm.surfaces.walls import penetration

L = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
CURVED = [(0, 0), (2, 0, -0.4), (2, 1), (1, 1, 0.6), (1, 2, -0.3), (0, 2)]
BULB = [(-0.2, -1), (0.2, -1), (0.2, 0, 4.0), (-0.2, 0)]
CIRCLE = [(-1, 0, 1), (1, 0, 1)]
OUTLINES = {"L": L, "curved": CURVED, "bulb": BULB, "circle": CIRCLE}


def spiky(seed, sides):
    """A star with so many sides, of which most are arcs; some turn outwards, some inwards."""
    rng = np.random.default_rng(seed)
    angle = 2.0 * math.pi * (np.arange(sides) + rng.uniform(-0.25, 0.25, sides)) / sides
    radius = rng.uniform(0.6, 1.0, sides)
    bulge = rng.uniform(-0.25, 0.25, sides) * (rng.random(sides) < 0.7)
    return [(r * math.cos(a), r * math.sin(a), b) for r, a, b in zip(radius, angle, bulge, strict=True)]


def brute(outline, position, velocity):
    """When a straight flight from inside leaves an outline: by centres of circles and angles of arcs, another way."""
    soonest = math.inf
    rows = outline.rows[::-1] if outline.turned else outline.rows
    n = len(rows)
    for k in range(n):
        bulge = -outline.rows[(n - 2 - k) % n][2] if outline.turned else rows[k][2]
        a, b = np.array(rows[k][:2]), np.array(rows[(k + 1) % n][:2])
        if bulge == 0.0:
            way = np.linalg.solve(np.array([velocity, a - b]).T, a - position)
            if way[0] > 1e-9 and -1e-12 <= way[1] <= 1.0 + 1e-12:
                soonest = min(soonest, way[0])
            continue
        chord = b - a
        middle = 0.5 * (a + b) + (1.0 - bulge * bulge) / (4.0 * bulge) * np.array([-chord[1], chord[0]])
        radius2 = ((a - middle) ** 2).sum()
        d = position - middle
        p, q = d @ velocity / (velocity @ velocity), (d @ d - radius2) / (velocity @ velocity)
        if p * p > q:
            first = math.atan2(*(a - middle)[::-1])
            span = 4.0 * math.atan(bulge)
            for t in (-p - math.sqrt(p * p - q), -p + math.sqrt(p * p - q)):
                turn = (math.atan2(*(d + t * velocity)[::-1]) - first) * math.copysign(1.0, span) % (2.0 * math.pi)
                if t > 1e-9 and turn <= abs(span) + 1e-12:
                    soonest = min(soonest, t)
    return soonest


def first_hit(walls, gravity, r, v):
    with np.errstate(all="ignore"):
        return flights.first_hit(walls, gravity, r, v)


def scene_of(rows, **options):
    surface = swarm.Polygon(rows, **{name: options.pop(name) for name in ("side", "restitution") if name in options})
    return swarm.Scene([surface, *options.pop("more", [])], plane="z", **options)


def run(scene, particles, until, **options):
    return swarm.simulate(scene, particles, swarm.Impact(), until=until, **{"compile": "never", **options})


# --- What they are ---------------------------------------------------------------------------------------


def test_areas_and_lengths():
    stadium = swarm.Stadium(0.5, 1.5)
    assert stadium.area() == pytest.approx(1.5 + math.pi / 4.0, rel=1e-15)
    assert stadium.perimeter() == pytest.approx(3.0 + math.pi, rel=1e-15)
    assert (swarm.Polygon(L).area(), swarm.Polygon(L).perimeter()) == (3.0, 8.0)
    assert swarm.Polygon(CIRCLE).area() == pytest.approx(math.pi, rel=1e-15)
    bulb = swarm.Polygon(BULB)
    # An arc of more than half a circle is two walls.
    assert len(bulb) == 5
    angle = 4.0 * math.atan(4.0)
    radius = 0.2 / math.sin(angle / 2.0)
    assert bulb.area() == pytest.approx(0.4 + 0.5 * radius**2 * (angle - math.sin(angle)), rel=1e-13)


@pytest.mark.parametrize("name", OUTLINES)
def test_they_are_the_same_either_way_round(name):
    rows = Outline("v", OUTLINES[name]).rows
    back = [(x, y, -rows[k - 1][2]) for k, (x, y, _bulge) in enumerate(rows)][::-1]
    points = np.random.default_rng(1).uniform(-2.0, 2.5, (2, 500))
    one, other = Outline("v", rows), Outline("v", back)
    assert (one.turned, other.turned) == (False, True)
    assert one.area() == pytest.approx(other.area(), rel=1e-14)
    assert np.allclose(one.nearest(points)[0], other.nearest(points)[0], rtol=1e-12, atol=1e-13)


def test_phi_is_the_distance_and_its_gradient_a_unit_vector():
    points = np.random.default_rng(0).uniform(-3.0, 3.0, (3, 20_000))
    x, y, _z = points
    straight = np.where(np.abs(x) <= 1.0, np.abs(y), np.hypot(np.abs(x) - 1.0, y)) - 1.0
    stadium = swarm.Stadium(1.0, 2.0)
    assert np.abs(stadium.phi(points) - straight).max() < 1e-14
    for rows in OUTLINES.values():
        surface = swarm.Polygon(rows)
        gradient = surface.gradient(points)
        assert np.abs((gradient**2).sum(axis=0) - 1.0).max() < 1e-13
        step = 1e-6 * gradient
        slope = (surface.phi(points + step) - surface.phi(points - step)) / 2e-6
        # But where two sides are as near.
        assert np.quantile(np.abs(slope - 1.0), 0.999) < 1e-8
    inside = (points[:2] > 0.0).all(axis=0) & (points[:2] < 2.0).all(axis=0) & ~(points[:2] > 1.0).all(axis=0)
    assert ((swarm.Polygon(L).phi(points) < 0.0) == inside).all()


@pytest.mark.parametrize(
    "surface",
    [
        swarm.Polygon(CURVED, axis=(1, 2, 3), center=(0.1, 0.2, 0.3), side="outside", restitution=0.5),
        swarm.Prism(L, 2.0, rotation={"axis": (1, 0, 2), "angle": 0.3}, temperature=1.0),
        swarm.Stadium(0.3, 1.0, axis=(0, 1, 0), friction=0.2),
    ],
    ids=lambda surface: type(surface).__name__,
)
def test_a_surface_is_made_again_by_its_repr_and_by_its_table(surface):
    table = tomllib.loads(tomli_w.dumps(tables.table_of(surface)))
    for again in (eval(repr(surface), vars(swarm)), tables.of_kind(table, "surface", ALL_SURFACES)):
        assert again == surface
        assert hash(again) == hash(surface)
        assert (again.members.table == surface.members.table).all()


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 2, 3)])
def test_it_stands_along_its_axis(axis):
    surface = swarm.Polygon(CURVED, axis=axis, center=(0.3, -0.2, 0.1))
    frame = surface.frame
    assert np.allclose(frame @ frame.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(frame) == pytest.approx(1.0, rel=1e-14)
    own = np.random.default_rng(0).uniform(-1.0, 3.0, (3, 200))
    placed = frame @ own + np.array([[0.3], [-0.2], [0.1]])
    assert np.allclose(surface.phi(placed), swarm.Polygon(CURVED).phi(own), atol=1e-13)


# --- Flights ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*OUTLINES, "star", "many"])
def test_every_flight_ends_where_brute_force_says(name):
    rows = OUTLINES.get(name) or spiky(*((1, 9) if name == "star" else (2, 40)))
    scene = scene_of(rows)
    start = swarm.fill(scene, 100, speed=1.0, seed=4)
    outline, walls = scene.surfaces[0].boundary, scene.compiled().walls()
    for r, v in zip(start.position.T, start.velocity.T, strict=True):
        place, time, wall = vec(r), 0.0, -1.0
        while wall < 0.0:
            hit = first_hit(walls, None, place, vec(v))
            place, time, wall = place + hit.time * vec(v), time + hit.time, hit.wall
        assert time == pytest.approx(brute(outline, r[:2], v[:2]), rel=1e-12)


@pytest.mark.parametrize("name", OUTLINES)
def test_a_fall_ends_where_small_steps_say(name):
    scene = scene_of(OUTLINES[name], gravity=(0.3, -1.0, 0.0))
    start = swarm.fill(scene, 40, speed=1.0, seed=4)
    surface, walls, pull = scene.surfaces[0], scene.compiled().walls(), Gravity(0.3, -1.0, 0.0)
    for r, v in zip(start.position.T, start.velocity.T, strict=True):
        hit = first_hit(walls, pull, vec(r), vec(v))
        assert hit.wall >= 0.0
        t = np.linspace(0.0, 1.0, 4001) * hit.time
        path = r[:, None] + v[:, None] * t + 0.5 * np.array([[0.3], [-1.0], [0.0]]) * t * t
        phi = surface.phi(path)
        assert phi[:-1].max() <= 1e-13
        assert abs(phi[-1]) < 1e-13


def test_a_rectangle_is_a_box():
    rectangle = scene_of([(-0.6, -0.4), (0.6, -0.4), (0.6, 0.4), (-0.6, 0.4)])
    box = swarm.Scene([swarm.Box((0.6, 0.4, 1.0))], plane="z")
    start = swarm.fill(box, 20, speed=1.0, seed=1)
    one, other = run(rectangle, start, 10.0), run(box, start, 10.0)
    assert (one.impacts_per_particle == other.impacts_per_particle).all()
    assert np.abs(one.particles.position - other.particles.position).max() < 1e-13


@pytest.mark.parametrize("seed", range(3))
def test_the_mean_free_path_is_pi_times_the_area_over_the_length(seed):
    surface = swarm.Polygon(spiky(seed, 8))
    scene = swarm.Scene([surface], plane="z")
    start = swarm.fill(scene, 4000, speed=1.0, seed=seed)
    result = swarm.simulate(scene, start, swarm.Impact(), until=50.0)
    each = result.impacts_per_particle / 50.0
    rate, error = each.mean(), each.std() / math.sqrt(len(each))
    assert abs(rate - surface.perimeter() / (math.pi * surface.area())) < 3.0 * error
    assert result.observables["max_penetration"].max() < 1e-15
    assert scene.gaps(result.particles.position).max() < 1e-15


def test_flights_aimed_at_corners_stay_inside():
    for rows in (L, CURVED, spiky(3, 9)):
        scene = scene_of(rows)
        start = swarm.fill(scene, 60, speed=1.0, seed=2)
        corners = scene.surfaces[0].boundary.sides.start
        aim = corners[np.arange(60) % len(corners)]
        way = np.vstack([aim.T - start.position[:2], np.zeros(60)])
        start.velocity = way / np.sqrt((way**2).sum(axis=0))
        end = run(scene, start, 6.0)
        assert scene.gaps(end.particles.position).max() < 1e-14
        assert end.observables["energy_error"].max() < 1e-14


def test_around_a_solid_and_in_a_ring():
    ring = scene_of(CIRCLE, more=[swarm.Polygon([(0.3, 0.0, -0.5), (-0.2, 0.3), (-0.2, -0.3)], side="outside")])
    start = swarm.fill(ring, 30, speed=1.0, seed=2)
    end = run(ring, start, 10.0)
    assert ring.gaps(end.particles.position).max() < 1e-15
    assert (end.observables["impulse"][-1] > 0.0).all()


@pytest.mark.parametrize("name", OUTLINES)
def test_a_point_is_as_deep_as_it_is_outside_of_a_prism(name):
    """However near it is to the plane of a lid, or to a side, which it is behind."""
    prism = swarm.Prism(OUTLINES[name], 2.0)
    points = np.random.default_rng(3).uniform(-4.0, 4.0, (3, 200))
    walls = swarm.Scene([prism]).compiled().walls()
    deep = [penetration(walls, Vec(*point)) for point in points.T.tolist()]
    np.testing.assert_allclose(deep, np.maximum(prism.phi(points), 0.0), rtol=0.0, atol=1e-13)


def test_a_run_that_loses_a_ball_outside_of_a_prism_ends_with_a_sentence(monkeypatch):
    advance = BaseRun.advance

    def lose(run, *given, **options):
        done = advance(run, *given, **options)
        run.state.position[:, 0] = (0.5, 0.5, 1.5)
        return done

    monkeypatch.setattr(BaseRun, "advance", lose)
    start = swarm.Particles((0.5, 0.5, 0.0), (0.1, 0.0, 0.0), radius=0.1)
    with pytest.raises(swarm.RunError, match=r"particle 0: it is 0\.6 m outside surfaces\[0\] \(Prism\)"):
        swarm.simulate(swarm.Scene([swarm.Prism(L, 2.0)]), start, swarm.Impact(), until=1.0, compile="never")


def test_a_prism_has_lids(compiled_at_once):
    for axis in ((0, 0, 1), (1, 2, 3)):
        prism = swarm.Prism(CURVED, 2.0, axis=axis, center=(0.1, 0.2, 0.3))
        scene = swarm.Scene([prism])
        start = swarm.fill(scene, 1500, speed=1.0, seed=1)
        assert start.volume == pytest.approx(2.0 * prism.area(), rel=0.01)
        result = swarm.simulate(scene, start, swarm.Impact(), until=40.0)
        each = result.impacts_per_particle / 40.0
        rate, error = each.mean(), each.std() / math.sqrt(len(each))
        surface = 2.0 * prism.area() + 2.0 * prism.perimeter()
        assert abs(rate - surface / (8.0 * prism.area())) < 3.0 * error
        assert scene.gaps(result.particles.position).max() < 1e-15


@pytest.mark.parametrize("lid", [-1.0, 1.0])
@pytest.mark.parametrize("corners", [5, 8, 40])
def test_a_fall_meets_the_lids_of_a_prism_however_many_sides_it_has(corners, lid):
    """What falls on a lid in a time T is back after 2 T."""
    angles, height, pull = 2.0 * np.pi * np.arange(corners) / corners, 0.01, lid * 9.81
    prism = swarm.Prism(np.stack([np.cos(angles), np.sin(angles)], axis=1), 2.0)
    time, start = math.sqrt(2.0 * height / 9.81), (0.1, 0.03, lid * (1.0 - height))
    result = swarm.simulate(
        swarm.Scene([prism], (0.0, 0.0, pull)), swarm.Particles(start, (0.0, 0.0, 0.0)), swarm.Impact(),
        until=2.0 * time, compile="never",
    )  # fmt: skip
    assert result.observables["impacts"][-1] == 1
    assert result.particles.position[:, 0] == pytest.approx(start, abs=1e-14)


# --- Slides ----------------------------------------------------------------------------------------------


def test_what_slides_over_a_smooth_joint_keeps_its_energy(compiled_at_once):
    """A bead in a stadium of frictionless walls swings from one arc over the line to the other."""
    scene = swarm.Scene([swarm.Stadium(1.0, 2.0, restitution=0.0)], gravity=(0.0, -1.0, 0.0), plane="z")
    height = 0.4
    bead = swarm.Particles([1.0 + math.sqrt(1.0 - (1.0 - height) ** 2), height - 1.0, 0.0], [0.0, 0.0, 0.0])
    result = swarm.simulate(scene, bead, swarm.Impact(), until=20.0, every=0.25)
    energy = result.observables["total_energy"]
    assert np.ptp(energy) < 1e-8
    assert result.observables["sliding"].max() == 1
    # From one side to the other in a quarter of a swing, the line, and a quarter again
    period = 4.0 * 1.0 * _quarter(2.0 * math.asin(math.sqrt(0.5 * height))) + 2.0 * 2.0 / math.sqrt(2.0 * height)
    half = swarm.simulate(scene, bead, swarm.Impact(), until=0.5 * period).particles.position[:, 0]
    assert half == pytest.approx([-bead.position[0, 0], height - 1.0, 0.0], abs=1e-6)


def _quarter(amplitude):
    """A quarter of the period of a pendulum of length and gravity 1, by the arithmetic and geometric mean."""
    a, b = 1.0, math.cos(0.5 * amplitude)
    for _k in range(20):
        a, b = 0.5 * (a + b), math.sqrt(a * b)
    return 0.5 * math.pi / a


def test_what_slides_flies_on_where_its_side_ends():
    """Off a table: then a parabola, to the floor 1 m below."""
    table = [(-2, 0), (0, 0), (0, -1), (3, -1), (3, 2), (-2, 2)]
    scene = scene_of(table, restitution=0.0, gravity=(0.0, -1.0, 0.0))
    bead = swarm.Particles([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    result = swarm.simulate(scene, bead, swarm.Impact(), until=1.0 + math.sqrt(2.0) - 1e-6)
    assert result.particles.position[:, 0] == pytest.approx([math.sqrt(2.0), -1.0, 0.0], abs=3e-6)
    assert result.particles.velocity[:, 0] == pytest.approx([1.0, -math.sqrt(2.0), 0.0], abs=3e-6)


def test_what_slides_into_a_corner_stays_there():
    scene = scene_of(L, restitution=0.0, gravity=(-0.5, -1.0, 0.0))
    start = swarm.Particles([1.5, 0.0, 0.0], [0.0, 0.0, 0.0])
    result = swarm.simulate(scene, start, swarm.Impact(), until=10.0)
    assert result.particles.position[:, 0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert not result.particles.velocity.any()


def test_grains_come_to_rest_in_front_of_a_thin_wall():
    """What is behind a side is in front of another one: nothing sticks there."""
    thin = [(0, 0), (3, 0), (3, 2), (0, 2), (0, 1.01), (2, 1.0), (2, 0.995), (0, 1.0)]
    scene = scene_of(thin, restitution=0.3, gravity=(0.0, -1.0, 0.0))
    start = swarm.fill(scene, 12, speed=1.0, seed=1)
    result = swarm.simulate(scene, start, swarm.Impact(), until=8.0)
    assert scene.gaps(result.particles.position).max() < 1e-14
    height, falls = result.particles.position[1], result.particles.velocity[1] < -0.1
    # But for particles that have just slid off the shelf
    assert ((height < 1e-9) | (height > 0.999) | falls).all()
    assert np.count_nonzero(falls) <= 1


# --- Bad input -------------------------------------------------------------------------------------------

BAD = {
    "no rows": (lambda: swarm.Polygon("abc"), ["vertices must be rows (x, y) or (x, y, bulge)", "'abc'"]),
    "a row": (lambda: swarm.Polygon([(0, 0), (1,), (0, 1)]), ["vertices[1] must be (x, y) or (x, y, bulge)"]),
    "no number": (lambda: swarm.Polygon([(0, 0), (1, math.nan), (0, 1)]), ["vertices[1][1] must be a finite number"]),
    "two": (lambda: swarm.Polygon([(0, 0), (1, 0)]), ["at least three vertices, or two and an arc, got 2"]),
    "twice": (lambda: swarm.Polygon([(0, 0), (1, 0), (1, 0), (0, 1)]), ["vertices[1] and vertices[2] must be apart"]),
    "no area": (lambda: swarm.Polygon([(0, 0), (1, 0), (2, 0)]), ["vertices must go round an area"]),
    "crossing": (
        lambda: swarm.Polygon([(0, 0), (2, 0), (2, 1), (0.5, -0.5), (0, 1)]),
        ["vertices must not cross itself", "sides 0 and 2", "(1, 0)"],
    ),
    "arcs that cross": (
        lambda: swarm.Prism([(0, 0), (1, 0, -1), (1, 1), (0.7, 0.5), (0, 1)], 1.0),
        ["outline must not cross itself", "sides 1 and 3"],
    ),
    "height": (lambda: swarm.Prism(L, 0.0), ["height must be above 0"]),
    "a solid prism": (lambda: swarm.Prism(L, 1.0, side="outside"), ['side must be "inside" for a Prism']),
    "radius": (lambda: swarm.Stadium(-1.0, 1.0), ["radius must be above 0"]),
    "length": (lambda: swarm.Stadium(1.0, -1.0), ["length must be 0 or more"]),
    "axis": (lambda: swarm.Polygon(L, axis=(0, 0, 0)), ["axis must not be of length 0"]),
    "mass": (lambda: swarm.Polygon(L, mass=-1.0), ["mass must be above 0"]),
    "an opening": (
        lambda: swarm.Scene([swarm.Sphere(1.0, openings=[swarm.Polygon(L)])]),
        ["openings[0] must be a volume", "got Polygon"],
    ),
    "over the cell": (
        lambda: swarm.Scene([swarm.Polygon(L)], period=(1.5, None, None)),
        ["must be within the cell", "period[0] = 1.5", "from 0 to 2"],
    ),
    "a soft wall": (
        lambda: swarm.simulate(scene_of(L), swarm.fill(scene_of(L), 1, speed=1.0), swarm.Verlet(1e-3, 1e4), until=1.0),
        ["surfaces[0] must not be Polygon with Verlet"],
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_a_sentence(case):
    make, parts = BAD[case]
    with pytest.raises(swarm.SceneError) as caught:
        make()
    assert all(part in str(caught.value) for part in parts), str(caught.value)


@pytest.mark.parametrize("rows", [L, CURVED, [(0, 0), (1, 0, 1.0)]], ids=["lines", "arcs", "half a disc"])
def test_a_ring_that_ends_at_its_first_vertex_is_the_same_outline(rows):
    """As shapely writes it: `swarm.Polygon(polygon.exterior.coords)`."""
    ring = [*rows, tuple(rows[0])[:2]]
    assert swarm.Polygon(ring) == swarm.Polygon(rows)
    assert swarm.Prism(ring, 1.0) == swarm.Prism(rows, 1.0)
    with pytest.raises(swarm.SceneError, match="must be apart"):
        swarm.Polygon([*rows, (*tuple(rows[0])[:2], 0.5)])
    with pytest.raises(swarm.SceneError, match="must be apart"):
        swarm.Polygon([*ring, ring[-1]])


# --- What holds an outline, and what balls meet of it ----------------------------------------------------


@pytest.mark.parametrize("name", OUTLINES)
def test_half_spaces_hold_an_outline_and_touch_it(name):
    outline = swarm.Polygon(OUTLINES[name], center=(0.3, -0.7, 1.1), axis=(1.0, 2.0, -2.0))
    low, high = outline.boundary.corners()
    low, high = low.min(axis=1), high.max(axis=1)
    plane = np.random.default_rng(3).uniform(low, high, (20_000, 2)).T
    points = outline.frame[:, :2] @ plane + np.array(outline.center)[:, None]
    points = points[:, outline.phi(points) <= 0.0]
    assert points.shape[1] > 1000
    spaces = outline.half_spaces()
    assert len(spaces) == 4
    for normal, offset in spaces:
        reach = np.array(normal) @ points - offset
        assert reach.max() <= 1e-14
        assert reach.max() > -0.03 * (high - low).max()


def test_sides_that_join_smoothly_are_one_face_of_balls_that_fit_into_them():
    stadium = swarm.Stadium(0.3, 0.8)
    assert len(set(stadium.faces_of_balls(0.2)[1])) == 1
    assert len(set(stadium.faces_of_balls(0.4)[1])) == len(stadium.boundary) == 4
    square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    assert len(set(swarm.Prism(square, 0.5).faces_of_balls(0.1)[1])) == 6
    # Around a square from outside, balls roll over the edges.
    assert len(set(swarm.Polygon(square, side="outside").faces_of_balls(0.1)[1])) == 1
