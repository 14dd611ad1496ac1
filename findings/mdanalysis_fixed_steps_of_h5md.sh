#!/usr/bin/env bash
# A trajectory whose box or steps are written once cannot be read.
#
# MDAnalysis 2.11.0. H5MD 1.1 lets `box/edges` be one dataset if the box is fixed, and `step` and `time` be one number
# each, with the attribute `offset`, if frames are equally far apart. MDAnalysis wants a row for each frame in all of
# them: of a fixed box it says KeyError, "Unable to synchronously open object", and of fixed steps OSError, without a
# word. The same frames with rows are read. Write edges, steps and times for each frame.
#
# Seen on 2026-11-29, Python 3.11.7:
#   rows for all: times 100, 100.5, 101    fixed box: KeyError    fixed steps: OSError ""
#
# Exit code 1 if that changes. Usage: bash findings/mdanalysis_fixed_steps_of_h5md.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check MDAnalysis==2.11.0 h5py==3.16.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
import warnings

warnings.simplefilter("ignore")
import h5py
import MDAnalysis
import numpy as np

FRAMES, STEP, FIRST_STEP, TIME, FIRST_TIME = 3, 10, 50, 0.5, 100.0


def element(group, value, fixed):
    """A time-dependent element of H5MD, with fixed steps or with a row for each frame."""
    group["value"] = value
    for name, increment, first in (("step", STEP, FIRST_STEP), ("time", TIME, FIRST_TIME)):
        group[name] = increment if fixed else first + increment * np.arange(FRAMES)
        if fixed:
            group[name].attrs["offset"] = first


def times(name, fixed_box, fixed_steps):
    """The times that MDAnalysis reads, or its error."""
    with h5py.File(name, "w") as file:
        about = file.create_group("h5md")
        about.attrs["version"] = np.array([1, 1])
        about.create_group("author").attrs["name"] = "N. N."
        creator = about.create_group("creator")
        creator.attrs["name"], creator.attrs["version"] = "script", "1"
        box = file.create_group("particles/all/box")
        box.attrs["dimension"], box.attrs["boundary"] = 3, np.array(["periodic"] * 3, dtype="S8")
        edges = np.array([10.0, 20.0, 30.0])
        if fixed_box:
            box["edges"] = edges
        else:
            element(box.create_group("edges"), np.tile(edges, (FRAMES, 1)), fixed_steps)
        element(file.create_group("particles/all/position"), np.zeros((FRAMES, 2, 3)), fixed_steps)
    universe = MDAnalysis.Universe.empty(2)
    try:
        universe.load_new(name, convert_units=False)
    except (KeyError, OSError) as error:
        return f'{type(error).__name__} "{str(error)[:40]}"'
    return [float(frame.time) for frame in universe.trajectory]


print(f"Python {sys.version.split()[0]}, MDAnalysis {MDAnalysis.__version__}, h5py {h5py.__version__}")
rows, box, steps = (times("rows.h5md", False, False), times("box.h5md", True, False),
                    times("steps.h5md", False, True))
print(f"rows for all: {rows}; fixed box: {box}; fixed steps: {steps}")
sys.exit(not (rows == [100.0, 100.5, 101.0] and str(box).startswith("KeyError") and steps == 'OSError ""'))
PYTHON
cd "$folder" && venv/bin/python main.py
