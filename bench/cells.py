"""Cells of the matrix of pairs: an engine, a kind of wall and a capability, each a run of a few particles.

A run has four particles, or two bodies, so near to their walls that each meets one within a second: in plain Python it
takes 0.01 to 0.3 s. `CELLS` is the whole matrix. What has no meaning is no cell, and `meaning` says why.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

import swarm
from swarm.kernel.jit import select
from swarm.kernel.vector import dot

from . import shards

CENTER = (1.0, 1.0, 1.0)
# Around every solid; it is within the cell of a scene that repeats.
HALF, PERIOD = 0.95, 2.0
RADIUS, MASS = 0.04, 1.0
STEP, STIFFNESS = 5e-3, 4e3
AXIS = (1.0, -2.0, 3.0)
TURN = {"axis": AXIS, "angle": 0.7}

Laws = dict[str, Any]


class Cell(NamedTuple):
    """The names of an engine, a kind of wall and a capability."""

    engine: str
    wall: str
    capability: str

    def __str__(self) -> str:
        return " / ".join(self)


# --- Starts ----------------------------------------------------------------------------------------------

# Places from the centre [m], velocities [m/s], where a particle may be born, and x of a plane that some pass.
Start = tuple[np.ndarray, np.ndarray, tuple[float, float, float], float]
_SPEEDS = np.array([(0.9, 0.4, -0.5), (-0.6, 0.8, 0.3), (0.3, -0.7, 0.8), (-0.5, -0.4, -0.9)])
_MIDDLE = np.array([(0.12, 0.05, -0.08), (-0.1, 0.11, 0.06), (0.07, -0.13, 0.1), (-0.07, -0.06, -0.12)])
_RING = np.array([(0.5, 0.1, 0.05), (-0.1, 0.5, -0.05), (-0.5, -0.1, 0.05), (0.1, -0.5, -0.05)])
_SIDES = np.array([(0.8, 0.2, -0.1), (-0.8, -0.15, 0.2), (0.82, -0.3, 0.1), (-0.78, 0.25, -0.15)])
_INWARDS = np.array([(-0.9, -0.1, 0.15), (1.0, 0.1, -0.2), (-0.8, 0.2, 0.1), (0.85, -0.15, 0.2)])

STARTS: dict[str, Start] = {
    "middle": (_MIDDLE, _SPEEDS, (0.0, 0.0, 0.0), 0.2),
    "ring": (_RING, _SPEEDS, (0.5, 0.0, 0.0), 0.52),
    "around": (_SIDES, _INWARDS, (0.8, 0.0, 0.6), 0.7),
}


# So high above the centre is a ceiling within a cavity [m].
CEILING = {"middle": 0.25, "ring": 0.14}


# --- Walls -----------------------------------------------------------------------------------------------


class Numbers(NamedTuple):
    """Of a user-defined surface: its centre and the square of its radius."""

    x: float
    y: float
    z: float
    square: float


def own_phi(p, x, y, z):
    """A ball that is pressed along z."""
    return (x - p.x) ** 2 + (y - p.y) ** 2 + 1.5 * (z - p.z) ** 2 - p.square


def own_gradient(p, x, y, z):
    """Its gradient."""
    return 2.0 * (x - p.x), 2.0 * (y - p.y), 3.0 * (z - p.z)


def _moved(center: Any, *shift: float) -> tuple[float, ...]:
    return tuple(a + b for a, b in zip(center, shift, strict=True))


def _vessel(center: Any, laws: Laws) -> swarm.Box:
    return swarm.Box((HALF, HALF, HALF), center, **laws)


def _ceiling(draft: "Draft", laws: Laws) -> swarm.Plane:
    return swarm.Plane((0.0, 0.0, 1.0), draft.center[2] + CEILING[draft.start], **laws)


def _own(center: Any, side: str, laws: Laws) -> list[Any]:
    low, high = (_moved(center, d, d, d) for d in (-0.6, 0.6))
    numbers = Numbers(*map(float, center), 0.25)
    return [swarm.OwnSurface(numbers, own_phi, own_gradient, size=0.5, bounds=(low, high), side=side, **laws)]


def _sampled(center: Any, side: str, laws: Laws) -> list[Any]:
    ticks = np.linspace(-0.9, 0.9, 10)
    x, y, z = np.meshgrid(ticks, ticks, ticks, indexing="ij")
    values = x * x + y * y + 1.2 * z * z - 0.25
    return [swarm.Sampled(values, 0.2, _moved(center, -0.9, -0.9, -0.9), side=side, **laws)]


def _mesh(center: Any, side: str, laws: Laws) -> list[Any]:
    corners = np.array([(x, y, z) for x in (-0.4, 0.4) for y in (-0.45, 0.45) for z in (-0.5, 0.5)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [three for a, b, c, d in quads for three in ((a, b, c), (a, c, d))]
    return [swarm.Mesh(corners, triangles, side, center, **laws)]


def _rooms(center: Any, side: str, laws: Laws) -> list[Any]:
    parts = [swarm.Box((0.35, 0.4, 0.45), _moved(center, x, 0.0, 0.0)) for x in (-0.35, 0.35)]
    return [swarm.Union(parts, side, **laws)]


def _lens(center: Any, side: str, laws: Laws) -> list[Any]:
    parts = [swarm.Sphere(0.6, _moved(center, x, 0.0, 0.0)) for x in (-0.2, 0.2)]
    return [swarm.Intersection(parts, side, **laws)]


def _cone(center: Any, side: str, laws: Laws) -> list[Any]:
    apex = _moved(center, 0.0, 0.0, -0.45)
    return [swarm.Cone(0.7, (0.0, 0.0, 1.0), apex, side, **laws), *_lids(center, side)]


def _bowl(center: Any, side: str, laws: Laws) -> list[Any]:
    apex = _moved(center, 0.0, 0.0, -0.45)
    return [swarm.Paraboloid(0.125, (0.0, 0.0, 1.0), apex, side, **laws), *_lids(center, side)]


def _lids(center: Any, side: str) -> list[Any]:
    return [swarm.Plane((0.0, 0.0, 1.0), center[2] + 0.4)] if side == "inside" else []


def _planes(center: Any, _side: str, laws: Laws) -> list[Any]:
    x, _y, _z = center
    return [swarm.Plane((1.0, 0.0, 0.0), x + 0.4, **laws), swarm.Plane((-1.0, 0.0, 0.0), 0.4 - x, **laws)]


_PLACES = [(0.2, 0.1, 0.0), (-0.25, -0.1, 0.1), (0.0, 0.3, -0.2)]
_MORE = [(0.3, -0.35, 0.3), (-0.3, 0.35, 0.3), (0.25, -0.3, -0.4), (-0.25, -0.4, -0.35)]


def _field(center: Any, _side: str, laws: Laws) -> list[Any]:
    return [swarm.Spheres([_moved(center, *place) for place in _PLACES], [0.35, 0.3, 0.25], **laws)]


def _listed(center: Any, _side: str, laws: Laws) -> list[Any]:
    return [swarm.Sphere(0.3, _moved(center, *place), "outside", **laws) for place in (*_PLACES, *_MORE)]


def _foam(center: Any, _side: str, laws: Laws) -> list[Any]:
    places = [_moved(center, x, 0.0, 0.0) for x in (-0.25, 0.25)]
    return [swarm.Spheres(places, [0.45, 0.5], side="inside", **laws)]


def _outline() -> list[tuple[float, ...]]:
    return [(-0.4, -0.45), (0.45, -0.4), (0.4, 0.3), (0.1, 0.45), (-0.45, 0.4)]


class Wall(NamedTuple):
    """A kind of wall: how it is made of a centre, a side and laws, where particles start, on which sides, and how."""

    make: Callable[[Any, str, Laws], list[Any]]
    start: str = "middle"
    sides: tuple[str, ...] = ("inside", "outside")
    options: dict[str, Any] = {}  # noqa: RUF012  it is not changed


def _of(make: Callable[..., Any]) -> Callable[[Any, str, Laws], list[Any]]:
    return lambda center, side, laws: [make(center=center, side=side, **laws)]


ON_A_CLUSTER = "box on a cluster"
_box = _of(lambda **k: swarm.Box((0.4, 0.45, 0.5), **k))
_DIAGONAL = ((4.0, 0.5, 0.0), (0.5, 5.0, 0.0), (0.0, 0.0, 3.0))
WALLS: dict[str, Wall] = {
    "sphere": Wall(_of(lambda **k: swarm.Sphere(0.5, **k))),
    "ellipsoid": Wall(_of(lambda **k: swarm.Ellipsoid((0.4, 0.5, 0.6), **k))),
    "torus": Wall(_of(lambda **k: swarm.Torus(0.5, 0.22, **k)), "ring"),
    "capsule": Wall(_of(lambda **k: swarm.Capsule(0.35, 0.4, **k))),
    "box": Wall(_box),
    "cylinder": Wall(_of(lambda **k: swarm.Cylinder(0.45, length=0.9, **k))),
    "cone": Wall(_cone),
    "slab": Wall(_of(lambda **k: swarm.Slab((1.0, 0.0, 0.0), 0.4, **k))),
    "planes": Wall(_planes, sides=("inside",)),
    "quadric": Wall(_of(lambda **k: swarm.Quadric(_DIAGONAL, constant=-1.0, **k))),
    "paraboloid": Wall(_bowl),
    "formula": Wall(_of(lambda **k: swarm.Formula("x**2/0.2 + y**2/0.25 + z**4/0.05 - 1", **k))),
    "own surface": Wall(_own),
    "sampled": Wall(_sampled),
    "union": Wall(_rooms),
    "intersection": Wall(_lens),
    "field": Wall(_field, "around", ("outside",)),
    "listed solids": Wall(_listed, "around", ("outside",)),
    "foam": Wall(_foam, sides=("inside",)),
    "mesh": Wall(_mesh),
    "polygon": Wall(_of(lambda **k: swarm.Polygon(_outline(), **k))),
    "stadium": Wall(_of(lambda **k: swarm.Stadium(0.35, 0.3, **k))),
    "prism": Wall(_of(lambda **k: swarm.Prism(_outline(), 0.9, **k))),
    # With every capability: its results are compared with those of one process.
    ON_A_CLUSTER: Wall(_box, options=shards.OPTIONS),
}
SHAPES = [name for name, wall in WALLS.items() if not wall.options]
# Those without an end: particles leave such a scene, and a cell may repeat along them.
_ENDLESS = {"slab": (None, PERIOD, PERIOD), "planes": (None, PERIOD, PERIOD)}
# Solids without an end: a cell may repeat across them.
_UPRIGHT = {"polygon": (PERIOD, PERIOD, None), "stadium": (PERIOD, PERIOD, None)}


# --- Drafts ----------------------------------------------------------------------------------------------


@dataclass
class Draft:
    """What a capability may change of a run."""

    cell: Cell
    side: str
    start: str
    center: tuple[float, float, float] = CENTER
    laws: Laws = field(default_factory=dict)
    scene: dict[str, Any] = field(default_factory=dict)
    method: dict[str, Any] = field(default_factory=dict)
    options: dict[str, Any] = field(default_factory=dict)
    particles: dict[str, Any] = field(default_factory=dict)
    vessel: bool = True
    beside: Any = None  # the motion of a wall beside that of the cell
    until: float = 1.0

    def spot(self) -> tuple[float, ...]:
        """Where particles may be."""
        return _moved(self.center, *STARTS[self.start][2])

    def across(self) -> int:
        """The axis across the plane of the scene."""
        return "xyz".index(self.scene["plane"])

    def surfaces(self) -> list[Any]:
        """The surfaces of the scene, first the wall of the cell."""
        made = WALLS[self.cell.wall].make(self.center, self.side, self.laws)
        if self.scene.get("plane") is not None and self.cell.wall in _OF_BALLS_APART:
            made = [_within(one, self.across()) for one in made]
        moving = {} if self.beside is None else {"motion": self.beside}
        if self.side == "outside" and self.vessel:
            return [*made, _vessel(self.center, moving)]
        return [*made, _ceiling(self, moving)] if moving else made


def _within(balls: Any, across: int) -> Any:
    """The same balls with their centres in a plane through the origin."""
    name = "centers" if isinstance(balls, swarm.Spheres) else "center"
    return replace(balls, **{name: np.array(getattr(balls, name)) * (np.arange(3) != across)})


class Build(NamedTuple):
    """The arguments of `simulate`."""

    scene: swarm.Scene
    particles: Any
    method: Any
    options: dict[str, Any]


def _arrays(draft: Draft) -> tuple[np.ndarray, np.ndarray]:
    places, speeds, _spot, _x = STARTS[draft.start]
    places, speeds = places.copy(), speeds.copy()
    if draft.scene.get("plane") is not None:
        places[:, draft.across()] = speeds[:, draft.across()] = 0.0
    if draft.particles.get("meet"):
        # The second comes towards the first, and both miss each other's centre by a part of a radius.
        # As far away as the walls leave room.
        apart = {"cone": -0.15, "field": 0.1, "listed solids": 0.1}.get(draft.cell.wall, 0.15)
        way = np.sign(apart)
        places[1] = places[0] + (apart, way * 0.02, 0.0)
        speeds[0], speeds[1] = (way * 0.8, 0.3, 0.2), (way * -0.8, -0.2, 0.1)
    return (places + draft.center).T, speeds.T


def _points(draft: Draft) -> swarm.Particles:
    made = swarm.Particles(*_arrays(draft), MASS)
    if "spin" in draft.particles:
        made.spin = np.tile(np.array(draft.particles["spin"])[:, None], len(made))
    return made


def _balls(draft: Draft) -> swarm.Particles:
    made = _points(draft)
    made.radius = np.full(len(made), RADIUS)
    return made


def _triangle(across: int) -> swarm.Body:
    """A body in a plane."""
    points, turns = np.zeros((3, 3)), 2.0 * np.pi / 3.0 * np.arange(3)
    points[:, np.arange(3) != across] = 0.046 * np.array([np.cos(turns), np.sin(turns)]).T
    return swarm.Body(points, MASS / 3.0, links=[(0, 1), (1, 2), (2, 0)])


def _bodies(draft: Draft) -> swarm.Bodies:
    is_flat = draft.scene.get("plane") is not None
    body = _triangle(draft.across()) if is_flat else swarm.tetrahedron(edge=0.08, mass=MASS)
    places, speeds = _arrays(draft)
    middle = body.points.mean(axis=0)
    arms = (body.points - middle).T[:, :, None]
    some = slice(0, draft.particles.get("copies", 2))
    velocity = np.repeat(speeds[:, None, some], len(body), axis=1)
    velocity = velocity + np.cross(draft.particles.get("spin", (0.0, 0.0, 0.0)), arms, axisb=0, axisc=0)
    return swarm.Bodies(body, places[:, None, some] + arms, velocity)


class Engine(NamedTuple):
    """Particles or bodies, the method, and what every wall of the cell has."""

    start: Callable[[Draft], Any]
    method: Callable[..., Any]
    arguments: dict[str, Any]
    laws: Laws = {}  # noqa: RUF012  it is not changed


_SOFT: dict[str, Any] = {"dt": STEP, "penalty": STIFFNESS}
_LOOP = {**_SOFT, "adaptive": True, "acceleration": "reflection", "on_unconverged": "impact", "tolerance": 1e-20}
ENGINES: dict[str, Engine] = {
    "points, Impact": Engine(_points, swarm.Impact, {}),
    "balls, Impact": Engine(_balls, swarm.Impact, {}),
    "bodies, Impact": Engine(_bodies, swarm.Impact, {"dt": 0.02}),
    "points, Penalty": Engine(_points, swarm.Penalty, _SOFT),
    "grains, Penalty": Engine(_balls, swarm.Penalty, _SOFT),
    "points, AugmentedLagrangian": Engine(_points, swarm.AugmentedLagrangian, _LOOP),
    "points, heavy wall": Engine(_points, swarm.Impact, {}, {"mass": 2.0}),
    "balls, heavy wall": Engine(_balls, swarm.Impact, {}, {"mass": 2.0}),
}
_OF_SINGLES = ("points, Impact", "points, Penalty", "points, AugmentedLagrangian", "bodies, Impact")
_OF_BALLS_APART = ("field", "listed solids")
_OF_BALLS = ("balls, Impact", "grains, Penalty", "balls, heavy wall")
_OF_POINTS = ("points, Impact", "points, Penalty", "points, AugmentedLagrangian", "points, heavy wall")


# --- Capabilities ----------------------------------------------------------------------------------------


class Retro(swarm.WallLaw):
    """Sends some particles back where they came from, others off as a mirror does."""

    probability: float

    def leave(self, v, n, u, random, mass):
        """Its kernel."""
        mirror = v - 2.0 * dot(v - u, n) * n
        return select(random.uniform(0) < self.probability, 2.0 * u - v, mirror)


def _law(**laws: Any) -> Callable[[Draft], None]:
    return lambda draft: draft.laws.update(laws)


def _in_fixed_steps(draft: Draft) -> None:
    """Steps of the loop are cut at impacts on walls at rest without gravity only."""
    if draft.cell.engine == "points, AugmentedLagrangian":
        draft.method.update(adaptive=False, on_unconverged="count")


def _moving(motion: Callable[[Draft], Any]) -> Callable[[Draft], None]:
    def edit(draft: Draft) -> None:
        draft.laws["motion"] = motion(draft)
        _in_fixed_steps(draft)

    return edit


def _turning(draft: Draft) -> Any:
    # The axis passes beside the centre, so that a ball moves too.
    return swarm.Rotation(AXIS, 0.4, _moved(draft.center, 0.1, 0.0, 0.0))


def _gravity(draft: Draft) -> None:
    draft.scene["gravity"] = (0.3, -0.2, -1.0) if draft.scene.get("plane") is None else (0.3, -0.9, 0.0)
    _in_fixed_steps(draft)


def _half_space(draft: Draft) -> swarm.Plane:
    """A volume that reaches each wall of the cell."""
    if draft.cell.wall in ("planes", "field", "listed solids"):
        return swarm.Plane((0.0, -1.0, 0.0), -draft.center[1] - (-0.25 if draft.cell.wall == "listed solids" else 0.1))
    return swarm.Plane((-1.0, 0.0, 0.0), -draft.center[0] - STARTS[draft.start][3])


def _more_bodies(draft: Draft) -> None:
    """Where two bodies do not both meet the wall and pass an opening of it."""
    if draft.cell.engine.startswith("bodies") and draft.cell.wall in ("planes", "cone"):
        draft.particles["copies"], draft.until = 4, 2.0


def _opening(draft: Draft) -> None:
    draft.laws["openings"] = [_half_space(draft)]
    _more_bodies(draft)


def _timed_opening(draft: Draft) -> None:
    # The points of bodies are at the walls sooner than their centres.
    begin = 0.1 if draft.cell.engine.startswith("bodies") else 0.3
    _more_bodies(draft)
    draft.laws["openings"] = [swarm.Opening(_half_space(draft), times=[(begin, 5.0)])]


def _door(draft: Draft) -> None:
    half = swarm.Plane((0.0, 1.0, 0.0), draft.center[1])
    draft.laws["openings"] = [swarm.Opening(half, times=[(0.2, 0.5)], between=True)]


def _present(draft: Draft) -> None:
    # Points push a field of a mass away from them, and meet it no more after a second.
    end = 0.5 if draft.cell[:2] == ("points, heavy wall", "field") else 1.0
    draft.laws["present"] = [(0.0, end)]


# What has no centre turns about the origin.
_ABOUT_THE_ORIGIN = ("planes", "own surface", "union", "intersection", "field", "foam")


def _rotated(draft: Draft) -> None:
    # By an angle that leaves the start inside.
    angle = {"torus": 0.3, "cone": 0.15, "planes": 0.3}.get(draft.cell.wall, TURN["angle"])
    draft.laws["rotation"] = {"axis": AXIS, "angle": angle}
    if draft.cell.wall in _ABOUT_THE_ORIGIN:
        draft.center = (0.0, 0.0, 0.0)


def _long(draft: Draft) -> None:
    draft.until = 2.0


def _alone(draft: Draft) -> None:
    """The cell repeats around a solid; around a cavity it has no meaning."""
    # A capsule is so thin that particles come back later.
    draft.until = 1.4 if draft.cell.wall == "capsule" else 1.2
    if draft.cell.engine.startswith("bodies"):
        draft.until = 2.4
    if draft.cell.wall not in _ENDLESS and "outside" in WALLS[draft.cell.wall].sides:
        draft.side, draft.start, draft.vessel = "outside", "around", False


def _period(draft: Draft) -> None:
    draft.scene["period"] = {**_ENDLESS, **_UPRIGHT}.get(draft.cell.wall, (PERIOD,) * 3)
    draft.options["observables"] = {"cells": lambda frame: np.abs(frame.image).sum()}


def _beside(draft: Draft) -> None:
    draft.beside = swarm.Oscillation((0.02, -0.01, 0.03), 1.0)
    # From among solids particles come later to the vessel.
    draft.until = 1.0 if draft.start != "around" else 2.0
    if draft.cell.engine.startswith("bodies"):
        # They are slow: with the same steps they come to that wall later.
        draft.until = 4.0
    _in_fixed_steps(draft)


def _other_side(draft: Draft) -> None:
    draft.side, draft.start = "outside", "around"


def _flat(draft: Draft) -> None:
    # Through the axis of a wall that is round about z.
    draft.scene["plane"] = "y" if draft.cell.wall in ("cone", "paraboloid") else "z"
    draft.center = tuple(np.where(np.arange(3) == draft.across(), 0.0, CENTER).tolist())


def _counters(draft: Draft) -> None:
    draft.options["counters"] = [swarm.Plane((1.0, 0.0, 0.0), draft.center[0] + STARTS[draft.start][3])]


def _source(draft: Draft) -> None:
    inlet = swarm.Sphere(0.1, draft.spot())
    size = {"radius": RADIUS} if draft.cell.engine in _OF_BALLS else {}
    draft.options["sources"] = [swarm.Source(inlet, volume=True, times=[0.1, 0.2], speed=1.0, mass=MASS, **size)]


def _option(**options: Any) -> Callable[[Draft], None]:
    return lambda draft: draft.options.update(options)


def _method(**arguments: Any) -> Callable[[Draft], None]:
    return lambda draft: draft.method.update(arguments)


def _pairs(**arguments: Any) -> Callable[[Draft], None]:
    return lambda draft: draft.scene.update(pairs=swarm.Pairs(**arguments))


def _meet(draft: Draft) -> None:
    draft.particles["meet"] = True


def _lossy(draft: Draft) -> None:
    # A ball meets a wall so soon after another ball that it loses nothing there.
    _meet(draft)
    draft.laws["restitution"] = 0.7
    draft.scene["pairs"] = swarm.Pairs(restitution=0.6)


def _lasting(draft: Draft) -> None:
    # From one room to the end of the next one the way is longer.
    duration = 1.2 if draft.cell.wall in ("union", "foam") else 0.5
    draft.scene["pairs"] = swarm.Pairs(restitution=0.6, contact_duration=duration)


def _spin(draft: Draft) -> None:
    draft.particles["spin"] = (3.0, -5.0, 4.0)


def _bounce(draft: Draft) -> None:
    draft.laws["restitution"] = 0.6


def _rough(draft: Draft) -> None:
    draft.laws["friction"] = 0.3


def nothing(_draft: Draft) -> None:
    """The run as it is."""


class Capability(NamedTuple):
    """What a capability changes of a run, what the run without it has as well, and the observable that shows it.

    The observable is one that is not 0 in a frame after the first; "" where the motion of the particles differs.
    """

    edit: Callable[[Draft], None]
    base: Callable[[Draft], None] = nothing
    shown: str = ""


CAPABILITIES: dict[str, Capability] = {
    "plain": Capability(nothing, shown="impacts"),
    "gravity": Capability(_gravity, shown="potential_energy"),
    "restitution": Capability(_law(restitution=0.7), shown="dissipated_energy"),
    "friction": Capability(_law(friction=0.3), shown="dissipated_energy"),
    "temperature": Capability(_law(temperature=0.5), shown="wall_heat"),
    "accommodation": Capability(_law(temperature=0.5, accommodation=0.6), shown="wall_heat"),
    "Lambert": Capability(_law(laws=[swarm.Lambert(0.7)])),
    "Absorb": Capability(_law(laws=[swarm.Absorb(0.7)]), shown="absorbed"),
    "CercignaniLampis": Capability(_law(laws=[swarm.CercignaniLampis(0.5, 0.4, 0.6)]), shown="wall_heat"),
    "Sticky": Capability(_law(laws=[swarm.Sticky(0.1)])),
    "own law": Capability(_law(laws=[Retro(0.5)])),
    "translation": Capability(_moving(lambda _d: swarm.Translation((0.2, 0.1, -0.15))), shown="wall_work"),
    "oscillation": Capability(_moving(lambda _d: swarm.Oscillation((0.05, 0.03, 0.04), 1.0)), shown="wall_work"),
    "turning": Capability(_moving(_turning), shown="wall_work"),
    "path": Capability(
        _moving(lambda _d: swarm.Path((0.0, 0.5, 2.0), ((0.0, 0.0, 0.0), (0.05, 0.0, 0.02), (0.0, 0.06, 0.0)))),
        shown="wall_work",
    ),
    "mass": Capability(_law(mass=2.0), shown="wall_velocity"),
    "inertia": Capability(lambda d: d.laws.update(motion=_turning(d), inertia=0.2), shown="wall_spin"),
    "opening": Capability(_opening, shown="escaped"),
    "timed opening": Capability(_timed_opening, _long, "escaped"),
    "door": Capability(_door),
    "present": Capability(_present, _long),
    "period": Capability(_period, _alone, "cells"),
    "rotation": Capability(_rotated),
    "side": Capability(_other_side),
    "plane": Capability(_flat),
    "counters": Capability(_counters, shown="crossings"),
    "source": Capability(_source, shown="born"),
    "log": Capability(_option(impacts="impacts.h5")),
    "member impacts": Capability(_option(member_impacts=True), shown="member_impacts"),
    "contact step": Capability(_method(contact_step=1e-2)),
    "contact start": Capability(_method(contact_start="centred"), lambda d: _centred(d)),
    "pair restitution": Capability(_pairs(restitution=0.6), _meet, "collisions"),
    "pair friction": Capability(_pairs(friction=0.3), _meet, "collisions"),
    "contact duration": Capability(_lasting, _lossy, "collisions"),
    "spin": Capability(_spin, _rough),
    "motion beside": Capability(_beside, shown="wall_work"),
    "cluster": Capability(lambda draft: draft.options.update(_of_cluster(draft.cell)), shown="impacts"),
}


# Their observable is not 0 without them either.
STATIC = ("gravity", "pair restitution", "pair friction", "contact duration", "path")


def _of_cluster(cell: Cell) -> dict[str, Any]:
    """Two shards; one where particles depend on one another."""
    is_coupled = cell.engine not in _OF_SINGLES or cell.capability in ("mass", "inertia")
    return {**shards.OPTIONS, "shards": None} if is_coupled else dict(shards.OPTIONS)


def _centred(draft: Draft) -> None:
    if ENGINES[draft.cell.engine].method is swarm.Impact:
        draft.method["contact_step"] = 1e-2


_OF_WHAT_MEETS = ("pair restitution", "pair friction", "contact duration", "spin")
_WITHOUT_MEANING = {
    ("sphere", "rotation"): "a ball is the same when it is turned",
    ("listed solids", "rotation"): "a ball is the same when it is turned",
    ("listed solids", "opening"): "the volume that reaches each of the solids leaves none that is met",
    ("listed solids", "contact duration"): "no ball meets a solid so soon after another ball",
    ("foam", "motion beside"): "a foam is alone in its scene",
    ("cone", "period"): "an endless cone is not the same in the next cell",
    ("paraboloid", "period"): "an endless paraboloid is not the same in the next cell",
    ("sampled", "plane"): "a spline between samples is upright on a plane to its error of interpolation only",
    (ON_A_CLUSTER, "cluster"): "it is on a cluster",
}


def _without_steps(cell: Cell) -> str | None:
    """None, or why a contact step of an engine says nothing."""
    method = ENGINES[cell.engine].method
    if method is swarm.Penalty:
        return "Penalty has no such argument"
    if method is swarm.AugmentedLagrangian and cell.capability == "contact step":
        return "AugmentedLagrangian has no such argument"
    if cell.engine in ("balls, Impact", "balls, heavy wall"):
        return "hard balls meet one another at instants: a contact that took a time would have no place among these"
    return None


def meaning(cell: Cell) -> str | None:
    """None, or why a combination says nothing, and is no cell."""
    engine, wall = ENGINES[cell.engine], WALLS[cell.wall]
    name, engine_of_points = cell.capability, cell.engine in _OF_POINTS
    if name == "mass" and "mass" in engine.laws:
        return "the engine is that of walls with a mass"
    if name in ("contact step", "contact start") and (why := _without_steps(cell)) is not None:
        return why
    if name in ("oscillation", "turning", "path") and "mass" in engine.laws:
        return "impacts move the wall, so that its motion cannot be given"
    if name == "door" and cell.wall == "planes" and cell.engine == "balls, heavy wall":
        return "planes have no rooms that a door could be between, and these flights are cut nowhere"
    if engine_of_points and name in _OF_WHAT_MEETS:
        return "a point neither meets another one nor turns"
    if name == "contact duration" and engine.method is swarm.Penalty:
        return "a contact with Penalty lasts as long as the particles overlap"
    if name == "side" and len(wall.sides) == 1:
        return "the wall has one side"
    if name == "side" and wall.start == "around":
        return "the wall is a solid"
    return _WITHOUT_MEANING.get((cell.wall, name))


CELLS: tuple[Cell, ...] = tuple(
    cell for e in ENGINES for w in WALLS for c in CAPABILITIES if meaning(cell := Cell(e, w, c)) is None
)


def draft_of(cell: Cell, with_capability: bool = True) -> Draft:
    """The draft of a cell, or of the same run without its capability."""
    engine, wall, capability = ENGINES[cell.engine], WALLS[cell.wall], CAPABILITIES[cell.capability]
    side = wall.sides[0]
    options = _of_cluster(cell) if wall.options else {}
    draft = Draft(cell, side, wall.start, laws=dict(engine.laws), method=dict(engine.arguments), options=options)
    capability.base(draft)
    if with_capability:
        capability.edit(draft)
    return draft


def build(draft: Draft) -> Build:
    """The arguments of a run.

    Raises:
        SceneError: they do not go together.
    """
    engine = ENGINES[draft.cell.engine]
    scene = swarm.Scene(draft.surfaces(), **draft.scene)
    method = engine.method(**draft.method)
    options = {"until": draft.until, "every": draft.until / 4.0, "compile": "never", "seed": 1, **draft.options}
    return Build(scene, engine.start(draft), method, options)
