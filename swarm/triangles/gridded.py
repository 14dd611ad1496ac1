"""Many bodies as triangles, each on a grid of its own, and the box in which a scene is drawn."""

import itertools

import numpy as np
from numpy.typing import NDArray
from skimage.measure import marching_cubes

from ..motion import Pose
from ..scene import Scene
from ..state import Floats
from ..surfaces import Spheres
from ..surfaces.surface import Surface
from .cut import SmoothSurface, cut

# The box in which a scene is drawn is so many of its parts wider than the walls, two on each side.
_POINTS = 48
# Of each of many balls, the points along each side of its grid; of bodies of another kind, how many are drawn.
_COARSE, _MOST_BODIES = 10, 2_000
# Of each of many bodies of another kind, the points along each side of its grid.
_BODY = 16
# Of balls that are cavities, so many more; and what is no depth in another one, as a part of the size of all.
_FOAM, _ROUND_OFF = 100_000, 1e-9
# Cells of the grid beyond the walls, so that these are closed.
_MARGIN = 2.0
# An open volume is drawn to this many times the distance of the surfaces and particles.
_BEYOND = 1.2

Corners = tuple[Floats, Floats]
# Vertices (V, 3) [m], triangles (T, 3) and normals (V, 3).
Triangles = tuple[Floats, NDArray[np.int64], Floats]
NOTHING: Triangles = np.empty((0, 3)), np.empty((0, 3), np.int64), np.empty((0, 3))


def placed(pose: Pose, mesh: Triangles) -> Triangles:
    """A mesh where its surface is now."""
    vertices, triangles, normals = mesh
    return pose.placed(vertices.T).T, triangles, pose.turned(normals.T).T


def given_box(box: Corners, pose: Pose) -> Corners:
    """A box around a box of the scene in the frame in which a surface is given."""
    corners = pose.given(np.array(list(itertools.product(*zip(*box, strict=True)))).T)
    return corners.min(axis=1), corners.max(axis=1)


def _axes(box: Corners, count: int) -> list[Floats]:
    return [np.linspace(low, high, count) for low, high in zip(*box, strict=True)]


def _mesh(values: Floats, box: Corners) -> Triangles:
    """The level 0 of values at the points of a grid in the box."""
    if not values.min() < 0.0 < values.max():
        return NOTHING
    low, high = box
    spacing = tuple((high - low) / (len(values) - 1.0))
    vertices, triangles, normals, _values = marching_cubes(values, 0.0, spacing=spacing)
    return vertices + low, triangles.astype(np.int64), normals.astype(np.float64)


def foam(spheres: Spheres) -> tuple[Triangles, NDArray[np.int64]]:
    """Many balls that are cavities, where these are in no other one."""
    (vertices, triangles, _normals), numbers = balls(spheres, max(_COARSE, int((_FOAM / len(spheres)) ** 0.5)))
    size = float(np.ptp(vertices, axis=0).max())

    def level(points: Floats) -> Floats:
        """How deep a point of a ball is in another one, to first order."""
        return np.asarray(-spheres.phi(points.T) - _ROUND_OFF * size)

    # Points on a ball stay on it: between two of them no others are made that matter.
    wall = SmoothSurface(lambda points: np.zeros(len(points)), lambda points: spheres.gradient(points.T).T)
    points, triangles, _rims, origins = cut(wall, vertices, triangles, level)
    # Where balls of coarse triangles meet, edges would be zigzags.
    return (points, triangles, -wall.normals(points)), numbers[origins]


def balls(spheres: Spheres, count: int = _COARSE) -> tuple[Triangles, NDArray[np.int64]]:
    """Many balls: coarse, so that thousands can be drawn; and the number of the ball of each triangle."""
    box = np.full(3, -1.3), np.full(3, 1.3)
    grid = np.array(np.meshgrid(*_axes(box, count), indexing="ij"))
    unit, triangles, _normals = _mesh(np.sqrt((grid**2).sum(axis=0)) - 1.0, box)
    normals = unit / np.sqrt((unit**2).sum(axis=1))[:, None]
    center, radius = spheres.centers[:, None, :], spheres.radii[:, None, None]
    vertices = (center + radius * normals).reshape(-1, 3)
    first = len(unit) * np.arange(len(spheres))[:, None, None]
    mesh = vertices, (triangles + first).reshape(-1, 3), np.tile(normals, (len(spheres), 1))
    return mesh, np.repeat(np.arange(len(spheres)), len(triangles))


def each_body(surface: Surface, box: Corners) -> tuple[Triangles, NDArray[np.int64]]:
    """Bodies of another kind, each on a grid of its own; and the number of the body of each triangle."""
    solids = surface.solids()
    meshes, numbers = [NOTHING], [np.empty(0, np.int64)]
    first = 0
    for k in range(0, len(solids), max(1, len(solids) // _MOST_BODIES)):
        solid = solids[k]
        low, high = (np.array(corner) for corner in solid.enclosing_box())
        low, high = own = around(np.stack([np.maximum(low, box[0]), np.minimum(high, box[1])]), box)
        axes = _axes(own, _BODY)
        gap = -solid.phi(np.array(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)).reshape(3 * (_BODY,))
        vertices, triangles, normals = _mesh(gap, own) if (low < high).all() else NOTHING
        if not len(vertices):
            continue
        meshes.append((vertices, triangles + first, normals))
        numbers.append(np.full(len(triangles), k))
        first += len(vertices)
    vertices, triangles, normals = (np.concatenate(parts) for parts in zip(*meshes, strict=True))
    return (vertices, triangles, normals), np.concatenate(numbers)


def around(points: Floats, box: Corners, count: int = _POINTS) -> Corners:
    """The box of some points, larger by a few cells of a grid of so many points along each side, in the box of all."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 2.0 * _MARGIN * np.maximum(high - low, 0.1 * (high - low).max()) / (count - 1.0)
    return np.maximum(low - margin, box[0]), np.minimum(high + margin, box[1])


def box_around(scene: Scene, positions: Floats, time: float) -> Corners:
    """The box in which the walls of a scene are drawn at a time [s], around them and particles (3, N)."""
    low, high = (np.array(corner) for corner in scene.bounds(time))
    reach = _BEYOND * max(scene.extent(), float(np.abs(positions).max()))
    low, high = np.where(np.isfinite(low), low, -reach), np.where(np.isfinite(high), high, reach)
    margin = _MARGIN * (high - low) / (_POINTS - 1.0)
    return low - margin, high + margin
