"""The walls of a scene as soft balls meet them: those of fields by their faces."""

import numpy as np
from numpy.typing import NDArray

from ..scene import Scene
from ..surfaces.facets.mesh import Mesh
from ..surfaces.fields.many import Many
from ..surfaces.upright import upright
from ..surfaces.walls import Field, Walls


class Fields:
    """The fields of a scene for soft balls."""

    def __init__(self, scene: Scene, radius: NDArray[np.float64]) -> None:
        self._scene, self._largest = scene, float(radius.max())
        self._known = -1.0
        self._each: tuple[Field, ...] = ()
        # Of each field, of each member the number of its face, or of the body that it is.
        self.faces: tuple[NDArray[np.int32], ...] = ()
        if scene.order.fields:
            self._make(0.0)

    def _make(self, skin: float) -> None:
        """Take the fields for balls that are no farther than a skin [m] from the cell that repeats."""
        if self._scene.period is not None:
            self._scene = self._scene.of_balls(np.array([self._largest + 2.0 * skin]))
        made: list[Field] = []
        faces: list[NDArray[np.int32]] = []
        for i in self._scene.order.fields:
            surface = self._scene.pieces[i]
            assert isinstance(surface, (Many, Mesh))
            members, face = surface.faces_of_balls(self._largest + 2.0 * skin)
            across = self._scene.across()
            made.append(Field(members) if across is None else upright(Field(members), across))
            faces.append(face.astype(np.int32))
        self._known, self._each, self.faces = skin, tuple(made), tuple(faces)

    def reaches(self, skin: float) -> bool:
        """Whether a skin is too wide for the fields that are known; then these are made anew."""
        if not self.faces or self._scene.period is None or skin <= self._known:
            return False
        self._make(skin)
        return True

    def walls(self, moment: float, skin: float) -> Walls:
        """The walls in the frame, or its piece, that ends at a moment [s]."""
        if not self.faces:
            return self._scene.walls(moment)
        self.reaches(skin)
        walls = self._scene.walls(moment)
        return walls._replace(each=(*self._each, *walls.each[len(self._each) :]))
