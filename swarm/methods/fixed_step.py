"""The common part of methods with a fixed step: whole steps, jumps over free steps, solids that a step could miss."""

import math
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..common import checks
from ..common.status import Status
from ..common.validated import Positive, choice
from ..contact import medial
from ..contact.discrete_gradient import MeanValue
from ..contact.laws import Laws, Moves
from ..contact.regularisation import regularisation
from ..errors import SceneError
from ..kernel.arrays import kept
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import outlined, select
from ..kernel.vector import Vec, dot, square
from ..motion import speed_at_start
from ..particles import Particles
from ..scene import Scene
from ..surfaces.in_motion.drive import drive_of
from ..surfaces.required import require
from ..surfaces.surface import Surface, named
from ..surfaces.time_of_impact import flights, safe
from . import base, contract

# A frame may miss a whole number of steps by this part of a step, as decimal times are not binary numbers.
_WHOLE = 1e-6
# A larger number of steps is not counted exactly.
_MOST_STEPS = 2.0**53
Gradient = Annotated[str, choice("composite", "mean-value")]


@dataclass(frozen=True)
class SoftWalls(base.Method):
    """A method of fixed step with springs as walls. See the subclasses."""

    dt: Positive
    penalty: Positive
    exponent: Annotated[float, partial(checks.at_least, bound=1.0)] = 1.0

    def check(self, scene: Scene, particles: Particles) -> None:
        if particles.radius is None:
            base.check_bends(scene)
            check_instants(scene, self.dt)
            check_turns(self, scene)
        check_solids(scene, particles, self.dt)

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        asked: tuple[Any, ...] = flights.of_steps(scene.gravity is not None)
        return asked

    def record(self, kind: type["SoftNumbers"], scene: Scene, factor: float, form: Any = None) -> "SoftNumbers":
        """Return the numbers of this description as a record `kind`, which divides `factor` by the mass."""
        longest = longest_step(scene, self.dt)
        return kind(
            self.dt,
            self.law(),
            longest,
            factor,
            form,
            moves(scene),
            _half_widths(scene),
            scene.finite_size(),
            laws_at_ends(scene),
        )

    def span(self, name: str, duration: float) -> float:
        return whole_steps(name, duration, self.dt)

    def instant(self, moment: float) -> float:
        return whole_time(moment, self.dt)

    def birth_times(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        # All steps begin and end together.
        return np.ceil(times / self.dt - _WHOLE) * self.dt

    def parts(self, durations: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.round(durations / self.dt)

    def supports_period(self) -> bool:
        return True

    def seldom_hard(self, scene: Scene) -> bool:
        return len(_of_rows(scene)) == 1 and not scene.surfaces[0].is_solid()

    def law(self) -> Any:
        return regularisation(self.penalty, self.exponent)

    def too_fast(self, scene: Scene) -> str:
        thin = _described(scene, thinnest(scene, self.dt)[1])
        return f"with dt = {self.dt:g} s and {thin}; use a smaller dt, or Impact"


def check_gradient(method: Any) -> None:
    """Raise a `SceneError` if the method has no such gradient for its exponent."""
    if method.gradient == "mean-value" and method.exponent == 1.0:
        raise SceneError(
            'gradient must be "composite" for exponent = 1, got "mean-value": that form is the gradient of Phi at a '
            "point of the step, and for exponent = 1 this gradient jumps at the surface, so no such point need exist"
        )


def moves(scene: Scene) -> Moves | None:
    """Return `Moves` in the form for kernels, or None if no wall moves."""
    return Moves(0.0) if scene.moves() else None


def laws_at_ends(scene: Scene, apart: str = "fixed steps") -> Laws | None:
    """Return the laws of walls in the form for kernels, or None if no wall has laws besides its motion."""
    laws = scene.compiled(apart=apart).laws
    return laws if laws is not None and (laws.loses or laws.send_off) else None


def check_instants(scene: Scene, dt: float) -> None:
    """Raise a `SceneError` if walls come or go, or openings open or shut, within a step."""
    for time in scene.instants:
        if abs(time / dt - round(time / dt)) > _WHOLE:
            raise SceneError(
                f"walls must come and go, and openings open and shut, at whole steps, got {time:g} s with dt = {dt:g} "
                f"s, which is {time / dt:.6g} steps; give times that are multiples of dt, another dt, or Impact"
            )


def check_turns(method: base.Method, scene: Scene) -> None:
    """Raise a `SceneError` if a wall that turns lacks a function that its steps need."""
    purpose = f"{type(method).__name__} at a wall that turns"
    # For the walls of steps: a union of several rooms is one wall, and a sphere about its own centre does not turn.
    pieces = scene.compiled(apart="fixed steps").pieces
    for i, piece in zip(pieces.owners, pieces.each, strict=True):
        if piece.motion is not None and drive_of(piece, 0.0).turn is not None:
            require([piece], purpose, ("turned_push",), f"surfaces[{i}]")


def check_solids(scene: Scene, particles: Particles, dt: float) -> None:
    """Raise a `SceneError` if the fastest particle can jump over a solid in one step, or a solid over the particle."""
    balls, fastest = particles.radius is not None, particles.fastest()
    if not balls:
        check_reach("dt", dt, scene, fastest)
    solids = [(i, one, _speed_against(one, particles)) for i, one in enumerate(scene.surfaces) if one.is_solid()]
    if not solids:
        return
    i, solid, speed = min(solids, key=lambda one: 2.0 * one[1].size() - one[2] * dt)
    if speed * dt > 2.0 * solid.size():
        moved = "" if solid.motion is None else ", as it moves"
        raise SceneError(
            f"dt must be so small that no particle jumps over a solid in one step, got dt = {dt:g} s, in which the "
            f"fastest flies {speed * dt:.3g} m{moved}, and {_described(scene, i)}; use dt < "
            f"{2.0 * solid.size() / speed:.2g} s, or Impact"
        )


def check_reach(name: str, step: float, scene: Scene, fastest: float) -> None:
    """Raise a `SceneError` if the fastest particle [m/s] can go beyond the known walls in a step over a face."""
    reach = scene.reach_of_steps()
    if reach is not None and fastest * step > reach:
        raise SceneError(
            f"{name} must be so small that no particle flies farther than {reach:.3g} m in a step, a part of the "
            f"shortest period, got {name} = {step:g} s, in which the fastest flies {fastest * step:.3g} m; use {name} "
            f"< {reach / fastest:.2g} s, or Impact"
        )


def longest_step(scene: Scene, dt: float, balls: bool = False) -> float | None:
    """Return the longest flight of points, or of balls, in a step that jumps over no solid [m]; None without solids."""
    if not any(surface.is_solid() for surface in scene.surfaces):
        return None
    thickness, i = thinnest(scene, dt, balls)
    reach = None if balls else scene.reach_of_steps()
    return min(thickness - _pace(scene.surfaces[i], balls) * dt, math.inf if reach is None else reach)


def way_of_walls(scene: Scene, dt: float) -> float:
    """Return the most that a wall moves in a step, as balls meet it [m], without turns."""
    return dt * max((_pace(surface, balls=True) for surface in scene.surfaces), default=0.0)


def _half_widths(scene: Scene) -> tuple[float, ...] | None:
    """Return the half width of the solid of each wall [m], infinite for a cavity; None if no wall has another side."""
    if not any(surface.may_be_passed() for surface in scene.surfaces):
        return None
    return tuple(surface.size() if surface.is_solid() else math.inf for surface in _of_rows(scene))


def _of_rows(scene: Scene) -> list[Surface]:
    """Return the surface of each row, with each solid as a wall by itself."""
    return [scene.surfaces[i] for i in scene.compiled(apart="fixed steps").numbering.surfaces_of_rows]


def _pace(surface: Surface, balls: bool = False) -> float:
    """Return a bound of the speed of a surface [m/s].

    For balls it excludes turns, which the lists of balls follow, and is 0 if impacts move the surface: then the motion
    counts in the speed of the balls against it.
    """
    if surface.motion is None or (balls and surface.reacts()):
        return 0.0
    if surface.reacts():
        return math.hypot(*speed_at_start(surface.motion))
    drive = drive_of(surface, 0.0)
    turns = 0.0 if balls else drive.angular_speed() * (surface.extent() + math.hypot(*drive.center))
    fastest: float = drive.fastest + turns
    return fastest


def _speed_against(surface: Surface, particles: Particles) -> float:
    """Return a bound of the speed of particles against a surface at the start [m/s]."""
    balls = particles.radius is not None
    if balls and surface.reacts():
        return particles.fastest(speed_at_start(surface.motion))
    return particles.fastest() + _pace(surface, balls)


def thinnest(scene: Scene, dt: float, balls: bool = False) -> tuple[float, int]:
    """Return the thickness [m] and the number of the solid that a step jumps over first."""
    solids = [(i, surface) for i, surface in enumerate(scene.surfaces) if surface.is_solid()]
    i, surface = min(solids, key=lambda one: (2.0 * one[1].size() - _pace(one[1], balls) * dt, one[0]))
    return 2.0 * surface.size(), i


def _described(scene: Scene, i: int) -> str:
    return f"{named(i, scene.surfaces[i])}, {2.0 * scene.surfaces[i].size():.3g} m thick"


def whole_steps(name: str, duration: float, dt: float) -> float:
    """Return the number of steps of a duration; raise a `SceneError` that calls it `name` if they are not whole."""
    if duration / dt > _MOST_STEPS:
        raise SceneError(
            f"{name} must be at most {_MOST_STEPS:g} steps, got {name} = {duration:g} s with dt = {dt:g} s"
        )
    steps = round(duration / dt)
    if abs(duration / dt - steps) > _WHOLE:
        raise SceneError(
            f"{name} must be a whole number of steps, got {name} = {duration:g} s with dt = {dt:g} s, which is "
            f"{duration / dt:.6g} steps; take {name} = {_shortest(max(1, steps), dt)} s"
        )
    return float(steps)


def _shortest(steps: int, dt: float) -> str:
    """Return the time of `steps` steps in the fewest digits, six or more, that give this number of steps.

    >>> _shortest(27843, 2e-5), _shortest(12345678, 1e-3)
    ('0.55686', '12345.678')
    """
    texts = (f"{steps * dt:.{digits}g}" for digits in range(6, 17))
    return next((text for text in texts if abs(float(text) / dt - steps) <= _WHOLE), repr(steps * dt))


def steps_within(duration: float, dt: float) -> float:
    """Return the number of equal steps of a duration [s] that are no longer than dt [s], to round-off.

    >>> steps_within(0.3, 0.1), steps_within(0.31, 0.1), steps_within(1e-12, 0.1)
    (3.0, 4.0, 1.0)
    """
    return float(max(1, math.ceil(duration / dt - _WHOLE)))


def whole_time(moment: float, dt: float) -> float:
    """Return the time of the steps at a moment [s], which they may miss: walls must not jump between frames."""
    return round(moment / dt) * dt


# --- The form for kernels --------------------------------------------------------------------------------


class StepEnergy(NamedTuple):
    """The numbers of a lane."""

    twice_energy: float  # per mass, at the start plus the work of walls since then
    over_mass: float  # the factor of the method over the mass


class Steps(contract.MethodNumbers):
    """A method of steps, with the fields `dt`, `longest`, `factor` and `moving`: the walls of a step, and its ends."""

    point = 1.0  # the part of a step after which its force is taken
    contacts_take_time = True

    def seconds(self: Any, remaining):
        return remaining * self.dt

    def constants(self, mass, energy, scale2):
        return 2.0 * energy, self.factor / mass, 0.0

    def own(self, first, second, third):
        return StepEnergy(first, second)

    @property
    def dissipates(self):
        return self.moving is not None

    @property
    def laws_at_ends(self: Any):
        return self.ends

    @property
    def steps_into_walls(self):
        return not self.lands

    def walls_of(self, walls, remaining):
        # All walls: each part of a step selects those that it needs.
        return walls

    def at_start(self: Any, walls, remaining):
        return walls.at(remaining * self.dt)

    def over(self: Any, walls, remaining):
        """Return the walls over the step."""
        return walls.during(remaining * self.dt, (remaining - 1.0) * self.dt)

    def after(self: Any, walls, remaining):
        """Return the walls at the end of the step."""
        return walls.at((remaining - 1.0) * self.dt)

    def times(self, walls, remaining):
        """Return the walls at the start of the step, over it and at its end."""
        return self.at_start(walls, remaining), self.over(walls, remaining), self.after(walls, remaining)

    def reach(self: Any, before, gravity, lane):
        """Return the displacement from r0 to the point at which the force is taken, without walls."""
        return displacement(gravity, lane.v, self.dt)

    def is_too_fast(self: Any, p):
        """Whether a step with free displacement p could jump over a solid; only the length of p counts."""
        return False if self.longest is None else square(p) > self.longest * self.longest

    def work_along(self: Any, over, wall, force, ends):
        """Return the work of a force of this wall in a step with the ends r0 and r1; 0 if no wall moves."""
        return 0.0 if self.moving is None else dot(force, over.swept(wall, *ends))

    def is_outside(self, walls, wall, r):
        """Whether a point is outside of a wall: the contact of a step that ends there continues in the next one."""
        return walls.of(wall, False, _is_outside, r)

    def flight(self: Any, walls, gravity, lane, hit=None):
        """Fly over the steps that surely stay free, to one that touches a wall: HARD if a lane cannot take it alone."""
        dt, left = self.dt, lane.remaining * self.dt
        free = safe.free_time_moving(walls, gravity, lane.r, lane.v, left) if hit is None else hit.time
        # One step too many by round-off starts a contact 1e-16 deep, which is harmless.
        steps = np.floor(free * (1.0 / dt))
        return self.flown(walls, gravity, lane, select(steps < lane.remaining, steps, lane.remaining))

    def flown(self: Any, walls, gravity, lane, steps):
        """Return the `FlightEnd` after a number of free steps."""
        t = steps * self.dt
        start = contract.Lane(
            lane.r + displacement(gravity, lane.v, t), accelerated(gravity, lane.v, t), lane.remaining - steps,
            lane.hits, lane.own,
        )  # fmt: skip
        wall = self.touched(walls, gravity, start)
        return contract.FlightEnd(start.r, start.v, start.remaining, select(start.remaining > 0.0, wall, -1.0))

    def touched(self: Any, walls, gravity, lane):
        dt = self.dt
        to_point = walls.during(lane.remaining * dt, (lane.remaining - self.point) * dt)
        touched = to_point.touched(lane.r, self.reach(self.at_start(walls, lane.remaining), gravity, lane))
        # Several walls at once and nested solves need the careful way.
        alone = (touched.number <= 1.0) & (not isinstance(self.form, MeanValue))
        wall = select(alone, touched.wall, contract.HARD - touched.wall)
        return select(self.is_too_fast(displacement(gravity, lane.v, dt)), contract.HARD, wall)


class SoftNumbers(Steps):
    """A method with soft walls in the form for kernels; each method has its own subclass."""

    dt: float
    law: Any
    longest: Any  # longest step that jumps over no solid and out of a cell only to known walls [m]; None without solids
    factor: float  # of 1/mass in the numbers of a lane
    form: Any  # of the discrete gradient, or None
    moving: Any  # `Moves` if a wall moves, else None
    half_widths: Any  # of the solid of each wall [m], infinite for a cavity; None if no wall has another side
    size: float  # of the scene [m]
    ends: Any  # the `Laws` of its walls, which act where a contact ends, or None

    def passes(self, walls, lane, wall, r, v):
        """Whether a step with the end r, v leads a lane through the middle of this wall."""
        if self.half_widths is None:
            return False
        before, over, after = self.times(walls, lane.remaining)
        way = r - lane.r
        if self.moving is not None:
            way = way - over.swept(wall, lane.r, r)
        return medial.passes((before, lane.r), (after, r), wall, way, self.dt * (lane.v - v), self.half_widths)

    def _passes_any(self, walls, lane, r, v):
        """Whether a step leads a lane through the middle of any wall that it is in contact with."""
        if self.half_widths is None:
            return False
        before, _over, after = self.times(walls, lane.remaining)
        found = False
        for k in range(len(self.half_widths)):
            wall = float(k)
            touched = (before.distance(wall, lane.r) > 0.0) | (after.distance(wall, r) > 0.0)
            found = found | (touched & self.passes(walls, lane, wall, r, v))
        return found

    def careful_step(self, walls, gravity, lane, impulse, i):
        """Return the `Careful` step of a lane; add impulses to impulse[wall, i], and works to the rows behind them."""
        raise NotImplementedError

    @outlined
    def hard_pass(self, walls, gravity, lane, wall, lanes, i):
        if self.is_too_fast(displacement(gravity, lane.v, self.dt)):
            return contract.refused(lane, Status.TOO_FAST.value)
        step = self.careful_step(walls, gravity, lane, lanes.impulse, i)
        status = Status.DONE.value if step.solved else Status.UNSOLVED.value
        if self._passes_any(walls, lane, step.r, step.v):
            return contract.refused(lane, Status.TOO_DEEP.value)
        twice_energy = lane.own.twice_energy + 2.0 * step.work
        return contract.Contact(step.r, step.v, lane.remaining - 1.0, 0.0, 0.0, 0.0, twice_energy, False), status


def _is_outside(surface, r):
    return surface.level_of(surface.inner(r)) > 0.0


# --- The contact -----------------------------------------------------------------------------------------


class Taken(NamedTuple):
    """A step of a lane, solved or not, with the impulse and the work of the wall per mass."""

    r: Vec
    v: Vec
    solved: bool
    impulse: float
    new: bool  # whether it starts an impact: it is inside of its wall
    work: float


def contact(lane, wall, taken):
    """Return the `Contact` of a lane that takes its step, leaves it to the careful way, or has ended its frame."""
    touching = wall >= 0.0
    step = (lane.remaining > 0.0) & select(touching, taken.solved, wall > contract.HARD)
    work = select(step & touching, taken.work, 0.0)
    return contract.Contact(
        select(step, taken.r, kept(lane.r)),
        select(step, taken.v, kept(lane.v)),
        lane.remaining - select(step, 1.0, 0.0),
        select(touching & (not taken.solved), contract.HARD - wall, wall),
        select(step, taken.impulse, 0.0),
        select(step & taken.new, 1.0, 0.0),
        lane.own.twice_energy + 2.0 * work,
        False,
        work,
    )


class Careful(NamedTuple):
    """A step against any number of walls, and the work of the walls per mass."""

    r: Vec
    v: Vec
    solved: bool
    work: float
