"""The walls of a scene as soft balls meet them: a field by its faces."""

import numpy as np
from numpy.typing import NDArray

from ..compiled_scene import CompiledScene
from ..surfaces.in_motion.moving import Moving
from ..surfaces.presence.doors import was_there
from ..surfaces.upright import upright
from ..surfaces.walls import Field, Walls


class Fields:
    """The fields of a scene for soft balls."""

    def __init__(self, compiled: CompiledScene, radius: NDArray[np.float64]) -> None:
        self._compiled, self._largest = compiled, float(radius.max())
        self._whole = compiled
        self._places: tuple[NDArray[np.int64], ...] | None = None
        self._known = -1.0
        self._each: tuple[Field, ...] = ()
        # For each field, the number of the face, or of the body, to which each of its members belongs.
        self.faces: tuple[NDArray[np.int32], ...] = ()
        if compiled.order.fields:
            self._make(0.0)

    def _make(self, skin: float) -> None:
        """Make the fields for balls that are no farther than a skin [m] from the periodic cell."""
        scene = self._compiled.scene
        if scene.period is not None:
            self._compiled = self._compiled.of_balls(self._largest + 2.0 * skin)
        made: list[Field] = []
        faces: list[NDArray[np.int32]] = []
        for i in self._compiled.order.fields:
            surface = self._compiled.pieces.each[i]
            members, face = surface.faces_of_balls(self._largest + 2.0 * skin)
            made.append(upright(Field(members if surface.present is None else members.in_cells()), scene.across()))
            faces.append(face.astype(np.int32))
        self._places = None
        self._known, self._each, self.faces = skin, tuple(made), tuple(faces)

    def places(self) -> tuple[NDArray[np.int64], ...]:
        """For each wall, the numbers of its members among the walls of the scene."""
        if self._places is None:
            self._places = self._found_places()
        return self._places

    def _found_places(self) -> tuple[NDArray[np.int64], ...]:
        whole, found, first = self._whole, [], 0
        members, rows = whole.numbering.members[1], len(whole.numbering.surfaces_of_rows)
        for i, face in zip(whole.order.fields, self.faces, strict=True):
            count, numbers = whole.pieces.each[i].wall_count(True), self._compiled.pieces.each[i].numbers()
            # Images of a member have the number of the member.
            known, own = members[first : first + count], np.repeat(numbers, len(face) // len(numbers))
            order = np.argsort(known, kind="stable")
            found.append(np.asarray(first + order[np.searchsorted(known[order], own)], np.int64))
            first += count
        return (*found, *(np.array([first + k], np.int64) for k in range(rows - len(found))))

    def any_moves(self) -> bool:
        """Whether any of the fields moves."""
        pieces = self._compiled.pieces.each
        return any(pieces[i].motion is not None for i in self._compiled.order.fields)

    def reaches(self, skin: float) -> bool:
        """Make the fields anew if a skin [m] is too wide for them; return whether it is."""
        if not self.faces or self._compiled.scene.period is None or skin <= self._known:
            return False
        self._make(skin)
        return True

    def walls(self, moment: float, skin: float) -> Walls:
        """The walls in the frame, or the piece of a frame, that ends at a moment [s]."""
        if not self.faces:
            return self._compiled.walls(moment)
        self.reaches(skin)
        walls = self._compiled.walls(moment)
        pieces = [self._compiled.pieces.each[i] for i in self._compiled.order.fields]
        there = [was_there(piece.present, moment) for piece in pieces]
        each = [
            one if is_there else one._replace(members=one.members.gone())
            for one, is_there in zip(self._each, there, strict=True)
        ]
        each = [
            one._replace(members=of.members._replace(body=one.members)) if isinstance(of.members, Moving) else one
            for one, of in zip(each, walls.each, strict=False)
        ]
        return walls._replace(each=(*each, *walls.each[len(each) :]))
