"""A run under way: its state, and the threads that advance and observe it. The border to the kernels."""

import functools
import math
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from . import blocks, lanes, observables
from .errors import RunError
from .methods.base import Method
from .particles import Multipliers, Particles, State
from .scene import Scene
from .status import Status

# A particle this many times the scene's extent away from the origin has escaped from an open scene.
_FAR = 100.0
# The caller's thread computes too where a frame is shorter than this [s]; in longer ones, and in the first, it is free
# to take an interrupt.
_SHORT_FRAME = 0.05
# Frames of less work than this [s] are for the caller's thread alone: to wake another takes some 0.1 ms.
_LITTLE_WORK = 2e-4
# A frame that takes longer to write than this part of the work in it.
_MUCH_WRITING = 1.0 / 3.0


class Run:
    """The state of a run and the threads that advance it."""

    def __init__(
        self, scene: Scene, particles: Particles, method: Method, threads: int, block_size: int | None
    ) -> None:
        n = len(particles)
        self.state = State(
            particles.position.copy(),
            particles.velocity.copy(),
            particles.mass.copy(),
            np.empty(n),
            np.empty(n),
            np.zeros(n, np.int64),
            np.zeros((len(scene.owners()), n)),
            np.zeros(0 if scene.restitution() is None else n),
            _no_sweeps(n) if method.has_multipliers() else None,
        )
        self._far = _FAR * scene.extent() if scene.is_open() else math.inf
        self._too_fast = functools.partial(method.too_fast, scene)
        self._failure, self._owners = method.failure, scene.owners()
        self._method, self._law = method.numbers(scene), method.law()
        self._chain, self._gravity = scene.chain(), scene.pull()
        observables.start_energies(self._law, self._chain, self._gravity, scene.finite_size(), self.state)
        # Whole chunks, so that a thread observes what it has advanced.
        self._size = observables.CHUNK * max(1, round((block_size or 0) / observables.CHUNK))
        self._draws = math.ceil(n / self._size)
        self._ticket = np.zeros(1, np.int64)
        self._partial = np.zeros((math.ceil(n / observables.CHUNK), observables.ROWS))
        self._halt = np.zeros(1, np.int8)
        self._done = np.zeros(n, np.bool_)
        self._hard = None if method.seldom_hard(scene) else blocks.Hard(blocks.MOST_HITS)
        self._threads = min(threads, self._draws)
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="swarm")
        self._pace = math.inf  # work of the last frame [s], over its span

    def __enter__(self) -> "Run":
        return self

    def __exit__(self, *error: object) -> None:
        self.halt()
        self._pool.shutdown(wait=True)

    def halt(self) -> None:
        """Let the kernels return before their frame is done, and `advance` raise KeyboardInterrupt."""
        self._halt[0] = 1

    def advance(self, span: float, moment: float, writing: float = 0.0) -> None:
        """Advance every particle by `span` in the method's unit, and observe it; `writing` a frame takes seconds."""
        self._done.fill(False)
        status, particle = self._all_shares(span, writing)
        if status == Status.HARD_CONTACT:
            self._hard = blocks.Hard(blocks.MOST_HITS)
            status, particle = self._all_shares(span, writing)
        if self._halt[0]:
            raise KeyboardInterrupt
        if status != Status.DONE:
            told = f"the frame at {moment:g} s failed at particle {particle}: {Status(status).sentence}"
            if status == Status.TOO_FAST:
                told += f", {self._too_fast()}"
            multipliers = self.state.multipliers
            if status == Status.UNCONVERGED and multipliers is not None:
                left, stored = multipliers.left[particle], multipliers.stored_energy[particle]
                told += f" {self._failure(moment, left, multipliers.sweeps[particle], stored)}"
            raise RunError(told)

    def observe(self) -> None:
        """Observe the start."""
        self._done.fill(True)
        self._all_shares(0.0)

    def _all_shares(self, span: float, writing: float = 0.0) -> tuple[int, int]:
        """Every particle that is not done by `span`, all threads: the worst (status, particle)."""
        self._ticket[0] = 0
        # The caller's thread is one of them, unless it has to be free.
        work = self._pace * span if span > 0.0 else 0.0
        helps = work < _SHORT_FRAME * self._threads
        # A thread that writes for as long as one computes has a processor of its own: three that share two of them wait
        # for one another.
        threads = max(1, self._threads - (writing > _MUCH_WRITING * work))
        others = threads - helps if work > _LITTLE_WORK else 0
        began = time.perf_counter()
        shares = [self._pool.submit(self._share, span) for _ in range(others)]
        mine = [self._share(span)] if helps else []
        worst = max(mine + [share.result() for share in shares])
        if span > 0.0:
            self._pace = (time.perf_counter() - began) * (others + helps) / span
        return worst

    def _share(self, span: float) -> tuple[int, int]:
        """What one thread draws, advanced and observed."""
        draws = lanes.Draws(self._ticket, self._size, np.empty(self._draws, np.int64))
        # Without the compiler too, a division by zero is an infinity that a select throws away.
        with np.errstate(divide="ignore", invalid="ignore"):
            status, particle, drawn = blocks.advance_block(
                self._method, self._chain, self._gravity, self._hard, self.state, self._done, span, draws,
                self._halt, lanes.room(),
            )  # fmt: skip
            if status == Status.DONE:
                mine = draws.mine[:drawn]
                observables.observe(self._law, self._chain, self._gravity, self.state, mine, self._size, self._partial)
        return status, particle

    def seen(self) -> dict[str, Any]:
        """The observables of the last frame."""
        seen = observables.summary(self._partial, self.state, self._owners)
        escaped = 0
        if self._far < math.inf:
            with np.errstate(divide="ignore", invalid="ignore"):
                escaped = int(observables.count_escaped(self._chain, self._gravity, self._far, self.state))
        return {**seen, "escaped": escaped}

    def require_finite(self, seen: dict[str, Any], moment: float) -> None:
        """Raise a RunError that names the first particle whose state is not finite."""
        # Whatever is not finite spreads to the energy or, if it is a position, to the angular momentum.
        if math.isfinite(seen["total_energy"] + seen["angular_momentum"].sum()):
            return
        good = np.isfinite(self.state.position).all(axis=0) & np.isfinite(self.state.velocity).all(axis=0)
        raise RunError(
            f"the frame at {moment:g} s failed at particle {int(np.argmin(good))}: {Status.NOT_FINITE.sentence}"
        )


def _no_sweeps(n: int) -> Multipliers:
    counts = np.zeros((3, n), np.int64)
    return Multipliers(counts[0], counts[1], counts[2], np.zeros(n), np.zeros(n))
