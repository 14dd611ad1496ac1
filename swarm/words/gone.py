"""Particles that left the scene, through an opening or into a wall: pictures show only their number."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..particles import Particles

Gone = NDArray[np.bool_]


def gone_of(ends: Any) -> Gone:
    """A mask (N,) of the particles that left the scene.

    `ends` are two arrays (N,): the times of escape and of absorption [s], NaN for particles inside.
    """
    escaped, absorbed = ends
    return np.asarray(~np.isnan(escaped) | ~np.isnan(absorbed))


def gone_at(trajectory: Any, k: int) -> Gone | None:
    """A mask of the particles that have left by a frame of a trajectory; None for a run of bodies."""
    return None if trajectory.body else gone_of((trajectory.escape_times(k), trajectory.absorbed_times(k)))


def without(frame: Particles, gone: Gone | None) -> Particles:
    """The particles of a frame; those that left the scene have positions of NaN."""
    if gone is None or not gone.any():
        return frame
    made = object.__new__(Particles)
    made.__dict__.update(frame.__dict__)
    made.position = np.where(gone, np.nan, frame.position)
    return made


def how_many_left(seen: dict[str, NDArray[Any]], gone: Gone | None) -> dict[str, int]:
    """The numbers of particles that "escaped" and were "absorbed" by the end; {} if no particle left."""
    if gone is None or not gone.any():
        return {}
    counts = {"escaped": int(seen["escaped"][-1]), "absorbed": int(np.sum(seen.get("absorbed", [[0]])[-1]))}
    return {how: n for how, n in counts.items() if n}
