"""Flights that are looked at, to formulas with sines and of higher degrees: the first root, judged in 50 digits."""

import functools
import math

import mpmath
import numpy as np
import pytest
import sympy

import swarm
from swarm.kernel.gravity import Gravity, accelerated, displacement
from swarm.kernel.vector import dot, vec
from swarm.surfaces.formulas.derivatives import derived
from swarm.surfaces.time_of_impact.looks import falling

EPSILON = 2.0**-52
SINES = "x**2/0.09 + y**2/0.09 + z**2/0.16 - 1 + 0.1*sin(10*x)*sin(10*y)"
# Rooms that hang together by narrow ways, with walls of both kinds of curvature
ROOMS = "0.3*(x**2 + y**2 + z**2) - 1 + sin(4*x)*cos(4*y) + sin(4*y)*cos(4*z) + sin(4*z)*cos(4*x)"
SEXTIC = "x**6/0.02 + y**6/0.02 + z**4/0.13 - 1"
BENT = "x**6 + y**4*z**2 + y**6 + z**6 - x**3*y**2/2 - x*y*z/5 - z**2/2 - 0.05"
ROOTS = "sqrt(x**2 + 0.01) + sqrt(y**2 + 0.02) + sqrt(z**2 + 0.01)*cos(3*z)**2 + z**2 - 1"
# Solids: a ball with waves, and one with a dent on top, in which a fall may come to rest
WAVES = "x**2/0.01 + y**2/0.01 + z**2/0.02 - 1 + 0.3*sin(30*x)*sin(30*y)"
DENTED = "x**2/0.09 + y**2/0.09 + z**6/0.01 + cos(8*x)*cos(8*y)*sin(9*z) - 1"
QUADRIC = "x**2/0.01 + y**2/0.02 + z**2/0.03 + x*y - 1"
SOLIDS = WAVES, DENTED, QUADRIC
LIBRARY = "exp(x*x/0.2) + log(1 + 9*y*y) + cosh(3*z) + tanh(6*x*y*z) + (z**2 + 0.1)**0.7 - 3.7"
FORMULAS = [pytest.param(text, id=name) for name, text in (
    ("sines", SINES), ("rooms", ROOMS), ("sextic", SEXTIC), ("bent", BENT), ("roots", ROOTS), ("waves", WAVES),
    ("dented", DENTED), ("library", LIBRARY), ("quadric", QUADRIC),
)]  # fmt: skip
# How far from the wall, relative to its size, a fall passes it; below 0 it goes through it and back
GAPS = [-1e-1, -1e-2, -1e-3, -1e-4, -1e-8, -1e-12, 0.0, 1e-12, 1e-8, 1e-4, 1e-2, 0.1]


@functools.cache
def _surface(text):
    return swarm.Formula(text, side="outside" if text in SOLIDS else "inside")


@functools.cache
def _exact(text):
    """phi in 50 digits."""
    code = derived(text, ())
    return sympy.lambdify(code.axes, code.phi, "mpmath")


def _level(text, r, v, pull, t):
    with mpmath.workdps(50):
        t = mpmath.mpf(float(t))
        place = (mpmath.mpf(float(a)) + t * (float(b) + t * float(c) / 2) for a, b, c in zip(r, v, pull, strict=True))
        return _surface(text).numbers().side * float(_exact(text)(*place))


def _highest(text, r, v, pull, until):
    """The times at which the level along a flight may be highest, but for its end: local maxima of many places."""
    rows, most = [np.array(one)[:, None] for one in (r, v, pull)], 3000
    side = _surface(text).numbers().side

    def level(t):
        return side * _surface(text).phi(rows[0] + t * rows[1] + 0.5 * t * t * rows[2])

    t, found = np.linspace(0.0, until, most), []
    for _round in range(4):
        values = level(t)
        top = np.flatnonzero((values[1:-1] >= values[:-2]) & (values[1:-1] >= values[2:])) + 1
        top = top[np.argsort(-values[top])[:5]]
        if not top.size:
            break
        found = t[top].tolist()
        # Again between the neighbours of each
        t = np.unique(np.concatenate([np.linspace(t[i - 1], t[i + 1], 41) for i in top]))
    return found


def _starts(text, random, count, weight):
    """Falls that start inside, that start on the wall, and that pass the wall closely: (place, velocity, pull)."""
    surface, wall = _surface(text), _surface(text).numbers()
    # Around a solid
    around = [swarm.Sphere(2.0 * surface.extent())] if text in SOLIDS else []
    particles = swarm.fill(swarm.Scene([surface, *around]), count, speed=1.0, seed=int(random.integers(1000)))
    for r, v in zip(particles.position.T, particles.velocity.T, strict=True):
        v = v if not around else 0.3 * v - r / math.hypot(*r)
        r, v, pull = vec(r), vec(v), vec(weight * random.normal(size=3))
        yield r, v, pull
        time, found = wall.falling_hit(r, v, pull)
        if not found or math.isinf(time):
            continue
        place = wall.project(r + displacement(Gravity(*pull), v, time))
        normal, arriving = wall.unit_normal(place), accelerated(Gravity(*pull), v, time)
        normal = wall.side * normal
        yield place, arriving - (2.0 * dot(normal, arriving)) * normal, pull
        # Along the wall, at a gap, after a time
        along, before = arriving - dot(normal, arriving) * normal, 0.3 * float(random.random())
        near = place - (random.choice(GAPS) * wall.size) * normal
        start = near - before * along + (0.5 * before * before) * pull
        if wall.side * surface.phi(np.array(start)) < 0.0:
            yield start, along - before * pull, pull


def _require_first_roots(text, seed, count):
    random, wall, hits = np.random.default_rng(seed), _surface(text).numbers(), 0
    # A fall that misses a solid has left it by then.
    longest = 10.0 * _surface(text).extent()
    for weight in (0.1, 1.0, 20.0):
        for r, v, pull in _starts(text, random, count, weight):
            # A search that takes many looks goes on from there.
            for _part in range(400):
                time, found = wall.falling_hit(r, v, pull)
                never, time = math.isinf(time), min(time, longest)
                end = r + displacement(Gravity(*pull), v, time)
                rows = zip(r, v, pull, strict=True)
                way = max(abs(a) + abs(b * time) + abs(0.5 * c * time * time) for a, b, c in rows)
                slope = math.hypot(*wall.gradient(end)) + wall.bends.most * math.sqrt(EPSILON) * wall.size
                room = 4.0 * EPSILON * way * slope
                for one in (*_highest(text, r, v, pull, time), 0.999 * time):
                    assert _level(text, r, v, pull, one) <= room, (r, v, pull, time, one)
                if never:
                    break
                if found:
                    assert abs(_level(text, r, v, pull, time)) <= room or time == 0.0, (r, v, pull, time)
                    hits += 1
                    break
                r, v = end, accelerated(Gravity(*pull), v, time)
            else:
                raise AssertionError((r, v, pull))
    return hits


@pytest.mark.parametrize("text", FORMULAS)
def test_falls_meet_formulas_at_the_first_root(text):
    assert _surface(text).numbers().looked_at
    with np.errstate(all="ignore"):
        # About half of the falls at a solid pass it.
        count, least = (4, 8) if text in SOLIDS else (2, 12)
        assert _require_first_roots(text, 1, count) >= least


@pytest.mark.long
@pytest.mark.parametrize("text", FORMULAS)
@pytest.mark.parametrize("seed", range(100, 120))
def test_falls_of_many_meet_formulas_at_the_first_root(text, seed):
    with np.errstate(all="ignore"):
        _require_first_roots(text, seed, 12)


@pytest.mark.parametrize("text", FORMULAS)
def test_third_derivatives_are_within_their_bound(text):
    wall, random = _surface(text).numbers(), np.random.default_rng(4)
    points = _surface(text)._form.points(2000)
    points = points[:, wall.side * wall.phi(vec(points)) <= 0.0]
    ways = random.normal(size=points.shape)
    ways /= np.sqrt((ways**2).sum(axis=0))
    step = 1e-4 * wall.size
    ends = (np.broadcast_arrays(*wall.hessian(vec(points + sign * step * ways)), points[0])[:6] for sign in (1.0, -1.0))
    change = np.subtract(*map(np.array, ends)) / step
    u, v, w = ways
    third = (change * [u * u, v * v, w * w, 2.0 * u * v, 2.0 * v * w, 2.0 * w * u]).sum(axis=0)
    assert 0.1 * wall.bends.third <= np.abs(third).max() <= wall.bends.third


@pytest.mark.parametrize(("text", "most"), [(SINES, 7.0), (SEXTIC, 15.0)], ids=["sines", "sextic"])
def test_few_looks_find_the_hit_of_a_fall(text, most):
    random, wall, looks = np.random.default_rng(3), _surface(text).numbers(), []
    with np.errstate(all="ignore"):
        for r, v, pull in _starts(text, random, 10, 1.0):
            fall, count = falling(wall, pull, r, v), 0
            known = fall.first()
            while known.goes_on:
                known, count = fall.look(known), count + 1
            looks.append(count)
    assert len(looks) >= 20
    assert np.mean(looks) <= most


# Falls that come within 1e-8 of a wall which bends by less than it does elsewhere: (place, velocity, pull)
GRAZING = [
    pytest.param(SEXTIC, (-0.520575845837, -0.021343565634, -0.050181361806), (-0.005312423989, -0.600114321817,
        -0.193188721931), (0.036159505491, 0.130400004513, 0.094708096312), id="sextic"),
    pytest.param(LIBRARY, (0.251580005161, -0.232684623762, -0.350828121489), (-0.075254152469, -0.209125143780,
        0.095977804534), (-0.013210486329, 0.064042265044, 0.010490011715), id="library"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "r", "v", "pull"), GRAZING)
def test_a_fall_that_only_just_passes_a_wall_is_looked_at_less_than_a_hundred_times(text, r, v, pull):
    with np.errstate(all="ignore"):
        fall, looks = falling(_surface(text).numbers(), vec(pull), vec(r), vec(v)), 0
        known = fall.first()
        while known.goes_on and looks < 1000:
            known, looks = fall.look(known), looks + 1
    assert looks < 100
