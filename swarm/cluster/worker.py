"""The work of a worker: one shard, from its start or from its checkpoint; and what the client asks of a worker."""

import contextlib
import dataclasses
import functools
import os
import socket
import time
from collections.abc import Callable
from pathlib import Path

from ..errors import SwarmError
from ..files import paths
from ..files.lock import only_writer
from ..run import machine
from ..run.progress import Display
from ..run.session import Session
from . import shards

# Reports of all shards in a second, so that the scheduler has little to do.
_MOST_REPORTS = 100
# Seconds from one report to the next; until a lock is given up and a file, which network file systems release and show
# after a while; and from one look at them to the next.
_REPORTS, _PATIENCE, APPEARS, _GLANCE = 1.0, 30.0, 10.0, 0.1
# The sessions of the shards that run in this process, by their run; and the runs that were stopped.
_sessions: dict[str, set[Session]] = {}
_stopped: set[str] = set()

# Time that a shard has reached [s], and the time of the end.
Report = Callable[[float, float], None]
# What a shard compiles.
Tell = Callable[[str], None]


def run(folder: str, k: int, token: str) -> tuple[str, str]:
    """Run shard k: ("complete" or "stopped", ""), or ("failed", its sentence). A task of Dask."""
    from distributed import get_worker

    tell = functools.partial(get_worker().log_event, token)

    def report(moment: float, until: float) -> None:
        tell({"shard": k, "share": moment / until})

    return advance(Path(folder), k, token, report, lambda sentence: tell({"compiling": sentence}))


def advance(
    folder: Path,
    k: int,
    token: str = "",
    report: Report = lambda moment, until: None,
    compiling: Tell = lambda said: None,
) -> tuple[str, str]:
    """`run`, also without Dask."""
    if shards.end_of(folder, k).exists():
        return "complete", ""
    if token in _stopped:
        return "stopped", ""
    task, count = shards.task_of(folder, k)
    target = task.options.trajectory
    resumes = paths.checkpoint_of(target).exists()
    options = dataclasses.replace(
        task.options, progress=_reporting(report, count, compiling), resume=resumes, overwrite=not resumes, threads=1
    )
    session = Session(options)
    _sessions.setdefault(token, set()).add(session)
    try:
        # The system of a worker that died may still hold it.
        with only_writer(target, patience=_PATIENCE):
            pass
        end = machine.carry_out_task(dataclasses.replace(task, options=options), session)
        shards.write_end(shards.end_of(folder, k), end)
    except KeyboardInterrupt:
        return "stopped", ""
    except SwarmError as error:
        return "failed", str(error)
    finally:
        _sessions[token].discard(session)
    return "complete", ""


def _reporting(report: Report, shards_at_once: int, compiling: Tell) -> Display:
    """A display that reports now and then."""
    every = max(_REPORTS, shards_at_once / _MOST_REPORTS)
    last = -every

    def within(moment: float, until: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= every:
            last = now
            report(moment, until)

    return Display(lambda frame: within(frame.time, frame.until), within, _REPORTS, compiling)


def stop(token: str) -> int:
    """Let the shards of a run on this worker save their checkpoints and end; how many are under way."""
    _stopped.add(token)
    sessions = _sessions.get(token, set()).copy()
    for session in sessions:
        session.stop()
    return len(sessions)


def answer(folder: str, token: str) -> str:
    """Read what the client wrote into the folder, and write the same there under the name that is returned."""
    asked, name = Path(folder) / storage_file(token), ""
    if appears(asked):
        name = storage_file(f"{token}.{socket.gethostname()}.{os.getpid()}")
        with contextlib.suppress(OSError):
            (Path(folder) / name).write_text(asked.read_text())
    return name


def storage_file(token: str) -> str:
    """The name of a file that shows whether storage is shared."""
    return f".swarm-storage.{token}"


def appears(path: Path) -> bool:
    """Whether a file is there, now or a little later."""
    latest = time.monotonic() + APPEARS
    while not path.exists() and time.monotonic() < latest:
        time.sleep(_GLANCE)
    return path.exists()
