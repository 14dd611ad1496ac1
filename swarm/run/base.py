"""The base class of the runs of all engines."""

import bisect
import itertools
import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from .. import observables
from ..ball_numbers import BallNumbers
from ..common.status import Status
from ..compiled_scene import CompiledScene
from ..errors import RunError
from ..kernel.random import Seeding
from ..lanes.watching.watchers import Watchers
from ..methods.base import Method
from ..observables import CHUNK
from ..state import State
from . import failures
from .feeding import Feed
from .impacts import ThreadLog
from .observed import Observed, balance, gone_of, poses_of, with_walls
from .preflight.counting import Counting
from .tally import Watched
from .tiers import Tier
from .watch import Watch

# The distance from the origin at which a particle has escaped from an open scene, in extents of the scene.
_FAR = 100.0
# The part of the size of a scene by which a particle may be outside rigid walls; round-off is 1e-15 of the size.
OUTSIDE = 1e-9
# The time between two looks of the caller's thread for an interrupt [s].
_GLANCE = 0.1
# The least number of particles for several threads: with fewer, a kernel ends before another thread is awake.
_FEW = 4096
# The particles between two looks at the halt, compiled and in plain Python: some 0.1 s of work.
_AT_ONCE, _AT_ONCE_PLAIN = 1 << 16, 8
Arrays = dict[str, NDArray[Any]]
T = TypeVar("T")


class BaseRun:
    """A run from frame to frame: it times, halts, balances and observes an engine. Its threads end with its context.

    The methods in which engines differ come first.

    Args:
        compiled, method: the scene and the method.
        n: the number of particles, or bodies.
        threads: the number of threads.
        tier: the tier of the kernels.
        seeding: the seed, and the number of the first particle, or body, in the whole run.
        watched: the log and the tally of impacts, and the counters.
        pool: the pool of threads; None: a new one.

    Attributes:
        state: the arrays that files take of a frame.
    """

    state: State
    # The law of soft walls; None for rigid walls.
    _law: Any = None
    # The walls as observed.
    _walls: Any
    # The counters, and their arrays.
    _counting: Counting
    # The observables of balls; None for points.
    _ball_numbers: BallNumbers | None = None
    # The births of balls during the run, or None.
    _feed: Feed | None = None
    # The reacting walls as observed, or None.
    _observed: Observed | None = None
    # The phases other than flight in which particles have been.
    _kinds: Set[int] = frozenset()
    # The times at which frames are cut into pieces [s]; None for whole frames.
    _instants: Sequence[float] | None = None

    def __init__(
        self, compiled: CompiledScene, method: Method, n: int, threads: int, tier: Tier, seeding: Seeding,
        watched: Watched, pool: ThreadPoolExecutor | None = None,
    ) -> None:  # fmt: skip
        scene, numbering = compiled.scene, compiled.numbering
        self._compiled, self._scene, self._gravity = compiled, scene, scene.pull()
        self._method, self._first = method, seeding.first
        self._owners, self._parts = numbering.surfaces_of_rows, numbering.parts_of_rows
        self._surfaces_of_walls = numbering.members[0]
        self._deepest = OUTSIDE * scene.finite_size() if method.is_rigid() else math.inf
        # In a scene without walls no particle escapes: it has only balls in free space.
        self._far = _FAR * scene.extent() if scene.surfaces and scene.is_open() else math.inf
        self._pool = ThreadPoolExecutor(threads, "swarm") if pool is None else pool
        self._threads, self._tier, self._watch = threads, tier, Watch(n)
        self._impacts, self._tally, _counters = watched
        self._size, self._partial = CHUNK, np.zeros((math.ceil(n / CHUNK), observables.ROWS))
        # The energy at the start [J], and the time of the method at the last frame [s].
        self._start, self._moment = np.zeros(1), 0.0
        # The start of the frame [s], the number of its pieces that are done, and its end [s].
        self._begun, self._done, self._end = np.zeros(1), np.zeros(1, np.int64), 0.0
        self._cut_short = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        if self._impacts is not None:
            self._impacts.close()
        self.halt()
        self._pool.shutdown(wait=True)

    def halt(self, passes: int = 0) -> None:
        """Make every kernel call of this frame return after a number of passes, or events; 0: at once.

        The halt ends when `advance` returns.
        """
        self._watch.halt(passes)

    # --- What differs between engines --------------------------------------------------------------------

    def calls(self) -> Iterable[tuple[Any, tuple[Any, ...]]]:
        """Return every kernel of a frame, each with arguments of the types of its next calls."""
        raise NotImplementedError

    def _prepare(self, span: float, moment: float) -> None:
        """Prepare a frame, or the rest of a frame that was cut short; `span` and `moment` are as in `advance`."""
        raise NotImplementedError

    def _turn(self, span: float, moment: float, writing: float, latest: float) -> tuple[int, int]:
        """Call kernels until the frame is done or halted; return the status, and its particle or body."""
        raise NotImplementedError

    def _goes_on(self, status: int, item: int, seconds: float) -> bool:
        """Whether another turn follows at once after a turn of `seconds` [s] that ended with this status."""
        return False

    def _failure(self, status: Status, item: int, span: float, moment: float) -> str:
        """Return the sentence about a frame that failed."""
        raise NotImplementedError

    def _share_done(self, span: float) -> float:
        """Return the share of a frame, or of a piece of a frame, that is done, from 0 to 1."""
        raise NotImplementedError

    def furthest_behind(self) -> tuple[int, list[float]] | None:
        """Return the particle with the most time left in a frame that was cut short, and its place [m], or None."""
        return None

    def _arrays(self) -> dict[str, Any]:
        """Return the arrays of a checkpoint that only this engine has, as `arrays_of` takes them."""
        raise NotImplementedError

    def _begin(self) -> None:
        """Prepare the observation of the start."""

    def _show(self, moment: float) -> None:
        """Set the state, and the walls as observed, to a frame at a moment [s]."""

    def _with_stored(self, seen: dict[str, Any]) -> dict[str, Any]:
        """Return the observables with the energy of contacts, if the sums over particles do not have it."""
        return seen

    def _scale_of(self, seen: dict[str, Any]) -> float | None:
        """Return the energy to which the error of the energy is relative [J]; None: the error of the worst particle."""
        return None

    def _length(self, duration: float) -> float:
        """Return the length of a piece of a frame [s] in the unit of this engine."""
        return self._method.span("the time between two doors", duration)

    def _clock_time(self, moment: float) -> float:
        """Return the time of this engine at the end of a frame, or of a piece of a frame [s]."""
        return self._method.instant(moment)

    def _switch(self, instant: float) -> None:
        """Open, shut, add and remove walls at the instant at which a piece of a frame begins [s]."""

    def chunk_sums(self) -> NDArray[np.float64]:
        """Return the sums over each chunk of particles of the last frame, from which a run in shards makes its own."""
        raise NotImplementedError

    # --- From frame to frame -----------------------------------------------------------------------------

    def advance(self, span: float, moment: float, writing: float = 0.0, latest: float = math.inf) -> bool:
        """Advance all particles by `span`, in the unit of the method, to a moment [s], and observe them.

        Return whether the frame is done. It is not done if `halt` was called, the time `latest` [s of time.monotonic]
        has come, or the time for plain Python is used up. The next call then continues the frame, with the same bits as
        without the halt. `writing` is the time to write a frame [s].

        Raises:
            RunError: a step failed.
        """
        self._end = moment
        if self._instants is None:
            return self._advance_piece(span, moment, writing, latest)
        times = self._times(moment)
        for k in range(int(self._done[0]), len(times) - 1):
            before, after = times[k : k + 2]
            if not self._cut_short:
                self._switch(before)
            if self._impacts is not None:
                self._impacts.begin = before
            if not self._advance_piece(self._length(after - before), after, writing, latest):
                return False
            self._done[0] = k + 1
        self._begun[0], self._done[0] = moment, 0
        return True

    def _times(self, end: float) -> list[float]:
        """Return the times at which the pieces of a frame begin and end."""
        begin, instants = float(self._begun[0]), self._instants or ()
        return [begin, *instants[bisect.bisect_right(instants, begin) : bisect.bisect_left(instants, end)], end]

    def _advance_piece(self, span: float, moment: float, writing: float, latest: float) -> bool:
        """Advance by a piece of a frame, as `advance` does by a whole frame."""
        self._moment = self._clock_time(moment)
        self._prepare(span, moment)
        again = True
        while again:
            until = self._limit(latest)
            began = time.perf_counter()
            status, item = self._turn(span, moment, writing, until)
            seconds = time.perf_counter() - began
            self._tier.spend(seconds)
            self._cut_short = status in (Status.INTERRUPTED, Status.HARD_CONTACT)
            again = self._goes_on(status, item, seconds)
        self._watch.end()
        if status not in (Status.DONE, Status.INTERRUPTED):
            raise RunError(self._failure(Status(status), item, span, moment))
        if not self._cut_short:
            self._show(moment)
            self._observe(moment)
        return not self._cut_short

    def share_done(self, span: float) -> float:
        """Return the share done of a frame that was cut short, on average over the particles or bodies."""
        if self._instants is None:
            return self._share_done(span)
        k, times = int(self._done[0]), self._times(self._end)
        before, after = times[k : k + 2]
        done = before - times[0] + self._share_done(self._length(after - before)) * (after - before)
        return float(done / (times[-1] - times[0]))

    def arrays(self) -> Arrays:
        """Return the arrays of a checkpoint, not copied, from which `restore` goes on with the same bits."""
        found = arrays_of(self._arrays())
        if self._instants is not None:
            found |= {"piece.begun": self._begun, "piece.done": self._done}
        for more in (self._ball_numbers, self._tally, self._feed):
            found |= {} if more is None else more.arrays()
        return found

    def may_grow(self, name: str) -> bool:
        """Whether an array of `arrays` may change its length during the run."""
        return False

    def restore(self, arrays: Arrays, cut_short: bool) -> None:
        """Set the state to that of the run with these `arrays`: at a frame, or within a frame if it was `cut_short`."""
        for name, array in self.arrays().items():
            np.copyto(array, arrays[name], casting="no")
        self._cut_short = cut_short
        if self._tally is not None:
            self._tally.restore(arrays)

    # --- Observation -------------------------------------------------------------------------------------

    def observe(self) -> None:
        """Observe the start."""
        began = time.perf_counter()
        self._begin()
        self._tier.spend(time.perf_counter() - began)
        self._show(0.0)
        self._observe(0.0)
        self._start[0] = balance(self._summary())

    def _observe(self, moment: float) -> None:
        """Observe a frame."""
        self._tier.kernel(observables.observe)(*self._observing())
        # Rates are those of a frame, not of a piece of a frame.
        if self._ball_numbers is not None and moment == self._end:
            idle = self.state.gone() | self._waiting() | self._has_left()
            kinetic = self._summed()["kinetic_energy"] - self._kinetic_of(idle)
            self._ball_numbers.frame(self._seen_state(), moment, kinetic)

    def _observing(self, drawn: NDArray[Any] | None = None) -> tuple[Any, ...]:
        """Return the arguments of `observe`, for all chunks, or for the draws of a thread."""
        drawn = np.arange(len(self._partial)) if drawn is None else drawn
        return self._law, self._walls, self._gravity, self._seen_state(), drawn, self._size, self._partial

    def _waiting(self) -> Any:
        """Whether a wall holds each ball (N,): a held ball does not move, and has the velocity with which it leaves."""
        return False

    def _kinetic_of(self, some: NDArray[np.bool_]) -> float:
        """Return the kinetic energy of some of the particles [J]."""
        state = self.state
        return 0.5 * float((state.mass[some] * (state.velocity[:, some] ** 2).sum(axis=0)).sum())

    def _summed(self) -> dict[str, Any]:
        """Return the observables that are sums over particles."""
        return observables.summary(self._partial, self._seen_state(), self._owners, bool(self._kinds), self._parts)

    def _summary(self) -> dict[str, Any]:
        """Return the observables that are sums over particles, contacts and walls."""
        seen = self._with_stored(self._summed())
        seen = seen if self._ball_numbers is None else self._ball_numbers.added(seen, self._seen_state())
        seen = seen if self._feed is None else seen | self._feed.observed()
        return seen if self._observed is None else with_walls(seen, self._observed)

    def seen(self) -> dict[str, Any]:
        """Return the observables of the last frame."""
        seen = self._summary()
        if (scale := self._scale_of(seen)) is not None:
            seen["energy_error"] = abs(balance(seen) - float(self._start[0])) / scale if scale > 0.0 else 0.0
        seen |= gone_of(self.state, self._escaped(), self._surfaces_of_walls, len(self._scene.surfaces))
        if self._scene.moves() and not self._scene.reacts():
            seen |= poses_of(self._scene, self._moment)
        return seen

    def _escaped(self) -> int:
        """Return the number of particles that have left an open scene, but not through an opening."""
        return int((self._has_left() & ~self.state.gone()).sum())

    def _has_left(self) -> NDArray[np.bool_]:
        """Whether each ball (N,) is far away, or beyond an open face and flies in its direction, as for points."""
        state = self.state
        if self._far == math.inf:
            return np.zeros(state.mass.size, np.bool_)
        left: NDArray[np.bool_] = np.sqrt((state.position**2).sum(axis=0)) > self._far
        for *n, offset in self._scene.open_faces(self._moment):
            left |= (n @ state.position > offset) & (n @ state.velocity > 0.0)
        return left

    def _seen_state(self) -> State:
        """Return the state of the particles in the scene at the last frame."""
        return self.state if self._feed is None else self._feed.seen(self.state)

    def require_admissible(self, seen: dict[str, Any], moment: float) -> None:
        """Raise a `RunError` with the first particle that is not finite, or is outside rigid walls."""
        scene, state = self._scene, self._seen_state()
        lost = np.zeros(state.mass.size, np.bool_)
        if state.radius is not None:
            lost = scene.lost(state.position, moment) & ~state.gone()
        if scene.reacts() and (seen["max_penetration"] > self._deepest or lost.any()):
            scene = scene.placed(seen["wall_position"], seen["wall_orientation"])
        failures.require_admissible(scene, state, lost, seen, self._deepest, moment, self._first)

    # --- Calls of kernels --------------------------------------------------------------------------------

    def _called(self, kernel: Any, calls: Iterable[tuple[Any, ...]], latest: float) -> list[Any]:
        """Call a kernel for each tuple of arguments in a thread, halted at `latest`; return the results."""
        chosen = self._tier.kernel(kernel)
        shares = [self._pool.submit(chosen, *arguments) for arguments in calls]
        return [result_of(share, latest, self.halt) for share in shares]

    def _call(self, kernel: Any, *arguments: Any, latest: float = math.inf) -> Any:
        """Call a kernel in one thread; return its result."""
        return self._called(kernel, [arguments], latest)[0]

    def _in_parts(self, kernel: Any, *arguments: Any, first: int = 0, last: int, latest: float = math.inf) -> None:
        """Call a kernel for the numbers from `first` to before `last`, a part in each thread."""
        threads = 1 if self._tier.is_plain or self.state.mass.size < _FEW else self._threads
        ends = np.linspace(first, last, threads + 1).astype(int).tolist()
        self._called(kernel, [(*arguments, *part) for part in itertools.pairwise(ends)], latest)

    def _in_chunks(self, kernel: Any, *arguments: Any) -> None:
        """Call a kernel for all particles, some at a time, compiled after the time for plain Python."""
        began, first, n = time.perf_counter(), 0, self.state.mass.size
        while first < n:
            last = min(first + self._at_once(), n)
            self._call(kernel, *arguments, first, last)
            first = last
            # In a union a ball takes 0.1 s of plain Python.
            if self._tier.is_plain and (seconds := time.perf_counter() - began) > self._tier.remaining:
                self._tier.end_plain(seconds)

    def _at_once(self) -> int:
        """Return the number of particles of a kernel between two looks at the halt."""
        return _AT_ONCE_PLAIN if self._tier.is_plain else _AT_ONCE

    def _watchers(self, page: ThreadLog | None = None) -> Watchers:
        """Return the watchers of the calling thread, with the log that it fills; without one for the types alone."""
        counts = None if self._tally is None else self._tally.counts()
        return Watchers(self._log_of(page), counts, self._counting.counters)

    def _log_of(self, page: ThreadLog | None) -> Any:
        """Return the log that a thread fills, without one a log of the same type; None in a run without a log."""
        return page.log if page is not None else None if self._impacts is None else self._impacts.example

    def _open_page(self, end: float) -> ThreadLog:
        """Return the log of the calling thread, for the frame that ends at a time [s]."""
        return ThreadLog(self._impacts, end)

    def is_plain(self) -> bool:
        """Whether the kernels run in plain Python."""
        return self._tier.is_plain

    def _choose_tier(self) -> None:
        """Choose the tier of the next calls."""
        self._tier.choose(self.calls())

    def _limit(self, latest: float) -> float:
        """Return the latest time for kernels to return [s of time.monotonic], that of plain Python included."""
        if self._tier.is_plain and self._tier.remaining <= 0.0:
            self._choose_tier()
        return min(latest, time.monotonic() + self._tier.remaining) if self._tier.is_plain else latest


def arrays_of(found: Mapping[str, Any]) -> Arrays:
    """Return the arrays of a checkpoint, without None; arrays of a named tuple have its name first.

    >>> from swarm.state import Crossed
    >>> crossed = Crossed(*np.zeros((3, 1)))
    >>> list(arrays_of({"impacts": np.zeros(1), "heat": None, "crossed": crossed}))
    ['impacts', 'crossed.side', 'crossed.number', 'crossed.sums']
    """
    arrays: Arrays = {}
    for name, value in found.items():
        if isinstance(value, tuple):
            arrays |= arrays_of({f"{name}.{part}": array for part, array in value._asdict().items()})  # type: ignore[attr-defined]
        elif value is not None:
            arrays[name] = value
    return arrays


def result_of(share: "Future[T]", latest: float, halt: Callable[[], None]) -> T:
    """Return the result of a thread, which is halted at `latest` [s of time.monotonic].

    This waits many short times, and Python handles signals between two of them. A signal just before a long wait, or to
    another thread, would be handled only at the end of the wait.
    """
    while True:
        try:
            return share.result(min(_GLANCE, max(0.0, latest - time.monotonic())))
        except TimeoutError:
            if time.monotonic() >= latest:
                halt()
                latest = math.inf
