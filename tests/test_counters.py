"""Counters: they change no bit of a motion, and count each crossing once, out and back."""

import functools
import math

import numpy as np
import pytest
from conftest import rarely
from same_bits import require_same
from test_sessions import stopped_at

import swarm
from swarm.kernel.random import Seeding
from swarm.run.engine import Run
from swarm.run.tally import Watched
from swarm.surfaces.counter import checked_counters
from swarm.surfaces.instant import side_of

PULL = (0.3, 0.1, -2.0)
SPHERE = swarm.Scene([swarm.Sphere(0.5)])
# What slides takes a third of the steps of the default.
METHOD = swarm.Impact(sliding_tolerance=1e-7)
SHAPES = [
    swarm.Plane((1.0, 0.0, 0.0), 0.1), swarm.Sphere(0.2), swarm.Sphere(0.15, (0.1, 0.0, 0.0), side="outside"),
    swarm.Box((0.1, 0.2, 0.1)), swarm.Cylinder(0.1), swarm.Torus(0.2, 0.05), swarm.Capsule(0.1, 0.2),
    swarm.Ellipsoid((0.1, 0.2, 0.1), rotation={"axis": (1.0, 1.0, 0.0), "angle": 0.5}),
    swarm.Union([swarm.Sphere(0.1), swarm.Sphere(0.1, (0.15, 0.0, 0.0))]), swarm.Plane((0.2, 0.3, 1.0), -0.05),
    swarm.Spheres([[0.2, 0.0, 0.0], [-0.2, 0.1, 0.0]], [0.1, 0.07]), swarm.Formula("x**4 + y**4 + z**4 - 0.0016"),
]  # fmt: skip
SCENES = {
    "box": swarm.Scene([swarm.Box((0.5, 0.4, 0.3))]),
    "fall": swarm.Scene([swarm.Ellipsoid((0.5, 0.4, 0.45))], PULL),
    "restless": swarm.Scene([swarm.Sphere(0.5, restitution=0.3, friction=0.05)], PULL),
    "moving": swarm.Scene(
        [swarm.Sphere(0.5, restitution=0.5, motion=swarm.Oscillation((0.05, 0.02, 0.05), 1.0))], PULL
    ),
    "open": swarm.Scene([swarm.Sphere(0.5, openings=[swarm.Sphere(0.2, (0.0, 0.0, -0.5))])]),
    "rooms": swarm.Scene([swarm.Union([swarm.Sphere(0.4), swarm.Sphere(0.3, (0.5, 0.0, 0.0))])]),
    "thermal": swarm.Scene([swarm.Sphere(0.5, temperature=0.3)]),
    "restless and open": swarm.Scene(
        [swarm.Sphere(0.5, restitution=0.3, friction=0.05, openings=[swarm.Sphere(0.2, (0.0, 0.0, -0.5))])], PULL
    ),
}


def run(scene, counters, n=10, until=1.0, seed=1, **keywords):
    keywords = {"compile": "never", "threads": 1, "every": until / 2.0, **keywords}
    start = keywords.pop("start", None) or swarm.fill(scene, n, temperature=0.3, seed=seed)
    return start, swarm.simulate(scene, start, METHOD, until=until, counters=counters, **keywords)


@functools.cache
def run_of(name):
    """The run of a scene with all counters, which tests hold others against."""
    return run(SCENES[name], SHAPES)


def outside(surface, points):
    return side_of(surface) * surface.phi(points) > 0.0


def one(position, velocity):
    return swarm.Particles(np.array(position, float), np.array(velocity, float))


def counted(scene, counters, start, until, **keywords):
    return run(scene, counters, start=start, until=until, **keywords)[1].observables["crossings"][-1].tolist()


# --- Of any scene ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in SCENES if name != "restless and open"])
def test_they_change_no_bit_and_count_particles_outside(name):
    start, result = run_of(name)
    _start, alone = run(SCENES[name], ())
    for key, values in alone.observables.items():
        assert values.tobytes() == result.observables[key].tobytes(), key
    assert alone.particles.position.tobytes() == result.particles.position.tobytes()
    assert alone.particles.velocity.tobytes() == result.particles.velocity.tobytes()
    assert "crossings" not in alone.observables
    crossings = result.observables["crossings"]
    assert crossings.dtype == np.int64
    assert crossings.shape == (3, len(SHAPES), 2)
    assert (crossings[0] == 0).all()
    assert crossings[-1].sum() > 20
    for k, surface in enumerate(SHAPES):
        change = outside(surface, result.particles.position).sum() - outside(surface, start.position).sum()
        assert crossings[-1, k, 0] - crossings[-1, k, 1] == change, surface


@pytest.mark.parametrize("name", ["fall", "restless", "moving"])
def test_each_is_a_change_of_side_in_frames_that_are_close(name):
    scene, shapes = SCENES[name], SHAPES[:7]
    start, result = run(scene, shapes, 8, 0.6)
    seen = {"outside": lambda frame: np.concatenate([outside(one, frame.position) for one in shapes]).astype(float)}
    # The same bits as of plain Python, whose steps from frame to frame take longer than the kernel.
    fine = run(scene, (), start=start, until=0.6, every=1e-3, observables=seen, compile="always")[1]
    assert result.observables["crossings"][-1].sum() > 5
    sides = fine.observables["outside"].reshape(-1, len(shapes), len(start))
    assert len(sides) == 601
    for k in range(len(shapes)):
        changes = np.diff(sides[:, k], axis=0)
        # A corner may be cut in less than a frame.
        missed = result.observables["crossings"][-1, k] - [(changes > 0).sum(), (changes < 0).sum()]
        assert missed.min() >= 0
        assert missed.max() <= 1


@pytest.mark.parametrize("name", ["box", "restless", "thermal"])
def test_rows_of_the_log_are_the_crossings(name, tmp_path):
    path = tmp_path / "i.h5"
    _start, result = run(SCENES[name], SHAPES, impacts=path)
    require_same(result, run_of(name)[1])
    with swarm.load_impacts(path) as log:
        table, crossings = log.table(), log.crossings()
        assert log.counts().sum() == result.impacts_per_particle.sum() == len(log.table(surfaces=0))
        assert [counter.surface for counter in log.counters] == SHAPES
    assert crossings.tolist() == result.observables["crossings"][-1].tolist()
    rows, impacts = table[table["counter"] >= 0], table[table["counter"] < 0]
    assert (rows["surface"] == -1).all()
    assert (rows["impulse"] == 0.0).all()
    assert (rows["velocity_before"] == rows["velocity_after"]).all()
    assert (impacts["sense"] == -1).all()
    assert (np.diff(table["time"]) >= 0.0).all()
    for k, surface in enumerate(SHAPES):
        mine = rows[rows["counter"] == k]
        places, v = mine["position"].T, mine["velocity_before"].T
        slope = surface.gradient(places) * side_of(surface)
        # What slides crosses within a step.
        gap = np.abs(surface.phi(places)) / np.sqrt((slope**2).sum(axis=0))
        assert gap.max(initial=0.0) < (1e-3 if name == "restless" else 1e-12)
        across = (slope * v).sum(axis=0) / np.sqrt((slope**2).sum(axis=0))
        for sense in (0, 1):
            of = mine["sense"] == sense
            if name != "restless":
                assert (across[of] * (1 - 2 * sense) > 0.0).all()
            observed = {key: result.observables[f"crossed_{key}"][-1, k, sense] for key in ("momentum", "energy")}
            np.testing.assert_allclose(observed["momentum"], v[:, of].sum(axis=1), atol=1e-12)
            np.testing.assert_allclose(observed["energy"], 0.5 * (v[:, of] ** 2).sum(), rtol=1e-12)
            slowness = result.observables["crossed_slowness"][-1, k, sense]
            if name != "restless":
                np.testing.assert_allclose(slowness, (1.0 / np.abs(across[of])).sum(), rtol=1e-6)


# --- The same bits ---------------------------------------------------------------------------------------


@pytest.mark.level3
@pytest.mark.parametrize("name", ["box"])
def test_any_threads_and_blocks_count_the_same(name):
    _start, alone = run(SCENES[name], SHAPES[:3], 600, 0.2)
    for threads, size in ((2, 512), (3, 1)):
        require_same(run(SCENES[name], SHAPES[:3], 600, 0.2, threads=threads, block_size=size)[1], alone)


@pytest.mark.level3
@pytest.mark.physics
@pytest.mark.parametrize("name", ["box", *map(rarely, ("fall", "restless", "moving", "open")), "restless and open"])
def test_kernels_that_are_compiled_count_the_same(name, tmp_path):
    """All kinds of counters in a box, and two of them where particles slide and escape."""
    shapes = SHAPES[:2] if name == "restless and open" else SHAPES[:5]
    _start, compiled = run(SCENES[name], shapes, 20, compile="always", threads=2)
    require_same(run(SCENES[name], shapes, 20, impacts=tmp_path / "i.h5")[1], compiled)


@pytest.mark.parametrize("name", ["box", "restless", "open"])
def test_halts_and_sessions_lose_and_repeat_none(name):
    scene, shapes = SCENES[name], SHAPES[:4]
    start, whole = run(scene, shapes, 6)

    def begun():
        watched = Watched(None, None, checked_counters("counters", shapes))
        return Run(scene.compiled(), start.copy(), METHOD, 1, None, "never", Seeding(), watched)

    halts, run_of = 0, begun()
    for moment in (0.5, 1.0):
        passes = 1
        while True:
            run_of.halt(passes)
            done = run_of.advance(0.5, moment)
            kept = {key: array.copy() for key, array in run_of.arrays().items()}
            run_of.__exit__()
            if done and moment == 1.0:
                break
            run_of = begun()
            run_of.restore(kept, not done)
            if done:
                break
            halts, passes = halts + 1, 2 * passes
    assert halts > 1
    for key in ("number", "sums"):
        sums = kept[f"crossed.{key}"].sum(axis=1)
        observed = whole.observables
        if key == "number":
            assert sums.reshape(-1, 2).tolist() == observed["crossings"][-1].tolist()
        else:
            np.testing.assert_allclose(sums.reshape(-1, 2, 5)[..., 3], observed["crossed_energy"][-1], rtol=1e-13)


def test_a_run_that_is_resumed_counts_on(tmp_path):
    path, more = tmp_path / "run.h5", {"compile": "never", "counters": SHAPES[:2]}
    stopped_at(path, 2, **more)
    start = swarm.fill(SPHERE, 20, speed=1.0, seed=1)

    def ended(**keywords):
        return swarm.simulate(SPHERE, start, swarm.Impact(), until=2.0, every=0.5, **more | keywords)

    with pytest.raises(swarm.SceneError, match=r"is of another run: its counters are .*plane"):
        ended(trajectory=path, resume=True, counters=SHAPES[1:2])
    require_same(ended(trajectory=path, resume=True), ended())
    with swarm.load(path) as written:
        assert [counter.surface for counter in written.counters] == SHAPES[:2]
        assert written.observed()["crossed_momentum"].shape == (5, 2, 2, 3)
        assert "crossed_momentum_0_1_x" in written.table()
        assert written.to_xarray()["crossings"].dims == ("time", "counter", "sense")


# --- Where they are --------------------------------------------------------------------------------------


def test_a_diameter_crosses_twice_each_way_and_back():
    """Through a sphere, a plane, and a patch of it, at known instants."""
    counters = [swarm.Sphere(0.2), swarm.Plane((0.0, 1.0, 0.0)), swarm.Plane((2.0, 0.0, 0.0))]
    start = one([-0.5, 0.1, 0.0], [1.0, 0.0, 0.0])
    start.position[0] = -math.sqrt(0.25 - 0.01)
    assert counted(SPHERE, counters[:2], start, 0.9) == [[1, 1], [0, 0]]
    assert counted(SPHERE, counters, one([-0.5, 0.0, 0.0], [1.0, 0.0, 0.0]), 10.25) == [[10, 10], [0, 0], [5, 5]]


@pytest.mark.parametrize("gravity", [None, (0.0, 0.0, -1e-9)])
def test_on_a_wall_it_counts_nobody(gravity):
    scene = swarm.Scene([swarm.Sphere(0.5)], gravity)
    counters = [swarm.Sphere(0.5), swarm.Sphere(0.5, side="outside"), swarm.Ellipsoid((0.5, 0.5, 0.5))]
    _start, result = run(scene, counters, 40, 5.0)
    assert result.impacts_per_particle.sum() > 200
    assert result.observables["crossings"][-1].tolist() == [[0, 0]] * 3


def test_a_particle_that_starts_on_it_is_on_its_admissible_side():
    plane = swarm.Plane((1.0, 0.0, 0.0), 0.1)
    for v, expected in ((1.0, [1, 0]), (-1.0, [0, 0])):
        assert counted(SPHERE, [plane], one([0.1, 0.0, 0.0], [v, 0.0, 0.0]), 0.2) == [expected]
    middle = swarm.Plane((1.0, 0.0, 0.0))
    for v in (0.0, 1.0):
        assert counted(SPHERE, [middle], one([0.0, 0.1, 0.0], [0.0, v, 0.0]), 5.0) == [[0, 0]]


@pytest.mark.parametrize("off", [-1e-3, -1e-9, 0.0, 1e-9, 1e-3])
def test_a_tangent_is_crossed_in_pairs(off):
    """A chord past a ball goes in and out again, or neither."""
    (back_and_out,) = counted(SPHERE, [swarm.Sphere(0.2)], one([-0.4, 0.2 + off, 0.0], [1.0, 0.0, 0.0]), 0.7)
    assert back_and_out in ([[1, 1]] if off < 0.0 else [[0, 0]] if off > 0.0 else [[0, 0], [1, 1]])


def test_frames_that_end_on_it_count_once():
    """A frame ends on the plane, to the last digit: a particle that crosses it counts in the next one."""
    start = one([-0.25, 0.0, 0.0], [0.5, 0.0, 0.0])
    _start, result = run(SPHERE, [swarm.Plane((1.0, 0.0, 0.0))], start=start, until=1.0, every=0.25)
    assert result.observables["crossings"][:, 0, 0].tolist() == [0, 0, 0, 1, 1]


def test_at_the_mouth_of_an_opening_it_counts_escapes():
    mouth = swarm.Cylinder(0.4, axis=(1.0, 0.0, 0.0), length=0.1, center=(0.5, 0.0, 0.0))
    box = swarm.Box((0.5, 0.5, 0.5), openings=[swarm.Opening(mouth, times=[(0.5, 10.0)])])
    counters = [swarm.Plane((1.0, 0.0, 0.0), 0.5), swarm.Counter(swarm.Plane((-1.0, 0.0, 0.0), -0.5), inside=mouth)]
    _start, result = run(swarm.Scene([box]), counters, 60, 4.0)
    escaped = int(np.isfinite(result.escape_time).sum())
    assert escaped > 3
    assert result.observables["crossings"][-1].tolist() == [[escaped, 0], [0, escaped]]
    assert result.observables["crossings"][-1, 0, 0] == result.observables["escaped"][-1]


def test_in_a_doorway_between_rooms():
    """Where two boxes touch at an open door, and where they overlap."""
    door = swarm.Box((0.1, 0.2, 0.2), (0.5, 0.0, 0.0))
    rooms = [swarm.Box((0.5, 0.5, 0.5), openings=[door]), swarm.Box((0.5, 0.5, 0.5), (1.0, 0.0, 0.0), openings=[door])]
    scene = swarm.Scene([swarm.Union(rooms)])
    plane = swarm.Plane((1.0, 0.0, 0.0), 0.5)
    start, result = run(scene, [plane, swarm.Counter(plane, inside=door)], 60, 4.0)
    (out, back), through = result.observables["crossings"][-1].tolist()
    assert out > 5
    assert out - back == outside(plane, result.particles.position).sum() - outside(plane, start.position).sum()
    assert through == [out, back]


@pytest.mark.parametrize("inside", [swarm.Sphere(0.2), swarm.Spheres([[0.0, 0.1, 0.0]], [0.2]), swarm.Box((0.2,) * 3)])
def test_a_patch_counts_what_is_within_its_volume(inside, tmp_path):
    plane = swarm.Plane((1.0, 0.0, 0.0))
    _start, result = run(SPHERE, [plane, swarm.Counter(plane, inside=inside)], 40, 3.0, impacts=tmp_path / "i.h5")
    require_same(result, run(SPHERE, [plane, swarm.Counter(plane, inside=inside)], 40, 3.0)[1])
    with swarm.load_impacts(tmp_path / "i.h5") as log:
        rows = log.table()
    all_of_them, within = (rows[rows["counter"] == k] for k in (0, 1))
    sign = 1.0 if isinstance(inside, swarm.Spheres) else side_of(inside)
    expected = all_of_them[sign * inside.phi(all_of_them["position"].T) <= 0.0]
    assert 3 < len(within) < len(all_of_them)
    assert within["time"].tolist() == expected["time"].tolist()


# --- In a cell that repeats ------------------------------------------------------------------------------

CELL = (1.0, 0.8, None)
SLAB = swarm.Scene([swarm.Plane((0.0, 0.0, 1.0), 0.6), swarm.Plane((0.0, 0.0, -1.0), 0.0)], period=CELL)
CELLS = {
    "slab": SLAB,
    "balls": swarm.Scene([*SLAB.surfaces, swarm.Sphere(0.2, (0.5, 0.4, 0.3), side="outside")], period=CELL),
    "fall": swarm.Scene(SLAB.surfaces, (0.3, -0.1, -1.0), CELL),
    "slide": swarm.Scene(
        [swarm.Cylinder(0.25, axis=(1.0, 0.0, 0.0), center=(0.0, 0.4, 0.3), restitution=0.2)],
        (0.1, 0.0, -1.0),
        (1.0, None, None),
    ),
}


@pytest.mark.parametrize("name", CELLS)
def test_planes_across_a_cell_count_each_passage(name):
    """At the faces too: the coordinate in all cells says how often."""
    planes = [swarm.Plane((sign, 0.0, 0.0), sign * x) for x in (0.3, 0.0, 1.0) for sign in (1.0, -1.0)]
    scene = CELLS[name]
    start, result = run(scene, planes, 8, 4.0)
    _start, alone = run(scene, (), 8, 4.0)
    assert alone.particles.position.tobytes() == result.particles.position.tobytes()
    assert abs(result.particles.image).max() > 2
    x0, x1 = (one.position[0] + image for one, image in ((start, 0.0), (result.particles, result.particles.image[0])))
    for plane, (out, back) in zip(planes, result.observables["crossings"][-1].tolist(), strict=True):
        sign, x = plane.normal[0], plane.offset * plane.normal[0]
        assert out - back == sign * (np.floor(x1 - x) - np.floor(x0 - x)).sum(), plane
        assert out + back > 3


def test_a_ball_at_a_corner_of_a_cell_is_one(tmp_path):
    """As a ball in the middle of the cell, of particles that are shifted by half of it."""
    shift = np.array([[0.5], [0.4], [0.0]])
    start = swarm.fill(SLAB, 20, temperature=0.3, seed=2)
    middle = swarm.Particles((start.position + shift) % np.array([[1.0], [0.8], [math.inf]]), start.velocity)
    corner = counted(SLAB, [swarm.Sphere(0.25, (0.0, 0.0, 0.3))], start, 4.0)
    assert corner == counted(SLAB, [swarm.Sphere(0.25, (0.5, 0.4, 0.3))], middle, 4.0)
    assert min(corner[0]) > 5
    solid = counted(SLAB, [swarm.Sphere(0.25, (0.0, 0.0, 0.3), side="outside")], start, 4.0, impacts=tmp_path / "i.h5")
    assert solid == [corner[0][::-1]]


# --- Wrong input -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("counters", "sentence"),
    [
        (swarm.Sphere(0.1), "counters must be a list of surfaces"),
        ([1.0], r"counters\[0\] must be a surface such as swarm.Plane, got 1.0"),
        (
            [swarm.Sphere(0.1), swarm.Sphere(0.1, restitution=0.5)],
            r"counters\[1\].restitution must be left out, a count",
        ),
        ([swarm.Sphere(0.1, friction=0.5)], r"counters\[0\].friction must be left out"),
        ([swarm.Sphere(0.1, temperature=0.5)], r"counters\[0\].temperature must be left out"),
        ([swarm.Sphere(0.1, motion=swarm.Translation((1.0, 0.0, 0.0)))], r"counters\[0\].motion must be left out"),
        ([swarm.Sphere(0.1, present=[(0.0, 1.0)])], r"counters\[0\].present must be left out"),
        (
            [swarm.Sphere(0.1, openings=[swarm.Sphere(0.05, (0.1, 0.0, 0.0))])],
            r"counters\[0\].openings must be left out",
        ),
        (
            [swarm.Plane((1.0, 0.0, 0.0), 0.01 * k) for k in range(30)],
            "counters must have at most 24 walls in all, got 30",
        ),
    ],
)
def test_what_is_no_counter_is_refused(counters, sentence):
    with pytest.raises(swarm.SceneError, match=sentence):
        run(SPHERE, counters)


def test_meshes_and_prisms_are_refused():
    corners = 0.2 * np.array([[-1.0, -1.0, -1.0], [1.0, -1.0, -1.0], [0.0, 1.0, -1.0], [0.0, 0.0, 1.0]])
    mesh = swarm.Mesh(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    for counter, name in ((mesh, ""), (swarm.Counter(swarm.Sphere(0.1), inside=mesh), ".inside")):
        with pytest.raises(swarm.SceneError, match=rf"counters\[0\]{name} must not be of a Mesh, which .*from_mesh"):
            run(SPHERE, [counter])
    with pytest.raises(swarm.SceneError, match=r"counters\[0\] must be a surface with two sides, got Prism"):
        run(SPHERE, [swarm.Prism(TRIANGLE, 0.3)])


# Surfaces of other kinds, and particles of a plane.
TRIANGLE = [(-0.2, -0.2), (0.2, -0.2), (0.0, 0.2)]
OTHERS = {
    "foam": (SPHERE, swarm.Spheres([[0.0, 0.0, 0.0], [0.15, 0.0, 0.0]], [0.1, 0.1], side="inside")),
    "solid union": (SPHERE, swarm.Union([swarm.Sphere(0.1), swarm.Box((0.1,) * 3, (0.1, 0.0, 0.0))], side="outside")),
    "bored": (SPHERE, swarm.Intersection([swarm.Sphere(0.2), swarm.Cylinder(0.05, side="outside")])),
    "polygon": (swarm.Scene([swarm.Stadium(0.5, 0.5)], plane="z"), swarm.Polygon(TRIANGLE)),
    "stadium": (swarm.Scene([swarm.Stadium(0.5, 0.5)], plane="z"), swarm.Stadium(0.3, 0.3)),
}  # fmt: skip


@pytest.mark.parametrize("name", OTHERS)
def test_surfaces_of_other_kinds(name):
    scene, surface = OTHERS[name]
    start, result = run(scene, [surface], 30, 2.0)
    ((out, back),) = result.observables["crossings"][-1].tolist()
    assert out + back > 2
    assert out - back == outside(surface, result.particles.position).sum() - outside(surface, start.position).sum()


def test_a_volume_must_be_one():
    with pytest.raises(swarm.SceneError, match=r"inside must be a surface such as swarm.Plane, got 'all'"):
        swarm.Counter(swarm.Sphere(0.1), inside="all")
    with pytest.raises(swarm.SceneError, match=r"inside.restitution must be left out, it is no wall"):
        swarm.Counter(swarm.Sphere(0.1), inside=swarm.Sphere(0.1, restitution=0.2))
    with pytest.raises(swarm.SceneError, match=r"surface must be a surface"):
        swarm.Counter([swarm.Sphere(0.1)])


def test_methods_without_counters_are_refused():
    start = swarm.fill(SPHERE, 3, speed=1.0, seed=1)
    sentence = "a contact_step of 0.001, got 1; leave contact_step out"
    with pytest.raises(swarm.SceneError, match=rf"counters must be left out with {sentence}"):
        swarm.simulate(SPHERE, start, swarm.Impact(contact_step=1e-3), until=1.0, counters=[swarm.Sphere(0.1)])
    fast = one([0.5, 0.4, 0.3], [1e9, 0.0, 0.0])
    with pytest.raises(
        swarm.SceneError, match=r"period\[0\] must be so long that particles come through at most 1e\+07"
    ):
        swarm.simulate(SLAB, fast, swarm.Impact(), until=1.0, counters=SHAPES[:1])
