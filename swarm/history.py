"""The iteration of a single contact step of one particle, sweep by sweep, to study a method."""

import math
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .common import checks
from .common.status import Status
from .compiled_scene import CompiledScene
from .contact import corner, reflection, uzawa
from .contact.impulse import Step
from .contact.regularisation import regularisation
from .errors import RunError, SceneError
from .kernel.gravity import accelerated, displacement
from .kernel.vector import Vec, vec
from .methods import AugmentedLagrangian, Impact, Method, Penalty
from .methods.base import check_surfaces
from .particles import Particles
from .run.options import RunOptions
from .run.preflight.knows import Asked, require_supported
from .scene import Scene
from .state import Floats
from .surfaces.lowered import lowered
from .surfaces.time_of_impact import flights


@dataclass(frozen=True)
class ContactHistory:
    """Arrays with one entry for each sweep; with several surfaces the first four have the shape (sweeps, surfaces).

    Attributes, which are keys too (`history["multiplier"]`):
        multiplier: lambda during the sweep (sweeps,) [N for a = 1].
        force_multiplier: lambda |D|, the part of the contact force that the multiplier carries [N].
        force_penalty: alpha |D| (Phi0 + Phi1)/2, the part of the spring [N].
        constraint: Phi1 at the end of the step.
        kinetic_energy: m v1^2/2 (sweeps,) [J].
        position: r1 (sweeps, 3) [m].
        velocity: v1 (sweeps, 3) [m/s].
        stored_energy: V = sum of alpha Phi1^2/2 (sweeps,) [J].
        converged: whether the last sweep reached the tolerance.
    """

    multiplier: Floats
    force_multiplier: Floats
    force_penalty: Floats
    constraint: Floats
    kinetic_energy: Floats
    position: Floats
    velocity: Floats
    stored_energy: Floats
    converged: bool

    def __getitem__(self, name: str) -> Any:
        if name not in {field.name for field in fields(self)}:
            raise KeyError(name)
        return getattr(self, name)

    def __len__(self) -> int:
        return len(self.kinetic_energy)


def contact_history(
    scene: Scene, position: ArrayLike, velocity: ArrayLike, mass: float, method: Method
) -> ContactHistory:
    """Return Uzawa's iteration of a single step of one particle.

    Args:
        scene: the walls and gravity.
        position: r0, three numbers [m].
        velocity: v0, three numbers [m/s].
        mass: m > 0 [kg].
        method: AugmentedLagrangian; or Penalty, or Impact with a contact_step, where one solve is the only sweep. With
            adaptive=True, and for Impact, the particle first flies to its next impact. With contact_start = "centred"
                it flies to half a step before the impact, and Phi is that of the gap minus the gap at the impact.

    Returns:
        A `ContactHistory` with from 1 to max_sweeps sweeps.

    Raises:
        SceneError: a bad argument; Impact with contact_step = 0, which has no step; no impact ahead.
        RunError: the equation of a sweep was not solved.

    >>> import swarm
    >>> method = swarm.AugmentedLagrangian(dt=0.025, penalty=1e4)
    >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    >>> history = swarm.contact_history(cavity, (0.4, 0.3, 0.0), (0.3, 0.4, 0.0), 1.0, method)
    >>> len(history), history.converged
    (13, True)
    """
    for name, value, kind in (("scene", scene, Scene), ("method", method, Method)):
        checks.of_class(name, value, kind)
    for i, surface in scene.pieces.owned():
        if surface.motion is not None or surface.reacts():
            raise SceneError(
                f"surfaces[{i}] must be at rest, without motion, mass and inertia, for a single contact step, got "
                f"{surface}; use simulate"
            )
    particle = Particles(position, velocity, mass)
    if len(particle) != 1:
        raise SceneError(f"position must be three numbers, got shape {particle.position.shape}")
    require_supported(Asked(scene, particle, method, RunOptions(until=1.0)))
    mass = float(particle.mass[0])
    check_surfaces(method, scene)
    method.check(scene, particle)
    compiled = scene.compiled(apart="contact_history")
    _require_one_wall(compiled, method)
    # The functions of kernels run in plain Python; with numbers of NumPy, 1/0 is infinite as in compiled kernels.
    start = CutStep(vec(particle.position[:, 0]), vec(particle.velocity[:, 0]))
    with np.errstate(all="ignore"):
        if isinstance(method, AugmentedLagrangian):
            if method.adaptive:
                start = _at_the_wall(compiled, start, method.dt, method.contact_start)
            return _uzawa(compiled, start, mass, method)
        if isinstance(method, Penalty):
            return _penalty(compiled, start, mass, method)
        if isinstance(method, Impact):
            start = _at_the_wall(compiled, start, method.contact_step, method.contact_start)
            return _impact(compiled, start, mass, method)
    raise SceneError(f"method must be AugmentedLagrangian, Penalty or Impact, got {type(method).__name__}")


def _require_one_wall(compiled: CompiledScene, method: Method) -> None:
    """Raise a `SceneError` where a method would not take a surface as one wall."""
    for i, piece in compiled.pieces.owned():
        if piece.is_one_wall and not isinstance(method, Penalty):
            raise SceneError(
                f"surfaces[{i}] must be one wall for a single contact step with {type(method).__name__}, got "
                f"{compiled.scene.surfaces[i]!r:.200}; use simulate"
            )


class CutStep(NamedTuple):
    """Position and velocity before the step; if it is cut at an impact, also its length [s] and the wall."""

    r: Vec
    v: Vec
    h: float = math.nan
    wall: float = -1.0


class _HistoryRows:
    """The entries of a history, collected sweep by sweep."""

    def __init__(self, compiled: CompiledScene, start: CutStep, mass: float, h: float) -> None:
        self._compiled, self._start, self._mass, self._h = compiled, start, mass, h
        self.step = Step(start.r, displacement(compiled.scene.pull(), start.v, h), np.float64(h * h / (2.0 * mass)))
        self._rows: list[tuple[Any, ...]] = []

    def add(self, multiplier: Floats, mean: Floats, reactions: Floats, stored: float) -> None:
        """Add a sweep: lambda, alpha Phi_mean, and c D (alpha Phi_mean + lambda) and Phi1 of each wall."""
        reactions, constraint = reactions[:, :3], reactions[:, 3].copy()
        total = reactions.sum(axis=0)
        r1 = np.array(self.step.r) + (np.array(self.step.p) - total)
        v1 = np.array(accelerated(self._compiled.scene.pull(), self._start.v, self._h)) - 2.0 / self._h * total
        force, strength = np.sqrt((reactions**2).sum(axis=1)) / self.step.c, multiplier + mean
        slope = np.divide(force, strength, out=np.zeros_like(force), where=strength != 0.0)
        kinetic = 0.5 * self._mass * float(v1 @ v1)
        self._rows.append((multiplier, multiplier * slope, mean * slope, constraint, kinetic, r1, v1, stored))

    def history(self, converged: bool) -> ContactHistory:
        columns: list[Any] = [np.array(column) for column in zip(*self._rows, strict=True)]
        listed = np.argsort(self._compiled.numbering.surfaces_of_rows, kind="stable")
        columns[:4] = [column[:, listed] for column in columns[:4]]
        if len(self._compiled.scene.surfaces) == 1:
            columns[:4] = [column[:, 0] for column in columns[:4]]
        return ContactHistory(*columns, *[converged])


def _at_the_wall(compiled: CompiledScene, start: CutStep, h: float, begins: str) -> CutStep:
    """Return the start of the contact step at the next impact, of length h if the flight to it is long enough."""
    walls = compiled.walls()
    hit = flights.first_hit(walls, None, start.r, start.v)
    if not np.isfinite(hit.time):
        raise SceneError(f"velocity must lead to a surface, got {tuple(start.v)}, which never does")
    r = walls.project(hit.wall, start.r + hit.time * start.v)
    if begins == "impact":
        return CutStep(r, start.v, h, hit.wall)
    half = min(0.5 * h, hit.time)
    if not half > 0.0:
        raise SceneError(
            f"position must be off the wall that is met, for a step that begins before the impact, got {tuple(start.r)}"
        )
    return CutStep(r - half * start.v, start.v, 2.0 * half, hit.wall)


def _uzawa(compiled: CompiledScene, start: CutStep, mass: float, method: AugmentedLagrangian) -> ContactHistory:
    numbers, walls, count = method.numbers(compiled.scene), compiled.walls(), len(compiled.numbering.pieces_of_rows)
    law = numbers.law
    rows = _HistoryRows(compiled, start, mass, start.h if method.adaptive else method.dt)
    if method.contact_start == "centred":
        walls, law = lowered(walls, start.wall, start.r), law.stiffened((method.dt / start.h) ** 2)
    multipliers, reactions = np.zeros(count), np.zeros((count, 4))
    before = uzawa.LastSweep(np.zeros(count), np.zeros(count))
    uzawa.start(numbers, law, walls, rows.step, multipliers)
    for sweep in range(method.max_sweeps):
        end = uzawa.sweep_all(numbers, law, walls, rows.step, multipliers, before, sweep, reactions)
        _require(end.solved, sweep)
        rows.add(before.multipliers.copy(), before.misses.copy(), reactions, float(end.stored))
        if end.stored <= method.tolerance:
            return rows.history(True)
    return rows.history(False)


def _penalty(compiled: CompiledScene, start: CutStep, mass: float, method: Penalty) -> ContactHistory:
    numbers, walls, count = method.numbers(compiled.scene), compiled.walls(), len(compiled.numbering.pieces_of_rows)
    rows, reactions = _HistoryRows(compiled, start, mass, method.dt), np.zeros((count, 4))
    _require(corner.hold(numbers.form, numbers.law, None, walls, rows.step, reactions).solved, 0)
    first, last = np.zeros(count), reactions[:, 3]
    corner.constraints(walls, numbers.law, start.r, first)
    stored = 0.5 * method.penalty * float(last @ last)
    rows.add(np.zeros(count), 0.5 * method.penalty * (first + last), reactions, stored)
    return rows.history(True)


def _impact(compiled: CompiledScene, start: CutStep, mass: float, method: Impact) -> ContactHistory:
    if method.contact_step == 0.0:
        raise SceneError("contact_step must be above 0 for a history, got 0: an exact reflection takes no step")
    walls, count = compiled.walls(), len(compiled.numbering.pieces_of_rows)
    rows, r0, wall = _HistoryRows(compiled, start, mass, start.h), start.r, start.wall
    if method.contact_start == "centred":
        walls = lowered(walls, wall, r0)
    kappa = reflection.chord(walls, wall, r0, rows.step.p)
    r1 = walls.push(wall, r0, rows.step.p, kappa)
    reactions, multiplier = np.zeros((count, 4)), np.zeros(count)
    reactions[int(wall), :3] = kappa * np.array(walls.discrete_gradient(wall, r0, r1))
    # The limit of Uzawa's loop with exponent 1.
    multiplier[int(wall)] = walls.of(wall, 0.0, uzawa.multiplier_of, regularisation(1.0, 1.0), r0, rows.step.c, kappa)
    rows.add(multiplier, np.zeros(count), reactions, 0.0)
    return rows.history(True)


def _require(solved: bool, sweep: int) -> None:
    if not solved:
        raise RunError(f"sweep {sweep + 1} failed: {Status.UNSOLVED.sentence}")
