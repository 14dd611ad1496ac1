"""The run of balls that meet one another and walls at instants."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from .. import observables
from ..ball_numbers import BallNumbers
from ..common.status import Status
from ..compiled_scene import CompiledScene
from ..kernel.random import Seeding
from ..methods.base import Method
from ..particles import Particles
from ..run import failures
from ..run.base import Arrays, BaseRun
from ..run.doors import comers, require_free
from ..run.feeding import Feed, There
from ..run.impacts import ThreadLog
from ..run.preflight.counting import Counting
from ..run.tally import Watched
from ..run.tiers import Tier
from ..scene import Scene
from ..state import Balls, Floats, State, none_left
from .colliding import events
from .colliding.bounce import Gates
from .colliding.box import CollisionRule, CollisionTotals
from .colliding.clock import CLOCK, COLLISIONS, EPOCHS, LENGTH, REACH
from .colliding.described import come, described, reach_of, there_at
from .colliding.next_collision import FIXED
from .colliding.queue import FIRST
from .colliding.resting import warn_of_rest
from .colliding.rows import FACE, MET, WHOLES
from .colliding.window import END, windows_of
from .reacting.described import scenery_of


class CollidingRun(BaseRun):
    """The run of balls that meet one another and walls at instants; the arrays of the particles become its state."""

    def __init__(
        self, compiled: CompiledScene, particles: Particles, method: Method, threads: int, block_size: int | None,
        compile: str, seeding: Seeding, watched: Watched,
    ) -> None:  # fmt: skip
        assert particles.radius is not None
        scene, n, rows = compiled.scene, len(particles), len(compiled.numbering.surfaces_of_rows)
        self._radius = float(particles.radius.max())
        box, self._flock, epoch = described(compiled, particles)
        self._clock = np.zeros(CLOCK)
        self._clock[[LENGTH, REACH]] = epoch, reach_of(box.grid)
        self._windows = windows_of(compiled, self._clock)
        openings = compiled.openings()
        rough = box.turning is not None and box.turning.friction is not None
        every = scenery_of(compiled, 0.0).each_laws()
        loses = any(one.may_dissipate or one.loses for one in every) or box.loss is not None or rough
        ends = any(one.may_end for one in every)
        # The number of collisions of each ball is in its rows.
        met, rounds = self._flock.tag.reshape(n, WHOLES)[:, MET], self._flock.link.reshape(n, WHOLES)[:, FACE]
        balls = Balls(particles.radius, met, np.zeros(1), particles.spin, rounds)
        self._counting = Counting(scene, watched.counters)
        # The energies of balls are not kept.
        unused = np.broadcast_to(0.0, n)
        # The times of flights are those of their start, so that frames have no influence on the motion.
        self.state = State(
            particles.position, particles.velocity, particles.mass, *2 * (unused,),
            np.zeros(n, np.int64), np.zeros((2 * rows if scene.moves() else rows, 1)), np.zeros(n if loses else 0),
            None, None, np.zeros((rows, 1)) if any(one.give_heat for one in every) else None,
            image=particles.image, period=compiled.cell(), balls=balls, openings=openings,
            crossed=self._counting.crossed(particles.position), **none_left(n, openings is not None, ends),
        )  # fmt: skip
        state, self._balls, gates = self.state, balls, None
        feed = None if particles.births is None else Feed(scene, particles, seeding.unsigned(), self._is_clear)
        if openings is not None or ends or feed is not None:
            gates = Gates(openings, state.escape_time, state.absorbed_time, state.absorbed_wall)
        box = box._replace(window=None if self._windows is None else self._windows.numbers, gates=gates)
        self._box = self._with_heavy(compiled, box)
        if any(one.send_off for one in every):
            self._box = self._box._replace(seeding=seeding)
        super().__init__(compiled, method, n, threads, Tier(compile, self._box, n), seeding, watched)
        if feed is not None:
            self._feed, self.state = feed, self.state._replace(born_time=feed.born_time)
        self._box = self._box._replace(watchers=self._watchers())
        if state.crossed is not None:
            self._flock = self._flock._replace(followed=np.zeros(n))
        self._books = CollisionTotals(
            state.impulse, state.dissipated, state.impacts, balls.virial, state.image, state.heat, state.mass,
            state.crossed, None if self._windows is None else state.impacts.copy(),
        )  # fmt: skip
        self._ball_numbers = BallNumbers(scene, particles)
        self._rest_was_reported = False
        self._frame_before = 0.0  # [s]
        self._walls = self._walls_seen(0.0)
        self._choose_tier()

    def _is_clear(self, place: Floats, radius: float, moment: float) -> bool:
        """Whether a ball at a place (3,) is clear of the walls with a mass."""
        return True

    def _with_heavy(self, compiled: CompiledScene, box: Any) -> Any:
        """The `Domain` of the balls, with the walls with a mass."""
        return box

    def _prepare(self, span: float, moment: float) -> None:
        self._frame_before = moment - span
        if self._books.before is not None and not self._cut_short:
            np.copyto(self._books.before, self.state.impacts)

    def _turn(self, span: float, moment: float, writing: float, latest: float) -> tuple[int, int]:
        page = self._open_page(moment)
        status = ball = int(Status.LEASE_ENDED)
        while status in (Status.LEASE_ENDED, Status.LOG_FULL):
            stop = moment if self._feed is None else min(moment, self._feed.next())
            rule = CollisionRule(stop, self._watch.passes)
            status, ball = self._call(
                events.take, self._watched(page), self._flock, self._books, self._clock, rule, latest=latest
            )
            if status == Status.LOG_FULL:
                page.turn()
            elif status == Status.LEASE_ENDED:
                self._next_window()
            elif status == Status.DONE and self._feed is not None and self._feed.next() <= moment:
                self._feed_in(stop)
                status = Status.LEASE_ENDED
        if status == Status.DONE and self.state.crossed is not None:
            self._follow(moment, page)
        page.close()
        self._rest_was_reported = self._rest_was_reported or warn_of_rest(self._box, self._clock)
        return status, ball

    def _watched(self, page: ThreadLog) -> Any:
        """The `Domain` of the balls, with the watchers of the calling thread."""
        return self._box._replace(watchers=self._watchers(page))

    def _follow(self, moment: float, page: ThreadLog) -> None:
        """Count the crossings of all flights until the end of a frame."""
        followed, now = 0, self._since(moment)
        while followed < self.state.mass.size:
            followed = self._call(
                events.follow_all, self._watched(page), self._flock, self._books, self._clock, now, followed
            )
            if followed < self.state.mass.size:
                page.turn()

    def _feed_in(self, moment: float) -> None:
        """Add the balls that are due at a moment [s]."""
        assert self._feed is not None
        now = self._since(moment)
        born = self._feed.come(moment, There(*there_at(self._flock, self._balls.radius, self._box.pull, now)))
        for i, position, velocity in zip(born.number.tolist(), born.position.T, born.velocity.T, strict=True):
            self.state.position[:, i], self.state.velocity[:, i] = position, velocity
            come(self._flock, self._box.grid, i, now, position, velocity)
            self._counting.begin(self.state.crossed, [i], position[:, None])
            self._call(events.welcome, self._box, self._flock, i, now)

    def _show(self, moment: float) -> None:
        self._show_at(self._since(moment))
        self._walls = self._walls_seen(moment)

    def _show_at(self, now: float) -> None:
        """Write the arrays of the state at a time of the epoch [s]."""
        self._in_parts(events.show, self._box, self._flock, self.state, now, last=self.state.mass.size)

    def _since(self, moment: float) -> float:
        """Return a moment [s] as a time of the epoch [s]."""
        return float(moment - self._clock[EPOCHS] * self._clock[LENGTH])

    def _next_window(self) -> None:
        """Begin the next window of walls that move or become absent or present; all balls look for their walls anew."""
        windows = self._windows
        assert windows is not None
        instant, now = windows.instant(), float(windows.numbers[END])
        if windows.is_at_epoch():
            self._call(events.next_epoch, self._flock, self._clock)
            now = 0.0
        windows.begin(now)
        self._set_window()
        if instant is not None and (came := comers(self._scene, instant)).any():
            self._show_at(now)
            require_free(self._scene_at(instant), self._seen_state(), came, self._deepest, instant, self._first)
        self._look_anew(now)

    def _scene_at(self, instant: float) -> Scene:
        """The scene with the walls with a mass at their places at an instant [s]."""
        return self._scene

    def _look_anew(self, now: float) -> None:
        """Find the next event of every ball after a time of the epoch [s]; a negative time is the start of the run."""
        self._in_chunks(events.begin, self._box, self._flock, now)
        self._call(events.order, self._flock)

    def _set_window(self) -> None:
        """Set the walls of the window, and mark the cells near them."""
        if self._windows is not None:
            scenery, gates = self._windows.scenery(), self._box.gates
            if gates is not None:
                gates = gates._replace(openings=scenery.openings)
                self.state = self.state._replace(openings=gates.openings)
            self._box = self._box._replace(walls=scenery.given, gates=gates)
        self._in_parts(events.mark, self._box, self._radius, last=int(self._box.grid.x.count) + 2)

    def _failure(self, status: Status, item: int, span: float, moment: float) -> str:
        place, _v = self._flock.at(self._box.pull, item, self._flock.time(item))
        now, radius = self._now(), float(self._balls.radius[item])
        return failures.after(self._scene_at(now), moment - span, item, status, place, now, radius)

    def collisions(self) -> float:
        """The number of collisions since the start."""
        return float(self._clock[COLLISIONS])

    def _now(self) -> float:
        """The time of the next event since the start [s]."""
        return float(self._clock[EPOCHS] * self._clock[LENGTH] + self._flock.key[FIRST])

    def calls(self) -> Iterator[tuple[Any, tuple[Any, ...]]]:
        part, box, flock = (0, 0), self._box, self._flock
        yield events.mark, (box, self._radius, *part)
        yield events.begin, (box, flock, -1.0, *part)
        yield events.order, (flock,)
        if self._feed is not None:
            yield events.welcome, (box, flock, 0, 0.0)
        yield events.take, (box, flock, self._books, self._clock, CollisionRule(0.0, self._watch.passes))
        yield events.show, (box, flock, self.state, 0.0, *part)
        if self.state.crossed is not None:
            yield events.follow_all, (box, flock, self._books, self._clock, 0.0, 0)
        if self._windows is not None:
            yield events.next_epoch, (flock, self._clock)
        yield observables.observe, self._observing()

    def _walls_seen(self, moment: float) -> Any:
        """The walls at a frame."""
        return self._box.walls if self._windows is None else self._compiled.walls(moment)

    def _begin(self) -> None:
        if self._windows is not None:
            self._windows.begin(0.0)
        self._set_window()
        self._look_anew(-1.0)
        if self._feed is not None and self._feed.next() <= 0.0:
            self._feed_in(0.0)

    def _waiting(self) -> Any:
        kinds = self._box.kinds
        return kinds.masses() == FIXED if self._flock.holds is not None else False

    def _scale_of(self, seen: dict[str, Any]) -> float:
        turning = seen.get("rotational_energy", 0.0)
        return float(seen["kinetic_energy"] + turning + seen["dissipated_energy"] + abs(seen["potential_energy"]))

    def _share_done(self, span: float) -> float:
        return min(1.0, max(0.0, (self._now() - self._frame_before) / span))

    def _arrays(self) -> dict[str, Any]:
        flock, state = self._flock, self.state
        return {
            "flight": flock.flight, "event": flock.event, "node": flock.node, "key": flock.key, "item": flock.item,
            "head": flock.head,
            "impulse": state.impulse, "dissipated": state.dissipated, "impacts": state.impacts,
            "virial": self._books.virial, "clock": self._clock,
            "start": self._start, "position": state.position, "velocity": state.velocity,
            "last": flock.last, "followed": flock.followed, "image": state.image, "heat": state.heat,
            "escape_time": state.escape_time,
            "spin": self._balls.spin, "absorbed_time": state.absorbed_time, "absorbed_wall": state.absorbed_wall,
            "window": None if self._windows is None else self._windows.numbers,
            "held": None if flock.holds is None else self._box.kinds.masses(), "crossed": state.crossed,
            "impacts_before": self._books.before,
        }  # fmt: skip

    def restore(self, arrays: Arrays, cut_short: bool) -> None:
        self.observe()
        super().restore(arrays, cut_short)
        if self._windows is not None:
            self._set_window()
