"""Uzawa's loop (8): where it converges, how fast, and that its limit is the reflection."""

import math

import numpy as np
import pytest
from conftest import call, chord_of, directions, every_surface, gap, numbers_of, wall_point
from hypothesis import given, settings
from hypothesis import strategies as st

import swarm
from swarm.contact import uzawa
from swarm.contact.impulse import Step
from swarm.contact.regularisation import regularisation
from swarm.kernel.vector import vec
from swarm.surfaces.walls import Walls, all_walls

few = settings(max_examples=3)
ACCELERATIONS = {"none": uzawa.PLAIN, "secant": uzawa.SECANT, "reflection": uzawa.REFLECTION}
every_acceleration = pytest.mark.parametrize("acceleration", ACCELERATIONS)
ALPHA, C = 1e4, 2e-4  # c alpha/2 = 1: each sweep halves the gap of a flat wall with |grad g| = 1


ORIGIN = [0.0, 0.0, 0.0]


def step_of(start, free, c):
    """A step as kernels take it."""
    return Step(vec(map(np.float64, start)), vec(map(np.float64, free)), np.float64(c))


class Loop:
    """One step of a particle and its loop: r1, what held it back, how many sweeps it took."""

    def __init__(self, surfaces, start, free, acceleration="none", tolerance=1e-28, max_sweeps=300, c=C, exponent=1.0):
        self.law, self.c = regularisation(ALPHA, exponent), c
        self.walls = all_walls(surfaces)
        self.method = swarm.AugmentedLagrangian(
            1.0, ALPHA, exponent, tolerance=tolerance, max_sweeps=max_sweeps, acceleration=acceleration
        ).numbers(swarm.Scene([swarm.Sphere(1.0)]))
        self.step = step_of(start, free, c)
        self.start, self.free = np.array(start), np.array(free)

    def run(self):
        reactions = np.zeros((self.walls.length(), 4))
        with np.errstate(all="ignore"):
            loop = uzawa.loop(self.method, self.law, self.walls, self.step, reactions)
        self.end, self.sweeps, self.stored, self.converged = np.array(loop.r), loop.sweeps, loop.stored, loop.converged
        assert loop.solved
        self.held = reactions[:, :3].sum(axis=0)
        return self

    def constraints(self):
        """Phi1 of each sweep of one wall."""
        multipliers, before, reactions = np.zeros(1), uzawa.LastSweep(np.zeros(1), np.zeros(1)), np.zeros((1, 4))
        found = []
        with np.errstate(all="ignore"):
            for sweep in range(self.method.max_sweeps):
                swept = uzawa.sweep_all(
                    self.method, self.law, self.walls, self.step, multipliers, before, sweep, reactions
                )
                found.append(float(reactions[0, 3]))
                if swept.stored <= self.method.tolerance:
                    break
        return np.array(found)

    def energy_error(self):
        """|v1|^2/|v0|^2 - 1 with v = p/h and v1 = v0 - 2/h held."""
        last = self.free - 2.0 * self.held
        return abs(last @ last / (self.free @ self.free) - 1.0)


class Described:
    """A surface known by its numbers."""

    def __init__(self, numbers):
        self._numbers = numbers

    def walls(self):
        return (self._numbers,)


def state_one(name, point, direction, lean, length):
    """A wall point of the surface, and a free displacement out of its admissible side."""
    surface = numbers_of(name)
    start = wall_point(surface, np.asarray(point))
    normal = np.array(call(surface.unit_normal, start))
    along = direction - (direction @ normal) * normal
    along /= max(np.linalg.norm(along), 1e-3)
    return surface, start, length * (lean * normal + math.sqrt(1.0 - lean * lean) * along)


def stiff(surface, start, times=1.0):
    """c for which a sweep takes 1/(1 + times) off the gap of the wall, were it flat."""
    slope = np.linalg.norm(call(surface.gradient, start))
    return times * C / slope**2


contacts = {
    "point": directions,
    "direction": directions,
    "lean": st.floats(0.3, 1.0),
    "length": st.sampled_from([1e-4, 1e-2, 0.05]),
}


# --- State I, one wall -----------------------------------------------------------------------------------


@every_surface
@every_acceleration
@few
@given(**contacts)
def test_the_limit_is_the_reflection(name, acceleration, **contact):
    """State I, a = 1: r1 is the end of the chord on the wall, on every surface and by every way there."""
    surface, start, free = state_one(name, **contact)
    if gap(surface, start + free) <= 1e-3 * contact["length"]:
        return
    kappa = chord_of(surface, start, free)
    chord = np.array(call(surface.push, start, free, kappa))
    loop = Loop([Described(surface)], start, free, acceleration, c=stiff(surface, start, 10.0)).run()
    assert loop.converged
    assert loop.stored <= 1e-28
    # Over the seam of a rod, where its curvature jumps, the secants end 3e-12 along the wall from the chord's end.
    assert loop.end == pytest.approx(chord, rel=0.0, abs=5e-12)
    assert abs(gap(surface, loop.end)) <= 1e-14
    assert loop.energy_error() <= 1e-12 + 1e-14 / contact["length"]


@every_surface
@few
@given(**contacts)
def test_convergence_is_linear(name, **contact):
    """(8) is a relaxation with fixed weight: the gap falls by the same factor in every sweep."""
    surface, start, free = state_one(name, **contact)
    if gap(surface, start + free) <= 0.2 * contact["length"]:
        return
    phi = Loop([Described(surface)], start, free, tolerance=1e-18, c=stiff(surface, start)).constraints()
    good = phi[phi > 1e-6 * phi[0]]
    rates = good[1:] / good[:-1]
    assert len(rates) >= 5
    assert (rates < 1.0).all()
    assert np.ptp(rates[-3:]) <= 0.02 * rates[-1]


@pytest.mark.parametrize("times", [0.1, 1.0, 10.0])
def test_the_rate_of_a_plane_by_hand(times):
    """g1 = (p - c lambda)/(1 + C), C = c alpha/2, so a sweep takes the gap to g1/(1 + C) and lambda ends at p/c."""
    loop = Loop([swarm.Plane((1.0, 0.0, 0.0))], [0.0, 0.2, 0.0], [0.1, 0.3, 0.0], c=times * C, max_sweeps=400)
    phi = loop.constraints()
    expected = 0.1 * (1.0 + times) ** -(1.0 + np.arange(len(phi)))
    assert phi[:-1] == pytest.approx(expected[:-1], rel=1e-9, abs=1e-14)
    loop.run()
    assert loop.end == pytest.approx([0.0, 0.5, 0.0], abs=1e-14)
    assert loop.held == pytest.approx([0.1, 0.0, 0.0], abs=1e-14)


@every_surface
def test_accelerations_take_fewer_sweeps(name):
    """The same end, but a secant needs few sweeps, and from the reflection's multiplier hardly one."""
    contact = state_one(name, [0.4, -0.7, 0.5], np.array([0.3, 0.5, -0.6]), 0.8, 0.03)
    surface, start, free = contact
    ends, sweeps = [], []
    for acceleration in ACCELERATIONS:
        loop = Loop([Described(surface)], start, free, acceleration, c=stiff(surface, start)).run()
        ends.append(loop.end)
        sweeps.append(loop.sweeps)
    assert sweeps[0] > 40
    assert 10 >= sweeps[1] > sweeps[2]
    assert sweeps[2] <= 3
    assert ends[1] == pytest.approx(ends[0], rel=0.0, abs=1e-13)
    assert ends[2] == pytest.approx(ends[0], rel=0.0, abs=1e-13)


@pytest.mark.parametrize("tolerance", [1e-6, 1e-10, 1e-16, 1e-22])
@every_acceleration
def test_the_loop_stops_at_its_tolerance(tolerance, acceleration):
    """At the first sweep with V <= tolerance; the energy misses lambda Phi1 and the spring's, times c 2/p^2."""
    loop = Loop([swarm.Sphere(0.5)], [0.4, 0.3, 0.0], [0.03, 0.04, 0.0], acceleration, tolerance).run()
    assert loop.converged
    assert loop.stored <= tolerance
    if acceleration == "none":
        phi = loop.constraints()
        assert 0.5 * ALPHA * phi[-2] ** 2 > tolerance >= 0.5 * ALPHA * phi[-1] ** 2
        assert len(phi) == loop.sweeps
    # lambda is p/c at most
    phi_end = math.sqrt(2.0 * tolerance / ALPHA)
    assert loop.energy_error() <= 4.0 * (phi_end / 0.05) + 1e-14


@every_acceleration
def test_no_contact_takes_one_sweep(acceleration):
    """A free step holds nothing back."""
    for start, free in (([0.1, 0.0, 0.0], [0.1, 0.0, 0.0]), ([0.5, 0.0, 0.0], [-0.1, 0.0, 0.0])):
        loop = Loop([swarm.Sphere(0.5)], start, free, acceleration).run()
        assert (loop.sweeps, loop.stored, loop.converged) == (1, 0.0, True)
        assert loop.end.tolist() == (np.array(start) + free).tolist()


# --- Updates ---------------------------------------------------------------------------------------------


def _next(acceleration, *numbers):
    return call(uzawa.next_multiplier, ACCELERATIONS[acceleration], *numbers)


@given(st.floats(0.0, 1e6), st.floats(0.0, 1e6), st.floats(0.0, 1e6), st.floats(0.0, 1e6))
def test_plain_update_is_the_papers(multiplier, miss, before, miss_before):
    """(8), whatever the sweep before was."""
    assert _next("none", multiplier, miss, before, miss_before) == multiplier + miss


@pytest.mark.parametrize("acceleration", ["secant", "reflection"])
class TestSecant:
    @given(root=st.floats(1.0, 1e3), part=st.floats(0.01, 0.9), slope=st.floats(0.01, 0.9))
    def test_it_finds_the_root_of_a_line(self, acceleration, root, part, slope):
        """A miss that falls linearly with lambda: nearly all the way, and never beyond."""
        before, miss_before = 0.0, slope * root
        multiplier = part * slope * root
        following = _next(acceleration, multiplier, slope * (root - multiplier), before, miss_before)
        assert multiplier + slope * (root - multiplier) <= following * (1.0 + 1e-12) or slope > 1.0 - 2e-3
        assert 0.0 <= (root - following) / (root - multiplier) <= 2e-3

    @given(multiplier=st.floats(0.0, 1e6), before=st.floats(0.0, 1e6), miss_before=st.floats(1e-6, 1e6))
    def test_the_fixed_point_is_that_of_the_plain_update(self, acceleration, multiplier, before, miss_before):
        assert _next(acceleration, multiplier, 0.0, before, miss_before) == multiplier

    @pytest.mark.parametrize(
        ("before", "miss_before"),
        [(math.nan, math.nan), (1.0, 3.0), (1.0, 2.0), (2.0, 4.0), (3.0, 4.0), (1.9, 4.0)],
        ids=["first sweep", "same miss", "miss grows", "same lambda", "lambda falls", "shorter than (8)"],
    )
    def test_it_falls_back(self, acceleration, before, miss_before):
        """lambda = 2, miss = 3: to (8) where the last two sweeps tell nothing better."""
        assert _next(acceleration, 2.0, 3.0, before, miss_before) == 5.0


def test_the_reflection_multiplier_is_the_fixed_point():
    """Where the loop from 0 ends, the reflection starts: lambda of both agree."""
    for name in ("sphere", "ball", "ellipsoid", "egg", "plane"):
        surface, start, free = state_one(name, [0.4, -0.7, 0.5], np.array([0.3, 0.5, -0.6]), 0.8, 0.03)
        c = stiff(surface, start)
        walls, law = Walls((surface,)), regularisation(ALPHA, 1.0)
        kappa, multiplier = call(uzawa.reflection, walls, 0.0, law, step_of(start, free, c))
        assert kappa == pytest.approx(chord_of(surface, start, free), rel=1e-6)
        loop = Loop([Described(surface)], start, free, c=c).run()
        gradient = call(surface.discrete_gradient, start, loop.end)
        q = call(surface.inner, start)
        slope = call(surface.gap_slope, q, q)[0]
        assert multiplier * c * abs(slope) * np.linalg.norm(gradient) == pytest.approx(
            np.linalg.norm(loop.held), rel=1e-6
        )


# --- Several walls ---------------------------------------------------------------------------------------


def turned(vectors, seed):
    """The same vectors, all turned by the same random rotation."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    return [q @ np.asarray(v, float) for v in vectors]


def corner_of(*normals):
    """Planes through the origin."""
    return [swarm.Plane(tuple(n)) for n in normals]


@every_acceleration
@pytest.mark.parametrize("angle", [60.0, 120.0])
def test_an_edge_of_two_planes(acceleration, angle):
    """Driven into the edge it starts at, with both normals' parts positive: only the part along the edge is left."""
    angle = math.radians(angle)
    n1, n2, edge = turned([[1.0, 0.0, 0.0], [math.cos(angle), math.sin(angle), 0.0], [0.0, 0.0, 1.0]], 1)
    for a, b, t in ((0.7, 0.2, 1.0), (0.1, 1.0, 0.0)):
        loop = Loop(corner_of(n1, n2), ORIGIN, 0.03 * (a * n1 + b * n2 + t * edge), acceleration, c=30.0 * C).run()
        assert loop.converged
        assert loop.end == pytest.approx(0.03 * t * edge, rel=0.0, abs=1e-13)
        assert loop.energy_error() <= 1e-12
        assert max(n @ loop.end for n in (n1, n2)) <= 1e-14


@every_acceleration
def test_a_corner_of_three_planes(acceleration):
    """Driven into the corner it starts at, against all three: it turns round."""
    for normals in (np.eye(3), turned(np.eye(3), 2), [[1.0, 0.3, 0.0], [0.0, 1.0, -0.2], [-0.3, 0.1, 1.0]]):
        normals = [n / np.linalg.norm(n) for n in np.array(normals)]
        free = 0.03 * sum(part * n for part, n in zip((0.1, 0.5, 1.0), normals, strict=True))
        loop = Loop(corner_of(*normals), ORIGIN, free, acceleration, c=10.0 * C).run()
        assert loop.converged
        assert loop.end == pytest.approx(np.zeros(3), abs=1e-13)
        assert loop.held == pytest.approx(free, abs=1e-13)
        assert loop.energy_error() <= 1e-11
        assert max(n @ loop.end for n in normals) <= 1e-14


@every_acceleration
@given(normals=st.tuples(directions, directions), free=directions)
@settings(max_examples=5)
def test_an_edge_in_any_direction(acceleration, normals, free):
    """Whichever walls oppose the step: it ends inside or on both, with its energy."""
    normals = [n / np.linalg.norm(n) for n in normals]
    if abs(normals[0] @ normals[1]) > 0.6:
        return
    loop = Loop(corner_of(*normals), ORIGIN, 0.03 * free, acceleration, c=10.0 * C).run()
    assert loop.converged
    assert loop.energy_error() <= 1e-11
    assert max(n @ loop.end for n in normals) <= 1e-14


@every_acceleration
def test_the_edge_of_a_sphere_and_a_plane(acceleration):
    """A curved wall and a flat one, r0 on both; along the edge the chord of the sphere lifts off the plane."""
    both = [swarm.Sphere(0.5), swarm.Plane((0.0, 0.0, -1.0), 0.3)]
    loop = Loop(both, [0.4, 0.0, -0.3], [0.02, 0.01, -0.02], acceleration, c=10.0 * C).run()
    assert loop.converged
    assert loop.energy_error() <= 1e-11
    assert loop.end[2] >= -0.3 - 1e-14
    assert np.linalg.norm(loop.end) <= 0.5 + 1e-14


# --- Where it does not converge --------------------------------------------------------------------------


def contact_on(name, depth, acceleration, exponent=1.0, tolerance=1e-10):
    """A step of 0.0125 that starts `depth` inside and meets the wall, 50 sweeps at most."""
    surface, start, free = state_one(name, [0.4, -0.7, 0.5], np.array([0.3, 0.5, -0.6]), 0.8, 0.0125)
    start = start - depth * np.array(call(surface.unit_normal, start))
    # As stiff as a linear spring at the depth 0.01.
    c = stiff(surface, start, 3.0) * 0.01 ** (1.0 - exponent)
    return Loop([Described(surface)], start, free, acceleration, tolerance, 50, c, exponent).run()


@every_surface
def test_state_two_does_not_converge(name):
    """From inside lambda grows without bound, and the energy misses lambda Phi1."""
    loop = contact_on(name, 5e-3, "none")
    assert not loop.converged
    assert loop.sweeps == 50
    assert loop.stored > 1e-10
    assert loop.energy_error() > 1e-3


@every_surface
@pytest.mark.parametrize("exponent", [1.25, 4.0])
def test_exponents_above_one_do_not_converge(name, exponent):
    """Phi'(0) = 0: no multiplier is large enough on the surface."""
    loop = contact_on(name, 0.0, "none", exponent, 1e-16)
    assert not loop.converged
    assert loop.sweeps == 50


@every_surface
@pytest.mark.parametrize("acceleration", ["secant", "reflection"])
def test_what_converges_from_inside_keeps_its_energy(name, acceleration):
    """In State II none does."""
    for depth in (1e-3, 5e-3):
        loop = contact_on(name, depth, acceleration)
        assert not loop.converged or loop.energy_error() <= 1e-3


@every_surface
@every_acceleration
@pytest.mark.parametrize("exponent", [1.5])
def test_what_converges_on_the_surface_keeps_its_energy(name, acceleration, exponent):
    """At a gap of g1 the force misses the work F g1 of p F/c, at most."""
    loop = contact_on(name, 0.0, acceleration, exponent, 1e-16)
    depth = (1e-16 * (exponent + 1.0) / ALPHA) ** (1.0 / (exponent + 1.0))
    assert not loop.converged or loop.energy_error() <= 40.0 * depth / 0.0125
