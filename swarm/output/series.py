"""The time series that recordings and plots show, from the observables of frames."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..bodies.body import Body
from ..methods import Method
from ..scene import Scene
from .shapes import Shape

# Stands for the logarithm of zero.
NOTHING = -18.0

# Of each plot, by the first part of the entities on it: its title, and whether the values are a log10.
VIEWS = {
    "energy": ("energy [J]", False),
    "energy_error": ("worst relative energy error", True),
    "link_error": ("worst relative error of a link's length", True),
    "penetration": ("largest penetration [m]", True),
    "impacts": ("impacts per second [1/s]", False),
    "pressure": ("pressure on each surface [Pa]", False),
    "force": ("force on each surface [N]", False),
    "sliding": ("how many slide or rest", False),
    "heat": ("heat from each surface [W]", False),
}
# Views that pictures leave out where all values are 0.
RARE = ("sliding",)

# A frame's time [s] and its observables.
Seen = tuple[float, dict[str, Any]] | None


@dataclass(frozen=True)
class Line:
    """A time series: its entity, its name in the legend, and its value at a frame.

    The value is a function of the frame's time and observables, and of those of the frame before.
    """

    path: str
    name: str
    value: Callable[[float, dict[str, Any], Seen], float]


def group_of(path: str) -> str:
    """The key in `VIEWS` of an entity."""
    return path.split("/")[1]


def lines_of(scene: Scene, method: Method, shapes: list[Shape], body: Body | None = None) -> list[Line]:
    """The time series of a scene with particles or bodies, without those that are always zero in it."""
    laws, one = scene.laws(), "particle" if body is None else "body"
    every = "all particles" if body is None else "all bodies"
    energies = {"total": True, "kinetic": True, "potential": scene.gravity is not None}
    energies |= {"contact": method.law() is not None, "dissipated": laws is not None and laws[:2] != (None, None)}
    lines = [Line(f"/energy/{name}", name, _of(f"{name}_energy")) for name, there in energies.items() if there]
    lines += [
        Line("/energy_error", f"of a {one}", _logarithm_of("energy_error")),
        Line("/penetration", f"of a {one}", _logarithm_of("max_penetration")),
        Line("/impacts", every, _rate("impacts", 1.0)),
    ]
    if body is not None and (len(body.springs) or body.strain is not None):
        lines.append(Line("/energy/elastic", "elastic", _of("contact_energy")))
    if body is not None and len(body.links):
        lines.append(Line("/link_error", "of a link", _logarithm_of("link_error")))
    if body is not None and any(motion is not None for motion in body.anchors.values()):
        lines.append(Line("/energy/work", "work of anchors", _of("work")))
    # The walls of an open volume are drawn in part, so they have no area.
    group = "force" if scene.is_open() else "pressure"
    for i, shape in enumerate(shapes):
        area = 1.0 if scene.is_open() else shape.area()
        if area > 0.0:
            lines.append(Line(f"/{group}/{shape.name}", shape.name, _rate("impulse", area, i)))
    if method.is_rigid():
        lines.append(Line("/sliding", every, _of("sliding")))
    lines += _lines_of_walls(scene, shapes)
    return lines


def _lines_of_walls(scene: Scene, shapes: list[Shape]) -> list[Line]:
    """Of surfaces that give heat, do work, or are moved."""
    lines = []
    for i, shape in enumerate(shapes):
        surface = scene.surfaces[i]
        if surface.temperature is not None:
            lines.append(Line(f"/heat/{shape.name}", shape.name, _rate("wall_heat", 1.0, i)))
        if surface.reacts():
            lines.append(Line(f"/energy/{shape.name}", f"energy of {shape.name}", _of_surface("wall_energy", i)))
        elif surface.motion is not None:
            lines.append(Line(f"/energy/work_{shape.name}", f"work of {shape.name}", _of_surface("wall_work", i)))
    return lines


def views_of(lines: list[Line]) -> dict[str, list[Line]]:
    """The lines of each plot, by the key in `VIEWS`."""
    views: dict[str, list[Line]] = {}
    for line in lines:
        views.setdefault(group_of(line.path), []).append(line)
    return views


def row_of(lines: list[Line], moment: float, seen: dict[str, Any], before: Seen) -> list[float]:
    """The value of every line at a frame; NaN where there is none."""
    return [line.value(moment, seen, before) for line in lines]


def _of(name: str) -> Callable[..., float]:
    # Files of older versions have no "sliding", and runs of particles no "work".
    return lambda _moment, seen, _before: float(seen.get(name, 0.0))


def _of_surface(name: str, i: int) -> Callable[..., float]:
    return lambda _moment, seen, _before: float(seen[name][i])


def _logarithm_of(name: str) -> Callable[..., float]:
    return lambda _moment, seen, _before: math.log10(max(seen[name], 10.0**NOTHING))


def _rate(name: str, per: float, i: int | None = None) -> Callable[..., float]:
    """The rate of a cumulative observable since the frame before; NaN at the first frame."""

    def value(moment: float, seen: dict[str, Any], before: Seen) -> float:
        if before is None:
            return math.nan
        now, then = seen[name], before[1][name]
        grown = now - then if i is None else now[i] - then[i]
        return float(grown / ((moment - before[0]) * per))

    return value
