"""The connection to a cluster: its client, checks of its workers, and the fleet of its workers."""

import os
import re
import secrets
import socket
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, Future
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from ..common.extras import needed_by
from ..errors import SceneError
from . import jobs

# Timeouts [s] for the answer of a scheduler, and for its first worker.
SCHEDULER, WORKER = 10.0, 60.0
_GLANCE = 0.05
# The time until a file of another machine appears [s], which network file systems show with a delay.
APPEARS = 10.0
# The largest number of reports of all jobs in a second, so that the scheduler has little to do.
_MOST_REPORTS = 100
# Jobs that are handed out at the same time, for each thread: one waits at the worker while another runs.
_HANDED_OUT = 2
# Packages with the same version everywhere: an object that is pickled here is read there.
_PACKAGES = ("swarm", "numba", "numpy")
_LOCAL = re.compile(r"local:([1-9]\d{0,3})")
_ADDRESS = re.compile(r"[a-z][a-z+]*://.+")


def require_known(cluster: Any) -> None:
    """Raise a SceneError unless it is "local:N", the address of a scheduler, or a client of one."""
    known = bool(_LOCAL.fullmatch(cluster) or _ADDRESS.fullmatch(cluster)) if isinstance(cluster, str) else (
        hasattr(cluster, "submit") and hasattr(cluster, "scheduler_info")
    )  # fmt: skip
    if not known:
        raise SceneError(
            'cluster must be "local:N", for N workers on this machine, the address of a scheduler, such as '
            f'"tcp://10.0.0.1:8786", or a distributed.Client, got {cluster!r:.100}'
        )


@contextmanager
def connected(cluster: Any, stop: jobs.Stop) -> Iterator[Any]:
    """Connect to a cluster that has a worker; return its client. Processes that are started here end with the context.

    Raises:
        KeyboardInterrupt: `stop` has a reason before there is a worker.
        SceneError: `distributed` is not installed, the scheduler does not answer, or it has no worker.
    """
    require_known(cluster)
    with needed_by("a cluster", "cluster"):
        from distributed import Client

    with ExitStack() as stack:
        address = cluster
        if isinstance(cluster, str):
            workers = 1
            if found := _LOCAL.fullmatch(cluster):
                from .local import started

                workers = int(found[1])
                address = stack.enter_context(started(workers))
            try:
                client = stack.enter_context(Client(address, timeout=SCHEDULER, set_as_default=False))
            except (OSError, ValueError) as error:  # TimeoutError is an OSError
                raise SceneError(
                    f"the scheduler {address} must answer within {SCHEDULER:g} s, got no answer; check that it runs, "
                    "and that this machine can reach it"
                ) from error
        else:
            client, workers = cluster, 1
            if client.asynchronous:
                raise SceneError("cluster must be a client that is not asynchronous, got one; make a Client(address)")
        _wait_for_workers(client, workers, stop)
        yield client


def _wait_for_workers(client: Any, workers: int, stop: jobs.Stop) -> None:
    latest = time.monotonic() + WORKER
    while (have := len(client.scheduler_info(n_workers=-1)["workers"])) < workers:
        if stop.reason:
            raise KeyboardInterrupt
        if time.monotonic() >= latest:
            raise SceneError(
                f"the scheduler {client.scheduler.address} must have {workers} worker{'s'[: workers - 1]} within "
                f"{WORKER:g} s, got {have}; start workers: dask worker {client.scheduler.address}"
            )
        time.sleep(_GLANCE)


def require_same_versions(client: Any) -> None:
    """Raise a SceneError that names the worker with another Python, swarm, Numba or NumPy."""
    found = client.get_versions(packages=list(_PACKAGES))
    here = _versions(found["client"])
    for address, versions in sorted(found["workers"].items()):
        for name, version in _versions(versions).items():
            if version != here[name]:
                came = "has none" if version is None else f"has {version}"
                raise SceneError(
                    f"every worker must have {name} {here[name]}, as this machine has, got the worker {address}, which "
                    f"{came}; install the same packages there"
                )


def _versions(found: dict[str, Any]) -> dict[str, str | None]:
    python = ".".join(found["host"]["python"].split(".")[:2])
    return {"Python": python, **{name: found["packages"].get(name) for name in _PACKAGES}}


def require_shared(client: Any, folder: Path) -> None:
    """Raise a SceneError that names the worker which does not read and write the folder that the client does."""
    token = secrets.token_hex(8)
    asked = folder / _storage_file(token)
    asked.write_text(token)
    try:
        for address, answer in sorted(client.run(_answer, str(folder), token).items()):
            written = folder / answer
            if not answer or not _appears(written):
                wrong = "finds what this machine writes, not the other way" if answer else "does not find it"
                raise SceneError(
                    f"all workers must share the folder {folder} with this machine, got the worker {address}, which "
                    f"{wrong}; write to storage that all of them have mounted at the same place"
                )
            written.unlink(missing_ok=True)
    finally:
        asked.unlink(missing_ok=True)


def require_read(client: Any, files: Iterable[Path]) -> None:
    """Raise a SceneError that names a file that a worker does not find, and the worker."""
    for address, missing in sorted(client.run(_missing, [str(file) for file in files]).items()):
        if missing:
            raise SceneError(
                f"all workers must read the files that the scene names, got the worker {address}, which does not find "
                f"{missing}; move it to storage that all of them have mounted at the same place"
            )


class Workers(jobs.Fleet):
    """The workers of a cluster. Dask replaces those that die, and hands their jobs out again.

    Args:
        client: the client of the cluster.
        stop: as for `Fleet`.
        count: the number of jobs that are all handed out at once; None: as many as the workers have room for.
    """

    def __init__(self, client: Any, stop: jobs.Stop, count: int | None = None) -> None:
        super().__init__(stop)
        self._client, self._count = client, count
        # A job is not pure: Dask must not reuse the outcome of another job with the same arguments.
        self._executor = client.get_executor(pure=False)
        self._reports: list[tuple[int, dict[str, Any]]] = []
        client.subscribe_topic(self.token, self._note)

    async def _note(self, event: tuple[float, tuple[int, dict[str, Any]]]) -> None:
        """Note a report, in the thread of the client."""
        self._reports.append(event[1])

    def room(self) -> float:
        """The number of jobs that may be handed out: `count`, or a few for each thread of the present workers."""
        return self._count or _HANDED_OUT * threads_of(self._client)

    def submit(self, job: jobs.FleetJob) -> "Future[jobs.JobEnd]":
        """Hand out a job."""
        every = max(jobs.REPORTS, self.room() / _MOST_REPORTS)
        made: Future[jobs.JobEnd] = self._executor.submit(_work, job.work, job.arguments, self.token, job.number, every)
        return made

    def hear(self) -> None:
        """Take the new reports."""
        while self._reports:
            self.take(*self._reports.pop(0))

    def ask_to_stop(self) -> None:
        """Ask all workers to stop their jobs; workers that have died are left out."""
        self._client.run(jobs.stop, self.token, on_error="ignore")

    def sentence_of(self, job: jobs.FleetJob, error: Exception) -> str:
        """Return the reason why Dask returned no outcome."""
        if isinstance(error, CancelledError):
            return "the scheduler has lost it; it can be resumed"
        if type(error).__name__ == "KilledWorker":
            about: Any = error
            return (
                f"each of the {about.allowed_failures + 1} workers that took it has died, last "
                f"{about.last_worker.address}, perhaps for lack of memory; see their logs; it can be resumed"
            )
        return f"unexpected {type(error).__name__}: {error}"

    def close(self) -> None:
        """Let the scheduler forget the jobs that have not ended."""
        self._client.unsubscribe_topic(self.token)
        self._executor.shutdown(wait=False)


def threads_of(client: Any) -> int:
    """The number of threads of all workers."""
    return sum(one["nthreads"] for one in client.scheduler_info(n_workers=-1)["workers"].values())


# --- On a worker ----------------------------------------------------------------------------------------


def _work(
    work: Callable[..., jobs.JobEnd], arguments: tuple[Any, ...], token: str, number: int, every: float
) -> jobs.JobEnd:
    from distributed import get_worker

    worker = get_worker()
    key = worker.get_current_task()

    def tell(message: dict[str, Any]) -> None:
        task = worker.state.tasks.get(key)
        if task is None or task.state == "cancelled":
            # The client was killed: no process waits for the outcome, and a later session needs the files.
            jobs.stop_present(token)
        worker.log_event(token, (number, message))

    return jobs.carried_out(work, arguments, token, tell, every)


def _answer(folder: str, token: str) -> str:
    """Read the client's file in the folder, and write a copy there; return its name, or "" if the file is missing."""
    asked, name = Path(folder) / _storage_file(token), ""
    if _appears(asked):
        name = _storage_file(f"{token}.{socket.gethostname()}.{os.getpid()}")
        with suppress(OSError):
            (Path(folder) / name).write_text(asked.read_text())
    return name


def _missing(files: list[str]) -> str:
    """The first of these files that does not exist, or ""."""
    return next((file for file in files if not _appears(Path(file))), "")


def _storage_file(token: str) -> str:
    """The name of a file that shows whether storage is shared."""
    return f".swarm-storage.{token}"


def _appears(path: Path) -> bool:
    """Whether a file exists, now or within `APPEARS` seconds."""
    latest = time.monotonic() + APPEARS
    while not path.exists() and time.monotonic() < latest:
        time.sleep(_GLANCE)
    return path.exists()
