"""Poses of walls that move.

A wall that is given at rest as the points xi is at time t where
    x(t) = c + d(t) + A(t) (xi - c),
with the displacement d, and the rotation A about the centre c, both of one motion or of the sum of several.
"""

import math
from typing import NamedTuple

import numpy as np

from .given import Floats, Rotation, parts_of, unit_axis
from .wall import Path, Placed, WallMotion


class Pose(NamedTuple):
    """The place and orientation of a wall: x = center + shift + turn (xi - center)."""

    shift: Floats  # (3,) [m]
    turn: Floats  # (3, 3)
    center: Floats  # (3,) [m]
    quaternion: tuple[float, float, float, float]  # of the turn, (w, x, y, z)

    def position(self) -> Floats:
        """The place (3,) of the origin of the frame in which the wall is given."""
        return np.asarray(self.center + self.shift - _product(self.turn, self.center))

    def placed(self, points: Floats) -> Floats:
        """Points (3, N) of the wall as it is given, where they are now."""
        middle = self.center[:, None]
        return np.asarray(middle + self.shift[:, None] + _product(self.turn, points - middle))

    def turned(self, vectors: Floats) -> Floats:
        """Vectors (3, N) of the frame of the wall in the scene."""
        return _product(self.turn, vectors)

    def given(self, points: Floats) -> Floats:
        """Points (3, N) of the scene in the frame in which the wall is given."""
        middle = self.center[:, None]
        return np.asarray(middle + _product(self.turn.T, points - self.shift[:, None] - middle))


def pose(motion: "WallMotion | None", time: float) -> Pose:
    """The pose of a wall with this motion at a time [s]."""
    found, center, turn, quaternion = np.zeros(3), np.zeros(3), np.eye(3), (1.0, 0.0, 0.0, 0.0)
    for one in parts_of(motion):
        if isinstance(one, Placed):
            found, quaternion, turn = np.array(one.position), one.orientation, np.array(one.turn)
        elif isinstance(one, Rotation):
            center, turn, half = np.array(one.center), _turned_by(one, one.rate * time), 0.5 * one.rate * time
            x, y, z = (math.sin(half) * unit_axis(one)).tolist()
            quaternion = (math.cos(half), x, y, z)
        elif isinstance(one, Path):
            found = found + one.displacement(time)
        else:
            found = found + one.harmonic((0.0, 0.0, 0.0)).position(time)
    return Pose(found, turn, center, quaternion)


def _turned_by(rotation: Rotation, angle: float) -> Floats:
    """The matrix (3, 3) of a rotation by an angle [rad]."""
    # Rodrigues: cos a + (1 - cos a) k k^T + sin a [k], where 1 - cos a = 2 sin^2(a/2)
    k, half = unit_axis(rotation), math.sin(0.5 * angle)
    across = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
    versine = 2.0 * half * half
    return np.asarray((1.0 - versine) * np.eye(3) + versine * np.multiply.outer(k, k) + math.sin(angle) * across)


def _product(matrix: Floats, rows: Floats) -> Floats:
    """(3, 3) times (3, N), rounded term by term: the last bit of BLAS depends on the processor."""
    return np.asarray(sum(np.multiply.outer(matrix[:, k], rows[k]) for k in range(3)))
