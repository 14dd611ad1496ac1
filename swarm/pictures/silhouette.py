"""The silhouette of a wall: where it turns away from the eye."""

import numpy as np

from ..state import Floats
from ..triangles import curves
from ..triangles.shape import Shape
from .eye import Eye

# Triangles that are nearly parallel to the way to the eye turn away from it by round-off only.
_ROUND_OFF = 1e-9


def silhouette(shape: Shape, eye: Eye) -> list[Floats]:
    """The curves (k, 3) [m] at which normals turn away from the eye; of facets the sides at which one of two does."""
    if not len(shape.triangles):
        return []
    towards = shape.normals @ eye.near
    towards = np.where(np.abs(towards) < _ROUND_OFF, _ROUND_OFF, towards)
    return curves.zeros(shape.vertices, shape.triangles, towards) + _of_facets(shape, towards)


def _of_facets(shape: Shape, towards: Floats) -> list[Floats]:
    """The sides between a facet that faces the eye and one that does not, where these have corners of their own."""
    corners = towards[shape.triangles]
    if (np.ptp(corners, axis=1) > 1e-12).any():
        return []  # smooth walls: their creases are edges
    points, places = np.unique(shape.vertices, axis=0, return_inverse=True)
    triangles = places.reshape(-1)[shape.triangles]
    return curves.joined(points, curves.turning(points, triangles, corners[:, 0] > 0.0))
