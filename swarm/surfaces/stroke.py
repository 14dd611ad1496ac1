"""A wall that moves, over one step: what it takes along, how fast in the mean, and the step in its frame.

In the frame of a wall that is displaced by d(t) and does not turn a step goes from rho0 = r0 - d0 by rho1 - rho0 =
r1 - r0 - (d1 - d0): it is that at a wall at rest, with the free displacement p - (d1 - d0).
"""

import math

from ..kernel.angle import sine_and_versine
from ..kernel.jit import select
from ..kernel.vector import Vec, absolute, cross, dot, norm, times, total
from . import contract
from .posed import Posed


@contract.carry.register(Posed)
def _(surface, r):
    spin = surface.drive.spin
    if spin is None:
        return surface.end.shift - surface.pose.shift + r
    rate = norm(spin)
    k = spin / select(rate > 0.0, rate, 1.0)
    sine, versine = sine_and_versine(rate * (surface.left - surface.after))
    before = surface.arm(r)
    after = before + versine * (dot(k, before) * k - before) + sine * cross(k, before)
    return surface.drive.center + surface.end.shift + after


@contract.mean_velocity.register(Posed)
def _(surface, r0, r1, h):
    drive, middle = surface.drive, surface.middle()
    moved = drive.mean_velocity(middle, h)
    if drive.turn is None:
        return moved
    mean = 0.5 * (surface.own_place(r0) + surface.own_end(r1)) - drive.center
    return moved + drive.turn.mean_velocity(middle, h, mean)


# --- The step in its frame -------------------------------------------------------------------------------

contract.way.register(Posed, lambda surface: surface.end.shift - surface.pose.shift)
contract.end_inner.register(Posed, lambda surface, r: surface.body.inner(surface.own_end(r)))


@contract.gap_scale.register(Posed)
def _(surface, r):
    # A place in the frame has the round-off of the displacement and of the time too.
    own = surface.own_place(r)
    gradient, late = surface.body.gradient(own), surface.drive.late
    moved = total(absolute(times(gradient, surface.pose.shift))) + late * total(absolute(gradient))
    return surface.body.gap_scale(own) + moved


def place_scale(surface, s):
    """What the round-off of a place in the frame of a wall is relative to, from that of its coordinates."""
    if not isinstance(surface, Posed):
        return s
    late = surface.drive.late
    return s + absolute(surface.pose.shift) + Vec(late, late, late)


def framed(surface, r, p):
    """What a step is asked of: the surface at rest in its frame, and the step's start and free displacement there."""
    if not isinstance(surface, Posed):
        return surface, r, p
    return surface.body, surface.own_place(r), p - surface.way()


@contract.push.register(Posed)
def _(surface, r0, p, kappa):
    return surface.end.shift + contract.push(*framed(surface, r0, p), kappa)


contract.rise.register(Posed, lambda surface, r0, p, kappa: contract.rise(*framed(surface, r0, p), kappa))
contract.chord_guess.register(Posed, lambda surface, r, p: contract.chord_guess(*framed(surface, r, p)))
contract.chord_improve.register(
    Posed, lambda surface, r, p, kappa: contract.chord_improve(*framed(surface, r, p), kappa)
)


@contract.resolve.register(Posed)
def _(surface, r, strength):
    return surface.pose.shift + surface.body.resolve(surface.own_place(r), strength)


def _halfway(surface, n):
    """A normal of the frame of the wall, of a step, in the scene."""
    if surface.pose.turn is None:
        return n
    # rho1 - rho0 = M^-1 (r1 - r0 - way) with M = (A0 + A1)/2, so n becomes M^-T n = M S^-2 n, where S is cos(a/2)
    # across the axis and 1 along it, with the angle a of the step.
    k = surface.drive.turn.axis
    half = math.sin(0.5 * surface.drive.turn.rate * (surface.left - surface.after))
    along = dot(k, n) * k
    n = along + (n - along) * (1.0 / (1.0 - half * half))
    return 0.5 * (surface.pose.out(n) + surface.end.out(n))


@contract.inner_gradient.register(Posed)
def _(surface, r0, r1):
    return _halfway(surface, surface.body.inner_gradient(surface.own_place(r0), surface.own_end(r1)))


@contract.step_normal.register(Posed)
def _(surface, r0, r1):
    n = _halfway(surface, surface.body.step_normal(surface.own_place(r0), surface.own_end(r1)))
    return n if surface.pose.turn is None else n / norm(n)
