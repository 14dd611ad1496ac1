"""The ties of a body, links and guides: which of them are redundant, and which paths of led points are too long."""

import heapq
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..errors import SceneError
from ..kernel.limits import EPSILON
from ..motion import Led, Motion, led
from ..state import Floats
from ..surfaces.rotation import normalized
from ..surfaces.surface import Surface
from .checked import Pairs, modes_unless_above

# Links depend on each other where their directions agree to the square root of this: their system of equations has
# the inverse of it as condition, and multipliers have no digit then.
_DEPENDENT = 1e-12
# Directions at a point are clearly independent where no eigenvalue of their products is below this: an angle of 8
# degrees between two.
_CLEAR = 1e-2
# A link takes part in a dependence if its share of it is not round-off.
_SHARE = 1e-5
# Errors of distances that are round-off, relative.
_ROUND_OFF = 1e-9
# Instants and periods at which led points are looked at. Two motions of different rates meet in all ways in some
# tens of periods of the slower one.
_INSTANTS, _PERIODS = 4001, 20.0
# So many are named in a sentence.
_NAMED = 12


class Tie(NamedTuple):
    """A link or a guide: along its normal its point has no velocity, or its two points have the same.

    Attributes:
        name: "links[0]" or "guides[0]".
        points: the two points of a link, or the one in a guide.
        normal: (3, n) unit vectors of n copies; a link's is that of its first point, its second has the opposite.
        surface: of the guide.
    """

    name: str
    points: tuple[int, ...]
    normal: Floats
    surface: Surface | None = None

    def ends(self) -> Iterator[tuple[int, float]]:
        """Its points, each with the sign of its normal."""
        return zip(self.points, (1.0, -1.0), strict=False)


def ties(links: Pairs, guides: Sequence[tuple[int, Surface]], position: Floats) -> Iterator[Tie]:
    """The links and guides of n copies with points at `position` (3, P, n)."""
    # One at a time: of many copies each is large.
    for k, (i, j) in enumerate(links.tolist()):
        yield Tie(f"links[{k}]", (i, j), normalized(position[:, i] - position[:, j]))
    for k, (point, surface) in enumerate(guides):
        slope = surface.gradient(np.ascontiguousarray(position[:, point]))
        yield Tie(f"guides[{k}]", (point,), normalized(slope), surface)


def require_independent(
    points: Floats, links: Pairs, anchors: Mapping[int, Any], guides: Sequence[tuple[int, Surface]]
) -> None:
    """Raise unless the forces of links and guides are determined: their directions must be independent."""
    given = list(ties(links, guides, points.T[:, :, None]))
    left = _left(given, anchors, len(points))
    null = _dependences([given[k] for k in left], anchors)
    excess = null.shape[1]
    if not excess:
        return
    names = [
        f"{tie.name} {tie.points}" if tie.surface is None else f"{tie.name} (point {tie.points[0]})" for tie in given
    ]
    involved = [names[k] for k, row in zip(left, np.abs(null), strict=True) if row.max() > _SHARE]
    listing = ", ".join(involved[:_NAMED]) + (f" and {len(involved) - _NAMED} more" if len(involved) > _NAMED else "")
    # Somewhere else the same links may be independent: then it is the place of the points that is special.
    size = np.ptp(points, axis=0).max()
    elsewhere = points + 0.1 * size * np.random.default_rng(0).standard_normal(points.shape)
    moved = list(ties(links, guides, elsewhere.T[:, :, None]))
    if _dependences([moved[k] for k in left], anchors).shape[1] < excess:
        raise SceneError(
            f"links and guides must be independent, got {listing}: their directions depend on each other where the "
            "points are (in a line or in a plane, say): their forces are not determined; leave out "
            f"{excess} of them, or move a point"
        )
    raise SceneError(
        f"links and guides must be independent, got {listing}, of which {excess} "
        f"{'follows' if excess == 1 else 'follow'} from the others: their forces are not determined; leave "
        f"out {excess} of them"
    )


def _left(given: Sequence[Tie], anchors: Mapping[int, Any], count: int) -> list[int]:
    """The ties of one body with an independence that is not seen point by point: of a chain or a tree none.

    Where those at a point, at most three, are clearly independent of each other, no others can be combined to cancel
    them there: they take part in no dependence, and are left out, with what that frees at their other ends.
    """
    at: list[dict[int, Floats]] = [{} for _point in range(count)]
    for number, tie in enumerate(given):
        for point in set(tie.points) - set(anchors):
            at[point][number] = tie.normal[:, 0]
    left, waiting = dict.fromkeys(range(len(given))), list(range(count))
    while waiting:
        point = waiting.pop()
        rows = np.array(list(at[point].values()))
        if 0 < len(rows) <= 3 and np.linalg.eigvalsh(rows @ rows.T)[0] > _CLEAR:
            for number in list(at[point]):
                del left[number]
                for end in given[number].points:
                    at[end].pop(number, None)
                    waiting.append(end)
    return list(left)


def _dependences(given: Sequence[Tie], anchors: Mapping[int, Any]) -> Floats:
    """(ties, D) combinations of the directions of ties of one body that vanish."""
    free = sorted({point for tie in given for point in tie.points} - set(anchors))
    place = {point: k for k, point in enumerate(free)}
    directions = np.zeros((len(given), len(free), 3))
    for row, tie in zip(directions, given, strict=True):
        for point, sign in tie.ends():
            if point in place:
                row[place[point]] = sign * tie.normal[:, 0]
    rows = normalized(directions.reshape(len(given), 3 * len(free)), 1)
    # All clearly independent where no eigenvalue is below this, round-off and all.
    bound = 10.0 * _DEPENDENT + 8.0 * len(given) * EPSILON
    modes = modes_unless_above(bound, rows @ rows.T) if given else None
    return np.zeros((len(given), 0)) if modes is None else modes[1][:, modes[0] < _DEPENDENT]


def require_reachable(points: Floats, links: Pairs, anchors: Mapping[int, Motion | None]) -> None:
    """Raise if led points leave each other farther than their links allow."""
    if len(anchors) < 2 or not len(links):
        return
    paths = {point: led(motion, points[point]) for point, motion in anchors.items()}
    for k, (i, j) in enumerate(links.tolist()):
        if i in paths and j in paths:
            apart = _distances(paths[i], paths[j])
            if np.ptp(apart) > _ROUND_OFF * apart.max():
                raise SceneError(
                    f"links[{k}], {(i, j)}, must keep its length, {apart[0]:g} m, but both its points are led, from "
                    f"{apart.min():g} to {apart.max():g} m apart; lead one of them, or both alike"
                )
            raise SceneError(
                f"links[{k}], {(i, j)}, must tie a point that can move, got two that are anchored; leave it out"
            )
    # Fixed points are where they are, and there the links have their lengths.
    moving = [point for point in sorted(paths) if anchors[point] is not None]
    for i in moving:
        reach = _reach(points, links, i)
        for j in (j for j in sorted(paths) if j in reach and j != i and not (j in moving and j < i)):
            farthest = _distances(paths[i], paths[j], drift=False).max()
            if farthest > reach[j] * (1.0 + _ROUND_OFF):
                first, second = sorted((i, j))
                raise SceneError(
                    f"anchors[{first}] and anchors[{second}] must stay within the reach of the links between them, "
                    f"{reach[j]:g} m, but are led up to {farthest:g} m apart; shorten the path, or lengthen the links"
                )


def _distances(first: Led, second: Led, drift: bool = True) -> Floats:
    """Distance of two led points at many instants.

    Without drift: 0 where their steady velocities differ, since then it depends on how long the run is.
    """
    rates = [abs(path.rate) for path in (first, second) if path.rate]
    slowest = min(rates, default=1.0)
    times = np.linspace(0.0, _PERIODS * 2.0 * np.pi / slowest, _INSTANTS)
    if not drift and (first.velocity != second.velocity).any():
        return np.zeros(1)
    return np.asarray(np.sqrt(((first.position(times) - second.position(times)) ** 2).sum(axis=0)))


def _reach(points: Floats, links: Pairs, start: int) -> dict[int, float]:
    """The lengths of the shortest ways along links from a point, to each that can be reached (Dijkstra)."""
    lengths = np.sqrt(((points[links[:, 0]] - points[links[:, 1]]) ** 2).sum(axis=1)).tolist()
    ways: dict[int, list[tuple[float, int]]] = {}
    for (i, j), length in zip(links.tolist(), lengths, strict=True):
        ways.setdefault(i, []).append((length, j))
        ways.setdefault(j, []).append((length, i))
    found: dict[int, float] = {}
    waiting = [(0.0, start)]
    while waiting:
        length, point = heapq.heappop(waiting)
        if point not in found:
            found[point] = length
            for part, end in ways.get(point, ()):
                heapq.heappush(waiting, (length + part, end))
    return found
