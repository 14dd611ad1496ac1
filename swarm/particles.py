"""Particles: arrays with one row per component."""

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import checks, notebook
from .columns import read_columns
from .errors import SceneError

Floats = NDArray[np.float64]

_COLUMNS = ("x", "y", "z", "vx", "vy", "vz")


class Particles:
    """Positions, velocities and masses of N particles.

    Args:
        position: (3, N) or (3,) [m], rows x, y, z.
        velocity: (3, N) or (3,) [m/s].
        mass: one number or (N,) [kg], above 0.
        image: (3, N) whole numbers, or None: in a scene with a period, how many cells away each particle is.
        radius: None: particles are points and do not meet one another.

    The arrays are copied, in C order. `volume` is the volume they were filled into [m^3], in a plane the area [m^2], or
    None. Arrays that are
    assigned later are checked and converted in the same way when a run starts.

    Raises:
        SceneError: wrong shapes, no particle, a value that is not finite or beyond 1e100, a mass not from 1e-100 to
            1e100, a radius.

    >>> len(Particles([[0.0, 0.1], [0.0, 0.0], [0.0, 0.0]], np.ones((3, 2))))
    2
    """

    volume: float | None = None
    # Of a run with sources: who comes when.
    births: "Births | None" = None

    def __init__(
        self,
        position: ArrayLike,
        velocity: ArrayLike,
        mass: ArrayLike = 1.0,
        image: ArrayLike | None = None,
        radius: object = None,
    ) -> None:
        checks.no_radius(radius)
        checked = _checked(position, velocity, mass)
        self.position, self.velocity, self.mass = (np.array(array, order="C") for array in checked)
        self.image = None if image is None else _images(image, len(self))

    def copy(self) -> "Particles":
        """The same particles, checked again, with arrays of their own."""
        return Particles(self.position, self.velocity, self.mass, self.image)

    def __len__(self) -> int:
        return int(self.position.shape[1])

    def __repr__(self) -> str:
        return f"Particles({len(self)})"

    def _repr_html_(self) -> str:
        speeds = np.sqrt((self.velocity**2).sum(axis=0))
        held = dict(zip("xyz", self.position, strict=True)) | {"speed": speeds, "mass": self.mass}
        units = {"speed": "m/s", "mass": "kg"}
        rows = [(name, f"{row.min():.4g} to {row.max():.4g} {units.get(name, 'm')}") for name, row in held.items()]
        return notebook.table(f"{len(self)} particles", rows)

    def fastest(self) -> float:
        """The largest speed [m/s]."""
        return float(np.sqrt(np.nanmax((self.velocity**2).sum(axis=0), initial=0.0)))

    def born(self) -> "Particles":
        """Those that are there: without those of a frame of a run with sources that come later, whose rows are NaN.

        Raises:
            SceneError: nobody is there.
        """
        there = ~np.isnan(self.position[0])
        image = None if self.image is None else self.image[:, there]
        return Particles(self.position[:, there], self.velocity[:, there], self.mass[there], image)

    @classmethod
    def of_frame(
        cls, position: Floats, velocity: Floats, mass: Floats, image: NDArray[Any] | None, there: NDArray[np.bool_]
    ) -> "Particles":
        """Those of a frame, checked; who is not there yet is at NaN."""
        made = cls(np.where(there, position, 0.0), np.where(there, velocity, 0.0), mass, image)
        made.position[:, ~there] = made.velocity[:, ~there] = np.nan
        return made

    @classmethod
    def from_csv(cls, path: str | Path) -> "Particles":
        """Particles from a CSV file with columns x, y, z, vx, vy, vz and optionally mass, in any order.

        Raises:
            SceneError: the file cannot be read, a column is missing or unknown, or a cell is not a number; names
                file, row and column.
        """
        columns = read_columns(path, _COLUMNS, ("mass",), "particle")
        return cls(
            [columns[name] for name in _COLUMNS[:3]],
            [columns[name] for name in _COLUMNS[3:]],
            columns.get("mass", 1.0),
        )


class Births(NamedTuple):
    """The particles of a run that come while it lasts: behind those of the start, in the order in which they come.

    Attributes:
        time: (N,) when each comes [s], 0 of those of the start.
        source: (N,) the number of its source, -1 of those of the start.
        sources: how many there are.
    """

    time: Floats
    source: NDArray[np.int32]
    sources: int

    def there(self, moment: float) -> int:
        """The number of those, the first ones, that are there at a time [s]."""
        return int(np.searchsorted(self.time, moment, side="right"))


class Multipliers(NamedTuple):
    """Statistics of each particle's Uzawa loops since the start, from methods with multipliers.

    Attributes:
        sweeps: (N,) sweeps of all its contact steps together.
        contacts: (N,) contact steps.
        unconverged: (N,) contact steps whose loop did not reach the tolerance.
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


# What is summed up of the crossings of a counter: three components of the momentum, the energy, the slowness.
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

    @property
    def absorbed(self) -> Any:
        """`Absorbed`, or None where no wall absorbs any."""
        time, wall = self.absorbed_time, self.absorbed_wall
        return None if time is None or wall is None else Absorbed(time, wall)

    def gone(self) -> NDArray[np.bool_]:
        """(N,) whether each has escaped or was absorbed: where it is then it stays, whatever the walls do."""
        found = np.zeros(self.mass.size, np.bool_)
        for time in (self.escape_time, self.absorbed_time):
            if time is not None:
                found |= ~np.isnan(time[: found.size])
        return found


def is_gone(state, i):
    """Whether particle i has passed an opening, or was absorbed, and is no more among the walls."""
    escaped = False if state.escape_time is None else not math.isnan(state.escape_time[i])
    if state.absorbed is None:
        return escaped
    return (not math.isnan(state.absorbed.time[i])) | escaped


def _checked(position: ArrayLike, velocity: ArrayLike, mass: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """The three arrays as floats, in shapes that go together."""
    rows, speeds, masses = _rows("position", position), _rows("velocity", velocity), checks.array("mass", mass)
    n = rows.shape[1]
    if speeds.shape[1] != n:
        raise SceneError(f"velocity must have the shape of position, (3, {n}), got {speeds.shape}")
    if masses.ndim > 1 or (masses.ndim == 1 and masses.size != n):
        raise SceneError(f"mass must be one number or have shape ({n},), got shape {masses.shape}")
    masses = np.broadcast_to(masses, (n,))
    # NaN compares as false.
    if not (masses.min() >= checks.SMALLEST and masses.max() <= checks.LARGEST):
        first = int(np.argmin((masses >= checks.SMALLEST) & (masses <= checks.LARGEST)))
        raise SceneError(
            f"mass must be a finite number above 0, got {masses[first]:g} for particle {first}; it may be from "
            f"{checks.SMALLEST:g} to {checks.LARGEST:g} kg"
        )
    return rows, speeds, masses


def _images(value: ArrayLike, n: int) -> NDArray[np.int64]:
    """The argument `image`, checked."""
    given = checks.array("image", value)
    given = given.reshape(3, 1) if given.ndim == 1 and given.size == 3 else given
    # Whole numbers beyond this are no floats of their own.
    if given.shape != (3, n) or not (np.abs(given) <= 2.0**53).all() or (given != np.floor(given)).any():
        raise SceneError(f"image must be whole numbers of shape (3, {n}), at most 2**53, got {checks.shown(value)}")
    return given.astype(np.int64, order="C")


def _rows(name: str, value: ArrayLike) -> Floats:
    rows = checks.array(name, value)
    if rows.shape == (3,):
        rows = rows.reshape(3, 1)
    if rows.ndim != 2 or rows.shape[0] != 3:
        hint = "; transpose it" if rows.ndim == 2 and rows.shape[1] == 3 else ""
        raise SceneError(f"{name} must have shape (3, N), rows x, y, z, got {rows.shape}{hint}")
    if rows.shape[1] == 0:
        raise SceneError(f"{name} must hold at least one particle, got shape {rows.shape}")
    checks.particles_fit(name, rows.shape[1])
    # NaN compares as false. Beyond the limit the kinetic energy and phi overflow.
    if not (rows.max() <= checks.LARGEST and rows.min() >= -checks.LARGEST):
        good = (np.abs(rows) <= checks.LARGEST).all(axis=0)
        first = int(np.argmin(good))
        late = "; of a frame of a run with sources take those that are there: .born()" * bool(
            np.isnan(rows[:, first]).all()
        )
        raise SceneError(
            f"{name} must be finite and at most {checks.LARGEST:g}, got {tuple(rows[:, first].tolist())} for particle "
            f"{first} ({int((~good).sum())} such particles){late}"
        )
    return rows
