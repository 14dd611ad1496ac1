"""The collision of two balls: equal and opposite impulses, with the prescribed energy of the pair."""

import math
from typing import Any

from ...kernel.arrays import index
from ...kernel.jit import select
from ...kernel.record import Record
from ...kernel.vector import dot, square, with_square
from .next_collision import between
from .rubbing import rub_pair

# The square of the least speed at which balls part, as a part of their speeds: four roundings.
_PARTS = 2.0**-100


class Loss(Record):
    """The loss of energy in collisions."""

    restitution: float
    duration: float  # t_c [s]: a ball that collided less than this ago loses no energy

    def spares(self, flock, i, now):
        """Whether a ball loses no energy in an impact now, on a ball or on a wall."""
        return now - flock.last[index(i)] < self.duration


class Met(Record):
    """A collision: both velocities after it, r_ij . J_ij [J s], and the energy that is lost [J]."""

    one: Any
    other: Any
    virial: float
    lost: float


def turned(u, n, closing, distance2, restitution):
    """Return the relative velocity w after a collision, scaled to |w|^2 = |u|^2 - lost, and `lost`: twice the loss."""
    e = 1.0 if restitution is None else restitution
    share = (1.0 + e) * closing / distance2
    w = u - share * n
    lost = 0.0 if restitution is None else (1.0 - e) * (1.0 + e) * closing * closing / distance2
    return with_square(w, square(u) - lost), lost


def _parted(u, b, distance2, speed2):
    """Return a relative velocity that parts two balls by at least round-off; `speed2` is |v|^2 + |w|^2 of both.

    Otherwise two balls that touch and fly on together would collide without end.
    """
    away, least2 = dot(b, u), _PARTS * speed2 * distance2
    slow = (away < 0.0) | (away * away < least2)
    return u + select(slow, (math.sqrt(least2) - away) / distance2, 0.0) * b


def met(box, flock, one, two, now):
    """Collide and turn two balls that touch now; return the `Met`. Each is its number, position and velocity."""
    (i, r, v), (j, other, w) = one, two
    b, u = between(box.grid, r, other), w - v
    closing, distance2 = dot(b, u), square(b)
    restitution: Any = None
    if box.loss is not None:
        spares = box.loss.spares(flock, i, now) | box.loss.spares(flock, j, now)
        restitution = select(spares, 1.0, box.loss.restitution)
    after, lost = turned(u, b, closing, distance2, restitution)
    if box.growth is not None:
        after = box.growth.turned(u, b, closing, distance2, now)
    share = box.kinds.share(i, j)
    mass = box.kinds.mass_of(i) * share
    parted = _parted(after, b, distance2, square(v) + square(w))
    change, taken = parted - u, 0.5 * mass * lost
    virial = mass * dot(b, change)
    if box.turning is not None and box.turning.friction is not None:
        n = b * (1.0 / math.sqrt(distance2))
        rubbed, lost_by_friction = rub_pair(box.kinds, box.turning, (i, j), n, parted, abs(dot(change, n)))
        change, taken = change + rubbed, taken + lost_by_friction
    return Met(v - share * change, w + box.kinds.share(j, i) * change, virial, taken)
