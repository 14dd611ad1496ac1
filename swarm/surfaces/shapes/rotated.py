"""A surface turned about the origin: every function of it, asked in its own frame.

A surface that is not rotated has no `Rotated` around it and pays nothing.
"""

from collections.abc import Callable
from typing import Any

from ...kernel.gravity import Gravity, as_vector
from ...kernel.vector import Vec, dot
from .. import contract, flights
from ..rotation import Rotated


def own(surface, a):
    """A vector of the scene in the surface's own frame."""
    return surface.x * a.x + surface.y * a.y + surface.z * a.z


def scene(surface, a):
    """A vector of the surface's own frame in the scene."""
    return Vec(dot(surface.x, a), dot(surface.y, a), dot(surface.z, a))


def _own_gravity(gravity, surface):
    """The same of gravity."""
    return None if gravity is None else Gravity(*own(surface, as_vector(gravity)))


def _turned(made: Callable[[Any], Any], *functions: Any) -> None:
    for function in functions:
        function.register(Rotated, made(function))


# Numba and `by_type` compare the names of arguments: one definition for each list of them and kind of result.
_turned(
    lambda f: lambda surface: f(surface.body),
    contract.flat, contract.is_quartic, contract.may_be_far, contract.chord_sweeps, contract.farthest_push,
    flights.in_steps,
)  # fmt: skip
_turned(lambda f: lambda surface, q: f(surface.body, q), contract.gap_of, contract.level_of)
_turned(lambda f: lambda surface, q0, q1: f(surface.body, q0, q1), contract.gap_slope)
_turned(
    lambda f: lambda surface, r: f(surface.body, own(surface, r)),
    contract.phi, contract.inner, contract.distance, contract.gap_scale,
)  # fmt: skip
_turned(
    lambda f: lambda surface, r: scene(surface, f(surface.body, own(surface, r))),
    contract.gradient, contract.slope, contract.unit_normal, contract.settle,
)  # fmt: skip
_turned(lambda f: lambda surface, r, v: f(surface.body, own(surface, r), own(surface, v)), contract.first_hit)
_turned(
    lambda f: lambda surface, r, v, pull: f(surface.body, own(surface, r), own(surface, v), own(surface, pull)),
    contract.course, contract.falling_hit, contract.safe_time, contract.outward_acceleration,
)  # fmt: skip
_turned(
    lambda f: lambda surface, r0, r1: scene(surface, f(surface.body, own(surface, r0), own(surface, r1))),
    contract.inner_gradient, contract.step_normal,
)  # fmt: skip
_turned(
    lambda f: lambda surface, r0, p, kappa: scene(surface, f(surface.body, own(surface, r0), own(surface, p), kappa)),
    contract.push,
)
_turned(
    lambda f: lambda surface, r0, p, kappa: f(surface.body, own(surface, r0), own(surface, p), kappa), contract.rise
)
_turned(
    lambda f: lambda surface, r, strength: scene(surface, f(surface.body, own(surface, r), strength)), contract.resolve
)
_turned(lambda f: lambda surface, r, p: f(surface.body, own(surface, r), own(surface, p)), contract.chord_guess)
_turned(
    lambda f: lambda surface, r, p, kappa: f(surface.body, own(surface, r), own(surface, p), kappa),
    contract.chord_improve,
)
_turned(
    lambda f: lambda surface, r, p, kappa: scene(surface, f(surface.body, own(surface, r), own(surface, p), kappa)),
    contract.chord_normal,
)
_turned(
    lambda f: lambda surface, gravity, course, row, lane, r, v: f(
        surface.body, _own_gravity(gravity, surface), course, row, lane, own(surface, r), own(surface, v)
    ),
    flights.begin_wall, flights.step_wall,
)  # fmt: skip
