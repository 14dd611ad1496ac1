"""Walls that move, come and go: what is known of them until the end of a window, and when balls meet them until then.

A window is a span of time in which the walls have one description, whatever the frames are. From one to the next all
balls look for their next wall again.
"""

import math
from typing import Any

import numpy as np

from ...compiled_scene import CompiledScene
from ...kernel.arrays import index
from ...kernel.jit import outlined, select
from ...state import Floats
from ...surfaces.in_motion.posed import Posed
from ...surfaces.time_of_impact import flights, safe
from ...surfaces.time_of_impact.flights import Hit
from ...surfaces.time_of_impact.rising import flight_of
from ..reacting.described import scenery_of
from ..reacting.queue import SceneWalls
from .clock import EPOCHS, LENGTH
from .rows import FLOATS, LEAVES

# Of a window: its end and its length [s since the epoch], how many instants there were before its end, that end [s].
END, SPAN, PASSED, MOMENT, WINDOW = 0, 1, 2, 3, 4
# No wall is known yet; the ball is no more among the walls; from this number on downwards a wall holds it.
UNKNOWN, OUT, HELD = -2.0, -3.0, -4.0


def walls_at(box, i, now):
    """The walls that the centre of a ball meets, at a time."""
    walls = box.walls.grown(box.kinds.radius_of(i))
    return walls if box.window is None else walls.at(box.window[END] - now)


def next_hit(box, flock, i, now):
    """When a ball meets a wall next; of walls that move only before it leaves its cell and before the window ends."""
    r, v = flock.at(box.pull, i, now)
    if box.window is None:
        return flights.first_hit(box.walls.grown(box.kinds.radius_of(i)), box.pull, r, v)
    end = box.window[END]
    longest = min(flock.event[index(FLOATS * i + LEAVES)], end) - now
    hit = _hit_before(box.walls.grown(box.kinds.radius_of(i)), box.pull, r, v, end - now, longest)
    known = hit.time < longest
    return Hit(select(known, hit.time, math.inf), select(known, hit.wall, UNKNOWN))


@outlined
def _hit_before(walls, gravity, r, v, remaining, longest):
    """The first `Hit` of a flight before a time, with so much of the window left."""
    found = safe.closed_hit(walls.at(remaining), gravity, r, v)
    if walls.accelerate:
        soonest = min(found.time, longest)
        met = safe.march_moving(walls, flight_of(r, v, gravity, remaining), soonest)
        if met.wall >= 0.0 or met.time < soonest:
            return met
    return found


def middle_of(box):
    """The walls in the middle of a window, and half its length, or None if no wall moves."""
    if box.window is None:
        return box.walls, None
    half = 0.5 * box.window[SPAN]
    return box.walls.at(half), half


def swept(wall, r, half):
    """A bound of how much nearer to a place a wall may come within a time."""
    way: Any = 0.0
    if half is not None and isinstance(wall, Posed):
        drive = wall.drive
        way = (drive.fastest + drive.angular_speed() * (wall.arm_length(r) + drive.fastest * half)) * half
    return way


# --- From a description ----------------------------------------------------------------------------------


class Windows:
    """The windows of a scene with walls that move, come or go: each is an epoch, or a part of one between two instants.

    Attributes:
        numbers: of the window, as kernels take them.
    """

    def __init__(self, compiled: CompiledScene, clock: Floats) -> None:
        self._compiled, self._clock = compiled, clock
        self._instants = compiled.scene.instants
        self.numbers = np.zeros(WINDOW)

    def is_at_epoch(self) -> bool:
        """Whether the window ends with the epoch."""
        return bool(self.numbers[END] == self._clock[LENGTH])

    def instant(self) -> float | None:
        """The instant at which the window ends [s]; None if it ends with the epoch."""
        passed = int(self.numbers[PASSED])
        return self._instants[passed - 1] if passed and self._instants[passed - 1] == self.numbers[MOMENT] else None

    def begin(self, now: float) -> None:
        """The window that begins at a time of the epoch [s]."""
        epochs, length = self._clock[EPOCHS], self._clock[LENGTH]
        end, moment, passed = length, (epochs + 1.0) * length, int(self.numbers[PASSED])
        if passed < len(self._instants) and self._instants[passed] <= moment:
            moment = self._instants[passed]
            # By round-off none is without length.
            end = min(moment - epochs * length, length)
            passed += 1
        self.numbers[:] = end, end - now, passed, moment

    def scenery(self) -> SceneWalls:
        """The walls in this window, those that have no mass and those that have one."""
        return scenery_of(self._compiled, float(self.numbers[MOMENT]))


def windows_of(compiled: CompiledScene, clock: Floats) -> Windows | None:
    """The windows of a scene, None where its walls are always the same."""
    scene = compiled.scene
    moves = scene.moves()
    if scene.reacts():
        moves = any(surface.motion is not None for surface in scene.surfaces if not surface.reacts())
    return Windows(compiled, clock) if moves or scene.has_doors() else None
