#!/usr/bin/env bash
# Frames after the 65 535th are in a C3D file of ezc3d, and ezc3d does not return them.
#
# ezc3d 1.7.2, c3d 0.6.0. C3D is the format of motion capture; its header counts frames in 16 bits, and the parameters
# POINT:LONG_FRAMES and TRIAL:ACTUAL_END_FIELD count them beyond. Expected: a longer record is written with one of
# these, or refused. Seen: ezc3d writes all frames, counts 65 535 of them, and returns as many, without a word; the size
# of the file is that of all. c3d returns no frame of that file, with a warning of bytes that remained. What c3d writes,
# both read to the end.
#
# Seen on 2026-11-30, Python 3.11.7, of 70 000 frames of two markers:
#   ezc3d to ezc3d 65535, ezc3d to c3d 0, c3d to ezc3d 70000, c3d to c3d 70000
#   the file of ezc3d: 2.25 MB, of which 70 000 frames are 2.24 MB
#
# Exit code 1 if that changes. Usage: bash findings/ezc3d_frames_after_65535.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check ezc3d==1.7.2 c3d==0.6.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
import warnings
from importlib.metadata import version
from pathlib import Path

import c3d
import ezc3d
import numpy as np

FRAMES, MARKERS, RATE = 70_000, 2, 100.0
BYTES_A_MARKER = 16  # x, y, z and the residual in single precision
warnings.simplefilter("ignore")
folder = Path(sys.argv[1])
positions = np.random.default_rng(0).uniform(-1, 1, (FRAMES, MARKERS, 3)).astype(np.float32)


def write_by_ezc3d(path):
    """Write the positions as the documentation of ezc3d does."""
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [RATE]
    file["parameters"]["POINT"]["LABELS"]["value"] = tuple(f"marker {i}" for i in range(MARKERS))
    points = np.ones((4, MARKERS, FRAMES))
    points[:3] = positions.transpose(2, 1, 0)
    file["data"]["points"] = points
    file.write(str(path))


def write_by_c3d(path):
    """Write the positions as the documentation of c3d does."""
    writer = c3d.Writer(point_rate=RATE)
    for frame in positions:
        writer.add_frames([(np.c_[frame, np.zeros((MARKERS, 2), np.float32)], np.array([[]], np.float32))])
    writer.set_point_labels([f"marker {i}" for i in range(MARKERS)])
    with path.open("wb") as file:
        writer.write(file)


def read_by_ezc3d(path):
    """Return how many frames ezc3d reads, and the largest difference from what was written."""
    read = ezc3d.c3d(str(path))["data"]["points"][:3].transpose(2, 1, 0)
    return len(read), float(abs(read - positions[: len(read)]).max())


def read_by_c3d(path):
    """Return how many frames c3d reads, and the largest difference from what was written."""
    with path.open("rb") as file:
        read = [points[:, :3].copy() for _, points, _ in c3d.Reader(file).read_frames()]
    return len(read), max((float(abs(a - b).max()) for a, b in zip(read, positions, strict=False)), default=0.0)


print(f"Python {sys.version.split()[0]}, ezc3d {version('ezc3d')}, c3d {version('c3d')}, NumPy {np.__version__}")
counts = []
for name, write in (("ezc3d", write_by_ezc3d), ("c3d", write_by_c3d)):
    path = folder / f"{name}.c3d"
    write(path)
    for reader, read in (("ezc3d", read_by_ezc3d), ("c3d", read_by_c3d)):
        count, difference = read(path)
        counts.append(count)
        print(f"{FRAMES} frames from {name} to {reader}: {count} frames, the largest difference {difference:.1g}")
size = (folder / "ezc3d.c3d").stat().st_size
print(f"the file of ezc3d has {size} bytes, {FRAMES} frames have {FRAMES * MARKERS * BYTES_A_MARKER}")
seen = counts == [65_535, 0, 70_000, 70_000] and size >= FRAMES * MARKERS * BYTES_A_MARKER
sys.exit(0 if seen else "not as it was seen")
PYTHON
"$folder/venv/bin/python" "$folder/main.py" "$folder"
