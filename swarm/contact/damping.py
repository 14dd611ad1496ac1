"""The damping of soft contacts that gives a restitution."""

import functools
import math


def damping_of(alpha: float, restitution: float) -> float | None:
    """Return the damping C of a contact with this restitution, over the root of the effective mass; None for 1.

    With y = Phi(g) and the time of Phi'(g) dt the equation of a contact, m g'' = -V'(g) - C dPhi/dt, is
        y'' + 2 z w y' + w^2 y = 0,   C = 2 z sqrt(alpha m),
    for any exponent of the law [Antypov and Elliott 2011], so that e depends on z alone. The contact ends when the sum
    of spring and damper is 0, not y [Schwager and Poeschel 2007]: with z = sin t
        ln e = -(pi - 2 t) tan t,   and for z = cosh t   ln e = -2 t/tanh t.
    """
    return None if restitution == 1.0 else 2.0 * _part_of_critical(restitution) * math.sqrt(alpha)


@functools.lru_cache
def _part_of_critical(restitution: float) -> float:
    """Return z of a restitution below 1. A run calls it for each wall, and twice."""
    wanted = -math.log(restitution)
    low, high = 0.0, 1.0
    while _loss(high) < wanted:
        high *= 2.0
    # Ends when there is no number between them.
    while low < (middle := 0.5 * (low + high)) < high:
        if _loss(middle) < wanted:
            low = middle
        else:
            high = middle
    return high


def _loss(z: float) -> float:
    """Return -ln e for the fraction z of critical damping."""
    if z == 1.0:
        return 2.0
    if z < 1.0:
        t = math.asin(z)
        return (math.pi - 2.0 * t) * math.tan(t)
    t = math.acosh(z)
    return 2.0 * t / math.tanh(t)
