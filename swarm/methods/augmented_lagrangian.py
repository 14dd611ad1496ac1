"""AugmentedLagrangian: the paper's method, with Uzawa's loop in every contact step."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .. import checks
from ..contact import corner, uzawa
from ..contact import energy as energies
from ..contact import impulse as contact_impulse
from ..contact import regularisation as law_of
from ..contact.discrete_gradient import form_of, reaction_needs
from ..contact.reflection import CHORD_NEEDS
from ..contact.sliding import NEEDS as SLIDING_NEEDS
from ..errors import SceneError
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import kept, scratch, select
from ..particles import Particles
from ..scene import Scene
from ..status import Status
from ..surfaces import base as surfaces
from ..surfaces import chain as walls
from . import adaptive_step, base, fixed_step

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

    Args:
        dt: step h > 0 [s]. Frames must fall on whole steps, unless adaptive.
        penalty: alpha > 0, the weight of the loop (N/m for a = 1 and a gap in m); larger ones need fewer sweeps.
        exponent: a >= 1 of the regularisation.
        tolerance: V > 0 [J] at which a loop ends; the energy of a contact is then off by about lambda Phi1, with Phi1 =
            sqrt(2 tolerance/alpha).
        max_sweeps: the most sweeps of a loop, 1 or more.
        gradient: "composite", or "mean-value", which is the paper's general form, slow, and needs exponent > 1.
        adaptive: cut each step at the instant of impact (the paper's recommendation); flights are then exact over any
            time, and contact steps are dt long. A step on whose way another wall stands gives way to the exact
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
        base.check_elastic("AugmentedLagrangian", scene)
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

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        # The reaction, the chord that starts the loop, and the exact impacts that may replace a contact
        contact = *reaction_needs(self.gradient), surfaces.gap_scale, *CHORD_NEEDS, *SLIDING_NEEDS
        return *fixed_step.of_steps(scene), *contact

    def numbers(self, scene: Scene) -> "AugmentedLagrangianNumbers":
        return AugmentedLagrangianNumbers(
            self.dt,
            self.law(),
            form_of(self.gradient),
            adaptive_step.Adaptive(base.SHORTEST * scene.finite_size()) if self.adaptive else None,
            self.tolerance,
            self.max_sweeps,
            _ACCELERATIONS[self.acceleration],
            _POLICIES[self.on_unconverged],
            None if self.adaptive else fixed_step.longest_step(scene),
        )

    def too_fast(self, scene: Scene) -> str:
        return fixed_step.too_fast_failure(scene, self.dt)

    def time_of_impact(self) -> float | None:
        return self.dt if self.adaptive else None

    def span(self, name: str, duration: float) -> float:
        return duration if self.adaptive else fixed_step.whole_steps(name, duration, self.dt)

    def law(self) -> Any:
        return law_of.regularisation(self.penalty, self.exponent)

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


class AugmentedLagrangianNumbers(NamedTuple):
    """What kernels know of the method."""

    dt: float
    law: Any
    form: Any  # of the discrete gradient
    adaptive: Any  # Adaptive or None
    tolerance: float
    max_sweeps: int
    acceleration: float
    policy: int
    longest: Any  # step that jumps over no solid [m], None where there is none


# --- One pass --------------------------------------------------------------------------------------------


@base.lane_constants.register(AugmentedLagrangianNumbers)
def _(method, mass, energy, vx, vy, vz):
    # 1/(2m), the energy per mass at the start, and nothing
    return 0.5 / mass, energy, 0.0


@base.flight.register(AugmentedLagrangianNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, time, surface, hits):
    return adaptive_step.flight(method.adaptive, method, chain, gravity, x, y, z, vx, vy, vz, left)


@base.most_sweeps.register(AugmentedLagrangianNumbers)
def _(method, chain):
    return contact_impulse.NEWTON_STEPS


@base.guess.register(AugmentedLagrangianNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, surface):
    h, _used, law = adaptive_step.step_of(method.adaptive, method, left)
    px, py, pz = displacement(gravity, vx, vy, vz, h)
    kappa = contact_impulse.guess(chain, surface, law, x, y, z, px, py, pz, k0 * h * h)
    touching = surface >= 0.0
    return select(touching, kappa, 0.0), touching


@base.improve.register(AugmentedLagrangianNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, surface, kappa, unsolved, multiplier):
    h, _used, law = adaptive_step.step_of(method.adaptive, method, left)
    px, py, pz = displacement(gravity, vx, vy, vz, h)
    step, more, mean, stored, gain = contact_impulse.improve(
        chain, surface, law, multiplier, x, y, z, px, py, pz, k0 * h * h, kappa
    )
    return select(unsolved, kappa - step, kappa), unsolved & more, mean, stored, gain


@base.multiplier_sweeps.register(AugmentedLagrangianNumbers)
def _(method):
    return method.max_sweeps


@base.first_multiplier.register(AugmentedLagrangianNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, surface, kappa):
    h, _used, law = adaptive_step.step_of(method.adaptive, method, left)
    px, py, pz = displacement(gravity, vx, vy, vz, h)
    better, multiplier = uzawa.reflection(chain, surface, law, x, y, z, px, py, pz, k0 * h * h)
    use = (method.acceleration == uzawa.REFLECTION) & (multiplier > 0.0)
    limited = uzawa.has_limit(chain, surface, law, x, y, z)
    return select(use, multiplier, 0.0), select(use, better, kappa), select(limited, method.acceleration, uzawa.PLAIN)


@base.next_multiplier.register(AugmentedLagrangianNumbers)
def _(method, left, acceleration, multiplier, mean, stored, multiplier_before, miss_before):
    _h, _used, law = adaptive_step.step_of(method.adaptive, method, left)
    miss = law.alpha * mean
    following = uzawa.next_multiplier(acceleration, multiplier, miss, multiplier_before, miss_before)
    return following, miss, not (stored <= method.tolerance)


@base.contact.register(AugmentedLagrangianNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, kappa, unsolved, tx, ty, tz, turned):
    # One step, free or in contact with one wall: r1 = r0 + p - kappa D(r0, r1), v1 = v0 + h G - (2 kappa/h) D
    h, used, _law = adaptive_step.step_of(method.adaptive, method, left)
    px, py, pz = displacement(gravity, vx, vy, vz, h)
    x1, y1, z1 = walls.push(chain, surface, x, y, z, px, py, pz, kappa)
    gx, gy, gz = walls.inner_gradient(chain, surface, x, y, z, x1, y1, z1)
    f = 2.0 / h * kappa
    wx, wy, wz = accelerated(gravity, vx, vy, vz, h)
    wx, wy, wz = wx - f * gx, wy - f * gy, wz - f * gz
    given = abs(f) * math.sqrt(gx * gx + gy * gy + gz * gz)

    free = adaptive_step.is_alone(method.adaptive, chain, gravity, surface, x, y, z, x1, y1, z1, h, kappa)
    solved = free & (not unsolved) & walls.pushes(chain, surface, kappa)
    touching = surface >= 0.0
    step = (left > 0.0) & touching & solved
    factor, _balanced = energies.restored(
        method.law, chain, gravity, 2.0 * k0, k1, h, x, y, z, x1, y1, z1, wx, wy, wz, 1.0 / h * given
    )
    new = step & adaptive_step.is_new(method.adaptive, chain, x, y, z)
    # A step without contact: only fixed steps end here that way, just before one.
    loose = (left > 0.0) & (surface > base.HARD) & (not touching)
    ex, ey, ez = accelerated(gravity, vx, vy, vz, h)
    return (
        select(step, x1, select(loose, x + px, kept(x))),
        select(step, y1, select(loose, y + py, kept(y))),
        select(step, z1, select(loose, z + pz, kept(z))),
        select(step, wx * factor, select(loose, ex, kept(vx))),
        select(step, wy * factor, select(loose, ey, kept(vy))),
        select(step, wz * factor, select(loose, ez, kept(vz))),
        left - select(step | loose, used, 0.0),
        select(touching & (not solved), base.HARD - surface, surface),
        select(step, given, 0.0),
        select(new, 1.0, 0.0),
        k0,
    )


# --- Several walls, nested solves, and loops that do not converge ----------------------------------------


@base.hard_pass.register(AugmentedLagrangianNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, impulse, record, lane):
    h, used, law = adaptive_step.step_of(method.adaptive, method, left)
    if adaptive_step.is_blocked(method.adaptive, method.law, chain, surface, x, y, z, h * vx, h * vy, h * vz):
        record[uzawa.SWEEPS, lane] = 0.0
        return adaptive_step.as_impacts(
            method.adaptive, chain, x, y, z, vx, vy, vz, left, h, used, k0, k1, surface, impulse, lane
        )
    px, py, pz = displacement(gravity, vx, vy, vz, h)
    if fixed_step.too_fast(method.longest, px, py, pz):
        return x, y, z, vx, vy, vz, left, 0.0, k0, Status.TOO_FAST.value
    reactions = scratch((walls.length(chain), 4), np.float64)
    x1, y1, z1, sweeps, stored, solved, converged = uzawa.loop(
        method, law, chain, x, y, z, px, py, pz, k0 * h * h, reactions
    )
    record[uzawa.SWEEPS, lane], record[uzawa.STORED, lane] = sweeps, stored
    record[uzawa.UNCONVERGED, lane] = 0.0 if converged else 1.0
    if not converged and method.policy == IMPACT:
        return adaptive_step.as_impacts(
            method.adaptive, chain, x, y, z, vx, vy, vz, left, h, used, k0, k1, surface, impulse, lane
        )
    if not converged and (method.policy == RAISE or not solved):
        status = Status.UNCONVERGED.value if solved else Status.UNSOLVED.value
        return x, y, z, vx, vy, vz, left, 0.0, k0, status
    new = 1.0 if adaptive_step.is_new(method.adaptive, chain, x, y, z) else 0.0
    rx, ry, rz = corner.total(reactions)
    f = 2.0 / h
    wx, wy, wz = accelerated(gravity, vx, vy, vz, h)
    wx, wy, wz = wx - f * rx, wy - f * ry, wz - f * rz
    corner.add_impulses(reactions, h, impulse, lane)
    given = f * math.sqrt(rx * rx + ry * ry + rz * rz)
    e, _balanced = energies.restored(
        method.law, chain, gravity, 2.0 * k0, k1, h, x, y, z, x1, y1, z1, wx, wy, wz, 1.0 / h * given
    )
    return x1, y1, z1, wx * e, wy * e, wz * e, left - used, new, k0, Status.DONE.value
