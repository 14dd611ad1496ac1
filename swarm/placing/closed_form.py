"""The volume of a scene in closed form, if that is certain."""

import itertools
import math
from typing import NamedTuple

import numpy as np

from ..scene import Scene
from ..state import Floats
from ..surfaces.surface import Surface


class Occupied(NamedTuple):
    """A solid, and a box around it along the axes of the scene."""

    solid: Surface
    middle: Floats
    half: Floats  # extents


def closed_form(scene: Scene) -> float | None:
    """Return the admissible volume at 0 s [m^3], in a scene with a plane the area [m^2], or None.

    It is the volume of one cavity, or of a periodic cell, minus that of solids within it that do not overlap.
    """
    there = [surface for surface in scene.surfaces if surface.is_there(0.0)]
    cavities = [surface for surface in there if not surface.is_solid()]
    enclosed = [surface.enclosed(scene.across()) for surface in there]
    period = None if scene.period is None else [scene.period[k] for k in scene.axes()]
    if len(cavities) != (period is None) or None in enclosed or None in (period or ()):
        return None
    if len(there) > len(cavities):
        lengths = None if period is None else np.array(period)
        solids = [_occupied(scene, surface) for surface in there if surface.is_solid()]
        within = bool(cavities) and all(_is_within(scene, cavities[0], one) for one in solids)
        fits = lengths is not None and all((2.0 * one.half <= lengths).all() for one in solids)
        apart = all(_are_apart(*pair, lengths) for pair in itertools.combinations(solids, 2))
        if any(surface.motion is not None for surface in there) or not (apart and (within or fits)):
            return None
    whole = 0.0 if period is None else math.prod(length for length in period if length is not None)
    parts = zip(there, (part for part in enclosed if part is not None), strict=True)
    return whole + sum(-part if surface.is_solid() else part for surface, part in parts)


def _occupied(scene: Scene, solid: Surface) -> Occupied:
    low, high = (np.array(corner)[scene.axes()] for corner in solid.enclosing_box())
    return Occupied(solid, 0.5 * (low + high), 0.5 * (high - low))


def _is_within(scene: Scene, cavity: Surface, one: Occupied) -> bool:
    """Whether a solid is certainly within a cavity."""
    if not cavity.is_convex:
        return False
    if (radius := one.solid.radius_of_ball()) is not None and cavity.why_no_balls() is None:
        return bool((cavity.reaching_outside(_whole(scene, one.middle[:, None]), np.array([radius])) <= 0.0).all())
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=len(one.middle)))).T
    return bool(cavity.admits(_whole(scene, one.middle[:, None] + one.half[:, None] * signs)).all())


def _whole(scene: Scene, points: Floats) -> Floats:
    """Return points (3, N) in space, from their coordinates along the axes of a scene."""
    whole = np.zeros((3, points.shape[1]))
    whole[scene.axes()] = points
    return whole


def _are_apart(one: Occupied, other: Occupied, lengths: Floats | None) -> bool:
    """Whether two solids, and their images in a cell with these lengths, certainly do not overlap."""
    between = np.abs(one.middle - other.middle)
    if lengths is not None:
        between = np.abs(between - lengths * np.round(between / lengths))
    radii = one.solid.radius_of_ball(), other.solid.radius_of_ball()
    if radii[0] is not None and radii[1] is not None:
        return math.hypot(*between) >= radii[0] + radii[1]
    return bool((between >= one.half + other.half).any())
