"""The statements on a run, on a trajectory and on a log of impacts."""

import math
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from ..ball_numbers import balls_volume
from ..bodies.body import Body
from ..common.catalog import OBSERVABLES
from ..files.sources import DamagedError
from ..methods import ALL_METHODS, Method
from ..scene import Scene
from ..surfaces.union import part_at
from . import nouns, titles
from .amounts import amount, amounts, counted, direction, listed, many, plain
from .content import Content, content_of, content_of_result
from .statements import Statement, rows_of
from .verdicts import judged

# The largest number of surfaces in a table, and of numbers in a statement.
MOST = 8
# Observables with a number for each of these are stated; members of fields are too many.
_NUMBERED = ("surface", "part", "cavity", "source")


def of_content(content: Content, most: int | None = None) -> list[Statement]:
    """All statements on a run: its setting, its verdicts, and its numbers; on `most` surfaces (None: on all)."""
    return [*of_setting(content, most), *judged(content), *of_numbers(content.seen)]


def of_trajectory(trajectory: Any) -> dict[str, str]:
    """The content of a `Trajectory` and the verdicts on its run, as rows of a table."""
    scene, seen = trajectory.scene, trajectory.observed() if len(trajectory) else {}
    if seen:
        stated = of_content(content_of(trajectory), MOST)
    else:
        stated = [Statement("frames", "0: the run ended before the first was written"), *of_surroundings(scene, MOST)]
        stated.append(of_method(trajectory.method))
    return {**rows_of(stated), "observables": ", ".join(seen) or "none", "size": file_size(trajectory.path)}


def of_result(result: Any) -> dict[str, str]:
    """The outcome of a run, as rows of a table."""
    seen = result.observables
    # The pace of a second run of this kind, without compilation.
    met, noun = seen["impacts"][-1], "impacts"
    if "collisions" in seen:
        met, noun = met + seen["collisions"][-1], "impacts and collisions"
    rate = met / max(result.wall_time - result.compile_time, 1e-3)
    compiled = f", {result.compile_time:.2f} s of it compiling" if result.compile_time > 0.0 else ""
    # A page counts the whole wall time, since a file keeps no other one.
    rest = " in the rest" if result.compile_time > 0.0 else ""
    known = result.scene is not None and result.method is not None
    stated = of_content(content_of_result(result, "a summary"), MOST) if known else of_numbers(seen)
    return {
        **rows_of(stated),
        "wall time": f"{result.wall_time:.2f} s{compiled}, {plain(float(f'{rate:.3g}'))} {noun}/s{rest}",
        "trajectory": str(result.trajectory or "none"),
    }


def of_log(log: Any) -> dict[str, str]:
    """The content of an `ImpactLog`, as rows of a table."""
    counts, crossings = log.counts(), log.crossings()
    met = len(log) - counts.sum() - crossings.sum()
    which = len(range(log.count)[:: log.kept]) if isinstance(log.kept, int) else len(log.kept)
    return {
        "impacts": many(counts.sum()),
        **({"collisions": many(met)} if "partner" in log.dtype.names else {}),
        "frames": frames_of(log.times),
        "particles": f"{which} of {log.count}",
        **rows_of(of_surroundings(log.scene, impacts=counts)),
        **rows_of(of_counters(log.counters, crossings)),
        **rows_of([of_method(log.method)]),
        "columns": ", ".join(log.dtype.names or ()),
        "size": file_size(log.path),
    }


def of_checksums(stored: Any) -> dict[str, str]:
    """Whether all values of a file match their checksums, or the first value that does not."""
    if not stored.has_checksums():
        return {"checksums": "none: an older version wrote it"}
    try:
        stored.require_intact()
    except DamagedError as error:
        return {"checksums": f"{error}; what else there is can be read"}
    return {"checksums": "all values match theirs"}


def file_size(path: Any) -> str:
    """The size of a file."""
    return f"{path.stat().st_size / 1e6:.1f} MB"


def frames_of(times: Any) -> str:
    """The number of frames, and their first and last time."""
    return f"{len(times)}" + (f", {times[0]:g} s to {times[-1]:g} s" if len(times) else "")


# --- The setting ---------------------------------------------------------------------------------------------


def of_setting(content: Content, most: int | None = None) -> list[Statement]:
    """The particles, the scene, the method and the end of a run; with `most` surfaces (None: with all)."""
    seen = content.seen
    return [
        Statement("frames", frames_of(seen["time"])),
        Statement("what runs", _what_runs(content)),
        *_of_body(content.body),
        *_packing(content),
        *of_sources(content),
        *of_surroundings(content.scene, most),
        *of_counters(content.counters, seen["crossings"][-1] if "crossings" in seen else ()),
        of_method(content.method),
    ]


def _what_runs(content: Content) -> str:
    """The particles or bodies, with masses and speeds at the start if frames are kept."""
    stated, frame = titles.of_particles(content), content.frames.get("start")
    if frame is None:
        return stated
    body, masses, velocity = content.body, frame.mass, frame.velocity
    if body is not None:
        # The masses of bodies, not of their points
        masses = np.array([body.mass_matrix.sum()])
        velocity = body.center_of(np.ascontiguousarray(velocity).reshape(3, len(body), -1))
    speeds = np.sqrt((velocity**2).sum(axis=0))
    for what, values, unit in (
        (" of" if body is None else ", each body of", masses, "kg"),
        (", at the start with", speeds[~np.isnan(speeds)], "m/s"),
    ):
        if not len(values):
            continue
        stated += f"{what} {_range(values, unit)}"
    return stated.replace(" radius of ", " radius and ")


def _range(values: Any, unit: str) -> str:
    """The smallest and the largest value, or the common one."""
    low, high = float(values.min()), float(values.max())
    same = high - low <= 1e-9 * abs(high)
    return amount(low, unit) if same else amounts([low, high], unit).replace(" and ", " to ")


def of_sources(content: Content) -> list[Statement]:
    """The number of particles of each source, with sizes, masses and times; [] if the file does not keep them."""
    end = content.frames.get("end")
    if content.births is None or content.body is not None or end is None or len(end.mass) != content.count:
        return []
    stated, (times, sources) = [], content.births
    for k in range(content.seen["born"].shape[1]):
        came = np.flatnonzero((sources == k) & (times <= content.seen["time"][-1]))
        text = counted(len(came), "particle" if end.radius is None else "ball")
        if len(came):
            text += "" if end.radius is None else f" of {_range(end.radius[came], 'm')} radius"
            first, last = float(times[came].min()), float(times[came].max())
            text += f"{' of' if end.radius is None else ' and'} {_range(end.mass[came], 'kg')}"
            text += f", from {amounts([first, last], 's').replace(' and ', ' to ')}" if last > first else ""
            text += f", {plain(float(f'{(len(came) - 1) / (last - first):.3g}'))} a second" if last > first else ""
        stated.append(Statement(f"source {k}", text))
    return stated


def _of_body(body: Body | None) -> list[Statement]:
    """The parts of one body."""
    if body is None:
        return []
    edges = () if body.strain is None else body.strain.edges
    parts: dict[str, Any] = {
        "point": body, "link": body.links, "spring": body.springs, "elastic edge": edges, "anchor": body.anchors,
        "guide": body.guides, "cavity": body.cavities,
    }  # fmt: skip
    return [Statement("body", ", ".join(counted(len(some), name) for name, some in parts.items() if len(some)))]


def _packing(content: Content) -> list[Statement]:
    """The part of the volume that balls fill; [] for points, or without a known volume."""
    balls, scene = content.frames.get("start"), content.scene
    if balls is None or balls.radius is None or balls.volume is None or len(balls) != content.count:
        return []
    part, unit = balls_volume(scene, balls.radius) / balls.volume, "m³" if scene.plane is None else "m²"
    return [Statement("packing", f"{plain(100.0 * part)} % of {amount(balls.volume, unit)}")]


def of_surroundings(scene: Scene, most: int | None = None, impacts: Sequence[int] = ()) -> list[Statement]:
    """At most `most` surfaces of a scene and the impacts on each; then the properties of the whole scene."""
    stated, names, count = [], nouns.labels(scene), len(scene.surfaces)
    shown = count if most is None or count <= most else most - 1
    for i, surface in enumerate(scene.surfaces[:shown]):
        met = f"; {counted(int(impacts[i]), 'impact')}" if len(impacts) else ""
        stated.append(Statement(f"surface {i}, {names[i, ()]}", nouns.in_full(surface, scene) + met))
    if shown < count:
        stated.append(Statement("more surfaces", many(count - shown)))
    for k, (i, where) in enumerate(scene.parts):
        part = part_at(scene.surfaces[i], where)
        if i < shown and (changed := nouns.laws_of(part) + nouns.changes_of(part)):
            label = f"part {k}, {names[i, where]} of surface {i}"
            stated.append(Statement(label, ", ".join(changed)))
    return stated + _of_space(scene)


def _of_space(scene: Scene) -> list[Statement]:
    """The properties of a whole scene: gravity, period, plane, and collisions of particles."""
    stated = [Statement("gravity", "none")]
    if scene.gravity is not None:
        size = amount(math.hypot(*scene.gravity), "m/s²")
        stated = [Statement("gravity", f"{size} along {direction(scene.gravity)}")]
    if scene.period is not None:
        along = [
            f"{amount(length, 'm')} along {axis}" for axis, length in zip("xyz", scene.period, strict=True)
            if length is not None
        ]  # fmt: skip
        stated.append(Statement("period", f"a cell that repeats after {listed(along)}"))
    if scene.plane is not None:
        stated.append(Statement("plane", f"two dimensions, {scene.plane} = 0"))
    if scene.pairs is not None:
        restitution, friction = plain(scene.pairs.restitution), plain(scene.pairs.friction)
        rolling = f", rolling {plain(scene.pairs.rolling)}" if scene.pairs.rolling else ""
        stated.append(Statement("impacts of two", f"restitution {restitution}, friction {friction}{rolling}"))
    return stated


def of_counters(counters: Sequence[Any], crossings: Any) -> list[Statement]:
    """The known counters of a run, and the number of crossings of each; [] for a run without counters."""
    crossed, stated = [f"{many(out)} out, {many(back)} back" for out, back in np.asarray(crossings).tolist()], []
    for k in range(max(len(counters), len(crossed))):
        parts = crossed[k : k + 1]
        if k < len(counters):
            within = counters[k].inside
            parts.insert(0, nouns.in_full(counters[k].surface))
            parts[0] += "" if within is None else f", within {nouns.in_full(within)}"
        stated.append(Statement(f"counter {k}", "; ".join(parts)))
    return stated


def of_method(method: Method) -> Statement:
    """A method, its step and its other numbers, by name."""
    known = {"penalty", "exponent", "tolerance", "max_sweeps", "sliding_tolerance", "shortest_flight", "contact_step"}
    of_user = ALL_METHODS.kind_of(type(method)) is None
    left_out = {} if of_user else {one.name: one.default for one in fields(method)}  # type: ignore[arg-type]
    numbers = [
        name.replace("_", " ") + ("" if value is True else f" {value if isinstance(value, str) else plain(value)}")
        for name, value in vars(method).items()
        if name != "dt"
        and (
            isinstance(value, (int, float)) and value
            if of_user or name in known
            else name in left_out and value != left_out[name]
        )
    ]
    return Statement("method", ", ".join([titles.of_method(method), *numbers]))


# --- Numbers -------------------------------------------------------------------------------------------------


def of_numbers(seen: dict[str, Any]) -> list[Statement]:
    """The counts of a run, and the amounts that each surface, part and source gave or took, without zeros."""
    stated = [Statement(name, many(seen[name][-1])) for name in ("impacts", "collisions") if name in seen]
    if slid := seen.get("sliding_time", [0.0])[-1]:
        stated.append(Statement("sliding", f"{many(seen['sliding'][-1])} at the end, {amount(slid, 's')} in all"))
    if np.any(seen.get("dissipated_energy", 0.0)):
        # The total energy is left out: the zero of the potential energy is arbitrary.
        lost, first, last = (
            amount(float(seen[name][k]), "J")
            for name, k in (("dissipated_energy", -1), ("kinetic_energy", 0), ("kinetic_energy", -1))
        )
        stated.append(Statement("dissipated", f"{lost}; the kinetic energy: {first}, then {last}"))
    for name, one in OBSERVABLES.items():
        if name in seen and len(one.axes) == 1 and one.axes[0] in _NUMBERED and one.joined == "sum":
            each = [
                f"{one.axes[0]} {k}: {many(value) if one.unit == '1' else amount(value, one.unit)}"
                for k, value in enumerate(np.asarray(seen[name][-1]).tolist()) if value
            ]  # fmt: skip
            more = [f"{len(each) - MOST + 1} more"] if len(each) > MOST else []
            if each:
                stated.append(Statement(name.replace("_", " "), ", ".join([*each[: MOST - len(more)], *more])))
    return stated
