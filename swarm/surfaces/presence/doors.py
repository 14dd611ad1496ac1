"""Doors: openings that are open, and walls that are present, between given times only.

Kernels do not depend on these times. A run cuts its frames at the instants at which an opening opens or shuts, or a
wall appears or disappears. From one instant to the next a number says for each such wall whether it is present, and a
shut opening opens no wall.
"""

import bisect
import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any

from ...common import checks
from ...common.validated import Flag, Validated
from ...errors import SceneError
from ...kernel.jit import select
from ...kernel.record import Record
from ..contract import Smooth
from ..frames import Unturned
from ..time_of_impact.course import Quartic
from ..time_of_impact.rising import LevelStep

# The distance of a particle from an absent wall, and the level of such a wall.
_AWAY = -1e150

# Pairs (t0, t1) [s], from t0 on and before t1; None: always.
Spans = tuple[tuple[float, float], ...] | None


def checked_spans(name: str, value: Any) -> Spans:
    """Return the pairs of times of a door, checked; None stays None.

    >>> checked_spans("times", [(0.0, 2.5), (3, math.inf)])
    ((0.0, 2.5), (3.0, inf))
    """
    if value is None:
        return None
    expected = f"{name} must be a list of pairs (t0, t1) of seconds"
    given = checks.parts_of(value)
    if given is None:
        raise SceneError(f"{expected}, got {checks.shown(value)}")
    spans = [_pair(f"{name}[{k}]", pair) for k, pair in enumerate(given)]
    if not spans:
        raise SceneError(f"{expected}, got none; leave {name} out for what does not change")
    for k, ((_begin, end), (begin, _end)) in enumerate(itertools.pairwise(spans)):
        if not end <= begin:
            raise SceneError(
                f"{name} must ascend, each pair after the one before it, got {spans[k]} and then {spans[k + 1]}; "
                "put them in order, and make one of pairs that overlap"
            )
    return tuple(spans)


def _pair(name: str, value: Any) -> tuple[float, float]:
    try:
        begin, end = (float(part) for part in value)
    except Exception:  # no pair, no numbers, or an object array
        raise SceneError(f"{name} must be a pair (t0, t1) of seconds, got {checks.shown(value)}") from None
    if not 0.0 <= begin < end:  # also if one is NaN
        raise SceneError(
            f"{name} must be from a time of 0 s or more to a later one, got ({begin:g}, {end:g}); a run begins at 0 s, "
            "and the last time may be infinite"
        )
    return begin, end


@dataclass(frozen=True)
class Opening(Validated):
    """A volume in which a wall is absent between given times; `openings` of a surface hold them.

    Args:
        surface: the volume, a surface without openings, laws and motion.
        times: pairs (t0, t1) [s] that ascend, from 0 s on: it is open from t0 to t1. In the last pair t1 is
            infinite if it stays open. None: it is always open, as a surface given as an opening is.
        between: True: only walls between rooms of a `Union` are open in it, so that a door may reach the floor.

    Raises:
        SceneError: the times are no such pairs.

    >>> import swarm
    >>> valve = swarm.Opening(swarm.Sphere(0.1, center=(0.0, 0.0, 0.5)), times=[(1.0, 2.5)])
    >>> swarm.Sphere(0.5, openings=[valve]).openings[0].times
    ((1.0, 2.5),)
    """

    surface: Any
    times: Annotated[Spans, checked_spans] = None
    between: Flag = False


# --- At a time -------------------------------------------------------------------------------------------


def is_there(spans: Spans, time: float) -> bool:
    """Whether a time [s] is inside one of the spans."""
    if spans is None:
        return True
    k = bisect.bisect_right(spans, (time, math.inf)) - 1
    return k >= 0 and time < spans[k][1]


def was_there(spans: Spans, moment: float) -> bool:
    """Whether the frame, or its piece, that ends at a moment [s] is inside one of the spans; at 0 s the first one."""
    if spans is None or moment <= 0.0:
        return is_there(spans, 0.0)
    k = bisect.bisect_left(spans, (moment, -math.inf)) - 1
    return k >= 0 and moment <= spans[k][1]


def instants_of(every: Iterable[Spans]) -> tuple[float, ...]:
    """Return the instants after 0 s at which any of the spans begins or ends [s], in order."""
    found: set[float] = set()
    for spans in every:
        begins, ends = ({pair[k] for pair in spans or ()} for k in (0, 1))
        # Pairs that touch are one span.
        found |= begins ^ ends
    return tuple(sorted(time for time in found if 0.0 < time < math.inf))


# --- In kernels ------------------------------------------------------------------------------------------


class Present(Unturned):
    """A wall that is present (1) or absent (0). An absent wall is far from everywhere, and no flight meets it."""

    body: Any
    there: float

    # Lanes take its safe steps only if its level is known as a whole.
    in_steps, has_levels, kept, aims, fall_powers, looked_at = False, False, 0, False, 0, False

    def _if_there(self, value, other):
        return select(self.there > 0.0, value, other)

    def level_of(self, q):
        return self._if_there(self.body.level_of(q), _AWAY)

    def gap_of(self, q):
        return self._if_there(self.body.gap_of(q), _AWAY)

    def distance(self, r):
        return self._if_there(self.body.distance(r), _AWAY)

    def first_hit(self, r, v):
        return self._hit(*self.body.first_hit(r, v))

    def falling_hit(self, r, v, pull):
        return self._hit(*self.body.falling_hit(r, v, pull))

    def _hit(self, time, hits):
        return self._if_there(time, math.inf), hits | (not self.there > 0.0)

    def reach(self, lease):
        return self._if_there(self.body.reach(lease), math.inf)

    def straight_hit(self, end, r0, r1):
        return self._hit(*self.body.straight_hit(end.body, r0, r1))

    def safe_time(self, r, v, pull):
        return self._if_there(self.body.safe_time(r, v, pull), math.inf)

    def course(self, r, v, pull):
        level, there = self.body.course(r, v, pull), select(self.there > 0.0, 1.0, 0.0)
        b, a2, a3, a4 = (there * one for one in level[1:5])
        # An absent wall has the constant level -1.
        return Quartic(self._if_there(level.c, -1.0), b, a2, a3, a4, self._if_there(level.window, math.inf))

    steps = Smooth.steps

    def moving_step(self, seen, longest):
        step = self.body.moving_step(seen, longest)
        return LevelStep(
            self._if_there(step.level, -1.0), self._if_there(step.half, 0.0), self._if_there(step.time, longest)
        )


class Ajar(Present):
    """A wall over a step that is present (1), or absent (0) if it is open to the particle at the start of the step."""

    def displacement(self):
        return self.body.displacement()

    def swept(self, r0, r1):
        return self.body.swept(r0, r1)

    def place_scale(self, s):
        return self.body.place_scale(s)

    def framed(self, r, p):
        body, start, way = self.body.framed(r, p)
        return self._replace(body=body), start, way


class Faced(Record):
    """The walls of a scene as one step of a particle meets them."""

    walls: Any
    stand: tuple[Any, ...]  # for each wall 1, or 0 if it is open

    def length(self):
        """Return the number of rows, as for the walls."""
        return self.walls.length()

    def at(self, remaining):
        """Return the walls when `remaining` is left of the frame [s]."""
        return self._of(self.walls.at(remaining))

    def during(self, remaining, after):
        """Return the walls over a step; at its start `remaining` is left of the frame [s], at its end `after`."""
        return self._of(self.walls.during(remaining, after))

    def _of(self, now):
        return now._replace(each=tuple(Ajar(wall, one) for wall, one in zip(now.each, self.stand, strict=True)))


def walls_then(surface: Any, moment: float, largest: float | None = None) -> tuple[Any, ...]:
    """Return the walls of a surface for kernels in the frame, or the piece of one, that ends at a moment [s].

    They are for points, or for balls up to this radius [m].
    """
    walls: tuple[Any, ...] = surface.walls() if largest is None else surface.walls_of_balls(largest)
    if surface.present is None:
        return walls
    there = was_there(surface.present, moment)
    if hasattr(walls[0], "grid"):
        return (walls[0].in_cells() if there else walls[0].gone(),)
    return tuple(Present(wall, float(there)) for wall in walls)
