"""The log of impacts of a run: kernels fill arrays, and the thread that writes frames writes them."""

import queue
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

from ..common.status import Status
from ..errors import RunError, SceneError
from ..lanes.share import Share
from ..lanes.table import LANES, STRIDE
from ..lanes.watching.log import GOING, Log
from .options import RunOptions, Task

# The rows of a log, and the number of logs besides two for each thread, as some are written while others are filled. A
# log takes 6 MB. With a quarter of the rows the writer takes twice as long for a row.
_ROWS, _MORE = 1 << 16, 2
# Rows up to this number are copied, so that their log can be filled again at once.
_FEW = _ROWS // 16
# The time between two looks, of a thread that waits for an empty log, at whether the run has ended [s].
_GLANCE = 0.1

Rows = dict[str, NDArray[Any]]


class Impacts:
    """The logs that the threads of a run fill; a full log is written while they fill others.

    Positions, velocities and impulses have the precision of the run; times are float64.

    Attributes:
        kept: the particles and the precision, as TOML text.
        begin: the start of the frame that is computed [s].
        total: the number of rows so far.
        ends: frame -> the number of rows at its end, until the writer takes it.
        write: a function that adds rows to the file; the writer sets it.
        sums: a function that returns the checksums of the rows of the frame under way, as text; the writer sets it.
        queue: a function that lets the writer's thread call a function, in its turn among the frames.
    """

    def __init__(self, task: Task) -> None:
        compiled, options, laws = task.compiled, task.options, task.compiled.laws
        self.kept = tomli_w.dumps({"particles": options.impact_particles, "precision": options.precision})
        self._chosen = chosen(options.impact_particles, task.count)
        self._slips, self._repeats = laws is not None and laws.friction is not None, compiled.scene.period is not None
        self._real, self._meet = np.dtype(options.precision), task.particles.radius is not None
        takes_time = task.method.law() is not None
        # Contacts with several walls may end in one step.
        most = min(LANES * len(compiled.numbering.surfaces_of_rows), _ROWS // 2) if takes_time else LANES
        self._lasts = self._meet and takes_time
        # Many contacts may end in a step of many grains.
        rows = max(_ROWS, task.count) if self._lasts else _ROWS
        # A flight may cross many counters; rows come one by one if particles depend on one another.
        self._room = rows // 2 if options.counters or self._lasts else 1 if task.is_coupled else most
        self._spare: queue.SimpleQueue[Log] = queue.SimpleQueue()
        for _ in range(2 * options.thread_count() + _MORE):
            self._spare.put(self._made(rows))
        # A log with the types that kernels take.
        self.example = self._made(0)
        self.begin, self.total, self.ends = 0.0, 0, dict[int, int]()
        self.write: Callable[[Rows], None] = lambda rows: None
        self.sums: Callable[[], str] = lambda: ""
        self.queue: Callable[[Callable[[], None]], None] = lambda job: job()
        self._problem: BaseException | None = None
        self._counting = threading.Lock()
        self._over = False

    def _made(self, rows: int) -> Log:
        real = self._real
        lasted = [np.empty(rows, real) if self._lasts else None for _column in range(3)]
        return Log(
            np.empty(rows), np.empty(rows, np.int32), np.empty(rows, np.int32), np.empty((rows, 3), real),
            np.empty((rows, 3), real), np.empty((rows, 3), real), np.empty(rows, real),
            np.empty((rows, 3), real) if self._slips else None,
            np.empty((rows, 3), np.int32) if self._repeats else None, np.empty(rows, np.int32) if self._meet else None,
            lasted[0], lasted[1], lasted[2],
            np.zeros(2, np.int64), np.zeros(GOING, np.int64),
            np.zeros(STRIDE, np.int64), self._chosen, 0.0, 0.0, self._room,
        )  # fmt: skip

    def columns(self) -> dict[str, Any]:
        """Return name -> array without rows, for each column."""
        return _columns(self.example, 0)

    def empty(self, end: float) -> Log:
        """Return an empty log of the frame that ends at a time [s], after waiting until one has been written.

        Raises:
            FileError: earlier logs cannot be written.
        """
        while True:
            if self._problem is not None:
                raise self._problem
            if self._over:
                raise RuntimeError("the log of impacts is closed")
            try:
                log = self._spare.get(timeout=_GLANCE)
            except queue.Empty:
                continue
            log.filled.fill(0)
            log.going.fill(0)
            return log._replace(begin=self.begin, end=end)

    def hand_over(self, log: Log) -> None:
        """Queue the rows of a log for the writer, and the log for being filled again."""
        count = int(log.filled[0])
        rows, written = _columns(log, count), log if count > _FEW else None
        with self._counting:
            self.total += count
        if written is None:
            rows = {name: array.copy() for name, array in rows.items()}
            self._spare.put(log)
        if count:
            self.queue(lambda: self._write(rows, written))

    def _write(self, rows: Rows, log: Log | None) -> None:
        try:
            if self._problem is None:
                self.write(rows)
        except BaseException as problem:
            self._problem = problem
            raise
        finally:
            if log is not None:
                self._spare.put(log)

    def close(self) -> None:
        """Close the log: no thread waits for an empty log from now on."""
        self._over = True


def log_of(task: Task) -> Impacts | None:
    """Return the log of impacts of a run, or None."""
    return None if task.options.impacts is None else Impacts(task)


class ThreadLog:
    """The log that one thread fills, in the frame that ends at a time [s].

    Attributes:
        log: the log that is being filled; None in a run without a log, in which `call` only calls the kernel.
    """

    def __init__(self, impacts: Impacts | None, end: float) -> None:
        self._impacts, self._end = impacts, end
        self.log: Any = None if impacts is None else impacts.empty(end)

    def call(self, kernel: Any, *arguments: Any) -> tuple[int, int, int]:
        """Call a kernel, again with an empty log each time the log is full; return its result."""
        if self.log is None:
            return kernel(*arguments)  # type: ignore[no-any-return]
        while True:
            status, particle, drawn = kernel(*(self._with_log(one) for one in arguments))
            if status != Status.LOG_FULL:
                return status, particle, drawn
            going = self.log.going.copy()
            self.turn()
            self.log.going[:] = going

    def _with_log(self, one: Any) -> Any:
        return one._replace(watchers=one.watchers._replace(log=self.log)) if isinstance(one, Share) else one

    def turn(self) -> None:
        """Hand over the rows so far, and begin an empty log."""
        if self._impacts is not None:
            self.close()
            self.log = self._impacts.empty(self._end)

    def close(self) -> None:
        """Hand over the rows so far."""
        if self._impacts is None:
            return
        if self.log.filled[1]:
            raise RunError(
                f"the frame at {self._end:g} s has flights that cross counters more often, or steps in which more "
                "contacts end, than the log of impacts has room for; use more frames (every), which cut flights, fewer "
                "particles in the log (impact_particles), or leave impacts out"
            )
        self._impacts.hand_over(self.log)


def require_logged(n: int, options: RunOptions) -> None:
    """Raise a `SceneError` if `impact_particles` has the number of a particle, or body, that does not exist."""
    numbers = options.impact_particles
    if isinstance(numbers, tuple) and numbers[-1] >= n:
        raise SceneError(f"impact_particles must be numbers of particles, from 0 to {n - 1}, got {numbers[-1]}")


def chosen(particles: Any, n: int) -> NDArray[np.bool_] | None:
    """Return whether each of n particles has rows, (n,); None if all have."""
    if isinstance(particles, str):
        return None
    found = np.zeros(n, np.bool_)
    found[slice(None, None, particles) if isinstance(particles, int) else list(particles)] = True
    return found


def _columns(log: Log, count: int) -> Rows:
    arrays = log._asdict()
    return {name: arrays[name][:count] for name in _NAMES if arrays[name] is not None}


_NAMES = Log._fields[: Log._fields.index("filled")]
