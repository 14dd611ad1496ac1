"""Formulas that are polynomials: the first root along straight flights, judged in exact arithmetic."""

import functools
import math
from fractions import Fraction

import numpy as np
import pytest
import sympy
from exact import EXACT, TOUCHED, Flight

import swarm
from swarm.kernel.gravity import Gravity, accelerated, displacement
from swarm.kernel.vector import Vec, dot, vec
from swarm.surfaces.formulas.derivatives import derived
from swarm.surfaces.formulas.numbers import SmoothCavity, SmoothSolid
from swarm.surfaces.formulas.polynomial import (
    ConvexQuadraticCavity,
    ConvexQuarticCavity,
    QuadraticCavity,
    QuadraticSolid,
    QuarticCavity,
    QuarticSolid,
)
from swarm.surfaces.time_of_impact import flights
from swarm.surfaces.time_of_impact.polynomial import ConvexFlight, PolynomialFall, PolynomialFlight

EPSILON = 2.0**-52
QUARTIC = "x**4/0.09 + y**4/0.09 + z**4/0.13 - 1"
RING = "(x**2 + y**2 + z**2 + 0.21)**2 - (x**2 + y**2)"
EGG = "x**2/0.09 + y**2/0.09 + z**2/0.16 + 0.3*x**3 - 1"
MONOMIALS = [(i, j, k) for i in range(5) for j in range(5 - i) for k in range(5 - i - j)]
BOX = ((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0))


def _sum(random, count, scales):
    """A random sum of so many monomials."""
    chosen = [MONOMIALS[i] for i in random.choice(len(MONOMIALS), count, replace=False)]
    factors = random.normal(size=count) * 10.0 ** random.choice(scales, count)
    return " + ".join(f"({a!r})*x**{i}*y**{j}*z**{k}" for a, (i, j, k) in zip(factors.tolist(), chosen, strict=True))


def _any(random):
    return _sum(random, 14, [0])


def _of_all_magnitudes(random):
    return _sum(random, 14, range(-12, 1))


def _bounded(random):
    a, b, c, d = np.exp(random.normal(size=4)).tolist()
    return f"{a!r}*x**4 + {b!r}*y**4 + {c!r}*z**4 - {d!r} + 0.3*({_sum(random, 8, [0])})"


def _nearly_quadratic(random):
    tiny = float(random.choice([-1.0, 1.0]) * 10.0 ** random.integers(-18, -2))
    return f"x**2/0.09 + y**2/0.16 + z**2/0.25 - 1 + ({tiny!r})*(x**4 + y**4 + z**4) + {abs(tiny) ** 0.5!r}*x*y*z"


def _sheets(random):
    """Two surfaces that touch each other, or nearly: double roots."""
    apart = float(random.choice([0.1, 1e-4, 1e-8, 0.0]))
    return f"(x**2 + y**2 + z**2 - 1)*(x**2 + y**2 + (z - 0.3)**2 - {0.49 + apart!r})"


def _flights(random, wall, count):
    """Starts inside, and on the wall along it, next to it and away from it: (position, velocity)."""
    while count:
        place, velocity = vec(random.uniform(-1.0, 1.0, 3).tolist()), random.normal(size=3)
        if random.integers(3):
            for _step in range(50):
                place = wall.project(place)
            if not (abs(wall.phi(place)) < 1e-12 and max(map(abs, place)) < 1.9):
                return
            normal = np.array(wall.unit_normal(place))
            along = velocity - (velocity @ normal) * normal
            lean = random.choice([-random.random(), -1e-3, -1e-6, -1e-9, 0.0, 1e-12])
            velocity = lean * normal + math.sqrt(1.0 - lean * lean) * along / np.linalg.norm(along)
        elif wall.side * wall.phi(place) > 0.0:
            continue
        count -= 1
        yield place, vec((velocity * random.choice([1e-6, 1.0, 1e6])).tolist())


def _require_first_roots(family, seed, flights=8):
    random = np.random.default_rng(seed)
    side = str(random.choice(["inside", "outside"]))
    try:
        surface = swarm.Formula(family(random), side=side, bounds=BOX, curvature=1.0, center=(0.2, -0.1, 0.1))
    except swarm.SceneError:
        return  # without a surface, or with a tip
    wall = surface.numbers()
    for place, velocity in _flights(random, wall, flights):
        time, found = wall.first_hit(place, velocity)
        exact = Flight([wall], tuple(place), tuple(velocity))
        if math.isinf(time) and wall.is_solid:
            # What is beyond the bounds of a solid is no wall.
            start, end = wall._in_box(place, velocity)
            time, found = end * (1.0 - 1e-9) if start <= end else 0.0, False
        verdict = exact.judge(time, found, 0.0, 4.0 * EPSILON)
        assert verdict in (EXACT, TOUCHED), (verdict, surface, place, velocity)


FAMILIES = [_any, _of_all_magnitudes, _bounded, _nearly_quadratic, _sheets]


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", [1, 2])
def test_no_root_is_missed(family, seed):
    _require_first_roots(family, seed)


@pytest.mark.long
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", range(100, 150))
def test_no_root_is_missed_of_many(family, seed):
    _require_first_roots(family, seed)


def _fall(wall, place, velocity, pull):
    """`falling_hit`: numbers of NumPy are divided by 0 as those of kernels are."""
    with np.errstate(all="ignore"):
        return wall.falling_hit(*(vec(np.array(one)) for one in (place, velocity, pull)))


def _leaves_box(wall, place, velocity, pull):
    """When a fall leaves the box of a solid, or 0 if it begins outside."""
    first = math.inf
    for x, v, g, c, low, high in zip(place, velocity, pull, wall.center, wall.low, wall.high, strict=True):
        if not low < x - c < high:
            return 0.0
        for face in (low, high):
            roots = np.roots([0.5 * g, v, x - c - face])
            first = min([first, *(float(t.real) for t in roots if t.real > 0.0 and abs(t.imag) <= 1e-12 * abs(t))])
    return first


def _require_first_roots_of_falls(family, seed, flights=8):
    random, hits = np.random.default_rng(seed), 0
    side = str(random.choice(["inside", "outside"]))
    try:
        surface = swarm.Formula(family(random), side=side, bounds=BOX, curvature=1.0, center=(0.2, -0.1, 0.1))
    except swarm.SceneError:
        return 0  # without a surface, or with a tip
    wall = surface.numbers()
    for place, velocity in _flights(random, wall, flights):
        speed = max(map(abs, velocity))
        pull = (random.normal(size=3) * speed * speed * 10.0 ** random.choice([-3.0, 0.0, 1.0])).tolist()
        time, found = _fall(wall, place, velocity, pull)
        if wall.is_solid and (leaves := _leaves_box(wall, place, velocity, pull)) < time:
            # What is beyond the bounds of a solid is no wall.
            time, found = leaves * (1.0 - 1e-9), False
        hits += found and time < math.inf
        verdict = Flight([wall], tuple(place), tuple(velocity), tuple(pull)).judge(time, found, 0.0, 4.0 * EPSILON)
        assert verdict in (EXACT, TOUCHED), (verdict, surface, place, velocity, pull)
    return hits


@pytest.mark.parametrize("family", FAMILIES)
def test_falls_meet_formulas_of_degree_4_at_the_first_root(family):
    assert sum(_require_first_roots_of_falls(family, seed, 4) for seed in range(3)) > 3


def test_a_fall_of_plain_numbers_away_from_the_box_of_a_solid_meets_nothing():
    """Kernels in plain Python have gravity as it was given, and no number that is not of NumPy may be divided by."""
    wall = swarm.Formula("x**4 + y**4 + z**4 - 0.0001", side="outside", bounds=BOX).numbers()
    below, down = Vec(np.float64(0.0), np.float64(0.0), np.float64(-2.5)), Vec(0.0, 0.0, -1.0)
    with np.errstate(all="ignore"):
        time, found = wall.falling_hit(below, Vec(np.float64(0.1), np.float64(0.0), np.float64(-0.2)), down)
    assert not (found and time < math.inf)


@pytest.mark.long
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", range(100, 150))
def test_falls_of_many_meet_formulas_of_degree_4_at_the_first_root(family, seed):
    _require_first_roots_of_falls(family, seed)


def _quadric(random):
    """Any of degree 2 or 1: bowls, saddles, sheets, cylinders, planes."""
    few = [one for one in MONOMIALS if sum(one) <= (1 if random.integers(8) == 0 else 2)]
    factors = random.normal(size=len(few)) * random.choice([0.0, 1e-6, 1.0, 30.0], len(few))
    return " + ".join(f"({a!r})*x**{i}*y**{j}*z**{k}" for a, (i, j, k) in zip(factors.tolist(), few, strict=True))


def test_falls_meet_quadrics_at_the_first_root():
    random, hits = np.random.default_rng(5), 0
    for _wall_of_many in range(8):
        try:
            surface = swarm.Formula(_quadric(random), bounds=BOX, center=(0.2, -0.1, 0.1))
        except swarm.SceneError:
            continue  # without a surface, or with a tip
        wall = surface.numbers()
        for place, velocity in _flights(random, wall, 12):
            pull = vec((random.normal(size=3) * 10.0 ** random.choice([-3.0, 0.0, 1.0])).tolist())
            time, found = _fall(wall, place, velocity, pull)
            verdict = Flight([wall], tuple(place), tuple(velocity), tuple(pull)).judge(time, found, 0.0, 4.0 * EPSILON)
            assert verdict in (EXACT, TOUCHED), (verdict, surface, place, velocity, pull)
            hits += found and time < math.inf
    assert hits > 10


@pytest.mark.parametrize("text", ["x**2 + y**2 - 0.01", "(x**2 + y**2)**2 - 0.0001"])
def test_a_fall_meets_no_wall_outside_of_the_box_of_a_solid(text):
    post = swarm.Formula(text, side="outside", bounds=((-0.2, -0.2, -1.0), (0.2, 0.2, 1.0))).numbers()
    pull = vec((0.0, 0.0, -1.0))
    beyond, beside = vec((1.0, 0.0, -3.0)), vec((1.0, 0.0, 0.5))
    assert math.isinf(post.first_hit(beyond, vec((-1.0, 0.0, -1.0)))[0])
    time, found = _fall(post, beside, (-2.0, 0.0, 0.0), pull)
    assert (time, found) == (pytest.approx(0.45), True)
    free = 0.0
    for _step in range(50):
        r = vec((1.0 - free, 0.0, -3.0 - 0.5 * free * free))
        time, found = _fall(post, r, (-1.0, 0.0, -free), pull)
        free += time
        if found or free > 4.0:
            break
    assert free > 4.0 or not found


def _from_wall(text, count):
    """The levels of flights from places of impact, as lanes take them."""
    # A cubic goes on beyond the egg.
    surface = swarm.Formula(text, bounds=((-0.5,) * 3, (0.5,) * 3) if text == EGG else None)
    wall, particles = surface.numbers(), swarm.fill(swarm.Scene([surface]), count, speed=0.5, seed=2)
    for r, v in zip(particles.position.T, particles.velocity.T, strict=True):
        r, v = vec(r), vec(v)
        yield wall.steps(None, r, v)
        place = wall.project(r + wall.first_hit(r, v)[0] * v)
        normal = wall.unit_normal(place)
        yield wall.steps(None, place, v - (2.0 * dot(normal, v)) * normal)


@pytest.mark.parametrize(("text", "share"), [(QUARTIC, 0.95), (RING, 0.9), (EGG, 0.95)])
def test_guesses_lead_to_most_hits_without_safe_steps(text, share):
    # Every second one starts on the wall.
    levels = list(_from_wall(text, 30))[1::2]
    assert all(level.a4 == 0.0 for level in levels)
    assert np.mean([level.first_step()[1] == 0.0 for level in levels]) >= share


def test_flights_to_a_formula_that_is_turned_begin_with_a_guess(monkeypatch):
    guesses, aim = [], flights.aim

    def counted(*given):
        guesses.append(1)
        return aim(*given)

    monkeypatch.setattr(flights, "aim", counted)
    start = swarm.fill(swarm.Scene([swarm.Formula(QUARTIC)]), 4, speed=1.0, seed=3)
    turned = swarm.Particles(start.position[[2, 0, 1]], start.velocity[[2, 0, 1]])
    ends = []
    # By a third of a turn about (1, 1, 1) x becomes y, y becomes z, and z becomes x.
    third = (1.0, 1.0, 1.0, 1.0)
    for rotation, particles in ((None, start), (third, turned)):
        scene = swarm.Scene([swarm.Formula(QUARTIC, rotation=rotation)])
        ends.append(swarm.simulate(scene, particles, swarm.Impact(), until=2.0, compile="never").particles)
        assert guesses
        guesses.clear()
    assert ends[1].position == pytest.approx(ends[0].position[[2, 0, 1]], abs=1e-12)


def _level_with_roots(random, kind):
    """A level of degree 4 that is below 0 at first, with some of its roots next to each other."""
    roots = np.abs(random.normal(size=4)) * random.choice([-1.0, 1.0], 4)
    near = roots[0] * (1.0 + float(random.choice([0.0, 1e-12, 1e-8, 1e-4, 0.1])) * random.normal())
    roots[1] = random.choice([near, roots[1]])
    level = np.polynomial.polynomial.polyfromroots(roots[: random.choice([3, 4])])
    level *= -np.sign(level[0])
    c, b, a2, a3, a4 = np.append(level, 0.0)[:5]
    return kind(c, 0.5 * b, a2, a3, a4, window=1.0)


@pytest.mark.parametrize("kind", [PolynomialFlight, ConvexFlight])
def test_no_guess_leads_beyond_a_first_root(kind):
    """Judged by the value in exact arithmetic: it is above 0 by no more than round-off on the whole way to the hit.

    The guess may be one for a convex level, which these are not.
    """
    random, hits = np.random.default_rng(5), 0
    for _flight in range(300):
        level = _level_with_roots(random, kind)
        time, length = level.first_step()
        if length == 0.0:
            hits += 1
            powers = [Fraction(a) for a in (level.c, 2.0 * level.b, level.a2, level.a3, level.a4)]
            for part in np.linspace(0.0, 1.0, 65)[:-1]:
                t = Fraction(float(part * time))
                terms = [a * t**k for k, a in enumerate(powers)]
                assert sum(terms) <= 2e-15 * sum(map(abs, terms)), (level, time, part)
    assert hits > 100


@pytest.mark.parametrize(
    ("text", "side", "kind"),
    [
        (QUARTIC, "inside", ConvexQuarticCavity),
        ("x**2 + y**2 + x*y/2 + z**4 + x**4 - 1", "inside", ConvexQuarticCavity),
        ("x**4 + y**4 + z**4 - x*y*z - 1", "inside", QuarticCavity),
        ("p*x**4 - x**2 + y**2 + z**2 - 1", "inside", QuarticCavity),
        (RING, "inside", QuarticCavity),
        (RING, "outside", QuarticSolid),
        ("x**2/p + y**2 + z*x + z**2 - sqrt(p)", "inside", ConvexQuadraticCavity),
        ("x**2 + y**2 - z**2 - 1", "inside", QuadraticCavity),
        ("x**2 + y**2 + z**2 - 1", "outside", QuadraticSolid),
        ("x**6 + y**2 + z**2 - 1", "inside", SmoothCavity),
        ("x**2 + y**2 + sin(z)**2 + z**2 - 1", "inside", SmoothCavity),
        ("x**2/(1 + y**2) + y**2 + z**2 - 1", "inside", SmoothCavity),
        ("x**6 + y**2 + z**2 - 1", "outside", SmoothSolid),
        ("x**2 + y**2 + exp(z*z) - 2", "inside", SmoothCavity),
    ],
)
def test_what_is_a_polynomial_is_recognised(text, side, kind):
    surface = swarm.Formula(text, side=side, parameters={"p": 0.25} if "p" in text else None)
    assert type(surface.numbers()).__mro__[1] is kind


@pytest.mark.parametrize("text", [QUARTIC, RING, "x*y*z - x**3/3 + 2*y - 1", "(x + 2*y)**3*z - (x - z)**2 + x"])
def test_the_coefficients_are_the_derivatives_along_the_flight(text):
    code = derived(text, ())
    t, start, velocity = sympy.Symbol("t"), [0.3, -0.2, 0.7], [0.5, 1.0, -0.25]
    path = {
        axis: sympy.Rational(a) + t * sympy.Rational(v) for axis, a, v in zip(code.axes, start, velocity, strict=True)
    }
    expected = sympy.Poly(code.phi.subs(path), t).all_coeffs()[::-1]
    expected = [float(one) for one in expected] + [0.0] * (5 - len(expected))
    np.testing.assert_allclose(code.along((), *start, *velocity), expected, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("text", [QUARTIC, RING, "x*y*z - x**3/3 + 2*y - 1", "(x + 2*y)**3*z - (x - z)**2 + x"])
def test_the_coefficients_of_a_fall_are_the_derivatives_along_it(text):
    code = derived(text, ())
    t, rows = sympy.Symbol("t"), ([0.3, -0.2, 0.7], [0.5, 1.0, -0.25], [0.1, -0.3, 0.6])
    path = {axis: sum(t**k * sympy.Rational(row[i]) for k, row in enumerate(rows)) for i, axis in enumerate(code.axes)}
    expected = list(map(float, sympy.Poly(code.phi.subs(path), t).all_coeffs()[::-1]))
    np.testing.assert_allclose(code.along_fall((), *rows[0], *rows[1], *rows[2]), expected, rtol=0.0, atol=1e-14)


def _falls(text, count):
    """Falls from within and from places of impact: (wall, gravity, place, velocity)."""
    wall, particles = _wall(text), swarm.fill(swarm.Scene([swarm.Formula(text)]), count, speed=0.5, seed=2)
    for i, (r, v) in enumerate(zip(particles.position.T, particles.velocity.T, strict=True)):
        gravity, r, v = Gravity(*np.array([0.0, 0.3, -1.0]) * 4.0 ** (i % 3)), vec(r), vec(v)
        for _impact in range(2):
            yield wall, gravity, r, v
            time, _found = _fall(wall, r, v, gravity)
            place, v = wall.project(r + displacement(gravity, v, time)), accelerated(gravity, v, time)
            normal = wall.unit_normal(place)
            r, v = place, v - (2.0 * dot(normal, v)) * normal


@pytest.mark.parametrize("text", [QUARTIC, RING])
def test_guesses_lead_to_most_hits_of_falls_without_safe_steps(text):
    with np.errstate(all="ignore"):
        left = [wall.fall(gravity, r, v).aims(math.inf)[1] for wall, gravity, r, v in _falls(text, 30)]
    assert len(left) == 60
    assert np.mean(np.array(left) == 0.0) >= 0.9


def test_no_guess_of_a_fall_leads_beyond_a_first_root():
    random, hits = np.random.default_rng(6), 0
    for _flight in range(150):
        roots = np.abs(random.normal(size=8)) * random.choice([-1.0, 1.0], 8)
        near = roots[0] * (1.0 + float(random.choice([0.0, 1e-12, 1e-8, 1e-4, 0.1])) * random.normal())
        roots[1] = random.choice([near, roots[1]])
        powers = np.polynomial.polynomial.polyfromroots(roots[: random.choice([6, 8])])
        level = PolynomialFall(tuple(-np.sign(powers[0]) * powers), 0.5)
        with np.errstate(all="ignore"):
            time, left = level.aims(math.inf)
        if left == 0.0:
            hits += 1
            powers = [Fraction(a) for a in level.powers]
            for part in np.linspace(0.0, 1.0, 65)[:-1]:
                t = Fraction(float(part * time))
                terms = [a * t**k for k, a in enumerate(powers)]
                assert sum(terms) <= 1e-14 * sum(map(abs, terms)), (level, time, part)
    assert hits > 40


def test_lanes_that_fall_beside_a_plane_and_in_a_formula_that_is_turned_keep_their_energy():
    start = swarm.fill(swarm.Scene([swarm.Formula(QUARTIC)]), 12, speed=1.0, seed=3)
    turned = swarm.Particles(start.position[[2, 0, 1]], start.velocity[[2, 0, 1]])
    start = swarm.Particles(start.position, start.velocity)
    # By a third of a turn about (1, 1, 1) x becomes y, y becomes z, and z becomes x.
    ends, gravity = [], np.array([0.3, -0.2, -1.0])
    for rotation, order, particles in ((None, [0, 1, 2], start), ((1.0, 1.0, 1.0, 1.0), [2, 0, 1], turned)):
        normal, pull = np.array([0.0, 0.0, 1.0])[order], gravity[order]
        surfaces = [swarm.Formula(QUARTIC, rotation=rotation), swarm.Plane(tuple(normal.tolist()), 0.7)]
        scene = swarm.Scene(surfaces, tuple(pull.tolist()))
        end = swarm.simulate(scene, particles, swarm.Impact(), until=2.0, compile="never").particles
        energy = [0.5 * (one.velocity**2).sum(axis=0) - pull @ one.position for one in (particles, end)]
        np.testing.assert_allclose(energy[1], energy[0], rtol=0.0, atol=1e-14)
        assert (scene.distances_outside(end.position, 0.0) <= 1e-15).all()
        ends.append(end.position)
    assert ends[1] == pytest.approx(ends[0][[2, 0, 1]], abs=1e-11)


@functools.cache
def _wall(text):
    return swarm.Formula(text).numbers()


@pytest.mark.parametrize(
    ("text", "phi"),
    [
        (QUARTIC, lambda x, y, z: 100 * (x**4 + y**4) / 9 + 100 * z**4 / 13 - 1),
        (RING, lambda x, y, z: (x**2 + y**2 + z**2 + sympy.Rational(21, 100)) ** 2 - x**2 - y**2),
        ("9*x**2 + 6*y**2 + 4*z**2 + 2*x*y - 1", lambda x, y, z: 9 * x**2 + 6 * y**2 + 4 * z**2 + 2 * x * y - 1),
    ],
)
def test_a_place_of_impact_is_on_the_wall_to_four_roundings(text, phi):
    """Of the farthest coordinate that the flight goes over, across the wall, in exact arithmetic."""
    wall = _wall(text)
    particles = swarm.fill(swarm.Scene([swarm.Formula(text)]), 20, speed=0.5, seed=1)
    for r, v in zip(particles.position.T, particles.velocity.T, strict=True):
        r, v = vec(r.tolist()), vec(v.tolist())
        for _impact in range(3):
            time, found = wall.first_hit(r, v)
            assert found
            exact = [sympy.Rational(a) + sympy.Rational(time) * sympy.Rational(b) for a, b in zip(r, v, strict=True)]
            end, normal = r + time * v, wall.unit_normal(r + time * v)
            slope = math.hypot(*wall.gradient(end))
            assert abs(float(phi(*exact))) <= 4.0 * EPSILON * max(map(abs, (*r, *end))) * slope
            out = sum(a * b for a, b in zip(normal, v, strict=True))
            r, v = end, v - (2.0 * out) * normal


@pytest.mark.parametrize(
    ("text", "phi"),
    [
        (QUARTIC, lambda x, y, z: 100 * (x**4 + y**4) / 9 + 100 * z**4 / 13 - 1),
        (RING, lambda x, y, z: (x**2 + y**2 + z**2 + sympy.Rational(21, 100)) ** 2 - x**2 - y**2),
    ],
)
def test_a_fall_ends_on_the_wall_to_four_roundings(text, phi):
    for wall, gravity, r, v in _falls(text, 15):
        time, found = _fall(wall, r, v, gravity)
        assert found
        t = sympy.Rational(float(time))
        exact = [
            sympy.Rational(float(a)) + t * sympy.Rational(float(b)) + t * t * sympy.Rational(float(c)) / 2
            for a, b, c in zip(r, v, gravity, strict=True)
        ]
        end = r + displacement(gravity, v, time)
        # A fall that turns goes over what it comes back from.
        way = max(abs(a) + abs(b * time) + abs(0.5 * c * time * time) for a, b, c in zip(r, v, gravity, strict=True))
        assert abs(float(phi(*exact))) <= 4.0 * EPSILON * way * math.hypot(*wall.gradient(end))
