"""`pack`: dense balls that overlap nothing, and what cannot be."""

import numba
import numpy as np
import pytest

import swarm
from swarm.ball_numbers import balls_volume
from swarm.events import growing_run as growing
from swarm.events import packing
from swarm.events.growing_run import Growth
from swarm.kernel.vector import Vec, dot, square
from swarm.placing.cells import overlaps_of

CELL = swarm.Scene([], period=(1.0, 1.0, 1.0))
BOX = swarm.Scene([swarm.Box((0.5, 0.5, 0.5))])
SCENES = {
    "box": BOX,
    "cell": CELL,
    "sphere": swarm.Scene([swarm.Sphere(1.0)], gravity=(0.0, 0.0, -9.81)),
    "table": swarm.Scene([swarm.Box((1.0, 0.5, 0.5))], plane="z"),
}


@pytest.mark.parametrize(
    ("name", "sizes", "fraction"),
    [("box", "mixed", 0.21), ("cell", "alike", 0.2), ("sphere", "alike", 0.21), ("table", "mixed", 0.31)],
)
def test_balls_are_dense_and_overlap_nothing(name, sizes, fraction):
    scene, n = SCENES[name], 4
    radius = None if sizes == "alike" else np.linspace(1.0, 1.4, n)
    packed = swarm.pack(scene, n, radius, fraction, seed=3)
    assert balls_volume(scene, packed.radius) / packed.volume == pytest.approx(fraction, rel=1e-12)
    assert overlaps_of(packed.position, packed.radius, scene.period) is None
    if scene.surfaces:
        assert (scene.distances_outside(packed.position, 0.0, packed.radius) <= 0.0).all()
    if radius is not None:
        assert packed.radius / packed.radius[0] == pytest.approx(radius, rel=1e-14)
    assert not packed.velocity.any()
    if scene.plane:
        assert not packed.position[2].any()


def test_the_same_seed_gives_the_same_balls():
    one, two, other = (swarm.pack(BOX, 12, fraction=0.203, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(one.position, two.position)
    assert not np.array_equal(one.position, other.position)


def test_one_ball_has_the_radius_of_its_fraction():
    one = swarm.pack(BOX, 1, fraction=0.05)
    assert one.radius == pytest.approx([np.cbrt(0.05 / (4.0 / 3.0 * np.pi))], rel=1e-14)


def test_two_of_three_are_enough():
    by_radius = swarm.pack(BOX, 10, 0.1)
    assert by_radius.radius.tolist() == [0.1] * 10
    as_many = swarm.pack(BOX, radius=0.1, fraction=0.2)
    assert len(as_many) == int(0.2 / (4.0 / 3.0 * np.pi * 1e-3))


def test_they_may_fly():
    packed = swarm.pack(BOX, 10, 0.1, temperature=2.0, mass=3.0, seed=4)
    assert packed.mass.tolist() == [3.0] * 10
    assert packed.velocity.any()
    run = swarm.simulate(BOX, packed, swarm.Impact(), until=0.1, compile="never")
    assert run.observables["energy_error"].max() < 1e-14


def test_walls_are_as_they_are_at_the_start():
    shaken = swarm.Box((0.5, 0.5, 0.5), motion=swarm.Oscillation((0.0, 0.0, 0.1), 1.0), restitution=0.5, friction=0.3)
    packed = swarm.pack(swarm.Scene([shaken]), 12, fraction=0.203, seed=1)
    assert np.array_equal(packed.position, swarm.pack(BOX, 12, fraction=0.203, seed=1).position)
    away = swarm.Box((0.5, 0.5, 0.5), motion=swarm.Path((-1.0, 1.0), ((0.0, 0.0, 0.0), (0.0, 0.0, 0.2))))
    with pytest.raises(swarm.SceneError, match=r"surfaces\[0\].motion must leave the wall at its given place at 0 s"):
        swarm.pack(swarm.Scene([away]), 10, fraction=0.3)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"n": 100}, "pack needs two of n, radius and fraction, got n = 100"),
        ({}, "pack needs two of n, radius and fraction, got none"),
        (
            {"n": 10, "radius": 0.1, "fraction": 0.2},
            r"pack needs two of n, radius and fraction, got all: n = 10, radius = 0.1, fraction = 0.2; leave one out",
        ),
        ({"n": 10, "fraction": 0.62}, r"fraction must be at most 0.6, got 0.62$"),
        ({"n": 10, "fraction": 0.65}, "fraction must be at most 0.6, got 0.65; none at random fill more than 0.64"),
        ({"n": 10, "fraction": 0.75}, "got 0.75; no arrangement of equal ones fills more than 0.7405"),
        ({"n": 10, "fraction": 0.0}, "fraction must be above 0, got 0"),
        ({"n": 10, "fraction": float("nan")}, "fraction must be a finite number"),
        ({"n": 9, "radius": 0.26}, r"the packing must be at most 0.6, got 0.6626 of 9 balls of 0.26 m in 1 m\^3"),
        ({"n": 1, "radius": 0.6}, "radius must leave a place within the walls, which are 1 m apart along x, got 0.6 m"),
        (
            {"radius": 0.4, "fraction": 0.1},
            "fraction must be at least 0.2681, that of one ball of the radius 0.4 m, got",
        ),
        ({"n": 10, "radius": -1.0}, "radius must be a finite number above 0, got -1 for particle 0"),
        ({"n": 0, "radius": 0.1}, "n must be 1 or more, got 0"),
        (
            {"n": 2, "radius": 0.1, "speed": 1.0, "temperature": 1.0},
            "pack needs one of speed and temperature, got both",
        ),
    ],
    ids=lambda value: None if isinstance(value, str) else ",".join(value) or "none",
)
def test_what_cannot_be_is_one_sentence(arguments, sentence):
    with pytest.raises(swarm.SceneError, match=sentence):
        swarm.pack(BOX, **arguments)


def test_balls_that_jam_give_way_no_more(monkeypatch):
    """Two balls, whose centres may be 0.8 m apart, reach 0.8 of a diameter of 1 m."""
    monkeypatch.setattr(growing, "_JAMMED", 100)
    places, radius = np.array([[-0.4, 0.4], [0.0, 0.0], [0.0, 0.0]]), np.array([0.5, 0.5])
    _places, reached = growing.grow(swarm.Scene([swarm.Sphere(0.9)]), places, radius, 0.75, np.random.default_rng(1))
    assert 0.75 <= reached < 0.8


def test_a_jam_is_one_sentence(monkeypatch):
    monkeypatch.setattr(packing, "grow", lambda _scene, places, *_rest: (places, 0.99))
    with pytest.raises(
        swarm.SceneError, match=r"pack reached a packing of 0.2038 before the balls jammed, got 4 balls"
    ):
        swarm.pack(SCENES["sphere"], 4, fraction=0.21, seed=3)


# --- The way of two balls that grow ---


def test_two_balls_that_grow_touch_when_they_are_as_far_apart_as_they_are_wide():
    growth, random = Growth(0.5, 0.3), np.random.default_rng(0)
    met = 0
    for _ in range(200):
        b, u = (Vec(*random.normal(size=3)) for _ in range(2))
        u, reach = 0.3 * u, float(random.uniform(0.5, 1.0))
        now = float(random.uniform(0.0, 0.5))
        if square(b) <= (reach * growth.at(now)) ** 2:
            continue
        seen = growth.sight(b, u, reach * reach, now)
        times = now + np.linspace(0.0, 60.0, 60_001)
        far = sum((b[k] + u[k] * (times - now)) ** 2 for k in range(3)) - (reach * growth.at(times)) ** 2
        if not seen.meets():
            assert not (far < 0.0).any()
            continue
        time = now + seen.gap / (np.sqrt(seen.discriminant) - seen.closing)
        if time > 59.0:
            continue
        met += 1
        assert times[(far < 0.0).argmax()] == pytest.approx(time, abs=2e-3)
        r = b + (time - now) * u
        assert square(r) == pytest.approx((reach * growth.at(time)) ** 2, rel=1e-9)
        # Then their surfaces part as fast as they came.
        parts = growth.turned(u, r, dot(r, u), square(r), time)
        wide = reach * reach * growth.at(time) * growth.rate
        assert dot(r, parts) - wide == pytest.approx(wide - dot(r, u), rel=1e-9)
    assert met > 30


def test_a_ball_does_not_meet_itself():
    nothing = Vec(0.0, 0.0, 0.0)
    assert not Growth(0.5, 0.3).sight(nothing, nothing, 1.0, 0.1).meets()


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set: nothing is compiled")
def test_balls_without_walls_are_compiled():
    packed = swarm.pack(CELL, 300, fraction=0.4, seed=1, temperature=1.0)
    run = swarm.simulate(CELL, packed, swarm.Impact(), until=0.01, compile="always")
    assert run.observables["collisions"][-1] > 0


@pytest.mark.long
def test_a_thousand_balls_fill_three_fifths():
    radii = swarm.pack(SCENES["sphere"], 300, np.linspace(1.0, 2.0, 300), 0.5, seed=1)
    assert overlaps_of(radii.position, radii.radius) is None
    packed = swarm.pack(CELL, 1000, fraction=0.6, seed=1)
    assert overlaps_of(packed.position, packed.radius, CELL.period) is None
    discs = swarm.pack(SCENES["table"], 500, fraction=0.8, seed=1)
    assert overlaps_of(discs.position, discs.radius) is None
