"""Nanoseconds an impact of `Impact` in scenes from one sphere to the fullest: a scene pays for what is in it.

One thread, kernels only, seconds of the processor, minimum and median; `ratio` is to the first scene of the same run.
"""

import time
from collections.abc import Sequence

import swarm
from swarm.surfaces import Surface

from .bars import advance_seconds, per_impact
from .report import Row, in_turn, show, write

GRAVITY = (0.0, 0.0, -1.0)


def _balls(count: int) -> list[Surface]:
    """A sphere with this many solid balls in it."""
    places = [(s, 0.0, 0.0) for s in (0.25, -0.25)] + [(0.0, s, 0.0) for s in (0.25, -0.25)]
    places += [(0.0, 0.0, s) for s in (0.25, -0.25)]
    return [swarm.Sphere(0.5), *(swarm.Sphere(0.1, place, "outside") for place in places[:count])]


SPHERE = swarm.Sphere(0.5)
ELLIPSOID = swarm.Ellipsoid((0.3, 0.3, 0.6))
TURN = (0.9, 0.1, 0.2, 0.3)
_SUM = "x**2/0.09 + y**2/0.09 + z**2/0.16 - 1 + 0.1*"
# What the table calls the functions of a formula.
FUNCTIONS = {
    "sines": _SUM + "sin(10*x)*sin(10*y)",
    "exp": _SUM + "exp(x*y)",
    "log": _SUM + "log(1 + x**2 + y**2)",
    "a power of 0.7": _SUM + "(1 + x**2)**0.7",
}
OF_DEGREE_6 = swarm.Formula("x**6/0.03 + y**6/0.03 + z**6/0.05 - 1")
# name -> (surfaces, gravity, bar)
SCENES: dict[str, tuple[list[Surface], tuple[float, float, float] | None, str]] = {
    "sphere": ([SPHERE], None, "6"),
    "ellipsoid": ([ELLIPSOID], None, "7.5"),
    "ellipsoid, rotated": ([swarm.Ellipsoid((0.3, 0.3, 0.6), rotation=TURN)], None, ""),
    "box": ([swarm.Box((0.5, 0.4, 0.3))], None, "10"),
    "box, rotated": ([swarm.Box((0.5, 0.4, 0.3), rotation=TURN)], None, ""),
    "capped cylinder": ([swarm.Cylinder(0.4, length=1.0)], None, "14"),
    "general quadric": ([swarm.Quadric(((9.0, 1.0, 0.0), (1.0, 6.0, 0.0), (0.0, 0.0, 4.0)), constant=-1.0)], None, ""),
    "sphere, 1 ball": (_balls(1), None, ""),
    "sphere, 2 balls": (_balls(2), None, ""),
    "sphere, 4 balls": (_balls(4), None, ""),
    "sphere, 6 balls": (_balls(6), None, ""),
    "sphere, gravity": ([SPHERE], GRAVITY, "40"),
    "ellipsoid, gravity": ([ELLIPSOID], GRAVITY, "45"),
    "box, gravity": ([swarm.Box((0.5, 0.4, 0.3))], GRAVITY, ""),
    "sphere, 2 balls, gravity": (_balls(2), GRAVITY, ""),
    "sphere, restitution 0.999": ([swarm.Sphere(0.5, restitution=0.999)], None, ""),
    "capsule": ([swarm.Capsule(0.3, 0.6)], None, ""),
    "capsule, gravity": ([swarm.Capsule(0.3, 0.6)], GRAVITY, ""),
    "torus": ([swarm.Torus(0.5, 0.2)], None, "40"),
    "torus, gravity": ([swarm.Torus(0.5, 0.2)], GRAVITY, "150"),
    "formula of the ellipsoid": ([swarm.Formula("x**2/0.09 + y**2/0.09 + z**2/0.36 - 1")], None, "12 x 8"),
    "formula of the ellipsoid, gravity": (
        [swarm.Formula("x**2/0.09 + y**2/0.09 + z**2/0.36 - 1")],
        GRAVITY,
        "45",
    ),
    "formula of degree 4": ([swarm.Formula("x**4/0.09 + y**4/0.09 + z**4/0.13 - 1")], None, ""),
    "formula of degree 4, gravity": (
        [swarm.Formula("x**4/0.09 + y**4/0.09 + z**4/0.13 - 1")],
        GRAVITY,
        "",
    ),
    "formula of the torus": ([swarm.Formula("(x**2 + y**2 + z**2 + 0.21)**2 - (x**2 + y**2)")], None, ""),
    "formula of the quadric": ([swarm.Formula("9*x**2 + 6*y**2 + 4*z**2 + 2*x*y - 1")], None, ""),
    **{
        f"formula with {name}{', gravity' * (gravity is not None)}": ([swarm.Formula(text)], gravity, "")
        for name, text in FUNCTIONS.items()
        for gravity in (None, GRAVITY)
    },
    **{
        f"solid with {name} in a box, gravity": (
            [swarm.Box((0.9, 0.9, 0.9)), swarm.Formula(text, side="outside")],
            GRAVITY,
            "",
        )
        for name, text in FUNCTIONS.items()
    },
    "formula of degree 6": ([OF_DEGREE_6], None, ""),
    "formula of degree 6, gravity": ([OF_DEGREE_6], GRAVITY, ""),
    "sphere, box, cylinder, capsule, torus, gravity": (
        [
            swarm.Sphere(0.5),
            swarm.Box((0.06, 0.05, 0.04), (0.25, 0.0, 0.0), "outside", rotation=TURN),
            swarm.Cylinder(0.05, length=0.1, center=(-0.25, 0.0, 0.0), side="outside"),
            swarm.Capsule(0.03, 0.1, center=(0.0, 0.25, 0.0), side="outside"),
            swarm.Torus(0.1, 0.03, (0.0, -0.25, 0.0), "outside"),
        ],
        GRAVITY,
        "300",
    ),
}


# (a formula, a shape, how many times as long as the shape it may take)
FORMULAS = (
    ("formula of degree 4", "sphere", 4.0),
    ("formula of the torus", "torus", 1.3),
    ("formula of the quadric", "general quadric", 1.3),
    ("formula with sines", "sphere", 40.0),
)

# Every scene compiles kernels of its own: a quick run takes one of each kind of flight.
QUICK = ("sphere", "capped cylinder", "sphere, gravity", "formula of the ellipsoid", "formula of degree 4")


def main(quick: bool, scenes: Sequence[str] | None = None) -> None:
    """Measure, print, and write the table of this machine; of some scenes alone nothing is written."""
    n, until, rounds = (2, 5.0, 1) if quick else (10_000, 40.0, 30)
    measures = {}
    for name in scenes or (QUICK if quick else SCENES):
        surfaces, gravity, _bar = SCENES[name]
        scene = swarm.Scene(surfaces, gravity)
        measures[name] = advance_seconds(scene, swarm.Impact(), n, until, clock=time.process_time)
    figures = in_turn({name: lambda one=one: 1e9 * per_impact(one) for name, one in measures.items()}, rounds)
    first, _median = figures[next(iter(figures))]
    rows = [
        Row(name, best, median, "ns/impact", SCENES[name][2], best / first) for name, (best, median) in figures.items()
    ]
    for formula, shape, bar in FORMULAS:
        if formula in figures and shape in figures:
            best, median = (mine / its for mine, its in zip(figures[formula], figures[shape], strict=True))
            rows.append(Row(f"{formula} / {shape}", best, median, "times", f"{bar:g}"))
    show(rows)
    if not (quick or scenes):
        write(rows, "scenes")
