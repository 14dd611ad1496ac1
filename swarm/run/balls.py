"""Checks of particles with a radius before a run starts."""

import numpy as np

from ..errors import SceneError
from ..methods import Impact, Penalty
from ..methods.base import Method
from ..pairs import MOST_PRESSED
from ..particles import Particles
from ..placing.cells import overlaps_of
from ..placing.sequential import require_size
from ..placing.shapes import require_shapes
from ..scene import Scene
from .instants import require_instants_of_balls
from .options import RunOptions
from .soft import require_soft_balls
from .starts import error_of

# Balls overlap by round-off of their places at the start: this many times that of the largest coordinate.
_ROUND_OFF = 64.0 * np.finfo(np.float64).eps


def require_balls(scene: Scene, particles: Particles | None, method: Method, options: RunOptions) -> None:
    """Raise a `SceneError` where particles with a radius do not go with the scene, the method or the options.

    Where contacts turn balls that have no spin, they get one of 0.
    """
    if particles is None or particles.radius is None:
        if not scene.surfaces:
            raise SceneError(
                "surfaces must hold at least one surface for particles without a radius, which meet nothing else, got "
                "none; give the walls, or give the particles a radius, by which they meet one another in free space"
            )
        if scene.pairs is not None:
            raise SceneError(
                "pairs must be None where particles have no radius, points do not meet one another, got "
                f"{scene.pairs}; give the particles a radius, or leave pairs out"
            )
        return
    if not isinstance(method, (Impact, Penalty)):
        raise SceneError(
            f"radius of the particles must be None with {type(method).__name__}, got radii; Impact and Penalty know "
            "particles that meet"
        )
    _require_method(scene, particles, method)
    require_shapes(scene, particles.radius)
    _require_options(scene, method, options)
    require_size(scene, particles.radius)
    require_instants_of_balls(scene, particles, method, options)
    require_soft_balls(scene, particles, method)
    if particles.spin is None and _may_turn(scene, method):
        particles.spin = np.zeros_like(particles.position)


def _may_turn(scene: Scene, method: Method) -> bool:
    if method.is_rigid():
        return False
    return (scene.pairs is not None and scene.pairs.friction > 0.0) or any(one.friction for one in scene.surfaces)


def _require_method(scene: Scene, particles: Particles, method: Impact | Penalty) -> None:
    pairs = scene.pairs
    if isinstance(method, Penalty):
        if method.gradient != "composite":
            raise SceneError(
                f'gradient must be "composite" where particles have a radius, got "{method.gradient}"; leave it out'
            )
        if pairs is not None and pairs.contact_duration is not None:
            raise SceneError(
                "pairs.contact_duration must be None with Penalty, whose contacts last as long as they do, got "
                f"{pairs.contact_duration:g} s; leave it out, or use Impact"
            )
        return
    if method.contact_step > 0.0:
        raise SceneError(
            f"contact_step must be 0 where particles have a radius, got {method.contact_step:g}; leave it out"
        )
    if pairs is not None and pairs.friction > 0.0:
        raise SceneError(
            f"pairs.friction must be 0 with Impact, which has none between particles, got {pairs.friction:g}; use "
            "Penalty, or leave it out"
        )
    if particles.spin is not None:
        raise SceneError(
            "spin must be None with Impact, whose impacts turn no ball, got spins; use Penalty, or set spin to None"
        )


def _require_options(scene: Scene, method: Method, options: RunOptions) -> None:
    """Raise a `SceneError` for options of particles that are independent of one another."""
    if options.member_impacts and scene.reacts():
        raise SceneError(
            "member_impacts must be False where particles have a radius and impacts move a surface, got True; leave it "
            "out, or give that surface a motion instead of a mass"
        )
    given = {
        "cluster": options.cluster is not None, "sources": bool(options.sources), "counters": bool(options.counters),
        "member_impacts": options.member_impacts and not isinstance(method, Impact),
    }  # fmt: skip
    for name, is_given in given.items():
        if is_given:
            raise SceneError(
                f"{name} must be left out where particles have a radius, got {getattr(options, name)!r:.100}; it is "
                "of points, which do not meet one another"
            )


def require_apart(scene: Scene, particles: Particles, method: Method) -> None:
    """Raise a `SceneError` where balls overlap one another, or are outside their walls, at the start."""
    radius = particles.radius
    assert radius is not None
    magnitude = max(float(np.abs(particles.position).max()), scene.finite_size())
    if scene.surfaces:
        _require_within(scene, particles, radius, _ROUND_OFF * magnitude, method.is_rigid())
    found = overlaps_of(particles.position, radius, scene.period)
    if found is None:
        return
    i, k = found.pair
    smaller = min(radius[i], radius[k])
    if found.depth <= (_ROUND_OFF * magnitude if method.is_rigid() else MOST_PRESSED * smaller):
        return
    pressed = "" if method.is_rigid() else f" (soft balls may by {MOST_PRESSED:g} of the smaller radius)"
    raise SceneError(
        f"particles must not overlap at the start{pressed}, got {found.number} pairs that do, most particles {i} and "
        f"{k}, by {found.depth:.6g} m: their centres are {radius[i] + radius[k] - found.depth:.6g} m apart, their "
        f"radii {radius[i]:g} and {radius[k]:g} m; move them apart, or let swarm.fill or swarm.pack place them"
    )


def _require_within(scene: Scene, particles: Particles, radius: np.ndarray, close: float, is_rigid: bool) -> None:
    distances = scene.distances_outside(particles.position, 0.0, radius)
    # Where phi is not a number a ball is outside.
    wrong = ~(distances <= (close if is_rigid else close + MOST_PRESSED * radius))
    outside = np.flatnonzero(wrong.any(axis=0))
    if not outside.size:
        return
    raise error_of(scene, particles, outside, distances[:, outside])
