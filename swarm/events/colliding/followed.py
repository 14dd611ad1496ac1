"""Counters of balls. They read each flight at its end, at a face of the periodic cell, and at the end of a frame."""

from ...kernel.arrays import index
from ...kernel.jit import outlined
from ...kernel.vector import ZERO
from ...lanes.watching.crossings import Flown, ParticleMoment, come_into_cell
from ...lanes.watching.watchers import Followed
from .clock import moment_of


def follow(box, flock, books, clock, i, now):
    """Count the crossings of the flight of a ball until now, from where it was counted last."""
    if box.watchers.counters is not None and not flock.is_held(i, now):
        _tell(box, flock, books, clock, i, now)


@outlined
def _tell(box, flock, books, clock, i, now):
    since = max(flock.followed[index(i)], flock.time(i))
    (r, v), (end, _w) = flock.at(box.pull, i, since), flock.at(box.pull, i, now)
    flock.followed[index(i)] = now
    box.watchers.flown(box.pull, books, i, Flown(r, v, now - since, _left(box, clock, since), end, ZERO))


def _left(box, clock, now):
    """The rest of the frame [s], for the log."""
    return 0.0 if box.watchers.log is None else box.watchers.log.end - moment_of(clock, now)


@outlined
def come_over(box, flock, books, clock, ball):
    """Count a ball that has crossed a face of the periodic cell; `ball` is its number, time, place and velocity."""
    i, now, r, v = ball
    settle(box, books, clock, i, now, r, v)
    r, v = flock.at(box.pull, i, now)
    for c, one in enumerate(box.watchers.counters.each):
        come_into_cell(one, c, books, i, r, v)


def settle(box, books, clock, i, now, r, v):
    """Count a ball that is at a counter and goes on through it, as its flight is not looked at again."""
    if box.watchers.counters is not None:
        there = ParticleMoment(r, v, _left(box, clock, now))
        box.watchers.counters.settle(Followed(books, box.watchers.log), i, there)
