"""Advance the particles in a phase, one after the other."""

import math

from ..common.status import Status
from ..kernel.jit import select
from .table import LANES
from .watching import log as impact_log


def one_by_one(phase, advance, scene, share):
    """Advance the particles in a phase that a thread draws; return (status, particle, drawn)."""
    place, _live, done = impact_log.gone_on(share.log)
    while True:
        place = share.following(phase, place)
        if place.is_end():
            return Status.DONE.value, 0, place.drawn
        if done // LANES >= share.halt[0]:
            return Status.INTERRUPTED.value, 0, place.drawn
        if impact_log.is_full(share.log):
            impact_log.keep_going(share.log, place, 0, done)
            return Status.LOG_FULL.value, 0, place.drawn
        if not advance(*scene, share, place.i):
            is_wrong = math.isnan(share.state.contacts.keep[place.i])
            return select(is_wrong, Status.SENT_WRONG.value, Status.STALLED.value), place.i, place.drawn
        place, done = place.after(), done + 1
