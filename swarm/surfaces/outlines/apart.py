"""The sides of an outline as arrays, and whether any two of them cross."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...state import Floats


class Edges(NamedTuple):
    """The sides of an outline, counter-clockwise, arcs of at most half a circle: arrays with an entry a side."""

    start: Floats  # (n, 2)
    end: Floats
    normal: Floats  # at the start
    curvature: Floats  # (n,)
    ahead: Floats  # the tangents at the start and at the end, (n, 2)
    behind: Floats
    length: Floats  # (n,)
    which: NDArray[np.int64]  # the side of the outline that it is of


def along(a: Floats, b: Floats) -> Floats:
    """The products a.b of vectors (..., 2)."""
    return np.asarray((a * b).sum(axis=-1))


def require_apart(name: str, sides: Edges, nothing: float) -> None:
    """Raise a `SceneError` where two sides cross or touch other than at the vertex that they share."""
    n = len(sides.start)
    i, j = np.triu_indices(n, 1)
    a, b = (Edges._make(part[k] for part in sides) for k in (i, j))
    for point in _common(a, b):
        on = np.isfinite(point).all(axis=1)
        for one in (a, b):
            on &= (along(point - one.start, one.ahead) >= -nothing) & (along(point - one.end, one.behind) <= nothing)
        for mine, other, next_to in ((a.end, b.start, j == i + 1), (a.start, b.end, (i == 0) & (j == n - 1))):
            shared = next_to & (np.hypot(*(point - mine).T) <= 1e4 * nothing) & (np.hypot(*(mine - other).T) <= nothing)
            on &= ~shared
        if on.any():
            k = int(np.flatnonzero(on)[0])
            raise SceneError(
                f"{name} must not cross itself, got sides {a.which[k]} and {b.which[k]} that meet at "
                f"({point[k, 0]:.4g}, {point[k, 1]:.4g}); side k is from vertex k to the next"
            )


def _common(a: Edges, b: Edges) -> list[Floats]:
    """The two points that each pair of lines or circles has in common, NaN for a pair that has no such points."""
    with np.errstate(all="ignore"):
        ka, kb = a.curvature, b.curvature
        # A line through both points: kb La - ka Lb has no square; of two lines it is one of them.
        off = a.start - b.start
        straight = (ka == 0.0) & (kb == 0.0)
        # La(r) = na.(r - a) + ka/2 |r - a|^2, about the point a; Lb about it: (nb + kb off).d + Lb(a)
        nb, cb = b.normal + kb[:, None] * off, along(b.normal, off) + 0.5 * kb * along(off, off)
        ka_, kb_ = np.where(straight, 0.0, ka), np.where(straight, 1.0, kb)
        normal = kb_[:, None] * a.normal - ka_[:, None] * nb
        shift = -ka_ * cb
        size2 = along(normal, normal)
        foot = -(shift / size2)[:, None] * normal
        way = np.stack([-normal[:, 1], normal[:, 0]], axis=1) / np.sqrt(size2)[:, None]
        # Along that line the level of the one that is bent, or of the other line
        use_b = (kb != 0.0) | straight
        n, k, c = np.where(use_b[:, None], nb, a.normal), np.where(use_b, kb, ka), np.where(use_b, cb, 0.0)
        level = c + along(n, foot) + 0.5 * k * along(foot, foot)
        slope = along(n, way) + k * along(foot, way)
        root = np.sqrt(slope * slope - 2.0 * k * level)
        q = -(slope + np.copysign(root, slope))
        times = np.where(k == 0.0, -level / slope, q / k), np.where(k == 0.0, np.nan, 2.0 * level / q)
        return [a.start + foot + t[:, None] * way for t in times]
