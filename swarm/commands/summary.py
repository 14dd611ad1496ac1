"""Summaries of runs and their files: text for people, numbers for other programs."""

from pathlib import Path
from typing import Any

import numpy as np

from ..common.catalog import OBSERVABLES
from ..observables import drift
from ..run.result import Result
from ..words import facts
from ..words.amounts import amount
from ..words.unfinished import unfinished

# Observables of which JSON has the value at the end, or the largest value.
_OF_BALLS = ("collisions", "largest_overlap")
_OUTCOME = (
    "impacts", *_OF_BALLS, "energy_error", "max_penetration", "dissipated_energy", "link_error", "work", "wall_heat",
    "part_impulse", "part_heat", "wall_work", "sliding", "sliding_time", "crossings", "escaped", "born",
    "source_energy", "absorbed", "unconverged",
)  # fmt: skip


def numbers(trajectory: Path) -> dict[str, Any]:
    """The summary of a run from its trajectory, which has at least one frame, in the types of JSON."""
    from ..files.trajectory import load

    with load(trajectory) as written:
        seen, particles, copies = written.observed(), written.count, written.copies
    return {
        "trajectory": str(trajectory),
        "particles": particles,
        "bodies": copies,
        "frames": len(seen["time"]),
        "time": float(seen["time"][-1]),
        "energy_drift": drift(seen),
        **{name: _at_the_end(seen, name) for name in _OUTCOME if name in seen or name not in _OF_BALLS},
    }


def _at_the_end(seen: dict[str, Any], name: str) -> Any:
    """An observable at the end, or its largest value; 0 or [] if a file of an older version does not have it."""
    one = OBSERVABLES[name]
    if name not in seen:
        return [] if one.axes else 0 if one.unit == "1" and one.joined == "sum" else 0.0
    return (np.max(seen[name]) if one.joined == "largest" else seen[name][-1]).tolist()


def of_file(file: Path) -> dict[str, str]:
    """The content of an HDF5 file, a trajectory or a log of impacts, and whether all values match their checksums.

    If the run goes on or was cut off, the first row says so.
    """
    from ..files.impact_log import load_impacts
    from ..files.stored import is_log
    from ..files.trajectory import load

    if not is_log(file):
        with load(file) as trajectory:
            cut = unfinished(trajectory)
            state = {} if cut is None else {"state": " ".join(cut).strip()}
            return state | facts.of_trajectory(trajectory) | facts.of_checksums(trajectory)
    with load_impacts(file) as log:
        return facts.of_log(log) | facts.of_checksums(log)


def of_recording(file: Path, repair: bool) -> dict[str, str]:
    """The content of a recording; `repair` repairs it first."""
    from ..common.extras import needed_by

    with needed_by("a recording", "record"):
        from ..recording import playback

    if repair:
        playback.repair(file)
    held, whole = playback.described(file)
    about, times = held.about, held.times
    missing = "" if whole else "; these are the frames that swarm info --repair will keep"
    every = f", of the run's every {about['stride']}th" if about["stride"] > 1 else ""
    return {
        "frames": f"{facts.frames_of(times)}{every}{missing}",
        about["noun"]: f"{about['shown']} of {about['particles']}",
        "colour": f"{about['quantity']}, {about['low']:g} to {about['high']:g}",
        "entities": "\n".join(f"{path} ({rows} rows)" for path, rows in sorted(held.entities.items())),
        "size": facts.file_size(file),
        "whole": "yes" if whole else f"no, it is truncated: swarm info --repair {file}",
    }


def of_result(result: Result, volume: float | None, error: float | None = None) -> dict[str, str]:
    """The outcome of a run; `volume` is the volume its particles were filled into, with its standard error [m^3]."""
    known = {} if volume is None else {"volume": amount(volume, "m³") + (f" ± {error:.1g} m³" if error else "")}
    return known | facts.of_result(result)
