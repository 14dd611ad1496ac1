"""The progress display of a run, or of a sweep: a bar on a terminal, else a line a minute."""

import contextlib
import logging
import math
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

# ETA and speed are those of the last seconds [s]: an average from the start would include compilation.
_WINDOW = 10.0
# The time between two looks at a frame, and the time of a frame above which it hardly goes on [s].
LOOK, _A_MONTH = 10.0, 30 * 86400.0
_LOG = logging.getLogger("swarm")
# The time between two plain lines, and between two changes of the bar within a long frame [s].
_A_MINUTE, _A_MOMENT = 60.0, 1.0


def _nothing(*_args: Any) -> None:
    """Show nothing."""


@dataclass(frozen=True)
class Display:
    """The functions that show a run.

    Args:
        frame: called with every frame.
        within: called within a frame with the time that particles have reached on average, and the end of the run.
        every: the wall time from one call of `within` to the next [s].
        compiling: called with a sentence before a kernel is compiled.
    """

    frame: Callable[[Any], None]
    within: Callable[[float, float], None] = _nothing
    every: float = math.inf
    compiling: Callable[[str], None] = _nothing


@contextlib.contextmanager
def display(progress: "bool | Callable[[Any], None] | Display") -> Iterator[Display]:
    """Yield the display for the argument `progress`: nothing, a function or display, a bar or lines on stderr."""
    if isinstance(progress, Display):
        yield progress
    elif callable(progress):
        # The function gets a copy of the observables, which it may change.
        yield Display(lambda frame: progress(frame.apart()))
    elif not progress:
        yield Display(_nothing)
    else:
        with progress_listener() as one:
            yield display_by(one, _A_MOMENT if sys.stderr.isatty() else _A_MINUTE)


class ProgressListener(NamedTuple):
    """A listener to progress: `put` takes the share done and a line about it, `say` a sentence."""

    put: Callable[[float, str], None]
    say: Callable[[str], None]


@contextlib.contextmanager
def progress_listener(sentences_stay: bool = False) -> Iterator[ProgressListener]:
    """Yield a bar on a terminal, which shows sentences above it or for a moment; else a line a minute."""
    if not sys.stderr.isatty():
        yield in_lines(_A_MINUTE)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns = BarColumn(bar_width=24), TextColumn("{task.percentage:3.0f}%"), TextColumn("{task.fields[line]}")
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0, line="")

        def put(share: float, line: str) -> None:
            bar.update(task, completed=share, line=line)

        def say(sentence: str) -> None:
            if sentences_stay:
                bar.console.print(sentence, highlight=False, markup=False)
            else:
                bar.update(task, line=sentence, refresh=True)

        yield ProgressListener(put, say)


def in_lines(interval: float) -> ProgressListener:
    """Return a listener that prints a line when the last one is `interval` seconds old."""
    last = time.monotonic()

    def put(share: float, line: str) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= interval:
            print(f"{100.0 * share:.1f}%  {line}", file=sys.stderr, flush=True)
            last = now

    return ProgressListener(put, lambda sentence: print(sentence, file=sys.stderr, flush=True))


def display_by(one: ProgressListener, every: float) -> Display:
    """Return the display of a run with the share done and a line about the last seconds."""
    recent = _Recent()

    def frame(done: Any) -> None:
        line = recent.frame(done)
        if done.number > 0:  # the first frame is the start: kernels compile after it
            one.put(done.time / done.until, line)

    def within(moment: float, until: float) -> None:
        one.put(moment / until, recent.within(moment, until))

    return Display(frame, within, every, one.say)


class _Recent:
    """The values of a run in the last seconds."""

    def __init__(self) -> None:
        self._moments, self._impacts = Pace(_WINDOW), Pace(_WINDOW)
        self._energy = ""

    def frame(self, frame: Any) -> str:
        """Return the line after a frame: time, ETA, speed and energy error."""
        self._energy = f"  energy error {frame.observables['energy_error']:.1e}"
        if frame.number == 0:
            return ""
        self._impacts.note(frame.observables["impacts"])
        return self.within(frame.time, frame.until)

    def within(self, moment: float, until: float) -> str:
        """Return the line within a frame, with the speed and the energy error of the last one."""
        self._moments.note(moment)
        elapsed, impacts = self._impacts.lately()
        speed = f"  {impacts / elapsed:.3g} impacts/s" if elapsed > 0.0 else ""
        return f"{moment:.4g}/{until:.4g} s{self._moments.eta(until)}{speed}{self._energy}"


class Standstill:
    """A warning, once in a run, of a frame that hardly goes on.

    `cause` returns a sentence about another possible cause in the scene, or an empty one.
    """

    def __init__(self, cause: Callable[[], str] = str) -> None:
        self._cause = cause
        self._shares, self._about, self._has_warned, self._is_slow = Pace(LOOK), (0, 0.0), False, False

    def look(self, number: int, share: float, behind: tuple[int, list[float]] | None, compiled: float) -> None:
        """Look at a frame with a share done.

        `behind` is the particle with the most time left, and its place [m]. `compiled` is the time of compilations so
        far [s], during which a frame does not advance.
        """
        if (number, compiled) != self._about:
            self._shares, self._about, self._is_slow = Pace(LOOK), (number, compiled), False
        self._shares.note(share)
        elapsed, advanced = self._shares.lately()
        if self._has_warned or elapsed < LOOK:
            return
        # A run must be slow twice in a row, as other work of the machine may last as long.
        was_slow, self._is_slow = self._is_slow, advanced * _A_MONTH < (1.0 - share) * elapsed
        if not (was_slow and self._is_slow):
            return
        self._has_warned = True
        last = ""
        if behind is not None:
            last = f"; the last one is particle {behind[0]}, at ({', '.join(f'{x:.6g}' for x in behind[1])}) m"
        cause = f"; {text}" if (text := self._cause()) else ""
        _LOG.warning(
            "frame %d hardly goes on: in %.0f s particles have done %.2g of it%s. A particle meets its walls almost "
            "without time between where walls touch but do not overlap, as boxes in a row, where friction holds it in "
            "a corner of walls that turn, or where a user-defined method or law takes energy at each impact and lets "
            "no particle rest: let such walls overlap, round the corner off, or let slow particles rest%s. The run "
            "goes on; end it with Ctrl-C", number, elapsed, advanced, last, cause,
        )  # fmt: skip


class Pace:
    """The growth of a value in the last `window` seconds."""

    def __init__(self, window: float) -> None:
        self._window = window
        self._values: deque[tuple[float, float]] = deque()

    def note(self, value: float) -> None:
        """Add a value, and drop the values before the window."""
        now = time.monotonic()
        self._values.append((now, value))
        while len(self._values) > 2 and now - self._values[0][0] > self._window:
            self._values.popleft()

    def lately(self) -> tuple[float, float]:
        """Return the time [s] and the difference from the first value to the last."""
        if not self._values:
            return 0.0, 0.0
        (began, before), (now, value) = self._values[0], self._values[-1]
        return now - began, value - before

    def eta(self, end: float) -> str:
        """Return the text of the time from the last value to the end, empty if it is not known."""
        elapsed, advanced = self.lately()
        if not (elapsed > 0.0 and advanced > 0.0):
            return ""
        left = int(elapsed * (end - self._values[-1][1]) / advanced)
        return f"  ETA {left // 3600}:{left // 60 % 60:02}:{left % 60:02}"
