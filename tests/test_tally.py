"""Impacts counted on each member of a surface: those of the log, for any threads, halts and sessions."""

import math

import numpy as np
import pytest
from conftest import rarely
from test_impacts import BALLS, DOWN, LISTED, SCENES, SPHERE, table_of
from test_sessions import stopped_at

import swarm
from swarm.kernel.random import Seeding
from swarm.lanes.watching.counts import PARTS, Sums
from swarm.run.engine import Run
from swarm.run.tally import Tally, Units, Watched, value_of

# What slides takes a third of the steps of the default.
METHOD = swarm.Impact(sliding_tolerance=1e-7)
MANY = {
    **SCENES,
    "fields and a list": swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), *LISTED, BALLS], DOWN, None),
    "restless": swarm.Scene([swarm.Box((0.5, 0.5, 0.5), restitution=0.6), BALLS], DOWN),
    "open": swarm.Scene([swarm.Sphere(0.5, openings=[swarm.Sphere(0.3, (0.0, 0.0, -0.5))]), BALLS]),
}


def run(scene, n=12, until=2.0, **keywords):
    keywords = {"compile": "never", "threads": 1, "member_impacts": True, **keywords}
    start = swarm.fill(scene, n, speed=1.0, seed=1)
    return swarm.simulate(scene, start, METHOD, until=until, every=keywords.pop("every", min(until, 1.0)), **keywords)


def require_same(one, other):
    for counts, others in zip(one.member_impacts, other.member_impacts, strict=True):
        assert counts.dtype == others.dtype == np.int64
        assert counts.tolist() == others.tolist()
    for name, values in one.observables.items():
        assert not name.startswith("member_") or values.tobytes() == other.observables[name].tobytes(), name


def of_log(scene, path):
    """The same from the rows of a log."""
    table = table_of(path)
    table = table[table["impulse"] != 0.0]
    for s, surface in enumerate(scene.surfaces):
        members = len(surface) if isinstance(surface, swarm.Spheres) else 1
        yield np.bincount(np.maximum(table["member"][table["surface"] == s], 0), minlength=members).tolist()


@pytest.mark.parametrize("name", MANY)
def test_they_are_the_rows_of_the_log(tmp_path, name):
    scene = MANY[name]
    result = run(scene, impacts=tmp_path / "i.h5", until=3.0)
    assert [counts.tolist() for counts in result.member_impacts] == list(of_log(scene, tmp_path / "i.h5"))
    assert sum(counts.sum() for counts in result.member_impacts) == result.impacts_per_particle.sum() > 4


def test_they_are_the_same_alone_and_of_any_threads_and_blocks():
    scene = MANY["restless"]
    one = run(scene, 300, 0.3)
    for threads, size in ((2, 256), (3, 1)):
        require_same(run(scene, 300, 0.3, threads=threads, block_size=size), one)
    assert (one.member_impacts[1] > 0).sum() > 6
    assert sum(counts.sum() for counts in one.member_impacts) == one.observables["impacts"][-1]


@pytest.mark.physics
@pytest.mark.parametrize("name", [rarely("restless"), "thermal", "cell that repeats"])
def test_kernels_that_are_compiled_count_the_same(name):
    one = run(MANY[name], 300, 2.0, compile="always", threads=2)
    require_same(run(MANY[name], 300, 2.0), one)


def test_halts_and_sessions_lose_and_repeat_none(tmp_path):
    scene, whole = MANY["restless"], run(MANY["restless"], 30, 2.0)
    start, halts = swarm.fill(scene, 30, speed=1.0, seed=1), 0

    def begun():
        tally = Tally(scene.compiled().numbering.members, Units(2.0**-10))
        return Run(scene.compiled(), start.copy(), METHOD, 1, None, "never", Seeding(), Watched(None, tally)), tally

    one, tally = begun()
    for moment in (1.0, 2.0):
        passes = 1
        while True:
            one.halt(passes)
            done = one.advance(1.0, moment)
            kept = {name: array.copy() for name, array in one.arrays().items()}
            one.__exit__()
            one, tally = begun()
            one.restore(kept, not done)
            if done:
                break
            halts, passes = halts + 1, 2 * passes
    one.__exit__()
    assert halts > 3
    for counts, others in zip(
        whole.member_impacts, scene.compiled().numbering.split(tally.seen()["member_impacts"]), strict=True
    ):
        assert counts.tolist() == others.tolist()


def test_a_run_that_is_resumed_counts_on(tmp_path):
    path, more = tmp_path / "run.h5", {"compile": "never", "member_impacts": True}
    stopped_at(path, 2, **more)
    start = swarm.fill(SPHERE, 20, speed=1.0, seed=1)

    def ended(**keywords):
        return swarm.simulate(SPHERE, start, swarm.Impact(), **{"until": 2.0, "every": 0.5} | more | keywords)

    with pytest.raises(swarm.SceneError, match="its member_impacts is True, got False"):
        ended(trajectory=path, resume=True, member_impacts=False)
    require_same(ended(trajectory=path, resume=True), ended())
    # Also where it goes on for longer.
    stopped_at(tmp_path / "longer.h5", 2, **more)
    require_same(ended(trajectory=tmp_path / "longer.h5", resume=True, until=5.0), ended(until=5.0))


def test_without_it_there_is_none():
    assert run(SPHERE, member_impacts=False).member_impacts is None
    (counts,) = run(SPHERE).member_impacts
    assert counts.shape == (1,)


BALL = swarm.Sphere(0.1, side="outside")
KINDS = {
    "penalty": (swarm.Scene([swarm.Sphere(0.5), BALL]), swarm.Penalty(dt=0.02, penalty=1e4)),
    "corners": (
        swarm.Scene(
            [swarm.Box((0.5, 0.5, 0.5)), swarm.Sphere(0.2, (0.5, 0.5, -0.5), side="outside")], (0.3, 0.2, -1.0)
        ),
        swarm.Penalty(dt=0.02, penalty=1e3),
    ),
    "loops": (swarm.Scene([swarm.Sphere(0.5), BALL]), swarm.AugmentedLagrangian(dt=0.05, penalty=1e3, adaptive=True)),
    "contact steps": (swarm.Scene([swarm.Sphere(0.5), BALL]), swarm.Impact(contact_step=1e-2)),
    "walls that react": (swarm.Scene([swarm.Sphere(0.5, mass=3.0), swarm.Box((0.7, 0.7, 0.7)), BALL]), swarm.Impact()),
    "bodies": (
        swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), swarm.Sphere(0.3, side="outside")], DOWN),
        swarm.Impact(dt=0.02),
    ),
    "bodies on springs": (
        swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), swarm.Sphere(0.3, side="outside")], DOWN),
        swarm.Penalty(dt=0.01, penalty=1e4),
    ),
    "lossy field": (
        swarm.Scene([swarm.Sphere(0.5, restitution=0.6, friction=0.2), BALLS], DOWN),
        swarm.Impact(shortest_flight=1e-2, sliding_tolerance=1e-6),
    ),
}


@pytest.mark.parametrize("name", KINDS)
def test_those_of_all_members_are_those_of_all_particles_in_every_kind_of_run(name, tmp_path):
    scene, method = KINDS[name]
    if "bodies" in name:
        start = swarm.place(scene, swarm.dumbbell(0.1, 1.0), 12, speed=1.0, seed=1)
    else:
        start = swarm.fill(scene, 10 if name == "lossy field" else 20, speed=1.0, seed=1)
    path = tmp_path / "run.h5"
    more = {"until": 2.0, "every": 0.5, "compile": "never"}
    result = swarm.simulate(scene, start, method, member_impacts=True, trajectory=path, **more)
    seen, bare = result.observables, swarm.simulate(scene, start, method, **more).observables
    for key, values in bare.items():
        assert values.tobytes() == seen[key].tobytes(), key
    assert seen["member_impacts"].sum(axis=1).tolist() == seen["impacts"].tolist()
    assert min(counts.sum() for counts in result.member_impacts) > 0
    if "member_residence" in seen:
        assert seen["member_residence"].sum(axis=1) == pytest.approx(seen["sliding_time"], rel=1e-13, abs=1e-13)
    with swarm.load(path) as written:
        for k in (-1, 2):
            impulses = written.members(k)
            assert np.concatenate(impulses["impacts"]).tolist() == seen["member_impacts"][k].tolist()
        assert [len(one) for one in impulses["impacts"]] == [len(one) for one in result.member_impacts]
        assert "member_impacts" in written.to_xarray()
        assert not any("member" in column for column in written.table().columns)
        with pytest.raises(swarm.SceneError, match="frame must lie between -5 and 4, got 5"):
            written.members(5)


def test_the_time_on_each_wall_is_that_of_what_lies_on_it():
    """One particle lies on the floor from the start, one on a shelf from its fall on; one on the lower of two balls."""
    walls = [
        swarm.Plane((0.0, 0.0, -1.0), 1.0, restitution=0.0),
        swarm.Box((0.2, 0.2, 0.2), (3.0, 0.0, 0.0), side="outside", restitution=0.0),
    ]
    start = swarm.Particles([[0.0, 3.0, 1.0], [0.0] * 3, [-1.0, 0.7, 1.0]], np.zeros((3, 3)))
    result = swarm.simulate(
        swarm.Scene(walls, (0.0, 0.0, -1.0)), start, swarm.Impact(), until=4.0, every=1.0, compile="never",
        member_impacts=True,
    )  # fmt: skip
    floor, shelf = (times.item() for times in result.member_residence)
    assert floor == pytest.approx(4.0 + (4.0 - 2.0), rel=1e-6)
    assert shelf == pytest.approx(4.0 - 1.0, rel=1e-6)
    assert result.observables["member_residence"].sum(axis=1) == pytest.approx(
        result.observables["sliding_time"], rel=1e-14
    )


def test_the_time_on_a_sticky_wall_is_that_in_which_nobody_flies():
    """Between two plates at speed 1: of particles in flight at the end the way from the last plate is known."""
    plates = [swarm.Plane((1.0, 0.0, 0.0), 0.5, laws=[swarm.Sticky(0.3)]), swarm.Plane((-1.0, 0.0, 0.0), 0.5)]
    start = swarm.Particles(np.zeros((3, 40)), np.array([[1.0], [0.0], [0.0]]) * np.ones(40))
    for count in range(40):
        start.position[0, count] = -0.4 + 0.02 * count
    alone = [
        swarm.simulate(
            swarm.Scene(plates), swarm.Particles(start.position[:, k], start.velocity[:, k]), swarm.Impact(),
            until=6.0, every=0.75, compile="never", member_impacts=True, seed=k,
        )
        for k in range(12)
    ]  # fmt: skip
    checked = 0
    for k, one in enumerate(alone):
        sticky, bare = (times.item() for times in one.member_residence)
        x, v, n = one.particles.position[0, 0], one.particles.velocity[0, 0], int(one.impacts_per_particle[0])
        assert bare == 0.0
        if abs(x) < 0.5:
            way = (0.5 - start.position[0, k]) + (n - 1) + (0.5 - x if v < 0.0 else x + 0.5)
            assert sticky == pytest.approx(6.0 - way, abs=1e-12)
            checked += n > 2
    assert checked > 3


def test_times_on_members_have_the_same_bits_for_any_threads():
    scene = swarm.Scene([swarm.Box((0.5, 0.5, 0.5), restitution=0.0), swarm.Sphere(0.3, side="outside")], DOWN)
    one = run(scene, 300, 0.6, every=0.2)
    assert sum(times.sum() for times in one.member_residence) > 10.0
    for keywords in ({"threads": 2, "block_size": 256}, {"every": 0.2, "threads": 3, "block_size": 1}):
        other = run(scene, 300, 0.6, **{"every": 0.2} | keywords)
        assert other.observables["member_residence"].tobytes() == one.observables["member_residence"].tobytes()


def test_sums_of_whole_numbers_are_exact_in_any_order():
    rng = np.random.default_rng(1)
    terms = rng.normal(size=2000) * 10.0 ** rng.uniform(-6.0, 6.0, 2000)
    made = []
    for order in (terms, terms[::-1], np.sort(terms)):
        sums = Sums(*np.zeros((2, 1), np.int64), 2.0**-10)
        for term in order:
            sums.add(0, term)
        assert 0 <= sums.rest[0] < PARTS
        made.append(value_of(np.array((sums.whole, sums.rest)), sums.unit).item())
    assert made[0] == made[1] == made[2] == pytest.approx(math.fsum(terms), abs=2000 * 2.0**-51)


HOT = swarm.Spheres(
    [[0.2, 0.0, 0.0], [-0.2, 0.0, 0.0], [0.0, 0.25, 0.0]], [0.1, 0.1, 0.05], temperature=2.0, accommodation=0.7
)
WARM = {
    "thermal": swarm.Scene([swarm.Sphere(0.5, temperature=1.0), HOT]),
    "of laws": swarm.Scene([swarm.Sphere(0.5, laws=[swarm.CercignaniLampis(3.0, 0.5, 0.9)]), HOT], DOWN),
    "absorbing": swarm.Scene(
        [swarm.Sphere(0.5, temperature=1.0), swarm.Spheres(HOT.centers, HOT.radii, laws=[swarm.Absorb(0.3)])]
    ),
}


def test_absorbed_by_the_first_wall_are_counted():
    vessel = swarm.Sphere(0.5, laws=[swarm.Absorb(0.5)])
    one = run(swarm.Scene([vessel, swarm.Sphere(0.1, side="outside", laws=[swarm.Absorb(0.5)])]), 40)
    counts = [counted.sum() for counted in one.member_absorbed]
    assert counts == one.observables["absorbed"][-1].tolist()
    assert min(counts) > 0


@pytest.mark.parametrize("name", WARM)
def test_heat_and_absorbed_of_members_are_those_of_surfaces(name):
    scene = WARM[name]
    one = run(scene, 300, 1.0, every=0.5)
    seen = one.observables
    scale = np.abs(seen["wall_heat"][-1]).max() + seen["kinetic_energy"][0]
    for k, heat in enumerate(one.member_heat):
        assert heat.sum() == pytest.approx(seen["wall_heat"][-1, k], abs=1e-13 * scale)
    assert (np.abs(one.member_heat[0]) > 1e-3 * scale).all()
    if name == "absorbing":
        assert [counts.sum() for counts in one.member_absorbed] == seen["absorbed"][-1].tolist()
        assert (one.member_absorbed[1] > 0).all()
    else:
        assert one.member_absorbed is None
        assert (np.abs(one.member_heat[1]) > 1e-4 * scale).all()
    other = run(scene, 300, 1.0, every=0.5, threads=3, block_size=1).observables
    assert all(other[key].tobytes() == seen[key].tobytes() for key in seen)


def test_facets_of_a_mesh_have_their_own():
    """In a tetrahedron whose floor is one triangle."""
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    mesh = swarm.Mesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], restitution=0.3)
    scene = swarm.Scene([mesh], (0.0, 0.0, -1.0))
    result = run(scene, 3, 2.0)
    (impacts,), (times,) = result.member_impacts, result.member_residence
    assert impacts.shape == times.shape == (4,)
    assert impacts.sum() == result.observables["impacts"][-1]
    floor = (np.asarray(mesh.vertices)[np.asarray(mesh.triangles)][:, :, 2] == 0.0).all(axis=1)
    assert times[floor].item() > 0.5 * times.sum() > 0.0
    assert times.sum() == pytest.approx(result.observables["sliding_time"][-1], rel=1e-13)


def test_what_has_no_impacts_of_members():
    start = swarm.fill(SPHERE, 2, speed=1.0)
    loops = swarm.AugmentedLagrangian(dt=1e-2, penalty=1e4, on_unconverged="impact")
    with pytest.raises(swarm.SceneError, match='member_impacts must be False with on_unconverged = "impact"'):
        swarm.simulate(SPHERE, start, loops, until=1.0, member_impacts=True)
    with pytest.raises(swarm.SceneError, match="member_impacts"):
        run(SPHERE, member_impacts="yes")
    many = {"until": 1e7, "every": 1e-3, "member_impacts": True}
    with pytest.raises(swarm.SceneError, match="every must leave frames that fit"):
        swarm.simulate(swarm.Scene([swarm.Sphere(0.5), BALLS]), start, swarm.Impact(), **many)
