"""The particles or bodies of a run that pictures and recordings show."""

import math

import numpy as np
from numpy.typing import NDArray

from ..bodies.body import Body
from ..bodies.checked import Pairs
from ..particles import Particles
from ..state import Floats, State
from ..surfaces.rotation import normalized
from .colours import Colours, Scale, Values

# Triangles with normals that differ by less are in one face of a polyhedron, without a line between them.
_FLAT = 1e-6


class Drawn:
    """The shown particles or bodies, evenly chosen, and the lines and faces between their points.

    A body with faces is shown by its contact points, its faces and the edges between them, other bodies by their points
    and bonds.

    Attributes:
        noun: "particles" or "bodies"; count: their number; shown: the number of those that are shown.
        lines: (S, 2) and triangles: (T, 3), as indices of the shown points.
        radius: the radii of the shown balls [m], or None.
    """

    def __init__(self, points: int, body: Body | None, most: int, radius: Floats | None = None) -> None:
        """Choose at most `most` of `points` particles or points of bodies, or one body.

        `radius` has the radii of all balls.
        """
        self.noun = "particles" if body is None else "bodies"
        size = 1 if body is None else len(body)
        self.count = points // size
        self._body, self._faces = body, body is not None and len(body.faces) > 0
        one = size if body is None or not self._faces else len(body.contacts)
        self._every = slice(None, None, math.ceil(self.count / max(1, most // one)))
        self.shown = len(range(self.count)[self._every])
        self.radius = None if radius is None else radius[self._every]
        none = np.zeros((0, 3), np.int64)
        edges, faces = (none[:, :2], none) if body is None else (_lines(body), body.faces)
        self.lines, self.triangles = self._of_all(edges), self._of_all(faces)

    def noun_of(self, count: int, plane: str | None) -> str:
        """The noun for `count` of the particles or bodies: in a scene of two dimensions balls are discs."""
        noun = self.noun if self.radius is None else "balls" if plane is None else "discs"
        return noun if count != 1 else {"bodies": "body"}.get(noun, noun.removesuffix("s"))

    def points(self, rows: Floats) -> Floats:
        """The shown points, from positions or velocities (3, N) of all."""
        if self._body is None:
            return rows[:, self._every]
        some = rows.reshape(3, len(self._body), self.count)[:, :, self._every]
        if self._faces:
            some = np.einsum("kp,xpn->xkn", self._body.contacts, some)
        return some.reshape(3, -1)

    def coloured(self, frame: Particles | State, scale: Scale, values: Values) -> tuple[Floats, Colours, Colours]:
        """The points (3, N) of a frame, their colours, and the colours of lines that are not edges of faces."""
        position, velocity = self.points(frame.position), self.points(frame.velocity)
        lines = np.zeros(0, np.uint32)
        if len(self.lines) and not len(self.triangles):
            lines = scale.colours(values(self.middles(position), self.middles(velocity)))
        return position, scale.colours(values(position, velocity)), lines

    def ties(
        self, points: Floats, packed: Colours, tints: Colours
    ) -> tuple[tuple[Floats, Colours], tuple[Floats, Colours]]:
        """The lines (S, 2, 3) and the triangles (T, 3, 3) between points (N, 3), each with their colours."""
        return (points[self.lines], tints), (points[self.triangles], packed[self.triangles])

    def middles(self, rows: Floats) -> Floats:
        """The middles of the lines, from the shown points."""
        return np.asarray(0.5 * (rows[:, self.lines[:, 0]] + rows[:, self.lines[:, 1]]))

    def _of_all(self, groups: Pairs) -> NDArray[np.int64]:
        """Groups of points of all shown bodies, from those of one; point p of body i has the number p shown + i."""
        return (groups[:, None] * self.shown + np.arange(self.shown)[:, None]).reshape(-1, groups.shape[1])


def _lines(body: Body) -> Pairs:
    """The bonds of a body, or the edges of its faces, for a rigid body without those within a flat face."""
    if not len(body.faces):
        return np.unique(np.sort(body.bonds(), axis=1), axis=0)
    corners = (body.contacts @ body.points)[body.faces]
    normals = normalized(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), 1)
    beside: dict[tuple[int, ...], list[Floats]] = {}
    for face, normal in zip(body.faces.tolist(), normals, strict=True):
        for k in range(3):
            beside.setdefault(tuple(sorted((face[k - 1], face[k]))), []).append(normal)
    bends = body.strain is not None or len(body.springs) > 0
    kept = [edge for edge, sides in beside.items() if bends or len(sides) == 1 or np.ptp(sides, axis=0).max() > _FLAT]
    return np.array(kept, dtype=np.int64).reshape(-1, 2)
