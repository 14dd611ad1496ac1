"""Summaries of runs and their files: text for people, numbers for other programs."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .observables import drift
from .run.simulation import Result

if TYPE_CHECKING:
    from .output.trajectory import Trajectory


def numbers(trajectory: Path) -> dict[str, Any]:
    """A run's summary from its trajectory, which holds at least one frame, in the types of JSON."""
    from .output.trajectory import load

    with load(trajectory) as written:
        seen, particles, copies = written.observed(), written.count, written.copies
    return {
        "trajectory": str(trajectory),
        "particles": particles,
        "bodies": copies,
        "frames": len(seen["time"]),
        "time": float(seen["time"][-1]),
        "impacts": int(seen["impacts"][-1]),
        "energy_drift": drift(seen),
        "energy_error": float(seen["energy_error"].max()),
        "max_penetration": float(seen["max_penetration"].max()),
        "dissipated_energy": float(seen["dissipated_energy"][-1]),
        # Files of older versions have none of these, or only those of bodies.
        "link_error": float(np.max(seen.get("link_error", 0.0))),
        "work": float(seen.get("work", [0.0])[-1]),
        "wall_heat": np.array(seen.get("wall_heat", [[]])[-1]).tolist(),
        "wall_work": np.array(seen.get("wall_work", [[]])[-1]).tolist(),
        "sliding": int(seen.get("sliding", [0])[-1]),
        "sliding_time": float(seen.get("sliding_time", [0.0])[-1]),
        "escaped": int(seen["escaped"][-1]),
        "unconverged": int(seen["unconverged"][-1]),
    }


def of_file(file: Path) -> dict[str, str]:
    """What an HDF5 file holds."""
    from .output.stored import is_log

    return of_impacts(file) if is_log(file) else of_trajectory(file)


def of_trajectory(file: Path) -> dict[str, str]:
    """What a trajectory holds, and whether the run went well."""
    from .output.trajectory import load

    with load(file) as trajectory:
        times, seen = trajectory.times, trajectory.observed() if len(trajectory) else {}
        last = f", {times[0]:g} s to {times[-1]:g} s" if len(times) else ": the run ended before the first was written"
        rows = {
            "frames": f"{len(times)}{last}",
            **_what(trajectory),
            "surfaces": ", ".join(map(_call, trajectory.scene.surfaces)),
            "gravity": "none" if trajectory.scene.gravity is None else f"{trajectory.scene.gravity} m/s^2",
            **_period(trajectory.scene.period),
            "method": _call(trajectory.method),
            "observables": ", ".join(seen) or "none",
            "size": f"{file.stat().st_size / 1e6:.1f} MB",
        }
        if len(times):
            rows |= _figures(seen)
    return rows


def of_impacts(file: Path) -> dict[str, str]:
    """What a log of impacts holds."""
    from .output.impact_log import load_impacts

    with load_impacts(file) as log:
        times, scene = log.times, log.scene
        counts = log.counts()
        which = len(range(log.count)[:: log.kept]) if isinstance(log.kept, int) else len(log.kept)
        return {
            "impacts": f"{len(log):,}".replace(",", " "),
            "frames": f"{len(times)}" + (f", {times[0]:g} s to {times[-1]:g} s" if len(times) else ""),
            "particles": f"{which} of {log.count}",
            "surfaces": "\n".join(
                f"{_call(surface)}: {count}" for surface, count in zip(scene.surfaces, counts, strict=True)
            ),
            **_period(scene.period),
            "method": _call(log.method),
            "columns": ", ".join(log.dtype.names or ()),
            "size": f"{file.stat().st_size / 1e6:.1f} MB",
        }


def of_recording(file: Path, repair: bool) -> dict[str, str]:
    """What a recording holds; `repair` repairs it first."""
    from .extras import needed_by

    with needed_by("a recording", "record"):
        from .output import playback

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
    rate = seen["impacts"][-1] / result.wall_time
    return {
        **({} if volume is None else {"volume": f"{volume:.4g} m^3"}),
        **_figures(seen),
        "wall time": f"{result.wall_time:.2f} s, {rate:.3g} impacts/s",
        "trajectory": f"{result.trajectory} ({len(seen['time'])} frames)",
    }


def _figures(seen: dict[str, Any]) -> dict[str, str]:
    """The figures that show whether a run went well."""
    escaped = {"escaped": f"{int(seen['escaped'][-1])} particles"} if seen.get("escaped", [0])[-1] else {}
    lost = seen.get("dissipated_energy", [0.0])[-1]
    dissipated = {"dissipated": f"{lost:.4g} J of {seen['total_energy'][0]:.4g} J"} if lost else {}
    slid = seen.get("sliding_time", [0.0])[-1]
    sliding = {"sliding": f"{int(seen['sliding'][-1])} at the end, {slid:.4g} s in all"} if slid else {}
    heats, works = (
        [f"{given:.4g} J from surfaces[{i}]" for i, given in enumerate(seen.get(name, [[]])[-1]) if given]
        for name in ("wall_heat", "wall_work")
    )
    tied = (
        {"link error": f"{seen['link_error'].max():.1e} of its length"} if np.any(seen.get("link_error", 0.0)) else {}
    )
    if np.any(seen.get("work", 0.0)):
        tied["work"] = f"{seen['work'][-1]:.4g} J of led anchors"
    return {
        "impacts": f"{int(seen['impacts'][-1]):,}".replace(",", " "),
        **sliding,
        "energy drift": f"{drift(seen):.1e} of the total, {seen['energy_error'].max():.1e} of the worst particle",
        "largest penetration": f"{seen['max_penetration'].max():.1e} m",
        **tied,
        **dissipated,
        **({"wall heat": ", ".join(heats)} if heats else {}),
        **({"wall work": ", ".join(works)} if works else {}),
        **escaped,
    }


def _what(trajectory: "Trajectory") -> dict[str, str]:
    """The row that says what was run: particles, or bodies and what they are made of."""
    body = trajectory.body
    if body is None:
        return {"particles": f"{trajectory.count}"}
    parts = {
        "point": len(body),
        "link": len(body.links),
        "spring": len(body.springs),
        "elastic edge": 0 if body.strain is None else len(body.strain.edges),
        "anchor": len(body.anchors),
        "guide": len(body.guides),
    }
    told = [f"{count} {name}{'' if count == 1 else 's'}" for name, count in parts.items() if count]
    return {"bodies": f"{trajectory.copies} of {', '.join(told)}"}


def _period(period: Any) -> dict[str, str]:
    """The row of a scene that repeats."""
    if period is None:
        return {}
    lengths = ", ".join("none" if length is None else f"{length:g}" for length in period)
    return {"period": f"({lengths}) m"}


def _call(described: Any) -> str:
    """A surface or method as Python code writes it."""
    return str(described).replace("swarm.", "")
