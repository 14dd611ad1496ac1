"""The run of a scene with walls that become absent, or openings that shut: frames are cut at these instants."""

import bisect
import itertools
import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import observables
from ..contact.events import ARRIVED, CAREFUL, EDGE, FLYING, HELD
from ..errors import RunError
from ..kernel.vector import column
from ..lanes.escape import log_cut_contact
from ..scene import Scene
from ..state import Contacts, State
from ..surfaces.surface import Surface
from .base import OUTSIDE
from .engine import Run
from .failures import sentence_of_coming


class DoorRun(Run):
    """The run of particles by pieces of each frame: between two instants no wall becomes absent or present."""

    # The energy that contacts stored before the current instant, per mass [J/kg].
    _stored_before: NDArray[np.float64] | None = None
    # Whether each row has a wall that becomes absent, or opens, at this instant; and the walls before.
    _left: NDArray[np.bool_]
    _walls_before: Any

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self._instants = self._scene.instants

    def _prepare(self, span: float, moment: float) -> None:
        super()._prepare(span, moment)
        if self._stored_before is not None:
            self._lose(self._stored_before - self._stored(self._numbers.seconds(span)))
            self._stored_before = None

    def _reach(self, moment: float) -> None:
        super()._reach(moment)
        if not self._scene.moves():
            self._walls, self._faces = self._compiled.walls(moment), self._scene.open_faces(moment)
        self.state = self.state._replace(openings=self._compiled.openings(moment))

    # --- Energy of soft contacts -------------------------------------------------------------------------

    def _stored(self, remaining: float) -> NDArray[np.float64]:
        """Return the stored energy of each particle with `remaining` [s] of a piece left, per mass [J/kg]."""
        found = np.zeros(self.state.mass.size)
        self._tier.kernel(observables.store)(self._law, self._walls, remaining, self.state, found)
        return found

    def calls(self) -> Iterator[tuple[Any, tuple[Any, ...]]]:
        yield from super().calls()
        if self._law is not None:
            yield observables.store, (self._law, self._walls, 0.0, self.state, np.zeros(self.state.mass.size))

    def _lose(self, lost: NDArray[np.float64]) -> None:
        """Take energies `lost` from the particles, per mass [J/kg], which were stored with walls that became absent."""
        self.state.energy[:] -= lost
        self._cut_contacts(lost > 0.0)
        self.state.dissipated[:] += lost * self.state.mass

    def _cut_contacts(self, loses: NDArray[np.bool_]) -> None:
        """End the contacts of particles with walls that became absent, or opened: each has a row, and no law acts."""
        state, pressed, rubbed = self.state, self.state.pressed, self.state.rubbed
        if pressed is None or rubbed is None:
            return
        page, walls = self._open_page(self._moment), self._walls_before.at(0.0)
        cut = self._left[:, None] & loses & (pressed + rubbed > 0.0)
        for row, i in np.argwhere(cut) if page.log is not None else ():
            if page.log.filled[0] == page.log.time.size:
                page.turn()
            at = i, column(state.position, 0, i), column(state.velocity, 0, i), page.log.begin
            log_cut_contact(page.log, self._numbers.laws_at_ends, walls, state, row, at)
        page.close()
        pressed[cut] = rubbed[cut] = 0.0

    # --- At an instant -----------------------------------------------------------------------------------

    def _switch(self, instant: float) -> None:
        instants = self._scene.instants
        k = bisect.bisect_left(instants, instant)
        if k == len(instants) or instants[k] != instant:
            return
        if (came := comers(self._scene, instant)).any():
            # Unborn particles do not count: they are born where no wall is at that time.
            self._present.reach(instant)
            state, deepest = self.state, OUTSIDE * self._scene.finite_size()
            require_free(self._scene, state, came, deepest, instant, self._first, self._present.count)
        last, pieces = _before(self._scene, instant), self._compiled.pieces
        gone = np.array([one.is_there(last) and not one.is_there(instant) for one in pieces.each])
        if self._law is not None:
            self._stored_before, self._walls_before = self._stored(0.0), self._walls
            volumes = map(itertools.chain, pieces.volumes, pieces.doorways)
            opens = [_some_come(some, last, instant) for some in volumes]
            self._left = (gone | opens)[self._compiled.numbering.pieces_of_rows]
        contacts = self.state.contacts
        if contacts is None or not self._kinds:
            return
        if gone.any():
            self._let_go(contacts, gone)
        if _some_come(pieces.open_volumes(), last, instant):
            _wake(contacts, contacts.phase == ARRIVED)

    def _let_go(self, contacts: Contacts, gone: NDArray[np.bool_]) -> None:
        """Let particles that slide or rest on walls of the pieces in `gone` fly, as these walls are absent."""
        # The number -1 stands for no wall.
        numbering = self._compiled.numbering
        walls = np.append(gone[numbering.pieces_of_walls], False)
        held = walls[contacts.walls.astype(np.int64)].any(axis=0)
        rests, careful = contacts.phase == ARRIVED, contacts.phase == CAREFUL
        held &= np.isin(contacts.phase, (HELD, EDGE, ARRIVED))
        held |= careful & walls[contacts.met.astype(np.int64)]
        held |= rests & (contacts.load[gone[numbering.pieces_of_rows]] != 0.0).any(axis=0)
        contacts.phase[held] = FLYING
        contacts.walls[:, held] = -1.0
        contacts.step[held] = contacts.keep[held] = 0.0
        contacts.load[:, held] = 0.0


def _some_come(surfaces: Iterable[Surface], last: float, instant: float) -> bool:
    """Whether a surface that was absent at the time `last` [s] is present at an instant [s]."""
    return any(one.is_there(instant) and not one.is_there(last) for one in surfaces)


def comers(scene: Scene, instant: float) -> NDArray[np.bool_]:
    """Return whether each surface has walls that become present at an instant [s], (surfaces,)."""
    last, came = _before(scene, instant), np.zeros(len(scene.surfaces), np.bool_)
    for i, piece in scene.pieces.owned():
        came[i] |= piece.is_there(instant) and not piece.is_there(last)
    return came


def require_free(
    scene: Scene, state: State, came: NDArray[np.bool_], deepest: float, instant: float, first: int = 0,
    count: int | None = None,
) -> None:  # fmt: skip
    """Raise a `RunError` if one of the first `count` particles is inside a surface that comes at an instant [s]."""
    distances = scene.distances_outside(state.position, instant, state.radius)
    distances[~came] = -math.inf
    distances[:, state.gone()] = -math.inf
    distances[:, state.mass.size if count is None else count :] = -math.inf
    # A place at which phi is NaN counts as inside.
    inside = ~(distances <= deepest)
    if inside.any():
        particle = int(np.argmax(inside.any(axis=0)))
        wall = int(np.argmax(inside[:, particle]))
        depth, found = float(distances[wall, particle]), (wall, particle)
        raise RunError(sentence_of_coming(scene, state, found, depth, instant, first))


def _before(scene: Scene, instant: float) -> float:
    """Return a time before an instant and after the instant before it [s]."""
    k = bisect.bisect_left(scene.instants, instant)
    return 0.5 * ((scene.instants[k - 1] if k > 0 else 0.0) + instant)


def _wake(contacts: Contacts, rests: NDArray[np.bool_]) -> None:
    """Let particles at rest be looked at again, as an opening may be where they are."""
    first, second = contacts.walls[:, rests] >= 0.0
    contacts.load[:, rests] = 0.0
    contacts.phase[rests] = np.where(second, EDGE, np.where(first, HELD, CAREFUL))
