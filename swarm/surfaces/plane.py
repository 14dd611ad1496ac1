"""Scenes of two dimensions: the plane through the origin that particles stay in, and checks that nothing leaves it.

Seen from the tip of the axis across it, a plane has its first direction to the right and its second one upwards: x and
y across z, y and z across x, z and x across y.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..common import checks
from ..errors import SceneError
from ..kernel.limits import TINY
from ..kernel.vector import vec
from ..motion import Guide, Oscillation, Path, Rotation, Translation, parts_of
from ..state import Floats
from .facets.mesh import Mesh
from .fields.many import ManyBodies
from .outlines.outlined import Outlined
from .shapes.slab import AXES
from .shapes.sphere import Sphere
from .surface import Surface, shown, slopes_of
from .upright import upright
from .wall_law import leave_of, tries_of

# The number of the axis across each plane.
PLANES: dict[str | None, int] = {"x": 0, "y": 1, "z": 2}
# The number of points from which the search for places of a wall in the plane starts, its steps, and the distance
# that is near to a wall, as a part of the extent of the scene.
_STARTS, _STEPS, _NEAR = 2048, 40, 1e-9
# A component of a unit normal across the plane up to this size counts as 0, as in the kernels.
_ROUND_OFF = 1e-13


def checked(plane: Any) -> str | None:
    """Return the argument `plane`, checked."""
    return None if plane is None else checks.one_of("plane", plane, "xyz")


def along(across: int) -> tuple[int, int]:
    """The axes of a plane, to the right and upwards as it is seen from the tip of the axis across it."""
    return (across + 1) % 3, (across + 2) % 3


def shown_as(across: int, points: Any) -> Any:
    """Return points (..., 3) as they are seen in the plane: (..., 2)."""
    return np.asarray(points)[..., list(along(across))]


# --- Checks that nothing leaves it ------------------------------------------------------------------------


def require_all(
    plane: str, surfaces: Sequence[Surface], gravity: Sequence[float] | None, lengths: Sequence[float | None] | None
) -> None:
    """Raise a `SceneError` where gravity, a wall or a motion would send particles out of the plane."""
    if gravity is not None:
        _require_pull(plane, gravity)
    repeated = [one for one in lengths or () if one is not None]
    farthest = max((*(surface.extent() for surface in surfaces), *repeated), default=0.0)
    _require_walls(plane, surfaces, 2.0 * farthest or 1.0)


def _require_pull(plane: str, gravity: Sequence[float]) -> None:
    """Raise a `SceneError` where gravity pulls out of the plane."""
    across = PLANES[plane]
    if gravity[across] != 0.0:
        raise SceneError(
            f'gravity[{across}] must be 0 where plane = "{plane}", got {gravity[across]:g} m/s^2: it would pull '
            "particles out of the plane; give gravity along the plane"
        )


def require_start(scene: Any, particles: Any, mend: str = "") -> None:
    """Raise a `SceneError` if a particle starts out of the plane, or with a velocity or spin that leads out."""
    across = PLANES.get(scene.plane)
    if across is None:
        return
    for what, rows, unit in (("start", particles.position, "m"), ("velocity", particles.velocity, "m/s")):
        off = np.flatnonzero(rows[across])
        if off.size:
            k = int(off[np.argmax(np.abs(rows[across, off]))])
            where = "out of it" if what == "start" else "with a velocity out of it"
            row = f"particles.{'position' if what == 'start' else 'velocity'}[{across}]"
            raise SceneError(
                f'particles must be in the plane {scene.plane} = 0 of a scene with plane = "{scene.plane}", got '
                f"{off.size} of {rows.shape[1]} {where}; the farthest is particle {k}, by {rows[across, k]:g} {unit}; "
                f"{mend or f'set {row} to 0, or use swarm.fill'}"
            )
    if particles.spin is None:
        return
    for axis in along(across):
        off = np.flatnonzero(particles.spin[axis])
        if off.size:
            raise SceneError(
                f'particles.spin[{axis}] must be 0 in a scene with plane = "{scene.plane}", got '
                f"{particles.spin[axis, off[0]]:g} rad/s of particle {off[0]}: friction would send it out of the "
                f"plane; discs turn about {scene.plane} alone, spin[{across}]"
            )


def _require_walls(plane: str, surfaces: Sequence[Surface], reach: float) -> None:
    """Raise a `SceneError` where a wall, or its motion, would send particles out of the plane.

    `reach` is the distance from the origin within which walls are checked [m].
    """
    across = PLANES[plane]
    for i, surface in enumerate(surfaces):
        for piece in surface.surfaces():
            _require_motion(plane, f"surfaces[{i}].motion", piece)
            _require_laws(plane, f"surfaces[{i}].laws", piece)
        if isinstance(surface, Mesh):
            raise SceneError(
                f'surfaces[{i}] must stand upright on the plane {plane} = 0 where plane = "{plane}", got a Mesh: '
                "it is not known whether its triangles do; use swarm.Polygon, with the corners of its section"
            )
        if isinstance(surface, Outlined):
            _require_upright(plane, i, surface)
            continue
        places, part = _walls_in(surface, across, reach)
        leaning = np.flatnonzero(part)
        if leaning.size:
            k = int(leaning[np.argmax(np.abs(part[leaning]))])
            name = type(surface).__name__
            raise SceneError(
                f'surfaces[{i}] must stand upright on the plane {plane} = 0 where plane = "{plane}", got {name}: its '
                f"normal at {shown(places[:, k])} m is {_size(part[k])} out of the plane and would send particles out "
                f"of it; {_mended(surface, across)}"
            )


def _require_upright(plane: str, i: int, surface: Outlined) -> None:
    """Raise a `SceneError` if an outline does not stand upright on the plane."""
    if surface.across != PLANES[plane]:
        raise SceneError(
            f'surfaces[{i}] must stand upright on the plane {plane} = 0 where plane = "{plane}", got '
            f"{type(surface).__name__} with its axis along {shown(surface.frame[:, 2])}; give it axis = "
            f"{tuple(float(name == plane) for name in PLANES)}, and turn it about that"
        )


def _size(part: float) -> str:
    return f"{math.degrees(math.asin(min(1.0, abs(part)))):.3g} degrees"


def _mended(surface: Surface, across: int) -> str:
    center = getattr(surface, "center", None)
    name = "xyz"[across]
    if center is not None and center[across] != 0.0:
        return f"give it a center with {name} = 0, got {center[across]:g} m"
    if isinstance(surface, ManyBodies):
        return f"give all its bodies centers with {name} = 0, and axes along the plane or across it"
    return f"give it a normal or axes along the plane or along {name}, without round-off"


def _walls_in(surface: Surface, across: int, reach: float) -> tuple[Floats, Floats]:
    """Return places (3, N) of a wall in the plane, and the component of its unit normal across the plane (N,)."""
    points = _starts(surface, across, reach)
    with np.errstate(all="ignore"):
        for _step in range(_STEPS):
            phi, slope = _level(surface, across, points)
            slope[across] = 0.0
            way = phi / np.maximum((slope**2).sum(axis=0), TINY) * slope
            length = np.sqrt((way**2).sum(axis=0))
            way = way * np.minimum(1.0, reach / np.maximum(length, TINY))
            points = points - np.where(np.isfinite(way), way, 0.0)
        phi, slope = _level(surface, across, points)
        steep = np.sqrt((slope**2).sum(axis=0))
        part = slope[across] / steep
        if isinstance(surface, ManyBodies) and surface.kind is not Sphere:
            # Rounded as in the kernels.
            part = np.where(np.abs(part) <= _ROUND_OFF, 0.0, part)
        here = np.isfinite(part) & (np.abs(phi) <= _NEAR * reach * steep)
    return points[:, here], part[here]


def _level(surface: Surface, across: int, points: Floats) -> tuple[Floats, Floats]:
    """Return phi at points (3, N) of the plane, and its gradient, as kernels compute them."""
    if isinstance(surface, ManyBodies) or surface.motion is not None:
        return surface.phi(points), surface.gradient(points)
    walls, rows = [upright(wall, across) for wall in surface.walls()], vec(points)
    levels = np.array([np.broadcast_to(wall.phi(rows), points.shape[1:]) for wall in walls])
    slopes = [slopes_of(wall, rows) for wall in walls]
    return levels.max(axis=0), np.choose(np.argmax(levels, axis=0), slopes)


def _starts(surface: Surface, across: int, reach: float) -> Floats:
    """Return points in a plane at which the search for walls starts, with middles of many bodies and points beside."""
    random = np.random.default_rng(0)
    points = [reach * (2.0 * random.random((3, _STARTS)) - 1.0)]
    # Also near surfaces that are small or far away
    size = surface.size()
    center = np.array(getattr(surface, "center", (0.0, 0.0, 0.0)))[:, None]
    if math.isfinite(size):
        points.append(center + 2.0 * size * (2.0 * random.random((3, _STARTS)) - 1.0))
    if isinstance(surface, ManyBodies):
        low, high = (np.where(np.isfinite(corner), corner, 0.0) for corner in surface.corners())
        points += [low + (high - low) * random.random((3, 1)) for _k in range(4)]
    found = np.concatenate(points, axis=1)
    found[across] = 0.0
    return found


def _require_motion(plane: str, where: str, surface: Surface) -> None:
    across = PLANES[plane]
    for part in parts_of(surface.motion):
        for came in _leaving(part, across):
            raise SceneError(
                f'{where} must stay in the plane where plane = "{plane}", got {came}; leave that out, or move the wall '
                f"along the plane and turn it about {plane}"
            )


def _require_laws(plane: str, where: str, surface: Surface) -> None:
    """Raise a `SceneError` if a user-defined law sends a particle out of the plane in a trial."""
    across = PLANES[plane]
    for k, law in enumerate(surface.laws):
        if isinstance(law, str):
            continue  # a name, which a run refuses
        for v, n, given in tries_of(law, across, AXES[across](1.0)):
            after, stays, _wait = leave_of(given)
            if stays and after[across] != 0.0:
                raise SceneError(
                    f'{where}[{k}] must send particles along the plane where plane = "{plane}": {plane} = 0 of the '
                    f"velocity that leave returns; {law} returned {checks.shown(after)} for v = {shown(v)} "
                    f"and n = {shown(n)}"
                )


def _leaving(part: Any, across: int) -> Iterable[str]:
    """Yield the parts of a motion that leave the plane, in words."""
    name = type(part).__name__
    if isinstance(part, Translation) and part.velocity[across] != 0.0:
        yield f"{name} with velocity[{across}] = {part.velocity[across]:g} m/s"
    if isinstance(part, Oscillation) and part.amplitude[across] != 0.0:
        yield f"{name} with amplitude[{across}] = {part.amplitude[across]:g} m"
    if isinstance(part, Rotation) and any(part.axis[k] != 0.0 for k in along(across)):
        yield f"{name} about the axis {part.axis}"
    if isinstance(part, Path):
        for k, place in enumerate(part.positions):
            if place[across] != part.positions[0][across]:
                yield f"{name} with positions[{k}][{across}] = {place[across]:g} m"
    if isinstance(part, Guide) and part.axis[across] != 0.0:
        yield f"{name} along {part.axis}"
