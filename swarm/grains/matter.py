"""The `Matter` of soft balls that kernels take, made from a scene and its method, and the checks before a run."""

import logging
import math

import numpy as np
from numpy.typing import NDArray

from ..compiled_scene import CompiledScene
from ..contact.damping import damping_of
from ..errors import SceneError
from ..methods import Penalty
from ..methods.base import Method
from ..methods.fixed_step import longest_step, way_of_walls
from ..motion import Guide, speed_at_start
from ..pairs import Pairs
from ..particles import Particles
from ..scene import Scene
from ..surfaces.surface import Surface
from .cell import Lengths
from .contacts import Losses, Matter
from .overlaps import Limits

_LOG = logging.getLogger("swarm")
# The least restitution that steps can follow: the damper of a smaller one is too strong.
_MOST_DAMPED = 0.01
# Steps in the shortest contact, or in half a period of a spring. With fewer than `_FEWEST` there is a warning, which
# proposes `_GOOD`.
_FEWEST, _GOOD = 6.0, 20.0


def matter_of(compiled: CompiledScene, method: Method, radius: NDArray[np.float64]) -> Matter:
    """Return the `Matter` of a scene with balls of these radii, in steps of a method."""
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
        _limits(float(radius.min()), longest_step(scene, dt, balls=True), way_of_walls(scene, dt)),
        compiled.openings(),
        slips=method.friction_tolerance,  # type: ignore[attr-defined]
    )


def _limits(least: float, longest: float | None, way: float) -> Limits:
    """Return the `Limits` of balls with the least radius `least`, where walls move by up to `way` in a step [m]."""
    # A ball that moves by no more than the least radius, and overlaps by less than half of it at both ends of the step,
    # passes neither a triangle nor the surface of another ball. The way of a moving wall adds to the move.
    move = max(least - way, 0.0)
    return Limits(0.5 * least, move if longest is None else min(move, longest), longest)


def _losses(alpha: float, given: Pairs | Surface) -> Losses:
    """Return the `Losses` at contacts of pairs, or at contacts with a surface."""
    friction = given.friction if given.friction or given.rolling else None
    return Losses(damping_of(alpha, given.restitution), friction, given.rolling or None)


def require_soft_balls(scene: Scene, particles: Particles, method: Method) -> None:
    """Raise a `SceneError` if dampers or steps of soft balls are out of range."""
    if not isinstance(method, Penalty):
        return
    _require_damping(scene)
    _require_steps(particles, method)
    _warn_of_steps(scene, particles, method)
    _warn_of_springs(scene, method)


def _require_damping(scene: Scene) -> None:
    """Raise a `SceneError` for a restitution that a damper cannot give."""
    named = [(f"surfaces[{i}]", one.restitution) for i, whole in enumerate(scene.surfaces) for one in whole.surfaces()]
    for name, value in (*named, *(() if scene.pairs is None else [("pairs", scene.pairs.restitution)])):
        if value < _MOST_DAMPED:
            raise SceneError(
                f"{name}.restitution must be {_MOST_DAMPED:g} or more with Penalty: its dampers grow as it "
                f"becomes less, got {value:g}"
            )


def _require_steps(particles: Particles, method: Penalty) -> None:
    """Raise a `SceneError` if the fastest ball can jump over another ball in a step."""
    radius, velocity = particles.radius, particles.velocity
    assert radius is not None
    if not len(particles):
        return
    fastest = int(np.argmax((velocity**2).sum(axis=0)))
    moves = method.dt * np.sqrt(((velocity - velocity[:, [fastest]]) ** 2).sum(axis=0))
    reach = radius + radius[fastest]
    k = int(np.argmax(moves / reach))
    if moves[k] > reach[k]:
        raise SceneError(
            f"dt must be so small that no particle jumps over another one in a step, got dt = {method.dt:g} s, in "
            f"which particle {k} moves by {moves[k]:.3g} m against particle {fastest}, and their radii are "
            f"{reach[k]:.3g} m in all; use dt < {method.dt * reach[k] / moves[k]:.2g} s, or Impact"
        )


def _warn_of_steps(scene: Scene, particles: Particles, method: Penalty) -> None:
    """Warn if a step is a large part of a contact."""
    if not len(particles):
        return
    lightest, fastest = float(particles.mass.min()), particles.fastest()
    met = [(0.5 * lightest, fastest, "two of the lightest that meet at the speed of the fastest")]
    for i, surface in enumerate(scene.surfaces):
        if (heavy := surface.mass) is not None:
            speed = fastest + math.hypot(*speed_at_start(surface.motion))
            met.append((lightest * heavy / (lightest + heavy), speed, f"the lightest and surfaces[{i}], {heavy:g} kg,"))
    shortest, which = min((_contact_time(scene, method, mass, speed), words) for mass, speed, words in met)
    if method.dt * _FEWEST > shortest:
        _LOG.warning(
            "dt = %g s is long for the contacts of these balls: %s touch for %.3g s; use dt <= %.2g s, or a softer "
            "penalty", method.dt, which, shortest, shortest / _GOOD,
        )  # fmt: skip


def _warn_of_springs(scene: Scene, method: Penalty) -> None:
    """Warn if a step is a large part of half a period of a wall on a spring."""
    for i, surface in enumerate(scene.surfaces):
        motion, mass = surface.motion, surface.mass
        if mass is not None and isinstance(motion, Guide) and motion.stiffness > 0.0:
            half = math.pi * math.sqrt(mass / motion.stiffness)
            if method.dt * _FEWEST > half:
                _LOG.warning(
                    "dt = %g s is long for the spring of surfaces[%d]: half a period of %g kg on it is %.3g s; use dt "
                    "<= %.2g s, or a softer spring", method.dt, i, mass, half, half / _GOOD,
                )  # fmt: skip


def _contact_time(scene: Scene, method: Penalty, mass: float, speed: float) -> float:
    """The duration of a contact without losses [s], of one moving mass [kg] that arrives with a speed [m/s].

    The solution of m g'' = -alpha g^a that leaves g = 0 with the speed u is back at g = 0 after
    2 sqrt(pi) Gamma(1 + p)/Gamma(1/2 + p) G/u, where p = 1/(a + 1) and G is the largest gap,
    m u^2/2 = alpha G^(a + 1)/(a + 1).
    """
    a, alpha = float(method.exponent), float(method.penalty)
    p = 1.0 / (a + 1.0)
    fall = math.hypot(*(scene.gravity or (0.0,))) * scene.finite_size()
    speed = math.sqrt(speed**2 + 2.0 * fall)
    if a == 1.0:
        return math.pi * math.sqrt(mass / alpha)
    if speed == 0.0:
        return math.inf
    deepest = math.pow(0.5 * mass * speed * speed * (a + 1.0) / alpha, p)
    return 2.0 * math.sqrt(math.pi) * math.gamma(1.0 + p) / math.gamma(0.5 + p) * deepest / speed
