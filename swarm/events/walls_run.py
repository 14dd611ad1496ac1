"""The run of particles and reacting walls, in which all depend on one another."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from .. import observables
from ..common.status import Status
from ..compiled_scene import CompiledScene
from ..kernel.gravity import potential
from ..kernel.heap import Heap
from ..kernel.random import Seeding
from ..kernel.vector import vec
from ..methods.base import Method
from ..observables import CHUNK
from ..particles import Particles
from ..run import failures
from ..run.base import Arrays, BaseRun
from ..run.doors import comers, require_free
from ..run.impacts import ThreadLog
from ..run.observed import Observed, observed_of
from ..run.preflight.counting import Counting
from ..run.present import Presence
from ..run.tally import Watched
from ..run.tiers import Tier
from ..state import State, none_left
from .reacting import queue as events
from .reacting.described import bring_walls, freedoms_of, scenery_of, walls_now
from .reacting.freedoms import TOO_LONG, TOO_SHORT
from .reacting.queue import CLOCK, NOW, TAKEN, Queue, ReactionRule, SceneWalls

# The entry TAKEN of a clock before leases are made; it falls by 1 for each particle that is predicted.
_ALL_AHEAD = -1.0


class ReactingRun(BaseRun):
    """The run of particles and reacting walls; the arrays of the particles become a part of its state."""

    _observed: Observed

    def __init__(
        self, compiled: CompiledScene, particles: Particles, method: Method, threads: int, block_size: int | None,
        compile: str, seeding: Seeding, watched: Watched,
    ) -> None:  # fmt: skip
        n, walls, gravity = len(particles), len(compiled.numbering.surfaces_of_rows), compiled.scene.pull()
        energy = 0.5 * (particles.velocity**2).sum(axis=0) + potential(gravity, vec(particles.position))
        self._seeding = seeding
        self._scenery = self._scenery_of(compiled, 0.0)
        births, every = particles.births, self._scenery.each_laws()
        heat = np.zeros((walls, n)) if any(laws.give_heat for laws in every) else None
        ends = any(laws.may_end for laws in every)
        self._counting = Counting(compiled.scene, watched.counters)
        starts = births.time.copy() if births is not None else np.zeros(n) if ends else None
        self.state = State(
            particles.position, particles.velocity, particles.mass, np.asarray(energy) + np.zeros(n), np.zeros(n),
            np.zeros(n, np.int64), np.zeros((2 * walls, n)), np.zeros(n), None, None, heat, starts=starts,
            crossed=self._counting.crossed(particles.position), **none_left(n, compiled.openings() is not None, ends),
        )  # fmt: skip
        self._present = Presence(births, self.state, CHUNK)
        tier = Tier(compile, (self._scenery, gravity), n)
        super().__init__(compiled, method, n, threads, tier, seeding, watched)
        state, number = self.state, np.arange(n)
        self._queue = Queue(
            state.position, state.velocity, state.mass, state.energy, state.impulse, state.dissipated, state.impacts,
            np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.full(n, events.NONE), np.zeros(n, bool),
            np.zeros(n, np.int64), np.zeros(n, bool), np.zeros(n, np.int64),
            Heap(np.zeros(n), number.copy(), number.copy()), state.heat, state.crossed, self._watchers(),
            absorbed_time=state.absorbed_time, absorbed_wall=state.absorbed_wall, escape_time=state.escape_time,
            starts=state.starts,
        )  # fmt: skip
        self._instants = self._scene.instants if self._scene.has_doors() else None
        self._freedoms = freedoms_of(compiled, particles.velocity)
        self._clock = np.zeros(CLOCK)
        self._show(0.0)
        self._choose_tier()

    def _scenery_of(self, compiled: CompiledScene, moment: float) -> SceneWalls:
        """The walls in the frame that ends at a moment [s], with random numbers if laws send particles off."""
        found = scenery_of(compiled, moment)
        return found._replace(seeding=self._seeding) if any(laws.send_off for laws in found.each_laws()) else found

    def _prepare(self, span: float, moment: float) -> None:
        self._scenery = self._scenery_of(self._compiled, moment)
        self._present.reach(moment)
        if not self._cut_short:
            self._clock[NOW] = 0.0
            self._clock[TAKEN] = _ALL_AHEAD

    def _switch(self, instant: float) -> None:
        if (came := comers(self._scene, instant)).any():
            scene = self._scene.placed(self._observed.position, self._observed.orientation)
            require_free(scene, self.state, came, self._deepest, instant, self._first)

    def _turn(self, span: float, moment: float, writing: float, latest: float) -> tuple[int, int]:
        rule, page = ReactionRule(span, self._watch.passes, moment), self._open_page(moment)
        status, particle = self._take(rule, page, latest)
        if status == Status.DONE:
            self._arrive(rule, page)
            bring_walls(self._scenery, self._freedoms, span)
            self._clock[events.BEFORE] += span
            self._clock[NOW] = 0.0
        page.close()
        return status, particle

    def _arrive(self, rule: ReactionRule, page: ThreadLog) -> None:
        """Bring all particles to the end of the frame, in one thread if there is a log."""
        last, first = len(self.state.mass), 0
        if page.log is None:
            self._in_parts(events.arrive, self._scenery, self._queue, rule, last=last)
            return
        while (first := self._call(events.arrive, self._scenery, self._watched(page), rule, first, last)) < last:
            page.turn()

    def _watched(self, page: ThreadLog | None = None) -> Queue:
        """The queue, with the watchers of the calling thread."""
        return self._queue._replace(watchers=self._watchers(page))

    def _take(self, rule: ReactionRule, page: ThreadLog, latest: float) -> tuple[int, int]:
        """Make predictions and take events until the end of the frame or a halt; return the status and the particle."""
        leases = 0
        while self._predict(rule, latest) and leases < self._watch.passes[0]:
            leases += 1
            status, particle = int(Status.LOG_FULL), 0
            while status == Status.LOG_FULL:
                status, particle = self._call(events.take, *self._moving(rule, page), latest=latest)
                if status == Status.LOG_FULL:
                    page.turn()
            if status != Status.LEASE_ENDED:
                return status, particle
            self._fit_leases()
            self._clock[TAKEN] = _ALL_AHEAD
        return int(Status.INTERRUPTED), 0

    def _predict(self, rule: ReactionRule, latest: float) -> bool:
        """Renew ended leases and find the next event of every particle; return False if a halt interrupts this.

        The clock keeps the number of particles done, so that the rest is done when the frame goes on.
        """
        n, size = len(self.state.mass), self._at_once()
        while self._clock[TAKEN] < 0.0:
            if self._watch.passes[0] == 0:
                return False
            first = int(_ALL_AHEAD - self._clock[TAKEN])
            last = min(first + size, n)
            if first == 0:
                self._tier.kernel(events.lease)(self._scenery, self._freedoms, self._clock)
            self._in_parts(events.predict, *self._moving(rule), first=first, last=last, latest=latest)
            self._clock[TAKEN] = 0.0 if last == n else _ALL_AHEAD - last
        return True

    def _fit_leases(self) -> None:
        """Widen leases that ended soon, and narrow leases that lasted long."""
        width: Any = self._freedoms.width
        a_particle = self._clock[TAKEN] / len(self.state.mass)
        if a_particle < TOO_SHORT:
            width *= 2.0
        elif a_particle > TOO_LONG:
            width *= 0.5

    def _moving(self, rule: ReactionRule, page: ThreadLog | None = None) -> tuple[Any, ...]:
        """Arguments of the kernels that move particles and walls."""
        return self._scenery, self._freedoms, self._watched(page), self._clock, rule

    def _failure(self, status: Status, item: int, span: float, moment: float) -> str:
        before, place = moment - span, self.state.position[:, item]
        message = failures.after(self._scene, before, item, status, place, before + self._queue.time[item])
        return f"{message}, between walls, some of which react"

    def calls(self) -> Iterator[tuple[Any, tuple[Any, ...]]]:
        rule, part = ReactionRule(0.0, self._watch.passes, 0.0), (0, 0)
        yield events.lease, (self._scenery, self._freedoms, self._clock)
        yield events.predict, (*self._moving(rule), *part)
        yield events.take, self._moving(rule)
        yield events.arrive, (self._scenery, self._queue, rule, *part)
        yield observables.observe, self._observing()

    def _summed(self) -> dict[str, Any]:
        return super()._summed() | self._present.observed()

    def _seen_state(self) -> State:
        return self._present.seen(self.state)

    def _show(self, moment: float) -> None:
        self._present.reach(moment)
        self._observed = observed_of(self._scene, self._freedoms, moment)
        self._walls = walls_now(self._compiled, self._scenery, self._freedoms)

    def _scale_of(self, seen: dict[str, Any]) -> float:
        return float(seen["kinetic_energy"] + self._observed.kinetic.sum() + abs(seen["potential_energy"]))

    def _share_done(self, span: float) -> float:
        return float(self._clock[NOW] / span)

    def _arrays(self) -> dict[str, Any]:
        queue: Any = self._queue
        return {
            **queue._replace(heap=None, mass=None, watchers=None, image=None)._asdict(),
            "walls": self._freedoms, "key": queue.heap.key, "clock": self._clock,
        }  # fmt: skip

    def restore(self, arrays: Arrays, cut_short: bool) -> None:
        self.observe()
        super().restore(arrays, cut_short)
