"""A fleet of processes of this machine, by loky.

Each process is an executor of its own: loky ends all processes of an executor in which one dies. Unlike the processes
of `multiprocessing` they do not import the caller's script again, which would fail for a notebook or a script without
`if __name__ == "__main__"`.
"""

import contextlib
import multiprocessing
import os
import re
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from ..common import interrupt
from ..errors import RunError
from . import jobs

# The exit code of a worker without a parent.
_ORPHANED = 3
# The number of last bytes of a dead process's output that its sentence has.
_LAST = 2000
# With this variable no module of the current folder takes the place of one of Python's own.
_SAFE = {"PYTHONSAFEPATH": "1"}
_READY = {"ready": True}
# The end of loky's message about a worker that died.
_EXIT = re.compile(r"exit codes of the workers are \{(\w+)\((-?\d+)\)\}")


class Processes(jobs.Fleet):
    """At most `number` processes, each of which starts when a job needs it.

    Args:
        stop: as for `Fleet`.
        number: the largest number of processes.
        first: a process among them that may have started; None: it starts when a job needs it.
    """

    def __init__(self, stop: jobs.Stop, number: int, first: "Place | None" = None) -> None:
        super().__init__(stop)
        self._places = [first or Place(), *(Place() for _ in range(number - 1))]

    def room(self) -> float:
        """The number of processes: each has one job."""
        return len(self._places)

    def submit(self, job: jobs.FleetJob) -> "Future[jobs.JobEnd]":
        """Hand out a job, to a free process that has started if there is one."""
        free = [place for place in self._places if place.job not in self.shares]
        place = next((one for one in free if one.executor is not None), free[0])
        return place.submit(job, self.token)

    def hear(self) -> None:
        """Take the new reports."""
        for place in self._places:
            for message in place.messages():
                self.take(place.job, message)

    def ask_to_stop(self) -> None:
        """Ask the processes to stop their jobs."""
        for place in self._places:
            place.tell(self.token)

    def sentence_of(self, job: jobs.FleetJob, error: Exception) -> str:
        """Return the reason why a process returned no outcome.

        Raises:
            RunError: the process did not start.
        """
        place = next(place for place in self._places if place.job == job.number)
        if not isinstance(error, BrokenExecutor):
            return f"unexpected {type(error).__name__}: {error}"
        self.hear()
        message, ready = place.death(str(error)), place.ready
        place.close()
        if not ready and not self._stop.reason:
            raise RunError(f"a worker process did not start: {message}")
        return message

    def close(self) -> None:
        """End all processes at once: the files of a run survive an end at any moment."""
        for place in self._places:
            place.close()


class Place:
    """A process, or the place for one; its output goes to a file."""

    def __init__(self) -> None:
        self.executor: Any = None
        self.job, self.ready = -1, False

    def start(self) -> None:
        """Start the process, which imports the modules for its jobs while the caller does."""
        self._make()
        with _without_interrupts():
            self.executor.submit(os.getpid)

    def submit(self, job: jobs.FleetJob, token: str) -> "Future[jobs.JobEnd]":
        """Hand out a job; if the process has died, the future raises that."""
        self.job = job.number
        if self.executor is None:
            self._make()
        os.truncate(self._printed, 0)
        made: Future[jobs.JobEnd]
        try:
            with _without_interrupts():
                made = self.executor.submit(_work, job.work, job.arguments, token)
        except BrokenExecutor as error:
            made = Future()
            made.set_exception(error)
        return made

    def _make(self) -> None:
        """Create the executor; its process begins with its first job."""
        from multiprocessing import resource_tracker

        import loky
        from loky.backend import resource_tracker as tracker_of_loky

        # loky would start its helper processes with the first worker, and unblock interrupts.
        with _safe_path():
            resource_tracker.ensure_running()
            tracker_of_loky.ensure_running()
        self.ready = False
        descriptor, name = tempfile.mkstemp(prefix="swarm-")
        os.close(descriptor)
        self._printed = Path(name)
        # The process's end of the pipe stays open here: loky may replace a process that has grown much.
        self._line, self._far_end = multiprocessing.Pipe()
        self.executor = loky.ProcessPoolExecutor(
            1, initializer=_begin, initargs=(self._far_end, self._printed), env=_SAFE
        )

    def messages(self) -> Iterator[dict[str, Any]]:
        """Yield the messages that have come from the process."""
        while self.executor is not None and self._line.poll():
            message = self._line.recv()
            self.ready = self.ready or message == _READY
            if message != _READY:
                yield message

    def tell(self, token: str) -> None:
        """Ask the process to stop the jobs of a fleet."""
        if self.executor is not None:
            with contextlib.suppress(OSError):  # a dead process, which its future reports
                self._line.send(token)

    def death(self, message: str) -> str:
        """Describe the end of the process in a sentence."""
        printed = self._printed.read_bytes()[-_LAST:].decode(errors="replace").strip().splitlines()
        last = f"; the last that it printed: {printed[-1]}" if printed else ""
        found = _EXIT.search(message)
        if found is None:
            return f"its process has died{last}"
        name, code = found[1], int(found[2])
        if code >= 0:
            return f"its process ended with the exit code {code}{last}"
        why = ", as the system does where memory is short (fewer processes need less)" if name == "SIGKILL" else ""
        return f"its process was ended by {name}{why}{last}"

    def close(self) -> None:
        """End the process at once."""
        if self.executor is not None:
            self.executor.shutdown(wait=True, kill_workers=True)
            self.executor = None
            self._line.close()
            self._far_end.close()
            _remove(self._printed)


@contextlib.contextmanager
def _safe_path() -> Iterator[None]:
    """Start processes that find no modules in the current folder."""
    before = {name: os.environ.get(name) for name in _SAFE}
    os.environ.update(_SAFE)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextlib.contextmanager
def _without_interrupts() -> Iterator[None]:
    """Start processes that Ctrl-C in a terminal does not reach: they inherit the blocked signals."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _remove(printed: Path) -> None:
    """Remove the output file of a process; this fails on Windows while the process has it open."""
    with contextlib.suppress(OSError):
        printed.unlink()


# --- In the process -------------------------------------------------------------------------------------

_line: Any = None


def _begin(line: "Connection[Any, Any]", printed: Path) -> None:
    """Prepare the process: it takes requests to stop, and ends with its parent."""
    global _line
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # The output of Python and libraries; also the last words of a process that crashes.
    out = os.open(printed, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    for stream in (1, 2):
        os.dup2(out, stream)
    _line = line
    threading.Thread(target=_listen, args=(line, printed), daemon=True).start()
    with contextlib.suppress(OSError):  # the parent has ended, which the other thread notices too
        line.send(_READY)
    with interrupt.importing():
        from . import sweep_run  # noqa: F401  the modules of the jobs


def _listen(line: "Connection[Any, Any]", printed: Path) -> None:
    with contextlib.suppress(OSError, EOFError):
        while True:
            jobs.stop(line.recv())
    # The parent has ended: no process waits for the outcome. The files of a run survive an end at any moment, and their
    # locks are free for the sweep that goes on with them.
    _remove(printed)
    os._exit(_ORPHANED)


def _work(work: Callable[..., jobs.JobEnd], arguments: tuple[Any, ...], token: str) -> jobs.JobEnd:
    return jobs.carried_out(work, arguments, token, _line.send)
