"""Particles: arrays with one row per component."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .common import checks, notebook
from .common.columns import read_columns
from .errors import SceneError
from .state import Floats

# The arrays of particles, in the order of the arguments.
ARRAYS = "position", "velocity", "mass", "image", "radius", "spin"
_COLUMNS = ("x", "y", "z", "vx", "vy", "vz")
_SPINS = ("wx", "wy", "wz")
# The further columns of a frame that was exported as .csv, which a start does not need.
_OF_FRAMES = (
    "time", "id", "impacts", "collisions", "image_x", "image_y", "image_z", "escape_time", "absorbed_time",
)  # fmt: skip


class VolumeEstimate(NamedTuple):
    """A volume [m^3], in a plane an area [m^2]."""

    volume: float
    error: float | None  # the standard error; 0 for a closed form, None if not known


class Particles:
    """Positions, velocities and masses of N particles.

    Args:
        position: (3, N) or (3,) [m], rows x, y, z.
        velocity: (3, N) or (3,) [m/s].
        mass: one number or (N,) [kg], above 0.
        image: (3, N) whole numbers, or None: the cell of each particle in a scene with a period.
        radius: one number or (N,) [m], above 0: particles are balls, which meet one another, and walls with their
            surface; None: particles are points, which do not meet one another.
        spin: (3, N), (3,) or None: the angular velocity of balls [rad/s]; None if nothing turns them.

    The arrays are copied, in C order. `volume` is the volume that the particles were filled into [m^3], in a plane the
    area [m^2], or None. `volume_error` is its standard error: 0 for a closed form, None if not known. Arrays that are
    assigned later are checked and converted in the same way when a run starts.

    Raises:
        SceneError: wrong shapes, no particle, a value that is not finite or beyond 1e100, a mass or a radius not from
            1e-100 to 1e100, a spin without a radius.

    >>> len(Particles([[0.0, 0.1], [0.0, 0.0], [0.0, 0.0]], np.ones((3, 2))))
    2
    """

    _volume: VolumeEstimate | Callable[[], VolumeEstimate] | None = None
    # The births, in a run with sources.
    births: "Births | None" = None

    def __init__(
        self,
        position: ArrayLike,
        velocity: ArrayLike,
        mass: ArrayLike = 1.0,
        image: ArrayLike | None = None,
        radius: ArrayLike | None = None,
        spin: ArrayLike | None = None,
    ) -> None:
        rows, speeds = _rows("position", position), _rows("velocity", velocity)
        if speeds.shape != rows.shape:
            raise SceneError(f"velocity must have the shape of position, (3, {rows.shape[1]}), got {speeds.shape}")
        self.position, self.velocity = (np.array(array, order="C") for array in (rows, speeds))
        self.mass = np.array(_each("mass", mass, len(self), "kg"), order="C")
        self.image = None if image is None else _images(image, len(self))
        self.radius = None if radius is None else np.array(_each("radius", radius, len(self), "m"), order="C")
        self.spin = None if spin is None else np.array(_spins(spin, radius, len(self)), order="C")

    def copy(self) -> "Particles":
        """Return the same particles, checked again, in copied arrays."""
        made = Particles(*(getattr(self, name) for name in ARRAYS))
        made._volume = self._volume
        return made

    @property
    def volume(self) -> float | None:
        """The volume that the particles were filled into [m^3], in a plane the area [m^2]; None if not known."""
        content = self._content()
        return None if content is None else content.volume

    @volume.setter
    def volume(self, volume: float | Callable[[], VolumeEstimate] | None) -> None:
        """Set the volume, or a function that returns it with its error, called at its first use."""
        self._volume = volume if volume is None or callable(volume) else VolumeEstimate(volume, None)

    @property
    def volume_error(self) -> float | None:
        """The standard error of `volume`: 0 for a closed form; None if not known."""
        content = self._content()
        return None if content is None else content.error

    def _content(self) -> VolumeEstimate | None:
        if callable(self._volume):
            self._volume = self._volume()
        return self._volume

    def __len__(self) -> int:
        return int(self.position.shape[1])

    def __repr__(self) -> str:
        return f"Particles({len(self)})"

    def _repr_html_(self) -> str:
        if not len(self):
            return notebook.table("0 particles", [])
        speeds = np.sqrt((self.velocity**2).sum(axis=0))
        held = dict(zip("xyz", self.position, strict=True)) | {"speed": speeds, "mass": self.mass}
        held |= {} if self.radius is None else {"radius": self.radius}
        units = {"speed": "m/s", "mass": "kg"}
        rows = [(name, f"{row.min():.4g} to {row.max():.4g} {units.get(name, 'm')}") for name, row in held.items()]
        return notebook.table(f"{len(self)} particles", rows)

    def fastest(self, against: Floats | None = None) -> float:
        """Return the largest speed [m/s], relative to a velocity `against` (3,) [m/s] if given."""
        velocity = self.velocity if against is None else self.velocity - against[:, None]
        return float(np.sqrt(np.fmax.reduce(np.add.reduce(velocity**2), initial=0.0)))

    def born(self) -> "Particles":
        """Return the particles without rows of NaN, which in a frame of a run with sources are particles not yet born.

        The result may be empty.
        """
        there = ~np.isnan(self.position[0])
        held = {name: getattr(self, name) for name in ARRAYS}
        some: dict[str, Any] = {name: None if rows is None else rows[..., there] for name, rows in held.items()}
        if there.any():
            return Particles(**some)
        made = object.__new__(Particles)
        made.__dict__.update(some)
        return made

    @classmethod
    def of_frame(
        cls, position: Floats, velocity: Floats, mass: Floats, image: NDArray[Any] | None, there: NDArray[np.bool_],
        radius: Floats | None = None, spin: Floats | None = None,
    ) -> "Particles":  # fmt: skip
        """Return the particles of a frame, checked; particles not yet born have positions and velocities of NaN."""
        made = cls(np.where(there, position, 0.0), np.where(there, velocity, 0.0), mass, image, radius, spin)
        made.position[:, ~there] = made.velocity[:, ~there] = np.nan
        return made

    @classmethod
    def from_csv(cls, path: str | Path) -> "Particles":
        """Read particles from a CSV file with columns x, y, z, vx, vy, vz and optionally mass, in any order.

        For balls it has a column radius, and may have columns wx, wy, wz of spins. A frame that was exported as .csv is
        such a file; its other columns are not read.

        Raises:
            SceneError: the file cannot be read, a column is missing or unknown, or a cell is not a number; names
                file, row and column.
        """
        columns = read_columns(path, _COLUMNS, ("mass", "radius", *_SPINS, "frame"), "particle", _OF_FRAMES)
        if len(frames := set(columns.get("frame", ()))) > 1:
            raise SceneError(f"{path}: expected particles at one time, got {len(frames)} frames; export one of them")
        spins = [columns[name] for name in _SPINS if name in columns]
        if spins and (len(spins) < len(_SPINS) or "radius" not in columns):
            raise SceneError(
                f"{path}: expected the columns {', '.join(_SPINS)} of spins all together and with radius, got "
                f"{', '.join(columns)}"
            )
        return cls(
            [columns[name] for name in _COLUMNS[:3]],
            [columns[name] for name in _COLUMNS[3:]],
            columns.get("mass", 1.0),
            radius=columns.get("radius"),
            spin=spins or None,
        )


class Births(NamedTuple):
    """The births during a run: particles follow the particles of the start, in the order of their births.

    Attributes:
        time: (N,) the time of the birth of each particle [s], 0 for particles of the start.
        source: (N,) the number of its source, -1 for particles of the start.
        sources: the number of sources.
        balls: the sources if they make balls; `time` is then the time at which a birth is due.
    """

    time: Floats
    source: NDArray[np.int32]
    sources: int
    balls: tuple[Any, ...] = ()

    def there(self, moment: float) -> int:
        """Return how many particles, the first ones, are born by a time [s]."""
        return int(np.searchsorted(self.time, moment, side="right"))


def _each(name: str, value: ArrayLike, n: int, unit: str) -> Floats:
    """Return a number above 0 for each of n particles."""
    given = checks.array(name, value)
    if given.ndim > 1 or (given.ndim == 1 and given.size != n):
        raise SceneError(f"{name} must be one number or have shape ({n},), got shape {given.shape}")
    given = given + np.zeros(n)
    # NaN compares as false.
    if not (given.min() >= checks.SMALLEST and given.max() <= checks.LARGEST):
        first = int(np.argmin((given >= checks.SMALLEST) & (given <= checks.LARGEST)))
        raise SceneError(
            f"{name} must be a finite number above 0, got {given[first]:g} for particle {first}; it may be from "
            f"{checks.SMALLEST:g} to {checks.LARGEST:g} {unit}"
        )
    return given


def _spins(value: ArrayLike, radius: ArrayLike | None, n: int) -> Floats:
    """Return the argument `spin`, checked."""
    if radius is None:
        raise SceneError("spin must be None without a radius, a point does not turn; give a radius too")
    rows = _rows("spin", value)
    if rows.shape[1] != n:
        raise SceneError(f"spin must have the shape of position, (3, {n}), got {rows.shape}")
    return rows


def _images(value: ArrayLike, n: int) -> NDArray[np.int64]:
    """Return the argument `image`, checked."""
    given = checks.array("image", value)
    given = given.reshape(3, 1) if given.ndim == 1 and given.size == 3 else given
    # Some whole numbers beyond this are not floats.
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
        late = "; in a frame of a run with sources take the particles that are born: .born()" * bool(
            np.isnan(rows[:, first]).all()
        )
        raise SceneError(
            f"{name} must be finite and at most {checks.LARGEST:g}, got {tuple(rows[:, first].tolist())} for particle "
            f"{first} ({int((~good).sum())} such particles){late}"
        )
    return rows


class TiedParticles:
    """Particles that are points of bodies: the part of `Bodies` that the engine of independent particles needs.

    Attributes:
        body: the template of all copies.
        position: (3, P, n) the position of every point of every copy [m].
        velocity: (3, P, n) the velocity of every point of every copy [m/s].
    """

    body: Any
    position: Floats
    velocity: Floats

    def __len__(self) -> int:
        return int(self.position.shape[2])

    def copy(self) -> Self:
        """Return the same bodies as a start, checked again, in copied arrays."""
        raise NotImplementedError

    def contact_points(self) -> Floats:
        """Return the points (3, K, n) that can touch walls."""
        raise NotImplementedError

    def bonds(self) -> NDArray[np.int64]:
        """Return the tied pairs of points (B n, 2), as numbers of `particles`."""
        raise NotImplementedError

    def moved(self, particles: Particles) -> Self:
        """Return these bodies at the present places of their points, which are `particles`."""
        raise NotImplementedError

    def particles(self) -> Particles:
        """Return all points as particles: point p of copy i has the number p n + i."""
        raise NotImplementedError
