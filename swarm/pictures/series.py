"""The time series in recordings and plots, from the observables of frames."""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..bodies.body import Body
from ..methods import Method
from ..scene import Scene
from ..state import Floats
from ..surfaces.union import part_at
from ..triangles.shape import Shape
from ..words.named import name_of
from ..words.nouns import labels

# The value for the logarithm of zero.
NOTHING = -18.0


@dataclass(frozen=True)
class Graph:
    """A graph of time series: its quantity, and its form.

    Attributes:
        quantity: the name of its quantity.
        unit: the unit of its values; "" for numbers and relative errors.
        title: its title.
        label: the label of its axis, if the title says the rest; None: the quantity.
        is_error: the values are log10 of errors, `NOTHING` where the error is 0.
        is_rare: pictures leave it out where all values are 0.
        is_rate: the values are increases per second, one for the time from frame to frame.
    """

    quantity: str
    unit: str
    title: str
    label: str | None = None
    is_error: bool = False
    is_rare: bool = False
    is_rate: bool = False

    @property
    def name(self) -> str:
        """The quantity with its unit."""
        return f"{self.quantity} [{self.unit}]" if self.unit else self.quantity

    def across(self, plane: str | None) -> "Graph":
        """The graph for a scene of two dimensions, in which pressures are forces per length."""
        return self if plane is None or self.unit != "Pa" else replace(self, unit="N/m")


# The graphs by the first part of their entities' paths.
GRAPHS = {
    "energy": Graph("energy", "J", "energy of all"),
    "energy_error": Graph(
        "worst relative energy error", "", "energy error, worst particle", "relative error", is_error=True
    ),
    "link_error": Graph(
        "worst relative error of a link's length", "", "length error, worst link", "relative error", is_error=True
    ),
    "penetration": Graph("largest penetration", "m", "depth in the walls", "depth", is_error=True),
    "overlap": Graph("largest overlap", "m", "overlap of balls", "overlap", is_error=True),
    "number": Graph("particles", "", "particles in the scene"),
    "impacts": Graph("impacts", "1/s", "impacts per second", is_rate=True),
    "pressure": Graph("pressure", "Pa", "pressure on the walls", is_rate=True),
    "force": Graph("force", "N", "force on the walls", is_rate=True),
    "crossings": Graph("crossings", "1/s", "crossings of counters", is_rare=True, is_rate=True),
    "flow": Graph("net flow", "1/s", "net flow through counters", is_rare=True, is_rate=True),
    "sliding": Graph("particles that slide or rest", "", "sliding and resting", "particles", is_rare=True),
    "heat": Graph("heat from walls", "W", "heat from walls", "heat", is_rare=True, is_rate=True),
    "position": Graph("displacement", "m", "displacement of walls", is_rare=True),
}
# The energies of particles, in the order of a plot.
ENERGIES = ("total", "kinetic", "rotational", "potential", "contact", "dissipated", "elastic")


@dataclass(frozen=True)
class Line:
    """A time series of one number of an observable.

    Attributes:
        path: the path of its entity.
        name: its name in the legend.
        observable: the name of the observable.
        surface: the surface, for an observable with a number for each. Other rows of numbers are added up.
        logarithm: whether the logarithm is shown.
        per: for a rate, the divisor of the increase per second since the last frame.
        along: for a vector, the direction of the component that is shown.
    """

    path: str
    name: str
    observable: str
    surface: int | None = None
    logarithm: bool = False
    per: float | None = None
    along: tuple[float, ...] | None = None

    def values(self, times: Floats, seen: dict[str, Any]) -> Floats:
        """The values at frames with these times [s] and observables; rates have NaN at the first frame."""
        # Files of older versions have no "sliding", and runs of particles no "work".
        column = np.asarray(seen.get(self.observable, np.zeros(len(times))), np.float64)
        if self.surface is not None:
            column = column[:, self.surface]
        if column.ndim > 1:
            column = column @ np.array(self.along or (1.0,) * column.shape[1])
        if self.logarithm:
            return np.asarray(np.log10(np.maximum(column, 10.0**NOTHING)))
        if self.per is None:
            return column
        return np.diff(column, prepend=np.nan) / (np.diff(times, prepend=np.nan) * self.per)


def group_of(path: str) -> str:
    """The key in `GRAPHS` of an entity."""
    return path.split("/")[1]


def lines_of(
    scene: Scene, method: Method, shapes: list[Shape], body: Body | None = None, more: Collection[str] = ()
) -> list[Line]:
    """The time series of a scene with particles or bodies, without those that are always zero in it.

    `more` has the observables that only some runs have: with sources "source_energy", with balls "collisions", with
    rotating balls "rotational_energy", and with soft ones "largest_overlap".
    """
    named, one = scene.names_laws(), "particle" if body is None else "body"
    laws = None if named else scene.compiled().laws
    every = "all particles" if body is None else "all bodies"
    energies = {"total": True, "kinetic": True, "potential": scene.gravity is not None}
    energies |= {
        "contact": method.law() is not None,
        "dissipated": named or (laws is not None and laws[:2] != (None, None)) or _pairs_lose(scene),
        "rotational": "rotational_energy" in more,
    }
    lines = [Line(f"/energy/{name}", name, f"{name}_energy") for name, there in energies.items() if there]
    lines += [Line("/energy/sources", "brought by sources", "source_energy")] * ("source_energy" in more)
    lines += [
        Line("/energy_error", f"of a {one}", "energy_error", logarithm=True),
        Line("/penetration", f"of a {one}", "max_penetration", logarithm=True),
    ]
    lines += [Line("/overlap", "of a contact", "largest_overlap", logarithm=True)] * ("largest_overlap" in more)
    if scene.surfaces:
        lines.append(Line("/impacts", every if "collisions" not in more else "walls", "impacts", per=1.0))
    if "collisions" in more:
        lines.append(Line("/impacts/collisions", "other balls", "collisions", per=1.0))
        lines += [Line("/pressure/virial", "virial", "pressure")] * (not scene.is_open())
    if body is not None and (len(body.springs) or body.strain is not None):
        lines.append(Line("/energy/elastic", "elastic", "contact_energy"))
    if body is not None and len(body.links):
        lines.append(Line("/link_error", "of a link", "link_error", logarithm=True))
    if body is not None and any(motion is not None for motion in body.anchors.values()):
        lines.append(Line("/energy/work", "work of anchors", "work"))
    if method.is_rigid():
        lines.append(Line("/sliding", every, "sliding"))
    if isinstance(more, Mapping):
        lines += _lines_of_numbers(more) + _lines_of_moved(scene)
    return lines + _lines_of_walls(scene, shapes)


def _lines_of_numbers(seen: Mapping[str, Any]) -> list[Line]:
    """The lines of numbers, from the observables of a run.

    They show the numbers of particles that are inside, came, escaped or were absorbed, and the crossings of counters.
    """
    lines = []
    if "inside" in seen:
        words = {"inside": "inside", "born": "came", "escaped": "escaped", "absorbed": "absorbed"}
        lines = [Line(f"/number/{k}", name, k) for k, name in words.items() if np.any(seen.get(k, 0))]
    counters = np.shape(seen.get("crossings", [[]]))[1]
    for k in range(counters):
        which = "" if counters == 1 else f"counter {k}"
        for name, along in (("out", (1.0, 0.0)), ("back", (0.0, 1.0))):
            lines.append(
                Line(f"/crossings/{k}_{name}", f"{which} {name}".strip(), "crossings", k, per=1.0, along=along)
            )
        lines.append(Line(f"/flow/{k}", which or "out less back", "crossings", k, per=1.0, along=(1.0, -1.0)))
    return lines


def _lines_of_moved(scene: Scene) -> list[Line]:
    """The displacements of surfaces by impacts: along their guides, or along each axis."""
    lines, names = [], labels(scene)
    for i, surface in enumerate(scene.surfaces):
        if surface.reacts() and surface.mass is not None:
            guide = getattr(surface.motion, "axis", None) if surface.inertia is None else None
            ways = {"": guide} if guide is not None else dict(zip(("x", "y", "z"), np.eye(3).tolist(), strict=True))
            for axis, along in ways.items():
                name = f"{names[i, ()]} {axis}".strip()
                lines.append(Line(f"/position/{i}_{axis}", name, "wall_position", i, along=tuple(along)))
    return lines


def _pairs_lose(scene: Scene) -> bool:
    """Whether particles lose energy in collisions."""
    return scene.pairs is not None and (scene.pairs.restitution < 1.0 or scene.pairs.friction > 0.0)


def _lines_of_walls(scene: Scene, shapes: list[Shape]) -> list[Line]:
    """The lines of surfaces or, if a surface has parts, of its parts: impulse, heat, work."""
    lines, names = [], labels(scene)
    # The walls of an open volume are drawn in part, so they have no area.
    group = "force" if scene.is_open() else "pressure"
    for shape in shapes:
        key = shape.surface, shape.place
        number, of = (scene.parts.index(key), "part") if shape.place else (shape.surface, "wall")
        surface, area = part_at(scene.surfaces[shape.surface], shape.place), shape.area()
        if scene.is_open() or area > 0.0:
            pushed, per = "part_impulse" if shape.place else "impulse", 1.0 if scene.is_open() else area
            lines.append(Line(f"/{group}/{shape.name}", names[key], pushed, number, per=per))
        if surface.temperature is not None or surface.laws:
            lines.append(Line(f"/heat/{shape.name}", names[key], f"{of}_heat", number, per=1.0))
    for i, surface in enumerate(scene.surfaces):
        name = name_of(scene, i)
        if surface.reacts():
            lines.append(Line(f"/energy/{name}", f"energy of {names[i, ()]}", "wall_energy", i))
        elif any(shape.surface == i and part_at(surface, shape.place).motion is not None for shape in shapes):
            lines.append(Line(f"/energy/work_{name}", f"work of {names[i, ()]}", "wall_work", i))
    return lines


def plots_of(curves: Mapping[str, tuple[str, Floats, Floats]]) -> dict[str, dict[str, tuple[Floats, Floats]]]:
    """The curves of each plot of a picture, (times [s], values) by their names, by the key in `GRAPHS`.

    The argument has (name, times, values) by entity. In every picture the curves have the same order, and so the
    same colours.
    """
    plots: dict[str, dict[str, tuple[Floats, Floats]]] = {}
    # Recordings of other versions may have other entities.
    for path in sorted((path for path in curves if group_of(path) in GRAPHS), key=_place):
        name, times, values = curves[path]
        if not GRAPHS[group_of(path)].is_rare or values.any():
            plots.setdefault(group_of(path), {})[name] = times, values
    return plots


def says_nothing(group: str, curves: Mapping[str, tuple[Floats, Floats]]) -> bool:
    """Whether a sentence can replace a plot: of rates at a single frame, or of errors that are all 0."""
    values = [values for _times, values in curves.values()]
    if not any(len(column) for column in values):
        return True
    return GRAPHS[group].is_error and all(bool((column <= NOTHING).all()) for column in values)


def _place(path: str) -> tuple[int, ...]:
    """The sort key of an entity: its plot, its energy, and the number of its surface."""
    group, name = group_of(path), path.rpartition("/")[2]
    energy = ENERGIES.index(name) if name in ENERGIES else len(ENERGIES)
    return list(GRAPHS).index(group), energy, *map(int, re.findall(r"\d+", name))


def views_of(lines: list[Line]) -> dict[str, list[Line]]:
    """The lines of each plot, by the key in `GRAPHS`."""
    views: dict[str, list[Line]] = {}
    for line in lines:
        views.setdefault(group_of(line.path), []).append(line)
    return views
