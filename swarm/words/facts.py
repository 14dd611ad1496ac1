"""The content of a trajectory or a log of impacts, and whether its run went well: texts by their names."""

from typing import Any

import numpy as np

from ..ball_numbers import balls_volume
from ..common.notebook import shortened
from ..files.sources import DamagedError
from ..observables import drift
from ..surfaces.facets.mesh import Mesh
from .content import Content, content_of
from .verdicts import marked


def of_trajectory(trajectory: Any) -> dict[str, str]:
    """The content of a `Trajectory`, and whether the run went well."""
    times, seen = trajectory.times, trajectory.observed() if len(trajectory) else {}
    last = f", {times[0]:g} s to {times[-1]:g} s" if len(times) else ": the run ended before the first was written"
    rows = {
        "frames": f"{len(times)}{last}",
        **_what(trajectory),
        **of_scene(trajectory.scene),
        **of_counters(trajectory.counters),
        "method": call(trajectory.method),
        "observables": ", ".join(seen) or "none",
        "size": f"{trajectory.path.stat().st_size / 1e6:.1f} MB",
    }
    if len(times):
        rows |= of_run(seen, trajectory.radius) | of_verdicts(content_of(trajectory))
    return rows


def of_verdicts(content: Content) -> dict[str, str]:
    """Whether a run went well: a line for each thing that should hold."""
    return {"verdicts": "\n".join(marked(content))}


def of_log(log: Any) -> dict[str, str]:
    """The content of an `ImpactLog`."""
    times, scene, counts = log.times, log.scene, log.counts()
    which = len(range(log.count)[:: log.kept]) if isinstance(log.kept, int) else len(log.kept)
    return {
        "impacts": f"{counts.sum():,}".replace(",", " "),
        "frames": f"{len(times)}" + (f", {times[0]:g} s to {times[-1]:g} s" if len(times) else ""),
        "particles": f"{which} of {log.count}",
        "surfaces": "\n".join(
            f"{call(surface)}: {count}" for surface, count in zip(scene.surfaces, counts, strict=True)
        ),
        **of_counters(log.counters, log.crossings()),
        **_period(scene),
        "method": call(log.method),
        "columns": ", ".join(log.dtype.names or ()),
        "size": f"{log.path.stat().st_size / 1e6:.1f} MB",
    }


def of_checksums(stored: Any) -> dict[str, str]:
    """Whether all values of a file match their checksums, or the first that does not."""
    if not stored.has_checksums():
        return {"checksums": "none: an older version wrote it"}
    try:
        stored.require_intact()
    except DamagedError as error:
        return {"checksums": f"{error}; what else there is can be read"}
    return {"checksums": "all values match theirs"}


def of_counters(counters: Any, crossings: Any = None) -> dict[str, str]:
    """The counters of a run, with the numbers of their crossings in a log; empty for a run without counters."""
    told = [call(one.surface if one.inside is None else one) for one in counters]
    if crossings is not None:
        told = [f"{one}: {out} out, {back} back" for one, (out, back) in zip(told, crossings.tolist(), strict=True)]
    return {"counters": "\n".join(told)} if told else {}


def of_scene(scene: Any) -> dict[str, str]:
    """The surfaces of a `Scene`, gravity, and its period."""
    return {
        "surfaces": call(", ".join(shortened(scene.surfaces))),
        **of_meshes(scene),
        "gravity": "none" if scene.gravity is None else f"{scene.gravity} m/s^2",
        **({} if scene.pairs is None else {"pairs": call(scene.pairs)}),
        **_period(scene),
    }


def of_meshes(scene: Any) -> dict[str, str]:
    """The meshes of a `Scene`, and the distances of surfaces from the meshes that they are made from; {} without."""
    surfaces = () if scene is None else scene.surfaces
    made = {i: one for i, one in enumerate(surfaces) if getattr(one, "mesh_error", None) is not None}
    said = [
        f"surfaces[{i}] within {one.mesh_error:.2g} m of its mesh"
        + (f", whose corners were moved by up to {one.mesh_weld:.1e} m to close seams" if one.mesh_weld else "")
        for i, one in made.items()
    ]
    found = {"mesh error": "\n".join(said)} if said else {}
    exact = [
        f"surfaces[{i}]: {len(one)} triangles, {one.volume():.6g} m^3"
        + (f", corners moved by up to {one.mesh_weld:.1e} m" if one.mesh_weld else "")
        for i, one in enumerate(surfaces) if isinstance(one, Mesh)
    ]  # fmt: skip
    return found | ({"mesh": "\n".join(exact)} if exact else {})


def of_run(seen: dict[str, Any], radius: Any = None) -> dict[str, str]:
    """The figures that show whether a run went well; `radius` has those of the particles, None of points."""
    counts = [name for name in ("impacts", "collisions") if name in seen]
    rows: dict[str, str] = {name: f"{int(seen[name][-1]):,}".replace(",", " ") for name in counts}
    if slid := seen.get("sliding_time", [0.0])[-1]:
        rows["sliding"] = f"{int(seen['sliding'][-1])} at the end, {slid:.4g} s in all"
    worst = seen["energy_error"].max()
    rows["energy drift"] = f"{drift(seen):.1e} of the energy that moved, {worst:.1e} of the worst particle"
    rows["largest penetration"] = f"{seen['max_penetration'].max():.1e} m"
    rows |= _overlap(seen, radius)
    if np.any(seen.get("link_error", 0.0)):
        rows["link error"] = f"{seen['link_error'].max():.1e} of its length"
    if np.any(seen.get("work", 0.0)):
        rows["work"] = f"{seen['work'][-1]:.4g} J of led anchors"
    if lost := seen.get("dissipated_energy", [0.0])[-1]:
        # Not of the total energy: the zero of the potential one is arbitrary.
        first, last = (f"{seen['kinetic_energy'][k]:.4g} J" for k in (0, -1))
        rows["dissipated"] = f"{lost:.4g} J; the kinetic energy: {first}, then {last}"
    for what in ("heat", "work"):
        given = enumerate(seen.get(f"wall_{what}", [[]])[-1])
        if told := ", ".join(f"{energy:.4g} J from surfaces[{i}]" for i, energy in given if energy):
            rows[f"wall {what}"] = told
    for what, unit in (("impulse", "N s"), ("heat", "J")):
        of_parts = np.array(seen.get(f"part_{what}", [[]])[-1])
        if of_parts.any():
            rows[f"{what} of parts"] = f"{', '.join(f'{given:.4g}' for given in of_parts)} {unit}"
    if "crossings" in seen:
        of_each = enumerate(seen["crossings"][-1].tolist())
        rows["crossings"] = "\n".join(f"counters[{k}]: {out} out, {back} back" for k, (out, back) in of_each)
    return rows | _escaped(seen)


def _overlap(seen: dict[str, Any], radius: Any) -> dict[str, str]:
    """How deep soft balls were in one another and in walls."""
    if "largest_overlap" not in seen:
        return {}
    deepest = float(seen["largest_overlap"].max())
    part = "" if radius is None else f", {100.0 * deepest / float(np.min(radius)):.2g} % of the smallest radius"
    return {"largest overlap": f"{deepest:.1e} m{part}"}


def _escaped(seen: dict[str, Any]) -> dict[str, str]:
    rows = {}
    if seen.get("escaped", [0])[-1]:
        rows["escaped"] = f"{int(seen['escaped'][-1])} particles"
    return rows | _born(seen) | _absorbed(seen)


def _born(seen: dict[str, Any]) -> dict[str, str]:
    """How many particles have come from each source, and what they have brought."""
    if not np.any(born := seen.get("born", [[]])[-1]):
        return {}
    each = ", ".join(f"{int(count)} from sources[{k}]" for k, count in enumerate(born))
    return {"born": f"{each}, with {seen['source_energy'][-1]:.4g} J"}


def _absorbed(seen: dict[str, Any]) -> dict[str, str]:
    """How many particles each surface has absorbed."""
    taken = enumerate(seen.get("absorbed", [[]])[-1])
    told = ", ".join(f"{int(number)} by surfaces[{i}]" for i, number in taken if number)
    return {"absorbed": told} if told else {}


def _what(trajectory: Any) -> dict[str, str]:
    """The row that says what was run: particles, or bodies and what they are made of."""
    body = trajectory.body
    if body is None:
        return {"particles": f"{trajectory.count}", **of_balls(trajectory)}
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


def of_balls(trajectory: Any) -> dict[str, str]:
    """The radii of balls, and the part of the volume that they fill; {} for points."""
    if not trajectory.has_particles() or trajectory.radius is None:
        return {}
    balls = trajectory.frame(0)
    rows = {"radius": sizes_of(balls.radius)}
    if balls.volume is not None and len(balls) == trajectory.count:
        rows["packing"] = f"{balls_volume(trajectory.scene, balls.radius) / balls.volume:.4g} of {balls.volume:.4g} m^3"
    if trajectory.scene.plane is not None and "packing" in rows:
        rows["packing"] = rows["packing"].replace("m^3", "m^2")
    return rows


def sizes_of(radius: Any) -> str:
    """One radius, or the smallest and the largest."""
    least, most = radius.min(), radius.max()
    return f"{least:.4g} m" if least == most else f"{least:.4g} m to {most:.4g} m"


def _period(scene: Any) -> dict[str, str]:
    """The rows of a scene that repeats, and of one of two dimensions."""
    plane = {} if scene.plane is None else {"plane": f"{scene.plane} = 0"}
    if scene.period is None:
        return plane
    lengths = ", ".join("none" if length is None else f"{length:g}" for length in scene.period)
    return {"period": f"({lengths}) m", **plane}


def call(described: Any) -> str:
    """A surface or method as Python code writes it."""
    return str(described).replace("swarm.", "")
