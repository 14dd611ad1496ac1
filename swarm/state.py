"""The arrays that kernels advance, one entry a particle."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


class Multipliers(NamedTuple):
    """Statistics of each particle's Uzawa loops since the start, from methods with multipliers.

    Attributes:
        sweeps: (N,) sweeps of all its contact steps together.
        contacts: (N,) contact steps.
        unconverged: (N,) contact steps with a loop that did not reach the tolerance.
        stored_energy: (N,) the largest V that a loop left [J].
        remaining: (N,) the rest of the frame, in the method's unit, where a loop failed.
    """

    sweeps: NDArray[np.int64]
    contacts: NDArray[np.int64]
    unconverged: NDArray[np.int64]
    stored_energy: Floats
    remaining: Floats


class Contacts(NamedTuple):
    """The lasting contacts of each particle, of methods in which a particle may slide.

    Attributes:
        phase: (N,) int8, how it begins the next frame: in flight, along one wall or two, or at rest (ARRIVED).
        walls: (2, N) the walls that hold it, as numbers; -1 for none. Two are an edge.
        met: (N,) the wall at which it is to be decided what becomes of it.
        step: (N,) its next sliding step [s]; 0 where the walls decide.
        keep: (N,) the speed across its walls that it has again when it leaves them [m/s].
        remaining: (N,) what is left of the frame where it goes from flight to contact or back [s]; 0 at its ends.
        events: (2, N) what was left when it met a wall last, and how often it has met one since without moving on.
        short_steps: (N,) of this frame, where several walls hold it or a cusp.
        load: (walls, N) what each wall carries of it at rest, per mass [m/s^2].
        sliding: (N,) how long it has slid, or rested, since the start [s].
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


class Absorbed(NamedTuple):
    """The particles that walls have absorbed.

    Attributes:
        time: (N,) when each was [s], NaN of those that are not.
        wall: (N,) int32, the number of that wall in the scene; -1 of those that are not.
    """

    time: Floats
    wall: NDArray[np.int32]


# The sums over the crossings of a counter: three components of the momentum, the energy, the slowness.
CROSSED = 5


class Crossed(NamedTuple):
    """The crossings of counters by each particle since the start.

    Attributes:
        side: (counters, N) int8, 1 where it is out of the admissible side of a counter.
        number: (2 counters, N) crossings of each counter, out of that side and back.
        sums: (10 counters, N) of these the momentum [kg m/s], the kinetic energy [J], and the slowness 1/|v_n| [s/m].
    """

    side: NDArray[np.int8]
    number: NDArray[np.int64]
    sums: Floats


# Counts of 32 bits begin anew from so many on, and how often is counted beside another number, which is below `BELOW`.
ROUND, BELOW = 2**30, 8


class Balls(NamedTuple):
    """The further state of particles with a radius.

    Attributes:
        radius: (N,) [m].
        collisions: (N,) whole numbers, with other particles since the start; each counts for both.
        virial: (1,) the sum of r_ij . J_ij over all collisions since the start [J s].
        spin: (3, N) angular velocity [rad/s], or None where nothing turns them.
        rounds: (N,) `BELOW` times how often `collisions` has begun anew after `ROUND`, plus another number; or None.
    """

    radius: Floats
    collisions: NDArray[Any]
    virial: Floats
    spin: Floats | None = None
    rounds: NDArray[Any] | None = None

    def all_collisions(self) -> NDArray[np.int64]:
        """`collisions` (N,), also where these have begun anew."""
        found = self.collisions.astype(np.int64, copy=False)
        if self.rounds is not None and self.rounds.max(initial=0) >= BELOW:
            found += ROUND * (self.rounds // BELOW).astype(np.int64)
        return found

    def sum_of_collisions(self, n: int) -> int:
        """The sum of `all_collisions` of the first n balls, without an array of them: these would be 8 bytes a ball."""
        rounds, found = self.rounds, int(self.collisions[:n].sum())
        if rounds is not None and rounds[:n].max(initial=0) >= BELOW:
            found += ROUND * int((rounds[:n] // BELOW).sum())
        return found

    def of(self, some: NDArray[np.bool_], n: int) -> "Balls":
        """That of some of n balls."""
        return Balls(*(_of(value, some, n) for value in self))._replace(virial=self.virial)


class State(NamedTuple):
    """The arrays that kernels advance.

    Energies are per mass, so that the mass of a particle does not change the bits of its flight.
    """

    position: Floats  # (3, N)
    velocity: Floats  # (3, N)
    mass: Floats  # (N,)
    energy: Floats  # (N,) total energy per mass [J/kg]: that of the start, less what was dissipated
    inverse_scale: Floats  # (N,) 1/energy scale per mass, what energy errors are relative to
    impacts: NDArray[np.int64]  # (N,) since the start
    impulse: Floats  # (walls, N) normal impulse since the start [N s], then (walls, N) the work of walls that move [J]
    dissipated: Floats  # (N,) energy lost since the start [J]; empty if no wall dissipates
    multipliers: Multipliers | None
    contacts: Contacts | None = None
    heat: Floats | None = None  # (walls, N) energy that thermal walls gave since the start [J]; None without
    # Where the scene repeats: the energy is that of the position in the cell, and changes with the image.
    image: NDArray[np.int64] | None = None  # (3, N) how many cells away it is
    carry: Floats | None = None  # (N,) what is lost of the energy by round-off at these changes
    period: Any = None  # `Period` of the cell
    # Where a wall has openings:
    escape_time: Floats | None = None  # (N,) when each has passed one [s], NaN of those that are inside
    openings: Any = None  # None, or each `Opening` of the walls
    # Where particles come during the run, or wait on a wall:
    starts: Floats | None = None  # (N,) the time from which each flies [s]
    # Where a wall may absorb any, as in `Absorbed`:
    absorbed_time: Floats | None = None
    absorbed_wall: NDArray[np.int32] | None = None

    crossed: Crossed | None = None  # where there are counters
    # Where balls come during the run:
    born_time: Floats | None = None  # (N,) when each was born [s], NaN of those that are not
    balls: Balls | None = None  # where particles have a radius
    # Where particles come during the run, and no contact lasts from pass to pass:
    late: Floats | None = None  # (N,) what is left of the frame, in the method's unit, of those that start within it

    # Where contacts take time, and laws of walls act at their ends:
    pressed: Floats | None = None  # (walls, N) the impulse of each contact since friction last acted, per mass [m/s]
    rubbed: Floats | None = None  # (walls, N) what it has had before that, in the same contact, per mass [m/s]

    @property
    def absorbed(self) -> Any:
        """`Absorbed`, or None where no wall absorbs any."""
        time, wall = self.absorbed_time, self.absorbed_wall
        return None if time is None or wall is None else Absorbed(time, wall)

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
        """The state with other arrays, also in place of those of balls."""
        mine: dict[str, Any] = {name: array for name, array in arrays.items() if name in self._fields}
        balls: dict[str, Any] = {name: array for name, array in arrays.items() if name not in mine}
        if "collisions" in balls:
            balls["rounds"] = None
        return self._replace(**mine, balls=None if self.balls is None else self.balls._replace(**balls))

    def of(self, some: NDArray[np.bool_]) -> "State":
        """The state of some of the particles (N,), copied."""
        n, balls = self.mass.size, self.balls
        made = self._replace(**{name: _of(value, some, n) for name, value in self._asdict().items()})
        return made._replace(balls=None if balls is None else balls.of(some, n))

    def gone(self) -> NDArray[np.bool_]:
        """(N,) whether each has escaped or was absorbed: where it is then it stays, whatever the walls do."""
        found = np.zeros(self.mass.size, np.bool_)
        for time in (self.escape_time, self.absorbed_time):
            if time is not None:
                found |= ~np.isnan(time[: found.size])
        return found


def none_left(n: int, opens: bool, absorbs: bool) -> dict[str, Any]:
    """The fields of n particles of which none has left: through an opening where walls have any, or into a wall.

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
    """Whether particle i has passed an opening, or was absorbed, and is no more among the walls."""
    escaped = False if state.escape_time is None else not math.isnan(state.escape_time[i])
    if state.absorbed is None:
        return escaped
    return (not math.isnan(state.absorbed.time[i])) | escaped
