"""Sentences about frames that failed, and about user-defined code that cannot be compiled."""

import contextlib
import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.status import Status
from ..compiled_scene import CompiledScene
from ..errors import RunError, SceneError
from ..kernel.random import Seeding
from ..kernel.vector import ZERO, column
from ..methods.base import Method
from ..scene import Scene
from ..state import State
from ..surfaces.surface import named, shown
from ..surfaces.wall_law import leave_of, mirrored, sentence_of, why_wrong
from .options import Task
from .preflight import softness

# The end of a sentence on a particle that does not go on, if no user-defined function may be the cause.
_REPORT = "; if nothing is special about the place, it is an error of swarm: please report it with the scene"
_CLOSED = ": walls that move have closed on it; end the run before"
# The distance from a wall at which a ball touches it, as a part of the size of the scene.
_TOUCHES = 1e-9
# The line that Numba could not compile, and the reason, in the text of its error.
_PLACE = re.compile(r"at (\S+\.py) \((\d+)\)")
_REASON = re.compile(r"TypingError: (?!Failed in nopython)(.+)")
# The constructs that compiled code may use.
_ADVICE = (
    "compiled code may use numbers, `if`, `math` and swarm.kernel.vector (dot, norm, cross), no arrays or lists, "
    "and returns one kind of value from every branch, such as a velocity or a Leave"
)


def of_frame(
    compiled: CompiledScene, method: Method, state: State, end: tuple[Status, int], moment: float, seeding: Seeding
) -> str:
    """Return the sentence about a frame that ended with this status and particle."""
    (status, particle), first, scene = end, seeding.first, compiled.scene
    sentence = f"{_failed(moment)} {first + particle}: {status.sentence}"
    if status in (Status.STALLED, Status.TIMELESS):
        sentence += _place(scene, state, particle, moment) + _cause(scene, status)
    if status == Status.STALLED and scene.moves():
        sentence += _CLOSED
    if status == Status.TOO_FAST:
        sentence += f", {method.too_fast(scene)}"
    if status == Status.TOO_DEEP:
        sentence = f"{_failed(moment)} {first + particle}{softness.of_passing(scene, method, state, particle, moment)}"
    if status == Status.SENT_WRONG:
        sentence += _of_law(compiled, state, particle, moment, seeding)
    multipliers = state.multipliers
    if status == Status.UNCONVERGED and multipliers is not None:
        remaining, stored = multipliers.remaining[particle], multipliers.stored_energy[particle]
        sweeps, mass = multipliers.sweeps[particle], state.mass[particle]
        sentence += f" {method.failure(moment, remaining, sweeps, stored, mass)}"
    return sentence


def after(
    scene: Scene, before: float, particle: int, status: Status, place: Any, moment: float, radius: float | None = None
) -> str:
    """Return the sentence about the frame after the time `before` [s], which ended with a particle at a moment [s].

    A ball has a radius [m].
    """
    gap = "" if radius is None or status != Status.TIMELESS else _in_gap(scene, place, moment, radius)
    if status == Status.STALLED and scene.moves():
        gap = _CLOSED
    return (
        f"the frame after {before:g} s failed at particle {particle}: {status.sentence}; it is at "
        f"{shown(place, 6)} m at {moment:.9g} s{gap or _cause(scene, status)}"
    )


def _in_gap(scene: Scene, place: Any, moment: float, radius: float) -> str:
    """Return the text about a ball that touches several walls at once, empty if it does not."""
    outside = scene.distances_outside(np.array(place)[:, None], moment, np.array([radius]))[:, 0]
    touched = np.flatnonzero(outside >= -_TOUCHES * scene.finite_size()).tolist()
    if len(touched) < 2:
        return ""
    names = " and ".join(named(wall, scene.surfaces[wall]) for wall in touched)
    return (
        f", where it touches {names} at once: a gap as wide as the ball, {2.0 * radius:g} m, leaves it no way between "
        "two impacts; make the gap wider than that or the ball smaller, or let it not come there"
    )


def _cause(scene: Scene, status: Status) -> str:
    """Return the text about another possible cause of a failure: a user-defined phi, or the engine itself."""
    if text := unproved(scene):
        return f"; {text}"
    return _REPORT if status == Status.TIMELESS else ""


def unproved(scene: Scene) -> str:
    """Return a sentence about each user-defined surface with a phi that may not be smooth, else an empty text."""
    return "; ".join(text for i in range(len(scene.surfaces)) if (text := _unproved(scene, i)))


def _unproved(scene: Scene, i: int) -> str:
    surface, texts = scene.surfaces[i], dict[str, None]()
    for part, place in zip(surface.surfaces(), surface.places(), strict=True):
        if may := part.unproved():
            of = "".join(f".parts[{k}]" for k in place)
            named = f"surfaces[{i}]{of} ({type(part).__name__})"
            texts[f"phi of {named} must be twice differentiable, but is user-defined and may have {may}"] = None
    return "; ".join(texts)


def require_admissible(
    scene: Scene, state: State, lost: NDArray[np.bool_], seen: dict[str, Any], deepest: float, moment: float, first: int
) -> None:
    """Raise a `RunError` if a state is not finite, or deeper than `deepest` [m] in a wall, or a ball is `lost`."""
    # A number that is not finite spreads to the energy or, from a position, to the angular momentum.
    if not (math.isfinite(seen["total_energy"]) and np.isfinite(seen["angular_momentum"]).all()):
        position = state.position[:, : len(state.mass)]
        good = np.isfinite(position).all(axis=0) & np.isfinite(state.velocity[:, : len(state.mass)]).all(axis=0)
        raise RunError(f"{_failed(moment)} {first + int(np.argmin(good))}: {Status.NOT_FINITE.sentence}")
    position, size, radius = state.position[:, : len(state.mass)], scene.finite_size(), state.radius
    if seen["max_penetration"] <= deepest and not lost.any():
        return
    distances = scene.distances_outside(position, moment, radius)
    # Far out in an open scene the round-off of a position is relative to its magnitude.
    outside = distances > deepest / size * np.maximum(np.abs(position).max(axis=0), size)
    outside |= lost & (distances > (0.0 if radius is None else radius))
    outside &= ~state.gone()
    if outside.any():
        wall, particle = np.unravel_index(int(np.argmax(distances * outside)), distances.shape)
        depth = f"{distances[wall, particle]:.3g} m outside {named(int(wall), scene.surfaces[wall])}"
        phi = "; ".join(filter(None, (depth, _unproved(scene, int(wall)))))
        raise RunError(f"{_failed(moment)} {first + particle}: it is {phi}")


def sentence_of_coming(
    scene: Scene, state: State, found: tuple[int, int], depth: float, instant: float, first: int = 0
) -> str:
    """Return the sentence about a particle at a depth [m] in a wall that comes; `found` is (surface, particle)."""
    wall, particle = found
    place = shown(state.position[:, particle], 6)
    return (
        f"{named(wall, scene.surfaces[wall])} must come where no particle is: at {instant:g} s particle "
        f"{first + particle} is {depth:.3g} m inside, at {place} m; let it come later or elsewhere, or start that "
        "particle elsewhere"
    )


def _place(scene: Scene, state: State, particle: int, moment: float) -> str:
    """Return the text of the place of a particle that does not go on, and of the time if its contacts may last."""
    remaining = 0.0 if state.contacts is None else state.contacts.remaining[particle]
    place, found = state.position[:, particle], moment - remaining
    wall = int(np.argmax(scene.distances_outside(place[:, None], found)[:, 0]))
    where = f"{shown(place, 6)} m, at {named(wall, scene.surfaces[wall])}"
    return f"; it is at {where}" + (f" at {found:.9g} s" if remaining > 0.0 else "")


def _of_law(compiled: CompiledScene, state: State, particle: int, moment: float, seeding: Seeding) -> str:
    """Return the text on the law that failed and on its arguments, which the kernel left in the state."""
    scene, contacts, laws = compiled.scene, state.contacts, compiled.laws
    assert contacts is not None
    assert laws is not None
    wall, walls = contacts.met[particle], compiled.walls(moment).at(contacts.remaining[particle])
    r, v = column(state.position, 0, particle), column(state.velocity, 0, particle)
    n = -1.0 * walls.unit_normal(wall, r)
    u = walls.velocity(wall, r) if scene.moves() else ZERO
    random = seeding.of_impact(particle, state.impacts[particle], laws)
    with np.errstate(all="ignore"):
        for one in (one for one in laws.own or () if one.has(wall)):
            for k, law in enumerate(one.laws_of(wall)):
                given = law.leave(v, n, u, random.of_law(k), state.mass[particle])
                if wrong := why_wrong(given, v, n, u, scene.moves()):
                    name = f"surfaces[{compiled.numbering.members[0, int(wall)]}].laws[{k}]"
                    return f"; {name} {wrong}; {sentence_of(law, given, v, n, u)}"
                v = mirrored(leave_of(given).v, n, u)
    return ""


def _failed(moment: float) -> str:
    return f"the frame at {moment:g} s failed at particle"


@contextlib.contextmanager
def explained(task: Task) -> Iterator[None]:
    """Raise a `SceneError` with the name of user-defined code that the compiler refuses."""
    try:
        yield
    except Exception as error:
        named = dict(_of_users(task)) if type(error).__module__.startswith("numba.") else {}
        if not named:
            raise
        raise SceneError(_sentence(str(error), named)) from error


def _sentence(text: str, named: dict[str, type]) -> str:
    for place, line in reversed(_PLACE.findall(text)):
        for name, kind in named.items():
            file = getattr(sys.modules.get(kind.__module__), "__file__", None)
            if file is not None and Path(file).name == Path(place).name:
                return f"{name} ({kind.__name__}) cannot be compiled, by line {line} of {file}; {_ADVICE}"
    reason = _REASON.findall(text)
    names = " or ".join(f"{name} ({kind.__name__})" for name, kind in named.items())
    return f"{names} cannot be compiled{f': {reason[-1]}' if reason else ''}; {_ADVICE}"


def _of_users(task: Task) -> Iterator[tuple[str, type]]:
    """Yield the laws, surfaces and methods of a run that are not of this package, with their names in the scene."""
    candidates: list[tuple[str, Any]] = [("method", task.method)]
    for i, surface in enumerate(task.scene.surfaces):
        candidates.append((f"surfaces[{i}]", getattr(surface, "parameters", surface)))
        candidates += [(f"surfaces[{i}].laws[{k}]", law) for k, law in enumerate(surface.laws)]
    for name, one in candidates:
        if type(one).__module__.partition(".")[0] not in (__name__.partition(".")[0], "builtins"):
            yield name, type(one)
