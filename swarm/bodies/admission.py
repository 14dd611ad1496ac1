"""Checks of runs of bodies before they start."""

import logging
import math

import numpy as np

from ..errors import SceneError
from ..files.origin import require_near
from ..methods import Impact, Penalty
from ..methods.base import Method, check_surfaces
from ..methods.fixed_step import check_solids
from ..motion.given import parts_of, require_angle
from ..particles import Particles
from ..run.impacts import require_logged
from ..run.options import RunOptions, Task
from ..run.preflight.counting import require_compiled, require_counters
from ..run.preflight.starts import require_inside
from ..scene import Scene
from ..surfaces.plane import require_start
from ..surfaces.shapes.slab import Slab
from ..surfaces.surface import Surface, named
from . import covering
from .births import with_born
from .body import Body, squares_between
from .copies import Bodies

_LOG = logging.getLogger("swarm")
# The turn of a body in a step above which there is a warning, and the proposed turn [rad].
_FAR_TURN, _GOOD_TURN = 1.0, 0.3

# The depth by which a solid may enter between contact points, in half thicknesses of it or of the body, if thinner.
_ENTERS = 0.25
# The radius of the gaps in a lattice of triangles with sides of 1, times the accuracy with which gaps are found.
_GAP = 1.25 / math.sqrt(3.0)


def task_of(scene: Scene, bodies: Bodies, method: Method, options: RunOptions) -> Task:
    """Return the checked run of bodies, with its own copy of them.

    Raises:
        SceneError: the arguments do not go together.
    """
    compiled = scene.compiled(apart=None if isinstance(method, Impact) else "bodies and soft walls")
    bodies = bodies.copy()
    _require_steps(scene, bodies, method, options)
    for point, motion in bodies.body.anchors.items():
        for part in parts_of(motion):
            require_angle(f"anchors[{point}]", part, options.times.until)
    assert method.dt is not None  # type: ignore[attr-defined]
    warn_of_passing(scene, bodies.body)
    if scene.period is not None and (bodies.body.anchors or bodies.body.guides):
        raise SceneError(
            f"period must be None with a body that has anchors or guides, got {scene.period}: they do not repeat; "
            "leave the period out"
        )
    _warn_of_turns(bodies, method.dt)  # type: ignore[attr-defined]
    check_surfaces(method, scene)
    require_compiled(scene, options)
    if len(bodies.body.contacts):
        touching = bodies.contact_points().reshape(3, -1)
        require_inside(scene, Particles(touching, touching))
    bodies = with_born(scene, bodies.in_cell(scene), options.sources, options.seed, options.times.until)
    points = bodies.particles()
    _require_in_plane(scene, bodies.body, points)
    require_logged(len(bodies), options)
    require_counters(scene, points, options)
    if options.keeps_float32():
        require_near(scene, points)
    return Task(compiled, points, method, options, bodies)


def _require_steps(scene: Scene, bodies: Bodies, method: Method, options: RunOptions) -> None:
    """Raise a `SceneError` if a step of soft bodies does not fit the scene or the frames."""
    if not isinstance(method, Penalty):
        return
    if len(bodies.body.contacts):
        velocity = np.tensordot(bodies.body.contacts, bodies.velocity, axes=(1, 1)).transpose(1, 0, 2)
        touching = Particles(bodies.contact_points().reshape(3, -1), velocity.reshape(3, -1))
        check_solids(scene, touching, method.dt)
    method.span("until", options.times.until)
    assert options.times.every is not None
    method.span("every", options.times.every)


def _require_in_plane(scene: Scene, body: Body, points: Particles) -> None:
    """Raise a `SceneError` where a body would leave the plane of a scene."""
    if scene.plane is None:
        return
    led = any(motion is not None for motion in body.anchors.values())
    if led or body.guides or body.cavities:
        raise SceneError(
            f'plane must be None with a body that has guides, cavities or anchors that are led, got "{scene.plane}"; '
            "leave it out"
        )
    require_start(scene, points, "all points of a body must lie, and move, in it")


def _warn_of_turns(bodies: Bodies, dt: float) -> None:
    """Warn where a tie of a body turns so far in a step that the step is cut, or inaccurate."""
    ends, r, v = bodies.body.links, bodies.position, bodies.velocity
    if not len(ends):
        return
    turns = dt * np.sqrt(squares_between(v, ends) / squares_between(r, ends))  # (L, n)
    link, copy = np.unravel_index(int(np.argmax(turns)), turns.shape)
    if turns[link, copy] > _FAR_TURN:
        _LOG.warning(
            "body %d turns by %.2g rad in a step of %g s (links[%d]): its steps will be cut, which is slow, or "
            "inaccurate; use dt = %.1g s or less",
            copy, turns[link, copy], dt, link, _GOOD_TURN * dt / turns[link, copy],
        )  # fmt: skip


def warn_of_passing(scene: Scene, body: Body) -> None:
    """Warn if a solid can enter a face of the body, or pass through it, without touching a contact point."""
    solids = [(i, surface) for i, surface in enumerate(scene.surfaces) if _is_solid(surface)]
    if not solids or not len(body.faces):
        return
    gap, thin = covering.distance(body), covering.thickness(body)
    i, surface = max(solids, key=lambda one: _depth(one[1], gap) / (_ENTERS * min(one[1].size(), thin)))
    size, depth = surface.size(), _depth(surface, gap)
    allowed = _ENTERS * min(size, thin)
    if depth <= allowed:
        return
    # The gap at which the solid would enter by the allowed depth.
    wanted = allowed if surface.has_edges else math.sqrt(allowed * (2.0 * size - allowed))
    what = "pass through the body" if gap >= size else f"enter the body by {depth:.2g} m"
    _LOG.warning(
        "%s can %s without an impact: only contact points touch walls, and a face of the body has "
        "places %.2g m away from them; give it more of them: contacts = %.1g [m] of rigid, or a finer mesh of elastic",
        named(i, surface), what, gap, _rounded(wanted / _GAP),
    )  # fmt: skip


def _is_solid(surface: Surface) -> bool:
    # A slab cannot lie between contact points of a body: they are all on one side of it.
    return surface.is_solid() and not isinstance(surface, Slab)


def _depth(surface: Surface, gap: float) -> float:
    """The depth to which a solid enters a plane between points that leave a circle of radius `gap` free [m]."""
    size = surface.size()
    if gap >= size:
        return math.inf
    return gap if surface.has_edges else size - math.sqrt(size * size - gap * gap) if size < math.inf else 0.0


def _rounded(value: float) -> float:
    """Return `value` rounded down to one digit."""
    unit = 10.0 ** math.floor(math.log10(value))
    return math.floor(value / unit) * unit
