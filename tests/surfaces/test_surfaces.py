"""What every surface must be, whatever its formula: each fact runs over the table of conftest.py."""

import functools
import itertools
import math

import mpmath as mp
import numpy as np
import pytest
from conftest import (
    EPSILON,
    QUADRICS,
    SURFACES,
    call,
    chord_of,
    directions,
    every_quadric,
    every_surface,
    gap,
    numbers_of,
    scales,
    vectors,
    wall_point,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

import swarm
from swarm.surfaces import ALL_SURFACES, base

mp.mp.dps = 50

unit = st.floats(0.0, 1.0, allow_subnormal=False)


def exact(*vectors):
    """The same doubles with 50 digits, as an array."""
    return np.array([mp.mpf(float(part)) for vector in vectors for part in vector], dtype=object)


def level_along(surface, position, velocity, acceleration=(0.0, 0.0, 0.0)):
    """The level along a flight as an exact polynomial of time: the surface's own formula, on polynomials."""
    halves = exact(acceleration) / 2
    flight = [Polynomial(np.array(axis)) for axis in zip(exact(position), exact(velocity), halves, strict=True)]
    return base.level_of(surface, base.inner(surface, *flight))


def noise(surface, level, position, velocity, time=0.0):
    """The round-off of the level at a time of a flight: a few units in the last place of its largest terms."""
    slope = np.linalg.norm(call(base.inner_gradient, surface, position, position))
    terms = abs(call(base.inner, surface, position)) + abs(base.level_of(surface, 0.0))
    terms += slope * (np.linalg.norm(position) + np.linalg.norm(velocity) * time)
    return 16 * EPSILON * (terms + sum(abs(part) * mp.mpf(float(time)) ** k for k, part in enumerate(level.coef) if k))


def real_roots(polynomial):
    """Real roots of a polynomial to 40 digits, sorted: between its turning points, by bisection."""
    coefficients = list(polynomial.coef)
    while coefficients and abs(coefficients[-1]) <= mp.mpf(10) ** -45 * max(map(abs, polynomial.coef)):
        coefficients.pop()
    if len(coefficients) < 2:
        return []

    def value(t):
        return functools.reduce(lambda sum_, part: sum_ * t + part, coefficients[::-1])

    far = 1 + max(abs(part / coefficients[-1]) for part in coefficients)
    stops = [-far, *real_roots(Polynomial(np.array(coefficients)).deriv()), far]
    roots = []
    for low, high in itertools.pairwise(stops):
        if (value(low) > 0) == (value(high) > 0):
            continue
        while high - low > mp.mpf(10) ** -40 * max(abs(low), abs(high)) and high - low > mp.mpf(10) ** -60:
            middle = (low + high) / 2
            low, high = (low, middle) if (value(low) > 0) != (value(middle) > 0) else (middle, high)
        roots.append((low + high) / 2)
    return roots


def highest(level, end):
    """The largest value of a polynomial on [0, end]."""
    stops = [mp.mpf(0), mp.mpf(end), *(root for root in real_roots(level.deriv()) if 0 < root < end)]
    return max(level(stop) for stop in stops)


# --- The level set ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("surface", "point", "phi"),
    [
        (swarm.Sphere(2.0, (1.0, 0.0, 0.0)), (1.0, 3.0, 4.0), 3.0),
        (swarm.Sphere(2.0, (1.0, 0.0, 0.0), side="outside"), (1.0, 0.0, 0.0), -2.0),
        (swarm.Ellipsoid((1.0, 2.0, 4.0), (0.0, 0.0, 1.0)), (1.0, 2.0, 5.0), 2.0),
        (swarm.Ellipsoid((1.0, 2.0, 4.0), (0.0, 0.0, 1.0), side="outside"), (0.0, 0.0, 1.0), -1.0),
        (swarm.Plane((0.0, 3.0, 4.0), 2.0), (7.0, 5.0, 5.0), 5.0),
    ],
    ids=repr,
)
def test_phi_by_hand(surface, point, phi):
    """Below 0 inside, above 0 outside, whichever side is admissible."""
    assert surface.phi(np.array(point)[:, None]) == pytest.approx([phi], abs=1e-15)


def test_the_table_holds_every_surface():
    assert {type(make()) for make in SURFACES.values()} == set(ALL_SURFACES.values())


@every_surface
def test_arrays_agree_with_points(name):
    """`phi` and `gradient` of the description take (3, N); kernels take one point."""
    points = np.random.default_rng(1).normal(size=(3, 7))
    surface, numbers = SURFACES[name](), numbers_of(name)
    phi, gradient = surface.phi(points), surface.gradient(points)
    assert phi.shape == (7,)
    assert gradient.shape == (3, 7)
    for k in range(7):
        assert phi[k] == pytest.approx(call(base.phi, numbers, points[:, k]), rel=1e-14)
        assert gradient[:, k] == pytest.approx(call(base.gradient, numbers, points[:, k]), rel=1e-14)


@every_surface
@given(point=directions, scale=scales)
def test_gradient_is_the_slope_of_phi(name, point, scale):
    surface, point = numbers_of(name, scale), scale * point
    gradient = call(base.gradient, surface, point)
    for axis, slope in enumerate(gradient):
        step = np.eye(3)[axis] * 1e-5 * scale
        rise = call(base.phi, surface, point + step) - call(base.phi, surface, point - step)
        assert rise / (2e-5 * scale) == pytest.approx(slope, abs=1e-4 * np.linalg.norm(gradient))


@every_surface
@given(point=directions, scale=scales)
def test_normal_is_a_unit_vector_out_of_the_admissible_side(name, point, scale):
    surface = numbers_of(name, scale)
    point = wall_point(surface, scale * point)
    normal = np.array(call(base.unit_normal, surface, point))
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=8 * EPSILON)
    assert gap(surface, point - 1e-6 * scale * normal) < 0.0 < gap(surface, point + 1e-6 * scale * normal)
    gradient = np.array(call(base.gradient, surface, point))
    side = getattr(surface, "side", 1.0)
    assert normal == pytest.approx(side * gradient / np.linalg.norm(gradient), abs=8 * EPSILON)


@every_surface
@given(point=directions, scale=scales)
def test_level_and_phi_have_the_sign_of_the_gap(name, point, scale):
    surface, point = numbers_of(name, scale), scale * point
    side = getattr(surface, "side", 1.0)
    q = call(base.inner, surface, point)
    g = gap(surface, point)
    assert side * call(base.phi, surface, point) == pytest.approx(g, rel=1e-12, abs=1e-15 * scale)
    if abs(g) > 1e-14 * scale:
        assert np.sign(call(base.level_of, surface, q)) == np.sign(g)


@every_surface
@given(point=directions, scale=scales, off=st.floats(-1e-7, 1e-7))
def test_settle_moves_a_near_point_onto_the_surface(name, point, scale, off):
    surface = numbers_of(name, scale)
    wall = wall_point(surface, scale * point)
    near = wall + off * scale * np.array(call(base.unit_normal, surface, wall))
    settled = np.array(call(base.settle, surface, near))
    slope = np.linalg.norm(call(base.gradient, surface, wall))
    assert abs(gap(surface, settled)) <= slope * scale * (20 * EPSILON + 10 * off**2)
    assert np.linalg.norm(settled - near) <= 1.001 * abs(off) * scale + 20 * EPSILON * scale


# --- Flight ----------------------------------------------------------------------------------------------

# Where a flight starts relative to the wall, in units of its size: inside, next to it, on it, an ulp or two off.
depths = st.one_of(st.floats(1e-3, 0.3), st.sampled_from([0.0, 0.0, 1e-15, -1e-15, 1e-9, 1e-12]))
# How it leaves: part of the velocity along the normal, out of the wall or into it; 0 grazes.
leans = st.one_of(st.floats(-1.0, 1.0), st.sampled_from([0.0, 1e-15, -1e-15, 1e-9, -1e-9, 1e-5, -1e-5, 1.0, -1.0]))


def start(name, point, direction, depth, lean, scale, speed):
    """A start near the wall: position, and velocity with this part along the normal."""
    surface = numbers_of(name, scale)
    wall = wall_point(surface, scale * point)
    normal = np.array(call(base.unit_normal, surface, wall))
    along = direction - (direction @ normal) * normal
    along /= max(np.linalg.norm(along), 1e-3)
    velocity = speed * scale * (lean * normal + math.sqrt(1.0 - lean * lean) * along)
    return surface, wall - depth * scale * normal, velocity


flights = {
    "point": directions,
    "direction": directions,
    "depth": depths,
    "lean": leans,
    "scale": scales,
    "speed": st.sampled_from([1e-6, 1.0, 1e6]),
}


@every_quadric
@given(**flights)
def test_first_hit_is_the_exact_first_root(name, point, direction, depth, lean, scale, speed):
    """Against the exact quadratic: nothing outside before the hit, on the wall and on the way out at it."""
    surface, position, velocity = start(name, point, direction, depth, lean, scale, speed)
    time = call(base.first_hit, surface, position, velocity)
    level = level_along(surface, position, velocity)
    slack = noise(surface, level, position, velocity, time if time < math.inf else scale / np.linalg.norm(velocity))
    outside_at_start = max(level(mp.mpf(0)), 0)
    assert time >= 0.0
    if time == math.inf:
        horizon = 1e3 * scale / np.linalg.norm(velocity)
        assert highest(level, horizon) <= 1e3 * slack + outside_at_start
        return
    assert highest(level, time) <= slack + outside_at_start
    assert abs(level(mp.mpf(float(time)))) <= slack + outside_at_start
    slope, bend = level.deriv()(mp.mpf(float(time))), abs(level.deriv(2)(mp.mpf(0)))
    steep = np.linalg.norm(call(base.inner_gradient, surface, position, position)) * np.linalg.norm(velocity)
    graze = 4 * mp.sqrt(bend * (slack + outside_at_start)) + 16 * EPSILON * (steep + bend * mp.mpf(float(time)))
    assert slope >= -graze
    if slope > 100 * graze and time > 0.0:
        root = min(real_roots(level), key=lambda root: abs(root - time))
        assert abs(root - time) <= 2 * slack / slope


@every_surface
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("speed", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("depth", [1e-9, 1e-3, 0.1])
def test_head_on_the_hit_is_at_depth_over_speed(name, scale, speed, depth):
    """No absolute threshold anywhere: the same flight at every scale and speed."""
    point, direction = np.array([0.3, 0.5, -0.4]), np.array([1.0, 0.0, 0.0])
    surface, position, velocity = start(name, point, direction, depth, 1.0, scale, speed)
    assert call(base.first_hit, surface, position, velocity) * speed == pytest.approx(depth, rel=1e-12, abs=1e-15)
    sideways = start(name, point, direction, depth, 0.0, scale, speed)[2]
    grazing = call(base.first_hit, surface, position, 1e-4 * velocity + sideways) * speed
    assert grazing >= 0.9 * depth


@every_surface
@given(point=directions, depth=depths)
def test_at_rest_there_is_no_hit(name, point, depth):
    surface, position, _ = start(name, point, point, depth, 0.0, 1.0, 1.0)
    assert call(base.first_hit, surface, position, np.zeros(3)) == math.inf


@every_surface
@pytest.mark.parametrize("depth", [0.0, 2e-16, -2e-16])
def test_from_the_wall_the_direction_decides(name, depth):
    """Outward: now. Inward: not now, and not an instant after."""
    surface, position, velocity = start(name, np.array([0.3, 0.5, -0.4]), np.array([1.0, 0, 0]), depth, 0.6, 1.0, 1.0)
    assert call(base.first_hit, surface, position, velocity) <= 1e-15
    assert call(base.first_hit, surface, position, -velocity) > 0.1


@every_quadric
@given(**flights, pull=vectors, heavy=st.sampled_from([1e-6, 1.0, 1e3]))
def test_safe_time_is_never_past_the_exit(name, point, direction, depth, lean, scale, speed, pull, heavy):
    surface, position, velocity = start(name, point, direction, depth, lean, scale, speed)
    pull = heavy * speed * speed * scale * (pull + 1e-3)
    time = call(base.safe_time, surface, position, velocity, pull)
    level = level_along(surface, position, velocity, pull)
    assert time >= 0.0
    if time == math.inf:
        assert highest(level, 1e3 / (speed * math.sqrt(heavy))) <= noise(surface, level, position, velocity)
    elif time > 0.0:
        slack = noise(surface, level, position, velocity, time)
        assert highest(level, time) <= slack
        assert all(level(mp.mpf(float(time)) * k / 20) <= slack for k in range(21))
    if depth >= 1e-3:
        assert time > 0.0


@every_quadric
@settings(max_examples=10)
@given(point=directions, direction=directions, pull=directions, lean=st.floats(0.3, 1.0))
def test_safe_times_lead_to_the_exit(name, point, direction, pull, lean):
    """The same as the exact root of the quartic, after a few dozen safe steps."""
    surface, position, velocity = start(name, point, direction, 0.2, lean, 1.0, 1.0)
    level = level_along(surface, position, velocity, pull)
    exits = [root for root in real_roots(level) if root > 0 and level.deriv()(root) > mp.mpf("0.05")]
    leaves = [root for root in exits if highest(level, root * (1 - mp.mpf(10) ** -12)) < 0]
    time = 0.0
    for _ in range(60):
        if time == math.inf:
            break
        now = position + velocity * time + 0.5 * pull * time * time
        time += call(base.safe_time, surface, now, velocity + pull * time, pull)
    assert time == pytest.approx(float(leaves[0]), rel=1e-12) if leaves else time > 0.0


# --- Contact ---------------------------------------------------------------------------------------------


@every_surface
@given(first=directions, second=directions, scale=scales)
def test_inner_gradient_is_a_discrete_gradient(name, first, second, scale):
    """D.(r1 - r0) = q1 - q0."""
    surface, first, second = numbers_of(name, scale), scale * first, scale * second
    discrete = call(base.inner_gradient, surface, first, second)
    start, end = exact(first), exact(second)
    rise = base.inner(surface, *end) - base.inner(surface, *start)
    slope = np.linalg.norm(call(base.inner_gradient, surface, first, first)) + np.linalg.norm(discrete)
    assert abs(exact(discrete) @ (end - start) - rise) <= 16 * EPSILON * slope * scale


@every_surface
@given(first=directions, second=directions, scale=scales)
def test_gap_slope_is_the_divided_difference_of_the_gap(name, first, second, scale):
    surface = numbers_of(name, scale)
    q0, q1 = (call(base.inner, surface, scale * point) for point in (first, second))
    g0, g1 = call(base.gap_of, surface, q0), call(base.gap_of, surface, q1)
    slope, curvature = call(base.gap_slope, surface, q0, q1)
    round_off = 4 * EPSILON * (abs(g0) + abs(g1) + abs(base.gap_of(surface, 0.0)))
    assert slope * (q1 - q0) == pytest.approx(g1 - g0, rel=4 * EPSILON, abs=round_off)
    step = 1e-5 * abs(q1)
    rise = call(base.gap_slope, surface, q0, q1 + step)[0] - call(base.gap_slope, surface, q0, q1 - step)[0]
    assert rise / (2.0 * step) == pytest.approx(curvature, rel=1e-7, abs=1e-9 * abs(slope / q1))


@every_surface
@given(point=directions, scale=scales, near=st.sampled_from([0.0, 1e-15, -1e-12, 1e-9]))
def test_chain_rule_of_gap_and_inner(name, point, scale, near):
    """g[q, q] grad q = grad g, and no cancellation where q1 is next to q0."""
    surface, point = numbers_of(name, scale), scale * point
    q = call(base.inner, surface, point)
    slope, _ = call(base.gap_slope, surface, q, q * (1.0 + near))
    gradient = getattr(surface, "side", 1.0) * np.array(call(base.gradient, surface, point))
    chained = slope * np.array(call(base.inner_gradient, surface, point, point))
    assert chained == pytest.approx(gradient, abs=(abs(near) + 16 * EPSILON) * np.linalg.norm(gradient))


# A push of up to a third of the size either way.
pushes = {"point": directions, "free": vectors, "strength": st.floats(-1.0, 1.0), "scale": scales}


def pushed_step(name, point, free, strength, scale):
    # What is found by iteration is found in the direction in which the surface pushes.
    strength = strength if name in QUADRICS else math.copysign(strength, base.farthest_push(numbers_of(name)))
    surface, point = numbers_of(name, scale), scale * point
    slope = np.linalg.norm(call(base.inner_gradient, surface, point, point))
    return surface, point, 0.5 * scale * free, 0.2 * strength * scale / slope


@every_surface
@given(**pushes)
def test_push_solves_its_equation(name, point, free, strength, scale):
    """r1 = r0 + p - kappa D(r0, r1)."""
    surface, point, free, kappa = pushed_step(name, point, free, strength, scale)
    end = np.array(call(base.push, surface, point, free, kappa))
    discrete = np.array(call(base.inner_gradient, surface, point, end))
    assert end == pytest.approx(point + free - kappa * discrete, abs=16 * EPSILON * scale)


@every_surface
@given(**pushes)
def test_rise_is_the_inner_function_of_push(name, point, free, strength, scale):
    """q1 - q0 = D.(r1 - r0), whose error is relative to D.p and not to q."""
    surface, point, free, kappa = pushed_step(name, point, free, strength, scale)
    rise, slope = call(base.rise, surface, point, free, kappa)
    end = np.array(call(base.push, surface, point, free, kappa))
    steep = np.linalg.norm(call(base.inner_gradient, surface, end, end))
    q0, q1 = call(base.inner, surface, point), call(base.inner, surface, end)
    assert rise == pytest.approx(q1 - q0, abs=32 * EPSILON * (abs(q0) + abs(q1) + steep * scale))
    discrete = np.array(call(base.inner_gradient, surface, point, end))
    terms = abs(discrete) @ abs(free) + abs(kappa) * discrete @ discrete
    assert abs(rise - discrete @ (free - kappa * discrete)) <= 32 * EPSILON * terms
    if name not in QUADRICS:
        return  # there the derivative is that of a D that does not turn
    step = 1e-6 * scale / steep
    change = call(base.rise, surface, point, free, kappa + step)[0]
    change -= call(base.rise, surface, point, free, kappa - step)[0]
    assert change / (2.0 * step) == pytest.approx(slope, rel=1e-6, abs=1e-6 * steep * steep)


@every_surface
@given(point=directions, direction=directions, length=st.floats(1e-9, 1.0), scale=scales)
def test_chord_normal_reflects_along_a_chord(name, point, direction, length, scale):
    """From the wall a step with the mean of the old and the reflected velocity ends on the wall; |v| is kept."""
    surface = numbers_of(name, scale)
    wall = wall_point(surface, scale * point)
    size = min(SURFACES[name](scale).size(), scale)
    # A torus is pushed by an iteration, which a step of its size need not contract.
    size *= 1.0 if name in QUADRICS else 0.3
    free = length * size * direction / np.linalg.norm(direction)
    normal = np.array(call(base.chord_normal, surface, wall, free, chord_of(surface, wall, free)))
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=8 * EPSILON)
    reflected = free - 2.0 * (free @ normal) * normal
    assert np.linalg.norm(reflected) == pytest.approx(np.linalg.norm(free), rel=8 * EPSILON)
    end = wall + 0.5 * (free + reflected)
    slope = np.linalg.norm(call(base.gradient, surface, wall))
    assert abs(call(base.phi, surface, end)) <= 64 * EPSILON * slope * scale


@every_surface
@given(point=directions, scale=scales)
def test_chord_of_no_length_has_the_normal_of_the_wall(name, point, scale):
    surface = numbers_of(name, scale)
    wall = wall_point(surface, scale * point)
    chord = call(base.chord_normal, surface, wall, np.zeros(3), 0.0)
    assert chord == pytest.approx(call(base.unit_normal, surface, wall), abs=16 * EPSILON)


# --- Descriptions ----------------------------------------------------------------------------------------


def test_a_normal_of_any_length_is_scaled_to_one():
    for length in (1e-320, 1e-200, 1.0, 1.7e308):
        assert swarm.Plane((length, 0.0, -length)).normal == pytest.approx((0.5**0.5, 0.0, -(0.5**0.5)), rel=1e-3)


@pytest.mark.parametrize(
    ("build", "parts"),
    [
        (lambda: swarm.Sphere(0.0), ["radius", "above 0", "got 0"]),
        (lambda: swarm.Sphere(-1.0), ["radius", "got -1"]),
        (lambda: swarm.Sphere(math.nan), ["radius", "finite", "nan"]),
        (lambda: swarm.Sphere(1e-200), ["radius", "between 1e-100 and 1e+100 m", "got 1e-200"]),
        (lambda: swarm.Ellipsoid((1e-170, 1.0, 1.0)), ["semi_axes[0]", "between 1e-100", "got 1e-170"]),
        (lambda: swarm.Sphere("big"), ["radius", "finite number", "'big'"]),
        (lambda: swarm.Sphere(1.0, center=(0.0, 0.0)), ["center", "three numbers", "got 2"]),
        (lambda: swarm.Sphere(1.0, center=(0.0, math.inf, 0.0)), ["center[1]", "finite", "inf"]),
        (lambda: swarm.Sphere(1.0, side="outsid"), ["side", "'inside' and 'outside'", "did you mean 'outside'?"]),
        (lambda: swarm.Ellipsoid((1.0, 0.0, 2.0)), ["semi_axes[1]", "above 0", "got 0"]),
        (lambda: swarm.Ellipsoid(1.0), ["semi_axes", "three numbers", "got 1.0"]),
        (lambda: swarm.Ellipsoid((1.0, 1.0, 1.0), side="in"), ["side", "did you mean 'inside'?"]),
        (lambda: swarm.Plane((0.0, 0.0, 0.0)), ["normal", "zero vector"]),
        (lambda: swarm.Plane((0.0, 0.0, 1.0), offset=math.nan), ["offset", "finite", "nan"]),
        (lambda: swarm.Sphere(1.0).phi(np.zeros((2, 3))), ["points", "(3, N)", "(2, 3)"]),
        (lambda: swarm.Sphere(1.0).phi("abc"), ["points", "array of numbers", "got str"]),
        (lambda: swarm.Plane((0, 0, 1)).gradient(np.zeros((5, 3))), ["points", "(3, N)", "(5, 3)"]),
    ],
)
def test_errors_name_the_argument(build, parts):
    with pytest.raises(swarm.SceneError) as caught:
        build()
    assert all(part in str(caught.value) for part in parts), str(caught.value)


@every_surface
def test_bounds_hold_the_admissible_side(name):
    """Random points, those of the admissible side all in the box; a solid and a plane bound nothing."""
    points = np.random.default_rng(2).uniform(-2.0, 2.0, (3, 4000))
    surface = SURFACES[name]()
    side = getattr(numbers_of(name), "side", 1.0)
    low, high = (np.array(corner)[:, None] for corner in surface.bounds())
    admissible = points[:, side * surface.phi(points) <= 0.0]
    assert admissible.shape[1] > 10
    assert ((admissible >= low) & (admissible <= high)).all()
    assert np.isfinite(high - low).all() == (name in {"sphere", "ellipsoid", "torus"})
    assert np.isfinite(surface.size()) == (name != "plane")
