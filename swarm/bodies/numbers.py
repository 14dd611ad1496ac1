"""A body as its kernels take it."""

import numpy as np

from ..lanes.tied.arrays import Ties, Touching
from ..particles import Floats
from ..scene import Scene
from .body import Body


def ties_of(body: Body) -> Ties:
    """What ties its points."""
    ends = body.bonds()
    links, springs, edges = len(body.links), len(body.springs), 0 if body.strain is None else len(body.strain.edges)
    tied = body.points[ends[:, 0]] - body.points[ends[:, 1]]
    rest, stiffness = (tied**2).sum(axis=1), np.zeros(len(ends))
    compliance: Floats = np.zeros((edges, edges))
    for row, (_i, _j, k, length) in enumerate(body.springs, start=links):
        stiffness[row], rest[row] = k, length
    if body.strain is not None:
        rest[links + springs :] = body.strain.rest
        compliance = np.asarray(2.0 * np.linalg.inv(body.strain.stiffness), dtype=np.float64)
    is_free = np.ones(len(body), np.bool_)
    is_free[list(body.anchors)] = False
    free = np.flatnonzero(is_free)
    inverse = np.zeros((len(body), len(body)))
    inverse[np.ix_(free, free)] = np.linalg.inv(body.mass_matrix[np.ix_(free, free)])
    is_diagonal = bool((inverse == np.diag(np.diag(inverse))).all())
    beta = np.zeros((len(ends), len(body)))
    for row, (i, j) in enumerate(ends):
        beta[row, i], beta[row, j] = 1.0, -1.0
    couplings = beta @ inverse @ beta.T
    filled = couplings != 0.0
    filled[links + springs :, links + springs :] = True
    start = np.array([np.flatnonzero(row[: k + 1]).min(initial=k) for k, row in enumerate(filled)], np.int64)
    return Ties(
        ends, links, springs, rest, stiffness, compliance, start, inverse, body.mass_matrix, is_diagonal, is_free,
        couplings,
    )  # fmt: skip


def touching_of(body: Body, ties: Ties, scene: Scene) -> Touching:
    """Its points that may touch the walls of a scene."""
    b, owners = body.contacts, scene.owners()
    single = ((b != 0.0).sum(axis=1) == 1) & (b.max(axis=1) == 1.0)
    plain = np.where(single, b.argmax(axis=1), -1).astype(np.int64)
    reach = b @ ties.inverse_mass
    beta = np.zeros((len(ties.ends), len(body)))
    for row, (i, j) in enumerate(ties.ends):
        beta[row, i], beta[row, j] = 1.0, -1.0
    return Touching(
        b, plain, reach, reach @ beta.T, reach @ b.T,
        np.array([scene.surfaces[i].restitution for i in owners]),
        np.array([scene.surfaces[i].friction for i in owners]),
    )  # fmt: skip
