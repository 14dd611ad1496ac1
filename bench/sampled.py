"""Sampled surfaces: an impact in a sphere by samples, how near that is to the sphere, and what a mesh takes."""

import tempfile
import time
from pathlib import Path

import numpy as np

import swarm

from .report import Row, repeated, tier

SAMPLES, COUNT, RADIUS = 64, 2000, 0.5


def ball(samples: int) -> swarm.Sampled:
    """A sphere by its signed distance on so many samples along each axis."""
    axis = np.linspace(-1.1 * RADIUS, 1.1 * RADIUS, samples)
    distance = np.sqrt(axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2)
    return swarm.Sampled(distance - RADIUS, axis[1] - axis[0], (axis[0],) * 3)


def _impacts(quick: bool) -> list[Row]:
    samples = 12 if quick else SAMPLES
    scene = swarm.Scene([ball(samples)])
    start = swarm.fill(scene, 2 if quick else COUNT, speed=1.0, seed=1)
    until, seen = 2.0 if quick else 100.0, {}

    def measure() -> float:
        # The first run compiles the kernels, and makes what is made of the samples.
        swarm.simulate(scene, start, swarm.Impact(), until=1e-3, threads=1, compile=tier())
        began = time.perf_counter()
        seen.update(swarm.simulate(scene, start, swarm.Impact(), until=until, threads=1, compile=tier()).observables)
        return 1e9 * (time.perf_counter() - began) / float(seen["impacts"][-1])

    figures = repeated(measure, 1 if quick else 5)
    return [
        Row(f"sphere by {samples}^3 samples, an impact", *figures, "ns", "1500", figures[0] / 1500.0),
        Row("  energy error of a particle", *2 * [float(seen["energy_error"].max())], ""),
        Row("  largest penetration", *2 * [float(seen["max_penetration"].max())], "m"),
    ]


def _errors(quick: bool) -> list[Row]:
    sizes = (9, 17) if quick else (33, 65)
    points = np.random.default_rng(1).normal(size=(3, 4000))
    points *= RADIUS / np.sqrt((points**2).sum(axis=0))
    errors = [float(np.abs(ball(n).phi(points)).max()) for n in sizes]
    order = float(np.log2(errors[0] / errors[1]))
    return [
        *(Row(f"  distance from the sphere, {n}^3 samples", e, e, "m") for n, e in zip(sizes, errors, strict=True)),
        Row("  order of that", order, order, "", "4", order / 4.0),
    ]


def _mesh(quick: bool) -> list[Row]:
    import trimesh

    sections = (12, 8) if quick else (250, 200)
    ring = trimesh.creation.torus(1.0, 0.4, major_sections=sections[0], minor_sections=sections[1])
    with tempfile.TemporaryDirectory() as folder:
        ring.export(Path(folder) / "ring.stl")
        began = time.perf_counter()
        surface = swarm.from_mesh(Path(folder) / "ring.stl", 2.8 / (16 if quick else SAMPLES))
        swarm.Scene([surface]).compiled().walls()
        seconds = time.perf_counter() - began
    shape = " x ".join(map(str, surface.values.shape))
    return [
        Row(f"mesh of {len(ring.faces)} triangles, a scene of {shape} samples", seconds, seconds, "s", "30"),
        Row("  distance from the mesh", *2 * [float(surface.mesh_error or 0.0)], "m"),
    ]


def rows(quick: bool) -> list[Row]:
    """All of it."""
    return [*_impacts(quick), *_errors(quick), *_mesh(quick)]
