"""How the facets of a mesh are made: arrays checked, triangles sorted, their numbers, and what is free around cells."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common import checks
from ...errors import SceneError
from ...kernel.arrays import aligned_copy
from ...kernel.vector import Vec
from ...state import Floats
from ..balls.facet import RoundTriangle
from ..fields.many import field_of
from ..fields.members import Members
from .facet import THIN
from .free_room import CLOSED, FREE, KIND, with_blocks, with_cones
from .members import Facets
from .mesh_files import Soup
from .nearest import nearest

# Bits of a place along each axis, by which triangles are sorted.
_BITS = 20


def given_arrays(vertices: Any, triangles: Any, group: Any, names: Any, scale: float) -> Soup:
    """The arguments that are arrays, checked."""
    if triangles is None:
        raise SceneError("triangles must be (T, 3) numbers of corners, got None; or give the path of a file alone")
    corners = checks.array("vertices", vertices)
    if corners.ndim != 2 or corners.shape[1] != 3 or not np.isfinite(corners).all():
        raise SceneError(
            f"vertices must be (V, 3) finite numbers, got shape {corners.shape}; or give the path of a file"
        )
    cells = _whole("triangles", triangles)
    if cells.ndim != 2 or cells.shape[1] != 3 or not len(cells) or cells.dtype.kind not in "iu":
        raise SceneError(f"triangles must be (T, 3) whole numbers, got shape {cells.shape} of {cells.dtype}")
    if cells.min() < 0 or cells.max() >= len(corners):
        wrong = int(np.argwhere((cells < 0) | (cells >= len(corners)))[0, 0])
        raise SceneError(
            f"triangles must be numbers from 0 to {len(corners) - 1}, of which each is a corner, got "
            f"{cells[wrong].tolist()} in row {wrong}"
        )
    of = np.zeros(len(cells), np.int64) if group is None else _whole("group", group).astype(np.int64)
    known = tuple(map(str, names)) or tuple(map(str, range(int(of.max()) + 1))) if group is not None else ("",)
    if of.shape != (len(cells),) or of.min() < 0 or of.max() >= len(known):
        raise SceneError(
            f"group must be (T,) numbers of {len(known)} names, one for each of the {len(cells)} triangles, got shape "
            f"{of.shape} from {of.min()} to {of.max()}"
        )
    return Soup(scale * corners, cells.astype(np.int64), of, known)


def _whole(name: str, values: Any) -> NDArray[Any]:
    """An argument as an array of whole numbers, at least one."""
    try:
        found = np.asarray(values)
    except Exception:  # rows of different lengths, or an object of others
        found = np.empty(0)
    if found.dtype.kind not in "iu" or not found.size:
        raise SceneError(f"{name} must be whole numbers, one or more, got {checks.shown(values)}")
    return found


def sorted_by_place(mesh: Soup) -> Soup:
    """The triangles by their groups, those near to each other near: what a cell holds is in few lines of the cache."""
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


def table_of_facets(corners: Floats) -> Floats:
    """The normals and the offsets of facets with these corners (T, 3, 3), one in each row."""
    normal = _normals(*np.moveaxis(corners, 1, 0))
    return aligned_copy(np.concatenate([normal, (normal * corners.mean(axis=1)).sum(axis=1)[:, None]], axis=1))


def table_of_sides(corners: Floats, room: float) -> Floats:
    """The numbers of both sides of sheets with these corners (T, 3, 3), side by side; `room` is round-off [m]."""
    table = aligned_copy(np.repeat(table_of_facets(corners), 2, axis=0))
    table[1::2] *= -1.0
    table[:, 3] -= THIN * room
    return table


def triangles_of_balls(corners: Floats, largest: float) -> Members:
    """The triangles with these corners (T, 3, 3) as balls meet them, with radii of at most the largest one [m]."""
    a, b, c = np.moveaxis(corners, 1, 0)
    table = aligned_copy(np.concatenate([a, b - a, c - a, np.zeros((len(a), 1))], axis=1))
    zero = Vec(0.0, 0.0, 0.0)
    low, high = (np.ascontiguousarray(end(corners, axis=1).T) for end in (np.min, np.max))
    return field_of(RoundTriangle(zero, zero, zero, 0.0), table, lambda: (low, high), None, largest)


def _normals(a: Floats, b: Floats, c: Floats) -> Floats:
    """Unit normals of triangles, from the two shorter sides."""
    sides = np.stack([b - a, c - b, a - c])
    longest = (sides**2).sum(axis=2).argmax(axis=0)
    every = np.arange(len(a))
    found = np.cross(sides[(longest + 1) % 3, every], sides[(longest + 2) % 3, every])
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


def with_room(facets: Facets, mesh: Any, is_solid: bool) -> Facets:
    """The facets with what is free around each cell; with no `mesh` all that is empty is."""
    from scipy.ndimage import label

    grid = facets.grid
    shape = tuple(int(n) for n in grid.shape)
    held = np.diff(grid.first[:-1]).reshape(shape) > 0
    rows = grid.known.room
    with_cones(rows, facets.table[:, :3], grid.entries, grid.first)
    parts, count = label(~held)
    if mesh is None:
        with_blocks(rows, held)
    elif count:
        # The middle of one cell of each part says on which side it is.
        labels, first = np.unique(parts.ravel(), return_index=True)
        first, labels = first[labels > 0], labels[labels > 0]
        places = np.array(np.unravel_index(first, shape), np.float64)
        low, width = (np.array(row)[:, None] for row in (grid.low, grid.width))
        found = np.empty((4, len(labels)))
        nearest(facets, mesh, np.ascontiguousarray(low + (places + 0.5) * width), found)
        sides = np.full(count + 1, CLOSED, np.int8)
        sides[labels] = np.where(found[3] < 0.0, FREE, CLOSED)
        rows[:-1, KIND] = np.where(held, rows[:-1, KIND].reshape(shape), sides[parts]).ravel()
        with_blocks(rows, held)
    rows[-1, KIND] = FREE if is_solid else CLOSED
    if mesh is None:
        return facets
    return facets._replace(grid=grid._replace(known=grid.known._replace(boxes=mesh[2])))
