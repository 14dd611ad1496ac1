"""The observables of a frame that are no sums over its particles: numbers that have left, and poses of walls."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..motion import Guide, Rotation, pose, unit_axis
from ..scene import Scene
from ..state import Floats, State


class Observed(NamedTuple):
    """The surfaces of a scene as observed: their poses, and the motion of reacting ones."""

    position: Floats  # (surfaces, 3) the place of the origin of the given surface [m]
    orientation: Floats  # (surfaces, 4) quaternions (w, x, y, z)
    velocity: Floats  # (surfaces, 3) [m/s]
    spin: Floats  # (surfaces, 3) [rad/s]
    kinetic: Floats  # (surfaces,) [J]
    potential: Floats  # (surfaces,) the energy of gravity and springs, 0 at the start [J]


def observed_of(scene: Scene, reacting: Any, moment: float) -> Observed:
    """Return the surfaces of a scene at a moment [s].

    `reacting` has the arrays `shift` and `velocity` (3, K) [m], [m/s] of the reacting walls, in their order, and for
    walls that turn `angle` and `rate` (K,) [rad], [rad/s].
    """
    count, row = len(scene.surfaces), 0
    poses, gravity = scene.poses(moment), np.array(scene.gravity or (0.0, 0.0, 0.0))
    found = Observed(
        np.array([pose.position() for pose in poses]), np.array([pose.quaternion for pose in poses]),
        *np.zeros((2, count, 3)), *np.zeros((2, count)),
    )  # fmt: skip
    for i, surface in enumerate(scene.surfaces):
        if not surface.reacts():
            continue
        motion, shift, v = surface.motion, reacting.shift[:, row], reacting.velocity[:, row]
        found.position[i], found.orientation[i] = shift, (1.0, 0.0, 0.0, 0.0)
        if surface.mass is not None and surface.inertia is None:
            found.velocity[i] = v
            found.kinetic[i] = 0.5 * surface.mass * (v**2).sum()
            stiffness = motion.stiffness if isinstance(motion, Guide) else 0.0
            found.potential[i] = 0.5 * stiffness * (shift**2).sum() - surface.mass * (gravity * shift).sum()
        elif surface.inertia is not None:
            rate = reacting.rate[row]
            turned = pose(Rotation(motion.axis, reacting.angle[row], motion.center), 1.0)
            found.position[i], found.orientation[i] = turned.position(), turned.quaternion
            found.spin[i], found.kinetic[i] = rate * unit_axis(motion), 0.5 * surface.inertia * rate**2
            if surface.mass is not None:
                center = np.array(surface.center)  # type: ignore[attr-defined]
                fallen = turned.placed(center[:, None])[:, 0] - center
                found.potential[i] = -surface.mass * (gravity * fallen).sum()
        row += 1
    return found


def gone_of(state: State, far: int, owners: NDArray[np.int64], surfaces: int) -> dict[str, Any]:
    """Return how many particles have escaped, `far` of them not through openings, and were absorbed by each surface.

    `owners` is the surface of each wall.
    """
    gone: dict[str, Any] = {"escaped": far}
    if state.escape_time is not None:
        gone["escaped"] += int(np.count_nonzero(~np.isnan(state.escape_time)))
    if (walls := state.absorbed_wall) is not None:
        gone["absorbed"] = np.bincount(owners[walls[walls >= 0]], minlength=surfaces).astype(np.int64)
    return gone


def poses_of(scene: Scene, moment: float) -> dict[str, Any]:
    """Return the poses of the surfaces at a moment [s]."""
    poses = scene.poses(moment)
    return {
        "wall_position": np.array([pose.position() for pose in poses]),
        "wall_orientation": np.array([pose.quaternion for pose in poses]),
    }


def balance(seen: dict[str, Any]) -> float:
    """Return the total energy plus losses, minus the energy of sources and the heat and the work of walls."""
    kept = seen["total_energy"] + seen["dissipated_energy"] - seen["wall_heat"].sum() - seen.get("source_energy", 0.0)
    return float(kept - np.sum(seen.get("wall_work", 0.0)))


def with_walls(seen: dict[str, Any], walls: Observed) -> dict[str, Any]:
    """Return the observables with those of reacting walls, the energy of which is added to the total."""
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
