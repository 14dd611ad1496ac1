"""Uzawa's loop from inside the wall, or with an exponent above 1: lambda grows without bound, and is never accepted."""

import math

import numpy as np
import pytest
from methods.passes import simulate

import swarm

pytestmark = pytest.mark.physics

WALL = swarm.Scene([swarm.Plane((1.0, 0.0, 0.0), 0.0)])
SPHERE = swarm.Scene([swarm.Sphere(0.5)])
# Free displacement onto the wall 0.01, kinetic energy 0.125 J of which 0.045 J is that of the normal velocity.
H, VELOCITY, FREE = 1.0 / 32.0, (0.32, 0.384, 0.0), 0.01
SWEEPS = 800


def history(gap, exponent, penalty, sweeps=SWEEPS, **keywords):
    """The loop of one step that starts at this gap (below 0: inside)."""
    method = swarm.AugmentedLagrangian(H, penalty, exponent, max_sweeps=sweeps, **keywords)
    return swarm.contact_history(WALL, (gap, 0.0, 0.0), VELOCITY, 1.0, method)


def growth(multipliers):
    """s of lambda ~ sweeps^s, over the last three quarters of the sweeps."""
    return math.log(multipliers[-1] / multipliers[len(multipliers) // 4]) / math.log(4.0)


def lost(history):
    """The kinetic energy that the step has lost [J]."""
    return 0.5 * np.square(VELOCITY).sum() - history.kinetic_energy[-1]


# --- Where it fails --------------------------------------------------------------------------------------


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("gap", [-0.008, -0.002])
def test_from_inside_the_multiplier_grows_as_the_root_of_the_sweeps(gap, exponent):
    """State II: D ~ Phi1/|g0| vanishes with Phi1, so lambda Phi1 tends to g |g0| 2m/h^2, an energy that is lost.

    With g the gap where the free flight ends: lambda Phi1/|g0| must hold the particle back by g. Then (8) makes of
    lambda the root of alpha g |g0| (2m/h^2) sweeps, whatever the exponent.
    """
    found = history(gap, exponent, 1e6 * 0.01 ** (1.0 - exponent))
    energy = (FREE + gap) * -gap * 2.0 / H**2
    assert not found.converged
    assert (np.diff(found.multiplier) > 0.0).all()
    assert growth(found.multiplier) == pytest.approx(0.5, abs=0.02)
    assert lost(found) == pytest.approx(energy, rel=0.05)
    assert found.stored_energy[-1] == pytest.approx(0.5 * energy / SWEEPS, rel=0.1)


@pytest.mark.parametrize("exponent", [1.5, 2.0, 4.0])
def test_for_an_exponent_above_one_it_grows_as_a_power(exponent):
    """State I, Phi'(0) = 0: lambda ~ sweeps^((a-1)/2a); what is lost falls as sweeps^(-1/a): 1e-10 is out of reach."""
    found = history(0.0, exponent, 1e7 * 0.01 ** (1.0 - exponent))
    assert not found.converged
    assert (np.diff(found.multiplier) > 0.0).all()
    assert growth(found.multiplier) == pytest.approx(0.5 * (exponent - 1.0) / exponent, abs=0.02)
    missing = found.multiplier * found.constraint
    assert growth(missing) == pytest.approx(-1.0 / exponent, abs=0.05)
    # Cutting the step at the impact does not help: it starts on the wall already.
    assert not history(-0.004, exponent, 1e7 * 0.01 ** (1.0 - exponent), 50, adaptive=True).converged


def test_what_is_accepted_has_its_energy():
    """So near before the wall that V <= tolerance is reached the loss, F (g1 - g0) with F = 2m v_n/h, is small too."""
    depths, ended = np.logspace(-16, -2.1, 15), []
    for depth in depths:
        found = history(-depth, 1.0, 1e6, 50)
        # The work of the force on the way from where it begins to act.
        force = 2.0 * (FREE - depth - found.constraint[-1]) / H**2
        assert lost(found) == pytest.approx(force * (depth + found.constraint[-1]), rel=1e-6)
        assert not found.converged or lost(found) <= 1e-6
        ended.append(found.converged)
    assert ended == sorted(ended, reverse=True)
    assert 3 < sum(ended) < 12


# --- Where it does not -----------------------------------------------------------------------------------


@pytest.mark.parametrize("gap", [0.0, -0.004])
def test_exponent_one_from_the_wall_converges(gap):
    """The same step: State I at once, or by adaptive=True, which flies to the wall first."""
    found = history(gap, 1.0, 1e6, 50, tolerance=1e-24, adaptive=gap < 0.0)
    assert found.converged
    assert found.multiplier[-1] == pytest.approx(found.multiplier[-2], rel=1e-9)
    assert lost(found) == pytest.approx(0.0, abs=1e-12)
    assert found.velocity[-1] == pytest.approx([-VELOCITY[0], *VELOCITY[1:]], abs=1e-12)


def test_a_gas_is_not_carried_on():
    """Fixed steps meet the wall from inside: the run ends with a sentence, or counts what costs it its energy."""
    start = swarm.fill(SPHERE, 5, speed=0.5, seed=1)
    fixed = {"dt": H, "penalty": 1e4, "max_sweeps": 60}
    with pytest.raises(swarm.RunError, match=r"particle \d+: .*60 sweeps left V = .* above tolerance.*adaptive=True"):
        simulate(SPHERE, start, swarm.AugmentedLagrangian(**fixed), 4.0)
    counted = swarm.AugmentedLagrangian(**fixed, on_unconverged="count")
    seen = simulate(SPHERE, start, counted, 4.0, 1.0).observables
    assert seen["unconverged"][-1] > 5
    assert seen["energy_error"].max() > 0.1
    cut = swarm.AugmentedLagrangian(**fixed, tolerance=1e-26, adaptive=True)
    seen = simulate(SPHERE, start, cut, 4.0, 1.0).observables
    assert seen["unconverged"][-1] == 0
    assert seen["energy_error"].max() <= 1e-12
