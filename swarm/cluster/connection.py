"""The connection to a cluster: its client, and what is checked of its workers before anything is written."""

import re
import secrets
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from ..common.extras import needed_by
from ..errors import SceneError
from . import worker

# Seconds until a scheduler must answer, and until it must have a worker.
SCHEDULER, WORKER = 10.0, 60.0
_GLANCE = 0.05
# What must be the same everywhere: an object that is pickled here is read there.
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
def connected(cluster: Any, stopped: threading.Event) -> Iterator[Any]:
    """A client of the cluster, which has a worker; what is started here ends with the context.

    Raises:
        KeyboardInterrupt: `stopped` was set before it has one.
        SceneError: `distributed` is not installed, the scheduler does not answer, it has no worker.
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
            except (OSError, ValueError) as error:  # among the first: TimeoutError
                raise SceneError(
                    f"the scheduler {address} must answer within {SCHEDULER:g} s, got no answer; check that it runs, "
                    "and that this machine can reach it"
                ) from error
        else:
            client, workers = cluster, 1
            if client.asynchronous:
                raise SceneError("cluster must be a client that is not asynchronous, got one; make a Client(address)")
        _wait_for_workers(client, workers, stopped)
        yield client


def _wait_for_workers(client: Any, workers: int, stopped: threading.Event) -> None:
    latest = time.monotonic() + WORKER
    while (have := len(client.scheduler_info(n_workers=-1)["workers"])) < workers:
        if stopped.is_set():
            raise KeyboardInterrupt
        if time.monotonic() >= latest:
            raise SceneError(
                f"the scheduler {client.scheduler.address} must have {workers} worker{'s'[: workers - 1]} within "
                f"{WORKER:g} s, got {have}; start workers: dask worker {client.scheduler.address}"
            )
        time.sleep(_GLANCE)


def require_same_versions(client: Any) -> None:
    """Raise a SceneError that names the worker whose Python, swarm, Numba or NumPy is another one."""
    found = client.get_versions(packages=list(_PACKAGES))
    here = _versions(found["client"])
    for address, versions in sorted(found["workers"].items()):
        for name, there in _versions(versions).items():
            if there != here[name]:
                came = "has none" if there is None else f"has {there}"
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
    asked = folder / worker.storage_file(token)
    asked.write_text(token)
    try:
        for address, answer in sorted(client.run(worker.answer, str(folder), token).items()):
            written = folder / answer
            if not answer or not worker.appears(written):
                wrong = "finds what this machine writes, not the other way" if answer else "does not find it"
                raise SceneError(
                    f"all workers must share the folder {folder} with this machine, got the worker {address}, which "
                    f"{wrong}; give a trajectory on storage that all of them have mounted at the same place"
                )
            written.unlink(missing_ok=True)
    finally:
        asked.unlink(missing_ok=True)
