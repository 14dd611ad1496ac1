"""Bodies to and from plain tables, the form in scene files and trajectories.

A table of the kind "points" has the arguments of `Body`, every number exactly. The other kinds have the arguments of
the functions that make bodies.
"""

import dataclasses
import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

import numpy as np

from ..common import checks
from ..common.checks import Vector
from ..common.validated import Count, Magnitude, NotNegativeCount, Validated
from ..errors import SceneError
from ..motion import Oscillation, Rotation, Translation
from ..motion import table_of as motion_table
from ..scene import Scene
from ..serialization import tables
from ..state import Floats
from ..surfaces import ALL_SURFACES
from . import room, shapes
from .body import Body, Strain
from .copies import Bodies
from .elastic import block, elastic
from .placing import place

T = TypeVar("T")
_MOTIONS = {"translation": Translation, "oscillation": Oscillation, "rotation": Rotation}


# --- Keys of [body] ---------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Made(Validated):
    """The keys of every kind of [body]: the number of copies, and their random start."""

    # The function that makes the body from the other keys.
    maker: ClassVar[Callable[..., Body]]
    count: Count | None = None
    speed: Magnitude | None = None
    spin: Magnitude | None = None
    seed: NotNegativeCount | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        # The arguments are checked when the file is read, not when the copies are placed.
        self.body()

    def body(self) -> Body:
        """Return the body that is described."""
        own = [field.name for field in dataclasses.fields(self) if field.name not in Made.__dataclass_fields__]
        return type(self).maker(**{name: getattr(self, name) for name in own})

    def start(self, scene: Scene) -> Bodies:
        """Return the copies at the start.

        Raises:
            SceneError: a value is out of its range, or the copies cannot be placed.
        """
        if self.count is None:
            raise SceneError("count: expected a whole number, got nothing; add count = ...")
        body = self.body()
        checks.particles_fit("count", self.count * len(body))
        return place(scene, body, self.count, speed=self.speed or 0.0, spin=self.spin or 0.0, seed=self.seed or 0)


def _made_by(maker: Callable[..., Body]) -> type[Made]:
    """Return the class of the keys of a kind: the arguments of a function, and the keys of every kind."""
    own = [(one.name, one.annotation) for one in inspect.signature(maker).parameters.values()]
    name, known = maker.__name__, {"maker": maker}
    return dataclasses.make_dataclass(name, own, bases=(Made,), namespace=known, frozen=True, kw_only=True)


@dataclass(frozen=True, kw_only=True)
class Rigid(Made):
    """The arguments of `rigid`."""

    maker = shapes.rigid
    vertices: tuple[Vector, ...]
    density: float
    faces: tuple[tuple[int, int, int], ...] | None = None
    contacts: float | tuple[Vector, ...] | None = None


@dataclass(frozen=True, kw_only=True)
class Elastic(Made):
    """The arguments of `elastic`, for a block with `lengths` that is cut into `cells` along each axis."""

    lengths: Vector
    cells: tuple[int, int, int]
    young: float
    poisson: float
    density: float
    mass: str = "lumped"

    def body(self) -> Body:
        """Return a block of tetrahedra."""
        return elastic(block(self.lengths, self.cells), self.young, self.poisson, self.density, self.mass)


@dataclass(frozen=True, kw_only=True)
class Points(Made):
    """The arguments of `Body`; without a count there is one copy, at the given points."""

    points: tuple[Vector, ...]
    velocity: tuple[Vector, ...] | None = None
    project: bool = False
    mass: float | tuple[float, ...] | None = None
    mass_matrix: tuple[tuple[float, ...], ...] | None = None
    links: tuple[tuple[int, int], ...] = ()
    springs: tuple[tuple[int, int, float, float], ...] = ()
    contacts: tuple[int | tuple[float, ...], ...] | None = None
    strain: Any = None
    anchors: tuple[Any, ...] = ()
    guides: tuple[Any, ...] = ()
    cavities: tuple[Any, ...] = ()
    faces: tuple[tuple[int, int, int], ...] = ()

    def body(self) -> Body:
        """Return the body with these arguments."""
        return Body(
            self.points,
            self.mass,
            self.links,
            self.springs,
            self.contacts,
            mass_matrix=self.mass_matrix,
            strain=None if self.strain is None else tables.convert(self.strain, _Strain, "strain").strain(),
            anchors=_anchors(self.anchors),
            guides=[(guide.point, guide.surface) for guide in _surfaces("guides", self.guides, _Guide)],
            cavities=[
                (cavity.surface, cavity.carrier, cavity.point)
                for cavity in _surfaces("cavities", self.cavities, _Cavity)
            ],
            faces=self.faces,
        )

    def start(self, scene: Scene) -> Bodies:
        """Return the copies at the start, or the one copy at the given points."""
        if self.count is not None:
            for name in ("velocity", "project"):
                if getattr(self, name):
                    raise SceneError(f"{name}: must go without count, got both; copies at random have speed and spin")
            return super().start(scene)
        placed = [name for name in ("speed", "spin", "seed") if getattr(self, name) is not None]
        if placed:
            raise SceneError(f"{placed[0]}: is of copies at random; add count = ..., or give velocity = ... instead")
        position = np.array(self.points)
        velocity = np.zeros_like(position) if self.velocity is None else np.array(self.velocity)
        return Bodies(self.body(), position.T, velocity.T, project=self.project)


KINDS: dict[str, type[Made]] = {
    "dumbbell": _made_by(shapes.dumbbell), "tetrahedron": _made_by(shapes.tetrahedron),
    "chain": _made_by(shapes.chain), "rigid": Rigid, "elastic": Elastic, "points": Points,
}  # fmt: skip


# --- Parts of the kind "points" ---------------------------------------------------------------------------


@dataclass(frozen=True)
class _Strain:
    """A `Strain` with the entries (i, j, K_ij) of its matrix that are not 0, as each edge meets few others."""

    edges: tuple[tuple[int, int], ...]
    rest: tuple[float, ...]
    stiffness: tuple[tuple[int, int, float], ...]

    def strain(self) -> Strain:
        n = len(self.edges)
        room.require(0, edges=n)
        matrix = np.zeros((n, n))
        for k, (i, j, value) in enumerate(self.stiffness):
            if not (0 <= i < n and 0 <= j < n):
                raise SceneError(f"strain.stiffness[{k}] must name two of the {n} edges, got {i} and {j}")
            matrix[i, j] = value
        return Strain(np.array(self.edges, dtype=np.int64).reshape(-1, 2), np.array(self.rest), matrix)


@dataclass(frozen=True)
class _Guide:
    point: int
    surface: Any


@dataclass(frozen=True)
class _Cavity:
    surface: Any
    carrier: int
    point: int


def _anchors(given: tuple[Any, ...]) -> dict[int, Any]:
    """Return the motions of points, None for a table without a kind."""
    found: dict[int, Any] = {}
    for k, table in enumerate(given):
        where = f"anchors[{k}]"
        if not isinstance(table, dict) or type(table.get("point")) is not int:
            raise SceneError(f"{where}: expected a table with the number of a point, got {checks.shown(table)}")
        point, motion = table["point"], {key: value for key, value in table.items() if key != "point"}
        if point in found:
            raise SceneError(f"{where} is of point {point}, as anchors[{list(found).index(point)}]; remove one of them")
        found[point] = tables.of_kind(motion, where, _MOTIONS) if motion else None
    return found


def _surfaces(name: str, given: tuple[Any, ...], cls: type[T]) -> Iterator[T]:
    """Yield tables as guides or cavities, each with its surface."""
    for k, table in enumerate(given):
        found: Any = tables.convert(table, cls, f"{name}[{k}]")
        yield dataclasses.replace(found, surface=tables.of_kind(found.surface, f"{name}[{k}].surface", ALL_SURFACES))


# --- To a table -------------------------------------------------------------------------------------------


def body_of(table: Any) -> Body:
    """Return the body of a table that `table_of` made.

    Raises:
        SceneError: the table does not describe a body.
    """
    return tables.of_kind(table, "body", {"points": Points}).body()


def table_of(body: Body) -> dict[str, Any]:
    """Return the table of a body, of the kind "points", from which `body_of` makes the same body to the last bit.

    >>> table_of(Body([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], mass=0.5, links=[(0, 1)]))["links"]
    [[0, 1]]
    """
    matrix, mass = body.mass_matrix, np.diag(body.mass_matrix)
    masses = {"mass": mass.tolist()} if (matrix == np.diag(mass)).all() else {"mass_matrix": matrix.tolist()}
    table = {
        "kind": "points",
        "points": body.points.tolist(),
        **masses,
        "links": body.links.tolist(),
        "springs": [list(spring) for spring in body.springs],
        "contacts": _contacts(body.contacts),
        "anchors": [
            {"point": point, **({} if motion is None else motion_table(motion))}
            for point, motion in body.anchors.items()
        ],
        "guides": [{"point": point, "surface": tables.table_of(surface)} for point, surface in body.guides],
        "cavities": [
            {"surface": tables.table_of(surface), "carrier": carrier, "point": point}
            for surface, carrier, point in body.cavities
        ],
        "faces": body.faces.tolist(),
    }
    if body.strain is not None:
        i, j = (places.tolist() for places in np.nonzero(body.strain.stiffness))
        entries = zip(i, j, body.strain.stiffness[i, j].tolist(), strict=True)
        table["strain"] = {
            "edges": body.strain.edges.tolist(),
            "rest": body.strain.rest.tolist(),
            "stiffness": [list(entry) for entry in entries],
        }
    return {name: value for name, value in table.items() if name in ("kind", "points", "contacts") or value}


def _contacts(rows: Floats) -> list[Any]:
    """Return the numbers of points if every row is a point, else the coefficients."""
    numbers = rows.argmax(axis=1)
    same = (rows == np.eye(rows.shape[1])[numbers]).all()
    return list(numbers.tolist() if same else rows.tolist())
