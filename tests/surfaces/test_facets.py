"""Triangles as walls: the same impacts as a box, none out at edges, corners, needles and thin walls, laws, slides."""

import itertools

import numpy as np
import pytest
import trimesh
from conftest import rarely
from thorny import aimed, hollow, slivered, thorny

import swarm
from swarm import scene_file
from swarm.kernel.grid import cell_of, entries_of, until_out
from swarm.kernel.vector import Vec, vec
from swarm.run.base import BaseRun
from swarm.run.engine import Run
from swarm.serialization import tables
from swarm.surfaces.facets import free_room as room
from swarm.surfaces.facets.facet_cells import blocks_of, flight_in, from_middle
from swarm.surfaces.fields.members import member
from swarm.surfaces.time_of_impact.rising import Jerk
from swarm.surfaces.walls import penetration

BOX = trimesh.creation.box((1.0, 2.0, 3.0))
WIDTHS = (0.5, 1.0, 1.5)
DOWN = (0.3, -0.2, -1.0)


def box_of_triangles(**given):
    return swarm.Mesh(np.array(BOX.vertices), np.array(BOX.faces), **given)


# --- The description -------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_phi_of_a_box_is_that_of_the_box(side):
    mesh, box = box_of_triangles(side=side), swarm.Box(WIDTHS, side=side)
    points = np.random.default_rng(1).uniform(-2.0, 2.0, (3, 500))
    phi, exact = mesh.phi(points), box.phi(points)
    inside = exact < 0.0
    assert np.abs(phi - exact)[inside].max() < 1e-15
    assert np.array_equal(phi < 0.0, inside)
    assert np.array_equal(mesh.contain(points), inside ^ (side == "outside"))
    step = 1e-6
    differences = [(mesh.phi(points + e) - mesh.phi(points - e)) / (2.0 * step) for e in step * np.eye(3)[:, :, None]]
    assert np.median(np.abs(mesh.gradient(points) - differences)) < 1e-9
    assert mesh.volume() == pytest.approx(6.0)
    assert mesh.size() == 0.5


def test_the_side_of_a_thorny_vessel():
    corners, faces = thorny()
    mesh = swarm.Mesh(corners, faces)
    random = np.random.default_rng(2)
    points = random.uniform(-1.0, 1.0, (3, 400))
    # A ray in any direction passes an odd number of triangles from inside.
    a, b, c = np.moveaxis(mesh.corners[mesh.triangles], 1, 0)
    way = np.array([0.3, 0.5, 0.81])
    count = np.zeros(400, int)
    for i, point in enumerate(points.T):
        turns = [np.einsum("ij,j->i", np.cross(p - point, q - point), way) for p, q in ((a, b), (b, c), (c, a))]
        ahead = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - point) * (np.cross(b - a, c - a) @ way) > 0.0
        same = np.all(np.array(turns) > 0.0, axis=0) | np.all(np.array(turns) < 0.0, axis=0)
        count[i] = (same & ahead).sum()
    assert np.array_equal(mesh.contain(points), count % 2 == 1)
    assert np.array_equal(mesh.phi(points) < 0.0, count % 2 == 1)


def test_a_turned_and_shifted_mesh():
    turn = {"axis": (1.0, 2.0, 3.0), "angle": 0.7}
    mesh, box = (
        box_of_triangles(rotation=turn, center=(0.1, 0.2, 0.3)),
        swarm.Box(WIDTHS, (0.1, 0.2, 0.3), rotation=turn),
    )
    points = box.center + 0.8 * np.random.default_rng(1).uniform(-0.5, 0.5, (200, 3))
    assert np.abs(mesh.phi(points.T) - box.phi(points.T)).max() < 1e-14
    assert np.allclose(mesh.bounds(), box.bounds())


def test_every_cell_has_the_facets_that_come_into_it():
    corners, faces = thorny()
    mesh = swarm.Mesh(corners, faces)
    grid, random = mesh.members.grid, np.random.default_rng(5)
    weights = random.dirichlet((1.0, 1.0, 1.0), len(faces))
    points = (mesh.corners[mesh.triangles] * weights[:, :, None]).sum(axis=1)
    shape = np.array(grid.shape, int)
    places = np.minimum(((points - np.array(grid.low)) * np.array(grid.inverse)).astype(int), shape - 1)
    for m, cell in enumerate((places[:, 0] * shape[1] + places[:, 1]) * shape[2] + places[:, 2]):
        entries = grid.entries[slice(*entries_of(grid, cell))]
        assert m in entries
        assert np.array_equal(np.unique(entries), np.sort(entries))
        is_one = grid.known.planes[slice(*blocks_of(grid, cell)), 7] > 0
        assert np.array_equal(is_one.ravel(), np.arange(is_one.size) < len(entries))
    held = np.diff(grid.first[:-1]).reshape(shape) > 0
    assert np.array_equal(grid.known.room[:-1, room.KIND].reshape(shape) == room.FULL, held)
    for cell in random.choice(np.flatnonzero(grid.known.room[:-1, room.KIND] == room.FREE), 300):
        x, y, z = np.unravel_index(cell, shape)
        a, b, c, d, e, f = grid.known.room[cell, :6].astype(int)
        assert not held[x - a : x + b + 1, y - c : y + d + 1, z - e : z + f + 1].any()


@pytest.mark.parametrize("gravity", [None, Vec(0.3, -0.2, -1.0), Vec(0.0, 0.0, -2.0)])
def test_when_a_flight_leaves_a_block(gravity):
    corners, faces = thorny(n=8)
    grid, random = swarm.Mesh(corners, faces).members.grid, np.random.default_rng(6)
    for _case in range(200):
        r, v = random.uniform(-0.5, 0.5, 3), random.normal(size=3)
        place = np.floor((r - np.array(grid.low)) * np.array(grid.inverse))
        free = room.FreeCells(*(Vec(*random.integers(0, 3, 3).astype(float)) for _end in range(2)))
        time = until_out(gravity, grid, Vec(*place) - free.back, Vec(*place) + free.ahead, Vec(*r), Vec(*v))
        pull = np.zeros(3) if gravity is None else np.array(gravity)
        low = np.array(grid.low) + (place - np.array(free.back)) * np.array(grid.width) - np.array(grid.margin)
        high = np.array(grid.low) + (place + np.array(free.ahead) + 1.0) * np.array(grid.width) + np.array(grid.margin)
        times = np.linspace(0.0, 1.0, 2001)[:, None] * time
        way = r + v * times + 0.5 * pull * times**2
        assert ((way >= low - 1e-12) & (way <= high + 1e-12)).all()
        assert min(np.abs(way[-1] - low).min(), np.abs(way[-1] - high).min()) < 1e-12


# --- Flights ---------------------------------------------------------------------------------------------


def test_no_facet_that_a_straight_flight_meets_is_passed_over():
    """At corners, on edges and within, also along the facet nearly, to the ends of the cell: the round-off is met."""
    random, met, asked, passed = np.random.default_rng(7), 0, 0, 0
    for mesh in (swarm.Mesh(*thorny()), swarm.Mesh(*slivered()), box_of_triangles()):
        members, cells = mesh.members, mesh.members.grid
        low, width, shape = (np.array(one) for one in (cells.low, cells.width, cells.shape))
        corners = mesh.corners[mesh.triangles]
        for number in random.permutation(np.flatnonzero(np.diff(cells.first[:-1])))[:120]:
            middle = low + (np.array(np.unravel_index(number, shape.astype(int)), float) + 0.5) * width
            cell = cell_of(cells, vec(middle))
            entries = cells.entries[slice(*entries_of(cells, number))]
            for k, m in enumerate(entries):
                n = members.table[m, :3]
                weights = np.concatenate([np.eye(3), random.dirichlet(3 * [0.3], 9)])
                weights[3:6, :] *= 1.0 - np.eye(3)
                weights /= weights.sum(axis=1)[:, None]
                for at in weights @ corners[m]:
                    if (abs(at - middle) > 0.5 * width).any():
                        continue
                    r = middle + random.uniform(-0.5, 0.5, 3) * width
                    # Nearly along the facet
                    r = r + random.choice([0.0, 0.999, 1.0 - 1e-7]) * (n @ (at - r)) * n
                    speed = random.choice([1e-3, 1.0, 1e4])
                    v = speed * (at - r) / np.linalg.norm(width)
                    if not n @ v > 0.0 or (abs(r - middle) > 0.5 * width).any():
                        continue
                    span = (1.0 + random.choice([0.0, 1e-12, 0.5])) * np.linalg.norm(width) / speed
                    here = flight_in(cells, from_middle(cells, cell.place, vec(r)), vec(v), None, span)
                    assert members.may_meet(cell, k, here)
                    met += 1
                for _k in range(3):
                    r, v = middle + random.uniform(-0.5, 0.5, 3) * width, random.standard_normal(3)
                    span = until_out(None, cells, cell.place, cell.place, vec(r), vec(v))
                    here = flight_in(cells, from_middle(cells, cell.place, vec(r)), vec(v), None, span)
                    asked, passed = asked + 1, passed + bool(members.may_meet(cell, k, here))
    assert met >= 1000
    assert passed <= 0.3 * asked


@pytest.mark.parametrize("jerks", [0.0, 10.0, 250.0])
def test_no_facet_that_a_curve_meets_is_passed_over(jerks):
    """Of cubic curves, of the jerk of which a bound is known, or a half, or all: by the roots of their levels."""
    random, met, asked, passed = np.random.default_rng(4), 0, 0, 0
    for mesh in (swarm.Mesh(*thorny()), swarm.Mesh(*slivered())):
        cells = mesh.members.grid
        low, width, shape = (np.array(one) for one in (cells.low, cells.width, cells.shape))
        for number in random.permutation(np.flatnonzero(np.diff(cells.first[:-1])))[:1500]:
            place = np.array(np.unravel_index(number, shape.astype(int)), float)
            r, middle = (low + (place + away) * width for away in (random.uniform(0.0, 1.0, 3), 0.5))
            v, a, j = random.standard_normal((3, 3)) * [[1.0], [random.choice([0.1, 1.0, 10.0])], [jerks]]
            span = random.choice([0.1, 0.5, 1.0]) * width.max()
            known = random.integers(3)
            rest = (1.0 - 0.5 * known) * np.linalg.norm(j)
            jerk = Jerk(vec(0.5 * known * j) if known else None, rest, rest)
            cell = cell_of(cells, vec(r))
            here = flight_in(cells, from_middle(cells, cell.place, vec(r)), vec(v), vec(a), span, jerk)
            first, stop = entries_of(cells, number)
            for k in range(first, stop):
                facet, passes_it = member(mesh.members, cells.entries[k]), mesh.members.may_meet(cell, k - first, here)
                n, asked, passed = np.array(facet.normal), asked + 1, passed + bool(passes_it)
                roots = np.roots([n @ j / 6.0, n @ a / 2.0, n @ v, n @ r - facet.offset])
                for t in roots.real[(abs(roots.imag) < 1e-9) & (roots.real >= 0.0) & (roots.real <= span)]:
                    at = r + t * (v + t * (0.5 * a + t * j / 6.0))
                    is_in = (abs(at - middle) <= 0.5 * width).all() and facet.within(vec(at)) >= 0.0
                    if is_in and n @ (v + t * (a + 0.5 * t * j)) > 0.0:
                        met += 1
                        assert passes_it
    assert met >= 100
    assert passed <= 0.5 * asked


@pytest.mark.parametrize("gravity", [None, DOWN])
def test_a_box_of_twelve_triangles_has_the_impacts_of_a_box(gravity):
    start = swarm.fill(swarm.Scene([swarm.Box(WIDTHS)]), 40, speed=1.0, seed=1)
    ends = [
        swarm.simulate(swarm.Scene([surface], gravity=gravity), start, swarm.Impact(), until=8.0)
        for surface in (box_of_triangles(), swarm.Box(WIDTHS))
    ]
    assert np.abs(ends[0].particles.position - ends[1].particles.position).max() < 1e-13
    assert np.array_equal(ends[0].impacts_per_particle, ends[1].impacts_per_particle)
    assert ends[0].impacts_per_particle.sum() > 200


def kept_in(mesh, start, gravity, until, **given):
    scene = swarm.Scene([mesh], gravity=gravity)
    end = swarm.simulate(scene, start, swarm.Impact(), until=until, every=0.5 * until, **given)
    assert mesh.phi(end.particles.position).max() < 1e-12
    assert np.abs(end.observables["total_energy"] / end.observables["total_energy"][0] - 1.0).max() < 1e-13
    return end.impacts_per_particle.sum()


def some_in(mesh, radius, n):
    """Particles in a ball that a mesh has in it; to fill the mesh itself takes seconds."""
    start = swarm.fill(swarm.Scene([swarm.Sphere(radius)]), n, speed=1.0, seed=1)
    assert mesh.contain(start.position).all()
    return start


@pytest.mark.parametrize(("until", "least"), [(15.0, 2.5e5), rarely(60.0, 9e5)])
@pytest.mark.parametrize("gravity", [None, DOWN])
def test_nobody_leaves_a_thorny_vessel(gravity, until, least):
    """Acute and obtuse edges and needles; of the first flights half go to corners, half to edges."""
    mesh = swarm.Mesh(*thorny())
    start = aimed(mesh, some_in(mesh, 0.25, 3000), gravity)
    assert kept_in(mesh, start, gravity, until, compile="always") > least


def test_nobody_leaves_a_vessel_of_slivers():
    mesh = swarm.Mesh(*slivered())
    start = aimed(mesh, some_in(mesh, 0.25, 2000))
    assert kept_in(mesh, start, None, 10.0, compile="always") > 2e4


def test_nobody_passes_a_wall_of_a_millimetre():
    """A hollow cube in a box: those within stay within, those around stay around."""
    cube = swarm.Mesh(*hollow(1e-3), side="outside")
    scene = swarm.Scene([swarm.Box((0.8, 0.8, 0.8)), cube])
    start = swarm.fill(scene, 1000, speed=1.0, seed=1)
    within = np.abs(start.position).max(axis=0) < 0.5
    assert 100 < within.sum() < 900
    end = swarm.simulate(scene, start, swarm.Impact(), until=40.0, compile="always")
    there = np.abs(end.particles.position).max(axis=0)
    assert there[within].max() <= 0.499 + 1e-12
    assert there[~within].min() >= 0.5 - 1e-12
    assert end.impacts_per_particle.min() > 10


def test_what_touches_one_side_of_a_ledge_is_not_deep_behind_the_other():
    """Within round-off of a wall, and of the plane of its neighbour at a re-entrant edge."""
    ring = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    corners = [(*place, height) for height in (0.0, 1.0) for place in ring]
    lids = [(0, k, k + 1) for k in range(1, 5)]
    sides = [
        part for a, b in zip(range(6), (1, 2, 3, 4, 5, 0), strict=True) for part in ((a, b, b + 6), (a, b + 6, a + 6))
    ]
    room = swarm.Mesh(corners, [*(one[::-1] for one in lids), *(tuple(k + 6 for k in one) for one in lids), *sides])
    away, along = (each.ravel() for each in np.meshgrid([1e-15, 1e-13, 5e-13], [1e-13, 1e-10, 3e-9, 1e-6]))
    places = np.array([1.0 - away, 1.0 + along, np.full(away.size, 0.3)])
    assert (room.phi(places) < 0.0).all()
    start = swarm.Particles(places, np.zeros(places.shape))
    seen = swarm.simulate(swarm.Scene([room]), start, swarm.Impact(), until=0.1, compile="never").observables
    assert seen["max_penetration"].max() < 2e-12
    # What is behind the middle of a wall is as deep as it is.
    behind = swarm.Scene([room]).compiled().walls()
    assert penetration(behind, Vec(0.5, 0.5, -2e-9)) == pytest.approx(2e-9)


def thick():
    return hollow(0.2)


@pytest.mark.parametrize(
    ("made", "side", "share"),
    [(thorny, "inside", 0.97), (thorny, "outside", 0.7), (thick, "inside", 1.0), (thick, "outside", 1.0)],
)
def test_what_is_lost_behind_a_facet_is_as_deep_as_it_is_far_from_the_mesh(made, side, share):
    """Beyond its grid, and in it: all but what is as near to a facet that it is before."""
    mesh = swarm.Mesh(*made(), side)
    points = np.random.default_rng(5).uniform(-1.5, 1.5, (3, 400))
    outside = (1.0 if side == "inside" else -1.0) * mesh.phi(points)
    walls = swarm.Scene([mesh]).compiled().walls()
    deep = np.array([penetration(walls, Vec(*point)) for point in points.T.tolist()])
    seen = deep > 0.0
    assert np.abs(deep - outside)[seen].max() < 1e-14
    assert seen.sum() >= share * (outside > 0.0).sum() > 5
    # Where the walls are not there nothing is lost.
    absent = walls._replace(each=(walls.each[0]._replace(members=walls.each[0].members.gone()),))
    assert all(penetration(absent, Vec(*point)) == 0.0 for point in points.T[:100].tolist())


def test_a_run_that_loses_a_particle_behind_a_facet_ends_with_a_sentence(monkeypatch):
    advance = Run.advance

    def lose(run, *given, **options):
        done = advance(run, *given, **options)
        run.state.position[:, 1] = (0.0, 0.0, 1.75)
        run.observe()
        return done

    monkeypatch.setattr(Run, "advance", lose)
    start = swarm.Particles(np.zeros((3, 3)), np.eye(3))
    with pytest.raises(swarm.RunError, match=r"particle 1: it is 0\.25 m outside surfaces\[0\] \(Mesh\)"):
        swarm.simulate(swarm.Scene([box_of_triangles()]), start, swarm.Impact(), until=1.0, compile="never")


@pytest.mark.parametrize("motion", [None, swarm.Rotation((0.0, 0.0, 1.0), 2.0)], ids=["at rest", "turns"])
@pytest.mark.parametrize("method", [swarm.Impact(), swarm.Penalty(dt=1e-2, penalty=1e4)], ids=["hard", "soft"])
def test_a_run_that_loses_a_ball_behind_a_facet_ends_with_a_sentence(method, motion, monkeypatch):
    """Balls meet triangles from both sides, which do not say on which one a ball is."""
    advance, place = BaseRun.advance, np.array([0.0, 1.5, 0.3])

    def lose(run, *given, **options):
        done = advance(run, *given, **options)
        run.state.position[:, 1] = place
        return done

    monkeypatch.setattr(BaseRun, "advance", lose)
    start = swarm.Particles(0.5 * np.eye(3) - 0.2, np.zeros((3, 3)), radius=0.1)
    scene = swarm.Scene([box_of_triangles(motion=motion)])
    depth = 0.1 + scene.distances_outside(place[:, None], 1.0)[0, 0]
    with pytest.raises(swarm.RunError, match=rf"particle 1: it is {depth:.3g} m outside surfaces\[0\] \(Mesh\)"):
        swarm.simulate(scene, start, method, until=1.0, compile="never")


@pytest.mark.parametrize("motion", [None, swarm.Rotation((1.0, 2.0, 3.0), 0.5, (0.3, 0.0, 0.0))])
@pytest.mark.parametrize("gravity", [None, (0.1, -0.2, -0.4)])
def test_a_flight_past_a_saddle_vertex_goes_on(motion, gravity):
    """There two facets in one plane are walls from opposite sides, and each reaches beyond its edges by round-off."""
    rooms = {(0, 0, 1), (0, 1, 1), (0, 1, 0), (1, 0, 1)}
    faces = []
    for cell, axis, step in itertools.product(rooms, range(3), (-1, 1)):
        beside = list(cell)
        beside[axis] += step
        if tuple(beside) not in rooms:
            corner, u, w = np.array(cell, float), *np.eye(3)[[(axis + 1) % 3, (axis + 2) % 3]]
            corner[axis] += step > 0
            ring = [corner, corner + u, corner + u + w, corner + w][::step]
            faces += [[ring[0], ring[1], ring[2]], [ring[0], ring[2], ring[3]]]
    corners, triangles = np.unique(np.array(faces).reshape(-1, 3) - 1.0, axis=0, return_inverse=True)
    mesh = swarm.Mesh(corners, triangles.reshape(-1, 3), motion=motion)
    rng = np.random.default_rng(1)
    places = 4e-13 * rng.uniform(-1.0, 1.0, (3, 100))
    places = places[:, mesh.phi(places) < 0.0]
    ways = rng.standard_normal(places.shape)
    scene = swarm.Scene([mesh], gravity)
    start = swarm.Particles(places, ways)
    result = swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile="never", walltime=60.0)
    assert places.shape[1] > 20
    assert (mesh.phi(result.particles.position, 1.0) < 1e-12).all()
    assert result.observables["energy_error"].max() < 1e-13
    assert result.observables["impacts"][-1] < 20 * places.shape[1]


def test_what_is_before_one_side_of_a_sharp_ridge_is_not_deep_behind_the_other():
    """As near to the ridge as it is, it would be behind the other by less than a step may end there."""
    corners = [(0, 0, -1), (0, 0, 1), (1, 0, 0), (1, 0.1, 0)]
    blade = swarm.Mesh(corners, [(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)], "outside")
    along, away = np.meshgrid([1e-9, 1e-8, 5e-8], [1e-14, 1e-12, 1e-10])
    walls = swarm.Scene([blade]).compiled().walls()
    for x, y in zip(along.ravel(), away.ravel(), strict=True):
        assert penetration(walls, Vec(x, -y, 0.0)) == 0.0
        # Behind a side it is as deep as it is behind that one, and not behind the other.
        within = min(y, 0.02 * x)
        assert penetration(walls, Vec(x, within, 0.0)) == pytest.approx(within, rel=1e-3)


def test_a_slide_down_a_faceted_hopper_ends_at_its_apex():
    n = 24
    angle = 2.0 * np.pi * np.arange(n) / n
    corners = np.concatenate([np.stack([np.cos(angle), np.sin(angle), np.ones(n)], 1), [(0, 0, 0), (0, 0, 1)]])
    k = np.arange(n)
    faces = np.concatenate([np.stack([0 * k + n, (k + 1) % n, k], 1), np.stack([0 * k + n + 1, k, (k + 1) % n], 1)])
    hopper = swarm.Mesh(corners, faces, restitution=0.5, friction=0.1)
    scene = swarm.Scene([hopper], gravity=(0.0, 0.0, -9.81))
    start = swarm.fill(scene, 20, speed=0.1, seed=1)
    end = swarm.simulate(scene, start, swarm.Impact(), until=5.0, every=1.0, compile="always")
    energy = end.observables["total_energy"]
    assert (np.diff(energy) < 1e-12).all()
    assert np.abs(end.particles.position).max() < 1e-9
    assert np.abs(end.particles.velocity).max() == 0.0
    assert end.observables["max_penetration"].max() < 1e-12


def test_a_slide_goes_on_over_the_diagonal_of_a_floor():
    start = swarm.Particles(np.array([[-0.3], [-0.7], [-1.5]]), np.array([[0.4], [1.2], [0.0]]))
    ends = [
        swarm.simulate(
            swarm.Scene([surface], gravity=(0.0, 0.0, -9.81)), start, swarm.Impact(), until=3.0, compile="never"
        )
        for surface in (box_of_triangles(friction=0.01), swarm.Box(WIDTHS, friction=0.01))
    ]
    assert np.abs(ends[0].particles.position - ends[1].particles.position).max() < 1e-9


# --- Laws and files --------------------------------------------------------------------------------------


def grouped(**given):
    """The box, whose floor is a group of its own."""
    floor = (np.array(BOX.vertices)[BOX.faces][:, :, 2] == -1.5).all(axis=1)
    return swarm.Mesh(
        np.array(BOX.vertices), np.array(BOX.faces), group=floor.astype(int), names=("rest", "floor"), **given
    )


def test_groups_have_laws_of_their_own():
    mesh = grouped(groups={"floor": {"restitution": 0.0}})
    assert [count for _one, count in mesh.runs()] == [10, 2]
    start = swarm.Particles(np.zeros((3, 2)), np.array([[1.0, 0.0], [0.0, 0.0], [0.0, -1.0]]))
    end = swarm.simulate(swarm.Scene([mesh]), start, swarm.Impact(), until=2.0, compile="never")
    assert np.allclose(end.particles.velocity, [[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]], atol=1e-15)


def test_a_mesh_in_a_file_is_the_same_mesh():
    mesh = grouped(groups={"floor": {"restitution": 0.25}}, friction=0.1)
    arrays = {}
    table = tables.table_of(mesh, arrays)
    again = tables.scene_of([tables.with_arrays(table, arrays)], None).surfaces[0]
    for name in ("vertices", "triangles", "group"):
        assert np.array_equal(getattr(mesh, name), getattr(again, name))
    assert again.groups == mesh.groups
    assert again.names == mesh.names
    assert again.friction == 0.1
    with pytest.raises(swarm.SceneError, match="a trajectory names no file"):
        tables.with_arrays({**table, "vertices": "part.stl"}, {})


TEXT = """
[particles]
count = 3
speed = 1.0
[[surface]]
kind = "mesh"
file = "part.obj"
scale = 1e-3
restitution = 0.9
[surface.groups.floor]
restitution = 0.5
[method]
kind = "impact"
[run]
until = 1.0
every = 0.5
"""


def test_a_mesh_of_triangles_in_a_scene_file(tmp_path):
    lines = ["g rest"] + [f"v {x} {y} {z}" for x, y, z in 1e3 * np.array(BOX.vertices)]
    floor = (np.array(BOX.vertices)[BOX.faces][:, :, 2] == -1.5).all(axis=1)
    for name, which in (("rest", ~floor), ("floor", floor)):
        lines += [f"g {name}", *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in BOX.faces[which])]
    (tmp_path / "part.obj").write_text("\n".join(lines))
    (tmp_path / "scene.toml").write_text(TEXT)
    mesh = scene_file.read(tmp_path / "scene.toml").scene.surfaces[0]
    assert isinstance(mesh, swarm.Mesh)
    assert mesh.volume() == pytest.approx(6.0)
    assert [(one.restitution, count) for one, count in mesh.runs()] == [(0.9, 10), (0.5, 2)]
    (tmp_path / "scene.toml").write_text(TEXT.replace("groups.floor", "groups.lid"))
    with pytest.raises(
        swarm.SceneError, match=r"surface\[0\].groups must name groups of the mesh, got 'lid'; there are"
    ):
        scene_file.read(tmp_path / "scene.toml")


def test_an_opening_of_a_mesh():
    hole = swarm.Cylinder(0.2, (0.0, 0.0, 1.0))
    scene = swarm.Scene([box_of_triangles(openings=[hole])])
    start = swarm.Particles(
        np.array([[0.0, 0.3], [0.0, 0.3], [0.0, 0.0]]), np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0]])
    )
    end = swarm.simulate(scene, start, swarm.Impact(), until=4.0, compile="never")
    assert end.escape_time[0] == pytest.approx(1.5)
    assert np.isnan(end.escape_time[1])


def test_memory_of_a_triangle():
    ball = trimesh.creation.icosphere(5)
    mesh = swarm.Mesh(np.array(ball.vertices), np.array(ball.faces))
    members = mesh.members
    arrays = [
        members.table,
        *(one for one in members.grid if isinstance(one, np.ndarray)),
        *members.grid.known,
        *mesh._tree[:2],
    ]
    assert sum(one.nbytes for one in (*arrays, mesh.group)) < 400 * len(mesh)


# --- What else a scene has -------------------------------------------------------------------------------


def test_what_a_mesh_does_not_go_with_is_one_sentence():
    mesh = box_of_triangles()
    scene, body = swarm.Scene([mesh]), swarm.dumbbell(0.1, 1.0)
    start = swarm.fill(scene, 3, speed=1.0, seed=1)
    cases = [
        (
            lambda: swarm.Union([mesh, swarm.Box((0.2, 0.2, 3.0))]),
            r"parts must not be Mesh in a Union of several rooms",
        ),
        (lambda: swarm.simulate(scene, start, swarm.Verlet(1e-3, 1e5), until=1.0), r"must not be Mesh with Verlet"),
        (lambda: swarm.simulate(scene, start, swarm.Trapezoidal(1e-3, 1e5), until=1.0), r"Mesh with Trapezoidal"),
        (
            lambda: swarm.simulate(scene, swarm.place(scene, body, 2, speed=1.0), swarm.Penalty(1e-3, 1e5), until=1.0),
            r"must not be Mesh with bodies and soft walls",
        ),
    ]
    for make, message in cases:
        with pytest.raises(swarm.SceneError, match=message) as caught:
            make()
        assert "\n" not in str(caught.value)


def test_a_mesh_beside_a_ball_that_moves():
    mesh = swarm.Mesh(*thorny())
    ball = swarm.Sphere(0.1, side="outside", motion=swarm.Oscillation((0.1, 0.0, 0.0), 1.0))
    scene, start = swarm.Scene([mesh, ball]), some_in(mesh, 0.25, 12)
    start = swarm.Particles(*(rows[:, ball.phi(start.position) > 0.0] for rows in (start.position, start.velocity)))
    end = swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile="never")
    assert end.observables["impacts"][-1] > 30
    assert mesh.phi(end.particles.position).max() < 1e-12


def test_a_solid_that_reaches_over_a_face_of_a_cell_that_repeats():
    corners, faces = thorny(n=8)
    scene = swarm.Scene([swarm.Mesh(0.3 * corners, faces, "outside", (0.05, 0.5, 0.5))], period=(1.0, 1.0, 1.0))
    start = swarm.fill(scene, 20, speed=1.0, seed=1)
    end = swarm.simulate(scene, start, swarm.Impact(), until=8.0, compile="never")
    assert end.observables["impacts"][-1] > 30
    assert scene.gaps(end.particles.position).max() < 1e-12


def test_the_picture_of_a_mesh_is_the_mesh():
    shapes = pytest.importorskip("swarm.triangles.shapes")
    (shape,) = shapes.shapes_of(swarm.Scene([box_of_triangles()]), np.zeros((3, 1)))
    assert shape.area() == pytest.approx(22.0)
