"""The progress display of a run: a bar on a terminal, else a line a minute."""

import contextlib
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

# ETA and speed come from the last seconds only: compile time would spoil an average from the start.
_WINDOW = 10.0
# Seconds from one plain line to the next.
_A_MINUTE = 60.0


@contextlib.contextmanager
def display(progress: bool | Callable[[Any], None]) -> Iterator[Callable[[Any], None]]:
    """A function to call with every frame: nothing, the caller's own, or a bar or lines on standard error."""
    if callable(progress):
        yield progress
    elif not progress:
        yield lambda frame: None
    elif sys.stderr.isatty():
        with _bar() as show:
            yield show
    else:
        yield lines(_A_MINUTE)


@contextlib.contextmanager
def _bar() -> Iterator[Callable[[Any], None]]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns = (
        BarColumn(bar_width=24),
        TextColumn("{task.percentage:3.0f}%"),
        TextColumn("{task.fields[line]}"),
    )
    recent = _Recent()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0, line="compiling (the next run will not)")

        def show(frame: Any) -> None:
            if frame.number > 0:  # the first frame is the start: kernels compile after it
                bar.update(task, completed=frame.time / frame.until, line=recent.line(frame))

        yield show


def lines(interval: float) -> Callable[[Any], None]:
    """A function that prints a frame's line if the last one is `interval` seconds old."""
    recent, last = _Recent(), time.monotonic()

    def show(frame: Any) -> None:
        nonlocal last
        if frame.number == 0:
            return
        line, now = recent.line(frame), time.monotonic()
        if now - last >= interval:
            print(f"{100.0 * frame.time / frame.until:.1f}%  {line}", file=sys.stderr, flush=True)
            last = now

    return show


class _Recent:
    """The frames of the last seconds."""

    def __init__(self) -> None:
        self._frames: deque[tuple[float, float, int]] = deque()

    def line(self, frame: Any) -> str:
        """Time, ETA, speed and energy error, now that this frame is done."""
        recent, now = self._frames, time.perf_counter()
        recent.append((now, frame.time, frame.observables["impacts"]))
        while len(recent) > 2 and now - recent[0][0] > _WINDOW:
            recent.popleft()
        line = f"{frame.time:.4g}/{frame.until:.4g} s"
        elapsed, advanced = now - recent[0][0], frame.time - recent[0][1]
        if elapsed > 0.0 and advanced > 0.0:
            left = int(elapsed * (frame.until - frame.time) / advanced)
            rate = (recent[-1][2] - recent[0][2]) / elapsed
            line += f"  ETA {left // 3600}:{left // 60 % 60:02}:{left % 60:02}  {rate:.3g} impacts/s"
        return line + f"  energy error {frame.observables['energy_error']:.1e}"
