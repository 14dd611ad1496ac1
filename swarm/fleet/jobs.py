"""Jobs that other processes carry out, on the side of the worker and on the side of the caller.

A fleet hands out jobs through a `concurrent.futures.Executor`: of loky for processes of this machine (`processes`), of
Dask on a cluster (`connection`). An executor carries a call and its outcome. A fleet adds the messages during a
run: its reports, and the request to stop with a checkpoint.
"""

import contextlib
import math
import secrets
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from ..errors import SwarmError

if TYPE_CHECKING:
    from ..run.options import RunOptions
    from ..run.progress import Display
    from ..run.session import Session

# Seconds between looks at the jobs, and between requests to stop, repeated for jobs that begin meanwhile.
_GLANCE, _AGAIN = 0.1, 1.0
# Seconds between the reports of a job, and the time for another process that wrote the same file to end.
REPORTS, PATIENCE = 1.0, 30.0
# "state": "done", "stopped" or "failed"; "error" of a failure; "lost" if the worker returned no outcome.
JobEnd = dict[str, Any]
Tell = Callable[[dict[str, Any]], None]


class Reporter(NamedTuple):
    """The connection of a job to its fleet: the fleet's token, the function for messages, and seconds between them."""

    token: str
    tell: Tell
    every: float

    def display(self) -> "Display":
        """Return the display of a run that reports its progress and its compilation."""
        from ..run.progress import Display

        last = -math.inf

        def within(moment: float, until: float) -> None:
            nonlocal last
            now = time.monotonic()
            if now - last >= self.every:
                last = now
                self.tell({"share": moment / until})

        return Display(
            lambda frame: within(frame.time, frame.until),
            within,
            REPORTS,
            lambda sentence: self.tell({"compiling": sentence}),
        )


class FleetJob(NamedTuple):
    """A function that a worker calls with a `Reporter` and the arguments; it returns further entries of its outcome."""

    number: int
    work: Callable[..., JobEnd]
    arguments: tuple[Any, ...]


# --- On the worker --------------------------------------------------------------------------------------

# The sessions of the runs that are under way in this process, by fleet, and the fleets that were stopped.
_sessions: "dict[str, set[Session]]" = {}
_stopped: set[str] = set()


def carried_out(
    work: Callable[..., JobEnd],
    arguments: tuple[Any, ...],
    token: str = "",
    tell: Tell = lambda message: None,
    every: float = REPORTS,
) -> JobEnd:
    """Carry out a job and return its outcome; only unexpected errors are raised."""
    began = time.monotonic()
    if token in _stopped:
        return {"state": "stopped"}
    try:
        return {"state": "done", **work(Reporter(token, tell, every), *arguments)}
    except KeyboardInterrupt:
        return {"state": "stopped"}
    except SwarmError as error:
        return {"state": "failed", "error": str(error), "wall_time": time.monotonic() - began}


@contextlib.contextmanager
def session_of(options: "RunOptions", token: str) -> "Iterator[Session]":
    """Return a session that ends at a request to stop its fleet."""
    from ..run.session import Session

    session = Session(options)
    _sessions.setdefault(token, set()).add(session)
    try:
        if token in _stopped:
            session.stop()
        yield session
    finally:
        _sessions[token].discard(session)


def stop(token: str) -> None:
    """Make the runs of a fleet in this process save their checkpoints and end, and let no more of them begin."""
    _stopped.add(token)
    stop_present(token)


def stop_present(token: str) -> None:
    """Make the present runs of a fleet in this process save their checkpoints and end."""
    for session in _sessions.get(token, set()).copy():
        session.stop()


# --- On the side of the caller --------------------------------------------------------------------------


class Stop:
    """A request to begin no more jobs and to end the present ones with a checkpoint; `reason` is the first, or ""."""

    reason = ""

    def because(self, reason: str) -> None:
        """Request to stop, for a reason."""
        self.reason = self.reason or reason

    def interrupt(self) -> None:
        """Request to stop because of a signal."""
        self.because("interrupted")


class Fleet(ABC):
    """Workers that carry out jobs until `stop` has a reason; they end with the context."""

    def __init__(self, stop: Stop) -> None:
        self.token = secrets.token_hex(8)
        self._stop = stop
        # The progress of each job under way, from 0 to 1.
        self.shares: dict[int, float] = {}
        self._sentences: list[str] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def run(self, jobs: Iterable[FleetJob], ended: Callable[[int, JobEnd], None], glance: Callable[[], None]) -> None:
        """Carry out jobs; `ended` gets the outcome of each, and `glance` is called a few times a second."""
        left, under_way, asked = iter(jobs), dict[Future[JobEnd], FleetJob](), -math.inf
        while True:
            room = self.room()
            while not self._stop.reason and len(under_way) < room and (job := next(left, None)) is not None:
                self.shares[job.number] = 0.0
                under_way[self.submit(job)] = job
            glance()
            if not under_way:
                return
            done, _running = wait(under_way, _GLANCE, FIRST_COMPLETED)
            self.hear()
            for future in done:
                job = under_way.pop(future)
                ended(job.number, self._outcome(job, future))
                del self.shares[job.number]
            if under_way and self._stop.reason and time.monotonic() >= asked + _AGAIN:
                asked = time.monotonic()
                self.ask_to_stop()

    def _outcome(self, job: FleetJob, future: "Future[JobEnd]") -> JobEnd:
        try:
            outcome = future.result()
        except Exception as error:  # of the job, or of the executor that has lost it
            return {"state": "failed", "error": self.sentence_of(job, error), "lost": True}
        if outcome["state"] == "stopped" and not self._stop.reason:
            return {"state": "failed", "error": "its process got SIGTERM; a resumed session goes on with it"}
        return outcome

    def take(self, number: int, message: dict[str, Any]) -> None:
        """Note a report of a job."""
        if "share" in message and number in self.shares:
            self.shares[number] = message["share"]
        if "compiling" in message:
            self._sentences.append(message["compiling"])

    def new_sentences(self) -> list[str]:
        """Return the jobs' sentences about their compilation since the last call."""
        new, self._sentences = self._sentences, []
        return new

    @abstractmethod
    def room(self) -> float:
        """Return the largest number of jobs under way."""

    @abstractmethod
    def submit(self, job: FleetJob) -> "Future[JobEnd]":
        """Hand out a job."""

    @abstractmethod
    def hear(self) -> None:
        """Take the new reports."""

    @abstractmethod
    def ask_to_stop(self) -> None:
        """Ask the workers to stop their jobs."""

    @abstractmethod
    def sentence_of(self, job: FleetJob, error: Exception) -> str:
        """Return the reason why the worker of a job returned no outcome."""

    @abstractmethod
    def close(self) -> None:
        """End the workers that the fleet started, and the jobs under way."""
