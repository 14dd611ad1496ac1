"""A closed mesh of triangles from a file: read, its corners joined, its parts turned, or refused with a place.

Readers that join corners within a fixed distance make a small body a point, and those that join none leave seams open:
here equal corners are one, and then only corners of edges that are still open are joined, within a distance that grows
with the mesh. No feature of a surface that is closed is touched.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...extras import needed_by
from ..surface import shown

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

# Corners of open edges are joined within this part of the diagonal of the mesh, a hundred times what float32 rounds,
# and within this part of the shortest open edge, so that no edge vanishes.
_WELD, _OF_EDGE = 1e-5, 0.25
# Of the square of its longest edge, the area of a triangle that has none: round-off of float64.
_NO_AREA = 1e-14
# Corners of a part that are looked up in another one, about.
_LOOKED_UP = 16


class Mesh(NamedTuple):
    """Triangles that enclose a volume.

    Attributes:
        vertices: (V, 3) [m].
        triangles: (T, 3) their corners, counter-clockwise seen from outside.
        weld: how far a corner was moved at most to close seams [m].
    """

    vertices: Floats
    triangles: Indices
    weld: float


def read_mesh(path: Path, scale: float, weld: float | None) -> Mesh:
    """The mesh in a file.

    Args:
        path: of the file.
        scale: what a unit of the file is in metres.
        weld: the distance within which corners of open edges are one [m]; None: one that suits the mesh.

    Raises:
        SceneError: the file holds no mesh, or one that is not closed, whose triangles are not turned the same way, or
            whose parts intersect.
    """
    vertices, triangles = _joined(*_loaded(path, scale))
    edges, counts = _edges(triangles)
    moved = 0.0
    if (counts == 1).any():
        rims = edges[counts == 1]
        if weld is None:
            lengths = np.linalg.norm(np.diff(vertices[rims], axis=1)[:, 0], axis=1)
            size = float(np.linalg.norm(np.ptp(vertices[triangles], axis=(0, 1))))
            weld = min(_WELD * size, _OF_EDGE * float(lengths.min()))
        triangles, moved = _welded(vertices, triangles, np.unique(rims), weld)
        edges, counts = _edges(triangles)
    if (counts != 2).any():
        # A triangle along an edge, of no area, that closes nothing
        areas, longest = _sizes(vertices, triangles)
        kept = triangles[areas > _NO_AREA * longest**2]
        if len(kept) and (_edges(kept)[1] == 2).all():
            triangles = kept
        else:
            _refuse_open(path, vertices, edges, counts, weld)
    _require_turned(path, vertices, triangles)
    used, turned = np.unique(_outward(path, vertices, triangles), return_inverse=True)
    return Mesh(vertices[used], turned.reshape(-1, 3), moved)


# --- Corners ---------------------------------------------------------------------------------------------


def _loaded(path: Path, scale: float) -> tuple[Floats, Indices]:
    """The vertices (V, 3) [m] and triangles (T, 3) of a file, as they are there."""
    with needed_by("from_mesh", "mesh"):
        import trimesh
    try:
        mesh = trimesh.load_mesh(str(path), process=False)
        vertices = scale * np.asarray(mesh.vertices, np.float64)
        triangles = np.ascontiguousarray(mesh.faces, np.int64)
    except Exception as error:  # what readers of a dozen formats raise
        raise SceneError(f"cannot read the mesh {path}: {error or type(error).__name__}") from error
    if not len(triangles):
        raise SceneError(f"the mesh {path} must hold triangles, got none")
    wrong = np.argwhere(~np.isfinite(vertices[triangles]).all(axis=2))
    if len(wrong):
        which, corner = wrong[0]
        more = len(np.unique(wrong[:, 0])) - 1
        raise SceneError(
            f"the mesh {path} must hold triangles with finite corners, got {shown(vertices[triangles[which, corner]])} "
            f"as corner {corner} of triangle {which}, counted from 0, and {more} more like it; remove them and close "
            "the holes that they leave"
        )
    return vertices, triangles


def _joined(vertices: Floats, triangles: Indices) -> tuple[Floats, Indices]:
    """Each corner once, and no triangle twice or with two equal corners."""
    order = np.lexsort(vertices.T)
    first = np.ones(len(order), np.bool_)
    first[1:] = (vertices[order[1:]] != vertices[order[:-1]]).any(axis=1)
    place = np.empty(len(order), np.int64)
    place[order] = np.cumsum(first) - 1
    return vertices[order[first]], _proper(place[triangles])


def _proper(triangles: Indices) -> Indices:
    """Triangles of three corners, each once: those turned the other way are others."""
    a, b, c = triangles.T
    found = triangles[(a != b) & (b != c) & (c != a)]
    turned = np.take_along_axis(found, (found.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    which = np.unique(turned, axis=0, return_index=True)[1]
    return np.asarray(found[np.sort(which)])


def _welded(vertices: Floats, triangles: Indices, of: Indices, weld: float) -> tuple[Indices, float]:
    """The triangles with these corners joined where they are within a distance, and how far one was moved."""
    from scipy.spatial import KDTree

    pairs = KDTree(vertices[of]).query_pairs(weld, output_type="ndarray")
    group = components(pairs, len(of))
    # The first of a group, in the order of their coordinates, stands for all.
    place = np.arange(len(vertices))
    place[of] = of[np.unique(group, return_index=True)[1][group]]
    moved = np.linalg.norm(vertices[place[of]] - vertices[of], axis=1)
    return _proper(place[triangles]), float(moved.max())


# --- Whether it is closed --------------------------------------------------------------------------------


def _edges(triangles: Indices) -> tuple[Indices, Indices]:
    """The edges (E, 2), each once, and how many triangles each has."""
    found = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return np.unique(found, axis=0, return_counts=True)


def _sizes(vertices: Floats, triangles: Indices) -> tuple[Floats, Floats]:
    """The area of each triangle and its longest edge."""
    corners = vertices[triangles]
    sides = np.roll(corners, -1, axis=1) - corners
    areas = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return areas, np.linalg.norm(sides, axis=2).max(axis=1)


def _refuse_open(path: Path, vertices: Floats, edges: Indices, counts: Indices, weld: float | None) -> None:
    """Raise the error of a mesh that is not closed."""
    said = []
    rims = edges[counts == 1]
    if len(rims):
        corners, ends = np.unique(rims, return_inverse=True)
        holes = [vertices[corners[which]] for which in _groups(ends.reshape(-1, 2), len(corners))]
        sizes = [float(np.linalg.norm(np.ptp(hole, axis=0))) for hole in holes]
        largest = int(np.argmax(sizes))
        others = f" and {len(holes) - 1} more place{'s' if len(holes) > 2 else ''}; the largest hole"
        others = others if len(holes) > 1 else "; the hole"
        said.append(f"open at {shown(holes[largest].mean(axis=0))}{others} is {sizes[largest]:.3g} m across")
    many = edges[counts > 2]
    if len(many):
        said.append(f"three or more triangles meet at {shown(vertices[many[0]].mean(axis=0))}")
    if weld is not None:
        said.append(f"corners of open edges within weld = {weld:.3g} m of each other are joined")
    raise SceneError(
        f"the mesh {path} must be closed (watertight), with two triangles at each edge, got {len(rims)} edges of one "
        f"triangle and {len(many)} of more than two: {'; '.join(said)}; close its holes, for example with "
        "trimesh.repair or MeshLab"
    )


def _groups(pairs: Indices, count: int) -> list[Indices]:
    """Which of so many hang together, by these pairs (P, 2)."""
    label = components(pairs, count)
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1)


def components(pairs: Indices, count: int) -> Indices:
    """Of so many, by these pairs (P, 2), the number of the group that each is in."""
    from scipy.sparse import coo_matrix  # libigl needs it, so it is there
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def neighbours(triangles: Indices) -> tuple[Indices, Indices]:
    """The edges (E, 2) of a closed mesh, each once, and the two triangles (E, 2) of each."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    return edges[order[::2]], (order // 3).reshape(-1, 2)


# --- Which side is outside -------------------------------------------------------------------------------


def _require_turned(path: Path, vertices: Floats, triangles: Indices) -> None:
    """Raise unless the two triangles of each edge pass it in opposite directions."""
    edges, counts = np.unique(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=0, return_counts=True)
    wrong = edges[counts > 1]
    if len(wrong):
        raise SceneError(
            f"the mesh {path} must have all triangles turned the same way, got neighbours that are not at "
            f"{len(wrong)} edges, one at {shown(vertices[wrong[0]].mean(axis=0))}; turn them, for example with "
            "trimesh.repair.fix_winding"
        )


def _outward(path: Path, vertices: Floats, triangles: Indices) -> Indices:
    """The triangles seen from outside: a part within an odd number of others is a cavity, however it is turned."""
    parts = [triangles[which] for which in _groups(neighbours(triangles)[1], len(triangles))]
    for k, part in enumerate(parts):
        a, b, c = np.moveaxis(vertices[part] - vertices[part[0, 0]], 1, 0)
        if (a * np.cross(b, c)).sum() < 0.0:
            parts[k] = part[:, ::-1]
    if len(parts) == 1:
        return np.ascontiguousarray(parts[0])
    corners = [vertices[np.unique(part)] for part in parts]
    low, high = (np.array([getattr(one, end)(axis=0) for one in corners]) for end in ("min", "max"))
    turned = []
    for i, part in enumerate(parts):
        near = np.flatnonzero((low <= high[i]).all(axis=1) & (high >= low[i]).all(axis=1))
        depth = sum(_is_within(path, corners[i], vertices, parts[j]) for j in near if j != i)
        turned.append(part if depth % 2 == 0 else part[:, ::-1])
    return np.ascontiguousarray(np.concatenate(turned))


def _is_within(path: Path, points: Floats, vertices: Floats, part: Indices) -> bool:
    """Whether corners of a part lie within another one; an error if only some do."""
    with needed_by("from_mesh", "mesh"):
        import igl
    some = np.ascontiguousarray(points[:: max(1, len(points) // _LOOKED_UP)])
    turns = igl.winding_number(vertices, np.ascontiguousarray(part), some)
    inside, outside = turns > 0.75, turns < 0.25  # on the other one itself: a half
    if inside.any() and outside.any():
        raise SceneError(
            f"the mesh {path} must have parts that do not intersect, got one with a corner at {shown(some[inside][0])} "
            f"within another part and one at {shown(some[outside][0])} outside of it; unite them, for example with "
            "trimesh.boolean.union"
        )
    return bool(inside.any())
