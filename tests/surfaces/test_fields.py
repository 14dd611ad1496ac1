"""Many bodies as one surface: the grid finds the first hit that a look at all of them finds, and none is missed."""

import math
import tomllib

import numpy as np
import pytest
import tomli_w
from conftest import compiled

import swarm
from swarm import scene_file
from swarm.common import checks
from swarm.errors import SceneError
from swarm.kernel.gravity import Gravity
from swarm.kernel.grid import cell_of, entries_of
from swarm.kernel.vector import vec
from swarm.serialization import tables
from swarm.surfaces import ALL_SURFACES
from swarm.surfaces import rotation as rotations
from swarm.surfaces.time_of_impact import flights

EPSILON = np.finfo(np.float64).eps
# Hits that are looked for: later a flight is far away.
LAST = 20.0
FALL = Gravity(0.3, -0.2, -1.0)


def turns(random, n):
    return random.standard_normal((n, 4))


KINDS = {
    "spheres": lambda random, c, r: swarm.Spheres(c, r),
    "posts": lambda random, c, r: swarm.Cylinders(c, r),
    "cylinders": lambda random, c, r: swarm.Cylinders(c, r, random.standard_normal(c.shape), 2.0 * r),
    "capsules": lambda random, c, r: swarm.Capsules(c, r, r, random.standard_normal(c.shape)),
    "boxes": lambda random, c, r: swarm.Boxes(c, np.outer(r, (1.0, 0.7, 0.5)), turns(random, len(c))),
    "boxes along the axes": lambda random, c, r: swarm.Boxes(c, np.outer(r, (1.0, 0.7, 0.5))),
    "ellipsoids": lambda random, c, r: swarm.Ellipsoids(c, np.outer(r, (1.0, 0.7, 0.5)), turns(random, len(c))),
}


def packing(kind, n=120, seed=1):
    """Bodies at random in a unit cube, which overlap."""
    random = np.random.default_rng(seed)
    return KINDS[kind](random, random.random((n, 3)), 0.02 + 0.08 * random.random(n))


def one_by_one(field):
    """The numbers of every body, as walls of their own."""
    return [wall for solid in field.solids() for wall in solid.walls()]


def balls_of(field):
    return [
        swarm.Sphere(r, tuple(c), "outside") for c, r in zip(field.centers.tolist(), field.radii.tolist(), strict=True)
    ]


def solids_of(field):
    return balls_of(field) if isinstance(field, swarm.Spheres) else field.solids()


def first_through_cells(scene, gravity, r, v):
    """The first hit as a particle finds it: from cell to cell."""
    pull = np.zeros(3) if gravity is None else np.array(gravity)
    walls, passed = scene.compiled().walls(), 0.0
    for _cell in range(10_000):
        time, wall = flights.first_hit(walls, gravity, vec(r), vec(v))
        if not passed + time < LAST:
            return math.inf, -1
        passed, r, v = passed + time, r + time * (v + 0.5 * time * pull), v + time * pull
        if wall >= 0.0:
            return passed, int(wall)
    raise AssertionError("no end")


@compiled
def hit(gravity, wall, r, v):
    """Compiled: it is asked a hundred thousand times, which is 0.1 to 2 ms each in plain Python."""
    return flights.hit(gravity, wall, r, v)


def first_of_all(walls, gravity, r, v):
    """The least of the first hits of all bodies."""
    least = math.inf, -1
    for number, wall in enumerate(walls):
        passed, here, speed = 0.0, r, v
        pull = np.zeros(3) if gravity is None else np.array(gravity)
        while passed < min(least[0], LAST):
            time, found = hit(gravity, wall, vec(here), vec(speed))
            passed, here, speed = passed + time, here + time * (speed + 0.5 * time * pull), speed + time * pull
            if found or not time < math.inf:
                break
        if passed < min(least[0], LAST):
            least = passed, number
    return least


@pytest.mark.parametrize("gravity", [None, FALL], ids=["straight", "falling"])
@pytest.mark.parametrize(("kind", "n"), [*((kind, 120) for kind in KINDS), ("spheres", 20)])
def test_no_hit_is_missed(kind, n, gravity):
    field = packing(kind, n)
    scene, walls = swarm.Scene([field]), [solid.walls()[0] for solid in solids_of(field)]
    random, off = np.random.default_rng(2), []
    points = random.uniform(-0.3, 1.3, (3, 400))
    points = points[:, (field.phi(points) > 0.0)][:, :150]
    with np.errstate(all="ignore"):
        for r in points.T:
            v = random.standard_normal(3)
            time, number = first_through_cells(scene, gravity, r, v)
            wanted, other = first_of_all(walls, gravity, r, v)
            assert (time == math.inf) == (wanted == math.inf)
            if wanted < math.inf:
                assert number == other
                off.append(abs(time - wanted))
    assert len(off) > n // 6
    # Where a flight grazes, the time is as uncertain as the root of the round-off of the place.
    assert np.median(off) <= 2.0 * EPSILON
    assert max(off) <= 1e-9


@pytest.mark.parametrize("kind", KINDS)
def test_phi_is_that_of_a_body_near_the_point(kind):
    field = packing(kind)
    points = np.random.default_rng(3).uniform(-0.2, 1.2, (3, 300))
    each = np.array([solid.phi(points) for solid in solids_of(field)])
    found = field.phi(points)
    assert ((found < 0.0) == (each.min(axis=0) < 0.0)).all()
    assert (field.contain(points) == (found < 0.0)).all()
    near = each.min(axis=0) < np.quantile(each.min(axis=0), 0.1)
    assert found[near] == pytest.approx(each.min(axis=0)[near], abs=1e-12)
    h = 1e-6
    steps = np.stack(
        [(field.phi(points + h * e) - field.phi(points - h * e)) / (2.0 * h) for e in np.eye(3)[:, :, None]]
    )
    smooth = np.abs(steps - field.gradient(points)).max(axis=0) < 1e-4
    assert smooth.mean() > 0.95


def test_the_cells_hold_what_reaches_into_them():
    field = packing("spheres", 500)
    members, random = field.members, np.random.default_rng(4)
    points = random.uniform(-0.2, 1.2, (3, 3000))
    inside = ((points[:, None, :] - field.centers.T[:, :, None]) ** 2).sum(axis=0) < field.radii[:, None] ** 2
    for point, bodies in zip(points.T, inside.T, strict=True):
        entries = members.grid.entries[slice(*entries_of(members.grid, cell_of(members.grid, vec(point)).number))]
        assert set(np.flatnonzero(bodies)) <= set(entries.tolist())


def test_memory_is_linear_in_the_bodies():
    sizes = []
    for side in (10, 20):
        places = np.stack(np.meshgrid(*3 * [np.arange(side, dtype=float)], indexing="ij"), -1).reshape(-1, 3)
        members = swarm.Spheres(places, 0.3).members
        sizes.append((members.table.nbytes + members.grid.first.nbytes + members.grid.entries.nbytes) / len(places))
    assert sizes[1] < 1.1 * sizes[0] < 110.0


def test_more_than_a_few_of_one_kind_are_one_field():
    def balls(n, **laws):
        return [swarm.Sphere(0.05, (0.15 * k - 0.45, 0.0, 0.0), "outside", **laws) for k in range(n)]

    box = swarm.Box((0.5, 0.5, 0.5))
    few, some, two = (
        swarm.Scene([*balls(n), box, *more]) for n, more in ((6, ()), (7, ()), (7, balls(7, friction=0.3)))
    )
    assert [len(scene.compiled().order.groups) for scene in (few, some, two)] == [0, 1, 2]
    # One row for each surface, in the order of the chain.
    assert some.compiled().numbering.surfaces_of_rows == [*range(7), 7, 7, 7]
    assert two.compiled().numbering.surfaces_of_rows == [*range(7), *range(8, 15), 7, 7, 7]


@pytest.mark.parametrize(
    ("build", "parts"),
    [
        (lambda: swarm.Spheres([[0, 0, 0], [1, 0, 0]], [0.1, -0.2]), ["radii[1]", "above 0", "got -0.2"]),
        (lambda: swarm.Spheres([[0, 0, 0], [1, 0, 0]], 0.0), ["radii", "above 0", "got 0"]),
        (lambda: swarm.Spheres([[0, 0, 0], [1, 0, 0]], [0.1, 0.1, 0.1]), ["radii", "2", "one for each", "(3,)"]),
        (lambda: swarm.Spheres([0, 0, 0], 0.1), ["centers", "(n, 3)", "(3,)"]),
        (lambda: swarm.Spheres(np.empty((0, 3)), 0.1), ["centers", "at least one row"]),
        (lambda: swarm.Spheres([[0, 0, math.nan]], 0.1), ["centers[0]", "finite", "nan"]),
        (lambda: swarm.Spheres([[0, 0, 0]], 0.1, side="in"), ["side", "outside", "inside"]),
        (lambda: swarm.Spheres(np.broadcast_to(0.0, (10**12, 3)), 0.1), ["centers", "memory", "bodies", "TB"]),
        (lambda: swarm.Cylinders([[0, 0, 0]], 0.1, (0, 0, 0)), ["axes", "not all 0"]),
        (lambda: swarm.Cylinders([[0, 0, 0]], 0.1, lengths=[-1.0]), ["lengths[0]", "above 0", "-1"]),
        (lambda: swarm.Boxes([[0, 0, 0]], (0.1, 0.0, 0.1)), ["half_widths", "above 0", "0.0"]),
        (lambda: swarm.Boxes([[0, 0, 0]], (0.1, 0.1)), ["half_widths", "3 numbers", "(2,)"]),
        (lambda: swarm.Ellipsoids([[0, 0, 0]], (1, 1, 1), [[0, 0, 0, 0]]), ["rotations[0]", "not all 0"]),
        (lambda: swarm.Boxes([[0, 0, 0]], (1, 1, 1), [np.eye(3), np.eye(3)]), ["rotations", "4 numbers", "(2, 3, 3)"]),
        (lambda: swarm.Boxes([[0, 0, 0]] * 2, (1, 1, 1), [np.eye(3), -np.eye(3)]), ["rotations[1]", "not mirrored"]),
        (lambda: swarm.Boxes([[0, 0, 0]], (1, 1, 1), 2 * np.eye(3)), ["rotations", "lengths of its rows", "2.0"]),
    ],
)  # fmt: skip
def test_bad_bodies_are_reported(build, parts):
    with pytest.raises(SceneError) as caught:
        build()
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_rotations_of_bodies_may_be_matrices():
    """A box that a matrix turns has the gap of one box with the same `rotation`, in each of the four largest parts."""
    turns = [{"axis": (1, 2, 3), "angle": 0.3}, {"axis": (9, 1, 2), "angle": 3.0}]
    turns += [{"axis": (1, -9, 2), "angle": 3.0}, {"axis": (2, 1, 9), "angle": 3.0}]
    matrices = np.stack([rotations.matrix(rotations.quaternion("rotation", turn)) for turn in turns])
    centers = np.array([[3.0 * i, 0.0, 0.0] for i in range(4)])
    boxes = swarm.Boxes(centers, (0.5, 0.3, 0.1), matrices)
    places = centers.T + np.array([[0.2], [0.45], [-0.35]])
    gaps = [
        swarm.Box((0.5, 0.3, 0.1), centers[i], "outside", rotation=turn).phi(places[:, i : i + 1])[0]
        for i, turn in enumerate(turns)
    ]
    assert boxes.phi(places) == pytest.approx(gaps, abs=1e-15)
    assert (swarm.Boxes(centers, (0.5, 0.3, 0.1), matrices[1]).rotations == boxes.rotations[1]).all()


def test_a_hundred_million_bodies_are_refused_with_their_memory(monkeypatch):
    """Before it is tried: of those that are turned ten times as much as of balls."""
    monkeypatch.setattr(checks, "memory", lambda: 16_000_000_000)
    places = np.broadcast_to(0.0, (10**8, 3))
    for build, memory in ((swarm.Spheres, "30 GB"), (swarm.Cylinders, "300 GB")):
        with pytest.raises(SceneError, match=rf"got 1e\+08 bodies, which take {memory}; this machine has 16 GB"):
            build(places, 0.1)


def test_a_packing_without_room_is_reported():
    places = np.stack(np.meshgrid(*3 * [np.linspace(-0.5, 0.5, 8)], indexing="ij"), -1).reshape(-1, 3)
    with pytest.raises(SceneError, match="must leave a volume for particles"):
        swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), swarm.Spheres(places, 0.15)])


def test_bodies_may_reach_through_a_wall():
    """What is admissible is outside of all bodies and within the wall."""
    places = np.array([[0.5, 0.0, 0.0], [-0.5, 0.2, 0.1], [0.0, 0.0, 0.62], [0.0, 0.1, 0.5]])
    scene = swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), swarm.Spheres(places, [0.2, 0.25, 0.15, 0.2])])
    start = swarm.fill(scene, 20, speed=1.0, seed=1)
    result = swarm.simulate(scene, start, swarm.Impact(), until=20.0, every=0.5, compile="never")
    assert (result.observables["impulse"][-1] > 0.0).all()
    assert result.observables["max_penetration"].max() < 1e-14
    assert (scene.gaps(result.particles.position) <= 1e-14).all()


def test_what_knows_no_fields_says_so():
    field, box = swarm.Spheres([[0.0, 0.0, 0.0]], 0.1), swarm.Box((0.5, 0.5, 0.5))
    scene, start = swarm.Scene([box, field]), swarm.Particles([0.3, 0, 0], [1, 0, 0])
    for method, remedy in (
        (swarm.Verlet(1e-3, 1e5), "use Impact"), (swarm.Trapezoidal(1e-3, 1e5), "use Impact"),
    ):  # fmt: skip
        with pytest.raises(SceneError, match=rf"surfaces\[1\] must not be Spheres with .*; {remedy}"):
            swarm.simulate(scene, start, method, until=0.1)
    with pytest.raises(SceneError, match=r"surfaces\[1\] must not be Spheres with bodies and soft walls"):
        swarm.simulate(scene, swarm.place(scene, swarm.dumbbell(0.1, 1.0), 1), swarm.Penalty(1e-3, 1e5), until=0.1)


def test_other_methods_take_listed_solids_one_by_one():
    """Five balls are a field for Impact, and walls of their own for a method with steps."""
    balls = [swarm.Sphere(0.05, (0.2 * k - 0.4, 0.0, 0.0), "outside") for k in range(5)]
    scene = swarm.Scene([swarm.Sphere(0.6), *balls])
    start = swarm.Particles([0.1, 0.3, 0.0], [0.1, -1.0, 0.05])
    soft = swarm.simulate(scene, start, swarm.Penalty(1e-3, 1e6), until=0.5, compile="never")
    assert soft.observables["impulse"].shape[1] == 6
    assert soft.observables["energy_error"].max() < 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_a_field_is_made_again_from_its_table(kind):
    field = packing(kind, 20)
    table = tomllib.loads(tomli_w.dumps(tables.table_of(field)))
    again = tables.of_kind(table, "surface", ALL_SURFACES)
    assert again.members.table.tobytes() == field.members.table.tobytes()
    assert again.members.grid.entries.tobytes() == field.members.grid.entries.tobytes()


COLUMNS = {
    "spheres": "radius",
    "cylinders": "radius,axis_x,axis_y,axis_z,length",
    "capsules": "radius,length,axis_x,axis_y,axis_z",
    "boxes": "half_x,half_y,half_z,q_w,q_x,q_y,q_z",
    "ellipsoids": "a,b,c,q_w,q_x,q_y,q_z",
}


@pytest.mark.parametrize("kind", COLUMNS)
def test_bodies_are_read_from_a_file(kind, tmp_path):
    field = packing(kind, 20)
    arrays = {name: getattr(field, name) for name in field.columns()}
    rows = np.column_stack(list(arrays.values()))
    header = ",".join(column for names in field.columns().values() for column in names)
    assert set(header.split(",")) == {"x", "y", "z", *COLUMNS[kind].split(",")}
    np.savetxt(tmp_path / "packing.csv", rows, fmt="%.17g", delimiter=",", header=header, comments="")
    text = f"""
[particles]
count = 1
speed = 1.0
[[surface]]
kind = "box"
half_widths = [2.0, 2.0, 2.0]
[[surface]]
kind = "{kind}"
from = "packing.csv"
friction = 0.1
[method]
kind = "impact"
[run]
until = 1.0
"""
    (tmp_path / "scene.toml").write_text(text)
    read = scene_file.read(tmp_path / "scene.toml").scene.surfaces[1]
    for name, values in arrays.items():
        assert getattr(read, name).tobytes() == np.ascontiguousarray(values).tobytes()
    (tmp_path / "scene.toml").write_text(text.replace("friction = 0.1", "centers = [[0, 0, 0]]"))
    with pytest.raises(SceneError, match=r"surface\[1\].centers: cannot be combined with from = 'packing.csv'"):
        scene_file.read(tmp_path / "scene.toml")
    (tmp_path / "packing.csv").write_text("x,y,z\n0,0,0\n")
    (tmp_path / "scene.toml").write_text(text)
    with pytest.raises(SceneError, match=r"surface\[1\].from: .*packing.csv: expected the columns x, y, z, .*missing"):
        scene_file.read(tmp_path / "scene.toml")


def test_a_long_field_is_kept_as_arrays(tmp_path):
    """Of a trajectory's text it is a digest; a text of 100 MB would be lost."""
    field = packing("cylinders", 1001)
    scene = swarm.Scene([swarm.Box((0.7, 0.7, 0.7), (0.5, 0.5, 0.5)), field])
    start = swarm.fill(scene, 3, speed=1.0, seed=1)
    path = tmp_path / "run.h5"
    swarm.simulate(scene, start, swarm.Impact(), until=0.01, trajectory=path, compile="never")
    with swarm.load(path) as trajectory:
        again = trajectory.scene.surfaces[1]
        assert len(trajectory.descriptions["scene"]) < 2000
    for name in ("centers", "radii", "axes", "lengths"):
        assert getattr(again, name).tobytes() == getattr(field, name).tobytes()
    thinner = swarm.Cylinders(field.centers, 0.9 * field.radii, field.axes, field.lengths)
    other = swarm.Scene([scene.surfaces[0], thinner])
    with pytest.raises(SceneError, match="scene"):
        swarm.simulate(
            other, start, swarm.Impact(), until=0.02, trajectory=path, resume=True, checkpoint=9.0, compile="never"
        )
