"""Where a wall bends neither to a particle nor away it lets go: what is left of the curvature is round-off there.

The wall z = k x^3 presses on a particle that slides up to x = 0, and bends away beyond: the particle flies on along
the tangent. Gravity across the plane of the curve changes neither. A cubic spline is that cubic, so the end is known in
closed form.
"""

import math

import numpy as np
import pytest
from bounded import bounded
from conftest import every_pair

import swarm
from swarm.kernel.vector import Vec
from swarm.surfaces.data import sampled_numbers
from swarm.surfaces.time_of_impact.march import march

pytestmark = pytest.mark.physics

K, START, AFTER = 2.0, -0.3, 0.1
HALF, SAMPLES = 0.5, 21
# Passes of a run that lets go in a few; where steps are as short as round-off, 1e8.
MOST = 1000


def sampled(center, restitution):
    origin = tuple(c - HALF for c in center)
    x = np.linspace(-HALF, HALF, SAMPLES)
    values = np.broadcast_to(x - K * x[:, None, None] ** 3, (SAMPLES,) * 3)
    return swarm.Sampled(values, x[1] - x[0], origin, restitution=restitution)


def formula(center, restitution):
    """A bound of the bend that holds everywhere, and is nowhere near to it at x = 0."""
    return swarm.Formula("z - 2*x**3", center=center, curvature=6.0 * K * HALF, restitution=restitution)


def arc(x):
    """The length of the curve from x to 0."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    places = 0.5 * x * (1.0 - nodes)
    return 0.5 * abs(x) * float(weights @ np.sqrt(1.0 + (3.0 * K * places**2) ** 2))


@every_pair(
    surface={"sampled": sampled, "formula": formula},
    center={"at the origin": (0.0, 0.0, 0.0), "off it": (0.37, -0.21, 0.43)},
    given={"0.9-0.0": (0.9, 0.0), "1.0-1.0": (1.0, 1.0), "0.5--3.0": (0.5, -3.0)},
)
def test_it_flies_on_along_the_tangent(surface, center, given, monkeypatch):
    restitution, pull = given
    bounded(monkeypatch, MOST)
    box = swarm.Box((0.45, 0.45, 0.45), center=center)
    scene = swarm.Scene([surface(center, restitution), box], gravity=(0.0, pull, 0.0) if pull else None)
    slope = 3.0 * K * START**2
    start = np.add(center, (START, -0.1 * np.sign(pull), K * START**3))
    velocity = np.array([1.0, 0.0, slope]) / math.hypot(1.0, slope)
    until = arc(START) + AFTER
    result = swarm.simulate(
        scene, swarm.Particles(start, velocity), swarm.Impact(), until=until, compile="never", threads=1
    )
    fallen = np.array([AFTER, -0.1 * np.sign(pull) + 0.5 * pull * until**2, 0.0])
    assert np.abs(result.particles.position[:, 0] - center - fallen).max() < 2e-9
    assert np.abs(result.particles.velocity[:, 0] - (1.0, pull * until, 0.0)).max() < 5e-9
    assert result.observables["energy_error"][-1] < 2e-15
    assert result.observables["max_penetration"].max() < 1e-15


def test_the_steps_of_that_flight_are_few(monkeypatch):
    """From the place where it lets go to 1e-6 off the wall: some hundreds, not 1e-16 of the time each."""
    count, one = [0], sampled_numbers.SampledNumbers._safe_step

    def counted(*arguments):
        count[0] += 1
        return one(*arguments)

    monkeypatch.setattr(sampled_numbers.SampledNumbers, "_safe_step", counted)
    center = (0.37, -0.21, 0.43)
    wall, r = sampled(center, 0.9).walls()[0], Vec(*center)
    v, g = Vec(1.0, 0.0, -8.9e-16), Vec(0.0, 1.0, 0.0)
    for _pass in range(20):
        time, found = march(wall, r, v, g)
        assert not found
        r, v = r + time * (v + (0.5 * time) * g), v + time * g
        if center[2] + K * (r.x - center[0]) ** 3 - r.z > 1e-6:
            break
    else:
        pytest.fail("it is still at the wall")
    assert count[0] < 2000
