"""A wall that moves, over one step: what it takes along, how fast in the mean, and the step in its frame.

In the frame of a wall that is displaced by d(t) and does not turn a step goes from rho0 = r0 - d0 by rho1 - rho0 =
r1 - r0 - (d1 - d0): it is that at a wall at rest, with the free displacement p - (d1 - d0).
"""

import math

from ..kernel.angle import sine_and_versine
from ..kernel.jit import by_type, inlined, select
from ..kernel.vector import ZERO, Vec, absolute, cross, dot, norm, times, total
from . import contract
from .drive import Rows, Track, Turn, tracked, turned
from .fold import Chain
from .posed import Posed, arm, out, own_end, own_place


@by_type
def _carried_to(spin, surface, r):
    return surface.end.shift - surface.pose.shift + r


@_carried_to.register(Vec)
def _(spin, surface, r):
    rate = norm(spin)
    k = spin / select(rate > 0.0, rate, 1.0)
    sine, versine = sine_and_versine(rate * (surface.left - surface.after))
    before = arm(surface, r)
    after = before + versine * (dot(k, before) * k - before) + sine * cross(k, before)
    return surface.drive.center + surface.end.shift + after


contract.carry.register(Posed, lambda surface, r: _carried_to(surface.drive.spin, surface, r))


# The mean of a velocity over a step, not the difference of two places over its length: of a short step that has no
# digits left, and a particle that friction stops takes ever shorter ones.


@by_type
def _mean_of_swings(swings, middle, h):
    """Of C (cos w t - 1) + S sin w t: w sinc(w h/2) (S cos w m - C sin w m) at the middle m."""
    return ZERO


@_mean_of_swings.register(Chain)
def _(swings, middle, h):
    one = swings.first
    angle = one.rate * middle
    here = one.sine * math.cos(angle) - one.cosine * math.sin(angle)
    return _mean_of_swings(swings.rest, middle, h) + (one.rate * _sinc(0.5 * one.rate * h)) * here


@inlined
def _sinc(x):
    return select(abs(x) > 0.0, math.sin(x) / select(abs(x) > 0.0, x, 1.0), 1.0)


@by_type
def _mean_of_track(track, middle, h):
    """By Simpson's rule, exact within a piece."""
    return ZERO


@_mean_of_track.register(Track)
def _(track, middle, h):
    _d, first, _a = tracked(track, middle - 0.5 * h)
    _d, second, _a = tracked(track, middle)
    _d, third, _a = tracked(track, middle + 0.5 * h)
    return (first + 4.0 * second + third) * (1.0 / 6.0)


@by_type
def _mean_of_turn(turn, surface, r0, r1, h):
    """(A1 - A0) rho/h of the mean of both ends in the frame of the wall: w sinc(w h/2) k x A(m) rho."""
    return ZERO


@_mean_of_turn.register(Turn)
def _(turn, surface, r0, r1, h):
    mean = 0.5 * (own_place(surface, r0) + own_end(surface, r1)) - surface.drive.center
    middle = turned(turn, -0.5 * (surface.left + surface.after))
    return (turn.rate * _sinc(0.5 * turn.rate * h)) * cross(turn.axis, out(middle, mean))


@contract.mean_velocity.register(Posed)
def _(surface, r0, r1, h):
    drive, middle = surface.drive, -0.5 * (surface.left + surface.after)
    moved = drive.velocity + _mean_of_swings(drive.swings, middle, h) + _mean_of_track(drive.track, middle, h)
    return moved + _mean_of_turn(drive.turn, surface, r0, r1, h)


# --- The step in its frame -------------------------------------------------------------------------------

contract.way.register(Posed, lambda surface: surface.end.shift - surface.pose.shift)
contract.end_inner.register(Posed, lambda surface, r: contract.inner(surface.body, own_end(surface, r)))


@contract.gap_scale.register(Posed)
def _(surface, r):
    # A place in the frame has the round-off of the displacement and of the time too.
    own = own_place(surface, r)
    gradient, late = contract.gradient(surface.body, own), surface.drive.late
    moved = total(absolute(times(gradient, surface.pose.shift))) + late * total(absolute(gradient))
    return contract.gap_scale(surface.body, own) + moved


@by_type
def place_scale(surface, s):
    """What the round-off of a place in the frame of a wall is relative to, from that of its coordinates."""
    return s


@place_scale.register(Posed)
def _(surface, s):
    late = surface.drive.late
    return s + absolute(surface.pose.shift) + Vec(late, late, late)


@inlined
def _free(surface, p):
    """A free displacement in the frame of the wall."""
    return p - contract.way(surface)


@contract.push.register(Posed)
def _(surface, r0, p, kappa):
    return surface.end.shift + contract.push(surface.body, own_place(surface, r0), _free(surface, p), kappa)


@contract.rise.register(Posed)
def _(surface, r0, p, kappa):
    return contract.rise(surface.body, own_place(surface, r0), _free(surface, p), kappa)


@contract.resolve.register(Posed)
def _(surface, r, strength):
    return surface.pose.shift + contract.resolve(surface.body, own_place(surface, r), strength)


@contract.chord_guess.register(Posed)
def _(surface, r, p):
    return contract.chord_guess(surface.body, own_place(surface, r), _free(surface, p))


@contract.chord_improve.register(Posed)
def _(surface, r, p, kappa):
    return contract.chord_improve(surface.body, own_place(surface, r), _free(surface, p), kappa)


@by_type
def framed(surface, r, p):
    """What a step is asked of: the surface at rest in its frame, and the step's start and free displacement there."""
    return surface, r, p


framed.register(Posed, lambda surface, r, p: (surface.body, own_place(surface, r), _free(surface, p)))


@by_type
def _halfway(turn, surface, n):
    """A normal of the frame of the wall, of a step, in the scene."""
    return n


@_halfway.register(Rows)
def _(turn, surface, n):
    # rho1 - rho0 = M^-1 (r1 - r0 - way) with M = (A0 + A1)/2, so n becomes M^-T n = M S^-2 n, where S is cos(a/2)
    # across the axis and 1 along it, with the angle a of the step.
    k = surface.drive.turn.axis
    half = math.sin(0.5 * surface.drive.turn.rate * (surface.left - surface.after))
    along = dot(k, n) * k
    n = along + (n - along) * (1.0 / (1.0 - half * half))
    return 0.5 * (out(surface.pose.turn, n) + out(surface.end.turn, n))


@contract.inner_gradient.register(Posed)
def _(surface, r0, r1):
    n = contract.inner_gradient(surface.body, own_place(surface, r0), own_end(surface, r1))
    return _halfway(surface.pose.turn, surface, n)


@contract.step_normal.register(Posed)
def _(surface, r0, r1):
    n = contract.step_normal(surface.body, own_place(surface, r0), own_end(surface, r1))
    return _unit(surface.pose.turn, _halfway(surface.pose.turn, surface, n))


@by_type
def _unit(turn, n):
    return n


@_unit.register(Rows)
def _(turn, n):
    return n / norm(n)
