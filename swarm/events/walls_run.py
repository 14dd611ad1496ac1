"""The run of particles and walls that react: all depend on all others."""

import itertools
import math
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from .. import observables
from ..common.status import Status
from ..errors import RunError
from ..kernel.gravity import potential
from ..kernel.heap import Heap
from ..kernel.vector import vec
from ..methods.base import Method
from ..particles import Particles
from ..run import failures
from ..run.base import Arrays, BaseRun
from ..run.observed import with_walls
from ..run.tally import Tally
from ..run.tiers import Tier
from ..scene import Scene
from ..state import State
from .reacting import queue as events
from .reacting.described import freedoms_of, observed, scenery_of, walls_now
from .reacting.queue import CLOCK, NOW, TAKEN, Queue, ReactionRule

# Fewer particles than this are predicted sooner than another thread is awake.
_FEW = 4096
# So many are predicted at a time, compiled and in plain Python: in some 0.1 s, from one look at the halt to the next.
_AT_ONCE, _AT_ONCE_PLAIN = 1 << 16, 64
# The first leases have this part of the particles' speed as their width. They are too narrow where they end before so
# many events a particle, and too wide where they last longer than that many.
_WIDTH, _TOO_SHORT, _TOO_LONG = 0.1, 4.0, 32.0
# Of a clock, how many events were taken where no lease is made yet: so much less for each particle that is predicted.
_ALL_AHEAD = -1.0


class ReactingRun(BaseRun):
    """The run of particles and walls that react; the arrays of the particles become a part of its state."""

    def __init__(
        self, scene: Scene, particles: Particles, method: Method, threads: int, block_size: int | None,
        compile: str = "always", tally: Tally | None = None,
    ) -> None:  # fmt: skip
        n, walls, gravity = len(particles), len(scene.owners()), scene.pull()
        energy = 0.5 * (particles.velocity**2).sum(axis=0) + potential(gravity, vec(particles.position))
        self.state = State(
            particles.position, particles.velocity, particles.mass, np.asarray(energy) + np.zeros(n), np.zeros(n),
            np.zeros(n, np.int64), np.zeros((2 * walls, n)), np.zeros(n), None, None,
        )  # fmt: skip
        self._scenery, self._gravity = scenery_of(scene, 0.0), gravity
        pool, tier = ThreadPoolExecutor(threads, "swarm"), Tier(compile, (self._scenery, gravity), n)
        super().__init__(scene, method, n, pool, tier)
        state, number = self.state, np.arange(n)
        self._queue = Queue(
            state.position, state.velocity, state.mass, state.energy, state.impulse, state.dissipated, state.impacts,
            np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.full(n, events.NONE), np.zeros(n, bool),
            np.zeros(n, np.int64), np.zeros(n, bool), np.zeros(n, np.int64),
            Heap(np.zeros(n), number.copy(), number.copy()), None if tally is None else tally.of_thread(0).impacts,
        )  # fmt: skip
        self._tally = tally
        speed = math.sqrt(float((particles.velocity**2).sum(axis=0).mean()))
        self._freedoms = freedoms_of(scene, _WIDTH * speed or _WIDTH)
        self._clock = np.zeros(CLOCK)
        self._walls = observed(scene, self._freedoms, 0.0)
        self._partial = np.zeros((math.ceil(n / observables.CHUNK), observables.ROWS))
        self._threads = threads if n >= _FEW else 1
        self._start = math.nan
        self._choose_tier()

    def advance(self, span: float, moment: float, writing: float = 0.0, latest: float = math.inf) -> bool:
        self._scenery = scenery_of(self._scene, moment)
        rule = ReactionRule(span, self._watch.passes)
        latest = self._limit(latest)
        began = time.perf_counter()
        if not self._cut_short:
            self._clock[NOW] = 0.0
            self._clock[TAKEN] = _ALL_AHEAD
        status, particle = self._take(rule, latest)
        self._tier.spend(time.perf_counter() - began)
        self._watch.end()
        self._cut_short = status == Status.INTERRUPTED
        if status == Status.STALLED:
            raise RunError(self._stalled(particle, moment - span))
        if not self._cut_short:
            arriving: Any = self._scenery, self._queue, rule
            self._in_parts(events.arrive, *arriving, first=0, last=len(self.state.mass), latest=math.inf)
            self._tier.kernel(events.settle)(self._scenery, self._freedoms, span)
            self._freedoms.time.fill(0.0)
            self._clock[events.BEFORE] += span
            self._clock[NOW] = 0.0
            self._observe(moment)
        return not self._cut_short

    def _take(self, rule: ReactionRule, latest: float) -> tuple[int, int]:
        """Predict where leases have ended, and take events, to the end of the frame or a halt: (status, particle)."""
        taking: Any = self._scenery, self._freedoms, self._queue, self._clock, rule
        leases = 0
        while self._predict(rule, latest) and leases < self._watch.passes[0]:
            leases += 1
            ((status, particle),) = self._called(events.take, [taking], latest)
            if status != Status.LEASE_ENDED:
                return status, particle
            self._fit_leases()
            self._clock[TAKEN] = _ALL_AHEAD
        return int(Status.INTERRUPTED), 0

    def _predict(self, rule: ReactionRule, latest: float) -> bool:
        """New leases where some have ended, and the next event of every particle; False where a halt came between.

        The clock keeps how many are done: what is left is done when the frame goes on.
        """
        n, plain = len(self.state.mass), self._tier.is_plain
        size = _AT_ONCE_PLAIN if plain else _AT_ONCE
        while self._clock[TAKEN] < 0.0:
            if self._watch.passes[0] == 0:
                return False
            first = int(_ALL_AHEAD - self._clock[TAKEN])
            last = min(first + size, n)
            if first == 0:
                self._tier.kernel(events.lease)(self._scenery, self._freedoms, self._clock)
            moving: Any = self._scenery, self._freedoms, self._queue, self._clock, rule
            self._in_parts(events.predict, *moving, first=first, last=last, latest=latest)
            self._clock[TAKEN] = 0.0 if last == n else _ALL_AHEAD - last
        return True

    def _fit_leases(self) -> None:
        """Wider leases where they ended soon, narrower ones where they lasted long."""
        width: Any = self._freedoms.width
        a_particle = self._clock[TAKEN] / len(self.state.mass)
        if a_particle < _TOO_SHORT:
            width *= 2.0
        elif a_particle > _TOO_LONG:
            width *= 0.5

    def _in_parts(self, kernel: Any, *arguments: Any, first: int, last: int, latest: float) -> None:
        """Call a kernel for the particles from `first` to before `last`, a part of them in each thread."""
        threads = 1 if self._tier.is_plain else self._threads
        ends = np.linspace(first, last, threads + 1).astype(int).tolist()
        self._called(kernel, [(*arguments, *part) for part in itertools.pairwise(ends)], latest)

    def _stalled(self, particle: int, before: float) -> str:
        place = self.state.position[:, particle]
        return (
            f"the frame after {before:g} s failed at particle {particle}: {Status.STALLED.sentence}; it is at "
            f"({', '.join(f'{x:.6g}' for x in place)}) m at {before + self._queue.time[particle]:.9g} s, between walls "
            "of which some react"
        )

    def calls(self) -> Iterator[tuple[Any, tuple[Any, ...]]]:
        rule, part = ReactionRule(0.0, self._watch.passes), (0, 0)
        moving = self._freedoms, self._queue, self._clock, rule
        yield events.lease, (self._scenery, self._freedoms, self._clock)
        yield events.predict, (self._scenery, *moving, *part)
        yield events.take, (self._scenery, *moving)
        yield events.arrive, (self._scenery, self._queue, rule, *part)
        yield events.settle, (self._scenery, self._freedoms, 0.0)
        yield observables.observe, self._observing(walls_now(self._scene, self._scenery, self._freedoms))

    def _observing(self, walls: Any) -> tuple[Any, ...]:
        drawn = np.arange(len(self._partial))
        return None, walls, self._gravity, self.state, drawn, observables.CHUNK, self._partial

    def observe(self) -> None:
        self._observe(0.0)
        self._start = _balance(self._summary())

    def _observe(self, moment: float) -> None:
        self._walls = observed(self._scene, self._freedoms, moment)
        walls = walls_now(self._scene, self._scenery, self._freedoms)
        self._tier.kernel(observables.observe)(*self._observing(walls))

    def _summary(self) -> dict[str, Any]:
        seen = observables.summary(self._partial, self.state, self._owners, lasts=False, parts=self._parts)
        return with_walls(seen, self._walls)

    def seen(self) -> dict[str, Any]:
        seen = self._summary()
        kept = _balance(seen)
        scale = seen["kinetic_energy"] + self._walls.kinetic.sum() + abs(seen["potential_energy"])
        seen["energy_error"] = abs(kept - self._start) / scale if scale > 0.0 else 0.0
        return {**seen, "escaped": int((np.sqrt((self.state.position**2).sum(axis=0)) > self._far).sum())}

    def require_admissible(self, seen: dict[str, Any], moment: float) -> None:
        scene = self._scene
        if seen["max_penetration"] > self._deepest:
            scene = scene.placed(seen["wall_position"], seen["wall_orientation"])
        failures.require_admissible(scene, self.state, seen, self._deepest, moment)

    def share_done(self, span: float) -> float:
        return float(self._clock[NOW] / span)

    def arrays(self) -> Arrays:
        queue = {name: array for name, array in self._queue._asdict().items() if name not in ("heap", "mass", "counts")}
        freedoms = {f"walls.{name}": array for name, array in self._freedoms._asdict().items()}
        counts = {} if self._tally is None else self._tally.arrays()
        return {**queue, **freedoms, **counts, "key": self._queue.heap.key, "clock": self._clock}

    def restore(self, arrays: Arrays, cut_short: bool) -> None:
        self.observe()
        super().restore(arrays, cut_short)
        if self._tally is not None:
            self._queue.counts[:] = arrays["member_impacts"]


def _balance(seen: dict[str, Any]) -> float:
    """The energy of particles and walls, with what was lost and without the work of walls that are moved."""
    kept: float = seen["total_energy"] + seen["dissipated_energy"] - seen["wall_work"].sum()
    return kept
