"""The elastic energy of a body, of the squares of the lengths of its edges."""

from dataclasses import dataclass

import numpy as np

from .. import checks
from ..errors import SceneError
from ..particles import Floats
from . import checked
from .checked import Pairs


@dataclass(frozen=True, eq=False)
class Strain:
    """The elastic energy V = (s - s0).K (s - s0)/2 of the squares s of the lengths of edges.

    Args:
        edges: (E, 2) pairs of points, E at least 1.
        rest: (E,) s0, the squares of their lengths without stress, above 0 [m^2].
        stiffness: (E, E) K, symmetric and without negative eigenvalues [N/m^3].

    Raises:
        SceneError: an argument is out of its range.

    >>> spring = Strain(edges=[(0, 1)], rest=[1.0], stiffness=[[8.0]])
    >>> spring.energy([[0.0, 2.0], [0.0, 0.0], [0.0, 0.0]])
    array(36.)
    """

    edges: Pairs
    rest: Floats
    stiffness: Floats

    def __post_init__(self) -> None:
        edges = checked.numbers("strain.edges", self.edges, 2, None)
        size = len(edges)
        if not size:
            raise SceneError("strain.edges must hold at least one edge, got none")
        rest = _shaped("strain.rest", self.rest, (size,))
        for k in np.flatnonzero(rest <= 0.0)[:1]:
            raise SceneError(f"strain.rest[{k}] must be above 0, got {rest[k]:g}")
        stiffness = checked.symmetric("strain.stiffness", _shaped("strain.stiffness", self.stiffness, (size, size)))
        checked.not_negative("strain.stiffness", stiffness)
        checks.assign(self, edges=edges, rest=rest, stiffness=stiffness)

    def energy(self, points: Floats) -> Floats:
        """V [J] of points (3, P), or of n copies (3, P, n)."""
        i, j = self.edges.T
        rows = np.asarray(points, dtype=np.float64)
        shape = (-1,) + (1,) * (rows.ndim - 2)
        excess = ((rows[:, i] - rows[:, j]) ** 2).sum(axis=0) - self.rest.reshape(shape)
        return np.asarray(0.5 * (excess * np.tensordot(self.stiffness, excess, 1)).sum(axis=0))


def _shaped(name: str, value: Floats, shape: tuple[int, ...]) -> Floats:
    array = checks.array(name, value)
    if array.shape != shape:
        raise SceneError(f"{name} must have shape {shape}, as there are {shape[0]} edges, got {array.shape}")
    return checked.finite(name, np.array(array))
