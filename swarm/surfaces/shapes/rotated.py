"""A surface turned about the origin: every function of it, asked in its own frame.

A surface that is not rotated has no `Rotated` around it and pays nothing.
"""

from ...kernel.jit import inlined
from .. import base
from ..rotation import Rotated


@inlined
def _own(surface, x, y, z):
    """A vector of the scene in the surface's own frame."""
    return (
        surface.xx * x + surface.yx * y + surface.zx * z,
        surface.xy * x + surface.yy * y + surface.zy * z,
        surface.xz * x + surface.yz * y + surface.zz * z,
    )


@inlined
def _scene(surface, x, y, z):
    """A vector of the surface's own frame in the scene."""
    return (
        surface.xx * x + surface.xy * y + surface.xz * z,
        surface.yx * x + surface.yy * y + surface.yz * z,
        surface.zx * x + surface.zy * y + surface.zz * z,
    )


# --- The level set ---------------------------------------------------------------------------------------


@base.phi.register(Rotated)
def _(surface, x, y, z):
    x, y, z = _own(surface, x, y, z)
    return base.phi(surface.body, x, y, z)


@base.gradient.register(Rotated)
def _(surface, x, y, z):
    x, y, z = _own(surface, x, y, z)
    return _scene(surface, *base.gradient(surface.body, x, y, z))


# --- Flight ----------------------------------------------------------------------------------------------


@base.first_hit.register(Rotated)
def _(surface, x, y, z, vx, vy, vz):
    x, y, z = _own(surface, x, y, z)
    vx, vy, vz = _own(surface, vx, vy, vz)
    return base.first_hit(surface.body, x, y, z, vx, vy, vz)


@base.falling_hit.register(Rotated)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    x, y, z = _own(surface, x, y, z)
    vx, vy, vz = _own(surface, vx, vy, vz)
    gx, gy, gz = _own(surface, gx, gy, gz)
    return base.falling_hit(surface.body, x, y, z, vx, vy, vz, gx, gy, gz)


@base.safe_time.register(Rotated)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    x, y, z = _own(surface, x, y, z)
    vx, vy, vz = _own(surface, vx, vy, vz)
    gx, gy, gz = _own(surface, gx, gy, gz)
    return base.safe_time(surface.body, x, y, z, vx, vy, vz, gx, gy, gz)


# --- Contact ---------------------------------------------------------------------------------------------


@base.unit_normal.register(Rotated)
def _(surface, x, y, z):
    x, y, z = _own(surface, x, y, z)
    return _scene(surface, *base.unit_normal(surface.body, x, y, z))


@base.chord_guess.register(Rotated)
def _(surface, x, y, z, px, py, pz):
    x, y, z = _own(surface, x, y, z)
    px, py, pz = _own(surface, px, py, pz)
    return base.chord_guess(surface.body, x, y, z, px, py, pz)


@base.chord_improve.register(Rotated)
def _(surface, x, y, z, px, py, pz, kappa):
    x, y, z = _own(surface, x, y, z)
    px, py, pz = _own(surface, px, py, pz)
    return base.chord_improve(surface.body, x, y, z, px, py, pz, kappa)


@base.chord_normal.register(Rotated)
def _(surface, x, y, z, px, py, pz, kappa):
    x, y, z = _own(surface, x, y, z)
    px, py, pz = _own(surface, px, py, pz)
    return _scene(surface, *base.chord_normal(surface.body, x, y, z, px, py, pz, kappa))


@base.inner.register(Rotated)
def _(surface, x, y, z):
    x, y, z = _own(surface, x, y, z)
    return base.inner(surface.body, x, y, z)


@base.distance.register(Rotated)
def _(surface, x, y, z):
    x, y, z = _own(surface, x, y, z)
    return base.distance(surface.body, x, y, z)


@base.gap_scale.register(Rotated)
def _(surface, x, y, z):
    x, y, z = _own(surface, x, y, z)
    return base.gap_scale(surface.body, x, y, z)


@base.inner_gradient.register(Rotated)
def _(surface, x0, y0, z0, x1, y1, z1):
    x0, y0, z0 = _own(surface, x0, y0, z0)
    x1, y1, z1 = _own(surface, x1, y1, z1)
    return _scene(surface, *base.inner_gradient(surface.body, x0, y0, z0, x1, y1, z1))


@base.push.register(Rotated)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    x0, y0, z0 = _own(surface, x0, y0, z0)
    px, py, pz = _own(surface, px, py, pz)
    return _scene(surface, *base.push(surface.body, x0, y0, z0, px, py, pz, kappa))


@base.rise.register(Rotated)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    x0, y0, z0 = _own(surface, x0, y0, z0)
    px, py, pz = _own(surface, px, py, pz)
    return base.rise(surface.body, x0, y0, z0, px, py, pz, kappa)


@base.resolve.register(Rotated)
def _(surface, x, y, z, strength):
    x, y, z = _own(surface, x, y, z)
    return _scene(surface, *base.resolve(surface.body, x, y, z, strength))


@base.settle.register(Rotated)
def _(surface, x, y, z):
    x, y, z = _own(surface, x, y, z)
    return _scene(surface, *base.settle(surface.body, x, y, z))


@base.chord_sweeps.register(Rotated)
def _(surface):
    return base.chord_sweeps(surface.body)


@base.gap_of.register(Rotated)
def _(surface, q):
    return base.gap_of(surface.body, q)


@base.level_of.register(Rotated)
def _(surface, q):
    return base.level_of(surface.body, q)


@base.gap_slope.register(Rotated)
def _(surface, q0, q1):
    return base.gap_slope(surface.body, q0, q1)


@base.farthest_push.register(Rotated)
def _(surface):
    return base.farthest_push(surface.body)


@base.flat.register(Rotated)
def _(surface):
    return base.flat(surface.body)


@base.is_quartic.register(Rotated)
def _(surface):
    return base.is_quartic(surface.body)


@base.may_be_far.register(Rotated)
def _(surface):
    return base.may_be_far(surface.body)


@base.course.register(Rotated)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    x, y, z = _own(surface, x, y, z)
    vx, vy, vz = _own(surface, vx, vy, vz)
    gx, gy, gz = _own(surface, gx, gy, gz)
    return base.course(surface.body, x, y, z, vx, vy, vz, gx, gy, gz)
