"""The constraint Phi that multipliers hold at zero, its gradient and its divided difference, against 50 digits."""

import mpmath as mp
import pytest
from conftest import EPSILON, LAWS, call, every_law, exponent_of
from hypothesis import example, given
from hypothesis import strategies as st

from swarm.contact import regularisation as laws

mp.mp.dps = 50

gaps = st.one_of(st.floats(-1.0, 1.0), st.sampled_from([0.0, 1e-9, -1e-9, 1e-3, 1.0])).filter(
    lambda g: g == 0.0 or abs(g) > 1e-12
)
depths = st.floats(1e-9, 10.0)
# How near the second gap is to the first one: equal, in the last place, on both sides of each switch of form.
NEARNESS = [0.0, 4e-16, -1e-12, 1e-9, -1e-6, 1e-3, -0.009, 0.0097, -0.0249, 0.041, -0.0412, -0.055, 0.056, -0.3, 1.0]
DEPTHS = [1e-9, 1e-3, 0.7, 10.0]


def exact(law, g):
    """Phi with 50 digits, eq. (2)."""
    a, g = mp.mpf(exponent_of(law)), mp.mpf(float(g))
    return mp.sqrt(2 / (a + 1)) * max(g, 0) ** ((a + 1) / 2)


def exact_gradient(law, g):
    """Phi' with 50 digits, eq. (3); at 0 from the outside."""
    a, g = mp.mpf(exponent_of(law)), mp.mpf(float(g))
    return mp.sqrt((a + 1) / 2) * g ** ((a - 1) / 2) if g >= 0 else mp.mpf(0)


def exact_slope(law, g0, g1):
    """Phi[g0, g1] with 50 digits."""
    if g0 == g1:
        return exact_gradient(law, g0)
    return (exact(law, g1) - exact(law, g0)) / (mp.mpf(float(g1)) - mp.mpf(float(g0)))


def exact_curvature(law, g0, g1):
    """d Phi[g0, g1]/d g1 with 50 digits; half of Phi'' where the gaps are the same."""
    if g0 == g1:
        a, g = mp.mpf(exponent_of(law)), mp.mpf(float(g0))
        return mp.sqrt((a + 1) / 2) * (a - 1) / 4 * g ** ((a - 3) / 2) if a > 1 else mp.mpf(0)
    return (exact_gradient(law, g1) - exact_slope(law, g0, g1)) / (mp.mpf(float(g1)) - mp.mpf(float(g0)))


def close_to(value, rel, slack=0.0):
    """`pytest.approx` without its default absolute tolerance of 1e-12."""
    return pytest.approx(float(value), rel=rel, abs=slack)


def slope_of(law, g0, g1):
    return call(law.constraint_slope, g0, g1)[0]


def curvature_of(law, g0, g1):
    return call(law.constraint_slope, g0, g1)[1]


@every_law
@given(g=st.one_of(gaps, depths))
def test_constraint_is_the_papers(law, g):
    """(2), and (3) from the outside where it jumps; V = alpha Phi^2/2."""
    phi = call(law.constraint, g)
    assert phi == close_to(exact(law, g), rel=8 * EPSILON)
    assert call(law.constraint_gradient, g) == close_to(exact_gradient(law, g), rel=8 * EPSILON)
    assert 0.5 * law.alpha * phi * phi == close_to(call(law.stored_energy, g), rel=32 * EPSILON)


@every_law
def test_constraint_is_zero_up_to_the_surface(law):
    """And its gradient too, but for the corner of a = 1."""
    assert [call(law.constraint, g) for g in (-1.0, -1e-300, -0.0, 0.0)] == [0.0] * 4
    assert [call(law.constraint_gradient, g) for g in (-1.0, -1e-300)] == [0.0] * 2
    assert call(law.constraint_gradient, 0.0) == (1.0 if exponent_of(law) == 1.0 else 0.0)


@every_law
@given(g0=gaps, g1=gaps)
def test_divided_difference_is_the_rise_of_the_constraint(law, g0, g1):
    """Phi[g0, g1] (g1 - g0) = Phi1 - Phi0: both gaps in the wall, one, or none."""
    slope = slope_of(law, g0, g1)
    phi0, phi1 = (call(law.constraint, g) for g in (g0, g1))
    assert slope * (g1 - g0) == close_to(phi1 - phi0, rel=8 * EPSILON, slack=8 * EPSILON * (phi0 + phi1))
    assert slope >= 0.0
    if max(g0, g1) < 0.0:
        assert slope == 0.0
    if max(g0, g1) > 0.0:
        assert slope > 0.0


@every_law
@pytest.mark.parametrize("near", NEARNESS)
def test_divided_difference_does_not_cancel(law, near):
    """In the wall it has its digits, however near the gaps are, in either order."""
    for g0, g1 in [(g, g * (1.0 + near)) for g in DEPTHS]:
        expected = close_to(exact_slope(law, g0, g1), rel=128 * EPSILON)
        assert slope_of(law, g0, g1) == expected
        assert slope_of(law, g1, g0) == expected


@every_law
@example(g=0.0)
@given(g=depths)
def test_divided_difference_of_equal_gaps_is_the_gradient(law, g):
    assert slope_of(law, g, g) == close_to(call(law.constraint_gradient, g), rel=16 * EPSILON)
    assert slope_of(law, -g, -g) == (0.0 if g > 0.0 else call(law.constraint_gradient, 0.0))


@every_law
@pytest.mark.parametrize("near", NEARNESS)
def test_derivative_of_the_divided_difference_in_the_wall(law, near):
    for g0, g1 in [(g, g * (1.0 + near)) for g in DEPTHS]:
        slack = 1e-10 * float(exact_slope(law, g0, g1)) / g0
        assert curvature_of(law, g0, g1) == close_to(exact_curvature(law, g0, g1), rel=1e-10, slack=slack)


@every_law
@given(g0=st.floats(-1.0, 0.0), g1=st.floats(1e-6, 1.0))
def test_derivative_of_the_divided_difference_into_the_wall(law, g0, g1):
    """g0 in the cavity or on the surface: State II and State I."""
    for first, last in ((g0, g1), (g1, g0)):
        scale = float(exact_slope(law, first, last)) / (g1 - g0)
        assert curvature_of(law, first, last) == close_to(
            exact_curvature(law, first, last), rel=1e-12, slack=64 * EPSILON * scale
        )


@pytest.mark.parametrize("g0", [-0.3, 0.0, 0.2])
@every_law
def test_divided_difference_is_continuous(law, g0):
    """Across g0 and the switches of form; across 0 too, but for the jump of State I with a = 1."""
    for g1 in (0.0, g0, g0 * 1.0625, g0 * 0.9375, g0 * (1.0 + 1.0 / 18.0), g0 * (1.0 - 1.0 / 18.0)):
        below, above = (slope_of(law, g0, g1 + step) for step in (-1e-12, 1e-12))
        if g0 == 0.0:
            jump = 1.0 if exponent_of(law) == 1.0 else slope_of(law, 0.0, 1e-12)
            assert (below, above) == (0.0, close_to(jump, rel=8 * EPSILON))
        else:
            assert below == close_to(above, rel=0.0, slack=1e-10 * exponent_of(law))


@pytest.mark.parametrize(("special", "a"), [(LAWS["1.5"], 1.5), (LAWS["1.0"], 1.0)], ids=["Hertz", "linear"])
@given(g0=gaps, g1=gaps)
def test_special_laws_are_power_laws(special, a, g0, g1):
    """The derivative too; from a cavity where g1 = 0 it jumps with Phi'."""
    power = laws.Power(special.alpha, a)
    for g in (g0, g1):
        assert call(special.constraint, g) == close_to(call(power.constraint, g), rel=8 * EPSILON)
        assert call(special.constraint_gradient, g) == close_to(call(power.constraint_gradient, g), rel=8 * EPSILON)
    assert slope_of(special, g0, g1) == close_to(slope_of(power, g0, g1), rel=1e-12)
    scale = slope_of(special, g0, g1) / max(abs(g0), abs(g1), 1e-300)
    if g1 != 0.0:
        assert curvature_of(special, g0, g1) == close_to(curvature_of(power, g0, g1), rel=1e-9, slack=1e-9 * scale)


@every_law
@given(multiplier=st.sampled_from([0.0, 3.0, 1e4]), g0=gaps, g1=gaps)
def test_force_is_the_springs_and_the_multipliers(law, multiplier, g0, g1):
    """V[g0, g1] + lambda Phi[g0, g1], which is Phi[g0, g1] (alpha Phi_mean + lambda); no lambda is lambda = 0."""
    spring, slope = call(law.energy_slope, g0, g1), call(law.constraint_slope, g0, g1)
    force = call(law.force, multiplier, g0, g1)
    assert force == tuple(s + multiplier * d for s, d in zip(spring, slope, strict=True))
    mean = 0.5 * (call(law.constraint, g0) + call(law.constraint, g1))
    assert force[0] == close_to(slope[0] * (law.alpha * mean + multiplier), rel=1e-12, slack=1e-300)
    assert call(law.force, None, g0, g1) == spring


@every_law
@given(g=gaps, factor=st.floats(1e-3, 1e3))
def test_stiffened_scales_the_penalty_alone(law, g, factor):
    stiff = law.stiffened(factor)
    assert type(stiff) is type(law)
    assert exponent_of(stiff) == exponent_of(law)
    assert call(stiff.constraint, g) == call(law.constraint, g)
    assert call(stiff.stored_energy, g) == close_to(factor * call(law.stored_energy, g), rel=1e-14)
