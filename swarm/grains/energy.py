"""The energy that contacts store at a frame, and the state of the balls that observables and files read."""

from typing import Any

import numpy as np

from ..kernel.arrays import index
from ..kernel.jit import long_kernel, outlined
from ..kernel.vector import norm, vector_at
from . import grain_arrays as col
from .contacts import apart
from .vessel import met


@long_kernel
def store_at_walls(matter, walls, remaining, grains, near, into):
    """Add to `into` the energy [J] that contacts of each ball with walls store with `remaining` [s] left."""
    place = grains.place
    for number, wall in enumerate(walls.at(remaining).each):
        for k in range(near.wall_first[number], near.wall_first[number + 1]):
            if near.wall_is_open is not None and near.wall_is_open[index(k)]:
                continue
            i = index(near.slot[index(k)])
            own = met(wall, near.listed, near.spans, index(k), place[i, col.RADIUS])
            into[index(grains.number[i])] += matter.law.stored_energy(own.gap_of(own.inner(vector_at(place, i, col.X))))


@outlined
def _stored_at_wall(matter, wall, grains, near, number):
    place, stored, deepest = grains.place, 0.0, 0.0
    for k in range(near.wall_first[number], near.wall_first[number + 1]):
        i = index(near.slot[index(k)])
        own = met(wall, near.listed, near.spans, index(k), place[i, col.RADIUS])
        gap = own.gap_of(own.inner(vector_at(place, i, col.X)))
        stored += matter.law.stored_energy(gap)
        deepest = max(deepest, gap)
    return stored, deepest


@long_kernel
def stored(matter, walls, grains, near):
    """Return the energy that all contacts store now [J], and the largest overlap [m]."""
    place, total, deepest = grains.place, 0.0, 0.0
    for a in range(place.shape[0]):
        i = index(a)
        for k in range(near.first[i], near.first[i + 1]):
            j = index(near.mate[index(k)])
            gap = place[i, col.RADIUS] + place[j, col.RADIUS] - norm(apart(matter, place, i, j))
            total += matter.law.stored_energy(gap)
            deepest = max(deepest, gap)
    for k, wall in enumerate(walls.at(0.0).each):
        at_wall, overlap = _stored_at_wall(matter, wall, grains, near, k)
        total += at_wall
        deepest = max(deepest, overlap)
    return total, deepest


def show(grains: Any, state: Any, held: Any) -> None:
    """Copy positions, velocities and spins into the state, in the particles' order; `held` is a `Held` or None."""
    number, begin = grains.number, slice(col.BEFORE, col.BEFORE + 3)
    state.position[:, number] = grains.place[:, col.X : col.X + 3].T
    state.velocity[:, number] = grains.speed[:, begin].T
    if grains.spin is not None:
        state.balls.spin[:, number] = grains.spin[:, begin].T
    if held is not None:
        waits = number[~np.isnan(held.until[number])]
        state.velocity[:, waits] = held.velocity[:, waits]
        if grains.spin is not None:
            state.balls.spin[:, waits] = held.spin[:, waits]
