"""Balls that come to rest: their impacts are slow, and become ever more frequent.

Hard spheres that lie on one another or on a wall collide without end. The test counts impacts and no processor time, so
that its result is the same on any machine, with any number of threads, and in a resumed run.
"""

import logging
import math
from typing import Any

import numpy as np

from ...kernel.jit import outlined
from ...kernel.record import Record
from .clock import IMPACTS, RESTED, SINCE, SLOW, moment_of

_LOG = logging.getLogger("swarm")
# Balls rest if each has more than `LEAST_RATE` impacts in the time in which a ball falls its radius R, and the part
# `_SHARE` of them is slow, with at most the part `_PART` of the speed of this fall. Balls of this speed have as many
# impacts only where gaps are less than R/500, which they are in no gas.
LEAST_RATE, _SHARE, _PART = 100.0, 0.9, 0.1
# The impacts a ball between two tests, and the least number of all balls, as a ball that crosses a corner has several.
_COUNTED, _FEWEST = 32, 256
# The proposed contact duration, as a part of the time of a fall: a heap of 200 balls then has as many impacts a second
# as while it falls.
_LONGER = 0.05


class Repose(Record):
    """The test of whether balls rest. A fall is that of the smallest ball, from rest by its radius."""

    fall: float  # the time of a fall [s]
    slow2: float  # the square of the change of the normal velocity below which an impact is slow [m^2/s^2]
    counted: float  # the impacts between two tests
    within: float  # the time in which as many impacts happen where balls rest [s]

    @outlined
    def count(self, clock: Any, change2: Any, now: Any) -> None:
        """Count an impact with the squared change `change2` of the normal velocity, and test whether balls rest."""
        clock[IMPACTS] += 1.0
        clock[SLOW] += change2 < self.slow2
        if clock[IMPACTS] >= self.counted:
            moment = moment_of(clock, now)
            rests = (moment - clock[SINCE] < self.within) & (clock[SLOW] >= _SHARE * clock[IMPACTS])
            if rests and clock[RESTED] == 0.0:
                clock[RESTED] = moment
            clock[IMPACTS], clock[SLOW], clock[SINCE] = 0.0, 0.0, moment


def repose_of(pull: float, radius: Any) -> Repose:
    """Return the `Repose` of balls with these radii [m] that fall with the acceleration `pull` [m/s^2]."""
    n, counted = len(radius), float(max(_COUNTED * len(radius), _FEWEST))
    fall = math.sqrt(2.0 * float(np.min(radius)) / pull)
    return Repose(fall, (_PART * pull * fall) ** 2, counted, counted / (n * LEAST_RATE) * fall)


def warn_of_rest(box: Any, clock: Any) -> bool:
    """Warn if balls of a run rest; return whether they do."""
    if box.repose is None or clock[RESTED] == 0.0:
        return False
    fall = box.repose.fall
    longer = f"Pairs(contact_duration={_LONGER * fall:.1g})"
    if box.loss is None and not box.laws.send_off:
        remedy = f"start them elsewhere, or give pairs and walls a restitution below 1, with {longer} or with Penalty"
    elif box.loss is None:
        remedy = f"give these walls a restitution in place of a law or a temperature, with {longer} or with Penalty"
    else:
        remedy = (
            f"use Penalty (its contacts last), or a longer contact_duration, such as {longer}, "
            f"in place of {box.loss.duration:.2g} s"
        )
    _LOG.warning(
        "balls rest on one another or on walls, at %.6g s for the first time: hard spheres at rest collide without "
        "end, these more than %.2g times a second each; the run goes on, and takes the longer the more balls rest; %s",
        clock[RESTED], LEAST_RATE / fall, remedy,
    )  # fmt: skip
    return True
