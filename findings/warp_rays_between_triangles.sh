#!/usr/bin/env bash
# Rays pass between two triangles that share an edge.
#
# Warp 1.19.0, on the processor. 3200 triangles are a wavy sheet without a gap: neighbours share their vertices. Of
# 178 348 rays that are aimed at points of inner edges 777 meet nothing by `wp.mesh_query_ray`, one in 230. Embree
# (embreex), with the same float32 numbers, misses none. So a particle that is followed by such rays leaves a closed
# mesh sooner or later. Rays straight down are all found.
#
# Seen on 2026-11-29, Python 3.11.7:
#   oblique: Warp misses 777 of 178348, Embree 0
#   straight down: Warp misses 0, Embree 0
#
# Exit code 1 if that changes. Usage: bash findings/warp_rays_between_triangles.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    warp-lang==1.19.0 embreex==4.4.0.post1 trimesh==5.2.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys

import numpy as np
import warp as wp
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

wp.config.quiet = True
wp.init()
print(f"Python {sys.version.split()[0]}, Warp {wp.__version__}, NumPy {np.__version__}")
n = 40
line = np.linspace(-1, 1, n + 1)
x, y = np.meshgrid(line, line, indexing="ij")
vertices = np.stack([x, y, 0.1 * np.sin(3 * x) * y], -1).reshape(-1, 3).astype(np.float32)
corners = [i * (n + 1) + j for i in range(n) for j in range(n)]
faces = np.array([t for a in corners for t in ((a, a + 1, a + n + 2), (a, a + n + 2, a + n + 1))], dtype=np.int32)

rng = np.random.default_rng(0)
count = 200_000
face, side = faces[rng.integers(len(faces), size=count)], rng.integers(3, size=count)
one, other = (vertices[face[np.arange(count), (side + k) % 3]] for k in (0, 1))
share = rng.random((count, 1)).astype(np.float32)
aim = (1 - share) * one + share * other
aim = aim[(np.abs(aim[:, :2]) < 0.95).all(axis=1)]


@wp.kernel
def cast(mesh: wp.uint64, start: wp.array(dtype=wp.vec3), way: wp.array(dtype=wp.vec3), hit: wp.array(dtype=int)):
    i = wp.tid()
    query = wp.mesh_query_ray(mesh, start[i], way[i], 1.0e6)
    hit[i] = int(query.result)


def misses(offset):
    start = aim + np.array(offset, dtype=np.float32)
    way = aim - start
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    with wp.ScopedDevice("cpu"):
        mesh = wp.Mesh(wp.array(vertices, dtype=wp.vec3), wp.array(faces.ravel(), dtype=int))
        hit = wp.zeros(len(aim), dtype=int)
        wp.launch(cast, len(aim), [mesh.id, wp.array(start, dtype=wp.vec3), wp.array(way, dtype=wp.vec3), hit])
        by_warp = int((hit.numpy() == 0).sum())
    scene = EmbreeScene()
    TriangleMesh(scene, vertices[faces])
    return by_warp, int((np.asarray(scene.run(start, way)) < 0).sum())


oblique, down = misses((0.3, 0.2, 3.0)), misses((0.0, 0.0, 3.0))
print(f"oblique: Warp misses {oblique[0]} of {len(aim)}, Embree {oblique[1]}")
print(f"straight down: Warp misses {down[0]}, Embree {down[1]}")
sys.exit(not (100 < oblique[0] < 5000 and oblique[1] == 0 and down == (0, 0)))
PYTHON
cd "$folder" && venv/bin/python main.py
