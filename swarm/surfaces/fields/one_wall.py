"""A field as one wall: the distance outside all of it, for soft walls, into which points go.

A point may be in several bodies, or beyond several sides, at once; each is then a spring, as a separate wall would be.
For the exponent 1 their energy is that of one spring with the root of the sum of the squares. This root is the
gap of the whole, and it is smooth where a point leaves one of them. Points outside a mesh are at its nearest
place.
"""

import math
from copy import copy
from typing import Any, TypeVar

from ...kernel.gravity import Gravity, accelerated, displacement
from ...kernel.jit import outlined
from ...kernel.limits import EPSILON
from ...kernel.vector import absolute, dot, norm, square, total
from .. import newton
from ..contract import Smooth
from ..curvature import SPACING, half_hessian
from ..time_of_impact.rising import LevelStep

_Field = TypeVar("_Field")

# The most parts of a flight that are followed before it is reported as free up to there.
_MOST_PARTS = 1000
# The cosine between the normals at both ends of a step: below the first there is an edge, above the second none.
_EDGE, _SMOOTH = 0.5, 0.9


class OneWall(Smooth):
    """All members of a field as one surface; phi is the gap, the signed distance outside."""

    members: Any
    tree: Any  # for a mesh the data that find the nearest triangle; else None

    side = 1.0

    def phi(self, r):
        return _foot(self, r).gap

    def gradient(self, r):
        return _foot(self, r).normal

    def distance(self, r):
        # For bodies phi need not be the distance.
        foot = _foot(self, r)
        return foot.gap / norm(foot.normal)

    @outlined
    def hessian(self, r):
        return half_hessian(self, r, SPACING * total(absolute(r)) + EPSILON)

    def step_bend(self, r0, d):
        # At the deeper end: between both ends there may be an edge.
        r1 = r0 + d
        return self.hessian(r1 if self.phi(r1) > self.phi(r0) else r0)

    def farthest_push(self):
        # phi is about the distance: no pole within a push.
        return math.inf

    def first_hit(self, r, v):
        return _first_hit(self.members, None, r, v)

    def falling_hit(self, r, v, pull):
        return _first_hit(self.members, Gravity(pull.x, pull.y, pull.z), r, v)

    @outlined
    def safe_time(self, r, v, pull):
        """Return when a fall may meet a member, or is in another cell; 0 in contact."""
        if self.phi(r) > 0.0:
            return 0.0
        return self.members.field_hit(Gravity(pull.x, pull.y, pull.z), r, v).time

    def moving_step(self, seen, longest):
        # No farther than the nearest place
        speed, gap = seen.bounds(longest).speed, self.distance(seen.r)
        return LevelStep(gap, 0.0, min(longest, max(-gap, 0.0) / speed) if speed > 0.0 else longest)

    def loosened(self, reach):
        """Return the wall for places in its frame with a round-off that is larger by that of `reach` [m]."""
        return self._replace(members=self.members.loosened(reach))

    def clearance(self, r):
        return max(-self.distance(r), 0.0)

    @outlined
    def discrete_gradient(self, r0, r1):
        """Gonzalez's, with the mean of the gradients at both ends weighted by depth, which has no jump at corners.

        If these turn by more than a wall does in a step, as at an edge towards the points, the gradient at the start.
        """
        one, other = _foot(self, r0), _foot(self, r1)
        a, b = max(one.gap, 0.0), max(other.gap, 0.0)
        if a + b == 0.0:
            a, b = (1.0, 0.0) if one.gap > other.gap else (0.0, 1.0)
        if a > 0.0:
            cosine = dot(one.normal, other.normal) / (norm(one.normal) * norm(other.normal))
            b *= min(max((cosine - _EDGE) / (_SMOOTH - _EDGE), 0.0), 1.0)
        g, d = (a / (a + b)) * one.normal + (b / (a + b)) * other.normal, r1 - r0
        d2, rest = square(d), (other.gap - one.gap) - dot(g, d)
        return g + (rest / d2) * d if d2 > 0.0 else g

    def push(self, r0, p, kappa):
        # Without a push no solution is needed.
        return newton.push(self, r0, p, kappa) if kappa != 0.0 else r0 + p

    def rise(self, r0, p, kappa):
        return newton.rise(self, r0, p, kappa) if kappa != 0.0 else _free_rise(self, r0, r0 + p)

    def turned_push(self, r0, p, kappa, tilt):
        return newton.push(self, r0, p, kappa, tilt) if kappa != 0.0 else r0 + p

    def turned_rise(self, r0, p, kappa, tilt):
        return newton.rise(self, r0, p, kappa, tilt) if kappa != 0.0 else _free_rise(self, r0, r0 + p)


def one_wall(surface: _Field) -> _Field:
    """Return the same field, taken as one wall by kernels."""
    made = copy(surface)
    object.__setattr__(made, "is_one_wall", True)
    return made


@outlined
def _foot(whole, r):
    return whole.members.foot(whole.tree, r)


def _free_rise(whole, r0, r1):
    """`rise` of a step that is not pushed."""
    g = whole.discrete_gradient(r0, r1)
    return dot(g, r1 - r0), -dot(g, whole.gradient(r1))


@outlined
def _first_hit(members, gravity, r, v):
    """Return when the flight meets the first member: (time, whether it does then), from cell to cell."""
    t, place, pace = 0.0, r, v
    for _part in range(_MOST_PARTS):
        hit = members.field_hit(gravity, place, pace)
        t += hit.time
        if hit.wall >= 0.0 or not t < math.inf:
            return t, True
        place, pace = r + displacement(gravity, v, t), accelerated(gravity, v, t)
    return t, False
