"""The walls over which the tests of every surface run, and flights that start next to one."""

import functools
import math

import conftest
import numpy as np
import pytest
from conftest import call, directions, scales, wall_point
from hypothesis import strategies as st

import swarm
from swarm.surfaces import contract

TURN = {"axis": (1.0, -2.0, 0.5), "angle": 0.9}
CENTER = np.array([0.2, -0.3, 0.1])


def quadric(diagonal, linear=(0.0, 0.0, 0.0), constant=0.0, side="inside", rotation=TURN):
    """At scale s lengths are s times as long and phi has the same values."""

    def make(s=1.0):
        matrix, vector = np.diag(diagonal) / s**2, np.array(linear) / s
        return swarm.Quadric(matrix, vector, constant, CENTER * s, side, rotation=rotation)

    return make


def both_sides(name, make):
    return {name: lambda s=1.0: make(s, "inside"), name + " solid": lambda s=1.0: make(s, "outside")}


# Smooth surfaces of one wall, some of them rotated.
QUADRIC_WALLS = {
    **both_sides("slab", lambda s, side: swarm.Slab((1.0, 2.0, -2.0), 0.4 * s, CENTER * s, side, rotation=TURN)),
    **both_sides("cylinder", lambda s, side: swarm.Cylinder(0.6 * s, (1.0, 0.5, 2.0), None, CENTER * s, side)),
    **both_sides("pipe", lambda s, side: swarm.Cylinder(0.6 * s, center=CENTER * s, side=side)),
    **both_sides("bowl", lambda s, side: swarm.Paraboloid(0.3 * s, (0.0, 1.0, -1.0), CENTER * s, side, rotation=TURN)),
    "one sheet": quadric((1.0, 2.0, -1.5), constant=-0.5),
    "one sheet solid": quadric((1.0, 2.0, -1.5), constant=-0.5, side="outside"),
    "two sheets": quadric((1.0, 2.0, -1.5), constant=0.5),
    "two sheets solid": quadric((1.0, 2.0, -1.5), constant=0.5, side="outside"),
    "nappes": quadric((1.0, 2.0, -1.5)),
    "saddle": quadric((1.0, -2.0, 0.0), (0.0, 0.0, -1.0)),
    "gutter": quadric((1.0, 0.0, 0.0), (0.0, 1.0, -1.0), 0.25, rotation=None),
    "shifted egg": quadric((1.0, 2.0, 3.0), (0.5, -0.3, 0.7), -0.5),
    "everted egg": quadric((-1.0, -2.0, -3.0), (0.5, -0.3, 0.7), 0.5, side="outside"),
    "long egg": quadric((1.0, 2.0, 1e-8), (0.5, -0.3, 0.7), -0.5),
    "wall": quadric((0.0, 0.0, 0.0), (1.0, -0.5, 0.25), 0.3),
}
WALLS = {**conftest.SURFACES, **QUADRIC_WALLS}
QUADRICS = [*conftest.QUADRICS, *QUADRIC_WALLS]
every_wall = pytest.mark.parametrize("name", WALLS)
every_quadric_wall = pytest.mark.parametrize("name", QUADRIC_WALLS)


@functools.cache
def numbers_of(name, scale=1.0):
    """The tuple of numbers of a wall, as kernels take it."""
    (wall,) = WALLS[name](scale).walls()
    return wall


# Where a flight starts relative to the wall, in units of its size: inside, next to it, on it, an ulp or two off.
depths = st.one_of(st.floats(1e-3, 0.3), st.sampled_from([0.0, 0.0, 1e-15, -1e-15, 1e-9, 1e-12]))
# How it leaves: part of the velocity along the normal, out of the wall or into it; 0 grazes.
leans = st.one_of(st.floats(-1.0, 1.0), st.sampled_from([0.0, 1e-15, -1e-15, 1e-9, -1e-9, 1e-5, -1e-5, 1.0, -1.0]))


def start(name, point, direction, depth, lean, scale, speed):
    """A start near the wall: position, and velocity with this part along the normal."""
    surface = numbers_of(name, scale)
    wall = wall_point(surface, scale * point)
    normal = np.array(call(contract.unit_normal, surface, wall))
    along = direction - (direction @ normal) * normal
    along /= max(np.linalg.norm(along), 1e-3)
    velocity = speed * scale * (lean * normal + math.sqrt(1.0 - lean * lean) * along)
    return surface, wall - depth * scale * normal, velocity


flights = {
    "point": directions,
    "direction": directions,
    "depth": depths,
    "lean": leans,
    "scale": scales,
    "speed": st.sampled_from([1e-6, 1.0, 1e6]),
}
