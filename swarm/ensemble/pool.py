"""The runs of a plan over worker processes: a thread of the parent for each, which hands it one run after the other."""

import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Any

from ..errors import RunError
from .hand import Hand
from .plan import Variant
from .results import Results, Status


@dataclass(frozen=True)
class Progress:
    """The progress of a sweep: numbers of runs, and the sum of the shares that the running ones have done."""

    all: int
    done: int
    failed: int
    running: int
    shares: float
    sentence: str


class Pool:
    """Workers and what is left for them.

    Args:
        results: the plan, and what of it has ended.
        processes: how many workers.
        threads: of a run, unless its file says how many.
        goes_on: whether the folder may hold parts of the runs.
    """

    def __init__(self, results: Results, processes: int, threads: int, goes_on: bool) -> None:
        self._results, self._threads, self._goes_on = results, threads, goes_on
        left = [variant for state in ("failed", "waiting") for variant, _status in results.of_state(state)]
        self._left = deque(_in_order(left))
        self._processes = min(processes, len(left))
        self._hands: set[Hand] = set()
        self._shares: dict[int, float] = {}
        self._sentence = ""
        self._ended = {"done": len(results.of_state("done")), "failed": 0}
        self._stops = False
        self._lock = threading.Lock()

    def stop(self) -> None:
        """Begin no more runs, and let those under way end with a checkpoint."""
        # Without the lock: it is called from a handler of signals, in a thread that may hold it.
        self._stops = True
        self._sentence = "stopping: the runs under way save checkpoints; a second Ctrl-C ends them at once"
        for hand in list(self._hands):
            hand.stop()

    def kill(self) -> None:
        """End all workers at once."""
        self._stops = True
        for hand in list(self._hands):
            hand.kill()

    def progress(self) -> Progress:
        """The progress of the runs."""
        with self._lock:
            sentence, self._sentence = self._sentence, ""
            return Progress(
                len(self._results.plan.variants), self._ended["done"], self._ended["failed"], len(self._shares),
                sum(self._shares.values()), sentence,
            )  # fmt: skip

    def run(self, every: float, glance: Callable[[], None]) -> None:
        """Carry out what is left; `glance` is called every so many seconds.

        Raises:
            RunError: a worker cannot be started.
            FileError: the end of a run cannot be noted.
        """
        with ThreadPoolExecutor(max(1, self._processes), thread_name_prefix="swarm-sweep") as threads:
            working: set[Future[None]] = {threads.submit(self._work) for _ in range(self._processes)}
            try:
                while working:
                    ended, working = wait(working, every)
                    for one in ended:
                        one.result()
                    glance()
            except BaseException:
                self.kill()
                raise

    def _work(self) -> None:
        hand: Hand | None = None
        try:
            while (variant := self._next()) is not None:
                if hand is None or not hand.is_alive():
                    hand = self._replaced(hand)
                self._carry_out(hand, variant)
        finally:
            self._let_go(hand)

    def _next(self) -> Variant | None:
        with self._lock:
            return None if self._stops or not self._left else self._left.popleft()

    def _replaced(self, old: Hand | None) -> Hand:
        self._let_go(old)
        made = Hand()
        self._hands.add(made)
        try:
            made.wait_until_ready()
        except RunError:
            if not self._stops:
                self._let_go(made)
                raise
        return made

    def _let_go(self, hand: Hand | None) -> None:
        if hand is not None:
            self._hands.discard(hand)
            hand.close()

    def _carry_out(self, hand: Hand, variant: Variant) -> None:
        impacts = self._results.impacts(variant)
        with self._lock:
            self._shares[variant.number] = 0.0
        order = {
            "text": self._results.plan.text(variant),
            "source": str(self._results.plan.path),
            "trajectory": str(self._results.trajectory(variant)),
            "impacts": None if impacts is None else str(impacts),
            "threads": self._threads,
            "goes_on": self._goes_on,
            "plugins": self._results.plan.plugins,
        }
        if self._stops:
            status: Status = {"state": "stopped"}
        else:
            status = hand.carry_out(order, lambda message: self._tell(variant, message))
        if status["state"] == "stopped" and not self._stops:
            error = "its process got SIGTERM; a resumed sweep goes on with it"
            status |= {"state": "failed", "error": error}
        has_ended = status["state"] == "done" or (status["state"] == "failed" and not self._stops)
        if has_ended:
            self._results.add(variant, status)
        with self._lock:
            del self._shares[variant.number]
            if has_ended:
                self._ended[status["state"]] += 1

    def _tell(self, variant: Variant, message: dict[str, Any]) -> None:
        with self._lock:
            self._shares[variant.number] = message.get("share", self._shares[variant.number])
            self._sentence = message.get("compiling", self._sentence)


def _in_order(variants: list[Variant]) -> Iterator[Variant]:
    """The first of each kind, then the others: workers compile the kernels of several kinds at the same time."""
    kinds: set[str] = set()
    rest: list[Variant] = []
    for variant in sorted(variants, key=lambda one: one.number):
        if variant.kind in kinds:
            rest.append(variant)
        else:
            kinds.add(variant.kind)
            yield variant
    yield from rest
