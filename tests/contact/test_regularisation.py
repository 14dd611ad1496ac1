"""The stored energy V of a wall, and the divided difference that balances it."""

import mpmath as mp
import numpy as np
import pytest
from conftest import EPSILON, LAWS, call, every_law, exponent_of
from hypothesis import given
from hypothesis import strategies as st

from swarm.contact import regularisation as laws

mp.mp.dps = 50

gaps = st.one_of(st.floats(-1.0, 1.0), st.sampled_from([0.0, 1e-9, -1e-9, 1e-3, 1.0])).filter(
    lambda g: g == 0.0 or abs(g) > 1e-12
)
# How near the second gap is to the first one.
nearness = st.sampled_from([0.0, 1e-15, -1e-12, 1e-9, -1e-6, 1e-3, -0.01, 0.031, -0.0312, 0.04, -0.2])


def energy(law, g):
    """V with 50 digits: alpha g^(a+1)/(a+1)."""
    a = mp.mpf(exponent_of(law))
    return mp.mpf(law.alpha) * max(mp.mpf(float(g)), 0) ** (a + 1) / (a + 1)


def divided(law, g0, g1):
    """V[g0, g1] with 50 digits; the force alpha g^a where both gaps are the same."""
    if g0 == g1:
        return mp.mpf(law.alpha) * max(mp.mpf(float(g0)), 0) ** mp.mpf(exponent_of(law))
    return (energy(law, g1) - energy(law, g0)) / (mp.mpf(float(g1)) - mp.mpf(float(g0)))


@pytest.mark.parametrize(("a", "kind"), [(1.0, laws.Linear), (1.5, laws.Hertz), (1.25, laws.Power), (4.0, laws.Power)])
def test_each_exponent_gets_its_cheapest_law(a, kind):
    law = laws.regularisation(7.0, a)
    assert type(law) is kind
    assert law.alpha == 7.0
    assert exponent_of(law) == a


@every_law
@given(g=gaps)
def test_stored_energy_is_the_papers(law, g):
    """V = alpha Phi^2/2 with Phi = sqrt(2/(a+1)) max(g, 0)^((a+1)/2), eq. (2)."""
    a = exponent_of(law)
    phi = np.sqrt(2.0 / (a + 1.0)) * max(g, 0.0) ** ((a + 1.0) / 2.0)
    assert call(law.stored_energy, g) == pytest.approx(0.5 * law.alpha * phi * phi, rel=1e-14, abs=1e-300)
    if g > 0.0:
        assert call(law.stiffness, g) * g * g / 2.0 == pytest.approx(call(law.stored_energy, g), rel=1e-14)


@every_law
@given(g0=gaps, g1=gaps)
def test_divided_difference_balances_the_energy(law, g0, g1):
    """V[g0, g1] (g1 - g0) = V1 - V0 whatever the gaps are: both in the wall, one, or none."""
    slope, _ = call(law.energy_slope, g0, g1)
    v0, v1 = (call(law.stored_energy, g) for g in (g0, g1))
    assert slope * (g1 - g0) == pytest.approx(v1 - v0, rel=8 * EPSILON, abs=8 * EPSILON * (v0 + v1))
    if max(g0, g1) <= 0.0:
        assert slope == 0.0
    else:
        assert slope > 0.0


@every_law
@given(g0=st.floats(1e-6, 10.0), near=nearness)
def test_divided_difference_does_not_cancel(law, g0, near):
    """In the wall it has its full digits, however near the gaps are; 32 digits' worth of quotient are lost at most."""
    g1 = g0 * (1.0 + near)
    slope, _ = call(law.energy_slope, g0, g1)
    assert slope == pytest.approx(float(divided(law, g0, g1)), rel=256 * EPSILON)


@every_law
@given(g0=gaps, g1=st.one_of(gaps, nearness))
def test_derivative_of_the_divided_difference(law, g0, g1):
    if abs(g1) < 1e-3 or abs(g1 - g0) < 1e-3:
        g1 = 0.5
    step = 1e-6
    rise = call(law.energy_slope, g0, g1 + step)[0] - call(law.energy_slope, g0, g1 - step)[0]
    curvature = call(law.energy_slope, g0, g1)[1]
    assert curvature == pytest.approx(rise / (2.0 * step), rel=1e-5, abs=1e-5 * law.alpha)


@every_law
@given(g=st.floats(1e-3, 1.0), near=nearness)
def test_derivative_next_to_equal_gaps(law, g, near):
    """Half the slope of the force there: d V[g0, g1]/d g1 = alpha a g^(a-1)/2."""
    if abs(near) > 1e-5:
        near = 1e-7
    a = exponent_of(law)
    curvature = call(law.energy_slope, g, g * (1.0 + near))[1]
    assert curvature == pytest.approx(0.5 * law.alpha * a * g ** (a - 1.0), rel=1e-4)


@every_law
@pytest.mark.parametrize("g0", [-0.3, 0.0, 0.2])
def test_divided_difference_is_continuous(law, g0):
    """Across 0, across g0, and across the switch from one form to the other."""
    for g1 in (0.0, g0, g0 * (1.0 + 1.0 / 32.0), g0 * (1.0 - 1.0 / 32.0)):
        below, above = (call(law.energy_slope, g0, g1 + step)[0] for step in (-1e-9, 1e-9))
        assert below == pytest.approx(above, abs=4e-9 * law.alpha * exponent_of(law))


@given(g0=gaps, g1=gaps)
def test_hertz_is_the_power_law_of_exponent_three_halves(g0, g1):
    hertz, power = laws.Hertz(1e3), laws.Power(1e3, 1.5)
    assert call(hertz.stored_energy, g0) == pytest.approx(call(power.stored_energy, g0), rel=1e-14)
    assert call(hertz.energy_slope, g0, g1)[0] == pytest.approx(
        call(power.energy_slope, g0, g1)[0], rel=1e-12, abs=1e-12
    )


@given(g0=gaps, g1=gaps)
def test_linear_is_the_power_law_of_exponent_one(g0, g1):
    linear, power = LAWS["1.0"], laws.Power(1e3, 1.0)
    assert call(linear.energy_slope, g0, g1)[0] == pytest.approx(
        call(power.energy_slope, g0, g1)[0], rel=1e-12, abs=1e-12
    )
