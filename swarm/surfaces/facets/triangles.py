"""A mesh of triangles: its corners joined, its parts turned if it is closed, or refused, and its triangles sorted."""

from pathlib import Path
from typing import Any

import numpy as np

from ...common.extras import needed_by
from ...errors import SceneError
from ...state import Floats, Indices
from ..surface import shown
from .mending import edges_of, groups_of, have_area, joined, neighbours, seams_closed, turned_alike, without_flat
from .mesh_files import Soup, read_soup

# About this number of corners of a part are tested against another part.
_LOOKED_UP = 16
# At most this number of holes is listed.
_LISTED = 5
# Bits of a place along each axis, by which triangles are sorted.
_BITS = 20


def read_mesh(path: Path, scale: float, weld: float | None) -> tuple[Soup, float]:
    """Return the mesh in a file, and the largest move of a corner to close seams [m].

    The triangles enclose a volume; seen from outside their corners are counter-clockwise.

    Args:
        path: path of the file.
        scale: length of a unit of the file in metres.
        weld: the distance within which corners of open edges are joined [m]; None: one that suits the mesh.

    Raises:
        SceneError: the file holds no mesh, or one that is not closed, has triangles that cannot be turned the same
            way, or has parts that intersect.
    """
    return closed(path, read_soup(path, scale), weld)


def closed(path: Path, soup: Soup, weld: float | None) -> tuple[Soup, float]:
    """Return the closed mesh of triangles, as `read_mesh` does."""
    soup, moved, within = seams_closed(joined(soup), weld)
    edges, counts = edges_of(soup.triangles)
    if not len(soup.triangles) or (counts != 2).any():
        # Removes a triangle along an edge, of no area, that closes nothing
        soup = without_flat(soup)
        edges, counts = edges_of(soup.triangles)
        if not len(soup.triangles) or (counts != 2).any():
            _refuse_open(path, soup.vertices, edges, counts, within)
    soup, wrong = turned_alike(soup)
    if len(wrong):
        raise SceneError(
            f"the mesh {path} must have an outside, got triangles that cannot all be turned the same way, as those of "
            f"a Klein bottle: neighbours are not at {len(wrong)} edges, one at "
            f"{shown(soup.vertices[wrong[0]].mean(axis=0))}; mend it, for example with MeshLab"
        )
    return _of_used(_outward(path, soup)), moved


def sheets(path: Path, soup: Soup, weld: float | None) -> tuple[Soup, float]:
    """Return the sheets of triangles, each triangle once; their corners are joined as in a closed mesh."""
    soup, moved, _within = seams_closed(joined(soup), weld)
    _corners, first = np.unique(np.sort(soup.triangles, axis=1), axis=0, return_index=True)
    kept = np.sort(first)
    kept = kept[have_area(soup.vertices, soup.triangles[kept])]
    if not len(kept):
        raise SceneError(f"the mesh {path} must hold triangles that have an area, got none")
    return _of_used(soup.of(soup.triangles[kept], kept)), moved


def _of_used(soup: Soup) -> Soup:
    """Return the triangles with only the corners that they use."""
    used, turned = np.unique(soup.triangles, return_inverse=True)
    return soup._replace(vertices=soup.vertices[used], triangles=turned.reshape(-1, 3))


# --- Whether it is closed --------------------------------------------------------------------------------


def _refuse_open(path: Path, vertices: Floats, edges: Indices, counts: Indices, weld: float | None) -> None:
    """Raise the error of a mesh that is not closed."""
    messages = []
    rims = edges[counts == 1]
    if len(rims):
        corners, ends = np.unique(rims, return_inverse=True)
        holes = [vertices[corners[which]] for which in groups_of(ends.reshape(-1, 2), len(corners))]
        sizes = [float(np.linalg.norm(np.ptp(hole, axis=0))) for hole in holes]
        order = np.argsort(sizes)[::-1].tolist()
        others = f" and {len(holes) - 1} more place{'s' if len(holes) > 2 else ''}; the largest hole"
        others = others if len(holes) > 1 else "; the hole"
        messages.append(f"open at {shown(holes[order[0]].mean(axis=0))}{others} is {sizes[order[0]]:.3g} m across")
        if len(holes) > 1:
            listed = (f"{sizes[k]:.3g} m at {shown(holes[k].mean(axis=0))}" for k in order[1:_LISTED])
            messages.append(f"then {', '.join(listed)}{', ...' if len(holes) > _LISTED else ''}")
    many = edges[counts > 2]
    if len(many):
        messages.append(f"three or more triangles meet at {shown(vertices[many[0]].mean(axis=0))}")
    if weld is not None:
        messages.append(f"corners of open edges within weld = {weld:.3g} m of each other are joined")
    raise SceneError(
        f"the mesh {path} must be closed (watertight), with two triangles at each edge, got {len(rims)} edges of one "
        f"triangle and {len(many)} of more than two: {'; '.join(messages)}; close its holes, for example with "
        "trimesh.repair or MeshLab, or use swarm.Mesh with open=True: its triangles are walls from both sides"
    )


# --- Which side is outside -------------------------------------------------------------------------------


def _outward(path: Path, soup: Soup) -> Soup:
    """Return the triangles as seen from outside: a part within an odd number of others is a cavity, however turned."""
    vertices, triangles = soup.vertices, soup.triangles
    which = groups_of(neighbours(triangles)[1], len(triangles))
    parts = [triangles[some] for some in which]
    for k, part in enumerate(parts):
        a, b, c = np.moveaxis(vertices[part] - vertices[part[0, 0]], 1, 0)
        if (a * np.cross(b, c)).sum() < 0.0:
            parts[k] = part[:, ::-1]
    if len(parts) == 1:
        return soup._replace(triangles=np.ascontiguousarray(parts[0]))
    corners = [vertices[np.unique(part)] for part in parts]
    low, high = (np.array([getattr(one, end)(axis=0) for one in corners]) for end in ("min", "max"))
    turned = []
    for i, part in enumerate(parts):
        near = np.flatnonzero((low <= high[i]).all(axis=1) & (high >= low[i]).all(axis=1))
        depth = sum(_is_within(path, corners[i], vertices, parts[j]) for j in near if j != i)
        turned.append(part if depth % 2 == 0 else part[:, ::-1])
    return soup.of(np.ascontiguousarray(np.concatenate(turned)), np.concatenate(which))


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


# --- In which order they are -----------------------------------------------------------------------------


def sorted_by_place(mesh: Soup) -> Soup:
    """Return the triangles by their groups, and near ones near: the entries of a cell are in few lines of the cache."""
    middles = mesh.vertices[mesh.triangles].mean(axis=1)
    low, wide = middles.min(axis=0), float(np.ptp(middles, axis=0).max()) or 1.0
    places = ((middles - low) * ((2**_BITS - 1) / wide)).astype(np.int64)
    keys = np.zeros(len(places), np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            keys |= (places[:, axis] >> bit & 1) << (3 * bit + axis)
    order = np.lexsort((keys, mesh.group))
    triangles: Any = np.ascontiguousarray(mesh.triangles[order], np.int32)
    group: Any = mesh.group[order].astype(np.int32)
    return mesh._replace(triangles=triangles, group=group)
