"""Elastic bodies: tetrahedra of Saint Venant and Kirchhoff, with an energy that is quadratic in squared lengths.

An element with edges X_a at rest and x_a now has s_a - s_a0 = |x_a|^2 - |X_a|^2 = 2 X_a.E X_a with the strain
E = (F^T F - 1)/2. Six edges give the six components of E, so that its energy V = volume (lambda/2 tr(E)^2 + mu E:E) is
exactly (s - s0).K (s - s0)/2.
"""

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..common import checks
from ..errors import SceneError
from ..state import Floats
from . import algebra, checked, room
from .body import Body, Strain
from .checked import Pairs

_EDGES = np.array(list(itertools.combinations(range(4), 2)))
# The sides of a positively oriented tetrahedron, anticlockwise seen from outside.
_SIDES = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])
# The volume below which an element is flat, relative to a cube of its longest edge: no digits are left.
_FLAT = 1e-9
# The components E_xx, E_yy, E_zz, E_yz, E_xz, E_xy: their rows and columns in E, and their multiplicities in E:E.
_ROWS, _COLUMNS = (0, 1, 2, 1, 0, 0), (0, 1, 2, 2, 2, 1)
_TIMES = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])


def elastic(
    mesh: tuple[ArrayLike, ArrayLike], young: float, poisson: float, density: float, mass: str = "lumped"
) -> Body:
    """Return an elastic solid of Saint Venant and Kirchhoff, made of tetrahedra.

    Args:
        mesh: (nodes, elements): the places (P, 3) of the nodes without stress [m], and the nodes (T, 4) of each
            tetrahedron: seen from the fourth node, the first three are anticlockwise.
        young: Young's modulus, above 0 [Pa].
        poisson: Poisson's ratio, above -1 and below 0.5.
        density: above 0 [kg/m^3].
        mass: "lumped", a quarter of an element at each of its nodes, or "consistent", of linear displacements.

    Returns:
        The body; its contact points are the nodes of its surface, in order, and its faces the triangles of its surface.

    Raises:
        SceneError: an argument is out of its range; an element is flat or inside out; a node is in no element.

    >>> elastic(block(lengths=(1.0, 1.0, 2.0), cells=(1, 1, 2)), young=1e6, poisson=0.3, density=1e3)
    Body(12 points, 12 contacts, 20 faces)
    """
    nodes, elements, volumes = _checked(mesh)
    young = checks.positive("young", young)
    poisson = checks.number("poisson", poisson)
    if not -1.0 < poisson < 0.5:
        raise SceneError(f"poisson must be above -1 and below 0.5, got {poisson:g}")
    density = checks.positive("density", density)
    mass = checks.one_of("mass", mass, ("lumped", "consistent"))
    surface = _surface(elements)
    outer = np.unique(surface)
    return Body(
        nodes,
        mass_matrix=_masses(elements, density * volumes, len(nodes), mass == "consistent"),
        contacts=outer,
        strain=_strain(nodes, elements, volumes, young, poisson),
        faces=np.searchsorted(outer, surface).tolist(),
    )


def block(lengths: Sequence[float], cells: Sequence[int]) -> tuple[Floats, Pairs]:
    """Return tetrahedra that fill a rectangular block: six in each cell, around the same diagonal, so that they match.

    Args:
        lengths: three numbers above 0, the edges of the whole block along x, y, z [m].
        cells: three numbers of cells along x, y, z, 1 or more.

    Returns:
        Nodes (P, 3) [m], centred at the origin, and elements (T, 4), as `elastic` takes them.

    Raises:
        SceneError: an argument is out of its range.

    >>> nodes, elements = block((1.0, 1.0, 1.0), (2, 1, 1))
    >>> nodes.shape, elements.shape
    ((12, 3), (12, 4))
    """
    edges = [checks.length(f"lengths[{i}]", part) for i, part in enumerate(checks.vector("lengths", lengths))]
    counts = [checks.count(f"cells[{i}]", n) for i, n in enumerate(checks.entries("cells", cells, 3, "3 numbers"))]
    room.require(math.prod(count + 1 for count in counts))
    axes = [edge * (np.arange(count + 1) / count - 0.5) for edge, count in zip(edges, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    steps = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
    first = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3) @ steps
    elements = []
    for order in itertools.permutations(range(3)):
        corners = np.concatenate([[0], np.cumsum(steps[list(order)])])
        if algebra.determinants(np.eye(3)[list(order)]) < 0.0:
            corners = corners[[0, 2, 1, 3]]
        elements.append(first[:, None] + corners)
    return nodes, np.concatenate(elements)


def _checked(mesh: tuple[ArrayLike, ArrayLike]) -> tuple[Floats, Pairs, Floats]:
    """Return nodes, elements and the volumes of the elements."""
    if not isinstance(mesh, (tuple, list)) or len(mesh) != 2:
        raise SceneError(f"mesh must be two arrays (nodes, elements), got {type(mesh).__name__}")
    nodes = checked.places("nodes", mesh[0])
    elements = checked.numbers("elements", mesh[1], 4, len(nodes))  # type: ignore[arg-type]
    if not len(elements):
        raise SceneError("elements must hold at least one tetrahedron, got none")
    for k in sorted(set(range(len(nodes))) - set(elements.ravel().tolist())):
        raise SceneError(f"nodes[{k}] must belong to an element, got one without; it has no mass: leave it out")
    corners = nodes[elements]
    volumes = algebra.determinants(corners[:, 1:] - corners[:, :1]) / 6.0
    longest = (_edge_vectors(corners) ** 2).sum(axis=2).max(axis=1) ** 1.5
    for k in np.flatnonzero(np.abs(volumes) <= _FLAT * longest)[:1]:
        raise SceneError(
            f"elements[{k}] must be a solid tetrahedron, got {elements[k].tolist()}: its corners lie in a plane, its "
            f"volume is {volumes[k]:.3g} m^3"
        )
    for k in np.flatnonzero(volumes < 0.0)[:1]:
        raise SceneError(
            f"elements[{k}] must have a volume above 0, got {volumes[k]:.3g} m^3 for {elements[k].tolist()} (and "
            f"{(volumes < 0.0).sum() - 1} more below 0): it is inside out; exchange two of its nodes"
        )
    return nodes, elements, volumes


def _edge_vectors(corners: Floats) -> Floats:
    """The edge vectors (T, 6, 3) of tetrahedra (T, 4, 3)."""
    return np.asarray(corners[:, _EDGES[:, 1]] - corners[:, _EDGES[:, 0]])


def _masses(elements: Pairs, masses: Floats, count: int, consistent: bool) -> Floats:
    matrix = np.zeros((count, count))
    # The integral of N_i N_j over an element is V (1 + delta_ij)/20.
    part = (np.ones((4, 4)) + np.eye(4)) / 20.0 if consistent else np.eye(4) / 4.0
    np.add.at(matrix, (elements[:, :, None], elements[:, None, :]), masses[:, None, None] * part)
    return matrix


def _strain(nodes: Floats, elements: Pairs, volumes: Floats, young: float, poisson: float) -> Strain:
    # The gradients b of barycentric coordinates give E = -sum over edges (s - s0) (b_i b_j^T + b_j b_i^T)/4, as
    # |sum l_i X_i|^2 = -sum over edges l_i l_j s_ij for numbers l that add up to 0.
    corners = nodes[elements]
    sides = corners[:, 1:] - corners[:, :1]
    gradients = np.cross(sides[:, (1, 2, 0)], sides[:, (2, 0, 1)]) / (6.0 * volumes)[:, None, None]
    gradients = np.concatenate([-gradients.sum(axis=1, keepdims=True), gradients], axis=1)
    first, second = (gradients[:, _EDGES[:, k]].transpose(0, 2, 1) for k in (0, 1))
    to_strain = -0.25 * (first[:, _ROWS] * second[:, _COLUMNS] + first[:, _COLUMNS] * second[:, _ROWS])
    shear = young / (2.0 * (1.0 + poisson))
    law = np.diag(2.0 * shear * _TIMES)
    law[:3, :3] += young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    stiffness = volumes[:, None, None] * np.einsum("tia,ij,tjb->tab", to_strain, law, to_strain)
    pairs = np.sort(elements[:, _EDGES], axis=2).reshape(-1, 2)
    edges, number = np.unique(pairs, axis=0, return_inverse=True)
    number = number.reshape(-1, 6)
    room.require(len(nodes), ties=len(edges), edges=len(edges))
    matrix = np.zeros((len(edges), len(edges)))
    np.add.at(matrix, (number[:, :, None], number[:, None, :]), stiffness)
    rest = ((nodes[edges[:, 0]] - nodes[edges[:, 1]]) ** 2).sum(axis=1)
    return Strain(edges, rest, matrix)


def _surface(elements: Pairs) -> Pairs:
    """Return the triangles that belong to one element only."""
    sides = elements[:, _SIDES].reshape(-1, 3)
    unique, index, count = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    for k in np.flatnonzero(count > 2)[:1]:
        raise SceneError(
            f"elements must not overlap, got {count[k]} that share the triangle of nodes {unique[k].tolist()}"
        )
    return np.asarray(sides[np.sort(index[count == 1])])
