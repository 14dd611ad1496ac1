"""Others on their own ground, each in turn with ours: grains, rays in a mesh, and the first seconds of a small run."""

import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np

import swarm

from ..grains import DIAMETER, MASS, hopper
from ..meshes import ball, nanoseconds, scene_of, vessel
from ..report import ROOT, Row, as_usual, in_turn, tier
from . import Floats, loaded

# A contact of two grains lasts so many steps of so long [s].
_STEPS, _DT = 20, 1e-4
_LAWS = {"restitution": 0.3, "friction": 0.5}
_SCENE = """
[[surface]]
kind = "sphere"
radius = 0.5

[particles]
count = 20
speed = 1.0

[run]
until = 10.0
every = 1.0
"""


def rows(quick: bool) -> tuple[list[Row], list[str]]:
    """The rows, and a sentence for each program that cannot be loaded."""
    measures = {"granular": grains, "embree": meshes, "mujoco": first_seconds}
    peers, missing = loaded(measures)
    return [row for name, peer in peers.items() for row in measures[name](*peer, quick)], missing


# --- Grains ----------------------------------------------------------------------------------------------


def grains(peer: ModuleType, version: str, quick: bool) -> list[Row]:
    """Grains with linear springs and the same step, as they fall and at rest."""
    stiffness, found = 0.5 * MASS * (math.pi / (_STEPS * _DT)) ** 2, []
    method, laws = swarm.Penalty(_DT, stiffness, 1.0), {"stiffness": stiffness, **_LAWS}
    rounds = 1 if quick else 3
    for n, across, span, rest in (
        ((27, 3, 20, 400),) if quick else ((1_000, 10, 1000, 20_000), (10_000, 18, 1000, 5000))
    ):
        scene, start = hopper(n, across, _LAWS["friction"])
        half = float(scene.surfaces[0].half_widths[0])  # type: ignore[attr-defined]
        fall: dict[str, Callable[[], float]] = {
            "ours": lambda: _Ours(scene, start, method).run(span),  # noqa: B023
            "theirs": lambda: peer.Pile(start.position.T, half, (DIAMETER, MASS), laws, _DT).run(span),  # noqa: B023
        }
        # Compiled before it is timed; and one pile of each that comes to rest.
        ours, theirs = _Ours(scene, start, method), peer.Pile(start.position.T, half, (DIAMETER, MASS), laws, _DT)
        for pile in (ours, theirs):
            pile.run(rest)
        lie = {"ours": lambda: ours.run(span), "theirs": lambda: theirs.run(span)}  # noqa: B023
        for name, measures in (("fall", fall), ("lie", lie)):
            taken = in_turn(measures, rounds)
            (mine, other), each = (taken[side] for side in ("ours", "theirs")), 1e6 / n / span
            found += [
                Row(f"{n} grains that {name}, a grain and step", each * mine[0], each * mine[1], "us", "2.0",
                    mine[0] / other[0]),
                Row(f"  {version}, gran/hooke/history", each * other[0], each * other[1], "us"),
            ]  # fmt: skip
    return found


class _Ours:
    """A pile of ours, with the same steps as the peer's."""

    def __init__(self, scene: swarm.Scene, particles: swarm.Particles, method: swarm.Penalty) -> None:
        self.scene, self.particles, self.method = scene, particles, method

    def run(self, steps: int) -> float:
        """Processor time of so many steps [s]."""
        until, began = steps * self.method.dt, time.process_time()
        self.particles = swarm.simulate(
            self.scene, self.particles, self.method, until=until, every=until, threads=1, compile=tier()
        ).particles
        return time.process_time() - began


# --- Meshes ----------------------------------------------------------------------------------------------


def meshes(peer: ModuleType, version: str, quick: bool) -> list[Row]:
    """A billiard in meshes: the rays alone of the other, an impact with all that follows of ours."""
    found = []
    shapes: tuple[tuple[str, Callable[[int], tuple[Floats, Floats]], int, str], ...] = (
        ("ball", ball, 16, "1.5"), ("bottle", vessel, 4, "1.5"), ("ball", ball, 160, "1.3"),
        ("bottle", vessel, 40, "1.3"), ("ball", ball, 500, "1.0"),
    )  # fmt: skip
    for name, shape, count, bar in (("ball", ball, 4, "1.5"),) if quick else shapes:
        corners, triangles = shape(count)
        scene = scene_of(corners, triangles)
        start = swarm.fill(scene, 20 if quick else 2000, speed=1.0, seed=1)
        flights = np.ascontiguousarray(start.position.T), np.ascontiguousarray(start.velocity.T)
        lost = []

        def rays(corners: Floats = corners, triangles: Floats = triangles, flights: tuple = flights) -> float:
            seconds, missed = peer.run(corners, triangles, flights, 2 if quick else 100)
            lost.append(missed)  # noqa: B023
            return 1e9 * seconds

        measures = {"ours": nanoseconds(scene, start, 1.0 if quick else 30.0), "theirs": rays}
        taken = in_turn(measures, 5)
        ratio = taken["ours"][0] / taken["theirs"][0]
        found += [
            Row(f"{name} of {len(triangles)} triangles, an impact", *taken["ours"], "ns", bar, ratio),
            Row(f"  {version}, a ray in single precision", *taken["theirs"], "ns"),
            Row("  of its points no triangle stopped", lost[-1], lost[-1], ""),
        ]
    return found


# --- First seconds ---------------------------------------------------------------------------------------


def first_seconds(peer: ModuleType, version: str, quick: bool) -> list[Row]:
    """A process that runs twenty particles, from its start to its end, and everything compiled before."""
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder, "scene.toml")
        scene.write_text(_SCENE)
        out = str(Path(folder, "out.h5"))
        run = [sys.executable, "-m", "swarm", "run", str(scene), "-o", out, "--quiet", "--overwrite"]
        taken = in_turn(
            {"ours": lambda: _of_process(run), "theirs": lambda: _of_process([sys.executable, "-c", peer.FIRST])},
            1 if quick else 5,
        )
    ratio = taken["ours"][0] / taken["theirs"][0]
    return [
        Row("swarm run of 20 particles and its file, a process", *taken["ours"], "s", "1.4", ratio),
        Row(f"  {version}, 20 balls in a box, a process", *taken["theirs"], "s"),
    ]


def _of_process(command: list[str]) -> float:
    """Processor time of a process and its children [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    paths = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    subprocess.run(command, check=True, capture_output=True, env={**as_usual(), "PYTHONPATH": paths})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
