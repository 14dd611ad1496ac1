"""Who has gone, through an opening or into a wall: pictures do not show them, and say how many they are."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..particles import Particles

Gone = NDArray[np.bool_]


def gone_of(ends: Any) -> Gone:
    """Who has gone, (N,), from the times at which some escaped and some were absorbed [s], NaN of who is inside."""
    escaped, absorbed = ends
    return np.asarray(~np.isnan(escaped) | ~np.isnan(absorbed))


def gone_at(trajectory: Any, k: int) -> Gone | None:
    """Who has gone at a frame of a trajectory; None of bodies, which do not go."""
    return None if trajectory.body else gone_of((trajectory.escape_times(k), trajectory.absorbed_times(k)))


def without(frame: Particles, gone: Gone | None) -> Particles:
    """The particles of a frame, with those that have gone at NaN."""
    if gone is None or not gone.any():
        return frame
    made = object.__new__(Particles)
    made.__dict__.update(frame.__dict__)
    made.position = np.where(gone, np.nan, frame.position)
    return made


def how_many_left(seen: dict[str, NDArray[Any]], gone: Gone | None) -> dict[str, int]:
    """How many of all that were run have "escaped" and were "absorbed" by the end; {} where no one has."""
    if gone is None or not gone.any():
        return {}
    counts = {"escaped": int(seen["escaped"][-1]), "absorbed": int(np.sum(seen.get("absorbed", [[0]])[-1]))}
    return {how: n for how, n in counts.items() if n}
