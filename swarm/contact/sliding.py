"""Impacts that follow one another too quickly to be told apart: grazing, rolling along a wall, resting, corners, cusps.

A sliding step of length h holds the particle on every wall it touches: with w0 = v0 + h G/2 and P the projection of
w0 on the directions that no touched wall forbids, r1 = r0 + h P and w1 = 2 P - w0. P and w0 - P are orthogonal
(Moreau), so |w1| = |w0|, and with one wall the step is the reflection about its discrete gradient.
"""

import math

import numpy as np

from ..kernel.gravity import accelerated
from ..kernel.jit import by_type, by_type_outlined, outlined, scratch
from ..surfaces import base as surfaces
from ..surfaces import chain as walls
from ..surfaces import flights
from . import reflection
from .projection import ALLOWED, along, project

_EPSILON = 2.220446049250313e-16
# A second wall nearer than this part of the shortest flight is met in the same instant.
_SAME_INSTANT = 1e-6
# Exact reflections within one instant: a wedge of 0.05 rad turns a particle around in its edge.
_BLOWS = 64
# Sweeps until r1 and the discrete gradients agree: each gains the digits of h |v|/R.
_SWEEPS = 60
# Times that a step is cut because another wall is in the way.
_CUTS = 60
# What these ask of every wall; exact reflections ask no more.
NEEDS = (surfaces.first_hit, surfaces.unit_normal, surfaces.inner_gradient, surfaces.distance, surfaces.settle)


@outlined
def impact(
    contact_step, restitution, chain, gravity, surface, x, y, z, vx, vy, vz, left, twice_energy, half_inverse,
    shortest, touch, impulse, lane,
):  # fmt: skip
    """One impact of one particle after a short flight: (x, y, z, vx, vy, vz, time used, twice the energy per mass).

    If the next flight would be shorter than `shortest` too, the particle slides for that time instead. Walls within
    `touch` hold it as well. Adds to impulse[:, lane].
    """
    given = scratch(walls.length(chain), np.float64)
    wx, wy, wz, energy, wall = vx, vy, vz, twice_energy, surface
    for _blow in range(_BLOWS):
        wx, wy, wz, blow, energy = reflection.exact(
            restitution, chain, gravity, wall, x, y, z, wx, wy, wz, energy, half_inverse
        )
        given[int(wall)] += blow
        following, other = flights.first_hit(chain, gravity, x, y, z, wx, wy, wz)
        if following >= shortest or other < 0.0:
            used = 0.0
            if wall == surface:
                x, y, z, wx, wy, wz, used = _stepped(
                    contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, wx, wy, wz, left, energy, half_inverse,
                    given,
                )  # fmt: skip
            for i in range(given.size):
                impulse[i, lane] += given[i]
            return x, y, z, wx, wy, wz, used, energy
        if other == wall or following > _SAME_INSTANT * shortest:
            break
        wall = other
    return _slide(
        restitution, chain, gravity, surface, x, y, z, vx, vy, vz, min(shortest, left), left, twice_energy,
        half_inverse, touch, impulse, lane,
    )  # fmt: skip


@by_type_outlined
def _stepped(contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, wx, wy, wz, left, energy, half_inverse, given):
    """The impact as a contact step of that length, if there is one."""
    return x, y, z, wx, wy, wz, 0.0


@_stepped.register(float)
def _(contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, wx, wy, wz, left, energy, half_inverse, given):
    x, y, z, wx, wy, wz, used, given[int(surface)] = reflection.contact(
        contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, left, energy, half_inverse
    )
    return x, y, z, wx, wy, wz, used


@outlined
def _slide(
    restitution, chain, gravity, surface, x, y, z, vx, vy, vz, h, left, twice_energy, half_inverse, touch, impulse, lane
):
    """One sliding step: the result of `impact`."""
    count = walls.length(chain)
    depth, touched = scratch(count, np.float64), scratch(count, np.bool_)
    held, normal = scratch(count, np.float64), scratch((count, 3), np.float64)
    _depths(chain, 0, x, y, z, depth)
    size = max(abs(x), abs(y), abs(z))
    for i in range(count):
        touched[i] = depth[i] >= -touch
    touched[int(surface)] = True
    given = scratch(count, np.float64)
    vx, vy, vz, energy = _landed(restitution, chain, touched, normal, given, x, y, z, vx, vy, vz, twice_energy)
    if _goes_straight(chain, gravity, touched, normal, held, x, y, z, vx, vy, vz):
        h = left
    ux, uy, uz, h = _unhindered(chain, gravity, touched, normal, held, x, y, z, vx, vy, vz, h, touch, size)
    wx, wy, wz = accelerated(gravity, vx, vy, vz, 0.5 * h)
    wx, wy, wz = accelerated(gravity, 2.0 * ux - wx, 2.0 * uy - wy, 2.0 * uz - wz, 0.5 * h)
    moves = ux != 0.0 or uy != 0.0 or uz != 0.0
    if moves:
        x, y, z = x + h * ux, y + h * uy, z + h * uz
        x, y, z = _settled(chain, surface, touched, held, depth, x, y, z)
    speed2, half_inverse = reflection.speed2_at(gravity, x, y, z, energy, half_inverse)
    half_inverse = reflection.half_inverse_after(restitution, speed2, wx, wy, wz, half_inverse)
    wx, wy, wz = reflection.restore(gravity, wx, wy, wz, speed2, half_inverse)
    for i in range(count):
        impulse[i, lane] += given[i] + 2.0 * held[i]
    return x, y, z, wx, wy, wz, h, energy


@outlined
def _unhindered(chain, gravity, touched, normal, held, x, y, z, vx, vy, vz, h, touch, size):
    """P of the longest step up to h that no further wall is in the way of, and its length.

    A wall that is met at once becomes one of the touched.
    """
    ux, uy, uz = 0.0, 0.0, 0.0
    for cut in range(_CUTS):
        wx, wy, wz = accelerated(gravity, vx, vy, vz, 0.5 * h)
        ux, uy, uz = _held(chain, touched, normal, held, x, y, z, wx, wy, wz, h, size)
        following, other = h, -1
        for i in range(touched.size):
            if not touched[i]:
                time, _found = flights.hit_of(chain, None, float(i), x, y, z, ux, uy, uz)
                if time < following:
                    following, other = time, i
        if other < 0:
            break
        speed = math.sqrt(ux * ux + uy * uy + uz * uz)
        if following * speed <= touch:
            touched[other] = True
        else:
            # The step to that wall is another one, since its walls curve and gravity has less time.
            h = following if cut < _CUTS // 2 else 0.5 * following
    return ux, uy, uz, h


@outlined
def _settled(chain, surface, touched, held, depth, x, y, z):
    """The end of a step on the wall that holds the particle, and on every touched one that it has left by round-off.

    Round-off adds up step by step: 3e-13 of the size after 5e4 steps along an edge. Each wall once: a second time only
    where the particle is outside would lean inwards, and let it fall by the last place again and again.
    """
    _depths(chain, 0, x, y, z, depth)
    for i in range(touched.size):
        holds = i == int(surface) and held[i] > 0.0
        if holds or (touched[i] and depth[i] > 0.0):
            x, y, z = walls.settle(chain, float(i), x, y, z)
    return x, y, z


@by_type_outlined
def _depths(chain, k, x, y, z, into):
    """Signed distance outside of every wall into `into`."""


@_depths.register(walls.Chain)
def _(chain, k, x, y, z, into):
    into[k] = surfaces.distance(chain.first, x, y, z)
    _depths(chain.rest, k + 1, x, y, z, into)


@by_type_outlined
def _landed(restitution, chain, touched, normal, given, x, y, z, vx, vy, vz, twice_energy):
    """Chattering ends: walls that lose energy take what is left of the velocity towards them.

    Together, by the projection: in an acute edge one wall after the other would take next to nothing, and the step
    would reflect the rest.
    """
    return vx, vy, vz, twice_energy


@_landed.register(walls.Chain)
def _(restitution, chain, touched, normal, given, x, y, z, vx, vy, vz, twice_energy):
    lossy = scratch(touched.size, np.bool_)
    for i in range(touched.size):
        lossy[i] = touched[i] and reflection.bounciness(restitution, float(i)) < 2.0
        if lossy[i]:
            _normal(chain, i, x, y, z, x, y, z, normal)
    ux, uy, uz = project(lossy, normal, given, vx, vy, vz)
    # |v|^2 - |u|^2, because v - u is orthogonal to u
    dx, dy, dz = vx - ux, vy - uy, vz - uz
    return ux, uy, uz, twice_energy - (dx * dx + dy * dy + dz * dz)


@outlined
def _held(chain, touched, normal, held, x, y, z, wx, wy, wz, h, size):
    """P: w without what the touched walls forbid between r0 and r1 = r0 + h P."""
    ux, uy, uz = 0.0, 0.0, 0.0
    ox, oy, oz = x, y, z
    for _sweep in range(_SWEEPS):
        for i in range(touched.size):
            if touched[i]:
                _normal(chain, i, x, y, z, ox, oy, oz, normal)
        ux, uy, uz = project(touched, normal, held, wx, wy, wz)
        x1, y1, z1 = x + h * ux, y + h * uy, z + h * uz
        change = max(abs(x1 - ox), abs(y1 - oy), abs(z1 - oz))
        ox, oy, oz = x1, y1, z1
        if change <= 2.0 * _EPSILON * size:
            break
    return ux, uy, uz


@outlined
def _normal(chain, i, x, y, z, ox, oy, oz, normal):
    """The unit vector along the discrete gradient of wall i, out of the admissible side."""
    nx, ny, nz = walls.unit_normal(chain, float(i), x, y, z)
    dx, dy, dz = walls.inner_gradient(chain, float(i), x, y, z, ox, oy, oz)
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    if dx * nx + dy * ny + dz * nz < 0.0:
        length = -length
    # At a singular point, such as an apex, both may be undefined: the wall then forbids nothing.
    good = length != 0.0 and math.isfinite(length)
    normal[i, 0], normal[i, 1], normal[i, 2] = nx, ny, nz
    if good:
        normal[i, 0], normal[i, 1], normal[i, 2] = dx / length, dy / length, dz / length
    if not math.isfinite(normal[i, 0] + normal[i, 1] + normal[i, 2]):
        normal[i] = 0.0


@outlined
def _goes_straight(chain, gravity, touched, normal, held, x, y, z, vx, vy, vz):
    """Whether the step may have any length: rest, or uniform motion along flat walls that gravity presses against."""
    gx, gy, gz = accelerated(gravity, 0.0, 0.0, 0.0, 1.0)
    for i in range(touched.size):
        if touched[i]:
            _normal(chain, i, x, y, z, x, y, z, normal)
    px, py, pz = project(touched, normal, held, gx, gy, gz)
    if (px != 0.0 or py != 0.0 or pz != 0.0) and max(abs(px), abs(py), abs(pz)) > ALLOWED * max(
        abs(gx), abs(gy), abs(gz)
    ):
        return False
    if gx == 0.0 and gy == 0.0 and gz == 0.0:
        return False
    speed = max(abs(vx), abs(vy), abs(vz))
    for i in range(touched.size):
        if touched[i] and abs(along(normal, i, vx, vy, vz)) > ALLOWED * speed:
            return False
    return speed == 0.0 or _flat(chain, touched, 0)


@by_type
def _flat(chain, touched, k):
    """Whether every touched wall is flat."""
    return True


@_flat.register(walls.Chain)
def _(chain, touched, k):
    return (surfaces.flat(chain.first) or not touched[k]) and _flat(chain.rest, touched, k + 1)
