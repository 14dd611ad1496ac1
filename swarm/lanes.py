"""One block of particles to one time, in lanes.

A block is copied into lane arrays; one pass does one flight and one contact for every live lane, in two loops without
branches, which LLVM vectorises. Lanes that reached the frame time retire, and the next particle, or the last live lane,
takes their slot. The result does not depend on which lane or block a particle is in.
"""

import numpy as np

from ._jit import by_type, kernel, select
from .gravity import Nothing
from .methods import base as methods
from .status import Status
from .surfaces import chain as walls

# Lanes of a block: 256 x 13 rows of 8 bytes fit in the L1 cache beside what the loops spill.
LANES = 256
# The row stride is not a power of two, so that a lane's rows do not share a cache set.
_STRIDE = 264

_X, _Y, _Z, _VX, _VY, _VZ, _LEFT, _K0, _K1, _K2, _HITS, _ROWS = range(12)


@by_type
def _add_impulse(chain, impulse, row, lane, surface, given):
    """impulse[surface, lane] += given, without a branch; a loop over rows here would not vectorise."""
    raise NotImplementedError


@_add_impulse.register(walls.Chain)
def _(chain, impulse, row, lane, surface, given):
    impulse[row, lane] += select(surface == 0.0, given, 0.0)
    _add_impulse(chain.rest, impulse, row + 1, lane, surface - 1.0, given)


@_add_impulse.register(Nothing)
def _(chain, impulse, row, lane, surface, given):
    pass


@kernel
def advance_block(method, chain, gravity, state, span, start, stop, halt):
    """Advance particles start to stop by `span` and return (status, particle): the first that failed, or the last.

    `span` is in the method's unit. `halt[0]` set to 1 by another thread stops the block at its next pass.
    """
    position, velocity, mass, energy = state.position, state.velocity, state.mass, state.energy
    impacts, total_impulse = state.impacts, state.impulse
    surfaces = walls.length(chain)

    lanes = np.empty((_ROWS, _STRIDE))
    impulse = np.empty((surfaces, _STRIDE))
    surface, hard = np.empty(_STRIDE), np.empty(_STRIDE)
    kappa, change = np.zeros(_STRIDE), np.zeros(_STRIDE)
    particle = np.empty(_STRIDE, np.int64)
    live, following = 0, start

    while True:
        while live < LANES and following < stop:
            i, vx, vy, vz = following, velocity[0, following], velocity[1, following], velocity[2, following]
            lanes[_X, live], lanes[_Y, live], lanes[_Z, live] = position[0, i], position[1, i], position[2, i]
            lanes[_VX, live], lanes[_VY, live], lanes[_VZ, live] = vx, vy, vz
            k0, k1, k2 = methods.lane_constants(method, mass[i], energy[i], vx, vy, vz)
            lanes[_K0, live], lanes[_K1, live], lanes[_K2, live] = k0, k1, k2
            lanes[_LEFT, live], lanes[_HITS, live] = span, 0.0
            for s in range(surfaces):
                impulse[s, live] = 0.0
            particle[live] = i
            live += 1
            following += 1
        if live == 0:
            return Status.DONE.value, stop - 1
        if halt[0] != 0:
            return Status.INTERRUPTED.value, stop - 1

        for i in range(live):
            x, y, z, vx, vy, vz, left, wall, is_hard = methods.flight(
                method, chain, gravity,
                lanes[_X, i], lanes[_Y, i], lanes[_Z, i], lanes[_VX, i], lanes[_VY, i], lanes[_VZ, i],
                lanes[_LEFT, i], lanes[_K0, i], lanes[_K1, i], lanes[_K2, i],
            )  # fmt: skip
            lanes[_X, i], lanes[_Y, i], lanes[_Z, i] = x, y, z
            lanes[_VX, i], lanes[_VY, i], lanes[_VZ, i] = vx, vy, vz
            lanes[_LEFT, i] = left
            surface[i] = wall
            hard[i] = select(is_hard, 1.0, 0.0)
        if methods.most_sweeps(method) > 0:
            for i in range(live):
                kappa[i], change[i] = methods.guess(
                    method, chain, gravity,
                    lanes[_X, i], lanes[_Y, i], lanes[_Z, i], lanes[_VX, i], lanes[_VY, i], lanes[_VZ, i],
                    lanes[_K0, i], surface[i],
                )  # fmt: skip
        for _sweep in range(methods.most_sweeps(method)):
            unsolved = 0
            for i in range(live):
                kappa[i], change[i], more = methods.improve(
                    method, chain, gravity,
                    lanes[_X, i], lanes[_Y, i], lanes[_Z, i], lanes[_VX, i], lanes[_VY, i], lanes[_VZ, i],
                    lanes[_K0, i], surface[i], kappa[i], change[i],
                )  # fmt: skip
                unsolved += more
            if unsolved == 0:
                break
        hard_lanes, retired = 0, 0
        for i in range(live):
            was_hard = hard[i] != 0.0
            x, y, z, vx, vy, vz, left, given, hits, is_hard = methods.contact(
                method, chain, gravity,
                lanes[_X, i], lanes[_Y, i], lanes[_Z, i], lanes[_VX, i], lanes[_VY, i], lanes[_VZ, i],
                lanes[_LEFT, i], lanes[_K0, i], lanes[_K1, i], lanes[_K2, i], surface[i], kappa[i], change[i],
            )  # fmt: skip
            lanes[_X, i] = select(was_hard, lanes[_X, i], x)
            lanes[_Y, i] = select(was_hard, lanes[_Y, i], y)
            lanes[_Z, i] = select(was_hard, lanes[_Z, i], z)
            lanes[_VX, i] = select(was_hard, lanes[_VX, i], vx)
            lanes[_VY, i] = select(was_hard, lanes[_VY, i], vy)
            lanes[_VZ, i] = select(was_hard, lanes[_VZ, i], vz)
            left = select(was_hard, lanes[_LEFT, i], left)
            lanes[_LEFT, i] = left
            lanes[_HITS, i] += select(was_hard, 0.0, hits)
            _add_impulse(chain, impulse, 0, i, surface[i], select(was_hard, 0.0, given))
            is_hard = is_hard | was_hard
            hard[i] = select(is_hard, 1.0, 0.0)
            hard_lanes += is_hard
            retired += (left <= 0.0) & (not is_hard)

        if hard_lanes > 0:
            for i in range(live):
                if hard[i] != 0.0:
                    x, y, z, vx, vy, vz, left, hits, status = methods.hard_pass(
                        method, chain, gravity,
                        lanes[_X, i], lanes[_Y, i], lanes[_Z, i], lanes[_VX, i], lanes[_VY, i], lanes[_VZ, i],
                        lanes[_LEFT, i], lanes[_K0, i], lanes[_K1, i], lanes[_K2, i], surface[i], impulse, i,
                    )  # fmt: skip
                    if status != Status.DONE.value:
                        return status, particle[i]
                    lanes[_X, i], lanes[_Y, i], lanes[_Z, i] = x, y, z
                    lanes[_VX, i], lanes[_VY, i], lanes[_VZ, i] = vx, vy, vz
                    lanes[_LEFT, i] = left
                    lanes[_HITS, i] += hits
                    retired += left <= 0.0

        lane = 0
        while retired > 0 and lane < live:
            if lanes[_LEFT, lane] > 0.0:
                lane += 1
                continue
            i = particle[lane]
            position[0, i], position[1, i], position[2, i] = lanes[_X, lane], lanes[_Y, lane], lanes[_Z, lane]
            velocity[0, i], velocity[1, i], velocity[2, i] = lanes[_VX, lane], lanes[_VY, lane], lanes[_VZ, lane]
            impacts[i] += np.int64(lanes[_HITS, lane])
            for s in range(surfaces):
                total_impulse[s, i] += impulse[s, lane] * mass[i]
            retired -= 1
            live -= 1
            for row in range(_ROWS):
                lanes[row, lane] = lanes[row, live]
            for s in range(surfaces):
                impulse[s, lane] = impulse[s, live]
            particle[lane] = particle[live]
