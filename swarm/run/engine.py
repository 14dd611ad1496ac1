"""The state of a run, and the threads that advance and observe it: the only callers of the kernels."""

import math
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import observables
from ..contact.events import ARRIVED, CAREFUL, EDGE, EVENT, FLYING, HELD, PHASES
from ..contact.hold import One, Two
from ..errors import RunError
from ..lanes import arrays as lanes
from ..lanes import block as blocks
from ..lanes import log as impact_log
from ..lanes import meet, slide, sliding, table
from ..lanes.arrays import booked
from ..methods.base import Method
from ..particles import Contacts, Multipliers, Particles
from ..scene import Scene
from ..status import Status
from . import failures
from .impacts import Page
from .state import Seeding, state_of
from .tally import Watched
from .tiers import Tier
from .turns import End, Turns
from .waiting import result_of
from .watch import Watch

# A particle this many times the scene's extent away from the origin has escaped from an open scene.
_FAR = 100.0
# Beyond this part of the scene's size a particle outside rigid walls is an error; round-off is 1e-15 of it.
_OUTSIDE = 1e-9
# The caller's thread computes too where a frame is shorter than this [s]; in longer ones, and in the first, it stays
# free to handle an interrupt.
_SHORT_FRAME = 0.05
# The caller's thread alone does frames of less work than this [s]: waking another takes some 0.1 ms.
_LITTLE_WORK = 2e-4
# A frame counts as slow to write above this part of the work in it.
_MUCH_WRITING = 1.0 / 3.0
# What slides in each phase, and what else is no flight: each is a kernel.
_KINDS = {EVENT: None, CAREFUL: None, HELD: One(0.0), EDGE: Two(0.0, 0.0)}
# A thread draws so many parts of its share of a frame in which particles slide: each part is done before the next.
_PARTS = 4
_UNWATCHED, _UNSEEDED = Watched(), Seeding()
_DONE: End = (int(Status.DONE), 0, None)


class Run:
    """The state of a run and the threads that advance it; the arrays of the particles become a part of the state."""

    def __init__(
        self, scene: Scene, particles: Particles, method: Method, threads: int, block_size: int | None,
        compile: str = "always", seeding: Seeding = _UNSEEDED, watched: Watched = _UNWATCHED,
    ) -> None:  # fmt: skip
        self._impacts, self._tally = watched
        n, self._owners = len(particles), scene.owners()
        self._booked = booked(scene.chain())
        self.state = state_of(scene, particles, method, self._booked)
        self._scene, self._method = scene, method
        self._numbers, self._law = method.numbers(scene), method.law()
        self._chain, self._gravity = scene.chain(), scene.pull()
        observables.start_energies(scene, self._law, self.state)
        self._moment = 0.0
        self._far = _FAR * scene.extent() if scene.is_open() else math.inf
        self._escaping = self._chain, self._gravity, self._far, scene.open_faces(), self.state
        self._deepest = _OUTSIDE * scene.finite_size() if method.is_rigid() else math.inf
        # Whole chunks, so that a thread observes what it has advanced.
        self._size = observables.CHUNK * max(1, round(min(block_size or 0, n) / observables.CHUNK))
        self._draws = math.ceil(n / self._size)
        self._ticket = np.zeros(1, np.int64)
        self._partial = np.zeros((math.ceil(n / observables.CHUNK), observables.ROWS))
        self._watch = Watch(n)
        self._phase = np.zeros(n, np.int8)
        # Kernels have signed numbers, of the same 64 bits.
        self._seed = seeding.seed - 2**64 if seeding.seed >= 2**63 else seeding.seed
        self._first = seeding.first
        self._order = np.arange(self._draws)
        self._kinds: set[int] = set()  # the phases that are no flight and that this run has met
        self._halted = lanes.none_halted(self._booked)
        self._lanes: list[lanes.Lanes] = []  # of threads that do not advance now
        self._cut_short = False
        self._hard = None if method.may_slide() or method.seldom_hard(scene) else blocks.Hard(blocks.MOST_HITS)
        self._threads = min(threads, self._draws)
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="swarm")
        self._pace = math.inf  # work of the last frame [s], over its span
        self._tier = Tier(compile, (self._numbers, self._law, self._chain), n)
        self._choose_tier()

    def __enter__(self) -> "Run":
        return self

    def __exit__(self, *error: object) -> None:
        self.halt()
        if self._impacts is not None:
            self._impacts.close()
        self._pool.shutdown(wait=True)

    def halt(self, passes: int = 0) -> None:
        """Make every kernel call of this frame return after so many passes; 0: at once.

        It ends when `advance` returns.
        """
        self._watch.halt(passes)

    def advance(self, span: float, moment: float, writing: float = 0.0, latest: float = math.inf) -> bool:
        """Advance every particle by `span` in the method's unit and observe it: whether the frame is done.

        It is not if `halt` was called, at the time `latest` [s of time.monotonic], or when the time for plain Python
        is used up. The next call then continues the frame, with the same bits as without the halt. `writing` is the
        time to write a frame [s].
        """
        self._move_walls(moment)
        if not self._cut_short:
            self._begin(span)
        if self._tier.is_plain:
            if self._tier.left <= 0.0:
                self._choose_tier()
            latest = min(latest, time.monotonic() + self._tier.left)
        self._ticket[0] = 0
        others, helps = self._hands(span, writing)
        self._watch.begin(latest, helps, self._tier.is_plain)
        began = time.perf_counter()
        shares = [self._pool.submit(self._share, span) for _ in range(others)]
        ends = [self._share(span)] if helps else []
        ends += [result_of(share, latest, self.halt) for share in shares]
        seconds = time.perf_counter() - began
        self._tier.spend(seconds)
        status, particle, _left = max(ends, key=lambda end: end[:2])
        self._cut_short = status in (Status.INTERRUPTED, Status.HARD_CONTACT)
        if self._cut_short:
            self._keep([left for *_, left in ends if left is not None])
            if status == Status.HARD_CONTACT:
                self._meet_hard(particle)
                return self.advance(span, moment, writing, latest)
            if helps and self._watch.is_freed(seconds):
                self._pace = math.inf  # it is a long frame
                return self.advance(span, moment, writing, latest)
        self._watch.end()
        if status not in (Status.DONE, Status.INTERRUPTED):
            ended = Status(status), particle
            raise RunError(failures.of_frame(self._scene, self._method, self.state, ended, moment, self._first))
        if status == Status.DONE:
            self._halted = lanes.none_halted(self._booked)
            self._pace = seconds * (others + helps) / span if span > 0.0 else self._pace
        return not self._cut_short

    def _meet_hard(self, phase: int) -> None:
        """Go on with the kernel of this phase, or with hard contacts where none last."""
        if self.state.contacts is not None:
            self._kinds.add(phase)
        else:
            self._hard = blocks.Hard(blocks.MOST_HITS)
        self._choose_tier()

    def _share(self, span: float) -> End:
        """Advance and observe what one thread draws."""
        draws = self._drawing()
        # To make lanes takes as long as all else that Python does of a small frame.
        try:
            mine = self._lanes.pop()
        except IndexError:
            mine = self._empty_lanes()
        page = None if self._impacts is None else Page(self._impacts, self._moment)
        if not self._kinds:
            end = self._part(span, draws, mine, page)
        else:
            # Who flies first would have drawn everything when the others are ready to slide.
            some, end = max(1, self._draws // (_PARTS * self._threads)), _DONE
            while end[0] == Status.DONE and (order := lanes.take(draws, some)).size:
                end = self._part(span, _again(draws, order), mine, page)
        if page is not None:
            page.close()
        self._lanes.append(mine)
        return end

    def _part(self, span: float, draws: lanes.Draws, mine: lanes.Lanes, page: Page | None) -> End:
        """Advance and observe a part of the particles: in flight, then at walls and along them, and again."""
        share = self._shared(span, draws)
        status, particle, drawn = self._call(blocks.advance_block, self._flying(share, mine), page)
        turns = Turns(self._phase, self.state.contacts, draws, drawn)
        while status == Status.DONE and any(share.pending[phase] for phase in _KINDS):
            if (over := turns.end(self._watch)) is not None:
                return over
            share = self._shared(span, _again(draws, draws.mine[:drawn].copy()))
            for phase in _KINDS:
                if phase not in self._kinds and (self._phase == phase).any():
                    return int(Status.HARD_CONTACT), phase, None
                if phase in self._kinds and status == Status.DONE:
                    share.draws.ticket[0] = 0
                    status, particle, _drawn = self._call(*self._lasting(phase, share), page)
            if status == Status.INTERRUPTED:
                return status, 0, None
            if status == Status.DONE:
                share.pending.fill(0)
                share.draws.ticket[0] = 0
                status, particle, _drawn = self._call(blocks.advance_block, self._flying(share, mine), page)
        if status == Status.DONE:
            self._tier.kernel(observables.observe)(*self._observing(draws.mine[:drawn]))
        if status != Status.INTERRUPTED:
            return status, particle, None
        live = particle
        return status, 0, lanes.Halted(mine.particle[:live].copy(), mine.left_behind[:, :live].copy())

    def _call(self, kernel: Any, arguments: tuple[Any, ...], page: Page | None) -> tuple[int, int, int]:
        """What a kernel returns that advances particles, with the log of this page."""
        chosen = self._tier.kernel(kernel)
        return tuple(chosen(*arguments)) if page is None else page.call(chosen, arguments)

    def _empty_lanes(self) -> lanes.Lanes:
        made = lanes.empty(len(self._owners), self._booked, self.state.period)
        watched = self._impacts is not None or self._tally is not None
        return made._replace(before=table.table(impact_log.ROWS)) if watched else made

    def observe(self) -> None:
        """Observe the start: every particle is there."""
        self._move_walls(0.0)
        self._phase.fill(ARRIVED)
        self._ticket[0] = 0
        began = time.perf_counter()
        self._share(0.0)
        self._tier.spend(time.perf_counter() - began)

    def _move_walls(self, moment: float) -> None:
        """The walls of the frame that ends at a moment [s]."""
        self._moment = moment = self._method.instant(moment)
        if self._scene.moves():
            self._chain = self._scene.chain(moment)
            faces = self._scene.open_faces(moment)
            self._escaping = self._chain, self._gravity, self._far, faces, self.state

    def _begin(self, span: float) -> None:
        """Whether each particle begins a frame in flight, along its walls or at rest."""
        contacts = self.state.contacts
        if contacts is None or not self._kinds:
            self._phase.fill(FLYING)
        else:
            contacts.short_steps.fill(0.0)
            self._phase[:] = contacts.phase
            rests = contacts.phase == ARRIVED
            if rests.any():
                # What is at rest costs this much.
                self.state.impulse[: len(contacts.load)] += contacts.load * (span * self.state.mass)
                contacts.sliding[:] += span * rests
        if self.state.escape_time is not None:
            self._phase[~np.isnan(self.state.escape_time)] = ARRIVED

    def share_done(self, span: float) -> float:
        """How much of a frame that was cut short is done, on average over the particles."""
        left = self._halted.time_left()
        if self.state.contacts is not None:
            left = np.append(left, self.state.contacts.left[self.state.contacts.left > 0.0])
        return float((self._phase == ARRIVED).sum() + (1.0 - left / span).sum()) / len(self._phase)

    def _hands(self, span: float, writing: float) -> tuple[int, bool]:
        """How many threads of the pool advance a frame, and whether the caller's thread does too."""
        work = self._pace * span if span > 0.0 else 0.0
        helps = work < _SHORT_FRAME * self._threads
        # A thread that writes for as long as one computes has a processor of its own: three threads that share two
        # processors wait for one another. And Python runs one thread at a time.
        threads = 1 if self._tier.is_plain else max(1, self._threads - (writing > _MUCH_WRITING * work))
        return threads - helps if work > _LITTLE_WORK else 0, helps

    def _drawing(self) -> lanes.Draws:
        """The draws of one thread."""
        return lanes.Draws(self._ticket, self._order, self._size, np.empty(self._draws, np.int64))

    def _shared(self, span: float, draws: lanes.Draws) -> lanes.Share:
        """What a thread shares with the others, and its counts."""
        pending = np.zeros(PHASES, np.int64)
        log = None if self._impacts is None else self._impacts.example
        counts = None if self._tally is None else self._tally.counts()
        frame = span, self._seed, self._first, self._moment
        return lanes.Share(
            self.state, self._phase, pending, self._halted, draws, self._watch.passes, *frame, log, counts
        )

    def _flying(self, share: lanes.Share, mine: lanes.Lanes) -> tuple[Any, ...]:
        """Arguments of `advance_block`."""
        return self._numbers, self._chain, self._gravity, self._hard, share, mine

    def _lasting(self, phase: int, share: lanes.Share) -> tuple[Any, tuple[Any, ...]]:
        """The kernel that advances particles in this phase, which is not flight, and its arguments."""
        if _KINDS[phase] is None:
            return meet.meet_block if phase == EVENT else meet.careful_block, (
                self._numbers,
                self._chain,
                self._gravity,
                share,
            )
        mine = sliding.empty(self.state.period, self.state.openings)
        return slide.slide_block, (_KINDS[phase], self._numbers, self._chain, self._gravity, share, mine)

    def _observing(self, drawn: NDArray[Any]) -> tuple[Any, ...]:
        """Arguments of `observe`."""
        return self._law, self._chain, self._gravity, self.state, drawn, self._size, self._partial

    def calls(self) -> Iterator[tuple[Any, tuple[Any, ...]]]:
        """Every kernel of a frame, with arguments of the types that it is called with from now on."""
        draws, mine = self._drawing(), self._empty_lanes()
        share = self._shared(0.0, draws)
        yield blocks.advance_block, self._flying(share, mine)
        for phase in self._kinds:
            yield self._lasting(phase, share)
        yield observables.observe, self._observing(draws.mine)
        if self._far < math.inf:
            yield observables.count_escaped, self._escaping

    def _choose_tier(self) -> None:
        if self._tier.choose(self.calls()):
            self._pace = math.inf

    def _keep(self, left_behind: list[lanes.Halted]) -> None:
        """Keep what a halt left in the lanes, and what an earlier one left and no lane has taken since."""
        picked_up = np.concatenate([np.flatnonzero(self._phase != FLYING), *(left.particle for left in left_behind)])
        waiting = ~np.isin(self._halted.particle, picked_up)
        parts = [lanes.Halted(self._halted.particle[waiting], self._halted.rows[:, waiting]), *left_behind]
        particle = np.concatenate([part.particle for part in parts])
        order = np.argsort(particle)
        rows = np.concatenate([part.rows for part in parts], axis=1)[:, order]
        self._halted = lanes.Halted(particle[order], np.ascontiguousarray(rows))

    def arrays(self) -> dict[str, NDArray[Any]]:
        """What `restore` needs to continue with the same bits, not copied; to be called between calls of `advance`."""
        arrays: dict[str, NDArray[Any]] = {"phase": self._phase, **_named("halted", self._halted)}
        for name, array in self.state._asdict().items():
            arrays |= _named(name, array) if isinstance(array, (Contacts, Multipliers)) else {name: array}
        if self._tally is not None:
            arrays["member_impacts"] = self._tally.total()
        return {name: array for name, array in arrays.items() if isinstance(array, np.ndarray)}

    def restore(self, arrays: dict[str, NDArray[Any]], cut_short: bool) -> None:
        """Take the state of the run that gave these `arrays`: at a frame, or within one if it was `cut_short`."""
        self._halted = lanes.Halted(arrays["halted.particle"], arrays["halted.rows"])
        for name, array in self.arrays().items():
            np.copyto(array, arrays[name], casting="no")
        if self._tally is not None:
            self._tally.restore(arrays["member_impacts"])
        self._cut_short = cut_short
        contacts = self.state.contacts
        if contacts is not None and (contacts.phase.any() or (contacts.left > 0.0).any()):
            self._kinds = set(_KINDS)
            self._choose_tier()

    def seen(self) -> dict[str, Any]:
        """The observables of the last frame."""
        seen = observables.summary(self._partial, self.state, self._owners, bool(self._kinds))
        is_open = self._far < math.inf
        escaped = self._tier.kernel(observables.count_escaped)(*self._escaping) if is_open else 0
        if self.state.escape_time is not None:
            escaped += np.count_nonzero(~np.isnan(self.state.escape_time))
        return {**seen, **self._poses(), "escaped": int(escaped)}

    def chunk_sums(self) -> NDArray[np.float64]:
        """What `observables.summed` takes, of the last frame."""
        return observables.chunk_sums(self._partial, self.state, bool(self._kinds))

    def _poses(self) -> dict[str, NDArray[Any]]:
        """Where the surfaces are, if any moves."""
        if not self._scene.moves():
            return {}
        poses = self._scene.poses(self._moment)
        return {
            "wall_position": np.array([pose.position() for pose in poses]),
            "wall_orientation": np.array([pose.quaternion for pose in poses]),
        }

    def require_admissible(self, seen: dict[str, Any], moment: float) -> None:
        """Raise a RunError that names the first particle whose state is not finite, or that is outside rigid walls."""
        failures.require_admissible(self._scene, self.state, seen, self._deepest, moment, self._first)


def _again(draws: lanes.Draws, order: NDArray[Any]) -> lanes.Draws:
    """The draws of this `order`, for one thread."""
    return draws._replace(ticket=np.zeros(1, np.int64), order=order)


def _named(name: str, arrays: Any) -> dict[str, NDArray[Any]]:
    """The arrays of a NamedTuple under dotted names."""
    return {f"{name}.{field}": array for field, array in arrays._asdict().items()}
