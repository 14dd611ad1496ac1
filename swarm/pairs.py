"""The impacts of particles with a radius on one another."""

from dataclasses import dataclass, field

from .common import checks
from .common.validated import Magnitude, Part, Validated

# The largest overlap of soft balls at the start, as a part of the radius of the smaller ball.
MOST_PRESSED = 0.2


@dataclass(frozen=True)
class Pairs(Validated):
    """The impact of two particles with a radius, for the whole scene.

    Args:
        restitution: e in [0, 1]: an impact changes the relative normal velocity u_n to -e u_n; 1 conserves the energy.
        friction: Coulomb's coefficient between particles, 0 or more. Particles then have a spin, 0 unless it is given.
        contact_duration: t_c [s], for Impact: for this time after a collision with another particle, a particle meets
            particles and walls without a loss. So a finite time never has infinitely many lossy impacts. 0: each impact
            has its loss; None: 1e-4 of the time in which the smallest particle flies its diameter, under gravity 1e-3
                of the time in which it flies or falls its diameter. Balls that rest under gravity collide about once in
                this time, without end, and the run warns of it. A longer time makes such a run shorter, and so does
                `Penalty`.
        rolling: the coefficient of rolling resistance, for Penalty with friction, 0 or more. An angular impulse opposes
            the relative angular velocity across the normal. It is at most this coefficient times R_i R_j/(R_i + R_j)
            times the normal impulse, and at most the one that stops the rolling.

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
    """Return the argument `pairs` of a scene, checked."""
    if value is not None:
        checks.of_class("pairs", value, Pairs)
    return value
