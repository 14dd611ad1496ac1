"""Walls with a mass, which contacts of soft balls push: each wall is one more unknown of a step.

A wall of the mass M goes from the displacement D0 to D1 = D0 + h (V0 + V1)/2, as a ball does. A contact with the
impulse J on a ball has the impulse -J on the wall. On a guide, only the parts of J and of the weight M a along the axis
act. With the spring k of the guide,
    M (V1 - V0) = h (M a - k (D0 + D1)/2) - sum J,
where the force of the spring is the discrete gradient of k D^2/2, so that momentum and energy are conserved.
Solved for V1, with c = h^2 k/(4 M):
    V1 = ((1 - c) V0 + h (a - k/M D0))/(1 + c) - sum J/(M (1 + c)).
"""

from typing import Any, NamedTuple

import numpy as np

from ..compiled_scene import CompiledScene
from ..kernel.arrays import index
from ..kernel.jit import Array, outlined, select
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, dot, set_vector, square, vec, vector_at
from ..motion import Guide, speed_at_start, unit_axis
from ..scene import Scene
from ..state import Floats
from ..surfaces.in_motion.drive import PoseDerivatives
from ..surfaces.in_motion.moving import Marched, Moving
from ..surfaces.in_motion.posed import Posed
from ..surfaces.walls import Field, Following, Walls
from . import grain_arrays as col
from .contacts import worse
from .grain_arrays import Grains, grains_of


class FreeMotion(Record):
    """The motion of a wall with a mass, with the rows of `Grains` that have its displacement and its velocity."""

    row: int
    lightness: float  # 1/(M (1 + c))
    axis: Any  # of the guide, or None
    spring: Any  # k/M of its spring [1/s^2], or None
    pull: Any  # its acceleration by gravity, along the axis of a guide, or None
    h: float  # the step [s]
    place: Array
    speed: Array

    # The wall does not turn.
    turn, spin, late = None, None, 0.0

    @property
    def center(self):
        """The centre of rotation, of no effect here."""
        return ZERO

    def at_start(self):
        """The pose of the wall at the start of the step."""
        k = index(self.row)
        return PoseDerivatives(vector_at(self.place, k, col.X), vector_at(self.speed, k, col.BEFORE), ZERO, None)

    def at_end(self):
        """The pose of the wall at the end of the step, by the current impulses."""
        k = index(self.row)
        return PoseDerivatives(
            vector_at(self.place, k, col.X) + self.move(), vector_at(self.speed, k, col.AFTER), ZERO, None
        )

    def move(self):
        """The displacement of the wall in the step."""
        k = index(self.row)
        return 0.5 * self.h * (vector_at(self.speed, k, col.BEFORE) + vector_at(self.speed, k, col.AFTER))

    def lost(self):
        """The round-off lost from the displacement of the wall."""
        return vector_at(self.place, index(self.row), col.LOST)

    def free_velocity(self):
        """The velocity of the wall at the end of a step without contacts."""
        k = index(self.row)
        v, h = vector_at(self.speed, k, col.BEFORE), self.h
        gained = ZERO if self.pull is None else h * self.pull
        if self.spring is None:
            return v + gained
        c = 0.25 * h * h * self.spring
        return ((1.0 - c) * v + (gained - (h * self.spring) * vector_at(self.place, k, col.X))) / (1.0 + c)

    def push(self, impulse):
        """Add an impulse to the velocity of the wall at the end of the step."""
        k = index(self.row)
        change = impulse if self.axis is None else dot(impulse, self.axis) * self.axis
        set_vector(self.speed, k, col.AFTER, vector_at(self.speed, k, col.AFTER) + self.lightness * change)

    def eases(self, n):
        """The change of velocity along n by a unit impulse along n, and the largest one across n by one across n."""
        if self.axis is None:
            return self.lightness, self.lightness
        along, size2 = dot(n, self.axis), square(n)
        part = along * along / select(size2 > 0.0, size2, 1.0)
        return self.lightness * part, self.lightness * (1.0 - part)


class HeavyWall(Posed):
    """A wall with a mass over a step; its `drive` is a `FreeMotion`, and `grown` places it by the current impulses."""

    def grown(self, radius):
        """The surface that the centre of a ball meets, by the current impulses."""
        return self.now()._replace(body=self.body.grown(radius))

    def now(self):
        """The wall by the current impulses."""
        return self._replace(pose=self.drive.at_start(), end=self.drive.at_end())

    def displacement(self):
        """The displacement in the step, not as the difference of two places, which has their round-off."""
        return self.drive.move()


class HeavyMoving(Moving):
    """A wall, or a field of walls, with a mass; its `drive` is a `FreeMotion`."""

    def during(self, remaining, after):
        """The wall over the step, whatever the time."""
        return HeavyWall(self.body, self.drive.at_start(), self.drive.at_end(), self.drive, remaining, after)


def _own(wall):
    return wall.members if isinstance(wall, Field) else wall


def is_heavy(wall):
    """Whether a wall or a field has a mass: a constant for the compiler."""
    return isinstance(_own(wall), HeavyWall)


# --- One contact; `own` is the surface that the ball meets -----------------------------------------------


def now(own):
    """A wall by the current impulses."""
    return own.now() if isinstance(own, HeavyWall) else own


def rest_of(own, place, i):
    """The round-off lost from the place of a ball relative to the wall."""
    lost = vector_at(place, i, col.LOST)
    return lost - own.drive.lost() if isinstance(own, HeavyWall) else lost


def place_on(own, r):
    """A point in the frame in which the openings of a wall are given: they move with a wall with a mass."""
    return own.own_place(r) if isinstance(own, HeavyWall) else r


def note_eases(own, rows, c, n):
    """Write how a wall with a mass yields to impulses along and across the normal."""
    if isinstance(own, HeavyWall):
        rows[c, col.EASES], rows[c, col.EASES + 1] = own.drive.eases(n)


def ease_along(own, rows, c):
    """The inverse of the mass that moves along the normal."""
    return rows[c, col.EASE] + rows[c, col.EASES] if isinstance(own, HeavyWall) else rows[c, col.EASE]


def ease_across(own, rows, c, ease):
    """The inverse of the mass that moves across the normal, from that of the ball, `ease`."""
    return ease + rows[c, col.EASES + 1] if isinstance(own, HeavyWall) else ease


def react(own, impulse):
    """Give a wall with a mass the opposite of an impulse on a ball."""
    if isinstance(own, HeavyWall):
        own.drive.push(-1.0 * impulse)


# --- A step ----------------------------------------------------------------------------------------------


@outlined
def begin_walls(heavy, h):
    """Set the end velocities from the last changes; return the largest squared distance from the listed places."""
    place, speed, farthest = heavy.place, heavy.speed, 0.0
    for k in range(place.shape[0]):
        i = index(k)
        v = vector_at(speed, i, col.BEFORE)
        set_vector(speed, i, col.AFTER, v + vector_at(heavy.change, i, col.LAST))
        farthest = worse(square(vector_at(place, i, col.X) + v * h - vector_at(heavy.listed, i, col.X)), farthest)
    return farthest


def fly_wall(wall):
    """Set the velocity of a wall with a mass at the end of the step to that of a step without contacts."""
    drive = _own(wall).drive
    set_vector(drive.speed, index(drive.row), col.AFTER, drive.free_velocity())


@outlined
def push_back(law, wall, touches, number):
    """Add the opposite of the impulses of all contacts with a wall to its velocity at the end of the step."""
    rows, begin, own = touches.wall_rows, touches.wall_spans[0, number], _own(wall)
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        impulse = vector_at(rows, c, col.IMPULSE)
        if law.friction is not None:
            impulse = impulse + vector_at(rows, c, col.DRAG)
        react(own, impulse)


# --- From a description ----------------------------------------------------------------------------------


def heavy_rows(scene: Scene) -> Grains | None:
    """Return the rows of the surfaces with a mass at the start, in their order; None in a scene without them."""
    heavy = [(i, one) for i, one in enumerate(scene.surfaces) if one.reacts()]
    if not heavy:
        return None
    velocity = np.array([speed_at_start(one.motion) for _i, one in heavy]).T
    count, mass = len(heavy), np.array([one.mass for _i, one in heavy])
    made = grains_of(np.zeros((3, count)), velocity, np.zeros(count), mass)
    return made._replace(number=np.array([i for i, _one in heavy]))


class WallMotion(NamedTuple):
    """The displacements and velocities of walls with a mass, as `observed_of` takes them."""

    shift: Floats  # (3, K) [m]
    velocity: Floats  # (3, K) [m/s]


def motion_of(heavy: Grains) -> WallMotion:
    """Return the `WallMotion` at the end of a step."""
    return WallMotion(heavy.place[:, col.X : col.X + 3].T, heavy.speed[:, col.BEFORE : col.BEFORE + 3].T)  # type: ignore[arg-type]


def with_heavy(walls: Walls, compiled: CompiledScene, heavy: Grains, h: float) -> Walls:
    """Return the walls of a scene, some of which have a mass, in steps of the length h [s]."""
    scene, row = compiled.scene, {int(i): k for k, i in enumerate(heavy.number)}
    each: list[Any] = []
    for i, wall in zip(compiled.numbering.surfaces_of_rows, walls.each, strict=True):
        if i in row:
            own = _own(wall)
            body = own.body if isinstance(own, (Moving, Following)) else own
            pushed = HeavyMoving(body, _motion_of(scene, i, row[i], heavy, h))
            wall = wall._replace(members=pushed) if isinstance(wall, Field) else pushed
        each.append(wall)
    return Marched(tuple(each), walls.unions, walls.slack, walls.inset)


def _motion_of(scene: Scene, i: int, row: int, heavy: Grains, h: float) -> FreeMotion:
    surface, pull = scene.surfaces[i], None if scene.gravity is None else np.array(scene.gravity)
    motion, axis, spring, c = surface.motion, None, None, 0.0
    assert surface.mass is not None
    if isinstance(motion, Guide):
        axis = unit_axis(motion)
        pull = None if pull is None else float((axis * pull).sum()) * axis
        if motion.stiffness > 0.0:
            spring = motion.stiffness / surface.mass
            c = 0.25 * h * h * spring
    lightness = 1.0 / (surface.mass * (1.0 + c))
    return FreeMotion(row, lightness, _vector(axis), spring, _vector(pull), h, heavy.place, heavy.speed)


def _vector(values: Any) -> Vec | None:
    return None if values is None else vec(values.tolist())
