"""The state of a run at its start, of particles that are independent of one another."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..methods.base import Method
from ..particles import Contacts, Multipliers, Particles, State
from ..scene import Scene
from ..surfaces.openings import Openings
from ..surfaces.period import Period


class Seeding(NamedTuple):
    """What random numbers depend on besides the impacts: the seed, and the number of the first particle of this run.

    That is 0 but for a shard: its particles are numbered as in the whole run.
    """

    seed: int = 0
    first: int = 0


def state_of(scene: Scene, particles: Particles, method: Method, booked: int) -> State:
    """The state with the arrays of the particles and so many rows of what walls give; energies are still to be set."""
    n, laws, surfaces = len(particles), scene.laws(), len(scene.owners())
    return State(
        particles.position,
        particles.velocity,
        particles.mass,
        np.empty(n),
        np.empty(n),
        np.zeros(n, np.int64),
        np.zeros((booked, n)),
        np.zeros(0 if laws is None else n),
        _no_sweeps(n) if method.has_multipliers() else None,
        _no_contacts(surfaces, n) if method.may_slide() else None,
        None if laws is None or laws.thermal is None else np.zeros((surfaces, n)),
        particles.image,
        *_cell(scene, n),
        *_none_escaped(scene, n),
    )


def _cell(scene: Scene, n: int) -> tuple[NDArray[np.float64] | None, Period | None]:
    """What the state needs besides images where a scene repeats."""
    period = scene.cell()
    return None if period is None or period.fall is None else np.zeros(n), period


def _none_escaped(scene: Scene, n: int) -> tuple[NDArray[np.float64] | None, Openings | None]:
    """What the state needs besides where walls have openings."""
    openings = scene.openings()
    return None if openings is None else np.full(n, math.nan), openings


def _no_contacts(walls: int, n: int) -> Contacts:
    phase, load = np.zeros(n, np.int8), np.zeros((walls, n))
    met, step, keep, left, short_steps, sliding = np.zeros((6, n))
    return Contacts(phase, np.zeros((2, n)), met, step, keep, left, np.zeros((2, n)), short_steps, load, sliding)


def _no_sweeps(n: int) -> Multipliers:
    counts = np.zeros((3, n), np.int64)
    return Multipliers(counts[0], counts[1], counts[2], np.zeros(n), np.zeros(n))
