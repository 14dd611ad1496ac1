"""Bodies that are born during a run: where, when and how they come, and the books of their energy."""

import math

import numpy as np
import pytest
from cut_short import in_sessions
from energy_books import booked

import swarm
from swarm.bodies import births
from swarm.bodies.body_run import BodyRun

ROOM = swarm.Box((0.5, 0.6, 0.7))
GRAVITY = (0.1, 0.0, -1.0)
DIE = swarm.tetrahedron(edge=0.1, mass=2.0)
PLAIN = {"compile": "never", "seed": 5}


def start_in(scene):
    return swarm.place(scene, DIE, 1, speed=0.5, spin=2.0, seed=3)


def source(where=None, **given):
    given = {"times": [0.0, 0.1, 0.1, 0.33], "speed": 0.7, "spin": 3.0, **given}
    return swarm.Source(where or swarm.Sphere(0.2), volume=True, **given)


def poured(scene, *sources, until=0.5, every=0.1, **options):
    given = {**PLAIN, **options}
    return swarm.simulate(
        scene, start_in(scene), swarm.Impact(dt=0.02), until=until, every=every, sources=list(sources), **given
    )  # fmt: skip


def test_bodies_come_at_their_times_and_the_books_of_energy_hold(tmp_path):
    scene = swarm.Scene([ROOM], gravity=GRAVITY)
    run = poured(scene, source(), trajectory=tmp_path / "t.h5", until=1.0)
    seen = run.observables
    assert seen["born"][:, 0].tolist() == [1, 3, 3, 3, 4, 4, 4, 4, 4, 4, 4]
    assert seen["blocked"].sum() == 0
    assert seen["impacts"][-1] > 2
    assert np.ptp(booked(seen)) < 1e-12 * seen["total_energy"].max()
    assert seen["energy_error"].max() < 1e-12
    assert seen["max_penetration"].max() < 1e-12
    with swarm.load(tmp_path / "t.h5") as frames:
        assert [len(frames.bodies(k)) for k in (0, 1, 3, 4, 10)] == [2, 4, 4, 5, 5]
        assert sorted(set(frames.birth_time.tolist())) == [0.0, 0.1, 0.33]
        assert frames.bodies(10).position == pytest.approx(run.bodies.position)


def test_a_body_that_is_born_falls_from_its_place_at_its_time():
    scene = swarm.Scene([swarm.Box((5.0, 5.0, 5.0))], gravity=GRAVITY)
    made = source(times=[0.05, 0.08], beam=(0.2, 0.1, 0.3), speed=None)
    first, later = (poured(scene, made, until=until, every=until).bodies for until in (0.1, 0.3))
    r, v, moved, w = first.centers(), DIE.center_of(first.velocity), later.centers(), DIE.center_of(later.velocity)
    pull = np.array(GRAVITY)[:, None]
    for copy, born in ((1, 0.05), (2, 0.08)):
        assert v[:, copy] == pytest.approx(np.array((0.2, 0.1, 0.3)) + pull[:, 0] * (0.1 - born), abs=1e-13)
    assert moved == pytest.approx(r + 0.2 * v + 0.5 * 0.2**2 * pull, abs=1e-13)
    assert w == pytest.approx(v + 0.2 * pull, abs=1e-13)
    # Each turns as fast as it was born: so does the angular momentum of a body with three equal moments of inertia.
    arms, slips = first.position - r[:, None], first.velocity - v[:, None]
    spins = np.cross(arms, slips, axis=0).sum(axis=1) / (arms**2).sum(axis=(0, 1)) * 1.5
    assert np.linalg.norm(spins, axis=0)[1:] == pytest.approx([3.0, 3.0], rel=1e-3)
    # And each has another orientation.
    assert np.abs(arms[..., 1] - arms[..., 2]).max() > 0.01


def test_a_body_comes_only_where_a_wall_that_moves_leaves_room_for_it():
    # The lid is above the source at 0.3 s.
    lid = swarm.Plane((0.0, 0.0, 1.0), -0.3, motion=swarm.Translation((0.0, 0.0, 1.0)))
    scene = swarm.Scene([ROOM, lid])
    start = swarm.Bodies(DIE, DIE.points.T[:, :, None] + [[[0.0]], [[0.0]], [[-0.5]]], np.zeros((3, 4, 1)))
    reach = float(np.linalg.norm(DIE.points - DIE.points.mean(axis=0), axis=1).max())
    for blocked in ("wait", "report"):
        come = source(swarm.Sphere(0.01), times=[0.05, 0.06], speed=1.0, blocked=blocked)
        run = swarm.simulate(
            scene, start, swarm.Impact(dt=0.02), until=0.6, every=0.1, sources=[come], **PLAIN
        )  # fmt: skip
        seen = run.observables
        # The centre is 1 cm about the origin: there is room from 0.3 s and the reach on.
        assert seen["blocked"][-1].tolist() == [1 if blocked == "wait" else 2]
        first = 3 + int(np.ceil((reach - 0.01) / 0.1))
        assert seen["born"][:first, 0].tolist() == [0] * first
        assert seen["born"][-1, 0] == (2 if blocked == "wait" else 0)
    # A picture shows those that are there.
    assert np.isnan(run.bodies.position[..., 1:]).all()
    run.plot()


def test_a_run_in_many_sessions_has_the_same_births(tmp_path, monkeypatch):
    scene = swarm.Scene([ROOM])

    def run(name):
        return poured(
            scene, source(times=[0.0, 0.15]), until=0.4, every=0.2, trajectory=tmp_path / f"{name}.h5", resume=True,
            checkpoint=3600.0,
        )  # fmt: skip

    at_once = run("a")
    in_parts, ended = in_sessions(monkeypatch, BodyRun, 20, lambda: run("b"))
    assert ended > 1
    assert (at_once.bodies.position == in_parts.bodies.position).all()
    for name in ("born", "source_energy", "total_energy", "energy_error"):
        assert (at_once.observables[name] == in_parts.observables[name]).all(), name


def test_a_source_that_does_not_fit_the_body_is_refused():
    scene = swarm.Scene([ROOM])
    for given, sentence in (
        ({"radius": 0.1}, r"sources\[0\].radius must be left out with bodies, got 0.1: the body has a size"),
        ({"density": 3.0}, r"sources\[0\].density must be left out with bodies, got 3.0: the body has a mass"),
        ({"density": 3.0}, r"sources\[0\].density must be left out with bodies, got 3.0: the body has a mass"),
        ({"mass": 3.0}, r"sources\[0\].mass must be that of the body, 2 kg, or left out, got 3"),
        ({"where": swarm.Sphere(0.01, (0.49, 0.0, 0.0))}, r"sources\[0\].where must leave a place within the walls"),
    ):
        with pytest.raises(swarm.SceneError, match=sentence):
            poured(scene, source(**given))
    rod = swarm.Body([(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)], 1.0, links=[(0, 1)], anchors={0: None})
    start = swarm.Bodies(rod, rod.points.T[:, :, None], np.zeros((3, 2, 1)))
    with pytest.raises(
        swarm.SceneError, match="sources must be left out with a body that has anchors or guides, got 1"
    ):
        swarm.simulate(scene, start, swarm.Impact(dt=0.01), until=1.0, sources=[source()])


def test_how_births_are_turned_is_rounded_term_by_term_and_not_by_blas():
    """Its last bit depends on the processor: the matrix of a quaternion is that of Python's floats, to the last one."""
    axes = swarm.Body([*(0.125 * np.eye(3)), *(-0.125 * np.eye(3))], mass=1.0)
    scene, start = swarm.Scene([ROOM]), swarm.Bodies(axes, axes.points.T, np.zeros((3, 6)))
    # Its places are no more than 1e-60 m from the origin, and are not seen beside its points.
    born = births.with_born(scene, start, (source(swarm.Sphere(1e-60), times=[0.01 * k for k in range(20)]),), 5, 0.5)
    for number in range(1, 21):
        parts = births.stream(5, 0, births._TURNS, number).standard_normal(4).tolist()
        w, x, y, z = (part / math.sqrt(sum(one * one for one in parts)) for part in parts)
        columns = (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
            (2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
            (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
        )
        assert tuple(map(tuple, (8.0 * born.position[:, :3, number].T).tolist())) == columns
