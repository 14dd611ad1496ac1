"""A mesh of triangles, each of which is a wall: closed, or open, of sheets that have two sides."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ... import motion as motions
from ...common import checks
from ...common.checks import Vector
from ...common.extras import needed_by
from ...common.validated import Flag, Length, Magnitude
from ...errors import SceneError
from ...kernel.arrays import aligned_copy
from ...kernel.grid import MARGIN
from ...kernel.vector import Vec
from ...state import Floats, Indices
from .. import rotation as rotations
from ..area_samples import AreaSample, Region, of_triangles
from ..balls.facet import triangles_of_balls
from ..fields.members import Members
from ..fields.one_wall import OneWall, one_wall
from ..surface import LAWS, UNBOUNDED, Box, Surface, side_sign
from .faces import faces_of
from .facet import OVERLAP, ROOM, THIN, CornersOf, CornersOfSides, FacetNumbers, Shared, SheetSide
from .facet_cells import MOVING_MARGIN, cells_around
from .flat import all_in_a_plane, in_plane, places_of, planes_of, rim_of
from .members import Facets, table_of_facets, table_of_sides, with_room
from .mending import sizes
from .mesh_files import given_arrays, read_soup
from .nearest import boxes_of, nearest, within
from .triangles import closed, sheets, sorted_by_place

_NOUNS_OF_SHEETS = ("open mesh",) * 4
# The arguments that a group may have of its own.
LAWS_OF_GROUPS = tuple(name for name in LAWS if name != "rolling")


@dataclass(frozen=True, repr=False, eq=False)
class Mesh(Surface):
    """A mesh of triangles that are walls, exactly: edges, corners and thin walls are as in the file.

    It is closed, or with `open=True` it is of sheets: each triangle is a wall from both sides. So are chutes, funnels,
    boxes without a lid. Particles go around their edges; which way a triangle is turned does not matter.

    In a scene file: kind = "mesh" and file = "part.stl", relative to the scene file, without a `spacing`; laws of a
    group in a table [surface.groups.NAME]. Files other than STL and OBJ in text need the extra `mesh`.

    Args:
        vertices: the path of a file (.stl, .obj, .ply, .3mf, .off, ...), or corners (V, 3) [m].
        triangles: None with a path, else (T, 3) the numbers of their corners. They must enclose a volume, if not
            `open`; a part within an odd number of others is a cavity, whichever way its triangles are turned.
        side: "inside" or "outside" of the mesh, the admissible part; of sheets it is "outside", both sides of them.
        open: whether the triangles are sheets; triangles that all lie in one plane always are. The sides of a sheet are
            3e-11 of the farthest coordinate from it, which determines the side of a point that touches it; balls touch
            the triangles themselves.
        center: where the origin of the file is, three numbers [m].
        scale: the length of a unit of the file in metres, 0.001 for millimetres.
        weld: corners of open edges this near [m] are joined, so that seams close; 0: none. None: 1e-5 of the diagonal
            of the mesh, or a quarter of the shortest open edge if that is less.
        groups: laws by the names of solids (STL), groups or objects (OBJ, 3MF), or values of the property `group` of
            faces (PLY): {"shutter": {"temperature": 2.0}}, of restitution, friction, temperature, accommodation, laws;
            a group that is left out has the laws of the mesh.
        group: None, or (T,) the number of the group of each triangle.
        names: the names of the groups.
        rotation: about the origin of the file.

    These are mended: open seams, corners on the edges of others, triangles twice or without an area, and triangles that
    are turned over; `mesh_weld` is the largest move of a corner. The triangles are sorted by their groups and places.
    Of sheets, edges that are nearer to each other than `weld` are a seam too.

    Raises:
        SceneError: the file is missing or holds no mesh, the mesh is not closed (with its holes), its parts intersect,
            an argument is out of its range, a group is unknown, or a package is missing.

    Cost: a grid of cells finds the next triangle; `python -m bench meshes`.

    >>> import numpy as np
    >>> corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    >>> Mesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).phi([[0.1, 0.5], [0.2, 0.5], [0.3, -1.0]]).round(9)
    array([-0.1,  1. ])
    """

    face_noun: ClassVar[str] = "triangle"
    nouns = ("mesh", "solid mesh") * 2
    vertices: Any
    triangles: Any = None
    side: str = "inside"
    center: Vector = (0.0, 0.0, 0.0)
    scale: Length = field(default=1.0, kw_only=True)
    weld: float | None = field(default=None, kw_only=True)
    groups: Any = field(default=None, kw_only=True)
    group: Any = field(default=None, kw_only=True)
    names: Any = field(default=(), kw_only=True)
    mesh_weld: Magnitude | None = field(default=None, kw_only=True)
    open: Flag = field(default=False, kw_only=True, metadata={"younger": True})
    # The mended arrays, also for a copy with other laws.
    _mended: Any = field(default=None, kw_only=True, compare=False, metadata={"in_file": False})

    def __post_init__(self) -> None:
        super().__post_init__()
        given = self.vertices, self.triangles, self.group, self.names
        if self._mended is None or any(a is not b for a, b in zip(self._mended, given, strict=True)):
            self._mend()
        if self.open:
            for name in ("motion", "mass", "inertia"):
                if (value := getattr(self, name)) is not None:
                    raise SceneError(
                        f"{name} must be None for a Mesh with open=True, got {value!r:.200}; give its sheets a "
                        f"thickness, as a closed mesh, or leave the {name} out"
                    )
            checks.assign(self, side="outside", nouns=_NOUNS_OF_SHEETS)
            if self.openings:
                raise SceneError(
                    f"openings must be left out for an open mesh, got {len(self.openings)}: particles go around its "
                    "edges; leave the triangles out that are open, or give them as a mesh of their own with present"
                )
        object.__setattr__(self, "groups", self._checked_groups())
        if self.groups and self.reacts():
            raise SceneError(
                f"groups must be None for a Mesh with a mass or an inertia, got {self.groups!r:.200}; give the "
                "whole mesh one law, or a motion instead"
            )

    def _mend(self) -> None:
        """Replace the file or the arrays by its mended triangles."""
        with needed_by("a mesh", "mesh"):
            import scipy.spatial  # noqa: F401
        path = Path("of these arrays")
        if isinstance(self.vertices, (str, Path)):
            if self.triangles is not None:
                raise SceneError("triangles must be None with the path of a file, which holds them; leave them out")
            path = checks.path_of("vertices", self.vertices)
            soup = read_soup(path, self.scale)
        else:
            soup = given_arrays(self.vertices, self.triangles, self.group, self.names, self.scale)
        # Triangles in a plane enclose nothing, so they cannot be a damaged closed mesh.
        is_open = self.open or all_in_a_plane(soup.vertices, soup.triangles)
        soup, moved = (sheets if is_open else closed)(path, soup, self.weld)
        mesh = sorted_by_place(soup)
        for values in (mesh.vertices, mesh.triangles, mesh.group):
            values.flags.writeable = False
        own = {name: getattr(mesh, name) for name in ("vertices", "triangles", "group", "names")}
        settled = {"scale": 1.0, "weld": None, "mesh_weld": moved or self.mesh_weld or None, "open": is_open}
        checks.assign(self, **own, **settled, _mended=tuple(own.values()))

    def _checked_groups(self) -> dict[str, dict[str, Any]] | None:
        """Return the argument `groups`, checked."""
        if self.groups is None:
            return None
        if not isinstance(self.groups, Mapping):
            raise SceneError(f"groups must be a table of laws by the names of groups, got {checks.shown(self.groups)}")
        there = ", ".join(map(repr, filter(None, self.names))) or "none, since the file names none"
        for name, laws in self.groups.items():
            if name not in self.names:
                raise SceneError(f"groups must name groups of the mesh, got {name!r}; there are {there}")
            if not isinstance(laws, Mapping):
                raise SceneError(f"groups[{name!r}] must be a table of laws, got {laws!r:.200}")
            for key in laws:
                checks.one_of(f"groups[{name!r}]", key, dict.fromkeys(LAWS_OF_GROUPS))
        return {name: dict(laws) for name, laws in self.groups.items()}

    def __len__(self) -> int:
        return len(self.triangles)

    def __repr__(self) -> str:
        """Return the number of triangles, and the arguments that differ from their defaults."""
        own = ("open" if self.open else "side", "center", "groups", "mesh_weld", *(one.name for one in fields(Surface)))
        return self._call([f"<{len(self)} triangles>"], [one for one in fields(self) if one.name in own])

    # --- For kernels -------------------------------------------------------------------------------------

    @cached_property
    def corners(self) -> Floats:
        """Return the vertices (V, 3) in the scene [m]."""
        if self.rotation is None and not any(self.center):
            return np.asarray(self.vertices)
        turned = self.vertices @ rotations.matrix(self.rotation).T if self.rotation is not None else self.vertices
        return np.ascontiguousarray(turned + np.array(self.center))

    @cached_property
    def members(self) -> Facets:
        """Return the facets as a record for kernels."""
        corners = self.corners[self.triangles if self.side == "inside" else self.triangles[:, ::-1]]
        zero, room = Vec(0.0, 0.0, 0.0), self._room
        shared = self.corners, self.triangles, side_sign(self.side)
        if self.open:
            like = SheetSide(zero, 0.0, CornersOfSides(*shared, (OVERLAP - 1.0) * room), Shared(room))
            table = table_of_sides(corners, room)
            grid = cells_around(like, table, np.repeat(corners, 2, axis=0), OVERLAP * room, self._margin)
            return with_room(Facets(like, table, grid), None, True)
        like = FacetNumbers(zero, 0.0, CornersOf(*shared, 0.0), Shared(room))
        table = table_of_facets(corners)
        grid = cells_around(like, table, corners, margin=self._margin)
        return with_room(Facets(like, table, grid), self._tree, self.is_solid())

    @property
    def _margin(self) -> float:
        """Return the part of a cell by which a flight ends beyond its wall."""
        accelerates = motions.Rotation, motions.Oscillation, motions.Path
        moves = any(isinstance(one, accelerates) for one in motions.parts_of(self.motion))
        return MOVING_MARGIN if moves else MARGIN

    @property
    def _room(self) -> float:
        """Return the round-off of places [m]."""
        return ROOM * float(np.abs(self.corners).max())

    @cached_property
    def _tree(self) -> tuple[Floats, Indices, Floats]:
        return self.corners, self.triangles, boxes_of(self.corners[self.triangles])

    def walls(self) -> tuple[Any]:
        return (OneWall(self.members, self._tree) if self.is_one_wall else self.members,)

    def as_one_wall(self) -> Surface:
        return one_wall(self)

    def walls_of_balls(self, largest: float) -> tuple[Members]:
        made: dict[float, Members] = self.__dict__.setdefault("_of_balls", {})
        if largest not in made:
            made[largest] = triangles_of_balls(self.corners[self.triangles], largest)
        return (made[largest],)

    def faces_of_balls(self, largest: float) -> tuple[Members, Indices]:
        """As `ManyBodies.faces_of_balls`: coplanar triangles, and triangles of a convex body."""
        corners, face = faces_of(self.corners, self.triangles, 0.0 if self.open else -side_sign(self.side))
        return triangles_of_balls(corners, largest), face

    def reaching_outside(self, points: Floats, radius: Floats, time: float = 0.0) -> Floats:
        return np.asarray(side_sign(self.side) * self._nearest(points, time)[3] + radius)

    def lost(self, points: Floats, time: float) -> NDArray[np.bool_]:
        return super().lost(points, time) if self.open else ~self.contain(np.array(self._own_rows(points, time)))

    def wall_count(self, of_balls: bool) -> int:
        # For points the two sides of a sheet are each a wall.
        return len(self) * (2 if self.open and not of_balls else 1)

    def numbers(self) -> list[int]:
        """Return the number of every triangle."""
        return list(range(len(self)))

    def runs(self, walls: int = 0) -> list[tuple[Surface, int]]:
        if self.is_one_wall:
            return super().runs(walls)
        counts = np.bincount(self.group, minlength=len(self.names)) * (walls // len(self) or 1)
        given = self.groups or {}
        return [
            (replace(self, groups=None, **given.get(name, {})), count)
            for name, count in zip(self.names, counts.tolist(), strict=True) if count
        ]  # fmt: skip

    @cached_property
    def _planes(self) -> Floats:
        return planes_of(self.corners, np.asarray(self.triangles))

    def flat_faces(self) -> Floats:
        # Points on both sides of a sheet are beside a wall that has no inside.
        return super().flat_faces() if self.open else self._planes

    def places_of_flat_face(self, number: int, count: int) -> tuple[Floats, Floats]:
        mesh, plane = (self.corners, np.asarray(self.triangles)), self._planes[number]
        return places_of(*mesh, plane, count), rim_of(*mesh, plane, count)

    def with_flat_face_out(self, number: int, by: float) -> "Mesh":
        plane, planes = self._planes[number], self._planes.copy()
        own = plane[:3] if self.rotation is None else plane[:3] @ rotations.matrix(self.rotation)
        vertices = np.where(in_plane(self.corners, plane)[:, None], self.vertices + by * own, self.vertices)
        vertices.flags.writeable = False
        # The copy needs no mending, and its triangles and faces keep their numbers.
        made = replace(self, vertices=vertices, _mended=(vertices, *self._mended[1:]))
        planes[number, 3] += by
        made.__dict__["_planes"] = planes
        return made

    # --- For users ---------------------------------------------------------------------------------------

    def size(self) -> float:
        if not self.open:
            return float(0.5 * np.ptp(self.vertices, axis=0).min())
        # One sheet has no extent across it.
        areas, _longest = sizes(self.vertices, self.triangles)
        return float(0.5 * min(np.ptp(self.vertices, axis=0).max(), math.sqrt(areas.sum())))

    def bounds(self) -> Box:
        return UNBOUNDED if self.is_solid() else self.enclosing_box()

    def enclosing_box(self) -> Box:
        return tuple(self.corners.min(axis=0).tolist()), tuple(self.corners.max(axis=0).tolist())

    def enclosed(self, across: int | None) -> float | None:
        return None if self.open or across is not None else abs(self.volume())

    def area_samples(self, bounds: Region, across: int | None) -> list[AreaSample]:
        if across is not None:
            return super().area_samples(bounds, across)
        return [of_triangles(self.corners, np.asarray(self.triangles))]

    def extent(self) -> float:
        return float(np.linalg.norm(self.corners, axis=1).max())

    def volume(self) -> float:
        """Return the volume that the triangles enclose [m^3].

        Raises:
            SceneError: the triangles are sheets.
        """
        if self.open:
            raise SceneError(
                f"a mesh must be closed to enclose a volume, got {self!r}: its sheets have no inside; leave open out"
            )
        a, b, c = np.moveaxis((self.vertices - self.vertices[0])[self.triangles], 1, 0)
        return float((a * np.cross(b, c)).sum() / 6.0)

    def contain(self, points: Floats) -> NDArray[np.bool_]:
        """Whether each of the points (3, N) is admissible: cheaper than phi."""
        if self.open:
            return np.asarray(self.phi(points) >= 0.0)
        found = np.empty(points.shape[1], np.bool_)
        within(self.members, self._tree, np.ascontiguousarray(points), found)
        return found

    admits = contain

    def phi(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        """Return the signed distance at points (3, N): below 0 inside, above 0 outside; shape (N,).

        For sheets it is the distance from the nearest side of one, above 0 except between the sides.
        """
        found = np.asarray(self._nearest(points, time)[3])
        return found - THIN * self._room if self.open else found

    def _own_gradient(self, points: ArrayLike, time: float) -> NDArray[np.float64]:
        return self._nearest(points, time)[:3]

    def _nearest(self, points: ArrayLike, time: float) -> NDArray[np.float64]:
        rows = self._own_rows(points, time)
        flat = np.ascontiguousarray(np.array(rows).reshape(3, -1))
        found = np.empty((4, flat.shape[1]))
        if not self.open:
            nearest(self.members, self._tree, flat, found)
            return np.asarray(side_sign(self.side) * found.reshape(4, *np.shape(rows.x)))
        # One side of each triangle
        members = self.members._replace(table=aligned_copy(self.members.table[::2]))
        nearest(members, self._tree, flat, found)
        return (found * np.where(found[3] < 0.0, -1.0, 1.0)).reshape(4, *np.shape(rows.x))

    def admissible(self, phi: float) -> str:
        if self.open:
            return f"it is on a sheet, and must be on one side of it, where phi is 0 or more; phi = {phi:.6g} there"
        return super().admissible(phi)
