"""Bodies: base points with masses, the ties between them, and the points that touch walls.

A body has P base points r_p with a constant mass matrix M (P, P), times the identity of R^3. Pairs of them are tied by
    links      |r_i - r_j| is constant,
    springs    V = k (|r_i - r_j| - l)^2/2,
    a strain   V = (s - s0).K (s - s0)/2 of the squares s of the lengths of edges. An elastic solid made of tetrahedra
               of Saint Venant and Kirchhoff has exactly this energy, because the strain of each is linear in its s.
A contact point is a fixed linear combination sum b_p r_p, so a polyhedron with a hundred corners has four base points.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..common import checks
from ..errors import SceneError
from ..motion import Motion
from ..state import Floats
from ..surfaces.surface import Surface
from . import algebra, checked, holding, room, tied
from .checked import Pairs, Spring


@dataclass(frozen=True, eq=False)
class Strain:
    """The elastic energy V = (s - s0).K (s - s0)/2 of the squares s of the lengths of edges.

    Args:
        edges: (E, 2) pairs of points, E at least 1.
        rest: (E,) s0, the squares of the lengths of edges without stress, above 0 [m^2].
        stiffness: (E, E) K, symmetric and positive definite [N/m^3]; its inverse is the compliance of the solver.

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
        checked.positive_definite("strain.stiffness", stiffness, "a strain, largest at edge", "elastic energy")
        checks.assign(self, edges=edges, rest=rest, stiffness=stiffness)

    def energy(self, points: Floats) -> Floats:
        """The energy V [J] of points (3, P), or of n copies (3, P, n)."""
        rows = np.asarray(points, dtype=np.float64)
        shape = (-1,) + (1,) * (rows.ndim - 2)
        excess = squares_between(rows, self.edges) - self.rest.reshape(shape)
        return np.asarray(0.5 * (excess * np.tensordot(self.stiffness, excess, 1)).sum(axis=0))


def squares_between(rows: Floats, pairs: Pairs) -> Floats:
    """The squared differences (L, ...) of the vectors (3, P, ...) at the two points of each pair (L, 2)."""
    return np.asarray(((rows[:, pairs[:, 0]] - rows[:, pairs[:, 1]]) ** 2).sum(axis=0))


def _shaped(name: str, value: Floats, shape: tuple[int, ...]) -> Floats:
    array = checks.array(name, value)
    if array.shape != shape:
        raise SceneError(f"{name} must have shape {shape}, as there are {shape[0]} edges, got {array.shape}")
    return checked.finite(name, np.array(array))


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Body:
    """Points tied together: the template of all copies that `place` makes.

    Args:
        points: (P, 3) base points in the body at rest [m].
        mass: one number or (P,) [kg], above 0; either this or `mass_matrix` is given.
        mass_matrix: (P, P) [kg], symmetric and positive definite.
        links: pairs (i, j) of points at a distance that never changes; no link may follow from the others.
        springs: (i, j, stiffness above 0 [N/m], rest length 0 or more [m]).
        contacts: the points that can touch a wall: numbers of points, or rows (K, P) of coefficients that add up to 1;
            None: every point that is not anchored.
        strain: elastic energy of edges, as `elastic` makes it.
        anchors: number of a point -> None for a fixed point, or a Translation, Oscillation or Rotation that leads it.
        guides: (number of a point, surface without edges): the point starts and stays on the surface.
        cavities: (surface without edges, carrier, point): the surface moves with the point `carrier`, its origin, and
            keeps `point` on its admissible side.
        faces: (F, 3) triangles of contact points, for pictures.

    Raises:
        SceneError: an argument is out of its range; a link is redundant; led points leave the reach of their links; the
            matrices of the body, which are full, are too large: some 3000 points of a chain, or 700 elastic ones, fit.

    >>> Body([(0, 0, 0), (0, 0, -1), (1, 0, -1)], mass=2.0, links=[(0, 1), (1, 2)], anchors={0: None})
    Body(3 points, 2 links, 1 anchors, 2 contacts)
    """

    points: Floats
    mass_matrix: Floats
    links: Pairs
    springs: tuple[Spring, ...]
    contacts: Floats  # (K, P)
    strain: Strain | None
    anchors: Mapping[int, Motion | None]
    guides: tuple[tuple[int, Surface], ...]
    cavities: tuple[tuple[Surface, int, int], ...]
    faces: Pairs

    def __init__(  # noqa: PLR0913  # most bodies have few of these properties
        self,
        points: ArrayLike,
        mass: ArrayLike | None = None,
        links: Iterable[Sequence[int]] = (),
        springs: Iterable[Sequence[float]] = (),
        contacts: ArrayLike | None = None,
        *,
        mass_matrix: ArrayLike | None = None,
        strain: Strain | None = None,
        anchors: Mapping[int, Motion | None] | None = None,
        guides: Iterable[tuple[int, Surface]] = (),
        cavities: Iterable[tuple[Surface, int, int]] = (),
        faces: Iterable[Sequence[int]] = (),
    ) -> None:
        places = checked.places("points", points)
        count = len(places)
        led = holding.anchors(anchors, count)
        touching = checked.contacts(contacts, count, led)
        checks.assign(
            self,
            points=places,
            mass_matrix=checked.mass_matrix(mass, mass_matrix, count),
            links=checked.links(links, places),
            springs=checked.springs(springs, places),
            contacts=touching,
            strain=_of_body(strain, count),
            anchors=led,
            guides=holding.guides(guides, places, led),
            cavities=holding.cavities(cavities, places),
            faces=checked.numbers("faces", faces, 3, len(touching)),
        )
        ties = len(self.bonds()) + len(self.guides) + len(self.cavities)
        room.require(count, ties, len(touching), len(self.strained()))
        holding.uncoupled(self.anchors, self.mass_matrix)
        tied.require_reachable(self.points, self.links, self.anchors)
        tied.require_independent(self.points, self.links, self.anchors, self.guides)

    def __len__(self) -> int:
        """The number of base points P."""
        return len(self.points)

    def __repr__(self) -> str:
        parts = {name: len(getattr(self, name)) for name in ("links", "springs", "anchors", "contacts", "faces")}
        return f"Body({', '.join([f'{len(self)} points', *(f'{n} {name}' for name, n in parts.items() if n)])})"

    def strained(self) -> Pairs:
        """The edges (E, 2) of the strain."""
        return np.zeros((0, 2), np.int64) if self.strain is None else self.strain.edges

    def bonds(self) -> Pairs:
        """All tied pairs of points (B, 2): links, springs, and edges of the strain."""
        springs = np.array([spring[:2] for spring in self.springs], dtype=np.int64).reshape(-1, 2)
        return np.concatenate([self.links, springs, self.strained()])

    def center_of(self, position: Floats) -> Floats:
        """The centres of mass (3, n) of copies (3, P, n), or their velocities from velocities (3, P, n)."""
        weight = self.mass_matrix.sum(axis=0)
        # BLAS is not used, as its last bit depends on the processor and on the number of copies.
        return np.asarray(sum(part * position[:, point] for point, part in enumerate(weight / weight.sum())))

    def inverse_mass(self) -> Floats:
        """The inverse (P, P) of the mass matrix of the points that can move; 0 at anchored points."""
        free = np.setdiff1d(np.arange(len(self)), list(self.anchors))
        inverse = np.zeros((len(self), len(self)))
        inverse[np.ix_(free, free)] = algebra.inverse(self.mass_matrix[np.ix_(free, free)])
        return inverse


def _of_body(strain: Strain | None, count: int) -> Strain | None:
    """Return the strain of a body of `count` points, checked."""
    if strain is not None:
        if not isinstance(strain, Strain):
            raise SceneError(f"strain must be a swarm.Strain or None, got {checks.shown(strain)}")
        checked.numbers("strain.edges", strain.edges, 2, count)
    return strain
