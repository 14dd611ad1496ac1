"""Many bodies of one kind as one surface: the common part of their descriptions."""

from collections.abc import Callable, Sequence
from dataclasses import MISSING, fields, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...common.once import once
from ...common.rows import balls, bodies, directions, kept, lengths, widths
from ...errors import SceneError
from ...kernel.grid import one_cell
from ...motion.wall import product
from ...state import Floats
from .. import rotation as rotations
from ..area_samples import AreaSample, Region
from ..instant import side_of
from ..presence.patched import Patched
from ..shapes.sphere import Sphere, SphereNumbers
from ..surface import UNBOUNDED, Box, Surface
from .grid import grid_of
from .members import Few, GrownLike, Members, alike, nearest, table_of, touched, within
from .one_wall import OneWall, one_wall

# Up to these numbers of bodies all lanes test every body, if flights are straight: in a sphere an impact among 10, 24
# and 40 balls takes 18, 37 and 57 ns, from cell to cell 55, 73 and 91. For other bodies, which take longer, fewer; and
# in a periodic cell, as its faces end flights too: among 27 balls 87 ns, from cell to cell 52.
# Under gravity cells are faster from 16 on: up to this number are in one cell.
_FEW, _FEW_BALLS, _IN_ONE_CELL = 24, 48, 16
# The quaternion of the identity.
_UNTURNED = (1.0, 0.0, 0.0, 0.0)


class _BodyRows(NamedTuple):
    """An argument that has a row for each body."""

    of_one: str  # the argument of one body
    columns: tuple[str, ...]  # of a file
    checked: Callable[..., Floats]


_ROWS = {
    "centers": _BodyRows("center", ("x", "y", "z"), bodies),
    "radii": _BodyRows("radius", ("radius",), lengths),
    "lengths": _BodyRows("length", ("length",), lengths),
    "axes": _BodyRows("axis", ("axis_x", "axis_y", "axis_z"), directions),
    "half_widths": _BodyRows("half_widths", ("half_x", "half_y", "half_z"), widths),
    "semi_axes": _BodyRows("semi_axes", ("a", "b", "c"), widths),
    "rotations": _BodyRows("rotation", ("q_w", "q_x", "q_y", "q_z"), rotations.quaternions),
}


_SIZES = "radii", "lengths", "half_widths", "semi_axes"


class Many(Surface):
    """Many walls of one kind, which kernels take as one field: of bodies, or on the sides of an outline."""

    is_field = True

    def __len__(self) -> int:
        raise NotImplementedError

    @property
    def members(self) -> Members:
        """Return the walls as a record for kernels."""
        raise NotImplementedError

    def _members_of_balls(self, largest: float) -> Members:
        raise NotImplementedError

    def corners(self) -> tuple[Floats, Floats]:
        """Return the bounds of every body, its lowest and its highest corner (3, n), infinite along an endless axis."""
        raise NotImplementedError

    def numbers(self) -> list[int]:
        """Return the number of every body, or side."""
        return list(range(len(self)))

    def wall_count(self, of_balls: bool) -> int:
        return len(self)

    def walls(self) -> tuple[Any]:
        return (OneWall(self.members.in_cells(), None) if self.is_one_wall else self.members,)

    def as_one_wall(self) -> Surface:
        return one_wall(self)

    def walls_of_balls(self, largest: float) -> tuple[Members]:
        made: dict[float, Members] = self.__dict__.setdefault("_of_balls", {})
        # The cells of larger balls serve as well.
        largest = min((one for one in made if one >= largest), default=largest)
        if largest not in made:
            made[largest] = self._members_of_balls(largest)
        return (made[largest],)


class ManyBodies(Many):
    """Solid bodies of one kind; particles live outside all of them. They may overlap."""

    centers: Any
    # The class of one body
    kind: ClassVar[type[Surface]]
    # The corners of the periodic cell, in a periodic scene.
    repeated: ClassVar[tuple[Floats, Floats] | None] = None
    # Whether they may be cavities, in any of which particles live.
    may_be_foam: ClassVar[bool] = False
    # For images, the numbers of their bodies.
    which: ClassVar[NDArray[np.int64] | None] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        side, name = getattr(self, "side", "outside"), type(self).__name__
        if side != "outside" and not (self.may_be_foam and side == "inside"):
            raise SceneError(f'side must be "outside" for {name}, which are solids, got {side!r}')
        for moved in ("motion", "mass", "inertia") if self.is_foam() else ():
            if getattr(self, moved) is not None:
                raise SceneError(f'{moved} must be left out for {name} with side="inside", got {self}')
        object.__setattr__(self, "centers", (balls if self.kind is Sphere else bodies)("centers", self.centers))
        for what in [field.name for field in fields(self) if field.name in _ROWS and field.name != "centers"]:
            if (value := getattr(self, what)) is not None:
                object.__setattr__(self, what, _ROWS[what].checked(what, value, len(self)))
        if self.rotation is not None:
            self._turn()

    def _turn(self) -> None:
        """Turn each body about the origin, instead of the field."""
        turn: Any = self.rotation
        made = {
            name: product(rotations.matrix(turn), getattr(self, name).T).T
            for name in ("centers", "axes") if hasattr(self, name)
        }  # fmt: skip
        if hasattr(self, "rotations"):
            own = np.tile(_UNTURNED, (len(self), 1)) if self.rotations is None else self.rotations
            made["rotations"] = np.stack(rotations.after(turn, tuple(own.T)), axis=1)  # type: ignore[arg-type]
        for name, rows in made.items():
            object.__setattr__(self, name, kept(rows))
        object.__setattr__(self, "rotation", None)

    def is_foam(self) -> bool:
        return self.may_be_foam and getattr(self, "side", "outside") == "inside"

    def __len__(self) -> int:
        return len(self.centers)

    def __repr__(self) -> str:
        """Return their kind and number, and the laws of their wall."""
        return self._call([f"<{len(self)}>"], [one for one in fields(self) if one.kw_only])

    @classmethod
    def columns(cls) -> dict[str, tuple[str, ...]]:
        """Return the columns of a file that hold each argument of the bodies."""
        known = {field.name for field in fields(cls)}
        return {argument: rows.columns for argument, rows in _ROWS.items() if argument in known}

    @classmethod
    def needed(cls) -> list[str]:
        """Return the arguments that have no default."""
        return [field.name for field in fields(cls) if field.default is MISSING]

    # --- For kernels -------------------------------------------------------------------------------------

    def solids(self) -> list[Surface]:
        given = {_ROWS[name].of_one: getattr(self, name) for name in self.columns() if getattr(self, name) is not None}
        rows = zip(*(values.tolist() for values in given.values()), strict=True)
        return [self.kind(**dict(zip(given, row, strict=True)), side="outside") for row in rows]  # type: ignore[call-arg]

    def corners(self) -> tuple[Floats, Floats]:
        return _corners_of(self.solids())

    def body_count(self) -> int:
        return len(self)

    @once
    def enclosing_box(self) -> Box:
        low, high = self.corners()
        return tuple(low.min(axis=1).tolist()), tuple(high.max(axis=1).tolist())

    def area_samples(self, bounds: Region, across: int | None) -> list[AreaSample]:
        return [one for solid in self.solids() for one in solid.area_samples(bounds, across)]

    def lids(self, across: int) -> list[float]:
        return []

    def images(
        self, which: NDArray[np.int64], centers: Floats, repeated: tuple[Floats, Floats] | None = None
    ) -> "ManyBodies":
        """Return a field of the bodies `which`, at other places, for a periodic cell with these corners."""
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        taken: dict[str, Any] = {name: value[which] for name, value in given.items() if isinstance(value, np.ndarray)}
        made = replace(self, **{**taken, "centers": centers})
        object.__setattr__(made, "repeated", repeated)
        object.__setattr__(made, "which", which)
        return made

    def with_bodies(self, bodies: dict[int, Surface]) -> "ManyBodies":
        """Return the field with other places and sizes of the bodies in some rows."""
        made = {
            name: getattr(self, name).copy() for name in ("centers", *_SIZES) if getattr(self, name, None) is not None
        }
        for row, body in bodies.items():
            for name, values in made.items():
                values[row] = getattr(body, _ROWS[name].of_one)
        return replace(self, **made)

    def numbers(self) -> list[int]:
        """Return the number of every body; for an image the number of its body."""
        return super().numbers() if self.which is None else self.which.tolist()

    @cached_property
    def members(self) -> Members:  # type: ignore[override]
        return members_of(self.solids(), self.repeated)

    def _members_of_balls(self, largest: float) -> Members:
        return members_of(self.solids(), self.repeated, largest)

    def faces_of_balls(self, largest: float) -> tuple[Members, NDArray[np.int64]]:
        (members,) = self.walls_of_balls(largest)
        return members, np.arange(len(members.table))

    def why_no_balls(self) -> str | None:
        if self.is_foam():
            from ..balls.joined_rooms import why_no_balls_in  # loaded where balls are

            return why_no_balls_in(self)
        return self.solids()[0].why_no_balls()

    def contain(self, points: Floats) -> NDArray[np.bool_]:
        """Whether each of the points (3, N) is in a body: cheaper than phi, which needs the nearest body."""
        found = np.empty(points.shape[1], np.bool_)
        with np.errstate(all="ignore"):
            within(self.members, np.ascontiguousarray(points), found)
        return found

    def admits(self, points: Floats) -> NDArray[np.bool_]:
        return np.asarray(self.contain(points) == self.is_foam())

    def reaching_outside(self, points: Floats, radius: Floats, time: float = 0.0) -> Floats:
        rows = self._own_rows(points, time)
        found = np.empty(points.shape[1])
        with np.errstate(all="ignore"):
            (members,) = self.walls_of_balls(float(radius.max(initial=0.0)))
            touched(members, np.ascontiguousarray(rows), np.ascontiguousarray(radius, np.float64), found)
        return found

    # --- For users ---------------------------------------------------------------------------------------

    def bounds(self) -> Box:
        return self.enclosing_box() if self.is_foam() else UNBOUNDED

    def size(self) -> float:
        return min(solid.size() for solid in self.solids())

    def extent(self) -> float:
        return max(solid.extent() for solid in self.solids())

    def phi(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        """Return phi of the nearest body at points (3, N): below 0 in it, above 0 outside all; shape (N,)."""
        return np.asarray(self._of_nearest(points, time)[3])

    def _own_gradient(self, points: ArrayLike, time: float) -> NDArray[np.float64]:
        return self._of_nearest(points, time)[:3]

    def _of_nearest(self, points: ArrayLike, time: float) -> NDArray[np.float64]:
        rows = self._own_rows(points, time)
        flat = np.ascontiguousarray(np.array(rows).reshape(3, -1))
        found = np.empty((4, flat.shape[1]))
        with np.errstate(all="ignore"):
            nearest(self.members, flat, found)
        return found.reshape(4, *np.shape(rows.x))


def sign_of(volume: Surface) -> float:
    """The sign of phi outside a volume; the volume of many bodies is the inside of each."""
    return 1.0 if isinstance(volume, Many) else side_of(volume)


def members_of(
    surfaces: Sequence[Surface], repeated: tuple[Floats, Floats] | None, largest: float | None = None
) -> Members:
    """Return solid surfaces of one kind as one field; in a periodic scene with the corners of its cell.

    The field is for points, or for balls with radii up to `largest` [m].
    """
    if largest is None:
        bodies = alike([surface.walls()[0] for surface in surfaces])
    else:
        bodies = alike([surface.walls_of_balls(largest)[0] for surface in surfaces])
    return field_of(bodies[0], table_of(bodies), lambda: _corners_of(surfaces), repeated, largest)


def field_of(
    like: Any, table: Floats, corners: Callable[[], tuple[Floats, Floats]], repeated: tuple[Floats, Floats] | None,
    largest: float | None = None,
) -> Members:  # fmt: skip
    """Return the field of the bodies of a table, with their bounds."""
    if len(table) <= _IN_ONE_CELL:
        return Members(like, table, one_cell(len(table)))
    if largest is None:
        return Members(like, table, grid_of(like, table, corners(), repeated))
    low, high = corners()
    # In the cells of the centres of balls that touch them
    grown = GrownLike(like, largest)
    return Members(like, table, grid_of(grown, table, (low - largest, high + largest), repeated))


def in_straight_flights(members: Members, repeats: bool) -> Members:
    """Return the best kind of field for flights without gravity and motion, in a periodic scene or not."""
    if isinstance(members, Patched):
        return members
    few = _FEW_BALLS if isinstance(members.like, SphereNumbers) and not repeats else _FEW
    return Few(*members) if len(members.table) <= few else members


def _corners_of(surfaces: Sequence[Surface]) -> tuple[Floats, Floats]:
    """Return the lowest and the highest corners of solids (3, n), which are those of their cavities."""
    boxes = np.array([surface.enclosing_box() for surface in surfaces])
    return np.ascontiguousarray(boxes[:, 0].T), np.ascontiguousarray(boxes[:, 1].T)
