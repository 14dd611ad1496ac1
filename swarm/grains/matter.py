"""The matter of soft balls as kernels take it, from a scene and its method."""

import math

import numpy as np
from numpy.typing import NDArray

from ..compiled_scene import CompiledScene
from ..contact.damping import damping_of
from ..methods.base import Method
from ..methods.fixed_step import longest_step
from ..pairs import Pairs
from ..particles import Particles
from ..scene import Scene
from ..surfaces.surface import Surface
from .cell import Lengths
from .contacts import Losses, Matter
from .overlaps import Limits

# The least restitution with a damper that steps can follow.
MOST_DAMPED = 0.01


def matter_of(compiled: CompiledScene, method: Method, radius: NDArray[np.float64]) -> Matter:
    """What is the same for all balls of a scene, with these radii, and all steps of a method."""
    scene = compiled.scene
    pairs, law, dt = scene.pairs or Pairs(), method.law(), float(method.dt)  # type: ignore[attr-defined]
    surfaces = [compiled.pieces.each[i] for i in compiled.numbering.pieces_of_rows]
    return Matter(
        law,
        scene.pull(),
        dt,
        _losses(law.alpha, pairs),
        tuple(_losses(law.alpha, surface) for surface in surfaces),
        None if scene.period is None else Lengths(*scene.period),
        _limits(float(radius.min()), longest_step(scene, dt, balls=True)),
        compiled.openings(),
        slips=method.friction_tolerance,  # type: ignore[attr-defined]
    )


def _limits(least: float, longest: float | None) -> Limits:
    """The `Limits` of balls with radii from the least one on [m]."""
    # In a move of no more than the least radius no ball passes another's surface, or a triangle, with less than half of
    # that overlap at both ends.
    return Limits(0.5 * least, least if longest is None else min(least, longest), longest)


def _losses(alpha: float, given: Pairs | Surface) -> Losses:
    """What is lost at contacts of pairs, or with a surface."""
    friction = given.friction if given.friction or given.rolling else None
    return Losses(damping_of(alpha, given.restitution), friction, given.rolling or None)


def contact_time(scene: Scene, particles: Particles, method: Method) -> float:
    """The duration of the shortest contact of two balls without losses [s], with the speed of the fastest.

    Of m g'' = -alpha g^a from g = 0 with the speed u: 2 sqrt(pi) Gamma(1 + p)/Gamma(1/2 + p) G/u, where p = 1/(a + 1)
    and G is the deepest gap, m u^2/2 = alpha G^(a + 1)/(a + 1).
    """
    a, alpha = float(method.exponent), float(method.penalty)  # type: ignore[attr-defined]
    mass, p = 0.5 * float(particles.mass.min()), 1.0 / (a + 1.0)
    fall = math.hypot(*(scene.gravity or (0.0,))) * scene.finite_size()
    speed = math.sqrt(particles.fastest() ** 2 + 2.0 * fall)
    if a == 1.0:
        return math.pi * math.sqrt(mass / alpha)
    if speed == 0.0:
        return math.inf
    deepest = math.pow(0.5 * mass * speed * speed * (a + 1.0) / alpha, p)
    return 2.0 * math.sqrt(math.pi) * math.gamma(1.0 + p) / math.gamma(0.5 + p) * deepest / speed
