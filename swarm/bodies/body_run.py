"""The run of copies of a body."""

import math
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from ..common.status import Status
from ..compiled_scene import CompiledScene
from ..contact.laws import NONE, Laws
from ..errors import RunError
from ..kernel.limits import SOLVED_PLACE
from ..kernel.random import UNSEEDED, Seeding
from ..methods.base import Method
from ..motion import pose
from ..observables import CHUNK
from ..particles import Particles
from ..run.base import BaseRun
from ..run.doors import comers
from ..run.impacts import ThreadLog
from ..run.observed import gone_of
from ..run.preflight.counting import Counting
from ..run.tally import UNWATCHED, Watched
from ..run.tiers import Tier
from ..scene import Scene
from ..state import Crossed, Floats, State, none_left
from .births import BodyFeed
from .body import squares_between
from .copies import Bodies
from .energies import BodyEnergies, summed
from .lanes.advance import advance_bodies
from .lanes.body_arrays import BodyState, StepRule
from .lanes.contacts import MOST_CONTACTS
from .numbers import led_points, most_contacts_of, own_surfaces, ties_of, touching_of, walls_of

# The most bytes of the lanes of a thread, which are on its stack, unless one lane takes more; the most lanes.
_STACK, _MOST_LANES = 1 << 20, 32
# The bytes for everything else on a stack; stacks are whole pages.
_REST, _PAGE = 8 << 20, 1 << 16
# The bodies that a thread draws at a time.
_AT_ONCE = 256
# Suzuki's composition: five steps of second order make one step of fourth order.
_OUTER = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))
STAGES = {2: (1.0,), 4: (_OUTER, _OUTER, 1.0 - 4.0 * _OUTER, _OUTER, _OUTER)}


class BodyRun(BaseRun):
    """The run of copies of a body; the arrays of their points are a part of its state."""

    def __init__(
        self, compiled: CompiledScene, copies: tuple[Bodies, Particles], method: Method, threads: int,
        block_size: int | None = None, compile: str = "always", seeding: Seeding = UNSEEDED,
        watched: Watched = UNWATCHED,
    ) -> None:  # fmt: skip
        scene, (bodies, particles) = compiled.scene, copies
        law, looped, soft = method.law(), method.has_multipliers(), walls_of(method)
        n, points, own = len(bodies), len(bodies.body), own_surfaces(bodies.body)
        self._body = bodies.body
        self._ties = ties_of(bodies.body, law.alpha if looped else None)
        self._touching = touching_of(bodies.body, self._ties, compiled, seeding)
        self._carried = [Scene([surface]).compiled() for surface, _carrier, _point in bodies.body.cavities]
        self._compiled, self._own, self._changes = compiled, own, scene.moves() or scene.has_doors()
        self._reach(0.0)
        self._energies = BodyEnergies(compiled, self._carried, bodies.body, self._ties, law)
        rows, walls = (
            len(self._ties.ends) + len(bodies.body.guides),
            len(compiled.numbering.surfaces_of_rows) + len(own),
        )
        laws = self._touching.laws or NONE
        self._counting, opens = Counting(scene, watched.counters), self._walls[2] is not None
        crossed = self._counting.crossed(bodies.centers())
        self._bodies = _state_of(bodies, particles, (rows, walls), opens, scene.moves(), laws, crossed)
        none = np.zeros(0)
        # The part of the state that files take.
        self.state = State(
            particles.position, particles.velocity, particles.mass, none, none, np.zeros(points * n, np.int64),
            np.zeros((walls, 0)), none, None,
            image=particles.image, **none_left(points * n, opens, laws.may_end),
        )  # fmt: skip
        contacts = most_contacts_of(self._touching, soft)
        per_lane = 8 * (24 * points + 10 * rows + rows * rows + 20 * contacts)
        lanes = max(1, min(_MOST_LANES, _STACK // per_lane, n))
        drawn = max(1, block_size or _AT_ONCE)
        threads = min(threads, math.ceil(n / drawn))
        # The bytes of the matrices of ties and of contacts of one body.
        pressed = max(contacts, 3 * MOST_CONTACTS)
        at_once = 8 * (rows * rows + pressed * (pressed + 3 * rows))
        # In plain Python a step takes some milliseconds, so that compilation always pays.
        tier = Tier("always" if compile == "auto" else compile, self._walls, n * points)
        pool = threads_with(threads, lanes * per_lane + at_once)
        super().__init__(compiled, method, n, threads, tier, seeding, watched, pool)
        self._instants = scene.instants if scene.has_doors() else None
        self._size = drawn
        size, gravity = scene.finite_size(), np.array(scene.gravity or (0.0, 0.0, 0.0))
        room = SOLVED_PLACE * max(size, scene.extent())
        self._least, self._room = math.sqrt(min([*(self._link_lengths() ** 2), size * size])), room
        noise = room / self._least
        dt, stages = method.dt, np.array(STAGES[getattr(method, "order", 2)])  # type: ignore[attr-defined]
        # More lanes gain only in a compiled kernel.
        lanes = 1 if tier.is_plain else lanes
        self._rule = StepRule(
            dt, stages, gravity, 0.0, room, noise, lanes, soft, contacts, looped,
            getattr(method, "on_unconverged", "") == "raise", compiled.cell(),
        )  # fmt: skip
        # The frames of fixed steps are counted in steps.
        self._unit = 1.0 if soft is None or soft.is_cut else dt
        self._mass = float(self._ties.mass.sum())
        self._falls = -gravity * [length or 0.0 for length in scene.period or (None,) * 3]
        self._pull = math.hypot(*gravity) * self._mass * size
        self._led_start, self._scale = np.zeros((2, n))
        self._energy_start = self._bodies.energy
        if bodies.births is not None:
            self._feed = BodyFeed(scene, bodies, seeding.unsigned(), self._energy_of)
            self.state = self.state._replace(born_time=np.tile(self._feed.born_time, points))
        for some, r, v in self._blocks():
            self._led_start[some] = self._energies.led(r, v)
            self._begin_books(some, r, v)
        self._seen: dict[str, Any] = {}
        self._sums = np.zeros((0, 0))

    def calls(self) -> list[tuple[Any, tuple[Any, ...]]]:
        return [(advance_bodies, self._arguments(0, np.zeros(1, np.int64)))]

    def _arguments(self, thread: int, ticket: Any, page: ThreadLog | None = None) -> tuple[Any, ...]:
        """Return the arguments of `advance_bodies`, with the counts of a thread, and its page of the log."""
        counts = None if self._tally is None else self._tally.of_thread(thread)
        watchers = self._watchers(page)._replace(counts=counts)
        both, bodies = (self._ties, self._touching), self._bodies._replace(watchers=watchers)
        return both, self._walls, self._rule, bodies, ticket, self._size, self._watch.passes

    def _prepare(self, span: float, moment: float) -> None:
        if self._changes:
            self._reach(moment)
        if self._scene.moves():
            # Places at a wall have the round-off of its displacement.
            far = max(math.hypot(*pose(surface.motion, moment).shift) for surface in self._scene.surfaces)
            room = max(self._room, SOLVED_PLACE * far)
            self._rule = self._rule._replace(room=room, noise=room / self._least)
        if not self._cut_short:
            self._bodies.remaining.fill(span * self._unit)
            for time in (self._bodies.escape_time, self._bodies.absorbed_time):
                if time is not None:
                    self._bodies.remaining[~np.isnan(time)] = 0.0
            self._feed_in(moment)
        self._rule = self._rule._replace(end=moment)

    def _energy_of(self, r: Floats, v: Floats) -> Floats:
        """The energy of copies (n,) [J]."""
        return self._energies.kinetic(v) + self._energies.fall(r) + self._energies.stored(r)

    def _begin_books(self, some: Any, r: Floats, v: Floats) -> None:
        """Begin the books of the energy of copies that are now in the scene."""
        self._energy_start[some] = start = self._energy_of(r, v)
        self._scale[some] = np.maximum(np.abs(start), self._energies.kinetic(v)) + self._pull

    def _feed_in(self, moment: float) -> None:
        """Add the bodies that are due up to a moment [s]; they move for the rest of the frame."""
        feed, bodies = self._feed, self._bodies
        if not isinstance(feed, BodyFeed):
            return
        bodies.remaining[np.isnan(feed.born_time)] = 0.0
        for time, some, r, v in feed.until(moment):
            bodies.position[..., some], bodies.velocity[..., some] = r, v
            bodies.remaining[some] = moment - time
            self._begin_books(some, r, v)
            self._counting.begin(bodies.crossed, some, self._body.center_of(r))

    def _reach(self, moment: float) -> None:
        """Set the walls, those with the body's own, and the openings of the frame, or its piece, up to a moment [s]."""
        made = self._compiled.walls_of_bodies
        self._walls = made((), moment), made(self._own, moment), self._compiled.openings(moment)

    def _switch(self, instant: float) -> None:
        for surface in np.flatnonzero(comers(self._scene, instant)):
            depth = self._depths(slice(None), self._bodies.position, instant)[surface]
            if self._feed is not None:
                depth[np.tile(np.isnan(self._feed.born_time), len(self._body.contacts))] = -math.inf
            if not depth.max(initial=-math.inf) <= self._deepest:
                body = self._first + int(np.argmax(depth)) % len(self._bodies.remaining)
                raise RunError(
                    f"surfaces[{surface}] must come where no body is: at {instant:g} s a contact point of body {body} "
                    f"is {depth.max():.3g} m inside; let it come later or elsewhere, or start that body elsewhere"
                )

    def _depths(self, some: slice, r: Floats, moment: float) -> Floats:
        """The distances of contact points outside of each surface (surfaces, K n) [m]; -inf beyond an opening."""
        points = self._energies.contact_points(r).reshape(3, -1)
        depths = self._scene.distances_outside(points, moment)
        if self._bodies.free is not None:
            depths[:, self._bodies.free[:, some].reshape(-1) > 0] = -math.inf
        if self._bodies.absorbed_time is not None:
            absorbed = ~np.isnan(self._bodies.absorbed_time[some])
            depths[:, np.tile(absorbed, len(self._body.contacts))] = -math.inf
        return depths

    def _turn(self, span: float, moment: float, writing: float, latest: float) -> tuple[int, int]:
        threads, status, body = 1 if self._tier.is_plain else self._threads, int(Status.LOG_FULL), 0
        pages = [self._open_page(moment) for _thread in range(threads)]
        while status == Status.LOG_FULL:
            ticket = np.zeros(1, np.int64)
            calls = [self._arguments(thread, ticket, page) for thread, page in enumerate(pages)]
            status, body = max(self._called(advance_bodies, calls, latest))
            for page in pages:
                page.turn() if status == Status.LOG_FULL else page.close()
        return status, body

    def _failure(self, status: Status, item: int, span: float, moment: float) -> str:
        time_of = moment - self._bodies.remaining[item]
        sentence = f"the frame at {moment:g} s failed at body {self._first + item}, at {time_of:.6g} s: "
        if status == Status.UNSOLVED:
            return sentence + (
                f"its ties have no solution even in a step of 1e-6 of dt = {self._rule.dt:g} s; lengths at its start "
                f"are off by {self._link_error():.2g} of themselves; a shorter dt helps if the body turns far in a step"
            )
        if status == Status.UNCONVERGED:
            method: Any = self._method
            return sentence + (
                f"{method.max_sweeps} sweeps of a step left V above tolerance = {method.tolerance:g} J; take a "
                "larger penalty (a shorter dt needs one that grows as 1/dt^2), more max_sweeps, or "
                'on_unconverged="count", which accepts such a step with its error of the energy'
            )
        return sentence + (
            "a point meets its walls without end, as in a cusp; start it elsewhere, or take a shorter dt"
        )

    def _share_done(self, span: float) -> float:
        return float((1.0 - self._bodies.remaining / (span * self._unit)).mean())

    # --- Observation -------------------------------------------------------------------------------------

    def _blocks(self) -> Iterator[tuple[Any, Floats, Floats]]:
        """Yield the bodies by chunks: their numbers, positions and velocities.

        The round-off of BLAS depends on the number of columns, and that of a sum of NumPy on the layout in memory. With
        contiguous arrays a chunk has the same bits in every run that contains it.
        """
        for begin in range(0, len(self._bodies.remaining), CHUNK):
            some: Any = slice(begin, begin + CHUNK)
            if self._feed is not None:
                some = begin + np.flatnonzero(~np.isnan(self._feed.born_time[some]))
            both = self._bodies.position[..., some], self._bodies.velocity[..., some]
            yield some, np.ascontiguousarray(both[0]), np.ascontiguousarray(both[1])

    def _link_error(self) -> float:
        r, ends = self._bodies.position, self._body.links
        if not len(ends):
            return 0.0
        return float(0.5 * np.abs(squares_between(r, ends) / self._link_lengths()[:, None] ** 2 - 1.0).max())

    def _link_lengths(self) -> Floats:
        tied = self._body.points[self._body.links]
        return np.asarray(np.sqrt(((tied[:, 0] - tied[:, 1]) ** 2).sum(axis=1)))

    def _out_of_own(self) -> Iterator[Floats]:
        """Yield the distances of points outside of the cavities that other points carry."""
        r = self._bodies.position
        for cavity, (_surface, carrier, point) in zip(self._carried, self._body.cavities, strict=True):
            yield cavity.scene.distances_outside(r[:, point] - r[:, carrier])

    def observe(self) -> None:
        self._feed_in(0.0)
        self._observe(0.0)

    def _observe(self, moment: float) -> None:
        bodies, surfaces = self._bodies, len(self._scene.surfaces)
        self.state.impacts[:] = np.tile(bodies.impacts, len(self._body))
        if self.state.escape_time is not None:
            self.state.escape_time[:] = np.tile(bodies.escape_time, len(self._body))
        if self.state.absorbed_time is not None:
            self.state.absorbed_time[:] = np.tile(bodies.absorbed_time, len(self._body))
            # A body counts as one, not as its points.
            self.state.absorbed_wall[: len(bodies.absorbed_wall)] = bodies.absorbed_wall  # type: ignore[index]
        if self.state.image is not None:
            self.state.image[:] = np.tile(bodies.image, len(self._body))
        sums, errors, depths = zip(*(self._sums_of(*block, moment) for block in self._blocks()), strict=True)
        self._sums = np.ascontiguousarray(np.array(sums).T)
        own, cavities = len(self._own), len(self._body.cavities)
        counters = 0 if self._counting.counters is None else len(self._counting.counters.each)
        self._seen = {
            **gone_of(self.state._replace(escape_time=None), 0, self._surfaces_of_walls, surfaces),
            **summed(self._sums, self._owners, surfaces, (own, cavities, bodies.heat is not None), counters),
            "energy_error": max(errors),
            "max_penetration": float(max([*depths, *(out.max() for out in self._out_of_own())])),
            "impacts": int(bodies.impacts.sum()),
            "sliding": int(np.count_nonzero(bodies.lasting)),
            "unconverged": int(bodies.unconverged.sum()),
            "escaped": 0 if bodies.escape_time is None else int(np.count_nonzero(~np.isnan(bodies.escape_time))),
            "link_error": self._link_error(),
        }
        if self._feed is not None:
            self._seen |= self._feed.observed()
            self.state.born_time[:] = np.tile(self._feed.born_time, len(self._body))  # type: ignore[index]
        if self._rule.loop:
            self._seen["sweeps"] = int(bodies.sweeps.sum())

    def _sums_of(self, some: Any, r: Floats, v: Floats, moment: float) -> tuple[list[float], float, float]:
        """Return the sums of a chunk, as `summed` takes them, its largest error of the energy, and largest depth."""
        energies, bodies = self._energies, self._bodies
        kinetic, fall, elastic = energies.kinetic(v), energies.fall(r), energies.stored(r)
        total, lost = kinetic + fall + elastic, bodies.dissipated[some]
        work = bodies.work[some] + energies.led(r, v) - self._led_start[some]
        error, scale = np.abs(total + lost - work - self._energy_start[some]), self._scale[some]
        if self._scene.moves() or bodies.heat is not None:
            # The energy that walls have given is a scale too, as a body may start at rest.
            scale = np.maximum(scale, kinetic)
        scaled = np.divide(error, scale, out=np.zeros_like(error), where=scale > 0.0)
        pushed = np.ascontiguousarray(bodies.impulse[:, some]).sum(axis=1)
        for books in (bodies.wall_work, bodies.heat):
            if books is not None:
                given = np.ascontiguousarray(books[: len(self._owners), some])
                pushed = np.concatenate([pushed, given.sum(axis=1)])
                # The rest is the work of anchors.
                work = work - given.sum(axis=0) if len(bodies.path) else np.zeros_like(work)
        if bodies.crossed is not None:
            parts = (bodies.crossed.number, bodies.crossed.sums)
            passed = [np.ascontiguousarray(part[:, some]).sum(axis=1) for part in parts]
            pushed = np.concatenate([pushed, *passed])
        if bodies.image is not None:
            # The books have the energy of places in the cell.
            whole = np.einsum("x,xn->n", self._mass * self._falls, bodies.image[:, some])
            fall, total = fall + whole, total + whole
        numbers = (kinetic, fall, elastic, total, lost, bodies.sliding[some], work)
        depth = self._depths(some, r, moment).max(initial=0.0) if len(self._body.contacts) else 0.0
        return (
            [*(one.sum() for one in numbers), *np.concatenate([*energies.momenta(r, v), pushed])],
            scaled.max(initial=0.0).item(),
            float(depth),
        )

    def chunk_sums(self) -> Floats:
        return self._sums

    def seen(self) -> dict[str, Any]:
        return dict(self._seen)

    def require_admissible(self, seen: dict[str, Any], moment: float) -> None:
        r = self._bodies.position
        if not (math.isfinite(seen["total_energy"]) and np.isfinite(seen["angular_momentum"]).all()):
            good = np.isfinite(r).all(axis=(0, 1)) & np.isfinite(self._bodies.velocity).all(axis=(0, 1))
            failed = f"the frame at {moment:g} s failed at body {self._first + int(np.argmin(good))}"
            raise RunError(f"{failed}: {Status.NOT_FINITE.sentence}")
        if seen["max_penetration"] > self._deepest:
            raise RunError(
                f"the frame at {moment:g} s failed: a point of a body is {seen['max_penetration']:.3g} m outside its "
                "walls"
            )

    def _arrays(self) -> dict[str, Any]:
        kept = self._bodies._replace(watchers=None, mass=None)._asdict()
        return kept | {"scale": None if self._feed is None else self._scale}


def threads_with(count: int, scratch: int) -> ThreadPoolExecutor:
    """Return a pool of `count` started threads, each with room for `scratch` bytes of scratch arrays.

    Unused scratch memory costs nothing, as the system maps a stack page by page.
    """
    before = threading.stack_size(-(-(scratch + _REST) // _PAGE) * _PAGE)
    try:
        pool = ThreadPoolExecutor(count, thread_name_prefix="swarm")
        # Each task waits for all others, so that no thread runs two of them.
        together = threading.Barrier(count)
        for begun in [pool.submit(together.wait) for _ in range(count)]:
            begun.result()
    finally:
        threading.stack_size(before)
    return pool


def _state_of(
    bodies: Bodies, particles: Particles, size: tuple[int, int], opens: bool, moves: bool, laws: Laws,
    crossed: Crossed | None,
) -> BodyState:  # fmt: skip
    """Return the state of all copies at the start; `size` has the rows of multipliers and of walls."""
    (rows, walls), n, body = size, len(bodies), bodies.body
    anchors = [(q, body.anchors[q]) for q in led_points(body)]
    paths = [[motion.harmonic(start) for start in bodies.position[:, q].T] for q, motion in anchors]  # type: ignore[union-attr]
    # (A, 13, n): the start, velocity, cosine, sine and rate of each led point of each copy.
    path = np.array([[np.hstack(one) for one in copies] for copies in paths]).reshape(-1, n, 13).transpose(0, 2, 1)
    guess = np.full((3, rows, n), math.nan)
    guess[0] = 0.0
    whole = np.zeros((5, n), np.int64)
    return BodyState(
        position=particles.position.reshape(bodies.position.shape),
        velocity=particles.velocity.reshape(bodies.position.shape),
        remaining=np.zeros(n),
        guess=guess,
        path=np.ascontiguousarray(path),
        short=whole[0],
        lasting=np.zeros(n, np.int8),
        impacts=whole[1],
        impulse=np.zeros((walls, n)),
        dissipated=np.zeros(n),
        work=np.zeros(n),
        sliding=np.zeros(n),
        steps=whole[2],
        sweeps=whole[3],
        unconverged=whole[4],
        energy=np.zeros(n),
        free=np.zeros((len(body.contacts), n), np.int8) if opens else None,
        wall_work=np.zeros((walls, n)) if moves else None,
        heat=np.zeros((walls, n)) if laws.give_heat else None,
        **none_left(n, opens, laws.may_end),
        mass=np.full(n, body.mass_matrix.sum()),
        image=bodies.image,
        crossed=crossed,
    )
