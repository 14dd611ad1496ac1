"""Summaries of runs and their files: text for people, numbers for other programs."""

from pathlib import Path
from typing import Any

import numpy as np

from ..observables import drift
from ..run.result import Result
from ..words import facts


def numbers(trajectory: Path) -> dict[str, Any]:
    """A run's summary from its trajectory, which holds at least one frame, in the types of JSON."""
    from ..files.trajectory import load

    with load(trajectory) as written:
        seen, particles, copies = written.observed(), written.count, written.copies
    return {
        "trajectory": str(trajectory),
        "particles": particles,
        "bodies": copies,
        "frames": len(seen["time"]),
        "time": float(seen["time"][-1]),
        "impacts": int(seen["impacts"][-1]),
        **({"collisions": int(seen["collisions"][-1])} if "collisions" in seen else {}),
        "energy_drift": drift(seen),
        "energy_error": float(seen["energy_error"].max()),
        "max_penetration": float(seen["max_penetration"].max()),
        **({"largest_overlap": float(seen["largest_overlap"].max())} if "largest_overlap" in seen else {}),
        "dissipated_energy": float(seen["dissipated_energy"][-1]),
        # Files of older versions have none of these, or only those of bodies.
        "link_error": float(np.max(seen.get("link_error", 0.0))),
        "work": float(seen.get("work", [0.0])[-1]),
        "wall_heat": np.array(seen.get("wall_heat", [[]])[-1]).tolist(),
        "part_impulse": np.array(seen.get("part_impulse", [[]])[-1]).tolist(),
        "part_heat": np.array(seen.get("part_heat", [[]])[-1]).tolist(),
        "wall_work": np.array(seen.get("wall_work", [[]])[-1]).tolist(),
        "sliding": int(seen.get("sliding", [0])[-1]),
        "sliding_time": float(seen.get("sliding_time", [0.0])[-1]),
        "crossings": np.array(seen.get("crossings", [[]])[-1]).tolist(),
        "escaped": int(seen["escaped"][-1]),
        "born": np.array(seen.get("born", [[]])[-1], np.int64).tolist(),
        "source_energy": float(seen.get("source_energy", [0.0])[-1]),
        "absorbed": np.array(seen.get("absorbed", [[]])[-1], int).tolist(),
        "unconverged": int(seen["unconverged"][-1]),
    }


def of_file(file: Path) -> dict[str, str]:
    """The content of an HDF5 file, a trajectory or a log of impacts, and whether all values match their checksums."""
    from ..files.impact_log import load_impacts
    from ..files.stored import is_log
    from ..files.trajectory import load

    if not is_log(file):
        with load(file) as trajectory:
            return facts.of_trajectory(trajectory) | facts.of_checksums(trajectory)
    with load_impacts(file) as log:
        return facts.of_log(log) | facts.of_checksums(log)


def of_trajectory(file: Path) -> dict[str, str]:
    """The content of a trajectory, and whether the run went well."""
    from ..files.trajectory import load

    with load(file) as trajectory:
        return facts.of_trajectory(trajectory)


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
        "frames": f"{len(times)}, {times[0]:g} s to {times[-1]:g} s{every}{missing}",
        about["noun"]: f"{about['shown']} of {about['particles']}",
        "colour": f"{about['quantity']}, {about['low']:g} to {about['high']:g}",
        "entities": "\n".join(f"{path} ({rows} rows)" for path, rows in sorted(held.entities.items())),
        "size": f"{file.stat().st_size / 1e6:.1f} MB",
        "whole": "yes" if whole else f"no, it is truncated: swarm info --repair {file}",
    }


def of_result(result: Result, volume: float | None) -> dict[str, str]:
    """The outcome of a run; `volume` is the volume its particles were filled into [m^3]."""
    seen = result.observables
    # What a second run of the kind will do.
    rate = seen["impacts"][-1] / max(result.wall_time - result.compile_time, 1e-3)
    compiled = f", {result.compile_time:.2f} s of it compiling" if result.compile_time > 0.0 else ""
    # A page counts all of the wall time: it is all that a file keeps.
    rest = " in the rest" if result.compile_time > 0.0 else ""
    return {
        **({} if volume is None else {"volume": f"{volume:.4g} m^3"}),
        **facts.of_meshes(result.scene),
        **facts.of_run(seen, result.particles.radius),
        **facts.of_verdicts(result.content("a summary")),
        "wall time": f"{result.wall_time:.2f} s{compiled}, {rate:.3g} impacts/s{rest}",
        "trajectory": f"{result.trajectory} ({len(seen['time'])} frames)",
    }
