"""The part of a frame that one thread advances: the particles that it draws, and the arrays that it writes."""

from typing import Any, NamedTuple

import numpy as np

from ..kernel.arrays import next_of
from ..kernel.jit import Array, select
from ..kernel.random import Seeding
from ..kernel.record import Record
from .watching.watchers import Watchers


class Draws(NamedTuple):
    """The source of the particles of a thread. Draw k has the particles from k size to (k + 1) size, for one thread.

    A thread draws when a lane is free, so its lanes are full until no particles are left. (Rejected: blocks of a fixed
    size, each done before the next. They cost 14 % with 512 particles and 3 % with 4096, and leave a thread idle while
    another one does the last.)
    """

    ticket: Array  # (1,) the number of entries of `order` that all threads have drawn
    order: Array  # int64, the numbers of the draws
    size: int
    mine: Array  # int64, the draws of this thread, in order

    def again(self, order):
        """The draws of this `order`, for one thread."""
        return self._replace(ticket=np.zeros(1, np.int64), order=order)


class ThreadPlace(Record):
    """The position of a thread among the particles that it draws."""

    i: int  # the next particle
    stop: int  # the end of its draw
    drawn: int  # the number of draws so far

    def is_end(self):
        """Whether no particle is left."""
        return self.i == self.stop

    def after(self):
        """The place of the particle after this one."""
        return ThreadPlace(self.i + 1, self.stop, self.drawn)


class Share(NamedTuple):
    """The part of a frame that one thread advances."""

    state: Any  # `state.State`
    phase: Array  # (N,) int8, whether each particle flies, slides on one wall or on two, or has arrived
    pending: Array  # (PHASES,) int64, the number of particles left to other kernels, by their phase
    halted: Any  # `lane_arrays.Halted`
    draws: Draws
    halt: Array  # (1,) int64, passes after which to return
    span: float  # in the method's unit
    seeding: Seeding
    moment: float  # the end of the frame [s]
    watchers: Watchers = Watchers()

    @property
    def log(self) -> Any:
        """The log of impacts, or None."""
        return self.watchers.log

    @property
    def counts(self) -> Any:
        """The counts of impacts, or None."""
        return self.watchers.counts

    @property
    def counters(self) -> Any:
        """The counters, or None."""
        return self.watchers.counters

    def note_stay(self, i, time):
        """Count a time [s] for which walls hold particle i, for the first of them, or for the wall that it met."""
        if self.counts is not None:
            contacts = self.state.contacts
            first = contacts.walls[0, i]
            self.counts.stay(select(first >= 0.0, first, contacts.met[i]), time)

    def note_hops(self, wall, time):
        """Subtract a time [s] of hops from the time for which a wall holds a particle."""
        if self.counts is not None:
            self.counts.stay(max(wall, 0.0), -time)

    def hand_over(self, i, phase):
        """Leave particle i to the kernel of a phase."""
        self.phase[i] = phase
        self.pending[phase] += 1

    def following(self, phase, place):
        """Return the `ThreadPlace` of the first particle in a phase from a place on; draw if necessary.

        Count the particles in other phases, which other kernels advance.
        """
        draws, phases, pending = self.draws, self.phase, self.pending
        i, stop, drawn = place
        while True:
            while i < stop and phases[i] != phase:
                pending[phases[i]] += 1
                i += 1
            if i < stop:
                return ThreadPlace(i, stop, drawn)
            k = next_of(draws.ticket)
            if k >= draws.order.size:
                return ThreadPlace(i, i, drawn)
            k = draws.order[k]
            i = k * draws.size
            stop = min(i + draws.size, phases.size)
            draws.mine[drawn] = k
            drawn += 1


def take(draws: Draws, some: int) -> Array:
    """Return the next `some` draws, for the calling thread alone."""
    first = min(some * next_of(draws.ticket), draws.order.size)
    return draws.order[first : first + some]
