"""The observables of a frame that are no sums over its particles: how many are gone, and where walls are."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene import Scene
from ..state import Floats, State


class Observed(NamedTuple):
    """The surfaces of a scene as observed: those that react where they are, and how they move."""

    position: Floats  # (surfaces, 3) where what is given at the origin is [m]
    orientation: Floats  # (surfaces, 4) quaternions (w, x, y, z)
    velocity: Floats  # (surfaces, 3) [m/s]
    spin: Floats  # (surfaces, 3) [rad/s]
    kinetic: Floats  # (surfaces,) [J]
    potential: Floats  # (surfaces,) of gravity and springs, 0 at the start [J]


def gone_of(state: State, far: int, owners: NDArray[np.int64], surfaces: int) -> dict[str, Any]:
    """How many have escaped, `far` of them through no opening, and how many each surface has absorbed.

    `owners` is the surface of each wall.
    """
    gone: dict[str, Any] = {"escaped": far}
    if state.escape_time is not None:
        gone["escaped"] += int(np.count_nonzero(~np.isnan(state.escape_time)))
    if state.absorbed is not None:
        walls = state.absorbed.wall
        gone["absorbed"] = np.bincount(owners[walls[walls >= 0]], minlength=surfaces).astype(np.int64)
    return gone


def poses_of(scene: Scene, moment: float) -> dict[str, Any]:
    """Where the surfaces are at a moment [s]."""
    poses = scene.poses(moment)
    return {
        "wall_position": np.array([pose.position() for pose in poses]),
        "wall_orientation": np.array([pose.quaternion for pose in poses]),
    }


def balance(seen: dict[str, Any]) -> float:
    """The energy of all, with what was lost, and without what sources brought, and the heat and the work of walls."""
    kept = seen["total_energy"] + seen["dissipated_energy"] - seen["wall_heat"].sum() - seen.get("source_energy", 0.0)
    return float(kept - np.sum(seen.get("wall_work", 0.0)))


def with_walls(seen: dict[str, Any], walls: Observed) -> dict[str, Any]:
    """The observables with those of walls that react: their energy is a part of the whole."""
    energy = walls.kinetic + walls.potential
    return {
        **seen,
        "total_energy": seen["total_energy"] + float(energy.sum()),
        "wall_energy": energy,
        "wall_velocity": walls.velocity,
        "wall_spin": walls.spin,
        "wall_position": walls.position,
        "wall_orientation": walls.orientation,
    }
