"""What every surface must be, whatever its formula: each fact runs over the table of walls.py."""

import math
import tomllib

import mpmath as mp
import numpy as np
import pytest
import tomli_w
from conftest import EPSILON, call, chord_of, directions, gap, scales, side_of, vectors, wall_point
from exact import exact, level_along, noise, steepness, surface_size
from hypothesis import given, settings
from hypothesis import strategies as st
from walls import QUADRIC_WALLS, QUADRICS, WALLS, depths, every_wall, flights, numbers_of, start

import swarm
from swarm import tables
from swarm.kernel.vector import vec
from swarm.surfaces import ALL_SURFACES, contract
from swarm.surfaces.rotation import Rotated

unit = st.floats(0.0, 1.0, allow_subnormal=False)


# --- The level set ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("surface", "point", "phi"),
    [
        (swarm.Sphere(2.0, (1.0, 0.0, 0.0)), (1.0, 3.0, 4.0), 3.0),
        (swarm.Sphere(2.0, (1.0, 0.0, 0.0), side="outside"), (1.0, 0.0, 0.0), -2.0),
        (swarm.Ellipsoid((1.0, 2.0, 4.0), (0.0, 0.0, 1.0)), (1.0, 2.0, 5.0), 2.0),
        (swarm.Ellipsoid((1.0, 2.0, 4.0), (0.0, 0.0, 1.0), side="outside"), (0.0, 0.0, 1.0), -1.0),
        (swarm.Plane((0.0, 3.0, 4.0), 2.0), (7.0, 5.0, 5.0), 5.0),
        (swarm.Slab((0, 0, 2), 0.5, (0, 0, 1)), (7.0, 8.0, 2.0), 0.5),
        (swarm.Slab((0, 0, 2), 0.5, (0, 0, 1), "outside"), (7.0, 8.0, 0.75), -0.25),
        (swarm.Cylinder(2.0, center=(1, 0, 0)), (1.0, 4.0, 99.0), 3.0),
        (swarm.Cylinder(2.0, axis=(3, 0, 0)), (9.0, 0.0, 1.0), -0.75),
        (swarm.Cylinder(2.0, length=4.0), (0.0, 0.0, 3.0), 1.0),
        (swarm.Paraboloid(0.25, center=(0, 0, 1)), (1.0, 1.0, 2.0), 1.0),
        (swarm.Paraboloid(0.25, axis=(0, -1, 0)), (0.0, -3.0, 0.0), -3.0),
        (swarm.Cone(math.pi / 4), (1.0, 0.0, 2.0), -1.5),
        (swarm.Cone(math.pi / 4, axis=(1, 0, 0)), (-2.0, 1.0, 0.0), 2.0),
        (swarm.Quadric(((1, 2, 0), (2, 0, 0), (0, 0, 0)), (0, 0, 3), 4.0, (1, 0, 0)), (2.0, 1.0, -1.0), 6.0),
        (swarm.Box((1.0, 2.0, 3.0)), (0.5, 0.0, 0.0), -0.5),
        (swarm.Box((1.0, 2.0, 3.0), rotation={"axis": (0, 0, 1), "angle": math.pi / 2}), (0.0, 1.5, 0.0), 0.5),
    ],
    ids=repr,
)
def test_phi_by_hand(surface, point, phi):
    """Below 0 inside, above 0 outside, whichever side is admissible."""
    turned = any(isinstance(wall, Rotated) for wall in surface.walls())
    assert surface.phi(np.array(point)[:, None]) == pytest.approx([phi], abs=4e-15 if turned else 1e-15)


# Made of several walls: test_bodies.py.
ELSEWHERE = {"box", "cone"}


def test_the_table_holds_every_surface():
    here = {type(make()) for make in WALLS.values()}
    assert here == {kind for name, kind in ALL_SURFACES.items() if name not in ELSEWHERE}


@every_wall
def test_arrays_agree_with_points(name):
    """`phi` and `gradient` of the description take (3, N); kernels take one point."""
    points = np.random.default_rng(1).normal(size=(3, 7))
    surface, numbers = WALLS[name](), numbers_of(name)
    phi, gradient = surface.phi(points), surface.gradient(points)
    assert phi.shape == (7,)
    assert gradient.shape == (3, 7)
    for k in range(7):
        assert phi[k] == pytest.approx(call(contract.phi, numbers, points[:, k]), rel=1e-14)
        assert gradient[:, k] == pytest.approx(call(contract.gradient, numbers, points[:, k]), rel=1e-14)


@every_wall
@given(point=directions, scale=scales)
def test_gradient_is_the_slope_of_phi(name, point, scale):
    surface, point = numbers_of(name, scale), scale * point
    gradient = call(contract.gradient, surface, point)
    for axis, slope in enumerate(gradient):
        step = np.eye(3)[axis] * 1e-5 * scale
        rise = call(contract.phi, surface, point + step) - call(contract.phi, surface, point - step)
        assert rise / (2e-5 * scale) == pytest.approx(slope, abs=1e-6 * np.linalg.norm(gradient))
    if name in QUADRIC_WALLS:
        normal = side_of(surface) * np.array(gradient) / np.linalg.norm(gradient)
        assert call(contract.unit_normal, surface, point) == pytest.approx(normal, abs=1e-14)


@every_wall
@given(point=directions, scale=scales)
def test_normal_is_a_unit_vector_out_of_the_admissible_side(name, point, scale):
    surface = numbers_of(name, scale)
    point = wall_point(surface, scale * point)
    normal = np.array(call(contract.unit_normal, surface, point))
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=8 * EPSILON)
    assert gap(surface, point - 1e-6 * scale * normal) < 0.0 < gap(surface, point + 1e-6 * scale * normal)
    gradient = np.array(call(contract.gradient, surface, point))
    side = side_of(surface)
    assert normal == pytest.approx(side * gradient / np.linalg.norm(gradient), abs=8 * EPSILON)


@every_wall
@given(point=directions, scale=scales)
def test_level_and_phi_have_the_sign_of_the_gap(name, point, scale):
    surface, point = numbers_of(name, scale), scale * point
    side = side_of(surface)
    q = call(contract.inner, surface, point)
    g = gap(surface, point)
    assert side * call(contract.phi, surface, point) == pytest.approx(g, rel=1e-12, abs=1e-15 * scale)
    if abs(g) > 1e-14 * scale:
        assert np.sign(call(contract.level_of, surface, q)) == np.sign(g)


@every_wall
@given(point=directions, scale=scales, off=st.floats(-1e-7, 1e-7))
def test_settle_moves_a_near_point_onto_the_surface(name, point, scale, off):
    surface = numbers_of(name, scale)
    wall = wall_point(surface, scale * point)
    near = wall + off * scale * np.array(call(contract.unit_normal, surface, wall))
    settled = np.array(call(contract.settle, surface, near))
    slope = np.linalg.norm(call(contract.gradient, surface, wall))
    assert abs(gap(surface, settled)) <= slope * scale * (20 * EPSILON + 10 * off**2)
    assert np.linalg.norm(settled - near) <= 1.001 * abs(off) * scale + 20 * EPSILON * scale


# --- Flight ----------------------------------------------------------------------------------------------


def check_hit(surface, position, velocity, pull, time, found, horizon):
    """Nothing outside before the hit; at a hit that is found, on the wall and on the way out."""
    level = level_along(surface, position, velocity, pull)
    until = min(time, horizon)
    slack = noise(surface, level, position, velocity, until, pull)
    outside_at_start = max(level(mp.mpf(0)), 0)
    assert time >= 0.0
    if time > horizon:
        # A flight that only touches may count as a miss.
        assert level.highest(horizon) <= 1e3 * slack + outside_at_start
        return
    assert level.highest(time) <= slack + outside_at_start
    if not found:
        return
    now = mp.mpf(float(time))
    slope, bend = level.slope(now), max(abs(level.slope(stop, 2)) for stop in (mp.mpf(0), now))
    steep = steepness(surface, position, velocity, until, pull)
    graze = 4 * mp.sqrt(bend * (slack + outside_at_start)) + 16 * EPSILON * (steep + bend * now)
    crossing = max(time, min(horizon, surface_size(surface) / np.linalg.norm(velocity)))
    if abs(level(now)) > slack + outside_at_start:
        assert min((abs(root - now) for root in level.exits()), default=mp.inf) <= 1e-12 * crossing
    assert slope >= -graze
    if slope > 100 * graze and time > 0.0 and outside_at_start == 0:
        root = min(level.exits(), key=lambda root: abs(root - now), default=mp.inf)
        assert abs(root - now) <= 2 * slack / slope + 1e-12 * crossing * bool(any(pull))


@every_wall
@settings(max_examples=100)
@given(**flights)
def test_first_hit_is_the_exact_first_root(name, point, direction, depth, lean, scale, speed):
    """Against the exact polynomial."""
    surface, position, velocity = start(name, point, direction, depth, lean, scale, speed)
    horizon = 1e3 * scale / np.linalg.norm(velocity)
    for _ask in range(1 if name in QUADRICS else 100):
        time, found = call(contract.first_hit, surface, position, velocity)
        check_hit(surface, position, velocity, np.zeros(3), time, found, horizon)
        if found:
            return
        position = position + time * velocity
    raise AssertionError("not found")


@every_wall
@given(**flights, pull=vectors, heavy=st.sampled_from([1e-6, 1.0, 1e3]))
def test_falling_hits_lead_to_the_exact_first_root(name, point, direction, depth, lean, scale, speed, pull, heavy):
    """Asked again from where the last answer ended: never past the exit, and there in the end."""
    surface, position, velocity = start(name, point, direction, depth, lean, scale, speed)
    pull = heavy * speed * speed * scale * (pull + 1e-3)
    # Until it has fallen several sizes: the further it falls the shorter are the steps of a quartic.
    left, asked = 5.0 / (speed * max(1.0, math.sqrt(heavy))), 0
    while left > 0.0:
        time, found = call(contract.falling_hit, surface, position, velocity, pull)
        check_hit(surface, position, velocity, pull, time, found, left)
        if found:
            return
        assert time > 0.0
        position, velocity = position + time * velocity + 0.5 * time * time * pull, velocity + time * pull
        left, asked = left - time, asked + 1
        assert asked < 500


@every_wall
@pytest.mark.parametrize("depth", [0.0, 2e-16, -2e-16])
def test_falling_from_the_wall_the_direction_decides(name, depth):
    """Outward: now. Inward: not now. Resting: now where gravity presses, not now where it pulls off the wall."""
    surface, position, velocity = start(name, np.array([0.3, 0.5, -0.4]), np.array([1.0, 0, 0]), depth, 0.6, 1.0, 1.0)
    normal = np.array(call(contract.unit_normal, surface, position))
    for pull in (0.1 * normal, -0.1 * normal):
        time, found = call(contract.falling_hit, surface, position, velocity, pull)
        assert found
        assert time <= 1e-15
        assert call(contract.falling_hit, surface, position, -velocity, pull)[0] > 0.1


@every_wall
def test_at_rest_on_the_wall_gravity_decides(name):
    """It presses: a hit now, up to the fall through round-off. It pulls off the wall: no hit."""
    surface, position, _ = start(name, np.array([0.3, 0.5, -0.4]), np.array([1.0, 0, 0]), 0.0, 0.6, 1.0, 1.0)
    normal, at_rest = np.array(call(contract.unit_normal, surface, position)), np.zeros(3)
    position = np.array(call(contract.settle, surface, position))
    time, found = call(contract.falling_hit, surface, position, at_rest, normal)
    assert found
    assert time <= 1e-7
    assert call(contract.falling_hit, surface, position, at_rest, -normal)[0] > 0.1


@every_wall
@pytest.mark.parametrize("off", [-1e-6, -1e-12, 0.0, 1e-12, 1e-6])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_parabola_that_just_touches(name, off, scale):
    """Double roots, missed or crossed by a little: no hit is skipped, and none is made up."""
    surface = numbers_of(name, scale)
    wall = wall_point(surface, scale * np.array([0.3, 0.5, -0.4]))
    normal = np.array(call(contract.unit_normal, surface, wall))
    along = np.cross(normal, [0.3, -0.2, 0.5])
    along /= np.linalg.norm(along)
    # Thrown up along the wall: at its summit the parabola is `off` outside, and more curved than any wall.
    pull = -40.0 * scale * normal
    summit, flying = wall + off * scale * normal, 0.05
    position, velocity = summit + 0.5 * flying**2 * pull - flying * scale * along, scale * along - flying * pull
    left, hit = 2.0 * flying, False
    while left > 0.0 and not hit:
        time, found = call(contract.falling_hit, surface, position, velocity, pull)
        check_hit(surface, position, velocity, pull, time, found, left)
        assert time > 0.0
        hit, left = found and time <= left, left - time
        if left < 0.0:
            break
        position, velocity = position + time * velocity + 0.5 * time * time * pull, velocity + time * pull
    if off != 0.0:
        assert hit == (off > 0.0)


@every_wall
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("speed", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("depth", [1e-9, 1e-3, 0.1])
def test_head_on_the_hit_is_at_depth_over_speed(name, scale, speed, depth):
    """No absolute threshold anywhere: the same flight at every scale and speed."""
    point, direction = np.array([0.3, 0.5, -0.4]), np.array([1.0, 0.0, 0.0])
    surface, position, velocity = start(name, point, direction, depth, 1.0, scale, speed)
    time, found = call(contract.first_hit, surface, position, velocity)
    assert found
    assert time * speed == pytest.approx(depth, rel=1e-12, abs=1e-15)
    sideways = start(name, point, direction, depth, 0.0, scale, speed)[2]
    grazing, _found = call(contract.first_hit, surface, position, 1e-4 * velocity + sideways)
    assert grazing * speed >= 0.9 * depth


@every_wall
@given(point=directions, depth=depths)
def test_at_rest_there_is_no_hit(name, point, depth):
    surface, position, _ = start(name, point, point, depth, 0.0, 1.0, 1.0)
    assert call(contract.first_hit, surface, position, np.zeros(3)) == (math.inf, True)
    assert call(contract.falling_hit, surface, position, np.zeros(3), np.zeros(3))[0] == math.inf


@every_wall
@pytest.mark.parametrize("depth", [0.0, 2e-16, -2e-16])
def test_from_the_wall_the_direction_decides(name, depth):
    """Outward: now. Inward: not now, and not an instant after."""
    surface, position, velocity = start(name, np.array([0.3, 0.5, -0.4]), np.array([1.0, 0, 0]), depth, 0.6, 1.0, 1.0)
    time, found = call(contract.first_hit, surface, position, velocity)
    assert found
    assert time <= 1e-15
    assert call(contract.first_hit, surface, position, -velocity)[0] > 0.1


@every_wall
@given(**flights, pull=vectors, heavy=st.sampled_from([1e-6, 1.0, 1e3]))
def test_safe_time_is_never_past_the_exit(name, point, direction, depth, lean, scale, speed, pull, heavy):
    surface, position, velocity = start(name, point, direction, depth, lean, scale, speed)
    pull = heavy * speed * speed * scale * (pull + 1e-3)
    time = call(contract.safe_time, surface, position, velocity, pull)
    level = level_along(surface, position, velocity, pull)
    assert time >= 0.0
    if time == math.inf:
        horizon = 1e3 / (speed * math.sqrt(heavy))
        assert level.highest(horizon) <= noise(surface, level, position, velocity)
    elif time > 0.0:
        slack = noise(surface, level, position, velocity, time, pull)
        assert level.highest(time) <= slack
        assert all(level(mp.mpf(float(time)) * k / 20) <= slack for k in range(21))
    if depth >= 1e-3:
        assert time > 0.0


@every_wall
@settings(max_examples=10)
@given(point=directions, direction=directions, pull=directions, lean=st.floats(0.3, 1.0))
def test_safe_times_lead_to_the_exit(name, point, direction, pull, lean):
    """The same as the exact root, after a few dozen safe steps."""
    surface, position, velocity = start(name, point, direction, 0.2, lean, 1.0, 1.0)
    level = level_along(surface, position, velocity, pull)
    exits = [root for root in level.exits() if root > 0 and level.slope(root) > mp.mpf("0.05")]
    leaves = [root for root in exits if level.highest(root * (1 - mp.mpf(10) ** -12)) < 0]
    time = 0.0
    for _ in range(60):
        if time == math.inf:
            break
        now = position + velocity * time + 0.5 * pull * time * time
        time += call(contract.safe_time, surface, now, velocity + pull * time, pull)
    assert time == pytest.approx(float(leaves[0]), rel=1e-12) if leaves else time > 0.0


# --- Contact ---------------------------------------------------------------------------------------------


@every_wall
@given(first=directions, second=directions, scale=scales)
def test_inner_gradient_is_a_discrete_gradient(name, first, second, scale):
    """D.(r1 - r0) = q1 - q0."""
    surface, first, second = numbers_of(name, scale), scale * first, scale * second
    discrete = call(contract.inner_gradient, surface, first, second)
    start, end = exact(first), exact(second)
    rise = contract.inner(surface, vec(end)) - contract.inner(surface, vec(start))
    slope = np.linalg.norm(call(contract.inner_gradient, surface, first, first)) + np.linalg.norm(discrete)
    assert abs(exact(discrete) @ (end - start) - rise) <= 16 * EPSILON * slope * scale


@every_wall
@given(first=directions, second=directions, scale=scales)
def test_gap_slope_is_the_divided_difference_of_the_gap(name, first, second, scale):
    surface = numbers_of(name, scale)
    q0, q1 = (call(contract.inner, surface, scale * point) for point in (first, second))
    g0, g1 = call(contract.gap_of, surface, q0), call(contract.gap_of, surface, q1)
    slope, curvature = call(contract.gap_slope, surface, q0, q1)
    round_off = 4 * EPSILON * (abs(g0) + abs(g1) + abs(contract.gap_of(surface, 0.0)))
    assert slope * (q1 - q0) == pytest.approx(g1 - g0, rel=4 * EPSILON, abs=round_off)
    step = 1e-5 * abs(q1)
    rise = call(contract.gap_slope, surface, q0, q1 + step)[0] - call(contract.gap_slope, surface, q0, q1 - step)[0]
    assert rise / (2.0 * step) == pytest.approx(curvature, rel=1e-7, abs=1e-9 * abs(slope / q1))


@every_wall
@given(point=directions, scale=scales, near=st.sampled_from([0.0, 1e-15, -1e-12, 1e-9]))
def test_chain_rule_of_gap_and_inner(name, point, scale, near):
    """g[q, q] grad q = grad g, and no cancellation where q1 is next to q0."""
    surface, point = numbers_of(name, scale), scale * point
    q = call(contract.inner, surface, point)
    slope, _ = call(contract.gap_slope, surface, q, q * (1.0 + near))
    gradient = side_of(surface) * np.array(call(contract.gradient, surface, point))
    chained = slope * np.array(call(contract.inner_gradient, surface, point, point))
    assert chained == pytest.approx(gradient, abs=(abs(near) + 16 * EPSILON) * np.linalg.norm(gradient))


# A push of up to a third of the size either way.
pushes = {"point": directions, "free": vectors, "strength": st.floats(-1.0, 1.0), "scale": scales}


def pushed_step(name, point, free, strength, scale):
    # What is found by iteration is found in the direction in which the surface pushes.
    strength = strength if name in QUADRICS else math.copysign(strength, contract.farthest_push(numbers_of(name)))
    surface, point = numbers_of(name, scale), scale * point
    slope = np.linalg.norm(call(contract.inner_gradient, surface, point, point))
    return surface, point, 0.5 * scale * free, 0.2 * strength * scale / slope


@every_wall
@given(**pushes)
def test_push_solves_its_equation(name, point, free, strength, scale):
    """r1 = r0 + p - kappa D(r0, r1)."""
    surface, point, free, kappa = pushed_step(name, point, free, strength, scale)
    end = np.array(call(contract.push, surface, point, free, kappa))
    discrete = np.array(call(contract.inner_gradient, surface, point, end))
    assert end == pytest.approx(point + free - kappa * discrete, abs=16 * EPSILON * scale)


@every_wall
@given(**pushes)
def test_rise_is_the_inner_function_of_push(name, point, free, strength, scale):
    """q1 - q0 = D.(r1 - r0), whose error is relative to D.p and not to q."""
    surface, point, free, kappa = pushed_step(name, point, free, strength, scale)
    rise, slope = call(contract.rise, surface, point, free, kappa)
    end = np.array(call(contract.push, surface, point, free, kappa))
    steep = np.linalg.norm(call(contract.inner_gradient, surface, end, end))
    q0, q1 = call(contract.inner, surface, point), call(contract.inner, surface, end)
    assert rise == pytest.approx(q1 - q0, abs=32 * EPSILON * (abs(q0) + abs(q1) + steep * scale))
    discrete = np.array(call(contract.inner_gradient, surface, point, end))
    terms = abs(discrete) @ abs(free) + abs(kappa) * discrete @ discrete
    # The end has the round-off of its coordinates, by which D tilts.
    tilted = 64 * EPSILON * scale * np.abs(discrete).max() if name in QUADRIC_WALLS else 0.0
    assert abs(rise - discrete @ (free - kappa * discrete)) <= 32 * EPSILON * terms + tilted
    if name not in QUADRICS:
        return  # there the derivative is that of a D that does not turn
    step = 1e-6 * scale / steep
    change = call(contract.rise, surface, point, free, kappa + step)[0]
    change -= call(contract.rise, surface, point, free, kappa - step)[0]
    assert change / (2.0 * step) == pytest.approx(slope, rel=1e-6, abs=1e-6 * steep * steep)


@every_wall
@given(point=directions, direction=directions, length=st.floats(1e-9, 1.0), scale=scales)
def test_chord_normal_reflects_along_a_chord(name, point, direction, length, scale):
    """From the wall a step with the mean of the old and the reflected velocity ends on the wall; |v| is kept."""
    surface = numbers_of(name, scale)
    wall = wall_point(surface, scale * point)
    size = min(WALLS[name](scale).size(), scale)
    # Newton's method finds the chord of a step that is well below the size, a chord into the depth least of all.
    size *= 0.6 if name in QUADRICS else 0.3
    free = length * size * direction / np.linalg.norm(direction)
    normal = np.array(call(contract.chord_normal, surface, wall, free, chord_of(surface, wall, free)))
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=8 * EPSILON)
    reflected = free - 2.0 * (free @ normal) * normal
    assert np.linalg.norm(reflected) == pytest.approx(np.linalg.norm(free), rel=8 * EPSILON)
    end = wall + 0.5 * (free + reflected)
    slope = np.linalg.norm(call(contract.gradient, surface, wall))
    # Where the chord crosses the end of a capsule's cylinder, H jumps and the iteration only creeps.
    round_off = 64 * EPSILON if name not in ("capsule", "rod") else 1e-12
    assert abs(call(contract.phi, surface, end)) <= round_off * slope * scale


@every_wall
@given(point=directions, scale=scales)
def test_chord_of_no_length_has_the_normal_of_the_wall(name, point, scale):
    surface = numbers_of(name, scale)
    wall = wall_point(surface, scale * point)
    chord = call(contract.chord_normal, surface, wall, np.zeros(3), 0.0)
    assert chord == pytest.approx(call(contract.unit_normal, surface, wall), abs=16 * EPSILON)


# --- Descriptions ----------------------------------------------------------------------------------------


def test_a_normal_of_any_length_is_scaled_to_one():
    for length in (1e-320, 1e-200, 1.0, 1.7e308):
        assert swarm.Plane((length, 0.0, -length)).normal == pytest.approx((0.5**0.5, 0.0, -(0.5**0.5)), rel=1e-3)


ONE = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


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
        (lambda: swarm.Plane((0.0, 0.0, 0.0)), ["normal", "length 0"]),
        (lambda: swarm.Plane((0.0, 0.0, 1.0), offset=math.nan), ["offset", "finite", "nan"]),
        (lambda: swarm.Sphere(1.0).phi(np.zeros((2, 3))), ["points", "(3, N)", "(2, 3)"]),
        (lambda: swarm.Sphere(1.0).phi("abc"), ["points", "array of numbers", "got str"]),
        (lambda: swarm.Plane((0, 0, 1)).gradient(np.zeros((5, 3))), ["points", "(3, N)", "(5, 3)"]),
        (lambda: swarm.Torus(1.0, 1.0), ["minor_radius", "below major_radius = 1", "got 1"]),
        (lambda: swarm.Torus(0.0, 1.0), ["major_radius", "above 0", "got 0"]),
        (lambda: swarm.Torus(1.0, 0.5, side="in"), ["side", "did you mean 'inside'?"]),
        (
            lambda: swarm.Quadric(((1, 2, 0), (3, 1, 0), (0, 0, 1))),
            ["matrix must be symmetric", "matrix[0][1] = 2", "matrix[1][0] = 3"],
        ),
        (lambda: swarm.Quadric(((1, 0, 0), (0, 1, 0))), ["matrix", "three rows"]),
        (lambda: swarm.Quadric(1.0), ["matrix", "three rows", "1.0"]),
        (lambda: swarm.Quadric(((1, 0, 0), (0, math.nan, 0), (0, 0, 1))), ["matrix[1][1]", "finite", "nan"]),
        (lambda: swarm.Quadric(np.zeros((3, 3))), ["matrix", "all 0", "vector"]),
        (lambda: swarm.Quadric(ONE, vector=(0, math.inf, 0)), ["vector[1]", "finite"]),
        (lambda: swarm.Quadric(ONE, constant="x"), ["constant", "finite number"]),
        (lambda: swarm.Quadric(ONE, constant=1.0), ["constant", "same sign", "got 1"]),
        (lambda: swarm.Quadric(np.diag([1, 0, 0])), ["constant", "same sign", "got 0"]),
        (lambda: swarm.Quadric(ONE, constant=-1, side="in"), ["side", "did you mean 'inside'?"]),
        (lambda: swarm.Slab((0, 0, 0), 1.0), ["normal", "length 0"]),
        (lambda: swarm.Slab((0, 0, 1), -1.0), ["half_width", "above 0", "got -1"]),
        (lambda: swarm.Cylinder(0.0), ["radius", "above 0", "got 0"]),
        (lambda: swarm.Cylinder(1.0, length=0.0), ["length", "above 0", "got 0"]),
        (lambda: swarm.Cylinder(1.0, axis=(0, 0, 0)), ["axis", "length 0"]),
        (lambda: swarm.Cone(0.0), ["half_angle", "between 0 and pi/2", "got 0"]),
        (lambda: swarm.Cone(math.pi / 2), ["half_angle", "between 0 and pi/2", "got 1.5708"]),
        (lambda: swarm.Paraboloid(-0.5), ["focal_length", "above 0", "got -0.5"]),
        (lambda: swarm.Box((1.0, 0.0, 1.0)), ["half_widths[1]", "above 0", "got 0"]),
        (lambda: swarm.Box((1.0, 1.0)), ["half_widths", "three numbers", "got 2"]),
        (lambda: swarm.Box((1, 1, 1), open=["+w"]), ["open[0]", "'+x'", "got '+w'"]),
        (lambda: swarm.Box((1, 1, 1), open=["+x", "-y", "+x"]), ["open", "'+x' twice"]),
        (lambda: swarm.Box((1, 1, 1), open="+x"), ["open", "list of faces", "'+x'"]),
        (lambda: swarm.Box((1, 1, 1), open=["-x", "+x", "-y", "+y", "-z", "+z"]), ["open", "all six"]),
        (lambda: swarm.Box((1, 1, 1), side="outside", open=["+x"]), ["open", "outside", "['+x']"]),
    ],
)
def test_errors_name_the_argument(build, parts):
    with pytest.raises(swarm.SceneError) as caught:
        build()
    assert all(part in str(caught.value) for part in parts), str(caught.value)


@every_wall
def test_bounds_hold_the_admissible_side(name):
    """Random points, those of the admissible side all in the box; a solid and a plane bound nothing."""
    points = np.random.default_rng(2).uniform(-2.0, 2.0, (3, 4000))
    surface = WALLS[name]()
    side = side_of(numbers_of(name))
    low, high = (np.array(corner)[:, None] for corner in surface.bounds())
    admissible = points[:, side * surface.phi(points) <= 0.0]
    assert admissible.shape[1] > 10
    assert ((admissible >= low) & (admissible <= high)).all()
    bounded = "egg" in name if name in QUADRIC_WALLS else side > 0.0 and name != "plane"
    assert np.isfinite(high - low).all() == bounded
    assert np.isfinite(surface.size()) == (name not in {"plane", "nappes", "wall"})
    assert np.isfinite(surface.extent())


# --- The same surface again ------------------------------------------------------------------------------

TURNED = {
    "plane": lambda n, **turn: swarm.Plane(n, 0.3, **turn),
    "slab": lambda n, **turn: swarm.Slab(n, 0.3, n, **turn),
    "cylinder": lambda n, **turn: swarm.Cylinder(0.3, n, 0.7, **turn),
    "cone": lambda n, **turn: swarm.Cone(0.3, n, **turn),
    "paraboloid": lambda n, **turn: swarm.Paraboloid(0.3, n, **turn),
    "capsule": lambda n, **turn: swarm.Capsule(0.3, 0.4, n, side="outside", **turn),
    "box": lambda n, **turn: swarm.Box((0.3, 0.4, 0.5), n, restitution=0.5, **turn),
    "quadric": lambda n, **turn: swarm.Quadric(np.diag((1.0, 2.0, -1.0)), n, -0.25, **turn),
    "formula": lambda n, **turn: swarm.Formula(
        "(x/a)**2 + y**2 + z**4 - b", parameters={"a": 0.5, "b": 1.5}, bounds=((-2,) * 3, (2,) * 3), center=n, **turn
    ),
    "sphere": lambda n, **turn: swarm.Sphere(0.3, n, **turn),
    "ellipsoid": lambda n, **turn: swarm.Ellipsoid((0.3, 0.4, 0.5), n, **turn),
    "torus": lambda n, **turn: swarm.Torus(0.7, 0.3, n, **turn),
}


def is_made_again(surface):
    table = tomllib.loads(tomli_w.dumps({"surface": [tables.table_of(surface)]}))
    (read,) = tables.scene_of(table["surface"], None).surfaces
    for again in (eval(repr(surface), vars(swarm)), read):
        assert again == surface
        assert hash(again) == hash(surface)
        assert [wall[1:] for wall in again.walls()] == [wall[1:] for wall in surface.walls()]


@every_wall
def test_a_surface_is_made_again_by_its_repr_and_by_its_table(name):
    is_made_again(WALLS[name]())


@pytest.mark.parametrize("name", TURNED)
@given(direction=directions, axis=directions, angle=st.floats(-7.0, 7.0))
def test_a_turned_surface_is_made_again(name, direction, axis, angle):
    direction, axis = (tuple(part.tolist()) for part in (direction, axis))
    is_made_again(TURNED[name](direction, rotation={"axis": axis, "angle": angle}))
    is_made_again(TURNED[name](direction, rotation=(angle, *axis)))
    is_made_again(TURNED[name](direction))


def test_every_kind_is_made_again():
    assert set(TURNED) == set(ALL_SURFACES)


@pytest.mark.parametrize("size", [1e-300, 1e-3, 3.0, 1e300])
@given(direction=directions)
def test_a_normal_of_any_length_is_scaled_to_1_once(size, direction):
    """By the largest part first, then by the length of what is left."""
    given_ = tuple((size * direction).tolist())
    largest = max(map(abs, given_))
    scaled = [part / largest for part in given_]
    expected = tuple(part / math.hypot(*scaled) for part in scaled)
    normal = swarm.Plane(given_).normal
    assert normal == expected
    assert swarm.Plane(normal).normal == normal
