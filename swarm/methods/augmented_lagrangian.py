"""AugmentedLagrangian: the paper's method, with Uzawa's loop in every contact step."""

from dataclasses import dataclass
from typing import Any

from .. import checks
from ..contact import uzawa
from ..contact.discrete_gradient import form_of, reaction_needs
from ..contact.reflection import CHORD_NEEDS
from ..contact.touching import NEEDS as SLIDING_NEEDS
from ..errors import SceneError
from ..particles import Particles
from ..scene import Scene
from . import base, fixed_step, steps

_POLICIES = {"raise": steps.RAISE, "count": steps.COUNT, "impact": steps.IMPACT}
_ACCELERATIONS = {"none": uzawa.PLAIN, "secant": uzawa.SECANT, "reflection": uzawa.REFLECTION}


@dataclass(frozen=True)
class AugmentedLagrangian(fixed_step.SoftWalls):
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

    tolerance: float = 1e-10
    max_sweeps: int = 50
    gradient: str = "composite"
    adaptive: bool = False
    acceleration: str = "none"
    on_unconverged: str = "raise"

    def __post_init__(self) -> None:
        super().__post_init__()
        fixed_step.check_gradient(self)
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
        for i, surface in zip(scene.owners_of_pieces, scene.pieces, strict=True):
            if surface.motion is not None:
                name, value = ("adaptive", True) if self.adaptive else ("on_unconverged", '"impact"')
                raise SceneError(
                    f"surfaces[{i}].motion must be None with {name} = {value}, whose impacts are with walls at rest, "
                    f'got {surface.motion}; use fixed steps with on_unconverged="count", Penalty, or Impact'
                )

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        # The reaction, the chord that starts the loop, and the exact impacts that may replace a contact
        contact = *reaction_needs(self.gradient), "gap_scale", *CHORD_NEEDS, *SLIDING_NEEDS
        return *super().needs(scene), *contact

    def numbers(self, scene: Scene) -> steps.StepNumbers:
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

    def time_of_impact(self) -> float | None:
        return self.dt if self.adaptive else None

    def span(self, name: str, duration: float) -> float:
        return duration if self.adaptive else super().span(name, duration)

    def instant(self, moment: float) -> float:
        return moment if self.adaptive else super().instant(moment)

    def seldom_hard(self, scene: Scene) -> bool:
        return False

    def has_multipliers(self) -> bool:
        return True

    def failure(self, moment: float, remaining: float, sweeps: int, stored: float) -> str:
        now = moment - (remaining if self.adaptive else remaining * self.dt)
        hint = "more max_sweeps" if self.adaptive and self.exponent == 1.0 else "exponent = 1 and adaptive=True"
        return (
            f"in the step from {now:.9g} s (step {round(now / self.dt) + 1} of dt): {sweeps} sweeps left V = "
            f"{stored:.3g} J, above tolerance = {self.tolerance:g} J. The loop converges for exponent = 1 from the "
            f'surface: use {hint}, or on_unconverged="count" or "impact"'
        )
