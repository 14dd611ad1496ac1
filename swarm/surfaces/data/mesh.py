"""A surface from a closed mesh of triangles: its signed distance, sampled on a grid."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import checks
from ...errors import SceneError
from ...extras import needed_by
from .sampled import Sampled

Floats = NDArray[np.float64]

# Samples beyond the mesh on each side, in cells: the surface must not reach the border of the grid.
_MARGIN = 3.0
# Bytes of a sample and of what is made of it, about.
_SAMPLE = 100
# Samples that are found together: for each call a tree of the triangles is made.
_TOGETHER = 4_000_000
# Points of the mesh at which phi is found together.
_BATCH = 65_536


def from_mesh(path: str | Path, spacing: float, side: str = "inside", *, scale: float = 1.0, **common: Any) -> Sampled:
    """A surface from a closed mesh of triangles in a file (.stl, .obj, .ply, .off, ...): its sampled signed distance.

    In a scene file: kind = "mesh" and file = "part.stl", relative to the scene file. Needs the extra `mesh`.

    Args:
        path: of the mesh. Its triangles must enclose a volume, without a hole or an edge of three triangles.
        spacing: between samples [m]. Edges of the mesh become round within about one, and a wall or a gap thinner than
            about two is not resolved.
        side: "inside" or "outside" of the mesh, the admissible part.
        scale: what a unit of the file is in metres, 0.001 for millimetres.
        common: rotation, restitution, and what else every surface takes.

    Returns:
        The surface; its `mesh_error` is the largest distance [m] from it to the vertices, the middles of the edges and
        of the triangles of the mesh.

    Raises:
        SceneError: the file is missing or holds no mesh, the mesh is not closed, an argument is out of its range, the
            spacing is too large for the mesh, or too small for the memory, or a package is missing.

    Cost: 100 000 triangles on 64^3 samples take some seconds; `python -m bench fields`.
    """
    spacing, scale = checks.length("spacing", spacing), checks.length("scale", scale)
    vertices, triangles = _read(Path(path))
    vertices = scale * vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    counts = np.ceil((high - low) / spacing) + 2.0 * _MARGIN + 1.0
    size = float(counts.prod()) * _SAMPLE
    if size > checks.memory():
        raise SceneError(
            f"spacing must be so large that the samples fit in memory, got {spacing:g} m for a mesh of "
            f"{' x '.join(f'{x:.4g}' for x in high - low)} m: {' x '.join(f'{x:.0f}' for x in counts)} samples take "
            f"{checks.in_bytes(size)}; this machine has {checks.in_bytes(checks.memory())}"
        )
    origin = 0.5 * (low + high) - 0.5 * spacing * (counts - 1.0)
    axes = [start + spacing * np.arange(int(count)) for start, count in zip(origin, counts, strict=True)]
    layers = max(1, int(_TOGETHER / (counts[1] * counts[2])))
    parts = [
        _distance([axes[0][i : i + layers], *axes[1:]], vertices, triangles) for i in range(0, len(axes[0]), layers)
    ]
    values = np.concatenate(parts)
    try:
        made = Sampled(values, spacing, tuple(origin.tolist()), side)
    except SceneError as error:
        raise SceneError(f"spacing must resolve the mesh {path}, got {spacing:g} m: {error}") from None
    corners = vertices[triangles]
    sides = 0.5 * (corners + corners[:, [1, 2, 0]])
    points = np.concatenate([vertices, corners.mean(axis=1), sides.reshape(-1, 3)])
    off = max(np.abs(made.phi(points[i : i + _BATCH].T)).max() for i in range(0, len(points), _BATCH))
    return Sampled(values, spacing, made.origin, side, mesh_error=float(off), _made=made._made, **common)


def _read(path: Path) -> tuple[Floats, NDArray[np.int64]]:
    """The vertices (V, 3) and triangles (T, 3) of a mesh, turned so that they are seen from outside."""
    with needed_by("from_mesh", "mesh"):
        import trimesh
    try:
        mesh = trimesh.load_mesh(str(path))
        vertices = np.ascontiguousarray(mesh.vertices, np.float64)
        triangles = np.ascontiguousarray(mesh.faces, np.int64)
    except Exception as error:  # what readers of a dozen formats raise
        raise SceneError(f"cannot read the mesh {path}: {error or type(error).__name__}") from error
    if not len(triangles) or not np.isfinite(vertices).all():
        raise SceneError(f"the mesh {path} must hold triangles with finite corners, got {len(triangles)} triangles")
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    counts = np.unique(edges, axis=0, return_counts=True)[1]
    if (counts != 2).any():
        raise SceneError(
            f"the mesh {path} must be closed (watertight), with two triangles at each edge, got "
            f"{np.count_nonzero(counts == 1)} edges of one triangle and {np.count_nonzero(counts > 2)} of more than "
            "two; close its holes, for example with trimesh.repair or MeshLab"
        )
    if not mesh.is_winding_consistent:
        raise SceneError(
            f"the mesh {path} must have all triangles turned the same way, got some that are not; turn them, for "
            "example with trimesh.repair.fix_winding"
        )
    return vertices, triangles if mesh.volume > 0.0 else np.ascontiguousarray(triangles[:, ::-1])


def _distance(axes: list[Floats], vertices: Floats, triangles: NDArray[np.int64]) -> Floats:
    """The signed distance from the mesh on a grid."""
    with needed_by("from_mesh", "mesh"):
        import igl
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    # By the angle-weighted normal of what is nearest, which is right for every closed mesh; winding numbers summed
    # over a tree are wrong by 0.01 R next to a ring of 10^5 triangles.
    found = igl.signed_distance(points, vertices, triangles, igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL)[0]
    return np.asarray(found).reshape([len(axis) for axis in axes])
