"""The common part of methods with a fixed step: whole steps, the jump over free ones, solids that a step could miss."""

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
from ..surfaces.surface import Surface
from ..surfaces.time_of_impact import flights, safe
from . import base, contract

# A frame may miss a whole number of steps by this part of a step: decimal times are not binary ones.
_WHOLE = 1e-6
# More steps than this are not counted exactly.
_MOST_STEPS = 2.0**53
Gradient = Annotated[str, choice("composite", "mean-value")]


@dataclass(frozen=True)
class SoftWalls(base.Method):
    """A method of fixed step with springs for walls, and nothing else. See the subclasses."""

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
        """The numbers of this description, of a kind that divides such a factor by the mass."""
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
        # Steps begin and end together for all.
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
    """Raise a `SceneError` if a method of this exponent has no such gradient."""
    if method.gradient == "mean-value" and method.exponent == 1.0:
        raise SceneError(
            'gradient must be "composite" for exponent = 1, got "mean-value": that form is the gradient of Phi at a '
            "point of the step, and for exponent = 1 this gradient jumps at the surface, so no such point need exist"
        )


def moves(scene: Scene) -> Moves | None:
    """`Moves` as kernels take it, where a wall moves."""
    return Moves(0.0) if scene.moves() else None


def laws_at_ends(scene: Scene, apart: str = "fixed steps") -> Laws | None:
    """The laws of walls as kernels take them, where a wall has any besides its motion."""
    laws = scene.compiled(apart=apart).laws
    return laws if laws is not None and (laws.loses or laws.send_off) else None


def check_instants(scene: Scene, dt: float) -> None:
    """Raise a `SceneError` where walls come or go, or openings open or shut, within a step."""
    for time in scene.instants:
        if abs(time / dt - round(time / dt)) > _WHOLE:
            raise SceneError(
                f"walls must come and go, and openings open and shut, at whole steps, got {time:g} s with dt = {dt:g} "
                f"s, which is {time / dt:.6g} steps; give times that are multiples of dt, another dt, or Impact"
            )


def check_turns(method: base.Method, scene: Scene) -> None:
    """Raise a `SceneError` where a wall that turns does not give what its steps are made of."""
    purpose = f"{type(method).__name__} at a wall that turns"
    # Of the walls that steps take: a union of several rooms is one, and a sphere about its own centre does not turn.
    pieces = scene.compiled(apart="fixed steps").pieces
    for i, piece in zip(pieces.owners, pieces.each, strict=True):
        if piece.motion is not None and drive_of(piece, 0.0).turn is not None:
            require([piece], purpose, ("turned_push",), f"surfaces[{i}]")


def check_solids(scene: Scene, particles: Particles, dt: float) -> None:
    """Raise a `SceneError` where the fastest particle can jump over a solid in one step, or a solid over it."""
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
    """Raise a `SceneError` where the fastest particle [m/s] may go farther over a face in a step than walls are."""
    reach = scene.reach_of_steps()
    if reach is not None and fastest * step > reach:
        raise SceneError(
            f"{name} must be so small that no particle flies farther than {reach:.3g} m in a step, a part of the "
            f"shortest period, got {name} = {step:g} s, in which the fastest flies {fastest * step:.3g} m; use {name} "
            f"< {reach / fastest:.2g} s, or Impact"
        )


def longest_step(scene: Scene, dt: float, balls: bool = False) -> float | None:
    """The longest flight of points, or of balls, in a step that jumps over no solid [m]; None without solids."""
    if not any(surface.is_solid() for surface in scene.surfaces):
        return None
    thickness, i = thinnest(scene, dt, balls)
    reach = None if balls else scene.reach_of_steps()
    return min(thickness - _pace(scene.surfaces[i], balls) * dt, math.inf if reach is None else reach)


def way_of_walls(scene: Scene, dt: float) -> float:
    """How far a wall moves by itself in a step, at most, as balls meet it [m]; turns are not counted."""
    return dt * max((_pace(surface, balls=True) for surface in scene.surfaces), default=0.0)


def _half_widths(scene: Scene) -> tuple[float, ...] | None:
    """The half width of the solid of each wall [m], infinite for a cavity; None if no wall has another side."""
    if not any(surface.may_be_passed() for surface in scene.surfaces):
        return None
    return tuple(surface.size() if surface.is_solid() else math.inf for surface in _of_rows(scene))


def _of_rows(scene: Scene) -> list[Surface]:
    """The surface of each row, where each solid is a wall by itself."""
    return [scene.surfaces[i] for i in scene.compiled(apart="fixed steps").numbering.surfaces_of_rows]


def _pace(surface: Surface, balls: bool = False) -> float:
    """A bound of the speed with which a surface moves [m/s].

    Of balls without what turns, which their lists follow, and 0 where impacts move it: their moves count against it.
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
    """A bound of the speed of particles against a surface at the start [m/s]."""
    balls = particles.radius is not None
    if balls and surface.reacts():
        return particles.fastest(speed_at_start(surface.motion))
    return particles.fastest() + _pace(surface, balls)


def thinnest(scene: Scene, dt: float, balls: bool = False) -> tuple[float, int]:
    """The thickness [m] and the number of the solid that is jumped over first."""
    solids = [(i, surface) for i, surface in enumerate(scene.surfaces) if surface.is_solid()]
    i, surface = min(solids, key=lambda one: (2.0 * one[1].size() - _pace(one[1], balls) * dt, one[0]))
    return 2.0 * surface.size(), i


def _described(scene: Scene, i: int) -> str:
    return f"surfaces[{i}] ({type(scene.surfaces[i]).__name__}), {2.0 * scene.surfaces[i].size():.3g} m thick"


def whole_steps(name: str, duration: float, dt: float) -> float:
    """The number of steps of a duration; a `SceneError` that calls it `name` where they are not whole."""
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
    """The time of so many steps in the fewest digits, six or more, that count as these.

    >>> _shortest(27843, 2e-5), _shortest(12345678, 1e-3)
    ('0.55686', '12345.678')
    """
    texts = (f"{steps * dt:.{digits}g}" for digits in range(6, 17))
    return next((text for text in texts if abs(float(text) / dt - steps) <= _WHOLE), repr(steps * dt))


def steps_within(duration: float, dt: float) -> float:
    """The number of equal steps of a duration [s] that are no longer than dt [s], to round-off.

    >>> steps_within(0.3, 0.1), steps_within(0.31, 0.1), steps_within(1e-12, 0.1)
    (3.0, 4.0, 1.0)
    """
    return float(max(1, math.ceil(duration / dt - _WHOLE)))


def whole_time(moment: float, dt: float) -> float:
    """The time of the steps until a moment [s], which they may miss a little: no wall must jump where frames meet."""
    return round(moment / dt) * dt


# --- As kernels know it ----------------------------------------------------------------------------------


class StepEnergy(NamedTuple):
    """The numbers that a lane keeps."""

    twice_energy: float  # per mass, at the start, and with the work of walls since
    over_mass: float  # the method's factor over the mass


class Steps(contract.MethodNumbers):
    """A method of steps, with the fields `dt`, `longest`, `factor` and `moving`: the walls of a step, and its ends."""

    point = 1.0  # the part of a step after which it takes its force
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
        # Of all walls: each part of a step asks for those that it needs.
        return walls

    def at_start(self: Any, walls, remaining):
        return walls.at(remaining * self.dt)

    def over(self: Any, walls, remaining):
        """The walls over that step."""
        return walls.during(remaining * self.dt, (remaining - 1.0) * self.dt)

    def after(self: Any, walls, remaining):
        """The walls at the end of that step."""
        return walls.at((remaining - 1.0) * self.dt)

    def times(self, walls, remaining):
        """The walls at the start of that step, over it and at its end."""
        return self.at_start(walls, remaining), self.over(walls, remaining), self.after(walls, remaining)

    def reach(self: Any, before, gravity, lane):
        """From r0 to the point of the force that it takes, as if there were no wall."""
        return displacement(gravity, lane.v, self.dt)

    def is_too_fast(self: Any, p):
        """Whether a step with free displacement p could jump over a solid. Only its ends are looked at."""
        return False if self.longest is None else square(p) > self.longest * self.longest

    def work_along(self: Any, over, wall, force, ends):
        """The work of a force of this wall in a step with these walls and ends, r0 and r1; 0 where no wall moves."""
        return 0.0 if self.moving is None else dot(force, over.swept(wall, *ends))

    def is_outside(self, walls, wall, r):
        """Whether a point is outside of a wall: the contact of a step that ends there goes on in the next one."""
        return walls.of(wall, False, _is_outside, r)

    def flight(self: Any, walls, gravity, lane, hit=None):
        """Over the steps that surely stay free, to one that touches a wall: HARD where a lane cannot take it alone."""
        dt, left = self.dt, lane.remaining * self.dt
        free = safe.free_time_moving(walls, gravity, lane.r, lane.v, left) if hit is None else hit.time
        # One too many by round-off starts a contact 1e-16 deep: harmless.
        steps = np.floor(free * (1.0 / dt))
        return self.flown(walls, gravity, lane, select(steps < lane.remaining, steps, lane.remaining))

    def flown(self: Any, walls, gravity, lane, steps):
        """The `FlightEnd` after so many free steps."""
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
        # Several walls at once, or nested solves: the careful way.
        alone = (touched.number <= 1.0) & (not isinstance(self.form, MeanValue))
        wall = select(alone, touched.wall, contract.HARD - touched.wall)
        return select(self.is_too_fast(displacement(gravity, lane.v, dt)), contract.HARD, wall)


class SoftNumbers(Steps):
    """A method with soft walls as kernels know it; each method has its own subclass."""

    dt: float
    law: Any
    longest: Any  # step that jumps over no solid, and out of a cell to known walls alone [m]; None without solids
    factor: float  # of 1/mass in what a lane keeps
    form: Any  # of the discrete gradient, or None
    moving: Any  # None, or `Moves` where a wall moves
    half_widths: Any  # of the solid of each wall [m], infinite for a cavity; None if no wall has another side
    size: float  # of the scene [m]
    ends: Any  # None, or the `Laws` of its walls, which act where a contact ends

    def passes(self, walls, lane, wall, r, v):
        """Whether a step that ends so leads a lane through the middle of this wall."""
        if self.half_widths is None:
            return False
        before, over, after = self.times(walls, lane.remaining)
        way = r - lane.r
        if self.moving is not None:
            way = way - over.swept(wall, lane.r, r)
        return medial.passes((before, lane.r), (after, r), wall, way, self.dt * (lane.v - v), self.half_widths)

    def _passes_any(self, walls, lane, r, v):
        """As `passes`, for any of the walls that the step is in contact with."""
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
        """The `Careful` step of a lane. Adds impulses to impulse[wall, i], and works to the rows behind those."""
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
    """A step of a lane, which may be the solution or not, with the impulse and the work of the wall per mass."""

    r: Vec
    v: Vec
    solved: bool
    impulse: float
    new: bool  # whether it starts an impact: it is inside of its wall
    work: float


def contact(lane, wall, taken):
    """The `Contact` of a lane that takes its step, or leaves it to the careful way, or is at the end of its frame."""
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
    """A step against any number of walls, and their work per mass."""

    r: Vec
    v: Vec
    solved: bool
    work: float
