"""Bodies: nanoseconds a step and an impact, and what is conserved, each figure beside its bar."""

import time
from collections.abc import Callable

import numpy as np

import swarm

from .peers import mujoco
from .report import Row, in_turn, show, tier, write

WALLS = (0.5, 0.4, 0.3)
COUNT, DT, SPEED, SPIN = 10_000, 5e-3, 0.5, 2.0
# Steps that are timed, and how long impacts are counted and figures conserved [s].
_STEPS, _LONG = 100, 200.0
# A cavity so wide that nothing is hit.
_FAR, _NEAR = 100.0, 0.5
# Bars of a step without contact [ns].
_BARS = {"dumbbell": "60", "tetrahedron": "400", "chain of ten": "1000"}


def makers() -> dict[str, Callable[[], swarm.Body]]:
    """The bodies by name."""
    return {
        "dumbbell": lambda: swarm.dumbbell(0.1, 2.0),
        "tetrahedron": lambda: swarm.tetrahedron(0.1, 4.0),
        "chain of ten": lambda: swarm.chain(10, 0.2, 10.0),
    }


def _start(body: swarm.Body, radius: float, count: int) -> tuple[swarm.Scene, swarm.Bodies]:
    scene = swarm.Scene([swarm.Sphere(radius)])
    return scene, swarm.place(scene, body, count, speed=SPEED, spin=SPIN, seed=0)


def _run(scene: swarm.Scene, bodies: swarm.Bodies, until: float, threads: int, order: int = 2) -> swarm.Result:
    method = swarm.Impact(dt=DT, order=order)
    return swarm.simulate(scene, bodies, method, until=until, threads=threads, progress=False, compile=tier())


def _nanoseconds(scene: swarm.Scene, bodies: swarm.Bodies, steps: int, threads: int, order: int) -> Callable[[], float]:
    """A measurement: nanoseconds a step; what a run costs besides is measured by a run of one step."""

    def measure() -> float:
        seconds = []
        for many in (steps + 1, 1):
            start = time.perf_counter()
            _run(scene, bodies, many * DT, threads, order)
            seconds.append(time.perf_counter() - start)
        return 1e9 * (seconds[0] - seconds[1]) / steps / len(bodies)

    return measure


def steps(name: str, quick: bool) -> list[Row]:
    """A step without contact, with one thread and two, and composed."""
    count = 2 if quick else COUNT
    scene, bodies = _start(makers()[name](), _FAR, count)
    _run(scene, bodies, DT, 1)
    _run(scene, bodies, DT, 1, 4)
    many = 2 if quick else _STEPS
    ways = {"one thread": (1, 2), "two threads": (2, 2), "of fourth order": (1, 4)}
    figures = in_turn({way: _nanoseconds(scene, bodies, many, *how) for way, how in ways.items()}, 1 if quick else 5)
    seen = _run(scene, bodies, many * DT, 2).observables
    rows = [Row(f"{name}, a step, {way}", *figures[way], "ns", _BARS[name] * (way == "one thread")) for way in ways]
    gain = figures["one thread"][0] / figures["two threads"][0]
    rows.append(Row(f"  {name}, two threads are faster by", gain, gain, "", "1.5"))
    for what in ("energy_error", "link_error"):
        worst = float(seen[what].max())
        rows.append(Row(f"  {name}, {what.replace('_', ' ')}", worst, worst, ""))
    return rows


def impacts(name: str, quick: bool) -> list[Row]:
    """What an impact costs beyond the steps, and what a long run with impacts conserves."""
    count, until = (2, 0.5) if quick else (1_000, _LONG)
    body = makers()[name]()
    (near, bodies), (far, apart) = _start(body, _NEAR, count), _start(body, _FAR, count)
    whole = round(until / DT)
    ways = {"far": _nanoseconds(far, apart, whole, 1, 2), "near": _nanoseconds(near, bodies, whole, 1, 2)}
    for scene, start in ((far, apart), (near, bodies)):
        _run(scene, start, DT, 1)
    figures = in_turn(ways, 1 if quick else 3)
    seen = _run(near, bodies, until, 1).observables
    hits = float(seen["impacts"][-1])
    # Of the minimum of each: differences of single runs are 14 to 43 steps.
    step = figures["far"][0]
    extra = (figures["near"][0] - step) * whole * count / max(hits, 1.0)
    spin = seen["angular_momentum"]
    turned = float(np.abs(spin[-1] - spin[0]).max() / np.abs(spin[0]).max())
    told = {
        "impacts of a body": (hits / count, ""),
        "an impact, with the search for its instant": (extra, "ns"),
        "an impact, in steps without contact": (extra / step, "steps"),
        "energy error": (float(seen["energy_error"].max()), ""),
        "link error": (float(seen["link_error"].max()), ""),
        "change of the angular momentum": (turned, ""),
        "largest penetration": (float(seen["max_penetration"].max()), "m"),
    }
    bars = {"energy error": "1e-12", "link error": "1e-13", "change of the angular momentum": "1e-11"}
    return [
        Row(f"{name} in a sphere, {what}", one, one, unit, bars.get(what, "")) for what, (one, unit) in told.items()
    ]


def leaning() -> dict[str, tuple[swarm.Body, np.ndarray]]:
    """Bodies one corner of which stays on a floor, and their velocities."""
    rod = swarm.Body([(0, 0, 0), (0.06, 0, 0.08)], mass=1.0, links=[(0, 1)], contacts=[0])
    edges = swarm.tetrahedron(0.1, 4.0).points
    arms = edges - edges[0]
    up = arms.mean(axis=0) / np.linalg.norm(arms.mean(axis=0))
    side = np.cross(up, (1.0, 0.0, 0.0))
    side /= np.linalg.norm(side)
    corners = arms @ np.stack([side, np.cross(up, side), up]).T
    top = swarm.Body(corners, mass=1.0, links=[(i, j) for i in range(4) for j in range(i)], contacts=[0])
    return {
        "dumbbell": (rod, np.zeros((2, 3))),
        "tetrahedron": (top, np.cross((0.0, 0.0, 10.0), corners)),
    }


def contacts(name: str, quick: bool) -> list[Row]:
    """A step with a contact that lasts: a corner slides on a floor, and the same body far above it."""
    count = 2 if quick else 2_000
    body, velocity = leaning()[name]
    start = swarm.Bodies(body, *(np.repeat(part.T[:, :, None], count, axis=2) for part in (body.points, velocity)))
    ways = {}
    for what, depth in {"with a contact": 0.0, "without": 50.0}.items():
        walls = [swarm.Plane((0.0, 0.0, -1.0), depth, restitution=0.0), swarm.Sphere(100.0)]
        scene = swarm.Scene(walls, gravity=(0.0, 0.0, -1.0))
        _run(scene, start, DT, 1)
        ways[what] = _nanoseconds(scene, start, 2 if quick else 2 * _STEPS, 1, 2)
    figures = in_turn(ways, 1 if quick else 5)
    share = figures["with a contact"][0] / figures["without"][0]
    bar = str(4 * int(_BARS[name]))
    return [
        Row(f"{name} on a floor, a step with a contact", *figures["with a contact"], "ns", bar),
        Row("  in steps without contact", share, share, "steps", "4"),
    ]


def beside(quick: bool) -> list[Row]:
    """A tetrahedron in a box here and in MuJoCo: energy error, and microseconds for a second of its motion."""
    until, count = (0.2, 2) if quick else (10.0, 1_000)
    scene = swarm.Scene([swarm.Box(WALLS)])
    start = swarm.place(scene, makers()["tetrahedron"](), count, speed=SPEED, spin=SPIN, seed=0)
    _run(scene, start, DT, 1)
    begin = time.perf_counter()
    seen = _run(scene, start, until, 1).observables
    spent = 1e6 * (time.perf_counter() - begin) / until / count
    error = float(seen["energy_error"].max())
    rows = [
        Row("tetrahedron in a box, swarm, dt = 5e-3 s, a second of one body", spent, spent, "us"),
        Row("  energy error", error, error, ""),
    ]
    try:
        name = mujoco.version()
    except ImportError:
        print(f"MuJoCo is not installed, and left out: {mujoco.INSTALL}")
        return rows
    for dt in (5e-3, 1e-3) if quick else (5e-3, 1e-3, 1e-4, 1e-5):
        error, seconds = mujoco.run(start.body.points, WALLS, 4.0, (SPEED, SPIN), (dt, until))
        cost = 1e6 * seconds / until
        rows.append(Row(f"tetrahedron in a box, {name}, dt = {dt:g} s", cost, cost, "us"))
        rows.append(Row("  energy error", error, error, ""))
    return rows


def main(quick: bool) -> None:
    """Measure, print, and write the table of this machine."""
    rows = []
    for name in makers():
        rows += steps(name, quick)
    for name in ("dumbbell", "tetrahedron"):
        rows += contacts(name, quick)
    for name in ("dumbbell", "tetrahedron"):
        rows += impacts(name, quick)
    rows += beside(quick)
    show(rows)
    if not quick:
        write(rows, "bodies")
