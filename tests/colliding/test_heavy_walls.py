"""Walls with a mass among balls: what impacts make of both."""

import itertools
import math
import signal

import numpy as np
import pytest
from colliding.gases import depth, frames, gas

import swarm
from swarm.events.colliding.heavy import STRIKES, Heavy
from swarm.events.heavy_run import HeavyRun
from swarm.kernel.random import Seeding
from swarm.run.tally import Watched

ACROSS = (1.0, 0.0, 0.0)
DOWN = (0.0, 0.0, -1.0)
BOX = swarm.Box((1.0, 1.0, 1.0))


def run_of(scene, particles, threads=1, compile="never"):
    compiled, balls = scene.compiled(float(particles.radius.max())), particles.copy()
    return HeavyRun(compiled, balls, swarm.Impact(), threads, None, compile, Seeding(), Watched())


def plate(mass=5.0, **given):
    return swarm.Slab(ACROSS, 0.02, side="outside", mass=mass, motion=swarm.Guide(ACROSS), **given)


def hanging(mass=2.0):
    """A ball on an axis above it."""
    hinge = swarm.Rotation((0.0, 1.0, 0.0), 0.5, (0.0, 0.0, 0.1))
    return swarm.Sphere(0.05, center=(0.0, 0.0, -0.05), side="outside", mass=mass, inertia=0.2, motion=hinge)


def paddle():
    hinge = swarm.Rotation((0.0, 0.0, 1.0), 0.5, (0.0, 0.0, 0.0))
    return swarm.Box((0.1, 0.01, 0.6), side="outside", inertia=0.02, motion=hinge)


def free(mass=3.0, **given):
    return swarm.Sphere(0.1, side="outside", mass=mass, **given)


def moving(wall, n=24, gravity=None, **pairs):
    scene, balls = gas(n, radius=0.11, gravity=gravity, **pairs)
    balls.velocity -= 2.0 * balls.position
    return swarm.Scene([BOX, wall], gravity=gravity, pairs=scene.pairs), balls


@pytest.mark.parametrize(
    ("wall", "gravity"),
    [(plate(), None), (plate(0.5), DOWN), (free(), None), (free(), DOWN), (hanging(), DOWN), (paddle(), None)],
    ids=["piston", "light piston", "sphere", "falling sphere", "pendulum", "paddle"],
)
def test_energy_is_that_of_balls_and_walls(wall, gravity):
    scene, balls = moving(wall, gravity=gravity)
    run = run_of(scene, balls)
    position, _velocity, seen = frames(run, np.linspace(0.1, 1.0, 3))
    assert seen["energy_error"] < 1e-12
    assert seen["wall_energy"][1] != 0.0
    assert run._heavy.counts[STRIKES] > 0.0
    assert seen["max_penetration"] < 1e-12
    assert depth(scene, position, balls.radius) < 1e-12


def test_a_free_sphere_is_one_ball_more():
    _scene, balls = gas(12, radius=0.11, seed=4)
    balls.velocity -= 3.0 * balls.position
    box = swarm.Box((8.0, 8.0, 8.0))
    wall = swarm.Sphere(0.08, side="outside", mass=0.7)
    run = run_of(swarm.Scene([box, wall]), balls)
    position, velocity, seen = frames(run, [0.5, 1.2])
    assert run._heavy.counts[STRIKES] >= 3.0
    more = swarm.Particles(
        np.c_[balls.position, np.zeros(3)], np.c_[balls.velocity, np.zeros(3)], np.append(balls.mass, 0.7),
        radius=np.append(balls.radius, 0.08),
    )  # fmt: skip
    result = swarm.simulate(swarm.Scene([box]), more, swarm.Impact(), until=1.2, compile="never")
    assert result.particles.position[:, :-1] == pytest.approx(position, abs=1e-9)
    assert result.particles.velocity[:, :-1] == pytest.approx(velocity, abs=1e-9)
    assert result.particles.position[:, -1] == pytest.approx(seen["wall_position"][1], abs=1e-9)
    assert result.particles.velocity[:, -1] == pytest.approx(seen["wall_velocity"][1], abs=1e-9)
    momentum = (balls.mass * velocity).sum(axis=1) + 0.7 * seen["wall_velocity"][1]
    assert momentum == pytest.approx((balls.mass * balls.velocity).sum(axis=1), abs=1e-13)


@pytest.mark.parametrize("restitution", [1.0, 0.7])
def test_a_ball_and_a_piston_in_line(restitution):
    mass, radius = 2.0, 0.1
    balls = swarm.Particles((-0.5, 0.1, 0.2), (1.0, 0.0, 0.0), radius=radius)
    scene = swarm.Scene([BOX, plate(mass, restitution=restitution)])
    _position, velocity, seen = frames(run_of(scene, balls), [2.0])
    # Ball from -0.9 to 0.12 before the plate; u is the velocity of this
    x, v, s, u, left = -0.5, 1.0, 0.0, 0.0, 2.0
    while True:
        to_plate = (s - 0.12 - x) / (v - u) if v > u else math.inf
        to_wall = (-0.9 - x) / v if v < 0.0 else math.inf
        step = min(to_plate, to_wall, left)
        x, s, left = x + v * step, s + u * step, left - step
        if left == 0.0:
            break
        if to_plate < to_wall:
            push = (1.0 + restitution) * (v - u) / (1.0 + 1.0 / mass)
            v, u = v - push, u + push / mass
        else:
            v = -v
    assert velocity[0, 0] == pytest.approx(v, rel=1e-13)
    assert seen["wall_velocity"][1, 0] == pytest.approx(u, rel=1e-13)
    assert seen["wall_position"][1, 0] == pytest.approx(s, rel=1e-13)
    assert seen["energy_error"] < 1e-14


@pytest.mark.parametrize("inertia", [0.01, 1e6])
@pytest.mark.parametrize("spin", [None, (0.0, 0.0, 0.0)], ids=["without a spin", "with one"])
def test_friction_of_a_drum_acts_where_a_ball_touches_it(spin, inertia):
    """Where the slip stops, v = a w: the impulse at the rim is J = (v0 - a w0)/(1/m + a^2/I [+ 5/(2 m)])."""
    mass, radius, a, rate, along = 0.3, 0.1, 0.2, 2.0, 1.0
    hinge = swarm.Rotation((0.0, 0.0, 1.0), rate)
    drum = swarm.Cylinder(a, side="outside", friction=50.0, inertia=inertia, motion=hinge)
    balls = swarm.Particles((0.35, -0.05 * along, 0.1), (-1.0, along, 0.0), mass, radius=radius, spin=spin)
    pairs = None if spin is None else swarm.Pairs(friction=0.5)
    _position, velocity, seen = frames(run_of(swarm.Scene([BOX, drum], pairs=pairs), balls), [0.06])
    give = 1.0 / mass + a * a / inertia + (0.0 if spin is None else 2.5 / mass)
    impulse = (along - a * rate) / give
    assert velocity[:, 0] == pytest.approx([1.0, along - impulse / mass, 0.0], rel=1e-12)
    assert seen["energy_error"] < 1e-14


@pytest.mark.parametrize("duration", [0.0, 0.1, 0.3])
@pytest.mark.parametrize(
    "wall", [plate(2.0, restitution=0.4), swarm.Sphere(0.02, side="outside", mass=2.0, restitution=0.4)],
    ids=["piston", "sphere"],
)  # fmt: skip
def test_a_ball_loses_nothing_to_a_heavy_wall_so_soon_after_a_collision(wall, duration):
    # The first ball meets the second at 0.1 s and stops; the second meets the wall 0.2 s later.
    balls = swarm.Particles([(-0.62, -0.32), (0.0, 0.0), (0.0, 0.0)], [(1.0, 0.0), (0.0, 0.0), (0.0, 0.0)], radius=0.1)
    scene = swarm.Scene([BOX, wall], pairs=swarm.Pairs(contact_duration=duration))
    _position, velocity, seen = frames(run_of(scene, balls), [0.35])
    restitution = 1.0 if duration > 0.2 else 0.4
    push = (1.0 + restitution) / (1.0 + 1.0 / 2.0)
    assert velocity[0] == pytest.approx([0.0, 1.0 - push], abs=1e-14)
    assert seen["wall_velocity"][1, 0] == pytest.approx(push / 2.0, rel=1e-13)
    lost = 0.5 * (1.0 - restitution**2) / (1.0 + 1.0 / 2.0)
    assert seen["dissipated_energy"] == pytest.approx(lost, rel=1e-13)
    assert seen["energy_error"] < 1e-14


@pytest.mark.parametrize("wall", [plate(0.5), hanging()], ids=["piston", "pendulum"])
def test_frames_change_no_flight(wall):
    scene, balls = moving(wall, gravity=DOWN)
    few = frames(run_of(scene, balls), [0.5])
    many = frames(run_of(scene, balls), np.linspace(0.0, 0.5, 18)[1:])
    for one, other in zip(few[:2], many[:2], strict=True):
        assert np.array_equal(one, other)
    assert np.array_equal(few[2]["wall_velocity"], many[2]["wall_velocity"])


def test_a_halted_run_goes_on_with_the_same_bits():
    scene, balls = moving(plate(0.5), gravity=DOWN)
    whole = frames(run_of(scene, balls), [0.4])
    with run_of(scene, balls) as first:
        first.observe()
        for passes in itertools.count(3):
            first.halt(passes)
            if first.advance(0.4, 0.4):
                break
            kept = {name: array.copy() for name, array in first.arrays().items()}
            first = run_of(scene, balls)
            first.restore(kept, cut_short=True)
            if passes > 30:
                assert first.advance(0.4, 0.4)
                break
        assert np.array_equal(first.state.position, whole[0])
        assert np.array_equal(first.seen()["wall_position"], whole[2]["wall_position"])


@pytest.mark.parametrize("gravity", [None, DOWN], ids=["free", "falling"])
@pytest.mark.parametrize(
    "walls",
    [
        (swarm.Box((1.0, 1.0, 1.0), inertia=5.0, motion=swarm.Rotation((0.0, 0.0, 1.0), 0.3, (0.0, 0.0, 0.0))),),
        (swarm.Sphere(1.6, mass=20.0),),
        (
            BOX,
            plate(3.0),
            swarm.Plane((0.0, 0.0, 1.0), 0.95, mass=4.0, motion=swarm.Guide((0.0, 0.0, 1.0), stiffness=50.0)),
        ),
        (swarm.Box((1.0, 1.0, 1.0), motion=swarm.Oscillation((0.0, 0.1, 0.0), 3.0)), plate(3.0)),
    ],
    ids=["drum", "shell", "two", "one given"],
)
def test_walls_of_many_kinds(walls, gravity):
    _scene, balls = moving(plate(), gravity=gravity)
    scene = swarm.Scene(walls, gravity=gravity)
    run = run_of(scene, balls)
    position, _velocity, seen = frames(run, np.linspace(0.0, 0.8, 4)[1:])
    assert seen["energy_error"] < 1e-12
    assert seen["max_penetration"] < 1e-12
    assert depth(scene, position, balls.radius) < 1e-12
    assert run._heavy.counts[STRIKES] > 3.0


@pytest.mark.parametrize("wall", [plate(0.5), free(0.5), hanging(0.5), paddle()], ids=str)
def test_balls_that_are_far_meet_no_wall_before_they_look_again(wall, monkeypatch):
    scene, balls = moving(wall)
    seldom = frames(run_of(scene, balls), [0.5])
    monkeypatch.setattr(Heavy, "soon", lambda self, now: math.inf)
    often = frames(run_of(scene, balls), [0.5])
    for one, other in zip(seldom[:2], often[:2], strict=True):
        assert one == pytest.approx(other, abs=1e-9)
    assert seldom[2]["wall_energy"] == pytest.approx(often[2]["wall_energy"], abs=1e-9)


@pytest.mark.level3
def test_compiled_and_plain_agree_with_any_number_of_threads():
    scene, balls = moving(plate(0.5))
    plain = frames(run_of(scene, balls), [0.4])
    for threads in (1, 2):
        position, velocity, _seen = frames(run_of(scene, balls, threads, "always"), [0.2, 0.4])
        assert np.array_equal(position, plain[0])
        assert np.array_equal(velocity, plain[1])


def test_energy_in_all_frames():
    scene, balls = moving(plate(0.5))
    options = {"every": 0.15, "compile": "never", "progress": False}
    whole = swarm.simulate(scene, balls.copy(), swarm.Impact(), until=0.6, **options)
    assert whole.observables["energy_error"].max() < 1e-13
    assert whole.observables["wall_velocity"][-1, 1, 0] != 0.0


def test_discs_and_a_heavy_disc_stay_in_their_plane():
    wall = swarm.Slab(ACROSS, 0.02, side="outside", mass=2.0, motion=swarm.Guide(ACROSS))
    scene = swarm.Scene([BOX, wall], plane="z")
    discs = swarm.fill(scene, 20, radius=0.05, speed=1.0, seed=1)
    result = swarm.simulate(scene, discs, swarm.Impact(), until=1.0, compile="never", progress=False)
    assert not result.particles.position[2].any()
    assert not result.particles.velocity[2].any()
    assert result.observables["energy_error"].max() < 1e-13


def test_a_run_that_is_cut_off_goes_on_from_its_file(tmp_path):
    scene, balls = moving(plate(0.5), gravity=DOWN)
    path = tmp_path / "run.h5"

    def run(**more):
        options = {"until": 0.6, "every": 0.1, "compile": "never", "progress": False}
        return swarm.simulate(scene, balls.copy(), swarm.Impact(), **{**options, **more})

    def stop(frame):
        if frame.number == 3:
            signal.raise_signal(signal.SIGTERM)

    whole = run()
    with pytest.raises(KeyboardInterrupt):
        run(trajectory=path, progress=stop, checkpoint=600.0)
    rest = run(trajectory=path, resume=True)
    assert np.array_equal(rest.particles.position, whole.particles.position)
    for name in ("wall_position", "total_energy", "pressure"):
        assert np.array_equal(rest.observables[name], whole.observables[name], equal_nan=True)


@pytest.mark.parametrize("place", [0.95, 0.05], ids=["wall", "plate"])
def test_a_ball_that_reaches_into_a_wall_is_an_error(place):
    scene, balls = moving(plate())
    with run_of(scene, balls) as run:
        run.observe()
        run.require_admissible(run.seen(), 0.0)
        run.state.position[0, 3] = place
        run._observe(0.0)
        with pytest.raises(swarm.RunError, match=r"3: it is .* m outside"):
            run.require_admissible(run.seen(), 0.0)


INLET = swarm.Source(
    swarm.Sphere(0.3, (0.0, 0.0, 0.2)), volume=True, times=np.linspace(0.1, 1.5, 12), speed=1.0, mass=1.0, radius=0.05,
)  # fmt: skip


@pytest.mark.parametrize("wall", [free(motion=swarm.Translation((0.0, 0.0, 0.2))), plate(), hanging()])
def test_balls_are_born_beside_a_wall_with_a_mass(wall):
    """None is born where impacts have moved the wall."""
    scene = swarm.Scene([BOX, wall], DOWN if wall.inertia else None)
    result = swarm.simulate(
        scene, None, swarm.Impact(), sources=[INLET], until=2.0, every=0.05, compile="never", seed=3
    )
    seen = result.observables
    assert seen["born"][-1, 0] == 12
    assert seen["energy_error"].max() <= 1e-12
    assert seen["max_penetration"].max() <= 1e-12
    assert seen["wall_energy"][-1, 1] != seen["wall_energy"][0, 1]


def test_no_ball_is_born_within_a_wall_that_was_pushed():
    """The plate is where the inlet is, and the birth waits until it has passed."""
    inlet = swarm.Source(swarm.Sphere(0.05), volume=True, times=[0.5], speed=1.0, mass=1.0, radius=0.05)
    plate = swarm.Slab(ACROSS, 0.1, (-0.5, 0.0, 0.0), "outside", mass=5.0, motion=swarm.Guide(ACROSS, speed=1.0))
    options = {"until": 1.0, "every": 0.01, "compile": "never", "sources": [inlet]}
    seen = swarm.simulate(swarm.Scene([BOX, plate]), None, swarm.Impact(), **options).observables
    assert seen["blocked"][-1, 0] == 1
    # Its rear face is 0.05 m away from the nearest centre at 0.6 s at the earliest.
    born = seen["time"][np.argmax(seen["born"][:, 0] > 0)]
    assert 0.6 <= born <= 0.8
    assert seen["max_penetration"].max() == 0.0


@pytest.mark.parametrize("of_heavy", [False, True])
def test_absorbed_balls_stay_where_they_are(of_heavy):
    """Leases end for all balls, also for those that are gone."""
    laws = {"laws": [swarm.Absorb(0.3)]}
    box = swarm.Box((0.5, 0.5, 0.5), **({} if of_heavy else laws))
    wall = swarm.Sphere(0.15, side="outside", mass=2.0, **(laws if of_heavy else {}))
    start = swarm.fill(scene := swarm.Scene([box, wall]), 20, speed=1.0, seed=3, radius=0.05)
    options = {"until": 3.0, "every": 0.25, "compile": "never", "seed": 3}
    result = swarm.simulate(
        scene, start, swarm.Impact(), observables={"places": lambda frame: frame.position}, **options
    )
    gone, seen = np.flatnonzero(~np.isnan(result.absorbed_time)), result.observables
    assert seen["absorbed"][-1, int(of_heavy)] == len(gone) > 2
    assert seen["energy_error"].max() <= 1e-12
    for i in gone:
        later = np.array([place[:, i] for time, place in zip(seen["time"], seen["places"], strict=True)
                          if time > result.absorbed_time[i]])  # fmt: skip
        assert (later == result.particles.position[:, i]).all()
    if of_heavy:
        # Where they were absorbed, they gave the wall their normal momentum.
        assert seen["wall_heat"][-1, 1] != 0.0
    else:
        depth = np.abs(result.particles.position[:, gone]).max(axis=0)
        np.testing.assert_allclose(depth, 0.45, rtol=0, atol=1e-12)
