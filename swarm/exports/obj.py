"""Wavefront OBJ: the walls at one frame, each surface an object of its own, for Blender, game engines and CAD.

Corners have all digits, in [m]. The triangles of an object face out of the enclosed volume, as in CAD programs:
those of a cavity away from the particles, those of a solid towards them. The materials `cavity`, which is translucent,
and `solid` are in the .mtl file beside it. Surfaces of more than 20 000 bodies are left out, which a comment says.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernel.limits import TINY
from ..pictures import colours
from ..scene import Scene
from ..state import Floats
from ..surfaces.instant import side_of
from ..triangles.shape import Shape
from ..triangles.shapes import shapes_of
from .exported import lines_of

# The largest number of drawn bodies of one surface: each has about 200 vertices.
_MOST = 20_000
# The distance beside a triangle, relative to its size, at which the side of the particles is determined.
_BESIDE = 1e-3
_OPACITY = {"cavity": 0.3, "solid": 1.0}


def materials_of(target: Path) -> Path:
    """The name of the file of materials."""
    return target.with_suffix(".mtl")


def write_objects(trajectory: Any, number: int, path: Path, materials: Path) -> None:
    """Write the walls at a frame, and their materials."""
    scene, time = trajectory.scene, float(trajectory.times[number])
    with open(path, "wb") as file:
        file.write(f"# swarm: walls at frame {number}, {time!r} s, in m\nmtllib {materials.name}\n".encode())
        first = 1
        for shape in walls_at(trajectory, number, time):
            count = scene.surfaces[shape.surface].body_count()
            if not len(shape.triangles):
                if count > _MOST:
                    file.write(f"# {shape.name}: {count} bodies, more than {_MOST}, are left out\n".encode())
                continue
            file.write(f"o {shape.name}\n".encode() + lines_of([shape.vertices], b"v ", b" "))
            file.write(f"usemtl {'solid' if shape.solid else 'cavity'}\n".encode())
            file.write(lines_of([shape.triangles + first], b"f ", b" "))
            first += len(shape.vertices)
    with open(materials, "w", encoding="ascii") as out:
        for name, colour in (("cavity", colours.CAVITY), ("solid", colours.SOLID)):
            shade = " ".join(f"{part / 255.0:.4f}" for part in colours.rgb(colour))
            out.write(f"newmtl {name}\nKd {shade}\nd {_OPACITY[name]:g}\nillum 1\n")


def walls_at(trajectory: Any, number: int, time: float) -> list[Shape]:
    """The walls that are present at a frame, at their places; their triangles face outwards."""
    scene = trajectory.scene
    # The file alone tells where impacts have moved them.
    scene = scene.at_frame(trajectory.observables, number) if scene.reacts() else scene
    positions = trajectory.frame(number).position if trajectory.has_particles() else np.zeros((3, 1))
    drawn = shapes_of(scene, positions, time, most=_MOST)
    return [replace(shape, triangles=outwards(scene, shape, time)) for shape in drawn]


def outwards(scene: Scene, shape: Shape, time: float) -> NDArray[np.int64]:
    """The triangles of a shape, turned so that a cavity's face away from particles and a solid's face them."""
    if not len(shape.triangles):
        return shape.triangles
    a, b, c = (shape.vertices[shape.triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    size = np.sqrt(np.sqrt((normals**2).sum(axis=1, keepdims=True)))
    steps = _BESIDE * normals / np.maximum(size, TINY)
    middles = (a + b + c) / 3.0
    with np.errstate(all="ignore"):
        ahead, behind = (_gap(scene, shape.surface, place, time) for place in (middles + steps, middles - steps))
        rises = np.nan_to_num((ahead - behind) / size[:, 0], posinf=0.0, neginf=0.0)
    # Slivers, with orientations determined by round-off, face as most triangles do.
    clear = abs(rises) > 0.1 * np.median(abs(rises))
    sign = np.where(clear, np.sign(rises), np.sign(np.sign(rises).sum()))
    return np.where((sign < 0.0)[:, None] ^ shape.solid, shape.triangles[:, ::-1], shape.triangles)


def _gap(scene: Scene, i: int, points: Floats, time: float) -> Floats:
    """The gap of surface i at points (N, 3)."""
    if scene.period is not None:
        return np.asarray(scene.gaps(points.T, time)[i])
    return np.asarray(side_of(scene.surfaces[i]) * scene.surfaces[i].phi(points.T, time))
