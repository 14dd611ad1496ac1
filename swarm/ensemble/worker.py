"""A process that carries out runs of a sweep: orders come as lines of JSON on standard input, outcomes go back so.

It is no child of `multiprocessing`, which would import the caller's script once more in each process: a script without
`if __name__ == "__main__"` and a notebook would not do.
"""

import _thread
import contextlib
import dataclasses
import json
import os
import queue
import signal
import threading
import time
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..scene_file import Job

# The exit code of a worker whose parent is gone.
_ORPHANED = 3
# Seconds to wait for the lock of a worker that ends because its parent was killed.
_OTHERS_END = 10.0
# Seconds from one report of a run to the next.
_A_MOMENT = 1.0


class _Line:
    """The connection to the parent."""

    def __init__(self) -> None:
        # What libraries print must not come between the lines: it goes to standard error.
        self._out = os.fdopen(os.dup(1), "w", encoding="utf-8")
        self._in = os.fdopen(os.dup(0), "r", encoding="utf-8")
        os.dup2(2, 1)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        self.orders: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self.stops = threading.Event()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        for line in self._in:
            order = json.loads(line)
            if order == "stop":
                self.stops.set()
                self.interrupt()
            else:
                self.orders.put(order)
        # The parent has closed the pipe or was killed: no process waits for the outcome. The files of a run survive an
        # end at any moment, and their locks are free for the sweep that goes on with them.
        os._exit(_ORPHANED)

    def interrupt(self) -> None:
        """End a run that is under way as SIGTERM would; without such a run, do nothing."""
        if self.stops.is_set():
            _thread.interrupt_main(signal.SIGTERM)

    def send(self, **message: Any) -> None:
        try:
            self._out.write(json.dumps(message) + "\n")
            self._out.flush()
        except OSError:
            os._exit(_ORPHANED)


def main() -> None:
    """Carry out orders until standard input ends."""
    # Ctrl-C reaches all processes of a terminal; only the parent reacts to it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    line = _Line()
    from ..run import simulation  # noqa: F401  a second; then the parent knows that the package can be imported

    line.send(ready=True)
    while True:
        order = line.orders.get()
        began = time.monotonic()
        outcome = {"wall_time": None, "error": None, "observables": {}, **_outcome(order, line)}
        if outcome["wall_time"] is None and outcome["state"] == "failed":
            outcome["wall_time"] = time.monotonic() - began
        line.send(ended=outcome)


def _outcome(order: dict[str, Any], line: _Line) -> dict[str, Any]:
    from ..errors import SwarmError

    try:
        return _carried_out(order, line)
    except KeyboardInterrupt:
        return {"state": "stopped"}
    except SwarmError as error:
        return {"state": "failed", "error": str(error)}
    except Exception as error:  # the others must go on
        traceback.print_exc()
        return {"state": "failed", "error": f"unexpected {type(error).__name__}: {error}"}


def _carried_out(order: dict[str, Any], line: _Line) -> dict[str, Any]:
    """Carry out a run, or go on with it: from its checkpoint if it has one, else from the start."""
    from .. import scene_file
    from ..errors import SceneError
    from ..files import paths
    from ..files.lock import only_writer
    from ..serialization.plugins import allowed
    from .results import of_trajectory

    target, source, text = Path(order["trajectory"]), Path(order["source"]), order["text"]
    with only_writer(target, patience=_OTHERS_END):
        pass
    with allowed(order["plugins"]):
        job = scene_file.job_of(scene_file.document_of(text, source), text, source)
    if order["goes_on"] and target.exists():
        before = of_trajectory(target, job.run.until)
        if before is not None:
            paths.checkpoint_of(target).unlink(missing_ok=True)  # a kill came between the last frame and this
            return {"state": "done", "observables": before}
        if paths.checkpoint_of(target).exists():
            # A SceneError: it is damaged, or of another version. The run begins anew, and says what else is wrong.
            with contextlib.suppress(SceneError):
                return _simulated(job, order, line, resume=True)
    return _simulated(job, order, line, overwrite=True)


def _simulated(job: "Job", order: dict[str, Any], line: _Line, **how: Any) -> dict[str, Any]:
    from ..errors import SceneError
    from ..run.simulation import carry_out
    from .results import final

    options = dataclasses.replace(
        job.run,
        trajectory=order["trajectory"],
        impacts=order["impacts"],
        threads=job.run.threads or order["threads"],
        scene_text=job.text,
        progress=_display(line),
        **how,
    )
    try:
        result = carry_out(job.scene, job.start(), job.method, options)
    except SceneError as error:
        raise job.located(error) from None
    return {"state": "done", "observables": final(result.observables), "wall_time": result.wall_time}


def _display(line: _Line) -> Any:
    """Reports of the share that is done; a stop that came before the run took signals is repeated here."""
    from ..run.progress import Display

    told = time.monotonic()

    def put(share: float) -> None:
        nonlocal told
        line.interrupt()
        if time.monotonic() - told >= _A_MOMENT:
            told = time.monotonic()
            line.send(share=share)

    return Display(
        frame=lambda done: put(done.time / done.until),
        within=lambda moment, until: put(moment / until),
        every=_A_MOMENT,
        compiling=lambda sentence: line.send(compiling=sentence),
    )
