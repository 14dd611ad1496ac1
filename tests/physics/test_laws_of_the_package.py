"""The laws that swarm has: distributions, moments, closed forms, and the books."""

import math

import numpy as np
import pytest
from energy_books import unbooked
from physics.test_wall_laws import KOLMOGOROV, kolmogorov
from same_bits import require_same
from scipy.optimize import brentq
from scipy.special import ndtr
from test_sessions import require_resumed_is_whole

import swarm
from swarm.kernel.random import Stream
from swarm.kernel.vector import dot
from swarm.observables import drift

pytestmark = pytest.mark.physics
G = (0.0, 0.0, -9.81)
EPSILON = np.finfo(float).eps
# A wall turned away from the axes, and its velocity.
NORMAL = np.array([0.6, -0.48, 0.64])
FIRST = np.cross(NORMAL, (0.0, 0.0, 1.0)) / np.linalg.norm(np.cross(NORMAL, (0.0, 0.0, 1.0)))
SECOND = np.cross(NORMAL, FIRST)


def struck(laws, velocity, mass=1.0, plane=None, seed=5, normal=NORMAL):
    """The velocities with which particles leave a wall that they reach with these, (3, N)."""
    start = swarm.Particles(np.outer(normal, np.full(velocity.shape[1], 1e-9)), velocity, mass)
    scene = swarm.Scene([swarm.Plane(tuple(-normal), 0.0, laws=laws)], plane=plane)
    # Flights that end at the wall, and none that is long.
    until = 2e-9 / np.abs(normal @ velocity).min()
    result = swarm.simulate(scene, start, swarm.Impact(), until=until, seed=seed)
    assert (result.impacts_per_particle == 1).all()
    return result.particles.velocity


def flux(n, speed2, rng):
    """Velocities (3, n) with which a gas of k_B T/m = speed2 comes to the wall."""
    b, one, other = np.sqrt(2.0 * speed2 * rng.exponential(size=n)), *rng.normal(scale=math.sqrt(speed2), size=(2, n))
    return -np.outer(NORMAL, b) + np.outer(FIRST, one) + np.outer(SECOND, other)


# --- Lambert ---------------------------------------------------------------------------------------------


def test_lambert_gives_the_cosine_law():
    """Cosines squared, and azimuths, are uniform: chi squared over cells of both."""
    n, cells = 40_000, 20
    before = np.outer(-0.3 * NORMAL + 0.9 * FIRST - 0.1 * SECOND, np.ones(n))
    v = struck([swarm.Lambert()], before)
    speed = np.linalg.norm(v, axis=0)
    assert np.abs(speed / np.linalg.norm(before[:, 0]) - 1.0).max() <= 2.0 * EPSILON
    cosine, angle = NORMAL @ v / speed, np.arctan2(SECOND @ v, FIRST @ v) / (2.0 * math.pi) + 0.5
    counts, *_edges = np.histogram2d(cosine**2, angle, cells, [(0, 1), (0, 1)])
    expected, free = n / cells**2, cells**2 - 1
    assert ((counts - expected) ** 2 / expected).sum() < free + 3.0 * math.sqrt(2.0 * free)


def test_lambert_in_a_plane():
    """The sine of the angle to the normal is uniform."""
    n, normal = 20_000, np.array([0.6, 0.8, 0.0])
    across = np.array([-0.8, 0.6, 0.0])
    v = struck([swarm.Lambert()], np.outer(-0.7 * normal + 0.2 * across, np.ones(n)), plane="z", normal=normal)
    assert not v[2].any()
    assert kolmogorov(0.5 + 0.5 * (across @ v) / np.linalg.norm(v, axis=0)) < KOLMOGOROV


def test_lambert_for_a_share():
    n = 20_000
    before = np.outer(-0.3 * NORMAL + 0.9 * FIRST, np.ones(n))
    v = struck([swarm.Lambert(0.3)], before)
    mirrored = before + 0.6 * NORMAL[:, None]
    from_mirror = np.abs(v - mirrored).max(axis=0) < 1e-12
    assert from_mirror.mean() == pytest.approx(0.7, abs=3.0 * math.sqrt(0.21 / n))
    diffuse = v[:, ~from_mirror]
    assert kolmogorov((NORMAL @ diffuse) ** 2 / (diffuse**2).sum(axis=0)) < KOLMOGOROV


@pytest.mark.parametrize("gravity", [None, G], ids=["straight", "falling"])
def test_a_law_that_keeps_the_speed_keeps_the_energy_to_the_last_digit(gravity):
    """Of each particle over thousands of impacts: round-off of a law does not add up."""
    scene = swarm.Scene([swarm.Sphere(0.5, laws=[swarm.Lambert(0.7)])], gravity)
    start = swarm.fill(scene, 15, speed=3.0, seed=1)
    result = swarm.simulate(scene, start, swarm.Impact(), until=1000.0, every=100.0, compile="always")
    seen = result.observables
    assert (result.impacts_per_particle > 2000).all()
    assert not seen["wall_heat"].any()
    assert not seen["dissipated_energy"].any()
    assert seen["energy_error"].max() < (4.0 if gravity is None else 16.0) * EPSILON
    if gravity is None:
        speeds = np.linalg.norm(result.particles.velocity, axis=0)
        assert np.abs(speeds / np.linalg.norm(start.velocity, axis=0) - 1.0).max() <= 2.0 * EPSILON


# --- Cercignani and Lampis -------------------------------------------------------------------------------

PAIRS = [(1.0, 1.0), (0.3, 0.7), (0.8, 0.2), (0.0, 0.5), (0.5, 0.0), (0.6, 1.6), (0.4, 2.0)]


@pytest.mark.parametrize(("normal", "tangential"), PAIRS)
def test_a_gas_of_the_walls_temperature_stays_one(normal, tangential):
    """Detailed balance: what comes as the flux of a Maxwellian leaves as that, and would come back as it came.

    Both tangential velocities are normal with one variance, so that their correlation, 1 - sigma_t, is all that a
    reversal could change, and it is the same both ways; that of the normal ones is seen in the order of their energies.
    """
    n, temperature, mass = 20_000, 0.7, 2.5
    before = flux(n, temperature / mass, np.random.default_rng(8))
    v = struck([swarm.CercignaniLampis(temperature, normal, tangential)], before, mass)
    assert kolmogorov(np.exp(-mass * (NORMAL @ v) ** 2 / (2.0 * temperature))) < KOLMOGOROV
    for way in (FIRST, SECOND):
        assert kolmogorov(ndtr(way @ v * math.sqrt(mass / temperature))) < KOLMOGOROV
        assert np.corrcoef(way @ before, way @ v)[0, 1] == pytest.approx(1.0 - tangential, abs=4.0 / math.sqrt(n))
    comes, goes = -NORMAL @ before, NORMAL @ v
    assert (goes > comes).mean() == pytest.approx(0.5, abs=4.0 * 0.5 / math.sqrt(n)) or normal == 0.0


@pytest.mark.parametrize(("normal", "tangential"), PAIRS)
def test_published_moments(normal, tangential):
    """Lord's: <w_n'^2>, <w_t'>, <w_t'^2> of one beam, each within 3 standard errors."""
    n, temperature, mass = 40_000, 0.7, 2.5
    b, t = 1.1, 0.6
    v = struck(
        [swarm.CercignaniLampis(temperature, normal, tangential)],
        np.outer(-b * NORMAL + t * FIRST, np.ones(n)), mass,
    )  # fmt: skip
    thermal = 2.0 * temperature / mass
    spread = tangential * (2.0 - tangential)
    for found, expected in (
        ((NORMAL @ v) ** 2, (1.0 - normal) * b * b + normal * thermal),
        (FIRST @ v, (1.0 - tangential) * t),
        (SECOND @ v, 0.0),
        ((FIRST @ v) ** 2, (1.0 - tangential) ** 2 * t * t + 0.5 * spread * thermal),
        ((SECOND @ v) ** 2, 0.5 * spread * thermal),
    ):
        assert found.mean() == pytest.approx(expected, abs=3.0 * found.std() / math.sqrt(n) + 1e-12)


def test_its_limits_are_a_thermal_wall_and_a_mirror():
    n, temperature = 20_000, 0.7
    before = np.outer(-1.1 * NORMAL + 0.6 * FIRST, np.ones(n))
    v = struck([swarm.CercignaniLampis(temperature, 1.0, 1.0)], before)
    assert kolmogorov(np.exp(-((NORMAL @ v) ** 2) / (2.0 * temperature))) < KOLMOGOROV
    assert kolmogorov(ndtr(FIRST @ v / math.sqrt(temperature))) < KOLMOGOROV
    reversed_ = struck([swarm.CercignaniLampis(temperature, 0.0, 2.0)], before)
    assert reversed_ == pytest.approx(-before, abs=1e-15)
    mirrored = struck([swarm.CercignaniLampis(temperature, 0.0, 0.0)], before)
    assert mirrored == pytest.approx(before + 2.2 * NORMAL[:, None], abs=1e-15)
    # At 0 K the normal speed is sqrt(1 - alpha_n) of what it was.
    cold = struck([swarm.CercignaniLampis(0.0, 0.19, 0.5)], before)
    assert cold == pytest.approx(np.outer(0.9 * 1.1 * NORMAL + 0.3 * FIRST, np.ones(n)), abs=1e-15)


def test_it_stays_in_a_plane():
    n, normal, temperature = 20_000, np.array([0.6, 0.8, 0.0]), 0.7
    across = np.array([-0.8, 0.6, 0.0])
    before = np.outer(-0.7 * normal + 0.2 * across, np.ones(n))
    v = struck([swarm.CercignaniLampis(temperature, 1.0, 1.0)], before, plane="z", normal=normal)
    assert not v[2].any()
    assert kolmogorov(np.exp(-((normal @ v) ** 2) / (2.0 * temperature))) < KOLMOGOROV
    assert kolmogorov(ndtr(across @ v / math.sqrt(temperature))) < KOLMOGOROV
    v = struck([swarm.CercignaniLampis(temperature, 1.0, 1.5)], before, plane="z", normal=normal)
    assert not v[2].any()
    width = math.sqrt(0.75 * temperature)
    assert kolmogorov(ndtr((across @ v + 0.5 * 0.2) / width)) < KOLMOGOROV


@pytest.mark.parametrize("a", [1.0, 0.6, 0.2])
def test_heat_between_two_plates(a):
    """a/(2 - a) of what thermal plates give, 2 k_B (T1 - T2) an impact: each sends off (1 - a) E + a E_wall on average.

    Both energies are accommodated by a: alpha_n = sigma_t (2 - sigma_t) = a.
    """
    hot, cold = 2.0, 1.0
    law = [swarm.CercignaniLampis(kt, a, 1.0 - math.sqrt(1.0 - a)) for kt in (hot, cold)]
    plates = [
        swarm.Plane((0, 0, sign), 0.5, laws=[one]) for sign, one in zip((-1.0, 1.0), law, strict=True)
    ]  # fmt: skip
    scene = swarm.Scene(plates, None, (1.0, 1.0, None))
    rng = np.random.default_rng(3)
    place = rng.uniform(-0.4, 0.4, (3, 1000)) + np.array([[0.5], [0.5], [0.0]])
    start = swarm.Particles(place, rng.normal(size=(3, 1000)))
    seen = swarm.simulate(scene, start, swarm.Impact(), until=400.0, every=40.0, seed=2, compile="always").observables
    assert drift(seen) < 1e-13
    # After the first tenth, in which the gas comes to its state.
    heat, impacts = (np.diff(seen[name][1:], axis=0) for name in ("wall_heat", "impacts"))
    given = heat[:, 0] / (0.5 * impacts)
    expected = a / (2.0 - a) * 2.0 * (hot - cold)
    assert given.mean() == pytest.approx(expected, abs=3.0 * given.std(ddof=1) / math.sqrt(len(given)))
    assert heat[:, 0].sum() == pytest.approx(-heat[:, 1].sum(), rel=0.05)


# --- Absorption ------------------------------------------------------------------------------------------


def test_storage_is_exponential_with_the_loss():
    """n v A/4V times the loss, and its correction by the spread of flights: E exp(k l/v) (1 - p) = 1 for the rate k."""
    n, p, until, radius = 20_000, 0.02, 60.0, 0.5
    scene = swarm.Scene([swarm.Sphere(radius, laws=[swarm.Absorb(p), swarm.Lambert()])])
    start = swarm.fill(scene, n, speed=1.0, seed=1)
    result = swarm.simulate(scene, start, swarm.Impact(), until=until, every=6.0, seed=4)
    absorbed = result.observables["absorbed"][:, 0]
    area, volume = 4.0 * math.pi * radius**2, 4.0 / 3.0 * math.pi * radius**3
    l = np.linspace(0.0, 2.0 * radius, 20_001)  # noqa: E741  of density l/(2 R^2)
    rate = brentq(lambda k: np.trapezoid(np.exp(k * l) * l / (2.0 * radius**2), l) * (1.0 - p) - 1.0, 1e-3, 0.2)
    assert rate == pytest.approx(p * area / (4.0 * volume), rel=p)
    # Of those that are left at 6 s: the first flight is another one.
    left = n - absorbed
    share = math.exp(-rate * (until - 6.0))
    assert left[-1] == pytest.approx(left[1] * share, abs=3.0 * math.sqrt(left[1] * share * (1.0 - share)))
    # Of so many impacts so many absorb.
    impacts = result.observables["impacts"][-1]
    assert absorbed[-1] == pytest.approx(p * impacts, abs=3.0 * math.sqrt(p * impacts))
    assert np.count_nonzero(~np.isnan(result.absorbed_time)) == absorbed[-1]
    assert absorbed == pytest.approx((result.absorbed_time[:, None] <= result.observables["time"]).sum(axis=0))


def test_a_barrier_absorbs_fast_particles():
    rng, n, mass = np.random.default_rng(2), 20_000, 2.0
    b = rng.uniform(0.1, 2.0, n)
    wall = swarm.Plane((0, 0, -1), 0.0, laws=[swarm.Absorb(barrier=1.0, loss=0.25)])
    start = swarm.Particles(np.tile([[0.0], [0.0], [0.1]], n), np.array([rng.normal(size=n), 0.0 * b, -b]), mass)
    result = swarm.simulate(swarm.Scene([wall]), start, swarm.Impact(), until=2.0)
    gone = ~np.isnan(result.absorbed_time)
    above = b > 1.0
    assert gone[above].all()
    below = gone[~above]
    assert below.mean() == pytest.approx(0.25, abs=3.0 * math.sqrt(0.25 * 0.75 / below.size))
    assert result.absorbed_time[gone] == pytest.approx(0.1 / b[gone], rel=1e-12)
    # It is where it was, as fast as it was, and has given its normal momentum; a mirror gives twice that.
    assert result.particles.velocity[2, gone] == pytest.approx(-b[gone], rel=1e-15)
    assert result.particles.position[2, gone] == pytest.approx(0.0, abs=1e-15)
    expected = mass * (b[gone].sum() + 2.0 * b[~gone].sum())
    assert result.observables["impulse"][-1, 0] == pytest.approx(expected, rel=1e-12)
    assert result.observables["absorbed"][-1, 0] == gone.sum()
    assert result.observables["energy_error"].max() <= 4.0 * EPSILON


def test_an_absorbed_particle_costs_nothing_and_stays_where_it_is(tmp_path):
    """In all files, and in the log of impacts, too."""
    scene = swarm.Scene([swarm.Sphere(0.5, laws=[swarm.Absorb(0.2)]), swarm.Sphere(0.1, side="outside")], G)
    path, log = tmp_path / "run.h5", tmp_path / "impacts.h5"
    start = swarm.fill(scene, 300, speed=2.0, seed=1)
    result = swarm.simulate(scene, start, swarm.Impact(), until=4.0, every=0.5, trajectory=path, impacts=log)
    seen, times = result.observables, result.observables["time"]
    assert seen["absorbed"].shape == (len(times), 2)
    assert 150 < seen["absorbed"][-1, 0] < 300
    assert not seen["absorbed"][:, 1].any()
    with swarm.load(path) as written:
        for k, time in enumerate(times):
            written_times = written.absorbed_times(k)
            assert np.array_equal(~np.isnan(written_times), result.absorbed_time <= time)
            gone = ~np.isnan(written_times)
            assert np.array_equal(written.frame(k).position[:, gone], result.particles.position[:, gone])
    with swarm.load_impacts(log) as impacts:
        rows = impacts.table()
    last = rows[np.isin(rows["time"], result.absorbed_time)]
    assert len(last) == seen["absorbed"][-1, 0]
    assert np.array_equal(last["velocity_before"], last["velocity_after"])
    assert (last["impulse"] > 0.0).all()
    assert len(rows) == seen["impacts"][-1]


def test_of_a_field_each_member_is_known():
    centers = [(-0.4, 0.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.4, 0.0)]
    balls = swarm.Spheres(centers, 0.1, laws=[swarm.Absorb(1.0)])
    scene = swarm.Scene([swarm.Sphere(1.0), balls])
    from swarm.run.machine import run_of
    from swarm.run.options import RunOptions, Task

    start = swarm.fill(scene, 500, speed=1.0, seed=1)
    run = run_of(Task(scene.compiled(), start, swarm.Impact(), RunOptions(until=5.0)))
    with run:
        run.observe()
        run.advance(5.0, 5.0)
        wall = run.state.absorbed_wall
        gone = wall >= 0
        surface, member = scene.compiled().numbering.members[:, wall[gone]]
        assert gone.sum() == run.seen()["absorbed"][1] > 30
        assert (surface == 1).all()
        away = run.state.position[:, gone] - np.array(centers)[member].T
        assert np.linalg.norm(away, axis=0) == pytest.approx(0.1, abs=1e-14)


# --- Residence -------------------------------------------------------------------------------------------


def test_a_particle_that_sticks_leaves_after_the_mean_time():
    """A particle meets the wall once in 4 V/A/v + the residence time; the frames do not matter to it."""
    scene = swarm.Scene([swarm.Sphere(0.5, laws=[swarm.Lambert(), swarm.Sticky(0.5)])])
    start = swarm.fill(scene, 4000, speed=1.0, seed=1)
    one, whole = (
        swarm.simulate(scene, start, swarm.Impact(), until=200.0, every=every, seed=3, compile="always")
        for every in (2.5, None)
    )
    counts = whole.impacts_per_particle
    # The variance of a renewal process, of flights of length l with the density l/(2 R^2) and an exponential.
    mean, variance = 2.0 / 3.0 + 0.5, 0.5 - 4.0 / 9.0 + 0.25
    spread = math.sqrt(200.0 * variance / mean**3 / 4000)
    assert counts.mean() == pytest.approx(200.0 / mean, abs=3.0 * spread + 1.0)
    assert np.array_equal(counts, one.impacts_per_particle)
    assert one.particles.position == pytest.approx(whole.particles.position, abs=1e-10)
    assert one.observables["energy_error"].max() <= 4.0 * EPSILON


def test_a_particle_that_waits_has_the_velocity_of_its_leave(tmp_path):
    wall = swarm.Plane((0, 0, -1), 0.0, laws=[swarm.Sticky(1.0)])
    n = 2000
    start = swarm.Particles(np.tile([[0.0], [0.0], [0.5]], n), np.tile([[0.0], [0.0], [-1.0]], n))
    path = tmp_path / "run.h5"
    swarm.simulate(swarm.Scene([wall]), start, swarm.Impact(), until=3.0, every=0.1, trajectory=path, compile="always")
    with swarm.load(path) as written:
        heights = np.array([written.frame(k).position[2] for k in range(len(written))])
        assert (written.frame(6).velocity[2] == 1.0).all()
    waits = 2.5 - heights[-1]
    waits = waits[heights[-1] > 0.0]
    assert kolmogorov((1.0 - np.exp(-waits)) / (1.0 - math.exp(-2.5))) < KOLMOGOROV
    assert (heights >= 0.0).all()


# --- Several laws, and all of them in all runs -----------------------------------------------------------


class Half(swarm.WallLaw):
    """Half the normal speed of half of the particles."""

    book = "dissipated"

    def leave(self, v, n, u, random, mass):
        return v - (1.5 if random.uniform(0) < 0.5 else 2.0) * dot(v - u, n) * n


def test_two_laws_of_a_wall_draw_by_themselves():
    n = 20_000
    v = struck([Half(), Half()], np.outer(-NORMAL, np.ones(n)))
    speeds, counts = np.unique(np.round(NORMAL @ v, 12), return_counts=True)
    assert speeds.tolist() == [0.25, 0.5, 1.0]
    assert counts / n == pytest.approx([0.25, 0.5, 0.25], abs=3.0 * math.sqrt(0.25 / n))


def test_the_numbers_of_laws_are_independent():
    streams = [Stream(7, particle, number) for particle in range(40) for number in range(40)]
    rows = np.array([[one.of_law(law).uniform(k) for law in range(3) for k in range(3)] for one in streams])
    for column in rows.T:
        assert kolmogorov(column) < KOLMOGOROV
    assert abs(np.corrcoef(rows.T) - np.eye(9)).max() < 4.5 / math.sqrt(len(streams))


def test_each_law_has_its_book():
    """What a law dissipates is no heat, and what another gives is nothing that is lost."""
    laws = [swarm.CercignaniLampis(1.0, 0.5, 0.5), Half()]
    seen = {}
    for k, some in enumerate(([laws[0]], [laws[1]], laws)):
        scene = swarm.Scene([swarm.Sphere(0.5, laws=some)])
        start = swarm.fill(scene, 15, speed=1.0, seed=1)
        seen[k] = swarm.simulate(scene, start, swarm.Impact(), until=5.0, every=1.0, compile="never").observables
        assert drift(seen[k]) < 1e-14
    assert not seen[0]["dissipated_energy"].any()
    assert not seen[1]["wall_heat"].any()
    assert seen[1]["dissipated_energy"][-1] > 0.5 * seen[1]["kinetic_energy"][0]
    assert (np.diff(seen[2]["dissipated_energy"]) > 0.0).all()
    assert seen[2]["wall_heat"][-1].sum() > 0.0


LAWS = [swarm.Absorb(0.02), swarm.Lambert(0.7), swarm.CercignaniLampis(0.5, 0.6, 0.4)]
HOLE = swarm.Sphere(0.2, (0.0, 0.0, 0.5))
TETRAHEDRON = [(0.6, 0.6, 0.6), (0.6, -0.6, -0.6), (-0.6, 0.6, -0.6), (-0.6, -0.6, 0.6)]
EVERYWHERE = {
    "sphere": lambda laws: swarm.Scene([swarm.Sphere(0.5, laws=laws)]),
    "falling": lambda laws: swarm.Scene([swarm.Cylinder(0.4, (0, 1, 1), 1.0, laws=laws)], G),
    "moving": lambda laws: swarm.Scene(
        [swarm.Box((0.5, 0.4, 0.6), laws=laws, motion=swarm.Oscillation((0, 0, 0.05), 2.0))], G
    ),
    "two laws": lambda laws: swarm.Scene(
        [swarm.Sphere(0.5, laws=laws), swarm.Plane((0, 0, 1), 0.3, laws=[swarm.CercignaniLampis(2.0, 1.0, 1.0)]),
         swarm.Plane((0, 0, -1), 0.3, laws=[swarm.CercignaniLampis(1.0, 0.5, 0.2)])]
    ),
    "union": lambda laws: swarm.Scene(
        [swarm.Union([swarm.Sphere(0.4, (-0.2, 0, 0)), swarm.Sphere(0.4, (0.3, 0, 0))], laws=laws)]
    ),
    "field": lambda laws: swarm.Scene([swarm.Sphere(1.0), swarm.Spheres(np.eye(3) * 0.5, 0.2, laws=laws)]),
    "opening": lambda laws: swarm.Scene([swarm.Sphere(0.5, laws=laws, openings=[HOLE])]),
    "period": lambda laws: swarm.Scene([swarm.Sphere(0.3, (0.1, 0, 0), "outside", laws=laws)], None, (1.0, 1.0, 1.0)),
    "plane": lambda laws: swarm.Scene([swarm.Sphere(0.5, laws=laws)], plane="z"),
    "slides": lambda laws: swarm.Scene(
        [swarm.Box((0.5, 0.4, 0.6), restitution=0.5, friction=0.1), swarm.Plane((1, 0, 0), 0.4, laws=laws)], G
    ),
}  # fmt: skip


# Those that are compiled as well: straight and falling, with contacts that last, several walls with laws, a field.
COMPILED = {"sphere", "two laws", "union", "field", "slides"}


@pytest.mark.parametrize("name", EVERYWHERE)
def test_the_books_balance_and_bits_are_the_same(name):
    """In plain Python; some also compiled, by two threads, and in other blocks."""
    scene = EVERYWHERE[name](LAWS)
    start = swarm.fill(scene, 300, speed=1.0, seed=2)

    def run(n, **how):
        some = swarm.Particles(start.position[:, :n], start.velocity[:, :n])
        return swarm.simulate(scene, some, swarm.Impact(), until=3.0, every=0.5, **how)

    if name not in COMPILED:
        require_books(run(60, compile="never"), scene)
        return
    one, two = (run(300, compile="always", threads=threads, block_size=256) for threads in (1, 2))
    require_books(one, scene)
    require_same(one, two)
    few, plain = run(16, compile="always"), run(16, compile="never")
    require_same(few, plain)
    assert np.array_equal(few.absorbed_time, one.absorbed_time[:16], equal_nan=True)


def require_books(result, scene):
    """The energy is that of the particles and the books, and an absorbed particle is counted once."""
    seen = result.observables
    assert drift(seen) < (1e-12 if scene.moves() or scene.gravity else 1e-13)
    assert seen["absorbed"][-1].sum() == np.count_nonzero(~np.isnan(result.absorbed_time)) > 0
    assert seen["max_penetration"].max() < 1e-12


@pytest.mark.parametrize("law", [[swarm.Absorb(0.001), swarm.Lambert()], [swarm.Sticky(5.0)], LAWS[2:]], ids=str)
def test_a_resumed_run_is_a_whole_one(law, tmp_path):
    scene = swarm.Scene([swarm.Sphere(0.5, laws=law)])
    assert require_resumed_is_whole(tmp_path, scene, swarm.Impact(), every=10.0) > 0


def test_a_cluster_gives_the_same_bits(tmp_path):
    pytest.importorskip("distributed")
    scene = swarm.Scene([swarm.Sphere(0.5, laws=[*LAWS, swarm.Sticky(0.1)])])
    start = swarm.fill(scene, 700, speed=1.0, seed=2)
    runs = [
        swarm.simulate(scene, start, swarm.Impact(), until=3.0, every=0.5, trajectory=tmp_path / f"{k}.h5", **how)
        for k, how in enumerate(({}, {"cluster": "local:2", "shards": 3}))
    ]
    require_same(*runs)
    with swarm.load(tmp_path / "1.h5") as written:
        assert np.array_equal(written.absorbed_times(-1), runs[0].absorbed_time, equal_nan=True)


@pytest.mark.long
def test_the_books_of_1e8_impacts():
    laws = [swarm.Absorb(1e-5), *LAWS[1:], Half(), swarm.CercignaniLampis(1.0, 1.0, 1.0)]
    scene = swarm.Scene([swarm.Sphere(0.5, laws=laws)])
    start = swarm.fill(scene, 4000, speed=1.0, seed=1)
    seen = swarm.simulate(scene, start, swarm.Impact(), until=1.4e4, every=1e3).observables
    assert seen["impacts"][-1] > 1e8
    # Of all energy that went through the books.
    assert unbooked(seen) < 1e-13 * seen["dissipated_energy"][-1]


# --- Bad input -------------------------------------------------------------------------------------------


class Booked(Half):
    book = "lost"


@pytest.mark.parametrize(
    ("laws", "sentence"),
    [
        ([swarm.Lambert(1.5)], r"laws\[0\].probability must be from 0 to 1, got 1.5"),
        ([swarm.Lambert(), swarm.Absorb(-0.1)], r"laws\[1\].probability must be from 0 to 1, got -0.1"),
        ([swarm.Absorb()], r"laws\[0\] must have a probability, or a barrier \[J\], got neither"),
        ([swarm.Absorb(0.1, 1.0)], r"laws\[0\] must have a probability, or a barrier \[J\], got both"),
        ([swarm.Absorb(0.1, loss=0.1)], r"laws\[0\].loss must go with a barrier"),
        ([swarm.Absorb(barrier=1.0, loss=2.0)], r"laws\[0\].loss must be from 0 to 1, got 2"),
        ([swarm.Absorb(barrier=-1.0)], r"laws\[0\].barrier must be 0 J or more, got -1"),
        ([swarm.CercignaniLampis(-1.0, 0.5, 0.5)], r"laws\[0\].temperature must be 0 J or more, got -1"),
        ([swarm.CercignaniLampis(1.0, 1.5, 0.5)], r"laws\[0\].normal must be from 0 to 1, got 1.5"),
        ([swarm.CercignaniLampis(1.0, 0.5, 2.1)], r"laws\[0\].tangential must be from 0 to 2, got 2.1"),
        ([swarm.CercignaniLampis(1.0, 0.5, -0.1)], r"laws\[0\].tangential must be from 0 to 2, got -0.1"),
        ([swarm.CercignaniLampis(1.0, 0.5, math.nan)], r"laws\[0\].tangential must be a finite number, got nan"),
        ([swarm.Sticky(-1.0)], r"laws\[0\].time must be 0 s or more, got -1"),
        ([Booked()], r'laws\[0\] must have book = "heat" or "dissipated" in its class, Booked has'),
    ],
)
def test_bad_numbers_are_refused_in_one_sentence(laws, sentence):
    with pytest.raises(swarm.SceneError, match=sentence):
        swarm.Sphere(1.0, laws=laws)


def test_laws_that_nobody_meets_are_refused():
    with pytest.raises(swarm.SceneError, match="laws must be left out where all particles leave with the temperature"):
        swarm.Sphere(1.0, temperature=1.0, laws=[swarm.Absorb(0.1)])


def test_nobody_waits_where_walls_move():
    wall = swarm.Sphere(0.5, laws=[swarm.Sticky(1.0)], motion=swarm.Oscillation((0, 0, 0.1), 1.0))
    start = swarm.Particles((0, 0, 0), (1, 0, 0))
    with pytest.raises(swarm.SceneError, match=r"surfaces\[0\].laws\[0\] must not let particles wait where a"):
        swarm.simulate(swarm.Scene([wall]), start, swarm.Impact(), until=1.0)


class Waiting(swarm.WallLaw):
    """A particle that comes faster than in any trial waits, or waits for no valid time."""

    time: float

    def leave(self, v, n, u, random, mass):
        return swarm.Leave(v - 2.0 * dot(v - u, n) * n, True, self.time * (dot(v, v) > 1e4))


@pytest.mark.parametrize("tier", ["never", "always"])
@pytest.mark.parametrize(
    ("time", "motion", "sentence"),
    [
        (-1.0, None, r"particle 0: .*surfaces\[0\].laws\[0\] must return a Leave with stays .* wait of 0 or more"),
        (1.0, swarm.Translation((0.0, 0.0, 0.1)), r"surfaces\[0\].laws\[0\] must not let particles wait where a"),
    ],
)
def test_what_a_law_returns_is_looked_at_in_runs(tier, time, motion, sentence):
    scene = swarm.Scene([swarm.Sphere(0.5, laws=[Waiting(time)], motion=motion)])
    start = swarm.Particles((0, 0, 0), (200.0, 0, 0))
    with pytest.raises(swarm.RunError, match=sentence):
        swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile=tier)
