#!/usr/bin/env bash
# Velocities beside positions switch off their interpolation, and balls pass their walls between samples.
#
# usd-core 26.11. Instances of a `UsdGeomPointInstancer` move between samples on a line from one to the next. With
# velocities they go on from the sample before, and the sample after is not looked at: a ball that is reflected is seen
# beyond the wall, then jumps back. Velocities are per second, and a stage has 24 time codes a second unless it says
# otherwise. So samples at their times in seconds make balls crawl at 1/24 of their speed, and jump at each sample.
# `SetTimeCodesPerSecond(1)` mends that, but not the walls. No velocities mend both.
#
# Seen on 2026-11-29, Python 3.11.7, samples at 0, 1, 2: x = 0, 0.4, 0.4, with 0.4 m/s, reflected at x = 0.6:
#   no velocities: x at 0.5, 1.9 = 0.200, 0.400, the largest 0.400     velocities: 0.008, 0.415, the largest 0.415
#   velocities, and 1 time code a second: 0.200, 0.760, the largest 0.760
#
# Exit code 1 if that changes. Usage: bash findings/usd_velocities_overrule_positions.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check usd-core==26.11
cat >"$folder/main.py" <<'PYTHON'
import sys
from importlib.metadata import version

from pxr import Gf, Usd, UsdGeom

SAMPLES = {0.0: (0.0, 0.4), 1.0: (0.4, 0.4), 2.0: (0.4, -0.4)}  # x and its velocity, reflected at 0.6


def places(velocities, rate=None):
    """x at times from 0 to 2 of an instance whose position has three samples."""
    stage = Usd.Stage.CreateInMemory()
    if rate:
        stage.SetTimeCodesPerSecond(rate)
    instances = UsdGeom.PointInstancer.Define(stage, "/balls")
    UsdGeom.Sphere.Define(stage, "/balls/ball")
    instances.GetPrototypesRel().AddTarget("/balls/ball")
    instances.GetProtoIndicesAttr().Set([0])
    for time, (x, speed) in SAMPLES.items():
        instances.GetPositionsAttr().Set([Gf.Vec3f(x, 0, 0)], time)
        if velocities:
            instances.GetVelocitiesAttr().Set([Gf.Vec3f(speed, 0, 0)], time)
    times = [k / 10 for k in range(21)]
    return [instances.ComputeInstanceTransformsAtTime(t, t)[0].ExtractTranslation()[0] for t in times]


print(f"Python {sys.version.split()[0]}, usd-core {version('usd-core')}")
plain, slow, right = places(False), places(True), places(True, 1.0)
for name, x in (("no velocities", plain), ("velocities", slow), ("velocities, 1 time code a second", right)):
    print(f"{name}: x at 0.5, 0.9, 1.5, 1.9 = " + ", ".join(f"{x[k]:.3f}" for k in (5, 9, 15, 19))
          + f"; the largest {max(x):.3f}")
expected = ((plain[5], 0.2), (plain[19], 0.4), (slow[9], 0.9 * 0.4 / 24), (right[9], 0.36), (right[19], 0.76))
sys.exit(any(abs(found - known) > 1e-4 for found, known in expected))
PYTHON
cd "$folder" && venv/bin/python main.py
