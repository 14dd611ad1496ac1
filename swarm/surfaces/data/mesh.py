"""A surface from a closed mesh of triangles: its signed distance, sampled on a grid."""

from pathlib import Path
from typing import Any

import numpy as np

from ...common import checks
from ...common.checks import path_of
from ...common.extras import needed_by
from ...errors import SceneError
from ...state import Floats
from ..facets.mesh_files import Soup
from ..facets.triangles import read_mesh
from .sampled import Sampled
from .thickness import require_resolved

# Samples beyond the mesh on each side, in cells: the surface must not reach the border of the grid.
_MARGIN = 3.0
# About the bytes of a sample and of all that is derived from it.
_SAMPLE = 100
# Samples that are computed together: for each call a tree of the triangles is built.
_TOGETHER = 4_000_000
# Points of the mesh at which phi is computed together.
_BATCH = 65_536
# Farther from the surface than this, in cells, phi is not the distance from it but from the mesh, also around a lost
# fold. Nearer, |phi| is less than the distance to points where phi changes its sign along an edge.
_FAR = 2.0


def from_mesh(
    path: str | Path,
    spacing: float,
    side: str = "inside",
    *,
    scale: float = 1.0,
    weld: float | None = None,
    **common: Any,
) -> Sampled:
    """A surface from a closed mesh of triangles in a file (.stl, .obj, .ply, .off, ...): its sampled signed distance.

    In a scene file: kind = "mesh" and file = "part.stl", relative to the scene file. Needs the extra `mesh`.

    Args:
        path: of the mesh. Its triangles must enclose a volume, without a hole or an edge of three triangles. A part
            within an odd number of others is a cavity, whichever way its triangles are turned.
        spacing: between samples [m], at most 0.8 of the thinnest wall or gap of the mesh. Edges of the mesh become
            round within about one, and folds such as an engraved letter or the tip of a blade where they are thinner.
        side: "inside" or "outside" of the mesh, the admissible part.
        scale: the length of a unit of the file in metres, 0.001 for millimetres.
        weld: corners of open edges this near [m] are one, so that seams close; 0: none are. None: 1e-5 of the diagonal
            of the mesh, or a quarter of the shortest open edge if that is less.
        common: rotation, restitution, and the other arguments that every surface takes.

    Returns:
        The surface. Its `mesh_error` is the largest distance [m] from it to the vertices, the middles of the edges and
        the middles of the triangles of the mesh. Its `mesh_weld` is how far a corner was moved at most to close seams
        [m], None where none was moved.

    Raises:
        SceneError: the file is missing or holds no mesh, the mesh is not closed or its parts intersect, an argument is
            out of its range, the spacing is too large for the walls and gaps of the mesh, or too small for the memory,
            or a package is missing.

    Cost: 100 000 triangles on 64^3 samples take some seconds; `python -m bench fields`.
    """
    spacing, scale = checks.length("spacing", spacing), checks.length("scale", scale)
    if weld is not None:
        weld = checks.magnitude("weld", weld)
    mesh, moved = read_mesh(path_of("path", path), scale, weld)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    counts = np.ceil((high - low) / spacing) + 2.0 * _MARGIN + 1.0
    size = float(counts.prod()) * _SAMPLE
    if size > checks.memory():
        raise SceneError(
            f"spacing must be so large that the samples fit in memory, got {spacing:g} m for a mesh of "
            f"{' x '.join(f'{x:.4g}' for x in high - low)} m: {' x '.join(f'{x:.0f}' for x in counts)} samples take "
            f"{checks.in_bytes(size)}; this machine has {checks.in_bytes(checks.memory())}"
        )
    require_resolved(Path(path), mesh, spacing)
    origin = 0.5 * (low + high) - 0.5 * spacing * (counts - 1.0)
    axes = [start + spacing * np.arange(int(count)) for start, count in zip(origin, counts, strict=True)]
    layers = max(1, int(_TOGETHER / (counts[1] * counts[2])))
    parts = [_distance([axes[0][i : i + layers], *axes[1:]], mesh) for i in range(0, len(axes[0]), layers)]
    values = np.concatenate(parts)
    made = Sampled(values, spacing, tuple(origin.tolist()), side, mesh_error=0.0)
    off, welded = _error(made, mesh), moved or None
    return Sampled(values, spacing, made.origin, side, mesh_error=off, mesh_weld=welded, _made=made._made, **common)


def _distance(axes: list[Floats], mesh: Soup) -> Floats:
    """Return the signed distance from the mesh on a grid."""
    with needed_by("from_mesh", "mesh"):
        import igl
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    # By the angle-weighted normal of the nearest element, which is right for every closed mesh; winding numbers summed
    # over a tree are wrong by 0.01 R next to a ring of 10^5 triangles.
    found = igl.signed_distance(points, mesh.vertices, mesh.triangles, igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL)[0]
    return np.asarray(found).reshape([len(axis) for axis in axes])


def _error(made: Sampled, mesh: Soup) -> float:
    """The distance of the surface from the vertices, the middles of the edges and of the triangles of the mesh."""
    from scipy.spatial import KDTree

    corners = mesh.vertices[mesh.triangles]
    sides = 0.5 * (corners + corners[:, [1, 2, 0]])
    points = np.concatenate([mesh.vertices, corners.mean(axis=1), sides.reshape(-1, 3)])
    parts = [np.abs(made.phi(points[i : i + _BATCH].T)) for i in range(0, len(points), _BATCH)]
    away = KDTree(_crossings(made)).query(points)[0]
    return float(np.where(away > _FAR * made.spacing[0], away, np.concatenate(parts)).max())


def _crossings(made: Sampled) -> Floats:
    """Return points (P, 3) where phi changes its sign between two samples, by linear interpolation."""
    found = []
    for axis in range(3):
        f = np.moveaxis(made.values, axis, -1)
        places = np.argwhere((f[..., :-1] > 0.0) != (f[..., 1:] > 0.0))
        one, other = f[tuple(places.T)], f[(*places[:, :2].T, places[:, 2] + 1)]
        points = places.astype(np.float64)
        points[:, 2] += one / (one - other)
        found.append(np.insert(points[:, :2], axis, points[:, 2], axis=1))
    return np.asarray(np.concatenate(found) * made.spacing + np.array(made.origin))
