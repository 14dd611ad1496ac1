"""The progress display of a sweep: one bar for all runs on a terminal, else a line a minute."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ..run.progress import Pace, ProgressListener, progress_listener

# Seconds of which the pace gives the ETA: several runs.
_WINDOW = 120.0


@dataclass(frozen=True)
class Progress:
    """The progress of a sweep: numbers of runs, and the sum of the shares that the running ones have done."""

    all: int
    done: int
    failed: int
    running: int
    shares: float
    sentence: str


Show = Callable[[Progress], None]


@contextlib.contextmanager
def shown(progress: bool) -> Iterator[Show]:
    """A function that shows how far the runs are; without `progress` it shows nothing."""
    if not progress:
        yield lambda now: None
        return
    with progress_listener(sentences_stay=True) as one:
        yield show_by(one)


def show_by(one: ProgressListener) -> Show:
    """The function that tells the numbers of runs, and the time that is left at the pace of the last seconds."""
    pace = Pace(_WINDOW)

    def show(now: Progress) -> None:
        share = (now.done + now.failed + now.shares) / now.all
        pace.note(share)
        if now.sentence:
            one.say(now.sentence)
        failed = f"  {now.failed} failed" if now.failed else ""
        one.put(share, f"{now.done + now.failed}/{now.all} runs  {now.running} running{failed}{pace.eta(1.0)}")

    return show
