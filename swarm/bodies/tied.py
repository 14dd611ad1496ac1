"""Whether a body can move as its links and its led points ask: which links are redundant, which paths too long."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..errors import SceneError
from ..motion import Led, Motion, led
from ..particles import Floats
from .checked import Pairs

# Links depend on each other where their directions agree to the square root of this: their system of equations has
# the inverse of it as condition, and multipliers have no digit then.
_DEPENDENT = 1e-12
# A link takes part in a dependence if its share of it is not round-off.
_SHARE = 1e-5
# Errors of distances that are round-off, relative.
_ROUND_OFF = 1e-9
# Instants and periods at which led points are looked at. Two motions of different rates meet in all ways in some
# tens of periods of the slower one.
_INSTANTS, _PERIODS = 4001, 20.0
# So many are named in a sentence.
_NAMED = 12


def require_independent(
    points: Floats, links: Pairs, anchors: Mapping[int, Any], guides: Sequence[tuple[int, Any]]
) -> None:
    """Raise unless the forces of links and guides are determined: their directions must be independent."""
    names = [f"links[{k}] {tuple(pair)}" for k, pair in enumerate(links.tolist())]
    names += [f"guides[{k}] (point {guide[0]})" for k, guide in enumerate(guides)]
    if not names:
        return
    null = _dependences(points, links, anchors, guides)
    if not null.shape[1]:
        return
    involved = [name for name, row in zip(names, np.abs(null), strict=True) if row.max() > _SHARE]
    said = ", ".join(involved[:_NAMED]) + (f" and {len(involved) - _NAMED} more" if len(involved) > _NAMED else "")
    # Somewhere else the same links may be independent: then it is the place of the points that is special.
    size = np.ptp(points, axis=0).max()
    elsewhere = points + 0.1 * size * np.random.default_rng(0).standard_normal(points.shape)
    excess = null.shape[1]
    if _dependences(elsewhere, links, anchors, guides).shape[1] < excess:
        raise SceneError(
            f"links and guides must be independent, got {said}, whose directions depend on each other where the points "
            "are (in a line or in a plane, say): their forces are not determined; leave out "
            f"{excess} of them, or move a point"
        )
    raise SceneError(
        f"links and guides must be independent, got {said}, of which {excess} {'follows' if excess == 1 else 'follow'} "
        f"from the others: their forces are not determined; leave out {excess} of them"
    )


def _dependences(points: Floats, links: Pairs, anchors: Mapping[int, Any], guides: Sequence[tuple[int, Any]]) -> Floats:
    """(links + guides, D) combinations of the constraints' directions that vanish."""
    directions = np.zeros((len(links) + len(guides), *points.shape))
    every = np.arange(len(links))
    apart = points[links[:, 0]] - points[links[:, 1]]
    directions[every, links[:, 0]], directions[every, links[:, 1]] = apart, -apart
    for k, (point, surface) in enumerate(guides, start=len(links)):
        directions[k, point] = surface.gradient(points[point, :, None])[:, 0]
    directions[:, list(anchors)] = 0.0
    rows = directions.reshape(len(directions), -1)
    rows /= np.maximum(np.sqrt((rows**2).sum(axis=1)), np.finfo(np.float64).tiny)[:, None]
    values, vectors = np.linalg.eigh(rows @ rows.T)
    return vectors[:, values < _DEPENDENT]


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
    reach = _reach(points, links)
    led_points = sorted(paths)
    for i, j in ((i, j) for i in led_points for j in led_points if i < j and np.isfinite(reach[i, j])):
        farthest = _distances(paths[i], paths[j], drift=False).max()
        if farthest > reach[i, j] * (1.0 + _ROUND_OFF):
            raise SceneError(
                f"anchors[{i}] and anchors[{j}] must stay within the reach of the links between them, "
                f"{reach[i, j]:g} m, but are led up to {farthest:g} m apart; shorten the path, or lengthen the links"
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


def _reach(points: Floats, links: Pairs) -> Floats:
    """(P, P) lengths of the shortest ways from point to point along links."""
    reach = np.full((len(points),) * 2, np.inf)
    np.fill_diagonal(reach, 0.0)
    i, j = links.T
    reach[i, j] = reach[j, i] = np.sqrt(((points[i] - points[j]) ** 2).sum(axis=1))
    for middle in range(len(points)):
        reach = np.minimum(reach, reach[:, middle, None] + reach[middle])
    return reach
