"""Which walls balls may meet, for their placement and for runs."""

import math

from ..errors import SceneError
from ..scene import Scene
from ..state import Floats
from ..surfaces.surface import Surface, named, shown


def _nearest_lid(scene: Scene, surface: Surface) -> float:
    """Return the distance of the nearest wall parallel to the plane of a scene, infinite without such walls [m]."""
    across = scene.across()
    if across is None:
        return math.inf
    return min(surface.lids(across), default=math.inf)


def require_shapes(scene: Scene, radius: Floats) -> None:
    """Raise a `SceneError` if balls with these radii may not meet a surface of the scene."""
    for i, surface in enumerate(scene.surfaces):
        why = surface.why_no_balls()
        if why is not None:
            raise SceneError(
                f"surfaces[{i}] must be one that particles with a radius may meet, got {type(surface).__name__}, "
                f"{why}; they may meet Sphere, Plane, Slab, Box, Cylinder, Capsule, Torus, Cone, Ellipsoid, Quadric, "
                "Paraboloid, Formula, OwnSurface, Sampled, Polygon, Stadium, Prism and Mesh, fields and intersections "
                "of these; make it of such surfaces, or leave the radius out"
            )
        largest = int(radius.argmax())
        lid = _nearest_lid(scene, surface)
        if lid < radius[largest]:
            raise SceneError(
                f"{named(i, surface)} must be as far from the plane as the largest radius, "
                f"{radius[largest]:g} m of particle {largest}, at its walls parallel to the plane, got {lid:g} m; make "
                f"it endless, or longer along {scene.plane}"
            )
        if not radius[largest] < surface.largest_ball():
            where = surface.most_bent_at()
            sure = "" if where is None else f" that is certain, that at {shown(where)},"
            raise SceneError(
                f"radius must be below {surface.largest_ball():.6g} m, the smallest radius of curvature{sure} of "
                f"{named(i, surface)}, so that no ball touches it at several points at once, got "
                f"{radius[largest]:g} m of particle {largest}; use smaller balls, or a rounder surface{_surer(surface)}"
            )


def _surer(surface: Surface) -> str:
    """Return advice on how a larger radius of curvature becomes certain, if only second derivatives bound it."""
    bounds = [part.curvature for part in surface.surfaces() if hasattr(part, "curvature")]
    if not bounds:
        return ""
    if None in bounds:
        return ", or give `curvature`, or closer `bounds`, by which a larger radius may be certain"
    return ", or a smaller `curvature` where that is true"
