"""The state of a run of bodies, and the threads that advance it; what `engine.Run` is for particles."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..bodies.numbers import led_points, most_contacts_of, own_surfaces, ties_of, touching_of, walls_of
from ..bodies.state import Bodies
from ..contact.energy import contact_energy
from ..errors import RunError
from ..kernel.vector import column
from ..lanes.tied.advance import advance_bodies
from ..lanes.tied.arrays import BodyState, Rule
from ..lanes.tied.contacts import MOST_CONTACTS
from ..methods.base import Method
from ..observables import CHUNK
from ..particles import Floats, Particles, State
from ..scene import Scene
from ..status import Status
from .stack import threads_with
from .tiers import Tier
from .waiting import result_of

# Round-off of a position on a wall, as a part of the scene's size.
_ROUND_OFF = 8.0 * np.finfo(np.float64).eps
# Beyond this part of the scene's size a point outside its walls is an error.
_OUTSIDE = 1e-9
# Bytes of the lanes of a thread, which are on its stack, if one lane takes no more, and the most lanes.
_STACK, _MOST_LANES = 1 << 20, 32
# Bodies that a thread draws at a time.
_AT_ONCE = 256
_NEVER = 2**62
# Suzuki's composition: five steps of second order are one of fourth.
_OUTER = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))
STAGES = {2: (1.0,), 4: (_OUTER, _OUTER, 1.0 - 4.0 * _OUTER, _OUTER, _OUTER)}


class BodyRun:
    """The copies of a body, advanced from frame to frame; a context that ends its threads."""

    def __init__(
        self, scene: Scene, bodies: Bodies, particles: Particles, method: Method, threads: int,
        block_size: int | None = None, compile: str = "always", first: int = 0,
    ) -> None:  # fmt: skip
        self._scene, self._body, self._method, self._first = scene, bodies.body, method, first
        self._law = method.law()
        looped = method.has_multipliers()
        n, points, walls = len(bodies), len(bodies.body), len(scene.owners())
        self._owners = scene.owners()
        self._ties = ties_of(bodies.body, self._law.alpha if looped else None)
        self._touching = touching_of(bodies.body, self._ties, scene)
        own = own_surfaces(bodies.body)
        self._carried = [Scene([surface]) for surface, _carrier, _point in bodies.body.cavities]
        self._chains = scene.chain(own=()), scene.chain(own=own)
        rows, walls = len(self._ties.ends) + len(bodies.body.guides), walls + len(own)
        shape = 3, points, n
        none, never = np.zeros(0), np.zeros((3, rows, n))
        never[1:] = math.nan
        self._bodies = BodyState(
            particles.position.reshape(shape), particles.velocity.reshape(shape), np.zeros(n), never,
            self._paths(bodies), np.zeros(n, np.int64), np.zeros(n, np.int8), np.zeros(n, np.int64),
            np.zeros((walls, n)), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n, np.int64),
            np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n),
        )  # fmt: skip
        impacts = np.zeros(points * n, np.int64)
        # What files take of a run.
        self.state = State(
            particles.position, particles.velocity, particles.mass, none, none, impacts, np.zeros((walls, 0)), none,
            None,
        )  # fmt: skip
        size = scene.finite_size()
        self._deepest = _OUTSIDE * size if method.is_rigid() else math.inf
        # Sines of two libraries differ in the last bit.
        choice = "always" if compile == "auto" and led_points(bodies.body) else compile
        self._tier = Tier(choice, self._chains, n * points)
        soft = walls_of(method)
        contacts = most_contacts_of(self._touching, soft)
        per_lane = 8 * (24 * points + 10 * rows + rows * rows + 20 * contacts)
        self._lanes = max(1, min(_MOST_LANES, _STACK // per_lane, n))
        room = _ROUND_OFF * max(size, scene.extent())
        noise = room / math.sqrt(min([*(self._link_lengths() ** 2), size * size]))
        gravity = np.array(scene.gravity or (0.0, 0.0, 0.0))
        strict = getattr(method, "on_unconverged", "") == "raise"
        dt, stages = method.dt, np.array(STAGES[getattr(method, "order", 2)])  # type: ignore[attr-defined]
        self._rule = Rule(dt, stages, gravity, 0.0, room, noise, self._lanes, soft, contacts, looped, strict)
        # Frames of fixed steps are counted in steps.
        self._unit = 1.0 if soft is None or soft.is_cut else dt
        self._size = max(1, block_size or _AT_ONCE)
        self._halt = np.full(1, _NEVER)
        self._threads = min(threads, math.ceil(n / self._size))
        at_once = _at_once(rows, max(contacts, 3 * MOST_CONTACTS))
        self._pool = threads_with(self._threads, self._lanes * per_lane + at_once)
        self._cut_short = False
        pull = math.hypot(*gravity) * self._ties.mass.sum()
        self._led_start, self._start, self._scale = np.zeros((3, n))
        for some, r, v in self._blocks():
            kinetic = self._kinetic(v)
            self._led_start[some] = self._led_energy(r, v)
            self._start[some] = start = kinetic + self._fall(r) + self._elastic(r) + self._stored(r)
            self._scale[some] = np.maximum(np.abs(start), kinetic) + pull * size
        self._bodies.energy[:] = self._start
        self._seen: dict[str, Any] = {}
        self._sums = np.zeros((0, 0))
        self._choose_tier()

    def __enter__(self) -> "BodyRun":
        return self

    def __exit__(self, *error: object) -> None:
        self.halt()
        self._pool.shutdown(wait=True)

    def halt(self, passes: int = 0) -> None:
        """Make every kernel call of this frame return after so many passes; 0: at once."""
        np.minimum(self._halt, passes, out=self._halt)

    def calls(self) -> list[tuple[Any, tuple[Any, ...]]]:
        """The kernel of a frame, with arguments of the types that it is called with."""
        return [(advance_bodies, self._arguments(np.zeros(1, np.int64)))]

    def _arguments(self, ticket: NDArray[np.int64]) -> tuple[Any, ...]:
        both = self._ties, self._touching
        return both, self._chains, self._rule, self._bodies, ticket, self._size, self._halt

    def _choose_tier(self) -> None:
        self._tier.choose(self.calls())
        # More gain in a compiled kernel alone.
        self._rule = self._rule._replace(lanes=1 if self._tier.is_plain else self._lanes)

    def advance(self, span: float, moment: float, writing: float = 0.0, latest: float = math.inf) -> bool:
        """Advance every body by `span` [s] and observe it: whether the frame is done, as `engine.Run.advance`."""
        if not self._cut_short:
            self._bodies.left.fill(span * self._unit)
        self._rule = self._rule._replace(end=moment)
        if self._tier.is_plain and self._tier.left < math.inf:
            self._tier.left = 0.0
            self._choose_tier()
        ticket = np.zeros(1, np.int64)
        kernel = self._tier.kernel(advance_bodies)
        threads = 1 if self._tier.is_plain else self._threads
        ends = [self._pool.submit(kernel, *self._arguments(ticket)) for _ in range(threads)]
        status, number = max(result_of(end, latest, self.halt) for end in ends)
        self._halt[0] = _NEVER
        self._cut_short = status == Status.INTERRUPTED
        if status not in (Status.DONE, Status.INTERRUPTED):
            raise RunError(self._failure(Status(status), number, moment))
        if not self._cut_short:
            self.observe()
        return not self._cut_short

    def _failure(self, status: Status, number: int, moment: float) -> str:
        time_of = moment - self._bodies.left[number]
        sentence = f"the frame at {moment:g} s failed at body {self._first + number}, at {time_of:.6g} s: "
        if status == Status.UNSOLVED:
            return sentence + (
                f"its ties have no solution even in a step of 1e-6 of dt = {self._rule.dt:g} s; lengths at its start "
                f"are off by {self._link_error():.2g} of themselves; a shorter dt helps if the body turns far in a step"
            )
        if status == Status.UNCONVERGED:
            method: Any = self._method
            return sentence + (
                f"{method.max_sweeps} sweeps of a step left V above tolerance = {method.tolerance:g} J. The loop "
                'converges from the surface: use adaptive=True, a larger penalty, or on_unconverged="count"'
            )
        return sentence + (
            "a point meets its walls without end, as in a cusp; start it elsewhere, or take a shorter dt"
        )

    def share_done(self, span: float) -> float:
        """How much of a frame that was cut short is done, on average over the bodies."""
        return float((1.0 - self._bodies.left / (span * self._unit)).mean())

    # --- What is observed --------------------------------------------------------------------------------

    def _blocks(self) -> Iterator[tuple[slice, Floats, Floats]]:
        """The bodies by chunks: which they are, their positions and velocities.

        BLAS rounds a column by how many there are, and NumPy a sum by where its numbers lie: with arrays of its own a
        chunk has the same bits in every run that it is a part of.
        """
        for begin in range(0, len(self._bodies.left), CHUNK):
            some = slice(begin, begin + CHUNK)
            both = self._bodies.position[..., some], self._bodies.velocity[..., some]
            yield some, np.ascontiguousarray(both[0]), np.ascontiguousarray(both[1])

    def _kinetic(self, v: Floats) -> Floats:
        moving = np.tensordot(self._ties.mass, v, axes=(1, 1))  # (P, 3, n)
        return np.asarray(0.5 * (moving.transpose(1, 0, 2) * v).sum(axis=(0, 1)))

    def _fall(self, r: Floats) -> Floats:
        center = np.tensordot(self._ties.mass.sum(axis=1), r, axes=(0, 1))
        return np.asarray(-(self._rule.gravity @ center))

    def _elastic(self, r: Floats) -> Floats:
        ties = self._ties
        total = np.zeros(r.shape[2])
        for _row, (i, j, k, length) in enumerate(self._body.springs):
            total += 0.5 * k * (np.sqrt(((r[:, i] - r[:, j]) ** 2).sum(axis=0)) - length) ** 2
        if self._body.strain is not None:
            edges = self._body.strain.edges
            strain = ((r[:, edges[:, 0]] - r[:, edges[:, 1]]) ** 2).sum(axis=0) - ties.rest[-len(edges) :, None]
            total += 0.5 * (strain * (self._body.strain.stiffness @ strain)).sum(axis=0)
        return total

    def _stored(self, r: Floats) -> Floats:
        """What walls that are springs store, of each copy."""
        total = np.zeros(r.shape[2])
        if self._law is not None:
            places = [(self._scene, self._contact_points(r))]
            for scene, (_surface, carrier, point) in zip(self._carried, self._body.cavities, strict=True):
                places.append((scene, (r[:, point] - r[:, carrier])[:, None, :]))
            for scene, points in places:
                chain, flat = scene.chain(), points.reshape(3, -1)
                for k in np.flatnonzero((scene.gaps(flat) > 0.0).any(axis=0)) if flat.size else ():
                    total[k % total.size] += contact_energy(self._law, chain, 1.0, column(flat, 0, k))
        return total

    def _contact_points(self, r: Floats) -> Floats:
        """(3, K, n)"""
        return np.tensordot(self._body.contacts, r, axes=(1, 1)).transpose(1, 0, 2)

    def _led_energy(self, r: Floats, v: Floats) -> Floats:
        """Kinetic and potential energy of led points themselves."""
        led = led_points(self._body)
        r, v, mass = r[:, led], v[:, led], self._ties.mass[np.ix_(led, led)]
        moving = np.tensordot(mass, v, axes=(1, 1)).transpose(1, 0, 2)
        fall = np.tensordot(mass.sum(axis=1), r, axes=(0, 1))
        return np.asarray(0.5 * (moving * v).sum(axis=(0, 1)) - self._rule.gravity @ fall)

    def _paths(self, bodies: Bodies) -> NDArray[np.float64]:
        """(A, 13, n) start, velocity, cosine, sine and rate of each led point of each copy."""
        anchors = bodies.body.anchors
        paths = [
            [anchors[q].harmonic(start) for start in bodies.position[:, q].T]  # type: ignore[union-attr]
            for q in led_points(bodies.body)
        ]
        rows = np.array([[np.hstack(path) for path in copies] for copies in paths]).reshape(-1, len(bodies), 13)
        return np.ascontiguousarray(rows.transpose(0, 2, 1))

    def _link_error(self) -> float:
        r, ends = self._bodies.position, self._body.links
        if not len(ends):
            return 0.0
        length2 = ((r[:, ends[:, 0]] - r[:, ends[:, 1]]) ** 2).sum(axis=0)
        return float(0.5 * np.abs(length2 / self._link_lengths()[:, None] ** 2 - 1.0).max())

    def _link_lengths(self) -> NDArray[np.float64]:
        tied = self._body.points[self._body.links]
        return np.asarray(np.sqrt(((tied[:, 0] - tied[:, 1]) ** 2).sum(axis=1)))

    def _out_of_own(self) -> Iterator[NDArray[np.float64]]:
        """How far points are out of the cavities that others carry."""
        r = self._bodies.position
        for scene, (_surface, carrier, point) in zip(self._carried, self._body.cavities, strict=True):
            yield scene.distances_outside(r[:, point] - r[:, carrier])

    def observe(self) -> None:
        """Observe the bodies as they are."""
        bodies, surfaces = self._bodies, len(self._scene.surfaces)
        self.state.impacts[:] = np.tile(bodies.impacts, len(self._body))
        sums, errors, depths = zip(*(self._observed(*block) for block in self._blocks()), strict=True)
        self._sums = np.ascontiguousarray(np.array(sums).T)
        self._seen = {
            **summed(self._sums, self._owners, surfaces, len(self._body.cavities)),
            "energy_error": max(errors),
            "max_penetration": float(max([*depths, *(out.max() for out in self._out_of_own())])),
            "impacts": int(bodies.impacts.sum()),
            "sliding": int(np.count_nonzero(bodies.lasting)),
            "unconverged": int(bodies.unconverged.sum()),
            "escaped": 0,
            "link_error": self._link_error(),
        }
        if self._rule.loop:
            self._seen["sweeps"] = int(bodies.sweeps.sum())

    def _observed(self, some: slice, r: Floats, v: Floats) -> tuple[list[float], float, float]:
        """Of one chunk: what is summed, as `summed` takes it, the largest error of the energy, how far it is out."""
        bodies = self._bodies
        kinetic, fall, elastic = self._kinetic(v), self._fall(r), self._elastic(r) + self._stored(r)
        total, lost = kinetic + fall + elastic, bodies.dissipated[some]
        work = bodies.work[some] + self._led_energy(r, v) - self._led_start[some]
        error, scale = np.abs(total + lost - work - self._start[some]), self._scale[some]
        scaled = np.divide(error, scale, out=np.zeros_like(error), where=scale > 0.0)
        momentum = np.tensordot(self._ties.mass, v, axes=(1, 1)).transpose(1, 0, 2)
        numbers = (kinetic, fall, elastic, total, lost, bodies.sliding[some], work)
        vectors = momentum.sum(axis=(1, 2)), np.cross(r, momentum, axis=0).sum(axis=(1, 2))
        pushed = np.ascontiguousarray(bodies.impulse[:, some]).sum(axis=1)
        points = self._contact_points(r).reshape(3, -1)
        depth = self._scene.distances_outside(points).max(initial=0.0) if points.size else 0.0
        return [*(one.sum() for one in numbers), *np.concatenate([*vectors, pushed])], scaled.max().item(), float(depth)

    def chunk_sums(self) -> Floats:
        """What `summed` takes, (quantities, chunks of bodies), of the last frame."""
        return self._sums

    def seen(self) -> dict[str, Any]:
        """The observables of the last frame."""
        return dict(self._seen)

    def require_admissible(self, seen: dict[str, Any], moment: float) -> None:
        """Raise a RunError where a state is not finite, or a point outside its walls."""
        r = self._bodies.position
        if not (math.isfinite(seen["total_energy"]) and np.isfinite(seen["angular_momentum"]).all()):
            good = np.isfinite(r).all(axis=(0, 1)) & np.isfinite(self._bodies.velocity).all(axis=(0, 1))
            raise RunError(
                f"the frame at {moment:g} s failed at body {self._first + int(np.argmin(good))}: {_NOT_FINITE}"
            )
        if seen["max_penetration"] > self._deepest:
            raise RunError(
                f"the frame at {moment:g} s failed: a point of a body is {seen['max_penetration']:.3g} m outside its "
                "walls"
            )

    def arrays(self) -> dict[str, NDArray[Any]]:
        """What `restore` needs to continue with the same bits, not copied."""
        return dict(self._bodies._asdict())

    def restore(self, arrays: dict[str, NDArray[Any]], cut_short: bool) -> None:
        """Take the state of the run that gave these `arrays`."""
        for name, array in self.arrays().items():
            np.copyto(array, arrays[name], casting="no")
        self._cut_short = cut_short


_NOT_FINITE = Status.NOT_FINITE.sentence


def summed(sums: Floats, owners: list[int], surfaces: int, cavities: int) -> dict[str, Any]:
    """The observables that are sums over bodies, from those of all chunks (quantities, chunks).

    `owners` says which surface each wall belongs to; the last `cavities` rows are the impulse of those of the bodies.
    """
    kinetic, fall, elastic, total, lost, sliding, work, *vectors = (totals := sums.sum(axis=1))[:13].tolist()
    pushed = totals[13:]
    return {
        "kinetic_energy": kinetic,
        "potential_energy": fall,
        "contact_energy": elastic,
        "total_energy": total,
        "dissipated_energy": lost,
        "momentum": np.array(vectors[:3]),
        "angular_momentum": np.array(vectors[3:]),
        "impulse": np.bincount(owners, weights=pushed[: len(owners)], minlength=surfaces),
        "sliding_time": sliding,
        "wall_heat": np.zeros(surfaces),
        "work": work,
        **({"cavity_impulse": pushed[len(pushed) - cavities :]} if cavities else {}),
    }


def _at_once(rows: int, pressed: int) -> int:
    """Bytes that a blow, or the solution of contacts, of one body takes: matrices of ties, and of contacts."""
    return 8 * (rows * rows + pressed * (pressed + 3 * rows))
