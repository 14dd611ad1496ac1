"""A closed outline of lines and arcs: its sides, its area and length, and the distance of points from it.

It is given as in DXF: a vertex is x and y, and a third number, the bulge of the side that begins there: tan(angle/4) of
the arc, 0 a line, 1 a half circle; above 0 the side turns to the left, which is outwards where the vertices go round
counter-clockwise. An edge has n, the unit normal out of the outline at its start a, and a curvature k: it is where n.d
+ k/2 |d|^2 = 0 with d = r - a; this level is the distance to first order.
"""

import math
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common.checks import magnitude, number, parts_of, shown
from ...errors import SceneError
from ...kernel.limits import TINY
from ...state import Floats

Row = tuple[float, ...]

# A length, or a distance, up to this part of the extent counts as 0; two sides with a sine up to this have no corner.
_NOTHING, _SMOOTH = 1e-12, 1e-9
# The number of points treated together, times sides
_BATCH = 1 << 20
# The points of a picture's curve along a side
_POINTS = 65
# Up to this part of the distance between two sides a place is behind the nearer one.
_HALF = 0.4


class Edges(NamedTuple):
    """The sides of an outline, counter-clockwise, arcs of at most half a circle: arrays with an entry for a side."""

    start: Floats  # (n, 2)
    end: Floats
    normal: Floats  # the normal at the start
    curvature: Floats  # (n,)
    ahead: Floats  # the tangents at the start and at the end, (n, 2)
    behind: Floats
    length: Floats  # (n,)
    which: NDArray[np.int64]  # the side of the outline that the entry is a part of


def along(a: Floats, b: Floats) -> Floats:
    """The products a.b of vectors (..., 2)."""
    return np.asarray((a * b).sum(axis=-1))


class Outline:
    """A closed outline, from the rows of its vertices.

    Raises:
        SceneError: fewer than two sides, an invalid vertex, two vertices at one point, sides that cross, or no area.
    """

    def __init__(self, name: str, rows: Any) -> None:
        self.rows = _checked(name, rows)
        sides, self.turned = _sides_of(np.array(self.rows)), False
        if _area(sides) < 0.0:
            sides, self.turned = _sides_of(np.array(_reversed(self.rows))), True
            sides = sides._replace(which=(len(self.rows) - 2 - sides.which) % len(self.rows))
        self.sides = sides
        self.extent = float(np.abs(np.concatenate([sides.start, self._tops()])).max())
        size = float(np.ptp(sides.start, axis=0).max())
        if not _area(sides) > _NOTHING * size * size:
            raise SceneError(f"{name} must go round an area, got {shown(self.rows)}; list the vertices in their order")
        _require_apart(name, sides, _NOTHING * max(size, self.extent))

    def __len__(self) -> int:
        return len(self.sides.start)

    def area(self) -> float:
        """The area within [m^2]."""
        return _area(self.sides)

    def perimeter(self) -> float:
        """The length of all sides [m]."""
        return float(self.sides.length.sum())

    def smallest(self) -> float:
        """A length of the outline: twice its area over its perimeter [m], for a circle the radius."""
        return 2.0 * self.area() / self.perimeter()

    def corners(self) -> tuple[Floats, Floats]:
        """The lowest and the highest corner of the box around every side: (2, n) each."""
        points = [self.sides.start, self.sides.end]
        low, high = np.minimum(*points), np.maximum(*points)
        tops = self._every_top()
        return np.fmin(low, tops.min(axis=0)).T, np.fmax(high, tops.max(axis=0)).T

    def _tops(self) -> Floats:
        tops = self._every_top().reshape(-1, 2)
        return np.concatenate([self.sides.end, tops[np.isfinite(tops[:, 0])]])

    def _every_top(self) -> Floats:
        """The leftmost, rightmost, lowest and highest points of arcs, (4, n, 2); the start of an arc that has none."""
        s, found = self.sides, []
        bent = s.curvature != 0.0
        inverse = 1.0 / np.where(bent, s.curvature, 1.0)
        for x, y in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
            point = s.start + inverse[:, None] * (np.sign(s.curvature)[:, None] * np.array([x, y]) - s.normal)
            here = bent & (along(point - s.start, s.ahead) >= 0.0) & (along(point - s.end, s.behind) <= 0.0)
            found.append(np.where(here[:, None], point, s.start))
        return np.array(found)

    @cached_property
    def turns(self) -> NDArray[np.int64]:
        """How the outline turns at the end of every side: 1 a convex corner, -1 a re-entrant one, 0 smoothly."""
        after = np.roll(self.sides.ahead, -1, axis=0)
        before = self.sides.behind
        sine = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
        # A spike turns back: its sine is 0, and it is no smooth joint.
        back = along(before, after) < 0.0
        return np.where(np.abs(sine) > _SMOOTH, np.sign(sine), np.where(back, 1.0, 0.0)).astype(np.int64)

    def wedges(self, side: float) -> Floats:
        """1 where sides join at a convex corner at their end, 0 if smoothly, -sin of half the re-entrant wedge.

        Convex and re-entrant are as seen from within (side = 1) or from around (-1).
        """
        after = np.roll(self.sides.ahead, -1, axis=0)
        # The wedge is half a circle less the turn.
        cosine = np.clip(-along(self.sides.behind, after), -1.0, 1.0)
        turns = side * self.turns
        return np.asarray(np.where(turns < 0.0, -np.sqrt(0.5 * (1.0 - cosine)), turns))

    @cached_property
    def thickness(self) -> Floats:
        """For each side, a distance within which the only other sides are its neighbours [m]."""
        s, n = self.sides, len(self)
        found, bent = np.full(n, self.extent), np.flatnonzero(s.curvature)
        points, owner = [s.start, s.end], [np.arange(n)] * 2
        for arc in bent.tolist():
            points.append(self._curve(arc)[:: (_POINTS - 1) // 16])
            owner.append(np.full(len(points[-1]), arc))
        every, sides = np.concatenate(points), np.concatenate(owner)
        step = max(1, _BATCH // n)
        for first in range(0, len(every), step):
            some, k = every[first : first + step], sides[first : first + step]
            distance = self._distances(some)[3]
            apart = np.abs(np.arange(n) - k[:, None])
            distance[(apart <= 1) | (apart == n - 1)] = math.inf
            np.minimum.at(found, k, distance.min(axis=1))
            found = np.minimum(found, distance.min(axis=0))
        return np.asarray(_HALF * found)

    def nearest(self, points: Floats) -> tuple[Floats, Floats]:
        """The signed distance (N,) of points (2, N), below 0 within, and its gradient (2, N)."""
        step = max(1, _BATCH // len(self))
        parts = [self._nearest(points[:, k : k + step]) for k in range(0, points.shape[1], step)]
        if not parts:
            return np.empty(0), np.empty((2, 0))
        return np.concatenate([d for d, _g in parts]), np.concatenate([g for _d, g in parts], axis=1)

    def _distances(self, points: Floats) -> Any:
        """For points (N, 2) and sides: signed distance of the curve, unit vector along it, whether within, distance."""
        s, r = self.sides, points[:, None, :]
        off = r - s.start
        grad = s.normal + s.curvature[:, None] * off
        level = along(s.normal, off) + 0.5 * s.curvature * along(off, off)
        steep = np.sqrt(along(grad, grad))
        # The distance to the circle, without cancellation: |grad|^2 = 1 + 2 k level
        signed = 2.0 * level / (1.0 + steep)
        out = grad / np.maximum(steep, TINY)[..., None]
        foot = off - signed[..., None] * out
        within = (along(foot, s.ahead) >= 0.0) & (along(foot - (s.end - s.start), s.behind) <= 0.0)
        ends = np.sqrt(np.minimum(along(off, off), along(r - s.end, r - s.end)))
        return signed, out, within, np.where(within, np.abs(signed), ends)

    def _nearest(self, points: Floats) -> tuple[Floats, Floats]:
        signed, out, within, distance = self._distances(points.T)
        s, r = self.sides, points.T
        k = np.argmin(distance, axis=1)
        i = np.arange(len(k))
        # At a corner both sides are at the same distance: the turn there decides on which side of it a point is.
        off, back = r - s.start[k], r - s.end[k]
        first = along(off, off) < along(back, back)
        turn = np.where(first, np.roll(self.turns, 1)[k], self.turns[k])
        corner = ~within[i, k] & (turn != 0)
        found = np.where(corner, turn * distance[i, k], np.where(signed[i, k] < 0.0, -1.0, 1.0) * distance[i, k])
        away = np.where(first[:, None], off, back)
        size = np.maximum(np.sqrt(along(away, away)), TINY)
        slope = np.where((corner & (distance[i, k] > 0.0))[:, None], turn[:, None] * away / size[:, None], out[i, k])
        return found, slope.T

    def curves(self) -> list[Floats]:
        """Return a curve (k, 2) along every side, for pictures."""
        return [self._curve(k) for k in range(len(self))]

    def _curve(self, k: int) -> Floats:
        s = self.sides
        part = np.linspace(0.0, 1.0, _POINTS)[:, None]
        if s.curvature[k] == 0.0:
            return np.asarray(s.start[k] + part * (s.end[k] - s.start[k]))
        angle = part * s.curvature[k] * s.length[k]
        # a + n (cos - 1)/k + t sin/k, with t the tangent and n the normal at the start
        bend = (np.cos(angle) - 1.0) * s.normal[k] + np.sin(angle) * s.ahead[k]
        return np.asarray(s.start[k] + bend / s.curvature[k])


# --- From rows -------------------------------------------------------------------------------------------


def _checked(name: str, rows: Any) -> tuple[Row, ...]:
    expected = "rows (x, y) or (x, y, bulge)"
    given = parts_of(rows)
    if given is None:
        raise SceneError(f"{name} must be {expected}, one for each vertex, got {shown(rows)}")
    found: list[Row] = []
    for k, row in enumerate(given):
        parts = parts_of(row) or ()
        if len(parts) not in (2, 3):
            raise SceneError(f"{name}[{k}] must be (x, y) or (x, y, bulge), got {shown(row)}")
        values = [number(f"{name}[{k}][{i}]", part) for i, part in enumerate(parts)]
        magnitude(f"|{name}[{k}]|", max(map(abs, values)))
        found.append((*values, 0.0)[:3])
    extent = max((max(abs(x), abs(y)) for x, y, _bulge in found), default=0.0)
    if _is_ring(found, _NOTHING * extent):
        found.pop()
    if len(found) < 2 or (len(found) == 2 and not any(bulge for _x, _y, bulge in found)):
        raise SceneError(f"{name} must have at least three vertices, or two and an arc, got {len(found)}")
    for k, (x, y, _bulge) in enumerate(found):
        j = (k + 1) % len(found)
        if math.hypot(found[j][0] - x, found[j][1] - y) <= _NOTHING * extent:
            raise SceneError(
                f"{name}[{k}] and {name}[{j}] must be apart, got ({x:g}, {y:g}) twice; leave one out (the last vertex "
                "is joined to the first)"
            )
    return tuple(found)


def _is_ring(rows: list[Row], nothing: float) -> bool:
    """Whether the last vertex repeats the first one, as GIS writes rings; no side begins there, so it has no bulge."""
    if len(rows) < 3:
        return False
    (x0, y0, _bulge), (x1, y1, bulge) = rows[0], rows[-1]
    return bulge == 0.0 and math.hypot(x1 - x0, y1 - y0) <= nothing


def _reversed(rows: tuple[Row, ...]) -> list[Row]:
    """Return the outline in the opposite sense: the bulge of a side is then at its other vertex."""
    turned = rows[::-1]
    return [(x, y, -turned[(k + 1) % len(turned)][2]) for k, (x, y, _bulge) in enumerate(turned)]


def _sides_of(rows: Floats) -> Edges:
    """Return the sides; an arc of more than half a circle is two of them."""
    start, end, bulge = rows[:, :2], np.roll(rows[:, :2], -1, axis=0), rows[:, 2]
    pieces = []
    for k in range(len(rows)):
        if abs(bulge[k]) <= 1.0:
            pieces.append((start[k], end[k], bulge[k], k))
            continue
        chord = end[k] - start[k]
        top = 0.5 * (start[k] + end[k]) + 0.5 * bulge[k] * np.array([chord[1], -chord[0]])
        # tan(u/2) of tan(u)
        half = bulge[k] / (1.0 + math.hypot(1.0, bulge[k]))
        pieces += [(start[k], top, half, k), (top, end[k], half, k)]
    a, b = np.array([piece[0] for piece in pieces]), np.array([piece[1] for piece in pieces])
    u, which = np.array([piece[2] for piece in pieces]), np.array([piece[3] for piece in pieces])
    chord = b - a
    width = np.hypot(chord[:, 0], chord[:, 1])
    ahead = chord / width[:, None]
    # Half of the angle of the arc
    sine, cosine = 2.0 * u / (1.0 + u * u), (1.0 - u * u) / (1.0 + u * u)
    ahead, behind = _turned(ahead, cosine, -sine), _turned(ahead, cosine, sine)
    normal = np.stack([ahead[:, 1], -ahead[:, 0]], axis=1)
    bent = sine != 0.0
    length = np.where(bent, 2.0 * np.arctan(u) * width / np.where(bent, sine, 1.0), width)
    return Edges(a, b, normal, 2.0 * sine / width, ahead, behind, length, which)


def _turned(vectors: Floats, cosine: Floats, sine: Floats) -> Floats:
    x, y = vectors.T
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1)


def _area(sides: Edges) -> float:
    (x0, y0), (x1, y1), k = sides.start.T, sides.end.T, sides.curvature
    # For an arc, the area between it and its chord: (angle - sin(angle))/(2 k^2)
    angle = k * sides.length
    bent = k != 0.0
    caps = np.where(bent, (angle - np.sin(angle)) / np.where(bent, 2.0 * k * k, 1.0), 0.0)
    return float(0.5 * (x0 * y1 - x1 * y0).sum() + caps.sum())


# --- Whether two sides cross -----------------------------------------------------------------------------


def _require_apart(name: str, sides: Edges, nothing: float) -> None:
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
    """Return the two points that each pair of lines or circles has in common, or NaN."""
    with np.errstate(all="ignore"):
        ka, kb = a.curvature, b.curvature
        # A line through both points: kb La - ka Lb has no square; for two lines it is one of the lines.
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
        # Along that line, the level of a curved side, or of the second line
        use_b = (kb != 0.0) | straight
        n, k, c = np.where(use_b[:, None], nb, a.normal), np.where(use_b, kb, ka), np.where(use_b, cb, 0.0)
        level = c + along(n, foot) + 0.5 * k * along(foot, foot)
        slope = along(n, way) + k * along(foot, way)
        root = np.sqrt(slope * slope - 2.0 * k * level)
        q = -(slope + np.copysign(root, slope))
        times = np.where(k == 0.0, -level / slope, q / k), np.where(k == 0.0, np.nan, 2.0 * level / q)
        return [a.start + foot + t[:, None] * way for t in times]
