"""The records of a body, and of the method that advances it, for kernels."""

import math

import numpy as np

from ..compiled_scene import CompiledScene
from ..kernel.random import UNSEEDED, Seeding
from ..methods import AugmentedLagrangian
from ..methods.base import Method
from ..state import Floats
from ..surfaces.surface import Surface
from . import algebra
from .body import Body
from .checked import Pairs
from .lanes.body_arrays import Ties, Touching
from .lanes.contacts import MOST_CONTACTS
from .lanes.penalty_contact import Soft


def ties_of(body: Body, penalty: float | None = None) -> Ties:
    """Return the ties of a body; with a penalty its links are held by multipliers of Uzawa's loop."""
    ends = body.bonds()
    links, springs, edges = len(body.links), len(body.springs), len(body.strained())
    relaxed = 0 if penalty is None else links
    if penalty is not None:
        # Relaxed links follow the springs: like springs they have a stiffness.
        ends = np.concatenate([ends[links : links + springs], ends[:links], ends[links + springs :]])
    tied = body.points[ends[:, 0]] - body.points[ends[:, 1]]
    rest, stiffness = (tied**2).sum(axis=1), np.zeros(len(ends))
    give = np.zeros(len(ends)) if penalty is None else 8.0 / penalty * rest
    for row, (_i, _j, k, length) in enumerate(body.springs, start=links - relaxed):
        stiffness[row], rest[row] = k, length
    compliance: Floats = np.zeros((edges, edges))
    if body.strain is not None:
        rest[links + springs :] = body.strain.rest
        compliance = 2.0 * algebra.inverse(body.strain.stiffness)
    is_free = np.ones(len(body), np.bool_)
    is_free[list(body.anchors)] = False
    inverse = body.inverse_mass()
    is_diagonal = bool((inverse == np.diag(np.diag(inverse))).all())
    rows = np.concatenate([_differences(ends, len(body)), _combinations(body)])
    couplings = algebra.product(rows, algebra.product(rows, inverse).T)
    ties = len(ends)
    held = [*range(ties), *range(ties + len(body.contacts), ties + len(body.contacts) + len(body.guides))]
    filled = couplings[np.ix_(held, held)] != 0.0
    filled[links + springs : ties, links + springs : ties] = True
    start = np.array([np.flatnonzero(row[: k + 1]).min(initial=k) for k, row in enumerate(filled)], np.int64)
    led, paths = np.full(len(body), -1), led_points(body)
    led[paths] = np.arange(len(paths))
    return Ties(
        ends, links - relaxed, springs + relaxed, relaxed, rest, stiffness, give, compliance, start,
        inverse, body.mass_matrix, is_diagonal, is_free, led, couplings,
    )  # fmt: skip


def led_points(body: Body) -> list[int]:
    """The points with a path."""
    return [point for point, motion in body.anchors.items() if motion is not None]


def _differences(ends: Pairs, points: int) -> Floats:
    """Return the matrix (rows, P) with +1 at the first point of each pair, and -1 at the second."""
    unit = np.eye(points)
    return np.asarray(unit[ends[:, 0]] - unit[ends[:, 1]])


def _combinations(body: Body) -> Floats:
    """The coefficients (K + G + C, P) of contacts, guided points, and points relative to carriers of cavities."""
    held = np.eye(len(body))[[point for point, _surface in body.guides]]
    carried = np.array([(point, carrier) for _surface, carrier, point in body.cavities], np.int64).reshape(-1, 2)
    return np.concatenate([body.contacts, held, _differences(carried, len(body))])


def walls_of(method: Method) -> Soft | None:
    """Return the law of soft walls; None for rigid walls."""
    if method.is_rigid():
        return None
    law = method.law()
    if not isinstance(method, AugmentedLagrangian):
        return Soft(law, math.inf, 1, False, 0.0)
    # The gap at which V = alpha g^(a+1)/(a+1) is the tolerance.
    power = method.exponent + 1.0
    deepest = (power * method.tolerance / method.penalty) ** (1.0 / power)
    return Soft(law, method.tolerance, method.max_sweeps, True, deepest)


def most_contacts_of(touching: Touching, walls: Soft | None) -> int:
    """The number of contacts of a body that are solved together: with soft walls, all possible ones."""
    if walls is None or walls.is_cut:
        return MOST_CONTACTS
    return max(1, touching.points * touching.walls + len(touching.plain) - touching.points - touching.guides)


def own_surfaces(body: Body) -> list[Surface]:
    """Return the surfaces of the guides and cavities of a body."""
    return [surface for _point, surface in body.guides] + [surface for surface, _carrier, _point in body.cavities]


def touching_of(body: Body, ties: Ties, compiled: CompiledScene, seeding: Seeding = UNSEEDED) -> Touching:
    """Return the points of a body that may touch walls of a scene, or its own guides and cavities."""
    b = _combinations(body)
    single = ((b != 0.0).sum(axis=1) == 1) & (b.max(axis=1, initial=0.0) == 1.0)
    plain = np.where(single, b.argmax(axis=1), -1).astype(np.int64)
    of_walls = compiled.lawful()
    surfaces = of_walls + own_surfaces(body)
    restitution = np.array([surface.restitution for surface in surfaces])
    friction = np.array([surface.friction for surface in surfaces])
    laws = compiled.laws if compiled.laws is not None and compiled.laws.send_off else None
    return Touching(
        b, plain, algebra.product(b, ties.inverse_mass), len(body.contacts), len(of_walls), len(body.guides),
        restitution, friction, laws is not None or bool(((restitution < 1.0) | (friction > 0.0)).any()), laws,
        None if laws is None else seeding,
    )  # fmt: skip
