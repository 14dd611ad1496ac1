"""Balls at walls that are known by a smooth phi: the foot of the normal, and runs."""

import math
from typing import NamedTuple

import mpmath
import numpy as np
import pytest
from conftest import call

import swarm
from swarm.kernel.vector import Vec
from swarm.surfaces.balls import foot_hit
from swarm.surfaces.time_of_impact import march

WAVES = "x**4 + 2*y**4 + exp(z*z/2) - 1.4 + 0.2*x*y*z"


def waves(x, y, z):
    """phi of that formula, and its gradient."""
    fifth = mpmath.mpf(0.2)
    steep = mpmath.exp(z * z / 2)
    value = x**4 + 2 * y**4 + steep - mpmath.mpf(1.4) + fifth * x * y * z
    return value, (4 * x**3 + fifth * y * z, 8 * y**3 + fifth * x * z, z * steep + fifth * x * y)


def foot_in_high_precision(y, value_and_slope, starts=6):
    """The distance of a place from a surface: the least of Newton's methods from many starts."""
    with mpmath.workdps(40):
        place = [mpmath.mpf(float(x)) for x in y]

        def equations(x, y, z, k):
            value, slope = value_and_slope(x, y, z)
            return [a - b - k * s for a, b, s in zip((x, y, z), place, slope, strict=True)] + [value]

        rng, found = np.random.default_rng(2), []
        for _start in range(starts):
            u = rng.normal(size=3)
            first = [float(a) + 0.4 * b / math.hypot(*u) for a, b in zip(y, u, strict=True)]
            try:
                x = mpmath.findroot(equations, (*first, 0.1), tol=1e-30, maxsteps=40)
            except (ValueError, ZeroDivisionError, OverflowError):
                continue
            found.append(mpmath.sqrt(sum((a - b) ** 2 for a, b in zip(x, place, strict=False))))
        return min(found)


def test_the_foot_is_that_of_a_solver_in_high_precision():
    surface, rng = swarm.Formula(WAVES), np.random.default_rng(4)
    wall, largest, checked = surface.by_foot(0.0), surface.largest_ball(), 0
    while checked < 5:
        y = rng.uniform(-0.9, 0.9, 3)
        found = call(wall.foot, y) if surface.phi(y[:, None])[0] < 0.0 else None
        if found is None or not 0.01 < found.away < largest:
            continue
        assert found.sure
        assert abs(found.away - foot_in_high_precision(y, waves)) <= 4e-16
        checked += 1


TICKS = np.linspace(-1.0, 1.0, 9)


def wavy(side="inside", **laws):
    """A cavity of samples that are no polynomial."""
    x, y, z = TICKS[:, None, None], TICKS[:, None], TICKS
    values = x * x + 1.2 * y * y + z * z + 0.1 * np.sin(3.0 * x) * np.cos(2.0 * y) * np.sin(2.0 * z) - 0.5
    return swarm.Sampled(values, 0.25, (-1.0,) * 3, side, **laws)


def spline_in_high_precision(surface):
    """phi of a sampled surface and its gradient, by the sum of the pieces of each basis function."""
    table = surface.numbers().spline.coefficients

    def pieces(x):
        u = (x + 1) * 4
        k = min(max(int(mpmath.floor(u)), 0), 7)
        t = u - k
        s = 1 - t
        values = (s**3, 3 * t**3 - 6 * t**2 + 4, 3 * s**3 - 6 * s**2 + 4, t**3)
        slopes = (-3 * s**2, 9 * t**2 - 12 * t, 12 * s - 9 * s**2, 3 * t**2)
        return k, [one / 6 for one in values], [4 * one / 6 for one in slopes]

    def value_and_slope(x, y, z):
        (i, a, da), (j, b, db), (k, c, dc) = pieces(x), pieces(y), pieces(z)
        block = [[[mpmath.mpf(float(v)) for v in row] for row in one] for one in table[i : i + 4, j : j + 4, k : k + 4]]

        def total(u, v, w):
            return mpmath.fsum(
                u[p] * v[q] * mpmath.fsum(w[r] * block[p][q][r] for r in range(4)) for p in range(4) for q in range(4)
            )

        return total(a, b, c), (total(da, b, c), total(a, db, c), total(a, b, dc))

    return value_and_slope


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_the_foot_at_samples_is_that_of_a_solver_in_high_precision(side):
    surface, rng = wavy(side), np.random.default_rng(5)
    wall, largest, checked = surface.by_foot(0.0), surface.largest_ball(), 0
    while checked < 2:
        y = rng.uniform(-0.9, 0.9, 3)
        inside = (surface.phi(y[:, None])[0] < 0.0) == (side == "inside")
        found = call(wall.foot, y) if inside else None
        if found is None or not 0.01 < found.away < 0.9 * largest:
            continue
        assert found.sure
        assert abs(found.away - foot_in_high_precision(y, spline_in_high_precision(surface), 3)) <= 1e-15
        checked += 1


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_no_bound_at_samples_of_a_distance_is_above_the_distance(side):
    """Second derivatives of a distance grow without end: their bound holds near the surface only."""
    x = np.linspace(-1.0, 1.0, 17)
    phi = np.sqrt(x[:, None, None] ** 2 + x[:, None] ** 2 + x**2) - 0.6
    surface = swarm.Sampled(phi, 0.125, (-1.0,) * 3, side)
    wall, largest, rng = surface.by_foot(0.0), surface.largest_ball(), np.random.default_rng(6)
    assert 0.0 < wall.known < math.inf
    assert largest > 0.03
    sign = 1.0 if side == "inside" else -1.0
    for _place in range(60):
        y = rng.uniform(-1.3, 1.3, 3)
        if sign * surface.phi(y[:, None])[0] >= 0.0:
            continue
        found, (near, _normal) = call(wall.foot, y), call(wall.at_least, y)
        directions = rng.normal(size=(3, 400))
        directions *= (1.0 - 1e-9) * max(found.away, near) / np.sqrt((directions**2).sum(axis=0))
        assert (sign * surface.phi(y[:, None] + directions)).max() <= 1e-12
        assert found.sure or found.away >= (1.0 - 1e-3) * largest


def test_a_foot_that_is_far_has_a_lower_bound_above_every_radius():
    """Where a ball of the largest radius has room the bound says so: no flight ends short of the wall."""
    surface, rng = swarm.Formula(WAVES), np.random.default_rng(6)
    wall, largest = surface.by_foot(0.0), surface.largest_ball()
    for _place in range(100):
        y = rng.uniform(-0.9, 0.9, 3)
        if surface.phi(y[:, None])[0] >= 0.0:
            continue
        found = call(wall.foot, y)
        directions = rng.normal(size=(3, 400))
        directions *= (1.0 - 1e-9) * found.away / np.sqrt((directions**2).sum(axis=0))
        assert surface.phi(y[:, None] + directions).max() <= 1e-12
        assert found.sure or found.away >= (1.0 - 1e-3) * largest


@pytest.mark.parametrize("gravity", [(0.0, 0.0, 0.0), (0.3, 0.1, -1.0)], ids=["straight", "falling"])
@pytest.mark.parametrize("name", ["waves", "waves outside", "quadric", "waist"])
@np.errstate(all="ignore")
def test_the_first_impact_is_that_of_safe_steps(name, gravity):
    """Newton's method finds any impact: what makes it sure is that no other one is before it, also where it grazes."""
    surface = {
        "waves": swarm.Formula(WAVES),
        "waves outside": swarm.Formula(WAVES, side="outside"),
        "waist": swarm.Formula("y**2 + z**2 - 0.02 - 0.5*x**2 + x**4"),
        "quadric": swarm.Quadric(((1.5, 0.2, 0.0), (0.2, 2.0, 0.3), (0.0, 0.3, 3.0)), constant=-1.0),
    }[name]
    wall, rng, checked = surface.by_foot(0.0)._replace(radius=0.04), np.random.default_rng(7), 0
    pull = Vec(*np.array(gravity))
    size = 1.0 if surface.side == "outside" else 0.6
    for k in range(400):
        r, v = Vec(*rng.uniform(-size, size, 3)), Vec(*rng.uniform(-1.0, 1.0, 3))
        if not wall.phi(r) < -0.02:
            continue
        if k % 2:
            # From the wall, nearly along it
            for _ in range(3):
                r = wall.project(r)
            n = wall.unit_normal(r)
            v = v - (sum(a * b for a, b in zip(n, v, strict=True)) + 10.0 ** -float(k % 5)) * n
        time, meets = call(foot_hit.first_impact, wall, r, v, pull)
        met, until = False, 0.0
        for _pass in range(30):
            later = r + until * (v + (0.5 * until) * pull), v + until * pull
            step, met = call(march.march, wall, *later, pull)
            until += step
            if met or not until < 1e9:
                break
        expected = until if until < 1e9 else math.inf
        if not meets or not met:
            continue
        checked += 1
        if checked > 6:
            break
        assert (time == expected == math.inf) or abs(time - expected) <= 1e-9 * max(1.0, expected)
        assert math.isinf(time) or abs(wall.phi(r + time * (v + (0.5 * time) * pull))) <= 2e-15
    assert checked > 6


@pytest.mark.parametrize("slope", [1e-2, 1e-3])
def test_a_bump_is_met_before_the_floor_behind_it(slope):
    """From close above the floor Newton's method finds where the ball would come down behind the bump, at x = 2."""
    surface = swarm.Formula("0.06*exp(-20*((x-1)**2 + y**2)) - z", bounds=((-1.0, -1.0, -1.0), (3.0, 1.0, 1.0)))
    wall = surface.by_foot(0.0)._replace(radius=0.03)
    r, v = Vec(0.0, 0.0, 0.03 + 2.0 * slope), Vec(1.0, 0.0, -slope)
    time, meets = call(foot_hit.first_impact, wall, r, v, Vec(0.0, 0.0, 0.0))
    assert meets
    assert 0.5 < time < 0.8
    assert abs(call(wall.foot, r + time * v).away - 0.03) <= 1e-15
    assert all(call(wall.foot, r + share * time * v).away > 0.03 for share in np.linspace(0.0, 0.999, 50))


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_an_ellipsoid_by_its_formula_is_an_ellipsoid(side):
    """Distances and normals, as the kernels of an ellipsoid say."""
    axes, center = (0.9, 0.7, 0.8), (0.1, 0.0, 0.0)
    egg = swarm.Ellipsoid(axes, center, side).walls_of_balls(0.1)[0]
    matrix = np.diag([1.0 / one**2 for one in axes]).tolist()
    formula = swarm.Formula("(x/0.9)**2 + (y/0.7)**2 + (z/0.8)**2 - 1", center=center, side=side)
    rng, sign = np.random.default_rng(8), 1.0 if side == "inside" else -1.0
    for surface in (formula, swarm.Quadric(matrix, constant=-1.0, center=center, side=side)):
        (wall,) = surface.walls_of_balls(0.1)
        for _place in range(60):
            u = rng.normal(size=3)
            r = np.array(center) + np.array(axes) * u / math.hypot(*u) * rng.uniform(
                *((0.5, 1.0), (1.0, 1.6))[side > "j"]
            )
            expected = call(egg.foot, r)
            found = call(wall.foot, r)
            assert abs(found.away + sign * expected[0]) <= 4e-16
            assert np.array(found.normal) == pytest.approx(sign * np.array(expected[1]), abs=4e-15)


def _squares(a, b, c):
    return a * (TICKS**2)[:, None, None] + b * (TICKS**2)[:, None] + c * TICKS**2


class Size(NamedTuple):
    """Of a user-defined surface."""

    radius: float


def ball_phi(p, x, y, z):
    return x * x + y * y + z * z - p.radius * p.radius


def ball_gradient(p, x, y, z):
    return 2.0 * x, 2.0 * y, 2.0 * z


WALLS = {
    "formula": swarm.Formula("x**4 + y**4/0.5 + z**2/0.6 + 0.3*x*y - 0.6"),
    "quadric": swarm.Quadric(((1.5, 0.2, 0.0), (0.2, 2.0, 0.3), (0.0, 0.3, 3.0)), constant=-1.0),
    "sampled": wavy(rotation={"axis": (1.0, -2.0, 3.0), "angle": 0.7}),
    "own": swarm.OwnSurface(Size(0.7), ball_phi, ball_gradient, size=0.7, bounds=((-0.8,) * 3, (0.8,) * 3)),
}


# To fill what samples enclose takes three seconds: each of many points is looked at.
PLACED = swarm.Particles(
    np.array([(0.3, -0.3, 0.1, -0.1), (0.1, 0.2, -0.3, -0.1), (-0.1, 0.1, 0.2, -0.3)]),
    1.5 * np.array([(1.0, -0.8, 0.2, 0.1), (0.1, 0.3, -0.9, -0.2), (-0.2, 0.5, 0.3, 0.9)]),
    radius=0.06,
)  # fmt: skip


@pytest.mark.parametrize("gravity", [None, (0.2, 0.1, -1.0)], ids=["straight", "falling"])
@pytest.mark.parametrize("name", WALLS)
def test_balls_in_it_keep_their_energy_and_overlap_by_round_off(name, gravity):
    surface, depths = WALLS[name], []
    scene = swarm.Scene([surface], gravity=gravity)
    start = swarm.fill(scene, 6, speed=1.0, radius=0.06, seed=2) if name != "sampled" else PLACED

    def depth(frame):
        reach = surface.reaching_outside(frame.position, start.radius)
        depths.append(reach.max())
        return reach.max()

    result = swarm.simulate(
        scene, start, swarm.Impact(), until=1.2, every=0.2, seed=1, progress=False, observables={"depth": depth}
    )
    energy = result.observables["total_energy"]
    assert result.observables["impacts"][-1] > 4
    assert abs(energy / energy[0] - 1.0).max() <= 1e-12
    assert max(depths) <= 4.0 * np.finfo(float).eps


def test_balls_of_a_formula_fly_as_those_of_the_ellipsoid_that_it_is():
    """Each meets the walls at the same times."""
    axes = (0.9, 0.7, 0.8)
    ends = []
    for surface in (swarm.Ellipsoid(axes), swarm.Formula("(x/0.9)**2 + (y/0.7)**2 + (z/0.8)**2 - 1")):
        ball = swarm.Particles((0.1, -0.2, 0.3), (1.0, 0.7, -0.4), radius=0.2)
        seen = []
        swarm.simulate(
            swarm.Scene([surface]), ball, swarm.Impact(), until=4.0, every=1.0, seed=1, progress=False,
            observables={"place": lambda frame, seen=seen: seen.append(np.array(frame.position)) or 0.0},
        )  # fmt: skip
        ends.append(np.array(seen))
    assert ends[0] == pytest.approx(ends[1], abs=1e-12)


@pytest.mark.parametrize(
    ("surface", "words"),
    [
        (
            swarm.Quadric(((1.0, 0.0, 0.0), (0.0, 4.0, 0.0), (0.0, 0.0, 1.0)), constant=-1.0),
            r"radius must be below 0.25 m, the smallest radius of curvature that is certain, that at \(1, 0, 0\), of "
            r"surfaces\[0\] \(Quadric\)",
        ),
        (swarm.Paraboloid(0.1, center=(0.0, 0.0, -0.5)), r"radius must be below 0.2 m, .*at \(0, 0, -0.5\)"),
        (swarm.Formula("x**4 + y**4 + z**4 - 1"), r"radius must be below 0.25\d* m, .*use smaller balls"),
        (
            swarm.Sampled(_squares(1.0, 2.0, 1.5) - 0.25, 0.25, (-1.0,) * 3),
            r"radius must be below 0.25 m, .*at \(-?0.5, .*\), of surfaces\[0\] \(Sampled\)",
        ),
        (swarm.Quadric(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0))), r"a tip at \(0, 0, 0\)"),
    ],
    ids=["quadric", "paraboloid", "formula", "sampled", "tip"],
)
def test_a_ball_that_is_too_large_is_refused_in_a_sentence(surface, words):
    ball = swarm.Particles((0.0, 0.0, 0.2), (1.0, 0.0, 0.0), radius=0.26)
    with pytest.raises(swarm.SceneError, match=words):
        swarm.simulate(swarm.Scene([surface]), ball, swarm.Impact(), until=1.0)


@pytest.mark.parametrize("method", [swarm.Impact(), swarm.Penalty(2e-3, 2e4)], ids=["balls", "grains"])
def test_balls_and_grains_fall_on_a_floor_of_samples_that_ends_with_its_grid(method):
    """A box keeps them within the grid; the floor goes through its border."""
    x, y, z = TICKS[:, None, None], TICKS[:, None], TICKS
    floor = swarm.Sampled(0.08 * np.cos(3.0 * x) * np.cos(2.0 * y) - z - 0.4, 0.25, (-1.0,) * 3)
    position = np.array([(-0.8, 0.3, 0.85), (0.1, -0.8, 0.85), (-0.25, -0.3, -0.24)])
    start = swarm.Particles(position, np.array([(0.3, -0.2, 0.1), (0.1, 0.3, -0.2), (-1.0,) * 3]), radius=0.07)
    scene, depths = swarm.Scene([floor, swarm.Box((0.95,) * 3)], gravity=(0.0, 0.0, -1.0)), []

    def depth(frame):
        depths.append(floor.reaching_outside(frame.position, start.radius).max())
        return depths[-1]

    result = swarm.simulate(
        scene, start, method, until=0.4, every=0.04, seed=1, progress=False, observables={"depth": depth}
    )
    energy = result.observables["total_energy"]
    assert result.observables["impacts"][-1] >= 2
    assert abs(energy - energy[0]).max() <= 1e-12
    if isinstance(method, swarm.Impact):
        assert max(depths) <= 4.0 * np.finfo(float).eps
    else:
        assert 0.0 < max(depths) < 0.02
