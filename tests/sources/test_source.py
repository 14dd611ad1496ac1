"""Bad input of sources: one sentence each, before anything runs; and what is refused."""

import math
import re

import numpy as np
import pytest

import swarm
from swarm.sources import places
from swarm.sources.births import with_births
from swarm.sources.places import PointBatches

SPHERE = swarm.Scene([swarm.Sphere(0.5)])
OPEN = swarm.Scene([swarm.Plane((0, 0, -1), 0.0)], gravity=(0, 0, -9.81))
GIVEN = {"rate": 10.0, "speed": 1.0}
MANY = {"rate": 100.0, "speed": 1.0}


def without(*names, **more):
    return {name: value for name, value in GIVEN.items() if name not in names} | more


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (without("rate"), "needs one of rate, times and count, got none"),
        (without(times=[0.5]), "needs one of rate, times and count .*, got rate and times"),
        (without("rate", times=[0.5], count=3), "got times and count"),
        (without(rate=-1.0), "rate must be .*, got -1"),
        (without(rate=0.0), "rate must be"),
        (without(rate=math.nan), "rate must be"),
        (without(count=0), "count must be"),
        (without(count=2.5), "count must be"),
        (without(start=-1.0), "start must be 0 or more, got -1"),
        (without(start=2.0, stop=1.0), "stop must be at start = 2 s or later, got 1"),
        (without("rate", count=3), "stop must be given with a count alone, got None: .* give stop="),
        (without("rate", times=[]), "times must be a list of at least one"),
        (without("rate", times=[0.1, -1.0]), r"times\[1\] must be a finite time of 0 s or later, got -1"),
        (without("rate", times=[0.1, math.inf]), r"times\[1\] must be"),
        (without("rate", times=[0.1], start=1.0), "start and stop must be left out with times"),
        (without("rate", count=3, even=True), "even must go with a rate"),
        (without("speed"), "needs one of temperature, speed and beam, got none"),
        (without(temperature=1.0), "got temperature and speed"),
        (without("speed", temperature=1.0, beam=(0, 0, 1)), "got temperature and beam"),
        (without(speed=-1.0), "speed must be"),
        (without("speed", temperature=-1.0), "temperature must be"),
        (without("speed", beam=(0, 0, 0)), "beam must be a velocity, three numbers that are not all 0"),
        (without("speed", beam=(0, 1)), "beam must be"),
        (without("speed", beam=(0, 0, 1), divergence=4.0), "divergence must be below pi"),
        (without(divergence=0.1), "divergence must go with a beam"),
        (without(mass=0.0), "mass must be from"),
        (without(mass="x"), "mass must be .*, got"),
        (without(mass=math.nan), "mass must be"),
        (without(volume=1), "volume must be true or false"),
        (without(within=3), "within must be a surface"),
    ],
)
def test_a_source_that_is_none(given, sentence):
    with pytest.raises(swarm.SceneError, match=sentence):
        swarm.Source(0, **given)


def test_no_place_of_a_source():
    for where in ("wall", 1.5, None, True, -1):
        with pytest.raises(swarm.SceneError, match="where must be"):
            swarm.Source(where, **GIVEN)
    with pytest.raises(swarm.SceneError, match="volume must be False at an opening"):
        swarm.Source(swarm.Opening(swarm.Sphere(0.1)), volume=True, **GIVEN)


def run(scene, source, particles=None, method=None, **more):
    more = {"until": 1.0, "compile": "never", **more}
    return swarm.simulate(scene, particles, method or swarm.Impact(), sources=source, **more)


OPENED = swarm.Scene([swarm.Sphere(0.5, openings=[swarm.Sphere(0.1, (0, 0, 0.5))])])
MOVING = swarm.Scene(
    [swarm.Box((0.5, 0.5, 0.5)), swarm.Sphere(0.2, side="outside", motion=swarm.Translation((0.1, 0, 0)))]
)
TIMED = swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), swarm.Sphere(0.2, side="outside", present=[(0.5, 0.75)])])


@pytest.mark.parametrize(
    ("scene", "source", "sentence"),
    [
        (SPHERE, swarm.Source(1, **GIVEN), r"sources\[0\].where must be the number of a surface .* from 0 to 0, got 1"),
        (SPHERE, swarm.Source(swarm.Sphere(0.1, (2.0, 0, 0)), **GIVEN), r"sources\[0\].where must be in the vessel"),
        (SPHERE, swarm.Source(swarm.Box((0.1, 0.1, 0.1), (0, 0, 3.0)), **GIVEN), "where must be in the vessel"),
        (SPHERE, swarm.Source(swarm.Sphere(0.1, (2.0, 0, 0)), volume=True, **GIVEN), "where must be in the vessel"),
        (SPHERE, swarm.Source(0, within=swarm.Sphere(0.1), **GIVEN), "where must be in the vessel and in within="),
        (SPHERE, swarm.Source(swarm.Opening(swarm.Sphere(0.1)), **GIVEN), "must be one of the openings of the scene's"),
        (SPHERE, swarm.Source(0, rate=10.0, beam=(0, 0, 1)), r"sources\[0\].beam must lead from its surface"),
        (OPEN, swarm.Source(0, **GIVEN), r"sources\[0\].where must be bounded, .* give within="),
        (OPEN, swarm.Source(0, volume=True, **GIVEN), r"sources\[0\].where must be bounded"),
        (MOVING, swarm.Source(1, **GIVEN), r"where = surfaces\[1\] must be at rest and always there"),
        (TIMED, swarm.Source(1, **GIVEN), r"where = surfaces\[1\] must be at rest and always there"),
        (
            MOVING,
            swarm.Source(0, volume=True, **MANY),
            r"sources\[0\] must be free when particles come, .* surfaces\[1\]",
        ),
        (
            TIMED,
            swarm.Source(swarm.Sphere(0.1), volume=True, **MANY),
            r"must be free when particles come, .* surfaces\[1\]",
        ),
        (SPHERE, swarm.Source(0, rate=1e300, speed=1.0), r"sources\[0\] must fit in memory .* got 1e\+300, which take"),
        (SPHERE, swarm.Source(0, rate=1e12, speed=1.0), r"sources\[0\] must fit in memory .* got 1e\+12, which take"),
        (
            SPHERE,
            swarm.Source(0, speed=1.0, times=[2.0]),
            "sources must give at least one particle .* got none until 1 s",
        ),
        (
            swarm.Scene([swarm.Sphere(0.5)], plane="z"),
            swarm.Source(0, volume=True, rate=1.0, beam=(0, 0, 1)),
            r"beam\[2\]",
        ),
        (
            swarm.Scene([swarm.Formula("x**2 + y**2 + z**4 - 0.1")]),
            swarm.Source(0, **GIVEN),
            "of which points can be drawn exactly, got Formula",
        ),
    ],
)
def test_a_source_that_does_not_go_with_the_scene(scene, source, sentence, monkeypatch):
    monkeypatch.setattr(places, "_MOST_BATCHES", 3)
    with pytest.raises(swarm.SceneError, match=sentence):
        run(scene, [source])


AROUND = swarm.Scene([swarm.Sphere(0.5), swarm.Box((0.4, 0.4, 0.4), (0.0, 0.0, 0.2))])
FLAT = swarm.Scene([swarm.Stadium(0.4, 0.4)], plane="z")
FAR = swarm.Sphere(0.1, (2.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("scene", "where", "more", "sentence"),
    [
        (SPHERE, FAR, {}, "from 1.9 to 2.1 m along x: births can be from -0.5 to 0.5 m there; move it"),
        (SPHERE, FAR, {"volume": True}, "from 1.9 to 2.1 m along x"),
        (SPHERE, swarm.Sphere(0.1, (2.0, 0.0, 0.0), side="outside"), {}, "from 1.9 to 2.1 m along x"),
        (SPHERE, swarm.Box((0.1, 0.1, 0.1), (0.0, 0.0, 3.0)), {}, "from 2.9 to 3.1 m along z"),
        (SPHERE, swarm.Spheres([(3.0, 0.0, 0.0), (4.0, 0.0, 0.0)], [0.1, 0.1]), {}, "from 2.9 to 4.1 m along x"),
        (SPHERE, swarm.Plane((0.0, 0.0, 1.0), 3.0), {}, "2.5 m or more away from the places where births can be"),
        (SPHERE, swarm.Plane((0.0, 0.0, -1.0), 3.0), {}, "which is 2.5 m or more away"),
        (SPHERE, swarm.Plane((0.0, 0.0, -1.0), -3.0), {"volume": True}, "are; move it"),
        (SPHERE, 0, {"within": FAR}, "and in within=, .* along x these two have nothing in common"),
        (SPHERE, swarm.Sphere(0.1), {"within": swarm.Sphere(0.1, (0.0, 0.3, 0.0))}, "births can be from 0.2 to 0.4 m"),
        (AROUND, swarm.Sphere(0.05, (0.0, 0.0, -0.4)), {}, "along z: births can be from -0.2 to 0.5 m"),
        (FLAT, FAR, {}, "from 1.9 to 2.1 m along x"),
    ],
)
def test_a_source_whose_bounds_miss_the_vessel_is_refused_before_points_are_drawn(
    scene, where, more, sentence, monkeypatch
):
    drawn = []
    for name in ("_volume", "_surface"):
        monkeypatch.setattr(PointBatches, name, lambda *about: drawn.append(1) or np.zeros((6, 0)))
    monkeypatch.setattr(places, "_MOST_BATCHES", 3)
    with pytest.raises(swarm.SceneError, match=rf"sources\[0\].where must be in the vessel.*{sentence}"):
        run(scene, swarm.Source(where, **GIVEN, **more))
    assert len(drawn) == (3 if sentence == "are; move it" else 0)


def test_a_part_of_a_wall_that_is_open_has_no_births(monkeypatch):
    monkeypatch.setattr(places, "_MOST_BATCHES", 1)
    within = swarm.Sphere(0.05, (0.0, 0.0, 0.5))
    with pytest.raises(swarm.SceneError, match=r"of which 0 of .*: for births in an opening give that one as where="):
        run(OPENED, swarm.Source(0, within=within, **GIVEN))


def test_bounds_refuse_no_source_that_has_a_place():
    """At the faces of a cell that repeats, around its vessel, on it, and where it is open to infinity."""
    cell = swarm.Scene([swarm.Sphere(0.3, (0.0, 0.5, 0.5), side="outside")], period=(1.0, 1.0, 1.0))
    ball, floor = swarm.Sphere(0.2, side="outside"), swarm.Plane((0.0, 0.0, -1.0), 0.0)
    for scene, where, more in (
        (cell, 0, {}),
        (cell, swarm.Sphere(0.3, (0.5, 0.5, 0.5)), {"volume": True}),
        (SPHERE, swarm.Sphere(1.0, (1.0, 0.0, 0.0)), {}),
        (SPHERE, swarm.Sphere(0.5), {}),
        (SPHERE, ball, {"volume": True}),
        (swarm.Scene([swarm.Box((0.5, 0.5, 0.5))]), swarm.Plane((0.0, 0.0, -1.0), 0.5), {}),
        (OPEN, floor, {"within": swarm.Sphere(0.3)}),
        (FLAT, swarm.Sphere(0.2), {"volume": True}),
    ):
        made = with_births(scene, None, (swarm.Source(where, count=5, stop=1.0, speed=1.0, **more),), 1, 1.0)
        assert len(made) == 5


def test_a_source_at_the_end_of_a_tube_is_not_reported_as_rare(caplog, monkeypatch):
    """One point of sixteen on the wall of the tube is at its end: that needs no other source, however many are born."""
    monkeypatch.setattr(places, "_FIRST_REPORT", 1)
    end = swarm.Box((1e-6, 2.0, 2.0), (-5.0, 0.0, 0.0))
    tube = swarm.Scene([swarm.Cylinder(1.0, (1.0, 0.0, 0.0), 10.0, openings=[end])])
    with_births(tube, None, (swarm.Source(end, count=2_000, stop=1.0, speed=1.0),), 1, 1.0)
    assert not [message for message in caplog.messages if "still looking" in message]


def test_a_long_search_for_places_is_reported(caplog, monkeypatch):
    """Whenever it has taken twice as many points."""
    monkeypatch.setattr(places, "_MOST_BATCHES", 100)
    corner = swarm.Source(swarm.Sphere(0.05, (0.45, 0.45, 0.45)), volume=True, **GIVEN)
    with pytest.raises(swarm.SceneError, match="of which 0 of 1638400 points are"):
        run(SPHERE, corner)
    reports = [message for message in caplog.messages if "still looking for places of births" in message]
    assert [re.findall("0 of 12 found after (.*) points tried", message)[0] for message in reports] == [
        "524288",
        "1048576",
    ]
    assert reports[0].startswith("sources[0]: still looking")
    assert reports[0].endswith("give a smaller where=, or a within= that bounds the part of it in the vessel")


def test_runs_that_support_no_sources():
    source = swarm.Source(0, **GIVEN)
    for given in (3, "all", [source, 3]):
        with pytest.raises(swarm.SceneError, match="sources"):
            run(SPHERE, given)
    with pytest.raises(swarm.SceneError, match=r"particles must be a swarm.Particles, got None"):
        run(SPHERE, None)
    start = swarm.fill(SPHERE, 3, speed=1.0)
    with pytest.raises(swarm.SceneError, match=r"sources must be left out with .*; use Impact\(\) with"):
        run(SPHERE, source, start, swarm.Impact(contact_step=1e-3))
    bodies = swarm.place(SPHERE, swarm.dumbbell(0.1, 1.0), 2, speed=1.0)
    with pytest.raises(swarm.SceneError, match=r"sources must be left out with bodies and Penalty, got 1: a body is"):
        run(SPHERE, source, bodies, swarm.Penalty(dt=1e-2, penalty=1e3))
    for given in ({"density": 1.0}, {"spin": 1.0}, {"blocked": "report"}):
        with pytest.raises(
            swarm.SceneError, match=rf"sources\[0\].{next(iter(given))} must be left out without a radius"
        ):
            run(SPHERE, swarm.Source(0, **GIVEN, **given), start)


def test_a_formula_has_a_volume_to_be_born_in():
    scene = swarm.Scene([swarm.Formula("x**2 + y**2 + z**4 - 0.1")])
    assert len(run(scene, [swarm.Source(0, volume=True, **GIVEN)]).particles) > 1


def test_a_wall_that_comes_and_goes_is_looked_at_when_particles_come():
    source = swarm.Source(swarm.Sphere(0.1), volume=True, rate=50.0, speed=0.0, stop=0.1)
    gone = swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), swarm.Sphere(0.3, side="outside", present=[(0.0, 0.5)])])
    with pytest.raises(swarm.SceneError, match="must be free when particles come"):
        run(gone, source)
    later = swarm.Source(swarm.Sphere(0.1), volume=True, rate=50.0, speed=1.0, start=0.5)
    assert run(gone, later).observables["born"][-1, 0] > 0
    away = swarm.Sphere(0.2, side="outside", motion=swarm.Translation((1.0, 0.0, 0.0)))
    moved = swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), away])
    assert run(moved, later, until=0.75).observables["born"][-1, 0] > 0


def test_a_frame_with_those_that_come_later_is_no_start():
    """Those that are there are: `born`."""
    rows = np.array([[0.1, np.nan]] * 3)
    some = swarm.Particles.of_frame(rows, rows, np.ones(2), None, np.array([True, False]))
    with pytest.raises(swarm.SceneError, match=r"particle 1 .*take the particles that are born: .born\(\)"):
        swarm.simulate(SPHERE, some, swarm.Impact(), until=1.0)
    assert len(some.born()) == 1


def test_a_union_with_a_part_that_moves_is_no_source_but_a_vessel_of_one():
    arm = swarm.Cylinder(0.2, length=2.0, motion=swarm.Translation((0.05, 0.0, 0.0)))
    scene = swarm.Scene([swarm.Union([swarm.Sphere(0.5), arm])])
    with pytest.raises(swarm.SceneError, match="must be at rest and always there"):
        run(scene, swarm.Source(0, **GIVEN))
    assert len(run(scene, swarm.Source(swarm.Sphere(0.3), volume=True, **MANY)).particles) > 50
    with pytest.raises(swarm.SceneError, match="must be free when particles come"):
        run(scene, swarm.Source(swarm.Sphere(0.1, (0.6, 0.0, 0.0)), volume=True, **MANY))


def test_a_wall_may_come_where_somebody_is_born_when_it_has_gone():
    comes = swarm.Sphere(0.2, side="outside", present=[(0.3, 0.5)])
    scene = swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), comes])
    later = swarm.Source(swarm.Sphere(0.1), volume=True, times=[0.5, 0.7], speed=1.0)
    assert run(scene, later, every=0.25).observables["born"][:, 0].tolist() == [0, 0, 1, 2, 2]
    before = swarm.Source(swarm.Sphere(0.1), volume=True, times=[0.25], speed=0.0)
    with pytest.raises(swarm.RunError, match=r"must come where no particle is: at 0\.3 s particle 0"):
        run(scene, before)
