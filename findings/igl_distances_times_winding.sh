#!/usr/bin/env bash
# A signed distance is not the distance with a sign, but the distance times 1 - 2 w.
#
# libigl 2.6.3, point-cloud-utils 0.34.0. The sign comes from the winding number w of the mesh around the point, which
# is 1 inside and 0 outside. It is not rounded: `signed_distance` gives the distance times 1 - 2 w. Where two parts of a
# mesh overlap, w is 2, and the depth is three times too large. Beside an opening w is between 0 and 1, and the distance
# is too small: over a box without its lid there is a wall at which it is 0. By the fast winding number, the only way of
# `pcu.signed_distance_to_mesh`, all distances are off, by 0.1 % on average. The default of libigl is the exact winding
# number; `SIGNED_DISTANCE_TYPE_PSEUDONORMAL` gives the distance.
#
# Seen on 2026-11-30, Python 3.11.7:
#   where two boxes overlap, 0.35 from the nearest face: default and fast -1.05, pseudonormal -0.35
#   a ball of 1280 triangles: default within 1e-12, fast and point-cloud-utils off by 0.4 %
#   a box without its lid, on the way out, 0.5 from its walls: default and fast down to 0, pseudonormal 0.5
#
# Exit code 1 if that changes. Usage: bash findings/igl_distances_times_winding.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    libigl==2.6.3 point-cloud-utils==0.34.0 trimesh==5.2.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
from importlib.metadata import version

import igl
import numpy as np
import point_cloud_utils as pcu
import trimesh

KINDS = {"default": igl.SIGNED_DISTANCE_TYPE_DEFAULT, "fast": igl.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER,
         "pseudonormal": igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL}


def distances(mesh, points):
    """Signed distances by each way of libigl, and by point-cloud-utils; and distances without a sign."""
    vertices, faces = np.array(mesh.vertices, dtype=float), np.array(mesh.faces, dtype=np.int64)
    found = {name: igl.signed_distance(points, vertices, faces, sign_type=kind)[0] for name, kind in KINDS.items()}
    found["pcu"] = pcu.signed_distance_to_mesh(points, vertices, faces.astype(np.int32))[0]
    return found, pcu.closest_points_on_mesh(points, vertices, faces.astype(np.int32))[0]


def show(title, found):
    print(title + ": " + ", ".join(f"{name} {float(value):.4g}" for name, value in found.items()))


print(f"Python {sys.version.split()[0]}, " + ", ".join(
    f"{name} {version(name)}" for name in ("libigl", "point-cloud-utils", "trimesh", "numpy")))

box = trimesh.creation.box((1, 1, 1))
both = trimesh.util.concatenate([box, box.copy().apply_translation((0.3, 0.3, 0.3))])
overlap, depth = distances(both, np.full((2, 3), 0.15))
show(f"where two boxes overlap, {depth[0]:g} deep", {name: one[0] for name, one in overlap.items()})

ball = trimesh.creation.icosphere(3)
found, plain = distances(ball, np.random.default_rng(0).uniform(-2, 2, (20000, 3)))
off = {name: np.abs(np.abs(one) / plain - 1).max() for name, one in found.items()}
show(f"a ball of {len(ball.faces)} triangles, largest error", off)

lid = np.abs(box.triangles_center[:, 2] - 0.5) < 1e-9
cup = trimesh.Trimesh(box.vertices, box.faces[~lid], process=False)
z = np.linspace(0.0, 1.5, 301)
found, plain = distances(cup, np.stack([np.zeros_like(z), np.zeros_like(z), z], axis=1))
least = {name: np.abs(one).min() for name, one in found.items()} | {"without a sign": plain.min()}
show(f"a box of {len(cup.faces)} triangles without its lid, least distance on the way out", least)

ways = ("default", "fast", "pcu")
sys.exit(not (
    all(abs(overlap[name][0] + 1.05) < 2e-3 for name in ways) and abs(overlap["pseudonormal"][0] + 0.35) < 1e-6
    and off["default"] < 1e-10 and off["pseudonormal"] < 1e-6 and all(1e-3 < off[name] < 1e-2 for name in ways[1:])
    and all(least[name] < 0.01 for name in ways) and least["pseudonormal"] > 0.45 and plain.min() > 0.45))
PYTHON
cd "$folder" && venv/bin/python main.py
