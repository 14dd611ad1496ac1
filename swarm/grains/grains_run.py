"""The run of soft balls, which press on one another and on walls in fixed steps."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import observables
from ..ball_numbers import BallNumbers
from ..common.status import Status
from ..compiled_scene import CompiledScene
from ..contact.laws import NONE
from ..errors import RunError
from ..kernel.arrays import aligned_copy
from ..kernel.random import Seeding
from ..lanes.watching.watchers import Followed
from ..methods import Penalty
from ..methods.base import Method
from ..methods.fixed_step import steps_within
from ..particles import Particles
from ..run.base import OUTSIDE, Arrays, BaseRun
from ..run.doors import comers, require_free
from ..run.feeding import Feed, There
from ..run.impacts import ThreadLog
from ..run.observed import observed_of
from ..run.preflight.counting import Counting
from ..run.tally import Watched
from ..run.tiers import Tier
from ..state import Balls, Floats, State, none_left
from . import energy, lists, refused
from . import grain_arrays as arrays
from .booking import ContactTotals
from .drags import Drags, carry, kept_drags, room_for, set_drags
from .exits import stored_with_others
from .faces import Fields
from .grain_arrays import BEFORE, DONE, KEPT, LOST, SINCE, SKIN, TAKEN, X
from .heavy_walls import heavy_rows, motion_of, with_heavy
from .held import held_of
from .logged import Noting
from .matter import matter_of
from .overlaps import COLUMNS
from .passing import Passing
from .sent_off import Sender
from .step import MarchRule, World, march

# The first skin of the lists, in radii of the smallest ball. A ball may move by half the skin before lists end.
_SKIN = 0.4
# Room in the lists: pairs of each ball, contacts with walls of each ball, and the factor by which room grows.
_PAIRS, _AT_WALLS, _MORE = 6, 1, 1.5
# A birth that is due at most this part of a step after the start of the step comes at its start. A number of steps
# that no run has.
_WHOLE, _LATE = 1e-6, 1e18
# The widest skin, in radii of the largest ball: beyond it lists save nothing.
_WIDEST = 16.0


class GrainsRun(BaseRun):
    """The run of soft balls; the arrays of the particles become a part of its state."""

    def __init__(
        self, compiled: CompiledScene, particles: Particles, method: Method, threads: int, block_size: int | None,
        compile: str, seeding: Seeding, watched: Watched,
    ) -> None:  # fmt: skip
        scene, n, walls = compiled.scene, len(particles), len(compiled.numbering.surfaces_of_rows)
        radius = particles.radius
        assert radius is not None
        self._counting = Counting(scene, watched.counters)
        counters = self._counting.counters
        laws = compiled.laws or NONE
        holds = True if laws.may_wait else None
        self._matter = matter_of(compiled, method, radius)._replace(counters=counters, holds=holds)
        rubs, spin = self._matter.rubs, particles.spin
        if spin is None and rubs:
            spin = np.zeros((3, n))
        feed = None if particles.births is None else Feed(scene, particles, seeding.unsigned(), self._is_clear)
        balls = Balls(radius, np.zeros(n, np.int64), np.zeros(1), spin)
        openings, ends = self._matter.openings, laws.may_end
        # The energy that contacts store with a wall is lost when the wall becomes absent.
        loses = rubs or laws.may_dissipate or ends or scene.has_doors() or openings is not None
        loses = loses or any(one.damping is not None for one in (self._matter.pairs, *self._matter.walls))
        self.state = State(
            particles.position, particles.velocity, particles.mass, np.zeros(n), np.zeros(n), np.zeros(n, np.int64),
            np.zeros((walls * (2 if scene.moves() else 1), n)), np.zeros(n if loses else 0), None,
            heat=np.zeros((walls, n)) if laws.give_heat else None, balls=balls, openings=openings,
            crossed=self._counting.crossed(particles.position), **none_left(n, openings is not None, ends),
        )  # fmt: skip
        if particles.image is not None:
            self.state = self.state._replace(image=particles.image, period=compiled.cell())
        self._image = np.zeros((3, 0), np.int64) if particles.image is None else particles.image.copy()
        self._fields, self._heavy = Fields(compiled, radius), heavy_rows(scene)
        self._walls = self._walls_of(compiled, 0.0, 0.0)
        super().__init__(compiled, method, n, 1, Tier(compile, (self._matter, self._walls), n), seeding, watched)
        self._instants = scene.instants if scene.has_doors() else None
        # The energy that contacts with walls stored before the current instant [J], and the length of a step [s].
        self._stored_before: NDArray[np.float64] | None = None
        self._step, self._span = self._matter.h, 0.0
        state = self.state
        books = ContactTotals(
            balls.collisions,
            state.impacts,
            state.impulse,
            state.dissipated,
            balls.virial,
            np.zeros(1, np.int64),
            np.zeros(1, np.int64),
            np.zeros(1),
            np.zeros(COLUMNS),
            state.escape_time,
            state.heat,
            np.zeros(n, np.int64) if laws.send_off else None,
            state.absorbed_time,
            state.absorbed_wall,
        )
        if feed is not None:
            self._feed, self.state = feed, state._replace(born_time=feed.born_time)
        there = np.arange(n) if feed is None else np.flatnonzero(~np.isnan(feed.born_time))
        at_ends = laws._replace(restitution=None, friction=None)
        followed = Followed(Passing(state.mass, state.crossed, state.period, self._pages()), None)
        self._world = World(
            self._rows_of(there),
            *self._room(len(there), _PAIRS * n, _AT_WALLS * n, n if self._fields.faces else None), books,
            followed=None if counters is None else followed,
            sender=Sender(at_ends, seeding) if laws.send_off else None,
            held=None if holds is None else held_of(state.mass, rubs), heavy=self._heavy,
        )  # fmt: skip
        self._clock = np.zeros(arrays.CLOCK)
        self._clock[SKIN] = _SKIN * radius.min()
        self._scale, self._stored = 0.0, math.nan
        self._ball_numbers = BallNumbers(scene, particles)
        self._choose_tier()
        self._list()

    def _walls_of(self, compiled: CompiledScene, moment: float, skin: float) -> Any:
        """The walls in the frame, or the piece of a frame, that ends at a moment [s]; `skin` is the lists' skin [m]."""
        walls, heavy = self._fields.walls(moment, skin), self._heavy
        return walls if heavy is None else with_heavy(walls, compiled, heavy, self._matter.h)

    def _is_clear(self, place: Floats, radius: float, moment: float) -> bool:
        """Whether a place is clear of the walls with a mass that are present at a moment [s]."""
        if self._heavy is None:
            return True
        # The place in the frame of each wall, in which the wall is as the scene describes it.
        places = place[:, None] - motion_of(self._heavy).shift
        images, size = self._scene.pieces_of_balls(radius).images, np.array([radius])
        return all(
            one.reaching_outside(places[:, [k]], size)[0] <= 0.0
            for k, i in enumerate(self._heavy.number)
            if self._scene.surfaces[i].is_there(moment)
            for one in images[i]
        )

    def _rows_of(self, some: NDArray[np.int64]) -> arrays.Grains:
        """The rows of particles with these numbers."""
        state, spin = self.state, self.state.spin
        assert state.radius is not None
        turning = None if spin is None or not self._matter.rubs else spin[:, some]
        made = arrays.grains_of(
            state.position[:, some], state.velocity[:, some], state.radius[some], state.mass[some], turning
        )  # fmt: skip
        return made._replace(number=some)

    # --- Births --------------------------------------------------------------------------------------------

    def _stop(self, span: float, moment: float) -> float:
        """The step before which a birth is due, in the frame of the length `span` [steps] that ends at a moment [s]."""
        steps = self._steps_in(span)
        if self._feed is None:
            return steps
        # The first step that begins at the birth or later, and not the current one: its births have been dealt with.
        before = self._steps_before(span, moment)
        due = math.ceil(min(self._feed.next() / self._matter.h, _LATE) - _WHOLE - before)
        return min(steps, max(float(due), float(self._clock[DONE]) + 1.0))

    def _steps_before(self, span: float, moment: float) -> float:
        """The steps, of the present length, before the frame or the piece of a frame."""
        return self._method.span("time", moment) - span if self._instants is None else (moment - span) / self._matter.h

    def _feed_in(self, span: float, moment: float) -> None:
        """Add the balls that are due before the next step."""
        feed = self._feed
        if feed is None:
            return
        grains = self._world.grains
        now = (self._steps_before(span, moment) + float(self._clock[DONE])) * self._matter.h
        slack = _WHOLE * self._matter.h
        if feed.next() > now + slack:
            return
        there = There(
            grains.place[:, X : X + 3].T, grains.speed[:, BEFORE : BEFORE + 3].T, grains.place[:, arrays.RADIUS]
        )  # fmt: skip
        born = feed.come(now, there, slack)
        if not born.number.size:
            return
        kept = kept_drags(self._tier.kernel, self._world)
        state = self.state
        state.position[:, born.number], state.velocity[:, born.number] = born.position, born.velocity
        self._counting.begin(state.crossed, born.number, born.position)
        self._world = self._world._replace(grains=arrays.beside(grains, self._rows_of(born.number)))
        self._make_room()
        self._list(kept)

    # --- Lists ---------------------------------------------------------------------------------------------

    def _list(self, kept: Drags | None = None) -> None:
        """Make the lists of neighbours anew, with the `kept` numbers of contacts if lists have changed since."""
        clock, kernel = self._clock, self._tier.kernel
        kept = kept_drags(kernel, self._world) if kept is None else kept
        self._wrap()
        self._drop_gone()
        grains, skin = self._world.grains, float(clock[SKIN])
        if self._world.near.wall_is_open is not None:
            self._world.near.wall_is_open[:] = False
        reach = 2.0 * float(grains.place[:, arrays.RADIUS].max(initial=0.0)) + skin
        cells, order = lists.cells_of(grains.place[:, X : X + 3], reach, self._matter.period)
        for rows in (grains.number, grains.place, grains.speed, grains.change, grains.spin):
            if rows is not None:
                rows[:] = rows.take(order, axis=0)
        self._list_near(cells, skin)
        if self._heavy is not None:
            self._heavy.listed[:, :3] = self._heavy.place[:, X : X + 3]
        set_drags(kernel, self._world, kept)
        clock[SINCE] = 0.0

    def _drop_gone(self) -> None:
        """Take balls that escaped, or were absorbed, out of the world; book the energy of their contacts as lost."""
        world = self._world
        if not (gone := self.state.gone()[world.grains.number]).any():
            return
        lost = self._stored_at(self._walls, self._left())[world.grains.number] * gone
        lost += stored_with_others(self._matter, world, gone)
        self.state.dissipated[world.grains.number] += lost
        # These balls stay where they are.
        energy.show(world.grains, self.state, world.held)
        stay = {name: aligned_copy(rows[~gone]) for name, rows in world.grains._asdict().items() if rows is not None}
        self._world = world._replace(grains=world.grains._replace(**stay))
        self._make_room()

    def _left(self) -> float:
        """The rest of the current frame, or of the current piece of a frame [s]."""
        return (self._steps_in(self._span) - float(self._clock[DONE])) * self._matter.h

    def _list_near(self, cells: lists.CellOrder, skin: float) -> None:
        """List pairs, and balls near walls, with as much room as needed."""
        kernel, grains, left = self._tier.kernel, self._world.grains, self._left()
        if self._fields.reaches(skin):
            self._walls = self._walls_of(self._compiled, self._moment, skin)
        while True:
            near = self._world.near
            pairs = kernel(lists.list_pairs)(self._matter.period, grains, near, cells, skin)
            touching = kernel(lists.list_walls)(self._walls, self._fields.faces, grains, near, skin, left)
            found = pairs, touching, 0 if near.used is None else int(near.used[0])
            if all(need <= have for need, have in zip(found, _sizes(near), strict=True)):
                return
            self._make_room(*found)

    def _wrap(self) -> None:
        """Wrap all balls into the periodic cell."""
        grains, image = self._world.grains, self.state.image
        for axis, length in enumerate(self._scene.period or ()):
            if length is not None:
                assert image is not None
                x = grains.place[:, X + axis].copy()
                cells = np.floor(x / length)
                inside = x - cells * length
                grains.place[:, X + axis] = inside
                grains.place[:, LOST + axis] += (x - inside) - cells * length
                self._image[axis, grains.number] += cells.astype(np.int64)

    def _room(self, n: int, pairs: int, touching: int, members: int | None) -> tuple[arrays.Neighbours, arrays.Touches]:
        """Return arrays for n balls, with room for pairs, balls at walls and members of fields, None without fields."""
        walls, matter = len(self._owners), self._matter
        kept = KEPT if self._impacts is not None else (6 if matter.rolls else 3) if matter.rubs else 0
        near = arrays.near_of(n, walls, pairs, touching, kept, members, matter.openings is not None)
        return near, arrays.touches_of(n, walls, pairs, touching, near.listed)

    def _make_room(self, *found: int) -> None:
        """Make empty lists for the present balls, with the room of the old lists, and more than the numbers `found`."""
        near, wanted = self._world.near, zip(found or (0, 0, 0), _sizes(self._world.near), strict=True)
        pairs, touching, members = (have if need <= have else int(_MORE * need) for need, have in wanted)
        number = self._world.grains.number
        near, touches = self._room(len(number), pairs, touching, None if near.listed is None else members)
        self._world = self._world._replace(near=near, touches=touches)

    def _list_again(self) -> None:
        """Make the lists anew, with a wider skin if they did not hold for a single step."""
        if self._clock[SINCE] == 0.0:
            self._clock[SKIN] *= 2.0
            largest = self.state.balls.radius.max()  # type: ignore[union-attr]
            if not self._clock[SKIN] <= _WIDEST * largest:
                raise RunError(refused.too_far(self._world, 0.5 * _WIDEST, float(largest), self._matter.h))
        self._list()

    # --- At an instant -----------------------------------------------------------------------------------

    def _switch(self, instant: float) -> None:
        if instant not in self._scene.instants:
            return
        if (came := comers(self._scene, instant)).any():
            seen, deepest = self._observed, OUTSIDE * self._scene.finite_size()
            # The scene with the walls with a mass at their present places.
            scene = self._scene if seen is None else self._scene.placed(seen.position, seen.orientation)
            require_free(scene, self._seen_state(), came, deepest, instant, self._first)
        self._stored_before = self._stored_at(self._walls_of(self._compiled, instant, float(self._clock[SKIN])), 0.0)

    def _stored_at(self, walls: Any, remaining: float) -> NDArray[np.float64]:
        """The energy that contacts of each ball with walls store with `remaining` [s] of the frame left, (N,) [J]."""
        world, found = self._world, np.zeros(len(self.state.mass))
        kernel = self._tier.kernel(energy.store_at_walls)
        kernel(self._matter, walls, remaining, world.grains, world.near, found)
        return found

    def _length(self, duration: float) -> float:
        # Each piece has its own length of a step.
        return duration

    def _clock_time(self, moment: float) -> float:
        return super()._clock_time(moment) if self._instants is None else moment

    def _pages(self) -> Any:
        """The cells in which the balls were when the lists were made, for the log of contacts."""
        return None if self._impacts is None or self.state.image is None else self._image

    # --- A frame -------------------------------------------------------------------------------------------

    def _begin(self) -> None:
        self._feed_in(0.0, 0.0)

    def _prepare(self, span: float, moment: float) -> None:
        self._span = span
        if self._instants is not None:
            # Steps have equal lengths, so that the last one ends at the instant.
            openings = self._compiled.openings(moment)
            self._matter = self._matter._replace(h=span / self._steps_in(span), openings=openings)
            self.state = self.state._replace(openings=openings)
        self._walls = self._walls_of(self._compiled, self._moment, float(self._clock[SKIN]))
        if not self._cut_short:
            self._clock[DONE] = 0.0
        if self._instants is not None:
            if self._stored_before is not None:
                # The energy that contacts stored with walls is lost when these become absent.
                self._list()
                self.state.dissipated[:] += self._stored_before - self._stored_at(self._walls, span)
                self._stored_before = None
            if not self._cut_short and self._fields.any_moves():
                # The age of the lists is counted in steps, and the length of a step may change here.
                self._list()
        if not self._cut_short and self._done[0] == 0:
            self._world.books.overlap[0] = 0.0
        self._clock[TAKEN] = 0.0

    def _steps_in(self, span: float) -> float:
        """The steps of a frame, or of a piece of a frame; `span` is in the unit of `advance`."""
        return span if self._instants is None else steps_within(span, self._step)

    def _turn(self, span: float, moment: float, writing: float, latest: float) -> tuple[int, int]:
        status, stop, steps = Status.LEASE_ENDED.value, -1.0, self._steps_in(span)
        page = self._open_page(moment)
        while status in (Status.LEASE_ENDED, Status.LOG_FULL) or (status == Status.DONE and stop < steps):
            self._feed_in(span, moment)
            rule = MarchRule(steps, stop := self._stop(span, moment), self._watch.passes, moment)
            world = self._watched_world(page)
            status = self._call(march, self._matter, self._walls, world, self._clock, rule, latest=latest)
            if status == Status.LEASE_ENDED:
                self._list_again()
            elif status == Status.LOG_FULL:
                page.turn()
        page.close()
        if status == Status.DONE:
            # The births at the end of the frame.
            self._feed_in(span, moment)
        return status, 0

    def _watched_world(self, page: ThreadLog | None = None) -> World:
        """The world with a log of contacts and with the counts of members of the calling thread."""
        world, tally, log = self._world, self._tally, self._log_of(page)
        noting = None if log is None else Noting(log, self.state.period, self._pages())
        world = world._replace(noting=noting, counts=None if tally is None else tally.counts())
        if all(one is None for one in (world.sender, world.noting, world.counts)):
            return world
        # The members change when the skin becomes wider than the images of a cell.
        return world._replace(places=self._fields.places())

    def _failure(self, status: Status, item: int, span: float, moment: float) -> str:
        # The start of the step that failed.
        moment -= (self._steps_in(span) - self._clock[DONE]) * self._matter.h
        if status == Status.UNSOLVED:
            return refused.unsolved(moment, self._matter.h)
        if status == Status.SENT_WRONG:
            return refused.sent_wrong(self._compiled, self._world, moment + self._matter.h)
        assert isinstance(self._method, Penalty)
        return refused.passed(self._compiled, self._method, self._matter, self._world, status, moment)

    def calls(self) -> Iterator[tuple[Any, tuple[Any, ...]]]:
        world, matter = self._world, self._matter
        cells, _order = lists.cells_of(np.zeros((1, 3)), 1.0, None)
        yield lists.list_pairs, (matter.period, world.grains, world.near, cells, 0.0)
        yield lists.list_walls, (self._walls, self._fields.faces, world.grains, world.near, 0.0, 0.0)
        if world.near.drag is not None:
            yield carry, (world.grains.number, world.near, room_for(world.near), False)
        rule = MarchRule(0.0, 0.0, self._watch.passes, 0.0)
        yield march, (matter, self._walls, self._watched_world(), self._clock, rule)
        yield energy.stored, (matter, self._walls, world.grains, world.near)
        if self._instants is not None or matter.openings is not None:
            into = self.state.dissipated
            yield energy.store_at_walls, (matter, self._walls, 0.0, world.grains, world.near, into)
        yield observables.observe, self._observing()

    def _show(self, moment: float) -> None:
        energy.show(self._world.grains, self.state, self._world.held)
        if self._heavy is not None:
            self._observed = observed_of(self._scene, motion_of(self._heavy), moment)
        image, position = self.state.image, self.state.position
        for axis, length in enumerate(self._scene.period or ()):
            if length is not None and image is not None:
                cells = np.floor(position[axis] / length)
                position[axis] -= cells * length
                # A place just below 0 is rounded to the other face.
                at_face = position[axis] >= length
                position[axis, at_face] = 0.0
                image[axis] = self._image[axis] + cells.astype(np.int64) + at_face

    def _observe(self, moment: float) -> None:
        world, walls = self._world, self._walls
        stored, overlap = self._tier.kernel(energy.stored)(self._matter, walls, world.grains, world.near)
        # At the start no step has set the largest overlap.
        self._stored, world.books.overlap[0] = stored, max(overlap, world.books.overlap[0])
        super()._observe(moment)

    def _waiting(self) -> Any:
        held = self._world.held
        return False if held is None else ~np.isnan(held.until)

    def observe(self) -> None:
        super().observe()
        self._scale = self._scale_of(self._summary())

    def _with_stored(self, seen: dict[str, Any]) -> dict[str, Any]:
        books = self._world.books
        return {
            **seen, "contact_energy": self._stored, "total_energy": seen["total_energy"] + self._stored,
            "unconverged": int(books.lagging[0]), "largest_overlap": float(books.overlap[0]),
        }  # fmt: skip

    def _scale_of(self, seen: dict[str, Any]) -> float:
        """The largest sum so far of kinetic and contact energy, and of the energy that weight may add."""
        pull = 0.0 if self._scene.gravity is None else math.hypot(*self._scene.gravity)
        mass, walls, own = float(self._seen_state().mass.sum()), self._observed, 0.0
        if walls is not None and self._heavy is not None:
            mass += float(np.reciprocal(self._heavy.place[:, arrays.LIGHTNESS]).sum())
            own = float((walls.kinetic + np.abs(walls.potential)).sum())
        weight = mass * pull * self._scene.finite_size()
        return max(self._scale, float(seen["kinetic_energy"] + seen["contact_energy"] + weight + own))

    def _share_done(self, span: float) -> float:
        return float(self._clock[DONE] / self._steps_in(span))

    def _arrays(self) -> dict[str, Any]:
        world, state = self._world, self.state
        kept = {
            "clock": self._clock, "image": self._image, "grains": world.grains, "near": world.near,
            "books": world.books, "held": None if world.held is None else world.held._replace(mass=None),
            "crossed": state.crossed, "walls": self._heavy,
        }  # fmt: skip
        if state.escape_time is not None or state.absorbed_time is not None:
            # The places and velocities of balls that have left.
            kept |= {"position": state.position, "velocity": state.velocity, "spin": state.spin}
        return kept

    def may_grow(self, name: str) -> bool:
        return name.startswith(("grains.", "near."))

    def restore(self, arrays: Arrays, cut_short: bool) -> None:
        self.observe()
        self._world = self._world._replace(grains=self._rows_of(arrays["grains.number"]))
        members = arrays["near.listed"].size if "near.listed" in arrays else None
        pairs, touching = (arrays[f"near.{name}"].size for name in ("mate", "slot"))
        near, touches = self._room(len(arrays["grains.number"]), pairs, touching, members)
        self._world = self._world._replace(near=near, touches=touches)
        super().restore(arrays, cut_short)
        self._show(self._moment)


def _sizes(near: arrays.Neighbours) -> tuple[int, int, int]:
    """Return the room for pairs, for balls at walls, and for members of fields."""
    return near.mate.size, near.slot.size, 0 if near.listed is None else near.listed.size
