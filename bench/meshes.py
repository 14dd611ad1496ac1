"""Meshes of triangles that are walls: seconds for the scene, bytes a triangle, nanoseconds an impact, first call."""

import tempfile
import time
from typing import Any

import numpy as np

import swarm

from .report import Row, child, in_turn, show, tier, write

DOWN = (0.0, 0.0, -1.0)
# About 1e5 triangles, as the bars have it.
_SPHERE, _VESSEL = 160, 40
# About 100, 1000 and 1e5 triangles that move, which may take so many times as long as at rest.
_MOVED, _SLOWER = (5, 16, _SPHERE), 3.0
_TURN = swarm.Rotation((1.0, 2.0, 3.0), rate=1.3, center=(0.1, 0.0, -0.05))
_SWING = swarm.Oscillation((0.02, 0.01, 0.03), frequency=1.0)
_COLD = """
import sys, time
from bench.meshes import ball, first_call
print(first_call(*ball(160)))
"""


def ball(count: int) -> tuple[Any, Any]:
    """The corners and triangles of a ball of radius 0.5: 4 count^2 of them, needles at the poles."""
    theta, phi = np.pi * np.arange(1, count) / count, np.pi * np.arange(2 * count) / count
    around = np.stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)], axis=1)
    rings = np.sin(theta)[:, None, None] * around + np.cos(theta)[:, None, None] * np.array([0.0, 0.0, 1.0])
    corners = 0.5 * np.concatenate([rings.reshape(-1, 3), [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]])
    return corners, _rings(count - 1, 2 * count)


def vessel(count: int) -> tuple[Any, Any]:
    """A bottle with a neck, ribs and a dimpled wall, of as many rings: what is met is near and far."""
    rings, columns = 8 * count, 4 * count
    z, phi = np.linspace(0.0, 1.0, rings), 2.0 * np.pi * np.arange(columns) / columns
    outline = np.where(z < 0.7, 0.4, 0.4 - 0.3 * np.clip((z - 0.7) / 0.1, 0.0, 1.0)) + 0.01 * (np.sin(40.0 * z) > 0.0)
    radius = outline[:, None] * (1.0 + 0.01 * np.sin(12.0 * phi) * np.sin(60.0 * z[:, None]))
    wall = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.broadcast_to(z[:, None], radius.shape)], axis=-1)
    ends = [(0.0, 0.0, float(z[0])), (0.0, 0.0, float(z[-1]))]
    return np.concatenate([wall.reshape(-1, 3), ends]), _rings(rings, columns)


def _rings(rings: int, columns: int) -> Any:
    """Triangles between rings of corners, and two fans at the ends: their middles are the last two corners."""
    i, j = np.meshgrid(np.arange(rings - 1), np.arange(columns), indexing="ij")
    a, b, c, d = (p * columns + q % columns for p, q in ((i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1)))
    sides = np.concatenate([np.stack([a, c, b], axis=-1).reshape(-1, 3), np.stack([b, c, d], axis=-1).reshape(-1, 3)])
    k, top, last = np.arange(columns), rings * columns, (rings - 1) * columns
    after = (k + 1) % columns
    fans = [np.stack([0 * k + top, k, after], 1), np.stack([0 * k + top + 1, last + after, last + k], 1)]
    return np.concatenate([sides, *fans])


def scene_of(corners: Any, triangles: Any, gravity: Any = None) -> swarm.Scene:
    """A scene of a mesh, with all that a run makes of it."""
    scene = swarm.Scene([swarm.Mesh(corners, triangles)], gravity=gravity)
    scene.compiled().walls()
    return scene


def first_call(corners: Any, triangles: Any) -> float:
    """Seconds of a short run that compiles."""
    scene = scene_of(corners, triangles)
    start = swarm.fill(scene, 10, speed=1.0, seed=1)
    began = time.perf_counter()
    swarm.simulate(scene, start, swarm.Impact(), until=1e-3, compile="always")
    return time.perf_counter() - began


def _bytes(mesh: Any) -> float:
    """Bytes of a triangle in the arrays of a mesh."""
    arrays = [
        mesh.vertices,
        mesh.triangles,
        mesh.group,
        mesh.members.table,
        *mesh.members.grid,
        *mesh.members.grid.known,
        *mesh._tree,
    ]
    known = {one.ctypes.data: one.nbytes for one in arrays if isinstance(one, np.ndarray)}
    return sum(known.values()) / len(mesh)


def nanoseconds(scene: swarm.Scene, start: swarm.Particles, until: float) -> Any:
    """What measures the processor time of an impact or a collision, on one thread [ns]."""

    def measure() -> float:
        seconds, events = [], 0.0
        for span in (1e-3 * until, until):
            began = time.process_time()
            end = swarm.simulate(scene, start, swarm.Impact(), until=span, threads=1, compile=tier())
            seconds.append(time.process_time() - began)
            known = end.observables
            events = sum(float(known[name][-1]) for name in ("impacts", "collisions") if name in known)
        return 1e9 * (seconds[1] - seconds[0]) / events

    return measure


def _path(until: float) -> swarm.Path:
    """A path around a circle, a place in each of ten parts of a turn."""
    times = np.linspace(0.0, until, 2 + round(until))
    angle = 2.0 * np.pi * 0.1 * times
    return swarm.Path(times, 0.03 * np.stack([np.sin(angle), 1.0 - np.cos(angle), np.sin(angle)], axis=1))


def moving(quick: bool) -> list[Row]:
    """An event of points and of balls in a mesh that moves, over one in the same mesh at rest, all in turn."""
    rows = []
    for count in _MOVED[:1] if quick else _MOVED:
        made = ball(count)
        for what, number, until, radius in (("points", 2000, 60.0, None), ("balls", 400, 40.0, 0.02)):
            number, until = (2, 1.0) if quick else (number, until)
            ways = {"at rest": None, "turning": _TURN, "swinging": _SWING, "on a path": _path(until)}
            measures = {}
            for way, motion in ways.items():
                scene = swarm.Scene([swarm.Mesh(*made, motion=motion)])
                start = swarm.fill(scene, number, speed=1.0, seed=1, radius=radius)
                measures[way] = nanoseconds(scene, start, until)
            figures = in_turn(measures, 1 if quick else 3)
            rest = figures["at rest"][0]
            for way in ways:
                name, bar = f"{what} in {len(made[1])} triangles {way}, an event", f"{_SLOWER * rest:.3g}"
                rows.append(Row(name, *figures[way], "ns", "" if way == "at rest" else bar, figures[way][0] / rest))
    return rows


def main(quick: bool) -> None:
    """Measure all of it."""
    rows = []
    for name, made in (("ball", ball(6 if quick else _SPHERE)), ("bottle", vessel(2 if quick else _VESSEL))):
        # The first mesh compiles what makes the cells.
        scene_of(*ball(10))
        began = time.perf_counter()
        scene = scene_of(*made)
        seconds = time.perf_counter() - began
        mesh: Any = scene.surfaces[0]
        falls = scene_of(*made, DOWN)
        start = swarm.fill(scene, 2 if quick else 2000, speed=1.0, seed=1)
        until = 1.0 if quick else 100.0
        measures = {"straight": nanoseconds(scene, start, until), "falling": nanoseconds(falls, start, until)}
        figures = in_turn(measures, 1 if quick else 5)
        size = _bytes(mesh)
        rows += [
            Row(f"{name} of {len(mesh)} triangles, scene", seconds, seconds, "s", "3"),
            Row("  memory of a triangle", size, size, "bytes", "200"),
            Row("  an impact, one thread, processor time", *figures["straight"], "ns", "250"),
            Row("  the same under gravity", *figures["falling"], "ns"),
        ]
    if not quick:
        with tempfile.TemporaryDirectory() as folder:
            seconds = float(child(_COLD, NUMBA_CACHE_DIR=folder).split()[-1])
        rows.append(Row("first call", seconds, seconds, "s"))
    rows += moving(quick)
    show(rows)
    if not quick:
        write(rows, "meshes")
