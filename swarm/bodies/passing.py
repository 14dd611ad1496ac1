"""Whether a solid can pass between the contact points of a body, which alone touch walls; said before the run."""

import logging
import math

from ..scene import Scene
from ..surfaces.fields.bodies import Boxes, Cylinders
from ..surfaces.fields.many import Many
from ..surfaces.shapes.box import Box
from ..surfaces.shapes.cone import Cone
from ..surfaces.shapes.cylinder import Cylinder
from ..surfaces.shapes.slab import Slab
from ..surfaces.surface import Surface
from . import covering
from .body import Body

_LOG = logging.getLogger("swarm")
# What a solid may enter by, between contact points, in half thicknesses of it or of the body, whichever is thinner.
_ENTERS = 0.25
# Points of a lattice of triangles with sides of 1 leave no gap of a larger radius; it is found to so much.
_GAP = 1.25 / math.sqrt(3.0)


def warn(scene: Scene, body: Body) -> None:
    """Warn where a solid can enter a face of the body, or pass it, without touching a contact point."""
    solids = [(i, surface) for i, surface in enumerate(scene.surfaces) if _is_solid(surface)]
    if not solids or not len(body.faces):
        return
    gap, thin = covering.distance(body), covering.thickness(body)
    i, surface = max(solids, key=lambda one: _depth(one[1], gap) / (_ENTERS * min(one[1].size(), thin)))
    size, depth = surface.size(), _depth(surface, gap)
    allowed = _ENTERS * min(size, thin)
    if depth <= allowed:
        return
    # The gap at which it would enter by what is allowed.
    wanted = allowed if _has_corners(surface) else math.sqrt(allowed * (2.0 * size - allowed))
    what = "pass through the body" if gap >= size else f"enter the body by {depth:.2g} m"
    _LOG.warning(
        "surfaces[%d] (%s) can %s without an impact: only contact points touch walls, and a face of the body has "
        "places %.2g m away from them; give it more of them: contacts = %.1g [m] of rigid, or a finer mesh of elastic",
        i, type(surface).__name__, what, gap, _rounded(wanted / _GAP),
    )  # fmt: skip


def _is_solid(surface: Surface) -> bool:
    # Between two parallel planes a body has all of its contact points on one side.
    return (surface.is_solid() or isinstance(surface, Many)) and not isinstance(surface, Slab)


def _has_corners(surface: Surface) -> bool:
    return isinstance(surface, (Box, Boxes, Cone, Cylinders)) or (
        isinstance(surface, Cylinder) and surface.length is not None
    )


def _depth(surface: Surface, gap: float) -> float:
    """By how much a solid enters a plane between points that leave a circle of radius `gap` free [m]."""
    size = surface.size()
    if gap >= size:
        return math.inf
    return gap if _has_corners(surface) else size - math.sqrt(size * size - gap * gap) if size < math.inf else 0.0


def _rounded(value: float) -> float:
    """Down to one digit."""
    unit = 10.0 ** math.floor(math.log10(value))
    return math.floor(value / unit) * unit
