"""First hits with sampled surfaces, against all roots of the polynomials along a flight, and what the runs keep."""

import itertools

import numpy as np
import pytest
from conftest import EPSILON, call
from samples import ball, bumpy

import swarm
from swarm.kernel.vector import ZERO, Vec

DOWN = (0.3, -0.2, -4.0)


def first_root(surface, r, v, pull, until):
    """The first time at which the level rises through 0 by all roots in every cell, and the deepest level before."""
    low, width = np.array(surface.origin), np.array(surface.spacing)
    times = [np.array([0.0, until])]
    for k in range(3):
        for plane in low[k] + width[k] * np.arange(surface.values.shape[k]):
            roots = np.roots([0.5 * pull[k], v[k], r[k] - plane])
            times.append(roots.real[np.isreal(roots)])
    cuts = np.unique(np.concatenate(times))
    cuts = cuts[(cuts >= 0.0) & (cuts <= until)]
    side = 1.0 if surface.side == "inside" else -1.0
    # In a cell the level is a polynomial of degree 9, of a fall 18.
    degree = 18 if np.any(pull) else 9
    nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    for a, b in itertools.pairwise(cuts):
        if b - a < 1e-13:
            continue
        t = 0.5 * (a + b) + 0.5 * (b - a) * nodes
        level = side * surface.phi(r[:, None] + v[:, None] * t + 0.5 * np.array(pull)[:, None] * t * t)
        fit = np.polynomial.Chebyshev.fit(t, level, degree, domain=[a, b])
        roots = fit.roots()
        real = np.sort(roots.real[np.abs(roots.imag) < 1e-9 * (b - a)])
        for root in real[(real >= a - 1e-12) & (real <= b)]:
            if fit.deriv()(root) > 0.0 and root > 1e-9:
                return root
    return np.inf


@pytest.mark.parametrize("pull", [(0.0, 0.0, 0.0), DOWN], ids=["straight", "falling"])
@pytest.mark.parametrize("side", ["inside", "outside"])
@pytest.mark.parametrize("make", [bumpy, ball])
def test_no_hit_is_missed(make, side, pull):
    surface = make(side=side)
    (wall,) = surface.walls()
    random = np.random.default_rng(7)
    found = 0
    for _case in range(50):
        start = (0.5 if side == "inside" else 0.9) * random.uniform(-1.0, 1.0, 3)
        velocity = random.normal(size=3) - (0.0 if side == "inside" else 3.0) * start
        sign = 1.0 if side == "inside" else -1.0
        if sign * surface.phi(start) >= 0.0:
            continue
        expected = first_root(surface, start, velocity, pull, 4.0)
        t, time, hits = 0.0, np.inf, False
        while not hits and t < 4.0:
            r = start + velocity * t + 0.5 * np.array(pull) * t * t
            time, hits = call(wall.falling_hit, r, velocity + np.array(pull) * t, Vec(*pull))
            t += time
        if expected < 4.0:
            found += 1
            assert t == pytest.approx(expected, abs=1e-11)
        else:
            assert t > 4.0 - 1e-9
    assert found > 5


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_a_flight_from_the_wall_does_not_hit_it_at_once(side):
    surface = bumpy(side=side)
    (wall,) = surface.walls()
    random = np.random.default_rng(3)
    for _case in range(40):
        point = 0.5 * random.normal(size=3)
        for _ in range(8):
            slope = surface.gradient(point)
            point = point - surface.phi(point) / (slope @ slope) * slope
        normal = np.array(call(wall.unit_normal, point))
        velocity = random.normal(size=3)
        velocity -= 2.0 * max(velocity @ normal, 0.0) * normal
        if abs(surface.phi(point)) > 1e-12:
            continue
        time, hits = call(wall.first_hit, point, velocity)
        assert hits
        assert time > 1e-6
        root = first_root(surface, point, velocity, (0.0, 0.0, 0.0), min(time + 1e-3, 5.0))
        assert time == pytest.approx(root, abs=1e-9)
        time, hits = call(wall.first_hit, point, -velocity)
        assert hits
        assert time * np.abs(velocity).max() < 1e-13


def test_one_that_never_comes_to_the_grid_never_hits():
    (wall,) = ball(side="outside").walls()
    for r, v, pull in (((3.0, 0.0, 0.0), (1.0, 0.0, 0.0), ZERO), ((3.0, 0.0, 0.0), (-1.0, 0.5, 0.0), ZERO)):
        assert call(wall.falling_hit, np.array(r), np.array(v), pull) == (np.inf, True)
    time, hits = call(wall.first_hit, np.array((3.0, 0.0, 0.0)), np.array((-1.0, 0.0, 0.0)))
    assert hits
    assert time == pytest.approx(2.5, abs=1e-5)


@pytest.mark.parametrize("side", ["inside", "outside"])
@pytest.mark.parametrize("gravity", [None, (0.0, 0.5, -1.0)])
def test_bounces_are_those_in_a_sphere(side, gravity):
    # The square of the distance is a polynomial, which the spline is too.
    axis = np.linspace(-0.6, 0.6, 12)
    square = axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2
    sampled = swarm.Sampled(square - 0.25, axis[1] - axis[0], (-0.6, -0.6, -0.6), side)
    around = [swarm.Sphere(0.8)] if side == "outside" else []
    scenes = [swarm.Scene([one, *around], gravity=gravity) for one in (sampled, swarm.Sphere(0.5, side=side))]
    start = swarm.fill(scenes[1], 10, speed=1.0, seed=3)
    one, other = (swarm.simulate(scene, start, swarm.Impact(), until=3.0, compile="never") for scene in scenes)
    assert np.array_equal(one.impacts_per_particle, other.impacts_per_particle)
    assert np.abs(one.particles.position - other.particles.position).max() < 1e-9
    assert one.observables["impulse"][-1][0] == pytest.approx(other.observables["impulse"][-1][0])
    assert one.observables["energy_error"].max() < 100.0 * EPSILON
    assert one.observables["max_penetration"].max() < 4.0 * EPSILON


def test_impacts_of_compiled_runs_are_those_of_plain_python():
    scene = swarm.Scene([bumpy()])
    start = swarm.fill(scene, 20, speed=1.0, seed=1)
    ends = [swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile=mode) for mode in ("never", "always")]
    assert np.array_equal(ends[0].particles.position, ends[1].particles.position)
    many = swarm.fill(scene, 300, speed=1.0, seed=2)
    end = swarm.simulate(scene, many, swarm.Impact(), until=100.0, every=10.0, compile="always")
    assert end.observables["impacts"][-1] > 20_000
    assert end.observables["energy_error"].max() < 1e-13
    assert end.observables["max_penetration"].max() < 4.0 * EPSILON
    assert scene.surfaces[0].phi(end.particles.position).max() < 4.0 * EPSILON


@pytest.mark.parametrize("pull", [ZERO, Vec(0.0, 0.0, -4.0)], ids=["straight", "falling"])
def test_a_hit_at_the_origin_is_found(pull):
    # Where the coordinates of the scene are 0, but not those of the grid, which are what is rounded.
    surface = ball()
    moved = swarm.Sampled(surface.values, surface.spacing, np.add(surface.origin, (0.0, 0.0, 0.5)))
    (wall,) = moved.walls()
    for x in (0.0, 1e-3, 1e-9):
        time, hits = call(wall.falling_hit, np.array((x, x, 0.3)), np.array((0.0, 0.0, -1.0)), pull)
        assert hits
        place = np.array((x, x, 0.3 - time + 0.5 * pull.z * time * time))
        assert abs(moved.phi(place)) < 1e-14
