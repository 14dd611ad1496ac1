#!/usr/bin/env bash
# A sphere whose radius is below 1 has eight triangles and a third of its volume.
#
# manifold3d 3.5.4. The number of segments of `Manifold.sphere` and `cylinder` follows from the shortest edge, 1, and
# from the smallest angle, 10 degrees: lengths are taken for millimetres. So a ball in metres is an octahedron, and a
# cylinder is a square column. `circular_segments=` sets the number, and `set_min_circular_edge_length` the shortest
# edge.
#
# Seen on 2026-11-29, Python 3.11.7, volumes over those of the round bodies:
#   radius 0.001 and 0.5: sphere 0.318, 8 triangles; cylinder 0.637    radius 1000: sphere 0.982
#   radius 0.5 with circular_segments=128: sphere 0.999
#
# Exit code 1 if that changes. Usage: bash findings/manifold_spheres_of_eight.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check manifold3d==3.5.4 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
from importlib.metadata import version
from math import isclose, pi

from manifold3d import Manifold

print(f"Python {sys.version.split()[0]}, manifold3d {version('manifold3d')}")
shares = {}
for radius in (0.001, 0.5, 1000.0):
    sphere, cylinder = Manifold.sphere(radius), Manifold.cylinder(radius, radius)
    shares[radius] = (sphere.volume() / (4 / 3 * pi * radius**3), cylinder.volume() / (pi * radius**3))
    print(f"radius {radius:g}: sphere {shares[radius][0]:.3f}, {sphere.num_tri()} triangles; "
          f"cylinder {shares[radius][1]:.3f} of the volume of the round body")
fine = Manifold.sphere(0.5, circular_segments=128).volume() / (pi / 6)
print(f"radius 0.5, circular_segments=128: sphere {fine:.3f}")
coarse = all(isclose(shares[r][0], 1 / pi, rel_tol=1e-6) and isclose(shares[r][1], 2 / pi, rel_tol=1e-6)
             for r in (0.001, 0.5))
sys.exit(not (coarse and 0.97 < shares[1000.0][0] < 0.99 and fine > 0.995))
PYTHON
cd "$folder" && venv/bin/python main.py
