"""The paper's data: m = 1 kg, h = 0.025 s, alpha = 1e4, V <= 1e-10 J, at most 50 sweeps."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import swarm

Floats = NDArray[np.float64]

MASS = 1.0
DT = 0.025
PENALTY = 1e4
TOLERANCE = 1e-10
# V that only round-off is below: the loop then ends at Phi1 = 0 to the last digits.
ROUND_OFF = 1e-28

SPHERE = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
ELLIPSOID = swarm.Scene(surfaces=[swarm.Ellipsoid((0.3, 0.3, 0.6))])
SPHERE_ENERGY = 0.125
ELLIPSOID_ENERGY = 0.24

SPHERE_START = np.array([0.25, 0.10, 0.0])
STATE_I_VELOCITY = 0.5 * np.array([0.6, 0.8, 0.0])
STATE_II_VELOCITY = 0.5 * np.array([math.cos(math.pi / 4), math.sin(math.pi / 4), 0.0])
ELLIPSOID_START = np.zeros(3)
ELLIPSOID_VELOCITY = np.array([0.4, 0.4, 0.4])

# Sweeps of the mean-value form on the ellipsoid that the paper prints, with their multiplier and energy.
PAPER_SWEEPS = np.array([1, 2, 6, 11, 21, 50])
PAPER_MULTIPLIERS = np.array([0.0, 967.2, 2541.7, 3575.6, 4904.3, 7208.2])
PAPER_ENERGIES = np.array([0.05289, 0.07090, 0.10201, 0.11775, 0.13296, 0.15089])

# A free step that ends nearer than this to the surface ends on it: 20 steps of State I sum up a few units of round-off.
_ON_THE_SURFACE = 1e-12


class Approach(NamedTuple):
    """The free steps up to the first contact step."""

    steps: int
    position: Floats
    velocity: Floats


def approach(scene: swarm.Scene, start: Floats, velocity: Floats) -> Approach:
    """Free steps of length DT while they end inside the walls, or on them."""
    steps = 0
    while True:
        following = start + (steps + 1) * DT * velocity
        if max(surface.phi(following[:, None])[0] for surface in scene.surfaces) > _ON_THE_SURFACE:
            return Approach(steps, start + steps * DT * velocity, velocity)
        steps += 1


def state_i() -> Approach:
    """On the sphere at t0: after 20 steps at (0.4, 0.3)."""
    return approach(SPHERE, SPHERE_START, STATE_I_VELOCITY)


def state_ii() -> Approach:
    """Inside the sphere at t0, outside at the end of a free step."""
    return approach(SPHERE, SPHERE_START, STATE_II_VELOCITY)


def on_the_ellipsoid() -> Approach:
    """On the ellipsoid at t0: after 20 steps at (0.2, 0.2, 0.2)."""
    return approach(ELLIPSOID, ELLIPSOID_START, ELLIPSOID_VELOCITY)


def history(scene: swarm.Scene, at: Approach, method: swarm.AugmentedLagrangian) -> swarm.ContactHistory:
    """The sweeps of the step after an approach."""
    return swarm.contact_history(scene, at.position, at.velocity, MASS, method)
