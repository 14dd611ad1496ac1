"""Plane: phi = n.(r) - offset, the signed distance; inner function q = n.r."""

import math
from dataclasses import dataclass

from ...checks import Vector, number
from ...kernel.jit import select
from ...kernel.vector import Vec, dot, vec
from .. import contract
from ..course import rise_time
from ..rotation import turned, unit
from ..surface import UNBOUNDED, Box, HalfSpace, Surface, is_along
from .common import ExactChord


@dataclass(frozen=True, repr=False)
class Plane(Surface):
    """A plane wall; admissible is normal.r <= offset, with the normal scaled to unit length.

    Args:
        normal: three numbers, not all 0; it points out of the admissible half-space.
        offset: distance of the plane from the origin along the normal [m].

    Raises:
        SceneError: an argument is out of its range.

    >>> Plane(normal=(0, 0, -2), offset=0.0).phi([[0.0], [0.0], [0.25]])
    array([-0.25])
    """

    normal: Vector
    offset: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "normal", unit("normal", self.normal))
        object.__setattr__(self, "offset", number("offset", self.offset))

    def numbers(self) -> "PlaneNumbers":
        return PlaneNumbers(vec(turned(self.rotation, self.normal)), self.offset)

    def walls(self) -> tuple["PlaneNumbers"]:
        return (self.numbers(),)

    def size(self) -> float:
        return math.inf

    def bounds(self) -> Box:
        # Half-spaces bound only together: scene.py does that.
        return UNBOUNDED

    def half_spaces(self) -> list[HalfSpace]:
        return [(turned(self.rotation, self.normal), self.offset)]

    def is_unturned_by(self, axis: Vector, center: Vector) -> bool:
        return is_along(turned(self.rotation, self.normal), axis)

    def extent(self) -> float:
        return abs(self.offset)


class PlaneNumbers(ExactChord):
    """What kernels know of a plane."""

    normal: Vec
    offset: float


# --- The level set ---------------------------------------------------------------------------------------

contract.phi.register(PlaneNumbers, lambda surface, r: contract.inner(surface, r) - surface.offset)
contract.gradient.register(PlaneNumbers, lambda surface, r: surface.normal)
contract.slope.register(PlaneNumbers, lambda surface, r: surface.normal)
contract.unit_normal.register(PlaneNumbers, lambda surface, r: surface.normal)
contract.inner.register(PlaneNumbers, lambda surface, r: dot(surface.normal, r))
contract.gap_of.register(PlaneNumbers, lambda surface, q: q - surface.offset)
contract.gap_slope.register(PlaneNumbers, lambda surface, q0, q1: (1.0, 0.0))


@contract.settle.register(PlaneNumbers)
def _(surface, r):
    return r - (contract.inner(surface, r) - surface.offset) * surface.normal


contract.outward_acceleration.register(PlaneNumbers, lambda surface, r, v, pull: dot(surface.normal, pull))
contract.flat.register(PlaneNumbers, lambda surface: True)


# --- Flight ----------------------------------------------------------------------------------------------


@contract.first_hit.register(PlaneNumbers)
def _(surface, r, v):
    approach = dot(surface.normal, v)
    time = (surface.offset - contract.inner(surface, r)) / approach
    return select(approach > 0.0, select(time > 0.0, time, 0.0), math.inf), True


@contract.falling_hit.register(PlaneNumbers)
def _(surface, r, v, pull):
    c = contract.inner(surface, r) - surface.offset
    return rise_time(c, 0.5 * dot(surface.normal, v), 0.5 * dot(surface.normal, pull)), True


@contract.safe_time.register(PlaneNumbers)
def _(surface, r, v, pull):
    time, _found = contract.falling_hit(surface, r, v, pull)
    return select(contract.inner(surface, r) > surface.offset, 0.0, time)


# --- Contact ---------------------------------------------------------------------------------------------

contract.inner_gradient.register(PlaneNumbers, lambda surface, r0, r1: surface.normal)
contract.step_normal.register(PlaneNumbers, lambda surface, r0, r1: surface.normal)
contract.push.register(PlaneNumbers, lambda surface, r0, p, kappa: r0 + (p - kappa * surface.normal))
contract.rise.register(PlaneNumbers, lambda surface, r0, p, kappa: (dot(surface.normal, p) - kappa, -1.0))
contract.resolve.register(PlaneNumbers, lambda surface, r, strength: r - strength * surface.normal)
contract.farthest_push.register(PlaneNumbers, lambda surface: math.inf)
contract.chord_guess.register(PlaneNumbers, lambda surface, r, p: dot(surface.normal, p))
contract.chord_normal.register(PlaneNumbers, lambda surface, r, p, kappa: surface.normal)
