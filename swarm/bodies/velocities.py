"""Velocities of bodies that agree with links, guides, and the paths of anchored points.

A stage keeps lengths by lambda, so velocities along a link that contradict it turn at each step and never vanish.
"""

import numpy as np

from ..errors import SceneError
from ..motion import led
from ..state import Floats
from .body import Body
from .tied import Tie, ties

# How exactly velocities must agree with ties, relative to the fastest point of the copy: as exactly as lengths do, by
# which the directions of ties are known. What turns at each step is then 1e-18 of the kinetic energy.
_AGREED = 1e-9
# Of a projection: corrections, each of which takes all but the round-off of the equations from what is left.
_CORRECTIONS = 3


def led_along(body: Body, position: Floats, velocity: Floats) -> Floats:
    """`velocity` (3, P, n) with that of its path at every anchored point, where it may be left at 0.

    Raises:
        SceneError: it is another.
    """
    made = velocity.copy()
    for point, motion in body.anchors.items():
        made[:, point] = 0.0
        if motion is not None:
            for copy, start in enumerate(position[:, point].T):
                made[:, point, copy] = led(motion, start).velocity_at(0.0)
        given, path = velocity[:, point], made[:, point]
        off = np.abs(given - path).max(axis=0) > _AGREED * _fastest(velocity)
        for copy in np.flatnonzero(off & given.any(axis=0))[:1]:
            where = (
                "fixed in space"
                if motion is None
                else f"led at {path[:, copy].tolist()} m/s at the start (a phase lets a motion begin elsewhere)"
            )
            raise SceneError(
                f"velocity of anchors[{point}] must be that of its path, or 0, which stands for it, got "
                f"{given[:, copy].tolist()} m/s for point {point} of copy {copy}, which is {where}"
            )
    return made


def require_agreed(body: Body, position: Floats, velocity: Floats, projected: bool) -> None:
    """Raise a `SceneError` where a point has a velocity that its link or guide does not let it have."""
    fastest = _fastest(velocity)
    for tie in ties(body.links, body.guides, position):
        speeds = np.abs(_speed(tie, velocity))
        off = speeds > _AGREED * fastest
        for copy in np.flatnonzero(off)[:1]:
            hint = (
                "no velocities of the other points agree with the paths of the anchored ones; start them otherwise"
                if projected
                else "give velocities that agree, or project=True, for the nearest that do"
            )
            where = (
                f"along {tie.name}, {tie.points}"
                if tie.surface is None
                else f"of point {tie.points[0]} across {tie.name}, {tie.surface!r:.80}"
            )
            raise SceneError(
                f"velocity must agree with links and guides to {_AGREED:g} of the fastest point, got "
                f"{speeds[copy]:.6g} m/s {where}, in copy {copy} ({off.sum()} such), whose fastest point has "
                f"{fastest[copy]:.6g} m/s; {hint}"
            )


def projected(body: Body, position: Floats, velocity: Floats) -> Floats:
    """The velocities nearest to `velocity` (3, P, n), in the metric of the kinetic energy, that agree with ties.

    v - W J^T (J W J^T)^-1 J v, of the inverse W of the masses of points that can move, and the ties' J v = 0.
    """
    held, made, inverse = list(ties(body.links, body.guides, position)), velocity.copy(), body.inverse_mass()
    if not held:
        return made
    for copy in range(position.shape[2]):
        rows = np.zeros((len(held), len(body), 3))
        for row, tie in zip(rows, held, strict=True):
            for point, sign in tie.ends():
                row[point] += sign * tie.normal[:, copy]
        pushed = np.einsum("pq,aqx->apx", inverse, rows)
        flat = rows.reshape(len(held), -1)
        # In units of each tie's own, so that a light point beside a heavy one is no singularity.
        unit = 1.0 / np.sqrt(np.maximum((flat * pushed.reshape(flat.shape)).sum(axis=1), np.finfo(np.float64).tiny))
        system = unit[:, None] * (flat @ pushed.reshape(flat.shape).T) * unit
        for _correction in range(_CORRECTIONS):
            speeds = flat @ made[:, :, copy].T.ravel()
            force = unit * np.linalg.lstsq(system, unit * speeds, rcond=None)[0]
            made[:, :, copy] -= np.einsum("a,apx->xp", force, pushed)
    return made


def _speed(tie: Tie, velocity: Floats) -> Floats:
    """(n,) along the normal of a tie [m/s], of velocities (3, P, n): what must be 0."""
    return np.asarray((tie.normal * sum(sign * velocity[:, point] for point, sign in tie.ends())).sum(axis=0))


def _fastest(velocity: Floats) -> Floats:
    """(n,) the speed of the fastest point of each copy."""
    return np.asarray(np.sqrt((velocity**2).sum(axis=0).max(axis=0)))
