"""The next impact of one point without a run: the exact flight to it, and the velocity after it."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..common import checks
from ..contact.laws import NONE
from ..contact.wall_impact import Arriving, impact_on_wall
from ..errors import RunError, SceneError
from ..kernel.gravity import accelerated, displacement, potential
from ..kernel.random import seeding_of
from ..kernel.vector import square, vec
from ..methods import Impact
from ..particles import Particles
from ..scene import Scene
from ..state import Floats
from ..surfaces.plane import require_start
from ..surfaces.time_of_impact import flights
from .options import RunOptions
from .preflight.knows import Asked, require_supported
from .preflight.starts import require_inside

# The most parts of a flight, each of which surely meets no wall, in the search for a hit.
_PARTS = 1000


class NextImpact(NamedTuple):
    """The next impact of one point.

    Attributes:
        time: the time of the flight to the impact [s].
        position: the place of the impact (3,) [m].
        velocity: the velocity after it (3,) [m/s].
        velocity_before: the velocity before it (3,) [m/s].
        surface: the number of the surface in the scene.
    """

    time: float
    position: Floats
    velocity: Floats
    velocity_before: Floats
    surface: int


def bounce(scene: Scene, position: ArrayLike, velocity: ArrayLike, mass: float = 1.0, seed: int = 0) -> NextImpact:
    """Return the next impact of one point by `Impact`; repeat the call to walk from impact to impact.

    Args:
        scene: walls at rest, without openings and without a period, and gravity.
        position: three numbers [m]; inside, or on a wall, as after an impact.
        velocity: three numbers [m/s].
        mass: the mass of the point [kg], above 0; laws of walls and temperatures depend on it.
        seed: seed of the random numbers of walls, from 0 to 2**64 - 1. Give another seed for each impact.

    Returns:
        A `NextImpact`.

    Raises:
        SceneError: a bad argument, or the flight meets no wall, or goes along a wall.
        RunError: a user-defined law returns a velocity that is not finite.

    Conserves: the energy ½mv² − mG·r to round-off, except for the energy that the wall takes or gives.

    >>> import swarm
    >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    >>> met = swarm.bounce(cavity, (0.0, 0.0, 0.0), (2.0, 0.0, 0.0))
    >>> met.time, met.position.tolist(), met.velocity.tolist()
    (0.25, [0.5, 0.0, 0.0], [-2.0, 0.0, 0.0])
    >>> swarm.bounce(cavity, met.position, met.velocity).time
    0.5
    """
    checks.of_class("scene", scene, Scene)
    particle = Particles(position, velocity, mass)
    if len(particle) != 1:
        raise SceneError(f"position must be three numbers, got shape {particle.position.shape}")
    require_supported(Asked(scene, particle, Impact(), RunOptions(until=1.0)))
    _require_simple(scene)
    require_start(scene, particle)
    require_inside(scene, particle)
    compiled = scene.compiled()
    walls, pull = compiled.walls(), scene.pull()
    laws = compiled.laws or NONE
    random = seeding_of(checks.seed("seed", seed)).of_impact(0, 0, laws)
    r, v, flown = vec(particle.position[:, 0]), vec(particle.velocity[:, 0]), 0.0
    # The functions of kernels run in plain Python; with numbers of NumPy, 1/0 is infinite as in compiled kernels.
    with np.errstate(all="ignore"):
        twice = square(v) + 2.0 * potential(pull, r)
        for _part in range(_PARTS):
            time, wall = flights.first_hit(walls, pull, r, v)
            if not time < math.inf:
                break
            flown += float(time)
            r, v = r + displacement(pull, v, time), accelerated(pull, v, time)
            if wall >= 0.0:
                r = walls.project(wall, r)
                sent = impact_on_wall(laws, walls, pull, wall, Arriving(r, v, twice, float(particle.mass[0])), random).v
                after = np.array([*sent], np.float64)
                if not np.isfinite(after).all():
                    raise RunError(f"the law of the wall gives {tuple(after.tolist())} m/s, which is not finite")
                surface = int(compiled.numbering.members[0, int(wall)])
                if flown == 0.0 and after.tolist() == [*v]:
                    raise SceneError(
                        f"velocity must lead off the wall, got {tuple(after.tolist())}, which goes along "
                        f"surfaces[{surface}] at {tuple(map(float, r))}: the point slides there, and has "
                        "no next impact; simulate lets it slide"
                    )
                return NextImpact(flown, np.array([*r], np.float64), after, np.array([*v], np.float64), surface)
    came = tuple(particle.velocity[:, 0].tolist())
    raise SceneError(f"velocity must lead to a surface, got {came}, which never does")


def _require_simple(scene: Scene) -> None:
    """Raise a `SceneError` unless all walls of the scene are at rest, closed, and always present."""
    if scene.period is not None:
        raise SceneError("period must be None for a bounce, got one; use simulate with impacts=, a log of every impact")
    for i, surface in scene.pieces.owned():
        asked = {"motion": surface.motion is not None, "mass": surface.reacts(), "openings": bool(surface.openings)}
        asked["times at which it is present"] = surface.present is not None
        for what, has in asked.items():
            if has:
                raise SceneError(
                    f"surfaces[{i}] must have no {what} for a bounce, got {surface!r:.200}; use simulate with "
                    "impacts=, a log of every impact"
                )
