"""The parent's side of a worker: its process, the orders to it and what comes back."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from typing import Any

from ..errors import RunError

# Of what a process printed before it died, a sentence has so many bytes.
_LAST = 2000
_WORKER = "import json, sys; sys.path[:] = json.loads(sys.argv.pop()); from swarm.ensemble.worker import main; main()"


class Hand:
    """A worker process, which carries out one run after the other.

    Raises:
        RunError: the process cannot be started.
    """

    def __init__(self) -> None:
        # Packages are found where this process finds them, but none of Python's own in the current folder (-P).
        command = [sys.executable, "-P", "-c", _WORKER, json.dumps([str(place) for place in sys.path])]
        self._writing = threading.Lock()  # of the thread that hands out runs, and the one that stops them
        self._printed = tempfile.TemporaryFile("a+b")  # noqa: SIM115  closed by `close`
        try:
            self._process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._printed, encoding="utf-8"
            )
        except OSError as error:
            self._printed.close()
            raise RunError(f"a worker process cannot be started: {error}") from error
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._orders, self._messages = self._process.stdin, self._process.stdout

    def is_alive(self) -> bool:
        """Whether the process runs."""
        return self._process.poll() is None

    def wait_until_ready(self) -> None:
        """Wait for the process to have imported the package; a RunError if it died."""
        if self._read() is None:
            raise RunError(f"a worker process did not start: {self._death()}")

    def carry_out(self, order: dict[str, Any], tell: Callable[[dict[str, Any]], None]) -> dict[str, Any]:
        """The outcome of a run; `tell` gets every message before it."""
        self._printed.truncate(0)
        with contextlib.suppress(OSError):  # it has died: there is nothing to read either
            self._write(order)
        while (message := self._read()) is not None:
            if "ended" in message:
                return dict(message["ended"])
            tell(message)
        return {"state": "failed", "error": self._death(), "wall_time": None, "observables": {}}

    def stop(self) -> None:
        """Let its run end with a checkpoint."""
        with contextlib.suppress(OSError, ValueError):
            self._write("stop")

    def kill(self) -> None:
        """End the process at once."""
        self._process.kill()

    def close(self) -> None:
        """Let the process end, which has no run."""
        for pipe in (self._orders, self._messages):
            with contextlib.suppress(OSError):
                pipe.close()
        self._process.wait()
        self._printed.close()

    def _write(self, message: Any) -> None:
        with self._writing:
            self._orders.write(json.dumps(message) + "\n")
            self._orders.flush()

    def _read(self) -> dict[str, Any] | None:
        """The next message; None when the process has ended."""
        try:
            return dict(json.loads(self._messages.readline()))
        except (OSError, ValueError):  # the end, or half of a line
            return None

    def _death(self) -> str:
        """The end of the process, in a sentence."""
        code = self._process.wait()
        size = self._printed.seek(0, os.SEEK_END)
        self._printed.seek(max(0, size - _LAST))
        printed = self._printed.read().decode(errors="replace").strip().splitlines()
        last = f"; the last that it printed: {printed[-1]}" if printed else ""
        if code >= 0:
            return f"its process ended with the exit code {code}{last}"
        name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
        why = ", as the system does where memory is short (fewer processes need less)" if name == "SIGKILL" else ""
        return f"its process was ended by {name}{why}{last}"
