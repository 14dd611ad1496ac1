"""Exponent 1 with the mean-value form: Phi has a corner at the wall; no point of the step has the gradient needed."""

import numpy as np
import pytest

import swarm

pytestmark = pytest.mark.physics

WALL = swarm.Scene([swarm.Plane((1.0, 0.0, 0.0), 0.0)])
H, SPEED = 1.0 / 128.0, 0.5
# h sqrt(alpha/m) = 1/2: a contact takes six steps.
ALPHA = (0.5 / H) ** 2


@pytest.mark.parametrize("cls", [swarm.Penalty, swarm.AugmentedLagrangian])
def test_it_is_refused(cls):
    with pytest.raises(swarm.SceneError, match=r'gradient must be "composite" for exponent = 1.*no such point'):
        cls(H, ALPHA, 1.0, gradient="mean-value")


def test_no_point_has_the_gradient():
    """In a step through the wall grad Phi.dr is 0 or g1 - g0, and Phi1 - Phi0 = g1 is neither."""
    g0, g1 = -0.3, 0.1
    beta = np.linspace(0.0, 1.0, 1001)
    slopes = np.where(g0 + beta * (g1 - g0) > 0.0, 1.0, 0.0)
    assert set((slopes * (g1 - g0)).round(12)) == {0.0, 0.4}
    assert np.abs(slopes * (g1 - g0) - g1).min() >= 0.1 - 1e-15


def nearest_mean_value(x, v):
    """A step with that one of the two slopes of Phi that misses the identity D.dr = Phi1 - Phi0 by less."""
    free = x + H * v
    # r1 = r0 + h v0 - c alpha (Phi0 + Phi1) D, c = h^2/(4m)
    c = 0.25 * H * H * ALPHA
    pushed = (free - c * max(x, 0.0)) / (1.0 + c)
    if pushed < 0.0:
        pushed = free - c * max(x, 0.0)
    ends = {0.0: free, 1.0: pushed}
    miss = {slope: abs(slope * (end - x) - (max(end, 0.0) - max(x, 0.0))) for slope, end in ends.items()}
    end = ends[min(miss, key=miss.__getitem__)]
    return end, 2.0 * (end - x) / H - v


def penalty_step(method):
    """A step of Penalty in plain Python."""

    def step(x, v):
        found = swarm.contact_history(WALL, (x, 0.0, 0.0), (v, 0.0, 0.0), 1.0, method)
        return found.position[0, 0], found.velocity[0, 0]

    return step


def worst_energy(step, places):
    """Largest change of v^2 in a bounce, over so many places in a step where the contact may begin."""
    speeds = []
    for part in np.linspace(0.02, 0.98, places):
        x, v = -part * H * SPEED, SPEED
        for _step in range(100):
            x, v = step(x, v)
            if x < 0.0 and v < 0.0:
                break
        speeds.append(v)
    assert max(speeds) < 0.0
    return float(np.abs(np.square(speeds) / SPEED**2 - 1.0).max())


def test_the_energy_jumps_without_such_a_point():
    """Forced on, each bounce changes the energy by some per cent, at a step that resolves the contact."""
    assert worst_energy(nearest_mean_value, 24) > 0.02


@pytest.mark.parametrize(("exponent", "gradient"), [(1.0, "composite"), (1.5, "composite"), (1.5, "mean-value")])
def test_the_composite_form_keeps_it(exponent, gradient):
    """With and without the corner; the mean-value form without."""
    method = swarm.Penalty(H, ALPHA * 0.01 ** (1.0 - exponent), exponent, gradient)
    assert worst_energy(penalty_step(method), 4) <= 1e-13
