"""The description of a source for users, checked."""

from dataclasses import MISSING, dataclass, fields
from typing import Annotated, Any

import numpy as np

from ..common import checks
from ..common.validated import Count, Flag, Magnitude, NotNegative, Number, Positive, Validated, choice
from ..errors import SceneError
from ..surfaces.presence.doors import Opening
from ..surfaces.surface import Surface

_HALF_TURN = np.pi


def _mass(name: str, value: Any) -> float:
    mass = checks.number(name, value)
    if not checks.SMALLEST <= mass <= checks.LARGEST:
        raise SceneError(f"{name} must be from {checks.SMALLEST:g} to {checks.LARGEST:g} kg, got {mass:g}")
    return mass


def _beam(name: str, value: Any) -> checks.Vector:
    beam = checks.vector(name, value)
    checks.magnitude(f"|{name}|", float(np.sqrt(np.sum(np.square(beam)))))
    if not any(beam):
        raise SceneError(f"{name} must be a velocity, three numbers that are not all 0, got (0, 0, 0)")
    return beam


def _radius(name: str, value: Any) -> float | tuple[float, float]:
    """Return one radius, or the bounds of many."""
    if not isinstance(value, (list, tuple)):
        return checks.length(name, value)
    if len(value) != 2:
        raise SceneError(f"{name} must be a number, or (low, high), got {checks.shown(value)}")
    low, high = (checks.length(f"{name}[{k}]", one) for k, one in enumerate(value))
    if not low <= high:
        raise SceneError(f"{name} must be (low, high) with low <= high, got ({low:g}, {high:g})")
    return low, high


def _spin(name: str, value: Any) -> float | checks.Vector:
    """Return an angular speed, or an angular velocity."""
    if isinstance(value, (list, tuple, np.ndarray)):
        return checks.vector(name, value)
    return checks.at_least(name, value, 0.0)


@dataclass(frozen=True, repr=False)
class Source(Validated):
    """A source of particles that come during a run; `simulate(..., sources=[...])` takes a list of them.

    All births are drawn before the run, from its seed, each source by itself: the same bits for any threads, blocks,
    resumes and shards. Particles that come are numbered after those of the start, in the order in which they come.

    Births are in the half-open interval from `start`, included, to `stop`, excluded, as walls are `present`: if one
    source begins when another stops, no birth belongs to both. A source does not end with the run: a
    frame has all births up to its time, and at it, so it does not depend on the end of the run. With a method of fixed
    steps particles come at the end of the step in which their birth falls.

    Args:
        where: a surface of the scene, or its number: births on it, uniform in its area, into the vessel. Or an
            opening of a surface, or of a part of it: births on the surface that has it, where that is open.
            Or any other surface: births on its part in the vessel, to its admissible side.
        volume: True: births uniform in the part of the vessel on the admissible side of `where`.
        within: a surface with births on its admissible side, so that a part of a wall is a source; None: everywhere.
        rate: births a second, a Poisson process from `start` to `stop`. Or
        times: the times of all births [s], from 0 s on, in any order. Or
        count: without a rate, births at this number of independent times, uniform from `start` to `stop`; with one,
            the most births.
        even: True: births of a `rate` are evenly spaced, the first one at `start`; one that would be at `stop` to
            round-off does not come.
        start: the time at which births of a rate or a count begin [s].
        stop: the time at which they end [s], not before `start`; if both are equal a count comes then; None: a rate
            does not end. A count without a rate needs it.
        temperature: k_B T [J] of the gas that comes. From a surface it is effusive: the velocities are those of
            particles that pass a hole in the wall of a vessel with that gas; from a volume they are Maxwellian. Or
        speed: |v| of all particles [m/s]; from a surface in the directions of the cosine law, from a volume in any. Or
        beam: the velocity of all particles, three numbers [m/s].
        divergence: half angle of the cone about a beam in which directions are uniform [rad], below pi; directions
            into a wall on which particles are born do not occur.
        mass: mass of each particle [kg]; None: 1 kg, for balls without a `radius` here that of those at the start.
        radius: of balls [m], one number, or (low, high): uniform between them; None: that of the particles of the
            start, which must all be equal, or points. Births of balls overlap neither balls nor walls, each at up
            to 16 random places. On a wall balls touch it with their surface, on another surface and in a volume their
            centres are there, everywhere the largest ball fits.
        density: of balls [kg/m^3], in a plane [kg/m^2], in place of a mass.
        spin: of balls and bodies: the angular speed about random axes, or three numbers, the angular velocity [rad/s].
        blocked: of balls and bodies, the rule for a birth that finds no free place: "wait", it and those after it
            come when it finds one, tried again in the time that a ball needs for its radius, or where nothing moves
            when the next birth is due; "report", it never comes. Both count in the observable `blocked`.

    In a run of bodies further copies of the body come, turned at random; a birth has room if the ball
    around the body has room, about its centre of mass. Its mass is that of the body.

    Raises:
        SceneError: an argument is out of its range, or arguments do not go together. Conflicts with the scene (a
            source outside the vessel, on a wall that moves) are found when a run starts.

    >>> Source(0, rate=1e4, temperature=1.0)
    Source(where=0, rate=10000.0, temperature=1.0)
    """

    where: Any
    volume: Flag = False
    within: Any = None
    rate: Positive | None = None
    times: Any = None
    count: Count | None = None
    even: Flag = False
    start: NotNegative = 0.0
    stop: Number | None = None
    temperature: Magnitude | None = None
    speed: Magnitude | None = None
    beam: Annotated[Any, _beam] | None = None
    divergence: NotNegative = 0.0
    mass: Annotated[float, _mass] | None = None
    radius: Annotated[Any, _radius] | None = None
    density: Annotated[float, _mass] | None = None
    spin: Annotated[Any, _spin] = 0.0
    blocked: Annotated[str, choice("wait", "report")] = "wait"

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_place()
        self._check_times()
        self._check_velocity()
        if self.mass is not None and self.density is not None:
            raise SceneError(f"a source needs one of mass and density, got {self.mass:g} kg and {self.density:g}")

    def __repr__(self) -> str:
        """Return the call that makes it, without defaults."""
        given = [f for f in fields(self) if f.default is MISSING or getattr(self, f.name) is not f.default]
        return f"Source({', '.join(f'{f.name}={_as_text(getattr(self, f.name))}' for f in given)})"

    def _check_place(self) -> None:
        if isinstance(self.where, (int, np.integer)) and not isinstance(self.where, bool):
            checks.assign(self, where=checks.count("where", self.where, least=0))
        elif not isinstance(self.where, (Surface, Opening)):
            raise SceneError(
                f"where must be a surface, one of the openings of a surface, or the number of a surface of the scene, "
                f"got {checks.shown(self.where)}"
            )
        if self.volume and isinstance(self.where, Opening):
            raise SceneError("volume must be False at an opening, got True; give the surface that is its volume")
        if self.within is not None and not isinstance(self.within, (Surface, Opening)):
            raise SceneError(f"within must be a surface, or None, got {checks.shown(self.within)}")

    def _check_times(self) -> None:
        given = [name for name in ("rate", "times") if getattr(self, name) is not None]
        if len(given) == 2 or (self.count is not None and given == ["times"]):
            raise SceneError(
                f"a source needs one of rate, times and count (count may go with a rate), got "
                f"{' and '.join([*given, *['count'] * (self.count is not None)])}"
            )
        if not given and self.count is None:
            raise SceneError("a source needs one of rate, times and count, got none")
        if self.even and self.rate is None:
            raise SceneError("even must go with a rate, got True without one; give rate=, or the times themselves")
        self._check_span()
        if self.times is not None:
            self._check_list()

    def _check_span(self) -> None:
        if self.stop is not None:
            if not self.stop >= self.start:
                raise SceneError(f"stop must be at start = {self.start:g} s or later, got {self.stop:g}")
        elif self.count is not None and self.rate is None:
            raise SceneError(
                "stop must be given with a count alone, got None: births are spread from start to stop, and the end of "
                "the run must not change them; give stop=, such as until"
            )

    def _check_list(self) -> None:
        if self.start != 0.0 or self.stop is not None:
            raise SceneError(f"start and stop must be left out with times, got {self.start:g} and {self.stop}")
        times = checks.array("times", self.times)
        if times.ndim != 1 or not len(times):
            raise SceneError(f"times must be a list of at least one time [s], got shape {times.shape}")
        bad = np.flatnonzero(~(np.isfinite(times) & (times >= 0.0)))
        if bad.size:
            raise SceneError(f"times[{bad[0]}] must be a finite time of 0 s or later, got {times[bad[0]]:g}")
        checks.assign(self, times=tuple(np.sort(times).tolist()))

    def _check_velocity(self) -> None:
        given = [name for name in ("temperature", "speed", "beam") if getattr(self, name) is not None]
        if len(given) != 1:
            raise SceneError(f"a source needs one of temperature, speed and beam, got {' and '.join(given) or 'none'}")
        if self.divergence >= _HALF_TURN:
            raise SceneError(f"divergence must be below pi, the half angle of a cone [rad], got {self.divergence:g}")
        if self.divergence > 0.0 and self.beam is None:
            raise SceneError(f"divergence must go with a beam, got {self.divergence:g} without one; give beam=")

    def require_points(self, name: str) -> None:
        """Raise a `SceneError` if points do not have one of its arguments."""
        given = {"density": self.density is None, "spin": self.spin == 0.0, "blocked": self.blocked == "wait"}
        if self.radius is None and (wrong := [key for key, is_left_out in given.items() if not is_left_out]):
            raise SceneError(
                f"{name}.{wrong[0]} must be left out without a radius, got {getattr(self, wrong[0])}: the particles "
                "are points; give radius="
            )

    def largest(self) -> float:
        """Return the largest radius of its balls [m]; 0 for points."""
        return float(np.max(self.radius or 0.0))


def checked_sources(name: str, value: Any) -> tuple[Source, ...]:
    """Return the argument `sources` of a run, checked."""
    if value is None:
        return ()
    given = (value,) if isinstance(value, Source) else checks.list_of(name, value, "swarm.Source")
    for k, one in enumerate(given):
        checks.of_class(f"{name}[{k}]", one, Source)
    return given


def _as_text(value: Any) -> str:
    return checks.shown(value) if isinstance(value, tuple) and len(value) > 3 else repr(value)
