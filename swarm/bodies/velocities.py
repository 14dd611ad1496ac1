"""Whether the velocities of bodies agree with what holds their points: links, guides, and paths of anchored points.

A stage keeps lengths by lambda, so velocities along a link that contradict it turn at each step and never vanish.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..errors import SceneError
from ..motion import led
from ..particles import Floats
from .body import Body

# How exactly velocities must agree with ties, relative to the fastest point of the copy: as exactly as lengths do, by
# which the directions of ties are known. What turns at each step is then 1e-18 of the kinetic energy.
_AGREED = 1e-9
# Of a projection: corrections, each of which takes all but the round-off of the equations from what is left.
_CORRECTIONS = 3


class Tie(NamedTuple):
    """What holds a point, or two: along its normal they have no velocity, or the same.

    Attributes:
        name: where it holds, for errors.
        points: the point, or the two points of a link.
        normal: (3, n) of each copy; a link's is that of the first point, its second has the opposite.
    """

    name: str
    points: tuple[int, ...]
    normal: Floats

    def speed(self, velocity: Floats) -> Floats:
        """(n,) along the normal [m/s], of velocities (3, P, n): what must be 0."""
        first, *second = self.points
        relative = velocity[:, first] - velocity[:, second[0]] if second else velocity[:, first]
        return np.asarray((self.normal * relative).sum(axis=0))


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
    for tie in _ties(body, position):
        speeds = np.abs(tie.speed(velocity))
        off = speeds > _AGREED * fastest
        for copy in np.flatnonzero(off)[:1]:
            hint = (
                "no velocities of the other points agree with the paths of the anchored ones; start them otherwise"
                if projected
                else "give velocities that agree, or project=True, for the nearest that do"
            )
            raise SceneError(
                f"velocity must agree with links and guides to {_AGREED:g} of the fastest point, got "
                f"{speeds[copy]:.6g} m/s {tie.name}, in copy {copy} ({off.sum()} such), whose fastest point has "
                f"{fastest[copy]:.6g} m/s; {hint}"
            )


def projected(body: Body, position: Floats, velocity: Floats) -> Floats:
    """The velocities nearest to `velocity` (3, P, n), in the metric of the kinetic energy, that agree with ties.

    v - W J^T (J W J^T)^-1 J v, of the inverse W of the masses of points that can move, and the ties' J v = 0.
    """
    ties, made = list(_ties(body, position)), velocity.copy()
    if not ties:
        return made
    free = np.setdiff1d(np.arange(len(body)), list(body.anchors))
    inverse = np.zeros((len(body), len(body)))
    inverse[np.ix_(free, free)] = np.linalg.inv(body.mass_matrix[np.ix_(free, free)])
    for copy in range(position.shape[2]):
        rows = np.zeros((len(ties), len(body), 3))
        for row, tie in zip(rows, ties, strict=True):
            for point, sign in zip(tie.points, (1.0, -1.0), strict=False):
                row[point] += sign * tie.normal[:, copy]
        pushed = np.einsum("pq,aqx->apx", inverse, rows)
        flat = rows.reshape(len(ties), -1)
        # In units of each tie's own, so that a light point beside a heavy one is no singularity.
        unit = 1.0 / np.sqrt(np.maximum((flat * pushed.reshape(flat.shape)).sum(axis=1), np.finfo(np.float64).tiny))
        system = unit[:, None] * (flat @ pushed.reshape(flat.shape).T) * unit
        for _correction in range(_CORRECTIONS):
            speeds = flat @ made[:, :, copy].T.ravel()
            force = unit * np.linalg.lstsq(system, unit * speeds, rcond=None)[0]
            made[:, :, copy] -= np.einsum("a,apx->xp", force, pushed)
    return made


def _ties(body: Body, position: Floats) -> Iterator[Tie]:
    # One at a time: of many copies each is large.
    for k, (i, j) in enumerate(body.links.tolist()):
        apart = position[:, i] - position[:, j]
        normal = apart / np.sqrt((apart**2).sum(axis=0))
        yield Tie(f"along links[{k}], {(i, j)}", (i, j), normal)
    for k, (point, surface) in enumerate(body.guides):
        slope = surface.gradient(np.ascontiguousarray(position[:, point]))
        normal = slope / np.sqrt((slope**2).sum(axis=0))
        yield Tie(f"of point {point} across guides[{k}], {surface!r:.80}", (point,), normal)


def _fastest(velocity: Floats) -> Floats:
    """(n,) the speed of the fastest point of each copy."""
    return np.asarray(np.sqrt((velocity**2).sum(axis=0).max(axis=0)))
