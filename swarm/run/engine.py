"""The run of particles that are independent of one another, the only caller of their kernels."""

import functools
import math
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import observables
from ..common.status import Status
from ..compiled_scene import CompiledScene
from ..contact.events import ARRIVED, CAREFUL, EDGE, EVENT, HELD, PHASES
from ..contact.hold import One, Two
from ..contact.laws import NONE
from ..kernel.random import UNSEEDED, Seeding
from ..lanes import block as blocks
from ..lanes import careful, contact_events, slide, sliding, table
from ..lanes import lane_arrays as lanes
from ..lanes.sending import Sending
from ..lanes.share import Draws, Share, take
from ..lanes.watching import log as impact_log
from ..methods.base import Method
from ..particles import Particles
from ..state import State
from . import failures
from .base import Arrays, BaseRun, result_of
from .impacts import ThreadLog
from .preflight.counting import Counting
from .present import Presence
from .starting_state import begin, have_lasted, holders_of_resting, state_of
from .tally import UNWATCHED, Watched
from .tiers import Tier
from .turns import End, Turns, left_behind

# The length of a frame [s] up to which the caller's thread computes too; in longer frames, and in the first, it stays
# free to handle an interrupt.
_SHORT_FRAME = 0.05
# The work of a frame [s] up to which the caller's thread works alone, as waking another takes some 0.1 ms.
_LITTLE_WORK = 2e-4
# A frame is slow to write if writing takes more than this part of the work in it.
_MUCH_WRITING = 1.0 / 3.0
# The phases other than flight, each with its own kernel, and the walls that hold a particle that slides in it.
_KINDS = {EVENT: None, CAREFUL: None, HELD: One(0.0), EDGE: Two(0.0, 0.0)}
# The parts in which a thread takes its share of a frame in which particles slide.
_PARTS = 4
_DONE: End = (int(Status.DONE), 0, None)


class Run(BaseRun):
    """The run of points; the state holds the arrays of the particles, not copies."""

    # The work in the last frame per unit of its span [s]. It is infinite if unknown, so that another thread than the
    # caller's compiles missing kernels.
    _pace = math.inf

    def __init__(
        self, compiled: CompiledScene, particles: Particles, method: Method, threads: int, block_size: int | None,
        compile: str = "always", seeding: Seeding = UNSEEDED, watched: Watched = UNWATCHED,
    ) -> None:  # fmt: skip
        n, scene = len(particles), compiled.scene
        self._numbers, self._law = method.numbers(scene), method.law()
        if watched.log is not None and self._numbers.laws_at_ends is None and self._law is not None:
            # Impacts are logged at the ends of contacts, also without laws.
            self._numbers = self._numbers._replace(ends=NONE)
        self._walls = compiled.walls()
        logs = watched.log is not None or self._numbers.contacts_take_time
        self._counting = Counting(scene, watched.counters, logs)
        tier = Tier(compile, (self._numbers, self._law, self._walls), n)
        super().__init__(compiled, method, n, threads, tier, seeding, watched)
        self._booked = lanes.booked(self._walls)
        self.state = state_of(compiled, particles, method, self._booked, self._numbers.laws_at_ends is not None)
        if watched.counters:
            self.state = self.state._replace(crossed=self._counting.crossed(particles.position))
        observables.start_energies(compiled, self._law, self.state)
        self._faces = scene.open_faces()
        # A block consists of whole chunks, so that each thread observes the particles that it has advanced.
        self._size = observables.CHUNK * max(1, round(min(block_size or 0, n) / observables.CHUNK))
        self._present = Presence(particles.births, self.state, self._size)
        self._ticket = np.zeros(1, np.int64)
        self._phase = np.zeros(n, np.int8)
        self._seeding = seeding
        self._kinds: set[int] = set()  # the phases other than flight that particles have been in
        self._halted = lanes.none_halted(self._booked)
        self._lanes: list[lanes.Lanes] = []  # the lanes that no thread uses now
        self._hard = None if method.may_slide() or method.seldom_hard(scene) else blocks.Hard(blocks.MOST_HITS)
        self._threads = min(threads, len(self._present.order))
        self._choose_tier()

    def _prepare(self, span: float, moment: float) -> None:
        self._reach(moment)
        if not self._cut_short:
            begin(self.state, self._present.of(self._phase), (span, self._moment), bool(self._kinds), self._method)
            if self._tally is not None and self._kinds:
                self._tally.rest(holders_of_resting(self.state.contacts), span)

    def _turn(self, span: float, moment: float, writing: float, latest: float) -> tuple[int, int]:
        self._ticket[0] = 0
        others, self._helps = self._hands(span, writing)
        self._watch.begin(latest, self._helps, self._tier.is_plain)
        began = time.perf_counter()
        shares = [self._pool.submit(self._share, span) for _ in range(others)]
        ends = [self._share(span)] if self._helps else []
        ends += [result_of(share, latest, self.halt) for share in shares]
        seconds = time.perf_counter() - began
        status, particle, _left = max(ends, key=lambda end: end[:2])
        if status in (Status.INTERRUPTED, Status.HARD_CONTACT):
            left = [halted for *_, halted in ends if halted is not None]
            self._halted = left_behind(self._halted, self._phase, left)
        if status == Status.DONE:
            self._halted = lanes.none_halted(self._booked)
            self._pace = seconds * (others + self._helps) / span if span > 0.0 else self._pace
        return status, particle

    def _goes_on(self, status: int, item: int, seconds: float) -> bool:
        if status == Status.HARD_CONTACT:
            # Go on with the kernel of this phase or, if no contacts last, with the kernel of hard contacts.
            if self.state.contacts is not None:
                self._kinds.add(item)
            else:
                self._hard = blocks.Hard(blocks.MOST_HITS)
            self._choose_tier()
            return True
        freed = status == Status.INTERRUPTED and self._helps and self._watch.is_freed(seconds)
        if freed:
            self._pace = math.inf  # it is a long frame
        return freed

    def _failure(self, status: Status, item: int, span: float, moment: float) -> str:
        return failures.of_frame(self._compiled, self._method, self.state, (status, item), moment, self._seeding)

    def _share(self, span: float) -> End:
        """Advance and observe the particles that one thread draws; return the end of this."""
        draws = self._drawing()
        # Lanes are kept, as to make them takes as long as all other Python code of a small frame.
        try:
            mine = self._lanes.pop()
        except IndexError:
            mine = self._empty_lanes()
        page = self._open_page(self._moment)
        if not self._kinds:
            end = self._part(span, draws, mine, page)
        else:
            # In parts, as otherwise the first thread would draw all particles before the other threads begin.
            some, end = max(1, len(self._present.order) // (_PARTS * self._threads)), _DONE
            while end[0] == Status.DONE and (order := take(draws, some)).size:
                end = self._part(span, draws.again(order), mine, page)
        page.close()
        self._lanes.append(mine)
        return end

    def _part(self, span: float, draws: Draws, mine: lanes.Lanes, page: ThreadLog) -> End:
        """Advance and observe a part of the particles: in flight, then at walls and along them, in turns."""
        share = self._shared(span, draws)
        status, particle, drawn = self._kernel(blocks.advance_block, page)(*self._flying(share, mine))
        turns = Turns(self._phase, self.state.contacts, draws, drawn)
        while status == Status.DONE and any(share.pending[phase] for phase in _KINDS):
            if (over := turns.end(self._watch)) is not None:
                return over
            share = self._shared(span, draws.again(draws.mine[:drawn].copy()))
            for phase in _KINDS:
                if phase not in self._kinds and (self._phase == phase).any():
                    return int(Status.HARD_CONTACT), phase, None
                if phase in self._kinds and status == Status.DONE:
                    share.draws.ticket[0] = 0
                    kernel, arguments = self._lasting(phase, share)
                    status, particle, _drawn = self._kernel(kernel, page)(*arguments)
            if status == Status.INTERRUPTED:
                return status, 0, None
            if status == Status.DONE:
                share.pending.fill(0)
                share.draws.ticket[0] = 0
                status, particle, _drawn = self._kernel(blocks.advance_block, page)(*self._flying(share, mine))
        if status == Status.DONE:
            self._tier.kernel(observables.observe)(*self._observing(draws.mine[:drawn]))
        if status != Status.INTERRUPTED:
            return status, particle, None
        live = particle
        return status, 0, lanes.Halted(mine.particle[:live].copy(), mine.left_behind[:, :live].copy())

    def _kernel(self, kernel: Any, page: ThreadLog) -> Any:
        """Return a kernel of this tier that advances particles, and writes their impacts to the log of this thread."""
        return functools.partial(page.call, self._tier.kernel(kernel))

    def observe(self) -> None:
        # No particle is advanced.
        self._reach(0.0)
        self._phase.fill(ARRIVED)
        self._ticket[0] = 0
        began = time.perf_counter()
        self._share(0.0)
        self._tier.spend(time.perf_counter() - began)

    def _observe(self, moment: float) -> None:
        """Do nothing: each thread has observed the particles that it has advanced."""

    def _reach(self, moment: float) -> None:
        """Set the walls, and the particles in the scene, for the frame that ends at a moment [s]."""
        self._present.reach(moment)
        if self._scene.moves():
            self._walls, self._faces = self._compiled.walls(self._moment), self._scene.open_faces(self._moment)

    def _share_done(self, span: float) -> float:
        remaining = self._halted.time_left()
        if self.state.contacts is not None:
            remaining = np.append(remaining, self.state.contacts.remaining[self.state.contacts.remaining > 0.0])
        return float((self._phase == ARRIVED).sum() + (1.0 - remaining / span).sum()) / len(self._phase)

    def furthest_behind(self) -> tuple[int, list[float]] | None:
        remaining = self._halted.time_left()
        if not remaining.size:
            return None
        last = int(np.argmax(remaining))
        return self._first + int(self._halted.particle[last]), self._halted.places()[:, last].tolist()

    def _hands(self, span: float, writing: float) -> tuple[int, bool]:
        """Return the number of threads of the pool that advance a frame, and whether the caller's thread does too."""
        work = self._pace * span if span > 0.0 else 0.0
        helps = work < _SHORT_FRAME * self._threads
        # Plain Python runs in one thread at a time. A thread that writes for as long as another computes needs a
        # processor of its own: three threads that share two processors wait for one another.
        threads = 1 if self._tier.is_plain else max(1, self._threads - (writing > _MUCH_WRITING * work))
        return threads - helps if work > _LITTLE_WORK else 0, helps

    # --- Arguments of kernels ----------------------------------------------------------------------------

    def _drawing(self) -> Draws:
        """Return the draws of one thread."""
        order = self._present.order
        return Draws(self._ticket, order, self._size, np.empty(len(order), np.int64))

    def _empty_lanes(self) -> lanes.Lanes:
        rows = Sending.ROWS if self._numbers.laws.send_off else lanes.Flying.ALL
        made = lanes.empty(len(self._owners), self._booked, self.state.period, rows)
        if self.state.openings is not None and self._numbers.steps_into_walls:
            made = made._replace(stand=table.table(self._walls.length()))
        watched = self._impacts is not None or self._tally is not None
        made = made._replace(before=table.table(impact_log.ROWS)) if watched else made
        counters = self._counting.counters
        return made if counters is None else made._replace(began=table.table(counters.rows()))

    def _shared(self, span: float, draws: Draws) -> Share:
        """Return the share of a thread: its draws and counts, and the arrays of all particles."""
        return Share(
            self._present.flying(self.state), self._present.of(self._phase), np.zeros(PHASES, np.int64), self._halted,
            draws, self._watch.passes, span,
            self._seeding, self._moment, self._watchers(),
        )  # fmt: skip

    def _flying(self, share: Share, mine: lanes.Lanes) -> tuple[Any, ...]:
        """Return the arguments of `advance_block`."""
        return self._numbers, self._walls, self._gravity, self._hard, share, mine

    def _lasting(self, phase: int, share: Share) -> tuple[Any, tuple[Any, ...]]:
        """Return the kernel that advances particles in a phase other than flight, and its arguments."""
        common = self._numbers, self._walls, self._gravity, share
        if _KINDS[phase] is None:
            return contact_events.meet_block if phase == EVENT else careful.careful_block, common
        return slide.slide_block, (_KINDS[phase], *common, sliding.empty_sliding(self.state))

    def _escaping(self) -> tuple[Any, ...]:
        """Return the arguments of `count_escaped`."""
        return self._walls, self._gravity, self._far, self._faces, self._seen_state()

    def calls(self) -> Iterator[tuple[Any, tuple[Any, ...]]]:
        draws, mine = self._drawing(), self._empty_lanes()
        share = self._shared(0.0, draws)
        yield blocks.advance_block, self._flying(share, mine)
        for phase in self._kinds:
            yield self._lasting(phase, share)
        yield observables.observe, self._observing(draws.mine)
        if self._far < math.inf:
            yield observables.count_escaped, self._escaping()

    def _choose_tier(self) -> None:
        super()._choose_tier()
        self._pace = math.inf

    def _arrays(self) -> dict[str, Any]:
        state = self.state._replace(period=None, openings=None)
        return {"phase": self._phase, "halted": self._halted, **state._asdict()}

    def restore(self, arrays: Arrays, cut_short: bool) -> None:
        self._halted = lanes.Halted(arrays["halted.particle"], arrays["halted.rows"])
        super().restore(arrays, cut_short)
        if have_lasted(self.state.contacts, self._phase):
            self._kinds = set(_KINDS)
            self._choose_tier()

    def seen(self) -> dict[str, Any]:
        return super().seen() | self._present.observed()

    def _escaped(self) -> int:
        return 0 if self._far == math.inf else int(self._tier.kernel(observables.count_escaped)(*self._escaping()))

    def chunk_sums(self) -> NDArray[np.float64]:
        return self._present.sums(observables.chunk_sums(self._partial, self._seen_state(), bool(self._kinds)))

    def _seen_state(self) -> State:
        return self._present.seen(self.state)
