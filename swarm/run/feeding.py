"""The births of balls during a run: when they are due, their free places, and their waits for a free place."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..ball_numbers import rotational_energy
from ..particles import Particles
from ..scene import Scene
from ..sources.ball_places import ball_places
from ..sources.places import changes
from ..state import Floats, State
from .preflight.softness import pace_of

# The most places that are tried for a birth at one time.
_TRIES = 16
# The least distance of balls at a birth, in sums of their radii: more than 1 by more than round-off.
_APART = 1.0 + 1e-12


class There(NamedTuple):
    """The balls in the vessel at an instant: their centres and velocities (3, n), and their radii (n,)."""

    position: Floats
    velocity: Floats
    radius: Floats


class Newborn(NamedTuple):
    """The births at an instant: the numbers of the particles (n,), their positions and velocities (3, n)."""

    number: NDArray[np.int64]
    position: Floats
    velocity: Floats


class Feed:
    """The births of the balls of a run.

    Random numbers are drawn from the seed by the number of the birth, or of the try, so that births have the same bits
    for any number of threads.

    Args:
        scene: the vessel.
        particles: the particles of the start, followed by those that may be born.
        seed: the seed of the run.
        is_clear: whether a place (3,) is clear of the walls that impacts move, for a radius [m] at a time [s].

    Attributes:
        born_time: (N,) the time of birth of each ball [s], NaN before it.
    """

    def __init__(
        self, scene: Scene, particles: Particles, seed: int,
        is_clear: Callable[[Floats, float, float], bool] = lambda _place, _radius, _now: True,
    ) -> None:  # fmt: skip
        births = particles.births
        assert births is not None
        self._scene, self._particles, self._births, self._is_clear = scene, particles, births, is_clear
        self._places = ball_places(scene, particles, seed)
        n, sources = len(particles), births.sources
        self.born_time = np.where(births.source < 0, 0.0, np.nan)
        self._due = [np.flatnonzero(births.source == k) for k in range(sources)]
        # For each source: the births that are over, the places tried, the births without a free place at their time,
        # and the earliest time of the next try [s].
        self._over, self._tried, self._blocked = np.zeros((3, sources), np.int64)
        self._earliest, self._counted = np.zeros(sources), np.full(sources, -1)
        self._energy = np.zeros(n)
        self._pace_of_walls = max((pace_of(surface) for surface in scene.surfaces), default=0.0)
        self._changing = [i for i, one in enumerate(scene.surfaces) if changes(one) and not one.reacts()]

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays of a checkpoint, for `BaseRun.arrays`."""
        own = {"over": self._over, "tried": self._tried, "blocked": self._blocked, "earliest": self._earliest}
        own |= {"counted": self._counted, "energy": self._energy, "born_time": self.born_time}
        return {f"feed.{name}": array for name, array in own.items()}

    def observed(self) -> dict[str, Any]:
        """Return the observables of sources."""
        source, sources = self._births.source, self._births.sources
        here = source[~np.isnan(self.born_time) & (source >= 0)]
        return {
            "born": np.bincount(here, minlength=sources).astype(np.int64), "blocked": self._blocked.copy(),
            "source_energy": float(np.add.reduce(self._energy)),
        }  # fmt: skip

    def seen(self, state: State) -> State:
        """Return the state of the balls that have been born, in the order of their numbers."""
        there = ~np.isnan(self.born_time)
        return state if there.all() else state.of(there)

    # --- Births ----------------------------------------------------------------------------------------------

    def next(self) -> float:
        """Return the time at which the next birth is due, or is to be tried again [s]; infinite without a birth."""
        return min((self._next_of(k) for k in range(self._births.sources)), default=math.inf)

    def _next_of(self, k: int) -> float:
        if self._over[k] == len(self._due[k]):
            return math.inf
        return max(float(self._births.time[self._due[k][self._over[k]]]), float(self._earliest[k]))

    def come(self, now: float, there: There, slack: float = 0.0) -> Newborn:
        """Return the births due until `slack` [s] after an instant `now` [s], beside the balls in the vessel."""
        made: list[tuple[int, Floats, Floats]] = []
        for k in range(self._births.sources):
            self._come_from(k, (now, now + slack), there, made)
        position, velocity = (np.array([one[part] for one in made]).reshape(-1, 3).T for part in (1, 2))
        return Newborn(np.array([one[0] for one in made], np.int64), position, velocity)

    def _come_from(
        self, k: int, instant: tuple[float, float], there: There, made: list[tuple[int, Floats, Floats]]
    ) -> None:  # fmt: skip
        """Add the births of a source to the births that were `made` at this instant."""
        waits, (now, latest) = self._births.balls[k].blocked == "wait", instant
        while self._next_of(k) <= latest:
            number = int(self._due[k][self._over[k]])
            found = self._free(k, number, now, there, made)
            if found is not None:
                made.append((number, *found))
                self._bear(number, *found, now)
            else:
                self._blocked[k] += self._counted[k] < number
                self._counted[k] = number
                if waits:
                    again = now + self._pause(k, number, there)
                    again = self._next_due(now) if math.isinf(again) else again
                    self._earliest[k] = max(again, np.nextafter(now, np.inf))
                    return
            self._over[k] += 1

    def _free(
        self, k: int, number: int, now: float, there: There, made: list[tuple[int, Floats, Floats]]
    ) -> tuple[Floats, Floats] | None:
        """Return a free place for a birth, with a velocity; None if all places tried are occupied."""
        mass, radius = self._particles.mass[number], self._particles.radius
        assert radius is not None
        there = self._beside(there, made)
        reach = _APART * (there.radius + radius[number])
        scale = 1.0 if self._births.balls[k].temperature is None else 1.0 / math.sqrt(mass)
        for _try in range(_TRIES):
            position, velocity = self._places[k].at(int(self._tried[k]))
            self._tried[k] += 1
            away = there.position - position[:, None]
            for axis, length in enumerate(self._scene.period or ()):
                if length is not None:
                    away[axis] -= length * np.rint(away[axis] / length)
            if ((away * away).sum(axis=0) >= reach * reach).all() and self._is_within(position, radius[number], now):
                return position, scale * velocity
        return None

    def _beside(self, there: There, made: list[tuple[int, Floats, Floats]]) -> There:
        """Return the balls in the vessel with the balls `made` at this instant, without velocities of the latter."""
        radius = self._particles.radius
        assert radius is not None
        position = np.concatenate([there.position, *(r[:, None] for _n, r, _v in made)], axis=1)
        return there._replace(position=position, radius=np.append(there.radius, radius[[n for n, _r, _v in made]]))

    def _is_within(self, position: Floats, radius: float, now: float) -> bool:
        """Whether a ball is within the walls that move, or become absent."""
        if not self._is_clear(position, radius, now):
            return False
        if not self._changing:
            return True
        depths = self._scene.distances_outside(position[:, None], now, np.array([radius]))
        return bool((depths[self._changing] <= 0.0).all())

    def _pause(self, k: int, number: int, there: There) -> float:
        """The pause before a place is tried again [s]: the time in which a ball moves by a radius.

        The speed is the largest of three: that of the source, that after a fall by the radius, and the root mean square
        of the speeds of the balls in the vessel. If all are 0, it is a bound of the speeds of walls.
        """
        source, n = self._births.balls[k], there.radius.size
        radius = source.largest()
        thermal = math.sqrt((source.temperature or 0.0) / self._particles.mass[number])
        pace = source.speed or math.hypot(*(source.beam or (thermal,)))
        fall = math.sqrt(2.0 * radius * math.hypot(*(self._scene.gravity or (0.0,))))
        rms = math.sqrt(float((there.velocity * there.velocity).sum()) / n) if n else 0.0
        pace = max(pace, fall, rms) or self._pace_of_walls
        return radius / pace if pace > 0.0 else math.inf

    def _next_due(self, now: float) -> float:
        """The time of the next due birth, or change of walls [s]: where nothing moves, a place is tried again then."""
        times = np.append(self._births.time[self._births.source >= 0], self._scene.instants)
        return float(times[times > now].min(initial=math.inf))

    def _bear(self, number: int, position: Floats, velocity: Floats, now: float) -> None:
        """Book a birth."""
        particles, pull = self._particles, self._scene.gravity or (0.0, 0.0, 0.0)
        mass, spin = float(particles.mass[number]), particles.spin
        self.born_time[number] = now
        energy = mass * (0.5 * float((velocity * velocity).sum()) - float((np.array(pull) * position).sum()))
        if spin is not None:
            assert particles.radius is not None
            some = slice(number, number + 1)
            energy += rotational_energy(particles.mass[some], particles.radius[some], spin[:, some])
        self._energy[number] = energy
