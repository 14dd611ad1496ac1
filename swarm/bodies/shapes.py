"""Rigid bodies made of links: dumbbell, tetrahedron, chain, and homogeneous polyhedra."""

import itertools

import numpy as np
from numpy.typing import ArrayLike

from ..common import checks
from ..errors import SceneError
from ..state import Floats
from . import algebra, checked, covering, room
from .body import Body
from .checked import Pairs

# The corners of a cube that form a regular tetrahedron: their second moments are 4 times the identity.
_CORNERS = np.array([(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)])
_ALL_PAIRS = list(itertools.combinations(range(4), 2))
_OUTWARD = [(1, 3, 2), (0, 2, 3), (0, 3, 1), (0, 1, 2)]
# A polyhedron thinner than this, relative to its widest direction, is flat: its six links would have no digits.
_FLAT = 1e-4
# The volume, relative to a cube of the largest extent, below which a volume is round-off.
_EMPTY = 1e-12


def dumbbell(length: float, mass: float) -> Body:
    """Return two equal mass points at the ends of a link along x.

    Args:
        length: the length of the link, above 0 [m].
        mass: the mass of the whole body, above 0 [kg].

    Returns:
        The body; its centre is the origin.

    Raises:
        SceneError: an argument is out of its range.

    >>> dumbbell(length=2.0, mass=1.0).points[:, 0]
    array([-1.,  1.])
    """
    return chain(2, length, mass)


def chain(n: int, length: float, mass: float) -> Body:
    """Return equal mass points in a line along x, each linked to the next.

    Args:
        n: number of points, from 2 to some 3000, as the matrices of a body are full.
        length: the length of the whole chain, above 0 [m]; each of its n - 1 links is length/(n - 1) long.
        mass: the mass of the whole chain, above 0 [kg]; each point has mass/n.

    Returns:
        The body; its centre is the origin.

    Raises:
        SceneError: an argument is out of its range.

    >>> chain(10, length=0.9, mass=1.0)
    Body(10 points, 9 links, 10 contacts)
    """
    n = checks.count("n", n, least=2)
    room.require(n, ties=n - 1, contacts=n)
    length, mass = checks.length("length", length), checks.positive("mass", mass)
    points = np.zeros((n, 3))
    points[:, 0] = length * (np.arange(n) / (n - 1) - 0.5)
    return Body(points, mass / n, links=[(i, i + 1) for i in range(n - 1)])


def tetrahedron(edge: float, mass: float) -> Body:
    """Return four equal mass points at the corners of a regular tetrahedron, all linked.

    Args:
        edge: the length of each of its six links, above 0 [m].
        mass: the mass of the whole body, above 0 [kg].

    Returns:
        The body; its centre is the origin. The homogeneous solid is `rigid(tetrahedron(...).points, density)`.

    Raises:
        SceneError: an argument is out of its range.

    >>> tetrahedron(edge=1.0, mass=4.0)
    Body(4 points, 6 links, 4 contacts, 4 faces)
    """
    edge, mass = checks.length("edge", edge), checks.positive("mass", mass)
    return Body(_CORNERS * (edge / np.sqrt(8.0)), mass / 4.0, links=_ALL_PAIRS, faces=_OUTWARD)


def rigid(
    vertices: ArrayLike, density: float, faces: ArrayLike | None = None, contacts: ArrayLike | None = None
) -> Body:
    """Return a rigid homogeneous polyhedron.

    Its four base points have a quarter of its mass each, at places that give exactly the centre and the inertia of the
    solid. Its contact points are the vertices. Between them nothing touches a wall: a solid smaller than a face, or a
    corner of a solid, passes into the body unless `contacts` are closer than it is wide.

    Args:
        vertices: (K, 3) corners [m].
        density: above 0 [kg/m^3].
        faces: (F, 3) triangles of vertices, closed, anticlockwise seen from outside; None: the convex hull, which needs
            SciPy.
        contacts: the points that touch walls besides the vertices: a number, the largest distance of neighbours on the
            edges and in the faces [m]; or points (Q, 3) anywhere in the body [m].

    Returns:
        The body; vertex k is its contact point k, at the given place, and the other contact points follow.

    Raises:
        SceneError: an argument is out of its range; the vertices lie in a plane; the faces are not closed, or do not
            all face outwards.

    >>> cube = rigid([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], density=6.0)
    >>> cube
    Body(4 points, 6 links, 8 contacts, 12 faces)
    >>> float(cube.mass_matrix.sum().round(12))  # kg
    6.0
    """
    corners = checked.places("vertices", vertices)
    room.require(4, contacts=len(corners))
    density = checks.positive("density", density)
    triangles = _hull(corners) if faces is None else _closed(corners, faces)
    volume, center, moment = _moments(corners, triangles)
    squares, axes = algebra.modes_of_three(moment)
    if not squares.min() > _FLAT**2 * squares.max():
        raise _flat(corners)
    root, inverse = (algebra.product(axes * scales, axes.T) for scales in (np.sqrt(squares), 1.0 / np.sqrt(squares)))
    base = center + algebra.product(_CORNERS, root)
    touching = np.concatenate([corners, _between(corners, triangles, contacts)])
    # The weights of the base points, which add up to 1, for each contact point; weights of 1/4 give the centre.
    weights = np.full((len(touching), 4), 0.25)
    for _improvement in range(2):
        missing = touching - algebra.product(weights, base)
        weights += 0.25 * algebra.product(algebra.product(missing, inverse), _CORNERS.T)
    return Body(base, density * volume / 4.0, links=_ALL_PAIRS, contacts=weights, faces=triangles.tolist())


def _between(corners: Floats, triangles: Pairs, contacts: ArrayLike | None) -> Floats:
    """Return the contact points (Q, 3) besides the corners."""
    if contacts is None:
        return np.zeros((0, 3))
    if checks.array("contacts", contacts).ndim == 0:
        return covering.points(corners, triangles, checks.length("contacts", contacts))
    return checked.places("contacts", contacts)


def _flat(corners: Floats) -> SceneError:
    return SceneError(
        f"vertices must be the corners of a solid, got {len(corners)} that lie in a plane to within {_FLAT:g} of their "
        "extent; a flat body is a Body of points and links"
    )


def _hull(corners: Floats) -> Pairs:
    """Return the triangles of the convex hull, anticlockwise seen from outside."""
    from ..common.extras import needed_by

    with needed_by("a rigid body without faces", "bodies"):
        from scipy.spatial import ConvexHull, QhullError
    size = np.ptp(corners, axis=0).max()
    try:
        # Corners are relative to their middle and their extent, as the tolerances of Qhull are absolute.
        hull = ConvexHull((corners - corners.mean(axis=0)) / (size or 1.0))
    except (QhullError, ValueError):
        raise _flat(corners) from None
    triangles = np.asarray(hull.simplices, dtype=np.int64)
    a, b, c = corners[triangles].transpose(1, 0, 2)
    inward = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(axis=1) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return triangles


def _closed(corners: Floats, faces: ArrayLike) -> Pairs:
    """Return `faces` as triangles of a closed surface, which traverse each side once in each direction."""
    triangles = checked.numbers("faces", faces, 3, len(corners))  # type: ignore[arg-type]
    if not len(triangles):
        raise SceneError(
            "faces must hold the triangles of a closed surface, got none; leave it out for the convex hull"
        )
    owners: dict[tuple[int, int], int] = {}
    for k, (a, b, c) in enumerate(triangles.tolist()):
        for side in ((a, b), (b, c), (c, a)):
            if side in owners:
                raise SceneError(
                    f"faces must be oriented alike, got faces[{owners[side]}] and faces[{k}], which both run from "
                    f"vertex {side[0]} to {side[1]}; reverse one of them"
                )
            owners[side] = k
    for (a, b), k in owners.items():
        if (b, a) not in owners:
            raise SceneError(f"faces must be closed, got faces[{k}] without a neighbour at its side from {a} to {b}")
    for k in sorted(set(range(len(corners))) - set(triangles.ravel().tolist())):
        raise SceneError(f"vertices[{k}] must be the corner of a face, got one that no face uses; leave it out")
    return triangles


def _moments(corners: Floats, triangles: Pairs) -> tuple[float, Floats, Floats]:
    """Return volume, centroid, and second moment about it per volume (3, 3), from the tetrahedra of the triangles."""
    middle = corners.mean(axis=0)
    sides = (corners - middle)[triangles]
    volumes = algebra.determinants(sides) / 6.0
    volume, sums = float(volumes.sum()), sides.sum(axis=1)
    if abs(volume) <= _EMPTY * np.ptp(corners, axis=0).max() ** 3:
        raise _flat(corners)
    if volume < 0.0:
        raise SceneError(
            f"faces must be anticlockwise seen from outside, got a volume of {volume:g} m^3; reverse every face"
        )
    # For a tetrahedron with a corner at 0, the integral of x is V/4 sum a, of x x^T V/20 (sum a a^T + sum a sum a^T).
    center = (volumes[:, None] * sums).sum(axis=0) / (4.0 * volume)
    squares = np.einsum("f,fax,fay->xy", volumes, sides, sides) + np.einsum("f,fx,fy->xy", volumes, sums, sums)
    return volume, middle + center, squares / (20.0 * volume) - np.outer(center, center)
