"""Walls that impacts move: counts and trajectories in closed form, energy and momentum, the same bits."""

import functools
import itertools
import math

import mpmath
import numpy as np
import pytest
from energy_books import unbooked
from scipy.integrate import solve_ivp

import swarm
from examples import heavy_piston
from swarm.run.machine import run_of
from swarm.run.options import RunOptions
from swarm.run.preflight.admission import task_of

DOWN = (0.0, 0.0, -1.0)
UP = (0.0, 0.0, 1.0)
SHAFT = swarm.Box((0.5, 0.5, 2.0), center=(0.0, 0.0, 2.0), open=("+z",))


def piston(mass, **guide):
    return swarm.Plane(UP, 1.0, mass=mass, motion=swarm.Guide(UP, **guide))


def bob(rate):
    hinge = swarm.Rotation((0.0, 1.0, 0.0), rate=rate, center=(0.0, 0.0, 0.3))
    return swarm.Sphere(0.15, center=(0.3, 0.0, 0.1), side="outside", mass=2.0, inertia=0.4, motion=hinge)


SCENES = {
    "piston": lambda g: swarm.Scene([SHAFT, piston(8.0)], DOWN),
    "spring": lambda g: swarm.Scene([SHAFT, piston(8.0, stiffness=40.0)], g),
    "shell": lambda g: swarm.Scene([swarm.Sphere(0.5, mass=5.0)], g),
    "moving shell": lambda g: swarm.Scene(
        [swarm.Ellipsoid((0.5, 0.4, 0.3), mass=5.0, motion=swarm.Translation((1.0, 0.0, 0.5)))], g
    ),
    "crate": lambda g: swarm.Scene([swarm.Box((0.5, 0.4, 0.3), rotation=(1.0, 0.2, 0.1, 0.3), mass=5.0)], g),
    "ball": lambda g: swarm.Scene(
        [swarm.Box((0.5, 0.5, 0.5)), swarm.Sphere(0.15, center=(0.1, 0.0, 0.0), side="outside", mass=5.0)], None
    ),
    "drum": lambda g: swarm.Scene(
        [swarm.Box((0.5, 0.4, 0.3), inertia=1.0, motion=swarm.Rotation(UP, rate=0.5, center=(0.0, 0.0, 0.0)))], g
    ),
    "paddle": lambda g: swarm.Scene(
        [
            swarm.Cylinder(0.5, length=1.0),
            swarm.Box((0.4, 0.05, 0.3), side="outside", inertia=0.5, motion=swarm.Rotation(UP, 0.5, (0.0, 0.0, 0.0))),
        ],
        g,
    ),
    "pendulum": lambda g: swarm.Scene([swarm.Box((0.6, 0.6, 0.6)), bob(0.5)], DOWN),
    "two pistons": lambda g: swarm.Scene(
        [swarm.Box((0.5, 0.5, 2.0)), piston(8.0), swarm.Plane((0.0, 0.0, -1.0), 1.0, mass=3.0, motion=swarm.Guide(UP))],
        None,
    ),
    "shaken": lambda g: swarm.Scene(
        [SHAFT, swarm.Plane((0.0, 0.0, -1.0), -0.1, motion=swarm.Oscillation((0.0, 0.0, 0.05), 2.0)), piston(8.0)], DOWN
    ),
}  # fmt: skip


def run(scene, particles, until, frames=1, **options):
    options = {"compile": "never", **options}
    return swarm.simulate(scene, particles, swarm.Impact(), until=until, every=until / frames, **options)


@functools.cache
def gas(name, gravity):
    """Twenty particles in a scene of the table, for 4 s."""
    scene = SCENES[name](gravity)
    return run(scene, swarm.fill(scene, 20, speed=1.0, seed=3), 4.0, frames=4)


def imbalance(result):
    """Relative to what the energy is the sum of."""
    seen = result.observables
    parts = seen["kinetic_energy"] + np.abs(seen["potential_energy"]) + np.abs(seen["wall_energy"]).sum(axis=1)
    return unbooked(seen) / parts.max()


# --- Closed forms ----------------------------------------------------------------------------------------


def galperin(digits):
    """A ball of 1 kg at rest between a wall and a piston of 100^digits kg that comes."""
    guide = swarm.Guide((1.0, 0.0, 0.0), speed=-1.0)
    # Slabs, of which the second face of each is met by nothing: the kind of the light piston below.
    wall = swarm.Slab((1.0, 0.0, 0.0), 100.0, center=(100.0, 0.0, 0.0))
    heavy = swarm.Slab((1.0, 0.0, 0.0), 0.5, (1.5, 0.0, 0.0), "outside", mass=100.0**digits, motion=guide)
    return swarm.Scene([wall, heavy]), swarm.Particles([0.5, 0.0, 0.0], [0.0, 0.0, 0.0])


@pytest.mark.parametrize(("digits", "impacts"), [(0, 3), (1, 31), (2, 314), (3, 3141), (4, 31415)])
def test_impacts_count_the_digits_of_pi(digits, impacts):
    # Impacts by the ten thousand are sooner done by a kernel.
    result = run(*galperin(digits), until=20.0, compile="never" if digits < 4 else "always")
    assert result.observables["impacts"][-1] == impacts
    assert result.observables["energy_error"].max() <= 1e-14


def test_half_of_the_impacts_come_before_the_wall_is_nearest():
    result = run(*galperin(3), until=1.0, compile="never")
    assert result.observables["impacts"][-1] == 1570
    assert result.observables["energy_error"].max() <= 1e-14


def test_galperin_unfolded():
    """In the coordinates sqrt(m) x the motion is a straight line in a wedge, and its end has a closed form."""
    digits, until = 2, 5.0
    result = run(*galperin(digits), until=until)
    # y = sqrt(M) X, x: the line from (sqrt(M), 1/2) with the velocity (-sqrt(M), 0), folded into 0 <= x <= X
    mpmath.mp.dps = 40
    root = mpmath.mpf(10) ** digits
    angle = mpmath.atan(1 / root)
    place = mpmath.mpc(root * (1 - until), mpmath.mpf(1) / 2)
    turns = mpmath.floor(mpmath.arg(place) / angle)
    folded = place * mpmath.expj(-turns * angle)
    if int(turns) % 2:
        folded = mpmath.conj(folded) * mpmath.expj(angle)
    assert result.particles.position[0, 0] == pytest.approx(float(folded.imag), rel=1e-11)
    assert 1.0 + result.observables["wall_position"][-1, 1, 0] == pytest.approx(float(folded.real / root), rel=1e-12)


def test_a_wall_in_uniform_motion_beside_one_that_reacts():
    """Three impacts within a frame: at 0.4 s, at 1 s on the wall with a mass, at 1.75 s."""
    closing = swarm.Plane((1.0, 0.0, 0.0), 1.0, motion=swarm.Translation((-0.25, 0.0, 0.0)))
    heavy = swarm.Plane((-1.0, 0.0, 0.0), 0.0, mass=3.0, motion=swarm.Guide((1.0, 0.0, 0.0)))
    start = swarm.Particles([0.5, 0.0, 0.0], [1.0, 0.0, 0.0])
    result = run(swarm.Scene([closing, heavy]), start, until=2.0)
    assert result.observables["impacts"][-1] == 3
    assert result.particles.position[0, 0] == pytest.approx(0.25, abs=1e-15)
    assert result.particles.velocity[0, 0] == pytest.approx(-1.25, abs=1e-15)
    assert result.observables["wall_position"][-1, 1, 0] == pytest.approx(-0.75, abs=1e-15)


def test_nothing_strikes():
    """A wall that nothing strikes falls, vibrates or turns by its closed form, frame by frame."""
    far = swarm.Particles([0.0, 0.0, 0.2], [0.0, 0.0, 0.0])
    frames, until = 7, 3.0
    times = np.linspace(0.0, until, frames + 1)

    def walls(surface, gravity):
        scene = swarm.Scene([swarm.Sphere(0.5), surface], gravity)
        return run(scene, far, until, frames).observables

    seen = walls(swarm.Plane(UP, 20.0, mass=2.0, motion=swarm.Guide((0.0, 0.6, 0.8), speed=0.5)), DOWN)
    along = 0.5 * times - 0.5 * 0.8 * times**2
    assert np.abs(seen["wall_position"][:, 1] - np.outer(along, (0.0, 0.6, 0.8))).max() <= 1e-14
    seen = walls(swarm.Plane(UP, 20.0, mass=2.0, motion=swarm.Guide(UP, speed=0.5, stiffness=18.0)), DOWN)
    rest = -1.0 / 9.0
    expected = rest - rest * np.cos(3.0 * times) + 0.5 / 3.0 * np.sin(3.0 * times)
    assert np.abs(seen["wall_position"][:, 1, 2] - expected).max() <= 1e-14
    hinge = swarm.Rotation(UP, rate=2.0, center=(3.0, 0.0, 0.0))
    seen = walls(swarm.Sphere(0.1, center=(4.0, 0.0, 0.0), side="outside", inertia=1.0, motion=hinge), None)
    assert np.abs(seen["wall_orientation"][:, 1, 0] - np.cos(times)).max() <= 1e-14
    assert seen["wall_spin"][-1, 1] == pytest.approx((0.0, 0.0, 2.0))
    seen = walls(swarm.Sphere(9.0, mass=1.0, motion=swarm.Translation((0.1, 0.0, 0.0))), DOWN)
    assert np.abs(seen["wall_position"][:, 1, 2] + 0.5 * times**2).max() <= 1e-14


@pytest.mark.parametrize("rate", [0.0, 0.5, 30.0])
def test_a_pendulum_that_nothing_strikes(rate):
    """Against DOP853, from small vibrations to one that goes round and round."""
    scene = swarm.Scene([swarm.Box((5.0, 5.0, 5.0)), bob(rate)], (0.0, 0.0, -9.81))
    seen = run(scene, swarm.Particles([4.0, 4.0, 4.0], [0.0, 0.0, 0.0]), 0.8, frames=4).observables
    arm, axis, weight = np.array([0.3, 0.0, -0.2]), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -2.0 * 9.81])

    def slope(_t, y):
        turned = arm * np.cos(y[0]) + np.sin(y[0]) * np.cross(axis, arm)
        return [y[1], axis @ np.cross(turned, weight) / 0.4]

    path = solve_ivp(slope, (0.0, 0.8), [0.0, rate], method="DOP853", rtol=1e-13, atol=1e-13, t_eval=seen["time"])
    assert np.abs(seen["wall_spin"][:, 1, 1] - path.y[1]).max() <= 1e-11 * max(1.0, rate)
    assert np.abs(seen["wall_orientation"][:, 1, 2] - np.sin(0.5 * path.y[0])).max() <= 1e-11
    assert seen["energy_error"].max() <= 1e-14


def test_one_dimension_against_a_plain_event_loop():
    """Particles on both sides of a piston: by a loop over all pairs in 40 digits, in order of time."""
    random, count, mass, until = np.random.default_rng(5), 6, 4.0, 8.0
    sides = np.where(np.arange(count) % 2, 1.0, -1.0)
    x, v = sides * random.uniform(0.1, 0.9, count), random.uniform(-1.0, 1.0, count)
    ends = swarm.Slab((1.0, 0.0, 0.0), 1.0)
    plate = swarm.Slab((1.0, 0.0, 0.0), 1e-3, side="outside", mass=mass, motion=swarm.Guide((1.0, 0.0, 0.0)))
    start = [np.vstack([row, np.zeros((2, count))]) for row in (x, v)]
    result = run(swarm.Scene([ends, plate]), swarm.Particles(*start), until, frames=3)

    mpmath.mp.dps = 40
    half = mpmath.mpf(1e-3)
    x, v = [mpmath.mpf(float(a)) for a in x], [mpmath.mpf(float(a)) for a in v]
    place, speed, clock, impacts = mpmath.mpf(0), mpmath.mpf(0), mpmath.mpf(0), 0
    while True:
        events = []
        for i, side in enumerate(sides):
            near, far = place + side * half, mpmath.mpf(side)
            if (v[i] - speed) * side < 0:
                events.append(((near - x[i]) / (v[i] - speed), i, True))
            if v[i] * side > 0:
                events.append(((far - x[i]) / v[i], i, False))
        step, i, struck = min(events)
        if clock + step > until:
            break
        clock, place, impacts = clock + step, place + speed * step, impacts + 1
        x = [a + b * step for a, b in zip(x, v, strict=True)]
        if struck:
            centre = (v[i] + mass * speed) / (1 + mass)
            v[i], speed = 2 * centre - v[i], 2 * centre - speed
        else:
            v[i] = -v[i]
    x, place = [a + b * (until - clock) for a, b in zip(x, v, strict=True)], place + speed * (until - clock)
    seen = result.observables
    assert seen["impacts"][-1] == impacts > 20
    assert np.abs(result.particles.position[0] - np.array(x, float)).max() <= 1e-11
    assert seen["wall_position"][-1, 1, 0] == pytest.approx(float(place), abs=1e-12)
    assert seen["wall_velocity"][-1, 1, 0] == pytest.approx(float(speed), abs=1e-12)


def test_an_infinite_mass_is_a_given_motion():
    """A wall of 1e30 kg moves as if nothing struck it."""
    velocity = (0.3, -0.2, 0.1)
    heavy, given = (swarm.Sphere(0.5, motion=swarm.Translation(velocity), mass=m) for m in (1e30, None))
    start = swarm.fill(swarm.Scene([given]), 5, speed=1.0, seed=2)
    one, other = (run(swarm.Scene([surface]), start, 3.0) for surface in (heavy, given))
    assert np.abs(one.particles.position - other.particles.position).max() <= 1e-12
    assert (one.impacts_per_particle == other.impacts_per_particle).all()


# --- What is conserved -----------------------------------------------------------------------------------


@pytest.mark.parametrize("gravity", [None, DOWN], ids=["straight", "falling"])
@pytest.mark.parametrize("name", SCENES)
def test_energy(name, gravity):
    result = gas(name, gravity)
    assert result.observables["impacts"][-1] > 40
    assert imbalance(result) <= 4e-15
    assert result.observables["energy_error"].max() <= 1e-14
    assert result.observables["max_penetration"].max() <= 1e-14
    assert np.ptp(result.observables["wall_energy"], axis=0).max() > 1e-3


@pytest.mark.parametrize("name", ["shell", "moving shell", "crate"])
def test_momentum_of_a_free_shell(name):
    seen = gas(name, None).observables
    whole = seen["momentum"] + 5.0 * seen["wall_velocity"][:, 0]
    assert np.abs(whole - whole[0]).max() <= 1e-13 * 20.0


def test_angular_momentum_of_a_drum():
    """About its axis: particles and wall together."""
    seen = gas("drum", None).observables
    whole = seen["angular_momentum"][:, 2] + seen["wall_spin"][:, 0, 2]
    assert np.abs(whole - whole[0]).max() <= 1e-12


def test_restitution_loses_what_it_books():
    walls = [
        swarm.Box((0.5, 0.5, 0.5), restitution=0.9),
        swarm.Sphere(0.15, side="outside", mass=3.0, restitution=0.7),
    ]
    scene = swarm.Scene(walls)
    seen = run(scene, swarm.fill(scene, 20, speed=1.0, seed=3), 4.0, frames=4)
    assert seen.observables["dissipated_energy"][-1] > 1.0
    assert imbalance(seen) <= 1e-14


def test_a_light_piston_takes_its_share():
    """Equal mean energies along the guide, of the piston and of each gas, within 3 standard errors."""
    count, mass = 20, 4.0
    random = np.random.default_rng(1)
    sides = np.where(np.arange(count) % 2, 1.0, -1.0)
    x, v = sides * random.uniform(0.05, 0.95, count), np.where(sides > 0.0, 0.5, 1.5) * random.standard_normal(count)
    plate = swarm.Slab((1.0, 0.0, 0.0), 0.01, side="outside", mass=mass, motion=swarm.Guide((1.0, 0.0, 0.0)))
    start = swarm.Particles(*(np.vstack([row, np.zeros((2, count))]) for row in (x, v)))
    scene = swarm.Scene([swarm.Slab((1.0, 0.0, 0.0), 1.0), plate])
    kinetic = []
    result = run(
        scene, start, 9_000.0, frames=1_800, compile="always",
        progress=lambda frame: kinetic.append(float(frame.observables["wall_energy"][1])),
    )  # fmt: skip
    energy = result.observables["total_energy"][0]
    blocks = np.array(kinetic[201:]).reshape(40, -1).mean(axis=1)
    mean, error = blocks.mean(), blocks.std(ddof=1) / math.sqrt(len(blocks))
    assert abs(mean - energy / (count + 1)) <= 3.0 * error
    assert error <= 0.05 * mean
    assert result.observables["energy_error"].max() <= 1e-13


def test_a_hot_gas_warms_a_cold_one_through_a_heavy_piston():
    """examples/heavy_piston.py with few particles: equal mean energies at the end, within 3 standard errors."""
    found = heavy_piston.run(count=300, mass=10.0, until=1000.0)
    difference, error = heavy_piston.late_difference(found)
    assert found.above[0] > 2.0 * found.below[0]
    assert abs(difference) <= 3.0 * error <= 0.1 * found.above[0]
    assert found.balance <= 1e-14


# --- The same bits ---------------------------------------------------------------------------------------


def states(result):
    parts = result.particles, result.observables
    return [parts[0].position, parts[0].velocity, *(parts[1][name] for name in sorted(parts[1]))]


@pytest.mark.parametrize("name", ["piston", "ball", "drum"])
def test_threads_and_tiers_change_no_bit(name):
    scene = SCENES[name](None)
    start = swarm.fill(scene, 2000, speed=1.0, seed=4)
    one, two = (run(scene, start, 0.2, 2, compile="always", threads=n) for n in (1, 2))
    assert all(np.array_equal(a, b) for a, b in zip(states(one), states(two), strict=True))
    few = swarm.fill(scene, 10, speed=1.0, seed=4)
    plain, compiled = (run(scene, few, 1.0, 2, compile=tier) for tier in ("never", "always"))
    assert all(np.array_equal(a, b) for a, b in zip(states(plain), states(compiled), strict=True))


def test_halts_change_no_bit():
    """A frame that is halted after any number of events, taken over by another run, ends as one that is not."""
    scene = SCENES["spring"](DOWN)
    start = swarm.fill(scene, 15, speed=1.0, seed=4)
    whole = run(scene, start, 2.0)
    task = task_of(scene, start, swarm.Impact(), RunOptions(until=2.0, compile="never"))
    with run_of(task) as first:
        first.observe()
        for events in itertools.count(1):
            first.halt(events)
            if first.advance(2.0, 2.0):
                break
            kept = {name: array.copy() for name, array in first.arrays().items()}
            other = run_of(task_of(scene, start, swarm.Impact(), RunOptions(until=2.0, compile="never")))
            other.restore(kept, cut_short=True)
            first.__exit__()
            first = other
        seen = first.seen()
        assert events > 5
        assert np.array_equal(first.state.position, whole.particles.position)
        assert seen["total_energy"] == whole.observables["total_energy"][-1]
        assert np.array_equal(seen["wall_position"], whole.observables["wall_position"][-1])


# --- Bad input -------------------------------------------------------------------------------------------

ONE = swarm.Particles([0.0, 0.0, 0.2], [1.0, 0.0, 0.0])
HOT = {"temperature": {"temperature": 2.0}, "Lambert": {"laws": [swarm.Lambert()]}}


@pytest.mark.parametrize("radius", [None, 0.05])
@pytest.mark.parametrize("name", HOT)
def test_walls_beside_one_with_a_mass_send_particles_off(name, radius):
    """What the wall gives as heat is the change of the energy of all."""
    box = swarm.Box((1.0, 0.5, 0.5), **HOT[name])
    slab = swarm.Slab(UP, 0.1, side="outside", mass=2.0, motion=swarm.Guide(UP, speed=0.3))
    ends = {}
    for scene in (swarm.Scene([box, slab]), swarm.Scene([swarm.Box((1.0, 0.5, 0.5)), slab])):
        start = swarm.fill(scene, 8, speed=1.0, seed=3, radius=radius)
        ends[scene] = swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile="never", seed=5)
    sent, mirrored = ends.values()
    seen = sent.observables
    assert (sent.particles.velocity != mirrored.particles.velocity).any()
    assert seen["wall_heat"][-1, 1] == 0.0
    assert (seen["wall_heat"][-1, 0] != 0.0) == (name == "temperature")
    change = seen["total_energy"][-1] - seen["total_energy"][0]
    np.testing.assert_allclose(change, seen["wall_heat"][-1, 0], rtol=0, atol=1e-13 * seen["total_energy"][-1])
    assert seen["energy_error"].max() < 1e-14
    assert seen["wall_energy"][-1, 1] != seen["wall_energy"][0, 1]


WRONG = [
    (lambda: swarm.Sphere(0.5, mass=0.0), "mass must be above 0, got 0"),
    (lambda: swarm.Sphere(0.5, mass=math.inf), "mass must be a finite number"),
    (lambda: swarm.Sphere(0.5, mass=1.0, motion=swarm.Oscillation((1.0, 0.0, 0.0), 1.0)), "a Guide with a stiffness"),
    (lambda: swarm.Sphere(0.5, inertia=1.0), "motion must be a Rotation where an inertia is given, got None"),
    (
        lambda: swarm.Plane(UP, mass=1.0, inertia=1.0, motion=swarm.Rotation((1.0, 0.0, 0.0), 0.0, (0.0, 0.0, 0.0))),
        "mass must be None where an inertia is given to a Plane",
    ),
    (lambda: swarm.Plane(UP, motion=swarm.Guide(UP)), "mass must go with a Guide"),
    (lambda: swarm.Guide((0.0, 0.0, 0.0)), "axis must have a direction"),
    (lambda: swarm.Guide(UP, stiffness=-1.0), "stiffness must be"),
    (lambda: swarm.Guide(UP, speed=math.nan), "speed must be"),
    (lambda: swarm.Guide(UP) + swarm.Translation(UP), "a sum of motions must have at most 0 Guide, got 1"),
    (
        lambda: run(swarm.Scene([swarm.Box((2.0, 2.0, 2.0), laws=[swarm.Sticky(0.5)], mass=1.0)]), ONE, 1.0),
        r"surfaces\[0\].laws\[0\] must not let particles wait where a wall moves",
    ),
    (
        lambda: run(swarm.Scene([swarm.Sphere(0.5, restitution=0.3, mass=1.0)], DOWN), ONE, 1.0),
        r"surfaces\[0\].restitution must be 1 under gravity where a wall has a mass",
    ),
    (
        lambda: swarm.simulate(swarm.Scene([swarm.Sphere(0.5, mass=1.0)]), ONE, swarm.Penalty(1e-3, 1e4), until=1.0),
        r"surfaces\[0\].mass must be None with Penalty",
    ),
    (
        lambda: swarm.simulate(
            swarm.Scene([swarm.Sphere(0.5, mass=1.0)]), ONE, swarm.Impact(contact_step=1e-3), until=1.0
        ),
        "contact_step must be 0",
    ),
    (
        lambda: run(swarm.Scene([swarm.Sphere(0.1, mass=1.0)]), ONE, 1.0),
        "particles must start inside their walls",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("call", "sentence"), WRONG, ids=range(len(WRONG)))
def test_bad_input(call, sentence):
    with pytest.raises(swarm.SceneError, match=sentence):
        call()
