"""Walls that move or become absent: their description in a window, and the hits of balls on them in it.

A window is a span of time, independent of frames, in which the walls have one description. At the start of each window,
all balls look for their next wall again.
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

# Entries of a window: its end [s of the epoch] and its length [s], the number of instants up to its end, its end [s].
END, SPAN, PASSED, MOMENT, WINDOW = 0, 1, 2, 3, 4
# These stand in place of the number of a wall: no wall is known yet; the ball has left the walls; a wall holds the
# ball, from `HELD` on downwards.
UNKNOWN, OUT, HELD = -2.0, -3.0, -4.0


def walls_at(box, i, now):
    """The walls that the centre of a ball meets at a time."""
    walls = box.walls.grown(box.kinds.radius_of(i))
    return walls if box.window is None else walls.at(box.window[END] - now)


def next_hit(box, flock, i, now):
    """Return the next `Hit` of a ball on a wall; if walls move, only before the ends of its cell and of the window."""
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
    """Return the first `Hit` of a flight within `longest` [s], with `remaining` [s] of the window left."""
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
    """A bound of the way of a wall towards a place within a time `half` [s]."""
    way: Any = 0.0
    if half is not None and isinstance(wall, Posed):
        drive = wall.drive
        way = (drive.fastest + drive.angular_speed() * (wall.arm_length(r) + drive.fastest * half)) * half
    return way


# --- From a description ----------------------------------------------------------------------------------


class Windows:
    """The windows of a scene with walls that move or become absent: epochs, or parts of epochs between two instants.

    Attributes:
        numbers: the array of the window for kernels.
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
        """Begin a window at a time of the epoch [s]."""
        epochs, length = self._clock[EPOCHS], self._clock[LENGTH]
        end, moment, passed = length, (epochs + 1.0) * length, int(self.numbers[PASSED])
        if passed < len(self._instants) and self._instants[passed] <= moment:
            moment = self._instants[passed]
            # The instant may be after the end of the epoch by round-off.
            end = min(moment - epochs * length, length)
            passed += 1
        self.numbers[:] = end, end - now, passed, moment

    def scenery(self) -> SceneWalls:
        """Return the walls in this window, without and with a mass."""
        return scenery_of(self._compiled, float(self.numbers[MOMENT]))


def windows_of(compiled: CompiledScene, clock: Floats) -> Windows | None:
    """Return the windows of a scene, None if its walls never change."""
    scene = compiled.scene
    moves = scene.moves()
    if scene.reacts():
        moves = any(surface.motion is not None for surface in scene.surfaces if not surface.reacts())
    return Windows(compiled, clock) if moves or scene.has_doors() else None
