"""Sheets: triangles that are walls from both sides: impacts as at planes, none through, slides to the rim."""

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
import trimesh
from conftest import rarely
from energy_books import unbooked
from thorny import aimed, thorny

import swarm
from swarm import scene_file
from swarm.serialization import tables
from swarm.surfaces.facets.facet import OVERLAP, THIN

BOX = trimesh.creation.box((1.0, 1.0, 1.0))
DOWN = (0.3, -0.2, -1.0)
G = 9.81


def turned(faces, seed=5):
    """Triangles of which half are turned over."""
    faces = np.array(faces)
    over = np.random.default_rng(seed).random(len(faces)) < 0.5
    faces[over] = faces[over, ::-1]
    return faces


def tray(**given):
    """A box of 1 m without a lid."""
    vertices, faces = np.array(BOX.vertices), turned(BOX.faces)
    return swarm.Mesh(vertices, faces[~(vertices[faces][:, :, 2] == 0.5).all(axis=1)], open=True, **given)


def triangle(**given):
    return swarm.Mesh([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.5, 0.0]], [[0, 1, 2]], open=True, **given)


def plate(tilt, **given):
    """Two triangles of 2 m by 2 m that fall along x."""
    ends = (-1.0, 1.0)
    corners = np.array([[x * math.cos(tilt), y, -x * math.sin(tilt)] for x in ends for y in ends])
    return swarm.Mesh(corners, [[0, 1, 2], [2, 3, 1]], open=True, **given)


def gap(mesh):
    """How far the sides of a sheet are from it."""
    return THIN * mesh._room


def run(mesh, position, velocity, gravity=None, until=2.0, **given):
    scene = swarm.Scene([mesh], gravity)
    start = swarm.Particles(np.array(position, float), np.array(velocity, float))
    return swarm.simulate(scene, start, swarm.Impact(), **{"until": until, "compile": "never", **given})


# --- The description -------------------------------------------------------------------------------------


def test_phi_is_the_distance():
    mesh, box = tray(), swarm.Box((0.5, 0.5, 0.5), open=("+z",))
    points = np.random.default_rng(1).uniform(-0.5, 0.5, (3, 300))
    exact = -box.phi(points)
    assert np.abs(mesh.phi(points) + gap(mesh) - exact).max() < 1e-15
    step = 1e-6
    differences = [(mesh.phi(points + e) - mesh.phi(points - e)) / (2.0 * step) for e in step * np.eye(3)[:, :, None]]
    assert np.median(np.abs(mesh.gradient(points) - differences)) < 1e-9
    assert mesh.contain(points).all()
    assert (mesh.phi(np.array(BOX.vertices)[:4].T) < 0.0).all()
    assert gap(mesh) < 2e-11


def test_a_scene_of_sheets_is_open():
    scene = swarm.Scene([tray()])
    assert scene.is_open()
    assert not np.isfinite(scene.bounds()).any()
    assert tray().size() == 0.5
    assert plate(0.2).size() == pytest.approx(1.0)


def test_what_has_no_inside_is_refused():
    with pytest.raises(swarm.SceneError, match="must be closed to enclose a volume"):
        tray().volume()
    with pytest.raises(swarm.SceneError, match="open to infinity"):
        swarm.fill(swarm.Scene([tray()]), 10, speed=1.0)
    with pytest.raises(swarm.SceneError, match="on a sheet, and must be on one side of it"):
        run(triangle(), [[0.0], [0.0], [0.0]], [[0.0], [0.0], [1.0]])
    with pytest.raises(swarm.SceneError, match=r"motion must be None for a Mesh with open=True"):
        tray(motion=swarm.Translation((1.0, 0.0, 0.0)))
    with pytest.raises(swarm.SceneError, match="openings must be left out for an open mesh"):
        tray(openings=[swarm.Sphere(0.1, (0.0, 0.0, -0.5))])
    with pytest.raises(swarm.SceneError, match="triangles that have an area, got none"):
        swarm.Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], open=True)


def test_a_file_that_is_not_watertight(tmp_path):
    mesh = tray()
    path = tmp_path / "tray.stl"
    trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).export(path)
    with pytest.raises(swarm.SceneError, match="open=True"):
        swarm.Mesh(path)
    read = swarm.Mesh(path, open=True)
    assert len(read) == 10
    assert len(read.vertices) == 8
    text = '[[surface]]\nkind = "mesh"\nfile = "tray.stl"\nopen = true\n[particles]\ncount = 1\nspeed = 1.0\n'
    (tmp_path / "scene.toml").write_text(text + "within = { kind = 'sphere', radius = 0.1 }\n")
    (tmp_path / "scene.toml").write_text(
        '[[surface]]\nkind = "sphere"\nradius = 2.0\n' + text + '[method]\nkind = "impact"\n[run]\nuntil = 1.0\n'
    )
    sheet = scene_file.read(tmp_path / "scene.toml").scene.surfaces[1]
    assert sheet.open
    assert np.array_equal(sheet.vertices, read.vertices)
    again = tables.scene_of([tables.table_of(sheet)], None).surfaces[0]
    assert again.open
    assert np.array_equal(again.triangles, sheet.triangles)
    assert "open" not in tables.table_of(swarm.Mesh(np.array(BOX.vertices), np.array(BOX.faces)))


@pytest.mark.parametrize("tilt", [0.0, 0.7])
def test_triangles_in_one_plane_are_sheets(tilt):
    """They enclose nothing, so they are no closed mesh that is damaged; a bent sheet may be one."""
    given = plate(tilt)
    for side in ("inside", "outside"):
        mesh = swarm.Mesh(np.array(given.vertices), np.array(given.triangles), side)
        assert mesh.open
        assert tables.table_of(mesh) == tables.table_of(given)
        assert replace(mesh, restitution=0.5).open
    bent = np.array(given.vertices) + np.array([[0.0], [0.0], [0.0], [1e-3]])
    with pytest.raises(swarm.SceneError, match="open=True"):
        swarm.Mesh(bent, given.triangles)
    with pytest.raises(swarm.SceneError, match="motion must be None"):
        swarm.Mesh(np.array(given.vertices), np.array(given.triangles), motion=swarm.Translation((1.0, 0.0, 0.0)))
    with pytest.raises(swarm.SceneError, match="triangles"):
        swarm.Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])


def test_a_triangle_is_one_whichever_way_it_is_turned():
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0.5, 0.5, 1.0]]
    mesh = swarm.Mesh(corners, [[0, 1, 2], [2, 1, 0], [1, 3, 2], [1, 4, 2], [1, 2, 2]], open=True)
    assert len(mesh) == 3


def test_pictures_show_both_sides():
    """As often as a triangle goes round a normal it goes round the opposite one."""
    shapes = pytest.importorskip("swarm.triangles.shapes")
    (shape,) = shapes.shapes_of(swarm.Scene([tray()]), np.zeros((3, 1)))
    assert shape.area() == pytest.approx(2.0 * 5.0)


# --- Flights ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gravity", [None, (0.0, 0.0, -0.5)])
def test_a_box_of_sheets_has_the_impacts_of_planes(gravity):
    """Until a particle leaves through the open top."""
    random = np.random.default_rng(2)
    n = 40
    position, velocity = random.uniform(-0.4, 0.3, (3, n)), random.normal(0.0, 1.0, (3, n))
    velocity[2] *= 0.1
    mesh = tray()
    end = run(mesh, position, velocity, gravity, until=4.0)
    half = 0.5 - gap(mesh)
    box = swarm.Scene([swarm.Box((half, half, half), open=("+z",))], gravity)
    same = swarm.simulate(box, swarm.Particles(position, velocity), swarm.Impact(), until=4.0, compile="never")
    stay = same.particles.position[2] < half
    assert stay.sum() > 20
    assert np.abs(end.particles.position - same.particles.position)[:, stay].max() < 1e-11
    assert np.array_equal(end.impacts_per_particle[stay], same.impacts_per_particle[stay])
    assert end.observables["energy_error"].max() < 1e-12


def test_a_triangle_is_met_from_both_sides():
    position = np.array([[0.1, 0.1, 0.1, 0.95], [0.0, 0.0, 0.0, 0.9], [0.3, -0.3, 0.4, 0.3]])
    velocity = np.array([[0.02, 0.02, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [-0.5, 0.5, -1.0, -1.0]])
    mesh = triangle()
    end = run(mesh, position, velocity, until=1.0)
    away = gap(mesh)
    assert end.impacts_per_particle.tolist() == [1, 1, 1, 0]
    expected = [0.2 + 2.0 * away, -0.2 - 2.0 * away, 0.6 + 2.0 * away, -0.7]
    assert np.abs(end.particles.position[2] - expected).max() < 1e-15
    falls = run(mesh, position, velocity, (0.0, 0.0, -G), until=3.0)
    # What is below falls away, what is above never comes below the triangle while it is over it.
    assert falls.particles.position[2, 1] < -10.0
    assert (falls.particles.position[2, [0, 2]] > 0.0).all()
    assert falls.observables["energy_error"].max() < 1e-12


@pytest.mark.parametrize(
    ("shape", "gravity"), [("box", DOWN), rarely("thorny", None), rarely("box", None), rarely("thorny", DOWN)]
)
def test_no_particle_passes_a_closed_sheet(shape, gravity):
    """The first flights go exactly to corners and edges, from inside and from outside."""
    vertices, faces = (BOX.vertices, BOX.faces) if shape == "box" else thorny()
    closed = swarm.Mesh(np.array(vertices), np.array(faces))
    mesh = swarm.Mesh(np.array(vertices), turned(faces), open=True)
    scene = swarm.Scene([mesh, swarm.Sphere(1.3)], gravity)
    start = aimed(mesh, swarm.fill(scene, 2000, speed=1.0, seed=2), gravity)
    within = closed.contain(start.position)
    assert 150 < within.sum() < 800
    end = swarm.simulate(scene, start, swarm.Impact(), until=24.0 if shape == "box" else 12.0, compile="always")
    assert np.array_equal(closed.contain(end.particles.position), within)
    assert end.impacts_per_particle.sum() > 1e5
    assert end.observables["energy_error"].max() < 1e-12
    assert end.observables["max_penetration"].max() < 1e-12


@pytest.mark.parametrize("fold", [0.05, 0.3, 1.2, 2.5, 3.1])
def test_no_particle_passes_the_edge_of_a_fold(fold):
    """Two sheets at any angle, and a third one between them; flights go exactly to the edge from all around."""
    ways = [np.array([math.cos(a), math.sin(a), 0.0]) for a in (0.0, fold, 0.4 * fold)]
    z = np.array([0.0, 0.0, 1.0])
    corners = np.concatenate([[-z, z], *([w - z, w + z] for w in ways)])
    faces = [[0, 1, k] for k in (2, 4, 6)] + [[1, k + 1, k] for k in (2, 4, 6)]
    mesh = swarm.Mesh(corners, faces, open=True)
    random, n = np.random.default_rng(3), 80
    angle = random.uniform(0.0, 2.0 * np.pi, n)
    angle = angle[np.abs(angle[:, None] - [0.0, fold, 0.4 * fold, 2.0 * np.pi]).min(axis=1) > 1e-3]
    place = np.stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), random.uniform(-0.2, 0.2, len(angle))])
    target = np.stack([0.0 * angle, 0.0 * angle, random.uniform(-0.5, 0.5, len(angle))])
    end = run(mesh, place, target - place, until=1.3)
    after = np.arctan2(end.particles.position[1], end.particles.position[0]) % (2.0 * np.pi)
    sectors = np.sort([0.0, 0.4 * fold, fold])
    assert np.array_equal(np.searchsorted(sectors, after), np.searchsorted(sectors, angle))
    assert (end.impacts_per_particle > 0).all()


# --- Lasting contact -------------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [0.0, 0.1])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_slide_down_a_sheet_and_off_its_rim(friction, side):
    """On either side, over the diagonal, as on an incline; then it falls freely."""
    tilt, height, until = 0.3, 1e-3, 1.4
    sine, cosine = math.sin(tilt), math.cos(tilt)
    along, normal = np.array([cosine, 0.0, -sine]), np.array([sine, 0.0, cosine])
    mesh = plate(tilt, restitution=0.0, friction=friction)
    away = gap(mesh)
    # Gravity is turned over with the side, and so is the way down.
    start = side * (-0.5 * along + (height + away) * normal) + (0.0, 0.2, 0.0)
    end = run(mesh, start[:, None], np.zeros((3, 1)), (0.0, 0.0, -side * G), until=until)
    # It falls onto the sheet, and the impact takes the normal velocity, and friction of the tangential one.
    fall = math.sqrt(2.0 * height / (G * cosine))
    place, speed = -0.5 + 0.5 * G * sine * fall**2, G * sine * fall - friction * G * cosine * fall
    pull = G * (sine - friction * cosine)
    # Sheets are so much larger at their edges.
    way = 1.0 + OVERLAP * mesh._room - place
    slide = (-speed + math.sqrt(speed**2 + 2.0 * pull * way)) / pull
    left = until - fall - slide
    rim, pace = (place + way) * along + away * normal, (speed + pull * slide) * along
    expected = side * (rim + pace * left - np.array([0.0, 0.0, 0.5 * G * left**2])) + (0.0, 0.2, 0.0)
    assert left > 0.1
    assert np.abs(end.particles.position[:, 0] - expected).max() < 1e-11
    assert end.observables["sliding_time"][-1] == pytest.approx(slide, rel=1e-8)
    assert end.observables["energy_error"].max() < 1e-12


def test_grooves_hold_what_slides_in_them():
    """Three sheets at one edge: particles come to slide in a groove, on either side of the middle sheet, to its end."""
    low, high = np.array([1.0, 0.0, -0.3]), np.array([-1.0, 0.0, 0.3])
    ways = [np.array(w) for w in ((0.0, 1.0, 1.0), (0.0, -1.0, 0.7), (0.0, 0.05, 1.0))]
    corners = np.concatenate([[high, low], *([high + w, low + w] for w in ways)])
    faces = [[0, 1, k] for k in (2, 4, 6)] + [[1, k + 1, k] for k in (2, 4, 6)]
    mesh = swarm.Mesh(corners, faces, open=True, restitution=0.0, friction=0.05)
    random, n = np.random.default_rng(4), 3
    place = np.stack([random.uniform(-0.8, 0.0, n), random.uniform(-0.5, 0.5, n), random.uniform(0.9, 1.1, n)])
    end = run(mesh, place, np.zeros((3, n)), (0.0, 0.0, -G), until=0.8, every=0.2)
    seen = end.observables
    assert seen["sliding"][-1] == n
    assert seen["max_penetration"].max() < 1e-12
    assert unbooked(seen) < 1e-12 * abs(seen["total_energy"][0])
    sides = [p[1] - 0.05 * (p[2] + 0.3 * p[0]) > 0.0 for p in (place, end.particles.position)]
    assert np.array_equal(*sides)
    assert 0 < sides[0].sum() < n


# --- Laws ------------------------------------------------------------------------------------------------


def test_groups_and_times_of_sheets():
    corners = [[-1, -1, 0], [1, -1, 0], [0, 1, 0], [-1, -1, 1], [1, -1, 1], [0, 1, 1]]
    mesh = swarm.Mesh(
        corners, [[0, 1, 2], [3, 5, 4]], open=True, group=[0, 1], names=("low", "high"),
        groups={"high": {"restitution": 0.5}}, present=[(0.0, 0.7)],
    )  # fmt: skip
    position = np.array([[0.0] * 4, [0.0] * 4, [0.2, 0.8, -0.3, 1.4]])
    velocity = np.array([[0.0] * 4, [0.0] * 4, [-1.0, 1.0, 1.0, -1.0]])
    end = run(mesh, position, velocity, until=1.0, member_impacts=True)
    assert end.particles.velocity[2].tolist() == [1.0, -0.5, -1.0, 0.5]
    assert [one.tolist() for one in end.member_impacts] == [[2, 2]]
    # After 0.7 s none is there.
    later = run(mesh, [[0.0], [0.0], [0.8]], [[0.0], [0.0], [-1.0]], until=1.0)
    assert later.particles.position[2, 0] == pytest.approx(-0.2)


# --- Balls and grains ------------------------------------------------------------------------------------

R = 0.1


def roots_of(d, v, along):
    """When a ball comes to a line, or with none to a point: the sooner root in 50 digits, and the place along it."""
    a, b, c = v @ v, d @ v, d @ d - mpmath.mpf(R) ** 2
    if along is not None:
        length = along @ along
        a, b, c = a - (v @ along) ** 2 / length, b - (d @ along) * (v @ along) / length, c - (d @ along) ** 2 / length
    if b * b - a * c <= 0 or a == 0:
        return None, None
    t = (-b - mpmath.sqrt(b * b - a * c)) / a
    return t, (None if along is None else ((d + t * v) @ along) / length)


def hit_in_digits(corners, r, v):
    """When a ball first meets a triangle, by its plane, its edges and its corners; and the normal there."""
    found = []
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal = normal / mpmath.sqrt(normal @ normal)
    height = (r - corners[0]) @ normal
    sign = 1 if height > 0 else -1
    if v @ normal != 0:
        t = (sign * mpmath.mpf(R) - height) / (v @ normal)
        p = r + t * v
        sides = [np.cross(corners[(k + 1) % 3] - corners[k], p - corners[k]) @ normal for k in range(3)]
        if t > 0 and min(sides) > 0:
            found.append((t, normal))
    for k in range(3):
        along = corners[(k + 1) % 3] - corners[k]
        t, part = roots_of(r - corners[k], v, along)
        if t is not None and t > 0 and 0 < part < 1:
            found.append((t, (r + t * v - corners[k] - part * along) / R))
        t, _part = roots_of(r - corners[k], v, None)
        if t is not None and t > 0:
            found.append((t, (r + t * v - corners[k]) / R))
    return min(found, key=lambda one: one[0], default=(None, None))


def test_balls_bounce_off_the_rim_as_in_50_digits():
    mpmath.mp.dps = 50
    exact = np.vectorize(mpmath.mpf, otypes=[object])
    mesh, random, n = triangle(), np.random.default_rng(7), 24
    corners = exact(mesh.corners[mesh.triangles[0]])
    # At places on the rim, passed at less than the radius, from all around.
    part, k = random.random(n), random.integers(0, 3, n)
    rim = mesh.corners[mesh.triangles[0]]
    target = rim[k] + part[:, None] * (rim[(k + 1) % 3] - rim[k]) + random.uniform(-0.08, 0.08, (n, 3))
    way = random.normal(0.0, 1.0, (n, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    start = target - 0.6 * way
    free = mesh.phi(start.T) > R + 0.01
    start, way, count = start[free], way[free], 0
    for r, v in zip(start, way, strict=True):
        scene = swarm.Scene([mesh])
        given = swarm.Particles(r[:, None], v[:, None], radius=R)
        end = swarm.simulate(scene, given, swarm.Impact(), until=1.0, compile="never")
        x, w = exact(r), exact(v)
        t, normal = hit_in_digits(corners, x, w)
        if t is None or t > 1:
            assert end.observables["impacts"][-1] == 0
            continue
        count += 1
        after = w - 2 * (w @ normal) * normal / (normal @ normal)
        expected = (x + t * w + (1 - t) * after).astype(float)
        assert end.observables["impacts"][-1] == 1
        assert np.abs(end.particles.position[:, 0] - expected).max() < 2e-13
        assert end.observables["energy_error"].max() < 1e-15
    assert count > 10


def test_balls_stay_on_their_side_of_a_closed_sheet():
    vertices, faces = np.array(BOX.vertices), turned(BOX.faces)
    scene = swarm.Scene([swarm.Mesh(vertices, faces, open=True), swarm.Sphere(1.2)], (0.0, 0.0, -1.0))
    ticks = np.linspace(-0.84, 0.84, 7)
    grid = np.array(np.meshgrid(ticks, ticks, ticks)).reshape(3, -1)
    away = np.abs(np.abs(grid).max(axis=0) - 0.5) > 0.06
    grid = grid[:, away & (np.linalg.norm(grid, axis=0) < 1.1)]
    within = np.abs(grid).max(axis=0) < 0.5
    start = swarm.Particles(grid, np.random.default_rng(1).normal(0.0, 1.0, grid.shape), radius=0.05)
    end = swarm.simulate(scene, start, swarm.Impact(), until=2.5, compile="always")
    assert np.array_equal(np.abs(end.particles.position).max(axis=0) < 0.5, within)
    assert within.any()
    assert not within.all()
    seen = end.observables
    assert seen["impacts"][-1] > 1000
    assert seen["energy_error"].max() < 1e-12
    assert seen["max_penetration"].max() < 1e-12


def test_faces_of_sheets_are_flat():
    """Whichever way they are turned, and in whichever order: the diagonal of a square joins, a fold does not."""
    corners, face = tray().faces_of_balls(0.1)
    assert len(np.unique(face)) == 5
    assert np.bincount(face).tolist() == [2] * 5
    assert len(corners.table) == 10


def test_grains_in_a_tray_as_in_planes():
    """Soft balls that stay below the rim: the same contacts as with the planes of a box, and the energy is kept."""
    ticks = (-0.3, 0.05)
    grid = np.array(np.meshgrid(ticks, ticks, (-0.38, -0.15))).reshape(3, -1)
    velocity = np.random.default_rng(3).normal(0.0, 0.5, grid.shape)
    ends = []
    for surface in (tray(friction=0.2), swarm.Box((0.5, 0.5, 0.5), open=("+z",), friction=0.2)):
        scene = swarm.Scene([surface], (0.0, 0.0, -G))
        start = swarm.Particles(grid, velocity, radius=R)
        end = swarm.simulate(scene, start, swarm.Penalty(dt=2e-3, penalty=5e4), until=0.24, compile="never")
        assert end.observables["energy_error"].max() < 1e-12
        ends.append(end)
    assert ends[0].observables["impacts"][-1] > 5
    assert np.abs(ends[0].particles.position - ends[1].particles.position).max() < 1e-9


def test_grains_meet_a_sheet_from_both_sides():
    position, velocity = np.array([[0.0] * 2, [0.0, 0.4], [0.3, -0.3]]), np.array([[0.0] * 2, [0.0] * 2, [-1.0, 1.0]])
    start = swarm.Particles(position, velocity, radius=R)
    end = swarm.simulate(
        swarm.Scene([triangle()]), start, swarm.Penalty(dt=1e-3, penalty=1e5), until=0.5, compile="never"
    )
    assert end.particles.velocity[2] == pytest.approx([1.0, -1.0], abs=1e-12)
    assert end.particles.position[2, 0] == pytest.approx(-end.particles.position[2, 1], abs=1e-15)


@pytest.mark.parametrize("method", [swarm.Impact(), swarm.Penalty(dt=2e-4, penalty=1e5)], ids=["Impact", "Penalty"])
def test_a_ball_meets_a_flat_ring_of_many_triangles(method):
    n, turns = 24, 2.0 * np.pi * np.arange(24) / 24
    rings = [np.stack([size * np.cos(turns), size * np.sin(turns), 0.0 * turns], axis=1) for size in (0.1, 0.2)]
    after = (np.arange(n) + 1) % n
    faces = [triple for k, j in enumerate(after) for triple in ((k, n + k, n + j), (k, n + j, j))]
    ring = swarm.Mesh(np.concatenate(rings), faces, open=True)
    ball = swarm.Particles((0.15, 0.0, 0.1), (0.0, 0.0, -1.0), radius=0.02)
    end = swarm.simulate(swarm.Scene([ring]), ball, method, until=0.2, compile="never")
    assert end.observables["impacts"][-1] == 1
    # A spring turns it round for the time of half a period.
    lasts = 0.0 if isinstance(method, swarm.Impact) else np.pi * np.sqrt(1.0 / 1e5)
    assert end.particles.position[2, 0] == pytest.approx(0.02 + 0.12 - lasts, abs=1e-3)
    assert end.observables["energy_error"].max() < 1e-12
