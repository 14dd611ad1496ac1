"""The level set of every surface, and its steps in contact: each fact runs over the table of conftest.py."""

import math

import mpmath as mp
import numpy as np
import pytest
from conftest import (
    EPSILON,
    ITERATED,
    QUADRIC_WALLS,
    WALLS,
    call,
    chord_of,
    directions,
    every_wall,
    gap,
    numbers_of,
    scales,
    side_of,
    surface_of,
    vectors,
    wall_point,
)
from hypothesis import assume, given
from hypothesis import strategies as st

import swarm
from swarm.kernel.vector import vec
from swarm.surfaces.rotation import Rotated

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


@every_wall
def test_arrays_agree_with_points(name):
    """`phi` and `gradient` of the description take (3, N); kernels take one point."""
    points = np.random.default_rng(1).normal(size=(3, 7))
    surface, numbers = surface_of(name), numbers_of(name)
    phi, gradient = surface.phi(points), surface.gradient(points)
    assert phi.shape == (7,)
    assert gradient.shape == (3, 7)
    for k in range(7):
        assert phi[k] == pytest.approx(call(numbers.phi, points[:, k]), rel=1e-14)
        assert gradient[:, k] == pytest.approx(call(numbers.gradient, points[:, k]), rel=1e-14)


@every_wall
@given(point=directions, scale=scales)
def test_gradient_is_the_slope_of_phi(name, point, scale):
    surface, point = numbers_of(name, scale), scale * point
    gradient = call(surface.gradient, point)
    for axis, slope in enumerate(gradient):
        step = np.eye(3)[axis] * 1e-5 * scale
        rise = call(surface.phi, point + step) - call(surface.phi, point - step)
        assert rise / (2e-5 * scale) == pytest.approx(slope, abs=1e-6 * np.linalg.norm(gradient))
    if name in QUADRIC_WALLS:
        normal = side_of(surface) * np.array(gradient) / np.linalg.norm(gradient)
        assert call(surface.unit_normal, point) == pytest.approx(normal, abs=1e-14)


@every_wall
@given(point=directions, scale=scales)
def test_normal_is_a_unit_vector_out_of_the_admissible_side(name, point, scale):
    surface = numbers_of(name, scale)
    point = wall_point(surface, scale * point)
    normal = np.array(call(surface.unit_normal, point))
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=8 * EPSILON)
    assert gap(surface, point - 1e-6 * scale * normal) < 0.0 < gap(surface, point + 1e-6 * scale * normal)
    gradient = np.array(call(surface.gradient, point))
    side = side_of(surface)
    assert normal == pytest.approx(side * gradient / np.linalg.norm(gradient), abs=8 * EPSILON)


@every_wall
@given(point=directions, scale=scales)
def test_level_and_phi_have_the_sign_of_the_gap(name, point, scale):
    surface, point = numbers_of(name, scale), scale * point
    side = side_of(surface)
    q = call(surface.inner, point)
    g = gap(surface, point)
    assert side * call(surface.phi, point) == pytest.approx(g, rel=1e-12, abs=1e-15 * scale)
    if abs(g) > 1e-14 * scale:
        assert np.sign(call(surface.level_of, q)) == np.sign(g)


@every_wall
@given(point=directions, scale=scales, off=st.floats(-1e-7, 1e-7))
def test_settle_moves_a_near_point_onto_the_surface(name, point, scale, off):
    surface = numbers_of(name, scale)
    wall = wall_point(surface, scale * point)
    near = wall + off * scale * np.array(call(surface.unit_normal, wall))
    settled = np.array(call(surface.project, near))
    slope = np.linalg.norm(call(surface.gradient, wall))
    assert abs(gap(surface, settled)) <= slope * scale * (20 * EPSILON + 10 * off**2)
    assert np.linalg.norm(settled - near) <= 1.001 * abs(off) * scale + 20 * EPSILON * scale


# --- Contact ---------------------------------------------------------------------------------------------


@every_wall
@given(first=directions, second=directions, scale=scales)
def test_inner_gradient_is_a_discrete_gradient(name, first, second, scale):
    """D.(r1 - r0) = q1 - q0."""
    surface, first, second = numbers_of(name, scale), scale * first, scale * second
    discrete = call(surface.discrete_gradient, first, second)
    with mp.workdps(50):
        start, end, exact = (np.array([mp.mpf(float(part)) for part in row]) for row in (first, second, discrete))
        rise = surface.inner(vec(end)) - surface.inner(vec(start))
        slope = np.linalg.norm(call(surface.discrete_gradient, first, first)) + np.linalg.norm(discrete)
        assert abs(exact @ (end - start) - rise) <= 16 * EPSILON * slope * scale


@every_wall
@given(first=directions, second=directions, scale=scales)
def test_gap_gradient_is_a_discrete_gradient_of_the_gap(name, first, second, scale):
    """D.(r1 - r0) = g1 - g0, to the round-off of gaps."""
    surface, first, second = numbers_of(name, scale), scale * first, scale * second
    discrete = np.array(call(surface.gap_gradient, first, second))
    rise = gap(surface, second) - gap(surface, first)
    slope = np.linalg.norm(call(surface.gradient, first)) + np.linalg.norm(call(surface.gradient, second))
    assert abs(discrete @ (second - first) - rise) <= 32 * EPSILON * slope * scale


@pytest.mark.parametrize("name", [name for name in WALLS if name.startswith(("plane", "slab"))])
@given(first=directions, second=directions, scale=scales)
def test_gap_gradient_of_a_flat_wall_is_its_normal(name, first, second, scale):
    """Exactly, where a step stays on one side."""
    surface, first, second = numbers_of(name, scale), scale * first, scale * second
    normals = [np.array(call(surface.gradient, r)) for r in (first, second)]
    discrete = np.array(call(surface.gap_gradient, first, second))
    if (normals[0] == normals[1]).all():
        assert (discrete == side_of(surface) * normals[0]).all()
    else:
        assert np.linalg.norm(discrete) <= 1.0 + 4 * EPSILON


@every_wall
@given(first=directions, second=directions, scale=scales)
def test_gap_slope_is_the_divided_difference_of_the_gap(name, first, second, scale):
    surface = numbers_of(name, scale)
    q0, q1 = (call(surface.inner, scale * point) for point in (first, second))
    g0, g1 = call(surface.gap_of, q0), call(surface.gap_of, q1)
    slope, curvature = call(surface.gap_slope, q0, q1)
    round_off = 4 * EPSILON * (abs(g0) + abs(g1) + abs(surface.gap_of(0.0)))
    assert slope * (q1 - q0) == pytest.approx(g1 - g0, rel=4 * EPSILON, abs=round_off)
    step = 1e-5 * abs(q1)
    rise = call(surface.gap_slope, q0, q1 + step)[0] - call(surface.gap_slope, q0, q1 - step)[0]
    assert rise / (2.0 * step) == pytest.approx(curvature, rel=1e-7, abs=1e-9 * abs(slope / q1))


@every_wall
@given(point=directions, scale=scales, near=st.sampled_from([0.0, 1e-15, -1e-12, 1e-9]))
def test_chain_rule_of_gap_and_inner(name, point, scale, near):
    """g[q, q] grad q = grad g, and no cancellation where q1 is next to q0."""
    surface, point = numbers_of(name, scale), scale * point
    q = call(surface.inner, point)
    slope, _ = call(surface.gap_slope, q, q * (1.0 + near))
    gradient = side_of(surface) * np.array(call(surface.gradient, point))
    chained = slope * np.array(call(surface.discrete_gradient, point, point))
    assert chained == pytest.approx(gradient, abs=(abs(near) + 16 * EPSILON) * np.linalg.norm(gradient))


# A push of up to a third of the size either way.
pushes = {"point": directions, "free": vectors, "strength": st.floats(-1.0, 1.0), "scale": scales}


def pushed_step(name, point, free, strength, scale):
    # What is found by iteration is found in the direction in which the surface pushes.
    strength = strength if name not in ITERATED else math.copysign(strength, numbers_of(name).farthest_push())
    surface, point = numbers_of(name, scale), scale * point
    slope = np.linalg.norm(call(surface.discrete_gradient, point, point))
    return surface, point, 0.5 * scale * free, 0.2 * strength * scale / slope


def converges(name, end):
    """A push that is found by iteration is NaN where it is not found, which methods say is unsolved."""
    if name in ITERATED:
        assume(np.isfinite(end).all())


@every_wall
@given(**pushes)
def test_push_solves_its_equation(name, point, free, strength, scale):
    """r1 = r0 + p - kappa D(r0, r1)."""
    surface, point, free, kappa = pushed_step(name, point, free, strength, scale)
    end = np.array(call(surface.push, point, free, kappa))
    converges(name, end)
    discrete = np.array(call(surface.discrete_gradient, point, end))
    assert end == pytest.approx(point + free - kappa * discrete, abs=16 * EPSILON * scale)


@every_wall
@given(**pushes)
def test_rise_is_the_inner_function_of_push(name, point, free, strength, scale):
    """q1 - q0 = D.(r1 - r0), whose error is relative to D.p and not to q."""
    surface, point, free, kappa = pushed_step(name, point, free, strength, scale)
    rise, slope = call(surface.rise, point, free, kappa)
    end = np.array(call(surface.push, point, free, kappa))
    converges(name, end)
    steep = np.linalg.norm(call(surface.discrete_gradient, end, end))
    q0, q1 = call(surface.inner, point), call(surface.inner, end)
    assert rise == pytest.approx(q1 - q0, abs=32 * EPSILON * (abs(q0) + abs(q1) + steep * scale))
    discrete = np.array(call(surface.discrete_gradient, point, end))
    terms = abs(discrete) @ abs(free) + abs(kappa) * discrete @ discrete
    # The end has the round-off of its coordinates, by which D tilts.
    tilted = 64 * EPSILON * scale * np.abs(discrete).max() if name in QUADRIC_WALLS else 0.0
    assert abs(rise - discrete @ (free - kappa * discrete)) <= 32 * EPSILON * terms + tilted
    if name in ITERATED:
        return  # there the derivative is that of a D that does not turn
    # Five points: where the end is in the middle of a slab, D is small there and the step is long.
    step = 1e-6 * scale / steep
    risen = [call(surface.rise, point, free, kappa + k * step)[0] for k in (-2.0, -1.0, 1.0, 2.0)]
    change = (8.0 * (risen[2] - risen[1]) - (risen[3] - risen[0])) / 6.0
    assert change / (2.0 * step) == pytest.approx(slope, rel=1e-6, abs=1e-6 * steep * steep)


@every_wall
@given(point=directions, direction=directions, length=st.floats(1e-9, 1.0), scale=scales)
def test_chord_normal_reflects_along_a_chord(name, point, direction, length, scale):
    """From the wall a step with the mean of the old and the reflected velocity ends on the wall; |v| is kept."""
    surface = numbers_of(name, scale)
    wall = wall_point(surface, scale * point)
    size = min(surface_of(name, scale).size(), scale)
    # Newton's method finds the chord of a step that is well below the size, a chord into the depth least of all.
    # The long egg is half as thick as its size says.
    size *= 0.5 if name == "long egg" else 1.0
    size *= 0.6 if name not in ITERATED else 0.3
    free = length * size * direction / np.linalg.norm(direction)
    normal = np.array(call(surface.chord_normal, wall, free, chord_of(surface, wall, free)))
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=8 * EPSILON)
    reflected = free - 2.0 * (free @ normal) * normal
    assert np.linalg.norm(reflected) == pytest.approx(np.linalg.norm(free), rel=8 * EPSILON)
    end = wall + 0.5 * (free + reflected)
    slope = np.linalg.norm(call(surface.gradient, wall))
    # Where the chord crosses the end of a capsule's cylinder, H jumps and the iteration only creeps.
    round_off = 1e-12 if name in ("capsule", "rod") else 64 * EPSILON
    assert abs(call(surface.phi, end)) <= round_off * slope * scale


@every_wall
@given(point=directions, scale=scales)
def test_chord_of_no_length_has_the_normal_of_the_wall(name, point, scale):
    surface = numbers_of(name, scale)
    wall = wall_point(surface, scale * point)
    chord = call(surface.chord_normal, wall, np.zeros(3), 0.0)
    assert chord == pytest.approx(call(surface.unit_normal, wall), abs=16 * EPSILON)
