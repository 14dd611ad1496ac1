"""What particles with a radius do to one another."""

from dataclasses import dataclass, field
from typing import Any

from .common.validated import Magnitude, Part, Validated
from .errors import SceneError

# Of soft contacts: the largest overlap that a start may have, as a part of the radius of the smaller ball.
MOST_PRESSED = 0.2


@dataclass(frozen=True)
class Pairs(Validated):
    """The impact of two particles that have a radius, for the whole scene.

    Args:
        restitution: e in [0, 1]: the normal velocity of two particles that meet turns from u_n into -e u_n; 1 keeps the
            energy.
        friction: Coulomb's coefficient between particles, 0 or more. Particles then have a spin, of 0 where none is
            given.
        contact_duration: t_c [s], of Impact: a particle that met another less than this before meets particles and
            walls without a loss, so that losing impacts never become infinitely many in a time. 0: never; None: 1e-4
            of the time in which the smallest particle flies its diameter, under gravity 1e-3 of that in which it flies
            or falls so far. Balls that rest under gravity collide without end, about once in this time: a run says so,
            and a longer time, or `Penalty`, makes it shorter.
        rolling: the resistance to rolling, of Penalty, 0 or more: an angular impulse against the relative angular
            velocity across the normal, of at most this times R_i R_j/(R_i + R_j) times the normal impulse, and at most
            what stops the rolling. With friction.

    Raises:
        SceneError: an argument is out of its range.

    >>> Pairs(restitution=0.9)
    Pairs(restitution=0.9, friction=0.0, contact_duration=None, rolling=0.0)
    """

    restitution: Part = 1.0
    friction: Magnitude = 0.0
    contact_duration: Magnitude | None = None
    rolling: Magnitude = field(default=0.0, metadata={"younger": True})


def checked_pairs(value: Any) -> Pairs | None:
    """The argument `pairs` of a scene."""
    if value is not None and not isinstance(value, Pairs):
        raise SceneError(f"pairs must be a swarm.Pairs, got {type(value).__name__}")
    return value
