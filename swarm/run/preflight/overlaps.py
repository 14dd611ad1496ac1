"""Cavities of a scene that overlap only in part: particles live in what they have in common; said before the run."""

import itertools
import logging
import math

import numpy as np
from numpy.typing import NDArray

from ...scene import Scene
from ...surfaces.instant import box_of, gaps_of
from ...surfaces.surface import Surface

_LOG = logging.getLogger("swarm")
# Points at which two cavities are compared, and the part of one beyond the other that says that it is cut.
_POINTS, _CUT = 4096, 0.01


def warn_of_overlap(scene: Scene) -> None:
    """Warn of the first two cavities, each bounded by itself, of which neither is inside the other."""
    boxes = [_box_in(scene, one) for one in scene.surfaces]
    bounded = [(i, one) for i, one in enumerate(scene.surfaces) if _is_cavity(one) and np.isfinite(boxes[i]).all()]
    for (i, one), (j, other) in itertools.combinations(bounded, 2):
        if _are_there_together(one, other) and _cut_one_another(one, other, np.array([boxes[i], boxes[j]])):
            _LOG.warning(
                "surfaces[%d] (%s) and surfaces[%d] (%s) overlap only in part: particles are kept in what they have in "
                'common; a vessel of both is one surface, swarm.Union([...]), in a scene file kind = "union"',
                i, type(one).__name__, j, type(other).__name__,
            )  # fmt: skip
            return


def _is_cavity(surface: Surface) -> bool:
    return not surface.is_solid() and getattr(surface, "side", "inside") == "inside"


def _box_in(scene: Scene, surface: Surface) -> NDArray[np.float64]:
    """The bounds of a surface at 0 s, and of its part in the plane of a scene of two dimensions."""
    box = np.array(box_of(surface, 0.0))
    if (across := scene.across()) is not None:
        box[:, across] = 0.0
    return box


def _are_there_together(one: Surface, other: Surface) -> bool:
    """Whether two surfaces are there at one time."""
    always = ((0.0, math.inf),)
    pairs = itertools.product(one.present or always, other.present or always)
    return any(max(begins) < min(ends) for begins, ends in (zip(*pair, strict=True) for pair in pairs))


def _cut_one_another(one: Surface, other: Surface, boxes: NDArray[np.float64]) -> bool:
    """Whether a part of each of two cavities, with these bounds, is outside of the other one at 0 s."""
    low, high = boxes[:, 0].min(axis=0)[:, None], boxes[:, 1].max(axis=0)[:, None]
    points = low + (high - low) * np.random.default_rng(0).random((3, _POINTS))
    with np.errstate(all="ignore"):
        inside, inside_other = (gaps_of((surface,), points, 0.0)[0] <= 0.0 for surface in (one, other))
    mine, theirs = int((inside & ~inside_other).sum()), int((inside_other & ~inside).sum())
    return bool(mine > _CUT * inside.sum() and theirs > _CUT * inside_other.sum())
