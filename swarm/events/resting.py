"""What is said where hard balls have come to rest."""

import logging
from typing import Any

from .colliding.clock import RESTED
from .colliding.resting import LEAST_RATE

_LOG = logging.getLogger("swarm")
# The contact duration that is proposed, as a part of the time of a fall: a heap of 200 balls then takes as many impacts
# in a second as it does while it falls.
_LONGER = 0.05


def warn_of_rest(box: Any, clock: Any) -> bool:
    """Warn where balls of a run rest: whether they do."""
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
