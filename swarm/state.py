"""The arrays that kernels advance, with one entry for each particle."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


class Multipliers(NamedTuple):
    """The statistics of the Uzawa loops of each particle since the start, for methods with multipliers.

    Attributes:
        sweeps: (N,) sweeps of all contact steps together.
        contacts: (N,) contact steps.
        unconverged: (N,) contact steps with a loop that did not reach the tolerance.
        stored_energy: (N,) the largest V that a loop left [J].
        remaining: (N,) the rest of the frame, in the unit of the method, where a loop failed.
    """

    sweeps: NDArray[np.int64]
    contacts: NDArray[np.int64]
    unconverged: NDArray[np.int64]
    stored_energy: Floats
    remaining: Floats


class Contacts(NamedTuple):
    """The lasting contacts of each particle, for methods in which a particle may slide.

    Attributes:
        phase: (N,) int8, the state at the start of a frame: in flight, along one or two walls, or at rest (ARRIVED).
        walls: (2, N) the numbers of the walls that hold the particle; -1 for no wall. Two walls are an edge.
        met: (N,) the wall at which the next phase of the particle is to be decided.
        step: (N,) the next sliding step [s]; 0 if the walls decide.
        keep: (N,) the speed across the walls that the particle has again when it leaves them [m/s].
        remaining: (N,) the rest of the frame at a change from flight to contact or back [s]; 0 at the ends of frames.
        events: (2, N) the rest of the frame at the last hit on a wall, and the hits since then without a move.
        short_steps: (N,) the short steps in this frame, where several walls or a cusp hold the particle.
        load: (walls, N) the force of each wall on a particle at rest, per mass [m/s^2].
        sliding: (N,) the time of sliding, or rest, since the start [s].
    """

    phase: NDArray[np.int8]
    walls: Floats
    met: Floats
    step: Floats
    keep: Floats
    remaining: Floats
    events: Floats
    short_steps: Floats
    load: Floats
    sliding: Floats


# The sums over the crossings of a counter: three components of the momentum, the energy, the slowness.
CROSSED = 5


class Crossed(NamedTuple):
    """The crossings of counters by each particle since the start.

    Attributes:
        side: (counters, N) int8, 1 for a particle out of the admissible side of a counter.
        number: (2 counters, N) crossings of each counter, out of the admissible side and back.
        sums: (10 counters, N) sums over crossings: momentum [kg m/s], kinetic energy [J] and slowness 1/|v_n| [s/m].
    """

    side: NDArray[np.int8]
    number: NDArray[np.int64]
    sums: Floats


# Counts of 32 bits begin anew at `ROUND`. The number of rounds is stored together with a number below `BELOW`.
ROUND, BELOW = 2**30, 8


class Balls(NamedTuple):
    """The further state of particles with a radius.

    Attributes:
        radius: (N,) [m].
        collisions: (N,) whole numbers, the collisions with other particles since the start; each counts for both.
        virial: (1,) the sum of r_ij . J_ij over all collisions since the start [J s].
        spin: (3, N) the angular velocity [rad/s], or None if nothing turns the balls.
        rounds: (N,) `BELOW` times how often `collisions` has begun anew after `ROUND`, plus another number; or None.
    """

    radius: Floats
    collisions: NDArray[Any]
    virial: Floats
    spin: Floats | None = None
    rounds: NDArray[Any] | None = None

    def all_collisions(self) -> NDArray[np.int64]:
        """Return the collisions (N,), with those before `collisions` has begun anew."""
        found = self.collisions.astype(np.int64, copy=False)
        if self.rounds is not None and self.rounds.max(initial=0) >= BELOW:
            found += ROUND * (self.rounds // BELOW).astype(np.int64)
        return found

    def sum_of_collisions(self, n: int) -> int:
        """Return the sum of `all_collisions` of the first n balls, without the array, which has 8 bytes a ball."""
        rounds, found = self.rounds, int(self.collisions[:n].sum())
        if rounds is not None and rounds[:n].max(initial=0) >= BELOW:
            found += ROUND * int((rounds[:n] // BELOW).sum())
        return found

    def of(self, some: NDArray[np.bool_], n: int) -> "Balls":
        """Return the state of some of n balls."""
        return Balls(*(_of(value, some, n) for value in self))._replace(virial=self.virial)


class State(NamedTuple):
    """The arrays that kernels advance.

    Energies are per mass, so that the mass of a particle does not change the bits of its flight.
    """

    position: Floats  # (3, N)
    velocity: Floats  # (3, N)
    mass: Floats  # (N,)
    energy: Floats  # (N,) total energy per mass [J/kg]: that of the start, minus the energy dissipated
    inverse_scale: Floats  # (N,) 1/energy scale per mass, the factor that makes energy errors relative
    impacts: NDArray[np.int64]  # (N,) since the start
    impulse: Floats  # (walls, N) normal impulse since the start [N s], then (walls, N) the work of moving walls [J]
    dissipated: Floats  # (N,) energy lost since the start [J]; empty if no wall dissipates
    multipliers: Multipliers | None
    contacts: Contacts | None = None
    heat: Floats | None = None  # (walls, N) energy that thermal walls gave since the start [J]; None without these
    # In a periodic scene the energy is that of the position in the cell, and changes with the image.
    image: NDArray[np.int64] | None = None  # (3, N) the cell of each particle
    carry: Floats | None = None  # (N,) the round-off of the energy lost at these changes
    period: Any = None  # `Period` of the cell
    # If a wall has openings:
    escape_time: Floats | None = None  # (N,) the time at which each passed an opening [s], NaN for particles inside
    openings: Any = None  # None, or each `Opening` of the walls
    # If particles are born during the run, or wait on a wall:
    starts: Floats | None = None  # (N,) the time from which each particle flies [s]
    # If a wall may absorb particles:
    absorbed_time: Floats | None = None  # (N,) [s], NaN for other particles
    absorbed_wall: NDArray[np.int32] | None = None  # (N,) the number of the wall in the scene, -1 for other particles

    crossed: Crossed | None = None  # if the run has counters
    # If balls are born during the run:
    born_time: Floats | None = None  # (N,) the time of birth [s], NaN before it
    balls: Balls | None = None  # if particles have a radius
    # If particles are born during the run, and no contact lasts from pass to pass:
    late: Floats | None = None  # (N,) the rest of the frame, in the unit of the method, for particles that start in it

    # If contacts take time, and laws of walls act at their ends:
    pressed: Floats | None = None  # (walls, N) the impulse of each contact since friction last acted, per mass [m/s]
    rubbed: Floats | None = None  # (walls, N) the impulse of the same contact before that, per mass [m/s]

    @property
    def radius(self) -> Floats | None:
        """The radii of balls (N,) [m]; None for points."""
        return None if self.balls is None else self.balls.radius

    @property
    def spin(self) -> Floats | None:
        """The angular velocities (3, N) of balls that turn [rad/s], else None."""
        return None if self.balls is None else self.balls.spin

    @property
    def collisions(self) -> NDArray[np.int64] | None:
        """The number of collisions (N,) of each ball with others since the start; None for points."""
        return None if self.balls is None else self.balls.all_collisions()

    def having(self, **arrays: NDArray[Any]) -> "State":
        """Return the state with other arrays, also of balls."""
        mine: dict[str, Any] = {name: array for name, array in arrays.items() if name in self._fields}
        balls: dict[str, Any] = {name: array for name, array in arrays.items() if name not in mine}
        if "collisions" in balls:
            balls["rounds"] = None
        return self._replace(**mine, balls=None if self.balls is None else self.balls._replace(**balls))

    def of(self, some: NDArray[np.bool_]) -> "State":
        """Return the state of some of the particles (N,), copied."""
        n, balls = self.mass.size, self.balls
        made = self._replace(**{name: _of(value, some, n) for name, value in self._asdict().items()})
        return made._replace(balls=None if balls is None else balls.of(some, n))

    def gone(self) -> NDArray[np.bool_]:
        """Whether each particle has escaped or was absorbed (N,): it then stays in place, whatever the walls do."""
        found = np.zeros(self.mass.size, np.bool_)
        for time in (self.escape_time, self.absorbed_time):
            if time is not None:
                found |= ~np.isnan(time[: found.size])
        return found


def none_left(n: int, opens: bool, absorbs: bool) -> dict[str, Any]:
    """Return the fields of n particles before any has left through an opening (if `opens`) or into a wall.

    >>> sorted(name for name, array in none_left(2, False, True).items() if array is not None)
    ['absorbed_time', 'absorbed_wall']
    """
    return {
        "escape_time": np.full(n, math.nan) if opens else None,
        "absorbed_time": np.full(n, math.nan) if absorbs else None,
        "absorbed_wall": np.full(n, -1, np.int32) if absorbs else None,
    }


def _of(value: Any, some: NDArray[np.bool_], n: int) -> Any:
    has_each = isinstance(value, np.ndarray) and value.shape[-1] == n
    return np.ascontiguousarray(value[..., some]) if has_each else value


def is_gone(state, i):
    """Whether particle i has left the walls: it has passed an opening, or was absorbed."""
    escaped = False if state.escape_time is None else not math.isnan(state.escape_time[i])
    if state.absorbed_time is None:
        return escaped
    return (not math.isnan(state.absorbed_time[i])) | escaped


def absorb(books, i, wall, time):
    """Book that a wall of the scene absorbs particle i, or body i, at a time [s]."""
    books.absorbed_time[i], books.absorbed_wall[i] = time, np.int32(wall)
