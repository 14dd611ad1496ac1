"""Values that are known without this package: closed forms, quadratures and plain loops, each with its derivation."""

import math

import numpy as np
import pytest
from conftest import rarely
from physics.billiards import run
from scipy import integrate, optimize

import swarm
from examples import effusion

pytestmark = pytest.mark.physics


def within(values, known, error=0.0):
    """The mean of independent values is a known one, within three standard errors, its own among them."""
    off = np.mean(values) - known
    assert abs(off) < 3.0 * math.hypot(np.std(values, ddof=1) / math.sqrt(len(values)), error)


# --- Gases of points -------------------------------------------------------------------------------------


def test_two_mean_paths_in_a_sphere():
    """Of starts all over a ball of radius 1 chords l have the density 3 l^2/8: their mean is 3/2.

    All path over all impacts is 1 over the mean of 1/l, 4/3, which is Cauchy's 4 V/A too. A particle keeps its chord,
    2 (1 - |r x v|^2)^(1/2) at the speed 1, and its first impact comes a part of one after the start.
    """
    sphere = swarm.Scene([swarm.Sphere(1.0)])
    start, until = swarm.fill(sphere, 400, speed=1.0, seed=1), 20.0
    chords = 2.0 * np.sqrt(1.0 - (np.cross(start.position.T, start.velocity.T) ** 2).sum(axis=1))
    first = 0.5 * chords - (start.position * start.velocity).sum(axis=0)
    result = run(sphere, start, swarm.Impact(), until)
    counts = result.impacts_per_particle
    assert counts.tolist() == (1 + np.floor((until - first) / chords)).astype(int).tolist()
    within(chords, 1.5)
    # That of 1/l is (3/16)^(1/2): of its mean 3/4 a standard error of that over 20.
    assert abs(until * len(start) / counts.sum() - 4.0 / 3.0) < 3.0 * (16.0 / 9.0) * math.sqrt(3.0 / 16.0 / 400)
    within(until / counts, 1.5)


def test_a_wall_that_goes_at_a_tenth_of_the_speed():
    """The box of 1 m is 2 m long after 10 s: E/E0 is 0.26, and not 1/4 as by the adiabatic law.

    Those that go towards the wall at first meet it three times, the others twice, wherever they are: each time they
    lose twice its speed, so that 0.4 and 0.6 m/s are left, and (0.16 + 0.36)/2 of the energy.
    """
    going = swarm.Plane((1.0, 0.0, 0.0), 1.0, motion=swarm.Translation((0.1, 0.0, 0.0)))
    scene = swarm.Scene([swarm.Box((1.5, 1.0, 1.0), center=(1.5, 0.0, 0.0)), going])
    position, velocity = np.zeros((3, 40)), np.zeros((3, 40))
    position[0], velocity[0] = np.tile(np.linspace(0.02, 0.97, 20), 2), np.repeat([1.0, -1.0], 20)
    result = run(scene, swarm.Particles(position, velocity), swarm.Impact(), 10.0, compile="never")
    assert result.particles.velocity[0] == pytest.approx(np.repeat([-0.4, 0.6], 20), abs=1e-14)
    energy = result.observables["kinetic_energy"]
    assert energy[-1] / energy[0] == pytest.approx(0.26, rel=1e-14)
    assert result.observables["wall_work"][-1].sum() == pytest.approx(energy[-1] - energy[0], rel=1e-13)


def test_the_energy_of_the_half_that_has_not_effused():
    """A particle stays with exp(-c v t): where half of all are left their mean energy is 0.78359 of the first."""

    def of_what_is_left(power, passed):
        def density(v):
            return v**power * math.sqrt(2.0 / math.pi) * math.exp(-0.5 * v * v - passed * v)

        return integrate.quad(density, 0.0, 20.0)[0]

    half = optimize.brentq(lambda passed: of_what_is_left(2, passed) - 0.5, 0.0, 2.0)
    known = of_what_is_left(4, half) / 0.5 / 3.0
    assert known == pytest.approx(0.78359, abs=5e-6)
    scene, count = effusion.vessel(hot=False), 4000
    start = swarm.fill(scene, count, temperature=1.0, seed=2)
    result = swarm.simulate(scene, start, swarm.Impact(), until=1.5 * half / effusion.REACHES)
    energy = 0.5 * (start.velocity**2).sum(axis=0)
    gone = np.argsort(np.where(np.isfinite(result.escape_time), result.escape_time, np.inf))
    assert np.isfinite(result.escape_time[gone[count // 2]])
    within(energy[gone[count // 2 :]] / 1.5, known)


# --- Tubes of which each wall scatters by the cosine law -------------------------------------------------


def through(scene, count, seed=1):
    """Whether each particle that comes in by the first surface, a plane with an opening, leaves by the second one."""
    stop = 10.0
    source = swarm.Source(scene.surfaces[0].openings[0], rate=count / stop, speed=1.0, stop=stop)
    result = swarm.simulate(scene, None, swarm.Impact(), until=8.0 * stop, sources=[source], seed=seed)
    gone = np.isfinite(result.escape_time)
    assert gone.all()
    entry = scene.surfaces[0]
    inside = entry.offset - np.array(entry.normal) @ result.particles.position
    return inside > 1e-6


def end(normal, offset):
    """A plane with an opening that is all of the end of a tube."""
    return swarm.Plane(normal, offset, openings=[swarm.Sphere(1.6, center=tuple(offset * np.array(normal)))])


def test_a_short_square_tube():
    """1 x 1 x 1: 0.53627, by the integral equation of its walls (a gas without collisions, as in Clausing's)."""
    tube = swarm.Box((0.5, 0.5, 2.0), open=("+z", "-z"), laws=[swarm.Lambert()])
    within(through(swarm.Scene([end((0.0, 0.0, -1.0), 0.5), end((0.0, 0.0, 1.0), 0.5), tube]), 20_000), 0.53627)


@pytest.mark.parametrize(
    ("arm", "known", "error"), [rarely(1.0, 0.54159, 4e-4), pytest.param(2.0, 0.35154, 3e-4)], ids=["1", "2"]
)
def test_an_elbow_of_two_tubes(arm, known, error):
    """Two tubes of radius 1 that are mitred at a right angle, each axis as long from the corner as is given.

    The values are those of plain loops over 10^6 particles and more: of rays in |r x axis| <= 1, which end at a mitre.
    """
    laws, mitre = [swarm.Lambert()], (math.sqrt(0.5), 0.0, math.sqrt(0.5))
    up = swarm.Intersection([swarm.Cylinder(1.0, laws=laws), swarm.Plane(mitre)])
    aside = swarm.Cylinder(1.0, axis=(1.0, 0.0, 0.0), laws=laws)
    aside = swarm.Intersection([aside, swarm.Plane(tuple(-np.array(mitre)))])
    scene = swarm.Scene([end((0.0, 0.0, -1.0), arm), end((1.0, 0.0, 0.0), arm), swarm.Union([up, aside])])
    within(through(scene, 20_000 if arm == 2.0 else 100_000), known, error)


# --- Balls on a line -------------------------------------------------------------------------------------

RADIUS = 0.1


def column(places, velocities, mass=1.0, axis=0):
    """Balls on a line whose centres are so far from where they are when all of them touch a wall at 0."""
    n = len(places)
    position, velocity = np.zeros((3, n)), np.zeros((3, n))
    position[axis] = np.array(places) + RADIUS * (2.0 * np.arange(n) + 1.0)
    velocity[axis] = velocities
    return swarm.Particles(position, velocity, mass, radius=RADIUS)


def by_hand(places, velocities, mass, restitution, wall, most):
    """(events, velocities) of points on a line, one after another, until nothing meets or so many have been."""
    x, v, m = (np.array(one, dtype=float) for one in (places, velocities, mass))
    for events in range(most):
        closing = np.append(v[:-1] - v[1:], -v[0] if wall else -1.0)
        gaps = np.append(np.diff(x), x[0])
        times = np.where(closing > 0.0, gaps / np.where(closing > 0.0, closing, 1.0), np.inf)
        i = int(times.argmin())
        if not np.isfinite(times[i]):
            return events, v
        x += v * times[i]
        if i == len(v) - 1:
            x[0], v[0] = 0.0, -restitution * v[0]
        else:
            x[i + 1] = x[i]
            impulse = (1.0 + restitution) * closing[i] / (1.0 / m[i] + 1.0 / m[i + 1])
            v[i], v[i + 1] = v[i] - impulse / m[i], v[i + 1] + impulse / m[i + 1]
    return most, v


COLLAPSES = {
    # By turns two matrices act on the velocities. Their product has the determinant e^2 and the trace (1 - e)^2/2, of
    # three balls ((1 + e)/2)^2 - 2 e: below this e its eigenvalues are real, and the impacts never end.
    "two balls and a wall": (3.0 - 2.0 * math.sqrt(2.0), True, [0.5, 1.0], [0.0, -1.0]),
    "three balls": (7.0 - 4.0 * math.sqrt(3.0), False, [0.3, 0.5, 1.0], [1.0, 0.0, -1.0]),
}


def rate_of_a_collapse(restitution, wall):
    """tr^2 - 4 det of the two impacts that come by turns: where it is above 0 there is no end to them."""
    a, b = 0.5 * (1.0 - restitution), 0.5 * (1.0 + restitution)
    if wall:
        both = np.array([[-restitution, 0.0], [0.0, 1.0]]) @ np.array([[a, b], [b, a]])
    else:
        # Of the differences of the velocities of neighbours.
        both = np.array([[1.0, b], [0.0, -restitution]]) @ np.array([[-restitution, 0.0], [b, 1.0]])
    return np.trace(both) ** 2 - 4.0 * np.linalg.det(both)


@pytest.mark.parametrize("name", COLLAPSES)
def test_where_infinitely_many_impacts_come_in_a_finite_time(name):
    """Above a restitution they end, after as many as by hand; below it the run ends, by `contact_duration`."""
    limit, wall, places, velocities = COLLAPSES[name]
    assert optimize.brentq(rate_of_a_collapse, 0.01, 0.5, args=(wall,), xtol=1e-15) == pytest.approx(limit, abs=1e-12)
    counts = []
    for part in (1.2, 1.02, 0.99, 0.6):
        e = part * limit
        known, left = by_hand(places, velocities, np.ones(len(places)), e, wall, 400)
        floor = swarm.Plane((-1.0, 0.0, 0.0), 0.0 if wall else 50.0, restitution=e)
        scene = swarm.Scene([floor], pairs=swarm.Pairs(restitution=e, contact_duration=1e-14))
        result = run(scene, column(places, velocities), swarm.Impact(), 40.0, compile="never")
        seen = result.observables
        counts.append(int(seen["impacts"][-1] + seen["collisions"][-1]))
        lost = seen["kinetic_energy"][0] - seen["kinetic_energy"][-1]
        assert seen["dissipated_energy"][-1] == pytest.approx(lost, rel=1e-13)
        if part > 1.0:
            assert known == counts[-1]
            assert result.particles.velocity[0] == pytest.approx(left, abs=1e-13)
        else:
            assert known == 400
            assert result.particles.velocity[0] == pytest.approx(0.0, abs=1e-4)
    assert counts[1] > 2 * counts[0] > 10
    assert max(counts[2:]) < 100


def masses_and_a_wall(engine, heavy):
    """(scene, particles): a mass that comes, one of 1 kg at rest before it, and a wall."""
    wall = swarm.Slab((1.0, 0.0, 0.0), 100.0, center=(100.0, 0.0, 0.0))
    if engine == "balls":
        return swarm.Scene([wall]), column([0.5, 1.0], [0.0, -1.0], [1.0, heavy])
    if engine == "a wall with a mass":
        guide = swarm.Guide((1.0, 0.0, 0.0), speed=-1.0)
        moved = swarm.Slab((1.0, 0.0, 0.0), 0.5, (1.5, 0.0, 0.0), "outside", mass=heavy, motion=guide)
        return swarm.Scene([wall, moved]), swarm.Particles([0.5, 0.0, 0.0], [0.0, 0.0, 0.0])
    angle = math.atan(1.0 / math.sqrt(heavy))
    side = swarm.Plane((-math.sin(angle), math.cos(angle), 0.0), 0.0)
    start = swarm.Particles([1.0, 0.5 * math.tan(angle), 0.0], [-1.0, 0.0, 0.0])
    return swarm.Scene([swarm.Plane((0.0, -1.0, 0.0), 0.0), side]), start


GALPERIN = [(engine, 3.0, 5) for engine in ("a wedge", "balls", "a wall with a mass")]
GALPERIN += [("balls", 1.0, 3), ("balls", 100.0, 31), ("balls", 1e4, 314), ("a wedge", 1e10, 314_159)]
LONG_COUNTS = [(1e12, 3_141_592), (1e14, 31_415_926)]


@pytest.mark.parametrize(("engine", "heavy", "known"), [*GALPERIN, *(rarely("a wedge", *one) for one in LONG_COUNTS)])
def test_galperins_counts(engine, heavy, known):
    """M/m = 3, 1 and 100^k: 5, 3 and the digits of pi, in the wedge of the angle atan (m/M)^(1/2) that it is.

    A straight line through the mirror images of the wedge meets pi over the angle of them.
    """
    assert known == math.ceil(math.pi / math.atan(1.0 / math.sqrt(heavy)) * (1.0 - 1e-12)) - 1
    scene, start = masses_and_a_wall(engine, heavy)
    result = run(scene, start, swarm.Impact(), 20.0, compile="always" if known > 10_000 else "never")
    seen = result.observables
    assert seen["impacts"][-1] + (seen["collisions"][-1] if engine == "balls" else 0) == known
    assert seen["energy_error"].max() <= 1e-13


@pytest.mark.long
def test_galperins_count_that_is_beyond_double_precision():
    """100^8: where the masses turn back 6e-17 m are between the walls, too few to resolve; a sentence says so."""
    scene, start = masses_and_a_wall("a wedge", 1e16)
    with pytest.raises(swarm.RunError, match="a gap that is too thin to resolve"):
        run(scene, start, swarm.Impact(), 20.0, compile="always")


def exponents(lower, count, seed):
    """The mean growth of ln(distance) a second, between 4 and 14 s, of each of so many columns of two balls.

    Upper ball 1 kg, lower one as given, E = g = 1, the floor at 0: starts are drawn by the volume of this energy in
    phase space, places where m q1 + q2 < 1 and q1 < q2 and momenta on the ellipse of what is left. Each column has a
    second one, 1e-9 away, in the same run.
    """
    random = np.random.default_rng(seed)
    heights = np.zeros((2, 0))
    while heights.shape[1] < count:
        tried = random.uniform(size=(2, 4 * count)) / [[1.0 + lower], [1.0]]
        heights = np.hstack([heights, tried[:, (tried[0] < tried[1]) & (lower * tried[0] + tried[1] < 1.0)]])
    heights = heights[:, :count]
    kinetic, angle = 1.0 - lower * heights[0] - heights[1], random.uniform(0.0, 2.0 * math.pi, count)
    velocity = np.sqrt(2.0 * kinetic) * [np.cos(angle) / math.sqrt(lower), np.sin(angle)]
    offset = random.normal(size=(2, count))
    offset *= 1e-9 / np.linalg.norm(offset, axis=0)
    r, v = np.zeros((3, 4 * count)), np.zeros((3, 4 * count))
    # Lower balls, then upper ones; of each the columns, then those beside them.
    r[0] = np.tile(np.arange(2 * count), 2)
    r[2] = np.concatenate([heights, heights + offset], axis=1).ravel() + np.repeat([RADIUS, 3.0 * RADIUS], 2 * count)
    v[2] = np.concatenate([velocity, velocity], axis=1).ravel()
    mass = np.repeat([lower, 1.0], 2 * count)
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0)], gravity=(0.0, 0.0, -1.0))
    found = []
    swarm.simulate(
        scene, swarm.Particles(r, v, mass, radius=RADIUS), swarm.Impact(), until=14.0, every=2.0, threads=1,
        compile="always",
        progress=lambda frame: found.append(np.stack([frame.position[2], frame.velocity[2]])),
    )  # fmt: skip
    apart = np.array([np.diff(one.reshape(4, 2, count), axis=1) for one in np.array(found).reshape(-1, 4, 2 * count)])
    logs = 0.5 * np.log((apart**2).sum(axis=(1, 2)))
    return (logs[7] - logs[2]) / 10.0


def test_two_balls_above_a_floor_are_chaotic_where_the_lower_one_is_heavier():
    """The largest Lyapunov exponent is 0.850 with masses of 3 and 1, and 0 for nearly all with 1/3 and 1.

    0.8504 is that of the tangent map of floor, impact and flight, over 6 10^6 events of 2000 starts in a plain loop.
    Where the lower ball is lighter the motion is regular but for thin layers: neighbours part as the time, by some
    ln(14/4)/10.
    """
    within(exponents(3.0, 200, 1), 0.850, 0.002)
    assert np.mean(exponents(1.0 / 3.0, 200, 1)) < 0.25


# --- Two balls -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("has_walls", "known"), [(True, 9.0 / 4.0), (False, 9.0 / 5.0)], ids=["walls", "a cell"])
def test_the_fourth_moment_of_one_of_two_balls(has_walls, known):
    """The velocities of both are all over a sphere of n dimensions, 6 or without momentum 3: 3 n/(n + 2)."""
    walls = [swarm.Box((0.5, 0.5, 0.5))] if has_walls else []
    scene = swarm.Scene(walls, period=None if has_walls else (1.0, 1.0, 1.0))
    start, seen = swarm.fill(scene, 2, speed=1.0, radius=0.2, seed=1), []
    start.velocity -= 0.0 if has_walls else start.velocity.mean(axis=1, keepdims=True)
    swarm.simulate(
        scene, start, swarm.Impact(), until=3000.0, every=10.0, threads=1, compile="always",
        progress=lambda frame: seen.append(frame.velocity.copy()),
    )  # fmt: skip
    v = np.array(seen[1:])
    blocks = np.array_split(v, 20)
    means = np.array([[(b**4).mean(), (b**2).mean()] for b in blocks])
    # The mean of v_x^2 is a third of a half of the energy, exactly in a cell: errors by the spread of the blocks.
    ratio = means[:, 0].mean() / means[:, 1].mean() ** 2
    linear = means[:, 0] / means[:, 0].mean() - 2.0 * means[:, 1] / means[:, 1].mean()
    error = ratio * np.std(linear, ddof=1) / math.sqrt(20)
    assert abs(ratio - known) < 3.0 * error < 0.25
