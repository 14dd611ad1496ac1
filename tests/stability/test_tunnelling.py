"""Thin solids: steps can jump over them, flights to the impact instant cannot."""

from unittest import mock

import numpy as np
import pytest
from methods.passes import run

import swarm
from swarm.methods import fixed_step

pytestmark = pytest.mark.physics

STEPPING = (swarm.Penalty, swarm.Verlet, swarm.Midpoint, swarm.Trapezoidal)
# One step before a wall of 0.01 m, which it flies over by the next of 0.02 m.
THIN, LAUNCH = 1e-2, ([-0.109, 0.0, 0.0], [1.0, 0.0, 0.0])


def halves(thickness, normal=(1.0, 0.0, 0.0)):
    """A cavity cut in two by a solid plate through its middle; an oblique one is a kernel of the random scenes."""
    plate = swarm.Slab(normal, 0.5 * thickness, side="outside")
    return swarm.Scene([plate, swarm.Ellipsoid((1.0, 1.0, 1.0))])


@pytest.mark.parametrize("thickness", [1e-2, 1e-6, 1e-12])
@pytest.mark.parametrize("speed", [1.0, 1e6])
def test_impact_never_passes(thickness, speed):
    """However thin the wall and fast the particle: a thousand impacts each, and every one is on its side."""
    normal = np.array([0.8, 0.6, 0.0])
    scene = halves(thickness, tuple(normal))
    random = np.random.default_rng(4)
    position = random.uniform(-0.5, 0.5, (3, 100))
    position = position[:, np.abs(normal @ position) > 0.1][:, :5]
    velocity = random.standard_normal((3, 5))
    velocity *= speed / np.linalg.norm(velocity, axis=0)
    start = swarm.Particles(position, velocity)
    end = swarm.simulate(scene, start, swarm.Impact(), until=1500.0 / speed, every=150.0 / speed)
    assert (np.sign(normal @ end.particles.position) == np.sign(normal @ position)).all()
    assert end.observables["impacts"][-1] > 5 * 1000
    assert end.observables["max_penetration"].max() <= 4.0 * np.finfo(float).eps


@pytest.mark.parametrize("thickness", [1e-6, 1e-12])
def test_no_flight_passes_a_thin_ellipsoid(thickness):
    """A disc wider than its cavity: every particle stays in its half. Seen from afar it is a double root."""
    disc = swarm.Ellipsoid((2.0, 0.5 * thickness, 2.0), side="outside")
    scene = swarm.Scene([disc, swarm.Ellipsoid((1.0, 1.0, 1.0))])
    position = np.random.default_rng(4).uniform(0.1, 0.5, (3, 5))
    position[1, ::2] *= -1.0
    start = swarm.Particles(position, np.random.default_rng(5).standard_normal((3, 5)))
    end = swarm.simulate(scene, start, swarm.Impact(), until=1000.0, every=100.0)
    assert (np.sign(end.particles.position[1]) == np.sign(position[1])).all()
    assert end.observables["impacts"][-1] > 5 * 1000
    assert end.observables["max_penetration"].max() <= 4.0 * np.finfo(float).eps


@pytest.mark.parametrize("cls", STEPPING)
def test_a_step_longer_than_the_wall_is_refused(cls):
    method = cls(dt=2.0 * THIN, penalty=1e4)
    with pytest.raises(swarm.SceneError, match=r"no particle jumps over a solid in one step.*surfaces\[0\]"):
        swarm.simulate(halves(THIN), swarm.Particles(*LAUNCH), method, until=1.0)


@pytest.mark.parametrize("cls", [swarm.Penalty, swarm.Verlet, swarm.Trapezoidal])
def test_what_the_refusal_prevents(cls):
    """Without the check those that look at ends of steps are on the other side of the wall, and no energy tells."""
    with mock.patch.object(fixed_step, "longest_step", return_value=None):
        end = run(cls(dt=2.0 * THIN, penalty=1e4), halves(THIN), *LAUNCH, 20.0)[-1]
    assert end.position == pytest.approx([-0.109 + 0.4, 0.0, 0.0], abs=1e-15)
    assert end.velocity.tolist() == LAUNCH[1]
    end = run(swarm.Impact(), halves(THIN), *LAUNCH, 0.4)[-1]
    assert end.position == pytest.approx([0.109 - 0.4 - THIN, 0.0, 0.0], abs=1e-15)
