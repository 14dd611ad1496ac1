"""The progress display of a sweep: one bar for all runs on a terminal, else a line a minute."""

import contextlib
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator

from .pool import Progress

# Seconds from one line to the next, and those whose pace gives the ETA: several runs.
_A_MINUTE, _WINDOW = 60.0, 120.0
Show = Callable[[Progress], None]


@contextlib.contextmanager
def shown(progress: bool) -> Iterator[Show]:
    """A function that shows how far the runs are; without `progress` it shows nothing."""
    if not progress:
        yield lambda now: None
    elif sys.stderr.isatty():
        with _bar() as show:
            yield show
    else:
        yield lines(_A_MINUTE)


@contextlib.contextmanager
def _bar() -> Iterator[Show]:
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    columns = BarColumn(bar_width=24), TextColumn("{task.percentage:3.0f}%"), TextColumn("{task.fields[line]}")
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task, pace = bar.add_task("", total=1.0, line=""), _Pace()

        def show(now: Progress) -> None:
            if now.sentence:
                bar.console.print(now.sentence, highlight=False, markup=False)
            bar.update(task, completed=_share(now), line=pace.line(now))

        yield show


def lines(interval: float) -> Show:
    """Print a line when the last one is `interval` seconds old."""
    last, pace = time.monotonic(), _Pace()

    def show(now: Progress) -> None:
        nonlocal last
        line = pace.line(now)
        if now.sentence:
            print(now.sentence, file=sys.stderr, flush=True)
        if time.monotonic() - last >= interval:
            print(f"{100.0 * _share(now):.1f}%  {line}", file=sys.stderr, flush=True)
            last = time.monotonic()

    return show


def _share(now: Progress) -> float:
    return (now.done + now.failed + now.shares) / now.all


class _Pace:
    """The last seconds of a sweep."""

    def __init__(self) -> None:
        self._moments: deque[tuple[float, float]] = deque()

    def line(self, now: Progress) -> str:
        """Numbers of runs, and the time that is left at the pace of the last seconds."""
        moment, share = time.monotonic(), _share(now)
        if not self._moments or moment - self._moments[-1][0] >= 1.0:
            self._moments.append((moment, share))
        while moment - self._moments[0][0] > _WINDOW:
            self._moments.popleft()
        began, before = self._moments[0]
        line = f"{now.done + now.failed}/{now.all} runs  {now.running} running"
        line += f"  {now.failed} failed" if now.failed else ""
        if share > before and moment > began:
            left = int((1.0 - share) * (moment - began) / (share - before))
            line += f"  ETA {left // 3600}:{left // 60 % 60:02}:{left % 60:02}"
        return line
