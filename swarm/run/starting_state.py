"""The state of particles that are independent of one another, at the start of a run and of a frame."""

import math

import numpy as np
from numpy.typing import NDArray

from ..compiled_scene import CompiledScene
from ..contact.events import ARRIVED, FLYING
from ..methods.base import Method
from ..particles import Particles
from ..state import Contacts, Floats, Multipliers, State, none_left


def state_of(
    compiled: CompiledScene, particles: Particles, method: Method, booked: int, presses: bool = False
) -> State:  # fmt: skip
    """Return the state with the arrays of the particles; `start_energies` sets the energies.

    `booked` is the number of rows of impulse and work; `presses` is whether impulses are kept until a contact ends.
    """
    n, laws, rows = len(particles), compiled.laws, len(compiled.numbering.surfaces_of_rows)
    period, openings, ends = compiled.cell(), compiled.openings(), laws is not None and laws.may_end
    # The time from which each particle flies; None if all fly at once and no particle may wait on a wall later.
    starts = np.full(n, -math.inf) if ends else None
    if particles.births is not None:
        starts = particles.births.time.copy()
    # The stored energy of soft contacts is lost with a wall that becomes absent, or opens.
    loses = laws is not None or (method.law() is not None and (openings is not None or compiled.scene.has_doors()))
    return State(
        particles.position,
        particles.velocity,
        particles.mass,
        np.empty(n),
        np.empty(n),
        np.zeros(n, np.int64),
        np.zeros((booked, n)),
        np.zeros(n if loses else 0),
        Multipliers(*np.zeros((3, n), np.int64), *np.zeros((2, n))) if method.has_multipliers() else None,
        _no_contacts(rows, n) if method.may_slide() else None,
        None if laws is None or not laws.give_heat else np.zeros((rows, n)),
        particles.image,
        None if period is None or period.fall is None else np.zeros(n),
        period,
        openings=openings,
        starts=starts,
        **none_left(n, openings is not None, ends),
        late=np.zeros(n) if (particles.births is not None or ends) and not method.may_slide() else None,
        pressed=np.zeros((rows, n)) if presses else None,
        rubbed=np.zeros((rows, n)) if presses else None,
    )


def begin(state: State, phase: NDArray[np.int8], frame: tuple[float, float], lasts: bool, method: Method) -> None:
    """Set the phase of each particle at the start of a frame; `lasts`: a contact has lasted in the run.

    `frame` is its length, in the unit of the method, and its end [s]. Particles that are not born yet have no phase.
    """
    span, end = frame
    contacts = state.contacts
    if contacts is None or not lasts:
        phase.fill(FLYING)
    else:
        contacts.short_steps.fill(0.0)
        phase[:] = contacts.phase[: len(phase)]
        rests = contacts.phase == ARRIVED
        if rests.any():
            # Particles at rest need no kernel.
            state.impulse[: len(contacts.load)] += contacts.load * (span * state.mass)
            contacts.sliding[:] += span * rests
    if state.escape_time is not None or state.absorbed_time is not None:
        phase[state.gone()[: len(phase)]] = ARRIVED
    if state.starts is not None:
        left = method.parts(end - state.starts[: len(phase)])
        _begin_late(left, state.late if state.contacts is None else state.contacts.remaining, phase, span)


def _begin_late(left: Floats, remaining: Floats | None, phase: NDArray[np.int8], span: float) -> None:
    """Mark particles that start at or after the end of the frame as ARRIVED; `left` is the frame's rest at a start.

    Particles that start within the frame fly for the rest of the frame.
    """
    phase[left <= 0.0] = ARRIVED
    late = np.flatnonzero((left < span) & (phase == FLYING))
    if late.size:
        assert remaining is not None
        remaining[late] = left[late]


def holders_of_resting(contacts: Contacts | None) -> NDArray[np.int64]:
    """Return the wall of each particle at rest."""
    if contacts is None:
        return np.zeros(0, np.int64)
    rests = contacts.phase == ARRIVED
    first = contacts.walls[0, rests]
    return np.asarray(np.where(first >= 0.0, first, contacts.met[rests]), np.int64)


def have_lasted(contacts: Contacts | None, phase: NDArray[np.int8]) -> bool:
    """Whether a contact of a run has lasted, or is about to.

    The rest of the frame is no criterion: a particle that starts within the frame may have met no wall yet.
    """
    if contacts is None:
        return False
    return bool(contacts.phase.any() or contacts.sliding.any() or ((phase != FLYING) & (phase != ARRIVED)).any())


def _no_contacts(walls: int, n: int) -> Contacts:
    phase, load = np.zeros(n, np.int8), np.zeros((walls, n))
    met, step, keep, remaining, short_steps, sliding = np.zeros((6, n))
    return Contacts(phase, np.zeros((2, n)), met, step, keep, remaining, np.zeros((2, n)), short_steps, load, sliding)
