"""What particles with a radius do to one another."""

from dataclasses import dataclass, field

from .common import checks
from .common.validated import Magnitude, Part, Validated

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
        contact_duration: t_c [s], for Impact: for this time after a particle met another one, it meets particles and
            walls without a loss. So lossy impacts are never infinitely many in a finite time. 0: each impact has its
            loss; None: 1e-4 of the time in which the smallest particle flies its diameter, under gravity 1e-3 of the
            time in which it flies or falls that far. Balls that rest under gravity collide about once in this time,
            without end, and the run warns of it. A longer time makes such a run shorter, and so does `Penalty`.
        rolling: the coefficient of rolling resistance, for Penalty with friction, 0 or more. An angular impulse opposes
            the relative angular velocity across the normal. It is at most this coefficient times R_i R_j/(R_i + R_j)
            times the normal impulse, and at most what stops the rolling.

    Raises:
        SceneError: an argument is out of its range.

    >>> Pairs(restitution=0.9)
    Pairs(restitution=0.9, friction=0.0, contact_duration=None, rolling=0.0)
    """

    restitution: Part = 1.0
    friction: Magnitude = 0.0
    contact_duration: Magnitude | None = None
    rolling: Magnitude = field(default=0.0, metadata={"younger": True})


def checked_pairs(value: Pairs | None) -> Pairs | None:
    """The argument `pairs` of a scene."""
    if value is not None:
        checks.of_class("pairs", value, Pairs)
    return value
