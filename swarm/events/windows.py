"""The windows of a run of balls: spans of time, independent of frames, in which its walls have one description."""

from typing import Any

import numpy as np

from ..compiled_scene import CompiledScene
from ..state import Floats
from .colliding.clock import EPOCHS, LENGTH
from .colliding.window import END, MOMENT, PASSED, WINDOW
from .reacting.described import scenery_of


class Windows:
    """The windows of a scene with walls that move or become absent: epochs, or parts of epochs between two instants.

    Attributes:
        numbers: the array of the window, as kernels take it.
    """

    def __init__(self, compiled: CompiledScene, clock: Floats) -> None:
        self._compiled, self._clock = compiled, clock
        self._instants = compiled.scene.instants
        self.numbers = np.zeros(WINDOW)

    def is_at_epoch(self) -> bool:
        """Whether the window ends with the epoch."""
        return bool(self.numbers[END] == self._clock[LENGTH])

    def instant(self) -> float | None:
        """The instant at which the window ends [s], or None if it ends with the epoch."""
        passed = int(self.numbers[PASSED])
        return self._instants[passed - 1] if passed and self._instants[passed - 1] == self.numbers[MOMENT] else None

    def begin(self, now: float) -> None:
        """Begin a window at a time of the epoch [s]."""
        epochs, length = self._clock[EPOCHS], self._clock[LENGTH]
        end, moment, passed = length, (epochs + 1.0) * length, int(self.numbers[PASSED])
        if passed < len(self._instants) and self._instants[passed] <= moment:
            moment = self._instants[passed]
            # The instant may be after the end of the epoch by round-off.
            end = min(moment - epochs * length, length)
            passed += 1
        self.numbers[:] = end, end - now, passed, moment

    def walls(self) -> Any:
        """The walls as kernels take them in this window."""
        moment = float(self.numbers[MOMENT])
        compiled = self._compiled
        return scenery_of(compiled, moment).given if compiled.scene.reacts() else compiled.walls(moment)

    def openings(self) -> Any:
        """The openings in this window of the walls without a mass."""
        moment, compiled = float(self.numbers[MOMENT]), self._compiled
        return scenery_of(compiled, moment).openings if compiled.scene.reacts() else compiled.openings(moment)

    def reacting(self) -> Any:
        """The walls with a mass in this window."""
        return scenery_of(self._compiled, float(self.numbers[MOMENT])).reacting


def windows_of(compiled: CompiledScene, clock: Floats) -> Windows | None:
    """Return the windows of a scene, None if its walls never change."""
    scene = compiled.scene
    moves = scene.moves()
    if scene.reacts():
        moves = any(surface.motion is not None for surface in scene.surfaces if not surface.reacts())
    return Windows(compiled, clock) if moves or scene.has_doors() else None
