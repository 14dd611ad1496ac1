"""AugmentedLagrangian: the paper's method, with Uzawa's loop in every contact step."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import checks
from ..contact import corner, uzawa
from ..contact import energy as energies
from ..contact import impulse as contact_impulse
from ..contact.discrete_gradient import form_of, reaction_needs
from ..contact.records import Step
from ..contact.reflection import CHORD_NEEDS
from ..contact.regularisation import regularisation
from ..contact.touching import NEEDS as SLIDING_NEEDS
from ..errors import SceneError
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import kept, scratch, select
from ..kernel.vector import norm
from ..particles import Particles
from ..scene import Scene
from ..status import Status
from ..surfaces import contract as surfaces
from ..surfaces import fold as walls
from . import base, contract, fixed_step, steps

RAISE, COUNT, IMPACT = 0, 1, 2
_POLICIES = {"raise": RAISE, "count": COUNT, "impact": IMPACT}
_ACCELERATIONS = {"none": uzawa.PLAIN, "secant": uzawa.SECANT, "reflection": uzawa.REFLECTION}


@dataclass(frozen=True)
class AugmentedLagrangian(base.Method):
    """Rigid walls by the paper's nested loops: the step (7) with multipliers, and Uzawa's update (8) of them.

    (v0 + v1)/2 = (r1 - r0)/h,   m (v1 - v0) = h m G - h D (alpha (Phi0 + Phi1)/2 + lambda),
    lambda <- lambda + alpha (Phi0 + Phi1)/2   until   V = alpha Phi1^2/2 <= tolerance.

    When does the loop converge? Its limit is a step with Phi1 = 0.
        exponent 1, on the surface at t0 (State I): always, linearly, with the composite gradient on every smooth
            surface. At the limit the force is lambda D with D != 0, so a finite multiplier carries the particle.
        exponent 1, inside at t0 (State II): never. D = Phi1/(g1 - g0) dg vanishes with Phi1, so lambda grows without
            end, while the energy misses lambda Phi1. Use adaptive=True, which starts every contact on the surface.
        exponent above 1: not in a useful number of sweeps, as Phi'(0) = 0: lambda grows without end, and V falls only
            as a power of the sweeps. Such walls are for Penalty, as Hertz's law is.
        In an edge sharper than about 0.1 rad the sweeps over its walls are too many: use on_unconverged="impact".
    The converged step is a reflection about D: `Impact(contact_step=dt)` takes it without the loop, at a twentieth of
    the cost and to round-off. This method is for the paper's results, and for studies of multipliers.

    Of bodies the multipliers hold walls and links together, with exponent 1 and adaptive=True: V is the sum of
    alpha g^2/2 of contacts and alpha c^2/2 of links, c = (|y|^2 - l^2)/(2 l). A step shorter than dt, cut at an impact,
    has the penalty alpha (dt/h)^2, since a sweep shrinks errors by alpha h^2/m. The converged one is Impact(dt=...).

    Args:
        dt: step h > 0 [s]. Frames must fall on whole steps, unless adaptive.
        penalty: alpha > 0, the weight of the loop (N/m for a = 1 and a gap in m); larger ones need fewer sweeps.
        exponent: a >= 1 of the regularisation.
        tolerance: V > 0 [J] at which a loop ends; the energy of a contact is then off by about lambda Phi1, with Phi1 =
            sqrt(2 tolerance/alpha).
        max_sweeps: the most sweeps of a loop, 1 or more.
        gradient: "composite", or "mean-value", which is the paper's general form, slow, and needs exponent > 1.
        adaptive: cut each step at the instant of impact (the paper's recommendation); flights are then exact over any
            time, and contact steps are dt long. A step on whose way another wall stands is replaced by the exact
            reflection. Without gravity only.
        acceleration: "none" is the paper's loop; "secant" replaces (8) by a secant; "reflection" starts the secant from
            the multiplier of the converged step. The fixed point is the same; where there is none, so is the loop.
        on_unconverged: what a contact does whose loop ends above the tolerance. "raise" ends the run and names step,
            particle, sweeps and V; "count" accepts the step and counts it in the observable "unconverged"; "impact"
            counts it too, and replaces the contact by the exact one (without gravity only).

    Raises:
        SceneError: an argument is out of its range; a frame time is not a whole number of steps.

    Conserves: m v^2/2 - m G.r up to the tolerance where the loop converges; to round-off that does not grow for a
    tolerance at round-off, such as 1e-28. A gap below the round-off of the coordinates counts as 0. Order: 2 in dt away
    from impacts. Cost: sweeps times a scalar solve; the sweeps are in the observable "sweeps".
    Walls may move without turning in fixed steps, which are those of the frame of each wall; steps that are cut at
    impacts, and exact impacts in their place, know walls at rest only.
    Source: García Orden & Ortega 2007, eqs. (6)-(9), and the composite form of contact/discrete_gradient.py.

    >>> AugmentedLagrangian(dt=0.025, penalty=1e4, exponent=1.0, gradient="mean-value")
    Traceback (most recent call last):
    swarm.errors.SceneError: gradient must be "composite" for exponent = 1, got "mean-value"
    """

    dt: float
    penalty: float
    exponent: float = 1.0
    tolerance: float = 1e-10
    max_sweeps: int = 50
    gradient: str = "composite"
    adaptive: bool = False
    acceleration: str = "none"
    on_unconverged: str = "raise"

    def __post_init__(self) -> None:
        fixed_step.check_arguments(self)
        object.__setattr__(self, "tolerance", checks.positive("tolerance", self.tolerance))
        object.__setattr__(self, "max_sweeps", checks.count("max_sweeps", self.max_sweeps))
        object.__setattr__(self, "adaptive", checks.flag("adaptive", self.adaptive))
        checks.one_of("acceleration", self.acceleration, _ACCELERATIONS)
        checks.one_of("on_unconverged", self.on_unconverged, _POLICIES)

    def check(self, scene: Scene, particles: Particles) -> None:
        base.check_laws("AugmentedLagrangian", scene)
        base.check_motions("AugmentedLagrangian", scene)
        if self.adaptive or self.on_unconverged == "impact":
            self._require_rest(scene)
        if scene.gravity is not None and (self.adaptive or self.on_unconverged == "impact"):
            name, value = ("adaptive", True) if self.adaptive else ("on_unconverged", '"impact"')
            raise SceneError(
                f"{name} = {value} does not know gravity yet, got gravity={tuple(scene.gravity)}; use fixed steps with "
                'on_unconverged="count", Penalty, or gravity=None'
            )
        if self.adaptive:
            base.check_crossing("dt", self.dt, scene, particles)
        else:
            fixed_step.check_solids(scene, particles, self.dt)

    def _require_rest(self, scene: Scene) -> None:
        """Raise a `SceneError` where a wall moves: steps that are cut at impacts, and exact ones, know none."""
        for i, surface in enumerate(scene.surfaces):
            if surface.motion is not None:
                name, value = ("adaptive", True) if self.adaptive else ("on_unconverged", '"impact"')
                raise SceneError(
                    f"surfaces[{i}].motion must be None with {name} = {value}, whose impacts are with walls at rest, "
                    f'got {surface.motion}; use fixed steps with on_unconverged="count", Penalty, or Impact'
                )

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        # The reaction, the chord that starts the loop, and the exact impacts that may replace a contact
        contact = *reaction_needs(self.gradient), "gap_scale", *CHORD_NEEDS, *SLIDING_NEEDS
        return *fixed_step.of_steps(scene), *contact

    def numbers(self, scene: Scene) -> steps.Numbers:
        kind = steps.CutSteps if self.adaptive else steps.FixedSteps
        return kind(
            self.dt,
            self.law(),
            form_of(self.gradient),
            base.SHORTEST * scene.finite_size(),
            self.tolerance,
            self.max_sweeps,
            _ACCELERATIONS[self.acceleration],
            _POLICIES[self.on_unconverged],
            None if self.adaptive else fixed_step.longest_step(scene, self.dt),
            fixed_step.moves(scene),
        )

    def too_fast(self, scene: Scene) -> str:
        return fixed_step.too_fast_failure(scene, self.dt)

    def time_of_impact(self) -> float | None:
        return self.dt if self.adaptive else None

    def span(self, name: str, duration: float) -> float:
        return duration if self.adaptive else fixed_step.whole_steps(name, duration, self.dt)

    def instant(self, moment: float) -> float:
        return moment if self.adaptive else fixed_step.whole_time(moment, self.dt)

    def law(self) -> Any:
        return regularisation(self.penalty, self.exponent)

    def has_multipliers(self) -> bool:
        return True

    def failure(self, moment: float, left: float, sweeps: int, stored: float) -> str:
        now = moment - (left if self.adaptive else left * self.dt)
        hint = "more max_sweeps" if self.adaptive and self.exponent == 1.0 else "exponent = 1 and adaptive=True"
        return (
            f"in the step from {now:.9g} s (step {round(now / self.dt) + 1} of dt): {sweeps} sweeps left V = "
            f"{stored:.3g} J, above tolerance = {self.tolerance:g} J. The loop converges for exponent = 1 from the "
            f'surface: use {hint}, or on_unconverged="count" or "impact"'
        )


# --- One pass --------------------------------------------------------------------------------------------


@contract.most_sweeps.register(steps.Numbers)
def _(method, chain):
    return contact_impulse.NEWTON_STEPS


def _free_step(gravity, lane, h):
    """The step without walls: r0, p and c = h^2/(2m)."""
    return Step(lane.r, displacement(gravity, lane.v, h), lane.own.over_mass * h * h)


@contract.guess.register(steps.Numbers)
def _(method, chain, gravity, lane, wall):
    cut, over = method.cut(lane.left), method.over(chain, lane.left)
    kappa = contact_impulse.guess(over, wall, cut.law, _free_step(gravity, lane, cut.h))
    touching = wall >= 0.0
    return select(touching, kappa, 0.0), touching


@contract.improve.register(steps.Numbers)
def _(method, chain, gravity, lane, wall, solution, multiplier):
    cut, over, kappa = method.cut(lane.left), method.over(chain, lane.left), solution.kappa
    newton = contact_impulse.improve(over, wall, cut.law, multiplier, _free_step(gravity, lane, cut.h), kappa)
    return select(solution.unsolved, kappa - newton.step, kappa), solution.unsolved & newton.more, newton.record


@contract.multiplier_sweeps.register(steps.Numbers)
def _(method):
    return method.max_sweeps


@contract.first_multiplier.register(steps.Numbers)
def _(method, chain, gravity, lane, wall, kappa):
    cut, over = method.cut(lane.left), method.over(chain, lane.left)
    better, multiplier = uzawa.reflection(over, wall, cut.law, _free_step(gravity, lane, cut.h))
    use = (method.acceleration == uzawa.REFLECTION) & (multiplier > 0.0)
    limited = uzawa.has_limit(over, wall, cut.law, lane.r)
    return select(use, multiplier, 0.0), select(use, better, kappa), select(limited, method.acceleration, uzawa.PLAIN)


@contract.next_multiplier.register(steps.Numbers)
def _(method, left, acceleration, multiplier, record, before):
    miss = method.cut(left).law.alpha * record.mean
    following = uzawa.next_multiplier(acceleration, multiplier, miss, before.multiplier, before.miss)
    return following, miss, not (record.stored <= method.tolerance)


@contract.contact.register(steps.Numbers)
def _(method, chain, gravity, lane, wall, solution):
    # One step, free or in contact with one wall: r1 = r0 + p - kappa D(r0, r1), v1 = v0 + h G - (2 kappa/h) D
    cut, kappa = method.cut(lane.left), solution.kappa
    over, after = method.over(chain, lane.left), method.after(chain, lane.left)
    h, p = cut.h, displacement(gravity, lane.v, cut.h)
    r1 = walls.push(over, wall, lane.r, p, kappa)
    g = walls.inner_gradient(over, wall, lane.r, r1)
    f = 2.0 / h * kappa
    work = contract.work_along(method.moving, over, wall, -f / h * g)
    v1 = accelerated(gravity, lane.v, h) - f * g
    given = abs(f) * norm(g)

    alone = method.is_alone(after, wall, lane.r, r1, kappa)
    solved = alone & (not solution.unsolved) & walls.pushes(over, wall, kappa)
    touching = wall >= 0.0
    step = (lane.left > 0.0) & touching & solved
    budget = energies.Budget(2.0 * lane.own.over_mass, 0.5 * lane.own.twice_energy + work, 1.0 / h * given)
    factor, _balanced = energies.restored(method.law, over, after, gravity, budget, energies.Ends(lane.r, r1, v1, h))
    new = step & method.is_new(over, lane.r)
    work = select(step, work, 0.0)
    # A step without contact: only fixed steps end here that way, just before one.
    loose = (lane.left > 0.0) & (wall > contract.HARD) & (not touching)
    return contract.Contact(
        select(step, r1, select(loose, lane.r + p, kept(lane.r))),
        select(step, v1 * factor, select(loose, accelerated(gravity, lane.v, h), kept(lane.v))),
        lane.left - select(step | loose, cut.used, 0.0),
        select(touching & (not solved), contract.HARD - wall, wall),
        select(step, given, 0.0),
        select(new, 1.0, 0.0),
        lane.own.twice_energy + 2.0 * work,
        False,
        work,
    )


# --- Several walls, nested solves, and loops that do not converge ----------------------------------------


@contract.hard_pass.register(steps.Numbers)
def _(method, chain, gravity, lane, wall, lanes, i):
    cut, record = method.cut(lane.left), lanes.record
    h, over, after = cut.h, method.over(chain, lane.left), method.after(chain, lane.left)
    if method.is_blocked(chain, wall, lane.r, h * lane.v):
        record[uzawa.SWEEPS, i] = 0.0
        return method.as_impacts(chain, lane, cut, wall, lanes, i)
    free = _free_step(gravity, lane, h)
    if method.is_too_fast(free.p):
        return fixed_step.refused(lane, Status.TOO_FAST.value)
    reactions = scratch((walls.length(chain), 4), np.float64)
    end = uzawa.loop(method, cut.law, over, free, reactions)
    record[uzawa.SWEEPS, i], record[uzawa.STORED, i] = end.sweeps, end.stored
    record[uzawa.UNCONVERGED, i] = 0.0 if end.converged else 1.0
    if not end.converged and method.policy == IMPACT:
        return method.as_impacts(chain, lane, cut, wall, lanes, i)
    if not end.converged and (method.policy == RAISE or not end.solved):
        return fixed_step.refused(lane, Status.UNCONVERGED.value if end.solved else Status.UNSOLVED.value)
    new = 1.0 if method.is_new(over, lane.r) else 0.0
    reaction = corner.total(reactions)
    v1 = accelerated(gravity, lane.v, h) - 2.0 / h * reaction
    corner.add_impulses(reactions, h, lanes.impulse, i)
    work = corner.add_works(method.moving, over, -2.0 / (h * h), reactions, lanes.impulse, i)
    force = 1.0 / h * (2.0 / h * norm(reaction))
    budget = energies.Budget(2.0 * lane.own.over_mass, 0.5 * lane.own.twice_energy + work, force)
    factor, _balanced = energies.restored(method.law, over, after, gravity, budget, energies.Ends(lane.r, end.r, v1, h))
    left, twice_energy = lane.left - cut.used, lane.own.twice_energy + 2.0 * work
    return contract.Contact(end.r, v1 * factor, left, wall, 0.0, new, twice_energy, False), Status.DONE.value
