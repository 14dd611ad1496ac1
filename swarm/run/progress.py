"""The progress display of a run: a bar on a terminal, else a line a minute."""

import contextlib
import math
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

# ETA and speed come from the last seconds only: compile time would spoil an average from the start.
_WINDOW = 10.0
# Seconds from one plain line to the next, and from one change of the bar to the next within a long frame.
_A_MINUTE, _A_MOMENT = 60.0, 1.0


def _nothing(*_args: Any) -> None:
    """Shows nothing."""


@dataclass(frozen=True)
class Display:
    """The observers of a run.

    Args:
        frame: is called with every frame.
        within: is called with the time that the particles have reached on average on the way to the next frame, and
            the time of the end.
        every: seconds of wall time from one such call to the next.
        compiling: is called with a sentence before a kernel is compiled.
    """

    frame: Callable[[Any], None]
    within: Callable[[float, float], None] = _nothing
    every: float = math.inf
    compiling: Callable[[str], None] = _nothing


@contextlib.contextmanager
def display(progress: bool | Callable[[Any], None] | Display) -> Iterator[Display]:
    """Nothing, the caller's own function or display, or a bar or lines on standard error."""
    if isinstance(progress, Display):
        yield progress
    elif callable(progress):
        # It gets a copy of the observables, which it may change.
        yield Display(lambda frame: progress(frame.apart()))
    elif not progress:
        yield Display(_nothing)
    elif sys.stderr.isatty():
        with _bar() as bar:
            yield bar
    else:
        yield lines(_A_MINUTE)


@contextlib.contextmanager
def _bar() -> Iterator[Display]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns = (
        BarColumn(bar_width=24),
        TextColumn("{task.percentage:3.0f}%"),
        TextColumn("{task.fields[line]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0, line="")

        def put(share: float, line: str) -> None:
            bar.update(task, completed=share, line=line)

        def compiling(sentence: str) -> None:
            bar.update(task, line=sentence, refresh=True)

        yield _put_by(put, _A_MOMENT, compiling)


def lines(interval: float) -> Display:
    """Print a line when the last one is `interval` seconds old."""
    last = time.monotonic()

    def put(share: float, line: str) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= interval:
            print(f"{100.0 * share:.1f}%  {line}", file=sys.stderr, flush=True)
            last = now

    def compiling(sentence: str) -> None:
        print(sentence, file=sys.stderr, flush=True)

    return _put_by(put, interval, compiling)


def _put_by(put: Callable[[float, str], None], every: float, compiling: Callable[[str], None]) -> Display:
    """A display of the share that is done, and of a line about the last seconds."""
    recent = _Recent()

    def frame(done: Any) -> None:
        line = recent.frame(done)
        if done.number > 0:  # the first frame is the start: kernels compile after it
            put(done.time / done.until, line)

    def within(moment: float, until: float) -> None:
        put(moment / until, recent.within(moment, until))

    return Display(frame, within, every, compiling)


class _Recent:
    """The last seconds of a run."""

    def __init__(self) -> None:
        self._moments: deque[tuple[float, float]] = deque()
        self._impacts: deque[tuple[float, float]] = deque()
        self._energy = ""

    def frame(self, frame: Any) -> str:
        """Time, ETA, speed and energy error after this frame."""
        self._energy = f"  energy error {frame.observables['energy_error']:.1e}"
        if frame.number == 0:
            return ""
        _note(self._impacts, frame.observables["impacts"])
        return self.within(frame.time, frame.until)

    def within(self, moment: float, until: float) -> str:
        """The same within a frame, with speed and energy error of the last one."""
        elapsed, advanced = _note(self._moments, moment)
        line = f"{moment:.4g}/{until:.4g} s"
        if elapsed > 0.0 and advanced > 0.0:
            left = int(elapsed * (until - moment) / advanced)
            line += f"  ETA {left // 3600}:{left // 60 % 60:02}:{left % 60:02}"
        if len(self._impacts) > 1:
            (before, few), (after, many) = self._impacts[0], self._impacts[-1]
            line += f"  {(many - few) / (after - before):.3g} impacts/s" if after > before else ""
        return line + self._energy


def _note(values: deque[tuple[float, float]], value: float) -> tuple[float, float]:
    """Add a value, drop those before the window: (seconds, difference) from the first to the last."""
    now = time.perf_counter()
    values.append((now, value))
    while len(values) > 2 and now - values[0][0] > _WINDOW:
        values.popleft()
    return now - values[0][0], value - values[0][1]
