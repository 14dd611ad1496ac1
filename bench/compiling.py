"""First calls: what a scene takes until its kernels are compiled, and what the next process takes that finds them.

Each call is in a process of its own with one thread; the first one finds no compiled kernels. Times are seconds of
processor time, of Numba's Python and of LLVM alike, and a row is the minimum of its repeats, taken in turn. The run is
in them: it is so long that it meets all that the whole run of its scene meets, and so short that it costs little. How
much it costs is a row of its own, the same call once more in the process that found the kernels.
"""

import json
import math
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba.core import event

import swarm
from swarm import scene_file
from swarm.methods.base import Method
from swarm.surfaces import Surface

from .report import ROOT, Row, child, show, write

GRAVITY = (0.0, 0.0, -9.81)
REPEATS = 3
# Few: a call is to compile, not to run.
_COUNT = 100
_CHILD = """
import sys, time
import swarm
began = time.process_time()
from bench import compiling
compiling.tell(sys.argv[1], began)
"""

Start = tuple[swarm.Scene, swarm.Particles | swarm.Bodies, Method]


class Case(NamedTuple):
    """A scene: its first call is measured."""

    what: str
    start: Callable[[], Start]
    until: float  # by then every kernel of the whole run is called [s]
    bar: float  # [s]


class Call(NamedTuple):
    """What one process measures, in seconds of processor time."""

    before: float  # from `import swarm` on: imports, what names the cache's folder, the scene and its particles
    first: float
    functions: int  # that Numba compiles in the first call
    llvm: float  # a part of the first call
    again: float  # the same call once more


# --- The scenes ------------------------------------------------------------------------------------------


def _filled(surfaces: list[Surface], gravity: tuple[float, float, float] | None = None) -> Start:
    scene = swarm.Scene(surfaces, gravity)
    return scene, swarm.fill(scene, _COUNT, speed=1.0, seed=0), swarm.Impact()


def _shipped(name: str) -> Start:
    """The scene of a file, with all of its particles."""
    job = scene_file.read(ROOT / "examples" / "scenes" / f"{name}.toml")
    return job.scene, job.start(), job.method


def _ellipsoid() -> Start:
    ball = swarm.Sphere(0.15, (0.0, 0.0, 0.2), "outside")
    return _filled([swarm.Ellipsoid((0.3, 0.3, 0.6)), ball], GRAVITY)


def _cylinder() -> Start:
    return _filled([swarm.Cylinder(0.5, length=1.0, restitution=0.5)], GRAVITY)


def _cone() -> Start:
    law: dict[str, Any] = {"restitution": 0.5, "friction": 0.4}
    return _filled([swarm.Cone(math.pi / 6.0, **law), swarm.Plane((0.0, 0.0, 1.0), 1.0, **law)], GRAVITY)


def _tetrahedra() -> Start:
    scene = swarm.Scene([swarm.Box((0.5, 0.4, 0.3))])
    bodies = swarm.place(scene, swarm.tetrahedron(0.1, 4.0), _COUNT, speed=0.5, spin=2.0, seed=0)
    return scene, bodies, swarm.Impact(dt=5e-3)


def _planes() -> Start:
    normals = np.random.default_rng(0).standard_normal((24, 3))
    return _filled([swarm.Plane(tuple(normal), 0.5) for normal in normals.tolist()])


CASES = {
    "cavity": Case("cavity, the main job", lambda: _shipped("cavity"), 0.5, 2.2),
    "ellipsoid": Case("ellipsoid, a ball, gravity", _ellipsoid, 1.0, 3.0),
    # Some slide along its side, and some in the edge of its lower cap.
    "cylinder": Case("capped cylinder, e = 0.5, gravity", _cylinder, 1.0, 7.0),
    # Some come to its tip, which is a corner.
    "cone": Case("cone, friction 0.4, e = 0.5, a lid, gravity", _cone, 1.0, 8.0),
    "drum": Case("drum", lambda: _shipped("drum"), 0.1, 10.0),
    "shaker": Case("shaker", lambda: _shipped("shaker"), 0.1, 10.0),
    # The first grains are in the bins.
    "galton": Case("Galton's board", lambda: _shipped("galton_board"), 2.0, 14.0),
    # One kernel flies, meets and parts: nothing more is compiled at the first contact, which is before.
    "tetrahedra": Case("tetrahedra in a box", _tetrahedra, 0.5, 9.0),
    "planes": Case("24 planes in random directions", _planes, 1.0, 5.0),
}
QUICK = ("cavity",)


# --- In the child ----------------------------------------------------------------------------------------


class Heard(event.Listener):  # type: ignore[misc]
    """How often Numba tells of the beginning of something, and how much processor time it took in all."""

    def __init__(self) -> None:
        self.times, self.seconds = 0, 0.0
        self._depth, self._began = 0, 0.0

    def on_start(self, _told: Any) -> None:
        """It counts; the time of what is in another, as a function that is compiled for its caller, is that of both."""
        self.times += 1
        if self._depth == 0:
            self._began = time.process_time()
        self._depth += 1

    def on_end(self, _told: Any) -> None:
        """The time ends with the outermost."""
        self._depth -= 1
        if self._depth == 0:
            self.seconds += time.process_time() - self._began


def call(case: Case, began: float) -> Call:
    """The call of a case in this process; its processor time was `began` when it had imported swarm."""
    scene, start, method = case.start()

    def seconds() -> float:
        before = time.process_time()
        swarm.simulate(scene, start, method, until=case.until, threads=1, progress=False, compile="always")
        return time.process_time() - before

    before = time.process_time() - began
    # All of LLVM is called under its lock. To listen costs the call no more than it varies by.
    functions, llvm = Heard(), Heard()
    with event.install_listener("numba:compile", functions), event.install_listener("numba:llvm_lock", llvm):
        first = seconds()
    return Call(before, first, functions.times, llvm.seconds, seconds())


def tell(name: str, began: float) -> None:
    """Print the call of a scene for the process that asks."""
    print(json.dumps(call(CASES[name], began)))


# --- The report ------------------------------------------------------------------------------------------


def measured(name: str) -> tuple[Call, Call]:
    """The first call of a scene, and that of a second process, which finds the compiled kernels."""
    with tempfile.TemporaryDirectory() as folder:
        first, second = (Call(*json.loads(child(_CHILD, name, NUMBA_CACHE_DIR=folder))) for _ in range(2))
    return first, second


def rows_of(case: Case, calls: list[tuple[Call, Call]]) -> list[Row]:
    """What is reported of a scene."""
    columns: dict[str, tuple[list[float], str, str]] = {
        case.what: ([first.first for first, _ in calls], "s", f"{case.bar:g}"),
        f"  {case.what}, functions compiled": ([first.functions for first, _ in calls], "", ""),
        f"  {case.what}, of it LLVM": ([first.llvm for first, _ in calls], "s", ""),
        f"  {case.what}, before the call": ([first.before for first, _ in calls], "s", ""),
        f"  {case.what}, second process": ([second.first for _, second in calls], "s", ""),
        f"  {case.what}, functions compiled there": ([second.functions for _, second in calls], "", "0"),
        f"  {case.what}, the run alone": ([second.again for _, second in calls], "s", ""),
    }
    return [
        Row(what, min(values), statistics.median(values), unit, bar) for what, (values, unit, bar) in columns.items()
    ]


def failed(case: Case, error: subprocess.CalledProcessError) -> Row:
    """Instead of the rows of a scene, if its process ended: the last that it said, or its exit code."""
    said = (error.stderr.strip() or f"exit code {error.returncode}").splitlines()[-1]
    return Row(f"{case.what}: {said}"[:100], math.nan, math.nan, "s", f"{case.bar:g}")


def main(quick: bool, scenes: list[str] | None = None, repeats: int = REPEATS) -> None:
    """Measure these scenes, by default all, print, and write the table of this machine."""
    names = scenes or (QUICK if quick else tuple(CASES))
    calls: dict[str, list[tuple[Call, Call]]] = {name: [] for name in names}
    ended: dict[str, Row] = {}
    for _ in range(1 if quick else repeats):
        for name in [name for name in calls if name not in ended]:
            try:
                calls[name].append(measured(name))
            except subprocess.CalledProcessError as error:
                ended[name] = failed(CASES[name], error)
    rows = [row for name in calls for row in ([ended[name]] if name in ended else rows_of(CASES[name], calls[name]))]
    show(rows)
    if not quick:
        write(rows, "compile")
