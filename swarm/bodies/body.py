"""What a body is: base points with masses, links, springs and an elastic strain energy, and the points that touch walls.

A body is P base points r_p with a constant mass matrix M (P, P), times the identity of R^3. Pairs of them are tied by
    links      |r_i - r_j| stays as it is,
    springs    V = k (|r_i - r_j| - l)^2/2,
    strains    V = (s - s0).K (s - s0)/2 of the squares s of the lengths of edges: an elastic solid made of tetrahedra of
               Saint Venant and Kirchhoff has exactly this energy, because the strain of each is linear in its s.
A contact point is a fixed linear combination sum b_p r_p, so a polyhedron of a hundred corners still has four points.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..particles import Floats

Pairs = NDArray[np.int64]


@dataclass(frozen=True)
class Strain:
    """The elastic energy V = (s - s0).K (s - s0)/2 of the squares s of the lengths of edges.

    Attributes:
        edges: (E, 2) pairs of points.
        rest: (E,) s0, the squares of their lengths without stress [m^2].
        stiffness: (E, E) K, symmetric and positive definite [N/m^3].
    """

    edges: Pairs
    rest: Floats
    stiffness: Floats


@dataclass(frozen=True, eq=False, init=False)
class Body:
    """Points tied together: the template of all copies that `place` makes.

    Args:
        points: (P, 3) base points, as they are at rest [m].
        mass: one number or (P,) [kg], above 0; or
        mass_matrix: (P, P) [kg], symmetric and positive definite.
        links: pairs (i, j) of points whose distance never changes.
        springs: (i, j, stiffness [N/m], rest length [m]).
        contacts: what can touch a wall: numbers of points, or rows (K, P) of coefficients; None: every point.
        strain: elastic energy of edges, as `elastic` makes it.
        anchors: number of a point -> None, fixed in space, or a motion that leads it.
        guides: (number of a point, surface): the point stays on that surface.
        cavities: (surface, carrier, point): the surface moves with the point `carrier`, its origin; it holds `point`.
        faces: (F, 3) triangles of contact points, for pictures.

    Raises:
        SceneError: an argument is out of its range.
    """

    points: Floats
    mass_matrix: Floats
    links: Pairs
    springs: tuple[tuple[int, int, float, float], ...]
    contacts: Floats  # (K, P)
    strain: Strain | None
    anchors: Mapping[int, Any]
    guides: tuple[tuple[int, Any], ...]
    cavities: tuple[tuple[Any, int, int], ...]
    faces: Pairs = field(default_factory=lambda: np.zeros((0, 3), np.int64))

    def __init__(
        self,
        points: ArrayLike,
        mass: ArrayLike | None = None,
        links: Sequence[tuple[int, int]] = (),
        springs: Sequence[tuple[int, int, float, float]] = (),
        contacts: ArrayLike | None = None,
        *,
        mass_matrix: ArrayLike | None = None,
        strain: Strain | None = None,
        anchors: Mapping[int, Any] | None = None,
        guides: Sequence[tuple[int, Any]] = (),
        cavities: Sequence[tuple[Any, int, int]] = (),
        faces: ArrayLike = (),
    ) -> None:
        points = np.array(points, dtype=np.float64)
        count = len(points)
        matrix = np.diag(np.broadcast_to(np.asarray(mass, dtype=np.float64), (count,)))
        if mass_matrix is not None:
            matrix = np.array(mass_matrix, dtype=np.float64)
        touching = np.eye(count)
        if contacts is not None:
            given = np.asarray(contacts)
            touching = np.eye(count)[given.astype(np.int64)] if given.ndim == 1 else given.astype(np.float64)
        values = {
            "points": points,
            "mass_matrix": matrix,
            "links": np.array(links, dtype=np.int64).reshape(-1, 2),
            "springs": tuple((int(i), int(j), float(k), float(rest)) for i, j, k, rest in springs),
            "contacts": touching,
            "strain": strain,
            "anchors": dict(anchors or {}),
            "guides": tuple(guides),
            "cavities": tuple(cavities),
            "faces": np.array(faces, dtype=np.int64).reshape(-1, 3),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        """Number of base points P."""
        return len(self.points)

    def bonds(self) -> Pairs:
        """(B, 2) all pairs that are tied, for readers that draw them."""
        springs = np.array([spring[:2] for spring in self.springs], dtype=np.int64).reshape(-1, 2)
        strains = np.zeros((0, 2), np.int64) if self.strain is None else self.strain.edges
        return np.concatenate([self.links, springs, strains])
