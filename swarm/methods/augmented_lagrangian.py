"""AugmentedLagrangian: the paper's method, with Uzawa's loop in every contact step."""

from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from ..common.validated import Count, Flag, Positive, choice
from ..compiled_scene import CUT
from ..contact import uzawa
from ..contact.discrete_gradient import form_of, reaction_needs
from ..contact.reflection import CHORD_NEEDS
from ..contact.touching import NEEDS as SLIDING_NEEDS
from ..errors import SceneError
from ..particles import Particles
from ..scene import Scene
from . import base, fixed_step, steps

# alpha h^2/m at which a sweep halves the gap: V falls by 1e-10 in 17 sweeps.
_GOOD = 4.0
_POLICIES = {"raise": steps.RAISE, "count": steps.COUNT, "impact": steps.IMPACT}
_ACCELERATIONS = {"none": uzawa.PLAIN, "secant": uzawa.SECANT, "reflection": uzawa.REFLECTION}


@dataclass(frozen=True)
class AugmentedLagrangian(fixed_step.SoftWalls):
    """Rigid walls by the paper's nested loops: the step (7) with multipliers, and Uzawa's update (8) of them.

        (v0 + v1)/2 = (r1 - r0)/h
        m (v1 - v0) = h m G - h D (alpha (Phi0 + Phi1)/2 + lambda)
        lambda <- lambda + alpha (Phi0 + Phi1)/2   until   V = alpha Phi1^2/2 <= tolerance

    When does the loop converge? Its limit is a step with Phi1 = 0. There are three cases.

    With exponent 1, on the surface at t0 (State I), it always converges, linearly, with the composite gradient on every
    smooth surface. At the limit the force is lambda D with D != 0, so a finite multiplier carries the particle.

    With exponent 1, inside at t0 (State II), it never converges. D = Phi1/(g1 - g0) dg vanishes with Phi1, so lambda
    grows without end, while the energy misses lambda Phi1. Use adaptive=True, which starts every contact on the
    surface.

    With an exponent above 1 it does not converge in a useful number of sweeps, as Phi'(0) = 0: lambda grows without
    end, and V falls only as a power of the number of sweeps. Use `Penalty` for such walls, for example Hertz's law.

    In an edge sharper than about 0.1 rad the sweeps over its walls are too many: use on_unconverged="impact". The
    converged step is a reflection about D: `Impact(contact_step=dt)` computes it without the loop at a twentieth of the
    cost and to round-off. This method is for the paper's results, and for studies of multipliers.

    What does it converge to? With dt -> 0 to the rigid wall, `Impact()`, with first order in dt, on every surface: the
    step begins at the impact, and its end is (dt/2)(v0 - v1) from the exact place. A sweep divides
    the gap by about 1 + alpha dt^2/(4 m), so the penalty, or the number of sweeps, must grow as 1/dt^2.

    With contact_start="centred" the step begins dt/2 before the impact, inside, where the loop of the paper has no
    limit. Phi and V take the gap from the level of its start, g - g0: the step is in State I of the surface
    phi = phi(r0), as it would be in a cavity smaller by this gap, and D is the discrete gradient of the gap. The limit
    is the reflection about D(r0, r1) with g1 = g0, so energy is conserved as from the wall. It is the step of
    `Impact(contact_step=dt, contact_start="centred")`; its docstring says where it is exact. Its order is also one in
    general, with an error several times smaller. A step of zero length is the exact reflection.

    For bodies the multipliers hold walls and links together, with exponent 1 and adaptive=True: V is the sum of
    alpha g^2/2 of contacts and alpha c^2/2 of links, c = (|y|^2 - l^2)/(2 l). A step shorter than dt, cut at an impact,
    has the penalty alpha (dt/h)^2, since a sweep shrinks errors by alpha h^2/m. The converged step is Impact(dt=...).

    Args:
        dt: step h > 0 [s]. Frames must fall on whole steps, unless adaptive.
        penalty: alpha > 0, the weight of the loop (N/m for a = 1 and a gap in m); larger ones need fewer sweeps.
        exponent: a >= 1 of the regularisation.
        tolerance: V > 0 [J] at which a loop ends; the energy of a contact is then off by about lambda Phi1, with Phi1 =
            sqrt(2 tolerance/alpha).
        max_sweeps: the most sweeps of a loop, 1 or more.
        gradient: "composite", or "mean-value", which is the paper's general form, slow, and needs exponent > 1.
        adaptive: cut each step at the instant of impact (the paper's recommendation); flights are then exact over any
            time, and contact steps are dt long. A step with another wall in its way is replaced by the exact
            reflection. So is one that ends beyond its body of a field, its face of a mesh, or its side of an outline:
            these surfaces need adaptive=True. Without gravity only.
        acceleration: "none" is the paper's loop; "secant" replaces (8) by a secant; "reflection" starts the secant from
            the multiplier of the converged step. All have the same fixed point; where it does not exist, all use (8).
        on_unconverged: what happens if a loop ends above the tolerance. "raise" ends the run and names step,
            particle, sweeps and V; "count" accepts the step and counts it in the observable "unconverged"; "impact"
            counts it too, and replaces the contact by the exact one (without gravity only).
        contact_start: where contact steps begin: "impact", at the impact, as the paper recommends, or "centred", dt/2
            before it, with adaptive=True and exponent 1.

    Raises:
        SceneError: an argument is out of its range; a frame time is not a whole number of steps.

    Conserves: m v^2/2 - m G.r up to the tolerance where the loop converges; to round-off that does not grow for a
    tolerance at round-off, such as 1e-28. A gap below the round-off of the coordinates counts as 0. Order: 1 in dt, at
    impacts; flights are exact (`python -m bench order`). Cost: sweeps times a scalar solve; the sweeps are in the
    observable "sweeps".
    Laws of walls, openings and doors are those of `Penalty`: laws act where a contact ends.
    In unions of several rooms, and in foams, a step that is cut at an impact meets the walls of its own room.
    Walls may move in fixed steps, which are taken in the frame of each wall; steps that are cut at
    impacts, and exact impacts in their place, need walls at rest.
    Source: García Orden & Ortega 2007, eqs. (6)-(9), and the composite form of contact/discrete_gradient.py.

    >>> AugmentedLagrangian(dt=0.025, penalty=1e4, exponent=1.0, gradient="mean-value")
    Traceback (most recent call last):
    swarm.errors.SceneError: gradient must be "composite" for exponent = 1, got "mean-value"
    """

    tolerance: Positive = 1e-10
    max_sweeps: Count = 50
    gradient: fixed_step.Gradient = "composite"
    adaptive: Flag = False
    acceleration: Annotated[str, choice(*_ACCELERATIONS)] = "none"
    on_unconverged: Annotated[str, choice(*_POLICIES)] = "raise"
    contact_start: base.ContactStart = field(default="impact", metadata=base.YOUNGER)

    def __post_init__(self) -> None:
        super().__post_init__()
        fixed_step.check_gradient(self)
        if self.contact_start == "centred":
            self._require_centred()

    def _require_centred(self) -> None:
        """Raise a `SceneError` if the other arguments do not allow a step that is centred about an impact."""
        if not self.adaptive:
            raise SceneError(
                'adaptive must be True with contact_start = "centred", got False: steps of fixed length begin at any '
                "time; give adaptive=True, or leave contact_start out"
            )
        if self.exponent != 1.0:
            raise SceneError(
                f'exponent must be 1 with contact_start = "centred", got {self.exponent:g}: the loop ends on the level '
                "of the start of the step only for 1; leave exponent out, or contact_start"
            )

    def check(self, scene: Scene, particles: Particles) -> None:
        base.check_bends(scene)
        if self.adaptive:
            base.check_crossing("dt", self.dt, scene, particles)
            fixed_step.check_reach("dt", self.dt, scene, particles.fastest())
        else:
            fixed_step.check_instants(scene, self.dt)
            fixed_step.check_turns(self, scene)
            fixed_step.check_solids(scene, particles, self.dt)

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        # The reaction, the chord that starts the loop, and the exact impacts that may replace a contact
        contact = *reaction_needs(self.gradient), "gap_scale", *CHORD_NEEDS, *SLIDING_NEEDS
        return *super().needs(scene), *contact

    def numbers(self, scene: Scene) -> steps.StepNumbers:
        kind = steps.CutSteps if self.adaptive else steps.FixedSteps
        if self.contact_start == "centred":
            kind = steps.CentredSteps
        return kind(
            self.dt,
            self.law(),
            form_of(self.gradient),
            base.SHORTEST * scene.finite_size(),
            self.tolerance,
            self.max_sweeps,
            _ACCELERATIONS[self.acceleration],
            _POLICIES[self.on_unconverged],
            scene.reach_of_steps() if self.adaptive else fixed_step.longest_step(scene, self.dt),
            fixed_step.moves(scene),
            fixed_step.laws_at_ends(scene, self.apart()),
        )

    def apart(self) -> str:
        return CUT if self.adaptive else type(self).__name__

    def time_of_impact(self) -> float | None:
        # A centred step replaces a part of the flights before and after it.
        return (0.0 if self.contact_start == "centred" else self.dt) if self.adaptive else None

    def span(self, name: str, duration: float) -> float:
        return duration if self.adaptive else super().span(name, duration)

    def instant(self, moment: float) -> float:
        return moment if self.adaptive else super().instant(moment)

    def birth_times(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        return times if self.adaptive else super().birth_times(times)

    def parts(self, durations: NDArray[np.float64]) -> NDArray[np.float64]:
        return durations if self.adaptive else super().parts(durations)

    def seldom_hard(self, scene: Scene) -> bool:
        return False

    def has_multipliers(self) -> bool:
        return True

    def failure(self, moment: float, remaining: float, sweeps: int, stored: float, mass: float) -> str:
        now = moment - (remaining if self.adaptive else remaining * self.dt)
        message = (
            f"in the step from {now:.9g} s (step {round(now / self.dt) + 1} of dt): {sweeps} sweeps left V = "
            f"{stored:.3g} J, above tolerance = {self.tolerance:g} J. "
        )
        stiffness = self.penalty * self.dt * self.dt / mass
        larger = _GOOD / stiffness * self.penalty
        otherwise = (
            'on_unconverged="count", which accepts such a step with its error of the energy, or "impact", which '
            "replaces it by the exact impact"
        )
        if not self.adaptive or self.exponent != 1.0:
            slow = f", and a penalty of 4 m/dt^2 = {larger:.2g} or more" if stiffness < _GOOD else ""
            return message + (
                "The loop converges for exponent = 1 from the surface: use exponent = 1 and adaptive=True "
                f"(which needs gravity=None){slow}, or {otherwise}"
            )
        message += (
            "A sweep divides the gap by about 1 + alpha h^2/(4 m), with alpha = penalty and h = dt, and alpha h^2/m = "
            f"{stiffness:.3g} here: use "
        )
        if stiffness < _GOOD:
            quicker = "" if self.acceleration == "reflection" else 'acceleration="reflection", '
            message += f"{quicker}a penalty that grows as 1/dt^2 ({larger:.2g} makes alpha h^2/m = {_GOOD:g}), "
        return message + f"more max_sweeps, or {otherwise}"
