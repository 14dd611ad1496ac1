"""Nanoseconds an impact in billiards of two dimensions, beside the circle and a capped cylinder in space.

One thread, kernels only, minimum and median; `ratio` is to the circle of the same run.
"""

import math

import swarm
from swarm.surfaces import Surface

from .bars import advance_seconds, per_impact
from .report import Row, in_turn, show, write

GRAVITY = (0.0, -0.3, 0.0)
L = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]


def star(sides: int) -> swarm.Polygon:
    """A star of so many sides."""
    angles = [2.0 * math.pi * k / sides for k in range(sides)]
    radii = [1.0 + 0.3 * (k % 2) for k in range(sides)]
    return swarm.Polygon([(r * math.cos(a), r * math.sin(a)) for r, a in zip(radii, angles, strict=True)])


# name -> (surfaces, gravity, plane, bar)
TABLES: dict[str, tuple[list[Surface], tuple[float, float, float] | None, str | None, str]] = {
    "circle": ([swarm.Sphere(1.0)], None, "z", ""),
    "ellipse": ([swarm.Ellipsoid((1.0, 0.6, 1.0))], None, "z", ""),
    "box": ([swarm.Box((1.0, 0.6, 1.0))], None, "z", ""),
    "capped cylinder, in space": ([swarm.Cylinder(1.0, length=2.0)], None, None, ""),
    "circle as an outline": ([swarm.Polygon([(-1.0, 0.0, 1.0), (1.0, 0.0, 1.0)])], None, "z", ""),
    "triangle": ([swarm.Polygon([(0.0, 0.0), (2.0, 0.0), (0.0, 1.0)])], None, "z", ""),
    "stadium": ([swarm.Stadium(1.0, 2.0)], None, "z", ""),
    "L": ([swarm.Polygon(L)], None, "z", ""),
    "star of 24 sides": ([star(24)], None, "z", ""),
    "star of 100 sides": ([star(100)], None, "z", ""),
    "star of 1000 sides": ([star(1000)], None, "z", ""),
    "circle, gravity": ([swarm.Sphere(1.0)], GRAVITY, "z", ""),
    "stadium, gravity": ([swarm.Stadium(1.0, 2.0)], GRAVITY, "z", ""),
    "L, gravity": ([swarm.Polygon(L)], GRAVITY, "z", ""),
    "star of 100 sides, gravity": ([star(100)], GRAVITY, "z", ""),
}
QUICK = ("circle", "stadium")


def main(quick: bool) -> None:
    """Measure, print, and write the table of this machine."""
    n, until, rounds = (2, 10.0, 1) if quick else (10_000, 40.0, 20)
    measures = {}
    for name in QUICK if quick else TABLES:
        surfaces, gravity, plane, _bar = TABLES[name]
        measures[name] = advance_seconds(swarm.Scene(surfaces, gravity, plane=plane), swarm.Impact(), n, until)
    figures = in_turn({name: lambda one=one: 1e9 * per_impact(one) for name, one in measures.items()}, rounds)
    first, _median = figures[next(iter(figures))]
    rows = [
        Row(name, best, median, "ns/impact", TABLES[name][3], best / first) for name, (best, median) in figures.items()
    ]
    show(rows)
    if not quick:
        write(rows, "plane")
