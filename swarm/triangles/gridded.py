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

# The parts of the box in which a scene is drawn; it is two of them wider than the walls on each side.
_POINTS = 48
# For each of many balls the points along each side of its grid; for other bodies the number that is drawn
_COARSE, _MOST_BODIES = 10, 2_000
# For each of many other bodies, the points along each side of its grid
_BODY = 16
# The points on the grids of all balls that are cavities; a depth in another ball that counts as 0, relative to all
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
    """Return a mesh at the present place of its surface."""
    vertices, triangles, normals = mesh
    return pose.placed(vertices.T).T, triangles, pose.turned(normals.T).T


def given_box(box: Corners, pose: Pose) -> Corners:
    """Return a box around a box of the scene, in the frame in which a surface is given."""
    corners = pose.given(np.array(list(itertools.product(*zip(*box, strict=True)))).T)
    return corners.min(axis=1), corners.max(axis=1)


def _axes(box: Corners, count: int) -> list[Floats]:
    return [np.linspace(low, high, count) for low, high in zip(*box, strict=True)]


def _mesh(values: Floats, box: Corners) -> Triangles:
    """Return the level 0 of values at the points of a grid in the box."""
    if not values.min() < 0.0 < values.max():
        return NOTHING
    low, high = box
    spacing = tuple((high - low) / (len(values) - 1.0))
    vertices, triangles, normals, _values = marching_cubes(values, 0.0, spacing=spacing)
    return vertices + low, triangles.astype(np.int64), normals.astype(np.float64)


def foam(spheres: Spheres) -> tuple[Triangles, NDArray[np.int64]]:
    """Return the triangles of many balls that are cavities, where they are in no other ball."""
    (vertices, triangles, _normals), numbers = balls(spheres, max(_COARSE, int((_FOAM / len(spheres)) ** 0.5)))
    size = float(np.ptp(vertices, axis=0).max())

    def level(points: Floats) -> Floats:
        """Return how deep a point of a ball is in another ball, to first order."""
        return np.asarray(-spheres.phi(points.T) - _ROUND_OFF * size)

    # Points on a ball stay on it: between two of them no other points that matter are made.
    wall = SmoothSurface(lambda points: np.zeros(len(points)), lambda points: spheres.gradient(points.T).T)
    points, triangles, _rims, origins = cut(wall, vertices, triangles, level)
    # Where balls of coarse triangles meet, edges would be zigzags.
    return (points, triangles, -wall.normals(points)), numbers[origins]


def balls(spheres: Spheres, count: int = _COARSE) -> tuple[Triangles, NDArray[np.int64]]:
    """Return many balls, coarse, so that thousands can be drawn, and the number of the ball of each triangle."""
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
    """Return bodies of other kinds, each on a grid of its own, and the number of the body of each triangle."""
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
    """Return the box of some points, larger by a few cells of a grid with `count` points a side, within `box`."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 2.0 * _MARGIN * np.maximum(high - low, 0.1 * (high - low).max()) / (count - 1.0)
    return np.maximum(low - margin, box[0]), np.minimum(high + margin, box[1])


def box_around(scene: Scene, positions: Floats, time: float) -> Corners:
    """Return the box in which the walls of a scene are drawn at a time [s], around them and particles (3, N)."""
    low, high = (np.array(corner) for corner in scene.bounds(time))
    reach = _BEYOND * max(scene.extent(), float(np.abs(positions).max()))
    low, high = np.where(np.isfinite(low), low, -reach), np.where(np.isfinite(high), high, reach)
    margin = _MARGIN * (high - low) / (_POINTS - 1.0)
    return low - margin, high + margin
