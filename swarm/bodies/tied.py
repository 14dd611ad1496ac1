"""The ties of a body, links and guides: checks for redundant ties, and for paths of led points that are too long."""

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

# Links are dependent where their directions agree to the square root of this. The condition of their system of
# equations is then the inverse of this number, and multipliers have no digit.
_DEPENDENT = 1e-12
# Directions at a point are clearly independent where no eigenvalue of their products is below this: between two
# directions, an angle of 8 degrees.
_CLEAR = 1e-2
# A link takes part in a dependence if its coefficient is above this round-off.
_SHARE = 1e-5
# The relative round-off of distances.
_ROUND_OFF = 1e-9
# The instants at which led points are compared, and the periods that they cover. Two motions of different rates reach
# nearly all relative phases in some tens of periods of the slower one.
_INSTANTS, _PERIODS = 4001, 20.0
# The most ties that a sentence names.
_NAMED = 12


class Tie(NamedTuple):
    """A link or a guide: its two points have the same velocity along its normal, or its one point has none.

    Attributes:
        name: "links[0]" or "guides[0]".
        points: the two points of a link, or the one point of a guide.
        normal: (3, n) unit vectors of n copies, at the first point of a link; the second point has the opposite one.
        surface: the surface of a guide, None for a link.
    """

    name: str
    points: tuple[int, ...]
    normal: Floats
    surface: Surface | None = None

    def ends(self) -> Iterator[tuple[int, float]]:
        """The points of the tie, each with the sign of its normal."""
        return zip(self.points, (1.0, -1.0), strict=False)


def ties(links: Pairs, guides: Sequence[tuple[int, Surface]], position: Floats) -> Iterator[Tie]:
    """Yield the links and guides of n copies with points at `position` (3, P, n)."""
    # One at a time, as the normals of many copies are large.
    for k, (i, j) in enumerate(links.tolist()):
        yield Tie(f"links[{k}]", (i, j), normalized(position[:, i] - position[:, j]))
    for k, (point, surface) in enumerate(guides):
        slope = surface.gradient(np.ascontiguousarray(position[:, point]))
        yield Tie(f"guides[{k}]", (point,), normalized(slope), surface)


def require_independent(
    points: Floats, links: Pairs, anchors: Mapping[int, Any], guides: Sequence[tuple[int, Surface]]
) -> None:
    """Raise a `SceneError` unless the directions of links and guides are independent, so that forces are determined."""
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
    # If the same links are independent elsewhere, the places of the points are special.
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
    """Return the ties of a body with an independence that is not evident point by point: none in a chain or a tree.

    If the ties at a point, at most three, are clearly independent, no combination cancels there: these ties take part
    in no dependence, and are left out. Then the points at their other ends have fewer ties.
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
    """Return the combinations (ties, D) of the directions of ties of one body that vanish."""
    free = sorted({point for tie in given for point in tie.points} - set(anchors))
    place = {point: k for k, point in enumerate(free)}
    directions = np.zeros((len(given), len(free), 3))
    for row, tie in zip(directions, given, strict=True):
        for point, sign in tie.ends():
            if point in place:
                row[place[point]] = sign * tie.normal[:, 0]
    rows = normalized(directions.reshape(len(given), 3 * len(free)), 1)
    # All directions are independent if no eigenvalue is below this bound, which includes round-off.
    bound = 10.0 * _DEPENDENT + 8.0 * len(given) * EPSILON
    modes = modes_unless_above(bound, rows @ rows.T) if given else None
    return np.zeros((len(given), 0)) if modes is None else modes[1][:, modes[0] < _DEPENDENT]


def require_reachable(points: Floats, links: Pairs, anchors: Mapping[int, Motion | None]) -> None:
    """Raise a `SceneError` if led points move farther apart than their links allow."""
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
    # The distances between fixed points never change, so that one of each pair must be led.
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
    """The distances of two led points at many instants.

    If not `drift`: 0 if their steady velocities differ, as the largest distance then depends on the length of the run.
    """
    rates = [abs(path.rate) for path in (first, second) if path.rate]
    slowest = min(rates, default=1.0)
    times = np.linspace(0.0, _PERIODS * 2.0 * np.pi / slowest, _INSTANTS)
    if not drift and (first.velocity != second.velocity).any():
        return np.zeros(1)
    return np.asarray(np.sqrt(((first.position(times) - second.position(times)) ** 2).sum(axis=0)))


def _reach(points: Floats, links: Pairs, start: int) -> dict[int, float]:
    """The lengths of the shortest ways along links from a point to each point that can be reached (Dijkstra)."""
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
