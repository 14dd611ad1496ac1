#!/usr/bin/env bash
# The moment of inertia of a shape with a radius is that of another shape.
#
# pymunk 7.3.1. A rounded polygon has the mass and the area of the whole, but the moment of its corners alone: a square
# of 0.02 m with a radius of 0.5 m, which is nearly a disc, turns 2000 times as easily as one. A segment with a radius,
# a capsule, has the moment of the rectangle around it: 13 % too much, and 33 % for one without length, which is a disc.
# `moment_for_poly`, `moment_for_segment` and shapes with `mass` or `density` agree. Set `Body.moment` by hand.
#
# Seen on 2026-11-29, Python 3.11.7, mass 1, moments over the exact ones:
#   square of 1 with radius 0.5: 0.271    square of 0.02 with radius 0.5: 0.0005
#   capsule of length 2, radius 0.5: 1.132    of length 0: 1.333
#
# Exit code 1 if that changes. Usage: bash findings/pymunk_moments_of_round_shapes.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pymunk==7.3.1 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys

import numpy as np
import pymunk


def exact(half_x, half_y, radius):
    """The moment of a rectangle with a rim of this radius around it, mass 1, by points on a fine grid."""
    x = (np.arange(2000) + 0.5) / 2000 * (half_x + radius)
    y = (np.arange(2000) + 0.5) / 2000 * (half_y + radius)
    x, y = np.meshgrid(x, y, indexing="ij")
    inside = np.hypot(np.maximum(x - half_x, 0), np.maximum(y - half_y, 0)) <= radius
    return float((x**2 + y**2)[inside].mean())


def of_shape(make):
    """The mass, the moment and the area of a body by a shape with mass 1."""
    body, space = pymunk.Body(), pymunk.Space()
    shape = make(body)
    shape.mass = 1.0
    space.add(body, shape)
    return body.mass, body.moment, shape.area


def rounded(half, radius):
    corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
    return of_shape(lambda body: pymunk.Poly(body, corners, radius=radius))


def capsule(half, radius):
    return of_shape(lambda body: pymunk.Segment(body, (-half, 0), (half, 0), radius))


print(f"Python {sys.version.split()[0]}, pymunk {pymunk.version}, NumPy {np.__version__}")
right = True
for name, make, sides, radius, known in (
    ("square of 1, radius 0.5", rounded, (0.5, 0.5), 0.5, 0.2714),
    ("square of 0.02, radius 0.5", rounded, (0.01, 0.01), 0.5, 0.0005),
    ("capsule of length 2, radius 0.5", capsule, (1.0, 0.0), 0.5, 1.1321),
    ("capsule of length 0, radius 0.5", capsule, (0.0, 0.0), 0.5, 1.3333),
):
    mass, moment, area = make(sides[0], radius)
    full = 4 * sides[0] * sides[1] + 4 * radius * sum(sides) + np.pi * radius**2
    share = moment / exact(*sides, radius)
    print(f"{name}: mass {mass:g}, area over the exact one {area / full:.3f}, moment over the exact one {share:.4f}")
    right &= mass == 1 and abs(area / full - 1) < 1e-9 and abs(share - known) < 2e-4
sys.exit(not right)
PYTHON
cd "$folder" && venv/bin/python main.py
