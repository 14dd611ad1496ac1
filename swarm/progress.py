"""The progress display of a run."""

import contextlib
import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

# ETA and speed come from the last seconds only: compile time would spoil an average from the start.
_WINDOW = 10.0


@contextlib.contextmanager
def display(progress: bool | Callable[[Any], None]) -> Iterator[Callable[[Any], None]]:
    """A function to call with every frame: nothing, the caller's own, or a bar on the terminal."""
    if callable(progress):
        yield progress
    elif not progress:
        yield lambda frame: None
    else:
        with _bar() as show:
            yield show


@contextlib.contextmanager
def _bar() -> Iterator[Callable[[Any], None]]:
    from rich.progress import BarColumn, Progress, TextColumn

    columns = (
        BarColumn(bar_width=24),
        TextColumn("{task.percentage:3.0f}%"),
        TextColumn("{task.fields[line]}"),
    )
    recent: deque[tuple[float, float, int]] = deque()
    with Progress(*columns, transient=True) as bar:
        task = bar.add_task("", total=1.0, line="compiling (the next run will not)")

        def show(frame: Any) -> None:
            if frame.number == 0:
                return  # the first frame is the start: kernels compile after it
            now = time.perf_counter()
            recent.append((now, frame.time, frame.observables["impacts"]))
            while len(recent) > 2 and now - recent[0][0] > _WINDOW:
                recent.popleft()
            bar.update(task, completed=frame.time / frame.until, line=_line(frame, recent))

        yield show


def _line(frame: Any, recent: deque[tuple[float, float, int]]) -> str:
    line = f"{frame.time:.4g}/{frame.until:.4g} s"
    elapsed = recent[-1][0] - recent[0][0]
    advanced = recent[-1][1] - recent[0][1]
    if elapsed > 0.0 and advanced > 0.0:
        left = elapsed * (frame.until - frame.time) / advanced
        rate = (recent[-1][2] - recent[0][2]) / elapsed
        line += f"  ETA {int(left) // 3600}:{int(left) // 60 % 60:02}:{int(left) % 60:02}  {rate:.3g} impacts/s"
    return line + f"  energy error {frame.observables['energy_error']:.1e}"
