"""Observables of a frame, from arrays.

Sums run over fixed chunks of particles in a fixed order, so they have the same bits for any number of threads.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .compiled_scene import CompiledScene, PartsOfRows
from .contact.energy import contact_energy
from .kernel.arrays import scratch
from .kernel.gravity import potential
from .kernel.jit import kernel, select
from .kernel.vector import Vec, column, cross, dot, square, vec, vector_at
from .scene import Scene
from .state import CROSSED, Floats, State, is_gone
from .surfaces.time_of_impact import flights
from .surfaces.walls import penetration

# The number of particles in a partial sum. Unlike the block size it affects the last bits of results.
CHUNK = 256
# Partial sums run in this many interleaved columns, which the compiler vectorises without reordering any.
_COLUMNS = 64

# The rows of a counter: the number of crossings and the sums, in both senses.
COUNTED = 2 * (1 + CROSSED)

_KINETIC, _POTENTIAL, _CONTACT, _PX, _PY, _PZ, _LX, _LY, _LZ, _ENERGY_ERROR, _PENETRATION, ROWS = range(12)


def _whole_fall(period, state, i, in_cell):
    """The potential energy per mass of particle i at its place in space, from that of its place in the cell."""
    if period is None or period.fall is None:
        return in_cell
    fall, image = period.fall, state.image
    return in_cell + (image[0, i] * fall.x + image[1, i] * fall.y + image[2, i] * fall.z)


class Energies(NamedTuple):
    """Kinetic, potential and contact energy per mass of one particle, or of many particles as arrays."""

    kinetic: Any
    fall: Any
    stored: Any

    def total(self) -> Any:
        """The sum of the three energies."""
        return self.kinetic + self.fall + self.stored


def _energies(law, walls, gravity, m, r, v):
    return Energies(0.5 * square(v), potential(gravity, r), contact_energy(law, walls, 1.0 / m, r))


def energies(compiled: CompiledScene, law: Any, mass: Floats, position: Floats, velocity: Floats) -> Energies:
    """Return the energies of particles with positions and velocities (3, N) at time 0.

    This has no kernel, as the functions for one particle also take arrays.
    """
    stored = np.zeros(len(mass))
    if law is not None:
        walls = compiled.walls().at(0.0)
        # Few particles are in a wall, and the law of a wall takes one number.
        for i in np.flatnonzero((compiled.scene.gaps(position) > 0.0).any(axis=0)):
            stored[i] = contact_energy(law, walls, 1.0 / mass[i], column(position, 0, i))
    return Energies(0.5 * square(vec(velocity)), potential(compiled.scene.pull(), vec(position)), stored)


def energy_scale(scene: Scene, start: Energies) -> Floats:
    """Return the scale of energy errors: kinetic + contact + m |G| size at the start, per mass."""
    size, pull = scene.finite_size(), scene.pull()
    weight = abs(potential(pull, Vec(size, 0.0, 0.0))) + abs(potential(pull, Vec(0.0, size, 0.0)))
    weight += abs(potential(pull, Vec(0.0, 0.0, size)))
    return np.asarray(start.kinetic + start.stored + weight)


# Temporary arrays of this number of particles stay in the cache: 2.9 instead of 5.1 ns a particle.
_AT_ONCE = 32_768


def start_energies(compiled: CompiledScene, law: Any, state: State) -> None:
    """Set `energy` and `inverse_scale` of the state."""
    for first in range(0, state.mass.size, _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        start = energies(compiled, law, state.mass[some], state.position[:, some], state.velocity[:, some])
        scale = energy_scale(compiled.scene, start)
        state.energy[some] = start.total()
        state.inverse_scale[some] = np.divide(1.0, scale, out=np.zeros(scale.shape), where=scale > 0.0)


@kernel
def observe(law, walls, gravity, state, drawn, size, partial):
    """Write the sums and maxima of each chunk into partial[chunk, ROWS].

    The chunks have the particles k size to (k + 1) size for every k in `drawn`; `size` is a multiple of CHUNK.
    """
    position, velocity, mass = state.position, state.velocity, state.mass
    energy, inverse_scale = state.energy, state.inverse_scale
    sums = scratch((ROWS, _COLUMNS), np.float64)
    for k in drawn:
        for begin in range(k * size, min((k + 1) * size, mass.size), CHUNK):
            end = min(begin + CHUNK, mass.size)
            sums[:] = 0.0
            for left in range(begin, end, _COLUMNS):
                for j in range(min(_COLUMNS, end - left)):
                    i = left + j
                    m, r, v = mass[i], column(position, 0, i), column(velocity, 0, i)
                    e = _energies(law, walls.at(0.0), gravity, m, r, v)
                    if law is not None:
                        # A particle that has escaped has lost its stored energy.
                        e = e._replace(stored=select(is_gone(state, i), 0.0, e.stored))
                    p = m * v
                    error = abs(e.kinetic + e.fall + e.stored - energy[i]) * inverse_scale[i]
                    now = walls.at(0.0)
                    met = now if state.balls is None else now.grown(state.balls.radius[i])
                    depth = select(is_gone(state, i), 0.0, penetration(met, r))
                    sums[_KINETIC, j] += m * e.kinetic
                    sums[_POTENTIAL, j] += m * _whole_fall(state.period, state, i, e.fall)
                    sums[_CONTACT, j] += m * e.stored
                    spin = cross(r, p)
                    sums[_PX, j] += p.x
                    sums[_PY, j] += p.y
                    sums[_PZ, j] += p.z
                    sums[_LX, j] += spin.x
                    sums[_LY, j] += spin.y
                    sums[_LZ, j] += spin.z
                    sums[_ENERGY_ERROR, j] = select(error > sums[_ENERGY_ERROR, j], error, sums[_ENERGY_ERROR, j])
                    sums[_PENETRATION, j] = select(depth > sums[_PENETRATION, j], depth, sums[_PENETRATION, j])
            # The columns are reduced pairwise.
            half = _COLUMNS // 2
            while half > 0:
                for row in range(ROWS):
                    for j in range(half):
                        one, other = sums[row, j], sums[row, j + half]
                        sums[row, j] = select(row < _ENERGY_ERROR, one + other, select(one > other, one, other))
                half //= 2
            for row in range(ROWS):
                partial[begin // CHUNK, row] = sums[row, 0]


@kernel
def store(law, walls, remaining, state, into):
    """Write the stored energy per mass of each particle, with `remaining` [s] of the frame left, into an array (N,)."""
    now = walls.at(remaining)
    for i in range(state.mass.size):
        r = column(state.position, 0, i)
        into[i] = select(is_gone(state, i), 0.0, contact_energy(law, now, 1.0 / state.mass[i], r))


@kernel
def count_escaped(walls, gravity, far, faces, state):
    """Return the number of particles that leave an open scene for ever, but not through an opening of a wall.

    Such a particle is farther from the origin than `far`, or in a straight flight that hits no wall, or beyond an open
    face of `faces`, rows (n, offset), and flies in its direction n. The walls beside such a face are endless, and a
    particle that hits them beyond the face still leaves.
    """
    position, velocity, count = state.position, state.velocity, 0
    for i in range(state.mass.size):
        r, v = column(position, 0, i), column(velocity, 0, i)
        out = square(r) > far * far
        for k in range(faces.shape[0]):
            n = vector_at(faces, k, 0)
            out |= (dot(n, r) > faces[k, 3]) & (dot(n, v) > 0.0)
        leaves = out or _escapes(state.period, gravity, walls, r, v)
        count += leaves and not is_gone(state, i)
    return count


def _escapes(period, gravity, walls, r, v):
    """Whether a flight hits no wall. Under gravity only the distance decides."""
    # In a periodic scene, a flight that hits no wall of its cell may hit walls of other cells.
    if period is not None or gravity is not None:
        return False
    return (flights.first_hit(walls.at(0.0), gravity, r, v).time == np.inf) & (square(v) > 0.0)


def books(seen: dict[str, Any]) -> dict[str, Floats]:
    """Return the changes of the total energy since the first frame by their causes [J], with their signs."""
    zero = np.zeros(len(seen["time"]))
    moved = np.sum(seen.get("wall_work", zero[:, None]), axis=1)
    changes = {
        "dissipated": -np.asarray(seen.get("dissipated_energy", zero)),
        "heat of the walls": np.sum(seen.get("wall_heat", zero[:, None]), axis=1),
        "work of the walls": moved,
        "work of anchors": np.asarray(seen.get("work", zero)),
        "brought by sources": np.asarray(seen.get("source_energy", zero)),
    }
    return {name: values - values[0] for name, values in changes.items() if np.any(values - values[0])}


def drift(seen: dict[str, Any]) -> float:
    """Return the largest unexplained change of the total energy, relative to the largest energy involved.

    The zero of the potential energy is arbitrary, so only its range counts. Without an energy the result is in J.
    """
    changes, total = books(seen), np.asarray(seen["total_energy"])
    change = np.abs(total - total[0] - np.sum(list(changes.values()), axis=0)).max()
    scale = np.max(np.abs(seen["kinetic_energy"])) + np.ptp(seen["potential_energy"])
    scale += np.max(np.abs(seen["contact_energy"])) + sum(np.abs(values).max() for values in changes.values())
    return float(change / scale if scale else change)


def chunk_sums(partial: Floats, state: State, lasts: bool) -> Floats:
    """Return the sums over the particles of each chunk: (quantities, chunks).

    The rows are the sums of `observe`, the dissipated energy, the duration of contacts, the impulse of each wall, the
    work of each wall if walls move, the heat of each wall, and the crossings of counters. Each chunk is summed by
    itself, so that the sums of a part of the particles, of whole chunks, are a part of the sums of all particles.
    """
    contacts = state.contacts if lasts else None
    n, heat = state.mass.size, state.heat
    booked, more = _ENERGY_ERROR + 2 + len(state.impulse), 1 if heat is None else len(heat)
    crossed = () if state.crossed is None else (state.crossed.number, state.crossed.sums)
    last = booked + more
    sums = np.zeros((last + sum(map(len, crossed)), len(partial)))
    sums[:_ENERGY_ERROR] = partial.T[:_ENERGY_ERROR]
    if state.dissipated.size:
        add_up(state.dissipated[None], n, sums[_ENERGY_ERROR, None])
    if contacts is not None:
        add_up(contacts.sliding[None], n, sums[_ENERGY_ERROR + 1, None])
    add_up(state.impulse, n, sums[_ENERGY_ERROR + 2 : booked])
    if heat is not None:
        add_up(heat, n, sums[booked:last])
    for values in crossed:
        add_up(values, n, sums[last : last + len(values)])
        last += len(values)
    return sums


def add_up(values: NDArray[Any], n: int, sums: Floats) -> None:
    """Add values (rows, n) over chunks into sums (rows, chunks).

    Values (rows, 1), which are of all particles together, go into the first chunk.
    """
    if values.shape[1] < n:
        sums[:, :1] = values
        return
    whole = n // CHUNK
    if whole:
        np.add.reduce(values[:, : whole * CHUNK].reshape(-1, whole, CHUNK), axis=2, out=sums[:, :whole])
    if whole * CHUNK < n:
        np.add.reduce(values[:, whole * CHUNK : n], axis=1, out=sums[:, whole])


def summed(
    sums: Floats, owners: list[int], booked: int, has_heat: bool, parts: PartsOfRows | None = None, counters: int = 0
) -> dict[str, Any]:
    """Return the observables that are sums over particles, from the sums of all chunks (quantities, chunks).

    `owners` has the surface of each wall, and `parts` its part of a union; `booked` is the number of rows of impulse
    and work, and `counters` the number of counters. NumPy adds pairwise.
    """
    # NumPy adds rows in an order that depends on their layout in memory.
    totals = np.add.reduce(np.ascontiguousarray(sums), axis=1)
    kinetic, fall, stored = totals[: _CONTACT + 1].tolist()
    lost, lasted = totals[_ENERGY_ERROR : _ENERGY_ERROR + 2].tolist()
    last = len(totals) - COUNTED * counters
    walls, crossed = totals[_ENERGY_ERROR + 2 : last], totals[last:]
    pushed, heat = walls[:booked], walls[booked:]
    # The work of moving walls follows their impulses.
    moves = {} if booked == len(owners) else {"wall_work": np.bincount(owners, weights=pushed[len(owners) :])}
    impulse = np.bincount(owners, weights=pushed[: len(owners)])
    return {
        "kinetic_energy": kinetic,
        "potential_energy": fall,
        "contact_energy": stored,
        "total_energy": kinetic + fall + stored,
        "dissipated_energy": lost,
        "momentum": totals[_PX : _PZ + 1],
        "angular_momentum": totals[_LX : _LZ + 1],
        "impulse": impulse,
        "sliding_time": lasted,
        "wall_heat": np.bincount(owners, weights=heat) if has_heat else np.zeros_like(impulse),
        **moves,
        **_of_parts(parts, pushed[: len(owners)], heat if has_heat else None),
        **of_counters(crossed, counters),
    }


def of_counters(crossed: Floats, counters: int) -> dict[str, NDArray[Any]]:
    """Return the crossings of each counter in each sense, from the rows of `Crossed`."""
    if not counters:
        return {}
    sums = crossed[2 * counters :].reshape(counters, 2, CROSSED)
    return {
        # Whole numbers, which floats hold exactly up to 2^53.
        "crossings": crossed[: 2 * counters].astype(np.int64).reshape(counters, 2),
        "crossed_momentum": sums[..., :3].copy(),
        "crossed_energy": sums[..., 3].copy(),
        "crossed_slowness": sums[..., 4].copy(),
    }


def _of_parts(parts: PartsOfRows | None, impulse: Floats, heat: Floats | None) -> dict[str, Floats]:
    """Return the impulse and the heat of the parts of unions, from the rows of the scene."""
    if parts is None:
        return {}
    given = {"part_impulse": impulse, "part_heat": np.zeros_like(impulse) if heat is None else heat}
    added = {name: np.bincount(parts.rows, rows, parts.number + 1) for name, rows in given.items()}
    return {name: np.asarray(values[: parts.number], np.float64) for name, values in added.items()}


def counted(partial: Floats, state: State, lasts: bool) -> dict[str, Any]:
    """Return the observables that are maxima or counts, which do not depend on the order of particles."""
    multipliers, contacts = state.multipliers, state.contacts if lasts else None
    energy_error, depth = partial[:, _ENERGY_ERROR:].max(axis=0).tolist()
    loops = {} if multipliers is None else {"sweeps": int(multipliers.sweeps.sum())}
    return {
        "energy_error": energy_error,
        "max_penetration": depth,
        "impacts": int(state.impacts[: state.mass.size].sum()),
        "sliding": 0 if contacts is None else int(np.count_nonzero(contacts.phase[: state.mass.size])),
        **loops,
        "unconverged": 0 if multipliers is None else int(multipliers.unconverged.sum()),
    }


def summary(
    partial: Floats, state: State, owners: list[int], lasts: bool, parts: PartsOfRows | None = None
) -> dict[str, Any]:
    """Return the observables of a frame from the partial sums (chunks, ROWS); `lasts`: contacts lasted in this run."""
    sums = chunk_sums(partial, state, lasts)
    counters = 0 if state.crossed is None else len(state.crossed.side)
    added = summed(sums, owners, len(state.impulse), state.heat is not None, parts, counters)
    return {**added, **counted(partial, state, lasts)}
