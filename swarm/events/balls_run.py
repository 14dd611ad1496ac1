"""The run of balls that meet one another and walls at instants."""

import itertools
import math
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from .. import observables
from ..ball_numbers import BallNumbers
from ..common.status import Status
from ..errors import RunError
from ..methods.base import Method
from ..particles import Particles
from ..run import failures
from ..run.base import Arrays, BaseRun
from ..run.doors import comers
from ..run.impacts import ThreadLog
from ..run.observed import gone_of, poses_of
from ..run.state import Seeding
from ..run.tally import Watched
from ..run.tiers import Tier
from ..scene import Scene
from ..state import Balls, State
from .colliding import events
from .colliding.bounce import Gates, RandomSource
from .colliding.box import CollisionRule, CollisionTotals
from .colliding.clock import CLOCK, COLLISIONS, EPOCHS, LENGTH, REACH
from .colliding.described import aligned_copy, described, epoch_of, reach_of, with_room
from .colliding.queue import FIRST
from .colliding.window import END
from .resting import warn_of_rest
from .windows import windows_of

# Fewer balls than this are written sooner than another thread is awake.
_FEW = 4096
# So many balls are aimed at a time, compiled and in plain Python: in some 0.1 s, from one look at the halt to the next.
_AT_ONCE, _AT_ONCE_PLAIN = 1 << 16, 64


class CollidingRun(BaseRun):
    """The run of balls that meet one another and walls at instants; the arrays of the particles become its state."""

    def __init__(
        self, scene: Scene, particles: Particles, method: Method, threads: int, block_size: int | None, compile: str,
        seeding: Seeding, watched: Watched,
    ) -> None:  # fmt: skip
        assert particles.radius is not None
        self._of, n, rows = scene, len(particles), len(scene.owners())
        self._radius = float(particles.radius.max())
        box, self._flock = described(scene, particles)
        self._clock = np.zeros(CLOCK)
        self._clock[[LENGTH, REACH]] = epoch_of(scene, particles, box.grid), reach_of(box.grid)
        self._windows = windows_of(scene, self._clock)
        laws, openings = box.laws, scene.openings()
        loses = laws.may_dissipate or laws.loses or box.loss is not None
        balls = Balls(particles.radius, np.zeros(n, np.int64), np.zeros(1))
        # The energy of each ball is not kept. An array of zeros that is never written takes one page of memory.
        unused = np.zeros(n)
        # Times are those of the start of each flight: so what is written at frames is no part of the motion.
        self.state = State(
            particles.position, particles.velocity, particles.mass, *2 * (unused,),
            np.zeros(n, np.int64), np.zeros((2 * rows if scene.moves() else rows, 1)), np.zeros(n if loses else 0),
            None, None, np.zeros((rows, 1)) if laws.give_heat else None,
            image=particles.image, period=scene.cell(), balls=balls,
            escape_time=None if openings is None else np.full(n, math.nan), openings=openings,
            absorbed_time=np.full(n, math.nan) if laws.may_end else None,
            absorbed_wall=np.full(n, -1, np.int32) if laws.may_end else None,
        )  # fmt: skip
        state, self._balls, gates = self.state, balls, None
        if openings is not None or laws.may_end:
            gates = Gates(openings, state.escape_time, state.absorbed_time, state.absorbed_wall)
        seed = seeding.seed - 2**64 if seeding.seed >= 2**63 else seeding.seed
        self._impacts, self._tally, _counters = watched
        self._box = self._with_heavy(box)._replace(
            log=None if self._impacts is None else self._impacts.example,
            window=None if self._windows is None else self._windows.numbers,
            gates=gates, source=RandomSource(seed, seeding.first) if laws.send_off else None,
        )  # fmt: skip
        pool, tier = ThreadPoolExecutor(threads, "swarm"), Tier(compile, self._box, n)
        super().__init__(scene, method, n, pool, tier, seeding.first)
        counts = None if self._tally is None else self._tally.counts()
        self._books = CollisionTotals(
            self._impulse_of_books(), state.dissipated, state.impacts, balls.virial, state.image, counts, state.heat
        )
        self._surfaces_of_walls = scene.members()[0]
        self._partial = np.zeros((math.ceil(n / observables.CHUNK), observables.ROWS))
        self._threads = threads if n >= _FEW else 1
        self._numbers = BallNumbers(scene, particles)
        self._told_of_rest = False
        self._ends = np.zeros(2)  # of the frame, and of the one before [s]
        self._start = np.zeros(1)
        self._choose_tier()

    def _with_heavy(self, box: Any) -> Any:
        """What the balls are in, with walls that have a mass."""
        return box

    def _impulse_of_books(self) -> Any:
        """Where impulses on walls are booked."""
        return self.state.impulse

    def advance(self, span: float, moment: float, writing: float = 0.0, latest: float = math.inf) -> bool:
        latest = self._limit(latest)
        began = time.perf_counter()
        self._ends[:] = moment, moment - span
        page, rule = (
            None if self._impacts is None else ThreadLog(self._impacts, moment),
            CollisionRule(moment, self._watch.passes),
        )
        status = ball = int(Status.LEASE_ENDED)
        while status in (Status.LEASE_ENDED, Status.LOG_FULL):
            kept = self._box if page is None else self._box._replace(log=page.log)
            taking: Any = kept, self._flock, self._books, self._clock, rule
            ((status, ball),) = self._called(events.take, [taking], latest)
            if page is not None and status == Status.LOG_FULL:
                page.turn()
            elif status == Status.LEASE_ENDED and ball >= 0:
                self._make_room()
            elif status == Status.LEASE_ENDED:
                self._next_window()
        if page is not None:
            page.close()
        self._told_of_rest = self._told_of_rest or warn_of_rest(self._box, self._clock)
        self._cut_short = status == Status.INTERRUPTED
        if not self._cut_short and status == Status.DONE:
            self._show(moment)
        self._tier.spend(time.perf_counter() - began)
        self._watch.end()
        if status not in (Status.DONE, Status.INTERRUPTED):
            raise RunError(self._failed(Status(status), int(ball), moment - span))
        if not self._cut_short:
            self._observe(moment)
        return not self._cut_short

    def _make_room(self) -> None:
        """More room in the cells."""
        self._flock, grid = with_room(self._flock, self._box.grid)
        self._box = self._box._replace(grid=grid)

    def _show(self, moment: float) -> None:
        """Write the arrays of a frame."""
        self._in_parts(events.show, self._box, self._flock, self.state, self._since(moment), count=self.state.mass.size)

    def _since(self, moment: float) -> float:
        """A moment in the time of the epoch [s]."""
        return float(moment - self._clock[EPOCHS] * self._clock[LENGTH])

    def _next_window(self) -> None:
        """Begin the next window of walls that move, come or go, in which all balls look for their walls anew."""
        windows = self._windows
        assert windows is not None
        instant, now = windows.instant(), float(windows.numbers[END])
        if windows.is_at_epoch():
            ending: Any = self._flock, self._clock
            self._called(events.next_epoch, [ending], math.inf)
            now = 0.0
        windows.begin(now)
        self._set_window()
        if instant is not None:
            self._require_free(instant, now)
        self._for_all(events.begin, self._box, self._flock, now)
        ordering: Any = (self._flock,)
        self._called(events.order, [ordering], math.inf)

    def _set_window(self) -> None:
        """The walls of the window, and which cells are near them."""
        if self._windows is not None:
            gates = self._box.gates
            if gates is not None:
                gates = gates._replace(openings=self._windows.openings())
                self.state = self.state._replace(openings=gates.openings)
            self._box = self._box._replace(walls=self._windows.walls(), gates=gates)
        self._in_parts(events.mark, self._box, self._radius, count=int(self._box.grid.x.count) + 2)

    def _require_free(self, instant: float, now: float) -> None:
        """Raise a RunError where a ball is inside a wall that comes at an instant [s], which is now in the epoch."""
        came = comers(self._scene, instant)
        if not came.any():
            return
        self._in_parts(events.show, self._box, self._flock, self.state, now, count=self.state.mass.size)
        distances = self._scene.distances_outside(self.state.position, instant, self._balls.radius)
        distances[~came] = -math.inf
        distances[:, self.state.gone()] = -math.inf
        inside = ~(distances <= self._deepest)
        if inside.any():
            ball = int(np.argmax(inside.any(axis=0)))
            wall = int(np.argmax(inside[:, ball]))
            depth = float(distances[wall, ball])
            said = failures.sentence_of_coming(self._scene, self.state, (wall, ball), depth, instant, self._first)
            raise RunError(said)

    def _for_all(self, kernel: Any, *arguments: Any) -> None:
        """Call a kernel for all balls, some at a time."""
        n, size = self.state.mass.size, _AT_ONCE_PLAIN if self._tier.is_plain else _AT_ONCE
        for first in range(0, n, size):
            aiming: Any = *arguments, first, min(first + size, n)
            self._called(kernel, [aiming], math.inf)

    def _in_parts(self, kernel: Any, *arguments: Any, count: int) -> None:
        """Call a kernel for so many balls, a part of them in each thread."""
        threads = 1 if self._tier.is_plain else self._threads
        ends = np.linspace(0, count, threads + 1).astype(int).tolist()
        self._called(kernel, [(*arguments, *part) for part in itertools.pairwise(ends)], math.inf)

    def _failed(self, status: Status, ball: int, before: float) -> str:
        r, _v = self._flock.at(self._box.pull, ball, self._flock.time(ball))
        return (
            f"the frame after {before:g} s failed at particle {ball}: {status.sentence}; it is at "
            f"({', '.join(f'{x:.6g}' for x in r)}) m at {self._now():.9g} s"
        )

    def collisions(self) -> float:
        """How many there were since the start."""
        return float(self._clock[COLLISIONS])

    def _now(self) -> float:
        """The time of the next event since the start [s]."""
        return float(self._clock[EPOCHS] * self._clock[LENGTH] + self._flock.key[FIRST])

    def calls(self) -> Iterator[tuple[Any, tuple[Any, ...]]]:
        part, box, flock = (0, 0), self._box, self._flock
        yield events.mark, (box, self._radius, *part)
        yield events.begin, (box, flock, -1.0, *part)
        yield events.order, (flock,)
        yield events.take, (box, flock, self._books, self._clock, CollisionRule(0.0, self._watch.passes))
        yield events.show, (box, flock, self.state, 0.0, *part)
        if self._windows is not None:
            yield events.next_epoch, (flock, self._clock)
        yield observables.observe, self._observing()

    def _observing(self, moment: float = 0.0) -> tuple[Any, ...]:
        drawn = np.arange(len(self._partial))
        return None, self._walls_seen(moment), self._box.pull, self.state, drawn, observables.CHUNK, self._partial

    def _walls_seen(self, moment: float) -> Any:
        return self._box.walls if self._windows is None else self._scene.walls(moment)

    def observe(self) -> None:
        self._begin()
        self._show(0.0)
        self._observe(0.0)
        self._start[0] = balance(self._summary())

    def _begin(self) -> None:
        """Find what is next for every ball."""
        began = time.perf_counter()
        if self._windows is not None:
            self._windows.begin(0.0)
        self._set_window()
        self._for_all(events.begin, self._box, self._flock, -1.0)
        ordering: Any = (self._flock,)
        self._called(events.order, [ordering], math.inf)
        self._tier.spend(time.perf_counter() - began)

    def _observe(self, moment: float) -> None:
        self._tier.kernel(observables.observe)(*self._observing(moment))
        self._moment = moment
        self._numbers.frame(self.state, moment, self._summary()["kinetic_energy"])

    def _summary(self) -> dict[str, Any]:
        return observables.summary(self._partial, self.state, self._owners, lasts=False, parts=self._parts)

    def seen(self) -> dict[str, Any]:
        seen = self._summary()
        scale = seen["kinetic_energy"] + seen["dissipated_energy"] + abs(seen["potential_energy"])
        seen["energy_error"] = abs(balance(seen) - self._start[0]) / scale if scale > 0.0 else 0.0
        far = (np.sqrt((self.state.position**2).sum(axis=0)) > self._far) & ~self.state.gone()
        seen |= gone_of(self.state, int(far.sum()), self._surfaces_of_walls, len(self._scene.surfaces))
        if self._scene.moves():
            seen |= poses_of(self._scene, self._moment)
        return self._numbers.added(seen, self.state)

    def require_admissible(self, seen: dict[str, Any], moment: float) -> None:
        failures.require_admissible(self._scene, self.state, seen, self._deepest, moment, self._first)

    def share_done(self, span: float) -> float:
        return min(1.0, max(0.0, (self._now() - float(self._ends[1])) / span))

    def arrays(self) -> Arrays:
        flock, state = self._flock, self.state
        found = {
            "flight": flock.flight, "event": flock.event, "node": flock.node, "key": flock.key, "item": flock.item,
            "room": flock.room,
            "impulse": state.impulse, "dissipated": state.dissipated, "impacts": state.impacts,
            "collisions": self._balls.collisions, "virial": self._books.virial, "clock": self._clock,
            "start": self._start, "position": state.position, "velocity": state.velocity,
            **self._numbers.arrays(),
        }  # fmt: skip
        kept = flock.kept
        some = {
            "last": flock.last, "image": state.image, "heat": state.heat, "escape_time": state.escape_time,
            "kept": None if kept is None else kept.twice, "kept_stamp": None if kept is None else kept.stamp,
            "absorbed_time": state.absorbed_time, "absorbed_wall": state.absorbed_wall,
            "window": None if self._windows is None else self._windows.numbers,
        }  # fmt: skip
        found |= {name: array for name, array in some.items() if array is not None}
        return found if self._tally is None else {**found, **self._tally.arrays()}

    def restore(self, arrays: Arrays, cut_short: bool) -> None:
        self.observe()
        grid, size = self._box.grid, arrays["room"].size
        self._flock = self._flock._replace(room=aligned_copy(np.zeros(size, np.int32)))
        self._box = self._box._replace(grid=grid._replace(stride=size // grid.near.size))
        super().restore(arrays, cut_short)
        if self._windows is not None:
            self._set_window()
        if self._tally is not None:
            self._tally.restore(arrays)
            self._books = self._books._replace(counts=self._tally.counts())


def balance(seen: dict[str, Any]) -> float:
    """The energy of all, with what was lost."""
    kept: float = seen["total_energy"] + seen["dissipated_energy"] - seen["wall_heat"].sum()
    return kept - float(np.sum(seen.get("wall_work", 0.0)))
