"""What is said before a run of what may not be meant: it comes where it should, and for no scene of the examples."""

import logging
from pathlib import Path

import numpy as np
import pytest
from conftest import METHODS, SURFACES

import swarm
from swarm import scene_file
from swarm.run.options import RunOptions
from swarm.run.preflight import hints
from swarm.run.preflight.admission import task_of

BOX = swarm.Box((0.5, 0.5, 0.5))
BALL = swarm.Sphere(0.5)
DOWN = (0.0, 0.0, -9.81)


def hints_of(scene, method=None, until=1.0, caplog=None, particles=None, **options):
    """The hints on a run; checks of its arguments come before them."""
    particles = swarm.fill(scene, 20, speed=1.0, seed=1) if particles is None else particles
    task = task_of(scene, particles, method or swarm.Impact(), RunOptions(until=until, **options))
    caplog.clear()
    with caplog.at_level(logging.WARNING, "swarm"):
        hints.give(task)
    return [record.getMessage() for record in caplog.records]


AT_REST = swarm.Particles(np.zeros(3), np.zeros(3))
CELL = swarm.Scene([swarm.Cylinder(0.3)], gravity=DOWN, period=(None, None, 1.0))
LOSSY = swarm.Scene([swarm.Cylinder(0.3, friction=0.1)], gravity=DOWN, period=(None, None, 1.0))
LEVEL = swarm.Scene([swarm.Cylinder(0.3)], gravity=(1.0, 0.0, 0.0), period=(None, None, 1.0))
MANY = {"until": 1e12, "every": 1e9}
COMES = {
    "a late end": ([BOX], swarm.Impact(), MANY, "between impacts is about T = 1.1 s", "until = 1e+12 s is kept to"),
    "a long step": ([BALL], swarm.Penalty(dt=0.25, penalty=1e4), {}, "T = 0.", "s; dt = 0.25 s is 0."),
    "a long contact step": ([BALL], swarm.Impact(contact_step=0.25), {}, "T = 0.", "contact_step = 0.25 s is"),
    "steps that are cut": (
        [BALL], swarm.AugmentedLagrangian(dt=0.25, penalty=1e4, adaptive=True), {}, "T = 0.", "dt = 0.25 s is"
    ),
    "soft walls": ([BALL], swarm.Penalty(dt=1e-2, penalty=10.0), {}, "a contact lasts 0.99 s,", "m into its wall"),
    "Verlet": ([BALL], swarm.Verlet(dt=1e-2, penalty=1e5), {}, "of a contact, which lasts 0.0099 s", "unstable"),
}  # fmt: skip


@pytest.mark.parametrize("name", COMES)
def test_hints_are_given(name, caplog):
    surfaces, method, options, *parts = COMES[name]
    hints = hints_of(swarm.Scene(surfaces), method, caplog=caplog, **options)
    assert len(hints) == 1
    for part in parts:
        assert part in hints[0]


def test_kelvins_in_place_of_joules(caplog):
    """A temperature is k_B T: 300 J make a molecule faster than light, at the start or at a wall."""
    room, molecule = swarm.Scene([BOX]), 4.65e-26
    given = swarm.fill(room, 5, temperature=300.0, mass=molecule)
    (hint,) = hints_of(room, particles=given, until=1e-6, caplog=caplog)
    assert hint.startswith("a particle has ")
    assert "k_B T in J, at 300 K 4.14e-21 J" in hint
    with pytest.raises(swarm.SceneError, match=r"above the speed of light: .* at 300 K 4\.14e-21 J"):
        hints_of(room, particles=given, caplog=caplog)
    warm = swarm.Scene([swarm.Sphere(0.5, temperature=300.0)])
    (hint,) = hints_of(warm, particles=swarm.fill(warm, 5, speed=400.0, mass=molecule), until=1e-3, caplog=caplog)
    assert hint.startswith("a wall of the temperature 300 J gives 8e+13 m/s")
    right = swarm.fill(room, 5, temperature=4.14e-21, mass=molecule)
    assert hints_of(room, particles=right, until=1e-3, caplog=caplog) == []


def test_degrees_in_place_of_radians(caplog):
    swarm.Box((0.1, 0.1, 0.1), rotation={"axis": (0, 0, 1), "angle": 6.2})
    assert caplog.messages == []
    swarm.Box((0.1, 0.1, 0.1), rotation={"axis": (0, 0, 1), "angle": 45})
    (hint,) = caplog.messages
    assert hint == ("rotation.angle = 45 rad is more than a turn; angles are in radians: 45 degrees are 0.785398")


def test_what_rests_and_what_falls(caplog):
    (hint,) = hints_of(swarm.Scene([BOX]), particles=AT_REST, caplog=caplog)
    assert "all 1 particles are at rest" in hint
    assert hints_of(swarm.Scene([BOX], DOWN), particles=AT_REST, caplog=caplog) == []
    (hint,) = hints_of(CELL, caplog=caplog)
    assert "gravity[2] = -9.81 m/s^2 pulls along period[2] = 1 m" in hint
    for law, comes in (
        (swarm.Lambert(0.5), True),
        (swarm.Absorb(0.5), False),
        (swarm.CercignaniLampis(1.0, 0.5, 0.5), False),
    ):
        scene = swarm.Scene([swarm.Cylinder(0.3, laws=[law])], gravity=DOWN, period=(None, None, 1.0))
        assert bool(hints_of(scene, caplog=caplog)) == comes
    assert hints_of(LOSSY, caplog=caplog) == hints_of(LEVEL, caplog=caplog) == []


@pytest.mark.parametrize("until", [1.0, 1e3, 1e7])
def test_a_run_of_a_usual_length_is_not_late(until, caplog):
    assert hints_of(swarm.Scene([BOX]), until=until, caplog=caplog) == []


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
@pytest.mark.parametrize("name", SURFACES)
def test_no_hint_for_the_surfaces_of_the_tables(name, method, caplog):
    scene = swarm.Scene([SURFACES[name](), swarm.Sphere(3.0)])
    assert hints_of(scene, method, caplog=caplog) == []


@pytest.mark.parametrize("kind", ["balls", "a source of balls", "points"])
def test_a_counter_that_balls_do_not_reach(kind, caplog):
    """A ball leaves by its foot: the centre of one of 2 cm stops 2 cm above the hole."""
    hole = swarm.Cylinder(0.1)
    scene = swarm.Scene([swarm.Box((0.5, 0.5, 0.5), openings=[hole])], DOWN)
    radius = {"balls": 0.02, "a source of balls": 1e-3, "points": None}[kind]
    start = swarm.Particles(np.array([0.0, 0.0, 0.3]), np.zeros(3), radius=radius)
    births = swarm.Source(swarm.Sphere(0.1), volume=True, rate=1.0, speed=1.0, radius=(0.01, 0.02))
    options = {"sources": [births]} if kind == "a source of balls" else {}

    def given(counter):
        hints = hints_of(scene, particles=start, counters=[counter], caplog=caplog, **options)
        return [hint for hint in hints if hint.startswith("counters[0] is nearer to surfaces[0].openings[0] than the")]

    assert len(given(swarm.Plane((0.0, 0.0, 1.0), -0.481))) == (kind != "points")
    assert given(swarm.Plane((0.0, 0.0, 1.0), -0.47)) == []
    elsewhere = swarm.Counter(swarm.Plane((0.0, 0.0, 1.0), -0.5), inside=swarm.Sphere(0.1, center=(0.3, 0.0, -0.5)))
    assert given(elsewhere) == []


@pytest.mark.parametrize("path", sorted(Path("examples/scenes").glob("*.toml")), ids=lambda path: path.stem)
def test_no_hint_for_the_scenes_of_the_examples(path, caplog):
    job = scene_file.read(path)
    task = task_of(job.scene, job.start(), job.method, job.run)
    with caplog.at_level(logging.WARNING, "swarm"):
        hints.give(task)
    assert [record.getMessage() for record in caplog.records] == []


def test_the_predicted_depth_is_the_one_that_comes(caplog):
    """A particle that flies along the radius of a soft ball."""
    start = swarm.Particles(np.array([0.1, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    method, scene = swarm.Penalty(dt=1e-3, penalty=20.0), swarm.Scene([BALL])
    (hint,) = hints_of(scene, method, until=1.5, caplog=caplog, particles=start)
    run = swarm.simulate(scene, start, method, until=1.5, every=0.01, compile="never")
    depth = float(hint.split("sinks ")[1].split(" m")[0])
    assert depth == pytest.approx(run.observables["max_penetration"].max(), rel=0.05)


def test_few_of_many_particles_are_looked_at():
    """So that hints cost little beside the checks of all."""
    for count in (1, 999, 1000, 100_000, 10**7):
        assert min(count, 500) <= len(range(count)[hints._some(count)]) <= 2000
