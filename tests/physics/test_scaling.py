"""Units: lengths, times and masses times powers of two give the same bits, scaled."""

import numpy as np
import pytest
from physics.billiards import AXES, run

import swarm

pytestmark = pytest.mark.physics

# Powers of two for length, time, mass; even, so that L^(3/2) is one too.
SCALES = [(6, 0, 0), (0, -4, 0), (0, 0, 10), (-10, 6, 2), (20, -20, 0)]


def _surfaces(name, length, time):
    ball = swarm.Sphere(0.1 * length, (0.05 * length, 0.0, 0.1 * length), side="outside")
    corners = [(0.4 * x * length, 0.4 * y * length) for x, y in [(-1, -1), (1.2, -1), (0.6, 1), (0, 0.4), (-0.8, 1.2)]]
    rng = np.random.default_rng(3)
    centers, radii = rng.uniform(-0.3, 0.3, (60, 3)) * length, rng.uniform(0.01, 0.03, 60) * length
    turning = [
        swarm.Rotation((1.0, 2.0, 3.0), 0.7 / time, (0.05 * length, 0.0, 0.0)),
        swarm.Oscillation((0.02 * length, 0.0, 0.04 * length), 2.0 / time),
    ]
    return {
        "sphere": [swarm.Sphere(0.5 * length)],
        "solids in a prism": [
            swarm.Prism(corners, 0.8 * length, restitution=0.9),
            swarm.Spheres(centers, radii, friction=0.2),
        ],
        "turning box": [swarm.Box((0.5 * length, 0.4 * length, 0.6 * length), motion=turning, friction=0.1), ball],
        "capsule with a door": [
            swarm.Capsule(
                0.4 * length,
                0.5 * length,
                openings=[swarm.Opening(swarm.Sphere(0.3 * length, (0.4 * length, 0.0, 0.0)), ((time, 3.0 * time),))],
            ),
            ball,
        ],
        "ball in ellipsoid": [swarm.Ellipsoid(tuple(axis * length for axis in AXES)), ball],
        "hemisphere": [swarm.Sphere(0.5 * length), swarm.Plane((0.0, 0.0, -1.0), 0.0)],
    }[name]


def _end(name, kind, length=1.0, time=1.0, mass=1.0):
    pull = (0.1 * length / time**2, 0.0, -1.0 * length / time**2)
    scene = swarm.Scene(_surfaces(name, length, time), gravity=pull if "falling" in kind else None)
    radius = 0.02 if kind.endswith("balls") else None
    unit = swarm.fill(swarm.Scene(_surfaces(name, 1.0, 1.0)), 4, speed=0.5, seed=8, radius=radius)
    size = None if radius is None else radius * length
    start = swarm.Particles(unit.position * length, unit.velocity * (length / time), mass, radius=size)
    if kind.startswith("impact"):
        method = swarm.Impact(contact_step=1e-3 * time if kind == "impact, chord" else 0.0)
    else:
        exponent = 1.5 if kind == "hertz" else 1.0
        # alpha g^(a+1) is an energy; the gap of an ellipsoid has no unit, so only scenes of lengths are used here
        method = swarm.Penalty(2.0**-7 * time, 1e3 * mass * length ** (1.0 - exponent) / time**2, exponent)
    return run(scene, start, method, 5.0 * time, 1.25 * time, "never")


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("sphere", "impact"),
        ("ball in ellipsoid", "impact"),
        ("sphere", "impact, chord"),
        ("sphere", "penalty"),
        ("sphere", "hertz"),
        ("hemisphere", "falling"),
        ("solids in a prism", "impact"),
        ("solids in a prism", "impact, falling balls"),
        ("turning box", "impact, falling"),
        ("turning box", "impact, balls"),
        ("capsule with a door", "impact"),
        ("capsule with a door", "impact, falling balls"),
    ],
)
def test_units_do_not_matter(name, kind):
    """No hidden length, time or mass: powers of two are exact, so the results are too."""
    base = _end(name, kind)
    for powers in SCALES:
        length, time, mass = (2.0**power for power in powers)
        scaled = _end(name, kind, length, time, mass)
        assert np.array_equal(scaled.particles.position, base.particles.position * length), powers
        assert np.array_equal(scaled.particles.velocity, base.particles.velocity * (length / time)), powers
        assert np.array_equal(scaled.observables["impacts"], base.observables["impacts"])
        assert np.array_equal(scaled.observables["impulse"], base.observables["impulse"] * (mass * length / time))
        assert np.array_equal(scaled.observables["energy_error"], base.observables["energy_error"])
