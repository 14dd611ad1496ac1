"""Whether particles stay where all surfaces are known."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ..surface import Surface, shown

# Of the width of a box, by how much particles may leave it: round-off.
_ROUND_OFF = 1e-9


def require_known(
    surfaces: Sequence[Surface], bounds: Callable[[list[Surface]], tuple[NDArray[np.float64], NDArray[np.float64]]]
) -> None:
    """Raise a `SceneError` where particles may leave the box in which a surface is known.

    Args:
        surfaces: those of a scene.
        bounds: the corners of a box around the volume that some of them leave.
    """
    for i, surface in enumerate(surfaces):
        known = surface.known_in()
        if known is None:
            continue
        first, last = (np.array(corner) for corner in known)
        low, high = bounds([one for one in surfaces if one.motion is None and not one.reacts()])
        room = _ROUND_OFF * (last - first).max()
        if surface.motion is not None or not ((low >= first - room).all() and (high <= last + room).all()):
            raise SceneError(
                f"surfaces[{i}] must be known wherever particles go, got {surface}, which reaches the border of its "
                f"grid, from {shown(first)} to {shown(last)}, while the surfaces that do not move keep particles "
                f"from {shown(low)} to {shown(high)}; sample it in a larger box, check that phi is below 0 inside, "
                "or add surfaces that keep particles in the grid"
            )
