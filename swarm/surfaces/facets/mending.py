"""Repairs of files of triangles: unjoined corners, degenerate triangles, and triangles that are turned over.

Readers that join corners within a fixed distance shrink a small body to a point, and readers that join none leave seams
open: here equal corners are joined, and then only corners of edges that are still open, within a distance that grows
with the mesh. No feature of a closed surface is changed.
"""

import itertools

import numpy as np

from ...state import Floats, Indices
from .mesh_files import Soup

# Corners of open edges are joined within this part of the diagonal of the mesh, a hundred times the round-off of
# float32, and within this part of the shortest open edge, so that no edge vanishes.
_WELD, _OF_EDGE = 1e-5, 0.25
# The least area of a triangle, as a part of the square of its longest edge: round-off of float64.
_NO_AREA = 1e-14
# Rounds in which triangles are split at corners on their open edges, one edge of each in a round.
_ROUNDS = 30


def joined(soup: Soup) -> Soup:
    """Return the triangles with each corner once, and no triangle twice or with two equal corners."""
    order = np.lexsort(soup.vertices.T)
    first = np.ones(len(order), np.bool_)
    first[1:] = (soup.vertices[order[1:]] != soup.vertices[order[:-1]]).any(axis=1)
    place = np.empty(len(order), np.int64)
    place[order] = np.cumsum(first) - 1
    return proper(soup._replace(vertices=soup.vertices[order[first]], triangles=place[soup.triangles]))


def proper(soup: Soup) -> Soup:
    """Return the triangles of three different corners, each once; a triangle and its reverse are different."""
    a, b, c = soup.triangles.T
    whole = np.flatnonzero((a != b) & (b != c) & (c != a))
    found = soup.triangles[whole]
    turned = np.take_along_axis(found, (found.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    kept = np.sort(np.unique(turned, axis=0, return_index=True)[1])
    return soup.of(found[kept], whole[kept])


def seams_closed(soup: Soup, weld: float | None) -> tuple[Soup, float, float | None]:
    """Return the triangles with open edges closed, the largest move of a corner, and the distance for joining.

    Corners of open edges within this distance of each other are joined, and a triangle with a corner of another on its
    open edge, within this distance, is split.
    """
    edges, counts = edges_of(soup.triangles)
    if not (counts == 1).any():
        return soup, 0.0, weld
    rims, size = edges[counts == 1], float(np.linalg.norm(np.ptp(soup.vertices[soup.triangles], axis=(0, 1))))
    beside = _WELD * size if weld is None else weld
    if weld is None:
        lengths = np.linalg.norm(np.diff(soup.vertices[rims], axis=1)[:, 0], axis=1)
        weld = min(_WELD * size, _OF_EDGE * float(lengths.min()))
    soup, moved = _welded(soup, np.unique(rims), weld)
    soup = _without_flat(soup)
    for _round in range(_ROUNDS):
        split = _split(soup, beside)
        if split is None:
            break
        soup = _without_flat(proper(split))
    return soup, moved, weld


def _welded(soup: Soup, of: Indices, weld: float) -> tuple[Soup, float]:
    """Return the triangles with these corners joined within a distance, and the largest move of a corner."""
    from scipy.spatial import KDTree

    vertices = soup.vertices
    pairs = KDTree(vertices[of]).query_pairs(weld, output_type="ndarray")
    group = components(pairs, len(of))
    # The first corner of a group, in the order of coordinates, replaces all.
    place = np.arange(len(vertices))
    place[of] = of[np.unique(group, return_index=True)[1][group]]
    moved = np.linalg.norm(vertices[place[of]] - vertices[of], axis=1)
    return proper(soup._replace(triangles=place[soup.triangles])), float(moved.max())


def _without_flat(soup: Soup) -> Soup:
    """Return the triangles with an area, if edges are open: one without area lies along an edge, and closes nothing."""
    if (edges_of(soup.triangles)[1] == 2).all():
        return soup
    kept = have_area(soup.vertices, soup.triangles)
    return soup.of(soup.triangles[kept], kept) if len(kept) else soup


def without_flat(soup: Soup) -> Soup:
    """Return the triangles with an area, if they are closed without the rest."""
    kept = have_area(soup.vertices, soup.triangles)
    is_closed = len(kept) > 0 and bool((edges_of(soup.triangles[kept])[1] == 2).all())
    return soup.of(soup.triangles[kept], kept) if is_closed else soup


def _split(soup: Soup, beside: float) -> Soup | None:
    """Return the triangles split at corners on their open edges, along one edge of each; None if none is split."""
    from scipy.spatial import KDTree

    edges, counts = edges_of(soup.triangles)
    rims = edges[counts == 1]
    if not len(rims):
        return None
    vertices, corners = soup.vertices, np.unique(rims)
    tree = KDTree(vertices[corners])
    sides = np.sort(soup.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    scale = np.array([len(vertices), 1])
    made, from_which, gone = [], [], set()
    for place in np.flatnonzero(np.isin(sides @ scale, rims @ scale)).tolist():
        which, k = divmod(place, 3)
        if which in gone:
            continue
        a, b, c = np.roll(soup.triangles[which], -k).tolist()
        way = vertices[b] - vertices[a]
        length = float(np.linalg.norm(way))
        near = corners[tree.query_ball_point(vertices[a] + 0.5 * way, 0.5 * length + beside)]
        near = near[(near != a) & (near != b) & (near != c)]
        along = (vertices[near] - vertices[a]) @ way / length**2
        off = np.linalg.norm(vertices[near] - vertices[a] - along[:, None] * way, axis=1)
        on = (off <= beside) & (along > 0.0) & (along < 1.0)
        if not on.any():
            continue
        chain = [a, *near[on][np.argsort(along[on])].tolist(), b]
        gone.add(which)
        made += [(p, q, c) for p, q in itertools.pairwise(chain)]
        from_which += (len(chain) - 1) * [which]
    if not gone:
        return None
    kept = np.setdiff1d(np.arange(len(soup.triangles)), sorted(gone))
    return soup.of(
        np.concatenate([soup.triangles[kept], np.array(made, np.int64)]), np.concatenate([kept, from_which]).astype(int)
    )


# --- Orientation of triangles ----------------------------------------------------------------------------


def turned_alike(soup: Soup) -> tuple[Soup, Indices]:
    """Return the triangles of a closed mesh, turned like their neighbours, and the edges (E, 2) where this fails."""
    ways, counts = np.unique(soup.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=0, return_counts=True)
    if not (counts > 1).any():
        return soup, ways[:0]
    edges, pairs = neighbours(soup.triangles)
    across = _passes(soup.triangles, edges, pairs)
    beside: list[list[tuple[int, bool]]] = [[] for _triangle in soup.triangles]
    for (one, other), turn in zip(pairs.tolist(), across.tolist(), strict=True):
        beside[one].append((other, turn))
        beside[other].append((one, turn))
    turns = np.full(len(beside), -1)
    for start in range(len(beside)):
        if turns[start] >= 0:
            continue
        turns[start], part, queue = 0, [start], [start]
        while queue:
            one = queue.pop()
            for other, turn in beside[one]:
                if turns[other] < 0:
                    turns[other] = turns[one] ^ turn
                    queue.append(other)
                    part.append(other)
        if 2 * turns[part].sum() > len(part):
            turns[part] = 1 - turns[part]
    triangles = np.where(turns[:, None] == 1, soup.triangles[:, ::-1], soup.triangles)
    return soup._replace(triangles=triangles), edges[_passes(triangles, edges, pairs)]


def _passes(triangles: Indices, edges: Indices, pairs: Indices) -> Indices:
    """Return at which edges both triangles pass in the same direction."""
    found = []
    for side in pairs.T:
        corners = triangles[side]
        at = (corners == edges[:, :1]).argmax(axis=1)
        found.append(np.take_along_axis(corners, ((at + 1) % 3)[:, None], axis=1)[:, 0] == edges[:, 1])
    return np.asarray(found[0] == found[1])


# --- Edges and parts -------------------------------------------------------------------------------------


def edges_of(triangles: Indices) -> tuple[Indices, Indices]:
    """Return the edges (E, 2), each once, and the number of triangles of each."""
    found = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    most = int(found.max(initial=0)) + 1
    keys, counts = np.unique(found[:, 0] * most + found[:, 1], return_counts=True)
    return np.stack(np.divmod(keys, most), axis=1), counts


def sizes(vertices: Floats, triangles: Indices) -> tuple[Floats, Floats]:
    """Return the area of each triangle and its longest edge."""
    corners = vertices[triangles]
    sides = np.roll(corners, -1, axis=1) - corners
    areas = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return areas, np.linalg.norm(sides, axis=2).max(axis=1)


def have_area(vertices: Floats, triangles: Indices) -> Indices:
    """Return the numbers of the triangles that have an area."""
    areas, longest = sizes(vertices, triangles)
    return np.flatnonzero(areas > _NO_AREA * longest**2)


def components(pairs: Indices, count: int) -> Indices:
    """Return for each of `count` items the number of the group that it is in, by connected pairs (P, 2)."""
    from scipy.sparse import coo_matrix  # libigl needs it, so it is there
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def groups_of(pairs: Indices, count: int) -> list[Indices]:
    """Return the groups of `count` items that are connected by pairs (P, 2)."""
    return parts_of(components(pairs, count))


def parts_of(numbers: Indices) -> list[Indices]:
    """Return for each different number the places where it is."""
    order = np.argsort(numbers, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(numbers[order])) + 1)


def neighbours(triangles: Indices) -> tuple[Indices, Indices]:
    """Return the edges (E, 2) of a closed mesh, each once, and the two triangles (E, 2) of each."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    return edges[order[::2]], (order // 3).reshape(-1, 2)
