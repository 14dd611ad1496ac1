"""The records of kernels for a scene with reacting walls, made from its description."""

import math
from typing import Any

import numpy as np

from ...compiled_scene import REACTING, CompiledScene
from ...contact.laws import NONE, Laws
from ...kernel.vector import ZERO, Vec, vec
from ...motion import Guide, Rotation, speed_at_start, unit_axis
from ...scene import Scene
from ...state import Floats
from ...surfaces.fields.members import Members
from ...surfaces.presence.doors import walls_then
from ...surfaces.surface import Surface
from ...surfaces.walls import Field, Walls
from .freedoms import WIDTH, Freedoms, Shifted
from .pendulum import TERMS, Hinged, Pendulum
from .queue import SceneWalls
from .strikes import Reacting


def scenery_of(compiled: CompiledScene, moment: float) -> SceneWalls:
    """Return the walls of a scene in the frame that ends at a moment [s]."""
    scene = compiled.scene
    given = compiled.of_no_mass if scene.reacts() else compiled
    reacts, numbering = np.array([surface.reacts() for surface in scene.surfaces], bool), compiled.numbering
    stay = np.flatnonzero(~reacts[numbering.members[0]])
    return SceneWalls(
        Walls(()) if given is None else given.walls(moment),
        (given.laws if given else None) or NONE,
        stay,
        numbering.rows_of_walls[stay],
        _reacting(compiled, moment),
        scene.pull(),
        scene.finite_size(),
        openings=None if given is None else given.openings(moment),
    )


def _reacting(compiled: CompiledScene, moment: float) -> tuple[Reacting, ...]:
    """The reacting walls in the order of the walls of the scene; rows of freedoms are in the order of its surfaces."""
    scene, pieces, made = compiled.scene, compiled.pieces, list[Reacting]()
    heavy = [i for i, surface in enumerate(scene.surfaces) if surface.reacts()]
    numbers, rows = compiled.numbering.pieces_of_walls, compiled.numbering.rows_of_walls
    for p in dict.fromkeys(compiled.numbering.pieces_of_rows.tolist()):
        piece, surface = pieces.each[p], scene.surfaces[pieces.owners[p]]
        if not surface.reacts():
            continue
        walls = [_loosened(wall, scene) for wall in walls_then(piece, moment, compiled.largest)]
        freedom = _freedom(surface, heavy.index(pieces.owners[p]), scene.gravity or (0.0, 0.0, 0.0))
        laws, mine = _laws_of(piece, scene), np.flatnonzero(numbers == p).tolist()
        absorbs = 1.0 if laws is not None and laws.may_end else None
        openings = compiled.openings(moment, [(p, len(mine))])
        made += [
            Reacting(wall, freedom, mine[k], int(rows[mine[k]]), piece.restitution, laws, float(k), absorbs, openings)
            for k, wall in enumerate(walls)
        ]
    return tuple(made)


def _loosened(wall: Any, scene: Scene) -> Any:
    """A wall, or a field with bounds loose enough for the round-off of places anywhere in the scene."""
    return wall.loosened(scene.extent()) if isinstance(wall, Members) else wall


def _laws_of(surface: Surface, scene: Scene) -> Laws | None:
    """Return the laws of a reacting surface; None if they are a restitution at most."""
    if not (surface.laws or surface.friction > 0.0 or surface.temperature is not None):
        # Every frame calls this.
        return None
    laws = Scene([surface], plane=scene.plane).compiled(None, REACTING).laws or NONE
    return laws._replace(moving=None) if laws.send_off or laws.friction is not None else None


def _freedom(surface: Surface, row: int, gravity: tuple[float, float, float]) -> Any:
    motion = surface.motion
    if surface.inertia is not None:
        return _turning(surface, row, np.array(gravity))
    assert surface.mass is not None
    lightness = 1.0 / surface.mass
    if not isinstance(motion, Guide):
        return Shifted(row, lightness, vec(gravity), None, None)
    axis = unit_axis(motion)
    pull = _vector(float((axis * gravity).sum()) * axis)
    rate = math.sqrt(motion.stiffness * lightness) if motion.stiffness > 0.0 else None
    return Shifted(row, lightness, pull, _vector(axis), rate)


def _turning(surface: Surface, row: int, gravity: Floats) -> Hinged | Pendulum:
    """Return the freedom of a wall on an axis; its weight acts at its centre."""
    motion, lightness = surface.motion, 1.0 / (surface.inertia or 1.0)
    k, pivot = unit_axis(motion), np.array(motion.center)
    if surface.mass is not None:
        arm = np.array(surface.center) - pivot  # type: ignore[attr-defined]
        arm = arm - (arm * k).sum() * k
        # The torque k.(A l x M G) = M (k.(l x G) cos theta - l.G sin theta), divided by the inertia.
        sine, cosine = ((k * np.cross(arm, gravity)).sum(), (arm * gravity).sum())
        stiffness = surface.mass * lightness * math.hypot(sine, cosine)
        if stiffness > 0.0:
            return Pendulum(row, lightness, _vector(k), _vector(pivot), stiffness, math.atan2(sine, cosine))
    return Hinged(row, lightness, _vector(k), _vector(pivot))


def _vector(values: Floats) -> Vec:
    return vec(values.tolist())


def freedoms_of(compiled: CompiledScene, velocity: Floats) -> Freedoms:
    """Return the motion of the reacting walls at the start, with leases for particles of velocities (3, N) [m/s]."""
    width = WIDTH * math.sqrt(float((velocity**2).sum(axis=0).mean())) or WIDTH
    scene = compiled.scene
    surfaces = [surface for surface in scene.surfaces if surface.reacts()]
    count = len(surfaces)
    shift, velocity, rest, middle = np.zeros((4, 3, count))
    angle, rate, rate_rest, time, turning, widths, until = np.zeros((7, count))
    for k, surface in enumerate(surfaces):
        motion = surface.motion
        velocity[:, k] = speed_at_start(motion)
        if isinstance(motion, Rotation):
            rate[k] = motion.rate
        size = surface.size() if math.isfinite(surface.size()) else scene.finite_size()
        widths[k] = width if surface.inertia is None else width / size
    series = np.zeros((3 * TERMS, count))
    made = Freedoms(shift, velocity, rest, angle, rate, rate_rest, series, time, middle, turning, widths, until)
    for wall in _reacting(compiled, 0.0):
        if isinstance(wall.freedom, Pendulum):
            wall.freedom.expand(made)
    return made


def bring_walls(scenery: SceneWalls, freedoms: Freedoms, t: float) -> None:
    """Move the walls to a time, from which their motions are then counted."""
    for wall in scenery.reacting:
        wall.freedom.push(freedoms, t, ZERO, ZERO)
    freedoms.time.fill(0.0)


def walls_now(compiled: CompiledScene, scenery: SceneWalls, freedoms: Freedoms) -> Walls:
    """Return all walls of a scene, in its order, at the end of the frame of `scenery`."""
    still = scenery.given.at(0.0)
    given = iter(still.each)
    posed = (wall.freedom.posed(wall.body, freedoms, 0.0) for wall in scenery.reacting)
    reacting = (Field(wall) if isinstance(wall.body, Members) else wall for wall in posed)
    owned = [compiled.scene.surfaces[i] for i in compiled.numbering.surfaces_of_rows]
    # The walls of unions, which have no mass, are last.
    every = tuple(next(reacting if surface.reacts() else given) for surface in owned)
    return Walls(every, still.unions, still.slack, still.inset)
